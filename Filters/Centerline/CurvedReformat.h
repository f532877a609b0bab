/**
 * @file CurvedReformat.h
 * @brief An image along a vessel: on a sheet that follows it, and across it, with the vessel's boundaries.
 *
 * Straightened: every column is a line through the axis at right angles to it (StraightenedView.h). Curved: the sheet is
 * ruled, its columns are parallel lines through the axis, and it is unrolled into a plane without stretching (stretched
 * curved planar reformation; Kanitsar et al., IEEE Visualization 2002): the vessel keeps its length and bends only in
 * the direction of the columns, and distances in the picture are distances on the sheet. The place of every pixel is
 * known.
 */
#ifndef DynamicCoronary_CurvedReformat_h
#define DynamicCoronary_CurvedReformat_h

#include "StraightenedView.h"

#include <array>
#include <vector>

namespace coronary
{
enum class ReformatKind : int
{
  Straightened = 0,
  Curved = 1
};

struct ReformatSettings
{
  ReformatKind kind = ReformatKind::Straightened;
  /// Degrees that the sheet is turned by: straightened about the axis, curved about the way from the vessel's beginning
  /// to its end. Curved with 0: the columns are at right angles to the plane in which the vessel is longest.
  double angle = 0.0;
  double halfWidth = 8.0; ///< mm to each side of the axis, 1 to 50
  double spacing = 0.25;  ///< mm of a pixel, 0.02 to 5
  double smoothing = 1.0; ///< of tangents, as of FollowAxis, mm, 0 to 20

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

/// A place in a picture, mm: to the right of the first column, and above the middle row.
using PicturePlace = std::array<double, 2>;

struct VesselReformat
{
  GreyPicture picture;             ///< NaN outside of the image
  std::vector<Vector3> place;      ///< in the world, of each pixel, mm
  double spacing = 0.0;            ///< mm of a pixel
  FramedCurve axis;                ///< a place every `spacing` mm of the vessel's length
  std::vector<PicturePlace> track; ///< of each place of the axis
  std::vector<double>
    column; ///< where the axis crosses each column: index of the place, and fraction to its next
  std::vector<Vector3> up; ///< in the world, unit, of each column

  /// Mm along the axis where it crosses a column.
  double ArcAt(std::size_t x) const { return this->column[x] * this->axis.step; }

  /// In the world, mm, between the pixels too; beyond the first and last column their own.
  Vector3 WorldOf(const PicturePlace& at) const;

  /// Of a place of the axis and a distance from it to the left of its course on the sheet, mm.
  PicturePlace Beside(std::size_t n, double distance) const;
};

/**
 * @param axis  from the ostium to the tip, mm
 * @throws std::invalid_argument as ReformatSettings::Validate and FollowAxis, or for a picture of more than 16 million
 *         pixels; Cancelled
 */
VesselReformat ReformatVessel(const ImageInterpolator& image, const std::vector<Vector3>& axis,
  const ReformatSettings& settings, const ProgressCallback& progress = {});

/**
 * The plane across a vessel, seen downstream.
 * @param place      index of the axis' place
 * @param angle      degrees from the frame's normal to the picture's upper side, as that of a straightened sheet
 * @param halfWidth  mm from the axis, in the middle pixel, to each side
 * @throws std::invalid_argument for a place that is not there, or more than 16 million pixels
 */
SlabPlane SectionPlane(
  const FramedCurve& axis, std::size_t place, double angle, double halfWidth, double spacing);

struct BoundarySettings
{
  int rays = 32;             ///< around the axis, 8 to 360
  double outerLevel = -25.0; ///< image value between the vessel's wall and the fat around it, HU
  double reach =
    4.0; ///< mm beyond the lumen within which the outer boundary is looked for, 0.5 to 20

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

/// Boundaries around an axis: distances from it, mm, in directions at equal angles from the frame's normal towards its
/// binormal. NaN: not seen.
struct VesselBoundaries
{
  int rays = 0;
  std::vector<double>
    lumen; ///< `rays` for each place: where the image has fallen half way to the wall
  std::vector<double>
    outer; ///< the same: where the wall ends and fat begins; not seen beside muscle and chambers

  /// In any direction, linear between the rays. @param of  `lumen` or `outer` @param angle  degrees
  double At(const std::vector<double>& of, std::size_t place, double angle) const;

  /// Area within a boundary, mm^2, by the rays that see it, at least two thirds of them; else NaN.
  double Area(const std::vector<double>& of, std::size_t place) const;
};

/**
 * Looks for the lumen's edge and the outer boundary at every place of an axis. Single rays give way to the median of
 * their neighbours around and along the vessel.
 * @param radius  of the lumen, about, mm, one a place
 * @throws std::invalid_argument for another number of radii than places, or as BoundarySettings::Validate; Cancelled
 */
VesselBoundaries TraceBoundaries(const ImageInterpolator& image, const FramedCurve& axis,
  const std::vector<double>& radius, const BoundarySettings& settings,
  const ProgressCallback& progress = {});
}

#endif
