/**
 * @file LocalDeformation.h
 * @brief How the heart turns and stretches around a node, by what it and the vessels around do.
 */
#ifndef DynamicCoronary_LocalDeformation_h
#define DynamicCoronary_LocalDeformation_h

#include "LineNodes.h"

#include <vector>

namespace coronary
{
/**
 * The deformation gradient (identity plus the displacement's gradient) at a node: the most probable one of an affine motion of
 * the nodes within 30 mm of it, which count less the farther they are. Where they do not tell, as around a straight vessel that
 * is alone, it turns rather than stretches, and nothing is stretched or turned without need.
 */
class LocalDeformation
{
public:
  explicit LocalDeformation(const LineNodes& nodes);

  /// @param displacement  per node, mm
  Matrix3 At(int node, const std::vector<Vector3>& displacement) const;

private:
  struct Neighbour
  {
    int node;
    double weight;
  };
  std::vector<Vector3> Positions;
  std::vector<std::vector<Neighbour>> Around; ///< per node, itself too
};

/// The rotation of a deformation gradient: its polar decomposition.
Matrix3 RotationOf(const Matrix3& deformation);
}

#endif
