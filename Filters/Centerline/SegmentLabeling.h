/**
 * @file SegmentLabeling.h
 * @brief Names of the coronary arteries' segments, from the shape of the trees alone.
 *
 * Nothing is assumed about where the patient lies, how the heart is turned, or what is missing. The
 * trees are brought onto a mean heart (Dodge et al., Circulation 1988;78:1167) by a robust
 * similarity fit from many starting orientations; the fit is the estimate of the heart's frame.
 * Then every piece of vessel takes the name that is best by position, course and calibre, under the
 * rules of what may branch off what, for right, left and balanced dominance: an exact minimum over
 * all assignments by dynamic programming along the tree. Borders of segments follow the SCCT model
 * (Raff et al., J Cardiovasc Comput Tomogr 2009;3:122).
 */
#ifndef DynamicCoronary_SegmentLabeling_h
#define DynamicCoronary_SegmentLabeling_h

#include "CenterlineTopology.h"
#include "CoronaryAnatomy.h"

#include <array>

namespace coronary
{
struct LabelingSettings
{
  /// How much a heart turned away from the usual position in the patient (LPS) counts against a
  /// fit; only where the shape leaves a choice. 0: any orientation is as good. 0 to 100.
  double orientationWeight = 1.0;

  /// Right, left, balanced, or -1: whichever explains the trees best.
  int dominance = -1;

  /// @throws std::invalid_argument that names the first setting out of range or not finite.
  void Validate() const;
};

/// Where the trees say that the heart is. Heart coordinates: a from the right coronary's side to
/// the circumflex' side, b = c x a, c from the base to the apex; origin in the middle of the
/// atrioventricular groove; the mean heart's apex at c = 91.5.
struct HeartPose
{
  Matrix3 axes = Matrix3::Identity(); ///< rows a, b, c in the input's coordinates, unit vectors
  Vector3 origin = Vector3::Zero();   ///< in the input's coordinates
  double size = 1.0;                  ///< input units per mm of the mean heart

  /// Millimetres of the mean heart.
  Vector3 ToHeart(const Vector3& position) const
  {
    return this->axes * (position - this->origin) / this->size;
  }
};

/// The pose that a matrix from the world to millimetres of the mean heart holds, row by row (the field array `HeartFrame`).
/// Of a matrix that is no similarity the axes are no rotation.
HeartPose HeartPoseOf(const std::array<double, 16>& matrix);

/// The affine fit behind the names: nearer to the individual's proportions than HeartPose.
struct MeanHeartFit
{
  Matrix3 matrix = Matrix3::Identity();
  Vector3 shift = Vector3::Zero();

  /// Position on the mean heart (SegmentAtlas.h), mm, LPS.
  Vector3 ToMeanHeart(const Vector3& position) const
  {
    return this->matrix * position + this->shift;
  }
};

struct LabelingResult
{
  Dominance dominance = Dominance::Right;
  HeartPose heart;
  MeanHeartFit fit;
  double meanDistance = 0.0; ///< of the named vessels from the mean heart's, mm of the mean heart
  double cost = 0.0;         ///< of the chosen assignment; less is better
  double margin = 0.0;       ///< cost of the best assignment with another dominance, minus cost
};

/**
 * Fills segmentId of points and branches, and treeId (0 left, 1 right, -1 not a coronary tree).
 *
 * A point has the segment of the vessel that it lies on; a branch the segment of most of its
 * length. 0: no SCCT segment (conus, atrial and other unnamed branches).
 * Trees may be one or more; with nothing to label the result is the default.
 * @throws std::invalid_argument for settings out of range; Cancelled
 */
LabelingResult LabelSegments(CenterlineTopology& tree, const LabelingSettings& settings = {},
  const ProgressCallback& progress = {});

/**
 * Cuts branches where the segment changes inside them, because the side branch that marks the
 * border was not found: so that a branch's name holds for all of it. The pieces have the
 * generation and order of the branch, and touch end to end; group ids are numbered anew, also in
 * the bifurcations. Stretches shorter than two radii are left with their neighbour.
 * @return number of cuts
 */
int SplitAtSegmentBorders(CenterlineTopology& tree);
}

#endif
