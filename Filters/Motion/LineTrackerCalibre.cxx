#include "LineTracker.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace coronary
{
namespace
{
std::vector<std::vector<int>> Daughters(const LineNodes& nodes)
{
  std::vector<std::vector<int>> daughters(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    if (nodes.parent[n] >= 0)
    {
      daughters[nodes.parent[n]].push_back(static_cast<int>(n));
    }
  }
  return daughters;
}
}

/**
 * Where things around a node go when all vessels widen: outwards from the nearest axis by its distance
 * from it, beyond the wall less and less. On a lattice, mm per unit of the logarithm of the radius.
 */
class WideningField
{
public:
  WideningField(const LineNodes& nodes, const std::vector<std::vector<int>>& daughters, int node)
  {
    struct Step
    {
      Vector3 start;
      Vector3 end;
      double radius;
      double wider;
    };
    std::vector<Step> steps;
    const Vector3& centre = nodes.position[node];
    // Vessels that are near in space are near in the tree, but for crossings.
    std::vector<std::pair<int, int>> open{ { node, -1 } };
    while (!open.empty())
    {
      // No structured binding: clang 14 lets no lambda capture one.
      const int at = open.back().first;
      const int from = open.back().second;
      open.pop_back();
      const auto go = [&](int next, int upper, int lower)
      {
        if (next < 0 || next == from)
        {
          return;
        }
        const double wide = NodeRadius(nodes, upper);
        steps.push_back({ nodes.position[upper] - centre, nodes.position[lower] - centre, wide,
          NodeRadius(nodes, lower) - wide });
        if ((nodes.position[next] - centre).norm() < 2.0 * Reach)
        {
          open.emplace_back(next, at);
        }
      };
      go(nodes.parent[at], nodes.parent[at], at);
      for (const int daughter : daughters[at])
      {
        go(daughter, at, daughter);
      }
    }
    this->Values.resize(static_cast<std::size_t>(Side) * Side * Side, Eigen::Vector3f::Zero());
    std::size_t index = 0;
    for (int k = 0; k < Side; ++k)
    {
      for (int j = 0; j < Side; ++j)
      {
        for (int i = 0; i < Side; ++i, ++index)
        {
          const Vector3 place = Spacing * Vector3(i, j, k) - Vector3::Constant(Reach);
          double minimum = Beyond;
          Vector3 out = Vector3::Zero();
          for (const Step& step : steps)
          {
            const SegmentPlace near = NearestOnSegment(place, step.start, step.end);
            const double fromWall =
              std::sqrt(near.squaredDistance) - step.radius - near.fraction * step.wider;
            if (fromWall < minimum)
            {
              minimum = fromWall;
              out = place - near.position;
            }
          }
          const double share = std::clamp((Beyond - minimum) / (Beyond - Within), 0.0, 1.0);
          this->Values[index] = (share * out).cast<float>();
        }
      }
    }
  }

  /// @param place  mm from the node, at rest
  Vector3 At(const Vector3& place) const
  {
    const Vector3 index = (place + Vector3::Constant(Reach)) / Spacing;
    if (!((index.array() >= 0.0).all() && (index.array() < Side - 1).all()))
    {
      return Vector3::Zero();
    }
    const Eigen::Vector3i corner = index.cast<int>();
    const Vector3 part = index - corner.cast<double>();
    Vector3 sum = Vector3::Zero();
    for (int c = 0; c < 8; ++c)
    {
      const int i = corner[0] + (c & 1);
      const int j = corner[1] + ((c >> 1) & 1);
      const int k = corner[2] + (c >> 2);
      const double share = ((c & 1) != 0 ? part[0] : 1.0 - part[0]) *
        ((c & 2) != 0 ? part[1] : 1.0 - part[1]) * ((c & 4) != 0 ? part[2] : 1.0 - part[2]);
      sum += share * this->Values[(k * Side + j) * Side + i].cast<double>();
    }
    return sum;
  }

private:
  static constexpr double Spacing = 0.5;
  static constexpr double Reach = 4.5; // mm, of the core and what it is smeared by
  static constexpr int Side = 19;
  // Things move with the wall as far as it is blurred, and not at all further out, mm from it.
  static constexpr double Within = 0.4;
  static constexpr double Beyond = 1.2;
  std::vector<Eigen::Vector3f> Values;
};

LineTracker::Widening LineTracker::MeasureWidening(
  std::size_t k, int n, const WideningField& field) const
{
  // Least squares for the widening w in seen = constant + expected + w d(expected)/d(log radius), and a
  // shift and a blur that the alignment and the smearing may have left.
  constexpr int unknowns = 6;
  using Row = Eigen::Matrix<double, unknowns, 1>;
  const std::size_t samples = this->Core.places.size();
  const Vector3& position = this->Nodes.position[n];
  const double radius = NodeRadius(this->Nodes, n);
  // Where a vessel is smeared over several of its diameters nothing is left to be measured.
  const std::vector<Vector3> smear = this->Smear(n, this->Times[k]);
  const double smeared = (smear.back() - smear.front()).norm() / std::max(radius, 0.3);
  if (this->Likeness[k][n] < 0.7 || smeared > 3.0)
  {
    return {};
  }
  const Matrix3 back = this->Turn(n, this->Displacement[k]).transpose();
  const Vector3 centre = position + this->Displacement[k][n];
  // Expected at an offset from the centre, and its change by widening.
  const auto expected = [&](const Vector3& offset, bool widening)
  {
    float sum = 0.0F;
    for (const Vector3& moved : smear)
    {
      const Vector3 rest = back * (offset - moved);
      if (!widening)
      {
        sum += this->Reference.Sample(position + rest);
      }
      else if (const Vector3 out = field.At(rest); out.squaredNorm() > 0.0)
      {
        constexpr double part = 0.05;
        sum += (this->Reference.Sample(position + rest - part * out) -
                 this->Reference.Sample(position + rest + part * out)) /
          static_cast<float>(2.0 * part);
      }
    }
    return static_cast<double>(sum / static_cast<float>(smear.size()));
  };
  Eigen::Matrix<double, unknowns, unknowns> normal;
  normal.setZero();
  Row right = Row::Zero();
  double sum = 0.0;
  for (std::size_t p = 0; p < samples; ++p)
  {
    const Vector3 offset = this->Core.Offset(p);
    const double seen = this->Volumes[k].Sample(centre + offset);
    const double wanted = expected(offset, false);
    Row row;
    row << expected(offset, true), 1.0, 0.0, 0.0, 0.0, -6.0 * wanted;
    for (int axis = 0; axis < 3; ++axis)
    {
      const Vector3 step = this->Core.step * Vector3::Unit(axis);
      const double above = expected(offset + step, false);
      const double below = expected(offset - step, false);
      row[2 + axis] = above - below;
      row[5] += above + below;
    }
    if (std::isfinite(seen + row.sum()))
    {
      const double weight = this->Core.weights[p];
      normal += weight * row * row.transpose();
      right += weight * (seen - wanted) * row;
      sum += weight;
    }
  }
  if (sum < 0.3 || !(normal(0, 0) > 0.0))
  {
    return {};
  }
  const auto others = normal.bottomRightCorner<unknowns - 1, unknowns - 1>();
  const Eigen::Matrix<double, unknowns - 1, 1> share =
    others.completeOrthogonalDecomposition().solve(normal.col(0).tail<unknowns - 1>());
  const double information = normal(0, 0) - share.dot(normal.col(0).tail<unknowns - 1>());
  const double widening = (right[0] - share.dot(right.tail<unknowns - 1>())) / information;
  // No artery widens so much: it is not there, or it is another one.
  if (information > 0.01 * normal(0, 0) && std::abs(widening) < 0.25)
  {
    const double clear = 1.0 / ((1.0 + smeared * smeared) * (1.0 + smeared * smeared));
    return { widening, clear * information };
  }
  return {};
}

std::vector<double> LineTracker::MeasureCalibre(const std::vector<std::vector<bool>>& seen) const
{
  const std::size_t phases = this->Times.size();
  const std::size_t nodes = this->Nodes.size();
  const auto overNodes = [nodes](const auto& work)
  {
    ParallelFor(static_cast<std::int64_t>(nodes), 4,
      [&](std::int64_t first, std::int64_t last)
      {
        for (auto n = static_cast<int>(first); n < last; ++n)
        {
          work(n);
        }
      });
  };
  const std::vector<std::vector<int>> daughters = Daughters(this->Nodes);
  std::vector<std::optional<WideningField>> fields(nodes);
  overNodes([&](int n) { fields[n].emplace(this->Nodes, daughters, n); });
  const std::vector<std::string> results = this->OfPhases(
    [&](std::size_t k)
    {
      std::vector<Widening> estimates(nodes);
      overNodes([&](int n)
        { estimates[n] = seen[k][n] ? this->MeasureWidening(k, n, *fields[n]) : Widening(); });
      return Packed(estimates);
    });
  // A node alone is too noisy: the weighted median of all.
  std::vector<double> widening(phases, 0.0);
  std::vector<double> trust(phases, 0.0);
  for (std::size_t k = 0; k < phases; ++k)
  {
    std::vector<Widening> all;
    Unpack(results[k], all);
    std::sort(all.begin(), all.end(),
      [](const Widening& a, const Widening& b) { return a.value < b.value; });
    for (const Widening& one : all)
    {
      trust[k] += one.information;
    }
    double sum = 0.0;
    for (const Widening& one : all)
    {
      sum += one.information;
      if (sum >= 0.5 * trust[k])
      {
        widening[k] = one.value;
        break;
      }
    }
  }
  return this->PulseOf(widening, trust);
}

std::vector<double> LineTracker::PulseOf(
  const std::vector<double>& widening, const std::vector<double>& trust) const
{
  const std::size_t phases = this->Times.size();
  constexpr int harmonics = 3;
  constexpr int size = 2 * harmonics;
  const Eigen::VectorXd zero = PeriodicBasis(this->ReferenceTime, harmonics).tail(size);
  const double most = *std::max_element(trust.begin(), trust.end());
  // The m-th is expected to be 0.03 / m^2; the phase that is seen best has an error of about 0.003.
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  for (int row = 0; row < size; ++row)
  {
    const int harmonic = 1 + row / 2;
    matrix(row, row) = 0.01 * std::pow(harmonic, 4);
  }
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (std::size_t k = 0; k < phases && most > 0.0; ++k)
  {
    const Eigen::VectorXd row = PeriodicBasis(this->Times[k], harmonics).tail(size) - zero;
    matrix += trust[k] / most * row * row.transpose();
    right += trust[k] / most * widening[k] * row;
  }
  const Eigen::VectorXd pulse = matrix.ldlt().solve(right);
  std::vector<double> calibre;
  for (const double time : this->Times)
  {
    calibre.push_back(1.0 + pulse.dot(PeriodicBasis(time, harmonics).tail(size) - zero));
  }
  return calibre;
}
}
