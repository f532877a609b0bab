/**
 * @file EmulatedDevice.h
 * @brief The reference device: the device's side of the protocol with its part of the safety, on a clock that is handed
 * in.
 */
#ifndef DynamicCoronary_EmulatedDevice_h
#define DynamicCoronary_EmulatedDevice_h

#include "DeviceProtocol.h"

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace coronary
{
/// Where the hands on a device are; by AxisKind, in mm, radians, mL, atm.
struct HandPlaces
{
  std::array<double, static_cast<std::size_t>(LastAxisKind) + 1> places{};
  std::uint16_t pedals = 0;
  std::uint16_t buttons = 0;
};

struct EmulatedDeviceSettings
{
  std::string serial = "EMU-0001";
  std::string firmware = "emulator 1";
  std::uint8_t major = ProtocolMajor;
  bool wrongMagic = false;
  std::uint16_t rate = 1000;    ///< Hz, 1 to 1000
  double maxForce = 2.0;        ///< N, of wire and catheter
  double maxTorque = 0.02;      ///< N m
  std::int64_t clockOffset = 0; ///< microseconds that its clock is ahead at 0
  double clockDrift = 0.0;      ///< parts in a million that it is faster
  std::int32_t firstCount = 0;  ///< of all axes when they are at 0: encoders start anywhere
};

/// The axes that it has: wire and catheter, syringe, C-arm.
std::vector<CapsMessage> EmulatedAxes(const EmulatedDeviceSettings& settings);

class EmulatedDevice
{
public:
  enum class State
  {
    Waiting, ///< for HELLO
    Greeted, ///< has answered, waits for START
    Streaming
  };

  explicit EmulatedDevice(const EmulatedDeviceSettings& settings = {});

  ///@{
  /// @param now  microseconds, does not go back
  void Receive(const std::uint8_t* bytes, std::size_t size, std::uint64_t now);
  void Step(std::uint64_t now);
  ///@}

  /// Whole frames to send, oldest first; empties the queue.
  std::vector<WireFrame> TakeFrames();

  HandPlaces& Hands() { return this->Places; }
  EmulatedDeviceSettings& Settings() { return this->Options; }

  /// Encoders that jump: all counts are so many more from now on.
  void JumpCounts(std::int32_t counts) { this->Jump += static_cast<std::uint32_t>(counts); }

  State Now() const { return this->At; }
  bool Relaxed() const { return this->Latched; }
  bool Clamped() const { return this->WasClamped; }
  /// On the motors: wire, catheter in N; wire, catheter in N m.
  const std::array<double, 4>& Motors() const { return this->Output; }
  const DecoderCounts& Counts() const { return this->Decoder.Counts(); }

  /// Called with everything that was understood.
  std::function<void(const Message& message, std::uint64_t now)> OnMessage;

private:
  void Handle(const Message& message, std::uint64_t now);
  void Greet(const Message& message, std::uint64_t now);
  void Begin(const Message& message, std::uint64_t now);
  void TakeForce(const Message& message, std::uint64_t now);
  void WatchHost(std::uint64_t now);
  void SendState(std::uint64_t now);
  void Send(const Message& message, std::uint64_t now);
  std::uint64_t Clock(std::uint64_t now) const;
  std::int32_t CountOf(std::size_t axis) const;

  EmulatedDeviceSettings Options;
  std::vector<CapsMessage> Axes;
  FrameDecoder Decoder;
  FrameSender Sender;
  std::vector<WireFrame> Queue;
  State At = State::Waiting;
  std::uint32_t Nonce = 0;
  HandPlaces Places;
  std::uint32_t Jump = 0;
  std::array<std::uint32_t, MostAxes> Zeros{};
  std::uint64_t NextState = 0;

  std::uint32_t LastTick = 0;
  std::uint64_t Watchdog = 20000; ///< microseconds
  std::uint64_t LastHeard = 0;
  std::uint64_t ValidUntil = 0;
  bool HasForce = false;
  std::array<double, 4> Wanted{};
  std::array<double, 4> Output{};
  bool WasClamped = false;
  bool Latched = true;
  std::uint64_t RampBegan = 0;
  std::array<double, 4> RampFrom{};
};
}

#endif
