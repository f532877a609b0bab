/**
 * @file SharedSurface.h
 * @brief Surfaces of the shared data, for the tests.
 */
#ifndef DynamicCoronary_SharedSurface_h
#define DynamicCoronary_SharedSurface_h

#include "XmlDataFile.h"

#include "vtkCellArray.h"
#include "vtkNew.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkXMLPolyDataReader.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

/// A binary .stl, with equal points merged.
inline vtkSmartPointer<vtkPolyData> FromStl(const std::string& bytes)
{
  constexpr std::size_t header = 84;
  constexpr std::size_t facet = 50;
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  std::map<std::array<float, 3>, vtkIdType> known;
  for (std::size_t at = header; at + facet <= bytes.size(); at += facet)
  {
    cells->InsertNextCell(3);
    for (std::size_t corner = 1; corner < 4; ++corner)
    {
      std::array<float, 3> p{};
      std::memcpy(p.data(), bytes.data() + at + corner * sizeof p, sizeof p);
      const auto [place, isNew] = known.try_emplace(p, points->GetNumberOfPoints());
      if (isNew)
      {
        points->InsertNextPoint(p.data());
      }
      cells->InsertCellPoint(place->second);
    }
  }
  surface->SetPoints(points);
  surface->SetPolys(cells);
  return surface;
}

/// A .vtp or .stl; null when it is not there.
inline vtkSmartPointer<vtkPolyData> ReadSurface(const std::string& name)
{
  std::ifstream file(name, std::ios::binary);
  if (!file)
  {
    return nullptr;
  }
  const std::string text(std::istreambuf_iterator<char>(file), {});
  if (name.size() > 4 && name.compare(name.size() - 4, 4, ".stl") == 0)
  {
    return FromStl(text);
  }
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->ReadFromInputStringOn();
  reader->SetInputString(coronary::ReadableXmlData(text, name));
  reader->Update();
  return reader->GetOutput();
}

/// A surface of the shared data; null when it is not there.
inline vtkSmartPointer<vtkPolyData> ReadSharedSurface(const std::string& name)
{
  return ReadSurface(std::string(DYNAMICCORONARY_DATA_DIR) + "/" + name);
}

#endif
