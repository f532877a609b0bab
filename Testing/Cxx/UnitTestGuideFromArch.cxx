// A guide that comes through an aorta of triangles: the wall that goes with the ostia, the inlet drawn out, the lumen of both, and
// engagement with a wire in it.
#include "AortaTestBench.h"
#include "GuideFromArch.h"
#include "Intervention.h"
#include "OstialTree.h"
#include "Recording.h"
#include "Refusals.h"
#include "SessionRunner.h"
#include "WallMotions.h"
#include "WallTestMeshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace UnitTestGuideFromArch
{
using namespace coronary;

namespace
{
/// The wall and its axis go to and fro along a direction.
class ShakenWall : public WallMotion
{
public:
  ShakenWall(const TriangleBench& bench, const Vector3& way)
    : Topology_(bench.vessels)
    , Points(bench.points)
    , Way(way)
  {
  }
  const WallTopology& Topology() const override { return this->Topology_; }
  void Positions(double phase, std::vector<Vector3>& positions) override
  {
    positions = this->Points;
    for (Vector3& point : positions)
    {
      point += std::sin(2.0 * M_PI * phase) * this->Way;
    }
  }
  void AxisPositions(double phase, std::vector<Vector3>& positions) override
  {
    positions.clear();
    for (const Vector3& point : this->Topology_.axis[0])
    {
      positions.push_back(point + std::sin(2.0 * M_PI * phase) * this->Way);
    }
  }

private:
  WallTopology Topology_;
  std::vector<Vector3> Points;
  Vector3 Way;
};

ContactSample SampleAt(const Vector3& centre, std::int64_t index, double radius = 1.0)
{
  ContactSample sample;
  sample.index = index;
  sample.centre = centre;
  sample.radius = radius;
  return sample;
}
}

TEST(GuideFromArch, InletIsDrawnOut)
{
  const TriangleBench bench(2.0);
  OstialTree tree = MakeOstialTree(
    bench.vessels, bench.points, bench.vessels.axis[0].front(), bench.vessels.axis[0][3]);
  EXPECT_EQ(2, tree.cap);
  const std::size_t before = tree.topology.triangles.size();
  const LengthenedInlet inlet(tree, 6.0);
  EXPECT_EQ(before + 6 * 2 * 24, tree.topology.triangles.size());
  std::vector<Vector3> points = bench.points;
  inlet.Lengthen(points, bench.ostium.direction);
  EXPECT_EQ(tree.topology.points, static_cast<std::int64_t>(points.size()));
  CheckWallSurface(tree.topology, points);
  VesselWallSettings settings;
  settings.openCaps = { tree.cap };
  VesselWall wall(tree.topology, points, settings);
  // From 4 mm within the aorta on it is a tube; what is before it is free.
  std::int64_t index = 0;
  for (double along = -3.5; along < 30.0; along += 0.5)
  {
    SampleContacts contacts;
    const Vector3 across(0.0, 1.1, 0.0);
    const ContactSample sample =
      SampleAt(bench.ostium.position + along * bench.ostium.direction + across, ++index);
    wall.Find(sample, 0.3, contacts);
    ASSERT_GE(contacts.count, 1) << along;
    EXPECT_NEAR(AortaBench::Coronary - 1.0 - 1.1, contacts.plane[0].gap, 0.03) << along;
  }
  SampleContacts contacts;
  wall.Find(SampleAt(bench.ostium.position - 5.5 * bench.ostium.direction, ++index), 0.3, contacts);
  EXPECT_EQ(0, contacts.count);

  WallTopology open = bench.vessels;
  open.entity.assign(open.entity.size(), 1);
  OstialTree without =
    MakeOstialTree(open, bench.points, bench.vessels.axis[0].front(), bench.vessels.axis[0][3]);
  ExpectRefusal([&] { LengthenedInlet(without, 4.0); }, "the vessel has no cap at its ostium");
}

TEST(GuideFromArch, RootGoesWithTheOstiumAndTheArchStandsStill)
{
  const TriangleBench bench;
  const AortaMotion motion(bench.vessels);
  std::vector<Vector3> axis = bench.vessels.axis[0];
  const Vector3 moved(1.0, -2.0, 3.0);
  for (Vector3& point : axis)
  {
    point += moved;
  }
  std::vector<Vector3> points;
  motion.Positions(axis, points);
  const std::vector<Vector3>& rest = bench.vessels.aorta->points;
  int root = 0;
  int still = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    const bool ascending = rest[i].x() < 0.0;
    const Vector3 way = points[i] - rest[i];
    if (ascending && rest[i].z() < AortaBench::Mouths + AortaMotion::RootAbove)
    {
      ++root;
      EXPECT_LT((way - moved).norm(), 1e-5);
    }
    if (!ascending)
    {
      ++still;
      EXPECT_EQ(0.0, way.norm());
    }
    EXPECT_LT(way.cross(moved).norm(), 1e-5);
  }
  EXPECT_GT(root, 500);
  EXPECT_GT(still, 3000);
  WallTopology away = bench.vessels;
  for (Vector3& point : away.axis[0])
  {
    point.y() += 100.0;
  }
  ExpectRefusal(
    [&] { AortaMotion{ away }; }, "no coronary artery begins within 15 mm of the aorta");
  away.aorta = nullptr;
  ExpectRefusal([&] { AortaMotion{ away }; }, "there is no aorta");
}

