#include "RunSettings.h"

#include "BoundedJson.h"
#include "Command.h"
#include "OptionChecks.h"
#include "TextFile.h"
#include "vtkMovingMesh.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;

CLI::Validator OneOf(const std::vector<std::string>& names)
{
  std::string list;
  for (const std::string& name : names)
  {
    list += (list.empty() ? "" : ", ") + name;
  }
  return CLI::Validator(
    [names, list](std::string& text)
    {
      return std::find(names.begin(), names.end(), text) != names.end()
        ? std::string()
        : "'" + text + "' is none of " + list;
    },
    "");
}

[[noreturn]] void Refuse(const std::string& where, const std::string& what)
{
  throw std::runtime_error(where + " " + what + ".");
}

void CheckValue(const CLI::Validator& check, std::string text, const std::string& where)
{
  const std::string complaint = check(text);
  if (!complaint.empty())
  {
    Refuse(where + ":", complaint);
  }
}

Json NumberOrNull(double value)
{
  return std::isnan(value) ? Json() : Json(value);
}
}

const std::vector<std::string>& RunStageNames()
{
  static const std::vector<std::string> names = { "vesselness", "segmentation", "centerline",
    "surface", "volume", "weights", "motion" };
  return names;
}

RunStage RunSettings::Until() const
{
  const auto& names = RunStageNames();
  return static_cast<RunStage>(std::find(names.begin(), names.end(), this->until) - names.begin());
}

/// Declares options one after the other; what follows Add() is about the one that it added.
class RunOptions::Declaration
{
public:
  Declaration(RunOptions& options, CLI::App& app)
    : Options(options)
    , App(app)
  {
  }

  /// Of the options that follow. @param stage  that they change; none: it is -1
  void Begin(const std::string& group, int stage)
  {
    this->Group = group;
    this->Stage = stage;
  }
  void Begin(const std::string& group, RunStage stage)
  {
    this->Begin(group, static_cast<int>(stage));
  }

  /// @param type  of the value in the help; empty: the option's own
  template <typename Variable>
  Declaration& Add(const std::string& option, const std::string& name, Variable& value,
    const std::string& type, const std::string& help)
  {
    Setting setting;
    setting.name = name;
    setting.value = &value;
    setting.stage = this->Stage;
    if constexpr (std::is_same_v<Variable, bool>)
    {
      setting.option = this->App.add_flag(option, value, help);
    }
    else
    {
      setting.option = this->App.add_option(option, value, help);
    }
    if (!this->Group.empty())
    {
      setting.option->group(this->Group);
    }
    if (!type.empty())
    {
      setting.option->type_name(type);
    }
    this->Options.List.push_back(setting);
    return *this;
  }

  Declaration& ChangesNothing() { return this->Change(&Setting::stage, -1); }

  Declaration& Check(const CLI::Validator& validator)
  {
    this->Last().check = validator;
    this->Option().check(validator);
    return *this;
  }
  Declaration& Between(double low, double high) { return this->Check(Within(low, high)); }

  /// Two values.
  Declaration& Pair()
  {
    this->Option().expected(2);
    return this->Change(&Setting::count, 2);
  }

  /// Values with commas, or none.
  Declaration& Commas()
  {
    this->Option().delimiter(',')->allow_extra_args(false);
    return this->Optional();
  }

  /// Three values, or several times three, or none.
  Declaration& Points()
  {
    this->Option().type_size(3)->expected(1, 100000)->allow_extra_args(false);
    return this->Change(&Setting::points, true).Optional();
  }

  Declaration& Optional() { return this->Change(&Setting::optional, true); }

  Declaration& ShowDefault()
  {
    this->Option().capture_default_str();
    return *this;
  }

  CLI::Option& Option() { return *this->Last().option; }

private:
  Setting& Last() { return this->Options.List.back(); }

