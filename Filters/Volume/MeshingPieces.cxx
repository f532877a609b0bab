#include "MeshingPieces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>

namespace coronary
{
namespace
{
using Edge = std::pair<std::int64_t, std::int64_t>;

/// A skeleton's point so far outside, in local radii, is put on the surface: ends of centerlines are
/// not exactly on the caps.
constexpr double endTolerance = 0.1;
/// An end so far below the wall, in edge lengths of it, is put on it too: the tetrahedra between would
/// be flat, and refinement does not help where the wall has to stay.
constexpr double endDepth = 0.1;
double Sized(const MeshingPiece& piece, std::int64_t a, std::int64_t b)
{
  return (piece.points[a] - piece.points[b]).norm();
}

/**
 * Puts a point into the surface where it is nearest; returns the point's number.
 * @param tolerance  how far the surface may move, mm
 * @param reach      how far the point may move to one of the surface's, mm
 */
std::int64_t InsertIntoSurface(
  MeshingPiece& piece, const Vector3& p, double tolerance, double reach)
{
  std::int64_t nearest = 0;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < piece.triangles.size(); ++i)
  {
    const Triangle& t = piece.triangles[i];
    const double distance =
      NearestOnTriangle(p, piece.points[t[0]], piece.points[t[1]], piece.points[t[2]])
        .squaredDistance;
    if (distance < best)
    {
      best = distance;
      nearest = static_cast<std::int64_t>(i);
    }
  }
  const Triangle found = piece.triangles[nearest];
  const auto normal = [&](const Triangle& t)
  {
    const Vector3& a = piece.points[t[0]];
    return Vector3((piece.points[t[1]] - a).cross(piece.points[t[2]] - a));
  };
  const double longest = std::max({ Sized(piece, found[0], found[1]),
    Sized(piece, found[1], found[2]), Sized(piece, found[2], found[0]) });
  for (const std::int64_t corner : found)
  {
    const double distance = (piece.points[corner] - p).norm();
    if (piece.skeletonPoint[corner] >= 0)
    {
      continue;
    }
    if (distance <= tolerance)
    {
      return corner;
    }
    if (distance > 0.25 * longest)
    {
      continue;
    }
    // In the middle of a plane part, as a cap, the point can be shifted and the surface is the same,
    // or changes by less than the tolerance.
    bool movable = true;
    const Vector3 before = piece.points[corner];
    for (const Triangle& t : piece.triangles)
    {
      if (t[0] != corner && t[1] != corner && t[2] != corner)
      {
        continue;
      }
      const Vector3 plane = normal(t).normalized();
      movable = movable && std::abs(plane.dot(p - before)) <= tolerance &&
        plane.dot(normal(found).normalized()) > 0.9;
      if (movable)
      {
        const double area = normal(t).norm();
        piece.points[corner] = p;
        movable = normal(t).dot(plane) > 0.3 * area;
        piece.points[corner] = before;
      }
    }
    if (movable)
    {
      piece.points[corner] = p;
      return corner;
    }
  }
  for (const std::int64_t corner : found)
  {
    if (piece.skeletonPoint[corner] < 0 &&
      (piece.points[corner] - p).norm() <= std::min(reach, 0.1 * longest))
    {
      return corner;
    }
  }
  const auto fresh = static_cast<std::int64_t>(piece.points.size());
  piece.points.push_back(p);
  piece.surfacePoint.push_back(-1);
  piece.skeletonPoint.push_back(-1);
  const auto replace = [&](std::int64_t triangle, const std::vector<Triangle>& parts)
  {
    piece.triangles[triangle] = parts[0];
    for (std::size_t i = 1; i < parts.size(); ++i)
    {
      piece.triangles.push_back(parts[i]);
      piece.sourceCell.push_back(piece.sourceCell[triangle]);
    }
  };
  for (int i = 0; i < 3; ++i)
  {
    const std::int64_t a = found[i];
    const std::int64_t b = found[(i + 1) % 3];
    const double length = Sized(piece, a, b);
    const double height =
      (piece.points[b] - piece.points[a]).cross(p - piece.points[a]).norm() / length;
    if (height > 0.15 * length)
    {
      continue;
    }
    for (std::size_t k = 0, count = piece.triangles.size(); k < count; ++k)
    {
      const Triangle t = piece.triangles[k];
      for (int j = 0; j < 3; ++j)
      {
        const std::int64_t u = t[j];
        const std::int64_t v = t[(j + 1) % 3];
        if ((u == a && v == b) || (u == b && v == a))
        {
          const std::int64_t w = t[(j + 2) % 3];
          replace(
            static_cast<std::int64_t>(k), { Triangle{ u, fresh, w }, Triangle{ fresh, v, w } });
        }
      }
    }
    return fresh;
  }
  replace(nearest,
    { Triangle{ found[0], found[1], fresh }, Triangle{ found[1], found[2], fresh },
      Triangle{ found[2], found[0], fresh } });
  return fresh;
}

bool Crosses(
  const Vector3& p, const Vector3& q, const Vector3& a, const Vector3& b, const Vector3& c)
{
  const Vector3 normal = (b - a).cross(c - a);
  const double from = normal.dot(p - a);
  const double to = normal.dot(q - a);
  if ((from > 0.0) == (to > 0.0) && from != 0.0 && to != 0.0)
  {
    return false;
  }
  if (from == to)
  {
    return false;
  }
  const Vector3 x = p + (q - p) * (from / (from - to));
  const double tolerance = -1e-9 * normal.squaredNorm();
  return normal.dot((b - a).cross(x - a)) >= tolerance &&
    normal.dot((c - b).cross(x - b)) >= tolerance && normal.dot((a - c).cross(x - c)) >= tolerance;
}
}

