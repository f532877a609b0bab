/**
 * @file PoseSequence.h
 * @brief Lines that move: a tree or a skeleton (Polylines at rest) at several moments of the heart's cycle.
 */
#ifndef DynamicCoronary_PoseSequence_h
#define DynamicCoronary_PoseSequence_h

#include "Geometry.h"
#include "Polylines.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// What is known of a node at one phase.
enum class TrackingStatus : int
{
  Tracked = 0, ///< seen in the image
  Weak = 1,    ///< seen badly: the neighbours in space and time count more
  Lost = 2,    ///< not seen, and too far from what was seen to be filled well
  Filled = 3,  ///< not seen; from its neighbours in space and time
};

inline bool IsUnseen(TrackingStatus status)
{
  return status == TrackingStatus::Filled || status == TrackingStatus::Lost;
}

/// Positions of the same points at several phases. What is optional may be empty.
struct PoseSequence
{
  std::vector<double> times;                ///< fractions of the R-R interval, strictly increasing
  std::vector<std::vector<Vector3>> points; ///< per phase: as many as at rest, mm
  std::vector<std::vector<double>> confidence;     ///< optional, per phase and point: 0 to 1
  std::vector<std::vector<TrackingStatus>> status; ///< optional, per phase and point
  std::vector<std::vector<double>> calibre; ///< optional, per phase and point: factor of the radius
  /// Optional, per phase and bone: its rotation from rest at its first joint.
  std::vector<std::vector<Eigen::Quaterniond>> rotation;

  std::size_t NumberOfPhases() const { return this->times.size(); }
};

/**
 * @throws std::invalid_argument that says what is wrong: no phase, times that do not increase strictly, a
 * member of another size, a value that is not finite, a confidence outside 0 .. 1, a calibre that is
 * not positive, a rotation that is zero.
 */
void CheckPoseSequence(const PoseSequence& sequence, std::size_t points);
}

#endif
