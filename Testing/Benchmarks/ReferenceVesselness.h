/**
 * @file ReferenceVesselness.h
 * @brief Eq. 1 and 2 of the paper computed plainly in double precision, as the judge of others.
 */
#ifndef DynamicCoronary_ReferenceVesselness_h
#define DynamicCoronary_ReferenceVesselness_h

#include "MultiscaleVesselness.h"

namespace coronary
{
struct ReferenceResult
{
  std::vector<float> vesselness;
  /// 1: at some scale the vesselness jumps if the eigenvalues change by 1 % of the strongest. It
  /// does so between |l1| < |l2|, the weakest positive, and |l1| > |l2|, where it is 0.
  std::vector<unsigned char> atJump;
};

/**
 * Frangi's vesselness of the whole block. Gaussians and their derivatives are sampled, neither
 * shortened below eight standard deviations nor corrected; eigenvalues by Eigen's iterative solver.
 * @param settings  method Frangi
 * @param spacing   mm
 */
ReferenceResult ReferenceFrangi(
  const VoxelBlock& block, const Vector3& spacing, const VesselnessSettings& settings);
}

#endif
