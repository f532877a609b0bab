/**
 * @file DeviceProtocol.h
 * @brief What goes over the wire between the simulator and a device. docs/device-protocol.md has it for those who build
 * devices.
 *
 * Numbers are little-endian, real numbers IEEE 754. A frame is
 *   u8 type | u8 flags | u16 sequence | u32 microseconds | payload | u32 CRC-32 of all before,
 * COBS-encoded, with a 0 behind it.
 */
#ifndef DynamicCoronary_DeviceProtocol_h
#define DynamicCoronary_DeviceProtocol_h

#include "Cobs.h"
#include "HandAxes.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace coronary
{
enum class MessageType : std::uint8_t
{
  Hello = 1,
  HelloAck = 2,
  Caps = 3,
  Start = 4,
  Stop = 5,
  State = 6,
  Force = 7,
  Heartbeat = 8,
  Ping = 9,
  Pong = 10,
  Error = 11,
  Zero = 12,
  ZeroAck = 13,
  Calib = 14
};

constexpr std::uint8_t ProtocolMajor = 1;
constexpr std::uint8_t ProtocolMinor = 0;
constexpr std::array<char, 4> ProtocolMagic{ 'P', 'C', 'I', 'D' };
constexpr std::size_t MostPayload = 250;
constexpr std::size_t FrameHead = 8;
constexpr std::size_t FrameTail = 4;
constexpr std::size_t MostFrame = FrameHead + MostPayload + FrameTail;
constexpr std::size_t MostWire = CobsSize(MostFrame) + 1; ///< with the 0 at its end
constexpr std::size_t MostAxes = 16;

/// One frame in the making or as it came; owns its bytes.
struct Message
{
  MessageType type = MessageType::Hello;
  std::uint8_t flags = 0;
  std::uint16_t sequence = 0;
  std::uint32_t microseconds = 0; ///< of the sender's clock, wraps after 71 minutes
  std::size_t size = 0;           ///< of the payload, bytes
  std::array<std::uint8_t, MostPayload> payload{};
};

/// As it goes over the wire.
struct WireFrame
{
  std::size_t size = 0;
  std::array<std::uint8_t, MostWire> bytes{};
};

/// @param message  its size is MostPayload at most
WireFrame EncodeFrame(const Message& message);

struct DecoderCounts
{
  std::uint64_t frames = 0;   ///< good ones, of any type
  std::uint64_t damaged = 0;  ///< broken COBS code, too short, or with another CRC
  std::uint64_t overlong = 0; ///< more bytes than a frame can have without a 0 among them
  std::uint64_t lost = 0;     ///< missing numbers between frames that came
  std::uint64_t repeated = 0; ///< frames that came twice, or after a later one: not delivered
  std::uint64_t unknown = 0;  ///< of a type that means nothing: not delivered
};

/**
 * Finds frames in a stream of bytes, in whatever pieces it comes, and goes on behind the next 0 after what is none.
 * Allocates nothing. HELLO and HELLO_ACK begin the sequence anew.
 */
class FrameDecoder
{
public:
  /// @return whether this byte completes a frame that is to be taken notice of: Last() has it until the next call
  bool Push(std::uint8_t byte);

  const Message& Last() const { return this->Frame; }
  const DecoderCounts& Counts() const { return this->Counters; }

  /// Forgets the bytes of a frame that has begun and the sequence, not the counts.
  void Reset();

private:
  bool Complete();
  bool InSequence();

  std::array<std::uint8_t, CobsSize(MostFrame)> Bytes{};
  std::size_t Size = 0;
  bool Skipping = false; ///< behind too many bytes
  bool HasSequence = false;
  std::uint16_t Expected = 0;
  Message Frame;
  DecoderCounts Counters;
};

struct HelloMessage
{
  std::uint8_t minMajor = ProtocolMajor;
  std::uint8_t maxMajor = ProtocolMajor;
  std::uint32_t nonce = 0;
  std::string host; ///< for people, 16 bytes at most, here and below
};

struct HelloAckMessage
{
  std::uint8_t major = ProtocolMajor;
  std::uint8_t minor = ProtocolMinor;
  std::uint32_t nonce = 0; ///< of the HELLO
  std::string serial;
  std::string firmware;
};

/// Of one axis; a device sends as many as it has axes.
struct CapsMessage
{
  std::uint8_t index = 0; ///< from 0; place of its count in STATE
  std::uint8_t count = 1; ///< axes in all, 1 to MostAxes
  AxisKind kind = AxisKind::None;
  AxisUnit unit = AxisUnit::None;
  std::uint16_t stateRate = 1000; ///< Hz: STATEs a second at most
  double perCount = 0.0;          ///< units a count, not 0
  float low = 0.0F;               ///< units; low = high: without end
  float high = 0.0F;
  float resolution = 0.0F; ///< units
  float maxForce = 0.0F;   ///< N for mm, N m for radians; 0: no motor
};

struct StartMessage
{
  std::uint16_t rate = 1000;   ///< Hz that are wanted
  std::uint16_t watchdog = 20; ///< ms
  std::uint32_t nonce = 0;     ///< of the HELLO
};

/// Bits of StateMessage::status.
enum DeviceStatusBit : std::uint16_t
{
  ForcesRelaxed = 1U, ///< the motors rest until the next START
  ForceClamped = 2U,  ///< a force was above the axis' maximum
  HardwareFault = 4U  ///< a fault that ERROR tells of
};

struct StateMessage
{
  std::uint32_t tick = 0; ///< of the last FORCE or HEARTBEAT that was accepted
  std::uint16_t pedals = 0;
  std::uint16_t buttons = 0;
  std::uint16_t status = 0; ///< bits of DeviceStatusBit
  std::uint8_t axes = 0;
  std::array<std::int32_t, MostAxes> counts{};
};

struct ForceMessage
{
  std::uint32_t tick = 0;
  std::uint16_t validMilliseconds = 20;
  std::array<float, 2> force{};  ///< N: wire, catheter
  std::array<float, 2> torque{}; ///< N m: wire, catheter
};

struct HeartbeatMessage
{
  std::uint32_t tick = 0;
};

struct PingMessage
{
  std::uint32_t number = 0;
  std::uint64_t hostMicroseconds = 0;
};

struct PongMessage
{
  std::uint32_t number = 0;           ///< of the PING
  std::uint64_t hostMicroseconds = 0; ///< of the PING
  std::uint64_t deviceMicroseconds = 0;
};

enum class DeviceError : std::uint16_t
{
  Version = 1, ///< no major that both know
  Nonce = 2,   ///< START without the nonce of the HELLO
  Hardware = 3,
  Other = 4
};

struct ErrorMessage
{
  DeviceError code = DeviceError::Other;
  std::string text; ///< for people, 200 bytes at most
};

/// ZERO and ZERO_ACK.
struct ZeroMessage
{
  std::uint32_t axes = 0; ///< bit n: axis n
};

/// Either way: what a count is from now on.
struct CalibMessage
{
  std::uint8_t axis = 0;
  double perCount = 0.0;
};

///@{
/// The message's type and payload; the rest is for the sender. Texts are cut to what there is room for.
template <typename Content>
Message Encode(const Content& content); ///< one of the structures above
Message Encode(const StateMessage& state);
Message Encode(const ErrorMessage& error);
Message Encode(MessageType zeroOrAck, const ZeroMessage& zero);
Message EncodeStop();
///@}

///@{
/// @return false for another type, a payload that is too short, another magic, numbers that are out of their range or
/// not finite. Bytes behind the payload that is known are for later versions, and ignored.
template <typename Content>
bool Decode(const Message& message, Content& content); ///< one of the structures above
bool Decode(const Message& message, ErrorMessage& error);
bool Decode(const Message& message, ZeroMessage& zero);
///@}

/// Numbers the frames of one direction.
class FrameSender
{
public:
  WireFrame Send(Message message, std::uint64_t microseconds);
  void Reset() { this->Sequence = 0; }

private:
  std::uint16_t Sequence = 0;
};
}

#endif
