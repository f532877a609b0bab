#include "LayeredMesh.h"

#include "PartialProgress.h"
#include "Require.h"
#include "TriangleBvh.h"
#include "TriangleIntersections.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr int WallEntity = 1;
constexpr double FlatCap = 0.02;   // greatest distance from a cap's plane, in its radii
constexpr double Gradation = 0.3;  // greatest change of the layers' thickness per length
constexpr double LeastArea = 0.15; // of a layer's triangle over that of the wall
constexpr double WantedSlope =
  0.4; // cosine between a point's way inwards and its triangles' normals
constexpr double LeastSlope = 0.1; // the same, of what can be borne at any level
constexpr int SlopeRounds = 60;
constexpr double LessThickness = 0.8; // where prisms fold or walls meet
constexpr int MostTries = 40;
constexpr int MostCores = 6;         // meshes of the core, until none of its tetrahedra is flat
constexpr double FlatAngle = 0.0873; // radians (5 degrees)
constexpr int NormalSmoothing = 4;
constexpr int CapSweeps = 400;
constexpr double Rounding = 1e-9; // of places
constexpr double RimStep = 1.0;   // distance of an extension's rings in edges of the rim

using Edge = std::pair<std::int64_t, std::int64_t>;

/// The rim of a cap, in the order of the wall's triangles, which look outwards.
struct Cap
{
  int entity = 0;
  std::vector<std::int64_t> rim;
  std::vector<std::int64_t> inside; ///< points that are on the cap only
  Vector3 centre = Vector3::Zero();
  Vector3 normal = Vector3::Zero();
  double radius = 0.0;
};

std::string NameOfCap(int entity)
{
  return "cap " + std::to_string(entity);
}

std::vector<std::int64_t> LoopOf(const std::map<std::int64_t, std::int64_t>& next, int entity)
{
  std::vector<std::int64_t> loop;
  const std::int64_t first = next.begin()->first;
  std::int64_t now = first;
  do
  {
    loop.push_back(now);
    const auto found = next.find(now);
    Require(found != next.end() && loop.size() <= next.size(),
      "the rim of " + NameOfCap(entity) + " is not one closed loop");
    now = found->second;
  } while (now != first);
  Require(
    loop.size() == next.size(), "the rim of " + NameOfCap(entity) + " is not one closed loop");
  return loop;
}

std::vector<Cap> CapsOf(const CappedSurface& surface)
{
  std::map<Edge, int> entityOf; // by directed edges
  std::map<int, std::set<std::int64_t>> pointsOf;
  std::set<std::int64_t> ofWall;
  std::map<int, Vector3> area;
  for (std::size_t n = 0; n < surface.triangles.size(); ++n)
  {
    const Triangle& t = surface.triangles[n];
    const int entity = surface.entity[n];
    for (std::size_t k = 0; k < 3; ++k)
    {
      entityOf[{ t[k], t[(k + 1) % 3] }] = entity;
      if (entity == WallEntity)
      {
        ofWall.insert(t[k]);
      }
      else
      {
        pointsOf[entity].insert(t[k]);
      }
    }
    if (entity != WallEntity)
    {
      Vector3& sum = area.try_emplace(entity, Vector3::Zero()).first->second;
      const Vector3& a = surface.points[t[0]];
      sum += 0.5 * (surface.points[t[1]] - a).cross(surface.points[t[2]] - a);
    }
  }
  std::map<int, std::map<std::int64_t, std::int64_t>> rims;
  for (const auto& [edge, entity] : entityOf)
  {
    const auto other = entityOf.find({ edge.second, edge.first });
    if (entity == WallEntity && other != entityOf.end() && other->second != WallEntity)
    {
      Require(rims[other->second].emplace(edge.first, edge.second).second,
        "the rim of " + NameOfCap(other->second) + " touches itself");
    }
    else if (entity != WallEntity && other != entityOf.end() && other->second != WallEntity)
    {
      Require(other->second == entity,
        NameOfCap(entity) + " and " + NameOfCap(other->second) +
          " touch: there has to be wall between");
    }
  }
  std::vector<Cap> caps;
  for (const auto& [entity, points] : pointsOf)
  {
    Require(rims.count(entity) == 1, NameOfCap(entity) + " has no rim with the wall");
    Cap cap;
    cap.entity = entity;
    cap.rim = LoopOf(rims[entity], entity);
    for (const std::int64_t p : points)
    {
      if (ofWall.count(p) == 0)
      {
        cap.inside.push_back(p);
      }
    }
    for (const std::int64_t p : cap.rim)
    {
      cap.centre += surface.points[p] / static_cast<double>(cap.rim.size());
    }
    cap.normal = area.at(entity).normalized();
    cap.radius = std::sqrt(area.at(entity).norm() / M_PI);
    for (const std::int64_t p : points)
    {
      Require(std::abs(cap.normal.dot(surface.points[p] - cap.centre)) <= FlatCap * cap.radius,
        NameOfCap(entity) + " is not flat");
    }
    caps.push_back(std::move(cap));
  }
  return caps;
}

