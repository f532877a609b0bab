/**
 * @file CarriedHeart.h
 * @brief A coronary tree that is carried on the epicardium of a measured heart, at any time of its beat.
 */
#ifndef DynamicCoronary_CarriedHeart_h
#define DynamicCoronary_CarriedHeart_h

#include "MeasuredHeart.h"
#include "PhaseInterpolation.h"
#include "VesselImage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
inline constexpr int Frames = MeasuredFrames;
inline constexpr int ReferenceFrame = 18; // mid-diastole
inline constexpr double CycleSeconds = 0.83;
inline constexpr double Pi = 3.14159265358979323846;

inline double TimeOf(int frame)
{
  return static_cast<double>(frame) / Frames;
}

/// Edges that belong to one triangle, as closed loops of points.
inline std::vector<std::vector<std::int64_t>> BoundaryLoops(const std::vector<Triangle>& triangles)
{
  std::map<std::pair<std::int64_t, std::int64_t>, bool> edges;
  for (const Triangle& t : triangles)
  {
    for (int n = 0; n < 3; ++n)
    {
      edges[{ t[n], t[(n + 1) % 3] }] = true;
    }
  }
  std::map<std::int64_t, std::int64_t> next;
  for (const auto& [edge, unused] : edges)
  {
    if (edges.count({ edge.second, edge.first }) == 0)
    {
      next[edge.first] = edge.second;
    }
  }
  std::vector<std::vector<std::int64_t>> loops;
  while (!next.empty())
  {
    loops.emplace_back();
    for (auto at = next.begin(); at != next.end();)
    {
      loops.back().push_back(at->first);
      const std::int64_t to = at->second;
      next.erase(at);
      at = next.find(to);
    }
  }
  return loops;
}

inline Vector3 MeanOf(const std::vector<Vector3>& points, const std::vector<std::int64_t>& loop)
{
  Vector3 mean = Vector3::Zero();
  for (const std::int64_t p : loop)
  {
    mean += points[p] / static_cast<double>(loop.size());
  }
  return mean;
}

/// One of the heart's surfaces: its triangles, and the closed surface with the valves' planes.
struct Shell
{
  std::size_t first = 0; ///< of its points among those of the heart
  std::size_t count = 0;
  std::vector<Triangle> triangles;
  std::vector<std::vector<std::int64_t>> valves;

  std::vector<Vector3> Own(const std::vector<Vector3>& points) const
  {
    const auto from = points.begin() + static_cast<std::ptrdiff_t>(this->first);
    return { from, from + static_cast<std::ptrdiff_t>(this->count) };
  }

  /// With the valves' planes, which are fans about the points that AddMiddles() adds.
  std::vector<Triangle> Closed() const
  {
    std::vector<Triangle> closed = this->triangles;
    auto middle = static_cast<std::int64_t>(this->count);
    for (const std::vector<std::int64_t>& loop : this->valves)
    {
      for (std::size_t n = 0; n < loop.size(); ++n)
      {
        closed.push_back({ loop[(n + 1) % loop.size()], loop[n], middle });
      }
      ++middle;
    }
    return closed;
  }

  /// @param corners  as of Own(); gets the middle of each valve
  void AddMiddles(std::vector<Vector3>& corners) const
  {
    for (const std::vector<std::int64_t>& loop : this->valves)
    {
      corners.push_back(MeanOf(corners, loop));
    }
  }

  VesselImage Filled(const std::vector<Vector3>& points, double spacing) const
  {
    std::vector<Vector3> corners = this->Own(points);
    this->AddMiddles(corners);
    return RenderSurface(corners, this->Closed(), spacing, 2.0 * spacing);
  }
};

/// Both surfaces at any time: the frames without their scatter, or as they are.
class Heart
{
public:
  Heart(const std::string& folder, bool asMeasured)
  {
    PoseSequence frames;
    for (int k = 0; k < Frames; ++k)
    {
      frames.times.push_back(TimeOf(k));
      frames.points.emplace_back();
      this->Take(folder, "EPICARDIAL", k, this->Epicardium, frames.points.back());
      this->Take(folder, "LV_ENDOCARDIAL", k, this->LeftVentricle, frames.points.back());
    }
    PhaseInterpolationSettings settings;
    settings.mode = asMeasured ? PhaseInterpolationMode::Linear : PhaseInterpolationMode::LowNoise;
    this->Motion = std::make_unique<PhaseInterpolation>(frames, settings);
  }