  template <typename Member, typename Value>
  Declaration& Change(Member Setting::*member, const Value& value)
  {
    this->Last().*member = value;
    return *this;
  }

  RunOptions& Options;
  CLI::App& App;
  std::string Group;
  int Stage = -1;
};

RunOptions::RunOptions(CLI::App& app, RunSettings& settings)
  : Settings(settings)
{
  Declaration all(*this, app);
  this->DeclareImages(all);
  this->DeclareVessels(all);
  this->DeclareModel(all);
  this->DeclareMotion(all);
}

void RunOptions::DeclareImages(Declaration& all)
{
  RunSettings& settings = this->Settings;
  all.Begin("", -1);
  all.Add("PATH,--input", "input", settings.input, "PATH",
    "A folder of DICOM files, a series.json, a 4-D volume, or one volume a phase; or a closed "
    "surface: .vtp, .vtu, .obj, .off, .mesh, .stl or .ply");
  all.Add("--output", "output", settings.output, "DIR",
    "Folder to write to; made when it does not exist");
  all
    .Add("--until", "until", settings.until, "STAGE",
      "Last stage: vesselness, segmentation, centerline, surface, volume, weights or motion")
    .Check(OneOf(RunStageNames()))
    .ShowDefault();

  all.Begin("Image", RunStage::Vesselness);
  all
    .Add("--time", "time", settings.time, "FRACTION",
      "Reference time, fraction of the R-R interval: the nearest phase is taken. Without it, "
      "the quietest phase is found")
    .Between(-100.0, 100.0)
    .Optional();
  all
    .Add("--fractions", "fractions", settings.fractions, "LIST",
      "R-R fractions of the phases, instead of those in the files: 0,0.35,0.75")
    .Between(-100.0, 100.0)
    .Commas();
  all
    .Add("--cycle-ms", "cycle_ms", settings.cycleMs, "MS",
      "R-R interval, in ms, for files that do not give it")
    .Between(1.0, 60000.0)
    .ShowDefault();
  all.Add("--series", "series", settings.series, "UID",
    "The DICOM series to read from a folder with several");
}

void RunOptions::DeclareVessels(Declaration& all)
{
  RunSettings& settings = this->Settings;
  all.Begin("Vessels", RunStage::Vesselness);
  all
    .Add("--scales", "scales", settings.scales, "MIN MAX",
      "Smallest and largest scale of the vesselness, mm")
    .Between(0.05, 50.0)
    .Pair()
    .ShowDefault();
  all
    .Add("--c", "c", settings.c, "HU",
      "Norm of the Hessian from which on structure counts, HU; 0: half the largest one")
    .Between(0.0, 1e6)
    .ShowDefault();
  all.Begin("Vessels", RunStage::Segmentation);
  all
    .Add("--seed", "seed", settings.seeds, "X Y Z",
      "A point in a vessel or on its ostium, LPS mm; may be repeated. "
      "Without any, aorta and ostia, or the widest ends of a surface, are looked for")
    .Between(-1e5, 1e5)
    .Points();
  all.Add("--seed-file", "seed_file", settings.seedFile, "FILE",
    "Points in vessels or on ostia as markups of 3D Slicer (.mrk.json), beside those of --seed");
  all.Add("--mask", "mask", settings.mask, "FILE",
    "Mask of the vessels in the reference phase, instead of segmenting it: a .seg.nrrd of 3D "
    "Slicer, or "
    "another volume. With it of several phases --time. Without it, that of a series.json");
  all
    .Add("--mask-segment", "mask_segments", settings.maskSegments, "NAME",
      "Name or ID of a segment of the mask; may be repeated. Without any, all of them")
    .Option()
    .allow_extra_args(false);
  all
    .Add("--largest-radius", "largest_radius", settings.maximumRadius, "MM",
      "Blood that a ball of this radius fits into is aorta or chamber, mm")
    .Between(1.0, 50.0)
    .ShowDefault();
  all
    .Add("--window", "window", settings.window, "TISSUE BLOOD",
      "Image values of tissue and of undiluted blood, instead of measuring them")
    .Between(-1e5, 1e5)
    .Pair()
    .Optional();

  all.Begin("Centerlines", RunStage::Centerline);
  all.Add("--beyond-mask", "beyond_mask", settings.beyondMask, "",
    "March wherever a vessel is to be seen, not only inside the segmented lumen: some thin "
    "vessels are followed farther, at the risk of others' lumens, and slower");
  all
    .Add("--least-branch", "least_branch", settings.minimumBranch, "MM",
      "Shorter branches are none, mm; 0: ten voxels")
    .Between(0.0, 1000.0)
    .ShowDefault();
  all
    .Add("--centerline-steps", "centerline_steps", settings.centerlineSteps, "N",
      "After so many points on paths back from possible tips the trees are written as far "
      "as they are found: a limit of work, the same on any machine")
    .Check(WholeWithin(1, 2000000000))
    .ShowDefault();
  all.Add("!--no-labels", "labels", settings.labels, "",
    "Give the segments no names: for trees that are not coronary");
  all
    .Add("--partial", "partial", settings.partial, "",
      "Go on when a tree is lost: an ostium that was not found, a seed from which no vessel was "
      "followed. Without it the run ends there")
    .ChangesNothing();
}

