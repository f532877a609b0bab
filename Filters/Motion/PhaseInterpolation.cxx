#include "PhaseInterpolation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Quaternion = Eigen::Quaterniond;

constexpr double Pi = 3.14159265358979323846;
/// Columns that one task works on.
constexpr std::int64_t Grain = 8192;
/// Of the Fourier fit, relative to its diagonal: enough to be solvable at any set of phases.
constexpr double LeastRidge = 1e-9;
constexpr double Ridges[] = { 0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3 };
/// End of the weighted fit: the greatest change of a fitted position in one iteration, mm.
constexpr double FitTolerance = 1e-3;
constexpr int FitIterations = 200;
/// Errors of predictions that make no difference, mm.
constexpr double PredictionTolerance = 1e-4;

void Require(bool condition, const char* message)
{
  if (!condition)
  {
    throw std::invalid_argument(message);
  }
}

double Modulo(double time)
{
  const double rest = time - std::floor(time);
  return rest < 1.0 ? rest : 0.0;
}

double Apart(double a, double b)
{
  const double gap = std::abs(a - b);
  return std::min(gap, 1.0 - gap);
}

/// Second derivatives at the knots of the periodic cubic spline, as a matrix that is applied to the
/// values there.
MatrixXd SecondDerivatives(const std::vector<double>& knots)
{
  const auto count = static_cast<Index>(knots.size());
  MatrixXd left = MatrixXd::Zero(count, count);
  MatrixXd right = MatrixXd::Zero(count, count);
  for (Index k = 0; k < count; ++k)
  {
    const Index before = (k + count - 1) % count;
    const Index after = (k + 1) % count;
    double h0 = knots[k] - knots[before];
    double h1 = knots[after] - knots[k];
    h0 += h0 <= 0.0 ? 1.0 : 0.0;
    h1 += h1 <= 0.0 ? 1.0 : 0.0;
    // += : with two knots the one before is the one after.
    left(k, before) += h0;
    left(k, k) += 2.0 * (h0 + h1);
    left(k, after) += h1;
    right(k, before) += 6.0 / h0;
    right(k, k) -= 6.0 / h0 + 6.0 / h1;
    right(k, after) += 6.0 / h1;
  }
  return left.partialPivLu().solve(right);
}

VectorXd Harmonics(double time, int order)
{
  VectorXd row(2 * order + 1);
  row[0] = 1.0;
  for (int m = 1; m <= order; ++m)
  {
    row[2 * m - 1] = std::cos(2.0 * Pi * m * time);
    row[2 * m] = std::sin(2.0 * Pi * m * time);
  }
  return row;
}

VectorXd HarmonicRates(double time, int order)
{
  VectorXd row(2 * order + 1);
  row[0] = 0.0;
  for (int m = 1; m <= order; ++m)
  {
    row[2 * m - 1] = -2.0 * Pi * m * std::sin(2.0 * Pi * m * time);
    row[2 * m] = 2.0 * Pi * m * std::cos(2.0 * Pi * m * time);
  }
  return row;
}

VectorXd Penalty(int order, double ridge, double samples)
{
  VectorXd penalty = VectorXd::Zero(2 * order + 1);
  for (int m = 1; m <= order; ++m)
  {
    const double strength = 0.5 * samples * (ridge * (std::pow(m, 4) - 1.0) + LeastRidge);
    penalty[2 * m - 1] = strength;
    penalty[2 * m] = strength;
  }
  return penalty;
}

/// The ridge fit as a matrix that is applied to values at the times: coefficients of the harmonics.
MatrixXd FourierFit(const std::vector<double>& times, int order, double ridge)
{
  const auto count = static_cast<Index>(times.size());
  MatrixXd design(count, 2 * order + 1);
  for (Index k = 0; k < count; ++k)
  {
    design.row(k) = Harmonics(times[k], order).transpose();
  }
  MatrixXd normal = design.transpose() * design;
  normal.diagonal() += Penalty(order, ridge, static_cast<double>(count));
  return normal.ldlt().solve(design.transpose());
}

/// Principal directions of the rows' deviations from their mean, in terms of the rows: the columns of
/// `modes` times the centred rows are orthonormal modes, strongest first.
struct Modes
{
  VectorXd strength;   ///< singular values
  MatrixXd directions; ///< eigenvectors of the Gram matrix
};

Modes ModesOf(MatrixXd gram)
{
  const Index count = gram.rows();
  const MatrixXd centre =
    MatrixXd::Identity(count, count) - MatrixXd::Constant(count, count, 1.0 / count);
  gram = centre * gram * centre;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(0.5 * (gram + gram.transpose()));
  Modes modes;
  modes.strength = solver.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt();
  modes.directions = solver.eigenvectors().rowwise().reverse();
  return modes;
}

