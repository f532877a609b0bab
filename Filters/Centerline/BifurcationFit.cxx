#include "BifurcationFit.h"

#include "CrossFrame.h"
#include "Median.h"
#include "ParallelFor.h"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
// What is expected before the wall is seen, and how surely. Standard deviations.
/// Of a point on the wall, voxels: twice what two tubes miss it by, as neighbours share their voxels.
constexpr double WallDeviation = 0.25;
constexpr double OutlierLimit = 2.5; ///< of a point on the wall, its deviations
/// Of the daughter's axis over its radius, radians; away from the flow, as GreatBranchBend is.
constexpr double MeanBend = 0.25;
constexpr double BendDeviation = 0.3;
constexpr double TangentDeviation = 0.2; ///< of a chord beside the mouth, radians
constexpr double RadiusDeviation = 0.2;  ///< of the daughter's radius, relative
/// Of the edge, in daughter's radii: the image's blur rounds a sharp one, too.
constexpr double Rounding = 0.5;
constexpr double RoundingDeviation = 0.3;
/// Of the given fork across the daughter's axis, in its radii: 0.4 to 0.5 in phantoms, whatever the angle.
constexpr double ForkDeviation = 0.4;

/// Nearest place on a polyline: distance, and number of the segment plus fraction.
struct Foot
{
  double distance = std::numeric_limits<double>::infinity();
  double place = 0.0;
};

Foot Nearest(const Vector3& point, const std::vector<Vector3>& line)
{
  Foot foot;
  for (std::size_t i = 1; i < line.size(); ++i)
  {
    const Vector3 step = line[i] - line[i - 1];
    const Vector3 offset = point - line[i - 1];
    const double t = std::clamp(offset.dot(step) / std::max(step.squaredNorm(), 1e-300), 0.0, 1.0);
    const double squared = (offset - t * step).squaredNorm();
    if (squared < foot.distance)
    {
      foot = { squared, static_cast<double>(i - 1) + t };
    }
  }
  foot.distance = std::sqrt(foot.distance);
  return foot;
}

double ValueAt(const std::vector<double>& values, double place)
{
  const auto i = std::min(static_cast<std::size_t>(place), values.size() - 2);
  const double t = place - static_cast<double>(i);
  return (1.0 - t) * values[i] + t * values[i + 1];
}

/// Index that is `length` further along a polyline, or nearest to it; backwards if negative.
std::size_t Along(const std::vector<Vector3>& line, std::size_t from, double length)
{
  std::size_t i = from;
  for (double passed = 0.0; passed < std::abs(length);)
  {
    if (length > 0.0 ? i + 1 == line.size() : i == 0)
    {
      break;
    }
    const std::size_t next = length > 0.0 ? i + 1 : i - 1;
    passed += (line[next] - line[i]).norm();
    i = next;
  }
  return i;
}

/// Two tubes' distance with a rounded inner edge of radius k.
double RoundedUnion(double a, double b, double k)
{
  const double u = std::max(0.0, k - a);
  const double v = std::max(0.0, k - b);
  return std::max(k, std::min(a, b)) - std::sqrt(u * u + v * v);
}

class Fit
{
public:
  Fit(const ImageInterpolator& image, const BifurcationAxes& axes, const LumenSettings& settings)
    : Image(image)
    , Axes(axes)
    , Settings(settings)
    , Voxel(image.MinimumSpacing())
  {
  }

  BifurcationFit Run(double minimumTurn);

private:
  bool FindExtent();
  void CollectWalls();
  Eigen::MatrixXd Minimize(
    const Eigen::VectorXd& scale, Eigen::VectorXd& p, Eigen::VectorXd& r) const;
  Eigen::VectorXd Residuals(const Eigen::VectorXd& p) const;
  void Curves(const Eigen::VectorXd& p, BezierCurve& through, BezierCurve& side) const;
  void Sample(const BezierCurve& curve, double extension, std::vector<Vector3>& line) const;

  const ImageInterpolator& Image;
  const BifurcationAxes& Axes;
  const LumenSettings& Settings;
  double Voxel;

