#include "RecordedDevices.h"

#include "Recording.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
/// Hz; rates are whole mostly, and times that are made of them are to have the same bits everywhere.
double RateOf(double secondsPerTick)
{
  const double rate = 1.0 / secondsPerTick;
  const double whole = std::round(rate);
  return std::abs(rate - whole) < 1e-9 * rate ? whole : rate;
}
}

ScriptDevice::ScriptDevice(DriveScript script, std::string name, const SessionInput& start)
  : Script(std::move(script))
  , Name(std::move(name))
  , Start(start)
{
}

void ScriptDevice::Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame)
{
  const double seconds = static_cast<double>(tick + 1) / RateOf(secondsPerTick);
  frame = {};
  frame.input = this->Script.At(seconds, this->Start);
  frame.axes = AllAxes;
  const bool over = seconds >= this->Script.Duration() + secondsPerTick;
  frame.state = over ? DeviceState::Ended : DeviceState::Running;
  frame.input.pedals = over ? 0 : frame.input.pedals;
}

DeviceStatus ScriptDevice::Status() const
{
  DeviceStatus status;
  status.state = DeviceState::Running;
  status.text =
    "'" + this->Name + "' drives for " + std::to_string(this->Script.Duration()) + " s.";
  return status;
}

ReplayDevice::ReplayDevice(const std::string& path)
  : Name(path)
{
  RecordingReader reader(path);
  this->Rate = reader.Header().tickRate;
  RecordedItem item;
  while (reader.Next(item))
  {
    this->TickCount = std::max(this->TickCount, item.tick);
    if (item.type != RecordType::Input)
    {
      continue;
    }
    this->TickCount = std::max(this->TickCount, item.tick + 1);
    if (this->Changes.size() == MostChanges)
    {
      throw std::runtime_error("'" + path + "' has more than " + std::to_string(MostChanges) +
        " changes of input, and can not be a device.");
    }
    this->Changes.push_back({ item.tick, item.input });
  }
  this->Ending =
    reader.HowEnded() == RecordingReader::Ending::Complete ? "" : " " + reader.EndingText();
}

void ReplayDevice::Read(std::uint64_t tick, double secondsPerTick, InputFrame& frame)
{
  const double rate = RateOf(secondsPerTick);
  const std::uint64_t recorded = rate == this->Rate
    ? tick
    : static_cast<std::uint64_t>(static_cast<double>(tick) * this->Rate / rate + 1e-6);
  const auto after = std::upper_bound(this->Changes.begin(), this->Changes.end(), recorded,
    [](std::uint64_t wanted, const Change& change) { return wanted < change.tick; });
  frame = {};
  frame.axes = AllAxes;
  if (after != this->Changes.begin())
  {
    frame.input = std::prev(after)->input;
  }
  const bool over = recorded >= this->TickCount;
  frame.state = over ? DeviceState::Ended : DeviceState::Running;
  frame.input.pedals = over ? 0 : frame.input.pedals;
}

DeviceStatus ReplayDevice::Status() const
{
  DeviceStatus status;
  status.state = DeviceState::Running;
  status.text = "'" + this->Name + "' drives for " +
    std::to_string(static_cast<double>(this->TickCount) / this->Rate) + " s." + this->Ending;
  return status;
}
}
