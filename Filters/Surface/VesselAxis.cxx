#include "VesselAxis.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
using Vector4 = Eigen::Vector4d;

/// Clamped cubic B-spline of four numbers: position and radius.
struct Spline
{
  std::vector<double> knots;
  std::vector<Vector4> coefficients;

  int Interval(double t) const
  {
    const int last = static_cast<int>(this->coefficients.size()) - 1;
    const auto above = std::upper_bound(this->knots.begin() + 4, this->knots.begin() + last + 1, t);
    return static_cast<int>(above - this->knots.begin()) - 1;
  }

  /// The four cubic basis functions that are not zero at t (de Boor's recursion).
  void Basis(int interval, double t, double* basis) const
  {
    basis[0] = 1.0;
    double left[4];
    double right[4];
    for (int j = 1; j <= 3; ++j)
    {
      left[j] = t - this->knots[interval + 1 - j];
      right[j] = this->knots[interval + j] - t;
      double saved = 0.0;
      for (int r = 0; r < j; ++r)
      {
        const double part = basis[r] / (right[r + 1] + left[j - r]);
        basis[r] = saved + right[r + 1] * part;
        saved = left[j - r] * part;
      }
      basis[j] = saved;
    }
  }

  /// Value, first, second and third derivative.
  void Derivatives(double t, Vector4* result) const
  {
    const int interval = this->Interval(t);
    // Control points of the derivatives that matter in this interval.
    Vector4 p[4];
    for (int i = 0; i < 4; ++i)
    {
      p[i] = this->coefficients[interval - 3 + i];
    }
    for (int order = 0; order <= 3; ++order)
    {
      // de Boor's algorithm of degree 3 - order on a copy.
      const int degree = 3 - order;
      Vector4 q[4];
      std::copy(p, p + degree + 1, q);
      for (int r = 1; r <= degree; ++r)
      {
        for (int j = degree; j >= r; --j)
        {
          const int i = interval - degree + j;
          const double low = this->knots[i];
          const double high = this->knots[i + 1 + degree - r];
          const double w = (t - low) / (high - low);
          q[j] = (1.0 - w) * q[j - 1] + w * q[j];
        }
      }
      result[order] = q[degree];
      for (int j = 0; j < degree; ++j)
      {
        const int i = interval - degree + j;
        p[j] = degree * (p[j + 1] - p[j]) / (this->knots[i + 1 + degree] - this->knots[i + 1]);
      }
    }
  }
};

/// Solves a symmetric positive definite system of bandwidth 3 for several right-hand sides.
void SolveBanded(std::vector<std::array<double, 4>>& matrix, std::vector<Vector4>& x)
{
  const int n = static_cast<int>(x.size());
  // matrix[i][k] is the entry (i, i - k); Cholesky in place.
  for (int i = 0; i < n; ++i)
  {
    for (int k = std::min(3, i); k >= 0; --k)
    {
      const int j = i - k;
      double sum = matrix[i][k];
      for (int m = std::max({ 0, i - 3, j - 3 }); m < j; ++m)
      {
        sum -= matrix[i][i - m] * matrix[j][j - m];
      }
      matrix[i][k] = k == 0 ? std::sqrt(std::max(sum, 1e-300)) : sum / matrix[j][0];
    }
  }
  for (int i = 0; i < n; ++i)
  {
    for (int k = 1; k <= std::min(3, i); ++k)
    {
      x[i] -= matrix[i][k] * x[i - k];
    }
    x[i] /= matrix[i][0];
  }
  for (int i = n - 1; i >= 0; --i)
  {
    for (int k = 1; k <= std::min(3, n - 1 - i); ++k)
    {
      x[i] -= matrix[i + k][k] * x[i + k];
    }
    x[i] /= matrix[i][0];
  }
}

/**
 * Least squares fit. The end points are weighted so that they are met; third differences of the
 * coefficients are held small where the points alone do not decide. No knot lies next to an end: the curve's bend at
 * the end would be anything.
 */
