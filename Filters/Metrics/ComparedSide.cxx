#include "ComparedSide.h"

#include "PartialProgress.h"
#include "Require.h"

#include <algorithm>
#include <stdexcept>

namespace coronary
{
void CheckSurface(const SurfaceMesh& mesh, const std::string& name)
{
  const auto points = static_cast<std::int64_t>(mesh.points.size());
  Require(!mesh.triangles.empty(), name + " has no triangles");
  Require(mesh.triangles.size() < (std::size_t(1) << 31) - 64 &&
      mesh.points.size() < (std::size_t(1) << 31) - 64,
    name + " has more than 2147483584 triangles or points");
  const auto oneEach = [&](std::size_t size, std::size_t elements, const char* what)
  {
    Require(size == 0 || size == elements,
      name + " has " + std::to_string(size) + " " + what + " for " + std::to_string(elements));
  };
  oneEach(mesh.triangleGroups.size(), mesh.triangles.size(), "groups of triangles");
  oneEach(mesh.pointGroups.size(), mesh.points.size(), "groups of points");
  oneEach(mesh.caps.size(), mesh.triangles.size(), "marks of caps");
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
  {
    for (const std::int64_t corner : mesh.triangles[i])
    {
      if (corner < 0 || corner >= points)
      {
        throw std::invalid_argument(name + ": triangle " + std::to_string(i) + " refers to point " +
          std::to_string(corner) + " of " + std::to_string(points));
      }
      if (!(mesh.points[corner].array().abs() <= 1e18).all())
      {
        throw std::invalid_argument(
          name + ": point " + std::to_string(corner) + " is not finite or beyond 1e18");
      }
    }
  }
}

std::vector<std::int64_t> GroupsOfTriangles(const SurfaceMesh& mesh)
{
  if (!mesh.triangleGroups.empty() || mesh.pointGroups.empty())
  {
    return mesh.triangleGroups;
  }
  std::vector<std::int64_t> groups(mesh.triangles.size());
  for (std::size_t i = 0; i < groups.size(); ++i)
  {
    const Triangle& t = mesh.triangles[i];
    const std::int64_t a = mesh.pointGroups[t[0]];
    const std::int64_t b = mesh.pointGroups[t[1]];
    const std::int64_t c = mesh.pointGroups[t[2]];
    groups[i] = b == c ? b : a;
  }
  return groups;
}

void PrepareSide(ComparedSide& side, const SurfaceMesh& mesh, const std::vector<SurfaceEnd>* ends,
  const MeshDistanceSettings& settings, const std::string& name)
{
  side.surface = TakeSurface(mesh, ends, settings.endLength);
  Require(!side.surface.triangles.empty(),
    name + " has no triangle that is compared: all are caps or beyond an end");
  const std::vector<std::int64_t> groups = GroupsOfTriangles(mesh);
  side.hasGroups = !groups.empty();
  const std::int64_t count = side.Triangles();
  side.groupOf.assign(count, 0);
  if (side.hasGroups)
  {
    for (const std::int32_t triangle : side.surface.inputTriangle)
    {
      side.groups.push_back(groups[triangle]);
    }
    std::sort(side.groups.begin(), side.groups.end());
    side.groups.erase(std::unique(side.groups.begin(), side.groups.end()), side.groups.end());
    for (std::int64_t i = 0; i < count; ++i)
    {
      side.groupOf[i] =
        static_cast<std::int32_t>(std::lower_bound(side.groups.begin(), side.groups.end(),
                                    groups[side.surface.inputTriangle[i]]) -
          side.groups.begin());
    }
  }
  else
  {
    side.groups = { -1 };
  }
  std::vector<Triangle> triangles(count);
  for (std::int64_t i = 0; i < count; ++i)
  {
    const SideTriangle& t = side.surface.triangles[i];
    triangles[i] = { t[0], t[1], t[2] };
  }
  side.tree = TriangleBvh(side.surface.points, triangles);
  std::vector<std::uint8_t> seen(side.surface.points.size(), 0);
  side.pointOrder.reserve(side.surface.points.size());
  for (const std::int32_t triangle : side.tree.Order())
  {
    for (const std::int32_t point : side.surface.triangles[triangle])
    {
      if (seen[point] == 0)
      {
        seen[point] = 1;
        side.pointOrder.push_back(point);
      }
    }
  }
}

void MeasurePoints(
  ComparedSide& side, const TriangleBvh& other, bool all, const ProgressCallback& progress)
{
  const auto count = static_cast<std::int64_t>(side.surface.points.size());
  side.distance.assign(count, 0.0);
  side.nearest.resize(count);
  const auto measure = [&](std::int32_t point, std::int64_t hint)
  {
    side.nearest[point] =
      other.Closest(side.surface.points[point], std::numeric_limits<double>::infinity(), hint);
    side.distance[point] = side.nearest[point].distance;
  };
  double minimum = -1.0;
  // One in so many shows how great the greatest distance is at least.
  constexpr std::int64_t sampling = 16;
  if (!all)
  {
    ParallelFor(count / sampling, ReportingGrain(progress, count / sampling, HintRange),
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t i = first; i < last; ++i)
        {
          const std::int32_t point = side.pointOrder[sampling * i];
          measure(
            point, i > first ? side.nearest[side.pointOrder[sampling * (i - 1)]].triangle : -1);
        }
      });
    for (std::int64_t i = 0; i < count / sampling; ++i)
    {
      minimum = std::max(minimum, side.distance[side.pointOrder[sampling * i]]);
    }
  }
  // Ranges that begin at a sample, so that what is stored does not depend on them.
  const std::int64_t ranges = (count + HintRange - 1) / HintRange;
  ParallelFor(
    ranges, 1,
    [&](std::int64_t firstRange, std::int64_t lastRange)
    {
      for (std::int64_t range = firstRange; range < lastRange; ++range)
      {
        std::int64_t hint = -1;
        for (std::int64_t i = HintRange * range; i < std::min(count, HintRange * (range + 1)); ++i)
        {
          const std::int32_t point = side.pointOrder[i];
          const bool known = !all && i % sampling == 0 && i / sampling < count / sampling;
          if (!known)
          {
            const TrianglePoint near = !all && hint >= 0
              ? other.NearestOn(hint, side.surface.points[point])
              : TrianglePoint();
            if (near.squaredDistance <= minimum * minimum && minimum > 0.0)
            {
              side.nearest[point].triangle = hint;
              side.distance[point] = std::sqrt(near.squaredDistance);
            }
            else
            {
              measure(point, hint);
            }
          }
          hint = side.nearest[point].triangle;
        }
      }
    },
    progress);
}

std::vector<double> ToInput(const ComparedSide& side, const std::vector<double>& distance)
{
  std::vector<double> result(side.surface.pointOfInput.size(), SideDistance::NaN);
  for (std::size_t i = 0; i < result.size(); ++i)
  {
    const std::int32_t point = side.surface.pointOfInput[i];
    if (point >= 0)
    {
      result[i] = distance[point];
    }
  }
  return result;
}
}
