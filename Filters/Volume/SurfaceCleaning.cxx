#include "SurfaceCleaning.h"

#include "HoleFilling.h"
#include "SurfaceCheck.h"
#include "TriangleIntersections.h"
#include "TriangleTree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>
#include <utility>

namespace coronary
{
namespace
{
constexpr int mostRounds = 14;
constexpr int foldRounds = 6;        ///< of these, also folds are taken out
constexpr double endSlope = 0.7;     ///< of the wall's normals along a rim's: steeper is a hole
constexpr double endRoundness = 0.3; ///< area in the rim over that of its mean radius' circle
constexpr double endFlatness = 0.5;  ///< distance to the plane, in radii
constexpr double flattened = 0.25;   ///< the same; up to here the rim is moved into the plane
constexpr double deviation =
  0.05; ///< of the surface from where it was, in edge lengths, for better
        ///< shapes
constexpr double foldCosine = -0.95; ///< of the angle between neighbours' normals: folded over
constexpr char overlappingZone = 1;  ///< had inner parts, or a band between two rims
constexpr char cappedZone = 2;       ///< had a cap
constexpr double radiusRatio = 2.5;  ///< of two rims that may be joined

/// One triangle with where it came from.
struct Cell
{
  Triangle corners;
  std::int64_t source; ///< of the input, or -1
  int cap;             ///< 0: wall
  bool band = false;   ///< joins two rims
};

/// One side of a triangle; equal edges follow each other when sorted.
struct Side
{
  std::int64_t low;
  std::int64_t high;
  std::int64_t cell;
  bool rising; ///< the triangle runs from low to high

  bool operator<(const Side& other) const
  {
    return std::tie(this->low, this->high, this->cell) <
      std::tie(other.low, other.high, other.cell);
  }
};

/// A closed line of open edges, in the direction that a patch over it runs.
struct Rim
{
  std::vector<std::int64_t> points;
  std::vector<std::int64_t> cells; ///< per point: the triangle at the edge to the next one
  Vector3 centre = Vector3::Zero();
  Vector3 normal = Vector3::Zero(); ///< out of the surface
  double radius = 0.0;
  double flatness = 0.0; ///< greatest distance to the plane, mm
  bool end = false;      ///< of a vessel, not a hole of its wall
  std::int64_t component = -1;
  std::int64_t zone = -1;
};

/// Disjoint sets of numbers; the lowest stands for its set.
class Sets
{
public:
  explicit Sets(std::size_t count)
    : Parent(count)
  {
    std::iota(this->Parent.begin(), this->Parent.end(), 0);
  }

  std::int64_t Find(std::int64_t i)
  {
    while (this->Parent[i] != i)
    {
      this->Parent[i] = this->Parent[this->Parent[i]];
      i = this->Parent[i];
    }
    return i;
  }

