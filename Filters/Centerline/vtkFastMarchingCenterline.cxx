#include "vtkFastMarchingCenterline.h"

#include "CalciumObjects.h"
#include "CenterlineExtraction.h"
#include "LumenLevels.h"
#include "LumenRefinement.h"
#include "SurfaceDistance.h"
#include "VesselPaths.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArrayRange.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <new>
#include <stdexcept>

using coronary::Vector3;
using coronary::VesselTree;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkFastMarchingCenterline);

namespace
{
/// The values of an array as T: its own memory if it is of that type, else a copy.
template <typename Array, typename T>
const T* ValuesAs(vtkDataArray* array, std::vector<T>& copy)
{
  if (auto* same = vtkArrayDownCast<Array>(array))
  {
    return same->GetPointer(0);
  }
  const auto values = vtk::DataArrayValueRange<1>(array);
  copy.resize(static_cast<std::size_t>(values.size()));
  for (vtkIdType n = 0; n < values.size(); ++n)
  {
    const auto value = static_cast<double>(values[n]);
    copy[static_cast<std::size_t>(n)] =
      std::is_same<T, unsigned char>::value ? static_cast<T>(value != 0.0) : static_cast<T>(value);
  }
  return copy.data();
}

/// The points of an input, if there is one, and others.
std::vector<Vector3> PointsOf(
  vtkInformationVector* input, const std::vector<std::array<double, 3>>& others)
{
  std::vector<Vector3> points;
  vtkPointSet* set = input->GetNumberOfInformationObjects() > 0
    ? vtkPointSet::GetData(input->GetInformationObject(0))
    : nullptr;
  for (vtkIdType n = 0; set && n < set->GetNumberOfPoints(); ++n)
  {
    points.emplace_back(set->GetPoint(n));
  }
  for (const std::array<double, 3>& point : others)
  {
    points.emplace_back(point.data());
  }
  return points;
}

/// `Confidence` of the points of an input, if there is one, and 1 of others.
std::vector<double> ConfidencesOf(vtkInformationVector* input, std::size_t count)
{
  vtkPointSet* set = input->GetNumberOfInformationObjects() > 0
    ? vtkPointSet::GetData(input->GetInformationObject(0))
    : nullptr;
  vtkDataArray* array =
    set ? set->GetPointData()->GetArray(vtkCoronaryArrayNames::Confidence) : nullptr;
  std::vector<double> confidences(count, 1.0);
  for (vtkIdType n = 0; array && n < array->GetNumberOfTuples(); ++n)
  {
    confidences[static_cast<std::size_t>(n)] = array->GetComponent(n, 0);
  }
  return confidences;
}

vtkImageData* ImageOf(vtkInformationVector* input)
{
  return input->GetNumberOfInformationObjects() > 0
    ? vtkImageData::GetData(input->GetInformationObject(0))
    : nullptr;
}

coronary::SurfaceDistance DistanceTo(
  vtkPolyData* surface, double spacing, const coronary::ProgressCallback& progress)
{
  std::vector<Vector3> points;
  std::vector<coronary::Triangle> triangles;
  points.reserve(static_cast<std::size_t>(surface->GetNumberOfPoints()));
  for (vtkIdType n = 0; n < surface->GetNumberOfPoints(); ++n)
  {
    points.emplace_back(surface->GetPoint(n));
  }
  vtkNew<vtkIdList> ids;
  vtkCellArray* polys = surface->GetPolys();
  for (vtkIdType cell = 0; cell < polys->GetNumberOfCells(); ++cell)
  {
    // Polygons as fans: what encloses the same volume.
    polys->GetCellAtId(cell, ids);
    for (vtkIdType i = 2; i < ids->GetNumberOfIds(); ++i)
    {
      triangles.push_back({ ids->GetId(0), ids->GetId(i - 1), ids->GetId(i) });
    }
  }
  vtkCellArray* strips = surface->GetStrips();
  for (vtkIdType cell = 0; cell < strips->GetNumberOfCells(); ++cell)
  {
    strips->GetCellAtId(cell, ids);
    for (vtkIdType i = 2; i < ids->GetNumberOfIds(); ++i)
    {
      const vtkIdType odd = i % 2;
      triangles.push_back({ ids->GetId(i - 2 + odd), ids->GetId(i - 1 - odd), ids->GetId(i) });
    }
  }
  vtkCoronary::Require(!triangles.empty(), "the surface has no polygons");
  return coronary::ComputeSurfaceDistance(points, triangles, spacing, 24000000, progress);
}

namespace names = vtkCoronaryArrayNames;
using Branch = VesselTree::Branch;

/// @param ostia  confidence of each seed
void FillTree(
  vtkPolyData* output, const coronary::CenterlineResult& result, const std::vector<double>& ostia)
{
  const VesselTree& tree = result.tree;
  vtkCoronary::SetTree(output, tree);
  vtkCoronary::AddArray<vtkDoubleArray>(output->GetPointData(), names::Confidence, tree.confidence);
  vtkCoronary::AddArray<vtkUnsignedCharArray>(output->GetPointData(), names::Bridged, tree.bridged);
  vtkCoronary::AddArray<vtkDoubleArray>(
    output->GetPointData(), names::BridgeConfidence, tree.bridgeConfidence);
  std::vector<double> ostium(tree.points.size(), 1.0);
  for (const Branch& branch : tree.branches)
  {
    for (const std::int64_t point : branch.points)
    {
      ostium[static_cast<std::size_t>(point)] = ostia[static_cast<std::size_t>(branch.treeId)];
    }
  }
  vtkCoronary::AddArray<vtkDoubleArray>(output->GetPointData(), names::OstiumConfidence, ostium);
  vtkCoronary::AddArray<vtkDoubleArray>(
    output->GetPointData(), names::VeinProbability, result.veinProbability);
  vtkNew<vtkDoubleArray> veinPositions;
  veinPositions->SetName(names::VeinPositions);
  veinPositions->SetNumberOfComponents(3);
  std::vector<double> veinLengths;
  std::vector<double> veinProbabilities;
  for (const coronary::RejectedVein& vein : result.veins)
  {
    veinPositions->InsertNextTuple(vein.position.data());
    veinLengths.push_back(vein.length);
    veinProbabilities.push_back(vein.probability);
  }
  output->GetFieldData()->AddArray(veinPositions);
  vtkCoronary::AddArray<vtkDoubleArray>(output->GetFieldData(), names::VeinLengths, veinLengths);
  vtkCoronary::AddArray<vtkDoubleArray>(
    output->GetFieldData(), names::VeinProbabilities, veinProbabilities);
}

/// Points where the lines of VMTK's form end: first the targets, then the other tips.
std::vector<std::int64_t> LineEnds(const coronary::CenterlineResult& result, bool findTips)
{
  const VesselTree& tree = result.tree;
  std::vector<std::int64_t> ends;
  for (const coronary::CenterlineEnd& target : result.targets)
  {
    if (target.point >= 0)
    {
      ends.push_back(target.point);
    }
  }
  if (findTips)
  {
    for (const Branch& branch : tree.branches)
    {
      const bool tip = std::none_of(tree.branches.begin(), tree.branches.end(),
        [&](const Branch& other) { return other.parentGroupId == branch.groupId; });
      if (tip && std::find(ends.begin(), ends.end(), branch.points.back()) == ends.end())
      {
        ends.push_back(branch.points.back());
      }
    }
  }
  return ends;
}

/// VMTK's form, from the root to every end.
void FillLines(vtkPolyData* output, const VesselTree& tree, const std::vector<std::int64_t>& ends)
{
  const std::vector<coronary::VmtkTract> tracts = coronary::ToVmtkTracts(tree, ends);
  vtkCoronary::SetTracts(output, tracts);
  const auto add = [&](const char* name, const std::vector<double>& values)
  {
    std::vector<double> along;
    for (const coronary::VmtkTract& tract : tracts)
    {
      for (const std::int64_t point : tract.source)
      {
        along.push_back(values[static_cast<std::size_t>(point)]);
      }
    }
    vtkCoronary::AddArray<vtkDoubleArray>(output->GetPointData(), name, along);
  };
  add(names::Radius, tree.radius);
  add(names::Abscissas, tree.abscissa);
  add(names::Confidence, tree.confidence);
}

void FillBifurcations(vtkPolyData* output, const coronary::CenterlineResult& result)
{
  const VesselTree& tree = result.tree;
  std::map<int, int> treeOf; // by group
  for (const Branch& branch : tree.branches)
  {
    treeOf[branch.groupId] = branch.treeId;
  }
  vtkNew<vtkPoints> forks;
  forks->SetDataTypeToDouble();
  std::vector<double> forkRadius;
  std::vector<int> parents;
  std::vector<int> trees;
  std::size_t width = 2;
  for (const coronary::CenterlineBifurcation& fork : result.bifurcations)
  {
    width = std::max(width, fork.daughterGroupIds.size());
  }
  vtkNew<vtkIntArray> daughters;
  daughters->SetName(names::DaughterGroupIds);
  daughters->SetNumberOfComponents(static_cast<int>(width));
  vtkNew<vtkCellArray> vertices;
  for (const coronary::CenterlineBifurcation& fork : result.bifurcations)
  {
    const vtkIdType id =
      forks->InsertNextPoint(tree.points[static_cast<std::size_t>(fork.point)].data());
    vertices->InsertNextCell(1, &id);
    forkRadius.push_back(tree.radius[static_cast<std::size_t>(fork.point)]);
    parents.push_back(fork.parentGroupId);
    trees.push_back(treeOf[fork.parentGroupId]);
    std::vector<int> row(fork.daughterGroupIds);
    row.resize(width, -1);
    daughters->InsertNextTypedTuple(row.data());
  }
  output->SetPoints(forks);
  output->SetVerts(vertices);
  vtkCoronary::AddArray<vtkDoubleArray>(output->GetPointData(), names::Radius, forkRadius);
  vtkCoronary::AddArray<vtkIntArray>(output->GetPointData(), names::ParentGroupIds, parents);
  vtkCoronary::AddArray<vtkIntArray>(output->GetPointData(), names::TreeIds, trees);
  output->GetPointData()->AddArray(daughters);
}

/// What became of seeds and targets.
void AddStatus(vtkFieldData* fields, const coronary::CenterlineResult& result)
{
  const auto addEnds = [&](const std::vector<coronary::CenterlineEnd>& list, const char* statusName,
                         const char* messageName)
  {
    std::vector<int> status;
    std::vector<std::string> messages;
    for (const coronary::CenterlineEnd& end : list)
    {
      status.push_back(static_cast<int>(end.status));
      messages.push_back(end.message.empty() ? coronary::EndStatusText(end.status) : end.message);
    }
    vtkCoronary::AddArray<vtkIntArray>(fields, statusName, status);
    vtkCoronary::AddArray<vtkStringArray>(fields, messageName, messages);
  };
  addEnds(result.seeds, names::SeedStatus, names::SeedMessage);
  addEnds(result.targets, names::TargetStatus, names::TargetMessage);
  vtkCoronary::AddArray<vtkDoubleArray>(
    fields, names::ImageBlur, std::vector<double>{ result.blur });
  vtkCoronary::AddArray<vtkUnsignedCharArray>(fields, names::Complete,
    std::vector<unsigned char>{ static_cast<unsigned char>(result.complete ? 1 : 0) });
}

/// Takes the message's first word as the name of a property.
std::string PropertyMessage(std::string message)
{
  message = vtkCoronary::PropertyMessage(message, { "CenterlineSettings: " });
  const std::map<std::string, std::string> others{ { "Resampling", "ResamplingStepLength" },
    { "Smoothing", "SmoothingWavelength" } };
  const auto other = others.find(message.substr(0, message.find(' ')));
  if (other != others.end())
  {
    message.replace(0, other->first.size(), other->second);
  }
  return message;
}
}

