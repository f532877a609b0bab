// Vesselness against a direct double-precision computation, tubes of known size, and its promises.

#include "CounterRandom.h"
#include "KernelChoice.h"
#include "MultiscaleVesselness.h"
#include "VesselnessKernels.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>

namespace UnitTestMultiscaleVesselness
{
using namespace coronary;

namespace
{
struct Volume
{
  std::array<int, 6> extent;
  Vector3 spacing;
  std::vector<float> values;

  Volume(int nx, int ny, int nz, const Vector3& voxel,
    const std::function<double(const Vector3&)>& intensity)
    : extent{ 0, nx - 1, 0, ny - 1, 0, nz - 1 }
    , spacing(voxel)
  {
    for (int k = 0; k < nz; ++k)
    {
      for (int j = 0; j < ny; ++j)
      {
        for (int i = 0; i < nx; ++i)
        {
          values.push_back(static_cast<float>(intensity(spacing.cwiseProduct(Vector3(i, j, k)))));
        }
      }
    }
  }

  std::size_t Index(int i, int j, int k) const
  {
    return (static_cast<std::size_t>(k) * (extent[3] + 1) + j) * (extent[1] + 1) + i;
  }
  VoxelBlock Block() const { return { values.data(), extent }; }
};

struct Result
{
  std::vector<float> vesselness;
  std::vector<float> scale;
  std::vector<float> direction;
};

Result Filter(const Volume& volume, const VesselnessSettings& settings)
{
  const std::size_t count = volume.values.size();
  Result result{ std::vector<float>(count), std::vector<float>(count),
    std::vector<float>(3 * count) };
  const MultiscaleVesselness filter(settings, volume.spacing, volume.extent);
  filter.Compute(volume.Block(), volume.extent, nullptr,
    { result.vesselness.data(), result.scale.data(), result.direction.data() });
  return result;
}

VesselnessSettings Standard()
{
  VesselnessSettings settings;
  settings.sigmas = VesselnessScales(0.5, 2.5, 5, false);
  settings.c = 200.0;
  return settings;
}

/// A straight tube with a soft wall, along `axis` through `centre`.
std::function<double(const Vector3&)> Tube(
  const Vector3& centre, const Vector3& axis, double radius)
{
  return [=](const Vector3& p)
  {
    const Vector3 offset = p - centre;
    const double distance = (offset - offset.dot(axis) * axis).norm();
    return 400.0 * 0.5 * std::erfc((distance - radius) / (std::sqrt(2.0) * 0.3));
  };
}

/// Eq. 1 from a Hessian, in double precision.
double Frangi(const Matrix3& hessian, const VesselnessSettings& settings)
{
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(hessian, Eigen::EigenvaluesOnly);
  std::array<double, 3> l = { solver.eigenvalues()[0], solver.eigenvalues()[1],
    solver.eigenvalues()[2] };
  std::sort(l.begin(), l.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  if (l[1] >= 0.0 || l[2] >= 0.0)
  {
    return 0.0;
  }
  const double ra = l[1] / l[2];
  const double rb = l[0] * l[0] / (l[1] * l[2]);
  const double s = l[0] * l[0] + l[1] * l[1] + l[2] * l[2];
  return (1.0 - std::exp(-ra * ra / (2.0 * settings.alpha * settings.alpha))) *
    std::exp(-rb / (2.0 * settings.beta * settings.beta)) *
    (1.0 - std::exp(-s / (2.0 * settings.c * settings.c)));
}

/// Samples of a derivative of the Gaussian to six standard deviations, nothing corrected.
std::vector<double> AnalyticKernel(double sigma, double spacing, int order)
{
  const int radius = static_cast<int>(std::ceil(6.0 * sigma / spacing));
  std::vector<double> kernel;
  for (int t = -radius; t <= radius; ++t)
  {
    const double x = t * spacing / sigma;
    const double g = std::exp(-0.5 * x * x) / (std::sqrt(2.0 * M_PI) * sigma) * spacing;
    kernel.push_back(order == 0 ? g : order == 1 ? -x * g : (x * x - 1.0) * g);
  }
  return kernel;
}

std::array<int, 3> OrderOf(int p, int q)
{
  std::array<int, 3> order = { 0, 0, 0 };
  ++order[p];
  ++order[q];
  return order;
}

/// The Hessian at one voxel by a triple sum.
Matrix3 DenseHessian(const Volume& volume, int i, int j, int k, double sigma)
{
  std::vector<double> kernels[3][3];
  int radius[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    for (int order = 0; order < 3; ++order)
    {
      kernels[axis][order] = AnalyticKernel(sigma, volume.spacing[axis], order);
    }
    radius[axis] = static_cast<int>(kernels[axis][0].size()) / 2;
  }
  const auto clamp = [&](int axis, int x)
  { return std::min(std::max(x, 0), volume.extent[2 * axis + 1]); };
  Matrix3 hessian = Matrix3::Zero();
  for (int c = -radius[2]; c <= radius[2]; ++c)
  {
    for (int b = -radius[1]; b <= radius[1]; ++b)
    {
      for (int a = -radius[0]; a <= radius[0]; ++a)
      {
        const double value =
          volume.values[volume.Index(clamp(0, i - a), clamp(1, j - b), clamp(2, k - c))];
        for (int p = 0; p < 3; ++p)
        {
          for (int q = 0; q < 3; ++q)
          {
            const std::array<int, 3> order = OrderOf(p, q);
            hessian(p, q) += value * kernels[0][order[0]][radius[0] + a] *
              kernels[1][order[1]][radius[1] + b] * kernels[2][order[2]][radius[2] + c];
          }
        }
      }
    }
  }
  return hessian;
}

std::vector<double> Convolved(
  const Volume& volume, const std::vector<double>& in, int axis, const std::vector<double>& kernel)
{
  const int radius = static_cast<int>(kernel.size()) / 2;
  const int n = volume.extent[2 * axis + 1] + 1;
  const std::size_t stride = axis == 0 ? 1
    : axis == 1                        ? volume.Index(0, 1, 0)
                                       : volume.Index(0, 0, 1);
  std::vector<double> out(in.size());
  for (std::size_t at = 0; at < in.size(); ++at)
  {
    const int x = static_cast<int>(at / stride % n);
    const std::size_t line = at - x * stride;
    for (int t = -radius; t <= radius; ++t)
    {
      out[at] += kernel[t + radius] * in[line + std::min(std::max(x - t, 0), n - 1) * stride];
    }
  }
  return out;
}

/// The Hessian of all voxels: the same sum axis by axis.
std::vector<Matrix3> Hessians(const Volume& volume, double sigma)
{
  const std::vector<double> values(volume.values.begin(), volume.values.end());
  std::vector<Matrix3> hessians(values.size());
  for (int p = 0; p < 3; ++p)
  {
    for (int q = p; q < 3; ++q)
    {
      std::vector<double> derivative = values;
      for (int axis = 0; axis < 3; ++axis)
      {
        derivative = Convolved(volume, derivative, axis,
          AnalyticKernel(sigma, volume.spacing[axis], OrderOf(p, q)[axis]));
      }
      for (std::size_t at = 0; at < values.size(); ++at)
      {
        hessians[at](p, q) = hessians[at](q, p) = derivative[at];
      }
    }
  }
  return hessians;
}

/// A tube in noise, not along an axis.
Volume NoisyTube(const Vector3& spacing, int n, double noise, std::uint64_t seed)
{
  Volume volume(
    n, n, n, spacing, Tube(spacing * (0.5 * n), Vector3(1.0, 0.6, 0.8).normalized(), 1.2));
  RandomStream random(seed, 1);
  for (float& value : volume.values)
  {
    value += static_cast<float>(noise * random.Normal() - 100.0);
  }
  return volume;
}
}

TEST(MultiscaleVesselness, AgreesWithTheDirectComputation)
{
  // Kernels to six standard deviations, as they are: for every spacing that resolves the scales.
  for (const Vector3& spacing :
    { Vector3(0.4, 0.4, 0.4), Vector3(0.35, 0.35, 0.6), Vector3(0.5, 0.5, 0.5),
      Vector3(0.4, 0.45, 0.6), Vector3(0.25, 0.25, 0.25), Vector3(0.23, 0.23, 0.625) })
  {
    SCOPED_TRACE(testing::Message() << "spacing " << spacing.transpose());
    const Volume volume = NoisyTube(spacing, 28, 10.0, 3);
    const VesselnessSettings settings = Standard();
    std::vector<double> expected(volume.values.size(), 0.0);
    for (const double sigma : settings.sigmas)
    {
      const std::vector<Matrix3> hessians = Hessians(volume, sigma);
      for (std::size_t at = 0; at < expected.size(); ++at)
      {
        expected[at] = std::max(expected[at], Frangi(hessians[at], settings));
      }
    }
    const Result result = Filter(volume, settings);
    double worst = 0.0;
    double xx = 0.0;
    double yy = 0.0;
    double xy = 0.0;
    for (std::size_t at = 0; at < expected.size(); ++at)
    {
      const double found = result.vesselness[at];
      worst = std::max(worst, std::abs(expected[at] - found));
      xx += expected[at] * expected[at];
      yy += found * found;
      xy += expected[at] * found;
    }
    EXPECT_LT(worst, 1e-3);
    EXPECT_GT(xy / std::sqrt(xx * yy), 0.9999);
    EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 0.2);
  }

