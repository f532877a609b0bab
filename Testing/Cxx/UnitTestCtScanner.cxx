// The simulated CT scanner against closed forms: spectrum and materials, line integrals, reconstruction,
// slabs and beats, and the phantom through all of it.
#include "CoarseScanner.h"
#include "CtScanner.h"
#include "EdgeSmoothing.h"
#include "ScannerReconstruction.h"

#include "CounterRandom.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

namespace UnitTestCtScanner
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr double FirstAngle = 0.3; ///< of the tube in the first view, rad

/// Tubes along z that may move from view to view, reconstructed in the central plane; 1 is water.
std::vector<float> Reconstruct(const ScannerSettings& settings,
  const std::function<std::vector<ScannedTube>(int view)>& tubesOf, const ImageGrid& grid)
{
  const ScannerPhysics physics(settings);
  const ScannerProjector projector(settings);
  const HalfScanReconstruction reconstruction(settings, settings.kernel);
  std::vector<FilteredView> views;
  ViewPaths paths;
  TransmittedView transmitted;
  for (int v = 0; v < settings.HalfScanViews(); ++v)
  {
    const double angle = FirstAngle + v * settings.ViewAngle();
    projector.Clear(paths);
    projector.Add(tubesOf(v), {}, { angle, Vector3::Zero() }, paths);
    std::vector<float> line(paths[0].size());
    physics.Transmit(paths, transmitted);
    physics.Detect(transmitted, 1.0, MixBits(static_cast<std::uint64_t>(v)), line.data());
    FilteredView& view =
      views.emplace_back(FilteredView{ angle, 0.0, std::vector<float>(line.size()) });
    reconstruction.Filter(v, 1.0f, line.data(), { 0, settings.channels - 1 }, view.values.data());
  }
  const std::array<int, 6>& e = grid.extent;
  std::vector<float> image(
    static_cast<std::size_t>(e[1] - e[0] + 1) * (e[3] - e[2] + 1) * (e[5] - e[4] + 1));
  reconstruction.BackProject(views, Vector3::Zero(), grid, image.data(), {});
  return image;
}

std::vector<float> Reconstruct(
  const ScannerSettings& settings, const std::vector<ScannedTube>& tubes, const ImageGrid& grid)
{
  return Reconstruct(
    settings, [&](int) { return tubes; }, grid);
}

ImageGrid Plane(int size, double spacing)
{
  ImageGrid grid;
  grid.extent = { 0, size - 1, 0, size - 1, 0, 0 };
  grid.spacing = Vector3(spacing, spacing, 1.0);
  grid.origin = Vector3(-0.5 * spacing * (size - 1), -0.5 * spacing * (size - 1), 0.0);
  return grid;
}

ScannedTube Cylinder(double x, double y, double radius, const MaterialAmounts& amounts)
{
  return { { x, y, -200.0 }, { x, y, 200.0 }, radius, radius, false, amounts };
}

/// What cells, focal spot, rays and straight lines between columns leave of a frequency, and a wire.
/// @param share  of Nyquist's frequency
double DesignedModulation(const ScannerSettings& s, double share, double wire)
{
  const double pitch = s.ColumnPitch() * s.sourceToAxis;
  const double f = share * 0.5 / pitch;
  const double width = s.channelPitch * s.fill;
  const double spot = s.focalSpot * (s.sourceToDetector / s.sourceToAxis - 1.0) / 2.3548;
  // Three neighbours, two rays a cell, straight lines, a disc.
  const double blur = (width * width / 12.0 + spot * spot) / (s.channelPitch * s.channelPitch);
  const double cells = 1.0 - blur * (1.0 - std::cos(Pi * share));
  const double rays = std::cos(0.25 * Pi * share);
  const double line = share > 0.0 ? std::sin(0.5 * Pi * share) / (0.5 * Pi * share) : 1.0;
  const double u = 2.0 * Pi * f * wire;
  const double disc = u > 0.0 ? 2.0 * std::cyl_bessel_j(1.0, u) / u : 1.0;
  return HalfScanReconstruction::Window(s.kernel, share) * line * line * cells * rays * disc;
}

/// A ray of ScannerProjector: sub-ray `a`, `b` of 2 x 2 in a cell.
void RayOf(const ScannerSettings& s, const ScannerView& view, int column, int row, int a, int b,
  Vector3& from, Vector3& direction)
{
  from = view.axis + s.sourceToAxis * Vector3(std::cos(view.angle), std::sin(view.angle), 0.0);
  const double angle = view.angle + Pi + s.ColumnAngle(column + 0.5 * a - 0.25);
  direction = Vector3(
    std::cos(angle), std::sin(angle), s.RowHeight(row + 0.5 * b - 0.25) / s.sourceToDetector)
                .normalized();
}

double BallChord(
  const Vector3& from, const Vector3& direction, const Vector3& centre, double radius)
{
  const double distance = (centre - from).cross(direction).norm();
  return distance < radius ? 2.0 * std::sqrt(radius * radius - distance * distance) : 0.0;
}
}

