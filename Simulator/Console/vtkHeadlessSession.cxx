#include "HeadlessSession.h"

#include "AtomicFile.h"
#include "FileSeries.h"
#include "InstrumentCatalogue.h"
#include "Interruption.h"
#include "PatientModel.h"
#include "Program.h"
#include "ProgressDisplay.h"
#include "ReportPage.h"
#include "SessionImager.h"
#include "SessionPictures.h"
#include "SessionRunner.h"
#include "SessionStatistics.h"
#include "StagedFolder.h"
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

constexpr std::int64_t InterruptionInterval = 64; // ticks between looks at signals
constexpr std::uint64_t MostPrinted = 50; // messages on the console; statistics.json has more

/// Whether it is a name as wire_00012.vtp.
bool IsNumbered(const std::string& name, const std::string& start, const std::string& end,
  const char* number = "0123456789")
{
  const std::size_t digits = start.size();
  return name.size() > digits + end.size() && name.rfind(start, 0) == 0 &&
    name.compare(name.size() - end.size(), end.size(), end) == 0 &&
    name.find_first_not_of(number, digits) == name.size() - end.size();
}

/// Empty where the branch has no name.
std::string VesselOf(const WallTopology& topology, int branch)
{
  const auto n = static_cast<std::size_t>(branch);
  return n < topology.groupName.size() ? topology.groupName[n] : "";
}

Json MetricsToJson(const SessionMetrics& metrics, const WallTopology& topology)
{
  Json branches = Json::array();
  for (const int branch : metrics.branches)
  {
    const std::string name = VesselOf(topology, branch);
    // Parts of one segment between its side branches are one for people.
    if (branches.empty() || branches.back() != name)
    {
      branches.push_back(name);
    }
  }
  Json events = Json::array();
  for (const ProcedureEvent& event : metrics.events)
  {
    const char* quantity = "";
    const char* what = NameOf(event.kind, quantity);
    events.push_back({ { "seconds", event.seconds }, { "what", what },
      { "vessel", VesselOf(topology, event.branch) }, { "place_mm", event.place },
      { quantity, event.value } });
  }
  return { { "procedure_s", metrics.procedureSeconds },
    { "fluoroscopy_s", metrics.fluoroscopySeconds }, { "cine_s", metrics.cineSeconds },
    { "frames", metrics.frames }, { "air_kerma_mGy", metrics.airKerma },
    { "dose_area_Gy_cm2", metrics.doseAreaProduct }, { "contrast_mL", metrics.contrast },
    { "greatest_wall_force_N", metrics.maximumWallForce },
    { "greatest_tip_force_N", metrics.maximumTipForce },
    { "forceful_tip_s", metrics.forcefulSeconds }, { "wire_travel_mm", metrics.wireTravel },
    { "wire_turning_rad", metrics.wireTurning }, { "deepest_mm", metrics.deepest },
    { "wire_travel_without_xray_mm", metrics.blindTravel },
    { "idle_xray_s", metrics.idleBeamSeconds }, { "occluded_s", metrics.occludedSeconds },
    { "greatest_st_shift_mV", metrics.greatestStShift },
    { "st_elevated_s", metrics.elevatedSeconds }, { "pericardial_mL", metrics.pericardialBlood },
    { "pericardial_mmHg", metrics.pericardialPressure },
    { "stroke_volume_percent", 100.0 * metrics.strokeShare }, { "path", branches },
    { "events", events } };
}

Json LesionsToJson(const std::vector<LesionResult>& lesions)
{
  Json list = Json::array();
  for (const LesionResult& one : lesions)
  {
    list.push_back({ { "vessel", one.vessel }, { "reference_mm", one.reference },
      { "least_mm", one.least }, { "stenosis_before_percent", 100.0 * one.degreeBefore },
      { "stenosis_percent", 100.0 * one.degree }, { "pd_pa", one.pressureRatio },
      { "ffr_before", one.reserveBefore }, { "ffr", one.reserve },
      { "greatest_diameter_over_reference", one.stretch } });
  }
  return list;
}

