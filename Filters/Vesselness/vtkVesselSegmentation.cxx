#include "vtkVesselSegmentation.h"

#include "CoronaryOstia.h"
#include "ImageExtent.h"
#include "LargePages.h"
#include "MultiscaleVesselness.h"
#include "VesselSegmentation.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArrayRange.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkShortArray.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkUnsignedCharArray.h"
#include "vtkUnsignedShortArray.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>

using coronary::Extent;
using coronary::IsEmpty;
using coronary::Vector3;
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace
{
// What a seed in a vessel has at least: brightness over the noise, mm^3 that hang on it (its own
// surroundings are 33), but where another seed is as near as so many mm and takes some of them.
constexpr double MinimumSeedContrast = 4.0;
constexpr double MinimumSeedVolume = 45.0;
constexpr double SharedVolume = 10.0;

// Shares of the work, for the progress.
constexpr double VesselnessShare = 0.35;
constexpr double OstiaShare = 0.35;

/// The voxels of an array in one of the types that the algorithms take; else as a float copy.
class Voxels
{
public:
  Voxels(vtkDataArray* array, const coronary::ImageGrid& grid)
  {
    this->Image.grid = grid;
    if (auto* shorts = vtkArrayDownCast<vtkShortArray>(array))
    {
      this->Image.values = static_cast<const std::int16_t*>(shorts->GetPointer(0));
    }
    else if (auto* unsignedShorts = vtkArrayDownCast<vtkUnsignedShortArray>(array))
    {
      this->Image.values = static_cast<const std::uint16_t*>(unsignedShorts->GetPointer(0));
    }
    else
    {
      this->Image.values = this->Floats(array);
    }
  }

  /// The same as float; converted at the first call.
  const float* Floats(vtkDataArray* array)
  {
    if (auto* floats = vtkArrayDownCast<vtkFloatArray>(array))
    {
      return floats->GetPointer(0);
    }
    if (this->Copy.empty())
    {
      const auto values = vtk::DataArrayValueRange<1>(array);
      this->Copy.resize(static_cast<std::size_t>(values.size()));
      coronary::ParallelFor(values.size(), 65536,
        [&](std::int64_t first, std::int64_t last)
        {
          for (std::int64_t n = first; n < last; ++n)
          {
            this->Copy[n] = static_cast<float>(values[static_cast<vtkIdType>(n)]);
          }
        });
    }
    return this->Copy.data();
  }

  coronary::ScalarImage Image;

private:
  std::vector<float> Copy;
};

bool IsNear(const coronary::ImageGrid& a, const coronary::ImageGrid& b)
{
  const double voxel = a.spacing.minCoeff();
  return a.extent == b.extent && (a.spacing - b.spacing).cwiseAbs().maxCoeff() <= 1e-4 * voxel &&
    (a.origin - b.origin).cwiseAbs().maxCoeff() <= 1e-2 * voxel &&
    (a.direction - b.direction).cwiseAbs().maxCoeff() <= 1e-4;
}

/// One value a voxel of `part` out of the values of a whole image.
template <typename Array, typename T>
void Insert(
  vtkImageData* output, const std::string& name, const std::vector<T>& values, const Extent& whole)
{
  const Extent part = vtkCoronary::GridOf(output).extent;
  vtkNew<Array> array;
  array->SetName(name.c_str());
  if (!array->Resize(output->GetNumberOfPoints()))
  {
    throw std::bad_alloc();
  }
  array->SetNumberOfTuples(output->GetNumberOfPoints());
  if (!IsEmpty(part))
  {
    T* target = array->GetPointer(0);
    coronary::PreferLargePages(
      target, sizeof(T) * static_cast<std::size_t>(output->GetNumberOfPoints()));
    const std::int64_t nx = whole[1] - whole[0] + 1;
    const std::int64_t ny = whole[3] - whole[2] + 1;
    for (std::int64_t k = part[4]; k <= part[5]; ++k)
    {
      for (std::int64_t j = part[2]; j <= part[3]; ++j)
      {
        const T* row =
          values.data() + ((k - whole[4]) * ny + j - whole[2]) * nx + part[0] - whole[0];
        target = std::copy_n(row, part[1] - part[0] + 1, target);
      }
    }
  }
  output->GetPointData()->AddArray(array);
}

/// Ways across lesions as polylines.
void AddBridges(vtkPolyData* output, const std::vector<coronary::VesselLink>& links)
{
  vtkNew<vtkCellArray> lines;
  std::vector<double> confidence;
  std::vector<double> length;
  std::vector<double> unseen;
  for (const coronary::VesselLink& link : links)
  {
    lines->InsertNextCell(static_cast<int>(link.points.size()));
    for (const Vector3& point : link.points)
    {
      lines->InsertCellPoint(output->GetPoints()->InsertNextPoint(point.data()));
    }
    confidence.push_back(link.confidence);
    length.push_back(link.length);
    unseen.push_back(link.unseen);
  }
  output->SetLines(lines);
  namespace names = vtkCoronaryArrayNames;
  vtkCellData* cells = output->GetCellData();
  vtkCoronary::AddArray<vtkDoubleArray>(cells, names::BridgeConfidence, confidence);
  vtkCoronary::AddArray<vtkDoubleArray>(cells, names::Length, length);
  vtkCoronary::AddArray<vtkDoubleArray>(cells, names::BridgeUnseen, unseen);
}

/// Smallest and largest scale of the vesselness that is computed here, mm.
std::vector<double> DefaultScales(const Vector3& spacing)
{
  constexpr double minimum = 0.5;
  constexpr double maximum = 2.5;
  constexpr int count = 5;
  const double resolved = 0.5 * spacing.maxCoeff();
  const double low = std::min(maximum, std::max(minimum, resolved));
  return coronary::VesselnessScales(low, maximum, low < maximum ? count : 1, false);
}

/// What begins a vessel. The ostia are empty where seeds were given.
struct Origins
{
  std::vector<coronary::VesselSeed> seeds;
  std::vector<coronary::CoronaryOstium> ostia;
  coronary::AscendingAorta aorta;
};

/// @throws std::invalid_argument
void RequireVolume(const coronary::ImageGrid& grid)
{
  const Extent& whole = grid.extent;
  vtkCoronary::Require(whole[0] < whole[1] && whole[2] < whole[3] && whole[4] < whole[5],
    "the image has " + std::to_string(whole[1] - whole[0] + 1) + " x " +
      std::to_string(whole[3] - whole[2] + 1) + " x " + std::to_string(whole[5] - whole[4] + 1) +
      " voxels: a three-dimensional image is needed");
  vtkCoronary::Require(
    (grid.direction * grid.direction.transpose()).isApprox(coronary::Matrix3::Identity(), 1e-4),
    "the image's direction matrix is not orthonormal");
}

/// Points, with their axis where they have one.
void AddSeeds(vtkPolyData* points, std::vector<coronary::VesselSeed>& seeds)
{
  vtkDataArray* axes = points->GetPointData()->GetArray(vtkCoronaryArrayNames::Axis);
  for (vtkIdType n = 0; n < points->GetNumberOfPoints(); ++n)
  {
    coronary::VesselSeed seed;
    points->GetPoint(n, seed.position.data());
    if (axes && axes->GetNumberOfComponents() == 3)
    {
      axes->GetTuple(n, seed.axis.data());
      const double length = seed.axis.norm();
      seed.axis = length > 1e-9 && std::isfinite(length) ? Vector3(seed.axis / length)
                                                         : Vector3(Vector3::Zero());
    }
    seeds.push_back(seed);
  }
}

/// Vesselness of the whole image; without a window its own contrast sets the scale.
std::vector<float> ComputeVesselness(vtkAlgorithm* self, const float* values,
  const coronary::ImageGrid& grid, const std::optional<coronary::BloodWindow>& window)
{
  const Extent& whole = grid.extent;
  coronary::VesselnessSettings frangi;
  frangi.sigmas = DefaultScales(grid.spacing);
  const coronary::MultiscaleVesselness unscaled(frangi, grid.spacing, whole);
  const double middle = OstiaShare + 0.4 * VesselnessShare;
  if (window)
  {
    // A vessel of full contrast has about this norm.
    frangi.c = 0.25 * (window->blood - window->tissue);
  }
  else
  {
    frangi.c = 0.5 *
      unscaled
        .Measure(
          { values, whole }, whole, nullptr, vtkCoronary::ProgressOf(self, OstiaShare, middle))
        .hessianNorm;
  }
  std::vector<float> computed(
    static_cast<std::size_t>(coronary::ScalarImage{ values, grid }.NumberOfVoxels()), 0.0f);
  if (frangi.c > 0.0)
  {
    coronary::MultiscaleVesselness::Output to;
    to.vesselness = computed.data();
    coronary::MultiscaleVesselness(frangi, grid.spacing, whole)
      .Compute({ values, whole }, whole, nullptr, to,
        vtkCoronary::ProgressOf(self, middle, OstiaShare + VesselnessShare));
  }
  return computed;
}

/// Seeds with what is known of them, and the aorta's axis. Only the first piece has points.
void WriteOrigins(const Origins& origins, const std::vector<double>& seedVolume, bool firstPiece,
  vtkPolyData* seedsOutput, vtkPolyData* aortaOutput)
{
  const auto makeArray = [](vtkPolyData* data, const char* name, int components)
  {
    auto array = vtkSmartPointer<vtkDoubleArray>::New();
    array->SetName(name);
    array->SetNumberOfComponents(components);
    data->GetPointData()->AddArray(array);
    return array;
  };
  vtkNew<vtkStringArray> names;
  names->SetName(vtkCoronaryArrayNames::Name);
  seedsOutput->GetPointData()->AddArray(names);
  const auto axes = makeArray(seedsOutput, vtkCoronaryArrayNames::Axis, 3);
  const auto radii = makeArray(seedsOutput, vtkCoronaryArrayNames::Radius, 1);
  const auto confidence = makeArray(seedsOutput, vtkCoronaryArrayNames::Confidence, 1);
  const auto volumes = makeArray(seedsOutput, vtkCoronaryArrayNames::SeedVolume, 1);
  const auto aortaRadii = makeArray(aortaOutput, vtkCoronaryArrayNames::Radius, 1);
  if (!firstPiece)
  {
    return;
  }
  vtkNew<vtkCellArray> vertices;
  for (std::size_t s = 0; s < origins.seeds.size(); ++s)
  {
    const vtkIdType id =
      seedsOutput->GetPoints()->InsertNextPoint(origins.seeds[s].position.data());
    vertices->InsertNextCell(1, &id);
    names->InsertNextValue(origins.ostia.empty() ? std::to_string(s) : origins.ostia[s].name);
    axes->InsertNextTuple(origins.seeds[s].axis.data());
    radii->InsertNextValue(origins.ostia.empty() ? 0.0 : origins.ostia[s].radius);
    confidence->InsertNextValue(origins.ostia.empty() ? 1.0 : origins.ostia[s].confidence);
    volumes->InsertNextValue(seedVolume[s]);
  }
  seedsOutput->SetVerts(vertices);
  vtkNew<vtkCellArray> lines;
  if (!origins.aorta.sections.empty())
  {
    lines->InsertNextCell(static_cast<int>(origins.aorta.sections.size()));
    for (const coronary::AorticSection& section : origins.aorta.sections)
    {
      lines->InsertCellPoint(aortaOutput->GetPoints()->InsertNextPoint(section.centre.data()));
      aortaRadii->InsertNextValue(section.radius);
    }
  }
  aortaOutput->SetLines(lines);
}
}