TEST(CtScanner, SpectrumAgreesWithTheTable)
{
  // Behind 28 cm of water on the central ray of the VCT: mean detected keV, HU of 1 mg/mL of iodine
  // and of 1 mg/cm^3 of hydroxyapatite in place of water, photons a cell and mAs.
  const double table[5][5] = { { 70, 55, 48, 2.1, 281 }, { 80, 60, 41, 1.8, 590 },
    { 100, 70, 31, 1.5, 1590 }, { 120, 80, 25, 1.3, 3120 }, { 140, 91, 20, 1.15, 5280 } };
  for (const auto& row : table)
  {
    ScannerSettings settings;
    settings.kilovolts = row[0];
    const ScannerPhysics physics(settings);
    const int middle = settings.channels / 2;
    const MaterialAmounts water(280.0f, 0.0f, 0.0f);
    EXPECT_NEAR(physics.DetectedEnergy(middle, water), row[1], 0.025 * row[1]) << row[0];
    EXPECT_NEAR(physics.Hounsfield({ 1.0f, 1.0f, 0.0f }), row[2], 0.06 * row[2]) << row[0];
    EXPECT_NEAR(physics.Hounsfield({ 1.0f - 0.1f / 3.16f, 0.0f, 100.0f }), 100.0 * row[3],
      0.06 * 100.0 * row[3])
      << row[0];
    const double exposure = settings.milliamperes * settings.turnTime / settings.viewsPerTurn;
    EXPECT_NEAR(physics.Photons(middle, water) / exposure, row[4], 0.07 * row[4]) << row[0];
  }
}

TEST(CtScanner, TissuesHaveTheirHounsfieldUnits)
{
  const TissueMaterials tissue;
  const ScannerPhysics physics{ ScannerSettings() };
  EXPECT_NEAR(physics.Hounsfield(tissue.Lung(-820.0)), -820.0, 0.1);
  EXPECT_NEAR(physics.Hounsfield(tissue.Fat(-95.0)), -95.0, 0.1);
  EXPECT_NEAR(physics.Hounsfield(tissue.Soft(55.0)), 55.0, 0.1);
  EXPECT_NEAR(physics.Hounsfield(tissue.Muscle(110.0)), 110.0, 0.1);
  EXPECT_NEAR(physics.Hounsfield(tissue.Blood(420.0)), 420.0, 0.1);
  EXPECT_NEAR(physics.Hounsfield(tissue.Calcified(850.0)), 850.0, 0.1);
  // Fat is brighter for harder X-rays, iodine darker.
  ScannerSettings soft;
  soft.kilovolts = 80.0;
  const ScannerPhysics low(soft);
  EXPECT_LT(low.Hounsfield(tissue.Fat(-95.0)), -100.0);
  EXPECT_GT(low.Hounsfield(tissue.Blood(420.0)), 600.0);
}

TEST(CtScanner, PoissonNumbersHaveTheirMeanAndVariance)
{
  for (const double mean : { 0.5, 5.0, 99.0, 101.0, 2000.0 })
  {
    constexpr int count = 40000;
    double sum = 0.0;
    double squares = 0.0;
    for (int i = 0; i < count; ++i)
    {
      const double n = PoissonNumber(mean, MixBits(static_cast<std::uint64_t>(i)));
      sum += n - mean;
      squares += (n - mean) * (n - mean);
    }
    EXPECT_NEAR(sum / count, 0.0, 5.0 * std::sqrt(mean / count)) << mean;
    EXPECT_NEAR(squares / count / mean, 1.0, 0.04) << mean;
  }
}

TEST(CtScanner, WaterPathsAreCorrected)
{
  ScannerSettings settings = CoarseScanner(8);
  for (const double kilovolts : { 70.0, 120.0, 140.0 })
  {
    settings.kilovolts = kilovolts;
    const ScannerPhysics physics(settings);
    for (const int column : { 0, 20, settings.channels / 2 })
    {
      const double air = physics.Signal(column, MaterialAmounts::Zero()).mean;
      for (float water = 5.0f; water < 600.0f; water += 7.0f)
      {
        const double signal = physics.Signal(column, { water, 0.0f, 0.0f }).mean;
        EXPECT_NEAR(physics.WaterPath(column, std::log(air / signal)), water, 2e-4 * water + 2e-3);
      }
    }
  }
}

TEST(CtScanner, BloodHardensTheBeam)
{
  // Along a ray through 28 cm of water of which 5 cm are blood of 420 HU: what the water correction makes
  // of it is darker than a thin layer is, and the more so behind more blood.
  const ScannerPhysics physics{ ScannerSettings() };
  const MaterialAmounts blood = TissueMaterials().Blood(420.0);
  const int middle = ScannerSettings().channels / 2;
  const double air = physics.Signal(middle, MaterialAmounts::Zero()).mean;
  const auto seen = [&](float depth)
  {
    const MaterialAmounts path = MaterialAmounts(280.0f - depth, 0.0f, 0.0f) + blood * depth;
    const double water =
      physics.WaterPath(middle, std::log(air / physics.Signal(middle, path).mean));
    return 1000.0 * (water - 280.0) / depth;
  };
  EXPECT_NEAR(seen(5.0f), 418.0, 4.0);
  EXPECT_NEAR(seen(50.0f), 395.0, 10.0);
  EXPECT_LT(seen(100.0f), seen(50.0f) - 10.0);
}