vtkFastMarchingCenterline::vtkFastMarchingCenterline()
{
  this->SetNumberOfInputPorts(5);
  this->SetNumberOfOutputPorts(3);
  this->SetInputArrayToProcess(
    0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, vtkDataSetAttributes::SCALARS);
}

vtkFastMarchingCenterline::~vtkFastMarchingCenterline() = default;

void vtkFastMarchingCenterline::SetSeedPoint(int index, double x, double y, double z)
{
  this->SetPoint(this->SeedPoints, index, { x, y, z });
}

void vtkFastMarchingCenterline::SetNumberOfSeedPoints(int count)
{
  this->SetNumberOfPoints(this->SeedPoints, count);
}

void vtkFastMarchingCenterline::SetTargetPoint(int index, double x, double y, double z)
{
  this->SetPoint(this->TargetPoints, index, { x, y, z });
}

void vtkFastMarchingCenterline::SetNumberOfTargetPoints(int count)
{
  this->SetNumberOfPoints(this->TargetPoints, count);
}

void vtkFastMarchingCenterline::SetPoint(
  Points& points, int index, const std::array<double, 3>& point)
{
  if (index < 0 || index >= static_cast<int>(points.size()))
  {
    vtkErrorMacro("There is no seed or target point " << index << " of " << points.size());
    return;
  }
  if (points[index] != point)
  {
    points[index] = point;
    this->Modified();
  }
}

