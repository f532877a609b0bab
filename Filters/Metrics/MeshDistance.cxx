#include "MeshDistance.h"

#include "HausdorffSearch.h"
#include "PartialProgress.h"
#include "Require.h"
#include "SurfaceSign.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
/// Eq. 16 and the area for a side (group -1) or one of its groups.
void MeasureVertices(const ComparedSide& side, const SurfaceMesh& mesh,
  const std::vector<std::int64_t>& groups, std::int64_t group, SideDistance& result)
{
  if (side.distance.empty())
  {
    return;
  }
  CompensatedSum sum;
  std::vector<std::uint8_t> mine;
  if (group >= 0 && mesh.pointGroups.empty())
  {
    // Without groups of points: the points of its triangles.
    mine.assign(mesh.points.size(), 0);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    {
      if (groups[i] == side.groups[group])
      {
        for (const std::int64_t point : mesh.triangles[i])
        {
          mine[point] = 1;
        }
      }
    }
  }
  for (std::size_t i = 0; i < side.surface.pointOfInput.size(); ++i)
  {
    const std::int32_t point = side.surface.pointOfInput[i];
    const bool counts = point >= 0 &&
      (group < 0 || (mine.empty() ? mesh.pointGroups[i] == side.groups[group] : mine[i] != 0));
    if (counts)
    {
      const double distance = side.distance[point];
      sum.Add(distance);
      result.vertexMaximum =
        result.vertices == 0 ? distance : std::max(result.vertexMaximum, distance);
      ++result.vertices;
    }
  }
  if (result.vertices > 0)
  {
    result.vertexMean = sum.Value() / static_cast<double>(result.vertices);
  }
}

std::string UnitWarning(
  const SurfaceMesh& a, const SurfaceMesh& b, const std::array<std::string, 2>& names)
{
  std::array<double, 2> size = { 0.0, 0.0 };
  int n = 0;
  for (const SurfaceMesh* mesh : { &a, &b })
  {
    Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
    Vector3 high = -low;
    for (const Triangle& t : mesh->triangles)
    {
      for (const std::int64_t point : t)
      {
        low = low.cwiseMin(mesh->points[point]);
        high = high.cwiseMax(mesh->points[point]);
      }
    }
    size[n++] = (high - low).norm();
  }
  if (size[0] > 0.0 && size[1] > 0.0)
  {
    const double ratio = std::max(size[0], size[1]) / std::min(size[0], size[1]);
    for (const double unit : { 10.0, 100.0, 1000.0 })
    {
      if (ratio > 0.8 * unit && ratio < 1.25 * unit)
      {
        return names[size[0] > size[1] ? 0 : 1] + " is about " +
          std::to_string(static_cast<int>(unit)) +
          " times as large as the other surface: they seem to be in different units";
      }
    }
  }
  return {};
}

/// The ends of both meshes, when they are to be left out.
std::vector<SurfaceEnd> EndsOf(
  const std::array<const SurfaceMesh*, 2>& meshes, std::vector<std::string>& warnings)
{
  std::vector<SurfaceEnd> ends;
  for (const SurfaceMesh* mesh : meshes)
  {
    const std::vector<SurfaceEnd> found = FindSurfaceEnds(*mesh);
    ends.insert(ends.end(), found.begin(), found.end());
  }
  if (ends.empty())
  {
    warnings.emplace_back(
      "No ends were found to be left out: both surfaces are closed, without marks of caps");
  }
  return ends;
}