/// Puts a straight piece between the wall and a cap.
void Extend(CappedSurface& surface, Cap& cap, double length)
{
  const std::size_t around = cap.rim.size();
  double edge = 0.0;
  for (std::size_t k = 0; k < around; ++k)
  {
    edge += (surface.points[cap.rim[(k + 1) % around]] - surface.points[cap.rim[k]]).norm();
  }
  edge /= static_cast<double>(around);
  const int rings = std::max(1, static_cast<int>(std::lround(length / (RimStep * edge))));
  std::map<std::int64_t, std::int64_t> last;
  std::vector<std::int64_t> before = cap.rim;
  for (int ring = 1; ring <= rings; ++ring)
  {
    std::vector<std::int64_t> now;
    for (const std::int64_t p : cap.rim)
    {
      now.push_back(static_cast<std::int64_t>(surface.points.size()));
      surface.points.emplace_back(surface.points[p] + (length * ring / rings) * cap.normal);
    }
    for (std::size_t k = 0; k < around; ++k)
    {
      // The wall's triangles run along the rim: those of the next ones against it.
      const std::size_t k1 = (k + 1) % around;
      const std::int64_t a = before[k];
      const std::int64_t b = before[k1];
      const std::int64_t c = now[k];
      const std::int64_t d = now[k1];
      if ((k + static_cast<std::size_t>(ring)) % 2 == 0)
      {
        surface.triangles.push_back({ b, a, c });
        surface.triangles.push_back({ b, c, d });
      }
      else
      {
        surface.triangles.push_back({ b, a, d });
        surface.triangles.push_back({ a, c, d });
      }
      surface.entity.insert(surface.entity.end(), 2, WallEntity);
    }
    before = std::move(now);
  }
  for (std::size_t k = 0; k < around; ++k)
  {
    last[cap.rim[k]] = before[k];
  }
  for (const std::int64_t p : cap.inside)
  {
    surface.points[p] += length * cap.normal;
  }
  for (std::size_t n = 0; n < surface.triangles.size(); ++n)
  {
    for (std::size_t k = 0; surface.entity[n] == cap.entity && k < 3; ++k)
    {
      const auto found = last.find(surface.triangles[n][k]);
      surface.triangles[n][k] = found != last.end() ? found->second : surface.triangles[n][k];
    }
  }
  cap.rim = before;
}

/// The wall with what its points need to be moved inwards.
class WallOffset
{
public:
  WallOffset(
    const CappedSurface& surface, const std::vector<Cap>& caps, const LayeredMeshSettings& settings)
    : Surface(surface)
    , Caps(caps)
    , Settings(settings)
  {
    const std::size_t count = surface.points.size();
    this->OnWall.assign(count, 0);
    this->RimOf.assign(count, -1);
    this->Neighbours.resize(count);
    for (std::size_t n = 0; n < surface.triangles.size(); ++n)
    {
      const Triangle& t = surface.triangles[n];
      for (std::size_t k = 0; k < 3; ++k)
      {
        this->OnWall[t[k]] |= surface.entity[n] == WallEntity ? 1 : 0;
        this->Neighbours[t[k]].push_back(t[(k + 1) % 3]);
      }
    }
    for (std::size_t c = 0; c < caps.size(); ++c)
    {
      for (const std::int64_t p : caps[c].rim)
      {
        this->RimOf[p] = static_cast<int>(c);
      }
    }
    this->Heights();
    this->Normals();
    this->Radii();
    this->Share.assign(count, 1.0);
    this->Thickness = this->Radius;
    for (double& thickness : this->Thickness)
    {
      thickness *= settings.thickness;
    }
    this->Grade();
  }

