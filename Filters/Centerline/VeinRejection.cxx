#include "VeinRejection.h"

#include "CrossFrame.h"
#include "FittedOdds.h"
#include "Median.h"
#include "TreeLinks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace coronary
{
namespace
{
constexpr double Near = 20.0; ///< mm from a fork that are compared
constexpr double Far = 40.0;  ///< mm of a branch that are looked at
constexpr double Unlimited = std::numeric_limits<double>::infinity();
constexpr double MinimumLength = 8.0; ///< mm: what is shorter shows too little
constexpr double MinimumRadius = 2.0; ///< blurs: thinner lumens are darker for the blur alone
/// The same side by side, where the blur takes about as much from both.
constexpr double MinimumRadiusBeside = 1.5;
constexpr double Straight = 6.0; ///< mm along which a direction is measured
/// Few branches touch by chance: 3 in 100. Behind a lesion it is the chance that what was linked is none of the tree.
constexpr double Prior = -3.5;
constexpr double CutReach = 1.0;     ///< mm beyond a tip's wall
constexpr double Accompanied = 20.0; ///< mm beside an artery: as much as more
/// Share of the contrast by which the lumens of two arteries side by side differ: they hold the same blood.
constexpr double SameBlood = 0.04;
/// Bend of a vessel over the breadth of another one, and of the measured directions, rad; against directions at random
/// this tells a tube that goes through from two branches that face each other.
constexpr double ThroughBend = 0.15;
/// A vessel's radius at both sides of a place: error, logarithm.
constexpr double SameRadius = 0.15;
/// mm along the tree between the begins of two branches that can be one tube: two great lumens side by side.
constexpr double TouchLength = 15.0;
/// mm of what leaves an artery before it is another vessel's: the wall between two lumens that touch.
constexpr double LongestStem = 4.0;
/// mm of a vein that are closed, at least: more than what is looked for beyond a tip.
constexpr double CloseLength = 12.0;

/// Fitted to the branches of phantoms (scripts/fit-odds.sh); `others` with the rest held (fit-odds.py --only, bright-vein 310..323).
constexpr double Intercept = -5.04;
constexpr std::array<FittedSign, NumberOfVeinSigns> Signs{ {
  { "darker", 0.93 },
  { "brighter", 1.70 },
  { "darker_beside", 2.92 },
  { "brighter_beside", 1.33 },
  { "beside", 3.04 },
  { "beside_unclear", 0.67 },
  { "thinner", 1.47 },
  { "taper", 3.45 },
  { "strong_taper", 1.42 },
  { "no_taper", 0.59 },
  { "blunt_goes_on", 2.37 },
  { "blunt_cut", 3.00 },
  { "blunt", 4.41 },
  { "backwards", 1.84 },
  { "through", 1.20 },
  { "short", 2.43 },
  { "no_brightness", -0.04 },
  { "others", 0.86 },
} };

/// Robust standard deviation of values around their middle.
double SpreadAround(double middle, std::vector<double> values)
{
  for (double& value : values)
  {
    value = std::abs(value - middle);
  }
  return 1.4826 * MedianOf(std::move(values));
}

/// Standard deviation of a median by noise: samples within about 1 mm are not independent.
double SpreadOfMedian(const std::vector<double>& values)
{
  return SpreadAround(MedianOf(values), values) /
    std::sqrt(std::max(1.0, static_cast<double>(values.size()) / 4.0));
}

/// Lesions narrow a vessel, nothing widens it: its radius is what most of it has at least.
double UpperRadius(std::vector<double> values)
{
  return std::max(1e-9, QuantileOf(std::move(values), 0.8));
}

class VeinFinder
{
public:
  VeinFinder(const VesselTree& tree, const ImageInterpolator& image,
    const LumenReference& reference, double blur, const std::function<bool(const Vector3&)>& closed,
    double veins)
    : Tree(tree)
    , Links(tree)
    , Image(image)
    , Closed(closed)
    , Veins(veins)
    , Blur(blur)
    , Contrast(reference.lumen - reference.background)
  {
    this->Value.resize(tree.points.size());
    this->GivenBack.resize(tree.points.size());
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      // What the blur took from a thin lumen is given back.
      const double r = tree.radius[p] / std::max(1e-9, blur);
      const double kept = std::max(0.3, 1.0 - std::exp(-0.5 * r * r));
      const double seen =
        (image.At(tree.points[p]) - reference.background) / std::max(1e-9, this->Contrast);
      this->Value[p] = seen / kept;
      this->GivenBack[p] = seen / kept - seen;
    }
    std::vector<double> tips;
    for (std::size_t b = 0; b < tree.branches.size(); ++b)
    {
      if (this->Links.IsTip(b))
      {
        tips.push_back(std::log(this->TipRadius(this->Down(b, Unlimited))));
      }
    }
    this->UsualTip = tips.empty() ? 0.0 : MedianOf(tips);
  }

  std::vector<VeinBranch> Run();

private:
  /// Points along the tree from a fork on, with mm from it.
  struct Step
  {
    std::size_t point;
    double passed;
  };
  using Path = std::vector<Step>;
  /// A branch that may be a vein's.
  struct Arm
  {
    std::size_t number = 0; ///< of the branch where it begins
    VeinBranch branch;
    Path path;
    double brightness = 0.0; ///< step from the artery, share of the contrast, negative: darker
    double error = 0.0;      ///< of it, by noise; 0: not known
    double beside = 0.0;     ///< mm beside another artery
    double stepBeside = 0.0; ///< brightness over that of what it runs beside, share of the contrast
    double errorBeside = 0.0; ///< of it; 0: not known
    double calibre = 1.0;     ///< radius over the greatest of the artery before it
    /// Logarithm of its radius over that half of its length before, where that grows least; NaN: not known.
    double taper = std::numeric_limits<double>::quiet_NaN();
    double blunt = 0.0;   ///< logarithm of the radius at its tip over what tips of the tree have
    double takeOff = 0.0; ///< angle to the flow in the artery before, rad
    double through = 0.0; ///< odds that it goes on at the artery's other side, as a logarithm
    double doubt = 0.0;   ///< odds of a vein that a link before it adds, as a logarithm
    bool cut = false;     ///< it ends where a vein was closed, in an earlier round
    bool goesOn = false;  ///< there is as much blood ahead of its tip
  };
  /// What leaves the place where two arms begin, seen from there.
  struct Place
  {
    std::vector<std::size_t> through; ///< points of the artery there
    double radiusBefore = 0.0;        ///< of the artery
    Vector3 flow = Vector3::Zero();
    std::vector<std::size_t> others; ///< branches that go on
  };
  struct Side
  {
    Vector3 position = Vector3::Zero();
    Vector3 outwards = Vector3::Zero();
    double radius = 0.0;
  };

  const Vector3& At(std::int64_t point) const { return this->Tree.points[point]; }
  Path Down(std::size_t branch, double reach, std::vector<double>* forks = nullptr) const;
  Path Up(std::size_t branch, double reach) const;
  std::vector<double> Values(const std::vector<double>& of, const Path& run, double from) const;
  std::vector<double> Radii(const Path& run, double from, double to) const;
  double TipRadius(const Path& path) const;
  bool GoesOn(const Path& path) const;
  bool IsCut(const Path& path) const;
  void Beside(Arm& arm) const;
  std::optional<Arm> Describe(std::size_t branch, double reach) const;
  double VeinBegin(const Arm& arm) const;
  std::optional<double> Narrowest(const Path& path) const;
  void Weigh(Arm& arm) const;
  std::optional<Place> Between(std::size_t a, std::size_t b) const;
  std::optional<Side> SideOf(const Path& path, const Place& place) const;
  std::optional<double> Through(const Arm& a, const Arm& b) const;
  void FindOpposites(std::vector<Arm>& arms) const;

  const VesselTree& Tree;
  const TreeLinks Links;
  const ImageInterpolator& Image;
  const std::function<bool(const Vector3&)>& Closed;
  double Veins; ///< left out before
  double Blur;
  double Contrast;
  double UsualTip = 0.0; ///< logarithm of the radius
  double Usual =
    0.0; ///< brightness of most branches against what they leave, share of the contrast
  double Natural = 0.01;         ///< how they differ
  std::vector<double> Value;     ///< share of the contrast at a point
  std::vector<double> GivenBack; ///< of it, for the blur
};

/// A branch and those that go straight on.
/// @param forks  gets the mm at which it parts, if wanted
VeinFinder::Path VeinFinder::Down(
  std::size_t branch, double reach, std::vector<double>* forks) const
{
  Path run;
  double passed = 0.0;
  for (;;)
  {
    const std::vector<std::int64_t>& points = this->Tree.branches[branch].points;
    for (std::size_t i = 1; i < points.size(); ++i)
    {
      passed += (this->At(points[i]) - this->At(points[i - 1])).norm();
      run.push_back({ static_cast<std::size_t>(points[i]), passed });
      if (passed > reach)
      {
        return run;
      }
    }
    if (this->Links.IsTip(branch))
    {
      return run;
    }
    if (forks != nullptr)
    {
      forks->push_back(passed);
    }
    constexpr std::size_t chord = 8;
    const Vector3 ahead = (this->At(points.back()) -
      this->At(points[points.size() > chord ? points.size() - 1 - chord : 0]))
                            .normalized();
    double straightest = -2.0;
    for (const std::size_t daughter : this->Links.daughters[branch])
    {
      const std::vector<std::int64_t>& own = this->Tree.branches[daughter].points;
      const double straight =
        (this->At(own[std::min(own.size() - 1, chord)]) - this->At(own[0])).normalized().dot(ahead);
      if (straight > straightest)
      {
        straightest = straight;
        branch = daughter;
      }
    }
  }
}

/// From a branch's first point towards the root.
VeinFinder::Path VeinFinder::Up(std::size_t branch, double reach) const
{
  Path run;
  double passed = 0.0;
  for (std::int64_t b = this->Links.parent[branch]; b >= 0; b = this->Links.parent[b])
  {
    const VesselTree::Branch& up = this->Tree.branches[b];
    for (std::size_t i = up.points.size() - 1; i > 0; --i)
    {
      passed += (this->At(up.points[i]) - this->At(up.points[i - 1])).norm();
      run.push_back({ static_cast<std::size_t>(up.points[i - 1]), passed });
      if (passed > reach)
      {
        return run;
      }
    }
  }
  return run;
}

std::vector<double> VeinFinder::Values(
  const std::vector<double>& of, const Path& run, double from) const
{
  std::vector<double> values;
  for (const auto& [point, passed] : run)
  {
    if (passed >= from && this->Tree.radius[point] >= MinimumRadius * this->Blur &&
      !IsBridged(this->Tree, point))
    {
      values.push_back(of[point]);
    }
  }
  return values;
}

std::vector<double> VeinFinder::Radii(const Path& run, double from, double to) const
{
  std::vector<double> radii;
  for (const auto& [point, passed] : run)
  {
    if (passed >= from && passed < to && !IsBridged(this->Tree, point) &&
      (this->Tree.confidence.empty() || this->Tree.confidence[point] >= 0.5))
    {
      radii.push_back(this->Tree.radius[point]);
    }
  }
  return radii;
}

/// Of its last 3 mm.
double VeinFinder::TipRadius(const Path& path) const
{
  const double length = path.empty() ? 0.0 : path.back().passed;
  std::vector<double> radii = this->Radii(path, length - 3.0, length + 1.0);
  // How thin a lumen is that is thinner than the blur its width does not tell.
  return std::max({ this->Blur, radii.empty() ? 0.0 : MedianOf(std::move(radii)), 1e-9 });
}

/// Whether there is blood, and no calcium, ahead of a tip.
bool VeinFinder::GoesOn(const Path& path) const
{
  const double length = path.back().passed;
  std::vector<double> own;
  Vector3 before = this->Tree.points[path.front().point];
  for (const auto& [point, passed] : path)
  {
    if (passed >= length - Straight)
    {
      own.push_back(this->Image.At(this->Tree.points[point]));
    }
    else
    {
      before = this->Tree.points[point];
    }
  }
  const Vector3& tip = this->Tree.points[path.back().point];
  const Vector3 ahead = (tip - before).normalized();
  const double radius = this->TipRadius(path);
  std::vector<double> values;
  for (double s = 1.5 * radius; s <= 1.5 * radius + 2.0; s += 0.25)
  {
    values.push_back(this->Image.At(tip + s * ahead));
  }
  const double step = (MedianOf(values) - MedianOf(own)) / std::max(1e-9, this->Contrast);
  return std::abs(step) < 0.2;
}

/// Whether a course ends where something was closed.
bool VeinFinder::IsCut(const Path& path) const
{
  if (!this->Closed)
  {
    return false;
  }
  const double reach = this->TipRadius(path) + CutReach;
  const Vector3& tip = this->Tree.points[path.back().point];
  for (int direction = 0; direction < 27; ++direction)
  {
    const Vector3 way =
      Vector3(direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1).normalized();
    for (double s = 0.0; direction != 13 && s <= reach; s += 0.5)
    {
      if (this->Closed(tip + s * way))
      {
        return true;
      }
    }
  }
  return false;
}

/// Millimetres of a course within 3 mm of the wall of a vessel that it does not come from or give off there, and how much
/// brighter it is than that, side by side.
void VeinFinder::Beside(Arm& arm) const
{
  const Path& path = arm.path;
  // Of the course itself, and what leaves it.
  std::set<std::size_t> own;
  std::set<std::int64_t> points;
  for (const Step& step : path)
  {
    points.insert(static_cast<std::int64_t>(step.point));
  }
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    const std::vector<std::int64_t>& of = this->Tree.branches[b].points;
    if (points.count(of.front()) != 0 || points.count(of[1]) != 0)
    {
      own.insert(b);
    }
  }
  std::vector<double> steps;
  std::vector<double> given;
  double before = 0.0;
  for (const auto& [point, passed] : path)
  {
    const double length = passed - before;
    before = passed;
    if (passed < 10.0)
    {
      continue;
    }
    double gap = 3.0;
    std::optional<std::size_t> nearest;
    for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
    {
      const std::vector<std::int64_t>& other = this->Tree.branches[b].points;
      for (std::size_t i = 0; own.count(b) == 0 && i < other.size(); i += 3)
      {
        const auto q = static_cast<std::size_t>(other[i]);
        const double away = (this->Tree.points[q] - this->Tree.points[point]).norm() -
          this->Tree.radius[q] - this->Tree.radius[point];
        if (away < gap)
        {
          gap = away;
          nearest = q;
        }
      }
    }
    if (nearest)
    {
      arm.beside += length;
      const auto clear = [&](std::size_t p) {
        return this->Tree.radius[p] >= MinimumRadiusBeside * this->Blur &&
          !IsBridged(this->Tree, p);
      };
      if (clear(point) && clear(*nearest))
      {
        steps.push_back(this->Value[point] - this->Value[*nearest]);
        given.push_back(this->GivenBack[point] - this->GivenBack[*nearest]);
      }
    }
  }
  if (steps.size() >= 16)
  {
    arm.stepBeside = MedianOf(steps);
    // What the blur took is known by half.
    arm.errorBeside = std::hypot(SpreadOfMedian(steps), 0.5 * MedianOf(given));
  }
}

