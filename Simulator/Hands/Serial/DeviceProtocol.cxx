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

void PutLittle(std::uint8_t* bytes, std::uint64_t value, int size)
{
  for (int n = 0; n < size; ++n)
  {
    bytes[n] = static_cast<std::uint8_t>(value >> (8 * n));
  }
}

/// The same calls as PayloadReader's, so that a payload is described once for both directions.
class PayloadWriter
{
public:
  explicit PayloadWriter(MessageType type) { this->Made.type = type; }

  template <typename T>
  void Value(const T& value)
  {
    this->Whole(static_cast<std::uint64_t>(value), sizeof(T));
  }

  void Value(double value)
  {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    this->Whole(bits, 8);
  }

  void Value(float value)
  {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    this->Whole(bits, 4);
  }

  template <typename Enum>
  void Known(Enum value, Enum /*last*/)
  {
    this->Value(value);
  }

  void Skip(int bytes) { this->Whole(0, bytes); }

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

  void Require(bool /*condition*/) {}
  bool Good() const { return true; }
  const Message& Done() const { return this->Made; }

private:
  void Whole(std::uint64_t value, int bytes)
  {
    PutLittle(&this->Made.payload[this->Made.size], value, bytes);
    this->Made.size += static_cast<std::size_t>(bytes);
  }

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

  template <typename T>
  void Value(T& value)
  {
    value = static_cast<T>(this->Whole(sizeof(T)));
  }

  void Value(double& value)
  {
    const std::uint64_t bits = this->Whole(8);
    std::memcpy(&value, &bits, sizeof(value));
    this->Fits = this->Fits && std::isfinite(value);
  }

  void Value(float& value)
  {
    const auto bits = static_cast<std::uint32_t>(this->Whole(4));
    std::memcpy(&value, &bits, sizeof(value));
    this->Fits = this->Fits && std::isfinite(value);
  }

