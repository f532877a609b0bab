#include "vtkSkinDeformation.h"

#include "PartialProgress.h"
#include "SkinDeformation.h"
#include "vtkBoneMotion.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkSkeletonForms.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCellType.h"
#include "vtkCompositeDataIterator.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdTypeArray.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <list>
#include <stdexcept>
#include <type_traits>
#include <vector>

namespace names = vtkCoronaryArrayNames;
using coronary::LoopReport;
using coronary::ProgressCallback;
using coronary::Vector3;
using vtkCoronary::Require;
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace
{
/// Blocks of a composite mesh that are remembered.
constexpr std::size_t RememberedSetups = 32;

/// What a setup was made of: the objects are kept, so that their addresses stay their own.
struct Origin
{
  std::vector<vtkSmartPointer<vtkObject>> objects;
  std::vector<vtkMTimeType> times;
  std::array<int, 2> settings{};

  void Add(vtkObject* object)
  {
    this->objects.emplace_back(object);
    this->times.push_back(object ? object->GetMTime() : 0);
  }

  bool operator==(const Origin& other) const
  {
    return this->settings == other.settings && this->objects == other.objects &&
      this->times == other.times;
  }
};

/// One mesh at rest with its weights.
struct Setup
{
  Origin origin;
  std::unique_ptr<coronary::SkinDeformation> skin;
  bool hasTriangles = false;
  bool hasTetrahedra = false;
  std::vector<vtkIdType> cells; ///< of the tetrahedra
  coronary::InversionReport report;
};

vtkDataArray* WeightArray(vtkPointSet* mesh, const std::string& name)
{
  auto* any = mesh->GetPointData()->GetAbstractArray(name.c_str());
  Require(any != nullptr, "The mesh has no point array '" + name + "': weights of its bones");
  auto* array = vtkArrayDownCast<vtkDataArray>(any);
  Require(array != nullptr && array->GetNumberOfTuples() == mesh->GetNumberOfPoints(),
    "Point array '" + name + "' of the mesh has not numbers for every point");
  return array;
}

coronary::CompactSkinWeights WeightsOf(vtkPointSet* mesh, const std::string& indicesName,
  const std::string& weightsName, const ProgressCallback& progress)
{
  vtkDataArray* indices = WeightArray(mesh, indicesName);
  vtkDataArray* weights = WeightArray(mesh, weightsName);
  Require(indices->GetNumberOfComponents() == weights->GetNumberOfComponents(),
    "Point array '" + indicesName + "' has " + std::to_string(indices->GetNumberOfComponents()) +
      " components, '" + weightsName + "' has " + std::to_string(weights->GetNumberOfComponents()));
  coronary::CompactSkinWeights compact;
  compact.influences = weights->GetNumberOfComponents();
  const auto size = static_cast<std::size_t>(mesh->GetNumberOfPoints()) * compact.influences;
  compact.bone.reserve(size);
  compact.weight.reserve(size);
  LoopReport report(progress, mesh->GetNumberOfPoints());
  for (vtkIdType n = 0; n < mesh->GetNumberOfPoints(); ++n)
  {
    report(n);
    for (int c = 0; c < compact.influences; ++c)
    {
      const double index = indices->GetComponent(n, c);
      // No bone, where an index is no number: the algorithm says of which point.
      compact.bone.push_back(
        std::abs(index) < 1e9 ? static_cast<std::int32_t>(index) : std::int32_t{ -1 });
      compact.weight.push_back(static_cast<float>(weights->GetComponent(n, c)));
    }
  }
  return compact;
}

std::vector<coronary::Triangle> TrianglesOf(vtkPolyData* surface, const ProgressCallback& progress)
{
  std::vector<coronary::Triangle> triangles;
  LoopReport report(progress, surface->GetNumberOfPolys() + surface->GetNumberOfStrips());
  vtkIdType count = 0;
  const vtkIdType* ids = nullptr;
  for (vtkIdType cell = 0; cell < surface->GetNumberOfPolys(); ++cell)
  {
    report(cell);
    surface->GetPolys()->GetCellAtId(cell, count, ids);
    for (vtkIdType i = 2; i < count; ++i)
    {
      triangles.push_back({ ids[0], ids[i - 1], ids[i] });
    }
  }
  for (vtkIdType cell = 0; cell < surface->GetNumberOfStrips(); ++cell)
  {
    report(surface->GetNumberOfPolys() + cell);
    surface->GetStrips()->GetCellAtId(cell, count, ids);
    for (vtkIdType i = 2; i < count; ++i)
    {
      const vtkIdType odd = i % 2;
      triangles.push_back({ ids[i - 2 + odd], ids[i - 1 - odd], ids[i] });
    }
  }
  return triangles;
}

std::vector<std::array<std::int64_t, 4>> TetrahedraOf(
  vtkUnstructuredGrid* grid, std::vector<vtkIdType>& cells, const ProgressCallback& progress)
{
  std::vector<std::array<std::int64_t, 4>> tetrahedra;
  LoopReport report(progress, grid->GetNumberOfCells());
  for (vtkIdType cell = 0; cell < grid->GetNumberOfCells(); ++cell)
  {
    report(cell);
    if (grid->GetCellType(cell) == VTK_TETRA)
    {
      vtkIdType count = 0;
      const vtkIdType* ids = nullptr;
      grid->GetCells()->GetCellAtId(cell, count, ids);
      tetrahedra.push_back({ ids[0], ids[1], ids[2], ids[3] });
      cells.push_back(cell);
    }
  }
  return tetrahedra;
}

/// Share of the source's range of times between the poses that a velocity is taken from. Small against the
/// fastest waves of the motion, large against the rounding of coordinates in single precision.
constexpr double ContinuousStep = 1e-3;

/// The time steps before and after the nearest one.
bool StepsAround(vtkInformation* inInfo, double time, double& before, double& after)
{
  const int count = inInfo->Has(SDDP::TIME_STEPS()) ? inInfo->Length(SDDP::TIME_STEPS()) : 0;
  if (count < 2)
  {
    return false;
  }
  const double* steps = inInfo->Get(SDDP::TIME_STEPS());
  int nearest = 0;
  for (int n = 1; n < count; ++n)
  {
    nearest = std::abs(steps[n] - time) < std::abs(steps[nearest] - time) ? n : nearest;
  }
  before = steps[std::max(0, nearest - 1)];
  after = steps[std::min(count - 1, nearest + 1)];
  return after != before;
}

bool SamePoints(vtkPointSet* a, vtkPointSet* b)
{
  if (a->GetNumberOfPoints() != b->GetNumberOfPoints())
  {
    return false;
  }
  for (vtkIdType n = 0; n < a->GetNumberOfPoints(); ++n)
  {
    std::array<double, 3> here{};
    std::array<double, 3> there{};
    a->GetPoint(n, here.data());
    b->GetPoint(n, there.data());
    if (here != there)
    {
      return false;
    }
  }
  return true;
}

/// A pose at another time, copied: the connection's data object is filled anew by each request.
struct OtherPose
{
  vtkSmartPointer<vtkPolyData> pose;
  double time = 0.0;
  bool isOfThatTime = false; ///< not of the nearest one that there is

  explicit operator bool() const { return this->pose != nullptr && this->isOfThatTime; }
};

OtherPose PoseAt(vtkCoronary::UpstreamRequest& request, vtkInformation* inInfo, double time)
{
  request.Ask(nullptr, { true, time });
  vtkDataObject* data = inInfo->Get(vtkDataObject::DATA_OBJECT());
  OtherPose other;
  other.pose = vtkSmartPointer<vtkPolyData>::New();
  other.pose->DeepCopy(data);
  other.time = time;
  const double* range = inInfo->Get(SDDP::TIME_RANGE());
  if (data->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
  {
    const double actual = data->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP());
    other.isOfThatTime = std::abs(actual - time) <= 1e-9 * (1.0 + std::abs(time));
  }
  else
  {
    other.isOfThatTime = range && time >= range[0] && time <= range[1];
  }
  return other;
}

/// Whether the pose says itself what time it is of, beside what the pipeline says.
bool NamesItsTime(const OtherPose& other)
{
  vtkDataArray* phase = other.pose->GetFieldData()->GetArray(names::PhaseTime);
  return phase && phase->GetNumberOfValues() == 1 && phase->GetComponent(0, 0) == other.time;
}
}

