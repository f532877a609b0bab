/**
 * @file VesselWallData.h
 * @brief What a VesselWall consists of: the moving surface, its boxes and patches, and what is kept for samples.
 */
#ifndef DynamicCoronary_VesselWallData_h
#define DynamicCoronary_VesselWallData_h

#include "BoxTree.h"
#include "NearestOnTriangle.h"
#include "Numbers.h"
#include "VesselWall.h"
#include "WallKernels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace coronary
{
constexpr double MaximumWallCoordinate = 1e5;

struct WallVertex
{
  Vector3 now;
  Vector3 next;
};

struct WallVertexNormal
{
  Vector3 now = Vector3::Zero();
  Vector3 next = Vector3::Zero();
  std::int64_t frame = -2; ///< that they are of
};

struct WallCorners
{
  std::array<std::int32_t, 3> vertex;
  std::array<std::int32_t, 3> beyond; ///< triangles beyond the edges AB, BC, CA
  std::int32_t patch = 0;
  bool wall = true; ///< not a cap
  bool open = false;
};

struct WallHit
{
  std::int32_t triangle = -1;
  double distance = Infinity;
  TrianglePoint on;
  bool hasNormal = false;
  Vector3 normal = Vector3::Zero();
};

enum class WallSide
{
  Inside,
  Outside,
  Free ///< beyond an open cap
};

/// Of a sample: as CandidateRun.
struct WallCandidates
{
  std::vector<std::int32_t> triangle;
  std::vector<float> distance;
  std::vector<float> speed;
  std::vector<float> passed;
  std::array<std::vector<float>, 3> place;

  void Clear()
  {
    this->triangle.clear();
    this->distance.clear();
    this->speed.clear();
    this->passed.clear();
    for (std::vector<float>& one : this->place)
    {
      one.clear();
    }
  }
  void Add(std::int32_t number, float far, float fast)
  {
    this->triangle.push_back(number);
    this->distance.push_back(far);
    this->speed.push_back(fast);
    this->passed.push_back(0.0f);
    for (std::vector<float>& one : this->place)
    {
      one.push_back(0.0f);
    }
  }
};

/// What is kept for a sample. The path is that of a point that moves with the wall next to the sample.
struct WallMemory
{
  std::int64_t index = 0;
  std::int32_t patch = -1;
  std::int32_t nearest = -1;
  WallSide side = WallSide::Inside;

  std::int64_t frame = -2; ///< when triangles were looked up
  double begin = 0.0;      ///< s since that frame began
  double rest = 0.0;       ///< s from then to the frame's end
  double window = 0.0;     ///< s that the list is valid
  Vector3 place = Vector3::Zero();
  Vector3 velocity = Vector3::Zero();
  double radius = 0.0;    ///< mm of the path in which all triangles are known
  double clearance = 0.0; ///< mm of the path in which there is none
  WallCandidates list;

  // Where its distance was known last, and how far from the wall it was at least: a sample that is inside by more
  // than it has moved can not have come to be outside.
  bool known = false;
  Vector3 knownAt = Vector3::Zero();
  double knownDistance = 0.0;
  double knownTime = 0.0;
  // The last place that was evaluated.
  std::int64_t seenFrame = -2;
  double seenTime = 0.0;
  Vector3 seen = Vector3::Zero();

  double range = 0.0; ///< mm, that contacts were last looked for in
  int planes = 0;
  std::array<Vector3, 2> normal;
  std::array<int, 2> identity{};
};

inline bool UsableWallPoint(const Vector3& p)
{
  return (p.array().abs() <= MaximumWallCoordinate).all(); // false for NaN
}

inline Vector3 UnitOrZero(const Vector3& v)
{
  const double length = v.norm();
  return length > 0.0 ? Vector3(v / length) : Vector3(Vector3::Zero());
}

/// @throws std::invalid_argument
void RequireWallPoints(const std::vector<Vector3>& points, std::size_t wanted);

struct VesselWall::Internals
{
  VesselWallSettings Settings;
  double Blend = 0.1;

  // Triangles and vertices in the order of the leaves.
  std::vector<WallCorners> Triangles;
  std::vector<std::int32_t> TriangleOf; ///< the topology's number
  std::vector<std::int32_t> PlaceOf;    ///< the topology's number to ours
  std::vector<WallVertex> Vertices;
  std::vector<std::int32_t> VertexOf; ///< the topology's number
  std::vector<int> Group;             ///< per vertex; may be empty
  std::vector<std::int32_t> AroundBegin;
  std::vector<std::int32_t> Around; ///< triangles around a vertex
  std::vector<WallVertexNormal> VertexNormals;

  // Boxes, at both key frames. Single precision rounds to nearest there; queries are padded for it.
  BoxTree Tree;
  std::vector<BoxNode> BoxesNow;
  std::vector<BoxNode> BoxesNext;
  double ExtentNow = 0.0; ///< greatest coordinate relative to the tree's centre
  double ExtentNext = 0.0;
  std::vector<std::int32_t> LeafBegin; ///< into LeafVertices
  std::vector<std::int32_t> LeafVertices;
  std::vector<Eigen::Array4f> Coordinates; ///< of the next key frame, relative to the tree's centre

  // Time.
  std::int64_t Frame = 0;
  double Seconds = 1.0;
  double FrameBegin = 0.0; ///< s since the first frame would have begun
  double Rate = 1.0;       ///< 1 / Seconds
  double Time = 0.0;
  double Fraction = 0.0;
  double VelocityChange = 0.0; ///< mm/s, greatest of any vertex from the last frame to this one

  // Patches.
  std::vector<std::vector<std::int32_t>> Near; ///< per patch: those that are near along the wall
  std::vector<std::uint32_t> Marked;
  std::uint32_t Mark = 0;
  std::int32_t MarkedPatch = -1;

  // Samples.
  std::unordered_map<std::int64_t, WallMemory> Memories; ///< by their number
  std::uint64_t Searches = 0;

  // Of the evaluation that was last.
  std::vector<WallHit> Hits;
  std::vector<Candidate> Sifted;
  std::vector<std::int32_t> Now;   ///< candidates that are looked at
  TriangleBatch Batch{};           ///< of these
  std::vector<std::int32_t> Later; ///< candidates within range that do not turn the first plane
  CandidateRun Run;
  std::vector<Vector3> AllPoints;
  std::vector<Vector3> AllNormals;

  // ---- The surface now.

  Vector3 At(std::int32_t vertex) const
  {
    const WallVertex& v = this->Vertices[vertex];
    return v.now + this->Fraction * (v.next - v.now);
  }
  Vector3 VelocityOf(std::int32_t vertex) const
  {
    const WallVertex& v = this->Vertices[vertex];
    return this->Rate * (v.next - v.now);
  }
  TrianglePoint Nearest(std::int32_t triangle, const Vector3& p, double beyond = Infinity) const
  {
    const std::array<std::int32_t, 3>& v = this->Triangles[triangle].vertex;
    return NearestOnTriangle(p, this->At(v[0]), this->At(v[1]), this->At(v[2]), beyond);
  }
  /// Outwards, as long as twice the area.
  Vector3 FaceNormal(std::int32_t triangle) const
  {
    const std::array<std::int32_t, 3>& v = this->Triangles[triangle].vertex;
    const Vector3 a = this->At(v[0]);
    return (this->At(v[1]) - a).cross(this->At(v[2]) - a);
  }
  Vector3 VelocityAt(std::int32_t triangle, double b, double c) const
  {
    const std::array<std::int32_t, 3>& v = this->Triangles[triangle].vertex;
    const Vector3 first = this->VelocityOf(v[0]);
    return first + b * (this->VelocityOf(v[1]) - first) + c * (this->VelocityOf(v[2]) - first);
  }

  Vector3 AngleNormal(std::int32_t vertex) const
  {
    const Vector3 here = this->At(vertex);
    Vector3 sum = Vector3::Zero();
    for (std::int32_t i = this->AroundBegin[vertex]; i < this->AroundBegin[vertex + 1]; ++i)
    {
      const std::array<std::int32_t, 3>& v = this->Triangles[this->Around[i]].vertex;
      const int k = v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
      const Vector3 first = this->At(v[(k + 1) % 3]) - here;
      const Vector3 second = this->At(v[(k + 2) % 3]) - here;
      const Vector3 normal = first.cross(second);
      const double length = normal.norm();
      if (length > 0.0)
      {
        sum += std::atan2(length, first.dot(second)) / length * normal;
      }
    }
    return sum;
  }

  /// The vertex or edge, as the triangles around it say: outwards.
  Vector3 PseudoNormal(std::int32_t triangle, TriangleFeature feature) const
  {
    const WallCorners& t = this->Triangles[triangle];
    switch (feature)
    {
      case TriangleFeature::Face:
      {
        const Vector3 normal = this->FaceNormal(triangle);
        return normal.squaredNorm() > 0.0 ? normal : this->AngleNormal(t.vertex[0]);
      }
      case TriangleFeature::EdgeAB:
      case TriangleFeature::EdgeBC:
      case TriangleFeature::EdgeCA:
      {
        const int edge = static_cast<int>(feature) - static_cast<int>(TriangleFeature::EdgeAB);
        const Vector3 normal =
          UnitOrZero(this->FaceNormal(triangle)) + UnitOrZero(this->FaceNormal(t.beyond[edge]));
        return normal.squaredNorm() > 0.0 ? normal : this->AngleNormal(t.vertex[edge]);
      }
      default:
        return this->AngleNormal(
          t.vertex[static_cast<int>(feature) - static_cast<int>(TriangleFeature::A)]);
    }
  }

  WallSide SideOf(const WallHit& hit, const Vector3& p) const
  {
    const Vector3 away = p - hit.on.point;
    if (!(away.dot(this->PseudoNormal(hit.triangle, hit.on.feature)) > 0.0))
    {
      return WallSide::Inside;
    }
    const WallCorners& t = this->Triangles[hit.triangle];
    if (t.open)
    {
      return WallSide::Free;
    }
    // At the rim of an open cap: what is beyond the cap's plane is free.
    const auto beyondCap = [&](std::int32_t other)
    { return this->Triangles[other].open && away.dot(this->FaceNormal(other)) > 0.0; };
    const int feature = static_cast<int>(hit.on.feature);
    bool free = false;
    if (feature >= static_cast<int>(TriangleFeature::A))
    {
      const std::int32_t vertex = t.vertex[feature - static_cast<int>(TriangleFeature::A)];
      for (std::int32_t i = this->AroundBegin[vertex]; i < this->AroundBegin[vertex + 1]; ++i)
      {
        free = free || beyondCap(this->Around[i]);
      }
    }
    else if (feature >= static_cast<int>(TriangleFeature::EdgeAB))
    {
      free = beyondCap(t.beyond[feature - static_cast<int>(TriangleFeature::EdgeAB)]);
    }
    return free ? WallSide::Free : WallSide::Outside;
  }

  /// Of the wall without its caps, into the lumen.
  Vector3 KeyNormal(std::int32_t vertex, bool next) const
  {
    Vector3 sum = Vector3::Zero();
    for (std::int32_t i = this->AroundBegin[vertex]; i < this->AroundBegin[vertex + 1]; ++i)
    {
      const WallCorners& t = this->Triangles[this->Around[i]];
      if (t.wall)
      {
        const WallVertex& a = this->Vertices[t.vertex[0]];
        const WallVertex& b = this->Vertices[t.vertex[1]];
        const WallVertex& c = this->Vertices[t.vertex[2]];
        sum -= next ? Vector3((b.next - a.next).cross(c.next - a.next))
                    : Vector3((b.now - a.now).cross(c.now - a.now));
      }
    }
    return UnitOrZero(sum);
  }

  Vector3 NormalAt(std::int32_t vertex)
  {
    WallVertexNormal& normal = this->VertexNormals[vertex];
    if (normal.frame != this->Frame)
    {
      normal.now = normal.frame == this->Frame - 1 ? normal.next : this->KeyNormal(vertex, false);
      normal.next = this->KeyNormal(vertex, true);
      normal.frame = this->Frame;
    }
    return normal.now + this->Fraction * (normal.next - normal.now);
  }

  /// Of a place, into the lumen: smooth on the wall.
  const Vector3& SmoothNormal(WallHit& hit)
  {
    if (!hit.hasNormal)
    {
      hit.hasNormal = true;
      const WallCorners& t = this->Triangles[hit.triangle];
      double length = 0.0;
      if (t.wall)
      {
        hit.normal = (1.0 - hit.on.b - hit.on.c) * this->NormalAt(t.vertex[0]) +
          hit.on.b * this->NormalAt(t.vertex[1]) + hit.on.c * this->NormalAt(t.vertex[2]);
        length = hit.normal.norm();
      }
      hit.normal = length > 1e-3
        ? Vector3(hit.normal / length)
        : Vector3(-UnitOrZero(this->PseudoNormal(hit.triangle, hit.on.feature)));
    }
    return hit.normal;
  }

  // ---- Set up.

  void Build(const WallTopology& topology, const std::vector<Vector3>& points);
  void BuildPatches();
  /// @return its coordinates relative to the tree's centre
  Eigen::Array4f SetNext(std::size_t vertex, const Vector3& p)
  {
    WallVertex& v = this->Vertices[vertex];
    v.now = v.next;
    v.next = p;
    const Vector3 relative = p - this->Tree.Centre();
    // In one piece: four numbers that are written one by one can not be read at once for a while.
    const Eigen::Array4f coordinates(static_cast<float>(relative[0]),
      static_cast<float>(relative[1]), static_cast<float>(relative[2]), 0.0f);
    this->Coordinates[vertex] = coordinates;
    return coordinates;
  }
  /// Puts boxes around the vertices that come next.
  void Refit();

  // ---- Boxes.

  float Padding(const Vector3& relative) const
  {
    const double extent =
      std::max({ this->ExtentNow, this->ExtentNext, relative.cwiseAbs().maxCoeff() });
    return static_cast<float>(4e-6 * extent + 1e-6);
  }

  void MarkAround(std::int32_t patch)
  {
    if (patch == this->MarkedPatch)
    {
      return;
    }
    this->MarkedPatch = patch;
    if (++this->Mark == 0)
    {
      std::fill(this->Marked.begin(), this->Marked.end(), 0u);
      this->Mark = 1;
    }
    for (const std::int32_t other : this->Near[patch])
    {
      this->Marked[other] = this->Mark;
    }
  }
  bool IsMarked(std::int32_t triangle) const
  {
    return this->Marked[this->Triangles[triangle].patch] == this->Mark;
  }

  WallHit ClosestTo(const Vector3& p, std::int32_t patch, std::int32_t hint);
  template <typename Visit>
  void ForEachNear(const Vector3& p, const Vector3& velocity, double window, double radius,
    const Visit& visit) const;

  // ---- Samples.

  WallMemory& Of(std::int64_t index);
  void Place(std::int64_t index, std::int32_t patch, std::int32_t nearest);

  /// Since triangles were looked up, and how far the sample may be from its path against the wall.
  bool Valid(const WallMemory& memory, const Vector3& p, double& drift) const;
  void Search(WallMemory& memory, const Vector3& p, double range);
  /// SideOf, unless the sample can not have got there since it was seen: next to slivers of the mesh the side of
  /// a place may be told wrongly.
  WallSide SideSinceSeen(WallMemory& memory, const WallHit& hit, const Vector3& p);
  void RememberDistance(WallMemory& memory, const Vector3& p, double distance);
  /// Fills the list for the path that begins at p and moves with the wall at `hit`; the least distance now.
  double Collect(WallMemory& memory, const WallHit& hit, const Vector3& p, double radius);
  /// The nearest places of all triangles that matter; false if there is no wall within `range` (and then
  /// the side is the one that it was).
  bool Evaluate(WallMemory& memory, const Vector3& p, double range, WallHit& nearest);
  /// Which candidates are looked at now, and which may be later.
  void Sift(const WallMemory& memory);
  /// Where these candidates are nearest now. @param visit  gets of each its distance, rounded down, and its place
  template <typename Visit>
  void Look(WallMemory& memory, const Vector3& p, const std::vector<std::int32_t>& which,
    const Visit& visit);
  /// Adds the hits within range that may be of another side than `first`.
  void EvaluateLater(WallMemory& memory, const Vector3& p, double range, const Vector3* first);
  /// @param first  normal of the plane that this one is another side of; null: there is none
  /// @param limit  mm: triangles up to this distance are known
  ContactPlane MakePlane(
    const ContactSample& sample, WallHit& hit, WallSide side, double limit, const Vector3* first);
  WallPlace PlaceFrom(const WallHit& hit, WallSide side) const;
};
}

#endif
