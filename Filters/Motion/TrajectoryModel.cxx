#include "TrajectoryModel.h"

#include "Require.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

// A node's trajectory is u_i(t) = c_i0 + sum over m of (a_im cos 2 pi m t + b_im sin 2 pi m t), m up to 6, a Gaussian
// process: coefficients have the standard deviation 15 mm / m^2, and change along the vessel as a random walk of 0.2 mm
// / m per square root of a mm across it, 0.08 along it: a vessel bends more than it stretches. A measurement z_ik with
// information L_ik counts as
//     w^2 (u_i(t_k) - z_ik)^T L_ik (u_i(t_k) - z_ik),   w = 1 / (1 + |u_i(t_k) - z_ik|^2 / s^2)
// (Geman & McClure), s falling to 0.5 mm; of aligned vessels the distance is weighed by L_ik over its greatest
// eigenvalue (ApartOf). Given the weights, the most probable trajectories and their covariance are
// exact: the tree is eliminated from its tips to the roots and back.

namespace coronary
{
namespace
{
constexpr double Turn = 6.283185307179586;

int Harmonic(Eigen::Index basis)
{
  return static_cast<int>((basis + 1) / 2);
}

/// Per node: monomials up to the degree, scaled so that their products add up to the sum over d of
/// (sd_d)^2 (x . x')^d, which no rotation changes. sd: 1, 1, 1/2, 1/4, 1/8.
Eigen::MatrixXd Monomials(const std::vector<Vector3>& positions, int degree)
{
  Vector3 centre = Vector3::Zero();
  for (const Vector3& place : positions)
  {
    centre += place / static_cast<double>(positions.size());
  }
  double radius = 1e-6;
  for (const Vector3& place : positions)
  {
    radius = std::max(radius, (place - centre).norm());
  }
  constexpr std::array<double, 5> factorial{ 1.0, 1.0, 2.0, 6.0, 24.0 };
  const Eigen::Index size = (degree + 1) * (degree + 2) * (degree + 3) / 6;
  Eigen::MatrixXd result(static_cast<Eigen::Index>(positions.size()), size);
  for (std::size_t n = 0; n < positions.size(); ++n)
  {
    const Vector3 x = (positions[n] - centre) / radius;
    Eigen::Index column = 0;
    for (int d = 0; d <= degree; ++d)
    {
      const double deviation = d < 2 ? 1.0 : std::pow(0.5, d - 1);
      for (int a = 0; a <= d; ++a)
      {
        for (int b = 0; a + b <= d; ++b)
        {
          const int c = d - a - b;
          result(static_cast<Eigen::Index>(n), column++) = deviation *
            std::sqrt(factorial[d] / (factorial[a] * factorial[b] * factorial[c])) *
            std::pow(x[0], a) * std::pow(x[1], b) * std::pow(x[2], c);
        }
      }
    }
  }
  return result;
}

using Measurements = std::vector<std::vector<TrajectoryMeasurement>>;

/// Precision of the change of the coefficients from a node to its parent.
class Coupling
{
public:
  Coupling(const LineNodes& nodes, int node, const TrajectoryPrior& prior)
    : Decay(prior.neighbourDecay)
  {
    const Vector3 way = nodes.position[node] - nodes.position[nodes.parent[node]];
    const Vector3 along = way.norm() > 1e-6 ? Vector3(way.normalized()) : nodes.tangent[node];
    const double bend = 1.0 / (prior.neighbourChange * prior.neighbourChange);
    const double stretch = 1.0 / (prior.neighbourStretch * prior.neighbourStretch);
    this->First = (bend * Matrix3::Identity() + (stretch - bend) * along * along.transpose()) /
      nodes.step[node];
  }

  /// Of three coefficients of one harmonic.
  Matrix3 Of(Eigen::Index basis) const
  {
    return std::pow(std::max(1, Harmonic(basis)), 2.0 * this->Decay) * this->First;
  }

  /// The product with a column of all coefficients or more.
  Eigen::MatrixXd Times(const Eigen::MatrixXd& columns) const
  {
    Eigen::MatrixXd result(columns.rows(), columns.cols());
    for (Eigen::Index b = 0; 3 * b < columns.rows(); ++b)
    {
      result.middleRows<3>(3 * b).noalias() = this->Of(b) * columns.middleRows<3>(3 * b);
    }
    return result;
  }

