#include "StenosisGrading.h"

#include "CoronaryAnatomy.h"
#include "CurveSmoothing.h"
#include "Median.h"
#include "Require.h"
#include "TreeLinks.h"
#include "VesselTips.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double MinimumDegree = 0.30; ///< of what is listed
constexpr double Wavelength = 80.0;    ///< mm along a vessel of the healthy calibre's changes
constexpr double MinimumSignificance =
  3.0;                       ///< standard deviations by which a narrowing exceeds its error
constexpr double Bin = 1.0;  ///< mm, of the regression
constexpr double Fine = 0.5; ///< mm, of the profile
constexpr double ProfileWavelength = 3.0; ///< mm, that the graded profile halves
constexpr double HealthySpread = 0.06;    ///< relative, of radii around the healthy calibre
constexpr double MethodError = 0.04;      ///< mm, of a radius, beside the image's noise
constexpr double BlurError = 0.10;        ///< relative, of small radii: the blur is known no better
constexpr double LongestLesion = 45.0; ///< mm with its shoulders; beyond it is the vessel's calibre
constexpr double ClosedMargin =
  1.12;                             ///< that the healthy radius may exceed the wider shoulder's end
constexpr double WidestShare = 1.7; ///< of the population's diameter: beyond it little is certain
constexpr double TipLength =
  6.0; ///< mm before a vessel's end that are not graded, but for one that it is lost in
constexpr double MouthLength = 2.0;      ///< mm behind an ostium that are not graded
constexpr double NormalQuantile = 1.645; ///< 5 % to either side
constexpr double UncertainRange = 0.8;   ///< of degrees: one that wide tells nothing
constexpr double OccludedRadius = 0.2;   ///< mm: less is no lumen that can be seen
constexpr double LostRadius = 0.35;      ///< mm: a lumen that is thinner may be lost in the noise

/// One vessel at equal steps.
struct Profile
{
  double step = Fine;
  std::vector<double> radius;     ///< mm
  std::vector<double> weight;     ///< 0: not measured
  std::vector<double> deviation;  ///< mm
  std::vector<std::size_t> place; ///< nearest index in the path
  std::size_t size() const { return this->radius.size(); }
};

Profile Resample(const VesselPath& path, const RefinedLumen& lumen, double step)
{
  Profile profile;
  profile.step = step;
  const auto count = static_cast<std::size_t>(std::floor(path.arc.back() / step)) + 1;
  profile.radius.assign(count, 0.0);
  profile.weight.assign(count, 0.0);
  profile.deviation.assign(count, 0.0);
  profile.place.assign(count, 0);
  std::vector<double> nearest(count, 1e30);
  for (std::size_t i = 0; i < path.points.size(); ++i)
  {
    const auto bin = std::min(count - 1, static_cast<std::size_t>(std::lround(path.arc[i] / step)));
    const double off = std::abs(path.arc[i] - static_cast<double>(bin) * step);
    if (off < nearest[bin])
    {
      nearest[bin] = off;
      profile.place[bin] = i;
    }
    const std::int64_t p = path.points[i];
    // The first point of a branch is its parent's.
    if (lumen.measured[p] <= 0.0 || (i == 0 && path.parent >= 0))
    {
      continue;
    }
    const double deviation = lumen.deviation[p];
    const double weight = 1.0 / (deviation * deviation + 0.0025);
    profile.radius[bin] += weight * lumen.measured[p];
    profile.deviation[bin] += weight * deviation;
    profile.weight[bin] += weight;
  }
  for (std::size_t b = 0; b < count; ++b)
  {
    if (profile.weight[b] > 0.0)
    {
      profile.radius[b] /= profile.weight[b];
      profile.deviation[b] /= profile.weight[b];
    }
    if (nearest[b] > 1e29 && b > 0)
    {
      profile.place[b] = profile.place[b - 1];
    }
  }
  return profile;
}

