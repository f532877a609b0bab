// Reformats of tubes whose grey values, widths and places are known; ways from the ostium by name.

#include "CoronaryAnatomy.h"
#include "CurvedReformat.h"
#include "FunctionImage.h"
#include "Refusals.h"
#include "VesselChains.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace UnitTestCurvedReformat
{
using namespace coronary;

namespace
{
constexpr double Lumen = 400.0;
constexpr double Wall = 60.0;
constexpr double Fat = -95.0;

/// Lumen, wall and fat by the distance from an axis, blurred by 0.3 mm.
double VesselValue(double away, double lumen, double outer)
{
  const auto inside = [&](double radius)
  { return 0.5 * std::erfc((away - radius) / (std::sqrt(2.0) * 0.3)); };
  return Fat + (Wall - Fat) * inside(outer) + (Lumen - Wall) * inside(lumen);
}

constexpr double HelixRadius = 9.0; // mm
constexpr double Rise = 4.0;        // mm a radian

Vector3 Helix(double t)
{
  return { HelixRadius * std::cos(t), HelixRadius * std::sin(t), Rise * t };
}

/// Distance from the helix, exact to 1e-6 mm.
double FromHelix(const Vector3& p)
{
  double best = 1e9;
  for (double start = -4.0; start <= 4.0; start += 0.5)
  {
    double t = start;
    for (int round = 0; round < 20; ++round)
    {
      const Vector3 tangent(-HelixRadius * std::sin(t), HelixRadius * std::cos(t), Rise);
      t += (p - Helix(t)).dot(tangent) / tangent.squaredNorm();
    }
    best = std::min(best, (p - Helix(t)).norm());
  }
  return best;
}

const Scene& HelicalTube()
{
  static const Scene scene(
    [](const Vector3& p)
    {
      // Far from the helix' cylinder nothing has to be looked for.
      const double off = std::abs(std::hypot(p.x(), p.y()) - HelixRadius);
      return off > 6.0 ? Fat : VesselValue(FromHelix(p), 2.0, 3.0);
    },
    76, 0.5);
  return scene;
}

/// A tube along z through the image's middle.
const Scene& StraightTube()
{
  static const Scene scene(
    [](const Vector3& p) { return VesselValue(std::hypot(p.x(), p.y()), 2.0, 3.0); }, 81, 0.4);
  return scene;
}

constexpr double HalfLevel = 0.5 * (Lumen + Wall);
}

TEST(ReformatVessel, AStraightTubeHasItsWidthAtAnyAngle)
{
  const ImageInterpolator image(StraightTube().image);
  const std::vector<Vector3> axis = { { 0, 0, -14 }, { 0, 0, 3 }, { 0, 0, 14 } };
  for (const ReformatKind kind : { ReformatKind::Straightened, ReformatKind::Curved })
  {
    for (const double angle : { 0.0, 37.0, 90.0 })
    {
      ReformatSettings settings;
      settings.kind = kind;
      settings.angle = angle;
      settings.halfWidth = 5.0;
      settings.spacing = 0.2;
      const VesselReformat reformat = ReformatVessel(image, axis, settings);
      ASSERT_EQ(reformat.picture.width, 141);
      ASSERT_EQ(reformat.picture.height, 51);
      for (int x = 0; x < reformat.picture.width; x += 7)
      {
        EXPECT_NEAR(reformat.ArcAt(x), 0.2 * x, 1e-9);
        EXPECT_NEAR(WidthAt(reformat.picture, x, HalfLevel, 0.2), 4.0, 0.08) << angle;
      }
    }
  }
}

TEST(ReformatVessel, AHelixBecomesAStraightBandOfTheTrueWidth)
{
  const ImageInterpolator image(HelicalTube().image);
  ReformatSettings settings;
  settings.spacing = 0.2;
  settings.halfWidth = 4.0;
  const std::vector<Vector3> axis = Curve(Helix, -3.0, 3.0, 800);
  const double length = 6.0 * std::hypot(HelixRadius, Rise);
  for (const double angle : { 0.0, 60.0 })
  {
    settings.angle = angle;
    const VesselReformat reformat = ReformatVessel(image, axis, settings);
    // As long as the vessel, to a pixel.
    EXPECT_NEAR(reformat.picture.width * settings.spacing, length, 1.01 * settings.spacing);
    const int middle = reformat.picture.height / 2;
    for (int x = 5; x + 5 < reformat.picture.width; x += 6)
    {
      EXPECT_NEAR(WidthAt(reformat.picture, x, HalfLevel, settings.spacing), 4.0, 0.1) << x;
      EXPECT_GT(reformat.picture.At(x, middle), 0.97 * Lumen) << x;
      EXPECT_NEAR(reformat.picture.At(x, middle - 10), reformat.picture.At(x, middle + 10), 25.0);
    }
  }
}

TEST(ReformatVessel, ThePlaceOfEveryPixelIsKnown)
{
  const Vector3 slope(3.0, -2.0, 5.0);
  const Scene scene([&](const Vector3& p) { return 100.0 + slope.dot(p); }, 64, 0.8);
  const ImageInterpolator image(scene.image);
  const std::vector<Vector3> axis = Curve(Helix, -2.0, 2.0, 500);
  for (const ReformatKind kind : { ReformatKind::Straightened, ReformatKind::Curved })
  {
    ReformatSettings settings;
    settings.kind = kind;
    settings.halfWidth = 5.0;
    settings.angle = 20.0;
    const VesselReformat reformat = ReformatVessel(image, axis, settings);
    ASSERT_EQ(reformat.place.size(), reformat.picture.values.size());
    for (std::size_t n = 0; n < reformat.place.size(); n += 11)
    {
      const float value = reformat.picture.values[n];
      const auto width = static_cast<std::size_t>(reformat.picture.width);
      const PicturePlace at = { 0.25 * double(n % width),
        0.25 * (reformat.picture.height / 2 - static_cast<int>(n / width)) };
      ASSERT_LT((reformat.WorldOf(at) - reformat.place[n]).norm(), 1e-9);
      if (image.Contains(reformat.place[n]))
      {
        ASSERT_NEAR(value, 100.0 + slope.dot(reformat.place[n]), 2e-3);
      }
      else
      {
        ASSERT_TRUE(std::isnan(value));
      }
    }
  }
}

TEST(ReformatVessel, TheCurvedSheetIsUnrolledWithoutStretching)
{
  const ImageInterpolator image(HelicalTube().image);
  const std::vector<Vector3> axis = Curve(Helix, -2.0, 2.0, 800);
  const double length = 4.0 * std::hypot(HelixRadius, Rise);
  for (const double angle : { 0.0, 45.0, 90.0 })
  {
    ReformatSettings settings;
    settings.kind = ReformatKind::Curved;
    settings.angle = angle;
    settings.halfWidth = 4.0;
    settings.spacing = 0.1;
    const VesselReformat reformat = ReformatVessel(image, axis, settings);
    // The axis is as long in the picture as in the world.
    double track = 0.0;
    for (std::size_t n = 1; n < reformat.track.size(); ++n)
    {
      track += std::hypot(reformat.track[n][0] - reformat.track[n - 1][0],
        reformat.track[n][1] - reformat.track[n - 1][1]);
    }
    EXPECT_NEAR(track, length, 0.1 + 2e-3 * length) << angle;
    const GreyPicture& picture = reformat.picture;
    const auto at = [&](int x, int y)
    { return reformat.place[std::size_t(y) * picture.width + x]; };
    for (int x = 1; x + 1 < picture.width; x += 9)
    {
      const int y = picture.height / 2;
      // Neighbours along a column are a pixel apart, and those across it no nearer to each other than a pixel.
      EXPECT_NEAR((at(x, y) - at(x, y + 1)).norm(), 0.1, 1e-9);
      const Vector3 right = at(x + 1, y) - at(x, y);
      EXPECT_NEAR(right.norm(), 0.1, 2e-3) << angle << ' ' << x;
      EXPECT_NEAR(right.dot(at(x, y) - at(x, y + 1)), 0.0, 1e-4) << angle << ' ' << x;
    }
    // The axis is where the track says that it is, and the tube is bright there.
    for (std::size_t n = 5; n + 5 < reformat.track.size(); n += 13)
    {
      const int x = static_cast<int>(std::lround(reformat.track[n][0] / 0.1));
      const int y = picture.height / 2 - static_cast<int>(std::lround(reformat.track[n][1] / 0.1));
      if (x < picture.width)
      {
        EXPECT_LT((at(x, y) - reformat.axis.position[n]).norm(), 0.11) << angle;
        EXPECT_GT(picture.At(x, y), 0.95 * Lumen) << angle;
      }
    }
    // On both sides of it the lumen's edge is a radius away, measured in the picture.
    const std::size_t n = reformat.track.size() / 2;
    for (const double side : { 2.0, -2.0 })
    {
      const PicturePlace edge = reformat.Beside(n, side);
      const int x = static_cast<int>(std::lround(edge[0] / 0.1));
      const int y = picture.height / 2 - static_cast<int>(std::lround(edge[1] / 0.1));
      EXPECT_NEAR(picture.At(x, y), HalfLevel, 60.0) << angle; // 430 HU a mm at the edge
    }
  }
}

TEST(SectionPlane, LiesAcrossTheVesselInTheAxis)
{
  const ImageInterpolator image(HelicalTube().image);
  const FramedCurve axis = FollowAxis(Curve(Helix, -3.0, 3.0, 800), 0.25);
  for (const std::size_t place : { std::size_t(20), axis.position.size() / 2 })
  {
    const SlabPlane plane = SectionPlane(axis, place, 30.0, 5.0, 0.25);
    ASSERT_EQ(plane.width, 41);
    EXPECT_NEAR((plane.ToPicture(axis.position[place]) - Vector3(20, 20, 0)).norm(), 0.0, 1e-9);
    EXPECT_NEAR(plane.towards.dot(axis.tangent[place]), -1.0, 1e-12);
    const Vector3 up =
      std::cos(M_PI / 6.0) * axis.normal[place] + std::sin(M_PI / 6.0) * axis.binormal[place];
    EXPECT_NEAR(plane.down.dot(up), -1.0, 1e-12);
    // Right-handed, as seen by who looks against `towards`.
    EXPECT_NEAR(plane.right.cross(-plane.down).dot(plane.towards), 1.0, 1e-12);
    const GreyPicture section = ProjectSlab(image, plane, {}, 0.0);
    EXPECT_NEAR(WidthAt(section, 20, HalfLevel, 0.25), 4.0, 0.1);
  }
  EXPECT_THROW(SectionPlane(axis, 1000000, 0.0, 5.0, 0.25), std::invalid_argument);
  EXPECT_THROW(SectionPlane(axis, 0, 0.0, 0.0, 0.25), std::invalid_argument);
}

TEST(TraceBoundaries, LumenAndOuterWall)
{
  BoundarySettings settings;
  settings.outerLevel = 0.5 * (Wall + Fat);
  // Half way from the lumen to the outer level is 0.29 blurs outside of the lumen's edge.
  const double edge = 2.0 + 0.29 * 0.3;
  for (const bool helical : { false, true })
  {
    const ImageInterpolator image((helical ? HelicalTube() : StraightTube()).image);
    const FramedCurve axis = FollowAxis(
      helical ? Curve(Helix, -2.8, 2.8, 800) : std::vector<Vector3>{ { 0, 0, -12 }, { 0, 0, 12 } },
      0.25);
    const std::vector<double> radius(axis.position.size(), 1.7); // about
    const VesselBoundaries found = TraceBoundaries(image, axis, radius, settings);
    ASSERT_EQ(found.lumen.size(), axis.position.size() * 32);
    for (std::size_t n = 2; n + 2 < axis.position.size(); n += 5)
    {
      for (double angle = -90.0; angle < 400.0; angle += 35.0)
      {
        EXPECT_NEAR(found.At(found.lumen, n, angle), edge, 0.08) << helical << ' ' << n;
        EXPECT_NEAR(found.At(found.outer, n, angle), 3.0, 0.12) << helical << ' ' << n;
      }
      EXPECT_NEAR(found.Area(found.lumen, n), M_PI * edge * edge, 0.6);
      EXPECT_NEAR(found.Area(found.outer, n), M_PI * 9.0, 1.2);
    }
  }
}

TEST(TraceBoundaries, BesideMuscleThereIsNoOuterBoundary)
{
  // Half of the surroundings is muscle, as bright as the wall.
  const Scene scene(
    [](const Vector3& p)
    {
      const double away = std::hypot(p.x(), p.y());
      return p.x() > 0.0 ? std::max(Wall, VesselValue(away, 1.5, 2.5))
                         : VesselValue(away, 1.5, 2.5);
    },
    61, 0.4);
  const ImageInterpolator image(scene.image);
  const FramedCurve axis = FollowAxis({ { 0, 0, -8 }, { 0, 0, 8 } }, 0.25);
  const std::vector<double> radius(axis.position.size(), 1.5);
  const VesselBoundaries found = TraceBoundaries(image, axis, radius, {});
  const std::size_t n = axis.position.size() / 2;
  for (int ray = 0; ray < found.rays; ++ray)
  {
    const double angle = 2.0 * M_PI * ray / found.rays;
    const double x =
      (std::cos(angle) * axis.normal[n] + std::sin(angle) * axis.binormal[n]).dot(Vector3::UnitX());
    const double outer = found.outer[n * found.rays + ray];
    if (x > 0.4)
    {
      EXPECT_TRUE(std::isnan(outer)) << angle;
    }
    else if (x < -0.4)
    {
      EXPECT_NEAR(outer, 2.5, 0.15) << angle;
    }
  }
  EXPECT_TRUE(std::isnan(found.Area(found.outer, n)));
  EXPECT_NEAR(found.Area(found.lumen, n), M_PI * 1.5 * 1.5, 0.6);
}

TEST(CurvedReformat, RefusesWhatIsOutOfRange)
{
  const ImageInterpolator image(StraightTube().image);
  const std::vector<Vector3> axis = { { 0, 0, -5 }, { 0, 0, 5 } };
  ReformatSettings settings;
  settings.angle = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { ReformatVessel(image, axis, settings); }, "Angle");
  settings = {};
  settings.halfWidth = 0.0;
  ExpectRefusal([&] { ReformatVessel(image, axis, settings); }, "HalfWidth");
  settings = {};
  settings.spacing = 0.0;
  ExpectRefusal([&] { ReformatVessel(image, axis, settings); }, "Spacing");
  settings = {};
  settings.kind = static_cast<ReformatKind>(7);
  ExpectRefusal([&] { ReformatVessel(image, axis, settings); }, "Kind");
  settings = {};
  settings.spacing = 0.02;
  settings.halfWidth = 50.0;
  ExpectRefusal([&] { ReformatVessel(image, { { 0, 0, 0 }, { 0, 0, 200 } }, settings); }, "pixels");
  ExpectRefusal([&] { ReformatVessel(image, { { 0, 0, 0 } }, {}); }, "two points");
  EXPECT_THROW(ReformatVessel(image, axis, {}, [](double) { return false; }), Cancelled);
  const FramedCurve curve = FollowAxis(axis, 0.5);
  ExpectRefusal([&] { TraceBoundaries(image, curve, { 1.0 }, {}); }, "radius");
  BoundarySettings rays;
  rays.rays = 3;
  ExpectRefusal([&] { TraceBoundaries(image, curve, std::vector<double>(21, 1.0), rays); }, "Rays");
}

