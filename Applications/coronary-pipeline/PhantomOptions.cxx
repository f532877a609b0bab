#include "PhantomOptions.h"

#include "Command.h"
#include "OptionChecks.h"

#include <functional>
#include <limits>
#include <type_traits>
#include <utility>

namespace coronary
{
namespace
{
constexpr int MostPhases = 1000;
constexpr double MostBeats = 100.0;

/// Options under one title of the help.
class Section
{
public:
  Section(CLI::App& app, std::string title)
    : Options(app)
    , Title(std::move(title))
  {
  }

  template <typename Value>
  CLI::Option* Add(const std::string& name, Value& value, const std::string& description)
  {
    return this->Options.add_option(name, value, description)->group(this->Title);
  }

  void AddFlag(const std::string& name, bool& value, const std::string& description)
  {
    this->Options.add_flag(name, value, description)->group(this->Title);
  }

  template <typename Value>
  void AddNumber(const std::string& name, Value& value, double low, double high,
    const std::string& unit, const std::string& description)
  {
    this->Add(name, value, description)
      ->check(std::is_integral_v<Value>
          ? WholeWithin(static_cast<long>(low), static_cast<long>(high))
          : Within(low, high))
      ->type_name(unit)
      ->capture_default_str();
  }

  /// An option in milliseconds for a setting in seconds.
  void AddMilliseconds(const std::string& name, double& seconds, double low, double high,
    const std::string& description)
  {
    this
      ->AddFunction<double>(
        name, [&seconds](double value) { seconds = value / 1000.0; }, description)
      ->check(Within(low, high))
      ->type_name("MS")
      ->default_str(Format(1000.0 * seconds));
  }

