#include "CurveGeometry.h"

#include "Numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr int Degree = 5;
constexpr int Order = Degree + 1;
constexpr int Penalised = 3; ///< derivative whose square is penalised
constexpr int MostIntervals = 4000;
constexpr double Overcount = 1.4; ///< weight of the degrees of freedom in cross-validation

/// Values of the six quintic B-splines of a unit interval, or of one of their derivatives, at
/// u in [0, 1]: Cox - de Boor on uniform knots, then differences.
std::array<double, Order> BasisValues(double u, int derivative)
{
  std::array<double, Order> values{};
  values[0] = 1.0;
  for (int d = 1; d <= Degree; ++d)
  {
    const bool differentiate = d > Degree - derivative;
    for (int k = d; k >= 0; --k)
    {
      const double left = k > 0 ? values[k - 1] : 0.0;
      const double right = k < d ? values[k] : 0.0;
      values[k] = differentiate ? left - right : ((u + d - k) * left + (k + 1 - u) * right) / d;
    }
  }
  return values;
}

/// A symmetric matrix with five side diagonals, and what is needed of its inverse.
class BandMatrix
{
public:
  explicit BandMatrix(int size)
    : Size(size)
    , Rows(size, std::array<double, Order>{})
  {
  }

  /// Element (i, i + k), 0 <= k <= 5.
  double& At(int i, int k) { return this->Rows[i][k]; }
  double At(int i, int k) const { return this->Rows[i][k]; }
  int GetSize() const { return this->Size; }

  /// Replaces the matrix by its factors U^T D U.
  void Factor()
  {
    for (int i = 0; i < this->Size; ++i)
    {
      for (int k = 0; k < Order && i + k < this->Size; ++k)
      {
        double value = this->Rows[i][k];
        for (int m = std::max(0, i + k - Degree); m < i; ++m)
        {
          value -= this->Rows[m][i - m] * this->Rows[m][i + k - m] * this->Rows[m][0];
        }
        this->Rows[i][k] = k == 0 ? value : value / this->Rows[i][0];
      }
    }
  }

  /// Solves with the factors, in place.
  void Solve(std::vector<Vector3>& right) const
  {
    for (int i = 0; i < this->Size; ++i)
    {
      for (int m = std::max(0, i - Degree); m < i; ++m)
      {
        right[i] -= this->Rows[m][i - m] * right[m];
      }
    }
    for (int i = this->Size - 1; i >= 0; --i)
    {
      right[i] /= this->Rows[i][0];
      for (int k = 1; k < Order && i + k < this->Size; ++k)
      {
        right[i] -= this->Rows[i][k] * right[i + k];
      }
    }
  }

  /// The part of the inverse within the band, from the factors (Hutchinson and de Hoog, Numer
  /// Math 1985;47:99).
  BandMatrix InverseBand() const
  {
    BandMatrix inverse(this->Size);
    for (int i = this->Size - 1; i >= 0; --i)
    {
      const int width = std::min(Degree, this->Size - 1 - i);
      for (int k = width; k >= 0; --k)
      {
        double value = k == 0 ? 1.0 / this->Rows[i][0] : 0.0;
        for (int m = 1; m <= width; ++m)
        {
          const int low = std::min(m, k);
          value -= this->Rows[i][m] * inverse.At(i + low, std::max(m, k) - low);
        }
        inverse.At(i, k) = value;
      }
    }
    return inverse;
  }

private:
  int Size;
  std::vector<std::array<double, Order>> Rows;
};

/// Quintic smoothing spline of the points over given parameters in [0, intervals].
class SmoothingSpline
{
public:
  SmoothingSpline(const std::vector<Vector3>& points, int intervals)
    : Points(points)
    , Intervals(intervals)
    , Penalty(intervals + Degree)
    , Coefficients(intervals + Degree, Vector3::Zero())
    , Covariance(intervals + Degree)
  {
    // Gauss' rule with five points is exact for the square of a polynomial of degree two.
    constexpr std::array<double, 3> nodes = { 0.1127016653792583, 0.5, 0.8872983346207417 };
    constexpr std::array<double, 3> weights = { 5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0 };
    for (std::size_t g = 0; g < nodes.size(); ++g)
    {
      const auto third = BasisValues(nodes[g], Penalised);
      for (int interval = 0; interval < intervals; ++interval)
      {
        for (int a = 0; a < Order; ++a)
        {
          for (int b = a; b < Order; ++b)
          {
            this->Penalty.At(interval + a, b - a) += weights[g] * third[a] * third[b];
          }
        }
      }
    }
  }

