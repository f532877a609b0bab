// Straightened views and slabs of tubes whose grey values and places are known; vessels joined from branches.

#include "CoronaryAnatomy.h"
#include "FunctionImage.h"
#include "StraightenedView.h"
#include "VesselChains.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace UnitTestStraightenedView
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;
}

TEST(FollowAxis, StepsAndFrameOfAStraightAxis)
{
  const std::vector<Vector3> axis = { { 1, 2, 3 }, { 1, 2, 3 }, { 1, 2, 8 }, { 1, 2, 13.1 } };
  const FramedCurve curve = FollowAxis(axis, 0.5);
  ASSERT_EQ(curve.position.size(), 21U);
  for (std::size_t n = 0; n < curve.position.size(); ++n)
  {
    EXPECT_NEAR((curve.position[n] - Vector3(1, 2, 3 + 0.5 * double(n))).norm(), 0.0, 1e-12);
    EXPECT_NEAR((curve.tangent[n] - Vector3::UnitZ()).norm(), 0.0, 1e-12);
    EXPECT_NEAR((curve.normal[n] - curve.normal[0]).norm(), 0.0, 1e-12);
    EXPECT_NEAR((curve.tangent[n].cross(curve.normal[n]) - curve.binormal[n]).norm(), 0, 1e-12);
  }
  // Values at the points, between them and the nearest.
  const std::vector<double> between = curve.Interpolated({ 0.0, 10.0, 20.0, 30.0 });
  EXPECT_NEAR(between[4], 10.0 + 10.0 * 2.0 / 5.0, 1e-12);
  EXPECT_EQ(curve.Nearest({ 0.0, 10.0, 20.0, 30.0 })[8], 20.0);
}

TEST(FollowAxis, TheFrameDoesNotTwist)
{
  // About a helix, a frame without twist lags behind the Frenet frame by the torsion's integral.
  const double radius = 10.0;
  const double pitch = 6.0;
  const double speed = std::hypot(radius, pitch);
  const double torsion = pitch / (speed * speed);
  const auto helix = [&](double t)
  { return Vector3(radius * std::cos(t), radius * std::sin(t), pitch * t); };
  const double end = 2.0 * Pi;
  const FramedCurve curve = FollowAxis(Curve(helix, 0.0, end, 2000), 0.1, 0.3);
  const auto angle = [&](std::size_t n)
  {
    const double t = double(n) * curve.step / speed;
    const Vector3 inwards(-std::cos(t), -std::sin(t), 0.0);
    const Vector3 frenet = curve.tangent[n].cross(inwards);
    return std::atan2(curve.normal[n].dot(frenet), curve.normal[n].dot(inwards));
  };
  const std::size_t first = 20;
  const std::size_t last = curve.position.size() - 21;
  const double expected = -torsion * double(last - first) * curve.step;
  const double turned = angle(last) - angle(first);
  EXPECT_NEAR(std::remainder(turned - expected, 2.0 * Pi), 0.0, 5e-3);
  EXPECT_GT(std::abs(expected), 1.5); // the Frenet frame would not pass
}

TEST(FollowAxis, RefusesWhatIsNoAxis)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Vector3> axis = { Vector3::Zero(), Vector3::UnitX() };
  EXPECT_THROW(FollowAxis({ Vector3::Zero() }, 0.5), std::invalid_argument);
  EXPECT_THROW(FollowAxis({ Vector3::Ones(), Vector3::Ones() }, 0.5), std::invalid_argument);
  EXPECT_THROW(FollowAxis({ Vector3::Zero(), Vector3(nan, 0, 0) }, 0.5), std::invalid_argument);
  EXPECT_THROW(FollowAxis(axis, 0.0), std::invalid_argument);
  EXPECT_THROW(FollowAxis(axis, nan), std::invalid_argument);
  EXPECT_THROW(FollowAxis(axis, 1e-7), std::invalid_argument);
  EXPECT_THROW(FollowAxis(axis, 0.5, -1.0), std::invalid_argument);
  EXPECT_EQ(FollowAxis(axis, 5.0).position.size(), 2U); // shorter than a step
}

