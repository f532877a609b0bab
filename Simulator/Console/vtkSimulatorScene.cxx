#include "vtkSimulatorScene.h"

#include "Numbers.h"
#include "vtkDrawnSurface.h"

#include "vtkActor.h"
#include "vtkCamera.h"
#include "vtkCellArray.h"
#include "vtkDoubleArray.h"
#include "vtkFloatArray.h"
#include "vtkGlyph3DMapper.h"
#include "vtkLight.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper.h"
#include "vtkPolyDataNormals.h"
#include "vtkProperty.h"
#include "vtkRenderer.h"
#include "vtkSphereSource.h"
#include "vtkTubeFilter.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr double RestPhase = 0.75;
constexpr double WireThickness = 1.4; // of the true radius: to be seen
constexpr double StrutRadius = 0.06;  // mm, likewise
constexpr double RingSpacing = 1.5;   // mm along a stent
constexpr double TearRadius = 2.0;    // mm, of a mark
constexpr int Crowns = 8;             // of a ring
constexpr int Links = 2;              // between two rings

void SetPoints(vtkPolyData* data, const std::vector<Vector3>& positions)
{
  vtkPoints* points = data->GetPoints();
  const auto count = static_cast<vtkIdType>(positions.size());
  points->SetNumberOfPoints(count);
  for (vtkIdType n = 0; n < count; ++n)
  {
    points->SetPoint(n, positions[static_cast<std::size_t>(n)].data());
  }
  points->Modified();
  data->Modified();
}

void SetLine(vtkPolyData* data, const std::vector<Vector3>& positions)
{
  const auto count = static_cast<vtkIdType>(positions.size());
  if (data->GetNumberOfLines() == 0 || data->GetNumberOfPoints() != count)
  {
    vtkNew<vtkCellArray> lines;
    if (count > 1)
    {
      lines->InsertNextCell(count);
      for (vtkIdType n = 0; n < count; ++n)
      {
        lines->InsertCellPoint(n);
      }
    }
    data->SetLines(lines);
  }
  SetPoints(data, positions);
}

void UsePoints(vtkPolyData* data)
{
  vtkNew<vtkPoints> points;
  data->SetPoints(points);
}

void SetTriangles(vtkPolyData* data, const std::vector<Triangle>& triangles)
{
  vtkNew<vtkCellArray> cells;
  for (const Triangle& triangle : triangles)
  {
    const vtkIdType ids[3] = { triangle[0], triangle[1], triangle[2] };
    cells->InsertNextCell(3, ids);
  }
  data->SetPolys(cells);
}

/// mm from the first point.
std::vector<double> AlongLine(const std::vector<Vector3>& line)
{
  std::vector<double> along(line.size(), 0.0);
  for (std::size_t n = 1; n < line.size(); ++n)
  {
    along[n] = along[n - 1] + (line[n] - line[n - 1]).norm();
  }
  return along;
}

void Draw(vtkRenderer* renderer, vtkActor* actor, vtkPolyDataMapper* mapper)
{
  mapper->ScalarVisibilityOff();
  actor->SetMapper(mapper);
  renderer->AddActor(actor);
}
}

vtkSimulatorScene::vtkSimulatorScene(WallMotion& wall, const Scenario& scenario,
  std::shared_ptr<const HeartShell> heart, const SceneSettings& settings)
  : Heart(std::move(heart))
{
  this->Renderer_->SetBackground(0.06, 0.07, 0.09);
  this->Renderer_->SetBackground2(0.16, 0.18, 0.22);
  this->Renderer_->GradientBackgroundOn();
  if (this->Heart)
  {
    this->MakeHeart();
  }
  this->Vessels.axis = wall.Topology().axis;
  this->Vessels.parent = wall.Topology().parent;
  this->Vessels.aorta = wall.Topology().aorta;
  this->MakeInstruments(scenario);
  this->MakeTracers();
  this->MakeTears();
  this->MakeWall(wall, settings.triangles);
  this->LookFromFront();
}

vtkSimulatorScene::~vtkSimulatorScene() = default;

