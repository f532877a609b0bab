/**
 * @file PhantomCases.h
 * @brief Which phantoms the validation programs take.
 */
#ifndef DynamicCoronary_PhantomCases_h
#define DynamicCoronary_PhantomCases_h

#include "CoronaryPhantom.h"
#include "SweepSurface.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// What a number without ".." means.
enum class LoneNumber
{
  Seed, ///< that seed alone
  Count ///< seeds 1 to it
};

/// "3..7", or a number.
/// @throws CLI::ValidationError for anything else, and for more than 10,000 seeds
std::vector<std::uint64_t> ParseSeeds(const std::string& text, LoneNumber meaning);

/// A phantom at a moment of the cycle.
struct PhantomCase
{
  PhantomSettings settings;
  double moment = 0.75; ///< fraction of R-R
};

/// The phantom as it is by default; `varied`: dominance, ramus, stenoses, tortuosity, calibre and
/// moment change with the seed.
PhantomCase MakePhantomCase(std::uint64_t seed, bool varied);

/// The true tree as the sweep takes it.
VesselTree SweepTreeOf(const PhantomTree& truth);
}

#endif
