#include "TreeEditor.h"

#include "BranchMouth.h"
#include "CoronaryAnatomy.h"
#include "CurveSmoothing.h"
#include "LumenRefinement.h"
#include "PlaceText.h"
#include "TreeLinks.h"
#include "VesselPaths.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <queue>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double ClickReach = 3.0;   ///< mm that a place may be beside an axis
constexpr double BesideLumen = 1.5;  ///< mm outside of the lumen that still mean this vessel
constexpr double SearchReach = 25.0; ///< mm from a vessel to the tree that it may belong to
constexpr double LeastSeen = 0.1;    ///< share of a new vessel
constexpr double SeenConfidence = 0.5;
constexpr double Held = 1e3;        ///< weight of an end that smoothing leaves where it is
constexpr double LeastReach = 10.0; ///< mm along the tree that move with a point
constexpr double LeastStub = 2.0;   ///< mm; a shorter rest of a link that was parted goes too
constexpr double MostOverlap = 0.5; ///< share of a new vessel in the lumens of others

std::string Millimetres(double length)
{
  char text[40];
  std::snprintf(text, sizeof(text), length < 9.95 ? "%.1f mm" : "%.0f mm", length);
  return text;
}

template <typename Value>
void Complete(std::vector<Value>& values, std::size_t count, Value usual)
{
  if (values.empty())
  {
    values.assign(count, usual);
  }
}
}

int SegmentOf(const std::string& name)
{
  for (int id = ProximalRCA; id <= InferiorRightBranch && !name.empty(); ++id)
  {
    if (SegmentName(id) == name)
    {
      return id;
    }
  }
  return 0;
}

std::string AllSegmentNames()
{
  std::string all;
  for (int id = ProximalRCA; id <= InferiorRightBranch; ++id)
  {
    const std::string name = SegmentName(id);
    all += name.empty() ? "" : (all.empty() ? "" : ", ") + name;
  }
  return all;
}

void FailEdit(const TreeEdit& edit, int number, const std::string& what)
{
  throw std::invalid_argument(
    "edit " + std::to_string(number) + " (" + EditKindName(edit.kind) + "): " + what);
}

void CheckNumbered(const TreeEdit& edit, int number)
{
  try
  {
    CheckEdit(edit);
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument("edit " + std::to_string(number) + ": " + error.what());
  }
}

TreeEditor::TreeEditor(const VesselTree& tree, const EditScene& scene)
  : Tree(SplitAtBifurcations(tree))
  , Source(tree.points.size())
  , Edits(tree.points.size(), 0)
  , Fresh(tree.points.size(), 0)
  , Scene(scene)
{
  for (std::size_t p = 0; p < this->Source.size(); ++p)
  {
    this->Source[p] = static_cast<std::int64_t>(p);
  }
  const std::size_t count = tree.points.size();
  Complete(this->Tree.confidence, count, 1.0);
  Complete(this->Tree.bridged, count, static_cast<unsigned char>(0));
  Complete(this->Tree.bridgeConfidence, count, 1.0);
  if (this->Tree.segmentId.empty())
  {
    this->Tree.segmentId.assign(count, 0);
    for (const VesselTree::Branch& branch : this->Tree.branches)
    {
      const bool root = branch.parentGroupId < 0;
      for (std::size_t i = root ? 0 : 1; i < branch.points.size(); ++i)
      {
        this->Tree.segmentId[branch.points[i]] = branch.segmentId;
      }
    }
  }
}

TreeEditor::~TreeEditor() = default;

void TreeEditor::Fail(const std::string& what) const
{
  FailEdit(*this->Now, this->Number, what);
}

std::string TreeEditor::NameOf(std::size_t branch) const
{
  const std::string name = SegmentName(this->Tree.branches[branch].segmentId);
  return name.empty() ? "an unnamed branch" : name;
}

