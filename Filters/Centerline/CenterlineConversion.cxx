#include "CenterlineConversion.h"

#include <algorithm>
#include <cmath>
#include <istream>
#include <limits>
#include <map>
#include <ostream>
#include <set>
#include <sstream>
#include <stdexcept>

namespace coronary
{
namespace
{
using Branch = VesselTree::Branch;

[[noreturn]] void Fail(const std::string& message)
{
  throw std::invalid_argument(message);
}

void CheckTract(const VmtkTract& tract, std::size_t index)
{
  const std::string name = "tract " + std::to_string(index);
  if (tract.points.size() < 2)
  {
    Fail(name + " has less than two points");
  }
  if (tract.radius.size() != tract.points.size())
  {
    Fail(name + " has " + std::to_string(tract.radius.size()) + " radii for " +
      std::to_string(tract.points.size()) + " points");
  }
  for (std::size_t i = 0; i < tract.points.size(); ++i)
  {
    if (!tract.points[i].allFinite() || !(tract.radius[i] >= 0.0) ||
      !std::isfinite(tract.radius[i]))
    {
      Fail("point " + std::to_string(i) + " of " + name +
        " has a position or radius that can not be used");
    }
  }
}
}

std::vector<VmtkTract> ToVmtkTracts(const VesselTree& given)
{
  CheckTree(given);
  // Whole branches only: a path that leaves a branch in its middle would cut it.
  const bool isSplit = [&]
  {
    std::map<int, std::int64_t> ends;
    for (const Branch& branch : given.branches)
    {
      if (branch.parentGroupId != -1 && ends[branch.parentGroupId] != branch.points.front())
      {
        return false;
      }
      ends[branch.groupId] = branch.points.back();
    }
    return true;
  }();
  const VesselTree tree = isSplit ? given : SplitAtBifurcations(given);
  std::map<int, const Branch*> byGroup;
  std::set<int> parents;
  for (const Branch& branch : tree.branches)
  {
    byGroup[branch.groupId] = &branch;
    parents.insert(branch.parentGroupId);
  }
  std::vector<VmtkTract> tracts;
  int path = 0;
  for (const Branch& tip : tree.branches)
  {
    if (parents.count(tip.groupId) > 0)
    {
      continue;
    }
    std::vector<const Branch*> way;
    for (const Branch* branch = &tip;; branch = byGroup[branch->parentGroupId])
    {
      way.push_back(branch);
      if (branch->parentGroupId == -1)
      {
        break;
      }
    }
    int number = 0;
    for (auto branch = way.rbegin(); branch != way.rend(); ++branch)
    {
      VmtkTract tract;
      tract.centerlineId = path;
      tract.tractId = number++;
      tract.groupId = (*branch)->groupId;
      for (const std::int64_t point : (*branch)->points)
      {
        tract.points.push_back(tree.points[point]);
        tract.radius.push_back(tree.radius[point]);
        tract.source.push_back(point);
      }
      tracts.push_back(std::move(tract));
    }
    ++path;
  }
  return tracts;
}

VesselTree FromVmtkTracts(
  const std::vector<VmtkTract>& tracts, double tolerance, std::vector<TractPoint>* origins)
{
  if (origins != nullptr)
  {
    origins->clear();
  }
  if (!(tolerance >= 0.0 && std::isfinite(tolerance)))
  {
    Fail("the tolerance must be 0 or more");
  }
  std::map<int, std::map<int, std::size_t>> paths;
  for (std::size_t t = 0; t < tracts.size(); ++t)
  {
    CheckTract(tracts[t], t);
    if (!paths[tracts[t].centerlineId].emplace(tracts[t].tractId, t).second)
    {
      Fail("tract " + std::to_string(t) + " has the number " + std::to_string(tracts[t].tractId) +
        " on centerline " + std::to_string(tracts[t].centerlineId) + ", as another one");
    }
  }
  VesselTree tree;
  std::map<int, std::size_t> branchOf; // by group
  for (const auto& [path, parts] : paths)
  {
    int parent = -1;
    int number = 0;
    for (const auto& [tractId, t] : parts)
    {
      const VmtkTract& tract = tracts[t];
      const std::string name = "tract " + std::to_string(t);
      if (tractId != number)
      {
        Fail("centerline " + std::to_string(path) + " has no tract " + std::to_string(number));
      }
      ++number;
      const auto known = branchOf.find(tract.groupId);
      if (known != branchOf.end())
      {
        if (tree.branches[known->second].parentGroupId != parent)
        {
          Fail(name + " of group " + std::to_string(tract.groupId) +
            " follows another group than the first tract of its group does");
        }
        parent = tract.groupId;
        continue;
      }
      Branch branch;
      branch.groupId = tract.groupId;
      branch.parentGroupId = parent;
      std::size_t first = 0;
      if (parent != -1)
      {
        const Branch& before = tree.branches[branchOf[parent]];
        branch.treeId = before.treeId;
        const std::int64_t end = before.points.back();
        if ((tree.points[end] - tract.points.front()).norm() > tolerance)
        {
          Fail(name + " does not begin where group " + std::to_string(parent) + " ends");
        }
        branch.points.push_back(end);
        first = 1;
      }
      else
      {
        branch.treeId = static_cast<int>(std::count_if(tree.branches.begin(), tree.branches.end(),
          [](const Branch& b) { return b.parentGroupId == -1; }));
      }
      for (std::size_t i = first; i < tract.points.size(); ++i)
      {
        branch.points.push_back(static_cast<std::int64_t>(tree.points.size()));
        tree.points.push_back(tract.points[i]);
        tree.radius.push_back(tract.radius[i]);
        if (origins != nullptr)
        {
          origins->push_back({ t, i });
        }
      }
      branchOf[tract.groupId] = tree.branches.size();
      tree.branches.push_back(std::move(branch));
      parent = tract.groupId;
    }
  }
  MeasureTree(tree);
  return tree;
}

TgfSkeleton ToSkeleton(const VesselTree& tree)
{
  CheckTree(tree);
  TgfSkeleton skeleton;
  std::map<std::int64_t, std::int64_t> joints;
  const auto joint = [&](std::int64_t point)
  {
    const auto [place, isNew] =
      joints.emplace(point, static_cast<std::int64_t>(skeleton.joints.size()));
    if (isNew)
    {
      skeleton.joints.push_back(tree.points[point]);
    }
    return place->second;
  };
  for (const Branch& branch : tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const std::int64_t from = joint(branch.points[i - 1]);
      skeleton.bones.push_back({ from, joint(branch.points[i]) });
    }
  }
  return skeleton;
}

