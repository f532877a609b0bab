#include "vtkRunSurface.h"

#include "vtkCellData.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkDataArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkPolyDataConnectivityFilter.h"
#include "vtkSeeds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
/// That a tree begins at its widest end is a guess.
constexpr double GuessedConfidence = 0.5;

/// How much of a vessel an end is, mm: at its very tip it is rounded off.
constexpr double EndLength = 5.0;

std::vector<Vector3> HighestPoints(vtkPolyData* surface)
{
  vtkNew<vtkPolyDataConnectivityFilter> components;
  components->SetInputData(surface);
  components->SetExtractionModeToAllRegions();
  components->ColorRegionsOn();
  components->Update();
  vtkPolyData* colored = components->GetOutput();
  vtkDataArray* region = colored->GetPointData()->GetArray("RegionId");
  std::map<int, Vector3> highest;
  for (vtkIdType n = 0; n < colored->GetNumberOfPoints(); ++n)
  {
    Vector3 point;
    colored->GetPoint(n, point.data());
    auto& top = highest.emplace(static_cast<int>(region->GetTuple1(n)), point).first->second;
    top = point[2] > top[2] ? point : top;
  }
  std::vector<Vector3> points;
  points.reserve(highest.size());
  for (const auto& [id, point] : highest)
  {
    points.push_back(point);
  }
  return points;
}
}

vtkSmartPointer<vtkPolyData> SeedsOfSurface(vtkPolyData* surface, const std::vector<double>& given)
{
  std::vector<Vector3> positions;
  for (std::size_t n = 0; n + 2 < given.size(); n += 3)
  {
    positions.emplace_back(given[n], given[n + 1], given[n + 2]);
  }
  if (given.empty())
  {
    positions = HighestPoints(surface);
  }
  return MakeSeeds(positions, given.empty() ? GuessedConfidence : 1.0);
}

vtkSmartPointer<vtkPolyData> WidestEnds(vtkPolyData* trees)
{
  vtkDataArray* radii = trees->GetPointData()->GetArray(vtkCoronaryArrayNames::Radius);
  vtkDataArray* abscissas = trees->GetPointData()->GetArray(vtkCoronaryArrayNames::Abscissas);
  vtkDataArray* parents = trees->GetCellData()->GetArray(vtkCoronaryArrayNames::ParentGroupIds);
  vtkDataArray* groups = trees->GetCellData()->GetArray(vtkCoronaryArrayNames::GroupIds);
  vtkDataArray* treeIds = trees->GetCellData()->GetArray(vtkCoronaryArrayNames::TreeIds);
  std::set<double> inner;
  for (vtkIdType cell = 0; cell < trees->GetNumberOfCells(); ++cell)
  {
    inner.insert(parents->GetTuple1(cell));
  }
  std::map<double, std::pair<double, vtkIdType>> widest; // by tree
  vtkNew<vtkIdList> ids;
  const auto offer = [&](vtkIdType cell, bool first)
  {
    const vtkIdType count = ids->GetNumberOfIds();
    const vtkIdType end = ids->GetId(first ? 0 : count - 1);
    double width = 0.0;
    for (vtkIdType n = 0; n < count; ++n)
    {
      const vtkIdType point = ids->GetId(n);
      const double away = std::abs(abscissas->GetTuple1(point) - abscissas->GetTuple1(end));
      width = away <= EndLength ? std::max(width, radii->GetTuple1(point)) : width;
    }
    auto& best = widest.emplace(treeIds->GetTuple1(cell), std::pair(width, end)).first->second;
    best = width > best.first ? std::pair(width, end) : best;
  };
  for (vtkIdType cell = 0; cell < trees->GetNumberOfCells(); ++cell)
  {
    trees->GetCellPoints(cell, ids);
    if (parents->GetTuple1(cell) < 0.0)
    {
      offer(cell, true);
    }
    if (inner.count(groups->GetTuple1(cell)) == 0)
    {
      offer(cell, false);
    }
  }
  std::vector<Vector3> positions;
  for (const auto& [tree, best] : widest)
  {
    positions.emplace_back();
    trees->GetPoint(best.second, positions.back().data());
  }
  return MakeSeeds(positions, GuessedConfidence);
}
}
