/**
 * @file RunImages.h
 * @brief What a run of coronary-pipeline tells of the images that it was made of.
 */
#ifndef DynamicCoronary_RunImages_h
#define DynamicCoronary_RunImages_h

#include "PatientVolume.h"

#include <string>

namespace coronary
{
struct RunImages
{
  double time = 0.0; ///< R-R fraction of the phase that the vessels were found in
  EnhancedBlood blood;
  std::string mask; ///< file of the vessels' voxels at that phase
};

/// @param folder  of coronary-pipeline run
/// @throws std::runtime_error naming the report and what is wrong: not there, no JSON, made of a surface, no segmentation
RunImages ReadRunImages(const std::string& folder);
}

#endif
