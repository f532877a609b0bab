/**
 * @file ItkVesselness.h
 * @brief ITK's multi-scale vesselness with the settings of ours, to be compared with.
 */
#ifndef DynamicCoronary_ItkVesselness_h
#define DynamicCoronary_ItkVesselness_h

#include <array>
#include <memory>
#include <string>

namespace coronary
{
struct ItkVesselnessSettings
{
  double sigmaMin = 0.5; ///< mm
  double sigmaMax = 2.5; ///< mm
  int scales = 5;        ///< equidistant
  bool bright = true;
  double alpha = 0.5;
  double beta = 0.5;
  double c = 100.0;          ///< HU; ITK calls it gamma
  bool doubleTensors = true; ///< Hessians in memory as double, as in ITK's examples, or as float
  int threads = 1;
};

std::string ItkVersion();

/**
 * itk::MultiScaleHessianBasedMeasureImageFilter with itk::HessianToObjectnessMeasureImageFilter for
 * lines (M = 1). With ScaleObjectnessMeasure off it is Eq. 1 of the paper.
 * @param values   i fastest; kept, not copied
 * @param spacing  mm
 * @return the voxels of the result, in ITK's own memory
 */
std::shared_ptr<const float> ItkVesselness(const float* values,
  const std::array<int, 3>& dimensions, const std::array<double, 3>& spacing,
  const ItkVesselnessSettings& settings);
}

#endif