/// How much narrower a vessel may become where others leave, in steps of the profile, mm. 0: nothing leaves.
std::vector<double> StepsAt(const VesselTree& tree, const std::vector<VesselPath>& paths,
  std::size_t number, const Profile& profile)
{
  const VesselPath& path = paths[number];
  std::vector<double> steps(profile.size(), 0.0);
  for (const VesselPath& other : paths)
  {
    if (other.parent != static_cast<int>(number))
    {
      continue;
    }
    const auto at = std::find(path.points.begin(), path.points.end(), other.points.front());
    if (at == path.points.end())
    {
      continue;
    }
    const auto place = static_cast<std::size_t>(at - path.points.begin());
    const double own = tree.radius[path.points[place]];
    // Behind its mouth.
    std::vector<double> radii;
    for (std::size_t i = 1; i < other.points.size() && other.arc[i] < own + 8.0; ++i)
    {
      if (other.arc[i] > own || i + 1 == other.points.size())
      {
        radii.push_back(tree.radius[other.points[i]]);
      }
    }
    if (radii.empty())
    {
      continue;
    }
    const double ratio = std::min(0.95, MedianOf(std::move(radii)) / std::max(own, 0.1));
    const double step = own * (1.0 - std::pow(1.0 - std::pow(ratio, 7.0 / 3.0), 3.0 / 7.0));
    const auto bin = std::min(
      profile.size() - 1, static_cast<std::size_t>(std::lround(path.arc[place] / profile.step)));
    steps[bin] = std::max(steps[bin], step);
  }
  return steps;
}

/// The healthy radius along a vessel, and its standard deviation.
struct Reference
{
  std::vector<double> radius;
  double spread = 0.0; ///< mm
};

std::vector<double> UpperStart(const Profile& profile)
{
  const auto reach = static_cast<std::ptrdiff_t>(std::lround(15.0 / profile.step));
  const auto count = static_cast<std::ptrdiff_t>(profile.size());
  std::vector<double> start(profile.size(), 0.0);
  std::vector<double> all;
  for (std::size_t i = 0; i < profile.size(); ++i)
  {
    if (profile.weight[i] > 0.0)
    {
      all.push_back(profile.radius[i]);
    }
  }
  std::sort(all.begin(), all.end());
  for (std::ptrdiff_t i = 0; i < count; ++i)
  {
    std::vector<double> near;
    for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, i - reach);
         j <= std::min(count - 1, i + reach); ++j)
    {
      if (profile.weight[j] > 0.0)
      {
        near.push_back(profile.radius[j]);
      }
    }
    if (near.size() < 3)
    {
      start[i] = all[all.size() * 7 / 10];
      continue;
    }
    std::sort(near.begin(), near.end());
    start[i] = near[near.size() * 7 / 10];
  }
  return start;
}

Reference Regress(const Profile& profile, const std::vector<double>& steps)
{
  const auto count = static_cast<Eigen::Index>(profile.size());
  Reference reference;
  reference.radius = UpperStart(profile);
  const double samples = Wavelength / profile.step / (2.0 * M_PI);
  // Data count with 1 / (spread^2); the curve may bend as much as the wavelength lets it.
  const double stiffness = std::pow(samples, 4);
  std::vector<double> weights(profile.size(), 0.0);
  for (int pass = 0; pass < 25; ++pass)
  {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    double total = 0.0;
    double sum = 0.0;
    for (Eigen::Index i = 0; i < count; ++i)
    {
      const double x = reference.radius[i];
      weights[i] = 0.0;
      if (profile.weight[i] <= 0.0)
      {
        continue;
      }
      const double error = std::hypot(HealthySpread * x, profile.deviation[i]);
      const double far = (profile.radius[i] - x) / error;
      // Narrowings are lesions, widenings mostly mouths of branches.
      weights[i] =
        far < 0.0 ? 1.0 / std::pow(1.0 + 0.5 * far * far, 2) : 1.0 / (1.0 + 0.25 * far * far);
      weights[i] *= std::pow(HealthySpread * x / error, 2);
      normal(i, i) += weights[i];
      right[i] += weights[i] * profile.radius[i];
      total += weights[i];
      sum += weights[i] * std::pow(profile.radius[i] - x, 2);
    }
    reference.spread = total > 0.0 ? std::sqrt(sum / total) : 0.0;
    const auto add = [&](std::initializer_list<std::pair<Eigen::Index, double>> row, double weight)
    {
      for (const auto& a : row)
      {
        for (const auto& b : row)
        {
          normal(a.first, b.first) += weight * a.second * b.second;
        }
      }
    };
    for (Eigen::Index i = 0; i + 2 < count; ++i)
    {
      // A step between two samples makes the two second differences over it free.
      const bool step = steps[i + 1] > 0.0 || (i > 0 && steps[i] > 0.0);
      if (!step)
      {
        add({ { i, 1.0 }, { i + 1, -2.0 }, { i + 2, 1.0 } }, stiffness);
      }
    }
    for (Eigen::Index i = 0; i + 1 < count; ++i)
    {
      if (steps[i] > 0.0)
      {
        const double spread = (0.5 * steps[i] + 0.02) / (HealthySpread * reference.radius[i]);
        add({ { i, 1.0 }, { i + 1, -1.0 } }, 1.0 / (spread * spread * 4.0));
        // The slope is the same before and behind.
        if (i > 0 && i + 2 < count)
        {
          add({ { i - 1, 1.0 }, { i, -1.0 }, { i + 1, -1.0 }, { i + 2, 1.0 } }, stiffness);
        }
      }
      // Arteries do not widen downstream.
      if (reference.radius[i + 1] > reference.radius[i])
      {
        add({ { i, 1.0 }, { i + 1, -1.0 } }, 0.02 * stiffness);
      }
    }
    normal.diagonal().array() += 1e-9;
    const Eigen::VectorXd solved = normal.ldlt().solve(right);
    double change = 0.0;
    for (Eigen::Index i = 0; i < count; ++i)
    {
      const double x = std::max(0.1, solved[i]);
      change = std::max(change, std::abs(x - reference.radius[i]));
      reference.radius[i] = x;
    }
    if (change < 1e-3)
    {
      break;
    }
  }
  return reference;
}

