/**
 * @file SurfaceTestMeshes.h
 * @brief Surfaces whose distances are known.
 */
#ifndef DynamicCoronary_SurfaceTestMeshes_h
#define DynamicCoronary_SurfaceTestMeshes_h

#include "MeshDistance.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

namespace coronary
{
inline void Append(SurfaceMesh& mesh, const SurfaceMesh& other)
{
  const auto first = static_cast<std::int64_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : other.triangles)
  {
    mesh.triangles.push_back({ first + t[0], first + t[1], first + t[2] });
  }
}

/// n x m cells of two triangles over [x0, x1] x [y0, y1]; z as given.
inline SurfaceMesh Sheet(double x0, double x1, double y0, double y1, int n, int m,
  const std::function<double(double, double)>& z)
{
  SurfaceMesh mesh;
  for (int j = 0; j <= m; ++j)
  {
    for (int i = 0; i <= n; ++i)
    {
      const double x = x0 + (x1 - x0) * i / n;
      const double y = y0 + (y1 - y0) * j / m;
      mesh.points.emplace_back(x, y, z(x, y));
    }
  }
  for (int j = 0; j < m; ++j)
  {
    for (int i = 0; i < n; ++i)
    {
      const std::int64_t p = static_cast<std::int64_t>(j) * (n + 1) + i;
      mesh.triangles.push_back({ p, p + 1, p + n + 2 });
      mesh.triangles.push_back({ p, p + n + 2, p + n + 1 });
    }
  }
  return mesh;
}

/// An octahedron, quartered so often and put onto a sphere.
inline SurfaceMesh Sphere(double radius, int levels, const Vector3& centre = Vector3::Zero())
{
  SurfaceMesh mesh;
  mesh.points = { { 1, 0, 0 }, { -1, 0, 0 }, { 0, 1, 0 }, { 0, -1, 0 }, { 0, 0, 1 }, { 0, 0, -1 } };
  mesh.triangles = { { 0, 2, 4 }, { 2, 1, 4 }, { 1, 3, 4 }, { 3, 0, 4 }, { 2, 0, 5 }, { 1, 2, 5 },
    { 3, 1, 5 }, { 0, 3, 5 } };
  for (int level = 0; level < levels; ++level)
  {
    std::map<std::pair<std::int64_t, std::int64_t>, std::int64_t> middles;
    std::vector<Triangle> finer;
    for (const Triangle& t : mesh.triangles)
    {
      std::array<std::int64_t, 3> m{};
      for (int k = 0; k < 3; ++k)
      {
        const auto [entry, isNew] = middles.try_emplace(
          std::minmax(t[k], t[(k + 1) % 3]), static_cast<std::int64_t>(mesh.points.size()));
        if (isNew)
        {
          mesh.points.emplace_back((mesh.points[t[k]] + mesh.points[t[(k + 1) % 3]]).normalized());
        }
        m[k] = entry->second;
      }
      finer.push_back({ t[0], m[0], m[2] });
      finer.push_back({ m[0], t[1], m[1] });
      finer.push_back({ m[2], m[1], t[2] });
      finer.push_back({ m[0], m[1], m[2] });
    }
    mesh.triangles = finer;
  }
  for (Vector3& p : mesh.points)
  {
    p = centre + radius * p;
  }
  return mesh;
}

/// A tube along z, its points on the cylinder; open, or with flat caps that are marked.
inline SurfaceMesh Tube(double radius, double z0, double z1, int around, int along, bool capped)
{
  SurfaceMesh mesh;
  const auto at = [&](int ring, int i)
  { return static_cast<std::int64_t>(ring) * around + i % around; };
  for (int ring = 0; ring <= along; ++ring)
  {
    for (int i = 0; i < around; ++i)
    {
      const double angle = 2.0 * M_PI * i / around;
      mesh.points.emplace_back(
        radius * std::cos(angle), radius * std::sin(angle), z0 + (z1 - z0) * ring / along);
    }
  }
  for (int ring = 0; ring < along; ++ring)
  {
    for (int i = 0; i < around; ++i)
    {
      mesh.triangles.push_back({ at(ring, i), at(ring, i + 1), at(ring + 1, i) });
      mesh.triangles.push_back({ at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i) });
    }
  }
  if (capped)
  {
    mesh.caps.assign(mesh.triangles.size(), 0);
    const auto bottom = static_cast<std::int64_t>(mesh.points.size());
    mesh.points.emplace_back(0, 0, z0);
    mesh.points.emplace_back(0, 0, z1);
    for (int i = 0; i < around; ++i)
    {
      mesh.triangles.push_back({ bottom, at(0, i + 1), at(0, i) });
      mesh.triangles.push_back({ bottom + 1, at(along, i), at(along, i + 1) });
      mesh.caps.insert(mesh.caps.end(), 2, 1);
    }
  }
  return mesh;
}
}

#endif
