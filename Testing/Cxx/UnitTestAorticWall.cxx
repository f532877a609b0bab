// The aorta's wall: its completion against closed forms, and measured in images of the phantom, whose wall is known.

#include "AorticArch.h"
#include "AorticModel.h"
#include "AorticWall.h"
#include "CoronaryPhantom.h"
#include "Refusals.h"
#include "SurfaceMeasures.h"
#include "TriangleBvh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

namespace UnitTestAorticWall
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

AorticEnd Upright()
{
  AorticEnd end;
  end.position = Vector3(10.0, -20.0, 250.0);
  end.direction = Vector3::UnitZ();
  end.radius = 16.0;
  end.ascendingRadius = 15.0;
  end.length = 50.0;
  end.valveHeight = 200.0;
  return end;
}

/// Directions are tangents, they turn no faster than an arc of 20 mm, radii change by less than a tenth of the way.
void ExpectSmooth(const AorticCourse& course, const AorticEnd& end)
{
  EXPECT_LT((course.stations.front().position - end.position).norm(), 1e-12);
  EXPECT_LT((course.stations.front().direction - end.direction).norm(), 1e-12);
  EXPECT_NEAR(course.stations.front().radius, end.radius, 1e-12);
  for (std::size_t n = 1; n < course.stations.size(); ++n)
  {
    const AorticCourse::Station& a = course.stations[n - 1];
    const AorticCourse::Station& b = course.stations[n];
    const double step = b.length - a.length;
    EXPECT_NEAR(b.direction.norm(), 1.0, 1e-9);
    EXPECT_LT((b.direction - a.direction).norm(), step / 17.0) << n;
    EXPECT_LT(std::abs(b.radius - a.radius), 0.1 * step) << n;
    const Vector3 chord = (b.position - a.position).normalized();
    EXPECT_GT(chord.dot((a.direction + b.direction).normalized()), 0.999) << n;
  }
}

/// Rings along a line, of a radius by their height.
std::vector<AorticRing> Cylinder(double length, const Vector3& direction, double radius)
{
  std::vector<AorticRing> rings;
  const Vector3 u = direction.unitOrthogonal();
  const Vector3 v = direction.cross(u);
  for (double s = 0.0; s <= length; s += 1.0)
  {
    AorticRing ring;
    ring.centre = Vector3(5.0, 6.0, 7.0) + s * direction;
    for (int n = 0; n < 48; ++n)
    {
      const double angle = 2.0 * Pi * n / 48;
      // A little three-lobed, like the root.
      const double r = radius * (1.0 + 0.05 * std::cos(3.0 * angle));
      ring.rim.push_back(ring.centre + r * (std::cos(angle) * u + std::sin(angle) * v));
    }
    rings.push_back(std::move(ring));
  }
  return rings;
}

/// A part of the phantom with root, ascending and descending aorta.
struct Scan
{
  ImageGrid grid;
  std::vector<std::int16_t> values;
  std::vector<PhantomOstium> ostia;
  std::vector<AorticRing> wall;

  CoronaryOstia Find() const { return FindCoronaryOstia({ values.data(), grid }); }
};

/// @param up  mm above the ostia that the image goes
Scan MakeScan(std::uint64_t seed, double spacing, double up)
{
  constexpr double phase = 0.75;
  PhantomSettings settings;
  settings.seed = seed;
  settings.temporalWindow = 0.0;
  const CoronaryPhantom phantom(settings);
  Scan scan;
  scan.ostia = phantom.Ostia(phase);
  scan.wall = phantom.Aorta(phase);
  const Vector3 centre = 0.5 * (scan.ostia[0].position + scan.ostia[1].position);
  const Vector3 low(-48.0, -45.0, -42.0);
  const Vector3 span(92.0, 142.0, 42.0 + up);
  scan.grid.spacing.setConstant(spacing);
  scan.grid.origin = centre + low;
  std::size_t count = 1;
  for (int axis = 0; axis < 3; ++axis)
  {
    scan.grid.extent[2 * axis] = 0;
    scan.grid.extent[2 * axis + 1] = static_cast<int>(span[axis] / spacing);
    count *= static_cast<std::size_t>(scan.grid.extent[2 * axis + 1]) + 1;
  }
  scan.values.resize(count);
  phantom.Render(scan.grid, scan.grid.extent, phase, scan.values.data());
  return scan;
}