/// @param reach  mm of its course; where that is less than Far it goes on, and has no tip
std::optional<VeinFinder::Arm> VeinFinder::Describe(std::size_t branch, double reach) const
{
  Arm arm;
  arm.path = this->Down(branch, reach);
  const Path& down = arm.path;
  const Path up = this->Up(branch, Near);
  if (down.empty() || up.empty() || down.back().passed < MinimumLength)
  {
    return std::nullopt;
  }
  arm.number = branch;
  arm.branch.groupId = this->Tree.branches[branch].groupId;
  double widest = 0.0;
  for (const auto& [point, passed] : up)
  {
    widest = std::max(widest, this->Tree.radius[point]);
  }
  // The fork itself belongs to both.
  const double mouth = std::min(widest, 3.0) + 1.0;
  const double length = down.back().passed;
  // Behind a lesion blood may be thinner, and the vessel wider.
  const double sure =
    this->Tree.bridgeConfidence.empty() ? 1.0 : this->Tree.bridgeConfidence[down.front().point];
  if (sure < 1.0)
  {
    arm.doubt = std::max(0.0, std::log((1.0 - sure) / std::max(1e-9, sure)) - Prior);
  }
  else
  {
    arm.branch.known = true;
    const std::vector<double> own = this->Values(this->Value, down, mouth);
    const std::vector<double> before = this->Values(this->Value, up, mouth);
    if (own.size() >= 8 && before.size() >= 8)
    {
      arm.brightness = MedianOf(own) - MedianOf(before);
      // What the blur took is known by half.
      const double given = MedianOf(this->Values(this->GivenBack, down, mouth)) -
        MedianOf(this->Values(this->GivenBack, up, mouth));
      arm.error = std::hypot(SpreadOfMedian(own), SpreadOfMedian(before), 0.5 * given);
    }
    const std::vector<double> early = this->Radii(down, mouth, mouth + MinimumLength);
    if (!early.empty())
    {
      const std::vector<double> near = this->Radii(up, 1.5, 1.5 + MinimumLength);
      arm.calibre = MedianOf(early) / (near.empty() ? std::max(1e-9, widest) : UpperRadius(near));
    }
  }
  // A vein widens throughout, not only where its end runs into something else.
  const double third = (length - mouth) / 3.0;
  const std::vector<double> first = this->Radii(down, mouth, mouth + third);
  const std::vector<double> second = this->Radii(down, mouth + third, length - third);
  const std::vector<double> last = this->Radii(down, length - third, length + 1.0);
  if (length - mouth >= MinimumLength &&
    std::min({ first.size(), second.size(), last.size() }) >= 3)
  {
    const double middle = UpperRadius(second);
    // As between its halves.
    arm.taper = 1.5 * std::log(std::min(middle / UpperRadius(first), UpperRadius(last) / middle));
  }
  const Vector3& tip = this->Tree.points[down.back().point];
  const Vector3& before = this->Tree.points[down[down.size() > 8 ? down.size() - 9 : 0].point];
  if (reach >= Far && length <= Far && this->Image.Contains(tip + 2.0 * (tip - before)))
  {
    arm.blunt = std::log(this->TipRadius(down)) - this->UsualTip;
    arm.cut = this->IsCut(down);
    arm.goesOn = !arm.cut && this->GoesOn(down);
  }
  // Directions of the flow before, and of what leaves.
  const auto within = [](const Path& run, double passed)
  {
    const auto at =
      std::find_if(run.begin(), run.end(), [&](const Step& step) { return step.passed >= passed; });
    return (at == run.end() ? run.back() : *at).point;
  };
  const Vector3 flow =
    this->At(this->Tree.branches[branch].points.front()) - this->Tree.points[within(up, Straight)];
  const Vector3 leaving =
    this->Tree.points[within(down, mouth + Straight)] - this->Tree.points[within(down, mouth)];
  if (flow.norm() > 0.0 && leaving.norm() > 0.0)
  {
    arm.takeOff = UnitAngle(flow.normalized(), leaving.normalized());
  }
  this->Beside(arm);
  return arm;
}

