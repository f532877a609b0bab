/**
 * @file AortaMotion.h
 * @brief The aorta's wall over the cycle: its root goes with the ostia of the coronary arteries, the arch stands still.
 */
#ifndef DynamicCoronary_AortaMotion_h
#define DynamicCoronary_AortaMotion_h

#include "WallMotion.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// mm along a line of what is nearest to a point.
double PlaceAlong(const std::vector<Vector3>& line, const Vector3& point);

/**
 * A point moves as the ostia do, weighted by the square of its distance to each, from the valve to RootAbove mm along the axis
 * above the higher one, and less and less from there on over FadesOver mm. How much of it moves is chosen.
 */
class AortaMotion
{
public:
  static constexpr double RootAbove = 10.0; ///< mm
  static constexpr double FadesOver = 60.0; ///< mm

  /// @param topology  its axes at rest, and its aorta
  /// @throws std::invalid_argument  there is no aorta, or it is not closed; no ostium is within 15 mm of it
  explicit AortaMotion(const WallTopology& topology);
  /// Of other points than the wall's, mm, at rest.
  AortaMotion(const WallTopology& topology, std::vector<Vector3> points);

  /// @param axis  as WallMotion::AxisPositions @param points  mm; resized
  void Positions(const std::vector<Vector3>& axis, std::vector<Vector3>& points) const;

private:
  struct Ostium
  {
    std::int64_t point = 0;   ///< of the axes, in one list
    Vector3 rest;             ///< mm
    std::vector<float> share; ///< per point of the wall
  };
  std::vector<Vector3> Rest;
  std::vector<Ostium> Ostia;
};
}

#endif
