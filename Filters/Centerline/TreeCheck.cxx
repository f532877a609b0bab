#include "TreeCheck.h"

#include "CoronaryAnatomy.h"
#include "SegmentAtlas.h"
#include "TreeLinks.h"
#include "VeinRejection.h"
#include "VesselTips.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <limits>
#include <map>

namespace coronary
{
namespace
{
constexpr double Degrees = 180.0 / 3.14159265358979323846;

// Lengths in mm. Published ranges are wider than the healthy phantoms', and decide where both are known.
constexpr double LongestMain = 25.0; ///< of left mains
constexpr double LongestPath =
  270.0; ///< from an ostium to the tip of a posterior descending artery
constexpr double MinimumApex =
  66.0; ///< depth that an anterior descending artery reaches; the apex is at 91.5
constexpr double MinimumCircumflex = 25.0; ///< of circumflex and marginals together
constexpr double MinimumDescending = 15.0; ///< of a posterior descending artery
constexpr double FarFromCrux = 25.0;       ///< of the right coronary artery's nearest point
constexpr double NearestOstia = 6.0;       ///< of two ostia
constexpr double FarthestOstia = 70.0;     ///< of two ostia
constexpr double TipLength = 3.0;          ///< over which a tip's radius is taken
constexpr double BeforeTip = 15.0;         ///< a lesion at the tip narrows less than this
constexpr double WideTip = 0.78;        ///< radius with which no whole vessel ends, for usual tips
constexpr double WideBeforeTip = 0.95;  ///< the same before the tip
constexpr double SmallVesselsTip = 1.3; ///< of a right coronary artery that is not dominant
constexpr double Widening = 1.4;        ///< arteries taper
constexpr double UncertainFit = 8.0;    ///< mean distance from the mean heart's vessels

/// Who feeds a wall.
enum class Feeder
{
  AnteriorDescending,
  DistalAnteriorDescending,
  Circumflex,
  PosteriorDescending
};

/// A wall of the left ventricle, by the segments of the American Heart Association (Cerqueira 2002),
/// and how far its middle may be from an artery: mm of the mean heart.
struct Wall
{
  const char* name;
  Feeder feeder;
  double height; ///< below the atrioventricular groove
  double part;   ///< of the way from the anterior to the posterior groove
  double reach;
};

constexpr std::array<Wall, 12> Walls = { {
  { "basal anterior wall", Feeder::AnteriorDescending, 15.0, 0.125, 21.0 },
  { "basal anterolateral wall", Feeder::Circumflex, 15.0, 0.375, 20.0 },
  { "basal inferolateral wall", Feeder::Circumflex, 15.0, 0.625, 22.0 },
  { "basal inferior wall", Feeder::PosteriorDescending, 15.0, 0.875, 23.0 },
  { "mid anterior wall", Feeder::AnteriorDescending, 40.0, 0.125, 15.0 },
  { "mid anterolateral wall", Feeder::Circumflex, 40.0, 0.375, 18.0 },
  { "mid inferolateral wall", Feeder::Circumflex, 40.0, 0.625, 27.0 },
  { "mid inferior wall", Feeder::PosteriorDescending, 40.0, 0.875, 25.0 },
  { "apical anterior wall", Feeder::DistalAnteriorDescending, 65.0, 0.125, 14.0 },
  { "apical lateral wall", Feeder::AnteriorDescending, 65.0, 0.375, 21.0 },
  { "apical inferior wall", Feeder::PosteriorDescending, 65.0, 0.875, 25.0 },
  { "apex", Feeder::DistalAnteriorDescending, 86.0, 0.0, 25.0 },
} };

std::string At(const Vector3& place)
{
  char text[100];
  std::snprintf(text, sizeof(text), "(%.1f, %.1f, %.1f)", place[0], place[1], place[2]);
  return text;
}

std::string Rounded(double value, int digits = 0)
{
  char text[40];
  std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}

/// From one half, at the limit, to one.
double Sure(double excess, double scale)
{
  return 1.0 - 0.5 * std::exp(-std::max(0.0, excess) / scale);
}

class Checker
{
public:
  Checker(
    const CenterlineTopology& tree, const LabelingResult& labels, const std::vector<double>& vein);
  std::vector<TreeWarning> Run();

private:
  /// A trunk: all points with one of some names.
  struct Axis
  {
    double length = 0.0;
    std::int64_t last = -1; ///< point farthest from the ostium
  };

