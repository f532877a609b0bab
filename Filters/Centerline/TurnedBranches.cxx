#include "TurnedBranches.h"

#include "CheapestFirst.h"
#include "CrossFrame.h"
#include "CurveGeometry.h"
#include "GridIndex.h"
#include "Median.h"
#include "TreeLinks.h"
#include "VoxelLattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double AgainstFlow = 2.0;  ///< rad between the flow and what leaves against it
constexpr double CourseLength = 6.0; ///< mm along which a direction is measured
constexpr double Beside = 8.0;       ///< mm between walls of vessels that run side by side
constexpr double Parallel = 0.65;    ///< cosine between their courses
constexpr double LongestPath = 30.0; ///< mm to the true root
/// Contrast along a way, as a share of the branch's own: mean, and least over 2 mm.
constexpr double MeanShare = 0.5;
constexpr double MinimumShare = 0.3;
constexpr double Window = 2.0;
constexpr double MostDetour = 1.6; ///< length of a way over the distance of its ends
/// The way leaves the end in the branch's own direction, not across to what is beside it.
constexpr double Cone = 0.65; ///< cosine
constexpr double ConeReach = 5.0;

class TurnedFinder
{
public:
  TurnedFinder(const ImageInterpolator& image, const VesselTree& tree, double voxel)
    : Image(image)
    , Tree(tree)
    , Links(tree)
    , Voxel(voxel)
  {
    if (!(voxel > 0.0))
    {
      throw std::invalid_argument("turned branches: a voxel must be longer than 0");
    }
  }

  std::vector<TurnedBranch> Run() const;

private:
  /// Points upstream of a branch, from its begin to the root, and the flow at each.
  struct Upstream
  {
    std::vector<std::int64_t> points;
    std::vector<Vector3> flow;
  };

  Upstream Above(std::size_t branch) const;
  bool RunsBack(std::size_t branch, const Upstream& above, TurnedBranch& turned) const;
  void FindRoot(const Upstream& above, TurnedBranch& turned) const;
  bool IsSeen(const std::vector<Vector3>& way, double own, double around) const;
  bool IsPath(
    const std::vector<Vector3>& way, const Vector3& flow, double own, double around) const;
  /// Of the vessel and of what is around it, without what other vessels cover.
  std::pair<double, double> Values(const TurnedBranch& turned) const;

  const ImageInterpolator& Image;
  const VesselTree& Tree;
  const TreeLinks Links;
  double Voxel;
};

TurnedFinder::Upstream TurnedFinder::Above(std::size_t branch) const
{
  Upstream above;
  std::int64_t from = this->Tree.branches[branch].points.front();
  for (std::int64_t up = this->Links.parent[branch]; up >= 0; up = this->Links.parent[up])
  {
    const std::vector<std::int64_t>& points = this->Tree.branches[up].points;
    const auto end = std::find(points.begin(), points.end(), from);
    for (auto i = std::distance(points.begin(), end); i >= 0; --i)
    {
      above.points.push_back(points[i]);
    }
    from = points.front();
    if (!this->Links.IsRoot(up))
    {
      above.points.pop_back(); // the next one has it as well
    }
  }
  const std::size_t count = above.points.size();
  const auto at = [&](std::size_t i) -> const Vector3&
  { return this->Tree.points[above.points[i]]; };
  for (std::size_t i = 0; i < count; ++i)
  {
    std::size_t up = i;
    for (double passed = 0.0; up + 1 < count && passed < CourseLength; ++up)
    {
      passed += (at(up + 1) - at(up)).norm();
    }
    std::size_t down = up > i ? i : i - std::min<std::size_t>(i, 8);
    above.flow.push_back((at(down) - at(up)).normalized());
  }
  return above;
}

