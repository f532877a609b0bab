// Compiled once for the baseline processor and, by XRayKernelsAvx2.cxx, once more. Products and sums are not
// contracted, so that both give the same bits.
#include "XRayKernels.h"

#include <cmath>
#include <cstring>
#include <initializer_list>

#if defined(__AVX2__)
#include <immintrin.h>
#define CORONARY_XRAY_KERNELS XRayKernelsAvx2
#else
#define CORONARY_XRAY_KERNELS XRayKernelsBaseline
#endif

namespace coronary
{
namespace
{
constexpr int Lanes = XRayLanes;
using Floats = float __attribute__((vector_size(sizeof(float) * Lanes)));
using Integers = std::int32_t __attribute__((vector_size(sizeof(std::int32_t) * Lanes)));

inline Floats Load(const float* from)
{
  Floats to;
  std::memcpy(&to, from, sizeof(to));
  return to;
}

inline Floats Same(float value)
{
  return Floats{} + value;
}

inline Floats Clamped(Floats x, Floats low, Floats high)
{
  x = x > low ? x : low;
  return x < high ? x : high;
}

inline Floats Absolute(Floats x)
{
  return x > 0.0F ? x : -x;
}

inline Floats SquareRoot(Floats x)
{
#if defined(__AVX2__)
  return (Floats)_mm256_sqrt_ps((__m256)x);
#else
  Floats root;
  for (int l = 0; l < Lanes; ++l)
  {
    root[l] = std::sqrt(x[l]);
  }
  return root;
#endif
}

/// Of each lane's place the voxel and the next one.
inline void LoadPairs(const std::uint16_t* voxels, Integers place, Floats& voxel, Floats& next)
{
#if defined(__AVX2__)
  const Integers pair =
    (Integers)_mm256_i32gather_epi32(reinterpret_cast<const int*>(voxels), (__m256i)place, 2);
  const Integers low = pair & 0xffff;
  const Integers high = (Integers)_mm256_srli_epi32((__m256i)pair, 16);
#else
  Integers low;
  Integers high;
  for (int l = 0; l < Lanes; ++l)
  {
    low[l] = voxels[place[l]];
    high[l] = voxels[place[l] + 1];
  }
#endif
  voxel = __builtin_convertvector(low, Floats);
  next = __builtin_convertvector(high, Floats);
}

void SumSlices(
  const SliceVolume& volume, const SliceRun* runs, int numberOfRuns, SlicePacket& packet)
{
  const Floats startU = Load(packet.startU);
  const Floats startV = Load(packet.startV);
  const Floats slopeU = Load(packet.slopeU);
  const Floats slopeV = Load(packet.slopeV);
  const Floats firstSlice = Load(packet.firstSlice);
  const Floats lastSlice = Load(packet.lastSlice);
  const Floats zero = {};
  const Floats maximumU = Same(volume.maximumU);
  const Floats maximumV = Same(volume.maximumV);
  Floats sum = Load(packet.sum);
  for (int run = 0; run < numberOfRuns; ++run)
  {
    const std::uint16_t* slice = volume.voxels + runs[run].first * volume.sliceStride;
    for (int k = runs[run].first; k < runs[run].last; ++k, slice += volume.sliceStride)
    {
      const Floats from = Same(static_cast<float>(k - volume.middle));
      // Beside the volume is its border, which is 0.
      const Floats u = Clamped(startU + slopeU * from, zero, maximumU);
      const Floats v = Clamped(startV + slopeV * from, zero, maximumV);
      const Integers column = __builtin_convertvector(u, Integers);
      const Integers row = __builtin_convertvector(v, Integers);
      const Floats restU = u - __builtin_convertvector(column, Floats);
      const Floats restV = v - __builtin_convertvector(row, Floats);
      const Integers place = row * volume.rowStride + column;
      Floats a;
      Floats b;
      Floats c;
      Floats d;
      LoadPairs(slice, place, a, b);
      LoadPairs(slice + volume.rowStride, place, c, d);
      const Floats low = a + restU * (b - a);
      const Floats high = c + restU * (d - c);
      const Floats value = low + restV * (high - low);
      const Floats at = Same(static_cast<float>(k));
      sum += (at >= firstSlice) & (at <= lastSlice) ? value : zero;
    }
  }
  std::memcpy(packet.sum, &sum, sizeof(sum));
}

inline Floats At(const PixelPlane& plane, Floats i, Floats j)
{
  return (plane.a + plane.c * j) + plane.b * i;
}

/// Integral of 2 sqrt(1 - x^2) from 0 to u, 0 <= |u| <= 1, within 5e-8: near 1 it lacks (1 - x)^1.5 times something
/// smooth, here the polynomial through the exact values at seven Chebyshev points.
inline Floats CircleIntegral(Floats u)
{
  const Floats x = Absolute(u);
  Floats sum = Same(-0.00053524009F);
  for (const float coefficient : { 0.00284384443F, -0.00801726824F, 0.01903146790F, -0.05469166141F,
         0.35619054952F, 1.57079636674F })
  {
    sum = sum * x + coefficient;
  }
  const Floats rest = 1.0F - x;
  const Floats integral = 1.5707963268F - rest * SquareRoot(rest) * sum;
  return u < 0.0F ? -integral : integral;
}

/// Mean, over a pixel, of the way through a circle at a distance from its centre.
inline Floats MeanChord(Floats radius, Floats distance, Floats pixel)
{
  const Floats one = Same(1.0F);
  const Floats minimum = 0.01F * radius;
  const Floats width = pixel > minimum ? pixel : minimum;
  const Floats inverse = 1.0F / (radius * width);
  const Floats scale = inverse * width;
  const Floats high = Clamped((distance + 0.5F * width) * scale, -one, one);
  const Floats low = Clamped((distance - 0.5F * width) * scale, -one, one);
  return radius * radius * radius * inverse * (CircleIntegral(high) - CircleIntegral(low));
}

constexpr float GaussPoint = 0.28867513F; // of an interval's length, from its middle

template <bool Hollow>
inline Floats TubeValue(const TubePart& part, Floats i, Floats j)
{
  const Floats zero = {};
  const Floats one = Same(1.0F);
  Floats squaredRay = zero;
  Floats squaredCross = zero;
  Floats mixed = zero;
  for (int k = 0; k < 3; ++k)
  {
    const Floats d = At(part.ray[k], i, j);
    const Floats c = At(part.cross[k], i, j);
    squaredRay += d * d;
    squaredCross += c * c;
    mixed += c * At(part.along[k], i, j);
  }
  // A ray along the axis has no place that is nearest; from 0.06 degrees on nothing changes any more.
  const Floats minimum = 1e-6F * squaredRay;
  squaredCross = squaredCross > minimum ? squaredCross : minimum;
  const Floats inverseCross = 1.0F / SquareRoot(squaredCross);
  const Floats inverseRay = 1.0F / SquareRoot(squaredRay);
  const Floats inverseSine = inverseCross * squaredRay * inverseRay;
  const Floats distance = At(part.moment, i, j) * inverseCross;
  const Floats place = mixed * inverseCross * inverseCross;
  Floats pixel = part.step * inverseCross;
  pixel = pixel < part.maximumPixel ? pixel : Same(part.maximumPixel);

  const Floats fraction = Clamped(place * part.inverseLength, zero, one);
  const Floats outer = part.outer[0] + fraction * (part.outer[1] - part.outer[0]);
  const Floats outerChord = MeanChord(outer, distance, pixel) * inverseSine;
  Floats chord = outerChord;
  if (Hollow)
  {
    const Floats inner = part.inner[0] + fraction * (part.inner[1] - part.inner[0]);
    chord -= MeanChord(inner, distance, pixel) * inverseSine;
  }

  // A chord that goes through a cut is on both its sides; so is a pixel: what is before the cut is a ramp over
  // the longer of the two, mean over the shorter one by Gauss's two points.
  Floats share = -one;
  const Floats toCut[2] = { place, part.length - place };
  const Floats ofPixel = pixel * inverseSine;
  for (int end = 0; end < 2; ++end)
  {
    const Floats tilt = distance * inverseCross * At(part.crossCut[end], i, j);
    const Floats from = end == 0 ? toCut[0] + tilt : toCut[1] - tilt;
    const Floats ofChord = outerChord * inverseRay * Absolute(At(part.rayCut[end], i, j));
    const Floats inverse = 1.0F / (ofChord > ofPixel ? ofChord : ofPixel);
    const Floats shorter = (ofChord > ofPixel ? ofPixel : ofChord) * inverse;
    const Floats middle = from * inverse + 0.5F;
    share += 0.5F *
      (Clamped(middle - GaussPoint * shorter, zero, one) +
        Clamped(middle + GaussPoint * shorter, zero, one));
  }
  return part.attenuation * chord * share;
}

template <bool Hollow>
void AddPixels(const TubePart& part, const TubePixels& list, float* pixels)
{
  for (int first = 0; first < list.count; first += Lanes)
  {
    const Floats value = TubeValue<Hollow>(part, Load(list.i + first), Load(list.j + first));
    const int lanes = list.count - first < Lanes ? list.count - first : Lanes;
    for (int l = 0; l < lanes; ++l)
    {
      pixels[list.index[first + l]] += value[l];
    }
  }
}

void AddTube(const TubePart& part, const TubePixels& list, float* pixels)
{
  const bool hollow = part.inner[0] > 0.0F && part.inner[1] > 0.0F;
  (hollow ? AddPixels<true> : AddPixels<false>)(part, list, pixels);
}
}

const XRayKernels CORONARY_XRAY_KERNELS = { &SumSlices, &AddTube };
}
