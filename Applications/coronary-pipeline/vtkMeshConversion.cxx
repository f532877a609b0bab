#include "vtkMeshConversion.h"

#include "Command.h"
#include "MatrixFile.h"
#include "MeshFile.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"

#include "vtkCellArray.h"
#include "vtkCellType.h"
#include "vtkDataArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnstructuredGrid.h"

#include <stdexcept>

namespace coronary
{
namespace
{
bool IsVtk(const std::string& path)
{
  return EndsWith(path, ".vtp") || EndsWith(path, ".vtu");
}

vtkSmartPointer<vtkPointSet> ReadPointSet(const std::string& path, vtkMessageTrap& messages)
{
  if (EndsWith(path, ".vtp"))
  {
    return ReadPolyData(path, messages);
  }
  return ReadUnstructuredGrid(path, messages);
}

void WriteVtk(const std::string& path, const FileMesh& mesh, vtkMessageTrap& messages)
{
  const vtkSmartPointer<vtkPolyData> surface = PolyDataOf(mesh);
  if (EndsWith(path, ".vtu"))
  {
    vtkNew<vtkUnstructuredGrid> grid;
    grid->SetPoints(surface->GetPoints());
    for (const auto& tetrahedron : mesh.tetrahedra)
    {
      const vtkIdType ids[4] = { tetrahedron[0], tetrahedron[1], tetrahedron[2], tetrahedron[3] };
      grid->InsertNextCell(VTK_TETRA, 4, ids);
    }
    // A volume's triangles are its surface: in VTK they follow from the tetrahedra.
    for (std::size_t n = 0; mesh.tetrahedra.empty() && n < mesh.triangles.size(); ++n)
    {
      const vtkIdType ids[3] = { mesh.triangles[n][0], mesh.triangles[n][1], mesh.triangles[n][2] };
      grid->InsertNextCell(VTK_TRIANGLE, 3, ids);
    }
    WriteUnstructuredGrid(path, grid, messages);
    return;
  }
  WritePolyData(path, surface, messages);
}

Eigen::MatrixXd ArrayOf(vtkPointSet* data, const std::string& name, const std::string& path)
{
  vtkDataArray* array = data->GetPointData()->GetArray(name.c_str());
  if (array == nullptr)
  {
    throw std::runtime_error("'" + path + "' has no point array '" + name + "'.");
  }
  Eigen::MatrixXd matrix(array->GetNumberOfTuples(), array->GetNumberOfComponents());
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
  {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
    {
      matrix(row, column) = array->GetComponent(row, static_cast<int>(column));
    }
  }
  return matrix;
}
}

FileMesh MeshOf(vtkPointSet* data, const std::string& path)
{
  FileMesh mesh;
  for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
  {
    mesh.points.emplace_back(data->GetPoint(n));
  }
  vtkNew<vtkIdList> ids;
  vtkIdType others = 0;
  for (vtkIdType cell = 0; cell < data->GetNumberOfCells(); ++cell)
  {
    data->GetCellPoints(cell, ids);
    const int type = data->GetCellType(cell);
    if (type == VTK_TRIANGLE || type == VTK_POLYGON || type == VTK_QUAD)
    {
      for (vtkIdType i = 2; i < ids->GetNumberOfIds(); ++i)
      {
        mesh.triangles.push_back({ ids->GetId(0), ids->GetId(i - 1), ids->GetId(i) });
      }
    }
    else if (type == VTK_TETRA)
    {
      mesh.tetrahedra.push_back({ ids->GetId(0), ids->GetId(1), ids->GetId(2), ids->GetId(3) });
    }
    else
    {
      ++others;
    }
  }
  if (others > 0)
  {
    throw std::runtime_error("'" + path + "' has " + std::to_string(others) +
      " cells that are neither triangles nor tetrahedra.");
  }
  return mesh;
}

vtkSmartPointer<vtkPolyData> PolyDataOf(const FileMesh& mesh)
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

bool IsMeshConversion(const std::string& input, const std::string& output)
{
  const auto of = [](const std::string& path)
  { return IsMeshFile(path) || EndsWith(path, ".dmat") || EndsWith(path, ".vtu"); };
  return of(input) || of(output);
}

std::string ConvertMesh(const std::string& input, const std::string& output,
  const std::string& array, bool binary, vtkMessageTrap& messages)
{
  if (EndsWith(output, ".dmat"))
  {
    if (!EndsWith(input, ".dmat") && !IsVtk(input))
    {
      throw UsageError("OUTPUT .dmat needs an INPUT in .dmat, .vtp or .vtu, not '" + input + "'");
    }
    const Eigen::MatrixXd matrix = EndsWith(input, ".dmat")
      ? ReadMatrixFile(input)
      : ArrayOf(ReadPointSet(input, messages), array, input);
    WriteMatrixFile(output, matrix, binary);
    return output + ": " + std::to_string(matrix.rows()) + " rows, " +
      std::to_string(matrix.cols()) + " columns";
  }
  for (const auto& [name, path] : { std::pair("INPUT", input), std::pair("OUTPUT", output) })
  {
    if (!IsMeshFile(path) && !IsVtk(path))
    {
      throw UsageError(std::string(name) +
        " of a mesh must end in .obj, .off, .mesh, .vtp or .vtu, '" + path + "' does not");
    }
  }
  FileMesh mesh =
    IsMeshFile(input) ? ReadMeshFile(input) : MeshOf(ReadPointSet(input, messages), input);
  if (EndsWith(output, ".vtp") && !mesh.tetrahedra.empty() && mesh.triangles.empty())
  {
    throw std::runtime_error(
      "'" + input + "' has no triangles for a .vtp file: write a .vtu file.");
  }
  const std::size_t kept =
    EndsWith(output, ".mesh") || EndsWith(output, ".vtu") ? mesh.tetrahedra.size() : 0;
  if (kept == 0)
  {
    mesh.tetrahedra.clear();
  }
  if (IsMeshFile(output))
  {
    WriteMeshFile(output, mesh);
  }
  else
  {
    WriteVtk(output, mesh, messages);
  }
  return output + ": " + std::to_string(mesh.points.size()) + " points, " +
    std::to_string(mesh.triangles.size()) + " triangles, " +
    std::to_string(mesh.tetrahedra.size()) + " tetrahedra";
}
}