TEST(StraightenVessel, LinearImageInEveryPixel)
{
  // Trilinear interpolation is exact on a linear image, in oblique voxels too.
  const Vector3 slope(3.0, -2.0, 5.0);
  const Matrix3 turned =
    (Eigen::AngleAxisd(0.4, Vector3::UnitZ()) * Eigen::AngleAxisd(-0.3, Vector3::UnitX()))
      .toRotationMatrix();
  const Scene scene([&](const Vector3& p) { return 100.0 + slope.dot(p); }, 64, 0.8, turned);
  const ImageInterpolator image(scene.image);
  const auto arch = [](double t)
  { return Vector3(10.0 * std::cos(t), 10.0 * std::sin(t), 2.0 * t); };
  const FramedCurve curve = FollowAxis(Curve(arch, 0.0, 2.5, 100), 0.25);
  const auto cuts = StraightenVessel(image, curve, 5.0);
  for (const int cut : { 0, 1 })
  {
    const auto& across = cut == 0 ? curve.normal : curve.binormal;
    ASSERT_EQ(cuts[cut].width, static_cast<int>(curve.position.size()));
    ASSERT_EQ(cuts[cut].height, 41);
    for (int y = 0; y < 41; ++y)
    {
      for (int x = 0; x < cuts[cut].width; ++x)
      {
        const Vector3 place = curve.position[x] + 0.25 * (20 - y) * across[x];
        ASSERT_NEAR(cuts[cut].At(x, y), 100.0 + slope.dot(place), 1e-3) << x << ' ' << y;
      }
    }
  }
}

TEST(StraightenVessel, ACurvedTubeBecomesStraight)
{
  // A ring's axis is known: the distance from it is the distance from a circle.
  const double ring = 14.0;
  const double radius = 2.0;
  const Scene scene(
    [&](const Vector3& p)
    {
      const double away = std::hypot(std::hypot(p.x(), p.y()) - ring, p.z());
      return 400.0 / (1.0 + std::exp((away - radius) / 0.25)) + 40.0;
    },
    96, 0.4);
  const ImageInterpolator image(scene.image);
  const auto circle = [&](double t)
  { return Vector3(ring * std::cos(t), ring * std::sin(t), 0.0); };
  const FramedCurve curve = FollowAxis(Curve(circle, 0.2, 2.8, 150), 0.2);
  const auto cuts = StraightenVessel(image, curve, 4.0);
  for (const GreyPicture& cut : cuts)
  {
    const int middle = cut.height / 2;
    for (int x = 0; x < cut.width; x += 5)
    {
      EXPECT_NEAR(cut.At(x, middle), 440.0, 4.0) << x;
      EXPECT_NEAR(WidthAt(cut, x, 240.0, 0.2), 2.0 * radius, 0.1) << x;
      EXPECT_NEAR(cut.At(x, 0), 40.0, 2.0) << x;
      // On the axis: as far above as below.
      EXPECT_NEAR(cut.At(x, middle - 10), cut.At(x, middle + 10), 25.0) << x;
    }
  }
  // An axis 1 mm beside the vessel shows it 1 mm beside.
  const auto beside = [&](double t)
  { return Vector3(ring * std::cos(t), ring * std::sin(t), 1.0); };
  const FramedCurve off = FollowAxis(Curve(beside, 0.2, 2.8, 150), 0.2);
  const auto moved = StraightenVessel(image, off, 4.0);
  double sums[2] = { 0.0, 0.0 };
  const int x = moved[0].width / 2;
  const Vector3 seen = circle(0.2 + 0.2 * x / ring) - off.position[x];
  for (const int cut : { 0, 1 })
  {
    double weights = 0.0;
    for (int y = 0; y < moved[cut].height; ++y)
    {
      const double weight = std::max(0.0, moved[cut].At(x, y) - 100.0);
      sums[cut] += weight * 0.2 * (moved[cut].height / 2 - y);
      weights += weight;
    }
    const auto& across = cut == 0 ? off.normal : off.binormal;
    // In a cut that passes the middle at a distance only the part along it shows.
    EXPECT_NEAR(sums[cut] / weights, seen.dot(across[x]), 0.15) << cut;
  }
}

