#include "MultiscaleVesselness.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string>

// One build runs on every x86-64, and uses the wide registers of those that have them. Not under
// sanitizers: their runtime is not there yet when the loader chooses a clone.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) &&                             \
  !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
#define CORONARY_CLONES                                                                            \
  __attribute__((target_clones("arch=skylake-avx512", "arch=haswell", "default")))
#else
#define CORONARY_CLONES
#endif
// A function that stayed a call would keep the loop around it from becoming vector code.
#define CORONARY_INLINE __attribute__((always_inline)) inline

namespace coronary
{
namespace
{
/// Samples that are worked on at a time. Rows are padded to it, so that a voxel goes through the
/// same instructions wherever a part begins.
constexpr int Lanes = 16;
constexpr int BandRows = 48;

int Padded(int n)
{
  return (n + Lanes - 1) / Lanes * Lanes;
}

/**
 * Right half (t >= 0) of a Gaussian or its first or second derivative, in mm, times sigma^order
 * (gamma = 1). Sampled, then corrected so that constants, ramps and parabolas come out exact.
 */
std::vector<float> HalfKernel(double sigma, double spacing, int order)
{
  const int radius = std::max(1, static_cast<int>(std::ceil(4.0 * sigma / spacing)));
  std::vector<double> g(radius + 1);
  double sum = 0.0;
  for (int t = 0; t <= radius; ++t)
  {
    const double x = t * spacing / sigma;
    g[t] = std::exp(-0.5 * x * x);
    sum += (t == 0 ? 1.0 : 2.0) * g[t];
  }
  std::vector<double> kernel(radius + 1);
  if (order == 0)
  {
    for (int t = 0; t <= radius; ++t)
    {
      kernel[t] = g[t] / sum;
    }
  }
  else if (order == 1)
  {
    // Taken with f(+t) - f(-t): a ramp of slope 1 has to give sigma.
    double moment = 0.0;
    for (int t = 1; t <= radius; ++t)
    {
      kernel[t] = t * g[t];
      moment += 2.0 * t * spacing * kernel[t];
    }
    for (double& k : kernel)
    {
      k *= sigma / moment;
    }
  }
  else
  {
    double total = 0.0;
    for (int t = 0; t <= radius; ++t)
    {
      const double x = t * spacing / sigma;
      kernel[t] = (x * x - 1.0) * g[t];
      total += (t == 0 ? 1.0 : 2.0) * kernel[t];
    }
    // Sum zero by a multiple of the Gaussian, then x^2 / 2 has to give sigma^2.
    double moment = 0.0;
    for (int t = 0; t <= radius; ++t)
    {
      kernel[t] -= total * g[t] / sum;
      moment += (t == 0 ? 0.0 : 2.0) * 0.5 * t * t * spacing * spacing * kernel[t];
    }
    for (double& k : kernel)
    {
      k *= sigma * sigma / moment;
    }
  }
  return std::vector<float>(kernel.begin(), kernel.end());
}

/// out0..2 = smooth, first and second derivative across rows of equal stride.
CORONARY_CLONES void FilterThree(const float* const* rows, int radius, const float* k0,
  const float* k1, const float* k2, int width, float* out0, float* out1, float* out2)
{
  for (int x = 0; x < width; x += Lanes)
  {
    float a0[Lanes];
    float a1[Lanes];
    float a2[Lanes];
    const float* centre = rows[radius] + x;
    for (int i = 0; i < Lanes; ++i)
    {
      a0[i] = k0[0] * centre[i];
      a1[i] = 0.0f;
      a2[i] = k2[0] * centre[i];
    }
    for (int t = 1; t <= radius; ++t)
    {
      const float* plus = rows[radius + t] + x;
      const float* minus = rows[radius - t] + x;
      const float w0 = k0[t];
      const float w1 = k1[t];
      const float w2 = k2[t];
      for (int i = 0; i < Lanes; ++i)
      {
        const float sum = plus[i] + minus[i];
        a0[i] += w0 * sum;
        a1[i] += w1 * (plus[i] - minus[i]);
        a2[i] += w2 * sum;
      }
    }
    for (int i = 0; i < Lanes; ++i)
    {
      out0[x + i] = a0[i];
      out1[x + i] = a1[i];
      out2[x + i] = a2[i];
    }
  }
}

/// Smooth and first derivative.
CORONARY_CLONES void FilterTwo(const float* const* rows, int radius, const float* k0,
  const float* k1, int width, float* out0, float* out1)
{
  for (int x = 0; x < width; x += Lanes)
  {
    float a0[Lanes];
    float a1[Lanes];
    const float* centre = rows[radius] + x;
    for (int i = 0; i < Lanes; ++i)
    {
      a0[i] = k0[0] * centre[i];
      a1[i] = 0.0f;
    }
    for (int t = 1; t <= radius; ++t)
    {
      const float* plus = rows[radius + t] + x;
      const float* minus = rows[radius - t] + x;
      const float w0 = k0[t];
      const float w1 = k1[t];
      for (int i = 0; i < Lanes; ++i)
      {
        a0[i] += w0 * (plus[i] + minus[i]);
        a1[i] += w1 * (plus[i] - minus[i]);
      }
    }
    for (int i = 0; i < Lanes; ++i)
    {
      out0[x + i] = a0[i];
      out1[x + i] = a1[i];
    }
  }
}

CORONARY_CLONES void FilterOne(
  const float* const* rows, int radius, const float* k0, int width, float* out0)
{
  for (int x = 0; x < width; x += Lanes)
  {
    float a0[Lanes];
    const float* centre = rows[radius] + x;
    for (int i = 0; i < Lanes; ++i)
    {
      a0[i] = k0[0] * centre[i];
    }
    for (int t = 1; t <= radius; ++t)
    {
      const float* plus = rows[radius + t] + x;
      const float* minus = rows[radius - t] + x;
      const float w0 = k0[t];
      for (int i = 0; i < Lanes; ++i)
      {
        a0[i] += w0 * (plus[i] + minus[i]);
      }
    }
    for (int i = 0; i < Lanes; ++i)
    {
      out0[x + i] = a0[i];
    }
  }
}

/// Along the row: `in` has `radius` samples before the first and after the last output.
CORONARY_CLONES void FilterAlong(
  const float* in, int radius, const float* k, bool odd, int width, float* out)
{
  const float sign = odd ? -1.0f : 1.0f;
  for (int x = 0; x < width; x += Lanes)
  {
    float a[Lanes];
    const float* centre = in + radius + x;
    for (int i = 0; i < Lanes; ++i)
    {
      a[i] = odd ? 0.0f : k[0] * centre[i];
    }
    for (int t = 1; t <= radius; ++t)
    {
      const float* plus = centre + t;
      const float* minus = centre - t;
      const float w = k[t];
      for (int i = 0; i < Lanes; ++i)
      {
        a[i] += w * (plus[i] + sign * minus[i]);
      }
    }
    for (int i = 0; i < Lanes; ++i)
    {
      out[x + i] = a[i];
    }
  }
}

/// Second derivatives of the voxels of one row at one scale, times sigma squared.
struct HessianRow
{
  const float* xx;
  const float* yy;
  const float* zz;
  const float* xy;
  const float* xz;
  const float* yz;
};

/// Eigenvalues by the trigonometric formula, ascending; exact to about 1e-4 of the norm.
CORONARY_INLINE void Eigenvalues(float xx, float yy, float zz, float xy, float xz, float yz,
  float& low, float& middle, float& high)
{
  const float mean = (xx + yy + zz) * (1.0f / 3.0f);
  const float a = xx - mean;
  const float b = yy - mean;
  const float c = zz - mean;
  const float off = xy * xy + xz * xz + yz * yz;
  const float p = std::sqrt((a * a + b * b + c * c + 2.0f * off) * (1.0f / 6.0f)) + 1e-20f;
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
  const float m = std::fabs(r);
  float angle = -0.0012624911f;
  angle = angle * m + 0.0066700901f;
  angle = angle * m - 0.0170881256f;
  angle = angle * m + 0.0308918810f;
  angle = angle * m - 0.0501743046f;
  angle = angle * m + 0.0889789874f;
  angle = angle * m - 0.2145988016f;
  angle = angle * m + 1.5707963050f;
  angle *= std::sqrt(1.0f - m);
  angle = 1.57079633f - std::copysign(1.57079633f - angle, r);
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
CORONARY_INLINE float ExpMinus(float x)
{
  x = x > 80.0f ? 80.0f : x;
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
  std::memcpy(&power, &bits, sizeof(power));
  return p * power;
}

/// Any voxel of the block whose two strongest eigenvalues can both be negative?
CORONARY_INLINE bool AnyNegativeTrace(const HessianRow& h, int x, float sign)
{
  float least = 0.0f;
  for (int i = 0; i < Lanes; ++i)
  {
    const float trace = sign * (h.xx[x + i] + h.yy[x + i] + h.zz[x + i]);
    least = trace < least ? trace : least;
  }
  return least < 0.0f;
}

struct RowParameters
{
  float sign; ///< -1 turns dark vessels into bright ones
  float minusHalfAlpha;
  float minusHalfBeta;
  float halfC;
};

CORONARY_CLONES void FrangiRow(
  const HessianRow& h, const RowParameters& parameters, int width, float* result)
{
  for (int x = 0; x < width; x += Lanes)
  {
    if (!AnyNegativeTrace(h, x, parameters.sign))
    {
      std::memset(result + x, 0, Lanes * sizeof(float));
      continue;
    }
    // In steps over small arrays: as one loop the compiler moves work behind the final condition,
    // and no vector code comes of it.
    float plate[Lanes];
    float blob[Lanes];
    float structure[Lanes];
    float vessel[Lanes];
    for (int i = 0; i < Lanes; ++i)
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
      plate[i] = ra * ra * parameters.minusHalfAlpha;
      blob[i] = l1 * l1 / (safe2 * safe3) * parameters.minusHalfBeta;
      structure[i] = norm * parameters.halfC;
    }
    for (int i = 0; i < Lanes; ++i)
    {
      plate[i] = 1.0f - ExpMinus(plate[i]);
      structure[i] = 1.0f - ExpMinus(structure[i]);
      blob[i] = ExpMinus(blob[i]);
    }
    for (int i = 0; i < Lanes; ++i)
    {
      const float value = plate[i] * blob[i] * structure[i];
      result[x + i] = vessel[i] <= 0.0f ? value : 0.0f;
    }
  }
}

/// Sato: sqrt(-l3) sqrt(-l2) weakened where l1 is far from 0. In HU.
CORONARY_CLONES void SatoRow(const HessianRow& h, float sign, float alpha, int width, float* result)
{
  for (int x = 0; x < width; x += Lanes)
  {
    if (!AnyNegativeTrace(h, x, sign))
    {
      std::memset(result + x, 0, Lanes * sizeof(float));
      continue;
    }
    for (int i = x; i < x + Lanes; ++i)
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
      const float lines = std::sqrt(a * (l3 < 0.0f ? -l3 : 0.0f));
      const float ratio = weight / (a + 1e-20f);
      result[i] = l1 <= -l2 ? lines * (ratio > 1.0f ? 1.0f : ratio) : 0.0f;
    }
  }
}

/// Jerman 2016, Eq. 13-15.
CORONARY_CLONES void JermanRow(
  const HessianRow& h, float sign, float cutoff, int width, float* result)
{
  for (int x = 0; x < width; x += Lanes)
  {
    if (!AnyNegativeTrace(h, x, sign))
    {
      std::memset(result + x, 0, Lanes * sizeof(float));
      continue;
    }
    for (int i = x; i < x + Lanes; ++i)
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
      result[i] = value * (vessel & (rho > 0.0f) ? 1.0f : 0.0f);
    }
  }
}