vtkStandardNewMacro(vtkVesselSegmentation);

vtkVesselSegmentation::vtkVesselSegmentation()
{
  this->SetNumberOfInputPorts(3);
  this->SetNumberOfOutputPorts(4);
  this->SetInputArrayToProcess(
    0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, vtkDataSetAttributes::SCALARS);
}

vtkVesselSegmentation::~vtkVesselSegmentation() = default;

vtkExecutive* vtkVesselSegmentation::CreateDefaultExecutive()
{
  // Not the composite one: a segmentation belongs to one image.
  return SDDP::New();
}

void vtkVesselSegmentation::AddSeed(double x, double y, double z)
{
  this->Seeds.push_back({ x, y, z });
  this->Modified();
}

void vtkVesselSegmentation::SetSeed(int index, double x, double y, double z)
{
  if (index < 0 || index >= this->GetNumberOfSeeds())
  {
    vtkErrorMacro("SetSeed: there is no seed " << index);
    return;
  }
  const std::array<double, 3> seed{ x, y, z };
  if (this->Seeds[index] != seed)
  {
    this->Seeds[index] = seed;
    this->Modified();
  }
}

void vtkVesselSegmentation::SetNumberOfSeeds(int count)
{
  if (count >= 0 && count != this->GetNumberOfSeeds())
  {
    this->Seeds.resize(static_cast<std::size_t>(count), { 0.0, 0.0, 0.0 });
    this->Modified();
  }
}