  /// The surface of the core: less thick where that is needed.
  std::vector<Vector3> Find(const ProgressCallback& progress)
  {
    std::vector<Vector3> core;
    for (int attempt = 0; attempt < MostTries; ++attempt)
    {
      Report(progress, static_cast<double>(attempt) / MostTries);
      core = this->Core();
      std::vector<std::int64_t> bad = this->FoldedPoints(core);
      if (bad.empty())
      {
        bad = this->CrossingPoints(core);
      }
      if (bad.empty())
      {
        return core;
      }
      this->Thin(bad);
    }
    throw MesherFailure(
      "there is no room for layers at the wall: no thickness was found without folded prisms");
  }

  /// Less room at these points, and around as the gradation asks for.
  void Thin(const std::vector<std::int64_t>& points)
  {
    for (const std::int64_t p : points)
    {
      this->Thickness[p] *= LessThickness;
      this->Share[p] *= LessThickness;
    }
    this->Grade();
  }

  /// Of a wall's point on its way to the core, 0 at the wall and 1 there.
  const std::vector<double>& Levels() const { return this->Level; }
  bool IsOnWall(std::size_t point) const { return this->OnWall[point] != 0; }
  double LeastShare() const { return *std::min_element(this->Share.begin(), this->Share.end()); }

private:
  void Heights()
  {
    double height = 1.0;
    this->Level.push_back(0.0);
    for (int k = 0; k < this->Settings.layers; ++k)
    {
      this->Level.push_back(this->Level.back() + height);
      height *= this->Settings.growth;
    }
    for (double& level : this->Level)
    {
      level /= this->Level.back();
    }
    this->Level.back() = 1.0;
  }

  /// Outwards, weighted by angles, smoothed; in the plane of a cap on its rim.
  void Normals()
  {
    const std::vector<Vector3>& points = this->Surface.points;
    this->Normal.assign(points.size(), Vector3::Zero());
    for (std::size_t n = 0; n < this->Surface.triangles.size(); ++n)
    {
      const Triangle& t = this->Surface.triangles[n];
      for (std::size_t k = 0; this->Surface.entity[n] == WallEntity && k < 3; ++k)
      {
        const Vector3 u = points[t[(k + 1) % 3]] - points[t[k]];
        const Vector3 v = points[t[(k + 2) % 3]] - points[t[k]];
        const Vector3 across = u.cross(v);
        this->Normal[t[k]] += std::atan2(across.norm(), u.dot(v)) * across.normalized();
      }
    }
    this->Straighten();
    for (int round = 0; round < NormalSmoothing; ++round)
    {
      std::vector<Vector3> smoothed = this->Normal;
      for (std::size_t p = 0; p < points.size(); ++p)
      {
        for (const std::int64_t q : this->Neighbours[p])
        {
          if (this->OnWall[p] != 0 && this->OnWall[q] != 0)
          {
            smoothed[p] += this->Normal[q] / static_cast<double>(this->Neighbours[p].size());
          }
        }
      }
      this->Normal = std::move(smoothed);
      this->Straighten();
    }
    for (int round = 0; round < SlopeRounds && this->Steepen(); ++round)
    {
      this->Straighten();
    }
  }

  /// Turns normals that lie flat on a triangle of theirs towards its own. False: there is none.
  bool Steepen()
  {
    bool changed = false;
    const std::vector<Vector3>& points = this->Surface.points;
    for (std::size_t n = 0; n < this->Surface.triangles.size(); ++n)
    {
      const Triangle& t = this->Surface.triangles[n];
      const Vector3 own =
        (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).normalized();
      for (std::size_t k = 0; this->Surface.entity[n] == WallEntity && k < 3; ++k)
      {
        const double missing = WantedSlope - own.dot(this->Normal[t[k]].normalized());
        if (missing > 0.0)
        {
          this->Normal[t[k]] = this->Normal[t[k]].normalized() + 1.05 * missing * own;
          changed = true;
        }
      }
    }
    return changed;
  }

  void Straighten()
  {
    for (std::size_t p = 0; p < this->Normal.size(); ++p)
    {
      Vector3& normal = this->Normal[p];
      if (this->RimOf[p] >= 0)
      {
        const Vector3& across = this->Caps[this->RimOf[p]].normal;
        normal -= across * across.dot(normal);
      }
      normal.normalize();
    }
  }

