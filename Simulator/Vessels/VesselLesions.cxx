#include "VesselLesions.h"

#include "Numbers.h"
#include "PhantomMotion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double LesionEdge = 0.1; // of the diameter
constexpr double LookAhead = 5.0;  // mm behind a bifurcation, where a branch has its own calibre
// Parent's radii along a side branch: up to there the wall is the parent's, from there on its own.
constexpr double MouthBegins = 1.0;
constexpr double MouthEnds = 3.0;
constexpr double Stump = 3.0; // mm on which a vessel narrows to its occlusion

double RadiusAhead(const WallTopology& topology, int branch)
{
  const std::vector<Vector3>& axis = topology.axis[branch];
  std::size_t k = 0;
  for (double along = 0.0; k + 1 < axis.size() && along < LookAhead; ++k)
  {
    along += (axis[k + 1] - axis[k]).norm();
  }
  return topology.axisRadius[branch][k];
}

/// The point of an axis that is nearest to a place.
std::size_t NearestPoint(const std::vector<Vector3>& axis, const Vector3& place)
{
  const auto nearest = std::min_element(axis.begin(), axis.end(),
    [&](const Vector3& a, const Vector3& b)
    { return (a - place).squaredNorm() < (b - place).squaredNorm(); });
  return static_cast<std::size_t>(nearest - axis.begin());
}

void RequireLesion(
  const VesselLesion& lesion, double value, double low, double high, const char* what)
{
  if (!(value >= low && value <= high))
  {
    throw std::invalid_argument("The lesion of '" + lesion.vessel + "' has " + what + " of " +
      std::to_string(value) + ", not " + std::to_string(low) + " to " + std::to_string(high) + ".");
  }
}

void RequireLesion(const VesselLesion& lesion)
{
  const bool occludes = lesion.degree == 1.0;
  RequireLesion(lesion, lesion.length, occludes ? 4.0 : 2.0, 60.0, "a length (mm)");
  if (!occludes)
  {
    RequireLesion(lesion, lesion.degree, 0.0, 0.95, "a degree (other than 1)");
  }
  RequireLesion(lesion, lesion.calciumArc, 0.0, 360.0, "a calcium arc (degrees)");
  RequireLesion(lesion, lesion.strength, 0.1, 100.0, "a strength of its cap (MPa)");
}

/// Of an occlusion: how far the vessel is narrowed to its channel; 1: tissue fills it. @param away  of the length
double FilledShare(const VesselLesion& lesion, double away)
{
  const double inside = (0.5 - std::abs(away)) * lesion.length; // mm from its nearer end
  return SmoothStep(inside / std::min(Stump, 0.25 * lesion.length));
}

bool IsOccluded(const WallTopology& topology, int branch, std::size_t k)
{
  return !topology.axisOcclusion.empty() && topology.axisOcclusion[branch][k] > 0.0;
}

/// Points of what is one vessel, from where it begins. @param visit  branch, point  @param end  after the last one
template <typename Visit, typename End>
void AlongVessels(const WallTopology& topology, const Visit& visit, const End& end)
{
  for (std::size_t root = 0; root < topology.axis.size(); ++root)
  {
    const int parent = topology.parent[root];
    if (parent >= 0 && GoesOnAs(topology, parent) == static_cast<int>(root))
    {
      continue; // looked through with its parent
    }
    for (int b = static_cast<int>(root); b >= 0; b = GoesOnAs(topology, b))
    {
      for (std::size_t k = 0; k < topology.axis[b].size(); ++k)
      {
        visit(b, k);
      }
    }
    end();
  }
}
}

std::int64_t FirstAxisPoint(const WallTopology& topology, int branch)
{
  std::int64_t first = 0;
  for (int b = 0; b < branch; ++b)
  {
    first += static_cast<std::int64_t>(topology.axis[b].size());
  }
  return first;
}

int GoesOnAs(const WallTopology& topology, int branch)
{
  int widest = -1;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    if (topology.parent[b] != branch ||
      NearestPoint(topology.axis[branch], topology.axis[b].front()) + 1 <
        topology.axis[branch].size())
    {
      continue;
    }
    const int candidate = static_cast<int>(b);
    widest = widest < 0 || RadiusAhead(topology, candidate) > RadiusAhead(topology, widest)
      ? candidate
      : widest;
  }
  return widest;
}