std::string Millimetres(double value)
{
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", value);
  return text;
}

LocalRadius::LocalRadius(const TetrahedralMeshInput& input, const ClosedSurface& surface)
  : Points(input.skeletonPoints)
  , Radius(input.skeletonRadius)
{
  if (!this->Radius.empty())
  {
    for (const auto& [a, b] : input.skeletonEdges)
    {
      this->Segments.push_back({ a, b, b });
    }
    for (std::size_t i = 0; i < this->Points.size() && this->Segments.empty(); ++i)
    {
      const auto point = static_cast<std::int64_t>(i);
      this->Segments.push_back({ point, point, point });
    }
  }
  this->Tree = TriangleBvh(this->Points, this->Segments);
  double volume = 0.0;
  double area = 0.0;
  for (const double v : surface.volume)
  {
    volume += v;
  }
  for (const Triangle& t : surface.triangles)
  {
    const Vector3& a = surface.points[t[0]];
    area += 0.5 * (surface.points[t[1]] - a).cross(surface.points[t[2]] - a).norm();
  }
  this->Mean = 2.0 * volume / area;
}

double LocalRadius::At(const Vector3& p) const
{
  const TriangleBvh::Nearest nearest = this->Tree.Closest(p);
  if (nearest.triangle < 0)
  {
    return this->Mean;
  }
  const Triangle& s = this->Segments[nearest.triangle];
  const double length = (this->Points[s[1]] - this->Points[s[0]]).norm();
  const double t =
    length > 0.0 ? std::min(1.0, (nearest.point - this->Points[s[0]]).norm() / length) : 0.0;
  return (1.0 - t) * this->Radius[s[0]] + t * this->Radius[s[1]];
}

namespace
{
/// Puts the skeleton into the pieces of a surface.
class PieceMaker
{
public:
  PieceMaker(const TetrahedralMeshInput& input, const TetrahedralMeshSettings& settings,
    const ClosedSurface& surface, const LocalRadius& radii)
    : Input(input)
    , Settings(settings)
    , Surface(surface)
    , Radii(radii)
  {
  }

  MeshingPieces Run()
  {
    this->SplitSurface();
    this->RefuseNested();
    this->FindPlaces();
    this->PutOnWall();
    this->SetSizes();
    this->AddEdges();
    return std::move(this->Made);
  }

private:
  /// Where a skeleton point is.
  struct Place
  {
    int piece = -1;          ///< -1: nowhere, -2: at the skeleton point `point`
    std::int64_t point = -1; ///< of the piece
  };

