#include "vtkCoronaryPhantomSource.h"

#include "CoronaryPhantom.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataObjectTypes.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkShortArray.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkTimeStamp.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

struct vtkCoronaryPhantomSource::Internals
{
  coronary::PhantomSettings Settings;
  std::string Diseases; ///< presets, apart by commas
  vtkTimeStamp SettingsTime;
  std::vector<double> Phases = coronary::PaperPhases();

  const coronary::CoronaryPhantom& Phantom()
  {
    if (!this->Built || this->BuiltTime < this->SettingsTime)
    {
      this->Built.reset();
      this->BoxSpacing = 0.0;
      coronary::PhantomSettings settings = this->Settings;
      std::istringstream names(this->Diseases);
      for (std::string name; std::getline(names, name, ',');)
      {
        try
        {
          coronary::AddDisease(name, settings);
        }
        catch (const std::invalid_argument& error)
        {
          throw std::invalid_argument(std::string("Diseases: ") + error.what());
        }
      }
      this->Built = std::make_unique<coronary::CoronaryPhantom>(settings);
      this->BuiltTime.Modified();
    }
    return *this->Built;
  }

  /// The phantom's own grid at a spacing; it follows the tree over the whole cycle to find it.
  const coronary::ImageGrid& Box(double spacing)
  {
    const coronary::CoronaryPhantom& phantom = this->Phantom();
    if (spacing != this->BoxSpacing)
    {
      this->BoxGrid = phantom.DefaultGrid(spacing);
      this->BoxSpacing = spacing;
    }
    return this->BoxGrid;
  }

private:
  std::unique_ptr<coronary::CoronaryPhantom> Built;
  vtkTimeStamp BuiltTime;
  coronary::ImageGrid BoxGrid;
  double BoxSpacing = 0.0;
};

namespace
{
constexpr double MinimumSpacing = 0.05;
constexpr double MaximumSpacing = 20.0;
constexpr int MaximumDimension = 16384;

bool AllFinite(const double* values, int count)
{
  return std::all_of(values, values + count, [](double value) { return std::isfinite(value); });
}

/// The algorithm's complaint, with the setting called by the property's name.
void CheckPhases(const std::vector<double>& phases)
{
  vtkCoronary::Require(!phases.empty(), "Phases: at least one is needed");
  vtkCoronary::Require(
    AllFinite(phases.data(), static_cast<int>(phases.size())), "Phases must be finite");
  vtkCoronary::Require(
    std::adjacent_find(phases.begin(), phases.end(), std::greater_equal<>()) == phases.end(),
    "Phases must be strictly increasing");
}

/// Covers the box of `inner` by a grid of another spacing and direction.
coronary::ImageGrid Cover(
  const coronary::ImageGrid& inner, const Vector3& spacing, const coronary::Matrix3& direction)
{
  const std::array<int, 6>& e = inner.extent;
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::max());
  Vector3 high = -low;
  for (int corner = 0; corner < 8; ++corner)
  {
    const Vector3 world =
      inner.IndexToWorld(e[corner & 1], e[2 + (corner >> 1 & 1)], e[4 + (corner >> 2)]);
    const Vector3 local = direction.transpose() * world;
    low = low.cwiseMin(local);
    high = high.cwiseMax(local);
  }
  coronary::ImageGrid grid;
  grid.origin = direction * low;
  grid.spacing = spacing;
  grid.direction = direction;
  for (int axis = 0; axis < 3; ++axis)
  {
    // Rounding must not add a voxel where the box is a whole number of them.
    const double steps = std::ceil((high[axis] - low[axis]) / spacing[axis] - 1e-6);
    vtkCoronary::Require(steps < MaximumDimension, "Spacing is too small for the automatic grid");
    grid.extent[2 * axis] = 0;
    grid.extent[2 * axis + 1] = static_cast<int>(steps);
  }
  return grid;
}

vtkSmartPointer<vtkDoubleArray> MakeVectors(const std::vector<Vector3>& vectors)
{
  auto array = vtkSmartPointer<vtkDoubleArray>::New();
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(static_cast<vtkIdType>(vectors.size()));
  double* values = array->GetPointer(0);
  for (const Vector3& vector : vectors)
  {
    values = std::copy_n(vector.data(), 3, values);
  }
  return array;
}

