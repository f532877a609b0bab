#include "PhantomNoise.h"

#include "CounterRandom.h"

#include <cmath>

namespace coronary
{
namespace
{
constexpr std::int64_t NoiseMargin = 1024; ///< voxels around the image that the noise may reach

float Gaussian(std::uint64_t key, std::uint64_t counter)
{
  // Sum of four uniform 16-bit numbers: close to normal, and the kernel's sum closer still.
  const std::uint64_t bits = MixBits(key + counter);
  const auto sum = static_cast<float>(
    (bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48));
  // Mean 4 * 32767.5, variance 4 * (65536^2 - 1) / 12.
  return (sum - 131070.0f) * (1.0f / 37837.2f);
}

/// Kernel with unit sum of squares: filtered unit white noise keeps its standard deviation.
std::vector<float> NoiseKernel(double sigma)
{
  const int radius = sigma < 0.2 ? 0 : static_cast<int>(std::ceil(3.0 * sigma));
  std::vector<float> kernel(2 * radius + 1, 1.0f);
  double squares = 0.0;
  for (int i = -radius; i <= radius; ++i)
  {
    const double w = radius == 0 ? 1.0 : std::exp(-0.5 * i * i / (sigma * sigma));
    kernel[i + radius] = static_cast<float>(w);
    squares += w * w;
  }
  for (float& w : kernel)
  {
    w = static_cast<float>(w / std::sqrt(squares));
  }
  return kernel;
}
}

CorrelatedNoise::CorrelatedNoise(
  const ImageGrid& grid, double correlation, double level, std::uint64_t key)
  : Extent(grid.extent)
  , Level(static_cast<float>(level))
  , Key(key)
{
  for (int axis = 0; axis < 3; ++axis)
  {
    this->Kernels[axis] = NoiseKernel(correlation / grid.spacing[axis]);
  }
}

std::vector<float> CorrelatedNoise::White(const int (&size)[3], const int (&corner)[3]) const
{
  const std::int64_t wholeX = this->Extent[1] - this->Extent[0] + 1 + 2 * NoiseMargin;
  const std::int64_t wholeY = this->Extent[3] - this->Extent[2] + 1 + 2 * NoiseMargin;
  std::vector<float> white(static_cast<std::size_t>(size[0]) * size[1] * size[2]);
  for (int k = 0; k < size[2]; ++k)
  {
    for (int j = 0; j < size[1]; ++j)
    {
      const std::int64_t row =
        ((static_cast<std::int64_t>(corner[2] + k) - this->Extent[4] + NoiseMargin) * wholeY +
          (corner[1] + j - this->Extent[2] + NoiseMargin)) *
        wholeX;
      float* out = &white[(static_cast<std::size_t>(k) * size[1] + j) * size[0]];
      for (int i = 0; i < size[0]; ++i)
      {
        out[i] = Gaussian(this->Key,
          static_cast<std::uint64_t>(row + corner[0] + i - this->Extent[0] + NoiseMargin));
      }
    }
  }
  return white;
}

void CorrelatedNoise::Add(const std::array<int, 6>& box, std::vector<float>& values) const
{
  if (!(this->Level > 0.0f))
  {
    return;
  }
  int wide[3];
  int corner[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    const int halo = static_cast<int>(this->Kernels[axis].size()) / 2;
    wide[axis] = box[2 * axis + 1] - box[2 * axis] + 1 + 2 * halo;
    corner[axis] = box[2 * axis] - halo;
  }
  const int wx = wide[0];
  const int wy = wide[1];
  const int nx = box[1] - box[0] + 1;
  const int ny = box[3] - box[2] + 1;
  const int nz = box[5] - box[4] + 1;
  const std::vector<float> white = this->White(wide, corner);
  // z, then y, then x; each pass shortens its axis by the halo.
  std::vector<float> pass(static_cast<std::size_t>(wx) * wy * nz, 0.0f);
  const std::size_t plane = static_cast<std::size_t>(wx) * wy;
  for (int k = 0; k < nz; ++k)
  {
    float* out = &pass[k * plane];
    for (std::size_t n = 0; n < this->Kernels[2].size(); ++n)
    {
      const float w = this->Kernels[2][n];
      const float* in = &white[(k + n) * plane];
      for (std::size_t i = 0; i < plane; ++i)
      {
        out[i] += w * in[i];
      }
    }
  }
  std::vector<float> pass2(static_cast<std::size_t>(wx) * ny * nz, 0.0f);
  for (int k = 0; k < nz; ++k)
  {
    for (int j = 0; j < ny; ++j)
    {
      float* out = &pass2[(static_cast<std::size_t>(k) * ny + j) * wx];
      for (std::size_t n = 0; n < this->Kernels[1].size(); ++n)
      {
        const float w = this->Kernels[1][n];
        const float* in = &pass[k * plane + (j + n) * wx];
        for (int i = 0; i < wx; ++i)
        {
          out[i] += w * in[i];
        }
      }
    }
  }
  for (int row = 0; row < ny * nz; ++row)
  {
    float* out = &values[static_cast<std::size_t>(row) * nx];
    for (std::size_t n = 0; n < this->Kernels[0].size(); ++n)
    {
      const float w = this->Kernels[0][n] * this->Level;
      const float* in = &pass2[static_cast<std::size_t>(row) * wx + n];
      for (int i = 0; i < nx; ++i)
      {
        out[i] += w * in[i];
      }
    }
  }
}
}
