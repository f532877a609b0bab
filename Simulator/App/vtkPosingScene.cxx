#include "vtkPosingScene.h"

#include "vtkPosingModel.h"

#include "vtkActor.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDecimatePro.h"
#include "vtkFloatArray.h"
#include "vtkGlyph3DMapper.h"
#include "vtkIdTypeArray.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper.h"
#include "vtkProperty.h"
#include "vtkRenderer.h"
#include "vtkSphereSource.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace coronary
{
namespace
{
constexpr double JointRadius = 0.8; // mm

/// Means of the triangles around, weighted by their areas.
void FindNormals(vtkPolyData* surface, vtkFloatArray* normals)
{
  normals->Fill(0.0);
  auto* points = vtkFloatArray::SafeDownCast(surface->GetPoints()->GetData());
  const auto at = [](vtkFloatArray* array, vtkIdType n)
  { return Eigen::Map<Eigen::Vector3f>(array->GetPointer(3 * n)); };
  for (vtkIdType cell = 0; cell < surface->GetNumberOfPolys(); ++cell)
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    surface->GetPolys()->GetCellAtId(cell, count, ids);
    const Eigen::Vector3f normal =
      (at(points, ids[1]) - at(points, ids[0])).cross(at(points, ids[2]) - at(points, ids[0]));
    for (vtkIdType corner = 0; corner < count; ++corner)
    {
      at(normals, ids[corner]) += normal;
    }
  }
  for (vtkIdType n = 0; n < normals->GetNumberOfTuples(); ++n)
  {
    at(normals, n).normalize();
  }
  normals->Modified();
}
}

vtkPosingScene::vtkPosingScene(const vtkPosingModel& model, std::int64_t triangles)
  : Model(model)
{
  this->Renderer_->SetBackground(1.0, 1.0, 1.0);
  this->MakeVessels(triangles);
  this->MakeSkeleton();
  this->Update();
  this->LookFromFront();
}

vtkPosingScene::~vtkPosingScene() = default;

void vtkPosingScene::MakeVessels(std::int64_t triangles)
{
  vtkNew<vtkPolyData> whole;
  whole->SetPoints(this->Model.BoundaryAtRest()->GetPoints());
  whole->SetPolys(this->Model.BoundaryAtRest()->GetPolys());
  vtkNew<vtkIdTypeArray> origin;
  origin->SetName("Origin");
  origin->SetNumberOfValues(whole->GetNumberOfPoints());
  std::iota(origin->Begin(), origin->End(), 0);
  whole->GetPointData()->AddArray(origin);
  // It takes points away and moves none, so that those that stay are known in every pose.
  vtkNew<vtkDecimatePro> fewer;
  fewer->SetInputData(whole);
  const double share =
    static_cast<double>(triangles) / static_cast<double>(whole->GetNumberOfPolys());
  fewer->SetTargetReduction(std::clamp(1.0 - share, 0.0, 0.999));
  fewer->PreserveTopologyOn();
  fewer->SplittingOff();
  fewer->BoundaryVertexDeletionOff();
  fewer->Update();
  vtkPolyData* drawn = fewer->GetOutput();
  auto* kept = vtkIdTypeArray::SafeDownCast(drawn->GetPointData()->GetArray("Origin"));
  this->Drawn.assign(kept->Begin(), kept->End());
  this->Vessels->SetPolys(drawn->GetPolys());
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(drawn->GetNumberOfPoints());
  this->Vessels->SetPoints(points);
  this->Normals->SetNumberOfComponents(3);
  this->Normals->SetNumberOfTuples(drawn->GetNumberOfPoints());
  this->Vessels->GetPointData()->SetNormals(this->Normals);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(this->Vessels);
  mapper->ScalarVisibilityOff();
  this->VesselActor->SetMapper(mapper);
  vtkProperty* look = this->VesselActor->GetProperty();
  look->SetColor(0.86, 0.66, 0.55);
  look->SetOpacity(0.55);
  look->SetSpecular(0.2);
  look->SetSpecularPower(30.0);
  look->BackfaceCullingOn(); // half of what is translucent, and quicker
  this->Renderer_->AddActor(this->VesselActor);
}