const Scan& Standard()
{
  static const Scan scan = MakeScan(1, 0.9, 60.0);
  return scan;
}

const CoronaryOstia& StandardOstia()
{
  static const CoronaryOstia found = Standard().Find();
  return found;
}

void ExpectClosed(const AorticModel& model)
{
  const SurfaceMeasures measures = MeasureSurface(model.points, model.triangles);
  EXPECT_TRUE(measures.Closed());
  EXPECT_TRUE(measures.Manifold());
  EXPECT_EQ(measures.components, 1);
  EXPECT_EQ(measures.eulerCharacteristic, 2);
  EXPECT_EQ(measures.unusedPoints, 0U);
  EXPECT_GT(measures.volume, 0.0);
  EXPECT_EQ(model.measured.size(), model.points.size());
}

/// The measured wall of a phantom beside the true one.
void ExpectTrueWall(const Scan& scan, const CoronaryOstia& found)
{
  const AorticWall wall = MeasureAorticWall({ scan.values.data(), scan.grid }, found);
  ASSERT_EQ(wall.why, "");
  EXPECT_TRUE(wall.toBorder);
  EXPECT_GT(wall.seen, 0.9);
  const AorticModel model = ModelAorta(wall.rings);
  ExpectClosed(model);
  const AorticModel truth = ModelAorta(scan.wall);
  const TriangleBvh trueWall(truth.points, truth.triangles);
  const TriangleBvh measured(model.points, model.triangles);
  double sum = 0.0;
  double most = 0.0;
  int count = 0;
  constexpr double end = 5.0;   // mm that do not count, also above the true valve
  constexpr double mouth = 6.0; // mm around an ostium
  const Vector3 up = (truth.axis[10] - truth.axis[0]).normalized();
  for (const AorticRing& ring : wall.rings)
  {
    if ((ring.centre - truth.axis[0]).dot(up) < end ||
      (ring.centre - wall.rings.front().centre).norm() < end ||
      (ring.centre - wall.rings.back().centre).norm() < end)
    {
      continue;
    }
    for (const Vector3& p : ring.rim)
    {
      if ((p - scan.ostia[0].position).norm() > mouth &&
        (p - scan.ostia[1].position).norm() > mouth)
      {
        const double distance = trueWall.Closest(p).distance;
        sum += distance;
        most = std::max(most, distance);
        ++count;
      }
    }
  }
  ASSERT_GT(count, 2000);
  EXPECT_LT(sum / count, 0.5);
  EXPECT_LT(most, 2.0);
  testing::Test::RecordProperty("mean_mm", std::to_string(sum / count));
  testing::Test::RecordProperty("most_mm", std::to_string(most));
  for (const PhantomOstium& ostium : scan.ostia)
  {
    EXPECT_LT(measured.Closest(ostium.position).distance, 1.5) << ostium.name;
  }
  // The ventricle is not in it: it begins where it usually does, or at the narrowest place.
  const double valve =
    (0.5 * (scan.ostia[0].position + scan.ostia[1].position) - model.axis.front()).norm();
  EXPECT_GT(valve, 8.0);
  EXPECT_LT(valve, 24.0);
}
}

