/**
 * @file OptionChecks.h
 * @brief Checks of option values whose messages say what is allowed.
 *
 * CLI11's own ranges let NaN through.
 */
#ifndef DynamicCoronary_OptionChecks_h
#define DynamicCoronary_OptionChecks_h

#include <CLI/CLI.hpp>

#include <string>

namespace coronary
{
/// A number, as short as it can be written for a reader.
std::string Format(double value);

/// A finite number from low to high.
CLI::Validator Within(double low, double high);

/// A whole number from low to high.
CLI::Validator WholeWithin(long low, long high);

/// --threads.
CLI::Option* AddThreads(
  CLI::App& app, int& threads, const std::string& help = "Number of threads; 0: all cores");

/// --size of a window in pixels, as 1500x860.
CLI::Option* AddWindowSize(CLI::App& app, int& width, int& height);
}

#endif