void AddVectors(vtkFieldData* fields, const char* name, const std::vector<Vector3>& vectors)
{
  const vtkSmartPointer<vtkDoubleArray> array = MakeVectors(vectors);
  array->SetName(name);
  fields->AddArray(array);
}

vtkSmartPointer<vtkPoints> MakePoints(const std::vector<Vector3>& positions)
{
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetData(MakeVectors(positions));
  return points;
}

template <typename Indices>
void AddCell(vtkCellArray* cells, const Indices& indices)
{
  cells->InsertNextCell(static_cast<int>(indices.size()));
  for (const std::int64_t index : indices)
  {
    cells->InsertCellPoint(static_cast<vtkIdType>(index));
  }
}

void SetTime(vtkDataObject* data, double time, double cycleLength)
{
  data->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
  vtkCoronary::AddArray<vtkDoubleArray>(
    data->GetFieldData(), vtkCoronaryArrayNames::CycleLength, std::vector<double>{ cycleLength });
  vtkCoronary::AddArray<vtkDoubleArray>(
    data->GetFieldData(), vtkCoronaryArrayNames::PhaseTime, std::vector<double>{ time });
}

void FillTree(const coronary::PhantomTree& tree, vtkPolyData* output)
{
  namespace names = vtkCoronaryArrayNames;
  vtkCoronary::SetTree(output, tree, vtkCoronary::BranchArrays::Named);
  vtkPointData* points = output->GetPointData();
  vtkCoronary::AddArray<vtkIntArray>(points, names::SegmentIds, tree.segmentId);
  AddVectors(points, names::Displacement, tree.displacement);
  AddVectors(points, names::Velocity, tree.velocity);
  vtkCoronary::AddArray<vtkDoubleArray>(points, names::Visibility, tree.visibility);
}

std::vector<Vector3> SurfaceVelocity(const coronary::CoronaryPhantom& phantom,
  const coronary::PhantomSurface& surface, double time, const coronary::ProgressCallback& progress)
{
  std::vector<Vector3> velocity(surface.points.size());
  coronary::ParallelFor(
    static_cast<std::int64_t>(velocity.size()), 1024,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        velocity[i] = phantom.Velocity(surface.points[i] - surface.displacement[i], time);
      }
    },
    progress);
  return velocity;
}

void FillSurface(const coronary::PhantomSurface& surface, const std::vector<Vector3>& velocity,
  vtkPolyData* output)
{
  namespace names = vtkCoronaryArrayNames;
  vtkNew<vtkCellArray> triangles;
  triangles->AllocateExact(
    static_cast<vtkIdType>(surface.triangles.size()), 3 * surface.triangles.size());
  for (const coronary::Triangle& triangle : surface.triangles)
  {
    AddCell(triangles, triangle);
  }
  output->SetPoints(MakePoints(surface.points));
  output->SetPolys(triangles);
  vtkCoronary::AddArray<vtkIntArray>(output->GetPointData(), names::GroupIds, surface.groupId);
  vtkCoronary::AddArray<vtkDoubleArray>(output->GetPointData(), names::Abscissas, surface.abscissa);
  AddVectors(output->GetPointData(), names::Displacement, surface.displacement);
  AddVectors(output->GetPointData(), names::Velocity, velocity);
  vtkCoronary::AddArray<vtkIntArray>(output->GetCellData(), names::CellEntityIds, surface.entityId);
}