  std::size_t First = 0;
  std::size_t Last = 0;
  std::size_t Alone = 0;
  std::size_t End = 0;
  double FirstRadius = 0.0; ///< of the vessel that goes straight on, mm
  double LastRadius = 0.0;
  double SideRadius = 0.0;
  Vector3 Inwards; ///< seen tangents at both ends of `through`
  Vector3 Outwards;
  BezierCurve Through;
  BezierCurve Side;
  std::vector<Vector3> Walls;
  double GivenFork = std::numeric_limits<double>::infinity(); ///< its deviation, daughter's radii

  static constexpr int Pieces = 12; ///< of a curve
  // Unknowns: place of the fork, inner points of both curves, the daughter's radius, the parent's
  // difference, rounding.
  static constexpr int Count = 16;
};

/// Which part of the axes is hidden by the mouth.
bool Fit::FindExtent()
{
  const std::vector<Vector3>& through = this->Axes.through;
  const std::vector<Vector3>& side = this->Axes.side;
  if (through.size() < 8 || side.size() < 8 || this->Axes.fork == 0 ||
    this->Axes.fork + 1 >= through.size())
  {
    return false;
  }
  std::vector<double> outside(side.size());
  for (std::size_t i = 0; i < side.size(); ++i)
  {
    const Foot foot = Nearest(side[i], through);
    outside[i] = foot.distance / ValueAt(this->Axes.throughRadius, foot.place);
  }
  const auto firstBeyond = [&](double radii)
  {
    return static_cast<std::size_t>(
      std::find_if(outside.begin(), outside.end(), [&](double o) { return o > radii; }) -
      outside.begin());
  };
  // From where the daughter's sections are its own; to where they are so all around.
  this->Alone = firstBeyond(1.3);
  this->End = firstBeyond(2.0);
  if (this->End >= side.size() || this->Alone >= this->End)
  {
    return false;
  }
  const std::size_t known =
    Along(side, this->Alone, std::max(1.5 * this->Axes.sideRadius[this->Alone], 4.0 * this->Voxel));
  this->SideRadius =
    MedianOf<double>({ this->Axes.sideRadius.begin() + static_cast<std::ptrdiff_t>(this->Alone),
      this->Axes.sideRadius.begin() + static_cast<std::ptrdiff_t>(known) + 1 });

  // Behind the carina the vessels have their own walls again.
  this->First = Along(through, this->Axes.fork, -this->SideRadius);
  this->Last = this->Axes.fork;
  while (this->Last + 1 < through.size())
  {
    const Foot foot = Nearest(through[this->Last], side);
    if (foot.distance > this->Axes.throughRadius[this->Last] +
        ValueAt(this->Axes.sideRadius, foot.place) + 0.75 * this->Voxel)
    {
      break;
    }
    ++this->Last;
  }
  const double chord = std::max(this->Axes.throughRadius[this->First], 4.0 * this->Voxel);
  const std::size_t before = Along(through, this->First, -chord);
  const std::size_t after = Along(through, this->Last, chord);
  if ((through[this->First] - through[before]).norm() < 0.5 * chord ||
    (through[after] - through[this->Last]).norm() < 0.5 * chord)
  {
    return false;
  }
  const std::vector<double>& radius = this->Axes.throughRadius;
  this->FirstRadius = MedianOf<double>({ radius.begin() + static_cast<std::ptrdiff_t>(before),
    radius.begin() + static_cast<std::ptrdiff_t>(this->First) + 1 });
  this->LastRadius = MedianOf<double>({ radius.begin() + static_cast<std::ptrdiff_t>(this->Last),
    radius.begin() + static_cast<std::ptrdiff_t>(after) + 1 });
  this->Inwards = (through[this->First] - through[before]).normalized();
  this->Outwards = (through[after] - through[this->Last]).normalized();

  const Vector3& a = through[this->First];
  const Vector3& b = through[this->Last];
  const double handle = (b - a).norm() / 3.0;
  this->Through = { a, a + handle * this->Inwards, b - handle * this->Outwards, b };
  const Vector3& c = through[this->Axes.fork];
  const Vector3& d = side[this->End];
  this->Side = { c, c + (d - c) / 3.0, d - (d - c) / 3.0, d };
  return true;
}

