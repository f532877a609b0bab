#include "BranchMouths.h"

#include "Numbers.h"
#include "VesselLesions.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double MouthLength = 4.0;   // mm of the branch that are narrowed
constexpr double Beside = 3.0;        // mm of the vessel beside the mouth that count
constexpr double Before = 2.0;        // mm of the parent before it, likewise
constexpr double AngleAlong = 6.0;    // mm on which directions are taken
constexpr double SmallestStep = 0.05; // of the parent's radius, from it to the vessel beside
constexpr double Some = 0.02;         // mm that a section is held wider than it was

/// The part of an axis from a point on, mm from there.
std::vector<double> AlongFrom(const std::vector<Vector3>& axis, std::size_t first)
{
  std::vector<double> along(axis.size(), 0.0);
  for (std::size_t k = first + 1; k < axis.size(); ++k)
  {
    along[k] = along[k - 1] + (axis[k] - axis[k - 1]).norm();
  }
  for (std::size_t k = first; k > 0; --k)
  {
    along[k - 1] = along[k] - (axis[k] - axis[k - 1]).norm();
  }
  return along;
}

std::size_t NearestTo(const std::vector<Vector3>& axis, const Vector3& point)
{
  std::size_t nearest = 0;
  for (std::size_t k = 1; k < axis.size(); ++k)
  {
    nearest = (axis[k] - point).squaredNorm() < (axis[nearest] - point).squaredNorm() ? k : nearest;
  }
  return nearest;
}

Vector3 Direction(
  const std::vector<Vector3>& axis, const std::vector<double>& along, double from, double to)
{
  const auto at = [&](double place)
  {
    const auto after = std::lower_bound(along.begin(), along.end(), place);
    return axis[std::min<std::size_t>(
      static_cast<std::size_t>(after - along.begin()), axis.size() - 1)];
  };
  const Vector3 way = at(to) - at(from);
  return way.norm() > 0.0 ? Vector3(way.normalized()) : Vector3(Vector3::UnitZ());
}
}

BranchMouths::BranchMouths(const WallTopology& topology)
  : Parent(topology.parent)
{
  const std::vector<std::vector<double>> reference = ReferenceRadii(topology);
  const auto count = static_cast<int>(topology.axis.size());
  for (int branch = 0; branch < count; ++branch)
  {
    const int parent = this->Parent[static_cast<std::size_t>(branch)];
    if (parent < 0 || topology.axis[branch].size() < 3)
    {
      continue;
    }
    const std::vector<Vector3>& axis = topology.axis[parent];
    const std::size_t at = NearestTo(axis, topology.axis[branch].front());
    if (at + 1 < axis.size())
    {
      this->Add(topology, reference, branch, parent);
      continue;
    }
    // At the parent's end each is a side branch of each other one.
    for (int beside = 0; beside < count; ++beside)
    {
      if (beside != branch && this->Parent[static_cast<std::size_t>(beside)] == parent &&
        NearestTo(axis, topology.axis[beside].front()) == at)
      {
        this->Add(topology, reference, branch, beside);
      }
    }
  }
}

