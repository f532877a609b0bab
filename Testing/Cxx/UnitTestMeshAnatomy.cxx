// Anatomy of closed surfaces for the scanner against closed forms: masses, line integrals, HU, motion.
#include "CoarseScanner.h"
#include "CtScanner.h"
#include "MeshAnatomy.h"

#include "Refusals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>

namespace UnitTestMeshAnatomy
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;
const MaterialAmounts Iodine = []
{
  MaterialAmounts amounts = MaterialAmounts::Zero();
  amounts[1] = 1.0f;
  return amounts;
}();

/// A ball of 20 * 4^splits triangles.
AnatomyPart Ball(const Vector3& centre, double radius, int splits)
{
  AnatomyPart part;
  part.name = "ball";
  part.material = Iodine;
  part.phases = { 0.0 };
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  std::vector<Vector3> points{ { -1, g, 0 }, { 1, g, 0 }, { -1, -g, 0 }, { 1, -g, 0 }, { 0, -1, g },
    { 0, 1, g }, { 0, -1, -g }, { 0, 1, -g }, { g, 0, -1 }, { g, 0, 1 }, { -g, 0, -1 },
    { -g, 0, 1 } };
  part.triangles = { { 0, 11, 5 }, { 0, 5, 1 }, { 0, 1, 7 }, { 0, 7, 10 }, { 0, 10, 11 },
    { 1, 5, 9 }, { 5, 11, 4 }, { 11, 10, 2 }, { 10, 7, 6 }, { 7, 1, 8 }, { 3, 9, 4 }, { 3, 4, 2 },
    { 3, 2, 6 }, { 3, 6, 8 }, { 3, 8, 9 }, { 4, 9, 5 }, { 2, 4, 11 }, { 6, 2, 10 }, { 8, 6, 7 },
    { 9, 8, 1 } };
  for (int n = 0; n < splits; ++n)
  {
    std::map<std::pair<std::int64_t, std::int64_t>, std::int64_t> middles;
    const auto middle = [&](std::int64_t a, std::int64_t b)
    {
      const auto [at, isNew] = middles.try_emplace(
        { std::min(a, b), std::max(a, b) }, static_cast<std::int64_t>(points.size()));
      if (isNew)
      {
        const Vector3 between = points[a].normalized() + points[b].normalized();
        points.push_back(between);
      }
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : part.triangles)
    {
      const std::int64_t ab = middle(a, b);
      const std::int64_t bc = middle(b, c);
      const std::int64_t ca = middle(c, a);
      finer.insert(finer.end(), { { a, ab, ca }, { b, bc, ab }, { c, ca, bc }, { ab, bc, ca } });
    }
    part.triangles = finer;
  }
  for (Vector3& point : points)
  {
    point = centre + radius * point.normalized();
  }
  part.positions = { points };
  return part;
}

