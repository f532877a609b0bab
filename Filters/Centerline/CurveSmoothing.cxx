#include "CurveSmoothing.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
/// Solves for all columns of `samples` at once.
Eigen::MatrixXd Whittaker(
  const Eigen::MatrixXd& samples, const std::vector<double>& weights, double wavelength, int order)
{
  const auto count = static_cast<int>(samples.rows());
  order = std::min(order, count - 1);
  if (order < 1 || !(wavelength > 0.0))
  {
    return samples;
  }
  const double lambda = std::pow(2.0 * std::sin(M_PI / std::max(2.0, wavelength)), -2.0 * order);
  std::vector<double> stencil{ 1.0 };
  for (int i = 0; i < order; ++i)
  {
    stencil.push_back(0.0);
    for (std::size_t j = stencil.size() - 1; j > 0; --j)
    {
      stencil[j] -= stencil[j - 1];
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < count; ++i)
  {
    // Without any weight nothing holds a run of samples at an end: the penalty alone is singular.
    entries.emplace_back(i, i, std::max(weights[i], 1e-9));
  }
  for (int row = 0; row + order < count; ++row)
  {
    for (int a = 0; a <= order; ++a)
    {
      for (int b = 0; b <= order; ++b)
      {
        entries.emplace_back(row + a, row + b, lambda * stencil[a] * stencil[b]);
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower,
    Eigen::NaturalOrdering<int>>
    solver(matrix);
  Eigen::MatrixXd right = samples;
  for (int i = 0; i < count; ++i)
  {
    right.row(i) *= std::max(weights[i], 1e-9);
  }
  return solver.solve(right);
}
}

std::vector<Vector3> ResampleCurve(const std::vector<Vector3>& points, double spacing)
{
  if (points.size() < 2)
  {
    return points;
  }
  std::vector<double> arc(points.size(), 0.0);
  for (std::size_t i = 1; i < points.size(); ++i)
  {
    arc[i] = arc[i - 1] + (points[i] - points[i - 1]).norm();
  }
  const int pieces = std::max(1, static_cast<int>(std::lround(arc.back() / spacing)));
  std::vector<Vector3> result{ points.front() };
  std::size_t at = 1;
  for (int i = 1; i < pieces; ++i)
  {
    const double s = arc.back() * i / pieces;
    while (at + 1 < points.size() && arc[at] < s)
    {
      ++at;
    }
    const double length = arc[at] - arc[at - 1];
    const double fraction = length > 0.0 ? (s - arc[at - 1]) / length : 0.0;
    result.emplace_back(points[at - 1] + fraction * (points[at] - points[at - 1]));
  }
  result.push_back(points.back());
  return result;
}

std::vector<Vector3> SmoothCurve(
  const std::vector<Vector3>& samples, const std::vector<double>& weights, double wavelength)
{
  Eigen::MatrixXd values(samples.size(), 3);
  for (std::size_t i = 0; i < samples.size(); ++i)
  {
    values.row(static_cast<Eigen::Index>(i)) = samples[i].transpose();
  }
  // Coordinates far from the origin would cost digits.
  const Eigen::RowVector3d origin =
    samples.empty() ? Eigen::RowVector3d(0.0, 0.0, 0.0) : Eigen::RowVector3d(values.row(0));
  values.rowwise() -= origin;
  values = Whittaker(values, weights, wavelength, 3);
  values.rowwise() += origin;
  std::vector<Vector3> result(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i)
  {
    result[i] = values.row(static_cast<Eigen::Index>(i)).transpose();
  }
  return result;
}

std::vector<double> SmoothSequence(
  const std::vector<double>& samples, const std::vector<double>& weights, double wavelength)
{
  Eigen::MatrixXd values(samples.size(), 1);
  for (std::size_t i = 0; i < samples.size(); ++i)
  {
    values(static_cast<Eigen::Index>(i), 0) = samples[i];
  }
  values = Whittaker(values, weights, wavelength, 2);
  return { values.data(), values.data() + values.rows() };
}
}