/// Product of all rows with all rows. Blocks of columns are summed in their order.
MatrixXd GramOf(const Rows& rows)
{
  const Index blocks = (rows.cols() + Grain - 1) / Grain;
  std::vector<MatrixXd> parts(static_cast<std::size_t>(blocks));
  ParallelFor(blocks, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t b = first; b < last; ++b)
      {
        const Index start = b * Grain;
        const auto part = rows.middleCols(start, std::min<Index>(Grain, rows.cols() - start));
        parts[static_cast<std::size_t>(b)] = part * part.transpose();
      }
    });
  MatrixXd gram = MatrixXd::Zero(rows.rows(), rows.rows());
  for (const MatrixXd& part : parts)
  {
    gram += part;
  }
  return gram;
}

/// result = matrix * rows, over blocks of columns.
void Multiply(const MatrixXd& matrix, const Rows& rows, Rows& result)
{
  result.resize(matrix.rows(), rows.cols());
  ParallelFor(rows.cols(), Grain,
    [&](std::int64_t first, std::int64_t last)
    {
      result.middleCols(first, last - first).noalias() =
        matrix * rows.middleCols(first, last - first);
    });
}

Vector3 Logarithm(Quaternion rotation)
{
  if (rotation.w() < 0.0)
  {
    rotation.coeffs() = -rotation.coeffs();
  }
  const double sine = rotation.vec().norm();
  if (sine < 1e-12)
  {
    return 2.0 * rotation.vec();
  }
  return 2.0 * std::atan2(sine, rotation.w()) / sine * rotation.vec();
}

Quaternion Exponential(const Vector3& vector)
{
  const double angle = vector.norm();
  const double share = angle < 1e-9 ? 0.5 : std::sin(0.5 * angle) / angle;
  Quaternion rotation;
  rotation.w() = std::cos(0.5 * angle);
  rotation.vec() = share * vector;
  return rotation;
}

/// Weights of four rows: the values at two knots, and the second derivatives there.
struct CubicWeights
{
  double value[4];
  double rate[4];
};

CubicWeights CubicAt(double share, double gap)
{
  const double a = 1.0 - share;
  const double b = share;
  const double h = gap * gap / 6.0;
  CubicWeights weights = { { a, b, (a * a * a - a) * h, (b * b * b - b) * h },
    { -1.0 / gap, 1.0 / gap, -(3.0 * a * a - 1.0) * gap / 6.0, (3.0 * b * b - 1.0) * gap / 6.0 } };
  return weights;
}
}

void PhaseInterpolationSettings::Validate() const
{
  Require(this->mode == PhaseInterpolationMode::Linear ||
      this->mode == PhaseInterpolationMode::PeriodicCubic ||
      this->mode == PhaseInterpolationMode::LowNoise,
    "mode must be linear, periodic cubic or low noise");
  Require(
    this->mergeTolerance >= 0.0 && this->mergeTolerance <= 0.1, "mergeTolerance must be 0 to 0.1");
  Require(this->greatestRank >= 1 && this->greatestRank <= 20, "greatestRank must be 1 to 20");
  Require(this->greatestOrder >= 1 && this->greatestOrder <= 20, "greatestOrder must be 1 to 20");
  Require(
    this->leastConfidence >= 0.0 && this->leastConfidence <= 1.0, "leastConfidence must be 0 to 1");
}

PhaseInterpolation::PhaseInterpolation(const PoseSequence& sequence,
  const PhaseInterpolationSettings& settings, const ProgressCallback& progress)
  : Settings(settings)
{
  settings.Validate();
  CheckPoseSequence(sequence, sequence.points.empty() ? 0 : sequence.points.front().size());
  this->Merge(sequence);
  Report(progress, 0.1);

  const bool cubic = settings.mode == PhaseInterpolationMode::PeriodicCubic;
  if (cubic)
  {
    const MatrixXd second = SecondDerivatives(this->Knots_);
    Multiply(second, this->Points, this->PointsMore);
    Multiply(second, this->LogCalibre, this->LogCalibreMore);
    Multiply(second, this->Tangents, this->TangentsMore);
  }
  else if (settings.mode == PhaseInterpolationMode::LowNoise)
  {
    Rows weights = Rows::Ones(this->Points.rows(), this->Points.cols() / 3);
    if (this->Confidence.size() > 0)
    {
      weights = (this->Confidence.array() < settings.leastConfidence).select(0.0, this->Confidence);
    }
    this->FitLowNoise(weights, progress);
    const MatrixXd fit = FourierFit(this->Knots_, this->Fit_.order, this->Fit_.ridge);
    Multiply(fit, this->LogCalibre, this->LogCalibreMore);
    Multiply(fit, this->Tangents, this->TangentsMore);
  }
  Report(progress, 1.0);
}

