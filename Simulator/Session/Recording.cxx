#include "Recording.h"

#include "AtomicFile.h"
#include "HandAxes.h"
#include "JsonFields.h"
#include "WallMotion.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <istream>
#include <ostream>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
using Json = nlohmann::json;

constexpr std::array<char, 8> Magic{ 'P', 'C', 'I', 'R', 'E', 'C', '\0', '\1' };
constexpr std::size_t MagicName = 7; // the last byte is the version
constexpr std::uint32_t MostHeader = 16U << 20;
constexpr std::uint32_t MostPayload = 1U << 20;
constexpr std::uint64_t MostTicks = std::uint64_t{ 1 } << 40; // 17 years at 2 kHz
constexpr std::size_t FramesOfChunk = 100;
/// In the order of their bits in the mask of a frame: what moves often comes first. The pedals are behind the syringe.
constexpr std::size_t Axes = HandAxes + 1;
constexpr std::size_t PedalAxis = IndexOf(AxisKind::Syringe) + 1;

const char* AxisName(std::size_t axis)
{
  return axis == PedalAxis ? "pedals" : HandAxisTable[axis - (axis > PedalAxis ? 1 : 0)].recorded;
}

const char* AxisUnitName(std::size_t axis)
{
  return axis == PedalAxis ? "bits"
                           : UnitName(HandAxisTable[axis - (axis > PedalAxis ? 1 : 0)].unit);
}

constexpr std::size_t DriveAxes = 4; ///< recordings may have only these, the first ones

std::array<std::uint64_t, Axes> BitsOf(const SessionInput& input)
{
  const AxisPlaces places = PlacesOf(input);
  std::array<double, Axes> values{};
  std::copy_n(places.begin(), PedalAxis, values.begin());
  values[PedalAxis] = static_cast<double>(input.pedals);
  std::copy(places.begin() + PedalAxis, places.end(), values.begin() + PedalAxis + 1);
  std::array<std::uint64_t, Axes> bits{};
  std::memcpy(bits.data(), values.data(), sizeof(bits));
  return bits;
}

/// A number of pedals that no pedals have is no pedal.
std::uint32_t PedalsOf(double value)
{
  return value >= 0.0 && value <= 4294967295.0 ? static_cast<std::uint32_t>(value) : 0U;
}

SessionInput InputOf(const std::array<std::uint64_t, Axes>& bits)
{
  std::array<double, Axes> values{};
  std::memcpy(values.data(), bits.data(), sizeof(values));
  AxisPlaces places{};
  std::copy_n(values.begin(), PedalAxis, places.begin());
  std::copy(values.begin() + PedalAxis + 1, values.end(), places.begin() + PedalAxis);
  SessionInput input;
  SetPlaces(input, places);
  input.pedals = PedalsOf(values[PedalAxis]);
  return input;
}

/// Files are little-endian, whatever the machine is.
void PutLittle(std::string& bytes, std::uint64_t value, int size)
{
  for (int n = 0; n < size; ++n)
  {
    bytes.push_back(static_cast<char>(value >> (8 * n)));
  }
}

std::uint64_t Little(const char* bytes, int size)
{
  std::uint64_t value = 0;
  for (int n = 0; n < size; ++n)
  {
    value |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[n])) << (8 * n);
  }
  return value;
}

void PutVarint(std::string& bytes, std::uint64_t value)
{
  while (value >= 0x80)
  {
    bytes.push_back(static_cast<char>(value | 0x80));
    value >>= 7;
  }
  bytes.push_back(static_cast<char>(value));
}

bool TakeVarint(const std::string& bytes, std::size_t& at, std::uint64_t& value)
{
  value = 0;
  for (int shift = 0; shift < 64 && at < bytes.size(); shift += 7)
  {
    const auto byte = static_cast<unsigned char>(bytes[at++]);
    if (shift == 63 && byte > 1)
    {
      return false;
    }
    value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
    if (byte < 0x80)
    {
      return true;
    }
  }
  return false;
}

/// Small for small differences of either sign.
std::uint64_t ZigZag(std::uint64_t difference)
{
  return (difference << 1) ^ (0 - (difference >> 63));
}

std::uint64_t UnZigZag(std::uint64_t code)
{
  return (code >> 1) ^ (0 - (code & 1));
}

/// Bits of the axes are predicted from the last two frames as if they went on evenly, which steady driving nearly does.
struct AxisPredictor
{
  std::array<std::uint64_t, Axes> last = BitsOf(SessionInput());
  std::array<std::uint64_t, Axes> step{};

