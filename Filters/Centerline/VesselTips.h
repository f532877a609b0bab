/**
 * @file VesselTips.h
 * @brief Whether a vessel ends where its line does, or goes on behind a lesion that hides it.
 *
 * Vessels end thin, but by and by. A line that ends in a lesion is wide some millimetres before, and narrows at once.
 */
#ifndef DynamicCoronary_VesselTips_h
#define DynamicCoronary_VesselTips_h

#include "VesselPaths.h"

#include <array>
#include <cstddef>

namespace coronary
{
constexpr std::size_t NumberOfTipSigns = 3;
const std::array<const char*, NumberOfTipSigns>& TipSignNames();

struct VesselTip
{
  double end = 0.0;    ///< mm, radius of its last 2 mm
  double before = 0.0; ///< mm, radius 2 to 5 mm before
  double goesOn = 0.0; ///< probability that the vessel goes on, 0 to 1
  std::array<double, NumberOfTipSigns> signs{};
};

/// Of a vessel that goes on: it is told. Whole vessels of healthy phantoms have 0.26 at most.
constexpr double MinimumGoingOn = 0.3;

/**
 * One for each vessel. Of less than 4 mm nothing can be said: there it does not go on, and neither does what is named RCA.
 * @param tree   in mm, with the radius of the lumen that is left
 * @param paths  of that tree
 */
std::vector<VesselTip> JudgeTips(const VesselTree& tree, const std::vector<VesselPath>& paths);

/// How much wider than usual the vessels of a heart end, 0.9 to 1.3: when most of its ends are cut, they are no measure.
double TipCalibre(const VesselTree& tree, const std::vector<VesselPath>& paths);

/// Median radius between two distances from a vessel's tip, mm; 0 where there is no point.
double RadiusBeforeTip(const VesselTree& tree, const VesselPath& path, double from, double to);
}

#endif
