#include "Scenario.h"

#include "EmbeddedFiles.h"
#include "HandAxes.h"
#include "InstrumentJson.h"
#include "JsonFields.h"
#include "Numbers.h"
#include "TextFile.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double MaximumSeed = 9007199254740992.0; // 2^53: every JSON reader holds it exactly

const char* const DominanceNames[] = { "right", "left", "balanced" };
const char* const MotionNames[] = { "automatic", "tracked", "still", "contraction" };

/// Of files: a goal, and its value with its range.
struct GoalName
{
  ProcedureStep::Goal goal;
  const char* name;
  const char* value; ///< null: it has none
  double low;
  double high;
};
constexpr GoalName GoalNames[] = { { ProcedureStep::Goal::Angiogram, "angiogram", "views", 1.0,
                                     20.0 },
  { ProcedureStep::Goal::WireIn, "wire_in", nullptr, 0.0, 0.0 },
  { ProcedureStep::Goal::WireAtLesion, "wire_at_lesion", "mm", 0.0, 50.0 },
  { ProcedureStep::Goal::WireBeyondLesion, "wire_beyond_lesion", "mm", 0.0, 200.0 },
  { ProcedureStep::Goal::WireTaken, "wire_taken", "number", 0.0, 100.0 },
  { ProcedureStep::Goal::BalloonTaken, "balloon_taken", "number", 0.0, 100.0 },
  { ProcedureStep::Goal::MicrocatheterAtLesion, "microcatheter_at_lesion", "mm", 0.0, 50.0 },
  { ProcedureStep::Goal::BalloonInLesion, "balloon_in_lesion", "atm", 0.5, 40.0 },
  { ProcedureStep::Goal::StentInLesion, "stent_in_lesion", nullptr, 0.0, 0.0 },
  { ProcedureStep::Goal::StenosisBelow, "stenosis_below", "percent", 1.0, 100.0 },
  { ProcedureStep::Goal::ReserveAbove, "ffr_above", "ffr", 0.0, 1.0 },
  { ProcedureStep::Goal::WireBack, "wire_back", nullptr, 0.0, 0.0 },
  { ProcedureStep::Goal::GuideIn, "guide_in_ostium", nullptr, 0.0, 0.0 },
  { ProcedureStep::Goal::SideBranchOpen, "side_branch_open", "ffr", 0.0, 1.0 },
  { ProcedureStep::Goal::LeakStopped, "leak_stopped", nullptr, 0.0, 0.0 },
  { ProcedureStep::Goal::LeakSealed, "leak_sealed", nullptr, 0.0, 0.0 } };

/// A number of the file, its range, and where it goes; one list for reading and writing.
struct NumberEntry
{
  const char* name;
  double* value;
  double low;
  double high;
};

std::vector<NumberEntry> NumbersOf(InterventionSettings& s)
{
  return { { "tick_rate_hz", &s.tickRate, 500.0, 20000.0 },
    { "heart_rate_bpm", &s.heartRate, 0.0, 240.0 }, { "start_phase", &s.startPhase, 0.0, 1.0 },
    { "segment_length_mm", &s.segmentLength, 0.5, 4.0 },
    { "inside_catheter_mm", &s.insideCatheter, 5.0, 100.0 },
    { "engagement_mm", &s.engagement, 0.5, 10.0 },
    { "wall_friction_factor", &s.wallFriction, 0.0, 10.0 },
    { "wall_stiffness_N_per_mm", &s.wallStiffness, 0.1, 1000.0 },
    { "drag_Pa_s", &s.drag, 0.0, 10.0 }, { "largest_speed_mm_s", &s.maximumSpeed, 1.0, 2000.0 },
    { "largest_turning_rad_s", &s.maximumTurning, 1.0, 1000.0 },
    { "perforation_seal_s", &s.sealTime, 1.0, 3600.0 } };
}

std::vector<NumberEntry> NumbersOf(PhantomSettings& s)
{
  return { { "calibre", &s.calibre, 0.5, 2.0 },
    { "position_variation_mm", &s.positionVariation, 0.0, 10.0 },
    { "calibre_variation", &s.calibreVariation, 0.0, 0.3 },
    { "tortuosity", &s.tortuosity, 0.0, 3.0 }, { "stenosis_degree", &s.stenosisDegree, 0.0, 0.95 },
    { "motion_amplitude", &s.motionAmplitude, 0.0, 1.3 },
    { "axial_motion_right_mm", &s.axialMotionRight, 0.0, 24.0 },
    { "axial_motion_left_mm", &s.axialMotionLeft, 0.0, 24.0 },
    { "regional_lag", &s.regionalLag, 0.0, 0.05 },
    { "regional_amplitude", &s.regionalAmplitude, 0.0, 0.1 },
    { "area_pulse", &s.areaPulse, 0.0, 0.3 },
    { "centerline_spacing_mm", &s.centerlineSpacing, 0.1, 5.0 },
    { "surface_spacing_mm", &s.surfaceSpacing, 0.15, 1.5 } };
}