TEST(CtScanner, TubesAndBallsAreExact)
{
  const ScannerSettings settings = CoarseScanner(4);
  const ScannerProjector projector(settings);
  const ScannerView view{ 0.7, Vector3(3.0, -2.0, 10.0) };
  const Vector3 centre(20.0, -15.0, 14.0);
  const MaterialAmounts one(1.0f, 0.0f, 2.0f);
  ViewPaths paths;
  projector.Clear(paths);
  projector.Add({}, { { centre, 12.0, one } }, view, paths);
  // A long oblique cylinder: chord 2 sqrt(r^2 - d^2) / sine of the angle between ray and axis.
  const Vector3 axis = Vector3(0.3, -0.5, 1.0).normalized();
  ViewPaths tubes;
  projector.Clear(tubes);
  projector.Add(
    { { centre - 400.0 * axis, centre + 400.0 * axis, 3.0, 3.0, false, one } }, {}, view, tubes);
  double worst = 0.0;
  double longest = 0.0;
  for (int c = 0; c < settings.channels; ++c)
  {
    for (int r = 0; r < settings.rows; ++r)
    {
      double ball = 0.0;
      double tube = 0.0;
      for (const int a : { 0, 1 })
      {
        for (const int b : { 0, 1 })
        {
          Vector3 from;
          Vector3 direction;
          RayOf(settings, view, c, r, a, b, from, direction);
          ball += 0.25 * BallChord(from, direction, centre, 12.0);
          const Vector3 normal = direction.cross(axis);
          const double distance = std::abs((centre - from).dot(normal)) / normal.norm();
          tube += 0.25 * 2.0 * std::sqrt(std::max(0.0, 9.0 - distance * distance)) / normal.norm();
        }
      }
      const std::size_t at = static_cast<std::size_t>(c) * settings.rows + r;
      worst = std::max({ worst, std::abs(paths[0][at] - ball), std::abs(tubes[0][at] - tube) });
      longest = std::max(longest, ball);
      EXPECT_EQ(paths[2][at], 2.0f * paths[0][at]);
    }
  }
  EXPECT_GT(longest, 20.0);
  EXPECT_LE(worst, 1e-4);
}

TEST(CtScanner, ThinTubesKeepTheirVolume)
{
  // Sum over the cells of path times the beam's section at the strut: its volume, wherever it lies.
  const ScannerSettings settings;
  const ScannerProjector projector(settings);
  const MaterialAmounts one(1.0f, 0.0f, 0.0f);
  ViewPaths paths;
  for (const double angle : { 0.2, 1.9, 4.4 })
  {
    for (const double radius : { 0.04, 0.0999 })
    {
      const ScannerView view{ angle, Vector3(1.0, 2.0, 3.0) };
      const Vector3 from(14.3, -8.1, 5.2);
      const Vector3 to = from + Vector3(0.9, 0.7, 1.3);
      projector.Clear(paths);
      projector.Add({ { from, to, radius, radius, false, one } }, {}, view, paths);
      double sum = 0.0;
      for (const float path : paths[0])
      {
        sum += path;
      }
      const Vector3 middle = 0.5 * (from + to) - view.axis -
        settings.sourceToAxis * Vector3(std::cos(angle), std::sin(angle), 0.0);
      const double scale = settings.sourceToDetector / std::hypot(middle[0], middle[1]);
      const double section = settings.channelPitch * settings.rowPitch / (scale * scale);
      const double volume = Pi * radius * radius * (to - from).norm();
      // Rays through a tube of 0.2 mm are few.
      EXPECT_NEAR(sum * section / volume, 1.0, radius < 0.1 ? 0.01 : 0.15)
        << angle << ' ' << radius;
    }
  }
}

TEST(CtScanner, MetalIsSteel)
{
  // A strut's signal is that of steel at all energies that come through a patient.
  const MaterialAmounts metal = TissueMaterials().Metal();
  for (const double energy : { 40.0, 60.0, 80.0, 100.0, 120.0 })
  {
    const double water = LinearAttenuation(XRayMaterial::Water, energy);
    const double apatite = 1e-4 * MassAttenuation("Ca10P6O26H2", energy);
    EXPECT_NEAR((metal[0] * water + metal[2] * apatite) /
        LinearAttenuation(XRayMaterial::StainlessSteel, energy),
      1.0, 0.03)
      << energy;
  }
}

TEST(CtScanner, WhatOverlapsCountsOnce)
{
  const ScannerSettings settings = CoarseScanner(4);
  const ScannerProjector projector(settings);
  const ScannerView view;
  const MaterialAmounts one(1.0f, 0.0f, 0.0f);
  const ScannedTube whole{ { -30, 5, 0 }, { 30, 5, 4 }, 4.0, 4.0, false, one };
  // The same in two pieces whose ends overlap, a ball at the joint, and a plaque inside.
  const ScannedTube left{ { -30, 5, 0 }, { 6, 5, 2.4 }, 4.0, 4.0, false, one };
  const ScannedTube right{ { 0, 5, 2 }, { 30, 5, 4 }, 4.0, 4.0, true, one };
  ViewPaths wanted;
  ViewPaths paths;
  projector.Clear(wanted);
  projector.Clear(paths);
  projector.Add({ whole }, {}, view, wanted);
  projector.Add(
    { left, right }, { { { 10, 5, 2.7 }, 2.0, MaterialAmounts(100.0f, 0.0f, 0.0f) } }, view, paths);
  for (std::size_t n = 0; n < paths[0].size(); ++n)
  {
    EXPECT_NEAR(paths[0][n], wanted[0][n], 1e-4);
  }
}

