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
}
