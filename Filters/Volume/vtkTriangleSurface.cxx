#include "vtkTriangleSurface.h"

#include "vtkCellArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPolyData.h"

#include <stdexcept>
#include <string>

namespace vtkCoronary
{
std::vector<coronary::Vector3> ReadPoints(vtkPolyData* data)
{
  std::vector<coronary::Vector3> points(data->GetNumberOfPoints());
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    data->GetPoint(static_cast<vtkIdType>(i), points[i].data());
  }
  return points;
}

std::vector<coronary::Triangle> ReadTriangles(vtkPolyData* surface)
{
  if (surface->GetNumberOfStrips() > 0)
  {
    throw std::invalid_argument("The surface has triangle strips; triangulate it first");
  }
  std::vector<coronary::Triangle> triangles;
  vtkNew<vtkIdList> cell;
  vtkCellArray* polygons = surface->GetPolys();
  for (polygons->InitTraversal(); polygons->GetNextCell(cell) != 0;)
  {
    if (cell->GetNumberOfIds() != 3)
    {
      throw std::invalid_argument("Cell " + std::to_string(triangles.size()) +
        " of the surface has " + std::to_string(cell->GetNumberOfIds()) +
        " corners; triangulate it first");
    }
    triangles.push_back({ cell->GetId(0), cell->GetId(1), cell->GetId(2) });
  }
  return triangles;
}
}
