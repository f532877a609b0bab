#include "HostLink.h"

#include "CounterRandom.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace coronary
{
namespace
{
using namespace link_times;

constexpr std::size_t MostOutgoing = 4096; // what a device does not take any more is out of date
constexpr std::uint16_t LowestRate = 100;  // Hz: below, a single lost STATE is silence
constexpr double ForceRise = 50.0;         // of the axis' maximum, a second
constexpr double MostErrors = 0.01;        // of all frames

std::size_t KindOf(const CapsMessage& caps)
{
  return static_cast<std::size_t>(caps.kind);
}

/// Units a second that no hand reaches.
double FastestOf(AxisKind kind)
{
  const HandAxis* axis = HandAxisOf(kind);
  return axis ? axis->fastest : std::numeric_limits<double>::infinity();
}

AxisUnit UnitOf(AxisKind kind)
{
  const HandAxis* axis = HandAxisOf(kind);
  return axis ? axis->unit : AxisUnit::None;
}

std::uint32_t GroupOf(AxisKind kind)
{
  const HandAxis* axis = HandAxisOf(kind);
  return axis ? axis->group : 0U;
}

/// Which of Applied an axis feels, or -1.
int MotorOf(AxisKind kind)
{
  switch (kind)
  {
    case AxisKind::WireAdvance:
      return 0;
    case AxisKind::CatheterAdvance:
      return 1;
    case AxisKind::WireTurn:
      return 2;
    case AxisKind::CatheterTurn:
      return 3;
    default:
      return -1;
  }
}
}

HostLink::HostLink(DevicePort& port)
  : Port(port)
{
  this->Outgoing.reserve(MostOutgoing + MostWire);
  this->Caps.reserve(MostAxes);
}

bool HostLink::Step(std::uint64_t now, const PhysicsWord& physics)
{
  this->Now = now;
  this->Changed = false;
  if (this->At == Phase::Closed && now >= this->Due)
  {
    this->OpenPort();
  }
  if (this->At != Phase::Closed)
  {
    this->ReadPort();
  }
  if (this->At != Phase::Closed)
  {
    this->Watch();
  }
  if (this->At == Phase::Running)
  {
    this->Talk(physics);
  }
  if (this->At != Phase::Closed)
  {
    this->WritePort();
  }
  return this->Changed;
}

void HostLink::Close(std::uint64_t now)
{
  this->Now = now;
  if (this->At != Phase::Closed)
  {
    this->Send(EncodeStop());
    this->WritePort();
    this->Port.Close();
    this->At = Phase::Closed;
  }
  this->Due = std::numeric_limits<std::uint64_t>::max();
  this->SetState(DeviceState::Disconnected, "'" + this->Port.Name() + "' was closed.");
}

std::uint64_t HostLink::MostPause() const
{
  return this->At == Phase::Running ? Force : 20U * Force;
}

void HostLink::SetState(DeviceState state, const std::string& text)
{
  this->Shown.state = state;
  this->Text = text;
  if (state != DeviceState::Running && state != DeviceState::Stale)
  {
    this->Shown.pedals = 0;
    this->Shown.buttons = 0;
  }
  this->Changed = true;
}

void HostLink::SetDriving()
{
  this->SetState(DeviceState::Running,
    "The device at '" + this->Port.Name() + "' (" + this->Names + ") drives.");
}

void HostLink::OpenPort()
{
  std::string why;
  const PortOpening opening = this->Port.Open(why);
  if (opening != PortOpening::Open)
  {
    this->Drop(opening == PortOpening::Denied ? DeviceState::Refused : DeviceState::Disconnected,
      why, false);
    return;
  }
  this->Tried = 0;
  this->Greet();
}

void HostLink::Greet()
{
  // Bytes of an earlier connection can not answer this one.
  this->Nonce = static_cast<std::uint32_t>(MixBits(this->Now + MixBits(++this->Connections)));
  this->Decoder.Reset();
  this->Sender.Reset();
  this->Outgoing.clear();
  this->Outgoing.push_back(0); // ends whatever lies in the device's buffer
  HelloMessage hello;
  hello.nonce = this->Nonce;
  hello.host = "DynamicCoronary";
  this->Send(Encode(hello));
  this->At = Phase::Greeting;
  this->Due = this->Now + Answer;
}

void HostLink::TryAgain(const std::string& why)
{
  if (++this->Tried < Tries)
  {
    this->Greet();
    return;
  }
  this->Drop(this->WasRunning ? DeviceState::Disconnected : DeviceState::Refused, why, false);
}

void HostLink::Refuse(const std::string& why)
{
  this->Failures = BackOff.size() - 1;
  this->Drop(DeviceState::Refused, why, false);
}

void HostLink::Drop(DeviceState state, const std::string& why, bool atOnce)
{
  this->Port.Close();
  this->At = Phase::Closed;
  if (atOnce)
  {
    this->Due = this->Now;
  }
  else
  {
    this->Due = this->Now + BackOff[std::min(this->Failures, BackOff.size() - 1)];
    ++this->Failures;
  }
  this->Confirmed = false;
  this->SetState(state, why);
}

void HostLink::ReadPort()
{
  std::array<std::uint8_t, 4096> bytes;
  // A stream that never pauses must not keep the rest from being done.
  for (int round = 0; round < 16 && this->At != Phase::Closed; ++round)
  {
    const int size = this->Port.Read(bytes.data(), bytes.size());
    if (size < 0)
    {
      this->Drop(DeviceState::Disconnected,
        "'" + this->Port.Name() + "' is gone; it is waited for.", this->At == Phase::Running);
      return;
    }
    for (int n = 0; n < size && this->At != Phase::Closed; ++n)
    {
      if (this->Decoder.Push(bytes[static_cast<std::size_t>(n)]))
      {
        this->Handle(this->Decoder.Last());
      }
    }
    if (size < static_cast<int>(bytes.size()))
    {
      return;
    }
  }
}

void HostLink::Handle(const Message& message)
{
  switch (message.type)
  {
    case MessageType::HelloAck:
      return this->HandleAck(message);
    case MessageType::Caps:
      return this->HandleCaps(message);
    case MessageType::State:
      return this->HandleState(message);
    case MessageType::Pong:
      return this->HandlePong(message);
    case MessageType::Error:
      return this->HandleError(message);
    case MessageType::Calib:
      return this->HandleCalib(message);
    case MessageType::ZeroAck:
    {
      ZeroMessage zero;
      for (std::size_t axis = 0; Decode(message, zero) && axis < MostAxes; ++axis)
      {
        this->Tracks[axis].known = this->Tracks[axis].known && (zero.axes >> axis & 1U) == 0;
      }
      return;
    }
    default: // what a host says
      return;
  }
}

void HostLink::HandleAck(const Message& message)
{
  if (this->At != Phase::Greeting)
  {
    return;
  }
  HelloAckMessage ack;
  if (!Decode(message, ack))
  {
    this->Refuse("What is at '" + this->Port.Name() + "' is no device for this simulator.");
    return;
  }
  if (ack.nonce != this->Nonce)
  {
    return; // an answer to someone else
  }
  if (ack.major != ProtocolMajor)
  {
    this->Refuse("The device at '" + this->Port.Name() + "' speaks version " +
      std::to_string(ack.major) + " of the protocol; only version " +
      std::to_string(ProtocolMajor) + " is known.");
    return;
  }
  this->Names = ack.serial + (ack.firmware.empty() ? "" : ", firmware " + ack.firmware);
  this->Caps.clear();
  this->CapsSeen = 0;
  this->At = Phase::Axes;
  this->Due = this->Now + Answer;
}

void HostLink::HandleCaps(const Message& message)
{
  if (this->At != Phase::Axes)
  {
    return;
  }
  CapsMessage caps;
  if (!Decode(message, caps) || (!this->Caps.empty() && caps.count != this->Caps.size()) ||
    (caps.kind != AxisKind::None && caps.unit != UnitOf(caps.kind)))
  {
    this->Refuse(
      "The device at '" + this->Port.Name() + "' describes an axis that is not possible.");
    return;
  }
  this->Caps.resize(caps.count);
  this->Caps[caps.index] = caps;
  this->CapsSeen |= 1U << caps.index;
  if (this->CapsSeen != (1U << caps.count) - 1U)
  {
    return;
  }
  std::uint32_t kinds = 0;
  for (const CapsMessage& axis : this->Caps)
  {
    const std::uint32_t bit = axis.kind == AxisKind::None ? 0 : 1U << KindOf(axis);
    if ((kinds & bit) != 0 || axis.stateRate < LowestRate)
    {
      this->Refuse("The device at '" + this->Port.Name() + "' " +
        (axis.stateRate < LowestRate
            ? "sends its state less often than " + std::to_string(LowestRate) + " times a second."
            : "has two axes of one kind."));
      return;
    }
    kinds |= bit;
  }
  this->SendStart();
  this->At = Phase::Starting;
  this->Due = this->Now + Answer;
}

void HostLink::SendStart()
{
  StartMessage start;
  start.rate = this->Caps.front().stateRate;
  start.nonce = this->Nonce;
  this->Send(Encode(start));
  this->LastStart = this->Now;
}

void HostLink::BeginRunning()
{
  for (std::size_t axis = 0; axis < this->Caps.size(); ++axis)
  {
    this->Tracks[axis] = { false, 0, 0, this->Shown.places[KindOf(this->Caps[axis])] };
  }
  this->Shown.axes = 0;
  for (const CapsMessage& caps : this->Caps)
  {
    this->Shown.axes |= GroupOf(caps.kind);
  }
  this->At = Phase::Running;
  this->Failures = 0;
  this->WasRunning = true;
  this->Confirming = false;
  this->Confirmed = false;
  this->Applied = {};
  this->LastForceTick = ~std::uint64_t{ 0 };
  this->LastTick = ~std::uint64_t{ 0 };
  this->NextPing = this->Now;
  this->Clocks = {};
  this->WindowStart = this->Decoder.Counts();
  this->WindowBegan = this->Now;
  this->Noisy = false;
  this->ErrorsPerSecond = 0.0;
  this->LastState = this->Now;
  this->SetDriving();
}

void HostLink::HandleState(const Message& message)
{
  StateMessage state;
  if ((this->At != Phase::Starting && this->At != Phase::Running) || !Decode(message, state) ||
    state.axes != this->Caps.size())
  {
    return;
  }
  const double period = 1.0 / this->Caps.front().stateRate;
  const bool first = this->At == Phase::Starting;
  if (first)
  {
    this->BeginRunning();
  }
  const double since = 1e-6 * (message.microseconds - this->LastDeviceTime);
  this->Track(state, std::clamp(since, period, 1e-6 * Lost));
  this->LastDeviceTime = message.microseconds;
  this->LastState = this->Now;
  this->Shown.pedals = state.pedals;
  this->Shown.buttons = state.buttons;
  ++this->Shown.version;
  const bool silent = this->Shown.state == DeviceState::Stale && !this->Noisy;
  this->Shown.period = period;
  this->Shown.arrival = this->Now;
  this->Shown.deviceTime = 0;
  if (this->Clocks.Known())
  {
    const auto expected =
      this->Now + static_cast<std::uint64_t>(static_cast<std::int64_t>(this->Clocks.Offset()));
    const auto ahead =
      static_cast<std::int32_t>(message.microseconds - static_cast<std::uint32_t>(expected));
    this->Shown.deviceTime = this->Now + static_cast<std::uint64_t>(std::int64_t{ ahead });
  }
  this->Changed = true;
  if (silent)
  {
    this->SetDriving();
  }
  if ((state.status & ForcesRelaxed) != 0 && this->Now - this->LastStart > Rearming)
  {
    this->Confirmed = false;
  }
}

void HostLink::Track(const StateMessage& state, double seconds)
{
  for (std::size_t axis = 0; axis < this->Caps.size(); ++axis)
  {
    this->TrackAxis(axis, state.counts[axis], seconds, this->Noisy);
    this->Shown.places[KindOf(this->Caps[axis])] = this->Place(axis);
  }
}

void HostLink::TrackAxis(std::size_t axis, std::int32_t count, double seconds, bool hold)
{
  AxisTrack& track = this->Tracks[axis];
  const CapsMessage& caps = this->Caps[axis];
  // Counts wrap.
  const auto step = static_cast<std::int32_t>(
    static_cast<std::uint32_t>(count) - static_cast<std::uint32_t>(track.last));
  const double moved = std::abs(static_cast<double>(step) * caps.perCount);
  const bool glitch =
    track.known && moved > FastestOf(caps.kind) * seconds + std::abs(caps.perCount);
  this->Glitches += glitch ? 1 : 0;
  if (track.known && !glitch && !hold)
  {
    track.total += step;
  }
  track.last = count;
  track.known = true;
}

double HostLink::Place(std::size_t axis) const
{
  const AxisTrack& track = this->Tracks[axis];
  return track.base + this->Caps[axis].perCount * static_cast<double>(track.total);
}

void HostLink::HandlePong(const Message& message)
{
  PongMessage pong;
  if (Decode(message, pong) && pong.number == this->PingNumber)
  {
    this->Clocks.Add(pong.hostMicroseconds, this->Now, pong.deviceMicroseconds);
  }
}

void HostLink::HandleError(const Message& message)
{
  ErrorMessage error;
  if (!Decode(message, error))
  {
    return;
  }
  const std::string says = "The device at '" + this->Port.Name() + "' says: " + error.text;
  if (this->At != Phase::Running)
  {
    this->Refuse(says);
    return;
  }
  this->Confirmed = false;
  this->SetState(this->Shown.state, says);
}

void HostLink::HandleCalib(const Message& message)
{
  CalibMessage calib;
  if (this->At == Phase::Running && Decode(message, calib) && calib.axis < this->Caps.size())
  {
    AxisTrack& track = this->Tracks[calib.axis];
    track.base = this->Place(calib.axis);
    track.total = 0;
    this->Caps[calib.axis].perCount = calib.perCount;
  }
}

void HostLink::Zero(std::uint32_t kinds, std::uint64_t now)
{
  this->Now = now;
  ZeroMessage zero;
  for (std::size_t axis = 0; axis < this->Caps.size(); ++axis)
  {
    zero.axes |= (kinds >> KindOf(this->Caps[axis]) & 1U) << axis;
  }
  if (this->At == Phase::Running && zero.axes != 0)
  {
    this->Send(Encode(MessageType::Zero, zero));
  }
}

void HostLink::Watch()
{
  if (this->At != Phase::Running)
  {
    if (this->Now >= this->Due)
    {
      this->TryAgain("What is at '" + this->Port.Name() +
        "' does not answer as a device for this simulator does.");
    }
    return;
  }
  const std::uint64_t silence = this->Now - this->LastState;
  if (silence >= Lost)
  {
    this->SetState(DeviceState::Disconnected,
      "The device at '" + this->Port.Name() + "' is silent; it is waited for.");
    this->Confirmed = false;
    this->Tried = 0;
    this->Greet();
    return;
  }
  if (silence >= Stale && this->Shown.state == DeviceState::Running)
  {
    this->SetState(
      DeviceState::Stale, "The device at '" + this->Port.Name() + "' is silent; its pose is held.");
  }
  this->WatchErrors();
}

void HostLink::WatchErrors()
{
  if (this->Now - this->WindowBegan < ErrorWindow)
  {
    return;
  }
  const DecoderCounts& counts = this->Decoder.Counts();
  const DecoderCounts& before = this->WindowStart;
  const std::uint64_t damaged = counts.damaged + counts.overlong - before.damaged - before.overlong;
  // A damaged frame leaves a gap as well.
  const double bad = static_cast<double>(std::max(damaged, counts.lost - before.lost));
  const double good = static_cast<double>(counts.frames - before.frames);
  const double seconds = 1e-6 * static_cast<double>(this->Now - this->WindowBegan);
  this->ErrorsPerSecond = bad / seconds;
  this->WindowStart = counts;
  this->WindowBegan = this->Now;
  const bool noisy = bad > MostErrors * (good + bad);
  if (noisy && !this->Noisy)
  {
    this->SetState(DeviceState::Stale,
      "The line to the device at '" + this->Port.Name() + "' is disturbed; its pose is held.");
  }
  else if (!noisy && this->Noisy && this->Now - this->LastState < Stale)
  {
    this->SetDriving();
  }
  this->Noisy = noisy;
}

void HostLink::Talk(const PhysicsWord& physics)
{
  if (this->Outgoing.size() > MostOutgoing) // the device does not read
  {
    return;
  }
  if (this->Now >= this->NextPing)
  {
    this->NextPing = this->Now + Ping;
    this->Send(Encode(PingMessage{ ++this->PingNumber, this->Now }));
  }
  if (this->Confirming)
  {
    this->Confirming = false;
    this->Confirmed = true;
    this->SendStart(); // arms motors that have relaxed
  }
  // Who does not hear from a sound simulation lets go by itself.
  const std::uint64_t age = this->Now - std::min(this->Now, physics.stamp);
  if (!physics.alive || age > PhysicsOverrun)
  {
    return;
  }
  const std::uint64_t pause = this->Now - this->LastSent;
  if (physics.hasForces && physics.forces.tick != this->LastForceTick && this->HasMotors() &&
    pause >= Force)
  {
    this->SendForces(physics.forces);
    this->LastSent = this->Now;
    this->LastTick = physics.tick;
  }
  else if (physics.tick != this->LastTick && pause >= Heartbeat)
  {
    this->Send(Encode(HeartbeatMessage{ static_cast<std::uint32_t>(physics.tick) }));
    this->LastSent = this->Now;
    this->LastTick = physics.tick;
  }
}

bool HostLink::HasMotors() const
{
  return std::any_of(this->Caps.begin(), this->Caps.end(),
    [](const CapsMessage& caps) { return MotorOf(caps.kind) >= 0 && caps.maxForce > 0.0F; });
}

void HostLink::SendForces(const ForceFrame& forces)
{
  constexpr double Metre = 1000.0; // mm
  const std::array<double, 4> wanted{ forces.wireForce, forces.catheterForce,
    forces.wireTorque / Metre, forces.catheterTorque / Metre };
  const bool allowed = this->Confirmed && this->Shown.state == DeviceState::Running;
  const double seconds = std::min(0.02, 1e-6 * static_cast<double>(this->Now - this->LastForce));
  std::array<double, 4> next{};
  for (const CapsMessage& caps : this->Caps)
  {
    const int motor = MotorOf(caps.kind);
    if (motor >= 0 && allowed)
    {
      const auto n = static_cast<std::size_t>(motor);
      const double most = caps.maxForce;
      const double rise = ForceRise * most * seconds;
      const double value = std::clamp(wanted[n], -most, most);
      next[n] = std::clamp(value, this->Applied[n] - rise, this->Applied[n] + rise);
    }
  }
  this->Applied = next;
  ForceMessage force;
  force.tick = static_cast<std::uint32_t>(forces.tick);
  force.validMilliseconds = std::clamp<std::uint16_t>(forces.validMilliseconds, 1, 1000);
  force.force = { static_cast<float>(next[0]), static_cast<float>(next[1]) };
  force.torque = { static_cast<float>(next[2]), static_cast<float>(next[3]) };
  this->Send(Encode(force));
  this->LastForce = this->Now;
  this->LastForceTick = forces.tick;
}

void HostLink::Send(const Message& message)
{
  const WireFrame wire = this->Sender.Send(message, this->Now);
  this->Outgoing.insert(this->Outgoing.end(), wire.bytes.begin(),
    wire.bytes.begin() + static_cast<std::ptrdiff_t>(wire.size));
}

void HostLink::WritePort()
{
  if (this->Outgoing.empty())
  {
    return;
  }
  const int size = this->Port.Write(this->Outgoing.data(), this->Outgoing.size());
  if (size < 0)
  {
    this->Drop(DeviceState::Disconnected, "'" + this->Port.Name() + "' is gone; it is waited for.",
      this->At == Phase::Running);
    return;
  }
  this->Outgoing.erase(this->Outgoing.begin(), this->Outgoing.begin() + size);
}

DeviceStatus HostLink::Status() const
{
  DeviceStatus status;
  status.state = this->Shown.state;
  status.text = this->Text;
  status.awaitsForces = this->At == Phase::Running && this->HasMotors() && !this->Confirmed;
  status.errorsPerSecond = this->ErrorsPerSecond;
  status.glitches = this->Glitches;
  return status;
}
}
