#include "HeadlessSession.h"

#include "AtomicFile.h"
#include "DriveScript.h"
#include "FileSeries.h"
#include "InstrumentCatalogue.h"
#include "Interruption.h"
#include "Program.h"
#include "ProgressDisplay.h"
#include "Recording.h"
#include "SessionImager.h"
#include "SessionPictures.h"
#include "SessionStatistics.h"
#include "StagedFolder.h"
#include "TrainingSession.h"
#include "UtcTime.h"
#include "vtkMessageTrap.h"
#include "vtkSessionFiles.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::uint64_t ForceInterval = 40;        // ticks between recorded forces: 50 Hz at 2 kHz
constexpr std::uint64_t InterruptionInterval = 64; // ticks between looks at signals
constexpr std::uint64_t MostPrinted = 50; // messages on the console; statistics.json has more

/// Where the hands' movements come from.
class Hands
{
public:
  explicit Hands(const HeadlessOptions& options)
    : HasScript(!options.script.empty())
    , Most(options.ticks)
  {
    if (this->HasScript)
    {
      this->Script = ReadDriveScript(options.script);
    }
    if (!options.replay.empty())
    {
      this->Replay = std::make_unique<RecordingReplay>(RecordingReader(options.replay));
    }
  }

  const RecordingReplay* Recording() const { return this->Replay.get(); }

  /// Where they are before the first tick.
  void SetStart(const SessionInput& start) { this->Start = start; }

  /// Known before the start; 0: not known.
  std::uint64_t Expected(double rate) const
  {
    const auto scripted = static_cast<std::uint64_t>(std::ceil(this->Script.Duration() * rate));
    return this->Most > 0 ? this->Most : this->Replay ? 0 : scripted;
  }

  /// @return false when it is over
  bool At(std::uint64_t tick, double rate, SessionInput& input, std::vector<RecordedEvent>& events)
  {
    if (this->Most > 0 && tick >= this->Most)
    {
      return false;
    }
    if (this->Replay)
    {
      return this->Replay->At(tick, input, events);
    }
    events.clear();
    if (this->HasScript)
    {
      // The place at the end of the step, so that a piece is over when its ticks are.
      const double begin = static_cast<double>(tick) / rate;
      const double end = static_cast<double>(tick + 1) / rate;
      input = this->Script.At(end, this->Start);
      for (const double heartRate : this->Script.HeartRates(begin, end))
      {
        events.push_back({ RecordedEvent::HeartRate, heartRate });
      }
      return this->Most > 0 || tick < this->Expected(rate);
    }
    return true;
  }

  bool ExpectedHash(std::uint64_t tick, std::uint64_t& hash)
  {
    return this->Replay && this->Replay->ExpectedHash(tick, hash);
  }

private:
  bool HasScript;
  std::uint64_t Most;
  DriveScript Script;
  SessionInput Start;
  std::unique_ptr<RecordingReplay> Replay;
};

/// The state held against a recording.
struct Comparison
{
  std::uint64_t compared = 0;
  std::uint64_t equal = 0;
  std::uint64_t firstDifference = 0; ///< tick; 0: none

  void Add(std::uint64_t tick, bool same)
  {
    ++this->compared;
    this->equal += same ? 1 : 0;
    if (!same && this->firstDifference == 0)
    {
      this->firstDifference = tick;
    }
  }
};

/// Whether it is a name as wire_00012.vtp.
bool IsNumbered(const std::string& name, const std::string& start, const std::string& end)
{
  const std::size_t digits = start.size();
  return name.size() > digits + end.size() && name.rfind(start, 0) == 0 &&
    name.compare(name.size() - end.size(), end.size(), end) == 0 &&
    name.find_first_not_of("0123456789", digits) == name.size() - end.size();
}

