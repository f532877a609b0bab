// Contrast medium in a whole session: guide catheter, arteries and aorta, their shadows, and what goes wrong.
#include "AortaImage.h"
#include "Attenuation.h"
#include "Recording.h"
#include "Refusals.h"
#include "SessionImager.h"
#include "SessionRunner.h"
#include "TableRow.h"
#include "TrainingSession.h"
#include "WallMotions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numeric>
#include <optional>
#include <string>

namespace UnitTestContrastSession
{
using namespace coronary;

namespace
{
/// Made once, with few phases.
std::shared_ptr<WallMotion> Phantom()
{
  static const std::shared_ptr<WallMotion> wall = []
  {
    const Scenario scenario = LoadScenario("lca-events");
    return MakePhantomWallMotion(
      scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 8);
  }();
  return wall;
}

Scenario Events()
{
  Scenario scenario = LoadScenario("lca-events");
  scenario.imaging.columns = 256;
  scenario.imaging.breathing.rate = 0.0;
  scenario.imaging.pose = StartPose(Phantom()->Topology(), scenario.imaging);
  return scenario;
}

double Off(const ContrastBalance& b)
{
  return std::abs(
    b.inGuide + b.inTree + b.blush + b.washedOut + b.inAorta + b.leftAorta - b.injected);
}

struct Driven
{
  TrainingSession session;
  SessionInput input;

