/**
 * @file PhantomComposition.h
 * @brief What a lesion is made of, and its calcium score.
 */
#ifndef DynamicCoronary_PhantomComposition_h
#define DynamicCoronary_PhantomComposition_h

#include "PhantomLumen.h"

namespace coronary
{
/**
 * Volumes of a lesion's parts at rest outside of the lumen, by sampling at 0.1 mm; what a voxel
 * shows where parts overlap counts here, too. Wires of stents are too thin to be told.
 *
 * The Agatston score (Agatston et al., J Am Coll Cardiol 1990;15:827) is that of the calcium alone
 * without contrast or blur: slices of 3 mm, pixels of 0.5 mm that mix calcium with 45 HU by volume,
 * 130 HU or more over at least 1 mm^2, times 1 to 4 by the greatest value at 120 kV.
 *
 * @param spot  index of the anatomy's balls of calcium that the lesion is, -1: none
 */
void MeasureComposition(const PhantomAnatomy& anatomy, const PhantomLumen& lumen, int lesion,
  int spot, PhantomLesionTruth& truth);
}

#endif