std::vector<NumberEntry> NumbersOf(ContractionSettings& s)
{
  return { { "axial_mm", &s.axial, 0.0, 25.0 }, { "radial", &s.radial, 0.0, 0.3 },
    { "systole", &s.systole, 0.2, 0.5 }, { "peak_speed_mm_s", &s.peakSpeed, 1.0, 300.0 } };
}

std::vector<NumberEntry> NumbersOf(ContrastSettings& s)
{
  return { { "viscosity_mPa_s", &s.flow.viscosity, 0.5, 20.0 },
    { "systolic_pressure_mmHg", &s.flow.systolicPressure, 20.0, 300.0 },
    { "diastolic_pressure_mmHg", &s.flow.diastolicPressure, 10.0, 300.0 },
    { "left_axial_speed_cm_s", &s.flow.leftAxialSpeed, 1.0, 200.0 },
    { "right_axial_speed_cm_s", &s.flow.rightAxialSpeed, 1.0, 200.0 },
    { "left_diastolic_ratio", &s.flow.leftDiastolicRatio, 0.3, 5.0 },
    { "right_diastolic_ratio", &s.flow.rightDiastolicRatio, 0.3, 5.0 },
    { "outlet_exponent", &s.flow.outletExponent, 1.0, 4.0 },
    { "tracer_volume_mL", &s.tracers.volume, 1e-7, 0.1 },
    { "radial_diffusivity_mm2_s", &s.tracers.radialDiffusivity, 0.0, 100.0 },
    { "smoothing_mm", &s.smoothing, 0.0, 20.0 }, { "flow_depression", &s.flowDepression, 0.0, 1.0 },
    { "stroke_volume_mL", &s.aorta.strokeVolume, 5.0, 200.0 } };
}

std::vector<NumberEntry> NumbersOf(BreathingSettings& s)
{
  return { { "rate_per_min", &s.rate, 0.0, 60.0 }, { "amplitude_mm", &s.amplitude, 0.0, 40.0 } };
}

void ReadNumbers(JsonFields& fields, const std::vector<NumberEntry>& entries)
{
  for (const NumberEntry& entry : entries)
  {
    *entry.value = fields.Number(entry.name, entry.low, entry.high, *entry.value);
  }
}

Json WriteNumbers(const std::vector<NumberEntry>& entries)
{
  Json json = Json::object();
  for (const NumberEntry& entry : entries)
  {
    json[entry.name] = *entry.value;
  }
  return json;
}

template <std::size_t Count>
int OneOf(JsonFields& fields, const char* name, const char* const (&names)[Count])
{
  const std::string text = fields.Text(name);
  std::string list;
  for (std::size_t n = 0; n < Count; ++n)
  {
    if (text == names[n])
    {
      return static_cast<int>(n);
    }
    list += (n > 0 ? ", " : "") + std::string(names[n]);
  }
  fields.Refuse(std::string("has '") + name + "': '" + text.substr(0, 60) + "' is none of " + list);
}

Vector3 PointOf(JsonFields& fields, const char* name)
{
  const Json& list = fields.List(name);
  Vector3 point = Vector3::Zero();
  bool good = list.size() == 3;
  for (std::size_t n = 0; good && n < 3; ++n)
  {
    good = list[n].is_number() && std::abs(list[n].get<double>()) <= 1e5;
    point[static_cast<Eigen::Index>(n)] = good ? list[n].get<double>() : 0.0;
  }
  if (!good)
  {
    fields.Refuse(std::string("has '") + name + "' that is not three coordinates in mm");
  }
  return point;
}

PhantomSettings PhantomOf(const Json& object, const std::string& where)
{
  PhantomSettings phantom;
  JsonFields fields(object, where);
  phantom.seed = static_cast<std::uint64_t>(
    fields.Whole("seed", 0, INT32_MAX, static_cast<std::int64_t>(phantom.seed)));
  if (fields.Has("dominance"))
  {
    phantom.dominance = static_cast<Dominance>(OneOf(fields, "dominance", DominanceNames));
  }
  phantom.ramus = fields.Flag("ramus", phantom.ramus);
  phantom.chronicOcclusion = fields.Flag("chronic_occlusion", phantom.chronicOcclusion);
  phantom.stenoses = static_cast<int>(fields.Whole("stenoses", 0, 20, phantom.stenoses));
  ReadNumbers(fields, NumbersOf(phantom));
  fields.Done();
  return phantom;
}