TEST(StraightenVessel, OutsideOfTheImageIsMarked)
{
  const Scene scene([](const Vector3&) { return 7.0; }, 11, 1.0); // -5 to 5
  const ImageInterpolator image(scene.image);
  const FramedCurve curve = FollowAxis({ { -8, 0, 0 }, { 8, 0, 0 } }, 0.5);
  for (const GreyPicture& cut : StraightenVessel(image, curve, 2.0))
  {
    for (int x = 0; x < cut.width; ++x)
    {
      const double along = std::abs(-8.0 + 0.5 * x);
      for (int y = 0; y < cut.height; ++y)
      {
        if (along < 5.4)
        {
          EXPECT_EQ(cut.At(x, y), 7.0F);
        }
        else if (along > 5.6)
        {
          EXPECT_TRUE(std::isnan(cut.At(x, y)));
        }
      }
    }
  }
  EXPECT_THROW(StraightenVessel(image, curve, 0.0), std::invalid_argument);
  EXPECT_THROW(StraightenVessel(image, curve, 1e4), std::invalid_argument);
  EXPECT_THROW(StraightenVessel(image, curve, 2.0, [](double) { return false; }), Cancelled);
}

TEST(SlabPlane, LooksAsReadersDo)
{
  const SlabPlane axial = PlaneTowards(-Vector3::UnitZ());          // from the feet
  EXPECT_NEAR((axial.right - Vector3::UnitX()).norm(), 0.0, 1e-12); // the patient's left
  EXPECT_NEAR((axial.down - Vector3::UnitY()).norm(), 0.0, 1e-12);
  const SlabPlane coronal = PlaneTowards(-Vector3::UnitY());
  EXPECT_NEAR((coronal.right - Vector3::UnitX()).norm(), 0.0, 1e-12);
  EXPECT_NEAR((coronal.down + Vector3::UnitZ()).norm(), 0.0, 1e-12);
  const SlabPlane sagittal = PlaneTowards(Vector3::UnitX()); // the front on the left
  EXPECT_NEAR((sagittal.right - Vector3::UnitY()).norm(), 0.0, 1e-12);
  EXPECT_THROW(PlaneTowards(Vector3::Zero()), std::invalid_argument);

  const SlabPlane framed = Framed(coronal, { { 0, 4, 0 }, { 10, 8, 20 } }, 2.0, 0.5);
  EXPECT_EQ(framed.width, 29);
  EXPECT_EQ(framed.height, 49);
  const Vector3 first = framed.ToPicture({ 0, 4, 20 });
  EXPECT_NEAR((first - Vector3(4, 4, 2)).norm(), 0.0, 1e-9); // 2 mm from the corner, nearer by 2
  EXPECT_THROW(Framed(coronal, {}, 2.0, 0.5), std::invalid_argument);
  EXPECT_THROW(Framed(coronal, { Vector3::Zero() }, 1e6, 0.1), std::invalid_argument);

  // A flat arch in an oblique plane.
  const Vector3 a = Vector3(1, 0.5, 0).normalized();
  const Vector3 b = Vector3(-0.1, 0.2, 1).normalized();
  const auto arch = [&](double t) -> Vector3
  { return 30.0 * std::cos(t) * a + 20.0 * std::sin(t) * b; };
  const SlabPlane plane = PlaneOfVessel(Curve(arch, 0.0, 2.0, 50), 5.0, 0.5);
  const Vector3 across = a.cross(b).normalized();
  EXPECT_NEAR(std::abs(plane.towards.dot(across)), 1.0, 1e-6);
  EXPECT_LT(plane.towards.y(), 0.0); // from the front
  // A straight vessel is seen from the front.
  const SlabPlane straight = PlaneOfVessel({ { 0, 0, 0 }, { 0, 0, 10 }, { 0, 0, 30 } }, 5.0, 0.5);
  EXPECT_NEAR(straight.towards.y(), -1.0, 1e-9);
}

