// What comes over the wire from hardware, and what hardware gets.
#include "FuzzHarness.h"

#include "DevicePort.h"
#include "DeviceProtocol.h"
#include "EmulatedDevice.h"
#include "GamepadDevice.h"
#include "HostLink.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace coronary;

namespace fuzzing
{
namespace
{
const std::uint8_t* Data(const std::string& bytes)
{
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}

std::string Wire(const Message& message)
{
  FrameSender sender;
  const WireFrame frame = sender.Send(message, 1000);
  return { frame.bytes.begin(), frame.bytes.begin() + static_cast<std::ptrdiff_t>(frame.size) };
}

template <typename T>
bool Decodes(const Message& message)
{
  T value;
  return Decode(message, value);
}

void DecodeAll(const Message& message)
{
  Require(message.size <= MostPayload, "a payload that is too large");
  const int taken = Decodes<HelloMessage>(message) + Decodes<HelloAckMessage>(message) +
    Decodes<CapsMessage>(message) + Decodes<StartMessage>(message) +
    Decodes<StateMessage>(message) + Decodes<ForceMessage>(message) +
    Decodes<HeartbeatMessage>(message) + Decodes<PingMessage>(message) +
    Decodes<PongMessage>(message) + Decodes<ErrorMessage>(message) + Decodes<ZeroMessage>(message) +
    Decodes<CalibMessage>(message);
  Require(taken <= 1, "a message that is several");
}

/// One of each type that has a payload.
std::vector<Message> Examples()
{
  CapsMessage caps;
  caps.kind = AxisKind::WireAdvance;
  caps.unit = AxisUnit::Millimetre;
  caps.perCount = 0.01;
  caps.maxForce = 5.0F;
  StateMessage state;
  state.axes = 1;
  state.counts[0] = 100;
  return { Encode(HelloMessage{ 1, 1, 42, "host" }),
    Encode(HelloAckMessage{ 1, 0, 42, "serial", "1" }), Encode(caps),
    Encode(StartMessage{ 1000, 20, 42 }), Encode(state),
    Encode(ForceMessage{ 1, 20, { 1.0F, 2.0F }, { 0.1F, 0.2F } }), Encode(HeartbeatMessage{ 7 }),
    Encode(PingMessage{ 1, 2 }), Encode(PongMessage{ 1, 2, 3 }),
    Encode(ErrorMessage{ DeviceError::Hardware, "hot" }),
    Encode(MessageType::ZeroAck, ZeroMessage{ 3 }), Encode(CalibMessage{ 0, 0.02 }), EncodeStop() };
}

// The decoder -----------------------------------------------------------------------------------------------------------
void ReadFrames(const std::string& bytes)
{
  FrameDecoder decoder;
  for (const char byte : bytes)
  {
    if (decoder.Push(static_cast<std::uint8_t>(byte)))
    {
      DecodeAll(decoder.Last());
    }
  }
}

std::vector<std::string> FrameSeeds()
{
  std::string all;
  for (const Message& message : Examples())
  {
    all += Wire(message);
  }
  return { all, Wire(Examples().front()) };
}

/// Without the frame: a byte of the type, then the payload.
void ReadPayload(const std::string& bytes)
{
  Message message;
  message.type = static_cast<MessageType>(bytes.empty() ? 0 : bytes.front());
  message.size = std::min(MostPayload, bytes.empty() ? 0 : bytes.size() - 1);
  std::copy_n(bytes.begin() + (bytes.empty() ? 0 : 1), message.size, message.payload.begin());
  DecodeAll(message);
}

std::vector<std::string> PayloadSeeds()
{
  std::vector<std::string> seeds;
  for (const Message& message : Examples())
  {
    seeds.push_back(std::string(1, static_cast<char>(message.type)) +
      std::string(message.payload.begin(),
        message.payload.begin() + static_cast<std::ptrdiff_t>(message.size)));
  }
  return seeds;
}

// The two sides of the link -----------------------------------------------------------------------------------------------
/// What the other side says is written by the harness; what the host says is looked at for its nonce.
class FedPort : public DevicePort
{
public:
  const std::string& Name() const override { return this->Path; }
  PortOpening Open(std::string& /*why*/) override { return PortOpening::Open; }
  void Close() override { this->Coming.clear(); }
  int Read(std::uint8_t* bytes, std::size_t most) override
  {
    const std::size_t size = std::min(most, this->Coming.size());
    std::copy_n(this->Coming.begin(), size, bytes);
    this->Coming.erase(0, size);
    return static_cast<int>(size);
  }
  int Write(const std::uint8_t* bytes, std::size_t size) override
  {
    for (std::size_t n = 0; n < size; ++n)
    {
      HelloMessage hello;
      if (this->Heard.Push(bytes[n]) && Decode(this->Heard.Last(), hello))
      {
        this->Nonce = hello.nonce;
      }
    }
    return static_cast<int>(size);
  }
  void Wait(std::uint64_t /*microseconds*/) override {}

