/**
 * @file FoamCase.h
 * @brief A case folder of OpenFOAM (ESI's, 1912 and later) for blood flow in a mesh whose walls may move.
 */
#ifndef DynamicCoronary_FoamCase_h
#define DynamicCoronary_FoamCase_h

#include <string>
#include <utility>
#include <vector>

namespace coronary
{
/// An end that blood leaves by: a resistance, then a compliance against the squeezing muscle, then a resistance.
struct FoamOutlet
{
  std::string patch;
  double proximal = 0.0;   ///< Pa s/m^3
  double distal = 0.0;     ///< Pa s/m^3
  double compliance = 0.0; ///< m^3/Pa; 0: both resistances in a row
};

enum class BloodModel
{
  Newtonian = 0,
  Carreau = 1 ///< 56 to 3.45 mPa s, 3.313 s, n 0.3568
};

struct FoamCase
{
  std::string title;
  std::string wall = "wall";
  std::string inlet = "inlet";
  std::vector<FoamOutlet> outlets;

  double cycle = 1.0;  ///< s
  double cycles = 1.0; ///< at least 1, in whole pictures; what is before the last one is start-up
  int stepsPerCycle = 1000;
  int picturesPerCycle = 20; ///< time directories
  bool steady = false;       ///< simpleFoam, with the mean inflow
  bool moving = false;       ///< by constant/boundaryData

  BloodModel blood = BloodModel::Newtonian;
  double density = 1060.0;   ///< kg/m^3
  double viscosity = 3.5e-3; ///< Pa s, Newtonian

  /// Into the inlet, beyond what the inlet's own motion sweeps: mean, then cosine and sine of each harmonic, m^3/s.
  std::vector<double> inflow;
  double venousPressure = 0.0; ///< Pa, behind the distal resistance
  /// Of the pressure in the muscle around the compliances: mean, then cosine and sine of each harmonic, Pa.
  std::vector<double> musclePressure;
  double startPressure = 0.0; ///< Pa, of the compliances and everywhere at first

  /// @throws std::invalid_argument that says what is wrong
  void Validate() const;
};

/// Names in the case folder and contents of all files but the mesh and the motion.
std::vector<std::pair<std::string, std::string>> FoamCaseFiles(const FoamCase& flow);
}

#endif
