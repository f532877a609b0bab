#include "ScannerSettings.h"

#include "Numbers.h"
#include "Require.h"

#include <cmath>
#include <sstream>
#include <utility>

namespace coronary
{
const std::vector<ScannerNumber>& AllScannerNumbers()
{
  using S = ScannerSettings;
  static const std::vector<ScannerNumber> numbers{
    { "source_to_axis_mm", &S::sourceToAxis, 300.0, 1000.0 },
    { "source_to_detector_mm", &S::sourceToDetector, 300.0, 2000.0 },
    { "channels", &S::channels, 16, 4096 },
    { "channel_pitch_mm", &S::channelPitch, 0.1, 40.0 },
    { "channel_offset", &S::channelOffset, -2.0, 2.0 },
    { "rows", &S::rows, 2, 640 },
    { "row_pitch_mm", &S::rowPitch, 0.1, 40.0 },
    { "fill", &S::fill, 0.1, 1.0 },
    { "focal_spot_mm", &S::focalSpot, 0.0, 3.0 },
    { "views_per_turn", &S::viewsPerTurn, 60, 5000 },
    { "turn_s", &S::turnTime, 0.1, 2.0 },
    { "sources", &S::sources, 1, 2 },
    { "kilovolts", &S::kilovolts, 70.0, 140.0 },
    { "milliamperes", &S::milliamperes, 10.0, 1500.0 },
    { "aluminium_mm", &S::aluminium, 1.0, 20.0 },
    { "systolic_current", &S::systolicCurrent, 0.04, 1.0 },
    { "electronic_noise", &S::electronicNoise, 0.0, 1e5 },
    { "electrons_per_kev", &S::electronsPerKeV, 1.0, 1000.0 },
    { "noise", &S::noise, 0, 1 },
    { "pitch", &S::pitch, 0.0, 1.5 },
    { "segments", &S::segments, 1, 4 },
    { "overlap", &S::overlap, 0.0, 0.5 },
    { "beat_deviation", &S::beatDeviation, 0.0, 0.3 },
    { "heart_shift_mm", &S::heartShift, 0.0, 5.0 },
    { "breathing_mm", &S::breathing, -20.0, 20.0 },
    { "extrasystole", &S::extrasystole, 0, 1000 },
    { "contrast_loss", &S::contrastLoss, 0.0, 0.3 },
    { "image_noise_hu", &S::imageNoise, 0.0, 500.0 },
    { "iterative", &S::iterative, 0.0, 0.8 },
    { "anatomy_spacing_mm", &S::anatomySpacing, 0.2, 4.0 },
    { "anatomy_step_s", &S::anatomyStep, 0.001, 0.1 },
  };
  return numbers;
}

void ScannerSettings::Validate() const
{
  for (const ScannerNumber& number : AllScannerNumbers())
  {
    const double value =
      std::visit([this](auto member) { return static_cast<double>(this->*member); }, number.member);
    std::ostringstream message;
    message << "scanner: " << number.name << " is " << value << ", it must lie within "
            << number.low << " to " << number.high;
    Require(value >= number.low && value <= number.high, message.str());
  }
  Require(this->sourceToDetector > this->sourceToAxis,
    "scanner: the detector is nearer to the tube than the axis: source_to_detector_mm has to "
    "be above source_to_axis_mm");
  Require(this->sources == 1 || this->viewsPerTurn % 4 == 0,
    "scanner: the views of a quarter turn, by which two sources stand apart, are not a whole "
    "number: "
    "views_per_turn has to be a multiple of 4");
  Require(this->HalfFan() < 0.25 * Pi,
    "scanner: the fan is wider than 90 degrees: channels times channel_pitch_mm is too long an arc "
    "for source_to_detector_mm");
  Require(0.5 * this->rows * this->rowPitch < 0.3 * this->sourceToDetector,
    "scanner: the cone is too wide to be reconstructed from a circle: rows times row_pitch_mm has "
    "to stay below 0.6 source_to_detector_mm");
}

double ScannerSettings::HalfFan() const
{
  return std::max(-this->ColumnAngle(0.0), this->ColumnAngle(this->channels - 1.0));
}

double ScannerSettings::FieldRadius() const
{
  const double minimum = std::min(-this->ColumnAngle(0.0), this->ColumnAngle(this->channels - 1.0));
  return this->sourceToAxis * std::sin(minimum);
}

int ScannerSettings::HalfScanViews() const
{
  return static_cast<int>(std::ceil((Pi + 2.0 * this->HalfFan()) / this->ViewAngle())) + 1;
}

double ScannerSettings::HalfScanTime() const
{
  const double turns = this->HalfScanViews() * this->ViewAngle() / (2.0 * Pi);
  // Two sources share the way: each goes half of it, and starts a quarter turn after the other.
  return this->turnTime * (this->sources == 1 ? turns : turns - 0.25);
}

const std::vector<std::string>& ScannerPresets()
{
  static const std::vector<std::string> names{ "single-350", "single-330", "dual-280", "dual-250",
    "wide-280", "helical-350", "helical-330", "helical-280" };
  return names;
}

ScannerSettings ScannerPreset(const std::string& name)
{
  ScannerSettings s; // GE LightSpeed VCT
  s.imageNoise = 25.0;
  if (name == "single-350")
  {
    return s;
  }
  if (name.rfind("helical-", 0) == 0)
  {
    for (const char* known : { "single-350", "single-330", "dual-280" })
    {
      if (name.substr(name.size() - 3) == std::string(known).substr(std::string(known).size() - 3))
      {
        s = ScannerPreset(known);
        s.pitch = 0.2;
        return s;
      }
    }
  }
  if (name == "wide-280")
  {
    s.rows = 256; // 160 mm at the axis: the whole heart in one beat
    s.turnTime = 0.28;
    return s;
  }
  if (name == "single-330") // Siemens Sensation 64
  {
    s.sourceToAxis = 570.0;
    s.sourceToDetector = 1040.0;
    s.channels = 672;
    s.channelPitch = 1.44;
    s.rowPitch = 0.6 * 1040.0 / 570.0;
    s.viewsPerTurn = 1160;
    s.turnTime = 0.33;
    return s;
  }
  if (name == "dual-280" || name == "dual-250") // Siemens Definition Flash and Force
  {
    const bool force = name == "dual-250";
    s.sourceToAxis = 595.0;
    s.sourceToDetector = 1085.6;
    s.channels = force ? 920 : 736;
    s.channelPitch = force ? 1.286 * 736.0 / 920.0 : 1.286;
    s.rows = force ? 96 : 64;
    s.rowPitch = 0.6 * 1085.6 / 595.0;
    s.viewsPerTurn = 1152;
    s.turnTime = force ? 0.25 : 0.28;
    s.sources = 2;
    return s;
  }
  std::string list;
  for (const std::string& known : ScannerPresets())
  {
    list += (list.empty() ? "" : ", ") + known;
  }
  throw std::invalid_argument("scanner: no preset '" + name + "'; there are " + list);
}
}