Json MetricsToJson(const SessionMetrics& metrics, const WallTopology& topology)
{
  Json branches = Json::array();
  for (const int branch : metrics.branches)
  {
    const auto n = static_cast<std::size_t>(branch);
    const std::string name = n < topology.groupName.size() ? topology.groupName[n] : "";
    // Parts of one segment between its side branches are one for people.
    if (branches.empty() || branches.back() != name)
    {
      branches.push_back(name);
    }
  }
  return { { "procedure_s", metrics.procedureSeconds },
    { "fluoroscopy_s", metrics.fluoroscopySeconds }, { "cine_s", metrics.cineSeconds },
    { "frames", metrics.frames }, { "air_kerma_mGy", metrics.airKerma },
    { "dose_area_Gy_cm2", metrics.doseAreaProduct }, { "contrast_mL", metrics.contrast },
    { "greatest_wall_force_N", metrics.maximumWallForce },
    { "greatest_tip_force_N", metrics.maximumTipForce },
    { "forceful_tip_s", metrics.forcefulSeconds }, { "wire_travel_mm", metrics.wireTravel },
    { "wire_turning_rad", metrics.wireTurning }, { "deepest_mm", metrics.deepest },
    { "path", branches } };
}

/// Everything that goes into the folder.
class OutputFiles
{
public:
  OutputFiles(const HeadlessOptions& options, const WallTopology& topology)
  {
    if (options.output.empty())
    {
      return;
    }
    this->Folder = std::make_unique<StagedFolder>(options.output);
    this->TakeOlder(options.output);
    if (options.writeWall)
    {
      this->Wall = std::make_unique<vtkWallFiles>(topology);
    }
    this->Forces =
      "tick,seconds,phase,inserted_mm,proximal_force_N,proximal_torque_N_mm,tip_force_N,"
      "greatest_force_N,contacts,largest_penetration_mm,mean_penetration_mm,joint_gap_mm,"
      "outside,branch\n";
    this->Flows = "tick,seconds,injection_mL_s,injected_mL,in_tree_mL,blush_mL,washed_out_mL,"
                  "spilled_mL,aortic_pressure_mmHg,air_kerma_mGy,dose_area_Gy_cm2\n";
    this->Tips = "tick,seconds,x_mm,y_mm,z_mm,direction_x,direction_y,direction_z\n";
  }

  explicit operator bool() const { return this->Folder != nullptr; }

  void Add(const TrainingSession& session, const Scenario& scenario, vtkMessageTrap& messages)
  {
    const Intervention& intervention = session.Instruments();
    const WallTopology& topology = session.Topology();
    const TickReport& report = intervention.Report();
    const double seconds = static_cast<double>(this->Tick) / scenario.settings.tickRate;
    char name[40];
    std::snprintf(name, sizeof(name), "wire_%05zu.vtp", this->WireFiles.size());
    WriteInstruments(
      this->Folder->Add(name), intervention, scenario.wire, scenario.catheter, messages);
    this->WireFiles.push_back({ name, seconds });
    if (this->Wall)
    {
      std::snprintf(name, sizeof(name), "wall_%05zu.vtp", this->WallFiles.size());
      this->Wall->Write(this->Folder->Add(name), intervention.WallPoints(), messages);
      this->WallFiles.push_back({ name, seconds });
    }
    char text[512];
    const auto branch = static_cast<std::size_t>(report.branch);
    const bool named = report.branch >= 0 && branch < topology.groupName.size();
    std::snprintf(text, sizeof(text),
      "%llu,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%d,%.9g,%.9g,%.9g,%d,%s\n",
      static_cast<unsigned long long>(this->Tick), seconds, report.phase, report.inserted,
      report.proximalForce, report.proximalTorque, report.tipForce, report.maximumForce,
      report.contacts, report.maximumPenetration, report.meanPenetration, report.jointGap,
      report.outside, named ? topology.groupName[branch].c_str() : "");
    this->Forces += text;
    const ContrastBalance medium = session.Contrast().Balance();
    std::snprintf(text, sizeof(text), "%llu,%.9g,%.6g,%.9g,%.9g,%.9g,%.9g,%.9g,%.6g,%.6g,%.6g\n",
      static_cast<unsigned long long>(this->Tick), seconds, session.Report().injection,
      medium.injected, medium.inTree, medium.blush, medium.washedOut, medium.spilled,
      session.Contrast().AorticPressure(), session.Metrics().airKerma,
      session.Metrics().doseAreaProduct);
    this->Flows += text;
    const std::vector<Vector3>& line = intervention.Centerline();
    if (line.size() > 1)
    {
      const Vector3 ahead = (line[0] - line[1]).normalized();
      std::snprintf(text, sizeof(text), "%llu,%.9g,%.9g,%.9g,%.9g,%.6g,%.6g,%.6g\n",
        static_cast<unsigned long long>(this->Tick), seconds, line[0].x(), line[0].y(), line[0].z(),
        ahead.x(), ahead.y(), ahead.z());
      this->Tips += text;
    }
  }