TEST(GuideFromArch, WhatComesThroughTheMouthIsInTheArtery)
{
  const TriangleBench bench;
  OstialTree tree = MakeOstialTree(
    bench.vessels, bench.points, bench.vessels.axis[0].front(), bench.vessels.axis[0][3]);
  const LengthenedInlet inlet(tree, 4.0);
  std::vector<Vector3> points = bench.points;
  inlet.Lengthen(points, bench.ostium.direction);
  VesselWallSettings settings;
  settings.openCaps = { tree.cap };
  VesselWall artery(tree.topology, points, settings);
  WallTopology shape;
  shape.points = static_cast<std::int64_t>(bench.vessels.aorta->points.size());
  shape.triangles = bench.vessels.aorta->triangles;
  VesselWallSettings wide;
  wide.surfaceReach = 0.0;
  VesselWall aorta(shape, bench.vessels.aorta->points, wide);
  AortaAndArtery lumen(aorta, artery, tree.inlet, 1000, AortaSide::Unknown);
  lumen.SetMouth(bench.ostium.position);
  AortaBench formula;
  WallPlace place;
  Vector3 velocity;
  // From the aorta's middle to 40 mm within the artery, along its wall, and back.
  for (const bool back : { false, true })
  {
    for (double s = -14.0; s < 28.0; s += 0.05)
    {
      const double along = back ? 14.0 - s : s;
      const ContactSample sample = SampleAt(
        bench.ostium.position + along * bench.ostium.direction + Vector3(0.0, 1.2, 0.0), 7);
      SampleContacts found;
      lumen.Find(sample, 0.3, found);
      SampleContacts wanted;
      formula.wall.Find(sample, 0.3, wanted);
      if (along > -3.0 && along < -0.8)
      {
        continue; // at the mouth's rim the tube of triangles ends, that by formula does not
      }
      ASSERT_EQ(wanted.count > 0, found.count > 0) << along << (back ? " back" : "");
      if (wanted.count > 0)
      {
        EXPECT_NEAR(wanted.plane[0].gap, found.plane[0].gap, 0.04) << along;
      }
      EXPECT_FALSE(lumen.Outside(sample, place, velocity)) << along;
      EXPECT_EQ(along > 0.5 ? 0
          : along < -0.5    ? -1
                            : lumen.BranchAt(sample),
        lumen.BranchAt(sample))
        << along;
    }
  }
  // Beside the artery, outside of the aorta: it is put back to the nearer wall.
  const ContactSample beside =
    SampleAt(bench.ostium.position + Vector3(2.0, AortaBench::Coronary + 0.3, 0.0), 8, 0.2);
  SampleContacts ignored;
  lumen.Find(SampleAt(bench.ostium.position + Vector3(2.0, 1.0, 0.0), 8, 0.2), 0.3, ignored);
  lumen.Find(beside, 0.3, ignored);
  ASSERT_TRUE(lumen.Outside(beside, place, velocity));
  EXPECT_NEAR(-0.3, place.distance, 0.05);
}

namespace
{
/// A session's physics in that bench, driven by hand.
struct Drive
{
  Intervention physics;
  DriveInput input;
  double worst = 0.0;
  int outside = 0;

  explicit Drive(std::shared_ptr<WallMotion> wall, const std::string& guide = "JL4-6F")
    : physics(std::move(wall), BuiltInCatalogue().Wire("workhorse").wire,
        BuiltInCatalogue().Catheter(guide).catheter, Settings())
  {
  }
  static InterventionSettings Settings()
  {
    InterventionSettings settings;
    settings.guideFromArch = true;
    settings.heartRate = 60.0;
    return settings;
  }
  void Move(double seconds, double guide, double turn = 0.0, double wire = 0.0)
  {
    const int ticks = static_cast<int>(std::lround(2000.0 * seconds));
    for (int k = 0; k < ticks; ++k)
    {
      this->input.catheterPosition += guide / ticks;
      this->input.catheterAngle += turn / ticks;
      this->input.wirePosition += wire / ticks;
      const TickReport& report = this->physics.Step(this->input);
      this->worst = std::max(this->worst, report.maximumPenetration);
      this->outside += report.outside;
    }
  }
  const TickReport& Report() const { return this->physics.Report(); }
  /// As a trainee does: pushed until it falls in; if it does not, drawn back, turned a little, and once more.
  void Engage()
  {
    for (const double degrees : { 0.0, -5.0, 5.0 })
    {
      this->Move(0.5, 0.0, degrees * M_PI / 180.0 - this->input.catheterAngle);
      double pushed = 0.0;
      for (; pushed < 130.0 && !this->Report().seat.engaged; pushed += 1.0)
      {
        this->Move(0.08, 1.0);
      }
      if (this->Report().seat.engaged)
      {
        std::printf("engaged after %.0f mm, turned by %.0f degrees\n", pushed, degrees);
        this->Move(0.5, 0.0);
        return;
      }
      this->Move(1.5, -pushed);
    }
  }
};
}

