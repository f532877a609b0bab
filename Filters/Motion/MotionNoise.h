/**
 * @file MotionNoise.h
 * @brief How noisy the places of a sequence are, told by the sequence itself.
 */
#ifndef DynamicCoronary_MotionNoise_h
#define DynamicCoronary_MotionNoise_h

#include "PoseSequence.h"

#include <vector>

namespace coronary
{
/**
 * Per phase, standard deviation along each axis, mm: how far displacements from rest are off the line between those 4 mm
 * before and after them along the vessel, median of the places whose confidence is at least 0.5. Tissue moves nearly
 * linearly over such a length, so what is off is noise; what a heart's own motion shows there, 0.1 mm, is taken out.
 * Errors that are alike over more than that, a branch that slid along itself, are not seen.
 * 0 where fewer than 20 places can tell.
 *
 * @param lines  at rest
 * @throws std::invalid_argument as CheckPoseSequence and CheckPolylines
 */
std::vector<double> NoiseOfPhases(const PoseSequence& sequence, const Polylines& lines);
}

#endif
