// Automatic ostia where they are hard to find or missing: how often they are right, and what their
// confidence is worth. Tables in Markdown on stdout; the exit code is 1 when a limit is missed.

#include "CoronaryOstia.h"
#include "CounterRandom.h"
#include "OstiaCases.h"
#include "PhantomCases.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <map>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

constexpr double Tolerance = 3.0;    // mm: about a vessel's radius and the wall's uncertainty
constexpr double MinimumShare = 0.9; // of the ostia that there are, in images as they should be
constexpr double Sure = 0.8;         // a wrong answer with more is the worst there is
constexpr double MaximumSureShare = 0.01; // of all answers, wrong and sure of it
constexpr int Bins = 5;

/// One reported ostium.
struct Answer
{
  std::string group;
  std::uint64_t seed;
  std::string name;
  double error; ///< mm, to the true one of that name; infinite: there is none
  double confidence;
  bool Right() const { return this->error <= Tolerance; }
};

struct Result
{
  std::string group;
  std::uint64_t seed;
  std::size_t truths = 0;
  std::vector<Answer> answers;
  std::string doubt;
  double seconds = 0.0;
};

Result Run(const std::string& group, std::uint64_t seed, double coarsest)
{
  const OstiaCase test = MakeOstiaCase(group, seed, coarsest);
  const std::clock_t start = std::clock();
  const CoronaryOstia found = FindCoronaryOstia({ test.values.data(), test.grid });
  Result result;
  result.group = group;
  result.seed = seed;
  result.seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  result.truths = test.truth.size();
  result.doubt = found.doubt;
  for (const CoronaryOstium& ostium : found.ostia)
  {
    Answer answer{ group, seed, ostium.name, std::numeric_limits<double>::infinity(),
      ostium.confidence };
    for (const PhantomOstium& truth : test.truth)
    {
      if (truth.name == ostium.name)
      {
        answer.error = (ostium.position - truth.position).norm();
      }
    }
    result.answers.push_back(answer);
  }
  return result;
}

double MeanConfidence(const std::vector<const Answer*>& answers)
{
  double sum = 0.0;
  for (const Answer* a : answers)
  {
    sum += a->confidence;
  }
  return answers.empty() ? 0.0 : sum / static_cast<double>(answers.size());
}

int BinOf(double confidence)
{
  return std::min(Bins - 1, static_cast<int>(confidence * Bins));
}

/// Expected calibration error: mean gap of confidence and share of right ones, by bins.
double CalibrationError(const std::vector<Answer>& answers, const std::vector<bool>& right)
{
  std::array<double, Bins> gap{};
  for (std::size_t n = 0; n < answers.size(); ++n)
  {
    gap[static_cast<std::size_t>(BinOf(answers[n].confidence))] +=
      answers[n].confidence - (right[n] ? 1.0 : 0.0);
  }
  double sum = 0.0;
  for (const double g : gap)
  {
    sum += std::abs(g);
  }
  return answers.empty() ? 0.0 : sum / static_cast<double>(answers.size());
}

/// What a perfect forecaster with these confidences would have in the mean.
double ChanceError(const std::vector<Answer>& answers)
{
  constexpr int draws = 2000;
  RandomStream random(1, 99);
  double sum = 0.0;
  std::vector<bool> right(answers.size());
  for (int draw = 0; draw < draws; ++draw)
  {
    for (std::size_t n = 0; n < answers.size(); ++n)
    {
      right[n] = random.Uniform() < answers[n].confidence;
    }
    sum += CalibrationError(answers, right);
  }
  return sum / draws;
}

/// @return whether the limit is met
bool PrintGroups(const std::vector<Result>& results)
{
  std::printf(
    "\n### By kind of image\n\n| images | number | ostia there | found right | answers | "
    "wrong | largest confidence of a wrong one | mean error of right ones, mm | seconds |\n"
    "|---|---|---|---|---|---|---|---|---|\n");
  double there = 0.0;
  double found = 0.0;
  for (const OstiaGroup& group : OstiaGroups())
  {
    int images = 0;
    std::size_t truths = 0;
    int right = 0;
    int answers = 0;
    double worst = 0.0;
    double error = 0.0;
    double seconds = 0.0;
    for (const Result& result : results)
    {
      if (result.group != group.name)
      {
        continue;
      }
      ++images;
      truths += result.truths;
      seconds += result.seconds;
      for (const Answer& answer : result.answers)
      {
        ++answers;
        right += answer.Right() ? 1 : 0;
        error += answer.Right() ? answer.error : 0.0;
        worst = answer.Right() ? worst : std::max(worst, answer.confidence);
      }
    }
    if (images == 0)
    {
      continue;
    }
    if (!group.wrong)
    {
      there += static_cast<double>(truths);
      found += right;
    }
    std::printf("| %s: %s | %d | %zu | %d | %d | %d | %.2f | %.2f | %.1f |\n", group.name,
      group.what, images, truths, right, answers, answers - right, worst,
      right > 0 ? error / right : 0.0, seconds / images);
  }
  if (there == 0.0)
  {
    return true;
  }
  const bool met = found >= MinimumShare * there;
  std::printf("\nOf the ostia in images that are as they should be %.1f %% are within %.0f mm. "
              "Limit: %.0f %%: %s\n",
    100.0 * found / there, Tolerance, 100.0 * MinimumShare, met ? "met" : "**MISSED**");
  return met;
}