VesselTree FromSkeleton(const TgfSkeleton& skeleton, double radius)
{
  if (!(radius >= 0.0 && std::isfinite(radius)))
  {
    Fail("the radius must be 0 or more");
  }
  const auto count = static_cast<std::int64_t>(skeleton.joints.size());
  for (std::int64_t j = 0; j < count; ++j)
  {
    if (!skeleton.joints[j].allFinite())
    {
      Fail("joint " + std::to_string(j) + " is not finite");
    }
  }
  // Sets of joints that hang together, to find loops.
  std::vector<std::int64_t> leader(count);
  for (std::int64_t j = 0; j < count; ++j)
  {
    leader[j] = j;
  }
  const auto leaderOf = [&](std::int64_t joint)
  {
    while (leader[joint] != joint)
    {
      leader[joint] = leader[leader[joint]];
      joint = leader[joint];
    }
    return joint;
  };
  std::vector<std::vector<std::int64_t>> neighbours(count);
  std::vector<int> arrivals(count, 0);
  for (std::size_t b = 0; b < skeleton.bones.size(); ++b)
  {
    const auto [from, to] = skeleton.bones[b];
    const std::string name = "bone " + std::to_string(b);
    if (from < 0 || to < 0 || from >= count || to >= count)
    {
      Fail(name + " refers to a joint that does not exist");
    }
    if (leaderOf(from) == leaderOf(to))
    {
      Fail(name +
        (from == to ? " begins and ends at one joint" : " closes a loop, or is there twice"));
    }
    leader[leaderOf(from)] = leaderOf(to);
    neighbours[from].push_back(to);
    neighbours[to].push_back(from);
    ++arrivals[to];
  }
  // Roots: of each piece the joint at which bones only begin; else the first end.
  std::map<std::int64_t, std::vector<std::int64_t>> pieces;
  for (std::int64_t j = 0; j < count; ++j)
  {
    if (!neighbours[j].empty())
    {
      pieces[leaderOf(j)].push_back(j);
    }
  }
  std::vector<std::int64_t> roots;
  for (const auto& [name, joints] : pieces)
  {
    std::vector<std::int64_t> sources;
    std::vector<std::int64_t> ends;
    for (const std::int64_t joint : joints)
    {
      if (arrivals[joint] == 0)
      {
        sources.push_back(joint);
      }
      if (neighbours[joint].size() == 1)
      {
        ends.push_back(joint);
      }
    }
    roots.push_back(sources.size() == 1 ? sources.front() : ends.front());
  }
  std::sort(roots.begin(), roots.end());

  VesselTree tree;
  tree.points = skeleton.joints;
  tree.radius.assign(skeleton.joints.size(), radius);
  struct Start
  {
    std::int64_t joint, next;
    int parent, treeId;
  };
  for (std::size_t r = 0; r < roots.size(); ++r)
  {
    std::vector<Start> stack;
    const auto push = [&](std::int64_t joint, std::int64_t before, int parent)
    {
      // The last one pushed is the first one taken.
      for (auto n = neighbours[joint].rbegin(); n != neighbours[joint].rend(); ++n)
      {
        if (*n != before)
        {
          stack.push_back({ joint, *n, parent, static_cast<int>(r) });
        }
      }
    };
    push(roots[r], -1, -1);
    while (!stack.empty())
    {
      const Start start = stack.back();
      stack.pop_back();
      Branch branch;
      branch.groupId = static_cast<int>(tree.branches.size());
      branch.parentGroupId = start.parent;
      branch.treeId = start.treeId;
      branch.points = { start.joint, start.next };
      std::int64_t before = start.joint;
      std::int64_t here = start.next;
      while (neighbours[here].size() == 2)
      {
        const std::int64_t next =
          neighbours[here][0] == before ? neighbours[here][1] : neighbours[here][0];
        branch.points.push_back(next);
        before = here;
        here = next;
      }
      const int group = branch.groupId;
      tree.branches.push_back(std::move(branch));
      push(here, before, group);
    }
  }
  MeasureTree(tree);
  return tree;
}