/// Valleys shorter than `length` samples filled up to their lower shoulder: a vessel that gets narrower and stays so is
/// a vessel that gets narrower.
std::vector<double> Closed(const std::vector<double>& values, double length)
{
  const auto count = static_cast<std::ptrdiff_t>(values.size());
  const auto reach = static_cast<std::ptrdiff_t>(std::lround(0.5 * length));
  std::vector<double> dilated(values.size());
  std::vector<double> closed(values.size());
  const auto extreme = [&](const std::vector<double>& from, std::ptrdiff_t i, bool maximum)
  {
    const auto first = from.begin() + std::max<std::ptrdiff_t>(0, i - reach);
    const auto last = from.begin() + std::min(count, i + reach + 1);
    return maximum ? *std::max_element(first, last) : *std::min_element(first, last);
  };
  for (std::ptrdiff_t i = 0; i < count; ++i)
  {
    dilated[i] = extreme(values, i, true);
  }
  for (std::ptrdiff_t i = 0; i < count; ++i)
  {
    closed[i] = extreme(dilated, i, false);
  }
  return closed;
}

/// What grading one vessel needs.
struct GradedPath
{
  const VesselTree& tree;
  const VesselPath& path;
  const RefinedLumen& lumen;
  Profile profile;
  std::vector<double> smooth;    ///< radius, mm
  std::vector<double> reference; ///< mm
  std::vector<double> degree;
  double spread = 0.0;

  std::int64_t PointAt(std::size_t sample) const
  {
    return this->path.points[this->profile.place[sample]];
  }
  bool IsBridged(std::size_t sample) const
  {
    return coronary::IsBridged(this->tree, this->PointAt(sample));
  }
  bool IsHidden(std::size_t sample) const
  {
    return this->lumen.interpolated[this->PointAt(sample)] != 0;
  }
  void Describe(
    std::size_t first, std::size_t minimum, std::size_t last, std::vector<Stenosis>& lesions) const;
  void FindLesions(std::vector<Stenosis>& lesions) const;
  void DescribeEnd(const VesselTip& tip, std::vector<Stenosis>& lesions) const;

private:
  void Place(std::size_t first, std::size_t minimum, std::size_t last, Stenosis& lesion) const;
  void Grade(
    double radius, double healthy, double radiusError, double healthyError, Stenosis& lesion) const;
};

/// Where a lesion is, by samples of the profile.
void GradedPath::Place(
  std::size_t first, std::size_t minimum, std::size_t last, Stenosis& lesion) const
{
  lesion.point = this->PointAt(minimum);
  lesion.position = this->tree.points[lesion.point];
  lesion.segmentId = this->tree.segmentId.empty() ? 0 : this->tree.segmentId[lesion.point];
  const auto abscissa = [&](std::size_t sample)
  { return this->tree.abscissa.empty() ? 0.0 : this->tree.abscissa[this->PointAt(sample)]; };
  lesion.abscissaStart = abscissa(first);
  lesion.abscissaMinimum = abscissa(minimum);
  lesion.abscissaEnd = abscissa(last);
  lesion.length = static_cast<double>(last - first) * this->profile.step;
  lesion.populationDiameter = PopulationDiameter(lesion.segmentId);
}

