#include "SurfaceCleaning.h"

#include "DisjointSets.h"
#include "Require.h"
#include "SurfaceCheck.h"
#include "SurfaceRims.h"
#include "ThinTriangles.h"
#include "TriangleBvh.h"
#include "TriangleIntersections.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

namespace coronary
{
namespace
{
constexpr int mostRounds = 14;
constexpr int foldRounds = 6;        ///< of these, also folds are taken out
constexpr double foldCosine = -0.95; ///< of the angle between neighbours' normals: folded over

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
    this->DropSmallComponents(this->Settings.minimumComponentShare, true);
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
    this->DropSmallComponents(this->Settings.minimumComponentShare, true);
    this->Orient(false);
    this->Finish();
    this->Step(1.0);
    return std::move(this->Result);
  }

private:
  void Step(double fraction) const { Report(this->Progress, fraction); }

  void Say(const std::string& what, const Vector3& where)
  {
    this->Result.repairs.push_back(what + ", the first at " + Describe(where));
  }

  void Read()
  {
    CheckCorners(this->InputPoints, this->InputTriangles);
    for (std::size_t i = 0; i < this->InputTriangles.size(); ++i)
    {
      this->Surface.cells.push_back(
        { this->InputTriangles[i], static_cast<std::int64_t>(i), 0, false });
    }
    this->Surface.points = this->InputPoints;
    this->Surface.source.resize(this->Surface.points.size());
    std::iota(this->Surface.source.begin(), this->Surface.source.end(), 0);
    if (this->Surface.cells.empty())
    {
      throw std::invalid_argument("the surface is empty: it has no triangles");
    }
  }

