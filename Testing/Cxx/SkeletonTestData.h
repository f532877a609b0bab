/**
 * @file SkeletonTestData.h
 * @brief Skeletons and meshes that hang on them as VTK data, for the tests of posing and deformation.
 */
#ifndef DynamicCoronary_SkeletonTestData_h
#define DynamicCoronary_SkeletonTestData_h

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMath.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

/// A chain of bones of 5 mm along z.
inline vtkSmartPointer<vtkPolyData> ChainSkeleton(int bones)
{
  auto chain = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkIntArray> ids;
  ids->SetName("BoneId");
  for (vtkIdType j = 0; j <= bones; ++j)
  {
    points->InsertNextPoint(0.0, 0.0, 5.0 * static_cast<double>(j));
    if (j > 0)
    {
      const vtkIdType ends[2] = { j - 1, j };
      lines->InsertNextCell(2, ends);
      ids->InsertNextValue(static_cast<int>(j) - 1);
    }
  }
  chain->SetPoints(points);
  chain->SetLines(lines);
  chain->GetCellData()->AddArray(ids);
  return chain;
}

/// Gives every point the bone of the chain beside it, and the next one where it is near to a joint.
inline void HangOnChain(vtkPointSet* mesh, int bones)
{
  vtkNew<vtkIntArray> indices;
  indices->SetName("BoneIndices");
  indices->SetNumberOfComponents(2);
  vtkNew<vtkFloatArray> weights;
  weights->SetName("BoneWeightsCompact");
  weights->SetNumberOfComponents(2);
  for (vtkIdType n = 0; n < mesh->GetNumberOfPoints(); ++n)
  {
    const double at = mesh->GetPoint(n)[2] / 5.0;
    const int bone = std::clamp(static_cast<int>(std::floor(at)), 0, bones - 1);
    const int other = at - bone < 0.5 ? bone - 1 : bone + 1;
    const bool exists = other >= 0 && other < bones;
    const double share = exists ? std::abs(at - bone - 0.5) : 0.0;
    indices->InsertNextTuple2(bone, exists ? other : -1);
    weights->InsertNextTuple2(1.0 - share, share);
  }
  mesh->GetPointData()->AddArray(indices);
  mesh->GetPointData()->AddArray(weights);
}

/// A tube of triangles around the chain, with normals, weights and an array of its own.
inline vtkSmartPointer<vtkPolyData> ChainTube(int bones, double radius)
{
  auto tube = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> polys;
  vtkNew<vtkFloatArray> normals;
  normals->SetName("Normals");
  normals->SetNumberOfComponents(3);
  vtkNew<vtkIntArray> rings;
  rings->SetName("Ring");
  const int around = 16;
  const int along = 10 * bones;
  for (int k = 0; k <= along; ++k)
  {
    for (int n = 0; n < around; ++n)
    {
      const double angle = 2.0 * 3.14159265358979 * n / around;
      points->InsertNextPoint(radius * std::cos(angle), radius * std::sin(angle), 0.5 * k);
      normals->InsertNextTuple3(std::cos(angle), std::sin(angle), 0.0);
      rings->InsertNextValue(k);
      if (k > 0)
      {
        const vtkIdType a = (k - 1) * around + n;
        const vtkIdType b = (k - 1) * around + (n + 1) % around;
        const vtkIdType lower[3] = { a, b, b + around };
        const vtkIdType upper[3] = { a, b + around, a + around };
        polys->InsertNextCell(3, lower);
        polys->InsertNextCell(3, upper);
      }
    }
  }
  tube->SetPoints(points);
  tube->SetPolys(polys);
  tube->GetPointData()->SetNormals(normals);
  tube->GetPointData()->AddArray(rings);
  HangOnChain(tube, bones);
  return tube;
}

/// The chain bent to a circle's arc: curvature = 0.1 t per mm at time t, or 0.1 + 0.03 sin(2 pi t) when it beats.
/// Steps 0, 0.1 .. 1, of which it gives the nearest one when it snaps, and its first or last beyond them when it ends.
class BendingChain : public vtkPolyDataAlgorithm
{
public:
  static BendingChain* New() { VTK_STANDARD_NEW_BODY(BendingChain); }
  vtkTypeMacro(BendingChain, vtkPolyDataAlgorithm);

  int Bones = 4;
  bool HasSteps = true;
  bool Snaps = false;
  bool Ends = false;
  bool Beats = false;
  bool CallsItByTheTimeAskedFor = false;
  int Executions = 0;

  static double Curvature(double time, bool beats)
  {
    return beats ? 0.1 + 0.03 * std::sin(2.0 * vtkMath::Pi() * time) : 0.1 * time;
  }

  /// The place z of the axis, and its derivative by time.
  static std::array<double, 3> Bent(double z, double time, bool beats = false)
  {
    const double curvature = Curvature(time, beats);
    if (curvature == 0.0)
    {
      return { 0.0, 0.0, z };
    }
    return { (1.0 - std::cos(curvature * z)) / curvature, 0.0,
      std::sin(curvature * z) / curvature };
  }
  static std::array<double, 3> Speed(double z, double time, bool beats = false)
  {
    const double k = Curvature(time, beats);
    const double rate = beats ? 0.06 * vtkMath::Pi() * std::cos(2.0 * vtkMath::Pi() * time) : 0.1;
    // At k = 0 by the series.
    return k == 0.0
      ? std::array<double, 3>{ 0.5 * z * z * rate, 0.0, 0.0 }
      : std::array<double, 3>{ rate * (k * z * std::sin(k * z) - 1.0 + std::cos(k * z)) / (k * k),
          0.0, rate * (k * z * std::cos(k * z) - std::sin(k * z)) / (k * k) };
  }

protected:
  BendingChain() { this->SetNumberOfInputPorts(0); }

  int RequestInformation(
    vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    vtkInformation* info = outputs->GetInformationObject(0);
    const double range[2] = { 0.0, 1.0 };
    info->Set(vtkStreamingDemandDrivenPipeline::TIME_RANGE(), range, 2);
    if (this->HasSteps)
    {
      std::vector<double> steps;
      for (int n = 0; n <= 10; ++n)
      {
        steps.push_back(0.1 * n);
      }
      info->Set(vtkStreamingDemandDrivenPipeline::TIME_STEPS(), steps.data(), 11);
    }
    return 1;
  }

  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs) override
  {
    ++this->Executions;
    vtkInformation* info = outputs->GetInformationObject(0);
    vtkPolyData* output = vtkPolyData::GetData(info);
    const double asked = info->Has(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())
      ? info->Get(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP())
      : 0.0;
    const double within = this->Ends ? std::min(1.0, std::max(0.0, asked)) : asked;
    const double time = this->Snaps ? 0.1 * std::round(10.0 * within) : within;
    output->ShallowCopy(ChainSkeleton(this->Bones));
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    for (int j = 0; j <= this->Bones; ++j)
    {
      points->InsertNextPoint(Bent(5.0 * j, time, this->Beats).data());
    }
    output->SetPoints(points);
    vtkNew<vtkDoubleArray> cycle;
    cycle->SetName("CycleLength");
    cycle->InsertNextValue(0.8);
    output->GetFieldData()->AddArray(cycle);
    output->GetInformation()->Set(
      vtkDataObject::DATA_TIME_STEP(), this->CallsItByTheTimeAskedFor ? asked : time);
    return 1;
  }
};

#endif
