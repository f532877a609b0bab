#include "BranchPlacement.h"

#include "Require.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double Stretch = 5.0; ///< mm: shorter ones change their length by noise alone

// scripts/validate-placement.py --fit, with the scans of scripts/validate-scanned.py.
constexpr double Intercept = 4.77;
constexpr std::array<double, PlacementSigns::Count> Weights = { -3.48, -1.96, -0.36, -2.82, -1.60 };

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

double LengthChange(const std::vector<std::int64_t>& line, const std::vector<Vector3>& rest,
  const std::vector<Vector3>& moved)
{
  double sum = 0.0;
  double weight = 0.0;
  double before = 0.0;
  double after = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i)
  {
    before += (rest[line[i]] - rest[line[i - 1]]).norm();
    after += (moved[line[i]] - moved[line[i - 1]]).norm();
    // What is left at the end is part of no stretch, unless it is all there is.
    if (before >= Stretch || (i + 1 == line.size() && weight == 0.0 && before > 0.0))
    {
      const double change = after / before - 1.0;
      sum += before * change * change;
      weight += before;
      before = 0.0;
      after = 0.0;
    }
  }
  return weight > 0.0 ? std::min(1.0, std::sqrt(sum / weight)) : 0.0;
}
}

const std::array<std::string, PlacementSigns::Count>& PlacementSigns::Names()
{
  static const std::array<std::string, Count> names{ "unclear", "bridged", "thin", "unseen",
    "strained" };
  return names;
}

std::array<double, PlacementSigns::Count> PlacementSigns::Values() const
{
  return { this->unclear, this->bridged, this->thin, this->unseen, this->strained };
}

std::vector<PlacementSigns> SignsOfPlacement(const Polylines& rest, const TreeCertainty& certainty,
  const PoseSequence& poses, std::size_t phase)
{
  constexpr RequireOf require{ "Placement" };
  require(phase < poses.status.size(), "the poses have no status");
  const std::vector<TrackingStatus>& status = poses.status[phase];
  const std::vector<Vector3>& moved = poses.points[phase];
  const std::size_t count = rest.points.size();
  const auto fits = [count](const std::vector<double>& values)
  { return values.empty() || values.size() == count; };
  require(moved.size() == count && status.size() == count && fits(certainty.section) &&
      fits(certainty.bridge),
    "the lines have other points");
  std::vector<PlacementSigns> result;
  for (const std::vector<std::int64_t>& line : rest.lines)
  {
    PlacementSigns signs;
    signs.unclear = 1.0 - MeanOf(certainty.section, line);
    signs.bridged = 1.0 - MeanOf(certainty.bridge, line);
    if (!rest.radius.empty())
    {
      signs.thin = 0.5 / std::max(0.25, MeanOf(rest.radius, line));
    }
    signs.unseen = static_cast<double>(std::count_if(line.begin(), line.end(),
                     [&](std::int64_t p) { return IsUnseen(status[p]); })) /
      static_cast<double>(line.size());
    signs.strained = LengthChange(line, rest.points, moved);
    result.push_back(signs);
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
  return signs.unseen > MaximumUnseen ? std::min(chance, UnseenConfidence) : chance;
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

std::vector<double> PlacementConfidences(const Polylines& rest, const TreeCertainty& certainty,
  const PoseSequence& poses, std::size_t phase, const std::vector<double>& deviations)
{
  const std::vector<PlacementSigns> signs = SignsOfPlacement(rest, certainty, poses, phase);
  std::vector<double> within;
  for (const double deviation : deviations)
  {
    within.push_back(ConfidenceOfDeviation(deviation));
  }
  std::vector<double> result(rest.points.size(), 0.0);
  std::vector<bool> known(rest.points.size(), false);
  for (std::size_t l = 0; l < rest.lines.size(); ++l)
  {
    PlacementSigns own = signs[l];
    if (!within.empty())
    {
      // The tree's own: nothing was tracked.
      own.unseen = own.strained = 0.0;
    }
    const double chance = PlacementConfidence(own) * MeanOf(within, rest.lines[l]);
    for (const std::int64_t p : rest.lines[l])
    {
      result[p] = known[p] ? result[p] : chance;
      known[p] = true;
    }
  }
  return result;
}
}
