#include "MotionRegularization.h"

#include "CyclicTime.h"
#include "MotionNoise.h"
#include "Numbers.h"
#include "Require.h"
#include "SkeletonPose.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <set>
#include <string>
#include <utility>

// What is minimised (docs/motion.md): J = sum c_ik^2 |P_ik - D_ik|^2 + omega_1 E_temp + omega_2 E_spatial + (1/lambda)
// E_velocity.
// Displacement: E_temp is the sum of (h_(k-1) + h_k)/2 times the squared acceleration, by divided differences, time in
// units of the mean distance of phases; E_spatial the sum over points with two or more neighbours of the squared
// Laplacian of the displacement from rest, neighbours weighted by 1 / distance. Position (Eq. 14): the sums of the
// squared P_k - P_(k-1), and of the squared Laplacian of P. A harmonic of a point that 16 phases sample loses 1 - 1/(1
// + 0.15 omega_1) of its amplitude with these, 1 - 1/(1 + 0.023 omega_1) with the acceleration.
// E_velocity: the sum over segments of h_k (mean length / length) times the squared difference of (P_(k+1) - P_k)/h_k
// at its ends; its minimum solves (1 - (1/lambda) Laplacian along the vessel) v = v_measured.

namespace coronary
{
namespace
{
using Eigen::Index;
using Positions = Eigen::Matrix<double, Eigen::Dynamic, 3>; ///< a row an unknown
using Sparse = Eigen::SparseMatrix<double>;

/// Weight of a sample of no confidence at all: without it, nothing but smoothness would hold a point.
constexpr double MinimumWeight = 1e-6;
/// Gaps between phases that are shorter than this share of the mean one count as so long.
constexpr double MinimumGap = 0.1;
/// Of the limits against the data, in the method of multipliers: enough for limits that are not convex.
constexpr double FirstPenalty = 10.0;
/// Where they are not kept after so many iterations, it becomes ten times as much.
constexpr int PatientIterations = 150;
/// Without progress in so many, the limits stand against each other.
constexpr int StaleIterations = 40;
constexpr double Relaxation = 1.6;
/// A corner that is beyond a limit at rest may become sharper by this share.
constexpr double RestSlack = 0.1;
/// Noise that the weights of the energies are made for, mm.
constexpr double UsualNoise = 0.05;
/// How much the displacement of a heart bends along a vessel, per mm.
constexpr double UsualBending = 0.01;
/// A well-tracked point of a noisy phase may be moved by so many deviations more.
constexpr double NoiseTolerance = 3.0;
constexpr std::int64_t Grain = 512;

struct Segment
{
  std::int64_t first;
  std::int64_t second;
  double length; ///< at rest, mm
};

/// Two segments of one line after each other.
struct Corner
{
  std::int64_t before;
  std::int64_t at;
  std::int64_t after;
  double bending;         ///< at rest, radians
  double curvatureRadius; ///< at rest, mm
};

double Bending(const Vector3& first, const Vector3& second)
{
  return std::atan2(first.cross(second).norm(), first.dot(second));
}

/// Of the circle through the ends and the middle of two segments.
double CurvatureRadius(double first, double second, double bending)
{
  const double sine = std::sin(bending);
  const double chord = std::sqrt(
    std::max(0.0, first * first + second * second + 2.0 * first * second * std::cos(bending)));
  return sine > 1e-12 ? chord / (2.0 * sine)
                      : (bending < 0.5 * Pi ? std::numeric_limits<double>::infinity() : 0.0);
}

/// The greatest bending of two segments of these lengths at which their circle is as wide as `radius`;
/// beyond it, up to where the segments fold back, it is narrower or means nothing.
double BendingAt(double first, double second, double radius)
{
  if (2.0 * radius <= std::max(first, second))
  {
    return Pi;
  }
  // chord = 2 radius sin(bending), and the law of cosines: a quadratic equation for the cosine.
  const double square = 4.0 * radius * radius;
  const double root = std::sqrt((square - first * first) * (square - second * second));
  return std::acos(std::clamp((root - first * second) / square, -1.0, 1.0));
}

/// What does not depend on the positions.
struct Problem
{
  const MotionRegularizationSettings& settings;
  std::int64_t points = 0;
  std::int64_t phases = 0;
  std::vector<std::size_t> order; ///< phases of the sequence, ascending modulo one cycle
  std::vector<double> gap;        ///< from a phase to the next one, 1 on average
  std::vector<Segment> segments;
  std::vector<Corner> corners;
  std::vector<std::vector<std::pair<std::int64_t, double>>> neighbours; ///< and lengths at rest
  std::vector<double> noise; ///< of the phases in their order, mm

  Problem(const PoseSequence& sequence, const Polylines& lines,
    const MotionRegularizationSettings& wanted);

