/**
 * @file FluoroscopyImager.h
 * @brief The images of an examination: brightness, last image, subtraction, roadmap.
 *
 * Used by one thread, which gets Exposures from an ExposureClock; that it misses some is no error.
 */
#ifndef DynamicCoronary_FluoroscopyImager_h
#define DynamicCoronary_FluoroscopyImager_h

#include "Acquisition.h"
#include "Detector.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace coronary
{
enum class ImageMode : int
{
  Plain = 0,
  Subtraction = 1, ///< what changed since the mask: mid-grey is no change
  Roadmap =
    2 ///< first time with radiation: vessels are gathered from a subtracted injection; from the second
      ///< on: live subtracted image with these vessels, bright, under it
};

struct ImagerSettings
{
  DetectorSettings detector;
  double window = 2.6; ///< of ln(photons), that is black to white, 0.5 to 20
  double level = 0.0;  ///< added to ln(photons) before the window: brighter, -10 to 10
  double harmonisation =
    0.5; ///< share of the background's broad brightness that is evened out, 0 to 0.9: lungs less
         ///< bright, spine less dark
  double exposureSeconds = 0.5;   ///< time constant of the automatic brightness, 0.01 to 10
  double subtractionWindow = 1.2; ///< of the difference of ln(photons), 0.1 to 10
  double roadmapOpacity = 0.6;    ///< how bright the full contrast of a roadmap is, 0 to 1
  double roadmapThreshold = 0.08; ///< ln(photons) that a vessel takes away at least, 0 to 5
  int maskFrames = 1;             ///< averaged for a mask, 1 to 64

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

class FluoroscopyImager
{
public:
  /// @throws std::invalid_argument as ImagerSettings::Validate()
  explicit FluoroscopyImager(const ImagerSettings& settings = {}, std::uint64_t seed = 1);

  /**
   * Exposes a frame.
   *
   * Brightness follows the mean of `background` between the shutters, slowly; never the frame itself, so that
   * contrast medium does not make it flicker.
   * @param background, instruments, contrast  ln(I0 / I), of the same size
   * @returns Shown()
   * @throws std::invalid_argument for layers that are empty or not of one size
   */
  const GreyImage& Expose(const LineIntegrals& background, const LineIntegrals& instruments,
    const LineIntegrals& contrast, const Exposure& exposure);

  /// Last image hold: the last frame exposed; 0 x 0 before the first.
  const GreyImage& Shown() const { return this->Shown_; }

  /// Forgets the mask, and makes it anew from the next frames.
  void TakeMask();
  bool HasMask() const { return this->MaskCount > 0; }

  /// From the next frame on; Roadmap begins a new roadmap.
  void SetMode(ImageMode mode);
  ImageMode Mode() const { return this->Mode_; }
  /// Roadmap mode: false while vessels are gathered.
  bool HasRoadmap() const { return this->RoadmapReady; }

  /// From the next frame on.
  /// @throws std::invalid_argument as ImagerSettings::Validate()
  void SetSettings(const ImagerSettings& settings);
  const ImagerSettings& Settings() const { return this->Settings_; }

  /// ln(photons) that is shown mid-grey in Plain mode.
  double DisplayLevel() const { return this->DisplayLevel_; }

private:
  void FitTo(int columns, int rows);
  void FollowBrightness(const LineIntegrals& background, const Exposure& exposure);
  void Begin(const Exposure& exposure);
  void Harmonise(const LineIntegrals& background);
  void ShowPlain();
  void ShowSubtracted();
  void AddToMask();
  void GatherRoadmap();
  void FinishRoadmap();
  void AddRoadmap();

  ImagerSettings Settings_;
  Detector Detector_;
  ImageMode Mode_ = ImageMode::Plain;
  GreyImage Shown_;
  std::int64_t Sequence = 0;
  double DisplayLevel_ = 0.0;
  bool Bright = false;          ///< DisplayLevel_ has been set
  std::vector<float> LogSignal; ///< ln(photons / photons of the unattenuated beam), less the mask
  BroadBlur Broad;              ///< of the background
  std::vector<float> Row;
  std::vector<float> Mask; ///< the mean of MaskCount frames of LogSignal
  int MaskCount = 0;
  bool MaskIsOpen = true; ///< the next frame belongs to it
  bool RoadmapReady = false;
  std::int64_t RoadmapSequence = -1; ///< in which vessels are gathered; negative: not begun
  std::vector<float> Smoothed;       ///< opacification, low-pass over the frames
  std::vector<float> Roadmap;        ///< greatest opacification, ln(photons)
};
}

#endif
