#include "Acquisition.h"

#include "Fnv1a.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace coronary
{
namespace
{
constexpr RequireOf RequireAcquisition{ "acquisition" };

/// A whole number for all three: frames in two seconds.
std::int64_t FramesInTwoSeconds(FrameRate rate)
{
  return rate == FrameRate::F7_5 ? 15 : (rate == FrameRate::F15 ? 30 : 60);
}

void RequireRate(const char* name, FrameRate rate)
{
  const int value = static_cast<int>(rate);
  RequireAcquisition(value >= 0 && value <= static_cast<int>(FrameRate::F30), name, value,
    "one of FrameRate's: 0, 1, 2");
}

void RequireFieldArea(double area)
{
  RequireAcquisition(
    area > 0.0 && area <= 5000.0, "area of the field", area, "above 0, to 5000 cm^2");
}

template <typename T>
std::uint64_t Hashed(const T& value, std::uint64_t before)
{
  static_assert(std::is_arithmetic_v<T>, "padding has no value");
  return Fnv1a(&value, sizeof(value), before);
}
}

double FramesPerSecond(FrameRate rate)
{
  return 0.5 * static_cast<double>(FramesInTwoSeconds(rate));
}

FrameRate FrameRateOf(double framesPerSecond)
{
  for (const FrameRate rate : { FrameRate::F7_5, FrameRate::F15, FrameRate::F30 })
  {
    if (framesPerSecond == FramesPerSecond(rate))
    {
      return rate;
    }
  }
  throw std::invalid_argument("acquisition: the frame rate is " + std::to_string(framesPerSecond) +
    " Hz; it has to be 7.5, 15 or 30");
}

void AcquisitionSettings::Validate() const
{
  RequireAcquisition(this->tickRate >= 100 && this->tickRate <= 100000, "tick rate", this->tickRate,
    "100 to 100000 Hz");
  RequireRate("frame rate of fluoroscopy", this->fluoroscopyRate);
  RequireRate("frame rate of cine", this->cineRate);
  RequireAcquisition(this->fluoroscopyKerma > 0.0 && this->fluoroscopyKerma <= 10.0,
    "air kerma of a fluoroscopy frame", this->fluoroscopyKerma, "above 0, to 10 mGy");
  RequireAcquisition(this->cineKerma > 0.0 && this->cineKerma <= 10.0, "air kerma of a cine frame",
    this->cineKerma, "above 0, to 10 mGy");
  RequireAcquisition(this->fluoroscopyPhotons >= 1.0 && this->fluoroscopyPhotons <= 1e6,
    "photons a pixel", this->fluoroscopyPhotons, "1 to 1e6");
  RequireFieldArea(this->fieldArea);
}

ExposureClock::ExposureClock(const AcquisitionSettings& settings)
  : Settings_(settings)
  , Charge(2 * static_cast<std::int64_t>(settings.tickRate))
{
  settings.Validate();
}

void ExposureClock::SetFluoroscopyRate(FrameRate rate)
{
  RequireRate("frame rate of fluoroscopy", rate);
  this->Settings_.fluoroscopyRate = rate;
}

void ExposureClock::SetFieldArea(double area)
{
  RequireFieldArea(area);
  this->Settings_.fieldArea = area;
}

void ExposureClock::SetView(const ViewExposure& view)
{
  const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  RequireAcquisition(positive(view.photons), "factor of the photons", view.photons, "above 0");
  RequireAcquisition(positive(view.kerma), "factor of the air kerma", view.kerma, "above 0");
  RequireAcquisition(
    view.fluoroscopyLimit > 0.0, "limit of fluoroscopy", view.fluoroscopyLimit, "above 0 mGy/min");
  this->View = view;
}

bool ExposureClock::IsDue() const
{
  return this->Charge >= 2 * static_cast<std::int64_t>(this->Settings_.tickRate);
}

bool ExposureClock::Step(bool fluoroscopy, bool cine, bool mask)
{
  this->MaskWanted = this->MaskWanted || (mask && !this->MaskWasDown);
  this->MaskWasDown = mask;
  this->Switch(cine ? InCine : (fluoroscopy ? InFluoroscopy : Off));

  // What a frame needs, 2 tickRate, comes in by frames in two seconds each tick. It does not pile up beyond one
  // frame, so that a pedal pressed again and again gets no more frames than the rate.
  const std::int64_t needed = 2 * static_cast<std::int64_t>(this->Settings_.tickRate);
  bool exposed = false;
  if (this->Beam != Off)
  {
    ++this->PedalTicks[cine ? 1 : 0];
    if (this->IsDue())
    {
      this->Charge -= needed;
      this->Expose(cine);
      exposed = true;
    }
  }
  const FrameRate rate =
    this->Beam == InCine ? this->Settings_.cineRate : this->Settings_.fluoroscopyRate;
  this->Charge += FramesInTwoSeconds(rate);
  if (this->Beam == Off)
  {
    this->Charge = std::min(this->Charge, needed);
  }
  ++this->Ticks;
  return exposed;
}

void ExposureClock::Switch(BeamState wanted)
{
  if (wanted == this->Beam)
  {
    return;
  }
  this->Beam = wanted;
  if (wanted != Off)
  {
    ++this->Sequence;
    this->FrameOfSequence = 0;
    this->Runs_ += wanted == InCine ? 1 : 0;
  }
}

void ExposureClock::Expose(bool cine)
{
  const double usual = cine ? this->Settings_.cineKerma : this->Settings_.fluoroscopyKerma;
  const double rate =
    FramesPerSecond(cine ? this->Settings_.cineRate : this->Settings_.fluoroscopyRate);
  const double wanted = usual * this->View.kerma;
  const double kerma = cine ? wanted : std::min(wanted, this->View.fluoroscopyLimit / 60.0 / rate);
  this->Last_.tick = this->Ticks;
  this->Last_.frame = this->Frames++;
  this->Last_.sequence = this->Sequence;
  this->Last_.frameOfSequence = this->FrameOfSequence++;
  this->Last_.cine = cine;
  this->Last_.run = cine ? this->Runs_ : 0;
  this->Last_.mask = this->MaskWanted;
  this->Last_.kerma = kerma;
  this->Last_.photons = this->View.photons * (kerma / wanted) *
    (usual / this->Settings_.fluoroscopyKerma * this->Settings_.fluoroscopyPhotons);
  this->Last_.frameRate = rate;
  this->MaskWanted = false;

  DoseCounters& counters = this->Counters[cine ? 1 : 0];
  ++counters.frames;
  counters.airKerma += kerma;
  counters.doseAreaProduct += 1e-3 * kerma * this->Settings_.fieldArea;
}

DoseCounters ExposureClock::Counted(int kind) const
{
  DoseCounters counters = this->Counters[kind];
  counters.seconds = static_cast<double>(this->PedalTicks[kind]) / this->Settings_.tickRate;
  return counters;
}

DoseCounters ExposureClock::Total() const
{
  DoseCounters total = this->Fluoroscopy();
  const DoseCounters cine = this->Cine();
  total.frames += cine.frames;
  total.seconds += cine.seconds;
  total.airKerma += cine.airKerma;
  total.doseAreaProduct += cine.doseAreaProduct;
  return total;
}

std::uint64_t ExposureClock::StateHash() const
{
  std::uint64_t hash = Fnv1a(nullptr, 0);
  for (const std::int64_t value :
    { this->Ticks, this->Charge, this->Frames, this->Sequence, this->FrameOfSequence, this->Runs_,
      this->PedalTicks[0], this->PedalTicks[1], static_cast<std::int64_t>(this->Beam),
      static_cast<std::int64_t>(this->MaskWasDown), static_cast<std::int64_t>(this->MaskWanted),
      static_cast<std::int64_t>(this->Settings_.fluoroscopyRate),
      static_cast<std::int64_t>(this->Settings_.cineRate), this->Counters[0].frames,
      this->Counters[1].frames })
  {
    hash = Hashed(value, hash);
  }
  for (const double value : { this->View.kerma, this->Settings_.fieldArea,
         this->Counters[0].airKerma, this->Counters[0].doseAreaProduct, this->Counters[1].airKerma,
         this->Counters[1].doseAreaProduct })
  {
    hash = Hashed(value, hash);
  }
  return hash;
}

double ReferenceFieldArea(
  const CArmPose& pose, const DetectorFormat& format, const Collimation& shutters)
{
  const double fromSource = pose.sourceToIsocentre - ReferencePointDistance;
  if (!(fromSource > 0.0) || !(pose.sourceToDetector > 0.0))
  {
    throw std::invalid_argument("acquisition: the tube is " +
      std::to_string(pose.sourceToIsocentre) +
      " mm from the isocentre; it has to be more than the reference point's 150 mm");
  }
  const double scale = fromSource / pose.sourceToDetector;
  return 0.01 * format.width * format.height * scale * scale * shutters.OpenFraction();
}
}
