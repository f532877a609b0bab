#include "FluoroscopyImager.h"

#include "DetectorKernels.h"
#include "KernelChoice.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr RequireOf RequireImages{ "images" };

constexpr float MinimumSignal = 0.25F; ///< photons: what is shown as the darkest
constexpr double HarmonisedWidths =
  12.0; ///< standard deviations of what is broad, in an image's width
constexpr float RoadmapSmoothing = 0.3F; ///< weight of a new frame in the gathered vessels

/// Mean over the 3 x 3 neighbours, nearer at the image's edges.
void SmoothInPlace(std::vector<float>& image, int columns, int rows)
{
  const std::vector<float> in = image;
  for (int row = 0; row < rows; ++row)
  {
    for (int column = 0; column < columns; ++column)
    {
      float sum = 0.0F;
      for (int y = row - 1; y <= row + 1; ++y)
      {
        for (int x = column - 1; x <= column + 1; ++x)
        {
          sum += in[static_cast<std::size_t>(std::clamp(y, 0, rows - 1)) * columns +
            std::clamp(x, 0, columns - 1)];
        }
      }
      image[static_cast<std::size_t>(row) * columns + column] = sum / 9.0F;
    }
  }
}
}

void ImagerSettings::Validate() const
{
  this->detector.Validate();
  RequireImages(this->window >= 0.5 && this->window <= 20.0, "window", this->window, "0.5 to 20");
  RequireImages(this->level >= -10.0 && this->level <= 10.0, "level", this->level, "-10 to 10");
  RequireImages(this->harmonisation >= 0.0 && this->harmonisation <= 0.9, "harmonisation",
    this->harmonisation, "0 to 0.9");
  RequireImages(this->exposureSeconds >= 0.01 && this->exposureSeconds <= 10.0,
    "time constant of the brightness", this->exposureSeconds, "0.01 to 10 s");
  RequireImages(this->subtractionWindow >= 0.1 && this->subtractionWindow <= 10.0,
    "window of subtraction", this->subtractionWindow, "0.1 to 10");
  RequireImages(this->roadmapOpacity >= 0.0 && this->roadmapOpacity <= 1.0,
    "opacity of the roadmap", this->roadmapOpacity, "0 to 1");
  RequireImages(this->roadmapThreshold >= 0.0 && this->roadmapThreshold <= 5.0,
    "threshold of the roadmap", this->roadmapThreshold, "0 to 5");
  RequireImages(this->maskFrames >= 1 && this->maskFrames <= 64, "number of frames of a mask",
    this->maskFrames, "1 to 64");
}

FluoroscopyImager::FluoroscopyImager(const ImagerSettings& settings, std::uint64_t seed)
  : Settings_(settings)
  , Detector_(settings.detector, seed)
{
  settings.Validate();
}

void FluoroscopyImager::SetSettings(const ImagerSettings& settings)
{
  settings.Validate();
  this->Settings_ = settings;
  this->Detector_.SetSettings(settings.detector);
}

void FluoroscopyImager::TakeMask()
{
  this->MaskCount = 0;
  this->MaskIsOpen = true;
}

void FluoroscopyImager::SetMode(ImageMode mode)
{
  this->Mode_ = mode;
  this->TakeMask();
  this->RoadmapReady = false;
  this->Roadmap.clear();
  this->Smoothed.clear();
  this->RoadmapSequence = -1;
}

const GreyImage& FluoroscopyImager::Expose(const LineIntegrals& background,
  const LineIntegrals& instruments, const LineIntegrals& contrast, const Exposure& exposure)
{
  const double lag =
    exposure.cine ? this->Settings_.detector.cineLag : this->Settings_.detector.fluoroscopyLag;
  if (exposure.sequence != this->Sequence)
  {
    // What the panel held has gone in the pause.
    this->Detector_.Forget();
  }
  const std::vector<float>& signal = this->Detector_.Expose(background, &instruments, &contrast,
    exposure.photons, static_cast<std::uint64_t>(exposure.frame), lag);
  this->FitTo(background.columns, background.rows);
  DetectorKernelChoice().Get().logarithm(signal.data(), MinimumSignal,
    std::log(static_cast<float>(exposure.photons)), static_cast<std::int64_t>(signal.size()),
    this->LogSignal.data());
  this->FollowBrightness(background, exposure);
  this->Begin(exposure);

  if (this->Mode_ == ImageMode::Plain)
  {
    this->Harmonise(background);
    this->ShowPlain();
  }
  else
  {
    this->ShowSubtracted();
  }
  return this->Shown_;
}

/// Another size: what is kept from earlier frames does not fit any more.
void FluoroscopyImager::FitTo(int columns, int rows)
{
  if (this->Shown_.columns == columns && this->Shown_.rows == rows)
  {
    return;
  }
  this->Shown_.columns = columns;
  this->Shown_.rows = rows;
  const std::size_t pixels = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  this->Shown_.values.assign(pixels, 0);
  this->LogSignal.assign(pixels, 0.0F);
  this->Row.assign(static_cast<std::size_t>(columns), 0.0F);
  this->Broad.Prepare(columns, rows, std::max(4.0, columns / HarmonisedWidths));
  this->SetMode(this->Mode_);
}