void vtkPosingScene::MakeSkeleton()
{
  this->Skeleton->SetLines(this->Model.Pose()->GetLines());
  vtkNew<vtkPolyDataMapper> lines;
  lines->SetInputData(this->Skeleton);
  lines->ScalarVisibilityOff();
  vtkNew<vtkActor> bones;
  bones->SetMapper(lines);
  bones->GetProperty()->SetColor(0.1, 0.1, 0.35);
  bones->GetProperty()->SetLineWidth(2.0F);
  bones->GetProperty()->LightingOff();
  this->Renderer_->AddActor(bones);
  vtkNew<vtkSphereSource> sphere;
  sphere->SetRadius(JointRadius);
  vtkNew<vtkGlyph3DMapper> balls;
  balls->SetInputData(this->Skeleton);
  balls->SetSourceConnection(sphere->GetOutputPort());
  balls->ScalingOff();
  balls->OrientOff();
  balls->ScalarVisibilityOff();
  vtkNew<vtkActor> joints;
  joints->SetMapper(balls);
  joints->GetProperty()->SetColor(0.9, 0.05, 0.05);
  this->Renderer_->AddActor(joints);
  vtkNew<vtkSphereSource> large;
  large->SetRadius(1.7 * JointRadius);
  large->SetThetaResolution(20);
  large->SetPhiResolution(20);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(large->GetOutputPort());
  this->ChosenActor->SetMapper(mapper);
  this->ChosenActor->GetProperty()->SetColor(1.0, 0.85, 0.0);
  this->Renderer_->AddActor(this->ChosenActor);
}

std::int64_t vtkPosingScene::NumberOfTriangles() const
{
  return this->Vessels->GetNumberOfPolys();
}

void vtkPosingScene::Update()
{
  vtkPoints* skin = this->Model.Skin()->GetPoints();
  vtkPoints* points = this->Vessels->GetPoints();
  for (std::size_t n = 0; n < this->Drawn.size(); ++n)
  {
    double place[3];
    skin->GetPoint(this->Drawn[n], place);
    points->SetPoint(static_cast<vtkIdType>(n), place);
  }
  points->Modified();
  FindNormals(this->Vessels, this->Normals);
  this->Vessels->Modified();
  this->Skeleton->SetPoints(this->Model.Pose()->GetPoints());
  const Vector3 chosen = this->Model.Joint(this->Model.Chosen());
  this->ChosenActor->SetPosition(chosen.x(), chosen.y(), chosen.z());
  this->Renderer_->ResetCameraClippingRange();
}

double vtkPosingScene::Opacity() const
{
  return this->VesselActor->GetProperty()->GetOpacity();
}

void vtkPosingScene::SetOpacity(double opacity)
{
  this->VesselActor->GetProperty()->SetOpacity(std::clamp(opacity, 0.0, 1.0));
}

void vtkPosingScene::LookFromFront()
{
  // LPS: from the front and a little from the left, the head up.
  vtkCamera* camera = this->Renderer_->GetActiveCamera();
  camera->SetFocalPoint(0.0, 0.0, 0.0);
  camera->SetPosition(0.4, -1.0, 0.1);
  camera->SetViewUp(0.0, 0.0, 1.0);
  this->Renderer_->ResetCamera();
  camera->Zoom(1.4);
  this->Renderer_->ResetCameraClippingRange();
}

Vector3 vtkPosingScene::InPicture(const Vector3& place) const
{
  this->Renderer_->SetWorldPoint(place.x(), place.y(), place.z(), 1.0);
  this->Renderer_->WorldToDisplay();
  return Vector3(this->Renderer_->GetDisplayPoint());
}

std::int64_t vtkPosingScene::JointAt(double x, double y, double radius) const
{
  std::int64_t found = -1;
  double depth = std::numeric_limits<double>::max();
  for (std::int64_t joint = 0; joint < this->Model.NumberOfJoints(); ++joint)
  {
    const Vector3 at = this->InPicture(this->Model.Joint(joint));
    if (std::hypot(at.x() - x, at.y() - y) <= radius && at.z() < depth)
    {
      found = joint;
      depth = at.z();
    }
  }
  return found;
}

Vector3 vtkPosingScene::PlaceAt(double x, double y, const Vector3& depthOf) const
{
  this->Renderer_->SetDisplayPoint(x, y, this->InPicture(depthOf).z());
  this->Renderer_->DisplayToWorld();
  const double* world = this->Renderer_->GetWorldPoint();
  return Vector3(world[0], world[1], world[2]) / world[3];
}
}