std::int64_t TreeEditor::PointOf(const Place& place) const
{
  return this->Tree.branches[place.branch].points[place.at];
}

double TreeEditor::LengthOf(std::size_t branch, std::size_t from) const
{
  const std::vector<double> arc = ArcLengths(this->Tree, this->Tree.branches[branch].points);
  return arc.back() - arc[from];
}

bool TreeEditor::IsTip(std::size_t branch) const
{
  const int group = this->Tree.branches[branch].groupId;
  return std::none_of(this->Tree.branches.begin(), this->Tree.branches.end(),
    [group](const VesselTree::Branch& other) { return other.parentGroupId == group; });
}

TreeEditor::Place TreeEditor::Nearest(const Vector3& position, int segment) const
{
  Place best;
  best.distance = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    const VesselTree::Branch& branch = this->Tree.branches[b];
    if (segment != 0 && branch.segmentId != segment)
    {
      continue;
    }
    for (std::size_t i = branch.parentGroupId < 0 ? 0 : 1; i < branch.points.size(); ++i)
    {
      const double distance = (this->Tree.points[branch.points[i]] - position).norm();
      if (distance < best.distance)
      {
        best = { b, i, distance };
      }
    }
  }
  return best;
}

TreeEditor::Place TreeEditor::Find(const Vector3& position, int segment) const
{
  const Place place = this->Nearest(position, segment);
  if (!std::isfinite(place.distance))
  {
    this->Fail("the tree has no branch");
  }
  const double reach = std::max(ClickReach, 1.5 * this->Tree.radius[this->PointOf(place)]);
  if (place.distance > reach)
  {
    this->Fail("no vessel of the tree is within " + Millimetres(reach) + " of " +
      PlaceText(position) + "; the nearest is " + this->NameOf(place.branch) + ", " +
      Millimetres(place.distance) + " away");
  }
  return place;
}

int TreeEditor::KnownSegment(const std::string& name) const
{
  const int segment = SegmentOf(name);
  std::string known;
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    const std::string other = SegmentName(branch.segmentId);
    if (branch.segmentId == segment)
    {
      return segment;
    }
    if (!other.empty() && (", " + known + ",").find(", " + other + ",") == std::string::npos)
    {
      known += (known.empty() ? "" : ", ") + other;
    }
  }
  if (!name.empty())
  {
    this->Fail("the tree has no " + name + "; it has " + (known.empty() ? "no names" : known));
  }
  return 0;
}

std::vector<std::size_t> TreeEditor::Meant() const
{
  const int segment = this->KnownSegment(this->Now->name);
  if (!this->Now->points.empty())
  {
    return { this->Find(this->Now->points.front(), segment).branch };
  }
  std::vector<std::size_t> meant;
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    if (this->Tree.branches[b].segmentId == segment)
    {
      meant.push_back(b);
    }
  }
  return meant;
}

void TreeEditor::Note(const std::string& what, const Vector3& place, double length, double seen)
{
  this->Notes.push_back({ this->Number, what, place, length, seen });
}

void TreeEditor::Apply(const TreeEdit& edit, int number, const ProgressCallback& progress)
{
  CheckNumbered(edit, number);
  this->Now = &edit;
  this->Number = number;
  switch (edit.kind)
  {
    case EditKind::AddBranch:
      this->AddBranch(progress);
      break;
    case EditKind::Cut:
      this->Cut();
      break;
    case EditKind::Delete:
      this->Delete();
      break;
    case EditKind::Join:
      this->Join(progress);
      break;
    case EditKind::Rename:
      this->Rename();
      break;
    case EditKind::Move:
      this->Move();
      break;
    case EditKind::Paint:
    case EditKind::Erase:
      return;
  }
  this->Normalise();
}