TEST(CurvedReformat, TheSameOnAnyNumberOfThreads)
{
  const ImageInterpolator image(HelicalTube().image);
  const std::vector<Vector3> axis = Curve(Helix, -2.0, 2.0, 300);
  std::vector<double> first;
  for (const int threads : { 1, 3 })
  {
    SetNumberOfThreads(threads);
    ReformatSettings settings;
    settings.kind = ReformatKind::Curved;
    const VesselReformat reformat = ReformatVessel(image, axis, settings);
    std::vector<double> values(reformat.picture.values.begin(), reformat.picture.values.end());
    const VesselBoundaries found = TraceBoundaries(
      image, reformat.axis, std::vector<double>(reformat.axis.position.size(), 2.0), {});
    values.insert(values.end(), found.lumen.begin(), found.lumen.end());
    values.insert(values.end(), found.outer.begin(), found.outer.end());
    first = first.empty() ? values : first;
    ASSERT_EQ(first.size(), values.size());
    for (std::size_t k = 0; k < values.size(); ++k)
    {
      ASSERT_TRUE(values[k] == first[k] || (std::isnan(values[k]) && std::isnan(first[k])));
    }
  }
  SetNumberOfThreads(0);
}

namespace
{
/// LM (10 mm) to pLAD (20) and mLAD (15); the pLCx leaves at 10 mm, the D1 at 30 mm, an S1 the D1 5 mm behind that.
struct NamedTree
{
  VesselTree tree;
  std::vector<std::string> names;