  Index Unknown(std::int64_t point, std::int64_t phase) const
  {
    return point * this->phases + phase;
  }
  std::int64_t Next(std::int64_t phase) const { return (phase + 1) % this->phases; }
  std::int64_t Before(std::int64_t phase) const
  {
    return (phase + this->phases - 1) % this->phases;
  }
  double WeightOf(const PoseSequence& sequence, std::int64_t point, std::int64_t phase) const;
  /// Of a phase's samples, against those of a phase without noise.
  double Trust(std::int64_t phase) const
  {
    const double ratio = this->noise[phase] / UsualNoise;
    return 1.0 / (1.0 + ratio * ratio);
  }
  double SpatialWeight(std::int64_t point, std::int64_t phase) const;
  bool WellTracked(const PoseSequence& sequence, std::int64_t point, std::int64_t phase) const;
  /// By how much a well-tracked point may be moved, mm.
  double Tolerance(std::int64_t phase) const
  {
    return this->settings.tolerance + NoiseTolerance * this->noise[phase];
  }
  Positions PositionsOf(const PoseSequence& sequence) const;

  /// Calls row(coefficients, weight, kind) for every term of the energies: a sum of unknowns that is squared.
  /// Kinds: 0 in time, 1 along the vessel, 2 velocity. A spatial term of the kind Displacement is one of
  /// displacements.
  template <typename Function>
  void Terms(const Function& row) const;
};

Problem::Problem(
  const PoseSequence& sequence, const Polylines& lines, const MotionRegularizationSettings& wanted)
  : settings(wanted)
  , points(static_cast<std::int64_t>(lines.points.size()))
  , phases(static_cast<std::int64_t>(sequence.NumberOfPhases()))
{
  Require(this->phases >= 2, "The sequence has one phase: its motion needs at least two");
  std::vector<double> times;
  for (const double time : sequence.times)
  {
    times.push_back(Modulo(time));
  }
  this->order.resize(times.size());
  std::iota(this->order.begin(), this->order.end(), std::size_t{ 0 });
  std::stable_sort(this->order.begin(), this->order.end(),
    [&](std::size_t a, std::size_t b) { return times[a] < times[b]; });
  for (std::int64_t k = 0; k < this->phases; ++k)
  {
    double between = times[this->order[this->Next(k)]] - times[this->order[k]];
    between += k == this->phases - 1 ? 1.0 : 0.0;
    this->gap.push_back(std::max(MinimumGap, between * static_cast<double>(this->phases)));
  }

  this->noise.assign(times.size(), 0.0);
  if (wanted.measureNoise && wanted.energy == MotionEnergy::Displacement)
  {
    const std::vector<double> ofPhases = NoiseOfPhases(sequence, lines);
    std::transform(this->order.begin(), this->order.end(), this->noise.begin(),
      [&](std::size_t k) { return ofPhases[k]; });
  }

  this->neighbours.resize(lines.points.size());
  std::set<std::pair<std::int64_t, std::int64_t>> known;
  for (std::size_t n = 0; n < lines.lines.size(); ++n)
  {
    const std::vector<std::int64_t>& line = lines.lines[n];
    for (std::size_t p = 1; p < line.size(); ++p)
    {
      const double length = (lines.points[line[p]] - lines.points[line[p - 1]]).norm();
      Require(length > 0.0, "A segment of line " + std::to_string(n) + " has no length at rest");
      if (!known.insert(std::minmax(line[p - 1], line[p])).second)
      {
        continue;
      }
      this->segments.push_back({ line[p - 1], line[p], length });
      this->neighbours[line[p - 1]].emplace_back(line[p], length);
      this->neighbours[line[p]].emplace_back(line[p - 1], length);
    }
    for (std::size_t p = 1; p + 1 < line.size(); ++p)
    {
      const Vector3 first = lines.points[line[p]] - lines.points[line[p - 1]];
      const Vector3 second = lines.points[line[p + 1]] - lines.points[line[p]];
      const double bending = Bending(first, second);
      this->corners.push_back({ line[p - 1], line[p], line[p + 1], bending,
        CurvatureRadius(first.norm(), second.norm(), bending) });
    }
  }
  // Lines of two points are bones: their corners are where one bone alone follows another.
  std::map<std::int64_t, std::vector<std::size_t>> begins;
  for (std::size_t n = 0; n < lines.lines.size(); ++n)
  {
    if (lines.lines[n].size() == 2)
    {
      begins[lines.lines[n].front()].push_back(n);
    }
  }
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    const auto follows = line.size() == 2 ? begins.find(line.back()) : begins.end();
    if (follows == begins.end() || follows->second.size() != 1 ||
      this->neighbours[line.back()].size() != 2)
    {
      continue;
    }
    const std::int64_t after = lines.lines[follows->second.front()].back();
    if (after == line.front())
    {
      continue;
    }
    const Vector3 first = lines.points[line.back()] - lines.points[line.front()];
    const Vector3 second = lines.points[after] - lines.points[line.back()];
    const double bending = Bending(first, second);
    this->corners.push_back({ line.front(), line.back(), after, bending,
      CurvatureRadius(first.norm(), second.norm(), bending) });
  }
}

double Problem::WeightOf(const PoseSequence& sequence, std::int64_t point, std::int64_t phase) const
{
  if (sequence.confidence.empty())
  {
    return this->Trust(phase);
  }
  const double confidence = sequence.confidence[this->order[phase]][point];
  return this->Trust(phase) * std::max(MinimumWeight, confidence * confidence);
}

double Problem::SpatialWeight(std::int64_t point, std::int64_t phase) const
{
  if (this->noise[phase] <= 0.0)
  {
    return this->settings.spatialWeight;
  }
  // What a bending of the displacement makes of the Laplacian over segments of these lengths.
  double product = 1.0;
  for (const auto& [other, length] : this->neighbours[point])
  {
    product *= length;
  }
  const double own = 0.5 * UsualBending *
    std::pow(product, 2.0 / static_cast<double>(this->neighbours[point].size()));
  const double ratio = this->noise[phase] / own;
  return this->settings.spatialWeight + this->Trust(phase) * ratio * ratio;
}

bool Problem::WellTracked(
  const PoseSequence& sequence, std::int64_t point, std::int64_t phase) const
{
  return !sequence.confidence.empty() &&
    sequence.confidence[this->order[phase]][point] >= this->settings.wellTracked;
}

Positions Problem::PositionsOf(const PoseSequence& sequence) const
{
  Positions positions(this->points * this->phases, 3);
  for (std::int64_t point = 0; point < this->points; ++point)
  {
    for (std::int64_t k = 0; k < this->phases; ++k)
    {
      positions.row(this->Unknown(point, k)) = sequence.points[this->order[k]][point].transpose();
    }
  }
  return positions;
}

template <typename Function>
void Problem::Terms(const Function& row) const
{
  using Row = std::vector<std::pair<Index, double>>;
  Row coefficients;
  const bool plain = this->settings.energy == MotionEnergy::Position;
  for (std::int64_t point = 0; point < this->points; ++point)
  {
    for (std::int64_t k = 0; k < this->phases; ++k)
    {
      const std::int64_t before = this->Before(k);
      const std::int64_t after = this->Next(k);
      if (plain)
      {
        coefficients = { { this->Unknown(point, k), 1.0 }, { this->Unknown(point, before), -1.0 } };
        row(coefficients, this->settings.temporalWeight, 0);
      }
      else
      {
        // Acceleration, per square of the mean gap; its square is integrated over time.
        const double h0 = this->gap[before];
        const double h1 = this->gap[k];
        const double share = 2.0 / (h0 + h1);
        coefficients = { { this->Unknown(point, before), share / h0 },
          { this->Unknown(point, k), -share * (1.0 / h0 + 1.0 / h1) },
          { this->Unknown(point, after), share / h1 } };
        row(coefficients, this->settings.temporalWeight * 0.5 * (h0 + h1), 0);
      }
    }
    const auto& around = this->neighbours[point];
    if (around.empty() || (!plain && around.size() < 2))
    {
      continue;
    }
    double sum = 0.0;
    for (const auto& [other, length] : around)
    {
      sum += plain ? 1.0 : 1.0 / length;
    }
    for (std::int64_t k = 0; k < this->phases; ++k)
    {
      coefficients = { { this->Unknown(point, k), -1.0 } };
      for (const auto& [other, length] : around)
      {
        coefficients.emplace_back(this->Unknown(other, k), (plain ? 1.0 : 1.0 / length) / sum);
      }
      row(coefficients, plain ? this->settings.spatialWeight : this->SpatialWeight(point, k), 1);
    }
  }
  double mean = 0.0;
  for (const Segment& segment : this->segments)
  {
    mean += segment.length / static_cast<double>(this->segments.size());
  }
  for (const Segment& segment : this->segments)
  {
    for (std::int64_t k = 0; k < this->phases; ++k)
    {
      const double rate = 1.0 / this->gap[k];
      coefficients = { { this->Unknown(segment.first, this->Next(k)), rate },
        { this->Unknown(segment.first, k), -rate },
        { this->Unknown(segment.second, this->Next(k)), -rate },
        { this->Unknown(segment.second, k), rate } };
      row(coefficients, this->settings.velocityWeight * this->gap[k] * mean / segment.length, 2);
    }
  }
}

/// Something that has to be within a limit: one or two sums of unknowns.
struct Limit
{
  enum Kind
  {
    Strain,
    Corner,
    Step,
    Tolerance
  };
  Kind kind;
  std::size_t item; ///< segment, corner
  Index unknowns[3];
  std::int64_t phase;
};

class Limits
{
public:
  Limits(const Problem& wholeProblem, const PoseSequence& sequence, const Positions& input);