void VeinFinder::Weigh(Arm& arm) const
{
  // In standard deviations, against most branches and against what it runs beside.
  const bool known = arm.error > 0.0;
  const double darker =
    known ? (this->Usual - arm.brightness) / std::hypot(arm.error, this->Natural) : 0.0;
  const bool knownBeside = arm.errorBeside > 0.0;
  const double darkerBeside =
    knownBeside ? -arm.stepBeside / std::hypot(arm.errorBeside, SameBlood) : 0.0;
  const double beside = std::min(1.0, arm.beside / Accompanied);
  const bool tapers = !std::isnan(arm.taper);
  const double blunt = std::clamp(arm.blunt, 0.0, 1.3);
  arm.branch.signs = {
    std::clamp(darker, 0.0, 6.0),
    std::clamp(darker, -3.0, 0.0),
    beside * std::clamp(darkerBeside, 0.0, 5.0),
    beside * std::clamp(darkerBeside, -5.0, 0.0),
    beside,
    knownBeside ? 0.0 : beside,
    std::clamp(std::log(std::max(1e-9, arm.calibre)), -1.0, 0.0),
    tapers ? std::clamp(arm.taper, -0.5, 0.2) : 0.0,
    tapers ? std::clamp(arm.taper + 0.5, -1.0, 0.0) : 0.0,
    tapers ? 0.0 : 1.0,
    arm.goesOn ? blunt : 0.0,
    arm.cut ? blunt : 0.0,
    arm.goesOn || arm.cut ? 0.0 : blunt,
    std::clamp(arm.takeOff - 1.8, 0.0, 1.0),
    std::clamp(arm.through, 0.0, 6.0),
    std::max(0.0, 20.0 - arm.path.back().passed) / 20.0,
    known ? 0.0 : 1.0,
    std::min(1.0, this->Veins),
  };
  arm.branch.probability =
    ProbabilityOf(arm.doubt + FittedOdds(Intercept, Signs, arm.branch.signs));
}