  /// Of the greatest ball inside that touches the wall at its points.
  void Radii()
  {
    const std::vector<Vector3>& points = this->Surface.points;
    std::vector<Triangle>
      single; // the points themselves: of facets, a ball would touch the neighbours first
    double size = 0.0;
    for (std::size_t p = 0; p < points.size(); ++p)
    {
      if (this->OnWall[p] != 0)
      {
        const auto id = static_cast<std::int64_t>(p);
        single.push_back({ id, id, id });
        size = std::max(size, (points[p] - points[0]).norm());
      }
    }
    const TriangleBvh tree(points, single);
    this->Radius.assign(points.size(), 0.0);
    for (const Triangle& t : single)
    {
      const Vector3& p = points[t[0]];
      const Vector3& normal = this->Normal[t[0]];
      double radius = size;
      for (int step = 0; step < 60; ++step)
      {
        const Vector3 centre = p - radius * normal;
        const auto nearest = tree.Closest(centre);
        const Vector3 away = p - nearest.point;
        const double depth = normal.dot(away);
        if (nearest.distance >= radius * (1.0 - 1e-6) || depth <= 0.0)
        {
          break;
        }
        radius = std::min(radius, away.squaredNorm() / (2.0 * depth));
      }
      this->Radius[t[0]] = radius;
    }
    // Single values are noise.
    std::vector<double> median = this->Radius;
    for (const Triangle& t : single)
    {
      std::vector<double> around{ this->Radius[t[0]] };
      for (const std::int64_t q : this->Neighbours[t[0]])
      {
        if (this->OnWall[q] != 0)
        {
          around.push_back(this->Radius[q]);
        }
      }
      const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
      std::nth_element(around.begin(), middle, around.end());
      median[t[0]] = *middle;
    }
    this->Radius = std::move(median);
  }

  /// No steeper than the gradation.
  void Grade()
  {
    const std::vector<Vector3>& points = this->Surface.points;
    std::set<std::pair<double, std::int64_t>> waiting;
    for (std::size_t p = 0; p < points.size(); ++p)
    {
      if (this->OnWall[p] != 0)
      {
        waiting.emplace(this->Thickness[p], static_cast<std::int64_t>(p));
      }
    }
    while (!waiting.empty())
    {
      const auto [thickness, p] = *waiting.begin();
      waiting.erase(waiting.begin());
      for (const std::int64_t q : this->Neighbours[p])
      {
        const double most = thickness + Gradation * (points[p] - points[q]).norm();
        if (this->OnWall[q] != 0 && this->Thickness[q] > most)
        {
          waiting.erase({ this->Thickness[q], q });
          this->Thickness[q] = most;
          waiting.emplace(most, q);
        }
      }
    }
  }

  std::vector<Vector3> Core() const
  {
    const std::vector<Vector3>& points = this->Surface.points;
    std::vector<Vector3> shift(points.size(), Vector3::Zero());
    for (std::size_t p = 0; p < points.size(); ++p)
    {
      if (this->OnWall[p] != 0)
      {
        shift[p] = -this->Thickness[p] * this->Normal[p];
      }
    }
    // Inside a cap as on its rim, evenly.
    for (const Cap& cap : this->Caps)
    {
      for (int sweep = 0; sweep < CapSweeps; ++sweep)
      {
        for (const std::int64_t p : cap.inside)
        {
          Vector3 sum = Vector3::Zero();
          double weights = 0.0;
          for (const std::int64_t q : this->Neighbours[p])
          {
            const double weight = 1.0 / (points[p] - points[q]).norm();
            sum += weight * shift[q];
            weights += weight;
          }
          shift[p] = sum / weights;
        }
      }
    }
    std::vector<Vector3> core = points;
    for (std::size_t p = 0; p < points.size(); ++p)
    {
      core[p] += shift[p];
    }
    return core;
  }

