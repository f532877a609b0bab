/**
 * @file CurveSmoothing.h
 * @brief Smoothing of sampled curves that leaves their length alone.
 */
#ifndef DynamicCoronary_CurveSmoothing_h
#define DynamicCoronary_CurveSmoothing_h

#include "Geometry.h"

#include <vector>

namespace coronary
{
/// Points at equal distances of about `spacing` along a polyline, first and last kept.
std::vector<Vector3> ResampleCurve(const std::vector<Vector3>& points, double spacing);

/**
 * Whittaker's smoother: minimises sum w |x - y|^2 + lambda sum |third difference of x|^2, which
 * leaves parabolas as they are. `wavelength` is in samples: at weight 1 its amplitude is halved,
 * twice of it keeps 98 %, half of it 2 %. Samples of weight 0 are interpolated.
 * @param weights  one for each sample, not negative, not all 0; a great one holds a sample
 */
std::vector<Vector3> SmoothCurve(
  const std::vector<Vector3>& samples, const std::vector<double>& weights, double wavelength);

/// The same for a scalar with second differences, which keeps straight lines.
std::vector<double> SmoothSequence(
  const std::vector<double>& samples, const std::vector<double>& weights, double wavelength);
}

#endif
