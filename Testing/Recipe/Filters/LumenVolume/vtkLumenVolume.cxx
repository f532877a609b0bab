#include "vtkLumenVolume.h"

#include "LumenVolume.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <vector>

namespace names = vtkCoronaryArrayNames;

vtkStandardNewMacro(vtkLumenVolume);

vtkLumenVolume::vtkLumenVolume()
  : RadiusArrayName(names::Radius)
{
}

int vtkLumenVolume::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkPolyData* input = vtkPolyData::GetData(inputs[0]);
  vtkPolyData* output = vtkPolyData::GetData(outputs);
  output->ShallowCopy(input);
  if (input->GetNumberOfPoints() == 0)
  {
    return 1;
  }
  try
  {
    vtkDataArray* radius = input->GetPointData()->GetArray(this->RadiusArrayName.c_str());
    vtkCoronary::Require(radius != nullptr && radius->GetNumberOfComponents() == 1,
      "RadiusArrayName: there is no point array '" + this->RadiusArrayName + "' of one component");
    vtkCoronary::Require(
      input->GetNumberOfCells() == input->GetNumberOfLines(), "The input must have lines only");
    std::vector<double> volumes;
    vtkNew<vtkIdList> ids;
    for (vtkIdType line = 0; line < input->GetNumberOfLines(); ++line)
    {
      input->GetLines()->GetCellAtId(line, ids);
      std::vector<coronary::Vector3> points;
      std::vector<double> radii;
      for (const vtkIdType id : *ids)
      {
        coronary::Vector3 point;
        input->GetPoint(id, point.data());
        points.push_back(point);
        radii.push_back(radius->GetTuple1(id));
      }
      volumes.push_back(coronary::LumenVolume(points, radii));
    }
    vtkCoronary::AddArray<vtkDoubleArray>(output->GetCellData(), "LumenVolume", volumes);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the volumes", { "LumenVolume: " });
  }
}

void vtkLumenVolume::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "RadiusArrayName: " << this->RadiusArrayName << "\n";
}