  Axis Of(std::initializer_list<int> segments) const;
  /// On the mean heart, in its frame: a, b, and the depth below the groove.
  Vector3 OnHeart(std::int64_t point) const;
  Vector3 FromMeanHeart(const Vector3& position) const;
  void Warn(const std::string& what, const std::string& vessel, const Vector3& place, double sure);
  bool Trees();
  void LeftTrunks();
  void BackOfTheHeart();
  void Tips();
  void Territories();
  void Veins();
  std::string NameOf(std::size_t branch) const;

  const CenterlineTopology& Tree;
  const LabelingResult& Labels;
  const std::vector<double>& Vein;
  const SegmentAtlas& Atlas;
  Matrix3 Inverse;
  double Trust = 1.0; ///< in the fit
  std::array<std::int64_t, 2> Roots = { -1, -1 };
  std::vector<TreeWarning> Warnings;
};

Checker::Checker(
  const CenterlineTopology& tree, const LabelingResult& labels, const std::vector<double>& vein)
  : Tree(tree)
  , Labels(labels)
  , Vein(vein)
  , Atlas(SegmentAtlas::Get())
  , Inverse(labels.fit.matrix.inverse())
{
  this->Trust = std::exp(-std::max(0.0, labels.meanDistance - UncertainFit) / UncertainFit);
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.parentGroupId < 0 && branch.treeId >= 0 && branch.treeId < 2 &&
      this->Roots[static_cast<std::size_t>(branch.treeId)] < 0)
    {
      this->Roots[static_cast<std::size_t>(branch.treeId)] = branch.points.front();
    }
  }
}

void Checker::Warn(
  const std::string& what, const std::string& vessel, const Vector3& place, double sure)
{
  this->Warnings.push_back({ what, vessel, place, std::min(0.99, sure) });
}

Checker::Axis Checker::Of(std::initializer_list<int> segments) const
{
  Axis course;
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const std::int64_t point = branch.points[i];
      if (std::find(segments.begin(), segments.end(), this->Tree.segmentId[point]) ==
        segments.end())
      {
        continue;
      }
      course.length += (this->Tree.points[point] - this->Tree.points[branch.points[i - 1]]).norm();
      if (course.last < 0 || this->Tree.abscissa[point] > this->Tree.abscissa[course.last])
      {
        course.last = point;
      }
    }
  }
  return course;
}

Vector3 Checker::OnHeart(std::int64_t point) const
{
  return this->Atlas.axes *
    (this->Labels.fit.ToMeanHeart(this->Tree.points[point]) - this->Atlas.origin);
}

Vector3 Checker::FromMeanHeart(const Vector3& position) const
{
  return this->Inverse * (position - this->Labels.fit.shift);
}

std::string Checker::NameOf(std::size_t branch) const
{
  // A twig without a name is called by the vessel that it leaves.
  for (auto b = static_cast<int>(branch); b >= 0; b = this->Tree.branches[b].parentGroupId)
  {
    const std::string name = SegmentName(this->Tree.branches[b].segmentId);
    if (!name.empty())
    {
      return b == static_cast<int>(branch) ? name : "branch of " + name;
    }
  }
  return "unnamed branch";
}

/// @return whether there is any tree to look at
bool Checker::Trees()
{
  if (this->Roots[0] < 0 && this->Roots[1] < 0)
  {
    const Vector3& place = this->Tree.points[this->Tree.branches.front().points.front()];
    this->Warn("neither of the coronary trees was recognised: the vessels that begin at " +
        At(place) + " do not run as coronary arteries do",
      "", place, 0.8);
    return false;
  }
  for (const std::size_t side : { 0, 1 })
  {
    if (this->Roots[side] < 0)
    {
      const Vector3 place =
        this->FromMeanHeart(side == 0 ? this->Atlas.leftOstium : this->Atlas.rightOstium);
      this->Warn(std::string("there is no ") + (side == 0 ? "left" : "right") +
          " coronary tree: its ostium is to be expected near " + At(place),
        side == 0 ? "LCA" : "RCA", place, 0.95);
    }
  }
  if (this->Roots[0] >= 0 && this->Roots[1] >= 0)
  {
    const Vector3& left = this->Tree.points[this->Roots[0]];
    const double apart = (left - this->Tree.points[this->Roots[1]]).norm();
    if (apart < NearestOstia || apart > FarthestOstia)
    {
      this->Warn("the left coronary tree begins at " + At(left) + ", " + Rounded(apart) +
          " mm from the right one: ostia are " + Rounded(NearestOstia) + " to " +
          Rounded(FarthestOstia) + " mm apart",
        "LCA", left,
        apart < NearestOstia ? Sure(NearestOstia - apart, 3.0) : Sure(apart - FarthestOstia, 20.0));
    }
  }
  return true;
}

