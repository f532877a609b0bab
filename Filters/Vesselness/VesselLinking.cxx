#include "VesselLinking.h"

#include "BifurcationFit.h"
#include "CheapestFirst.h"
#include "CrossFrame.h"
#include "FittedOdds.h"
#include "Median.h"
#include "SparseVoxels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

namespace coronary
{
namespace
{
constexpr float Unreached = std::numeric_limits<float>::infinity();
/// Vesselness, in that of a clear tube, that a piece's voxels have at least: bones and chambers have less.
constexpr float MinimumTube = 0.3F;
/// Vesselness, in the same unit, that tells a thin lumen or a wall's tube from noise.
constexpr float VisibleTube = 0.2F;
/// Brighter than blood by this factor is bone or calcium, darker than tissue by it is lung.
constexpr float TooBright = 1.6F;
constexpr float Lung = -1.5F;
constexpr double ShellNear = 2.0; ///< mm from an end: where its direction and calibre are measured
constexpr double ShellFar = 5.0;
constexpr double ShellEnd = 8.0;
constexpr double WallGap = 8.0;  ///< mm: longest link to a wall
constexpr double FreeGap = 12.0; ///< mm: longer ones need more than ends that point at each other
/// Ends that face each other are one vessel's, and it runs between them as a smooth curve does: a way that strays from it by
/// this share of the gap is another thing's, unless it is as clear as a vessel.
constexpr double Facing = 0.6;        ///< rad of each end to the other
constexpr double MinimumFacing = 5.0; ///< mm: nearer ends may face anywhere
constexpr double Straying = 0.2;      ///< of the gap
constexpr double ClearTube = 0.5;     ///< vesselness, in that of a clear tube, throughout

/// Fitted to the links that came to mind in phantoms (scripts/fit-odds.sh).
constexpr double Intercept = 1.33;
constexpr std::array<FittedSign, NumberOfLinkSigns> Signs{ {
  { "to_wall", -0.65 },
  { "unseen", -1.45 },
  { "long_unseen", -0.27 },
  { "turn_of_piece", -0.57 },
  { "turn_of_tree", -0.86 },
  { "thinner", -1.29 },
  { "wider", -0.54 },
  { "outgrows", -7.17 },
  { "abrupt", 1.75 },
  { "length", 1.07 },
  { "great_length", 0.42 },
  { "darker_than_end", -0.80 },
  { "darker_than_wall", -1.37 },
  { "brighter", -5.92 },
  { "clear", 0.81 },
} };

/// Voxels that hang together, with distances within them.
class VoxelPiece
{
public:
  VoxelPiece(const VoxelLattice& lattice, std::vector<std::int64_t> voxels)
    : L(lattice)
    , Voxels(std::move(voxels))
    , Number(MakeNumbers(lattice, this->Voxels))
  {
  }

  std::size_t Size() const { return this->Voxels.size(); }
  const std::vector<std::int64_t>& All() const { return this->Voxels; }
  bool Has(std::int64_t voxel) const { return this->Number.Get(this->L.Place(voxel)) >= 0; }
  std::int64_t Voxel(std::int32_t n) const { return this->Voxels[n]; }
  Vector3 Position(std::int32_t n) const { return this->L.World(this->L.Place(this->Voxel(n))); }

  /// Calls f(number, mm) for the neighbours that belong to the piece.
  template <typename F>
  void Neighbours(std::int32_t n, const F& f) const
  {
    const std::array<int, 3> at = this->L.Place(this->Voxel(n));
    for (const VoxelLattice::Neighbour& next : this->L.Around)
    {
      const std::int32_t number =
        this->Number.Get(at[0] + next.di, at[1] + next.dj, at[2] + next.dk);
      if (number >= 0)
      {
        f(number, next.length);
      }
    }
  }

  /// What is within `reach` mm of a start, nearest first: numbers and mm, and where the way came from.
  struct Reached
  {
    std::int32_t number;
    float distance;
    std::int32_t before; ///< place in the list, -1 at the start
  };
  std::vector<Reached> Around(std::int32_t start, float reach) const
  {
    std::vector<Reached> reached;
    thread_local std::vector<char> done; // 0 between calls
    done.resize(std::max(done.size(), this->Size()), 0);
    CheapestFirst queue;
    queue.push({ 0.0F, start, -1 });
    while (!queue.empty())
    {
      const WaitingVoxel top = queue.top();
      queue.pop();
      if (done[top.voxel] != 0)
      {
        continue;
      }
      done[top.voxel] = 1;
      const auto number = static_cast<std::int32_t>(top.voxel);
      const auto place = static_cast<std::int32_t>(reached.size());
      reached.push_back({ number, top.cost, top.before });
      this->Neighbours(number,
        [&](std::int32_t next, float length)
        {
          if (top.cost + length <= reach && done[next] == 0)
          {
            queue.push({ top.cost + length, next, place });
          }
        });
    }
    for (const Reached& r : reached)
    {
      done[r.number] = 0;
    }
    return reached;
  }

private:
  static SparseVoxels<std::int32_t> MakeNumbers(
    const VoxelLattice& lattice, const std::vector<std::int64_t>& voxels)
  {
    std::array<int, 3> low = lattice.Size;
    std::array<int, 3> high{ -1, -1, -1 };
    for (const std::int64_t voxel : voxels)
    {
      const std::array<int, 3> at = lattice.Place(voxel);
      for (int axis = 0; axis < 3; ++axis)
      {
        low[axis] = std::min(low[axis], at[axis]);
        high[axis] = std::max(high[axis], at[axis]);
      }
    }
    SparseVoxels<std::int32_t> numbers(low, high, -1);
    for (std::size_t n = 0; n < voxels.size(); ++n)
    {
      numbers.At(lattice.Place(voxels[n])) = static_cast<std::int32_t>(n);
    }
    return numbers;
  }

