#include "TetrahedralMesh.h"

#include "TetrahedralBoundary.h"
#include "TriangleIntersections.h"
#include "TriangleTree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>

#include <unistd.h>

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
/// When a flatter tetrahedron is left, it is tried once more; radians (5 degrees).
constexpr double flatAngle = 0.0873;

const char* WorkerName(TetrahedralBackend backend)
{
  return backend == TetrahedralBackend::Cgal ? "coronary-cgal-worker" : "coronary-tetgen-worker";
}

ProgressCallback Part(const ProgressCallback& progress, double first, double last)
{
  if (!progress)
  {
    return {};
  }
  return [progress, first, last](double fraction)
  { return progress(first + (last - first) * fraction); };
}

/// The vessel's radius anywhere: the nearest skeleton point's, or half the mean depth without one.
class LocalRadius
{
public:
  LocalRadius(const TetrahedralMeshInput& input, const ClosedSurface& surface)
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
    this->Tree = std::make_unique<TriangleTree>(this->Points, this->Segments);
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

  double At(const Vector3& p) const
  {
    const TriangleTree::Nearest nearest = this->Tree->Closest(p);
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

private:
  const std::vector<Vector3>& Points;
  const std::vector<double>& Radius;
  std::vector<Triangle> Segments;
  std::unique_ptr<TriangleTree> Tree;
  double Mean = 0.0;
};

/// One component with what lies in it; points relative to a common origin.
struct Piece
{
  std::vector<Vector3> points; ///< the surface's first
  std::vector<std::int64_t> surfacePoint;
  std::vector<std::int64_t> skeletonPoint;
  std::vector<Triangle> triangles;
  std::vector<std::int64_t> sourceCell;
  std::vector<Edge> segments;
  std::vector<std::int64_t> segmentSource;
  std::vector<double> sizes;
};

double Sized(const Piece& piece, std::int64_t a, std::int64_t b)
{
  return (piece.points[a] - piece.points[b]).norm();
}

/**
 * Puts a point into the surface where it is nearest; returns the point's number.
 * @param tolerance  how far the surface may move, mm
 * @param reach      how far the point may move to one of the surface's, mm
 */
std::int64_t InsertIntoSurface(Piece& piece, const Vector3& p, double tolerance, double reach)
{
  std::int64_t nearest = 0;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < piece.triangles.size(); ++i)
  {
    const Triangle& t = piece.triangles[i];
    const double distance =
      (ClosestPointOfTriangle(p, piece.points[t[0]], piece.points[t[1]], piece.points[t[2]]) - p)
        .squaredNorm();
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

std::string Millimetres(double value)
{
  char text[32];
  std::snprintf(text, sizeof text, "%.3g mm", value);
  return text;
}

/// Everything between the input and the mesh.
class Maker
{
public:
  Maker(const TetrahedralMeshInput& input, const TetrahedralMeshSettings& settings,
    const ProgressCallback& progress)
    : Input(input)
    , Settings(settings)
    , Progress(progress)
  {
  }

  TetrahedralMesh Run()
  {
    this->Settings.Validate();
    this->CheckSkeletonLists();
    this->Surface = CheckSurface(this->Input.points, this->Input.triangles);
    this->Mesh.warnings = this->Surface.warnings;
    this->ChooseBackend();
    this->Radii = std::make_unique<LocalRadius>(this->Input, this->Surface);
    Report(this->Progress, 0.02);
    try
    {
      CheckSelfIntersections(this->Surface);
    }
    catch (const SurfaceError& error)
    {
      if (!this->Settings.repair || !this->Repair(error.cells))
      {
        throw;
      }
    }
    Report(this->Progress, 0.05);
    this->MakePieces();
    Report(this->Progress, 0.08);
    std::vector<MesherAnswer> answers;
    try
    {
      answers = this->RunBackend(Part(this->Progress, 0.08, 0.7));
    }
    catch (const MesherFailure& failure)
    {
      if (!this->Settings.repair || this->Mesh.tries > 1 || !this->Repair({}))
      {
        throw;
      }
      this->Mesh.warnings.push_back(
        "the first try failed (" + std::string(failure.what()) + "), the second one succeeded");
      this->MakePieces();
      answers = this->RunBackend(Part(this->Progress, 0.4, 0.7));
    }
    this->Assemble(answers);
    this->TryAgainWhenFlat();
    this->CheckVolumes();
    Report(this->Progress, 1.0);
    return std::move(this->Mesh);
  }

private:
  /// The retry when a tetrahedron stayed flat: the surface beside it moves within the repair limit.
  void TryAgainWhenFlat()
  {
    if (!this->Settings.improve || this->LeastAngle() >= flatAngle)
    {
      return;
    }
    const std::vector<std::int64_t> cells = this->SurfaceBesideFlat();
    if (this->Settings.repair && this->Mesh.tries == 1 && !cells.empty())
    {
      const double before = this->LeastAngle();
      TetrahedralMesh first = std::move(this->Mesh);
      this->Mesh = {};
      this->Mesh.backend = first.backend;
      this->Mesh.warnings = this->Surface.warnings;
      bool better = false;
      try
      {
        if (HasInnerSkeleton(first) ? this->Lift(cells) : this->Repair(cells))
        {
          this->MakePieces();
          this->Assemble(this->RunBackend({}));
          better = this->LeastAngle() > before;
        }
      }
      catch (const MesherFailure&)
      {
        better = false;
      }
      catch (const std::invalid_argument&)
      {
        better = false; // the skeleton leaves the surface that was moved
      }
      if (!better)
      {
        this->Mesh = std::move(first);
      }
    }
    const auto flattest =
      std::min_element(this->Mesh.minimumDihedral.begin(), this->Mesh.minimumDihedral.end());
    if (*flattest < flatAngle)
    {
      const Tetrahedron& t = this->Mesh.tetrahedra[flattest - this->Mesh.minimumDihedral.begin()];
      char text[160];
      std::snprintf(text, sizeof text,
        "a flat tetrahedron is left at %s: least dihedral angle %.3g degrees",
        Describe(this->Mesh.points[t[0]]).c_str(), *flattest * 180.0 / M_PI);
      this->Mesh.warnings.emplace_back(text);
    }
  }

  /// Whether a flat tetrahedron has a point of the skeleton that is not on the surface.
  static bool HasInnerSkeleton(const TetrahedralMesh& mesh)
  {
    std::vector<char> onSurface(mesh.points.size(), 0);
    for (const Triangle& t : mesh.boundary)
    {
      for (const std::int64_t corner : t)
      {
        onSurface[corner] = 1;
      }
    }
    for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i)
    {
      for (const std::int64_t point : mesh.tetrahedra[i])
      {
        if (mesh.minimumDihedral[i] < flatAngle && onSurface[point] == 0 &&
          mesh.skeletonPoint[point] >= 0)
        {
          return true;
        }
      }
    }
    return false;
  }

  /**
   * Moves the triangles' points outwards, away from a skeleton that grazes the wall: who is more than
   * 1 % of the radius below it is at twice that depth then. False when triangles would cut each other.
   */
  bool Lift(const std::vector<std::int64_t>& cells)
  {
    this->Mesh.tries = 2;
    std::vector<Vector3>& points = this->Surface.points;
    const std::vector<Vector3> before = points;
    std::vector<char> moves(points.size(), 0);
    for (const std::int64_t cell : cells)
    {
      for (const std::int64_t corner : this->Surface.triangles[cell])
      {
        moves[corner] = 1;
      }
    }
    std::vector<Vector3> normals(points.size(), Vector3::Zero());
    for (const Triangle& t : this->Surface.triangles)
    {
      const Vector3 normal = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
      for (const std::int64_t corner : t)
      {
        normals[corner] += normal;
      }
    }
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      if (moves[i] != 0)
      {
        const double distance = 0.99 * this->Settings.repairLimit * this->Radii->At(before[i]);
        points[i] += distance * normals[i].normalized();
      }
    }
    if (!FindSelfIntersections(points, this->Surface.triangles).empty())
    {
      points = before;
      return false;
    }
    this->SayRepaired(before);
    return true;
  }

