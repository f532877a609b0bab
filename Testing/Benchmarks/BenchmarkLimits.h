// Benchmarks of Google's library that have a limit: with --strict, exit code 1 when one is missed.
#ifndef BenchmarkLimits_h
#define BenchmarkLimits_h

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
struct BenchmarkLimit
{
  std::string name;    ///< of the benchmark with its arguments
  double microseconds; ///< of the processor, an iteration
  double best = std::numeric_limits<double>::infinity();
};

class LimitReporter : public benchmark::ConsoleReporter
{
public:
  explicit LimitReporter(std::vector<BenchmarkLimit> limits)
    : Limits(std::move(limits))
  {
  }

  void ReportRuns(const std::vector<Run>& runs) override
  {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs)
    {
      for (BenchmarkLimit& limit : this->Limits)
      {
        // The best repetition: what else the machine does only makes it slower.
        if (run.run_type == Run::RT_Iteration && run.iterations > 0 &&
          run.run_name.str().rfind(limit.name, 0) == 0)
        {
          limit.best = std::min(
            limit.best, 1e6 * run.cpu_accumulated_time / static_cast<double>(run.iterations));
        }
      }
    }
  }

  /// @return whether all are met; one that was not measured is not
  bool Met() const
  {
    bool met = true;
    for (const BenchmarkLimit& limit : this->Limits)
    {
      const bool good = limit.best <= limit.microseconds;
      std::printf("%s: %.0f us, the limit is %.0f us%s\n", limit.name.c_str(), limit.best,
        limit.microseconds, good ? "" : ": missed");
      met = met && good;
    }
    return met;
  }

private:
  std::vector<BenchmarkLimit> Limits;
};

/// main() of a benchmark.
inline int RunBenchmarks(int argc, char** argv, std::vector<BenchmarkLimit> limits)
{
  char** const end = std::remove_if(argv + std::min(argc, 1), argv + argc,
    [](const char* argument) { return std::strcmp(argument, "--strict") == 0; });
  const bool strict = end != argv + argc;
  int count = static_cast<int>(end - argv);
  benchmark::Initialize(&count, argv);
  if (benchmark::ReportUnrecognizedArguments(count, argv))
  {
    return 2;
  }
  LimitReporter reporter(std::move(limits));
  benchmark::RunSpecifiedBenchmarks(&reporter);
  return strict && !reporter.Met() ? 1 : 0;
}
}

#endif