void Fit::CollectWalls()
{
  std::vector<double> values;
  for (std::size_t i = this->Alone; i <= this->End; ++i)
  {
    values.push_back(this->Image.At(this->Axes.side[i]));
  }
  const double lumen = MedianOf(values);
  std::vector<Vector3> walls;
  const auto collect = [&](const std::vector<Vector3>& line, const std::vector<double>& radius)
  {
    double passed = this->Voxel;
    for (std::size_t i = 1; i + 1 < line.size(); ++i)
    {
      passed += (line[i] - line[i - 1]).norm();
      if (passed >= this->Voxel)
      {
        passed = 0.0;
        const Vector3 tangent = line[i + 1] - line[i - 1];
        const std::vector<Vector3> found =
          MeasureWall(this->Image, line[i], tangent, radius[i], lumen, this->Settings);
        walls.insert(walls.end(), found.begin(), found.end());
      }
    }
  };
  std::vector<Vector3> line;
  this->Sample(this->Through, 0.0, line);
  std::vector<double> radius;
  for (int i = 0; i <= Pieces; ++i)
  {
    radius.push_back(
      this->FirstRadius + (this->LastRadius - this->FirstRadius) * static_cast<double>(i) / Pieces);
  }
  collect(line, radius);
  const std::vector<Vector3> side(
    this->Axes.side.begin(), this->Axes.side.begin() + static_cast<std::ptrdiff_t>(this->End) + 1);
  collect(side, std::vector<double>(side.size(), this->SideRadius));

  // The wall of these two, and not beyond the ends of the curves.
  for (const Vector3& wall : walls)
  {
    const Foot onThrough = Nearest(wall, line);
    const Foot onSide = Nearest(wall, side);
    const double a = onThrough.distance - ValueAt(radius, onThrough.place);
    const double b = onSide.distance - this->SideRadius;
    const bool within = a < b ? onThrough.place > 0.0 && onThrough.place < Pieces
                              : onSide.place < static_cast<double>(side.size() - 1);
    if (within && std::min(std::abs(a), std::abs(b)) < 0.6 * this->SideRadius)
    {
      this->Walls.push_back(wall);
    }
  }
}

void Fit::Curves(const Eigen::VectorXd& p, BezierCurve& through, BezierCurve& side) const
{
  through = { this->Through[0], p.segment<3>(7), p.segment<3>(10), this->Through[3] };
  side = { BezierPoint(through, p[0]), p.segment<3>(1), p.segment<3>(4), this->Side[3] };
}

void Fit::Sample(const BezierCurve& curve, double extension, std::vector<Vector3>& line) const
{
  line.clear();
  if (extension > 0.0)
  {
    line.push_back(curve[0] + extension * (curve[0] - curve[1]).normalized());
  }
  for (int i = 0; i <= Pieces; ++i)
  {
    line.push_back(BezierPoint(curve, static_cast<double>(i) / Pieces));
  }
  if (extension > 0.0)
  {
    line.push_back(curve[3] + extension * (curve[3] - curve[2]).normalized());
  }
}

