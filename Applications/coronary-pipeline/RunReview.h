/**
 * @file RunReview.h
 * @brief What a run says of itself and how its vessels look in the image, for the review page and as files.
 */
#ifndef DynamicCoronary_RunReview_h
#define DynamicCoronary_RunReview_h

#include "WebReview.h"
#include "vtkRunResult.h"
#include "vtkVesselPictures.h"

#include <functional>
#include <string>
#include <vector>

class vtkMessageTrap;

namespace coronary
{
class StagedFolder;

/// A run as it is looked at.
struct ReviewedRun
{
  RunResult result;
  std::vector<VesselView> vessels;
  ResultImage image;            ///< without values: there are no pictures
  ResultLabels calcium;         ///< empty: it was not looked for, or there is none
  nlohmann::ordered_json cycle; ///< of MeasureRunCycle; null: not measured
  std::string withoutPictures;  ///< why, a sentence; empty: they are there, or not wanted
};

/**
 * Reads a folder of run.
 * @param images    where the images are now; empty: where the run read them. Such ones that are no longer there
 *                  leave a run without pictures; those that are given have to be there
 * @param pictures  whether views of the image are wanted
 * @throws as ReadRunResult and ReadRunImage
 */
ReviewedRun OpenRun(const std::string& folder, const std::vector<std::string>& images,
  bool pictures, vtkMessageTrap& messages);

/// Whether a folder has what OpenRun() reads.
bool IsRunFolder(const std::string& folder);

/// Steps that AddRunReview() begins.
int RunReviewSteps(const ReviewedRun& run);

/**
 * Gives the page's last case what its run says: docs/evaluation.md, "A run without a truth".
 * @param reference  index of the case's phase that the images are of
 * @param folder     where pictures/ goes to; null: the page alone has them
 * @param begin      called with the name of each step
 * @return the number of pictures @throws Cancelled; std::runtime_error naming a file that can not be written
 */
std::size_t AddRunReview(const ReviewedRun& run, const ViewSettings& views, int reference,
  WebReview& review, StagedFolder* folder, const std::function<void(const std::string&)>& begin,
  const ProgressCallback& progress = {});
}

#endif
