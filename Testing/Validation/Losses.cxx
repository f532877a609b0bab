#include "Losses.h"

#include "BridgeCheck.h"
#include "LooseVessels.h"
#include "TreeCheck.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>

namespace coronary
{
namespace
{
constexpr double NamesWithin = 15.0;   ///< mm
constexpr double MinimumShare = 0.25;  ///< of a loss that a named vessel holds
constexpr double MinimumStretch = 3.0; ///< mm: shorter ones are no reason for a warning

/// Steps of a tree's branches that are marked, joined where they touch.
class Joiner
{
public:
  explicit Joiner(std::size_t points)
    : Parent(points)
  {
    std::iota(this->Parent.begin(), this->Parent.end(), 0);
  }
  void Add(std::int64_t from, std::int64_t to)
  {
    this->Steps.emplace_back(from, to);
    this->Parent[this->Root(static_cast<std::size_t>(from))] =
      this->Root(static_cast<std::size_t>(to));
  }
  /// @param describe  takes a step's end and length, and adds what it knows to its stretch
  template <typename F>
  std::vector<LostPath> LostPaths(const std::vector<Vector3>& points, const F& describe)
  {
    std::map<std::size_t, LostPath> found;
    for (const auto& [from, to] : this->Steps)
    {
      LostPath& path = found[this->Root(static_cast<std::size_t>(to))];
      const double length = (points[to] - points[from]).norm();
      path.length += length;
      path.points.push_back(points[to]);
      describe(path, to, length);
    }
    std::vector<LostPath> list;
    for (auto& [root, path] : found)
    {
      list.push_back(std::move(path));
    }
    std::stable_sort(list.begin(), list.end(),
      [](const LostPath& a, const LostPath& b) { return a.length > b.length; });
    return list;
  }

private:
  std::size_t Root(std::size_t point)
  {
    while (this->Parent[point] != point)
    {
      point = this->Parent[point] = this->Parent[this->Parent[point]];
    }
    return point;
  }

  std::vector<std::size_t> Parent;
  std::vector<std::pair<std::int64_t, std::int64_t>> Steps;
};

/// Whether a step of a branch has to be found: not what is thin to its end; what is thin in a lesion only counts.
bool Counts(const PhantomTree& truth, const VesselTree::Branch& branch, std::size_t step)
{
  const auto wide = [&](std::int64_t q)
  { return truth.radius[static_cast<std::size_t>(q)] >= MinimumRadius; };
  return truth.visibility[static_cast<std::size_t>(branch.points[step])] <= 0.0 ||
    wide(branch.points[step]) || wide(branch.points.back()) ||
    std::any_of(
      branch.points.begin() + static_cast<std::ptrdiff_t>(step), branch.points.end(), wide);
}

bool IsOnArtery(const PhantomTree& truth, const Vector3& point)
{
  for (std::size_t q = 0; q < truth.points.size(); ++q)
  {
    const double reach = std::max(FoundWithin, truth.radius[q]);
    if ((truth.points[q] - point).squaredNorm() <= reach * reach)
    {
      return true;
    }
  }
  return false;
}

/// Whether a segment belongs to a whole artery.
bool Holds(const std::string& artery, int segment, int treeId)
{
  const std::set<int> descending{ ProximalLAD, MidLAD, DistalLAD, FirstDiagonal, SecondDiagonal,
    ThirdDiagonal, FirstSeptal, SecondSeptal, ThirdSeptal };
  const std::set<int> circumflex{ ProximalLCx, DistalLCx, FirstObtuseMarginal, SecondObtuseMarginal,
    ThirdObtuseMarginal, LeftPLB, LeftPDA };
  return (artery == "LCA" && treeId == 0) || (artery == "RCA" && treeId == 1) ||
    (artery == "LAD" && descending.count(segment) != 0) ||
    (artery == "LCx" && circumflex.count(segment) != 0);
}
}

double Distance(const Vector3& place, const std::vector<Vector3>& points)
{
  double minimum = std::numeric_limits<double>::infinity();
  for (const Vector3& point : points)
  {
    minimum = std::min(minimum, (point - place).squaredNorm());
  }
  return std::sqrt(minimum);
}

std::string LostPath::Text() const
{
  std::string text;
  double longest = 0.0;
  for (const auto& [segment, part] : this->segments)
  {
    longest = std::max(longest, part);
  }
  for (const auto& [segment, part] : this->segments)
  {
    if (part >= std::min(longest, MinimumStretch))
    {
      const std::string name = SegmentName(segment);
      text += (text.empty() ? "" : ", ") + (name.empty() ? "none" : name) + " " +
        std::to_string(std::lround(part));
    }
  }
  return text;
}

double ShareOnArteries(const PhantomTree& truth, const std::vector<Vector3>& line)
{
  double all = 0.0;
  double on = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i)
  {
    const double length = (line[i] - line[i - 1]).norm();
    all += length;
    on += IsOnArtery(truth, line[i]) ? length : 0.0;
  }
  return all > 0.0 ? on / all : 0.0;
}

