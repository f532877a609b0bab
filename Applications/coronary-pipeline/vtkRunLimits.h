/**
 * @file vtkRunLimits.h
 * @brief What report.json of `run` tells of the motion: how likely branches are in their places, what was not seen and
 * filled, and what was held back by limits.
 */
#ifndef vtkRunLimits_h
#define vtkRunLimits_h

#include <nlohmann/json.hpp>

#include <string>

class vtkAlgorithm;
class vtkMessageTrap;
class vtkMotionRegularizer;
class vtkPolyData;

namespace coronary
{
/**
 * Pieces of vessels that were not seen at a tracked phase: vessel, time, status ("filled" or "lost"), length at rest,
 * mean confidence, and the place of the piece's middle at rest.
 * @param tracked  gives the lines at its time steps @param tree  the lines at rest, with names
 * @throws std::runtime_error, Cancelled
 */
nlohmann::ordered_json DescribeFilled(
  vtkAlgorithm* tracked, vtkPolyData* tree, vtkMessageTrap& messages);

/**
 * Every branch, the least likely first: vessel, `confidence` (the least of PlacementConfidence over the time steps), `time`
 * (where that is), length at rest, the place of its middle at rest, and `phases`: pairs of time and confidence.
 * @param moving  gives the lines with PlacementConfidence at its time steps @param tree  the lines at rest, with names
 * @throws std::runtime_error, Cancelled
 */
nlohmann::ordered_json DescribePlacement(
  vtkAlgorithm* moving, vtkPolyData* tree, vtkMessageTrap& messages);

/// One sentence with the branches that are rather not in their places at some phase; empty when there are none.
/// @param placement  what DescribePlacement gives
std::string DoubtfulPlaces(const nlohmann::ordered_json& placement);

/**
 * What the limits did to the lines and to the skeleton: iterations, greatest move, violations that are left, energies
 * before and after; and `clamped`, of the lines, by vessel, time and limit.
 * @throws std::runtime_error, Cancelled
 */
nlohmann::ordered_json DescribeLimits(vtkMotionRegularizer* lines, vtkMotionRegularizer* skeleton,
  vtkPolyData* tree, vtkMessageTrap& messages);
}

#endif