CORONARY_CLONES void NormAndLambda3(
  const HessianRow& h, float sign, int width, float* norm, float* lambda3)
{
  for (int i = 0; i < width; ++i)
  {
    norm[i] = h.xx[i] * h.xx[i] + h.yy[i] * h.yy[i] + h.zz[i] * h.zz[i] +
      2.0f * (h.xy[i] * h.xy[i] + h.xz[i] * h.xz[i] + h.yz[i] * h.yz[i]);
    float low;
    float middle;
    float high;
    Eigenvalues(sign * h.xx[i], sign * h.yy[i], sign * h.zz[i], sign * h.xy[i], sign * h.xz[i],
      sign * h.yz[i], low, middle, high);
    lambda3[i] = -low;
  }
}

/// Axis of the vessel: eigenvector of the eigenvalue that is the greatest after the sign.
Eigen::Vector3f VesselAxis(const HessianRow& h, int i, float sign)
{
  Matrix3 m;
  m << h.xx[i], h.xy[i], h.xz[i], h.xy[i], h.yy[i], h.yz[i], h.xz[i], h.yz[i], h.zz[i];
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(sign * m);
  Vector3 axis = solver.eigenvectors().col(2);
  // One of the two signs, the same on every machine and for every neighbour.
  int strongest = 0;
  axis.cwiseAbs().maxCoeff(&strongest);
  return (axis[strongest] < 0.0 ? Vector3(-axis) : axis).cast<float>();
}
}

