#include "EdgeSmoothing.h"

#include "Median.h"
#include "PartialProgress.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace coronary
{
namespace
{
constexpr int Square = 9;         ///< pixels along the side of a noise sample
constexpr int Spread = 7;         ///< between them
constexpr float Tissue = -300.0f; ///< HU; air and lung are below
constexpr double EdgeNoise = 2.0; ///< differences beyond so many standard deviations are edges
constexpr int Steps = 12;
constexpr int Trials = 6; ///< of strengths, on a part of the image

std::size_t At(const std::array<int, 3>& size, int i, int j, int k)
{
  return (static_cast<std::size_t>(k) * size[1] + j) * size[0] + i;
}

/// Steps of steepest descent on sum (x - y)^2 / 2 + strength * sum huber(x - x').
void Smooth(std::vector<float>& image, const std::array<int, 3>& size, float strength, float edge,
  const ProgressCallback& progress)
{
  const std::vector<float> measured = image;
  std::vector<float> next(image.size());
  const float step = 1.0f / (1.0f + 6.0f * strength);
  for (int n = 0; n < Steps; ++n)
  {
    ParallelFor(
      size[2], 1,
      [&](std::int64_t begin, std::int64_t end)
      {
        for (auto k = static_cast<int>(begin); k < end; ++k)
        {
          for (int j = 0; j < size[1]; ++j)
          {
            // A row beside itself has no difference: so the image's rim needs no exceptions.
            const float* row = &image[At(size, 0, j, k)];
            const float* beside[4] = { &image[At(size, 0, std::max(0, j - 1), k)],
              &image[At(size, 0, std::min(size[1] - 1, j + 1), k)],
              &image[At(size, 0, j, std::max(0, k - 1))],
              &image[At(size, 0, j, std::min(size[2] - 1, k + 1))] };
            const float* own = &measured[At(size, 0, j, k)];
            float* out = &next[At(size, 0, j, k)];
            const auto pull = [edge](float difference)
            { return std::min(edge, std::max(-edge, difference)); };
            for (int i = 0; i < size[0]; ++i)
            {
              const float x = row[i];
              float sum =
                pull(row[std::max(0, i - 1)] - x) + pull(row[std::min(size[0] - 1, i + 1)] - x);
              for (const float* other : beside)
              {
                sum += pull(other[i] - x);
              }
              out[i] = x + step * (own[i] - x + strength * sum);
            }
          }
        }
      },
      PartOf(progress, static_cast<double>(n) / Steps, static_cast<double>(n + 1) / Steps));
    image.swap(next);
  }
}
}

double ImageNoise(const std::vector<float>& image, const std::array<int, 3>& size)
{
  std::vector<double> deviations;
  for (int k = 0; k < size[2]; k += Spread)
  {
    for (int j = 0; j + Square <= size[1]; j += Spread)
    {
      for (int i = 0; i + Square <= size[0]; i += Spread)
      {
        double sum = 0.0;
        double squares = 0.0;
        for (int v = 0; v < Square; ++v)
        {
          for (int u = 0; u < Square; ++u)
          {
            const double value = image[At(size, i + u, j + v, k)];
            sum += value;
            squares += value * value;
          }
        }
        constexpr double count = Square * Square;
        if (sum > Tissue * count)
        {
          deviations.push_back(
            std::sqrt(std::max(0.0, squares - sum * sum / count) / (count - 1.0)));
        }
      }
    }
  }
  return QuantileOf(std::move(deviations), 0.25);
}

void SmoothWithinEdges(std::vector<float>& image, const std::array<int, 3>& size, double share,
  const ProgressCallback& progress)
{
  const double noise = ImageNoise(image, size);
  if (noise <= 0.0 || share <= 0.0)
  {
    return;
  }
  const auto edge = static_cast<float>(EdgeNoise * noise);
  // The strength is sought on the slices in the middle.
  const int depth = std::min(size[2], 3 * Spread);
  const std::array<int, 3> part{ size[0], size[1], depth };
  const std::size_t first = At(size, 0, 0, (size[2] - depth) / 2);
  const std::vector<float> sample(image.begin() + static_cast<std::ptrdiff_t>(first),
    image.begin() + static_cast<std::ptrdiff_t>(first + At(part, 0, 0, depth)));
  const double before = ImageNoise(sample, part);
  double low = 0.0;
  double high = 4.0;
  for (int trial = 0; trial < Trials; ++trial)
  {
    const double middle = 0.5 * (low + high);
    std::vector<float> tried = sample;
    Smooth(tried, part, static_cast<float>(middle), edge,
      PartOf(progress, 0.3 * trial / Trials, 0.3 * (trial + 1) / Trials));
    (ImageNoise(tried, part) > (1.0 - share) * before ? low : high) = middle;
  }
  Smooth(image, size, static_cast<float>(0.5 * (low + high)), edge, PartOf(progress, 0.3, 1.0));
}
}
