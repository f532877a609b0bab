#include "ScriptedDevice.h"

#include <utility>

namespace coronary
{
ScriptedDevice::ScriptedDevice(DeviceScenario scenario)
  : Scenario(std::move(scenario))
  , Emulated(this->Scenario.device)
{
}

double ScriptedDevice::Seconds() const
{
  return this->HasBegun ? 1e-6 * static_cast<double>(this->Now - this->Began) : 0.0;
}

void ScriptedDevice::Step(std::uint64_t now)
{
  this->Now = now;
  if (!this->HasBegun && this->Emulated.Now() == EmulatedDevice::State::Streaming)
  {
    this->HasBegun = true;
    this->Began = now;
  }
  const double seconds = this->Seconds();
  const std::vector<DeviceFault>& faults = this->Scenario.faults;
  while (this->HasBegun && this->NextFault < faults.size() && faults[this->NextFault].at <= seconds)
  {
    this->Begin(faults[this->NextFault++]);
  }
  this->Emulated.Hands() = this->Scenario.At(seconds);
  this->Emulated.Step(now);
  for (const WireFrame& frame : this->Emulated.TakeFrames())
  {
    this->Pass(frame);
  }
}

void ScriptedDevice::Begin(const DeviceFault& fault)
{
  const auto lasting = static_cast<std::uint64_t>(1000.0 * fault.milliseconds);
  switch (fault.kind)
  {
    case FaultKind::DropBytes:
      this->Dropping += fault.count;
      break;
    case FaultKind::FlipBits:
      this->Flipping += fault.count;
      break;
    case FaultKind::Duplicate:
      this->Duplicating += fault.count;
      break;
    case FaultKind::Reorder:
      this->Reordering += fault.count;
      break;
    case FaultKind::Stop:
      this->SilentUntil = this->Now + lasting;
      break;
    case FaultKind::Close:
      this->PluggedAgain = this->Now + lasting;
      this->Gone = lasting == 0;
      break;
    case FaultKind::JumpCounts:
      this->Emulated.JumpCounts(static_cast<std::int32_t>(fault.count));
      break;
    case FaultKind::Rate:
      this->Emulated.Settings().rate = static_cast<std::uint16_t>(fault.count);
      break;
    case FaultKind::Garbage:
      for (std::int64_t n = 0; n < fault.count; ++n)
      {
        this->Bytes.push_back(static_cast<std::uint8_t>(this->Random.Bits()));
      }
      break;
    case FaultKind::WrongVersion:
      this->Emulated.Settings().major = ProtocolMajor + 1;
      break;
    case FaultKind::WrongMagic:
      this->Emulated.Settings().wrongMagic = true;
      break;
  }
}

void ScriptedDevice::Pass(const WireFrame& frame)
{
  if (this->Now < this->SilentUntil || !this->IsPlugged())
  {
    return;
  }
  WireFrame sent = frame;
  if (this->Flipping > 0)
  {
    --this->Flipping;
    const std::uint64_t bit = this->Random.Bits() % (8 * (sent.size - 1));
    std::uint8_t& byte = sent.bytes[bit / 8];
    byte = static_cast<std::uint8_t>(byte ^ (1U << bit % 8));
  }
  const auto put = [this](const WireFrame& wire)
  {
    for (std::size_t n = 0; n < wire.size; ++n)
    {
      if (this->Dropping > 0)
      {
        --this->Dropping;
        continue;
      }
      this->Bytes.push_back(wire.bytes[n]);
    }
  };
  if (this->Reordering > 0 && this->HeldBack.size == 0)
  {
    --this->Reordering;
    this->HeldBack = sent;
    return;
  }
  put(sent);
  if (this->Duplicating > 0)
  {
    --this->Duplicating;
    put(sent);
  }
  if (this->HeldBack.size > 0)
  {
    put(std::exchange(this->HeldBack, {}));
  }
}

std::vector<std::uint8_t> ScriptedDevice::TakeBytes()
{
  return std::exchange(this->Bytes, {});
}
}
