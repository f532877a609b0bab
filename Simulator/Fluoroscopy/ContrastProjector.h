/**
 * @file ContrastProjector.h
 * @brief Line integrals through contrast medium in vessels and in the tissue behind them.
 */
#ifndef DynamicCoronary_ContrastProjector_h
#define DynamicCoronary_ContrastProjector_h

#include "CArm.h"
#include "LineIntegrals.h"

#include <vector>

namespace coronary
{
/// A vessel from its beginning to its end; the lumen between two points is a frustum of a cone.
struct ContrastBranch
{
  std::vector<Vector3> points;        ///< mm, where they are now
  std::vector<double> radii;          ///< mm, one a point
  std::vector<double> concentrations; ///< 0 to 1 of the neat medium, one an interval
};

/// A soft cloud with a Gauss profile.
struct ContrastBlush
{
  Vector3 position{ Vector3::Zero() }; ///< mm
  double volume = 0.0;                 ///< mL of the neat medium
  double sigma = 0.0;                  ///< mm
};

/**
 * Adds attenuation times concentration times chord as AddInstrument() does, with radii that change linearly along each
 * interval. Branches are independent: where one begins inside another both count, so a side branch should begin at
 * its parent's wall.
 * @param attenuation  of the neat medium, 1/mm
 * @throws std::invalid_argument when the image is not of the geometry's format, the numbers of a branch's values do
 *   not fit, or a value is out of range
 */
void AddContrast(const std::vector<ContrastBranch>& branches, double attenuation,
  const CArmGeometry& geometry, LineIntegrals& image);

/// Adds clouds, each pixel's mean in closed form across columns and rows; cut off at 4 sigma, with the total kept.
/// @throws std::invalid_argument
void AddBlush(const std::vector<ContrastBlush>& clouds, double attenuation,
  const CArmGeometry& geometry, LineIntegrals& image);
}

#endif