void vtkFastMarchingCenterline::SetNumberOfPoints(Points& points, int count)
{
  if (count >= 0 && count != static_cast<int>(points.size()))
  {
    points.resize(static_cast<std::size_t>(count), { 0.0, 0.0, 0.0 });
    this->Modified();
  }
}

int vtkFastMarchingCenterline::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Remove(INPUT_REQUIRED_DATA_TYPE());
  if (port == 0)
  {
    info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
    info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  }
  else
  {
    info->Set(INPUT_REQUIRED_DATA_TYPE(), port < 3 ? "vtkPointSet" : "vtkImageData");
  }
  if (port > 0)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

int vtkFastMarchingCenterline::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkFastMarchingCenterline::RequestUpdateExtent(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  // A tree is made of the whole.
  for (int port = 0; port < this->GetNumberOfInputPorts(); ++port)
  {
    if (inputs[port]->GetNumberOfInformationObjects() == 0)
    {
      continue;
    }
    vtkInformation* info = inputs[port]->GetInformationObject(0);
    if (info->Has(SDDP::WHOLE_EXTENT()))
    {
      int whole[6];
      info->Get(SDDP::WHOLE_EXTENT(), whole);
      info->Set(SDDP::UPDATE_EXTENT(), whole, 6);
    }
    info->Set(SDDP::UPDATE_PIECE_NUMBER(), 0);
    info->Set(SDDP::UPDATE_NUMBER_OF_PIECES(), 1);
    info->Set(SDDP::UPDATE_NUMBER_OF_GHOST_LEVELS(), 0);
  }
  return 1;
}