void RunOptions::DeclareModel(Declaration& all)
{
  RunSettings& settings = this->Settings;
  all.Begin("Surface", RunStage::Surface);
  all
    .Add("--surface", "surface", settings.surface, "KIND",
      "Of an input that is a surface: swept along its centerlines, or given, as it is but for "
      "repairs")
    .Check(OneOf({ "swept", "given" }))
    .ShowDefault();
  all
    .Add("--edges", "edges", settings.edges, "MIN MAX",
      "Length of the triangles' edges where the wall is most curved and where it is "
      "flat, mm")
    .Between(0.001, 100.0)
    .Pair()
    .ShowDefault();
  all.Add("--contours", "contours", settings.contours, "",
    "Cross-sections as the image shows them, instead of round ones");
  all.Add("--open-ends", "open_ends", settings.openEnds, "",
    "Inlets and outlets without caps; with --until surface");

  all.Begin("Weights", RunStage::Weights);
  all
    .Add("--weight-cache", "weight_cache", settings.weightCache, "DIR",
      "Folder in which skin weights are kept; the same mesh, bones and settings are read from "
      "there")
    .ChangesNothing();
  all.Add("--leave-bones-outside", "leave_bones_outside", settings.leaveBonesOutside, "",
    "Leave out bones that lie wholly outside of the mesh, with a warning, instead of failing");
}