  void SayRepaired(const std::vector<Vector3>& before)
  {
    double greatest = 0.0;
    for (std::size_t i = 0; i < before.size(); ++i)
    {
      greatest = std::max(greatest, (this->Surface.points[i] - before[i]).norm());
    }
    this->Mesh.repairDisplacement = greatest;
    this->Mesh.warnings.push_back(
      "the surface was repaired; no point moved farther than " + Millimetres(greatest));
  }

  double LeastAngle() const
  {
    return *std::min_element(this->Mesh.minimumDihedral.begin(), this->Mesh.minimumDihedral.end());
  }

  /// Triangles of the surface that have a point of a flat tetrahedron.
  std::vector<std::int64_t> SurfaceBesideFlat() const
  {
    std::vector<char> flat(this->Mesh.points.size(), 0);
    for (std::size_t i = 0; i < this->Mesh.tetrahedra.size(); ++i)
    {
      if (this->Mesh.minimumDihedral[i] < flatAngle)
      {
        for (const std::int64_t point : this->Mesh.tetrahedra[i])
        {
          flat[point] = 1;
        }
      }
    }
    std::vector<std::int64_t> cells;
    for (std::size_t i = 0; i < this->Mesh.boundary.size(); ++i)
    {
      const Triangle& t = this->Mesh.boundary[i];
      if (flat[t[0]] != 0 || flat[t[1]] != 0 || flat[t[2]] != 0)
      {
        cells.push_back(this->Mesh.boundaryCell[i]);
      }
    }
    return cells;
  }

  void CheckSkeletonLists() const
  {
    const auto count = static_cast<std::int64_t>(this->Input.skeletonPoints.size());
    if (!this->Input.skeletonRadius.empty() &&
      static_cast<std::int64_t>(this->Input.skeletonRadius.size()) != count)
    {
      throw std::invalid_argument("the skeleton needs one radius for each point");
    }
    for (std::int64_t i = 0; i < count; ++i)
    {
      if (!this->Input.skeletonPoints[i].allFinite())
      {
        throw std::invalid_argument("skeleton point " + std::to_string(i) + " is not finite");
      }
      if (!this->Input.skeletonRadius.empty() &&
        !(this->Input.skeletonRadius[i] > 0.0 && std::isfinite(this->Input.skeletonRadius[i])))
      {
        throw std::invalid_argument(
          "the radius of skeleton point " + std::to_string(i) + " is not positive");
      }
    }
    for (std::size_t i = 0; i < this->Input.skeletonEdges.size(); ++i)
    {
      const auto& [a, b] = this->Input.skeletonEdges[i];
      if (a < 0 || b < 0 || a >= count || b >= count)
      {
        throw std::invalid_argument(
          "skeleton edge " + std::to_string(i) + " has a point that does not exist");
      }
    }
  }

