/**
 * @file GamepadDevice.h
 * @brief Driving with a game controller, through Linux' evdev.
 *
 * Left stick: wire, forward and turning. Right stick: guide catheter. Right trigger: inject. Left trigger: pedal of
 * fluoroscopy. BTN_SOUTH (A, cross): cine. BTN_EAST (B, circle): mask. Shoulders: left fine, right fast.
 * Directional pad: C-arm, LAO to the right, cranial up; with BTN_NORTH (triangle; X on Xbox controllers): table, to the
 * patient's left and head; with BTN_WEST (square; Y): detector. Select: refill the syringe.
 */
#ifndef DynamicCoronary_GamepadDevice_h
#define DynamicCoronary_GamepadDevice_h

#include "Device.h"
#include "HandMotion.h"
#include "TripleBuffer.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace coronary
{
/// What is deflected and held; sticks -1 to 1 (right and up), triggers 0 to 1.
struct GamepadState
{
  double leftX = 0.0;
  double leftY = 0.0;
  double rightX = 0.0;
  double rightY = 0.0;
  double leftTrigger = 0.0;
  double rightTrigger = 0.0;
  double padX = 0.0;
  double padY = 0.0;
  std::uint32_t buttons = 0; ///< bits of GamepadButton
  bool there = false;
};

enum GamepadButton : std::uint32_t
{
  SouthButton = 1U,
  EastButton = 2U,
  NorthButton = 4U,
  WestButton = 8U,
  LeftShoulder = 16U,
  RightShoulder = 32U,
  SelectButton = 64U
};

/// Sticks rest nowhere exactly: below DeadZone is 0, and from there the square of what is left, for fine movement.
constexpr double GamepadDeadZone = 0.12;
double GamepadResponse(double deflection);

/// What a gamepad's state asks of the hands.
HandWishes GamepadWishes(const GamepadState& state, const HandSpeeds& speeds);

/// @param before  the pedals before: the trigger has a hysteresis
std::uint32_t GamepadPedals(const GamepadState& state, std::uint32_t before);

/// Events of evdev to a state.
class GamepadDecoder
{
public:
  GamepadDecoder();

  /// Of an absolute axis (ABS_X, ...), as the device says. Ranges that are none are not taken.
  void SetRange(std::uint16_t axis, std::int32_t low, std::int32_t high);

  /// @return whether State() is new: at the end of a report
  bool Feed(std::uint16_t type, std::uint16_t code, std::int32_t value);

  const GamepadState& State() const { return this->Reported; }

private:
  static constexpr std::size_t Axes = 0x40;
  struct Range
  {
    std::int32_t low = -32768;
    std::int32_t high = 32767;
  };
  double Scaled(std::uint16_t axis, std::int32_t value) const;
  void FeedAxis(std::uint16_t axis, std::int32_t value);

  std::array<Range, Axes> Ranges;
  GamepadState Growing;
  GamepadState Reported;
  bool Dropping = false;
};

/// A thread of its own reads the events; a controller that goes away is waited for.
class GamepadDevice : public Device
{
public:
  /// @param path  /dev/input/event3; empty: the first that is a game controller
  /// @throws std::runtime_error in a build without libevdev
  explicit GamepadDevice(const std::string& path, const HandSpeeds& speeds = {});

  /// Recorded events (struct input_event) out of an open file, such as a pipe; it is closed at the end.
  explicit GamepadDevice(int file, const HandSpeeds& speeds = {});

  /// Whether this build can look for controllers.
  static bool HasEvdev();

  ~GamepadDevice() override;
  GamepadDevice(const GamepadDevice&) = delete;
  GamepadDevice& operator=(const GamepadDevice&) = delete;

  void Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame) override;
  DeviceStatus Status() const override;

private:
  void WatchController();
  void ReadController(int file, const std::string& name);
  void ReadEvents(int file);
  void Pause(int milliseconds);
  void Tell(DeviceState state, const std::string& text);

  std::string Path;
  GamepadDecoder Decoder; ///< of the thread
  TripleBuffer<GamepadState> Latest;
  GamepadState State; ///< of the physics
  HandMotion Hands;   ///< of the physics
  std::uint32_t Pedals = 0;
  bool WasThere = false;
  std::atomic<bool> Stopping{ false };
  mutable std::mutex StatusMutex;
  DeviceStatus LastStatus;
  std::thread Thread;
};
}

#endif
