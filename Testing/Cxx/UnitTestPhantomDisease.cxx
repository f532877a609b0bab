// Disease of the phantom against closed forms and its own promises.

#include "CoronaryPhantom.h"
#include "PhantomMotion.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace UnitTestPhantomDisease
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;

PhantomSettings Quiet()
{
  PhantomSettings settings;
  settings.seed = 0;
  settings.noise = 0.0;
  settings.temporalWindow = 0.0;
  settings.centerlineSpacing = 0.25;
  return settings;
}

PhantomLesion Make(
  const std::string& kind, const std::string& vessel, double position, double length, double degree)
{
  PhantomLesion lesion = UsualLesion(kind);
  lesion.vessel = vessel;
  lesion.position = position;
  lesion.length = length;
  lesion.degree = degree;
  return lesion;
}

PhantomSettings With(const std::vector<PhantomLesion>& lesions)
{
  PhantomSettings settings = Quiet();
  settings.disease.lesions = lesions;
  return settings;
}

std::int16_t ValueAt(const CoronaryPhantom& phantom, const Vector3& position, double t)
{
  ImageGrid grid;
  grid.extent = { 0, 0, 0, 0, 0, 0 };
  grid.origin = position;
  grid.spacing = Vector3::Constant(0.2);
  std::int16_t value = 0;
  phantom.Render(grid, grid.extent, t, &value);
  return value;
}

/// The plateau of a lesion, of quintic shoulders: docs/phantom.md.
double Plateau(double off, double length)
{
  const double shoulder = std::min(0.5 * length, 4.0);
  const double u = std::clamp((0.5 * length - std::abs(off)) / shoulder + 0.5, 0.0, 1.0);
  return u * u * u * (u * (6.0 * u - 15.0) + 10.0);
}

/// Of the healthy right artery, which is alone on its first 26 mm and again up to 60 mm.
double HealthyRadius(double arc)
{
  static const PhantomTree tree = CoronaryPhantom(Quiet()).Tree(0.0);
  static const double pulse =
    std::sqrt(1.0 + Quiet().areaPulse * PhantomMotion::PressurePulse(0.0));
  double best = 1e9;
  double radius = 0.0;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (const std::int64_t p : branch.points)
    {
      const bool right = branch.segmentId == ProximalRCA || branch.segmentId == MidRCA;
      if (right && std::abs(tree.abscissa[p] - arc) < best)
      {
        best = std::abs(tree.abscissa[p] - arc);
        radius = tree.radius[p] / pulse;
      }
    }
  }
  return radius;
}

/// Integral over the lesion's course of an area (mm^2) that depends on the place.
double Integrate(double middle, double length, const std::function<double(double)>& area)
{
  constexpr double step = 0.05;
  double sum = 0.0;
  for (double s = -length; s < length; s += step)
  {
    sum += step * area(middle + s + 0.5 * step);
  }
  return sum;
}

