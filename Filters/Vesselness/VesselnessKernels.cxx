// The inner loops of the vesselness. Compiled once for each set of vector instructions, so it may
// include nothing that emits shared inline functions: the linker could keep the widest of them.

#include "VesselnessKernels.h"

#include <cstdint>

// A function that stayed a call would keep the loop around it from becoming vector code.
#define INLINE __attribute__((always_inline)) inline

namespace coronary
{
namespace
{
/// As many floats as a register holds.
#if defined(__AVX512F__)
constexpr int PackBytes = 64;
#elif defined(__AVX2__)
constexpr int PackBytes = 32;
#else
constexpr int PackBytes = 16;
#endif
constexpr int PackLanes = PackBytes / static_cast<int>(sizeof(float));
using Pack [[gnu::vector_size(PackBytes)]] = float;
using LoosePack [[gnu::vector_size(PackBytes), gnu::aligned(4), gnu::may_alias]] = float;

INLINE void Store(float* to, const Pack& pack)
{
  *reinterpret_cast<LoosePack*>(to) = pack;
}

// The second derivative is taken of the differences from the centre: the same, as its kernel sums to
// zero, but a constant gives exactly zero.

/// One block of `Packs` registers, from x on; out[n] = derivative n across the rows, n < Orders.
template <int Orders, int Packs>
INLINE void AcrossBlock(
  const float* const* rows, int radius, const float* const* kernels, int x, float* const* out)
{
  Pack sums[Orders][Packs];
  Pack twice[Packs];
  for (int p = 0; p < Packs; ++p)
  {
    const Pack centre = *reinterpret_cast<const LoosePack*>(rows[radius] + x + p * PackLanes);
    twice[p] = centre + centre;
    for (int order = 0; order < Orders; ++order)
    {
      sums[order][p] = order == 0 ? kernels[0][0] * centre : Pack{};
    }
  }
  for (int t = 1; t <= radius; ++t)
  {
    for (int p = 0; p < Packs; ++p)
    {
      const int at = x + p * PackLanes;
      const Pack plus = *reinterpret_cast<const LoosePack*>(rows[radius + t] + at);
      const Pack minus = *reinterpret_cast<const LoosePack*>(rows[radius - t] + at);
      const Pack even = plus + minus;
      for (int order = 0; order < Orders; ++order)
      {
        sums[order][p] += kernels[order][t] *
          (order == 0      ? even
              : order == 1 ? plus - minus
                           : even - twice[p]);
      }
    }
  }
  for (int order = 0; order < Orders; ++order)
  {
    for (int p = 0; p < Packs; ++p)
    {
      Store(out[order] + x + p * PackLanes, sums[order][p]);
    }
  }
}

template <int Orders>
INLINE void Across(
  const float* const* rows, int radius, const float* const* kernels, int width, float* const* out)
{
  // Two registers a sum hide the latency of the additions; the same operations a voxel either way.
  constexpr int Packs = PackLanes == 4 && Orders == 3 ? 1 : 2;
  int x = 0;
  for (; x + Packs * PackLanes <= width; x += Packs * PackLanes)
  {
    AcrossBlock<Orders, Packs>(rows, radius, kernels, x, out);
  }
  for (; x < width; x += PackLanes)
  {
    AcrossBlock<Orders, 1>(rows, radius, kernels, x, out);
  }
}

template <int Order, int Packs>
INLINE void AlongBlock(const float* centre, int radius, const float* kernel, float* out)
{
  Pack sums[Packs];
  Pack twice[Packs];
  for (int p = 0; p < Packs; ++p)
  {
    const Pack middle = *reinterpret_cast<const LoosePack*>(centre + p * PackLanes);
    twice[p] = middle + middle;
    sums[p] = Order == 0 ? kernel[0] * middle : Pack{};
  }
  for (int t = 1; t <= radius; ++t)
  {
    for (int p = 0; p < Packs; ++p)
    {
      const Pack plus = *reinterpret_cast<const LoosePack*>(centre + p * PackLanes + t);
      const Pack minus = *reinterpret_cast<const LoosePack*>(centre + p * PackLanes - t);
      sums[p] += kernel[t] *
        (Order == 0      ? plus + minus
            : Order == 1 ? plus - minus
                         : plus + minus - twice[p]);
    }
  }
  for (int p = 0; p < Packs; ++p)
  {
    Store(out + p * PackLanes, sums[p]);
  }
}

template <int Order>
INLINE void Along(const float* in, int radius, const float* kernel, int width, float* out)
{
  int x = 0;
  for (; x + 4 * PackLanes <= width; x += 4 * PackLanes)
  {
    AlongBlock<Order, 4>(in + radius + x, radius, kernel, out + x);
  }
  for (; x < width; x += PackLanes)
  {
    AlongBlock<Order, 1>(in + radius + x, radius, kernel, out + x);
  }
}

void FilterAcross(const float* const* rows, int radius, const float* const* kernels, int orders,
  int width, float* const* out)
{
  switch (orders)
  {
    case 1:
      Across<1>(rows, radius, kernels, width, out);
      break;
    case 2:
      Across<2>(rows, radius, kernels, width, out);
      break;
    default:
      Across<3>(rows, radius, kernels, width, out);
  }
}

void FilterAlong(const float* in, int radius, const float* kernel, int order, int width, float* out)
{
  switch (order)
  {
    case 0:
      Along<0>(in, radius, kernel, width, out);
      break;
    case 1:
      Along<1>(in, radius, kernel, width, out);
      break;
    default:
      Along<2>(in, radius, kernel, width, out);
  }
}

/// Eigenvalues by the trigonometric formula, ascending; exact to about 1e-4 of the norm.
INLINE void Eigenvalues(float xx, float yy, float zz, float xy, float xz, float yz, float& low,
  float& middle, float& high)
{
  const float mean = (xx + yy + zz) * (1.0f / 3.0f);
  const float a = xx - mean;
  const float b = yy - mean;
  const float c = zz - mean;
  const float off = xy * xy + xz * xz + yz * yz;
  const float p = __builtin_sqrtf((a * a + b * b + c * c + 2.0f * off) * (1.0f / 6.0f)) + 1e-20f;
  const float inverse = 1.0f / p;
  const float na = a * inverse;
  const float nb = b * inverse;
  const float nc = c * inverse;
  const float nxy = xy * inverse;
  const float nxz = xz * inverse;
  const float nyz = yz * inverse;
  float r = 0.5f *
    (na * (nb * nc - nyz * nyz) - nxy * (nxy * nc - nyz * nxz) + nxz * (nxy * nyz - nb * nxz));
  r = r < -1.0f ? -1.0f : (r > 1.0f ? 1.0f : r);
  // acos: Abramowitz and Stegun 4.4.46, error 2e-8.
  const float m = __builtin_fabsf(r);
  float angle = -0.0012624911f;
  angle = angle * m + 0.0066700901f;
  angle = angle * m - 0.0170881256f;
  angle = angle * m + 0.0308918810f;
  angle = angle * m - 0.0501743046f;
  angle = angle * m + 0.0889789874f;
  angle = angle * m - 0.2145988016f;
  angle = angle * m + 1.5707963050f;
  angle *= __builtin_sqrtf(1.0f - m);
  angle = 1.57079633f - __builtin_copysignf(1.57079633f - angle, r);
  const float f = angle * (1.0f / 3.0f);
  // Taylor series on [0, pi/3]: error below 1e-7.
  const float f2 = f * f;
  const float cosine = 1.0f +
    f2 *
      (-0.5f +
        f2 * (4.16666667e-2f + f2 * (-1.38888889e-3f + f2 * (2.48015873e-5f - f2 * 2.7557e-7f))));
  const float sine = f *
    (1.0f +
      f2 * (-1.66666667e-1f + f2 * (8.33333333e-3f + f2 * (-1.98412698e-4f + f2 * 2.7557e-6f))));
  high = mean + 2.0f * p * cosine;
  low = mean - p * (cosine + 1.73205081f * sine);
  middle = mean - p * (cosine - 1.73205081f * sine);
}

/// exp(-x) for x >= 0, relative error 3e-7.
INLINE float ExpMinus(float x)
{
  x = x < 80.0f ? x : 80.0f; // a NaN too

  const float y = -1.44269504f * x;
  // One below the truncated value: f lies in (0, 1], and needs no floor().
  const std::int32_t whole = static_cast<std::int32_t>(y) - 1;
  const float f = y - static_cast<float>(whole);
  float p = 1.5353362e-4f;
  p = p * f + 1.3398874e-3f;
  p = p * f + 9.6184373e-3f;
  p = p * f + 5.5503324e-2f;
  p = p * f + 2.4022648e-1f;
  p = p * f + 6.9314720e-1f;
  p = p * f + 1.0f;
  const std::int32_t bits = (whole + 127) << 23;
  float power;
  __builtin_memcpy(&power, &bits, sizeof(power));
  return p * power;
}

/// Any voxel of the block whose two strongest eigenvalues can both be negative?
INLINE bool AnyNegativeTrace(const HessianRow& h, int x, float sign)
{
  int negative = 0;
  for (int i = x; i < x + VesselnessLanes; ++i)
  {
    negative += sign * (h.xx[i] + h.yy[i] + h.zz[i]) < 0.0f ? 1 : 0;
  }
  return negative > 0;
}

void FrangiRow(const HessianRow& h, const RowParameters& parameters, int width, float* result)
{
  for (int x = 0; x < width; x += VesselnessLanes)
  {
    if (!AnyNegativeTrace(h, x, parameters.sign))
    {
      __builtin_memset(result + x, 0, VesselnessLanes * sizeof(float));
      continue;
    }
    // In steps over small arrays: as one loop the compiler moves work behind the final condition,
    // and no vector code comes of it.
    float plate[VesselnessLanes];
    float blob[VesselnessLanes];
    float structure[VesselnessLanes];
    float vessel[VesselnessLanes];
    for (int i = 0; i < VesselnessLanes; ++i)
    {
      const float s = parameters.sign;
      const float xx = s * h.xx[x + i];
      const float yy = s * h.yy[x + i];
      const float zz = s * h.zz[x + i];
      const float xy = s * h.xy[x + i];
      const float xz = s * h.xz[x + i];
      const float yz = s * h.yz[x + i];
      float l3;
      float l2;
      float l1;
      Eigenvalues(xx, yy, zz, xy, xz, yz, l3, l2, l1);
      const float norm = xx * xx + yy * yy + zz * zz + 2.0f * (xy * xy + xz * xz + yz * yz);
      // Both strong curvatures negative: l1 may be positive, but weaker than l2.
      vessel[i] = l2 + (l1 > 0.0f ? l1 : 0.0f);
      const float safe2 = l2 < -1e-15f ? l2 : -1e-15f;
      const float safe3 = l3 < -1e-15f ? l3 : -1e-15f;
      const float ra = safe2 / safe3;
      plate[i] = ra * ra * parameters.halfAlpha;
      blob[i] = l1 * l1 / (safe2 * safe3) * parameters.halfBeta;
      structure[i] = norm * parameters.halfC;
    }
    for (int i = 0; i < VesselnessLanes; ++i)
    {
      plate[i] = 1.0f - ExpMinus(plate[i]);
      structure[i] = 1.0f - ExpMinus(structure[i]);
      blob[i] = ExpMinus(blob[i]);
    }
    for (int i = 0; i < VesselnessLanes; ++i)
    {
      const float value = plate[i] * blob[i] * structure[i];
      // Less is rounding, not structure.
      result[x + i] = vessel[i] <= 0.0f && value > 1e-6f ? value : 0.0f;
    }
  }
}

/// Sato: sqrt(-l3) sqrt(-l2) weakened where l1 is far from 0. In HU.
void SatoRow(const HessianRow& h, float sign, float alpha, int width, float* result)
{
  for (int x = 0; x < width; x += VesselnessLanes)
  {
    if (!AnyNegativeTrace(h, x, sign))
    {
      __builtin_memset(result + x, 0, VesselnessLanes * sizeof(float));
      continue;
    }
    for (int i = x; i < x + VesselnessLanes; ++i)
    {
      float l3;
      float l2;
      float l1;
      Eigenvalues(sign * h.xx[i], sign * h.yy[i], sign * h.zz[i], sign * h.xy[i], sign * h.xz[i],
        sign * h.yz[i], l3, l2, l1);
      const float a = l2 < 0.0f ? -l2 : 0.0f;
      // l1 <= 0: linear fall; l1 > 0: only up to |l2| / alpha.
      const float b = l1 > 0.0f ? a - alpha * l1 : a + l1;
      const float weight = (b > 0.0f ? b : 0.0f);
      const float lines = __builtin_sqrtf(a * (l3 < 0.0f ? -l3 : 0.0f));
      const float ratio = weight / (a + 1e-20f);
      result[i] = l1 <= -l2 ? lines * (ratio > 1.0f ? 1.0f : ratio) : 0.0f;
    }
  }
}

/// Jerman 2016, Eq. 13-15.
void JermanRow(const HessianRow& h, float sign, float cutoff, int width, float* result)
{
  for (int x = 0; x < width; x += VesselnessLanes)
  {
    if (!AnyNegativeTrace(h, x, sign))
    {
      __builtin_memset(result + x, 0, VesselnessLanes * sizeof(float));
      continue;
    }
    for (int i = x; i < x + VesselnessLanes; ++i)
    {
      float low;
      float middle;
      float high;
      Eigenvalues(sign * h.xx[i], sign * h.yy[i], sign * h.zz[i], sign * h.xy[i], sign * h.xz[i],
        sign * h.yz[i], low, middle, high);
      const bool vessel = (middle < 0.0f) & (high <= -middle);
      const float l2 = -middle;
      const float l3 = -low;
      const float rho = l3 > cutoff ? l3 : (l3 > 0.0f ? cutoff : 0.0f);
      const float sum = l2 + rho;
      const float third = 3.0f / (sum > 1e-20f ? sum : 1.0f);
      float value = l2 * l2 * (rho - l2) * third * third * third;
      value = l2 >= 0.5f * rho ? 1.0f : value;
      result[i] = (vessel & (rho > 0.0f)) ? value : 0.0f;
    }
  }
}

void SquaredNorm(const HessianRow& h, int width, float* result)
{
  for (int i = 0; i < width; ++i)
  {
    result[i] = h.xx[i] * h.xx[i] + h.yy[i] * h.yy[i] + h.zz[i] * h.zz[i] +
      2.0f * (h.xy[i] * h.xy[i] + h.xz[i] * h.xz[i] + h.yz[i] * h.yz[i]);
  }
}

/// Positive where the strongest negative curvature is that of a vessel.
void Lambda3(const HessianRow& h, float sign, int width, float* result)
{
  for (int i = 0; i < width; ++i)
  {
    float low;
    float middle;
    float high;
    Eigenvalues(sign * h.xx[i], sign * h.yy[i], sign * h.zz[i], sign * h.xy[i], sign * h.xz[i],
      sign * h.yz[i], low, middle, high);
    result[i] = -low;
  }
}
}

#if defined(__AVX512F__)
const VesselnessKernels VesselnessKernelsAvx512
{
#elif defined(__AVX2__)
const VesselnessKernels VesselnessKernelsAvx2
{
#else
const VesselnessKernels VesselnessKernelsBaseline{
#endif
  FilterAcross, FilterAlong, FrangiRow, SatoRow, JermanRow, SquaredNorm, Lambda3
};
}