  std::uint64_t Encode(std::size_t axis, std::uint64_t bits)
  {
    const std::uint64_t difference = bits - this->last[axis];
    const std::uint64_t code = ZigZag(difference - this->step[axis]);
    this->step[axis] = difference;
    this->last[axis] = bits;
    return code;
  }

  void Decode(std::size_t axis, std::uint64_t code)
  {
    this->step[axis] += UnZigZag(code);
    this->last[axis] += this->step[axis];
  }
};

std::uint64_t HexadecimalOf(JsonFields& fields, const char* name)
{
  const std::string text = fields.Text(name);
  if (text.size() != 16 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
  {
    fields.Refuse(std::string("has '") + name + "' that is not 16 hexadecimal digits");
  }
  return std::stoull(text, nullptr, 16);
}

std::string HeaderText(const RecordingHeader& header)
{
  Json axes = Json::array();
  for (std::size_t axis = 0; axis < Axes; ++axis)
  {
    axes.push_back({ { "name", AxisName(axis) }, { "unit", AxisUnitName(axis) } });
  }
  const Json scenario =
    header.scenario.empty() ? Json::object() : ParseBoundedJson(header.scenario, "The scenario");
  const std::string text = scenario.dump();
  Json json = { { "schema", 1 }, { "build", header.build }, { "scenario", scenario },
    { "scenario_hash", Hexadecimal(Fnv1a(text.data(), text.size())) },
    { "mesh_hash", Hexadecimal(header.meshHash) }, { "seed", Hexadecimal(header.seed) },
    { "tick_hz", header.tickRate }, { "axes", axes }, { "start_utc", header.started } };
  return json.dump();
}

RecordingHeader HeaderOf(const std::string& text, const std::string& origin, std::size_t& axisCount)
{
  const std::string where = "The header of " + origin;
  const Json json = ParseBoundedJson(text, where);
  JsonFields fields(json, where);
  if (fields.Whole("schema", 0, INT32_MAX, 0) != 1)
  {
    fields.Refuse("has another 'schema' than 1, the only one that is known");
  }
  RecordingHeader header;
  header.build = fields.Text("build");
  header.scenario = fields.Object("scenario").dump();
  const std::uint64_t hash = HexadecimalOf(fields, "scenario_hash");
  if (hash != Fnv1a(header.scenario.data(), header.scenario.size()))
  {
    fields.Refuse("has a scenario that does not fit its 'scenario_hash'");
  }
  header.meshHash = HexadecimalOf(fields, "mesh_hash");
  header.seed = HexadecimalOf(fields, "seed");
  header.tickRate = fields.Number("tick_hz", 1.0, 1e6);
  header.started = fields.Text("start_utc");
  const Json& axes = fields.List("axes");
  bool same = axes.size() == Axes || axes.size() == DriveAxes;
  for (std::size_t n = 0; same && n < axes.size(); ++n)
  {
    same = axes[n] == Json{ { "name", AxisName(n) }, { "unit", AxisUnitName(n) } };
  }
  if (!same)
  {
    fields.Refuse("has other axes than those of wire, catheter, syringe, pedals and C-arm");
  }
  axisCount = axes.size();
  return header;
}

constexpr std::size_t ChunkHead = 4 + 1 + 8;

std::uint64_t CheckSum(const std::string& bytes, std::uint64_t before = 0)
{
  return crc32(static_cast<uLong>(before), reinterpret_cast<const Bytef*>(bytes.data()),
    static_cast<uInt>(bytes.size()));
}
}

std::string Hexadecimal(std::uint64_t value)
{
  char text[24];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(value));
  return text;
}

struct RecordingWriter::Internals
{
  std::unique_ptr<AtomicFile> file; ///< null: someone else's stream
  std::ofstream own;
  std::ostream* stream = nullptr;
  std::string name;
  AxisPredictor axes;
  std::uint64_t lastTick = 0;      ///< of anything
  std::string frames;              ///< waiting
  std::uint64_t frameTick = 0;     ///< of the first that waits
  std::uint64_t lastFrameTick = 0; ///< of the last that waits
  std::size_t waiting = 0;
  std::array<std::uint64_t, 8> counts{};

  void Check()
  {
    if (!*this->stream)
    {
      throw std::runtime_error("Cannot write '" + this->name + "'.");
    }
  }

  void Write(const std::string& bytes)
  {
    this->stream->write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    this->Check();
  }