void VesselnessSettings::Validate() const
{
  const auto require = [](bool condition, const char* message)
  {
    if (!condition)
    {
      throw std::invalid_argument(std::string("VesselnessSettings: ") + message);
    }
  };
  require(!this->sigmas.empty(), "sigmas is empty");
  for (const double sigma : this->sigmas)
  {
    require(sigma > 0.0 && sigma < 1000.0, "sigmas must be positive, in mm");
  }
  require(this->alpha > 0.0 && std::isfinite(this->alpha), "alpha must be positive");
  require(this->beta > 0.0 && std::isfinite(this->beta), "beta must be positive");
  require(this->c > 0.0 && std::isfinite(this->c), "c must be positive");
  require(this->tau >= 0.5 && this->tau <= 1.0, "tau must lie in [0.5, 1]");
  require(this->jermanCutoff >= 0.0 && std::isfinite(this->jermanCutoff),
    "jermanCutoff must not be negative");
}

std::vector<double> VesselnessScales(double low, double high, int count, bool logarithmic)
{
  if (!(low > 0.0) || !(high >= low) || count < 1)
  {
    throw std::invalid_argument(
      "VesselnessSettings: scales need 0 < sigmaMin <= sigmaMax and at least one step");
  }
  std::vector<double> sigmas(count, low);
  for (int n = 1; n < count; ++n)
  {
    const double f = static_cast<double>(n) / (count - 1);
    sigmas[n] = logarithmic ? low * std::pow(high / low, f) : low + f * (high - low);
  }
  return sigmas;
}

