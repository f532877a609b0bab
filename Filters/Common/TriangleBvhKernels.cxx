// Compiled once for the baseline processor and, by TriangleBvhKernelsAvx2.cxx, once more.
#include "TriangleBvhKernels.h"

#include <cstring>

#if defined(__AVX2__)
#include <immintrin.h>
#define CORONARY_BVH_KERNELS BvhKernelsAvx2
#else
#define CORONARY_BVH_KERNELS BvhKernelsBaseline
#endif

namespace coronary
{
namespace
{
using Floats = float __attribute__((vector_size(sizeof(float) * BoxNode::Width)));
using Doubles = double __attribute__((vector_size(sizeof(double) * BvhLeafSize)));

// Never more than seven siblings wait on each of the at most eleven levels above a leaf.
constexpr int StackSize = 96;

// Squares of the boxes' distances are computed in single precision: no more wrong than by this.
constexpr float Slack = 1.0F + 2e-6F;

struct Waiting
{
  float distance;
  std::int32_t place;
};

/// Of the four triangles of a leaf.
inline void VisitLeaf(BvhQuery& query, const BvhLeaf& leaf)
{
  const auto load = [](const double* from, Doubles& to) { std::memcpy(&to, from, sizeof(to)); };
  Doubles ab[3];
  Doubles ac[3];
  Doubles ap[3];
  for (int k = 0; k < 3; ++k)
  {
    load(leaf.ab[k], ab[k]);
    load(leaf.ac[k], ac[k]);
    Doubles a;
    load(leaf.a[k], a);
    ap[k] = query.point[k] - a;
  }
  const Doubles d1 = ab[0] * ap[0] + ab[1] * ap[1] + ab[2] * ap[2];
  const Doubles d2 = ac[0] * ap[0] + ac[1] * ap[1] + ac[2] * ap[2];
  const Doubles aa = ab[0] * ab[0] + ab[1] * ab[1] + ab[2] * ab[2];
  const Doubles bb = ac[0] * ac[0] + ac[1] * ac[1] + ac[2] * ac[2];
  const Doubles mixed = ab[0] * ac[0] + ab[1] * ac[1] + ab[2] * ac[2];
  const Doubles zero = {};
  const Doubles one = zero + 1.0;

  // The point a + v ab + w ac that is nearest on each edge and in the plane. What is compared is the
  // squared distance less |ap|^2. A division by zero gives a NaN, which fails the comparisons.
  Doubles t = d1 / aa;
  t = t > zero ? t : zero;
  t = t < one ? t : one;
  Doubles v = t;
  Doubles w = zero;
  Doubles best = t * (t * aa - 2.0 * d1);

  t = d2 / bb;
  t = t > zero ? t : zero;
  t = t < one ? t : one;
  Doubles other = t * (t * bb - 2.0 * d2);
  auto nearer = other < best;
  best = nearer ? other : best;
  v = nearer ? zero : v;
  w = nearer ? t : w;

  const Doubles cc = aa + bb - 2.0 * mixed;
  const Doubles d3 = d2 - d1 - mixed + aa;
  t = d3 / cc;
  t = t > zero ? t : zero;
  t = t < one ? t : one;
  other = aa - 2.0 * d1 + t * (t * cc - 2.0 * d3);
  nearer = other < best;
  best = nearer ? other : best;
  v = nearer ? one - t : v;
  w = nearer ? t : w;

  const Doubles determinant = aa * bb - mixed * mixed;
  const Doubles planeV = (bb * d1 - mixed * d2) / determinant;
  const Doubles planeW = (aa * d2 - mixed * d1) / determinant;
  other =
    planeV * (planeV * aa + 2.0 * planeW * mixed - 2.0 * d1) + planeW * (planeW * bb - 2.0 * d2);
  nearer = (planeV > zero) & (planeW > zero) & (planeV + planeW < one) & (other < best);
  v = nearer ? planeV : v;
  w = nearer ? planeW : w;

  Doubles squared = zero;
  for (int k = 0; k < 3; ++k)
  {
    const Doubles difference = ap[k] - v * ab[k] - w * ac[k];
    squared += difference * difference;
  }
  for (int lane = 0; lane < BvhLeafSize; ++lane)
  {
    const double distance = squared[lane];
    if (distance < query.squaredDistance ||
      (distance == query.squaredDistance &&
        (query.triangle < 0 || leaf.triangle[lane] < query.triangle)))
    {
      query.squaredDistance = distance;
      query.triangle = leaf.triangle[lane];
    }
  }
}

void Closest(BvhQuery& query)
{
  const auto toFloat = [](double bound)
  {
    constexpr double maximum = 3.4028234663852886e38;
    return bound < maximum / Slack ? static_cast<float>(bound) * Slack + 1e-44F
                                   : static_cast<float>(maximum);
  };
  float bound = toFloat(query.squaredDistance);
  Waiting stack[StackSize];
  int waiting = 0;
  std::int32_t current = 0;
  for (;;)
  {
    if (current >= query.firstLeaf)
    {
      VisitLeaf(query, query.leaves[current - query.firstLeaf]);
      bound = toFloat(query.squaredDistance);
    }
    else
    {
      const BoxNode& node = query.nodes[current];
      Floats squared = Floats{} + 0.0F;
      for (int k = 0; k < 3; ++k)
      {
        Floats low;
        Floats high;
        std::memcpy(&low, node.low[k], sizeof(low));
        std::memcpy(&high, node.high[k], sizeof(high));
        const Floats below = low - query.high[k];
        const Floats above = query.low[k] - high;
        Floats outside = below > above ? below : above;
        const Floats zero = Floats{};
        outside = outside > zero ? outside : zero;
        squared += outside * outside;
      }
      alignas(32) float distance[BoxNode::Width];
      std::memcpy(distance, &squared, sizeof(squared));
      // Nearest on top of the stack.
      const int base = waiting;
      const auto push = [&](int lane)
      {
        int place = waiting++;
        const Waiting entry{ distance[lane], BoxNode::Width * current + 1 + lane };
        while (place > base && stack[place - 1].distance < entry.distance)
        {
          stack[place] = stack[place - 1];
          --place;
        }
        stack[place] = entry;
      };
#if defined(__AVX2__)
      unsigned int near = static_cast<unsigned int>(_mm256_movemask_ps(
        _mm256_cmp_ps(_mm256_load_ps(distance), _mm256_set1_ps(bound), _CMP_LE_OQ)));
      for (; near != 0; near &= near - 1)
      {
        push(__builtin_ctz(near));
      }
#else
      for (int lane = 0; lane < BoxNode::Width; ++lane)
      {
        if (distance[lane] <= bound)
        {
          push(lane);
        }
      }
#endif
    }
    do
    {
      if (waiting == 0)
      {
        return;
      }
      --waiting;
    } while (stack[waiting].distance > bound);
    current = stack[waiting].place;
  }
}
}

const BvhKernels CORONARY_BVH_KERNELS = { Closest };
}