  void SetTick(std::uint64_t tick) { this->Tick = tick; }

  /// For files that others write.
  std::string Place(const std::string& name) { return this->Folder->Add(name); }

  void Finish(const Json& statistics, const SessionPictures& pictures)
  {
    if (pictures.Frames() > 0)
    {
      WriteFileAtomically(this->Folder->Add("frames.csv"), pictures.FrameTable());
    }
    WriteFileAtomically(this->Folder->Add("contrast.csv"), this->Flows);
    WriteFileAtomically(this->Folder->Add("trajectory.pvd"), PvdText(this->WireFiles));
    if (this->Wall)
    {
      WriteFileAtomically(this->Folder->Add("wall.pvd"), PvdText(this->WallFiles));
    }
    WriteFileAtomically(this->Folder->Add("tip.csv"), this->Tips);
    WriteFileAtomically(this->Folder->Add("forces.csv"), this->Forces);
    WriteFileAtomically(this->Folder->Add("statistics.json"), statistics.dump(2) + "\n");
    this->Folder->Commit();
  }

private:
  /// What an older session left under our names.
  void TakeOlder(const std::string& folder)
  {
    std::vector<std::string> older;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder, ignored))
    {
      const std::string name = entry.path().filename().string();
      if (IsNumbered(name, "wire_", ".vtp") || IsNumbered(name, "wall_", ".vtp") ||
        IsNumbered(name, "xray_", ".png") || IsNumbered(name, "scene_", ".png") ||
        name == "wall.pvd" || name == "frames.csv")
      {
        older.push_back(name);
      }
    }
    this->Folder->TakePlaceOf(older);
  }

  std::unique_ptr<StagedFolder> Folder;
  std::unique_ptr<vtkWallFiles> Wall;
  std::vector<TimedFile> WireFiles;
  std::vector<TimedFile> WallFiles;
  std::string Forces;
  std::string Flows;
  std::string Tips;
  std::uint64_t Tick = 0;
};

void Warn(const std::string& text)
{
  std::fprintf(stderr, "Warning: %s\n", text.c_str());
}

/// Before anything is put in its place: what is not verified leaves nothing.
void FinishComparison(
  const HeadlessOptions& options, const Hands& hands, const Comparison& comparison)
{
  const RecordingReader& reader = hands.Recording()->Reader();
  const RecordingReader::Ending ending = reader.HowEnded();
  const bool broken =
    ending == RecordingReader::Ending::Torn || ending == RecordingReader::Ending::Damaged;
  std::string problem;
  if (comparison.firstDifference > 0)
  {
    problem = "The state after tick " + std::to_string(comparison.firstDifference) +
      " is another one than in '" + options.replay + "' (" + std::to_string(comparison.equal) +
      " of " + std::to_string(comparison.compared) + " hashes are equal).";
  }
  else if (broken)
  {
    problem = reader.EndingText() + ".";
  }
  else if (comparison.compared == 0 && options.verify)
  {
    problem = "'" + options.replay + "' has no hash of a state that could be verified.";
  }
  if (problem.empty())
  {
    return;
  }
  if (options.verify)
  {
    throw std::runtime_error(problem);
  }
  Warn(problem);
}
}

