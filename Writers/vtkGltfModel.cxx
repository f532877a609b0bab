#include "vtkGltfModel.h"

#include "vtkBoneMotion.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"

#include <stdexcept>
#include <string>

namespace names = vtkCoronaryArrayNames;
using coronary::Vector3;
using vtkCoronary::Require;

namespace
{
vtkDataArray* Needed(vtkPointSet* mesh, const char* name)
{
  vtkDataArray* array = mesh->GetPointData()->GetArray(name);
  Require(array != nullptr,
    std::string("glTF needs the point array ") + name +
      " of the mesh: it is for what comes from Skin Deformation, with the weights of the bones");
  return array;
}

std::vector<Vector3> PositionsOf(vtkPointSet* mesh, const std::vector<vtkIdType>& points)
{
  std::vector<Vector3> positions(points.size());
  for (std::size_t n = 0; n < points.size(); ++n)
  {
    mesh->GetPoint(points[n], positions[n].data());
  }
  return positions;
}

coronary::CompactSkinWeights WeightsOf(vtkPointSet* mesh, const std::vector<vtkIdType>& points)
{
  vtkDataArray* indices = Needed(mesh, names::BoneIndices);
  vtkDataArray* values = Needed(mesh, names::BoneWeightsCompact);
  coronary::CompactSkinWeights weights;
  weights.influences = indices->GetNumberOfComponents();
  Require(values->GetNumberOfComponents() == weights.influences,
    std::string("Arrays ") + names::BoneIndices + " and " + names::BoneWeightsCompact +
      " have different numbers of components");
  for (const vtkIdType point : points)
  {
    for (int k = 0; k < weights.influences; ++k)
    {
      const double bone = indices->GetComponent(point, k);
      weights.bone.push_back(bone < 0.0 ? 0 : static_cast<std::int32_t>(bone));
      weights.weight.push_back(
        bone < 0.0 ? 0.0F : static_cast<float>(values->GetComponent(point, k)));
    }
  }
  return weights;
}
}

vtkGltfModel::vtkGltfModel(vtkPointSet* mesh, std::vector<vtkIdType> points, int influences)
  : Points(std::move(points))
{
  vtkDataArray* displacement = Needed(mesh, names::Displacement);
  Require(displacement->GetNumberOfComponents() == 3,
    std::string("Array ") + names::Displacement + " of the mesh has not three components");
  this->Model.points = PositionsOf(mesh, this->Points);
  for (std::size_t n = 0; n < this->Points.size(); ++n)
  {
    double moved[3];
    displacement->GetTuple(this->Points[n], moved);
    this->Model.points[n] -= Vector3(moved[0], moved[1], moved[2]);
  }
  this->Model.weights = WeightsOf(mesh, this->Points);
  this->Model.bones = vtkBoneMotion::BonesOf(mesh->GetFieldData());
  vtkDataArray* cycle = mesh->GetFieldData()->GetArray(names::CycleLength);
  this->Model.cycleLengthKnown = cycle != nullptr && cycle->GetNumberOfTuples() > 0;
  if (this->Model.cycleLengthKnown)
  {
    this->Model.cycleLength = cycle->GetComponent(0, 0);
  }
  this->Skin = std::make_unique<coronary::GltfSkin>(this->Model, influences);
}

void vtkGltfModel::AddPhase(vtkPointSet* mesh, double time)
{
  coronary::GltfKey key;
  key.phase = time;
  key.motion = vtkBoneMotion::MotionOf(mesh->GetFieldData());
  key.maximumDeviation = this->Skin->Deviation(key.motion, PositionsOf(mesh, this->Points));
  this->Model.keys.push_back(std::move(key));
}