/// Where the velocity is from: the pose tells it, or poses at other times, on both sides or two on one side.
struct vtkSkinDeformation::Stencil
{
  bool told = false;
  OtherPose first;
  OtherPose second;
  bool oneSided = false;
  double now = 0.0;
  double cycle = 1.0; ///< seconds per unit of time
  bool Exists() const { return this->first.pose != nullptr; }

  /// By the parabola through the three poses, or the line through the two others.
  coronary::MovingSkeletonPose Differentiate(
    vtkPolyData* data, const coronary::SkeletonRig& rig) const
  {
    const coronary::SkeletonPose pose = vtkSkeletonForms::PoseOf(data, rig);
    const coronary::SkeletonPose one = vtkSkeletonForms::PoseOf(this->first.pose, rig);
    const coronary::SkeletonPose other = vtkSkeletonForms::PoseOf(this->second.pose, rig);
    if (this->oneSided)
    {
      const double seconds = (this->first.time - this->now) * this->cycle;
      return coronary::Differentiate(pose, { { &one, 2.0 / seconds }, { &other, -0.5 / seconds } });
    }
    const double seconds = (this->second.time - this->first.time) * this->cycle;
    return coronary::Differentiate(pose, { { &one, -1.0 / seconds }, { &other, 1.0 / seconds } });
  }
};