void CheckRecording(const std::string& path, const Scenario& scenario, std::uint64_t wallHash,
  bool otherVesselsAllowed)
{
  const RecordingReader reader(path);
  const RecordingHeader& header = reader.Header();
  if (header.tickRate != scenario.settings.tickRate)
  {
    throw std::runtime_error("'" + path + "' was recorded at " + std::to_string(header.tickRate) +
      " Hz, the scenario has another tick rate.");
  }
  if (header.meshHash != wallHash)
  {
    const std::string text =
      "'" + path + "' was recorded with other vessels or another motion of them";
    if (!otherVesselsAllowed)
    {
      throw std::runtime_error(text + ".");
    }
    Warn(text + ".");
  }
}

Scenario ScenarioOf(const HeadlessOptions& options)
{
  Scenario scenario;
  if (!options.scenario.empty())
  {
    scenario = LoadScenario(options.scenario);
  }
  else if (!options.replay.empty())
  {
    const RecordingReader reader(options.replay);
    scenario =
      ScenarioFromText(reader.Header().scenario, "The scenario in '" + options.replay + "'", ".");
  }
  else
  {
    throw UsageError("--scenario is required (--list-scenarios names those that are built in)");
  }
  if (!options.vessels.empty())
  {
    if (scenario.vessels.kind == VesselSource::Kind::Phantom)
    {
      scenario.vessels.motion = VesselMotion::Automatic;
    }
    scenario.vessels.kind = VesselSource::Kind::Run;
    scenario.vessels.path = fs::absolute(options.vessels).lexically_normal().string();
  }
  if (scenario.vessels.kind == VesselSource::Kind::Run && scenario.vessels.path.empty())
  {
    throw UsageError("--vessels is required: the scenario '" + scenario.name +
      "' has no folder of its own with the result of 'coronary-pipeline run'");
  }
  if (!options.wire.empty())
  {
    scenario.wire = BuiltInCatalogue().Wire(options.wire).wire;
  }
  if (!options.catheter.empty())
  {
    scenario.catheter = BuiltInCatalogue().Catheter(options.catheter).catheter;
  }
  if (options.heartRate >= 0.0)
  {
    scenario.settings.heartRate = options.heartRate;
  }
  return scenario;
}

namespace
{
/// A session from its first tick to its last.
class HeadlessRun
{
public:
  HeadlessRun(const HeadlessOptions& options, const SessionWorld& world, Hands& hands)
    : Options(options)
    , World(world)
    , Hands_(hands)
    , Rate(world.scenario.settings.tickRate)
    , Session(world.wall, world.scenario)
    , Pictures({ options.xray, options.scene }, world)
    , Files(options, world.wall->Topology())
    , Statistics(world.wall->Topology())
    , Interval(
        static_cast<std::uint64_t>(std::max(1.0, std::round(this->Rate / options.outputRate))))
  {
    hands.SetStart(this->Session.StartInput());
    if (!options.record.empty())
    {
      this->Recording = std::make_unique<RecordingWriter>(options.record,
        HeaderOf(world.scenario, world.wallHash, "coronary-simulator " DYNAMICCORONARY_VERSION,
          UtcTime()));
    }
  }

  void Run(ProgressDisplay& progress)
  {
    const std::uint64_t expected = this->Hands_.Expected(this->Rate);
    while (this->Hands_.At(this->Tick, this->Rate, this->Input, this->Events))
    {
      if (this->Tick % InterruptionInterval == 0)
      {
        ThrowIfInterrupted();
        if (expected > 0)
        {
          progress.Update(static_cast<double>(this->Tick) / static_cast<double>(expected));
        }
      }
      this->Step();
    }
    ThrowIfInterrupted();
  }

