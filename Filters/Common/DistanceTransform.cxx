#include "DistanceTransform.h"

#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr float Infinite = std::numeric_limits<float>::infinity();

/// Lower envelope of parabolas over one line of voxels.
class LineTransform
{
public:
  LineTransform(int count, double spacing)
    : Count(count)
    , Step(spacing)
    , Input(count)
    , Place(count)
    , Border(count + 1)
  {
  }

  void Run(float* line, std::int64_t stride)
  {
    // Parabolas with their tops at infinity take no part.
    int top = -1;
    for (int q = 0; q < this->Count; ++q)
    {
      const float value = line[q * stride];
      this->Input[q] = value;
      if (value == Infinite)
      {
        continue;
      }
      double from = -std::numeric_limits<double>::infinity();
      while (top >= 0)
      {
        from = this->Meeting(this->Place[top], q);
        if (from > this->Border[top])
        {
          break;
        }
        --top;
      }
      if (top < 0)
      {
        from = -std::numeric_limits<double>::infinity();
      }
      ++top;
      this->Place[top] = q;
      this->Border[top] = from;
    }
    if (top < 0)
    {
      return;
    }
    int k = 0;
    for (int q = 0; q < this->Count; ++q)
    {
      while (k < top && this->Border[k + 1] < q)
      {
        ++k;
      }
      const double d = (q - this->Place[k]) * this->Step;
      line[q * stride] = static_cast<float>(d * d + this->Input[this->Place[k]]);
    }
  }

private:
  double Meeting(int p, int q) const
  {
    const double square = this->Step * this->Step;
    return 0.5 *
      ((this->Input[q] - this->Input[p]) / (square * (q - p)) + static_cast<double>(q) + p);
  }

  int Count;
  double Step;
  std::vector<double> Input;
  std::vector<int> Place;
  std::vector<double> Border;
};
}

std::vector<float> SquaredDistanceTransform(const unsigned char* mask,
  const std::array<int, 3>& dimensions, const Vector3& spacing, const ProgressCallback& progress)
{
  const std::int64_t nx = dimensions[0];
  const std::int64_t ny = dimensions[1];
  const std::int64_t nz = dimensions[2];
  std::vector<float> squared(nx * ny * nz);
  if (squared.empty())
  {
    return squared;
  }
  const auto part = [&](double from)
  {
    return progress
      ? ProgressCallback([&progress, from](double f) { return progress(from + 0.5 * f); })
      : ProgressCallback();
  };

  // Lines along i and j stay within one slice.
  ParallelFor(
    nz, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      LineTransform alongI(static_cast<int>(nx), spacing[0]);
      LineTransform alongJ(static_cast<int>(ny), spacing[1]);
      for (std::int64_t k = first; k < last; ++k)
      {
        const std::int64_t offset = k * nx * ny;
        for (std::int64_t p = offset; p < offset + nx * ny; ++p)
        {
          squared[p] = mask[p] ? Infinite : 0.0f;
        }
        for (std::int64_t j = 0; j < ny; ++j)
        {
          alongI.Run(&squared[offset + j * nx], 1);
        }
        for (std::int64_t i = 0; i < nx; ++i)
        {
          alongJ.Run(&squared[offset + i], nx);
        }
      }
    },
    part(0.0));
  ParallelFor(
    ny, 4,
    [&](std::int64_t first, std::int64_t last)
    {
      LineTransform alongK(static_cast<int>(nz), spacing[2]);
      for (std::int64_t j = first; j < last; ++j)
      {
        for (std::int64_t i = 0; i < nx; ++i)
        {
          alongK.Run(&squared[j * nx + i], nx * ny);
        }
      }
    },
    part(0.5));
  Report(progress, 1.0);
  return squared;
}

std::vector<unsigned char> OpenWithBall(const unsigned char* mask,
  const std::array<int, 3>& dimensions, const Vector3& spacing, double radius,
  const ProgressCallback& progress)
{
  const auto part = [&](double from)
  {
    return progress
      ? ProgressCallback([&progress, from](double f) { return progress(from + 0.5 * f); })
      : ProgressCallback();
  };
  const auto square = static_cast<float>(radius * radius);
  const std::vector<float> inside = SquaredDistanceTransform(mask, dimensions, spacing, part(0.0));
  std::vector<unsigned char> result(inside.size());
  for (std::size_t p = 0; p < inside.size(); ++p)
  {
    result[p] = inside[p] > square ? 0 : 1; // where the ball's centre may not be
  }
  const std::vector<float> toCentres =
    SquaredDistanceTransform(result.data(), dimensions, spacing, part(0.5));
  for (std::size_t p = 0; p < toCentres.size(); ++p)
  {
    result[p] = toCentres[p] <= square ? 1 : 0;
  }
  return result;
}
}
