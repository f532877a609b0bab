#include "BenchmarkTables.h"

#include "ParallelFor.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <fstream>

namespace coronary
{
bool BenchmarkOptions::Has(const char* table) const
{
  return std::find(this->tables.begin(), this->tables.end(), table) != this->tables.end();
}

void BenchmarkOptions::AddTo(
  CLI::App& app, const std::string& peer, const std::vector<std::string>& allTables)
{
  this->tables = allTables;
  app.add_option("tables", this->tables, "Which tables (default: all)")
    ->check(CLI::IsMember(allTables));
  app.add_option("--repeats", this->repeats, "Runs of each measurement")
    ->check(CLI::Range(1, 1000))
    ->capture_default_str();
  app.add_option("--threads", this->threads, "Threads of each contestant")
    ->check(CLI::Range(1, 1024))
    ->capture_default_str();
  app.add_option("--seed", this->seed, "Of the random parts of the input")->capture_default_str();
  app.add_flag("--without-" + peer, this->withoutPeer, "Do not run the other library");
  app.add_flag("--strict", this->strict, "Exit code 1 when a target of time or memory is missed");
}

int Verdicts::ExitCode(const char* program, bool strict) const
{
  std::fflush(stdout);
  if (this->disagreement)
  {
    std::fprintf(stderr, "%s: the results disagree\n", program);
    return 1;
  }
  if (this->missedTarget && strict)
  {
    std::fprintf(stderr, "%s: a target of time or memory is missed\n", program);
    return 1;
  }
  return 0;
}

const char* Verdict(bool met)
{
  return met ? "met" : "**MISSED**";
}

std::string Format(const char* format, double value)
{
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string Spread(const std::vector<double>& values)
{
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  std::string text = Format("%.2f", Median(values));
  if (values.size() > 1)
  {
    text += " (" + Format("%.2f", *low) + " to " + Format("%.2f", *high) + ")";
  }
  return text;
}

double PeakGrowth(const std::vector<Measurement>& runs)
{
  const std::vector<double> growth =
    Each(runs, [](const Measurement& m) { return static_cast<double>(m.peakGrowth); });
  return *std::max_element(growth.begin(), growth.end());
}

void PrintMachine(const BenchmarkOptions& options)
{
  std::string model = "unknown processor";
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
  {
    if (line.rfind("model name", 0) == 0)
    {
      model = line.substr(line.find(':') + 2);
      break;
    }
  }
  std::string load;
  std::ifstream("/proc/loadavg") >> load;
  std::printf("%s, %d cores, load average %s at the start; GCC %d.%d; seed %llu; medians (smallest "
              "to largest) of %d runs.\n",
    model.c_str(), NumberOfThreads(), load.c_str(), __GNUC__, __GNUC_MINOR__,
    static_cast<unsigned long long>(options.seed), options.repeats);
}

int RunBenchmark(const char* program, const std::function<int()>& run)
{
  try
  {
    return run();
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
  }
  catch (...)
  {
    std::fprintf(stderr, "%s: unknown error\n", program);
  }
  return 1;
}
}
