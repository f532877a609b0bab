#include "BranchPlacement.h"

#include "Require.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double Stretch = 5.0; ///< mm: shorter ones change their length by noise alone

// scripts/fit-odds.sh, placements.
constexpr double Intercept = 6.0;
constexpr std::array<double, PlacementSigns::Count> Weights = { -4.0, -2.0, -1.0, -2.0, -4.0, -1.0,
  -4.0 };

/// More is less likely than a coin's throw, whatever else speaks for it.
constexpr double LargestUnseen = 0.5;
constexpr double UnseenConfidence = 0.5;

bool IsUnseen(TrackingStatus status)
{
  return status == TrackingStatus::Filled || status == TrackingStatus::Lost;
}

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
    "doubt", "tree_unseen", "strained" };
  return names;
}

std::array<double, PlacementSigns::Count> PlacementSigns::Values() const
{
  return { this->unclear, this->bridged, this->thin, this->unseen, this->doubt, this->treeUnseen,
    this->strained };
}

std::vector<PlacementSigns> SignsOfPlacement(const Polylines& rest, const TreeCertainty& certainty,
  const PoseSequence& poses, std::size_t phase)
{
  constexpr RequireOf require{ "Placement" };
  require(phase < poses.confidence.size() && phase < poses.status.size(),
    "the poses have no confidence or no status");
  const std::vector<double>& confidence = poses.confidence[phase];
  const std::vector<TrackingStatus>& status = poses.status[phase];
  const std::vector<Vector3>& moved = poses.points[phase];
  const std::size_t count = rest.points.size();
  const auto fits = [count](const std::vector<double>& values)
  { return values.empty() || values.size() == count; };
  require(moved.size() == count && confidence.size() == count && status.size() == count &&
      fits(certainty.section) && fits(certainty.bridge),
    "the lines have other points");
  const double unseenOfTree =
    static_cast<double>(std::count_if(status.begin(), status.end(), IsUnseen)) /
    static_cast<double>(std::max<std::size_t>(count, 1));
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
    signs.doubt = 1.0 - MeanOf(confidence, line);
    signs.treeUnseen = unseenOfTree;
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
  return signs.unseen > LargestUnseen ? std::min(chance, UnseenConfidence) : chance;
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
      own.unseen = own.doubt = own.treeUnseen = own.strained = 0.0;
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