  std::size_t Rows(std::size_t n) const { return this->List[n].kind == Limit::Corner ? 2 : 1; }

  /// The vectors that limit `n` is about.
  void Values(std::size_t n, const Positions& at, Vector3 values[2]) const;
  /// The nearest allowed ones; returns bits of MotionClamp when they are others.
  int Project(std::size_t n, Vector3 values[2]) const;
  /// Adds transposed rows times vectors.
  void Scatter(std::size_t n, const Vector3 values[2], Positions& sums) const;
  void AddTriplets(double penalty, std::vector<Eigen::Triplet<double>>& triplets) const;
  /// By how much more than the precision a limit is exceeded, mm; 0 or less: it is kept.
  double Excess(std::size_t n, const Positions& at) const;

  std::vector<Limit> List;

private:
  double BendingLimit(const Corner& corner, double first, double second, int& bit) const;

  const Problem& Whole;
  const Positions& Input;
};

Limits::Limits(const Problem& wholeProblem, const PoseSequence& sequence, const Positions& input)
  : Whole(wholeProblem)
  , Input(input)
{
  const MotionRegularizationSettings& settings = this->Whole.settings;
  for (std::int64_t k = 0; k < this->Whole.phases; ++k)
  {
    for (std::size_t n = 0;
         std::isfinite(settings.maximumStrain) && n < this->Whole.segments.size(); ++n)
    {
      const Segment& segment = this->Whole.segments[n];
      this->List.push_back({ Limit::Strain, n,
        { this->Whole.Unknown(segment.first, k), this->Whole.Unknown(segment.second, k), -1 }, k });
    }
    const bool bent = settings.maximumBending < Pi || settings.minimumCurvatureRadius > 0.0;
    for (std::size_t n = 0; bent && n < this->Whole.corners.size(); ++n)
    {
      const Corner& corner = this->Whole.corners[n];
      this->List.push_back({ Limit::Corner, n,
        { this->Whole.Unknown(corner.before, k), this->Whole.Unknown(corner.at, k),
          this->Whole.Unknown(corner.after, k) },
        k });
    }
    for (std::int64_t point = 0; point < this->Whole.points; ++point)
    {
      if (std::isfinite(settings.maximumStep))
      {
        this->List.push_back({ Limit::Step, 0,
          { this->Whole.Unknown(point, k), this->Whole.Unknown(point, this->Whole.Next(k)), -1 },
          k });
      }
      if (this->Whole.WellTracked(sequence, point, k))
      {
        this->List.push_back({ Limit::Tolerance, 0, { this->Whole.Unknown(point, k), -1, -1 }, k });
      }
    }
  }
}

void Limits::Values(std::size_t n, const Positions& at, Vector3 values[2]) const
{
  const Limit& limit = this->List[n];
  if (limit.kind == Limit::Tolerance)
  {
    values[0] = (at.row(limit.unknowns[0]) - this->Input.row(limit.unknowns[0])).transpose();
    return;
  }
  values[0] = (at.row(limit.unknowns[1]) - at.row(limit.unknowns[0])).transpose();
  if (limit.kind == Limit::Corner)
  {
    values[1] = (at.row(limit.unknowns[2]) - at.row(limit.unknowns[1])).transpose();
  }
}

double Limits::BendingLimit(const Corner& corner, double first, double second, int& bit) const
{
  const MotionRegularizationSettings& settings = this->Whole.settings;
  const double byAngle = std::max(settings.maximumBending, corner.bending * (1.0 + RestSlack));
  const double byRadius = BendingAt(first, second,
    std::min(settings.minimumCurvatureRadius, corner.curvatureRadius * (1.0 - RestSlack)));
  bit = byAngle <= byRadius ? ClampBending : ClampCurvature;
  return std::min(byAngle, byRadius);
}

int Limits::Project(std::size_t n, Vector3 values[2]) const
{
  const Limit& limit = this->List[n];
  const MotionRegularizationSettings& settings = this->Whole.settings;
  switch (limit.kind)
  {
    case Limit::Strain:
    {
      const double rest = this->Whole.segments[limit.item].length;
      const double length = values[0].norm();
      const double wanted = std::clamp(
        length, rest * (1.0 - settings.maximumStrain), rest * (1.0 + settings.maximumStrain));
      if (wanted == length)
      {
        return 0;
      }
      if (length > 0.0)
      {
        values[0] *= wanted / length;
      }
      return ClampStrain;
    }
    case Limit::Corner:
    {
      const double first = values[0].norm();
      const double second = values[1].norm();
      if (first == 0.0 || second == 0.0)
      {
        return 0;
      }
      int bit = 0;
      const double bending = Bending(values[0], values[1]);
      const double excess =
        bending - this->BendingLimit(this->Whole.corners[limit.item], first, second, bit);
      if (excess <= 0.0)
      {
        return 0;
      }
      // Both turn in their plane, the shorter one more.
      Vector3 axis = values[0].cross(values[1]);
      axis = axis.norm() > 1e-12 * first * second ? axis.normalized() : values[0].unitOrthogonal();
      const double share = second * second / (first * first + second * second);
      values[0] = Eigen::AngleAxisd(excess * share, axis) * values[0];
      values[1] = Eigen::AngleAxisd(-excess * (1.0 - share), axis) * values[1];
      return bit;
    }
    case Limit::Step:
    case Limit::Tolerance:
    default:
    {
      const double most =
        limit.kind == Limit::Step ? settings.maximumStep : this->Whole.Tolerance(limit.phase);
      const double length = values[0].norm();
      if (length <= most)
      {
        return 0;
      }
      values[0] *= most / length;
      return limit.kind == Limit::Step ? ClampStep : ClampTolerance;
    }
  }
}

void Limits::Scatter(std::size_t n, const Vector3 values[2], Positions& sums) const
{
  const Limit& limit = this->List[n];
  if (limit.kind == Limit::Tolerance)
  {
    sums.row(limit.unknowns[0]) += values[0].transpose();
    return;
  }
  sums.row(limit.unknowns[0]) -= values[0].transpose();
  sums.row(limit.unknowns[1]) += values[0].transpose();
  if (limit.kind == Limit::Corner)
  {
    sums.row(limit.unknowns[1]) -= values[1].transpose();
    sums.row(limit.unknowns[2]) += values[1].transpose();
  }
}

void Limits::AddTriplets(double penalty, std::vector<Eigen::Triplet<double>>& triplets) const
{
  const auto difference = [&](Index a, Index b)
  {
    triplets.emplace_back(a, a, penalty);
    triplets.emplace_back(b, b, penalty);
    triplets.emplace_back(std::max(a, b), std::min(a, b), -penalty);
  };
  for (const Limit& limit : this->List)
  {
    if (limit.kind == Limit::Tolerance)
    {
      triplets.emplace_back(limit.unknowns[0], limit.unknowns[0], penalty);
      continue;
    }
    difference(limit.unknowns[0], limit.unknowns[1]);
    if (limit.kind == Limit::Corner)
    {
      difference(limit.unknowns[1], limit.unknowns[2]);
    }
  }
}

double Limits::Excess(std::size_t n, const Positions& at) const
{
  Vector3 values[2];
  this->Values(n, at, values);
  const Vector3 original[2] = { values[0], values[1] };
  if (this->Project(n, values) == 0)
  {
    return 0.0;
  }
  double distance = (values[0] - original[0]).norm();
  if (this->List[n].kind == Limit::Corner)
  {
    distance = std::max(distance, (values[1] - original[1]).norm());
  }
  return distance - 2.0 * this->Whole.settings.precision;
}

/// Lower triangle of the sum of all terms' squares, without limits.
void AddEnergyTriplets(
  const Problem& problem, const PoseSequence& data, std::vector<Eigen::Triplet<double>>& triplets)
{
  for (std::int64_t point = 0; point < problem.points; ++point)
  {
    for (std::int64_t k = 0; k < problem.phases; ++k)
    {
      const Index unknown = problem.Unknown(point, k);
      triplets.emplace_back(unknown, unknown, problem.WeightOf(data, point, k));
    }
  }
  problem.Terms(
    [&](const std::vector<std::pair<Index, double>>& row, double weight, int)
    {
      if (weight == 0.0)
      {
        return;
      }
      for (const auto& [a, x] : row)
      {
        for (const auto& [b, y] : row)
        {
          if (a >= b)
          {
            triplets.emplace_back(a, b, weight * x * y);
          }
        }
      }
    });
}

class Solver
{
public:
  Solver(Index size, const std::vector<Eigen::Triplet<double>>& triplets)
  {
    Sparse matrix(size, size);
    matrix.setFromTriplets(triplets.begin(), triplets.end());
    this->Factor.compute(matrix);
    if (this->Factor.info() != Eigen::Success)
    {
      throw std::runtime_error("The equations of the motion can not be solved");
    }
  }

