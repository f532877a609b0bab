#include "CenterlineTopology.h"

#include "Median.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <set>
#include <stdexcept>
#include <unordered_map>

namespace coronary
{
namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr double Infinity = std::numeric_limits<double>::infinity();
constexpr double LongestLine = 1e6; ///< in median radii: edges lie in cells of two radii

/// A stretch alongside another vessel is the same vessel when it is longer than this many radii;
/// a daughter leaves its parent's neighbourhood sooner.
constexpr double OverlapLength = 5.0;

using Cell = std::array<std::int64_t, 3>;
struct CellHash
{
  std::size_t operator()(const Cell& cell) const
  {
    std::uint64_t h = 0x9e3779b97f4a7c15ULL;
    for (const std::int64_t c : cell)
    {
      h = (h ^ static_cast<std::uint64_t>(c)) * 0xff51afd7ed558ccdULL;
      h ^= h >> 32;
    }
    return h;
  }
};

Cell CellOf(const Vector3& p, double size)
{
  // What is farther away than that shares a cell.
  static constexpr double Last = 4e18;
  const auto index = [size](double x)
  { return static_cast<std::int64_t>(std::clamp(std::floor(x / size), -Last, Last)); };
  return { index(p[0]), index(p[1]), index(p[2]) };
}

struct Nearest
{
  double distance = Infinity;
  int from = -1; ///< vertices of the edge
  int to = -1;
  double fraction = 0.0; ///< from `from` to `to`
  bool Found() const { return this->from >= 0; }
  int Vertex() const { return this->fraction <= 0.5 ? this->from : this->to; }
};

/// The lines as one graph.
struct Graph
{
  std::vector<Vector3> points;
  std::vector<double> radius;
  std::vector<std::int64_t> source;
  std::vector<std::vector<int>> neighbours;
  std::vector<int> starts; ///< number of input lines that start at a vertex
  std::vector<int> others; ///< number of input lines that end there, pass or hang on it

  double cellSize = 1.0;
  std::unordered_map<Cell, std::vector<std::pair<int, int>>, CellHash> edges;

  int AddVertex(const Vector3& p, double r, std::int64_t from)
  {
    this->points.push_back(p);
    this->radius.push_back(r);
    this->source.push_back(from);
    this->neighbours.emplace_back();
    this->starts.push_back(0);
    this->others.push_back(0);
    return static_cast<int>(this->points.size()) - 1;
  }

  bool Linked(int a, int b) const
  {
    return std::find(this->neighbours[a].begin(), this->neighbours[a].end(), b) !=
      this->neighbours[a].end();
  }

  void Link(int a, int b)
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
    Cell last{};
    for (int i = 0; i <= steps; ++i)
    {
      const Cell cell = CellOf(this->points[a] + way * i / steps, this->cellSize);
      if (i == 0 || cell != last)
      {
        this->edges[cell].emplace_back(a, b);
      }
      last = cell;
    }
  }

  void Unlink(int a, int b)
  {
    const auto remove = [](std::vector<int>& list, int value)
    { list.erase(std::find(list.begin(), list.end(), value)); };
    remove(this->neighbours[a], b);
    remove(this->neighbours[b], a);
  }