  /// Points of triangles whose prisms are not sound at some level, or whose cap folds.
  std::vector<std::int64_t> FoldedPoints(const std::vector<Vector3>& core) const
  {
    const std::vector<Vector3>& points = this->Surface.points;
    std::vector<std::int64_t> folded;
    for (std::size_t n = 0; n < this->Surface.triangles.size(); ++n)
    {
      const Triangle& t = this->Surface.triangles[n];
      const bool isWall = this->Surface.entity[n] == WallEntity;
      bool good = true;
      const Vector3 before = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
      for (const double level : this->Level)
      {
        std::array<Vector3, 3> at;
        for (std::size_t k = 0; k < 3; ++k)
        {
          at[k] = points[t[k]] + level * (core[t[k]] - points[t[k]]);
        }
        const Vector3 area = (at[1] - at[0]).cross(at[2] - at[0]);
        good = good && area.dot(before) > LeastArea * before.squaredNorm();
        for (std::size_t k = 0; isWall && k < 3; ++k)
        {
          const Vector3 inwards = core[t[k]] - points[t[k]];
          good = good && -inwards.dot(area) > LeastSlope * inwards.norm() * area.norm();
        }
      }
      if (!good)
      {
        folded.insert(folded.end(), t.begin(), t.end());
      }
    }
    Unique(folded);
    return folded;
  }

  std::vector<std::int64_t> CrossingPoints(const std::vector<Vector3>& core) const
  {
    std::vector<std::int64_t> crossing;
    for (const auto& [s, t] : FindSelfIntersections(core, this->Surface.triangles))
    {
      for (const std::int64_t triangle : { s, t })
      {
        const Triangle& corners = this->Surface.triangles[triangle];
        crossing.insert(crossing.end(), corners.begin(), corners.end());
      }
    }
    Unique(crossing);
    return crossing;
  }

  static void Unique(std::vector<std::int64_t>& list)
  {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }

  const CappedSurface& Surface;
  const std::vector<Cap>& Caps;
  const LayeredMeshSettings& Settings;
  std::vector<char> OnWall;
  std::vector<int> RimOf; ///< index of a cap, or -1
  std::vector<std::vector<std::int64_t>> Neighbours;
  std::vector<Vector3> Normal;
  std::vector<double> Radius;
  std::vector<double> Thickness;
  std::vector<double> Share;
  std::vector<double> Level;
};

CellFaces FacesOf(const std::array<std::int64_t, 6>& p)
{
  return { { p[0], p[1], p[2] }, { p[3], p[5], p[4] }, { p[0], p[3], p[4], p[1] },
    { p[1], p[4], p[5], p[2] }, { p[2], p[5], p[3], p[0] } };
}

/// The fourth corner lies where the normal of the first three points to.
CellFaces FacesOf(const Tetrahedron& t)
{
  return { { t[0], t[2], t[1] }, { t[0], t[1], t[3] }, { t[1], t[2], t[3] }, { t[2], t[0], t[3] } };
}

/// Numbers the points and makes cells and faces.
class Assembly
{
public:
  Assembly(const CappedSurface& surface, const std::vector<Cap>& caps, const WallOffset& offset,
    const std::vector<Vector3>& coreSurface, const TetrahedralMesh& core)
    : Surface(surface)
    , Caps(caps)
    , Levels(offset.Levels())
  {
    this->Mesh.points = core.points;
    this->Mesh.tetrahedra = core.tetrahedra;
    this->First.assign(surface.points.size(), -1);
    this->InCore.assign(surface.points.size(), -1);
    for (std::size_t n = 0; n < core.surfacePoint.size(); ++n)
    {
      if (core.surfacePoint[n] >= 0)
      {
        this->InCore[core.surfacePoint[n]] = static_cast<std::int64_t>(n);
      }
    }
    for (std::size_t p = 0; p < surface.points.size(); ++p)
    {
      if (!offset.IsOnWall(p))
      {
        continue;
      }
      this->First[p] = static_cast<std::int64_t>(this->Mesh.points.size());
      for (std::size_t level = 0; level + 1 < this->Levels.size(); ++level)
      {
        this->Mesh.points.emplace_back(
          surface.points[p] + this->Levels[level] * (coreSurface[p] - surface.points[p]));
      }
    }
  }