TEST(AorticArch, AnUprightAortaIsClosedForms)
{
  const AorticEnd end = Upright();
  const AorticCourse course = CompleteAorta(end);
  ExpectSmooth(course, end);
  const double radius = 2.2 * 15.0;
  EXPECT_NEAR(course.ascending, 25.0, 1e-9);
  // As exactly as the axis is integrated.
  EXPECT_NEAR(course.arch, Pi * radius, 1e-3);
  EXPECT_NEAR(course.descending, 275.0 - 90.0, 1e-4);
  const AorticCourse::Station& last = course.stations.back();
  EXPECT_NEAR(last.length, course.ascending + course.arch + course.descending, 1e-9);
  EXPECT_NEAR(last.position[2], 90.0, 1e-9);
  // To the left and to the back.
  const double turn = 63.0 * Pi / 180.0;
  EXPECT_NEAR(last.position[0], 10.0 + 2.0 * radius * std::cos(turn), 1e-4);
  EXPECT_NEAR(last.position[1], -20.0 + 2.0 * radius * std::sin(turn), 1e-4);
  EXPECT_LT((last.direction + Vector3::UnitZ()).norm(), 1e-9);
  EXPECT_NEAR(last.radius, 15.0 * 24.3 / 30.9, 1e-9);
  double highest = 0.0;
  for (std::size_t n = 1; n < course.stations.size(); ++n)
  {
    highest = std::max(highest, course.stations[n].position[2]);
    EXPECT_LE(course.stations[n].length - course.stations[n - 1].length, 2.0 + 1e-9);
    EXPECT_LE(course.stations[n].radius, course.stations[n - 1].radius + 1e-12);
  }
  EXPECT_NEAR(highest, 275.0 + radius, 0.05);
}

TEST(AorticArch, DiametersAreThoseOfHager)
{
  for (const auto& [degrees, diameter] : std::vector<std::pair<double, double>>{ { -20.0, 30.9 },
         { 0.0, 30.9 }, { 30.0, 29.4 }, { 60.0, 27.7 }, { 110.0, 26.1 }, { 180.0, 24.7 } })
  {
    EXPECT_NEAR(AorticArchTaper(degrees * Pi / 180.0), diameter / 30.9, 1e-9) << degrees;
  }
}

TEST(AorticArch, AnEndThatLeansIsTurnedIntoTheArch)
{
  AorticEnd end = Upright();
  for (const Vector3& way : { Vector3(-0.3, -0.2, 0.93), Vector3(0.3, -0.5, 0.8),
         Vector3(0.5, 0.7, 0.5), Vector3(0.45, 0.89, -0.2) })
  {
    SCOPED_TRACE(testing::PrintToString(std::vector<double>{ way[0], way[1], way[2] }));
    end.direction = way.normalized();
    const AorticCourse course = CompleteAorta(end);
    ExpectSmooth(course, end);
    EXPECT_TRUE(course.reached);
    EXPECT_LT((course.stations.back().direction + Vector3::UnitZ()).norm(), 1e-9);
    // What has turned already is no second time in the arc.
    const double turned = std::atan2(
      end.direction.dot(Vector3(std::cos(63.0 * Pi / 180.0), std::sin(63.0 * Pi / 180.0), 0.0)),
      end.direction[2]);
    EXPECT_NEAR(course.arch, 33.0 * (Pi - turned), 0.25 * course.arch);
  }
}

TEST(AorticArch, LeadsToADescendingAortaThatIsSeen)
{
  AorticEnd end = Upright();
  end.direction = Vector3(0.2, 0.1, 0.9).normalized();
  AorticArchSettings settings;
  settings.descending =
    DescendingAorta{ Vector3(35.0, 50.0, 240.0), Vector3(-0.05, 0.1, -1.0).normalized() };
  const AorticCourse course = CompleteAorta(end, settings);
  ExpectSmooth(course, end);
  EXPECT_TRUE(course.reached);
  const AorticCourse::Station& last = course.stations.back();
  EXPECT_LT((last.direction - settings.descending->direction).norm(), 1e-9);
  EXPECT_NEAR(last.position[2], 90.0, 1e-6);
  const Vector3 from = last.position - settings.descending->place;
  EXPECT_LT(from.cross(settings.descending->direction).norm(), 1e-3);
  // Too near for an arc of that width.
  settings.descending->place = end.position + Vector3(0.0, 12.0, -30.0);
  EXPECT_FALSE(CompleteAorta(end, settings).reached);
}