/// How much is gone of the healthy radius, with its range. Errors are standard deviations, mm.
void GradedPath::Grade(
  double radius, double healthy, double radiusError, double healthyError, Stenosis& lesion) const
{
  lesion.minimumDiameter = 2.0 * radius;
  lesion.referenceDiameter = 2.0 * healthy;
  lesion.degree = std::clamp(1.0 - radius / healthy, 0.0, 1.0);
  lesion.areaDegree = 1.0 - std::pow(1.0 - lesion.degree, 2);
  const double error = (1.0 - lesion.degree) *
    std::hypot(radiusError / std::max(radius, 0.02), healthyError / healthy) * NormalQuantile;
  lesion.degreeLow = std::clamp(lesion.degree - error, 0.0, 1.0);
  lesion.degreeHigh = std::clamp(lesion.degree + error, 0.0, 1.0);
}

/// A vessel whose line ends in a lesion: what is seen of it, or more.
void GradedPath::DescribeEnd(const VesselTip& tip, std::vector<Stenosis>& lesions) const
{
  constexpr double farther[] = { 5.0, 9.0 }; // mm before the tip: not yet narrowed
  const double healthy =
    std::max(tip.before, RadiusBeforeTip(this->tree, this->path, farther[0], farther[1]));
  // What ends in full calibre shows no lesion.
  constexpr double narrowed = 0.85; // of the radius before
  if (healthy < MinimumGradedRadius || tip.end > narrowed * tip.before)
  {
    return;
  }
  const std::size_t last = this->profile.size() - 1;
  std::size_t first = last;
  while (first > 0 && this->smooth[first - 1] < 0.5 * (healthy + tip.end))
  {
    --first;
  }
  Stenosis lesion;
  this->Place(first, last, last, lesion);
  this->Grade(
    tip.end, healthy, std::hypot(MethodError, BlurError * tip.end), 0.03 * healthy, lesion);
  lesion.degreeHigh = 1.0;
  lesion.confidence = tip.goesOn * std::max(0.05, 1.0 - (1.0 - lesion.degreeLow) / UncertainRange);
  lesion.kind = LesionKind::Lost;
  lesions.push_back(lesion);
}

void GradedPath::Describe(
  std::size_t first, std::size_t minimum, std::size_t last, std::vector<Stenosis>& lesions) const
{
  const double radius = this->smooth[minimum];
  const double healthy = this->reference[minimum];
  Stenosis lesion;
  double calcium = 0.0;
  double hidden = 0.0;
  double measured = 0.0;
  double bridgeTrust = 1.0;
  for (std::size_t i = first; i <= last; ++i)
  {
    const std::int64_t p = this->PointAt(i);
    calcium += this->lumen.calcium[p] != 0 ? 1.0 : 0.0;
    hidden += this->IsHidden(i) ? 1.0 : 0.0;
    measured += this->profile.weight[i] > 0.0 ? 1.0 : 0.0;
    if (this->IsBridged(i))
    {
      lesion.bridged = true;
      bridgeTrust = this->tree.bridgeConfidence.empty()
        ? std::min(bridgeTrust, 0.5)
        : std::min(bridgeTrust, this->tree.bridgeConfidence[p]);
    }
  }
  const auto samples = static_cast<double>(last - first + 1);
  lesion.interpolated = this->IsHidden(minimum);
  // In a mouth nothing is measured; a lesion that is mostly unseen must be bridged or behind calcium.
  if (measured + hidden < 0.5 * samples && !lesion.bridged)
  {
    return;
  }
  double deviation = std::hypot(MethodError,
    this->profile.weight[minimum] > 0.0 ? this->profile.deviation[minimum] : 0.3 * radius);
  deviation = std::hypot(deviation, BlurError * radius * std::exp(-radius / 0.5));
  // A part of the wall is behind calcium.
  deviation =
    std::hypot(deviation, 0.35 * healthy * this->lumen.calciumArc[this->PointAt(minimum)] / 360.0);
  const double referenceError = std::hypot(0.03 * healthy, 0.5 * this->spread);
  const double significance = (healthy - radius) / std::hypot(deviation, referenceError);
  // Behind calcium a narrowing can not be told from none: it is listed, with the range of all that it may be.
  if (!lesion.interpolated && significance < MinimumSignificance)
  {
    return;
  }
  this->Place(first, minimum, last, lesion);
  this->Grade(radius, healthy, deviation, referenceError, lesion);
  const bool occluded = radius <= OccludedRadius && lesion.degree > 0.85;
  if (occluded)
  {
    lesion.degreeLow = std::min(lesion.degreeLow, std::max(0.0, 1.0 - LostRadius / healthy));
  }
  // Nor is none told from a thin one, where the way across was not seen.
  if (lesion.bridged && radius <= LostRadius)
  {
    lesion.degreeHigh = 1.0;
  }
  if (lesion.interpolated)
  {
    lesion.degreeLow = 0.0;
    lesion.degreeHigh = 1.0;
  }
  lesion.confidence =
    std::max(0.05, 1.0 - (lesion.degreeHigh - lesion.degreeLow) / UncertainRange) * bridgeTrust;
  // An artery is hardly ever so wide: the line may run in something else.
  if (lesion.populationDiameter > 0.0 &&
    lesion.referenceDiameter > WidestShare * lesion.populationDiameter)
  {
    lesion.confidence *= 0.3;
  }
  lesion.kind = occluded      ? LesionKind::Occluded
    : lesion.bridged          ? LesionKind::Bridged
    : calcium > 0.5 * samples ? LesionKind::Calcified
    : calcium > 0.0           ? LesionKind::Mixed
                              : LesionKind::Soft;
  lesions.push_back(lesion);
}