void FillOstia(const std::vector<coronary::PhantomOstium>& ostia, vtkPolyData* output)
{
  std::vector<Vector3> positions;
  std::vector<Vector3> axes;
  std::vector<double> radii;
  std::vector<std::string> labels;
  vtkNew<vtkCellArray> vertices;
  for (const coronary::PhantomOstium& ostium : ostia)
  {
    AddCell(vertices, std::array<std::size_t, 1>{ positions.size() });
    positions.push_back(ostium.position);
    axes.push_back(ostium.axis);
    radii.push_back(ostium.radius);
    labels.push_back(ostium.name);
  }
  output->SetPoints(MakePoints(positions));
  output->SetVerts(vertices);
  vtkCoronary::AddArray<vtkStringArray>(
    output->GetPointData(), vtkCoronaryArrayNames::Name, labels);
  AddVectors(output->GetPointData(), vtkCoronaryArrayNames::Axis, axes);
  vtkCoronary::AddArray<vtkDoubleArray>(
    output->GetPointData(), vtkCoronaryArrayNames::Radius, radii);
}

void FillProbe(const coronary::CoronaryPhantom& phantom, double time, vtkPointSet* input,
  vtkPointSet* output, const coronary::ProgressCallback& progress)
{
  const vtkIdType count = input ? input->GetNumberOfPoints() : 0;
  std::vector<Vector3> positions(count);
  std::vector<Vector3> displacement(count);
  std::vector<Vector3> velocity(count);
  coronary::ParallelFor(
    count, 1024,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        Vector3 reference;
        input->GetPoint(static_cast<vtkIdType>(i), reference.data());
        positions[i] = phantom.Position(reference, time);
        displacement[i] = positions[i] - reference;
        velocity[i] = phantom.Velocity(reference, time);
      }
    },
    progress);
  if (input)
  {
    output->ShallowCopy(input);
  }
  output->SetPoints(MakePoints(positions));
  AddVectors(output->GetPointData(), vtkCoronaryArrayNames::Displacement, displacement);
  AddVectors(output->GetPointData(), vtkCoronaryArrayNames::Velocity, velocity);
}
}

vtkStandardNewMacro(vtkCoronaryPhantomSource);

vtkCoronaryPhantomSource::vtkCoronaryPhantomSource()
  : Data(std::make_unique<Internals>())
{
  this->SetNumberOfInputPorts(1);
  this->SetNumberOfOutputPorts(WallPort + 1);
}

vtkCoronaryPhantomSource::~vtkCoronaryPhantomSource() = default;

template <typename Value>
void vtkCoronaryPhantomSource::Set(Value& setting, Value value)
{
  if (setting != value)
  {
    setting = value;
    this->Data->SettingsTime.Modified();
    this->Modified();
  }
}

// Setter and getter of one field of coronary::PhantomSettings.
#define coronarySettingMacro(Name, type, field)                                                    \
  void vtkCoronaryPhantomSource::Set##Name(type value)                                             \
  {                                                                                                \
    using Field = decltype(this->Data->Settings.field);                                            \
    this->Set(this->Data->Settings.field, static_cast<Field>(value));                              \
  }                                                                                                \
  type vtkCoronaryPhantomSource::Get##Name()                                                       \
  {                                                                                                \
    return static_cast<type>(this->Data->Settings.field);                                          \
  }

coronarySettingMacro(Seed, int, seed);
coronarySettingMacro(Dominance, int, dominance);
coronarySettingMacro(Ramus, bool, ramus);
coronarySettingMacro(Calibre, double, calibre);
coronarySettingMacro(PositionVariation, double, positionVariation);
coronarySettingMacro(CalibreVariation, double, calibreVariation);
coronarySettingMacro(Tortuosity, double, tortuosity);
coronarySettingMacro(Stenoses, int, stenoses);
coronarySettingMacro(StenosisDegree, double, stenosisDegree);
coronarySettingMacro(CalcifiedPlaques, int, calcifiedPlaques);
coronarySettingMacro(ChronicOcclusion, bool, chronicOcclusion);
coronarySettingMacro(CycleLength, double, cycleLength);
coronarySettingMacro(MotionAmplitude, double, motionAmplitude);
coronarySettingMacro(AxialMotionRight, double, axialMotionRight);
coronarySettingMacro(AxialMotionLeft, double, axialMotionLeft);
coronarySettingMacro(RegionalLag, double, regionalLag);
coronarySettingMacro(RegionalAmplitude, double, regionalAmplitude);
coronarySettingMacro(BeatVariation, double, beatVariation);
coronarySettingMacro(BeatIrregularity, double, beatIrregularity);
coronarySettingMacro(AreaPulse, double, areaPulse);
coronarySettingMacro(TemporalWindow, double, temporalWindow);
coronarySettingMacro(Noise, double, noise);
coronarySettingMacro(NoiseCorrelation, double, noiseCorrelation);
coronarySettingMacro(SystolicNoise, double, systolicNoise);
coronarySettingMacro(LumenHU, double, lumenHU);
coronarySettingMacro(AttenuationGradient, double, attenuationGradient);
coronarySettingMacro(VeinHU, double, veinHU);
coronarySettingMacro(CenterlineSpacing, double, centerlineSpacing);
coronarySettingMacro(SurfaceSpacing, double, surfaceSpacing);
#undef coronarySettingMacro