double TreeEditor::MarkBelow(std::size_t branch, std::vector<char>& marked) const
{
  double length = 0.0;
  std::vector<std::size_t> waiting{ branch };
  while (!waiting.empty())
  {
    const std::size_t b = waiting.back();
    waiting.pop_back();
    if (marked[b] != 0)
    {
      continue;
    }
    marked[b] = 1;
    length += this->LengthOf(b);
    for (std::size_t d = 0; d < this->Tree.branches.size(); ++d)
    {
      if (this->Tree.branches[d].parentGroupId == this->Tree.branches[b].groupId)
      {
        waiting.push_back(d);
      }
    }
  }
  return length;
}

void TreeEditor::Remove(const std::vector<char>& gone)
{
  std::vector<VesselTree::Branch> left;
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    if (gone[b] == 0)
    {
      left.push_back(std::move(this->Tree.branches[b]));
    }
  }
  if (left.empty())
  {
    this->Fail("nothing would be left of the tree");
  }
  this->Tree.branches = std::move(left);
}

void TreeEditor::Cut()
{
  const Place place = this->Find(this->Now->points.front(), this->KnownSegment(this->Now->name));
  const std::int64_t point = this->PointOf(place);
  const Vector3 position = this->Tree.points[point];
  const std::string name = this->NameOf(place.branch);
  if (place.at == 0)
  {
    this->Fail(
      PlaceText(position) + " is where " + name + " and its tree begin; delete takes all away");
  }
  double length = this->LengthOf(place.branch, place.at);
  std::vector<char> gone(this->Tree.branches.size(), 0);
  const int group = this->Tree.branches[place.branch].groupId;
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    if (this->Tree.branches[b].parentGroupId == group)
    {
      length += this->MarkBelow(b, gone);
    }
  }
  if (length <= 0.0)
  {
    this->Fail(PlaceText(position) + " is the tip of " + name + ": nothing is behind it");
  }
  this->Tree.branches[place.branch].points.resize(place.at + 1);
  this->Edits[point] = this->Number;
  this->Remove(gone);
  this->Note(name + " cut at " + PlaceText(position) + ": " + Millimetres(length) + " less",
    position, length);
}

void TreeEditor::Delete()
{
  const std::vector<std::size_t> meant = this->Meant();
  const std::string name = this->NameOf(meant.front());
  const std::int64_t point = this->Tree.branches[meant.front()].points.front();
  std::vector<char> gone(this->Tree.branches.size(), 0);
  double length = 0.0;
  for (const std::size_t branch : meant)
  {
    length += this->MarkBelow(branch, gone);
    this->Edits[this->Tree.branches[branch].points.front()] = this->Number;
  }
  this->Remove(gone);
  const Vector3 position = this->Tree.points[point];
  this->Note(
    name + " deleted from " + PlaceText(position) + " on: " + Millimetres(length) + " less",
    position, length);
}

void TreeEditor::Rename()
{
  const std::vector<std::size_t> meant = this->Meant();
  const int segment = SegmentOf(this->Now->newName);
  const std::string before = this->NameOf(meant.front());
  double length = 0.0;
  for (const std::size_t b : meant)
  {
    VesselTree::Branch& branch = this->Tree.branches[b];
    if (branch.segmentId == segment)
    {
      this->Fail(before + " at " + PlaceText(this->Tree.points[branch.points.back()]) +
        " has that name already");
    }
    length += this->LengthOf(b);
    branch.segmentId = segment;
    for (std::size_t i = branch.parentGroupId < 0 ? 0 : 1; i < branch.points.size(); ++i)
    {
      this->Tree.segmentId[branch.points[i]] = segment;
      this->Edits[branch.points[i]] = this->Number;
    }
  }
  const std::vector<std::int64_t>& points = this->Tree.branches[meant.front()].points;
  const Vector3 middle = this->Tree.points[points[points.size() / 2]];
  const std::string after = this->Now->newName.empty() ? "no name" : this->Now->newName;
  this->Note(before + " at " + PlaceText(middle) + " renamed to " + after, middle, length);
}