Spline Fit(const std::vector<double>& t, const std::vector<Vector4>& values,
  const std::vector<double>& minimumKnots)
{
  Spline spline;
  spline.knots.assign(4, 0.0);
  double last = 0.0;
  const double length = t.back();
  for (std::size_t i = 2; i + 2 < t.size(); ++i)
  {
    const double minimum = minimumKnots[i];
    if (t[i] - last >= minimum && length - t[i] >= minimum)
    {
      spline.knots.push_back(t[i]);
      last = t[i];
    }
  }
  spline.knots.insert(spline.knots.end(), 4, length);
  const int n = static_cast<int>(spline.knots.size()) - 4;
  spline.coefficients.assign(n, Vector4::Zero());
  std::vector<std::array<double, 4>> matrix(n, { 0.0, 0.0, 0.0, 0.0 });
  for (std::size_t i = 0; i < t.size(); ++i)
  {
    const double weight = i == 0 || i + 1 == t.size() ? 1e4 : 1.0;
    const int interval = spline.Interval(t[i]);
    double basis[4];
    spline.Basis(interval, t[i], basis);
    for (int j = 0; j < 4; ++j)
    {
      spline.coefficients[interval - 3 + j] += weight * basis[j] * values[i];
      for (int k = 0; k <= j; ++k)
      {
        matrix[interval - 3 + j][j - k] += weight * basis[j] * basis[k];
      }
    }
  }
  constexpr double stiffness = 1e-4;
  constexpr double difference[4] = { -1.0, 3.0, -3.0, 1.0 };
  for (int i = 0; i + 3 < n; ++i)
  {
    for (int j = 0; j < 4; ++j)
    {
      for (int k = 0; k <= j; ++k)
      {
        matrix[i + j][j - k] += stiffness * difference[j] * difference[k];
      }
    }
  }
  for (auto& row : matrix)
  {
    row[0] += 1e-12;
  }
  SolveBanded(matrix, spline.coefficients);
  return spline;
}

/// Tridiagonal system with constant off-diagonal structure, in place.
void SolveTridiagonal(
  std::vector<double>& lower, std::vector<double>& diagonal, std::vector<double>& x)
{
  const std::size_t n = x.size();
  // Symmetric: lower[i] couples i and i + 1.
  for (std::size_t i = 1; i < n; ++i)
  {
    const double factor = lower[i - 1] / diagonal[i - 1];
    diagonal[i] -= factor * lower[i - 1];
    x[i] -= factor * x[i - 1];
  }
  x[n - 1] /= diagonal[n - 1];
  for (std::size_t i = n - 1; i-- > 0;)
  {
    x[i] = (x[i] - lower[i] * x[i + 1]) / diagonal[i];
  }
}

Vector3 AnyNormal(const Vector3& tangent)
{
  int axis = 0;
  tangent.cwiseAbs().minCoeff(&axis);
  return tangent.cross(Vector3(Vector3::Unit(axis))).normalized();
}

Vector3 NormalPart(const Vector3& direction, const Vector3& tangent)
{
  const Vector3 part = direction - direction.dot(tangent) * tangent;
  const double length = part.norm();
  return length > 1e-9 * direction.norm() && length > 0.0 ? Vector3(part / length)
                                                          : AnyNormal(tangent);
}
}

VesselAxis::VesselAxis(const std::vector<Vector3>& points, const std::vector<double>& radius,
  double smoothing, bool startOpen, bool endOpen)
  : VesselAxis(points, radius, std::vector<double>(points.size(), smoothing), startOpen, endOpen)
{
}

