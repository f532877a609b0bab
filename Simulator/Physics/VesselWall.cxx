#include "VesselWall.h"

#include "TriangleBvh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

namespace coronary
{
namespace
{
constexpr double GreatestCoordinate = 1e5;
constexpr int Width = 8;
constexpr int LeafSize = 4;
constexpr double PatchRadius = 1.0; ///< mm along the wall
constexpr double Infinity = std::numeric_limits<double>::infinity();

/// Boxes of the children at both key frames, relative to the hierarchy's centre.
struct alignas(64) Node
{
  float low[2][3][Width];
  float high[2][3][Width];
};

struct Vertex
{
  Vector3 now;
  Vector3 next;
};

struct VertexNormal
{
  Vector3 now = Vector3::Zero();
  Vector3 next = Vector3::Zero();
  std::int64_t frame = -2; ///< that they are of
};

struct Corners
{
  std::array<std::int32_t, 3> vertex;
  std::array<std::int32_t, 3> beyond; ///< triangles beyond the edges AB, BC, CA
  std::int32_t patch = 0;
  bool wall = true; ///< not a cap
  bool open = false;
};

struct OnTriangle
{
  Vector3 point = Vector3::Zero();
  double squared = Infinity;
  double b = 0.0; ///< barycentric of the second and third corner
  double c = 0.0;
  TriangleFeature feature = TriangleFeature::Face;
};

struct Hit
{
  std::int32_t triangle = -1;
  double distance = Infinity;
  OnTriangle on;
  bool hasNormal = false;
  Vector3 normal = Vector3::Zero();
};

enum class Side
{
  Inside,
  Outside,
  Free ///< beyond an open cap
};

/// A triangle that may matter, and where it was last: until sample and triangle have moved by what it was too far,
/// it need not be looked at.
struct Candidate
{
  std::int32_t triangle;
  float distance; ///< then, rounded down, mm
  float speed;    ///< mm/s: greatest of its corners against the path
  float passed;   ///< s since triangles were looked up
  float place[3]; ///< of the sample against the path, mm
};

/// What is kept for a sample. The path is that of a point that moves with the wall next to the sample.
struct Memory
{
  std::int64_t index = 0;
  std::int32_t patch = -1;
  std::int32_t nearest = -1;
  Side side = Side::Inside;

  std::int64_t frame = -2; ///< when triangles were looked up
  double begin = 0.0;      ///< s since that frame began
  double rest = 0.0;       ///< s from then to the frame's end
  double window = 0.0;     ///< s that the list is valid
  Vector3 place = Vector3::Zero();
  Vector3 velocity = Vector3::Zero();
  double radius = 0.0;    ///< mm of the path in which all triangles are known
  double clearance = 0.0; ///< mm of the path in which there is none
  std::vector<Candidate> list;

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

  void Reset(std::int64_t newIndex)
  {
    this->index = newIndex;
    this->patch = -1;
    this->nearest = -1;
    this->side = Side::Inside;
    this->frame = -2;
    this->known = false;
    this->seenFrame = -2;
    this->range = 0.0;
    this->planes = 0;
    this->list.clear();
  }
};

OnTriangle NearestOnSliver(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c)
{
  const TrianglePoint robust = NearestOnTriangle(p, a, b, c);
  OnTriangle on;
  on.point = robust.point;
  on.squared = robust.squaredDistance;
  on.feature = robust.feature;
  const auto fraction = [&](const Vector3& from, const Vector3& to)
  {
    const double square = (to - from).squaredNorm();
    return square > 0.0 ? std::clamp((on.point - from).dot(to - from) / square, 0.0, 1.0) : 0.0;
  };
  switch (robust.feature)
  {
    case TriangleFeature::Face:
    {
      const Vector3 normal = (b - a).cross(c - a);
      const double area = normal.squaredNorm();
      on.b = std::clamp((on.point - a).cross(c - a).dot(normal) / area, 0.0, 1.0);
      on.c = std::clamp((b - a).cross(on.point - a).dot(normal) / area, 0.0, 1.0 - on.b);
      break;
    }
    case TriangleFeature::EdgeAB:
      on.b = fraction(a, b);
      break;
    case TriangleFeature::EdgeBC:
      on.c = fraction(b, c);
      on.b = 1.0 - on.c;
      break;
    case TriangleFeature::EdgeCA:
      on.c = 1.0 - fraction(c, a);
      break;
    case TriangleFeature::A:
      break;
    case TriangleFeature::B:
      on.b = 1.0;
      break;
    case TriangleFeature::C:
      on.c = 1.0;
      break;
  }
  return on;
}

/// @param beyond  mm; if the triangle is certainly further, its square may be infinite
inline OnTriangle NearestOn(
  const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c, double beyond = Infinity)
{
  const Vector3 ab = b - a;
  const Vector3 ac = c - a;
  const Vector3 ap = p - a;
  const double d00 = ab.squaredNorm();
  const double d01 = ab.dot(ac);
  const double d11 = ac.squaredNorm();
  OnTriangle on;
  if (beyond < Infinity)
  {
    const double longest = std::max(d00, d11);
    const double distance = ap.squaredNorm();
    // (beyond + longest)^2 is at most 2 beyond^2 + 2 longest^2.
    if (distance > 2.0 * (beyond * beyond + longest))
    {
      return on;
    }
  }
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  const double area = d00 * d11 - d01 * d01;
  if (!(area > 1e-8 * d00 * d11))
  {
    return NearestOnSliver(p, a, b, c);
  }
  const double v = d11 * d1 - d01 * d2;
  const double w = d00 * d2 - d01 * d1;
  if (v > 0.0 && w > 0.0 && v + w < area)
  {
    const double scale = 1.0 / area;
    on.b = scale * v;
    on.c = scale * w;
    on.point = a + on.b * ab + on.c * ac;
    on.squared = (p - on.point).squaredNorm();
    return on;
  }
  // The nearest point is on an edge that p sees: one or two of them.
  double x = 0.0;
  double y = 0.0;
  double squared = Infinity; // less that of ap
  TriangleFeature feature = TriangleFeature::A;
  if (w <= 0.0)
  {
    x = d1 <= 0.0 ? 0.0 : d1 >= d00 ? 1.0 : d1 / d00;
    feature = d1 <= 0.0 ? TriangleFeature::A
      : d1 >= d00       ? TriangleFeature::B
                        : TriangleFeature::EdgeAB;
    squared = x * (x * d00 - 2.0 * d1);
  }
  if (v <= 0.0)
  {
    const double t = d2 <= 0.0 ? 0.0 : d2 >= d11 ? 1.0 : d2 / d11;
    const double other = t * (t * d11 - 2.0 * d2);
    if (other < squared)
    {
      squared = other;
      x = 0.0;
      y = t;
      feature = d2 <= 0.0 ? TriangleFeature::A
        : d2 >= d11       ? TriangleFeature::C
                          : TriangleFeature::EdgeCA;
    }
  }
  if (v + w >= area)
  {
    const double along = (d2 - d01) - (d1 - d00);
    const double length = d00 + d11 - 2.0 * d01;
    const double t = along <= 0.0 ? 0.0 : along >= length ? 1.0 : along / length;
    const double u = 1.0 - t;
    const double other = u * (u * d00 - 2.0 * d1) + t * (t * d11 - 2.0 * d2) + 2.0 * u * t * d01;
    if (other < squared)
    {
      x = u;
      y = t;
      feature = along <= 0.0 ? TriangleFeature::B
        : along >= length    ? TriangleFeature::C
                             : TriangleFeature::EdgeBC;
    }
  }
  on.b = x;
  on.c = y;
  on.point = a + x * ab + y * ac;
  on.squared = (p - on.point).squaredNorm();
  on.feature = feature;
  return on;
}

bool Usable(const Vector3& p)
{
  return (p.array().abs() <= GreatestCoordinate).all(); // false for NaN
}

Vector3 UnitOrZero(const Vector3& v)
{
  const double length = v.norm();
  return length > 0.0 ? Vector3(v / length) : Vector3(Vector3::Zero());
}

/// 0 below `from`, 1 above `to`, with level ends.
double Ramp(double x, double from, double to)
{
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

void RequirePoints(const std::vector<Vector3>& points, std::size_t wanted)
{
  if (points.size() != wanted)
  {
    throw std::invalid_argument(
      "the wall has " + std::to_string(wanted) + " points, not " + std::to_string(points.size()));
  }
  const auto bad = std::find_if_not(points.begin(), points.end(), Usable);
  if (bad != points.end())
  {
    throw std::invalid_argument("point " + std::to_string(bad - points.begin()) +
      " of the wall is not finite or beyond 1e5 mm");
  }
}

/// Triangles beyond the edges AB, BC, CA. Throws what CheckWallSurface says.
std::vector<std::array<std::int32_t, 3>> Neighbours(
  const WallTopology& topology, const std::vector<Vector3>& points)
{
  if (topology.points != static_cast<std::int64_t>(points.size()))
  {
    throw std::invalid_argument("the wall's topology has " + std::to_string(topology.points) +
      " points, and " + std::to_string(points.size()) + " positions are given");
  }
  const std::size_t count = topology.triangles.size();
  if (count == 0)
  {
    throw std::invalid_argument("the wall has no triangles");
  }
  if (!topology.entity.empty() && topology.entity.size() != count)
  {
    throw std::invalid_argument("the wall has " + std::to_string(count) + " triangles, and " +
      std::to_string(topology.entity.size()) + " entities");
  }
  if (!topology.group.empty() && topology.group.size() != points.size())
  {
    throw std::invalid_argument("the wall has " + std::to_string(points.size()) + " points, and " +
      std::to_string(topology.group.size()) + " groups");
  }
  RequirePoints(points, points.size());
  for (std::size_t i = 0; i < count; ++i)
  {
    const Triangle& t = topology.triangles[i];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
    {
      throw std::invalid_argument(
        "triangle " + std::to_string(i) + " of the wall has a point twice");
    }
  }
  if (count > (std::size_t(1) << 29) || points.size() > (std::size_t(1) << 29))
  {
    throw std::invalid_argument("the wall has more than 536870912 triangles or points");
  }
  for (std::size_t i = 0; i < count; ++i)
  {
    for (const std::int64_t corner : topology.triangles[i])
    {
      if (corner < 0 || corner >= topology.points)
      {
        throw std::invalid_argument("triangle " + std::to_string(i) +
          " of the wall refers to point " + std::to_string(corner) + " of " +
          std::to_string(topology.points));
      }
    }
  }
  // Half edges, sorted: each one and its opposite once.
  struct HalfEdge
  {
    std::int64_t low, high;
    bool rising;
    std::int32_t triangle;
    int edge;
  };
  std::vector<HalfEdge> edges;
  edges.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      const std::int64_t from = topology.triangles[i][k];
      const std::int64_t to = topology.triangles[i][(k + 1) % 3];
      edges.push_back(
        { std::min(from, to), std::max(from, to), from < to, static_cast<std::int32_t>(i), k });
    }
  }
  std::sort(edges.begin(), edges.end(),
    [](const HalfEdge& s, const HalfEdge& t)
    {
      return std::tie(s.low, s.high, s.rising, s.triangle) <
        std::tie(t.low, t.high, t.rising, t.triangle);
    });
  std::vector<std::array<std::int32_t, 3>> beyond(count);
  for (std::size_t i = 0; i < edges.size(); i += 2)
  {
    const auto same = [&](std::size_t j)
    { return j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high; };
    if (!same(i + 1) || same(i + 2) || edges[i].rising == edges[i + 1].rising)
    {
      throw std::invalid_argument("the edge between points " + std::to_string(edges[i].low) +
        " and " + std::to_string(edges[i].high) +
        " of the wall does not belong to two triangles that run along it in opposite directions");
    }
    beyond[edges[i].triangle][edges[i].edge] = edges[i + 1].triangle;
    beyond[edges[i + 1].triangle][edges[i + 1].edge] = edges[i].triangle;
  }