std::vector<double> TreeEditor::DistancesFrom(std::int64_t point) const
{
  std::vector<std::vector<std::int64_t>> beside(this->Tree.points.size());
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      beside[branch.points[i]].push_back(branch.points[i - 1]);
      beside[branch.points[i - 1]].push_back(branch.points[i]);
    }
  }
  std::vector<double> distance(this->Tree.points.size(), std::numeric_limits<double>::infinity());
  distance[point] = 0.0;
  // A forest: there is one way to each point.
  std::vector<std::int64_t> waiting{ point };
  while (!waiting.empty())
  {
    const std::int64_t here = waiting.back();
    waiting.pop_back();
    for (const std::int64_t next : beside[here])
    {
      if (!std::isfinite(distance[next]))
      {
        distance[next] =
          distance[here] + (this->Tree.points[next] - this->Tree.points[here]).norm();
        waiting.push_back(next);
      }
    }
  }
  return distance;
}

void TreeEditor::Move()
{
  const Place place = this->Find(this->Now->points.front());
  const std::int64_t point = this->PointOf(place);
  const Vector3 way = this->Now->points.back() - this->Tree.points[point];
  const double reach =
    this->Now->reach > 0.0 ? this->Now->reach : std::max(LeastReach, 2.0 * way.norm());
  if (way.norm() > reach)
  {
    this->Fail(PlaceText(this->Tree.points[point]) + " would move by " + Millimetres(way.norm()) +
      ", more than the reach of " + Millimetres(reach) + ": the vessel would fold");
  }
  const std::vector<double> distance = this->DistancesFrom(point);
  for (std::size_t p = 0; p < distance.size(); ++p)
  {
    if (distance[p] < reach)
    {
      this->Tree.points[p] += 0.5 * (1.0 + std::cos(M_PI * distance[p] / reach)) * way;
      this->Edits[p] = this->Number;
      this->Fresh[p] = 1;
    }
  }
  this->Note(this->NameOf(place.branch) + " moved by " + Millimetres(way.norm()) + " to " +
      PlaceText(this->Now->points.back()),
    this->Now->points.back(), way.norm());
}

void TreeEditor::Normalise()
{
  std::vector<VesselTree::Branch> sorted;
  std::vector<VesselTree::Branch>& branches = this->Tree.branches;
  std::vector<char> placed(branches.size(), 0);
  const std::function<void(int)> place = [&](int parent)
  {
    for (std::size_t b = 0; b < branches.size(); ++b)
    {
      if (placed[b] == 0 && branches[b].parentGroupId == parent)
      {
        placed[b] = 1;
        sorted.push_back(branches[b]);
        place(branches[b].groupId);
      }
    }
  };
  place(-1);
  branches = std::move(sorted);
  this->Tree = SplitAtBifurcations(this->Tree);
}

std::int64_t TreeEditor::LumenAt(const Vector3& place) const
{
  std::int64_t best = -1;
  double least = 1.0;
  for (std::size_t b = 0; b < this->Tree.branches.size(); ++b)
  {
    if (b < this->Ends.size() && this->Ends[b] != 0)
    {
      continue;
    }
    for (const std::int64_t p : this->Tree.branches[b].points)
    {
      // In radii: of two lumens that overlap the one that it is deeper in.
      const double depth = (this->Tree.points[p] - place).norm() / this->Tree.radius[p];
      if (depth < least)
      {
        least = depth;
        best = p;
      }
    }
  }
  return best;
}

VesselDrawing& TreeEditor::Drawing()
{
  if (!this->Drawer)
  {
    try
    {
      this->Drawer = std::make_unique<VesselDrawing>(this->Tree, this->Scene);
    }
    catch (const std::invalid_argument& error)
    {
      this->Fail(error.what());
    }
  }
  return *this->Drawer;
}