VesselAxis::VesselAxis(const std::vector<Vector3>& points, const std::vector<double>& radius,
  const std::vector<double>& smoothing, bool startOpen, bool endOpen)
  : StartOpen(startOpen)
  , EndOpen(endOpen)
{
  std::vector<double> t;
  std::vector<Vector4> values;
  std::vector<double> minimumKnots; // distances, mm
  double minimumRadius = radius.front();
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    minimumRadius = std::min(minimumRadius, radius[i]);
    const Vector4 value(points[i][0], points[i][1], points[i][2], radius[i]);
    if (t.empty())
    {
      t.push_back(0.0);
      values.push_back(value);
      minimumKnots.push_back(smoothing[i] * radius[i]);
      continue;
    }
    const double step = (value.head<3>() - values.back().head<3>()).norm();
    if (step > 1e-6 * radius[i])
    {
      t.push_back(t.back() + step);
      values.push_back(value);
      minimumKnots.push_back(smoothing[i] * radius[i]);
    }
  }
  const Spline spline = Fit(t, values, minimumKnots);

  // Stations at a third of the radius, by arc length (three-point Gauss quadrature).
  double s = 0.0;
  const auto add = [&](double at)
  {
    Vector4 d[4];
    spline.Derivatives(at, d);
    Station station;
    const Vector3 first = d[1].head<3>();
    const Vector3 second = d[2].head<3>();
    const double speed = std::max(first.norm(), 1e-9);
    station.s = s;
    station.point = d[0].head<3>();
    station.tangent = first / speed;
    station.curvature = (second - second.dot(station.tangent) * station.tangent) / (speed * speed);
    const Vector3 cross = first.cross(second);
    const double square = cross.squaredNorm();
    station.torsion = square > 1e-12 ? cross.dot(Vector3(d[3].head<3>())) / square : 0.0;
    station.radius = std::max(d[0][3], 0.5 * minimumRadius);
    station.slope = d[0][3] > 0.5 * minimumRadius ? d[1][3] / speed : 0.0;
    this->Stations.push_back(station);
  };
  add(0.0);
  const int intervals = static_cast<int>(spline.coefficients.size()) - 3;
  for (int i = 0; i < intervals; ++i)
  {
    const double from = spline.knots[i + 3];
    const double to = spline.knots[i + 4];
    const double r = std::max(this->Stations.back().radius, 0.1 * (to - from));
    const int steps = std::max(1, static_cast<int>(std::ceil((to - from) / (0.34 * r))));
    for (int k = 0; k < steps; ++k)
    {
      const double low = from + (to - from) * k / steps;
      const double high = from + (to - from) * (k + 1) / steps;
      constexpr double node = 0.7745966692414834;
      double length = 0.0;
      for (int g = -1; g <= 1; ++g)
      {
        Vector4 d[4];
        spline.Derivatives(0.5 * (low + high) + 0.5 * (high - low) * node * g, d);
        length += (g == 0 ? 8.0 : 5.0) / 18.0 * (high - low) * d[1].head<3>().norm();
      }
      s += length;
      add(high);
    }
  }

  // Monotone between stations: a radius that overshoots would be a bump that nobody measured.
  for (std::size_t i = 0; i + 1 < this->Stations.size(); ++i)
  {
    Station& p = this->Stations[i];
    Station& q = this->Stations[i + 1];
    const double secant = (q.radius - p.radius) / (q.s - p.s);
    for (double* slope : { &p.slope, &q.slope })
    {
      if (*slope * secant <= 0.0)
      {
        // Not exactly flat: extrema may lie between stations.
        *slope = std::clamp(*slope, -std::abs(secant), std::abs(secant));
      }
      else if (std::abs(*slope) > 3.0 * std::abs(secant))
      {
        *slope = 3.0 * secant;
      }
    }
  }
  for (std::size_t i = 0; i + 1 < this->Stations.size(); ++i)
  {
    const Station& p = this->Stations[i];
    const Station& q = this->Stations[i + 1];
    Cubic cubic;
    cubic.s = p.s;
    cubic.ds = q.s - p.s;
    const Vector3 chord = q.point - p.point;
    const Vector3 m0 = p.tangent * cubic.ds;
    const Vector3 m1 = q.tangent * cubic.ds;
    cubic.a = p.point;
    cubic.b = m0;
    cubic.c = 3.0 * chord - 2.0 * m0 - m1;
    cubic.d = m0 + m1 - 2.0 * chord;
    const double dr = q.radius - p.radius;
    const double r0 = p.slope * cubic.ds;
    const double r1 = q.slope * cubic.ds;
    cubic.r0 = p.radius;
    cubic.r1 = r0;
    cubic.r2 = 3.0 * dr - 2.0 * r0 - r1;
    cubic.r3 = r0 + r1 - 2.0 * dr;
    this->Cubics.push_back(cubic);
  }
  this->SetFrames(SweepFrame::Blended, AnyNormal(this->Stations.front().tangent));
}