  NamedTree()
  {
    const std::int64_t main = this->Add(-1, -1, Vector3::UnitX(), 10, LeftMain);
    const std::int64_t first = this->Add(0, main, Vector3::UnitZ(), 20, ProximalLAD);
    this->Add(0, main, Vector3::UnitY(), 60, ProximalLCx);
    const std::int64_t fork = this->Add(1, first, Vector3::UnitX(), 5, FirstDiagonal);
    this->Add(1, first, Vector3::UnitZ(), 15, MidLAD);
    this->Add(3, fork, Vector3::UnitX(), 30, FirstDiagonal);
    this->Add(3, fork, Vector3::UnitY(), 12, FirstSeptal);
    this->tree.radius.assign(this->tree.points.size(), 1.5);
  }

  std::int64_t Add(int parent, std::int64_t from, const Vector3& way, int count, int segment)
  {
    VesselTree::Branch branch;
    branch.groupId = static_cast<int>(this->tree.branches.size());
    branch.parentGroupId = parent;
    if (from < 0)
    {
      from = static_cast<std::int64_t>(this->tree.points.size());
      this->tree.points.emplace_back(Vector3::Zero());
    }
    branch.points.push_back(from);
    for (int n = 0; n < count; ++n)
    {
      this->tree.points.emplace_back(this->tree.points[branch.points.back()] + way);
      branch.points.push_back(static_cast<std::int64_t>(this->tree.points.size()) - 1);
    }
    branch.segmentId = segment;
    this->tree.branches.push_back(branch);
    this->names.push_back(SegmentName(segment));
    return branch.points.back();
  }
};
}