  Positions Solve(const Positions& right) const
  {
    Positions result(right.rows(), 3);
    ParallelFor(3, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t axis = first; axis < last; ++axis)
        {
          result.col(axis) = this->Factor.solve(right.col(axis));
        }
      });
    return result;
  }

private:
  Eigen::SimplicialLDLT<Sparse> Factor;
};

/// Rest positions of all unknowns: with them taken away, all energies are of what is left.
Positions OriginOf(const Problem& problem, const Polylines& lines)
{
  Positions origin(problem.points * problem.phases, 3);
  Vector3 centre = Vector3::Zero();
  for (const Vector3& point : lines.points)
  {
    centre += point / static_cast<double>(lines.points.size());
  }
  const bool plain = problem.settings.energy == MotionEnergy::Position;
  for (std::int64_t point = 0; point < problem.points; ++point)
  {
    for (std::int64_t k = 0; k < problem.phases; ++k)
    {
      origin.row(problem.Unknown(point, k)) = (plain ? centre : lines.points[point]).transpose();
    }
  }
  return origin;
}

/// What the data add to the right side of the energies' equations.
Positions PullOf(const Problem& problem, const PoseSequence& sequence, const Positions& input,
  const Positions& origin)
{
  Positions pull(input.rows(), 3);
  for (std::int64_t point = 0; point < problem.points; ++point)
  {
    for (std::int64_t k = 0; k < problem.phases; ++k)
    {
      const Index unknown = problem.Unknown(point, k);
      pull.row(unknown) =
        problem.WeightOf(sequence, point, k) * (input.row(unknown) - origin.row(unknown));
    }
  }
  return pull;
}

