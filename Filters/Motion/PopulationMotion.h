/**
 * @file PopulationMotion.h
 * @brief The motion of a mean population put on the coronary tree of one patient, for scans with one phase or few.
 *
 * A field over the heart's own coordinates: the atrioventricular plane goes down along the long axis, more on the right
 * than on the left and less at the aortic root, walls go inwards, base and apex turn against each other. Its
 * amplitudes and its times have means and standard deviations from the literature (PopulationParameters()). What one phase
 * cannot know of a patient is told with every point as a standard deviation. Further phases that were tracked bend the
 * motion to what was seen. docs/motion.md has the equations.
 */
#ifndef DynamicCoronary_PopulationMotion_h
#define DynamicCoronary_PopulationMotion_h

#include "ParallelFor.h"
#include "PatientHeart.h"
#include "Polylines.h"
#include "PoseSequence.h"

#include <array>
#include <string>
#include <vector>

namespace coronary
{
/// One number in which hearts differ.
struct PopulationParameter
{
  const char* name;
  double mean;
  double deviation; ///< one standard deviation over adults
  const char* unit;
  const char* source;
};

constexpr int NumberOfPopulationParameters = 14;
using PopulationVector = Eigen::Matrix<double, NumberOfPopulationParameters, 1>;
using PopulationMatrix =
  Eigen::Matrix<double, NumberOfPopulationParameters, NumberOfPopulationParameters>;

const std::array<PopulationParameter, NumberOfPopulationParameters>& PopulationParameters();

struct PopulationMotionSettings
{
  double heartRate = 75.0; ///< beats a minute, 30 to 180
  double amplitude = 1.0;  ///< factor on the mean of all amplitudes, 0 (at rest) to 2

  /// @throws std::invalid_argument naming the setting
  void Validate() const;
};

/// How far the heart has contracted at a moment: 0 at end diastole, 1 at end systole, with clocks of its own for each part.
struct PopulationClocks
{
  double right = 0.0;      ///< of the tricuspid side of the groove
  double left = 0.0;       ///< of the mitral side and the aortic root
  double ventricles = 0.0; ///< of thickening and twist
};

/// @param time  fraction of the R-R interval, taken modulo 1  @param heartRate  as in the settings
PopulationClocks PopulationClocksAt(double time, double heartRate, const PopulationVector& values);

/**
 * Displacement from the place at end diastole.
 * @param position  at end diastole, mm
 * @param values    of the parameters
 * @return mm
 */
Vector3 PopulationDisplacement(const PatientHeart& heart, const Vector3& position,
  const PopulationClocks& clocks, const PopulationVector& values);

struct PopulationMotionReport
{
  int phases =
    1; ///< of the patient that carry the motion: the tree's own, and those that were tracked

  ///@{
  /// Of the parameters, after the phases that were tracked.
  PopulationVector mean = PopulationVector::Zero();
  PopulationVector deviation = PopulationVector::Zero();
  ///@}

  /// Root mean square distance at the tracked phases before they were met, mm: of the population's mean motion, and of
  /// the motion bent to them; NaN without tracked phases.
  double populationMisfit = 0.0;
  double bentMisfit = 0.0;

  std::vector<std::vector<double>>
    deviations; ///< mm, per phase and point: one standard deviation of the distance
  std::vector<std::string> warnings; ///< one sentence each
};

/// `count` even moments from 0 to 1 (excluded), the reference and those of `seen` that count among them, in the place of what
/// is nearer than 0.4 / count. Increasing.
std::vector<double> PopulationTimes(
  double referenceTime, const std::vector<double>& seen, int count = 20);

/**
 * @param lines          at the reference phase
 * @param heart          from the same lines
 * @param referenceTime  of the lines, fraction of R-R
 * @param times          of the result, strictly increasing
 * @param seen           null, or the same points at phases in which they were tracked; what lies within 0.02 R-R of the
 *                       reference or of an earlier phase counts for nothing more
 * @return positions at `times`, exactly the lines' own at the reference (modulo 1), exactly the tracked ones at theirs.
 * Confidence 1 at the reference, the tracker's own at tracked phases; else 0.5 / (1 + (deviation / 2 mm)^2), with the
 * status Filled
 * @throws std::invalid_argument naming a setting or what is wrong with the lines, times or poses; Cancelled
 */
PoseSequence MoveByPopulation(const Polylines& lines, const PatientHeart& heart,
  double referenceTime, const std::vector<double>& times, const PoseSequence* seen = nullptr,
  const PopulationMotionSettings& settings = {}, PopulationMotionReport* report = nullptr,
  const ProgressCallback& progress = {});

/// What every product has to say of such a motion: "motion not of this patient: ...", one line.
std::string PopulationMotionStatement(int phases, double heartRate, double amplitude);
}

#endif