TEST(AorticArch, RefusesWhatIsNoAorta)
{
  AorticEnd end = Upright();
  end.direction = -Vector3::UnitZ();
  ExpectRefusal([&] { CompleteAorta(end); }, "points down");
  end.direction = Vector3(0.0, 0.0, 0.5);
  ExpectRefusal([&] { CompleteAorta(end); }, "direction");
  end = Upright();
  end.radius = 0.0;
  ExpectRefusal([&] { CompleteAorta(end); }, "radius");
  AorticArchSettings settings;
  settings.width = 1.0;
  ExpectRefusal([&] { CompleteAorta(Upright(), settings); }, "width must be 1.5 to 5");
  settings = {};
  settings.spacing = 0.0;
  ExpectRefusal([&] { CompleteAorta(Upright(), settings); }, "spacing");
  settings = {};
  settings.descending = DescendingAorta{ Vector3(35.0, 50.0, 240.0), Vector3::UnitZ() };
  ExpectRefusal([&] { CompleteAorta(Upright(), settings); }, "downwards");
}

TEST(AorticModel, IsAClosedTubeThatGoesOnSmoothly)
{
  const Vector3 direction = Vector3(-0.2, -0.1, 0.95).normalized();
  const std::vector<AorticRing> rings = Cylinder(60.0, direction, 15.0);
  const AorticModel model = ModelAorta(rings);
  ExpectClosed(model);
  EXPECT_NEAR(model.measuredLength, 60.0, 1e-9);
  EXPECT_NEAR(model.ascendingRadius, RadiusOf(rings.front()), 1e-9);
  double length = 0.0;
  for (std::size_t n = 1; n < model.axis.size(); ++n)
  {
    const double step = (model.axis[n] - model.axis[n - 1]).norm();
    length += step;
    // Radius by less than 0.2 mm, direction by less than 5 degrees from one section to the next, also at the joint.
    EXPECT_LT(std::abs(model.radius[n] - model.radius[n - 1]), 0.2) << n;
    if (n > 1)
    {
      const Vector3 before = (model.axis[n - 1] - model.axis[n - 2]).normalized();
      const Vector3 after = (model.axis[n] - model.axis[n - 1]).normalized();
      EXPECT_GT(before.dot(after), std::cos(5.0 * Pi / 180.0)) << n;
    }
  }
  EXPECT_NEAR(length, model.measuredLength + model.ascending + model.arch + model.descending, 0.5);
  EXPECT_NEAR(model.axis.back()[2], 7.0 - 110.0, 1e-6);
  // What was seen stays as it is.
  const auto seen = std::count(model.axisMeasured.begin(), model.axisMeasured.end(), 1);
  EXPECT_EQ(seen, static_cast<std::ptrdiff_t>(rings.size()));
  EXPECT_EQ(std::count(model.measured.begin(), model.measured.end(), 1),
    static_cast<std::ptrdiff_t>(rings.size() * 48));
  for (std::size_t n = 0; n < rings.size() * 48; ++n)
  {
    ASSERT_EQ(model.points[n], rings[n / 48].rim[n % 48]);
  }
  // The lobes are gone at the end, and the polygon has the circle's area.
  const std::size_t last = (model.axis.size() - 1) * 48;
  for (std::size_t n = 0; n < 48; ++n)
  {
    EXPECT_NEAR((model.points[last + n] - model.axis.back()).norm(), model.radius.back(), 0.05);
  }
  EXPECT_NEAR(model.radius.back(), model.ascendingRadius * 24.3 / 30.9, 1e-6);
}

TEST(AorticModel, GoesItsUsualWayWhereNoArchReachesTheDescendingAorta)
{
  AorticArchSettings settings;
  const std::vector<AorticRing> rings = Cylinder(40.0, Vector3::UnitZ(), 14.0);
  settings.descending = DescendingAorta{ Vector3(35.0, 60.0, 0.0), -Vector3::UnitZ() };
  const AorticModel towards = ModelAorta(rings, settings);
  EXPECT_TRUE(towards.towardsSeen);
  EXPECT_LT((towards.axis.back() - Vector3(35.0, 60.0, 7.0 - 110.0)).norm(), 1e-3);
  settings.descending->place = Vector3(5.0, 20.0, 0.0);
  const AorticModel usual = ModelAorta(rings, settings);
  EXPECT_FALSE(usual.towardsSeen);
  EXPECT_EQ(usual.points, ModelAorta(rings).points);
}