/// Keeps the limits by the method of multipliers, with over-relaxation.
class Multipliers
{
public:
  /// @param pull     towards the data, of the energies' equations
  /// @param energies  matrix of these equations
  Multipliers(const Limits& limits, const Positions& input, const Positions& origin,
    const Positions& pull, std::vector<Eigen::Triplet<double>> energies)
    : Bounds(limits)
    , Input(input)
    , Origin(origin)
    , Pull(pull)
    , Triplets(std::move(energies))
    , OfEnergies(this->Triplets.size())
    , Wanted(limits.List.size())
    , Force(limits.List.size(), { Vector3::Zero(), Vector3::Zero() })
    , Apart(limits.List.size(), 0.0)
  {
    this->SetPenalty(FirstPenalty);
  }

  /// @return iterations
  int Run(const MotionRegularizationSettings& settings, Positions& positions,
    const ProgressCallback& progress);

private:
  void SetPenalty(double penalty);
  void ProjectAll(const Positions& positions, bool begin);
  Positions RightSide() const;

  const Limits& Bounds;
  const Positions& Input;
  const Positions& Origin;
  const Positions& Pull;
  std::vector<Eigen::Triplet<double>> Triplets;
  std::size_t OfEnergies;
  double Penalty = 0.0;
  std::unique_ptr<Solver> Equations;
  std::vector<std::array<Vector3, 2>> Wanted; ///< allowed values, by limit
  std::vector<std::array<Vector3, 2>> Force;
  std::vector<double> Apart; ///< mm, of the values from the wanted ones
};

