/**
 * @file StraightenedView.h
 * @brief A vessel as a reader of CT looks at it: straightened along its axis, and in a thin slab that follows it.
 *
 * Straightened curved planar reformation (Kanitsar et al., IEEE Visualization 2002): every column of the picture is a
 * line through the axis at right angles to it. The lines turn with a frame that does not twist about the axis (double
 * reflection; Wang et al., ACM Trans Graph 2008;27:2), so that nothing in the picture turns but the vessel. Slabs are
 * maximum intensity projections.
 */
#ifndef DynamicCoronary_StraightenedView_h
#define DynamicCoronary_StraightenedView_h

#include "Geometry.h"
#include "LumenMeasurement.h"
#include "ParallelFor.h"

#include <array>
#include <vector>

namespace coronary
{
/// Values of an image, row by row from the top; NaN: outside of the image.
struct GreyPicture
{
  int width = 0;
  int height = 0;
  std::vector<float> values;

  float At(int x, int y) const
  {
    return this->values[static_cast<std::size_t>(y) * static_cast<std::size_t>(this->width) +
      static_cast<std::size_t>(x)];
  }
};

/// Places at equal steps along a vessel's axis, with a frame. Vectors are unit and at right angles.
struct FramedCurve
{
  double step = 0.0;             ///< mm of arc between two places
  std::vector<Vector3> position; ///< on the axis as it was given, mm
  std::vector<Vector3> tangent;  ///< downstream
  std::vector<Vector3> normal;   ///< without twist about the axis
  std::vector<Vector3> binormal; ///< tangent x normal
  std::vector<double> place; ///< index of the point of the axis and fraction of the way to its next

  /// Of values at the points of the axis: linear between them, or of the nearer point.
  std::vector<double> Interpolated(const std::vector<double>& values) const;
  std::vector<double> Nearest(const std::vector<double>& values) const;
};

/**
 * @param axis       points from the root side to the tip, mm; neighbours may coincide
 * @param step       mm of arc; the last place is the last multiple of it on the axis
 * @param smoothing  standard deviation over which the tangent is averaged, mm; positions stay where they are, so that
 *                   an axis beside its vessel is seen to be so
 * @throws std::invalid_argument for less than two points, an axis without length, coordinates that are not finite,
 *         a step that is not above 0 or gives more than a million places, or a smoothing below 0
 */
FramedCurve FollowAxis(const std::vector<Vector3>& axis, double step, double smoothing = 1.0);

/**
 * Two straightened cuts of a vessel at right angles: a column a place of the curve, rows along its normal and along
 * its binormal, the axis in the middle row, positive above; pixels are curve.step wide and high.
 * @param halfWidth  mm to each side of the axis
 * @throws std::invalid_argument for a half width that is not above 0 or wider than 1000 pixels; Cancelled
 */
std::array<GreyPicture, 2> StraightenVessel(const ImageInterpolator& image,
  const FramedCurve& curve, double halfWidth, const ProgressCallback& progress = {});

/// A picture's plane. Vectors are unit and at right angles; a viewer looks against `towards`.
struct SlabPlane
{
  Vector3 corner = Vector3::Zero(); ///< centre of the upper left pixel, in the middle of the slab
  Vector3 right = Vector3::UnitX();
  Vector3 down = -Vector3::UnitZ();
  Vector3 towards = -Vector3::UnitY(); ///< to the viewer
  double spacing = 0.5;                ///< of pixels, mm
  int width = 0;
  int height = 0;

  /// Pixels to the right and down from the centre of the upper left one, and mm towards the viewer.
  Vector3 ToPicture(const Vector3& world) const;
};

/// Where a picture looks from, as `towards`; up is the head, in axial pictures the front.
/// @throws std::invalid_argument for a direction without length
SlabPlane PlaneTowards(const Vector3& towards);

/**
 * The plane's picture becomes just large enough for all points with a margin; its middle is that of their depths.
 * @throws std::invalid_argument for no points, or more than 16 million pixels
 */
SlabPlane Framed(
  const SlabPlane& plane, const std::vector<Vector3>& points, double margin, double spacing);

/**
 * The plane in which a vessel is longest, seen from the patient's front or, where it lies level, from above or below.
 * A vessel that is straight within `straightness` (mm, standard deviation) leaves the choice: then from the front.
 * @throws as Framed
 */
SlabPlane PlaneOfVessel(
  const std::vector<Vector3>& points, double margin, double spacing, double straightness = 2.0);

/**
 * Depths of a curved slab that goes through a vessel wherever it is, mm towards the viewer from the plane, one a pixel:
 * means of the depths of the points, weighted by 1 / (d^2 + softness^2)^2.
 * @param softness  mm
 * @throws std::invalid_argument for no points or a softness that is not above 0; Cancelled
 */
std::vector<float> DepthsAlong(const SlabPlane& plane, const std::vector<Vector3>& points,
  double softness = 3.0, const ProgressCallback& progress = {});

/**
 * Greatest value of the image within the slab, at each pixel; NaN: no part of the slab there is in the image.
 * @param depths     one a pixel, or empty: the plane itself
 * @param thickness  mm, half of it to each side
 * @throws std::invalid_argument for a thickness below 0 or another number of depths than pixels; Cancelled
 */
GreyPicture ProjectSlab(const ImageInterpolator& image, const SlabPlane& plane,
  const std::vector<float>& depths, double thickness, const ProgressCallback& progress = {});
}

#endif
