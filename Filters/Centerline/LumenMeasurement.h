/**
 * @file LumenMeasurement.h
 * @brief Centre, radius and confidence of a vessel's cross-section, by rays on the image.
 */
#ifndef DynamicCoronary_LumenMeasurement_h
#define DynamicCoronary_LumenMeasurement_h

#include "Geometry.h"
#include "ScalarImage.h"

#include <functional>
#include <limits>
#include <vector>

namespace coronary
{
/// Trilinear interpolation at world positions; the border's values are repeated.
class ImageInterpolator
{
public:
  explicit ImageInterpolator(const ScalarImage& image);

  double At(const Vector3& world) const;
  bool Contains(const Vector3& world) const;
  double MinimumSpacing() const { return Image.grid.spacing.minCoeff(); }
  Vector3 ToIndex(const Vector3& world) const { return Inverse * (world - Image.grid.origin); }

private:
  ScalarImage Image;
  Matrix3 Inverse;
};

/// What a lumen and its surroundings look like near a seed.
struct LumenReference
{
  double lumen = 1.0;
  double background = 0.0;
  double radius = 1.0; ///< mm
};

struct LumenSettings
{
  int rays = 24;              ///< over the full circle, an even number of at least 8
  double maximumRadius = 4.0; ///< mm
  /// A level that is the wall, for masks and distance fields. NaN: half way between the lumen and
  /// what lies behind the wall, for each ray.
  double level = std::numeric_limits<double>::quiet_NaN();
  LumenReference reference; ///< what counts as contrast; unused with a fixed level
  /// Standard deviation of the image's blur, mm, for what a lumen of a size can show; 0: not known, then it is that of
  /// the voxels. Unused with a fixed level.
  double blur = 0.0;
};

struct LumenSection
{
  Vector3 centre = Vector3::Zero(); ///< mm
  double radius = 0.0;              ///< mm, of the circle through the wall
  double lumen = 0.0;               ///< image value at the centre
  double behind = 0.0;              ///< median of the least values behind the wall
  double share = 0.0;               ///< of the rays that found a wall, 0 to 1
  double spread = 1.0;              ///< standard deviation from the circle, relative to the radius
  double confidence = 0.0;          ///< 0 no vessel to be seen .. 1 a bright round one all around
};

/**
 * The section in the plane through `position` normal to `tangent`.
 *
 * From the centre rays go to where the image has fallen half way to its least value behind the wall, found between samples
 * by linear interpolation. The distance as a function of the angle is fitted by a circle off the centre
 * (constant and first harmonic) over the rays that found a wall, without those that run into a
 * branch or a neighbour; the centre moves, and the rays are cast again. Small radii come out too great: see
 * RadiusFromHalfMaximum.
 */
LumenSection MeasureLumen(const ImageInterpolator& image, const Vector3& position,
  const Vector3& tangent, double radiusGuess, const LumenSettings& settings);

/**
 * The centre of a lumen whose wall is to be seen on one side only, as where a branch leaves another vessel's lumen.
 *
 * A circle of the known half-maximum `radius` (mm) is fitted to the walls that `isOwn` accepts, in the plane through
 * `position` normal to `tangent`; `lumen` is the vessel's image value. For images, not for fixed levels.
 * @returns false if too little of the wall is accepted, or if it is no such circle
 */
bool MeasureArc(const ImageInterpolator& image, const Vector3& position, const Vector3& tangent,
  double radius, double lumen, const std::function<bool(const Vector3& wall)>& isOwn,
  const LumenSettings& settings, Vector3& centre);

/**
 * Points on the wall in the plane through `position` normal to `tangent`, at the half maximum of each ray.
 *
 * `radius` (mm) is about what the wall's distance is, `lumen` the vessel's image value. Rays without a clear fall give
 * no point: fewer than LumenSettings::rays. For images, not for fixed levels.
 */
std::vector<Vector3> MeasureWall(const ImageInterpolator& image, const Vector3& position,
  const Vector3& tangent, double radius, double lumen, const LumenSettings& settings);

/**
 * The same as distances from `position`, one a ray, from `u` towards `v` (unit vectors at right angles to each other).
 * NaN: no wall was found.
 */
std::vector<double> MeasureWall(const ImageInterpolator& image, const Vector3& position,
  const Vector3& u, const Vector3& v, double radius, double lumen, const LumenSettings& settings);

/// What the surroundings of a seed look like, by rays in all directions.
/// @returns false if there is no lumen: nothing darker around it
bool MeasureReference(
  const ImageInterpolator& image, const Vector3& seed, LumenReference& reference);

/**
 * True radius of a disc that a Gaussian of standard deviation `blur` shows with a half-maximum
 * radius of `measured`; all in mm. A small disc's half maximum is further out (1.18 blurs for a
 * point), a great one's a little further in.
 */
double RadiusFromHalfMaximum(double measured, double blur);

/// The blur that shows a disc with this half-maximum radius (mm) and with the share `contrast`, 0
/// to 1, of its full contrast at its centre.
double BlurFromContrast(double measured, double contrast);
}

#endif