void MotionOf(const Json& object, const std::string& where, VesselSource& vessels)
{
  JsonFields fields(object, where);
  vessels.motion = static_cast<VesselMotion>(OneOf(fields, "model", MotionNames));
  if (vessels.motion == VesselMotion::Contraction)
  {
    ReadNumbers(fields, NumbersOf(vessels.contraction));
    if (fields.Has("twist_rad"))
    {
      vessels.contraction.twist = fields.Number("twist_rad", -0.5, 0.5);
    }
    else
    {
      vessels.contraction.twist =
        Degree * fields.Number("twist_deg", -28.0, 28.0, vessels.contraction.twist / Degree);
    }
    if (fields.Has("base_mm") != fields.Has("apex_mm"))
    {
      fields.Refuse("has only one of 'base_mm' and 'apex_mm'");
    }
    if (fields.Has("base_mm"))
    {
      vessels.contraction.base = PointOf(fields, "base_mm");
      vessels.contraction.apex = PointOf(fields, "apex_mm");
    }
  }
  fields.Done();
}

/// As it can be opened from anywhere.
std::string FullPath(const std::string& path, const std::string& folder)
{
  return path.empty() ? path : fs::absolute(fs::path(folder) / path).lexically_normal().string();
}

VesselSource VesselsOf(const Json& object, const std::string& where, const std::string& folder)
{
  VesselSource vessels;
  JsonFields fields(object, where);
  const int kinds = static_cast<int>(fields.Has("phantom")) + static_cast<int>(fields.Has("run")) +
    static_cast<int>(fields.Has("surface"));
  if (kinds != 1)
  {
    fields.Refuse("has to have one of 'phantom', 'run' and 'surface'");
  }
  if (fields.Has("phantom"))
  {
    vessels.kind = VesselSource::Kind::Phantom;
    vessels.phantom = PhantomOf(fields.Object("phantom"), where + ", phantom");
  }
  else if (fields.Has("run"))
  {
    vessels.kind = VesselSource::Kind::Run;
    vessels.path = FullPath(fields.Text("run"), folder);
  }
  else
  {
    vessels.kind = VesselSource::Kind::Surface;
    vessels.path = FullPath(fields.Text("surface"), folder);
    vessels.centerline = FullPath(fields.Text("centerline"), folder);
  }
  if (fields.Has("motion"))
  {
    MotionOf(fields.Object("motion"), where + ", motion", vessels);
  }
  if (vessels.motion == VesselMotion::Tracked && vessels.kind == VesselSource::Kind::Surface)
  {
    fields.Refuse("asks for a tracked motion, which only a run has");
  }
  fields.Done();
  return vessels;
}

Json VesselsToJson(const VesselSource& given)
{
  VesselSource vessels = given;
  Json json;
  switch (vessels.kind)
  {
    case VesselSource::Kind::Phantom:
    {
      Json phantom = WriteNumbers(NumbersOf(vessels.phantom));
      phantom["seed"] = vessels.phantom.seed;
      phantom["dominance"] = DominanceNames[static_cast<int>(vessels.phantom.dominance)];
      phantom["ramus"] = vessels.phantom.ramus;
      phantom["chronic_occlusion"] = vessels.phantom.chronicOcclusion;
      phantom["stenoses"] = vessels.phantom.stenoses;
      json["phantom"] = phantom;
      break;
    }
    case VesselSource::Kind::Run:
      json["run"] = vessels.path;
      break;
    case VesselSource::Kind::Surface:
      json["surface"] = vessels.path;
      json["centerline"] = vessels.centerline;
      break;
  }
  Json motion = Json::object();
  if (vessels.motion == VesselMotion::Contraction)
  {
    motion = WriteNumbers(NumbersOf(vessels.contraction));
    motion["twist_rad"] = vessels.contraction.twist;
    if (vessels.contraction.base != vessels.contraction.apex)
    {
      const Vector3& base = vessels.contraction.base;
      const Vector3& apex = vessels.contraction.apex;
      motion["base_mm"] = { base.x(), base.y(), base.z() };
      motion["apex_mm"] = { apex.x(), apex.y(), apex.z() };
    }
  }
  motion["model"] = MotionNames[static_cast<int>(vessels.motion)];
  json["motion"] = motion;
  return json;
}