void Checker::LeftTrunks()
{
  const Vector3& root = this->Tree.points[this->Roots[0]];
  const Axis main = this->Of({ LeftMain });
  if (main.length > LongestMain)
  {
    this->Warn("LM is " + Rounded(main.length) + " mm long, up to " +
        At(this->Tree.points[main.last]) + "; left mains are at most " + Rounded(LongestMain) +
        " mm: an artery that leaves it may be missing",
      "LM", this->Tree.points[main.last], Sure(main.length - LongestMain, 10.0));
  }
  const Axis descending = this->Of({ ProximalLAD, MidLAD, DistalLAD });
  if (descending.last < 0)
  {
    this->Warn("the left coronary tree at " + At(root) + " has no LAD", "LAD", root, 0.95);
  }
  else
  {
    double depth = 0.0;
    std::int64_t deepest = descending.last;
    for (std::size_t p = 0; p < this->Tree.points.size(); ++p)
    {
      const int segment = this->Tree.segmentId[p];
      const auto point = static_cast<std::int64_t>(p);
      if (segment >= ProximalLAD && segment <= DistalLAD && this->OnHeart(point)[2] > depth)
      {
        depth = this->OnHeart(point)[2];
        deepest = point;
      }
    }
    if (depth < MinimumApex)
    {
      const Vector3& place = this->Tree.points[deepest];
      this->Warn("the LAD ends at " + At(place) + ", about " +
          Rounded((91.5 - depth) * this->Labels.heart.size) + " mm before the apex, after " +
          Rounded(descending.length) + " mm",
        SegmentName(this->Tree.segmentId[deepest]), place,
        this->Trust * Sure(MinimumApex - depth, 12.0));
    }
  }
  const Axis circumflex = this->Of({ ProximalLCx, DistalLCx, FirstObtuseMarginal,
    SecondObtuseMarginal, ThirdObtuseMarginal, LeftPLB, LeftPDA });
  if (circumflex.length < MinimumCircumflex)
  {
    const Vector3& place = circumflex.last >= 0 ? this->Tree.points[circumflex.last] : root;
    this->Warn(circumflex.last < 0 ? "the left coronary tree at " + At(root) + " has no LCx"
                                   : "LCx and its marginals end at " + At(place) + " after " +
          Rounded(circumflex.length) + " mm",
      "LCx", place, Sure(MinimumCircumflex - circumflex.length, 10.0));
  }
}

/// One of the trees comes to the crux, and down from there.
void Checker::BackOfTheHeart()
{
  const bool left = this->Labels.dominance == Dominance::Left;
  if (this->Roots[left ? 0 : 1] < 0)
  {
    return;
  }
  Vector3 crux = Vector3::Zero();
  for (const SegmentAtlas::Point& point : this->Atlas.points)
  {
    crux = point.vessel == Vessel::RightCoronary ? point.position : crux;
  }
  const Axis down = left ? this->Of({ LeftPDA }) : this->Of({ RightPDA, InferiorRightBranch });
  double minimum = std::numeric_limits<double>::infinity();
  const Axis trunk = left ? this->Of({ ProximalLCx, DistalLCx, LeftPLB, LeftPDA })
                          : this->Of({ ProximalRCA, MidRCA, DistalRCA, RightPDA, RightPLB });
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    if (branch.treeId == (left ? 0 : 1))
    {
      for (const std::int64_t point : branch.points)
      {
        minimum =
          std::min(minimum, (this->Labels.fit.ToMeanHeart(this->Tree.points[point]) - crux).norm());
      }
    }
  }
  const std::string name = left ? "LCx" : "RCA";
  if (trunk.last < 0)
  {
    return;
  }
  const Vector3& end = this->Tree.points[trunk.last];
  if (minimum > FarFromCrux)
  {
    this->Warn("the " + name + " does not reach the crux: it ends at " + At(end) + ", about " +
        Rounded(minimum * this->Labels.heart.size) + " mm before it",
      SegmentName(this->Tree.segmentId[trunk.last]), end,
      this->Trust * Sure(minimum - FarFromCrux, 15.0));
  }
  else if (down.length < MinimumDescending)
  {
    this->Warn("there is no posterior descending artery: the " + name + " ends at " + At(end),
      left ? "L-PDA" : "R-PDA", end, this->Trust * Sure(MinimumDescending - down.length, 10.0));
  }
}

