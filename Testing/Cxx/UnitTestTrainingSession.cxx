// A session as a whole: what is counted of the trainee, that it repeats, and what its X-ray images show.
#include "Attenuation.h"
#include "Electrocardiogram.h"
#include "ExposureControl.h"
#include "HeartShell.h"
#include "PhantomAnatomy.h"
#include "SessionImager.h"
#include "TrainingSession.h"
#include "WallMotions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <utility>

namespace UnitTestTrainingSession
{
using namespace coronary;

namespace
{
constexpr double Degree = M_PI / 180.0;

Scenario TestScenario()
{
  Scenario scenario = LoadScenario("phantom-lca");
  scenario.imaging.columns = 256;
  scenario.imaging.breathing.rate = 0.0; // what is seen is where it is
  return scenario;
}

// Made once; few phases, which is quick and smooth enough.
std::shared_ptr<WallMotion> Phantom()
{
  static const std::shared_ptr<WallMotion> wall = []
  {
    const Scenario scenario = TestScenario();
    return MakePhantomWallMotion(
      scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 8);
  }();
  return wall;
}

Scenario Aimed()
{
  Scenario scenario = TestScenario();
  scenario.imaging.pose = StartPose(Phantom()->Topology(), scenario.imaging);
  return scenario;
}

/// Water around the vessels, 200 mm thick along y.
HounsfieldVolume WaterVolume(const Scenario& scenario)
{
  HounsfieldVolume volume;
  volume.grid.extent = { 0, 39, 0, 19, 0, 39 };
  volume.grid.spacing = Vector3(10.0, 10.0, 10.0);
  volume.grid.origin = scenario.imaging.pose.isocentre - Vector3(195.0, 95.0, 195.0);
  volume.values.assign(40 * 20 * 40, 0);
  return volume;
}

std::shared_ptr<const VolumeProjector> Water(const Scenario& scenario)
{
  return MakeProjector(WaterVolume(scenario), scenario.imaging);
}

float At(const LineIntegrals& image, const Vector3& pixel)
{
  const auto column = static_cast<int>(std::lround(pixel.x()));
  const auto row = static_cast<int>(std::lround(pixel.y()));
  if (column < 0 || row < 0 || column >= image.columns || row >= image.rows)
  {
    return std::numeric_limits<float>::quiet_NaN();
  }
  return image.values[static_cast<std::size_t>(row) * image.columns + column];
}

std::size_t AxisPointsBefore(const WallTopology& topology, int branch)
{
  std::size_t count = 0;
  for (int b = 0; b < branch; ++b)
  {
    count += topology.axis[b].size();
  }
  return count;
}

int BranchNamed(const std::string& name)
{
  const auto& names = Phantom()->Topology().groupName;
  const auto found = std::find(names.begin(), names.end(), name);
  EXPECT_NE(found, names.end()) << name;
  return static_cast<int>(found - names.begin());
}
}

TEST(TrainingSession, CountsWhatTheTraineeDoes)
{
  TrainingSession session(Phantom(), Aimed());
  SessionInput input = session.StartInput();
  std::int64_t frames = 0;
  for (int tick = 0; tick < 8000; ++tick)
  {
    // Off, fluoroscopy for a second, off, cine for a second.
    const int second = tick / 2000;
    input.pedals = second == 1 ? FluoroscopyPedal : second == 3 ? CinePedal : 0U;
    input.drive.wirePosition += second == 1 ? 0.01 : second == 2 ? -0.004 : 0.0;
    input.drive.wireAngle += second == 2 ? 0.001 : 0.0;
    input.syringe += second == 3 ? 0.0015 : 0.0;
    const SessionReport& report = session.Step(input);
    frames += report.exposed ? 1 : 0;
    EXPECT_FALSE(report.exposed && input.pedals == 0U) << tick;
  }
  const SessionMetrics& metrics = session.Metrics();
  EXPECT_NEAR(metrics.procedureSeconds, 4.0, 1e-9);
  EXPECT_NEAR(metrics.fluoroscopySeconds, 2.0, 1e-3);
  EXPECT_NEAR(metrics.cineSeconds, 1.0, 1e-3);
  EXPECT_EQ(metrics.frames, frames);
  EXPECT_NEAR(static_cast<double>(frames), 30.0, 2.0);
  EXPECT_NEAR(metrics.wireTravel, 20.0 + 8.0, 1e-6);
  EXPECT_NEAR(metrics.wireTurning, 2.0, 1e-6);
  EXPECT_NEAR(metrics.contrast, 3.0, 0.05);
  EXPECT_GT(metrics.deepest, 5.0);
  EXPECT_FALSE(metrics.branches.empty());
  // One field all the time: the product is kerma times area.
  DetectorFormat format;
  format.columns = format.rows = 256;
  format.width = format.height = session.FieldOfView();
  const double area = ReferenceFieldArea(session.Pose(), format);
  EXPECT_NEAR(metrics.doseAreaProduct, 1e-3 * metrics.airKerma * area, 1e-9);
  const ContrastBalance balance = session.Contrast().Balance();
  EXPECT_NEAR(
    balance.injected, balance.inTree + balance.blush + balance.washedOut + balance.spilled, 1e-9);
}

TEST(TrainingSession, RepeatsToTheBitAndIsTheInterventionAlone)
{
  const Scenario scenario = Aimed();
  TrainingSession first(Phantom(), scenario);
  TrainingSession second(Phantom(), scenario);
  InterventionSettings settings = scenario.settings;
  settings.rootBranch = RootBranch(Phantom()->Topology(), scenario.artery);
  Intervention alone(Phantom(), scenario.wire, scenario.catheter, settings);
  SessionInput input = first.StartInput();
  for (int tick = 0; tick < 1000; ++tick)
  {
    input.drive.wirePosition += 0.01;
    first.Step(input);
    second.Step(input);
    alone.Step(input.drive);
  }
  // Recordings of before there was contrast medium verify still.
  EXPECT_EQ(first.StateHash(), alone.StateHash());
  for (int tick = 0; tick < 1000; ++tick)
  {
    input.syringe += 0.001;
    input.pedals = FluoroscopyPedal;
    first.Step(input);
    second.Step(input);
    alone.Step(input.drive);
  }
  EXPECT_EQ(first.StateHash(), second.StateHash());
  EXPECT_NE(first.StateHash(), alone.StateHash());
  input.syringe += 0.001;
  first.Step(input);
  input.syringe -= 0.0005;
  second.Step(input);
  for (int tick = 0; tick < 20; ++tick)
  {
    first.Step(input);
    second.Step(input);
  }
  EXPECT_NE(first.StateHash(), second.StateHash()) << "other hands, other state";
}

TEST(TrainingSession, ASyringeHasItsLimits)
{
  TrainingSession session(Phantom(), Aimed());
  SessionInput input = session.StartInput();
  input.syringe = 10.0; // at once
  for (int tick = 0; tick < 200; ++tick)
  {
    session.Step(input);
  }
  EXPECT_NEAR(session.Report().injection, 12.0, 1e-9) << "mL/s";
  EXPECT_NEAR(session.Metrics().contrast, 1.2, 0.1);
  const auto messages = session.TakeMessages();
  EXPECT_EQ(std::count_if(messages.begin(), messages.end(),
              [](const std::string& text) { return text.find("syringe") != std::string::npos; }),
    1);
  // Drawn back, it sucks nothing, and pushes again from there.
  input.syringe = 5.0;
  for (int tick = 0; tick < 100; ++tick)
  {
    session.Step(input);
  }
  const double before = session.Metrics().contrast;
  EXPECT_EQ(session.Report().injection, 0.0);
  input.syringe = 5.01;
  for (int tick = 0; tick < 100; ++tick)
  {
    session.Step(input);
  }
  EXPECT_NEAR(session.Metrics().contrast - before, 0.01, 1e-9);
  input.syringe = std::numeric_limits<double>::quiet_NaN();
  for (int tick = 0; tick < 100; ++tick)
  {
    session.Step(input);
  }
  EXPECT_NEAR(session.Metrics().contrast - before, 0.01, 1e-9);
}

TEST(TrainingSession, TheCArmStaysWithinItsReach)
{
  const Scenario scenario = Aimed();
  TrainingSession session(Phantom(), scenario);
  SessionInput input = session.StartInput();
  input.primary = 30.0 * Degree;
  input.table = { 10.0, 0.0, -5.0 };
  session.Step(input);
  EXPECT_NEAR(session.Pose().primary, 30.0 * Degree, 1e-12);
  EXPECT_NEAR(
    (session.Pose().isocentre - scenario.imaging.pose.isocentre - input.table).norm(), 0.0, 1e-12);
  input.primary = 100.0;
  input.secondary = std::numeric_limits<double>::quiet_NaN();
  input.sourceToDetector = -5.0;
  session.Step(input);
  EXPECT_LT(session.Pose().primary, M_PI);
  EXPECT_EQ(session.Pose().secondary, scenario.imaging.pose.secondary);
  EXPECT_GT(session.Pose().sourceToDetector, session.Pose().sourceToIsocentre);
  EXPECT_FALSE(session.Apply({ RecordedEvent::FrameRate, 13.0 }));
  EXPECT_TRUE(session.Apply({ RecordedEvent::FrameRate, 7.5 }));
  EXPECT_FALSE(session.Apply({ 200, 1.0 }));
  EXPECT_TRUE(session.Apply({ RecordedEvent::FieldOfView, 150.0 }));
  EXPECT_EQ(session.FieldOfView(), 150.0);
}

TEST(TrainingSession, ShuttersTakeAwayDoseAndImage)
{
  const Scenario scenario = Aimed();
  TrainingSession open(Phantom(), scenario);
  TrainingSession shut(Phantom(), scenario);
  EXPECT_TRUE(shut.Apply({ RecordedEvent::ShutterSides, 0.25 }));
  EXPECT_TRUE(shut.Apply({ RecordedEvent::ShutterEnds, 7.0 })); // as far as they go
  SessionInput input = open.StartInput();
  input.pedals = FluoroscopyPedal;
  for (int tick = 0; tick < 1000; ++tick)
  {
    open.Step(input);
    shut.Step(input);
  }
  EXPECT_GT(open.Metrics().doseAreaProduct, 0.0);
  EXPECT_NEAR(shut.Metrics().doseAreaProduct, 0.5 * 0.1 * open.Metrics().doseAreaProduct, 1e-9);
  EXPECT_EQ(shut.Metrics().airKerma, open.Metrics().airKerma);
  SessionSnapshot moment;
  shut.SnapshotOfImage(moment);
  EXPECT_EQ(moment.shutters.right, 0.25);
  EXPECT_EQ(moment.shutters.top, 0.45);
}

TEST(TrainingSession, DosesAsThePatientsThicknessNeeds)
{
  const Scenario scenario = Aimed();
  const ExposureControl control(
    Water(scenario), Attenuation(scenario.imaging.energy).Of(XRayMaterial::Water));
  TrainingSession session(Phantom(), scenario, Water(scenario));
  TrainingSession same(Phantom(), scenario, Water(scenario));
  TrainingSession uncontrolled(Phantom(), scenario);
  Scenario off = scenario;
  off.imaging.exposureControl = false;
  TrainingSession switchedOff(Phantom(), off, Water(scenario));
  SessionInput input = session.StartInput();
  DetectorFormat format;
  format.columns = format.rows = 256;
  format.width = format.height = session.FieldOfView();
  double kerma = 0.0;
  SessionSnapshot moment;
  for (const double primary : { 0.0, 20.0, 45.0 })
  {
    input.primary = primary * Degree;
    input.pedals = FluoroscopyPedal;
    for (int tick = 0; tick < 400; ++tick)
    {
      const bool exposed = session.Step(input).exposed;
      for (TrainingSession* other : { &same, &uncontrolled, &switchedOff })
      {
        EXPECT_EQ(other->Step(input).exposed, exposed);
      }
      if (!exposed)
      {
        continue;
      }
      session.SnapshotOfImage(moment);
      const ViewExposure view = control.Of(session.Pose(), format);
      EXPECT_DOUBLE_EQ(moment.exposure.kerma, 0.029 * view.kerma);
      EXPECT_DOUBLE_EQ(moment.exposure.photons, 2000.0 * view.photons);
      kerma += moment.exposure.kerma;
    }
  }
  EXPECT_NEAR(session.Metrics().airKerma, kerma, 1e-9);
  // 200 mm of water become 283.
  EXPECT_GT(moment.exposure.kerma, 4.0 * 0.029);
  EXPECT_EQ(session.StateHash(), same.StateHash());
  EXPECT_NE(session.StateHash(), uncontrolled.StateHash());
  EXPECT_EQ(uncontrolled.StateHash(), switchedOff.StateHash());
  EXPECT_NEAR(uncontrolled.Metrics().airKerma,
    0.029 * static_cast<double>(uncontrolled.Metrics().frames), 1e-9);
}

TEST(SessionImager, BreathingMovesTheHeartWithAllThatIsInIt)
{
  Scenario scenario = Aimed();
  scenario.imaging.heartShadowMoves = false;
  scenario.imaging.breathing.rate = 15.0;
  TrainingSession session(Phantom(), scenario);
  const auto parts = MovingPartsOf(WaterVolume(scenario), Phantom()->Topology(), scenario.imaging);
  ASSERT_TRUE(parts && parts->heart.projector);
  SessionImager imager(Phantom()->Topology(), scenario, Water(scenario), false, parts);
  SessionImager still(Phantom()->Topology(), scenario, Water(scenario), false);
  scenario.imaging.heartShadowMoves = true;
  SessionImager beating(Phantom()->Topology(), scenario, Water(scenario), false, parts);
  SessionInput input = session.StartInput();
  input.pedals = CinePedal;
  input.drive.wirePosition = 15.0;
  SessionSnapshot moment;
  for (int tick = 0; tick < 4000; ++tick)
  {
    session.Step(input);
  }
  session.SnapshotOfImage(moment);
  EXPECT_NEAR(moment.diaphragm, scenario.imaging.breathing.amplitude, 1e-6) << "half a breath";
  const auto hash = [&](SessionImager& one) { return SessionImager::HashOf(one.Expose(moment)); };
  const std::uint64_t inspired = hash(imager);
  EXPECT_NE(inspired, hash(still)) << "the heart's shadow";
  EXPECT_NE(inspired, hash(beating));
  EXPECT_EQ(hash(beating), hash(beating)) << "lag aside, the same bits";
  DetectorFormat format;
  format.columns = format.rows = 256;
  format.width = format.height = session.FieldOfView();
  const CArmGeometry geometry(moment.pose, format);
  const Vector3 tip = moment.wire[6];
  EXPECT_GT(At(imager.Instruments(), geometry.Project(tip + HeartShift(moment.diaphragm))), 0.1F);

  // At the end of expiration, and with a heart whose shadow stands still, not a bit is changed.
  moment.diaphragm = 0.0;
  scenario.imaging.heartShadowMoves = false;
  SessionImager expired(Phantom()->Topology(), scenario, Water(scenario), false, parts);
  SessionImager before(Phantom()->Topology(), scenario, Water(scenario), false);
  EXPECT_EQ(hash(expired), hash(before));
  EXPECT_GT(At(expired.Instruments(), geometry.Project(tip)), 0.1F);
  EXPECT_TRUE(session.Apply({ RecordedEvent::Breaths, 0.0 }));
  session.Step(input);
  session.SnapshotOfImage(moment);
  const double held = moment.diaphragm;
  for (int tick = 0; tick < 1000; ++tick)
  {
    session.Step(input);
  }
  session.SnapshotOfImage(moment);
  EXPECT_EQ(moment.diaphragm, held);
  scenario.imaging.breathing.amplitude = 0.0;
  EXPECT_FALSE(MovingPartsOf(WaterVolume(scenario), Phantom()->Topology(), scenario.imaging));
}

TEST(SessionImager, ShowsTheWireAndTheMediumWhereTheyAre)
{
  const Scenario scenario = Aimed();
  TrainingSession session(Phantom(), scenario);
  const auto water = Water(scenario);
  SessionImager imager(Phantom()->Topology(), scenario, water, false);
  SessionImager again(Phantom()->Topology(), scenario, water, false);
  SessionInput input = session.StartInput();
  input.pedals = FluoroscopyPedal;
  SessionSnapshot before;
  for (int tick = 0; tick < 2000; ++tick)
  {
    input.drive.wirePosition += 0.01;
    session.Step(input);
  }
  session.SnapshotOfImage(before);
  imager.Expose(before);
  EXPECT_EQ(imager.BackgroundCompleteness(), 1.0);
  EXPECT_EQ(
    *std::max_element(imager.Contrast().values.begin(), imager.Contrast().values.end()), 0.0F)
    << "nothing was injected";
  DetectorFormat format;
  format.columns = format.rows = 256;
  format.width = format.height = session.FieldOfView();
  const CArmGeometry geometry(before.pose, format);
  // Five millimetres behind the tip, the coil is to be seen; far from everything, nothing.
  EXPECT_GT(At(imager.Instruments(), geometry.Project(before.wire[6])), 0.1F);
  EXPECT_EQ(At(imager.Instruments(), { 250.0, 250.0, 0.0 }), 0.0F);

  for (int tick = 0; tick < 4000; ++tick)
  {
    input.syringe += 0.0015;
    session.Step(input);
  }
  SessionSnapshot after;
  session.SnapshotOfImage(after);
  const std::uint64_t hash = SessionImager::HashOf(imager.Expose(after));
  again.Expose(before);
  EXPECT_EQ(SessionImager::HashOf(again.Expose(after)), hash) << "same seed, same bits";

  // Along the LAD the medium's shadow is attenuation, concentration and the lumen's chord.
  const WallTopology& topology = Phantom()->Topology();
  const double neat =
    Attenuation(scenario.imaging.energy).OfContrastMedium(scenario.imaging.iodine);
  std::map<std::string, double> seen;
  for (const char* name : { "pLAD", "mLAD", "pRCA", "mRCA" })
  {
    const int branch = BranchNamed(name);
    const std::size_t first = AxisPointsBefore(topology, branch);
    const std::size_t middle = topology.axis[branch].size() / 2;
    const Vector3 pixel = geometry.Project(after.axis[first + middle]);
    seen[name] = At(imager.Contrast(), pixel);
    const double slab = after.concentration[first - branch + middle];
    const double radius = topology.axisRadius[branch][middle];
    const Vector3 along =
      (after.axis[first + middle + 1] - after.axis[first + middle - 1]).normalized();
    const Vector3 ray =
      (geometry.PixelPosition(pixel.x(), pixel.y()) - geometry.Source()).normalized();
    const double sine = along.cross(ray).norm();
    const double expected = neat * slab * 2.0 * radius / std::max(0.2, sine);
    if (std::string(name).find("RCA") == std::string::npos)
    {
      // Other vessels may lie before or behind it, so it is at least that.
      EXPECT_GT(seen[name], 0.7 * expected) << name;
      EXPECT_GT(expected, 0.2) << name << ": the medium has arrived";
    }
    else
    {
      EXPECT_EQ(slab, 0.0) << name << ": the other artery gets none";
    }
  }
}

TEST(SessionImager, ABackgroundWithoutInstrumentsIsThePatient)
{
  Scenario scenario = Aimed();
  scenario.imaging.pose.primary = 0.0;
  TrainingSession session(Phantom(), scenario);
  SessionImager imager(Phantom()->Topology(), scenario, Water(scenario), false);
  SessionInput input = session.StartInput();
  input.pedals = CinePedal;
  session.Step(input);
  SessionSnapshot moment;
  session.SnapshotOfImage(moment);
  const GreyImage& image = imager.Expose(moment);
  EXPECT_EQ(image.columns, 256);
  // Water of even thickness: the corners are as grey as the middle, up to noise and the rays' slant.
  const auto mean = [&](int column, int row)
  {
    double sum = 0.0;
    for (int y = row; y < row + 24; ++y)
    {
      for (int x = column; x < column + 24; ++x)
      {
        sum += image.values[static_cast<std::size_t>(y) * 256 + x];
      }
    }
    return sum / (24.0 * 24.0);
  };
  EXPECT_NEAR(mean(8, 220), mean(220, 220), 12.0);
}

TEST(HeartShell, LiesUnderTheArteriesAndBeatsWithThem)
{
  const Scenario scenario = TestScenario();
  const HeartFrame frame = PhantomAnatomy(scenario.vessels.phantom).frame;
  PatientHeart measured;
  measured.axes = frame.axes;
  measured.base = frame.origin;
  measured.length = HeartFrame::ApexHeight * frame.size;
  measured.rightWidth *= frame.size;
  enum class Kind
  {
    Phantoms,
    Patients,
    Unknown
  };
  for (const Kind kind : { Kind::Phantoms, Kind::Patients, Kind::Unknown })
  {
    const bool own = kind != Kind::Unknown;
    const HeartShell shell = kind == Kind::Phantoms
      ? HeartShell(scenario.vessels.phantom)
      : HeartShell(*Phantom(), kind == Kind::Patients ? &measured : nullptr);
    std::vector<Vector3> points;
    std::map<std::pair<std::int64_t, std::int64_t>, int> edges;
    for (const Triangle& triangle : shell.Triangles())
    {
      for (int corner = 0; corner < 3; ++corner)
      {
        ++edges[{ triangle[corner], triangle[(corner + 1) % 3] }];
      }
    }
    for (const auto& [edge, count] : edges)
    {
      ASSERT_EQ(count, 1);
      ASSERT_EQ(edges.count({ edge.second, edge.first }), 1U) << "closed and oriented";
    }
    const auto volume = [&](double phase)
    {
      shell.Positions(phase, points);
      double sum = 0.0;
      for (const Triangle& t : shell.Triangles())
      {
        sum += points[t[0]].dot(points[t[1]].cross(points[t[2]])) / 6.0;
      }
      return sum;
    };
    EXPECT_GT(volume(0.0), 1e5) << "mm^3, and outwards";
    EXPECT_LT(volume(0.35), 0.97 * volume(0.0)) << "smaller in systole";
    EXPECT_NEAR(volume(0.2), volume(1.2), 1e-6 * volume(0.2)) << "periodic";
    if (own)
    {
      shell.Positions(0.5, points);
      std::vector<Vector3> axis;
      Phantom()->AxisPositions(0.5, axis);
      Vector3 middle = Vector3::Zero();
      for (const Vector3& point : points)
      {
        middle += point / static_cast<double>(points.size());
      }
      std::size_t above = 0;
      for (const Vector3& point : axis)
      {
        const Vector3 direction = (point - middle).normalized();
        const auto nearest = std::max_element(points.begin(), points.end(),
          [&](const Vector3& a, const Vector3& b) {
            return (a - middle).normalized().dot(direction) <
              (b - middle).normalized().dot(direction);
          });
        above += (point - middle).norm() > (*nearest - middle).norm() ? 1 : 0;
      }
      // All but the septal branches, which dive into the muscle.
      EXPECT_GT(static_cast<double>(above), 0.7 * static_cast<double>(axis.size()));
    }
    if (kind == Kind::Patients)
    {
      // As long as the heart, and no place far from the phantom's own epicardium, also where there is no vessel.
      shell.Positions(0.75, points);
      std::vector<Vector3> truth;
      HeartShell(scenario.vessels.phantom).Positions(0.75, truth);
      const auto height = [&](const Vector3& point) { return frame.ToHeart(point)[2]; };
      const auto lowest = [&](const std::vector<Vector3>& shape)
      {
        double deepest = 0.0;
        for (const Vector3& point : shape)
        {
          deepest = std::max(deepest, height(point));
        }
        return deepest;
      };
      EXPECT_NEAR(lowest(points), lowest(truth), 12.0);
      double sum = 0.0;
      for (const Vector3& point : points)
      {
        double nearest = 1e9;
        for (const Vector3& other : truth)
        {
          nearest = std::min(nearest, (other - point).norm());
        }
        sum += nearest;
      }
      EXPECT_LT(sum / static_cast<double>(points.size()), 8.0) << "mm";
      std::printf("mean distance from the phantom's heart %.1f mm, lowest %.1f and %.1f mm\n",
        sum / static_cast<double>(points.size()), lowest(points), lowest(truth));
    }
  }
}

TEST(Electrocardiogram, HasItsRWaveAtPhaseZeroAndIsPeriodic)
{
  double highest = -1.0;
  double where = -1.0;
  for (int n = -500; n < 500; ++n)
  {
    const double phase = n / 1000.0;
    const double lead = ElectrocardiogramAt(phase);
    ASSERT_NEAR(lead, ElectrocardiogramAt(phase + 3.0), 1e-12);
    if (lead > highest)
    {
      highest = lead;
      where = phase;
    }
  }
  EXPECT_NEAR(where, 0.0, 0.003);
  EXPECT_NEAR(highest, 1.0, 0.15) << "mV";
  EXPECT_GT(ElectrocardiogramAt(0.25), 0.2) << "T";
  EXPECT_GT(ElectrocardiogramAt(-1.0 / 6.0), 0.1) << "P";
}
}