  // Components, and whether they look outwards.
  std::vector<char> seen(count, 0);
  std::vector<std::int32_t> stack;
  for (std::size_t i = 0; i < count; ++i)
  {
    if (seen[i])
    {
      continue;
    }
    double volume = 0.0;
    const Vector3 origin = points[topology.triangles[i][0]];
    seen[i] = 1;
    stack.assign(1, static_cast<std::int32_t>(i));
    while (!stack.empty())
    {
      const std::int32_t current = stack.back();
      stack.pop_back();
      const Triangle& t = topology.triangles[current];
      volume += (points[t[0]] - origin).dot((points[t[1]] - origin).cross(points[t[2]] - origin));
      for (const std::int32_t other : beyond[current])
      {
        if (!seen[other])
        {
          seen[other] = 1;
          stack.push_back(other);
        }
      }
    }
    if (!(volume > 0.0))
    {
      throw std::invalid_argument("the component of the wall with triangle " + std::to_string(i) +
        " is not oriented outwards");
    }
  }
  return beyond;
}
}

void CheckWallSurface(const WallTopology& topology, const std::vector<Vector3>& points)
{
  Neighbours(topology, points);
}

void VesselWallSettings::Validate() const
{
  const auto require = [](bool good, const char* name, double value, const char* range)
  {
    if (!good)
    {
      throw std::invalid_argument(
        std::string(name) + " of the wall is " + std::to_string(value) + ", not " + range);
    }
  };
  require(friction >= 0.0 && friction <= 10.0, "friction", friction, "0 to 10");
  require(stiffness > 0.0 && std::isfinite(stiffness), "stiffness", stiffness, "positive");
  require(
    surfaceReach >= 1.0 && surfaceReach <= 100.0, "surfaceReach", surfaceReach, "1 to 100 mm");
  require(margin >= 0.01 && margin <= 5.0, "margin", margin, "0.01 to 5 mm");
  require(blend >= 0.0 && blend <= 5.0, "blend", blend, "0 to 5 mm");
}

struct VesselWall::Internals
{
  VesselWallSettings Settings;
  double Blend = 0.1;

  // Triangles and vertices in the order of the leaves.
  std::vector<Corners> Triangles;
  std::vector<std::int32_t> TriangleOf; ///< the topology's number
  std::vector<std::int32_t> PlaceOf;    ///< the topology's number to ours
  std::vector<Vertex> Vertices;
  std::vector<std::int32_t> VertexOf; ///< the topology's number
  std::vector<int> Group;             ///< per vertex; may be empty
  std::vector<std::int32_t> AroundBegin;
  std::vector<std::int32_t> Around; ///< triangles around a vertex
  std::vector<VertexNormal> VertexNormals;

  // Boxes.
  Vector3 Centre = Vector3::Zero();
  std::vector<std::int64_t> LevelBegin; ///< of the nodes above the leaves, then of those above them
  std::vector<std::int64_t> LevelSize;
  std::vector<Node> Nodes;
  std::vector<std::int32_t> LeafBegin; ///< into LeafVertices
  std::vector<std::int32_t> LeafVertices;
  std::vector<Eigen::Array4f> Coordinates; ///< of the next key frame, relative to the centre
  double Extent[2] = { 0.0, 0.0 };         ///< greatest coordinate relative to the centre
  int Now = 0;                             ///< which of the boxes are those of `now`

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
  std::vector<Memory> Memories;
  std::vector<std::int32_t> Unused;
  std::vector<std::int32_t> Table; ///< open addressing: into Memories, -1: empty
  std::size_t Known = 0;
  std::uint64_t Searches = 0;

  // Of the evaluation that was last.
  std::vector<Hit> Hits;
  std::vector<std::int32_t> Later; ///< candidates within range that do not turn the first plane
  float Passed = 0.0f;             ///< s since triangles were looked up
  float Offset[3] = { 0.0f, 0.0f, 0.0f };
  std::vector<Vector3> AllPoints;
  std::vector<Vector3> AllNormals;

