#include "BranchPlacement.h"

#include "CyclicTime.h"
#include "Require.h"
#include "VeinRejection.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

namespace coronary
{
namespace
{
// scripts/validate-placement.py --fit, with the scans of scripts/validate-scanned.py. What the images show had no part in that
// yet: its signs limit what is said, and have no weights.
constexpr double Intercept = 6.02;
constexpr std::array<double, PlacementSigns::Count> Weights = { -2.40, -5.42, -1.29, 0.0, 0.0,
  -1.72, 0.0, 0.0, 0.0 };
constexpr double UsualDim = 0.2; ///< between two phases, by motion

/// What is mostly unseen, or beside where the images have the lumen, is less likely than a coin's throw, whatever else speaks for it.
constexpr double MaximumUnseen = 0.5;
constexpr double UnlikelyConfidence = 0.5;
/// Of an ostium: wrong ones have less than 0.7 (docs/validation.md), right ones hardly ever.
constexpr double MaximumDoubt = 0.3;
/// Of veins that were kept in trees 17 of 18 have more, and one artery in fifty (docs/validation.md).
constexpr double MaximumVein = 0.05;

/// Mean of what is known of a line's points; nothing: 1.
double MeanOf(const std::vector<double>& values, const std::vector<std::int64_t>& line)
{
  double sum = 0.0;
  for (const std::int64_t p : line)
  {
    sum += values.empty() ? 1.0 : values[p];
  }
  return sum / static_cast<double>(line.size());
}

double UnseenShare(const std::vector<TrackingStatus>& status, const std::vector<std::int64_t>& line)
{
  return static_cast<double>(std::count_if(
           line.begin(), line.end(), [&](std::int64_t p) { return IsUnseen(status[p]); })) /
    static_cast<double>(line.size());
}

/// Greatest mean distance of a line's places at two phases, mm.
double Range(const std::vector<std::int64_t>& line, const PoseSequence& poses)
{
  double range = 0.0;
  for (std::size_t a = 0; a < poses.points.size(); ++a)
  {
    for (std::size_t b = 0; b < a; ++b)
    {
      double sum = 0.0;
      for (const std::int64_t p : line)
      {
        sum += (poses.points[a][p] - poses.points[b][p]).norm();
      }
      range = std::max(range, sum / static_cast<double>(line.size()));
    }
  }
  return range;
}

/// Mean over each line, of each phase.
std::vector<std::vector<double>> MeansOf(const Polylines& rest,
  const std::vector<LumenSight>& sights, std::vector<double> LumenSight::*values)
{
  std::vector<std::vector<double>> means(sights.size());
  for (std::size_t k = 0; k < sights.size(); ++k)
  {
    for (const std::vector<std::int64_t>& line : rest.lines)
    {
      means[k].push_back(MeanOf(sights[k].*values, line));
    }
  }
  return means;
}

/// How much of the tree was seen at each phase but the reference, where all is where it was found, vessel or not; sum 1, or all 0.
std::vector<double> WeightsOfPhases(const PoseSequence& poses, double reference)
{
  std::vector<double> weights;
  for (std::size_t k = 0; k < poses.status.size(); ++k)
  {
    weights.push_back(CyclicDistance(poses.times[k], reference) <= SameMoment
        ? 0.0
        : static_cast<double>(std::count_if(poses.status[k].begin(), poses.status[k].end(),
            [](TrackingStatus own) { return !IsUnseen(own); })));
  }
  const double all = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& weight : weights)
  {
    weight = all > 0.0 ? weight / all : 0.0;
  }
  return weights;
}
}

const std::array<std::string, PlacementSigns::Count>& PlacementSigns::Names()
{
  static const std::array<std::string, Count> names{ "unclear", "seldom", "swept", "doubtful",
    "vein", "unseen", "beside", "dim", "strays" };
  return names;
}

std::array<double, PlacementSigns::Count> PlacementSigns::Values() const
{
  return { this->unclear, this->seldom, this->swept, this->doubtful, this->vein, this->unseen,
    this->beside, this->dim, this->strays };
}

