#include "VesselIncidents.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
/// From 0 to 1 while x does.
double HalfCosine(double x)
{
  return 0.5 - 0.5 * std::cos(Pi * std::clamp(x, 0.0, 1.0));
}
}

std::vector<int> VesselIncidents::BranchesNamed(const std::string& vessel) const
{
  std::vector<int> found;
  std::string names;
  const std::vector<std::string>& all = this->Network.Topology().groupName;
  for (std::size_t b = 0; b < all.size(); ++b)
  {
    if (all[b] == vessel)
    {
      found.push_back(static_cast<int>(b));
    }
    else if (!all[b].empty() && names.find("'" + all[b] + "'") == std::string::npos)
    {
      names += (names.empty() ? "'" : ", '") + all[b] + "'";
    }
  }
  if (found.empty())
  {
    throw std::invalid_argument("An event is in the vessel '" + vessel +
      "', which is not there; there are " + (names.empty() ? "none" : names) + ".");
  }
  return found;
}

void VesselIncidents::BeginSpasm(const std::string& vessel, double narrowing, double onset)
{
  Spasm spasm;
  spasm.branches = this->BranchesNamed(vessel);
  spasm.narrowing = narrowing;
  spasm.onset = onset;
  this->Spasms.push_back(std::move(spasm));
}

int VesselIncidents::AddAir(
  double volume, const std::string& vessel, const std::vector<double>& flow, int root)
{
  const std::vector<FlowSegment>& segments = this->Network.Segments();
  const int start = vessel.empty() ? root : this->BranchesNamed(vessel).front();
  for (Bubble& other : this->Bubbles)
  {
    if (other.volume > 0.0 && other.way.front() == start)
    {
      // It follows what is there already.
      other.volume += volume;
      other.rests = 0.0;
      return other.way.back();
    }
  }
  Bubble bubble;
  bubble.volume = volume;
  bubble.way.push_back(start);
  // At each node into the greatest flow.
  int segment = this->Network.Branches()[start].segments.front();
  while (!this->Network.IsTip(segments[segment].below))
  {
    const std::vector<int>& below = this->Network.Nodes()[segments[segment].below].below;
    segment = *std::max_element(
      below.begin(), below.end(), [&](int a, int b) { return flow[a] < flow[b]; });
    if (segments[segment].branch != bubble.way.back())
    {
      bubble.way.push_back(segments[segment].branch);
    }
  }
  this->Bubbles.push_back(bubble);
  return bubble.way.back();
}

void VesselIncidents::GiveNitrates()
{
  for (Spasm& spasm : this->Spasms)
  {
    if (spasm.relaxes < 0.0)
    {
      spasm.relaxes = 0.0;
      spasm.from = spasm.level;
    }
  }
}

void VesselIncidents::Step(double seconds, double drawn)
{
  for (Spasm& spasm : this->Spasms)
  {
    spasm.age += seconds;
    if (spasm.relaxes < 0.0)
    {
      spasm.level = HalfCosine(spasm.age / spasm.onset);
    }
    else
    {
      spasm.relaxes += seconds;
      spasm.level = spasm.from * (1.0 - HalfCosine(spasm.relaxes / Relaxation));
    }
  }
  double aspirated = 0.1 * drawn;
  for (Bubble& bubble : this->Bubbles)
  {
    bubble.volume *= std::exp(-seconds / Absorption);
    const double part = std::min(aspirated, bubble.volume);
    bubble.volume -= part;
    aspirated -= part;
    bubble.rests += seconds;
    bubble.volume = bubble.volume < Least && bubble.rests > 1.0 ? 0.0 : bubble.volume;
  }
}

bool VesselIncidents::Blocked() const
{
  return this->Air() > 0.0;
}

double VesselIncidents::Air() const
{
  double sum = 0.0;
  for (const Bubble& bubble : this->Bubbles)
  {
    sum += bubble.volume;
  }
  return sum;
}

double VesselIncidents::Narrowing() const
{
  double most = 0.0;
  for (const Spasm& spasm : this->Spasms)
  {
    most = std::max(most, spasm.narrowing * spasm.level);
  }
  return most;
}

void VesselIncidents::Apply(std::vector<double>& lumen, std::vector<double>& filled) const
{
  const std::vector<int>& parents = this->Network.Topology().parent;
  for (const Spasm& spasm : this->Spasms)
  {
    const auto has = [&](int b)
    { return std::find(spasm.branches.begin(), spasm.branches.end(), b) != spasm.branches.end(); };
    for (const int b : spasm.branches)
    {
      const FlowBranch& branch = this->Network.Branches()[b];
      // A segment may be several branches, one behind the other.
      const bool begins = !has(parents[b]);
      const bool ends = std::none_of(
        spasm.branches.begin(), spasm.branches.end(), [&](int c) { return parents[c] == b; });
      const double end = branch.abscissa.back();
      const double taper = std::min(EndLength, 0.5 * end);
      for (std::size_t k = 0; k < branch.abscissa.size() && spasm.level > 0.0; ++k)
      {
        const double within =
          std::min(begins ? branch.abscissa[k] : taper, ends ? end - branch.abscissa[k] : taper);
        lumen[static_cast<std::size_t>(branch.firstPoint) + k] *=
          1.0 - spasm.narrowing * spasm.level * HalfCosine(within / taper);
      }
    }
  }
  for (const Bubble& bubble : this->Bubbles)
  {
    double left = bubble.volume;
    for (auto b = bubble.way.rbegin(); b != bubble.way.rend() && left > 0.0; ++b)
    {
      const FlowBranch& branch = this->Network.Branches()[*b];
      for (std::size_t k = branch.abscissa.size(); k-- > 0 && left > 0.0;)
      {
        const std::size_t point = static_cast<std::size_t>(branch.firstPoint) + k;
        filled[point] = lumen[point];
        left -= k > 0 ? branch.volume[k] - branch.volume[k - 1] : 0.0;
      }
    }
  }
}
}
