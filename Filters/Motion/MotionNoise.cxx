#include "MotionNoise.h"

#include "Median.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

namespace coronary
{
namespace
{
/// Along the vessel, to either side of a place, mm.
constexpr double NoiseReach = 4.0;
/// What the motion of a heart is off a line over twice the reach, mm.
constexpr double OwnBending = 0.1;
constexpr double SureConfidence = 0.5;
/// Fewer tell nothing: one corner would be taken for noise.
constexpr std::size_t LeastPlaces = 20;
/// The median length of a vector of three normal numbers.
constexpr double MedianOfThree = 1.5382;

/// A place of a line, and those before and after it.
struct Triple
{
  std::size_t before;
  std::size_t at;
  std::size_t after;
  double share; ///< of the way from before to after
};

std::vector<Triple> TriplesOf(const Polylines& lines)
{
  std::vector<Triple> triples;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    std::vector<double> along(line.size(), 0.0);
    for (std::size_t n = 1; n < line.size(); ++n)
    {
      along[n] = along[n - 1] + (lines.points[line[n]] - lines.points[line[n - 1]]).norm();
    }
    for (std::size_t n = 0; n < line.size(); ++n)
    {
      const auto after = static_cast<std::size_t>(
        std::lower_bound(along.begin(), along.end(), along[n] + NoiseReach) - along.begin());
      const auto behind = static_cast<std::size_t>(
        std::upper_bound(along.begin(), along.end(), along[n] - NoiseReach) - along.begin());
      if (behind > 0 && after < line.size())
      {
        const std::size_t before = behind - 1;
        triples.push_back({ static_cast<std::size_t>(line[before]),
          static_cast<std::size_t>(line[n]), static_cast<std::size_t>(line[after]),
          (along[n] - along[before]) / (along[after] - along[before]) });
      }
    }
  }
  // Bones are lines of two points: joints between two of them.
  std::map<std::int64_t, std::vector<std::int64_t>> ends;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    if (line.size() == 2)
    {
      ends[line.front()].push_back(line.back());
      ends[line.back()].push_back(line.front());
    }
  }
  for (const auto& [joint, others] : ends)
  {
    if (others.size() == 2)
    {
      const double first = (lines.points[joint] - lines.points[others[0]]).norm();
      const double second = (lines.points[joint] - lines.points[others[1]]).norm();
      triples.push_back({ static_cast<std::size_t>(others[0]), static_cast<std::size_t>(joint),
        static_cast<std::size_t>(others[1]), first / (first + second) });
    }
  }
  return triples;
}
}

std::vector<double> NoiseOfPhases(const PoseSequence& sequence, const Polylines& lines)
{
  CheckPolylines(lines);
  CheckPoseSequence(sequence, lines.points.size());
  const std::vector<Triple> triples = TriplesOf(lines);
  std::vector<double> noise;
  for (std::size_t k = 0; k < sequence.NumberOfPhases(); ++k)
  {
    const auto sure = [&](std::size_t p)
    { return sequence.confidence.empty() || sequence.confidence[k][p] >= SureConfidence; };
    const auto moved = [&](std::size_t p) -> Vector3
    { return sequence.points[k][p] - lines.points[p]; };
    std::vector<double> off;
    for (const Triple& one : triples)
    {
      if (sure(one.before) && sure(one.at) && sure(one.after))
      {
        const double s = one.share;
        const Vector3 apart = moved(one.at) - (1.0 - s) * moved(one.before) - s * moved(one.after);
        off.push_back(apart.norm() / std::sqrt(1.0 + (1.0 - s) * (1.0 - s) + s * s));
      }
    }
    if (off.size() < LeastPlaces)
    {
      noise.push_back(0.0);
      continue;
    }
    const double all = MedianOf(std::move(off)) / MedianOfThree;
    noise.push_back(std::sqrt(std::max(0.0, all * all - OwnBending * OwnBending)));
  }
  return noise;
}
}
