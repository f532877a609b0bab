#include "DeviceMux.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr std::size_t ViewGroup = 3;

struct GroupPlaces
{
  std::uint32_t axes;
  std::size_t first;
  std::size_t end;
};
constexpr std::array<GroupPlaces, DeviceMux::Groups> GroupTable{ { { WireAxes, 0, 2 },
  { CatheterAxes, 2, 4 }, { SyringeAxis, 4, 5 }, { ViewAxes, 5, 11 }, { BalloonAxes, 11, 13 } } };

double Limited(double value, const HandAxis& axis)
{
  return std::clamp(value, axis.low, axis.high);
}
}

void DeviceMux::Add(std::shared_ptr<Device> device)
{
  if (!device)
  {
    throw std::invalid_argument("A mux needs devices that exist.");
  }
  this->All.push_back(std::move(device));
  this->Sources.resize(this->All.size());
  this->Sources.back().noisy = this->All.back()->IsNoisy();
}

void DeviceMux::Start(const ViewPlace& view)
{
  this->Place(view);
}

void DeviceMux::Place(const ViewPlace& view)
{
  const AxisPlaces wanted{ 0, 0, 0, 0, 0, view.primary, view.secondary, view.sourceToDetector,
    view.table[0], view.table[1], view.table[2] };
  const GroupPlaces& places = GroupTable[ViewGroup];
  for (std::size_t n = places.first; n < places.end; ++n)
  {
    if (std::isfinite(wanted[n]))
    {
      const double place = Limited(wanted[n], HandAxisTable[n]);
      this->Offset[n] += place - this->Now[n];
      this->Now[n] = place;
    }
  }
}

const SessionInput& DeviceMux::Next(std::uint64_t tick, double secondsPerTick)
{
  this->RestTicks = static_cast<std::uint64_t>(RestSeconds / secondsPerTick);
  this->ReadAll(tick, secondsPerTick);
  for (std::size_t group = 0; group < Groups; ++group)
  {
    for (Source& source : this->Sources)
    {
      this->NoteMovement(source, group, tick);
    }
    this->Arbitrate(group, tick);
    this->Follow(group);
  }
  ViewPlace view;
  if (this->WantedView.Read(view))
  {
    this->Place(view);
  }
  this->Finish();
  return this->Output;
}

void DeviceMux::ReadAll(std::uint64_t tick, double secondsPerTick)
{
  for (std::size_t n = 0; n < this->All.size(); ++n)
  {
    this->All[n]->Read(tick, secondsPerTick, this->Sources[n].frame);
    this->Sources[n].places = PlacesOf(this->Sources[n].frame.input);
  }
}

bool DeviceMux::Source::Drives(std::size_t group) const
{
  return this->frame.state == DeviceState::Running &&
    (this->frame.axes & GroupTable[group].axes) != 0;
}

void DeviceMux::NoteMovement(Source& source, std::size_t group, std::uint64_t tick)
{
  Hand& hand = source.hands[group];
  const GroupPlaces& places = GroupTable[group];
  bool moved = false;
  for (std::size_t n = places.first; n < places.end; ++n)
  {
    const double noise = source.noisy ? HandAxisTable[n].tremble : 0.0;
    moved = moved || std::abs(source.places[n] - hand.reference[n]) > noise;
  }
  if (!hand.seen || moved)
  {
    std::copy(source.places.begin(), source.places.end(), hand.reference.begin());
    hand.restsAt = hand.seen ? tick + this->RestTicks : tick;
    hand.seen = true;
  }
  hand.moves = tick < hand.restsAt && source.Drives(group);
  hand.fresh = hand.fresh || tick >= hand.restsAt;
}

void DeviceMux::Arbitrate(std::size_t group, std::uint64_t tick)
{
  const int owner = this->Owner[group].load(std::memory_order_relaxed);
  const bool lost = owner >= 0 && !this->Sources[static_cast<std::size_t>(owner)].Drives(group);
  if (lost && !this->Held[group])
  {
    this->RestAnew(group, tick);
  }
  this->Held[group] = lost;
  const bool free =
    owner < 0 || lost || !this->Sources[static_cast<std::size_t>(owner)].hands[group].moves;
  for (std::size_t n = 0; n < this->Sources.size(); ++n)
  {
    Source& source = this->Sources[n];
    Hand& hand = source.hands[group];
    if (static_cast<int>(n) == owner || !source.Drives(group))
    {
      continue;
    }
    const bool earlier = static_cast<int>(n) < owner;
    const bool byMoving = hand.moves && hand.fresh && (free || earlier);
    const bool byRank = earlier && free && hand.fresh;
    if (owner < 0 || byMoving || byRank)
    {
      this->TakeOver(group, n);
      return;
    }
    hand.fresh = hand.fresh && !hand.moves;
  }
}

void DeviceMux::RestAnew(std::size_t group, std::uint64_t tick)
{
  for (Source& source : this->Sources)
  {
    Hand& hand = source.hands[group];
    hand.fresh = false;
    hand.moves = false;
    hand.restsAt = std::max(hand.restsAt, tick + this->RestTicks);
  }
}

void DeviceMux::TakeOver(std::size_t group, std::size_t source)
{
  const GroupPlaces& places = GroupTable[group];
  const bool asItIs = !this->Begun[group] && this->All[source]->IsScripted();
  for (std::size_t n = places.first; n < places.end; ++n)
  {
    this->Offset[n] = asItIs ? 0.0 : this->Now[n] - this->Sources[source].places[n];
  }
  this->Begun[group] = true;
  this->Held[group] = false;
  this->Owner[group].store(static_cast<int>(source), std::memory_order_relaxed);
}

void DeviceMux::Follow(std::size_t group)
{
  const int owner = this->Owner[group].load(std::memory_order_relaxed);
  if (owner < 0 || this->Held[group])
  {
    return;
  }
  const Source& source = this->Sources[static_cast<std::size_t>(owner)];
  const GroupPlaces& places = GroupTable[group];
  for (std::size_t n = places.first; n < places.end; ++n)
  {
    const double wanted = source.places[n] + this->Offset[n];
    this->Now[n] = Limited(wanted, HandAxisTable[n]);
    if (this->Now[n] != wanted) // turning back at the end works at once
    {
      this->Offset[n] = this->Now[n] - source.places[n];
    }
  }
}

void DeviceMux::Finish()
{
  SessionInput& output = this->Output;
  SetPlaces(output, this->Now);
  output.pedals = 0;
  for (const Source& source : this->Sources)
  {
    output.pedals |= source.frame.input.pedals;
  }
}

void DeviceMux::Command(const ForceFrame& forces)
{
  for (const std::shared_ptr<Device>& device : this->All)
  {
    device->Command(forces);
  }
}

void DeviceMux::Heartbeat(std::uint64_t tick)
{
  for (const std::shared_ptr<Device>& device : this->All)
  {
    device->Heartbeat(tick);
  }
}
}
