/**
 * @file SessionWorld.h
 * @brief What sessions of one patient share: made once.
 */
#ifndef DynamicCoronary_SessionWorld_h
#define DynamicCoronary_SessionWorld_h

#include "MovingParts.h"
#include "PatientHeart.h"
#include "Scenario.h"
#include "VolumeProjector.h"
#include "WallMotion.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
struct SessionWorld
{
  Scenario scenario; ///< with the isocentre that the C-arm starts at
  std::shared_ptr<WallMotion> wall;
  std::uint64_t wallHash = 0;
  std::shared_ptr<const PatientHeart> heart;         ///< null: not known
  std::shared_ptr<const VolumeProjector> background; ///< null: not asked for
  std::shared_ptr<const MovingParts> moving;         ///< of the background; null: nothing moves
  std::shared_ptr<const VolumeProjector> measured; ///< by the exposure control; null: there is none
  std::string motion;                              ///< for people: "tracked at 20 moments"
  std::vector<std::string> notes;                  ///< what was assumed, a sentence each
  std::string foreignMotion; ///< what of the motion is not the patient's; empty: nothing
};

/// Gets what is being made, "vessels" and, with the background, "patient", in either order, and how much of it, 0 to 1.
/// @return false: cancel
using WorldProgress = std::function<bool(const std::string& what, double fraction)>;

/// A CT is read for the exposure control, too: doses do not depend on whether images are wanted.
/// @throws as LoadVessels, LoadBackground; Cancelled
SessionWorld LoadWorld(const Scenario& scenario, bool background, const WorldProgress& progress);
}

#endif
