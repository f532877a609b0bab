#include "FlowNetwork.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
double ConeVolume(double length, double a, double b)
{
  return 1e-3 * Pi * length * (a * a + a * b + b * b) / 3.0;
}

void CheckBranch(const WallTopology& topology, std::size_t b)
{
  const std::string name = "branch " + std::to_string(b) + " of the vessels' axis ";
  const std::vector<Vector3>& axis = topology.axis[b];
  if (axis.size() < 2 || topology.axisRadius[b].size() != axis.size())
  {
    throw std::invalid_argument(name + "has " + std::to_string(axis.size()) + " points and " +
      std::to_string(topology.axisRadius[b].size()) + " radii, not two or more of each");
  }
  double length = 0.0;
  for (std::size_t k = 0; k < axis.size(); ++k)
  {
    const double radius = topology.axisRadius[b][k];
    if (!axis[k].allFinite() || !(radius >= 1e-3 && radius <= 100.0))
    {
      throw std::invalid_argument(name + "has a point " + std::to_string(k) +
        " that is not finite, or whose radius of " + std::to_string(radius) +
        " is not 0.001 to 100 mm");
    }
    length += k > 0 ? (axis[k] - axis[k - 1]).norm() : 0.0;
  }
  if (!(length > 1e-3 && length < 1e5))
  {
    throw std::invalid_argument(
      name + "is " + std::to_string(length) + " mm long, not 0.001 to 100000 mm");
  }
  const int parent = topology.parent[b];
  if (parent < -1 || parent >= static_cast<int>(topology.axis.size()) ||
    parent == static_cast<int>(b))
  {
    throw std::invalid_argument(
      name + "has the parent " + std::to_string(parent) + ", which is not another branch");
  }
}

void CheckTopology(const WallTopology& topology)
{
  const std::size_t count = topology.axis.size();
  if (count == 0 || topology.axisRadius.size() != count || topology.parent.size() != count)
  {
    throw std::invalid_argument("the vessels have " + std::to_string(count) + " axes, " +
      std::to_string(topology.axisRadius.size()) + " lists of radii and " +
      std::to_string(topology.parent.size()) + " parents, not one or more of each");
  }
  for (std::size_t b = 0; b < count; ++b)
  {
    CheckBranch(topology, b);
  }
}

/// Place of the axis that is nearest to a point, mm from its beginning.
double NearestAbscissa(
  const std::vector<Vector3>& axis, const std::vector<double>& abscissa, const Vector3& point)
{
  double nearest = std::numeric_limits<double>::infinity();
  double place = 0.0;
  for (std::size_t k = 0; k + 1 < axis.size(); ++k)
  {
    const SegmentPlace candidate = NearestOnSegment(point, axis[k], axis[k + 1]);
    if (candidate.squaredDistance < nearest)
    {
      nearest = candidate.squaredDistance;
      place = abscissa[k] + candidate.fraction * (abscissa[k + 1] - abscissa[k]);
    }
  }
  return place;
}

/// The interval of an axis that holds an abscissa within its range.
std::size_t IntervalAt(const std::vector<double>& abscissa, double s)
{
  const auto next = std::upper_bound(abscissa.begin() + 1, abscissa.end() - 1, s);
  return static_cast<std::size_t>(next - abscissa.begin()) - 1;
}

double InterpolatedRadius(const std::vector<double>& abscissa, const std::vector<double>& radius,
  std::size_t interval, double s)
{
  const double length = abscissa[interval + 1] - abscissa[interval];
  const double t = length > 0.0 ? (s - abscissa[interval]) / length : 0.0;
  return radius[interval] + t * (radius[interval + 1] - radius[interval]);
}

CoronarySide SideByName(const std::string& name)
{
  for (const char* right : { "RCA", "R-P" })
  {
    if (name.find(right) != std::string::npos)
    {
      return CoronarySide::Right;
    }
  }
  for (const char* left : { "LM", "LAD", "LCx", "LCX", "LCA" })
  {
    if (name.find(left) != std::string::npos)
    {
      return CoronarySide::Left;
    }
  }
  return CoronarySide::Automatic;
}
}

double FlowSegment::Radius() const
{
  return std::sqrt(1e3 * this->volume / (Pi * (this->to - this->from)));
}

FlowNetwork::FlowNetwork(const WallTopology& topology, const std::vector<CoronarySide>& sides)
{
  CheckTopology(topology);
  this->Topology_.axis = topology.axis;
  this->Topology_.axisRadius = topology.axisRadius;
  this->Topology_.parent = topology.parent;
  this->Topology_.groupName = topology.groupName;
  this->Topology_.axisReference = topology.axisReference;
  this->Topology_.axisOcclusion = topology.axisOcclusion;
  this->Topology_.groupName.resize(topology.axis.size());
  this->MeasureBranches();
  this->Connect();
  this->ChooseSides(sides);
}