VesselWay WayThrough(const WallTopology& topology, int branch)
{
  std::vector<int> chain;
  for (int b = branch; b >= 0; b = topology.parent[b])
  {
    chain.insert(chain.begin(), b);
  }
  for (int b = GoesOnAs(topology, branch); b >= 0; b = GoesOnAs(topology, b))
  {
    chain.push_back(b);
  }
  VesselWay way;
  Vector3 last = Vector3::Zero();
  for (std::size_t n = 0; n < chain.size(); ++n)
  {
    const std::vector<Vector3>& axis = topology.axis[chain[n]];
    const std::int64_t first = FirstAxisPoint(topology, chain[n]);
    const std::size_t end = n + 1 < chain.size()
      ? NearestPoint(axis, topology.axis[chain[n + 1]].front()) + 1
      : axis.size();
    for (std::size_t k = 0; k < end; ++k)
    {
      const double step = way.points.empty() ? 0.0 : (axis[k] - last).norm();
      way.place.push_back((way.place.empty() ? 0.0 : way.place.back()) + step);
      way.points.push_back(first + static_cast<std::int64_t>(k));
      way.branch.push_back(chain[n]);
      last = axis[k];
    }
  }
  return way;
}

std::vector<std::vector<double>> ReferenceRadii(const WallTopology& topology, double neighbourhood)
{
  if (!topology.axisReference.empty())
  {
    return topology.axisReference;
  }
  std::vector<std::vector<double>> reference = topology.axisRadius;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    const std::vector<Vector3>& axis = topology.axis[b];
    const std::vector<double>& radius = topology.axisRadius[b];
    const auto greatest = [&](std::size_t k, int way)
    {
      double most = radius[k];
      double along = 0.0;
      for (std::size_t i = k; way < 0 ? i > 0 : i + 1 < axis.size();)
      {
        const std::size_t next = way < 0 ? i - 1 : i + 1;
        along += (axis[next] - axis[i]).norm();
        if (along > neighbourhood)
        {
          break;
        }
        most = std::max(most, radius[next]);
        i = next;
      }
      return most;
    };
    for (std::size_t k = 0; k < axis.size(); ++k)
    {
      reference[b][k] = std::min(greatest(k, -1), greatest(k, 1));
    }
  }
  return reference;
}

std::vector<FoundLesion> FindLesions(const WallTopology& topology, double least)
{
  const std::vector<std::vector<double>> reference = ReferenceRadii(topology);
  std::vector<FoundLesion> lesions;
  FoundLesion lesion;
  const auto close = [&]
  {
    if (lesion.degree >= least)
    {
      lesions.push_back(lesion);
    }
    lesion = FoundLesion();
  };
  AlongVessels(
    topology,
    [&](int b, std::size_t k)
    {
      const double degree =
        IsOccluded(topology, b, k) ? 1.0 : 1.0 - topology.axisRadius[b][k] / reference[b][k];
      if (degree < LesionEdge)
      {
        close();
        return;
      }
      const std::int64_t point = FirstAxisPoint(topology, b) + static_cast<std::int64_t>(k);
      lesion.points.push_back(point);
      if (degree > lesion.degree)
      {
        lesion.degree = degree;
        lesion.throat = point;
        lesion.branch = b;
        lesion.vessel =
          static_cast<std::size_t>(b) < topology.groupName.size() ? topology.groupName[b] : "";
      }
    },
    close);
  return lesions;
}

std::vector<Occlusion> FindOcclusions(const WallTopology& topology)
{
  std::vector<Occlusion> occlusions;
  Occlusion occlusion;
  Vector3 last = Vector3::Zero();
  const auto close = [&]
  {
    if (occlusion.points.size() > 1)
    {
      occlusions.push_back(occlusion);
    }
    occlusion = Occlusion();
  };
  AlongVessels(
    topology,
    [&](int b, std::size_t k)
    {
      if (!IsOccluded(topology, b, k))
      {
        close();
        return;
      }
      const Vector3& here = topology.axis[b][k];
      const bool first = occlusion.points.empty();
      occlusion.strength = first ? topology.axisOcclusion[b][k] : occlusion.strength;
      occlusion.places.push_back(first ? 0.0 : occlusion.places.back() + (here - last).norm());
      occlusion.points.push_back(FirstAxisPoint(topology, b) + static_cast<std::int64_t>(k));
      last = here;
    },
    close);
  return occlusions;
}

