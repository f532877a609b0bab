// Inner loop of TriangleBvh, once for each generation of processors.
#ifndef DynamicCoronary_TriangleBvhKernels_h
#define DynamicCoronary_TriangleBvhKernels_h

#include <cstdint>

namespace coronary
{
template <typename Kernels>
class KernelChoice;

constexpr int BvhWidth = 8;
constexpr int BvhLeafSize = 4;

/// Boxes of the children, relative to the tree's centre. A missing child's box is empty.
struct alignas(64) BvhNode
{
  float low[3][BvhWidth];
  float high[3][BvhWidth];
  std::int32_t child[BvhWidth]; ///< node, or ~leaf
  std::int32_t unused[BvhWidth];
};

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
  const BvhNode* nodes;
  const BvhLeaf* leaves;
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