Eigen::VectorXd Fit::Residuals(const Eigen::VectorXd& p) const
{
  BezierCurve through;
  BezierCurve side;
  this->Curves(p, through, side);
  const double radius = p[13];
  const double difference = p[14];
  const double rounding = std::abs(p[15]) * this->SideRadius;
  std::vector<Vector3> throughLine;
  std::vector<Vector3> sideLine;
  this->Sample(through, this->FirstRadius, throughLine);
  this->Sample(side, this->FirstRadius, sideLine);
  sideLine.erase(sideLine.begin());

  const auto walls = static_cast<Eigen::Index>(this->Walls.size());
  Eigen::VectorXd r(walls + 23);
  for (Eigen::Index i = 0; i < walls; ++i)
  {
    const Vector3& wall = this->Walls[i];
    const Foot onThrough = Nearest(wall, throughLine);
    const double share = std::clamp((onThrough.place - 1.0) / Pieces, 0.0, 1.0);
    const double throughRadius =
      this->FirstRadius + share * (this->LastRadius - this->FirstRadius) + difference;
    const double distance = RoundedUnion(
      onThrough.distance - throughRadius, Nearest(wall, sideLine).distance - radius, rounding);
    const double e = distance / (WallDeviation * this->Voxel);
    r[i] = e / std::sqrt(1.0 + e * e / (OutlierLimit * OutlierLimit));
  }
  // Axes are smooth: the daughter's bends little, the other one's bend changes little.
  const auto second = [](const BezierCurve& c, int i) -> Vector3
  { return c[i] - 2.0 * c[i + 1] + c[i + 2]; };
  const auto steps = [](const BezierCurve& c)
  { return Vector3((c[1] - c[0]).norm(), (c[2] - c[1]).norm(), (c[3] - c[2]).norm()); };
  const double bend =
    6.0 * this->SideRadius / (BendDeviation * std::max(1e-12, (side[3] - side[0]).squaredNorm()));
  // A branch leaves in the direction of the flow and bends away.
  const Vector3 leaves = (side[1] - side[0]).normalized();
  const Vector3 flow = (through[3] - through[0]).normalized();
  r.segment<3>(walls) = bend * second(side, 0) +
    MeanBend / BendDeviation * (flow - flow.dot(leaves) * leaves).normalized();
  r.segment<3>(walls + 3) = bend * second(side, 1);
  const double change = 6.0 * this->FirstRadius /
    (BendDeviation * std::max(1e-12, (through[3] - through[0]).squaredNorm()));
  r.segment<3>(walls + 6) = change * (second(through, 1) - second(through, 0));
  r.segment<3>(walls + 9) =
    (through[1] - through[0]).normalized().cross(this->Inwards) / TangentDeviation;
  r.segment<3>(walls + 12) =
    (through[3] - through[2]).normalized().cross(this->Outwards) / TangentDeviation;
  // Points of a curve have no place along it of their own: even steps.
  const double even = 0.2 * this->SideRadius;
  const Vector3 sideSteps = steps(side);
  r[walls + 15] = (sideSteps[0] - sideSteps[1]) / even;
  r[walls + 16] = (sideSteps[2] - sideSteps[1]) / even;
  const Vector3 throughSteps = steps(through);
  r[walls + 17] = (throughSteps[0] - throughSteps[1]) / even;
  r[walls + 18] = (throughSteps[2] - throughSteps[1]) / even;
  r[walls + 19] = (radius - this->SideRadius) / (RadiusDeviation * this->SideRadius);
  r[walls + 20] = difference / (WallDeviation * this->Voxel);
  r[walls + 21] = (p[15] - Rounding) / RoundingDeviation;
  r[walls + 22] = (side[0] - this->Axes.through[this->Axes.fork])
                    .dot((this->Through[3] - this->Through[0]).normalized()) /
    (this->GivenFork * this->SideRadius);
  return r;
}

/// Levenberg and Marquardt's minimum near `p`, in radii.
/// @returns the normal matrix
Eigen::MatrixXd Fit::Minimize(
  const Eigen::VectorXd& scale, Eigen::VectorXd& p, Eigen::VectorXd& r) const
{
  r = this->Residuals(p);
  double cost = r.squaredNorm();
  double damping = 1e-3;
  Eigen::MatrixXd normal;
  for (int round = 0; round < 20; ++round)
  {
    Eigen::MatrixXd jacobian(r.size(), Count);
    constexpr double h = 1e-4;
    ParallelFor(Count, 1,
      [&](std::int64_t from, std::int64_t to)
      {
        for (std::int64_t k = from; k < to; ++k)
        {
          Eigen::VectorXd q = p;
          q[k] += h * scale[k];
          jacobian.col(k) = (this->Residuals(q) - r) / h;
        }
      });
    normal = jacobian.transpose() * jacobian;
    const Eigen::VectorXd gradient = jacobian.transpose() * r;
    double gain = 0.0;
    for (int attempt = 0; attempt < 6 && gain <= 0.0; ++attempt)
    {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() *= 1.0 + damping;
      Eigen::VectorXd step = -damped.ldlt().solve(gradient);
      // Not further at a time than the model is alike.
      step *= std::min(1.0, 0.4 / std::max(1e-12, step.cwiseAbs().maxCoeff()));
      Eigen::VectorXd q = p + step.cwiseProduct(scale);
      q[0] = std::clamp(q[0], 0.0, 1.0);
      const Eigen::VectorXd other = this->Residuals(q);
      gain = cost - other.squaredNorm();
      if (gain > 0.0)
      {
        p = q;
        r = other;
        cost -= gain;
        damping = std::max(1e-6, 0.1 * damping);
      }
      else
      {
        damping *= 10.0;
      }
    }
    if (gain < 1e-3 * cost)
    {
      break;
    }
  }
  return normal;
}

