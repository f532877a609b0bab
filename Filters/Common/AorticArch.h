/**
 * @file AorticArch.h
 * @brief The part of an aorta that an image does not show: arch and descending aorta down to the diaphragm, as a tube.
 *
 * From where the seen part ends the axis goes on in its own direction, turns through an arc of a circle to the left and
 * back, and goes straight down. Diameters are the means of Hager et al. (J Thorac Cardiovasc Surg 2002;123:1060, CT of
 * 70 adults), scaled to the patient's ascending aorta; lengths and places are chosen.
 */
#ifndef DynamicCoronary_AorticArch_h
#define DynamicCoronary_AorticArch_h

#include "Geometry.h"

#include <optional>
#include <vector>

namespace coronary
{
/// Where the seen part of an aorta ends.
struct AorticEnd
{
  Vector3 position;             ///< of the axis, mm, LPS
  Vector3 direction;            ///< unit vector onwards
  double radius = 0.0;          ///< mm
  double ascendingRadius = 0.0; ///< mm, of the ascending aorta, to which all others are scaled
  double length = 0.0;          ///< mm of axis from the valve to here
  double valveHeight = 0.0;     ///< z of the valve, mm
};

/// Where the descending aorta is, for who sees it.
struct DescendingAorta
{
  Vector3 place;     ///< of its axis, mm, LPS
  Vector3 direction; ///< unit vector downwards
};

struct AorticArchSettings
{
  /// What the arch leads to; not given: as the next two say.
  std::optional<DescendingAorta> descending;
  double width = 2.2;     ///< of the arch from axis to axis, ascending diameters, 1.5 to 5
  double backward = 63.0; ///< degrees from the left to the back of the arch's plane, 0 to 90
  /// mm of axis from the valve to where an upright aorta begins to turn, 0 to 200
  double ascendingLength = 75.0;
  double belowValve = 110.0; ///< mm from the valve down to the diaphragm, 0 to 300
  double spacing = 2.0;      ///< mm between stations at most, 0.1 to 10

  /// @throws std::invalid_argument that names the first setting that is out of range
  void Validate() const;
};

struct AorticCourse
{
  struct Station
  {
    Vector3 position;  ///< mm
    Vector3 direction; ///< unit vector onwards
    double radius;     ///< mm
    double length;     ///< mm from the end of the seen part
  };
  std::vector<Station> stations; ///< the first one is the end of the seen part itself
  double ascending = 0.0;        ///< mm that are still straight
  double arch = 0.0;             ///< mm of the arc
  double descending = 0.0;       ///< mm straight down
  bool reached = true; ///< false: the arc would be too tight or too wide for the descending aorta
};

/**
 * Position, direction and radius are continuous at the end of the seen part. An end that leans out of the arch's plane is
 * turned into it along the arc; one that has turned already begins within the arc.
 * @throws std::invalid_argument for an end without direction or radius, or that points down
 */
AorticCourse CompleteAorta(const AorticEnd& end, const AorticArchSettings& settings = {});

/// Mean diameters of Hager relative to the ascending aorta's, by how far the aorta has turned from upright, 0 to pi.
double AorticArchTaper(double turned);
}

#endif