  const VoxelLattice& L;
  std::vector<std::int64_t> Voxels;
  SparseVoxels<std::int32_t> Number;
};

/// Where a piece or the tree ends.
struct VesselEnd
{
  std::int32_t number = -1;
  Vector3 position = Vector3::Zero();
  Vector3 outwards = Vector3::Zero(); ///< unit
  double radius = 0.0;                ///< mm, 0: not measured
  double lumen = 0.0;                 ///< share of the contrast
  double root = 0.0;                  ///< mm from where the tree begins; 0: an end like others
};

class Linker
{
public:
  Linker(const LinkingImage& image, const LinkingSettings& settings)
    : I(image)
    , L(image.lattice)
    , Settings(settings)
  {
    this->Lumen.reference.lumen = image.blood;
    this->Lumen.reference.background = image.tissue;
    this->Lumen.maximumRadius = image.maximumRadius;
  }

  std::vector<VesselLink> Run(
    const std::vector<std::pair<std::int64_t, float>>& tree, const ProgressCallback& progress);

private:
  struct Orphan
  {
    VoxelPiece piece;
    double length = 0.0; ///< mm between its farthest ends
    std::vector<VesselEnd> ends;
    std::vector<double>
      growth; ///< of an end: how much wider the vessel becomes behind it, a factor; -1: not measured
  };
  /// What a piece was found to be: a round later most pieces are the same.
  struct Description
  {
    std::vector<std::int64_t> voxels; ///< of a piece that is no orphan
    std::unique_ptr<Orphan> orphan;

    const std::vector<std::int64_t>& Voxels() const
    {
      return this->orphan ? this->orphan->piece.All() : this->voxels;
    }
  };

  std::vector<std::vector<std::int64_t>> Pieces(
    const std::vector<std::pair<std::int64_t, float>>& tree) const;
  bool InLung(const std::vector<std::int64_t>& piece) const;
  std::optional<VesselEnd> EndAt(const VoxelPiece& piece, std::int32_t number) const;
  std::vector<VesselEnd> EndsOf(
    const VoxelPiece& piece, const std::vector<VoxelPiece::Reached>& distances) const;
  double Growth(const VoxelPiece& piece, const VesselEnd& end) const;
  std::optional<Orphan> Describe(std::vector<std::int64_t> voxels) const;
  void DescribeAll(std::vector<std::vector<std::int64_t>> pieces, const ProgressCallback& progress);
  std::vector<Vector3> Behind(const VoxelPiece& piece, const VesselEnd& end) const;
  VesselLink BestLink(Orphan& orphan, const std::vector<VesselEnd>& tips,
    std::vector<ConsideredLink>& considered) const;
  float Evidence(std::int64_t voxel) const;
  float Price(std::int64_t voxel) const;
  bool FindPath(const VoxelPiece& piece, const VesselEnd& end, const Vector3& target, double within,
    VesselLink& link) const;
  bool Curve(const VesselEnd& end, const VesselEnd& tip, VesselLink& link) const;
  double Clearest(const VesselLink& link) const;
  bool Strays(const VesselLink& way, const VesselLink& curve, const VesselEnd& end,
    const VesselEnd& tip) const;
  double RadiusByVolume(const Vector3& place) const;
  template <typename Use>
  double BrightShare(const Vector3& place, double reach, const Use& use) const;
  void Describe(
    const Orphan& orphan, std::size_t number, const VesselEnd* tip, VesselLink& link) const;
  static double Judge(const VesselLink& link, const VesselEnd* tip);

