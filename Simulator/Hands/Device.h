/**
 * @file Device.h
 * @brief What a trainee's hands are on: hardware, a game controller, keys, a recording or a script.
 */
#ifndef DynamicCoronary_Device_h
#define DynamicCoronary_Device_h

#include "HandAxes.h"

#include <cstdint>
#include <memory>
#include <string>

namespace coronary
{
enum class DeviceState : std::uint8_t
{
  Connecting,   ///< not known yet
  Running,      ///< its input is good
  Stale,        ///< silent or disturbed for a moment: its pose is held, no forces
  Disconnected, ///< not there, and waited for: pose held, pedals released, no injection
  Refused,      ///< not ours, of another version, or not allowed; tried again now and then
  Ended         ///< a recording or a script that is over: its pose is held
};

/// What a device says at one tick. Places are of its own: they start somewhere, and never jump.
struct InputFrame
{
  SessionInput input;        ///< pedals are 0 unless state is Running or Stale
  std::uint32_t buttons = 0; ///< as the device numbers them
  std::uint32_t axes = 0;    ///< bits of DeviceAxes that it has
  DeviceState state = DeviceState::Connecting;
};

/// What the hands are to feel, along the same directions as the places of DriveInput: resistance has the other sign
/// than the movement. A device without motors takes no notice.
struct ForceFrame
{
  std::uint64_t tick = 0;
  double wireForce = 0.0;               ///< N
  double wireTorque = 0.0;              ///< N mm
  double catheterForce = 0.0;           ///< N
  double catheterTorque = 0.0;          ///< N mm
  std::uint16_t validMilliseconds = 20; ///< after which the device relaxes by itself, 1 to 1000
};

struct DeviceStatus
{
  DeviceState state = DeviceState::Connecting;
  std::string text;             ///< a sentence for people
  bool awaitsForces = false;    ///< there are motors, which rest until ConfirmForces()
  double errorsPerSecond = 0.0; ///< frames that were lost or damaged
  std::uint64_t glitches = 0;   ///< steps of counts that nobody's hand makes
};

/**
 * Read(), Command() and Heartbeat() are for the thread of the physics: they do not wait, lock, allocate or make system
 * calls. All else is for any other thread.
 */
class Device
{
public:
  virtual ~Device() = default;

  /// What the device says at `tick`; call it with ticks that go up by one. @param secondsPerTick  positive
  virtual void Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame) = 0;

  /// The last one counts. What is not finite, or above what the device can do, does not reach it.
  virtual void Command(const ForceFrame& /*forces*/) {}

  /// The state after `tick` is sound. The device relaxes its motors soon after this is not said any more: do not call
  /// it when a number is not finite.
  virtual void Heartbeat(std::uint64_t /*tick*/) {}

  virtual DeviceStatus Status() const = 0;

  /// The trainee is ready to feel forces: asked for anew with every connection, and after the device has relaxed.
  virtual void ConfirmForces() {}

  /// Whether its places tremble while the hands rest, as those of encoders do.
  virtual bool IsNoisy() const { return false; }

  /// Whether its places are those of a whole session from tick 0 on, and not of hands that may already have moved.
  virtual bool IsScripted() const { return false; }
};

/// Waits until the state is another than Connecting, for so many s at most.
DeviceStatus WaitWhileConnecting(const Device& device, double seconds);

/// Nobody's hands.
class NullDevice : public Device
{
public:
  void Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame) override;
  DeviceStatus Status() const override;
};
}

#endif