InterventionSettings SettingsOf(const Json& object, const std::string& where)
{
  InterventionSettings settings;
  JsonFields fields(object, where);
  ReadNumbers(fields, NumbersOf(settings));
  settings.ticksPerFrame =
    static_cast<int>(fields.Whole("ticks_per_frame", 1, 1000, settings.ticksPerFrame));
  settings.capacity = static_cast<int>(fields.Whole("capacity", 20, 1000, settings.capacity));
  settings.rootBranch =
    static_cast<int>(fields.Whole("root_branch", -1, 100000, settings.rootBranch));
  settings.guideFromArch = fields.Flag("guide_from_arch", false);
  settings.branchesAnswer = fields.Flag("side_branches_answer", true);
  settings.wallTears = fields.Flag("wall_tears", true);
  fields.Done();
  try
  {
    settings.Validate();
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument(where + ": " + error.what());
  }
  return settings;
}

Json SettingsToJson(const InterventionSettings& given)
{
  InterventionSettings settings = given;
  Json json = WriteNumbers(NumbersOf(settings));
  json["ticks_per_frame"] = settings.ticksPerFrame;
  json["capacity"] = settings.capacity;
  json["root_branch"] = settings.rootBranch;
  json["side_branches_answer"] = settings.branchesAnswer;
  json["wall_tears"] = settings.wallTears;
  if (settings.guideFromArch)
  {
    json["guide_from_arch"] = true;
  }
  return json;
}

/// Degrees of the file are radians here; both are tried when reading, so that what was written gives the same bits.
double AngleOf(JsonFields& fields, const std::string& name, double most, double otherwise)
{
  const std::string exact = name + "_rad";
  if (fields.Has(exact.c_str()))
  {
    return fields.Number(exact.c_str(), -most * Degree, most * Degree);
  }
  return Degree * fields.Number((name + "_deg").c_str(), -most, most, otherwise / Degree);
}

ImagingSettings ImagingOf(const Json& object, const std::string& where, const std::string& folder)
{
  ImagingSettings imaging;
  JsonFields fields(object, where);
  imaging.background = FullPath(fields.Text("background", ""), folder);
  imaging.backgroundRun = FullPath(fields.Text("background_run", ""), folder);
  if (imaging.background.empty() && !imaging.backgroundRun.empty())
  {
    fields.Refuse("has a 'background_run' and no 'background'");
  }
  if (fields.Has("background_offset_mm"))
  {
    imaging.backgroundOffset = PointOf(fields, "background_offset_mm");
  }
  imaging.thoraxSeed = static_cast<std::uint64_t>(
    fields.Whole("thorax_seed", 0, INT32_MAX, static_cast<std::int64_t>(imaging.thoraxSeed)));
  CArmPose& pose = imaging.pose;
  const auto steepest = [](AxisKind kind) { return HandAxisTable[IndexOf(kind)].high / Degree; };
  pose.primary = AngleOf(fields, "primary", steepest(AxisKind::Primary), pose.primary);
  pose.secondary = AngleOf(fields, "secondary", steepest(AxisKind::Secondary), pose.secondary);
  pose.sourceToIsocentre =
    fields.Number("source_to_isocentre_mm", 400.0, 1200.0, pose.sourceToIsocentre);
  pose.sourceToDetector = fields.Number(
    "source_to_detector_mm", pose.sourceToIsocentre + 50.0, 1500.0, pose.sourceToDetector);
  imaging.hasIsocentre = fields.Has("isocentre_mm");
  if (imaging.hasIsocentre)
  {
    pose.isocentre = PointOf(fields, "isocentre_mm");
  }
  imaging.fieldOfView = fields.Number("field_of_view_mm", 80.0, 400.0, imaging.fieldOfView);
  imaging.columns = static_cast<int>(fields.Whole("columns", 64, 2048, imaging.columns));
  imaging.energy = fields.Number("energy_keV", 30.0, 120.0, imaging.energy);
  imaging.iodine = fields.Number("iodine_mg_mL", 0.0, 500.0, imaging.iodine);
  for (const auto& [name, rate] : { std::pair("frame_rate_hz", &imaging.frameRate),
         std::pair("cine_rate_hz", &imaging.cineRate) })
  {
    *rate = fields.Number(name, 0.0, 1000.0, *rate);
    if (*rate != 7.5 && *rate != 15.0 && *rate != 30.0)
    {
      fields.Refuse(std::string("has '") + name + "' that is none of 7.5, 15, 30");
    }
  }
  imaging.exposureControl = fields.Flag("exposure_control", imaging.exposureControl);
  imaging.heartShadowMoves = fields.Flag("heart_shadow_moves", imaging.heartShadowMoves);
  if (fields.Has("breathing"))
  {
    JsonFields breathing(fields.Object("breathing"), where + ", breathing");
    ReadNumbers(breathing, NumbersOf(imaging.breathing));
    breathing.Done();
  }
  fields.Done();
  return imaging;
}