  /// What a later version has is there, and means nothing.
  template <typename Enum>
  void Known(Enum& value, Enum last)
  {
    const std::uint64_t code = this->Whole(sizeof(Enum));
    value = code <= static_cast<std::uint64_t>(last) ? static_cast<Enum>(code) : Enum{};
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
  void Text(std::string& text, std::size_t room)
  {
    text.clear();
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
  }

  std::size_t Left() const { return this->From.size - std::min(this->From.size, this->At); }

  void Require(bool condition) { this->Fits = this->Fits && condition; }
  bool Good() const { return this->Fits; }

private:
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

bool IsKnown(MessageType type)
{
  return type >= MessageType::Hello && type <= MessageType::Calib;
}

template <typename Payload>
void Fields(Payload& payload, HelloMessage& hello)
{
  payload.Magic();
  payload.Value(hello.minMajor);
  payload.Value(hello.maxMajor);
  payload.Skip(2);
  payload.Value(hello.nonce);
  payload.Text(hello.host, NameSize);
}

template <typename Payload>
void Fields(Payload& payload, HelloAckMessage& ack)
{
  payload.Magic();
  payload.Value(ack.major);
  payload.Value(ack.minor);
  payload.Skip(2);
  payload.Value(ack.nonce);
  payload.Text(ack.serial, NameSize);
  payload.Text(ack.firmware, NameSize);
}

template <typename Payload>
void Fields(Payload& payload, CapsMessage& caps)
{
  payload.Value(caps.index);
  payload.Value(caps.count);
  payload.Known(caps.kind, LastAxisKind);
  payload.Known(caps.unit, AxisUnit::Atmosphere);
  payload.Value(caps.stateRate);
  payload.Skip(2);
  payload.Value(caps.perCount);
  payload.Value(caps.low);
  payload.Value(caps.high);
  payload.Value(caps.resolution);
  payload.Value(caps.maxForce);
  payload.Require(caps.count >= 1 && caps.count <= MostAxes && caps.index < caps.count);
  payload.Require(caps.stateRate >= 1 && caps.perCount != 0.0 && caps.maxForce >= 0.0F);
}

template <typename Payload>
void Fields(Payload& payload, StartMessage& start)
{
  payload.Value(start.rate);
  payload.Value(start.watchdog);
  payload.Value(start.nonce);
  payload.Require(start.rate >= 1 && start.watchdog >= 1);
}

template <typename Payload>
void Fields(Payload& payload, StateMessage& state)
{
  payload.Value(state.tick);
  payload.Value(state.pedals);
  payload.Value(state.buttons);
  payload.Value(state.status);
  payload.Value(state.axes);
  payload.Skip(1);
  payload.Require(state.axes <= MostAxes);
  for (std::size_t n = 0; n < state.axes && payload.Good(); ++n)
  {
    payload.Value(state.counts[n]);
  }
}

template <typename Payload>
void Fields(Payload& payload, ForceMessage& force)
{
  payload.Value(force.tick);
  payload.Value(force.validMilliseconds);
  payload.Skip(2);
  for (float* value : { &force.force[0], &force.force[1], &force.torque[0], &force.torque[1] })
  {
    payload.Value(*value);
  }
}

template <typename Payload>
void Fields(Payload& payload, HeartbeatMessage& heartbeat)
{
  payload.Value(heartbeat.tick);
}

template <typename Payload>
void Fields(Payload& payload, PingMessage& ping)
{
  payload.Value(ping.number);
  payload.Value(ping.hostMicroseconds);
}

template <typename Payload>
void Fields(Payload& payload, PongMessage& pong)
{
  payload.Value(pong.number);
  payload.Value(pong.hostMicroseconds);
  payload.Value(pong.deviceMicroseconds);
}

template <typename Payload>
void Fields(Payload& payload, ZeroMessage& zero)
{
  payload.Value(zero.axes);
}

template <typename Payload>
void Fields(Payload& payload, CalibMessage& calib)
{
  payload.Value(calib.axis);
  payload.Skip(3);
  payload.Value(calib.perCount);
  payload.Require(calib.axis < MostAxes && calib.perCount != 0.0);
}

template <typename Content>
Message Encoded(MessageType type, Content content)
{
  PayloadWriter to(type);
  Fields(to, content);
  return to.Done();
}

template <typename Content>
bool Decoded(const Message& message, MessageType type, Content& content)
{
  PayloadReader from(message, type);
  Fields(from, content);
  return from.Good();
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

template <typename Content>
Message Encode(const Content& content)
{
  return Encoded(Content::Type, content);
}

template <typename Content>
bool Decode(const Message& message, Content& content)
{
  return Decoded(message, Content::Type, content);
}

template Message Encode(const HelloMessage&);
template bool Decode(const Message&, HelloMessage&);
template Message Encode(const HelloAckMessage&);
template bool Decode(const Message&, HelloAckMessage&);
template Message Encode(const CapsMessage&);
template bool Decode(const Message&, CapsMessage&);
template Message Encode(const StartMessage&);
template bool Decode(const Message&, StartMessage&);
template bool Decode(const Message&, StateMessage&);
template Message Encode(const ForceMessage&);
template bool Decode(const Message&, ForceMessage&);
template Message Encode(const HeartbeatMessage&);
template bool Decode(const Message&, HeartbeatMessage&);
template Message Encode(const PingMessage&);
template bool Decode(const Message&, PingMessage&);
template Message Encode(const PongMessage&);
template bool Decode(const Message&, PongMessage&);
template Message Encode(const CalibMessage&);
template bool Decode(const Message&, CalibMessage&);

Message Encode(const StateMessage& given)
{
  StateMessage state = given;
  state.axes = static_cast<std::uint8_t>(std::min<std::size_t>(state.axes, MostAxes));
  return Encoded(StateMessage::Type, state);
}

Message EncodeStop()
{
  return PayloadWriter(MessageType::Stop).Done();
}

Message Encode(const ErrorMessage& error)
{
  PayloadWriter to(MessageType::Error);
  to.Value(error.code);
  to.Text(error.text, std::min(error.text.size(), ErrorTextSize));
  return to.Done();
}

bool Decode(const Message& message, ErrorMessage& error)
{
  PayloadReader from(message, MessageType::Error);
  from.Known(error.code, DeviceError::Other);
  error.code = error.code == DeviceError{} ? DeviceError::Other : error.code;
  from.Text(error.text, std::min(from.Left(), ErrorTextSize));
  return from.Good();
}

Message Encode(MessageType zeroOrAck, const ZeroMessage& zero)
{
  return Encoded(zeroOrAck, zero);
}

bool Decode(const Message& message, ZeroMessage& zero)
{
  const bool ack = message.type == MessageType::ZeroAck;
  return Decoded(message, ack ? MessageType::ZeroAck : MessageType::Zero, zero);
}
}
