#include "MotionFilling.h"

#include "CyclicTime.h"
#include "ParallelFor.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace coronary
{
namespace
{
constexpr int RobustRounds = 6;
/// At the reference the lines are where they are, mm.
constexpr double ReferenceDeviation = 0.05;
/// Of what was seen, mm.
constexpr double SeenDeviation = 0.15;
/// Of the guess of a place that was not seen, where another one's prediction needs it, mm.
constexpr double GuessDeviation = 1.0;
/// Nothing is filled better than that, mm.
constexpr double LeastDeviation = 0.3;
/// Of what was filled, so many nodes tell the same.
constexpr double AlikeNodes = 10.0;
/// What was filled counts less when the fit is farther from it, mm.
constexpr double FilledScale = 2.0;
constexpr double Turn = 6.283185307179586;
/// Over which what the prediction misses is alike, mm.
constexpr double FieldLength = 30.0;
/// So many nodes around tell of one.
constexpr std::size_t Neighbours = 120;
constexpr std::size_t LeastNeighbours = 8;

/// Linear prediction of a node's displacement at a phase from those at others; the reference counts as one.
struct Prediction
{
  std::vector<std::size_t> phases;
  Eigen::VectorXd weights; ///< of these
  double deviation = 0.0;  ///< of the prediction, by the prior, mm
};

class Filler
{
public:
  Filler(const LineNodes& nodes, const std::vector<double>& times, double referenceTime,
    const std::vector<std::vector<Vector3>>& displacement,
    const std::vector<std::vector<bool>>& seen, const TrajectoryPrior& prior)
    : Nodes(nodes)
    , Times(times)
    , ReferenceTime(referenceTime)
    , Displacement(displacement)
    , Seen(seen)
    , Prior(prior)
  {
  }

  /// @return false: too little was seen at the phase
  bool Fill(std::size_t phase, std::size_t node, Vector3& place, double& deviation) const;

private:
  double Covariance(double a, double b) const;
  Prediction PredictionOf(std::size_t phase, std::size_t node) const;
  std::vector<std::size_t> NodesAround(std::size_t phase, std::size_t node) const;

  const LineNodes& Nodes;
  const std::vector<double>& Times;
  const double ReferenceTime;
  const std::vector<std::vector<Vector3>>& Displacement;
  const std::vector<std::vector<bool>>& Seen;
  const TrajectoryPrior& Prior;
};

double Filler::Covariance(double a, double b) const
{
  double sum = this->Prior.amplitude * this->Prior.amplitude;
  for (int m = 1; m <= this->Prior.harmonics; ++m)
  {
    const double sd = this->Prior.amplitude / std::pow(m, this->Prior.decay);
    sum += sd * sd * std::cos(Turn * m * (a - b));
  }
  return sum;
}

Prediction Filler::PredictionOf(std::size_t phase, std::size_t node) const
{
  Prediction result;
  std::vector<double> times;
  for (std::size_t k = 0; k < this->Times.size(); ++k)
  {
    if (this->Seen[k][node])
    {
      result.phases.push_back(k);
      times.push_back(this->Times[k]);
    }
  }
  times.push_back(this->ReferenceTime); // it has no displacement there
  const auto count = static_cast<Eigen::Index>(times.size());
  Eigen::MatrixXd matrix(count, count);
  Eigen::VectorXd right(count);
  for (Eigen::Index a = 0; a < count; ++a)
  {
    right[a] = this->Covariance(times[a], this->Times[phase]);
    for (Eigen::Index b = 0; b < count; ++b)
    {
      matrix(a, b) = this->Covariance(times[a], times[b]);
    }
    matrix(a, a) +=
      a + 1 == count ? ReferenceDeviation * ReferenceDeviation : SeenDeviation * SeenDeviation;
  }
  const Eigen::VectorXd weights = matrix.llt().solve(right);
  const double left = this->Covariance(this->Times[phase], this->Times[phase]) - right.dot(weights);
  result.weights = weights.head(count - 1);
  result.deviation = std::sqrt(std::max(left, 0.0));
  return result;
}

std::vector<std::size_t> Filler::NodesAround(std::size_t phase, std::size_t node) const
{
  std::vector<std::size_t> around;
  for (std::size_t n = 0; n < this->Nodes.size(); ++n)
  {
    if (this->Seen[phase][n])
    {
      around.push_back(n);
    }
  }
  const auto nearer = [&](std::size_t a, std::size_t b)
  {
    const double first = (this->Nodes.position[a] - this->Nodes.position[node]).squaredNorm();
    const double second = (this->Nodes.position[b] - this->Nodes.position[node]).squaredNorm();
    return first != second ? first < second : a < b;
  };
  std::sort(around.begin(), around.end(), nearer);
  around.resize(std::min(around.size(), Neighbours));
  return around;
}

bool Filler::Fill(std::size_t phase, std::size_t node, Vector3& place, double& deviation) const
{
  const std::vector<std::size_t> around = this->NodesAround(phase, node);
  if (around.size() < LeastNeighbours)
  {
    return false;
  }
  const Prediction prediction = this->PredictionOf(phase, node);
  const auto predicted = [&](std::size_t n)
  {
    Vector3 sum = Vector3::Zero();
    for (std::size_t s = 0; s < prediction.phases.size(); ++s)
    {
      sum += prediction.weights[static_cast<Eigen::Index>(s)] *
        this->Displacement[prediction.phases[s]][n];
    }
    return sum;
  };
  // What the same prediction misses where it can be told.
  const auto count = static_cast<Eigen::Index>(around.size());
  Eigen::MatrixXd missed(count, 3);
  Eigen::VectorXd noise(count);
  for (Eigen::Index a = 0; a < count; ++a)
  {
    const std::size_t n = around[static_cast<std::size_t>(a)];
    missed.row(a) = (this->Displacement[phase][n] - predicted(n)).transpose();
    double variance = SeenDeviation * SeenDeviation;
    for (std::size_t s = 0; s < prediction.phases.size(); ++s)
    {
      const double own = this->Seen[prediction.phases[s]][n] ? SeenDeviation : GuessDeviation;
      const double weight = prediction.weights[static_cast<Eigen::Index>(s)] * own;
      variance += weight * weight;
    }
    noise[a] = variance;
  }
  const double scale = std::max(missed.squaredNorm() / (3.0 * static_cast<double>(count)), 1e-4);
  const auto field = [&](std::size_t a, std::size_t b)
  {
    const Vector3 first = (this->Nodes.position[a] - this->Nodes.position[node]) / FieldLength;
    const Vector3 second = (this->Nodes.position[b] - this->Nodes.position[node]) / FieldLength;
    return scale * (1.0 + first.dot(second) + std::exp(-0.5 * (first - second).squaredNorm()));
  };
  Eigen::MatrixXd matrix(count, count);
  Eigen::VectorXd right(count);
  for (Eigen::Index a = 0; a < count; ++a)
  {
    right[a] = field(around[static_cast<std::size_t>(a)], node);
    for (Eigen::Index b = 0; b <= a; ++b)
    {
      matrix(a, b) =
        field(around[static_cast<std::size_t>(a)], around[static_cast<std::size_t>(b)]);
      matrix(b, a) = matrix(a, b);
    }
    matrix(a, a) += noise[a];
  }
  const Eigen::VectorXd weights = matrix.llt().solve(right);
  place = predicted(node) + missed.transpose() * weights;
  const double left = std::max(0.0, field(node, node) - right.dot(weights));
  deviation = std::sqrt(left + LeastDeviation * LeastDeviation);
  return true;
}
}

Trajectories FitRobustly(const LineNodes& nodes, const std::vector<double>& times,
  double referenceTime, const std::vector<const MotionMeasurements*>& measurements,
  const TrajectoryPrior& prior)
{
  const std::size_t phases = times.size();
  std::vector<double> moments = times;
  moments.push_back(referenceTime);
  const TrajectoryMeasurement fixed{ static_cast<int>(phases), Vector3::Zero(),
    Matrix3::Identity() / (ReferenceDeviation * ReferenceDeviation) };
  Trajectories motion;
  for (int round = 0; round < RobustRounds; ++round)
  {
    std::vector<std::vector<TrajectoryMeasurement>> all(nodes.size(), { fixed });
    for (const MotionMeasurements* one : measurements)
    {
      const double scale = one->robustScale * std::max(1.0, 3.0 - round);
      for (std::size_t n = 0; n < nodes.size(); ++n)
      {
        for (std::size_t k = 0; k < phases; ++k)
        {
          const Vector3& displacement = one->displacement[k][n];
          double share = 1.0;
          if (round > 0)
          {
            const double apart =
              (motion.Displacement(static_cast<int>(n), times[k]) - displacement).norm();
            share = 1.0 / (1.0 + apart * apart / (scale * scale));
          }
          all[n].push_back({ static_cast<int>(k), displacement,
            one->information[k][n] * share * share }); // Geman & McClure
        }
      }
    }
    motion = FitTrajectories(nodes, moments, all, prior);
  }
  return motion;
}

MotionMeasurements FillUnseen(const LineNodes& nodes, const std::vector<double>& times,
  double referenceTime, const std::vector<std::vector<Vector3>>& displacement,
  const std::vector<std::vector<bool>>& seen, const TrajectoryPrior& prior)
{
  const Filler filler(nodes, times, referenceTime, displacement, seen, prior);
  MotionMeasurements result;
  result.displacement = displacement;
  result.information.assign(times.size(), std::vector<Matrix3>(nodes.size(), Matrix3::Zero()));
  ParallelFor(static_cast<std::int64_t>(times.size() * nodes.size()), 8,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const std::size_t k = static_cast<std::size_t>(i) / nodes.size();
        const std::size_t n = static_cast<std::size_t>(i) % nodes.size();
        double deviation = 0.0;
        if (!seen[k][n] && filler.Fill(k, n, result.displacement[k][n], deviation))
        {
          result.information[k][n] = Matrix3::Identity() / (deviation * deviation);
        }
      }
    });
  return result;
}

