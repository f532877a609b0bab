#include "HarmonicFit.h"

#include "Numbers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>

namespace coronary
{
namespace
{
using Rows = HarmonicRows;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Columns that one task works on.
constexpr std::int64_t Grain = 8192;
/// Of the Fourier fit, relative to its diagonal: enough to be solvable at any set of phases.
constexpr double MinimumRidge = 1e-9;
constexpr double Ridges[] = { 0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 3e-2, 0.1, 0.3 };
/// End of the weighted fit: the greatest change of a fitted position in one iteration, mm.
constexpr double FitTolerance = 1e-3;
constexpr int FitIterations = 200;
/// Errors of predictions that make no difference, mm.
constexpr double PredictionTolerance = 1e-4;

VectorXd Penalty(int order, double ridge, double samples)
{
  VectorXd penalty = VectorXd::Zero(2 * order + 1);
  for (int m = 1; m <= order; ++m)
  {
    const double strength = 0.5 * samples * (ridge * (std::pow(m, 4) - 1.0) + MinimumRidge);
    penalty[2 * m - 1] = strength;
    penalty[2 * m] = strength;
  }
  return penalty;
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

LowNoiseFitter::LowNoiseFitter(const std::vector<double>& knots, const HarmonicRows& points,
  const HarmonicRows& weights, const PhaseInterpolationSettings& settings,
  const ProgressCallback& progress)
  : Knots(knots)
  , Points(points)
  , Weights(weights)
  , Settings(settings)
  , Progress(progress)
  , Even(points.cols() == 0 || ((weights.array() == weights(0, 0)).all() && weights(0, 0) > 0.0))
  , Filled(points)
{
  for (Index k = 0; k < weights.rows(); ++k)
  {
    this->Total += weights.row(k).sum();
  }
}

LowNoiseFit LowNoiseFitter::Run(HarmonicRows& coefficients)
{
  if (this->Points.cols() == 0)
  {
    this->Result.order = 1;
    coefficients = Rows::Zero(3, 0);
    return this->Result;
  }
  if (!this->Even)
  {
    this->Fill();
  }
  Report(this->Progress, 0.2);
  const MatrixXd gram = GramOf(this->Filled);
  this->Choose(gram);

  // The fit to all phases: the strongest modes of the filled data, and their time courses.
  const Index knots = this->Points.rows();
  const int order = this->Result.order;
  const Modes modes = ModesOf(gram);
  const MatrixXd fit = FourierFit(this->Knots, order, this->Result.ridge);
  const auto kept = modes.directions.leftCols(this->Result.rank);
  MatrixXd project = kept * kept.transpose();
  project.colwise() -= project.rowwise().mean().eval();
  project.array() += 1.0 / static_cast<double>(knots);
  Multiply(fit * project, this->Filled, coefficients);

  this->Design.resize(knots, 2 * order + 1);
  for (Index k = 0; k < knots; ++k)
  {
    this->Design.row(k) = Harmonics(this->Knots[k], order).transpose();
  }
  if (!this->Even && this->Total > 0.0)
  {
    MatrixXd courses = fit.bottomRows(2 * order) * kept;
    for (Index r = 0; r < this->Result.rank; ++r)
    {
      courses.col(r) *= std::max(modes.strength[r], 1e-9);
    }
    this->Alternate(std::move(courses), coefficients);
  }
  this->Result.residual = this->Residual(coefficients);
  return this->Result;
}

/// A point's samples that count for less than the others of the same point are replaced, before modes
/// are sought: by its own periodic line through those that count.
void LowNoiseFitter::Fill()
{
  const Index knots = this->Points.rows();
  const Index points = this->Points.cols() / 3;
  const bool any = (this->Weights.array() > 0.0).any();
  ParallelFor(points, 256,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const double best = this->Weights.col(n).maxCoeff();
        std::vector<Index> known;
        for (Index k = 0; k < knots; ++k)
        {
          if (best > 0.0 && this->Weights(k, n) > 0.0)
          {
            known.push_back(k);
          }
        }
        if (known.empty() && any)
        {
          // Where nothing is known there is no motion that the modes could be of.
          this->Filled.middleCols(3 * n, 3).rowwise() =
            this->Points.middleCols(3 * n, 3).colwise().mean();
        }
        for (Index k = 0; k < knots && !known.empty(); ++k)
        {
          const auto after = std::lower_bound(known.begin(), known.end(), k) - known.begin();
          const Index b = known[static_cast<std::size_t>(after) % known.size()];
          const Index a =
            known[(static_cast<std::size_t>(after) + known.size() - 1) % known.size()];
          const double gap = Modulo(this->Knots[b] - this->Knots[a]);
          const double at = gap > 0.0 ? Modulo(this->Knots[k] - this->Knots[a]) / gap : 0.0;
          const Vector3 line = ((1.0 - at) * this->Points.row(a).segment<3>(3 * n) +
            at * this->Points.row(b).segment<3>(3 * n))
                                 .transpose();
          const double share = this->Weights(k, n) / best;
          if (share < 1.0)
          {
            this->Filled.row(k).segment<3>(3 * n) =
              (share * this->Points.row(k).segment<3>(3 * n) + (1.0 - share) * line.transpose())
                .eval();
          }
        }
      }
    });
}

std::vector<LowNoiseFitter::Choice> LowNoiseFitter::Choices() const
{
  const Index knots = this->Points.rows();
  const int ranks = std::min<int>(this->Settings.maximumRank, static_cast<int>(knots) - 2);
  std::vector<Choice> choices;
  for (int rank = 1; rank <= std::max(1, ranks); ++rank)
  {
    for (int order = 1; order <= this->Settings.maximumOrder; ++order)
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
  return choices;
}

/// Rank, order and ridge by which phases that are left out are predicted best.
void LowNoiseFitter::Choose(const MatrixXd& gram)
{
  const Index knots = this->Points.rows();
  const std::vector<Choice> choices = this->Choices();
  std::vector<double> errors(choices.size(), 0.0);
  for (Index out = 0; knots > 2 && out < knots; ++out)
  {
    this->AddErrors(out, this->Predictions(out, gram, choices), errors);
    Report(this->Progress, 0.2 + 0.5 * static_cast<double>(out + 1) / static_cast<double>(knots));
  }
  // The smallest of those that are as good as the best.
  const double enough = *std::min_element(errors.begin(), errors.end()) * 1.001 +
    this->Total * PredictionTolerance * PredictionTolerance;
  const auto best = static_cast<std::size_t>(
    std::find_if(errors.begin(), errors.end(), [=](double e) { return e <= enough; }) -
    errors.begin());
  this->Result.rank = choices[best].rank;
  this->Result.order = choices[best].order;
  this->Result.ridge = choices[best].ridge;
  this->Result.predicted = this->Total > 0.0 ? std::sqrt(errors[best] / this->Total) : 0.0;
}

/// A prediction of a phase is a sum of the others with these weights, a column a choice.
MatrixXd LowNoiseFitter::Predictions(
  Index out, const MatrixXd& gram, const std::vector<Choice>& choices) const
{
  const Index knots = this->Points.rows();
  std::vector<double> times;
  std::vector<Index> rows;
  for (Index k = 0; k < knots; ++k)
  {
    if (k != out)
    {
      rows.push_back(k);
      times.push_back(this->Knots[k]);
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
  // A prediction is a sum of the rows with these this->Weights, a column a choice.
  MatrixXd blend = MatrixXd::Zero(knots, static_cast<Index>(choices.size()));
  for (std::size_t c = 0; c < choices.size(); ++c)
  {
    const Choice& choice = choices[c];
    const MatrixXd fit = FourierFit(times, choice.order, choice.ridge);
    const VectorXd smooth =
      (Harmonics(this->Knots[out], choice.order).transpose() * fit).transpose();
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
  return blend;
}

void LowNoiseFitter::AddErrors(Index out, const MatrixXd& blend, std::vector<double>& errors) const
{
  const Index points = this->Points.cols() / 3;
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
          MatrixXd wrong = blend.transpose() * this->Filled.middleCols(3 * at, 3 * few);
          wrong.rowwise() -= this->Points.row(out).segment(3 * at, 3 * few);
          for (Index n = 0; n < few; ++n)
          {
            sums += this->Weights(out, at + n) * wrong.middleCols(3 * n, 3).rowwise().squaredNorm();
          }
        }
        parts[static_cast<std::size_t>(b)] = sums;
      }
    });
  for (const VectorXd& sums : parts)
  {
    for (std::size_t c = 0; c < errors.size(); ++c)
    {
      errors[c] += sums[static_cast<Index>(c)];
    }
  }
}

/// Modes and mean of each point, given the courses. Points are summed in blocks, in their order.
std::vector<LowNoiseFitter::Sums> LowNoiseFitter::FitShapes(
  const MatrixXd& basis, HarmonicRows& shape) const
{
  const Index knots = this->Points.rows();
  const Index points = this->Points.cols() / 3;
  const Index rank = basis.cols() - 1;
  const Index blocks = (points + 255) / 256;
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
          const VectorXd w = this->Weights.col(n);
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
  return parts;
}

/// Courses, given the modes: a row a harmonic without the constant, a column a mode.
MatrixXd LowNoiseFitter::FitCourses(const std::vector<Sums>& parts, const VectorXd& penalty) const
{
  const Index knots = this->Points.rows();
  const int rank = this->Result.rank;
  const int order = this->Result.order;
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
    const VectorXd f = this->Design.row(k).tail(2 * order).transpose();
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
    const double size = normal.block(2 * order * r, 2 * order * r, 2 * order, 2 * order).trace() /
      (static_cast<double>(knots) * order);
    normal.block(2 * order * r, 2 * order * r, 2 * order, 2 * order).diagonal() +=
      2.0 * std::max(size, 1e-12) * penalty;
  }
  const VectorXd solved =
    normal.ldlt().solve(Eigen::Map<const VectorXd>(right.data(), right.size()));
  return Eigen::Map<const MatrixXd>(solved.data(), 2 * order, rank);
}

