#include "PeriodicSpline.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

// The cubic spline through all phases with continuous value, slope and second derivative, over the seam as well: with
// h_k the distance from phase k to the next one and M_k the second derivative there, indices modulo the number of
// phases,
//     h_(k-1) M_(k-1) + 2 (h_(k-1) + h_k) M_k + h_k M_(k+1) = 6 [ (P_(k+1) - P_k)/h_k - (P_k - P_(k-1))/h_(k-1) ]

namespace coronary
{
KnotInterval IntervalAt(const std::vector<double>& knots, double time)
{
  double phase = time - std::floor(time);
  phase = phase < 1.0 ? phase : 0.0;
  const std::size_t count = knots.size();
  KnotInterval interval;
  interval.after =
    static_cast<std::size_t>(std::upper_bound(knots.begin(), knots.end(), phase) - knots.begin()) %
    count;
  interval.before = (interval.after + count - 1) % count;
  interval.gap = knots[interval.after] - knots[interval.before];
  interval.gap += interval.gap <= 0.0 ? 1.0 : 0.0;
  double since = phase - knots[interval.before];
  since += since < 0.0 ? 1.0 : 0.0;
  interval.share = since / interval.gap;
  return interval;
}

Eigen::MatrixXd SecondDerivatives(const std::vector<double>& knots)
{
  const auto count = static_cast<Eigen::Index>(knots.size());
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index k = 0; k < count; ++k)
  {
    const Eigen::Index before = (k + count - 1) % count;
    const Eigen::Index after = (k + 1) % count;
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

CubicWeights CubicAt(const KnotInterval& interval)
{
  const double a = 1.0 - interval.share;
  const double b = interval.share;
  const double gap = interval.gap;
  const double h = gap * gap / 6.0;
  return { { a, b, (a * a * a - a) * h, (b * b * b - b) * h },
    { -1.0 / gap, 1.0 / gap, -(3.0 * a * a - 1.0) * gap / 6.0, (3.0 * b * b - 1.0) * gap / 6.0 } };
}

namespace
{
/// SecondDerivatives by the equations divided by 6: recorded sessions hold the bits of these.
Eigen::MatrixXd RecordedDerivatives(const std::vector<double>& knots)
{
  const auto count = static_cast<Eigen::Index>(knots.size());
  const auto step = [&](Eigen::Index k)
  { return k + 1 < count ? knots[k + 1] - knots[k] : knots[0] + 1.0 - knots[k]; };
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixXd right = left;
  for (Eigen::Index k = 0; k < count; ++k)
  {
    const Eigen::Index before = (k + count - 1) % count;
    const Eigen::Index after = (k + 1) % count;
    left(k, before) += step(before) / 6.0;
    left(k, k) += (step(before) + step(k)) / 3.0;
    left(k, after) += step(k) / 6.0;
    right(k, after) += 1.0 / step(k);
    right(k, k) -= 1.0 / step(k) + 1.0 / step(before);
    right(k, before) += 1.0 / step(before);
  }
  return left.partialPivLu().solve(right);
}
}

PeriodicPositions::PeriodicPositions(
  const std::vector<double>& phases, const std::vector<std::vector<Vector3>>& positions)
{
  if (phases.empty() || phases.size() != positions.size())
  {
    throw std::invalid_argument("a motion has " + std::to_string(phases.size()) + " phases and " +
      std::to_string(positions.size()) + " sets of positions");
  }
  const std::size_t count = phases.size();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t k = 0; k < count; ++k)
  {
    if (!std::isfinite(phases[k]))
    {
      throw std::invalid_argument("phase " + std::to_string(k) + " of a motion is not finite");
    }
    if (positions[k].size() != positions[0].size())
    {
      throw std::invalid_argument("phase " + std::to_string(k) + " of a motion has " +
        std::to_string(positions[k].size()) + " points, and the first one has " +
        std::to_string(positions[0].size()));
    }
    for (std::size_t i = 0; i < positions[k].size(); ++i)
    {
      if (!positions[k][i].allFinite())
      {
        throw std::invalid_argument("point " + std::to_string(i) + " of phase " +
          std::to_string(k) + " of a motion is not finite");
      }
    }
    const double phase = phases[k] - std::floor(phases[k]);
    order.emplace_back(phase < 1.0 ? phase : 0.0, k);
  }
  std::sort(order.begin(), order.end());
  for (std::size_t k = 0; k < count; ++k)
  {
    this->Knots.push_back(order[k].first);
    const double step =
      k + 1 < count ? order[k + 1].first - order[k].first : order[0].first + 1.0 - order[k].first;
    if (step < 0.001)
    {
      throw std::invalid_argument("the phases " + std::to_string(phases[order[k].second]) +
        " and " + std::to_string(phases[order[(k + 1) % count].second]) +
        " of a motion are nearer than 0.001, modulo one cycle");
    }
  }
  this->Values = 3 * positions[0].size();
  const auto values = static_cast<Eigen::Index>(this->Values);
  const auto knots = static_cast<Eigen::Index>(count);
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  this->Sample.resize(count * this->Values);
  Eigen::Map<Rows> sample(this->Sample.data(), knots, values);
  for (Eigen::Index k = 0; k < knots; ++k)
  {
    const std::vector<Vector3>& from = positions[order[k].second];
    for (std::size_t i = 0; i < from.size(); ++i)
    {
      sample.row(k).segment<3>(static_cast<Eigen::Index>(3 * i)) = from[i];
    }
  }
  this->Second.resize(this->Sample.size());
  Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
    this->Second.data(), knots, values) = (RecordedDerivatives(this->Knots) * sample).cast<float>();
}

void PeriodicPositions::Evaluate(double phase, std::vector<Vector3>& positions) const
{
  positions.resize(this->Values / 3);
  if (positions.empty())
  {
    return;
  }
  const KnotInterval at = IntervalAt(this->Knots, std::isfinite(phase) ? phase : 0.0);
  const double b = at.share;
  const double a = 1.0 - b;
  // Multiplied and added in this order: recorded sessions hold the bits.
  const double c = (a * a * a - a) * at.gap * at.gap / 6.0;
  const double d = (b * b * b - b) * at.gap * at.gap / 6.0;
  const double* first = this->Sample.data() + at.before * this->Values;
  const double* second = this->Sample.data() + at.after * this->Values;
  const float* firstBend = this->Second.data() + at.before * this->Values;
  const float* secondBend = this->Second.data() + at.after * this->Values;
  double* out = positions.front().data();
  for (std::size_t n = 0; n < this->Values; ++n)
  {
    out[n] = a * first[n] + b * second[n] +
      (c * static_cast<double>(firstBend[n]) + d * static_cast<double>(secondBend[n]));
  }
}
}
