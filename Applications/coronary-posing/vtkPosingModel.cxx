#include "vtkPosingModel.h"

#include "Numbers.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkSkeletonForms.h"
#include "vtkSkeletonPose.h"
#include "vtkSkinDeformation.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
namespace names = vtkCoronaryArrayNames;

constexpr std::size_t RememberedSteps = 1000;
constexpr int LongestChain = 64;

[[noreturn]] void Fail(const std::string& path, const std::string& what)
{
  throw std::runtime_error("'" + path + "' " + what + ".");
}

std::string FileOfRun(const std::string& folder, const char* name)
{
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
  {
    Fail(folder, "is no folder: a result of 'coronary-pipeline run' was expected there");
  }
  std::string path = (fs::path(folder) / name).string();
  if (!fs::is_regular_file(path, ignored))
  {
    Fail(path,
      "is missing: posing needs skeleton and skin weights; run 'coronary-pipeline run ... --until "
      "weights --output " +
        folder + "'");
  }
  return path;
}

SkeletonRig RigOf(vtkPolyData* rest, const std::string& folder)
{
  return About(FileOfRun(folder, "skeleton.vtp"),
    [&] { return SkeletonRig(vtkSkeletonForms::SkeletonOf(rest, "the skeleton")); });
}

/// The boundary's points are the first ones of the tetrahedra.
void RequireSamePoints(vtkPolyData* boundary, vtkUnstructuredGrid* mesh, const std::string& folder)
{
  const std::string path = FileOfRun(folder, "volume_boundary.vtp");
  const std::string other = FileOfRun(folder, "weights.vtu");
  if (boundary->GetNumberOfPolys() == 0 || boundary->GetPolys()->IsHomogeneous() != 3)
  {
    Fail(path, "is no surface of triangles");
  }
  for (vtkIdType n = 0; n < boundary->GetNumberOfPoints(); ++n)
  {
    if (n >= mesh->GetNumberOfPoints() ||
      (Vector3(mesh->GetPoint(n)) - Vector3(boundary->GetPoint(n))).norm() > 1e-3)
    {
      Fail(path,
        "does not belong to '" + other + "': point " + std::to_string(n) + " is another one there");
    }
  }
}

Vector3 PointOf(vtkPolyData* data, std::int64_t point)
{
  Vector3 place;
  data->GetPoint(point, place.data());
  return place;
}