void vtkSimulatorScene::MakeWall(WallMotion& wall, std::int64_t triangles)
{
  std::vector<Vector3> rest;
  wall.Positions(RestPhase, rest);
  vtkNew<vtkPolyData> whole;
  UsePoints(whole);
  SetPoints(whole, rest);
  SetTriangles(whole, wall.Topology().triangles);
  const DrawnSurface drawn = MakeDrawnSurface(whole, triangles);
  this->WallMesh->ShallowCopy(drawn.data);
  this->Drawn = drawn.origin;
  this->AnchorNormals(wall, whole, rest);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(this->WallMesh);
  Draw(this->Renderer_, this->WallActor, mapper);
  vtkProperty* look = this->WallActor->GetProperty();
  look->SetColor(0.86, 0.24, 0.22);
  look->SetOpacity(0.38);
  // On few triangles the normals of what is seen edge-on point away, where only ambient light is left.
  look->SetAmbient(0.45);
  look->SetDiffuse(0.6);
  look->SetSpecular(0.3);
  look->SetSpecularPower(30.0);
  look->BackfaceCullingOn(); // half of what is translucent, and quicker
}

/// Rows: away from the axis, along it, around it.
Matrix3 vtkSimulatorScene::FrameOf(
  const AxisNormal& anchor, const std::vector<Vector3>& axis, const Vector3& point)
{
  Matrix3 frame;
  const Vector3 along = (axis[anchor.after] - axis[anchor.before]).normalized();
  Vector3 out = point - axis[anchor.at];
  out -= out.dot(along) * along;
  frame.row(0) = out.norm() > 1e-6 ? Vector3(out.normalized()) : along.unitOrthogonal();
  frame.row(1) = along;
  frame.row(2) = along.cross(Vector3(frame.row(0)));
  return frame;
}

/// The few triangles that are drawn have bad normals of their own, which look like wrinkles and holes: those of the whole
/// wall are used, and turned with the vessel.
void vtkSimulatorScene::AnchorNormals(
  WallMotion& wall, vtkPolyData* whole, const std::vector<Vector3>& rest)
{
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(whole);
  normals->SplittingOff();
  normals->ConsistencyOff();
  normals->Update();
  vtkDataArray* values = normals->GetOutput()->GetPointData()->GetNormals();

  const WallTopology& topology = wall.Topology();
  std::vector<Vector3> axis;
  wall.AxisPositions(RestPhase, axis);
  std::vector<std::size_t> begin{ 0 }; // of each branch in the list
  for (const std::vector<Vector3>& branch : topology.axis)
  {
    begin.push_back(begin.back() + branch.size());
  }
  std::vector<Vector3> points;
  for (const std::int64_t id : this->Drawn)
  {
    const Vector3& point = rest[static_cast<std::size_t>(id)];
    const int group = topology.group[static_cast<std::size_t>(id)];
    const bool known = group >= 0 && static_cast<std::size_t>(group) + 1 < begin.size();
    AxisNormal anchor;
    double nearest = std::numeric_limits<double>::max();
    for (std::size_t b = known ? static_cast<std::size_t>(group) : 0;
         b + 1 < begin.size() && (!known || b == static_cast<std::size_t>(group)); ++b)
    {
      for (std::size_t k = begin[b]; k < begin[b + 1]; ++k)
      {
        const double away = (axis[k] - point).squaredNorm();
        if (away < nearest)
        {
          nearest = away;
          anchor.at = k;
          anchor.before = k > begin[b] ? k - 1 : k;
          anchor.after = k + 1 < begin[b + 1] ? k + 1 : k;
        }
      }
    }
    anchor.normal = FrameOf(anchor, axis, point) * Vector3(values->GetTuple3(id));
    this->Normals.push_back(anchor);
    points.push_back(point);
  }
  this->WallNormals->SetNumberOfComponents(3);
  this->WallNormals->SetNumberOfTuples(static_cast<vtkIdType>(points.size()));
  this->WallMesh->GetPointData()->SetNormals(this->WallNormals);
  this->TurnNormals(points, axis);
}