  const LinkingImage& I;
  const VoxelLattice& L;
  const LinkingSettings& Settings;
  LumenSettings Lumen;
  std::map<std::int64_t, Description> Described; ///< by the pieces' first voxels

public:
  std::vector<ConsideredLink> Considered; ///< by the last run
};

/// Connected voxels that look like vessel around the tree, and are none of it.
std::vector<std::vector<std::int64_t>> Linker::Pieces(
  const std::vector<std::pair<std::int64_t, float>>& tree) const
{
  // As far as the heart reaches around the tree.
  constexpr double margin = 60.0; // mm
  std::array<int, 3> low = this->L.Size;
  std::array<int, 3> high{ 0, 0, 0 };
  for (const auto& [voxel, path] : tree)
  {
    const std::array<int, 3> at = this->L.Place(voxel);
    for (int axis = 0; axis < 3; ++axis)
    {
      low[axis] = std::min(low[axis], at[axis]);
      high[axis] = std::max(high[axis], at[axis]);
    }
  }
  for (int axis = 0; axis < 3; ++axis)
  {
    const int reach = static_cast<int>(margin / this->L.Spacing[axis]);
    low[axis] = std::max(0, low[axis] - reach);
    high[axis] = std::min(this->L.Size[axis] - 1, high[axis] + reach);
  }
  const int slices = high[2] - low[2] + 1;
  std::vector<std::vector<std::int64_t>> found(static_cast<std::size_t>(std::max(0, slices)));
  ParallelFor(slices, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t slice = first; slice < last; ++slice)
      {
        for (int j = low[1]; j <= high[1]; ++j)
        {
          for (int i = low[0]; i <= high[0]; ++i)
          {
            const std::int64_t p = this->L.Index(i, j, low[2] + static_cast<int>(slice));
            if (this->I.tube(p) >= MinimumTube && this->I.share(p) <= TooBright &&
              this->I.couldBelong(p))
            {
              found[slice].push_back(p);
            }
          }
        }
      }
    });
  std::vector<std::int64_t> all;
  for (const std::vector<std::int64_t>& slice : found)
  {
    all.insert(all.end(), slice.begin(), slice.end());
  }
  std::vector<char> seen(all.size(), 0);
  std::vector<std::vector<std::int64_t>> pieces;
  // A tube of two voxels' area and the least length has this many.
  const auto minimum =
    static_cast<std::size_t>(this->Settings.minimumPiece / std::cbrt(this->L.VoxelVolume()) * 1.5);
  for (std::size_t n = 0; n < all.size(); ++n)
  {
    std::vector<std::int64_t> piece = this->L.Connected(all[n],
      [&](std::int64_t voxel)
      {
        const auto at = std::lower_bound(all.begin(), all.end(), voxel);
        return at != all.end() && *at == voxel && std::exchange(seen[at - all.begin()], 1) == 0;
      });
    if (piece.size() >= minimum)
    {
      std::sort(piece.begin(), piece.end());
      pieces.push_back(std::move(piece));
    }
  }
  return pieces;
}

/// Vessels of the lung are as bright, and lie in air.
bool Linker::InLung(const std::vector<std::int64_t>& piece) const
{
  const std::size_t stride = std::max<std::size_t>(1, piece.size() / 200);
  int lung = 0;
  int all = 0;
  constexpr double away = 4.0; // mm
  for (std::size_t n = 0; n < piece.size(); n += stride)
  {
    const std::array<int, 3> at = this->L.Place(piece[n]);
    for (int face = 0; face < 6; ++face)
    {
      std::array<int, 3> to = at;
      const int step = std::max(1, static_cast<int>(std::lround(away / this->L.Spacing[face / 2])));
      to[face / 2] += face % 2 != 0 ? step : -step;
      if (this->L.Contains(to[0], to[1], to[2]))
      {
        ++all;
        lung += this->I.share(this->L.Index(to[0], to[1], to[2])) < Lung ? 1 : 0;
      }
    }
  }
  return 3 * lung > all;
}

/// The end at a voxel, if it is one: all of the piece that is near lies on one side.
std::optional<VesselEnd> Linker::EndAt(const VoxelPiece& piece, std::int32_t number) const
{
  VesselEnd end;
  end.number = number;
  end.position = piece.Position(number);
  Vector3 inwards = Vector3::Zero();
  Vector3 near = Vector3::Zero();
  Vector3 far = Vector3::Zero();
  int nearCount = 0;
  int farCount = 0;
  for (const VoxelPiece::Reached& r : piece.Around(number, static_cast<float>(ShellEnd)))
  {
    const Vector3 offset = piece.Position(r.number) - end.position;
    if (r.distance >= ShellNear && r.distance < ShellFar)
    {
      inwards += offset.normalized();
      near += offset;
      ++nearCount;
    }
    else if (r.distance >= ShellFar)
    {
      far += offset;
      ++farCount;
    }
  }
  if (nearCount < 3 || farCount < 1)
  {
    return std::nullopt;
  }
  // In a tube that goes on to both sides the directions cancel out.
  constexpr double oneSided = 0.8;
  if (inwards.norm() < oneSided * nearCount)
  {
    return std::nullopt;
  }
  near /= nearCount;
  far /= farCount;
  end.outwards = (near - far).normalized();
  if (!end.outwards.allFinite())
  {
    return std::nullopt;
  }
  // A blunt end's outermost voxel lies beside its axis.
  const Vector3 middle = near;
  const Vector3 tip = end.position;
  end.position = tip + near + (-near).dot(end.outwards) * end.outwards;
  const LumenSection section = MeasureLumen(
    this->I.image, tip + middle, end.outwards, 2.0 * std::cbrt(this->L.VoxelVolume()), this->Lumen);
  if (section.confidence > 0.3)
  {
    end.radius = section.radius;
  }
  end.lumen = (section.lumen - this->I.tissue) / (this->I.blood - this->I.tissue);
  return end;
}