void RunOptions::DeclareMotion(Declaration& all)
{
  RunSettings& settings = this->Settings;
  all.Begin("Motion", RunStage::Motion);
  all
    .Add("--temporal-window-ms", "temporal_window_ms", settings.temporalWindowMs, "MS",
      "Time over which an image was taken, ms: half a turn of the gantry, a quarter with two "
      "sources")
    .Between(0.0, 1000.0)
    .ShowDefault();
  all
    .Add("--motion", "motion", settings.motion, "KIND",
      "tracked: through the phases; population: the mean motion of a population, not of this "
      "patient, bent to what phases there are; none: at rest; automatic: tracked from four phases "
      "on, else population")
    .Check(OneOf({ "automatic", "tracked", "population", "none" }))
    .ShowDefault();
  all
    .Add("--heart-rate", "heart_rate", settings.heartRate, "BPM",
      "Beats a minute of the population motion; without it, that of the series")
    .Between(30.0, 180.0)
    .Optional();
  all
    .Add("--motion-amplitude", "motion_amplitude", settings.motionAmplitude, "FACTOR",
      "Factor on the amplitudes of the population motion")
    .Between(0.0, 2.0)
    .ShowDefault();
  all
    .Add("--tracked", "tracked", settings.tracked, "PHASES",
      "Phases that are tracked: all, or even, every other one, and the others are interpolated")
    .Check(OneOf({ "all", "even" }))
    .ShowDefault();
  all
    .Add("--moments", "moments", settings.moments, "LIST",
      "R-R fractions at which the moved meshes are written; without it, at the phases "
      "of the series")
    .Between(-100.0, 100.0)
    .Commas();
  all
    .Add("--interpolation", "interpolation", settings.interpolation, "MODE",
      "Between the tracked phases: linear, cubic or low-noise")
    .Check(OneOf(InterpolationModes()))
    .ShowDefault();
  all.Add("!--no-limits", "limits", settings.limits, "",
    "Take the tracked motion as it is, neither smoothed where it is known badly nor kept within "
    "limits of bending, "
    "strain and steps");

  all.Begin("", -1);
  all.Add("--compress", "compress", settings.compress, "", "Compress the image files");
  all.Add("--threads", "threads", settings.threads, "N", "Number of threads; 0: all cores")
    .Check(WholeWithin(0, 1024))
    .ShowDefault();
  all.Add("--quiet", "quiet", settings.quiet, "", "No progress and no summary");
}

void RunOptions::Assign(Setting& setting, const Json& value, const std::string& where)
{
  if (auto* const* flag = std::get_if<bool*>(&setting.value))
  {
    if (!value.is_boolean())
    {
      Refuse(where, "must be true or false, not " + value.dump());
    }
    **flag = value.get<bool>();
  }
  else if (auto* const* whole = std::get_if<int*>(&setting.value))
  {
    if (!value.is_number_integer())
    {
      Refuse(where, "must be a whole number, not " + value.dump());
    }
    CheckValue(setting.check, value.dump(), where);
    **whole = value.get<int>();
  }
  else if (auto* const* number = std::get_if<double*>(&setting.value))
  {
    if (value.is_null() && setting.optional)
    {
      **number = std::numeric_limits<double>::quiet_NaN();
      return;
    }
    if (!value.is_number())
    {
      Refuse(where, "must be a number, not " + value.dump());
    }
    CheckValue(setting.check, value.dump(), where);
    **number = value.get<double>();
  }
  else if (auto* const* text = std::get_if<std::string*>(&setting.value))
  {
    if (!value.is_string())
    {
      Refuse(where, "must be a text, not " + value.dump());
    }
    CheckValue(setting.check, value.get<std::string>(), where);
    **text = value.get<std::string>();
  }
  else if (auto* const* texts = std::get_if<std::vector<std::string>*>(&setting.value))
  {
    if (!value.is_array() ||
      !std::all_of(value.begin(), value.end(), [](const Json& one) { return one.is_string(); }))
    {
      Refuse(where, "must be a list of texts, not " + value.dump());
    }
    **texts = value.get<std::vector<std::string>>();
  }
  else
  {
    auto& numbers = *std::get<std::vector<double>*>(setting.value);
    std::vector<double> read;
    const auto take = [&](const Json& one)
    {
      if (!one.is_number())
      {
        Refuse(where, "must be a list of numbers, not " + value.dump());
      }
      CheckValue(setting.check, one.dump(), where);
      read.push_back(one.get<double>());
    };
    if (!value.is_array())
    {
      Refuse(where, "must be a list, not " + value.dump());
    }
    for (const Json& one : value)
    {
      if (!setting.points)
      {
        take(one);
        continue;
      }
      if (!one.is_array() || one.size() != 3)
      {
        Refuse(where, "must be a list of points [x, y, z], not " + value.dump());
      }
      std::for_each(one.begin(), one.end(), take);
    }
    if (setting.count > 0 && static_cast<int>(read.size()) != setting.count &&
      !(setting.optional && read.empty()))
    {
      Refuse(where, "must have " + std::to_string(setting.count) + " numbers, not " + value.dump());
    }
    numbers = read;
  }
}