void FlowNetwork::MeasureBranches()
{
  std::int64_t first = 0;
  for (std::size_t b = 0; b < this->Topology_.axis.size(); ++b)
  {
    const std::vector<Vector3>& axis = this->Topology_.axis[b];
    const std::vector<double>& radius = this->Topology_.axisRadius[b];
    FlowBranch branch;
    branch.firstPoint = first;
    first += static_cast<std::int64_t>(axis.size());
    branch.abscissa.push_back(0.0);
    branch.volume.push_back(0.0);
    for (std::size_t k = 1; k < axis.size(); ++k)
    {
      const double length = (axis[k] - axis[k - 1]).norm();
      branch.abscissa.push_back(branch.abscissa.back() + length);
      branch.volume.push_back(branch.volume.back() + ConeVolume(length, radius[k - 1], radius[k]));
    }
    this->Branches_.push_back(std::move(branch));
  }
}

void FlowNetwork::Connect()
{
  const std::size_t count = this->Branches_.size();
  std::vector<int> begin(count, -1); // node
  std::vector<int> queue;
  std::vector<std::vector<int>> children(count);
  this->Attachment.assign(count, -1);
  for (std::size_t b = 0; b < count; ++b)
  {
    const int parent = this->Topology_.parent[b];
    if (parent >= 0)
    {
      children[parent].push_back(static_cast<int>(b));
      continue;
    }
    begin[b] = static_cast<int>(this->Nodes_.size());
    FlowNode root;
    root.tree = static_cast<int>(this->Roots_.size());
    this->Nodes_.push_back(root);
    this->Roots_.push_back(begin[b]);
    queue.push_back(static_cast<int>(b));
  }
  for (std::size_t done = 0; done < queue.size(); ++done)
  {
    const int b = queue[done];
    FlowBranch& branch = this->Branches_[b];
    const double length = branch.abscissa.back();
    std::vector<std::pair<double, int>> attached; // abscissa, branch; -1: this one's own end
    for (const int child : children[b])
    {
      attached.emplace_back(NearestAbscissa(this->Topology_.axis[b], branch.abscissa,
                              this->Topology_.axis[child].front()),
        child);
      queue.push_back(child);
    }
    std::sort(attached.begin(), attached.end());
    attached.emplace_back(length, -1);
    int node = begin[b];
    double from = 0.0;
    for (const auto& [where, child] : attached)
    {
      const bool atEnd = child < 0 || where > length - SnapLength;
      const double to = atEnd ? length : where;
      // The branch's own end is a node in any case.
      if (to - from >= SnapLength || (atEnd && from < length))
      {
        FlowSegment segment;
        segment.branch = b;
        segment.from = from;
        segment.to = to;
        segment.volumeFrom = this->VolumeAt(b, from);
        segment.volume = this->VolumeAt(b, to) - segment.volumeFrom;
        segment.above = node;
        segment.below = static_cast<int>(this->Nodes_.size());
        const int index = static_cast<int>(this->Segments_.size());
        this->Nodes_[node].below.push_back(index);
        FlowNode next;
        next.above = index;
        next.tree = this->Nodes_[node].tree;
        this->Nodes_.push_back(next);
        branch.segments.push_back(index);
        this->Segments_.push_back(segment);
        node = segment.below;
        from = to;
      }
      if (child >= 0)
      {
        begin[child] = node;
        this->Attachment[child] =
          branch.firstPoint + static_cast<std::int64_t>(IntervalAt(branch.abscissa, where));
      }
    }
  }
  if (queue.size() != count)
  {
    const auto lost = std::find(begin.begin(), begin.end(), -1) - begin.begin();
    throw std::invalid_argument("branch " + std::to_string(lost) +
      " of the vessels' axis hangs on no root: its parents form a ring");
  }
}