  void SetParameters(const std::vector<double>& parameters)
  {
    this->Parameters = parameters;
    const int size = this->Intervals + Degree;
    this->Normal = BandMatrix(size);
    this->Right.assign(size, Vector3::Zero());
    for (std::size_t i = 0; i < this->Points.size(); ++i)
    {
      int interval = 0;
      const auto basis = this->Basis(parameters[i], 0, interval);
      for (int a = 0; a < Order; ++a)
      {
        this->Right[interval + a] += basis[a] * this->Points[i];
        for (int b = a; b < Order; ++b)
        {
          this->Normal.At(interval + a, b - a) += basis[a] * basis[b];
        }
      }
    }
  }

  /// Fits for one wavelength, given in intervals; returns the cross-validation score.
  double Fit(double wavelength)
  {
    const double density = static_cast<double>(this->Points.size()) / this->Intervals;
    const double lambda = density * std::pow(wavelength / (2.0 * Pi), 2 * Penalised);
    const int size = this->Intervals + Degree;
    BandMatrix factors(size);
    for (int i = 0; i < size; ++i)
    {
      for (int k = 0; k < Order && i + k < size; ++k)
      {
        factors.At(i, k) = this->Normal.At(i, k) + lambda * this->Penalty.At(i, k);
      }
    }
    factors.Factor();
    this->Coefficients = this->Right;
    factors.Solve(this->Coefficients);
    this->Covariance = factors.InverseBand();

    double residual = 0.0;
    double freedom = 0.0;
    for (std::size_t i = 0; i < this->Points.size(); ++i)
    {
      residual += (this->Points[i] - this->Value(this->Parameters[i], 0)).squaredNorm();
      freedom += this->Variance(this->Parameters[i], 0);
    }
    const auto n = static_cast<double>(this->Points.size());
    this->NoiseVariance = residual / (3.0 * std::max(1e-3 * n, n - freedom));
    const double left = n - Overcount * freedom;
    return left <= 0.01 * n ? std::numeric_limits<double>::infinity()
                            : n * residual / (left * left);
  }

  Vector3 Value(double parameter, int derivative) const
  {
    int interval = 0;
    const auto basis = this->Basis(parameter, derivative, interval);
    Vector3 value = Vector3::Zero();
    for (int a = 0; a < Order; ++a)
    {
      value += basis[a] * this->Coefficients[interval + a];
    }
    return value;
  }

  /// Variance of a coordinate (or its derivative) of the fit per variance of the points.
  double Variance(double parameter, int derivative) const
  {
    int interval = 0;
    const auto basis = this->Basis(parameter, derivative, interval);
    double value = 0.0;
    for (int a = 0; a < Order; ++a)
    {
      value += basis[a] * basis[a] * this->Covariance.At(interval + a, 0);
      for (int b = a + 1; b < Order; ++b)
      {
        value += 2.0 * basis[a] * basis[b] * this->Covariance.At(interval + a, b - a);
      }
    }
    return value;
  }

  /// Of one coordinate of one point, estimated from the residuals of the last fit.
  double GetNoiseVariance() const { return this->NoiseVariance; }

private:
  std::array<double, Order> Basis(double parameter, int derivative, int& interval) const
  {
    interval = std::clamp(static_cast<int>(parameter), 0, this->Intervals - 1);
    return BasisValues(parameter - interval, derivative);
  }

  const std::vector<Vector3>& Points;
  int Intervals;
  std::vector<double> Parameters;
  BandMatrix Normal{ 0 };
  BandMatrix Penalty;
  std::vector<Vector3> Right;
  std::vector<Vector3> Coefficients;
  BandMatrix Covariance;
  double NoiseVariance = 0.0;
};

/// Chord lengths of the points after a mean over five neighbours, scaled to end at `end`.
std::vector<double> ChordParameters(const std::vector<Vector3>& points, double end, double& length)
{
  const auto n = static_cast<std::int64_t>(points.size());
  std::vector<Vector3> mean(points.size());
  for (std::int64_t i = 0; i < n; ++i)
  {
    const std::int64_t reach = std::min<std::int64_t>({ 2, i, n - 1 - i });
    mean[i].setZero();
    for (std::int64_t j = i - reach; j <= i + reach; ++j)
    {
      mean[i] += points[j] / static_cast<double>(2 * reach + 1);
    }
  }
  std::vector<double> parameters(points.size(), 0.0);
  for (std::int64_t i = 1; i < n; ++i)
  {
    parameters[i] = parameters[i - 1] + (mean[i] - mean[i - 1]).norm();
  }
  length = parameters.back();
  for (double& parameter : parameters)
  {
    parameter *= end / length;
  }
  return parameters;
}

