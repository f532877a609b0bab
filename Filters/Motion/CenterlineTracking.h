/**
 * @file CenterlineTracking.h
 * @brief Where the vessels of one phase are in all the other phases of a gated series.
 *
 * The tree is found once, at the reference phase; here it is carried through the cycle, and keeps all
 * its branches. docs/tracking.md has the steps, TrajectoryModel.cxx the equations.
 */
#ifndef DynamicCoronary_CenterlineTracking_h
#define DynamicCoronary_CenterlineTracking_h

#include "ItemSharing.h"
#include "ParallelFor.h"
#include "PoseSequence.h"
#include "ScalarImage.h"
#include "TrajectoryModel.h"

#include <functional>
#include <string>
#include <vector>

namespace coronary
{
struct CenterlineTrackingSettings
{
  /// Seconds over which an image is taken: images of moving vessels are compared with the
  /// reference smeared along the motion. 0: no smearing.
  double temporalWindow = 0.066;
  double cycleLength = 0.8; ///< R-R interval, s, 0.2 to 5

  /// Images show the tissue around the vessels too, which moves with them; false: vessels alone (masks).
  bool tissue = true;

  double nodeSpacing = 2.0;   ///< mm along the vessels, 0.5 to 10
  double coarseSpacing = 2.0; ///< mm, of the averaged images of the first search, 1 to 4
  double coarseRadius = 10.0; ///< mm, of the surroundings that are compared in it
  double captureRange = 16.0; ///< mm between phases that are neighbours in time, 2 to 40
  double fineRadius = 5.0;    ///< mm, of the surroundings in the second search
  double fineRange = 5.0;     ///< mm

  double trackedDeviation = 0.6; ///< mm: nodes less certain than that have less confidence
  TrajectoryPrior prior;
  /// What was not seen takes the motion of what was seen around it; false: that of the trajectories alone.
  bool fillUnseen = true;

  /// @throws std::invalid_argument naming the setting.
  void Validate() const;
};

/// What was found out besides the poses.
struct CenterlineTrackingReport
{
  /// Mean distance of pairs of phases that are at most 0.02 R-R apart modulo the cycle, each measured by
  /// itself, mm; NaN when there are none.
  double repeatability = 0.0;
  int repeatedPhases = 0;            ///< how many such pairs
  std::vector<double> trackedShare;  ///< per phase: nodes that were tracked
  std::vector<std::string> warnings; ///< one sentence each
  std::int64_t keptBytes = 0;        ///< of images, of the phases that were measured here
  int imagesRead = 0;                ///< here
};

/**
 * @param lines          at the reference phase
 * @param referenceTime  of the lines, fraction of R-R
 * @param times          of the phases to track, strictly increasing
 * @param imageAt        gives the image of a time; one that was given before need not stay
 * @param sharing        who reads, keeps and measures which phases, which are its items from the reference outwards.
 *   The result is the same whoever does. The wide search of a phase begins where a phase before it ended, so that
 *   two phases at a time are searched, however many are done at once.
 * @return positions at `times`, with confidence, status and calibre
 * @throws std::invalid_argument naming a setting or what is wrong with the lines, times or images;
 * std::runtime_error: the lines were found in none of the phases; Cancelled; what imageAt throws, and
 * ItemSharing::Results
 */
PoseSequence TrackCenterlines(const Polylines& lines, double referenceTime,
  const std::vector<double>& times, const std::function<ScalarImage(double time)>& imageAt,
  const CenterlineTrackingSettings& settings = {}, CenterlineTrackingReport* report = nullptr,
  const ProgressCallback& progress = {}, ItemSharing& sharing = ItemSharing::None());
}

#endif
