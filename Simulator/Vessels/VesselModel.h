/**
 * @file VesselModel.h
 * @brief The vessels of a scenario, out of the files of coronary-pipeline run or made by formula.
 *
 * The one part of a session that needs VTK, whose files a run consists of; no type of VTK is in what it gives.
 */
#ifndef DynamicCoronary_VesselModel_h
#define DynamicCoronary_VesselModel_h

#include "ParallelFor.h"
#include "PatientHeart.h"
#include "VesselSource.h"
#include "WallMotion.h"

#include <memory>
#include <string>
#include <vector>

namespace coronary
{
struct VesselModel
{
  std::shared_ptr<WallMotion> wall;
  std::string motion;             ///< for people: "tracked at 20 moments"
  std::vector<std::string> notes; ///< what was assumed, a sentence each
  std::string
    foreignMotion; ///< what of the motion is not the patient's, for the window; empty: nothing
  double heartRate = 0.0; ///< of the motion, beats a minute; 0: not known
  std::shared_ptr<const PatientHeart>
    heart; ///< of a run with named vessels, where they lie at rest; else null
};

/**
 * Of a run: the boundary of its tetrahedra (volume_boundary.vtp), else its surface.vtp; its tree (centerline.vtp) as axis, a
 * line a branch; for a tracked motion skeleton.vtp, weights.vtu and the poses that motion/skeleton.vtp.series lists.
 * The aorta is a run's aorta_wall.vtp with its aorta_centerline.vtp, or the phantom's own, completed; a surface has none.
 * Points belong to the branch that the boundary's GroupIds name, or that is nearest to them in its radii.
 *
 * While it runs, what VTK reports in this process is taken here.
 * @param progress  0 to 1; false cancels
 * @throws std::runtime_error, std::invalid_argument: one sentence that names file and reason: not there, no VTK file, no
 *         weights, not closed, numbers that do not fit each other
 * @throws Cancelled
 */
VesselModel LoadVessels(const VesselSource& source, const ProgressCallback& progress = {});
}

#endif