  void SplitSurface()
  {
    const std::size_t count = this->Surface.volume.size();
    this->Made.pieces.assign(count, {});
    Vector3 low = this->Surface.points[0];
    Vector3 high = low;
    for (const Vector3& p : this->Surface.points)
    {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    this->Made.origin = 0.5 * (low + high);
    std::vector<std::int64_t> number(this->Surface.points.size(), -1);
    for (std::size_t i = 0; i < this->Surface.triangles.size(); ++i)
    {
      MeshingPiece& piece = this->Made.pieces[this->Surface.component[i]];
      Triangle t = this->Surface.triangles[i];
      for (std::int64_t& corner : t)
      {
        if (number[corner] < 0)
        {
          number[corner] = static_cast<std::int64_t>(piece.points.size());
          piece.points.emplace_back(this->Surface.points[corner] - this->Made.origin);
          piece.surfacePoint.push_back(this->Surface.sourcePoint[corner]);
          piece.skeletonPoint.push_back(-1);
        }
        corner = number[corner];
      }
      piece.triangles.push_back(t);
      piece.sourceCell.push_back(static_cast<std::int64_t>(i));
    }
  }

  void RefuseNested()
  {
    const std::size_t count = this->Made.pieces.size();
    for (const MeshingPiece& piece : this->Made.pieces)
    {
      this->Trees.emplace_back(piece.points, piece.triangles);
    }
    for (std::size_t i = 0; i < count; ++i)
    {
      for (std::size_t j = 0; j < count; ++j)
      {
        if (i != j && this->Trees[j].Winding(this->Made.pieces[i].points[0]) != 0)
        {
          const std::int64_t cell = this->Made.pieces[i].sourceCell[0];
          throw SurfaceError("a part of the surface lies inside another one: that with " +
              DescribeCells({ cell }, this->Made.pieces[i].points[0] + this->Made.origin),
            { cell });
        }
      }
    }
  }

  /// The piece that each point is in or on; what is inside becomes a point of it.
  void FindPlaces()
  {
    const std::vector<Vector3>& points = this->Input.skeletonPoints;
    // Points of edges only; a skeleton without edges is a set of points.
    std::vector<char> used(points.size(), this->Input.skeletonEdges.empty() ? 1 : 0);
    for (const auto& [a, b] : this->Input.skeletonEdges)
    {
      used[a] = 1;
      used[b] = 1;
    }
    this->Places.resize(points.size());
    std::map<std::array<double, 3>, std::size_t> first;
    this->IsEnd = this->SkeletonEnds();
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      const auto [same, isNew] = first.try_emplace({ points[i][0], points[i][1], points[i][2] }, i);
      if (used[i] == 0)
      {
        if (isNew)
        {
          first.erase(same);
        }
        continue;
      }
      if (!isNew)
      {
        this->Places[i] = { -2, static_cast<std::int64_t>(same->second) };
        continue;
      }
      const Vector3 p = points[i] - this->Made.origin;
      const double radius = this->RadiusAt(i);
      TriangleBvh::Nearest nearest;
      for (std::size_t k = 0; k < this->Trees.size(); ++k)
      {
        const TriangleBvh::Nearest found = this->Trees[k].Closest(p);
        if (nearest.triangle < 0 || found.distance < nearest.distance)
        {
          nearest = found;
          this->Places[i].piece = static_cast<int>(k);
        }
      }
      if (nearest.distance <= 0.01 * radius)
      {
        this->OnWall.emplace_back(i, p);
        continue;
      }
      if (this->IsEnd[i] != 0 && nearest.distance <= endTolerance * radius &&
        nearest.distance <=
          endDepth * LongestSide(this->Made.pieces[this->Places[i].piece], nearest.triangle))
      {
        this->OnWall.emplace_back(i, nearest.point);
        continue;
      }
      const int nearestPiece = this->Places[i].piece;
      this->Places[i].piece = -1;
      for (std::size_t k = 0; k < this->Trees.size(); ++k)
      {
        if (this->Trees[k].Winding(p) != 0)
        {
          this->Places[i].piece = static_cast<int>(k);
        }
      }
      if (this->Places[i].piece < 0 && nearest.distance <= endTolerance * radius)
      {
        this->Places[i].piece = nearestPiece;
        this->OnWall.emplace_back(i, nearest.point);
        continue;
      }
      if (this->Places[i].piece < 0)
      {
        if (this->Settings.outside == OutsidePolicy::Refuse)
        {
          throw std::invalid_argument("skeleton point " + std::to_string(i) + " at " +
            Describe(points[i]) + " lies " + Millimetres(nearest.distance) +
            " outside of the surface");
        }
        ++this->Outside;
        continue;
      }
      MeshingPiece& piece = this->Made.pieces[this->Places[i].piece];
      this->Places[i].point = static_cast<std::int64_t>(piece.points.size());
      piece.points.push_back(p);
      piece.surfacePoint.push_back(-1);
      piece.skeletonPoint.push_back(static_cast<std::int64_t>(i));
    }
  }

