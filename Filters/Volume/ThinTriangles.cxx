#include "ThinTriangles.h"

#include "NearestOnTriangle.h"

#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace coronary
{
namespace
{
/// Of the surface from where it was, in edge lengths.
constexpr double deviation = 0.05;

class ThinTriangleWork
{
public:
  ThinTriangleWork(SurfaceCells& surface, double minimumAngle, SurfaceCleaningCounts& counts)
    : Surface(surface)
    , MinimumAngle(minimumAngle)
    , Counts(counts)
  {
  }

  /// Works on triangles below the minimum angle, worst first; each change betters the worst around.
  ThinTriangles Improve()
  {
    constexpr int passes = 12;
    Fans fans = this->MakeFans();
    ThinTriangles thin;
    bool any = true;
    for (int pass = 0; pass < passes && any; ++pass)
    {
      any = false;
      std::vector<std::pair<double, std::int64_t>> bad;
      for (std::size_t i = 0; i < this->Surface.cells.size(); ++i)
      {
        const double angle = fans.gone[i] != 0 ? M_PI : this->Surface.Angle(this->Surface.cells[i]);
        if (angle < this->MinimumAngle)
        {
          bad.emplace_back(angle, static_cast<std::int64_t>(i));
        }
      }
      std::sort(bad.begin(), bad.end());
      if (pass == 0 && !bad.empty())
      {
        thin.count = static_cast<std::int64_t>(bad.size());
        thin.worst = this->Surface.Centre(this->Surface.cells[bad[0].second]);
      }
      for (const auto& [angle, cell] : bad)
      {
        any = (fans.gone[cell] == 0 &&
                this->Surface.Angle(this->Surface.cells[cell]) < this->MinimumAngle &&
                this->ImproveCell(fans, cell)) ||
          any;
      }
    }
    this->Surface.Remove(fans.gone);
    return thin;
  }

private:
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
    fans.cells.resize(this->Surface.points.size());
    fans.fixed.assign(this->Surface.points.size(), 0);
    fans.gone.assign(this->Surface.cells.size(), 0);
    for (std::size_t c = 0; c < this->Surface.cells.size(); ++c)
    {
      for (const std::int64_t corner : this->Surface.cells[c].corners)
      {
        fans.cells[corner].push_back(static_cast<std::int64_t>(c));
      }
    }
    const std::vector<TriangleSide> sides = this->Surface.Sides();
    ForEdges(sides,
      [&](std::size_t first, std::size_t size)
      {
        if (size != 2 ||
          this->Surface.cells[sides[first].triangle].cap !=
            this->Surface.cells[sides[first + 1].triangle].cap)
        {
          fans.fixed[sides[first].low] = 1;
          fans.fixed[sides[first].high] = 1;
        }
      });
    return fans;
  }

  /// The triangles of an edge.
  static std::vector<std::int64_t> Common(
    const Fans& fans, const std::vector<SurfaceCell>& cells, std::int64_t a, std::int64_t b)
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
    const Vector3 old = AreaVector(
      this->Surface.At(before[0]), this->Surface.At(before[1]), this->Surface.At(before[2]));
    const Vector3 now = AreaVector(after[0], after[1], after[2]);
    const double angle = MinimumCornerAngle(
      this->Surface.At(before[0]), this->Surface.At(before[1]), this->Surface.At(before[2]));
    const Vector3& reference = angle > 0.035 ? old : mean;
    return now.dot(reference) > most * now.norm() * reference.norm();
  }

  Vector3 MeanNormal(const Fans& fans, std::int64_t point) const
  {
    Vector3 sum = Vector3::Zero();
    for (const std::int64_t c : fans.cells[point])
    {
      sum += this->Surface.Area(this->Surface.cells[c]);
    }
    return sum;
  }

  /// Of the edges at a point.
  double MeanEdge(const Fans& fans, std::int64_t point) const
  {
    double sum = 0.0;
    for (const std::int64_t c : fans.cells[point])
    {
      for (const std::int64_t corner : this->Surface.cells[c].corners)
      {
        sum += (this->Surface.At(corner) - this->Surface.At(point)).norm();
      }
    }
    return sum / static_cast<double>(2 * fans.cells[point].size());
  }

  double WorstAround(const Fans& fans, std::int64_t point) const
  {
    double worst = M_PI;
    for (const std::int64_t c : fans.cells[point])
    {
      worst = std::min(worst, this->Surface.Angle(this->Surface.cells[c]));
    }
    return worst;
  }

  bool TrySwap(Fans& fans, std::int64_t c, int side)
  {
    const Triangle t = this->Surface.cells[c].corners;
    const std::int64_t a = t[side];
    const std::int64_t b = t[(side + 1) % 3];
    const std::int64_t p = t[(side + 2) % 3];
    const std::vector<std::int64_t> common = Common(fans, this->Surface.cells, a, b);
    if (common.size() != 2)
    {
      return false;
    }
    const std::int64_t other = common[0] == c ? common[1] : common[0];
    const Triangle u = this->Surface.cells[other].corners;
    const std::int64_t q = u[0] != a && u[0] != b ? u[0] : u[1] != a && u[1] != b ? u[1] : u[2];
    if (this->Surface.cells[c].cap != this->Surface.cells[other].cap || p == q ||
      !Common(fans, this->Surface.cells, p, q).empty())
    {
      return false;
    }
    const Triangle first{ a, q, p };
    const Triangle second{ q, b, p };
    const auto angle = [&](const Triangle& x)
    {
      return MinimumCornerAngle(
        this->Surface.At(x[0]), this->Surface.At(x[1]), this->Surface.At(x[2]));
    };
    const double before = std::min(angle(t), angle(u));
    if (!(std::min(angle(first), angle(second)) > before + 1e-6))
    {
      return false;
    }
    const Vector3 mean =
      this->Surface.Area(this->Surface.cells[c]) + this->Surface.Area(this->Surface.cells[other]);
    const Vector3 around = this->MeanNormal(fans, p) + this->MeanNormal(fans, q) +
      this->MeanNormal(fans, a) + this->MeanNormal(fans, b);
    for (const Triangle& x : { first, second })
    {
      const Vector3 normal =
        AreaVector(this->Surface.At(x[0]), this->Surface.At(x[1]), this->Surface.At(x[2]));
      const Vector3& reference = angle(t) > 0.035 || angle(u) > 0.035 ? mean : around;
      if (!(normal.dot(reference) > 0.8 * normal.norm() * reference.norm()))
      {
        return false;
      }
    }
    const Vector3 across =
      (this->Surface.At(b) - this->Surface.At(a)).cross(this->Surface.At(q) - this->Surface.At(p));
    if (std::abs(across.dot(this->Surface.At(p) - this->Surface.At(a))) >
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
    this->Surface.cells[c].corners = first;
    this->Surface.cells[other].corners = second;
    return true;
  }

  /// Moves point `from` onto `to`, and so takes out the triangles between them.
  bool TryCollapse(Fans& fans, std::int64_t from, std::int64_t to)
  {
    if (fans.fixed[from] != 0)
    {
      return false;
    }
    const std::vector<std::int64_t> common = Common(fans, this->Surface.cells, from, to);
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
        ring->insert(this->Surface.cells[c].corners.begin(), this->Surface.cells[c].corners.end());
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
      before = std::min(before, this->Surface.Angle(this->Surface.cells[c]));
      if (c == common[0] || c == common[1])
      {
        continue;
      }
      const Triangle& t = this->Surface.cells[c].corners;
      Vector3 moved[3];
      for (int i = 0; i < 3; ++i)
      {
        moved[i] = this->Surface.At(t[i] == from ? to : t[i]);
      }
      if (!this->Keeps(t, moved, mean, 0.7))
      {
        return false;
      }
      after = std::min(after, MinimumCornerAngle(moved[0], moved[1], moved[2]));
      distance = std::min(distance,
        std::sqrt(
          NearestOnTriangle(this->Surface.At(from), moved[0], moved[1], moved[2]).squaredDistance));
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
        for (const std::int64_t corner : this->Surface.cells[c].corners)
        {
          if (corner != from)
          {
            std::vector<std::int64_t>& fan = fans.cells[corner];
            fan.erase(std::find(fan.begin(), fan.end(), c));
          }
        }
        continue;
      }
      for (std::int64_t& corner : this->Surface.cells[c].corners)
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
      centre += this->Surface.Centre(this->Surface.cells[c]) /
        static_cast<double>(fans.cells[point].size());
    }
    const Vector3 place = this->Surface.At(point);
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
        const Triangle& t = this->Surface.cells[c].corners;
        distance = std::min(distance,
          std::sqrt(NearestOnTriangle(
            next, this->Surface.At(t[0]), this->Surface.At(t[1]), this->Surface.At(t[2]))
                      .squaredDistance));
        Vector3 moved[3];
        for (int i = 0; i < 3; ++i)
        {
          moved[i] = t[i] == point ? next : this->Surface.At(t[i]);
        }
        right = right && this->Keeps(t, moved, mean, 0.9);
        after = std::min(after, MinimumCornerAngle(moved[0], moved[1], moved[2]));
      }
      if (right && after > before + 1e-6 && distance < deviation * this->MeanEdge(fans, point))
      {
        this->Surface.points[point] = next;
        return true;
      }
    }
    return false;
  }

  bool ImproveCell(Fans& fans, std::int64_t c)
  {
    const Triangle t = this->Surface.cells[c].corners;
    std::array<int, 3> order{ 0, 1, 2 };
    const auto length = [&](int side)
    { return (this->Surface.At(t[side]) - this->Surface.At(t[(side + 1) % 3])).norm(); };
    std::sort(order.begin(), order.end(), [&](int i, int j) { return length(i) < length(j); });
    // A needle has one short edge; a cap's longest one is as long as the others together.
    if (length(order[0]) < 0.35 * length(order[2]))
    {
      const std::int64_t a = t[order[0]];
      const std::int64_t b = t[(order[0] + 1) % 3];
      if (this->TryCollapse(fans, a, b) || this->TryCollapse(fans, b, a))
      {
        ++this->Counts.edgeCollapses;
        return true;
      }
    }
    if (this->TrySwap(fans, c, order[2]) || this->TrySwap(fans, c, order[1]))
    {
      ++this->Counts.edgeSwaps;
      return true;
    }
    bool moved = false;
    for (const std::int64_t corner : t)
    {
      if (this->TryMove(fans, corner))
      {
        ++this->Counts.pointMoves;
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
          (this->Surface.At(corner) - this->Surface.At(other)).norm() < 0.8 * length(order[2]) &&
          this->TryCollapse(fans, corner, other))
        {
          ++this->Counts.edgeCollapses;
          return true;
        }
      }
    }
    return false;
  }

  SurfaceCells& Surface;
  double MinimumAngle;
  SurfaceCleaningCounts& Counts;
};
}

ThinTriangles ImproveThinTriangles(
  SurfaceCells& surface, double minimumAngle, SurfaceCleaningCounts& counts)
{
  return ThinTriangleWork(surface, minimumAngle, counts).Improve();
}
}
