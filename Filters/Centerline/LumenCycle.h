/**
 * @file LumenCycle.h
 * @brief The lumen of a tree over the heart cycle: radius and stenosis at each point and phase, and lesions.
 *
 * Points are those of the tree at the reference, material points that a motion carries along: a place of a vessel has one
 * distance from the ostium at all phases. Lesions are found in the median over the phases, in which what a single phase
 * shows wrongly does not count, and then looked at in each phase.
 */
#ifndef DynamicCoronary_LumenCycle_h
#define DynamicCoronary_LumenCycle_h

#include "StenosisGrading.h"

#include <vector>

namespace coronary
{
/// One value a phase; NaN where the lumen was not seen at it.
struct CycleLesion
{
  Stenosis median;              ///< in the median over the phases
  std::vector<double> diameter; ///< least within the lesion, mm
  std::vector<double> degree;   ///< by diameter, of the phase's own healthy diameter, 0 to 1
  int worst = -1;               ///< phase of the greatest degree; -1: not seen at any
};

/// Values [phase][point] and of points; NaN: not measured.
struct LumenCycle
{
  std::vector<double> times;
  std::vector<std::vector<double>> radius;    ///< mm
  std::vector<std::vector<double>> reference; ///< mm, of the healthy vessel
  std::vector<std::vector<double>> degree;    ///< by diameter, 0 to 1; 0: not graded
  std::vector<double> least;                  ///< radius over the phases, mm
  std::vector<double> median;
  std::vector<double> greatest;
  std::vector<double> medianReference; ///< mm, of the median
  std::vector<double> medianDegree;
  std::vector<CycleLesion> lesions; ///< by tree and abscissa
};

/**
 * @param tree    at the reference phase; named branches carry vessels on (VesselPaths)
 * @param times   one a phase
 * @param lumens  of the same points at each phase; of each `radius`, `measured`, `deviation`, `interpolated` and
 *                `calcium` are read
 * @throws std::invalid_argument as CheckTree, for no phases, another number of lumens than times, or of values than
 *         points; Cancelled
 */
LumenCycle GradeOverCycle(const VesselTree& tree, const std::vector<double>& times,
  const std::vector<RefinedLumen>& lumens, const ProgressCallback& progress = {});

/// The lumen that a tree says that it has: its radii, as measured.
RefinedLumen LumenOf(const VesselTree& tree);
}

#endif