Json ImagingToJson(const ImagingSettings& imaging)
{
  BreathingSettings breathing = imaging.breathing;
  const auto list = [](const Vector3& point) { return Json{ point.x(), point.y(), point.z() }; };
  Json json = { { "background", imaging.background }, { "background_run", imaging.backgroundRun },
    { "background_offset_mm", list(imaging.backgroundOffset) },
    { "thorax_seed", imaging.thoraxSeed }, { "primary_rad", imaging.pose.primary },
    { "secondary_rad", imaging.pose.secondary },
    { "source_to_isocentre_mm", imaging.pose.sourceToIsocentre },
    { "source_to_detector_mm", imaging.pose.sourceToDetector },
    { "field_of_view_mm", imaging.fieldOfView }, { "columns", imaging.columns },
    { "energy_keV", imaging.energy }, { "iodine_mg_mL", imaging.iodine },
    { "frame_rate_hz", imaging.frameRate }, { "cine_rate_hz", imaging.cineRate },
    { "exposure_control", imaging.exposureControl },
    { "heart_shadow_moves", imaging.heartShadowMoves },
    { "breathing", WriteNumbers(NumbersOf(breathing)) } };
  if (imaging.hasIsocentre)
  {
    json["isocentre_mm"] = list(imaging.pose.isocentre);
  }
  return json;
}

ContrastSettings ContrastOf(const Json& object, const std::string& where)
{
  ContrastSettings contrast;
  JsonFields fields(object, where);
  ReadNumbers(fields, NumbersOf(contrast));
  contrast.tracers.capacity = fields.Whole("tracers", 100, 10000000, contrast.tracers.capacity);
  contrast.guideLumen = fields.Flag("guide_lumen", false);
  fields.Done();
  try
  {
    contrast.Validate();
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument(where + ": " + error.what());
  }
  return contrast;
}

Json ContrastToJson(const ContrastSettings& given)
{
  ContrastSettings contrast = given;
  Json json = WriteNumbers(NumbersOf(contrast));
  json["tracers"] = contrast.tracers.capacity;
  if (contrast.guideLumen)
  {
    json["guide_lumen"] = true;
  }
  return json;
}

VesselLesion LesionOf(const Json& object, const std::string& where)
{
  VesselLesion lesion;
  JsonFields fields(object, where);
  lesion.vessel = fields.Text("vessel");
  lesion.place = fields.Number("at_mm", 0.0, 500.0);
  lesion.length = fields.Number("length_mm", 2.0, 60.0, lesion.length);
  lesion.degree = fields.Number("degree", 0.0, 1.0);
  lesion.calciumArc = fields.Number("calcium_arc_deg", 0.0, 360.0, 0.0);
  if (lesion.degree > 0.95 && lesion.degree < 1.0)
  {
    fields.Refuse("has 'degree' above 0.95 that is not 1, an occlusion");
  }
  if (lesion.degree < 1.0 && fields.Has("cap_MPa"))
  {
    fields.Refuse("has 'cap_MPa', which only an occlusion has ('degree' 1)");
  }
  lesion.strength = fields.Number("cap_MPa", 0.1, 100.0, lesion.strength);
  fields.Done();
  return lesion;
}

const char* const IncidentNames[] = { "spasm", "air" };
const char* const WhenNames[] = { "called", "time", "injection", "inflation", "wire_in" };

Incident IncidentOf(const Json& object, const std::string& where)
{
  Incident incident;
  JsonFields fields(object, where);
  incident.kind = static_cast<Incident::Kind>(OneOf(fields, "event", IncidentNames));
  if (fields.Has("when"))
  {
    incident.when = static_cast<Incident::When>(OneOf(fields, "when", WhenNames));
  }
  if (incident.when == Incident::When::Time)
  {
    incident.at = fields.Number("at_s", 0.0, 36000.0);
  }
  const bool spasm = incident.kind == Incident::Kind::Spasm;
  incident.vessel = spasm || incident.when == Incident::When::WireIn ? fields.Text("vessel")
                                                                     : fields.Text("vessel", "");
  if (spasm)
  {
    incident.narrowing = fields.Number("narrowing", 0.1, 0.98, incident.narrowing);
    incident.onset = fields.Number("onset_s", 0.5, 60.0, incident.onset);
  }
  else
  {
    incident.volume = fields.Number("air_mL", 0.01, 5.0, incident.volume);
  }
  fields.Done();
  return incident;
}

Json IncidentToJson(const Incident& incident)
{
  Json json = { { "event", IncidentNames[static_cast<int>(incident.kind)] },
    { "when", WhenNames[static_cast<int>(incident.when)] } };
  if (incident.when == Incident::When::Time)
  {
    json["at_s"] = incident.at;
  }
  if (!incident.vessel.empty())
  {
    json["vessel"] = incident.vessel;
  }
  if (incident.kind == Incident::Kind::Spasm)
  {
    json["narrowing"] = incident.narrowing;
    json["onset_s"] = incident.onset;
  }
  else
  {
    json["air_mL"] = incident.volume;
  }
  return json;
}