/// A round tube with flat ends, of 64 sides and 24 rings.
AnatomyPart Tube(const Vector3& start, const Vector3& end, double radius)
{
  constexpr int sides = 64;
  constexpr int rings = 24;
  AnatomyPart part;
  part.name = "tube";
  part.material = Iodine;
  part.phases = { 0.0 };
  const Vector3 axis = (end - start).normalized();
  const Vector3 u = axis.unitOrthogonal();
  const Vector3 v = axis.cross(u);
  std::vector<Vector3> points;
  for (int r = 0; r < rings; ++r)
  {
    for (int s = 0; s < sides; ++s)
    {
      const double angle = 2.0 * Pi * s / sides;
      points.push_back(start + (end - start) * (static_cast<double>(r) / (rings - 1)) +
        radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
  }
  points.push_back(start);
  points.push_back(end);
  for (std::int64_t s = 0; s < sides; ++s)
  {
    const std::int64_t next = (s + 1) % sides;
    const std::int64_t last = (rings - 1) * sides;
    for (std::int64_t r = 0; r < last; r += sides)
    {
      part.triangles.push_back({ r + s, r + next, r + sides + next });
      part.triangles.push_back({ r + s, r + sides + next, r + sides + s });
    }
    part.triangles.push_back({ rings * sides, next, s });
    part.triangles.push_back({ rings * sides + 1, last + s, last + next });
  }
  part.positions = { points };
  return part;
}

double MeshVolume(const AnatomyPart& part)
{
  double volume = 0.0;
  const std::vector<Vector3>& points = part.positions.front();
  for (const Triangle& t : part.triangles)
  {
    volume += points[t[0]].dot(points[t[1]].cross(points[t[2]])) / 6.0;
  }
  return volume;
}

AnatomyTrunk EmptyTrunk()
{
  AnatomyTrunk trunk;
  trunk.width = 200.0;
  trunk.depth = 160.0;
  return trunk;
}

ImageGrid Voxels(double spacing, double half)
{
  ImageGrid grid;
  const int steps = static_cast<int>(2.0 * half / spacing);
  grid.extent = { 0, steps, 0, steps, 0, steps };
  grid.spacing = Vector3::Constant(spacing);
  grid.origin = Vector3::Constant(-0.5 * steps * spacing);
  return grid;
}

/// Mass of a basis material, mm^3 times amount, and its centre.
double Mass(const MaterialVolume& volume, int basis, Vector3* centre = nullptr)
{
  const std::array<int, 6>& e = volume.grid.extent;
  double sum = 0.0;
  Vector3 moment = Vector3::Zero();
  std::size_t at = 0;
  for (int i = e[0]; i <= e[1]; ++i)
  {
    for (int j = e[2]; j <= e[3]; ++j)
    {
      for (int k = e[4]; k <= e[5]; ++k, ++at)
      {
        sum += volume.maps[basis][at];
        moment += volume.maps[basis][at] * volume.grid.IndexToWorld(i, j, k);
      }
    }
  }
  if (centre)
  {
    *centre = moment / sum;
  }
  return sum * volume.grid.spacing.prod();
}

MaterialVolume Rendered(
  const MeshAnatomy& anatomy, const ImageGrid& grid, const PatientState& state = {})
{
  MaterialVolume volume;
  anatomy.Render(state, grid, volume, {});
  volume.FindColumns();
  return volume;
}
}

TEST(MeshAnatomy, MassesOfThinTubesAreExact)
{
  const ImageGrid grid = Voxels(0.5, 14.0);
  for (const double diameter : { 0.3, 0.5, 1.0, 4.0 })
  {
    // Along the axes, on voxels' sides and off them, and oblique.
    for (const Vector3& half : { Vector3(10, 0, 0), Vector3(0, 10, 0), Vector3(0, 0, 10),
           Vector3(6, 5, 4), Vector3(1, -2, 9) })
    {
      for (const double off : { 0.0, 0.13, 0.25 })
      {
        const Vector3 middle = Vector3::Constant(off);
        const AnatomyPart tube = Tube(middle - half, middle + half, 0.5 * diameter);
        const double wanted = 0.25 * Pi * diameter * diameter * 2.0 * half.norm();
        const double mesh = MeshVolume(tube);
        Vector3 centre;
        const double mass =
          Mass(Rendered(MeshAnatomy({ tube }, 0.8, EmptyTrunk()), grid), 1, &centre);
        EXPECT_NEAR(mass / mesh, 1.0, 1e-5) << diameter << ' ' << half.transpose();
        EXPECT_NEAR(mass / wanted, 1.0, 0.002) << diameter << ' ' << half.transpose();
        // A share of a box counts at its middle.
        EXPECT_LT((centre - middle).norm(), 0.25) << diameter << ' ' << half.transpose();
      }
    }
  }
}

TEST(MeshAnatomy, LineIntegralsAreThoseOfABall)
{
  const Vector3 centre(20.0, -15.0, 4.0);
  constexpr double radius = 12.0;
  const MeshAnatomy anatomy({ Ball(centre, radius, 5) }, 0.8, EmptyTrunk());
  const ScannerSettings settings = CoarseScanner(4);
  const ScannerProjector projector(settings);
  ImageGrid grid = Voxels(0.5, 16.0);
  grid.origin += centre;
  const MaterialVolume volume = Rendered(anatomy, grid);
  EXPECT_NEAR(Mass(volume, 1) / (4.0 / 3.0 * Pi * std::pow(radius, 3)), 1.0, 1e-3);
  for (const double angle : { 0.1, 0.8, 2.0, 4.0 })
  {
    ViewPaths paths;
    projector.Clear(paths);
    projector.Add(volume, { angle, Vector3::Zero() }, paths);
    const Vector3 from = settings.sourceToAxis * Vector3(std::cos(angle), std::sin(angle), 0.0);
    double longest = 0.0;
    for (int c = 0; c < settings.channels; ++c)
    {
      for (int r = 0; r < settings.rows; ++r)
      {
        const double column = angle + Pi + settings.ColumnAngle(c);
        const Vector3 ray = Vector3(
          std::cos(column), std::sin(column), settings.RowHeight(r) / settings.sourceToDetector)
                              .normalized();
        const double distance = (centre - from).cross(ray).norm();
        const double wanted =
          distance < radius ? 2.0 * std::sqrt(radius * radius - distance * distance) : 0.0;
        longest = std::max(longest, wanted);
        // At the rim a chord changes by its square root.
        EXPECT_NEAR(paths[1][static_cast<std::size_t>(c) * settings.rows + r], wanted,
          wanted > 12.0 ? 0.12 : 2.5);
      }
    }
    EXPECT_GT(longest, 23.0);
  }
}

TEST(MeshAnatomy, PartsMoveSmoothlyAndKeepTheirMass)
{
  // A circle in the plane, known at eight phases.
  AnatomyPart ball = Ball(Vector3::Zero(), 3.0, 2);
  const std::vector<Vector3> rest = ball.positions.front();
  ball.phases.clear();
  ball.positions.clear();
  const auto place = [](double phase)
  { return Vector3(6.0 * std::cos(2.0 * Pi * phase), 6.0 * std::sin(2.0 * Pi * phase), 1.0); };
  for (int p = 0; p < 8; ++p)
  {
    ball.phases.push_back(p / 8.0);
    std::vector<Vector3>& points = ball.positions.emplace_back(rest);
    for (Vector3& point : points)
    {
      point += place(p / 8.0);
    }
  }
  AnatomyPart calcium = Ball(Vector3(0.0, 0.0, -8.0), 2.0, 2);
  calcium.still = true;
  calcium.material = MaterialAmounts::Zero();
  calcium.material[2] = 5.0f;
  const double mass = MeshVolume(Ball(Vector3::Zero(), 3.0, 2));
  const MeshAnatomy anatomy({ ball, calcium }, 0.8, EmptyTrunk());
  for (const double phase : { 0.0, 0.375, 0.8125, 7.06 })
  {
    const PatientState state{ phase, Vector3(0.7, -0.4, 1.1), 0.6 };
    const MaterialVolume volume = Rendered(anatomy, Voxels(0.5, 14.0), state);
    Vector3 centre;
    EXPECT_NEAR(Mass(volume, 1, &centre), 0.6 * mass, 1e-4 * mass);
    EXPECT_LT((centre - place(phase) - state.shift).norm(), 0.02) << phase;
    EXPECT_GT(Mass(volume, 2, &centre), 100.0);
    EXPECT_LT((centre - Vector3(0.0, 0.0, -8.0)).norm(), 0.01) << phase;
  }
  Vector3 mean = Vector3::Zero();
  const std::vector<Vector3> surface = anatomy.Surface(0, 0.5625);
  for (const Vector3& point : surface)
  {
    mean += point / static_cast<double>(surface.size());
  }
  EXPECT_LT((mean - place(0.5625)).norm(), 0.02);
  EXPECT_LT((anatomy.Heart().low - Vector3(-9.0, -9.0, -2.0)).norm(), 0.2);
}

TEST(MeshAnatomy, LaterPartsReplaceEarlierOnes)
{
  AnatomyPart outer = Ball(Vector3(3.0, 1.0, 2.0), 9.0, 3);
  AnatomyPart inner = Ball(Vector3(4.0, 1.0, 2.0), 5.0, 3);
  outer.material = MaterialAmounts::Zero();
  outer.material[0] = 0.5f;
  AnatomyTrunk trunk = EmptyTrunk();
  trunk.material[0] = 1.0f;
  const ImageGrid grid = Voxels(0.5, 14.0);
  const MaterialVolume volume = Rendered(MeshAnatomy({ outer, inner }, 0.8, trunk), grid);
  const double all = std::pow((grid.extent[1] + 1) * 0.5, 3);
  const double big = MeshVolume(outer);
  const double small = MeshVolume(inner);
  EXPECT_NEAR(Mass(volume, 0), all - big + 0.5 * (big - small), 1e-4 * all);
  EXPECT_NEAR(Mass(volume, 1), small, 1e-4 * small);
  // The other way round nothing is left of the small one.
  EXPECT_NEAR(Mass(Rendered(MeshAnatomy({ inner, outer }, 0.8, trunk), grid), 1), 0.0, 1e-3);
}

TEST(MeshAnatomy, TheScannerSeesHounsfieldUnits)
{
  const TissueMaterials tissue;
  AnatomyPart blood = Ball(Vector3(20.0, -10.0, 0.0), 14.0, 3);
  AnatomyPart lung = Ball(Vector3(-30.0, 5.0, 0.0), 15.0, 3);
  blood.material = MaterialOf(tissue, "blood", 300.0, "HU");
  lung.material = MaterialOf(tissue, "lung", {}, "HU");
  AnatomyTrunk trunk;
  trunk.width = 220.0;
  trunk.depth = 180.0;
  trunk.material = MaterialOf(tissue, "water", {}, "HU");
  const MeshAnatomy anatomy({ blood, lung }, 0.8, trunk);
  ScannerSettings settings = CoarseScanner(6);
  settings.anatomySpacing = 2.0;
  settings.anatomyStep = 0.1;
  settings.heartShift = 0.0;
  ImageGrid grid;
  grid.extent = { 0, 49, 0, 29, 0, 0 };
  grid.spacing = Vector3(2.0, 2.0, 2.0);
  grid.origin = Vector3(-50.0, -30.0, 0.0);
  CtScanner scanner(anatomy, settings, grid, { 0.75 });
  MemoryScanStore store;
  scanner.Scan(store);
  std::vector<std::int16_t> image(50 * 30);
  scanner.Image(0, 0, store, image.data());
  const auto mean = [&](double x, double y)
  {
    double sum = 0.0;
    int count = 0;
    for (int j = 0; j < 30; ++j)
    {
      for (int i = 0; i < 50; ++i)
      {
        const Vector3 p = grid.IndexToWorld(i, j, 0);
        if (std::hypot(p[0] - x, p[1] - y) < 7.0)
        {
          sum += image[j * 50 + i];
          ++count;
        }
      }
    }
    return sum / count;
  };
  // HU are those behind 28 cm of water: behind 20 cm iodine is brighter.
  EXPECT_NEAR(mean(20.0, -10.0), 310.0, 15.0);
  EXPECT_NEAR(mean(-30.0, 5.0), -820.0, 25.0);
  EXPECT_NEAR(mean(-5.0, 10.0), 0.0, 15.0);
}

TEST(MeshAnatomy, MaterialsAreWhatTheyAreCalled)
{
  const TissueMaterials tissue;
  const ScannerPhysics physics{ ScannerSettings() };
  const auto hounsfield = [&](const char* name, std::optional<double> value, const char* unit)
  { return physics.Hounsfield(MaterialOf(tissue, name, value, unit)); };
  for (const auto& [name, usual] : { std::pair{ "water", 0.0 }, std::pair{ "fat", -95.0 },
         std::pair{ "soft", 55.0 }, std::pair{ "muscle", 110.0 }, std::pair{ "lung", -820.0 },
         std::pair{ "bone", 700.0 }, std::pair{ "blood", 420.0 }, std::pair{ "calcium", 850.0 } })
  {
    EXPECT_NEAR(hounsfield(name, {}, "HU"), usual, 0.2) << name;
  }
  EXPECT_NEAR(hounsfield("blood", 330.0, "HU"), 330.0, 0.2);
  // docs/scanner.md: blood of 420 HU has 14 mg/mL, a plaque of 850 HU 600 mg/cm^3.
  EXPECT_NEAR(hounsfield("blood", 14.0, "mg/mL"), 420.0, 12.0);
  EXPECT_NEAR(hounsfield("calcium", 600.0, "mg/cm3"), 850.0, 25.0);
  EXPECT_EQ(MaterialOf(tissue, "muscle", 2.5, "mg/mL")[1], 2.5f);
  const auto refused =
    [&](const char* name, std::optional<double> value, const char* unit, const char* reason)
  { ExpectRefusal([&] { MaterialOf(tissue, name, value, unit); }, reason); };
  refused("gold", {}, "HU", "material 'gold' is none of water, fat");
  refused("fat", 5.0, "mg/mL", "unit 'mg/mL': fat has HU");
  refused("blood", 5.0, "mg/cm3", "HU or mg/mL");
  refused("blood", {}, "mg/mL", "needs a value");
  refused("calcium", 4000.0, "mg/cm3", "0 to 3160");
  refused("lung", -1000.0, "HU", "above -1000");
  refused("lung", NAN, "HU", "above -1000");
}

TEST(MeshAnatomy, RefusesWhatIsNotASolid)
{
  const auto refused = [](const char* reason, const auto& change)
  {
    AnatomyPart part = Ball(Vector3::Zero(), 5.0, 1);
    change(part);
    ExpectRefusal([&] { MeshAnatomy({ part }, 0.8); }, "part 'ball'", reason);
  };
  refused("surface is open: 3 edges", [](AnatomyPart& part) { part.triangles.pop_back(); });
  refused("doubled", [](AnatomyPart& part) { part.triangles.push_back(part.triangles.back()); });
  refused("finite", [](AnatomyPart& part) { part.positions[0][3][1] = NAN; });
  refused("as many phases", [](AnatomyPart& part) { part.phases = { 0.0, 0.5 }; });
  refused("different numbers of points",
    [](AnatomyPart& part)
    {
      part.phases = { 0.0, 0.5 };
      part.positions.push_back(part.positions[0]);
      part.positions[1].pop_back();
    });
  refused("surface 2 of 2 is inside out",
    [](AnatomyPart& part)
    {
      part.phases = { 0.0, 0.5 };
      part.positions.push_back(part.positions[0]);
      for (Vector3& point : part.positions[1])
      {
        point[0] = -point[0];
      }
    });
  refused("0.001",
    [](AnatomyPart& part)
    {
      part.phases = { 0.25, 1.2501 };
      part.positions.push_back(part.positions[0]);
    });
  ExpectRefusal([] { MeshAnatomy({}, 0.8); }, "no part");
  ExpectRefusal([] { MeshAnatomy({ Ball(Vector3::Zero(), 5.0, 1) }, 0.0); }, "cycle");
  // Triangles that look inwards are turned over; the usual trunk is around all parts.
  AnatomyPart turned = Ball(Vector3(100.0, 0.0, 0.0), 120.0, 1);
  for (Triangle& triangle : turned.triangles)
  {
    std::swap(triangle[0], triangle[1]);
  }
  const MeshAnatomy anatomy({ turned }, 0.8);
  EXPECT_GT(Mass(Rendered(anatomy, Voxels(20.0, 300.0)), 1), 1e6);
  EXPECT_GT(anatomy.Trunk().width, 330.0);
}
}
