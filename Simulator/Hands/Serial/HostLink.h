/**
 * @file HostLink.h
 * @brief The simulator's side of the protocol, with its part of the safety, on a clock that is handed in.
 */
#ifndef DynamicCoronary_HostLink_h
#define DynamicCoronary_HostLink_h

#include "ClockOffset.h"
#include "Device.h"
#include "DevicePort.h"
#include "DeviceProtocol.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// Times of the protocol in microseconds; docs/device-protocol.md says what they are for.
namespace link_times
{
constexpr std::uint64_t Answer = 500000;
constexpr int Tries = 3;
constexpr std::array<std::uint64_t, 3> BackOff{ 1000000, 2000000, 5000000 };
constexpr std::uint64_t Stale = 30000;
constexpr std::uint64_t Lost = 200000;
constexpr std::uint64_t Ping = 100000;
constexpr std::uint64_t Force = 1000;
constexpr std::uint64_t Heartbeat = 5000;
constexpr std::uint64_t PhysicsOverrun = 4000;
constexpr std::uint64_t Rearming = 50000;
constexpr std::uint64_t ErrorWindow = 1000000;
}

/// What the physics has to say to the device.
struct PhysicsWord
{
  std::uint64_t tick = 0;
  std::uint64_t stamp = 0; ///< microseconds: when it was said
  bool alive = false;      ///< something was said, and all numbers are finite
  bool hasForces = false;
  ForceFrame forces;
};

/// What the device has to say, as places since the link was made, which do not jump.
struct LinkSnapshot
{
  static constexpr std::size_t Kinds = static_cast<std::size_t>(LastAxisKind) + 1;

  std::uint64_t version = 0; ///< goes up with every STATE
  DeviceState state = DeviceState::Connecting;
  std::uint32_t axes = 0; ///< bits of DeviceAxes
  std::uint16_t pedals = 0;
  std::uint16_t buttons = 0;
  double period = 0.001;     ///< s in which these places are to be reached
  std::uint64_t arrival = 0; ///< microseconds of the host's clock
  std::uint64_t deviceTime =
    0; ///< microseconds of the host's clock at which the device took them; 0: unknown
  std::array<double, Kinds> places{}; ///< by AxisKind: mm, radians, mL, atm
};

class HostLink
{
public:
  /// @param port  lives longer
  explicit HostLink(DevicePort& port);

  /// Reads, answers, watches and writes. @param now  microseconds, does not go back  @return whether Snapshot() is new
  bool Step(std::uint64_t now, const PhysicsWord& physics);

  /// STOP, as far as the port takes it at once, and closes the port.
  void Close(std::uint64_t now);

  void ConfirmForces() { this->Confirming = true; }

  /// Asks the device to count from 0 where it stands: nothing moves. @param kinds  bit n: axes of AxisKind n
  void Zero(std::uint32_t kinds, std::uint64_t now);

  const LinkSnapshot& Snapshot() const { return this->Shown; }
  DeviceStatus Status() const;
  const ClockOffset& Clock() const { return this->Clocks; }
  const DecoderCounts& Counts() const { return this->Decoder.Counts(); }
  const std::vector<CapsMessage>& Axes() const { return this->Caps; }
  /// Microseconds that Step() may be left out while nothing comes from the port.
  std::uint64_t MostPause() const;

private:
  enum class Phase
  {
    Closed,   ///< until Due
    Greeting, ///< HELLO was sent
    Axes,     ///< CAPS are awaited
    Starting, ///< START was sent
    Running
  };
  struct AxisTrack
  {
    bool known = false;
    std::int32_t last = 0;
    std::int64_t total = 0;
    double base = 0.0; ///< place at total 0
  };

  void OpenPort();
  void Greet();
  void TryAgain(const std::string& why);
  void Refuse(const std::string& why);
  void Drop(DeviceState state, const std::string& why, bool atOnce);
  void ReadPort();
  void Handle(const Message& message);
  void HandleAck(const Message& message);
  void HandleCaps(const Message& message);
  void HandleState(const Message& message);
  void HandlePong(const Message& message);
  void HandleError(const Message& message);
  void HandleCalib(const Message& message);
  void BeginRunning();
  void Track(const StateMessage& state, double seconds);
  void TrackAxis(std::size_t axis, std::int32_t count, double seconds, bool hold);
  void Watch();
  void WatchErrors();
  void Talk(const PhysicsWord& physics);
  void SendForces(const ForceFrame& forces);
  void Send(const Message& message);
  void SendStart();
  void WritePort();
  void SetState(DeviceState state, const std::string& text);
  void SetDriving();
  bool HasMotors() const;
  double Place(std::size_t axis) const;

  DevicePort& Port;
  std::uint64_t Now = 0;
  std::uint64_t Due = 0;    ///< of the next opening, or the end of waiting for an answer
  std::size_t Failures = 0; ///< in a row, of connecting
  Phase At = Phase::Closed;
  int Tried = 0;
  std::uint32_t Nonce = 0;
  std::uint32_t Connections = 0;

  FrameDecoder Decoder;
  std::vector<std::uint8_t> Outgoing;
  FrameSender Sender;

  std::uint32_t CapsSeen = 0; ///< bit n: axis n
  std::vector<CapsMessage> Caps;
  std::string Names; ///< firmware and serial, for people
  std::array<AxisTrack, MostAxes> Tracks{};
  std::uint64_t LastState = 0;
  std::uint64_t Glitches = 0;
  std::uint32_t LastDeviceTime = 0;

  std::uint32_t PingNumber = 0;
  std::uint64_t NextPing = 0;
  ClockOffset Clocks;

  std::uint64_t LastStart = 0;
  std::uint64_t LastForce = 0;
  std::uint64_t LastSent = 0; ///< FORCE or HEARTBEAT
  std::uint64_t LastTick = 0;
  std::uint64_t LastForceTick = 0;
  std::array<double, 4> Applied{}; ///< N, N m: sent last

  DecoderCounts WindowStart;
  std::uint64_t WindowBegan = 0;
  double ErrorsPerSecond = 0.0;

  LinkSnapshot Shown;
  std::string Text = "Connecting.";
  bool WasRunning = false;
  bool Confirming = false;
  bool Confirmed = false;
  bool Noisy = false;
  bool Changed = false;
};
}

#endif