std::vector<std::vector<double>> ClosedRadii(const WallTopology& topology)
{
  std::vector<std::vector<double>> closed = topology.axisRadius;
  for (std::size_t b = 0; b < closed.size(); ++b)
  {
    for (std::size_t k = 0; k < closed[b].size(); ++k)
    {
      closed[b][k] = IsOccluded(topology, static_cast<int>(b), k) ? closed[b][k] : 0.0;
    }
  }
  return closed;
}

WallSections::Place WallSections::Nearest(const Vector3& point, const std::vector<Vector3>& axis,
  std::int64_t first, std::int64_t count, double& squared)
{
  Place place;
  for (std::int64_t k = first; k + 1 < first + count; ++k)
  {
    const SegmentPlace candidate = NearestOnSegment(point, axis[k], axis[k + 1]);
    if (candidate.squaredDistance < squared)
    {
      squared = candidate.squaredDistance;
      place = { static_cast<std::int32_t>(k), static_cast<float>(candidate.fraction) };
    }
  }
  return place;
}

WallSections::WallSections(const WallTopology& topology, const std::vector<Vector3>& points,
  const std::vector<Vector3>& axis)
  : Holds(points.size())
{
  constexpr double Far = std::numeric_limits<double>::infinity();
  std::vector<std::int64_t> first;
  std::vector<std::vector<double>> abscissa;
  std::vector<int> goesOn;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    first.push_back(FirstAxisPoint(topology, static_cast<int>(b)));
    goesOn.push_back(GoesOnAs(topology, static_cast<int>(b)));
    abscissa.emplace_back(1, 0.0);
    for (std::size_t k = 1; k < topology.axis[b].size(); ++k)
    {
      abscissa[b].push_back(
        abscissa[b].back() + (topology.axis[b][k] - topology.axis[b][k - 1]).norm());
    }
  }
  const auto count = [&](int b) { return static_cast<std::int64_t>(topology.axis[b].size()); };
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    const int b = i < topology.group.size() ? topology.group[i] : -1;
    if (b < 0)
    {
      continue;
    }
    Hold& hold = this->Holds[i];
    double squared = Far;
    hold.own = Nearest(points[i], axis, first[b], count(b), squared);
    const int parent = topology.parent[b];
    if (hold.own.first < 0 || parent < 0 || goesOn[parent] == b)
    {
      continue;
    }
    // The mouth of a side branch moves with the vessel that it leaves.
    const std::size_t k = hold.own.first - first[b];
    const double along = abscissa[b][k] + hold.own.along * (abscissa[b][k + 1] - abscissa[b][k]);
    const double mouth =
      topology.axisRadius[parent][NearestPoint(topology.axis[parent], topology.axis[b].front())];
    hold.share =
      static_cast<float>(SmoothStep((along / mouth - MouthBegins) / (MouthEnds - MouthBegins)));
    if (hold.share < 1.0F)
    {
      squared = Far;
      hold.parent = Nearest(points[i], axis, first[parent], count(parent), squared);
      if (goesOn[parent] >= 0)
      {
        const int next = goesOn[parent];
        const Place further = Nearest(points[i], axis, first[next], count(next), squared);
        hold.parent = further.first >= 0 ? further : hold.parent;
      }
    }
  }
}

void WallSections::Scale(const std::vector<double>& ratio, const std::vector<Vector3>& axis,
  std::vector<Vector3>& points) const
{
  const auto changed = [&](const Place& place)
  { return place.first >= 0 && (ratio[place.first] != 1.0 || ratio[place.first + 1] != 1.0); };
  const auto move = [&](const Place& place, const Vector3& point)
  {
    if (!changed(place))
    {
      return Vector3(Vector3::Zero());
    }
    const double t = place.along;
    const Vector3 way = axis[place.first + 1] - axis[place.first];
    Vector3 across = point - axis[place.first] - t * way;
    const double square = way.squaredNorm();
    if (square > 0.0)
    {
      across -= (across.dot(way) / square) * way;
    }
    const double here = ratio[place.first] + t * (ratio[place.first + 1] - ratio[place.first]);
    return Vector3((here - 1.0) * across);
  };
  for (std::size_t i = 0; i < this->Holds.size(); ++i)
  {
    const Hold& hold = this->Holds[i];
    if (changed(hold.own) || changed(hold.parent))
    {
      const double share = hold.share;
      points[i] += share * move(hold.own, points[i]) + (1.0 - share) * move(hold.parent, points[i]);
    }
  }
}

