// Inner loop of TriangleBvh, once for each generation of processors.
#ifndef DynamicCoronary_TriangleBvhKernels_h
#define DynamicCoronary_TriangleBvhKernels_h

#include "BoxNode.h"

#include <cstdint>

namespace coronary
{
template <typename Kernels>
class KernelChoice;

constexpr int BvhLeafSize = 4;

/// Corner a and edges b - a, c - a; a leaf that is not full has its last triangle several times.
struct alignas(64) BvhLeaf
{
  double a[3][BvhLeafSize];
  double ab[3][BvhLeafSize];
  double ac[3][BvhLeafSize];
  std::int32_t triangle[BvhLeafSize];
};

struct BvhQuery
{
  const BoxNode* nodes;
  const BvhLeaf* leaves;
  std::int32_t firstLeaf; ///< its place in the tree
  double point[3];
  float low[3]; ///< the point relative to the tree's centre, rounded down and up
  float high[3];
  double squaredDistance; ///< in: bound; out: of the nearest triangle
  std::int32_t triangle;  ///< in: -1; out: the one of the lowest number if several are as near
};

struct BvhKernels
{
  void (*closest)(BvhQuery& query);
};

/// Which set runs, in the whole process.
KernelChoice<BvhKernels>& BvhKernelChoice();

extern const BvhKernels BvhKernelsBaseline;
extern const BvhKernels BvhKernelsAvx2;
}

#endif