void vtkSimulatorScene::TurnNormals(
  const std::vector<Vector3>& points, const std::vector<Vector3>& axis)
{
  for (std::size_t n = 0; n < this->Normals.size(); ++n)
  {
    const AxisNormal& anchor = this->Normals[n];
    const Vector3 normal = FrameOf(anchor, axis, points[n]).transpose() * anchor.normal;
    this->WallNormals->SetTuple(static_cast<vtkIdType>(n), normal.data());
  }
  this->WallNormals->Modified();
}

void vtkSimulatorScene::MakeHeart()
{
  UsePoints(this->HeartMesh);
  this->Heart->Positions(RestPhase, this->HeartPoints);
  SetPoints(this->HeartMesh, this->HeartPoints);
  SetTriangles(this->HeartMesh, this->Heart->Triangles());
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(this->HeartMesh);
  normals->SplittingOff();
  normals->ConsistencyOff();
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(normals->GetOutputPort());
  Draw(this->Renderer_, this->HeartActor, mapper);
  vtkProperty* look = this->HeartActor->GetProperty();
  look->SetColor(0.62, 0.42, 0.38);
  look->SetAmbient(0.12);
  look->SetDiffuse(0.75);
  look->SetSpecular(0.08);
}

void vtkSimulatorScene::MakeAorta()
{
  this->Aorta = std::make_unique<AortaMotion>(this->Vessels);
  UsePoints(this->AortaMesh);
  SetTriangles(this->AortaMesh, this->Vessels.aorta->triangles);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(this->AortaMesh);
  Draw(this->Renderer_, this->AortaActor, mapper);
  vtkProperty* look = this->AortaActor->GetProperty();
  look->SetColor(0.86, 0.5, 0.42);
  look->SetOpacity(0.16);
  look->SetAmbient(0.5);
  look->SetDiffuse(0.5);
  look->BackfaceCullingOn();
}

void vtkSimulatorScene::MakeInstruments(const Scenario& scenario)
{
  const auto make =
    [this](vtkPolyData* line, vtkTubeFilter* tube, vtkActor* actor, double radius, int sides)
  {
    UsePoints(line);
    tube->SetInputData(line);
    tube->SetRadius(radius);
    tube->SetNumberOfSides(sides);
    tube->CappingOn();
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(tube->GetOutputPort());
    Draw(this->Renderer_, actor, mapper);
  };
  const double wire = WireThickness * scenario.wire.sections.front().radius;
  make(this->WireLine, this->WireTube, this->WireActor, wire, 6);
  this->WireActor->GetProperty()->SetColor(0.75, 0.95, 1.0);
  this->WireActor->GetProperty()->SetAmbient(0.5);
  make(this->SecondLine, this->SecondTube, this->SecondActor, wire, 6);
  this->SecondActor->GetProperty()->SetColor(0.7, 1.0, 0.6);
  this->SecondActor->GetProperty()->SetAmbient(0.5);
  make(
    this->CatheterLine, this->CatheterTube, this->CatheterActor, scenario.catheter.outerRadius, 10);
  this->CatheterActor->GetProperty()->SetColor(0.93, 0.8, 0.3);
  this->CatheterActor->GetProperty()->SetAmbient(0.35);
  this->CatheterActor->GetProperty()->SetDiffuse(0.7);
  make(this->BalloonLine, this->BalloonTube, this->BalloonActor, 1.0, 12);
  this->BalloonTube->SetVaryRadiusToVaryRadiusByAbsoluteScalar();
  this->BalloonActor->GetProperty()->SetColor(0.55, 0.75, 0.95);
  this->BalloonActor->GetProperty()->SetAmbient(0.4);
  make(this->StentLines, this->StentTube, this->StentActor, StrutRadius, 4);
  this->StentTube->CappingOff();
  this->StentActor->GetProperty()->SetColor(0.92, 0.94, 0.97);
  this->StentActor->GetProperty()->SetAmbient(0.5);
}

void vtkSimulatorScene::MakeTracers()
{
  UsePoints(this->TracerPoints);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(this->TracerPoints);
  Draw(this->Renderer_, this->TracerActor, mapper);
  vtkProperty* look = this->TracerActor->GetProperty();
  look->SetColor(1.0, 0.95, 0.55);
  look->SetPointSize(2.0F);
  look->LightingOff();
}