Trajectories FitFilled(const LineNodes& nodes, const std::vector<double>& times,
  double referenceTime, const std::vector<std::vector<bool>>& seen,
  const std::vector<const MotionMeasurements*>& measurements, const TrajectoryPrior& prior)
{
  const std::size_t phases = times.size();
  // A phase at which nothing was seen has nothing but what was measured.
  std::vector<bool> blind(phases);
  for (std::size_t k = 0; k < phases; ++k)
  {
    blind[k] = std::none_of(seen[k].begin(), seen[k].end(), [](bool own) { return own; });
  }
  const auto weighed = [&](const auto& weight)
  {
    std::vector<MotionMeasurements> result;
    for (const MotionMeasurements* one : measurements)
    {
      result.push_back(*one);
      for (std::size_t k = 0; k < phases; ++k)
      {
        for (std::size_t n = 0; !blind[k] && n < nodes.size(); ++n)
        {
          if (!seen[k][n])
          {
            result.back().information[k][n] *= weight(*one, k, n);
          }
        }
      }
    }
    return result;
  };
  const auto fit = [&](const std::vector<MotionMeasurements>& measured)
  {
    std::vector<const MotionMeasurements*> all;
    all.reserve(measured.size());
    for (const MotionMeasurements& one : measured)
    {
      all.push_back(&one);
    }
    return FitRobustly(nodes, times, referenceTime, all, prior);
  };
  const Trajectories known =
    fit(weighed([](const MotionMeasurements&, std::size_t, std::size_t) { return 0.0; }));
  std::vector<std::vector<Vector3>> displacement(phases, std::vector<Vector3>(nodes.size()));
  for (std::size_t k = 0; k < phases; ++k)
  {
    for (std::size_t n = 0; n < nodes.size(); ++n)
    {
      displacement[k][n] = known.Displacement(static_cast<int>(n), times[k]);
    }
  }
  MotionMeasurements filled = FillUnseen(nodes, times, referenceTime, displacement, seen, prior);
  filled.robustScale = FilledScale;
  // By how far it is from what was filled, as far as that is known; for good, or all of a branch could drift there.
  const auto agreement = [&](const MotionMeasurements& one, std::size_t k, std::size_t n)
  {
    const double information = filled.information[k][n].trace();
    if (!(information > 0.0))
    {
      return 1.0;
    }
    const double apart = (filled.displacement[k][n] - one.displacement[k][n]).squaredNorm();
    return std::exp(-apart / (one.robustScale * one.robustScale + 9.0 / information));
  };
  std::vector<MotionMeasurements> all = weighed(agreement);
  // Neighbours are filled from the same, and wrong together: what they say is not said by each anew.
  for (std::vector<Matrix3>& phase : filled.information)
  {
    for (Matrix3& information : phase)
    {
      information /= AlikeNodes;
    }
  }
  all.push_back(std::move(filled));
  return fit(all);
}
}
