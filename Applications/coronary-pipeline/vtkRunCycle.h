/**
 * @file vtkRunCycle.h
 * @brief The lumen of a run's vessels over the heart cycle, for the review page.
 */
#ifndef vtkRunCycle_h
#define vtkRunCycle_h

#include "vtkRunResult.h"
#include "vtkVesselPictures.h"

#include <nlohmann/json.hpp>

#include <functional>
#include <string>
#include <vector>

class vtkMessageTrap;

namespace coronary
{
/**
 * Measures the lumen in the gated images of a run at each phase of its motion (vtkLumenCycle).
 * @param vessels  whose values are given, one list a vessel
 * @param files    where the images are now; empty: where the run read them
 * @param without  do not read images: the radii of the moved lines instead
 * @return docs/evaluation.md, "Along the vessels"; null without motion, or when it has other lines than the tree
 * @throws std::runtime_error naming a file that can not be read; Cancelled
 */
nlohmann::ordered_json MeasureRunCycle(const RunResult& result,
  const std::vector<VesselView>& vessels, const std::vector<std::string>& files, bool without,
  vtkMessageTrap& messages, const std::function<void(double)>& progress);
}

#endif