void VesselAxis::SetFrames(SweepFrame frame, const Vector3& first)
{
  // Least twist by double reflection: Wang et al., "Computation of rotation minimizing frames",
  // ACM Transactions on Graphics 2008;27(1):2.
  auto& stations = this->Stations;
  const std::size_t n = stations.size();
  stations[0].normal = NormalPart(first, stations[0].tangent);
  for (std::size_t i = 0; i + 1 < n; ++i)
  {
    const Vector3 v1 = stations[i + 1].point - stations[i].point;
    const double c1 = std::max(v1.squaredNorm(), 1e-300);
    const Vector3 r = stations[i].normal - (2.0 / c1) * v1.dot(stations[i].normal) * v1;
    const Vector3 t = stations[i].tangent - (2.0 / c1) * v1.dot(stations[i].tangent) * v1;
    const Vector3 v2 = stations[i + 1].tangent - t;
    const double c2 = v2.squaredNorm();
    const Vector3 next = c2 > 1e-24 ? Vector3(r - (2.0 / c2) * v2.dot(r) * v2) : r;
    stations[i + 1].normal = NormalPart(next, stations[i + 1].tangent);
  }
  for (Station& station : stations)
  {
    station.binormal = station.tangent.cross(station.normal);
    station.twist = 0.0;
  }
  if (frame == SweepFrame::RotationMinimising || n < 3)
  {
    return;
  }

  // Angle from there to the Frenet normal, known up to half turns, and trusted as far as the axis
  // bends; where it does not, the angle may change at the cost of twist:
  // minimise the sum of trust (angle - frenet)^2 + twist^2 / 2.
  std::vector<double> lower(n - 1);
  std::vector<double> diagonal(n, 0.0);
  std::vector<double> angle(n, 0.0);
  double previous = 0.0;
  bool any = false;
  for (std::size_t i = 0; i < n; ++i)
  {
    const Station& station = stations[i];
    const double bend = station.curvature.norm() * station.radius;
    const double trust = bend * bend;
    if (trust < 1e-8)
    {
      continue;
    }
    double frenet =
      std::atan2(station.curvature.dot(station.binormal), station.curvature.dot(station.normal));
    // Towards the nearest of the half turns, so that an inflection does not turn the frame over.
    frenet = previous + std::remainder(frenet - previous, any ? Pi : 2.0 * Pi);
    if (trust > 1e-4)
    {
      previous = frenet;
      any = true;
    }
    const double share = i == 0 || i + 1 == n ? 0.5 : 1.0;
    const double ds = i + 1 < n ? stations[i + 1].s - station.s : station.s - stations[i - 1].s;
    const double weight = 10.0 * share * trust * ds / station.radius;
    diagonal[i] += weight;
    angle[i] += weight * frenet;
  }
  for (std::size_t i = 0; i + 1 < n; ++i)
  {
    const double weight = stations[i].radius / (stations[i + 1].s - stations[i].s);
    lower[i] = -weight;
    diagonal[i] += weight;
    diagonal[i + 1] += weight;
  }
  diagonal[0] += 1e-9;
  SolveTridiagonal(lower, diagonal, angle);
  for (std::size_t i = 0; i < n; ++i)
  {
    Station& station = stations[i];
    const Vector3 normal = station.normal;
    station.normal = std::cos(angle[i]) * normal + std::sin(angle[i]) * station.binormal;
    station.binormal = station.tangent.cross(station.normal);
    const std::size_t low = i == 0 ? 0 : i - 1;
    const std::size_t high = std::min(i + 1, n - 1);
    station.twist = (angle[high] - angle[low]) / (stations[high].s - stations[low].s);
  }
}