void vtkCoronaryPhantomSource::SetPointSpread(double i, double j, double k)
{
  this->Set(this->Data->Settings.pointSpread[0], i);
  this->Set(this->Data->Settings.pointSpread[1], j);
  this->Set(this->Data->Settings.pointSpread[2], k);
}

double* vtkCoronaryPhantomSource::GetPointSpread()
{
  return this->Data->Settings.pointSpread;
}

void vtkCoronaryPhantomSource::SetDiseases(const char* names)
{
  this->Set(this->Data->Diseases, std::string(names ? names : ""));
}

const char* vtkCoronaryPhantomSource::GetDiseases()
{
  return this->Data->Diseases.c_str();
}

void vtkCoronaryPhantomSource::SetDisease(const coronary::PhantomDisease& disease)
{
  this->Data->Settings.disease = disease;
  this->Data->SettingsTime.Modified();
  this->Modified();
}

void vtkCoronaryPhantomSource::AddLostPhase(double time, double fraction)
{
  coronary::LostPhase lost;
  lost.time = time;
  lost.fraction = fraction;
  this->Data->Settings.lostPhases.push_back(lost);
  this->Data->SettingsTime.Modified();
  this->Modified();
}

void vtkCoronaryPhantomSource::ClearLostPhases()
{
  if (!this->Data->Settings.lostPhases.empty())
  {
    this->Data->Settings.lostPhases.clear();
    this->Data->SettingsTime.Modified();
    this->Modified();
  }
}

int vtkCoronaryPhantomSource::GetNumberOfLostPhases()
{
  return static_cast<int>(this->Data->Settings.lostPhases.size());
}

void vtkCoronaryPhantomSource::AddPhase(double time)
{
  this->Data->Phases.push_back(time);
  this->Modified();
}

void vtkCoronaryPhantomSource::ClearPhases()
{
  if (!this->Data->Phases.empty())
  {
    this->Data->Phases.clear();
    this->Modified();
  }
}

int vtkCoronaryPhantomSource::GetNumberOfPhases()
{
  return static_cast<int>(this->Data->Phases.size());
}

double vtkCoronaryPhantomSource::GetPhase(int index)
{
  return index >= 0 && index < this->GetNumberOfPhases() ? this->Data->Phases[index]
                                                         : std::numeric_limits<double>::quiet_NaN();
}

vtkExecutive* vtkCoronaryPhantomSource::CreateDefaultExecutive()
{
  return SDDP::New();
}

int vtkCoronaryPhantomSource::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet");
  info->Set(INPUT_IS_OPTIONAL(), 1);
  return 1;
}

int vtkCoronaryPhantomSource::FillOutputPortInformation(int port, vtkInformation* info)
{
  const char* type = port == ImagePort ? "vtkImageData" : "vtkPolyData";
  info->Set(vtkDataObject::DATA_TYPE_NAME(), port == ProbePort ? "vtkPointSet" : type);
  return 1;
}

