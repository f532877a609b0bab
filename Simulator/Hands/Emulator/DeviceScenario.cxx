#include "DeviceScenario.h"

#include "JsonFields.h"
#include "TextFile.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr std::size_t MostFaults = 100000;

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

/// What the device itself is, and what goes wrong with it.
void ReadDevice(JsonFields& fields, const std::string& origin, DeviceScenario& scenario)
{
  EmulatedDeviceSettings& device = scenario.device;
  device.serial = fields.Text("serial", device.serial);
  device.rate = static_cast<std::uint16_t>(fields.Whole("rate_hz", 1, 1000, device.rate));
  device.firstCount =
    static_cast<std::int32_t>(fields.Whole("first_count", -Most32, Most32, device.firstCount));
  scenario.repeat = fields.Flag("repeat", false);
  if (!fields.Has("faults"))
  {
    return;
  }
  std::vector<DeviceFault>& faults = scenario.faults;
  for (const nlohmann::json& entry : fields.List("faults"))
  {
    if (faults.size() == MostFaults)
    {
      fields.Refuse("has more than " + std::to_string(MostFaults) + " 'faults'");
    }
    faults.push_back(FaultOf(entry, origin + ", fault " + std::to_string(faults.size() + 1)));
  }
  std::stable_sort(faults.begin(), faults.end(),
    [](const DeviceFault& a, const DeviceFault& b) { return a.at < b.at; });
}
}

HandPlaces DeviceScenario::At(double seconds) const
{
  double left = std::max(0.0, seconds);
  AxisPlaces places = PlacesOf({});
  if (this->repeat && this->hands.Duration() > 0.0)
  {
    const double rounds = std::floor(left / this->hands.Duration());
    left -= rounds * this->hands.Duration();
    const AxisPlaces round = this->hands.Moved();
    for (std::size_t axis = 0; axis < HandAxes; ++axis)
    {
      places[axis] += rounds * round[axis];
    }
  }
  SessionInput start;
  SetPlaces(start, places);
  const SessionInput now = this->hands.At(left, start);
  places = PlacesOf(now);
  HandPlaces held;
  for (std::size_t axis = 0; axis < HandAxes; ++axis)
  {
    held.places[static_cast<std::size_t>(HandAxisTable[axis].kind)] = places[axis];
  }
  held.pedals = static_cast<std::uint16_t>(now.pedals);
  return held;
}

DeviceScenario DeviceScenarioFromText(const std::string& text, const std::string& origin)
{
  constexpr const char* oldFormat = "dynamiccoronary device scenario";
  const nlohmann::json json = ParseBoundedJson(text, origin);
  JsonFields fields(json, origin);
  DeviceScenario scenario;
  fields.Text("description", "");
  if (fields.Text("format") == oldFormat)
  {
    fields.RequireFormat(oldFormat, "script");
    ReadDevice(fields, origin, scenario);
    if (fields.Has("pieces"))
    {
      scenario.hands = DriveScriptOf(fields, PiecesOf::OldDevice);
    }
  }
  else
  {
    fields.RequireFormat("dynamiccoronary script", "script of driving");
    scenario.hands = DriveScriptOf(fields);
    if (fields.Has("device"))
    {
      JsonFields device(fields.Object("device"), origin + ", device");
      ReadDevice(device, origin, scenario);
      device.Done();
    }
  }
  fields.Done();
  return scenario;
}

DeviceScenario ReadDeviceScenario(const std::string& path)
{
  return DeviceScenarioFromText(ReadTextFile(path, "a script"), "'" + path + "'");
}
}
