#include "EmulatedDevice.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace coronary
{
namespace
{
constexpr double RampTime = 50000.0; // microseconds in which motors let go
constexpr double Turn = 2.0 * M_PI;

CapsMessage AxisOf(AxisKind kind, AxisUnit unit, double perCount, double maxForce)
{
  CapsMessage caps;
  caps.kind = kind;
  caps.unit = unit;
  caps.perCount = perCount;
  caps.resolution = static_cast<float>(perCount);
  caps.maxForce = static_cast<float>(maxForce);
  return caps;
}
}

std::vector<CapsMessage> EmulatedAxes(const EmulatedDeviceSettings& settings)
{
  constexpr double Encoder = Turn / 16384.0;
  std::vector<CapsMessage> axes{ AxisOf(AxisKind::WireAdvance, AxisUnit::Millimetre, 0.005,
                                   settings.maxForce),
    AxisOf(AxisKind::WireTurn, AxisUnit::Radian, Encoder, settings.maxTorque),
    AxisOf(AxisKind::CatheterAdvance, AxisUnit::Millimetre, 0.005, settings.maxForce),
    AxisOf(AxisKind::CatheterTurn, AxisUnit::Radian, Encoder, settings.maxTorque),
    AxisOf(AxisKind::Syringe, AxisUnit::Millilitre, 0.001, 0.0),
    AxisOf(AxisKind::Primary, AxisUnit::Radian, Encoder, 0.0),
    AxisOf(AxisKind::Secondary, AxisUnit::Radian, Encoder, 0.0) };
  for (std::size_t n = 0; n < axes.size(); ++n)
  {
    axes[n].index = static_cast<std::uint8_t>(n);
    axes[n].count = static_cast<std::uint8_t>(axes.size());
    axes[n].stateRate = settings.rate;
  }
  return axes;
}

EmulatedDevice::EmulatedDevice(const EmulatedDeviceSettings& settings)
  : Options(settings)
  , Axes(EmulatedAxes(settings))
{
}

std::uint64_t EmulatedDevice::Clock(std::uint64_t now) const
{
  const double drifted = 1e-6 * this->Options.clockDrift * static_cast<double>(now);
  return now + static_cast<std::uint64_t>(this->Options.clockOffset + std::llround(drifted));
}

void EmulatedDevice::Send(const Message& message, std::uint64_t now)
{
  this->Queue.push_back(this->Sender.Send(message, this->Clock(now)));
}

std::vector<WireFrame> EmulatedDevice::TakeFrames()
{
  return std::exchange(this->Queue, {});
}

void EmulatedDevice::Receive(const std::uint8_t* bytes, std::size_t size, std::uint64_t now)
{
  for (std::size_t n = 0; n < size; ++n)
  {
    if (this->Decoder.Push(bytes[n]))
    {
      this->Handle(this->Decoder.Last(), now);
    }
  }
}

void EmulatedDevice::Handle(const Message& message, std::uint64_t now)
{
  if (this->OnMessage)
  {
    this->OnMessage(message, now);
  }
  switch (message.type)
  {
    case MessageType::Hello:
      return this->Greet(message, now);
    case MessageType::Start:
      return this->Begin(message, now);
    case MessageType::Stop:
      this->At = State::Waiting;
      return;
    case MessageType::Force:
    case MessageType::Heartbeat:
      return this->TakeForce(message, now);
    case MessageType::Ping:
    {
      PingMessage ping;
      if (Decode(message, ping))
      {
        this->Send(
          Encode(PongMessage{ ping.number, ping.hostMicroseconds, this->Clock(now) }), now);
      }
      return;
    }
    case MessageType::Zero:
    {
      ZeroMessage zero;
      if (Decode(message, zero))
      {
        for (std::size_t axis = 0; axis < this->Axes.size(); ++axis)
        {
          const bool wanted = (zero.axes >> axis & 1U) != 0;
          this->Zeros[axis] += wanted ? static_cast<std::uint32_t>(this->CountOf(axis)) : 0;
        }
        this->Send(Encode(MessageType::ZeroAck, zero), now);
      }
      return;
    }
    case MessageType::Calib:
    {
      CalibMessage calib;
      if (Decode(message, calib) && calib.axis < this->Axes.size())
      {
        this->Axes[calib.axis].perCount = calib.perCount;
        this->Send(Encode(calib), now);
      }
      return;
    }
    default: // what a device says
      return;
  }
}

void EmulatedDevice::Greet(const Message& message, std::uint64_t now)
{
  HelloMessage hello;
  if (!Decode(message, hello))
  {
    return;
  }
  this->Sender.Reset();
  this->At = State::Waiting;
  this->Nonce = hello.nonce;
  HelloAckMessage ack;
  ack.major = this->Options.major;
  ack.nonce = hello.nonce;
  ack.serial = this->Options.serial;
  ack.firmware = this->Options.firmware;
  Message answer = Encode(ack);
  if (this->Options.wrongMagic)
  {
    answer.payload[0] = 'X';
  }
  this->Send(answer, now);
  if (this->Options.major < hello.minMajor || this->Options.major > hello.maxMajor)
  {
    this->Send(Encode(ErrorMessage{ DeviceError::Version, "no version that both know" }), now);
    return;
  }
  for (const CapsMessage& caps : this->Axes)
  {
    this->Send(Encode(caps), now);
  }
  this->At = State::Greeted;
}

void EmulatedDevice::Begin(const Message& message, std::uint64_t now)
{
  StartMessage start;
  if (this->At == State::Waiting || !Decode(message, start))
  {
    return;
  }
  if (start.nonce != this->Nonce)
  {
    this->Send(Encode(ErrorMessage{ DeviceError::Nonce, "START without the nonce of HELLO" }), now);
    return;
  }
  if (this->At == State::Greeted)
  {
    this->NextState = now;
  }
  this->At = State::Streaming;
  this->Watchdog = 1000U * std::uint64_t{ start.watchdog };
  this->LastHeard = now;
  this->HasForce = false;
  this->Latched = false;
  this->Wanted = {};
  this->Output = {};
  this->WasClamped = false;
}

void EmulatedDevice::TakeForce(const Message& message, std::uint64_t now)
{
  if (this->At != State::Streaming)
  {
    return;
  }
  HeartbeatMessage heartbeat;
  ForceMessage force;
  if (Decode(message, heartbeat))
  {
    this->LastTick = heartbeat.tick;
    this->LastHeard = now;
    return;
  }
  if (!Decode(message, force))
  {
    return;
  }
  this->LastTick = force.tick;
  this->LastHeard = now;
  this->ValidUntil = now + 1000U * std::uint64_t{ force.validMilliseconds };
  this->HasForce = true;
  const std::array<double, 4> wanted{ force.force[0], force.force[1], force.torque[0],
    force.torque[1] };
  for (std::size_t n = 0; n < wanted.size(); ++n)
  {
    // What a float makes of the limit is within it.
    const double most =
      static_cast<float>(n < 2 ? this->Options.maxForce : this->Options.maxTorque);
    this->Wanted[n] = std::clamp(wanted[n], -most, most);
    this->WasClamped = this->WasClamped || this->Wanted[n] != wanted[n];
  }
}

void EmulatedDevice::WatchHost(std::uint64_t now)
{
  const bool silent = now - this->LastHeard >= this->Watchdog;
  const bool outdated = this->HasForce && now >= this->ValidUntil;
  const bool over = this->At != State::Streaming || silent || outdated;
  if (over && !this->Latched)
  {
    this->Latched = true;
    this->RampBegan = now;
    this->RampFrom = this->Output;
  }
  if (!this->Latched)
  {
    this->Output = this->Wanted;
    return;
  }
  const double share = std::max(0.0, 1.0 - static_cast<double>(now - this->RampBegan) / RampTime);
  for (std::size_t n = 0; n < this->Output.size(); ++n)
  {
    this->Output[n] = share * this->RampFrom[n];
  }
}

void EmulatedDevice::Step(std::uint64_t now)
{
  this->WatchHost(now);
  if (this->At != State::Streaming)
  {
    return;
  }
  if (now >= this->NextState)
  {
    this->SendState(now);
    const std::uint64_t period = 1000000U / std::max<std::uint64_t>(1, this->Options.rate);
    this->NextState += period;
    // Who comes late does not make up for it.
    this->NextState = this->NextState <= now ? now + period : this->NextState;
  }
}

std::int32_t EmulatedDevice::CountOf(std::size_t axis) const
{
  const CapsMessage& caps = this->Axes[axis];
  const double place = this->Places.places[static_cast<std::size_t>(caps.kind)];
  const auto counts = static_cast<std::uint32_t>(std::llround(place / caps.perCount));
  return static_cast<std::int32_t>(
    counts + static_cast<std::uint32_t>(this->Options.firstCount) + this->Jump - this->Zeros[axis]);
}

void EmulatedDevice::SendState(std::uint64_t now)
{
  StateMessage state;
  state.tick = this->LastTick;
  state.pedals = this->Places.pedals;
  state.buttons = this->Places.buttons;
  const unsigned relaxed = this->Latched ? ForcesRelaxed : 0;
  const unsigned clamped = this->WasClamped ? ForceClamped : 0;
  state.status = static_cast<std::uint16_t>(relaxed | clamped);
  state.axes = static_cast<std::uint8_t>(this->Axes.size());
  for (std::size_t axis = 0; axis < this->Axes.size(); ++axis)
  {
    state.counts[axis] = this->CountOf(axis);
  }
  this->Send(Encode(state), now);
}
}