double ShareNearArteries(const PhantomTree& truth, const std::vector<Vector3>& places)
{
  const auto on = std::count_if(
    places.begin(), places.end(), [&](const Vector3& place) { return IsOnArtery(truth, place); });
  return places.empty() ? 0.0 : static_cast<double>(on) / static_cast<double>(places.size());
}

LengthComparison CompareLengths(const PhantomTree& truth, const VesselTree& tree)
{
  LengthComparison result;
  double all = 0.0;
  Joiner missed(truth.points.size());
  std::vector<int> treeOf(truth.points.size(), 0);
  for (const VesselTree::Branch& branch : truth.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const std::int64_t p = branch.points[i];
      treeOf[static_cast<std::size_t>(p)] = branch.treeId;
      if (!Counts(truth, branch, i))
      {
        continue;
      }
      const double length = (truth.points[p] - truth.points[branch.points[i - 1]]).norm();
      all += length;
      if (Distance(truth.points[p], tree.points) > FoundWithin)
      {
        result.missed += length;
        missed.Add(branch.points[i - 1], p);
      }
    }
  }
  result.found = all > 0.0 ? 1.0 - result.missed / all : 0.0;
  result.losses = missed.LostPaths(truth.points,
    [&](LostPath& path, std::int64_t point, double length)
    {
      path.segments[truth.segmentId[point]] += length;
      path.treeId = treeOf[static_cast<std::size_t>(point)];
    });
  Joiner wrong(tree.points.size());
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const std::int64_t p = branch.points[i];
      if (!IsOnArtery(truth, tree.points[p]))
      {
        wrong.Add(branch.points[i - 1], p);
      }
    }
  }
  result.extras = wrong.LostPaths(tree.points, [](LostPath&, std::int64_t, double) {});
  for (const LostPath& extra : result.extras)
  {
    result.wrong += extra.length;
  }
  return result;
}

