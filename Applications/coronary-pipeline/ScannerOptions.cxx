#include "ScannerOptions.h"

#include "Command.h"
#include "OptionChecks.h"
#include "TextFile.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

namespace coronary
{
namespace
{
using Json = nlohmann::ordered_json;

constexpr const char* Kernels[] = { "soft", "standard", "sharp" };

ReconstructionKernel KernelOf(const std::string& name, const std::string& where)
{
  for (int k = 0; k < 3; ++k)
  {
    if (name == Kernels[k])
    {
      return static_cast<ReconstructionKernel>(k);
    }
  }
  throw std::runtime_error(where + ": '" + name + "' is none of soft, standard, sharp");
}

std::string TextOf(const Json& value, const std::string& where)
{
  if (!value.is_string())
  {
    throw std::runtime_error(where + " has to be a text");
  }
  return value.get<std::string>();
}

ScannerSettings ReadScanner(const std::string& path)
{
  const Json json = Json::parse(ReadTextFile(path, "a scanner"), nullptr, false);
  if (!json.is_object())
  {
    throw std::runtime_error("'" + path + "' is not a JSON object");
  }
  const std::string file = "'" + path + "': ";
  ScannerSettings settings;
  const auto preset = json.find("preset");
  if (preset != json.end())
  {
    try
    {
      settings = ScannerPreset(TextOf(*preset, file + "preset"));
    }
    catch (const std::invalid_argument& error)
    {
      throw std::runtime_error(file + error.what());
    }
  }
  for (const auto& [key, value] : json.items())
  {
    const std::string where = file + key;
    if (key == "preset")
    {
      continue;
    }
    if (key == "kernel")
    {
      settings.kernel = KernelOf(TextOf(value, where), where);
      continue;
    }
    const auto& numbers = AllScannerNumbers();
    const auto number = std::find_if(numbers.begin(), numbers.end(),
      [&name = key](const ScannerNumber& one) { return name == one.name; });
    if (number == numbers.end())
    {
      throw std::runtime_error(where + " is not known");
    }
    if (!value.is_number())
    {
      throw std::runtime_error(where + " has to be a number");
    }
    const double given = value.get<double>();
    if (const auto* whole = std::get_if<int ScannerSettings::*>(&number->member))
    {
      if (given != std::floor(given) || std::abs(given) > 1e6)
      {
        throw std::runtime_error(where + " has to be a whole number");
      }
      settings.*(*whole) = static_cast<int>(given);
    }
    else
    {
      settings.*std::get<double ScannerSettings::*>(number->member) = given;
    }
  }
  try
  {
    settings.Validate();
  }
  catch (const std::invalid_argument& error)
  {
    throw std::runtime_error(file + error.what());
  }
  return settings;
}
}

void ScannerOptions::AddTo(CLI::App& app)
{
  std::string presets;
  for (const std::string& name : ScannerPresets())
  {
    presets += (presets.empty() ? "" : ", ") + name;
  }
  const std::string group = "Scanner";
  CLI::Option* option =
    app
      .add_option("--scanner", this->scanner,
        "Images as a simulated CT scanner sees the beating heart, view by view, instead of by a "
        "formula: " +
          presets + ", or a JSON file")
      ->check(CLI::Validator(
        [](std::string& text) { return text.empty() ? "a name is needed" : std::string(); }, ""))
      ->type_name("PRESET|FILE")
      ->group(group);
  app
    .add_option("--kernel", this->kernels,
      "Kernels of its reconstruction; with several, or several --image-noise, there is a folder "
      "for each "
      "pair, all from the same views")
    ->check(CLI::IsMember({ "soft", "standard", "sharp" }).description("soft|standard|sharp"))
    ->delimiter(',')
    ->type_name("KERNEL,...")
    ->needs(option)
    ->group(group);
  app
    .add_option("--image-noise", this->imageNoise,
      "Noise in the middle of the patient, in HU, that sets the tube current; one or several")
    ->check(Within(1.0, 500.0))
    ->delimiter(',')
    ->type_name("HU,...")
    ->needs(option)
    ->group(group);
  // What the scanner's physics decide.
  for (const char* formula : { "--window", "--noise", "--noise-correlation", "--systolic-noise",
         "--point-spread", "--lost", "--direction", "--beat-irregularity" })
  {
    if (CLI::Option* other = app.get_option_no_throw(formula))
    {
      option->excludes(other);
    }
  }
}

ScannerSettings ScannerOptions::Settings(std::uint64_t seed) const
{
  ScannerSettings settings;
  const auto& presets = ScannerPresets();
  if (std::find(presets.begin(), presets.end(), this->scanner) != presets.end())
  {
    settings = ScannerPreset(this->scanner);
  }
  else if (std::filesystem::exists(this->scanner))
  {
    settings = ReadScanner(this->scanner);
  }
  else
  {
    try
    {
      ScannerPreset(this->scanner);
    }
    catch (const std::invalid_argument& error)
    {
      throw UsageError(
        std::string("--scanner: ") + error.what() + "; nor is there a file of that name");
    }
  }
  if (!this->kernels.empty())
  {
    settings.kernel = KernelOf(this->kernels.front(), "--kernel");
  }
  if (!this->imageNoise.empty())
  {
    settings.imageNoise = this->imageNoise.front();
  }
  settings.seed = seed;
  return settings;
}

std::vector<ScanVariant> ScannerOptions::Variants(const ScannerSettings& settings) const
{
  std::vector<ReconstructionKernel> chosen;
  for (const std::string& name : this->kernels)
  {
    chosen.push_back(KernelOf(name, "--kernel"));
  }
  if (chosen.empty())
  {
    chosen.push_back(settings.kernel);
  }
  std::vector<double> levels = this->imageNoise;
  if (levels.empty())
  {
    levels.push_back(settings.imageNoise);
  }
  std::vector<ScanVariant> variants;
  for (const ReconstructionKernel kernel : chosen)
  {
    for (const double level : levels)
    {
      const auto same = [&](const ScanVariant& one)
      { return one.kernel == kernel && one.imageNoise == level; };
      if (std::any_of(variants.begin(), variants.end(), same))
      {
        throw UsageError("--kernel, --image-noise: one of them is given twice");
      }
      variants.push_back({ kernel, level });
    }
  }
  return variants;
}

std::string VariantName(const ScanVariant& variant)
{
  std::string name = Kernels[static_cast<int>(variant.kernel)];
  if (variant.imageNoise > 0.0)
  {
    std::ostringstream level;
    level << variant.imageNoise;
    name += "-" + level.str();
  }
  return name;
}

namespace
{
Json ScannerJson(const ScannerSettings& settings)
{
  Json numbers;
  numbers["kernel"] = Kernels[static_cast<int>(settings.kernel)];
  for (const ScannerNumber& number : AllScannerNumbers())
  {
    std::visit([&](auto member) { numbers[number.name] = settings.*member; }, number.member);
  }
  return numbers;
}
}

std::string DescribeScanner(const ScannerSettings& settings)
{
  return ScannerJson(settings).dump(2) + "\n";
}

std::string DescribeScan(const ScannerSettings& settings, const CtScanner& scanner,
  const std::vector<double>& phases, const std::vector<ScanVariant>& variants)
{
  Json json;
  json["scanner"] = ScannerJson(settings);
  json["views"] = settings.HalfScanViews();
  json["half_scan_ms"] = 1000.0 * settings.HalfScanTime();
  json["temporal_resolution_ms"] = 500.0 * settings.turnTime / settings.sources;
  json["field_mm"] = 2.0 * settings.FieldRadius();
  // All views together last as long whether one or two tubes take them.
  const double time =
    settings.turnTime * static_cast<double>(settings.HalfScanViews()) / settings.viewsPerTurn;
  for (std::size_t v = 0; v < variants.size(); ++v)
  {
    const double current = scanner.Milliamperes(v);
    json["images"].push_back({ { "kernel", Kernels[static_cast<int>(variants[v].kernel)] },
      { "image_noise_hu", variants[v].imageNoise }, { "milliamperes", current },
      { "half_scan_mAs", current * time } });
  }
  for (std::size_t p = 0; p < phases.size(); ++p)
  {
    Json one;
    one["fraction"] = phases[p];
    for (const ScannedStack& scanned : scanner.Stacks(p))
    {
      const GatedStack& stack = scanned.stack;
      one["stacks"].push_back({ { "z", stack.centre }, { "beats", stack.beats },
        { "rr_ms", 1000.0 * scanned.interval }, { "first_angle", stack.firstAngle },
        { "shift", { scanned.shift[0], scanned.shift[1], scanned.shift[2] } },
        { "iodine", scanned.iodine }, { "first_phase", scanned.firstPhase },
        { "last_phase", scanned.lastPhase }, { "farthest_view_ms", 1000.0 * stack.worst },
        { "current", scanned.current } });
    }
    json["phases"].push_back(one);
  }
  return json.dump(2) + "\n";
}
}