/// Ends are where the distance from the farthest place is greatest around.
std::vector<VesselEnd> Linker::EndsOf(
  const VoxelPiece& piece, const std::vector<VoxelPiece::Reached>& distances) const
{
  std::vector<float> away(piece.Size(), 0.0F);
  for (const VoxelPiece::Reached& r : distances)
  {
    away[r.number] = r.distance;
  }
  std::vector<std::int32_t> tips;
  for (std::size_t n = 0; n < piece.Size(); ++n)
  {
    bool maximum = true;
    const auto here = static_cast<std::int32_t>(n);
    piece.Neighbours(here,
      [&](std::int32_t next, float)
      {
        const float other = away[next];
        maximum = maximum && (other < away[n] || (other == away[n] && next > here));
      });
    if (maximum)
    {
      tips.push_back(here);
    }
  }
  tips.push_back(distances.front().number);
  std::sort(tips.begin(), tips.end(),
    [&](std::int32_t a, std::int32_t b)
    {
      const float da = away[a];
      const float db = away[b];
      return da != db ? da > db : a < b;
    });
  std::vector<VesselEnd> ends;
  for (const std::int32_t tip : tips)
  {
    const Vector3 position = piece.Position(tip);
    constexpr double apart = 4.0; // mm
    if (std::any_of(ends.begin(), ends.end(),
          [&](const VesselEnd& e) { return (e.position - position).norm() < apart; }))
    {
      continue;
    }
    const std::optional<VesselEnd> end = this->EndAt(piece, tip);
    if (end)
    {
      ends.push_back(*end);
    }
  }
  return ends;
}

/// How much wider the vessel is 10 to 40 mm behind an end: veins widen towards the heart, arteries do not
/// widen away from it.
double Linker::Growth(const VoxelPiece& piece, const VesselEnd& end) const
{
  const std::vector<VoxelPiece::Reached> reached = piece.Around(end.number, 45.0F);
  std::vector<std::int32_t> way;
  for (auto at = static_cast<std::int32_t>(reached.size()) - 1; at >= 0; at = reached[at].before)
  {
    way.push_back(reached[at].number);
  }
  std::reverse(way.begin(), way.end());
  std::vector<double> near;
  std::vector<double> far;
  const std::size_t chord = 4;
  double along = 0.0;
  for (std::size_t n = 1; n < way.size(); ++n)
  {
    along += (piece.Position(way[n]) - piece.Position(way[n - 1])).norm();
    if (n % 2 != 0 || n < chord || n + chord >= way.size())
    {
      continue;
    }
    const Vector3 tangent =
      (piece.Position(way[n + chord]) - piece.Position(way[n - chord])).normalized();
    const LumenSection section = MeasureLumen(this->I.image, piece.Position(way[n]), tangent,
      2.0 * std::cbrt(this->L.VoxelVolume()), this->Lumen);
    if (section.confidence > 0.6)
    {
      (along < 8.0 ? near : far).push_back(section.radius);
    }
  }
  if (near.size() < 3 || far.size() < 5)
  {
    return 1.0;
  }
  return QuantileOf(std::move(far), 0.8) / std::max(0.1, QuantileOf(std::move(near), 0.8));
}

std::optional<Linker::Orphan> Linker::Describe(std::vector<std::int64_t> voxels) const
{
  if (this->InLung(voxels))
  {
    return std::nullopt;
  }
  const double volume = static_cast<double>(voxels.size()) * this->L.VoxelVolume();
  Orphan orphan{ VoxelPiece(this->L, std::move(voxels)), 0.0, {}, {} };
  const std::int32_t first = orphan.piece.Around(0, Unreached).back().number;
  const std::vector<VoxelPiece::Reached> distances = orphan.piece.Around(first, Unreached);
  orphan.length = distances.back().distance;
  // A tube, not a lump.
  if (orphan.length < this->Settings.minimumPiece ||
    volume > M_PI * std::pow(0.6 * this->I.maximumRadius, 2) * orphan.length)
  {
    return std::nullopt;
  }
  orphan.ends = this->EndsOf(orphan.piece, distances);
  return orphan;
}

/// 0 nothing .. 1 a tube.
float Linker::Evidence(std::int64_t voxel) const
{
  const float tube = std::min(1.0F, this->I.tube(voxel) / VisibleTube);
  return std::isfinite(tube) ? std::max(0.0F, tube) : 0.0F;
}

/// Of a millimetre on a way.
float Linker::Price(std::int64_t voxel) const
{
  const float price = 1.0F - 0.85F * this->Evidence(voxel);
  // Bright and no tube: the rim of a chamber.
  return this->I.share(voxel) > 0.5F && this->I.tube(voxel) < MinimumTube ? price + 1.0F : price;
}