  void Begin(const RecordingHeader& header)
  {
    const std::string text = HeaderText(header);
    std::string bytes(Magic.begin(), Magic.end());
    PutLittle(bytes, text.size(), 4);
    this->Write(bytes + text);
  }

  void Chunk(RecordType type, std::uint64_t tick, const std::string& payload)
  {
    std::string bytes;
    PutLittle(bytes, payload.size(), 4);
    bytes.push_back(static_cast<char>(type));
    PutLittle(bytes, tick, 8);
    bytes += payload;
    PutLittle(bytes, CheckSum(bytes), 4);
    this->Write(bytes);
  }

  void FlushFrames()
  {
    if (this->waiting > 0)
    {
      this->Chunk(RecordType::Input, this->frameTick, this->frames);
      this->frames.clear();
      this->waiting = 0;
    }
  }

  void Advance(std::uint64_t tick)
  {
    if (tick < this->lastTick || tick >= MostTicks)
    {
      throw std::invalid_argument("Tick " + std::to_string(tick) + " of a recording comes after " +
        std::to_string(this->lastTick) + ".");
    }
    this->lastTick = tick;
  }

  void Put(RecordType type, std::uint64_t tick, const std::string& payload)
  {
    this->Advance(tick);
    this->FlushFrames();
    this->Chunk(type, tick, payload);
    ++this->counts[static_cast<std::size_t>(type)];
  }
};

RecordingWriter::RecordingWriter(const std::string& path, const RecordingHeader& header)
  : Data(std::make_unique<Internals>())
{
  this->Data->name = path;
  this->Data->file = std::make_unique<AtomicFile>(path);
  this->Data->own.open(this->Data->file->TemporaryPath(), std::ios::binary | std::ios::trunc);
  this->Data->stream = &this->Data->own;
  this->Data->Begin(header);
}

RecordingWriter::RecordingWriter(std::ostream& stream, const RecordingHeader& header)
  : Data(std::make_unique<Internals>())
{
  this->Data->name = "stream";
  this->Data->stream = &stream;
  this->Data->Begin(header);
}

RecordingWriter::~RecordingWriter() = default;

void RecordingWriter::Input(std::uint64_t tick, const SessionInput& input)
{
  Internals& data = *this->Data;
  data.Advance(tick);
  const std::array<std::uint64_t, Axes> bits = BitsOf(input);
  if (bits == data.axes.last)
  {
    return;
  }
  if (data.waiting == 0)
  {
    data.frameTick = data.lastFrameTick = tick;
  }
  PutVarint(data.frames, tick - data.lastFrameTick);
  data.lastFrameTick = tick;
  std::uint64_t mask = 0;
  for (std::size_t axis = 0; axis < Axes; ++axis)
  {
    mask |= std::uint64_t{ bits[axis] != data.axes.last[axis] ? 1U : 0U } << axis;
  }
  PutVarint(data.frames, mask);
  for (std::size_t axis = 0; axis < Axes; ++axis)
  {
    if ((mask >> axis & 1) != 0)
    {
      PutVarint(data.frames, data.axes.Encode(axis, bits[axis]));
    }
  }
  ++data.counts[static_cast<std::size_t>(RecordType::Input)];
  if (++data.waiting == FramesOfChunk)
  {
    data.FlushFrames();
  }
}

void RecordingWriter::Force(std::uint64_t tick, const RecordedForces& forces)
{
  std::string payload;
  for (const float value :
    { forces.proximalForce, forces.proximalTorque, forces.tipForce, forces.maximumForce })
  {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof(bits));
    PutLittle(payload, bits, 4);
  }
  this->Data->Put(RecordType::Force, tick, payload);
}

void RecordingWriter::Event(std::uint64_t tick, const RecordedEvent& event)
{
  std::string payload(1, static_cast<char>(event.kind));
  std::uint64_t bits = 0;
  std::memcpy(&bits, &event.value, sizeof(bits));
  PutLittle(payload, bits, 8);
  this->Data->Put(RecordType::Event, tick, payload);
}

void RecordingWriter::StateHash(std::uint64_t tick, std::uint64_t hash)
{
  std::string payload;
  PutLittle(payload, hash, 8);
  this->Data->Put(RecordType::StateHash, tick, payload);
  this->Data->stream->flush();
  this->Data->Check();
}

void RecordingWriter::ImageHash(std::uint64_t tick, std::uint64_t hash)
{
  std::string payload;
  PutLittle(payload, hash, 8);
  this->Data->Put(RecordType::ImageHash, tick, payload);
}

