/**
 * @file SessionMetrics.h
 * @brief What distinguishes trainees.
 */
#ifndef DynamicCoronary_SessionMetrics_h
#define DynamicCoronary_SessionMetrics_h

#include "LesionWatch.h"

#include <cstdint>
#include <vector>

namespace coronary
{
struct SessionMetrics
{
  double procedureSeconds = 0.0;
  double fluoroscopySeconds = 0.0; ///< pedal down, cine included
  double cineSeconds = 0.0;
  std::int64_t frames = 0;       ///< exposed
  double airKerma = 0.0;         ///< mGy at the reference point
  double doseAreaProduct = 0.0;  ///< Gy cm^2
  double contrast = 0.0;         ///< mL of contrast medium
  double maximumWallForce = 0.0; ///< N of one contact
  double maximumTipForce = 0.0;  ///< N
  double forcefulSeconds = 0.0;  ///< tip force above ForcefulTip
  double wireTravel = 0.0;       ///< mm, forth and back together
  double blindTravel = 0.0;      ///< mm of it with the tip beyond the catheter and no X-ray
  double idleBeamSeconds = 0.0;  ///< X-ray while nothing has moved for longer than LongestLook
  double occludedSeconds = 0.0;  ///< a balloon closed the vessel
  double stShift = 0.0;          ///< mV, now
  double greatestStShift = 0.0;  ///< mV
  double elevatedSeconds = 0.0;  ///< ST segment up by Ischaemia::Elevated or more
  ///@{
  /// Of torn walls, now.
  double pericardialBlood = 0.0;    ///< mL
  double pericardialPressure = 0.0; ///< mmHg
  double strokeShare = 1.0;         ///< of the stroke volume that is left
  std::int64_t openHoles = 0;       ///< that are not sealed
  ///@}
  double wireTurning = 0.0;  ///< radians, left and right together
  double deepest = 0.0;      ///< mm of wire beyond the catheter's tip
  std::vector<int> branches; ///< in which the tip has been, in the order in which they were reached
  std::vector<ProcedureEvent> events;
};

/// N: what a tip that is pushed against a wall should not do for long. The tips of workhorse wires buckle below it.
constexpr double ForcefulTip = 0.1;

/// s: what a still view needs at most.
constexpr double LongestLook = 3.0;
}

#endif