/// @return whether the limit is met
bool PrintConfidence(const std::vector<Answer>& answers)
{
  std::array<std::vector<const Answer*>, Bins> bins;
  std::vector<bool> right;
  double brier = 0.0;
  double share = 0.0;
  int sure = 0;
  for (const Answer& a : answers)
  {
    bins[static_cast<std::size_t>(BinOf(a.confidence))].push_back(&a);
    right.push_back(a.Right());
    brier += std::pow(a.confidence - (a.Right() ? 1.0 : 0.0), 2);
    share += a.Right() ? 1.0 : 0.0;
    sure += !a.Right() && a.confidence > Sure ? 1 : 0;
  }
  std::printf(
    "\n### Confidence against the share of right answers\n\n| confidence | answers | mean "
    "confidence | right |\n|---|---|---|---|\n");
  for (int b = 0; b < Bins; ++b)
  {
    const auto& bin = bins[static_cast<std::size_t>(b)];
    const auto good =
      std::count_if(bin.begin(), bin.end(), [](const Answer* a) { return a->Right(); });
    std::printf("| %.1f to %.1f | %zu | %.2f | %.2f |\n", b / static_cast<double>(Bins),
      (b + 1) / static_cast<double>(Bins), bin.size(), MeanConfidence(bin),
      bin.empty() ? 0.0 : static_cast<double>(good) / static_cast<double>(bin.size()));
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, answers.size()));
  const double base = share / count;
  std::printf("\nBrier score %.3f (always saying the mean share: %.3f); calibration error (ECE, %d "
              "bins) %.3f, by chance alone %.3f\n",
    brier / count, base * (1.0 - base), Bins, CalibrationError(answers, right),
    ChanceError(answers));
  const bool met = sure <= MaximumSureShare * count;
  std::printf("\nWrong with a confidence above %.1f: %d of %zu answers. Limit: %.0f %%: %s\n", Sure,
    sure, answers.size(), 100.0 * MaximumSureShare, met ? "met" : "**MISSED**");
  return met;
}

void PrintCases(const std::vector<Result>& results)
{
  std::printf(
    "\n### Images\n\n| images | seed | LCA, mm | confidence | RCA, mm | confidence | doubt "
    "|\n|---|---|---|---|---|---|---|\n");
  for (const Result& result : results)
  {
    std::printf(
      "| %s | %llu |", result.group.c_str(), static_cast<unsigned long long>(result.seed));
    for (const char* name : { "LCA", "RCA" })
    {
      const auto answer = std::find_if(result.answers.begin(), result.answers.end(),
        [&](const Answer& a) { return a.name == name; });
      if (answer == result.answers.end())
      {
        std::printf(" - | |");
      }
      else if (std::isfinite(answer->error))
      {
        std::printf(" %.2f | %.2f |", answer->error, answer->confidence);
      }
      else
      {
        std::printf(" none there | %.2f |", answer->confidence);
      }
    }
    std::printf(" %s |\n", result.doubt.c_str());
  }
}

/// @return the exit code
int Validate(int argc, char** argv)
{
  CLI::App program("Automatic ostia where they are hard to find or missing, and their confidence");
  std::string seedText = "501..502";
  std::vector<std::string> groups;
  std::vector<std::string> names;
  for (const OstiaGroup& group : OstiaGroups())
  {
    names.emplace_back(group.name);
  }
  double coarsest = 0.0;
  bool quick = false;
  bool listCases = false;
  program.add_option("--seeds", seedText, "of the images of each kind: a count or first..last")
    ->capture_default_str();
  program.add_option("--groups", groups, "kinds of images; default all")
    ->check(CLI::IsMember(names));
  program.add_option("--coarsest", coarsest, "mm; no voxels are smaller")
    ->check(CLI::Range(0.0, 3.0));
  program.add_flag("--cases", listCases, "also print one row for each image");
  program.add_flag("--quick", quick, "one image of a few kinds, in coarse voxels");
  std::vector<std::uint64_t> seeds;
  try
  {
    program.parse(argc, argv);
    if (quick)
    {
      seedText = "501..501";
      groups = { "plain", "oblique", "no right ostium", "abdomen" };
      coarsest = 0.9;
    }
    seeds = ParseSeeds(seedText, LoneNumber::Count);
  }
  catch (const CLI::ParseError& error)
  {
    return program.exit(error);
  }
  std::printf(
    "Success: within %.0f mm of the true ostium of that name. An answer where there is no "
    "such ostium is wrong.\n",
    Tolerance);
  std::vector<Result> results;
  std::vector<Answer> answers;
  for (const std::string& group : groups.empty() ? names : groups)
  {
    for (const std::uint64_t seed : seeds)
    {
      results.push_back(Run(group, seed, coarsest));
      const Result& r = results.back();
      answers.insert(answers.end(), r.answers.begin(), r.answers.end());
      std::fprintf(stderr, "%s, seed %llu:", group.c_str(), static_cast<unsigned long long>(seed));
      for (const Answer& a : r.answers)
      {
        std::fprintf(stderr, " %s %.2f mm (%.2f)", a.name.c_str(), a.error, a.confidence);
      }
      std::fprintf(stderr, " %s\n", r.doubt.c_str());
    }
  }
  bool met = PrintGroups(results);
  met &= PrintConfidence(answers);
  if (listCases)
  {
    PrintCases(results);
  }
  return met ? 0 : 1;
}
}

int main(int argc, char** argv)
{
  try
  {
    return Validate(argc, argv);
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-ostia: %s\n", error.what());
  }
  catch (...)
  {
    std::fputs("validate-ostia: unknown error\n", stderr);
  }
  return 2;
}