/// The artery between the begins of two branches, which goes on there.
std::optional<VeinFinder::Place> VeinFinder::Between(std::size_t a, std::size_t b) const
{
  const auto parents = [&](std::size_t branch)
  {
    std::vector<std::size_t> up;
    for (std::int64_t at = this->Links.parent[branch]; at >= 0; at = this->Links.parent[at])
    {
      up.push_back(at);
    }
    return up;
  };
  const std::vector<std::size_t> aboveA = parents(a);
  const std::vector<std::size_t> aboveB = parents(b);
  const auto has = [](const std::vector<std::size_t>& list, std::size_t branch)
  { return std::find(list.begin(), list.end(), branch) != list.end(); };
  if (has(aboveA, b) || has(aboveB, a))
  {
    return std::nullopt;
  }
  const auto common = std::find_if(
    aboveA.begin(), aboveA.end(), [&](std::size_t branch) { return has(aboveB, branch); });
  if (common == aboveA.end())
  {
    return std::nullopt;
  }
  std::size_t top = *common;
  std::set<std::size_t> on;
  double length = 0.0;
  const auto add = [&](std::size_t branch)
  {
    on.insert(branch);
    const std::vector<std::int64_t>& points = this->Tree.branches[branch].points;
    for (std::size_t i = 1; i < points.size(); ++i)
    {
      length += (this->At(points[i]) - this->At(points[i - 1])).norm();
    }
  };
  for (const std::vector<std::size_t>* above : { &aboveA, &aboveB })
  {
    for (auto at = above->begin(); *at != top; ++at)
    {
      add(*at);
    }
  }
  const auto others = [&]
  {
    std::vector<std::size_t> result;
    const auto look = [&](std::size_t branch)
    {
      for (const std::size_t daughter : this->Links.daughters[branch])
      {
        if (daughter != a && daughter != b && on.count(daughter) == 0)
        {
          result.push_back(daughter);
        }
      }
    };
    look(top);
    std::for_each(on.begin(), on.end(), look);
    return result;
  };
  Place place;
  place.others = others();
  // Where two vessels touch, the way into the other one may look like a short branch.
  double stem = length;
  while (place.others.empty() && !this->Links.IsRoot(top))
  {
    add(top);
    if (length - stem > LongestStem)
    {
      return std::nullopt;
    }
    top = this->Links.parent[top];
    place.others = others();
  }
  if (place.others.empty() || length > TouchLength)
  {
    return std::nullopt;
  }
  for (const std::size_t branch : on)
  {
    for (const std::int64_t point : this->Tree.branches[branch].points)
    {
      place.through.push_back(static_cast<std::size_t>(point));
    }
  }
  const Path up = this->Up(this->Links.daughters[top].front(), Near);
  for (const Step& step : up)
  {
    place.through.push_back(step.point);
  }
  for (const std::size_t branch : place.others)
  {
    for (const Step& step : this->Down(branch, Near))
    {
      place.through.push_back(step.point);
    }
  }
  const std::vector<double> before = this->Radii(up, 2.0, 2.0 + MinimumLength);
  const auto back =
    std::find_if(up.begin(), up.end(), [](const Step& step) { return step.passed >= Straight; });
  if (before.empty() || back == up.end())
  {
    return std::nullopt;
  }
  place.radiusBefore = MedianOf(before);
  place.flow = (this->At(this->Tree.branches[top].points.back()) - this->Tree.points[back->point])
                 .normalized();
  return place;
}