MultiscaleVesselness::MultiscaleVesselness(
  const VesselnessSettings& settings, const Vector3& spacing, const std::array<int, 6>& whole)
  : Settings(settings)
  , Spacing(spacing)
  , Whole(whole)
{
  settings.Validate();
  if (!(spacing.minCoeff() > 0.0) || !spacing.allFinite())
  {
    throw std::invalid_argument("MultiscaleVesselness: the spacing must be positive");
  }
  for (const double sigma : settings.sigmas)
  {
    std::array<std::vector<float>, 9> taps;
    for (int axis = 0; axis < 3; ++axis)
    {
      for (int order = 0; order < 3; ++order)
      {
        taps[3 * axis + order] = HalfKernel(sigma, spacing[axis], order);
      }
    }
    this->Taps.push_back(std::move(taps));
  }
}

std::array<int, 3> MultiscaleVesselness::Halo() const
{
  std::array<int, 3> halo{ 0, 0, 0 };
  for (const auto& taps : this->Taps)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      halo[axis] = std::max(halo[axis], static_cast<int>(taps[3 * axis].size()) - 1);
    }
  }
  return halo;
}

/// consume(j, k, scale, row, buffer) gets the Hessian of one row of the part at one scale; for a
/// given row all scales come in order, from one thread.
template <typename Consumer>
void MultiscaleVesselness::ForEachRow(const VoxelBlock& input, const std::array<int, 6>& part,
  const Consumer& consume, const ProgressCallback& progress) const
{
  const std::array<int, 6>& e = input.extent;
  const std::array<int, 3> halo = this->Halo();
  for (int axis = 0; axis < 3; ++axis)
  {
    if (part[2 * axis] < this->Whole[2 * axis] || part[2 * axis + 1] > this->Whole[2 * axis + 1] ||
      e[2 * axis] > std::max(part[2 * axis] - halo[axis], this->Whole[2 * axis]) ||
      e[2 * axis + 1] < std::min(part[2 * axis + 1] + halo[axis], this->Whole[2 * axis + 1]))
    {
      throw std::invalid_argument("MultiscaleVesselness: the input lacks part of the halo");
    }
  }
  const std::int64_t rowStride = e[1] - e[0] + 1;
  const std::int64_t sliceStride = rowStride * (e[3] - e[2] + 1);
  const int nx = part[1] - part[0] + 1;
  const int ny = part[3] - part[2] + 1;
  const int nz = part[5] - part[4] + 1;
  if (nx < 1 || ny < 1 || nz < 1)
  {
    return;
  }
  const int bands = (ny + BandRows - 1) / BandRows;

  ParallelFor(
    static_cast<std::int64_t>(bands) * nz, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      std::vector<float> inputRows;
      std::vector<float> slabs[3];
      std::vector<float> crossed[6];
      std::vector<float> results[6];
      std::vector<float> scratch;
      std::vector<const float*> rows;
      for (std::int64_t unit = first; unit < last; ++unit)
      {
        const int k = part[4] + static_cast<int>(unit / bands);
        const int j0 = part[2] + static_cast<int>(unit % bands) * BandRows;
        const int j1 = std::min(part[3], j0 + BandRows - 1);
        for (std::size_t scale = 0; scale < this->Taps.size(); ++scale)
        {
          const auto& taps = this->Taps[scale];
          const int rx = static_cast<int>(taps[0].size()) - 1;
          const int ry = static_cast<int>(taps[3].size()) - 1;
          const int rz = static_cast<int>(taps[6].size()) - 1;
          // What exists of the halo; the rest repeats the border.
          const int x0 = std::max(part[0] - rx, this->Whole[0]);
          const int x1 = std::min(part[1] + rx, this->Whole[1]);
          const int y0 = std::max(j0 - ry, this->Whole[2]);
          const int y1 = std::min(j1 + ry, this->Whole[3]);
          const int width = x1 - x0 + 1;
          const int stride = Padded(width);

          // Across the slices. Rows of the input may end before a whole pack: copied if so.
          for (std::vector<float>& slab : slabs)
          {
            slab.resize(static_cast<std::size_t>(stride) * (y1 - y0 + 1));
          }
          rows.resize(2 * rz + 1);
          const bool roomy = x0 + stride - 1 <= e[1];
          inputRows.resize(roomy ? 0 : static_cast<std::size_t>(stride) * (2 * rz + 1));
          for (int y = y0; y <= y1; ++y)
          {
            for (int t = -rz; t <= rz; ++t)
            {
              const int z = std::clamp(k + t, this->Whole[4], this->Whole[5]);
              const float* source =
                input.values + (z - e[4]) * sliceStride + (y - e[2]) * rowStride + (x0 - e[0]);
              if (!roomy)
              {
                float* copy = &inputRows[static_cast<std::size_t>(t + rz) * stride];
                std::copy_n(source, width, copy);
                std::fill(copy + width, copy + stride, 0.0f);
                source = copy;
              }
              rows[t + rz] = source;
            }
            const std::size_t at = static_cast<std::size_t>(y - y0) * stride;
            FilterThree(rows.data(), rz, taps[6].data(), taps[7].data(), taps[8].data(), stride,
              &slabs[0][at], &slabs[1][at], &slabs[2][at]);
          }

          // Across the rows, then along them.
          const int packed = Padded(nx);
          for (std::vector<float>& row : crossed)
          {
            row.resize(stride);
          }
          for (std::vector<float>& row : results)
          {
            row.resize(packed);
          }
          scratch.resize(packed + 2 * rx);
          rows.resize(2 * ry + 1);
          const auto gather = [&](int slab, int y)
          {
            for (int t = -ry; t <= ry; ++t)
            {
              const int from = std::clamp(y + t, this->Whole[2], this->Whole[3]);
              rows[t + ry] = &slabs[slab][static_cast<std::size_t>(from - y0) * stride];
            }
            return rows.data();
          };
          const auto along = [&](int from, int order, int to)
          {
            // The row with its halo, border voxels repeated.
            const int left = part[0] - rx;
            for (int x = left; x < x0; ++x)
            {
              scratch[x - left] = crossed[from][0];
            }
            std::copy_n(crossed[from].data(), width, scratch.data() + (x0 - left));
            std::fill(scratch.begin() + (x1 + 1 - left), scratch.end(), crossed[from][width - 1]);
            FilterAlong(
              scratch.data(), rx, taps[order].data(), order == 1, packed, results[to].data());
          };
          for (int y = j0; y <= j1; ++y)
          {
            FilterThree(gather(0, y), ry, taps[3].data(), taps[4].data(), taps[5].data(), stride,
              crossed[0].data(), crossed[1].data(), crossed[2].data());
            FilterTwo(gather(1, y), ry, taps[3].data(), taps[4].data(), stride, crossed[3].data(),
              crossed[4].data());
            FilterOne(gather(2, y), ry, taps[3].data(), stride, crossed[5].data());
            along(0, 2, 0); // xx
            along(2, 0, 1); // yy
            along(5, 0, 2); // zz
            along(1, 1, 3); // xy
            along(3, 1, 4); // xz
            along(4, 0, 5); // yz
            const HessianRow hessian{ results[0].data(), results[1].data(), results[2].data(),
              results[3].data(), results[4].data(), results[5].data() };
            consume(y, k, scale, packed, hessian);
          }
        }
      }
    },
    progress);
}