  void Finish()
  {
    if (this->Hands_.Recording())
    {
      FinishComparison(this->Options, this->Hands_, this->Compared);
    }
    if (this->Recording)
    {
      if (this->Tick % RecordedHashInterval != 0)
      {
        this->Recording->StateHash(this->Tick, this->Session.StateHash());
      }
      this->Recording->Finish(this->Tick);
    }
    if (this->Files)
    {
      this->Files.Finish(this->Result(), this->Pictures);
    }
  }

  void PrintSummary() const
  {
    for (const std::string& note : this->World.notes)
    {
      Warn(note);
    }
    std::string branches;
    for (const std::string& name : this->Statistics.Branches())
    {
      branches += (branches.empty() ? "" : ", ") + name;
    }
    std::printf(
      "%s: %llu ticks, %.3g s; greatest penetration %.3g mm; %llu messages; branches: %s\n",
      this->World.scenario.name.c_str(), static_cast<unsigned long long>(this->Tick),
      static_cast<double>(this->Tick) / this->Rate, this->Statistics.MaximumPenetration(),
      static_cast<unsigned long long>(this->Statistics.Messages()),
      branches.empty() ? "none" : branches.c_str());
    const SessionMetrics& metrics = this->Session.Metrics();
    if (metrics.frames > 0 || metrics.contrast > 0.0)
    {
      std::printf("%lld X-ray frames, %.3g mGy, %.3g Gy cm2; %.3g mL of contrast medium\n",
        static_cast<long long>(metrics.frames), metrics.airKerma, metrics.doseAreaProduct,
        metrics.contrast);
    }
    const double seconds = std::chrono::duration<double>(this->Simulating).count();
    if (this->Tick > 0 && seconds > 0.0)
    {
      std::printf("%.3g us a tick, %.3g times real time\n",
        1e6 * seconds / static_cast<double>(this->Tick),
        static_cast<double>(this->Tick) / this->Rate / seconds);
    }
    if (this->Hands_.Recording())
    {
      std::printf("%llu of %llu hashes are equal\n",
        static_cast<unsigned long long>(this->Compared.equal),
        static_cast<unsigned long long>(this->Compared.compared));
    }
  }

private:
  void Step()
  {
    for (const RecordedEvent& event : this->Events)
    {
      this->UnknownEvents += this->Session.Apply(event) ? 0 : 1;
      if (this->Recording)
      {
        this->Recording->Event(this->Tick, event);
      }
    }
    if (this->Recording)
    {
      this->Recording->Input(this->Tick, this->Input);
    }
    const auto before = std::chrono::steady_clock::now();
    const SessionReport& report = this->Session.Step(this->Input);
    this->Simulating += std::chrono::steady_clock::now() - before;
    ++this->Tick; // what follows is of the state after this many steps
    this->Statistics.Add(report.tick);
    this->TellMessages();
    this->KeepHash();
    if (this->Recording && this->Tick % ForceInterval == 0)
    {
      this->Recording->Force(this->Tick, ForcesOf(report.tick));
    }
    SessionPictures::FolderCallback folder;
    if (this->Files)
    {
      folder = [this](const std::string& name) { return this->Files.Place(name); };
    }
    if (report.exposed)
    {
      this->Pictures.AddFrame(this->Session, folder, this->Recording.get());
    }
    if (this->Files && (this->Tick - 1) % this->Interval == 0)
    {
      this->Files.SetTick(this->Tick);
      this->Files.Add(this->Session, this->World.scenario, this->Trap);
      this->Pictures.AddScene(this->Session, folder);
    }
  }