  std::string Coming;
  std::uint32_t Nonce = 0;

private:
  std::string Path = "fed";
  FrameDecoder Heard;
};

enum Step : char
{
  Greet = 0,  ///< a right answer to the HELLO
  Frame = 1,  ///< byte of the type, byte of the size, payload: as a whole frame
  Bytes = 2,  ///< byte of the size, bytes
  Passing = 3 ///< byte: milliseconds
};

/// Goes through the steps that the bytes are. @param say  bytes to the other side  @param wait  microseconds
template <typename Say, typename Wait>
void ForSteps(const std::string& bytes, std::uint32_t* nonce, const Say& say, const Wait& wait)
{
  FrameSender sender;
  std::uint64_t now = 0;
  const auto send = [&](const Message& message)
  {
    const WireFrame frame = sender.Send(message, now);
    say(std::string(
      frame.bytes.begin(), frame.bytes.begin() + static_cast<std::ptrdiff_t>(frame.size)));
  };
  for (std::size_t at = 0; at + 2 <= bytes.size();)
  {
    const auto step = static_cast<Step>(bytes[at++] & 3);
    const auto value = static_cast<unsigned char>(bytes[at++]);
    if (step == Greet)
    {
      sender.Reset();
      send(Encode(HelloAckMessage{ 1, value, nonce ? *nonce : 0, "serial", "1" }));
    }
    else if (step == Frame)
    {
      const std::size_t size = at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0;
      const std::string payload = at < bytes.size() ? bytes.substr(at + 1, size) : std::string();
      at += 1 + payload.size();
      Message message;
      message.type = static_cast<MessageType>(value);
      message.size = std::min(MostPayload, payload.size());
      std::copy_n(payload.begin(), message.size, message.payload.begin());
      send(message);
    }
    else if (step == Bytes)
    {
      say(bytes.substr(at, value));
      at += std::min<std::size_t>(value, bytes.size() - at);
    }
    else
    {
      now += 1000U * value;
      wait(1000U * value);
    }
  }
}

std::string FrameStep(const Message& message)
{
  return std::string{ Frame, static_cast<char>(message.type), static_cast<char>(message.size) } +
    std::string(
      message.payload.begin(), message.payload.begin() + static_cast<std::ptrdiff_t>(message.size));
}

void TalkToHost(const std::string& bytes)
{
  FedPort port;
  HostLink link(port);
  std::uint64_t now = 1000;
  std::uint64_t tick = 0;
  const auto step = [&]
  {
    PhysicsWord physics;
    physics.tick = ++tick;
    physics.stamp = now;
    physics.alive = true;
    link.Step(now, physics);
    for (const double place : link.Snapshot().places)
    {
      Require(std::isfinite(place), "a place that is nowhere");
    }
  };
  step();
  ForSteps(
    bytes, &port.Nonce,
    [&](const std::string& said)
    {
      port.Coming += said;
      now += 100;
      step();
    },
    [&](std::uint64_t wait)
    {
      now += wait;
      step();
    });
  Require(!link.Status().text.empty(), "a state that says nothing");
  link.Close(now);
}

std::vector<std::string> HostSeeds()
{
  std::vector<Message> examples = Examples();
  std::string driving =
    std::string{ Greet, 0 } + FrameStep(examples[2]) + std::string{ Passing, 1 };
  for (int n = 0; n < 4; ++n)
  {
    driving += FrameStep(examples[4]) + std::string{ Passing, 1 };
  }
  for (const Message& message : examples)
  {
    driving += FrameStep(message);
  }
  return { driving, std::string{ Greet, 0, Bytes, 2, 1, 0, Passing, 120 } + driving };
}

void TalkToDevice(const std::string& bytes)
{
  EmulatedDevice device;
  std::uint64_t now = 1000;
  ForSteps(
    bytes, nullptr,
    [&](const std::string& said)
    {
      device.Receive(Data(said), said.size(), now);
      device.Step(now);
      device.TakeFrames();
    },
    [&](std::uint64_t wait)
    {
      now += wait;
      device.Step(now);
      device.TakeFrames();
    });
}

std::vector<std::string> DeviceSeeds()
{
  std::string all;
  for (const Message& message : Examples())
  {
    all += FrameStep(message) + std::string{ Passing, 2 };
  }
  return { all };
}

// Game controllers --------------------------------------------------------------------------------------------------------
void FeedGamepad(const std::string& bytes)
{
  GamepadDecoder decoder;
  for (std::size_t at = 0; at + 8 <= bytes.size(); at += 8)
  {
    std::uint16_t type = 0;
    std::uint16_t code = 0;
    std::int32_t value = 0;
    std::memcpy(&type, &bytes[at], 2);
    std::memcpy(&code, &bytes[at + 2], 2);
    std::memcpy(&value, &bytes[at + 4], 4);
    if (type == 0x7fff)
    {
      decoder.SetRange(code, value, value / 2);
      decoder.SetRange(code, value / 3, value);
      continue;
    }
    decoder.Feed(type, code, value);
    const GamepadState& state = decoder.State();
    for (const double deflection : { state.leftX, state.leftY, state.rightX, state.rightY,
           state.leftTrigger, state.rightTrigger, state.padX, state.padY })
    {
      Require(std::abs(deflection) <= 1.0, "a stick that is beyond its end");
    }
    GamepadWishes(state, {});
    GamepadPedals(state, 1U);
  }
}

std::vector<std::string> GamepadSeeds()
{
  const auto event = [](std::uint16_t type, std::uint16_t code, std::int32_t value)
  {
    std::string bytes(8, '\0');
    std::memcpy(&bytes[0], &type, 2);
    std::memcpy(&bytes[2], &code, 2);
    std::memcpy(&bytes[4], &value, 4);
    return bytes;
  };
  return { event(0x7fff, 0, 255) + event(3, 0, 200) + event(3, 1, -32768) + event(1, 304, 1) +
    event(3, 16, 1) + event(0, 0, 0) + event(0, 3, 0) + event(3, 5, 99) + event(0, 0, 0) };
}
}

std::vector<Harness> DeviceHarnesses()
{
  return {
    { "device-frames", ReadFrames, FrameSeeds },
    { "device-payload", ReadPayload, PayloadSeeds },
    { "device-to-host", TalkToHost, HostSeeds },
    { "host-to-device", TalkToDevice, DeviceSeeds },
    { "gamepad", FeedGamepad, GamepadSeeds },
  };
}
}
