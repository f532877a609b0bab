#include "SegmentNaming.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace coronary
{
namespace
{
using V = Vessel;

constexpr double MinimumNumbered = 8.0; ///< shorter side branches are not counted
constexpr double OriginDeviation = 8.0; ///< of a side branch's origin along its vessel
constexpr double NumberedCourse = 1.0;  ///< weight of a side branch's course beside its origin
constexpr double SkippedNumber = 2.0;   ///< cost of a first, second, ... branch that is not there

/// Numbers 1, 2, 3 for side branches in the order of their origins; a number may be left out when
/// the next one's usual origin is much nearer.
std::vector<int> NumberInOrder(const std::vector<std::vector<double>>& costs, int most)
{
  const std::size_t n = costs.size();
  // best[i][k]: the first i branches with the last numbered k.
  std::vector<std::vector<double>> best(n + 1, std::vector<double>(most + 1, Infinity));
  std::vector<std::vector<int>> from(n + 1, std::vector<int>(most + 1, 0));
  best[0][0] = 0.0;
  for (std::size_t i = 0; i < n; ++i)
  {
    for (int last = 0; last <= most; ++last)
    {
      for (int k = std::min(last + 1, most); k <= most; ++k)
      {
        // When there are more branches than numbers, some share the last one.
        const double repeated = last < most ? SkippedNumber * (k - last - 1)
          : static_cast<int>(n) > most      ? SkippedNumber
                                            : Infinity;
        const double total = best[i][last] + costs[i][k - 1] + repeated;
        if (total < best[i + 1][k])
        {
          best[i + 1][k] = total;
          from[i + 1][k] = last;
        }
      }
    }
  }
  std::vector<int> numbers(n, 0);
  int k = static_cast<int>(std::min_element(best[n].begin(), best[n].end()) - best[n].begin());
  for (std::size_t i = n; i > 0; --i)
  {
    numbers[i - 1] = k;
    k = from[i][k];
  }
  return numbers;
}

struct SideBranch
{
  int chunk;
  std::int64_t origin;
  double along; ///< distance of the origin from the tree's root
  double arc;   ///< of the atlas' trunk there
  int number = 0;
};

const SideBranch* ByNumber(const std::vector<SideBranch>& branches, int wanted)
{
  for (const SideBranch& branch : branches)
  {
    if (branch.number == wanted)
    {
      return &branch;
    }
  }
  return nullptr;
}

const SideBranch* Nearest(const std::vector<SideBranch>& branches, double arc, double reach)
{
  const SideBranch* best = nullptr;
  for (const SideBranch& branch : branches)
  {
    if (std::abs(branch.arc - arc) < reach)
    {
      best = &branch;
      reach = std::abs(branch.arc - arc);
    }
  }
  return best;
}

/// A distance from the root, or a place on the atlas' trunk.
struct Border
{
  double along = -1.0;
  double arc = 0.0;
};

/// At a side branch when it is there, else where it usually is.
Border BorderAt(const SideBranch* branch, double arc)
{
  return branch != nullptr ? Border{ branch->along, arc } : Border{ -1.0, arc };
}

/// Borders on the trunks.
struct Borders
{
  Border ladProximal;
  Border ladMid;
  Border circumflex;
  Border groove; ///< never passed where the circumflex does not end on the posterolateral wall
  Border rcaProximal;
  Border rcaMid;
};

class SegmentNamer
{
public:
  SegmentNamer(CenterlineTopology& tree, const LabelPieces& pieces, const AtlasPose& pose,
    const LabelAssignment& assignment)
    : Tree(tree)
    , Pieces(pieces)
    , Pose(pose)
    , Assignment(assignment)
    , Atlas(SegmentAtlas::Get())
    , Numbers(pieces.pieces.size(), 0)
  {
  }

  void NamePoints();
  void NameBranches();

private:
  double AtlasArc(V vessel, std::int64_t point) const;
  std::vector<SideBranch> SideBranches(V trunk, V kind) const;
  std::vector<double> UsualArcs(V kind) const;
  std::vector<double> CourseCosts(int start, std::size_t numbers) const;
  std::vector<SideBranch> Number(V trunk, V kind);
  bool EndsPosterolateral() const;
  Borders FindBorders();
  bool Passed(const Border& limit, V trunk, std::int64_t point) const;
  int SegmentOf(V vessel, int number, std::int64_t point, const Borders& borders, int& stage) const;

  CenterlineTopology& Tree;
  const LabelPieces& Pieces;
  const AtlasPose& Pose;
  const LabelAssignment& Assignment;
  const SegmentAtlas& Atlas;
  std::vector<int> Numbers; ///< first, second, ... of a side branch's pieces; 0: not counted
};

/// The arc of the atlas' vessel that is nearest.
double SegmentNamer::AtlasArc(V vessel, std::int64_t point) const
{
  const Vector3 at =
    this->Pose.Apply((this->Tree.points[point] - this->Pieces.centre) / this->Pieces.unit);
  const SegmentAtlas::Nearest nearest = this->Atlas.NearestOf(vessel, at);
  return nearest.point == nullptr ? 0.0 : nearest.point->arc;
}

/// What leaves a trunk and counts, in the order of the origins.
std::vector<SideBranch> SegmentNamer::SideBranches(V trunk, V kind) const
{
  std::vector<SideBranch> found;
  for (std::size_t c = 0; c < this->Pieces.pieces.size(); ++c)
  {
    const LabelPiece& chunk = this->Pieces.pieces[c];
    if (this->Assignment.vessels[c] == kind && chunk.startsBranch && chunk.parent >= 0 &&
      this->Assignment.vessels[chunk.parent] == trunk && this->Pieces.below[c] >= MinimumNumbered)
    {
      const std::int64_t origin = this->Tree.branches[chunk.branch].points[0];
      found.push_back({ static_cast<int>(c), origin, this->Tree.abscissa[origin],
        this->AtlasArc(trunk, origin), 0 });
    }
  }
  std::stable_sort(found.begin(), found.end(),
    [](const SideBranch& a, const SideBranch& b) { return a.along < b.along; });
  return found;
}

/// Where the first, second, ... usually leaves.
std::vector<double> SegmentNamer::UsualArcs(V kind) const
{
  std::vector<double> arcs;
  for (const AtlasOrigin& origin : this->Atlas.origins)
  {
    if (origin.vessel == kind)
    {
      arcs.push_back(origin.arc);
    }
  }
  return arcs;
}

std::vector<double> SegmentNamer::CourseCosts(int start, std::size_t numbers) const
{
  const Vessel kind = this->Assignment.vessels[start];
  std::vector<double> sum(numbers, 0.0);
  double count = 0.0;
  std::vector<int> stack{ start };
  while (!stack.empty())
  {
    const LabelPiece& chunk = this->Pieces.pieces[stack.back()];
    stack.pop_back();
    for (std::size_t s = chunk.firstSample; s < chunk.lastSample; ++s)
    {
      const Vector3 at = this->Pose.Apply(this->Pieces.samples[s].position);
      std::vector<double> best(numbers, MaximumObservationCost);
      for (const SegmentAtlas::Point& point : this->Atlas.points)
      {
        if (point.vessel == kind)
        {
          double& minimum = best[point.number - 1];
          minimum = std::min(minimum,
            (point.position - at).squaredNorm() * (0.5 / (PositionDeviation * PositionDeviation)));
        }
      }
      for (std::size_t k = 0; k < numbers; ++k)
      {
        sum[k] += best[k];
      }
      count += 1.0;
    }
    stack.insert(stack.end(), chunk.children.begin(), chunk.children.end());
  }
  for (double& value : sum)
  {
    value *= NumberedCourse / count;
  }
  return sum;
}

std::vector<SideBranch> SegmentNamer::Number(V trunk, V kind)
{
  std::vector<SideBranch> branches = this->SideBranches(trunk, kind);
  const std::vector<double> arcs = this->UsualArcs(kind);
  std::vector<std::vector<double>> costs;
  for (const SideBranch& branch : branches)
  {
    // The origin along the trunk, and the course of the branch.
    std::vector<double> cost = this->CourseCosts(branch.chunk, arcs.size());
    for (std::size_t k = 0; k < arcs.size(); ++k)
    {
      const double off = (branch.arc - arcs[k]) / OriginDeviation;
      cost[k] += std::min(MaximumObservationCost, 0.5 * off * off);
    }
    costs.push_back(cost);
  }
  const std::vector<int> numbers = NumberInOrder(costs, static_cast<int>(arcs.size()));
  for (std::size_t i = 0; i < branches.size(); ++i)
  {
    branches[i].number = numbers[i];
    this->Numbers[branches[i].chunk] = numbers[i];
  }
  return branches;
}

/// The part of the circumflex beyond its last marginal that ends on the posterolateral wall is the
/// posterolateral branch, also where it still lies in the groove.
bool SegmentNamer::EndsPosterolateral() const
{
  bool endsPosterolateral = false;
  for (std::size_t c = 0; c < this->Pieces.pieces.size(); ++c)
  {
    const int parent = this->Pieces.pieces[c].parent;
    endsPosterolateral = endsPosterolateral ||
      (this->Assignment.dominance == Dominance::Balanced && parent >= 0 &&
        this->Assignment.vessels[c] == V::LeftPosterolateral &&
        this->Assignment.vessels[parent] == V::Circumflex);
  }
  return endsPosterolateral;
}

/// Numbers the side branches that mark them, too.
Borders SegmentNamer::FindBorders()
{
  const auto diagonals = this->Number(V::AnteriorDescending, V::Diagonal);
  const auto septals = this->Number(V::AnteriorDescending, V::Septal);
  const auto marginals = this->Number(V::Circumflex, V::ObtuseMarginal);
  const auto ventriculars = this->SideBranches(V::RightCoronary, V::RightVentricular);
  const auto acutes = this->SideBranches(V::RightCoronary, V::AcuteMarginal);

  Borders borders;
  const SideBranch* firstDiagonal = ByNumber(diagonals, 1);
  if (firstDiagonal == nullptr)
  {
    firstDiagonal = ByNumber(septals, 1);
  }
  borders.ladProximal = BorderAt(firstDiagonal, this->UsualArcs(V::Diagonal)[0]);
  borders.ladMid = BorderAt(ByNumber(diagonals, 3), this->Atlas.midLadEnd);
  borders.circumflex = BorderAt(ByNumber(marginals, 1), this->Atlas.obtuseMarginArc);
  borders.groove = this->EndsPosterolateral()
    ? BorderAt(ByNumber(marginals, 3), this->Atlas.leftGrooveEnd)
    : Border{ Infinity, 0.0 };
  borders.rcaProximal =
    BorderAt(Nearest(ventriculars, this->UsualArcs(V::RightVentricular)[0], 18.0),
      this->UsualArcs(V::RightVentricular)[0]);
  borders.rcaMid =
    BorderAt(Nearest(acutes, this->Atlas.acuteMarginArc, 25.0), this->Atlas.acuteMarginArc);
  return borders;
}

bool SegmentNamer::Passed(const Border& limit, V trunk, std::int64_t point) const
{
  return limit.along >= 0.0 ? this->Tree.abscissa[point] > limit.along * (1.0 + 1e-12)
                            : this->AtlasArc(trunk, point) > limit.arc;
}

/// @param number  of a side branch
/// @param stage   number of borders passed on the trunk
int SegmentNamer::SegmentOf(
  V vessel, int number, std::int64_t point, const Borders& borders, int& stage) const
{
  const auto pick = [&](int first, int second, int third) {
    return number == 1 ? first : number == 2 ? second : number == 3 ? third : 0;
  };
  const auto advance = [&](const Border& first, const Border& second)
  {
    const int reached = this->Passed(second, vessel, point) ? 2
      : this->Passed(first, vessel, point)                  ? 1
                                                            : 0;
    stage = std::max(stage, reached);
    return stage;
  };
  switch (vessel)
  {
    case V::LeftMain:
      return LeftMain;
    case V::AnteriorDescending:
      return ProximalLAD + advance(borders.ladProximal, borders.ladMid);
    case V::Circumflex:
    {
      constexpr int names[] = { ProximalLCx, DistalLCx, LeftPLB };
      return names[advance(borders.circumflex, borders.groove)];
    }
    case V::Ramus:
      return RamusIntermedius;
    case V::Diagonal:
      return pick(FirstDiagonal, SecondDiagonal, ThirdDiagonal);
    case V::Septal:
      return pick(FirstSeptal, SecondSeptal, ThirdSeptal);
    case V::ObtuseMarginal:
      return pick(FirstObtuseMarginal, SecondObtuseMarginal, ThirdObtuseMarginal);
    case V::LeftPosterolateral:
      return LeftPLB;
    case V::LeftPosteriorDescending:
      return LeftPDA;
    case V::RightCoronary:
      return ProximalRCA + advance(borders.rcaProximal, borders.rcaMid);
    case V::RightVentricular:
      return RightVentricularBranch;
    case V::AcuteMarginal:
      return AcuteMarginal;
    case V::RightPosteriorDescending:
      return RightPDA;
    case V::RightPosterolateral:
      return RightPLB;
    case V::InferiorRight:
      return InferiorRightBranch;
    case V::Other:
      break;
  }
  return 0;
}

void SegmentNamer::NamePoints()
{
  const Borders borders = this->FindBorders();
  // Number of borders passed on the trunk: noise does not lead back over one.
  std::vector<int> stage(this->Pieces.pieces.size(), 0);
  for (std::size_t c = 0; c < this->Pieces.pieces.size(); ++c)
  {
    const LabelPiece& chunk = this->Pieces.pieces[c];
    const V vessel = this->Assignment.vessels[c];
    // A side branch's number holds for all that hangs on it.
    if (this->Numbers[c] == 0 && chunk.parent >= 0 &&
      this->Assignment.vessels[chunk.parent] == vessel)
    {
      this->Numbers[c] = this->Numbers[chunk.parent];
    }
    const auto& points = this->Tree.branches[chunk.branch].points;
    const bool root = chunk.parent < 0;
    if (!root && this->Assignment.vessels[chunk.parent] == vessel)
    {
      stage[c] = stage[chunk.parent];
    }
    for (std::size_t i = chunk.first + (root ? 0 : 1); i <= chunk.last; ++i)
    {
      const std::int64_t point = points[i];
      this->Tree.segmentId[point] =
        this->SegmentOf(vessel, this->Numbers[c], point, borders, stage[c]);
    }
  }
}

void SegmentNamer::NameBranches()
{
  for (auto& branch : this->Tree.branches)
  {
    std::map<int, double> lengths;
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      lengths[this->Tree.segmentId[branch.points[i]]] +=
        (this->Tree.points[branch.points[i]] - this->Tree.points[branch.points[i - 1]]).norm();
    }
    branch.segmentId = std::max_element(lengths.begin(), lengths.end(),
      [](const auto& a, const auto& b) {
        return a.second < b.second;
      })->first;
    const TreeSide side = this->Assignment.sides[branch.treeId];
    branch.treeId = side == TreeSide::Left ? 0 : side == TreeSide::Right ? 1 : -1;
  }
}
}

void NameSegments(CenterlineTopology& tree, const LabelPieces& pieces, const AtlasPose& pose,
  const LabelAssignment& assignment)
{
  SegmentNamer namer(tree, pieces, pose, assignment);
  namer.NamePoints();
  namer.NameBranches();
}
}
