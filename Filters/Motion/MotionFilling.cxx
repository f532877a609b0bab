#include "MotionFilling.h"

#include "CyclicTime.h"
#include "ParallelFor.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
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
/// By how much of another phase's motion a phase may differ from what the times alone say.
constexpr double WeightDeviation = 0.3;
/// So far apart the surroundings of two places, 5 mm around each, have hardly anything in common, mm.
constexpr double NotAlike = 8.0;
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

/// What is known of a node at a phase.
struct Sighting
{
  Vector3 displacement = Vector3::Zero();
  double variance = 0.0; ///< along each axis, mm^2; 0: nothing is known
};

/// What is known of all nodes at a phase.
struct Sightings
{
  std::vector<Sighting> nodes;
  double alike = 1.0; ///< so many nodes around each other are wrong together
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

  /// Adds what is known of all nodes that were not seen at a phase.
  void FillPhase(std::size_t phase, const std::vector<const MotionMeasurements*>& measurements,
    MotionMeasurements& filled) const;

private:
  /// Of all nodes: where those are that were seen; at a phase at which nothing was, what was measured there all the same,
  /// as far as it agrees with a motion of the whole heart.
  Sightings SightingsAt(
    std::size_t phase, const std::vector<const MotionMeasurements*>& measurements) const;
  Sightings MeasuredAt(
    std::size_t phase, const std::vector<const MotionMeasurements*>& measurements) const;
  /// @param sightings  of all nodes at the phase. @return false: too little is known at the phase
  bool Fill(std::size_t node, const Prediction& prediction, const Sightings& sightings,
    Vector3& place, double& deviation) const;
  double Covariance(double a, double b) const;
  /// Whether any node was seen at a phase.
  bool IsSighted(std::size_t phase) const;
  /// The phases at which a node was seen.
  std::vector<std::size_t> SeenPhases(std::size_t node) const;
  Prediction PredictionFrom(std::vector<std::size_t> phases, std::size_t phase) const;
  Vector3 Predicted(const Prediction& prediction, std::size_t node) const;
  /// Of what is known of a node, and of what its prediction is made of.
  double VarianceOf(const Prediction& prediction, std::size_t node, const Sighting& sighting) const;
  /// A beat may contract more, earlier or otherwise than the times alone say: weights that fit what is known of the
  /// whole heart at the phase. What hardly moves at any phase is then not moved by those around it.
  void FitWeights(Prediction& prediction, const Sightings& sightings) const;
  std::vector<std::size_t> NodesAround(std::size_t node, const Sightings& sightings) const;

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

bool Filler::IsSighted(std::size_t phase) const
{
  return std::any_of(
    this->Seen[phase].begin(), this->Seen[phase].end(), [](bool own) { return own; });
}

std::vector<std::size_t> Filler::SeenPhases(std::size_t node) const
{
  std::vector<std::size_t> phases;
  for (std::size_t k = 0; k < this->Times.size(); ++k)
  {
    if (this->Seen[k][node])
    {
      phases.push_back(k);
    }
  }
  return phases;
}

Prediction Filler::PredictionFrom(std::vector<std::size_t> phases, std::size_t phase) const
{
  Prediction result;
  result.phases = std::move(phases);
  std::vector<double> times;
  for (const std::size_t k : result.phases)
  {
    times.push_back(this->Times[k]);
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

Vector3 Filler::Predicted(const Prediction& prediction, std::size_t node) const
{
  Vector3 sum = Vector3::Zero();
  for (std::size_t s = 0; s < prediction.phases.size(); ++s)
  {
    sum += prediction.weights[static_cast<Eigen::Index>(s)] *
      this->Displacement[prediction.phases[s]][node];
  }
  return sum;
}

double Filler::VarianceOf(
  const Prediction& prediction, std::size_t node, const Sighting& sighting) const
{
  double variance = sighting.variance;
  for (std::size_t s = 0; s < prediction.phases.size(); ++s)
  {
    const double own = this->Seen[prediction.phases[s]][node] ? SeenDeviation : GuessDeviation;
    const double weight = prediction.weights[static_cast<Eigen::Index>(s)] * own;
    variance += weight * weight;
  }
  return variance;
}

Sightings Filler::SightingsAt(
  std::size_t phase, const std::vector<const MotionMeasurements*>& measurements) const
{
  if (!this->IsSighted(phase))
  {
    return this->MeasuredAt(phase, measurements);
  }
  Sightings result;
  result.nodes.resize(this->Nodes.size());
  for (std::size_t n = 0; n < this->Nodes.size(); ++n)
  {
    if (this->Seen[phase][n])
    {
      result.nodes[n] = { this->Displacement[phase][n], SeenDeviation * SeenDeviation };
    }
  }
  return result;
}

Sightings Filler::MeasuredAt(
  std::size_t phase, const std::vector<const MotionMeasurements*>& measurements) const
{
  std::vector<Sighting> measured(this->Nodes.size());
  for (std::size_t n = 0; n < this->Nodes.size(); ++n)
  {
    Matrix3 information = Matrix3::Zero();
    Vector3 pull = Vector3::Zero();
    for (const MotionMeasurements* one : measurements)
    {
      information += one->information[phase][n];
      pull += one->information[phase][n] * one->displacement[phase][n];
    }
    const double trace = information.trace();
    if (trace > 0.0)
    {
      // Tissue may say nothing of one direction.
      information += 1e-3 * trace * Matrix3::Identity();
      measured[n] = { information.llt().solve(pull), 3.0 / trace };
    }
  }
  std::vector<std::size_t> phases;
  for (std::size_t k = 0; k < this->Times.size(); ++k)
  {
    if (this->IsSighted(k))
    {
      phases.push_back(k);
    }
  }
  Sightings result{ measured, AlikeNodes };
  std::vector<Vector3> missed(this->Nodes.size(), Vector3::Zero());
  std::vector<double> share(this->Nodes.size(), 0.0);
  for (int round = 0; round < RobustRounds && !phases.empty(); ++round)
  {
    Prediction prediction = this->PredictionFrom(phases, phase);
    this->FitWeights(prediction, result);
    const double scale = FilledScale * std::max(1.0, 3.0 - round);
    for (std::size_t n = 0; n < this->Nodes.size(); ++n)
    {
      missed[n] = measured[n].displacement - this->Predicted(prediction, n);
      share[n] = measured[n].variance > 0.0
        ? 1.0 / (1.0 + missed[n].squaredNorm() / (scale * scale)) // Geman & McClure
        : 0.0;
      result.nodes[n].variance = measured[n].variance / std::max(share[n] * share[n], 1e-12);
    }
  }
  // How much of it differs between places whose surroundings have nothing in common.
  double differences = 0.0;
  double pairs = 0.0;
  for (std::size_t a = 0; a < this->Nodes.size(); ++a)
  {
    for (std::size_t b = 0; b < a; ++b)
    {
      const double apart = (this->Nodes.position[a] - this->Nodes.position[b]).norm();
      if (apart > NotAlike && apart < 1.5 * NotAlike)
      {
        differences += share[a] * share[b] * (missed[a] - missed[b]).squaredNorm() / 6.0;
        pairs += share[a] * share[b];
      }
    }
  }
  const double incoherent = pairs > 0.0 ? differences / pairs : 0.0;
  for (std::size_t n = 0; n < this->Nodes.size(); ++n)
  {
    result.nodes[n].variance =
      share[n] > 0.0 ? std::max(measured[n].variance, incoherent) / (share[n] * share[n]) : 0.0;
  }
  return result;
}

void Filler::FillPhase(std::size_t phase,
  const std::vector<const MotionMeasurements*>& measurements, MotionMeasurements& filled) const
{
  const Sightings sightings = this->SightingsAt(phase, measurements);
  // Many nodes were seen at the same phases.
  std::map<std::vector<std::size_t>, Prediction> predictions;
  for (std::size_t n = 0; n < this->Nodes.size(); ++n)
  {
    std::vector<std::size_t> phases = this->SeenPhases(n);
    if (!this->Seen[phase][n] && predictions.count(phases) == 0)
    {
      Prediction prediction = this->PredictionFrom(phases, phase);
      this->FitWeights(prediction, sightings);
      predictions.emplace(std::move(phases), std::move(prediction));
    }
  }
  ParallelFor(static_cast<std::int64_t>(this->Nodes.size()), 8,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const auto n = static_cast<std::size_t>(i);
        double deviation = 0.0;
        if (!this->Seen[phase][n] &&
          this->Fill(n, predictions.at(this->SeenPhases(n)), sightings,
            filled.displacement[phase][n], deviation))
        {
          filled.information[phase][n] = Matrix3::Identity() / (deviation * deviation);
        }
      }
    });
}

void Filler::FitWeights(Prediction& prediction, const Sightings& sightings) const
{
  const auto count = prediction.weights.size();
  const double trust = 1.0 / (WeightDeviation * WeightDeviation);
  Eigen::MatrixXd matrix = trust * Eigen::MatrixXd::Identity(count, count);
  Eigen::VectorXd right = trust * prediction.weights;
  Eigen::MatrixXd motions(3, count);
  for (std::size_t n = 0; n < this->Nodes.size(); ++n)
  {
    if (sightings.nodes[n].variance <= 0.0)
    {
      continue;
    }
    for (Eigen::Index s = 0; s < count; ++s)
    {
      motions.col(s) = this->Displacement[prediction.phases[static_cast<std::size_t>(s)]][n];
    }
    const double information =
      1.0 / (AlikeNodes * this->VarianceOf(prediction, n, sightings.nodes[n]));
    matrix += information * motions.transpose() * motions;
    right += information * motions.transpose() * sightings.nodes[n].displacement;
  }
  prediction.weights = matrix.llt().solve(right);
}

std::vector<std::size_t> Filler::NodesAround(std::size_t node, const Sightings& sightings) const
{
  std::vector<std::size_t> around;
  for (std::size_t n = 0; n < this->Nodes.size(); ++n)
  {
    if (sightings.nodes[n].variance > 0.0)
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

bool Filler::Fill(std::size_t node, const Prediction& prediction, const Sightings& sightings,
  Vector3& place, double& deviation) const
{
  const std::vector<std::size_t> around = this->NodesAround(node, sightings);
  if (around.size() < LeastNeighbours)
  {
    return false;
  }
  // What the same prediction misses where it can be told.
  const auto count = static_cast<Eigen::Index>(around.size());
  Eigen::MatrixXd missed(count, 3);
  Eigen::VectorXd noise(count);
  for (Eigen::Index a = 0; a < count; ++a)
  {
    const std::size_t n = around[static_cast<std::size_t>(a)];
    missed.row(a) = (sightings.nodes[n].displacement - this->Predicted(prediction, n)).transpose();
    noise[a] = this->VarianceOf(prediction, n, sightings.nodes[n]);
  }
  // Without what is noise of it.
  const Eigen::ArrayXd trust = noise.array().inverse();
  const double scale = std::max(
    (trust * (missed.rowwise().squaredNorm().array() / 3.0 - noise.array())).sum() / trust.sum(),
    1e-4);
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
    matrix(a, a) += sightings.alike * noise[a];
  }
  const Eigen::VectorXd weights = matrix.llt().solve(right);
  place = this->Predicted(prediction, node) + missed.transpose() * weights;
  const double left = std::max(0.0, field(node, node) - right.dot(weights));
  deviation = std::sqrt(left + LeastDeviation * LeastDeviation);
  return true;
}
}

double ApartOf(
  const MotionMeasurements& measured, std::size_t phase, std::size_t node, const Vector3& place)
{
  const Vector3 apart = place - measured.displacement[phase][node];
  const Matrix3& information = measured.information[phase][node];
  if (!measured.slides || !(information.trace() > 0.0))
  {
    return apart.norm();
  }
  const double most =
    Eigen::SelfAdjointEigenSolver<Matrix3>(information, Eigen::EigenvaluesOnly).eigenvalues()[2];
  return std::sqrt(std::max(apart.dot(information * apart), 0.0) / most);
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
              ApartOf(*one, k, n, motion.Displacement(static_cast<int>(n), times[k]));
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
  const std::vector<std::vector<bool>>& seen,
  const std::vector<const MotionMeasurements*>& measurements, const TrajectoryPrior& prior)
{
  const Filler filler(nodes, times, referenceTime, displacement, seen, prior);
  MotionMeasurements result;
  result.displacement = displacement;
  result.information.assign(times.size(), std::vector<Matrix3>(nodes.size(), Matrix3::Zero()));
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    filler.FillPhase(k, measurements, result);
  }
  return result;
}

Trajectories FitFilled(const LineNodes& nodes, const std::vector<double>& times,
  double referenceTime, const std::vector<std::vector<bool>>& seen,
  const std::vector<const MotionMeasurements*>& measurements, const TrajectoryPrior& prior)
{
  const std::size_t phases = times.size();
  const auto weighed = [&](const auto& weight)
  {
    std::vector<MotionMeasurements> result;
    for (const MotionMeasurements* one : measurements)
    {
      result.push_back(*one);
      for (std::size_t k = 0; k < phases; ++k)
      {
        for (std::size_t n = 0; n < nodes.size(); ++n)
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
  MotionMeasurements filled =
    FillUnseen(nodes, times, referenceTime, displacement, seen, measurements, prior);
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
