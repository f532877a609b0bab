/**
 * @file InstrumentProjector.h
 * @brief Line integrals through wires and catheters.
 */
#ifndef DynamicCoronary_InstrumentProjector_h
#define DynamicCoronary_InstrumentProjector_h

#include "CArm.h"
#include "LineIntegrals.h"

#include <vector>

namespace coronary
{
/// Between two points: a cylinder, or the wall of a tube.
struct InstrumentSegment
{
  double outerRadius = 0.0; ///< mm
  double innerRadius = 0.0; ///< mm, 0 to outerRadius
  double attenuation = 0.0; ///< 1/mm
};

struct InstrumentChain
{
  std::vector<Vector3> points;             ///< mm, from end to end
  std::vector<InstrumentSegment> segments; ///< one less than points
};

/**
 * Adds the mean over each pixel of attenuation times chord, 2 sqrt(r^2 - d^2) / sin(theta), d being the distance of
 * ray and axis, theta their angle. The mean is closed form across the instrument, so that wires thinner than a pixel
 * keep their integral. Neighbouring segments are divided by the plane that bisects the joint; so nothing
 * is counted twice or left out there. Along the view a chord is as long as its segment.
 * Segments of no length attenuate nothing; those that are not wholly in front of the source are left out.
 * @throws std::invalid_argument when the image is not of the geometry's format, the numbers of points and segments do not fit, or
 *   a value is out of range
 */
void AddInstrument(
  const InstrumentChain& chain, const CArmGeometry& geometry, LineIntegrals& image);
}

#endif