void Multipliers::SetPenalty(double penalty)
{
  this->Penalty = penalty;
  this->Triplets.erase(
    this->Triplets.begin() + static_cast<std::ptrdiff_t>(this->OfEnergies), this->Triplets.end());
  this->Bounds.AddTriplets(penalty, this->Triplets);
  this->Equations = std::make_unique<Solver>(this->Pull.rows(), this->Triplets);
}

/// Brings each limit's values to the nearest allowed ones.
void Multipliers::ProjectAll(const Positions& positions, bool begin)
{
  ParallelFor(static_cast<std::int64_t>(this->Bounds.List.size()), Grain,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const auto n = static_cast<std::size_t>(i);
        Vector3 values[2] = { Vector3::Zero(), Vector3::Zero() };
        this->Bounds.Values(n, positions, values);
        this->Apart[n] = 0.0;
        Vector3 relaxed[2];
        for (std::size_t row = 0; row < this->Bounds.Rows(n); ++row)
        {
          if (!begin)
          {
            this->Apart[n] = std::max(this->Apart[n], (values[row] - this->Wanted[n][row]).norm());
            values[row] = Relaxation * values[row] + (1.0 - Relaxation) * this->Wanted[n][row];
          }
          values[row] += this->Force[n][row];
          relaxed[row] = values[row];
        }
        this->Bounds.Project(n, values);
        for (std::size_t row = 0; row < this->Bounds.Rows(n); ++row)
        {
          this->Wanted[n][row] = values[row];
          this->Force[n][row] = relaxed[row] - values[row];
        }
      }
    });
}

Positions Multipliers::RightSide() const
{
  Positions right = this->Pull;
  Positions sums = Positions::Zero(this->Pull.rows(), 3);
  for (std::size_t n = 0; n < this->Bounds.List.size(); ++n)
  {
    Vector3 values[2] = { this->Wanted[n][0] - this->Force[n][0], Vector3::Zero() };
    if (this->Bounds.Rows(n) == 2)
    {
      values[1] = this->Wanted[n][1] - this->Force[n][1];
    }
    if (this->Bounds.List[n].kind == Limit::Tolerance)
    {
      values[0] += (this->Input.row(this->Bounds.List[n].unknowns[0]) -
        this->Origin.row(this->Bounds.List[n].unknowns[0]))
                     .transpose();
    }
    else
    {
      // The unknowns are what is left without the this->Origin.
      Vector3 rest[2] = { Vector3::Zero(), Vector3::Zero() };
      this->Bounds.Values(n, this->Origin, rest);
      values[0] -= rest[0];
      values[1] -= rest[1];
    }
    this->Bounds.Scatter(n, values, sums);
  }
  right += this->Penalty * sums;
  return right;
}

int Multipliers::Run(const MotionRegularizationSettings& settings, Positions& positions,
  const ProgressCallback& progress)
{
  this->ProjectAll(positions, true);
  int stale = 0;
  double best = std::numeric_limits<double>::infinity();
  for (int iteration = 1; iteration <= settings.iterations; ++iteration)
  {
    const Positions next = this->Equations->Solve(this->RightSide()) + this->Origin;
    const double change = (next - positions).rowwise().norm().maxCoeff();
    positions = next;
    this->ProjectAll(positions, false);
    const double violation = *std::max_element(this->Apart.begin(), this->Apart.end());
    Report(progress, 0.3 + 0.65 * iteration / settings.iterations);
    if (violation < settings.precision && change < settings.precision)
    {
      return iteration;
    }
    stale = violation < 0.98 * best ? 0 : stale + 1;
    best = std::min(best, violation);
    const bool raised = this->Penalty > FirstPenalty;
    if (stale >= StaleIterations && raised)
    {
      return iteration;
    }
    if (!raised && (stale >= StaleIterations || iteration == PatientIterations))
    {
      stale = 0;
      best = std::numeric_limits<double>::infinity();
      for (std::array<Vector3, 2>& forces : this->Force)
      {
        forces[0] /= 10.0;
        forces[1] /= 10.0;
      }
      this->SetPenalty(10.0 * this->Penalty);
    }
  }
  return settings.iterations;
}

/// Adds the bits of the limits that positions exceed.
void FindClamps(const Limits& limits, const Positions& at, std::vector<int>& bits)
{
  ParallelFor(static_cast<std::int64_t>(bits.size()), Grain,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        Vector3 values[2];
        limits.Values(static_cast<std::size_t>(n), at, values);
        const Vector3 original[2] = { values[0], values[1] };
        const int bit = limits.Project(static_cast<std::size_t>(n), values);
        // Rounding alone is no clamp.
        if (bit != 0 &&
          ((values[0] - original[0]).norm() > 1e-9 ||
            (limits.Rows(static_cast<std::size_t>(n)) == 2 &&
              (values[1] - original[1]).norm() > 1e-9)))
        {
          bits[static_cast<std::size_t>(n)] |= bit;
        }
      }
    });
}