int EulerNumber(const PhantomSurface& surface)
{
  std::vector<std::pair<std::int64_t, std::int64_t>> edges;
  for (const Triangle& triangle : surface.triangles)
  {
    for (int i = 0; i < 3; ++i)
    {
      edges.emplace_back(std::minmax(triangle[i], triangle[(i + 1) % 3]));
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return static_cast<int>(surface.points.size()) - static_cast<int>(edges.size()) +
    static_cast<int>(surface.triangles.size());
}
}

TEST(PhantomDisease, PlaqueIsMadeOfWhatTheSettingsSay)
{
  constexpr double middle = 43.0;
  constexpr double length = 16.0;
  PhantomLesion plaque = Make("plaque", "RCA", middle, length, 0.5);
  plaque.eccentricity = 0.9;
  plaque.remodelling = 1.3;
  plaque.lipid = 0.7;
  plaque.angle = 90.0; // across the plane in which the vessel is bent: Pappus says nothing changes
  const CoronaryPhantom phantom(With({ plaque }));
  const std::vector<PhantomLesionTruth> truth = phantom.Lesions();
  ASSERT_EQ(truth.size(), 1u);
  EXPECT_NEAR(truth[0].degree, 0.5, 1e-3);
  EXPECT_NEAR(truth[0].areaDegree, 0.75, 1e-3);
  EXPECT_NEAR(truth[0].referenceRadius, HealthyRadius(middle), 0.01);
  EXPECT_NEAR(truth[0].wallRadius / truth[0].referenceRadius, 1.3, 1e-3);
  EXPECT_EQ(truth[0].segmentId, MidRCA);
  const auto wall = [&](double s)
  { return HealthyRadius(s) * (1.0 + 0.3 * Plateau(s - middle, length)); };
  const auto lumen = [&](double s)
  { return HealthyRadius(s) * (1.0 - 0.5 * Plateau(s - middle, length)); };
  const double all = Integrate(
    middle, length, [&](double s) { return Pi * (wall(s) * wall(s) - lumen(s) * lumen(s)); });
  const double core = Integrate(middle, length,
    [&](double s)
    {
      // Thickest place, less 0.15 mm of a cap.
      const double room = 1.9 * (wall(s) - lumen(s)) - 0.15;
      const double radius = 0.5 * 0.7 * room;
      return radius > 0.02 ? Pi * radius * radius : 0.0;
    });
  EXPECT_GT(core, 10.0);
  EXPECT_NEAR(truth[0].lipidVolume, core, 0.03 * core);
  EXPECT_NEAR(truth[0].fibrousVolume + truth[0].lipidVolume, all, 0.03 * all);
  EXPECT_EQ(truth[0].calciumVolume, 0.0);

  // In the image: middle of the core, and of the lumen.
  double dark = 1e9;
  int cores = 0;
  for (const PhantomTube& tube : phantom.Tubes(0.75))
  {
    if (tube.tissue == PhantomTissue::Soft && tube.value == plaque.lipidValue && ++cores % 10 == 0)
    {
      dark = std::min<double>(dark, ValueAt(phantom, 0.5 * (tube.start + tube.end), 0.75));
    }
  }
  const PhantomTree tree = phantom.Tree(0.75);
  const double bright = ValueAt(phantom, tree.points[truth[0].point], 0.75);
  EXPECT_NEAR(dark, plaque.lipidValue, 15.0);
  EXPECT_GT(bright, 350.0);
}

TEST(PhantomDisease, CalciumHasItsVolumeAndScore)
{
  constexpr double thickness = 1.2;
  constexpr double rod = 8.0;
  PhantomLesion lesion = Make("calcification", "RCA", 43.0, 16.0, 0.0);
  lesion.calciumArc = 0.0;
  lesion.calciumThickness = thickness;
  lesion.calciumLength = rod;
  const auto measure = [&] { return CoronaryPhantom(With({ lesion })).Lesions().front(); };
  const PhantomLesionTruth dense = measure();
  // A rod whose section is a disc of the area 1 - x^6 along it.
  const double volume = 0.25 * Pi * thickness * thickness * rod * 6.0 / 7.0;
  EXPECT_NEAR(dense.calciumVolume, volume, 0.06 * volume);
  EXPECT_EQ(dense.degree, 0.0);
  // At most four times the area of its sections with 3 mm slices, half a pixel wider all around.
  const double wider = std::pow(thickness + 0.5, 2) / (0.25 * Pi * thickness * thickness);
  EXPECT_GT(dense.agatston, 3.0 * volume / 3.0);
  EXPECT_LT(dense.agatston, 4.0 * wider * volume / 3.0);

  lesion.calciumValue = 160.0;
  const PhantomLesionTruth faint = measure();
  EXPECT_NEAR(faint.calciumVolume, dense.calciumVolume, 1e-9);
  EXPECT_LT(faint.agatston, 0.3 * dense.agatston);

  // Too little for a square millimetre of any slice.
  lesion.calciumValue = 850.0;
  lesion.calciumThickness = 0.4;
  lesion.calciumLength = 1.0;
  EXPECT_EQ(measure().agatston, 0.0);

  // An arc of 180 degrees, outside of the lumen and in the image.
  lesion = Make("calcification", "RCA", 43.0, 16.0, 0.0);
  lesion.calciumArc = 180.0;
  const CoronaryPhantom phantom(With({ lesion }));
  double brightest = 0.0;
  int cones = 0;
  for (const PhantomTube& tube : phantom.Tubes(0.75))
  {
    if (tube.tissue == PhantomTissue::Calcified && ++cones % 40 == 0)
    {
      const Vector3 place = 0.5 * (tube.start + tube.end);
      EXPECT_GT(phantom.LumenDistance(place, 0.75), 0.0);
      brightest = std::max<double>(brightest, ValueAt(phantom, place, 0.75));
    }
  }
  EXPECT_GT(brightest, 700.0);
  EXPECT_GT(phantom.Lesions().front().calciumVolume, 3.0 * volume);
}

TEST(PhantomDisease, NarrowestStenosisIsTrueEverywhere)
{
  PhantomSettings settings = With({ Make("stenosis", "RCA", 43.0, 8.0, 0.99) });
  settings.surfaceSpacing = 0.5;
  const CoronaryPhantom phantom(settings);
  const std::vector<PhantomStenosis> stenoses = phantom.Stenoses(0.35);
  ASSERT_EQ(stenoses.size(), 1u);
  EXPECT_NEAR(stenoses[0].degree, 0.99, 1e-3);
  EXPECT_LT(stenoses[0].minimumRadius, 0.025);

  const PhantomSurface surface = phantom.Surface(0.35);
  EXPECT_EQ(EulerNumber(surface), 4); // two spheres
  double nearest = 1e9;
  double farthest = 0.0;
  for (const Vector3& p : surface.points)
  {
    nearest = std::min(nearest, (p - stenoses[0].position).norm());
  }
  for (std::size_t p = 0; p < surface.points.size(); p += surface.points.size() / 20)
  {
    farthest = std::max(farthest, std::abs(phantom.LumenDistance(surface.points[p], 0.35)));
  }
  EXPECT_LT(nearest, 0.15);
  EXPECT_LT(farthest, 1e-3);

  // Of a lumen that is thinner than the blur the image has what its area is worth.
  settings.disease.lesions = { Make("stenosis", "RCA", 43.0, 30.0, 0.9) };
  std::fill(settings.pointSpread, settings.pointSpread + 3, 0.25);
  const CoronaryPhantom thin(settings);
  const PhantomStenosis narrow = thin.Stenoses(0.75).front();
  const double variance = 0.25 * 0.25 + 0.2 * 0.2 / 12.0;
  const double seen = 1.0 - std::exp(-0.5 * narrow.minimumRadius * narrow.minimumRadius / variance);
  const double blood = settings.lumenHU + settings.attenuationGradient * narrow.abscissa / 10.0;
  EXPECT_NEAR(ValueAt(thin, narrow.position, 0.75), -95.0 + seen * (blood + 95.0), 10.0);
}

TEST(PhantomDisease, OuterWallIsATubeAroundThePlaque)
{
  constexpr double middle = 43.0;
  constexpr double length = 18.0;
  PhantomLesion plaque = Make("plaque", "RCA", middle, length, 0.6);
  plaque.remodelling = 1.2;
  const CoronaryPhantom phantom(With({ plaque }));
  const PhantomSurface wall = phantom.OuterWall(0.0);
  EXPECT_EQ(EulerNumber(wall), 4);
  // At t = 0 the wall has grown as much as the lumen's pulse has.
  const double pulse = std::sqrt(1.0 + Quiet().areaPulse * PhantomMotion::PressurePulse(0.0)) - 1.0;
  double area = 0.0;
  double away = 0.0;
  const PhantomTree tree = phantom.Tree(0.0);
  std::vector<std::size_t> around;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    if (tree.segmentId[p] == MidRCA)
    {
      around.push_back(p);
    }
  }
  const auto nearestPoint = [&](const Vector3& position)
  {
    return *std::min_element(around.begin(), around.end(),
      [&](std::size_t a, std::size_t b)
      { return (tree.points[a] - position).norm() < (tree.points[b] - position).norm(); });
  };
  for (const Triangle& triangle : wall.triangles)
  {
    const std::int64_t a = triangle[0];
    const bool inPlateau = tree.branches[wall.groupId[a]].segmentId == MidRCA &&
      std::abs(wall.abscissa[a] - middle) < 6.0;
    if (inPlateau)
    {
      const Vector3 u = wall.points[triangle[1]] - wall.points[a];
      const Vector3 v = wall.points[triangle[2]] - wall.points[a];
      area += 0.5 * u.cross(v).norm();
      const std::size_t at = nearestPoint(wall.points[a]);
      away = std::max(away, (wall.points[a] - tree.points[at]).norm() - tree.radius[at]);
    }
  }
  // The vessel is strained by the motion: lengths at t = 0 against those at rest.
  double strained = 0.0;
  double resting = 0.0;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const std::int64_t p = branch.points[i - 1];
      const std::int64_t q = branch.points[i];
      if (branch.segmentId == MidRCA && std::abs(tree.abscissa[p] - middle) < 6.0)
      {
        strained += (tree.points[q] - tree.points[p]).norm();
        resting += tree.abscissa[q] - tree.abscissa[p];
      }
    }
  }
  double expected = 0.0;
  for (double s = middle - 6.0; s < middle + 6.0; s += 0.1)
  {
    const double r = HealthyRadius(s);
    expected += 0.1 * 2.0 * Pi * (1.2 * r + 0.4 * r * pulse) * strained / resting;
  }
  EXPECT_NEAR(area, expected, 0.04 * expected);
  EXPECT_NEAR(away, (1.2 - 0.4) * HealthyRadius(middle), 0.06);
}