TEST(ProjectSlab, GreatestValueWithinTheSlabOnly)
{
  // A bright bead 3 mm in front of the plane, a brighter one 6 mm behind it.
  const auto bead = [](const Vector3& p, double y, double value)
  { return value * std::exp(-0.5 * (p - Vector3(0, y, 0)).squaredNorm() / 2.0); };
  const Scene scene(
    [&](const Vector3& p) { return bead(p, -3.0, 300.0) + bead(p, 6.0, 900.0); }, 41, 0.5);
  const ImageInterpolator image(scene.image);
  const SlabPlane plane =
    Framed(PlaneTowards(-Vector3::UnitY()), { { -4, 0, -4 }, { 4, 0, 4 } }, 0.0, 0.5);
  const int middle = plane.width / 2;
  const GreyPicture thin = ProjectSlab(image, plane, {}, 8.0);
  EXPECT_NEAR(thin.At(middle, middle), 900.0 * std::exp(-1.0), 20.0); // the other's edge, at y = 4
  const GreyPicture front =
    ProjectSlab(image, plane, std::vector<float>(thin.values.size(), 3.0F), 4.0);
  EXPECT_NEAR(front.At(middle, middle), 300.0, 8.0);
  const GreyPicture cut = ProjectSlab(image, plane, {}, 0.0);
  EXPECT_NEAR(cut.At(middle, middle), 300.0 * std::exp(-9.0 / 4.0), 8.0);
  const GreyPicture beyond =
    ProjectSlab(image, plane, std::vector<float>(thin.values.size(), 30.0F), 4.0);
  EXPECT_TRUE(std::isnan(beyond.At(middle, middle)));
  EXPECT_THROW(ProjectSlab(image, plane, { 1.0F }, 4.0), std::invalid_argument);
  EXPECT_THROW(ProjectSlab(image, plane, {}, -1.0), std::invalid_argument);
}

TEST(ProjectSlab, FollowsAVesselThroughDepths)
{
  // A tube from 12 mm behind the plane to 12 mm before it, and a plate that a flat slab would show.
  const auto at = [](double t) { return Vector3(t, 12.0 * std::sin(t / 10.0), 0.0); };
  const std::vector<Vector3> axis = Curve(at, -15.0, 15.0, 200);
  const Scene scene(
    [&](const Vector3& p)
    {
      const bool tube = (p - at(p.x())).norm() < 2.0;
      return tube ? 400.0 : std::abs(p.z()) > 6.0 && std::abs(p.y()) > 8.0 ? 800.0 : 0.0;
    },
    64, 0.6);
  const ImageInterpolator image(scene.image);
  const SlabPlane plane = Framed(PlaneTowards(-Vector3::UnitY()), axis, 4.0, 0.5);
  const std::vector<float> depths = DepthsAlong(plane, axis);
  const GreyPicture picture = ProjectSlab(image, plane, depths, 6.0);
  for (std::size_t n = 10; n + 10 < axis.size(); n += 5)
  {
    const Vector3 place = plane.ToPicture(axis[n]);
    const int x = static_cast<int>(std::lround(place[0]));
    const int y = static_cast<int>(std::lround(place[1]));
    EXPECT_NEAR(depths[static_cast<std::size_t>(y * plane.width + x)], place[2], 2.5) << n;
    EXPECT_NEAR(picture.At(x, y), 400.0, 1.0) << n;
  }
  EXPECT_THROW(DepthsAlong(plane, {}), std::invalid_argument);
  EXPECT_THROW(DepthsAlong(plane, axis, 0.0), std::invalid_argument);
}

