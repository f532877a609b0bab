#include "vtkDataFiles.h"

#include "AtomicFile.h"
#include "TextFile.h"
#include "XmlDataFile.h"
#include "vtkMessageTrap.h"

#include "vtkCell.h"
#include "vtkCellArray.h"
#include "vtkGenericCell.h"
#include "vtkNew.h"
#include "vtkPolyData.h"
#include "vtkUnstructuredGrid.h"
#include "vtkXMLDataReader.h"
#include "vtkXMLPolyDataReader.h"
#include "vtkXMLPolyDataWriter.h"
#include "vtkXMLUnstructuredDataWriter.h"
#include "vtkXMLUnstructuredGridReader.h"
#include "vtkXMLUnstructuredGridWriter.h"

#include <array>
#include <limits>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
void ReadXml(
  const std::string& path, vtkXMLDataReader* reader, const char* what, vtkMessageTrap& messages)
{
  std::string text =
    ReadTextFile(path, "a VTK file", std::numeric_limits<std::uint64_t>::max() - 1);
  if (!reader->CanReadFile(path.c_str()))
  {
    throw std::runtime_error("'" + path + "' is not a VTK XML " + what + " file.");
  }
  text = ReadableXmlData(std::move(text), path);
  try
  {
    reader->ReadFromInputStringOn();
    reader->SetInputString(text);
    reader->Update();
    messages.ThrowIfError();
  }
  catch (const std::exception& error)
  {
    throw std::runtime_error("Cannot read '" + path + "': " + error.what());
  }
}

/// That all corners are points: not all of VTK's filters look.
void CheckCorners(const std::string& path, vtkCellArray* cells, vtkIdType points)
{
  const vtkIdType count = cells ? cells->GetNumberOfCells() : 0;
  for (vtkIdType c = 0; c < count; ++c)
  {
    vtkIdType size = 0;
    const vtkIdType* corners = nullptr;
    cells->GetCellAtId(c, size, corners);
    for (vtkIdType n = 0; n < size; ++n)
    {
      if (corners[n] < 0 || corners[n] >= points)
      {
        throw std::runtime_error("'" + path + "' has a cell at point " +
          std::to_string(corners[n]) + ", and " + std::to_string(points) + " points.");
      }
    }
  }
}

/// That cells are of kinds that VTK knows, with as many corners as these have.
void CheckCellTypes(const std::string& path, vtkUnstructuredGrid* grid)
{
  const auto refuse = [&](vtkIdType cell, const char* what)
  {
    throw std::runtime_error("'" + path + "' has a cell of type " +
      std::to_string(grid->GetCellType(cell)) + ", which " + what + ".");
  };
  std::array<int, 256> sizes{}; // 0: not known yet, -1: any
  for (vtkIdType cell = 0; cell < grid->GetNumberOfCells(); ++cell)
  {
    const int type = grid->GetCellType(cell);
    int& size = sizes[static_cast<unsigned char>(type)];
    if (size == 0)
    {
      const auto made = vtkSmartPointer<vtkCell>::Take(vtkGenericCell::InstantiateCell(type));
      if (!made || type == VTK_POLYHEDRON)
      {
        refuse(cell, "is not read here");
      }
      size = made->GetNumberOfPoints() > 0 ? static_cast<int>(made->GetNumberOfPoints()) : -1;
    }
    if (size > 0 && grid->GetCells()->GetCellSize(cell) != size)
    {
      refuse(cell, "has another number of corners");
    }
  }
}
}

vtkSmartPointer<vtkPolyData> ReadPolyData(const std::string& path, vtkMessageTrap& messages)
{
  vtkNew<vtkXMLPolyDataReader> reader;
  ReadXml(path, reader, "poly data", messages);
  vtkPolyData* data = reader->GetOutput();
  for (vtkCellArray* cells :
    { data->GetVerts(), data->GetLines(), data->GetPolys(), data->GetStrips() })
  {
    CheckCorners(path, cells, data->GetNumberOfPoints());
  }
  return data;
}

vtkSmartPointer<vtkUnstructuredGrid> ReadUnstructuredGrid(
  const std::string& path, vtkMessageTrap& messages)
{
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  ReadXml(path, reader, "unstructured grid", messages);
  vtkUnstructuredGrid* data = reader->GetOutput();
  CheckCorners(path, data->GetCells(), data->GetNumberOfPoints());
  CheckCellTypes(path, data);
  return data;
}

namespace
{
void WriteXml(const std::string& path, vtkXMLUnstructuredDataWriter* writer, vtkDataSet* data,
  vtkMessageTrap& messages)
{
  // Into memory first: VTK's writer does not notice when the last bytes find no room on the disk.
  writer->SetInputData(data);
  writer->WriteToOutputStringOn();
  // Not appended: with expat's reparse deferral (in Debian 12's since a security update) neither
  // VTK 9.1 nor ParaView 5.11 can read the appended data of any VTK XML file.
  writer->SetDataModeToBinary();
  writer->SetCompressionLevel(1); // 1.4 % larger than by VTK's own 5, in two thirds of the time
  const int good = writer->Write();
  messages.ThrowIfError();
  if (!good)
  {
    throw std::runtime_error("Cannot write '" + path + "'.");
  }
  WriteFileAtomically(path, writer->GetOutputString());
}
}

void WritePolyData(const std::string& path, vtkPolyData* data, vtkMessageTrap& messages)
{
  vtkNew<vtkXMLPolyDataWriter> writer;
  WriteXml(path, writer, data, messages);
}

void WriteUnstructuredGrid(
  const std::string& path, vtkUnstructuredGrid* data, vtkMessageTrap& messages)
{
  vtkNew<vtkXMLUnstructuredGridWriter> writer;
  WriteXml(path, writer, data, messages);
}
}