/// Those that are narrower than before.
Json MouthsToJson(const std::vector<MouthResult>& mouths)
{
  Json list = Json::array();
  for (const MouthResult& one : mouths)
  {
    if (one.degree > one.degreeBefore)
    {
      list.push_back({ { "vessel", one.vessel }, { "reference_mm", one.reference },
        { "place_mm", one.place }, { "stenosis_before_percent", 100.0 * one.degreeBefore },
        { "stenosis_percent", 100.0 * one.degree }, { "closed", one.closed },
        { "ffr_before", one.reserveBefore }, { "ffr", one.reserve } });
    }
  }
  return list;
}

Json StentsToJson(const std::vector<StentResult>& stents)
{
  Json list = Json::array();
  for (const StentResult& one : stents)
  {
    Json json = { { "name", one.name }, { "vessel", one.vessel }, { "from_mm", one.from },
      { "to_mm", one.to }, { "beyond_vessel_mm", one.beyond } };
    if (const StentRingResult* narrowest = one.Narrowest())
    {
      json["least_diameter_mm"] = narrowest->diameter;
      json["least_area_mm2"] = narrowest->Area();
      json["expansion_percent"] = 100.0 * one.LeastExpanded()->Expansion();
      json["residual_stenosis_percent"] = 100.0 * one.residual;
      json["greatest_gap_mm"] = one.GreatestGap()->gap;
      json["malapposed_mm"] = one.malapposed;
      json["disease_before_mm"] = one.missedBefore;
      json["disease_behind_mm"] = one.missedBehind;
      json["covers_no_lesion"] = one.missedAll;
    }
    list.push_back(json);
  }
  return list;
}

Json TearsToJson(const std::vector<VesselTear>& tears)
{
  Json list = Json::array();
  for (const VesselTear& one : tears)
  {
    const bool hole = one.kind == VesselTear::Kind::Perforation;
    Json json = { { "what", hole ? "perforation" : "dissection" }, { "vessel", one.vessel },
      { "place_mm", one.place }, { "by", one.stretch > 0.0 ? "balloon" : "wire" },
      { "sealed", one.sealed ? "yes" : "no" } };
    if (one.stretch > 0.0)
    {
      json["diameter_over_reference"] = one.stretch;
    }
    if (hole)
    {
      json["ellis"] = one.Ellis();
      json["hole_mm"] = one.diameter;
      json["blood_mL"] = one.blood;
      json["contrast_mL"] = one.beside + one.spread;
    }
    else
    {
      json["flap_percent"] = 100.0 * one.flap;
      json["contrast_mL"] = one.inWall;
    }
    list.push_back(json);
  }
  return list;
}

Json ProcedureToJson(const std::vector<ProcedureStep>& steps, const TrainingSession& session)
{
  Json json = { { "steps", Json::array() } };
  const std::vector<double>& reached = session.Procedure().reached;
  for (std::size_t n = 0; n < steps.size(); ++n)
  {
    const char* value = nullptr;
    json["steps"].push_back({ { "text", steps[n].text }, { "goal", NameOf(steps[n].goal, value) },
      { "seconds", n < reached.size() ? Json(reached[n]) : Json(nullptr) } });
  }
  const ProcedureScore score = session.Score();
  json["passed"] = score.passed;
  json["failures"] = score.failures;
  json["points"] = score.points;
  json["formula"] = "100 less the sum of min(most, weight * amount)";
  for (const ScoreItem& item : score.items)
  {
    json["items"].push_back(
      { { "what", item.name }, { "amount", item.amount }, { "unit", item.unit },
        { "weight", item.weight }, { "most", item.most }, { "lost", item.Lost() } });
  }
  return json;
}