/// Vessels end thin; they do not widen, and do not go on for ever.
void Checker::Tips()
{
  const std::vector<VesselPath> paths = VesselPaths(this->Tree);
  const double calibre = TipCalibre(this->Tree, paths);
  const std::vector<VesselTip> tips = JudgeTips(this->Tree, paths);
  const std::vector<std::int64_t> branches = BranchesOfPoints(this->Tree);
  for (std::size_t n = 0; n < paths.size(); ++n)
  {
    const VesselPath& path = paths[n];
    const std::int64_t tip = path.points.back();
    const std::int64_t last = branches[tip];
    const VesselTree::Branch& branch = this->Tree.branches[last];
    if (branch.treeId < 0)
    {
      continue;
    }
    const Vector3& place = this->Tree.points[tip];
    const std::string name = this->NameOf(last);
    if (this->Tree.abscissa[tip] > LongestPath)
    {
      this->Warn(name + " ends at " + At(place) + ", " + Rounded(this->Tree.abscissa[tip]) +
          " mm from the ostium, farther than coronary arteries go: it may go on in a vein",
        name, place, Sure(this->Tree.abscissa[tip] - LongestPath, 40.0));
    }
    const double end = RadiusBeforeTip(this->Tree, path, 0.0, TipLength);
    const double before = RadiusBeforeTip(this->Tree, path, TipLength, BeforeTip);
    const bool small = branch.treeId == 1 && this->Labels.dominance == Dominance::Left;
    const double excess = small
      ? std::max(end, before) - SmallVesselsTip
      : std::max(end - calibre * WideTip, before - calibre * WideBeforeTip);
    if (excess > 0.0)
    {
      this->Warn(name + " ends at " + At(place) + " in full calibre (radius " +
          Rounded(std::max(end, before), 1) +
          " mm): it may be occluded there, or its rest was not found",
        name, place, Sure(excess, 0.4));
      continue;
    }
    if (tips[n].goesOn >= MinimumGoingOn)
    {
      this->Warn(name + " ends at " + At(place) + " where it narrows, from " +
          Rounded(tips[n].before, 1) + " to " + Rounded(tips[n].end, 1) +
          " mm of radius: a lesion may hide its rest",
        name, place, tips[n].goesOn);
      continue;
    }
    const double begin = RadiusBeforeTip(
      this->Tree, path, 0.6 * branch.length, std::min(branch.length, 2.0 * BeforeTip));
    if (branch.length > 8.0 && end > 0.7 && begin > 0.0 && end > Widening * begin)
    {
      this->Warn(name + " widens towards its end at " + At(place) + ", from " + Rounded(begin, 1) +
          " to " + Rounded(end, 1) + " mm of radius: it may have run into another vessel",
        name, place, Sure(end / begin - Widening, 0.5));
    }
  }
}

/// Walls of the left ventricle that no artery comes near.
void Checker::Territories()
{
  const auto azimuth = [&](Vessel vessel, double height)
  {
    double best = std::numeric_limits<double>::infinity();
    double result = 0.0;
    for (const SegmentAtlas::Point& point : this->Atlas.points)
    {
      const Vector3 place = this->Atlas.axes * (point.position - this->Atlas.origin);
      if (point.vessel == vessel && std::abs(place[2] - height) < best)
      {
        best = std::abs(place[2] - height);
        result = std::atan2(place[1], place[0]) * Degrees;
      }
    }
    return result;
  };
  std::vector<Vector3> mean;
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    for (std::size_t i = 0; branch.treeId >= 0 && i < branch.points.size(); ++i)
    {
      mean.push_back(this->Labels.fit.ToMeanHeart(this->Tree.points[branch.points[i]]));
    }
  }
  const bool leftDominant = this->Labels.dominance == Dominance::Left;
  struct Territory
  {
    Feeder feeder;
    const char* vessel;
    const char* text;
    int tree;
  };
  const Territory territories[] = {
    { Feeder::AnteriorDescending, "LAD", "no artery in the LAD's and diagonals' territory", 0 },
    { Feeder::DistalAnteriorDescending, "dLAD", "no artery in the LAD's distal territory", 0 },
    { Feeder::Circumflex, "LCx", "no artery in a part of the LCx' territory", 0 },
    { Feeder::PosteriorDescending, leftDominant ? "L-PDA" : "R-PDA",
      "no artery in a part of the posterior descending artery's territory", leftDominant ? 0 : 1 },
  };
  for (const Territory& territory : territories)
  {
    if (this->Roots[static_cast<std::size_t>(territory.tree)] < 0)
    {
      continue; // said already
    }
    std::string walls;
    double excess = 0.0;
    Vector3 place = Vector3::Zero();
    for (const Wall& wall : Walls)
    {
      if (wall.feeder != territory.feeder)
      {
        continue;
      }
      const double anterior = azimuth(Vessel::AnteriorDescending, std::min(wall.height, 65.0));
      const double posterior = azimuth(Vessel::RightPosteriorDescending, wall.height);
      const Vector3 middle = wall.part > 0.0
        ? this->Atlas.OnEpicardium(anterior + wall.part * (posterior - anterior), wall.height)
        : this->Atlas.OnEpicardium(0.0, wall.height);
      double minimum = std::numeric_limits<double>::infinity();
      for (const Vector3& point : mean)
      {
        minimum = std::min(minimum, (point - middle).squaredNorm());
      }
      minimum = std::sqrt(minimum) - wall.reach;
      if (minimum > 0.0)
      {
        walls += (walls.empty() ? "" : ", ") + std::string(wall.name);
        if (minimum > excess)
        {
          excess = minimum;
          place = this->FromMeanHeart(middle);
        }
      }
    }
    if (!walls.empty())
    {
      this->Warn(std::string(territory.text) + " (" + walls + "), around " + At(place),
        territory.vessel, place, this->Trust * Sure(excess, 10.0));
    }
  }
}

