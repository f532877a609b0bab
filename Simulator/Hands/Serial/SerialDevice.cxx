#include "SerialDevice.h"

#include "SerialPort.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace coronary
{
namespace
{
std::uint64_t SteadyMicroseconds()
{
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(
    std::chrono::steady_clock::now().time_since_epoch())
                                      .count());
}

constexpr double MostPeriods = 3.0; // between states that follow each other
constexpr double LostAfter = 1e-6 * static_cast<double>(link_times::Lost); // s

}

SerialDevice::SerialDevice(const std::string& path)
  : SerialDevice(std::make_unique<SerialPort>(path), SteadyMicroseconds)
{
  this->Thread = std::thread([this] { this->Run(); });
}

SerialDevice::SerialDevice(std::unique_ptr<DevicePort> port, ClockFunction clock)
  : Port(std::move(port))
  , Clock(std::move(clock))
  , Connection(*this->Port)
{
  this->LastStatus = this->Connection.Status();
}

SerialDevice::~SerialDevice()
{
  this->Stopping = true;
  if (this->Thread.joinable())
  {
    this->Thread.join();
  }
  this->Connection.Close(this->Clock());
}

void SerialDevice::Run()
{
  while (!this->Stopping)
  {
    this->Step();
    this->Port->Wait(this->Connection.MostPause());
  }
}

void SerialDevice::Step()
{
  const std::uint64_t now = this->Clock();
  if (this->Confirming.exchange(false))
  {
    this->Connection.ConfirmForces();
  }
  const std::uint32_t zeroing = this->Zeroing.exchange(0);
  if (zeroing != 0)
  {
    this->Connection.Zero(zeroing, now);
  }
  PhysicsWord word;
  this->ToDevice.Read(word);
  this->Connection.Step(now, word);
  this->Publish();
}

void SerialDevice::Publish()
{
  this->FromDevice.Write(this->Connection.Snapshot());
  const std::lock_guard<std::mutex> lock(this->StatusMutex);
  this->LastStatus = this->Connection.Status();
}

void SerialDevice::Read(std::uint64_t /*tick*/, double secondsPerTick, InputFrame& frame)
{
  const bool heard = this->FromDevice.Read(this->Latest);
  this->Silence = heard ? 0.0 : this->Silence + secondsPerTick;
  this->Interpolate(secondsPerTick);
  frame = {};
  frame.axes = this->Latest.axes;
  frame.state = this->Silence < LostAfter ? this->Latest.state : DeviceState::Disconnected;
  SessionInput& input = frame.input;
  AxisPlaces places;
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    places[axis] = this->Places[static_cast<std::size_t>(HandAxisTable[axis].kind)];
  }
  SetPlaces(input, places);
  if (frame.state == DeviceState::Running || frame.state == DeviceState::Stale)
  {
    input.pedals = this->Latest.pedals;
    frame.buttons = this->Latest.buttons;
  }
}

void SerialDevice::Interpolate(double secondsPerTick)
{
  this->Since += secondsPerTick;
  this->Catching += secondsPerTick;
  if (this->Latest.version != this->Version)
  {
    const double gap = 1e-6 * static_cast<double>(this->Latest.arrival - this->LastArrival);
    this->Version = this->Latest.version;
    this->LastArrival = this->Latest.arrival;
    this->From = this->Even;
    this->Since = secondsPerTick;
    if (gap > MostPeriods * this->Latest.period)
    {
      this->Bridge(gap);
      this->Catching = secondsPerTick;
    }
  }
  const double share = std::min(1.0, this->Since / this->Latest.period);
  const double left = std::max(0.0, 1.0 - this->Catching / this->CatchingTime);
  for (std::size_t kind = 0; kind < LinkSnapshot::Kinds; ++kind)
  {
    const double to = this->Latest.places[kind];
    this->Even[kind] = share < 1.0 ? this->From[kind] + share * (to - this->From[kind]) : to;
    this->Places[kind] = this->Even[kind] + this->Shift[kind] + left * this->Behind[kind];
  }
}

/// After a gap between states that were read: a short one is caught up in as long as it was; in a long one the hands
/// were not on the instrument.
void SerialDevice::Bridge(double gap)
{
  this->From = this->Latest.places;
  this->CatchingTime = gap;
  for (std::size_t kind = 0; kind < LinkSnapshot::Kinds; ++kind)
  {
    this->Behind[kind] = this->Places[kind] - this->From[kind] - this->Shift[kind];
    if (gap >= LostAfter)
    {
      this->Shift[kind] += std::exchange(this->Behind[kind], 0.0);
    }
  }
}

void SerialDevice::Command(const ForceFrame& forces)
{
  this->Word.forces = forces;
  this->Word.hasForces = true;
  this->Word.alive = std::isfinite(forces.wireForce) && std::isfinite(forces.wireTorque) &&
    std::isfinite(forces.catheterForce) && std::isfinite(forces.catheterTorque);
  this->Word.tick = forces.tick;
  this->Say();
}

void SerialDevice::Heartbeat(std::uint64_t tick)
{
  this->Word.alive = this->Word.alive || !this->Word.hasForces;
  this->Word.tick = tick;
  this->Say();
}

void SerialDevice::Say()
{
  this->Word.stamp = this->Clock();
  this->ToDevice.Write(this->Word);
}

DeviceStatus SerialDevice::Status() const
{
  const std::lock_guard<std::mutex> lock(this->StatusMutex);
  return this->LastStatus;
}

void SerialDevice::ConfirmForces()
{
  this->Confirming = true;
}
}
