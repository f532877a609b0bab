/**
 * @file WeightTransfer.h
 * @brief Skin weights of one mesh at the points of another one.
 */
#ifndef DynamicCoronary_WeightTransfer_h
#define DynamicCoronary_WeightTransfer_h

#include "BiharmonicSkinWeights.h"
#include "TetrahedronQuality.h"

#include <vector>

namespace coronary
{
/**
 * Linear within each tetrahedron; outside of all, those of the nearest place on the boundary. A mesh with these weights
 * moves as the first one does, up to how coarse either is.
 * @param weights     of `points`
 * @param influences  of the result, 1 to 64
 * @throws std::invalid_argument  no tetrahedra, an index that does not exist, weights of another number of points; Cancelled
 */
CompactSkinWeights TransferWeights(const std::vector<Vector3>& points,
  const std::vector<Tetrahedron>& tetrahedra, const CompactSkinWeights& weights,
  const std::vector<Vector3>& places, int influences = 8, const ProgressCallback& progress = {});
}

#endif