std::vector<Said> WarningsOf(const PhantomScan& scan, const FoundTree& found)
{
  std::vector<Said> list;
  if (!scan.doubt.empty())
  {
    list.push_back({ "ostia", scan.doubt, "", scan.seeds });
  }
  for (const char* name : { "LCA", "RCA" })
  {
    if (std::find(scan.seedNames.begin(), scan.seedNames.end(), name) == scan.seedNames.end())
    {
      list.push_back({ "ostia", std::string(name) + ": its ostium was not found", name, {} });
    }
  }
  for (std::size_t s = 0; s < found.extraction.seeds.size(); ++s)
  {
    const CenterlineEnd& end = found.extraction.seeds[s];
    if (end.status != EndStatus::Reached)
    {
      list.push_back({ "seeds", end.message, scan.seedNames[s], { scan.seeds[s] } });
    }
  }
  for (const RejectedVein& vein : found.extraction.veins)
  {
    if (const auto warning = DoubtfulVeinWarning(vein.position, vein.length, vein.probability))
    {
      list.push_back({ "vein", warning->what, "", { vein.position } });
    }
  }
  for (const std::string& message : found.extraction.messages)
  {
    list.push_back({ "centerline", message, "", {} });
  }
  const ScalarImage image = scan.Image();
  const ImageInterpolator interpolator(image);
  for (const VesselLink& link : scan.links)
  {
    constexpr double runsAcross = 2.0; // mm
    const Vector3& middle = link.points[link.points.size() / 2];
    if (Distance(middle, found.tree.points) <= runsAcross &&
      KindOfBridge(link, interpolator, scan.window.blood) == BridgeKind::Occlusion)
    {
      list.push_back({ "bridge", OcclusionWarning(link, "vessel").what, "", link.points });
    }
  }
  std::vector<double> vein;
  std::transform(found.tree.source.begin(), found.tree.source.end(), std::back_inserter(vein),
    [&](std::int64_t point) { return found.extraction.veinProbability[point]; });
  for (const TreeWarning& warning : CheckCoronaryTrees(found.tree, found.labels, vein))
  {
    list.push_back({ "check", warning.what, warning.vessel, { warning.place } });
  }
  const LooseVesselInput input{ image, scan.vesselness.data(), found.tree, found.labels.heart,
    scan.window.tissue, scan.window.blood };
  const std::vector<LooseVessel> loose = FindLooseVessels(input);
  for (const TreeWarning& warning : LooseVesselWarnings(loose))
  {
    const auto own = std::find_if(loose.begin(), loose.end(),
      [&](const LooseVessel& vessel)
      { return vessel.points[vessel.points.size() / 2] == warning.place; });
    list.push_back({ "loose", warning.what, warning.vessel, own->points });
  }
  return list;
}

std::vector<Said> WarningsOf(const SweptSurface& surface)
{
  std::vector<Said> list;
  for (const SweepLeftOut& part : surface.leftOut)
  {
    const std::string name = part.vessel.substr(0, part.vessel.find(" (group"));
    list.push_back({ "surface",
      part.vessel + " is left out for " + std::to_string(std::lround(part.length)) +
        " mm: " + part.reason,
      name, { part.place } });
  }
  return list;
}

bool Names(const Said& said, const LostPath& loss)
{
  for (const Vector3& place : said.places)
  {
    if (Distance(place, loss.points) <= NamesWithin)
    {
      return true;
    }
  }
  double held = 0.0;
  for (const auto& [segment, length] : loss.segments)
  {
    const std::string name = SegmentName(segment);
    held += (!name.empty() && said.vessel == name) || Holds(said.vessel, segment, loss.treeId)
      ? length
      : 0.0;
  }
  return held > 0.0 && held >= MinimumShare * loss.length;
}

bool IsJustified(
  const Said& said, const LengthComparison& lengths, const std::vector<Vector3>& troubles)
{
  const auto names = [&](const LostPath& path)
  { return path.length >= MinimumStretch && Names(said, path); };
  return std::any_of(lengths.losses.begin(), lengths.losses.end(), names) ||
    std::any_of(lengths.extras.begin(), lengths.extras.end(), names) ||
    std::any_of(said.places.begin(), said.places.end(),
      [&](const Vector3& place) { return Distance(place, troubles) <= NamesWithin; });
}

std::vector<LostPath> Untold(const LengthComparison& lengths, const std::vector<Said>& said)
{
  std::vector<LostPath> untold;
  for (const LostPath& loss : lengths.losses)
  {
    if (lengths.missed <= MaximumUntold ||
      (loss.length <= MaximumUntold && &loss != &lengths.losses.front()))
    {
      break; // what follows is shorter
    }
    if (std::none_of(said.begin(), said.end(), [&](const Said& s) { return Names(s, loss); }))
    {
      untold.push_back(loss);
    }
  }
  return untold;
}
}