  void MergePoints()
  {
    std::vector<char> used(this->Surface.points.size(), 0);
    Vector3 low = this->Surface.At(this->Surface.cells[0].corners[0]);
    Vector3 high = low;
    for (const SurfaceCell& cell : this->Surface.cells)
    {
      for (const std::int64_t corner : cell.corners)
      {
        used[corner] = 1;
        low = low.cwiseMin(this->Surface.At(corner));
        high = high.cwiseMax(this->Surface.At(corner));
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
        entries.push_back({ boxOf(this->Surface.points[i]), static_cast<std::int64_t>(i) });
      }
    }
    std::sort(entries.begin(), entries.end());
    DisjointSets sets(this->Surface.points.size());
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
              (this->Surface.At(other->point) - this->Surface.At(entry.point)).norm() <= tolerance)
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
        where = this->Result.counts.mergedPoints++ == 0 ? this->Surface.At(point) : where;
      }
    }
    for (SurfaceCell& cell : this->Surface.cells)
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
    this->Surface.Keep(
      [&](const SurfaceCell& cell)
      {
        const Triangle& t = cell.corners;
        const bool degenerate = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
        if (degenerate)
        {
          where = count++ == 0 ? this->Surface.At(t[0]) : where;
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
    this->Surface.Keep(
      [&](const SurfaceCell& cell)
      {
        Triangle sorted = cell.corners;
        std::sort(sorted.begin(), sorted.end());
        const bool fresh = seen.insert(sorted).second;
        if (!fresh)
        {
          where = count++ == 0 ? this->Surface.Centre(cell) : where;
        }
        return fresh;
      });
    if (count > 0)
    {
      this->Say(Count(count, "doubled triangle", "doubled triangles") + " left out", where);
    }
  }

  void CutNonManifoldEdges()
  {
    const std::vector<TriangleSide> sides = this->Surface.Sides();
    std::vector<char> bad(this->Surface.cells.size(), 0);
    std::int64_t& count = this->Result.counts.nonManifoldEdges;
    Vector3 where = Vector3::Zero();
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        if (size > 2)
        {
          where = count++ == 0 ? this->Surface.At(sides[first].low) : where;
          for (std::size_t i = first; i < first + size; ++i)
          {
            bad[sides[i].triangle] = 1;
          }
        }
      });
    if (count > 0)
    {
      this->Say(Count(count, "edge", "edges") + " of more than two triangles cut open", where);
      this->Surface.Remove(bad);
    }
  }

  static bool Runs(const Triangle& t, std::int64_t a, std::int64_t b)
  {
    return (t[0] == a && t[1] == b) || (t[1] == a && t[2] == b) || (t[2] == a && t[0] == b);
  }

  /// Makes neighbours agree; what can not be oriented is cut open. Then outwards.
  void Orient(bool first)
  {
    const std::vector<std::int64_t> neighbours = this->Surface.Neighbours();
    std::vector<std::int64_t> component(this->Surface.cells.size(), -1);
    std::vector<char> flip(this->Surface.cells.size(), 0);
    std::vector<char> bad(this->Surface.cells.size(), 0);
    std::int64_t count = 0;
    std::vector<std::int64_t> queue;
    std::int64_t conflicts = 0;
    Vector3 conflictAt = Vector3::Zero();
    for (std::size_t seed = 0; seed < this->Surface.cells.size(); ++seed)
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
        const Triangle& t = this->Surface.cells[cell].corners;
        for (int i = 0; i < 3; ++i)
        {
          const std::int64_t next = neighbours[3 * cell + i];
          if (next < 0)
          {
            continue;
          }
          const bool disagree = Runs(this->Surface.cells[next].corners, t[i], t[(i + 1) % 3]);
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
            conflictAt =
              conflicts++ == 0 ? this->Surface.Centre(this->Surface.cells[next]) : conflictAt;
          }
        }
      }
    }
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      if (flip[i] != 0)
      {
        std::swap(this->Surface.cells[i].corners[1], this->Surface.cells[i].corners[2]);
      }
    }
    if (conflicts > 0)
    {
      this->Result.counts.nonManifoldEdges += conflicts;
      this->Say("the surface has one side only and was cut open at " +
          Count(conflicts, "triangle", "triangles"),
        conflictAt);
      this->Surface.Remove(bad);
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
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      const SurfaceCell& cell = this->Surface.cells[i];
      const std::int64_t c = component[i];
      if (known[c] == 0)
      {
        origin[c] = this->Surface.At(cell.corners[0]);
        known[c] = 1;
      }
      const Vector3 normal = this->Surface.Area(cell);
      volume[c] += normal.dot(this->Surface.Centre(cell) - origin[c]) / 3.0;
      area[c] += normal.norm();
      if (cell.source >= 0)
      {
        turned[c] += normal.norm() * (this->IsTurned(cell) ? 1.0 : -1.0);
      }
    }
    // Open ones are closed by a fan over each rim.
    for (const SurfaceRim& rim : FindRims(this->Surface))
    {
      const std::int64_t c = component[rim.cells[0]];
      for (std::size_t i = 0; i < rim.points.size(); ++i)
      {
        const Vector3& a = this->Surface.At(rim.points[i]);
        const Vector3& b = this->Surface.At(rim.points[(i + 1) % rim.points.size()]);
        volume[c] += AreaVector(a, b, rim.centre).dot(a - origin[c]) / 3.0;
      }
    }
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      const std::int64_t c = component[i];
      const bool flat = std::abs(volume[c]) < 1e-4 * std::pow(area[c], 1.5);
      if (flat ? turned[c] > 0.0 : volume[c] < 0.0)
      {
        std::swap(this->Surface.cells[i].corners[1], this->Surface.cells[i].corners[2]);
      }
    }
  }

  bool IsTurned(const SurfaceCell& cell) const
  {
    // Corners may be other points by now: what counts is where the triangle looks.
    const Triangle& t = this->InputTriangles[cell.source];
    return AreaVector(this->InputPoints[t[0]], this->InputPoints[t[1]], this->InputPoints[t[2]])
             .dot(this->Surface.Area(cell)) < 0.0;
  }

  /// A point where several fans of triangles touch becomes one for each, a little apart.
  void SplitPinches(bool first)
  {
    std::vector<std::vector<std::int64_t>> fans(this->Surface.points.size());
    for (std::size_t c = 0; c < this->Surface.cells.size(); ++c)
    {
      for (const std::int64_t corner : this->Surface.cells[c].corners)
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
          for (const std::int64_t corner : this->Surface.cells[cell].corners)
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
            const Triangle& t = this->Surface.cells[left[i]].corners;
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
        where = count++ == 0 ? this->Surface.At(point) : where;
        Vector3 mean = Vector3::Zero();
        for (const std::int64_t corner : rim)
        {
          mean += this->Surface.At(corner) / static_cast<double>(rim.size());
        }
        const auto fresh = static_cast<std::int64_t>(this->Surface.points.size());
        this->Surface.points.emplace_back(
          this->Surface.At(point) + 0.05 * (mean - this->Surface.At(point)));
        this->Surface.source.push_back(this->Surface.source[point]);
        for (const std::int64_t cell : fan)
        {
          for (std::int64_t& corner : this->Surface.cells[cell].corners)
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
    const std::vector<std::int64_t> component = this->Surface.Components(count);
    std::vector<double> area(count, 0.0);
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      area[component[i]] += this->Surface.Area(this->Surface.cells[i]).norm();
    }
    if (area.empty())
    {
      return;
    }
    const double minimum = part * *std::max_element(area.begin(), area.end());
    std::vector<char> bad(this->Surface.cells.size(), 0);
    std::vector<char> small(count, 0);
    Vector3 where = Vector3::Zero();
    std::int64_t dropped = 0;
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      if (area[component[i]] < minimum)
      {
        bad[i] = 1;
        if (small[component[i]] == 0)
        {
          small[component[i]] = 1;
          where = dropped++ == 0 ? this->Surface.Centre(this->Surface.cells[i]) : where;
        }
      }
    }
    if (dropped == 0)
    {
      return;
    }
    this->Surface.Remove(bad);
    if (counted)
    {
      this->Result.counts.smallComponents += dropped;
      this->Say(Count(dropped, "small component", "small components") + " left out", where);
    }
  }

  double Winding(const std::vector<SurfaceCell>& cells, const Vector3& p) const
  {
    double sum = 0.0;
    for (const SurfaceCell& cell : cells)
    {
      sum += SolidAngle(p, this->Surface.At(cell.corners[0]), this->Surface.At(cell.corners[1]),
        this->Surface.At(cell.corners[2]));
    }
    return sum / (4.0 * M_PI);
  }

  /**
   * Which components lie inside the given surface: their outer side is where it winds around
   * already. The component with the largest area never does.
   */
  std::vector<char> InnerComponents(const std::vector<std::int64_t>& component, std::int64_t count,
    const std::vector<SurfaceCell>& surface) const
  {
    constexpr std::size_t samples = 9;
    std::vector<double> area(count, 0.0);
    std::vector<std::vector<std::int64_t>> members(count);
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      area[component[i]] += this->Surface.Area(this->Surface.cells[i]).norm();
      members[component[i]].push_back(static_cast<std::int64_t>(i));
    }
    std::vector<char> inner(count, 0);
    if (count < 2)
    {
      return inner;
    }
    const std::int64_t maximum = std::max_element(area.begin(), area.end()) - area.begin();
    ParallelFor(count, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t c = first; c < last; ++c)
        {
          if (c == maximum)
          {
            continue;
          }
          std::size_t inside = 0;
          const std::size_t taken = std::min(samples, members[c].size());
          for (std::size_t s = 0; s < taken; ++s)
          {
            const SurfaceCell& cell =
              this->Surface.cells[members[c][(2 * s + 1) * members[c].size() / (2 * taken)]];
            const Vector3 normal = this->Surface.Area(cell);
            const Vector3 p = this->Surface.Centre(cell) +
              1e-3 * normal / std::sqrt(std::max(normal.norm(), 1e-300));
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
    const std::vector<std::int64_t> component = this->Surface.Components(count);
    const std::vector<char> inner = this->InnerComponents(component, count, this->Surface.cells);
    std::vector<char> bad(this->Surface.cells.size(), 0);
    Vector3 where = Vector3::Zero();
    bool any = false;
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      bad[i] = inner[component[i]];
      if (bad[i] != 0 && !any)
      {
        any = true;
        where = this->Surface.Centre(this->Surface.cells[i]);
      }
    }
    if (any)
    {
      const auto dropped = std::count(inner.begin(), inner.end(), 1);
      this->Result.counts.innerComponents += dropped;
      this->Say(Count(dropped, "component", "components") + " inside of others left out", where);
      this->Surface.Remove(bad);
    }
  }

  /// Closes what is open, and says so.
  void CloseRims()
  {
    const ClosedRims closed = coronary::CloseRims(this->Surface, this->Settings);
    SurfaceCleaningCounts& counts = this->Result.counts;
    counts.joinedEnds = closed.joined;
    counts.filledHoles = closed.holes;
    counts.caps = closed.caps;
    if (closed.joined > 0)
    {
      this->Say(Count(closed.joined, "pair", "pairs") + " of ends that face each other joined",
        closed.joinedAt);
    }
    if (closed.holes > 0)
    {
      this->Say(Count(closed.holes, "hole", "holes") + " filled", closed.holeAt);
    }
    if (closed.caps > 0)
    {
      this->Say(Count(closed.caps, "open end", "open ends") + " closed by a cap", closed.capAt);
    }
  }

  void Improve(bool first)
  {
    const ThinTriangles thin =
      ImproveThinTriangles(this->Surface, this->Settings.minimumAngle, this->Result.counts);
    if (first && thin.count > 0)
    {
      this->Result.counts.badTriangles = thin.count;
      this->Say(Count(thin.count, "thin triangle", "thin triangles") + " worked on", thin.worst);
    }
  }

  /// Triangles that cut others, are at edges of more than two, or (on request) folded over.
  std::vector<char> Offenders(
    std::int64_t& count, DisjointSets& zones, Vector3& where, bool folds = false) const
  {
    std::vector<char> bad(this->Surface.cells.size(), 0);
    std::vector<Triangle> triangles;
    triangles.reserve(this->Surface.cells.size());
    for (const SurfaceCell& cell : this->Surface.cells)
    {
      triangles.push_back(cell.corners);
    }
    count = 0;
    for (const auto& [s, t] : FindSelfIntersections(this->Surface.points, triangles))
    {
      where = count++ == 0 ? this->Surface.Centre(this->Surface.cells[s]) : where;
      bad[s] = 1;
      bad[t] = 1;
      zones.Join(triangles[s][0], triangles[t][0]);
    }
    const std::vector<TriangleSide> sides = this->Surface.Sides();
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        bool wrong = size > 2;
        if (size == 2 && folds)
        {
          const Vector3 one = this->Surface.Area(this->Surface.cells[sides[first].triangle]);
          const Vector3 other = this->Surface.Area(this->Surface.cells[sides[first + 1].triangle]);
          wrong = one.dot(other) < foldCosine * one.norm() * other.norm();
        }
        for (std::size_t i = first; wrong && i < first + size; ++i)
        {
          where =
            count++ == 0 ? this->Surface.Centre(this->Surface.cells[sides[i].triangle]) : where;
          bad[sides[i].triangle] = 1;
        }
      });
    return bad;
  }

  void CountIntersections()
  {
    Vector3 where = Vector3::Zero();
    DisjointSets zones(this->Surface.points.size());
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
      DisjointSets zones(this->Surface.points.size());
      std::vector<char> bad = this->Offenders(count, zones, where, round < foldRounds);
      if (count == 0)
      {
        return;
      }
      this->Grow(bad, round / 2);
      const std::vector<SurfaceCell> before = this->Surface.cells;
      std::vector<char> touched(this->Surface.points.size(), 0);
      for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
      {
        if (bad[i] != 0)
        {
          const Triangle& t = this->Surface.cells[i].corners;
          zones.Join(t[0], t[1]);
          zones.Join(t[0], t[2]);
          touched[t[0]] = touched[t[1]] = touched[t[2]] = 1;
        }
      }
      this->Surface.Remove(bad);
      std::vector<char> kinds(this->Surface.points.size(), 0);
      this->DropInnerParts(before, touched, zones, kinds);
      for (std::size_t i = 0; i < before.size(); ++i)
      {
        if (bad[i] != 0)
        {
          kinds[zones.Find(before[i].corners[0])] |= static_cast<char>(
            (before[i].band ? overlappingZone : 0) | (before[i].cap > 0 ? cappedZone : 0));
        }
      }
      std::vector<std::int64_t> zoneOf(this->Surface.points.size(), -1);
      for (std::size_t i = 0; i < zoneOf.size(); ++i)
      {
        if (touched[i] != 0)
        {
          zoneOf[i] = zones.Find(static_cast<std::int64_t>(i));
        }
      }
      const std::size_t known = zoneOf.size();
      this->SplitPinches(false);
      for (std::size_t i = known; i < this->Surface.points.size(); ++i)
      {
        zoneOf.push_back(-1);
      }
      coronary::CloseRims(this->Surface, this->Settings, kinds, zoneOf);
    }
  }

  void Grow(std::vector<char>& bad, int rings) const
  {
    std::vector<char> marked(this->Surface.points.size(), 0);
    // A cap is whole or gone.
    std::vector<char> cap(static_cast<std::size_t>(this->Surface.caps) + 1, 0);
    for (int ring = 0; ring <= rings; ++ring)
    {
      for (std::size_t i = 0; i < bad.size(); ++i)
      {
        cap[this->Surface.cells[i].cap] |= bad[i];
      }
      for (std::size_t i = 0; i < bad.size(); ++i)
      {
        bad[i] |=
          static_cast<char>(this->Surface.cells[i].cap > 0 && cap[this->Surface.cells[i].cap] != 0);
        if (bad[i] != 0)
        {
          for (const std::int64_t corner : this->Surface.cells[i].corners)
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
        const Triangle& t = this->Surface.cells[i].corners;
        bad[i] |= static_cast<char>(marked[t[0]] | marked[t[1]] | marked[t[2]]);
      }
    }
  }

  void DropInnerParts(const std::vector<SurfaceCell>& before, const std::vector<char>& touched,
    DisjointSets& zones, std::vector<char>& kinds)
  {
    this->DropSmallComponents(1e-3 * this->Settings.minimumComponentShare, false);
    std::int64_t count = 0;
    const std::vector<std::int64_t> component = this->Surface.Components(count);
    const std::vector<char> inner = this->InnerComponents(component, count, before);
    std::vector<char> bad(this->Surface.cells.size(), 0);
    std::vector<std::int64_t> last(count, -1);
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      bad[i] = inner[component[i]];
      for (const std::int64_t corner : this->Surface.cells[i].corners)
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
    this->Surface.Remove(bad);
  }

  void Finish()
  {
    CleanedSurface& result = this->Result;
    if (this->Surface.cells.empty())
    {
      result.warnings.emplace_back("nothing is left of the surface");
      return;
    }
    SurfaceCleaningCounts& counts = result.counts;
    std::int64_t offenders = 0;
    Vector3 where = Vector3::Zero();
    DisjointSets zones(this->Surface.points.size());
    this->Offenders(offenders, zones, where);
    counts.remainingIntersections = offenders;
    if (offenders > 0 && this->Settings.resolveIntersections)
    {
      result.warnings.push_back(Count(offenders, "pair", "pairs") +
        " of triangles still cut each other, the first at " + Describe(where));
    }
    const std::vector<TriangleSide> sides = this->Surface.Sides();
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        if (size == 1)
        {
          where = counts.openEdges++ == 0 ? this->Surface.At(sides[first].low) : where;
        }
      });
    if (counts.openEdges > 0 && this->Settings.fillHoles && this->Settings.capEnds)
    {
      result.warnings.push_back(Count(counts.openEdges, "edge is", "edges are") +
        " still open, the first at " + Describe(where));
    }
    for (const SurfaceCell& cell : this->Surface.cells)
    {
      counts.remainingBadTriangles +=
        this->Surface.Angle(cell) < this->Settings.minimumAngle ? 1 : 0;
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
    std::vector<double> area(static_cast<std::size_t>(this->Surface.caps) + 1, 0.0);
    for (const SurfaceCell& cell : this->Surface.cells)
    {
      area[cell.cap] += this->Surface.Area(cell).norm();
    }
    std::vector<int> order(this->Surface.caps);
    std::iota(order.begin(), order.end(), 1);
    std::stable_sort(order.begin(), order.end(), [&](int i, int j) { return area[i] > area[j]; });
    std::vector<int> number(area.size(), 0);
    int used = 0;
    for (const int cap : order)
    {
      number[cap] = area[cap] > 0.0 ? ++used : 0;
    }
    for (SurfaceCell& cell : this->Surface.cells)
    {
      cell.cap = number[cell.cap];
    }
    this->Result.counts.caps = used;
  }

  void NumberComponents()
  {
    std::int64_t count = 0;
    const std::vector<std::int64_t> component = this->Surface.Components(count);
    std::vector<double> area(count, 0.0);
    for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
    {
      area[component[i]] += this->Surface.Area(this->Surface.cells[i]).norm();
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
    std::vector<std::int64_t> number(this->Surface.points.size(), -1);
    for (const SurfaceCell& cell : this->Surface.cells)
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
      result.points.push_back(this->Surface.points[i]);
      result.sourcePoint.push_back(this->Surface.source[i]);
      if (this->Surface.source[i] >= 0)
      {
        result.maximumDisplacement = std::max(result.maximumDisplacement,
          (this->Surface.points[i] - this->InputPoints[this->Surface.source[i]]).norm());
      }
    }
    const TriangleBvh tree(this->InputPoints, this->InputTriangles);
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
    for (const SurfaceCell& cell : this->Surface.cells)
    {
      result.triangles.push_back(
        { number[cell.corners[0]], number[cell.corners[1]], number[cell.corners[2]] });
      result.sourceCell.push_back(cell.source);
      result.cap.push_back(cell.cap);
      result.nearestCell.push_back(
        cell.source >= 0 ? cell.source : tree.Closest(this->Surface.Centre(cell)).triangle);
    }
  }

  const std::vector<Vector3>& InputPoints;
  const std::vector<Triangle>& InputTriangles;
  const SurfaceCleaningSettings& Settings;
  const ProgressCallback& Progress;
  SurfaceCells Surface;
  CleanedSurface Result;
};
}

void SurfaceCleaningSettings::Validate() const
{
  Require(this->mergeTolerance >= 0.0 && this->mergeTolerance <= 0.01,
    "the merge tolerance must be between 0 and 0.01");
  Require(this->minimumComponentShare >= 0.0 && this->minimumComponentShare <= 1.0,
    "the smallest component must be between 0 and 1");
  Require(this->joinDistance >= 0.0 && this->joinDistance <= 10.0,
    "the join distance must be between 0 and 10");
  Require(this->minimumAngle >= 0.0 && this->minimumAngle <= 0.5236,
    "the minimum angle must be between 0 and 30 degrees");
}

CleanedSurface CleanSurface(const std::vector<Vector3>& points,
  const std::vector<Triangle>& triangles, const SurfaceCleaningSettings& settings,
  const ProgressCallback& progress)
{
  return Cleaner(points, triangles, settings, progress).Run();
}
}
