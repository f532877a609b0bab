#include "GuideLumen.h"

#include "Fnv1a.h"
#include "Numbers.h"

#include <algorithm>
#include <numeric>

namespace coronary
{
namespace
{
bool Same(const GuideLumen::Plug& a, const GuideLumen::Plug& b)
{
  return a.air == b.air && a.medium == b.medium;
}

void Count(const GuideLumen::Plug& plug, double volume, GuideLumen::Outflow& out)
{
  (plug.air ? out.air : out.liquid) += volume;
  out.medium += plug.medium * volume;
}

/// Takes a volume off an end.
template <typename End, typename Pop>
GuideLumen::Outflow Taken(std::deque<GuideLumen::Plug>& plugs, double volume, End end, Pop pop)
{
  GuideLumen::Outflow out;
  while (volume > 0.0 && !plugs.empty())
  {
    GuideLumen::Plug& plug = end();
    const double part = std::min(volume, plug.volume);
    Count(plug, part, out);
    volume -= part;
    plug.volume -= part;
    if (plug.volume == 0.0)
    {
      pop();
    }
  }
  return out;
}
}

GuideLumen::GuideLumen(double radius, double length)
  : Volume_(1e-3 * Pi * radius * radius * length)
  , Plugs_{ { this->Volume_, 0.0, false } }
{
}

GuideLumen::Outflow GuideLumen::Push(const Plug& plug)
{
  if (plug.volume <= 0.0)
  {
    return {};
  }
  if (!this->Plugs_.empty() && Same(this->Plugs_.back(), plug))
  {
    this->Plugs_.back().volume += plug.volume;
  }
  else
  {
    this->Plugs_.push_back(plug);
  }
  return Taken(
    this->Plugs_, plug.volume, [this]() -> Plug& { return this->Plugs_.front(); },
    [this] { this->Plugs_.pop_front(); });
}

GuideLumen::Outflow GuideLumen::Draw(double volume)
{
  if (volume <= 0.0)
  {
    return {};
  }
  const Plug blood{ volume, 0.0, false };
  if (Same(this->Plugs_.front(), blood))
  {
    this->Plugs_.front().volume += volume;
  }
  else
  {
    this->Plugs_.push_front(blood);
  }
  return Taken(
    this->Plugs_, volume, [this]() -> Plug& { return this->Plugs_.back(); },
    [this] { this->Plugs_.pop_back(); });
}

double GuideLumen::Medium() const
{
  return std::accumulate(this->Plugs_.begin(), this->Plugs_.end(), 0.0,
    [](double sum, const Plug& plug) { return sum + plug.medium * plug.volume; });
}

double GuideLumen::Air() const
{
  return std::accumulate(this->Plugs_.begin(), this->Plugs_.end(), 0.0,
    [](double sum, const Plug& plug) { return sum + (plug.air ? plug.volume : 0.0); });
}

std::uint64_t GuideLumen::Hash(std::uint64_t hash) const
{
  for (const Plug& plug : this->Plugs_)
  {
    const double values[] = { plug.volume, plug.medium, plug.air ? 1.0 : 0.0 };
    hash = Fnv1a(values, sizeof(values), hash);
  }
  return hash;
}
}