TEST(GuideFromArch, EngagesAndAWireGoesOn)
{
  const TriangleBench bench;
  Drive drive(std::make_shared<StillWallMotion>(bench.vessels, bench.points));
  drive.Move(0.05, 0.0);
  EXPECT_FALSE(drive.Report().seat.engaged);
  EXPECT_LT(drive.Report().catheterTip, -20.0);
  drive.Engage();
  const TickReport engaged = drive.Report();
  EXPECT_TRUE(engaged.seat.engaged);
  EXPECT_GT(engaged.catheterTip, 1.0);
  std::printf("in by %.1f mm, %.1f degrees, %.2f mm off the axis\n", engaged.seat.depth,
    engaged.seat.angle * 180.0 / M_PI, engaged.seat.offset);
  drive.Move(1.5, 0.0, 0.0, 45.0);
  EXPECT_NEAR(43.0, drive.Report().inserted, 0.5);
  EXPECT_EQ(0, drive.Report().branch);
  EXPECT_EQ(0, drive.outside);
  EXPECT_LT(drive.worst, 0.2);
  // What is pushed through it takes it back; drawn out, it comes in again.
  drive.Move(1.5, 0.0, 0.0, 20.0);
  EXPECT_GT(drive.Report().proximalForce, 0.05);
  const double pushedOut = drive.Report().seat.depth;
  EXPECT_LT(pushedOut, engaged.seat.depth - 2.0);
  drive.Move(2.0, 0.0, 0.0, -64.0);
  drive.Move(0.5, 0.0);
  EXPECT_GT(drive.Report().seat.depth, pushedOut + 1.0);
}

TEST(GuideFromArch, StaysInABeatingOstium)
{
  const TriangleBench bench(1.0);
  Drive drive(std::make_shared<ShakenWall>(bench, Vector3(0.5, 1.0, 2.0)));
  drive.physics.SetHeartRate(0.0);
  drive.Engage();
  drive.physics.SetHeartRate(60.0);
  drive.Move(3.0, 0.0);
  EXPECT_TRUE(drive.Report().seat.engaged);
  EXPECT_EQ(0, drive.outside);
}

TEST(GuideFromArch, RepeatsBitForBit)
{
  const TriangleBench bench;
  std::uint64_t hash[2];
  for (std::uint64_t& one : hash)
  {
    Drive drive(std::make_shared<ShakenWall>(bench, Vector3(0.5, 1.0, 2.0)));
    drive.Move(0.4, 20.0, 0.5, 10.0);
    one = drive.physics.StateHash();
  }
  EXPECT_EQ(hash[0], hash[1]);
}

// Recorded hands: an extra backup guide in the beating phantom, whose aorta is wide.
TEST(GuideFromArch, TheRecordedOneRepeatsToTheBit)
{
  auto source = std::make_unique<ReplaySource>(
    std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/engage-lca.pcirec");
  const ReplaySource* replay = source.get();
  const Scenario scenario = RecordedScenario(source->Reader().Header().scenario, "The recording");
  const auto wall =
    MakePhantomWallMotion(scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 40);
  const std::uint64_t hash = WallHash(*wall);
  ASSERT_EQ(hash, source->Reader().Header().meshHash);
  SessionRunner runner(wall, scenario, hash, std::move(source));
  double spilled = 0.0;
  double furthest = 0.0;
  runner.afterTick = [&](const SessionReport& report)
  {
    furthest = std::min(furthest, report.tick.catheterTip);
    spilled = runner.Session().Contrast().Balance().spilled;
  };
  while (runner.Run(1000))
  {
  }
  EXPECT_EQ(replay->Reader().HowEnded(), RecordingReader::Ending::Complete);
  EXPECT_GT(runner.Compared().compared, 15U);
  EXPECT_EQ(runner.Compared().equal, runner.Compared().compared)
    << "from tick " << runner.Compared().firstDifference;
  EXPECT_LT(furthest, -40.0);
  EXPECT_TRUE(runner.Session().Report().tick.seat.engaged);
  EXPECT_LT(spilled, 2.0) << "mL of 4";
  EXPECT_EQ(3U, runner.Session().Procedure().reached.size());
}

TEST(GuideFromArch, RefusesAnAortaThatIsNotThere)
{
  const TriangleBench bench(13.0);
  ExpectRefusal([&] { Drive(std::make_shared<StillWallMotion>(bench.vessels, bench.points)); },
    "the aorta's wall is not within 10 mm of the ostium that the guide is to engage");
  // Without an aorta the guide is in the ostium.
  TriangleBench without;
  without.vessels.aorta = nullptr;
  Drive drive(std::make_shared<StillWallMotion>(without.vessels, without.points));
  drive.Move(0.01, 0.0);
  EXPECT_EQ(3.0, drive.Report().catheterTip);
  EXPECT_FALSE(drive.Report().seat.engaged);
}
}