void BranchMouths::Add(const WallTopology& topology,
  const std::vector<std::vector<double>>& reference, int branch, int beside)
{
  const int parent = this->Parent[static_cast<std::size_t>(branch)];
  const std::vector<Vector3>& axis = topology.axis[parent];
  const std::size_t at = NearestTo(axis, topology.axis[branch].front());
  const std::vector<double> along = AlongFrom(axis, at);
  BranchMouth mouth;
  mouth.branch = branch;
  mouth.beside = beside;
  mouth.at = FirstAxisPoint(topology, parent) + static_cast<std::int64_t>(at);
  for (std::size_t k = 0; k <= at; ++k)
  {
    if (along[k] >= -Before)
    {
      mouth.before.push_back(FirstAxisPoint(topology, parent) + static_cast<std::int64_t>(k));
      mouth.parentRadius = std::max(mouth.parentRadius, reference[parent][k]);
    }
  }
  // Beyond the bifurcation's own width.
  const std::vector<Vector3>& other = topology.axis[beside];
  const std::size_t first = beside == parent ? at : 0;
  const std::vector<double> further = AlongFrom(other, first);
  for (std::size_t k = first; k < other.size(); ++k)
  {
    const double place = further[k] - mouth.parentRadius;
    if (place >= 0.0 && place <= Beside)
    {
      mouth.beyond.push_back(FirstAxisPoint(topology, beside) + static_cast<std::int64_t>(k));
      mouth.besideRadius = std::max(mouth.besideRadius, reference[beside][k]);
    }
  }
  const std::vector<Vector3>& own = topology.axis[branch];
  const std::vector<double> inside = AlongFrom(own, 0);
  for (std::size_t k = 0; k < own.size(); ++k)
  {
    const double part = (inside[k] - mouth.parentRadius) / MouthLength;
    if (part > 0.0 && part < 1.0)
    {
      const double wave = std::sin(Pi * part);
      mouth.own.emplace_back(
        FirstAxisPoint(topology, branch) + static_cast<std::int64_t>(k), wave * wave);
      mouth.degreeBefore =
        std::max(mouth.degreeBefore, 1.0 - topology.axisRadius[branch][k] / reference[branch][k]);
    }
  }
  mouth.degree = mouth.degreeBefore;
  mouth.cosine = std::max(0.0,
    Direction(axis, along, -AngleAlong, 0.0)
      .dot(Direction(own, inside, mouth.parentRadius, mouth.parentRadius + AngleAlong)));
  if (!mouth.own.empty() && !mouth.beyond.empty())
  {
    this->Mouths.push_back(std::move(mouth));
  }
}

bool BranchMouths::IsBehind(int branch, int ancestor) const
{
  while (branch >= 0 && branch != ancestor)
  {
    branch = this->Parent[static_cast<std::size_t>(branch)];
  }
  return branch >= 0;
}

void BranchMouths::Answer(const std::vector<int>& within, DilatableWall& wall)
{
  for (BranchMouth& mouth : this->Mouths)
  {
    this->Answer(mouth,
      std::any_of(within.begin(), within.end(),
        [&](int branch) { return this->IsBehind(branch, mouth.branch); }),
      wall);
  }
}

void BranchMouths::Answer(BranchMouth& mouth, bool wired, DilatableWall& wall) const
{
  const auto opened = [&](std::int64_t point)
  { return wall.Radii()[point] > wall.Stations()[point].rest + Some; };
  double widest = 0.0;
  bool stented = false;
  for (const std::int64_t point : mouth.beyond)
  {
    if (opened(point))
    {
      widest = std::max(widest, wall.Radii()[point]);
      stented = stented || !wall.Rings(point).empty();
    }
  }
  const bool across = widest > 0.0 &&
    std::any_of(mouth.before.begin(), mouth.before.end(),
      [&](std::int64_t point) { return opened(point) || !wall.Rings(point).empty(); });
  const double step =
    std::max(mouth.parentRadius - mouth.besideRadius, SmallestStep * mouth.parentRadius);
  const double shift = across ? std::clamp((widest - mouth.besideRadius) / step, 0.0, 1.0) : 0.0;
  const double kept = stented ? std::max(mouth.shift, shift) : shift;
  const bool more = kept > mouth.shift;
  double wanted = 0.0; // narrowing, if nothing kept it open
  const bool changes = kept != mouth.shift;
  if (changes)
  {
    mouth.shift = kept;
    const double narrowing = kept * mouth.cosine;
    for (const auto& [point, part] : mouth.own)
    {
      const WallStation& station = wall.Stations()[point];
      const double free = station.rest / station.reference + station.plastic;
      wanted = std::max(wanted, 1.0 - (1.0 - narrowing * part) * free);
      wall.Pinch(point, narrowing * part, wired ? LeastRadius : ChannelRadius);
    }
  }
  if (kept == 0.0 && !changes && !mouth.closed)
  {
    return;
  }
  double narrowest = 0.0;
  for (const auto& [point, part] : mouth.own)
  {
    narrowest = std::max(narrowest, 1.0 - wall.Radii()[point] / wall.Stations()[point].reference);
  }
  mouth.closed = (mouth.closed && narrowest > ReopenedAt) || (more && !wired && wanted >= ClosesAt);
  mouth.degree = mouth.closed ? 1.0 : narrowest;
}
}
