/**
 * @file StentEnhancement.h
 * @brief A stent that is seen better: the frames of a cine run, laid over each other by the markers of its balloon.
 */
#ifndef DynamicCoronary_StentEnhancement_h
#define DynamicCoronary_StentEnhancement_h

#include "Detector.h"

#include <vector>

namespace coronary
{
struct XrayAngiogram;

struct EnhancedStent
{
  GreyImage
    image; ///< around the markers, enlarged; empty: the run shows no two markers in enough frames
  std::vector<float>
    mean; ///< of the frames, grey, of the same pixels before they were evened out and stretched
  int frames = 0;     ///< that it is the mean of
  double scale = 1.0; ///< of its pixels, in those of the run
};

/**
 * Every frame is moved, turned and scaled so that both markers come to lie where they are in the frame with the median
 * distance between them, and the mean is taken: what goes with the balloon stays, noise and all else fades; what is
 * broader than a stent is evened out. Frames whose
 * markers are foreshortened by more than a tenth are left out.
 * @param size  of the image, pixels
 */
EnhancedStent EnhanceStent(const XrayAngiogram& run, int size = 512);
}

#endif