void VesselAxis::SetContours(
  const std::vector<double>& s, const std::vector<std::vector<double>>& contours)
{
  this->ContourSize = 0;
  this->Contours.clear();
  if (s.empty())
  {
    return;
  }
  const int m = static_cast<int>(contours.front().size());
  // Relative to the round radius, linear in s between the given places.
  std::vector<double> relative(m);
  std::size_t at = 0;
  for (const Station& station : this->Stations)
  {
    while (at + 2 < s.size() && s[at + 1] <= station.s)
    {
      ++at;
    }
    const std::size_t next = std::min(at + 1, s.size() - 1);
    const double span = s[next] - s[at];
    const double w = span > 0.0 ? std::clamp((station.s - s[at]) / span, 0.0, 1.0) : 0.0;
    for (int j = 0; j < m; ++j)
    {
      relative[j] = ((1.0 - w) * contours[at][j] + w * contours[next][j]) / station.radius;
    }
    // Periodic cubic B-spline through the samples: (c[j-1] + 4 c[j] + c[j+1]) / 6 = value.
    // The inverse of that filter falls by 2 - sqrt(3) a sample.
    constexpr double pole = -0.2679491924311227;
    std::vector<double> c(relative);
    std::vector<double> forward(m);
    double start = 0.0;
    double power = 1.0;
    for (int j = 0; j < 4 * m && std::abs(power) > 1e-17; ++j)
    {
      start += power * c[(4 * m - j) % m];
      power *= pole;
    }
    forward[0] = start;
    for (int j = 1; j < m; ++j)
    {
      forward[j] = c[j] + pole * forward[j - 1];
    }
    double end = 0.0;
    power = 1.0;
    for (int j = 0; j < 4 * m && std::abs(power) > 1e-17; ++j)
    {
      end += power * forward[(m - 1 + j) % m];
      power *= pole;
    }
    c[m - 1] = -6.0 * pole * end;
    for (int j = m - 2; j >= 0; --j)
    {
      c[j] = pole * (c[j + 1] - 6.0 * forward[j]);
    }
    this->Contours.insert(this->Contours.end(), c.begin(), c.end());
  }
  this->ContourSize = m;
}

int VesselAxis::PieceAt(double s) const
{
  const auto above = std::upper_bound(this->Cubics.begin(), this->Cubics.end(), s,
    [](double value, const Cubic& cubic) { return value < cubic.s; });
  return std::max(0, static_cast<int>(above - this->Cubics.begin()) - 1);
}

void VesselAxis::Frame(
  int piece, double t, const Vector3& tangent, Vector3& normal, Vector3& binormal) const
{
  const double w = std::clamp(t, 0.0, 1.0);
  normal = NormalPart(
    (1.0 - w) * this->Stations[piece].normal + w * this->Stations[piece + 1].normal, tangent);
  binormal = tangent.cross(normal);
}

VesselAxis::Station VesselAxis::At(double s) const
{
  const int piece = this->PieceAt(s);
  const Cubic& q = this->Cubics[piece];
  const double limited = std::clamp(s, 0.0, this->Length());
  const double t = std::clamp((limited - q.s) / q.ds, 0.0, 1.0);
  Station result;
  result.s = s;
  result.point = q.a + t * (q.b + t * (q.c + t * q.d));
  result.tangent = (q.b + t * (2.0 * q.c + 3.0 * t * q.d)).normalized();
  const Station& p0 = this->Stations[piece];
  const Station& p1 = this->Stations[piece + 1];
  result.curvature = (1.0 - t) * p0.curvature + t * p1.curvature;
  result.torsion = (1.0 - t) * p0.torsion + t * p1.torsion;
  result.twist = (1.0 - t) * p0.twist + t * p1.twist;
  result.radius = q.r0 + t * (q.r1 + t * (q.r2 + t * q.r3));
  result.slope = (q.r1 + t * (2.0 * q.r2 + 3.0 * t * q.r3)) / q.ds;
  this->Frame(piece, t, result.tangent, result.normal, result.binormal);
  // Behind an open end the tube goes on straight.
  result.point += (s - limited) * result.tangent;
  return result;
}