  void Join(std::int64_t i, std::int64_t j)
  {
    i = this->Find(i);
    j = this->Find(j);
    this->Parent[std::max(i, j)] = std::min(i, j);
  }

private:
  std::vector<std::int64_t> Parent;
};

Vector3 AreaVector(const Vector3& a, const Vector3& b, const Vector3& c)
{
  return 0.5 * (b - a).cross(c - a);
}

/// Radians; 0 for a triangle without area.
double LeastAngle(const Vector3& a, const Vector3& b, const Vector3& c)
{
  const double area = (b - a).cross(c - a).norm();
  return std::min({ std::atan2(area, (b - a).dot(c - a)), std::atan2(area, (c - b).dot(a - b)),
    std::atan2(area, (a - c).dot(b - c)) });
}

/// A triangle's part of the winding number around a point, times 4 pi.
/// Source: Van Oosterom and Strackee, IEEE Trans Biomed Eng 30, 1983.
double SolidAngle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c)
{
  const Vector3 x = a - p;
  const Vector3 y = b - p;
  const Vector3 z = c - p;
  const double u = x.norm();
  const double v = y.norm();
  const double w = z.norm();
  return 2.0 *
    std::atan2(x.dot(y.cross(z)), u * v * w + x.dot(y) * w + y.dot(z) * u + z.dot(x) * v);
}

std::string Count(std::int64_t count, const char* one, const char* many)
{
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

/// The state between the steps.
class Cleaner
{
public:
  Cleaner(const std::vector<Vector3>& points, const std::vector<Triangle>& triangles,
    const SurfaceCleaningSettings& settings, const ProgressCallback& progress)
    : InputPoints(points)
    , InputTriangles(triangles)
    , Settings(settings)
    , Progress(progress)
  {
  }

  CleanedSurface Run()
  {
    this->Settings.Validate();
    this->Read();
    this->Step(0.02);
    this->MergePoints();
    this->DropDegenerate();
    this->DropDuplicates();
    this->Step(0.06);
    this->CutNonManifoldEdges();
    this->Orient(true);
    this->SplitPinches(true);
    this->DropSmallComponents(this->Settings.smallestComponent, true);
    this->Step(0.1);
    this->CountIntersections();
    this->Improve(true);
    this->Step(0.2);
    this->DropInnerComponents();
    this->Step(0.25);
    this->CloseRims();
    this->Step(0.3);
    this->ResolveIntersections(0.3, 0.7);
    this->Improve(false);
    this->Step(0.75);
    this->ResolveIntersections(0.75, 0.92);
    this->DropSmallComponents(this->Settings.smallestComponent, true);
    this->Orient(false);
    this->Finish();
    this->Step(1.0);
    return std::move(this->Result);
  }

private:
  void Step(double fraction) const { Report(this->Progress, fraction); }

  const Vector3& At(std::int64_t i) const { return this->Points[i]; }

  Vector3 CellArea(const Cell& cell) const
  {
    return AreaVector(
      this->At(cell.corners[0]), this->At(cell.corners[1]), this->At(cell.corners[2]));
  }

  Vector3 Centre(const Cell& cell) const
  {
    return (this->At(cell.corners[0]) + this->At(cell.corners[1]) + this->At(cell.corners[2])) /
      3.0;
  }

  double CellAngle(const Cell& cell) const
  {
    return LeastAngle(
      this->At(cell.corners[0]), this->At(cell.corners[1]), this->At(cell.corners[2]));
  }

  void Say(const std::string& what, const Vector3& where)
  {
    this->Result.repairs.push_back(what + ", the first at " + Describe(where));
  }

  void Read()
  {
    const auto count = static_cast<std::int64_t>(this->InputPoints.size());
    for (std::size_t i = 0; i < this->InputTriangles.size(); ++i)
    {
      for (const std::int64_t point : this->InputTriangles[i])
      {
        if (point < 0 || point >= count)
        {
          throw std::invalid_argument("cell " + std::to_string(i) + " of the surface has point " +
            std::to_string(point) + ", which does not exist");
        }
        if (!this->InputPoints[point].allFinite())
        {
          throw std::invalid_argument(
            "point " + std::to_string(point) + " of the surface is not finite");
        }
      }
      this->Cells.push_back({ this->InputTriangles[i], static_cast<std::int64_t>(i), 0, false });
    }
    this->Points = this->InputPoints;
    this->Source.resize(this->Points.size());
    std::iota(this->Source.begin(), this->Source.end(), 0);
    if (this->Cells.empty())
    {
      throw std::invalid_argument("the surface is empty: it has no triangles");
    }
  }

  void MergePoints()
  {
    std::vector<char> used(this->Points.size(), 0);
    Vector3 low = this->At(this->Cells[0].corners[0]);
    Vector3 high = low;
    for (const Cell& cell : this->Cells)
    {
      for (const std::int64_t corner : cell.corners)
      {
        used[corner] = 1;
        low = low.cwiseMin(this->At(corner));
        high = high.cwiseMax(this->At(corner));
      }
    }
    const double tolerance = this->Settings.mergeTolerance * (high - low).norm();
    // Points in boxes of the tolerance: what is near lies in the same or a neighbouring one.
    const double side = std::max(tolerance, 1e-12 * (high - low).norm());
    if (!(side > 0.0))
    {
      return;
    }
    struct Entry
    {
      std::array<std::int64_t, 3> box;
      std::int64_t point;
      bool operator<(const Entry& other) const
      {
        return std::tie(this->box, this->point) < std::tie(other.box, other.point);
      }
    };
    std::vector<Entry> entries;
    const auto boxOf = [&](const Vector3& p)
    {
      const Vector3 x = (p - low) / side;
      return std::array<std::int64_t, 3>{ static_cast<std::int64_t>(std::floor(x[0])),
        static_cast<std::int64_t>(std::floor(x[1])), static_cast<std::int64_t>(std::floor(x[2])) };
    };
    for (std::size_t i = 0; i < used.size(); ++i)
    {
      if (used[i] != 0)
      {
        entries.push_back({ boxOf(this->Points[i]), static_cast<std::int64_t>(i) });
      }
    }
    std::sort(entries.begin(), entries.end());
    Sets sets(this->Points.size());
    for (const Entry& entry : entries)
    {
      for (std::int64_t x = -1; x <= 1; ++x)
      {
        for (std::int64_t y = -1; y <= 1; ++y)
        {
          // The three boxes along the last axis are neighbours in the order.
          const std::array<std::int64_t, 3> first{ entry.box[0] + x, entry.box[1] + y,
            entry.box[2] - 1 };
          const std::array<std::int64_t, 3> last{ first[0], first[1], entry.box[2] + 1 };
          for (auto other = std::lower_bound(entries.begin(), entries.end(), Entry{ first, 0 });
               other != entries.end() && other->box <= last; ++other)
          {
            if (other->point < entry.point &&
              (this->At(other->point) - this->At(entry.point)).norm() <= tolerance)
            {
              sets.Join(other->point, entry.point);
            }
          }
        }
      }
    }
    Vector3 where = Vector3::Zero();
    for (std::size_t i = 0; i < used.size(); ++i)
    {
      const auto point = static_cast<std::int64_t>(i);
      if (used[i] != 0 && sets.Find(point) != point)
      {
        where = this->Result.counts.mergedPoints++ == 0 ? this->At(point) : where;
      }
    }
    for (Cell& cell : this->Cells)
    {
      for (std::int64_t& corner : cell.corners)
      {
        corner = sets.Find(corner);
      }
    }
    if (this->Result.counts.mergedPoints > 0)
    {
      this->Say(
        Count(this->Result.counts.mergedPoints, "doubled point was", "doubled points were") +
          " merged",
        where);
    }
  }

  void DropDegenerate()
  {
    Vector3 where = Vector3::Zero();
    std::int64_t& count = this->Result.counts.degenerateTriangles;
    this->Keep(
      [&](const Cell& cell)
      {
        const Triangle& t = cell.corners;
        const bool degenerate = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
        if (degenerate)
        {
          where = count++ == 0 ? this->At(t[0]) : where;
        }
        return !degenerate;
      });
    if (count > 0)
    {
      this->Say(Count(count, "triangle", "triangles") + " with equal corners left out", where);
    }
  }

  void DropDuplicates()
  {
    std::set<Triangle> seen;
    Vector3 where = Vector3::Zero();
    std::int64_t& count = this->Result.counts.duplicateTriangles;
    this->Keep(
      [&](const Cell& cell)
      {
        Triangle sorted = cell.corners;
        std::sort(sorted.begin(), sorted.end());
        const bool fresh = seen.insert(sorted).second;
        if (!fresh)
        {
          where = count++ == 0 ? this->Centre(cell) : where;
        }
        return fresh;
      });
    if (count > 0)
    {
      this->Say(Count(count, "doubled triangle", "doubled triangles") + " left out", where);
    }
  }

  template <typename Predicate>
  void Keep(const Predicate& keep)
  {
    std::vector<Cell> kept;
    kept.reserve(this->Cells.size());
    for (const Cell& cell : this->Cells)
    {
      if (keep(cell))
      {
        kept.push_back(cell);
      }
    }
    this->Cells.swap(kept);
  }

  std::vector<Side> Sides() const
  {
    std::vector<Side> sides;
    sides.reserve(3 * this->Cells.size());
    for (std::size_t c = 0; c < this->Cells.size(); ++c)
    {
      for (int i = 0; i < 3; ++i)
      {
        const std::int64_t a = this->Cells[c].corners[i];
        const std::int64_t b = this->Cells[c].corners[(i + 1) % 3];
        sides.push_back({ std::min(a, b), std::max(a, b), static_cast<std::int64_t>(c), a < b });
      }
    }
    std::sort(sides.begin(), sides.end());
    return sides;
  }

  /// Calls edge(first, count) for the sides of each edge.
  template <typename Function>
  static void ForEdges(const std::vector<Side>& sides, const Function& edge)
  {
    for (std::size_t first = 0, last = 0; first < sides.size(); first = last)
    {
      while (last < sides.size() && sides[last].low == sides[first].low &&
        sides[last].high == sides[first].high)
      {
        ++last;
      }
      edge(first, last - first);
    }
  }

  void CutNonManifoldEdges()
  {
    const std::vector<Side> sides = this->Sides();
    std::vector<char> bad(this->Cells.size(), 0);
    std::int64_t& count = this->Result.counts.nonManifoldEdges;
    Vector3 where = Vector3::Zero();
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        if (size > 2)
        {
          where = count++ == 0 ? this->At(sides[first].low) : where;
          for (std::size_t i = first; i < first + size; ++i)
          {
            bad[sides[i].cell] = 1;
          }
        }
      });
    if (count > 0)
    {
      this->Say(Count(count, "edge", "edges") + " of more than two triangles cut open", where);
      this->Remove(bad);
    }
  }

  void Remove(const std::vector<char>& bad)
  {
    std::size_t i = 0;
    this->Keep([&](const Cell&) { return bad[i++] == 0; });
  }