  // Those sums axis by axis are the triple sum.
  const Volume volume = NoisyTube(Vector3(0.4, 0.45, 0.6), 20, 10.0, 4);
  const std::vector<Matrix3> hessians = Hessians(volume, 0.7);
  for (const int x : { 0, 5, 9, 14 })
  {
    const Matrix3 dense = DenseHessian(volume, x, 19 - x, 10, 0.7);
    EXPECT_LT((dense - hessians[volume.Index(x, 19 - x, 10)]).norm(), 1e-9 * dense.norm());
  }
}

TEST(MultiscaleVesselness, KernelsAreExactForParabolasWhateverTheVoxels)
{
  // Also where a scale is not resolved, and samples of the Gaussian alone would be far off.
  for (const double sigma : { 0.3, 0.5, 2.0 })
  {
    const Vector3 spacing(0.4, 0.6, 1.2);
    Matrix3 curvature;
    curvature << -3.0, 0.5, 0.2, 0.5, -2.0, -0.4, 0.2, -0.4, 1.0;
    const Volume volume(49, 49, 41, spacing,
      [&](const Vector3& p)
      {
        const Vector3 x = p - spacing.cwiseProduct(Vector3(24, 24, 20));
        return 1000.0 + 40.0 * x[0] - 30.0 * x[2] + 0.5 * x.dot(curvature * x);
      });
    VesselnessSettings settings;
    settings.sigmas = { sigma };
    const MultiscaleVesselness filter(settings, spacing, volume.extent);
    const auto measured =
      filter.Measure(volume.Block(), { 24, 24, 24, 24, 20, 20 }, nullptr).hessianNorm;
    EXPECT_NEAR(measured / (sigma * sigma * curvature.norm()), 1.0, 2e-3) << sigma;
  }
}

TEST(MultiscaleVesselness, AllInstructionSetsAgree)
{
  const Volume volume = NoisyTube(Vector3(0.4, 0.45, 0.6), 45, 10.0, 6);
  for (const VesselnessMethod method :
    { VesselnessMethod::Frangi, VesselnessMethod::Sato, VesselnessMethod::Jerman })
  {
    VesselnessSettings settings = Standard();
    settings.method = method;
    settings.jermanMaxima.assign(settings.sigmas.size(), 300.0);
    ASSERT_TRUE(VesselnessKernelChoice().Select(Instructions::Baseline));
    const Result expected = Filter(volume, settings);
    const MultiscaleVesselness filter(settings, volume.spacing, volume.extent);
    const auto extremes = filter.Measure(volume.Block(), volume.extent, nullptr);
    const double maximumValue =
      *std::max_element(expected.vesselness.begin(), expected.vesselness.end());
    EXPECT_GT(maximumValue, 0.2);
    for (const Instructions wide : { Instructions::Avx2, Instructions::Avx512 })
    {
      if (!VesselnessKernelChoice().Select(wide))
      {
        std::cout << "not on this processor: " << static_cast<int>(wide) << "\n";
        continue;
      }
      const Result found = Filter(volume, settings);
      const auto measured = filter.Measure(volume.Block(), volume.extent, nullptr);
      EXPECT_NEAR(measured.hessianNorm / extremes.hessianNorm, 1.0, 1e-5);
      for (std::size_t n = 0; n < extremes.jermanMaxima.size(); ++n)
      {
        EXPECT_NEAR(measured.jermanMaxima[n] / extremes.jermanMaxima[n], 1.0, 1e-4);
      }
      // Eq. 1 jumps where |lambda 1| = |lambda 2| have opposite signs: there rounding decides.
      std::size_t different = 0;
      for (std::size_t at = 0; at < found.vesselness.size(); ++at)
      {
        different +=
          std::abs(found.vesselness[at] - expected.vesselness[at]) > 1e-4 * maximumValue ? 1 : 0;
      }
      EXPECT_LE(different, found.vesselness.size() / 20000);
      for (std::size_t at = 0; at < found.vesselness.size(); at += 7)
      {
        const Eigen::Map<const Eigen::Vector3f> a(&expected.direction[3 * at]);
        const Eigen::Map<const Eigen::Vector3f> b(&found.direction[3 * at]);
        if (expected.vesselness[at] > 0.1 * maximumValue && expected.scale[at] == found.scale[at])
        {
          EXPECT_GT(std::abs(a.dot(b)), 0.9999f);
        }
      }
    }
    VesselnessKernelChoice().Select(Instructions::Widest);
  }
}

TEST(MultiscaleVesselness, FindsTheAxisTheScaleAndTheDirectionOfATube)
{
  const Vector3 spacing(0.4, 0.4, 0.4);
  const Vector3 axis(0.0, 0.0, 1.0);
  for (const double radius : { 1.0, 1.5, 2.2 })
  {
    const Vector3 centre(8.13, 7.92, 0.0);
    const Volume volume(40, 40, 16, spacing, Tube(centre, axis, radius));
    VesselnessSettings settings = Standard();
    settings.sigmas = VesselnessScales(0.5, 2.5, 9, false);
    const Result result = Filter(volume, settings);
    std::size_t best = 0;
    int at[2] = { 0, 0 };
    for (int j = 0; j < 40; ++j)
    {
      for (int i = 0; i < 40; ++i)
      {
        if (result.vesselness[volume.Index(i, j, 8)] > result.vesselness[best])
        {
          best = volume.Index(i, j, 8);
          at[0] = i;
          at[1] = j;
        }
      }
    }
    const auto peak = [&](int axisIndex)
    {
      // Vertex of the parabola through the maximum and its neighbours.
      const int di = axisIndex == 0;
      const int dj = axisIndex == 1;
      const double a = result.vesselness[volume.Index(at[0] - di, at[1] - dj, 8)];
      const double b = result.vesselness[best];
      const double c = result.vesselness[volume.Index(at[0] + di, at[1] + dj, 8)];
      return at[axisIndex] + 0.5 * (a - c) / (a - 2.0 * b + c);
    };
    EXPECT_NEAR(peak(0) * spacing[0], centre[0], 0.1 * spacing[0]);
    EXPECT_NEAR(peak(1) * spacing[1], centre[1], 0.1 * spacing[1]);
    EXPECT_NEAR(result.scale[best], radius / std::sqrt(2.0), 0.26);
    EXPECT_NEAR(std::abs(result.direction[3 * best + 2]), 1.0, 1e-3);
    EXPECT_GT(result.vesselness[best], 0.2);
    EXPECT_LE(result.vesselness[best], 1.0);
  }
}

TEST(MultiscaleVesselness, SuppressesPlatesAndBlobs)
{
  const Vector3 spacing(0.5, 0.5, 0.5);
  const Vector3 middle = spacing * 16.0;
  const auto peak = [&](const std::function<double(const Vector3&)>& intensity)
  {
    const Volume volume(33, 33, 33, spacing, intensity);
    return Filter(volume, Standard()).vesselness[volume.Index(16, 16, 16)];
  };
  const double tube = peak(Tube(middle, Vector3(1, 0, 0), 1.5));
  const double plate = peak([&](const Vector3& p)
    { return 400.0 * std::exp(-0.5 * std::pow((p[0] - middle[0]) / 1.5, 2)); });
  const double blob = peak([&](const Vector3& p)
    { return 400.0 * std::exp(-0.5 * (p - middle).squaredNorm() / (1.5 * 1.5)); });
  EXPECT_LT(plate, 0.02 * tube);
  EXPECT_LT(blob, 0.35 * tube);
}

TEST(MultiscaleVesselness, DarkVesselsAreBrightOnesTurnedOver)
{
  const Vector3 spacing(0.4, 0.4, 0.5);
  const auto tube = Tube(Vector3(5, 5, 5), Vector3(0.6, 0.0, 0.8), 1.2);
  const Volume bright(26, 26, 20, spacing, tube);
  const Volume dark(26, 26, 20, spacing, [&](const Vector3& p) { return -tube(p); });
  VesselnessSettings settings = Standard();
  const Result a = Filter(bright, settings);
  settings.bright = false;
  EXPECT_EQ(a.vesselness, Filter(dark, settings).vesselness);
  settings.bright = true;
  const Result none = Filter(dark, settings);
  EXPECT_LT(none.vesselness[dark.Index(12, 12, 10)], 0.01f);
}

TEST(MultiscaleVesselness, PartsAndThreadsGiveTheSameBits)
{
  RandomStream random(5, 5);
  const Volume volume(
    61, 70, 23, Vector3(0.4, 0.5, 0.7), [&](const Vector3&) { return 100.0 * random.Normal(); });
  for (const VesselnessMethod method :
    { VesselnessMethod::Frangi, VesselnessMethod::Sato, VesselnessMethod::Jerman })
  {
    VesselnessSettings settings = Standard();
    settings.method = method;
    settings.jermanMaxima.assign(settings.sigmas.size(), 67.0);
    const Result whole = Filter(volume, settings);
    SetNumberOfThreads(1);
    EXPECT_EQ(whole.vesselness, Filter(volume, settings).vesselness);
    SetNumberOfThreads(0);

    // The part gets only its halo of the input, in a block of its own.
    const MultiscaleVesselness filter(settings, volume.spacing, volume.extent);
    const std::array<int, 3> halo = filter.Halo();
    const std::array<int, 6> part = { 30, 47, 7, 66, 9, 11 };
    std::array<int, 6> grown;
    for (int axis = 0; axis < 3; ++axis)
    {
      grown[2 * axis] = std::max(part[2 * axis] - halo[axis], 0);
      grown[2 * axis + 1] = std::min(part[2 * axis + 1] + halo[axis], volume.extent[2 * axis + 1]);
    }
    std::vector<float> block;
    for (int k = grown[4]; k <= grown[5]; ++k)
    {
      for (int j = grown[2]; j <= grown[3]; ++j)
      {
        for (int i = grown[0]; i <= grown[1]; ++i)
        {
          block.push_back(volume.values[volume.Index(i, j, k)]);
        }
      }
    }
    std::vector<float> piece(18 * 60 * 3);
    filter.Compute({ block.data(), grown }, part, nullptr, { piece.data(), nullptr, nullptr });
    std::size_t n = 0;
    std::size_t different = 0;
    for (int k = part[4]; k <= part[5]; ++k)
    {
      for (int j = part[2]; j <= part[3]; ++j)
      {
        for (int i = part[0]; i <= part[1]; ++i)
        {
          different += piece[n++] != whole.vesselness[volume.Index(i, j, k)];
        }
      }
    }
    EXPECT_EQ(different, 0u);
    EXPECT_THROW(
      filter.Compute({ block.data(), part }, part, nullptr, { piece.data(), nullptr, nullptr }),
      std::invalid_argument);
  }
}

TEST(MultiscaleVesselness, MaskMeasureAndConstantImage)
{
  const Vector3 spacing(0.4, 0.4, 0.4);
  const Volume tube(24, 24, 24, spacing, Tube(spacing * 12.0, Vector3(0, 1, 0), 1.2));
  const VesselnessSettings settings = Standard();
  const MultiscaleVesselness filter(settings, spacing, tube.extent);
  std::vector<unsigned char> mask(tube.values.size(), 1);
  mask[tube.Index(12, 12, 12)] = 0;
  std::vector<float> masked(mask.size());
  filter.Compute(tube.Block(), tube.extent, mask.data(), { masked.data(), nullptr, nullptr });
  const Result whole = Filter(tube, settings);
  EXPECT_EQ(masked[tube.Index(12, 12, 12)], 0.0f);
  EXPECT_GT(whole.vesselness[tube.Index(12, 12, 12)], 0.1f);
  EXPECT_EQ(masked[tube.Index(12, 11, 12)], whole.vesselness[tube.Index(12, 11, 12)]);

  const auto extremes = filter.Measure(tube.Block(), tube.extent, nullptr);
  EXPECT_GT(extremes.hessianNorm, 100.0);
  VesselnessSettings jerman = settings;
  jerman.method = VesselnessMethod::Jerman;
  jerman.jermanMaxima.assign(jerman.sigmas.size(), 0.0);
  const MultiscaleVesselness other(jerman, spacing, tube.extent);
  const auto maxima = other.Measure(tube.Block(), tube.extent, nullptr);
  EXPECT_EQ(maxima.hessianNorm, extremes.hessianNorm);
  ASSERT_EQ(maxima.jermanMaxima.size(), jerman.sigmas.size());
  for (const double maximum : maxima.jermanMaxima)
  {
    EXPECT_GT(maximum, 10.0);
    EXPECT_LE(maximum, extremes.hessianNorm * 1.001);
  }
  // What the mask leaves out does not count; parts add up.
  std::vector<unsigned char> none(tube.values.size(), 0);
  EXPECT_EQ(filter.Measure(tube.Block(), tube.extent, none.data()).hessianNorm, 0.0);
  auto merged = other.Measure(tube.Block(), { 0, 23, 0, 23, 0, 10 }, nullptr);
  merged.Merge(other.Measure(tube.Block(), { 0, 23, 0, 23, 11, 23 }, nullptr));
  EXPECT_EQ(merged.hessianNorm, maxima.hessianNorm);
  EXPECT_EQ(merged.jermanMaxima, maxima.jermanMaxima);

  const Volume constant(20, 9, 9, spacing, [](const Vector3&) { return 37.0; });
  for (const VesselnessMethod method :
    { VesselnessMethod::Frangi, VesselnessMethod::Sato, VesselnessMethod::Jerman })
  {
    VesselnessSettings any = settings;
    any.method = method;
    any.jermanMaxima.assign(any.sigmas.size(), 1.0);
    for (const float value : Filter(constant, any).vesselness)
    {
      EXPECT_EQ(value, 0.0f);
    }
  }
}

TEST(MultiscaleVesselness, AMaskChangesNothingInsideOfIt)
{
  RandomStream random(5, 9);
  const Volume volume(
    61, 120, 9, Vector3(0.4, 0.5, 0.7), [&](const Vector3&) { return 100.0 * random.Normal(); });
  VesselnessSettings settings = Standard();
  const MultiscaleVesselness filter(settings, volume.spacing, volume.extent);
  const Result whole = Filter(volume, settings);
  // A slanted slab: pieces of rows of all lengths, rows, slices and whole bands without any.
  std::vector<unsigned char> mask(volume.values.size(), 0);
  for (int k = 2; k < 8; ++k)
  {
    for (int j = 0; j < 70; ++j)
    {
      for (int i = std::max(0, j - 20); i < std::min(61, j + 5 - 2 * k); ++i)
      {
        mask[volume.Index(i, j, k)] = 1;
      }
    }
  }
  std::vector<float> vesselness(mask.size(), -1.0F);
  std::vector<float> scale(mask.size(), -1.0F);
  std::vector<float> direction(3 * mask.size(), -2.0F);
  filter.Compute(volume.Block(), volume.extent, mask.data(),
    { vesselness.data(), scale.data(), direction.data() });
  std::size_t different = 0;
  for (std::size_t p = 0; p < mask.size(); ++p)
  {
    different += vesselness[p] != (mask[p] != 0 ? whole.vesselness[p] : 0.0F);
    different += mask[p] == 0 && (scale[p] != 0.0F || direction[3 * p] != 0.0F);
    different += vesselness[p] > 0.0F && !(scale[p] > 0.0F);
  }
  EXPECT_EQ(different, 0U);
}

TEST(MultiscaleVesselness, NaNVoxelsDoNotSpread)
{
  const Vector3 spacing(0.4, 0.4, 0.4);
  const auto intensity = Tube(spacing * 16.0, Vector3(0, 0, 1), 1.2);
  const Volume sound(32, 32, 40, spacing, intensity);
  Volume damaged = sound;
  damaged.values[damaged.Index(16, 16, 5)] = std::numeric_limits<float>::quiet_NaN();
  VesselnessSettings settings = Standard();
  settings.sigmas = { 0.5, 1.0 };
  const Result expected = Filter(sound, settings);
  const Result found = Filter(damaged, settings);
  const int reach = MultiscaleVesselness(settings, spacing, sound.extent).Halo()[2];
  for (int k = 0; k < 40; ++k)
  {
    const float value = found.vesselness[damaged.Index(16, 16, k)];
    EXPECT_FALSE(std::isnan(value));
    if (k > 5 + reach)
    {
      EXPECT_EQ(value, expected.vesselness[sound.Index(16, 16, k)]);
    }
  }
  EXPECT_EQ(found.vesselness[damaged.Index(16, 16, 6)], 0.0f);
}

TEST(MultiscaleVesselness, StopsAndRefuses)
{
  const Volume volume(30, 60, 30, Vector3(0.4, 0.4, 0.4), [](const Vector3&) { return 0.0; });
  const MultiscaleVesselness filter(Standard(), volume.spacing, volume.extent);
  std::vector<float> values(volume.values.size());
  EXPECT_THROW(filter.Compute(volume.Block(), volume.extent, nullptr,
                 { values.data(), nullptr, nullptr }, [](double) { return false; }),
    Cancelled);

  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [&](const std::function<void(VesselnessSettings&)>& change)
  {
    VesselnessSettings settings = Standard();
    change(settings);
    EXPECT_THROW(
      MultiscaleVesselness(settings, volume.spacing, volume.extent), std::invalid_argument);
  };
  refused([](VesselnessSettings& s) { s.sigmas.clear(); });
  refused([&](VesselnessSettings& s) { s.sigmas = { nan }; });
  refused([](VesselnessSettings& s) { s.alpha = 0.0; });
  refused([](VesselnessSettings& s) { s.beta = -1.0; });
  refused([&](VesselnessSettings& s) { s.c = nan; });
  refused([](VesselnessSettings& s) { s.tau = 0.2; });
  EXPECT_THROW(
    MultiscaleVesselness(Standard(), Vector3(0.4, 0.0, 0.4), volume.extent), std::invalid_argument);
  EXPECT_THROW(VesselnessScales(1.0, 0.5, 3, false), std::invalid_argument);
  EXPECT_EQ(VesselnessScales(0.5, 2.0, 3, true)[1], 1.0);
}
}
