/**
 * @file SessionImager.h
 * @brief From a moment of a session to its X-ray image.
 */
#ifndef DynamicCoronary_SessionImager_h
#define DynamicCoronary_SessionImager_h

#include "AortaImage.h"
#include "Attenuation.h"
#include "BackgroundCache.h"
#include "ContrastProjector.h"
#include "FluoroscopyImager.h"
#include "InstrumentProjector.h"
#include "MovingParts.h"
#include "Scenario.h"
#include "ThoraxPhantom.h"
#include "TrainingSession.h"
#include "WallMotion.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace coronary
{
/// The middle of the vessels at rest: of the box about their axes, mm. Where the isocentre is unless a scenario says so.
/// @throws std::invalid_argument  the vessels have no axis
Vector3 MiddleOfVessels(const WallTopology& topology);

/// The scenario's pose, with an isocentre.
CArmPose StartPose(const WallTopology& topology, const ImagingSettings& imaging);

/// The patient around the vessels.
struct SessionBackground
{
  HounsfieldVolume volume;
  std::vector<std::string> notes; ///< what was taken away or stands in, a sentence each
};

/**
 * The scenario's CT, of which what is not the patient is taken away and, with a run of it, the CT's contrast medium; or the
 * thorax phantom. About vessels that are not the coronary phantom's the thorax is moved so that its heart has their middle.
 * @throws as ReadBackgroundVolume, ReadRunImages, RemoveContrastMedium, MakeThoraxPhantom
 */
SessionBackground LoadBackground(
  const Scenario& scenario, const WallTopology& topology, const ProgressCallback& progress = {});

/// What SessionImager needs of it.
std::shared_ptr<const VolumeProjector> MakeProjector(
  const HounsfieldVolume& background, const ImagingSettings& imaging);

/// What of it moves as the scenario wants; null: nothing.
/// @throws as FindMovingParts
std::shared_ptr<const MovingParts> MovingPartsOf(const HounsfieldVolume& background,
  const WallTopology& topology, const ImagingSettings& imaging,
  const ProgressCallback& progress = {});

/// The thorax phantom coarsely, as the exposure control measures it: soon made.
std::shared_ptr<const VolumeProjector> MeasuredThorax(
  const Scenario& scenario, const WallTopology& topology);

/// The heart and all that is in its vessels moves with the breath as a whole: as if the C-arm moved the other way.
CArmGeometry GeometryOfHeart(const SessionSnapshot& snapshot, const DetectorFormat& format);

/// The middles of the balloon's markers, from its tip on, mm: two, or fewer where the rest lies in the guide catheter; a
/// microcatheter has none.
std::vector<Vector3> BalloonMarkers(const SessionSnapshot& snapshot, const Scenario& scenario);

/**
 * Background, instruments and contrast medium are line integrals of their own and are added before the exponential.
 * Used by one thread.
 */
class SessionImager
{
public:
  /**
   * @param worker      the background is refined beside the images (not deterministic in time); false: it is finished before
   *                    an image is made
   * @param moving      of the background; null: it stands still
   */
  SessionImager(const WallTopology& topology, const Scenario& scenario,
    std::shared_ptr<const VolumeProjector> background, bool worker,
    std::shared_ptr<const MovingParts> moving = nullptr);
  ~SessionImager();

  /// Where the C-arm will be looked from next: the background is begun.
  void Aim(const CArmPose& pose, double fieldOfView);

  /// The snapshot's last exposure. @return the image to be shown
  const GreyImage& Expose(const SessionSnapshot& snapshot);

  FluoroscopyImager& Images() { return this->Images_; }
  const FluoroscopyImager& Images() const { return this->Images_; }

  ///@{
  /// The layers of the last image.
  const LineIntegrals& Instruments() const { return this->InstrumentLayer; }
  const LineIntegrals& Contrast() const { return this->ContrastLayer; }
  ///@}
  double BackgroundCompleteness() const
  {
    return this->Completeness;
  } ///< 0 to 1, of the last image

  /// FNV-1a over an image's size and pixels.
  static std::uint64_t HashOf(const GreyImage& image);

private:
  CArmGeometry GeometryOf(const CArmPose& pose, double fieldOfView) const;
  void ProjectInstruments(const SessionSnapshot& snapshot, const CArmGeometry& geometry);
  /// @param line  from its tip on, mm  @param number  as WireOf
  InstrumentChain WireOf(
    const SessionSnapshot& snapshot, const std::vector<Vector3>& line, std::size_t number) const;
  void ProjectGuideLumen(const SessionSnapshot& snapshot, const CArmGeometry& geometry);
  void ProjectBalloon(const SessionSnapshot& snapshot, const CArmGeometry& geometry);
  void ProjectMicrocatheter(
    const BalloonCatheter& device, const std::vector<Vector3>& line, const CArmGeometry& geometry);
  void ProjectStents(const SessionSnapshot& snapshot, const CArmGeometry& geometry);
  void ProjectContrast(const SessionSnapshot& snapshot, const CArmGeometry& geometry);
  void MoveBackground(const SessionSnapshot& snapshot, const CArmGeometry& geometry);

  /// Of the background, with its shadow at rest.
  struct Part
  {
    Vector3 middle;
    std::unique_ptr<BackgroundCache> shadow;
  };

  Scenario Scenario_;
  std::vector<std::vector<double>> Radii; ///< of the axis
  std::vector<double> Hidden;             ///< mm at each branch's beginning that lie in its parent
  Attenuation Materials;
  double NeatContrast;             ///< 1/mm
  std::vector<Vector3> AxisAtRest; ///< as SessionSnapshot::axis
  std::unique_ptr<BackgroundCache> Background;
  HeartPlace Place;
  std::optional<Part> Heart;     ///< none: it stands still
  std::optional<Part> Diaphragm; ///< likewise
  FluoroscopyImager Images_;
  LineIntegrals InstrumentLayer;
  LineIntegrals ContrastLayer;
  LineIntegrals BackgroundLayer; ///< of this moment
  double Completeness = 0.0;
  std::vector<ContrastBranch> Branches;
  std::unique_ptr<AortaImage> Aorta; ///< null: its medium is not drawn
};
}

#endif