  std::vector<Vector3> At(double time) const
  {
    InterpolatedPose pose;
    this->Motion->Evaluate(time, pose);
    return pose.points;
  }

  const LowNoiseFit& Fit() const { return this->Motion->Fit(); }

  Shell Epicardium;
  Shell LeftVentricle;

private:
  void Take(const std::string& folder, const char* name, int frame, Shell& shell,
    std::vector<Vector3>& points) const
  {
    HeartSurface surface;
    if (!ReadHeartSurface(folder, name, frame, surface))
    {
      throw std::runtime_error(
        "'" + folder + "' has no frame " + std::to_string(frame) + " of " + name);
    }
    if (frame == 0)
    {
      shell.first = points.size();
      shell.count = surface.points.size();
      shell.triangles = surface.triangles;
      shell.valves = BoundaryLoops(surface.triangles);
    }
    if (surface.points.size() != shell.count || surface.triangles != shell.triangles)
    {
      throw std::runtime_error(std::string(name) + ": the frames have different triangles");
    }
    points.insert(points.end(), surface.points.begin(), surface.points.end());
  }

  std::unique_ptr<PhaseInterpolation> Motion;
};

/// Where on the epicardium: a triangle, the shares of its corners, and mm outwards.
struct Attachment
{
  Triangle corners{};
  Vector3 shares;
  double outwards = 0.0;
};

inline std::vector<Vector3> NormalsOf(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles)
{
  std::vector<Vector3> normals(points.size(), Vector3::Zero());
  for (const Triangle& t : triangles)
  {
    const Vector3 area = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
    for (const std::int64_t corner : t)
    {
      normals[corner] += area;
    }
  }
  for (Vector3& normal : normals)
  {
    normal.normalize();
  }
  return normals;
}

/// The coronary tree on the epicardium. All places are fixed combinations of places of the surface, so that
/// the tree is carried exactly.
class CarriedTree
{
public:
  /// @param frame  whose surface the lines are laid on: the reference
  explicit CarriedTree(const Heart& heart, int frame = coronary::ReferenceFrame)
    : Epicardium(heart.Epicardium)
    , ReferenceFrame(frame)
  {
    this->Frame(heart);
    // Degrees from the right ventricle over the front, and the way from the base to the apex.
    const int right = this->AddVessel(-1, 0,
      { { 80, 0.08 }, { 30, 0.10 }, { 0, 0.13 }, { -40, 0.13 }, { -75, 0.11 }, { -98, 0.12 },
        { -104, 0.3 }, { -104, 0.6 }, { -104, 0.85 } },
      1.9, 0.8);
    this->AddVessel(right, 0.38, { { 0, 0.13 }, { 10, 0.4 }, { 20, 0.7 } }, 1.1, 0.75);
    const int anterior = this->AddVessel(
      -1, 0, { { 108, 0.05 }, { 112, 0.2 }, { 112, 0.5 }, { 115, 0.8 }, { 120, 0.95 } }, 2.0, 0.9);
    this->AddVessel(anterior, 0.25, { { 112, 0.25 }, { 140, 0.45 }, { 155, 0.7 } }, 1.2, 0.75);
    const int circumflex = this->AddVessel(anterior, 0.06,
      { { 108, 0.08 }, { 150, 0.08 }, { 190, 0.11 }, { 220, 0.13 }, { 240, 0.15 } }, 1.7, 0.9);
    this->AddVessel(circumflex, 0.5, { { 180, 0.1 }, { 185, 0.4 }, { 190, 0.65 } }, 1.2, 0.8);
    this->AddVessel(circumflex, 0.85, { { 225, 0.14 }, { 224, 0.4 }, { 226, 0.6 } }, 1.1, 0.8);
    this->Lines.points = this->At(this->Rest);
    CheckPolylines(this->Lines);
  }

  /// The lines at the reference.
  const Polylines& Reference() const { return this->Lines; }

