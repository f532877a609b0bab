#include "LocalDeformation.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>

#include <cmath>

namespace coronary
{
namespace
{
/// So far nodes tell of each other, and the standard deviation of their weights, mm.
constexpr double DeformationReach = 30.0;
constexpr double Width = 12.0;
/// What a node's displacement is off an affine motion, mm, and how many nodes are off alike.
constexpr double NodeDeviation = 1.0;
constexpr double AlikeNeighbours = 5.0;
/// Standard deviations of the components of what hearts do: strain, and rotation in radians.
constexpr double UsualStrain = 0.15;
constexpr double UsualRotation = 0.4;
}

LocalDeformation::LocalDeformation(const LineNodes& nodes)
  : Positions(nodes.position)
  , Around(nodes.size())
{
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    for (std::size_t other = 0; other < nodes.size(); ++other)
    {
      const double apart = (this->Positions[other] - this->Positions[n]).norm();
      if (apart <= DeformationReach)
      {
        this->Around[n].push_back(
          { static_cast<int>(other), std::exp(-0.5 * apart * apart / (Width * Width)) });
      }
    }
  }
}

Matrix3 LocalDeformation::At(int node, const std::vector<Vector3>& displacement) const
{
  // Of the displacement at the mean place, and of its gradient, that of each axis after the other.
  double total = 0.0;
  Vector3 place = Vector3::Zero();
  Vector3 mean = Vector3::Zero();
  for (const Neighbour& one : this->Around[node])
  {
    total += one.weight;
    place += one.weight * this->Positions[one.node];
    mean += one.weight * displacement[one.node];
  }
  place /= total;
  mean /= total;
  Matrix3 spread = Matrix3::Zero();
  Matrix3 moved = Matrix3::Zero(); // a row an axis of the displacement
  for (const Neighbour& one : this->Around[node])
  {
    const Vector3 from = this->Positions[one.node] - place;
    spread += one.weight * from * from.transpose();
    moved += one.weight * (displacement[one.node] - mean) * from.transpose();
  }
  const double information = 1.0 / (NodeDeviation * NodeDeviation * AlikeNeighbours);
  Eigen::Matrix<double, 9, 9> matrix = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 1> right;
  for (int axis = 0; axis < 3; ++axis)
  {
    matrix.block<3, 3>(3 * axis, 3 * axis) = information * spread;
    right.segment<3>(3 * axis) = information * moved.row(axis).transpose();
  }
  // Strain is half the sum of the gradient and its transpose, rotation half the difference.
  constexpr double strain = 0.25 / (UsualStrain * UsualStrain);
  constexpr double rotation = 0.25 / (UsualRotation * UsualRotation);
  for (int a = 0; a < 3; ++a)
  {
    matrix(4 * a, 4 * a) += 4.0 * strain;
    for (int b = 0; b < 3; ++b)
    {
      if (a != b)
      {
        matrix(3 * a + b, 3 * a + b) += 2.0 * (strain + rotation);
        matrix(3 * a + b, 3 * b + a) += 2.0 * (strain - rotation);
      }
    }
  }
  const Eigen::Matrix<double, 9, 1> gradient = matrix.llt().solve(right);
  return Matrix3::Identity() +
    Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(gradient.data());
}

Matrix3 RotationOf(const Matrix3& deformation)
{
  const Eigen::JacobiSVD<Matrix3> svd(deformation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3 u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0)
  {
    u.col(2) = -u.col(2);
  }
  return u * svd.matrixV().transpose();
}
}
