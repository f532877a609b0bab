/**
 * @file PhaseInterpolation.h
 * @brief Any moment of the cycle out of a few: linear, periodic spline, or few modes and harmonics.
 *
 * PhaseInterpolation.cxx has the equations (Eq. 8, 10 and 11 of the paper).
 */
#ifndef DynamicCoronary_PhaseInterpolation_h
#define DynamicCoronary_PhaseInterpolation_h

#include "Geometry.h"
#include "ParallelFor.h"
#include "PoseSequence.h"

#include <cstddef>
#include <vector>

namespace coronary
{
enum class PhaseInterpolationMode : int
{
  Linear = 0,        ///< between the two phases around (Eq. 8); velocity jumps at the phases
  PeriodicCubic = 1, ///< through all phases; position, velocity and acceleration are continuous
  LowNoise = 2 ///< least squares: few spatial modes, each a Fourier series; not through the phases
};

struct PhaseInterpolationSettings
{
  PhaseInterpolationMode mode = PhaseInterpolationMode::PeriodicCubic;
  /// Phases that are nearer to each other than this, modulo one cycle, are repetitions of one, which
  /// gets their mean weighted by confidence. Fraction of the R-R interval, 0 (only equal ones) to 0.1.
  double mergeTolerance = 0.01;
  int maximumRank = 6;  ///< of LowNoise: most spatial modes that are tried, 1 to 20
  int maximumOrder = 8; ///< of LowNoise: most harmonics that are tried, 1 to 20
  /// Of LowNoise: below it a sample counts for nothing; 0 to 1. Others count by their confidence.
  double minimumConfidence = 0.05;

  /// @throws std::invalid_argument that names the first setting out of range
  void Validate() const;
};

/// All that is known of one moment. What the sequence does not have is empty.
struct InterpolatedPose
{
  std::vector<Vector3> points;              ///< mm
  std::vector<Vector3> velocity;            ///< mm per cycle
  std::vector<double> confidence;           ///< linear in time
  std::vector<TrackingStatus> status;       ///< of the nearest phase
  std::vector<double> calibre;              ///< factor of the radius; its logarithm is interpolated
  std::vector<double> calibreRate;          ///< per cycle
  std::vector<Eigen::Quaterniond> rotation; ///< unit
  std::vector<Vector3> angularVelocity;     ///< radians per cycle, about axes of the world
};

/// What a LowNoise fit is made of.
struct LowNoiseFit
{
  int rank = 0;           ///< spatial modes
  int order = 0;          ///< harmonics
  double ridge = 0.0;     ///< against the harmonic m: (m^4 - 1) times this
  double predicted = 0.0; ///< mm, root mean square error of phases that were left out
  double residual = 0.0;  ///< mm, root mean square distance to the phases
  int iterations = 0;     ///< of the weighted fit; 0 when all confidences are equal
};

/**
 * Time t is the fraction of the R-R interval; any real number is taken modulo 1.
 *
 * Immutable after construction, and safe to use from several threads. The same input gives the same
 * bits on any number of threads.
 */
class PhaseInterpolation
{
public:
  /**
   * @throws std::invalid_argument as CheckPoseSequence and PhaseInterpolationSettings::Validate, or
   * when there are fewer than two different phases
   * @throws Cancelled
   */
  PhaseInterpolation(const PoseSequence& sequence, const PhaseInterpolationSettings& settings = {},
    const ProgressCallback& progress = {});

  /// Allocates nothing once `pose` has been used before.
  /// @throws std::invalid_argument for a time that is not finite
  void Evaluate(double time, InterpolatedPose& pose) const;

  /// Distinct phases in 0 .. 1 after merging, ascending.
  const std::vector<double>& Knots() const { return this->Knots_; }

  /// Root mean square distance between repetitions and their mean, mm per point; 0: none.
  double Repeatability() const { return this->Repeatability_; }

  /// Of the mode LowNoise.
  const LowNoiseFit& Fit() const { return this->Fit_; }

  /// The index in the sequence of the phase that is nearest to a moment modulo one cycle.
  std::size_t NearestPhase(double time) const;

private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  void Merge(const PoseSequence& sequence);
  void GroupPhases(const PoseSequence& sequence);
  double Share(
    const PoseSequence& sequence, Eigen::Index k, Eigen::Index point, std::size_t phase) const;
  void MergePositions(const PoseSequence& sequence);
  void MergeStatus(const PoseSequence& sequence);
  void MergeRotations(const PoseSequence& sequence);

  PhaseInterpolationSettings Settings;
  std::vector<double> Times; ///< of the sequence, modulo 1
  std::vector<double> Knots_;
  std::vector<std::vector<std::size_t>> Members; ///< per knot: phases of the sequence
  double Repeatability_ = 0.0;
  LowNoiseFit Fit_;

  // A row a knot.
  Rows Points; ///< x y z after each other
  Rows Confidence;
  Rows LogCalibre;
  Rows Tangents; ///< of the rotations: rotation vectors against their mean
  std::vector<std::vector<TrackingStatus>> Status;
  std::vector<Eigen::Quaterniond> MeanRotation;
  // PeriodicCubic: second derivatives. LowNoise: coefficients of 1, cos, sin, cos 2 ...
  Rows PointsMore;
  Rows LogCalibreMore;
  Rows TangentsMore;
};

/// Cross-section at one place and moment.
struct EllipseSection
{
  double major = 0.0;      ///< semi-axis, mm
  double minor = 0.0;      ///< semi-axis, mm
  double areaStrain = 0.0; ///< eps_r of Eq. 11
  bool clamped = false;
};

/**
 * pi a b = A0 (1 + eps_r), Eq. 10 and 11, with |eps_r| limited.
 * @param radius   of the round cross-section of area A0, mm
 * @param calibre  wanted factor of the radius, > 0
 * @param axisRatio  minor / major, 0 (excluded) to 1
 * @param strainLimit  0 to 1 (excluded)
 */
EllipseSection CrossSection(double radius, double calibre, double axisRatio, double strainLimit);
}

#endif
