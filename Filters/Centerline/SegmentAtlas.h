/**
 * @file SegmentAtlas.h
 * @brief The mean heart's coronary arteries, as curves with names.
 */
#ifndef DynamicCoronary_SegmentAtlas_h
#define DynamicCoronary_SegmentAtlas_h

#include "Geometry.h"

#include <limits>
#include <vector>

namespace coronary
{
/// Kinds of vessel; segments are pieces of them, or their first, second, third.
enum class Vessel : int
{
  Other = 0,
  LeftMain,
  AnteriorDescending,
  Circumflex,
  Ramus,
  Diagonal,
  Septal,
  ObtuseMarginal,
  LeftPosterolateral,
  LeftPosteriorDescending,
  RightCoronary,
  RightVentricular,
  AcuteMarginal,
  RightPosteriorDescending,
  RightPosterolateral,
  InferiorRight
};
constexpr int NumberOfVessels = 16;

inline bool IsLeft(Vessel vessel)
{
  return vessel >= Vessel::LeftMain && vessel <= Vessel::LeftPosteriorDescending;
}

/// Where a branch leaves its vessel in the mean heart, mm from the start of that vessel.
struct AtlasOrigin
{
  Vessel vessel; ///< of the branch
  int number;    ///< 1 first, 2 second, ...
  double arc;
};

/**
 * Courses and origins after Dodge et al., Circulation 1988;78:1167 (men, right dominant), LPS in mm
 * with the left ostium at the origin; the parts that Dodge does not give follow the grooves and the
 * epicardial ellipsoid that was fitted to his points.
 */
struct SegmentAtlas
{
  struct Point
  {
    Vector3 position;
    Vector3 tangent; ///< unit vector, downstream
    Vessel vessel;
    double arc;     ///< mm from the start of the vessel
    int number = 0; ///< 1 first, 2 second, ... of side branches that are counted
  };
  std::vector<Point> points; ///< about 2 mm apart
  std::vector<AtlasOrigin> origins;
  Vector3 leftOstium;
  Vector3 rightOstium;
  double midLadEnd;       ///< arc where the LAD's middle segment ends
  double acuteMarginArc;  ///< of the RCA
  double obtuseMarginArc; ///< of the LCx where its first marginal leaves
  double leftGrooveEnd;   ///< arc of the LCx where the posterolateral wall begins

  // The heart's frame: rows a, b, c (c from the base to the apex) and the middle of the groove.
  Matrix3 axes;
  Vector3 origin;

  /// The point of the epicardial ellipsoid at an azimuth about c (degrees, from a towards b) and a
  /// height below the groove (mm).
  Vector3 OnEpicardium(double azimuth, double height) const;

  /// The nearest point of a vessel, null without any; and its squared distance, mm^2, infinite without any.
  struct Nearest
  {
    const Point* point = nullptr;
    double squared = std::numeric_limits<double>::infinity();
  };
  Nearest NearestOf(Vessel vessel, const Vector3& position) const
  {
    Nearest nearest;
    for (const Point& one : this->points)
    {
      const double squared = (one.position - position).squaredNorm();
      if (one.vessel == vessel && squared < nearest.squared)
      {
        nearest = { &one, squared };
      }
    }
    return nearest;
  }

  static const SegmentAtlas& Get();
};
}

#endif
