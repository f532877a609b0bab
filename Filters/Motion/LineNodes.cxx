#include "LineNodes.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace coronary
{
namespace
{
struct Link
{
  int node;
  double length;
};

/// Parents, steps and an order in which parents come first.
void ConnectNodes(const std::vector<std::vector<Link>>& links, LineNodes& nodes)
{
  const std::size_t size = nodes.size();
  nodes.parent.assign(size, -2);
  nodes.step.assign(size, 0.0);
  for (std::size_t root = 0; root < size; ++root)
  {
    if (nodes.parent[root] != -2)
    {
      continue;
    }
    nodes.parent[root] = -1;
    nodes.order.push_back(static_cast<int>(root));
    for (std::size_t next = nodes.order.size() - 1; next < nodes.order.size(); ++next)
    {
      const int node = nodes.order[next];
      for (const Link& link : links[node])
      {
        if (nodes.parent[link.node] == -2)
        {
          nodes.parent[link.node] = node;
          nodes.step[link.node] = std::max(link.length, 1e-3);
          nodes.order.push_back(link.node);
        }
      }
    }
  }
}

/// From one neighbour to another one; where lines meet, along the vessel that goes straight on.
void FindTangents(const std::vector<std::vector<Link>>& links, LineNodes& nodes)
{
  const std::size_t size = nodes.size();
  nodes.tangent.assign(size, Vector3::UnitX());
  for (std::size_t node = 0; node < size; ++node)
  {
    const std::vector<Link>& around = links[node];
    double straightest = 2.0;
    for (std::size_t a = 0; a < around.size(); ++a)
    {
      const Vector3 back = (nodes.position[around[a].node] - nodes.position[node]).normalized();
      if (around.size() == 1)
      {
        nodes.tangent[node] = back;
      }
      for (std::size_t b = a + 1; b < around.size(); ++b)
      {
        const Vector3 on = (nodes.position[around[b].node] - nodes.position[node]).normalized();
        if (back.dot(on) < straightest && (on - back).norm() > 1e-9)
        {
          straightest = back.dot(on);
          nodes.tangent[node] = (on - back).normalized();
        }
      }
    }
    if (!(std::abs(nodes.tangent[node].norm() - 1.0) < 1e-6))
    {
      nodes.tangent[node] = Vector3::UnitX();
    }
  }
}
}

LineNodes PlaceNodes(const Polylines& lines, double spacing)
{
  CheckPolylines(lines);
  const std::size_t count = lines.points.size();
  // Ends and meetings of lines: every point that is not in the middle of exactly one line.
  std::vector<int> uses(count, 0);
  std::vector<char> end(count, 0);
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    for (const std::int64_t point : line)
    {
      ++uses[point];
    }
    end[line.front()] = 1;
    end[line.back()] = 1;
  }

  LineNodes nodes;
  nodes.points.resize(count);
  std::vector<int> nodeOf(count, -1);
  std::vector<std::vector<Link>> links;
  const auto addNode = [&](const Vector3& position, double radius)
  {
    nodes.position.push_back(position);
    if (!lines.radius.empty())
    {
      nodes.radius.push_back(radius);
    }
    links.emplace_back();
    return static_cast<int>(nodes.position.size()) - 1;
  };
  const auto nodeAt = [&](std::int64_t point)
  {
    if (nodeOf[point] < 0)
    {
      nodeOf[point] =
        addNode(lines.points[point], lines.radius.empty() ? 0.0 : lines.radius[point]);
      nodes.points[point] = { nodeOf[point], nodeOf[point], 0.0 };
    }
    return nodeOf[point];
  };

  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    std::size_t first = 0;
    while (first + 1 < line.size())
    {
      std::size_t last = first + 1;
      while (last + 1 < line.size() && uses[line[last]] == 1 && end[line[last]] == 0)
      {
        ++last;
      }
      // One stretch between two fixed nodes, cut evenly.
      std::vector<double> along(last - first + 1, 0.0);
      for (std::size_t n = first; n < last; ++n)
      {
        along[n + 1 - first] =
          along[n - first] + (lines.points[line[n + 1]] - lines.points[line[n]]).norm();
      }
      const double length = along.back();
      const int steps = std::max(1, static_cast<int>(std::ceil(length / spacing - 1e-9)));
      std::vector<int> chain{ nodeAt(line[first]) };
      std::size_t segment = 0;
      for (int step = 1; step < steps; ++step)
      {
        const double target = length * step / steps;
        while (segment + 2 < along.size() && along[segment + 1] < target)
        {
          ++segment;
        }
        const double share = std::clamp(
          (target - along[segment]) / std::max(along[segment + 1] - along[segment], 1e-12), 0.0,
          1.0);
        const std::int64_t a = line[first + segment];
        const std::int64_t b = line[first + segment + 1];
        chain.push_back(addNode(lines.points[a] * (1.0 - share) + lines.points[b] * share,
          lines.radius.empty() ? 0.0 : lines.radius[a] * (1.0 - share) + lines.radius[b] * share));
      }
      chain.push_back(nodeAt(line[last]));
      for (std::size_t n = 0; n + 1 < chain.size(); ++n)
      {
        links[chain[n]].push_back({ chain[n + 1], length / steps });
        links[chain[n + 1]].push_back({ chain[n], length / steps });
      }
      for (std::size_t n = first + 1; n < last; ++n)
      {
        const double place = length > 0.0 ? along[n - first] / length * steps : 0.0;
        const int below = std::clamp(static_cast<int>(place), 0, steps - 1);
        nodes.points[line[n]] = { chain[below], chain[below + 1],
          std::clamp(place - below, 0.0, 1.0) };
      }
      first = last;
    }
  }
  for (std::size_t point = 0; point < count; ++point)
  {
    if (uses[point] == 0)
    {
      nodeAt(static_cast<std::int64_t>(point));
    }
  }

  // The forest, from the first node of each tree on.
  ConnectNodes(links, nodes);
  FindTangents(links, nodes);
  return nodes;
}
}