/// Whether a branch leaves against the flow and stays beside what it comes from.
bool TurnedFinder::RunsBack(std::size_t branch, const Upstream& above, TurnedBranch& turned) const
{
  const std::vector<std::int64_t>& points = this->Tree.branches[branch].points;
  const std::vector<double> along = ArcLengths(this->Tree, points);
  const auto begin = static_cast<std::size_t>(points.front());
  const double mouth = this->Tree.radius[begin] + 1.0;
  const auto within = [&](double passed)
  {
    return std::min(points.size() - 1,
      static_cast<std::size_t>(
        std::lower_bound(along.begin(), along.end(), passed) - along.begin()));
  };
  turned.branch = branch;
  turned.contact = within(mouth);
  turned.length = along.back();
  if (along.back() < mouth + 0.5 * CourseLength || above.points.size() < 4)
  {
    return false;
  }
  const Vector3 leaving = this->Tree.points[points[within(mouth + CourseLength)]] -
    this->Tree.points[points[turned.contact]];
  if (!(UnitAngle(leaving.normalized(), above.flow.front()) > AgainstFlow))
  {
    return false;
  }
  double all = 0.0;
  double beside = 0.0;
  for (std::size_t i = turned.contact; i + 1 < points.size(); ++i)
  {
    const Vector3& here = this->Tree.points[points[i]];
    const Vector3 course = (this->Tree.points[points[i + 1]] - here).normalized();
    double gap = Beside;
    bool against = false;
    for (std::size_t n = 0; n < above.points.size(); ++n)
    {
      const auto p = static_cast<std::size_t>(above.points[n]);
      const double away =
        (this->Tree.points[p] - here).norm() - this->Tree.radius[p] - this->Tree.radius[points[i]];
      if (away < gap)
      {
        gap = away;
        against = course.dot(above.flow[n]) < -Parallel;
      }
    }
    all += along[i + 1] - along[i];
    beside += gap < Beside && against ? along[i + 1] - along[i] : 0.0;
  }
  return beside > 0.5 * all;
}

std::pair<double, double> TurnedFinder::Values(const TurnedBranch& turned) const
{
  const std::vector<std::int64_t>& points = this->Tree.branches[turned.branch].points;
  std::vector<double> own;
  std::vector<double> around;
  for (std::size_t i = turned.contact; i + 1 < points.size(); ++i)
  {
    const auto p = static_cast<std::size_t>(points[i]);
    const Vector3 tangent = (this->Tree.points[points[i + 1]] - this->Tree.points[p]).normalized();
    if (!tangent.allFinite())
    {
      continue;
    }
    own.push_back(this->Image.At(this->Tree.points[p]));
    const CrossFrame frame(tangent);
    for (int side = 0; side < 8; ++side)
    {
      around.push_back(this->Image.At(
        this->Tree.points[p] + (this->Tree.radius[p] + 2.0 * this->Voxel) * frame.Ray(side, 8)));
    }
  }
  // Half of it may be another vessel or a chamber.
  return { MedianOf(own), QuantileOf(around, 0.25) };
}

bool TurnedFinder::IsSeen(const std::vector<Vector3>& way, double own, double around) const
{
  std::vector<double> shares;
  for (std::size_t i = 1; i < way.size(); ++i)
  {
    const double length = (way[i] - way[i - 1]).norm();
    const int pieces = std::max(1, static_cast<int>(std::lround(length / (0.5 * this->Voxel))));
    for (int piece = 1; piece <= pieces; ++piece)
    {
      const Vector3 at = way[i - 1] + static_cast<double>(piece) / pieces * (way[i] - way[i - 1]);
      shares.push_back((this->Image.At(at) - around) / (own - around));
    }
  }
  const auto window = std::max<std::size_t>(
    1, std::min(shares.size(), static_cast<std::size_t>(Window / (0.5 * this->Voxel))));
  double sum = 0.0;
  double all = 0.0;
  double minimum = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < shares.size(); ++i)
  {
    const double share = std::min(1.0, shares[i]);
    all += share;
    sum += share - (i >= window ? std::min(1.0, shares[i - window]) : 0.0);
    if (i + 1 >= window)
    {
      minimum = std::min(minimum, sum / static_cast<double>(window));
    }
  }
  return !shares.empty() && all >= MeanShare * static_cast<double>(shares.size()) &&
    minimum >= MinimumShare;
}

/// Whether a way, from its root on, is one that a branch takes.
bool TurnedFinder::IsPath(
  const std::vector<Vector3>& way, const Vector3& flow, double own, double around) const
{
  const double length = PolylineLength(way);
  const Vector3 leaving = way[std::min<std::size_t>(way.size() - 1, 6)] - way.front();
  // A root against the flow again is none.
  return length <= LongestPath && length <= MostDetour * (way.back() - way.front()).norm() + 1.5 &&
    leaving.normalized().dot(flow) >= std::cos(AgainstFlow) && this->IsSeen(way, own, around);
}

