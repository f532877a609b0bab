/**
 * @file ScannedHeart.h
 * @brief A measured heart with its carried tree as the virtual scanner sees it: myocardium, blood as bright as the
 * arteries, fat, lung, and veins beside two of the arteries.
 */
#ifndef DynamicCoronary_ScannedHeart_h
#define DynamicCoronary_ScannedHeart_h

#include "CarriedHeart.h"
#include "CtScanner.h"
#include "MeshAnatomy.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
/// The motion of the heart, made larger about its place at the reference.
class LargerMotion
{
public:
  LargerMotion(const Heart& heart, double factor)
    : Body(heart)
    , Factor(factor)
    , Rest(heart.At(TimeOf(ReferenceFrame)))
  {
  }

  std::vector<Vector3> At(double time) const
  {
    std::vector<Vector3> points = this->Body.At(time);
    for (std::size_t n = 0; n < points.size(); ++n)
    {
      points[n] = this->Rest[n] + this->Factor * (points[n] - this->Rest[n]);
    }
    return points;
  }

private:
  const Heart& Body;
  double Factor;
  std::vector<Vector3> Rest;
};

/// Rings of points around a line, with both ends closed.
class TubeSurface
{
public:
  static std::vector<Triangle> Triangles(std::size_t rings)
  {
    const auto at = [](std::size_t ring, int n)
    { return static_cast<std::int64_t>(ring) * Around + n % Around; };
    const auto first = static_cast<std::int64_t>(rings) * Around;
    std::vector<Triangle> triangles;
    for (int n = 0; n < Around; ++n)
    {
      for (std::size_t r = 0; r + 1 < rings; ++r)
      {
        triangles.push_back({ at(r, n), at(r, n + 1), at(r + 1, n) });
        triangles.push_back({ at(r, n + 1), at(r + 1, n + 1), at(r + 1, n) });
      }
      triangles.push_back({ first, at(0, n + 1), at(0, n) });
      triangles.push_back({ first + 1, at(rings - 1, n), at(rings - 1, n + 1) });
    }
    return triangles;
  }

  static std::vector<Vector3> Points(
    const std::vector<Vector3>& line, const std::vector<double>& radius)
  {
    std::vector<Vector3> points;
    Vector3 normal = Vector3::Zero();
    for (std::size_t r = 0; r < line.size(); ++r)
    {
      const Vector3 tangent =
        (line[std::min(r + 1, line.size() - 1)] - line[r > 0 ? r - 1 : 0]).normalized();
      normal = r == 0 ? Vector3(tangent.unitOrthogonal()) : normal;
      normal = (normal - normal.dot(tangent) * tangent).normalized();
      const Vector3 other = tangent.cross(normal);
      for (int n = 0; n < Around; ++n)
      {
        const double angle = 2.0 * Pi * n / Around;
        points.emplace_back(
          line[r] + Wider * radius[r] * (std::cos(angle) * normal + std::sin(angle) * other));
      }
    }
    points.push_back(line.front());
    points.push_back(line.back());
    return points;
  }

private:
  static constexpr int Around = 14;
  /// So that the polygon has the circle's area.
  static constexpr double Wider = 1.0171;
};

/// @param motion  of the heart's points. @param iodine  HU of arteries and of the left ventricle's blood
inline MeshAnatomy AnatomyOf(
  const Heart& heart, const CarriedTree& tree, const LargerMotion& motion, double iodine)
{
  const TissueMaterials tissue;
  const auto material = [&](const char* name, std::optional<double> value)
  { return MaterialOf(tissue, name, value, "HU"); };
  std::vector<double> phases;
  std::vector<std::vector<Vector3>> bodies;
  std::vector<std::vector<Vector3>> trees;
  for (int k = 0; k < Frames; ++k)
  {
    phases.push_back(TimeOf(k));
    bodies.push_back(motion.At(TimeOf(k)));
    trees.push_back(tree.At(bodies.back()));
  }
  std::vector<AnatomyPart> parts;
  // The shell with its valves closed, `outwards` mm off.
  const auto add = [&](const char* name, const Shell& shell, double outwards, bool still,
                     const MaterialAmounts& amounts)
  {
    AnatomyPart part;
    part.name = name;
    part.material = amounts;
    part.triangles = shell.Closed();
    part.still = still;
    for (int k = 0; k < (still ? 1 : Frames); ++k)
    {
      part.phases.push_back(phases[k]);
      std::vector<Vector3> corners = shell.Own(still ? bodies[ReferenceFrame] : bodies[k]);
      const std::vector<Vector3> normals = NormalsOf(corners, shell.triangles);
      for (std::size_t n = 0; n < corners.size(); ++n)
      {
        corners[n] += outwards * normals[n];
      }
      shell.AddMiddles(corners);
      part.positions.push_back(std::move(corners));
    }
    parts.push_back(std::move(part));
  };
  add("lung", heart.Epicardium, 25.0, true, material("lung", std::nullopt));
  add("fat", heart.Epicardium, 7.0, false, material("fat", std::nullopt));
  add("myocardium", heart.Epicardium, 0.0, false, material("muscle", std::nullopt));
  add("left ventricle", heart.LeftVentricle, 0.0, false, material("blood", iodine));
  const auto tube = [&](const std::string& name, std::size_t vessel, double beside, double width,
                      const MaterialAmounts& amounts)
  {
    const std::vector<std::int64_t>& line = tree.Reference().lines[vessel];
    AnatomyPart part;
    part.name = name;
    part.material = amounts;
    part.phases = phases;
    part.triangles = TubeSurface::Triangles(line.size());
    std::vector<double> radius;
    for (const std::int64_t p : line)
    {
      radius.push_back(beside > 0.0 ? width : tree.Reference().radius[p]);
    }
    for (int k = 0; k < Frames; ++k)
    {
      Vector3 centre = Vector3::Zero();
      for (const Vector3& point : bodies[k])
      {
        centre += point / static_cast<double>(bodies[k].size());
      }
      std::vector<Vector3> places;
      for (std::size_t n = 0; n < line.size(); ++n)
      {
        const Vector3& here = trees[k][line[n]];
        const Vector3 along =
          trees[k][line[std::min(n + 1, line.size() - 1)]] - trees[k][line[n > 0 ? n - 1 : 0]];
        places.emplace_back(here + beside * along.cross(here - centre).normalized());
      }
      part.positions.push_back(TubeSurface::Points(places, radius));
    }
    parts.push_back(std::move(part));
  };
  // The small cardiac vein beside the RCA, the great one beside the LAD.
  tube("vein beside the RCA", 0, 4.0, 1.3, material("blood", 0.6 * iodine));
  tube("vein beside the LAD", 2, 4.0, 1.5, material("blood", 0.6 * iodine));
  for (std::size_t vessel = 0; vessel < tree.Reference().lines.size(); ++vessel)
  {
    tube("artery " + std::to_string(vessel), vessel, 0.0, 0.0, material("blood", iodine));
  }
  return MeshAnatomy(std::move(parts), CycleSeconds);
}
}

#endif
