/**
 * @file AorticContrast.h
 * @brief Contrast medium in the aorta: in the sinus that an ostium opens into, up the ascending aorta, and away.
 */
#ifndef DynamicCoronary_AorticContrast_h
#define DynamicCoronary_AorticContrast_h

#include "WallMotion.h"

#include <vector>

namespace coronary
{
struct AorticFlowSettings
{
  double strokeVolume = 80.0; ///< mL a beat: at 75 beats 6 L/min, as a healthy adult has, 5 to 200
  double sinusVolume = 4.0;   ///< mL that are mixed about an ostium, 0.5 to 30, chosen
  double systolicExchange = 0.06;  ///< of the flow, between a sinus and the aorta, 0 to 1, chosen
  double diastolicExchange = 6.0;  ///< mL/s likewise without flow, 0 to 100, chosen
  double axialDiffusivity = 500.0; ///< mm^2/s of the eddies along the aorta, 0 to 1e5, chosen

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

/// mL/s out of the left ventricle: half a sine from `begin` to `end` (fractions of R-R), whose integral is the stroke volume.
double EjectedFlow(
  const AorticFlowSettings& settings, double begin, double end, double phase, double heartRate);

/// The aorta from its valve on, in slices of one length.
struct AorticSections
{
  static constexpr double Length = 5.0; ///< mm
  static constexpr int Count = 28;      ///< slices at most: what is further is away

  std::vector<Vector3>
    points; ///< mm, at rest, one more than slices; empty: there is no shape, only the standard size
  std::vector<double> radii; ///< mm, there
  /// mm along it of the mouths of the arteries' roots, in the order of the branches.
  std::vector<double> mouths;

  /// mL
  double Volume(std::size_t slice) const;
};

/// Of the aorta, each radius that of its wall's points there; without one a tube of 30 mm, ostia 15 mm above the valve.
AorticSections SectionsOfAorta(const WallTopology& topology);

/**
 * Slices and sinuses are mixed, each in itself. Medium enters neat and drives blood up the aorta. Backward Euler, upwind:
 * what is in it and what left are what came in, to round-off, and no concentration leaves 0 to 1.
 *
 * A slice of volume V in a flow Q washes out as exp(-Q t / V); of any bolus, Q is its volume over the integral of the
 * concentration that leaves (Stewart and Hamilton).
 */
class AorticContrast
{
public:
  /// @throws std::invalid_argument  as AorticFlowSettings::Validate; sections without a slice
  AorticContrast(AorticSections sections, const AorticFlowSettings& settings);

  /// What comes in during a step, mL of neat medium.
  struct Inflow
  {
    double spilled = 0.0; ///< out of an ostium
    std::size_t mouth = 0;
    double direct = 0.0; ///< out of a catheter's tip in the aorta
    double place = 0.0;  ///< mm along it from the valve
  };
  /// @param dt  s, above 0  @param flow  mL/s, at least 0
  void Step(double dt, double flow, const Inflow& inflow);

  bool Empty() const { return this->Inside == 0.0; }
  const AorticSections& Sections() const { return this->Sections_; }
  /// Fraction of medium, per slice.
  const std::vector<double>& Concentration() const { return this->Concentration_; }
  /// mL of medium, per sinus.
  const std::vector<double>& Sinuses() const { return this->Sinuses_; }
  double InAorta() const { return this->Inside; } ///< mL
  double Left() const { return this->Left_; }     ///< mL, beyond the last slice

private:
  std::size_t SliceAt(double place) const;

  AorticSections Sections_;
  AorticFlowSettings Settings;
  std::vector<double> Volume;   ///< mL, per slice
  std::vector<double> Exchange; ///< mL/s between a slice and the next one
  std::vector<double> Concentration_;
  std::vector<double> Sinuses_;
  // Of the step's equations, per slice.
  std::vector<double> Pivot;
  std::vector<double> Right;
  std::vector<double> Flow; ///< mL/s out of it
  double Inside = 0.0;
  double Left_ = 0.0;
};
}

#endif