/// Hausdorff distances of a side and of its branches.
void MeasureHausdorff(const ComparedSide& from, const ComparedSide& to,
  const std::vector<DistancePart>& parts, const MeshDistanceSettings& settings,
  const std::string& name, SideDistance& total, std::vector<SideDistance>& branches,
  std::vector<std::string>& warnings, const ProgressCallback& progress)
{
  HausdorffSearch search(from, to, settings);
  search.Run(parts, progress);
  if (!search.Complete())
  {
    warnings.push_back("The search for the Hausdorff distance from " + name + " stopped after " +
      std::to_string(settings.maximumPieces) + " pieces");
  }
  double supremum = 0.0;
  for (std::size_t g = 0; g < branches.size(); ++g)
  {
    const HausdorffSearch::Attained& best = search.Results()[g];
    SideDistance& branch = branches[g];
    branch.hausdorff = best.distance;
    branch.hausdorffError = search.Error(g);
    branch.at = best.at;
    branch.nearest = to.tree.Closest(best.at).point;
    branch.triangle = from.surface.inputTriangle[best.triangle];
    supremum = std::max(supremum, branch.hausdorff + branch.hausdorffError);
    if (!(total.hausdorff >= branch.hausdorff))
    {
      total.hausdorff = branch.hausdorff;
      total.at = branch.at;
      total.nearest = branch.nearest;
      total.triangle = branch.triangle;
    }
  }
  total.hausdorffError = supremum - total.hausdorff;
}

/// Distances of the points for those of the input, with a sign where that is wanted and known.
void StorePointDistances(const std::array<ComparedSide, 2>& sides,
  const std::array<const SurfaceMesh*, 2>& meshes, const MeshDistanceSettings& settings,
  MeshDistance& result)
{
  std::array<std::vector<double>, 2> distances;
  if (settings.pointMeasures)
  {
    distances = { sides[0].distance, sides[1].distance };
  }
  std::array<bool, 2> isSigned = { false, false };
  if (settings.signedDistances && settings.pointMeasures)
  {
    ParallelFor(2, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t s = first; s < last; ++s)
        {
          isSigned[s] = SignDistances(
            sides[s], *meshes[1 - s], sides[1 - s], settings.clipEnds, settings, distances[s]);
        }
      });
  }
  if (settings.pointMeasures)
  {
    result.pointDistancesA = ToInput(sides[0], distances[0]);
    result.pointDistancesB = ToInput(sides[1], distances[1]);
  }
  result.signedA = isSigned[0];
  result.signedB = isSigned[1];
}

/// Vertex and area measures of side `s` and of its branches; `pooled` gets its parts as well.
void MeasureSide(int s, ComparedSide& side, const SurfaceMesh& mesh,
  const std::vector<DistancePart>& parts, const MeshDistanceSettings& settings, SideDistance& total,
  std::vector<SideDistance>& branches, std::vector<const DistancePart*>& pooled,
  MeshDistance& result)
{
  const std::vector<std::int64_t> groups = GroupsOfTriangles(mesh);
  if (!settings.pointMeasures)
  {
    // Not all of them are exact.
    side.distance.clear();
  }
  MeasureVertices(side, mesh, groups, -1, total);
  std::vector<const DistancePart*> own;
  std::vector<std::vector<const DistancePart*>> ofGroup(side.groups.size());
  for (const DistancePart& part : parts)
  {
    if (part.area > 0.0)
    {
      own.push_back(&part);
      ofGroup[side.groupOf[part.triangle]].push_back(&part);
    }
  }
  pooled.insert(pooled.end(), own.begin(), own.end());
  FillAreaMeasures(own, total);
  if (!settings.areaMeasures)
  {
    CompensatedSum area;
    for (std::int64_t i = 0; i < side.Triangles(); ++i)
    {
      area.Add(side.Area(i));
    }
    total.area = area.Value();
  }
  if (!side.hasGroups)
  {
    return;
  }
  for (std::size_t g = 0; g < side.groups.size(); ++g)
  {
    SideDistance& branch = branches[g];
    MeasureVertices(side, mesh, groups, static_cast<std::int64_t>(g), branch);
    FillAreaMeasures(ofGroup[g], branch);
    result.branches.push_back({ s, side.groups[g], branch });
  }
}

