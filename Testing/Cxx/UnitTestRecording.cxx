// .pcirec: exact bits there and back, and nothing that a file can do to the reader.
#include "Recording.h"

#include "Refusals.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <unistd.h>

#include <zlib.h>

namespace UnitTestRecording
{
using coronary::RecordedItem;
using coronary::RecordingReader;
using coronary::RecordingWriter;
using coronary::RecordType;
using coronary::SessionInput;
using Ending = coronary::RecordingReader::Ending;

namespace
{
coronary::RecordingHeader TestHeader()
{
  coronary::RecordingHeader header;
  header.build = "test 1";
  header.scenario = R"({"name":"somewhere","list":[1,2.5]})";
  header.meshHash = 0xFEDCBA9876543210U;
  header.seed = std::numeric_limits<std::uint64_t>::max();
  header.tickRate = 2000.0;
  header.started = "2026-01-02T03:04:05Z";
  return header;
}

SessionInput Advanced(double wirePosition)
{
  SessionInput input;
  input.drive.wirePosition = wirePosition;
  return input;
}

bool SameBits(const SessionInput& a, const SessionInput& b)
{
  const auto bits = [](const SessionInput& input)
  {
    const std::array<double, 11> values{ input.drive.wirePosition, input.drive.wireAngle,
      input.drive.catheterPosition, input.drive.catheterAngle, input.syringe, input.primary,
      input.secondary, input.sourceToDetector, input.table.x(), input.table.y(), input.table.z() };
    std::array<std::uint64_t, 11> as{};
    std::memcpy(as.data(), values.data(), sizeof(as));
    return as;
  };
  return bits(a) == bits(b) && a.pedals == b.pedals;
}

/// Even driving, pauses, jumps, and doubles of all kinds.
std::vector<SessionInput> TestInputs(std::size_t count)
{
  std::mt19937_64 random(7);
  std::vector<SessionInput> inputs;
  SessionInput now;
  for (std::size_t tick = 0; tick < count; ++tick)
  {
    const double t = static_cast<double>(tick) / 2000.0;
    if (tick % 700 < 400)
    {
      now.drive.wirePosition = 5.0 * t;
      now.drive.wireAngle = std::sin(t);
    }
    if (tick % 500 > 350)
    {
      now.syringe += 1e-3;
      now.primary = 0.1 * std::cos(t);
      now.table.z() = 3.0 * t;
    }
    now.pedals = tick % 300 < 100 ? 3U : tick % 1000 == 999 ? 0xFFFFFFFFU : 0U;
    if (tick % 97 == 3)
    {
      const std::uint64_t bits = random();
      std::memcpy(&now.drive.catheterAngle, &bits, sizeof(bits));
    }
    if (tick == 50)
    {
      now.drive.catheterPosition = -0.0;
    }
    if (tick == 51)
    {
      now.drive.catheterPosition = std::numeric_limits<double>::denorm_min();
    }
    inputs.push_back(now);
  }
  return inputs;
}

/// Inputs of `count` ticks with everything else that a recording can hold.
std::string Recorded(const std::vector<SessionInput>& inputs)
{
  std::ostringstream stream;
  RecordingWriter writer(stream, TestHeader());
  writer.Annotation(0, "begin: \xC3\xA4");
  for (std::size_t tick = 0; tick < inputs.size(); ++tick)
  {
    if (tick == 300)
    {
      writer.Event(tick, { coronary::RecordedEvent::HeartRate, 91.25 });
    }
    writer.Input(tick, inputs[tick]);
    if ((tick + 1) % 500 == 0)
    {
      writer.StateHash(tick + 1, 1000 + tick);
      writer.ImageHash(tick + 1, tick);
      writer.Force(tick + 1, { 0.25F, -1.5F, 3.0F, 4.0F });
    }
  }
  writer.Finish(inputs.size());
  return stream.str();
}

RecordingReader ReaderOf(const std::string& bytes)
{
  return RecordingReader(std::make_unique<std::istringstream>(bytes), "'memory'");
}

/// Reads all that can be read; false when not even the header is good.
bool ReadAll(const std::string& bytes, std::vector<RecordedItem>& items, Ending& ending)
{
  items.clear();
  try
  {
    RecordingReader reader = ReaderOf(bytes);
    RecordedItem item;
    while (reader.Next(item))
    {
      items.push_back(item);
    }
    ending = reader.HowEnded();
    EXPECT_NE(ending, Ending::NotYet);
    EXPECT_LE(reader.Bytes(), bytes.size());
    return true;
  }
  catch (const std::runtime_error&)
  {
    return false;
  }
}

bool Same(const RecordedItem& a, const RecordedItem& b)
{
  if (a.type != b.type || a.tick != b.tick)
  {
    return false;
  }
  switch (a.type)
  {
    case RecordType::Input:
      return SameBits(a.input, b.input);
    case RecordType::Force:
      return std::memcmp(&a.forces, &b.forces, sizeof(a.forces)) == 0;
    case RecordType::Event:
      return a.event.kind == b.event.kind && a.event.value == b.event.value;
    case RecordType::Annotation:
      return a.text == b.text;
    case RecordType::End:
      return a.counts == b.counts;
    default:
      return a.hash == b.hash;
  }
}

void PutLittle(std::string& bytes, std::uint64_t value, int size)
{
  for (int n = 0; n < size; ++n)
  {
    bytes.push_back(static_cast<char>(value >> (8 * n)));
  }
}

std::string Item(std::uint8_t type, std::uint64_t gap, const std::string& payload)
{
  std::string bytes(1, static_cast<char>(type));
  PutLittle(bytes, payload.size(), 4);
  PutLittle(bytes, gap, 8);
  return bytes + payload;
}

std::string Block(const std::string& items)
{
  uLongf size = compressBound(static_cast<uLong>(items.size()));
  std::string packed(size, '\0');
  EXPECT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &size,
              reinterpret_cast<const Bytef*>(items.data()), static_cast<uLong>(items.size())),
    Z_OK);
  packed.resize(size);
  std::string bytes;
  PutLittle(bytes, size, 4);
  PutLittle(bytes, items.size(), 4);
  return bytes + packed;
}