/// The cheapest way from a branch's end to a vessel upstream, over a lattice of voxels.
void TurnedFinder::FindRoot(const Upstream& above, TurnedBranch& turned) const
{
  const std::vector<std::int64_t>& points = this->Tree.branches[turned.branch].points;
  const Vector3& end = this->Tree.points[points.back()];
  const std::vector<double> along = ArcLengths(this->Tree, points);
  std::size_t back = points.size() - 1;
  while (back > turned.contact && along.back() - along[back] < 0.5 * CourseLength)
  {
    --back;
  }
  const Vector3 ahead = (end - this->Tree.points[points[back]]).normalized();
  const auto [own, around] = this->Values(turned);
  if (!ahead.allFinite() || !(own > around))
  {
    return;
  }
  const int reach = static_cast<int>(std::ceil(LongestPath / this->Voxel));
  ImageGrid grid;
  grid.extent = { -reach, reach, -reach, reach, -reach, reach };
  grid.origin = end;
  grid.spacing.setConstant(this->Voxel);
  const VoxelLattice lattice(grid);
  // Lumens: of what is upstream, where the way may end, and of all else, where it may not pass.
  constexpr std::int32_t open = -1;
  constexpr std::int32_t closed = -2;
  const std::int64_t size = lattice.Size[0];
  std::vector<std::int32_t> lumen(size * size * size, open);
  const auto mark = [&](std::size_t p, std::int32_t value)
  {
    const Vector3 at = (this->Tree.points[p] - end) / this->Voxel + Vector3::Constant(reach);
    const double radius = this->Tree.radius[p] / this->Voxel;
    BoxAround(at, Vector3::Constant(radius), { 0, 2 * reach, 0, 2 * reach, 0, 2 * reach })
      .ForEach(
        [&](int i, int j, int k)
        {
          if ((Vector3(i, j, k) - at).norm() <= radius)
          {
            lumen[lattice.Index(i, j, k)] = value;
          }
        });
  };
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    if (&branch != &this->Tree.branches[turned.branch])
    {
      for (const std::int64_t p : branch.points)
      {
        mark(p, closed);
      }
    }
  }
  for (std::size_t n = 0; n < above.points.size(); ++n)
  {
    mark(above.points[n], static_cast<std::int32_t>(n));
  }
  std::vector<float> cost(lumen.size(), std::numeric_limits<float>::infinity());
  std::vector<std::int64_t> before(lumen.size(), -1);
  CheapestFirst queue;
  const std::int64_t start = lattice.Index(reach, reach, reach);
  cost[start] = 0.0F;
  queue.push({ 0.0F, start });
  std::int64_t arrived = -1;
  while (!queue.empty())
  {
    const WaitingVoxel top = queue.top();
    queue.pop();
    if (top.cost > cost[top.voxel])
    {
      continue;
    }
    if (top.voxel != start && lumen[top.voxel] >= 0)
    {
      arrived = top.voxel;
      break;
    }
    const std::array<int, 3> from = lattice.Place(top.voxel);
    for (const VoxelLattice::Neighbour& near : lattice.Around)
    {
      const std::array<int, 3> to{ from[0] + near.di, from[1] + near.dj, from[2] + near.dk };
      if (!lattice.Contains(to[0], to[1], to[2]))
      {
        continue;
      }
      const std::int64_t next = top.voxel + near.offset;
      const Vector3 at = lattice.World(to);
      const Vector3 offset = at - end;
      if (lumen[next] == closed || !this->Image.Contains(at) ||
        (offset.norm() < ConeReach && offset.dot(ahead) < Cone * offset.norm()))
      {
        continue;
      }
      const double share = std::clamp((this->Image.At(at) - around) / (own - around), 0.0, 1.0);
      const double step = this->Voxel * Vector3(near.di, near.dj, near.dk).norm();
      const auto more = static_cast<float>(step / (0.03 + share * share));
      if (top.cost + more < cost[next])
      {
        cost[next] = top.cost + more;
        before[next] = top.voxel;
        queue.push({ cost[next], next });
      }
    }
  }
  if (arrived < 0)
  {
    return;
  }
  std::vector<Vector3> way;
  for (std::int64_t at = arrived; at >= 0; at = before[at])
  {
    way.push_back(lattice.World(lattice.Place(at)));
  }
  const std::int32_t meeting = lumen[arrived];
  if (this->IsPath(way, above.flow[meeting], own, around))
  {
    turned.root = above.points[meeting];
    turned.way = std::move(way);
  }
}

std::vector<TurnedBranch> TurnedFinder::Run() const
{
  std::vector<TurnedBranch> found;
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    if (!this->Links.IsTip(b) || this->Links.IsRoot(b))
    {
      continue;
    }
    const Upstream above = this->Above(b);
    TurnedBranch turned;
    if (this->RunsBack(b, above, turned))
    {
      this->FindRoot(above, turned);
      found.push_back(std::move(turned));
    }
  }
  return found;
}
}

std::vector<TurnedBranch> FindTurnedBranches(
  const ImageInterpolator& image, const VesselTree& tree, double voxel)
{
  return TurnedFinder(image, tree, voxel).Run();
}
}