BifurcationFit Fit::Run(double minimumTurn)
{
  BifurcationFit result;
  if (!this->FindExtent())
  {
    return result;
  }
  const auto angle = [&](const Vector3& direction)
  { return UnitAngle(this->Inwards, direction.normalized()); };
  result.turn =
    angle(this->Axes.side[this->End] - this->Axes.side[this->Alone]) - angle(this->Outwards);
  if (result.turn < minimumTurn)
  {
    return result;
  }
  this->CollectWalls();
  if (this->Walls.size() < 5 * Count)
  {
    return result;
  }

  Eigen::VectorXd p(Count);
  const double length = (this->Through[3] - this->Through[0]).norm();
  p[0] = std::clamp(
    (this->Through[3] - this->Through[0]).dot(this->Side[0] - this->Through[0]) / (length * length),
    0.1, 0.9);
  p.segment<3>(1) = this->Side[1];
  p.segment<3>(4) = this->Side[2];
  p.segment<3>(7) = this->Through[1];
  p.segment<3>(10) = this->Through[2];
  p[13] = this->SideRadius;
  p[14] = 0.0;
  p[15] = Rounding;
  Eigen::VectorXd scale = Eigen::VectorXd::Constant(Count, this->SideRadius);
  scale[0] = this->SideRadius / length;
  scale[15] = 1.0;
  // A fork that was given far off may hold the axes in another minimum: first the wall alone.
  Eigen::VectorXd r;
  this->Minimize(scale, p, r);
  // It was found where the daughter's axis comes to the parent's: the more these are parallel the
  // farther along it an error across takes it.
  const Vector3 away = (this->Axes.side[this->End] - this->Axes.side[this->Alone]).normalized();
  const Vector3 flow = (this->Through[3] - this->Through[0]).normalized();
  this->GivenFork = ForkDeviation / flow.cross(away).norm();
  const Eigen::MatrixXd normal = this->Minimize(scale, p, r);

  this->Curves(p, result.through, result.side);
  result.first = this->First;
  result.last = this->Last;
  result.end = this->End;
  result.meeting = p[0];
  result.radius = this->FirstRadius + p[14];
  result.sideRadius = p[13];
  result.rounding = std::abs(p[15]);
  result.deviation = std::sqrt(normal.inverse()(0, 0)) * this->SideRadius;
  result.misfit = WallDeviation * r.head(static_cast<Eigen::Index>(this->Walls.size())).norm() /
    std::sqrt(static_cast<double>(this->Walls.size()));
  result.found = p.allFinite() && p[0] > 0.02 && p[0] < 0.98 && result.misfit < WallDeviation;
  return result;
}
}

Vector3 BezierPoint(const BezierCurve& curve, double t)
{
  const double u = 1.0 - t;
  return u * u * u * curve[0] + 3.0 * u * u * t * curve[1] + 3.0 * u * t * t * curve[2] +
    t * t * t * curve[3];
}

BifurcationFit FitBifurcation(const ImageInterpolator& image, const BifurcationAxes& axes,
  const LumenSettings& settings, double minimumTurn)
{
  return Fit(image, axes, settings).Run(minimumTurn);
}
}
