/**
 * @file ExposureControl.h
 * @brief Automatic exposure control: how much radiation a view of a patient needs.
 */
#ifndef DynamicCoronary_ExposureControl_h
#define DynamicCoronary_ExposureControl_h

#include "Acquisition.h"
#include "VolumeProjector.h"

#include <memory>

namespace coronary
{
/**
 * Keeps the detector's signal: the mean of exp(-A) in the middle half of the field, each way, is held against that of
 * so much water that the mean of the usual views of the thorax phantom needs what AcquisitionSettings says (calibrated).
 * The farther the detector, the more kerma for the same photons (inverse square).
 *
 * Deterministic, and on one thread: the same bits for the same patient and view.
 */
class ExposureControl
{
public:
  static constexpr double MeasuredShare = 0.5;        ///< of the field's width and height
  static constexpr double ReferenceThickness = 233.3; ///< mm of water: factor 1; calibrated
  static constexpr double LeastFactor = 0.1;          ///< chosen, as the next: a generator's range
  static constexpr double GreatestFactor = 10.0;

  /**
   * Of fluoroscopy, mGy/min, 300 mm in front of the detector of a C-arm. Source: 21 CFR 1020.32 (d); recording of images
   * is exempt there.
   */
  static constexpr double LargestKermaRate = 88.0;

  /// @param water  attenuation of water at the patient's energy, 1/mm
  /// @throws std::invalid_argument without a patient, or for water that does not attenuate
  ExposureControl(std::shared_ptr<const VolumeProjector> patient, double water);

  /// @throws as CArmGeometry, ReferenceFieldArea
  ViewExposure Of(const CArmPose& pose, const DetectorFormat& format) const;

private:
  std::shared_ptr<const VolumeProjector> Patient;
  double ReferenceSignal; ///< of the unattenuated beam's
};
}

#endif
