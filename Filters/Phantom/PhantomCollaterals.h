/**
 * @file PhantomCollaterals.h
 * @brief Thin vessels that lead from one artery to what lies behind an occlusion of another.
 */
#ifndef DynamicCoronary_PhantomCollaterals_h
#define DynamicCoronary_PhantomCollaterals_h

#include "PhantomAnatomy.h"

namespace coronary
{
/**
 * Adds the collaterals of the settings' disease to `parts`, before all other parts, and to
 * `collaterals`. The tree, and what fills late in it, has to be there.
 * @throws std::invalid_argument for a vessel that is not there, a name that is
 */
void AddCollaterals(PhantomAnatomy& anatomy, const PhantomSettings& settings);
}

#endif
