#include "vtkDataFiles.h"

#include "AppendedXmlData.h"
#include "AtomicFile.h"
#include "vtkMessageTrap.h"

#include "vtkNew.h"
#include "vtkPolyData.h"
#include "vtkUnstructuredGrid.h"
#include "vtkXMLDataReader.h"
#include "vtkXMLPolyDataReader.h"
#include "vtkXMLPolyDataWriter.h"
#include "vtkXMLUnstructuredDataWriter.h"
#include "vtkXMLUnstructuredGridReader.h"
#include "vtkXMLUnstructuredGridWriter.h"

#include <fstream>
#include <iterator>
#include <stdexcept>

namespace coronary
{
namespace
{
void ReadXml(
  const std::string& path, vtkXMLDataReader* reader, const char* what, vtkMessageTrap& messages)
{
  std::ifstream file(path, std::ios::binary);
  if (!file)
  {
    throw std::runtime_error("Cannot open '" + path + "'.");
  }
  if (!reader->CanReadFile(path.c_str()))
  {
    throw std::runtime_error("'" + path + "' is not a VTK XML " + what + " file.");
  }
  const std::string text(std::istreambuf_iterator<char>(file), {});
  reader->ReadFromInputStringOn();
  reader->SetInputString(WithInlineXmlData(text));
  reader->Update();
  try
  {
    messages.ThrowIfError();
  }
  catch (const std::exception& error)
  {
    throw std::runtime_error("Cannot read '" + path + "': " + error.what());
  }
}
}

bool EndsWith(const std::string& path, const std::string& end)
{
  return path.size() >= end.size() &&
    path.compare(path.size() - end.size(), std::string::npos, end) == 0;
}

vtkSmartPointer<vtkPolyData> ReadPolyData(const std::string& path, vtkMessageTrap& messages)
{
  vtkNew<vtkXMLPolyDataReader> reader;
  ReadXml(path, reader, "poly data", messages);
  return reader->GetOutput();
}

vtkSmartPointer<vtkUnstructuredGrid> ReadUnstructuredGrid(
  const std::string& path, vtkMessageTrap& messages)
{
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  ReadXml(path, reader, "unstructured grid", messages);
  return reader->GetOutput();
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
