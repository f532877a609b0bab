// A session on its threads: what hands do reaches it, pauses are not made up for, recordings repeat to the bit, and nothing is
// left of those that could not be finished. Time is the test's own, but for one case in real time.
#include "RecordedDevices.h"
#include "SessionEngine.h"
#include "WallMotions.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

using namespace coronary;
namespace fs = std::filesystem;

namespace
{
/// A small patient: few phases, water around the vessels, 128 x 128 pixels.
const SessionWorld& World()
{
  static const SessionWorld world = []
  {
    SessionWorld made;
    made.scenario = LoadScenario("phantom-lca");
    ImagingSettings& imaging = made.scenario.imaging;
    imaging.columns = 128;
    made.wall = MakePhantomWallMotion(made.scenario.vessels.phantom, 1.0, 8);
    made.wallHash = WallHash(*made.wall);
    imaging.pose = StartPose(made.wall->Topology(), imaging);
    HounsfieldVolume water;
    water.grid.extent = { 0, 39, 0, 19, 0, 39 };
    water.grid.spacing = Vector3(10.0, 10.0, 10.0);
    water.grid.origin = imaging.pose.isocentre - Vector3(195.0, 95.0, 195.0);
    water.values.assign(40 * 20 * 40, 0);
    made.background = MakeProjector(water, imaging);
    return made;
  }();
  return world;
}

DriveScript Script(const std::string& pieces)
{
  return DriveScriptFromText(
    R"({ "format": "dynamiccoronary script", "version": 1, "pieces": )" + pieces + "}", "'script'");
}

/// Even driving, fluoroscopy with some contrast medium, and another heart rate after a second.
DriveScript Driving()
{
  return Script(R"([ { "seconds": 1, "wire_mm": 10, "pedals": ["fluoroscopy"] },
    { "seconds": 9, "wire_mm": 45, "wire_deg": 300, "inject_mL": 9, "heart_rate_bpm": 90 } ])");
}

std::shared_ptr<DeviceMux> Mux(const DriveScript& script)
{
  auto mux = std::make_shared<DeviceMux>();
  const CArmPose& pose = World().scenario.imaging.pose;
  SessionInput start;
  start.primary = pose.primary;
  start.secondary = pose.secondary;
  start.sourceToDetector = pose.sourceToDetector;
  mux->Add(std::make_shared<ScriptDevice>(script, "script", start));
  mux->Start({ pose.primary, pose.secondary, pose.sourceToDetector, Vector3::Zero() });
  return mux;
}

/// A clock that goes on whenever it is looked at: as fast as the physics can.
std::function<double()> Hasty()
{
  return [seconds = 0.0]() mutable { return seconds += 0.0005; };
}

