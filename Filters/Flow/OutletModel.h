/**
 * @file OutletModel.h
 * @brief What is before and behind a mesh for flow: inflow over the cycle, and a resistance, compliance, resistance at each
 *        outlet.
 *
 * The law of the simulator's network (CoronaryFlow), with the resistance of the meshed vessels left out, which is a few
 * mmHg of a hundred: all outlets then are one, in parallel.
 */
#ifndef DynamicCoronary_OutletModel_h
#define DynamicCoronary_OutletModel_h

#include "HeartPressures.h"

#include <vector>

namespace coronary
{
struct OutletModelSettings
{
  HeartPressures pressures;
  double venousPressure = 5.0;  ///< mmHg, below the diastolic one
  double meanFlow = 2.0;        ///< mL/s into the inlet, above 0
  double diastolicRatio = 1.95; ///< mean flow in diastole / in systole, 0.3 to 5
  double exponent = 2.27;       ///< outlets share the flow as their diameters to this power, 1 to 4
  double arterialShare =
    0.6;              ///< of an outlet's resistance that is before its compliance, 0.05 to 0.95
  double time = 0.4;  ///< time constant of an outlet, s, 0.02 to 5
  double cycle = 1.0; ///< s, above 0
  int harmonics = 8;  ///< of the series below, 1 to 40

  /// @throws std::invalid_argument naming the setting
  void Validate() const;
};

/// In SI units: m^3/s, Pa, Pa s/m^3, m^3/Pa.
struct OutletModel
{
  struct Outlet
  {
    double share = 0.0; ///< of the flow
    double proximal = 0.0;
    double distal = 0.0;
    double compliance = 0.0;
  };
  std::vector<Outlet> outlets; ///< as the diameters

  /// Series over the cycle: mean, then cosine and sine of each harmonic; time 0 is the R wave.
  std::vector<double> inflow;
  std::vector<double> musclePressure; ///< around the compliances
  double venousPressure = 0.0;
  double startPressure = 0.0;  ///< at the compliances, at time 0 of the periodic flow
  double muscleShare = 0.0;    ///< of the ventricle's pressure that squeezes
  double diastolicRatio = 0.0; ///< as it came out

  /// A series at a time, s.
  static double At(const std::vector<double>& series, double cycle, double time);
};

/// @param diameters  of the outlets, any unit, positive
/// @throws std::invalid_argument
OutletModel MakeOutletModel(
  const std::vector<double>& diameters, const OutletModelSettings& settings = {});
}

#endif