  void TellMessages()
  {
    for (const std::string& text : this->Session.TakeMessages())
    {
      this->Statistics.AddMessage(this->Tick, text);
      if (!this->Options.quiet)
      {
        std::fprintf(
          stderr, "tick %llu: %s\n", static_cast<unsigned long long>(this->Tick), text.c_str());
      }
      if (this->Recording)
      {
        this->Recording->Annotation(this->Tick, text);
      }
    }
  }

  void KeepHash()
  {
    if (this->Tick % RecordedHashInterval == 0)
    {
      const std::uint64_t hash = this->Session.StateHash();
      this->Hashes.push_back(Hexadecimal(hash));
      if (this->Recording)
      {
        this->Recording->StateHash(this->Tick, hash);
      }
    }
    std::uint64_t wanted = 0;
    if (this->Hands_.ExpectedHash(this->Tick, wanted))
    {
      this->Compared.Add(this->Tick, wanted == this->Session.StateHash());
    }
  }

  Json Result() const
  {
    const WallTopology& topology = this->Session.Topology();
    const Scenario& scenario = this->World.scenario;
    Json result = this->Statistics.ToJson();
    result["program"] = "coronary-simulator " DYNAMICCORONARY_VERSION;
    result["scenario"] = scenario.name;
    result["motion"] = this->World.motion;
    result["notes"] = this->World.notes;
    result["wire"] = scenario.wire.name;
    result["catheter"] = scenario.catheter.name;
    result["tick_hz"] = this->Rate;
    result["seconds"] = static_cast<double>(this->Tick) / this->Rate;
    result["wall"] = { { "points", topology.points }, { "triangles", topology.triangles.size() },
      { "hash", Hexadecimal(this->World.wallHash) } };
    result["metrics"] = MetricsToJson(this->Session.Metrics(), topology);
    result["state_hash_interval"] = RecordedHashInterval;
    result["state_hashes"] = this->Hashes;
    result["last_state_hash"] = Hexadecimal(this->Session.StateHash());
    if (this->Hands_.Recording())
    {
      result["replay"] = { { "compared", this->Compared.compared },
        { "equal", this->Compared.equal },
        { "first_different_tick",
          this->Compared.firstDifference > 0 ? Json(this->Compared.firstDifference)
                                             : Json(nullptr) },
        { "unknown_chunks", this->Hands_.Recording()->Reader().Unknown() },
        { "unknown_events", this->UnknownEvents } };
    }
    return result;
  }

  const HeadlessOptions& Options;
  const SessionWorld& World;
  Hands& Hands_;
  double Rate;
  TrainingSession Session;
  SessionPictures Pictures;
  OutputFiles Files;
  SessionStatistics Statistics;
  std::uint64_t Interval;
  vtkMessageTrap Trap;
  std::unique_ptr<RecordingWriter> Recording;
  Comparison Compared;
  Json Hashes = Json::array();
  SessionInput Input;
  std::vector<RecordedEvent> Events;
  std::uint64_t UnknownEvents = 0;
  std::uint64_t Tick = 0;
  std::chrono::steady_clock::duration Simulating{};
};
}

namespace
{
WorldProgress ShownBy(ProgressDisplay& progress)
{
  return
    [&progress, step = -1, now = std::string()](const std::string& what, double fraction) mutable
  {
    if (what != now)
    {
      now = what;
      progress.BeginStep(++step, what);
    }
    progress.Update(fraction);
    return Interruption() == 0;
  };
}
}

void RunHeadless(const HeadlessOptions& options)
{
  const Scenario scenario = ScenarioOf(options);
  Hands hands(options);
  if (hands.Expected(scenario.settings.tickRate) == 0 && !hands.Recording())
  {
    throw UsageError(
      "--ticks is required where neither --script nor --replay says how long it takes");
  }
  const int preparations = options.xray ? 2 : 1;
  auto progress = std::make_unique<ProgressDisplay>("step", preparations + 1, options.quiet);
  const SessionWorld world = LoadWorld(scenario, options.xray, ShownBy(*progress));
  if (hands.Recording())
  {
    CheckRecording(options.replay, scenario, world.wallHash, !options.verify);
  }
  HeadlessRun run(options, world, hands);
  progress->BeginStep(preparations, "simulation");
  run.Run(*progress);
  run.Finish();
  progress.reset();
  if (!options.quiet)
  {
    run.PrintSummary();
  }
}