void vtkVesselSegmentation::SetKnownOstia(std::shared_ptr<const coronary::CoronaryOstia> ostia)
{
  if (this->KnownOstia != ostia)
  {
    this->KnownOstia = std::move(ostia);
    this->Modified();
  }
}

int vtkVesselSegmentation::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), port == 2 ? "vtkPolyData" : "vtkImageData");
  if (port > 0)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

int vtkVesselSegmentation::FillOutputPortInformation(int port, vtkInformation* info)
{
  info->Set(vtkDataObject::DATA_TYPE_NAME(), port == MaskPort ? "vtkImageData" : "vtkPolyData");
  return 1;
}

int vtkVesselSegmentation::RequestInformation(
  vtkInformation*, vtkInformationVector**, vtkInformationVector* outputs)
{
  vtkInformation* outInfo = outputs->GetInformationObject(MaskPort);
  vtkDataObject::SetPointDataActiveScalarInfo(outInfo, VTK_UNSIGNED_CHAR, 1);
  outInfo->Set(CAN_PRODUCE_SUB_EXTENT(), 1);
  for (const int port : { SeedsPort, AortaPort, BridgesPort })
  {
    outputs->GetInformationObject(port)->Set(CAN_HANDLE_PIECE_REQUEST(), 1);
  }
  return 1;
}