void WriteTgf(std::ostream& stream, const TgfSkeleton& skeleton)
{
  const auto precision = stream.precision(std::numeric_limits<double>::max_digits10);
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j)
  {
    const Vector3& p = skeleton.joints[j];
    stream << j + 1 << ' ' << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  }
  stream << "#\n";
  for (const auto& [from, to] : skeleton.bones)
  {
    stream << from + 1 << ' ' << to + 1 << '\n';
  }
  stream.precision(precision);
}

TgfSkeleton ReadTgf(std::istream& stream)
{
  TgfSkeleton skeleton;
  std::map<std::int64_t, std::int64_t> joints; // by their number in the file
  std::string text;
  int part = 0;
  for (int line = 1; std::getline(stream, text); ++line)
  {
    const std::string place = "line " + std::to_string(line) + " of the TGF skeleton";
    std::istringstream words(text);
    std::string first;
    if (!(words >> first))
    {
      continue;
    }
    if (first.front() == '#')
    {
      ++part;
      if (part == 2)
      {
        break;
      }
      continue;
    }
    words.seekg(0);
    if (part == 0)
    {
      std::int64_t number = 0;
      Vector3 p;
      if (!(words >> number >> p.x() >> p.y() >> p.z()) || !p.allFinite())
      {
        Fail(place + " is no joint: a number and three coordinates");
      }
      if (!joints.emplace(number, static_cast<std::int64_t>(skeleton.joints.size())).second)
      {
        Fail(place + ": there are two joints " + std::to_string(number));
      }
      skeleton.joints.push_back(p);
      continue;
    }
    std::int64_t from = 0;
    std::int64_t to = 0;
    if (!(words >> from >> to))
    {
      Fail(place + " is no bone: two numbers of joints");
    }
    const auto a = joints.find(from);
    const auto b = joints.find(to);
    if (a == joints.end() || b == joints.end())
    {
      Fail(place + ": there is no joint " + std::to_string(a == joints.end() ? from : to));
    }
    skeleton.bones.push_back({ a->second, b->second });
  }
  if (part == 0 && !skeleton.joints.empty())
  {
    Fail("the TGF skeleton has no '#' between joints and bones");
  }
  return skeleton;
}
}