TEST(PhantomDisease, OcclusionBlocksAndFillsLate)
{
  PhantomLesion occlusion = Make("occlusion", "LAD", 60.0, 20.0, 0.0);
  occlusion.fill = 0.5;
  const CoronaryPhantom phantom(With({ occlusion }));
  const PhantomTree tree = phantom.Tree(0.75);
  const PhantomTree healthy = CoronaryPhantom(Quiet()).Tree(0.75);
  double blocked = 0.0;
  double late = 0.0;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    const std::string segment = SegmentName(branch.segmentId);
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const std::int64_t p = branch.points[i];
      const double share = tree.visibility[p] / healthy.visibility[p];
      if (share == 0.0)
      {
        blocked += tree.abscissa[p] - tree.abscissa[branch.points[i - 1]];
        EXPECT_NEAR(tree.abscissa[p], 60.0, 10.3);
        EXPECT_GT(phantom.LumenDistance(tree.points[p], 0.75), -2.0);
      }
      else if (segment == "dLAD")
      {
        // Half of 420 HU and half a HU a mm, against 420 less 0.15 HU a mm.
        const double abscissa = tree.abscissa[p];
        EXPECT_NEAR(share, (210.0 + 0.5 * (abscissa - 70.0)) / (420.0 - 0.15 * abscissa), 0.01);
        late = share;
      }
      else if (segment == "pLAD" || segment == "pRCA")
      {
        EXPECT_EQ(share, 1.0);
      }
    }
  }
  EXPECT_NEAR(blocked, 20.0, 0.6);
  EXPECT_GT(late, 0.5);
  EXPECT_EQ(phantom.Lesions().front().degree, 1.0);
  int plaque = 0;
  for (const PhantomTube& tube : phantom.Tubes(0.75))
  {
    plaque += tube.tissue == PhantomTissue::Soft;
  }
  EXPECT_GT(plaque, 40);
  const std::vector<PhantomVessel> vessels = phantom.Vessels();
  const auto named = [&](const std::string& name)
  {
    return *std::find_if(vessels.begin(), vessels.end(),
      [&](const PhantomVessel& vessel) { return vessel.name == name; });
  };
  EXPECT_NEAR(named("LAD").lateFrom, 70.0, 0.6);
  EXPECT_EQ(named("D1").lateFrom, -1.0);
  ASSERT_EQ(named("LAD").occlusions.size(), 1u);
}

