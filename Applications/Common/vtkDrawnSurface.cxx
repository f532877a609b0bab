#include "vtkDrawnSurface.h"

#include "vtkDecimatePro.h"
#include "vtkIdTypeArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"

#include <algorithm>
#include <numeric>

namespace coronary
{
namespace
{
constexpr double FeatureAngle = 60.0; // degrees: thin vessels have few triangles around
}

DrawnSurface MakeDrawnSurface(vtkPolyData* whole, std::int64_t triangles)
{
  vtkNew<vtkPolyData> bare;
  bare->SetPoints(whole->GetPoints());
  bare->SetPolys(whole->GetPolys());
  vtkNew<vtkIdTypeArray> origin;
  origin->SetName("Origin");
  origin->SetNumberOfValues(bare->GetNumberOfPoints());
  std::iota(origin->Begin(), origin->End(), 0);
  bare->GetPointData()->AddArray(origin);
  vtkNew<vtkDecimatePro> fewer;
  fewer->SetInputData(bare);
  const double share = static_cast<double>(triangles) /
    static_cast<double>(std::max<vtkIdType>(1, bare->GetNumberOfPolys()));
  fewer->SetTargetReduction(std::clamp(1.0 - share, 0.0, 0.999));
  fewer->PreserveTopologyOn();
  fewer->SplittingOff();
  fewer->BoundaryVertexDeletionOff();
  fewer->SetFeatureAngle(FeatureAngle);
  fewer->Update();
  DrawnSurface drawn;
  auto* kept = vtkIdTypeArray::SafeDownCast(fewer->GetOutput()->GetPointData()->GetArray("Origin"));
  drawn.origin.assign(kept->Begin(), kept->End());
  drawn.data = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->DeepCopy(fewer->GetOutput()->GetPoints());
  drawn.data->SetPoints(points);
  drawn.data->SetPolys(fewer->GetOutput()->GetPolys());
  return drawn;
}
}