vtkTypeBool vtkCoronaryPhantomSource::ProcessRequest(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  if (request->Has(SDDP::REQUEST_DATA_OBJECT()))
  {
    return this->RequestDataObject(inputs, outputs);
  }
  if (request->Has(SDDP::REQUEST_INFORMATION()))
  {
    return this->RequestInformation(outputs);
  }
  if (request->Has(SDDP::REQUEST_UPDATE_EXTENT()))
  {
    return this->RequestUpdateExtent(request, inputs);
  }
  if (request->Has(SDDP::REQUEST_DATA_NOT_GENERATED()))
  {
    return this->RequestDataNotGenerated(request, outputs);
  }
  if (request->Has(SDDP::REQUEST_DATA()))
  {
    return this->RequestData(inputs, outputs);
  }
  return this->Superclass::ProcessRequest(request, inputs, outputs);
}

int vtkCoronaryPhantomSource::RequestDataObject(
  vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  // The probe's output has its input's type; the other ports have a fixed one.
  const vtkPointSet* input = vtkPointSet::GetData(inputs[0]);
  const char* type = input ? input->GetClassName() : "vtkPolyData";
  vtkInformation* outInfo = outputs->GetInformationObject(ProbePort);
  const vtkDataObject* output = vtkDataObject::GetData(outInfo);
  if (!output || std::string(output->GetClassName()) != type)
  {
    const auto fresh =
      vtkSmartPointer<vtkDataObject>::Take(vtkDataObjectTypes::NewDataObject(type));
    outInfo->Set(vtkDataObject::DATA_OBJECT(), fresh);
  }
  return 1;
}

int vtkCoronaryPhantomSource::RequestInformation(vtkInformationVector* outputs)
{
  try
  {
    const std::vector<double>& phases = this->Data->Phases;
    CheckPhases(phases);
    const double range[2] = { phases.front(), phases.back() };
    for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
    {
      vtkInformation* outInfo = outputs->GetInformationObject(port);
      outInfo->Set(SDDP::TIME_STEPS(), phases.data(), static_cast<int>(phases.size()));
      outInfo->Set(SDDP::TIME_RANGE(), range, 2);
      outInfo->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
    }

    const coronary::ImageGrid grid = this->MakeGrid();
    vtkInformation* image = outputs->GetInformationObject(ImagePort);
    image->Set(CAN_PRODUCE_SUB_EXTENT(), 1);
    image->Set(SDDP::WHOLE_EXTENT(), grid.extent.data(), 6);
    image->Set(vtkDataObject::ORIGIN(), grid.origin.data(), 3);
    image->Set(vtkDataObject::SPACING(), grid.spacing.data(), 3);
    image->Set(vtkDataObject::DIRECTION(), this->Direction, 9);
    vtkDataObject::SetPointDataActiveScalarInfo(image, VTK_SHORT, 1);
    return 1;
  }
  catch (const std::exception& error)
  {
    return vtkCoronary::ReportFailure(
      this, vtkCoronary::PropertyMessage(error.what(), { "PhantomSettings: " }));
  }
}

int vtkCoronaryPhantomSource::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs)
{
  // The executive hands the extent of the requested output on to the input, where that of the
  // image means nothing.
  vtkInformation* inInfo = inputs[0]->GetInformationObject(0);
  if (inInfo && inInfo->Has(SDDP::WHOLE_EXTENT()) &&
    request->Get(vtkExecutive::FROM_OUTPUT_PORT()) != ProbePort)
  {
    inInfo->Set(SDDP::UPDATE_EXTENT(), inInfo->Get(SDDP::WHOLE_EXTENT()), 6);
  }
  return 1;
}

int vtkCoronaryPhantomSource::RequestDataNotGenerated(
  vtkInformation* request, vtkInformationVector* outputs)
{
  const int wanted = request->Get(vtkExecutive::FROM_OUTPUT_PORT());
  for (int port = 0; wanted >= 0 && port < this->GetNumberOfOutputPorts(); ++port)
  {
    if (port != wanted)
    {
      outputs->GetInformationObject(port)->Set(SDDP::DATA_NOT_GENERATED(), 1);
    }
  }
  return 1;
}

