/**
 * @file OstialOutlets.h
 * @brief The places of an aorta's wall that vessels hang on.
 */
#ifndef DynamicCoronary_OstialOutlets_h
#define DynamicCoronary_OstialOutlets_h

#include "AorticTubes.h"

#include <vector>

namespace coronary
{
/// A place on the wall that vessel hangs on. Directions are those of a patient whose aorta is upright: what
/// turns the axis upwards the shortest way turns them too.
struct Outlet
{
  CoronaryOstium ostium; ///< without name and confidence
  double volume = 0.0;   ///< mm^3 of bright vessel behind it
  double azimuth = 0.0;  ///< radians about the aorta: 0 left, pi/2 anterior
  double level = 0.0;    ///< mm along the aorta, from its lowest circle
  double tubular = 0.0;  ///< mean vesselness along the vessel, 0 to 1
  double shade = 0.0;    ///< mm of dark path within the first 10 mm
  double departure =
    0.0;               ///< cosine of the angle between the vessel and the wall's outward direction
  double unseen = 0.0; ///< mm of a hidden mouth that show no tube, not even a thin or dark one
  Vector3 course = Vector3::Zero(); ///< from the ostium to 40 mm along the vessel or its end, mm
};

struct AorticOutlets
{
  double mean = 0.0;      ///< HU of the blood
  double deviation = 0.0; ///< HU, its standard deviation
  /// HU of the blood in each of the tube's sections; NaN: outside of what was looked at.
  std::vector<double> sectionMeans;
  double chambers = 0.0;       ///< mm^3 well inside large bodies of arterial blood beside the tube
  std::vector<Outlet> outlets; ///< at most twelve, most vessel first; then mouths that are hidden
};

/// What hangs on a tube that may be the aorta.
/// @throws Cancelled
AorticOutlets FindOutlets(const ScalarImage& image, const AorticTube& tube,
  const CoronaryOstiaSettings& settings, const ProgressCallback& progress);
}

#endif