  // ---- The surface now.

  Vector3 At(std::int32_t vertex) const
  {
    const Vertex& v = this->Vertices[vertex];
    return v.now + this->Fraction * (v.next - v.now);
  }
  Vector3 VelocityOf(std::int32_t vertex) const
  {
    const Vertex& v = this->Vertices[vertex];
    return this->Rate * (v.next - v.now);
  }
  OnTriangle Nearest(std::int32_t triangle, const Vector3& p, double beyond = Infinity) const
  {
    const std::array<std::int32_t, 3>& v = this->Triangles[triangle].vertex;
    return NearestOn(p, this->At(v[0]), this->At(v[1]), this->At(v[2]), beyond);
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
    const Corners& t = this->Triangles[triangle];
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

  Side SideOf(const Hit& hit, const Vector3& p) const
  {
    const Vector3 away = p - hit.on.point;
    if (!(away.dot(this->PseudoNormal(hit.triangle, hit.on.feature)) > 0.0))
    {
      return Side::Inside;
    }
    const Corners& t = this->Triangles[hit.triangle];
    if (t.open)
    {
      return Side::Free;
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
    return free ? Side::Free : Side::Outside;
  }

  /// Of the wall without its caps, into the lumen.
  Vector3 KeyNormal(std::int32_t vertex, bool next) const
  {
    Vector3 sum = Vector3::Zero();
    for (std::int32_t i = this->AroundBegin[vertex]; i < this->AroundBegin[vertex + 1]; ++i)
    {
      const Corners& t = this->Triangles[this->Around[i]];
      if (t.wall)
      {
        const Vertex& a = this->Vertices[t.vertex[0]];
        const Vertex& b = this->Vertices[t.vertex[1]];
        const Vertex& c = this->Vertices[t.vertex[2]];
        sum -= next ? Vector3((b.next - a.next).cross(c.next - a.next))
                    : Vector3((b.now - a.now).cross(c.now - a.now));
      }
    }
    return UnitOrZero(sum);
  }

  Vector3 NormalAt(std::int32_t vertex)
  {
    VertexNormal& normal = this->VertexNormals[vertex];
    if (normal.frame != this->Frame)
    {
      normal.now = normal.frame == this->Frame - 1 ? normal.next : this->KeyNormal(vertex, false);
      normal.next = this->KeyNormal(vertex, true);
      normal.frame = this->Frame;
    }
    return normal.now + this->Fraction * (normal.next - normal.now);
  }

  /// Of a place, into the lumen: smooth on the wall.
  const Vector3& SmoothNormal(Hit& hit)
  {
    if (!hit.hasNormal)
    {
      hit.hasNormal = true;
      const Corners& t = this->Triangles[hit.triangle];
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
  void Refit();

  // ---- Boxes.

  float Padding(const Vector3& relative) const
  {
    const double extent =
      std::max({ this->Extent[0], this->Extent[1], relative.cwiseAbs().maxCoeff() });
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

  Hit ClosestTo(const Vector3& p, std::int32_t patch, std::int32_t hint);
  template <typename Visit>
  void ForEachNear(const Vector3& p, const Vector3& velocity, double window, double radius,
    const Visit& visit) const;

  // ---- Samples.

  static std::size_t Hash(std::int64_t index)
  {
    auto x = static_cast<std::uint64_t>(index) * 0x9E3779B97F4A7C15ull;
    return static_cast<std::size_t>(x ^ (x >> 29));
  }
  std::int32_t Known_(std::int64_t index) const
  {
    const std::size_t mask = this->Table.size() - 1;
    for (std::size_t i = Hash(index) & mask;; i = (i + 1) & mask)
    {
      const std::int32_t slot = this->Table[i];
      if (slot < 0 || this->Memories[slot].index == index)
      {
        return slot;
      }
    }
  }
  void Insert(std::int32_t slot)
  {
    const std::size_t mask = this->Table.size() - 1;
    std::size_t i = Hash(this->Memories[slot].index) & mask;
    while (this->Table[i] >= 0)
    {
      i = (i + 1) & mask;
    }
    this->Table[i] = slot;
  }
  Memory& Of(std::int64_t index);
  void Forget(std::int64_t index);

  /// Since triangles were looked up, and how far the sample may be from its path against the wall.
  bool Valid(const Memory& memory, const Vector3& p, double& drift) const;
  void Search(Memory& memory, const Vector3& p, double range);
  /// SideOf, unless the sample can not have got there since it was seen: next to slivers of the mesh the side of
  /// a place may be told wrongly.
  Side Judge(Memory& memory, const Hit& hit, const Vector3& p);
  void Know(Memory& memory, const Vector3& p, double distance);
  /// Fills the list for the path that begins at p and moves with the wall at `hit`; the least distance now.
  double Collect(Memory& memory, const Hit& hit, const Vector3& p, double radius);
  /// The nearest places of all triangles that matter; false if there is no wall within `range` (and then
  /// the side is the one that it was).
  bool Evaluate(Memory& memory, const Vector3& p, double range, Hit& nearest);
  Hit Look(Candidate& candidate, const Vector3& p) const;
  /// Adds the hits within range that may be of another side than `first`.
  void EvaluateLater(Memory& memory, const Vector3& p, double range, const Vector3* first);
  /// @param first  normal of the plane that this one is another side of; null: there is none
  /// @param limit  mm: triangles up to this distance are known
  ContactPlane MakePlane(
    const ContactSample& sample, Hit& hit, Side side, double limit, const Vector3* first);
  WallPlace PlaceFrom(const Hit& hit, Side side) const;
};

void VesselWall::Internals::Build(const WallTopology& topology, const std::vector<Vector3>& points)
{
  const std::size_t count = topology.triangles.size();
  const std::vector<std::array<std::int32_t, 3>> beyond = Neighbours(topology, points);
  for (const int cap : this->Settings.openCaps)
  {
    if (cap < 2 ||
      std::find(topology.entity.begin(), topology.entity.end(), cap) == topology.entity.end())
    {
      throw std::invalid_argument("the wall has no cap of entity " + std::to_string(cap));
    }
  }

  // Checks the indices, too.
  const TriangleBvh order(points, topology.triangles);
  this->TriangleOf = order.Order();
  this->PlaceOf.resize(count);
  std::vector<std::int32_t> vertexPlace(points.size(), -1);
  this->Triangles.resize(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::int32_t original = this->TriangleOf[i];
    this->PlaceOf[original] = static_cast<std::int32_t>(i);
    Corners& t = this->Triangles[i];
    for (int k = 0; k < 3; ++k)
    {
      std::int32_t& place = vertexPlace[topology.triangles[original][k]];
      if (place < 0)
      {
        place = static_cast<std::int32_t>(this->VertexOf.size());
        this->VertexOf.push_back(static_cast<std::int32_t>(topology.triangles[original][k]));
      }
      t.vertex[k] = place;
    }
    const int entity = topology.entity.empty() ? 1 : topology.entity[original];
    t.wall = entity == 1;
    t.open = std::find(this->Settings.openCaps.begin(), this->Settings.openCaps.end(), entity) !=
      this->Settings.openCaps.end();
  }
  // Points without triangles move, too.
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (vertexPlace[i] < 0)
    {
      this->VertexOf.push_back(static_cast<std::int32_t>(i));
    }
  }
  this->Vertices.resize(points.size());
  this->VertexNormals.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    this->Vertices[i] = { points[this->VertexOf[i]], points[this->VertexOf[i]] };
    if (!topology.group.empty())
    {
      this->Group.push_back(topology.group[this->VertexOf[i]]);
    }
  }

  double edgeSum = 0.0;
  for (std::size_t i = 0; i < count; ++i)
  {
    for (int k = 0; k < 3; ++k)
    {
      const Triangle& t = topology.triangles[this->TriangleOf[i]];
      edgeSum += (points[t[k]] - points[t[(k + 1) % 3]]).norm();
      this->Triangles[i].beyond[k] = this->PlaceOf[beyond[this->TriangleOf[i]][k]];
    }
  }
  this->Blend = this->Settings.blend > 0.0
    ? this->Settings.blend
    : std::clamp(0.3 * edgeSum / static_cast<double>(3 * count), 1e-6, 5.0);

  this->AroundBegin.assign(points.size() + 1, 0);
  for (const Corners& t : this->Triangles)
  {
    for (const std::int32_t v : t.vertex)
    {
      ++this->AroundBegin[v + 1];
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    this->AroundBegin[i + 1] += this->AroundBegin[i];
  }
  this->Around.resize(3 * count);
  std::vector<std::int32_t> fill(this->AroundBegin.begin(), this->AroundBegin.end() - 1);
  for (std::size_t i = 0; i < count; ++i)
  {
    for (const std::int32_t v : this->Triangles[i].vertex)
    {
      this->Around[fill[v]++] = static_cast<std::int32_t>(i);
    }
  }

  // The hierarchy: leaves in the order of the tree that TriangleBvh builds, whose subtrees are full.
  const auto leaves = static_cast<std::int64_t>((count + LeafSize - 1) / LeafSize);
  std::int64_t below = leaves;
  do
  {
    below = (below + Width - 1) / Width;
    this->LevelBegin.push_back(static_cast<std::int64_t>(this->Nodes.size()));
    this->LevelSize.push_back(below);
    this->Nodes.resize(this->Nodes.size() + below);
  } while (below > 1);
  for (Node& node : this->Nodes)
  {
    // What is missing is far away.
    std::fill(&node.low[0][0][0], &node.low[0][0][0] + 2 * 3 * Width, 1e15f);
    std::fill(&node.high[0][0][0], &node.high[0][0][0] + 2 * 3 * Width, 1e15f);
  }
  std::vector<std::int32_t> corners;
  this->LeafBegin.push_back(0);
  for (std::int64_t i = 0; i < leaves; ++i)
  {
    corners.clear();
    for (auto t = static_cast<std::size_t>(LeafSize * i);
         t < std::min(count, static_cast<std::size_t>(LeafSize * (i + 1))); ++t)
    {
      corners.insert(
        corners.end(), this->Triangles[t].vertex.begin(), this->Triangles[t].vertex.end());
    }
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    this->LeafVertices.insert(this->LeafVertices.end(), corners.begin(), corners.end());
    this->LeafBegin.push_back(static_cast<std::int32_t>(this->LeafVertices.size()));
  }
  Vector3 low = points[0];
  Vector3 high = points[0];
  for (const Vector3& p : points)
  {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  this->Centre = 0.5 * (low + high);
  this->Coordinates.resize(points.size());
  for (int time = 0; time < 2; ++time)
  {
    this->Now = 1 - this->Now;
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      const Vector3 relative = this->Vertices[i].next - this->Centre;
      this->Coordinates[i] << relative.cast<float>().array(), 0.0f;
    }
    this->Extent[1 - this->Now] = (0.5 * (high - low)).maxCoeff();
    this->Refit();
  }
  this->BuildPatches();
  this->Table.assign(256, -1);
  this->Memories.reserve(128);
  this->Hits.reserve(256);
  this->Later.reserve(256);
}

void VesselWall::Internals::BuildPatches()
{
  const std::size_t count = this->Triangles.size();
  const auto centreOf = [&](std::int32_t i)
  {
    const std::array<std::int32_t, 3>& v = this->Triangles[i].vertex;
    return Vector3(
      (this->Vertices[v[0]].now + this->Vertices[v[1]].now + this->Vertices[v[2]].now) / 3.0);
  };
  std::vector<Vector3> centres(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    centres[i] = centreOf(static_cast<std::int32_t>(i));
    this->Triangles[i].patch = -1;
  }
  using Entry = std::pair<double, std::int32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> queue;
  std::vector<double> way(count, Infinity); ///< to the first triangle of the own patch
  std::int32_t patches = 0;
  for (std::size_t seed = 0; seed < count; ++seed)
  {
    if (this->Triangles[seed].patch >= 0)
    {
      continue;
    }
    way[seed] = 0.0;
    queue.emplace(0.0, static_cast<std::int32_t>(seed));
    while (!queue.empty())
    {
      const auto [length, i] = queue.top();
      queue.pop();
      if (this->Triangles[i].patch >= 0)
      {
        continue;
      }
      this->Triangles[i].patch = patches;
      way[i] = length;
      for (const std::int32_t other : this->Triangles[i].beyond)
      {
        const double further = length + (centres[other] - centres[i]).norm();
        if (this->Triangles[other].patch < 0 && further <= PatchRadius)
        {
          queue.emplace(further, other);
        }
      }
    }
    ++patches;
  }
  std::vector<std::map<std::int32_t, double>> links(patches);
  for (std::size_t i = 0; i < count; ++i)
  {
    for (const std::int32_t other : this->Triangles[i].beyond)
    {
      const std::int32_t from = this->Triangles[i].patch;
      const std::int32_t to = this->Triangles[other].patch;
      if (from != to)
      {
        const double length = way[i] + (centres[i] - centres[other]).norm() + way[other];
        const auto [entry, isNew] = links[from].try_emplace(to, length);
        entry->second = std::min(entry->second, length);
      }
    }
  }
  // Ways from centre to centre are longer than the shortest one by up to about a seventh.
  const double limit = 1.15 * this->Settings.surfaceReach + 2.0 * PatchRadius;
  this->Near.resize(patches);
  std::vector<double> reached(patches, Infinity);
  for (std::int32_t patch = 0; patch < patches; ++patch)
  {
    std::vector<std::int32_t>& near = this->Near[patch];
    reached[patch] = 0.0;
    near.push_back(patch);
    queue.emplace(0.0, patch);
    while (!queue.empty())
    {
      const auto [length, i] = queue.top();
      queue.pop();
      if (length > reached[i])
      {
        continue;
      }
      for (const auto& [other, step] : links[i])
      {
        const double further = length + step;
        if (further <= limit && further < reached[other])
        {
          if (reached[other] == Infinity)
          {
            near.push_back(other);
          }
          reached[other] = further;
          queue.emplace(further, other);
        }
      }
    }
    for (const std::int32_t other : near)
    {
      reached[other] = Infinity;
    }
  }
  this->Marked.assign(patches, 0u);
}

void VesselWall::Internals::Refit()
{
  const int next = 1 - this->Now;
  // Single precision rounds to nearest here; queries are padded for it.
  const auto leaves = static_cast<std::int64_t>(this->LeafBegin.size()) - 1;
  for (std::int64_t i = 0; i < leaves; ++i)
  {
    const std::int32_t* vertex = this->LeafVertices.data() + this->LeafBegin[i];
    const std::int32_t* end = this->LeafVertices.data() + this->LeafBegin[i + 1];
    Eigen::Array4f low = this->Coordinates[*vertex];
    Eigen::Array4f high = low;
    while (++vertex != end)
    {
      low = low.min(this->Coordinates[*vertex]);
      high = high.max(this->Coordinates[*vertex]);
    }
    Node& node = this->Nodes[i / Width];
    const std::int64_t lane = i % Width;
    for (int k = 0; k < 3; ++k)
    {
      node.low[next][k][lane] = low[k];
      node.high[next][k][lane] = high[k];
    }
  }
  for (std::size_t level = 1; level < this->LevelBegin.size(); ++level)
  {
    const Node* below = this->Nodes.data() + this->LevelBegin[level - 1];
    const std::int64_t size = this->LevelSize[level - 1];
    for (std::int64_t i = 0; i < size; ++i)
    {
      // The last node may have missing boxes; they are not part of the box around.
      std::int64_t lanes = Width;
      if (i == size - 1)
      {
        const std::int64_t total = level == 1 ? leaves : this->LevelSize[level - 2];
        lanes = total - Width * i;
      }
      Node& node = this->Nodes[this->LevelBegin[level] + i / Width];
      for (int k = 0; k < 3; ++k)
      {
        float low = below[i].low[next][k][0];
        float high = below[i].high[next][k][0];
        for (std::int64_t lane = 1; lane < lanes; ++lane)
        {
          low = std::min(low, below[i].low[next][k][lane]);
          high = std::max(high, below[i].high[next][k][lane]);
        }
        node.low[next][k][i % Width] = low;
        node.high[next][k][i % Width] = high;
      }
    }
  }
}

Hit VesselWall::Internals::ClosestTo(const Vector3& p, std::int32_t patch, std::int32_t hint)
{
  if (patch >= 0)
  {
    this->MarkAround(patch);
  }
  const auto allowed = [&](std::int32_t triangle) { return patch < 0 || this->IsMarked(triangle); };
  const Vector3 relative = p - this->Centre;
  const float padding = this->Padding(relative);
  Hit best;
  double bestSquared = Infinity;
  float limit = std::numeric_limits<float>::infinity(); ///< squared, padded
  const auto offer = [&](std::int32_t triangle)
  {
    const OnTriangle on = this->Nearest(triangle, p);
    if (on.squared < bestSquared || (on.squared == bestSquared && triangle < best.triangle))
    {
      best.triangle = triangle;
      best.on = on;
      bestSquared = on.squared;
      const float reach = static_cast<float>(std::sqrt(on.squared)) * 1.000001f + padding;
      limit = reach * reach;
    }
  };
  if (hint >= 0 && allowed(hint))
  {
    offer(hint);
  }
  struct Entry
  {
    float squared;
    std::int32_t level;
    std::int64_t node;
  };
  std::array<Entry, 8 * 16> stack;
  int size = 0;
  const float at[3] = { static_cast<float>(relative[0]), static_cast<float>(relative[1]),
    static_cast<float>(relative[2]) };
  const auto f = static_cast<float>(this->Fraction);
  const int now = this->Now;
  const int next = 1 - now;
  const auto top = static_cast<std::int32_t>(this->LevelBegin.size()) - 1;
  const auto count = static_cast<std::int64_t>(this->Triangles.size());
  stack[size++] = { 0.0f, top, 0 };
  while (size > 0)
  {
    const Entry entry = stack[--size];
    if (entry.squared > limit)
    {
      continue;
    }
    if (entry.level < 0)
    {
      const std::int64_t end = std::min(count, LeafSize * (entry.node + 1));
      for (std::int64_t t = LeafSize * entry.node; t < end; ++t)
      {
        if (allowed(static_cast<std::int32_t>(t)))
        {
          offer(static_cast<std::int32_t>(t));
        }
      }
      continue;
    }
    const Node& node = this->Nodes[this->LevelBegin[entry.level] + entry.node];
    float squared[Width] = {};
    for (int k = 0; k < 3; ++k)
    {
      for (int lane = 0; lane < Width; ++lane)
      {
        const float low =
          node.low[now][k][lane] + f * (node.low[next][k][lane] - node.low[now][k][lane]) - at[k];
        const float high = at[k] - node.high[now][k][lane] -
          f * (node.high[next][k][lane] - node.high[now][k][lane]);
        const float out = std::max(0.0f, std::max(low, high));
        squared[lane] += out * out;
      }
    }
    // Nearest last, so that it is looked at first.
    const int first = size;
    for (int lane = 0; lane < Width; ++lane)
    {
      if (squared[lane] > limit || squared[lane] > 1e29f)
      {
        continue;
      }
      int i = size++;
      for (; i > first && stack[i - 1].squared < squared[lane]; --i)
      {
        stack[i] = stack[i - 1];
      }
      stack[i] = { squared[lane], entry.level - 1, Width * entry.node + lane };
    }
  }
  best.distance = std::sqrt(bestSquared);
  return best;
}

template <typename Visit>
void VesselWall::Internals::ForEachNear(
  const Vector3& p, const Vector3& velocity, double window, double radius, const Visit& visit) const
{
  const Vector3 begin = p - this->Centre;
  const Vector3 end = begin + window * velocity;
  const float reach =
    static_cast<float>(radius) * 1.000001f + std::max(this->Padding(begin), this->Padding(end));
  const float limit = reach * reach;
  const float at[3] = { static_cast<float>(begin[0]), static_cast<float>(begin[1]),
    static_cast<float>(begin[2]) };
  const float to[3] = { static_cast<float>(end[0]), static_cast<float>(end[1]),
    static_cast<float>(end[2]) };
  const auto f = static_cast<float>(this->Fraction);
  const auto g = static_cast<float>((this->Time + window) / this->Seconds);
  // Beyond the next key frame, the far side of the box now is what counts against.
  const float past = 1.0f - g;
  const int now = this->Now;
  const int next = 1 - now;
  std::array<std::pair<std::int32_t, std::int64_t>, 8 * 16> stack;
  int size = 0;
  const auto count = static_cast<std::int64_t>(this->Triangles.size());
  stack[size++] = { static_cast<std::int32_t>(this->LevelBegin.size()) - 1, 0 };
  while (size > 0)
  {
    const auto [level, number] = stack[--size];
    if (level < 0)
    {
      const std::int64_t last = std::min(count, LeafSize * (number + 1));
      for (std::int64_t t = LeafSize * number; t < last; ++t)
      {
        visit(static_cast<std::int32_t>(t));
      }
      continue;
    }
    const Node& node = this->Nodes[this->LevelBegin[level] + number];
    float squared[Width] = {};
    for (int k = 0; k < 3; ++k)
    {
      const float* low0 = node.low[now][k];
      const float* high0 = node.high[now][k];
      const float* low1 = node.low[next][k];
      const float* high1 = node.high[next][k];
      const float* lowPast = past < 0.0f ? high0 : low0;
      const float* highPast = past < 0.0f ? low0 : high0;
      for (int lane = 0; lane < Width; ++lane)
      {
        const float low = std::min(low0[lane] + f * (low1[lane] - low0[lane]) - at[k],
          past * lowPast[lane] + g * low1[lane] - to[k]);
        const float high = std::max(high0[lane] + f * (high1[lane] - high0[lane]) - at[k],
          past * highPast[lane] + g * high1[lane] - to[k]);
        const float out = std::max(0.0f, std::max(low, -high));
        squared[lane] += out * out;
      }
    }
    for (int lane = 0; lane < Width; ++lane)
    {
      if (squared[lane] <= limit && squared[lane] < 1e27f)
      {
        stack[size++] = { level - 1, Width * number + lane };
      }
    }
  }
}

Memory& VesselWall::Internals::Of(std::int64_t index)
{
  std::int32_t slot = this->Known_(index);
  if (slot >= 0)
  {
    return this->Memories[slot];
  }
  if (this->Unused.empty())
  {
    slot = static_cast<std::int32_t>(this->Memories.size());
    this->Memories.emplace_back();
    this->Memories.back().list.reserve(96);
    this->Unused.reserve(this->Memories.capacity());
  }
  else
  {
    slot = this->Unused.back();
    this->Unused.pop_back();
  }
  this->Memories[slot].Reset(index);
  ++this->Known;
  if (4 * this->Known > this->Table.size())
  {
    const std::vector<std::int32_t> old = std::move(this->Table);
    this->Table.assign(2 * old.size(), -1);
    for (const std::int32_t other : old)
    {
      if (other >= 0)
      {
        this->Insert(other);
      }
    }
  }
  this->Insert(slot);
  return this->Memories[slot];
}

void VesselWall::Internals::Forget(std::int64_t index)
{
  const std::size_t mask = this->Table.size() - 1;
  std::size_t i = Hash(index) & mask;
  while (this->Table[i] >= 0 && this->Memories[this->Table[i]].index != index)
  {
    i = (i + 1) & mask;
  }
  if (this->Table[i] < 0)
  {
    return;
  }
  this->Unused.push_back(this->Table[i]);
  --this->Known;
  this->Table[i] = -1;
  // What comes after the gap may have to move into it.
  for (std::size_t j = (i + 1) & mask; this->Table[j] >= 0; j = (j + 1) & mask)
  {
    const std::int32_t slot = this->Table[j];
    this->Table[j] = -1;
    this->Insert(slot);
  }
}

bool VesselWall::Internals::Valid(const Memory& memory, const Vector3& p, double& drift) const
{
  double passed = 0.0;
  double more = 0.0;
  if (memory.frame == this->Frame)
  {
    passed = this->Time - memory.begin;
  }
  else if (memory.frame == this->Frame - 1)
  {
    passed = memory.rest + this->Time;
    more = this->VelocityChange * this->Time;
  }
  else
  {
    return false;
  }
  if (!(passed >= 0.0 && passed <= memory.window))
  {
    return false;
  }
  drift = (p - memory.place - passed * memory.velocity).norm() + more;
  return true;
}

double VesselWall::Internals::Collect(
  Memory& memory, const Hit& hit, const Vector3& p, double radius)
{
  memory.place = p;
  memory.velocity = this->VelocityAt(hit.triangle, hit.on.b, hit.on.c);
  memory.radius = radius;
  memory.clearance = radius;
  memory.list.clear();
  double least = Infinity;
  this->MarkAround(memory.patch);
  this->ForEachNear(p, memory.velocity, memory.window, radius,
    [&](std::int32_t triangle)
    {
      if (!this->IsMarked(triangle))
      {
        return;
      }
      double fastest = 0.0;
      for (const std::int32_t v : this->Triangles[triangle].vertex)
      {
        fastest = std::max(fastest, (this->VelocityOf(v) - memory.velocity).squaredNorm());
      }
      const double speed = std::sqrt(fastest) * (1.0 + 1e-6) + 1e-6;
      const double further = radius + memory.window * speed + 1e-5;
      const double squared = this->Nearest(triangle, p, further).squared;
      if (squared < further * further)
      {
        const double distance = std::sqrt(squared) * (1.0 - 1e-6) - 1e-6;
        memory.list.push_back({ triangle, static_cast<float>(distance), static_cast<float>(speed),
          0.0f, { 0.0f, 0.0f, 0.0f } });
        memory.clearance = std::min(memory.clearance, distance - memory.window * speed);
        least = std::min(least, distance);
      }
    });
  return least;
}

void VesselWall::Internals::Know(Memory& memory, const Vector3& p, double distance)
{
  memory.known = true;
  memory.knownAt = p;
  memory.knownDistance = distance;
  memory.knownTime = this->FrameBegin + this->Time;
}

Side VesselWall::Internals::Judge(Memory& memory, const Hit& hit, const Vector3& p)
{
  constexpr double Slack = 0.03; // mm, for what the wall near it moves unevenly
  Side side = this->SideOf(hit, p);
  if (side == Side::Outside && memory.known && memory.side == Side::Inside)
  {
    const double passed = this->FrameBegin + this->Time - memory.knownTime;
    const double moved = (p - memory.knownAt - passed * memory.velocity).norm();
    if (moved + Slack < memory.knownDistance + hit.distance)
    {
      side = Side::Inside;
    }
  }
  this->Know(memory, p, hit.distance);
  return side;
}

void VesselWall::Internals::Search(Memory& memory, const Vector3& p, double range)
{
  ++this->Searches;
  memory.frame = this->Frame;
  memory.begin = this->Time;
  memory.rest = this->Seconds - this->Time;
  // Samples are not all looked up in the first tick of a frame.
  const double later = static_cast<double>((static_cast<std::uint64_t>(memory.index) * 7) & 15);
  memory.window = memory.rest + this->Seconds * later / 32.0;
  const auto remember = [&](const Hit& hit, const Vector3& from)
  {
    memory.nearest = hit.triangle;
    memory.patch = this->Triangles[hit.triangle].patch;
    memory.side = this->Judge(memory, hit, from);
  };
  const double radius = range + this->Blend + this->Settings.margin;
  // Far from the wall it is not worth while to know which place is the nearest (in the middle of a vessel all its
  // walls are as near). The side is that of a place on the way to the wall, with nothing in between.
  if (memory.nearest >= 0)
  {
    Hit known;
    known.triangle = memory.nearest;
    known.on = this->Nearest(memory.nearest, p);
    known.distance = std::sqrt(known.on.squared);
    const double empty = 0.6 * known.distance;
    if (empty > radius && this->Collect(memory, known, p, empty) >= empty)
    {
      const Vector3 nearer = p + 0.59 * (known.on.point - p);
      remember(this->ClosestTo(nearer, memory.patch, known.triangle), nearer);
      if (memory.side != Side::Outside)
      {
        return;
      }
    }
  }
  const Hit nearest = this->ClosestTo(p, memory.patch, memory.nearest);
  remember(nearest, p);
  this->Collect(memory, nearest, p,
    memory.side == Side::Outside ? radius + std::max(0.0, nearest.distance - range)
                                 : std::max(radius, range + 0.5 * (nearest.distance - range)));
}

bool VesselWall::Internals::Evaluate(Memory& memory, const Vector3& p, double range, Hit& nearest)
{
  memory.seenFrame = this->Frame;
  memory.seenTime = this->Time;
  memory.seen = p;
  double drift = 0.0;
  if (!this->Valid(memory, p, drift) || drift + range + this->Blend > memory.radius)
  {
    this->Search(memory, p, range);
    drift = 0.0;
  }
  for (int attempt = 0;; ++attempt)
  {
    this->Hits.clear();
    nearest = Hit();
    const bool stale = memory.frame != this->Frame;
    const double passed = stale ? memory.rest + this->Time : this->Time - memory.begin;
    const Vector3 offset = p - memory.place - passed * memory.velocity;
    const float* at = this->Offset;
    std::copy(offset.data(), offset.data() + 3, this->Offset);
    const auto now = static_cast<float>(passed);
    this->Passed = now;
    this->Later.clear();
    const auto change = static_cast<float>(stale ? this->VelocityChange : 0.0);
    // What was nearest the last time tells how far one has to look.
    double known = Infinity;
    if (memory.nearest >= 0)
    {
      known = std::sqrt(this->Nearest(memory.nearest, p).squared);
    }
    const double wanted = memory.side == Side::Outside ? known : std::min(known, range);
    const auto limit = static_cast<float>(wanted + this->Blend) * 1.00001f + 1e-5f;
    const auto further = std::max(0.0f, static_cast<float>(range) * 1.00001f + 1e-5f - limit);
    for (Candidate& candidate : memory.list)
    {
      const float slack =
        candidate.distance - (candidate.speed + change) * std::abs(now - candidate.passed) - limit;
      const float x = at[0] - candidate.place[0];
      const float y = at[1] - candidate.place[1];
      const float z = at[2] - candidate.place[2];
      const float moved = x * x + y * y + z * z;
      if (slack > 0.0f && slack * slack > moved)
      {
        if (!(slack > further && (slack - further) * (slack - further) > moved))
        {
          this->Later.push_back(static_cast<std::int32_t>(&candidate - memory.list.data()));
        }
        continue;
      }
      const Hit hit = this->Look(candidate, p);
      if (hit.distance < nearest.distance ||
        (hit.distance == nearest.distance && hit.triangle < nearest.triangle))
      {
        nearest = hit;
      }
      if (candidate.distance <= limit + further)
      {
        this->Hits.push_back(hit);
      }
    }
    const bool found = nearest.distance + drift <= memory.radius;
    if (found)
    {
      memory.side = this->Judge(memory, nearest, p);
      memory.nearest = nearest.triangle;
      memory.patch = this->Triangles[nearest.triangle].patch;
    }
    // Outside, all that is almost as near has to be known.
    const bool complete = memory.side != Side::Outside ||
      (found && nearest.distance <= wanted &&
        nearest.distance + this->Blend + drift <= memory.radius);
    if (complete || attempt > 0)
    {
      return found && (memory.side == Side::Outside || nearest.distance <= range);
    }
    this->Search(memory, p, range);
    drift = 0.0;
  }
}

Hit VesselWall::Internals::Look(Candidate& candidate, const Vector3& p) const
{
  Hit hit;
  hit.triangle = candidate.triangle;
  hit.on = this->Nearest(candidate.triangle, p);
  hit.distance = std::sqrt(hit.on.squared);
  candidate.distance = static_cast<float>(hit.distance) * 0.999999f - 2e-6f;
  candidate.passed = this->Passed;
  std::copy(this->Offset, this->Offset + 3, candidate.place);
  return hit;
}

void VesselWall::Internals::EvaluateLater(
  Memory& memory, const Vector3& p, double range, const Vector3* first)
{
  for (const std::int32_t i : this->Later)
  {
    Candidate& candidate = memory.list[i];
    const Corners& t = this->Triangles[candidate.triangle];
    // Where the corners' normals are within 60 degrees, those of all places between them are.
    if (first != nullptr && t.wall && this->NormalAt(t.vertex[0]).dot(*first) > 0.5 &&
      this->NormalAt(t.vertex[1]).dot(*first) > 0.5 &&
      this->NormalAt(t.vertex[2]).dot(*first) > 0.5)
    {
      continue;
    }
    const Hit hit = this->Look(candidate, p);
    if (hit.distance <= range)
    {
      this->Hits.push_back(hit);
    }
  }
  this->Later.clear();
}

ContactPlane VesselWall::Internals::MakePlane(
  const ContactSample& sample, Hit& hit, Side side, double limit, const Vector3* first)
{
  const Corners& triangle = this->Triangles[hit.triangle];
  const Vector3 reference = this->SmoothNormal(hit);
  // The mean over the triangles that are almost as near: each of its terms is continuous when the
  // sample moves, and so is the sum.
  const double width = std::max(1e-9, std::min(this->Blend, limit - hit.distance));
  Vector3 sum = Vector3::Zero();
  for (Hit& other : this->Hits)
  {
    const double further = (other.distance - hit.distance) / width;
    if (further >= 1.0 || this->Triangles[other.triangle].open)
    {
      continue;
    }
    const Vector3& normal = this->SmoothNormal(other);
    const double weight = 1.0 - std::max(0.0, further);
    // A wall of another side is another plane.
    const double aside = first != nullptr ? 1.0 - Ramp(normal.dot(*first), 0.25, 0.5) : 1.0;
    sum += weight * weight * aside * Ramp(normal.dot(reference), 0.5, 0.766) * normal;
  }
  Vector3 normal = sum.norm() > 1e-6 ? Vector3(sum.normalized()) : reference;
  // On ridges (flow dividers) and flat parts beside them vertex normals are wrong: there the direction
  // to the nearest point is right, and smooth.
  Vector3 direct = Vector3::Zero();
  if (hit.on.feature == TriangleFeature::Face)
  {
    direct = -UnitOrZero(this->FaceNormal(hit.triangle));
  }
  else if (hit.distance > 0.0)
  {
    direct = (side == Side::Outside ? -1.0 : 1.0) / hit.distance * (sample.centre - hit.on.point);
  }
  constexpr double cos20 = 0.9397;
  constexpr double cos40 = 0.7660;
  const double share =
    (1.0 - Ramp(direct.dot(normal), cos40, cos20)) * std::min(1.0, hit.distance / 0.02);
  if (triangle.wall && share > 0.0 && direct != Vector3::Zero())
  {
    const Vector3 mixed = (1.0 - share) * normal + share * direct;
    if (mixed.norm() > 1e-3)
    {
      normal = mixed.normalized();
    }
  }
  ContactPlane plane;
  plane.normal = normal;
  plane.gap = (side == Side::Outside ? -hit.distance : hit.distance) - sample.radius;
  plane.wallVelocity = this->VelocityAt(hit.triangle, hit.on.b, hit.on.c);
  plane.friction = this->Settings.friction * sample.friction;
  plane.stiffness = this->Settings.stiffness;
  return plane;
}

WallPlace VesselWall::Internals::PlaceFrom(const Hit& hit, Side side) const
{
  WallPlace place;
  if (hit.triangle < 0)
  {
    return place;
  }
  place.triangle = this->TriangleOf[hit.triangle];
  place.weights = Vector3(1.0 - hit.on.b - hit.on.c, hit.on.b, hit.on.c);
  place.point = hit.on.point;
  place.distance = side == Side::Inside ? hit.distance : -hit.distance;
  if (!this->Group.empty())
  {
    Eigen::Index corner = 0;
    place.weights.maxCoeff(&corner);
    place.branch = this->Group[this->Triangles[hit.triangle].vertex[corner]];
  }
  return place;
}

VesselWall::VesselWall(const WallTopology& topology, const std::vector<Vector3>& points,
  const VesselWallSettings& settings)
  : Data(std::make_unique<Internals>())
{
  settings.Validate();
  this->Data->Settings = settings;
  this->Data->Build(topology, points);
}

VesselWall::~VesselWall() = default;
VesselWall::VesselWall(VesselWall&&) noexcept = default;
VesselWall& VesselWall::operator=(VesselWall&&) noexcept = default;

void VesselWall::BeginFrame(const std::vector<Vector3>& next, double seconds)
{
  Internals& data = *this->Data;
  if (!(seconds > 0.0 && std::isfinite(seconds)))
  {
    throw std::invalid_argument(
      "a key frame of the wall lasts " + std::to_string(seconds) + " s, not a positive time");
  }
  RequirePoints(next, data.Vertices.size());
  double change = 0.0;
  Eigen::Array4f extent = Eigen::Array4f::Zero();
  const double rate = 1.0 / seconds;
  const double oldRate = 1.0 / data.Seconds;
  for (std::size_t i = 0; i < next.size(); ++i)
  {
    Vertex& v = data.Vertices[i];
    const Vector3& p = next[data.VertexOf[i]];
    change = std::max(change, (rate * (p - v.next) - oldRate * (v.next - v.now)).squaredNorm());
    v.now = v.next;
    v.next = p;
    const Vector3 relative = p - data.Centre;
    data.Coordinates[i] = Eigen::Array4f(static_cast<float>(relative[0]),
      static_cast<float>(relative[1]), static_cast<float>(relative[2]), 0.0f);
    extent = extent.max(data.Coordinates[i].abs());
  }
  data.VelocityChange = std::sqrt(change) * (1.0 + 1e-12) + 1e-12;
  data.Now = 1 - data.Now;
  data.Extent[1 - data.Now] = extent.maxCoeff();
  data.FrameBegin += data.Seconds;
  data.Seconds = seconds;
  data.Rate = rate;
  data.Time = 0.0;
  data.Fraction = 0.0;
  ++data.Frame;
  data.Refit();
}

void VesselWall::SetTime(double seconds)
{
  Internals& data = *this->Data;
  data.Time = std::isfinite(seconds) ? std::clamp(seconds, 0.0, data.Seconds) : 0.0;
  data.Fraction = data.Time / data.Seconds;
}

void VesselWall::Find(const ContactSample& sample, double reach, SampleContacts& contacts)
{
  contacts.count = 0;
  Internals& data = *this->Data;
  const double range = sample.radius + reach;
  if (!Usable(sample.centre) || !(sample.radius >= 0.0 && reach >= 0.0) ||
    !(range <= GreatestCoordinate))
  {
    return;
  }
  Memory& memory = data.Of(sample.index);
  memory.range = range;
  double drift = 0.0;
  if (data.Valid(memory, sample.centre, drift) && memory.side != Side::Outside &&
    drift + range < memory.clearance)
  {
    data.Know(memory, sample.centre, memory.clearance - drift);
    memory.planes = 0;
    return;
  }
  Hit nearest;
  if (!data.Evaluate(memory, sample.centre, range, nearest) || memory.side == Side::Free)
  {
    memory.planes = 0;
    return;
  }
  const Side side = memory.side;
  const double limit = std::max(nearest.distance + data.Blend, range);
  if (data.Triangles[nearest.triangle].open)
  {
    // Before an open cap: the wall around it.
    data.EvaluateLater(memory, sample.centre, range, nullptr);
    nearest = Hit();
    for (const Hit& hit : data.Hits)
    {
      if (!data.Triangles[hit.triangle].open &&
        (hit.distance < nearest.distance ||
          (hit.distance == nearest.distance && hit.triangle < nearest.triangle)))
      {
        nearest = hit;
      }
    }
    if (nearest.triangle < 0 || nearest.distance > range)
    {
      memory.planes = 0;
      return;
    }
  }
  contacts.plane[0] = data.MakePlane(sample, nearest, side, limit, nullptr);
  contacts.count = 1;
  // Of another side: the direction to it has to be that of its normal (a nearest place, not one on
  // the way around), and of several the one that is most opposite.
  const Vector3 first = contacts.plane[0].normal;
  data.EvaluateLater(memory, sample.centre, range, &first);
  Hit second;
  double best = Infinity;
  for (Hit& hit : data.Hits)
  {
    const Vector3 away = sample.centre - hit.on.point;
    // Where the direction is within 30 degrees of the first normal, one of the two conditions fails.
    if (hit.distance > range || away.dot(first) > 0.8661 * hit.distance ||
      data.Triangles[hit.triangle].open || hit.triangle == nearest.triangle)
    {
      continue;
    }
    const Vector3& normal = data.SmoothNormal(hit);
    const double along = normal.dot(first);
    if (along > 0.5 || normal.dot(away) < 0.866 * hit.distance)
    {
      continue;
    }
    const double score = hit.distance + 0.05 * (0.5 + along);
    if (score < best || (score == best && hit.triangle < second.triangle))
    {
      best = score;
      second = hit;
    }
  }
  if (second.triangle >= 0)
  {
    contacts.plane[1] = data.MakePlane(sample, second, Side::Inside, limit, &first);
    contacts.count = 2;
  }
  // The identity of the former plane that is most alike, or the one that is not in use.
  int identity = -1;
  double alike = 0.5;
  for (int i = 0; i < memory.planes; ++i)
  {
    const double along = memory.normal[i].dot(first);
    if (along > alike)
    {
      alike = along;
      identity = memory.identity[i];
    }
  }
  if (identity < 0)
  {
    identity = memory.planes == 1 ? 1 - memory.identity[0] : 0;
  }
  memory.planes = contacts.count;
  for (int i = 0; i < contacts.count; ++i)
  {
    contacts.plane[i].identity = i == 0 ? identity : 1 - identity;
    memory.normal[i] = contacts.plane[i].normal;
    memory.identity[i] = contacts.plane[i].identity;
  }
}

bool VesselWall::Outside(const ContactSample& sample, WallPlace& place)
{
  Internals& data = *this->Data;
  place = WallPlace();
  if (!Usable(sample.centre))
  {
    return false;
  }
  Memory& memory = data.Of(sample.index);
  if (memory.side != Side::Outside && memory.seenFrame == data.Frame &&
    memory.seenTime == data.Time && memory.seen == sample.centre)
  {
    return false;
  }
  double drift = 0.0;
  if (data.Valid(memory, sample.centre, drift) && memory.side != Side::Outside &&
    drift < memory.clearance)
  {
    return false;
  }
  Hit nearest;
  if (!data.Evaluate(memory, sample.centre, memory.range, nearest) || memory.side != Side::Outside)
  {
    return false;
  }
  place = data.PlaceFrom(nearest, Side::Outside);
  return true;
}

WallPlace VesselWall::Locate(const ContactSample& sample)
{
  Internals& data = *this->Data;
  if (!Usable(sample.centre))
  {
    return {};
  }
  Memory& memory = data.Of(sample.index);
  const Hit nearest = data.ClosestTo(sample.centre, memory.patch, memory.nearest);
  memory.nearest = nearest.triangle;
  memory.patch = data.Triangles[nearest.triangle].patch;
  return data.PlaceFrom(nearest, data.Judge(memory, nearest, sample.centre));
}

void VesselWall::Place(std::int64_t sample, std::int64_t triangle)
{
  Internals& data = *this->Data;
  if (triangle < 0 || triangle >= static_cast<std::int64_t>(data.Triangles.size()))
  {
    throw std::invalid_argument("the wall has no triangle " + std::to_string(triangle));
  }
  Memory& memory = data.Of(sample);
  memory.Reset(sample);
  memory.nearest = data.PlaceOf[triangle];
  memory.patch = data.Triangles[memory.nearest].patch;
}

bool VesselWall::PlaceBeside(std::int64_t sample, std::int64_t neighbour)
{
  Internals& data = *this->Data;
  const std::int32_t slot = data.Known_(neighbour);
  if (slot < 0 || data.Memories[slot].patch < 0)
  {
    return false;
  }
  const std::int32_t patch = data.Memories[slot].patch;
  const std::int32_t nearest = data.Memories[slot].nearest;
  Memory& memory = data.Of(sample);
  memory.Reset(sample);
  memory.patch = patch;
  memory.nearest = nearest;
  return true;
}

void VesselWall::Forget(std::int64_t sample)
{
  this->Data->Forget(sample);
}

void VesselWall::ForgetAll()
{
  Internals& data = *this->Data;
  data.Unused.clear();
  for (auto i = static_cast<std::int32_t>(data.Memories.size()) - 1; i >= 0; --i)
  {
    data.Unused.push_back(i);
  }
  std::fill(data.Table.begin(), data.Table.end(), -1);
  data.Known = 0;
}

WallPlace VesselWall::Closest(const Vector3& p)
{
  if (!Usable(p))
  {
    return {};
  }
  const Hit nearest = this->Data->ClosestTo(p, -1, -1);
  return this->Data->PlaceFrom(nearest, this->Data->SideOf(nearest, p));
}

void VesselWall::Within(const Vector3& p, double distance, std::vector<std::int64_t>& triangles)
{
  triangles.clear();
  const Internals& data = *this->Data;
  if (!Usable(p) || !(distance >= 0.0))
  {
    return;
  }
  const double bound = std::min(distance, 4.0 * GreatestCoordinate);
  data.ForEachNear(p, Vector3::Zero(), 0.0, bound,
    [&](std::int32_t triangle)
    {
      if (data.Nearest(triangle, p).squared <= bound * bound)
      {
        triangles.push_back(data.TriangleOf[triangle]);
      }
    });
  std::sort(triangles.begin(), triangles.end());
}

const std::vector<Vector3>& VesselWall::Points()
{
  Internals& data = *this->Data;
  data.AllPoints.resize(data.Vertices.size());
  for (std::size_t i = 0; i < data.Vertices.size(); ++i)
  {
    data.AllPoints[data.VertexOf[i]] = data.At(static_cast<std::int32_t>(i));
  }
  return data.AllPoints;
}

const std::vector<Vector3>& VesselWall::Normals()
{
  Internals& data = *this->Data;
  data.AllNormals.resize(data.Vertices.size());
  for (std::size_t i = 0; i < data.Vertices.size(); ++i)
  {
    data.AllNormals[data.VertexOf[i]] = UnitOrZero(data.NormalAt(static_cast<std::int32_t>(i)));
  }
  return data.AllNormals;
}

Vector3 VesselWall::Velocity(const WallPlace& place) const
{
  const Internals& data = *this->Data;
  if (place.triangle < 0 || place.triangle >= static_cast<std::int64_t>(data.PlaceOf.size()))
  {
    return Vector3::Zero();
  }
  return data.VelocityAt(data.PlaceOf[place.triangle], place.weights[1], place.weights[2]);
}

std::int64_t VesselWall::NumberOfPatches() const
{
  return static_cast<std::int64_t>(this->Data->Near.size());
}

std::uint64_t VesselWall::NumberOfSearches() const
{
  return this->Data->Searches;
}
}