NarrowedWallMotion::NarrowedWallMotion(
  std::shared_ptr<WallMotion> wall, const std::vector<VesselLesion>& lesions)
  : Wall(std::move(wall))
  , Topology_(this->Wall->Topology())
{
  std::vector<Vector3> points;
  this->Wall->Positions(0.0, points);
  this->Wall->AxisPositions(0.0, this->Axis);
  this->Sections = std::make_unique<WallSections>(this->Topology_, points, this->Axis);
  this->Ratio.assign(this->Axis.size(), 1.0);
  this->Topology_.axisReference = ReferenceRadii(this->Topology_);
  if (this->Topology_.axisCalcium.empty())
  {
    for (const std::vector<double>& radius : this->Topology_.axisRadius)
    {
      this->Topology_.axisCalcium.emplace_back(radius.size(), 0.0);
    }
  }
  for (const VesselLesion& lesion : lesions)
  {
    this->Narrow(lesion);
  }
}

void NarrowedWallMotion::Narrow(const VesselLesion& lesion)
{
  RequireLesion(lesion);
  const WallTopology& topology = this->Topology_;
  // Parts of a segment between its side branches are one vessel.
  int branch = -1;
  std::string names;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    const std::string& name = b < topology.groupName.size() ? topology.groupName[b] : "";
    branch = branch < 0 && name == lesion.vessel ? static_cast<int>(b) : branch;
    if (!name.empty() && (", " + names + ",").find(", " + name + ",") == std::string::npos)
    {
      names += (names.empty() ? "" : ", ") + name;
    }
  }
  if (branch < 0)
  {
    throw std::invalid_argument("The vessels have no '" + lesion.vessel +
      "' that a lesion could be in; they have " + (names.empty() ? "no names" : names) + ".");
  }
  const VesselWay way = WayThrough(topology, branch);
  const auto begin = static_cast<std::size_t>(
    std::find(way.branch.begin(), way.branch.end(), branch) - way.branch.begin());
  std::size_t end = begin;
  while (end < way.branch.size() && topology.groupName[way.branch[end]] == lesion.vessel)
  {
    ++end;
  }
  const double length = way.place[end - 1] - way.place[begin];
  RequireLesion(lesion, lesion.place, 0.0, length, "a place (mm) in it");
  const double middle = way.place[begin] + lesion.place;
  const bool occludes = lesion.degree == 1.0;
  if (occludes && topology.axisOcclusion.empty())
  {
    for (const std::vector<double>& radius : topology.axisRadius)
    {
      this->Topology_.axisOcclusion.emplace_back(radius.size(), 0.0);
    }
  }
  int filled = 0;
  for (std::size_t n = 0; n < way.points.size(); ++n)
  {
    const double away = (way.place[n] - middle) / lesion.length;
    if (std::abs(away) >= 0.5)
    {
      continue;
    }
    const double wave = std::cos(Pi * away);
    double open = 1.0 - lesion.degree * wave * wave;
    const int b = way.branch[n];
    const auto k = static_cast<std::size_t>(way.points[n] - FirstAxisPoint(topology, b));
    if (occludes)
    {
      const double radius = topology.axisRadius[b][k];
      RequireLesion(lesion, radius, 1.5 * ChannelRadius, 100.0, "a vessel with a radius (mm)");
      const double share = FilledShare(lesion, away);
      open = 1.0 - share * (1.0 - ChannelRadius / radius);
      this->Topology_.axisOcclusion[b][k] = share < 1.0 ? 0.0 : lesion.strength;
      filled += share < 1.0 ? 0 : 1;
    }
    this->Ratio[way.points[n]] *= open;
    this->Topology_.axisRadius[b][k] *= open;
    this->Topology_.axisCalcium[b][k] = std::max(topology.axisCalcium[b][k], lesion.calciumArc);
  }
  if (occludes && filled < 2)
  {
    throw std::invalid_argument("The lesion of '" + lesion.vessel +
      "' is too short to occlude it: its axis has less than two points there.");
  }
}

void NarrowedWallMotion::Positions(double phase, std::vector<Vector3>& positions)
{
  this->Wall->Positions(phase, positions);
  this->Wall->AxisPositions(phase, this->Axis);
  this->Sections->Scale(this->Ratio, this->Axis, positions);
}
}
