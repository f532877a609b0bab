#include "PhantomSurface.h"

#include "DisjointSets.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace coronary
{
namespace
{
/// Which sheet of the surface crosses which edge of a cell, for each of the 256 sign patterns.
class CellSheets
{
public:
  /// Corner c of a cell lies at (c & 1, c >> 1 & 1, c >> 2).
  static constexpr int Corners(int edge, int end)
  {
    // Edges 0-3 run along x, 4-7 along y, 8-11 along z.
    const int axis = edge / 4;
    const int other = edge % 4;
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    return ((other & 1) << u) | ((other >> 1) << v) | (end << axis);
  }

  /// The edge that starts at a corner along an axis.
  static int EdgeFrom(int corner, int axis)
  {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    return axis * 4 + ((corner >> u) & 1) + 2 * ((corner >> v) & 1);
  }

  static const CellSheets& Instance()
  {
    static const CellSheets table;
    return table;
  }

  /// Sheet of an edge, or -1 when the surface does not cross it.
  int Sheet(int inside, int edge) const { return this->SheetOfEdge[inside][edge]; }
  int Count(int inside) const { return this->SheetCount[inside]; }

private:
  CellSheets()
  {
    for (int inside = 0; inside < 256; ++inside)
    {
      DisjointSets joined(12);
      const auto crossing = [&](int e)
      { return ((inside >> Corners(e, 0)) & 1) != ((inside >> Corners(e, 1)) & 1); };
      for (int axis = 0; axis < 3; ++axis)
      {
        for (int side = 0; side < 2; ++side)
        {
          const int u = (axis + 1) % 3;
          const int v = (axis + 2) % 3;
          const int base = side << axis;
          // Corners around the face and the edges between them.
          const int corner[4] = { base, base | (1 << u), base | (1 << u) | (1 << v),
            base | (1 << v) };
          const int edge[4] = { EdgeFrom(base, u), EdgeFrom(base | (1 << u), v),
            EdgeFrom(base | (1 << v), u), EdgeFrom(base, v) };
          int count = 0;
          for (const int e : edge)
          {
            count += crossing(e);
          }
          if (count == 2)
          {
            int first = -1;
            for (const int e : edge)
            {
              if (crossing(e))
              {
                if (first < 0)
                {
                  first = e;
                }
                else
                {
                  joined.Join(e, first);
                }
              }
            }
          }
          else if (count == 4)
          {
            // Both cells at this face must decide alike: cut off the inside corners.
            for (int c = 0; c < 4; ++c)
            {
              if ((inside >> corner[c]) & 1)
              {
                joined.Join(edge[c], edge[(c + 3) % 4]);
              }
            }
          }
        }
      }
      std::array<int, 12> number;
      number.fill(-1);
      int sheets = 0;
      for (int e = 0; e < 12; ++e)
      {
        if (!crossing(e))
        {
          this->SheetOfEdge[inside][e] = -1;
          continue;
        }
        int& n = number[joined.Find(e)];
        if (n < 0)
        {
          n = sheets++;
        }
        this->SheetOfEdge[inside][e] = static_cast<signed char>(n);
      }
      this->SheetCount[inside] = sheets;
    }
  }

  signed char SheetOfEdge[256][12];
  int SheetCount[256];
};

constexpr int Block = 8; // cells along a block's edge

std::int64_t Key(std::int64_t x, std::int64_t y, std::int64_t z)
{
  constexpr std::int64_t offset = 1 << 20;
  return ((x + offset) << 42) | ((y + offset) << 21) | (z + offset);
}

struct GridBlock
{
  std::int64_t x, y, z;      // of the first cell
  std::vector<float> values; // (Block + 1)^3 distances

  static int Index(int i, int j, int k) { return i + (Block + 1) * (j + (Block + 1) * k); }
};

struct Mesh
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
};

/// Blocks of the grid that the wall can pass through.
std::vector<GridBlock> FindBlocks(const PhantomAnatomy& anatomy, const Vector3& shift, double h)
{
  std::unordered_map<std::int64_t, char> seen;
  std::vector<GridBlock> blocks;
  const double size = Block * h;
  for (const AxisStep& step : anatomy.steps)
  {
    const Vector3& p = anatomy.tree.points[step.first];
    const Vector3& q = anatomy.tree.points[step.second];
    const double margin =
      1.8 * std::max(anatomy.tree.radius[step.first], anatomy.tree.radius[step.second]) + 2.0 * h;
    const Vector3 low = ((p.cwiseMin(q) - shift).array() - margin) / size;
    const Vector3 high = ((p.cwiseMax(q) - shift).array() + margin) / size;
    for (auto z = std::llround(std::floor(low[2])); z <= std::llround(std::floor(high[2])); ++z)
    {
      for (auto y = std::llround(std::floor(low[1])); y <= std::llround(std::floor(high[1])); ++y)
      {
        for (auto x = std::llround(std::floor(low[0])); x <= std::llround(std::floor(high[0])); ++x)
        {
          if (seen.emplace(Key(x, y, z), 1).second)
          {
            blocks.push_back({ x * Block, y * Block, z * Block, {} });
          }
        }
      }
    }
  }
  // One order, whatever the order of the steps.
  std::sort(blocks.begin(), blocks.end(),
    [](const GridBlock& a, const GridBlock& b) { return Key(a.x, a.y, a.z) < Key(b.x, b.y, b.z); });
  return blocks;
}

/// Signed distances to the wall at the corners of the blocks' cells.
void SampleDistances(std::vector<GridBlock>& blocks, const PhantomLumen& lumen,
  const Vector3& shift, double h, const ProgressCallback& progress)
{
  ParallelFor(
    static_cast<std::int64_t>(blocks.size()), 8,
    [&](std::int64_t first, std::int64_t last)
    {
      PhantomLumen::Candidates candidates;
      for (std::int64_t b = first; b < last; ++b)
      {
        GridBlock& block = blocks[b];
        const Vector3 corner =
          shift + h * Vector3(double(block.x), double(block.y), double(block.z));
        lumen.Collect(
          corner + Vector3::Constant(0.5 * Block * h), 0.5 * Block * h * 1.7321, candidates);
        block.values.resize((Block + 1) * (Block + 1) * (Block + 1));
        for (int k = 0; k <= Block; ++k)
        {
          for (int j = 0; j <= Block; ++j)
          {
            for (int i = 0; i <= Block; ++i)
            {
              // From the integer coordinates, so that neighbouring blocks agree to the last bit.
              const Vector3 position =
                shift + h * Vector3(double(block.x + i), double(block.y + j), double(block.z + k));
              block.values[GridBlock::Index(i, j, k)] =
                static_cast<float>(lumen.Evaluate(position, candidates).distance);
            }
          }
        }
      }
    },
    progress);
}

Mesh Extract(const PhantomAnatomy& anatomy, const PhantomLumen& lumen, const Vector3& shift,
  double h, const ProgressCallback& progress)
{
  std::vector<GridBlock> blocks = FindBlocks(anatomy, shift, h);
  SampleDistances(blocks, lumen, shift, h, progress);

  Mesh mesh;
  const CellSheets& sheets = CellSheets::Instance();
  std::unordered_map<std::int64_t, std::int64_t> firstVertex; // of a cell
  std::unordered_map<std::int64_t, unsigned char> pattern;
  const auto value = [](const GridBlock& block, int i, int j, int k, int corner)
  {
    return block
      .values[GridBlock::Index(i + (corner & 1), j + ((corner >> 1) & 1), k + (corner >> 2))];
  };
  for (const GridBlock& block : blocks)
  {
    for (int k = 0; k < Block; ++k)
    {
      for (int j = 0; j < Block; ++j)
      {
        for (int i = 0; i < Block; ++i)
        {
          int inside = 0;
          for (int corner = 0; corner < 8; ++corner)
          {
            inside |= (value(block, i, j, k, corner) < 0.0f) << corner;
          }
          if (inside == 0 || inside == 255)
          {
            continue;
          }
          const std::int64_t cell = Key(block.x + i, block.y + j, block.z + k);
          pattern[cell] = static_cast<unsigned char>(inside);
          firstVertex[cell] = static_cast<std::int64_t>(mesh.points.size());
          for (int sheet = 0; sheet < sheets.Count(inside); ++sheet)
          {
            Vector3 sum = Vector3::Zero();
            int count = 0;
            for (int edge = 0; edge < 12; ++edge)
            {
              if (sheets.Sheet(inside, edge) == sheet)
              {
                const int c0 = CellSheets::Corners(edge, 0);
                const int c1 = CellSheets::Corners(edge, 1);
                const double d0 = value(block, i, j, k, c0);
                const double d1 = value(block, i, j, k, c1);
                const Vector3 p0(c0 & 1, (c0 >> 1) & 1, c0 >> 2);
                const Vector3 p1(c1 & 1, (c1 >> 1) & 1, c1 >> 2);
                sum += p0 + (p1 - p0) * (d0 / (d0 - d1));
                ++count;
              }
            }
            mesh.points.push_back(shift +
              h *
                (Vector3(double(block.x + i), double(block.y + j), double(block.z + k)) +
                  sum / count));
          }
        }
      }
    }
  }

  for (const GridBlock& block : blocks)
  {
    for (int k = 0; k < Block; ++k)
    {
      for (int j = 0; j < Block; ++j)
      {
        for (int i = 0; i < Block; ++i)
        {
          for (int axis = 0; axis < 3; ++axis)
          {
            const float d0 = value(block, i, j, k, 0);
            const float d1 = value(block, i, j, k, 1 << axis);
            if ((d0 < 0.0f) == (d1 < 0.0f))
            {
              continue;
            }
            // The four cells around the edge, counter-clockwise about the axis.
            const int u = (axis + 1) % 3;
            const int v = (axis + 2) % 3;
            constexpr int around[4][2] = { { 0, 0 }, { 1, 0 }, { 1, 1 }, { 0, 1 } };
            std::array<std::int64_t, 4> quad;
            for (int n = 0; n < 4; ++n)
            {
              std::int64_t at[3] = { block.x + i, block.y + j, block.z + k };
              at[u] -= around[n][0];
              at[v] -= around[n][1];
              const std::int64_t cell = Key(at[0], at[1], at[2]);
              const auto found = firstVertex.find(cell);
              if (found == firstVertex.end())
              {
                throw std::runtime_error("CoronaryPhantom: the wall leaves the meshing grid");
              }
              const int corner = (around[n][0] << u) | (around[n][1] << v);
              quad[n] =
                found->second + sheets.Sheet(pattern[cell], CellSheets::EdgeFrom(corner, axis));
            }
            if (d0 >= 0.0f)
            {
              std::swap(quad[1], quad[3]);
            }
            const double diagonal02 = (mesh.points[quad[0]] - mesh.points[quad[2]]).squaredNorm();
            const double diagonal13 = (mesh.points[quad[1]] - mesh.points[quad[3]]).squaredNorm();
            // The cells lie clockwise as seen from the axis' far end after stepping back.
            if (diagonal02 <= diagonal13)
            {
              mesh.triangles.push_back({ quad[0], quad[1], quad[2] });
              mesh.triangles.push_back({ quad[0], quad[2], quad[3] });
            }
            else
            {
              mesh.triangles.push_back({ quad[0], quad[1], quad[3] });
              mesh.triangles.push_back({ quad[1], quad[2], quad[3] });
            }
          }
        }
      }
    }
  }
  return mesh;
}

/// Every edge in exactly two triangles, once in each direction, and one fan around each point.
bool IsClosedManifold(const Mesh& mesh)
{
  // Of each point the triangles around it, as their other two points in order.
  std::vector<std::size_t> first(mesh.points.size() + 1, 0);
  for (const Triangle& t : mesh.triangles)
  {
    for (const std::int64_t p : t)
    {
      ++first[p + 1];
    }
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::pair<std::int64_t, std::int64_t>> around(3 * mesh.triangles.size());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (const Triangle& t : mesh.triangles)
  {
    for (int c = 0; c < 3; ++c)
    {
      around[next[t[c]]++] = { t[(c + 1) % 3], t[(c + 2) % 3] };
    }
  }
  for (std::size_t p = 0; p < mesh.points.size(); ++p)
  {
    const auto begin = around.begin() + static_cast<std::ptrdiff_t>(first[p]);
    const auto end = around.begin() + static_cast<std::ptrdiff_t>(first[p + 1]);
    // The fan goes round once, with as many steps as there are triangles, and no point twice.
    std::sort(begin, end);
    if (begin == end ||
      std::adjacent_find(
        begin, end, [](const auto& a, const auto& b) { return a.first == b.first; }) != end)
    {
      return false;
    }
    auto step = begin;
    for (auto steps = end - begin; steps > 0; --steps)
    {
      const std::int64_t neighbour = step->second;
      step = std::lower_bound(begin, end, neighbour,
        [](const auto& entry, std::int64_t point) { return entry.first < point; });
      if (step == end || step->first != neighbour || (step == begin) != (steps == 1))
      {
        return false;
      }
    }
  }
  return true;
}

double MinimumAngle(const Vector3& a, const Vector3& b, const Vector3& c)
{
  const auto angle = [](const Vector3& p, const Vector3& q, const Vector3& r)
  {
    const Vector3 u = q - p;
    const Vector3 v = r - p;
    return std::atan2(u.cross(v).norm(), u.dot(v));
  };
  return std::min({ angle(a, b, c), angle(b, c, a), angle(c, a, b) });
}

Vector3 Normal(const Vector3& a, const Vector3& b, const Vector3& c)
{
  return (b - a).cross(c - a);
}

/**
 * Removes the slivers that the rims of the flat ends and the creases between vessels leave:
 * edges are flipped where that raises the smallest angle, and collapsed where they are short, as
 * long as the mesh stays a manifold and no triangle turns over.
 */
class Repair
{
public:
  explicit Repair(Mesh& mesh)
    : M(mesh)
    , Around(mesh.points.size())
  {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    {
      for (const std::int64_t p : mesh.triangles[t])
      {
        this->Around[p].push_back(t);
      }
    }
  }

  void Run(double shortest)
  {
    for (int round = 0; round < 4; ++round)
    {
      bool changed = false;
      for (std::size_t t = 0; t < this->M.triangles.size(); ++t)
      {
        changed = this->Improve(t, shortest) || changed;
      }
      if (!changed)
      {
        break;
      }
    }
    this->Compact();
  }

private:
  bool Dead(std::size_t t) const { return this->M.triangles[t][0] == this->M.triangles[t][1]; }
  const Vector3& At(std::int64_t p) const { return this->M.points[p]; }
  double Quality(std::int64_t a, std::int64_t b, std::int64_t c) const
  {
    return MinimumAngle(this->At(a), this->At(b), this->At(c));
  }

  /// The point across the directed edge, and its triangle.
  bool Across(std::int64_t a, std::int64_t b, std::int64_t& apex, std::size_t& triangle) const
  {
    for (const std::size_t t : this->Around[a])
    {
      for (int c = 0; c < 3; ++c)
      {
        if (this->M.triangles[t][c] == a && this->M.triangles[t][(c + 1) % 3] == b)
        {
          apex = this->M.triangles[t][(c + 2) % 3];
          triangle = t;
          return true;
        }
      }
    }
    return false;
  }

  std::vector<std::int64_t> Neighbours(std::int64_t p) const
  {
    std::vector<std::int64_t> result;
    for (const std::size_t t : this->Around[p])
    {
      for (const std::int64_t q : this->M.triangles[t])
      {
        if (q != p)
        {
          result.push_back(q);
        }
      }
    }
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }

  void Forget(std::int64_t p, std::size_t t)
  {
    auto& list = this->Around[p];
    list.erase(std::find(list.begin(), list.end(), t));
  }

  bool Improve(std::size_t t, double shortest)
  {
    constexpr double poor = 0.42; // 24 degrees
    if (this->Dead(t))
    {
      return false;
    }
    const Triangle triangle = this->M.triangles[t];
    if (this->Quality(triangle[0], triangle[1], triangle[2]) > poor)
    {
      return false;
    }
    int longest = 0;
    int minimum = 0;
    double length[3];
    for (int c = 0; c < 3; ++c)
    {
      length[c] = (this->At(triangle[c]) - this->At(triangle[(c + 1) % 3])).norm();
      longest = length[c] > length[longest] ? c : longest;
      minimum = length[c] < length[minimum] ? c : minimum;
    }
    return this->Flip(t, triangle[longest], triangle[(longest + 1) % 3]) ||
      (length[minimum] < shortest &&
        (this->Collapse(triangle[minimum], triangle[(minimum + 1) % 3]) ||
          this->Collapse(triangle[(minimum + 1) % 3], triangle[minimum])));
  }

  bool Flip(std::size_t t, std::int64_t a, std::int64_t b)
  {
    std::int64_t c = 0;
    std::int64_t d = 0;
    std::size_t self = 0;
    std::size_t other = 0;
    if (!this->Across(a, b, c, self) || self != t || !this->Across(b, a, d, other) || c == d)
    {
      return false;
    }
    const auto fan = this->Neighbours(c);
    if (std::binary_search(fan.begin(), fan.end(), d))
    {
      return false;
    }
    const double before = std::min(this->Quality(a, b, c), this->Quality(b, a, d));
    const double after = std::min(this->Quality(a, d, c), this->Quality(d, b, c));
    const Vector3 normal =
      Normal(this->At(a), this->At(b), this->At(c)) + Normal(this->At(b), this->At(a), this->At(d));
    if (after <= 1.05 * before ||
      Normal(this->At(a), this->At(d), this->At(c)).dot(normal) <= 0.0 ||
      Normal(this->At(d), this->At(b), this->At(c)).dot(normal) <= 0.0)
    {
      return false;
    }
    this->M.triangles[t] = { a, d, c };
    this->M.triangles[other] = { d, b, c };
    this->Forget(b, t);
    this->Forget(a, other);
    this->Around[d].push_back(t);
    this->Around[c].push_back(other);
    return true;
  }

  /// Moves `from` onto `to`.
  bool Collapse(std::int64_t from, std::int64_t to)
  {
    const auto fan = this->Neighbours(from);
    const auto other = this->Neighbours(to);
    std::vector<std::int64_t> common;
    std::set_intersection(
      fan.begin(), fan.end(), other.begin(), other.end(), std::back_inserter(common));
    if (common.size() != 2)
    {
      return false;
    }
    double before = 4.0;
    double after = 4.0;
    for (const std::size_t t : this->Around[from])
    {
      Triangle moved = this->M.triangles[t];
      before = std::min(before, this->Quality(moved[0], moved[1], moved[2]));
      if (std::find(moved.begin(), moved.end(), to) != moved.end())
      {
        continue;
      }
      const Vector3 normal = Normal(this->At(moved[0]), this->At(moved[1]), this->At(moved[2]));
      std::replace(moved.begin(), moved.end(), from, to);
      if (Normal(this->At(moved[0]), this->At(moved[1]), this->At(moved[2])).dot(normal) <= 0.0)
      {
        return false;
      }
      after = std::min(after, this->Quality(moved[0], moved[1], moved[2]));
    }
    if (after <= before)
    {
      return false;
    }
    const std::vector<std::size_t> triangles = this->Around[from];
    for (const std::size_t t : triangles)
    {
      Triangle& triangle = this->M.triangles[t];
      if (std::find(triangle.begin(), triangle.end(), to) != triangle.end())
      {
        for (const std::int64_t p : triangle)
        {
          this->Forget(p, t);
        }
        triangle = { 0, 0, 0 };
      }
      else
      {
        std::replace(triangle.begin(), triangle.end(), from, to);
        this->Around[to].push_back(t);
      }
    }
    this->Around[from].clear();
    return true;
  }

  void Compact()
  {
    std::vector<std::int64_t> number(this->M.points.size(), -1);
    std::vector<Triangle> triangles;
    for (std::size_t t = 0; t < this->M.triangles.size(); ++t)
    {
      if (!this->Dead(t))
      {
        triangles.push_back(this->M.triangles[t]);
        for (const std::int64_t p : triangles.back())
        {
          number[p] = 0;
        }
      }
    }
    std::vector<Vector3> points;
    for (std::size_t p = 0; p < number.size(); ++p)
    {
      if (number[p] == 0)
      {
        number[p] = static_cast<std::int64_t>(points.size());
        points.push_back(this->M.points[p]);
      }
    }
    for (Triangle& triangle : triangles)
    {
      for (std::int64_t& p : triangle)
      {
        p = number[p];
      }
    }
    this->M.points = std::move(points);
    this->M.triangles = std::move(triangles);
  }

  Mesh& M;
  std::vector<std::vector<std::size_t>> Around;
};

/// Evens out the triangles: points move to their neighbours' mean, then back onto the wall.
void Relax(Mesh& mesh, const PhantomLumen& lumen, int rounds, const ProgressCallback& progress)
{
  const std::size_t n = mesh.points.size();
  std::vector<std::int64_t> offset(n + 1, 0);
  for (const Triangle& t : mesh.triangles)
  {
    for (const std::int64_t p : t)
    {
      ++offset[p + 1];
    }
  }
  for (std::size_t p = 0; p < n; ++p)
  {
    offset[p + 1] += offset[p];
  }
  std::vector<std::int64_t> neighbour(offset[n]);
  std::vector<std::int64_t> fill(offset.begin(), offset.end() - 1);
  for (const Triangle& t : mesh.triangles)
  {
    for (int c = 0; c < 3; ++c)
    {
      neighbour[fill[t[c]]++] = t[(c + 1) % 3];
    }
  }
  std::vector<Vector3> next(n);
  for (int round = 0; round <= rounds; ++round)
  {
    ParallelFor(static_cast<std::int64_t>(n), 512,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t p = first; p < last; ++p)
        {
          Vector3 position = mesh.points[p];
          if (round > 0)
          {
            Vector3 mean = Vector3::Zero();
            for (std::int64_t e = offset[p]; e < offset[p + 1]; ++e)
            {
              mean += mesh.points[neighbour[e]];
            }
            mean /= static_cast<double>(offset[p + 1] - offset[p]);
            position += 0.6 * (mean - position);
          }
          lumen.Project(position, 1e-4);
          next[p] = position;
        }
      });
    mesh.points.swap(next);
    Report(progress, (round + 1.0) / (rounds + 1.0));
  }
}
}