  void AddTo(Eigen::MatrixXd& matrix) const
  {
    for (Eigen::Index b = 0; 3 * b < matrix.rows(); ++b)
    {
      matrix.block<3, 3>(3 * b, 3 * b) += this->Of(b);
    }
  }

private:
  double Decay;
  Matrix3 First;
};

/// Per node: the common motion's coefficients, basis x 3.
std::vector<Eigen::MatrixXd> FitCommonMotion(const LineNodes& nodes,
  const std::vector<Eigen::VectorXd>& basis, const Measurements& measurements,
  const TrajectoryPrior& prior)
{
  const Eigen::Index size = 2 * std::min(prior.harmonics, prior.commonHarmonics) + 1;
  const Eigen::Index own = 3 * size;
  const Eigen::MatrixXd monomials = Monomials(nodes.position, prior.commonDegree);
  const Eigen::Index functions = monomials.cols();
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(functions * own, functions * own);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(functions * own);
  const Matrix3 beside = Matrix3::Identity() * (prior.commonDeviation * prior.commonDeviation);
  Eigen::MatrixXd atNode(own, own);
  Eigen::VectorXd pull(own);
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    atNode.setZero();
    pull.setZero();
    for (const TrajectoryMeasurement& one : measurements[n])
    {
      // (L^-1 + s^2)^-1 = (1 + L s^2)^-1 L, also where L is singular.
      const Matrix3 information =
        (Matrix3::Identity() + one.information * beside).inverse() * one.information;
      const Eigen::VectorXd& phi = basis[one.phase];
      const Vector3 weighted = information * one.displacement;
      for (Eigen::Index a = 0; a < size; ++a)
      {
        pull.segment<3>(3 * a) += phi[a] * weighted;
        for (Eigen::Index b = 0; b < size; ++b)
        {
          atNode.block<3, 3>(3 * a, 3 * b) += phi[a] * phi[b] * information;
        }
      }
    }
    for (Eigen::Index f = 0; f < functions; ++f)
    {
      const double here = monomials(static_cast<Eigen::Index>(n), f);
      right.segment(f * own, own) += here * pull;
      for (Eigen::Index g = 0; g <= f; ++g)
      {
        matrix.block(f * own, g * own, own, own) +=
          here * monomials(static_cast<Eigen::Index>(n), g) * atNode;
      }
    }
  }
  for (Eigen::Index f = 0; f < functions; ++f)
  {
    for (Eigen::Index b = 0; b < size; ++b)
    {
      const double sd = prior.amplitude / std::pow(std::max(1, Harmonic(b)), prior.decay);
      matrix.diagonal().segment<3>(f * own + 3 * b).array() += 1.0 / (sd * sd);
    }
  }
  const Eigen::VectorXd solution = matrix.selfadjointView<Eigen::Lower>().llt().solve(right);
  std::vector<Eigen::MatrixXd> result;
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(own);
    for (Eigen::Index f = 0; f < functions; ++f)
    {
      sum += monomials(static_cast<Eigen::Index>(n), f) * solution.segment(f * own, own);
    }
    result.emplace_back(Eigen::MatrixXd::Zero(2 * prior.harmonics + 1, 3));
    result.back().topRows(size) =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(
        sum.data(), size, 3);
  }
  return result;
}
}

void TrajectoryPrior::Validate() const
{
  constexpr RequireOf require{ "TrajectoryPrior" };
  require.Range("harmonics", this->harmonics, 1, 12);
  require.Range("amplitude", this->amplitude, 1e-3, 1e3);
  require.Range("decay", this->decay, 0.0, 4.0);
  require.Range("neighbourChange", this->neighbourChange, 1e-4, 1e2);
  require.Range("neighbourStretch", this->neighbourStretch, 1e-4, 1e2);
  require.Range("neighbourDecay", this->neighbourDecay, 0.0, 4.0);
  require.Range("commonDegree", this->commonDegree, 0, 4);
  require.Range("commonHarmonics", this->commonHarmonics, 1, 12);
  require.Range("commonDeviation", this->commonDeviation, 0.1, 100.0);
}

Eigen::VectorXd PeriodicBasis(double time, int harmonics)
{
  Eigen::VectorXd basis(2 * harmonics + 1);
  basis[0] = 1.0;
  for (int m = 1; m <= harmonics; ++m)
  {
    basis[2 * m - 1] = std::cos(Turn * m * time);
    basis[2 * m] = std::sin(Turn * m * time);
  }
  return basis;
}

Vector3 Trajectories::Displacement(int node, double time) const
{
  const Eigen::MatrixXd& c = this->coefficients[node];
  return c.transpose() * PeriodicBasis(time, static_cast<int>(c.rows() - 1) / 2);
}

Vector3 Trajectories::Derivative(int node, double time) const
{
  const Eigen::MatrixXd& c = this->coefficients[node];
  const int harmonics = static_cast<int>(c.rows() - 1) / 2;
  Vector3 sum = Vector3::Zero();
  for (int m = 1; m <= harmonics; ++m)
  {
    const double w = Turn * m;
    sum += w * (std::cos(w * time) * c.row(2 * m) - std::sin(w * time) * c.row(2 * m - 1));
  }
  return sum;
}

