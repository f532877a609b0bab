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
#include <new>
#include <ostream>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
using Json = nlohmann::json;

constexpr std::array<char, 8> Magic{ 'P', 'C', 'I', 'R', 'E', 'C', '\0', '\2' };
constexpr std::size_t MagicName = 7; // the last byte is the version
constexpr std::uint32_t MostHeader = 16U << 20;
constexpr std::uint32_t MostBlock = 1U << 20;
constexpr std::size_t EnoughForBlock = 65536;
constexpr std::uint64_t MostTicks = std::uint64_t{ 1 } << 40; // 17 years at 2 kHz
constexpr std::size_t BlockHead = 4 + 4;
constexpr std::size_t ItemHead = 1 + 4 + 8;
constexpr int Compression = 1; // fast: it happens between two ticks

/// Bits of the numbers of an input, in the order of the header's axes. The pedals come where they were before there was a
/// balloon; recordings of that time end with them.
constexpr std::size_t Axes = HandAxes + 1;
constexpr std::size_t Pedals = 11;
constexpr std::size_t AxesWithoutBalloon = Pedals + 1;
using InputBits = std::array<std::uint64_t, Axes>;

InputBits BitsOf(const SessionInput& input)
{
  const AxisPlaces places = PlacesOf(input);
  InputBits bits{};
  std::memcpy(bits.data(), places.data(), sizeof(places));
  std::copy_backward(bits.begin() + Pedals, bits.begin() + HandAxes, bits.end());
  bits[Pedals] = input.pedals;
  return bits;
}

SessionInput InputOf(InputBits bits)
{
  SessionInput input;
  input.pedals = static_cast<std::uint32_t>(bits[Pedals]);
  std::copy(bits.begin() + AxesWithoutBalloon, bits.end(), bits.begin() + Pedals);
  AxisPlaces places{};
  std::memcpy(places.data(), bits.data(), sizeof(places));
  SetPlaces(input, places);
  return input;
}

Json AxesJson()
{
  Json axes = Json::array();
  for (const HandAxis& axis : HandAxisTable)
  {
    axes.push_back({ { "name", axis.recorded }, { "unit", UnitName(axis.unit) } });
  }
  axes.insert(axes.begin() + Pedals, Json{ { "name", "pedals" }, { "unit", "bits" } });
  return axes;
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

/// What packed bytes hold of a block of that size, as far as they go.
/// @param whole  becomes whether all of it is there and its check sum fits
std::string Unpacked(const std::string& packed, std::size_t size, bool& whole)
{
  std::string block(size, '\0');
  z_stream inflating{};
  if (inflateInit(&inflating) != Z_OK)
  {
    throw std::bad_alloc();
  }
  // zlib does not write to its input.
  inflating.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  inflating.avail_in = static_cast<uInt>(packed.size());
  inflating.next_out = reinterpret_cast<Bytef*>(block.data());
  inflating.avail_out = static_cast<uInt>(size);
  whole = inflate(&inflating, Z_SYNC_FLUSH) == Z_STREAM_END && inflating.avail_out == 0;
  block.resize(size - inflating.avail_out);
  inflateEnd(&inflating);
  return block;
}

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
  const Json scenario =
    header.scenario.empty() ? Json::object() : ParseBoundedJson(header.scenario, "The scenario");
  const std::string text = scenario.dump();
  Json json = { { "schema", 1 }, { "build", header.build }, { "scenario", scenario },
    { "scenario_hash", Hexadecimal(Fnv1a(text.data(), text.size())) },
    { "mesh_hash", Hexadecimal(header.meshHash) }, { "seed", Hexadecimal(header.seed) },
    { "tick_hz", header.tickRate }, { "axes", AxesJson() }, { "start_utc", header.started } };
  return json.dump();
}