/// Where an arm is by itself: outside of the artery's wall.
std::optional<VeinFinder::Side> VeinFinder::SideOf(const Path& path, const Place& place) const
{
  std::size_t first = 0;
  for (; first < path.size() && path[first].passed < MinimumLength; ++first)
  {
    const std::size_t own = path[first].point;
    const bool inside = std::any_of(place.through.begin(), place.through.end(),
      [&](std::size_t q)
      {
        return (this->Tree.points[q] - this->Tree.points[own]).norm() <
          this->Tree.radius[q] + this->Tree.radius[own];
      });
    if (!inside)
    {
      break;
    }
  }
  std::size_t last = first;
  while (last + 1 < path.size() && path[last].passed < path[first].passed + Straight)
  {
    ++last;
  }
  if (first >= path.size() || path[last].passed - path[first].passed < 0.4 * Straight)
  {
    return std::nullopt;
  }
  Side side;
  Vector3 middle = Vector3::Zero();
  double passed = 0.0;
  std::vector<double> radii;
  const auto count = static_cast<double>(last - first + 1);
  for (std::size_t i = first; i <= last; ++i)
  {
    middle += this->Tree.points[path[i].point] / count;
    passed += path[i].passed / count;
    radii.push_back(this->Tree.radius[path[i].point]);
  }
  for (std::size_t i = first; i <= last; ++i)
  {
    side.outwards += (path[i].passed - passed) * (this->Tree.points[path[i].point] - middle);
  }
  side.outwards.normalize();
  side.position = middle - (passed - path[first].passed) * side.outwards;
  side.radius = std::max(1e-9, MedianOf(radii));
  return side.outwards.allFinite() ? std::optional<Side>(side) : std::nullopt;
}

