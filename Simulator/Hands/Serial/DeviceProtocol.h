/**
 * @file DeviceProtocol.h
 * @brief What goes over the wire between the simulator and a device. docs/device-protocol.md has it for those who build
 * devices.
 *
 * Numbers are little-endian, real numbers IEEE 754. A frame is
 *   u8 type | u8 flags | u16 sequence | u32 microseconds | payload | u32 CRC-32 of all before,
 * COBS-encoded, with a 0 behind it.
 */

/**
 * @page device-messages Messages of the device protocol
 *
 * Payloads are packed, without padding. Numbers are little-endian; `f32` and `f64` are IEEE 754.
 * Texts are ASCII, filled up with 0. Reserved fields are sent as 0 and ignored. Type, name, sender
 * and length:
 *
 * - 1, HELLO (host, 28 bytes): 4 bytes `PCID`; u8 lowest and u8 highest major version that the
 *   host knows; u16 reserved; u32 nonce, new for each connection; 16 bytes name of the host
 * - 2, HELLO_ACK (device, 44 bytes): 4 bytes `PCID`; u8 major version: 1; u8 minor version: 0; u16
 *   reserved; u32 nonce of the HELLO; 16 bytes serial number; 16 bytes firmware
 * - 3, CAPS (device, 32 bytes): one axis, see below
 * - 4, START (host, 8 bytes): u16 wanted STATEs a second; u16 watchdog, ms; u32 nonce of the HELLO
 * - 5, STOP (host, 0 bytes)
 * - 6, STATE (device, 12 + 4 n bytes): u32 tick of the last FORCE or HEARTBEAT taken; u16 pedals:
 *   1 fluoroscopy, 2 cine, 4 mask; u16 buttons, as the device numbers them; u16 status: 1 motors
 *   have relaxed, 2 a force was clamped, 4 fault; u8 number of axes n; u8 reserved; i32[n] counts
 * - 7, FORCE (host, 24 bytes): u32 tick; u16 validity, 1 to 1000 ms; u16 reserved; f32 N on the
 *   wire; f32 N on the catheter; f32 N m on the wire; f32 N m on the catheter
 * - 8, HEARTBEAT (host, 4 bytes): u32 tick
 * - 9, PING (host, 12 bytes): u32 number; u64 time of the host, microseconds
 * - 10, PONG (device, 20 bytes): u32 number and u64 time of the PING; u64 time of the device
 * - 11, ERROR (device, 2 + text bytes): u16: 1 version, 2 nonce, 3 hardware, 4 other; text for
 *   people, 200 bytes at most
 * - 12, ZERO (host, 4 bytes): u32, bit i: axis of index i
 * - 13, ZERO_ACK (device, 4 bytes): the same
 * - 14, CALIB (both, 12 bytes): u8 index of the axis; 3 bytes reserved; f64 units per count from
 *   now on
 *
 * **CAPS**, one for each axis, in any order: u8 index of the axis from 0, its place in STATE; u8
 * number of axes, 1 to 16, the same in all; u8 kind, each at most once, except 0; u8 unit: 1 mm, 2
 * radian, 3 mL, 4 atm; u16 STATEs a second, 100 to 1000; u16 reserved; f64 units per count, not 0,
 * negative reverses the direction; f32 lowest and f32 highest place (equal: without end); f32
 * resolution; f32 greatest force of the motor, N for mm, N m for radians, 0: no motor.
 *
 * Kinds of axes, and what is positive:
 *
 * - 1 wire, 3 catheter: advance (mm): into the patient
 * - 2 wire, 4 catheter: turning (radian): clockwise, seen in the forward direction
 * - 5 syringe (mL): pushed out
 * - 6 C-arm primary (radian): LAO
 * - 7 C-arm secondary (radian): cranial
 * - 8 source to detector (mm): away from the source
 * - 9, 10, 11 table (mm): isocentre to the patient's left, back, head
 * - 12 indeflator (atm): pressure
 * - 13 balloon catheter: advance (mm)
 * - 0 and unknown kinds: present, but moves nothing
 *
 * Only kinds 1 to 4 have motors in this version. Counts are absolute. They may start anywhere and
 * wrap: only differences count, so a lost state loses nothing. The frame's time is when they were
 * taken. Forces act on the hand, positive in the positive direction of the axis: negative against
 * a wire that is pushed in. After ZERO the device counts from 0 at the current place, and sends
 * ZERO_ACK before the first state that does. It answers a CALIB with the CALIB in effect, and may
 * send one by itself. Neither moves anything in the simulation.
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
  static constexpr MessageType Type = MessageType::Hello;

  std::uint8_t minMajor = ProtocolMajor;
  std::uint8_t maxMajor = ProtocolMajor;
  std::uint32_t nonce = 0;
  std::string host; ///< for people, 16 bytes at most, here and below
};

struct HelloAckMessage
{
  static constexpr MessageType Type = MessageType::HelloAck;

  std::uint8_t major = ProtocolMajor;
  std::uint8_t minor = ProtocolMinor;
  std::uint32_t nonce = 0; ///< of the HELLO
  std::string serial;
  std::string firmware;
};

/// Of one axis; a device sends as many as it has axes.
struct CapsMessage
{
  static constexpr MessageType Type = MessageType::Caps;

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
  static constexpr MessageType Type = MessageType::Start;

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
  static constexpr MessageType Type = MessageType::State;

  std::uint32_t tick = 0; ///< of the last FORCE or HEARTBEAT that was accepted
  std::uint16_t pedals = 0;
  std::uint16_t buttons = 0;
  std::uint16_t status = 0; ///< bits of DeviceStatusBit
  std::uint8_t axes = 0;
  std::array<std::int32_t, MostAxes> counts{};
};

struct ForceMessage
{
  static constexpr MessageType Type = MessageType::Force;

  std::uint32_t tick = 0;
  std::uint16_t validMilliseconds = 20;
  std::array<float, 2> force{};  ///< N: wire, catheter
  std::array<float, 2> torque{}; ///< N m: wire, catheter
};

struct HeartbeatMessage
{
  static constexpr MessageType Type = MessageType::Heartbeat;

  std::uint32_t tick = 0;
};

struct PingMessage
{
  static constexpr MessageType Type = MessageType::Ping;

  std::uint32_t number = 0;
  std::uint64_t hostMicroseconds = 0;
};

struct PongMessage
{
  static constexpr MessageType Type = MessageType::Pong;

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
  static constexpr MessageType Type = MessageType::Calib;

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
