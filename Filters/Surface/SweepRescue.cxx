#include "SweepRescue.h"

#include "SurfaceCheck.h"
#include "SurfaceCleaning.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <sstream>

namespace coronary
{
namespace
{
/// What stays of a branch that is shorter than so many radii can not be seen outside its parent.
constexpr double MinimumStub = 3.0;
/// The volume may change by this share when triangles are replaced.
constexpr double VolumeChange = 0.02;

double SignedVolume(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  double volume = 0.0;
  const Vector3 origin = triangles.empty() ? Vector3::Zero() : points[triangles[0][0]];
  for (const Triangle& t : triangles)
  {
    const Vector3 a = points[t[0]] - origin;
    volume += a.cross(points[t[1]] - origin).dot(points[t[2]] - origin) / 6.0;
  }
  return volume;
}

double MinimumAngleOf(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  double minimum = 180.0;
  for (const Triangle& t : triangles)
  {
    for (int c = 0; c < 3; ++c)
    {
      const Vector3 u = points[t[(c + 1) % 3]] - points[t[c]];
      const Vector3 v = points[t[(c + 2) % 3]] - points[t[c]];
      minimum = std::min(minimum, std::atan2(u.cross(v).norm(), u.dot(v)) * 180.0 / M_PI);
    }
  }
  return minimum;
}

/// Vertices minus edges plus triangles of a closed surface.
std::int64_t EulerOf(std::size_t points, std::size_t triangles)
{
  return static_cast<std::int64_t>(points) - static_cast<std::int64_t>(triangles) / 2;
}

double LengthOf(const VesselTree& tree, const std::vector<std::int64_t>& list)
{
  double length = 0.0;
  for (std::size_t i = 1; i < list.size(); ++i)
  {
    length += (tree.points[list[i]] - tree.points[list[i - 1]]).norm();
  }
  return length;
}

/// Distance of a place from the polyline of a branch.
double DistanceTo(const VesselTree& tree, const std::vector<std::int64_t>& list,
  const Vector3& place, std::size_t& at)
{
  double best = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < list.size(); ++i)
  {
    const double distance = (tree.points[list[i]] - place).norm();
    if (distance < best)
    {
      best = distance;
      at = i;
    }
  }
  return best;
}
}

std::string VesselName(const VesselTree& tree, int groupId)
{
  const auto found = std::find_if(tree.branches.begin(), tree.branches.end(),
    [&](const VesselTree::Branch& branch) { return branch.groupId == groupId; });
  const std::string group = "group " + std::to_string(groupId);
  return found == tree.branches.end() || found->name.empty() ? group
                                                             : found->name + " (" + group + ")";
}

std::string SweepPlace(const Vector3& position)
{
  std::ostringstream text;
  text.precision(6);
  text << "(" << position[0] << ", " << position[1] << ", " << position[2] << ")";
  return text.str();
}

void AddRepair(std::vector<SweepRepair>& repairs, std::vector<std::string>& remarks,
  const VesselTree& tree, int groupId, const std::string& what, const Vector3& place)
{
  const std::string vessel = VesselName(tree, groupId);
  const std::string remark = vessel + " at " + SweepPlace(place) + ": " + what;
  // An end is looked at once more after what changed beside it.
  if (std::find(remarks.begin(), remarks.end(), remark) == remarks.end())
  {
    repairs.push_back({ groupId, vessel, what, place });
    remarks.push_back(remark);
  }
}

void AddLeftOut(std::vector<SweepLeftOut>& leftOut, std::vector<std::string>& remarks,
  const VesselTree& tree, int groupId, const std::string& reason, const Vector3& place,
  double length)
{
  const std::string vessel = VesselName(tree, groupId);
  leftOut.push_back({ groupId, vessel, reason, place, length });
  std::ostringstream text;
  text.precision(3);
  text << vessel << " is left out from " << SweepPlace(place) << " on (" << length
       << " mm): " << reason << "; look at the centerline there, and correct or remove it";
  remarks.push_back(text.str());
}