  /// Points on the wall become points of its triangles.
  void PutOnWall()
  {
    std::size_t shifted = 0;
    double shift = 0.0;
    for (const auto& [i, place] : this->OnWall)
    {
      MeshingPiece& piece = this->Made.pieces[this->Places[i].piece];
      const double radius = this->RadiusAt(i);
      this->Places[i].point = InsertIntoSurface(
        piece, place, 0.01 * radius, this->IsEnd[i] != 0 ? endTolerance * radius : 0.01 * radius);
      piece.skeletonPoint[this->Places[i].point] = static_cast<std::int64_t>(i);
      const double moved =
        (piece.points[this->Places[i].point] + this->Made.origin - this->Input.skeletonPoints[i])
          .norm();
      if (moved > 0.01 * radius)
      {
        ++shifted;
        shift = std::max(shift, moved);
      }
    }
    for (Place& place : this->Places)
    {
      if (place.piece == -2)
      {
        place = this->Places[place.point];
      }
    }
    if (shifted > 0)
    {
      this->Made.warnings.push_back(std::to_string(shifted) +
        " skeleton points beside the surface were put on it; none was farther than " +
        Millimetres(shift));
    }
    if (this->Outside > 0)
    {
      this->Made.warnings.push_back(
        std::to_string(this->Outside) + " skeleton points outside of the surface were left out");
    }
  }

  void SetSizes()
  {
    for (std::size_t k = 0; k < this->Made.pieces.size(); ++k)
    {
      this->SetSizes(this->Made.pieces[k], this->Trees[k]);
    }
  }

  void AddEdges()
  {
    this->WallTrees.resize(this->Made.pieces.size());
    std::size_t through = 0;
    std::map<std::pair<int, Edge>, std::int64_t> known;
    for (std::size_t e = 0; e < this->Input.skeletonEdges.size(); ++e)
    {
      const auto& [a, b] = this->Input.skeletonEdges[e];
      const Place& from = this->Places[a];
      const Place& to = this->Places[b];
      if (from.point < 0 || to.point < 0)
      {
        continue;
      }
      if (from.piece == to.piece && from.point == to.point)
      {
        continue;
      }
      if (from.piece != to.piece || this->LeavesSurface(from.piece, from.point, to.point))
      {
        if (this->Settings.outside == OutsidePolicy::Refuse)
        {
          throw std::invalid_argument("skeleton edge " + std::to_string(e) + " from point " +
            std::to_string(a) + " at " + Describe(this->Input.skeletonPoints[a]) + " to point " +
            std::to_string(b) + " leaves the surface");
        }
        ++through;
        continue;
      }
      const Edge edge = std::minmax(from.point, to.point);
      if (!known.try_emplace({ from.piece, edge }, static_cast<std::int64_t>(e)).second)
      {
        continue;
      }
      this->AddSegment(
        this->Made.pieces[from.piece], from.point, to.point, static_cast<std::int64_t>(e));
    }
    if (through > 0)
    {
      this->Made.warnings.push_back(
        std::to_string(through) + " skeleton edges that leave the surface were left out");
    }
  }

  /// Per skeleton point: whether one edge only ends at its place.
  std::vector<char> SkeletonEnds() const
  {
    const std::vector<Vector3>& points = this->Input.skeletonPoints;
    std::map<std::array<double, 3>, int> edges;
    for (const auto& [a, b] : this->Input.skeletonEdges)
    {
      if (points[a] != points[b])
      {
        ++edges[{ points[a][0], points[a][1], points[a][2] }];
        ++edges[{ points[b][0], points[b][1], points[b][2] }];
      }
    }
    std::vector<char> isEnd(points.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      const auto found = edges.find({ points[i][0], points[i][1], points[i][2] });
      isEnd[i] = found != edges.end() && found->second == 1 ? 1 : 0;
    }
    return isEnd;
  }

  double RadiusAt(std::size_t i) const
  {
    return this->Input.skeletonRadius.empty() ? this->Radii.At(this->Input.skeletonPoints[i])
                                              : this->Input.skeletonRadius[i];
  }

  static double LongestSide(const MeshingPiece& piece, std::int64_t triangle)
  {
    const Triangle& t = piece.triangles[triangle];
    return std::max(
      { Sized(piece, t[0], t[1]), Sized(piece, t[1], t[2]), Sized(piece, t[2], t[0]) });
  }

