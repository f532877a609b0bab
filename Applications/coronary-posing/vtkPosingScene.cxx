#include "vtkPosingScene.h"

#include "vtkDrawnSurface.h"
#include "vtkPosingModel.h"

#include "vtkActor.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkFloatArray.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper.h"
#include "vtkProperty.h"
#include "vtkRenderer.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr float JointSize = 9.0F; // pixels
constexpr float ChosenSize = 16.0F;

/// Means of the triangles around, weighted by their areas.
void FindNormals(
  const std::vector<Triangle>& triangles, const vtkFloatArray* points, vtkFloatArray* normals)
{
  using Places = Eigen::Map<const Eigen::Matrix3Xf>;
  const vtkIdType count = normals->GetNumberOfTuples();
  const Places place(const_cast<vtkFloatArray*>(points)->GetPointer(0), 3, count);
  Eigen::Map<Eigen::Matrix3Xf> normal(normals->GetPointer(0), 3, count);
  normal.setZero();
  for (const Triangle& t : triangles)
  {
    const Eigen::Vector3f first = place.col(t[0]);
    const Eigen::Vector3f area = (place.col(t[1]) - first).cross(place.col(t[2]) - first);
    for (const std::int64_t corner : t)
    {
      normal.col(corner) += area;
    }
  }
  normal.colwise().normalize();
  normals->Modified();
}
}

vtkPosingScene::vtkPosingScene(const vtkPosingModel& model, std::int64_t triangles)
  : Model(model)
{
  this->Renderer_->SetBackground(1.0, 1.0, 1.0);
  // Joints are seen through the vessels, also where these are opaque, which is drawn faster.
  this->Front->SetLayer(1);
  this->Front->InteractiveOff();
  this->Front->SetActiveCamera(this->Renderer_->GetActiveCamera());
  this->MakeVessels(triangles);
  this->MakeSkeleton();
  this->Update();
  this->LookFromFront();
}

vtkPosingScene::~vtkPosingScene() = default;

void vtkPosingScene::MakeVessels(std::int64_t triangles)
{
  const DrawnSurface drawn = MakeDrawnSurface(this->Model.BoundaryAtRest(), triangles);
  this->Drawn = drawn.origin;
  const auto count = static_cast<vtkIdType>(this->Drawn.size());
  this->Vessels->SetPolys(drawn.data->GetPolys());
  for (vtkIdType cell = 0; cell < drawn.data->GetNumberOfPolys(); ++cell)
  {
    vtkIdType corners = 0;
    const vtkIdType* ids = nullptr;
    drawn.data->GetPolys()->GetCellAtId(cell, corners, ids);
    this->Triangles.push_back({ ids[0], ids[1], ids[2] });
  }
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(count);
  this->Vessels->SetPoints(points);
  this->Normals->SetNumberOfComponents(3);
  this->Normals->SetNumberOfTuples(count);
  this->Vessels->GetPointData()->SetNormals(this->Normals);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(this->Vessels);
  mapper->ScalarVisibilityOff();
  this->VesselActor->SetMapper(mapper);
  vtkProperty* look = this->VesselActor->GetProperty();
  look->SetColor(0.86, 0.66, 0.55);
  look->SetOpacity(1.0);
  look->SetSpecular(0.2);
  look->SetSpecularPower(30.0);
  look->BackfaceCullingOn();
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
  this->Front->AddActor(bones);
  const auto showPoints = [this](vtkPolyData* points, double red, double green, float size)
  {
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(points);
    mapper->ScalarVisibilityOff();
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(red, green, 0.0);
    actor->GetProperty()->RenderPointsAsSpheresOn();
    actor->GetProperty()->SetPointSize(size);
    this->Front->AddActor(actor);
  };
  showPoints(this->Joints, 0.9, 0.0, JointSize);
  showPoints(this->Chosen, 1.0, 0.85, ChosenSize);
  vtkNew<vtkCellArray> all;
  const vtkIdType joints = this->Model.NumberOfJoints();
  for (vtkIdType n = 0; n < joints; ++n)
  {
    all->InsertNextCell(1, &n);
  }
  this->Joints->SetVerts(all);
  vtkNew<vtkCellArray> one;
  const vtkIdType first = 0;
  one->InsertNextCell(1, &first);
  this->Chosen->SetVerts(one);
}

std::int64_t vtkPosingScene::NumberOfTriangles() const
{
  return this->Vessels->GetNumberOfPolys();
}

void vtkPosingScene::Update()
{
  auto* skin = vtkFloatArray::SafeDownCast(this->Model.Skin()->GetPoints()->GetData());
  auto* points = vtkFloatArray::SafeDownCast(this->Vessels->GetPoints()->GetData());
  for (vtkIdType n = 0; n < points->GetNumberOfTuples(); ++n)
  {
    std::copy_n(
      skin->GetPointer(3 * this->Drawn[static_cast<std::size_t>(n)]), 3, points->GetPointer(3 * n));
  }
  this->Vessels->GetPoints()->Modified();
  FindNormals(this->Triangles, points, this->Normals);
  this->Vessels->Modified();
  this->Skeleton->SetPoints(this->Model.Pose()->GetPoints());
  this->Joints->SetPoints(this->Model.Pose()->GetPoints());
  vtkNew<vtkPoints> chosen;
  chosen->InsertNextPoint(this->Model.Joint(this->Model.Chosen()).data());
  this->Chosen->SetPoints(chosen);
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
  camera->Zoom(1.25);
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
