#include "RunSettings.h"

#include "BoundedJson.h"
#include "Command.h"
#include "OptionChecks.h"
#include "TextFile.h"
#include "vtkMovingMesh.h"

#include <algorithm>
#include <cmath>
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

Json Number(double value)
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

RunOptions::Setting& RunOptions::Add(CLI::App& app, const std::string& group,
  const std::string& option, const std::string& name, Value value, const std::string& help)
{
  Setting setting;
  setting.name = name;
  setting.value = value;
  if (auto* const* flag = std::get_if<bool*>(&value))
  {
    setting.option = app.add_flag(option, **flag, help);
  }
  else
  {
    std::visit(
      [&](auto* variable)
      {
        if constexpr (!std::is_same_v<decltype(variable), bool*>)
        {
          setting.option = app.add_option(option, *variable, help);
        }
      },
      value);
  }
  if (!group.empty())
  {
    setting.option->group(group);
  }
  this->List.push_back(setting);
  return this->List.back();
}

RunOptions::RunOptions(CLI::App& app, RunSettings& settings)
  : Settings(settings)
{
  const auto add = [&](const char* group, const char* option, const char* name, auto& value,
                     const char* type, const char* help, int stage) -> Setting&
  {
    Setting& setting = this->Add(app, group, option, name, Value(&value), help);
    setting.stage = stage;
    if (*type != '\0')
    {
      setting.option->type_name(type);
    }
    return setting;
  };
  const auto check = [](Setting& setting, const CLI::Validator& validator)
  {
    setting.check = validator;
    setting.option->check(validator);
  };
  const auto between = [&](Setting& setting, double low, double high) -> Setting&
  {
    check(setting, Within(low, high));
    return setting;
  };
  const auto pair = [](Setting& setting)
  {
    setting.count = 2;
    setting.option->expected(2);
  };
  const auto list = [](Setting& setting)
  {
    setting.optional = true;
    setting.option->delimiter(',')->allow_extra_args(false);
  };
  constexpr int none = -1;
  constexpr int vesselness = static_cast<int>(RunStage::Vesselness);
  constexpr int segmentation = static_cast<int>(RunStage::Segmentation);
  constexpr int centerline = static_cast<int>(RunStage::Centerline);
  constexpr int surface = static_cast<int>(RunStage::Surface);
  constexpr int weights = static_cast<int>(RunStage::Weights);
  constexpr int motion = static_cast<int>(RunStage::Motion);

  add("", "PATH,--input", "input", settings.input, "PATH",
    "A folder of DICOM files, a series.json, a 4-D volume, or one volume a phase; or a closed "
    "surface: .vtp, .vtu, .obj, .off, .mesh, .stl or .ply",
    none);
  add("", "--output", "output", settings.output, "DIR",
    "Folder to write to; made when it does not exist", none);
  check(
    add("", "--until", "until", settings.until, "STAGE",
      "Last stage: vesselness, segmentation, centerline, surface, volume, weights or motion", none),
    OneOf(RunStageNames()));
  this->List.back().option->capture_default_str();

  const char* group = "Image";
  between(add(group, "--time", "time", settings.time, "FRACTION",
            "Reference time, fraction of the R-R interval: the nearest phase is taken. Without it, "
            "the quietest phase is found",
            vesselness),
    -100.0, 100.0)
    .optional = true;
  list(between(
    add(group, "--fractions", "fractions", settings.fractions, "LIST",
      "R-R fractions of the phases, instead of those in the files: 0,0.35,0.75", vesselness),
    -100.0, 100.0));
  between(add(group, "--cycle-ms", "cycle_ms", settings.cycleMs, "MS",
            "R-R interval, in ms, for files that do not give it", vesselness),
    1.0, 60000.0)
    .option->capture_default_str();
  add(group, "--series", "series", settings.series, "UID",
    "The DICOM series to read from a folder with several", vesselness);

  group = "Vessels";
  pair(between(add(group, "--scales", "scales", settings.scales, "MIN MAX",
                 "Smallest and largest scale of the vesselness, mm", vesselness),
    0.05, 50.0));
  this->List.back().option->capture_default_str();
  between(add(group, "--c", "c", settings.c, "HU",
            "Norm of the Hessian from which on structure counts, HU; 0: half the largest one",
            vesselness),
    0.0, 1e6)
    .option->capture_default_str();
  Setting& seed =
    between(add(group, "--seed", "seed", settings.seeds, "X Y Z",
              "A point in a vessel or on its ostium, LPS mm; may be repeated. "
              "Without any, aorta and ostia, or the widest ends of a surface, are looked for",
              segmentation),
      -1e5, 1e5);
  seed.option->type_size(3)->expected(1, 100000)->allow_extra_args(false);
  seed.optional = true;
  seed.points = true;
  add(group, "--seed-file", "seed_file", settings.seedFile, "FILE",
    "Points in vessels or on ostia as markups of 3D Slicer (.mrk.json), beside those of --seed",
    segmentation);
  add(group, "--mask", "mask", settings.mask, "FILE",
    "Mask of the vessels in the reference phase, instead of segmenting it: a .seg.nrrd of 3D "
    "Slicer, or "
    "another volume. With it of several phases --time. Without it, that of a series.json",
    segmentation);
  add(group, "--mask-segment", "mask_segments", settings.maskSegments, "NAME",
    "Name or ID of a segment of the mask; may be repeated. Without any, all of them", segmentation)
    .option->allow_extra_args(false);
  between(add(group, "--largest-radius", "largest_radius", settings.largestRadius, "MM",
            "Blood that a ball of this radius fits into is aorta or chamber, mm", segmentation),
    1.0, 50.0)
    .option->capture_default_str();
  pair(between(
    add(group, "--window", "window", settings.window, "TISSUE BLOOD",
      "Image values of tissue and of undiluted blood, instead of measuring them", segmentation),
    -1e5, 1e5));
  this->List.back().optional = true;

  group = "Centerlines";
  add(group, "--beyond-mask", "beyond_mask", settings.beyondMask, "",
    "March wherever a vessel is to be seen, not only inside the segmented lumen: some thin "
    "vessels are followed farther, at the risk of others' lumens, and slower",
    centerline);
  between(add(group, "--least-branch", "least_branch", settings.leastBranch, "MM",
            "Shorter branches are none, mm; 0: ten voxels", centerline),
    0.0, 1000.0)
    .option->capture_default_str();
  check(add(group, "--centerline-steps", "centerline_steps", settings.centerlineSteps, "N",
          "After so many points on the ways back from possible tips the trees are written as far "
          "as they are found: a limit of work, the same on any machine",
          centerline),
    WholeWithin(1, 2000000000));
  this->List.back().option->capture_default_str();
  add(group, "!--no-labels", "labels", settings.labels, "",
    "Give the segments no names: for trees that are not coronary", centerline);
  add(group, "--partial", "partial", settings.partial, "",
    "Go on when a tree is lost: an ostium that was not found, a seed from which no vessel was "
    "followed. Without it the run ends there",
    none);

  group = "Surface";
  check(add(group, "--surface", "surface", settings.surface, "KIND",
          "Of an input that is a surface: swept along its centerlines, or given, as it is but for "
          "repairs",
          surface),
    OneOf({ "swept", "given" }));
  this->List.back().option->capture_default_str();
  pair(between(add(group, "--edges", "edges", settings.edges, "MIN MAX",
                 "Length of the triangles' edges where the wall is most curved and where it is "
                 "flat, mm",
                 surface),
    0.001, 100.0));
  this->List.back().option->capture_default_str();
  add(group, "--contours", "contours", settings.contours, "",
    "Cross-sections as the image shows them, instead of round ones", surface);
  add(group, "--open-ends", "open_ends", settings.openEnds, "",
    "Inlets and outlets without caps; with --until surface", surface);

  group = "Weights";
  add(group, "--weight-cache", "weight_cache", settings.weightCache, "DIR",
    "Folder in which skin weights are kept; the same mesh, bones and settings are read from there",
    none);
  add(group, "--leave-bones-outside", "leave_bones_outside", settings.leaveBonesOutside, "",
    "Leave out bones that lie wholly outside of the mesh, with a warning, instead of failing",
    weights);

  group = "Motion";
  between(add(group, "--temporal-window-ms", "temporal_window_ms", settings.temporalWindowMs, "MS",
            "Time over which an image was taken, ms: half a turn of the gantry, a quarter with two "
            "sources",
            motion),
    0.0, 1000.0)
    .option->capture_default_str();
  check(add(group, "--tracked", "tracked", settings.tracked, "PHASES",
          "Phases that are tracked: all, or even, every other one, and the others are interpolated",
          motion),
    OneOf({ "all", "even" }));
  this->List.back().option->capture_default_str();
  list(between(add(group, "--moments", "moments", settings.moments, "LIST",
                 "R-R fractions at which the moved meshes are written; without it, at the phases "
                 "of the series",
                 motion),
    -100.0, 100.0));
  check(add(group, "--interpolation", "interpolation", settings.interpolation, "MODE",
          "Between the tracked phases: linear, cubic or low-noise", motion),
    OneOf(InterpolationModes()));
  this->List.back().option->capture_default_str();

  add("", "--compress", "compress", settings.compress, "", "Compress the image files", none);
  check(
    add("", "--threads", "threads", settings.threads, "N", "Number of threads; 0: all cores", none),
    WholeWithin(0, 1024));
  this->List.back().option->capture_default_str();
  add("", "--quiet", "quiet", settings.quiet, "", "No progress and no summary", none);
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
          value = Number(*variable);
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
}