bool TreeEditor::GoesOn(Place& place) const
{
  const VesselTree::Branch& branch = this->Tree.branches[place.branch];
  const double radius = this->Tree.radius[branch.points.back()];
  if (!this->IsTip(place.branch) ||
    this->LengthOf(place.branch, place.at) > 2.0 * radius + BesideLumen)
  {
    return false;
  }
  place.at = branch.points.size() - 1;
  return true;
}

MeasuredPath TreeEditor::DrawStraight(std::int64_t start, const std::vector<Vector3>& places) const
{
  if (!(this->Now->radius > 0.0))
  {
    this->Fail("there is no image to measure the vessel in at " + PlaceText(places.back()) +
      ": it needs a radius");
  }
  std::vector<Vector3> way{ this->Tree.points[start] };
  way.insert(way.end(), places.begin(), places.end());
  MeasuredPath path;
  path.points = ResampleCurve(way, 0.5 * this->Now->radius);
  path.crossing.assign(path.size(), 0);
  path.confidence.assign(path.size(), 0.0);
  path.radius.assign(path.size(), this->Now->radius);
  return path;
}

MeasuredPath TreeEditor::Draw(std::int64_t& start, bool& goesOn, const std::vector<Vector3>& places,
  const ProgressCallback& progress)
{
  if (!this->Scene.image)
  {
    return this->DrawStraight(start, places);
  }
  VesselDrawing& drawing = this->Drawing();
  std::vector<Vector3> way{ this->Tree.points[start] };
  for (std::size_t n = 0; n < places.size(); ++n)
  {
    const std::vector<Vector3> next =
      drawing.Way(way.back(), drawing.OnVessel(places[n]), progress);
    way.insert(way.end(), next.begin(), next.end());
  }
  MeasuredPath path = drawing.Measured(way, goesOn ? Held : 0.0, this->Ends.empty() ? 0.0 : Held);
  if (path.size() >= 3 && !goesOn)
  {
    goesOn = this->JoinToParent(path, start);
  }
  if (path.size() < 3)
  {
    const std::vector<std::int64_t> owners = BranchesOfPoints(this->Tree);
    this->Fail("the way to " + PlaceText(places.back()) + " stays in the lumen of " +
      this->NameOf(owners[start]) + ", which the tree has already");
  }
  const double seen = static_cast<double>(std::count_if(path.confidence.begin(),
                        path.confidence.end(), [](double c) { return c >= SeenConfidence; })) /
    static_cast<double>(path.size());
  if (seen < LeastSeen && !(this->Now->radius > 0.0))
  {
    this->Fail("the image shows no vessel between " + PlaceText(this->Tree.points[start]) +
      " and " + PlaceText(places.back()) + "; with a radius it is drawn all the same");
  }
  drawing.CorrectRadii(path);
  for (std::size_t i = 0; i < path.size() && this->Now->radius > 0.0; ++i)
  {
    path.radius[i] = path.confidence[i] < SeenConfidence ? this->Now->radius : path.radius[i];
  }
  return path;
}

bool TreeEditor::JoinToParent(MeasuredPath& path, std::int64_t& start)
{
  const PathMeasurement& measurement = this->Drawing().Measurement();
  // The way runs in the tree first: it leaves where it leaves, not where a person pointed.
  std::size_t leaves = 0;
  for (std::size_t i = 0;
       i < path.size() && static_cast<double>(i - leaves) * measurement.step < BesideLumen; ++i)
  {
    const std::int64_t owner = this->LumenAt(path.points[i]);
    if (owner >= 0)
    {
      leaves = i;
      start = owner;
    }
  }
  if (leaves + 3 >= path.size())
  {
    path.resize(0);
    return false;
  }
  path.ReplaceStart(leaves, {});
  const std::vector<std::int64_t> owners = BranchesOfPoints(this->Tree);
  Place place;
  place.branch = static_cast<std::size_t>(owners[start]);
  const std::vector<std::int64_t>& points = this->Tree.branches[place.branch].points;
  place.at =
    static_cast<std::size_t>(std::find(points.begin(), points.end(), start) - points.begin());
  const bool goesOn = this->GoesOn(place);
  start = this->PointOf(place);
  for (const VesselPath& vessel : goesOn ? std::vector<VesselPath>() : VesselPaths(this->Tree))
  {
    if (std::find(vessel.points.begin() + static_cast<std::ptrdiff_t>(vessel.FirstOwn()),
          vessel.points.end(), start) != vessel.points.end())
    {
      start = static_cast<std::int64_t>(
        JoinParent(path, this->Tree, vessel.points, static_cast<std::int32_t>(start), measurement));
      break;
    }
  }
  if (path.size() >= 3)
  {
    path.points.front() = this->Tree.points[start];
    this->Drawing().Smooth(path, Held, this->Ends.empty() ? 0.0 : Held);
    path.points.front() = this->Tree.points[start];
  }
  return goesOn;
}

