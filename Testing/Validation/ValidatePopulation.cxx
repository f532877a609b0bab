// Population motion, by leaving out: the tree of one phase, or of two or three, and all the other moments predicted;
// against where the material truly is, beside a model that rests. Phantoms that differ in anatomy and in motion, and a
// measured heart, whose motion no formula made. Tables in Markdown on stdout; the exit code is 1 when a limit is missed.

#include "CarriedHeart.h"
#include "CoronaryPhantom.h"
#include "CounterRandom.h"
#include "CyclicTime.h"
#include "PhantomCases.h"
#include "PopulationMotion.h"
#include "SegmentLabeling.h"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <numeric>

namespace
{
using namespace coronary;

constexpr int Moments = 20;
constexpr double TrackingNoise = 0.3; // mm along each axis, of phases that are taken for tracked
constexpr double MaximumShare =
  0.5; // of the resting model's mean error, one phase, mean over the phantoms
constexpr double MaximumTwoShare = 0.3; // two phases
constexpr double MinimumWithin =
  0.85; // of the places within two standard deviations, mean over the phantoms

/// A heart of which all moments are known.
struct Truth
{
  std::string name;
  CenterlineTopology tree; ///< at the reference, with names
  HeartPose named;
  double heartRate = 75.0;
  std::function<std::vector<Vector3>(double)> at; ///< the tree's points at a time
};

/// Names as the pipeline gives them: by the shape of the lines alone.
void Name(Truth& truth, const Polylines& lines)
{
  truth.tree = BuildTopology(lines);
  truth.named = LabelSegments(truth.tree).heart;
}

Truth PhantomTruth(std::uint64_t seed, double reference)
{
  PhantomSettings settings = MakePhantomCase(seed, true).settings;
  settings.stenoses = 0;
  // Hearts that beat as differently as the phantom can.
  RandomStream random(seed, 4711);
  settings.motionAmplitude = 0.7 + 0.6 * random.Uniform();
  settings.axialMotionRight = 14.0 + 8.0 * random.Uniform();
  settings.axialMotionLeft = 9.0 + 6.0 * random.Uniform();
  settings.cycleLength = 0.65 + 0.45 * random.Uniform();
  const auto phantom = std::make_shared<CoronaryPhantom>(settings);
  Truth truth;
  truth.name = "phantom " + std::to_string(seed);
  truth.heartRate = 60.0 / settings.cycleLength;
  Polylines lines = LinesOf(static_cast<const VesselTree&>(phantom->Tree(reference)));
  Name(truth, lines);
  std::vector<Vector3> material;
  for (const Vector3& point : truth.tree.points)
  {
    material.push_back(phantom->ReferencePosition(point, reference));
  }
  truth.at = [phantom, material](double time)
  {
    std::vector<Vector3> points;
    for (const Vector3& point : material)
    {
      points.push_back(phantom->Position(point, time));
    }
    return points;
  };
  return truth;
}

Truth MeasuredTruth(const std::shared_ptr<const Heart>& heart, double reference)
{
  const auto tree = std::make_shared<CarriedTree>(
    *heart, static_cast<int>(std::lround(reference * MeasuredFrames)));
  Truth truth;
  truth.name = "measured heart";
  truth.heartRate = 60.0 / CycleSeconds;
  const Polylines& lines = tree->Reference();
  Name(truth, lines);
  // Where on the carried lines the named tree's points are.
  struct Foot
  {
    std::size_t first = 0;
    std::size_t second = 0;
    double fraction = 0.0;
  };
  std::vector<Foot> feet;
  for (const Vector3& point : truth.tree.points)
  {
    double least = std::numeric_limits<double>::infinity();
    feet.emplace_back();
    for (const std::vector<std::int64_t>& line : lines.lines)
    {
      for (std::size_t n = 0; n + 1 < line.size(); ++n)
      {
        const auto first = static_cast<std::size_t>(line[n]);
        const auto second = static_cast<std::size_t>(line[n + 1]);
        const SegmentPlace place =
          NearestOnSegment(point, lines.points[first], lines.points[second]);
        if (place.squaredDistance < least)
        {
          least = place.squaredDistance;
          feet.back() = { first, second, place.fraction };
        }
      }
    }
  }
  const std::vector<Vector3> own = truth.tree.points;
  truth.at = [heart, tree, feet, own](double time)
  {
    const std::vector<Vector3> moved = tree->At(heart->At(time));
    const std::vector<Vector3>& rest = tree->Reference().points;
    std::vector<Vector3> points = own;
    for (std::size_t n = 0; n < feet.size(); ++n)
    {
      const Foot& foot = feet[n];
      points[n] += (1.0 - foot.fraction) * (moved[foot.first] - rest[foot.first]) +
        foot.fraction * (moved[foot.second] - rest[foot.second]);
    }
    return points;
  };
  return truth;
}

const char* VesselOf(int segment)
{
  switch (segment)
  {
    case ProximalRCA:
    case MidRCA:
    case DistalRCA:
      return "RCA";
    case ProximalLCx:
    case DistalLCx:
      return "LCx";
    case LeftMain:
    case ProximalLAD:
    case MidLAD:
    case DistalLAD:
      return "LAD";
    default:
      return "branches";
  }
}

struct Outcome
{
  double mean = 0.0;
  double rest = 0.0;  ///< mean of the model at rest
  double worst = 0.0; ///< mean at the worst moment
  double worstTime = 0.0;
  double percentile = 0.0;
  double deviation = 0.0; ///< mean of what is stated
  double within = 0.0;    ///< share within two of the stated standard deviations
  std::map<std::string, std::array<double, 3>>
    vessels; ///< sums of error and rest, and their number
};

Outcome Judge(const Truth& truth, double reference, const std::vector<double>& others)
{
  const Polylines lines = LinesOf(static_cast<const VesselTree&>(truth.tree));
  PoseSequence seen;
  seen.times = others;
  RandomStream random(29, static_cast<std::uint64_t>(1000.0 * reference));
  for (const double time : others)
  {
    seen.points.push_back(truth.at(time));
    for (Vector3& point : seen.points.back())
    {
      point += TrackingNoise * Vector3(random.Normal(), random.Normal(), random.Normal());
    }
  }
  PopulationMotionSettings settings;
  settings.heartRate = truth.heartRate;
  std::vector<double> times;
  for (int k = 0; k < Moments; ++k)
  {
    const double time = static_cast<double>(k) / Moments;
    const auto same = [time](double other) { return CyclicDistance(time, other) < 0.02; };
    if (!same(reference) && std::none_of(others.begin(), others.end(), same))
    {
      times.push_back(time);
    }
  }
  PopulationMotionReport report;
  const PatientHeart heart = EstimateHeart(truth.tree, truth.named);
  const PoseSequence poses = MoveByPopulation(
    lines, heart, reference, times, others.empty() ? nullptr : &seen, settings, &report);
  Outcome outcome;
  std::vector<double> errors;
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    const std::vector<Vector3> truly = truth.at(times[k]);
    double sum = 0.0;
    for (std::size_t n = 0; n < truly.size(); ++n)
    {
      const double error = (poses.points[k][n] - truly[n]).norm();
      const double rest = (lines.points[n] - truly[n]).norm();
      errors.push_back(error);
      sum += error;
      outcome.rest += rest;
      outcome.deviation += report.deviations[k][n];
      outcome.within += error <= 2.0 * report.deviations[k][n] ? 1.0 : 0.0;
      std::array<double, 3>& vessel = outcome.vessels[VesselOf(truth.tree.segmentId[n])];
      vessel[0] += error;
      vessel[1] += rest;
      vessel[2] += 1.0;
    }
    sum /= static_cast<double>(truly.size());
    if (sum > outcome.worst)
    {
      outcome.worst = sum;
      outcome.worstTime = times[k];
    }
  }
  const auto count = static_cast<double>(errors.size());
  outcome.mean = std::accumulate(errors.begin(), errors.end(), 0.0) / count;
  outcome.rest /= count;
  outcome.deviation /= count;
  outcome.within /= count;
  std::sort(errors.begin(), errors.end());
  outcome.percentile = errors[static_cast<std::size_t>(0.95 * (count - 1.0))];
  return outcome;
}

