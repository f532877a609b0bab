/**
 * @file AorticModel.h
 * @brief The aorta's wall from the valve to the diaphragm as one closed surface, with its centerline.
 */
#ifndef DynamicCoronary_AorticModel_h
#define DynamicCoronary_AorticModel_h

#include "AorticArch.h"
#include "Geometry.h"

#include <vector>

namespace coronary
{
/// One cross-section of the wall.
struct AorticRing
{
  Vector3 centre; ///< mm
  std::vector<Vector3>
    rim; ///< mm, counter-clockwise seen from further along, as many in every ring
};

struct AorticModel
{
  std::vector<Vector3> points;         ///< mm, ring by ring from the valve on, then the two caps
  std::vector<Triangle> triangles;     ///< closed, 2-manifold, outwards
  std::vector<unsigned char> measured; ///< of each point: 1 seen, 0 completed, or in a cap

  std::vector<Vector3> axis;               ///< mm, from the valve to the diaphragm
  std::vector<double> radius;              ///< mm, of each of them: of the circle of the same area
  std::vector<unsigned char> axisMeasured; ///< 1 seen, 0 completed

  double measuredLength = 0.0;  ///< mm of axis
  double ascending = 0.0;       ///< completed mm of ascending aorta
  double arch = 0.0;            ///< the same of the arch
  double descending = 0.0;      ///< the same of the descending aorta
  bool towardsSeen = false;     ///< whether the arch leads to a descending aorta that is seen
  double ascendingRadius = 0.0; ///< mm, median of the seen part's last 20 mm
};

/**
 * Completes seen cross-sections and closes both ends with flat caps. A descending aorta that no arch can lead to is left
 * out of account.
 * @param seen  at least three, from the valve on, none crossing another, of at least eight points each
 * @throws std::invalid_argument as CompleteAorta, and for rings that do not fit to each other
 */
AorticModel ModelAorta(
  const std::vector<AorticRing>& seen, const AorticArchSettings& settings = {});

/// Of the circle with the area of a ring, mm.
double RadiusOf(const AorticRing& ring);
}

#endif