  static std::vector<double> WallSizes(const MeshingPiece& piece)
  {
    std::vector<double> sum(piece.points.size(), 0.0);
    std::vector<int> count(piece.points.size(), 0);
    for (const Triangle& t : piece.triangles)
    {
      for (int i = 0; i < 3; ++i)
      {
        sum[t[i]] += Sized(piece, t[i], t[(i + 1) % 3]);
        ++count[t[i]];
      }
    }
    for (std::size_t i = 0; i < sum.size(); ++i)
    {
      sum[i] = count[i] > 0 ? sum[i] / count[i] : 0.0;
    }
    return sum;
  }

  /// Wanted edge lengths: the wall's own, and inside by the radius, but not finer than the wall.
  void SetSizes(MeshingPiece& piece, const TriangleBvh& tree) const
  {
    const std::vector<double> wall = WallSizes(piece);
    const double factor = this->Settings.sizeFactor;
    piece.sizes = wall;
    for (std::size_t i = 0; i < piece.points.size(); ++i)
    {
      if (wall[i] == 0.0)
      {
        const std::int64_t triangle = tree.Closest(piece.points[i]).triangle;
        const double near = wall[piece.triangles[triangle][0]];
        const double radius = this->Radii.At(piece.points[i] + this->Made.origin);
        piece.sizes[i] = std::max(near, (factor > 0.0 ? factor : 0.5) * radius);
      }
    }
  }

  bool LeavesSurface(int number, std::int64_t from, std::int64_t to)
  {
    const MeshingPiece& piece = this->Made.pieces[number];
    const Vector3& p = piece.points[from];
    const Vector3& q = piece.points[to];
    bool crosses = false;
    std::unique_ptr<TriangleBvh>& tree = this->WallTrees[number];
    if (!tree)
    {
      tree = std::make_unique<TriangleBvh>(piece.points, piece.triangles);
    }
    tree->Visit(p.cwiseMin(q), p.cwiseMax(q),
      [&](std::int64_t triangle)
      {
        const Triangle& t = piece.triangles[triangle];
        const bool touches = std::any_of(
          t.begin(), t.end(), [&](std::int64_t corner) { return corner == from || corner == to; });
        crosses = crosses ||
          (!touches && Crosses(p, q, piece.points[t[0]], piece.points[t[1]], piece.points[t[2]]));
      });
    return crosses || tree->Winding(0.5 * (p + q)) == 0;
  }

  static void AddSegment(
    MeshingPiece& piece, std::int64_t from, std::int64_t to, std::int64_t source)
  {
    const double length = Sized(piece, from, to);
    const double wanted = 1.3 * std::min(piece.sizes[from], piece.sizes[to]);
    const auto parts = static_cast<int>(std::clamp(std::ceil(length / wanted), 1.0, 10000.0));
    std::int64_t last = from;
    for (int i = 1; i <= parts; ++i)
    {
      std::int64_t next = to;
      if (i < parts)
      {
        const double t = static_cast<double>(i) / parts;
        next = static_cast<std::int64_t>(piece.points.size());
        piece.points.emplace_back((1.0 - t) * piece.points[from] + t * piece.points[to]);
        piece.sizes.push_back((1.0 - t) * piece.sizes[from] + t * piece.sizes[to]);
        piece.surfacePoint.push_back(-1);
        piece.skeletonPoint.push_back(-1);
      }
      piece.segments.emplace_back(last, next);
      piece.segmentSource.push_back(source);
      last = next;
    }
  }

  const TetrahedralMeshInput& Input;
  const TetrahedralMeshSettings& Settings;
  const ClosedSurface& Surface;
  const LocalRadius& Radii;
  MeshingPieces Made;
  std::vector<TriangleBvh> Trees; ///< of the pieces as the surface has them
  std::vector<std::unique_ptr<TriangleBvh>>
    WallTrees;               ///< with the points that were put on the wall
  std::vector<Place> Places; ///< of each skeleton point
  std::vector<std::pair<std::size_t, Vector3>> OnWall; ///< skeleton points and where they go
  std::vector<char> IsEnd;
  std::size_t Outside = 0;
};
}

MeshingPieces MakeMeshingPieces(const TetrahedralMeshInput& input,
  const TetrahedralMeshSettings& settings, const ClosedSurface& surface, const LocalRadius& radii)
{
  return PieceMaker(input, settings, surface, radii).Run();
}
}
