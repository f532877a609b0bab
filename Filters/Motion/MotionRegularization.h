/**
 * @file MotionRegularization.h
 * @brief Motion of a vessel tree that is smooth in time and along the vessels, and within limits.
 *
 * Eq. 9 to 14 of the paper; docs/motion.md has what is minimised. Limits are kept by the alternating
 * direction method of multipliers (Boyd et al., Found Trends Mach Learn 2011;3:1).
 */
#ifndef DynamicCoronary_MotionRegularization_h
#define DynamicCoronary_MotionRegularization_h

#include "Geometry.h"
#include "ParallelFor.h"
#include "PoseSequence.h"

#include <array>
#include <cstdint>
#include <vector>

namespace coronary
{
/// What is meant by smooth.
enum class MotionEnergy : int
{
  /// The acceleration, and the bending of the displacement from rest along the vessels: smooth motion and
  /// curved vessels cost (nearly) nothing.
  Displacement = 0,
  /// Eq. 14 as it stands: the distance between successive phases, and the bending of the vessels
  /// themselves. Shrinks the motion and straightens vessels.
  Position = 1
};

struct MotionRegularizationSettings
{
  MotionEnergy energy = MotionEnergy::Displacement;
  double temporalWeight = 0.005; ///< omega_1, 0 or more, against 1 for a sample of confidence 1
  double spatialWeight = 0.1;    ///< omega_2, 0 or more
  double velocityWeight =
    0.02; ///< 1 / lambda of Eq. 13: smoothing of the velocity along vessels, 0 or more

  // Limits.
  double maximumBending = 1.0471975511965976; ///< between segments, radians, 0.01 to pi (no limit)
  double minimumCurvatureRadius = 1.0;        ///< mm, 0 (no limit) or more
  double maximumStrain = 0.25; ///< |length / rest length - 1|, 0.001 to 0.9; infinite: no limit
  double maximumStep = 15.0; ///< delta: of a point between two phases, mm, > 0; infinite: no limit

  double wellTracked = 0.8; ///< from this confidence on a point is moved by no more than ...
  double tolerance = 0.3;   ///< mm, 0 or more

  /// Places of a phase that are noisy (NoiseOfPhases) weigh less, are smoothed along the vessels as the noise asks for, and
  /// may be moved by three of its deviations more. Not with MotionEnergy::Position.
  bool measureNoise = true;

  /// Elastic modulus of Eq. 12, MPa.
  double youngsModulus = 1.55;

  int iterations = 400;     ///< of the limits at most, 1 or more
  double precision = 0.002; ///< mm: to which the limits are kept, 1e-6 to 1

  /// @throws std::invalid_argument that names the first setting out of range
  void Validate() const;
};

/// The default temporal weight, as at 20 phases, for so many. Acceleration is measured in distances of phases: what few of
/// them show of a fast motion would be taken for noise.
double TemporalWeightOf(std::size_t phases);

/// Bits of what a point was held back by, at one phase.
enum MotionClamp : int
{
  ClampBending = 1,
  ClampCurvature = 2,
  ClampStrain = 4,
  ClampStep = 8,
  ClampTolerance = 16
};

/// Sums over points and phases, mm^2. Phases follow each other modulo one cycle.
struct MotionEnergies
{
  double temporal = 0.0; ///< E_temp: |P_t - P_(t-1)|^2
  double spatial = 0.0;  ///< E_spatial: |Laplacian of P_t|^2, Eq. 14
  double total = 0.0;    ///< omega_1 E_temp + omega_2 E_spatial
  /// What is minimised: weighted distance to the input + weights * energies of the chosen kind.
  double objective = 0.0;
};

struct RegularizedMotion
{
  PoseSequence poses; ///< the input's, with other points, and rotations of bones that follow them
  std::vector<std::vector<int>> clamps;    ///< per phase and point: bits of MotionClamp
  std::vector<std::vector<double>> strain; ///< per phase and line: length / rest length - 1
  std::vector<std::vector<double>> stress; ///< MPa, per phase and line, Eq. 12
  MotionEnergies before;
  MotionEnergies after;
  std::array<std::int64_t, 5> clamped{}; ///< points and phases per bit of MotionClamp
  /// Segments, corners and steps that are still beyond a limit by more than the precision allows: the
  /// tolerance of well-tracked points stands against it.
  std::int64_t violations = 0;
  int iterations = 0;        ///< 0: no limit was touched
  double maximumMove = 0.0;  ///< mm
  std::vector<double> noise; ///< per phase, mm; 0 where it is not measured
};

/**
 * @param sequence  samples weigh the square of their confidence; without it all weigh 1 and none counts as well
 * tracked
 * @param lines     at rest: what strain is relative to. A corner that is beyond a limit at rest may be a tenth
 * sharper than there.
 * @throws std::invalid_argument: as the Check functions of PoseSequence.h and Validate; less than two
 * phases; a segment without length at rest
 * @throws Cancelled
 *
 * Ends when all limits are kept to the precision and no point moves by more than it in an iteration, or
 * after the given number of iterations, or when limits that stand against each other come no nearer:
 * `violations` says what is left then.
 *
 * The same input gives the same bits on any number of threads.
 */
RegularizedMotion RegularizeMotion(const PoseSequence& sequence, const Polylines& lines,
  const MotionRegularizationSettings& settings = {}, const ProgressCallback& progress = {});

/// Eq. 14 and what is minimised, for a motion `sequence` around the data `data`.
MotionEnergies EnergiesOf(const PoseSequence& sequence, const PoseSequence& data,
  const Polylines& lines, const MotionRegularizationSettings& settings);
}

#endif
