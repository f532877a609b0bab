/**
 * @file CArm.h
 * @brief Where X-rays start and where they are detected: the cone beam of a C-arm.
 *
 * World coordinates are LPS, mm. Angles as in DICOM (PS3.3 C.8.7.5, positioner angles): primary in the transaxial
 * plane, LAO positive; secondary in the sagittal plane, cranial positive. At 0, 0 the detector is in front of the
 * patient's chest and the source behind the back.
 */
#ifndef DynamicCoronary_CArm_h
#define DynamicCoronary_CArm_h

#include "Geometry.h"

#include <string>

namespace coronary
{
struct CArmPose
{
  double primary = 0.0;             ///< radians, -pi to pi: LAO positive, RAO negative
  double secondary = 0.0;           ///< radians, -pi/2 to pi/2: cranial positive, caudal negative
  double sourceToDetector = 1100.0; ///< mm (SID)
  double sourceToIsocentre = 780.0; ///< mm (SOD)
  Vector3 isocentre{
    Vector3::Zero()
  }; ///< where in the patient the isocentre is: moving the table moves it, mm

  bool operator==(const CArmPose& other) const;
  bool operator!=(const CArmPose& other) const { return !(*this == other); }
};

/// From the source towards the detector, unit.
Vector3 BeamDirection(const CArmPose& pose);

/// As it is called in a laboratory, in whole degrees: "AP", "RAO 30 CRA 20".
std::string ViewName(const CArmPose& pose);

struct DetectorFormat
{
  int columns = 512;
  int rows = 512;
  double width = 200.0;  ///< mm, of all columns together, on the detector
  double height = 200.0; ///< mm

  bool operator==(const DetectorFormat& other) const;
  bool operator!=(const DetectorFormat& other) const { return !(*this == other); }
};

/// Lines from the source to the pixels. Pixel (0, 0) is at the top left; looked at as if facing the patient, the
/// patient's head is up, and in a frontal view the patient's left side is on the right.
class CArmGeometry
{
public:
  /// @throws std::invalid_argument naming the value that is not possible
  CArmGeometry(const CArmPose& pose, const DetectorFormat& format);

  const CArmPose& Pose() const { return this->Pose_; }
  const DetectorFormat& Format() const { return this->Format_; }

  const Vector3& Source() const { return this->Source_; }                 ///< mm
  const Vector3& DetectorCentre() const { return this->DetectorCentre_; } ///< mm
  const Vector3& TowardsDetector() const { return this->Forward; }        ///< unit, from the source
  const Vector3& ColumnDirection() const { return this->Right; } ///< unit, to the next column
  const Vector3& RowDirection() const { return this->Down; }     ///< unit, to the next row

  /// Centre of a pixel; fractions are between centres.
  Vector3 PixelPosition(double column, double row) const;

  /// Column, row (centres of pixels are whole) and depth: mm from the source along TowardsDetector(). A point that is
  /// not in front of the source (depth <= 0) has no finite column and row.
  Vector3 Project(const Vector3& point) const;

  double Magnification(double depth) const { return this->Pose_.sourceToDetector / depth; }

private:
  CArmPose Pose_;
  DetectorFormat Format_;
  Vector3 Source_;
  Vector3 DetectorCentre_;
  Vector3 Forward;
  Vector3 Right;
  Vector3 Down;
  double ColumnSpacing;
  double RowSpacing;
};
}

#endif