RecordingHeader HeaderOf(const std::string& text, const std::string& origin)
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
  const Json axes = AxesJson();
  const Json old(axes.begin(), axes.begin() + AxesWithoutBalloon);
  if (fields.List("axes") != axes && fields.List("axes") != old)
  {
    fields.Refuse(
      "has other axes than those of wire, catheter, syringe, pedals, C-arm and balloon");
  }
  return header;
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
  std::string block; ///< items that wait
  std::uint64_t lastTick = 0;
  InputBits last = BitsOf(SessionInput());
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

  void WriteBlock()
  {
    uLongf size = compressBound(static_cast<uLong>(this->block.size()));
    std::string packed(size, '\0');
    if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
          reinterpret_cast<const Bytef*>(this->block.data()),
          static_cast<uLong>(this->block.size()), Compression) != Z_OK)
    {
      throw std::runtime_error("Cannot compress what '" + this->name + "' is to hold.");
    }
    std::string head;
    PutLittle(head, size, 4);
    PutLittle(head, this->block.size(), 4);
    this->Write(head);
    packed.resize(size);
    this->Write(packed);
    this->block.clear();
  }

  void Advance(std::uint64_t tick)
  {
    if (tick < this->lastTick || tick >= MostTicks)
    {
      throw std::invalid_argument("Tick " + std::to_string(tick) + " of a recording comes after " +
        std::to_string(this->lastTick) + ".");
    }
  }

  void Put(RecordType type, std::uint64_t tick, const std::string& payload)
  {
    this->Advance(tick);
    this->block.push_back(static_cast<char>(type));
    PutLittle(this->block, payload.size(), 4);
    PutLittle(this->block, tick - this->lastTick, 8);
    this->block += payload;
    this->lastTick = tick;
    ++this->counts[static_cast<std::size_t>(type)];
    if (this->block.size() >= EnoughForBlock)
    {
      this->WriteBlock();
    }
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
  const InputBits bits = BitsOf(input);
  if (bits == data.last)
  {
    return;
  }
  // Bits of numbers that grow evenly have almost even differences, which pack well.
  std::uint64_t mask = 0;
  std::string changes;
  for (std::size_t axis = 0; axis < Axes; ++axis)
  {
    if (bits[axis] != data.last[axis])
    {
      mask |= std::uint64_t{ 1 } << axis;
      PutLittle(changes, bits[axis] - data.last[axis], 8);
    }
  }
  data.last = bits;
  std::string payload;
  PutLittle(payload, mask, 2);
  data.Put(RecordType::Input, tick, payload + changes);
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
  this->Data->WriteBlock();
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
  std::string payload;
  data.counts[0] = ticks;
  for (std::size_t n = 0; n < static_cast<std::size_t>(RecordType::End); ++n)
  {
    PutLittle(payload, data.counts[n], 8);
  }
  data.Put(RecordType::End, ticks, payload);
  data.WriteBlock();
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
  InputBits last = BitsOf(SessionInput());
  std::array<std::uint64_t, 8> counts{};
  std::string block; ///< that is being read
  std::size_t at = 0;
  bool torn = false; ///< the block has a beginning only

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

  bool BreaksOff()
  {
    return this->torn ? this->End(Ending::Torn, "its last block breaks off")
                      : this->Damaged("an item breaks off");
  }

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
        "; only version 2 is known.");
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
      this->header = HeaderOf(text, this->origin);
    }
    catch (const std::invalid_argument& error)
    {
      throw std::runtime_error(error.what());
    }
    this->bytes = start.size() + text.size();
  }

  bool NextBlock()
  {
    const std::string head = this->Take(BlockHead);
    if (head.size() < BlockHead)
    {
      return this->End(Ending::Torn, head.empty() ? "it has no end" : "its last block breaks off");
    }
    const auto packedSize = static_cast<std::uint32_t>(Little(&head[0], 4));
    const auto size = static_cast<std::uint32_t>(Little(&head[4], 4));
    if (size > MostBlock || packedSize > compressBound(MostBlock))
    {
      return this->Damaged("a block says that it has " + std::to_string(size) + " bytes");
    }
    const std::string packed = this->Take(packedSize);
    bool whole = false;
    this->block = Unpacked(packed, size, whole);
    this->at = 0;
    this->torn = packed.size() < packedSize;
    if (!whole && !this->torn)
    {
      return this->Damaged("the check sum of a block does not fit");
    }
    this->bytes += head.size() + packed.size();
    return true;
  }

  bool Read(RecordedItem& item)
  {
    while (this->ending == Ending::NotYet)
    {
      if (this->at >= this->block.size())
      {
        if (!this->NextBlock())
        {
          return false;
        }
        continue;
      }
      if (this->block.size() - this->at < ItemHead)
      {
        return this->BreaksOff();
      }
      const auto type = static_cast<std::uint8_t>(this->block[this->at]);
      const std::uint64_t size = Little(&this->block[this->at + 1], 4);
      const std::uint64_t gap = Little(&this->block[this->at + 5], 8);
      this->at += ItemHead;
      if (size > this->block.size() - this->at)
      {
        return this->BreaksOff();
      }
      if (gap >= MostTicks || this->lastTick + gap >= MostTicks)
      {
        return this->Damaged("an item's tick has no sense");
      }
      const std::string payload = this->block.substr(this->at, size);
      this->at += size;
      this->lastTick += gap;
      if (type < 1 || type > static_cast<std::uint8_t>(RecordType::End))
      {
        ++this->unknown;
        continue;
      }
      item.type = static_cast<RecordType>(type);
      item.tick = this->lastTick;
      if (item.type == RecordType::End && this->torn)
      {
        return this->BreaksOff();
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

  bool DecodeInput(const std::string& payload, RecordedItem& item)
  {
    const std::uint64_t mask = Little(&payload[0], 2);
    std::size_t place = 2;
    for (std::size_t axis = 0; axis < Axes; ++axis)
    {
      if ((mask >> axis & 1) == 0)
      {
        continue;
      }
      if (payload.size() < place + 8)
      {
        return this->Damaged("an input breaks off");
      }
      this->last[axis] += Little(&payload[place], 8);
      place += 8;
    }
    if (mask == 0 || mask >> Axes != 0)
    {
      return this->Damaged("an input has no sense");
    }
    item.input = InputOf(this->last);
    return true;
  }

  bool Decode(const std::string& payload, RecordedItem& item)
  {
    // What a later writer adds at the end of a payload is left alone.
    static constexpr std::array<std::size_t, 8> minimum{ 0, 2, 16, 9, 8, 8, 0, 56 };
    if (payload.size() < minimum[static_cast<std::size_t>(item.type)])
    {
      return this->Damaged("an item is too short for its type");
    }
    switch (item.type)
    {
      case RecordType::Input:
        return this->DecodeInput(payload, item);
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
        return this->Damaged("its end counts other items than there are");
      }
    }
    if (item.counts[0] != item.tick)
    {
      return this->Damaged("its end contradicts itself");
    }
    if (this->at < this->block.size() || this->stream->peek() != std::istream::traits_type::eof())
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

void RecordingReplay::ReadUpTo(std::uint64_t tick, bool step)
{
  while (!this->Over)
  {
    if (!this->HasAhead && !this->Source.Next(this->Ahead))
    {
      this->Over = true;
      return;
    }
    this->HasAhead = true;
    const RecordedItem& item = this->Ahead;
    // Inputs and events are of the step that comes; all others of the state before it.
    const bool ofStep = item.type == RecordType::Input || item.type == RecordType::Event;
    if (item.tick > tick ||
      (!step && item.tick == tick && (ofStep || item.type == RecordType::End)))
    {
      return;
    }
    this->HasAhead = false;
    this->Ticks = std::max(this->Ticks, item.tick + (ofStep ? 1 : 0));
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
        this->Ticks = item.tick;
        this->Over = true;
        break;
      default:
        break;
    }
  }
}

bool RecordingReplay::At(
  std::uint64_t tick, SessionInput& input, std::vector<RecordedEvent>& events)
{
  this->ReadUpTo(tick, true);
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
  this->ReadUpTo(tick, false);
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