ProcedureStep StepOf(const Json& object, const std::string& where)
{
  ProcedureStep step;
  JsonFields fields(object, where);
  step.text = fields.Text("text");
  const std::string name = fields.Text("goal");
  const GoalName* goal = std::find_if(std::begin(GoalNames), std::end(GoalNames),
    [&](const GoalName& one) { return name == one.name; });
  if (goal == std::end(GoalNames))
  {
    std::string list;
    for (const GoalName& one : GoalNames)
    {
      list += (list.empty() ? "" : ", ") + std::string(one.name);
    }
    fields.Refuse("has 'goal': '" + name.substr(0, 60) + "' is none of " + list);
  }
  step.goal = goal->goal;
  const bool ofWire =
    step.goal == ProcedureStep::Goal::WireIn || step.goal == ProcedureStep::Goal::WireBack;
  step.wire = ofWire && fields.Has("wire") ? static_cast<int>(fields.Whole("wire", 0, 1, 0)) : -1;
  step.vessel =
    step.goal == ProcedureStep::Goal::WireIn || step.goal == ProcedureStep::Goal::SideBranchOpen
    ? fields.Text("vessel")
    : step.goal == ProcedureStep::Goal::Angiogram || step.goal == ProcedureStep::Goal::WireBack ||
      step.goal == ProcedureStep::Goal::GuideIn || step.goal == ProcedureStep::Goal::WireTaken ||
      step.goal == ProcedureStep::Goal::BalloonTaken ||
      step.goal == ProcedureStep::Goal::LeakStopped || step.goal == ProcedureStep::Goal::LeakSealed
    ? ""
    : fields.Text("vessel", "");
  if (goal->value)
  {
    step.value = fields.Number(goal->value, goal->low, goal->high);
  }
  fields.Done();
  return step;
}

Json StepToJson(const ProcedureStep& step)
{
  const char* value = nullptr;
  Json json = { { "text", step.text }, { "goal", NameOf(step.goal, value) } };
  if (!step.vessel.empty())
  {
    json["vessel"] = step.vessel;
  }
  if (value)
  {
    json[value] = step.value;
  }
  if (step.wire >= 0)
  {
    json["wire"] = step.wire;
  }
  return json;
}

bool StartsWith(const std::string& text, const char* start)
{
  return text.rfind(start, 0) == 0;
}

/// Names of the segments that an artery can begin with, as SegmentName() has them.
bool BeginsArtery(const std::string& name, const std::string& artery)
{
  if (artery == "RCA")
  {
    return StartsWith(name, "pRCA") || StartsWith(name, "RCA");
  }
  return StartsWith(name, "LM") || StartsWith(name, "LCA") || StartsWith(name, "pLAD") ||
    StartsWith(name, "pLCx");
}
}

bool SamePatient(const ImagingSettings& a, const ImagingSettings& b)
{
  return a.background == b.background && a.backgroundRun == b.backgroundRun &&
    a.backgroundOffset == b.backgroundOffset && a.thoraxSeed == b.thoraxSeed &&
    a.energy == b.energy;
}

const char* NameOf(ProcedureStep::Goal goal, const char*& value)
{
  for (const GoalName& one : GoalNames)
  {
    if (one.goal == goal)
    {
      value = one.value;
      return one.name;
    }
  }
  throw std::logic_error("a goal has no name");
}

