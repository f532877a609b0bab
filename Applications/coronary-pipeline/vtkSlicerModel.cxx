#include "vtkSlicerModel.h"

#include "AtomicFile.h"
#include "vtkDataFiles.h"
#include "vtkMeshConversion.h"
#include "vtkMessageTrap.h"

#include "vtkFieldData.h"
#include "vtkNew.h"
#include "vtkPLYWriter.h"
#include "vtkPolyData.h"
#include "vtkPolyDataWriter.h"
#include "vtkSTLWriter.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkTriangleFilter.h"

#include <stdexcept>

namespace coronary
{
namespace
{
constexpr const char* Space = "SPACE=LPS";
constexpr const char* Title = "coronary-pipeline. SPACE=LPS";

vtkSmartPointer<vtkPolyData> TrianglesOf(vtkPolyData* data, const std::string& path)
{
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputData(data);
  triangles->PassVertsOff();
  triangles->PassLinesOff();
  triangles->Update();
  if (triangles->GetOutput()->GetNumberOfPolys() == 0)
  {
    throw std::runtime_error("Cannot write '" + path + "': there are no triangles.");
  }
  return triangles->GetOutput();
}

void CheckWritten(int good, const std::string& path, vtkMessageTrap& messages)
{
  messages.ThrowIfError();
  if (good == 0)
  {
    throw std::runtime_error("Cannot write '" + path + "'.");
  }
}

/// Of the kinds that VTK writes to files only; their floats are single.
template <typename Writer>
void WriteBinary(
  const std::string& path, vtkPolyData* data, Writer* writer, vtkMessageTrap& messages)
{
  AtomicFile file(path);
  writer->SetInputData(data);
  writer->SetFileTypeToBinary();
  writer->SetFileName(file.TemporaryPath().c_str());
  CheckWritten(writer->Write(), path, messages);
  file.Commit();
}
}

bool IsSlicerModelFile(const std::string& path)
{
  const auto ends = [&](const char* end) { return EndsWith(path, end); };
  return ends(".vtp") || ends(".vtk") || ends(".stl") || ends(".ply") || ends(".obj");
}

void WriteSlicerModel(const std::string& path, vtkPolyData* data, vtkMessageTrap& messages)
{
  if (EndsWith(path, ".vtp") || EndsWith(path, ".vtk"))
  {
    vtkNew<vtkPolyData> copy;
    copy->ShallowCopy(data);
    if (EndsWith(path, ".vtp"))
    {
      vtkNew<vtkStringArray> space;
      space->SetName("SPACE");
      space->InsertNextValue("LPS");
      copy->GetFieldData()->AddArray(space);
      WritePolyData(path, copy, messages);
      return;
    }
    vtkNew<vtkPolyDataWriter> writer;
    writer->SetInputData(copy);
    writer->SetHeader(Title);
    // What the VTK of older Slicers reads, too.
    writer->SetFileVersion(vtkDataWriter::VTK_LEGACY_READER_VERSION_4_2);
    writer->SetFileTypeToBinary();
    writer->WriteToOutputStringOn();
    CheckWritten(writer->Write(), path, messages);
    WriteFileAtomically(path, writer->GetOutputStdString());
    return;
  }
  const vtkSmartPointer<vtkPolyData> triangles = TrianglesOf(data, path);
  if (EndsWith(path, ".stl"))
  {
    vtkNew<vtkSTLWriter> writer;
    writer->SetHeader(Title);
    WriteBinary(path, triangles, writer.Get(), messages);
  }
  else if (EndsWith(path, ".ply"))
  {
    vtkNew<vtkPLYWriter> writer;
    writer->AddComment(Space);
    WriteBinary(path, triangles, writer.Get(), messages);
  }
  else if (EndsWith(path, ".obj"))
  {
    FileMesh mesh = MeshOf(triangles, path);
    mesh.comment = Title;
    WriteFileAtomically(path, ObjText(mesh));
  }
  else
  {
    throw std::runtime_error(
      "'" + path + "' is none of .vtp, .vtk, .stl, .ply and .obj, which Slicer reads as models.");
  }
}
}