void MultiscaleVesselness::Compute(const VoxelBlock& input, const std::array<int, 6>& part,
  const unsigned char* mask, const Output& output, const ProgressCallback& progress) const
{
  const float sign = this->Settings.bright ? 1.0f : -1.0f;
  const auto alpha = static_cast<float>(this->Settings.alpha);
  const RowParameters frangi{ sign,
    static_cast<float>(0.5 / (this->Settings.alpha * this->Settings.alpha)),
    static_cast<float>(0.5 / (this->Settings.beta * this->Settings.beta)),
    static_cast<float>(0.5 / (this->Settings.c * this->Settings.c)) };
  const auto cutoff = static_cast<float>(this->Settings.tau * this->Settings.jermanCutoff);
  const int nx = part[1] - part[0] + 1;
  const int ny = part[3] - part[2] + 1;
  this->ForEachRow(
    input, part,
    [&](int j, int k, std::size_t scale, int width, const HessianRow& hessian)
    {
      thread_local std::vector<float> response;
      response.resize(width);
      switch (this->Settings.method)
      {
        case VesselnessMethod::Frangi:
          FrangiRow(hessian, frangi, width, response.data());
          break;
        case VesselnessMethod::Sato:
          SatoRow(hessian, sign, alpha, width, response.data());
          break;
        case VesselnessMethod::Jerman:
          JermanRow(hessian, sign, cutoff, width, response.data());
          break;
      }
      const std::int64_t row = ((k - part[4]) * static_cast<std::int64_t>(ny) + (j - part[2])) * nx;
      float* best = output.vesselness + row;
      const auto sigma = static_cast<float>(this->Settings.sigmas[scale]);
      for (int i = 0; i < nx; ++i)
      {
        if (scale == 0)
        {
          best[i] = 0.0f;
          if (output.scale)
          {
            output.scale[row + i] = 0.0f;
          }
          if (output.direction)
          {
            std::fill_n(output.direction + 3 * (row + i), 3, 0.0f);
          }
        }
        if (response[i] > best[i] && (!mask || mask[row + i]))
        {
          best[i] = response[i];
          if (output.scale)
          {
            output.scale[row + i] = sigma;
          }
          if (output.direction)
          {
            const Eigen::Vector3f axis = VesselAxis(hessian, i, sign);
            std::copy_n(axis.data(), 3, output.direction + 3 * (row + i));
          }
        }
      }
    },
    progress);
}

MultiscaleVesselness::Extremes MultiscaleVesselness::Measure(
  const VoxelBlock& input, const std::array<int, 6>& part, const ProgressCallback& progress) const
{
  const float sign = this->Settings.bright ? 1.0f : -1.0f;
  const int nx = part[1] - part[0] + 1;
  std::mutex mutex;
  Extremes extremes;
  this->ForEachRow(
    input, part,
    [&](int, int, std::size_t, int width, const HessianRow& hessian)
    {
      thread_local std::vector<float> norm;
      thread_local std::vector<float> lambda3;
      norm.resize(width);
      lambda3.resize(width);
      NormAndLambda3(hessian, sign, width, norm.data(), lambda3.data());
      const double n = std::sqrt(*std::max_element(norm.begin(), norm.begin() + nx));
      const double l = *std::max_element(lambda3.begin(), lambda3.begin() + nx);
      const std::lock_guard<std::mutex> lock(mutex);
      extremes.hessianNorm = std::max(extremes.hessianNorm, n);
      extremes.lambda3 = std::max(extremes.lambda3, l);
    },
    progress);
  return extremes;
}
}