void FluoroscopyImager::FollowBrightness(const LineIntegrals& background, const Exposure& exposure)
{
  // Between the shutters every fourth pixel each way is enough.
  constexpr int step = 4;
  const Collimation& shutters = this->Settings_.detector.shutters;
  const auto first = [](double share, int count) { return static_cast<int>(share * count); };
  const int lastColumn = background.columns - first(shutters.right, background.columns);
  const int lastRow = background.rows - first(shutters.bottom, background.rows);
  double sum = 0.0;
  std::int64_t count = 0;
  for (int row = first(shutters.top, background.rows); row < lastRow; row += step)
  {
    for (int column = first(shutters.left, background.columns); column < lastColumn; column += step)
    {
      sum += background.values[static_cast<std::size_t>(row) * background.columns + column];
      ++count;
    }
  }
  const double wanted = -sum / static_cast<double>(std::max<std::int64_t>(count, 1));
  const double weight = this->Bright
    ? 1.0 - std::exp(-1.0 / (std::max(exposure.frameRate, 0.1) * this->Settings_.exposureSeconds))
    : 1.0;
  this->DisplayLevel_ += weight * (wanted - this->DisplayLevel_);
  this->Bright = true;
}

/// What the beginning of radiation and the mask pedal mean for mask and roadmap.
void FluoroscopyImager::Begin(const Exposure& exposure)
{
  const bool begins = exposure.sequence != this->Sequence;
  this->Sequence = exposure.sequence;
  if (begins || exposure.mask)
  {
    this->TakeMask();
  }
  if (this->Mode_ == ImageMode::Roadmap)
  {
    if (this->RoadmapSequence < 0)
    {
      this->RoadmapSequence = exposure.sequence;
    }
    else if (exposure.sequence != this->RoadmapSequence && !this->RoadmapReady)
    {
      this->FinishRoadmap();
    }
  }
}

/// Evens out what is broad in the background, as the exposure follows the background only.
void FluoroscopyImager::Harmonise(const LineIntegrals& background)
{
  if (this->Settings_.harmonisation == 0.0)
  {
    return;
  }
  this->Broad.Blur(background.values.data());
  const auto share = static_cast<float>(this->Settings_.harmonisation);
  const auto middle = static_cast<float>(this->DisplayLevel_ * this->Settings_.harmonisation);
  for (int row = 0; row < background.rows; ++row)
  {
    this->Broad.Row(row, this->Row.data());
    float* values = this->LogSignal.data() + static_cast<std::size_t>(row) * background.columns;
    for (std::size_t i = 0; i < this->Row.size(); ++i)
    {
      values[i] += share * this->Row[i] + middle;
    }
  }
}

void FluoroscopyImager::ShowPlain()
{
  const double scale = 255.0 / this->Settings_.window;
  const double offset = 127.5 + scale * (this->Settings_.level - this->DisplayLevel_);
  DetectorKernelChoice().Get().grey(this->LogSignal.data(), static_cast<float>(scale),
    static_cast<float>(offset), static_cast<std::int64_t>(this->LogSignal.size()),
    this->Shown_.values.data());
}

/// The first frames are the mask, and are shown as what differs from their mean so far.
void FluoroscopyImager::ShowSubtracted()
{
  if (this->MaskIsOpen)
  {
    this->AddToMask();
  }
  std::vector<float>& difference = this->LogSignal;
  for (std::size_t i = 0; i < difference.size(); ++i)
  {
    difference[i] -= this->Mask[i];
  }
  const auto scale = static_cast<float>(255.0 / this->Settings_.subtractionWindow);
  if (this->Mode_ == ImageMode::Roadmap)
  {
    if (this->RoadmapReady)
    {
      this->AddRoadmap();
    }
    else
    {
      this->GatherRoadmap();
    }
  }
  DetectorKernelChoice().Get().grey(difference.data(), scale, 127.5F,
    static_cast<std::int64_t>(difference.size()), this->Shown_.values.data());
}

void FluoroscopyImager::AddToMask()
{
  if (this->MaskCount == 0)
  {
    this->Mask.assign(this->LogSignal.size(), 0.0F);
  }
  const float weight = 1.0F / static_cast<float>(++this->MaskCount);
  for (std::size_t i = 0; i < this->Mask.size(); ++i)
  {
    this->Mask[i] += weight * (this->LogSignal[i] - this->Mask[i]);
  }
  this->MaskIsOpen = this->MaskCount < this->Settings_.maskFrames;
}

/// Greatest opacification, of frames that are averaged a little: the greatest noise is not wanted.
void FluoroscopyImager::GatherRoadmap()
{
  const std::vector<float>& difference = this->LogSignal;
  if (this->Roadmap.empty())
  {
    this->Roadmap.assign(difference.size(), 0.0F);
    this->Smoothed.assign(difference.size(), 0.0F);
  }
  for (std::size_t i = 0; i < difference.size(); ++i)
  {
    this->Smoothed[i] += RoadmapSmoothing * (-difference[i] - this->Smoothed[i]);
    this->Roadmap[i] = std::max(this->Roadmap[i], this->Smoothed[i]);
  }
}

/// From opacification to what is added to the live image.
void FluoroscopyImager::FinishRoadmap()
{
  this->RoadmapReady = true;
  this->Roadmap.resize(this->LogSignal.size(), 0.0F);
  this->Smoothed.clear();
  SmoothInPlace(this->Roadmap, this->Shown_.columns, this->Shown_.rows);
  const auto threshold = static_cast<float>(this->Settings_.roadmapThreshold);
  float most = 0.0F;
  for (float& value : this->Roadmap)
  {
    value = std::max(0.0F, value - threshold);
    most = std::max(most, value);
  }
  const double full = 0.5 * this->Settings_.subtractionWindow * this->Settings_.roadmapOpacity;
  const float scale = most > 0.0F ? static_cast<float>(full) / most : 0.0F;
  for (float& value : this->Roadmap)
  {
    value *= scale;
  }
}

void FluoroscopyImager::AddRoadmap()
{
  for (std::size_t i = 0; i < this->LogSignal.size(); ++i)
  {
    this->LogSignal[i] += this->Roadmap[i];
  }
}
}
