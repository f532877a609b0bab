#include "vtkBiharmonicSkinWeights.h"

#include "SkinWeightCache.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkVesselTree.h"

#include "vtkCellType.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;
using coronary::SkinWeightInput;
using coronary::SkinWeights;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkBiharmonicSkinWeights);

namespace
{
void ReadMesh(vtkUnstructuredGrid* mesh, SkinWeightInput& input)
{
  input.points.resize(mesh->GetNumberOfPoints());
  for (vtkIdType i = 0; i < mesh->GetNumberOfPoints(); ++i)
  {
    mesh->GetPoint(i, input.points[i].data());
  }
  input.tetrahedra.resize(mesh->GetNumberOfCells());
  vtkNew<vtkIdList> corners;
  for (vtkIdType c = 0; c < mesh->GetNumberOfCells(); ++c)
  {
    mesh->GetCellPoints(c, corners);
    // Both: a cell that is added to cells of one type counts as that type from VTK 9.6 on, whatever its corners.
    vtkCoronary::Require(mesh->GetCellType(c) == VTK_TETRA && corners->GetNumberOfIds() == 4,
      "Cell " + std::to_string(c) + " of the mesh is no tetrahedron");
    std::copy(corners->begin(), corners->end(), input.tetrahedra[c].begin());
  }
}

/// Points at one place are one joint.
void ReadSkeleton(vtkPolyData* skeleton, SkinWeightInput& input)
{
  const coronary::Polylines lines = vtkCoronary::LinesOf(skeleton);
  std::map<std::array<double, 3>, std::int64_t> places;
  std::vector<std::int64_t> jointOf;
  for (const coronary::Vector3& point : lines.points)
  {
    const auto [found, isNew] = places.try_emplace(
      { point[0], point[1], point[2] }, static_cast<std::int64_t>(input.joints.size()));
    if (isNew)
    {
      input.joints.push_back(point);
    }
    jointOf.push_back(found->second);
  }
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    for (std::size_t i = 1; i < line.size(); ++i)
    {
      input.bones.emplace_back(jointOf[line[i - 1]], jointOf[line[i]]);
    }
  }
}

std::vector<vtkStdString> BoneNames(
  vtkPolyData* skeleton, const std::string& name, std::size_t bones)
{
  auto* given =
    vtkStringArray::SafeDownCast(skeleton->GetFieldData()->GetAbstractArray(name.c_str()));
  const bool fits = given != nullptr && given->GetNumberOfValues() == static_cast<vtkIdType>(bones);
  std::vector<vtkStdString> list;
  for (std::size_t b = 0; b < bones; ++b)
  {
    list.push_back(
      fits ? given->GetValue(static_cast<vtkIdType>(b)) : vtkStdString("bone" + std::to_string(b)));
  }
  return list;
}
}

vtkBiharmonicSkinWeights::vtkBiharmonicSkinWeights()
{
  this->SetNumberOfInputPorts(2);
}

void vtkBiharmonicSkinWeights::SetSkeletonData(vtkPolyData* skeleton)
{
  this->SetInputData(SkeletonPort, skeleton);
}

int vtkBiharmonicSkinWeights::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(),
    port == SkeletonPort ? "vtkPolyData" : "vtkUnstructuredGrid");
  return 1;
}

int vtkBiharmonicSkinWeights::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  outputs->GetInformationObject(0)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  return 1;
}

int vtkBiharmonicSkinWeights::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, this->GetNumberOfInputPorts(), outputs);
  return 1;
}