std::string Percents(const std::vector<double>& times)
{
  std::string text;
  for (const double time : times)
  {
    text += (text.empty() ? "" : ", ") + std::to_string(std::lround(100.0 * time)) + " %";
  }
  return text;
}

void Print(const std::string& name, const std::vector<double>& phases, const Outcome& outcome)
{
  std::printf("| %s | %s | %.2f | %.2f | %.2f | %.2f | %.2f at %.0f %% | %.2f | %.0f %% |",
    name.c_str(), Percents(phases).c_str(), outcome.mean, outcome.rest, outcome.mean / outcome.rest,
    outcome.percentile, outcome.worst, 100.0 * outcome.worstTime, outcome.deviation,
    100.0 * outcome.within);
  for (const char* vessel : { "RCA", "LCx", "LAD", "branches" })
  {
    const auto found = outcome.vessels.find(vessel);
    if (found == outcome.vessels.end())
    {
      std::printf(" - |");
      continue;
    }
    std::printf(
      " %.1f (%.1f) |", found->second[0] / found->second[2], found->second[1] / found->second[2]);
  }
  std::printf("\n");
  std::fflush(stdout);
}

/// Sums over the phantoms for one choice of phases.
struct Summary
{
  double share = 0.0;
  double within = 0.0;
  double mean = 0.0;
  double rest = 0.0;
  double worstShare = 0.0;
  int count = 0;

