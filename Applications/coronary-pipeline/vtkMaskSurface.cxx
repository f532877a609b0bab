#include "vtkMaskSurface.h"

#include "Interruption.h"

#include "vtkCellArray.h"
#include "vtkFlyingEdges3D.h"
#include "vtkIdList.h"
#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkWindowedSincPolyDataFilter.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace coronary
{
namespace
{
/// Passes waves of more than about eight voxels: the steps of a mask are shorter.
constexpr double PassBand = 0.1;
constexpr int Iterations = 25;

/// The box of the set voxels with one of background around it, as an image in indices.
vtkSmartPointer<vtkImageData> Padded(const SegmentationMask& mask)
{
  const std::array<int, 6>& e = mask.grid.extent;
  const std::array<std::size_t, 2> size{ static_cast<std::size_t>(e[1] + 1),
    static_cast<std::size_t>(e[3] + 1) };
  std::array<int, 6> box{ e[1], e[0], e[3], e[2], e[5], e[4] };
  std::size_t voxel = 0;
  for (int k = 0; k <= e[5]; ++k)
  {
    for (int j = 0; j <= e[3]; ++j)
    {
      for (int i = 0; i <= e[1]; ++i, ++voxel)
      {
        if (mask.voxels[voxel] != 0)
        {
          box = { std::min(box[0], i), std::max(box[1], i), std::min(box[2], j),
            std::max(box[3], j), std::min(box[4], k), std::max(box[5], k) };
        }
      }
    }
  }
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetExtent(box[0] - 1, box[1] + 1, box[2] - 1, box[3] + 1, box[4] - 1, box[5] + 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  auto* values = static_cast<unsigned char*>(image->GetScalarPointer());
  std::fill_n(values, image->GetNumberOfPoints(), static_cast<unsigned char>(0));
  for (int k = box[4]; k <= box[5]; ++k)
  {
    for (int j = box[2]; j <= box[3]; ++j)
    {
      const std::size_t row =
        (static_cast<std::size_t>(k) * size[1] + static_cast<std::size_t>(j)) * size[0];
      std::copy_n(mask.voxels.data() + row + static_cast<std::size_t>(box[0]), box[1] - box[0] + 1,
        static_cast<unsigned char*>(image->GetScalarPointer(box[0], j, k)));
    }
  }
  return image;
}

void KeepNear(vtkPoints* points, vtkPoints* before, double distance)
{
  for (vtkIdType n = 0; n < points->GetNumberOfPoints(); ++n)
  {
    Vector3 now;
    Vector3 then;
    points->GetPoint(n, now.data());
    before->GetPoint(n, then.data());
    const double moved = (now - then).norm();
    if (moved > distance)
    {
      const Vector3 limited = then + (now - then) * (distance / moved);
      points->SetPoint(n, limited.data());
    }
  }
}

double SignedVolume(vtkPolyData* surface)
{
  double volume = 0.0;
  vtkNew<vtkIdList> ids;
  vtkCellArray* polys = surface->GetPolys();
  for (vtkIdType cell = 0; cell < polys->GetNumberOfCells(); ++cell)
  {
    polys->GetCellAtId(cell, ids);
    std::array<Vector3, 3> corner;
    for (vtkIdType n = 0; n < 3; ++n)
    {
      surface->GetPoint(ids->GetId(n), corner[static_cast<std::size_t>(n)].data());
    }
    volume += corner[0].dot(corner[1].cross(corner[2])) / 6.0;
  }
  return volume;
}

void TurnOver(vtkPolyData* surface)
{
  vtkCellArray* polys = surface->GetPolys();
  for (vtkIdType cell = 0; cell < polys->GetNumberOfCells(); ++cell)
  {
    polys->ReverseCellAtId(cell);
  }
}
}

vtkSmartPointer<vtkPolyData> SurfaceOfMask(const SegmentationMask& mask)
{
  vtkNew<vtkFlyingEdges3D> contour;
  contour->SetInputData(Padded(mask));
  contour->SetValue(0, 0.5);
  contour->ComputeNormalsOff();
  contour->ComputeGradientsOff();
  contour->ComputeScalarsOff();
  contour->Update();
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  surface->SetPolys(contour->GetOutput()->GetPolys());
  // In double precision from here on, and in the world.
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkPoints* indices = contour->GetOutput()->GetPoints();
  for (vtkIdType n = 0; n < indices->GetNumberOfPoints(); ++n)
  {
    double index[3];
    indices->GetPoint(n, index);
    points->InsertNextPoint(mask.grid.IndexToWorld(index[0], index[1], index[2]).data());
  }
  surface->SetPoints(points);

  vtkNew<vtkWindowedSincPolyDataFilter> smoothing;
  smoothing->SetInputData(surface);
  smoothing->SetNumberOfIterations(Iterations);
  smoothing->SetPassBand(PassBand);
  smoothing->BoundarySmoothingOff();
  smoothing->FeatureEdgeSmoothingOff();
  smoothing->NonManifoldSmoothingOn();
  smoothing->NormalizeCoordinatesOn();
  smoothing->Update();
  auto smooth = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> moved;
  moved->SetDataTypeToDouble();
  moved->DeepCopy(smoothing->GetOutput()->GetPoints());
  KeepNear(moved, points, 0.5 * mask.grid.spacing.minCoeff());
  smooth->SetPoints(moved);
  smooth->SetPolys(smoothing->GetOutput()->GetPolys());
  if (SignedVolume(smooth) < 0.0)
  {
    TurnOver(smooth);
  }
  return smooth;
}

vtkSmartPointer<vtkPolyData> ReadMaskSurface(
  const std::string& path, const std::vector<std::string>& segments)
{
  return SurfaceOfMask(
    SegmentationFile(path).Mask(segments, [](double) { return Interruption() == 0; }));
}
}
