#include "DeviceProtocol.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace coronary
{
namespace
{
constexpr std::size_t NameSize = 16;
constexpr std::size_t ErrorTextSize = 200;

class PayloadWriter
{
public:
  explicit PayloadWriter(MessageType type) { this->Made.type = type; }

  void Whole(std::uint64_t value, int bytes)
  {
    for (int n = 0; n < bytes; ++n)
    {
      this->Made.payload[this->Made.size++] = static_cast<std::uint8_t>(value >> (8 * n));
    }
  }

  void Real(double value)
  {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    this->Whole(bits, 8);
  }

  void Real(float value)
  {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    this->Whole(bits, 4);
  }

  void Magic()
  {
    for (const char letter : ProtocolMagic)
    {
      this->Whole(static_cast<std::uint8_t>(letter), 1);
    }
  }

  /// Filled up with 0 to `room`.
  void Text(const std::string& text, std::size_t room)
  {
    for (std::size_t n = 0; n < room; ++n)
    {
      this->Whole(n < text.size() ? static_cast<std::uint8_t>(text[n]) : 0, 1);
    }
  }

  const Message& Done() const { return this->Made; }

private:
  Message Made;
};

/// Reads on behind the end as 0, and knows that it did.
class PayloadReader
{
public:
  PayloadReader(const Message& message, MessageType type)
    : From(message)
    , Fits(message.type == type)
  {
  }

  std::uint64_t Whole(int bytes)
  {
    std::uint64_t value = 0;
    for (int n = 0; n < bytes; ++n)
    {
      this->Fits = this->Fits && this->At < this->From.size;
      const std::uint8_t byte = this->Fits ? this->From.payload[this->At] : 0;
      ++this->At;
      value |= static_cast<std::uint64_t>(byte) << (8 * n);
    }
    return value;
  }

  template <typename T>
  void Take(T& value)
  {
    value = static_cast<T>(this->Whole(sizeof(T)));
  }

  void Take(double& value)
  {
    const std::uint64_t bits = this->Whole(8);
    std::memcpy(&value, &bits, sizeof(value));
    this->Fits = this->Fits && std::isfinite(value);
  }

  void Take(float& value)
  {
    const auto bits = static_cast<std::uint32_t>(this->Whole(4));
    std::memcpy(&value, &bits, sizeof(value));
    this->Fits = this->Fits && std::isfinite(value);
  }

  void Skip(int bytes) { this->Whole(bytes); }

  void Magic()
  {
    for (const char letter : ProtocolMagic)
    {
      this->Require(this->Whole(1) == static_cast<std::uint8_t>(letter));
    }
  }

  /// Up to its first 0; what is not printable ASCII becomes '?': it is shown to people.
  std::string Text(std::size_t room)
  {
    std::string text;
    bool over = false;
    for (std::size_t n = 0; n < room; ++n)
    {
      const auto letter = static_cast<char>(this->Whole(1));
      over = over || letter == '\0';
      if (!over)
      {
        text.push_back(letter >= ' ' && letter <= '~' ? letter : '?');
      }
    }
    return text;
  }

  std::size_t Left() const { return this->From.size - std::min(this->From.size, this->At); }

  void Require(bool condition) { this->Fits = this->Fits && condition; }
  bool Good() const { return this->Fits; }

private:
  const Message& From;
  std::size_t At = 0;
  bool Fits;
};

std::uint64_t Little(const std::uint8_t* bytes, int size)
{
  std::uint64_t value = 0;
  for (int n = 0; n < size; ++n)
  {
    value |= static_cast<std::uint64_t>(bytes[n]) << (8 * n);
  }
  return value;
}

void PutLittle(std::uint8_t* bytes, std::uint64_t value, int size)
{
  for (int n = 0; n < size; ++n)
  {
    bytes[n] = static_cast<std::uint8_t>(value >> (8 * n));
  }
}

bool IsKnown(MessageType type)
{
  return type >= MessageType::Hello && type <= MessageType::Calib;
}

template <typename Enum>
Enum Limited(std::uint64_t value, Enum last)
{
  return value <= static_cast<std::uint64_t>(last) ? static_cast<Enum>(value) : Enum{};
}
}

WireFrame EncodeFrame(const Message& message)
{
  std::array<std::uint8_t, MostFrame> frame{};
  const std::size_t payload = std::min(message.size, MostPayload);
  frame[0] = static_cast<std::uint8_t>(message.type);
  frame[1] = message.flags;
  PutLittle(&frame[2], message.sequence, 2);
  PutLittle(&frame[4], message.microseconds, 4);
  std::copy_n(message.payload.begin(), payload, frame.begin() + FrameHead);
  const std::size_t covered = FrameHead + payload;
  PutLittle(&frame[covered], crc32(0, frame.data(), static_cast<uInt>(covered)), FrameTail);
  WireFrame wire;
  wire.size = CobsEncode(frame.data(), covered + FrameTail, wire.bytes.data());
  wire.bytes[wire.size++] = 0;
  return wire;
}

WireFrame FrameSender::Send(Message message, std::uint64_t microseconds)
{
  message.sequence = this->Sequence++;
  message.microseconds = static_cast<std::uint32_t>(microseconds);
  return EncodeFrame(message);
}

void FrameDecoder::Reset()
{
  this->Size = 0;
  this->Skipping = false;
  this->HasSequence = false;
}

bool FrameDecoder::Push(std::uint8_t byte)
{
  if (byte != 0)
  {
    if (this->Size == this->Bytes.size())
    {
      this->Counters.overlong += this->Skipping ? 0 : 1;
      this->Skipping = true;
      return false;
    }
    this->Bytes[this->Size++] = byte;
    return false;
  }
  const bool whole = this->Size > 0 && !this->Skipping;
  const bool wanted = whole && this->Complete();
  this->Size = 0;
  this->Skipping = false;
  return wanted;
}

bool FrameDecoder::Complete()
{
  const std::size_t size = CobsDecode(this->Bytes.data(), this->Size);
  const std::uint8_t* frame = this->Bytes.data();
  if (size < FrameHead + FrameTail || size > MostFrame ||
    Little(frame + size - FrameTail, FrameTail) !=
      crc32(0, frame, static_cast<uInt>(size - FrameTail)))
  {
    ++this->Counters.damaged;
    return false;
  }
  Message& message = this->Frame;
  message.type = static_cast<MessageType>(frame[0]);
  message.flags = frame[1];
  message.sequence = static_cast<std::uint16_t>(Little(frame + 2, 2));
  message.microseconds = static_cast<std::uint32_t>(Little(frame + 4, 4));
  message.size = size - FrameHead - FrameTail;
  std::copy_n(frame + FrameHead, message.size, message.payload.begin());
  ++this->Counters.frames;
  if (!this->InSequence())
  {
    ++this->Counters.repeated;
    return false;
  }
  if (!IsKnown(message.type))
  {
    ++this->Counters.unknown;
    return false;
  }
  return true;
}

bool FrameDecoder::InSequence()
{
  const Message& message = this->Frame;
  const bool anew = message.type == MessageType::Hello || message.type == MessageType::HelloAck;
  if (this->HasSequence && !anew)
  {
    const auto ahead = static_cast<std::uint16_t>(message.sequence - this->Expected);
    if (ahead >= 0x8000U)
    {
      return false;
    }
    this->Counters.lost += ahead;
  }
  this->HasSequence = true;
  this->Expected = static_cast<std::uint16_t>(message.sequence + 1);
  return true;
}

Message Encode(const HelloMessage& hello)
{
  PayloadWriter to(MessageType::Hello);
  to.Magic();
  to.Whole(hello.minMajor, 1);
  to.Whole(hello.maxMajor, 1);
  to.Whole(0, 2);
  to.Whole(hello.nonce, 4);
  to.Text(hello.host, NameSize);
  return to.Done();
}

bool Decode(const Message& message, HelloMessage& hello)
{
  PayloadReader from(message, MessageType::Hello);
  from.Magic();
  from.Take(hello.minMajor);
  from.Take(hello.maxMajor);
  from.Skip(2);
  from.Take(hello.nonce);
  hello.host = from.Text(NameSize);
  return from.Good();
}

Message Encode(const HelloAckMessage& ack)
{
  PayloadWriter to(MessageType::HelloAck);
  to.Magic();
  to.Whole(ack.major, 1);
  to.Whole(ack.minor, 1);
  to.Whole(0, 2);
  to.Whole(ack.nonce, 4);
  to.Text(ack.serial, NameSize);
  to.Text(ack.firmware, NameSize);
  return to.Done();
}

bool Decode(const Message& message, HelloAckMessage& ack)
{
  PayloadReader from(message, MessageType::HelloAck);
  from.Magic();
  from.Take(ack.major);
  from.Take(ack.minor);
  from.Skip(2);
  from.Take(ack.nonce);
  ack.serial = from.Text(NameSize);
  ack.firmware = from.Text(NameSize);
  return from.Good();
}

Message Encode(const CapsMessage& caps)
{
  PayloadWriter to(MessageType::Caps);
  to.Whole(caps.index, 1);
  to.Whole(caps.count, 1);
  to.Whole(static_cast<std::uint8_t>(caps.kind), 1);
  to.Whole(static_cast<std::uint8_t>(caps.unit), 1);
  to.Whole(caps.stateRate, 2);
  to.Whole(0, 2);
  to.Real(caps.perCount);
  to.Real(caps.low);
  to.Real(caps.high);
  to.Real(caps.resolution);
  to.Real(caps.maxForce);
  return to.Done();
}

bool Decode(const Message& message, CapsMessage& caps)
{
  PayloadReader from(message, MessageType::Caps);
  from.Take(caps.index);
  from.Take(caps.count);
  // An axis of a later version is there, and moves nothing.
  caps.kind = Limited(from.Whole(1), AxisKind::Inflation);
  caps.unit = Limited(from.Whole(1), AxisUnit::Atmosphere);
  from.Take(caps.stateRate);
  from.Skip(2);
  from.Take(caps.perCount);
  from.Take(caps.low);
  from.Take(caps.high);
  from.Take(caps.resolution);
  from.Take(caps.maxForce);
  from.Require(caps.count >= 1 && caps.count <= MostAxes && caps.index < caps.count);
  from.Require(caps.stateRate >= 1 && caps.perCount != 0.0 && caps.maxForce >= 0.0F);
  return from.Good();
}

Message Encode(const StartMessage& start)
{
  PayloadWriter to(MessageType::Start);
  to.Whole(start.rate, 2);
  to.Whole(start.watchdog, 2);
  to.Whole(start.nonce, 4);
  return to.Done();
}

bool Decode(const Message& message, StartMessage& start)
{
  PayloadReader from(message, MessageType::Start);
  from.Take(start.rate);
  from.Take(start.watchdog);
  from.Take(start.nonce);
  from.Require(start.rate >= 1 && start.watchdog >= 1);
  return from.Good();
}

Message EncodeStop()
{
  return PayloadWriter(MessageType::Stop).Done();
}

Message Encode(const StateMessage& state)
{
  PayloadWriter to(MessageType::State);
  to.Whole(state.tick, 4);
  to.Whole(state.pedals, 2);
  to.Whole(state.buttons, 2);
  to.Whole(state.status, 2);
  const std::size_t axes = std::min<std::size_t>(state.axes, MostAxes);
  to.Whole(axes, 1);
  to.Whole(0, 1);
  for (std::size_t n = 0; n < axes; ++n)
  {
    to.Whole(static_cast<std::uint32_t>(state.counts[n]), 4);
  }
  return to.Done();
}

bool Decode(const Message& message, StateMessage& state)
{
  PayloadReader from(message, MessageType::State);
  from.Take(state.tick);
  from.Take(state.pedals);
  from.Take(state.buttons);
  from.Take(state.status);
  from.Take(state.axes);
  from.Skip(1);
  from.Require(state.axes <= MostAxes);
  for (std::size_t n = 0; n < state.axes && from.Good(); ++n)
  {
    from.Take(state.counts[n]);
  }
  return from.Good();
}

Message Encode(const ForceMessage& force)
{
  PayloadWriter to(MessageType::Force);
  to.Whole(force.tick, 4);
  to.Whole(force.validMilliseconds, 2);
  to.Whole(0, 2);
  for (const float value : { force.force[0], force.force[1], force.torque[0], force.torque[1] })
  {
    to.Real(value);
  }
  return to.Done();
}

bool Decode(const Message& message, ForceMessage& force)
{
  PayloadReader from(message, MessageType::Force);
  from.Take(force.tick);
  from.Take(force.validMilliseconds);
  from.Skip(2);
  from.Take(force.force[0]);
  from.Take(force.force[1]);
  from.Take(force.torque[0]);
  from.Take(force.torque[1]);
  return from.Good();
}

Message Encode(const HeartbeatMessage& heartbeat)
{
  PayloadWriter to(MessageType::Heartbeat);
  to.Whole(heartbeat.tick, 4);
  return to.Done();
}

bool Decode(const Message& message, HeartbeatMessage& heartbeat)
{
  PayloadReader from(message, MessageType::Heartbeat);
  from.Take(heartbeat.tick);
  return from.Good();
}

Message Encode(const PingMessage& ping)
{
  PayloadWriter to(MessageType::Ping);
  to.Whole(ping.number, 4);
  to.Whole(ping.hostMicroseconds, 8);
  return to.Done();
}

bool Decode(const Message& message, PingMessage& ping)
{
  PayloadReader from(message, MessageType::Ping);
  from.Take(ping.number);
  from.Take(ping.hostMicroseconds);
  return from.Good();
}

Message Encode(const PongMessage& pong)
{
  PayloadWriter to(MessageType::Pong);
  to.Whole(pong.number, 4);
  to.Whole(pong.hostMicroseconds, 8);
  to.Whole(pong.deviceMicroseconds, 8);
  return to.Done();
}

bool Decode(const Message& message, PongMessage& pong)
{
  PayloadReader from(message, MessageType::Pong);
  from.Take(pong.number);
  from.Take(pong.hostMicroseconds);
  from.Take(pong.deviceMicroseconds);
  return from.Good();
}

Message Encode(const ErrorMessage& error)
{
  PayloadWriter to(MessageType::Error);
  to.Whole(static_cast<std::uint16_t>(error.code), 2);
  to.Text(error.text, std::min(error.text.size(), ErrorTextSize));
  return to.Done();
}

bool Decode(const Message& message, ErrorMessage& error)
{
  PayloadReader from(message, MessageType::Error);
  const std::uint64_t code = from.Whole(2);
  error.code = code == 0 || code > 4 ? DeviceError::Other : static_cast<DeviceError>(code);
  error.text = from.Text(std::min(from.Left(), ErrorTextSize));
  return from.Good();
}

Message Encode(MessageType zeroOrAck, const ZeroMessage& zero)
{
  PayloadWriter to(zeroOrAck);
  to.Whole(zero.axes, 4);
  return to.Done();
}

bool Decode(const Message& message, ZeroMessage& zero)
{
  const bool ack = message.type == MessageType::ZeroAck;
  PayloadReader from(message, ack ? MessageType::ZeroAck : MessageType::Zero);
  from.Take(zero.axes);
  return from.Good();
}

Message Encode(const CalibMessage& calib)
{
  PayloadWriter to(MessageType::Calib);
  to.Whole(calib.axis, 1);
  to.Whole(0, 3);
  to.Real(calib.perCount);
  return to.Done();
}

bool Decode(const Message& message, CalibMessage& calib)
{
  PayloadReader from(message, MessageType::Calib);
  from.Take(calib.axis);
  from.Skip(3);
  from.Take(calib.perCount);
  from.Require(calib.axis < MostAxes && calib.perCount != 0.0);
  return from.Good();
}
}