/// Waits up to a minute, which machines need that have much else to do.
void WaitFor(const std::function<bool()>& reached)
{
  const auto start = std::chrono::steady_clock::now();
  while (!reached())
  {
    ASSERT_LT(std::chrono::steady_clock::now() - start, std::chrono::minutes(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

/// As the window does while the session runs, up to a time of the session.
void RunUntil(SessionEngine& engine, double seconds, SessionSnapshot& now)
{
  WaitFor(
    [&]
    {
      engine.LatestScene(now);
      return now.seconds >= seconds || engine.IsOver();
    });
}

std::string StopsWith(SessionEngine& engine)
{
  try
  {
    engine.Stop();
  }
  catch (const std::runtime_error& error)
  {
    return error.what();
  }
  return {};
}

std::string AllMessages(SessionEngine& engine)
{
  std::string text;
  for (const std::string& message : engine.TakeMessages())
  {
    text += message + "\n";
  }
  return text;
}

/// No file of this program gets longer, as on a disk that is full.
class FileSizeLimit
{
public:
  explicit FileSizeLimit(rlim_t bytes)
    : Handler(std::signal(SIGXFSZ, SIG_IGN))
  {
    getrlimit(RLIMIT_FSIZE, &this->Before);
    rlimit limit = this->Before;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit()
  {
    setrlimit(RLIMIT_FSIZE, &this->Before);
    std::signal(SIGXFSZ, this->Handler);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

private:
  void (*Handler)(int);
  rlimit Before{};
};

class TestSessionEngine : public ::testing::Test
{
protected:
  void SetUp() override
  {
    this->Folder = fs::temp_directory_path() / ("engine test." + std::to_string(getpid()));
    fs::create_directories(this->Folder);
  }
  void TearDown() override { fs::remove_all(this->Folder); }

  std::string Path(const char* name) const { return (this->Folder / name).string(); }

  fs::path Folder;
};
}

TEST_F(TestSessionEngine, RunsAndItsRecordingRepeatsToTheBit)
{
  EngineOptions options;
  options.clock = Hasty();
  options.record = this->Path("a.pcirec");
  options.script = Driving();
  options.wallPoints = { 0, 5, 17 };
  SessionSnapshot now;
  ShownImage image;
  std::uint64_t images = 0;
  {
    SessionEngine engine(World(), Mux(options.script), options);
    engine.SetImageMode(ImageMode::Plain);
    engine.Start();
    engine.Post({ RecordedEvent::FrameRate, 30.0 });
    engine.Post({ RecordedEvent::FieldOfView, 150.0 });
    WaitFor(
      [&]
      {
        engine.LatestScene(now);
        images += engine.LatestImage(image) ? 1 : 0;
        GreyImage unused;
        std::size_t runs = 0;
        std::size_t frames = 0;
        EXPECT_FALSE(engine.CineFrame(0, 0, unused, runs, frames));
        engine.TakeMask();
        return now.seconds >= 3.0;
      });
    EXPECT_FALSE(engine.IsOver());
    EXPECT_EQ(StopsWith(engine), "");
    EXPECT_EQ(StopsWith(engine), "") << "once more does nothing";
    EXPECT_GT(engine.Rates().ticks, 0.0);
  }
  EXPECT_EQ(now.wall.size(), 3U);
  EXPECT_EQ(now.fieldOfView, 150.0);
  EXPECT_EQ(now.frameRate, 30.0);
  EXPECT_EQ(now.heartRate, 90.0) << "of the script";
  EXPECT_NEAR(now.input.drive.wirePosition, 20.0, 2.0);
  EXPECT_GT(now.report.inserted, 10.0);
  EXPECT_GT(now.contrast.injected, 1.0);
  EXPECT_NEAR(static_cast<double>(now.metrics.frames), 90.0, 5.0);
  EXPECT_EQ(now.pose.primary, World().scenario.imaging.pose.primary) << "the script leaves it";
  EXPECT_GT(images, 2U);
  EXPECT_EQ(image.image.columns, 128);
  EXPECT_EQ(image.moment.fieldOfView, 150.0);

  RecordingReader reader(options.record);
  RecordedItem item;
  std::vector<RecordedEvent> events;
  std::uint64_t hashes = 0;
  std::uint64_t ticks = 0;
  while (reader.Next(item))
  {
    hashes += item.type == RecordType::StateHash ? 1 : 0;
    ticks = item.type == RecordType::End ? item.counts[0] : ticks;
    if (item.type == RecordType::Event)
    {
      events.push_back(item.event);
      EXPECT_TRUE(item.event.kind != RecordedEvent::HeartRate || item.tick == 2000U);
    }
  }
  EXPECT_EQ(reader.HowEnded(), RecordingReader::Ending::Complete);
  EXPECT_EQ(events.size(), 3U);
  EXPECT_GE(ticks, 6000U);

  EngineOptions again;
  again.clock = Hasty();
  again.replay = options.record;
  again.record = this->Path("b.pcirec");
  SessionEngine engine(World(), nullptr, again);
  engine.Start();
  WaitFor([&] { return engine.IsOver(); });
  EXPECT_TRUE(engine.LatestScene(now));
  EXPECT_EQ(StopsWith(engine), "");
  EXPECT_EQ(now.tick, ticks);
  EXPECT_GE(hashes, 6U);
  EXPECT_EQ(engine.ReplayHashes(), std::pair(hashes, hashes));
  EXPECT_EQ(AllMessages(engine), "");
  EXPECT_TRUE(fs::exists(again.record));
}

TEST_F(TestSessionEngine, AReplayThatIsChangedByHandGoesOnAndIsNotComparedAnyMore)
{
  const Scenario& scenario = World().scenario;
  const std::string file = this->Path("a.pcirec");
  {
    SessionRunner runner(World().wall, scenario, World().wallHash,
      std::make_unique<ScriptSource>(
        Driving(), StartInputOf(scenario), scenario.settings.tickRate, false));
    runner.maximumTicks = 3500;
    runner.Record(file, "test", "");
    while (runner.Run(64))
    {
    }
    EXPECT_EQ(runner.Tick(), 3500U);
    runner.FinishRecording();
  }
  for (const bool changed : { false, true })
  {
    SessionRunner runner(
      World().wall, scenario, World().wallHash, std::make_unique<ReplaySource>(file));
    std::string said;
    runner.say = [&](std::uint64_t, const std::string& text) { said += text; };
    EXPECT_TRUE(runner.Run(2500));
    EXPECT_EQ(runner.Compared().compared, 2U);
    if (changed)
    {
      runner.Post({ RecordedEvent::HeartRate, 111.0 });
      runner.Post({ RecordedEvent::HeartRate, 50.0 });
    }
    EXPECT_FALSE(runner.Run(10000));
    EXPECT_EQ(runner.Tick(), 3500U);
    SessionSnapshot now;
    runner.Session().SnapshotOfImage(now);
    EXPECT_EQ(now.heartRate, changed ? 50.0 : 90.0);
    EXPECT_EQ(runner.Compared().compared, changed ? 2U : 4U);
    EXPECT_EQ(runner.Compared().equal, runner.Compared().compared);
    EXPECT_EQ(said.find("not compared any more") != std::string::npos, changed) << said;
  }
}

TEST_F(TestSessionEngine, RecordsWhetherThePatientSetsTheDose)
{
  const Scenario& scenario = World().scenario;
  for (const bool controlled : { true, false })
  {
    const std::string file = this->Path("a.pcirec");
    const auto patient = controlled ? World().background : nullptr;
    SessionRunner runner(World().wall, scenario, World().wallHash,
      std::make_unique<ScriptSource>(
        Driving(), StartInputOf(scenario), scenario.settings.tickRate, false),
      patient);
    runner.maximumTicks = 2500;
    runner.Record(file, "test", "");
    while (runner.Run(64))
    {
    }
    runner.FinishRecording();
    const Scenario recorded =
      RecordedScenario(RecordingReader(file).Header().scenario, "'a.pcirec'");
    EXPECT_EQ(recorded.imaging.exposureControl, controlled);
    // With the same patient it repeats; a recording without one needs none.
    SessionRunner again(World().wall, recorded, World().wallHash,
      std::make_unique<ReplaySource>(file), World().background);
    EXPECT_FALSE(again.Run(10000));
    EXPECT_EQ(again.Compared().compared, 3U);
    EXPECT_EQ(again.Compared().equal, 3U);
    SessionRunner without(
      World().wall, recorded, World().wallHash, std::make_unique<ReplaySource>(file));
    EXPECT_FALSE(without.Run(10000));
    EXPECT_EQ(without.Compared().equal == 3U, !controlled);
  }
}

TEST_F(TestSessionEngine, PausesAreNotMadeUpFor)
{
  std::atomic<double> time{ 0.0 };
  std::atomic<int> asked{ 0 };
  EngineOptions options;
  options.script = Script(R"([ { "seconds": 20, "wire_mm": 200 } ])");
  options.sceneRate = World().scenario.settings.tickRate;
  options.clock = [&time, &asked]
  {
    ++asked;
    return time.load();
  };
  SessionEngine engine(World(), Mux(options.script), options);
  engine.Start();
  SessionSnapshot now;
  const auto goOn = [&](double seconds)
  {
    const double until = now.seconds + seconds;
    for (int steps = 0; now.seconds < until - 1e-9; ++steps)
    {
      ASSERT_LT(steps, 10000);
      time = time + 0.001;
      std::this_thread::sleep_for(std::chrono::microseconds(500));
      engine.LatestScene(now);
    }
  };
  // The physics asks for the time five times a round, at most: however busy the machine is, it has seen what is new.
  const auto letItSee = [&asked]
  {
    const int before = asked;
    for (int steps = 0; asked < before + 10; ++steps)
    {
      ASSERT_LT(steps, 10000);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  goOn(0.2);
  engine.SetPaused(true);
  EXPECT_TRUE(engine.IsPaused());
  letItSee();
  engine.LatestScene(now);
  constexpr double Pause = 1.0;
  for (int n = 0; n < 10; ++n)
  {
    time = time + Pause / 10;
    letItSee();
  }
  EXPECT_FALSE(engine.LatestScene(now));
  EXPECT_EQ(engine.Rates().ticks, 0.0);
  engine.SetPaused(false);
  goOn(0.2);
  // What was due before the pause may come after it, but none of the pause.
  EXPECT_LE(
    static_cast<double>(now.tick), (time - Pause) * World().scenario.settings.tickRate + 1.0);
  EXPECT_EQ(StopsWith(engine), "");
  // Hands go on with 10 mm/s while time stands still; that second is not in their place.
  EXPECT_NEAR(now.input.drive.wirePosition, 10.0 * now.seconds, 0.01);
}

TEST_F(TestSessionEngine, KeepsRealTime)
{
  EngineOptions options;
  options.script = Driving();
  SessionEngine engine(World(), Mux(options.script), options);
  const auto start = std::chrono::steady_clock::now();
  engine.Start();
  SessionSnapshot now;
  RunUntil(engine, 3.0, now);
  const double passed =
    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_NEAR(passed, 3.0, 0.3);
  EXPECT_NEAR(engine.Rates().ticks, World().scenario.settings.tickRate,
    0.05 * World().scenario.settings.tickRate);
  EXPECT_EQ(StopsWith(engine), "");
}

TEST_F(TestSessionEngine, SaysWhereATornRecordingEnds)
{
  EngineOptions options;
  options.clock = Hasty();
  options.record = this->Path("a.pcirec");
  {
    SessionEngine engine(World(), Mux(Driving()), options);
    engine.Start();
    SessionSnapshot now;
    RunUntil(engine, 0.6, now);
    EXPECT_EQ(StopsWith(engine), "");
  }
  fs::resize_file(options.record, fs::file_size(options.record) - 40);
  EngineOptions again;
  again.clock = Hasty();
  again.replay = options.record;
  SessionEngine engine(World(), nullptr, again);
  engine.Start();
  WaitFor([&] { return engine.IsOver(); });
  EXPECT_EQ(StopsWith(engine), "");
  const std::string text = AllMessages(engine);
  EXPECT_NE(text.find("is good up to tick"), std::string::npos) << text;
  EXPECT_NE(text.find(options.record), std::string::npos) << text;

  std::ofstream(this->Folder / "noise.pcirec") << "nothing";
  again.replay = this->Path("noise.pcirec");
  EXPECT_THROW(SessionEngine(World(), nullptr, again), std::runtime_error);
  EXPECT_THROW(SessionEngine(World(), nullptr, {}), std::invalid_argument);
}

TEST_F(TestSessionEngine, LeavesNoRecordingThatIsNotFinished)
{
  EngineOptions options;
  options.clock = Hasty();
  options.record = this->Path("a.pcirec");
  {
    SessionEngine engine(World(), Mux(Driving()), options);
    engine.Start();
    SessionSnapshot now;
    RunUntil(engine, 0.1, now);
  }
  EXPECT_TRUE(fs::is_empty(this->Folder));

  // Its folder goes away while it runs.
  fs::create_directories(this->Folder / "gone");
  options.record = this->Path("gone/a.pcirec");
  {
    SessionEngine engine(World(), Mux(Driving()), options);
    engine.Start();
    SessionSnapshot now;
    RunUntil(engine, 0.1, now);
    fs::remove_all(this->Folder / "gone");
    EXPECT_NE(StopsWith(engine).find(options.record), std::string::npos);
    EXPECT_EQ(AllMessages(engine), "");
  }
  EXPECT_TRUE(fs::is_empty(this->Folder));

  options.record = this->Path("nowhere/a.pcirec");
  EXPECT_THROW(SessionEngine(World(), Mux(Driving()), options), std::runtime_error);
}

TEST_F(TestSessionEngine, AFullDiskEndsTheSessionWithOneMessage)
{
  EngineOptions options;
  options.clock = Hasty();
  options.record = this->Path("a.pcirec");
  SessionEngine engine(World(), Mux(Driving()), options);
  const FileSizeLimit limit(4096); // the recording's header does not fit
  engine.Start();
  WaitFor([&] { return engine.IsOver(); });
  EXPECT_EQ(StopsWith(engine), "Cannot write '" + options.record + "'.");
  EXPECT_EQ(StopsWith(engine), "Cannot write '" + options.record + "'.");
  EXPECT_TRUE(fs::is_empty(this->Folder));
  EXPECT_EQ(AllMessages(engine), "") << "it is said once";
}