struct vtkSkinDeformation::Internals
{
  std::list<Setup> Setups; ///< the one that was used last comes first
  int NumberOfSetups = 0;
  vtkMTimeType StepsOnly = 0; ///< upstream's, that has poses at its steps only

  /// The setup of that origin, which then is the first one; null when there is none.
  Setup* Find(const Origin& origin);
  Setup& Make(const Origin& origin, vtkSkinDeformation* self, vtkPointSet* mesh, vtkPolyData* rest,
    const ProgressCallback& progress);
};

Setup* vtkSkinDeformation::Internals::Find(const Origin& origin)
{
  const auto found = std::find_if(this->Setups.begin(), this->Setups.end(),
    [&](const Setup& setup) { return setup.origin == origin; });
  if (found == this->Setups.end())
  {
    return nullptr;
  }
  this->Setups.splice(this->Setups.begin(), this->Setups, found);
  return &this->Setups.front();
}

Setup& vtkSkinDeformation::Internals::Make(const Origin& origin, vtkSkinDeformation* self,
  vtkPointSet* mesh, vtkPolyData* rest, const ProgressCallback& progress)
{
  const coronary::WorkParts parts(progress, { 0.1, 0.2, 0.7 });
  Setup setup;
  setup.origin = origin;
  const ProgressCallback pointProgress = parts(0);
  LoopReport report(pointProgress, mesh->GetNumberOfPoints());
  std::vector<Vector3> points;
  points.reserve(mesh->GetNumberOfPoints());
  for (vtkIdType n = 0; n < mesh->GetNumberOfPoints(); ++n)
  {
    report(n);
    points.emplace_back(mesh->GetPoint(n));
  }
  coronary::SkinDeformationSettings settings;
  settings.blend = static_cast<coronary::SkinBlend>(self->Blend);
  settings.stretch = self->Stretch;
  setup.skin = std::make_unique<coronary::SkinDeformation>(points,
    WeightsOf(mesh, names::BoneIndices, names::BoneWeightsCompact, parts(1)),
    vtkSkeletonForms::SkeletonOf(rest, "the skeleton at rest"), settings, parts(2));
  this->Setups.push_front(std::move(setup));
  ++this->NumberOfSetups;
  if (this->Setups.size() > RememberedSetups)
  {
    this->Setups.pop_back();
  }
  return this->Setups.front();
}

vtkStandardNewMacro(vtkSkinDeformation);