int TreeEditor::Append(const MeasuredPath& path, std::int64_t start, std::int64_t end, int segment)
{
  const std::vector<std::int64_t> owners = BranchesOfPoints(this->Tree);
  const VesselTree::Branch& parent = this->Tree.branches[owners[start]];
  VesselTree::Branch branch;
  branch.groupId = 0;
  for (const VesselTree::Branch& other : this->Tree.branches)
  {
    branch.groupId = std::max(branch.groupId, other.groupId + 1);
  }
  branch.parentGroupId = parent.groupId;
  branch.treeId = parent.treeId;
  branch.segmentId = segment;
  branch.points.push_back(start);
  // The last sample of a way between two points is one of them.
  const std::size_t last = end < 0 ? path.size() : path.size() - 1;
  for (std::size_t i = 1; i < last; ++i)
  {
    branch.points.push_back(static_cast<std::int64_t>(this->Tree.points.size()));
    const bool seen = path.confidence[i] >= SeenConfidence;
    this->Tree.points.push_back(path.points[i]);
    this->Tree.radius.push_back(path.radius[i]);
    this->Tree.confidence.push_back(path.confidence[i]);
    this->Tree.bridged.push_back(seen ? 0 : 1);
    // Whoever drew it says that it is the artery's.
    this->Tree.bridgeConfidence.push_back(1.0);
    this->Tree.segmentId.push_back(segment);
    this->Tree.abscissa.push_back(0.0);
    this->Source.push_back(-1);
    this->Edits.push_back(this->Number);
    this->Fresh.push_back(seen ? 1 : 0);
  }
  if (end >= 0)
  {
    branch.points.push_back(end);
    this->Edits[end] = this->Number;
  }
  this->Tree.branches.push_back(branch);
  return branch.groupId;
}