/// What a well-tracked point may move is kept whatever else is not.
void KeepTolerance(
  const Problem& problem, const Limits& limits, const Positions& input, Positions& positions)
{
  for (const Limit& limit : limits.List)
  {
    if (limit.kind != Limit::Tolerance)
    {
      continue;
    }
    const Index unknown = limit.unknowns[0];
    const double tolerance = problem.Tolerance(limit.phase);
    const Eigen::RowVector3d move = positions.row(unknown) - input.row(unknown);
    const double length = move.norm();
    if (length > tolerance)
    {
      positions.row(unknown) = input.row(unknown) + move * (tolerance / length);
    }
  }
}

/// Counts the limits that are exceeded, and marks the points of those that are clamped.
void MarkClamps(const Problem& problem, const Limits& limits, const Positions& positions,
  const std::vector<int>& bits, RegularizedMotion& result)
{
  for (std::size_t n = 0; n < limits.List.size(); ++n)
  {
    const Limit& limit = limits.List[n];
    result.violations += limits.Excess(n, positions) > 0.0 ? 1 : 0;
    if (bits[n] == 0)
    {
      continue;
    }
    // The corner's own point; both ends of a segment; the later phase of a step.
    const auto mark = [&](Index unknown)
    {
      result.clamps[problem.order[static_cast<std::size_t>(unknown % problem.phases)]]
                   [static_cast<std::size_t>(unknown / problem.phases)] |= bits[n];
    };
    if (limit.kind == Limit::Strain)
    {
      mark(limit.unknowns[0]);
    }
    mark(limit.kind == Limit::Tolerance ? limit.unknowns[0] : limit.unknowns[1]);
  }
  for (const std::vector<int>& phase : result.clamps)
  {
    for (const int clamp : phase)
    {
      for (std::size_t bit = 0; bit < result.clamped.size(); ++bit)
      {
        result.clamped[bit] += (clamp >> bit) & 1;
      }
    }
  }
}

/// Strain and stress of all lines at one phase.
void MeasureStrain(const Polylines& lines, const std::vector<Vector3>& now, double youngsModulus,
  RegularizedMotion& result)
{
  result.strain.emplace_back();
  result.stress.emplace_back();
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    double rest = 0.0;
    double length = 0.0;
    for (std::size_t p = 1; p < line.size(); ++p)
    {
      rest += (lines.points[line[p]] - lines.points[line[p - 1]]).norm();
      length += (now[line[p]] - now[line[p - 1]]).norm();
    }
    result.strain.back().push_back(length / rest - 1.0);
    result.stress.back().push_back(youngsModulus * result.strain.back().back());
  }
}

/// Bones turn with their joints.
void TurnBones(
  const PoseSequence& sequence, const Polylines& lines, std::size_t k, PoseSequence& poses)
{
  const std::vector<Vector3>& now = poses.points[k];
  for (std::size_t n = 0; !sequence.rotation.empty() &&
       sequence.rotation[k].size() == lines.lines.size() && n < lines.lines.size();
       ++n)
  {
    const std::int64_t head = lines.lines[n].front();
    const std::int64_t tail = lines.lines[n].back();
    const Vector3 old = sequence.points[k][tail] - sequence.points[k][head];
    const Vector3 turned = now[tail] - now[head];
    if (old.norm() > 0.0 && turned.norm() > 0.0)
    {
      poses.rotation[k][n] = (ShortestRotation(old, turned) * sequence.rotation[k][n]).normalized();
    }
  }
}

MotionEnergies EnergiesOfPositions(const Problem& problem, const Positions& positions,
  const Positions& origin, const Positions& data, const PoseSequence& sequence)
{
  MotionEnergies energies;
  for (std::int64_t point = 0; point < problem.points; ++point)
  {
    const auto& around = problem.neighbours[point];
    for (std::int64_t k = 0; k < problem.phases; ++k)
    {
      const Index unknown = problem.Unknown(point, k);
      energies.temporal +=
        (positions.row(unknown) - positions.row(problem.Unknown(point, problem.Before(k))))
          .squaredNorm();
      energies.objective += problem.WeightOf(sequence, point, k) *
        (positions.row(unknown) - data.row(unknown)).squaredNorm();
      if (!around.empty())
      {
        Eigen::RowVector3d laplacian = Eigen::RowVector3d::Zero();
        for (const auto& [other, length] : around)
        {
          laplacian += (positions.row(problem.Unknown(other, k)) - positions.row(unknown)) /
            static_cast<double>(around.size());
        }
        energies.spatial += laplacian.squaredNorm();
      }
    }
  }
  energies.total = problem.settings.temporalWeight * energies.temporal +
    problem.settings.spatialWeight * energies.spatial;
  problem.Terms(
    [&](const std::vector<std::pair<Index, double>>& row, double weight, int)
    {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (const auto& [unknown, coefficient] : row)
      {
        sum += coefficient * (positions.row(unknown) - origin.row(unknown));
      }
      energies.objective += weight * sum.squaredNorm();
    });
  return energies;
}
}