TEST(StraightenedView, TheSameOnAnyNumberOfThreads)
{
  const Scene scene([](const Vector3& p) { return std::sin(p.x()) + p.y() * p.z(); }, 40, 0.7);
  const ImageInterpolator image(scene.image);
  const auto arch = [](double t) { return Vector3(8.0 * std::cos(t), 8.0 * std::sin(t), t); };
  const FramedCurve curve = FollowAxis(Curve(arch, 0.0, 2.5, 100), 0.25);
  const SlabPlane plane = PlaneOfVessel(curve.position, 5.0, 0.5);
  std::vector<float> first;
  for (const int threads : { 1, 3 })
  {
    SetNumberOfThreads(threads);
    std::vector<float> values = StraightenVessel(image, curve, 4.0)[1].values;
    const auto slab = ProjectSlab(image, plane, DepthsAlong(plane, curve.position), 8.0).values;
    values.insert(values.end(), slab.begin(), slab.end());
    if (first.empty())
    {
      first = values;
    }
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
/// A left tree: LM to LAD (two pieces, a diagonal between them) and LCx; points 1 mm apart.
VesselTree LeftTree(std::vector<std::string>& names)
{
  VesselTree tree;
  const auto add = [&](int parent, std::int64_t from, const Vector3& way, int count, int segment)
  {
    VesselTree::Branch branch;
    branch.groupId = static_cast<int>(tree.branches.size());
    branch.parentGroupId = parent;
    if (from < 0)
    {
      tree.points.emplace_back(Vector3::Zero());
      from = 0;
    }
    branch.points.push_back(from);
    for (int n = 0; n < count; ++n)
    {
      tree.points.emplace_back(tree.points[static_cast<std::size_t>(branch.points.back())] + way);
      branch.points.push_back(static_cast<std::int64_t>(tree.points.size()) - 1);
    }
    branch.segmentId = segment;
    tree.branches.push_back(branch);
    names.push_back(SegmentName(segment));
    return branch.points.back();
  };
  const std::int64_t main = add(-1, -1, Vector3::UnitX(), 10, LeftMain);
  const std::int64_t first = add(0, main, Vector3::UnitZ(), 20, ProximalLAD);
  add(0, main, Vector3::UnitY(), 60, ProximalLCx);    // longer than the LAD
  add(1, first, Vector3::UnitX(), 40, FirstDiagonal); // longer than the rest of the LAD
  add(1, first, Vector3::UnitZ(), 15, MidLAD);
  tree.radius.assign(tree.points.size(), 1.5);
  return tree;
}
}

TEST(JoinVessels, ArteriesGoOnByName)
{
  std::vector<std::string> names;
  const VesselTree tree = LeftTree(names);
  const std::vector<VesselChain> chains = JoinVessels(tree, names, 4.0);
  ASSERT_EQ(chains.size(), 3U);
  EXPECT_EQ(chains[0].name, "LM, pLAD, mLAD");
  EXPECT_DOUBLE_EQ(chains[0].Length(), 45.0);
  ASSERT_EQ(chains[0].pieces.size(), 3U);
  EXPECT_DOUBLE_EQ(chains[0].pieces[1].begin, 10.0);
  EXPECT_DOUBLE_EQ(chains[0].pieces[1].end, 30.0);
  ASSERT_EQ(chains[0].forks.size(), 2U);
  EXPECT_EQ(chains[0].forks[0].name, "pLCx");
  EXPECT_DOUBLE_EQ(chains[0].forks[0].arc, 10.0);
  EXPECT_EQ(chains[0].forks[1].name, "D1");
  EXPECT_DOUBLE_EQ(chains[0].forks[1].arc, 30.0);
  EXPECT_EQ(chains[1].name, "pLCx");
  EXPECT_DOUBLE_EQ(chains[1].Length(), 60.0);
  EXPECT_EQ(chains[2].name, "D1");
  // The lead-in: 4 mm of the parent, ending at the origin.
  ASSERT_EQ(chains[2].points.size(), 4U + 41U);
  EXPECT_DOUBLE_EQ(chains[2].arc.front(), -4.0);
  EXPECT_DOUBLE_EQ(chains[2].arc[4], 0.0);
  EXPECT_EQ(tree.points[static_cast<std::size_t>(chains[2].points[4])], Vector3(10, 0, 20));
}

TEST(JoinVessels, WithoutNamesTheStraightOne)
{
  std::vector<std::string> names;
  VesselTree tree = LeftTree(names);
  names.assign(names.size(), "");
  for (VesselTree::Branch& branch : tree.branches)
  {
    branch.segmentId = 0;
  }
  const std::vector<VesselChain> chains = JoinVessels(tree, names);
  ASSERT_EQ(chains.size(), 3U);
  EXPECT_EQ(chains[0].name, "branch 0, branch 1, branch 4");
  double length = 0.0;
  for (const VesselChain& chain : chains)
  {
    length += chain.Length();
  }
  EXPECT_DOUBLE_EQ(length, 145.0); // every branch once
  EXPECT_THROW(JoinVessels(tree, { "one" }), std::invalid_argument);
}

TEST(JoinVessels, BranchesThatLeaveInTheMiddle)
{
  std::vector<std::string> names;
  VesselTree tree = LeftTree(names);
  tree.branches[2].points.front() = tree.branches[0].points[5]; // the LCx leaves the LM half way
  const std::vector<VesselChain> chains = JoinVessels(tree, names, 3.0);
  ASSERT_EQ(chains[0].forks.size(), 2U);
  EXPECT_DOUBLE_EQ(chains[0].forks[0].arc, 5.0);
  EXPECT_DOUBLE_EQ(chains[1].arc.front(), -3.0);
}
}