Scenario ScenarioFromText(
  const std::string& text, const std::string& origin, const std::string& folder)
{
  const Json json = ParseBoundedJson(text, origin);
  JsonFields fields(json, origin);
  fields.RequireFormat("dynamiccoronary scenario", "scenario");
  Scenario scenario;
  scenario.name = fields.Text("name");
  scenario.description = fields.Text("description", "");
  scenario.vessels = VesselsOf(fields.Object("vessels"), origin + ", vessels", folder);
  static const char* const arteries[] = { "LCA", "RCA", "any" };
  scenario.artery = arteries[OneOf(fields, "artery", arteries)];
  InstrumentCatalogue own;
  const InstrumentCatalogue* catalogue = &BuiltInCatalogue();
  if (fields.Has("catalogue"))
  {
    own = ReadCatalogue(FullPath(fields.Text("catalogue"), folder));
    catalogue = &own;
  }
  const auto named = [&](const std::string& name, const auto& find)
  {
    try
    {
      return find(name);
    }
    catch (const std::invalid_argument& error)
    {
      throw std::invalid_argument(origin + ": " + error.what());
    }
  };
  const auto byName = [&](const char* what, const auto& find)
  { return named(fields.Text(what), find); };
  const auto wireOf = [&](const Json& entry)
  {
    return entry.is_string()
      ? named(entry.get<std::string>(),
          [&](const std::string& name) { return catalogue->Wire(name).wire; })
      : WireFromJson(entry, origin).wire;
  };
  const Json none = Json::array();
  scenario.wire = wireOf(fields.Any("wire"));
  for (const Json& entry : fields.Has("wire_exchanges") ? fields.List("wire_exchanges") : none)
  {
    scenario.wireExchanges.push_back(wireOf(entry));
  }
  if (fields.Has("second_wire"))
  {
    scenario.secondWire = wireOf(fields.Any("second_wire"));
  }
  scenario.catheter = fields.Any("catheter").is_string()
    ? byName(
        "catheter", [&](const std::string& name) { return catalogue->Catheter(name).catheter; })
    : CatheterFromJson(fields.Object("catheter"), origin).catheter;
  const auto balloonOf = [&](const Json& entry)
  {
    return entry.is_string()
      ? named(entry.get<std::string>(),
          [&](const std::string& name) { return catalogue->Balloon(name).balloon; })
      : BalloonFromJson(entry, origin).balloon;
  };
  if (fields.Has("balloon"))
  {
    scenario.balloon = balloonOf(fields.Any("balloon"));
  }
  for (const Json& entry : fields.Has("exchanges") ? fields.List("exchanges") : none)
  {
    scenario.exchanges.push_back(balloonOf(entry));
  }
  if (!scenario.exchanges.empty() && !scenario.balloon)
  {
    fields.Refuse("has 'exchanges' without a 'balloon' that they are for");
  }
  for (const Json& entry : fields.Has("lesions") ? fields.List("lesions") : none)
  {
    scenario.lesions.push_back(
      LesionOf(entry, origin + ", lesion " + std::to_string(scenario.lesions.size() + 1)));
  }
  for (const Json& entry : fields.Has("events") ? fields.List("events") : none)
  {
    scenario.incidents.push_back(
      IncidentOf(entry, origin + ", event " + std::to_string(scenario.incidents.size() + 1)));
  }
  for (const Json& entry : fields.Has("procedure") ? fields.List("procedure") : none)
  {
    scenario.procedure.push_back(
      StepOf(entry, origin + ", step " + std::to_string(scenario.procedure.size() + 1)));
  }
  for (const ProcedureStep& step : scenario.procedure)
  {
    const bool taken = step.goal == ProcedureStep::Goal::WireTaken;
    if (taken && !WireOf(scenario, static_cast<std::size_t>(step.value)))
    {
      fields.Refuse("has a step '" + step.text + "' that takes a wire that it has not");
    }
    const bool changed = step.goal == ProcedureStep::Goal::BalloonTaken;
    if (changed && !BalloonOf(scenario, static_cast<std::size_t>(step.value)))
    {
      fields.Refuse("has a step '" + step.text + "' that takes a balloon that it has not");
    }
    if (step.wire > 0 && !scenario.secondWire)
    {
      fields.Refuse("has a step '" + step.text + "' for a second wire, and no 'second_wire'");
    }
  }
  const auto part = [&](const char* name)
  { return fields.Has(name) ? fields.Object(name) : Json::object(); };
  scenario.settings = SettingsOf(part("settings"), origin + ", settings");
  scenario.heartRateOfVessels = !part("settings").contains("heart_rate_bpm");
  scenario.imaging = ImagingOf(part("imaging"), origin + ", imaging", folder);
  scenario.contrast = ContrastOf(part("contrast"), origin + ", contrast");
  scenario.seed =
    static_cast<std::uint64_t>(fields.Whole("seed", 0, static_cast<std::int64_t>(MaximumSeed), 1));
  fields.Done();
  return scenario;
}

Scenario RecordedScenario(const std::string& text, const std::string& origin)
{
  Json json = ParseBoundedJson(text, origin);
  if (json.is_object() && json.contains("imaging") && json["imaging"].is_object())
  {
    const Json before = { { "exposure_control", false }, { "heart_shadow_moves", false },
      { "breathing", { { "rate_per_min", 0.0 }, { "amplitude_mm", 0.0 } } } };
    for (const auto& [key, value] : before.items())
    {
      json["imaging"].emplace(key, value);
    }
  }
  if (json.is_object() && json.contains("settings") && json["settings"].is_object())
  {
    json["settings"].emplace("side_branches_answer", false);
    json["settings"].emplace("wall_tears", false);
  }
  return ScenarioFromText(json.dump(), origin, ".");
}