TEST(CtScanner, VoxelsAreProjectedAsFineAsTheyAre)
{
  const ScannerSettings settings = CoarseScanner(4);
  const ScannerProjector projector(settings);
  const Vector3 centre(8.0, -5.0, 2.0);
  constexpr double radius = 25.0;
  MaterialVolume volume;
  ImageGrid grid;
  grid.extent = { 0, 79, 0, 69, 0, 64 };
  grid.origin = Vector3(-32.0, -40.0, -30.0);
  volume.SetGrid(grid);
  std::size_t at = 0;
  for (int i = 0; i <= 79; ++i)
  {
    for (int j = 0; j <= 69; ++j)
    {
      for (int k = 0; k <= 64; ++k, ++at)
      {
        const double d = (grid.IndexToWorld(i, j, k) - centre).norm() - radius;
        volume.maps[0][at] = static_cast<float>(std::clamp(0.5 - d, 0.0, 1.0));
      }
    }
  }
  volume.FindColumns();
  for (const double angle : { 0.1, 0.8, 2.0, 4.0 })
  {
    const ScannerView view{ angle, Vector3::Zero() };
    ViewPaths paths;
    projector.Clear(paths);
    projector.Add(volume, view, paths);
    for (int c = 0; c < settings.channels; ++c)
    {
      for (int r = 0; r < settings.rows; ++r)
      {
        Vector3 from;
        Vector3 direction;
        RayOf(settings, view, c, r, 0, 0, from, direction);
        const double column = angle + Pi + settings.ColumnAngle(c);
        direction = Vector3(
          std::cos(column), std::sin(column), settings.RowHeight(r) / settings.sourceToDetector)
                      .normalized();
        const double wanted = BallChord(from, direction, centre, radius);
        // Voxels of 1 mm: at the rim a chord changes by its square root.
        EXPECT_NEAR(paths[0][static_cast<std::size_t>(c) * settings.rows + r], wanted,
          wanted > 30.0 ? 0.3 : 6.0);
      }
    }
  }
}

TEST(CtScanner, WeightsOfARayFromBothSidesSumToOne)
{
  const ScannerSettings settings = CoarseScanner(2);
  const HalfScanReconstruction reconstruction(settings, settings.kernel);
  const int count = settings.HalfScanViews();
  int pairs = 0;
  for (int v = 0; v < count; v += 5)
  {
    for (int c = 0; c < settings.channels; c += 7)
    {
      const double gamma = settings.ColumnAngle(c);
      const double other = v + (Pi + 2.0 * gamma) / settings.ViewAngle();
      const double column = c - 2.0 * gamma / settings.ColumnPitch();
      // At the fan's rim the ramps are as short as the steps between views.
      if (other <= count - 1 && std::abs(gamma) < 0.8 * settings.HalfFan())
      {
        ++pairs;
        // Between two views: the weight is linear enough there.
        const int before = static_cast<int>(other);
        const double u = other - before;
        const double weight = (1.0 - u) * reconstruction.Weight(before, column) +
          u * reconstruction.Weight(std::min(count - 1, before + 1), column);
        EXPECT_NEAR(reconstruction.Weight(v, c) + weight, 1.0, 0.02) << v << ' ' << c;
      }
    }
  }
  EXPECT_GT(pairs, 500);
}

TEST(CtScanner, WaterIsFlat)
{
  ScannerSettings settings = CoarseScanner(4);
  settings.rows = 2;
  const ImageGrid grid = Plane(64, 4.0);
  for (const auto kernel :
    { ReconstructionKernel::Soft, ReconstructionKernel::Standard, ReconstructionKernel::Sharp })
  {
    settings.kernel = kernel;
    const std::vector<float> image =
      Reconstruct(settings, { Cylinder(10, 0, 115, { 1.0f, 0.0f, 0.0f }) }, grid);
    double worst = 0.0;
    for (int j = 0; j < 64; ++j)
    {
      for (int i = 0; i < 64; ++i)
      {
        const Vector3 p = grid.IndexToWorld(i, j, 0);
        if (std::hypot(p[0] - 10.0, p[1]) < 100.0)
        {
          worst = std::max(worst, std::abs(1000.0 * (image[j * 64 + i] - 1.0)));
        }
      }
    }
    EXPECT_LT(worst, 5.0);
  }
}

TEST(CtScanner, KernelsResolveWhatTheyAreDesignedFor)
{
  // The line spread of a thin wire, and what its frequencies have lost: by window, interpolation,
  // cells, focal spot and the wire's own width.
  ScannerSettings settings;
  settings.rows = 2;
  constexpr int size = 128;
  constexpr double spacing = 0.15;
  // Off the axis, where the wire falls on all places between columns.
  ImageGrid grid = Plane(size, spacing);
  grid.origin += Vector3(12.0, 9.0, 0.0);
  const double pitch = settings.ColumnPitch() * settings.sourceToAxis;
  for (const auto kernel :
    { ReconstructionKernel::Soft, ReconstructionKernel::Standard, ReconstructionKernel::Sharp })
  {
    settings.kernel = kernel;
    const std::vector<float> image =
      Reconstruct(settings, { Cylinder(12.0, 9.0, 0.25, { 1.0f, 0.0f, 0.0f }) }, grid);
    // Over all directions: what lies between columns is mirrored at Nyquist's frequency, with a phase
    // that changes from view to view.
    const auto modulation = [&](double frequency) // lp/mm
    {
      double sum = 0.0;
      for (int j = 0; j < size; ++j)
      {
        for (int i = 0; i < size; ++i)
        {
          // Hann's window: the wire's streaks do not end at the image's edge.
          const auto hann = [&](double n) { return 1.0 - std::cos(2.0 * Pi * (n + 0.5) / size); };
          const Vector3 p = grid.IndexToWorld(i, j, 0);
          sum += hann(i) * hann(j) * image[j * size + i] *
            std::cyl_bessel_j(0.0, 2.0 * Pi * frequency * std::hypot(p[0] - 12.0, p[1] - 9.0));
        }
      }
      return sum;
    };
    // The lowest frequencies need a wider image: the ratio of two others is compared.
    const auto designed = [&](double share) { return DesignedModulation(settings, share, 0.25); };
    const double unit = modulation(0.15 * 0.5 / pitch) / designed(0.15);
    for (const double share : { 0.3, 0.45, 0.6, 0.75 })
    {
      EXPECT_NEAR(modulation(share * 0.5 / pitch) / unit, designed(share), 0.05)
        << static_cast<int>(kernel) << ' ' << share;
    }
  }
}