SweepCut CutTree(VesselTree& tree, int groupId, const Vector3& place, double reach)
{
  SweepCut cut;
  int branch = -1;
  std::size_t at = 0;
  double nearest = std::numeric_limits<double>::max();
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    std::size_t i = 0;
    if (tree.branches[b].groupId == groupId && !tree.branches[b].points.empty())
    {
      const double distance = DistanceTo(tree, tree.branches[b].points, place, i);
      if (distance < nearest)
      {
        nearest = distance;
        branch = static_cast<int>(b);
        at = i;
      }
    }
  }
  if (branch < 0)
  {
    return cut;
  }
  // Where others begin or pass: a start that no other branch has is a root.
  std::map<std::int64_t, std::vector<int>> users;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    for (const std::int64_t p : tree.branches[b].points)
    {
      users[p].push_back(static_cast<int>(b));
    }
  }
  std::vector<std::int64_t>& list = tree.branches[branch].points;
  const auto signedOf = [](std::size_t i) { return static_cast<std::ptrdiff_t>(i); };
  const auto away = [&](std::size_t i) { return (tree.points[list[i]] - place).norm(); };
  std::size_t before = at + 1; // points [0, before) stay
  while (before > 0 && away(before - 1) <= reach)
  {
    --before;
  }
  std::size_t after = at; // or points [after, ...)
  while (after < list.size() && away(after) <= reach)
  {
    ++after;
  }
  const bool root = users[list.front()].size() == 1;
  const bool carries = users[list.back()].size() > 1;
  const auto begin = list.begin();
  const double stub = MinimumStub * tree.radius[list[at]];
  const double head = before < 2 ? 0.0 : LengthOf(tree, { begin, begin + signedOf(before) });
  const double tail =
    after + 1 >= list.size() ? 0.0 : LengthOf(tree, { begin + signedOf(after), list.end() });
  // Of a root that carries others every bit counts.
  const bool keepTail = root && head < stub && tail > (carries ? 0.2 * stub : stub);
  const bool keepHead = !keepTail && head >= stub;
  std::vector<std::int64_t> kept;
  std::set<std::int64_t> gone(list.begin(), list.end());
  std::size_t first = 0;
  cut.atRoot = keepTail;
  if (keepTail)
  {
    kept.assign(begin + signedOf(after), list.end());
  }
  else if (keepHead)
  {
    kept.assign(begin, begin + signedOf(before));
    first = before - 1;
  }
  else if (!root)
  {
    gone.erase(list.front()); // the parent's point
  }
  for (const std::int64_t p : kept)
  {
    gone.erase(p);
  }
  const double all = LengthOf(tree, list);
  const Vector3 from = tree.points[list[first]];
  cut.parts.push_back({ groupId, VesselName(tree, groupId), "", from, all - LengthOf(tree, kept) });
  std::vector<char> removed(tree.branches.size(), 0);
  removed[branch] = kept.size() < 2 ? 1 : 0;
  list = kept;
  // Branches that begin where nothing is any more, and theirs.
  for (bool more = true; more;)
  {
    more = false;
    for (std::size_t b = 0; b < tree.branches.size(); ++b)
    {
      VesselTree::Branch& other = tree.branches[b];
      if (static_cast<int>(b) == branch || removed[b] != 0 || other.points.empty() ||
        gone.count(other.points.front()) == 0)
      {
        continue;
      }
      removed[b] = 1;
      more = true;
      cut.parts.push_back({ other.groupId, VesselName(tree, other.groupId), "",
        tree.points[other.points.front()], LengthOf(tree, other.points) });
      gone.insert(other.points.begin(), other.points.end());
    }
  }
  std::vector<VesselTree::Branch> stay;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    if (removed[b] == 0)
    {
      stay.push_back(std::move(tree.branches[b]));
    }
  }
  tree.branches = std::move(stay);
  for (const SweepLeftOut& part : cut.parts)
  {
    cut.length += part.length;
  }
  return cut;
}

std::vector<std::int64_t> CellsThatFail(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  try
  {
    CheckSelfIntersections(CheckSurface(points, triangles));
    return {};
  }
  catch (const SurfaceError& error)
  {
    return error.cells;
  }
}

bool CleanSweptMesh(RescueMesh& mesh, int components, double minimumAngle)
{
  std::vector<Vector3> points;
  points.reserve(mesh.vertices.size());
  for (const RemeshVertex& vertex : mesh.vertices)
  {
    points.push_back(vertex.position);
  }
  SurfaceCleaningSettings settings;
  settings.minimumComponentShare = 1e-3;
  settings.joinDistance = 0.0;
  CleanedSurface clean;
  try
  {
    clean = CleanSurface(points, mesh.triangles, settings);
    const ClosedSurface closed = CheckSurface(clean.points, clean.triangles);
    if (static_cast<int>(closed.volume.size()) != components ||
      EulerOf(closed.points.size(), closed.triangles.size()) != 2 * components)
    {
      return false;
    }
    CheckSelfIntersections(closed);
  }
  catch (const std::invalid_argument&)
  {
    return false;
  }
  const double before = SignedVolume(points, mesh.triangles);
  const double volume = SignedVolume(clean.points, clean.triangles);
  if (std::abs(volume - before) > VolumeChange * std::abs(before) ||
    MinimumAngleOf(clean.points, clean.triangles) < minimumAngle)
  {
    return false;
  }
  RescueMesh result;
  result.triangles = clean.triangles;
  std::map<int, std::size_t> caps;
  for (const int e : mesh.entity)
  {
    caps.emplace(e, 0);
  }
  for (std::size_t t = 0; t < clean.triangles.size(); ++t)
  {
    result.entity.push_back(mesh.entity[clean.nearestCell[t]]);
    ++caps[result.entity.back()];
  }
  if (std::any_of(caps.begin(), caps.end(), [](const auto& cap) { return cap.second == 0; }))
  {
    return false;
  }
  result.replaced.assign(clean.points.size(), 0);
  for (std::size_t i = 0; i < clean.points.size(); ++i)
  {
    RemeshVertex vertex = mesh.vertices[clean.nearestPoint[i]];
    const std::int64_t source = clean.sourcePoint[i];
    result.replaced[i] = source < 0 || mesh.vertices[source].position != clean.points[i] ? 1 : 0;
    vertex.position = clean.points[i];
    result.vertices.push_back(vertex);
  }
  for (std::size_t t = 0; t < clean.triangles.size(); ++t)
  {
    // Flips keep the source: three corners that were no triangle before.
    const std::int64_t source = clean.sourceCell[t];
    bool same = source >= 0;
    for (int c = 0; c < 3 && same; ++c)
    {
      const std::int64_t p = clean.sourcePoint[clean.triangles[t][c]];
      const Triangle& old = mesh.triangles[source];
      same = p >= 0 && std::find(old.begin(), old.end(), p) != old.end();
    }
    for (const std::int64_t p : clean.triangles[t])
    {
      result.replaced[p] = same ? result.replaced[p] : 1;
    }
  }
  mesh = std::move(result);
  return true;
}
}
