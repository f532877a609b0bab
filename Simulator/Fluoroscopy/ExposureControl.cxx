#include "ExposureControl.h"

#include "Require.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace coronary
{
namespace
{
constexpr RequireOf RequireControl{ "exposure control" };

constexpr int Samples = 16;              ///< rays each way
constexpr double BeforeDetector = 300.0; ///< mm: where the law limits the kerma
}

ExposureControl::ExposureControl(std::shared_ptr<const VolumeProjector> patient, double water)
  : Patient(std::move(patient))
  , ReferenceSignal(std::exp(-water * ReferenceThickness))
{
  RequireControl(this->Patient != nullptr, "there is no patient");
  RequireControl(
    water > 0.0 && water < 1.0, "attenuation of water", water, "above 0, below 1 / mm");
}

ViewExposure ExposureControl::Of(const CArmPose& pose, const DetectorFormat& format) const
{
  const DetectorFormat field{ Samples, Samples, MeasuredShare * format.width,
    MeasuredShare * format.height };
  LineIntegrals rays(Samples, Samples);
  this->Patient->ProjectRectangle(CArmGeometry(pose, field), { 0, 0, Samples, Samples }, rays);
  double signal = 0.0;
  for (const float value : rays.values)
  {
    signal += std::exp(-static_cast<double>(value)) / (Samples * Samples);
  }
  const double far = pose.sourceToDetector / CArmPose().sourceToDetector;
  const double limited =
    (pose.sourceToDetector - BeforeDetector) / (pose.sourceToIsocentre - ReferencePointDistance);
  ViewExposure view;
  view.photons = std::clamp(this->ReferenceSignal / signal, LeastFactor, GreatestFactor);
  view.kerma = view.photons * far * far;
  view.fluoroscopyLimit = LargestKermaRate * limited * limited;
  return view;
}
}