std::string ScenarioText(const Scenario& scenario)
{
  Json json = { { "format", "dynamiccoronary scenario" }, { "version", 1 },
    { "name", scenario.name }, { "description", scenario.description },
    { "vessels", VesselsToJson(scenario.vessels) }, { "artery", scenario.artery },
    { "wire", WireToJson(scenario.wire) }, { "catheter", CatheterToJson(scenario.catheter) },
    { "settings", SettingsToJson(scenario.settings) },
    { "imaging", ImagingToJson(scenario.imaging) },
    { "contrast", ContrastToJson(scenario.contrast) }, { "seed", scenario.seed } };
  if (scenario.heartRateOfVessels)
  {
    json["settings"].erase("heart_rate_bpm");
  }
  for (const Guidewire& wire : scenario.wireExchanges)
  {
    json["wire_exchanges"].push_back(WireToJson(wire));
  }
  if (scenario.secondWire)
  {
    json["second_wire"] = WireToJson(*scenario.secondWire);
  }
  if (scenario.balloon)
  {
    json["balloon"] = BalloonToJson(*scenario.balloon);
  }
  for (const BalloonCatheter& balloon : scenario.exchanges)
  {
    json["exchanges"].push_back(BalloonToJson(balloon));
  }
  for (const VesselLesion& lesion : scenario.lesions)
  {
    json["lesions"].push_back(
      { { "vessel", lesion.vessel }, { "at_mm", lesion.place }, { "length_mm", lesion.length },
        { "degree", lesion.degree }, { "calcium_arc_deg", lesion.calciumArc } });
    if (lesion.degree == 1.0)
    {
      json["lesions"].back()["cap_MPa"] = lesion.strength;
    }
  }
  for (const Incident& incident : scenario.incidents)
  {
    json["events"].push_back(IncidentToJson(incident));
  }
  for (const ProcedureStep& step : scenario.procedure)
  {
    json["procedure"].push_back(StepToJson(step));
  }
  return json.dump(2) + "\n";
}

const BalloonCatheter* BalloonOf(const Scenario& scenario, std::size_t number)
{
  if (number == 0)
  {
    return scenario.balloon ? &*scenario.balloon : nullptr;
  }
  return number <= scenario.exchanges.size() ? &scenario.exchanges[number - 1] : nullptr;
}

const Guidewire* WireOf(const Scenario& scenario, std::size_t number)
{
  if (number == 0)
  {
    return &scenario.wire;
  }
  if (number <= scenario.wireExchanges.size())
  {
    return &scenario.wireExchanges[number - 1];
  }
  const bool second = number == scenario.wireExchanges.size() + 1 && scenario.secondWire;
  return second ? &*scenario.secondWire : nullptr;
}

std::vector<BuiltInScenario> BuiltInScenarios()
{
  std::vector<BuiltInScenario> list;
  for (const embedded::NamedText* one = embedded::Scenarios; one->name; ++one)
  {
    const std::string where = std::string("The built-in scenario '") + one->name + "'";
    const Json json = ParseBoundedJson(one->text, where);
    JsonFields fields(json, where);
    list.push_back({ one->name, fields.Text("description") });
  }
  return list;
}

Scenario LoadScenario(const std::string& name)
{
  std::string names;
  for (const embedded::NamedText* one = embedded::Scenarios; one->name; ++one)
  {
    if (name == one->name)
    {
      return ScenarioFromText(
        one->text, std::string("The built-in scenario '") + one->name + "'", ".");
    }
    names += (names.empty() ? "" : ", ") + std::string(one->name);
  }
  std::error_code ignored;
  if (!fs::is_regular_file(name, ignored))
  {
    throw std::runtime_error("'" + name +
      "' is neither a scenario file nor a built-in scenario; built in are " + names + ".");
  }
  const std::string folder = fs::path(name).parent_path().string();
  return ScenarioFromText(
    ReadTextFile(name, "a scenario"), "'" + name + "'", folder.empty() ? "." : folder);
}

int RootBranch(const WallTopology& topology, const std::string& artery)
{
  std::string roots;
  for (std::size_t n = 0; n < topology.axis.size(); ++n)
  {
    if (n < topology.parent.size() && topology.parent[n] >= 0)
    {
      continue;
    }
    const std::string name = n < topology.groupName.size() ? topology.groupName[n] : "";
    if (artery == "any" || BeginsArtery(name, artery))
    {
      return static_cast<int>(n);
    }
    roots += (roots.empty() ? "'" : ", '") + (name.empty() ? std::to_string(n) : name) + "'";
  }
  throw std::invalid_argument("The vessels have no root of the " + artery + "; their roots are " +
    (roots.empty() ? "none" : roots) + ".");
}
}