  void ChooseBackend()
  {
    TetrahedralBackend backend = this->Settings.backend;
    if (backend == TetrahedralBackend::Automatic)
    {
      backend =
        FindMesher(WorkerName(TetrahedralBackend::TetGen), this->Settings.workerFolder).empty()
        ? TetrahedralBackend::Cgal
        : TetrahedralBackend::TetGen;
    }
    this->Executable = FindMesher(WorkerName(backend), this->Settings.workerFolder);
    if (this->Executable.empty())
    {
      const bool any = this->Settings.backend == TetrahedralBackend::Automatic;
      throw MesherFailure(any
          ? std::string(
              "neither coronary-tetgen-worker nor coronary-cgal-worker is there: the mesher "
              "was built without TetGen and without CGAL")
          : std::string(WorkerName(backend)) + " is not there: the mesher was built without " +
            (backend == TetrahedralBackend::Cgal ? "CGAL" : "TetGen"));
    }
    this->Mesh.backend = backend;
  }

  /**
   * Moves points of the given triangles (of thin and folded ones, when there are none) towards
   * their neighbours, by less than the limit. True when no triangles cut each other any more.
   */
  bool Repair(std::vector<std::int64_t> cells)
  {
    this->Mesh.tries = 2;
    const std::vector<Vector3> before = this->Surface.points;
    std::vector<Vector3>& points = this->Surface.points;
    std::vector<std::vector<std::int64_t>> neighbours(points.size());
    for (const Triangle& t : this->Surface.triangles)
    {
      for (int i = 0; i < 3; ++i)
      {
        neighbours[t[i]].push_back(t[(i + 1) % 3]);
      }
    }
    if (cells.empty())
    {
      for (std::size_t i = 0; i < this->Surface.triangles.size(); ++i)
      {
        const Triangle& t = this->Surface.triangles[i];
        double longest = 0.0;
        for (int k = 0; k < 3; ++k)
        {
          longest = std::max(longest, (points[t[k]] - points[t[(k + 1) % 3]]).squaredNorm());
        }
        const double area = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).norm();
        if (area < 0.1 * longest)
        {
          cells.push_back(static_cast<std::int64_t>(i));
        }
      }
    }
    bool clean = false;
    for (int round = 0; round < 30 && !clean; ++round)
    {
      std::vector<std::int64_t> moved;
      for (const std::int64_t cell : cells)
      {
        for (const std::int64_t corner : this->Surface.triangles[cell])
        {
          moved.push_back(corner);
          moved.insert(moved.end(), neighbours[corner].begin(), neighbours[corner].end());
        }
      }
      std::sort(moved.begin(), moved.end());
      moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
      std::vector<Vector3> places;
      for (const std::int64_t point : moved)
      {
        Vector3 mean = Vector3::Zero();
        for (const std::int64_t other : neighbours[point])
        {
          mean += points[other];
        }
        mean /= static_cast<double>(neighbours[point].size());
        const double limit = 0.99 * this->Settings.repairLimit * this->Radii->At(before[point]);
        Vector3 shift = points[point] + 0.5 * (mean - points[point]) - before[point];
        if (shift.norm() > limit)
        {
          shift *= limit / shift.norm();
        }
        places.emplace_back(before[point] + shift);
      }
      for (std::size_t i = 0; i < moved.size(); ++i)
      {
        points[moved[i]] = places[i];
      }
      cells.clear();
      for (const auto& [s, t] : FindSelfIntersections(points, this->Surface.triangles))
      {
        cells.push_back(s);
        cells.push_back(t);
      }
      clean = cells.empty();
    }
    if (!clean)
    {
      points = before;
      return false;
    }
    this->SayRepaired(before);
    return true;
  }

  void MakePieces()
  {
    const std::size_t count = this->Surface.volume.size();
    this->SegmentTrees.clear();
    this->Pieces.assign(count, {});
    Vector3 low = this->Surface.points[0];
    Vector3 high = low;
    for (const Vector3& p : this->Surface.points)
    {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    this->Origin = 0.5 * (low + high);
    std::vector<std::int64_t> number(this->Surface.points.size(), -1);
    for (std::size_t i = 0; i < this->Surface.triangles.size(); ++i)
    {
      Piece& piece = this->Pieces[this->Surface.component[i]];
      Triangle t = this->Surface.triangles[i];
      for (std::int64_t& corner : t)
      {
        if (number[corner] < 0)
        {
          number[corner] = static_cast<std::int64_t>(piece.points.size());
          piece.points.emplace_back(this->Surface.points[corner] - this->Origin);
          piece.surfacePoint.push_back(this->Surface.sourcePoint[corner]);
          piece.skeletonPoint.push_back(-1);
        }
        corner = number[corner];
      }
      piece.triangles.push_back(t);
      piece.sourceCell.push_back(static_cast<std::int64_t>(i));
    }
    std::vector<std::unique_ptr<TriangleTree>> trees;
    for (const Piece& piece : this->Pieces)
    {
      trees.push_back(std::make_unique<TriangleTree>(piece.points, piece.triangles));
    }
    for (std::size_t i = 0; i < count; ++i)
    {
      for (std::size_t j = 0; j < count; ++j)
      {
        if (i != j && trees[j]->Winding(this->Pieces[i].points[0]) != 0)
        {
          const std::int64_t cell = this->Pieces[i].sourceCell[0];
          throw SurfaceError("a part of the surface lies inside another one: that with " +
              DescribeCells({ cell }, this->Pieces[i].points[0] + this->Origin),
            { cell });
        }
      }
    }
    this->PlaceSkeleton(trees);
  }

  void PlaceSkeleton(const std::vector<std::unique_ptr<TriangleTree>>& trees)
  {
    const std::vector<Vector3>& points = this->Input.skeletonPoints;
    // Points of edges only; a skeleton without edges is a set of points.
    std::vector<char> used(points.size(), this->Input.skeletonEdges.empty() ? 1 : 0);
    for (const auto& [a, b] : this->Input.skeletonEdges)
    {
      used[a] = 1;
      used[b] = 1;
    }
    struct Place
    {
      int piece = -1;
      std::int64_t point = -1;
    };
    std::vector<Place> places(points.size());
    std::map<std::array<double, 3>, std::size_t> first;
    std::vector<std::pair<std::size_t, Vector3>> onWall;
    std::size_t outside = 0;
    const std::vector<char> isEnd = this->SkeletonEnds();
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
        places[i] = { -2, static_cast<std::int64_t>(same->second) };
        continue;
      }
      const Vector3 p = points[i] - this->Origin;
      const double radius = this->Input.skeletonRadius.empty() ? this->Radii->At(points[i])
                                                               : this->Input.skeletonRadius[i];
      TriangleTree::Nearest nearest;
      for (std::size_t k = 0; k < trees.size(); ++k)
      {
        const TriangleTree::Nearest found = trees[k]->Closest(p);
        if (nearest.triangle < 0 || found.distance < nearest.distance)
        {
          nearest = found;
          places[i].piece = static_cast<int>(k);
        }
      }
      if (nearest.distance <= 0.01 * radius)
      {
        onWall.emplace_back(i, p);
        continue;
      }
      if (isEnd[i] != 0 && nearest.distance <= endTolerance * radius &&
        nearest.distance <= endDepth * LongestSide(this->Pieces[places[i].piece], nearest.triangle))
      {
        onWall.emplace_back(i, nearest.point);
        continue;
      }
      const int nearestPiece = places[i].piece;
      places[i].piece = -1;
      for (std::size_t k = 0; k < trees.size(); ++k)
      {
        if (trees[k]->Winding(p) != 0)
        {
          places[i].piece = static_cast<int>(k);
        }
      }
      if (places[i].piece < 0 && nearest.distance <= endTolerance * radius)
      {
        places[i].piece = nearestPiece;
        onWall.emplace_back(i, nearest.point);
        continue;
      }
      if (places[i].piece < 0)
      {
        if (this->Settings.outside == OutsidePolicy::Refuse)
        {
          throw std::invalid_argument("skeleton point " + std::to_string(i) + " at " +
            Describe(points[i]) + " lies " + Millimetres(nearest.distance) +
            " outside of the surface");
        }
        ++outside;
        continue;
      }
      Piece& piece = this->Pieces[places[i].piece];
      places[i].point = static_cast<std::int64_t>(piece.points.size());
      piece.points.push_back(p);
      piece.surfacePoint.push_back(-1);
      piece.skeletonPoint.push_back(static_cast<std::int64_t>(i));
    }
    std::size_t shifted = 0;
    double shift = 0.0;
    for (const auto& [i, place] : onWall)
    {
      Piece& piece = this->Pieces[places[i].piece];
      const double radius = this->Input.skeletonRadius.empty() ? this->Radii->At(points[i])
                                                               : this->Input.skeletonRadius[i];
      places[i].point = InsertIntoSurface(
        piece, place, 0.01 * radius, isEnd[i] != 0 ? endTolerance * radius : 0.01 * radius);
      piece.skeletonPoint[places[i].point] = static_cast<std::int64_t>(i);
      const double moved = (piece.points[places[i].point] + this->Origin - points[i]).norm();
      if (moved > 0.01 * radius)
      {
        ++shifted;
        shift = std::max(shift, moved);
      }
    }
    for (Place& place : places)
    {
      if (place.piece == -2)
      {
        place = places[place.point];
      }
    }
    if (shifted > 0)
    {
      this->Mesh.warnings.push_back(std::to_string(shifted) +
        " skeleton points beside the surface were put on it; none was farther than " +
        Millimetres(shift));
    }
    if (outside > 0)
    {
      this->Mesh.warnings.push_back(
        std::to_string(outside) + " skeleton points outside of the surface were left out");
    }

    std::vector<std::vector<double>> wall(this->Pieces.size());
    for (std::size_t k = 0; k < this->Pieces.size(); ++k)
    {
      wall[k] = this->WallSizes(this->Pieces[k]);
      this->SetSizes(this->Pieces[k], *trees[k], wall[k]);
    }
    std::size_t through = 0;
    std::map<std::pair<int, Edge>, std::int64_t> known;
    for (std::size_t e = 0; e < this->Input.skeletonEdges.size(); ++e)
    {
      const auto& [a, b] = this->Input.skeletonEdges[e];
      const Place& from = places[a];
      const Place& to = places[b];
      if (from.point < 0 || to.point < 0)
      {
        continue;
      }
      if (from.piece == to.piece && from.point == to.point)
      {
        continue;
      }
      if (from.piece != to.piece ||
        this->LeavesSurface(this->Pieces[from.piece], from.point, to.point))
      {
        if (this->Settings.outside == OutsidePolicy::Refuse)
        {
          throw std::invalid_argument("skeleton edge " + std::to_string(e) + " from point " +
            std::to_string(a) + " at " + Describe(points[a]) + " to point " + std::to_string(b) +
            " leaves the surface");
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
        this->Pieces[from.piece], from.point, to.point, static_cast<std::int64_t>(e));
    }
    if (through > 0)
    {
      this->Mesh.warnings.push_back(
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

  static double LongestSide(const Piece& piece, std::int64_t triangle)
  {
    const Triangle& t = piece.triangles[triangle];
    return std::max(
      { Sized(piece, t[0], t[1]), Sized(piece, t[1], t[2]), Sized(piece, t[2], t[0]) });
  }

  std::vector<double> WallSizes(const Piece& piece) const
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
  void SetSizes(Piece& piece, const TriangleTree& tree, const std::vector<double>& wall) const
  {
    const double factor = this->Settings.sizeFactor;
    piece.sizes = wall;
    for (std::size_t i = 0; i < piece.points.size(); ++i)
    {
      if (wall[i] == 0.0)
      {
        const std::int64_t triangle = tree.Closest(piece.points[i]).triangle;
        const double near = wall[piece.triangles[triangle][0]];
        const double radius = this->Radii->At(piece.points[i] + this->Origin);
        piece.sizes[i] = std::max(near, (factor > 0.0 ? factor : 0.5) * radius);
      }
    }
  }

  bool LeavesSurface(const Piece& piece, std::int64_t from, std::int64_t to) const
  {
    const Vector3& p = piece.points[from];
    const Vector3& q = piece.points[to];
    bool crosses = false;
    const TriangleTree* tree = nullptr;
    for (const auto& [owner, known] : this->SegmentTrees)
    {
      if (owner == &piece)
      {
        tree = known.get();
      }
    }
    if (tree == nullptr)
    {
      this->SegmentTrees.emplace_back(
        &piece, std::make_unique<TriangleTree>(piece.points, piece.triangles));
      tree = this->SegmentTrees.back().second.get();
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

  static void AddSegment(Piece& piece, std::int64_t from, std::int64_t to, std::int64_t source)
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

  std::vector<MesherAnswer> RunBackend(const ProgressCallback& progress)
  {
    std::vector<MesherRequest> requests;
    for (const Piece& piece : this->Pieces)
    {
      MesherRequest request;
      request.radiusEdgeRatio = this->Settings.radiusEdgeRatio;
      request.minimumDihedral = this->Settings.minimumDihedral * 180.0 / M_PI;
      request.timeLimit = this->Settings.timeLimit;
      request.memoryLimit = 0.75 * static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
        static_cast<double>(::sysconf(_SC_PAGE_SIZE));
      request.distance = 0.05;
      for (const Vector3& p : piece.points)
      {
        request.points.insert(request.points.end(), p.data(), p.data() + 3);
      }
      const bool sized =
        this->Settings.sizeFactor > 0.0 || this->Mesh.backend == TetrahedralBackend::Cgal;
      request.sizes = sized ? piece.sizes : std::vector<double>(piece.points.size(), 0.0);
      for (const Triangle& t : piece.triangles)
      {
        request.triangles.insert(request.triangles.end(), t.begin(), t.end());
      }
      for (const auto& [a, b] : piece.segments)
      {
        request.segments.insert(request.segments.end(), { a, b });
      }
      if (this->Mesh.backend == TetrahedralBackend::Cgal)
      {
        AddRims(piece, request);
      }
      requests.push_back(std::move(request));
    }
    std::vector<MesherAnswer> answers =
      RunMeshers(this->Executable, requests, this->Settings.timeLimit, progress);
    for (std::size_t k = 0; k < answers.size(); ++k)
    {
      if (answers[k].status != MesherStatus::Done)
      {
        throw MesherFailure(this->Explain(answers[k], this->Pieces[k]));
      }
    }
    return answers;
  }

  /// Edges where the surface bends by more than 50 degrees.
  static void AddRims(const Piece& piece, MesherRequest& request)
  {
    std::map<Edge, Vector3> normals;
    for (const Triangle& t : piece.triangles)
    {
      const Vector3& a = piece.points[t[0]];
      const Vector3 normal = (piece.points[t[1]] - a).cross(piece.points[t[2]] - a).normalized();
      for (int i = 0; i < 3; ++i)
      {
        const Edge edge = std::minmax(t[i], t[(i + 1) % 3]);
        const auto [other, isNew] = normals.try_emplace(edge, normal);
        if (!isNew && other->second.dot(normal) < std::cos(50.0 * M_PI / 180.0))
        {
          request.rims.insert(request.rims.end(), { edge.first, edge.second });
        }
      }
    }
  }

  /// What a worker's status means, and the first place on the surface that it names.
  std::string Explain(const MesherAnswer& answer, const Piece& piece) const
  {
    const std::string name = WorkerName(this->Mesh.backend);
    std::string text;
    switch (answer.status)
    {
      case MesherStatus::OutOfMemory:
        text = " ran out of memory";
        break;
      case MesherStatus::Intersection:
        text = " found facets or segments that cut each other";
        break;
      case MesherStatus::SmallFeature:
        text = " found a feature that is too small";
        break;
      case MesherStatus::CloseFacets:
        text = " found two facets that are too close to each other";
        break;
      case MesherStatus::BadInput:
      case MesherStatus::BadRequest:
        text = " did not accept its input";
        break;
      case MesherStatus::TimeLimit:
        text = " ran out of time";
        break;
      default:
        text = " failed inside";
    }
    // TetGen names a facet by its marker: "#123".
    const std::size_t mark = answer.message.find('#');
    if (mark != std::string::npos)
    {
      const long facet = std::atol(answer.message.c_str() + mark + 1) - 1;
      if (facet >= 0 && facet < static_cast<long>(piece.triangles.size()))
      {
        text += "; the first is " +
          DescribeCells(
            { piece.sourceCell[facet] }, piece.points[piece.triangles[facet][0]] + this->Origin);
      }
    }
    if (!answer.message.empty())
    {
      text += "; it said: " + answer.message.substr(0, 300);
    }
    return name + text;
  }

  void Assemble(const std::vector<MesherAnswer>& answers)
  {
    struct ComponentMesh
    {
      std::vector<Vector3> points;
      std::vector<Tetrahedron> cells;
      std::vector<char> fixed;
      std::vector<Edge> edges;
      ImprovementCounts counts;
    };
    std::vector<ComponentMesh> parts(answers.size());
    for (std::size_t k = 0; k < answers.size(); ++k)
    {
      const MesherAnswer& answer = answers[k];
      const Piece& piece = this->Pieces[k];
      ComponentMesh& part = parts[k];
      for (std::size_t i = 0; i + 2 < answer.points.size(); i += 3)
      {
        part.points.emplace_back(answer.points[i], answer.points[i + 1], answer.points[i + 2]);
      }
      for (std::size_t i = 0; i + 3 < answer.tetrahedra.size(); i += 4)
      {
        Tetrahedron t{ answer.tetrahedra[i], answer.tetrahedra[i + 1], answer.tetrahedra[i + 2],
          answer.tetrahedra[i + 3] };
        if (TetrahedronVolume(
              part.points[t[0]], part.points[t[1]], part.points[t[2]], part.points[t[3]]) < 0.0)
        {
          std::swap(t[2], t[3]);
        }
        part.cells.push_back(t);
      }
      part.fixed.assign(part.points.size(), 0);
      for (std::size_t i = 0; i + 2 < answer.segmentEdges.size(); i += 3)
      {
        const std::int64_t a = answer.segmentEdges[i];
        const std::int64_t b = answer.segmentEdges[i + 1];
        const std::int64_t segment = answer.segmentEdges[i + 2];
        const auto count = static_cast<std::int64_t>(part.points.size());
        if (a < 0 || b < 0 || a >= count || b >= count || segment < 0 ||
          segment >= static_cast<std::int64_t>(piece.segments.size()))
        {
          throw MesherFailure(std::string(WorkerName(this->Mesh.backend)) +
            " gave an edge of the skeleton that does not exist");
        }
        part.edges.emplace_back(a, b);
        part.fixed[a] = 1;
        part.fixed[b] = 1;
      }
      if (this->Mesh.backend == TetrahedralBackend::TetGen)
      {
        if (part.points.size() < piece.points.size())
        {
          throw MesherFailure("coronary-tetgen-worker lost points of its input");
        }
        std::fill_n(part.fixed.begin(), piece.points.size(), 1);
      }
      for (const auto& [face, cell] : BoundaryFaces(part.cells))
      {
        for (const std::int64_t corner : face)
        {
          part.fixed[corner] = 1;
        }
      }
    }
    if (this->Settings.improve)
    {
      ImprovementSettings improvement;
      improvement.wantedSine = std::sin(std::max(this->Settings.minimumDihedral, 0.1));
      const double unit = this->Settings.unitLength;
      improvement.leastVolume = this->Settings.minimumVolume / (unit * unit * unit);
      ParallelFor(
        static_cast<std::int64_t>(parts.size()), 1,
        [&](std::int64_t first, std::int64_t last)
        {
          for (std::int64_t k = first; k < last; ++k)
          {
            parts[k].counts = ImproveTetrahedra(
              parts[k].points, parts[k].cells, parts[k].fixed, parts[k].edges, improvement);
          }
        },
        Part(this->Progress, 0.7, 0.9));
    }
    for (std::size_t k = 0; k < parts.size(); ++k)
    {
      this->Append(
        answers[k], this->Pieces[k], parts[k].points, parts[k].cells, static_cast<int>(k));
      const ImprovementCounts& counts = parts[k].counts;
      this->Mesh.improvements.moves += counts.moves;
      this->Mesh.improvements.edgeRemovals += counts.edgeRemovals;
      this->Mesh.improvements.faceFlips += counts.faceFlips;
      this->Mesh.improvements.contractions += counts.contractions;
      this->Mesh.improvements.insertions += counts.insertions;
    }
    Report(this->Progress, 0.95);
    this->Measure();
  }

  void Append(const MesherAnswer& answer, const Piece& piece, const std::vector<Vector3>& points,
    const std::vector<Tetrahedron>& cells, int region)
  {
    const bool keepsSurface = this->Mesh.backend == TetrahedralBackend::TetGen;
    std::vector<std::int64_t> number(points.size(), -1);
    std::vector<char> used(points.size(), 0);
    for (const Tetrahedron& t : cells)
    {
      for (const std::int64_t corner : t)
      {
        used[corner] = 1;
      }
    }
    std::map<std::array<double, 3>, std::int64_t> places;
    if (!keepsSurface)
    {
      for (std::size_t i = 0; i < piece.points.size(); ++i)
      {
        if (piece.skeletonPoint[i] >= 0)
        {
          places[{ piece.points[i][0], piece.points[i][1], piece.points[i][2] }] =
            static_cast<std::int64_t>(i);
        }
      }
    }
    std::size_t found = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      if (used[i] == 0)
      {
        continue;
      }
      number[i] = static_cast<std::int64_t>(this->Mesh.points.size());
      std::int64_t origin = -1;
      if (keepsSurface)
      {
        origin = i < piece.points.size() ? static_cast<std::int64_t>(i) : -1;
      }
      else
      {
        const auto place = places.find({ points[i][0], points[i][1], points[i][2] });
        origin = place != places.end() ? place->second : -1;
      }
      const std::int64_t skeleton = origin >= 0 ? piece.skeletonPoint[origin] : -1;
      const std::int64_t surface = origin >= 0 && keepsSurface ? piece.surfacePoint[origin] : -1;
      found += skeleton >= 0 ? 1 : 0;
      Vector3 position = points[i] + this->Origin;
      // What was not moved has its own coordinates again, to the last bit.
      if (skeleton >= 0 &&
        piece.points[origin] == this->Input.skeletonPoints[skeleton] - this->Origin)
      {
        position = this->Input.skeletonPoints[skeleton];
      }
      else if (surface >= 0 && piece.points[origin] == this->Input.points[surface] - this->Origin)
      {
        position = this->Input.points[surface];
      }
      this->Mesh.points.push_back(position);
      this->Mesh.surfacePoint.push_back(surface);
      this->Mesh.skeletonPoint.push_back(skeleton);
    }
    const auto wanted = static_cast<std::size_t>(std::count_if(piece.skeletonPoint.begin(),
      piece.skeletonPoint.end(), [](std::int64_t id) { return id >= 0; }));
    if (found != wanted)
    {
      throw MesherFailure(std::string(WorkerName(this->Mesh.backend)) + " lost " +
        std::to_string(wanted - found) + " skeleton points");
    }
    const auto base = static_cast<std::int64_t>(this->Mesh.tetrahedra.size());
    for (const Tetrahedron& t : cells)
    {
      this->Mesh.tetrahedra.push_back({ number[t[0]], number[t[1]], number[t[2]], number[t[3]] });
      this->Mesh.region.push_back(region);
    }
    this->AppendBoundary(piece, points, cells, number, base);
    this->AppendSkeleton(answer, piece, cells, points.size(), number);
  }

  void AppendBoundary(const Piece& piece, const std::vector<Vector3>& points,
    const std::vector<Tetrahedron>& cells, const std::vector<std::int64_t>& number,
    std::int64_t base)
  {
    const bool keepsSurface = this->Mesh.backend == TetrahedralBackend::TetGen;
    std::map<Triangle, std::int64_t> source;
    std::unique_ptr<TriangleTree> tree;
    if (keepsSurface)
    {
      for (std::size_t i = 0; i < piece.triangles.size(); ++i)
      {
        Triangle sorted = piece.triangles[i];
        std::sort(sorted.begin(), sorted.end());
        source[sorted] = piece.sourceCell[i];
      }
    }
    else
    {
      tree = std::make_unique<TriangleTree>(piece.points, piece.triangles);
    }
    std::size_t kept = 0;
    for (const auto& [face, cell] : BoundaryFaces(cells))
    {
      std::int64_t origin = -1;
      if (keepsSurface)
      {
        Triangle sorted = face;
        std::sort(sorted.begin(), sorted.end());
        const auto known = source.find(sorted);
        if (known != source.end())
        {
          origin = known->second;
          ++kept;
        }
      }
      else
      {
        const Vector3 centre = (points[face[0]] + points[face[1]] + points[face[2]]) / 3.0;
        origin = piece.sourceCell[tree->Closest(centre).triangle];
        ++kept;
      }
      this->Mesh.boundary.push_back({ number[face[0]], number[face[1]], number[face[2]] });
      this->Mesh.boundaryCell.push_back(origin);
      this->Mesh.boundaryElement.push_back(base + cell);
    }
    if (keepsSurface && (kept != piece.triangles.size() || kept != this->CountFrom(base)))
    {
      throw MesherFailure("coronary-tetgen-worker changed the surface: " + std::to_string(kept) +
        " of " + std::to_string(piece.triangles.size()) + " triangles are left");
    }
  }

  std::size_t CountFrom(std::int64_t base) const
  {
    return static_cast<std::size_t>(std::count_if(this->Mesh.boundaryElement.begin(),
      this->Mesh.boundaryElement.end(), [base](std::int64_t cell) { return cell >= base; }));
  }

  void AppendSkeleton(const MesherAnswer& answer, const Piece& piece,
    const std::vector<Tetrahedron>& cells, std::size_t pointCount,
    const std::vector<std::int64_t>& number)
  {
    std::vector<char> onSkeleton(pointCount, 0);
    for (std::size_t i = 0; i + 2 < answer.segmentEdges.size(); i += 3)
    {
      onSkeleton[answer.segmentEdges[i]] = 1;
      onSkeleton[answer.segmentEdges[i + 1]] = 1;
    }
    std::vector<Edge> present;
    for (const Tetrahedron& t : cells)
    {
      for (int i = 0; i < 4; ++i)
      {
        for (int j = i + 1; j < 4; ++j)
        {
          if (onSkeleton[t[i]] != 0 && onSkeleton[t[j]] != 0)
          {
            present.emplace_back(std::minmax(t[i], t[j]));
          }
        }
      }
    }
    std::sort(present.begin(), present.end());
    std::vector<char> covered(piece.segments.size(), 0);
    for (std::size_t i = 0; i + 2 < answer.segmentEdges.size(); i += 3)
    {
      const std::int64_t a = answer.segmentEdges[i];
      const std::int64_t b = answer.segmentEdges[i + 1];
      const std::int64_t segment = answer.segmentEdges[i + 2];
      if (std::binary_search(present.begin(), present.end(), Edge(std::minmax(a, b))))
      {
        covered[segment] = 1;
        this->Mesh.skeletonEdges.push_back({ number[a], number[b], piece.segmentSource[segment] });
      }
      else
      {
        covered[segment] = 2;
      }
    }
    for (std::size_t i = 0; i < covered.size(); ++i)
    {
      if (covered[i] != 1)
      {
        const std::int64_t edge = piece.segmentSource[i];
        throw MesherFailure(std::string(WorkerName(this->Mesh.backend)) + " lost skeleton edge " +
          std::to_string(edge) + " at " +
          Describe(this->Input.skeletonPoints[this->Input.skeletonEdges[edge].first]));
      }
    }
  }

  void Measure()
  {
    TetrahedralMesh& mesh = this->Mesh;
    const std::size_t count = mesh.tetrahedra.size();
    mesh.volume.resize(count);
    mesh.minimumDihedral.resize(count);
    mesh.radiusEdgeRatio.resize(count);
    ParallelFor(static_cast<std::int64_t>(count), 4096,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          const Tetrahedron& t = mesh.tetrahedra[i];
          const Vector3& a = mesh.points[t[0]];
          const Vector3& b = mesh.points[t[1]];
          const Vector3& c = mesh.points[t[2]];
          const Vector3& d = mesh.points[t[3]];
          mesh.volume[i] = TetrahedronVolume(a, b, c, d);
          mesh.minimumDihedral[i] = MinimumDihedralAngle(a, b, c, d);
          mesh.radiusEdgeRatio[i] = RadiusEdgeRatio(a, b, c, d);
        }
      });
  }

  void CheckVolumes() const
  {
    const TetrahedralMesh& mesh = this->Mesh;
    const auto least = std::min_element(mesh.volume.begin(), mesh.volume.end());
    const double unit = this->Settings.unitLength;
    if (!(*least * unit * unit * unit > this->Settings.minimumVolume))
    {
      const Tetrahedron& t = mesh.tetrahedra[least - mesh.volume.begin()];
      char text[160];
      std::snprintf(text, sizeof text,
        "a tetrahedron at %s has the volume %.3g mm^3, the least allowed is %.3g",
        Describe(mesh.points[t[0]]).c_str(), *least * unit * unit * unit,
        this->Settings.minimumVolume);
      throw MesherFailure(text);
    }
  }

  const TetrahedralMeshInput& Input;
  const TetrahedralMeshSettings& Settings;
  const ProgressCallback& Progress;
  ClosedSurface Surface;
  std::unique_ptr<LocalRadius> Radii;
  std::string Executable;
  Vector3 Origin = Vector3::Zero();
  std::vector<Piece> Pieces;
  mutable std::vector<std::pair<const Piece*, std::unique_ptr<TriangleTree>>> SegmentTrees;
  TetrahedralMesh Mesh;
};
}

