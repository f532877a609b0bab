/**
 * @file MovingParts.h
 * @brief What of a patient's CT moves with the heart and with the diaphragm, and its shadow when it has moved.
 *
 * A part is what tissue attenuates more than lung, times a weight that fades out softly. The patient stands still as a
 * whole; of a part its shadow as it has moved is added, its shadow at rest is taken away. Where a moving organ borders on
 * lung its edge moves; inside of tissue, where there is no edge, the weights fade.
 */
#ifndef DynamicCoronary_MovingParts_h
#define DynamicCoronary_MovingParts_h

#include "CArm.h"
#include "LineIntegrals.h"
#include "ParallelFor.h"
#include "ThoraxPhantom.h"
#include "VolumeProjector.h"

#include <functional>
#include <memory>
#include <vector>

namespace coronary
{
/// Where the heart is: an ellipsoid about its arteries.
struct HeartPlace
{
  Vector3 centre{ Vector3::Zero() };        ///< mm
  Matrix3 axes{ Matrix3::Identity() };      ///< rows
  Vector3 toApex{ Vector3::UnitZ() };       ///< unit, from the base
  Vector3 radii{ Vector3::Constant(50.0) }; ///< mm
};

/**
 * Along the principal axes of points on its surface.
 * @param base  in the middle of the ostia; the apex is the point that is furthest from it
 * @throws std::invalid_argument for fewer than four points, or all at the base
 */
HeartPlace HeartAbout(const std::vector<Vector3>& arteries, const Vector3& base);

struct MovingPart
{
  std::shared_ptr<const VolumeProjector> projector; ///< null: there is nothing
  Vector3 middle{ Vector3::Zero() }; ///< mm: motion in the image is that of this depth
};

struct MovingParts
{
  HeartPlace place;
  MovingPart heart;
  MovingPart diaphragm; ///< and what is below it
};

/**
 * The diaphragm is the lower end of the lowest lung (-960 to -500 HU) over a place, 15 mm of it or more.
 * @param patient      HU, LPS
 * @param attenuation  of Hounsfield units, 1/mm
 * @throws as VolumeProjector; Cancelled
 */
MovingParts FindMovingParts(const HounsfieldVolume& patient, const HeartPlace& heart,
  const std::function<double(double)>& attenuation, const ProgressCallback& progress = {});

/// x becomes linear x + shift.
struct AffineMotion
{
  Matrix3 linear{ Matrix3::Identity() };
  Vector3 shift{ Vector3::Zero() }; ///< mm

  bool IsRest() const { return this->linear == Matrix3::Identity() && this->shift.isZero(0.0); }
};

/// That takes points nearest to where they are now (least squares; what they do not tell stays at rest).
/// @throws std::invalid_argument for lists of different length
AffineMotion MotionOf(const std::vector<Vector3>& rest, const std::vector<Vector3>& now);

/**
 * What the whole heart's shadow does of its arteries' motion: what is across its long axis. Along it the base of the
 * ventricles comes down while the atria behind it fill: the outline stays.
 */
AffineMotion AcrossHeart(const AffineMotion& arteries, const HeartPlace& heart);

/**
 * Adds the shadow of a part that has moved, and takes away that of its rest. The motion is that of the plane through
 * `middle` across the beam; beyond the image the part is taken to go on as at its edge.
 * @param part  at rest, of the geometry
 * @throws std::invalid_argument for images that are not of the geometry's format
 */
void AddMotion(const LineIntegrals& part, const CArmGeometry& geometry, const Vector3& middle,
  const AffineMotion& motion, LineIntegrals& image);
}

#endif