/// Where the blocks begin.
std::size_t HeaderSize(const std::string& bytes)
{
  std::uint32_t size = 0;
  std::memcpy(&size, &bytes[8], 4);
  return 12 + size;
}
}

TEST(UnitTestRecording, HashesAreTheStandardOnes)
{
  // From the authors' test vectors.
  EXPECT_EQ(coronary::Fnv1a("", 0), 0xcbf29ce484222325U);
  EXPECT_EQ(coronary::Fnv1a("a", 1), 0xaf63dc4c8601ec8cU);
  EXPECT_EQ(coronary::Fnv1a("foobar", 6), 0x85944171f73967e8U);
}

TEST(UnitTestRecording, GivesBackTheBits)
{
  const std::vector<SessionInput> inputs = TestInputs(2500);
  const std::string bytes = Recorded(inputs);
  EXPECT_EQ(bytes.substr(0, 8), std::string("PCIREC\0\2", 8));
  RecordingReader reader = ReaderOf(bytes);
  EXPECT_EQ(reader.Header().build, "test 1");
  EXPECT_EQ(reader.Header().scenario, R"({"list":[1,2.5],"name":"somewhere"})");
  EXPECT_EQ(reader.Header().meshHash, 0xFEDCBA9876543210U);
  EXPECT_EQ(reader.Header().seed, std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(reader.Header().tickRate, 2000.0);

  coronary::RecordingReplay replay(std::move(reader));
  SessionInput input;
  std::vector<coronary::RecordedEvent> events;
  std::uint64_t hash = 0;
  for (std::size_t tick = 0; tick < inputs.size(); ++tick)
  {
    ASSERT_TRUE(replay.At(tick, input, events)) << tick;
    ASSERT_TRUE(SameBits(input, inputs[tick])) << tick;
    ASSERT_EQ(events.size(), tick == 300 ? 1U : 0U) << tick;
    if (tick == 300)
    {
      EXPECT_EQ(events[0].value, 91.25);
    }
    ASSERT_EQ(replay.ExpectedHash(tick + 1, hash), (tick + 1) % 500 == 0) << tick;
    if ((tick + 1) % 500 == 0)
    {
      EXPECT_EQ(hash, 1000 + tick);
    }
  }
  EXPECT_FALSE(replay.At(inputs.size(), input, events));
  EXPECT_EQ(replay.Reader().HowEnded(), Ending::Complete);
}

TEST(UnitTestRecording, SteadyDrivingIsSmallAndRestIsNothing)
{
  const auto sizeOf = [](double speed)
  {
    std::vector<SessionInput> inputs;
    for (int tick = 0; tick < 20000; ++tick)
    {
      inputs.push_back(Advanced(3.0 + speed * (tick / 2000.0)));
    }
    std::ostringstream stream;
    RecordingWriter writer(stream, TestHeader());
    for (std::size_t tick = 0; tick < inputs.size(); ++tick)
    {
      writer.Input(tick, inputs[tick]);
    }
    writer.Finish(inputs.size());
    return stream.str().size();
  };
  EXPECT_LT(sizeOf(5.0), 20000U * 5);
  EXPECT_LT(sizeOf(0.0), 1100U);
}

TEST(UnitTestRecording, TornAtEveryByteItIsGoodUpToThere)
{
  const std::string bytes = Recorded(TestInputs(700));
  std::vector<RecordedItem> whole;
  Ending ending = Ending::NotYet;
  ASSERT_TRUE(ReadAll(bytes, whole, ending));
  ASSERT_EQ(ending, Ending::Complete);
  ASSERT_GT(whole.size(), 400U);
  const std::size_t header = HeaderSize(bytes);
  std::vector<RecordedItem> items;
  std::size_t before = 0;
  for (std::size_t size = 0; size < bytes.size(); ++size)
  {
    const bool opened = ReadAll(bytes.substr(0, size), items, ending);
    ASSERT_EQ(opened, size >= header) << size;
    if (!opened)
    {
      continue;
    }
    ASSERT_EQ(ending, Ending::Torn) << size;
    ASSERT_GE(items.size(), before) << size;
    ASSERT_LT(items.size(), whole.size()) << size;
    before = items.size();
    for (std::size_t n = 0; n < items.size(); ++n)
    {
      ASSERT_TRUE(Same(items[n], whole[n])) << size << " " << n;
    }
  }
  EXPECT_EQ(before, whole.size() - 1);
}

TEST(UnitTestRecording, EveryFlippedBitOfABlockIsNoticed)
{
  const std::string bytes = Recorded(TestInputs(300));
  std::vector<RecordedItem> whole;
  Ending ending = Ending::NotYet;
  ASSERT_TRUE(ReadAll(bytes, whole, ending));
  std::vector<RecordedItem> items;
  for (std::size_t at = HeaderSize(bytes); at < bytes.size(); ++at)
  {
    for (int bit = 0; bit < 8; ++bit)
    {
      std::string changed = bytes;
      changed[at] = static_cast<char>(changed[at] ^ (1 << bit));
      ASSERT_TRUE(ReadAll(changed, items, ending));
      // Bits between the packed bytes and their check sum mean nothing.
      ASSERT_TRUE(ending != Ending::Complete || items.size() == whole.size()) << at << " " << bit;
      for (std::size_t n = 0; n < items.size(); ++n)
      {
        ASSERT_TRUE(Same(items[n], whole[n])) << at << " " << bit << " " << n;
      }
    }
  }
}

TEST(UnitTestRecording, UnknownTypesAreSkippedAndCounted)
{
  const std::string bytes = Recorded(TestInputs(300));
  const std::size_t header = HeaderSize(bytes);
  const std::string more = bytes.substr(0, header) +
    Block(Item(200, 0, "from the future") + Item(0, 0, "")) + bytes.substr(header);
  RecordingReader reader = ReaderOf(more);
  RecordedItem item;
  std::size_t count = 0;
  while (reader.Next(item))
  {
    ++count;
  }
  std::vector<RecordedItem> whole;
  Ending ending = Ending::NotYet;
  ASSERT_TRUE(ReadAll(bytes, whole, ending));
  EXPECT_EQ(count, whole.size());
  EXPECT_EQ(reader.Unknown(), 2U);
  EXPECT_EQ(reader.HowEnded(), Ending::Complete);
}

TEST(UnitTestRecording, HostileLengthsAndContents)
{
  const std::string bytes = Recorded(TestInputs(10));
  const std::string header = bytes.substr(0, HeaderSize(bytes));
  const auto ends = [&](const std::string& blocks)
  {
    std::vector<RecordedItem> items;
    Ending ending = Ending::NotYet;
    EXPECT_TRUE(ReadAll(header + blocks, items, ending));
    return ending;
  };
  const auto endsWith = [&](const std::string& items) { return ends(Block(items)); };
  EXPECT_EQ(ends(""), Ending::Torn);
  EXPECT_EQ(ends(std::string(8, '\xFF')), Ending::Damaged);              // 4 GB
  EXPECT_EQ(ends(std::string("\0\0\x10\0\0\0\x10\0", 8)), Ending::Torn); // 1 MB
  EXPECT_EQ(endsWith(std::string(1500000, '\0')), Ending::Damaged);
  EXPECT_EQ(ends(std::string("\4\0\0\0\4\0\0\0abcd", 12)), Ending::Damaged);
  EXPECT_EQ(endsWith("short"), Ending::Damaged);
  EXPECT_EQ(endsWith(std::string("\6\xFF\xFF\xFF\xFF", 5) + std::string(8, '\0')), Ending::Damaged);
  EXPECT_EQ(endsWith(Item(1, 0, "")), Ending::Damaged);
  EXPECT_EQ(endsWith(Item(1, 0, std::string("\0\0", 2))), Ending::Damaged);     // no axis
  EXPECT_EQ(endsWith(Item(1, 0, std::string("\0\x10", 2))), Ending::Damaged);   // unknown axis
  EXPECT_EQ(endsWith(Item(1, 0, std::string("\1\0abcd", 6))), Ending::Damaged); // half a value
  EXPECT_EQ(endsWith(Item(4, 0, "short")), Ending::Damaged);
  EXPECT_EQ(endsWith(Item(4, std::uint64_t{ 1 } << 50, "12345678")), Ending::Damaged);
  EXPECT_EQ(endsWith(Item(6, 5, "") + Item(6, ~std::uint64_t{ 0 }, "")), Ending::Damaged); // back
  const std::string noEnd = Item(7, 0, std::string(56, '\1'));
  const std::string end = Item(7, 0, std::string(56, '\0'));
  EXPECT_EQ(endsWith(noEnd), Ending::Damaged);
  EXPECT_EQ(endsWith(end + end), Ending::Damaged);
  EXPECT_EQ(ends(Block(end) + "more"), Ending::Damaged);
  EXPECT_EQ(endsWith(end), Ending::Complete);

  // Headers.
  std::vector<RecordedItem> items;
  Ending ending = Ending::NotYet;
  EXPECT_FALSE(ReadAll("", items, ending));
  EXPECT_FALSE(ReadAll("PCIREC", items, ending));
  EXPECT_FALSE(ReadAll(std::string("PCIREC\0\1\0\0\0\0", 12), items, ending));
  EXPECT_FALSE(ReadAll(std::string("PCIREC\0\2\xFF\xFF\xFF\xFF", 12), items, ending));
  EXPECT_FALSE(ReadAll(std::string("PCIREC\0\2\0\0\0\1{}", 14), items, ending)); // 16 MB
  EXPECT_FALSE(ReadAll(std::string("PCIREC\0\2\2\0\0\0{}", 14), items, ending));
  std::string deep(100000, '[');
  std::string nested("PCIREC\0\2", 8);
  nested += std::string("\xA0\x86\1\0", 4) + deep;
  EXPECT_FALSE(ReadAll(nested, items, ending));
  std::string other = bytes;
  other.replace(other.find("somewhere"), 9, "elsewhere");
  EXPECT_FALSE(ReadAll(other, items, ending)) << "the scenario does not fit its hash";
}

TEST(UnitTestRecording, RandomBytesDoNoHarm)
{
  std::mt19937_64 random(11);
  const std::string good = Recorded(TestInputs(40));
  const std::size_t header = HeaderSize(good);
  std::vector<RecordedItem> items;
  Ending ending = Ending::NotYet;
  std::size_t opened = 0;
  for (int n = 0; n < 100000; ++n)
  {
    // Nothing but noise; noise behind a good header; a good file with some bytes changed.
    std::string bytes = n % 3 == 0 ? std::string() : n % 3 == 1 ? good.substr(0, header) : good;
    if (n % 3 == 2)
    {
      for (int k = 0; k < 4; ++k)
      {
        const std::size_t at =
          n % 2 == 0 ? header + random() % (good.size() - header) : random() % good.size();
        bytes[at] = static_cast<char>(random());
      }
    }
    else
    {
      const std::size_t more = random() % 64;
      for (std::size_t k = 0; k < more; ++k)
      {
        bytes.push_back(static_cast<char>(random()));
      }
    }
    opened += ReadAll(bytes, items, ending) ? 1 : 0;
    ASSERT_LT(items.size(), 100U);
  }
  EXPECT_GT(opened, 40000U);
}

TEST(UnitTestRecording, RefusesWhatNoReplayCouldFollow)
{
  std::ostringstream stream;
  RecordingWriter writer(stream, TestHeader());
  writer.Input(5, Advanced(1.0));
  ExpectRefusal([&] { writer.Input(4, {}); }, "comes after 5");
  ExpectRefusal([&] { writer.Annotation(6, std::string(70000, 'x')); }, "longer than 65536");
  ExpectRefusal([&] { writer.StateHash(std::uint64_t{ 1 } << 60, 0); }, "comes after");
}

TEST(UnitTestRecording, FilesAppearWhenTheyAreWhole)
{
  namespace fs = std::filesystem;
  const fs::path folder =
    fs::temp_directory_path() / ("recording test." + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string path = (folder / "a.pcirec").string();
  {
    RecordingWriter writer(path, TestHeader());
    writer.Input(0, Advanced(1.0));
    EXPECT_FALSE(fs::exists(path));
  }
  EXPECT_TRUE(fs::is_empty(folder)) << "an unfinished recording was left";
  {
    RecordingWriter writer(path, TestHeader());
    writer.Input(0, Advanced(1.0));
    writer.Finish(3);
  }
  coronary::RecordingReplay replay{ RecordingReader(path) };
  SessionInput input;
  std::vector<coronary::RecordedEvent> events;
  for (std::uint64_t tick = 0; tick < 3; ++tick)
  {
    EXPECT_TRUE(replay.At(tick, input, events));
    EXPECT_EQ(input.drive.wirePosition, 1.0);
  }
  EXPECT_FALSE(replay.At(3, input, events));
  EXPECT_THROW(RecordingReader((folder / "none").string()), std::runtime_error);
  EXPECT_THROW(
    RecordingWriter((folder / "no/such/folder").string(), TestHeader()), std::runtime_error);
  fs::remove_all(folder);
}
}