std::vector<std::vector<PlacementSigns>> SignsOfPlacement(const Polylines& rest,
  const PlacementEvidence& evidence, const PoseSequence& poses, const ImageTiming& timing)
{
  constexpr RequireOf require{ "Placement" };
  const std::size_t phases = poses.points.size();
  require(!poses.status.empty() && poses.status.size() == phases, "the poses have no status");
  const std::size_t count = rest.points.size();
  const auto fits = [count](const auto& values) { return values.size() == count; };
  const char* const others = "the lines have other points";
  require(evidence.certainty.empty() || fits(evidence.certainty), others);
  require(evidence.ostium.empty() || fits(evidence.ostium), others);
  require(evidence.vein.empty() || fits(evidence.vein), others);
  require(evidence.sights.empty() || evidence.sights.size() == phases,
    "what the images show is of other phases");
  for (std::size_t k = 0; k < phases; ++k)
  {
    require(fits(poses.points[k]) && fits(poses.status[k]), others);
    require(evidence.sights.empty() ||
        (fits(evidence.sights[k].beside) && fits(evidence.sights[k].contrast)),
      others);
  }
  const std::vector<double> weights = WeightsOfPhases(poses, timing.reference);
  const auto beside = MeansOf(rest, evidence.sights, &LumenSight::beside);
  const auto contrast = MeansOf(rest, evidence.sights, &LumenSight::contrast);
  std::vector<std::vector<PlacementSigns>> result(phases);
  for (std::size_t l = 0; l < rest.lines.size(); ++l)
  {
    const std::vector<std::int64_t>& line = rest.lines[l];
    PlacementSigns signs;
    signs.unclear = 1.0 - MeanOf(evidence.certainty, line);
    signs.doubtful = 1.0 - MeanOf(evidence.ostium, line);
    signs.vein = VeinProbabilityOf(line, evidence.vein);
    signs.swept = timing.window * Range(line, poses);
    double brightest = 0.0;
    double strays = 0.0;
    std::vector<double> unseen;
    for (std::size_t k = 0; k < phases; ++k)
    {
      unseen.push_back(UnseenShare(poses.status[k], line));
      signs.seldom += weights[k] * unseen[k];
      if (!evidence.sights.empty())
      {
        strays += weights[k] * beside[k][l];
        brightest = std::max(brightest, contrast[k][l]);
      }
    }
    signs.strays = std::max(0.0, strays - UsualBeside);
    for (std::size_t k = 0; k < phases; ++k)
    {
      signs.unseen = unseen[k];
      if (!evidence.sights.empty())
      {
        signs.beside = std::max(0.0, beside[k][l] - UsualBeside);
        const double dim = brightest > 0.0 ? 1.0 - contrast[k][l] / brightest : 1.0;
        signs.dim = std::max(0.0, dim - UsualDim);
      }
      result[k].push_back(signs);
    }
  }
  return result;
}

double PlacementConfidence(const PlacementSigns& signs)
{
  double odds = Intercept;
  const std::array<double, PlacementSigns::Count> values = signs.Values();
  for (std::size_t n = 0; n < values.size(); ++n)
  {
    odds += Weights[n] * values[n];
  }
  const double chance = 1.0 / (1.0 + std::exp(-odds));
  const bool unlikely = std::max(signs.unseen, signs.seldom) > MaximumUnseen ||
    std::max(signs.beside, signs.strays) > PlacedWithin - UsualBeside ||
    signs.doubtful > MaximumDoubt || signs.vein > MaximumVein;
  return unlikely ? std::min(chance, UnlikelyConfidence) : chance;
}

double ConfidenceOfDeviation(double deviation)
{
  if (deviation <= 0.0)
  {
    return 1.0;
  }
  // Maxwell's distribution: the same deviation along each axis.
  const double x = PlacedWithin * std::sqrt(3.0) / deviation;
  return std::erf(x / std::sqrt(2.0)) - std::sqrt(2.0 / EIGEN_PI) * x * std::exp(-0.5 * x * x);
}

std::vector<std::vector<double>> PlacementConfidences(const Polylines& rest,
  const PlacementEvidence& evidence, const PoseSequence& poses, const ImageTiming& timing,
  const std::vector<std::vector<double>>& deviations)
{
  const std::vector<std::vector<PlacementSigns>> signs =
    SignsOfPlacement(rest, evidence, poses, timing);
  std::vector<std::vector<double>> result(signs.size());
  for (std::size_t k = 0; k < signs.size(); ++k)
  {
    std::vector<double> within;
    if (!deviations.empty())
    {
      std::transform(deviations[k].begin(), deviations[k].end(), std::back_inserter(within),
        ConfidenceOfDeviation);
    }
    result[k].assign(rest.points.size(), 0.0);
    std::vector<bool> known(rest.points.size(), false);
    for (std::size_t l = 0; l < rest.lines.size(); ++l)
    {
      PlacementSigns own = signs[k][l];
      if (!within.empty())
      {
        // The tree's own: nothing was tracked.
        own.unseen = 0.0;
      }
      const double chance = PlacementConfidence(own) * MeanOf(within, rest.lines[l]);
      for (const std::int64_t p : rest.lines[l])
      {
        result[k][p] = known[p] ? result[k][p] : chance;
        known[p] = true;
      }
    }
  }
  return result;
}
}