void GradedPath::FindLesions(std::vector<Stenosis>& lesions) const
{
  const std::size_t count = this->profile.size();
  const auto tip =
    static_cast<std::size_t>(std::min<double>(static_cast<double>(count), TipLength / Fine));
  // In the mouth of the aorta no section is the vessel's alone.
  const std::size_t start =
    this->path.parent < 0 ? static_cast<std::size_t>(std::lround(MouthLength / Fine)) : 0;
  std::vector<char> taken(count, 0);
  for (;;)
  {
    // The worst place that is left, then down to half of it on either side.
    std::size_t minimum = count;
    double worst = MinimumDegree;
    for (std::size_t i = start; i + tip < count; ++i)
    {
      if (taken[i] == 0 && this->degree[i] >= worst && this->reference[i] >= MinimumGradedRadius)
      {
        worst = this->degree[i];
        minimum = i;
      }
    }
    if (minimum == count)
    {
      return;
    }
    const double border = 0.5 * this->degree[minimum];
    std::size_t first = minimum;
    std::size_t last = minimum;
    while (first > 0 && this->degree[first - 1] > border)
    {
      --first;
    }
    while (last + 1 < count && this->degree[last + 1] > border)
    {
      ++last;
    }
    bool overlap = false;
    for (std::size_t i = first; i <= last; ++i)
    {
      overlap = overlap || taken[i] != 0;
    }
    // The shoulders belong to it, too.
    std::size_t from = first;
    std::size_t to = last;
    while (from > 0 && this->degree[from - 1] > 0.1 && this->degree[from - 1] <= this->degree[from])
    {
      --from;
    }
    while (to + 1 < count && this->degree[to + 1] > 0.1 && this->degree[to + 1] <= this->degree[to])
    {
      ++to;
    }
    std::fill(taken.begin() + static_cast<std::ptrdiff_t>(from),
      taken.begin() + static_cast<std::ptrdiff_t>(to) + 1, 1);
    // A vessel that only ever gets narrower to its end has no lesion there, but its end.
    if (!overlap && last + tip < count + tip / 2)
    {
      this->Describe(first, minimum, last, lesions);
    }
  }
}
}

const char* LesionKindName(LesionKind kind)
{
  switch (kind)
  {
    case LesionKind::Soft:
      return "soft";
    case LesionKind::Calcified:
      return "calcified";
    case LesionKind::Mixed:
      return "mixed";
    case LesionKind::Occluded:
      return "occluded";
    case LesionKind::Lost:
      return "lost";
    case LesionKind::Bridged:
    default:
      return "bridged";
  }
}

