#include "Command.h"

#include "AtomicFile.h"
#include "CoronaryPhantom.h"
#include "OptionChecks.h"
#include "PhantomOptions.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

namespace coronary
{
namespace
{
/// One of the numbers of a PhantomMotionSummary.
struct MotionMeasure
{
  const char* key;
  const char* title;
  double PhantomMotionSummary::*member;
  double scale; ///< from the summary's unit to that of the title
};

constexpr MotionMeasure Amplitude = { "amplitude_mm", "amplitude (mm)",
  &PhantomMotionSummary::amplitude, 1.0 };
constexpr MotionMeasure MeanOfSpeed = { "mean_speed_mm_per_s", "mean speed (mm/s)",
  &PhantomMotionSummary::meanSpeed, 1.0 };
constexpr MotionMeasure PeakSpeed = { "peak_speed_mm_per_s", "peak speed (mm/s)",
  &PhantomMotionSummary::peakSpeed, 1.0 };
constexpr MotionMeasure SystolicRest = { "systolic_rest_ms", "systolic rest (ms)",
  &PhantomMotionSummary::systolicRest, 1.0 };
constexpr MotionMeasure DiastolicRest = { "diastolic_rest_ms", "diastolic rest (ms)",
  &PhantomMotionSummary::diastolicRest, 1.0 };
constexpr MotionMeasure Strain = { "systolic_strain_percent", "systolic strain (%)",
  &PhantomMotionSummary::systolicStrain, 100.0 };

constexpr const MotionMeasure* MotionMeasures[] = { &Amplitude, &MeanOfSpeed, &PeakSpeed,
  &SystolicRest, &DiastolicRest, &Strain };

/// How a reference range is widened to what is plausible for one heart.
enum class Spread
{
  Published, ///< not at all: it is a published mean -+ standard deviation
  Left,      ///< values of the recommended motion field at the side of the LCx
  Right,     ///< the same at the side of the RCA
  Strains    ///< the same, for strains
};

/// What is known of a measure of an artery, at 75 beats a minute.
struct Reference
{
  const char* artery;
  const MotionMeasure* measure;
  double low;
  double high;
  Spread spread;
};

// Shechter et al. 2005 (rest windows), and the recommended motion field with the excursions of the
// valve plane that it is given with, 18 mm on the right and 12 mm on the left.
constexpr double ReferenceCycle = 0.8;
constexpr Reference References[] = {
  { "LM", &Amplitude, 9.4, 12.0, Spread::Left },
  { "LM", &MeanOfSpeed, 24.0, 29.0, Spread::Left },
  { "LM", &PeakSpeed, 51.0, 62.0, Spread::Left },
  { "proximal left tree (5 cm)", &SystolicRest, 55.0, 105.0, Spread::Published },
  { "proximal left tree (5 cm)", &DiastolicRest, 70.0, 154.0, Spread::Published },
  { "LAD proximal", &Amplitude, 10.0, 11.0, Spread::Left },
  { "LAD proximal", &MeanOfSpeed, 26.0, 28.0, Spread::Left },
  { "LAD proximal", &PeakSpeed, 55.0, 59.0, Spread::Left },
  { "LAD mid", &Amplitude, 8.0, 8.0, Spread::Left },
  { "LAD mid", &MeanOfSpeed, 19.0, 21.0, Spread::Left },
  { "LAD mid", &PeakSpeed, 41.0, 45.0, Spread::Left },
  { "LAD distal", &Amplitude, 2.0, 4.0, Spread::Left },
  { "LCx", &Amplitude, 12.0, 12.0, Spread::Left },
  { "LCx", &MeanOfSpeed, 31.0, 31.0, Spread::Left },
  { "LCx", &PeakSpeed, 66.0, 66.0, Spread::Left },
  { "LCx", &Strain, 1.0, 1.0, Spread::Strains },
  { "OM", &Amplitude, 9.0, 10.0, Spread::Left },
  { "RCA proximal to mid", &Amplitude, 16.0, 18.0, Spread::Right },
  { "RCA proximal to mid", &MeanOfSpeed, 45.0, 45.0, Spread::Right },
  { "RCA proximal to mid", &PeakSpeed, 97.0, 97.0, Spread::Right },
  { "RCA proximal to mid", &SystolicRest, 42.0, 110.0, Spread::Published },
  { "RCA proximal to mid", &DiastolicRest, 23.0, 107.0, Spread::Published },
  { "RCA proximal to mid", &Strain, -1.0, -1.0, Spread::Strains },
  { "RCA distal", &Amplitude, 16.0, 18.0, Spread::Right },
  { "PDA", &Amplitude, 6.0, 10.0, Spread::Right },
  { "PDA", &Strain, -14.0, -14.0, Spread::Strains },
  { "PLB", &Amplitude, 12.0, 12.0, Spread::Right },
};

struct Range
{
  double low;
  double high;
};

Range Widened(const Reference& reference)
{
  // Regional amplitudes differ by 6 %; the excursions may be 10..14 mm on the left and 14..22 mm
  // on the right. Strains of healthy hearts differ by 5 points (McVeigh et al. 2018).
  constexpr double lower = 1.0 - 0.06;
  constexpr double upper = 1.0 + 0.06;
  switch (reference.spread)
  {
    case Spread::Left:
      return { reference.low * lower * 10.0 / 12.0, reference.high * upper * 14.0 / 12.0 };
    case Spread::Right:
      return { reference.low * lower * 14.0 / 18.0, reference.high * upper * 22.0 / 18.0 };
    case Spread::Strains:
      return { reference.low - 5.0, reference.high + 5.0 };
    case Spread::Published:
      break;
  }
  return { reference.low, reference.high };
}

const Reference* Find(const std::string& artery, const MotionMeasure& measure)
{
  for (const Reference& reference : References)
  {
    if (artery == reference.artery && &measure == reference.measure)
    {
      return &reference;
    }
  }
  return nullptr;
}

struct PhantomMotionJob
{
  PhantomSettings settings;
  std::string json;