void FlowNetwork::ChooseSides(const std::vector<CoronarySide>& sides)
{
  const std::size_t trees = this->Roots_.size();
  std::vector<CoronarySide> chosen(trees, CoronarySide::Automatic);
  std::vector<double> volume(trees, 0.0);
  std::vector<double> moment(trees, 0.0);
  for (const FlowSegment& segment : this->Segments_)
  {
    const int tree = this->Nodes_[segment.above].tree;
    if (chosen[tree] == CoronarySide::Automatic)
    {
      chosen[tree] = SideByName(this->Topology_.groupName[segment.branch]);
    }
    const std::vector<Vector3>& axis = this->Topology_.axis[segment.branch];
    volume[tree] += segment.volume;
    moment[tree] += 0.5 * segment.volume * (axis.front().x() + axis.back().x());
  }
  for (std::size_t t = 0; t < std::min(trees, sides.size()); ++t)
  {
    chosen[t] = sides[t] == CoronarySide::Automatic ? chosen[t] : sides[t];
  }
  // Only where nothing has a name: among several trees the one on the patient's right.
  if (trees > 1 &&
    std::all_of(chosen.begin(), chosen.end(),
      [](CoronarySide side) { return side == CoronarySide::Automatic; }))
  {
    std::size_t rightmost = 0;
    for (std::size_t t = 1; t < trees; ++t)
    {
      rightmost = moment[t] / volume[t] < moment[rightmost] / volume[rightmost] ? t : rightmost;
    }
    chosen[rightmost] = CoronarySide::Right;
  }
  for (std::size_t t = 0; t < trees; ++t)
  {
    this->RightSide_.push_back(chosen[t] == CoronarySide::Right);
  }
}

FlowNetwork::Place FlowNetwork::Locate(const CatheterTip& tip) const
{
  if (tip.branch < 0 || tip.branch >= static_cast<int>(this->Branches_.size()) ||
    !std::isfinite(tip.abscissa))
  {
    throw std::invalid_argument("the catheter's tip is at " + std::to_string(tip.abscissa) +
      " mm of branch " + std::to_string(tip.branch) + ", and the vessels have " +
      std::to_string(this->Branches_.size()) + " branches");
  }
  const FlowBranch& branch = this->Branches_[tip.branch];
  Place place;
  place.abscissa = std::clamp(tip.abscissa, 0.0, branch.abscissa.back());
  for (const int s : branch.segments)
  {
    place.segment = s;
    if (place.abscissa <= this->Segments_[s].to)
    {
      break;
    }
  }
  const FlowSegment& segment = this->Segments_[place.segment];
  place.volume = std::clamp(
    this->VolumeAt(tip.branch, place.abscissa) - segment.volumeFrom, 0.0, segment.volume);
  return place;
}

int FlowNetwork::Split(const CatheterTip& place)
{
  const Place here = this->Locate(place);
  const int number = here.segment;
  const int node = static_cast<int>(this->Nodes_.size());
  const auto renumber = [number](int& segment) { segment += segment > number ? 1 : 0; };
  FlowSegment upper = this->Segments_[number];
  FlowSegment lower = upper;
  const double margin = std::min(SnapLength, 0.25 * (upper.to - upper.from));
  lower.from = upper.to = std::clamp(here.abscissa, upper.from + margin, upper.to - margin);
  lower.volumeFrom = this->VolumeAt(upper.branch, lower.from);
  lower.volume = upper.volumeFrom + upper.volume - lower.volumeFrom;
  upper.volume = lower.volumeFrom - upper.volumeFrom;
  upper.below = lower.above = node;
  for (FlowNode& one : this->Nodes_)
  {
    renumber(one.above);
    std::for_each(one.below.begin(), one.below.end(), renumber);
  }
  for (FlowBranch& branch : this->Branches_)
  {
    std::for_each(branch.segments.begin(), branch.segments.end(), renumber);
  }
  this->Nodes_[lower.below].above = number + 1;
  FlowNode between;
  between.above = number;
  between.below.push_back(number + 1);
  between.tree = this->Nodes_[upper.above].tree;
  this->Nodes_.push_back(between);
  std::vector<int>& along = this->Branches_[upper.branch].segments;
  along.insert(std::find(along.begin(), along.end(), number) + 1, number + 1);
  this->Segments_[number] = upper;
  this->Segments_.insert(this->Segments_.begin() + number + 1, lower);
  return node;
}

double FlowNetwork::RadiusAt(int branch, double abscissa) const
{
  const std::vector<double>& places = this->Branches_[branch].abscissa;
  const double s = std::clamp(abscissa, 0.0, places.back());
  return InterpolatedRadius(places, this->Topology_.axisRadius[branch], IntervalAt(places, s), s);
}

double FlowNetwork::VolumeAt(int branch, double abscissa) const
{
  const FlowBranch& b = this->Branches_[branch];
  const std::vector<double>& radius = this->Topology_.axisRadius[branch];
  if (abscissa >= b.abscissa.back())
  {
    return b.volume.back();
  }
  const double s = std::max(abscissa, 0.0);
  const std::size_t k = IntervalAt(b.abscissa, s);
  return b.volume[k] +
    ConeVolume(s - b.abscissa[k], radius[k], InterpolatedRadius(b.abscissa, radius, k, s));
}
}
