#include "LineGraph.h"

#include "DisjointSets.h"
#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <queue>
#include <set>

namespace coronary
{
namespace
{
/// A stretch alongside another vessel is the same vessel when it is longer than this many radii;
/// a daughter leaves its parent's neighbourhood sooner.
constexpr double OverlapLength = 5.0;

GraphCell CellOf(const Vector3& p, double size)
{
  // What is farther away than that shares a cell.
  static constexpr double Last = 4e18;
  const auto index = [size](double x)
  { return static_cast<std::int64_t>(std::clamp(std::floor(x / size), -Last, Last)); };
  return { index(p[0]), index(p[1]), index(p[2]) };
}

/// Puts lines into the graph one after the other, each only where no line before it runs.
class LineInserter
{
public:
  LineInserter(LineGraph& graph, double mergeRatio, double coincidence)
    : G(graph)
    , MergeRatio(mergeRatio)
    , Coincidence(coincidence)
  {
  }

  int MergedPoints = 0;

  void Insert(const Polylines& set, const std::vector<std::int64_t>& line)
  {
    // Vertices of the line; points that coincide with one of the graph are that one.
    std::vector<int> chain;
    std::vector<char> old;
    const int before = static_cast<int>(this->G.points.size());
    for (const std::int64_t point : line)
    {
      const int vertex = this->VertexAt(set.points[point], set.radius[point], point);
      if (chain.empty() || chain.back() != vertex)
      {
        chain.push_back(vertex);
        old.push_back(vertex < before);
        this->MergedPoints += vertex < before;
      }
    }
    if (chain.size() < 2)
    {
      return;
    }
    this->G.starts[chain.front()] += 1;
    for (std::size_t i = 1; i < chain.size(); ++i)
    {
      this->G.others[chain[i]] += 1;
    }
    const auto n = static_cast<int>(chain.size());
    std::vector<double> arc(n, 0.0);
    for (int i = 1; i < n; ++i)
    {
      arc[i] = arc[i - 1] + (this->G.points[chain[i]] - this->G.points[chain[i - 1]]).norm();
    }

    std::vector<NearestEdge> near(n);
    std::vector<char> covered(old.begin(), old.end());
    if (this->MergeRatio > 0.0 && before > 0)
    {
      this->FindCovered(chain, old, arc, near, covered);
    }

    // The stretches in between become part of the graph, tied to what covers their neighbours.
    const auto attachment = [&](int i) { return old[i] ? chain[i] : near[i].Vertex(); };
    for (int i = 0; i < n; ++i)
    {
      if (i + 1 < n && covered[i] && covered[i + 1] && old[i] && old[i + 1] &&
        !this->Connected(
          chain[i], chain[i + 1], 1.5 * (arc[i + 1] - arc[i]) + this->G.radius[chain[i]]))
      {
        this->G.Link(chain[i], chain[i + 1]);
      }
      if (covered[i])
      {
        // Lines to come that start at a point that was left out start where it would be.
        if (!old[i])
        {
          this->Replaced[chain[i]] = near[i].Vertex();
          this->G.others[near[i].Vertex()] += i > 0;
          this->G.starts[near[i].Vertex()] += i == 0;
          ++this->MergedPoints;
        }
        continue;
      }
      if (i > 0)
      {
        this->G.Link(covered[i - 1] ? attachment(i - 1) : chain[i - 1], chain[i]);
      }
      if (i + 1 < n && covered[i + 1])
      {
        this->G.Link(chain[i], attachment(i + 1));
      }
    }
  }

private:
  int Resolve(int vertex) const
  {
    for (auto found = this->Replaced.find(vertex); found != this->Replaced.end();
         found = this->Replaced.find(vertex))
    {
      vertex = found->second;
    }
    return vertex;
  }

  int VertexAt(const Vector3& p, double r, std::int64_t from)
  {
    const double size = 4.0 * this->Coincidence;
    const GraphCell home = CellOf(p, size);
    for (std::int64_t i = -1; i <= 1; ++i)
    {
      for (std::int64_t j = -1; j <= 1; ++j)
      {
        for (std::int64_t k = -1; k <= 1; ++k)
        {
          const auto found = this->Vertices.find({ home[0] + i, home[1] + j, home[2] + k });
          if (found != this->Vertices.end())
          {
            for (const int vertex : found->second)
            {
              if ((this->G.points[vertex] - p).norm() <= this->Coincidence)
              {
                return this->Resolve(vertex);
              }
            }
          }
        }
      }
    }
    const int vertex = this->G.AddVertex(p, r, from);
    this->Vertices[home].push_back(vertex);
    return vertex;
  }