void PhaseInterpolation::Merge(const PoseSequence& sequence)
{
  const std::size_t phases = sequence.NumberOfPhases();
  for (const double time : sequence.times)
  {
    this->Times.push_back(Modulo(time));
  }
  // Groups of phases around the cycle: the widest gap between two neighbours begins the first one.
  std::vector<std::size_t> order(phases);
  std::iota(order.begin(), order.end(), std::size_t{ 0 });
  std::stable_sort(order.begin(), order.end(),
    [&](std::size_t a, std::size_t b) { return this->Times[a] < this->Times[b]; });
  std::size_t start = 0;
  double widest = -1.0;
  for (std::size_t n = 0; n < phases; ++n)
  {
    const double gap = n == 0 ? this->Times[order[0]] + 1.0 - this->Times[order[phases - 1]]
                              : this->Times[order[n]] - this->Times[order[n - 1]];
    if (gap > widest)
    {
      widest = gap;
      start = n;
    }
  }
  std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(start), order.end());
  const double origin = this->Times[order.front()];
  const auto since = [&](std::size_t phase) { return Modulo(this->Times[phase] - origin); };
  struct Group
  {
    double time = 0.0;
    std::vector<std::size_t> phases;
  };
  std::vector<Group> groups;
  for (const std::size_t phase : order)
  {
    // Against the group's first phase: a dense series does not collapse into one.
    if (groups.empty() ||
      since(phase) - since(groups.back().phases.front()) > this->Settings.mergeTolerance)
    {
      groups.emplace_back();
    }
    groups.back().phases.push_back(phase);
  }
  for (Group& group : groups)
  {
    double sum = 0.0;
    for (const std::size_t phase : group.phases)
    {
      sum += since(phase);
    }
    group.time = Modulo(origin + sum / static_cast<double>(group.phases.size()));
    std::sort(group.phases.begin(), group.phases.end());
  }
  std::sort(
    groups.begin(), groups.end(), [](const Group& a, const Group& b) { return a.time < b.time; });
  Require(groups.size() >= 2,
    "The sequence has fewer than two different phases: times that are nearer to each other than "
    "the "
    "tolerance, modulo one cycle, are one");

  const auto knots = static_cast<Index>(groups.size());
  const auto points = static_cast<Index>(sequence.points.front().size());
  for (const Group& group : groups)
  {
    this->Knots_.push_back(group.time);
    this->Members.push_back(group.phases);
  }
  const auto position = [&](std::size_t phase)
  {
    return Eigen::Map<const Eigen::RowVectorXd>(
      points > 0 ? sequence.points[phase].front().data() : nullptr, 3 * points);
  };
  // What a member counts for in the mean at a point.
  const auto share = [&](Index k, Index point, std::size_t phase)
  {
    double sum = 0.0;
    for (const std::size_t member : this->Members[k])
    {
      sum += sequence.confidence.empty() ? 0.0 : sequence.confidence[member][point];
    }
    return sum > 0.0 ? sequence.confidence[phase][point] / sum
                     : 1.0 / static_cast<double>(this->Members[k].size());
  };
  // Means first; then repetitions are moved to their common time along the velocity between the
  // neighbours, so that a steady motion is not changed by the merging.
  this->Points = Rows::Zero(knots, 3 * points);
  for (Index k = 0; k < knots; ++k)
  {
    for (const std::size_t phase : this->Members[k])
    {
      const auto at = position(phase);
      for (Index n = 0; n < points; ++n)
      {
        this->Points.row(k).segment<3>(3 * n) += share(k, n, phase) * at.segment<3>(3 * n);
      }
    }
  }
  const Rows means = this->Points;
  double squares = 0.0;
  double repeated = 0.0;
  for (Index k = 0; k < knots; ++k)
  {
    const std::vector<std::size_t>& members = this->Members[k];
    if (members.size() < 2)
    {
      continue;
    }
    Eigen::RowVectorXd velocity = Eigen::RowVectorXd::Zero(3 * points);
    if (knots > 2)
    {
      const Index before = (k + knots - 1) % knots;
      const Index after = (k + 1) % knots;
      const double gap = Modulo(this->Knots_[after] - this->Knots_[before]);
      velocity = (means.row(after) - means.row(before)) / gap;
    }
    std::vector<Eigen::RowVectorXd> moved;
    for (const std::size_t phase : members)
    {
      double late = this->Times[phase] - this->Knots_[k];
      late -= std::round(late);
      moved.emplace_back(position(phase) - late * velocity);
    }
    for (Index n = 0; n < points; ++n)
    {
      Vector3 mean = Vector3::Zero();
      for (std::size_t m = 0; m < members.size(); ++m)
      {
        mean += share(k, n, members[m]) * moved[m].segment<3>(3 * n).transpose();
      }
      this->Points.row(k).segment<3>(3 * n) = mean.transpose();
      for (const Eigen::RowVectorXd& other : moved)
      {
        squares += (other.segment<3>(3 * n).transpose() - mean).squaredNorm();
        repeated += 1.0;
      }
    }
  }
  this->Repeatability_ = repeated > 0.0 ? std::sqrt(squares / repeated) : 0.0;

  if (!sequence.confidence.empty())
  {
    this->Confidence = Rows::Zero(knots, points);
    for (Index k = 0; k < knots; ++k)
    {
      for (const std::size_t phase : this->Members[k])
      {
        this->Confidence.row(k) +=
          Eigen::Map<const Eigen::RowVectorXd>(sequence.confidence[phase].data(), points);
      }
      this->Confidence.row(k) /= static_cast<double>(this->Members[k].size());
    }
  }
  if (!sequence.calibre.empty())
  {
    this->LogCalibre = Rows::Zero(knots, points);
    for (Index k = 0; k < knots; ++k)
    {
      for (const std::size_t phase : this->Members[k])
      {
        for (Index n = 0; n < points; ++n)
        {
          this->LogCalibre(k, n) += share(k, n, phase) * std::log(sequence.calibre[phase][n]);
        }
      }
    }
  }
  if (!sequence.status.empty())
  {
    for (Index k = 0; k < knots; ++k)
    {
      // Of the repetition that is known best.
      std::vector<TrackingStatus> status = sequence.status[this->Members[k].front()];
      for (Index n = 0; !sequence.confidence.empty() && n < points; ++n)
      {
        double best = -1.0;
        for (const std::size_t phase : this->Members[k])
        {
          if (sequence.confidence[phase][n] > best)
          {
            best = sequence.confidence[phase][n];
            status[n] = sequence.status[phase][n];
          }
        }
      }
      this->Status.push_back(std::move(status));
    }
  }
  if (!sequence.rotation.empty())
  {
    const auto bones = static_cast<Index>(sequence.rotation.front().size());
    this->Tangents = Rows::Zero(knots, 3 * bones);
    for (Index bone = 0; bone < bones; ++bone)
    {
      // The rotation of the least sum of squared sines, sign of quaternions aside (Markley 2007).
      Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
      for (std::size_t phase = 0; phase < phases; ++phase)
      {
        const Eigen::Vector4d q = sequence.rotation[phase][bone].normalized().coeffs();
        sum += q * q.transpose();
      }
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
      Quaternion mean;
      mean.coeffs() = solver.eigenvectors().col(3);
      Index strongest = 0;
      mean.coeffs().cwiseAbs().maxCoeff(&strongest);
      if (mean.coeffs()[3] < 0.0 || (mean.coeffs()[3] == 0.0 && mean.coeffs()[strongest] < 0.0))
      {
        mean.coeffs() = -mean.coeffs();
      }
      mean.normalize();
      this->MeanRotation.push_back(mean);
      for (Index k = 0; k < knots; ++k)
      {
        Vector3 tangent = Vector3::Zero();
        for (const std::size_t phase : this->Members[k])
        {
          tangent += Logarithm(mean.conjugate() * sequence.rotation[phase][bone].normalized());
        }
        this->Tangents.row(k).segment<3>(3 * bone) =
          (tangent / static_cast<double>(this->Members[k].size())).transpose();
      }
    }
  }
}