  explicit Driven(const Scenario& scenario)
    : session(Phantom(), scenario)
    , input(this->session.StartInput())
  {
  }
  void Move(double seconds, double inject = 0.0)
  {
    const int ticks = static_cast<int>(std::lround(2000.0 * seconds));
    for (int k = 0; k < ticks; ++k)
    {
      this->input.syringe += inject / ticks;
      this->session.Step(this->input);
    }
  }
  bool Said(const std::string& part)
  {
    const std::vector<std::string> messages = this->session.TakeMessages();
    return std::any_of(messages.begin(), messages.end(),
      [&](const std::string& text) { return text.find(part) != std::string::npos; });
  }
};

double Sum(const LineIntegrals& image)
{
  return std::accumulate(image.values.begin(), image.values.end(), 0.0);
}
}

TEST(ContrastSession, TheGuideFillsFirstAndEverythingIsSomewhere)
{
  Scenario scenario = Events();
  scenario.incidents.clear();
  const double lumen =
    1e-3 * M_PI * std::pow(scenario.catheter.innerRadius, 2) * scenario.catheter.length;
  Driven driven(scenario);
  TrainingSession& session = driven.session;
  driven.Move(1.0, 2.0);
  driven.Move(0.01);
  EXPECT_NEAR(session.Balance().inGuide, 2.0, 1e-6) << "nothing has come to the tip";
  EXPECT_EQ(session.Balance().inTree, 0.0);
  EXPECT_NEAR(session.Metrics().contrast, 2.0, 1e-6);
  driven.Move(1.0, 8.0);
  ContrastBalance balance = session.Balance();
  EXPECT_NEAR(balance.inGuide, lumen, 1e-6);
  EXPECT_GT(balance.inTree, 0.5);
  EXPECT_GT(balance.inAorta, 0.5) << "8 mL/s is more than the artery takes";
  EXPECT_LT(Off(balance), 1e-9);
  Row("session: 10 mL injected, mL off in guide, arteries, myocardium, aorta", 0.0, Off(balance),
    "1e-9");
  // It stays in the guide until it is flushed.
  driven.Move(3.0);
  EXPECT_NEAR(session.Balance().inGuide, lumen, 1e-6);
  const double aorta = session.Balance().inAorta;
  EXPECT_LT(aorta, 0.3 * balance.inAorta);
  EXPECT_TRUE(session.Apply({ RecordedEvent::Flush, 10.0 }));
  driven.Move(4.0);
  balance = session.Balance();
  EXPECT_NEAR(balance.inGuide, 0.0, 1e-9);
  EXPECT_LT(Off(balance), 1e-9);
  EXPECT_NEAR(balance.injected, 10.0, 1e-6);
  // Drawn back it is in the syringe.
  driven.Move(1.0, 2.0);
  EXPECT_TRUE(session.Apply({ RecordedEvent::Flush, -3.0 }));
  driven.Move(2.0);
  EXPECT_NEAR(session.Balance().inGuide, 2.0, 1e-6);
  EXPECT_LT(Off(session.Balance()), 1e-9);
  SessionSnapshot now;
  session.SnapshotOfImage(now);
  double medium = 0.0;
  for (const GuideLumen::Plug& plug : now.guide)
  {
    medium += plug.medium * plug.volume;
  }
  EXPECT_NEAR(medium, 0.0, 1e-9);
}

TEST(ContrastSession, WithoutALumenItIsAsItWas)
{
  Scenario scenario = Events();
  scenario.incidents.clear();
  scenario.contrast.guideLumen = false;
  Driven driven(scenario);
  driven.Move(0.5, 2.0);
  EXPECT_EQ(driven.session.Balance().inGuide, 0.0);
  EXPECT_GT(driven.session.Balance().inTree, 1.0);
  EXPECT_LT(Off(driven.session.Balance()), 1e-9);
  EXPECT_FALSE(driven.session.Apply({ RecordedEvent::Flush, 5.0 }));
  EXPECT_TRUE(driven.Said("cannot be flushed"));
  EXPECT_FALSE(driven.session.Apply({ RecordedEvent::Incident, 1.0 }));
  EXPECT_TRUE(driven.Said("There is no event number 1: the scenario has 0."));
}

// As much as is in the aorta is in its shadow: the sum over the image is attenuation times volume, as magnified.
TEST(ContrastSession, TheAortasShadowHasItsMedium)
{
  const Scenario scenario = Events();
  const WallTopology& topology = Phantom()->Topology();
  const std::unique_ptr<AortaImage> aorta = AortaImage::Make(topology);
  ASSERT_TRUE(aorta);
  const AorticSections sections = SectionsOfAorta(topology);
  std::vector<Vector3> axis;
  Phantom()->AxisPositions(0.0, axis);
  DetectorFormat format;
  format.columns = format.rows = 256;
  format.width = format.height = 400.0;
  const CArmGeometry geometry(scenario.imaging.pose, format);
  const double neat =
    Attenuation(scenario.imaging.energy).OfContrastMedium(scenario.imaging.iodine);
  const std::size_t slices = sections.radii.size() - 1;
  const double pixel = format.width / format.columns;
  const auto expected = [&](double volume, const Vector3& where)
  {
    const Vector3 seen = geometry.Project(where);
    const double scale = geometry.Magnification(seen.z()) / pixel;
    const double cosine = seen.z() / (where - geometry.Source()).norm();
    return neat * 1000.0 * volume * scale * scale / cosine;
  };
  std::vector<double> nothing(slices, 0.0);
  std::vector<double> some = nothing;
  some[3] = 0.2;
  LineIntegrals image(256, 256);
  aorta->Add(axis, some, { 0.0, 0.0 }, neat, geometry, image);
  const double exact = expected(0.2 * sections.Volume(3), sections.points[3]);
  Row("shadow of a slice of the aorta: sum over the image", exact, Sum(image), "5 %");
  EXPECT_NEAR(Sum(image) / exact, 1.0, 0.05);
  LineIntegrals cloud(256, 256);
  aorta->Add(axis, nothing, { 1.5, 0.0 }, neat, geometry, cloud);
  EXPECT_NEAR(Sum(cloud) / expected(1.5, axis[0]), 1.0, 0.05);
  LineIntegrals empty(256, 256);
  aorta->Add(axis, nothing, { 0.0, 0.0 }, neat, geometry, empty);
  EXPECT_EQ(Sum(empty), 0.0);
  WallTopology without = topology;
  without.aorta = nullptr;
  EXPECT_FALSE(AortaImage::Make(without));
}

TEST(ContrastSession, SpasmAndAirComeAndGo)
{
  Driven driven(Events());
  TrainingSession& session = driven.session;
  const WallTopology& topology = Phantom()->Topology();
  const auto branch =
    static_cast<int>(std::find(topology.groupName.begin(), topology.groupName.end(), "mLAD") -
      topology.groupName.begin());
  const auto meanFlow = [&](int of)
  {
    double sum = 0.0;
    for (int k = 0; k < 160; ++k)
    {
      driven.Move(0.005);
      sum += session.Contrast().Flow(of) / 160.0;
    }
    return sum;
  };
  driven.Move(4.0);
  const double before = meanFlow(branch);
  driven.Move(5.0);
  EXPECT_TRUE(driven.Said("Vasospasm: the mLAD narrows by 85 %."));
  const double narrowed = meanFlow(branch);
  std::printf("flow into the mLAD: %.3f, in spasm %.3f mL/s\n", before, narrowed);
  EXPECT_LT(narrowed, 0.7 * before);
  SessionSnapshot now;
  session.SnapshotOfImage(now);
  EXPECT_FALSE(now.lumen.empty());
  EXPECT_TRUE(session.Apply({ RecordedEvent::Incident, 0.0 }));
  // Air is in the guide until it is pushed out; then the left circumflex artery's end gets nothing.
  EXPECT_TRUE(session.Apply({ RecordedEvent::Incident, 2.0 }));
  driven.Move(0.1);
  EXPECT_TRUE(driven.Said("0.15 mL of air"));
  driven.Move(2.0, 4.0);
  EXPECT_TRUE(driven.Said("Air goes into the coronary artery"));
  const std::vector<ProcedureEvent>& events = session.Metrics().events;
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].kind, ProcedureEvent::Kind::Spasm);
  EXPECT_EQ(events[0].branch, branch);
  EXPECT_NEAR(events[0].seconds, 5.0, 0.01);
  EXPECT_EQ(events[1].kind, ProcedureEvent::Kind::Air);
  EXPECT_LT(std::abs(meanFlow(events[1].branch)), 0.02);
  EXPECT_GT(meanFlow(branch), 1.01 * narrowed) << "nitrates begin to work";
  EXPECT_FALSE(session.Apply({ RecordedEvent::Incident, 3.0 }));
  EXPECT_TRUE(driven.Said("There is no event number 3: the scenario has 2."));
  Scenario wrong = Events();
  wrong.incidents[0].vessel = "nowhere";
  ExpectRefusal([&] { TrainingSession(Phantom(), wrong); }, "'nowhere', which is not there");
}

