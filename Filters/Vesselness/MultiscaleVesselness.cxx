#include "MultiscaleVesselness.h"

#include "KernelChoice.h"
#include "Require.h"
#include "VesselnessKernels.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <stdexcept>

namespace coronary
{
namespace
{
/// Rows and slices that are filtered at once: what they share is read and computed once.
constexpr int BandRows = 96;
constexpr int BandSlices = 4;

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

const VesselnessKernels& Kernels()
{
  return VesselnessKernelChoice().Get();
}

/// Of a row of voxels from i0 to i1.
struct RowPiece
{
  int i0;
  int i1;
  int j;
  int k;
};

/// A box of voxels that one thread filters at once.
struct RowBand
{
  int i0;
  int i1;
  int j0;
  int j1;
  int k0;
  int k1;
};

/// Keeps of a band what holds all that the mask has of it. @return whether that is anything
bool Shrink(RowBand& band, const unsigned char* mask, const std::array<int, 6>& part)
{
  const std::int64_t nx = part[1] - part[0] + 1;
  const std::int64_t ny = part[3] - part[2] + 1;
  const auto isIn = [](unsigned char value) { return value != 0; };
  RowBand kept{ part[1] + 1, part[0] - 1, part[3] + 1, part[2] - 1, part[5] + 1, part[4] - 1 };
  for (int k = band.k0; k <= band.k1; ++k)
  {
    for (int j = band.j0; j <= band.j1; ++j)
    {
      const unsigned char* row = mask + ((k - part[4]) * ny + (j - part[2])) * nx;
      const unsigned char* first = std::find_if(row, row + nx, isIn);
      if (first == row + nx)
      {
        continue;
      }
      auto last = static_cast<int>(nx) - 1;
      while (row[last] == 0)
      {
        --last;
      }
      kept.i0 = std::min(kept.i0, part[0] + static_cast<int>(first - row));
      kept.i1 = std::max(kept.i1, part[0] + last);
      kept.j0 = std::min(kept.j0, j);
      kept.j1 = std::max(kept.j1, j);
      kept.k0 = std::min(kept.k0, k);
      kept.k1 = std::max(kept.k1, k);
    }
  }
  band = kept;
  return kept.i0 <= kept.i1;
}

/// Hessians of the rows of a band at one scale after the other.
class BandFilter
{
public:
  using ScaleTaps = std::array<std::vector<float>, 9>;

  BandFilter(const VoxelBlock& input, const std::array<int, 6>& whole)
    : Input(input)
    , Whole(whole)
    , RowStride(input.extent[1] - input.extent[0] + 1)
    , SliceStride(this->RowStride * (input.extent[3] - input.extent[2] + 1))
    , End(input.values + this->SliceStride * (input.extent[5] - input.extent[4] + 1))
  {
  }

  /// Derivatives across the slices, of all rows that the band's rows need.
  void Begin(const RowBand& band, const ScaleTaps& taps);
  /// Of a row of the band; valid until the next call.
  HessianRow Row(int y, int k);
  /// Values in a row, with those that fill its last pack.
  int Width() const { return Padded(this->Part.i1 - this->Part.i0 + 1); }

private:
  void Along(int from, int order, int to);
  const float* const* Gather(int derivative, int y, int k);
  float* Across(int derivative, int y, int k)
  {
    return &this->Slabs[derivative]
                       [(static_cast<std::size_t>(k - this->Part.k0) * (this->Y1 - this->Y0 + 1) +
                          (y - this->Y0)) *
                         this->Stride];
  }

