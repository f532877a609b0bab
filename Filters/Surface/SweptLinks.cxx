#include "SweptLumenBuild.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace coronary
{
namespace
{
/// A free end whose chord is shorter than this share of its length, within so many radii, is a
/// hairpin.
constexpr double HairpinRatio = 0.5;
constexpr double HairpinReach = 6.0;
}

void SweptLumen::Build::Check() const
{
  if (this->points.size() != this->radius.size())
  {
    throw std::invalid_argument("SweepVesselTree: " + std::to_string(this->points.size()) +
      " points but " + std::to_string(this->radius.size()) + " radii");
  }
  for (std::size_t b = 0; b < this->input.branches.size(); ++b)
  {
    const VesselTree::Branch& branch = this->input.branches[b];
    const std::string name = "SweepVesselTree: branch " + std::to_string(b) + " (group " +
      std::to_string(branch.groupId) + ")";
    for (const std::int64_t p : branch.points)
    {
      if (p < 0 || p >= static_cast<std::int64_t>(this->points.size()))
      {
        throw std::invalid_argument(name + " names point " + std::to_string(p) + " of " +
          std::to_string(this->points.size()));
      }
      if (!this->points[p].allFinite() || !std::isfinite(this->radius[p]))
      {
        throw std::invalid_argument(
          name + ": point " + std::to_string(p) + " has a position or radius that is no number");
      }
      if (this->radius[p] <= 0.0)
      {
        throw std::invalid_argument(name + ": radius " + std::to_string(this->radius[p]) +
          " at point " + std::to_string(p) + ", it must be positive");
      }
    }
    double length = 0.0;
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      length += (this->points[branch.points[i]] - this->points[branch.points[i - 1]]).norm();
    }
    if (branch.points.size() < 2 || !(length > 1e-6 * this->radius[branch.points[0]]))
    {
      throw std::invalid_argument(name + " has no length");
    }
  }
  if (!this->input.endNormals.empty())
  {
    if (this->input.endNormals.size() != this->points.size())
    {
      throw std::invalid_argument("SweepVesselTree: " + std::to_string(this->points.size()) +
        " points but " + std::to_string(this->input.endNormals.size()) + " normals of ends");
    }
    for (std::size_t i = 0; i < this->input.endNormals.size(); ++i)
    {
      if (!this->input.endNormals[i].allFinite())
      {
        throw std::invalid_argument(
          "SweepVesselTree: normal of the end at point " + std::to_string(i) + " is no number");
      }
    }
  }
  if (this->input.contourSamples != 0)
  {
    const std::size_t n = this->points.size();
    if (this->input.contourSamples < 6 ||
      this->input.contours.size() != n * this->input.contourSamples ||
      this->input.contourNormals.size() != n)
    {
      throw std::invalid_argument(
        "SweepVesselTree: contours need at least 6 radii and one normal a point");
    }
    for (std::size_t i = 0; i < this->input.contours.size(); ++i)
    {
      if (!(this->input.contours[i] > 0.0) || !std::isfinite(this->input.contours[i]))
      {
        throw std::invalid_argument("SweepVesselTree: contour of point " +
          std::to_string(i / this->input.contourSamples) + " has a radius that is not positive");
      }
    }
  }
}

void SweptLumen::Build::FindLinks()
{
  std::map<std::int64_t, int> degree;
  std::vector<std::vector<std::int64_t>> clean;
  for (const VesselTree::Branch& branch : this->input.branches)
  {
    // Repeated points say nothing, but an end must stay where other branches join it.
    std::vector<std::int64_t> kept;
    for (const std::int64_t p : branch.points)
    {
      if (!kept.empty() &&
        (p == kept.back() ||
          (this->points[p] - this->points[kept.back()]).norm() < 1e-6 * this->radius[p]))
      {
        if (p == branch.points.back() && kept.size() > 1)
        {
          kept.back() = p;
        }
        continue;
      }
      kept.push_back(p);
    }
    for (std::size_t i = 0; i < kept.size(); ++i)
    {
      degree[kept[i]] += i == 0 || i + 1 == kept.size() ? 1 : 2;
    }
    clean.push_back(kept);
  }
  for (std::size_t b = 0; b < clean.size(); ++b)
  {
    for (int side = 0; side < 2; ++side)
    {
      // Both ends, one after the other.
      std::reverse(clean[b].begin(), clean[b].end());
      if (degree[clean[b].front()] == 1)
      {
        this->TrimHairpin(clean[b], degree, this->input.branches[b].groupId);
      }
    }
    Link link;
    link.group = this->input.branches[b].groupId;
    for (std::size_t i = 0; i < clean[b].size(); ++i)
    {
      link.points.push_back(clean[b][i]);
      if (i > 0 && i + 1 < clean[b].size() && degree[clean[b][i]] > 2)
      {
        this->links.push_back(link);
        link.points.assign(1, clean[b][i]);
      }
    }
    if (link.points.size() > 1)
    {
      this->links.push_back(link);
    }
  }
}