  /// Whether the graph has a way between two vertices that is not longer than `reach`.
  bool Connected(int a, int b, double reach) const
  {
    std::map<int, double> way;
    using Item = std::pair<double, int>;
    std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
    way[a] = 0.0;
    queue.emplace(0.0, a);
    while (!queue.empty())
    {
      const auto [at, v] = queue.top();
      queue.pop();
      if (v == b)
      {
        return true;
      }
      for (const int next : this->G.neighbours[v])
      {
        const double there = at + (this->G.points[next] - this->G.points[v]).norm();
        const auto known = way.find(next);
        if (there <= reach && (known == way.end() || there < known->second))
        {
          way[next] = there;
          queue.emplace(there, next);
        }
      }
    }
    return false;
  }

  void FindCovered(const std::vector<int>& chain, const std::vector<char>& old,
    const std::vector<double>& arc, std::vector<NearestEdge>& near,
    std::vector<char>& covered) const
  {
    const auto n = static_cast<int>(chain.size());
    std::vector<char> inside(old.begin(), old.end());
    for (int i = 0; i < n; ++i)
    {
      if (old[i])
      {
        continue;
      }
      // The line's direction over a few radii, not over a single noisy step.
      const double r = this->G.radius[chain[i]];
      int low = i;
      int high = i;
      while (low > 0 && arc[i] - arc[low] < r)
      {
        --low;
      }
      while (high + 1 < n && arc[high] - arc[i] < r)
      {
        ++high;
      }
      const Vector3 along = (this->G.points[chain[high]] - this->G.points[chain[low]]).normalized();
      const auto parallel = [&](int a, int b)
      {
        const Vector3 way = this->G.points[b] - this->G.points[a];
        // Steps shorter than the noise say nothing about the direction.
        return way.norm() < r || std::abs(along.dot(way)) > 0.6 * way.norm();
      };
      near[i] = this->G.FindNearest(this->G.points[chain[i]], 2.0 * this->MergeRatio * r, parallel);
      inside[i] = near[i].distance <= this->MergeRatio * r;
    }
    // In at one merge distance, out at two, so that noise does not leave slivers.
    covered.assign(n, 0);
    int lastInside = -1;
    for (int i = 0; i < n; ++i)
    {
      if (inside[i])
      {
        if (lastInside >= 0)
        {
          std::fill(covered.begin() + lastInside, covered.begin() + i, 1);
        }
        covered[i] = 1;
        lastInside = i;
      }
      else if (!near[i].Found())
      {
        lastInside = -1;
      }
    }
    // A short stretch that leaves an old vertex is a daughter parting from its parent.
    for (int first = 0; first < n;)
    {
      int last = first;
      if (!covered[first] || old[first])
      {
        ++first;
        continue;
      }
      while (last + 1 < n && covered[last + 1] && !old[last + 1])
      {
        ++last;
      }
      // A stretch between two old vertices is there already if the graph has a way of that length.
      const bool between = first > 0 && old[first - 1] && last + 1 < n && old[last + 1] &&
        this->Connected(chain[first - 1], chain[last + 1],
          1.5 * (arc[last + 1] - arc[first - 1]) + this->G.radius[chain[first - 1]]);
      const bool free = first == 0 || last + 1 == n;
      const double r = this->G.radius[chain[(first + last) / 2]];
      const bool bridge = first > 0 && old[first - 1] && last + 1 < n && old[last + 1] && !between;
      // An end that is farther from what is there than it runs along with it does not overlap: the
      // next bifurcation of the same vessel may be that near. What is a gap is closed later.
      const bool touch = free && !(first == 0 && last + 1 == n) &&
        arc[last] - arc[first] < near[first == 0 ? first : last].distance;
      if (bridge || touch || (!between && !free && arc[last] - arc[first] < OverlapLength * r))
      {
        std::fill(covered.begin() + first, covered.begin() + last + 1, 0);
      }
      first = last + 1;
    }
  }

