/**
 * @file PhantomVesselPlans.h
 * @brief Courses and calibres of the coronary arteries of the mean heart.
 */
#ifndef DynamicCoronary_PhantomVesselPlans_h
#define DynamicCoronary_PhantomVesselPlans_h

#include "PhantomMotion.h"

#include <string>
#include <utility>
#include <vector>

namespace coronary
{
/// A control point of a vessel's course and the lumen diameter there.
struct Control
{
  Vector3 position; ///< world, mm, in the mean heart of size 1
  double diameter;  ///< mm
};

/// How much a vessel is drawn to the epicardial surface.
enum class VesselDepth
{
  Epicardial,
  Intramural
};

struct VesselPlan
{
  std::string name;
  int tree;
  std::string parent; ///< empty: starts at an ostium
  VesselDepth depth;
  std::vector<Control> controls;
  /// Segment from the start, then from the origin of the named child vessel on.
  int segment;
  std::vector<std::pair<std::string, int>> changes;
};
/// Control points: Dodge 1988 (positions) and 1992 (diameters of right-dominant men), in the order
/// of the vessel; points that Dodge does not give are placed by azimuth and height. Parents come
/// before their side vessels, but for vessels with an anomalous origin.
std::vector<VesselPlan> PlanVessels(const PhantomSettings& settings);
}

#endif