/// One step of damped least squares towards `wanted`. The turn about each joint is weighted such that the bend
/// is greatest half way along the chain and begins softly.
std::vector<Vector3> BentTowards(
  const std::vector<Vector3>& places, const Vector3& missing, double damping)
{
  const std::size_t bones = places.size() - 1;
  Matrix3 normal = Matrix3::Zero();
  const auto arm = [&](std::size_t k) { return Vector3(places.back() - places[k]); };
  const auto weight = [&](std::size_t k)
  { return static_cast<double>(k + 1) / static_cast<double>(bones); };
  for (std::size_t k = 0; k < bones; ++k)
  {
    normal +=
      weight(k) * (arm(k).squaredNorm() * Matrix3::Identity() - arm(k) * arm(k).transpose());
  }
  normal += damping * normal.trace() * Matrix3::Identity();
  const Vector3 pull = normal.ldlt().solve(missing);
  std::vector<Vector3> bent = places;
  Quaternion turned = Quaternion::Identity();
  for (std::size_t k = 0; k < bones; ++k)
  {
    const Vector3 turn = weight(k) * arm(k).cross(pull);
    if (turn.norm() > 0.0)
    {
      turned = Quaternion(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * turned;
    }
    bent[k + 1] = bent[k] + turned * (places[k + 1] - places[k]);
  }
  return bent;
}

/// Turns the steps of a chain such that its end comes to `wanted`, or as near as it can. The first place and
/// the lengths stay. (Levenberg-Marquardt.)
void BendChain(std::vector<Vector3>& places, const Vector3& wanted)
{
  constexpr int Iterations = 100;
  constexpr double Near = 1e-9; // mm
  double damping = 1e-3;
  for (int n = 0; n < Iterations && damping < 1e6; ++n)
  {
    const Vector3 missing = wanted - places.back();
    if (missing.norm() < Near)
    {
      return;
    }
    std::vector<Vector3> bent = BentTowards(places, missing, damping);
    const bool better = (wanted - bent.back()).norm() < missing.norm();
    damping *= better ? 0.2 : 5.0;
    if (better)
    {
      places = std::move(bent);
    }
  }
}

/// Along the axis, as long as the angle.
Vector3 AngleVector(const Quaternion& rotation)
{
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

/// What is missing is spread evenly over the bones.
void StretchChain(std::vector<Vector3>& places, const Vector3& wanted)
{
  const Vector3 missing = wanted - places.back();
  const auto bones = static_cast<double>(places.size() - 1);
  for (std::size_t k = 1; k < places.size(); ++k)
  {
    places[k] += static_cast<double>(k) / bones * missing;
  }
}
}

vtkPosingModel::vtkPosingModel(const std::string& folder, vtkMessageTrap& messages)
  : Messages(messages)
  , Rest(ReadPolyData(FileOfRun(folder, "skeleton.vtp"), messages))
  , Boundary(ReadPolyData(FileOfRun(folder, "volume_boundary.vtp"), messages))
  , Mesh(ReadUnstructuredGrid(FileOfRun(folder, "weights.vtu"), messages))
  , Rig(RigOf(this->Rest, folder))
{
  RequireSamePoints(this->Boundary, this->Mesh, folder);
  const std::vector<Skeleton::Bone>& bones = this->Rig.Rest().bones;
  this->BoneInto.assign(static_cast<std::size_t>(this->NumberOfJoints()), -1);
  for (std::size_t b = 0; b < bones.size(); ++b)
  {
    this->BoneInto[static_cast<std::size_t>(bones[b].second)] = static_cast<std::int64_t>(b);
  }
  this->Poser->SetInputData(this->Rest);
  this->Deformer->SetInputData(0, this->Mesh);
  this->Deformer->SetInputData(1, this->Rest);
  try
  {
    this->Push(this->Posed(nullptr));
  }
  catch (const std::runtime_error& error)
  {
    throw std::runtime_error("'" + FileOfRun(folder, "weights.vtu") + "': " + error.what());
  }
}

vtkPosingModel::~vtkPosingModel() = default;

vtkPolyData* vtkPosingModel::Pose() const
{
  return this->Current;
}

vtkPolyData* vtkPosingModel::BoundaryAtRest() const
{
  return this->Boundary;
}

bool vtkPosingModel::Moving() const
{
  return this->MoveStart != nullptr;
}

void vtkPosingModel::SetSettings(const PosingSettings& settings)
{
  if (settings.bones < 1 || settings.bones > LongestChain)
  {
    throw std::invalid_argument(
      "The bones that share a bend must be 1 to " + std::to_string(LongestChain));
  }
  this->Settings_ = settings;
  this->Show(this->Current, settings.repair && !this->Moving());
}

void vtkPosingModel::Choose(std::int64_t joint)
{
  if (joint < 0 || joint >= this->NumberOfJoints())
  {
    throw std::invalid_argument("There is no joint " + std::to_string(joint) +
      ": the skeleton has the joints 0 to " + std::to_string(this->NumberOfJoints() - 1));
  }
  this->CancelMove();
  this->Chosen_ = joint;
}

std::int64_t vtkPosingModel::Parent(std::int64_t joint) const
{
  const std::int64_t bone = this->BoneInto.at(static_cast<std::size_t>(joint));
  return bone < 0 ? -1 : this->Rig.Rest().bones[static_cast<std::size_t>(bone)].first;
}

std::vector<std::int64_t> vtkPosingModel::Daughters(std::int64_t joint) const
{
  std::vector<std::int64_t> daughters;
  for (const Skeleton::Bone& bone : this->Rig.Rest().bones)
  {
    if (bone.first == joint)
    {
      daughters.push_back(bone.second);
    }
  }
  return daughters;
}

Vector3 vtkPosingModel::Joint(std::int64_t joint) const
{
  return PointOf(this->Current, joint);
}

std::string vtkPosingModel::BoneName(std::int64_t joint) const
{
  const std::int64_t bone = this->BoneInto.at(static_cast<std::size_t>(joint));
  auto* list =
    vtkStringArray::SafeDownCast(this->Rest->GetFieldData()->GetAbstractArray(names::BoneName));
  return bone >= 0 && list && bone < list->GetNumberOfValues() ? std::string(list->GetValue(bone))
                                                               : std::string();
}

std::vector<std::int64_t> vtkPosingModel::Chain(std::int64_t joint) const
{
  std::vector<std::int64_t> chain{ joint };
  for (int n = 0; n < this->Settings_.bones && this->Parent(chain.back()) >= 0; ++n)
  {
    chain.push_back(this->Parent(chain.back()));
  }
  std::reverse(chain.begin(), chain.end());
  return chain;
}

void vtkPosingModel::BeginMove()
{
  this->CancelMove();
  this->MoveStart = this->Current;
}

void vtkPosingModel::MoveTo(const Vector3& wanted)
{
  if (!this->Moving())
  {
    throw std::logic_error("MoveTo without BeginMove");
  }
  if (!wanted.allFinite())
  {
    throw std::runtime_error("The place of a joint must be finite.");
  }
  this->Show(this->Moved(this->MoveStart, wanted), false);
}

void vtkPosingModel::EndMove()
{
  const vtkSmartPointer<vtkPolyData> start = std::exchange(this->MoveStart, nullptr);
  if (start && this->Current != start)
  {
    this->Push(this->Current);
  }
}

void vtkPosingModel::CancelMove()
{
  if (const vtkSmartPointer<vtkPolyData> start = std::exchange(this->MoveStart, nullptr))
  {
    this->Show(start, this->Settings_.repair);
  }
}

void vtkPosingModel::Move(const Vector3& millimetres)
{
  this->BeginMove();
  try
  {
    this->MoveTo(this->Joint(this->Chosen_) + millimetres);
    this->EndMove();
  }
  catch (...)
  {
    this->CancelMove();
    throw;
  }
}

vtkSmartPointer<vtkPolyData> vtkPosingModel::Moved(vtkPolyData* start, const Vector3& wanted)
{
  const std::vector<std::int64_t> chain = this->Chain(this->Chosen_);
  this->Poser->RemoveAllEdits();
  if (this->Settings_.drag != JointDrag::Turn || chain.size() == 1)
  {
    this->Poser->MoveJointOn();
    this->Poser->SetJoint(this->Chosen_);
    this->Poser->SetMoveMode(this->Settings_.drag == JointDrag::Alone
        ? vtkSkeletonPose::MoveAlone
        : vtkSkeletonPose::MoveBeyond);
    this->Poser->SetJointPosition(wanted.x(), wanted.y(), wanted.z());
    return this->Posed(start);
  }
  this->Poser->MoveJointOff();
  std::vector<Vector3> places;
  places.reserve(chain.size());
  for (const std::int64_t joint : chain)
  {
    places.push_back(PointOf(start, joint));
  }
  std::vector<Vector3> bent = places;
  BendChain(bent, wanted);
  if (!this->Settings_.keepLengths)
  {
    StretchChain(bent, wanted);
  }
  for (std::size_t k = 1; k < chain.size(); ++k)
  {
    // A bone turns about its first joint with all beyond it, the rest of the chain too.
    const Vector3 here = places[k];
    const Quaternion turn = ShortestRotation(here - places[k - 1], bent[k] - places[k - 1]);
    for (std::size_t n = k; n < chain.size(); ++n)
    {
      places[n] = bent[k] + turn * (places[n] - here);
    }
    this->AddEdit(chain[k], 0.0, AngleVector(turn), bent[k] - here, 1.0, 0.0);
  }
  return this->Posed(start);
}

void vtkPosingModel::AddEdit(std::int64_t joint, double twist, const Vector3& turn,
  const Vector3& shift, double calibre, double reach)
{
  const Vector3 degrees = turn / Degree;
  this->Poser->AddEdit(static_cast<double>(joint), twist / Degree, degrees.x(), degrees.y(),
    degrees.z(), shift.x(), shift.y(), shift.z(), calibre, reach);
}

void vtkPosingModel::Edit(double twist, const Vector3& turn, double calibre, double reach)
{
  this->CancelMove();
  this->Poser->RemoveAllEdits();
  this->Poser->MoveJointOff();
  this->AddEdit(this->Chosen_, twist, turn, Vector3::Zero(), calibre, reach);
  this->Push(this->Posed(this->Current));
}

void vtkPosingModel::Turn(const Vector3& axisTimesRadians)
{
  this->Edit(0.0, axisTimesRadians, 1.0, 0.0);
}

void vtkPosingModel::Twist(double radians)
{
  this->Edit(radians, Vector3::Zero(), 1.0, 0.0);
}

void vtkPosingModel::Widen(double factor, double reach)
{
  this->Edit(0.0, Vector3::Zero(), factor, reach);
}

vtkSmartPointer<vtkPolyData> vtkPosingModel::Posed(vtkPolyData* start)
{
  this->Poser->SetInputDataObject(1, start);
  this->Poser->Update();
  this->Messages.ThrowIfError();
  auto pose = vtkSmartPointer<vtkPolyData>::New();
  pose->ShallowCopy(this->Poser->GetOutput());
  return pose;
}

void vtkPosingModel::Push(const vtkSmartPointer<vtkPolyData>& pose)
{
  this->Show(pose, this->Settings_.repair);
  if (!this->Steps.empty())
  {
    this->Steps.resize(this->Now + 1);
  }
  this->Steps.push_back(pose);
  if (this->Steps.size() > RememberedSteps)
  {
    this->Steps.pop_front();
  }
  this->Now = this->Steps.size() - 1;
}

bool vtkPosingModel::Undo()
{
  this->CancelMove();
  if (!this->CanUndo())
  {
    return false;
  }
  --this->Now;
  this->Show(this->Steps[this->Now], this->Settings_.repair);
  return true;
}

bool vtkPosingModel::Redo()
{
  this->CancelMove();
  if (!this->CanRedo())
  {
    return false;
  }
  ++this->Now;
  this->Show(this->Steps[this->Now], this->Settings_.repair);
  return true;
}

void vtkPosingModel::Reset()
{
  this->CancelMove();
  this->Poser->RemoveAllEdits();
  this->Poser->MoveJointOff();
  this->Push(this->Posed(nullptr));
}

void vtkPosingModel::ReadPose(const std::string& path)
{
  this->CancelMove();
  const auto pose = ReadPolyData(path, this->Messages);
  About(path,
    [&]
    {
      std::vector<BoneTransform> bones;
      this->Rig.Transform(vtkSkeletonForms::PoseOf(pose, this->Rig), bones);
      return bones.size();
    });
  this->Push(pose);
}

void vtkPosingModel::WritePose(const std::string& path) const
{
  WritePolyData(path, this->Current, this->Messages);
}

void vtkPosingModel::WriteSurface(const std::string& path) const
{
  const vtkIdType count = this->Boundary->GetNumberOfPoints();
  vtkNew<vtkPolyData> surface;
  surface->ShallowCopy(this->Boundary);
  vtkNew<vtkPoints> points;
  points->SetDataType(this->Skin()->GetPoints()->GetDataType());
  points->InsertPoints(0, count, 0, this->Skin()->GetPoints());
  surface->SetPoints(points);
  // They would be wrong.
  surface->GetPointData()->SetNormals(nullptr);
  surface->GetCellData()->SetNormals(nullptr);
  vtkDataArray* moved = this->Skin()->GetPointData()->GetArray(names::Displacement);
  vtkNew<vtkFloatArray> displacement;
  displacement->SetName(names::Displacement);
  displacement->SetNumberOfComponents(3);
  displacement->InsertTuples(0, count, 0, moved);
  surface->GetPointData()->AddArray(displacement);
  WritePolyData(path, surface, this->Messages);
}

vtkUnstructuredGrid* vtkPosingModel::Skin() const
{
  return vtkUnstructuredGrid::SafeDownCast(
    const_cast<vtkSkinDeformation*>(this->Deformer.Get())->GetOutputDataObject(0));
}

void vtkPosingModel::Show(const vtkSmartPointer<vtkPolyData>& pose, bool repair)
{
  try
  {
    this->Deform(pose, repair);
  }
  catch (...)
  {
    if (this->Current)
    {
      this->Deform(this->Current, this->Settings_.repair);
    }
    throw;
  }
  this->Current = pose;
}

void vtkPosingModel::Deform(vtkPolyData* pose, bool repair)
{
  const auto begin = std::chrono::steady_clock::now();
  this->Deformer->SetInputData(2, pose);
  this->Deformer->SetBlend(this->Settings_.dualQuaternions ? vtkSkinDeformation::DualQuaternion
                                                           : vtkSkinDeformation::LinearBlend);
  this->Deformer->SetStretch(this->Settings_.stretch);
  this->Deformer->SetVolumeConservation(this->Settings_.keepVolume ? 1.0 : 0.0);
  this->Deformer->SetTetrahedra(
    repair ? vtkSkinDeformation::RepairTetrahedra : vtkSkinDeformation::CheckTetrahedra);
  this->Deformer->Update();
  this->Messages.ThrowIfError();
  // That tetrahedra are inverted is in the report.
  this->Messages.ForgetWarnings();
  this->MakeReport(pose);
  this->Report_.deformationMilliseconds =
    std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

void vtkPosingModel::MakeReport(vtkPolyData* pose)
{
  PosingReport report;
  vtkUnstructuredGrid* skin = this->Skin();
  auto* moved = vtkFloatArray::SafeDownCast(skin->GetPointData()->GetArray(names::Displacement));
  for (vtkIdType n = 0; n < moved->GetNumberOfTuples(); ++n)
  {
    const float* value = moved->GetPointer(3 * n);
    const double length = std::hypot(value[0], value[1], value[2]);
    report.maximumDisplacement = std::max(report.maximumDisplacement, length);
  }
  auto* ratios = vtkDoubleArray::SafeDownCast(skin->GetCellData()->GetArray(names::VolumeRatio));
  for (vtkIdType n = 0; ratios && n < ratios->GetNumberOfTuples(); ++n)
  {
    const double ratio = ratios->GetValue(n);
    if (std::isnan(ratio)) // no tetrahedron
    {
      continue;
    }
    report.minimumVolumeRatio = std::min(report.minimumVolumeRatio, ratio);
    report.maximumVolumeRatio = std::max(report.maximumVolumeRatio, ratio);
  }
  report.inverted =
    skin->GetFieldData()->GetAbstractArray(names::InvertedTetrahedra)->GetNumberOfValues();
  report.repaired = static_cast<std::int64_t>(
    skin->GetFieldData()->GetArray(names::RepairedTetrahedra)->GetComponent(0, 0));
  const std::vector<Skeleton::Bone>& bones = this->Rig.Rest().bones;
  for (std::size_t b = 0; b < bones.size(); ++b)
  {
    const double length = (PointOf(pose, bones[b].second) - PointOf(pose, bones[b].first)).norm();
    const double strain = length / this->Rig.Length(static_cast<std::int64_t>(b)) - 1.0;
    report.maximumStrain = std::max(report.maximumStrain, std::abs(strain));
  }
  this->Report_ = report;
}

PosingMove PosingMoveOf(const std::string& text)
{
  PosingMove move;
  long long joint = -1;
  char rest = 0;
  Vector3& by = move.millimetres;
  const bool good = std::sscanf(text.c_str(), "%18lld:%lf,%lf,%lf%c", &joint, &by.x(), &by.y(),
                      &by.z(), &rest) == 4 &&
    joint >= 0 && by.allFinite();
  if (!good)
  {
    throw std::invalid_argument(
      "'" + text + "' is no move: JOINT:DX,DY,DZ is wanted, a number of a joint and mm");
  }
  move.joint = joint;
  return move;
}

void PoseWithoutWindow(const std::string& folder, const PosingOptions& options, bool quiet)
{
  vtkMessageTrap messages;
  vtkPosingModel model(folder, messages);
  model.SetSettings(options.settings);
  if (!options.start.empty())
  {
    model.ReadPose(options.start);
  }
  for (const PosingMove& move : options.moves)
  {
    model.Choose(move.joint);
    model.Move(move.millimetres);
  }
  if (!options.output.empty())
  {
    model.WritePose(options.output);
  }
  if (!options.surface.empty())
  {
    model.WriteSurface(options.surface);
  }
  if (!quiet)
  {
    const PosingReport& report = model.Report();
    std::printf("%zu moves: greatest displacement %.2f mm, greatest strain of a bone %.2f, volume "
                "ratios %.2f to %.2f, %lld tetrahedra inverted, %lld repaired\n",
      options.moves.size(), report.maximumDisplacement, report.maximumStrain,
      report.minimumVolumeRatio, report.maximumVolumeRatio, static_cast<long long>(report.inverted),
      static_cast<long long>(report.repaired));
  }
}
}