/// Along the stents, a line a ring.
std::string StentTable(const std::vector<StentResult>& stents, const WallTopology& topology)
{
  std::string table = "stent,name,vessel,place_mm,diameter_mm,lumen_mm,reference_mm,gap_mm\n";
  for (std::size_t n = 0; n < stents.size(); ++n)
  {
    for (const StentRingResult& ring : stents[n].rings)
    {
      char text[320];
      std::snprintf(text, sizeof(text), "%zu,%s,%s,%.6g,%.6g,%.6g,%.6g,%.6g\n", n + 1,
        stents[n].name.c_str(), VesselOf(topology, ring.branch).c_str(), ring.place, ring.diameter,
        ring.lumen, ring.reference, ring.gap);
      table += text;
    }
  }
  return table;
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
                  "spilled_mL,aortic_pressure_mmHg,air_kerma_mGy,dose_area_Gy_cm2,in_guide_mL,"
                  "in_aorta_mL,left_aorta_mL,leaked_mL,in_wall_mL,pericardial_mL,"
                  "pericardial_mmHg\n";
    this->Balloons =
      "tick,seconds,tip_mm,pressure_atm,least_mm,greatest_mm,hand_force_N,grip_N,wall_atm,"
      "lesion_least_mm,lesion_percent,pd_pa,flow_mL_s\n";
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
    WriteInstruments(this->Folder->Add(name), intervention, scenario.catheter, messages);
    this->WireFiles.push_back({ name, seconds });
    if (this->Wall)
    {
      std::snprintf(name, sizeof(name), "wall_%05zu.vtp", this->WallFiles.size());
      this->Wall->Write(this->Folder->Add(name), intervention.WallPoints(), messages);
      this->WallFiles.push_back({ name, seconds });
    }
    char text[512];
    std::snprintf(text, sizeof(text),
      "%llu,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%d,%.9g,%.9g,%.9g,%d,%s\n",
      static_cast<unsigned long long>(this->Tick), seconds, report.phase, report.inserted,
      report.proximalForce, report.proximalTorque, report.tipForce, report.maximumForce,
      report.contacts, report.maximumPenetration, report.meanPenetration, report.jointGap,
      report.outside, VesselOf(topology, report.branch).c_str());
    this->Forces += text;
    const ContrastBalance medium = session.Balance();
    std::snprintf(text, sizeof(text),
      "%llu,%.9g,%.6g,%.9g,%.9g,%.9g,%.9g,%.9g,%.6g,%.6g,%.6g,%.9g,%.9g,%.9g,%.9g,%.9g,%.6g,%.6g\n",
      static_cast<unsigned long long>(this->Tick), seconds, session.Report().injection,
      medium.injected, medium.inTree, medium.blush, medium.washedOut, medium.spilled,
      session.Contrast().AorticPressure(), session.Metrics().airKerma,
      session.Metrics().doseAreaProduct, medium.inGuide, medium.inAorta, medium.leftAorta,
      medium.leaked, medium.inWall, session.Metrics().pericardialBlood,
      session.Metrics().pericardialPressure);
    this->Flows += text;
    this->Seconds.push_back(seconds);
    const double values[] = { report.tipForce, report.proximalForce, report.balloon.pressure,
      medium.inTree, session.Contrast().AorticPressure() };
    for (std::size_t n = 0; n < this->Curves.size(); ++n)
    {
      this->Curves[n].values.push_back(values[n]);
    }
    this->AddBalloon(session, seconds);
    const std::vector<Vector3>& line = intervention.Centerline(report.hand);
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

  void Finish(const Json& statistics, SessionPictures& pictures, const std::string& stents)
  {
    pictures.Finish([this](const std::string& name) { return this->Place(name); });
    if (!stents.empty())
    {
      WriteFileAtomically(this->Folder->Add("stents.csv"), stents);
    }
    if (pictures.Frames() > 0)
    {
      WriteFileAtomically(this->Folder->Add("frames.csv"), pictures.FrameTable());
    }
    if (!this->HasBalloon)
    {
      this->Curves.erase(this->Curves.begin() + BalloonCurve);
    }
    WriteFileAtomically(this->Folder->Add("report.html"),
      ReportPage(statistics, this->Seconds, this->Curves, pictures.PicturesOfRuns()));
    WriteFileAtomically(this->Folder->Add("contrast.csv"), this->Flows);
    if (this->HasBalloon)
    {
      WriteFileAtomically(this->Folder->Add("balloon.csv"), this->Balloons);
    }
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
  /// With the first lesion, and the flow at the beginning of its branch; zeros without one.
  void AddBalloon(const TrainingSession& session, double seconds)
  {
    if (!session.Instruments().Balloon())
    {
      return;
    }
    this->HasBalloon = true;
    const BalloonReport& balloon = session.Instruments().Report().balloon;
    const std::vector<LesionResult> lesions = session.Lesions();
    const LesionResult first = lesions.empty() ? LesionResult() : lesions.front();
    const double flow = lesions.empty() ? 0.0 : session.Contrast().Flow(first.branch);
    char text[320];
    std::snprintf(text, sizeof(text),
      "%llu,%.9g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n",
      static_cast<unsigned long long>(this->Tick), seconds, balloon.tip, balloon.pressure,
      balloon.least, balloon.greatest, balloon.force, balloon.grip, balloon.wallPressure,
      first.least, 100.0 * first.degree, first.pressureRatio, flow);
    this->Balloons += text;
  }

  /// What an older session left under our names.
  void TakeOlder(const std::string& folder)
  {
    std::vector<std::string> older;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder, ignored))
    {
      const std::string name = entry.path().filename().string();
      if (IsNumbered(name, "wire_", ".vtp") || IsNumbered(name, "wall_", ".vtp") ||
        IsNumbered(name, "xray_", ".png") || IsNumbered(name, "cine_", ".dcm", "0123456789_") ||
        IsNumbered(name, "scene_", ".png") || name == "wall.pvd" || name == "frames.csv" ||
        name == "balloon.csv" || name == "stents.csv")
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
  std::string Balloons;
  bool HasBalloon = false;
  static constexpr std::ptrdiff_t BalloonCurve = 2;
  std::vector<double> Seconds;
  std::vector<ReportCurve> Curves{ { "force of the tip on the wall, N", {} },
    { "force at the hand, against advancing, N", {} }, { "pressure in the balloon, atm", {} },
    { "contrast medium in the vessels, mL", {} }, { "aortic pressure, mmHg", {} } };
  std::uint64_t Tick = 0;
};

void Warn(const std::string& text)
{
  std::fprintf(stderr, "Warning: %s\n", text.c_str());
}

/// Before anything is put in its place: what is not verified leaves nothing.
void FinishComparison(
  const HeadlessOptions& options, const RecordingReader& reader, const HashComparison& comparison)
{
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
  const bool ofPatient = !options.patient.empty();
  if (!options.scenario.empty() || ofPatient)
  {
    scenario = LoadScenario(options.scenario.empty() ? "patient-lca" : options.scenario);
  }
  else if (!options.replay.empty())
  {
    const RecordingReader reader(options.replay);
    scenario =
      RecordedScenario(reader.Header().scenario, "The scenario in '" + options.replay + "'");
  }
  else
  {
    throw UsageError("--scenario is required (--list-scenarios names those that are built in)");
  }
  const std::string model = ofPatient && options.vessels.empty()
    ? NameOfSeries(options.patient) + "-coronary"
    : options.vessels;
  if (!model.empty())
  {
    if (scenario.vessels.kind == VesselSource::Kind::Phantom)
    {
      scenario.vessels.motion = VesselMotion::Automatic;
    }
    scenario.vessels.kind = VesselSource::Kind::Run;
    scenario.vessels.path = fs::absolute(model).lexically_normal().string();
  }
  if (ofPatient)
  {
    scenario.name = options.scenario.empty() ? NameOfSeries(options.patient) : scenario.name;
    scenario.imaging.background = fs::absolute(options.patient).lexically_normal().string();
    scenario.imaging.backgroundRun = scenario.vessels.path;
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
  scenario.settings.guideFromArch = scenario.settings.guideFromArch || options.guideFromArch;
  if (!options.balloon.empty())
  {
    scenario.balloon = BuiltInCatalogue().Balloon(options.balloon).balloon;
  }
  if (options.heartRate >= 0.0)
  {
    scenario.settings.heartRate = options.heartRate;
    scenario.heartRateOfVessels = false;
  }
  return scenario;
}

namespace
{
/// A session from its first tick to its last.
class HeadlessRun
{
public:
  /// @param replay  that the source goes through; null: none  @param expected  ticks; 0: not known before the end
  HeadlessRun(const HeadlessOptions& options, const SessionWorld& world,
    std::unique_ptr<TickSource> source, const RecordingReader* replay, std::uint64_t expected)
    : Options(options)
    , World(world)
    , Replay(replay)
    , Expected(expected)
    , Rate(world.scenario.settings.tickRate)
    , Runner(world.wall, world.scenario, world.wallHash, std::move(source), world.measured)
    , Pictures({ options.xray, options.scene }, world)
    , Files(options, world.wall->Topology())
    , Statistics(world.wall->Topology())
    , Interval(
        static_cast<std::uint64_t>(std::max(1.0, std::round(this->Rate / options.outputRate))))
  {
    this->Runner.maximumTicks = options.ticks;
    this->Runner.say = [this](std::uint64_t tick, const std::string& text)
    { this->Tell(tick, text); };
    this->Runner.afterTick = [this](const SessionReport& report) { this->Keep(report); };
    if (!options.record.empty())
    {
      this->Runner.Record(options.record, "coronary-simulator " DYNAMICCORONARY_VERSION, UtcTime());
    }
  }

  void Run(ProgressDisplay& progress)
  {
    bool goesOn = true;
    while (goesOn)
    {
      ThrowIfInterrupted();
      if (this->Expected > 0)
      {
        progress.Update(
          static_cast<double>(this->Runner.Tick()) / static_cast<double>(this->Expected));
      }
      const auto before = std::chrono::steady_clock::now();
      goesOn = this->Runner.Run(InterruptionInterval);
      this->Running += std::chrono::steady_clock::now() - before;
    }
    ThrowIfInterrupted();
  }

  void Finish()
  {
    if (this->Replay)
    {
      FinishComparison(this->Options, *this->Replay, this->Runner.Compared());
    }
    this->Runner.FinishRecording();
    if (this->Files)
    {
      const std::vector<StentResult> stents = this->Runner.Session().Stents();
      this->Files.Finish(this->Result(), this->Pictures,
        stents.empty() ? std::string() : StentTable(stents, this->World.wall->Topology()));
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
      this->World.scenario.name.c_str(), static_cast<unsigned long long>(this->Runner.Tick()),
      static_cast<double>(this->Runner.Tick()) / this->Rate, this->Statistics.MaximumPenetration(),
      static_cast<unsigned long long>(this->Statistics.Messages()),
      branches.empty() ? "none" : branches.c_str());
    const SessionMetrics& metrics = this->Runner.Session().Metrics();
    if (metrics.frames > 0 || metrics.contrast > 0.0)
    {
      std::printf("%lld X-ray frames, %.3g mGy, %.3g Gy cm2; %.3g mL of contrast medium\n",
        static_cast<long long>(metrics.frames), metrics.airKerma, metrics.doseAreaProduct,
        metrics.contrast);
    }
    const double seconds = std::chrono::duration<double>(this->Running - this->Keeping).count();
    if (this->Runner.Tick() > 0 && seconds > 0.0)
    {
      std::printf("%.3g us a tick, %.3g times real time\n",
        1e6 * seconds / static_cast<double>(this->Runner.Tick()),
        static_cast<double>(this->Runner.Tick()) / this->Rate / seconds);
    }
    for (const LesionResult& one : this->Runner.Session().Lesions())
    {
      std::printf("lesion in %s: %.0f %% of %.2f mm, was %.0f %%; FFR %.2f, was %.2f\n",
        one.vessel.c_str(), 100.0 * one.degree, one.reference, 100.0 * one.degreeBefore,
        one.reserve, one.reserveBefore);
    }
    for (const MouthResult& one : this->Runner.Session().Mouths())
    {
      if (one.degree > one.degreeBefore)
      {
        std::printf("mouth of %s: %.0f %% of %.2f mm, was %.0f %%; FFR %.2f, was %.2f\n",
          one.vessel.c_str(), 100.0 * one.degree, one.reference, 100.0 * one.degreeBefore,
          one.reserve, one.reserveBefore);
      }
    }
    for (const VesselTear& one : this->Runner.Session().Tears())
    {
      const char* sealed = one.sealed ? "sealed" : "open";
      if (one.kind == VesselTear::Kind::Perforation)
      {
        std::printf("perforation in %s: hole of %.2f mm (Ellis %d), %.1f mL of blood, %s\n",
          one.vessel.c_str(), one.diameter, one.Ellis(), one.blood, sealed);
      }
      else
      {
        std::printf("dissection in %s: %.0f %% of the diameter, %s\n", one.vessel.c_str(),
          100.0 * one.flap, sealed);
      }
    }
    if (metrics.pericardialBlood > 0.0)
    {
      std::printf("pericardium: %.0f mL, %.1f mmHg; stroke volume %.0f %%\n",
        metrics.pericardialBlood, metrics.pericardialPressure, 100.0 * metrics.strokeShare);
    }
    for (const StentResult& one : this->Runner.Session().Stents())
    {
      if (const StentRingResult* narrowest = one.Narrowest())
      {
        std::printf(
          "stent in %s: %.1f mm long, least diameter %.2f mm, expansion %.0f %%, residual "
          "stenosis %.0f %%, greatest gap %.2f mm\n",
          one.vessel.c_str(), one.to - one.from, narrowest->diameter,
          100.0 * one.LeastExpanded()->Expansion(), 100.0 * one.residual, one.GreatestGap()->gap);
      }
    }
    if (!this->World.scenario.procedure.empty())
    {
      for (const std::string& line : LinesOf(this->Runner.Session().Score()))
      {
        std::printf("%s\n", line.c_str());
      }
    }
    if (this->Replay)
    {
      std::printf("%llu of %llu hashes are equal\n",
        static_cast<unsigned long long>(this->Runner.Compared().equal),
        static_cast<unsigned long long>(this->Runner.Compared().compared));
    }
  }

private:
  void Keep(const SessionReport& report)
  {
    const auto before = std::chrono::steady_clock::now();
    const std::uint64_t tick = this->Runner.Tick();
    this->Statistics.Add(report.tick);
    if (tick % RecordedHashInterval == 0)
    {
      this->Hashes.push_back(Hexadecimal(this->Runner.StateHash()));
    }
    SessionPictures::FolderCallback folder;
    if (this->Files)
    {
      folder = [this](const std::string& name) { return this->Files.Place(name); };
    }
    if (report.exposed)
    {
      this->Pictures.AddFrame(this->Runner.Session(), folder, this->Runner.Recording());
    }
    if (this->Files && (tick - 1) % this->Interval == 0)
    {
      this->Files.SetTick(tick);
      this->Files.Add(this->Runner.Session(), this->World.scenario, this->Trap);
      this->Pictures.AddScene(this->Runner.Session(), folder);
    }
    this->Keeping += std::chrono::steady_clock::now() - before;
  }

  void Tell(std::uint64_t tick, const std::string& text)
  {
    this->Statistics.AddMessage(tick, text);
    if (!this->Options.quiet && this->Statistics.Messages() <= MostPrinted)
    {
      std::fprintf(stderr, "tick %llu: %s\n", static_cast<unsigned long long>(tick), text.c_str());
    }
  }

  Json Result()
  {
    const WallTopology& topology = this->Runner.Session().Topology();
    const Scenario& scenario = this->World.scenario;
    Json result = this->Statistics.ToJson();
    result["program"] = "coronary-simulator " DYNAMICCORONARY_VERSION;
    result["scenario"] = scenario.name;
    result["motion"] = this->World.motion;
    result["notes"] = this->World.notes;
    result["wire"] = scenario.wire.name;
    if (scenario.secondWire)
    {
      result["second_wire"] = scenario.secondWire->name;
    }
    result["catheter"] = scenario.catheter.name;
    result["tick_hz"] = this->Rate;
    result["seconds"] = static_cast<double>(this->Runner.Tick()) / this->Rate;
    result["wall"] = { { "points", topology.points }, { "triangles", topology.triangles.size() },
      { "hash", Hexadecimal(this->World.wallHash) } };
    result["metrics"] = MetricsToJson(this->Runner.Session().Metrics(), topology);
    if (const std::vector<LesionResult> lesions = this->Runner.Session().Lesions();
        !lesions.empty())
    {
      result["lesions"] = LesionsToJson(lesions);
    }
    if (const std::vector<VesselTear>& tears = this->Runner.Session().Tears(); !tears.empty())
    {
      result["tears"] = TearsToJson(tears);
    }
    if (!scenario.procedure.empty())
    {
      result["procedure"] = ProcedureToJson(scenario.procedure, this->Runner.Session());
    }
    if (scenario.balloon)
    {
      result["stents"] = StentsToJson(this->Runner.Session().Stents());
      result["side_branches"] = MouthsToJson(this->Runner.Session().Mouths());
    }
    result["state_hash_interval"] = RecordedHashInterval;
    result["state_hashes"] = this->Hashes;
    result["last_state_hash"] = Hexadecimal(this->Runner.StateHash());
    if (this->Replay)
    {
      result["replay"] = { { "compared", this->Runner.Compared().compared },
        { "equal", this->Runner.Compared().equal },
        { "first_different_tick",
          this->Runner.Compared().firstDifference > 0
            ? Json(this->Runner.Compared().firstDifference)
            : Json(nullptr) },
        { "unknown_chunks", this->Replay->Unknown() },
        { "unknown_events", this->Runner.UnknownEvents() } };
    }
    return result;
  }

  const HeadlessOptions& Options;
  const SessionWorld& World;
  const RecordingReader* Replay;
  std::uint64_t Expected;
  double Rate;
  SessionRunner Runner;
  SessionPictures Pictures;
  OutputFiles Files;
  SessionStatistics Statistics;
  std::uint64_t Interval;
  vtkMessageTrap Trap;
  Json Hashes = Json::array();
  std::chrono::steady_clock::duration Running{};
  std::chrono::steady_clock::duration Keeping{}; // of files and pictures
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

SessionWorld WorldOf(const HeadlessOptions& options, const Scenario& scenario, bool background,
  const WorldProgress& progress)
{
  std::vector<std::string> warnings;
  if (!options.patient.empty())
  {
    warnings = MakePatientModel(options.patient, scenario.vessels.path,
      [&progress](double fraction) { return progress("model", fraction); });
  }
  SessionWorld world = LoadWorld(scenario, background, progress);
  world.notes.insert(world.notes.begin(), warnings.begin(), warnings.end());
  return world;
}

void RunHeadless(const HeadlessOptions& options)
{
  const Scenario scenario = ScenarioOf(options);
  const double rate = scenario.settings.tickRate;
  const DriveScript script =
    options.script.empty() ? DriveScript() : ReadDriveScript(options.script);
  auto recorded = options.replay.empty() ? nullptr : std::make_unique<ReplaySource>(options.replay);
  const RecordingReader* replay = recorded ? &recorded->Reader() : nullptr;
  const auto expected = options.ticks > 0 || recorded ? options.ticks : script.Ticks(rate);
  if (expected == 0 && !recorded)
  {
    throw UsageError(
      "--ticks is required where neither --script nor --replay says how long it takes");
  }
  const bool readsPatient =
    options.xray || (scenario.imaging.exposureControl && !scenario.imaging.background.empty());
  const int preparations = 1 + (readsPatient ? 1 : 0) + (options.patient.empty() ? 0 : 1);
  auto progress = std::make_unique<ProgressDisplay>("step", preparations + 1, options.quiet);
  const SessionWorld world = WorldOf(options, scenario, options.xray, ShownBy(*progress));
  if (replay)
  {
    CheckRecording(options.replay, scenario, world.wallHash, !options.verify);
  }
  std::unique_ptr<TickSource> source = std::move(recorded);
  if (!source)
  {
    source =
      std::make_unique<ScriptSource>(script, StartInputOf(world.scenario), rate, options.ticks > 0);
  }
  HeadlessRun run(options, world, std::move(source), replay, expected);
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
  for (const EventMember& member : EventMembers)
  {
    if (member.kind == kind)
    {
      return member.name;
    }
  }
  return static_cast<int>(kind);
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
        json["inflation_atm"] = item.input.drive.inflation;
        json["balloon_mm"] = item.input.drive.balloonPosition;
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
  for (const CatalogueBalloon& one : BuiltInCatalogue().balloons)
  {
    std::printf("%s %-22s %4.2f mm at %g atm  %s\n", one.balloon.stent ? "stent    " : "balloon  ",
      one.balloon.name.c_str(), 2.0 * one.balloon.FreeRadius(one.balloon.nominalPressure),
      one.balloon.nominalPressure, one.description.c_str());
  }
  for (const CatalogueBalloon& one : BuiltInCatalogue().microcatheters)
  {
    std::printf("microcatheter %-18s %4.2f mm, tip %4.2f mm  %s\n", one.balloon.name.c_str(),
      2.0 * one.balloon.Profile(), 2.0 * one.balloon.tipRadius, one.description.c_str());
  }
}
}