double PopulationDiameter(int segmentId)
{
  switch (segmentId)
  {
    case LeftMain:
      return 4.5;
    case ProximalLAD:
      return 3.6;
    case MidLAD:
      return 2.5;
    case DistalLAD:
      return 1.7;
    case ProximalRCA:
      return 3.9;
    case MidRCA:
      return 3.4;
    case DistalRCA:
      return 3.1;
    case RightPDA:
      return 2.1;
    case RightPLB:
      return 1.7;
    case ProximalLCx:
      return 3.4;
    case DistalLCx:
      return 2.8;
    case FirstDiagonal:
    case SecondDiagonal:
      return 1.8;
    case FirstObtuseMarginal:
    case SecondObtuseMarginal:
      return 1.9;
    case RamusIntermedius:
      return 1.7;
    default:
      return 0.0;
  }
}

StenosisGrading GradeStenoses(
  const VesselTree& tree, const std::vector<VesselPath>& paths, const RefinedLumen& lumen)
{
  CheckTree(tree);
  const std::size_t points = tree.points.size();
  if (lumen.measured.size() != points || lumen.deviation.size() != points ||
    lumen.calcium.size() != points || lumen.interpolated.size() != points)
  {
    throw std::invalid_argument("GradeStenoses: arrays must have one value a point of the tree");
  }
  StenosisGrading result;
  result.degree.assign(points, 0.0);
  result.referenceRadius = tree.radius;
  const std::vector<VesselTip> tips = JudgeTips(tree, paths);
  const std::vector<std::int64_t> branches = BranchesOfPoints(tree);
  for (std::size_t n = 0; n < paths.size(); ++n)
  {
    const VesselPath& path = paths[n];
    const Profile coarse = Resample(path, lumen, Bin);
    if (std::count_if(coarse.weight.begin(), coarse.weight.end(),
          [](double weight) { return weight > 0.0; }) < 8)
    {
      continue;
    }
    const Reference reference = Regress(coarse, StepsAt(tree, paths, n, coarse));
    GradedPath graded{ tree, path, lumen, Resample(path, lumen, Fine), {}, {}, {},
      reference.spread };
    const auto referenceAt = [&](double arc)
    {
      const double at = std::clamp(arc / Bin, 0.0, static_cast<double>(coarse.size() - 1));
      const auto low = std::min(static_cast<std::size_t>(at), coarse.size() - 1);
      const std::size_t high = std::min(low + 1, coarse.size() - 1);
      const double fraction = at - static_cast<double>(low);
      return reference.radius[low] + fraction * (reference.radius[high] - reference.radius[low]);
    };
    graded.smooth =
      SmoothSequence(graded.profile.radius, graded.profile.weight, ProfileWavelength / Fine);
    for (double& radius : graded.smooth)
    {
      radius = std::max(0.0, radius);
    }
    const std::vector<double> open = Closed(graded.smooth, LongestLesion / Fine);
    for (std::size_t i = 0; i < graded.profile.size(); ++i)
    {
      graded.reference.push_back(
        std::min(referenceAt(static_cast<double>(i) * Fine), ClosedMargin * open[i]));
      graded.degree.push_back(std::clamp(1.0 - graded.smooth[i] / graded.reference[i], 0.0, 1.0));
    }
    for (std::size_t i = path.FirstOwn(); i < path.points.size(); ++i)
    {
      const std::int64_t p = path.points[i];
      const auto sample = std::min(
        graded.profile.size() - 1, static_cast<std::size_t>(std::lround(path.arc[i] / Fine)));
      result.referenceRadius[p] = graded.reference[sample];
      result.degree[p] = lumen.measured[p] > 0.0 || lumen.interpolated[p] != 0 || IsBridged(tree, p)
        ? graded.degree[sample]
        : 0.0;
    }
    const std::size_t before = result.lesions.size();
    graded.FindLesions(result.lesions);
    if (tips[n].goesOn >= MinimumGoingOn)
    {
      graded.DescribeEnd(tips[n], result.lesions);
    }
    const int treeId = tree.branches[branches[path.points.back()]].treeId;
    for (std::size_t l = before; l < result.lesions.size(); ++l)
    {
      result.lesions[l].treeId = treeId;
    }
  }
  std::stable_sort(result.lesions.begin(), result.lesions.end(),
    [](const Stenosis& a, const Stenosis& b)
    { return a.treeId != b.treeId ? a.treeId < b.treeId : a.abscissaMinimum < b.abscissaMinimum; });
  return result;
}
}