  /// Neighbours over edges of two triangles: three a triangle, -1 at open edges.
  std::vector<std::int64_t> Neighbours() const
  {
    std::vector<std::int64_t> neighbours(3 * this->Cells.size(), -1);
    const std::vector<Side> sides = this->Sides();
    const auto place = [&](const Side& side)
    {
      const Triangle& t = this->Cells[side.cell].corners;
      for (int i = 0; i < 3; ++i)
      {
        if (std::min(t[i], t[(i + 1) % 3]) == side.low &&
          std::max(t[i], t[(i + 1) % 3]) == side.high)
        {
          return 3 * side.cell + i;
        }
      }
      return std::int64_t(0);
    };
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        if (size == 2)
        {
          neighbours[place(sides[first])] = sides[first + 1].cell;
          neighbours[place(sides[first + 1])] = sides[first].cell;
        }
      });
    return neighbours;
  }

  /// Components over edges, numbered in the order of their first triangles.
  std::vector<std::int64_t> Components(std::int64_t& count) const
  {
    const std::vector<std::int64_t> neighbours = this->Neighbours();
    std::vector<std::int64_t> component(this->Cells.size(), -1);
    count = 0;
    std::vector<std::int64_t> stack;
    for (std::size_t seed = 0; seed < this->Cells.size(); ++seed)
    {
      if (component[seed] >= 0)
      {
        continue;
      }
      component[seed] = count;
      stack.assign(1, static_cast<std::int64_t>(seed));
      while (!stack.empty())
      {
        const std::int64_t cell = stack.back();
        stack.pop_back();
        for (int i = 0; i < 3; ++i)
        {
          const std::int64_t next = neighbours[3 * cell + i];
          if (next >= 0 && component[next] < 0)
          {
            component[next] = count;
            stack.push_back(next);
          }
        }
      }
      ++count;
    }
    return component;
  }

  static bool Runs(const Triangle& t, std::int64_t a, std::int64_t b)
  {
    return (t[0] == a && t[1] == b) || (t[1] == a && t[2] == b) || (t[2] == a && t[0] == b);
  }

  /// Makes neighbours agree; what can not be oriented is cut open. Then outwards.
  void Orient(bool first)
  {
    const std::vector<std::int64_t> neighbours = this->Neighbours();
    std::vector<std::int64_t> component(this->Cells.size(), -1);
    std::vector<char> flip(this->Cells.size(), 0);
    std::vector<char> bad(this->Cells.size(), 0);
    std::int64_t count = 0;
    std::vector<std::int64_t> queue;
    std::int64_t conflicts = 0;
    Vector3 conflictAt = Vector3::Zero();
    for (std::size_t seed = 0; seed < this->Cells.size(); ++seed)
    {
      if (component[seed] >= 0)
      {
        continue;
      }
      component[seed] = count++;
      queue.assign(1, static_cast<std::int64_t>(seed));
      for (std::size_t k = 0; k < queue.size(); ++k)
      {
        const std::int64_t cell = queue[k];
        const Triangle& t = this->Cells[cell].corners;
        for (int i = 0; i < 3; ++i)
        {
          const std::int64_t next = neighbours[3 * cell + i];
          if (next < 0)
          {
            continue;
          }
          const bool disagree = Runs(this->Cells[next].corners, t[i], t[(i + 1) % 3]);
          const auto wanted = static_cast<char>((flip[cell] != 0) != disagree);
          if (component[next] < 0)
          {
            component[next] = component[seed];
            flip[next] = wanted;
            queue.push_back(next);
          }
          else if (flip[next] != wanted && bad[next] == 0 && bad[cell] == 0)
          {
            bad[next] = 1;
            conflictAt = conflicts++ == 0 ? this->Centre(this->Cells[next]) : conflictAt;
          }
        }
      }
    }
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      if (flip[i] != 0)
      {
        std::swap(this->Cells[i].corners[1], this->Cells[i].corners[2]);
      }
    }
    if (conflicts > 0)
    {
      this->Result.counts.nonManifoldEdges += conflicts;
      this->Say("the surface has one side only and was cut open at " +
          Count(conflicts, "triangle", "triangles"),
        conflictAt);
      this->Remove(bad);
      this->Orient(first);
      return;
    }
    this->TurnOutwards(component, count);
  }

  void TurnOutwards(const std::vector<std::int64_t>& component, std::int64_t count)
  {
    std::vector<double> volume(count, 0.0);
    std::vector<double> area(count, 0.0);
    std::vector<double> turned(count, 0.0); // area that looks elsewhere than in the input
    std::vector<Vector3> origin(count, Vector3::Zero());
    std::vector<char> known(count, 0);
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      const Cell& cell = this->Cells[i];
      const std::int64_t c = component[i];
      if (known[c] == 0)
      {
        origin[c] = this->At(cell.corners[0]);
        known[c] = 1;
      }
      const Vector3 normal = this->CellArea(cell);
      volume[c] += normal.dot(this->Centre(cell) - origin[c]) / 3.0;
      area[c] += normal.norm();
      if (cell.source >= 0)
      {
        turned[c] += normal.norm() * (this->IsTurned(cell) ? 1.0 : -1.0);
      }
    }
    // Open ones are closed by a fan over each rim.
    for (const Rim& rim : this->Rims())
    {
      const std::int64_t c = component[rim.cells[0]];
      for (std::size_t i = 0; i < rim.points.size(); ++i)
      {
        const Vector3& a = this->At(rim.points[i]);
        const Vector3& b = this->At(rim.points[(i + 1) % rim.points.size()]);
        volume[c] += AreaVector(a, b, rim.centre).dot(a - origin[c]) / 3.0;
      }
    }
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      const std::int64_t c = component[i];
      const bool flat = std::abs(volume[c]) < 1e-4 * std::pow(area[c], 1.5);
      if (flat ? turned[c] > 0.0 : volume[c] < 0.0)
      {
        std::swap(this->Cells[i].corners[1], this->Cells[i].corners[2]);
      }
    }
  }

  bool IsTurned(const Cell& cell) const
  {
    // Corners may be other points by now: what counts is where the triangle looks.
    const Triangle& t = this->InputTriangles[cell.source];
    return AreaVector(this->InputPoints[t[0]], this->InputPoints[t[1]], this->InputPoints[t[2]])
             .dot(this->CellArea(cell)) < 0.0;
  }

  /// A point where several fans of triangles touch becomes one for each, a little apart.
  void SplitPinches(bool first)
  {
    std::vector<std::vector<std::int64_t>> fans(this->Points.size());
    for (std::size_t c = 0; c < this->Cells.size(); ++c)
    {
      for (const std::int64_t corner : this->Cells[c].corners)
      {
        fans[corner].push_back(static_cast<std::int64_t>(c));
      }
    }
    std::int64_t count = 0;
    Vector3 where = Vector3::Zero();
    for (std::size_t p = 0, last = fans.size(); p < last; ++p)
    {
      const auto point = static_cast<std::int64_t>(p);
      std::vector<std::int64_t> left = fans[p];
      bool own = true;
      while (!left.empty())
      {
        std::vector<std::int64_t> fan{ left.front() };
        left.erase(left.begin());
        std::set<std::int64_t> rim;
        const auto add = [&](std::int64_t cell)
        {
          for (const std::int64_t corner : this->Cells[cell].corners)
          {
            if (corner != point)
            {
              rim.insert(corner);
            }
          }
        };
        add(fan[0]);
        for (bool grown = true; grown;)
        {
          grown = false;
          for (std::size_t i = 0; i < left.size(); ++i)
          {
            const Triangle& t = this->Cells[left[i]].corners;
            if (std::any_of(t.begin(), t.end(),
                  [&](std::int64_t corner) { return corner != point && rim.count(corner) != 0; }))
            {
              add(left[i]);
              fan.push_back(left[i]);
              left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
              grown = true;
              break;
            }
          }
        }
        if (own)
        {
          own = false;
          continue;
        }
        where = count++ == 0 ? this->At(point) : where;
        Vector3 mean = Vector3::Zero();
        for (const std::int64_t corner : rim)
        {
          mean += this->At(corner) / static_cast<double>(rim.size());
        }
        const auto fresh = static_cast<std::int64_t>(this->Points.size());
        this->Points.emplace_back(this->At(point) + 0.05 * (mean - this->At(point)));
        this->Source.push_back(this->Source[point]);
        for (const std::int64_t cell : fan)
        {
          for (std::int64_t& corner : this->Cells[cell].corners)
          {
            corner = corner == point ? fresh : corner;
          }
        }
      }
    }
    if (first && count > 0)
    {
      this->Result.counts.nonManifoldPoints = count;
      this->Say(
        Count(count, "point", "points") + " where fans of triangles touch separated", where);
    }
  }

  void DropSmallComponents(double part, bool counted)
  {
    std::int64_t count = 0;
    const std::vector<std::int64_t> component = this->Components(count);
    std::vector<double> area(count, 0.0);
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      area[component[i]] += this->CellArea(this->Cells[i]).norm();
    }
    if (area.empty())
    {
      return;
    }
    const double least = part * *std::max_element(area.begin(), area.end());
    std::vector<char> bad(this->Cells.size(), 0);
    std::vector<char> small(count, 0);
    Vector3 where = Vector3::Zero();
    std::int64_t dropped = 0;
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      if (area[component[i]] < least)
      {
        bad[i] = 1;
        if (small[component[i]] == 0)
        {
          small[component[i]] = 1;
          where = dropped++ == 0 ? this->Centre(this->Cells[i]) : where;
        }
      }
    }
    if (dropped == 0)
    {
      return;
    }
    this->Remove(bad);
    if (counted)
    {
      this->Result.counts.smallComponents += dropped;
      this->Say(Count(dropped, "small component", "small components") + " left out", where);
    }
  }

  double Winding(const std::vector<Cell>& cells, const Vector3& p) const
  {
    double sum = 0.0;
    for (const Cell& cell : cells)
    {
      sum += SolidAngle(
        p, this->At(cell.corners[0]), this->At(cell.corners[1]), this->At(cell.corners[2]));
    }
    return sum / (4.0 * M_PI);
  }

  /**
   * Which components lie inside the given surface: their outer side is where it winds around
   * already. The component with the largest area never does.
   */
  std::vector<char> InnerComponents(const std::vector<std::int64_t>& component, std::int64_t count,
    const std::vector<Cell>& surface) const
  {
    constexpr std::size_t samples = 9;
    std::vector<double> area(count, 0.0);
    std::vector<std::vector<std::int64_t>> members(count);
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      area[component[i]] += this->CellArea(this->Cells[i]).norm();
      members[component[i]].push_back(static_cast<std::int64_t>(i));
    }
    std::vector<char> inner(count, 0);
    if (count < 2)
    {
      return inner;
    }
    const std::int64_t largest = std::max_element(area.begin(), area.end()) - area.begin();
    ParallelFor(count, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t c = first; c < last; ++c)
        {
          if (c == largest)
          {
            continue;
          }
          std::size_t inside = 0;
          const std::size_t taken = std::min(samples, members[c].size());
          for (std::size_t s = 0; s < taken; ++s)
          {
            const Cell& cell =
              this->Cells[members[c][(2 * s + 1) * members[c].size() / (2 * taken)]];
            const Vector3 normal = this->CellArea(cell);
            const Vector3 p =
              this->Centre(cell) + 1e-3 * normal / std::sqrt(std::max(normal.norm(), 1e-300));
            inside += this->Winding(surface, p) > 0.5 ? 1 : 0;
          }
          inner[c] = static_cast<char>(2 * inside > taken);
        }
      });
    return inner;
  }

  void DropInnerComponents()
  {
    std::int64_t count = 0;
    const std::vector<std::int64_t> component = this->Components(count);
    const std::vector<char> inner = this->InnerComponents(component, count, this->Cells);
    std::vector<char> bad(this->Cells.size(), 0);
    Vector3 where = Vector3::Zero();
    bool any = false;
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      bad[i] = inner[component[i]];
      if (bad[i] != 0 && !any)
      {
        any = true;
        where = this->Centre(this->Cells[i]);
      }
    }
    if (any)
    {
      const auto dropped = std::count(inner.begin(), inner.end(), 1);
      this->Result.counts.innerComponents += dropped;
      this->Say(Count(dropped, "component", "components") + " inside of others left out", where);
      this->Remove(bad);
    }
  }

  /// The surface must be oriented and without pinches.
  std::vector<Rim> Rims() const
  {
    const std::vector<Side> sides = this->Sides();
    // The patch runs against the triangle at the edge.
    std::map<std::int64_t, std::pair<std::int64_t, std::int64_t>> next;
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        if (size == 1)
        {
          const Side& side = sides[first];
          next[side.rising ? side.high : side.low] = { side.rising ? side.low : side.high,
            side.cell };
        }
      });
    std::vector<Rim> rims;
    while (!next.empty())
    {
      Rim rim;
      for (auto edge = next.begin(); edge != next.end();)
      {
        const std::int64_t to = edge->second.first;
        rim.points.push_back(edge->first);
        rim.cells.push_back(edge->second.second);
        next.erase(edge);
        edge = next.find(to);
      }
      this->Measure(rim);
      rims.push_back(std::move(rim));
    }
    return rims;
  }

  void Measure(Rim& rim) const
  {
    const std::size_t n = rim.points.size();
    for (const std::int64_t point : rim.points)
    {
      rim.centre += this->At(point) / static_cast<double>(n);
    }
    Vector3 area = Vector3::Zero();
    for (std::size_t i = 0; i < n; ++i)
    {
      area += AreaVector(rim.centre, this->At(rim.points[i]), this->At(rim.points[(i + 1) % n]));
      rim.radius += (this->At(rim.points[i]) - rim.centre).norm() / static_cast<double>(n);
    }
    rim.normal = area.norm() > 0.0 ? Vector3(area.normalized()) : Vector3::UnitZ();
    double slope = 0.0;
    for (std::size_t i = 0; i < n; ++i)
    {
      rim.flatness =
        std::max(rim.flatness, std::abs((this->At(rim.points[i]) - rim.centre).dot(rim.normal)));
      const Vector3 normal = this->CellArea(this->Cells[rim.cells[i]]);
      slope +=
        std::abs(normal.dot(rim.normal)) / std::max(normal.norm(), 1e-300) / static_cast<double>(n);
    }
    rim.end = n >= 5 && slope < endSlope &&
      area.norm() > endRoundness * M_PI * rim.radius * rim.radius &&
      rim.flatness < endFlatness * rim.radius;
  }

  /// Mean distance of one rim's points to the nearest of the other's.
  double Gap(const Rim& one, const Rim& other) const
  {
    double sum = 0.0;
    for (const std::int64_t p : one.points)
    {
      double least = std::numeric_limits<double>::infinity();
      for (const std::int64_t q : other.points)
      {
        least = std::min(least, (this->At(p) - this->At(q)).squaredNorm());
      }
      sum += std::sqrt(least);
    }
    return sum / static_cast<double>(one.points.size());
  }

  std::vector<double> MeanEdges() const
  {
    std::vector<double> sum(this->Points.size(), 0.0);
    std::vector<int> count(this->Points.size(), 0);
    for (const Cell& cell : this->Cells)
    {
      for (int i = 0; i < 3; ++i)
      {
        const std::int64_t a = cell.corners[i];
        const std::int64_t b = cell.corners[(i + 1) % 3];
        const double length = (this->At(a) - this->At(b)).norm();
        sum[a] += length;
        sum[b] += length;
        ++count[a];
        ++count[b];
      }
    }
    for (std::size_t i = 0; i < sum.size(); ++i)
    {
      sum[i] = count[i] > 0 ? sum[i] / count[i] : 0.0;
    }
    return sum;
  }

  /// Appends a patch whose first points are the rim's.
  void Append(const SurfacePatch& patch, const std::vector<std::int64_t>& rim, int cap, bool band)
  {
    std::vector<std::int64_t> number = rim;
    for (std::size_t i = rim.size(); i < patch.points.size(); ++i)
    {
      number.push_back(static_cast<std::int64_t>(this->Points.size()));
      this->Points.push_back(patch.points[i]);
      this->Source.push_back(-1);
    }
    for (const Triangle& t : patch.triangles)
    {
      this->Cells.push_back({ { number[t[0]], number[t[1]], number[t[2]] }, -1, cap, band });
    }
  }

  /// Joins ends that face each other, then closes what is left. Zones: see ResolveIntersections.
  void CloseRims(const std::vector<char>& kinds = {}, const std::vector<std::int64_t>& zoneOf = {})
  {
    std::vector<Rim> rims = this->Rims();
    if (rims.empty())
    {
      return;
    }
    std::int64_t count = 0;
    const std::vector<std::int64_t> component = this->Components(count);
    for (Rim& rim : rims)
    {
      rim.component = component[rim.cells[0]];
      for (const std::int64_t point : rim.points)
      {
        if (point < static_cast<std::int64_t>(zoneOf.size()) && zoneOf[point] >= 0)
        {
          rim.zone = zoneOf[point];
        }
      }
    }
    const std::vector<double> sizes = this->MeanEdges();
    std::set<std::pair<std::int64_t, std::int64_t>> edges;
    for (const Cell& cell : this->Cells)
    {
      for (int i = 0; i < 3; ++i)
      {
        edges.insert(std::minmax(cell.corners[i], cell.corners[(i + 1) % 3]));
      }
    }
    std::vector<char> done(rims.size(), 0);
    this->JoinRims(rims, sizes, kinds, edges, done);
    const bool first = zoneOf.empty();
    std::int64_t holes = 0;
    std::int64_t caps = 0;
    Vector3 holeAt = Vector3::Zero();
    Vector3 capAt = Vector3::Zero();
    for (std::size_t i = 0; i < rims.size(); ++i)
    {
      // A gap that a repair left is an end only where a cap was taken away.
      Rim& rim = rims[i];
      rim.end = rim.end && (first || (rim.zone >= 0 && (kinds[rim.zone] & cappedZone) != 0));
      const bool end = rim.end;
      if (done[i] != 0 || (first && (end ? !this->Settings.capEnds : !this->Settings.fillHoles)) ||
        rim.points.size() < 3)
      {
        continue;
      }
      if (end)
      {
        capAt = caps++ == 0 ? rim.centre : capAt;
      }
      else
      {
        holeAt = holes++ == 0 ? rim.centre : holeAt;
      }
      this->CloseRim(rim, sizes, edges);
    }
    if (first && holes > 0)
    {
      this->Result.counts.filledHoles = holes;
      this->Say(Count(holes, "hole", "holes") + " filled", holeAt);
    }
    if (first && caps > 0)
    {
      this->Result.counts.caps = caps;
      this->Say(Count(caps, "open end", "open ends") + " closed by a cap", capAt);
    }
  }

  void CloseRim(const Rim& rim, const std::vector<double>& sizes,
    std::set<std::pair<std::int64_t, std::int64_t>>& edges)
  {
    if (rim.end && rim.flatness < flattened * rim.radius)
    {
      for (const std::int64_t point : rim.points)
      {
        const double height = (this->At(point) - rim.centre).dot(rim.normal);
        this->Points[point] -= height * rim.normal;
      }
    }
    std::vector<Vector3> places;
    std::vector<Vector3> outside;
    std::vector<double> wanted;
    for (std::size_t i = 0; i < rim.points.size(); ++i)
    {
      places.push_back(this->At(rim.points[i]));
      wanted.push_back(sizes[rim.points[i]]);
      const Vector3 normal = this->CellArea(this->Cells[rim.cells[i]]);
      outside.emplace_back(normal / std::max(normal.norm(), 1e-300));
    }
    if (rim.end)
    {
      outside.clear();
      // A flat cap has the wall's edge length at its rim, not that of triangles stretched along it.
      for (std::size_t i = 0; i < places.size(); ++i)
      {
        const std::size_t n = places.size();
        wanted[i] = 0.5 *
          ((places[i] - places[(i + 1) % n]).norm() + (places[i] - places[(i + n - 1) % n]).norm());
      }
    }
    const ForbiddenChord forbidden = [&](std::int64_t i, std::int64_t j)
    { return edges.count(std::minmax(rim.points[i], rim.points[j])) != 0; };
    SurfacePatch patch = TriangulateHole(places, outside, forbidden);
    RefinePatch(patch, wanted, forbidden);
    const std::size_t before = this->Cells.size();
    this->Append(patch, rim.points, rim.end ? ++this->Caps : 0, false);
    for (std::size_t c = before; c < this->Cells.size(); ++c)
    {
      const Triangle& t = this->Cells[c].corners;
      for (int i = 0; i < 3; ++i)
      {
        edges.insert(std::minmax(t[i], t[(i + 1) % 3]));
      }
    }
  }

  void JoinRims(const std::vector<Rim>& rims, const std::vector<double>& sizes,
    const std::vector<char>& kinds, std::set<std::pair<std::int64_t, std::int64_t>>& edges,
    std::vector<char>& done)
  {
    struct Pair
    {
      double gap;
      std::size_t one;
      std::size_t other;
      bool operator<(const Pair& p) const
      {
        return std::tie(this->gap, this->one, this->other) < std::tie(p.gap, p.one, p.other);
      }
    };
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < rims.size(); ++i)
    {
      for (std::size_t j = i + 1; j < rims.size(); ++j)
      {
        const Rim& a = rims[i];
        const Rim& b = rims[j];
        const double small = std::min(a.radius, b.radius);
        const bool seam = a.zone >= 0 && a.zone == b.zone && (kinds[a.zone] & overlappingZone) != 0;
        if (std::min(a.points.size(), b.points.size()) < 3 ||
          (a.centre - b.centre).norm() >
            (1.0 + this->Settings.joinDistance) * std::max(a.radius, b.radius) ||
          std::max(a.radius, b.radius) > radiusRatio * small)
        {
          continue;
        }
        // The two ends of a short tube look away from each other.
        const bool away = a.component == b.component &&
          std::min((b.centre - a.centre).dot(a.normal), (a.centre - b.centre).dot(b.normal)) <
            -0.1 * small;
        const bool facing = (a.end || b.end) && a.normal.dot(b.normal) < -0.3 && !away;
        if (!seam && (!facing || this->Settings.joinDistance == 0.0))
        {
          continue;
        }
        const double gap = std::max(this->Gap(a, b), this->Gap(b, a));
        if (gap < (seam ? 2.0 : this->Settings.joinDistance) * small)
        {
          pairs.push_back({ gap, i, j });
        }
      }
    }
    std::sort(pairs.begin(), pairs.end());
    std::int64_t joined = 0;
    Vector3 where = Vector3::Zero();
    for (const Pair& pair : pairs)
    {
      if (done[pair.one] != 0 || done[pair.other] != 0)
      {
        continue;
      }
      done[pair.one] = 1;
      done[pair.other] = 1;
      where = joined++ == 0 ? rims[pair.one].centre : where;
      std::vector<std::int64_t> points = rims[pair.one].points;
      points.insert(points.end(), rims[pair.other].points.begin(), rims[pair.other].points.end());
      std::vector<Vector3> first;
      std::vector<Vector3> second;
      std::vector<double> wanted;
      for (const std::int64_t p : rims[pair.one].points)
      {
        first.push_back(this->At(p));
      }
      for (const std::int64_t p : rims[pair.other].points)
      {
        second.push_back(this->At(p));
      }
      for (const std::int64_t p : points)
      {
        wanted.push_back(sizes[p]);
      }
      SurfacePatch patch = TriangulateBand(first, second);
      RefinePatch(patch, wanted,
        [&](std::int64_t i, std::int64_t j)
        { return edges.count(std::minmax(points[i], points[j])) != 0; });
      this->Append(patch, points, 0, true);
    }
    if (joined > 0 && kinds.empty())
    {
      this->Result.counts.joinedEnds = joined;
      this->Say(Count(joined, "pair", "pairs") + " of ends that face each other joined", where);
    }
  }

  /// Triangles that cut others, are at edges of more than two, or (on request) folded over.
  std::vector<char> Offenders(
    std::int64_t& count, Sets& zones, Vector3& where, bool folds = false) const
  {
    std::vector<char> bad(this->Cells.size(), 0);
    std::vector<Triangle> triangles;
    triangles.reserve(this->Cells.size());
    for (const Cell& cell : this->Cells)
    {
      triangles.push_back(cell.corners);
    }
    count = 0;
    for (const auto& [s, t] : FindSelfIntersections(this->Points, triangles))
    {
      where = count++ == 0 ? this->Centre(this->Cells[s]) : where;
      bad[s] = 1;
      bad[t] = 1;
      zones.Join(triangles[s][0], triangles[t][0]);
    }
    const std::vector<Side> sides = this->Sides();
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        bool wrong = size > 2;
        if (size == 2 && folds)
        {
          const Vector3 one = this->CellArea(this->Cells[sides[first].cell]);
          const Vector3 other = this->CellArea(this->Cells[sides[first + 1].cell]);
          wrong = one.dot(other) < foldCosine * one.norm() * other.norm();
        }
        for (std::size_t i = first; wrong && i < first + size; ++i)
        {
          where = count++ == 0 ? this->Centre(this->Cells[sides[i].cell]) : where;
          bad[sides[i].cell] = 1;
        }
      });
    return bad;
  }

  void CountIntersections()
  {
    Vector3 where = Vector3::Zero();
    Sets zones(this->Points.size());
    this->Offenders(this->Result.counts.selfIntersections, zones, where);
    const std::int64_t count = this->Result.counts.selfIntersections;
    if (count > 0)
    {
      this->Say(Count(count, "pair", "pairs") + " of triangles that cut each other" +
          (this->Settings.resolveIntersections ? " taken out" : " found"),
        where);
    }
  }

  /**
   * Takes out triangles that cut others, each time with one more ring around them every second
   * round, and what then lies inside; closes the holes that are left. Connected holes are a zone:
   * where one had inner parts, or a band between two rims, vessels belong together, and its two rims
   * are joined.
   */
  void ResolveIntersections(double from, double to)
  {
    if (!this->Settings.resolveIntersections)
    {
      return;
    }
    for (int round = 0; round < mostRounds; ++round)
    {
      this->Step(from + (to - from) * round / mostRounds);
      std::int64_t count = 0;
      Vector3 where = Vector3::Zero();
      Sets zones(this->Points.size());
      std::vector<char> bad = this->Offenders(count, zones, where, round < foldRounds);
      if (count == 0)
      {
        return;
      }
      this->Grow(bad, round / 2);
      const std::vector<Cell> before = this->Cells;
      std::vector<char> touched(this->Points.size(), 0);
      for (std::size_t i = 0; i < this->Cells.size(); ++i)
      {
        if (bad[i] != 0)
        {
          const Triangle& t = this->Cells[i].corners;
          zones.Join(t[0], t[1]);
          zones.Join(t[0], t[2]);
          touched[t[0]] = touched[t[1]] = touched[t[2]] = 1;
        }
      }
      this->Remove(bad);
      std::vector<char> kinds(this->Points.size(), 0);
      this->DropInnerParts(before, touched, zones, kinds);
      for (std::size_t i = 0; i < before.size(); ++i)
      {
        if (bad[i] != 0)
        {
          kinds[zones.Find(before[i].corners[0])] |= static_cast<char>(
            (before[i].band ? overlappingZone : 0) | (before[i].cap > 0 ? cappedZone : 0));
        }
      }
      std::vector<std::int64_t> zoneOf(this->Points.size(), -1);
      for (std::size_t i = 0; i < zoneOf.size(); ++i)
      {
        if (touched[i] != 0)
        {
          zoneOf[i] = zones.Find(static_cast<std::int64_t>(i));
        }
      }
      const std::size_t known = zoneOf.size();
      this->SplitPinches(false);
      for (std::size_t i = known; i < this->Points.size(); ++i)
      {
        zoneOf.push_back(-1);
      }
      this->CloseRims(kinds, zoneOf);
    }
  }

  void Grow(std::vector<char>& bad, int rings) const
  {
    std::vector<char> marked(this->Points.size(), 0);
    // A cap is whole or gone.
    std::vector<char> cap(static_cast<std::size_t>(this->Caps) + 1, 0);
    for (int ring = 0; ring <= rings; ++ring)
    {
      for (std::size_t i = 0; i < bad.size(); ++i)
      {
        cap[this->Cells[i].cap] |= bad[i];
      }
      for (std::size_t i = 0; i < bad.size(); ++i)
      {
        bad[i] |= static_cast<char>(this->Cells[i].cap > 0 && cap[this->Cells[i].cap] != 0);
        if (bad[i] != 0)
        {
          for (const std::int64_t corner : this->Cells[i].corners)
          {
            marked[corner] = 1;
          }
        }
      }
      if (ring == rings)
      {
        return;
      }
      for (std::size_t i = 0; i < bad.size(); ++i)
      {
        const Triangle& t = this->Cells[i].corners;
        bad[i] |= static_cast<char>(marked[t[0]] | marked[t[1]] | marked[t[2]]);
      }
    }
  }

  void DropInnerParts(const std::vector<Cell>& before, const std::vector<char>& touched,
    Sets& zones, std::vector<char>& kinds)
  {
    this->DropSmallComponents(1e-3 * this->Settings.smallestComponent, false);
    std::int64_t count = 0;
    const std::vector<std::int64_t> component = this->Components(count);
    const std::vector<char> inner = this->InnerComponents(component, count, before);
    std::vector<char> bad(this->Cells.size(), 0);
    std::vector<std::int64_t> last(count, -1);
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      bad[i] = inner[component[i]];
      for (const std::int64_t corner : this->Cells[i].corners)
      {
        if (bad[i] == 0 || touched[corner] == 0)
        {
          continue;
        }
        // All that one inner part touches is one zone.
        std::int64_t& known = last[component[i]];
        if (known >= 0)
        {
          zones.Join(known, corner);
        }
        known = corner;
      }
    }
    for (const std::int64_t point : last)
    {
      if (point >= 0)
      {
        kinds[zones.Find(point)] |= overlappingZone;
      }
    }
    this->Result.counts.innerComponents += std::count(inner.begin(), inner.end(), 1);
    this->Remove(bad);
  }

  void Finish()
  {
    CleanedSurface& result = this->Result;
    if (this->Cells.empty())
    {
      result.warnings.emplace_back("nothing is left of the surface");
      return;
    }
    SurfaceCleaningCounts& counts = result.counts;
    std::int64_t offenders = 0;
    Vector3 where = Vector3::Zero();
    Sets zones(this->Points.size());
    this->Offenders(offenders, zones, where);
    counts.remainingIntersections = offenders;
    if (offenders > 0 && this->Settings.resolveIntersections)
    {
      result.warnings.push_back(Count(offenders, "pair", "pairs") +
        " of triangles still cut each other, the first at " + Describe(where));
    }
    const std::vector<Side> sides = this->Sides();
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        if (size == 1)
        {
          where = counts.openEdges++ == 0 ? this->At(sides[first].low) : where;
        }
      });
    if (counts.openEdges > 0 && this->Settings.fillHoles && this->Settings.capEnds)
    {
      result.warnings.push_back(Count(counts.openEdges, "edge is", "edges are") +
        " still open, the first at " + Describe(where));
    }
    for (const Cell& cell : this->Cells)
    {
      counts.remainingBadTriangles += this->CellAngle(cell) < this->Settings.minimumAngle ? 1 : 0;
      counts.turnedTriangles += cell.source >= 0 && this->IsTurned(cell) ? 1 : 0;
    }
    if (counts.turnedTriangles > 0)
    {
      result.repairs.push_back(
        Count(counts.turnedTriangles, "triangle", "triangles") + " turned over");
    }
    this->NumberCaps();
    this->NumberComponents();
    this->Compact();
  }

  void NumberCaps()
  {
    std::vector<double> area(static_cast<std::size_t>(this->Caps) + 1, 0.0);
    for (const Cell& cell : this->Cells)
    {
      area[cell.cap] += this->CellArea(cell).norm();
    }
    std::vector<int> order(this->Caps);
    std::iota(order.begin(), order.end(), 1);
    std::stable_sort(order.begin(), order.end(), [&](int i, int j) { return area[i] > area[j]; });
    std::vector<int> number(area.size(), 0);
    int used = 0;
    for (const int cap : order)
    {
      number[cap] = area[cap] > 0.0 ? ++used : 0;
    }
    for (Cell& cell : this->Cells)
    {
      cell.cap = number[cell.cap];
    }
    this->Result.counts.caps = used;
  }

  void NumberComponents()
  {
    std::int64_t count = 0;
    const std::vector<std::int64_t> component = this->Components(count);
    std::vector<double> area(count, 0.0);
    for (std::size_t i = 0; i < this->Cells.size(); ++i)
    {
      area[component[i]] += this->CellArea(this->Cells[i]).norm();
    }
    std::vector<int> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int i, int j) { return area[i] > area[j]; });
    std::vector<int> number(count);
    for (std::int64_t i = 0; i < count; ++i)
    {
      number[order[i]] = static_cast<int>(i);
    }
    this->Result.components = count;
    for (const std::int64_t c : component)
    {
      this->Result.component.push_back(number[c]);
    }
  }

  void Compact()
  {
    CleanedSurface& result = this->Result;
    std::vector<std::int64_t> number(this->Points.size(), -1);
    for (const Cell& cell : this->Cells)
    {
      for (const std::int64_t corner : cell.corners)
      {
        number[corner] = 0;
      }
    }
    for (std::size_t i = 0; i < number.size(); ++i)
    {
      if (number[i] < 0)
      {
        continue;
      }
      number[i] = static_cast<std::int64_t>(result.points.size());
      result.points.push_back(this->Points[i]);
      result.sourcePoint.push_back(this->Source[i]);
      if (this->Source[i] >= 0)
      {
        result.greatestDisplacement = std::max(result.greatestDisplacement,
          (this->Points[i] - this->InputPoints[this->Source[i]]).norm());
      }
    }
    const TriangleTree tree(this->InputPoints, this->InputTriangles);
    result.nearestPoint = result.sourcePoint;
    for (std::size_t i = 0; i < result.points.size(); ++i)
    {
      if (result.nearestPoint[i] < 0)
      {
        const Triangle& t = this->InputTriangles[tree.Closest(result.points[i]).triangle];
        result.nearestPoint[i] = *std::min_element(t.begin(), t.end(),
          [&](std::int64_t a, std::int64_t b)
          {
            return (this->InputPoints[a] - result.points[i]).squaredNorm() <
              (this->InputPoints[b] - result.points[i]).squaredNorm();
          });
      }
    }
    for (const Cell& cell : this->Cells)
    {
      result.triangles.push_back(
        { number[cell.corners[0]], number[cell.corners[1]], number[cell.corners[2]] });
      result.sourceCell.push_back(cell.source);
      result.cap.push_back(cell.cap);
      result.nearestCell.push_back(
        cell.source >= 0 ? cell.source : tree.Closest(this->Centre(cell)).triangle);
    }
  }

  /// The neighbourhood of each point while thin triangles are worked on.
  struct Fans
  {
    std::vector<std::vector<std::int64_t>> cells;
    std::vector<char> fixed; ///< at open edges and at the rims of caps
    std::vector<char> gone;  ///< per cell
  };

  Fans MakeFans() const
  {
    Fans fans;
    fans.cells.resize(this->Points.size());
    fans.fixed.assign(this->Points.size(), 0);
    fans.gone.assign(this->Cells.size(), 0);
    for (std::size_t c = 0; c < this->Cells.size(); ++c)
    {
      for (const std::int64_t corner : this->Cells[c].corners)
      {
        fans.cells[corner].push_back(static_cast<std::int64_t>(c));
      }
    }
    const std::vector<Side> sides = this->Sides();
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        if (size != 2 ||
          this->Cells[sides[first].cell].cap != this->Cells[sides[first + 1].cell].cap)
        {
          fans.fixed[sides[first].low] = 1;
          fans.fixed[sides[first].high] = 1;
        }
      });
    return fans;
  }

  /// The triangles of an edge.
  static std::vector<std::int64_t> Common(
    const Fans& fans, const std::vector<Cell>& cells, std::int64_t a, std::int64_t b)
  {
    std::vector<std::int64_t> common;
    for (const std::int64_t c : fans.cells[a])
    {
      const Triangle& t = cells[c].corners;
      if (t[0] == b || t[1] == b || t[2] == b)
      {
        common.push_back(c);
      }
    }
    return common;
  }

  /// Neither folds over nor, where the old triangle had a clear side, turns away from it.
  bool Keeps(
    const Triangle& before, const Vector3 (&after)[3], const Vector3& mean, double most) const
  {
    const Vector3 old = AreaVector(this->At(before[0]), this->At(before[1]), this->At(before[2]));
    const Vector3 now = AreaVector(after[0], after[1], after[2]);
    const double angle = LeastAngle(this->At(before[0]), this->At(before[1]), this->At(before[2]));
    const Vector3& reference = angle > 0.035 ? old : mean;
    return now.dot(reference) > most * now.norm() * reference.norm();
  }

  Vector3 MeanNormal(const Fans& fans, std::int64_t point) const
  {
    Vector3 sum = Vector3::Zero();
    for (const std::int64_t c : fans.cells[point])
    {
      sum += this->CellArea(this->Cells[c]);
    }
    return sum;
  }

  /// Of the edges at a point.
  double MeanEdge(const Fans& fans, std::int64_t point) const
  {
    double sum = 0.0;
    for (const std::int64_t c : fans.cells[point])
    {
      for (const std::int64_t corner : this->Cells[c].corners)
      {
        sum += (this->At(corner) - this->At(point)).norm();
      }
    }
    return sum / static_cast<double>(2 * fans.cells[point].size());
  }

  double WorstAround(const Fans& fans, std::int64_t point) const
  {
    double worst = M_PI;
    for (const std::int64_t c : fans.cells[point])
    {
      worst = std::min(worst, this->CellAngle(this->Cells[c]));
    }
    return worst;
  }

  bool TrySwap(Fans& fans, std::int64_t c, int side)
  {
    const Triangle t = this->Cells[c].corners;
    const std::int64_t a = t[side];
    const std::int64_t b = t[(side + 1) % 3];
    const std::int64_t p = t[(side + 2) % 3];
    const std::vector<std::int64_t> common = Common(fans, this->Cells, a, b);
    if (common.size() != 2)
    {
      return false;
    }
    const std::int64_t other = common[0] == c ? common[1] : common[0];
    const Triangle u = this->Cells[other].corners;
    const std::int64_t q = u[0] != a && u[0] != b ? u[0] : u[1] != a && u[1] != b ? u[1] : u[2];
    if (this->Cells[c].cap != this->Cells[other].cap || p == q ||
      !Common(fans, this->Cells, p, q).empty())
    {
      return false;
    }
    const Triangle first{ a, q, p };
    const Triangle second{ q, b, p };
    const auto angle = [&](const Triangle& x)
    { return LeastAngle(this->At(x[0]), this->At(x[1]), this->At(x[2])); };
    const double before = std::min(angle(t), angle(u));
    if (!(std::min(angle(first), angle(second)) > before + 1e-6))
    {
      return false;
    }
    const Vector3 mean = this->CellArea(this->Cells[c]) + this->CellArea(this->Cells[other]);
    const Vector3 around = this->MeanNormal(fans, p) + this->MeanNormal(fans, q) +
      this->MeanNormal(fans, a) + this->MeanNormal(fans, b);
    for (const Triangle& x : { first, second })
    {
      const Vector3 normal = AreaVector(this->At(x[0]), this->At(x[1]), this->At(x[2]));
      const Vector3& reference = angle(t) > 0.035 || angle(u) > 0.035 ? mean : around;
      if (!(normal.dot(reference) > 0.8 * normal.norm() * reference.norm()))
      {
        return false;
      }
    }
    const Vector3 across = (this->At(b) - this->At(a)).cross(this->At(q) - this->At(p));
    if (std::abs(across.dot(this->At(p) - this->At(a))) >
      deviation * across.norm() * std::min(this->MeanEdge(fans, p), this->MeanEdge(fans, q)))
    {
      return false;
    }
    const auto drop = [&](std::int64_t point, std::int64_t cell)
    {
      std::vector<std::int64_t>& fan = fans.cells[point];
      fan.erase(std::find(fan.begin(), fan.end(), cell));
    };
    drop(b, c);
    drop(a, other);
    fans.cells[q].push_back(c);
    fans.cells[p].push_back(other);
    this->Cells[c].corners = first;
    this->Cells[other].corners = second;
    return true;
  }

  /// Moves point `from` onto `to`, and so takes out the triangles between them.
  bool TryCollapse(Fans& fans, std::int64_t from, std::int64_t to)
  {
    if (fans.fixed[from] != 0)
    {
      return false;
    }
    const std::vector<std::int64_t> common = Common(fans, this->Cells, from, to);
    if (common.size() != 2)
    {
      return false;
    }
    std::set<std::int64_t> one;
    std::set<std::int64_t> other;
    for (const auto& [point, ring] : { std::pair(from, &one), std::pair(to, &other) })
    {
      for (const std::int64_t c : fans.cells[point])
      {
        ring->insert(this->Cells[c].corners.begin(), this->Cells[c].corners.end());
      }
    }
    std::size_t shared = 0;
    for (const std::int64_t point : one)
    {
      shared += point != from && point != to ? other.count(point) : 0;
    }
    if (shared != 2)
    {
      return false;
    }
    const Vector3 mean = this->MeanNormal(fans, from) + this->MeanNormal(fans, to);
    double before = M_PI;
    double after = M_PI;
    double distance = std::numeric_limits<double>::infinity();
    for (const std::int64_t c : fans.cells[from])
    {
      before = std::min(before, this->CellAngle(this->Cells[c]));
      if (c == common[0] || c == common[1])
      {
        continue;
      }
      const Triangle& t = this->Cells[c].corners;
      Vector3 moved[3];
      for (int i = 0; i < 3; ++i)
      {
        moved[i] = this->At(t[i] == from ? to : t[i]);
      }
      if (!this->Keeps(t, moved, mean, 0.7))
      {
        return false;
      }
      after = std::min(after, LeastAngle(moved[0], moved[1], moved[2]));
      distance = std::min(distance,
        (ClosestPointOfTriangle(this->At(from), moved[0], moved[1], moved[2]) - this->At(from))
          .norm());
    }
    if (!(after > before + 1e-6) || distance > deviation * this->MeanEdge(fans, from))
    {
      return false;
    }
    for (const std::int64_t c : fans.cells[from])
    {
      if (c == common[0] || c == common[1])
      {
        fans.gone[c] = 1;
        for (const std::int64_t corner : this->Cells[c].corners)
        {
          if (corner != from)
          {
            std::vector<std::int64_t>& fan = fans.cells[corner];
            fan.erase(std::find(fan.begin(), fan.end(), c));
          }
        }
        continue;
      }
      for (std::int64_t& corner : this->Cells[c].corners)
      {
        corner = corner == from ? to : corner;
      }
      fans.cells[to].push_back(c);
    }
    fans.cells[from].clear();
    return true;
  }

  /// Towards the middle of its neighbours, in the tangent plane.
  bool TryMove(const Fans& fans, std::int64_t point)
  {
    if (fans.fixed[point] != 0 || fans.cells[point].empty())
    {
      return false;
    }
    const Vector3 mean = this->MeanNormal(fans, point);
    const double size = mean.norm();
    if (!(size > 0.0))
    {
      return false;
    }
    Vector3 centre = Vector3::Zero();
    for (const std::int64_t c : fans.cells[point])
    {
      centre += this->Centre(this->Cells[c]) / static_cast<double>(fans.cells[point].size());
    }
    const Vector3 place = this->At(point);
    Vector3 shift = 1.5 * (centre - place);
    shift -= shift.dot(mean) / (size * size) * mean;
    const double before = this->WorstAround(fans, point);
    for (const double step : { 1.0, 0.5, 0.25, 0.125 })
    {
      const Vector3 next = place + step * shift;
      bool right = true;
      double after = M_PI;
      double distance = std::numeric_limits<double>::infinity();
      for (const std::int64_t c : fans.cells[point])
      {
        const Triangle& t = this->Cells[c].corners;
        distance = std::min(distance,
          (ClosestPointOfTriangle(next, this->At(t[0]), this->At(t[1]), this->At(t[2])) - next)
            .norm());
        Vector3 moved[3];
        for (int i = 0; i < 3; ++i)
        {
          moved[i] = t[i] == point ? next : this->At(t[i]);
        }
        right = right && this->Keeps(t, moved, mean, 0.9);
        after = std::min(after, LeastAngle(moved[0], moved[1], moved[2]));
      }
      if (right && after > before + 1e-6 && distance < deviation * this->MeanEdge(fans, point))
      {
        this->Points[point] = next;
        return true;
      }
    }
    return false;
  }

  bool ImproveCell(Fans& fans, std::int64_t c)
  {
    const Triangle t = this->Cells[c].corners;
    std::array<int, 3> order{ 0, 1, 2 };
    const auto length = [&](int side)
    { return (this->At(t[side]) - this->At(t[(side + 1) % 3])).norm(); };
    std::sort(order.begin(), order.end(), [&](int i, int j) { return length(i) < length(j); });
    // A needle has one short edge; a cap's longest one is as long as the others together.
    if (length(order[0]) < 0.35 * length(order[2]))
    {
      const std::int64_t a = t[order[0]];
      const std::int64_t b = t[(order[0] + 1) % 3];
      if (this->TryCollapse(fans, a, b) || this->TryCollapse(fans, b, a))
      {
        ++this->Result.counts.edgeCollapses;
        return true;
      }
    }
    if (this->TrySwap(fans, c, order[2]) || this->TrySwap(fans, c, order[1]))
    {
      ++this->Result.counts.edgeSwaps;
      return true;
    }
    bool moved = false;
    for (const std::int64_t corner : t)
    {
      if (this->TryMove(fans, corner))
      {
        ++this->Result.counts.pointMoves;
        moved = true;
      }
    }
    if (moved)
    {
      return true;
    }
    for (const std::int64_t corner : t)
    {
      for (const std::int64_t other : t)
      {
        if (other != corner &&
          (this->At(corner) - this->At(other)).norm() < 0.8 * length(order[2]) &&
          this->TryCollapse(fans, corner, other))
        {
          ++this->Result.counts.edgeCollapses;
          return true;
        }
      }
    }
    return false;
  }

  /// Works on triangles below the minimum angle, worst first; each change betters the worst around.
  void Improve(bool first)
  {
    constexpr int passes = 12;
    Fans fans = this->MakeFans();
    bool any = true;
    for (int pass = 0; pass < passes && any; ++pass)
    {
      any = false;
      std::vector<std::pair<double, std::int64_t>> bad;
      for (std::size_t i = 0; i < this->Cells.size(); ++i)
      {
        const double angle = fans.gone[i] != 0 ? M_PI : this->CellAngle(this->Cells[i]);
        if (angle < this->Settings.minimumAngle)
        {
          bad.emplace_back(angle, static_cast<std::int64_t>(i));
        }
      }
      std::sort(bad.begin(), bad.end());
      if (first && pass == 0 && !bad.empty())
      {
        this->Result.counts.badTriangles = static_cast<std::int64_t>(bad.size());
        this->Say(
          Count(this->Result.counts.badTriangles, "thin triangle", "thin triangles") + " worked on",
          this->Centre(this->Cells[bad[0].second]));
      }
      for (const auto& [angle, cell] : bad)
      {
        any = (fans.gone[cell] == 0 &&
                this->CellAngle(this->Cells[cell]) < this->Settings.minimumAngle &&
                this->ImproveCell(fans, cell)) ||
          any;
      }
    }
    this->Remove(fans.gone);
  }

  const std::vector<Vector3>& InputPoints;
  const std::vector<Triangle>& InputTriangles;
  const SurfaceCleaningSettings& Settings;
  const ProgressCallback& Progress;
  std::vector<Vector3> Points;
  std::vector<std::int64_t> Source;
  std::vector<Cell> Cells;
  int Caps = 0;
  CleanedSurface Result;
};
}

void SurfaceCleaningSettings::Validate() const
{
  const auto require = [](bool right, const char* text)
  {
    if (!right)
    {
      throw std::invalid_argument(text);
    }
  };
  require(this->mergeTolerance >= 0.0 && this->mergeTolerance <= 0.01,
    "the merge tolerance must be between 0 and 0.01");
  require(this->smallestComponent >= 0.0 && this->smallestComponent <= 1.0,
    "the smallest component must be between 0 and 1");
  require(this->joinDistance >= 0.0 && this->joinDistance <= 10.0,
    "the join distance must be between 0 and 10");
  require(this->minimumAngle >= 0.0 && this->minimumAngle <= 0.5236,
    "the minimum angle must be between 0 and 30 degrees");
}

CleanedSurface CleanSurface(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, const SurfaceCleaningSettings& settings,
  const ProgressCallback& progress)
{
  return Cleaner(points, triangles, settings, progress).Run();
}
}