void RecordingWriter::Annotation(std::uint64_t tick, const std::string& text)
{
  if (text.size() > MostText)
  {
    throw std::invalid_argument("An annotation of " + std::to_string(text.size()) +
      " bytes is longer than " + std::to_string(MostText) + ".");
  }
  this->Data->Put(RecordType::Annotation, tick, text);
}

void RecordingWriter::Finish(std::uint64_t ticks)
{
  Internals& data = *this->Data;
  data.Advance(ticks);
  data.FlushFrames();
  std::string payload;
  data.counts[0] = ticks;
  for (std::size_t n = 0; n < static_cast<std::size_t>(RecordType::End); ++n)
  {
    PutLittle(payload, data.counts[n], 8);
  }
  data.Chunk(RecordType::End, ticks, payload);
  data.stream->flush();
  data.Check();
  if (data.file)
  {
    data.own.close();
    data.Check();
    data.file->Commit();
  }
}

struct RecordingReader::Internals
{
  std::unique_ptr<std::istream> stream;
  std::string origin;
  RecordingHeader header;
  Ending ending = Ending::NotYet;
  std::string reason;
  std::uint64_t unknown = 0;
  std::uint64_t bytes = 0;
  std::uint64_t lastTick = 0;
  AxisPredictor axes;
  std::size_t axisCount = Axes; ///< of the file
  std::array<std::uint64_t, 8> counts{};
  // The input chunk that is being read.
  std::string frames;
  std::size_t at = 0;
  std::uint64_t frameTick = 0;

  /// Up to `size` bytes, never more memory than there are bytes.
  std::string Take(std::size_t size)
  {
    constexpr std::size_t Block = 65536;
    std::string bytesRead;
    while (bytesRead.size() < size)
    {
      const std::size_t before = bytesRead.size();
      const std::size_t part = std::min(Block, size - before);
      bytesRead.resize(before + part);
      this->stream->read(&bytesRead[before], static_cast<std::streamsize>(part));
      const auto got = static_cast<std::size_t>(this->stream->gcount());
      if (got < part)
      {
        bytesRead.resize(before + got);
        break;
      }
    }
    return bytesRead;
  }

  bool End(Ending how, const std::string& why)
  {
    this->ending = how;
    this->reason = why;
    return false;
  }

  bool Damaged(const std::string& why) { return this->End(Ending::Damaged, why); }

  void Begin()
  {
    const std::string start = this->Take(Magic.size() + 4);
    if (start.compare(0, MagicName, Magic.data(), MagicName) != 0)
    {
      throw std::runtime_error(this->origin + " is no recording of the simulator.");
    }
    if (start.size() < Magic.size() + 4)
    {
      throw std::runtime_error(this->origin + " breaks off in its header.");
    }
    if (start[MagicName] != Magic[MagicName])
    {
      throw std::runtime_error(this->origin + " is a recording of version " +
        std::to_string(static_cast<int>(static_cast<unsigned char>(start[MagicName]))) +
        "; only version 1 is known.");
    }
    const auto size = static_cast<std::uint32_t>(Little(&start[Magic.size()], 4));
    if (size > MostHeader)
    {
      throw std::runtime_error(
        this->origin + " says that its header has " + std::to_string(size) + " bytes: too many.");
    }
    const std::string text = this->Take(size);
    if (text.size() < size)
    {
      throw std::runtime_error(this->origin + " breaks off in its header.");
    }
    try
    {
      this->header = HeaderOf(text, this->origin, this->axisCount);
    }
    catch (const std::invalid_argument& error)
    {
      throw std::runtime_error(error.what());
    }
    this->bytes = start.size() + text.size();
  }

  bool NextFrame(RecordedItem& item)
  {
    std::uint64_t gap = 0;
    std::uint64_t mask = 0;
    if (!TakeVarint(this->frames, this->at, gap) || !TakeVarint(this->frames, this->at, mask))
    {
      return this->Damaged("an input frame breaks off");
    }
    if (gap >= MostTicks || this->frameTick + gap >= MostTicks || mask == 0 ||
      mask >> this->axisCount != 0)
    {
      return this->Damaged("an input frame has no sense");
    }
    this->frameTick += gap;
    for (std::size_t axis = 0; axis < Axes; ++axis)
    {
      std::uint64_t code = 0;
      if ((mask >> axis & 1) != 0)
      {
        if (!TakeVarint(this->frames, this->at, code))
        {
          return this->Damaged("an input frame breaks off");
        }
        this->axes.Decode(axis, code);
      }
    }
    item.type = RecordType::Input;
    item.tick = this->lastTick = this->frameTick;
    item.input = InputOf(this->axes.last);
    ++this->counts[static_cast<std::size_t>(RecordType::Input)];
    return true;
  }