/// Moves every parameter to where the fit is nearest to the point, then gives arc lengths of the
/// fit as parameters.
std::vector<double> ArcParameters(const SmoothingSpline& spline, const std::vector<Vector3>& points,
  std::vector<double> parameters, double end, double& length)
{
  for (std::size_t i = 1; i + 1 < points.size(); ++i)
  {
    const Vector3 first = spline.Value(parameters[i], 1);
    const double step =
      first.dot(points[i] - spline.Value(parameters[i], 0)) / std::max(1e-300, first.squaredNorm());
    parameters[i] = std::clamp(parameters[i] + std::clamp(step, -1.0, 1.0), 0.0, end);
  }
  std::sort(parameters.begin(), parameters.end());
  std::vector<double> arc(parameters.size(), 0.0);
  for (std::size_t i = 1; i < parameters.size(); ++i)
  {
    // Simpson's rule on the speed.
    const double a = parameters[i - 1];
    const double b = parameters[i];
    arc[i] = arc[i - 1] +
      (b - a) / 6.0 *
        (spline.Value(a, 1).norm() + 4.0 * spline.Value(0.5 * (a + b), 1).norm() +
          spline.Value(b, 1).norm());
  }
  length = arc.back();
  for (double& value : arc)
  {
    value *= end / length;
  }
  return arc;
}

/// The spline's natural ends have no third derivative: the torsion there is the one half a
/// wavelength away.
void HoldEnds(CurveGeometry& curve)
{
  const double reach = 0.5 * curve.wavelength;
  const std::vector<double>& arc = curve.arcLength;
  if (arc.back() <= 4.0 * reach)
  {
    return;
  }
  const auto low = std::lower_bound(arc.begin(), arc.end(), reach) - arc.begin();
  const auto high = std::upper_bound(arc.begin(), arc.end(), arc.back() - reach) - arc.begin() - 1;
  std::fill(curve.torsion.begin(), curve.torsion.begin() + low, curve.torsion[low]);
  std::fill(curve.torsion.begin() + high, curve.torsion.end(), curve.torsion[high]);
}

/// Directions where the curve does not bend: the nearest bend's, carried along without twist.
void CarryNormals(CurveGeometry& curve, const std::vector<char>& bends)
{
  const auto n = static_cast<std::int64_t>(bends.size());
  const auto first = std::find(bends.begin(), bends.end(), 1);
  if (first == bends.end())
  {
    curve.normal[0] = curve.tangent[0].unitOrthogonal();
  }
  const auto carry = [&](std::int64_t from, std::int64_t to)
  {
    // The smallest rotation that takes one tangent to the other.
    const Vector3 sum = curve.tangent[from] + curve.tangent[to];
    const Vector3 normal = curve.normal[from] -
      curve.normal[from].dot(curve.tangent[to]) /
        std::max(1e-6, 1.0 + curve.tangent[from].dot(curve.tangent[to])) * sum;
    curve.normal[to] = (normal - normal.dot(curve.tangent[to]) * curve.tangent[to]).normalized();
  };
  const std::int64_t start = first == bends.end() ? 0 : first - bends.begin();
  for (std::int64_t i = start - 1; i >= 0; --i)
  {
    carry(i + 1, i);
  }
  for (std::int64_t i = start + 1; i < n; ++i)
  {
    if (!bends[i])
    {
      carry(i - 1, i);
    }
  }
}

CurveGeometry StraightLine(const std::vector<Vector3>& points)
{
  const std::size_t n = points.size();
  CurveGeometry curve;
  curve.position = points;
  Vector3 along = points.back() - points.front();
  along = along.norm() > 0.0 ? Vector3(along.normalized()) : Vector3(Vector3::UnitX());
  curve.tangent.assign(n, along);
  curve.normal.assign(n, along.unitOrthogonal());
  curve.binormal.assign(n, along.cross(along.unitOrthogonal()));
  curve.curvature.assign(n, 0.0);
  curve.torsion.assign(n, 0.0);
  curve.arcLength.assign(n, 0.0);
  for (std::size_t i = 1; i < n; ++i)
  {
    curve.arcLength[i] = curve.arcLength[i - 1] + (points[i] - points[i - 1]).norm();
  }
  return curve;
}
}

double PolylineLength(const std::vector<Vector3>& points)
{
  double length = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i)
  {
    length += (points[i] - points[i - 1]).norm();
  }
  return length;
}

