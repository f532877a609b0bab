#include "vtkSurfaceReduction.h"

#include "vtkCellArray.h"
#include "vtkCellArrayIterator.h"
#include "vtkDecimatePro.h"
#include "vtkIdTypeArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <algorithm>
#include <numeric>

namespace coronary
{
namespace
{
constexpr const char* Origin = "OriginalPointIds";

/// With the number of each point in the surface that it is of.
vtkSmartPointer<vtkPolyData> Numbered(vtkPolyData* surface)
{
  auto numbered = vtkSmartPointer<vtkPolyData>::New();
  numbered->SetPoints(surface->GetPoints());
  numbered->SetPolys(surface->GetPolys());
  vtkNew<vtkIdTypeArray> ids;
  ids->SetName(Origin);
  ids->SetNumberOfTuples(surface->GetNumberOfPoints());
  std::iota(ids->GetPointer(0), ids->GetPointer(0) + surface->GetNumberOfPoints(), vtkIdType(0));
  numbered->GetPointData()->AddArray(ids);
  return numbered;
}
}

ReducedSurface ReduceSurface(vtkPolyData* surface, vtkIdType wanted)
{
  vtkSmartPointer<vtkPolyData> left = Numbered(surface);
  if (surface->GetNumberOfPolys() > wanted)
  {
    vtkNew<vtkDecimatePro> decimation;
    decimation->SetInputData(left);
    decimation->SetTargetReduction(1.0 - double(wanted) / double(surface->GetNumberOfPolys()));
    decimation->PreserveTopologyOn();
    decimation->SplittingOff();
    decimation->BoundaryVertexDeletionOff();
    decimation->Update();
    left = decimation->GetOutput();
  }
  auto* ids = vtkIdTypeArray::SafeDownCast(left->GetPointData()->GetArray(Origin));
  ReducedSurface reduced;
  std::vector<vtkIdType> place(static_cast<std::size_t>(surface->GetNumberOfPoints()), -1);
  auto cells = vtkSmartPointer<vtkCellArrayIterator>::Take(left->GetPolys()->NewIterator());
  for (cells->GoToFirstCell(); !cells->IsDoneWithTraversal(); cells->GoToNextCell())
  {
    vtkIdType count = 0;
    const vtkIdType* corners = nullptr;
    cells->GetCurrentCell(count, corners);
    Triangle triangle;
    for (std::size_t k = 0; k < 3; ++k)
    {
      triangle[k] = ids->GetValue(corners[k]);
      place[static_cast<std::size_t>(triangle[k])] = 0;
    }
    reduced.triangles.push_back(triangle);
  }
  for (std::size_t k = 0; k < place.size(); ++k)
  {
    if (place[k] == 0)
    {
      place[k] = static_cast<vtkIdType>(reduced.points.size());
      reduced.points.push_back(static_cast<vtkIdType>(k));
    }
  }
  for (Triangle& triangle : reduced.triangles)
  {
    for (std::int64_t& corner : triangle)
    {
      corner = place[static_cast<std::size_t>(corner)];
    }
  }
  return reduced;
}
}