/// The odds, as a logarithm, that two branches are one tube which goes through an artery, against two of its branches
/// with directions at random.
std::optional<double> VeinFinder::Through(const Arm& a, const Arm& b) const
{
  const std::optional<Place> place = this->Between(a.number, b.number);
  if (!place)
  {
    return std::nullopt;
  }
  const std::optional<Side> sideA = this->SideOf(a.path, *place);
  const std::optional<Side> sideB = this->SideOf(b.path, *place);
  if (!sideA || !sideB)
  {
    return std::nullopt;
  }
  // The artery goes on in another branch, which ought to be more like it than both.
  const auto unlike = [&](const Side& side)
  {
    return std::abs(std::log(side.radius / place->radiusBefore)) / (2.0 * SameRadius) +
      UnitAngle(side.outwards, place->flow) / 0.5;
  };
  double goesOn = std::numeric_limits<double>::infinity();
  for (const std::size_t branch : place->others)
  {
    Place alone = *place;
    alone.through.clear();
    if (const std::optional<Side> side = this->SideOf(this->Down(branch, Near), alone))
    {
      goesOn = std::min(goesOn, unlike(*side));
    }
  }
  const Vector3 chord = sideB->position - sideA->position;
  double bend = UnitAngle(-sideA->outwards, sideB->outwards);
  if (chord.norm() > 1.0)
  {
    bend = std::max({ bend, UnitAngle(-sideA->outwards, chord.normalized()),
      UnitAngle(sideB->outwards, chord.normalized()) });
  }
  const double step = std::log(sideA->radius / sideB->radius) / SameRadius;
  const double turn = bend / ThroughBend;
  // Both ends hold the same blood.
  double blood = 0.0;
  if (a.error > 0.0 && b.error > 0.0)
  {
    blood = (a.brightness - b.brightness) / std::hypot(std::hypot(a.error, b.error), this->Natural);
  }
  const double instead = std::max(0.0, goesOn - std::min(unlike(*sideA), unlike(*sideB)));
  return std::log(2.0 / (ThroughBend * ThroughBend)) - 0.5 * turn * turn - 0.5 * step * step -
    0.5 * blood * blood - instead;
}

