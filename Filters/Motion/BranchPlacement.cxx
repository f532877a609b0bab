#include "BranchPlacement.h"

#include "CyclicTime.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

namespace coronary
{
namespace
{
// scripts/validate-placement.py --fit, with the scans of scripts/validate-scanned.py.
constexpr double Intercept = 6.02;
constexpr std::array<double, PlacementSigns::Count> Weights = { -2.40, -1.72, -5.42, -1.29 };

/// More is less likely than a coin's throw, whatever else speaks for it.
constexpr double MaximumUnseen = 0.5;
constexpr double UnseenConfidence = 0.5;

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
}

const std::array<std::string, PlacementSigns::Count>& PlacementSigns::Names()
{
  static const std::array<std::string, Count> names{ "unclear", "unseen", "seldom", "swept" };
  return names;
}

std::array<double, PlacementSigns::Count> PlacementSigns::Values() const
{
  return { this->unclear, this->unseen, this->seldom, this->swept };
}

std::vector<std::vector<PlacementSigns>> SignsOfPlacement(const Polylines& rest,
  const std::vector<double>& certainty, const PoseSequence& poses, const ImageTiming& timing)
{
  constexpr RequireOf require{ "Placement" };
  require(!poses.status.empty() && poses.status.size() == poses.points.size(),
    "the poses have no status");
  const std::size_t count = rest.points.size();
  require(certainty.empty() || certainty.size() == count, "the lines have other points");
  std::vector<double> seen; // of each phase: how many of the tree's points
  for (std::size_t k = 0; k < poses.status.size(); ++k)
  {
    require(poses.points[k].size() == count && poses.status[k].size() == count,
      "the lines have other points");
    // At the reference all are where they were found, vessels or not.
    seen.push_back(CyclicDistance(poses.times[k], timing.reference) <= SameMoment
        ? 0.0
        : static_cast<double>(std::count_if(poses.status[k].begin(), poses.status[k].end(),
            [](TrackingStatus own) { return !IsUnseen(own); })));
  }
  const double all = std::accumulate(seen.begin(), seen.end(), 0.0);
  std::vector<std::vector<PlacementSigns>> result(seen.size());
  for (const std::vector<std::int64_t>& line : rest.lines)
  {
    PlacementSigns signs;
    signs.unclear = 1.0 - MeanOf(certainty, line);
    signs.swept = timing.window * Range(line, poses);
    std::vector<double> unseen;
    for (std::size_t k = 0; k < seen.size(); ++k)
    {
      unseen.push_back(UnseenShare(poses.status[k], line));
      signs.seldom += all > 0.0 ? seen[k] / all * unseen[k] : 0.0;
    }
    for (std::size_t k = 0; k < seen.size(); ++k)
    {
      signs.unseen = unseen[k];
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
  return std::max(signs.unseen, signs.seldom) > MaximumUnseen ? std::min(chance, UnseenConfidence)
                                                              : chance;
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
  const std::vector<double>& certainty, const PoseSequence& poses, const ImageTiming& timing,
  const std::vector<std::vector<double>>& deviations)
{
  const std::vector<std::vector<PlacementSigns>> signs =
    SignsOfPlacement(rest, certainty, poses, timing);
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