int vtkCoronaryPhantomSource::RequestData(
  vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  int result = 1;
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    vtkInformation* outInfo = outputs->GetInformationObject(port);
    vtkDataObject* output = vtkDataObject::GetData(outInfo);
    if (outInfo->Get(SDDP::DATA_NOT_GENERATED()))
    {
      // The executive has put the input's field data into all outputs: give this one its own back.
      if (output->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
      {
        SetTime(output, output->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()),
          this->GetCycleLength());
      }
      continue;
    }
    bool complete = false;
    try
    {
      this->Generate(port, outInfo, inputs);
      complete = true;
    }
    catch (const coronary::Cancelled&)
    {
      vtkDebugMacro("aborted");
    }
    catch (const std::exception& error)
    {
      result = vtkCoronary::ReportEmptied(
        this, vtkCoronary::PropertyMessage(error.what(), { "PhantomSettings: " }));
    }
    if (!complete)
    {
      // Not marked as generated, so that the next request executes again.
      output->Initialize();
      outInfo->Set(SDDP::DATA_NOT_GENERATED(), 1);
    }
  }
  return result;
}

void vtkCoronaryPhantomSource::Generate(
  int port, vtkInformation* outInfo, vtkInformationVector** inputs)
{
  // The executive asks for data even when the request for information has failed before.
  CheckPhases(this->Data->Phases);
  const coronary::ImageGrid grid = this->MakeGrid();
  const double time = outInfo->Has(SDDP::UPDATE_TIME_STEP())
    ? outInfo->Get(SDDP::UPDATE_TIME_STEP())
    : this->Data->Phases.front();
  vtkCoronary::Require(std::isfinite(time), "UPDATE_TIME_STEP: the time must be finite");

  const coronary::CoronaryPhantom& phantom = this->Data->Phantom();
  vtkPolyData* output = vtkPolyData::GetData(outInfo);
  const bool first = outInfo->Get(SDDP::UPDATE_PIECE_NUMBER()) <= 0;
  switch (port)
  {
    case ImagePort:
      this->GenerateImage(grid, outInfo, time);
      break;
    case TreePort:
      FillTree(first ? phantom.Tree(time) : coronary::PhantomTree(), output);
      break;
    case SurfacePort:
    case WallPort:
    {
      coronary::PhantomSurface surface;
      if (first)
      {
        const coronary::ProgressCallback progress = vtkCoronary::ProgressOf(this, 0.0, 0.8);
        surface =
          port == WallPort ? phantom.OuterWall(time, progress) : phantom.Surface(time, progress);
      }
      const std::vector<Vector3> velocity =
        SurfaceVelocity(phantom, surface, time, vtkCoronary::ProgressOf(this, 0.8, 1.0));
      FillSurface(surface, velocity, output);
      break;
    }
    case OstiaPort:
      FillOstia(first ? phantom.Ostia(time) : std::vector<coronary::PhantomOstium>(), output);
      break;
    case VeinPort:
      FillTree(first ? phantom.Vein(time) : coronary::PhantomTree(), output);
      break;
    default:
      FillProbe(phantom, time, vtkPointSet::GetData(inputs[0]), vtkPointSet::GetData(outInfo),
        vtkCoronary::ProgressOf(this));
  }
  SetTime(vtkDataObject::GetData(outInfo), time, this->GetCycleLength());
}

void vtkCoronaryPhantomSource::GenerateImage(
  const coronary::ImageGrid& grid, vtkInformation* outInfo, double time)
{
  vtkImageData* output = vtkImageData::GetData(outInfo);
  std::array<int, 6> part;
  outInfo->Get(SDDP::UPDATE_EXTENT(), part.data());
  output->SetExtent(part.data());

  vtkNew<vtkShortArray> values;
  values->SetName(vtkCoronaryArrayNames::HounsfieldUnits);
  vtkCoronary::Require(values->SetNumberOfValues(output->GetNumberOfPoints()),
    "Not enough memory for the image: Spacing is too small or Dimensions are too large");
  output->GetPointData()->SetScalars(values);
  if (output->GetNumberOfPoints() > 0)
  {
    this->Data->Phantom().Render(
      grid, part, time, values->GetPointer(0), vtkCoronary::ProgressOf(this));
  }
}