vtkSkinDeformation::vtkSkinDeformation()
  : Data(new Internals)
{
  this->SetNumberOfInputPorts(3);
}

vtkSkinDeformation::~vtkSkinDeformation() = default;

int vtkSkinDeformation::GetNumberOfSetups() const
{
  return this->Data->NumberOfSetups;
}

int vtkSkinDeformation::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), port == 0 ? "vtkPointSet" : "vtkPolyData");
  if (port == 0)
  {
    // Not left to the executive: after its loop over blocks it forgets the time of the pose.
    info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkCompositeDataSet");
  }
  return 1;
}

int vtkSkinDeformation::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(0);
  vtkInformation* pose = inputs[2]->GetInformationObject(0);
  // The mesh is that at rest, whatever its time: only the pose moves.
  outInfo->Remove(SDDP::TIME_STEPS());
  outInfo->Remove(SDDP::TIME_RANGE());
  outInfo->CopyEntry(pose, SDDP::TIME_STEPS());
  outInfo->CopyEntry(pose, SDDP::TIME_RANGE());
  return 1;
}

int vtkSkinDeformation::RequestUpdateExtent(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  // Every piece of the mesh needs the whole skeleton.
  for (const int port : { 1, 2 })
  {
    vtkInformation* info = inputs[port]->GetInformationObject(0);
    info->Set(SDDP::UPDATE_PIECE_NUMBER(), 0);
    info->Set(SDDP::UPDATE_NUMBER_OF_PIECES(), 1);
    info->Set(SDDP::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
  }
  return 1;
}

void vtkSkinDeformation::FindStencil(vtkInformation* poseInfo, Stencil& stencil)
{
  vtkPolyData* pose = vtkPolyData::GetData(poseInfo);
  if (pose->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
  {
    stencil.now = pose->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP());
  }
  else if (poseInfo->Has(SDDP::UPDATE_TIME_STEP()))
  {
    stencil.now = poseInfo->Get(SDDP::UPDATE_TIME_STEP());
  }
  vtkDataArray* cycle = pose->GetFieldData()->GetArray(names::CycleLength);
  stencil.cycle = cycle && cycle->GetNumberOfValues() > 0 ? cycle->GetComponent(0, 0) : 1.0;
  // At the end every pose is that of the request again.
  vtkCoronary::UpstreamRequest request(poseInfo, poseInfo);
  const vtkMTimeType upstream = vtkCoronary::UpstreamTime(poseInfo);
  const double* range = poseInfo->Get(SDDP::TIME_RANGE());
  const double step = range ? ContinuousStep * (range[1] - range[0]) : 0.0;
  if (range && step > 0.0 && (upstream == 0 || upstream != this->Data->StepsOnly))
  {
    const auto ask = [&](double steps)
    { return PoseAt(request, poseInfo, stencil.now + steps * step); };
    // Beyond its range a periodic source answers too.
    stencil.second = ask(1.0);
    if (stencil.second || stencil.now + step > range[1])
    {
      stencil.first = ask(-1.0);
    }
    if (!stencil.second != !stencil.first)
    {
      // The end of the range.
      const double side = stencil.second ? 1.0 : -1.0;
      stencil.oneSided = true;
      stencil.first = stencil.second ? stencil.second : stencil.first;
      stencil.second = ask(2.0 * side);
    }
    // A source may call the nearest step by the name of the time that it was asked for.
    if (stencil.first && stencil.second &&
      (!SamePoints(stencil.first.pose, stencil.second.pose) || NamesItsTime(stencil.first)))
    {
      request.Restore();
      return;
    }
    this->Data->StepsOnly = upstream;
  }
  stencil.first = {};
  stencil.second = {};
  stencil.oneSided = false;
  double before = 0.0;
  double after = 0.0;
  if (StepsAround(poseInfo, stencil.now, before, after))
  {
    stencil.first = PoseAt(request, poseInfo, before);
    stencil.second = PoseAt(request, poseInfo, after);
  }
  request.Restore();
}

namespace
{
Origin OriginOf(vtkPointSet* mesh, vtkObject* indices, vtkObject* weights, vtkPolyData* rest,
  const std::array<int, 2>& settings)
{
  auto* surface = vtkPolyData::SafeDownCast(mesh);
  auto* grid = vtkUnstructuredGrid::SafeDownCast(mesh);
  Origin origin;
  origin.settings = settings;
  origin.Add(mesh->GetPoints());
  origin.Add(indices);
  origin.Add(weights);
  origin.Add(rest->GetPoints());
  origin.Add(rest->GetLines());
  origin.Add(rest->GetPointData()->GetAbstractArray(names::ParentJoint));
  origin.Add(grid ? grid->GetCells() : nullptr);
  origin.Add(surface ? surface->GetPolys() : nullptr);
  origin.Add(surface ? surface->GetStrips() : nullptr);
  return origin;
}

/// Those of the mesh at rest.
void RemoveNormals(vtkPointSet* output)
{
  for (vtkDataSetAttributes* attributes :
    { static_cast<vtkDataSetAttributes*>(output->GetPointData()),
      static_cast<vtkDataSetAttributes*>(output->GetCellData()) })
  {
    if (attributes->GetNormals() != nullptr)
    {
      const std::string name =
        attributes->GetNormals()->GetName() ? attributes->GetNormals()->GetName() : "";
      attributes->SetNormals(nullptr);
      attributes->RemoveArray(name.c_str());
    }
  }
}

/// Ratios of volumes, and which tetrahedra are inverted.
/// @return cells that still are
std::vector<vtkIdType> ReportTetrahedra(const Setup& setup, vtkPointSet* output)
{
  const coronary::InversionReport& report = setup.report;
  vtkNew<vtkDoubleArray> ratios;
  ratios->SetName(names::VolumeRatio);
  ratios->SetNumberOfValues(output->GetNumberOfCells());
  ratios->Fill(std::numeric_limits<double>::quiet_NaN());
  for (std::size_t n = 0; n < setup.cells.size(); ++n)
  {
    ratios->SetValue(setup.cells[n], setup.skin->VolumeRatios()[n]);
  }
  output->GetCellData()->AddArray(ratios);
  std::vector<vtkIdType> left;
  for (const std::int64_t n : report.tetrahedra)
  {
    left.push_back(setup.cells[n]);
  }
  vtkCoronary::AddArray<vtkIdTypeArray>(output->GetFieldData(), names::InvertedTetrahedra, left);
  const auto gone = static_cast<vtkIdType>(report.found) - static_cast<vtkIdType>(left.size());
  vtkCoronary::AddArray<vtkIdTypeArray>(output->GetFieldData(), names::RepairedTetrahedra,
    std::vector<vtkIdType>{ std::max<vtkIdType>(0, gone) });
  return left;
}
}

template <typename Array>
void vtkSkinDeformation::Execute(vtkPointSet* mesh, vtkInformationVector** inputs,
  const Stencil& stencil, vtkPointSet* output, const ProgressCallback& progress)
{
  vtkPolyData* rest = vtkPolyData::GetData(inputs[1], 0);
  const vtkIdType count = mesh->GetNumberOfPoints();
  auto* surface = vtkPolyData::SafeDownCast(mesh);
  auto* grid = vtkUnstructuredGrid::SafeDownCast(mesh);
  // In this order: what is missing first is named.
  vtkDataArray* indices = WeightArray(mesh, names::BoneIndices);
  vtkDataArray* weights = WeightArray(mesh, names::BoneWeightsCompact);
  const Origin origin =
    OriginOf(mesh, indices, weights, rest, { this->Blend, this->Stretch ? 1 : 0 });
  Setup* known = this->Data->Find(origin);

  const bool withTriangles = surface && this->ComputeNormals;
  const bool withTetrahedra = grid && this->Tetrahedra != IgnoreTetrahedra;
  const bool newTriangles = withTriangles && !(known && known->hasTriangles);
  const bool newTetrahedra = withTetrahedra && !(known && known->hasTetrahedra);
  enum Part
  {
    SettingUp,
    ReadingTriangles,
    ReadingTetrahedra,
    Deforming,
    Checking,
    Displacing,
    Shading
  };
  const coronary::WorkParts parts(progress,
    { known ? 0.0 : 8.0, newTriangles ? 2.0 : 0.0, newTetrahedra ? 4.0 : 0.0,
      this->ComputeVelocity ? 4.0 : 2.0, withTetrahedra ? 3.0 : 0.0, 0.5,
      withTriangles ? 1.0 : 0.0 });
  Setup& setup = known ? *known : this->Data->Make(origin, this, mesh, rest, parts(SettingUp));
  coronary::SkinDeformation& skin = *setup.skin;
  if (newTriangles)
  {
    const ProgressCallback part = parts(ReadingTriangles);
    skin.SetTriangles(
      TrianglesOf(surface, coronary::PartOf(part, 0.0, 0.4)), coronary::PartOf(part, 0.4, 1.0));
    setup.hasTriangles = true;
  }
  if (newTetrahedra)
  {
    const ProgressCallback part = parts(ReadingTetrahedra);
    setup.cells.clear();
    skin.SetTetrahedra(TetrahedraOf(grid, setup.cells, coronary::PartOf(part, 0.0, 0.3)),
      coronary::PartOf(part, 0.3, 1.0));
    setup.hasTetrahedra = true;
  }

  const auto makeArray = [&](const char* name)
  {
    auto array = vtkSmartPointer<Array>::New();
    array->SetName(name);
    array->SetNumberOfComponents(3);
    array->SetNumberOfTuples(count);
    return array;
  };
  vtkPolyData* poseData = vtkPolyData::GetData(inputs[2], 0);
  skin.SetVolumeConservation(this->VolumeConservation);
  const auto positions = makeArray("Points");
  vtkSmartPointer<Array> velocity;
  if (stencil.told || stencil.Exists())
  {
    velocity = makeArray(names::Velocity);
    skin.Deform(stencil.told ? vtkSkeletonForms::MovingPoseOf(poseData, skin.Rig())
                             : stencil.Differentiate(poseData, skin.Rig()),
      positions->GetPointer(0), velocity->GetPointer(0), parts(Deforming));
  }
  else
  {
    skin.Deform(
      vtkSkeletonForms::PoseOf(poseData, skin.Rig()), positions->GetPointer(0), parts(Deforming));
  }
  output->ShallowCopy(mesh);
  vtkNew<vtkPoints> points;
  points->SetData(positions);
  output->SetPoints(points);
  RemoveNormals(output);
  output->GetFieldData()->PassData(poseData->GetFieldData());
  std::vector<coronary::BoneTransform> bones = skin.Bones();
  if (!this->Stretch)
  {
    for (coronary::BoneTransform& bone : bones)
    {
      bone.stretch = 1.0;
    }
  }
  vtkBoneMotion::Set(output->GetFieldData(), skin.Rig(), bones);

  if (withTetrahedra)
  {
    if (this->Tetrahedra == RepairTetrahedra)
    {
      skin.RepairTetrahedra(
        positions->GetPointer(0), setup.report, this->MinimumVolumeRatio, parts(Checking));
    }
    else
    {
      skin.CheckTetrahedra(
        positions->GetPointer(0), setup.report, this->MinimumVolumeRatio, parts(Checking));
    }
    const std::vector<vtkIdType> left = ReportTetrahedra(setup, output);
    if (!left.empty())
    {
      vtkWarningMacro(<< left.size() << " tetrahedra are inverted"
                      << (this->Tetrahedra == RepairTetrahedra ? " after the repair, " +
                               std::to_string(setup.report.found) + " were before it"
                                                               : std::string())
                      << "; the first one is cell " << left[0]
                      << ": see the field array InvertedTetrahedra");
    }
  }
  const auto displacement = makeArray(names::Displacement);
  skin.Displacements(positions->GetPointer(0), displacement->GetPointer(0), parts(Displacing));
  output->GetPointData()->AddArray(displacement);
  if (velocity)
  {
    output->GetPointData()->AddArray(velocity);
  }
  if (withTriangles)
  {
    const auto normals = makeArray("Normals");
    skin.NormalsOf(positions->GetPointer(0), normals->GetPointer(0), parts(Shading));
    output->GetPointData()->SetNormals(normals);
  }
}

void vtkSkinDeformation::Execute(vtkDataObject* mesh, vtkInformationVector** inputs,
  const Stencil& stencil, vtkDataObject* output, const ProgressCallback& progress)
{
  auto* points = vtkPointSet::SafeDownCast(mesh);
  if (points == nullptr || points->GetNumberOfPoints() == 0)
  {
    output->ShallowCopy(mesh);
  }
  else if (this->DoublePrecision)
  {
    this->Execute<vtkDoubleArray>(
      points, inputs, stencil, vtkPointSet::SafeDownCast(output), progress);
  }
  else
  {
    this->Execute<vtkFloatArray>(
      points, inputs, stencil, vtkPointSet::SafeDownCast(output), progress);
  }
}

int vtkSkinDeformation::RequestData(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkDataObject* mesh = vtkDataObject::GetData(inputs[0], 0);
  vtkDataObject* output = vtkDataObject::GetData(outputs, 0);
  try
  {
    Require(this->VolumeConservation >= 0.0 && this->VolumeConservation <= 1.0,
      "VolumeConservation must be 0 to 1");
    Require(this->MinimumVolumeRatio >= 0.0 && this->MinimumVolumeRatio <= 0.5,
      "MinimumVolumeRatio must be 0 to 0.5");
    Stencil stencil;
    const bool wanted =
      this->ComputeVelocity && mesh->GetNumberOfElements(vtkDataObject::POINT) > 0;
    stencil.told = wanted && vtkSkeletonForms::TellsVelocity(vtkPolyData::GetData(inputs[2], 0));
    if (wanted && !stencil.told)
    {
      this->FindStencil(inputs[2]->GetInformationObject(0), stencil);
      if (!stencil.Exists())
      {
        vtkWarningMacro("The pose has no times around this one: no velocity");
      }
    }
    if (auto* blocks = vtkCompositeDataSet::SafeDownCast(mesh))
    {
      auto* moved = vtkCompositeDataSet::SafeDownCast(output);
      moved->CopyStructure(blocks);
      moved->GetFieldData()->PassData(blocks->GetFieldData());
      const auto leaf = vtkSmartPointer<vtkCompositeDataIterator>::Take(blocks->NewIterator());
      const auto total = static_cast<double>(std::max<vtkIdType>(1, blocks->GetNumberOfPoints()));
      double done = 0.0;
      for (leaf->InitTraversal(); !leaf->IsDoneWithTraversal(); leaf->GoToNextItem())
      {
        vtkDataObject* block = leaf->GetCurrentDataObject();
        const double next =
          done + static_cast<double>(block->GetNumberOfElements(vtkDataObject::POINT)) / total;
        const ProgressCallback progress = vtkCoronary::ProgressOf(this, done, next);
        const auto result = vtkSmartPointer<vtkDataObject>::Take(block->NewInstance());
        this->Execute(block, inputs, stencil, result, progress);
        moved->SetDataSet(leaf, result);
        done = next;
      }
    }
    else
    {
      this->Execute(mesh, inputs, stencil, output, vtkCoronary::ProgressOf(this));
    }
    vtkDataObject* pose = vtkDataObject::GetData(inputs[2], 0);
    if (pose->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
    {
      output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(),
        pose->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()));
    }
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the deformation");
  }
}

void vtkSkinDeformation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Blend: " << this->Blend << '\n';
  os << indent << "Stretch: " << this->Stretch << '\n';
  os << indent << "VolumeConservation: " << this->VolumeConservation << '\n';
  os << indent << "DoublePrecision: " << this->DoublePrecision << '\n';
  os << indent << "ComputeVelocity: " << this->ComputeVelocity << '\n';
  os << indent << "ComputeNormals: " << this->ComputeNormals << '\n';
  os << indent << "Tetrahedra: " << this->Tetrahedra << '\n';
  os << indent << "MinimumVolumeRatio: " << this->MinimumVolumeRatio << '\n';
}