  LineGraph& G;
  double MergeRatio;
  double Coincidence;
  std::unordered_map<GraphCell, std::vector<int>, GraphCellHash> Vertices;
  std::unordered_map<int, int> Replaced;
};

/// Number of the connected piece of every vertex.
std::vector<int> Pieces(const LineGraph& graph, int& count)
{
  std::vector<int> piece(graph.points.size(), -1);
  count = 0;
  std::vector<int> stack;
  for (std::size_t v = 0; v < piece.size(); ++v)
  {
    if (piece[v] >= 0 || graph.neighbours[v].empty())
    {
      continue;
    }
    stack.push_back(static_cast<int>(v));
    piece[v] = count;
    while (!stack.empty())
    {
      const int at = stack.back();
      stack.pop_back();
      for (const int next : graph.neighbours[at])
      {
        if (piece[next] < 0)
        {
          piece[next] = count;
          stack.push_back(next);
        }
      }
    }
    ++count;
  }
  return piece;
}

std::vector<std::vector<int>> VerticesOf(const std::vector<int>& piece, int count)
{
  std::vector<std::vector<int>> vertices(count);
  for (std::size_t v = 0; v < piece.size(); ++v)
  {
    if (piece[v] >= 0)
    {
      vertices[piece[v]].push_back(static_cast<int>(v));
    }
  }
  return vertices;
}

/// Mean radius over the first few radii of length from a free end.
double EndRadius(const LineGraph& graph, int end)
{
  double sum = 0.0;
  double weight = 0.0;
  double way = 0.0;
  int last = -1;
  int at = end;
  const double reach = 5.0 * graph.radius[end];
  for (;;)
  {
    sum += graph.radius[at];
    weight += 1.0;
    int next = -1;
    for (const int candidate : graph.neighbours[at])
    {
      if (candidate != last)
      {
        next = candidate;
      }
    }
    if (next < 0 || graph.neighbours[at].size() > 2 || way > reach)
    {
      return sum / weight;
    }
    way += (graph.points[next] - graph.points[at]).norm();
    last = at;
    at = next;
  }
}

/// The end that a piece starts from, by the direction of its lines or by calibre.
int FindRoot(const LineGraph& graph, const std::vector<int>& vertices)
{
  std::vector<int> freeEnds;
  for (const int v : vertices)
  {
    if (graph.neighbours[v].size() == 1)
    {
      freeEnds.push_back(v);
    }
  }
  if (freeEnds.empty())
  {
    // A closed ring: wherever it is widest.
    return *std::max_element(vertices.begin(), vertices.end(),
      [&](int a, int b) { return graph.radius[a] < graph.radius[b]; });
  }
  // Where lines start and none ends or passes; a twig may leave right there.
  int starters = 0;
  int starter = -1;
  for (const int v : vertices)
  {
    if (graph.starts[v] > 0 && graph.others[v] == 0)
    {
      ++starters;
      starter = v;
    }
  }
  const auto widest = *std::max_element(freeEnds.begin(), freeEnds.end(),
    [&](int a, int b)
    {
      const double ra = EndRadius(graph, a);
      const double rb = EndRadius(graph, b);
      return ra != rb ? ra < rb : a > b;
    });
  if (starters == 1)
  {
    // One line alone has a direction by chance; a clear taper says more.
    const bool alone = freeEnds.size() == 2;
    const bool tapers = EndRadius(graph, widest) > 1.25 * EndRadius(graph, starter);
    return alone && tapers ? widest : starter;
  }
  return widest;
}
}

int LineGraph::AddVertex(const Vector3& p, double r, std::int64_t from)
{
  this->points.push_back(p);
  this->radius.push_back(r);
  this->source.push_back(from);
  this->neighbours.emplace_back();
  this->starts.push_back(0);
  this->others.push_back(0);
  return static_cast<int>(this->points.size()) - 1;
}

bool LineGraph::Linked(int a, int b) const
{
  return std::find(this->neighbours[a].begin(), this->neighbours[a].end(), b) !=
    this->neighbours[a].end();
}

void LineGraph::Link(int a, int b)
{
  if (a == b || this->Linked(a, b))
  {
    return;
  }
  this->neighbours[a].push_back(b);
  this->neighbours[b].push_back(a);
  // Into every cell that the edge may touch, up to the neighbours of the cells on its way.
  const Vector3 way = this->points[b] - this->points[a];
  const int steps = 1 + static_cast<int>(2.0 * way.norm() / this->cellSize);
  GraphCell last{};
  for (int i = 0; i <= steps; ++i)
  {
    const GraphCell cell = CellOf(this->points[a] + way * i / steps, this->cellSize);
    if (i == 0 || cell != last)
    {
      this->edges[cell].emplace_back(a, b);
    }
    last = cell;
  }
}

void LineGraph::Unlink(int a, int b)
{
  const auto remove = [](std::vector<int>& list, int value)
  { list.erase(std::find(list.begin(), list.end(), value)); };
  remove(this->neighbours[a], b);
  remove(this->neighbours[b], a);
}

NearestEdge LineGraph::FindNearest(
  const Vector3& p, double reach, const std::function<bool(int, int)>& accept) const
{
  NearestEdge nearest;
  const double margin = reach + 0.5 * this->cellSize;
  const GraphCell low = CellOf(p - Vector3::Constant(margin), this->cellSize);
  const GraphCell high = CellOf(p + Vector3::Constant(margin), this->cellSize);
  const auto look = [&](const std::vector<std::pair<int, int>>& cell)
  {
    for (const auto& [a, b] : cell)
    {
      const Vector3 way = this->points[b] - this->points[a];
      const double t =
        std::clamp((p - this->points[a]).dot(way) / std::max(1e-300, way.squaredNorm()), 0.0, 1.0);
      const double distance = (this->points[a] + t * way - p).norm();
      if (distance <= reach && distance < nearest.distance && accept(a, b))
      {
        nearest = { distance, a, b, t };
      }
    }
  };
  double count = 1.0;
  for (int axis = 0; axis < 3; ++axis)
  {
    count *= static_cast<double>(high[axis] - low[axis]) + 1.0;
  }
  if (count > static_cast<double>(this->edges.size()))
  {
    // More cells than have edges. Sorted, as the first of two edges at one distance wins.
    std::vector<std::pair<GraphCell, const std::vector<std::pair<int, int>>*>> within;
    for (const auto& [cell, list] : this->edges)
    {
      if (std::equal(low.begin(), low.end(), cell.begin(), std::less_equal<>()) &&
        std::equal(cell.begin(), cell.end(), high.begin(), std::less_equal<>()))
      {
        within.emplace_back(cell, &list);
      }
    }
    std::sort(within.begin(), within.end());
    for (const auto& found : within)
    {
      look(*found.second);
    }
    return nearest;
  }
  for (std::int64_t i = low[0]; i <= high[0]; ++i)
  {
    for (std::int64_t j = low[1]; j <= high[1]; ++j)
    {
      for (std::int64_t k = low[2]; k <= high[2]; ++k)
      {
        const auto found = this->edges.find({ i, j, k });
        if (found != this->edges.end())
        {
          look(found->second);
        }
      }
    }
  }
  return nearest;
}

int InsertLines(LineGraph& graph, const Polylines& lines, double mergeRatio, double radius,
  const ProgressCallback& progress)
{
  // The longest first: the others are measured against them.
  std::vector<double> lengths;
  for (const auto& line : lines.lines)
  {
    double length = 0.0;
    for (std::size_t i = 1; i < line.size(); ++i)
    {
      length += (lines.points[line[i]] - lines.points[line[i - 1]]).norm();
    }
    lengths.push_back(length);
  }
  std::vector<std::size_t> order(lines.lines.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
    [&](std::size_t a, std::size_t b) { return lengths[a] > lengths[b]; });
  LineInserter inserter(graph, mergeRatio, 1e-3 * radius);
  for (std::size_t i = 0; i < order.size(); ++i)
  {
    Report(progress, 0.4 * static_cast<double>(i) / static_cast<double>(order.size()));
    inserter.Insert(lines, lines.lines[order[i]]);
  }
  return inserter.MergedPoints;
}

int CloseGaps(LineGraph& graph, double gapRatio)
{
  int closed = 0;
  if (gapRatio <= 0.0)
  {
    return 0;
  }
  // Joining changes which pieces there are, so a few rounds.
  for (int round = 0; round < 8; ++round)
  {
    int count = 0;
    const std::vector<int> piece = Pieces(graph, count);
    if (count < 2)
    {
      return closed;
    }
    const std::vector<std::vector<int>> vertices = VerticesOf(piece, count);
    struct Join
    {
      double gap;
      int end;
      int target;
    };
    std::vector<Join> joins;
    for (int c = 0; c < count; ++c)
    {
      const int root = FindRoot(graph, vertices[c]);
      for (const int end : vertices[c])
      {
        if (graph.neighbours[end].size() != 1)
        {
          continue;
        }
        // Two tips that pass each other stay apart: a piece hangs by its root, or by any end when
        // its calibre does not tell which end that is.
        if (end != root && EndRadius(graph, root) > 1.3 * EndRadius(graph, end))
        {
          continue;
        }
        double widest = graph.radius[end];
        NearestEdge nearest;
        // The other piece may be the wider one: look as far as its radius allows.
        for (int tries = 0; tries < 2; ++tries)
        {
          nearest = graph.FindNearest(
            graph.points[end], gapRatio * widest, [&](int a, int) { return piece[a] != c; });
          const NearestEdge wide = tries > 0
            ? nearest
            : graph.FindNearest(graph.points[end], 4.0 * gapRatio * widest,
                [&](int a, int) { return piece[a] != c; });
          if (!wide.Found())
          {
            break;
          }
          widest = std::max(graph.radius[end], graph.radius[wide.Vertex()]);
        }
        if (!nearest.Found())
        {
          continue;
        }
        const int target = nearest.Vertex();
        const Vector3 outward = graph.points[end] - graph.points[graph.neighbours[end][0]];
        const Vector3 gap = graph.points[target] - graph.points[end];
        if (nearest.distance > widest && outward.dot(gap) < -0.2 * outward.norm() * gap.norm())
        {
          continue;
        }
        joins.push_back({ nearest.distance / widest, end, target });
      }
    }
    if (joins.empty())
    {
      return closed;
    }
    std::sort(joins.begin(), joins.end(),
      [](const Join& a, const Join& b)
      {
        return a.gap != b.gap ? a.gap < b.gap
                              : std::make_pair(a.end, a.target) < std::make_pair(b.end, b.target);
      });
    DisjointSets together(static_cast<std::size_t>(count));
    for (const Join& join : joins)
    {
      if (together.Join(piece[join.end], piece[join.target]))
      {
        graph.Link(join.end, join.target);
        // Neither is where the whole starts, unless it is the only such place.
        ++graph.others[join.end];
        ++closed;
      }
    }
  }
  return closed;
}

std::vector<int> FindRoots(const LineGraph& graph, const std::vector<Vector3>& given)
{
  int count = 0;
  const std::vector<int> piece = Pieces(graph, count);
  const std::vector<std::vector<int>> vertices = VerticesOf(piece, count);
  std::vector<int> roots(count, -1);
  std::vector<double> rootDistance(count, Infinity);
  for (const Vector3& root : given)
  {
    int nearest = -1;
    double distance = Infinity;
    for (std::size_t v = 0; v < piece.size(); ++v)
    {
      if (graph.neighbours[v].size() == 1 && (graph.points[v] - root).norm() < distance)
      {
        nearest = static_cast<int>(v);
        distance = (graph.points[v] - root).norm();
      }
    }
    if (nearest >= 0 && distance < rootDistance[piece[nearest]])
    {
      roots[piece[nearest]] = nearest;
      rootDistance[piece[nearest]] = distance;
    }
  }
  for (int c = 0; c < count; ++c)
  {
    roots[c] = roots[c] >= 0 ? roots[c] : FindRoot(graph, vertices[c]);
  }
  return roots;
}

void CutLoops(LineGraph& graph, int root, std::vector<std::vector<int>>& loops)
{
  std::vector<int> previous(graph.points.size(), -1);
  std::vector<double> cost(graph.points.size(), Infinity);
  std::vector<int> order;
  using Item = std::pair<double, int>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  cost[root] = 0.0;
  previous[root] = -1;
  queue.emplace(0.0, root);
  while (!queue.empty())
  {
    const auto [at, v] = queue.top();
    queue.pop();
    if (at > cost[v])
    {
      continue;
    }
    order.push_back(v);
    for (const int next : graph.neighbours[v])
    {
      const double r = 0.5 * (graph.radius[v] + graph.radius[next]);
      // Where this overflows, the vertex is still reached.
      const double there = std::min(std::numeric_limits<double>::max(),
        at + (graph.points[next] - graph.points[v]).norm() / (r * r));
      if (there < cost[next])
      {
        cost[next] = there;
        previous[next] = v;
        queue.emplace(there, next);
      }
    }
  }
  for (const int v : order)
  {
    const std::vector<int> neighbours = graph.neighbours[v];
    for (const int next : neighbours)
    {
      if (v < next && previous[next] != v && previous[v] != next)
      {
        // Up from both sides of the cut to where the ways meet.
        std::vector<int> left{ v };
        std::vector<int> right{ next };
        std::set<int> seen;
        for (int at = v; at >= 0; at = previous[at])
        {
          seen.insert(at);
        }
        while (seen.count(right.back()) == 0)
        {
          right.push_back(previous[right.back()]);
        }
        while (left.back() != right.back())
        {
          left.push_back(previous[left.back()]);
        }
        left.insert(left.end(), right.rbegin() + 1, right.rend());
        loops.push_back(left);
        graph.Unlink(v, next);
      }
    }
  }
}
}