coronary::ImageGrid vtkCoronaryPhantomSource::MakeGrid()
{
  vtkCoronary::Require(std::all_of(this->Spacing, this->Spacing + 3,
                         [](double s) { return s >= MinimumSpacing && s <= MaximumSpacing; }),
    "Spacing must be 0.05 to 20 mm");
  vtkCoronary::Require(AllFinite(this->Origin, 3), "Origin must be finite");
  vtkCoronary::Require(std::all_of(this->Dimensions, this->Dimensions + 3,
                         [](int n) { return n >= 1 && n <= MaximumDimension; }),
    "Dimensions must be 1 to 16384");

  const Vector3 spacing(this->Spacing);
  const coronary::Matrix3 direction =
    Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(this->Direction);
  const coronary::Matrix3 product = direction * direction.transpose();
  vtkCoronary::Require(
    product.isApprox(coronary::Matrix3::Identity(), 1e-6), "Direction must be orthonormal");

  if (this->AutomaticGrid)
  {
    return Cover(this->Data->Box(spacing.minCoeff()), spacing, direction);
  }
  coronary::ImageGrid grid;
  grid.extent = { 0, this->Dimensions[0] - 1, 0, this->Dimensions[1] - 1, 0,
    this->Dimensions[2] - 1 };
  grid.origin = Vector3(this->Origin);
  grid.spacing = spacing;
  grid.direction = direction;
  return grid;
}

void vtkCoronaryPhantomSource::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  const coronary::PhantomSettings& settings = this->Data->Settings;
  const auto print = [&](const char* name, const auto& value)
  { os << indent << name << ": " << value << "\n"; };
  const auto printAll = [&](const char* name, const auto* values, int count)
  {
    os << indent << name << ":";
    std::for_each(values, values + count, [&](const auto& value) { os << ' ' << value; });
    os << "\n";
  };
  print("Seed", this->GetSeed());
  print("Dominance", this->GetDominance());
  print("Ramus", settings.ramus);
  print("Calibre", settings.calibre);
  print("PositionVariation", settings.positionVariation);
  print("CalibreVariation", settings.calibreVariation);
  print("Tortuosity", settings.tortuosity);
  print("Stenoses", settings.stenoses);
  print("StenosisDegree", settings.stenosisDegree);
  print("CalcifiedPlaques", settings.calcifiedPlaques);
  print("ChronicOcclusion", settings.chronicOcclusion);
  print("Diseases", this->Data->Diseases);
  print("CycleLength", settings.cycleLength);
  print("MotionAmplitude", settings.motionAmplitude);
  print("AxialMotionRight", settings.axialMotionRight);
  print("AxialMotionLeft", settings.axialMotionLeft);
  print("RegionalLag", settings.regionalLag);
  print("RegionalAmplitude", settings.regionalAmplitude);
  print("BeatVariation", settings.beatVariation);
  print("BeatIrregularity", settings.beatIrregularity);
  print("AreaPulse", settings.areaPulse);
  print("TemporalWindow", settings.temporalWindow);
  print("Noise", settings.noise);
  print("NoiseCorrelation", settings.noiseCorrelation);
  print("SystolicNoise", settings.systolicNoise);
  printAll("PointSpread", settings.pointSpread, 3);
  print("LumenHU", settings.lumenHU);
  print("AttenuationGradient", settings.attenuationGradient);
  print("VeinHU", settings.veinHU);
  std::vector<double> lost;
  for (const coronary::LostPhase& phase : settings.lostPhases)
  {
    lost.insert(lost.end(), { phase.time, phase.fraction });
  }
  printAll("LostPhases", lost.data(), static_cast<int>(lost.size()));
  print("CenterlineSpacing", settings.centerlineSpacing);
  print("SurfaceSpacing", settings.surfaceSpacing);
  printAll("Phases", this->Data->Phases.data(), this->GetNumberOfPhases());
  printAll("Spacing", this->Spacing, 3);
  printAll("Direction", this->Direction, 9);
  print("AutomaticGrid", this->AutomaticGrid);
  printAll("Origin", this->Origin, 3);
  printAll("Dimensions", this->Dimensions, 3);
}
