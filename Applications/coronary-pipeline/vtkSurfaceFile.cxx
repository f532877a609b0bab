#include "vtkSurfaceFile.h"

#include "MeshFile.h"
#include "StlPlyFile.h"
#include "VolumeFile.h"
#include "vtkDataFiles.h"
#include "vtkMaskSurface.h"
#include "vtkMessageTrap.h"
#include "vtkSurfaceInput.h"

#include "vtkCellArray.h"
#include "vtkGeometryFilter.h"
#include "vtkNew.h"
#include "vtkPoints.h"
#include "vtkUnstructuredGrid.h"

#include <fstream>
#include <stdexcept>

namespace coronary
{
namespace
{
vtkSmartPointer<vtkPolyData> Triangles(const FileMesh& mesh)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Vector3& point : mesh.points)
  {
    points->InsertNextPoint(point.data());
  }
  vtkNew<vtkCellArray> polys;
  for (const Triangle& triangle : mesh.triangles)
  {
    const vtkIdType ids[3] = { triangle[0], triangle[1], triangle[2] };
    polys->InsertNextCell(3, ids);
  }
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  surface->SetPoints(points);
  surface->SetPolys(polys);
  return surface;
}
}

bool IsSurfaceFile(const std::string& path)
{
  const auto ends = [&](const char* end) { return EndsWith(path, end); };
  return IsMeshFile(path) || ends(".vtp") || ends(".vtu") || ends(".stl") || ends(".ply");
}

vtkSmartPointer<vtkPolyData> ReadSurface(
  const std::string& path, vtkMessageTrap& messages, const std::vector<std::string>& segments)
{
  vtkSmartPointer<vtkPolyData> surface;
  if (IsVolumeFileName(path))
  {
    surface = ReadMaskSurface(path, segments);
  }
  else if (EndsWith(path, ".vtp"))
  {
    surface = ReadPolyData(path, messages);
  }
  else if (EndsWith(path, ".vtu"))
  {
    vtkNew<vtkGeometryFilter> boundary;
    boundary->SetInputData(ReadUnstructuredGrid(path, messages));
    boundary->Update();
    messages.ThrowIfError();
    surface = boundary->GetOutput();
  }
  else if (EndsWith(path, ".stl"))
  {
    surface = Triangles(ReadStlFile(path));
  }
  else if (EndsWith(path, ".ply"))
  {
    surface = Triangles(ReadPlyFile(path));
  }
  else
  {
    surface = Triangles(ReadMeshFile(path));
  }
  if (surface->GetNumberOfPolys() == 0 && surface->GetNumberOfStrips() == 0)
  {
    throw std::runtime_error("'" + path + "' has no triangles: it is no surface.");
  }
  return surface;
}

SurfaceTriangles ReadTriangles(const std::string& path, const std::string& groups,
  const std::string& caps, vtkMessageTrap& messages, const std::vector<std::string>& segments)
{
  SurfaceTriangles surface;
  surface.data = vtkCoronary::TrianglesOf(ReadSurface(path, messages, segments));
  surface.mesh = vtkCoronary::SurfaceOf(surface.data, groups, caps);
  if (surface.mesh.triangles.empty())
  {
    throw std::runtime_error("'" + path + "' has no triangles.");
  }
  return surface;
}
}