void vtkSimulatorScene::MakeTears()
{
  UsePoints(this->TearPoints);
  vtkNew<vtkSphereSource> ball;
  ball->SetRadius(TearRadius);
  vtkNew<vtkGlyph3DMapper> mapper;
  mapper->SetInputData(this->TearPoints);
  mapper->SetSourceConnection(ball->GetOutputPort());
  mapper->ScalarVisibilityOff();
  this->TearActor->SetMapper(mapper);
  this->TearActor->GetProperty()->SetColor(1.0, 0.15, 0.85);
  this->TearActor->GetProperty()->SetAmbient(0.7);
  this->Renderer_->AddActor(this->TearActor);
}

/// Marks where walls are torn and not sealed.
void vtkSimulatorScene::SetTears(const SessionSnapshot& snapshot)
{
  std::vector<Vector3> places;
  for (const VesselTear& tear : snapshot.tears)
  {
    if (!tear.sealed)
    {
      places.push_back(snapshot.axis[tear.point]);
    }
  }
  SetPoints(this->TearPoints, places);
}

/// Rings of zigzags with links between them; a stent of no maker.
void vtkSimulatorScene::SetStents(const std::vector<StentShape>& stents)
{
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  for (const StentShape& stent : stents)
  {
    if (stent.line.size() < 2)
    {
      continue;
    }
    const std::vector<double> along = AlongLine(stent.line);
    const auto rings = static_cast<int>(std::max(2.0, std::round(along.back() / RingSpacing)));
    const double height = 0.7 * along.back() / rings; // of a crown
    Vector3 side = (stent.line[1] - stent.line[0]).unitOrthogonal();
    std::vector<vtkIdType> valleys;
    for (int ring = 0; ring < rings; ++ring)
    {
      const double middle = along.back() * (ring + 0.5) / rings;
      std::vector<vtkIdType> crowns;
      for (int k = 0; k < 2 * Crowns; ++k)
      {
        const double at =
          std::clamp(middle + (k % 2 == 0 ? -0.5 : 0.5) * height, 0.0, along.back());
        const auto n = static_cast<std::size_t>(std::min<std::ptrdiff_t>(
          std::max<std::ptrdiff_t>(
            1, std::lower_bound(along.begin(), along.end(), at) - along.begin()),
          static_cast<std::ptrdiff_t>(along.size()) - 1));
        const double t = (at - along[n - 1]) / (along[n] - along[n - 1]);
        const Vector3 tangent = (stent.line[n] - stent.line[n - 1]).normalized();
        side = (side - side.dot(tangent) * tangent).normalized();
        const double angle = Pi * k / Crowns;
        const Vector3 out = std::cos(angle) * side + std::sin(angle) * tangent.cross(side);
        const double radius = stent.radii[n - 1] + t * (stent.radii[n] - stent.radii[n - 1]);
        const Vector3 point = stent.line[n - 1] + t * (stent.line[n] - stent.line[n - 1]) +
          (radius + 0.5 * stent.design.strut) * out;
        crowns.push_back(points->InsertNextPoint(point.data()));
      }
      lines->InsertNextCell(2 * Crowns + 1);
      for (int k = 0; k <= 2 * Crowns; ++k)
      {
        lines->InsertCellPoint(crowns[k % (2 * Crowns)]);
      }
      for (int link = 0; link < Links && !valleys.empty(); ++link)
      {
        const int k = 2 * Crowns * link / Links;
        lines->InsertNextCell({ valleys[k + 1], crowns[k] });
      }
      valleys = crowns;
    }
  }
  this->StentLines->SetPoints(points);
  this->StentLines->SetLines(lines);
}

std::int64_t vtkSimulatorScene::NumberOfTriangles() const
{
  return this->WallMesh->GetNumberOfPolys() + this->HeartMesh->GetNumberOfPolys() +
    this->AortaMesh->GetNumberOfPolys();
}

