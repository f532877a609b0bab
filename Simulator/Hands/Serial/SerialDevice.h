/**
 * @file SerialDevice.h
 * @brief Hardware that speaks the device protocol, docs/device-protocol.md.
 */
#ifndef DynamicCoronary_SerialDevice_h
#define DynamicCoronary_SerialDevice_h

#include "Device.h"
#include "DevicePort.h"
#include "HostLink.h"
#include "TripleBuffer.h"

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace coronary
{
/**
 * A thread of its own reads, writes and watches; the physics only leaves and takes the latest word. So the device hears
 * heartbeats as long as both live, and relaxes when either does not.
 * Motion between two states of the device is made even.
 */
class SerialDevice : public Device
{
public:
  using ClockFunction = std::function<std::uint64_t()>; ///< microseconds, do not go back

  /// With a thread and the steady clock. @param path  such as /dev/ttyACM0; need not exist yet
  explicit SerialDevice(const std::string& path);

  /// Without a thread, for tests: Step() is to be called. @param clock  called by the physics and by Step()
  SerialDevice(std::unique_ptr<DevicePort> port, ClockFunction clock);

  ~SerialDevice() override;
  SerialDevice(const SerialDevice&) = delete;
  SerialDevice& operator=(const SerialDevice&) = delete;

  void Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame) override;
  void Command(const ForceFrame& forces) override;
  void Heartbeat(std::uint64_t tick) override;
  DeviceStatus Status() const override;
  void ConfirmForces() override;
  bool IsNoisy() const override { return true; }

  /// Asks the device to count from 0 where it stands; nothing moves. @param kinds  bit n: axes of AxisKind n
  void Zero(std::uint32_t kinds) { this->Zeroing.fetch_or(kinds); }

  /// What the thread does again and again. Without one: in the thread of the caller.
  void Step();

  /// Microseconds on the host's clock at which the device took what Read() gave last; 0: unknown. The physics' thread.
  std::uint64_t TakenAt() const { return this->Latest.deviceTime; }

  /// Microseconds on the host's clock at which that arrived.
  std::uint64_t ArrivedAt() const { return this->Latest.arrival; }

  /// States that the device sent so far. The physics' thread.
  std::uint64_t States() const { return this->Latest.version; }

  /// For tests and for people: what the link knows. Only without a thread.
  const HostLink& Link() const { return this->Connection; }

private:
  void Run();
  void Say();
  void Publish();
  void Interpolate(double secondsPerTick);
  void Bridge(double gap);

  std::unique_ptr<DevicePort> Port;
  ClockFunction Clock;
  HostLink Connection;

  // Of the physics.
  PhysicsWord Word;
  LinkSnapshot Latest;
  using PlaceArray = std::array<double, LinkSnapshot::Kinds>;
  PlaceArray From{};         ///< even motion when Latest came
  PlaceArray Even{};         ///< even motion between the device's states
  PlaceArray Behind{};       ///< what a short gap left to be caught up
  PlaceArray Shift{};        ///< what long gaps left out
  PlaceArray Places{};       ///< what is said
  double Since = 0.0;        ///< s of ticks since Latest moved
  double Catching = 0.0;     ///< s of ticks since a gap ended
  double CatchingTime = 1.0; ///< s
  std::uint64_t LastArrival = 0;
  double Silence = 0.0; ///< s of ticks since the thread said anything
  std::uint64_t Version = 0;

  TripleBuffer<LinkSnapshot> FromDevice;
  TripleBuffer<PhysicsWord> ToDevice;
  std::atomic<bool> Confirming{ false };
  std::atomic<std::uint32_t> Zeroing{ 0 };
  std::atomic<bool> Stopping{ false };

  mutable std::mutex StatusMutex; ///< not for the physics
  DeviceStatus LastStatus;
  std::thread Thread;
};
}

#endif
