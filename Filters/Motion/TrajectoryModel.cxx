#include "TrajectoryModel.h"

#include <Eigen/Cholesky>

#include <cmath>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr double Turn = 6.283185307179586;

void RequireRange(const char* name, double value, double least, double greatest)
{
  if (!(value >= least && value <= greatest))
  {
    throw std::invalid_argument(std::string("TrajectoryPrior: ") + name + " must be from " +
      std::to_string(least) + " to " + std::to_string(greatest));
  }
}

int Harmonic(Eigen::Index basis)
{
  return static_cast<int>((basis + 1) / 2);
}
}

void TrajectoryPrior::Validate() const
{
  RequireRange("harmonics", this->harmonics, 1, 12);
  RequireRange("amplitude", this->amplitude, 1e-3, 1e3);
  RequireRange("decay", this->decay, 0.0, 4.0);
  RequireRange("neighbourChange", this->neighbourChange, 1e-4, 1e2);
  RequireRange("neighbourDecay", this->neighbourDecay, 0.0, 4.0);
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
  const Eigen::Index size = 2 * prior.harmonics + 1;
  const Eigen::Index unknowns = 3 * size;
  // Precisions of the coefficients themselves, and of their change along one mm.
  Eigen::VectorXd own(unknowns);
  Eigen::VectorXd change(unknowns);
  for (Eigen::Index b = 0; b < size; ++b)
  {
    const double m = std::max(1, Harmonic(b));
    const double sd = prior.amplitude / std::pow(m, prior.decay);
    const double walk = prior.neighbourChange / std::pow(m, prior.neighbourDecay);
    own.segment<3>(3 * b).setConstant(1.0 / (sd * sd));
    change.segment<3>(3 * b).setConstant(1.0 / (walk * walk));
  }

  std::vector<Eigen::MatrixXd> matrix(count);
  std::vector<Eigen::VectorXd> right(count);
  for (std::size_t n = 0; n < count; ++n)
  {
    matrix[n] = own.asDiagonal();
    right[n].setZero(unknowns);
    for (const TrajectoryMeasurement& one : measurements[n])
    {
      if (one.phase < 0 || one.phase >= static_cast<int>(times.size()))
      {
        throw std::invalid_argument(
          "FitTrajectories: there is no phase " + std::to_string(one.phase));
      }
      const Eigen::VectorXd& phi = basis[one.phase];
      const Vector3 pull = one.information * one.displacement;
      for (Eigen::Index a = 0; a < size; ++a)
      {
        right[n].segment<3>(3 * a) += phi[a] * pull;
        for (Eigen::Index b = 0; b < size; ++b)
        {
          matrix[n].block<3, 3>(3 * a, 3 * b) += phi[a] * phi[b] * one.information;
        }
      }
    }
    // Both ends of the step to the parent, and of those to the children below.
    if (nodes.parent[n] >= 0)
    {
      matrix[n].diagonal() += change / nodes.step[n];
    }
  }
  for (std::size_t n = 0; n < count; ++n)
  {
    if (nodes.parent[n] >= 0)
    {
      matrix[nodes.parent[n]].diagonal() += change / nodes.step[n];
    }
  }

  // Tips to roots; the coupling to the parent is -change / step, a diagonal.
  std::vector<Eigen::LLT<Eigen::MatrixXd>> factor(count);
  for (auto node = nodes.order.rbegin(); node != nodes.order.rend(); ++node)
  {
    const int n = *node;
    factor[n].compute(matrix[n]);
    const int parent = nodes.parent[n];
    if (parent >= 0)
    {
      const Eigen::VectorXd coupling = change / nodes.step[n];
      const Eigen::MatrixXd gain = factor[n].solve(Eigen::MatrixXd(coupling.asDiagonal()));
      matrix[parent] -= coupling.asDiagonal() * gain;
      right[parent] += coupling.cwiseProduct(factor[n].solve(right[n]));
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
      const Eigen::VectorXd coupling = change / nodes.step[n];
      const Eigen::MatrixXd gain = result.covariance[n] * coupling.asDiagonal();
      solution[n] += gain * solution[parent];
      result.covariance[n] += gain * result.covariance[parent] * gain.transpose();
    }
    result.coefficients[n] =
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(
        solution[n].data(), size, 3);
  }
  return result;
}
}