PhantomSurface MeshLumen(const PhantomAnatomy& anatomy, const PhantomLumen& lumen,
  double edgeLength, const ProgressCallback& progress)
{
  const auto part = [&](double from, double to) -> ProgressCallback
  {
    if (!progress)
    {
      return {};
    }
    return [&progress, from, to](double f) { return progress(from + (to - from) * f); };
  };
  // A grid that is coarse for the thinnest vessel would cut it to pieces.
  const double thinnest = *std::min_element(anatomy.tree.radius.begin(), anatomy.tree.radius.end());
  edgeLength = std::min(edgeLength, 0.85 * std::max(MinimumMeshedRadius, thinnest));
  Mesh mesh;
  constexpr int attempts = 6;
  for (int attempt = 0;; ++attempt)
  {
    const double shift = 0.37 * attempt * edgeLength;
    mesh = Extract(
      anatomy, lumen, Vector3(shift, 0.61 * shift, 0.83 * shift), edgeLength, part(0.0, 0.4));
    if (IsClosedManifold(mesh))
    {
      break;
    }
    if (attempt + 1 == attempts)
    {
      throw std::runtime_error(
        "CoronaryPhantom: no closed surface at this surfaceSpacing, choose a smaller one");
    }
  }
  Relax(mesh, lumen, 6, part(0.4, 0.9));
  Repair(mesh).Run(0.45 * edgeLength);
  Relax(mesh, lumen, 1, part(0.9, 1.0));
  Repair(mesh).Run(0.45 * edgeLength);
  if (!IsClosedManifold(mesh))
  {
    throw std::runtime_error("CoronaryPhantom: the repaired surface is not closed");
  }

  PhantomSurface surface;
  surface.points = std::move(mesh.points);
  surface.triangles = std::move(mesh.triangles);
  surface.displacement.assign(surface.points.size(), Vector3::Zero());
  surface.groupId.resize(surface.points.size());
  surface.abscissa.resize(surface.points.size());
  ParallelFor(static_cast<std::int64_t>(surface.points.size()), 1024,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t p = first; p < last; ++p)
      {
        const PhantomLumen::Sample sample = lumen.Evaluate(surface.points[p]);
        const AxisStep& step = anatomy.steps[std::max(0, sample.step)];
        surface.groupId[p] = step.branch;
        const double from = anatomy.tree.abscissa[step.first];
        surface.abscissa[p] = from + sample.fraction * (anatomy.tree.abscissa[step.second] - from);
      }
    });

  surface.entityId.assign(surface.triangles.size(), 1);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
  {
    for (const VesselEnd& end : anatomy.ends)
    {
      const Vector3& tip = anatomy.tree.points[end.point];
      if ((surface.points[surface.triangles[t][0]] - tip).norm() >
        2.0 * anatomy.tree.radius[end.point] + 1.0)
      {
        continue;
      }
      const Vector3 normal = (tip - anatomy.tree.points[end.neighbour]).normalized();
      bool onPlane = true;
      for (const std::int64_t p : surface.triangles[t])
      {
        onPlane = onPlane && std::abs((surface.points[p] - tip).dot(normal)) < 0.02 &&
          (surface.points[p] - tip).norm() < 1.2 * anatomy.tree.radius[end.point];
      }
      if (onPlane)
      {
        surface.entityId[t] = end.entityId;
      }
    }
  }
  return surface;
}
}
