#include "PoseSequence.h"

#include "Require.h"

#include <cmath>
#include <string>

namespace coronary
{
namespace
{
/// An optional member: empty, or `count` values at every phase.
template <typename Value>
void RequireSizes(const std::vector<std::vector<Value>>& member, const char* name,
  std::size_t phases, std::size_t count)
{
  if (member.empty())
  {
    return;
  }
  Require(member.size() == phases,
    std::string(name) + ": " + std::to_string(member.size()) + " phases instead of " +
      std::to_string(phases));
  for (std::size_t k = 0; k < phases; ++k)
  {
    Require(member[k].size() == count,
      std::string(name) + ": phase " + std::to_string(k) + " has " +
        std::to_string(member[k].size()) + " values instead of " + std::to_string(count));
  }
}
}

void CheckPoseSequence(const PoseSequence& sequence, std::size_t points)
{
  const std::size_t phases = sequence.NumberOfPhases();
  Require(phases > 0, "The sequence has no phase");
  for (std::size_t k = 0; k < phases; ++k)
  {
    Require(std::isfinite(sequence.times[k]), "times: a value is not finite");
    Require(k == 0 || sequence.times[k] > sequence.times[k - 1],
      "times: phase " + std::to_string(k) + " does not come after the one before it");
  }
  Require(sequence.points.size() == phases,
    "points: " + std::to_string(sequence.points.size()) + " phases instead of " +
      std::to_string(phases));
  RequireSizes(sequence.points, "points", phases, points);
  RequireSizes(sequence.confidence, "confidence", phases, points);
  RequireSizes(sequence.status, "status", phases, points);
  RequireSizes(sequence.calibre, "calibre", phases, points);
  for (std::size_t k = 0; k < phases; ++k)
  {
    for (const Vector3& point : sequence.points[k])
    {
      Require(
        point.allFinite(), "points: a coordinate at phase " + std::to_string(k) + " is not finite");
    }
    if (!sequence.confidence.empty())
    {
      for (const double value : sequence.confidence[k])
      {
        Require(value >= 0.0 && value <= 1.0, "confidence: a value is outside 0 to 1");
      }
    }
    if (!sequence.calibre.empty())
    {
      for (const double value : sequence.calibre[k])
      {
        Require(value > 0.0 && std::isfinite(value), "calibre: a factor is not positive");
      }
    }
  }
  if (!sequence.rotation.empty())
  {
    RequireSizes(sequence.rotation, "rotation", phases, sequence.rotation.front().size());
    for (const std::vector<Eigen::Quaterniond>& phase : sequence.rotation)
    {
      for (const Eigen::Quaterniond& value : phase)
      {
        Require(value.coeffs().allFinite() && value.norm() > 1e-12,
          "rotation: a value is zero or not finite");
      }
    }
  }
}

void CheckPolylines(const Polylines& lines)
{
  const auto points = static_cast<std::int64_t>(lines.points.size());
  for (const Vector3& point : lines.points)
  {
    Require(point.allFinite(), "A coordinate of the lines is not finite");
  }
  Require(lines.radius.empty() || lines.radius.size() == lines.points.size(),
    "The lines have " + std::to_string(lines.radius.size()) + " radii for " +
      std::to_string(lines.points.size()) + " points");
  for (const double radius : lines.radius)
  {
    Require(std::isfinite(radius) && radius >= 0.0, "A radius is negative or not finite");
  }
  for (std::size_t n = 0; n < lines.lines.size(); ++n)
  {
    Require(lines.lines[n].size() >= 2, "Line " + std::to_string(n) + " has less than two points");
    for (const std::int64_t point : lines.lines[n])
    {
      Require(point >= 0 && point < points,
        "Line " + std::to_string(n) + " has a point that does not exist");
    }
  }
}
}