  void Run() const;
};

void PhantomMotionJob::Run() const
{
  const CoronaryPhantom phantom(this->settings);
  // Speeds and rest windows of another heart rate are not those that were published.
  const bool comparable = std::abs(this->settings.cycleLength - ReferenceCycle) < 1e-6;
  int compared = 0;
  int agreeing = 0;

  nlohmann::ordered_json root = { { "seed", this->settings.seed },
    { "cycle_ms", 1000.0 * this->settings.cycleLength },
    { "arteries", nlohmann::ordered_json::array() } };
  std::printf("%-26s %-20s %9s  %-16s %-8s %s\n", "artery", "measure", "phantom", "reference",
    "verdict", "source");
  for (const PhantomMotionSummary& summary : phantom.SummarizeMotion())
  {
    nlohmann::ordered_json entry = { { "name", summary.name } };
    auto references = nlohmann::ordered_json::object();
    for (const MotionMeasure* measure : MotionMeasures)
    {
      const double value = measure->scale * summary.*(measure->member);
      entry[measure->key] = value;
      const Reference* reference = comparable ? Find(summary.name, *measure) : nullptr;
      char text[32] = "-";
      const char* verdict = "-";
      const char* source = "-";
      if (reference)
      {
        const Range range = Widened(*reference);
        const bool within = value >= range.low && value <= range.high;
        ++compared;
        agreeing += within ? 1 : 0;
        verdict = within ? "within" : "outside";
        source = reference->spread == Spread::Published ? "Shechter 2005" : "motion field";
        std::snprintf(text, sizeof(text), "%.1f .. %.1f", range.low, range.high);
        references[measure->key] = { { "low", range.low }, { "high", range.high },
          { "within", within }, { "source", source } };
      }
      std::printf("%-26s %-20s %9.1f  %-16s %-8s %s\n", summary.name.c_str(), measure->title, value,
        text, verdict, source);
    }
    entry["reference"] = std::move(references);
    root["arteries"].push_back(std::move(entry));
  }
  if (comparable)
  {
    std::printf("%d of %d values are within their reference range.\n", agreeing, compared);
  }
  else
  {
    std::printf("The reference ranges hold for --cycle-ms 800: nothing was compared.\n");
  }
  if (!this->json.empty())
  {
    WriteFileAtomically(this->json, root.dump(2) + "\n");
  }
}
}

Command MakePhantomMotionCommand(CLI::App& program)
{
  CLI::App* app = program.add_subcommand("phantom-motion",
    "Print how far and how fast the phantom's arteries move, beside what is known of real ones");
  auto job = std::make_shared<PhantomMotionJob>();
  AddHeartOptions(*app, job->settings);
  app->add_option("--json", job->json, "Write the table to this file as well")->type_name("FILE");
  return { app, [job] { job->Run(); } };
}
}
