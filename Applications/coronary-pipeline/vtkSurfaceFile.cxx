#include "vtkSurfaceFile.h"

#include "MeshFile.h"
#include "VolumeFile.h"
#include "vtkDataFiles.h"
#include "vtkMaskSurface.h"
#include "vtkMeshConversion.h"
#include "vtkMessageTrap.h"
#include "vtkSurfaceInput.h"

#include "vtkGeometryFilter.h"
#include "vtkNew.h"
#include "vtkUnstructuredGrid.h"

#include <stdexcept>

namespace coronary
{
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
    surface = PolyDataOf(ReadStlFile(path));
  }
  else if (EndsWith(path, ".ply"))
  {
    surface = PolyDataOf(ReadPlyFile(path));
  }
  else
  {
    surface = PolyDataOf(ReadMeshFile(path));
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