TEST(CtScanner, WhatMovesIsASumOverItsPlaces)
{
  // A wire that goes 6 mm along a line in a half scan, against the filtered line integrals of a point,
  // summed view by view without detector, voxels or interpolation.
  ScannerSettings settings;
  settings.rows = 2;
  settings.kernel = ReconstructionKernel::Soft;
  constexpr double radius = 0.3;
  const int count = settings.HalfScanViews();
  const auto placeOf = [&](int view)
  {
    const double u = static_cast<double>(view) / (count - 1) - 0.5;
    return Eigen::Vector2d(14.0 + 6.0 * u, -11.0 + 2.0 * u);
  };
  constexpr int size = 56;
  ImageGrid grid = Plane(size, 0.4);
  grid.origin += Vector3(14.0, -11.0, 0.0);
  const std::vector<float> image = Reconstruct(
    settings,
    [&](int view) -> std::vector<ScannedTube>
    {
      const Eigen::Vector2d at = placeOf(view);
      return { Cylinder(at[0], at[1], radius, { 1.0f, 0.0f, 0.0f }) };
    },
    grid);

  // The point's kernel over the angle from it, in steps of a twentieth of a column.
  const double pitch = settings.ColumnPitch();
  constexpr int fine = 20;
  std::vector<double> kernel(80 * fine);
  for (std::size_t n = 0; n < kernel.size(); ++n)
  {
    const double angle = static_cast<double>(n) / fine * pitch;
    constexpr int steps = 600;
    for (int k = 0; k < steps; ++k)
    {
      const double share = (k + 0.5) / steps;
      const double f = 0.5 * share / pitch;
      kernel[n] += 2.0 * f * DesignedModulation(settings, share, radius) *
        std::cos(2.0 * Pi * f * angle) * 0.5 / pitch / steps;
    }
  }
  const HalfScanReconstruction reconstruction(settings, settings.kernel);
  std::vector<double> sum(image.size());
  for (int v = 0; v < count; ++v)
  {
    const double beta = FirstAngle + v * settings.ViewAngle();
    const Eigen::Vector2d tube =
      settings.sourceToAxis * Eigen::Vector2d(std::cos(beta), std::sin(beta));
    const auto fanAngle = [&](const Eigen::Vector2d& at)
    {
      const Eigen::Vector2d to = at - tube;
      return std::remainder(std::atan2(to[1], to[0]) - beta - Pi, 2.0 * Pi);
    };
    const Eigen::Vector2d at = placeOf(v);
    const double gamma = fanAngle(at);
    const double column = gamma / pitch + 0.5 * (settings.channels - 1) + settings.channelOffset;
    const double weight = reconstruction.Weight(v, column) * settings.sourceToAxis *
      std::cos(gamma) * Pi * radius * radius / (at - tube).norm() * settings.ViewAngle();
    for (int j = 0; j < size; ++j)
    {
      for (int i = 0; i < size; ++i)
      {
        const Vector3 p = grid.IndexToWorld(i, j, 0);
        const Eigen::Vector2d pixel(p[0], p[1]);
        const double away = std::abs(fanAngle(pixel) - gamma) / pitch * fine;
        sum[j * size + i] += weight * kernel[static_cast<std::size_t>(std::lround(away))] /
          (pixel - tube).squaredNorm();
      }
    }
  }
  double peak = 0.0;
  double squares = 0.0;
  double worst = 0.0;
  for (std::size_t n = 0; n < sum.size(); ++n)
  {
    peak = std::max(peak, sum[n]);
    worst = std::max(worst, std::abs(image[n] - sum[n]));
    squares += (image[n] - sum[n]) * (image[n] - sum[n]);
  }
  EXPECT_GT(peak, 0.01);
  EXPECT_LT(worst, 0.1 * peak);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(sum.size())), 0.02 * peak);
}

TEST(CtScanner, NoiseFollowsKernelAndDose)
{
  ScannerSettings settings = CoarseScanner(4);
  settings.rows = 2;
  settings.noise = 1;
  const ImageGrid grid = Plane(64, 1.7);
  const std::vector<ScannedTube> water{ Cylinder(0, 0, 115, { 1.0f, 0.0f, 0.0f }) };
  const auto deviation = [&]
  {
    const std::vector<float> image = Reconstruct(settings, water, grid);
    ScannerSettings quiet = settings;
    quiet.noise = 0;
    const std::vector<float> mean = Reconstruct(quiet, water, grid);
    double squares = 0.0;
    for (std::size_t n = 0; n < image.size(); ++n)
    {
      squares += (image[n] - mean[n]) * (image[n] - mean[n]);
    }
    return std::sqrt(squares / static_cast<double>(image.size()));
  };
  // White noise of the views: f^2 W^2, and what straight lines between columns leave of it.
  const auto designed = [](ReconstructionKernel kernel)
  {
    double sum = 0.0;
    for (double f = 0.0005; f < 1.0; f += 0.001)
    {
      const double w = f * HalfScanReconstruction::Window(kernel, f);
      sum += w * w * (2.0 + std::cos(Pi * f)) / 3.0;
    }
    return std::sqrt(sum);
  };
  const double standard = deviation();
  settings.kernel = ReconstructionKernel::Soft;
  EXPECT_NEAR(deviation() / standard,
    designed(ReconstructionKernel::Soft) / designed(ReconstructionKernel::Standard), 0.05);
  settings.kernel = ReconstructionKernel::Sharp;
  EXPECT_NEAR(deviation() / standard,
    designed(ReconstructionKernel::Sharp) / designed(ReconstructionKernel::Standard), 0.12);
  settings.kernel = ReconstructionKernel::Standard;
  settings.milliamperes /= 4.0;
  EXPECT_NEAR(deviation() / standard, 2.0, 0.1);
}

