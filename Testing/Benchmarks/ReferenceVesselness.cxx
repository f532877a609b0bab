#include "ReferenceVesselness.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
using Values = std::vector<double>;

/// Derivative of the given order along one axis; beyond the border the border voxels are repeated.
Values Differentiate(
  const Values& in, const std::array<int, 3>& n, int axis, double spacing, double sigma, int order)
{
  const int radius = static_cast<int>(std::ceil(8.0 * sigma / spacing));
  std::vector<double> kernel(2 * radius + 1);
  for (int t = -radius; t <= radius; ++t)
  {
    // Of the value at -t: a convolution. In units of sigma, so gamma is 1.
    const double x = t * spacing / sigma;
    const double g =
      std::exp(-0.5 * x * x) / (std::sqrt(2.0 * 3.14159265358979323846) * sigma) * spacing;
    kernel[t + radius] = order == 0 ? g : order == 1 ? -x * g : (x * x - 1.0) * g;
  }
  const auto row = [&](auto& values, int j, std::int64_t k)
  { return values.data() + (k * n[1] + j) * n[0]; };
  Values out(in.size(), 0.0);
  ParallelFor(n[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      Values line(n[0] + 2 * radius);
      for (std::int64_t k = first; k < last; ++k)
      {
        for (int j = 0; j < n[1]; ++j)
        {
          if (axis == 0)
          {
            const double* source = row(in, j, k);
            for (int i = 0; i < n[0] + 2 * radius; ++i)
            {
              line[i] = source[std::clamp(i - radius, 0, n[0] - 1)];
            }
          }
          double* sum = row(out, j, k);
          for (int t = -radius; t <= radius; ++t)
          {
            const double* there = axis == 0
              ? line.data() + radius - t
              : row(in, axis == 1 ? std::clamp(j - t, 0, n[1] - 1) : j,
                  axis == 2 ? std::clamp<std::int64_t>(k - t, 0, n[2] - 1) : k);
            for (int i = 0; i < n[0]; ++i)
            {
              sum[i] += kernel[t + radius] * there[i];
            }
          }
        }
      }
    });
  return out;
}

/// Ascending.
Vector3 Eigenvalues(const Matrix3& hessian)
{
  return Eigen::SelfAdjointEigenSolver<Matrix3>(hessian, Eigen::EigenvaluesOnly).eigenvalues();
}

bool AtJump(const Vector3& ascending)
{
  return ascending[1] < 0.0 && ascending[2] > 0.0 &&
    std::abs(ascending[1] + ascending[2]) <= 1e-2 * std::abs(ascending[0]);
}

double Frangi(const Vector3& ascending, const VesselnessSettings& settings)
{
  std::array<double, 3> l = { ascending[0], ascending[1], ascending[2] };
  std::sort(l.begin(), l.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  if (!(l[1] < 0.0 && l[2] < 0.0))
  {
    return 0.0;
  }
  const double ra = l[1] / l[2];
  const double rbSquared = l[0] * l[0] / (l[1] * l[2]);
  const double normSquared = l[0] * l[0] + l[1] * l[1] + l[2] * l[2];
  return (1.0 - std::exp(-0.5 * ra * ra / (settings.alpha * settings.alpha))) *
    std::exp(-0.5 * rbSquared / (settings.beta * settings.beta)) *
    (1.0 - std::exp(-0.5 * normSquared / (settings.c * settings.c)));
}
}

ReferenceResult ReferenceFrangi(
  const VoxelBlock& block, const Vector3& spacing, const VesselnessSettings& settings)
{
  const std::array<int, 6>& e = block.extent;
  const std::array<int, 3> n = { e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1 };
  const std::size_t count = static_cast<std::size_t>(n[0]) * n[1] * n[2];
  const Values input(block.values, block.values + count);
  ReferenceResult result{ std::vector<float>(count, 0.0f), std::vector<unsigned char>(count, 0) };
  for (const double sigma : settings.sigmas)
  {
    // Orders along the axes of xx, yy, zz, xy, xz, yz.
    constexpr int orders[6][3] = { { 2, 0, 0 }, { 0, 2, 0 }, { 0, 0, 2 }, { 1, 1, 0 }, { 1, 0, 1 },
      { 0, 1, 1 } };
    std::array<Values, 6> h;
    for (int element = 0; element < 6; ++element)
    {
      h[element] = input;
      for (int axis = 0; axis < 3; ++axis)
      {
        h[element] =
          Differentiate(h[element], n, axis, spacing[axis], sigma, orders[element][axis]);
      }
    }
    const double sign = settings.bright ? 1.0 : -1.0;
    ParallelFor(static_cast<std::int64_t>(count), 4096,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t p = first; p < last; ++p)
        {
          Matrix3 m;
          m << h[0][p], h[3][p], h[4][p], h[3][p], h[1][p], h[5][p], h[4][p], h[5][p], h[2][p];
          const Vector3 eigenvalues = Eigenvalues(sign * m);
          float& best = result.vesselness[p];
          best = std::max(best, static_cast<float>(Frangi(eigenvalues, settings)));
          result.atJump[p] |= AtJump(eigenvalues) ? 1 : 0;
        }
      });
  }
  return result;
}
}
