#include "HeadlessSession.h"

#include "AtomicFile.h"
#include "Command.h"
#include "DriveScript.h"
#include "FileSeries.h"
#include "InstrumentCatalogue.h"
#include "Interruption.h"
#include "ProgressDisplay.h"
#include "Recording.h"
#include "SessionStatistics.h"
#include "StagedFolder.h"
#include "UtcTime.h"
#include "vtkMessageTrap.h"
#include "vtkSessionFiles.h"
#include "vtkVesselModel.h"

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

  /// Known before the start; 0: not known.
  std::uint64_t Expected(double rate) const
  {
    const auto scripted = static_cast<std::uint64_t>(std::ceil(this->Script.Duration() * rate));
    return this->Most > 0 ? this->Most : this->Replay ? 0 : scripted;
  }

  /// @return false when it is over
  bool At(std::uint64_t tick, double rate, DriveInput& input, std::vector<RecordedEvent>& events)
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
      input = this->Script.At(end);
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
    this->Tips = "tick,seconds,x_mm,y_mm,z_mm,direction_x,direction_y,direction_z\n";
  }

  explicit operator bool() const { return this->Folder != nullptr; }

  void Add(const Intervention& intervention, const Scenario& scenario, const WallTopology& topology,
    vtkMessageTrap& messages)
  {
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
      report.proximalForce, report.proximalTorque, report.tipForce, report.greatestForce,
      report.contacts, report.largestPenetration, report.meanPenetration, report.jointGap,
      report.outside, named ? topology.groupName[branch].c_str() : "");
    this->Forces += text;
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

  void Finish(const Json& statistics)
  {
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
      const bool numbered = name.size() > 9 && name.compare(name.size() - 4, 4, ".vtp") == 0 &&
        (name.rfind("wire_", 0) == 0 || name.rfind("wall_", 0) == 0) &&
        name.find_first_not_of("0123456789", 5) == name.size() - 4;
      if (numbered || name == "wall.pvd")
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
  std::string Tips;
  std::uint64_t Tick = 0;
};

void Warn(const std::string& text)
{
  std::fprintf(stderr, "Warning: %s\n", text.c_str());
}