TEST(CtScanner, StacksCoverTheImage)
{
  for (const double pitch : { 0.0, 0.15 })
  {
    for (const int segments : { 1, 2 })
    {
      ScannerSettings settings;
      settings.pitch = pitch;
      settings.segments = segments;
      const ScannerSchedule schedule(settings, -60.0, 70.0, 0.8);
      for (const double phase : { 0.0, 0.4, 1.0 })
      {
        const std::vector<GatedStack> stacks = schedule.Stacks(phase);
        if (pitch == 0.0)
        {
          ASSERT_EQ(stacks.size(), 4u);
        }
        for (double z = -60.0; z <= 70.0; z += 0.7)
        {
          const std::vector<double> weights = schedule.Weights(stacks, z);
          double sum = 0.0;
          for (std::size_t s = 0; s < stacks.size(); ++s)
          {
            sum += weights[s];
            if (weights[s] > 0.0)
            {
              // All of the views have the slice before the detector.
              for (const GatedView& view : stacks[s].views)
              {
                EXPECT_LE(std::abs(schedule.Table(schedule.Seconds(view.number)) - z),
                  0.5 * settings.SlabHeight() + 1e-9);
              }
            }
          }
          EXPECT_NEAR(sum, 1.0, 1e-12) << z;
        }
      }
    }
  }
}

TEST(CtScanner, StepAndShootSeesSlabsInBeatsOfTheirOwn)
{
  ScannerSettings settings;
  const ScannerSchedule schedule(settings, -60.0, 70.0, 0.8);
  const std::vector<GatedStack> stacks = schedule.Stacks(0.5);
  for (int s = 0; s < static_cast<int>(stacks.size()); ++s)
  {
    EXPECT_EQ(stacks[s].beats, std::vector<int>{ 2 * s });
    const ScannerBeat& beat = schedule.Beat(2 * s);
    EXPECT_NEAR(schedule.Phase(beat.start), 2.0 * s, 1e-9);
    EXPECT_NEAR(schedule.Phase(beat.start + 0.5 * beat.interval), 2.0 * s + 0.5, 1e-9);
    EXPECT_NEAR(beat.interval, 0.8, 0.8 * 0.061);
    // Triggered by the mean interval; the heart is in one place in all of the beat.
    EXPECT_NEAR(stacks[s].middle - beat.start, 0.4, 1e-9);
    EXPECT_LT((schedule.Shift(beat.start + 0.4) - beat.shift).norm(), 1e-12);
    EXPECT_LT(beat.shift.cwiseAbs().maxCoeff(), 2.0 * settings.heartShift + 1e-9);
  }
  settings.extrasystole = 3;
  const ScannerSchedule early(settings, -60.0, 70.0, 0.8);
  EXPECT_NEAR(early.Beat(2).interval, 0.48, 1e-9);
  // What is triggered at 75 % of a usual beat sees the next one.
  EXPECT_GT(early.Phase(early.Beat(2).start + 0.6), 3.0);
  // Gated afterwards it is a share of the beat's own interval.
  settings.pitch = 0.15;
  const ScannerSchedule helical(settings, -60.0, 70.0, 0.8);
  for (const GatedStack& stack : helical.Stacks(0.75))
  {
    EXPECT_NEAR(helical.Phase(stack.middle), stack.beats.front() + 0.75, 1e-9);
  }
}

TEST(CtScanner, ViewsAreThoseNearestToTheWantedMoment)
{
  const auto stackOf = [](const ScannerSettings& settings, double cycle)
  {
    const ScannerSchedule schedule(settings, -15.0, 15.0, cycle);
    const GatedStack stack = schedule.Stacks(0.6).front();
    // Every angle counts once, and has the angle of its position.
    std::vector<double> sums(settings.HalfScanViews());
    for (const GatedView& view : stack.views)
    {
      sums[view.position] += view.weight;
      const double wanted = stack.firstAngle + view.position * settings.ViewAngle();
      EXPECT_NEAR(
        std::remainder(schedule.Angle(view.number, view.tube) - wanted, 2.0 * Pi), 0.0, 1e-9);
    }
    for (const double sum : sums)
    {
      EXPECT_NEAR(sum, 1.0, 1e-5);
    }
    return stack;
  };
  ScannerSettings settings;
  settings.beatDeviation = 0.0;
  const double view = settings.turnTime / settings.viewsPerTurn;
  const GatedStack one = stackOf(settings, 0.8);
  EXPECT_EQ(one.views.size(), static_cast<std::size_t>(settings.HalfScanViews()));
  EXPECT_NEAR(one.worst, 0.5 * settings.HalfScanTime(), view);
  // A second tube, and a second beat, bring the views nearer; but for blending at the seams.
  ScannerSettings dual = settings;
  dual.sources = 2;
  EXPECT_NEAR(stackOf(dual, 0.8).worst, 0.5 * dual.HalfScanTime(), 0.01);
  ScannerSettings two = settings;
  two.segments = 2;
  EXPECT_LT(stackOf(two, 0.8).worst, 0.65 * one.worst);
  // Beats that are whole turns bring the same angles again: nothing is won.
  EXPECT_NEAR(stackOf(two, 2.0 * settings.turnTime).worst, one.worst, 0.01);
}

