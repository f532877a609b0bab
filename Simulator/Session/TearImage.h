/**
 * @file TearImage.h
 * @brief The shadow of contrast medium in torn walls, and of what came out of them.
 */
#ifndef DynamicCoronary_TearImage_h
#define DynamicCoronary_TearImage_h

#include "ContrastProjector.h"
#include "VesselTears.h"

#include <vector>

namespace coronary
{
/**
 * A stained wall is a stripe beside the lumen; what came out is clouds beside its hole, wide ones once it is spread. All of it
 * on the side away from the middle of the vessels, where the pericardium is, and with them. How it looks is chosen.
 * @param axis, lumen  mm, per point of the axes in one list, now
 * @param attenuation  of the neat medium, 1/mm
 */
void AddTears(const std::vector<VesselTear>& tears, const std::vector<Vector3>& axis,
  const std::vector<double>& lumen, double attenuation, const CArmGeometry& geometry,
  LineIntegrals& image);
}

#endif
