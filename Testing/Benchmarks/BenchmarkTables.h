/**
 * @file BenchmarkTables.h
 * @brief What the benchmarks that print tables in Markdown share: options, rows of measurements, verdicts.
 */
#ifndef DynamicCoronary_BenchmarkTables_h
#define DynamicCoronary_BenchmarkTables_h

#include "MeasuredProcess.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace CLI
{
class App;
}

namespace coronary
{
struct BenchmarkOptions
{
  std::vector<std::string> tables;
  int size = 256;
  int repeats = 3;
  int threads = 2;
  std::uint64_t seed = 1;
  bool withoutPeer = false; ///< what ours is compared with is left out
  bool strict = false;

  bool Has(const char* table) const;

  /// All but the size. @param peer  as in --without-itk
  void AddTo(CLI::App& app, const std::string& peer, const std::vector<std::string>& allTables);
};

/// What was missed, by severity.
struct Verdicts
{
  bool disagreement = false;
  bool missedTarget = false;

  /// Says what was missed. @return 1 for a disagreement and, when strict, for a missed target
  int ExitCode(const char* program, bool strict) const;
};

const char* Verdict(bool met);

std::string Format(const char* format, double value);

/// Median (smallest to largest).
std::string Spread(const std::vector<double>& values);

/// Greatest of all runs, bytes beyond what was there when the work began.
double PeakGrowth(const std::vector<Measurement>& runs);

template <typename Work>
std::vector<Measurement> Repeat(const BenchmarkOptions& options, const Work& work)
{
  std::vector<Measurement> runs;
  runs.reserve(static_cast<std::size_t>(options.repeats));
  for (int run = 0; run < options.repeats; ++run)
  {
    runs.push_back(work());
  }
  return runs;
}

/// Processor, load, compiler and the options in a sentence.
void PrintMachine(const BenchmarkOptions& options);

/// Runs a program and says what it throws. @return its exit code, or 1
int RunBenchmark(const char* program, const std::function<int()>& run);
}

#endif
