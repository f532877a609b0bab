#include "MultiscaleVesselness.h"

#include "VesselnessKernels.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr int BandRows = 48;

/// Of the kernels, in standard deviations. At 4 the second derivative still has half a per cent of
/// its height, which costs 1e-3 of vesselness and more; here it is 1e-4.
constexpr double KernelReach = 5.0;

int Padded(int n)
{
  return (n + VesselnessLanes - 1) / VesselnessLanes * VesselnessLanes;
}

/**
 * Right half (t >= 0) of a Gaussian or its first or second derivative, in mm, times sigma^order
 * (gamma = 1). Sampled, then corrected so that constants, ramps and parabolas come out exact.
 */
std::vector<float> HalfKernel(double sigma, double spacing, int order)
{
  const int radius = std::max(1, static_cast<int>(std::ceil(KernelReach * sigma / spacing)));
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

/// The loops of an instruction set, if they are in this library and this processor runs them.
const VesselnessKernels* Find(VesselnessInstructions instructions)
{
  switch (instructions)
  {
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
    case VesselnessInstructions::Avx512:
      return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
          __builtin_cpu_supports("avx512vl")
        ? &VesselnessKernelsAvx512
        : nullptr;
    case VesselnessInstructions::Avx2:
      return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")
        ? &VesselnessKernelsAvx2
        : nullptr;
#endif
    case VesselnessInstructions::Baseline:
      return &VesselnessKernelsBaseline;
    default:
      return nullptr;
  }
}

/// The widest that this processor runs.
const VesselnessKernels* FindWidest()
{
  for (const VesselnessInstructions wide :
    { VesselnessInstructions::Avx512, VesselnessInstructions::Avx2 })
  {
    if (const VesselnessKernels* kernels = Find(wide))
    {
      return kernels;
    }
  }
  return &VesselnessKernelsBaseline;
}

std::atomic<const VesselnessKernels*>& Selected()
{
  static std::atomic<const VesselnessKernels*> selected{ FindWidest() };
  return selected;
}

const VesselnessKernels& Kernels()
{
  return *Selected();
}

/// Of a row of voxels from i0 to i1.
struct RowPiece
{
  int i0;
  int i1;
  int j;
  int k;
};

/// What a mask has of some rows; nothing: i1 is below i0.
struct Bounds
{
  int i0;
  int i1;
  int j0;
  int j1;
};

Bounds MaskBounds(const unsigned char* rows, int width, int count)
{
  const auto isIn = [](unsigned char value) { return value != 0; };
  Bounds bounds{ width, -1, count, -1 };
  for (int j = 0; j < count; ++j)
  {
    const unsigned char* row = rows + static_cast<std::int64_t>(j) * width;
    const unsigned char* first = std::find_if(row, row + width, isIn);
    if (first == row + width)
    {
      continue;
    }
    int last = width - 1;
    while (row[last] == 0)
    {
      --last;
    }
    bounds.i0 = std::min(bounds.i0, static_cast<int>(first - row));
    bounds.i1 = std::max(bounds.i1, last);
    bounds.j0 = std::min(bounds.j0, j);
    bounds.j1 = j;
  }
  return bounds;
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

bool SetVesselnessInstructions(VesselnessInstructions instructions)
{
  const VesselnessKernels* found =
    instructions == VesselnessInstructions::Widest ? FindWidest() : Find(instructions);
  if (found)
  {
    Selected() = found;
  }
  return found != nullptr;
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
  if (this->method == VesselnessMethod::Jerman)
  {
    require(
      this->jermanMaxima.size() == this->sigmas.size(), "jermanMaxima needs one value a scale");
    for (const double maximum : this->jermanMaxima)
    {
      require(maximum >= 0.0 && std::isfinite(maximum), "jermanMaxima must not be negative");
    }
  }
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

/// consume(row, scale, width, hessian) gets the Hessian of one row of the part at one scale, or of that piece of it that
/// holds what the mask has of the rows around; for a given row all scales come in order, from one thread. Rows
/// without mask may not come.
template <typename Consumer>
void MultiscaleVesselness::ForEachRow(const VoxelBlock& input, const std::array<int, 6>& part,
  const unsigned char* mask, const Consumer& consume, const ProgressCallback& progress) const
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
  const VesselnessKernels& kernels = Kernels();
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
        int j0 = part[2] + static_cast<int>(unit % bands) * BandRows;
        int j1 = std::min(part[3], j0 + BandRows - 1);
        int i0 = part[0];
        int i1 = part[1];
        if (mask)
        {
          const Bounds wanted =
            MaskBounds(mask + ((k - part[4]) * static_cast<std::int64_t>(ny) + (j0 - part[2])) * nx,
              nx, j1 - j0 + 1);
          if (wanted.i1 < wanted.i0)
          {
            continue;
          }
          i0 = part[0] + wanted.i0;
          i1 = part[0] + wanted.i1;
          j1 = j0 + wanted.j1;
          j0 += wanted.j0;
        }
        for (std::size_t scale = 0; scale < this->Taps.size(); ++scale)
        {
          const auto& taps = this->Taps[scale];
          const float* const kernelsY[] = { taps[3].data(), taps[4].data(), taps[5].data() };
          const float* const kernelsZ[] = { taps[6].data(), taps[7].data(), taps[8].data() };
          const int rx = static_cast<int>(taps[0].size()) - 1;
          const int ry = static_cast<int>(taps[3].size()) - 1;
          const int rz = static_cast<int>(taps[6].size()) - 1;
          // What exists of the halo; the rest repeats the border.
          const int x0 = std::max(i0 - rx, this->Whole[0]);
          const int x1 = std::min(i1 + rx, this->Whole[1]);
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
            float* const out[] = { &slabs[0][at], &slabs[1][at], &slabs[2][at] };
            kernels.filterAcross(rows.data(), rz, kernelsZ, 3, stride, out);
          }

          // Across the rows, then along them.
          const int packed = Padded(i1 - i0 + 1);
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
            const int left = i0 - rx;
            for (int x = left; x < x0; ++x)
            {
              scratch[x - left] = crossed[from][0];
            }
            std::copy_n(crossed[from].data(), width, scratch.data() + (x0 - left));
            std::fill(scratch.begin() + (x1 + 1 - left), scratch.end(), crossed[from][width - 1]);
            kernels.filterAlong(
              scratch.data(), rx, taps[order].data(), order, packed, results[to].data());
          };
          for (int y = j0; y <= j1; ++y)
          {
            float* const out[] = { crossed[0].data(), crossed[1].data(), crossed[2].data(),
              crossed[3].data(), crossed[4].data(), crossed[5].data() };
            kernels.filterAcross(gather(0, y), ry, kernelsY, 3, stride, out);
            kernels.filterAcross(gather(1, y), ry, kernelsY, 2, stride, out + 3);
            kernels.filterAcross(gather(2, y), ry, kernelsY, 1, stride, out + 5);
            along(0, 2, 0); // xx
            along(2, 0, 1); // yy
            along(5, 0, 2); // zz
            along(1, 1, 3); // xy
            along(3, 1, 4); // xz
            along(4, 0, 5); // yz
            const HessianRow hessian{ results[0].data(), results[1].data(), results[2].data(),
              results[3].data(), results[4].data(), results[5].data() };
            consume(RowPiece{ i0, i1, y, k }, scale, packed, hessian);
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
  const int nx = part[1] - part[0] + 1;
  const int ny = part[3] - part[2] + 1;
  const std::int64_t slice = static_cast<std::int64_t>(nx) * ny;
  ParallelFor(mask ? part[5] - part[4] + 1 : 0, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      // What the mask leaves out is not computed at all.
      std::fill(output.vesselness + first * slice, output.vesselness + last * slice, 0.0f);
      if (output.scale)
      {
        std::fill(output.scale + first * slice, output.scale + last * slice, 0.0f);
      }
      if (output.direction)
      {
        std::fill(output.direction + 3 * first * slice, output.direction + 3 * last * slice, 0.0f);
      }
    });
  this->ForEachRow(
    input, part, mask,
    [&](const RowPiece& piece, std::size_t scale, int width, const HessianRow& hessian)
    {
      thread_local std::vector<float> response;
      response.resize(width);
      switch (this->Settings.method)
      {
        case VesselnessMethod::Frangi:
          Kernels().frangi(hessian, frangi, width, response.data());
          break;
        case VesselnessMethod::Sato:
          Kernels().sato(hessian, sign, alpha, width, response.data());
          break;
        case VesselnessMethod::Jerman:
          Kernels().jerman(hessian, sign,
            static_cast<float>(this->Settings.tau * this->Settings.jermanMaxima[scale]), width,
            response.data());
          break;
      }
      const std::int64_t row = (piece.k - part[4]) * slice +
        static_cast<std::int64_t>(piece.j - part[2]) * nx + (piece.i0 - part[0]);
      float* best = output.vesselness + row;
      const auto sigma = static_cast<float>(this->Settings.sigmas[scale]);
      for (int i = 0; i <= piece.i1 - piece.i0; ++i)
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

void MultiscaleVesselness::Extremes::Merge(const Extremes& other)
{
  this->hessianNorm = std::max(this->hessianNorm, other.hessianNorm);
  this->jermanMaxima.resize(std::max(this->jermanMaxima.size(), other.jermanMaxima.size()));
  for (std::size_t n = 0; n < other.jermanMaxima.size(); ++n)
  {
    this->jermanMaxima[n] = std::max(this->jermanMaxima[n], other.jermanMaxima[n]);
  }
}

MultiscaleVesselness::Extremes MultiscaleVesselness::Measure(const VoxelBlock& input,
  const std::array<int, 6>& part, const unsigned char* mask, const ProgressCallback& progress) const
{
  const float sign = this->Settings.bright ? 1.0f : -1.0f;
  const bool jerman = this->Settings.method == VesselnessMethod::Jerman;
  const int nx = part[1] - part[0] + 1;
  const int ny = part[3] - part[2] + 1;
  std::mutex mutex;
  Extremes extremes;
  extremes.jermanMaxima.assign(jerman ? this->Taps.size() : 0, 0.0);
  this->ForEachRow(
    input, part, mask,
    [&](const RowPiece& piece, std::size_t scale, int width, const HessianRow& hessian)
    {
      thread_local std::vector<float> measure;
      measure.resize(width);
      const unsigned char* inside = mask
        ? mask + ((piece.k - part[4]) * static_cast<std::int64_t>(ny) + (piece.j - part[2])) * nx +
          (piece.i0 - part[0])
        : nullptr;
      const auto largest = [&]
      {
        // Not max_element: a NaN in front would hide the rest of the row.
        float result = 0.0f;
        for (int i = 0; i <= piece.i1 - piece.i0; ++i)
        {
          const float value = inside && !inside[i] ? 0.0f : measure[i];
          const bool greater = value > result && value <= std::numeric_limits<float>::max();
          result = greater ? value : result;
        }
        return result;
      };
      Kernels().squaredNorm(hessian, width, measure.data());
      const double norm = std::sqrt(double{ largest() });
      double strongest = 0.0;
      if (jerman)
      {
        Kernels().lambda3(hessian, sign, width, measure.data());
        strongest = largest();
      }
      const std::lock_guard<std::mutex> lock(mutex);
      extremes.hessianNorm = std::max(extremes.hessianNorm, norm);
      if (jerman)
      {
        extremes.jermanMaxima[scale] = std::max(extremes.jermanMaxima[scale], strongest);
      }
    },
    progress);
  return extremes;
}
}