int vtkFastMarchingCenterline::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  const int from = std::max(0, request->Get(SDDP::FROM_OUTPUT_PORT()));
  const bool wanted = outputs->GetInformationObject(from)->Get(SDDP::UPDATE_PIECE_NUMBER()) <= 0;
  int result = 1;
  try
  {
    this->Execute(wanted, inputs, outputs);
    return 1;
  }
  catch (const coronary::Cancelled&)
  {
    vtkDebugMacro("aborted");
  }
  catch (const std::bad_alloc&)
  {
    result = vtkCoronary::ReportEmptied(this, "Not enough memory for the region to march in.");
  }
  catch (const std::exception& error)
  {
    result = vtkCoronary::ReportEmptied(this, PropertyMessage(error.what()));
  }
  for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
  {
    vtkPolyData::GetData(outputs, port)->Initialize();
  }
  return result;
}

/// What is extracted from, with what was made or copied for it.
struct vtkFastMarchingCenterline::Source
{
  coronary::CenterlineInput input;
  coronary::SurfaceDistance distance;
  std::vector<float> speedCopy;
  std::vector<unsigned char> maskCopy;
  coronary::ScalarImage intensity;
  std::vector<float> intensityCopy;
};

coronary::CenterlineSettings vtkFastMarchingCenterline::ExtractionSettings() const
{
  coronary::CenterlineSettings settings;
  if (this->SpeedThreshold > 0.0)
  {
    settings.speedThreshold = this->SpeedThreshold;
  }
  if (this->IntensityThreshold != 0.0)
  {
    settings.intensityThreshold = this->IntensityThreshold;
  }
  settings.speedExponent = this->SpeedExponent;
  settings.minimumBranchLength = this->MinimumBranchLength;
  settings.minimumConfidence = this->MinimumConfidence;
  settings.maximumGap = this->MaximumGap;
  settings.maximumRadius = this->MaximumRadius;
  settings.snapDistance = this->SnapDistance;
  settings.stepLimit = this->StepLimit;
  settings.Validate();
  vtkCoronary::Require(std::isfinite(this->SurfaceSpacing) && this->SurfaceSpacing >= 0.0,
    "SurfaceSpacing must not be negative");
  return settings;
}