double VesselAxis::ContourAt(int piece, double t, double angle) const
{
  const int m = this->ContourSize;
  const double x = angle / (2.0 * Pi) * m;
  const double floor = std::floor(x);
  const double u = x - floor;
  const double wide[4] = { (1.0 - u) * (1.0 - u) * (1.0 - u) / 6.0,
    (4.0 + u * u * (3.0 * u - 6.0)) / 6.0, (1.0 + 3.0 * u * (1.0 + u * (1.0 - u))) / 6.0,
    u * u * u / 6.0 };
  const double v = std::clamp(t, 0.0, 1.0);
  // Catmull-Rom along the axis.
  const double along[4] = { 0.5 * v * (-1.0 + v * (2.0 - v)), 0.5 * (2.0 + v * v * (3.0 * v - 5.0)),
    0.5 * v * (1.0 + v * (4.0 - 3.0 * v)), 0.5 * v * v * (v - 1.0) };
  const int last = static_cast<int>(this->Stations.size()) - 1;
  const int base = static_cast<int>(std::fmod(floor, m)) + 2 * m - 1;
  double sum = 0.0;
  for (int i = 0; i < 4; ++i)
  {
    const double* row = this->Contours.data() +
      static_cast<std::size_t>(std::clamp(piece - 1 + i, 0, last)) * static_cast<std::size_t>(m);
    double value = 0.0;
    for (int j = 0; j < 4; ++j)
    {
      value += wide[j] * row[(base + j) % m];
    }
    sum += along[i] * value;
  }
  return std::max(sum, 0.05);
}

double VesselAxis::WallRadius(double s, double angle) const
{
  const Station station = this->At(s);
  if (this->IsRound())
  {
    return station.radius;
  }
  const int piece = this->PieceAt(s);
  const Cubic& q = this->Cubics[piece];
  return station.radius * this->ContourAt(piece, (s - q.s) / q.ds, angle);
}

Vector3 VesselAxis::WallPoint(double s, double angle) const
{
  const Station station = this->At(s);
  double r = station.radius;
  if (!this->IsRound())
  {
    const int piece = this->PieceAt(s);
    const Cubic& q = this->Cubics[piece];
    r *= this->ContourAt(piece, (s - q.s) / q.ds, angle);
  }
  return station.point +
    r * (std::cos(angle) * station.normal + std::sin(angle) * station.binormal);
}

void VesselAxis::Locate(const Vector3& position, int& piece, double& t) const
{
  const int last = this->Pieces() - 1;
  piece = std::clamp(piece, 0, last);
  t = 0.5;
  int came = 0; // from which side this piece was entered
  for (int step = 0; step < 64; ++step)
  {
    const Cubic& q = this->Cubics[piece];
    for (int newton = 0; newton < 6; ++newton)
    {
      const Vector3 first = q.b + t * (2.0 * q.c + 3.0 * t * q.d);
      const Vector3 offset = position - (q.a + t * (q.b + t * (q.c + t * q.d)));
      const double square = first.squaredNorm();
      const double bend = offset.dot(2.0 * q.c + 6.0 * t * q.d);
      // Beyond the centre of curvature Newton's step would lead away from the minimum.
      const double change = offset.dot(first) / std::max(square - bend, 0.3 * square);
      t = std::clamp(t + change, -0.5, 1.5);
      if (std::abs(change) < 1e-9)
      {
        break;
      }
    }
    if (t < 0.0 && piece > 0)
    {
      if (came > 0)
      {
        t = 0.0;
        return;
      }
      --piece;
      t = 1.0;
      came = -1;
    }
    else if (t > 1.0 && piece < last)
    {
      if (came < 0)
      {
        t = 1.0;
        return;
      }
      ++piece;
      t = 0.0;
      came = 1;
    }
    else
    {
      return;
    }
  }
}

double VesselAxis::Value(const Vector3& position, int& piece, double& t) const
{
  this->Locate(position, piece, t);
  const double w = std::clamp(t, 0.0, 1.0);
  const Cubic& q = this->Cubics[piece];
  const Vector3 tangent = (q.b + w * (2.0 * q.c + 3.0 * w * q.d)).normalized();
  Vector3 offset = position - (q.a + w * (q.b + w * (q.c + w * q.d)));
  if ((t < 0.0 && this->StartOpen) || (t > 1.0 && this->EndOpen))
  {
    offset -= offset.dot(tangent) * tangent;
  }
  Vector3 normal;
  Vector3 binormal;
  this->Frame(piece, w, tangent, normal, binormal);
  const double r = q.r0 + w * (q.r1 + w * (q.r2 + w * q.r3));
  return offset.norm() -
    r * this->ContourAt(piece, w, std::atan2(offset.dot(binormal), offset.dot(normal)));
}