  /// The nearest edge within `reach` that `accept` takes.
  Nearest FindNearest(
    const Vector3& p, double reach, const std::function<bool(int, int)>& accept) const
  {
    Nearest nearest;
    const double margin = reach + 0.5 * this->cellSize;
    const Cell low = CellOf(p - Vector3::Constant(margin), this->cellSize);
    const Cell high = CellOf(p + Vector3::Constant(margin), this->cellSize);
    const auto look = [&](const std::vector<std::pair<int, int>>& cell)
    {
      for (const auto& [a, b] : cell)
      {
        const Vector3 way = this->points[b] - this->points[a];
        const double t = std::clamp(
          (p - this->points[a]).dot(way) / std::max(1e-300, way.squaredNorm()), 0.0, 1.0);
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
      std::vector<std::pair<Cell, const std::vector<std::pair<int, int>>*>> within;
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
};

void Check(const CenterlineSet& lines)
{
  if (lines.radius.size() != lines.points.size())
  {
    throw std::invalid_argument(
      "There must be one radius a point: " + std::to_string(lines.points.size()) + " points, " +
      std::to_string(lines.radius.size()) + " radii");
  }
  for (std::size_t i = 0; i < lines.points.size(); ++i)
  {
    if (!lines.points[i].allFinite())
    {
      throw std::invalid_argument("Point " + std::to_string(i) + " is not finite");
    }
    if (!std::isfinite(lines.points[i].squaredNorm()))
    {
      throw std::invalid_argument(
        "Point " + std::to_string(i) + " is too far away to measure lengths");
    }
  }
  for (std::size_t l = 0; l < lines.lines.size(); ++l)
  {
    for (const std::int64_t point : lines.lines[l])
    {
      if (point < 0 || point >= static_cast<std::int64_t>(lines.points.size()))
      {
        throw std::invalid_argument("Line " + std::to_string(l) + " refers to point " +
          std::to_string(point) + ", which does not exist");
      }
      if (!(std::isfinite(lines.radius[point]) && lines.radius[point] > 0.0))
      {
        throw std::invalid_argument(
          "The radius of point " + std::to_string(point) + " is not a positive number");
      }
    }
  }
  for (const Vector3& root : lines.roots)
  {
    if (!root.allFinite())
    {
      throw std::invalid_argument("A root's position is not finite");
    }
  }
}

/// Puts lines into the graph one after the other, each only where no line before it runs.
class LineInserter
{
public:
  LineInserter(Graph& graph, double mergeRatio, double coincidence)
    : G(graph)
    , MergeRatio(mergeRatio)
    , Coincidence(coincidence)
  {
  }

  int MergedPoints = 0;

  void Insert(const CenterlineSet& set, const std::vector<std::int64_t>& line)
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

    std::vector<Nearest> near(n);
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
    const Cell home = CellOf(p, size);
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
    const std::vector<double>& arc, std::vector<Nearest>& near, std::vector<char>& covered) const
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

  Graph& G;
  double MergeRatio;
  double Coincidence;
  std::unordered_map<Cell, std::vector<int>, CellHash> Vertices;
  std::unordered_map<int, int> Replaced;
};

/// Number of the connected piece of every vertex.
std::vector<int> Pieces(const Graph& graph, int& count)
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

/// Mean radius over the first few radii of length from a free end.
double EndRadius(const Graph& graph, int end)
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
int FindRoot(const Graph& graph, const std::vector<int>& vertices)
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

/// Ties pieces together whose ends nearly meet.
int CloseGaps(Graph& graph, double gapRatio)
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
    std::vector<std::vector<int>> vertices(count);
    for (std::size_t v = 0; v < piece.size(); ++v)
    {
      if (piece[v] >= 0)
      {
        vertices[piece[v]].push_back(static_cast<int>(v));
      }
    }
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
        Nearest nearest;
        // The other piece may be the wider one: look as far as its radius allows.
        for (int tries = 0; tries < 2; ++tries)
        {
          nearest = graph.FindNearest(
            graph.points[end], gapRatio * widest, [&](int a, int) { return piece[a] != c; });
          const Nearest wide = tries > 0
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
    std::vector<int> together(count);
    std::iota(together.begin(), together.end(), 0);
    const std::function<int(int)> find = [&](int c)
    { return together[c] == c ? c : together[c] = find(together[c]); };
    for (const Join& join : joins)
    {
      const int a = find(piece[join.end]);
      const int b = find(piece[join.target]);
      if (a != b)
      {
        together[a] = b;
        graph.Link(join.end, join.target);
        // Neither is where the whole starts, unless it is the only such place.
        ++graph.others[join.end];
        ++closed;
      }
    }
  }
  return closed;
}

/// Walks from the root by the way of least resistance, and cuts every closed way where the two
/// sides meet. Returns each vertex' predecessor.
void CutLoops(
  Graph& graph, int root, std::vector<int>& previous, std::vector<std::vector<int>>& loops)
{
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

/// A branch while the tree is being made: graph vertices and links by index.
struct Draft
{
  std::vector<int> vertices;
  int parent = -1;
  std::vector<int> daughters;
  int tree = 0;
  bool alive = true;
};

double DraftLength(const Graph& graph, const Draft& branch)
{
  double length = 0.0;
  for (std::size_t i = 1; i < branch.vertices.size(); ++i)
  {
    length += (graph.points[branch.vertices[i]] - graph.points[branch.vertices[i - 1]]).norm();
  }
  return length;
}

void DraftTree(const Graph& graph, int root, int tree, std::vector<Draft>& drafts)
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
    Draft& branch = drafts.back();
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

/// Removes the shortest twig, joins what it parted, and so on until none is too short.
void Prune(const Graph& graph, double ratio, std::vector<Draft>& drafts, int& count, double& length)
{
  // Shortest first, in radii of the vessel that it leaves; entries go stale when branches join.
  using Item = std::pair<double, int>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  std::map<int, int> rootBranches;
  for (const Draft& draft : drafts)
  {
    rootBranches[draft.tree] += draft.parent < 0;
  }
  const auto consider = [&](int b)
  {
    const Draft& branch = drafts[b];
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
    Draft& twig = drafts[b];
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
    Draft& parent = drafts[twig.parent];
    parent.daughters.erase(std::find(parent.daughters.begin(), parent.daughters.end(), b));
    if (parent.daughters.size() == 1)
    {
      Draft& rest = drafts[parent.daughters[0]];
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

/// Direction of a branch over a stretch from one of its ends, by a fitted line; away from the end.
Vector3 EndDirection(const CenterlineTopology& tree, const CenterlineTree::Branch& branch,
  bool fromStart, double low, double high)
{
  Vector3 meanPoint = Vector3::Zero();
  double meanArc = 0.0;
  std::vector<std::pair<double, Vector3>> used;
  double arc = 0.0;
  const auto n = static_cast<int>(branch.points.size());
  Vector3 last = Vector3::Zero();
  const double reach = std::min(high, branch.length);
  for (int i = 0; i < n; ++i)
  {
    const Vector3& p = tree.points[branch.points[fromStart ? i : n - 1 - i]];
    arc += i > 0 ? (p - last).norm() : 0.0;
    last = p;
    if ((arc >= std::min(low, 0.5 * branch.length) && arc <= reach) || (i > 0 && used.size() < 2))
    {
      used.emplace_back(arc, p);
    }
    if (arc > reach && used.size() >= 2)
    {
      break;
    }
  }
  if (used.size() < 2)
  {
    used.insert(
      used.begin(), { 0.0, tree.points[fromStart ? branch.points.front() : branch.points.back()] });
  }
  for (const auto& [s, p] : used)
  {
    meanArc += s / static_cast<double>(used.size());
    meanPoint += p / static_cast<double>(used.size());
  }
  Vector3 slope = Vector3::Zero();
  for (const auto& [s, p] : used)
  {
    slope += (s - meanArc) * (p - meanPoint);
  }
  return slope.norm() > 0.0 ? Vector3(slope.normalized()) : Vector3(Vector3::UnitX());
}

/// Median radius of a branch between two distances from one of its ends.
double EndCalibre(const CenterlineTopology& tree, const CenterlineTree::Branch& branch,
  bool fromStart, double low, double high)
{
  std::vector<double> values;
  double arc = 0.0;
  const auto n = static_cast<int>(branch.points.size());
  const double first = std::min(low, 0.5 * branch.length);
  for (int i = 0; i < n; ++i)
  {
    const auto point = branch.points[fromStart ? i : n - 1 - i];
    if (i > 0)
    {
      arc += (tree.points[point] - tree.points[branch.points[fromStart ? i - 1 : n - i]]).norm();
    }
    // The shared point belongs to the parent.
    if (arc >= first && arc <= high && !(fromStart && i == 0))
    {
      values.push_back(tree.radius[point]);
    }
  }
  if (values.empty())
  {
    return tree.radius[branch.points[fromStart ? std::min(1, n - 1) : n - 1]];
  }
  return MedianOf(values);
}

double AngleBetween(const Vector3& a, const Vector3& b)
{
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// The daughter that carries the vessel on: little turn, much calibre.
int ChooseContinuation(const CenterlineTopology& tree, const CenterlineTree::Branch& parent,
  const std::vector<int>& daughters)
{
  const double r = EndCalibre(tree, parent, false, 0.0, 3.0 * tree.radius[parent.points.back()]);
  const Vector3 course = -EndDirection(tree, parent, false, 0.0, 4.0 * r);
  int best = -1;
  double least = Infinity;
  for (const int d : daughters)
  {
    const CenterlineTree::Branch& daughter = tree.branches[d];
    const double turn = AngleBetween(course, EndDirection(tree, daughter, true, 0.5 * r, 4.0 * r));
    const double calibre = EndCalibre(tree, daughter, true, r, 4.0 * r);
    // Thirty degrees of turn weigh as much as a calibre of two thirds.
    const double cost = turn / (Pi / 6.0) - std::log(calibre / r) / std::log(1.5);
    if (cost < least)
    {
      least = cost;
      best = d;
    }
  }
  return best;
}

int AssignStrahler(CenterlineTopology& tree, const std::vector<std::vector<int>>& daughters)
{
  int highest = 0;
  for (std::size_t b = tree.branches.size(); b-- > 0;)
  {
    int order = 1;
    int same = 0;
    for (const int d : daughters[b])
    {
      const int below = tree.branches[d].strahlerOrder;
      same = below == order ? same + 1 : (below > order ? 1 : same);
      order = std::max(order, below);
    }
    tree.branches[b].strahlerOrder = order + (same > 1 ? 1 : 0);
    highest = std::max(highest, tree.branches[b].strahlerOrder);
  }
  return highest;
}

void ComputeGeometry(
  CenterlineTopology& tree, const CurveSmoothing& smoothing, const ProgressCallback& progress)
{
  const std::size_t n = tree.points.size();
  tree.tangent.assign(n, Vector3::UnitX());
  tree.normal.assign(n, Vector3::UnitY());
  tree.binormal.assign(n, Vector3::UnitZ());
  tree.curvature.assign(n, 0.0);
  tree.torsion.assign(n, 0.0);
  tree.area.resize(n);
  for (std::size_t i = 0; i < n; ++i)
  {
    tree.area[i] = Pi * tree.radius[i] * tree.radius[i];
  }
  // Whole vessels, so that a bifurcation on the way does not disturb their geometry.
  std::vector<int> heads;
  for (const CenterlineTree::Branch& branch : tree.branches)
  {
    if (branch.parentGroupId < 0 || tree.continuation[branch.parentGroupId] != branch.groupId)
    {
      heads.push_back(branch.groupId);
    }
  }
  struct Course
  {
    std::vector<std::int64_t> points;
    CurveGeometry curve;
  };
  std::vector<Course> courses(heads.size());
  ParallelFor(
    static_cast<std::int64_t>(heads.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t h = first; h < last; ++h)
      {
        std::vector<std::int64_t>& way = courses[h].points;
        for (int b = heads[h]; b >= 0; b = tree.continuation[b])
        {
          const auto& points = tree.branches[b].points;
          way.insert(way.end(), points.begin() + (way.empty() ? 0 : 1), points.end());
        }
        std::vector<Vector3> positions;
        std::vector<double> radii;
        for (const std::int64_t point : way)
        {
          positions.push_back(tree.points[point]);
          radii.push_back(tree.radius[point]);
        }
        CurveSmoothing used = smoothing;
        // Bends shorter than two diameters are the detector's, not the vessel's.
        used.leastWavelength = std::max(used.leastWavelength, 4.0 * MedianOf(radii));
        courses[h].curve = ComputeCurveGeometry(positions, used);
      }
    },
    progress);
  // One after another: two vessels that begin at one root share its point.
  for (std::size_t h = 0; h < heads.size(); ++h)
  {
    const auto& [way, curve] = courses[h];
    // A daughter's first point is its parent's.
    const bool root = tree.branches[heads[h]].parentGroupId < 0;
    for (std::size_t i = root ? 0 : 1; i < way.size(); ++i)
    {
      tree.tangent[way[i]] = curve.tangent[i];
      tree.normal[way[i]] = curve.normal[i];
      tree.binormal[way[i]] = curve.binormal[i];
      tree.curvature[way[i]] = curve.curvature[i];
      tree.torsion[way[i]] = curve.torsion[i];
    }
  }
}

double MurrayResidual(double parent, const std::vector<double>& daughters, double exponent)
{
  double sum = 0.0;
  for (const double daughter : daughters)
  {
    sum += std::pow(daughter / parent, exponent);
  }
  return 1.0 - sum;
}

/// The exponent that leaves the least error over all bifurcations, in logarithms of calibre.
double FitExponent(const std::vector<Bifurcation>& bifurcations)
{
  std::vector<const Bifurcation*> used;
  for (const Bifurcation& bifurcation : bifurcations)
  {
    if (std::isfinite(bifurcation.fittedExponent))
    {
      used.push_back(&bifurcation);
    }
  }
  if (used.empty())
  {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto error = [&](double x)
  {
    double sum = 0.0;
    for (const Bifurcation* bifurcation : used)
    {
      const double off =
        std::log(1.0 - MurrayResidual(bifurcation->parentRadius, bifurcation->daughterRadius, x)) /
        x;
      sum += off * off;
    }
    return sum;
  };
  double best = 0.5;
  for (int i = 50; i <= 1000; ++i)
  {
    const double x = 0.01 * i;
    best = error(x) < error(best) ? x : best;
  }
  double low = std::max(0.1, best - 0.01);
  double high = best + 0.01;
  for (int i = 0; i < 60; ++i)
  {
    const double a = low + (high - low) / 3.0;
    const double b = high - (high - low) / 3.0;
    (error(a) < error(b) ? high : low) = error(a) < error(b) ? b : a;
  }
  return 0.5 * (low + high);
}

void DescribeBifurcations(
  CenterlineTopology& tree, const std::vector<std::vector<int>>& daughters, double exponent)
{
  for (const CenterlineTree::Branch& parent : tree.branches)
  {
    std::vector<int> leaving = daughters[parent.groupId];
    if (leaving.size() < 2)
    {
      continue;
    }
    Bifurcation bifurcation;
    bifurcation.point = parent.points.back();
    bifurcation.parent = parent.groupId;
    const double scale = tree.radius[bifurcation.point];
    bifurcation.parentRadius = EndCalibre(tree, parent, false, scale, 4.0 * scale);
    const double r = bifurcation.parentRadius;
    std::map<int, double> calibre;
    for (const int d : leaving)
    {
      calibre[d] = EndCalibre(tree, tree.branches[d], true, r, 4.0 * r);
    }
    std::stable_sort(
      leaving.begin(), leaving.end(), [&](int a, int b) { return calibre[a] > calibre[b]; });
    bifurcation.daughters = leaving;
    const Vector3 course = -EndDirection(tree, parent, false, 0.5 * r, 3.0 * r);
    std::vector<Vector3> directions;
    double areas = 0.0;
    for (const int d : leaving)
    {
      bifurcation.daughterRadius.push_back(calibre[d]);
      areas += calibre[d] * calibre[d];
      directions.push_back(EndDirection(tree, tree.branches[d], true, 0.5 * r, 3.0 * r));
      bifurcation.daughterAngles.push_back(AngleBetween(course, directions.back()));
    }
    const double r1 = bifurcation.daughterRadius[0];
    const double r2 = bifurcation.daughterRadius[1];
    bifurcation.angle = AngleBetween(directions[0], directions[1]);
    bifurcation.areaRatio = areas / (r * r);
    bifurcation.daughterAreaRatio = r2 * r2 / (r1 * r1);
    bifurcation.murrayResidual = MurrayResidual(r, bifurcation.daughterRadius, exponent);
    bifurcation.huoKassabResidual = MurrayResidual(r, bifurcation.daughterRadius, 7.0 / 3.0);
    bifurcation.finetRatio = r / (r1 + r2);
    bifurcation.fittedExponent = SolveMurrayExponent(r, bifurcation.daughterRadius);
    tree.bifurcations.push_back(bifurcation);
  }
  tree.fittedExponent = FitExponent(tree.bifurcations);
}

void Require(bool condition, const char* message)
{
  if (!condition)
  {
    throw std::invalid_argument(message);
  }
}
}

void TopologySettings::Validate() const
{
  Require(this->gapRatio >= 0.0 && this->gapRatio <= 20.0, "The gap ratio must be from 0 to 20");
  Require(
    this->mergeRatio >= 0.0 && this->mergeRatio <= 1.0, "The merge ratio must be from 0 to 1");
  Require(
    this->pruneRatio >= 0.0 && this->pruneRatio <= 100.0, "The prune ratio must be from 0 to 100");
  Require(this->murrayExponent >= 0.5 && this->murrayExponent <= 10.0,
    "Murray's exponent must be from 0.5 to 10");
  Require(std::isfinite(this->smoothing.wavelength),
    "The wavelength of the smoothing must be a finite number");
  Require(std::isfinite(this->smoothing.leastWavelength),
    "The least wavelength of the smoothing must be a finite number");
}

double SolveMurrayExponent(double parent, const std::vector<double>& daughters)
{
  constexpr double greatest = 20.0;
  if (daughters.size() < 2 || MurrayResidual(parent, daughters, greatest) < 0.0)
  {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double low = 0.0;
  double high = greatest;
  for (int i = 0; i < 100; ++i)
  {
    const double middle = 0.5 * (low + high);
    (MurrayResidual(parent, daughters, middle) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

CenterlineTopology BuildTopology(
  const CenterlineSet& lines, const TopologySettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  Check(lines);
  CenterlineTopology tree;

  // One graph of all lines, the longest first: the others are measured against them.
  std::vector<double> lengths;
  std::vector<double> radii;
  double extent = 0.0;
  for (const auto& line : lines.lines)
  {
    double length = 0.0;
    for (std::size_t i = 0; i < line.size(); ++i)
    {
      radii.push_back(lines.radius[line[i]]);
      length += i > 0 ? (lines.points[line[i]] - lines.points[line[i - 1]]).norm() : 0.0;
    }
    lengths.push_back(length);
    extent = std::max(extent, length);
  }
  if (radii.empty() || extent <= 0.0)
  {
    tree.fittedExponent = std::numeric_limits<double>::quiet_NaN();
    return tree;
  }
  const double radius = MedianOf(radii);
  if (extent > LongestLine * radius)
  {
    throw std::invalid_argument("A line is more than a million times as long as the median radius");
  }
  Graph graph;
  graph.cellSize = 2.0 * radius;
  std::vector<std::size_t> order(lines.lines.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
    [&](std::size_t a, std::size_t b) { return lengths[a] > lengths[b]; });
  LineInserter inserter(graph, settings.mergeRatio, 1e-3 * radius);
  for (std::size_t i = 0; i < order.size(); ++i)
  {
    Report(progress, 0.4 * static_cast<double>(i) / static_cast<double>(order.size()));
    inserter.Insert(lines, lines.lines[order[i]]);
  }
  tree.mergedPoints = inserter.MergedPoints;
  tree.closedGaps = CloseGaps(graph, settings.gapRatio);

  // Roots: the given ones for the pieces that they are nearest to, the others by themselves.
  int count = 0;
  const std::vector<int> piece = Pieces(graph, count);
  std::vector<std::vector<int>> vertices(count);
  for (std::size_t v = 0; v < piece.size(); ++v)
  {
    if (piece[v] >= 0)
    {
      vertices[piece[v]].push_back(static_cast<int>(v));
    }
  }
  std::vector<int> roots(count, -1);
  std::vector<double> rootDistance(count, Infinity);
  for (const Vector3& root : lines.roots)
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
  std::vector<int> previous(graph.points.size(), -1);
  std::vector<std::vector<int>> loops;
  std::vector<Draft> drafts;
  for (int c = 0; c < count; ++c)
  {
    const int root = roots[c] >= 0 ? roots[c] : FindRoot(graph, vertices[c]);
    CutLoops(graph, root, previous, loops);
    DraftTree(graph, root, c, drafts);
  }
  Prune(graph, settings.pruneRatio, drafts, tree.prunedTwigs, tree.prunedLength);
  Report(progress, 0.5);

  // Out of the graph: depth first, the vessel's continuation before its side branches. For that
  // the branches exist twice for a moment.
  const auto convert = [&](const std::vector<int>& which, std::vector<int>& indexOf)
  {
    tree.points.clear();
    tree.radius.clear();
    tree.source.clear();
    tree.branches.clear();
    tree.meanRadius.clear();
    std::vector<std::int64_t> index(graph.points.size(), -1);
    for (const int d : which)
    {
      const Draft& draft = drafts[d];
      CenterlineTree::Branch branch;
      branch.groupId = static_cast<int>(tree.branches.size());
      indexOf[d] = branch.groupId;
      branch.parentGroupId = draft.parent < 0 ? -1 : indexOf[draft.parent];
      branch.treeId = draft.tree;
      for (const int v : draft.vertices)
      {
        if (index[v] < 0)
        {
          index[v] = static_cast<std::int64_t>(tree.points.size());
          tree.points.push_back(graph.points[v]);
          tree.radius.push_back(graph.radius[v]);
          tree.source.push_back(graph.source[v]);
        }
        branch.points.push_back(index[v]);
      }
      double integral = 0.0;
      for (std::size_t i = 1; i < branch.points.size(); ++i)
      {
        const double step =
          (tree.points[branch.points[i]] - tree.points[branch.points[i - 1]]).norm();
        branch.length += step;
        integral +=
          0.5 * step * (tree.radius[branch.points[i]] + tree.radius[branch.points[i - 1]]);
      }
      tree.meanRadius.push_back(integral / branch.length);
      const double chord =
        (tree.points[branch.points.back()] - tree.points[branch.points.front()]).norm();
      branch.tortuosity =
        chord > 1e-6 * branch.length ? std::max(0.0, branch.length / chord - 1.0) : 0.0;
      tree.branches.push_back(branch);
    }
    return index;
  };
  std::vector<int> indexOf(drafts.size(), -1);
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
  convert(which, indexOf);
  std::vector<int> sorted;
  std::vector<int> stack;
  for (auto d = which.rbegin(); d != which.rend(); ++d)
  {
    if (drafts[*d].parent < 0)
    {
      stack.push_back(*d);
    }
  }
  while (!stack.empty())
  {
    const int d = stack.back();
    stack.pop_back();
    sorted.push_back(d);
    std::vector<int> daughters = drafts[d].daughters;
    if (daughters.empty())
    {
      continue;
    }
    std::vector<int> indices;
    indices.reserve(daughters.size());
    for (const int daughter : daughters)
    {
      indices.push_back(indexOf[daughter]);
    }
    const int best = ChooseContinuation(tree, tree.branches[indexOf[d]], indices);
    std::stable_sort(daughters.begin(), daughters.end(),
      [&](int a, int b)
      {
        const auto rank = [&](int x)
        { return std::make_pair(indexOf[x] == best, tree.meanRadius[indexOf[x]]); };
        return rank(a) < rank(b);
      });
    stack.insert(stack.end(), daughters.begin(), daughters.end());
  }
  const std::vector<std::int64_t> index = convert(sorted, indexOf);

  // The trees in the order of their roots in the input.
  std::vector<std::vector<int>> daughters(tree.branches.size());
  tree.abscissa.assign(tree.points.size(), 0.0);
  tree.continuation.assign(tree.branches.size(), -1);
  tree.inLoop.assign(tree.branches.size(), 0);
  std::map<int, int> treeNumber;
  for (CenterlineTree::Branch& branch : tree.branches)
  {
    treeNumber.emplace(branch.treeId, static_cast<int>(treeNumber.size()));
    branch.treeId = treeNumber[branch.treeId];
    if (branch.parentGroupId >= 0)
    {
      std::vector<int>& siblings = daughters[branch.parentGroupId];
      if (siblings.empty())
      {
        tree.continuation[branch.parentGroupId] = branch.groupId;
      }
      siblings.push_back(branch.groupId);
      branch.generation = tree.branches[branch.parentGroupId].generation + 1;
    }
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      tree.abscissa[branch.points[i]] = tree.abscissa[branch.points[i - 1]] +
        (tree.points[branch.points[i]] - tree.points[branch.points[i - 1]]).norm();
    }
  }
  tree.trees = static_cast<int>(treeNumber.size());
  AssignStrahler(tree, daughters);
  for (const auto& loop : loops)
  {
    CenterlineLoop out;
    std::set<std::int64_t> members;
    for (std::size_t i = 0; i < loop.size(); ++i)
    {
      out.length += (graph.points[loop[i]] - graph.points[loop[(i + 1) % loop.size()]]).norm();
      if (index[loop[i]] >= 0)
      {
        out.points.push_back(index[loop[i]]);
        members.insert(index[loop[i]]);
      }
    }
    for (const CenterlineTree::Branch& branch : tree.branches)
    {
      if (members.count(branch.points[branch.points.size() / 2]) > 0)
      {
        tree.inLoop[branch.groupId] = 1;
      }
    }
    tree.loops.push_back(out);
  }
  ComputeGeometry(tree, settings.smoothing,
    progress ? [&](double fraction) { return progress(0.5 + 0.45 * fraction); }
             : ProgressCallback());
  DescribeBifurcations(tree, daughters, settings.murrayExponent);
  tree.segmentId.assign(tree.points.size(), 0);
  Report(progress, 1.0);
  return tree;
}
}
