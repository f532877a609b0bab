#include "DraftBranches.h"

#include <algorithm>
#include <functional>
#include <map>
#include <queue>

namespace coronary
{
namespace
{
double DraftLength(const LineGraph& graph, const DraftBranch& branch)
{
  double length = 0.0;
  for (std::size_t i = 1; i < branch.vertices.size(); ++i)
  {
    length += (graph.points[branch.vertices[i]] - graph.points[branch.vertices[i - 1]]).norm();
  }
  return length;
}
}

void DraftTree(const LineGraph& graph, int root, int tree, std::vector<DraftBranch>& drafts)
{
  struct Start
  {
    int from;
    int to;
    int parent;
  };
  std::vector<Start> stack;
  for (const int next : graph.neighbours[root])
  {
    stack.push_back({ root, next, -1 });
  }
  while (!stack.empty())
  {
    const Start start = stack.back();
    stack.pop_back();
    const int index = static_cast<int>(drafts.size());
    drafts.emplace_back();
    DraftBranch& branch = drafts.back();
    branch.parent = start.parent;
    branch.tree = tree;
    branch.vertices = { start.from, start.to };
    if (start.parent >= 0)
    {
      drafts[start.parent].daughters.push_back(index);
    }
    int last = start.from;
    int at = start.to;
    while (graph.neighbours[at].size() == 2)
    {
      const int next = graph.neighbours[at][graph.neighbours[at][0] == last ? 1 : 0];
      branch.vertices.push_back(next);
      last = at;
      at = next;
    }
    for (const int next : graph.neighbours[at])
    {
      if (next != last)
      {
        stack.push_back({ at, next, index });
      }
    }
  }
}

void Prune(const LineGraph& graph, double ratio, std::vector<DraftBranch>& drafts, int& count,
  double& length)
{
  // Shortest first, in radii of the vessel that it leaves; entries go stale when branches join.
  using Item = std::pair<double, int>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  std::map<int, int> rootBranches;
  for (const DraftBranch& draft : drafts)
  {
    rootBranches[draft.tree] += draft.parent < 0;
  }
  const auto consider = [&](int b)
  {
    const DraftBranch& branch = drafts[b];
    if (branch.alive && branch.daughters.empty())
    {
      const double shortness = DraftLength(graph, branch) / graph.radius[branch.vertices.front()];
      if (shortness < ratio)
      {
        queue.emplace(shortness, b);
      }
    }
  };
  for (std::size_t b = 0; b < drafts.size(); ++b)
  {
    consider(static_cast<int>(b));
  }
  while (!queue.empty())
  {
    const auto [shortness, b] = queue.top();
    queue.pop();
    DraftBranch& twig = drafts[b];
    if (!twig.alive || !twig.daughters.empty() ||
      (twig.parent < 0 && rootBranches[twig.tree] < 2) ||
      DraftLength(graph, twig) / graph.radius[twig.vertices.front()] != shortness)
    {
      continue;
    }
    twig.alive = false;
    ++count;
    length += DraftLength(graph, twig);
    if (twig.parent < 0)
    {
      --rootBranches[twig.tree];
      continue;
    }
    DraftBranch& parent = drafts[twig.parent];
    parent.daughters.erase(std::find(parent.daughters.begin(), parent.daughters.end(), b));
    if (parent.daughters.size() == 1)
    {
      DraftBranch& rest = drafts[parent.daughters[0]];
      parent.vertices.insert(parent.vertices.end(), rest.vertices.begin() + 1, rest.vertices.end());
      rest.alive = false;
      parent.daughters = rest.daughters;
      for (const int d : parent.daughters)
      {
        drafts[d].parent = twig.parent;
      }
    }
    consider(twig.parent);
  }
}

std::vector<int> LivingDrafts(const std::vector<DraftBranch>& drafts)
{
  std::vector<int> which;
  for (std::size_t d = 0; d < drafts.size(); ++d)
  {
    if (drafts[d].alive)
    {
      which.push_back(static_cast<int>(d));
    }
  }
  // Parents first, whatever the pruning did to the order.
  std::vector<int> depth(drafts.size(), 0);
  for (const int d : which)
  {
    for (int at = drafts[d].parent; at >= 0; at = drafts[at].parent)
    {
      ++depth[d];
    }
  }
  std::stable_sort(which.begin(), which.end(), [&](int a, int b) { return depth[a] < depth[b]; });
  return which;
}
}