  LayeredMesh Make(const std::map<int, std::string>& patchName)
  {
    std::vector<BoundaryFace> boundary;
    const std::size_t layers = this->Levels.size() - 1;
    for (std::size_t n = 0; n < this->Surface.triangles.size(); ++n)
    {
      const Triangle& t = this->Surface.triangles[n];
      if (this->Surface.entity[n] != WallEntity)
      {
        boundary.push_back(
          { { this->At(t[0], layers), this->At(t[1], layers), this->At(t[2], layers) },
            this->PatchOf(this->Surface.entity[n]) });
        continue;
      }
      boundary.push_back({ { this->At(t[0], 0), this->At(t[1], 0), this->At(t[2], 0) }, 0 });
      double height = 0.0;
      for (const std::int64_t p : t)
      {
        height +=
          (this->Mesh.points[this->At(p, layers)] - this->Mesh.points[this->At(p, 0)]).norm() / 3.0;
      }
      this->Mesh.thickness.push_back(height);
      for (std::size_t k = 0; k < layers; ++k)
      {
        this->Mesh.prisms.push_back({ this->At(t[0], k), this->At(t[1], k), this->At(t[2], k),
          this->At(t[0], k + 1), this->At(t[1], k + 1), this->At(t[2], k + 1) });
      }
    }
    std::vector<std::string> names{ this->NameOf(WallEntity, patchName) };
    for (std::size_t c = 0; c < this->Caps.size(); ++c)
    {
      const Cap& cap = this->Caps[c];
      names.push_back(this->NameOf(cap.entity, patchName));
      for (std::size_t k = 0; k < cap.rim.size(); ++k)
      {
        const std::int64_t a = cap.rim[k];
        const std::int64_t b = cap.rim[(k + 1) % cap.rim.size()];
        for (std::size_t level = 0; level < layers; ++level)
        {
          boundary.push_back({ { this->At(a, level), this->At(b, level), this->At(b, level + 1),
                                 this->At(a, level + 1) },
            static_cast<int>(c + 1) });
        }
      }
    }
    std::vector<CellFaces> cells;
    cells.reserve(this->Mesh.prisms.size() + this->Mesh.tetrahedra.size());
    for (const auto& prism : this->Mesh.prisms)
    {
      cells.push_back(FacesOf(prism));
    }
    for (const Tetrahedron& tetrahedron : this->Mesh.tetrahedra)
    {
      cells.push_back(FacesOf(tetrahedron));
    }
    this->Mesh.cells = MakePolyhedralMesh(
      static_cast<std::int64_t>(this->Mesh.points.size()), cells, boundary, names);
    return std::move(this->Mesh);
  }

private:
  /// A point of the surface at a level.
  std::int64_t At(std::int64_t point, std::size_t level) const
  {
    return level + 1 < this->Levels.size() ? this->First[point] + static_cast<std::int64_t>(level)
                                           : this->InCore[point];
  }

  int PatchOf(int entity) const
  {
    const auto found = std::find_if(this->Caps.begin(), this->Caps.end(),
      [entity](const Cap& cap) { return cap.entity == entity; });
    return static_cast<int>(found - this->Caps.begin()) + 1;
  }

  static std::string NameOf(int entity, const std::map<int, std::string>& names)
  {
    const auto found = names.find(entity);
    const std::string own = entity == WallEntity ? "wall" : "cap_" + std::to_string(entity);
    return found != names.end() ? found->second : own;
  }

  const CappedSurface& Surface;
  const std::vector<Cap>& Caps;
  const std::vector<double>& Levels;
  std::vector<std::int64_t>
    First; ///< per point of the surface: its number at the wall, the next levels behind it
  std::vector<std::int64_t> InCore; ///< per point of the surface: its number at the core
  LayeredMesh Mesh;
};
}

namespace
{
/// Points of the core's surface that flat tetrahedra have.
std::vector<std::int64_t> FlatPoints(const TetrahedralMesh& mesh, const WallOffset& offset)
{
  std::set<std::int64_t> flat;
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n)
  {
    for (const std::int64_t corner : mesh.tetrahedra[n])
    {
      const std::int64_t p = mesh.surfacePoint[corner];
      if (mesh.minimumDihedral[n] < FlatAngle && p >= 0 &&
        offset.IsOnWall(static_cast<std::size_t>(p)))
      {
        flat.insert(p);
      }
    }
  }
  return { flat.begin(), flat.end() };
}