  bool Read(RecordedItem& item)
  {
    while (this->ending == Ending::NotYet)
    {
      if (this->at < this->frames.size())
      {
        return this->NextFrame(item);
      }
      const std::string head = this->Take(ChunkHead);
      if (head.size() < ChunkHead)
      {
        return this->End(
          Ending::Torn, head.empty() ? "it has no end" : "its last chunk breaks off");
      }
      const auto size = static_cast<std::uint32_t>(Little(&head[0], 4));
      const auto type = static_cast<std::uint8_t>(head[4]);
      const std::uint64_t tick = Little(&head[5], 8);
      if (size > MostPayload)
      {
        return this->Damaged("a chunk says that it has " + std::to_string(size) + " bytes");
      }
      const std::string payload = this->Take(size);
      const std::string sum = this->Take(payload.size() < size ? 0 : 4);
      if (sum.size() < 4)
      {
        return this->End(Ending::Torn, "its last chunk breaks off");
      }
      if (CheckSum(payload, CheckSum(head)) != Little(&sum[0], 4))
      {
        return this->Damaged("the check sum of a chunk does not fit");
      }
      if (tick < this->lastTick || tick >= MostTicks)
      {
        return this->Damaged("a chunk's tick goes back");
      }
      this->lastTick = tick;
      this->bytes += head.size() + payload.size() + sum.size();
      if (type < 1 || type > static_cast<std::uint8_t>(RecordType::End))
      {
        ++this->unknown;
        continue;
      }
      item.type = static_cast<RecordType>(type);
      item.tick = tick;
      if (item.type == RecordType::Input)
      {
        this->frames = payload;
        this->at = 0;
        this->frameTick = tick;
        continue;
      }
      if (!this->Decode(payload, item))
      {
        return false;
      }
      ++this->counts[type];
      return true;
    }
    return false;
  }

  bool Decode(const std::string& payload, RecordedItem& item)
  {
    // What a later writer adds at the end of a payload is left alone.
    static constexpr std::array<std::size_t, 8> minimum{ 0, 0, 16, 9, 8, 8, 0, 56 };
    if (payload.size() < minimum[static_cast<std::size_t>(item.type)])
    {
      return this->Damaged("a chunk is too short for its type");
    }
    switch (item.type)
    {
      case RecordType::Force:
      {
        std::array<float, 4> values{};
        for (std::size_t n = 0; n < values.size(); ++n)
        {
          const auto bits = static_cast<std::uint32_t>(Little(&payload[4 * n], 4));
          std::memcpy(&values[n], &bits, sizeof(bits));
        }
        item.forces = { values[0], values[1], values[2], values[3] };
        return true;
      }
      case RecordType::Event:
      {
        item.event.kind = static_cast<std::uint8_t>(payload[0]);
        const std::uint64_t bits = Little(&payload[1], 8);
        std::memcpy(&item.event.value, &bits, sizeof(bits));
        return true;
      }
      case RecordType::StateHash:
      case RecordType::ImageHash:
        item.hash = Little(&payload[0], 8);
        return true;
      case RecordType::Annotation:
        item.text = payload;
        return true;
      default:
        break;
    }
    for (std::size_t n = 0; n < static_cast<std::size_t>(RecordType::End); ++n)
    {
      item.counts[n] = Little(&payload[8 * n], 8);
      if (n > 0 && item.counts[n] != this->counts[n])
      {
        return this->Damaged("its end counts other chunks than there are");
      }
    }
    if (item.counts[0] != item.tick)
    {
      return this->Damaged("its end contradicts itself");
    }
    if (this->stream->peek() != std::istream::traits_type::eof())
    {
      this->End(Ending::Damaged, "bytes follow its end");
      return true;
    }
    this->End(Ending::Complete, "complete");
    return true;
  }
};

RecordingReader::RecordingReader(const std::string& path)
  : RecordingReader(std::make_unique<std::ifstream>(path, std::ios::binary), "'" + path + "'")
{
}

RecordingReader::RecordingReader(std::unique_ptr<std::istream> stream, const std::string& origin)
  : Data(std::make_unique<Internals>())
{
  this->Data->stream = std::move(stream);
  this->Data->origin = origin;
  if (!this->Data->stream || !*this->Data->stream)
  {
    throw std::runtime_error("Cannot open " + origin + ".");
  }
  this->Data->Begin();
}