/// Two arms that are each other's best continuation may be one tube.
void VeinFinder::FindOpposites(std::vector<Arm>& arms) const
{
  struct Best
  {
    double odds = 0.0;
    std::size_t other = 0;
  };
  std::vector<Best> best(arms.size());
  for (std::size_t a = 0; a < arms.size(); ++a)
  {
    for (std::size_t b = a + 1; b < arms.size(); ++b)
    {
      const std::optional<double> through = this->Through(arms[a], arms[b]);
      if (!through)
      {
        continue;
      }
      if (*through > best[a].odds)
      {
        best[a] = { *through, b };
      }
      if (*through > best[b].odds)
      {
        best[b] = { *through, a };
      }
    }
  }
  for (std::size_t a = 0; a < arms.size(); ++a)
  {
    const std::size_t b = best[a].other;
    if (best[a].odds > 0.0 && best[b].other == a)
    {
      arms[a].through = best[a].odds;
    }
  }
}

/// mm at which an arm becomes a vein: what is judged as one may be an artery up to where the vein touches it.
double VeinFinder::VeinBegin(const Arm& arm) const
{
  const std::size_t branch = arm.number;
  std::vector<double> places;
  this->Down(branch, Far, &places);
  if (const std::optional<double> narrow = this->Narrowest(arm.path))
  {
    places.insert(std::upper_bound(places.begin(), places.end(), *narrow), *narrow);
  }
  double begin = 0.0;
  for (const double place : places)
  {
    std::optional<Arm> stem = this->Describe(branch, place);
    if (!stem || place >= Far)
    {
      continue;
    }
    this->Weigh(*stem);
    if (stem->branch.probability >= 0.5)
    {
      break;
    }
    begin = place;
  }
  return begin;
}