/// Thinner layers give the core another surface, where flat tetrahedra were left at it; the best one counts.
TetrahedralMesh MeshCore(const CappedSurface& surface, WallOffset& offset,
  TetrahedralMeshSettings settings, std::vector<Vector3>& coreSurface,
  const ProgressCallback& progress)
{
  settings.backend = TetrahedralBackend::TetGen;
  settings.repair = false;
  settings.minimumVolume = 0.0;
  TetrahedralMesh best;
  double bestAngle = -1.0;
  for (int attempt = 0; attempt < MostCores; ++attempt)
  {
    const double begin = static_cast<double>(attempt) / MostCores;
    const double end = (attempt + 1.0) / MostCores;
    const double middle = 0.7 * begin + 0.3 * end;
    TetrahedralMeshInput input;
    input.points = offset.Find(PartOf(progress, begin, middle));
    input.triangles = surface.triangles;
    TetrahedralMesh mesh = MakeTetrahedralMesh(input, settings, PartOf(progress, middle, end));
    const double angle =
      *std::min_element(mesh.minimumDihedral.begin(), mesh.minimumDihedral.end());
    const std::vector<std::int64_t> flat = FlatPoints(mesh, offset);
    if (angle > bestAngle)
    {
      bestAngle = angle;
      best = std::move(mesh);
      coreSurface = std::move(input.points);
    }
    if (flat.empty())
    {
      break;
    }
    offset.Thin(flat);
  }
  return best;
}
}

void LayeredMeshSettings::Validate() const
{
  Require(this->layers >= 1 && this->layers <= 20, "the number of layers must be 1 to 20");
  Require(Within(this->growth, 1.0, 2.0), "the growth of the layers must be 1 to 2");
  Require(
    Within(this->thickness, 0.05, 0.7), "the thickness of the layers must be 0.05 to 0.7 radii");
  Require(Within(this->extension, 0.0, 20.0), "the extension must be 0 to 20 diameters");
  for (const auto& [entity, length] : this->extensionOf)
  {
    Require(Within(length, 0.0, 20.0),
      "the extension of " + NameOfCap(entity) + " must be 0 to 20 diameters");
  }
}

Vector3 LayeredMesh::WithoutExtension(const Vector3& point) const
{
  for (const EndExtension& end : this->ends)
  {
    const Vector3 from = point - end.centre;
    const double along = end.outwards.dot(from);
    const double beside = (from - along * end.outwards).norm();
    // Nothing else can be inside of a straight piece.
    if (end.length > 0.0 && along > 0.0 && along <= end.length * (1.0 + Rounding) &&
      beside <= end.reach * (1.0 + Rounding))
    {
      return point - along * end.outwards;
    }
  }
  return point;
}

LayeredMesh MakeLayeredMesh(const CappedSurface& given, const LayeredMeshSettings& settings,
  const std::map<int, std::string>& patchName, const ProgressCallback& progress)
{
  settings.Validate();
  Require(given.entity.size() == given.triangles.size(),
    "the surface needs one entity for each triangle");
  const ClosedSurface closed = CheckSurface(given.points, given.triangles);
  Require(closed.volume.size() == 1,
    "the surface has " + std::to_string(closed.volume.size()) +
      " pieces; a mesh for flow is of one vessel tree");
  CappedSurface surface{ closed.points, closed.triangles, given.entity };
  std::vector<Cap> caps = CapsOf(surface);
  Require(!caps.empty(), "the surface has no caps: there is no way in or out");
  std::vector<EndExtension> ends;
  for (Cap& cap : caps)
  {
    const auto own = settings.extensionOf.find(cap.entity);
    const double diameters = own != settings.extensionOf.end() ? own->second : settings.extension;
    EndExtension end;
    end.entity = cap.entity;
    end.centre = cap.centre;
    end.outwards = cap.normal;
    end.radius = cap.radius;
    end.length = 2.0 * cap.radius * diameters;
    for (const std::int64_t p : cap.rim)
    {
      end.reach = std::max(end.reach, (surface.points[p] - cap.centre).norm());
    }
    ends.push_back(end);
    if (diameters > 0.0)
    {
      Extend(surface, cap, ends.back().length);
    }
  }
  if (!FindSelfIntersections(surface.points, surface.triangles, 1).empty())
  {
    throw SurfaceError(
      "the surface cuts itself, or an extension runs into another vessel: shorten the extensions",
      {});
  }
  WallOffset offset(surface, caps, settings);
  std::vector<Vector3> coreSurface;
  const TetrahedralMesh tetrahedra =
    MeshCore(surface, offset, settings.core, coreSurface, progress);

  LayeredMesh mesh = Assembly(surface, caps, offset, coreSurface, tetrahedra).Make(patchName);
  mesh.ends = std::move(ends);
  mesh.thinnest = offset.LeastShare();
  mesh.warnings = closed.warnings;
  mesh.warnings.insert(mesh.warnings.end(), tetrahedra.warnings.begin(), tetrahedra.warnings.end());
  Report(progress, 1.0);
  return mesh;
}
}