RecordingReader::~RecordingReader() = default;
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
RecordingReader& RecordingReader::operator=(RecordingReader&&) noexcept = default;

const RecordingHeader& RecordingReader::Header() const
{
  return this->Data->header;
}

bool RecordingReader::Next(RecordedItem& item)
{
  return this->Data->Read(item);
}

RecordingReader::Ending RecordingReader::HowEnded() const
{
  return this->Data->ending;
}

std::string RecordingReader::EndingText() const
{
  const Internals& data = *this->Data;
  switch (data.ending)
  {
    case Ending::NotYet:
      return "not read to its end";
    case Ending::Complete:
      return "complete";
    default:
      return data.origin + " is good up to tick " + std::to_string(data.lastTick) +
        " only: " + data.reason;
  }
}

std::uint64_t RecordingReader::Unknown() const
{
  return this->Data->unknown;
}

std::uint64_t RecordingReader::Bytes() const
{
  return this->Data->bytes;
}

RecordingReplay::RecordingReplay(RecordingReader reader)
  : Source(std::move(reader))
{
}

void RecordingReplay::ReadUpTo(std::uint64_t tick)
{
  while (!this->Over)
  {
    if (!this->HasAhead)
    {
      if (!this->Source.Next(this->Ahead))
      {
        this->Over = true;
        return;
      }
      this->HasAhead = true;
    }
    const RecordedItem& item = this->Ahead;
    // A hash of tick t belongs to the state after step t - 1; it is there before step t is asked for.
    if (item.tick > tick)
    {
      return;
    }
    this->HasAhead = false;
    switch (item.type)
    {
      case RecordType::Input:
        this->Current = item.input;
        break;
      case RecordType::Event:
        this->Pending.push_back(item.event);
        break;
      case RecordType::StateHash:
        this->Hashes[item.tick] = item.hash;
        break;
      case RecordType::End:
        this->Ended = true;
        this->Ticks = item.tick;
        this->Over = true;
        return;
      default:
        break;
    }
    // Inputs and events are of the step that comes; all others of the state before it.
    const bool before = item.type == RecordType::Input || item.type == RecordType::Event;
    this->Ticks = std::max(this->Ticks, item.tick + (before ? 1 : 0));
  }
}

bool RecordingReplay::At(
  std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events)
{
  this->ReadUpTo(tick);
  events.clear();
  if (this->Over && tick >= this->Ticks)
  {
    return false;
  }
  input = this->Current;
  events.swap(this->Pending);
  return true;
}

bool RecordingReplay::ExpectedHash(std::uint64_t tick, std::uint64_t& hash)
{
  // What comes at this tick after the hash belongs to the next step, and stays ahead until then.
  while (!this->Over && this->Hashes.count(tick) == 0)
  {
    if (!this->HasAhead)
    {
      if (!this->Source.Next(this->Ahead))
      {
        this->Over = true;
        break;
      }
      this->HasAhead = true;
    }
    const RecordType type = this->Ahead.type;
    if (this->Ahead.tick > tick || type == RecordType::Input || type == RecordType::Event ||
      type == RecordType::End)
    {
      break;
    }
    if (type == RecordType::StateHash)
    {
      this->Hashes[this->Ahead.tick] = this->Ahead.hash;
    }
    this->Ticks = std::max(this->Ticks, this->Ahead.tick);
    this->HasAhead = false;
  }
  const auto found = this->Hashes.find(tick);
  const bool known = found != this->Hashes.end();
  if (known)
  {
    hash = found->second;
  }
  this->Hashes.erase(this->Hashes.begin(), this->Hashes.upper_bound(tick));
  return known;
}

std::uint64_t WallHash(WallMotion& wall)
{
  const WallTopology& topology = wall.Topology();
  std::uint64_t hash = Fnv1a(&topology.points, sizeof(topology.points));
  hash = Fnv1a(
    topology.triangles.data(), topology.triangles.size() * sizeof(topology.triangles[0]), hash);
  hash = Fnv1a(topology.group.data(), topology.group.size() * sizeof(int), hash);
  std::vector<Vector3> points;
  for (const double phase : { 0.0, 0.3, 0.7 })
  {
    wall.Positions(phase, points);
    hash = Fnv1a(points.data(), points.size() * sizeof(points[0]), hash);
  }
  return hash;
}
}