/// What a recording has to have in common with the session that replays it.
void CheckRecording(
  const HeadlessOptions& options, const Scenario& scenario, std::uint64_t wallHash)
{
  const RecordingReader reader(options.replay);
  const RecordingHeader& header = reader.Header();
  if (header.tickRate != scenario.settings.tickRate)
  {
    throw std::runtime_error("'" + options.replay + "' was recorded at " +
      std::to_string(header.tickRate) + " Hz, the scenario has another tick rate.");
  }
  if (header.meshHash != wallHash)
  {
    const std::string text =
      "'" + options.replay + "' was recorded with other vessels or another motion of them";
    if (options.verify)
    {
      throw std::runtime_error(text + ".");
    }
    Warn(text + ".");
  }
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

void RunHeadless(const HeadlessOptions& options)
{
  Scenario scenario = ScenarioOf(options);
  Hands hands(options);
  const double rate = scenario.settings.tickRate;
  const std::uint64_t expected = hands.Expected(rate);
  if (expected == 0 && !hands.Recording())
  {
    throw UsageError(
      "--ticks is required where neither --script nor --replay says how long it takes");
  }
  vtkMessageTrap messages;
  auto progress = std::make_unique<ProgressDisplay>("step", 2, options.quiet);
  progress->BeginStep(0, "vessels");
  VesselModel model = LoadVessels(scenario.vessels, messages,
    [&](double fraction)
    {
      progress->Update(fraction);
      return Interruption() == 0;
    });
  ThrowIfInterrupted();
  messages.ForgetWarnings();
  const WallTopology& topology = model.wall->Topology();
  InterventionSettings settings = scenario.settings;
  if (settings.rootBranch < 0)
  {
    settings.rootBranch = RootBranch(topology, scenario.artery);
  }
  const std::uint64_t wallHash = WallHash(*model.wall);
  if (hands.Recording())
  {
    CheckRecording(options, scenario, wallHash);
  }
  Intervention intervention(model.wall, scenario.wire, scenario.catheter, settings);
  OutputFiles files(options, topology);
  const auto interval =
    static_cast<std::uint64_t>(std::max(1.0, std::round(rate / options.outputRate)));
  std::unique_ptr<RecordingWriter> recording;
  if (!options.record.empty())
  {
    RecordingHeader header;
    header.build = "coronary-simulator " DYNAMICCORONARY_VERSION;
    header.scenario = ScenarioText(scenario);
    header.meshHash = wallHash;
    header.seed = scenario.seed;
    header.tickRate = rate;
    header.started = UtcTime();
    recording = std::make_unique<RecordingWriter>(options.record, header);
  }

  progress->BeginStep(1, "simulation");
  SessionStatistics statistics(topology);
  Comparison comparison;
  Json hashes = Json::array();
  DriveInput input;
  std::vector<RecordedEvent> events;
  std::uint64_t unknownEvents = 0;
  std::uint64_t tick = 0;
  std::chrono::steady_clock::duration simulating{};
  while (hands.At(tick, rate, input, events))
  {
    if (tick % InterruptionInterval == 0)
    {
      ThrowIfInterrupted();
      if (expected > 0)
      {
        progress->Update(static_cast<double>(tick) / static_cast<double>(expected));
      }
    }
    for (const RecordedEvent& event : events)
    {
      if (event.kind == RecordedEvent::HeartRate)
      {
        intervention.SetHeartRate(event.value);
      }
      else
      {
        ++unknownEvents;
      }
      if (recording)
      {
        recording->Event(tick, event);
      }
    }
    if (recording)
    {
      recording->Input(tick, input);
    }
    const auto before = std::chrono::steady_clock::now();
    const TickReport& report = intervention.Step(input);
    simulating += std::chrono::steady_clock::now() - before;
    ++tick; // what follows is of the state after this many steps
    statistics.Add(report);
    for (const std::string& text : intervention.TakeMessages())
    {
      statistics.AddMessage(tick, text);
      if (!options.quiet)
      {
        std::fprintf(
          stderr, "tick %llu: %s\n", static_cast<unsigned long long>(tick), text.c_str());
      }
      if (recording)
      {
        recording->Annotation(tick, text);
      }
    }
    if (tick % RecordedHashInterval == 0)
    {
      const std::uint64_t hash = intervention.StateHash();
      hashes.push_back(Hexadecimal(hash));
      if (recording)
      {
        recording->StateHash(tick, hash);
      }
    }
    std::uint64_t wanted = 0;
    if (hands.ExpectedHash(tick, wanted))
    {
      comparison.Add(tick, wanted == intervention.StateHash());
    }
    if (recording && tick % ForceInterval == 0)
    {
      recording->Force(tick,
        { static_cast<float>(report.proximalForce), static_cast<float>(report.proximalTorque),
          static_cast<float>(report.tipForce), static_cast<float>(report.greatestForce) });
    }
    if (files && (tick - 1) % interval == 0)
    {
      files.SetTick(tick);
      files.Add(intervention, scenario, topology, messages);
    }
  }
  ThrowIfInterrupted();
  if (hands.Recording())
  {
    FinishComparison(options, hands, comparison);
  }
  const std::uint64_t lastHash = intervention.StateHash();
  if (recording)
  {
    if (tick % RecordedHashInterval != 0)
    {
      recording->StateHash(tick, lastHash);
    }
    recording->Finish(tick);
  }

  Json result = statistics.ToJson();
  result["program"] = "coronary-simulator " DYNAMICCORONARY_VERSION;
  result["scenario"] = scenario.name;
  result["motion"] = model.motion;
  result["notes"] = model.notes;
  result["wire"] = scenario.wire.name;
  result["catheter"] = scenario.catheter.name;
  result["tick_hz"] = rate;
  result["seconds"] = static_cast<double>(tick) / rate;
  result["wall"] = { { "points", topology.points }, { "triangles", topology.triangles.size() },
    { "hash", Hexadecimal(wallHash) } };
  result["state_hash_interval"] = RecordedHashInterval;
  result["state_hashes"] = hashes;
  result["last_state_hash"] = Hexadecimal(lastHash);
  if (hands.Recording())
  {
    result["replay"] = { { "compared", comparison.compared }, { "equal", comparison.equal },
      { "first_different_tick",
        comparison.firstDifference > 0 ? Json(comparison.firstDifference) : Json(nullptr) },
      { "unknown_chunks", hands.Recording()->Reader().Unknown() },
      { "unknown_events", unknownEvents } };
  }
  if (files)
  {
    files.Finish(result);
  }
  progress.reset();
  if (!options.quiet)
  {
    for (const std::string& note : model.notes)
    {
      Warn(note);
    }
    const double seconds = std::chrono::duration<double>(simulating).count();
    std::string branches;
    for (const std::string& name : statistics.Branches())
    {
      branches += (branches.empty() ? "" : ", ") + name;
    }
    std::printf(
      "%s: %llu ticks, %.3g s; greatest penetration %.3g mm; %llu messages; branches: %s\n",
      scenario.name.c_str(), static_cast<unsigned long long>(tick),
      static_cast<double>(tick) / rate, statistics.LargestPenetration(),
      static_cast<unsigned long long>(statistics.Messages()),
      branches.empty() ? "none" : branches.c_str());
    if (tick > 0 && seconds > 0.0)
    {
      std::printf("%.3g us a tick, %.3g times real time\n",
        1e6 * seconds / static_cast<double>(tick), static_cast<double>(tick) / rate / seconds);
    }
    if (hands.Recording())
    {
      std::printf("%llu of %llu hashes are equal\n",
        static_cast<unsigned long long>(comparison.equal),
        static_cast<unsigned long long>(comparison.compared));
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
        json["wire_mm"] = item.input.wirePosition;
        json["wire_rad"] = item.input.wireAngle;
        json["catheter_mm"] = item.input.catheterPosition;
        json["catheter_rad"] = item.input.catheterAngle;
        break;
      case RecordType::Force:
        json["type"] = "force";
        json["proximal_N"] = item.forces.proximalForce;
        json["proximal_N_mm"] = item.forces.proximalTorque;
        json["tip_N"] = item.forces.tipForce;
        json["greatest_N"] = item.forces.greatestForce;
        break;
      case RecordType::Event:
        json["type"] = "event";
        json["kind"] = item.event.kind == RecordedEvent::HeartRate
          ? Json("heart_rate_bpm")
          : Json(static_cast<int>(item.event.kind));
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
