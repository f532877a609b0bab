/**
 * @file SessionWorld.h
 * @brief What sessions of one patient share: made once.
 */
#ifndef DynamicCoronary_SessionWorld_h
#define DynamicCoronary_SessionWorld_h

#include "Scenario.h"
#include "VolumeProjector.h"
#include "WallMotion.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
class ProgressDisplay;

struct SessionWorld
{
  Scenario scenario; ///< with the isocentre that the C-arm starts at
  std::shared_ptr<WallMotion> wall;
  std::uint64_t wallHash = 0;
  std::shared_ptr<const VolumeProjector> background; ///< null: not asked for
  std::string motion;                                ///< for people: "tracked at 20 moments"
  std::vector<std::string> notes;                    ///< what was assumed, a sentence each
  std::string foreignMotion; ///< what of the motion is not the patient's; empty: nothing
};

/// @param progress  gets the steps "vessels" and, with the background, "patient", in either order; numbers from 0 on
/// @throws as LoadVessels, LoadBackground; Cancelled
SessionWorld LoadWorld(const Scenario& scenario, bool background, ProgressDisplay& progress);
}

#endif
