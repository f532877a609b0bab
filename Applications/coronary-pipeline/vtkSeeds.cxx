#include "vtkSeeds.h"

#include "vtkCoronaryArrayNames.h"

#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkStringArray.h"

namespace coronary
{
vtkSmartPointer<vtkPolyData> MakeSeeds(
  const std::vector<Vector3>& positions, double confidence, const std::vector<std::string>& names)
{
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> vertices;
  vtkNew<vtkStringArray> labels;
  labels->SetName(vtkCoronaryArrayNames::Name);
  vtkNew<vtkDoubleArray> confidences;
  confidences->SetName(vtkCoronaryArrayNames::Confidence);
  for (std::size_t n = 0; n < positions.size(); ++n)
  {
    const vtkIdType id = points->InsertNextPoint(positions[n].data());
    vertices->InsertNextCell(1, &id);
    const bool named = n < names.size() && !names[n].empty();
    labels->InsertNextValue(named ? names[n] : std::to_string(id));
    confidences->InsertNextValue(confidence);
  }
  auto seeds = vtkSmartPointer<vtkPolyData>::New();
  seeds->SetPoints(points);
  seeds->SetVerts(vertices);
  seeds->GetPointData()->AddArray(labels);
  seeds->GetPointData()->AddArray(confidences);
  return seeds;
}
}
