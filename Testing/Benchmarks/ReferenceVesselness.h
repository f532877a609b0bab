/**
 * @file ReferenceVesselness.h
 * @brief Eq. 1 and 2 of the paper computed plainly in double precision, as the judge of others.
 */
#ifndef DynamicCoronary_ReferenceVesselness_h
#define DynamicCoronary_ReferenceVesselness_h

#include "MultiscaleVesselness.h"

namespace coronary
{
/**
 * Frangi's vesselness of the whole block. Gaussians and their derivatives are sampled, neither
 * shortened below eight standard deviations nor corrected; eigenvalues by Eigen's iterative solver.
 * @param settings  method Frangi
 * @param spacing   mm
 */
std::vector<float> ReferenceFrangi(
  const VoxelBlock& block, const Vector3& spacing, const VesselnessSettings& settings);
}

#endif