/// Weighted low rank by alternating least squares.
void LowNoiseFitter::Alternate(MatrixXd courses, HarmonicRows& coefficients)
{
  const Index knots = this->Points.rows();
  const Index columns = this->Points.cols();
  const int rank = this->Result.rank;
  const int order = this->Result.order;
  const VectorXd penalty =
    Penalty(order, this->Result.ridge, static_cast<double>(knots)).tail(2 * order);
  Rows shape(rank + 1, columns); // mean, modes
  Rows fitted(knots, columns);
  Rows before = this->Design * coefficients;
  for (int iteration = 1; iteration <= FitIterations; ++iteration)
  {
    // Modes of like size, so that one ridge suits all of them.
    MatrixXd values = this->Design.rightCols(2 * order) * courses;
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
    courses = this->FitCourses(this->FitShapes(basis, shape), penalty);
    // Coefficients: mean, and courses times modes.
    coefficients.resize(2 * order + 1, columns);
    coefficients.row(0) = shape.row(0);
    Rows modesOnly = shape.bottomRows(rank);
    Rows moving;
    Multiply(courses, modesOnly, moving);
    coefficients.bottomRows(2 * order) = moving;
    Multiply(this->Design, coefficients, fitted);
    const double change = (fitted - before).cwiseAbs().maxCoeff();
    before.swap(fitted);
    this->Result.iterations = iteration;
    Report(this->Progress, 0.7 + 0.3 * iteration / FitIterations);
    if (change < FitTolerance)
    {
      break;
    }
  }
}

/// Root mean square distance to the phases, mm.
double LowNoiseFitter::Residual(const HarmonicRows& coefficients) const
{
  const Index knots = this->Points.rows();
  const Index points = this->Points.cols() / 3;
  Rows fitted;
  Multiply(this->Design, coefficients, fitted);
  double squares = 0.0;
  for (Index n = 0; n < points; ++n)
  {
    for (Index k = 0; k < knots; ++k)
    {
      squares += this->Weights(k, n) *
        (fitted.row(k).segment<3>(3 * n) - this->Points.row(k).segment<3>(3 * n)).squaredNorm();
    }
  }
  return this->Total > 0.0 ? std::sqrt(squares / this->Total) : 0.0;
}
}