  /// The points where the heart has moved to.
  std::vector<Vector3> At(const std::vector<Vector3>& heart) const
  {
    const std::vector<Vector3> surface = this->Epicardium.Own(heart);
    const std::vector<Vector3> normals = NormalsOf(surface, this->Epicardium.triangles);
    std::vector<Vector3> points;
    for (const Vessel& vessel : this->Vessels)
    {
      const std::vector<Vector3> own = Smoothed(vessel, surface, normals);
      const Vector3 gap =
        vessel.parent >= 0 ? Vector3(points[vessel.parent] - own.front()) : Vector3::Zero();
      for (std::size_t n = vessel.parent >= 0 ? 1 : 0; n < own.size(); ++n)
      {
        points.emplace_back(
          own[n] + std::max(0.0, 1.0 - static_cast<double>(n) * Step / 10.0) * gap);
      }
    }
    return points;
  }

private:
  static constexpr double Step = 0.75; ///< mm between points
  static constexpr int Window = 7;     ///< points to both sides that a place is a mean of

  struct Vessel
  {
    std::int64_t parent = -1; ///< the point it leaves from
    std::vector<Attachment> places;
    std::vector<std::int64_t> points;
  };

  void Frame(const Heart& heart)
  {
    const std::vector<Vector3> all = heart.At(TimeOf(this->ReferenceFrame));
    this->Rest = all;
    this->Surface = this->Epicardium.Own(all);
    this->Normals = NormalsOf(this->Surface, this->Epicardium.triangles);
    // The two valves of the left ventricle are those that both surfaces have.
    std::vector<Vector3> left;
    std::vector<Vector3> right;
    std::vector<std::size_t> sizes[2];
    const std::vector<Vector3> inner = heart.LeftVentricle.Own(all);
    for (const std::vector<std::int64_t>& loop : this->Epicardium.valves)
    {
      const Vector3 middle = MeanOf(this->Surface, loop);
      const bool shared =
        std::any_of(heart.LeftVentricle.valves.begin(), heart.LeftVentricle.valves.end(),
          [&](const auto& own) { return (MeanOf(inner, own) - middle).norm() < 5.0; });
      (shared ? left : right).push_back(middle);
      sizes[shared ? 0 : 1].push_back(loop.size());
    }
    if (left.size() != 2 || right.size() != 2)
    {
      throw std::runtime_error("the surfaces do not have the four valves");
    }
    const Vector3 mitral = left[sizes[0][0] > sizes[0][1] ? 0 : 1];
    const bool firstIsTricuspid = sizes[1][0] > sizes[1][1];
    const Vector3 tricuspid = right[firstIsTricuspid ? 0 : 1];
    const Vector3 pulmonary = right[firstIsTricuspid ? 1 : 0];
    this->Base = 0.5 * (mitral + tricuspid);
    const Vector3 apex = *std::max_element(this->Surface.begin(), this->Surface.end(),
      [&](const Vector3& a, const Vector3& b)
      { return (a - this->Base).squaredNorm() < (b - this->Base).squaredNorm(); });
    this->Down = apex - this->Base;
    const Vector3 axis = this->Down.normalized();
    this->Right = tricuspid - mitral;
    this->Right = (this->Right - this->Right.dot(axis) * axis).normalized();
    this->Front = axis.cross(this->Right);
    if (this->Front.dot(pulmonary - this->Base) < 0.0)
    {
      this->Front = -this->Front;
    }
  }