/// A still cylinder of water with a wire in it.
class StillCylinder : public ScannedAnatomy
{
public:
  double CycleLength() const override { return 0.8; }
  CoronaryPhantom::Box Body() const override
  {
    return { Vector3(-120.0, -120.0, -1.0), Vector3(120.0, 120.0, 1.0) };
  }
  void Render(const PatientState&, const ImageGrid& grid, MaterialVolume& volume,
    const ProgressCallback&) const override
  {
    volume.SetGrid(grid);
    for (std::vector<float>& map : volume.maps)
    {
      std::fill(map.begin(), map.end(), 0.0f);
    }
    volume.FindColumns();
  }
  std::vector<ScannedTube> Tubes(const PatientState&) const override
  {
    return { Cylinder(18.0, -12.0, 2.0, { 1.0f, 14.0f, 0.0f }),
      Cylinder(0.0, 0.0, 115.0, { 1.0f, 0.0f, 0.0f }) };
  }
  std::vector<ScannedBall> Balls(const PatientState&) const override { return {}; }
};

TEST(CtScanner, WaysOfScanningAgreeOnWhatIsStill)
{
  const StillCylinder anatomy;
  ImageGrid grid = Plane(48, 2.0);
  grid.spacing[2] = 4.0;
  grid.extent[5] = 9;
  const std::size_t plane = 48 * 48;
  for (const auto& [pitch, segments, sources] : { std::tuple{ 0.0, 1, 1 }, std::tuple{ 0.2, 1, 1 },
         std::tuple{ 0.0, 2, 1 }, std::tuple{ 0.15, 2, 1 }, std::tuple{ 0.2, 1, 2 } })
  {
    ScannerSettings settings = CoarseScanner(8);
    settings.pitch = pitch;
    settings.segments = segments;
    settings.sources = sources;
    settings.anatomySpacing = 4.0;
    CtScanner scanner(anatomy, settings, grid, { 0.3, 0.75 });
    MemoryScanStore store;
    scanner.Scan(store);
    for (const std::size_t phase : { 0, 1 })
    {
      std::vector<std::int16_t> image(10 * plane);
      scanner.Image(phase, 0, store, image.data());
      double wire = 0.0;
      Vector3 centre = Vector3::Zero();
      for (int k = 0; k < 10; ++k)
      {
        for (int j = 0; j < 48; ++j)
        {
          for (int i = 0; i < 48; ++i)
          {
            const Vector3 p = grid.IndexToWorld(i, j, k);
            const double value = image[k * plane + j * 48 + i];
            const double away = std::hypot(p[0] - 18.0, p[1] + 12.0);
            if (away < 10.0)
            {
              wire += value;
              centre += value * p;
            }
            else if (away > 25.0)
            {
              EXPECT_NEAR(value, 0.0, 25.0) << pitch << ' ' << segments << ' ' << sources;
            }
          }
        }
      }
      EXPECT_NEAR(centre[0] / wire, 18.0, 0.3) << pitch << ' ' << segments << ' ' << sources;
      EXPECT_NEAR(centre[1] / wire, -12.0, 0.3) << pitch << ' ' << segments << ' ' << sources;
    }
  }
}

TEST(CtScanner, TheCurrentIsThatOfTheWantedNoise)
{
  const StillCylinder anatomy;
  const ImageGrid grid = Plane(48, 0.8);
  ScannerSettings settings = CoarseScanner(4);
  settings.rows = 4;
  settings.noise = 1;
  settings.anatomySpacing = 4.0;
  const std::vector<ScanVariant> variants{ { ReconstructionKernel::Soft, 15.0 },
    { ReconstructionKernel::Standard, 15.0 }, { ReconstructionKernel::Standard, 45.0 } };
  CtScanner scanner(anatomy, settings, grid, { 0.75 }, variants);
  MemoryScanStore store;
  scanner.Scan(store);
  for (std::size_t v = 0; v < variants.size(); ++v)
  {
    std::vector<std::int16_t> image(48 * 48);
    scanner.Image(0, v, store, image.data());
    double squares = 0.0;
    int count = 0;
    for (int j = 0; j < 48; ++j)
    {
      for (int i = 0; i < 48; ++i)
      {
        const Vector3 p = grid.IndexToWorld(i, j, 0);
        if (std::hypot(p[0] - 18.0, p[1] + 12.0) > 8.0)
        {
          squares += static_cast<double>(image[j * 48 + i]) * image[j * 48 + i];
          ++count;
        }
      }
    }
    // The slice lies at one place between two rows, not anywhere.
    EXPECT_NEAR(std::sqrt(squares / count) / variants[v].imageNoise, 0.87, 0.12) << v;
  }
  EXPECT_GT(scanner.Milliamperes(1), 1.5 * scanner.Milliamperes(0));
  EXPECT_GT(scanner.Milliamperes(1), 8.0 * scanner.Milliamperes(2));
}