TEST(PhantomDisease, StentIsMetalOnTheHealthyWallAndHoldsIt)
{
  PhantomLesion stent = Make("stent", "RCA", 43.0, 20.0, 0.4);
  const CoronaryPhantom phantom(With({ stent }));
  const auto systole = 0.32;
  const PhantomTree tree = phantom.Tree(systole);
  const PhantomLesionTruth truth = phantom.Lesions().front();
  EXPECT_NEAR(truth.degree, 0.4, 1e-3);
  EXPECT_NEAR(tree.radius[truth.point], truth.minimumRadius, 1e-9);
  std::vector<Vector3> axis;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    axis.push_back(tree.points[p]);
  }
  int wires = 0;
  bool metalFirst = true;
  bool others = false;
  for (const PhantomTube& tube : phantom.Tubes(systole))
  {
    metalFirst = metalFirst && !(others && tube.tissue == PhantomTissue::Metal);
    others = others || tube.tissue != PhantomTissue::Metal;
    if (tube.tissue != PhantomTissue::Metal)
    {
      continue;
    }
    ++wires;
    EXPECT_NEAR(tube.startRadius, 0.045, 1e-12);
    double nearest = 1e9;
    for (const Vector3& p : axis)
    {
      nearest = std::min(nearest, (p - tube.start).norm());
    }
    EXPECT_NEAR(nearest, truth.referenceRadius + 0.045, 0.12);
  }
  EXPECT_TRUE(metalFirst);
  // 13 rings of 12 wires, three connectors in each gap.
  EXPECT_EQ(wires, 13 * 12 + 12 * 3);
}

