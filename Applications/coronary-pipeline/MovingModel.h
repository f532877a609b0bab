/**
 * @file MovingModel.h
 * @brief A moving model in a folder: surfaces and centerlines over time, for `evaluate`.
 */
#ifndef DynamicCoronary_MovingModel_h
#define DynamicCoronary_MovingModel_h

#include "FileSeries.h"

#include <string>
#include <vector>

namespace coronary
{
/// Files of a model at its times, and what is known of how it was tracked.
struct MovingModel
{
  std::string path; ///< as the user gave it
  std::vector<TimedFile> surfaces;
  std::vector<TimedFile> centerlines; ///< may be empty

  bool tracksKnown = false;         ///< whether the following is known
  std::vector<double> trackedTimes; ///< R-R fractions of the phases that were tracked
  std::vector<double> trackedShare; ///< one each: share of the tree that was to be seen

  enum class Tracking
  {
    None, ///< not tracked, or not known
    Lost, ///< to be tracked, but less than half of the tree was seen
    Seen
  };
  Tracking TrackingAt(double time, double tolerance) const;

  /// The file at a time, or null.
  static const TimedFile* At(const std::vector<TimedFile>& files, double time, double tolerance);
};

/**
 * Looks for surfaces and centerlines in what `run` or `phantom` wrote (motion.pvd, surface.pvd, their .series, in
 * the folder itself, in motion/ or in truth/), or takes one .pvd or .series file of surfaces or masks, or a series.json: the
 * masks of its phases, or their true surfaces.
 * @throws std::runtime_error naming the folder or file and what is missing
 */
MovingModel FindMovingModel(const std::string& path);

/// Whether the folder of a run has what moves.
bool HasMotion(const std::string& folder);

/// The last name of a path, what a case is called by default.
std::string FolderName(const std::string& path);
}

#endif