void VesselAxis::Evaluate(const Vector3& position, int hint, Sample& sample) const
{
  int piece = hint;
  double t = 0.0;
  this->Locate(position, piece, t);
  const Cubic& q = this->Cubics[piece];
  const double w = std::clamp(t, 0.0, 1.0);
  const Vector3 first = q.b + w * (2.0 * q.c + 3.0 * w * q.d);
  const Vector3 second = 2.0 * q.c + 6.0 * w * q.d;
  sample.piece = piece;
  sample.centre = q.a + w * (q.b + w * (q.c + w * q.d));
  Vector3 offset = position - sample.centre;
  const bool outside = t < 0.0 || t > 1.0;
  double extra = 0.0;
  if ((t < 0.0 && this->StartOpen) || (t > 1.0 && this->EndOpen))
  {
    const Vector3 tangent = first.normalized();
    extra = offset.dot(tangent);
    offset -= extra * tangent;
    sample.centre += extra * tangent;
  }
  const double away = offset.norm();
  const Vector3 outward = away > 1e-12 ? Vector3(offset / away) : AnyNormal(first.normalized());
  const double r = q.r0 + w * (q.r1 + w * (q.r2 + w * q.r3));
  sample.s = q.s + w * q.ds + extra;
  sample.radius = r;
  const double square = first.squaredNorm();
  const double nearer = std::max(square - offset.dot(second), 0.05 * square);
  if (this->IsRound())
  {
    sample.distance = away - r;
    sample.gradient = outward;
    if (!outside)
    {
      const double rate = q.r1 + w * (2.0 * q.r2 + 3.0 * w * q.r3);
      sample.gradient -= (rate / nearer) * first;
    }
  }
  else
  {
    sample.distance = this->Value(position, piece, t);
    sample.radius = away - sample.distance;
    const double h = 1e-4 * r;
    for (int axis = 0; axis < 3; ++axis)
    {
      double value[2];
      for (int side = 0; side < 2; ++side)
      {
        int at = sample.piece;
        double local = 0.0;
        value[side] = this->Value(position + (side == 0 ? -h : h) * Vector3::Unit(axis), at, local);
      }
      sample.gradient[axis] = (value[1] - value[0]) / (2.0 * h);
    }
  }
  // Around: 1 / r. Along: what the axis's own bend leaves of it on this side, for a tube of
  // constant radius.
  const double bend = outside ? 0.0 : -outward.dot(second) / square;
  const double along = bend / std::max(1.0 + r * bend, 0.05);
  sample.curvature = std::max(1.0 / std::max(r, 1e-12), std::abs(along));
}

int VesselAxis::NearestPiece(const Vector3& position, int low, int high, double& distance) const
{
  int best = low;
  distance = 1e300;
  for (int i = low; i <= high; ++i)
  {
    const Vector3& p = this->Stations[i].point;
    const Vector3 chord = this->Stations[i + 1].point - p;
    const Vector3 offset = position - p;
    const double t = std::clamp(offset.dot(chord) / chord.squaredNorm(), 0.0, 1.0);
    const double r = (1.0 - t) * this->Stations[i].radius + t * this->Stations[i + 1].radius;
    const double square = (offset - t * chord).squaredNorm();
    const double bound = distance + r;
    if (bound > 0.0 && square < bound * bound)
    {
      distance = std::sqrt(square) - r;
      best = i;
    }
  }
  return best;
}

double VesselAxis::NearestArcLength(const Vector3& position) const
{
  double distance = 0.0;
  int piece = 0;
  double best = 1e300;
  for (int i = 0; i < this->Pieces(); ++i)
  {
    const double square = (position - this->Stations[i].point).squaredNorm();
    if (square < best)
    {
      best = square;
      piece = i;
    }
  }
  const int low = std::max(0, piece - 1);
  piece = this->NearestPiece(position, low, std::min(piece + 1, this->Pieces() - 1), distance);
  double t = 0.0;
  this->Locate(position, piece, t);
  return this->Cubics[piece].s + std::clamp(t, 0.0, 1.0) * this->Cubics[piece].ds;
}
}