void PhaseInterpolation::FitLowNoise(const Rows& weights, const ProgressCallback& progress)
{
  const Index knots = this->Points.rows();
  const Index columns = this->Points.cols();
  const Index points = columns / 3;
  if (points == 0)
  {
    this->Fit_.order = 1;
    this->PointsMore = Rows::Zero(3, 0);
    return;
  }
  // A point's samples that count for less than the others of the same point are replaced, before modes
  // are sought: by its own periodic line through those that count.
  const bool even = (weights.array() == weights(0, 0)).all() && weights(0, 0) > 0.0;
  const bool any = (weights.array() > 0.0).any();
  Rows filled = this->Points;
  if (!even)
  {
    ParallelFor(points, 256,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          const double best = weights.col(n).maxCoeff();
          std::vector<Index> known;
          for (Index k = 0; k < knots; ++k)
          {
            if (best > 0.0 && weights(k, n) > 0.0)
            {
              known.push_back(k);
            }
          }
          if (known.empty() && any)
          {
            // Where nothing is known there is no motion that the modes could be of.
            filled.middleCols(3 * n, 3).rowwise() =
              this->Points.middleCols(3 * n, 3).colwise().mean();
          }
          for (Index k = 0; k < knots && !known.empty(); ++k)
          {
            const auto after = std::lower_bound(known.begin(), known.end(), k) - known.begin();
            const Index b = known[static_cast<std::size_t>(after) % known.size()];
            const Index a =
              known[(static_cast<std::size_t>(after) + known.size() - 1) % known.size()];
            const double gap = Modulo(this->Knots_[b] - this->Knots_[a]);
            const double at = gap > 0.0 ? Modulo(this->Knots_[k] - this->Knots_[a]) / gap : 0.0;
            const Vector3 line = ((1.0 - at) * this->Points.row(a).segment<3>(3 * n) +
              at * this->Points.row(b).segment<3>(3 * n))
                                   .transpose();
            const double share = weights(k, n) / best;
            if (share < 1.0)
            {
              filled.row(k).segment<3>(3 * n) =
                (share * this->Points.row(k).segment<3>(3 * n) + (1.0 - share) * line.transpose())
                  .eval();
            }
          }
        }
      });
  }
  Report(progress, 0.2);

  // Rank, order and ridge by which phases that are left out are predicted best.
  const MatrixXd gram = GramOf(filled);
  const int ranks = std::min<int>(this->Settings.greatestRank, static_cast<int>(knots) - 2);
  const int orders = this->Settings.greatestOrder;
  std::vector<double> errors;
  struct Choice
  {
    int rank;
    int order;
    double ridge;
  };
  std::vector<Choice> choices;
  for (int rank = 1; rank <= std::max(1, ranks); ++rank)
  {
    for (int order = 1; order <= orders; ++order)
    {
      for (const double ridge : Ridges)
      {
        // More coefficients than phases: the smoothest of the series that pass near to them.
        if (2 * order + 1 > static_cast<int>(knots) - 1 && ridge == 0.0)
        {
          continue;
        }
        choices.push_back({ rank, order, ridge });
      }
    }
  }
  errors.assign(choices.size(), 0.0);
  double total = 0.0;
  for (Index out = 0; out < knots; ++out)
  {
    total += weights.row(out).sum();
  }
  for (Index out = 0; knots > 2 && out < knots; ++out)
  {
    std::vector<double> times;
    std::vector<Index> rows;
    for (Index k = 0; k < knots; ++k)
    {
      if (k != out)
      {
        rows.push_back(k);
        times.push_back(this->Knots_[k]);
      }
    }
    const Index count = knots - 1;
    MatrixXd part(count, count);
    for (Index a = 0; a < count; ++a)
    {
      for (Index b = 0; b < count; ++b)
      {
        part(a, b) = gram(rows[a], rows[b]);
      }
    }
    const Modes modes = ModesOf(part);
    // A prediction is a sum of the rows with these weights, a column a choice.
    MatrixXd blend = MatrixXd::Zero(knots, static_cast<Index>(choices.size()));
    for (std::size_t c = 0; c < choices.size(); ++c)
    {
      const Choice& choice = choices[c];
      const MatrixXd fit = FourierFit(times, choice.order, choice.ridge);
      const VectorXd smooth =
        (Harmonics(this->Knots_[out], choice.order).transpose() * fit).transpose();
      const Index rank = std::min<Index>(choice.rank, count - 1);
      const auto kept = modes.directions.leftCols(rank);
      // Mean and projected deviations, carried to the moment that was left out.
      const double sum = smooth.sum();
      VectorXd row = VectorXd::Constant(count, sum / static_cast<double>(count));
      VectorXd centred = kept * (kept.transpose() * smooth);
      centred.array() -= centred.mean();
      row += centred;
      for (Index k = 0; k < count; ++k)
      {
        blend(rows[k], static_cast<Index>(c)) = row[k];
      }
    }
    const Index blocks = (points + Grain - 1) / Grain;
    std::vector<VectorXd> parts(static_cast<std::size_t>(blocks));
    ParallelFor(blocks, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t b = first; b < last; ++b)
        {
          const Index start = b * Grain;
          const Index size = std::min<Index>(Grain, points - start);
          VectorXd sums = VectorXd::Zero(blend.cols());
          constexpr Index Few = 64;
          for (Index at = start; at < start + size; at += Few)
          {
            const Index few = std::min(Few, start + size - at);
            MatrixXd wrong = blend.transpose() * filled.middleCols(3 * at, 3 * few);
            wrong.rowwise() -= this->Points.row(out).segment(3 * at, 3 * few);
            for (Index n = 0; n < few; ++n)
            {
              sums += weights(out, at + n) * wrong.middleCols(3 * n, 3).rowwise().squaredNorm();
            }
          }
          parts[static_cast<std::size_t>(b)] = sums;
        }
      });
    for (const VectorXd& sums : parts)
    {
      for (std::size_t c = 0; c < choices.size(); ++c)
      {
        errors[c] += sums[static_cast<Index>(c)];
      }
    }
    Report(progress, 0.2 + 0.5 * static_cast<double>(out + 1) / static_cast<double>(knots));
  }
  // The smallest of those that are as good as the best.
  const double enough = *std::min_element(errors.begin(), errors.end()) * 1.001 +
    total * PredictionTolerance * PredictionTolerance;
  const auto best = static_cast<std::size_t>(
    std::find_if(errors.begin(), errors.end(), [=](double e) { return e <= enough; }) -
    errors.begin());
  const int rank = choices[best].rank;
  const int order = choices[best].order;
  this->Fit_.rank = rank;
  this->Fit_.order = order;
  this->Fit_.ridge = choices[best].ridge;
  this->Fit_.predicted = total > 0.0 ? std::sqrt(errors[best] / total) : 0.0;

  // The fit to all phases: the strongest modes of the filled data, and their time courses.
  const Modes modes = ModesOf(gram);
  const MatrixXd fit = FourierFit(this->Knots_, order, this->Fit_.ridge);
  const auto kept = modes.directions.leftCols(rank);
  MatrixXd project = kept * kept.transpose();
  project.colwise() -= project.rowwise().mean().eval();
  project.array() += 1.0 / static_cast<double>(knots);
  Multiply(fit * project, filled, this->PointsMore);

  MatrixXd design(knots, 2 * order + 1);
  for (Index k = 0; k < knots; ++k)
  {
    design.row(k) = Harmonics(this->Knots_[k], order).transpose();
  }
  if (!even && total > 0.0)
  {
    // Weighted low rank by alternating least squares: modes and mean of a point, given the courses;
    // courses, given the modes.
    MatrixXd courses; // a row a harmonic without the constant, a column a mode
    {
      const MatrixXd time = design.rightCols(2 * order) * fit.bottomRows(2 * order);
      courses = fit.bottomRows(2 * order) * kept;
      for (Index r = 0; r < rank; ++r)
      {
        courses.col(r) *= std::max(modes.strength[r], 1e-9);
      }
    }
    const VectorXd penalty =
      Penalty(order, this->Fit_.ridge, static_cast<double>(knots)).tail(2 * order);
    Rows shape(rank + 1, columns); // mean, modes
    Rows fitted(knots, columns);
    Rows before = design * this->PointsMore;
    const Index blocks = (points + 255) / 256;
    struct Sums
    {
      std::vector<MatrixXd> gram;
      MatrixXd moment;
      double change = 0.0;
    };
    for (int iteration = 1; iteration <= FitIterations; ++iteration)
    {
      // Modes of like size, so that one ridge suits all of them.
      MatrixXd values = design.rightCols(2 * order) * courses;
      for (Index r = 0; r < rank; ++r)
      {
        const double size = std::sqrt(values.col(r).squaredNorm() / static_cast<double>(knots));
        if (size > 0.0)
        {
          courses.col(r) /= size;
          values.col(r) /= size;
        }
      }
      MatrixXd basis(knots, rank + 1);
      basis.col(0).setOnes();
      basis.rightCols(rank) = values;
      std::vector<Sums> parts(static_cast<std::size_t>(blocks));
      ParallelFor(blocks, 1,
        [&](std::int64_t first, std::int64_t last)
        {
          for (std::int64_t b = first; b < last; ++b)
          {
            Sums& sums = parts[static_cast<std::size_t>(b)];
            sums.gram.assign(static_cast<std::size_t>(knots), MatrixXd::Zero(rank, rank));
            sums.moment = MatrixXd::Zero(knots, rank);
            for (Index n = b * 256; n < std::min<Index>(points, (b + 1) * 256); ++n)
            {
              const VectorXd w = weights.col(n);
              MatrixXd normal = basis.transpose() * w.asDiagonal() * basis;
              const double size = std::max(normal.trace(), 1e-12);
              normal.diagonal().array() += 1e-9 * size;
              // A point that is known at few phases moves little on its own account.
              normal.diagonal().tail(rank).array() += 0.005 * w.maxCoeff();
              const MatrixXd right =
                basis.transpose() * w.asDiagonal() * this->Points.middleCols(3 * n, 3);
              shape.middleCols(3 * n, 3) = w.sum() > 0.0 ? MatrixXd(normal.ldlt().solve(right))
                                                         : MatrixXd(MatrixXd::Zero(rank + 1, 3));
              if (!(w.sum() > 0.0))
              {
                shape.row(0).segment<3>(3 * n) = this->Points.middleCols(3 * n, 3).colwise().mean();
              }
              const auto u = shape.block(1, 3 * n, rank, 3);
              const MatrixXd square = u * u.transpose();
              for (Index k = 0; k < knots; ++k)
              {
                sums.gram[static_cast<std::size_t>(k)] += w[k] * square;
                sums.moment.row(k) += w[k] *
                  (this->Points.row(k).segment<3>(3 * n) - shape.row(0).segment<3>(3 * n)) *
                  u.transpose();
              }
            }
          }
        });
      MatrixXd normal = MatrixXd::Zero(2 * order * rank, 2 * order * rank);
      MatrixXd right = MatrixXd::Zero(2 * order, rank);
      for (Index k = 0; k < knots; ++k)
      {
        MatrixXd square = MatrixXd::Zero(rank, rank);
        Eigen::RowVectorXd moment = Eigen::RowVectorXd::Zero(rank);
        for (const Sums& sums : parts)
        {
          square += sums.gram[static_cast<std::size_t>(k)];
          moment += sums.moment.row(k);
        }
        const VectorXd f = design.row(k).tail(2 * order).transpose();
        right += f * moment;
        for (Index r = 0; r < rank; ++r)
        {
          for (Index s = 0; s < rank; ++s)
          {
            normal.block(2 * order * r, 2 * order * s, 2 * order, 2 * order) +=
              square(r, s) * f * f.transpose();
          }
        }
      }
      for (Index r = 0; r < rank; ++r)
      {
        const double size =
          normal.block(2 * order * r, 2 * order * r, 2 * order, 2 * order).trace() /
          (static_cast<double>(knots) * order);
        normal.block(2 * order * r, 2 * order * r, 2 * order, 2 * order).diagonal() +=
          2.0 * std::max(size, 1e-12) * penalty;
      }
      const VectorXd solved =
        normal.ldlt().solve(Eigen::Map<const VectorXd>(right.data(), right.size()));
      courses = Eigen::Map<const MatrixXd>(solved.data(), 2 * order, rank);
      // Coefficients: mean, and courses times modes.
      this->PointsMore.resize(2 * order + 1, columns);
      this->PointsMore.row(0) = shape.row(0);
      Rows modesOnly = shape.bottomRows(rank);
      Rows moving;
      Multiply(courses, modesOnly, moving);
      this->PointsMore.bottomRows(2 * order) = moving;
      Multiply(design, this->PointsMore, fitted);
      const double change = (fitted - before).cwiseAbs().maxCoeff();
      before.swap(fitted);
      this->Fit_.iterations = iteration;
      Report(progress, 0.7 + 0.3 * iteration / FitIterations);
      if (change < FitTolerance)
      {
        break;
      }
    }
  }
  Rows fitted;
  Multiply(design, this->PointsMore, fitted);
  double squares = 0.0;
  for (Index n = 0; n < points; ++n)
  {
    for (Index k = 0; k < knots; ++k)
    {
      squares += weights(k, n) *
        (fitted.row(k).segment<3>(3 * n) - this->Points.row(k).segment<3>(3 * n)).squaredNorm();
    }
  }
  this->Fit_.residual = total > 0.0 ? std::sqrt(squares / total) : 0.0;
}

