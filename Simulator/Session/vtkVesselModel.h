/**
 * @file vtkVesselModel.h
 * @brief The vessels of a scenario, out of the files of coronary-pipeline run or made by formula.
 */
#ifndef vtkVesselModel_h
#define vtkVesselModel_h

#include "ParallelFor.h"
#include "Scenario.h"
#include "WallMotion.h"

#include <memory>
#include <string>
#include <vector>

class vtkMessageTrap;

namespace coronary
{
struct VesselModel
{
  std::shared_ptr<WallMotion> wall;
  std::string motion;             ///< for people: "tracked at 20 moments"
  std::vector<std::string> notes; ///< what was assumed, a sentence each
  std::string
    foreignMotion; ///< what of the motion is not the patient's, for the window; empty: nothing
};

/**
 * Of a run: the boundary of its tetrahedra (volume_boundary.vtp), else its surface.vtp; its tree (centerline.vtp) as axis, a
 * line a branch; for a tracked motion skeleton.vtp, weights.vtu and the poses that motion/skeleton.vtp.series lists.
 * Points belong to the branch that the boundary's GroupIds name, or that is nearest to them in its radii.
 * @throws std::runtime_error, std::invalid_argument: one sentence that names file and reason: not there, no VTK file, no
 *         weights, not closed, numbers that do not fit each other
 * @throws Cancelled
 */
VesselModel LoadVessels(
  const VesselSource& source, vtkMessageTrap& messages, const ProgressCallback& progress = {});
}

#endif