double TemporalWeightOf(std::size_t phases)
{
  const double share = std::min(1.0, static_cast<double>(phases) / 20.0);
  return MotionRegularizationSettings().temporalWeight * share * share * share * share;
}

void MotionRegularizationSettings::Validate() const
{
  const auto notNegative = [](double value, const char* name)
  {
    Require(
      std::isfinite(value) && value >= 0.0, std::string(name) + " must be 0 or more, and finite");
  };
  Require(this->energy == MotionEnergy::Displacement || this->energy == MotionEnergy::Position,
    "energy must be of the displacement or of the position");
  notNegative(this->temporalWeight, "temporalWeight");
  notNegative(this->spatialWeight, "spatialWeight");
  notNegative(this->velocityWeight, "velocityWeight");
  Require(this->maximumBending >= 0.01 && this->maximumBending <= Pi + 1e-9,
    "maximumBending must be 0.01 to pi");
  notNegative(this->minimumCurvatureRadius, "minimumCurvatureRadius");
  Require(
    this->maximumStrain >= 0.001 && (this->maximumStrain <= 0.9 || std::isinf(this->maximumStrain)),
    "maximumStrain must be 0.001 to 0.9, or infinite");
  Require(this->maximumStep > 0.0, "maximumStep must be greater than 0");
  Require(this->wellTracked >= 0.0 && this->wellTracked <= 1.0, "wellTracked must be 0 to 1");
  notNegative(this->tolerance, "tolerance");
  Require(std::isfinite(this->youngsModulus) && this->youngsModulus > 0.0,
    "youngsModulus must be greater than 0");
  Require(this->iterations >= 1, "iterations must be 1 or more");
  Require(this->precision >= 1e-6 && this->precision <= 1.0, "precision must be 1e-6 to 1");
}

MotionEnergies EnergiesOf(const PoseSequence& sequence, const PoseSequence& data,
  const Polylines& lines, const MotionRegularizationSettings& settings)
{
  settings.Validate();
  CheckPolylines(lines);
  CheckPoseSequence(sequence, lines.points.size());
  CheckPoseSequence(data, lines.points.size());
  Require(data.times == sequence.times, "The motion and the data have other phases");
  const Problem problem(data, lines, settings);
  return EnergiesOfPositions(problem, problem.PositionsOf(sequence), OriginOf(problem, lines),
    problem.PositionsOf(data), data);
}

RegularizedMotion RegularizeMotion(const PoseSequence& sequence, const Polylines& lines,
  const MotionRegularizationSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  CheckPolylines(lines);
  CheckPoseSequence(sequence, lines.points.size());
  const Problem problem(sequence, lines, settings);
  const Index size = problem.points * problem.phases;
  RegularizedMotion result;
  result.poses = sequence;
  result.noise.resize(sequence.NumberOfPhases());
  for (std::int64_t k = 0; k < problem.phases; ++k)
  {
    result.noise[problem.order[k]] = problem.noise[k];
  }
  result.clamps.assign(sequence.NumberOfPhases(), std::vector<int>(lines.points.size(), 0));
  const Positions input = problem.PositionsOf(sequence);
  const Positions origin = OriginOf(problem, lines);
  Positions positions = input;
  Report(progress, 0.02);
  if (size > 0)
  {
    result.before = EnergiesOfPositions(problem, input, origin, input, sequence);
    std::vector<Eigen::Triplet<double>> triplets;
    AddEnergyTriplets(problem, sequence, triplets);
    const Positions pull = PullOf(problem, sequence, input, origin);
    if (settings.temporalWeight > 0.0 || settings.spatialWeight > 0.0 ||
      settings.velocityWeight > 0.0)
    {
      positions = Solver(size, triplets).Solve(pull) + origin;
    }
    Report(progress, 0.2);

    const Limits limits(problem, sequence, input);
    std::vector<int> bits(limits.List.size(), 0);
    // What the input or its smooth form exceeds is what is clamped.
    FindClamps(limits, positions, bits);
    const bool touched = std::any_of(bits.begin(), bits.end(), [](int bit) { return bit != 0; });
    FindClamps(limits, input, bits);
    if (touched)
    {
      Multipliers multipliers(limits, input, origin, pull, std::move(triplets));
      Report(progress, 0.3);
      result.iterations = multipliers.Run(settings, positions, progress);
      KeepTolerance(problem, limits, input, positions);
    }
    MarkClamps(problem, limits, positions, bits, result);
    result.after = EnergiesOfPositions(problem, positions, origin, input, sequence);
    result.maximumMove = (positions - input).rowwise().norm().maxCoeff();
  }
  for (std::int64_t k = 0; k < problem.phases; ++k)
  {
    std::vector<Vector3>& phase = result.poses.points[problem.order[k]];
    for (std::int64_t point = 0; point < problem.points; ++point)
    {
      phase[point] = positions.row(problem.Unknown(point, k)).transpose();
    }
  }
  for (std::size_t k = 0; k < sequence.NumberOfPhases(); ++k)
  {
    MeasureStrain(lines, result.poses.points[k], settings.youngsModulus, result);
    TurnBones(sequence, lines, k, result.poses);
  }
  Report(progress, 1.0);
  return result;
}
}