int vtkVesselSegmentation::RequestUpdateExtent(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  for (int port = 0; port < 3; ++port)
  {
    if (vtkInformation* info = inputs[port]->GetInformationObject(0))
    {
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
  }
  return 1;
}

vtkDataArray* vtkVesselSegmentation::InputArray(vtkInformationVector** inputs, int port)
{
  const std::string whose = port == 0 ? "the image" : "the vesselness";
  return vtkCoronary::VoxelArrayOf(vtkImageData::GetData(inputs[port]->GetInformationObject(0)),
    port == 0 ? vtkCoronary::ChosenPointArray(this, whose) : this->InputVesselnessArrayName, whose);
}

coronary::VesselSegmentationSettings vtkVesselSegmentation::MakeSettings() const
{
  coronary::VesselSegmentationSettings settings;
  vtkCoronary::Require(!this->AutomaticWindow ? this->BloodValue > this->TissueValue : true,
    "BloodValue must be above TissueValue");
  vtkCoronary::Require(this->WeakThreshold > 0.0 && this->WeakThreshold <= this->StrongThreshold &&
      this->StrongThreshold <= 1.0,
    "WeakThreshold and StrongThreshold must satisfy 0 < WeakThreshold <= StrongThreshold <= 1");
  vtkCoronary::Require(this->TubularVesselness >= 0.0 && std::isfinite(this->TubularVesselness),
    "TubularVesselness must be 0 or more");
  settings.weak = this->WeakThreshold;
  settings.strong = this->StrongThreshold;
  settings.maximumRadius = this->MaximumRadius;
  settings.longestPath = this->LongestPath;
  settings.minimumIslandVolume = this->MinimumIslandVolume;
  settings.crossLesions = this->CrossLesions;
  settings.longestGap = this->LongestGap;
  settings.minimumLinkConfidence = this->MinimumLinkConfidence;
  if (!this->AutomaticWindow)
  {
    settings.window = coronary::BloodWindow{ this->TissueValue, this->BloodValue };
  }
  if (this->TubularVesselness > 0.0)
  {
    settings.tubular = this->TubularVesselness;
  }
  settings.Validate();
  return settings;
}

/// @throws std::runtime_error when there is none
coronary::CoronaryOstia vtkVesselSegmentation::FindOstia(const coronary::ScalarImage& image)
{
  vtkCoronary::Require(this->AutomaticOstia,
    "there is no seed: give points on the Seeds input or with AddSeed, or switch AutomaticOstia "
    "on");
  coronary::CoronaryOstia found = this->KnownOstia
    ? *this->KnownOstia
    : coronary::FindCoronaryOstia(image, {}, vtkCoronary::ProgressOf(this, 0.0, OstiaShare));
  if (found.ostia.empty())
  {
    throw std::runtime_error("AutomaticOstia found no ostium (" + found.doubt +
      "): give points on the Seeds input or with AddSeed");
  }
  if (!found.doubt.empty())
  {
    vtkWarningMacro("AutomaticOstia: " << found.doubt
                                       << ". Look at output 1 before you trust it, and give "
                                       << "seeds (Seeds input, AddSeed) where it is wrong.");
  }
  return found;
}

std::string vtkVesselSegmentation::DoubtOf(const std::vector<coronary::VesselSeed>& seeds,
  const coronary::VesselSegmentationResult& result, std::size_t s)
{
  if (result.seedContrast[s] < MinimumSeedContrast)
  {
    return "the brightest place within 2.5 mm of it is only as bright as noise makes tissue";
  }
  const bool shared = std::any_of(seeds.begin(), seeds.end(),
    [&](const coronary::VesselSeed& other)
    { return &other != &seeds[s] && (other.position - seeds[s].position).norm() < SharedVolume; });
  return result.seedVolume[s] < MinimumSeedVolume && !shared ? "none leads on from it" : "";
}

void vtkVesselSegmentation::Execute(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  coronary::VesselSegmentationSettings settings = this->MakeSettings();
  vtkImageData* input = vtkImageData::GetData(inputs[0]->GetInformationObject(0));
  vtkImageData* output = vtkImageData::GetData(outputs->GetInformationObject(MaskPort));
  vtkPolyData* seedsOutput = vtkPolyData::GetData(outputs->GetInformationObject(SeedsPort));
  vtkPolyData* aortaOutput = vtkPolyData::GetData(outputs->GetInformationObject(AortaPort));
  vtkPolyData* bridgesOutput = vtkPolyData::GetData(outputs->GetInformationObject(BridgesPort));
  const coronary::ImageGrid grid = vtkCoronary::GridOf(input);
  const Extent& whole = grid.extent;

  // The mask's part; all of it when another output was asked for, so that it need not be made anew.
  vtkInformation* outInfo = outputs->GetInformationObject(MaskPort);
  Extent part = whole;
  if (request->Get(SDDP::FROM_OUTPUT_PORT()) == MaskPort)
  {
    outInfo->Get(SDDP::UPDATE_EXTENT(), part.data());
  }
  part = IsEmpty(part) ? Extent{ 0, -1, 0, -1, 0, -1 } : part;
  output->Initialize();
  output->SetExtent(part.data());
  output->SetOrigin(input->GetOrigin());
  output->SetSpacing(input->GetSpacing());
  output->SetDirectionMatrix(input->GetDirectionMatrix());
  output->GetFieldData()->PassData(input->GetFieldData());
  if (IsEmpty(whole))
  {
    Insert<vtkUnsignedCharArray>(
      output, vtkCoronaryArrayNames::VesselMask, std::vector<unsigned char>(), whole);
    output->GetPointData()->SetActiveScalars(vtkCoronaryArrayNames::VesselMask);
    return;
  }
  RequireVolume(grid);

  // Inputs.
  vtkDataArray* imageArray = this->InputArray(inputs, 0);
  Voxels image(imageArray, grid);
  vtkImageData* given = inputs[1]->GetNumberOfInformationObjects() > 0
    ? vtkImageData::GetData(inputs[1]->GetInformationObject(0))
    : nullptr;
  vtkDataArray* givenArray = nullptr;
  if (given)
  {
    givenArray = this->InputArray(inputs, 1);
    vtkCoronary::Require(IsNear(grid, vtkCoronary::GridOf(given)),
      "the vesselness is on another grid than the image: extent, spacing, origin or direction "
      "differs");
  }
  Origins origins;
  for (const std::array<double, 3>& seed : this->Seeds)
  {
    origins.seeds.push_back({ Vector3(seed.data()) });
  }
  if (inputs[2]->GetNumberOfInformationObjects() > 0)
  {
    AddSeeds(vtkPolyData::GetData(inputs[2]->GetInformationObject(0)), origins.seeds);
  }
  if (origins.seeds.empty())
  {
    const coronary::CoronaryOstia found = this->FindOstia(image.Image);
    origins.aorta = found.aorta;
    origins.ostia = found.ostia;
    for (const coronary::CoronaryOstium& ostium : found.ostia)
    {
      origins.seeds.push_back({ ostium.position, ostium.axis });
    }
    if (this->AutomaticWindow)
    {
      settings.window =
        coronary::BloodWindow{ coronary::CoronaryOstiaSettings().softTissue, found.aorta.mean };
    }
  }

  std::vector<float> computed;
  const float* vesselness = nullptr;
  std::unique_ptr<Voxels> givenVoxels;
  if (given)
  {
    givenVoxels = std::make_unique<Voxels>(givenArray, grid);
    vesselness = givenVoxels->Floats(givenArray);
  }
  else
  {
    computed = ComputeVesselness(this, image.Floats(imageArray), grid, settings.window);
    vesselness = computed.data();
  }

  const coronary::VesselSegmentationResult result =
    coronary::SegmentVessels(image.Image, vesselness, origins.seeds, settings,
      this->GenerateProbability, vtkCoronary::ProgressOf(this, OstiaShare + VesselnessShare, 0.98));
  Insert<vtkUnsignedCharArray>(output, vtkCoronaryArrayNames::VesselMask, result.mask, whole);
  output->GetPointData()->SetActiveScalars(vtkCoronaryArrayNames::VesselMask);
  if (this->GenerateProbability)
  {
    Insert<vtkFloatArray>(
      output, vtkCoronaryArrayNames::VesselProbability, result.probability, whole);
  }
  vtkNew<vtkDoubleArray> window;
  window->SetName(vtkCoronaryArrayNames::BloodWindow);
  window->InsertNextValue(result.window.tissue);
  window->InsertNextValue(result.window.blood);
  output->GetFieldData()->AddArray(window);
  const std::vector<coronary::VesselBridge> bridges(result.links.begin(), result.links.end());
  vtkCoronary::SetBridges(output->GetFieldData(), bridges);
  for (std::size_t s = 0; s < origins.seeds.size(); ++s)
  {
    if (!(result.seedVolume[s] > 0.0))
    {
      const std::string name =
        origins.ostia.empty() ? "seed " + std::to_string(s) : origins.ostia[s].name;
      vtkWarningMacro(<< "No vessel begins at " << name << " ("
                      << origins.seeds[s].position.transpose()
                      << "): nothing there looks like one within 2 mm.");
    }
    else if (const std::string doubt = DoubtOf(origins.seeds, result, s);
             origins.ostia.empty() && !doubt.empty())
    {
      vtkWarningMacro("Seed " << s << " (" << origins.seeds[s].position.transpose()
                              << ") is in no vessel: " << doubt
                              << ". Move it into the lumen of an artery.");
    }
  }

  for (vtkPolyData* data : { seedsOutput, aortaOutput, bridgesOutput })
  {
    data->Initialize();
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    data->SetPoints(points);
    data->GetFieldData()->PassData(input->GetFieldData());
  }
  const bool firstPiece =
    outputs->GetInformationObject(SeedsPort)->Get(SDDP::UPDATE_PIECE_NUMBER()) <= 0;
  WriteOrigins(origins, result.seedVolume, firstPiece, seedsOutput, aortaOutput);
  if (firstPiece)
  {
    AddBridges(bridgesOutput, result.links);
  }
}

int vtkVesselSegmentation::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  try
  {
    this->Execute(request, inputs, outputs);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the segmentation of the image",
      { "VesselSegmentationSettings: ", "VesselnessSettings: " });
  }
}

void vtkVesselSegmentation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  const auto print = [&](const char* name, const auto& value)
  { os << indent << name << ": " << value << "\n"; };
  for (std::size_t s = 0; s < this->Seeds.size(); ++s)
  {
    os << indent << "Seed " << s << ": " << this->Seeds[s][0] << " " << this->Seeds[s][1] << " "
       << this->Seeds[s][2] << "\n";
  }
  print("AutomaticOstia", this->AutomaticOstia);
  print("KnownOstia", this->KnownOstia != nullptr);
  print("AutomaticWindow", this->AutomaticWindow);
  print("TissueValue", this->TissueValue);
  print("BloodValue", this->BloodValue);
  print("WeakThreshold", this->WeakThreshold);
  print("StrongThreshold", this->StrongThreshold);
  print("TubularVesselness", this->TubularVesselness);
  print("MaximumRadius", this->MaximumRadius);
  print("LongestPath", this->LongestPath);
  print("MinimumIslandVolume", this->MinimumIslandVolume);
  print("CrossLesions", this->CrossLesions);
  print("LongestGap", this->LongestGap);
  print("MinimumLinkConfidence", this->MinimumLinkConfidence);
  print("GenerateProbability", this->GenerateProbability);
}