TEST(ContrastSession, AScenariosEventsComeBackToTheBit)
{
  const Scenario scenario = LoadScenario("lca-events");
  ASSERT_EQ(scenario.incidents.size(), 2U);
  EXPECT_TRUE(scenario.contrast.guideLumen);
  const std::string text = ScenarioText(scenario);
  const Scenario again = ScenarioFromText(text, "'text'", ".");
  EXPECT_EQ(ScenarioText(again), text);
  const auto refused = [&](const std::string& from, const std::string& to, const char* part)
  {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    ExpectRefusal([&] { ScenarioFromText(changed, "'own.json'", "."); }, part);
  };
  refused("\"spasm\"", "\"rupture\"", "'rupture' is none of spasm, air");
  refused("\"narrowing\": 0.85", "\"narrowing\": 1.5", "event 1");
  refused("\"air_mL\": 0.15", "\"air_mL\": 70", "event 2");
  refused("\"when\": \"called\"", "\"when\": \"never\"", "event 2");
}

namespace
{
/// A recording, replayed to its end: all of its hashes are equal.
struct Replayed
{
  explicit Replayed(const std::string& name)
  {
    auto source = std::make_unique<ReplaySource>(
      std::string(DYNAMICCORONARY_SOURCE_DIR) + "/Testing/Data/Driving/" + name);
    const ReplaySource* replay = source.get();
    Scenario scenario = RecordedScenario(source->Reader().Header().scenario, "The recording");
    const auto wall =
      MakePhantomWallMotion(scenario.vessels.phantom, scenario.vessels.phantom.surfaceSpacing, 40);
    scenario.imaging.pose = StartPose(wall->Topology(), scenario.imaging);
    const std::uint64_t hash = WallHash(*wall);
    EXPECT_EQ(hash, source->Reader().Header().meshHash);
    this->Runner.emplace(
      wall, scenario, hash, std::move(source), MeasuredThorax(scenario, wall->Topology()));
    while (this->Runner->Run(1000))
    {
    }
    EXPECT_EQ(replay->Reader().HowEnded(), RecordingReader::Ending::Complete);
    EXPECT_GT(this->Runner->Compared().compared, 15U);
    EXPECT_EQ(this->Runner->Compared().equal, this->Runner->Compared().compared)
      << "from tick " << this->Runner->Compared().firstDifference;
    EXPECT_LT(Off(this->Runner->Session().Balance()), 1e-9);
  }

  std::optional<SessionRunner> Runner;
};
}

// Recorded hands: a spasm, nitrates, a flush, air.
TEST(ContrastSession, TheRecordedOneRepeatsToTheBit)
{
  const Replayed played("lca-events.pcirec");
  EXPECT_EQ(played.Runner->Session().Metrics().events.size(), 2U);
}

// Recorded hands: cine runs from three sides, the last one between shutters.
TEST(ContrastSession, TheRecordedAngiogramRepeatsToTheBit)
{
  const Replayed played("angiogram-lca.pcirec");
  const TrainingSession& session = played.Runner->Session();
  EXPECT_EQ(session.Procedure().reached.size(), 1U);
  EXPECT_TRUE(session.Score().passed);
  EXPECT_EQ(session.Score().points, 100.0);
  EXPECT_EQ(session.Metrics().frames, 211);
  EXPECT_NEAR(session.Metrics().contrast, 19.5, 1e-6);
  SessionSnapshot moment;
  session.SnapshotOfImage(moment);
  EXPECT_EQ(moment.shutters.left, 0.12);
}
}