/// What is of both sides together.
void Combine(const std::vector<const DistancePart*>& pooled, const MeshDistanceSettings& settings,
  MeshDistance& result)
{
  if (settings.hausdorff)
  {
    result.hausdorff = std::max(result.ab.hausdorff, result.ba.hausdorff);
    result.hausdorffError = std::max(result.ab.hausdorff + result.ab.hausdorffError,
                              result.ba.hausdorff + result.ba.hausdorffError) -
      result.hausdorff;
  }
  const double area = result.ab.area + result.ba.area;
  if (settings.areaMeasures && area > 0.0)
  {
    SideDistance both;
    FillAreaMeasures(pooled, both);
    result.mean = both.mean;
    result.rms = both.rms;
    result.percentile95 = both.percentile95;
    result.hausdorff95 = std::max(result.ab.percentile95, result.ba.percentile95);
    result.quadratureError =
      (result.ab.area * result.ab.quadratureError + result.ba.area * result.ba.quadratureError) /
      area;
  }
}
}

void MeshDistanceSettings::Validate() const
{
  Require(errorBound > 0.0 && std::isfinite(errorBound),
    "MeshDistanceSettings: errorBound must be positive");
  Require(endLength > 0.0 && std::isfinite(endLength),
    "MeshDistanceSettings: endLength must be positive");
  Require(maximumPieces > 0, "MeshDistanceSettings: maximumPieces must be positive");
}

MeshDistance CompareSurfaces(const SurfaceMesh& a, const SurfaceMesh& b,
  const MeshDistanceSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  const std::array<const SurfaceMesh*, 2> meshes = { &a, &b };
  const std::array<std::string, 2>& names = settings.names;
  for (int s = 0; s < 2; ++s)
  {
    CheckSurface(*meshes[s], names[s]);
  }
  const double areaShare = settings.areaMeasures ? 3.0 : 0.0;
  const double searchShare = settings.hausdorff ? 1.0 : 0.0;
  const WorkParts work(
    progress, { 1.0, 1.5, 1.5, areaShare, areaShare, searchShare, searchShare, 1.5 });
  Report(progress, 0.0);
  MeshDistance result;
  const std::string units = UnitWarning(a, b, names);
  if (!units.empty())
  {
    result.warnings.push_back(units);
  }
  std::vector<SurfaceEnd> ends;
  if (settings.clipEnds)
  {
    ends = EndsOf(meshes, result.warnings);
  }
  std::array<ComparedSide, 2> sides;
  ParallelFor(2, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t s = first; s < last; ++s)
      {
        PrepareSide(sides[s], *meshes[s], settings.clipEnds ? &ends : nullptr, settings, names[s]);
      }
    });
  SkipProgress(work(0), 0.0, 1.0);
  const bool onlyHausdorff = !settings.pointMeasures && !settings.areaMeasures;
  std::array<SideDistance*, 2> totals = { &result.ab, &result.ba };
  std::array<std::vector<DistancePart>, 2> parts;
  for (int s = 0; s < 2; ++s)
  {
    MeasurePoints(
      sides[s], sides[1 - s].tree, !onlyHausdorff || sides[s].groups.size() > 1, work(1 + s));
  }
  for (int s = 0; s < 2 && settings.areaMeasures; ++s)
  {
    DistanceIntegral integral(sides[s], sides[1 - s].tree);
    integral.Compute(settings.errorBound, work(3 + s));
    parts[s] = integral.Parts();
    totals[s]->quadratureError = integral.Error();
  }

  std::array<std::vector<SideDistance>, 2> branches;
  for (int s = 0; s < 2; ++s)
  {
    branches[s].resize(sides[s].groups.size());
  }
  for (int s = 0; s < 2 && settings.hausdorff; ++s)
  {
    MeasureHausdorff(sides[s], sides[1 - s], parts[s], settings, names[s], *totals[s], branches[s],
      result.warnings, work(5 + s));
  }

  SkipProgress(work(7), 0.0, 1.0);
  StorePointDistances(sides, meshes, settings, result);
  std::vector<const DistancePart*> pooled;
  for (int s = 0; s < 2; ++s)
  {
    MeasureSide(
      s, sides[s], *meshes[s], parts[s], settings, *totals[s], branches[s], pooled, result);
  }
  Combine(pooled, settings, result);
  Report(progress, 1.0);
  return result;
}
}