void TreeEditor::AddBranch(const ProgressCallback& progress)
{
  std::vector<Vector3> places = this->Now->points;
  for (const Vector3& place : places)
  {
    if (this->Scene.image && !this->Drawing().Contains(place))
    {
      this->Fail(PlaceText(place) + " is outside the image");
    }
  }
  Place from = this->Nearest(places.front(), 0);
  const auto beside = [&] { return this->Tree.radius[this->PointOf(from)] + BesideLumen; };
  if (from.distance <= beside())
  {
    if (places.size() == 1)
    {
      this->Fail(PlaceText(places.front()) + " is in " + this->NameOf(from.branch) +
        " already: the vessel needs a point outside of the tree");
    }
    places.erase(places.begin());
  }
  else if (this->Scene.image)
  {
    std::int64_t owner = -1;
    const Vector3 first = this->Drawing().OnVessel(places.front());
    this->Drawing().WayFromTree(first, SearchReach, owner, progress);
    if (owner < 0)
    {
      this->Fail("no vessel of the tree is within " + Millimetres(SearchReach) + " of " +
        PlaceText(places.front()) + "; the nearest is " + this->NameOf(from.branch) + ", " +
        Millimetres(from.distance) + " away");
    }
    from = this->Nearest(this->Tree.points[owner], 0);
  }
  else if (from.distance > SearchReach)
  {
    this->Fail("no vessel of the tree is within " + Millimetres(SearchReach) + " of " +
      PlaceText(places.front()));
  }
  bool goesOn = this->GoesOn(from);
  std::int64_t start = this->PointOf(from);
  const MeasuredPath path = this->Draw(start, goesOn, places, progress);
  std::size_t inside = 0;
  std::int64_t other = -1;
  std::size_t seen = 0;
  for (std::size_t i = 1; i < path.size(); ++i)
  {
    const std::int64_t owner = this->LumenAt(path.points[i]);
    inside += owner >= 0 ? 1 : 0;
    other = owner >= 0 ? owner : other;
    seen += path.confidence[i] >= SeenConfidence ? 1 : 0;
  }
  const std::vector<std::int64_t> owners = BranchesOfPoints(this->Tree);
  if (static_cast<double>(inside) > MostOverlap * static_cast<double>(path.size()))
  {
    this->Fail("the way from " + PlaceText(path.points.front()) + " to " +
      PlaceText(path.points.back()) + " is " + this->NameOf(owners[other]) +
      ", which the tree has already");
  }
  const std::string parent = this->NameOf(owners[start]);
  const int segment = !this->Now->name.empty() ? SegmentOf(this->Now->name)
    : goesOn                                   ? this->Tree.branches[owners[start]].segmentId
                                               : 0;
  const std::size_t before = this->Tree.branches.size();
  this->Append(path, start, -1, segment);
  const double length = this->LengthOf(before);
  const double share = static_cast<double>(seen) / static_cast<double>(path.size() - 1);
  char text[60];
  std::snprintf(text, sizeof(text), ", seen along %.0f %%", 100.0 * share);
  const std::string name = segment != 0 ? SegmentName(segment) : "a branch";
  this->Note(name + (goesOn ? " added, going on from " : " added to ") + parent + " at " +
      PlaceText(this->Tree.points[start]) + ": " + Millimetres(length) +
      (this->Scene.image ? text : ""),
    this->Tree.points[start], length, share);
}