TEST(CtScanner, SmoothingWithinEdgesTakesNoise)
{
  const std::array<int, 3> size{ 60, 60, 24 };
  std::vector<float> image(60 * 60 * 24);
  std::vector<float> clean(image.size());
  RandomStream random(5);
  for (std::size_t n = 0; n < image.size(); ++n)
  {
    clean[n] = n % 60 < 30 ? 0.0f : 400.0f;
    image[n] = clean[n] + static_cast<float>(30.0 * random.Normal());
  }
  EXPECT_NEAR(ImageNoise(image, size), 30.0, 2.0);
  const std::vector<float> before = image;
  for (const double share : { 0.3, 0.6 })
  {
    image = before;
    SmoothWithinEdges(image, size, share);
    EXPECT_NEAR(ImageNoise(image, size), 30.0 * (1.0 - share), 2.0);
    // The edge is as high as it was, one voxel beside it.
    double step = 0.0;
    for (std::size_t row = 0; row < image.size(); row += 60)
    {
      step += (image[row + 30] - image[row + 29]) / (60.0 * 24.0);
    }
    EXPECT_NEAR(step, 400.0, 60.0) << share;
  }
}

TEST(CtScanner, RefusesWhatCanNotBe)
{
  const CoronaryPhantom phantom{ PhantomSettings() };
  const ScannedPhantom anatomy(phantom);
  const ImageGrid grid = phantom.DefaultGrid(4.0);
  const auto refused = [&](const char* reason, const auto& change)
  {
    ScannerSettings settings;
    ImageGrid image = grid;
    change(settings, image);
    ExpectRefusal([&] { CtScanner(anatomy, settings, image, { 0.75 }); }, reason);
  };
  refused("kilovolts is 60", [](ScannerSettings& s, ImageGrid&) { s.kilovolts = 60.0; });
  refused("rows", [](ScannerSettings& s, ImageGrid&) { s.rows = 0; });
  refused("turn_s", [](ScannerSettings& s, ImageGrid&) { s.turnTime = NAN; });
  refused("nearer to the tube", [](ScannerSettings& s, ImageGrid&) { s.sourceToDetector = 500.0; });
  refused("fan is wider", [](ScannerSettings& s, ImageGrid&) { s.channels = 2000; });
  refused("cone is too wide", [](ScannerSettings& s, ImageGrid&) { s.rows = 600; });
  refused("multiple of 4",
    [](ScannerSettings& s, ImageGrid&)
    {
      s.sources = 2;
      s.viewsPerTurn = 985;
    });
  refused("leaves holes", [](ScannerSettings& s, ImageGrid&) { s.pitch = 0.5; });
  refused("leaves holes",
    [](ScannerSettings& s, ImageGrid&)
    {
      s.pitch = 0.2;
      s.segments = 3;
    });
  refused("half scan takes", [](ScannerSettings& s, ImageGrid&) { s.turnTime = 1.5; });
  refused("does not fit into the field", [](ScannerSettings& s, ImageGrid&) { s.channels = 500; });
  refused("reaches out of the field",
    [](ScannerSettings&, ImageGrid& image) { image.origin[0] = 300.0; });
  refused("direction", [](ScannerSettings&, ImageGrid& image) { image.direction(0, 0) = -1.0; });
  ExpectRefusal([] { ScannerPreset("none"); }, "single-350, single-330, dual-280");
  for (const std::string& name : ScannerPresets())
  {
    EXPECT_NO_THROW(CtScanner(anatomy, ScannerPreset(name), grid, { 0.75 })) << name;
  }
}

TEST(CtScanner, SeesTheHeart)
{
  PhantomSettings heart;
  heart.calcifiedPlaques = 3;
  heart.noise = 0.0;
  const CoronaryPhantom phantom(heart);
  const ImageGrid grid = phantom.DefaultGrid(4.0);
  std::vector<std::int16_t> formula(
    static_cast<std::size_t>(grid.extent[1] + 1) * (grid.extent[3] + 1) * (grid.extent[5] + 1));
  phantom.Render(grid, grid.extent, 0.7, formula.data());
  for (const int sources : { 1, 2 })
  {
    ScannerSettings settings = CoarseScanner(6);
    settings.sources = sources;
    settings.anatomySpacing = 3.0;
    settings.anatomyStep = 0.06;
    settings.heartShift = 0.0;
    settings.beatDeviation = 0.0;
    settings.noise = 1;
    const ScannedPhantom anatomy(phantom);
    CtScanner scanner(anatomy, settings, grid, { 0.35, 0.7 });
    std::vector<std::int16_t> image(formula.size());
    MemoryScanStore store;
    scanner.Scan(store);
    scanner.Image(1, 0, store, image.data());
    // Where the formula's image is even, the scanner's has the same value in the mean.
    for (const auto& [value, tolerance] :
      // Blood hardens the beam for itself.
      { std::pair{ 420, 40.0 }, std::pair{ 110, 15.0 }, std::pair{ -820, 15.0 } })
    {
      double sum = 0.0;
      int count = 0;
      for (std::size_t n = 0; n < image.size(); ++n)
      {
        if (std::abs(formula[n] - value) <= 1)
        {
          sum += image[n];
          ++count;
        }
      }
      ASSERT_GT(count, 100);
      EXPECT_NEAR(sum / count, value, tolerance) << sources;
    }
    // One thread, and a scan that goes on where another one was stopped, come to the same.
    std::vector<std::int16_t> again(image.size());
    SetNumberOfThreads(1);
    MemoryScanStore halfway;
    halfway.Put("0-0-0", store.Get("0-0-0"));
    halfway.Put("1-1-0", store.Get("1-1-0"));
    scanner.Scan(halfway);
    scanner.Image(1, 0, halfway, again.data());
    SetNumberOfThreads(0);
    EXPECT_EQ(image, again);
  }
}
}
