/**
 * @file ContractionMotion.h
 * @brief A beating heart by formula, for vessels whose motion is not known.
 *
 * docs/simulator-files.md has the equations. It is a plausible motion and nobody's heart: the base comes down towards
 * the apex, everything comes nearer to the long axis, and the base turns against the apex.
 */
#ifndef DynamicCoronary_ContractionMotion_h
#define DynamicCoronary_ContractionMotion_h

#include "WallMotion.h"

#include <memory>

namespace coronary
{
struct ContractionSettings
{
  double axial = 12.0;   ///< mm that the base comes down towards the apex, 0 to 25
  double radial = 0.12;  ///< share by which distances to the long axis shrink, 0 to 0.3
  double twist = 0.10;   ///< radians that the base turns, seen from the apex clockwise, -0.5 to 0.5
  double systole = 0.35; ///< fraction of R-R at which the contraction is greatest, 0.2 to 0.5
  double peakSpeed = 108.6; ///< mm/s: all three are scaled down until no point is faster, 1 to 300
  double cycleLength = 0.8; ///< s, for peakSpeed, 0.25 to 3
  /// mm, world; both or, if they are equal, neither: base = mean of the roots, apex = the axis' point that is
  /// furthest from it.
  Vector3 base = Vector3::Zero();
  Vector3 apex = Vector3::Zero();

  /// @throws std::invalid_argument naming the setting
  void Validate() const;
};

/// Share of the contraction at a phase, 0 (end of diastole) to 1; periodic, two continuous derivatives.
double ContractionCurve(double phase, double systole);

/// Moves what another motion gives at phase 0.
class ContractionMotion : public WallMotion
{
public:
  /// @throws std::invalid_argument: as Validate; vessels without axis, or whose base and apex are less than 20 mm apart
  ContractionMotion(std::shared_ptr<WallMotion> rest, const ContractionSettings& settings);

  const WallTopology& Topology() const override { return this->Rest->Topology(); }
  void Positions(double phase, std::vector<Vector3>& positions) override;
  void AxisPositions(double phase, std::vector<Vector3>& positions) override;

  /// With amplitudes as they were scaled.
  const ContractionSettings& Settings() const { return this->Used; }
  double PeakSpeed() const { return this->Peak; } ///< mm/s of any point at the settings' cycle

private:
  struct Place
  {
    double height;  ///< mm from the base along the long axis
    Vector3 across; ///< mm from the long axis
  };

  std::vector<Place> PlacesOf(const std::vector<Vector3>& points) const;
  void Move(const std::vector<Place>& places, double phase, std::vector<Vector3>& positions) const;
  double MaximumSpeed() const;

  std::shared_ptr<WallMotion> Rest;
  ContractionSettings Used;
  Vector3 Axis;        ///< unit, from base to apex
  double Height = 0.0; ///< mm from base to apex
  std::vector<Place> Wall;
  std::vector<Place> Line;
  double Peak = 0.0;
};
}

#endif