/// The cheapest way from an end of a piece to the tree, near a target.
/// @param within  mm from the target that count as there
bool Linker::FindPath(const VoxelPiece& piece, const VesselEnd& end, const Vector3& target,
  double within, VesselLink& link) const
{
  const double gap = (target - end.position).norm();
  const double reach = 0.75 * gap + 3.0;
  const Vector3 middle = 0.5 * (target + end.position);
  // A voxel is looked at once, however many neighbours lead to it.
  struct Known
  {
    std::int64_t before;
    float cost;
    float perMillimetre; ///< negative: not looked at yet; infinite: no way
    bool done;
  };
  std::array<int, 3> low;
  std::array<int, 3> high;
  this->L.BoxAround(middle, reach, low, high);
  const std::int64_t start = piece.Voxel(end.number);
  const std::array<int, 3> startAt = this->L.Place(start);
  for (int axis = 0; axis < 3; ++axis)
  {
    low[axis] = std::min(low[axis], startAt[axis]);
    high[axis] = std::max(high[axis], startAt[axis]);
  }
  SparseVoxels<Known> known(low, high, { -1, Unreached, -1.0F, false });
  CheapestFirst queue;
  known.At(startAt) = { -1, 0.0F, 1.0F, false };
  queue.push({ 0.0F, start });
  std::int64_t arrived = -1;
  while (!queue.empty())
  {
    const WaitingVoxel top = queue.top();
    queue.pop();
    const std::array<int, 3> at = this->L.Place(top.voxel);
    Known& here = known.At(at);
    if (here.done)
    {
      continue;
    }
    here.done = true;
    if (this->I.inTree(top.voxel))
    {
      if ((this->L.World(at) - target).norm() <= within)
      {
        arrived = top.voxel;
        break;
      }
      continue;
    }
    for (const VoxelLattice::Neighbour& step : this->L.Around)
    {
      const std::array<int, 3> to{ at[0] + step.di, at[1] + step.dj, at[2] + step.dk };
      if (!known.Contains(to))
      {
        continue;
      }
      const std::int64_t next = top.voxel + step.offset;
      Known& there = known.At(to);
      if (there.perMillimetre < 0.0F)
      {
        there.perMillimetre = this->I.forbidden(next) || (this->L.World(to) - middle).norm() > reach
          ? Unreached
          : this->Price(next);
      }
      const float cost = top.cost + step.length * there.perMillimetre;
      if (!there.done && cost < there.cost)
      {
        there.cost = cost;
        there.before = top.voxel;
        queue.push({ cost, next });
      }
    }
  }
  if (arrived < 0)
  {
    return false;
  }
  link.voxels.clear();
  link.points.clear();
  link.length = 0.0;
  link.unseen = 0.0;
  for (std::int64_t at = arrived; at >= 0; at = known.Get(this->L.Place(at)).before)
  {
    const Vector3 p = this->L.World(this->L.Place(at));
    if (!link.points.empty())
    {
      const double step = (p - link.points.back()).norm();
      link.length += step;
      link.unseen += step * (1.0 - static_cast<double>(this->Evidence(at)));
    }
    link.points.push_back(p);
    link.voxels.push_back(at);
  }
  // What is seen may bend more than what is not.
  return link.length <= (link.unseen < 0.1 * link.length ? 1.5 : 1.35) * gap + 1.5;
}

/// The smooth curve between two ends that point at each other, where nothing shows the way.
bool Linker::Curve(const VesselEnd& end, const VesselEnd& tip, VesselLink& link) const
{
  const double gap = (end.position - tip.position).norm();
  const BezierCurve curve{ tip.position, tip.position + gap / 3.0 * tip.outwards,
    end.position + gap / 3.0 * end.outwards, end.position };
  // An end's axis may begin outside of its voxels: the way begins within both.
  constexpr double inside = 1.5; // mm
  const double more = gap > 0.0 ? inside / gap : 0.0;
  const int steps = std::max(
    2, static_cast<int>(std::ceil(2.0 * (gap + 2.0 * inside) / this->L.Spacing.minCoeff())));
  link.voxels.clear();
  link.points.clear();
  link.length = 0.0;
  link.unseen = 0.0;
  const auto at = [&](double t) -> Vector3
  {
    if (t < 0.0)
    {
      return tip.position + gap * t * tip.outwards;
    }
    if (t > 1.0)
    {
      return end.position - gap * (t - 1.0) * end.outwards;
    }
    return BezierPoint(curve, t);
  };
  for (int step = 0; step <= steps; ++step)
  {
    const Vector3 p = at(-more + (1.0 + 2.0 * more) * step / steps);
    const std::optional<std::array<int, 3>> place = this->L.Nearest(p);
    if (!place)
    {
      return false;
    }
    const std::int64_t voxel = this->L.Index((*place)[0], (*place)[1], (*place)[2]);
    if (this->I.forbidden(voxel))
    {
      return false;
    }
    if (!link.points.empty())
    {
      const double length = (p - link.points.back()).norm();
      link.length += length;
      link.unseen += length * (1.0 - static_cast<double>(this->Evidence(voxel)));
    }
    link.points.push_back(p);
    if (link.voxels.empty() || link.voxels.back() != voxel)
    {
      link.voxels.push_back(voxel);
    }
  }
  return true;
}

