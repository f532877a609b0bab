/**
 * @file Acquisition.h
 * @brief The examination's logic: at which ticks a frame is exposed, and what dose that gives. No images.
 *
 * Dose is air kerma at the patient entrance reference point of IEC 60601-2-43, 15 cm from the isocentre towards the
 * tube, free in air, mGy; and its product with the beam's area there, Gy cm^2. Sources of the default rates are in
 * docs/fluoroscopy-image.md.
 */
#ifndef DynamicCoronary_Acquisition_h
#define DynamicCoronary_Acquisition_h

#include "CArm.h"
#include "Detector.h"

#include <cstdint>
#include <limits>

namespace coronary
{
enum class FrameRate : int
{
  F7_5 = 0,
  F15 = 1,
  F30 = 2
};

double FramesPerSecond(FrameRate rate);

/// @throws std::invalid_argument for anything but 7.5, 15 and 30
FrameRate FrameRateOf(double framesPerSecond);

struct AcquisitionSettings
{
  int tickRate = 2000; ///< Hz, 100 to 100000
  FrameRate fluoroscopyRate = FrameRate::F15;
  FrameRate cineRate = FrameRate::F15;
  double fluoroscopyKerma = 0.029; ///< mGy a frame at the reference point, above 0 to 10
  double cineKerma = 0.22;         ///< mGy a frame
  double fluoroscopyPhotons =
    2000.0; ///< a pixel of the unattenuated beam, with fluoroscopyKerma; 1 to 1e6. Other
            ///< kerma: in proportion
  double fieldArea = 131.0; ///< of the beam at the reference point, cm^2, above 0 to 5000

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

/// What one frame is exposed with: goes from the physics thread to the image's.
struct Exposure
{
  std::int64_t tick = 0;     ///< ticks before this one, since the clock began
  std::int64_t frame = 0;    ///< frames before this one, of both kinds
  std::int64_t sequence = 0; ///< times that radiation has been switched on; 1: the first time
  std::int64_t frameOfSequence = 0;
  bool cine = false;
  std::int64_t run = 0;    ///< cine run, from 1 on; 0: fluoroscopy
  bool mask = false;       ///< the mask pedal was pressed since the frame before
  double photons = 2000.0; ///< a pixel of the unattenuated beam
  double kerma = 0.029;    ///< mGy
  double frameRate = 15.0; ///< Hz
};

/// What a view needs, against the settings' exposure.
struct ViewExposure
{
  double photons = 1.0; ///< a pixel of the unattenuated beam, times the settings'
  double kerma = 1.0;   ///< at the reference point, times the settings'
  double fluoroscopyLimit =
    std::numeric_limits<double>::infinity(); ///< mGy/min at the reference point
};

/// Of one kind of exposure.
struct DoseCounters
{
  std::int64_t frames = 0;
  double seconds = 0.0;         ///< pedal down
  double airKerma = 0.0;        ///< mGy
  double doseAreaProduct = 0.0; ///< Gy cm^2
};

/**
 * Counts ticks. Deterministic: its state is a function of the calls alone. Cadence is exact: after n ticks with a
 * pedal down since the first frame, floor(n rate / tickRate) + 1 frames have been exposed; a pedal that is pressed
 * again sooner than a frame's interval waits for the rest of it.
 */
class ExposureClock
{
public:
  /// @throws std::invalid_argument as AcquisitionSettings::Validate()
  explicit ExposureClock(const AcquisitionSettings& settings = {});

  /**
   * One tick. Both pedals down: cine.
   * @param mask  the pedal or key that asks for a new mask; pressed, its edge counts
   * @returns true: a frame is exposed at this tick, Last() is how
   */
  bool Step(bool fluoroscopy, bool cine, bool mask = false);

  const Exposure& Last() const { return this->Last_; }
  bool Radiating() const { return this->Beam != Off; } ///< a pedal was down at the last tick

  void SetFluoroscopyRate(FrameRate rate);
  /// cm^2 at the reference point. @throws std::invalid_argument
  void SetFieldArea(double area);
  /// Of the next frames; before it: the settings'. @throws std::invalid_argument for what is not above 0
  void SetView(const ViewExposure& view);
  /// Whether the next step exposes when a pedal is down.
  bool IsDue() const;

  const AcquisitionSettings& Settings() const { return this->Settings_; }
  DoseCounters Fluoroscopy() const { return this->Counted(0); }
  DoseCounters Cine() const { return this->Counted(1); }
  DoseCounters Total() const;
  std::int64_t Runs() const { return this->Runs_; } ///< cine runs that were begun

  /// Of everything that the next steps depend on, and the counters.
  std::uint64_t StateHash() const;

private:
  enum BeamState : int
  {
    Off = 0,
    InFluoroscopy = 1,
    InCine = 2
  };
  void Switch(BeamState wanted);
  void Expose(bool cine);
  DoseCounters Counted(int kind) const;

  AcquisitionSettings Settings_;
  BeamState Beam = Off;
  bool MaskWasDown = false;
  bool MaskWanted = false;
  std::int64_t Ticks = 0;
  std::int64_t Charge; ///< half frames times tickRate that are due
  std::int64_t Frames = 0;
  std::int64_t Sequence = 0;
  std::int64_t FrameOfSequence = 0;
  std::int64_t Runs_ = 0;
  std::int64_t PedalTicks[2] = { 0, 0 };
  ViewExposure View;
  DoseCounters Counters[2]; ///< fluoroscopy, cine; their seconds are not kept
  Exposure Last_;
};

/// Distance of the reference point from the isocentre, towards the tube, mm.
constexpr double ReferencePointDistance = 150.0;

/// Area of the open beam at the reference point, cm^2.
/// @throws std::invalid_argument for a pose whose reference point is not in front of the tube
double ReferenceFieldArea(
  const CArmPose& pose, const DetectorFormat& format, const Collimation& shutters = {});
}

#endif