void vtkFastMarchingCenterline::ReadSurface(vtkPolyData* surface, double end, Source& source)
{
  source.distance =
    DistanceTo(surface, this->SurfaceSpacing, vtkCoronary::ProgressOf(this, 0.0, end));
  const coronary::SurfaceDistance& distance = source.distance;
  if (distance.openEdges > 0 || distance.doubtfulRows > 0)
  {
    vtkWarningMacro(
      "The surface is not closed: " << distance.openEdges << " open edges. Close its ends first.");
  }
  source.input.grid = distance.grid;
  source.input.wallDistance = distance.values.data();
}

void vtkFastMarchingCenterline::ReadImage(
  vtkImageData* image, vtkInformationVector** inputs, Source& source)
{
  coronary::CenterlineInput& input = source.input;
  input.grid = vtkCoronary::GridOf(image);
  vtkDataArray* array =
    vtkCoronary::VoxelArrayOf(image, vtkCoronary::ChosenPointArray(this, "the image"), "the image");
  if (this->ImageKind == MaskImage)
  {
    input.mask = ValuesAs<vtkUnsignedCharArray>(array, source.maskCopy);
    input.bridges = vtkCoronary::BridgesOf(image->GetFieldData());
  }
  else
  {
    input.speed = ValuesAs<vtkFloatArray>(array, source.speedCopy);
    if (vtkImageData* mask = ImageOf(inputs[4]))
    {
      input.bridges = vtkCoronary::BridgesOf(mask->GetFieldData());
      const coronary::ImageGrid grid = vtkCoronary::GridOf(mask);
      vtkCoronary::Require(grid.extent == input.grid.extent &&
          grid.origin.isApprox(input.grid.origin, 1e-5) &&
          grid.spacing.isApprox(input.grid.spacing, 1e-5) &&
          grid.direction.isApprox(input.grid.direction, 1e-5),
        "the mask is on another grid than the image: extent, spacing, origin or direction "
        "differs");
      input.mask = ValuesAs<vtkUnsignedCharArray>(
        vtkCoronary::VoxelArrayOf(mask, {}, "the mask"), source.maskCopy);
    }
  }
}

void vtkFastMarchingCenterline::ReadIntensity(vtkImageData* measured, Source& source) const
{
  if (!measured || measured->GetNumberOfPoints() == 0)
  {
    return;
  }
  vtkDataArray* array =
    vtkCoronary::VoxelArrayOf(measured, this->IntensityArrayName, "the measured image");
  source.intensity = vtkCoronary::ScalarImageOf(measured, array, source.intensityCopy);
  source.input.intensity = &source.intensity;
}