/// Vesselness, in that of a clear tube, that a way has throughout, at most 1.
double Linker::Clearest(const VesselLink& link) const
{
  double clearest = 1.0;
  for (const Vector3& point : link.points)
  {
    if (const std::optional<std::array<int, 3>> at = this->L.Nearest(point))
    {
      clearest = std::min(
        clearest, static_cast<double>(this->I.tube(this->L.Index((*at)[0], (*at)[1], (*at)[2]))));
    }
  }
  return clearest;
}

/// Whether a way between ends that face each other goes elsewhere than they point, along what is no clear vessel.
bool Linker::Strays(
  const VesselLink& way, const VesselLink& curve, const VesselEnd& end, const VesselEnd& tip) const
{
  const Vector3 chord = tip.position - end.position;
  const double gap = chord.norm();
  if (tip.root > 0.0 || gap < MinimumFacing || UnitAngle(end.outwards, chord / gap) > Facing ||
    UnitAngle(tip.outwards, -chord / gap) > Facing)
  {
    return false;
  }
  double farthest = 0.0;
  for (const Vector3& point : way.points)
  {
    double minimum = std::numeric_limits<double>::infinity();
    for (const Vector3& other : curve.points)
    {
      minimum = std::min(minimum, (other - point).norm());
    }
    farthest = std::max(farthest, minimum);
  }
  return farthest > Straying * gap && this->Clearest(way) < ClearTube;
}

/// Of the tree around one of its voxels: that of a tube with so much in it. 0 without any.
double Linker::RadiusByVolume(const Vector3& place) const
{
  const std::optional<std::array<int, 3>> at = this->L.Nearest(place);
  if (!at)
  {
    return 0.0;
  }
  constexpr double reach = 3.0; // mm
  int count = 0;
  this->L.Ball(*at, reach,
    [&](std::int64_t voxel, const std::array<int, 3>&) { count += this->I.inTree(voxel) ? 1 : 0; });
  return std::sqrt(count * this->L.VoxelVolume() / (2.0 * reach * M_PI));
}

/// Share of the contrast that the brightest quarter of some voxels near a place has; 0 without any.
template <typename Use>
double Linker::BrightShare(const Vector3& place, double reach, const Use& use) const
{
  const std::optional<std::array<int, 3>> at = this->L.Nearest(place);
  if (!at)
  {
    return 0.0;
  }
  std::vector<double> shares;
  this->L.Ball(*at, reach,
    [&](std::int64_t voxel, const std::array<int, 3>&)
    {
      if (use(voxel))
      {
        shares.push_back(this->I.share(voxel));
      }
    });
  return QuantileOf(std::move(shares), 0.75);
}

/// Fills the link's signs and what they are made of.
/// @param tip  of the tree; null for its wall
void Linker::Describe(
  const Orphan& orphan, std::size_t number, const VesselEnd* tip, VesselLink& link) const
{
  const VesselEnd& end = orphan.ends[number];
  const Vector3 from = link.points.front();
  const double gap = (from - end.position).norm();
  // Over a short gap the chord says nothing.
  const double chordWeight = std::min(1.0, gap / 4.0);
  const Vector3 chord = gap > 0.0 ? Vector3((from - end.position) / gap) : end.outwards;
  constexpr double maximumTurn = 6.0;
  const auto turn = [&](double angle, double scale)
  { return std::min(maximumTurn, (angle / scale) * (angle / scale)); };
  const bool root = tip != nullptr && tip->root > 0.0;
  link.radiusBefore =
    tip != nullptr && (tip->radius > 0.0 || root) ? tip->radius : this->RadiusByVolume(from);
  link.radiusBehind = end.radius;
  link.pieceLength = orphan.length;
  // A piece that is thick on the whole is no vessel that begins thin; side branches add to its volume.
  const double thick = 0.6 *
    std::sqrt(
      static_cast<double>(orphan.piece.Size()) * this->L.VoxelVolume() / (M_PI * orphan.length));
  const double wider = link.radiusBefore > 0.0
    ? std::log(std::max(1e-9, std::max(end.radius, thick)) / link.radiusBefore)
    : 0.0;
  const double minimum = 0.3; // mm: what is thinner is not measured
  const double grown = std::log(orphan.growth[number] * std::max(end.radius, minimum) /
    std::max({ link.radiusBefore, end.radius, minimum }));
  const double abrupt = std::min(end.radius, link.radiusBefore);
  // What is darker than the tree's vessel there is a vein; a root has no vessel to compare with.
  const double brighter = root
    ? 0.0
    : this->BrightShare(end.position, 6.0, [&](std::int64_t v) { return orphan.piece.Has(v); }) -
      this->BrightShare(from, 3.0, [&](std::int64_t v) { return this->I.inTree(v); });
  const bool wall = tip == nullptr;
  link.signs = {
    wall ? 1.0 : 0.0,
    link.unseen / 6.0,
    std::max(0.0, link.unseen - FreeGap) / 8.0,
    chordWeight * turn(UnitAngle(end.outwards, chord), 0.7),
    wall ? 0.0 : chordWeight * turn(UnitAngle(tip->outwards, -chord), 0.7),
    std::max(0.0, -wider - 0.7),
    // The tip may lie in the lesion: then what follows is wider, but not twice as wide.
    wall ? 0.0 : std::max(0.0, wider - 0.25),
    // Veins widen away from where they are linked; behind lesions arteries are a little wider at most.
    std::clamp(grown - 0.3, 0.0, 1.0),
    // Vessels taper: one that ends at full width goes on, and one that begins so comes from somewhere.
    wall ? 0.0 : std::min(1.0, link.unseen / 6.0) * std::clamp((abrupt - 0.6) / 0.6, 0.0, 1.0),
    std::min(1.0, (orphan.length - 15.0) / 15.0),
    std::clamp((orphan.length - 30.0) / 30.0, 0.0, 3.0),
    wall ? 0.0 : std::max(0.0, -brighter - 0.1),
    wall ? std::max(0.0, -brighter - 0.1) : 0.0,
    std::max(0.0, brighter - 0.1),
    this->Clearest(link),
  };
}

