#include "CArm.h"

#include "Numbers.h"
#include "Require.h"

#include <cmath>

namespace coronary
{
namespace
{
constexpr RequireOf RequireCArm{ "C-arm" };
}

bool CArmPose::operator==(const CArmPose& other) const
{
  return this->primary == other.primary && this->secondary == other.secondary &&
    this->sourceToDetector == other.sourceToDetector &&
    this->sourceToIsocentre == other.sourceToIsocentre && this->isocentre == other.isocentre;
}

bool DetectorFormat::operator==(const DetectorFormat& other) const
{
  return this->columns == other.columns && this->rows == other.rows && this->width == other.width &&
    this->height == other.height;
}

Vector3 BeamDirection(const CArmPose& pose)
{
  return { std::sin(pose.primary) * std::cos(pose.secondary),
    -std::cos(pose.primary) * std::cos(pose.secondary), std::sin(pose.secondary) };
}

std::string ViewName(const CArmPose& pose)
{
  const long primary = std::lround(pose.primary / Degree);
  const long secondary = std::lround(pose.secondary / Degree);
  std::string name =
    primary == 0 ? "AP" : (primary > 0 ? "LAO " : "RAO ") + std::to_string(std::abs(primary));
  if (secondary != 0)
  {
    name += (secondary > 0 ? " CRA " : " CAU ") + std::to_string(std::abs(secondary));
  }
  return name;
}

CArmGeometry::CArmGeometry(const CArmPose& pose, const DetectorFormat& format)
  : Pose_(pose)
  , Format_(format)
{
  // What is not finite fails every comparison.
  RequireCArm(std::abs(pose.primary) <= Pi, "primary angle", pose.primary, "within -pi to pi");
  RequireCArm(
    std::abs(pose.secondary) <= Pi / 2, "secondary angle", pose.secondary, "within -pi/2 to pi/2");
  RequireCArm(pose.sourceToIsocentre >= 100.0 && pose.sourceToIsocentre <= 5000.0,
    "source to isocentre", pose.sourceToIsocentre, "within 100 to 5000 mm");
  RequireCArm(pose.sourceToDetector > pose.sourceToIsocentre && pose.sourceToDetector <= 10000.0,
    "source to detector", pose.sourceToDetector,
    "more than source to isocentre, and at most 10000 mm");
  RequireCArm(pose.isocentre.norm() < 1e6, "isocentre", pose.isocentre.norm(), "near the patient");
  RequireCArm(
    format.columns >= 1 && format.columns <= 8192, "columns", format.columns, "1 to 8192");
  RequireCArm(format.rows >= 1 && format.rows <= 8192, "rows", format.rows, "1 to 8192");
  RequireCArm(format.width > 0.0 && format.width <= 2000.0, "width", format.width, "up to 2000 mm");
  RequireCArm(
    format.height > 0.0 && format.height <= 2000.0, "height", format.height, "up to 2000 mm");

  const double sinA = std::sin(pose.primary);
  const double cosA = std::cos(pose.primary);
  const double sinB = std::sin(pose.secondary);
  // The arm's tilt towards the head happens in its own plane, which the primary angle has turned.
  this->Forward = BeamDirection(pose);
  this->Right = Vector3(cosA, sinA, 0.0);
  this->Down = Vector3(sinA * sinB, -cosA * sinB, -std::cos(pose.secondary));
  this->Source_ = pose.isocentre - pose.sourceToIsocentre * this->Forward;
  this->DetectorCentre_ = this->Source_ + pose.sourceToDetector * this->Forward;
  this->ColumnSpacing = format.width / format.columns;
  this->RowSpacing = format.height / format.rows;
}

Vector3 CArmGeometry::PixelPosition(double column, double row) const
{
  const double across = (column - 0.5 * (this->Format_.columns - 1)) * this->ColumnSpacing;
  const double down = (row - 0.5 * (this->Format_.rows - 1)) * this->RowSpacing;
  return this->DetectorCentre_ + across * this->Right + down * this->Down;
}

Vector3 CArmGeometry::Project(const Vector3& point) const
{
  const Vector3 from = point - this->Source_;
  const double depth = from.dot(this->Forward);
  const double scale = this->Pose_.sourceToDetector / depth;
  if (!(depth > 0.0))
  {
    return { NAN, NAN, depth };
  }
  return { from.dot(this->Right) * scale / this->ColumnSpacing + 0.5 * (this->Format_.columns - 1),
    from.dot(this->Down) * scale / this->RowSpacing + 0.5 * (this->Format_.rows - 1), depth };
}
}
