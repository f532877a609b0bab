/**
 * @file DistanceOptions.h
 * @brief How surfaces are compared, as options of the command line.
 */
#ifndef DynamicCoronary_DistanceOptions_h
#define DynamicCoronary_DistanceOptions_h

#include "MeshDistance.h"

#include <CLI/CLI.hpp>

namespace coronary
{
/// Adds the options of the error bound and of the vessels' ends.
void AddDistanceOptions(CLI::App& app, MeshDistanceSettings& settings);
}

#endif