void TreeEditor::Join(const ProgressCallback& progress)
{
  Place from = this->Find(this->Now->points.front());
  Place to = this->Find(this->Now->points.back());
  std::vector<char> below(this->Tree.branches.size(), 0);
  double length = this->MarkBelow(to.branch, below);
  if (below[from.branch] != 0)
  {
    this->Fail(PlaceText(this->Now->points.front()) + " on " + this->NameOf(from.branch) +
      (from.branch == to.branch ? " is of the same branch as " : " hangs on ") +
      PlaceText(this->Now->points.back()) + ": the way would be a loop");
  }
  bool goesOn = this->GoesOn(from);
  const VesselTree::Branch old = this->Tree.branches[to.branch];
  const bool root = old.parentGroupId < 0;
  const std::string names = this->NameOf(from.branch) + " to " + this->NameOf(to.branch);
  // The fork itself stays with the old parent.
  to.at = std::max<std::size_t>(to.at, root ? 0 : 1);
  const std::int64_t meets = old.points[to.at];
  std::int64_t start = this->PointOf(from);
  this->Ends = below; // where the way ends it does not begin
  const MeasuredPath path = this->Draw(start, goesOn, { this->Tree.points[meets] }, progress);
  this->Ends.clear();
  const int joined = this->Append(path, start, meets, old.segmentId);

  // What was before the place is fed from it now, if it is more than the mouth in the old parent.
  std::vector<std::int64_t> up(old.points.begin() + (root ? 0 : 1),
    old.points.begin() + static_cast<std::ptrdiff_t>(to.at) + 1);
  std::reverse(up.begin(), up.end());
  if (!root)
  {
    const std::int64_t fork = old.points.front();
    while (up.size() > 1 &&
      (this->Tree.points[up.back()] - this->Tree.points[fork]).norm() < this->Tree.radius[fork])
    {
      up.pop_back();
    }
  }
  const std::vector<std::int64_t> down(
    old.points.begin() + static_cast<std::ptrdiff_t>(to.at), old.points.end());
  VesselTree::Branch piece = old;
  piece.parentGroupId = joined;
  piece.treeId = this->Tree.branches[from.branch].treeId;
  int behind = joined;
  if (down.size() > 1)
  {
    piece.points = down;
    this->Tree.branches[to.branch] = piece; // keeps its group, and so its daughters
    behind = piece.groupId;
  }
  if (up.size() > 1 && ArcLengths(this->Tree, up).back() >= LeastStub)
  {
    piece.points = up;
    piece.groupId = joined + 1;
    this->Tree.branches.push_back(piece);
  }
  for (VesselTree::Branch& branch : this->Tree.branches)
  {
    const bool daughter = branch.parentGroupId == old.groupId;
    branch.parentGroupId = daughter ? behind : branch.parentGroupId;
  }
  for (std::size_t b = 0; b < below.size(); ++b)
  {
    if (below[b] != 0)
    {
      this->Tree.branches[b].treeId = this->Tree.branches[from.branch].treeId;
    }
  }
  if (down.size() <= 1)
  {
    this->Tree.branches.erase(this->Tree.branches.begin() + static_cast<std::ptrdiff_t>(to.branch));
  }
  const double way = (this->Tree.points[start] - this->Tree.points[meets]).norm();
  this->Note(
    names + " joined over " + Millimetres(way) + " at " + PlaceText(this->Tree.points[start]),
    this->Tree.points[start], length);
}

EditedTree TreeEditor::Finish(const ProgressCallback& progress)
{
  EditedTree result;
  std::vector<std::int64_t> index(this->Tree.points.size(), -1);
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    for (const std::int64_t p : branch.points)
    {
      index[p] = 0;
    }
  }
  VesselTree& tree = result.tree;
  std::vector<char> fresh;
  for (std::size_t p = 0; p < index.size(); ++p)
  {
    if (index[p] < 0)
    {
      continue;
    }
    index[p] = static_cast<std::int64_t>(tree.points.size());
    tree.points.push_back(this->Tree.points[p]);
    tree.radius.push_back(this->Tree.radius[p]);
    tree.confidence.push_back(this->Tree.confidence[p]);
    tree.bridged.push_back(this->Tree.bridged[p]);
    tree.bridgeConfidence.push_back(this->Tree.bridgeConfidence[p]);
    tree.segmentId.push_back(this->Tree.segmentId[p]);
    result.source.push_back(this->Source[p]);
    result.edit.push_back(this->Edits[p]);
    fresh.push_back(this->Fresh[p]);
  }
  tree.branches = this->Tree.branches;
  for (VesselTree::Branch& branch : tree.branches)
  {
    for (std::int64_t& p : branch.points)
    {
      p = index[p];
    }
  }
  const bool measure = this->Scene.image && std::count(fresh.begin(), fresh.end(), 1) > 0;
  if (measure)
  {
    // As the radii of the others: beside calcium and in narrowings a half maximum is no width.
    const double blur = this->Scene.blur > 0.0
      ? this->Scene.blur
      : 0.8 * std::cbrt(this->Scene.image->grid.spacing.prod());
    const RefinedLumen lumen =
      MeasureTreeLumen(tree, VesselPaths(tree), *this->Scene.image, blur, progress).lumen;
    for (std::size_t p = 0; p < fresh.size(); ++p)
    {
      tree.radius[p] = fresh[p] != 0 && lumen.measured[p] > 0.0 ? lumen.radius[p] : tree.radius[p];
    }
  }
  MeasureTree(tree);
  result.notes = std::move(this->Notes);
  return result;
}
}
