/**
 * @file QuietestPhase.h
 * @brief Which phase of a gated series moves least.
 */
#ifndef DynamicCoronary_QuietestPhase_h
#define DynamicCoronary_QuietestPhase_h

#include <cstddef>
#include <vector>

namespace coronary
{
/**
 * The phase around which the samples change least per unit of time: mean absolute difference to
 * the neighbouring phases, divided by their distance in time. Of equals, as two phases always are, the one
 * nearest to mid-diastole (75 % of R-R): most hearts rest there longer than in end systole.
 *
 * Noise adds the same to every phase unless it differs from phase to phase: average the samples
 * over some voxels first.
 *
 * @param times    of the phases, strictly increasing
 * @param samples  of each phase, all of the same length: intensities, coordinates or the like.
 *                 Those that are not finite in a phase or its neighbour are left out there.
 * @return index into `times`
 * @throws std::invalid_argument when there is no phase, or the samples do not match
 */
std::size_t QuietestPhase(
  const std::vector<double>& times, const std::vector<std::vector<float>>& samples);
}

#endif