TEST(PhantomDisease, BridgeIsSqueezedInSystoleOnly)
{
  const CoronaryPhantom phantom(With({ Make("bridge", "LAD", 62.0, 24.0, 0.6) }));
  const CoronaryPhantom healthy(Quiet());
  const std::int64_t middle = phantom.Lesions().front().point;
  for (const double t : { 0.0, 0.2, 0.35, 0.7 })
  {
    const double squeeze = 0.6 * std::clamp(PhantomMotion::Activation(t), 0.0, 1.0);
    EXPECT_NEAR(
      phantom.Tree(t).radius[middle] / healthy.Tree(t).radius[middle], 1.0 - squeeze, 1e-9);
  }
}

TEST(PhantomDisease, GraftsReachTheirVesselAndTouchNoOther)
{
  PhantomSettings settings = Quiet();
  settings.centerlineSpacing = 0.5;
  AddDisease("graft", settings);
  for (const std::uint64_t seed : { 0, 1, 2, 3 })
  {
    settings.seed = seed;
    const CoronaryPhantom phantom(settings);
    const PhantomTree tree = phantom.Tree(0.75);
    int grafts = 0;
    for (const VesselTree::Branch& graft : tree.branches)
    {
      if (graft.treeId != 3)
      {
        continue;
      }
      ++grafts;
      double end = 1e9;
      double apart = 1e9;
      for (const VesselTree::Branch& other : tree.branches)
      {
        for (const std::int64_t q : other.points)
        {
          if (other.treeId == 3)
          {
            continue;
          }
          end = std::min(end, (tree.points[graft.points.back()] - tree.points[q]).norm());
          for (const std::int64_t p : graft.points)
          {
            if (tree.abscissa[graft.points.back()] - tree.abscissa[p] > 12.0)
            {
              apart = std::min(
                apart, (tree.points[p] - tree.points[q]).norm() - tree.radius[p] - tree.radius[q]);
            }
          }
        }
      }
      EXPECT_LT(end, 0.5) << "seed " << seed;
      EXPECT_GT(apart, 0.3) << "seed " << seed << " graft " << grafts;
    }
    EXPECT_EQ(grafts, 3);
  }
}