double Trajectories::Deviation(int node, double time) const
{
  const Eigen::MatrixXd& all = this->covariance[node];
  const Eigen::Index size = all.rows() / 3;
  const Eigen::VectorXd basis = PeriodicBasis(time, static_cast<int>(size - 1) / 2);
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis)
  {
    for (Eigen::Index a = 0; a < size; ++a)
    {
      for (Eigen::Index b = 0; b < size; ++b)
      {
        sum += basis[a] * basis[b] * all(3 * a + axis, 3 * b + axis);
      }
    }
  }
  return std::sqrt(std::max(sum, 0.0) / 3.0);
}

Trajectories FitTrajectories(const LineNodes& nodes, const std::vector<double>& times,
  const std::vector<std::vector<TrajectoryMeasurement>>& measurements, const TrajectoryPrior& prior)
{
  prior.Validate();
  const std::size_t count = nodes.size();
  if (measurements.size() != count)
  {
    throw std::invalid_argument("FitTrajectories: measurements of " +
      std::to_string(measurements.size()) + " nodes instead of " + std::to_string(count));
  }
  std::vector<Eigen::VectorXd> basis;
  basis.reserve(times.size());
  for (const double time : times)
  {
    basis.push_back(PeriodicBasis(time, prior.harmonics));
  }
  for (const std::vector<TrajectoryMeasurement>& own : measurements)
  {
    for (const TrajectoryMeasurement& one : own)
    {
      if (one.phase < 0 || one.phase >= static_cast<int>(times.size()))
      {
        throw std::invalid_argument(
          "FitTrajectories: there is no phase " + std::to_string(one.phase));
      }
    }
  }
  std::vector<Eigen::MatrixXd> common;
  if (prior.commonDegree > 0)
  {
    common = FitCommonMotion(nodes, basis, measurements, prior);
  }
  const Eigen::Index size = 2 * prior.harmonics + 1;
  const Eigen::Index unknowns = 3 * size;
  Eigen::VectorXd own(unknowns); // precision of the coefficients themselves
  for (Eigen::Index b = 0; b < size; ++b)
  {
    const double m = std::max(1, Harmonic(b));
    const double sd = prior.amplitude / std::pow(m, prior.decay);
    own.segment<3>(3 * b).setConstant(1.0 / (sd * sd));
  }

  std::vector<Eigen::MatrixXd> matrix(count);
  std::vector<Eigen::VectorXd> right(count);
  for (std::size_t n = 0; n < count; ++n)
  {
    matrix[n] = own.asDiagonal();
    right[n].setZero(unknowns);
    for (const TrajectoryMeasurement& one : measurements[n])
    {
      const Eigen::VectorXd& phi = basis[one.phase];
      Vector3 beside = one.displacement;
      if (!common.empty())
      {
        beside -= common[n].transpose() * phi;
      }
      const Vector3 pull = one.information * beside;
      for (Eigen::Index a = 0; a < size; ++a)
      {
        right[n].segment<3>(3 * a) += phi[a] * pull;
        for (Eigen::Index b = 0; b < size; ++b)
        {
          matrix[n].block<3, 3>(3 * a, 3 * b) += phi[a] * phi[b] * one.information;
        }
      }
    }
  }
  // Both ends of the step to the parent.
  for (std::size_t n = 0; n < count; ++n)
  {
    if (nodes.parent[n] >= 0)
    {
      const Coupling coupling(nodes, static_cast<int>(n), prior);
      coupling.AddTo(matrix[n]);
      coupling.AddTo(matrix[nodes.parent[n]]);
    }
  }

  // Tips to roots; the block of a node and its parent is minus their coupling.
  std::vector<Eigen::LLT<Eigen::MatrixXd>> factor(count);
  for (auto node = nodes.order.rbegin(); node != nodes.order.rend(); ++node)
  {
    const int n = *node;
    factor[n].compute(matrix[n]);
    const int parent = nodes.parent[n];
    if (parent >= 0)
    {
      const Coupling coupling(nodes, n, prior);
      const Eigen::MatrixXd between = coupling.Times(Eigen::MatrixXd::Identity(unknowns, unknowns));
      matrix[parent] -= coupling.Times(factor[n].solve(between));
      right[parent] += coupling.Times(factor[n].solve(right[n]));
    }
  }
  // Roots to tips.
  Trajectories result;
  result.coefficients.resize(count);
  result.covariance.resize(count);
  std::vector<Eigen::VectorXd> solution(count);
  for (const int n : nodes.order)
  {
    const int parent = nodes.parent[n];
    result.covariance[n] = factor[n].solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
    solution[n] = factor[n].solve(right[n]);
    if (parent >= 0)
    {
      const Eigen::MatrixXd gain =
        Coupling(nodes, n, prior).Times(result.covariance[n]).transpose();
      solution[n] += gain * solution[parent];
      result.covariance[n] += gain * result.covariance[parent] * gain.transpose();
    }
    result.coefficients[n] =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(
        solution[n].data(), size, 3);
    if (!common.empty())
    {
      result.coefficients[n] += common[n];
    }
  }
  return result;
}
}
