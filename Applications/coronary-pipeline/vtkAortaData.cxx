#include "vtkAortaData.h"

#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkUnsignedCharArray.h"

#include <array>
#include <cstdio>

namespace names = vtkCoronaryArrayNames;

namespace coronary
{
namespace
{
vtkSmartPointer<vtkPolyData> AortaPoints(const AorticModel& aorta,
  const std::vector<Vector3>& points, const std::vector<unsigned char>& measured,
  const std::string& words)
{
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> places;
  places->SetDataTypeToDouble();
  for (const Vector3& p : points)
  {
    places->InsertNextPoint(p.data());
  }
  data->SetPoints(places);
  vtkCoronary::AddArray<vtkUnsignedCharArray>(data->GetPointData(), names::Measured, measured);
  vtkCoronary::AddArray<vtkStringArray>(
    data->GetFieldData(), names::AortaSource, std::vector<std::string>{ words });
  vtkCoronary::AddArray<vtkDoubleArray>(data->GetFieldData(), names::AortaLengths,
    std::vector<double>{ aorta.measuredLength, aorta.ascending, aorta.arch, aorta.descending });
  return data;
}
}

std::string DescribeAorta(const AorticModel& aorta, const std::string& ending)
{
  std::array<char, 500> text{};
  std::snprintf(text.data(), text.size(),
    "measured: %.0f mm from the valve to %s, ascending diameter %.1f mm; completed: %.0f mm of "
    "ascending aorta, %.0f mm of arch and %.0f mm of descending aorta to the diaphragm, with the "
    "mean diameters of Hager 2002 scaled to that one, %s",
    aorta.measuredLength, ending.c_str(), 2.0 * aorta.ascendingRadius, aorta.ascending, aorta.arch,
    aorta.descending,
    aorta.towardsSeen ? "to where the image shows the descending aorta" : "on a usual course");
  return text.data();
}

vtkSmartPointer<vtkPolyData> AorticSurface(const AorticModel& aorta, const std::string& words)
{
  auto data = AortaPoints(aorta, aorta.points, aorta.measured, words);
  vtkNew<vtkCellArray> triangles;
  for (const Triangle& triangle : aorta.triangles)
  {
    const std::array<vtkIdType, 3> ids{ triangle[0], triangle[1], triangle[2] };
    triangles->InsertNextCell(3, ids.data());
  }
  data->SetPolys(triangles);
  return data;
}

vtkSmartPointer<vtkPolyData> AorticCenterline(const AorticModel& aorta, const std::string& words)
{
  auto data = AortaPoints(aorta, aorta.axis, aorta.axisMeasured, words);
  vtkNew<vtkCellArray> lines;
  lines->InsertNextCell(static_cast<int>(aorta.axis.size()));
  for (std::size_t n = 0; n < aorta.axis.size(); ++n)
  {
    lines->InsertCellPoint(static_cast<vtkIdType>(n));
  }
  data->SetLines(lines);
  vtkCoronary::AddArray<vtkDoubleArray>(data->GetPointData(), names::Radius, aorta.radius);
  return data;
}
}