/// Branches that were kept and may be veins; what hangs on one is told with it.
void Checker::Veins()
{
  struct Doubt
  {
    const VesselTree::Branch* first;
    double length, probability;
  };
  constexpr double possible = 0.1;
  std::vector<Doubt> doubts;
  std::map<int, std::size_t> doubtOf; // of a group
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    const double probability = VeinProbabilityOf(branch.points, this->Vein);
    if (probability <= possible)
    {
      continue;
    }
    const auto parent = doubtOf.find(branch.parentGroupId);
    const std::size_t own = parent == doubtOf.end() ? doubts.size() : parent->second;
    if (own == doubts.size())
    {
      doubts.push_back({ &branch, 0.0, probability });
    }
    doubts[own].length += branch.length;
    doubtOf[branch.groupId] = own;
  }
  for (const Doubt& doubt : doubts)
  {
    const std::string vessel = SegmentName(doubt.first->segmentId);
    const Vector3& place = this->Tree.points[doubt.first->points[1]];
    this->Warn((vessel.empty() ? "a branch" : vessel) + " may be a vein: " + Rounded(doubt.length) +
        " mm from " + At(place) + " on",
      vessel, place, doubt.probability);
  }
}

std::vector<TreeWarning> Checker::Run()
{
  if (this->Trees())
  {
    if (this->Roots[0] >= 0)
    {
      this->LeftTrunks();
    }
    this->BackOfTheHeart();
    this->Territories();
    this->Tips();
  }
  this->Veins();
  return this->Warnings;
}
}

std::optional<TreeWarning> DoubtfulVeinWarning(const Vector3& place, double length, double vein)
{
  constexpr double certain = 0.95;
  if (vein >= certain)
  {
    return std::nullopt;
  }
  return TreeWarning{ "a vessel of " + Rounded(length) + " mm that touches a tree at " + At(place) +
      " was left out as a vein, with a probability of " + Rounded(vein, 2) +
      ": it may be an artery",
    "", place, 1.0 - vein };
}

std::vector<TreeWarning> CheckCoronaryTrees(
  const CenterlineTopology& tree, const LabelingResult& labels, const std::vector<double>& vein)
{
  if (tree.branches.empty())
  {
    return {};
  }
  // Limits are millimetres; coordinates may be metres.
  const double unit = std::pow(10.0, std::round(std::log10(labels.heart.size)));
  if (unit == 1.0)
  {
    return Checker(tree, labels, vein).Run();
  }
  CenterlineTopology scaled = tree;
  for (std::size_t i = 0; i < tree.points.size(); ++i)
  {
    scaled.points[i] /= unit;
    scaled.radius[i] /= unit;
    scaled.abscissa[i] /= unit;
  }
  for (VesselTree::Branch& branch : scaled.branches)
  {
    branch.length /= unit;
  }
  LabelingResult inMillimetres = labels;
  inMillimetres.fit.matrix *= unit;
  inMillimetres.heart.size /= unit;
  std::vector<TreeWarning> warnings = Checker(scaled, inMillimetres, vein).Run();
  for (TreeWarning& warning : warnings)
  {
    warning.place *= unit;
  }
  return warnings;
}
}