/// mm at which a course is narrowest, where it widens on both sides of it: an artery's thin end may touch a vein.
std::optional<double> VeinFinder::Narrowest(const Path& path) const
{
  constexpr double around = 1.5;  // mm
  constexpr double widens = 1.15; // of the radius
  const double length = path.empty() ? 0.0 : path.back().passed;
  double minimum = std::numeric_limits<double>::infinity();
  double place = 0.0;
  for (const Step& step : path)
  {
    if (step.passed < MinimumLength || step.passed > length - MinimumLength)
    {
      continue;
    }
    const std::vector<double> radii = this->Radii(path, step.passed - around, step.passed + around);
    const double radius = radii.empty() ? minimum : MedianOf(radii);
    if (radius < minimum)
    {
      minimum = radius;
      place = step.passed;
    }
  }
  const std::vector<double> before = this->Radii(path, 0.0, place);
  const std::vector<double> behind = this->Radii(path, place, length + 1.0);
  if (before.empty() || behind.empty() || UpperRadius(before) < widens * minimum ||
    UpperRadius(behind) < widens * minimum)
  {
    return std::nullopt;
  }
  return place;
}

std::vector<VeinBranch> VeinFinder::Run()
{
  std::vector<Arm> arms;
  std::vector<double> steps;
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    if (std::optional<Arm> one = this->Describe(b, Far))
    {
      if (one->error > 0.0)
      {
        steps.push_back(one->brightness);
      }
      arms.push_back(std::move(*one));
    }
  }
  // Most branches are arteries: how these differ is the measure.
  if (!steps.empty())
  {
    this->Usual = std::clamp(MedianOf(steps), -0.1, 0.0);
    this->Natural = std::max(this->Natural, SpreadAround(this->Usual, steps));
  }
  this->FindOpposites(arms);
  std::vector<VeinBranch> branches;
  for (Arm& arm : arms)
  {
    this->Weigh(arm);
    VeinBranch& branch = arm.branch;
    // What ends as wide as a vein is one to its end; else an artery may have been entered through it.
    const double begin = branch.probability >= 0.5 ? this->VeinBegin(arm) : 0.0;
    const double end = arm.blunt > 0.35 ? 2.0 * Far : begin + CloseLength;
    for (const Step& step : arm.path)
    {
      branch.path.push_back(this->Tree.points[step.point]);
      if (step.passed > begin && (branch.closed.empty() || step.passed <= end))
      {
        branch.closed.push_back(static_cast<std::int64_t>(step.point));
      }
    }
    branches.push_back(std::move(branch));
  }
  return branches;
}
}

const std::array<const char*, NumberOfVeinSigns>& VeinSignNames()
{
  static const std::array<const char*, NumberOfVeinSigns> names = NamesOf(Signs);
  return names;
}

std::vector<VeinBranch> JudgeBranches(const VesselTree& tree, const ImageInterpolator& image,
  const LumenReference& reference, double blur, const std::function<bool(const Vector3&)>& closed,
  double veins)
{
  return VeinFinder(tree, image, reference, blur, closed, veins).Run();
}

std::vector<double> VeinProbabilityOfPoints(
  const VesselTree& tree, const std::vector<VeinBranch>& judged)
{
  std::map<int, double> ofGroup;
  for (const VeinBranch& branch : judged)
  {
    ofGroup[branch.groupId] = branch.probability;
  }
  std::vector<double> result(tree.points.size(), 0.0);
  // A parent stands before its daughters.
  for (const VesselTree::Branch& branch : tree.branches)
  {
    double& own = ofGroup[branch.groupId];
    own = branch.parentGroupId < 0 ? own : std::max(own, ofGroup[branch.parentGroupId]);
    // The first point is the parent's.
    for (std::size_t i = branch.parentGroupId < 0 ? 0 : 1; i < branch.points.size(); ++i)
    {
      result[static_cast<std::size_t>(branch.points[i])] = own;
    }
  }
  return result;
}

double VeinProbabilityOf(
  const std::vector<std::int64_t>& branch, const std::vector<double>& ofPoints)
{
  double greatest = 0.0;
  for (std::size_t i = 1; i < branch.size() && !ofPoints.empty(); ++i)
  {
    greatest = std::max(greatest, ofPoints[static_cast<std::size_t>(branch[i])]);
  }
  return greatest;
}
}