/// The odds for a link, as a logarithm.
double Linker::Judge(const VesselLink& link, const VesselEnd* tip)
{
  double odds = FittedOdds(Intercept, Signs, link.signs);
  if (tip != nullptr && tip->root > 0.0)
  {
    // What begins at full width right before the aorta comes from there.
    odds += 2.0 * std::clamp((link.radiusBehind - 0.6) / 0.6, 0.0, 1.0);
  }
  return odds;
}

/// Descriptions of all pieces, in the order of their first voxels. What was known of others is forgotten.
void Linker::DescribeAll(
  std::vector<std::vector<std::int64_t>> pieces, const ProgressCallback& progress)
{
  std::map<std::int64_t, Description> known = std::move(this->Described);
  this->Described.clear();
  std::vector<std::pair<std::vector<std::int64_t>*, Description*>> unknown;
  for (std::vector<std::int64_t>& voxels : pieces)
  {
    Description& description = this->Described[voxels.front()];
    const auto before = known.find(voxels.front());
    if (before != known.end() && before->second.Voxels() == voxels)
    {
      description = std::move(before->second);
    }
    else
    {
      unknown.emplace_back(&voxels, &description);
    }
  }
  // The largest first, so that no thread begins with it when the others have ended.
  std::stable_sort(unknown.begin(), unknown.end(),
    [](const auto& a, const auto& b) { return a.first->size() > b.first->size(); });
  ParallelFor(
    static_cast<std::int64_t>(unknown.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const auto& [voxels, description] = unknown[n];
        std::optional<Orphan> orphan = this->Describe(*voxels);
        if (orphan)
        {
          description->orphan = std::make_unique<Orphan>(std::move(*orphan));
          description->orphan->growth.assign(description->orphan->ends.size(), -1.0);
        }
        else
        {
          description->voxels = std::move(*voxels);
        }
      }
    },
    progress);
}

/// Places in the first 15 mm of a piece behind its end.
std::vector<Vector3> Linker::Behind(const VoxelPiece& piece, const VesselEnd& end) const
{
  constexpr float reach = 15.0F; // mm
  constexpr std::size_t stride = 7;
  std::vector<Vector3> places;
  const std::vector<VoxelPiece::Reached> reached = piece.Around(end.number, reach);
  for (std::size_t n = 0; n < reached.size(); n += stride)
  {
    const std::int64_t voxel = piece.All()[reached[n].number];
    places.push_back(this->L.World(this->L.Place(voxel)));
  }
  return places;
}