  const VoxelBlock& Input;
  const std::array<int, 6>& Whole;
  std::int64_t RowStride;
  std::int64_t SliceStride;
  const float* End;
  const ScaleTaps* Taps = nullptr;
  RowBand Part{};
  std::array<int, 3> Reach{}; ///< of the taps
  // What exists of the halo; the rest repeats the border.
  int X0 = 0;
  int X1 = 0;
  int Y0 = 0;
  int Y1 = 0;
  int Stride = 0; ///< of the rows with their halo
  std::vector<float> LastRows;
  std::array<std::vector<float>, 3> Slabs; ///< derivatives across the slices
  std::array<std::vector<float>, 6> Crossed;
  std::array<std::vector<float>, 6> Results;
  std::vector<float> Scratch;
  std::vector<const float*> Rows;
};

void BandFilter::Begin(const RowBand& band, const ScaleTaps& taps)
{
  this->Part = band;
  this->Taps = &taps;
  for (int axis = 0; axis < 3; ++axis)
  {
    this->Reach[axis] = static_cast<int>(taps[3 * axis].size()) - 1;
  }
  this->X0 = std::max(band.i0 - this->Reach[0], this->Whole[0]);
  this->X1 = std::min(band.i1 + this->Reach[0], this->Whole[1]);
  this->Y0 = std::max(band.j0 - this->Reach[1], this->Whole[2]);
  this->Y1 = std::min(band.j1 + this->Reach[1], this->Whole[3]);
  const int width = this->X1 - this->X0 + 1;
  this->Stride = Padded(width);
  for (std::vector<float>& slab : this->Slabs)
  {
    slab.resize(
      static_cast<std::size_t>(this->Stride) * (this->Y1 - this->Y0 + 1) * (band.k1 - band.k0 + 1));
  }
  for (std::vector<float>& row : this->Crossed)
  {
    row.resize(this->Stride);
  }
  for (std::vector<float>& row : this->Results)
  {
    row.resize(this->Width());
  }
  this->Scratch.resize(this->Width() + 2 * this->Reach[0]);
  const int rz = this->Reach[2];
  this->LastRows.resize(static_cast<std::size_t>(this->Stride) * (2 * rz + 1));
  const float* const kernels[] = { taps[6].data(), taps[7].data(), taps[8].data() };
  const std::array<int, 6>& e = this->Input.extent;
  this->Rows.resize(2 * rz + 1);
  // The slices of a band share nearly all rows, which stay in the cache for the next slice.
  for (int y = this->Y0; y <= this->Y1; ++y)
  {
    for (int k = band.k0; k <= band.k1; ++k)
    {
      for (int t = -rz; t <= rz; ++t)
      {
        const int z = std::clamp(k + t, this->Whole[4], this->Whole[5]);
        const float* source = this->Input.values + (z - e[4]) * this->SliceStride +
          (y - e[2]) * this->RowStride + (this->X0 - e[0]);
        // A whole pack may reach beyond a row's end, into the next row, whose values come to nothing; the block's
        // last rows are copied.
        if (source + this->Stride > this->End)
        {
          float* copy = &this->LastRows[static_cast<std::size_t>(t + rz) * this->Stride];
          std::copy_n(source, width, copy);
          std::fill(copy + width, copy + this->Stride, 0.0f);
          source = copy;
        }
        this->Rows[t + rz] = source;
      }
      float* const out[] = { this->Across(0, y, k), this->Across(1, y, k), this->Across(2, y, k) };
      Kernels().filterAcross(this->Rows.data(), rz, kernels, 3, this->Stride, out);
    }
  }
}

const float* const* BandFilter::Gather(int derivative, int y, int k)
{
  const int ry = this->Reach[1];
  this->Rows.resize(2 * ry + 1);
  for (int t = -ry; t <= ry; ++t)
  {
    this->Rows[t + ry] =
      this->Across(derivative, std::clamp(y + t, this->Whole[2], this->Whole[3]), k);
  }
  return this->Rows.data();
}

/// A derivative along the row.
void BandFilter::Along(int from, int order, int to)
{
  // The row with its halo, border voxels repeated.
  const int rx = this->Reach[0];
  const int left = this->Part.i0 - rx;
  const int width = this->X1 - this->X0 + 1;
  const std::vector<float>& row = this->Crossed[from];
  std::fill(this->Scratch.begin(), this->Scratch.begin() + (this->X0 - left), row.front());
  std::copy_n(row.data(), width, this->Scratch.data() + (this->X0 - left));
  std::fill(this->Scratch.begin() + (this->X1 + 1 - left), this->Scratch.end(), row[width - 1]);
  Kernels().filterAlong(this->Scratch.data(), rx, (*this->Taps)[order].data(), order, this->Width(),
    this->Results[to].data());
}

HessianRow BandFilter::Row(int y, int k)
{
  const ScaleTaps& taps = *this->Taps;
  const float* const kernels[] = { taps[3].data(), taps[4].data(), taps[5].data() };
  float* const out[] = { this->Crossed[0].data(), this->Crossed[1].data(), this->Crossed[2].data(),
    this->Crossed[3].data(), this->Crossed[4].data(), this->Crossed[5].data() };
  const int ry = this->Reach[1];
  Kernels().filterAcross(this->Gather(0, y, k), ry, kernels, 3, this->Stride, out);
  Kernels().filterAcross(this->Gather(1, y, k), ry, kernels, 2, this->Stride, out + 3);
  Kernels().filterAcross(this->Gather(2, y, k), ry, kernels, 1, this->Stride, out + 5);
  this->Along(0, 2, 0); // xx
  this->Along(2, 0, 1); // yy
  this->Along(5, 0, 2); // zz
  this->Along(1, 1, 3); // xy
  this->Along(3, 1, 4); // xz
  this->Along(4, 0, 5); // yz
  return { this->Results[0].data(), this->Results[1].data(), this->Results[2].data(),
    this->Results[3].data(), this->Results[4].data(), this->Results[5].data() };
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

KernelChoice<VesselnessKernels>& VesselnessKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<VesselnessKernels> choice(
    VesselnessKernelsBaseline, &VesselnessKernelsAvx2, &VesselnessKernelsAvx512);
#else
  static KernelChoice<VesselnessKernels> choice(VesselnessKernelsBaseline);
#endif
  return choice;
}

void VesselnessSettings::Validate() const
{
  constexpr RequireOf require{ "VesselnessSettings" };
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
  const int nx = part[1] - part[0] + 1;
  const int ny = part[3] - part[2] + 1;
  const int nz = part[5] - part[4] + 1;
  if (nx < 1 || ny < 1 || nz < 1)
  {
    return;
  }
  const int bands = (ny + BandRows - 1) / BandRows;
  const int bandRows = (ny + bands - 1) / bands;
  const int groups = (nz + BandSlices - 1) / BandSlices;
  ParallelFor(
    static_cast<std::int64_t>(bands) * groups, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      BandFilter filter(input, this->Whole);
      for (std::int64_t unit = first; unit < last; ++unit)
      {
        RowBand band{ part[0], part[1], part[2] + static_cast<int>(unit % bands) * bandRows, 0,
          part[4] + static_cast<int>(unit / bands) * BandSlices, 0 };
        band.j1 = std::min(part[3], band.j0 + bandRows - 1);
        band.k1 = std::min(part[5], band.k0 + BandSlices - 1);
        if (band.j0 > band.j1 || (mask && !Shrink(band, mask, part)))
        {
          continue;
        }
        for (std::size_t scale = 0; scale < this->Taps.size(); ++scale)
        {
          filter.Begin(band, this->Taps[scale]);
          for (int k = band.k0; k <= band.k1; ++k)
          {
            for (int y = band.j0; y <= band.j1; ++y)
            {
              consume(RowPiece{ band.i0, band.i1, y, k }, scale, filter.Width(), filter.Row(y, k));
            }
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
      const auto maximumOf = [&]
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
      const double norm = std::sqrt(double{ maximumOf() });
      double strongest = 0.0;
      if (jerman)
      {
        Kernels().lambda3(hessian, sign, width, measure.data());
        strongest = maximumOf();
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