  template <typename Value>
  CLI::Option* AddFunction(const std::string& name,
    const std::function<void(const Value&)>& function, const std::string& description)
  {
    return this->Options.add_option_function<Value>(name, function, description)
      ->group(this->Title);
  }

private:
  CLI::App& Options;
  std::string Title;
};
}

void AddHeartOptions(CLI::App& app, PhantomSettings& s)
{
  Section anatomy(app, "Anatomy");
  // The filter's property is an int.
  anatomy.AddNumber("--seed", s.seed, 0, std::numeric_limits<int>::max(), "N",
    "Names the individual; 0: the mean anatomy");
  anatomy
    .AddFunction<std::string>(
      "--dominance",
      [&s](const std::string& side)
      {
        s.dominance = side == "left" ? Dominance::Left
          : side == "right"          ? Dominance::Right
                                     : Dominance::Balanced;
      },
      "Which artery feeds the back of the heart")
    ->check(CLI::IsMember({ "right", "left", "balanced" }).description("right|left|balanced"))
    ->type_name("SIDE")
    ->default_str("right");
  anatomy.AddFlag("--ramus", s.ramus, "Add a ramus intermedius at the end of the left main");
  anatomy.AddNumber("--calibre", s.calibre, 0.5, 2.0, "FACTOR", "Factor on all diameters");
  anatomy.AddNumber("--position-variation", s.positionVariation, 0.0, 10.0, "MM",
    "Standard deviation of the vessels' course, in mm");
  anatomy.AddNumber("--calibre-variation", s.calibreVariation, 0.0, 0.3, "RATIO",
    "Relative standard deviation of a vessel's diameter");
  anatomy.AddNumber(
    "--tortuosity", s.tortuosity, 0.0, 3.0, "FACTOR", "Factor on the vessels' lateral waves");
  anatomy.AddNumber("--stenoses", s.stenoses, 0, 20, "N", "Number of narrowings");
  anatomy.AddNumber("--stenosis-degree", s.stenosisDegree, 0.0, 0.99, "RATIO",
    "Diameter reduction of the narrowings");
  anatomy.AddNumber(
    "--calcified-plaques", s.calcifiedPlaques, 0, 50, "N", "Number of calcifications in the walls");
  anatomy.AddFlag("--chronic-occlusion", s.chronicOcclusion, "Close 15 mm of the mid RCA");

  Section motion(app, "Motion");
  motion.AddMilliseconds("--cycle-ms", s.cycleLength, 300.0, 3000.0, "R-R interval, in ms");
  motion.AddNumber(
    "--motion-amplitude", s.motionAmplitude, 0.0, 1.3, "FACTOR", "Factor on all displacements");
  motion.AddNumber("--axial-motion-right", s.axialMotionRight, 0.0, 24.0, "MM",
    "Excursion of the valve plane on the side of the RCA, in mm");
  motion.AddNumber("--axial-motion-left", s.axialMotionLeft, 0.0, 24.0, "MM",
    "Excursion of the valve plane on the side of the LCx, in mm");
  motion.AddNumber("--regional-lag", s.regionalLag, 0.0, 0.05, "RATIO",
    "Greatest lead or lag of a region, as a fraction of R-R");
  motion.AddNumber("--regional-amplitude", s.regionalAmplitude, 0.0, 0.1, "RATIO",
    "Relative standard deviation of a region's amplitude");
  motion.AddNumber("--beat-variation", s.beatVariation, 0.0, 0.1, "RATIO",
    "Relative amplitude change from beat to beat");
  motion.AddNumber("--beat-irregularity", s.beatIrregularity, 0.0, 5.0, "MM",
    "How far the whole heart lies off in the beat of each phase, in mm (root mean square); 1.5 as "
    "measured");
  motion.AddNumber(
    "--area-pulse", s.areaPulse, 0.0, 0.3, "RATIO", "Systolic increase of the lumen's area");
}

void AddImagingOptions(CLI::App& app, PhantomSettings& s)
{
  Section image(app, "Image quality");
  image.AddMilliseconds("--window", s.temporalWindow, 0.0, 1500.0,
    "Temporal window, in ms: 0 ideal, 66 dual source, 140 single source");
  image.AddNumber(
    "--noise", s.noise, 0.0, 200.0, "HU", "Standard deviation of the noise at full dose, in HU");
  image.AddNumber("--noise-correlation", s.noiseCorrelation, 0.0, 2.0, "MM",
    "Standard deviation of the noise's kernel, in mm: 0.82 times the point spread's");
  image.AddNumber("--systolic-noise", s.systolicNoise, 1.0, 4.0, "FACTOR",
    "Factor on the noise where the tube current is reduced");
  image
    .AddFunction<std::vector<double>>(
      "--point-spread",
      [&s](const std::vector<double>& values)
      {
        if (values.size() == 2)
        {
          throw CLI::ValidationError("--point-spread", "one number or three, not two");
        }
        for (std::size_t axis = 0; axis < 3; ++axis)
        {
          s.pointSpread[axis] = values[values.size() == 1 ? 0 : axis];
        }
      },
      "Standard deviation of the point spread along the image axes, in mm; one number or three. "
      "Kernels: 0.32 sharp (0.75 mm full width at half maximum), 0.38 medium (0.9), 0.47 soft "
      "(1.1)")
    ->expected(1, 3)
    ->check(Within(0.0, 3.0))
    ->type_name("MM")
    ->default_str(
      Format(s.pointSpread[0]) + " " + Format(s.pointSpread[1]) + " " + Format(s.pointSpread[2]));
  image.AddNumber("--lumen", s.lumenHU, 0.0, 1500.0, "HU", "The lumen at the ostia, in HU");
  image.AddNumber("--attenuation-gradient", s.attenuationGradient, -20.0, 5.0, "HU/CM",
    "Change of the lumen along the vessel, in HU per cm");
  image.AddNumber("--vein", s.veinHU, -200.0, 1500.0, "HU", "The great cardiac vein, in HU");
}

void AddTruthOptions(CLI::App& app, PhantomSettings& s)
{
  Section truth(app, "Truth");
  truth.AddNumber("--centerline-spacing", s.centerlineSpacing, 0.1, 5.0, "MM",
    "Distance of the centerline's points, in mm");
  truth.AddNumber("--surface-spacing", s.surfaceSpacing, 0.15, 1.5, "MM",
    "Edge length of the true surface, in mm");
}

void PhaseOptions::AddTo(CLI::App& app)
{
  Section group(app, "Phases");
  CLI::Option* even = group
                        .Add("--phases", this->count,
                          "Number of phases in equal steps from -5 % to 106 % of the R-R interval "
                          "(1: at 75 %)")
                        ->check(WholeWithin(1, MostPhases))
                        ->type_name("N")
                        ->capture_default_str();
  group
    .Add("--fractions", this->fractions,
      "The phases instead, as fractions of the R-R interval, increasing: -0.05,0.2,0.75")
    ->check(Within(-MostBeats, MostBeats))
    ->delimiter(',')
    ->type_name("LIST")
    ->excludes(even);
}

void PhaseOptions::AddLostTo(CLI::App& app)
{
  Section(app, "Phases")
    .Add("--lost", this->lost,
      "A phase, counted from 1, in which the vessels can not be tracked, and the share of the "
      "tree's length that is lost: 14 or 14:0.7; may be repeated")
    ->type_name("PHASE[:SHARE]")
    ->allow_extra_args(false);
}

std::vector<double> PhaseOptions::Phases() const
{
  if (this->fractions.empty())
  {
    return EvenPhases(this->count);
  }
  for (std::size_t i = 1; i < this->fractions.size(); ++i)
  {
    if (!(this->fractions[i] > this->fractions[i - 1]))
    {
      throw UsageError("--fractions: " + Format(this->fractions[i]) + " is not greater than " +
        Format(this->fractions[i - 1]) + " before it");
    }
  }
  if (this->fractions.size() > MostPhases)
  {
    throw UsageError("--fractions: more than " + std::to_string(MostPhases) + " phases");
  }
  return this->fractions;
}

std::vector<LostPhase> PhaseOptions::LostPhases(const std::vector<double>& phases) const
{
  std::vector<LostPhase> result;
  for (const std::string& text : this->lost)
  {
    const std::size_t colon = text.find(':');
    std::string phase = text.substr(0, colon);
    std::string share = colon == std::string::npos ? "1" : text.substr(colon + 1);
    std::string problem = WholeWithin(1, static_cast<long>(phases.size()))(phase);
    if (problem.empty())
    {
      problem = Within(0.0, 1.0)(share);
    }
    if (!problem.empty())
    {
      throw UsageError("--lost: " + problem);
    }
    result.push_back({ phases[std::stoul(phase) - 1], std::stod(share) });
  }
  return result;
}

void GridOptions::AddTo(CLI::App& app, const std::string& automatic)
{
  Section group(app, Group);
  group
    .Add("--spacing", this->spacing, "Voxel size along the image axes, in mm; one number or three")
    ->expected(1, 3)
    ->check(Within(0.05, 20.0))
    ->type_name("MM")
    ->default_str("0.5");
  group
    .Add("--origin", this->origin,
      "World position (LPS) of the first voxel, in mm; together with --dimensions. Without them "
      "the image holds " +
        automatic)
    ->expected(3)
    ->check(Within(-1e5, 1e5))
    ->type_name("MM");
  group.Add("--dimensions", this->dimensions, "Number of voxels along the image axes")
    ->expected(3)
    ->check(WholeWithin(1, 16384))
    ->type_name("N");
}

void GridOptions::Check()
{
  if (this->spacing.size() == 2)
  {
    throw UsageError("--spacing: one number or three, not two");
  }
  this->spacing.resize(3, this->spacing.front());
  if (this->origin.empty() != this->dimensions.empty())
  {
    throw UsageError(std::string(this->origin.empty() ? "--dimensions" : "--origin") +
      ": --origin and --dimensions go together");
  }
}
}