  /// The outermost place in a direction from the axis.
  Attachment PlaceAt(double degrees, double height, double outwards) const
  {
    const Vector3 direction =
      std::cos(degrees * Pi / 180.0) * this->Right + std::sin(degrees * Pi / 180.0) * this->Front;
    const Vector3 from = this->Base + height * this->Down;
    Attachment best;
    best.outwards = outwards;
    double farthest = 0.0;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Triangle& t : this->Epicardium.triangles)
    {
      const Vector3& a = this->Surface[t[0]];
      Matrix3 system;
      system << this->Surface[t[1]] - a, this->Surface[t[2]] - a, -direction;
      const Vector3 solution = system.fullPivLu().solve(from - a);
      const double u = solution[0];
      const double v = solution[1];
      if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && solution[2] > farthest)
      {
        farthest = solution[2];
        best.corners = t;
        best.shares = { 1.0 - u - v, u, v };
      }
    }
    // Through a valve: the nearest corner of the surface's rim.
    for (const Triangle& t : this->Epicardium.triangles)
    {
      for (int c = 0; c < 3 && farthest == 0.0; ++c)
      {
        const Vector3 apart = this->Surface[t[c]] - (from + 45.0 * direction);
        if (apart.norm() < nearest)
        {
          nearest = apart.norm();
          best.corners = t;
          best.shares = Vector3::Unit(c);
        }
      }
    }
    return best;
  }

  static Vector3 PositionOf(const Attachment& place, const std::vector<Vector3>& surface,
    const std::vector<Vector3>& normals)
  {
    Vector3 position = Vector3::Zero();
    Vector3 normal = Vector3::Zero();
    for (int c = 0; c < 3; ++c)
    {
      position += place.shares[c] * surface[place.corners[c]];
      normal += place.shares[c] * normals[place.corners[c]];
    }
    return position + place.outwards * normal.normalized();
  }

  static std::vector<Vector3> Smoothed(
    const Vessel& vessel, const std::vector<Vector3>& surface, const std::vector<Vector3>& normals)
  {
    std::vector<Vector3> raw;
    for (const Attachment& place : vessel.places)
    {
      raw.push_back(PositionOf(place, surface, normals));
    }
    std::vector<Vector3> result;
    const auto count = static_cast<int>(raw.size());
    for (int n = 0; n < count; ++n)
    {
      const int reach = std::min({ Window, n, count - 1 - n });
      Vector3 mean = Vector3::Zero();
      double sum = 0.0;
      for (int w = -reach; w <= reach; ++w)
      {
        const double weight = reach + 1 - std::abs(w);
        mean += weight * raw[n + w];
        sum += weight;
      }
      result.emplace_back(mean / sum);
    }
    return result;
  }

  /// @param parent  the vessel it leaves from, after that share of its points; -1: none
  int AddVessel(int parent, double share, const std::vector<std::array<double, 2>>& course,
    double radius, double lastRadius)
  {
    Vessel vessel;
    if (parent >= 0)
    {
      const std::vector<std::int64_t>& points = this->Vessels[parent].points;
      vessel.parent = points[static_cast<std::size_t>(share * static_cast<double>(points.size()))];
    }
    // Densely along the course, then every Step mm of it.
    std::vector<Attachment> dense;
    std::vector<double> along;
    for (std::size_t n = 0; n + 1 < course.size(); ++n)
    {
      constexpr int parts = 40;
      for (int part = 0; part < parts + (n + 2 == course.size() ? 1 : 0); ++part)
      {
        const double s = static_cast<double>(part) / parts;
        dense.push_back(this->PlaceAt((1.0 - s) * course[n][0] + s * course[n + 1][0],
          (1.0 - s) * course[n][1] + s * course[n + 1][1], 0.0));
        const Vector3 position = PositionOf(dense.back(), this->Surface, this->Normals);
        along.push_back(dense.size() < 2 ? 0.0
                                         : along.back() +
              (position - PositionOf(dense[dense.size() - 2], this->Surface, this->Normals))
                .norm());
      }
    }
    std::size_t at = 0;
    for (double length = 0.0; length <= along.back(); length += Step)
    {
      while (at + 1 < along.size() && along[at] < length)
      {
        ++at;
      }
      Attachment place = dense[at];
      const double own = radius + (lastRadius - radius) * length / along.back();
      place.outwards = own + 1.0;
      vessel.places.push_back(place);
      if (vessel.places.size() == 1 && vessel.parent >= 0)
      {
        vessel.points.push_back(vessel.parent);
        continue;
      }
      vessel.points.push_back(static_cast<std::int64_t>(this->Lines.radius.size()));
      this->Lines.radius.push_back(own);
    }
    this->Lines.lines.push_back(vessel.points);
    this->Vessels.push_back(std::move(vessel));
    return static_cast<int>(this->Vessels.size()) - 1;
  }

  const Shell& Epicardium;
  int ReferenceFrame;
  std::vector<Vector3> Rest;
  std::vector<Vector3> Surface;
  std::vector<Vector3> Normals;
  Vector3 Base;
  Vector3 Down; ///< from the base to the apex
  Vector3 Right;
  Vector3 Front;
  std::vector<Vessel> Vessels;
  Polylines Lines;
};
}

#endif