double PolylineTortuosity(const std::vector<Vector3>& points)
{
  if (points.size() < 2)
  {
    return 0.0;
  }
  const double length = PolylineLength(points);
  const double chord = (points.back() - points.front()).norm();
  return chord > 1e-6 * length ? std::max(0.0, length / chord - 1.0) : 0.0;
}

CurveGeometry ComputeCurveGeometry(
  const std::vector<Vector3>& points, const CurveSmoothing& smoothing)
{
  if (points.empty())
  {
    throw std::invalid_argument("A curve needs at least one point");
  }
  if (!std::isfinite(smoothing.wavelength) || !std::isfinite(smoothing.minimumWavelength))
  {
    throw std::invalid_argument("The wavelength of the smoothing must be a finite number");
  }
  std::size_t distinct = 1;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (!points[i].allFinite())
    {
      throw std::invalid_argument("A coordinate of the curve is not a finite number");
    }
    distinct += i > 0 && points[i] != points[i - 1];
  }
  if (distinct < 3)
  {
    return StraightLine(points);
  }

  // Not more splines than the points can decide about, nor shorter than the smoothing leaves over.
  const double chords = PolylineLength(points);
  double shortest =
    smoothing.wavelength >= 0.0 ? smoothing.wavelength : smoothing.minimumWavelength;
  const double wanted = shortest > 0.0
    ? std::min(static_cast<double>(distinct), 8.0 * chords / shortest + 4.0)
    : static_cast<double>(distinct);
  const int intervals = std::clamp(static_cast<int>(wanted) - 1, 1, MostIntervals);
  const double end = intervals;
  double length = 0.0;
  std::vector<double> parameters = ChordParameters(points, end, length);
  if (length <= 0.0)
  {
    return StraightLine(points);
  }

  SmoothingSpline spline(points, intervals);
  CurveGeometry curve;
  double found = 0.0;
  constexpr int rounds = 4;
  for (int round = 0; round < rounds; ++round)
  {
    spline.SetParameters(parameters);
    const double unit = intervals / length;
    const double minimum =
      std::max(2.0 * intervals / static_cast<double>(distinct), smoothing.minimumWavelength * unit);
    if (smoothing.wavelength >= 0.0)
    {
      found = std::max(smoothing.wavelength * unit, 0.1);
    }
    else
    {
      const double most = std::max(4.0 * intervals, 2.0 * minimum);
      constexpr int steps = 40;
      double best = std::numeric_limits<double>::infinity();
      found = most;
      for (int step = 0; step <= steps; ++step)
      {
        const double wavelength =
          minimum * std::pow(most / minimum, static_cast<double>(step) / steps);
        const double score = spline.Fit(wavelength);
        if (score < best)
        {
          best = score;
          found = wavelength;
        }
      }
    }
    spline.Fit(found);
    curve.wavelength = found / unit;
    if (round + 1 < rounds)
    {
      parameters = ArcParameters(spline, points, parameters, end, length);
    }
  }

  const std::size_t n = points.size();
  const double scale = length / intervals; // of one interval
  curve.position.resize(n);
  curve.tangent.resize(n);
  curve.normal.resize(n);
  curve.binormal.resize(n);
  curve.curvature.resize(n);
  curve.torsion.resize(n);
  curve.arcLength.resize(n);
  std::vector<char> bends(n, 0);
  for (std::size_t i = 0; i < n; ++i)
  {
    const double t = parameters[i];
    const Vector3 first = spline.Value(t, 1);
    const Vector3 second = spline.Value(t, 2);
    const Vector3 third = spline.Value(t, 3);
    const double speed = std::max(1e-12 * scale, first.norm());
    const Vector3 bend = first.cross(second);
    // Two coordinates of the second derivative lie across the curve.
    const double error = 2.0 * speed * speed * spline.GetNoiseVariance() * spline.Variance(t, 2);
    curve.position[i] = spline.Value(t, 0);
    curve.tangent[i] = first / speed;
    curve.curvature[i] = bend.norm() / (speed * speed * speed);
    // Below, the direction is that of rounding errors: a bend of 1e-5 over the whole curve.
    const double rounding = 1e-5 / length * speed * speed * speed;
    const double certain = bend.squaredNorm() + error + rounding * rounding;
    curve.torsion[i] = bend.dot(third) / certain;
    bends[i] = bend.norm() > rounding;
    if (bends[i])
    {
      curve.normal[i] = bend.cross(first).normalized();
    }
    curve.arcLength[i] = parameters[i] * scale;
  }
  HoldEnds(curve);
  CarryNormals(curve, bends);
  for (std::size_t i = 0; i < n; ++i)
  {
    curve.binormal[i] = curve.tangent[i].cross(curve.normal[i]);
  }
  return curve;
}
}
