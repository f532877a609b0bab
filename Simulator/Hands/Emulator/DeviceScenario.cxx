#include "DeviceScenario.h"

#include "JsonFields.h"
#include "SessionInput.h"
#include "TextFile.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr std::size_t MostEntries = 100000;
constexpr double Furthest = 1e6;

struct PedalName
{
  const char* name;
  Pedal bit;
};
constexpr PedalName Pedals[] = { { "fluoroscopy", FluoroscopyPedal }, { "cine", CinePedal },
  { "mask", MaskPedal } };

struct FaultName
{
  const char* name;
  FaultKind kind;
  bool counts; ///< has 'count', else 'ms' or nothing
  bool lasts;
  std::int64_t minimum;
  std::int64_t most;
};
constexpr std::int64_t Most32 = std::numeric_limits<std::int32_t>::max();
constexpr FaultName Faults[] = { { "drop_bytes", FaultKind::DropBytes, true, false, 1, 1000000 },
  { "flip_bits", FaultKind::FlipBits, true, false, 1, 1000000 },
  { "duplicate", FaultKind::Duplicate, true, false, 1, 1000000 },
  { "reorder", FaultKind::Reorder, true, false, 1, 1000000 },
  { "stop", FaultKind::Stop, false, true, 0, 0 }, { "close", FaultKind::Close, false, true, 0, 0 },
  { "jump_counts", FaultKind::JumpCounts, true, false, -Most32, Most32 },
  { "rate", FaultKind::Rate, true, false, 1, 1000 },
  { "garbage", FaultKind::Garbage, true, false, 1, 1000000 },
  { "wrong_version", FaultKind::WrongVersion, false, false, 0, 0 },
  { "wrong_magic", FaultKind::WrongMagic, false, false, 0, 0 } };

std::uint16_t PedalsOf(JsonFields& fields)
{
  unsigned pedals = 0;
  if (!fields.Has("pedals"))
  {
    return 0;
  }
  for (const nlohmann::json& entry : fields.List("pedals"))
  {
    const auto found = std::find_if(std::begin(Pedals), std::end(Pedals),
      [&](const PedalName& one) { return entry == one.name; });
    if (found == std::end(Pedals))
    {
      fields.Refuse("has other 'pedals' than \"fluoroscopy\", \"cine\" and \"mask\"");
    }
    pedals |= found->bit;
  }
  return static_cast<std::uint16_t>(pedals);
}

HandPiece PieceOf(const nlohmann::json& entry, const std::string& where)
{
  JsonFields fields(entry, where);
  HandPiece piece;
  piece.seconds = fields.Number("seconds", 0.0, 36000.0);
  for (const HandAxis& axis : HandAxisTable)
  {
    if (axis.kind <= AxisKind::Secondary) // what the emulated device has
    {
      const char* name = axis.kind == AxisKind::Syringe ? "syringe_mL" : axis.scripted;
      piece.change[static_cast<std::size_t>(axis.kind)] =
        axis.scriptUnit * fields.Number(name, -Furthest, Furthest, 0.0);
    }
  }
  piece.pedals = PedalsOf(fields);
  fields.Done();
  return piece;
}

DeviceFault FaultOf(const nlohmann::json& entry, const std::string& where)
{
  JsonFields fields(entry, where);
  DeviceFault fault;
  fault.at = fields.Number("at", 0.0, 1e6);
  const std::string kind = fields.Text("kind");
  const auto found = std::find_if(
    std::begin(Faults), std::end(Faults), [&](const FaultName& one) { return kind == one.name; });
  if (found == std::end(Faults))
  {
    fields.Refuse("has 'kind' \"" + kind.substr(0, 40) + "\", which is no fault that is known");
  }
  fault.kind = found->kind;
  if (found->counts)
  {
    fault.count = fields.Whole("count", found->minimum, found->most, 1);
  }
  if (found->lasts)
  {
    fault.milliseconds = fields.Number("ms", 0.0, 1e6);
  }
  fields.Done();
  return fault;
}

template <typename Entry, typename Reader>
std::vector<Entry> EntriesOf(
  JsonFields& fields, const char* name, const std::string& what, const Reader& read)
{
  std::vector<Entry> entries;
  if (!fields.Has(name))
  {
    return entries;
  }
  for (const nlohmann::json& entry : fields.List(name))
  {
    if (entries.size() == MostEntries)
    {
      fields.Refuse("has more than " + std::to_string(MostEntries) + " '" + name + "'");
    }
    entries.push_back(
      read(entry, fields.Where() + ", " + what + " " + std::to_string(entries.size() + 1)));
  }
  return entries;
}

void Add(HandPlaces& to, const HandPiece& piece, double share)
{
  for (std::size_t n = 0; n < to.places.size(); ++n)
  {
    to.places[n] += share * piece.change[n];
  }
}
}

HandPlaces DeviceScenario::At(double seconds) const
{
  HandPlaces hands;
  HandPiece round;
  for (const HandPiece& piece : this->pieces)
  {
    round.seconds += piece.seconds;
    for (std::size_t n = 0; n < round.change.size(); ++n)
    {
      round.change[n] += piece.change[n];
    }
  }
  double left = std::max(0.0, seconds);
  if (this->repeat && round.seconds > 0.0)
  {
    const double rounds = std::floor(left / round.seconds);
    Add(hands, round, rounds);
    left -= rounds * round.seconds;
  }
  for (const HandPiece& piece : this->pieces)
  {
    if (left < piece.seconds)
    {
      Add(hands, piece, left / piece.seconds);
      hands.pedals = piece.pedals;
      return hands;
    }
    Add(hands, piece, 1.0);
    left -= piece.seconds;
  }
  return hands;
}

DeviceScenario DeviceScenarioFromText(const std::string& text, const std::string& origin)
{
  const nlohmann::json json = ParseBoundedJson(text, origin);
  JsonFields fields(json, origin);
  fields.RequireFormat("dynamiccoronary device scenario", "scenario of a device");
  fields.Text("description", "");
  DeviceScenario scenario;
  EmulatedDeviceSettings& device = scenario.device;
  device.serial = fields.Text("serial", device.serial);
  device.rate = static_cast<std::uint16_t>(fields.Whole("rate_hz", 1, 1000, device.rate));
  device.firstCount =
    static_cast<std::int32_t>(fields.Whole("first_count", -Most32, Most32, device.firstCount));
  scenario.repeat = fields.Flag("repeat", false);
  scenario.pieces = EntriesOf<HandPiece>(fields, "pieces", "piece", PieceOf);
  scenario.faults = EntriesOf<DeviceFault>(fields, "faults", "fault", FaultOf);
  fields.Done();
  std::stable_sort(scenario.faults.begin(), scenario.faults.end(),
    [](const DeviceFault& a, const DeviceFault& b) { return a.at < b.at; });
  return scenario;
}

DeviceScenario ReadDeviceScenario(const std::string& path)
{
  return DeviceScenarioFromText(ReadTextFile(path, "a scenario of a device"), "'" + path + "'");
}
}
