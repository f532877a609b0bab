/**
 * @file LibiglSkinWeights.h
 * @brief Bounded biharmonic weights by libigl, which the benchmark compares with.
 */
#ifndef DynamicCoronary_LibiglSkinWeights_h
#define DynamicCoronary_LibiglSkinWeights_h

#include "BiharmonicSkinWeights.h"

#include <Eigen/Core>

namespace coronary
{
/**
 * igl::bbw with its default active set, each bone by itself; rows are not divided by their sums.
 * @param fixed   points of the mesh on bones
 * @param values  fixed points x bones
 */
Eigen::MatrixXd LibiglSkinWeights(const SkinWeightInput& input,
  const std::vector<std::int64_t>& fixed, const Eigen::MatrixXd& values, int iterations);
}

#endif