  void Add(const Outcome& outcome)
  {
    const double own = outcome.mean / outcome.rest;
    this->share += own;
    this->worstShare = std::max(this->worstShare, own);
    this->within += outcome.within;
    this->mean += outcome.mean;
    this->rest += outcome.rest;
    ++this->count;
  }
};
}

int main(int argc, char** argv)
{
  CLI::App program("Validates the population motion", "validate-population");
  std::string seedText = "401..412";
  std::string data = std::string(DYNAMICCORONARY_DATA_DIR) + "/biv-motion";
  bool quick = false;
  program.add_option("--seeds", seedText, "Phantoms")->capture_default_str();
  program.add_option(
    "--data", data, "Folder of the measured heart's surfaces, patient1_EPICARDIAL_000.vtk ..");
  program.add_flag("--quick", quick, "Three phantoms, one and two phases");
  CLI11_PARSE(program, argc, argv);
  try
  {
    const std::vector<std::uint64_t> seeds =
      ParseSeeds(quick ? "401..403" : seedText, LoneNumber::Seed);
    std::shared_ptr<const Heart> measured;
    HeartSurface first;
    if (ReadHeartSurface(data, "EPICARDIAL", 0, first))
    {
      measured = std::make_shared<Heart>(data, false);
    }
    std::vector<std::vector<double>> choices = { { 0.75 }, { 0.40 }, { 0.75, 0.40 } };
    if (!quick)
    {
      choices.push_back({ 0.40, 0.75 });
      choices.push_back({ 0.75, 0.40, 0.0 });
    }
    std::printf(
      "Distance to where the same material is, at all of %d moments but the given phases. The tree "
      "is that of the first given phase, named by its shape; others are the truth with %.1f mm of "
      "noise along each axis, as a tracker would give them. The heart rate is given. Vessels: "
      "mean, "
      "and in brackets that of the model at rest.\n\n"
      "| heart | phases | mean, mm | at rest | share | 95 %% | worst moment | stated deviation | "
      "within two | RCA | LCx | LAD | branches |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      Moments, TrackingNoise);
    std::vector<Summary> summaries(choices.size());
    for (std::size_t c = 0; c < choices.size(); ++c)
    {
      const double reference = choices[c].front();
      const std::vector<double> others(choices[c].begin() + 1, choices[c].end());
      for (const std::uint64_t seed : seeds)
      {
        const Truth truth = PhantomTruth(seed, reference);
        const Outcome outcome = Judge(truth, reference, others);
        Print(truth.name, choices[c], outcome);
        summaries[c].Add(outcome);
      }
      if (measured)
      {
        const Truth truth = MeasuredTruth(measured, reference);
        Print(truth.name, choices[c], Judge(truth, reference, others));
      }
    }
    std::printf("\n| phantoms, phases | mean, mm | at rest | mean share | worst share | within two "
                "deviations | |\n|---|---|---|---|---|---|---|\n");
    bool met = true;
    for (std::size_t c = 0; c < choices.size(); ++c)
    {
      const Summary& s = summaries[c];
      const double limit = choices[c].size() > 1 ? MaximumTwoShare : MaximumShare;
      const bool good = s.share / s.count <= limit && s.within / s.count >= MinimumWithin;
      met = met && good;
      std::printf("| %d, %s | %.2f | %.2f | %.2f (limit %.2f) | %.2f | %.0f %% | %s |\n", s.count,
        Percents(choices[c]).c_str(), s.mean / s.count, s.rest / s.count, s.share / s.count, limit,
        s.worstShare, 100.0 * s.within / s.count, good ? "met" : "**MISSED**");
    }
    if (!measured)
    {
      std::printf("\nWithout the measured heart: '%s' does not have it.\n", data.c_str());
    }
    return met ? 0 : 1;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-population: %s\n", error.what());
    return 2;
  }
}
