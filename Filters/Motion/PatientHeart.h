/**
 * @file PatientHeart.h
 * @brief Where a patient's heart is, how it lies and how long it is, from the named coronary tree of one phase.
 *
 * The names' own fit to the mean heart (HeartPose) is where it begins. Then the patient's vessels count more than the mean
 * heart, as far as they are there: the RCA and the LCx lie in the atrioventricular groove, the LAD and the posterior
 * descending artery end at the apex, the trees begin at the aortic root. What is missing stays as in the mean heart,
 * with a larger uncertainty, and is told.
 */
#ifndef DynamicCoronary_PatientHeart_h
#define DynamicCoronary_PatientHeart_h

#include "SegmentLabeling.h"
#include "VesselTree.h"

#include <string>
#include <vector>

namespace coronary
{
/// Heart coordinates in mm of the patient: a from the RCA's side to the LCx's, b = c x a, c from the groove to the apex.
struct PatientHeart
{
  Matrix3 axes = Matrix3::Identity(); ///< rows a, b, c, unit vectors
  Vector3 base = Vector3::Zero();     ///< middle of the atrioventricular groove, mm, the origin
  Vector3 apex = Vector3::Zero();     ///< mm
  double length = 91.5;               ///< mm from the groove to the apex along c
  ///@{
  /// (a, b) of the interventricular groove in front (LAD) and behind (posterior descending artery), mm.
  Eigen::Vector2d frontGroove = Eigen::Vector2d::Zero();
  Eigen::Vector2d backGroove = Eigen::Vector2d::Zero();
  ///@}
  double rightWidth = 54.0; ///< mm from the septum's plane to where the RCA is farthest out
  Vector3 leftOstium = Vector3::Zero();
  Vector3 rightOstium = Vector3::Zero();

  ///@{
  /// One standard deviation.
  double axisDeviation = 0.0;   ///< radians, of the long axis' direction
  double baseDeviation = 0.0;   ///< mm along the long axis
  double lengthDeviation = 0.0; ///< mm
  ///@}

  std::vector<std::string>
    from; ///< one sentence a landmark: what of the patient it was taken from, or that it was not

  /// mm to the right of the septum's plane, negative to its left. @param q  heart coordinates
  double SeptumDistance(const Vector3& q) const;

  /// 0 on the septum and left of it, 1 at the right margin. @param q  heart coordinates
  double RightShare(const Vector3& q) const;

  Vector3 ToHeart(const Vector3& world) const { return this->axes * (world - this->base); }
};

/**
 * @param tree   with the points' segments, or else those of the branches; branches that are not named (grafts, veins)
 *               count for nothing
 * @param named  where the names' fit says that the heart is
 * @throws std::invalid_argument: no LAD, LCx and RCA among the names; axes that are no rotation, or mirrored; a heart
 * smaller than half or larger than twice the mean one; named vessels that lie where no heart has them
 */
PatientHeart EstimateHeart(const VesselTree& tree, const HeartPose& named);
}

#endif