namespace
{
Json NameOfEvent(std::uint8_t kind)
{
  switch (kind)
  {
    case RecordedEvent::HeartRate:
      return "heart_rate_bpm";
    case RecordedEvent::FrameRate:
      return "frame_rate_hz";
    case RecordedEvent::FieldOfView:
      return "field_of_view_mm";
    default:
      return static_cast<int>(kind);
  }
}
}

void DumpRecording(const std::string& path)
{
  RecordingReader reader(path);
  const RecordingHeader& header = reader.Header();
  const auto print = [](const Json& json)
  { std::printf("%s\n", json.dump(-1, ' ', false, Json::error_handler_t::replace).c_str()); };
  print({ { "type", "header" }, { "build", header.build },
    { "scenario", Json::parse(header.scenario) }, { "mesh_hash", Hexadecimal(header.meshHash) },
    { "seed", header.seed }, { "tick_hz", header.tickRate }, { "start_utc", header.started } });
  RecordedItem item;
  while (reader.Next(item))
  {
    ThrowIfInterrupted();
    Json json = { { "tick", item.tick } };
    switch (item.type)
    {
      case RecordType::Input:
        json["type"] = "input";
        json["wire_mm"] = item.input.drive.wirePosition;
        json["wire_rad"] = item.input.drive.wireAngle;
        json["catheter_mm"] = item.input.drive.catheterPosition;
        json["catheter_rad"] = item.input.drive.catheterAngle;
        json["syringe_mL"] = item.input.syringe;
        json["pedals"] = item.input.pedals;
        json["primary_rad"] = item.input.primary;
        json["secondary_rad"] = item.input.secondary;
        json["source_to_detector_mm"] = item.input.sourceToDetector;
        json["table_mm"] = { item.input.table.x(), item.input.table.y(), item.input.table.z() };
        break;
      case RecordType::Force:
        json["type"] = "force";
        json["proximal_N"] = item.forces.proximalForce;
        json["proximal_N_mm"] = item.forces.proximalTorque;
        json["tip_N"] = item.forces.tipForce;
        json["greatest_N"] = item.forces.maximumForce;
        break;
      case RecordType::Event:
        json["type"] = "event";
        json["kind"] = NameOfEvent(item.event.kind);
        json["value"] = item.event.value;
        break;
      case RecordType::StateHash:
      case RecordType::ImageHash:
        json["type"] = item.type == RecordType::StateHash ? "state_hash" : "image_hash";
        json["hash"] = Hexadecimal(item.hash);
        break;
      case RecordType::Annotation:
        json["type"] = "annotation";
        json["text"] = item.text;
        break;
      case RecordType::End:
        json["type"] = "end";
        json["ticks"] = item.counts[0];
        break;
    }
    print(json);
  }
  if (reader.HowEnded() != RecordingReader::Ending::Complete)
  {
    throw std::runtime_error(reader.EndingText() + ".");
  }
}

void ListInstruments()
{
  constexpr double GramForce = 9.80665e-3; // N
  for (const CatalogueWire& one : BuiltInCatalogue().wires)
  {
    std::printf("wire      %-16s %4.1f gf  %s\n", one.wire.name.c_str(),
      TipLoad(one.wire) / GramForce, one.description.c_str());
  }
  for (const CatalogueCatheter& one : BuiltInCatalogue().catheters)
  {
    std::printf("catheter  %-16s %4.2f mm  %s\n", one.catheter.name.c_str(),
      2.0 * one.catheter.innerRadius, one.description.c_str());
  }
}
}