void TetrahedralMeshSettings::Validate() const
{
  const auto require = [](bool right, const char* text)
  {
    if (!right)
    {
      throw std::invalid_argument(text);
    }
  };
  require(
    this->backend >= TetrahedralBackend::Automatic && this->backend <= TetrahedralBackend::Cgal,
    "there is no such backend");
  require(this->outside == OutsidePolicy::Refuse || this->outside == OutsidePolicy::LeaveOut,
    "there is no such treatment of skeleton points outside");
  require(this->radiusEdgeRatio >= 1.1 && this->radiusEdgeRatio <= 10.0,
    "the radius-edge ratio must be between 1.1 and 10");
  require(this->minimumDihedral >= 0.0 && this->minimumDihedral <= 0.3491,
    "the minimum dihedral angle must be between 0 and 20 degrees");
  require(this->minimumVolume >= 0.0 && std::isfinite(this->minimumVolume),
    "the minimum volume must not be negative");
  require(this->unitLength > 0.0 && std::isfinite(this->unitLength),
    "the length of the unit must be positive");
  require(this->sizeFactor == 0.0 || (this->sizeFactor >= 0.05 && this->sizeFactor <= 10.0),
    "the size factor must be 0 or between 0.05 and 10");
  require(this->repairLimit > 0.0 && this->repairLimit <= 0.1,
    "the repair limit must be positive and at most 0.1");
  require(
    this->timeLimit > 0.0 && std::isfinite(this->timeLimit), "the time limit must be positive");
}

bool HasTetrahedralBackend(TetrahedralBackend backend, const std::string& workerFolder)
{
  const auto has = [&](TetrahedralBackend b)
  { return !FindMesher(WorkerName(b), workerFolder).empty(); };
  return backend == TetrahedralBackend::Automatic
    ? has(TetrahedralBackend::TetGen) || has(TetrahedralBackend::Cgal)
    : has(backend);
}

TetrahedralMesh MakeTetrahedralMesh(const TetrahedralMeshInput& input,
  const TetrahedralMeshSettings& settings, const ProgressCallback& progress)
{
  return Maker(input, settings, progress).Run();
}
}