void RunOptions::Read(const std::string& path)
{
  const Json json = ParseBoundedJson<Json>(ReadTextFile(path, "settings"), "'" + path + "'");
  if (!json.is_object())
  {
    throw std::runtime_error("'" + path + "' is not a JSON object of settings.");
  }
  this->Take(json, "'" + path + "'");
}

void RunOptions::Take(const Json& json, const std::string& place)
{
  for (const auto& item : json.items())
  {
    const std::string where = std::string(place).append(": '").append(item.key()).append("'");
    const Json& value = item.value();
    const auto found = std::find_if(this->List.begin(), this->List.end(),
      [&](const Setting& setting) { return setting.name == item.key(); });
    if (found == this->List.end())
    {
      Refuse(where, "is no setting of run; --print-settings shows all of them");
    }
    if (found->option->count() == 0)
    {
      Assign(*found, value, where);
      continue;
    }
    // What is wrong is said even when the command line has another value.
    std::visit(
      [&](auto* variable)
      {
        auto copy = *variable;
        Setting setting = *found;
        setting.value = &copy;
        Assign(setting, value, where);
      },
      found->value);
  }
}

void RunOptions::Check() const
{
  const RunSettings& s = this->Settings;
  if (s.scales[0] > s.scales[1])
  {
    throw UsageError("--scales: the first must not be above the second");
  }
  if (!s.window.empty() && s.window[0] >= s.window[1])
  {
    throw UsageError("--window: blood must be above tissue");
  }
  if (s.edges[0] > s.edges[1])
  {
    throw UsageError("--edges: the first must not be above the second");
  }
  if (s.openEnds && s.Until() >= RunStage::Volume)
  {
    throw UsageError("--open-ends: tetrahedra need a closed surface; it goes with --until surface");
  }
  if (s.openEnds && s.surface == "given")
  {
    throw UsageError("--open-ends: a given surface is closed");
  }
  if (s.seeds.size() % 3 != 0)
  {
    throw UsageError("--seed: three coordinates are needed for each point");
  }
}

nlohmann::ordered_json RunOptions::All() const
{
  Json all = Json::object();
  for (const Setting& setting : this->List)
  {
    Json& value = all[setting.name];
    std::visit(
      [&](const auto* variable)
      {
        using Type = std::decay_t<decltype(*variable)>;
        if constexpr (std::is_same_v<Type, double>)
        {
          value = NumberOrNull(*variable);
        }
        else if constexpr (std::is_same_v<Type, std::vector<double>>)
        {
          value = Json::array();
          const std::size_t step = setting.points ? 3 : 1;
          for (std::size_t n = 0; n + step <= variable->size(); n += step)
          {
            value.push_back(setting.points
                ? Json{ (*variable)[n], (*variable)[n + 1], (*variable)[n + 2] }
                : Json((*variable)[n]));
          }
        }
        else
        {
          value = *variable;
        }
      },
      setting.value);
  }
  return all;
}

std::vector<std::string> RunOptions::NamesOf(RunStage stage) const
{
  std::vector<std::string> names;
  for (const Setting& setting : this->List)
  {
    if (setting.stage == static_cast<int>(stage))
    {
      names.push_back(setting.name);
    }
  }
  return names;
}

std::vector<std::string> FindRunInput(std::vector<std::string> input, const std::string& run)
{
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path folder = fs::weakly_canonical(fs::absolute(run, error), error);
  for (std::string& path : input)
  {
    if (fs::exists(path, error) || fs::path(path).is_absolute())
    {
      continue;
    }
    fs::path above = folder;
    while (above.has_relative_path())
    {
      above = above.parent_path();
      if (fs::exists(above / path, error))
      {
        path = (above / path).string();
        break;
      }
    }
  }
  return input;
}
}
