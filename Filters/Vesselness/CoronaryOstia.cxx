#include "CoronaryOstia.h"

#include "AorticTubes.h"
#include "Median.h"
#include "Numbers.h"
#include "OstialOutlets.h"
#include "Require.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace coronary
{
namespace
{
/// Log of how much more likely a value is for a coronary artery than for something else: `best` at
/// the middle, falling with the square of the distance, never below `least`.
double Evidence(double distance, double width, double best, double minimum)
{
  return std::max(minimum, best - 0.5 * std::pow(distance / width, 2));
}

/// What speaks for an outlet as the left or the right ostium, whatever the other one is.
double RoleEvidence(const Outlet& outlet, bool left, const CoronaryOstiaSettings& settings)
{
  // Seen from above the right ostium is in front, the left one behind on the left.
  const double leftAzimuth = -45.0 * Pi / 180.0;
  const double rightAzimuth = 95.0 * Pi / 180.0;
  const double width = 40.0 * Pi / 180.0;
  const double turn =
    std::remainder(outlet.azimuth - (left ? leftAzimuth : rightAzimuth), 2.0 * Pi);
  double sum = Evidence(turn, width, 1.0, -5.0);
  const double length = std::min(1.0, outlet.ostium.length / settings.vesselLength);
  sum += 1.0 - 5.0 * (1.0 - length);
  const double r = outlet.ostium.radius;
  const double usual = 0.7 * settings.maximumVesselRadius;
  sum += Evidence(std::max({ 0.0, 2.0 * (0.9 - r), r - usual }), 0.5, 0.5, -4.0);
  // The rims of chambers are bright and long as well, but no tubes. That a rim points at the aorta is no rare chance:
  // what does not hang on it must be a clear tube.
  const double tube =
    outlet.ostium.hidden > 0.0 ? (outlet.tubular - 0.3) / 0.3 : (outlet.tubular - 0.05) / 0.2;
  sum += 4.0 * std::clamp(tube, 0.0, 1.0) - 3.0;
  // The place is the less certain the farther it is extrapolated, as for links across lesions. What a lesion leaves of
  // an artery is a thin lumen and a wall: bare fat between aorta and vessel speaks against a mouth.
  sum -= outlet.ostium.hidden / 6.0 + outlet.unseen / 2.0;
  // A narrow or hidden beginning may be a wall between two vessels.
  sum -= 1.5 * std::clamp((outlet.shade - 1.0) / 3.0, 0.0, 1.0);
  // The right one goes to the right and round the heart, the left one forward or round the left side; both down.
  const Vector3 way = left ? Vector3(0.73, -0.56, -0.39) : Vector3(-0.86, -0.36, -0.36);
  const double distance = outlet.course.norm();
  if (distance > 0.0)
  {
    const double cosine = std::clamp(way.dot(outlet.course) / (way.norm() * distance), -1.0, 1.0);
    sum += Evidence(std::acos(cosine), 50.0 * Pi / 180.0, 0.8, -3.0);
  }
  return sum;
}

/// What speaks for two outlets as a pair, beside what speaks for each.
double PairEvidence(const Outlet& left, const Outlet& right)
{
  const double between =
    std::remainder(right.azimuth - left.azimuth - 150.0 * Pi / 180.0, 2.0 * Pi);
  return Evidence(between, 35.0 * Pi / 180.0, 0.8, -4.0) +
    Evidence(left.level - right.level, 6.0, 0.8, -3.0);
}

/// One explanation of an image: which tube is the aorta, and which outlets are the ostia.
struct Hypothesis
{
  double evidence;
  int tube;
  int left;  ///< -1: not there
  int right; ///< -1: not there
};

/// What was found around one tube.
struct Candidate
{
  AorticTube tube;
  AorticOutlets around;
  double confidence;  ///< of the circles
  double prior = 0.0; ///< evidence: an aorta that lies across the body is rare
};

double LengthOf(const AorticTube& tube)
{
  double length = 0.0;
  for (std::size_t n = 1; n < tube.sections.size(); ++n)
  {
    length += (tube.sections[n].centre - tube.sections[n - 1].centre).norm();
  }
  return length;
}

/// What speaks for a tube as the aorta, from its circles alone.
double ShapeEvidence(const Candidate& candidate)
{
  std::vector<double> radii;
  for (const AorticSection& section : candidate.tube.sections)
  {
    radii.push_back(section.radius);
  }
  const double radius = MedianOf(radii);
  double sum = 2.0 * std::log(std::max(0.05, candidate.confidence));
  sum += Evidence(std::max({ 0.0, 11.0 - radius, 0.3 * (radius - 22.0) }), 1.5, 0.0, -3.0);
  sum -= 2.0 * (1.0 - std::min(1.0, LengthOf(candidate.tube) / 30.0));
  return sum;
}

/// The same with what is around it.
/// @param brightest  HU of the brightest tube
double TubeEvidence(const Candidate& candidate, double brightest)
{
  double sum = candidate.prior + ShapeEvidence(candidate);
  // A heart's chambers are beside its aorta; the aorta of the abdomen has none.
  constexpr double heart = 2000.0; // mm^3
  sum -= 3.5 * (1.0 - std::min(1.0, candidate.around.chambers / heart));
  // Arterial blood is about as bright everywhere; only unmixed medium in veins is brighter.
  sum -= candidate.around.mean < 0.65 * brightest ? 1.5 : 0.0;
  return sum;
}

constexpr double Missing = -0.3; ///< evidence for one ostium without the other

std::vector<Hypothesis> Explain(
  const std::vector<Candidate>& candidates, const CoronaryOstiaSettings& settings)
{
  constexpr double apart = 8.0; // mm
  std::vector<Hypothesis> result;
  double brightest = 0.0;
  for (const Candidate& candidate : candidates)
  {
    brightest = std::max(brightest, candidate.around.mean);
  }
  for (int t = 0; t < static_cast<int>(candidates.size()); ++t)
  {
    const std::vector<Outlet>& outlets = candidates[t].around.outlets;
    const double tube = TubeEvidence(candidates[t], brightest);
    const int count = static_cast<int>(outlets.size());
    for (int l = -1; l < count; ++l)
    {
      for (int r = -1; r < count; ++r)
      {
        if (l == r ||
          (l >= 0 && r >= 0 &&
            (outlets[l].ostium.position - outlets[r].ostium.position).norm() < apart))
        {
          continue;
        }
        double sum = tube;
        sum += l >= 0 ? RoleEvidence(outlets[l], true, settings) : Missing;
        sum += r >= 0 ? RoleEvidence(outlets[r], false, settings) : Missing;
        if (l >= 0 && r >= 0)
        {
          sum += PairEvidence(outlets[l], outlets[r]);
        }
        result.push_back({ sum, t, l, r });
      }
    }
  }
  std::stable_sort(result.begin(), result.end(),
    [](const Hypothesis& a, const Hypothesis& b) { return a.evidence > b.evidence; });
  return result;
}

/// The share of all explanations, "none of these" among them, that have an ostium at a place.
double Agreement(const std::vector<Hypothesis>& explanations,
  const std::vector<Candidate>& candidates, const Vector3& place, bool left)
{
  constexpr double none = 5.0; // evidence that a pair has by chance
  constexpr double same = 4.0; // mm
  const double reference = std::max(none, explanations.front().evidence);
  double agree = 0.0;
  double all = std::exp(none - reference);
  for (const Hypothesis& h : explanations)
  {
    const double weight = std::exp(h.evidence - reference);
    all += weight;
    const int outlet = left ? h.left : h.right;
    const bool agrees = outlet >= 0 &&
      (candidates[h.tube].around.outlets[outlet].ostium.position - place).norm() < same;
    agree += agrees ? weight : 0.0;
  }
  return agree / all;
}

/// Whether a tube is one that has been looked at.
bool IsKnown(const AorticTube& tube, const std::vector<Candidate>& candidates)
{
  constexpr double near = 4.0;  // mm
  constexpr double share = 0.7; // of its sections
  for (const Candidate& candidate : candidates)
  {
    const TubeAxis axis(candidate.tube.sections);
    std::size_t same = 0;
    for (const AorticSection& section : tube.sections)
    {
      same += axis.At(section.centre).distance < near ? 1 : 0;
    }
    if (static_cast<double>(same) >= share * static_cast<double>(tube.sections.size()))
    {
      return true;
    }
  }
  return false;
}

/// The tubes along one direction of slices, sliced square to their axes, the likeliest first.
std::vector<Candidate> FindTubes(const ScalarImage& image, const Matrix3& axes,
  const CoronaryOstiaSettings& settings, const ProgressCallback& progress)
{
  constexpr double spacing = 1.5; // mm
  const auto [low, high] = BoundsAlong(image.grid, axes);
  const WorldVolume volume = ResampleToWorld(
    image, low, high, spacing, axes, [&](double f) { return !progress || progress(0.5 * f); });
  const std::vector<AorticTube> tubes = FindAorticTubes(
    volume, settings, [&](double f) { return !progress || progress(0.5 + 0.5 * f); });
  std::vector<Candidate> result;
  for (const AorticTube& tube : tubes)
  {
    Candidate candidate;
    candidate.tube = SliceSquare(volume, tube, settings);
    if (candidate.tube.sections.size() < 4)
    {
      candidate.tube = tube;
    }
    double score = 0.0;
    for (const double one : candidate.tube.scores)
    {
      score += one;
    }
    // A tube of few or poor circles may be anything.
    const double length = spacing + LengthOf(candidate.tube);
    const double roundness = score / static_cast<double>(candidate.tube.sections.size());
    candidate.confidence = std::min(1.0, length / 15.0) * std::clamp(roundness / 0.7, 0.0, 1.0);
    result.push_back(std::move(candidate));
  }
  std::stable_sort(result.begin(), result.end(),
    [](const Candidate& a, const Candidate& b) { return ShapeEvidence(a) > ShapeEvidence(b); });
  return result;
}

/// Slices along the body, and four oblique ones for an aorta that lies more across.
std::array<Matrix3, 5> SliceAxes()
{
  std::array<Matrix3, 5> axes;
  axes[0] = Matrix3::Identity();
  for (int n = 0; n < 4; ++n)
  {
    const double turn = 0.5 * Pi * n;
    axes[n + 1] =
      Eigen::AngleAxisd(0.25 * Pi, Vector3(std::cos(turn), std::sin(turn), 0.0)).toRotationMatrix();
  }
  return axes;
}

/// What explains an image best, and from what.
struct Search
{
  std::vector<Candidate> tubes; ///< of the slices along the body
  std::vector<Candidate> candidates;
  std::vector<Hypothesis> explanations;
};

/**
 * Looks at one tube after the other, the likeliest first, until one explains the image so well that no other could
 * do better.
 */
Search FindExplanations(
  const ScalarImage& image, const CoronaryOstiaSettings& settings, const ProgressCallback& progress)
{
  constexpr double clear = 8.5;     // evidence of a pair that no other reaches by chance
  constexpr double doubtful = 5.0;  // evidence below which oblique slices are tried as well
  constexpr std::size_t others = 2; // tubes of each oblique direction
  Search search;
  const auto best = [&]()
  { return search.explanations.empty() ? -1e9 : search.explanations.front().evidence; };
  const std::array<Matrix3, 5> directions = SliceAxes();
  for (std::size_t d = 0; d < directions.size(); ++d)
  {
    // The first direction is usually the only one.
    const double begin = d == 0 ? 0.0 : 0.8 + 0.05 * static_cast<double>(d - 1);
    const double span = d == 0 ? 0.8 : 0.05;
    const auto part = [&, begin, span](double from, double to)
    {
      return [&progress, begin, span, from, to](double f)
      { return !progress || progress(begin + span * (from + (to - from) * f)); };
    };
    std::vector<Candidate> tubes = FindTubes(image, directions[d], settings, part(0.0, 0.3));
    if (d == 0)
    {
      search.tubes = tubes;
    }
    std::size_t looked = 0;
    for (std::size_t t = 0; t < tubes.size() && (d == 0 || looked < others); ++t)
    {
      if (d > 0 && IsKnown(tubes[t].tube, search.candidates))
      {
        continue;
      }
      ++looked;
      tubes[t].prior = d > 0 ? -2.0 : 0.0;
      const double share = 0.7 / static_cast<double>(tubes.size());
      const double from = 0.3 + share * static_cast<double>(t);
      tubes[t].around = FindOutlets(image, tubes[t].tube, settings, part(from, from + share));
      if (!(tubes[t].around.mean > settings.softTissue))
      {
        continue;
      }
      search.candidates.push_back(std::move(tubes[t]));
      search.explanations = Explain(search.candidates, settings);
      if (best() >= clear)
      {
        return search;
      }
    }
    if (best() >= doubtful || (d == 0 && tubes.empty()))
    {
      break;
    }
  }
  return search;
}

/// The tube that stands behind the ascending aorta; of several the hindmost.
std::vector<AorticSection> DescendingOf(
  const std::vector<Candidate>& tubes, const AscendingAorta& ascending)
{
  constexpr double shortest = 25.0; // mm
  constexpr double behind = 30.0;   // mm
  constexpr double right = 30.0;    // mm
  constexpr double upright = 0.9;   // cosine
  std::vector<AorticSection> best;
  if (ascending.sections.empty())
  {
    return best;
  }
  const AorticSection& middle = ascending.sections[ascending.sections.size() / 2];
  for (const Candidate& candidate : tubes)
  {
    const std::vector<AorticSection>& sections = candidate.tube.sections;
    const AorticSection& own = sections[sections.size() / 2];
    const Vector3 from = own.centre - middle.centre;
    const Vector3 way = sections.back().centre - sections.front().centre;
    const bool fits = way[2] >= std::max(shortest, upright * way.norm()) && from[1] > behind &&
      from[0] > -right && own.radius < 1.1 * middle.radius &&
      candidate.tube.mean > 0.5 * ascending.mean && candidate.tube.mean < 1.5 * ascending.mean;
    if (fits && (best.empty() || own.centre[1] > best[best.size() / 2].centre[1]))
    {
      best = sections;
    }
  }
  return best;
}

/// The part of a tube that is aorta, and its blood where the ostia are.
AscendingAorta AortaOf(const Candidate& candidate, const std::vector<double>& levels)
{
  constexpr double below = 20.0;  // mm from an ostium to the valve, at most
  constexpr double around = 15.0; // mm
  AscendingAorta aorta;
  aorta.mean = candidate.around.mean;
  aorta.deviation = candidate.around.deviation;
  aorta.confidence = candidate.confidence;
  const std::vector<AorticSection>& sections = candidate.tube.sections;
  const TubeAxis axis(sections);
  double lowest = -1e9;
  double level = 0.0;
  for (const double one : levels)
  {
    lowest = std::max(lowest, one - below);
    level += one / static_cast<double>(levels.size());
  }
  std::vector<double> means;
  for (std::size_t n = 0; n < sections.size(); ++n)
  {
    const double length = axis.At(sections[n].centre).length;
    if (length >= lowest || n + 4 >= sections.size())
    {
      aorta.sections.push_back(sections[n]);
    }
    const double mean = candidate.around.sectionMeans[n];
    if (!levels.empty() && std::abs(length - level) < around && std::isfinite(mean))
    {
      means.push_back(mean);
    }
  }
  aorta.mean = means.size() < 3 ? aorta.mean : MedianOf(means);
  return aorta;
}
}

void CoronaryOstiaSettings::Validate() const
{
  Require(this->minimumAorticRadius >= 4.0 &&
      this->minimumAorticRadius < this->maximumAorticRadius && this->maximumAorticRadius <= 60.0,
    "aortic radii must satisfy 4 <= minimumAorticRadius < maximumAorticRadius <= 60 mm");
  Require(this->maximumVesselRadius >= 1.0 && this->maximumVesselRadius <= 8.0,
    "maximumVesselRadius must be 1 to 8 mm");
  Require(
    this->vesselLength >= 10.0 && this->vesselLength <= 80.0, "vesselLength must be 10 to 80 mm");
  Require(std::isfinite(this->softTissue) && this->minimumBlood > this->softTissue &&
      std::isfinite(this->minimumBlood),
    "minimumBlood must be above softTissue");
}

CoronaryOstia FindCoronaryOstia(
  const ScalarImage& image, const CoronaryOstiaSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  CoronaryOstia result;
  const std::array<int, 3> size = image.Dimensions();
  if (size[0] < 2 || size[1] < 2 || size[2] < 2)
  {
    throw std::invalid_argument("the image is not three-dimensional");
  }
  if (!(image.grid.spacing.minCoeff() > 0.0) || !image.grid.spacing.allFinite() ||
    !image.grid.origin.allFinite() || !image.grid.direction.allFinite())
  {
    throw std::invalid_argument("the image needs positive spacing and a finite position");
  }
  const Search search = FindExplanations(image, settings, progress);
  const std::vector<Candidate>& candidates = search.candidates;
  const std::vector<Hypothesis>& explanations = search.explanations;
  if (!explanations.empty())
  {
    const Hypothesis& best = explanations.front();
    const Candidate& chosen = candidates[best.tube];
    // Across the body there is always something: not worth a name without likelihood.
    const double minimum = chosen.prior < 0.0 ? 0.1 : 0.0;
    std::vector<double> levels;
    const auto add = [&](int outlet, bool left)
    {
      if (outlet >= 0)
      {
        CoronaryOstium ostium = chosen.around.outlets[outlet].ostium;
        ostium.name = left ? "LCA" : "RCA";
        ostium.confidence = Agreement(explanations, candidates, ostium.position, left);
        if (ostium.confidence < minimum)
        {
          return;
        }
        result.ostia.push_back(ostium);
        levels.push_back(chosen.around.outlets[outlet].level);
      }
    };
    add(best.left, true);
    add(best.right, false);
    result.aorta = AortaOf(levels.empty() ? candidates.front() : chosen, levels);
  }
  else if (!candidates.empty())
  {
    result.aorta = AortaOf(candidates.front(), {});
  }

  result.descending = DescendingOf(search.tubes, result.aorta);

  constexpr double sure = 0.5;
  if (result.aorta.sections.empty())
  {
    result.doubt = "no ascending aorta: no bright round cross-sections in a row";
  }
  else if (result.ostia.size() < 2)
  {
    result.doubt = result.ostia.empty() ? "no vessel leaves the aorta"
                                        : "only the " + result.ostia.front().name + " was found";
  }
  else
  {
    for (const CoronaryOstium& ostium : result.ostia)
    {
      if (ostium.confidence < sure)
      {
        std::array<char, 16> share;
        std::snprintf(share.data(), share.size(), " (%.2f)", ostium.confidence);
        result.doubt +=
          (result.doubt.empty() ? "not sure of the " : " and the ") + ostium.name + share.data();
      }
    }
  }
  for (const CoronaryOstium& ostium : result.ostia)
  {
    if (ostium.hidden > 0.0)
    {
      std::array<char, 64> length;
      std::snprintf(
        length.data(), length.size(), " begins behind %.0f mm that show no vessel", ostium.hidden);
      result.doubt += (result.doubt.empty() ? "the " : "; the ") + ostium.name + length.data();
    }
  }
  Report(progress, 1.0);
  return result;
}
}