TEST(PhantomDisease, CollateralsLeadBehindOcclusions)
{
  PhantomSettings settings = Quiet();
  settings.centerlineSpacing = 0.5;
  settings.areaPulse = 0.0;
  for (const std::uint64_t seed : { 0, 1, 2, 3 })
  {
    settings.seed = seed;
    settings.disease = PhantomDisease();
    AddDisease("occluded", settings);
    const CoronaryPhantom without(settings);
    EXPECT_TRUE(without.Collaterals(0.0).empty());
    settings.disease = PhantomDisease();
    AddDisease("collateral", settings);
    const CoronaryPhantom phantom(settings);
    // The tree is what it is without.
    const PhantomTree tree = phantom.Tree(0.75);
    const PhantomTree bare = without.Tree(0.75);
    EXPECT_EQ(tree.points, bare.points);
    EXPECT_EQ(tree.visibility, bare.visibility);
    const std::vector<PhantomCollateralTruth> early = phantom.Collaterals(0.35);
    const std::vector<PhantomCollateralTruth> rest = phantom.Collaterals(0.75);
    ASSERT_EQ(rest.size(), 3u);
    for (std::size_t n = 0; n < rest.size(); ++n)
    {
      const PhantomCollateralTruth& one = rest[n];
      const std::string what = "seed " + std::to_string(seed) + " " + one.collateral.name;
      // Both ends lie on axes of arteries: the last one where contrast is late.
      double start = 1e9;
      double end = 1e9;
      std::size_t filled = 0;
      for (std::size_t p = 0; p < tree.points.size(); ++p)
      {
        start = std::min(start, (tree.points[p] - one.points.front()).norm());
        if ((tree.points[p] - one.points.back()).norm() < end)
        {
          end = (tree.points[p] - one.points.back()).norm();
          filled = p;
        }
      }
      EXPECT_LT(start, 1e-6) << what;
      EXPECT_LT(end, 1e-6) << what;
      const CoronaryPhantom healthy(
        [&]
        {
          PhantomSettings clean = settings;
          clean.disease = PhantomDisease();
          return clean;
        }());
      EXPECT_LT(tree.visibility[filled], 0.95 * healthy.Tree(0.75).visibility[filled]) << what;
      EXPECT_GT(tree.visibility[filled], 0.0) << what;
      // It winds, is thin, moves with the heart, and its middle is as bright as said, where nothing else is.
      EXPECT_GT(one.length, 1.1 * (one.points.back() - one.points.front()).norm()) << what;
      EXPECT_NEAR(one.radius, 0.5 * one.collateral.diameter, 1e-9) << what;
      const std::size_t middle = one.points.size() / 2;
      EXPECT_GT((one.points[middle] - early[n].points[middle]).norm(), 2.0) << what;
      EXPECT_GT(one.clearance, -0.3) << what;
      const double around = one.collateral.septal ? CoronaryPhantom::CoatValue(true)
                                                  : CoronaryPhantom::CoatValue(false);
      EXPECT_GT(one.value, around + 100.0) << what;
    }
  }
}

TEST(PhantomDisease, CollateralsAreInTheImageAndInTheTubes)
{
  PhantomSettings settings = Quiet();
  std::fill(std::begin(settings.pointSpread), std::end(settings.pointSpread), 0.05);
  settings.disease.collaterals.push_back({ "C", "OM1", "D1", 0.7, 0.7, 0.7, false });
  const CoronaryPhantom phantom(settings);
  const PhantomCollateralTruth one = phantom.Collaterals(0.75).front();
  PhantomSettings bare = settings;
  bare.disease.collaterals.clear();
  const CoronaryPhantom without(bare);
  std::vector<double> gained;
  for (std::size_t n = one.points.size() / 4; n < 3 * one.points.size() / 4; ++n)
  {
    EXPECT_NEAR(ValueAt(phantom, one.points[n], 0.75), one.value, 3.0);
    gained.push_back(ValueAt(phantom, one.points[n], 0.75) - ValueAt(without, one.points[n], 0.75));
  }
  EXPECT_GT(*std::min_element(gained.begin(), gained.end()), 100.0);
  // All of its steps are tubes of blood to the scanner.
  const std::size_t more = phantom.Tubes(0.75).size() - without.Tubes(0.75).size();
  EXPECT_EQ(more, one.points.size() - 1);
}

TEST(PhantomDisease, AnomalousCircumflexPassesBehindTheAorta)
{
  for (const std::uint64_t seed : { 0, 1, 2 })
  {
    PhantomSettings settings = Quiet();
    settings.seed = seed;
    const std::vector<PhantomOstium> ostia = CoronaryPhantom(settings).Ostia(0.0);
    AddDisease("anomalous", settings);
    const CoronaryPhantom phantom(settings);
    const Vector3 centre = 0.5 * (ostia[0].position + ostia[1].position);
    const double bore = 0.5 * (ostia[0].position - ostia[1].position).norm();
    const Vector3 across = (ostia[0].position - ostia[1].position).normalized();
    Vector3 up(-0.30, -0.20, 0.93);
    up = (up - up.dot(across) * across).normalized();
    const PhantomTree tree = phantom.Tree(0.0);
    double behind = 0.0;
    for (const VesselTree::Branch& branch : tree.branches)
    {
      EXPECT_NE(branch.segmentId, LeftMain);
      if (branch.segmentId != ProximalLCx)
      {
        continue;
      }
      EXPECT_EQ(branch.treeId, 1);
      for (const std::int64_t p : branch.points)
      {
        Vector3 off = tree.points[p] - centre;
        off -= off.dot(up) * up;
        EXPECT_GT(off.norm() - bore - tree.radius[p], 0.0) << "seed " << seed;
        behind = std::max(behind, off.dot(up.cross(across)));
      }
    }
    EXPECT_GT(behind, bore) << "seed " << seed;
    EXPECT_EQ(phantom.Ostia(0.0).size(), 2u);
  }
  PhantomSettings single = Quiet();
  AddDisease("single-ostium", single);
  EXPECT_EQ(CoronaryPhantom(single).Ostia(0.0).size(), 1u);
  PhantomSettings high = Quiet();
  AddDisease("high-right", high);
  EXPECT_NEAR(
    (CoronaryPhantom(high).Ostia(0.0)[1].position - CoronaryPhantom(Quiet()).Ostia(0.0)[1].position)
      .norm(),
    15.0, 1.5);
}

