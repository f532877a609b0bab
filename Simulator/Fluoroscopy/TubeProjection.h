// Line integrals through chains of solid or hollow frusta: what instruments and vessels have in common.
#ifndef DynamicCoronary_TubeProjection_h
#define DynamicCoronary_TubeProjection_h

#include "CArm.h"
#include "LineIntegrals.h"

#include <vector>

namespace coronary
{
/// Between two points of a chain. Radii at both ends, mm.
struct TubeSection
{
  double outer[2];
  double inner[2];
  double attenuation; ///< 1/mm
};

/// Checked arguments only: one section less than points, or neither.
void AddTubes(const std::vector<Vector3>& points, const std::vector<TubeSection>& sections,
  const CArmGeometry& geometry, LineIntegrals& image);

/// @throws std::invalid_argument naming what is projected
void RequireFormat(const char* what, const CArmGeometry& geometry, const LineIntegrals& image);
void RequireWithin(
  const char* what, const char* property, double value, double minimum, double maximum);
void RequirePoints(const char* what, const std::vector<Vector3>& points);
}

#endif