void SweptLumen::Build::LeaveOut(const SweepOmission& omission)
{
  for (Link& link : this->links)
  {
    std::vector<std::int64_t>& list = link.points;
    const bool atStart = list.front() == omission.end;
    if (!link.alive || (!atStart && list.back() != omission.end))
    {
      continue;
    }
    if (atStart)
    {
      std::reverse(list.begin(), list.end());
    }
    std::size_t kept = 0;
    double length = 0.0;
    while (
      kept < list.size() && (this->points[list[kept]] - omission.centre).norm() > omission.reach)
    {
      length += kept == 0 ? 0.0 : (this->points[list[kept]] - this->points[list[kept - 1]]).norm();
      ++kept;
    }
    link.alive = kept > 1 && kept < list.size() && length > 3.0 * this->radius[list[kept - 1]];
    const std::size_t from = link.alive ? kept - 1 : 0;
    AddLeftOut(self.LeftOutList, self.RemarkList, this->input, link.group,
      "where it begins no wall can be resolved", this->points[list[from]],
      this->LinkLength(link, from));
    if (link.alive)
    {
      list.resize(kept);
    }
    if (atStart)
    {
      std::reverse(list.begin(), list.end());
    }
  }
}

void SweptLumen::Build::TrimHairpin(
  std::vector<std::int64_t>& list, const std::map<std::int64_t, int>& degree, int group)
{
  std::size_t last = 0;
  double arc = 0.0;
  double widest = this->radius[list.front()];
  const Vector3 start = this->points[list.front()];
  for (std::size_t i = 1; i + 1 < list.size() && degree.at(list[i]) <= 2; ++i)
  {
    arc += (this->points[list[i]] - this->points[list[i - 1]]).norm();
    widest = std::max(widest, this->radius[list[i]]);
    if (arc > HairpinReach * widest)
    {
      break;
    }
    if (arc > 2.0 * widest && (this->points[list[i]] - start).norm() < HairpinRatio * arc &&
      (this->points[list[i]] - start).norm() < 2.0 * widest)
    {
      last = i;
    }
  }
  if (last == 0)
  {
    return;
  }
  std::size_t turn = 0;
  double farthest = 0.0;
  const Vector3 chord = (this->points[list[last]] - start).normalized();
  for (std::size_t i = 1; i < last; ++i)
  {
    const Vector3 offset = this->points[list[i]] - start;
    const double away = (offset - offset.dot(chord) * chord).norm();
    if (away > farthest)
    {
      farthest = away;
      turn = i;
    }
  }
  this->Repaired(
    group, "turns back inside itself; its end up to there is left out", this->points[list[turn]]);
  list.erase(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(turn));
}

void SweptLumen::Build::Connect()
{
  this->incidences.clear();
  this->treeOfNode.clear();
  std::map<std::int64_t, std::int64_t> parent;
  const auto root = [&](std::int64_t p)
  {
    while (parent.count(p) != 0 && parent[p] != p)
    {
      p = parent[p];
    }
    return p;
  };
  for (std::size_t i = 0; i < this->links.size(); ++i)
  {
    const Link& link = this->links[i];
    if (!link.alive)
    {
      continue;
    }
    const std::int64_t a = root(link.points.front());
    std::int64_t b = root(link.points.back());
    if (a == b)
    {
      this->OpenLoop(this->links[i]);
      if (!link.alive)
      {
        continue;
      }
      b = link.points.back(); // an end of its own now
    }
    parent.emplace(a, a);
    parent[b] = a;
    this->incidences[link.points.front()].push_back({ static_cast<int>(i), true });
    this->incidences[link.points.back()].push_back({ static_cast<int>(i), false });
  }
  std::map<std::int64_t, int> number;
  for (const auto& node : this->incidences)
  {
    const std::int64_t r = root(node.first);
    number.emplace(r, 0);
  }
  // Trees in the order of the input.
  int next = 0;
  std::map<std::int64_t, bool> seen;
  for (const Link& link : this->links)
  {
    if (link.alive)
    {
      const std::int64_t r = root(link.points.front());
      if (!seen[r])
      {
        seen[r] = true;
        number[r] = next++;
      }
    }
  }
  self.TreeCount = next;
  for (const auto& node : this->incidences)
  {
    this->treeOfNode[node.first] = number[root(node.first)];
  }
}

double SweptLumen::Build::LinkLength(const Link& link, std::size_t from) const
{
  double length = 0.0;
  for (std::size_t i = from + 1; i < link.points.size(); ++i)
  {
    length += (this->points[link.points[i]] - this->points[link.points[i - 1]]).norm();
  }
  return length;
}

void SweptLumen::Build::OpenLoop(Link& link)
{
  std::vector<std::int64_t>& list = link.points;
  const std::int64_t closing = list.back();
  const double reach =
    2.0 * (this->radius[closing] + (list.size() > 1 ? this->radius[list[list.size() - 2]] : 0.0));
  std::size_t kept = list.size() - 1;
  while (kept > 0 && (this->points[list[kept - 1]] - this->points[closing]).norm() < reach)
  {
    --kept;
  }
  Link head = link;
  head.points.resize(kept);
  link.alive = kept > 1 && this->LinkLength(head) > 3.0 * this->radius[list[kept - 1]];
  const std::size_t from = link.alive ? kept - 1 : 0;
  AddLeftOut(self.LeftOutList, self.RemarkList, this->input, link.group,
    "it would close a loop of branches", this->points[list[from]], this->LinkLength(link, from));
  if (link.alive)
  {
    list.resize(kept);
  }
}

void SweptLumen::Build::Repaired(int group, const std::string& what, const Vector3& place)
{
  AddRepair(self.RepairList, self.RemarkList, this->input, group, what, place);
}
}