void PhaseInterpolation::Bracket(
  double time, std::size_t& before, std::size_t& after, double& share) const
{
  Require(std::isfinite(time), "The time must be finite");
  const double phase = Modulo(time);
  const std::size_t count = this->Knots_.size();
  after =
    static_cast<std::size_t>(
      std::upper_bound(this->Knots_.begin(), this->Knots_.end(), phase) - this->Knots_.begin()) %
    count;
  before = (after + count - 1) % count;
  double gap = this->Knots_[after] - this->Knots_[before];
  gap += gap <= 0.0 ? 1.0 : 0.0;
  double since = phase - this->Knots_[before];
  since += since < 0.0 ? 1.0 : 0.0;
  share = since / gap;
}

std::size_t PhaseInterpolation::NearestPhase(double time) const
{
  const double phase = Modulo(time);
  std::size_t nearest = 0;
  for (std::size_t k = 1; k < this->Times.size(); ++k)
  {
    if (Apart(this->Times[k], phase) < Apart(this->Times[nearest], phase))
    {
      nearest = k;
    }
  }
  return nearest;
}

void PhaseInterpolation::Evaluate(double time, InterpolatedPose& pose) const
{
  std::size_t before = 0;
  std::size_t after = 0;
  double share = 0.0;
  this->Bracket(time, before, after, share);
  double gap = this->Knots_[after] - this->Knots_[before];
  gap += gap <= 0.0 ? 1.0 : 0.0;
  const auto a = static_cast<Index>(before);
  const auto b = static_cast<Index>(after);
  const bool linear = this->Settings.mode == PhaseInterpolationMode::Linear;
  const bool cubic = this->Settings.mode == PhaseInterpolationMode::PeriodicCubic;
  const CubicWeights weights = CubicAt(share, gap);
  const VectorXd harmonics = linear || cubic ? VectorXd() : Harmonics(time, this->Fit_.order);
  const VectorXd rates = linear || cubic ? VectorXd() : HarmonicRates(time, this->Fit_.order);

  // Columns first .. first + count of what is interpolated, into `value` and `rate` (may be null).
  const auto blend =
    [&](const Rows& values, const Rows& more, Index first, Index count, double* value, double* rate)
  {
    Eigen::Map<Eigen::RowVectorXd> v(value, count);
    const auto va = values.row(a).segment(first, count);
    const auto vb = values.row(b).segment(first, count);
    if (linear)
    {
      v = (1.0 - share) * va + share * vb;
      if (rate)
      {
        Eigen::Map<Eigen::RowVectorXd>(rate, count) = (vb - va) / gap;
      }
      return;
    }
    if (cubic)
    {
      const auto ma = more.row(a).segment(first, count);
      const auto mb = more.row(b).segment(first, count);
      v = weights.value[0] * va + weights.value[1] * vb + weights.value[2] * ma +
        weights.value[3] * mb;
      if (rate)
      {
        Eigen::Map<Eigen::RowVectorXd>(rate, count) =
          weights.rate[0] * va + weights.rate[1] * vb + weights.rate[2] * ma + weights.rate[3] * mb;
      }
      return;
    }
    v = more.row(0).segment(first, count);
    for (Index m = 1; m < more.rows(); ++m)
    {
      v += harmonics[m] * more.row(m).segment(first, count);
    }
    if (rate)
    {
      Eigen::Map<Eigen::RowVectorXd> r(rate, count);
      r.setZero();
      for (Index m = 1; m < more.rows(); ++m)
      {
        r += rates[m] * more.row(m).segment(first, count);
      }
    }
  };

  const Index points = this->Points.cols() / 3;
  pose.points.resize(static_cast<std::size_t>(points));
  pose.velocity.resize(static_cast<std::size_t>(points));
  ParallelFor(points, Grain,
    [&](std::int64_t first, std::int64_t last)
    {
      blend(this->Points, this->PointsMore, 3 * first, 3 * (last - first),
        pose.points[static_cast<std::size_t>(first)].data(),
        pose.velocity[static_cast<std::size_t>(first)].data());
    });
  pose.confidence.resize(static_cast<std::size_t>(this->Confidence.cols()));
  if (!pose.confidence.empty())
  {
    Eigen::Map<Eigen::RowVectorXd>(pose.confidence.data(), this->Confidence.cols()) =
      (1.0 - share) * this->Confidence.row(a) + share * this->Confidence.row(b);
  }
  pose.calibre.resize(static_cast<std::size_t>(this->LogCalibre.cols()));
  if (!pose.calibre.empty())
  {
    blend(this->LogCalibre, this->LogCalibreMore, 0, this->LogCalibre.cols(), pose.calibre.data(),
      nullptr);
    for (double& factor : pose.calibre)
    {
      factor = std::exp(factor);
    }
  }
  if (this->Status.empty())
  {
    pose.status.clear();
  }
  else
  {
    pose.status = this->Status[share < 0.5 ? before : after];
  }
  const Index bones = this->Tangents.cols() / 3;
  pose.rotation.resize(static_cast<std::size_t>(bones));
  for (Index bone = 0; bone < bones; ++bone)
  {
    const Quaternion& mean = this->MeanRotation[bone];
    if (linear)
    {
      const Quaternion first = mean * Exponential(this->Tangents.row(a).segment<3>(3 * bone));
      const Quaternion second = mean * Exponential(this->Tangents.row(b).segment<3>(3 * bone));
      pose.rotation[bone] = first.slerp(share, second);
    }
    else
    {
      Vector3 tangent;
      blend(this->Tangents, this->TangentsMore, 3 * bone, 3, tangent.data(), nullptr);
      pose.rotation[bone] = mean * Exponential(tangent);
    }
  }
}

EllipseSection CrossSection(double radius, double calibre, double axisRatio, double strainLimit)
{
  EllipseSection section;
  const double wanted = calibre * calibre - 1.0;
  section.areaStrain = std::clamp(wanted, -strainLimit, strainLimit);
  section.clamped = section.areaStrain != wanted;
  // a b = r^2 (1 + eps), b = ratio a.
  section.major = radius * std::sqrt((1.0 + section.areaStrain) / axisRatio);
  section.minor = section.major * axisRatio;
  return section;
}
}
