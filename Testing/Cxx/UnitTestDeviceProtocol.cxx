// The wire protocol: known bytes, and everything that a line can do to a frame.
#include "Cobs.h"
#include "CounterRandom.h"
#include "DeviceProtocol.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <new>
#include <string>
#include <vector>

using namespace coronary;

namespace
{
std::atomic<std::uint64_t> Allocations{ 0 };

void* Allocate(std::size_t size)
{
  ++Allocations;
  if (void* memory = std::malloc(std::max<std::size_t>(1, size)))
  {
    return memory;
  }
  throw std::bad_alloc();
}
}

void* operator new(std::size_t size)
{
  return Allocate(size);
}

void* operator new[](std::size_t size)
{
  return Allocate(size);
}

// Where one of a pair is inlined and the other is not, GCC warns that they do not match.
[[gnu::noinline]] void operator delete(void* memory) noexcept
{
  std::free(memory);
}

[[gnu::noinline]] void operator delete[](void* memory) noexcept
{
  std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}

[[gnu::noinline]] void operator delete[](void* memory, std::size_t) noexcept
{
  std::free(memory);
}

namespace
{
using Bytes = std::vector<std::uint8_t>;

Bytes BytesOf(const WireFrame& wire)
{
  return { wire.bytes.begin(), wire.bytes.begin() + static_cast<std::ptrdiff_t>(wire.size) };
}

Bytes Cobs(const Bytes& from)
{
  Bytes to(CobsSize(from.size()));
  to.resize(CobsEncode(from.data(), from.size(), to.data()));
  return to;
}

StateMessage TestState()
{
  StateMessage state;
  state.tick = 0x01020304U;
  state.pedals = 5;
  state.buttons = 0x8001U;
  state.status = ForceClamped;
  state.axes = 10;
  for (std::size_t n = 0; n < state.axes; ++n)
  {
    state.counts[n] = static_cast<std::int32_t>(n * 100003U) - 300000;
  }
  state.counts[8] = std::numeric_limits<std::int32_t>::min();
  return state;
}

Message Numbered(Message message, std::uint16_t sequence)
{
  message.sequence = sequence;
  message.microseconds = 1000U * sequence;
  return message;
}

Bytes StateFrame(std::uint16_t sequence)
{
  return BytesOf(EncodeFrame(Numbered(Encode(TestState()), sequence)));
}

/// Sequences of the frames that are delivered.
std::vector<std::uint16_t> Decoded(FrameDecoder& decoder, const Bytes& bytes)
{
  std::vector<std::uint16_t> sequences;
  for (const std::uint8_t byte : bytes)
  {
    if (decoder.Push(byte))
    {
      sequences.push_back(decoder.Last().sequence);
    }
  }
  return sequences;
}

Bytes operator+(Bytes a, const Bytes& b)
{
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::string Hex(const Bytes& bytes)
{
  std::string text;
  for (const std::uint8_t byte : bytes)
  {
    char two[8];
    std::snprintf(two, sizeof(two), "%s%02x", text.empty() ? "" : " ", byte);
    text += two;
  }
  return text;
}

template <typename T>
T ThereAndBack(const T& value)
{
  FrameDecoder decoder;
  EXPECT_EQ(Decoded(decoder, BytesOf(EncodeFrame(Numbered(Encode(value), 3)))).size(), 1U);
  T back;
  EXPECT_TRUE(Decode(decoder.Last(), back));
  // More bytes are for later versions, fewer are none.
  Message longer = decoder.Last();
  longer.payload[longer.size++] = 0xAA;
  T same;
  EXPECT_TRUE(Decode(longer, same));
  Message shorter = decoder.Last();
  --shorter.size;
  T none;
  EXPECT_FALSE(Decode(shorter, none));
  return back;
}
}

TEST(Cobs, KnownBytes)
{
  EXPECT_EQ(Cobs({ 0x11, 0x00, 0x22 }), (Bytes{ 0x02, 0x11, 0x02, 0x22 }));
  EXPECT_EQ(Cobs({}), (Bytes{ 1 }));
  EXPECT_EQ(Cobs({ 0 }), (Bytes{ 1, 1 }));
  EXPECT_EQ(Cobs({ 0x11, 0x22, 0x33, 0x44 }), (Bytes{ 0x05, 0x11, 0x22, 0x33, 0x44 }));
  Bytes ones(254, 1);
  EXPECT_EQ(Cobs(ones), Bytes{ 255 } + ones);
  EXPECT_EQ(Cobs(ones + Bytes{ 7 }), Bytes{ 255 } + ones + (Bytes{ 2, 7 }));
  EXPECT_EQ(Cobs(ones + Bytes{ 0 }), Bytes{ 255 } + ones + (Bytes{ 1, 1 }));
}

TEST(Cobs, ThereAndBack)
{
  RandomStream random(1);
  for (std::size_t size = 1; size <= 600; ++size)
  {
    for (const unsigned zeros : { 0U, 2U, 250U })
    {
      Bytes bytes(size);
      for (std::uint8_t& byte : bytes)
      {
        byte = static_cast<std::uint8_t>(random.Bits() % 255U + 1U);
        byte = random.Bits() % 256U < zeros ? 0 : byte;
      }
      Bytes code = Cobs(bytes);
      ASSERT_LE(code.size(), CobsSize(size));
      ASSERT_EQ(std::count(code.begin(), code.end(), 0), 0);
      code.resize(CobsDecode(code.data(), code.size()));
      ASSERT_EQ(code, bytes) << size;
    }
  }
}

TEST(Cobs, WhatIsNoCode)
{
  for (Bytes bytes :
    { Bytes{ 0 }, Bytes{ 3, 1 }, Bytes{ 2, 0 }, Bytes{ 2, 1, 0 }, Bytes{ 255, 1 } })
  {
    EXPECT_EQ(CobsDecode(bytes.data(), bytes.size()), 0U) << Hex(bytes);
  }
}

TEST(DeviceProtocol, MessagesThereAndBack)
{
  const HelloMessage hello =
    ThereAndBack(HelloMessage{ 1, 3, 0xDEADBEEFU, "a name that is too long" });
  EXPECT_EQ(hello.maxMajor, 3);
  EXPECT_EQ(hello.nonce, 0xDEADBEEFU);
  EXPECT_EQ(hello.host, "a name that is t");
  const HelloAckMessage ack = ThereAndBack(HelloAckMessage{ 1, 7, 12, "S\n1", "fw" });
  EXPECT_EQ(ack.minor, 7);
  EXPECT_EQ(ack.serial, "S?1");
  CapsMessage caps;
  caps.index = 2;
  caps.count = 7;
  caps.kind = AxisKind::Syringe;
  caps.unit = AxisUnit::Millilitre;
  caps.stateRate = 500;
  caps.perCount = -0.001;
  caps.high = 20.0F;
  caps.maxForce = 1.5F;
  const CapsMessage capsBack = ThereAndBack(caps);
  EXPECT_EQ(capsBack.kind, AxisKind::Syringe);
  EXPECT_EQ(capsBack.unit, AxisUnit::Millilitre);
  EXPECT_EQ(capsBack.perCount, -0.001);
  EXPECT_EQ(capsBack.high, 20.0F);
  EXPECT_EQ(capsBack.maxForce, 1.5F);
  EXPECT_EQ(ThereAndBack(StartMessage{ 1000, 20, 99 }).nonce, 99U);
  const StateMessage state = ThereAndBack(TestState());
  EXPECT_EQ(state.tick, TestState().tick);
  EXPECT_EQ(state.buttons, 0x8001U);
  EXPECT_EQ(state.counts, TestState().counts);
  const ForceMessage force = ThereAndBack(ForceMessage{ 7, 15, { 1.25F, -2.0F }, { 0.5F, 0.0F } });
  EXPECT_EQ(force.force[1], -2.0F);
  EXPECT_EQ(force.torque[0], 0.5F);
  EXPECT_EQ(force.validMilliseconds, 15);
  EXPECT_EQ(ThereAndBack(HeartbeatMessage{ 0xFFFFFFFFU }).tick, 0xFFFFFFFFU);
  EXPECT_EQ(
    ThereAndBack(PingMessage{ 1, 0x0102030405060708U }).hostMicroseconds, 0x0102030405060708U);
  EXPECT_EQ(ThereAndBack(PongMessage{ 1, 2, 0xFFFFFFFFFFFFFFFFU }).deviceMicroseconds, ~0ULL);
  EXPECT_EQ(ThereAndBack(CalibMessage{ 3, 0.25 }).perCount, 0.25);
  const Message zero = Encode(MessageType::ZeroAck, ZeroMessage{ 5 });
  ZeroMessage zeroBack;
  EXPECT_TRUE(Decode(zero, zeroBack));
  EXPECT_EQ(zeroBack.axes, 5U);
  ErrorMessage error;
  EXPECT_TRUE(Decode(Encode(ErrorMessage{ DeviceError::Hardware, "motor too warm" }), error));
  EXPECT_EQ(error.code, DeviceError::Hardware);
  EXPECT_EQ(error.text, "motor too warm");
}

TEST(DeviceProtocol, ExamplesOfTheDocumentation)
{
  std::ifstream stream(DYNAMICCORONARY_SOURCE_DIR "/docs/reference/device-frames.md");
  const std::string page{ std::istreambuf_iterator<char>(stream), {} };
  ASSERT_FALSE(page.empty());
  HelloMessage hello;
  hello.nonce = 0x12345678U;
  hello.host = "DynamicCoronary";
  StateMessage state;
  state.tick = 7;
  state.pedals = 1;
  state.axes = 2;
  state.counts[0] = 1000;
  state.counts[1] = -3;
  for (const Message& example :
    { Numbered(Encode(hello), 0), Numbered(Encode(StartMessage{ 1000, 20, 0x12345678U }), 1),
      Numbered(Encode(state), 9), Numbered(Encode(HeartbeatMessage{ 7 }), 5),
      Numbered(Encode(ForceMessage{ 8, 20, { -0.5F, 0.0F }, { 0.0F, 0.0F } }), 6) })
  {
    const Bytes wire = BytesOf(EncodeFrame(example));
    Bytes frame(wire.begin(), wire.end() - 1);
    frame.resize(CobsDecode(frame.data(), frame.size()));
    EXPECT_NE(page.find("frame: " + Hex(frame) + "\n"), std::string::npos)
      << "frame: " << Hex(frame);
    EXPECT_NE(page.find("wire:  " + Hex(wire) + "\n"), std::string::npos) << "wire:  " << Hex(wire);
  }
}

TEST(DeviceProtocol, SizesOnTheWire)
{
  EXPECT_EQ(Encode(TestState()).size, 52U);
  EXPECT_EQ(StateFrame(1).size(), 66U);
  EXPECT_EQ(EncodeStop().size, 0U);
  EXPECT_EQ(Encode(ErrorMessage{ DeviceError::Other, std::string(500, 'x') }).size, 202U);
  StateMessage most;
  most.axes = 200;
  EXPECT_LE(Encode(most).size, MostPayload);
}

TEST(DeviceProtocol, WhatIsOutOfRangeIsRefused)
{
  const auto refused = [](auto value, std::size_t at, std::uint8_t byte)
  {
    Message message = Encode(value);
    message.payload[at] = byte;
    decltype(value) back;
    return !Decode(message, back);
  };
  EXPECT_TRUE(refused(HelloMessage{}, 0, 'X')); // magic
  EXPECT_TRUE(refused(HelloAckMessage{}, 3, 'X'));
  CapsMessage caps;
  caps.perCount = 1.0;
  EXPECT_FALSE(refused(caps, 0, 0));
  EXPECT_TRUE(refused(caps, 0, 1));          // index beyond count
  EXPECT_TRUE(refused(caps, 1, 0));          // no axes
  EXPECT_TRUE(refused(caps, 1, 200));        // too many
  EXPECT_TRUE(refused(CapsMessage{}, 0, 0)); // 0 per count
  caps.perCount = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(refused(caps, 0, 0));
  EXPECT_TRUE(refused(TestState(), 10, 17)); // more axes than there may be
  ForceMessage force;
  force.force[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(refused(force, 0, 0));
  HeartbeatMessage other;
  EXPECT_FALSE(Decode(Encode(PingMessage{ 1, 2 }), other));
}

TEST(FrameDecoder, ByteByByteAndSeveralAtOnce)
{
  FrameDecoder decoder;
  const Bytes bytes = StateFrame(5) + StateFrame(6) + StateFrame(7);
  EXPECT_EQ(Decoded(decoder, bytes), (std::vector<std::uint16_t>{ 5, 6, 7 }));
  EXPECT_EQ(decoder.Counts().frames, 3U);
  EXPECT_EQ(decoder.Counts().damaged + decoder.Counts().lost, 0U);
}

TEST(FrameDecoder, JunkInFront)
{
  FrameDecoder decoder;
  const Bytes junk{ 0xFF, 0x13, 0x37, 0x05, 0 };
  EXPECT_EQ(Decoded(decoder, junk + StateFrame(1)), std::vector<std::uint16_t>{ 1 });
  EXPECT_EQ(decoder.Counts().damaged, 1U);
  // Without a 0 in between the first frame goes with the junk, and no other.
  FrameDecoder again;
  EXPECT_EQ(
    Decoded(again, Bytes{ 9, 9 } + StateFrame(1) + StateFrame(2)), std::vector<std::uint16_t>{ 2 });
}

TEST(FrameDecoder, EveryBitFlippedIsRejected)
{
  const Bytes good = StateFrame(300);
  for (std::size_t bit = 0; bit < 8 * (good.size() - 1); ++bit)
  {
    Bytes bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << bit % 8));
    FrameDecoder decoder;
    EXPECT_TRUE(Decoded(decoder, bad).empty()) << "bit " << bit;
    EXPECT_GE(decoder.Counts().damaged, 1U);
    EXPECT_EQ(Decoded(decoder, good).size(), 1U) << "bit " << bit;
  }
  for (unsigned bit = 0; bit < 8; ++bit) // of the 0 at the end: joins the next frame
  {
    Bytes bad = good;
    bad.back() = static_cast<std::uint8_t>(1U << bit);
    FrameDecoder decoder;
    EXPECT_EQ(
      Decoded(decoder, bad + StateFrame(301) + StateFrame(302)), std::vector<std::uint16_t>{ 302 });
  }
}