coronary::CenterlineResult vtkFastMarchingCenterline::Extract(
  vtkInformationVector** inputs, const coronary::CenterlineSettings& settings, Source& source)
{
  vtkDataObject* data = vtkDataObject::GetData(inputs[0]->GetInformationObject(0));
  double begin = 0.0;
  if (auto* surface = vtkPolyData::SafeDownCast(data))
  {
    begin = 0.4;
    this->ReadSurface(surface, begin, source);
  }
  else
  {
    this->ReadImage(vtkImageData::SafeDownCast(data), inputs, source);
  }
  this->ReadIntensity(ImageOf(inputs[3]), source);
  const coronary::CenterlineInput& input = source.input;
  const bool refine = input.intensity != nullptr;
  const double end = refine ? 0.9 : 1.0;
  coronary::CenterlineResult result =
    coronary::ExtractCenterlines(input, settings, vtkCoronary::ProgressOf(this, begin, end));
  if (refine && !result.tree.branches.empty() && result.blur > 0.0)
  {
    const coronary::TreeLumen lumen =
      coronary::MeasureTreeLumen(result.tree, coronary::VesselPaths(result.tree), *input.intensity,
        result.blur, vtkCoronary::ProgressOf(this, end, 1.0));
    result.tree = coronary::WithLumen(std::move(result.tree), lumen.lumen);
  }
  return result;
}

void vtkFastMarchingCenterline::Execute(
  bool wanted, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  coronary::CenterlineSettings settings = this->ExtractionSettings();
  vtkCoronary::Require(inputs[1]->GetNumberOfInformationObjects() > 0 || !this->SeedPoints.empty(),
    "there is no seed: connect the Seeds input or set SeedPoints");
  Source source;
  source.input.seeds = PointsOf(inputs[1], this->SeedPoints);
  source.input.targets = PointsOf(inputs[2], this->TargetPoints);
  settings.findTips = this->FindTips || source.input.targets.empty();
  vtkDataObject* data = vtkDataObject::GetData(inputs[0]->GetInformationObject(0));
  auto* image = vtkImageData::SafeDownCast(data);
  auto* surface = vtkPolyData::SafeDownCast(data);
  const bool empty = !wanted || source.input.seeds.empty() ||
    (image ? image->GetNumberOfPoints() == 0 : surface->GetNumberOfPoints() == 0);
  coronary::CenterlineResult result;
  if (!empty)
  {
    result = this->Extract(inputs, settings, source);
  }
  for (const std::string& message : result.messages)
  {
    vtkWarningMacro(<< message);
  }
  for (const auto* ends : { &result.seeds, &result.targets })
  {
    for (const coronary::CenterlineEnd& end : *ends)
    {
      if (end.status != coronary::EndStatus::Reached && !end.message.empty())
      {
        vtkWarningMacro(<< end.message);
      }
    }
  }

  FillTree(vtkPolyData::GetData(outputs, TreePort), result,
    ConfidencesOf(inputs[1], source.input.seeds.size()));
  FillLines(
    vtkPolyData::GetData(outputs, LinesPort), result.tree, LineEnds(result, settings.findTips));
  FillBifurcations(vtkPolyData::GetData(outputs, BifurcationsPort), result);
  for (const int port : { TreePort, LinesPort, BifurcationsPort })
  {
    vtkFieldData* fields = vtkPolyData::GetData(outputs, port)->GetFieldData();
    fields->PassData(data->GetFieldData());
    AddStatus(fields, result);
  }
}

void vtkFastMarchingCenterline::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "SeedPoints: " << this->SeedPoints.size() << '\n';
  os << indent << "TargetPoints: " << this->TargetPoints.size() << '\n';
  os << indent << "ImageKind: " << this->ImageKind << '\n';
  os << indent << "SpeedThreshold: " << this->SpeedThreshold << '\n';
  os << indent << "IntensityThreshold: " << this->IntensityThreshold << '\n';
  os << indent << "SpeedExponent: " << this->SpeedExponent << '\n';
  os << indent << "FindTips: " << this->FindTips << '\n';
  os << indent << "MinimumBranchLength: " << this->MinimumBranchLength << '\n';
  os << indent << "MinimumConfidence: " << this->MinimumConfidence << '\n';
  os << indent << "MaximumGap: " << this->MaximumGap << '\n';
  os << indent << "MaximumRadius: " << this->MaximumRadius << '\n';
  os << indent << "SnapDistance: " << this->SnapDistance << '\n';
  os << indent << "SurfaceSpacing: " << this->SurfaceSpacing << '\n';
  os << indent << "StepLimit: " << this->StepLimit << '\n';
  os << indent << "IntensityArrayName: " << this->IntensityArrayName << '\n';
}
