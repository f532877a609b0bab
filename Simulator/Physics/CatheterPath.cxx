#include "CatheterPath.h"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double Drawn = 250.0; // mm behind the way that can be drawn
constexpr double TangentLength =
  3.0; // mm over which the direction of the vessel at its ostium is measured

Vector3 AnyAcross(const Vector3& direction)
{
  const Vector3 other = std::abs(direction.z()) < 0.9 ? Vector3::UnitZ() : Vector3::UnitY();
  return (other - direction * direction.dot(other)).normalized();
}

/// The point of a polyline at a length from its beginning.
Vector3 AlongLine(const std::vector<Vector3>& line, double length)
{
  for (std::size_t i = 1; i < line.size(); ++i)
  {
    const double step = (line[i] - line[i - 1]).norm();
    if (length <= step && step > 0.0)
    {
      return line[i - 1] + (length / step) * (line[i] - line[i - 1]);
    }
    length -= step;
  }
  return line.back();
}
}

Vector3 DirectionAtOstium(const std::vector<Vector3>& axis)
{
  return (AlongLine(axis, TangentLength) - axis.front()).normalized();
}

CatheterPath::CatheterPath(const std::vector<Vector3>& axis, const GuideCatheter& catheter,
  double engagement, double behind, double ahead)
{
  double length = 0.0;
  for (std::size_t i = 1; i < axis.size(); ++i)
  {
    length += (axis[i] - axis[i - 1]).norm();
  }
  if (axis.size() < 2 || !(length > this->Spacing) || !std::isfinite(length))
  {
    throw std::invalid_argument("the axis of the vessel at the catheter has no length");
  }
  this->Behind = static_cast<int>(std::ceil(behind / this->Spacing));
  this->Begin = -this->Spacing * this->Behind;
  const int inside =
    std::max(1, static_cast<int>(std::floor(std::min(ahead, length) / this->Spacing)));
  this->RestTangent = DirectionAtOstium(axis);
  // A catheter comes down from the aortic arch: backwards it bends to where the head is.
  const Vector3 head = Vector3::UnitZ();
  const Vector3 up = head - this->RestTangent * this->RestTangent.dot(head);
  this->RestSide = up.norm() > 0.1 ? Vector3(up.normalized()) : AnyAcross(this->RestTangent);

  Vector3 place = Vector3::Zero();
  Vector3 way = -this->RestTangent;
  Vector3 side = this->RestSide;
  const double step = 0.01;
  double travelled = 0.0;
  const int drawn = this->Behind + static_cast<int>(Drawn / this->Spacing);
  this->Local.reserve(this->Behind);
  for (int i = 1; i <= drawn; ++i)
  {
    const double wanted = i * this->Spacing;
    while (travelled < wanted - 0.5 * step)
    {
      // Where the shape's own beginning, its tip, lies inside of the vessel the axis decides.
      double from = engagement + travelled;
      double curvature = 0.0;
      double plane = 0.0;
      for (const CatheterArc& arc : catheter.shape)
      {
        if (from < arc.length)
        {
          curvature = arc.curvature;
          plane = arc.planeAngle;
          break;
        }
        from -= arc.length;
      }
      const Vector3 across =
        Eigen::AngleAxisd(plane, this->RestTangent) * side; // the plane of this arc
      const Vector3 toward = (across - way * way.dot(across)).normalized();
      const Eigen::AngleAxisd bend(curvature * step, way.cross(toward).normalized());
      place += 0.5 * step * way;
      way = (bend * way).normalized();
      side = bend * side;
      place += 0.5 * step * way;
      travelled += step;
    }
    (i <= this->Behind ? this->Local : this->Further).push_back(place);
  }
  this->Now.resize(this->Behind + 1 + inside);
  this->Shape(axis, this->Now);
  this->Current = this->Now;
  this->Next = this->Now;
  this->Frames();
  const Matrix3 frame = this->FirstFrame();
  for (Vector3& point : this->Further)
  {
    point = frame.transpose() * (axis.front() + point - this->Now.front());
  }
}

/// Axes of the place that is furthest behind, as columns.
Matrix3 CatheterPath::FirstFrame() const
{
  Matrix3 frame;
  frame << this->Tangents.front(), this->Sides.front(),
    this->Tangents.front().cross(this->Sides.front());
  return frame;
}

void CatheterPath::Shape(const std::vector<Vector3>& axis, std::vector<Vector3>& points) const
{
  points.resize(this->Now.size());
  const Eigen::Quaterniond turn =
    Eigen::Quaterniond::FromTwoVectors(this->RestTangent, DirectionAtOstium(axis)) *
    Eigen::AngleAxisd(this->Angle, this->RestTangent);
  for (int i = 0; i < this->Behind; ++i)
  {
    points[this->Behind - 1 - i] = axis.front() + turn * this->Local[i];
  }
  for (std::size_t i = this->Behind; i < points.size(); ++i)
  {
    points[i] = AlongLine(axis, this->Spacing * static_cast<double>(i - this->Behind));
  }
}

void CatheterPath::Frames()
{
  this->MakeTangents(this->RestTangent);
  // Parallel transport from the ostium, behind which the catheter's shape is rigid.
  const auto ostium = static_cast<std::size_t>(this->Behind);
  const Eigen::Quaterniond turn =
    Eigen::Quaterniond::FromTwoVectors(this->RestTangent, this->Tangents[ostium]);
  this->CarrySides(ostium, turn * this->RestSide);
}

void CatheterPath::BeginFrame(const std::vector<Vector3>& axis, double seconds)
{
  this->Current.swap(this->Next);
  this->Shape(axis, this->Next);
  this->Seconds = seconds;
  this->SetTime(0.0);
}

void CatheterPath::SetTime(double seconds)
{
  const double share = std::clamp(seconds / this->Seconds, 0.0, 1.0);
  for (std::size_t i = 0; i < this->Now.size(); ++i)
  {
    this->Now[i] = this->Current[i] + share * (this->Next[i] - this->Current[i]);
  }
  this->Frames();
}

Vector3 CatheterPath::VelocityAt(std::size_t i, double share) const
{
  return ((1.0 - share) * (this->Next[i] - this->Current[i]) +
           share * (this->Next[i + 1] - this->Current[i + 1])) /
    this->Seconds;
}

void CatheterPath::Line(double u, double length, std::vector<Vector3>& line) const
{
  line.clear();
  line.push_back(this->At(u).position);
  const int from = std::min(static_cast<int>(std::ceil(u / this->Spacing)) - 1 + this->Behind,
    static_cast<int>(this->Now.size()) - 1);
  const double whole = length / this->Spacing;
  for (int i = from; i >= 0 && static_cast<double>(line.size()) < whole; --i)
  {
    line.push_back(this->Now[i]);
  }
  // It is drawn coarsely where it only hangs in the aorta.
  constexpr std::size_t Step = 8;
  const Matrix3 frame = this->FirstFrame();
  std::size_t points = line.size();
  for (std::size_t i = Step - 1;
       i < this->Further.size() && static_cast<double>(points += Step) < whole; i += Step)
  {
    line.emplace_back(this->Now.front() + frame * this->Further[i]);
  }
}
}