int vtkBiharmonicSkinWeights::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkUnstructuredGrid* mesh = vtkUnstructuredGrid::GetData(inputs[MeshPort], 0);
  vtkPolyData* skeleton = vtkPolyData::GetData(inputs[SkeletonPort], 0);
  vtkUnstructuredGrid* output = vtkUnstructuredGrid::GetData(outputs, 0);
  if (outputs->GetInformationObject(0)->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0)
  {
    return 1;
  }
  try
  {
    coronary::SkinWeightSettings settings;
    settings.mode = static_cast<coronary::SkinWeightMode>(this->Mode);
    settings.tolerance = this->Tolerance;
    settings.iterations = this->Iterations;
    settings.neighbourhood = this->Neighbourhood;
    settings.leaveOutside = this->LeaveOutside;
    settings.Validate();
    vtkCoronary::Require(
      this->Influences >= 1 && this->Influences <= 64, "Influences must be within 1 to 64");
    if (mesh->GetNumberOfPoints() == 0)
    {
      return 1;
    }
    SkinWeightInput input;
    ReadMesh(mesh, input);
    ReadSkeleton(skeleton, input);
    std::vector<std::string> warnings;
    const SkinWeights weights = coronary::CachedSkinWeights(
      this->CacheFolder, input, settings, vtkCoronary::ProgressOf(this), warnings);
    for (const std::string& warning : warnings)
    {
      vtkWarningMacro(<< vtkCoronary::PropertyMessage(warning));
    }
    if (!weights.converged)
    {
      vtkWarningMacro(<< "The weights did not converge in " << weights.iterations
                      << " iterations: violation " << weights.residual);
    }
    const std::vector<vtkStdString> boneNames =
      BoneNames(skeleton, names::BoneName, input.bones.size());
    std::vector<vtkStdString> leftOutNames;
    std::string listed;
    std::vector<double> partlyOutside = weights.lengthOutside;
    for (const std::int64_t bone : weights.leftOut)
    {
      leftOutNames.push_back(boneNames[bone]);
      listed += (listed.empty() ? "" : ", ") + boneNames[bone];
      partlyOutside[bone] = 0.0;
    }
    if (!leftOutNames.empty())
    {
      vtkWarningMacro(<< leftOutNames.size()
                      << " bones lie outside of the mesh and are left out: " << listed);
    }
    const auto longest = std::max_element(partlyOutside.begin(), partlyOutside.end());
    if (*longest > 0.0)
    {
      vtkWarningMacro(<< std::count_if(partlyOutside.begin(), partlyOutside.end(),
                           [](double length) { return length > 0.0; })
                      << " bones leave the mesh; " << *longest << " of bone "
                      << boneNames[longest - partlyOutside.begin()] << " are outside");
    }

    output->ShallowCopy(mesh);
    const auto points = static_cast<vtkIdType>(input.points.size());
    vtkPointData* data = output->GetPointData();
    const coronary::CompactSkinWeights compact =
      coronary::CompactWeights(weights, this->Influences);
    vtkNew<vtkIntArray> bone;
    bone->SetName(names::BoneIndices);
    bone->SetNumberOfComponents(this->Influences);
    bone->SetNumberOfTuples(points);
    vtkNew<vtkFloatArray> weight;
    weight->SetName(names::BoneWeightsCompact);
    weight->SetNumberOfComponents(this->Influences);
    weight->SetNumberOfTuples(points);
    for (std::size_t e = 0; e < compact.bone.size(); ++e)
    {
      const auto place = static_cast<vtkIdType>(e);
      bone->SetValue(place, compact.weight[e] != 0.0f ? compact.bone[e] : -1);
      weight->SetValue(place, compact.weight[e]);
    }
    data->AddArray(bone);
    data->AddArray(weight);
    vtkCoronary::AddArray<vtkFloatArray>(data, names::DroppedWeight, compact.dropped);
    if (this->Dense)
    {
      vtkNew<vtkDoubleArray> dense;
      dense->SetName(names::BoneWeights);
      dense->SetNumberOfComponents(static_cast<int>(weights.bones));
      dense->SetNumberOfTuples(points);
      dense->Fill(0.0);
      for (std::int64_t b = 0; b < weights.bones; ++b)
      {
        dense->SetComponentName(b, boneNames[b].c_str());
      }
      for (vtkIdType i = 0; i < points; ++i)
      {
        for (std::int64_t e = weights.offset[i]; e < weights.offset[i + 1]; ++e)
        {
          dense->SetTypedComponent(i, weights.bone[e], weights.weight[e]);
        }
      }
      data->AddArray(dense);
    }

    vtkFieldData* field = output->GetFieldData();
    vtkCoronary::AddArray<vtkStringArray>(field, names::BoneName, boneNames);
    vtkCoronary::AddArray<vtkIntArray>(
      field, names::WeightsConverged, std::vector<int>{ weights.converged ? 1 : 0 });
    vtkCoronary::AddArray<vtkIntArray>(
      field, names::WeightsIterations, std::vector<int>{ weights.iterations });
    const auto numbers = [field](const char* name, const std::vector<double>& values)
    { vtkCoronary::AddArray<vtkDoubleArray>(field, name, values); };
    numbers(names::WeightsResidual, { weights.residual, weights.residualEverywhere });
    numbers(names::WeightsEnergy, { weights.energy });
    numbers(names::WeightsEnergyGap, { weights.energyGap });
    numbers(names::WeightsRowSums, { weights.minimumSum, weights.maximumSum });
    numbers(names::WeightsOnBones, { weights.constraintResidual });
    numbers(names::BoneLengthOutside, weights.lengthOutside);
    if (this->LeaveOutside)
    {
      vtkCoronary::AddArray<vtkIntArray>(field, names::LeftOutBones,
        std::vector<int>(weights.leftOut.begin(), weights.leftOut.end()));
      vtkCoronary::AddArray<vtkStringArray>(field, names::LeftOutBoneNames, leftOutNames);
    }
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the skin weights");
  }
}

void vtkBiharmonicSkinWeights::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Mode: " << this->Mode << "\n";
  os << indent << "Tolerance: " << this->Tolerance << "\n";
  os << indent << "Iterations: " << this->Iterations << "\n";
  os << indent << "Neighbourhood: " << this->Neighbourhood << "\n";
  os << indent << "LeaveOutside: " << this->LeaveOutside << "\n";
  os << indent << "Influences: " << this->Influences << "\n";
  os << indent << "Dense: " << this->Dense << "\n";
  os << indent << "CacheFolder: " << this->CacheFolder << "\n";
}
