// The open edges of a surface that is cleaned, and what closes them. Inside the library only.
#ifndef DynamicCoronary_SurfaceRims_h
#define DynamicCoronary_SurfaceRims_h

#include "SurfaceCells.h"
#include "SurfaceCleaning.h"

namespace coronary
{
constexpr char overlappingZone = 1; ///< had inner parts, or a band between two rims
constexpr char cappedZone = 2;      ///< had a cap

/// A closed line of open edges, in the direction that a patch over it runs.
struct SurfaceRim
{
  std::vector<std::int64_t> points;
  std::vector<std::int64_t> cells; ///< per point: the triangle at the edge to the next one
  Vector3 centre = Vector3::Zero();
  Vector3 normal = Vector3::Zero(); ///< out of the surface
  double radius = 0.0;
  double flatness = 0.0; ///< greatest distance to the plane, mm
  bool end = false;      ///< of a vessel, not a hole of its wall
  std::int64_t component = -1;
  std::int64_t zone = -1;
};

/// The surface must be oriented and without pinches.
std::vector<SurfaceRim> FindRims(const SurfaceCells& surface);

/// How many, and where the first one is.
struct ClosedRims
{
  std::int64_t joined = 0; ///< pairs of ends
  std::int64_t holes = 0;
  std::int64_t caps = 0;
  Vector3 joinedAt = Vector3::Zero();
  Vector3 holeAt = Vector3::Zero();
  Vector3 capAt = Vector3::Zero();
};

/**
 * Joins ends that face each other, then closes what is left.
 * @param kinds   per zone, when triangles were taken out: overlappingZone, cappedZone
 * @param zoneOf  per point: the zone of what was taken out there, or -1; empty: nothing was
 */
ClosedRims CloseRims(SurfaceCells& surface, const SurfaceCleaningSettings& settings,
  const std::vector<char>& kinds = {}, const std::vector<std::int64_t>& zoneOf = {});
}

#endif