TEST(FindVessel, FromTheOstiumToTheTipByName)
{
  const NamedTree named;
  const auto find = [&](const std::string& name)
  { return FindVessel(named.tree, named.names, name); };
  const VesselChain lad = find("LAD");
  EXPECT_EQ(lad.name, "LM, pLAD, mLAD");
  EXPECT_DOUBLE_EQ(lad.Length(), 45.0);
  EXPECT_EQ(find("lm").points, lad.points);
  EXPECT_EQ(find("mLAD").points, lad.points);

  // What leaves another vessel begins at the ostium as well.
  const VesselChain septal = find("s1");
  EXPECT_EQ(septal.name, "LM, pLAD, D1, S1");
  EXPECT_DOUBLE_EQ(septal.Length(), 47.0);
  EXPECT_DOUBLE_EQ(septal.arc.front(), 0.0);
  EXPECT_EQ(septal.points.front(), named.tree.branches[0].points.front());
  EXPECT_EQ(septal.groupId, 6);
  ASSERT_EQ(septal.pieces.size(), 4U);
  EXPECT_DOUBLE_EQ(septal.pieces[2].begin, 30.0);
  EXPECT_DOUBLE_EQ(septal.pieces[2].end, 35.0);
  for (std::size_t k = 1; k < septal.points.size(); ++k)
  {
    ASSERT_DOUBLE_EQ(septal.arc[k] - septal.arc[k - 1],
      (named.tree.points[septal.points[k]] - named.tree.points[septal.points[k - 1]]).norm());
  }
  // Where it leaves a vessel, the rest of that one is what forks off.
  ASSERT_EQ(septal.forks.size(), 3U);
  EXPECT_EQ(septal.forks[0].name, "pLCx");
  EXPECT_EQ(septal.forks[1].name, "mLAD");
  EXPECT_DOUBLE_EQ(septal.forks[1].arc, 30.0);
  EXPECT_EQ(septal.forks[2].name, "D1");
  EXPECT_DOUBLE_EQ(septal.forks[2].arc, 35.0);

  EXPECT_EQ(find("LCx").name, "LM, pLCx");
  EXPECT_EQ(find("").name, "LM, pLCx"); // the longest, 70 mm
  ExpectRefusal([&] { find("RCA"); }, "RCA", "pLCx", "D1");
  ExpectRefusal([&] { FindVessel(named.tree, { "one" }, ""); }, "number of names");
}
}