TEST(PhantomDisease, AllPresetsFitAllHearts)
{
  for (const std::string& name : DiseasePresets())
  {
    for (const Dominance dominance : { Dominance::Right, Dominance::Left, Dominance::Balanced })
    {
      for (const std::uint64_t seed : { 0, 1, 7 })
      {
        PhantomSettings settings;
        settings.seed = seed;
        settings.dominance = dominance;
        AddDisease(name, settings);
        EXPECT_NO_THROW(CoronaryPhantom phantom(settings)) << name;
      }
    }
  }
}

TEST(PhantomDisease, RefusesWhatCanNotBe)
{
  const auto refuses = [](const std::vector<PhantomLesion>& lesions, const std::string& part)
  { ExpectRefusal([&] { const CoronaryPhantom phantom(With(lesions)); }, part); };
  refuses({ Make("plaque", "LADD", 30.0, 10.0, 0.5) }, "is on LADD, which is none of LAD, LCx");
  refuses({ Make("stent", "LCx", 500.0, 18.0, 0.0) }, "goes from 491 to 509 mm, LCx from 0 to");
  refuses({ Make("stent", "LAD", 2.0, 18.0, 0.0) }, "goes from -7 to 11 mm");
  refuses({ Make("plaque", "LAD", 30.0, 10.0, 1.0) }, "degree is 1, it must lie in [0, 0.99]");
  refuses({ Make("stent", "LAD", 30.0, 18.0, 0.0), Make("stent", "LAD", 40.0, 18.0, 0.0) },
    "on LAD the stent at 30 mm overlaps the stent at 40 mm");
  refuses({ Make("plaque", "LAD", std::nan(""), 10.0, 0.5) }, "position_mm is");
  ExpectRefusal([] { UsualLesion("rupture"); }, "none of stenosis, plaque");
  PhantomSettings settings;
  ExpectRefusal([&] { AddDisease("cold", settings); }, "none of stenosed");
  settings.disease.grafts.push_back({ "LIMA", true, "RI", 20.0, 2.5 });
  ExpectRefusal([&] { const CoronaryPhantom phantom(settings); }, "there is no vessel RI");
  settings.disease.grafts = { { "LAD", true, "LAD", 20.0, 2.5 } };
  ExpectRefusal([&] { const CoronaryPhantom phantom(settings); }, "vessel of that name");
  const auto refusesCollateral = [&](const PhantomCollateral& one, const std::string& part)
  {
    settings.disease = PhantomDisease();
    settings.disease.collaterals = { one };
    ExpectRefusal([&] { const CoronaryPhantom phantom(settings); }, part);
  };
  refusesCollateral(
    { "C", "LAD", "PDA", 0.5, 0.5, 0.5, false }, "collateral C: there is no vessel PDA");
  refusesCollateral({ "D1", "LAD", "RCA", 0.5, 0.5, 0.5, false }, "there is a vessel of that name");
  refusesCollateral({ "C", "LAD", "LAD", 0.5, 0.9, 0.5, false }, "leads from LAD to itself");
  refusesCollateral({ "C", "LAD", "RCA", 0.5, 0.9, 3.0, false }, "diameter_mm from 0.2 to 1.5");
}
}