TEST(FrameDecoder, TruncatedAtEveryByte)
{
  const Bytes good = StateFrame(8);
  for (std::size_t size = 0; size + 1 < good.size(); ++size)
  {
    FrameDecoder decoder;
    Bytes part(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
    part.push_back(0);
    EXPECT_TRUE(Decoded(decoder, part).empty()) << size;
    EXPECT_EQ(decoder.Counts().damaged, size == 0 ? 0U : 1U);
    EXPECT_EQ(Decoded(decoder, StateFrame(9)).size(), 1U);
  }
}

TEST(FrameDecoder, GapsRepetitionsAndOrder)
{
  FrameDecoder decoder;
  const Bytes bytes = StateFrame(65534) + StateFrame(65535) + StateFrame(65535) + StateFrame(2) +
    StateFrame(0) + StateFrame(3);
  EXPECT_EQ(Decoded(decoder, bytes), (std::vector<std::uint16_t>{ 65534, 65535, 2, 3 }));
  EXPECT_EQ(decoder.Counts().lost, 2U);
  EXPECT_EQ(decoder.Counts().repeated, 2U);
  const Bytes hello = BytesOf(EncodeFrame(Numbered(Encode(HelloMessage{}), 0)));
  EXPECT_EQ(Decoded(decoder, hello + StateFrame(1)).size(), 2U);
  EXPECT_EQ(decoder.Counts().lost, 2U);
}

TEST(FrameDecoder, UnknownTypesAndTooManyBytes)
{
  Message message = EncodeStop();
  message.type = static_cast<MessageType>(77);
  FrameDecoder decoder;
  EXPECT_TRUE(Decoded(decoder, BytesOf(EncodeFrame(message))).empty());
  EXPECT_EQ(decoder.Counts().unknown, 1U);
  EXPECT_TRUE(Decoded(decoder, Bytes(5000, 0x55)).empty());
  EXPECT_EQ(decoder.Counts().overlong, 1U);
  EXPECT_EQ(Decoded(decoder, Bytes{ 0 } + StateFrame(1)).size(), 1U);
  Message maximum = EncodeStop();
  maximum.flags = 1;
  maximum.sequence = 0x0101;
  maximum.microseconds = 0x01010101;
  maximum.size = MostPayload;
  maximum.payload.fill(0xFF);
  FrameDecoder other;
  const Bytes wire = BytesOf(EncodeFrame(maximum));
  EXPECT_EQ(wire.size(), MostWire);
  EXPECT_EQ(Decoded(other, wire).size(), 1U);
  EXPECT_EQ(other.Last().size, MostPayload);
}

TEST(FrameDecoder, AMillionRandomBuffers)
{
  RandomStream random(99);
  FrameDecoder decoder;
  std::array<std::uint8_t, 128> buffer{};
  const WireFrame good = EncodeFrame(Numbered(Encode(TestState()), 0));
  std::uint64_t delivered = 0;
  std::uint64_t sink = 0;
  const std::uint64_t before = Allocations;
  for (int round = 0; round < 1000000; ++round)
  {
    std::size_t size = random.Bits() % buffer.size();
    if (round % 4 == 0) // a real frame with a few bytes changed gets further in
    {
      size = good.size;
      std::copy_n(good.bytes.begin(), size, buffer.begin());
      buffer[random.Bits() % size] = static_cast<std::uint8_t>(random.Bits());
      buffer[size - 1] = 0;
    }
    else
    {
      for (std::size_t n = 0; n < size; n += 8)
      {
        const std::uint64_t bits = random.Bits();
        for (std::size_t k = n; k < std::min(size, n + 8); ++k)
        {
          const auto byte = static_cast<std::uint8_t>(bits >> (8 * (k - n)));
          buffer[k] = byte < 8 ? 0 : byte;
        }
      }
    }
    for (std::size_t n = 0; n < size; ++n)
    {
      if (decoder.Push(buffer[n]))
      {
        ++delivered;
        sink += decoder.Last().size;
      }
    }
  }
  EXPECT_EQ(Allocations, before);
  const DecoderCounts& counts = decoder.Counts();
  EXPECT_GT(counts.damaged, 500000U);
  // Only a change that changes nothing passes.
  EXPECT_LT(delivered, 5000U);
  EXPECT_EQ(sink, 52U * delivered);
}

TEST(FrameDecoder, PayloadsOfAllSortsAreNoTrouble)
{
  RandomStream random(5);
  for (int round = 0; round < 200000; ++round)
  {
    Message message;
    message.type = static_cast<MessageType>(random.Bits() % 16);
    message.size = random.Bits() % (MostPayload + 1);
    for (std::size_t n = 0; n < message.size; ++n)
    {
      message.payload[n] = static_cast<std::uint8_t>(random.Bits() % 3 == 0 ? 0 : random.Bits());
    }
    StateMessage state;
    if (Decode(message, state))
    {
      ASSERT_LE(state.axes, MostAxes);
    }
    CapsMessage caps;
    if (Decode(message, caps))
    {
      ASSERT_LT(caps.index, caps.count);
    }
    ErrorMessage error;
    if (Decode(message, error))
    {
      ASSERT_LE(error.text.size(), 200U);
    }
    HelloMessage hello;
    HelloAckMessage ack;
    ForceMessage force;
    Decode(message, hello);
    Decode(message, ack);
    Decode(message, force);
  }
}