TEST(AorticModel, RefusesRingsThatDoNotFit)
{
  std::vector<AorticRing> rings = Cylinder(10.0, Vector3::UnitZ(), 12.0);
  ExpectRefusal([&] { ModelAorta({ rings[0], rings[1] }); }, "three cross-sections");
  std::vector<AorticRing> other = rings;
  other[3].rim.pop_back();
  ExpectRefusal([&] { ModelAorta(other); }, "differ in their points");
  other = rings;
  std::swap(other[3], other[4]);
  ExpectRefusal([&] { ModelAorta(other); }, "not in order");
}

TEST(AorticWall, IsThePhantoms)
{
  ExpectTrueWall(Standard(), StandardOstia());
}

TEST(AorticWall, IsAnotherPhantoms)
{
  const Scan scan = MakeScan(4, 1.0, 45.0);
  ExpectTrueWall(scan, scan.Find());
}

TEST(AorticWall, TheDescendingAortaIsSeen)
{
  const std::optional<DescendingAorta> line = DescendingLine(StandardOstia());
  ASSERT_TRUE(line.has_value());
  // The phantom's stands upright.
  EXPECT_NEAR(line->place[0], -12.0, 1.5);
  EXPECT_NEAR(line->place[1], 55.0, 1.5);
  EXPECT_LT(line->direction[2], -0.99);
  AorticArchSettings settings;
  settings.descending = line;
  const AorticWall wall =
    MeasureAorticWall({ Standard().values.data(), Standard().grid }, StandardOstia());
  ASSERT_EQ(wall.why, "");
  const AorticModel model = ModelAorta(wall.rings, settings);
  EXPECT_TRUE(model.towardsSeen);
  EXPECT_NEAR(model.axis.back()[0], -12.0, 4.0);
  EXPECT_NEAR(model.axis.back()[1], 55.0, 4.0);
  ExpectClosed(model);
}

TEST(AorticWall, SaysWhyThereIsNone)
{
  const Scan& scan = Standard();
  EXPECT_EQ(
    MeasureAorticWall({ scan.values.data(), scan.grid }, {}).why, "no ascending aorta was found");
  // Too little of it above the ostia, and blood that has no edge.
  CoronaryOstia found = StandardOstia();
  Scan cut = scan;
  cut.grid.extent[5] = static_cast<int>(44.0 / scan.grid.spacing[2]);
  const AorticWall low = MeasureAorticWall({ cut.values.data(), cut.grid }, found);
  EXPECT_TRUE(low.rings.empty());
  EXPECT_NE(low.why.find("from the valve on are in the image"), std::string::npos) << low.why;
  const std::vector<std::int16_t> flat(scan.values.size(), 400);
  const AorticWall none = MeasureAorticWall({ flat.data(), scan.grid }, found);
  EXPECT_TRUE(none.rings.empty());
  EXPECT_NE(none.why.find("show an edge"), std::string::npos) << none.why;
}

TEST(AorticWall, SameResultForAnyNumberOfThreads)
{
  const ScalarImage image{ Standard().values.data(), Standard().grid };
  SetNumberOfThreads(1);
  const AorticWall one = MeasureAorticWall(image, StandardOstia());
  SetNumberOfThreads(4);
  const AorticWall four = MeasureAorticWall(image, StandardOstia());
  SetNumberOfThreads(0);
  ASSERT_EQ(one.rings.size(), four.rings.size());
  for (std::size_t n = 0; n < one.rings.size(); ++n)
  {
    EXPECT_EQ(one.rings[n].rim, four.rings[n].rim);
  }
}
}