/// The likeliest of the links from an orphan's ends to the tree; without any its confidence is 0.
VesselLink Linker::BestLink(
  Orphan& orphan, const std::vector<VesselEnd>& tips, std::vector<ConsideredLink>& considered) const
{
  VesselLink best;
  best.confidence = 0.0;
  double bestOdds = -std::numeric_limits<double>::infinity();
  for (std::size_t e = 0; e < orphan.ends.size(); ++e)
  {
    const VesselEnd& end = orphan.ends[e];
    const auto consider = [&](const Vector3& target, double within, const VesselEnd* tip)
    {
      VesselLink link;
      const bool way = this->FindPath(orphan.piece, end, target, within, link);
      // Where hardly anything is seen, the cheapest way follows what is no vessel.
      VesselLink curve;
      VesselEnd facing;
      if (tip == nullptr)
      {
        // A wall faces whatever is before it.
        facing.position = target;
        facing.outwards = (end.position - target).normalized();
      }
      const VesselEnd& other = tip != nullptr ? *tip : facing;
      const bool unseen = tip != nullptr && (!way || link.unseen > 0.5 * link.length);
      if ((unseen || way) && this->Curve(end, other, curve) &&
        (unseen || this->Strays(link, curve, end, other)))
      {
        link = std::move(curve);
      }
      else if (!way)
      {
        return;
      }
      if (orphan.growth[e] < 0.0)
      {
        orphan.growth[e] = this->Growth(orphan.piece, end);
      }
      this->Describe(orphan, e, tip, link);
      const double odds = Judge(link, tip);
      link.confidence = ProbabilityOf(odds);
      considered.push_back({ link, this->Behind(orphan.piece, end) });
      if (odds > bestOdds)
      {
        bestOdds = odds;
        best = std::move(link);
      }
    };
    for (const VesselEnd& tip : tips)
    {
      const Vector3 chord = tip.position - end.position;
      const double gap = chord.norm();
      if (gap > this->Settings.longestGap ||
        (gap > 4.0 &&
          (UnitAngle(end.outwards, chord / gap) > 1.2 ||
            UnitAngle(tip.outwards, -chord / gap) > 1.2)))
      {
        continue;
      }
      consider(tip.position, 2.0 + tip.root, &tip);
    }
    // The wall of the tree ahead.
    double minimum = std::numeric_limits<double>::infinity();
    Vector3 wall = Vector3::Zero();
    const std::optional<std::array<int, 3>> at = this->L.Nearest(end.position);
    if (at)
    {
      this->L.Ball(*at, WallGap,
        [&](std::int64_t voxel, const std::array<int, 3>& place)
        {
          if (!this->I.inTree(voxel))
          {
            return;
          }
          const Vector3 chord = this->L.World(place) - end.position;
          const double gap = std::max(1e-6, chord.norm());
          const double angle = UnitAngle(end.outwards, chord / gap);
          const double cost = gap * (1.0 + angle * angle);
          if ((angle < 0.9 || gap < 2.5) && cost < minimum)
          {
            minimum = cost;
            wall = this->L.World(place);
          }
        });
    }
    if (std::isfinite(minimum))
    {
      consider(wall, 1.5, nullptr);
    }
  }
  return best;
}

std::vector<VesselLink> Linker::Run(
  const std::vector<std::pair<std::int64_t, float>>& tree, const ProgressCallback& progress)
{
  this->DescribeAll(
    this->Pieces(tree), [&](double fraction) { return !progress || progress(0.5 * fraction); });
  std::vector<Orphan*> orphans;
  for (auto& [first, description] : this->Described)
  {
    if (description.orphan && !description.orphan->ends.empty())
    {
      orphans.push_back(&*description.orphan);
    }
  }
  Report(progress, 0.5);
  std::vector<std::int64_t> treeVoxels;
  treeVoxels.reserve(tree.size());
  std::vector<VoxelPiece::Reached> paths;
  for (const auto& [voxel, path] : tree)
  {
    paths.push_back({ static_cast<std::int32_t>(treeVoxels.size()), path, -1 });
    treeVoxels.push_back(voxel);
  }
  const VoxelPiece trunk(this->L, std::move(treeVoxels));
  std::vector<VesselEnd> tips =
    paths.empty() ? std::vector<VesselEnd>() : this->EndsOf(trunk, paths);
  for (const VesselRoot& root : this->I.roots)
  {
    VesselEnd tip;
    tip.position = root.position;
    tip.outwards = root.outwards;
    tip.lumen = 1.0; // the aorta's
    tip.root = std::max(root.reach, this->L.Spacing.minCoeff());
    tips.push_back(tip);
  }

  std::vector<VesselLink> best(orphans.size());
  std::vector<std::vector<ConsideredLink>> considered(orphans.size());
  ParallelFor(
    static_cast<std::int64_t>(orphans.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        best[n] = this->BestLink(*orphans[n], tips, considered[n]);
      }
    },
    [&](double fraction) { return !progress || progress(0.5 + 0.5 * fraction); });
  this->Considered.clear();
  for (std::vector<ConsideredLink>& some : considered)
  {
    std::move(some.begin(), some.end(), std::back_inserter(this->Considered));
  }
  std::vector<VesselLink> links;
  for (VesselLink& link : best)
  {
    // A piece may have no way at all.
    if (!link.voxels.empty() && link.confidence >= this->Settings.minimumConfidence)
    {
      links.push_back(std::move(link));
    }
  }
  return links;
}
}

struct VesselLinker::Work
{
  const LinkingImage& image;
  LinkingSettings settings;
  Linker linker{ image, settings };
};

VesselLinker::VesselLinker(const LinkingImage& image, const LinkingSettings& settings)
  : Data(new Work{ image, settings })
{
}

VesselLinker::~VesselLinker() = default;

std::vector<ConsideredLink> VesselLinker::TakeConsidered()
{
  return std::move(this->Data->linker.Considered);
}

const std::array<const char*, NumberOfLinkSigns>& LinkSignNames()
{
  static const std::array<const char*, NumberOfLinkSigns> names = NamesOf(Signs);
  return names;
}

std::vector<VesselLink> VesselLinker::Find(
  const std::vector<std::pair<std::int64_t, float>>& tree, const ProgressCallback& progress)
{
  return this->Data->linker.Run(tree, progress);
}
}