void vtkSimulatorScene::Update(const SessionSnapshot& snapshot)
{
  if (snapshot.wall.size() == this->Drawn.size())
  {
    SetPoints(this->WallMesh, snapshot.wall);
    this->TurnNormals(snapshot.wall, snapshot.axis);
  }
  if (this->Heart && this->HeartActor->GetVisibility() != 0)
  {
    this->Heart->Positions(snapshot.report.phase, this->HeartPoints);
    SetPoints(this->HeartMesh, this->HeartPoints);
  }
  this->AortaActor->SetVisibility(snapshot.guideFromArch);
  if (snapshot.guideFromArch)
  {
    if (!this->Aorta)
    {
      this->MakeAorta();
    }
    this->Aorta->Positions(snapshot.axis, this->AortaPoints);
    SetPoints(this->AortaMesh, this->AortaPoints);
  }
  SetLine(this->WireLine, snapshot.wire);
  if (!snapshot.secondWire.empty() || this->SecondLine->GetNumberOfPoints() > 0)
  {
    SetLine(this->SecondLine, snapshot.secondWire);
  }
  SetLine(this->CatheterLine, snapshot.catheter);
  if (snapshot.balloon.size() > 1 || this->BalloonLine->GetNumberOfPoints() > 0)
  {
    SetLine(this->BalloonLine, snapshot.balloon);
    vtkNew<vtkDoubleArray> radii;
    for (const double radius : snapshot.balloonRadii)
    {
      radii->InsertNextValue(radius);
    }
    this->BalloonLine->GetPointData()->SetScalars(radii);
  }
  if (!snapshot.stents.empty() || this->StentLines->GetNumberOfPoints() > 0)
  {
    this->SetStents(snapshot.stents);
  }
  if (!snapshot.tears.empty())
  {
    this->SetTears(snapshot);
  }
  if (this->TracerActor->GetVisibility() != 0)
  {
    const auto count = static_cast<vtkIdType>(snapshot.tracers.size());
    if (this->TracerPoints->GetNumberOfVerts() != 1 ||
      this->TracerPoints->GetNumberOfPoints() != count)
    {
      vtkNew<vtkCellArray> all;
      if (count > 0)
      {
        all->InsertNextCell(count);
        for (vtkIdType n = 0; n < count; ++n)
        {
          all->InsertCellPoint(n);
        }
      }
      this->TracerPoints->SetVerts(all);
    }
    SetPoints(this->TracerPoints, snapshot.tracers);
  }
}

void vtkSimulatorScene::ShowHeart(bool shown)
{
  this->HeartActor->SetVisibility(shown);
}

void vtkSimulatorScene::ShowTracers(bool shown)
{
  this->TracerActor->SetVisibility(shown);
}

void vtkSimulatorScene::SetWallOpacity(double opacity)
{
  this->WallActor->GetProperty()->SetOpacity(std::clamp(opacity, 0.0, 1.0));
}

void vtkSimulatorScene::LookAsCArm(const CArmPose& pose)
{
  const CArmGeometry geometry(pose, {});
  vtkCamera* camera = this->Renderer_->GetActiveCamera();
  // The image is as if seen from the detector: towards the source, the patient's left on the right.
  const Vector3& from = geometry.DetectorCentre();
  const Vector3 up = -geometry.RowDirection();
  camera->SetFocalPoint(pose.isocentre.data());
  camera->SetPosition(from.data());
  camera->SetViewUp(up.data());
  // On the arteries and the heart, not on all of the catheter.
  std::array<double, 6> box{};
  this->WallMesh->GetPoints()->GetBounds(box.data());
  this->Renderer_->ResetCamera(box.data());
  camera->Zoom(1.25);
  this->Renderer_->ResetCameraClippingRange();
}

void vtkSimulatorScene::LookFromFront()
{
  CArmPose front;
  std::array<double, 6> box{};
  this->WallMesh->GetPoints()->GetBounds(box.data());
  front.isocentre = { 0.5 * (box[0] + box[1]), 0.5 * (box[2] + box[3]), 0.5 * (box[4] + box[5]) };
  front.primary = 0.5;
  this->LookAsCArm(front);
}
}
