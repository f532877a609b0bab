/**
 * @file BeatingModel.h
 * @brief A mesh that beats: where its points are and how fast they move, at any moment of the cycle.
 */
#ifndef DynamicCoronary_BeatingModel_h
#define DynamicCoronary_BeatingModel_h

#include "PhaseInterpolation.h"
#include "PoseSequence.h"
#include "SkinDeformation.h"

#include <vector>

namespace coronary
{
/// An interpolated pose of a skeleton. Allocates nothing once `moving` has been used before.
/// @param cycle  seconds: derivatives are by the cycle there, by the second here
void MovingPoseOf(const InterpolatedPose& pose, double cycle, MovingSkeletonPose& moving);

struct BeatingModelSettings
{
  PhaseInterpolationSettings interpolation;
  SkinDeformationSettings deformation;
  double volumeConservation = 0.0; ///< SkeletonRig::ConserveVolume, 0 to 1
  double cycle = 1.0;              ///< seconds, greater than 0; of velocities
};

/**
 * Skeleton, mesh at rest with its weights, and poses of the skeleton over a cycle: interpolated in time, then skinned.
 * Velocities are the exact derivatives of the positions by time.
 *
 * Everything is set up once; a moment then takes one pass over the points, without allocation. Not to be called from
 * two threads at once: an object holds the moment that it is at work on. The same input gives the same bits on any
 * number of threads.
 */
class BeatingModel
{
public:
  /**
   * @param points    at rest, mm
   * @param weights   of as many points
   * @param skeleton  at rest, that the weights were made for
   * @param poses     its joints at phases; calibre (of joints) and rotations (of bones) are used if there
   * @throws std::invalid_argument: as PhaseInterpolation and SkinDeformation; poses of another number of joints or
   *         bones; a setting out of range
   */
  BeatingModel(const std::vector<Vector3>& points, const CompactSkinWeights& weights,
    const Skeleton& skeleton, const PoseSequence& poses, const BeatingModelSettings& settings = {});

  std::int64_t NumberOfPoints() const { return this->Skin.NumberOfPoints(); }

  ///@{
  /**
   * x, y, z of each point after each other, mm and mm/s.
   * @param time  fraction of the cycle, modulo 1
   * @throws std::invalid_argument  it is not finite
   */
  void Positions(double time, double* positions);
  void Motion(double time, double* positions, double* velocities);
  ///@}

private:
  void SetTime(double time);

  PhaseInterpolation Interpolation;
  SkinDeformation Skin;
  double Cycle;
  InterpolatedPose Interpolated;
  MovingSkeletonPose Moving;
  SkeletonPose Now;
};
}

#endif
