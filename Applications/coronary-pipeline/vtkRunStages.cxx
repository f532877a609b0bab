#include "vtkRunStages.h"

#include "AtomicFile.h"
#include "Command.h"
#include "FileSeries.h"
#include "Interruption.h"
#include "MarkupsFile.h"
#include "MaskResampling.h"
#include "MatrixFile.h"
#include "MeshSequenceReport.h"
#include "MetaImageWriter.h"
#include "OptionChecks.h"
#include "Ranks.h"
#include "SegmentationFile.h"
#include "SeriesDescription.h"
#include "StagedFolder.h"
#include "vtkBridgeReport.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkMovingMesh.h"
#include "vtkRunAorta.h"
#include "vtkRunEdits.h"
#include "vtkRunLesions.h"
#include "vtkRunMask.h"
#include "vtkRunMeshes.h"
#include "vtkRunMotion.h"
#include "vtkRunRegion.h"
#include "vtkRunSurface.h"
#include "vtkRunTrees.h"
#include "vtkSurfaceFile.h"

#include "vtkBiharmonicSkinWeights.h"
#include "vtkCellData.h"
#include "vtkCenterlineSkeleton.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryTreeTopology.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFastMarchingCenterline.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkFrangiVesselness.h"
#include "vtkFrenetSweepSurface.h"
#include "vtkGatedImageReader.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationDoubleVectorKey.h"
#include "vtkMatrix3x3.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkReferencePhase.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkSurfaceCleaner.h"
#include "vtkTGFWriter.h"
#include "vtkTetrahedralMesher.h"
#include "vtkUnstructuredGrid.h"
#include "vtkVesselSegmentation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <future>
#include <stdexcept>

namespace coronary
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string PathOf(const RunStep& step, const std::string& name)
{
  return (fs::path(step.input.Settings.output) / name).string();
}

vtkSmartPointer<vtkPolyData> ReadLines(const RunStep& step, const std::string& name)
{
  return ReadPolyData(PathOf(step, name), step.input.Messages);
}

vtkSmartPointer<vtkPolyData> ReadTree(const RunStep& step)
{
  auto tree = ReadLines(step, "centerline.vtp");
  if (tree->GetNumberOfLines() == 0)
  {
    std::string reasons;
    const Json centerline = step.report.Of("centerline");
    for (const auto& one : centerline["trees"])
    {
      reasons += (reasons.empty() ? ": " : "; ") + one["name"].get<std::string>() + " " +
        one["message"].get<std::string>();
    }
    throw std::runtime_error("'" + PathOf(step, "centerline.vtp") +
      "' has no branches to make a surface of" + reasons + ".");
  }
  return tree;
}

namespace
{

/// How far a place on the wall may be from the axis, mm.
constexpr double SurfaceSnapDistance = 3.0;

/// Voxels, mm, in which coronary arteries can still be followed.
constexpr double MaximumVoxel = 1.25;

/// The number of the phase at a time.
int PhaseAt(vtkGatedImageReader* reader, double time)
{
  int best = 0;
  for (int phase = 1; phase < reader->GetNumberOfPhases(); ++phase)
  {
    if (std::abs(reader->GetPhaseTime(phase) - time) < std::abs(reader->GetPhaseTime(best) - time))
    {
      best = phase;
    }
  }
  return best;
}

template <typename Data>
vtkSmartPointer<Data> Detached(Data* data)
{
  auto copy = vtkSmartPointer<Data>::New();
  copy->ShallowCopy(data);
  // What follows is static, whether it comes from memory or from a file.
  copy->GetInformation()->Remove(vtkDataObject::DATA_TIME_STEP());
  return copy;
}

/// A volume that an earlier stage wrote, on the grid of the reference phase.
vtkSmartPointer<vtkImageData> ReadVolume(
  const RunStep& step, const std::string& name, const char* array)
{
  const std::string path = PathOf(step, name);
  vtkNew<vtkGatedImageReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  step.input.Messages.ThrowIfError();
  auto volume = Detached(reader->GetOutput());
  vtkImageData* reference = step.input.Reference;
  int dimensions[3];
  int wanted[3];
  volume->GetDimensions(dimensions);
  reference->GetDimensions(wanted);
  if (!std::equal(wanted, wanted + 3, dimensions))
  {
    throw std::runtime_error("'" + path + "' has another size than the reference phase.");
  }
  // The file has the same grid, but not in the same bits.
  volume->SetExtent(reference->GetExtent());
  volume->SetOrigin(reference->GetOrigin());
  volume->SetSpacing(reference->GetSpacing());
  volume->SetDirectionMatrix(reference->GetDirectionMatrix());
  volume->GetPointData()->GetScalars()->SetName(array);
  volume->SetFieldData(vtkSmartPointer<vtkFieldData>::New());
  volume->GetFieldData()->PassData(reference->GetFieldData());
  return volume;
}

void LoadReference(const RunStep& step, bool automatic, double time)
{
  RunInput& input = step.input;
  if (input.Reference)
  {
    return;
  }
  vtkNew<vtkReferencePhase> reference;
  reference->SetInputConnection(input.Reader->GetOutputPort());
  reference->SetAutomatic(automatic);
  reference->SetTime(time);
  UpdateAtTime(reference, 0, time, input.Messages, step.progress);
  input.Reference = Detached(vtkImageData::SafeDownCast(reference->GetOutputDataObject(0)));
}

void NeedReference(const RunStep& step)
{
  LoadReference(step, false, step.input.Chosen->time);
}

void NeedVesselness(const RunStep& step)
{
  NeedReference(step);
  RunInput& input = step.input;
  if (!input.Vesselness)
  {
    input.Vesselness = ReadVolume(step, "vesselness.mha", vtkCoronaryArrayNames::Vesselness);
    vtkCoronary::AddArray<vtkDoubleArray>(input.Vesselness->GetFieldData(),
      vtkCoronaryArrayNames::VesselnessSigmas,
      step.report.Of("vesselness")["sigmas"].get<std::vector<double>>());
    vtkCoronary::AddArray<vtkDoubleArray>(input.Vesselness->GetFieldData(),
      vtkCoronaryArrayNames::VesselnessC,
      std::vector<double>{ step.report.Of("vesselness")["c"].get<double>() });
  }
}

void NeedMask(const RunStep& step)
{
  NeedReference(step);
  if (!step.input.Mask)
  {
    step.input.Mask = ReadVolume(step, "mask.mha", vtkCoronaryArrayNames::VesselMask);
    // The image's file has no room for them.
    vtkCoronary::SetBridges(
      step.input.Mask->GetFieldData(), BridgesOfLines(ReadLines(step, "bridges.vtp")));
  }
}

bool KeepGoing(double)
{
  return Interruption() == 0;
}

void Update(vtkAlgorithm* algorithm, const RunStep& step)
{
  UpdateAtTime(algorithm, 0, 0.0, step.input.Messages, step.progress);
}

/// The slices that a rank works on; none: the last is before the first.
std::array<int, 6> SlabOf(int rank, const int whole[6])
{
  std::array<int, 6> slab;
  std::copy_n(whole, 6, slab.begin());
  const std::int64_t slices = whole[5] - whole[4] + 1;
  slab[4] = whole[4] + static_cast<int>(slices * rank / Ranks().Size());
  slab[5] = whole[4] + static_cast<int>(slices * (rank + 1) / Ranks().Size()) - 1;
  return slab;
}

/// Each rank computes a slab, and the first one gets all of them.
vtkSmartPointer<vtkImageData> ComputeInSlabs(vtkFrangiVesselness* vesselness, const RunStep& step)
{
  vtkNew<vtkReferencePhase> phase; // lives as long as it is asked
  if (!Ranks().IsFirst())
  {
    // Of the reference no more is read than the slab and its surroundings.
    phase->SetInputConnection(step.input.Reader->GetOutputPort());
    phase->SetAutomatic(false);
    phase->SetTime(step.input.Chosen->time);
    vesselness->SetInputConnection(phase->GetOutputPort());
  }
  vesselness->UpdateInformation();
  int whole[6];
  vesselness->GetOutputInformation(0)->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole);
  const std::array<int, 6> slab = SlabOf(Ranks().Rank(), whole);
  const float* own = nullptr;
  std::size_t size = 0;
  if (slab[4] <= slab[5])
  {
    WithProgress(vesselness, step.progress, [&] { vesselness->UpdateExtent(slab.data()); });
    step.input.Messages.ThrowIfError();
    own = static_cast<const float*>(vesselness->GetOutput()->GetScalarPointer());
    size = static_cast<std::size_t>(vesselness->GetOutput()->GetNumberOfPoints()) * sizeof(float);
  }
  vtkSmartPointer<vtkImageData> all;
  if (Ranks().IsFirst())
  {
    all = vtkSmartPointer<vtkImageData>::New();
    all->CopyStructure(vesselness->GetOutput());
    all->SetExtent(whole);
    vtkNew<vtkFloatArray> values;
    values->SetName(vesselness->GetOutput()->GetPointData()->GetScalars()->GetName());
    values->SetNumberOfTuples(all->GetNumberOfPoints());
    all->GetPointData()->SetScalars(values);
    all->GetFieldData()->PassData(vesselness->GetOutput()->GetFieldData());
  }
  Ranks().Collect(own, size, all ? all->GetScalarPointer() : nullptr);
  return all;
}

/// What is known of an image before anything is looked for in it: voxels too large for coronary arteries, values that are
/// no HU. @return whether the contrast has to be measured because its scale is unknown
bool DoubtImage(RunStep& step)
{
  vtkImageData* image = step.input.Reference;
  const std::string name = "'" + step.input.Chosen->image + "'";
  double spacing[3];
  image->GetSpacing(spacing);
  const double maximum = *std::max_element(spacing, spacing + 3);
  if (maximum > MaximumVoxel)
  {
    step.warnings.push_back(name + " has voxels of " + Format(maximum) +
      " mm: arteries narrower than " + Format(2.0 * maximum) +
      " mm are not resolved, and will be missing or end early; take a reconstruction of at most " +
      Format(0.7) + " mm");
  }
  double range[2];
  RangeOf(image, range);
  const bool unknown =
    range[1] - range[0] < MinimumRangeOfHU && step.input.Settings.c == RunSettings().c;
  if (unknown)
  {
    step.warnings.push_back(name + " has values from " + Format(range[0]) + " to " +
      Format(range[1]) +
      ", which are no HU: --c 0 is taken, and --window may have to say what is tissue and blood");
  }
  return unknown;
}

Json MakeVesselness(RunStep& step)
{
  const RunSettings& settings = step.input.Settings;
  vtkNew<vtkFrangiVesselness> vesselness;
  vesselness->SetSigmaMin(settings.scales[0]);
  vesselness->SetSigmaMax(settings.scales[1]);
  vesselness->SetAutomaticC(!(settings.c > 0.0));
  vesselness->SetC(settings.c > 0.0 ? settings.c : 1.0);
  std::string doubt;
  if (Ranks().IsFirst())
  {
    NeedReference(step);
    doubt = DoubtImage(step) ? "no HU" : "";
    vesselness->SetInputData(step.input.Reference);
  }
  if (!Ranks().FromFirst(doubt).empty())
  {
    vesselness->SetAutomaticC(true);
  }
  vtkSmartPointer<vtkImageData> heart = HeartMask(step);
  if (heart)
  {
    vesselness->SetInputData(1, heart);
  }
  if (Ranks().Size() > 1)
  {
    step.input.Vesselness = ComputeInSlabs(vesselness, step);
  }
  else
  {
    Update(vesselness, step);
    step.input.Vesselness = Detached(vesselness->GetOutput());
  }
  if (!Ranks().IsFirst())
  {
    return {};
  }
  vtkImageData* response = step.input.Vesselness;
  WriteMetaImage(step.Add("vesselness.mha"), vtkCoronary::GridOf(response),
    static_cast<const float*>(response->GetScalarPointer()), settings.compress, KeepGoing);
  step.summary = "vesselness with c = " + Format(vesselness->GetUsedC());
  return { { "file", "vesselness.mha" },
    { "sigmas", Numbers(response, vtkCoronaryArrayNames::VesselnessSigmas) },
    { "c", vesselness->GetUsedC() }, { "region", DescribeRegion(step) } };
}

/// The segmentation with its seeds, the aorta and the ways across lesions; a mask that is there already stays.
void Segment(const RunStep& step, vtkSmartPointer<vtkImageData>& mask,
  vtkSmartPointer<vtkPolyData>& seeds, vtkSmartPointer<vtkPolyData>& aorta,
  vtkSmartPointer<vtkPolyData>& bridges)
{
  const RunSettings& settings = step.input.Settings;
  vtkNew<vtkVesselSegmentation> segmentation;
  segmentation->SetInputData(step.input.Reference);
  segmentation->SetVesselnessData(step.input.Vesselness);
  const std::vector<double>& given = step.input.Seeds;
  for (std::size_t n = 0; n + 2 < given.size(); n += 3)
  {
    segmentation->AddSeed(given[n], given[n + 1], given[n + 2]);
  }
  segmentation->SetKnownOstia(step.input.Ostia);
  segmentation->SetMaximumRadius(settings.maximumRadius);
  if (!settings.window.empty())
  {
    segmentation->AutomaticWindowOff();
    segmentation->SetTissueValue(settings.window[0]);
    segmentation->SetBloodValue(settings.window[1]);
  }
  try
  {
    Update(segmentation, step);
  }
  catch (const std::runtime_error& error)
  {
    const std::string text = error.what();
    const std::size_t begin = text.find("AutomaticOstia found no ostium (");
    const std::size_t end = text.rfind("): give points");
    if (begin == std::string::npos || end == std::string::npos)
    {
      throw;
    }
    throw std::runtime_error("'" + step.input.Chosen->image + "': no coronary ostium was found: " +
      text.substr(text.find('(', begin) + 1, end - text.find('(', begin) - 1) +
      ". Give the ostia with --seed X Y Z (LPS, mm); of values that are no HU, --window TISSUE "
      "BLOOD too.");
  }
  seeds =
    vtkPolyData::SafeDownCast(segmentation->GetOutputDataObject(vtkVesselSegmentation::SeedsPort));
  aorta =
    vtkPolyData::SafeDownCast(segmentation->GetOutputDataObject(vtkVesselSegmentation::AortaPort));
  if (given.empty())
  {
    std::vector<double> confidences;
    for (const auto& seed : DescribeSeeds(seeds))
    {
      confidences.push_back(seed["confidence"].get<double>());
    }
    RequireOstia(step, confidences);
  }
  if (!mask)
  {
    mask = Detached(segmentation->GetOutput());
    bridges = vtkPolyData::SafeDownCast(
      segmentation->GetOutputDataObject(vtkVesselSegmentation::BridgesPort));
    return;
  }
  // How much of the other segmentation hangs on a seed is of no interest.
  seeds->GetPointData()->RemoveArray(vtkCoronaryArrayNames::SeedVolume);
}

/// A given mask at the voxels of the reference phase.
vtkSmartPointer<vtkImageData> FittedMask(
  const RunStep& step, const std::string& path, Json& numbers)
{
  vtkImageData* reference = step.input.Reference;
  const SegmentationFile file(path);
  const SegmentationMask given = file.Mask(step.input.Settings.maskSegments, KeepGoing);
  ResampledMask fitted;
  try
  {
    fitted = ResampleMask(given.grid, given.voxels, vtkCoronary::GridOf(reference));
  }
  catch (const std::invalid_argument& error)
  {
    throw std::runtime_error("'" + path + "': " + error.what() + ".");
  }
  auto mask = vtkSmartPointer<vtkImageData>::New();
  mask->CopyStructure(reference);
  mask->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  std::copy(fitted.voxels.begin(), fitted.voxels.end(),
    static_cast<unsigned char*>(mask->GetScalarPointer()));
  mask->GetPointData()->GetScalars()->SetName(vtkCoronaryArrayNames::VesselMask);
  mask->GetFieldData()->PassData(reference->GetFieldData());
  numbers["given_mask"] = path;
  numbers["given_voxels"] = given.count;
  numbers["voxels"] = fitted.count;
  numbers["resampled"] = !fitted.sameVoxels;
  numbers["share_inside_image"] = fitted.insideShare;
  return mask;
}

Json MakeSegmentation(RunStep& step)
{
  if (step.input.IsMask())
  {
    return MakeGivenMask(step);
  }
  const RunSettings& settings = step.input.Settings;
  const std::string givenMask = step.input.MaskOf(step.input.Chosen->number);
  const std::vector<double>& given = step.input.Seeds;
  Json numbers = { { "file", "mask.mha" } };
  NeedVesselness(step);
  vtkSmartPointer<vtkImageData> mask;
  if (!givenMask.empty())
  {
    mask = FittedMask(step, givenMask, numbers);
  }
  vtkSmartPointer<vtkPolyData> seeds;
  auto aorta = vtkSmartPointer<vtkPolyData>::New();
  auto bridges = vtkSmartPointer<vtkPolyData>::New();
  if (mask && !given.empty())
  {
    seeds = SeedsOfSurface(nullptr, given);
  }
  else
  {
    if (given.empty())
    {
      FindOstia(step);
    }
    Segment(step, mask, seeds, aorta, bridges);
    numbers["window"] = Numbers(mask, vtkCoronaryArrayNames::BloodWindow);
  }
  step.input.Mask = mask;
  WriteMetaImage(step.Add("mask.mha"), vtkCoronary::GridOf(mask),
    static_cast<const unsigned char*>(mask->GetScalarPointer()), settings.compress, KeepGoing);
  WritePolyData(step.Add("ostia.vtp"), seeds, step.input.Messages);
  WritePolyData(step.Add("aorta.vtp"), aorta, step.input.Messages);
  WritePolyData(step.Add("bridges.vtp"), bridges, step.input.Messages);
  Json described = DescribeSeeds(seeds);
  for (const auto& seed : described)
  {
    char text[160];
    std::snprintf(text, sizeof(text), "%s%s at %.1f %.1f %.1f (confidence %.2f), %.0f mm^3",
      step.summary.empty() ? "" : "; ", seed["name"].get<std::string>().c_str(),
      seed["position"][0].get<double>(), seed["position"][1].get<double>(),
      seed["position"][2].get<double>(), seed["confidence"].get<double>(),
      seed["volume"].get<double>());
    step.summary += text;
  }
  if (!givenMask.empty())
  {
    char text[80];
    std::snprintf(text, sizeof(text), "; given mask, %.1f %% of it in the image",
      100.0 * numbers["share_inside_image"].get<double>());
    step.summary += text;
  }
  numbers["seeds"] = described;
  numbers["lost"] = given.empty() ? OstiaNotFound(described) : Json::array();
  numbers["seeds_file"] = "ostia.vtp";
  numbers["aorta_file"] = "aorta.vtp";
  numbers["bridges_file"] = "bridges.vtp";
  numbers["aorta"] = MakeAorta(step);
  return numbers;
}

/// A closed surface in place of images; gives the seeds.
vtkSmartPointer<vtkPolyData> PrepareSurface(
  RunStep& step, vtkFastMarchingCenterline* centerline, Json& numbers)
{
  const RunSettings& settings = step.input.Settings;
  vtkNew<vtkSurfaceCleaner> cleaner;
  cleaner->SetInputData(ReadSurface(settings.input.front(), step.input.Messages));
  UpdateAtTime(
    cleaner, 0, 0.0, step.input.Messages, [&](double fraction) { step.progress(0.2 * fraction); });
  vtkPolyData* surface = cleaner->GetOutput();
  if (surface->GetNumberOfPolys() == 0)
  {
    throw std::runtime_error(
      "'" + settings.input.front() + "' has no surface that could be closed.");
  }
  auto seeds = SeedsOfSurface(surface, step.input.Seeds);
  centerline->SetInputDataObject(0, surface);
  centerline->SetSnapDistance(SurfaceSnapDistance);
  if (step.input.Seeds.empty())
  {
    // Which end of its vessels a tree begins at is known when they are.
    centerline->SetInputDataObject(1, seeds);
    UpdateAtTime(centerline, 0, 0.0, step.input.Messages,
      [&](double fraction) { step.progress(0.2 + 0.3 * fraction); });
    if (centerline->GetOutput()->GetNumberOfCells() > 0)
    {
      seeds = WidestEnds(centerline->GetOutput());
    }
  }
  WritePolyData(step.Add("given_surface.vtp"), surface, step.input.Messages);
  WritePolyData(step.Add("ostia.vtp"), seeds, step.input.Messages);
  numbers["given_surface_file"] = "given_surface.vtp";
  numbers["seeds_file"] = "ostia.vtp";
  numbers["seeds"] = DescribeSeeds(seeds);
  Json repairs = Json::array();
  if (auto* list = vtkStringArray::SafeDownCast(
        surface->GetFieldData()->GetAbstractArray(vtkCoronaryArrayNames::Repairs)))
  {
    for (vtkIdType n = 0; n < list->GetNumberOfValues(); ++n)
    {
      repairs.push_back(list->GetValue(n));
    }
  }
  numbers["repairs"] = repairs;
  return seeds;
}

Json MakeCenterline(RunStep& step)
{
  const RunSettings& settings = step.input.Settings;
  Json numbers = { { "file", "centerline.vtp" }, { "bifurcations_file", "bifurcations.vtp" },
    { "lines_file", "centerline_lines.vtp" }, { "status_file", "status.csv" },
    { "edits", Json::array() } };
  vtkNew<vtkFastMarchingCenterline> centerline;
  centerline->SetMinimumBranchLength(settings.minimumBranch);
  centerline->SetStepLimit(settings.centerlineSteps);
  vtkSmartPointer<vtkPolyData> seeds;
  if (step.input.IsSurface())
  {
    seeds = PrepareSurface(step, centerline, numbers);
  }
  else if (step.input.IsMask())
  {
    NeedGivenMask(step);
    seeds = ReadLines(step, "ostia.vtp");
    centerline->SetImageKind(vtkFastMarchingCenterline::MaskImage);
    centerline->SetInputDataObject(0, EditedMask(step, numbers));
  }
  else
  {
    NeedVesselness(step);
    seeds = ReadLines(step, "ostia.vtp");
    centerline->SetInputDataObject(0, step.input.Vesselness);
    centerline->SetInputDataObject(3, step.input.Reference);
    if (!settings.beyondMask)
    {
      NeedMask(step);
      centerline->SetInputDataObject(4, EditedMask(step, numbers));
    }
  }
  RequireMaskOfEdits(step);
  centerline->SetInputDataObject(1, seeds);
  vtkNew<vtkCoronaryTreeTopology> topology;
  topology->SetInputConnection(centerline->GetOutputPort());
  topology->SetRootData(seeds);
  topology->SetLabelSegments(settings.labels);
  UpdateAtTime(centerline, 0, 0.0, step.input.Messages,
    [&](double fraction) { step.progress(0.5 + 0.35 * fraction); });
  vtkPolyData* raw = centerline->GetOutput();
  auto* lines = vtkPolyData::SafeDownCast(
    centerline->GetOutputDataObject(vtkFastMarchingCenterline::LinesPort));
  vtkDataArray* blurs = raw->GetFieldData()->GetArray(vtkCoronaryArrayNames::ImageBlur);
  const double blur = blurs && blurs->GetNumberOfValues() > 0 ? blurs->GetTuple1(0) : 0.0;
  UpdateAtTime(topology, 0, 0.0, step.input.Messages,
    [&](double fraction) { step.progress(0.85 + 0.1 * fraction); });
  vtkSmartPointer<vtkPolyData> tree = topology->GetOutput();
  vtkSmartPointer<vtkPolyData> forks = vtkPolyData::SafeDownCast(
    topology->GetOutputDataObject(vtkCoronaryTreeTopology::BifurcationPort));
  EditTree(step, tree, forks, numbers);
  const bool measured = !step.input.IsSurface() && !step.input.IsMask();
  if (measured)
  {
    const TreeLesions lesions = GradeTreeLesions(
      tree, step.input.Reference, blur, [&] { return step.Add("calcium.mha"); },
      [&](double fraction) { step.progress(0.95 + 0.05 * fraction); });
    WriteFileAtomically(step.Add("lesions.csv"), lesions.table);
    numbers["lesions_file"] = "lesions.csv";
    numbers["lesions"] = lesions.lesions;
    numbers["calcium"] = lesions.calcium;
  }
  const Json segmentation = step.report.Of("segmentation");
  const bool windowed = measured && segmentation.contains("window");
  if (windowed)
  {
    AddLooseVessels(tree, step.input.Reference, step.input.Vesselness,
      segmentation["window"][0].get<double>(), segmentation["window"][1].get<double>());
  }
  WritePolyData(step.Add("centerline.vtp"), tree, step.input.Messages);
  WritePolyData(step.Add("bifurcations.vtp"), forks, step.input.Messages);
  WritePolyData(step.Add("centerline_lines.vtp"), lines, step.input.Messages);
  const Json trees = DescribeTrees(raw, seeds);
  WriteFileAtomically(step.Add("status.csv"), StatusTable(trees));
  auto* dominance = vtkStringArray::SafeDownCast(
    tree->GetFieldData()->GetAbstractArray(vtkCoronaryArrayNames::Dominance));
  vtkDataArray* complete = raw->GetFieldData()->GetArray(vtkCoronaryArrayNames::Complete);
  double length = 0.0;
  vtkDataArray* lengths = tree->GetCellData()->GetArray(vtkCoronaryArrayNames::Length);
  for (vtkIdType cell = 0; cell < tree->GetNumberOfCells(); ++cell)
  {
    length += lengths->GetTuple1(cell);
  }
  numbers["trees"] = trees;
  numbers["veins"] = DescribeVeins(raw);
  for (const std::string& warning : VeinWarnings(numbers["veins"]))
  {
    step.warnings.push_back(warning);
  }
  numbers["bridges"] = Json::array();
  if (windowed)
  {
    numbers["bridges"] = DescribeBridges(ReadLines(step, "bridges.vtp"), tree, step.input.Reference,
      segmentation["window"][1].get<double>());
    for (const std::string& warning : BridgeWarnings(numbers["bridges"]))
    {
      step.warnings.push_back(warning);
    }
  }
  // Of a surface without seeds every piece is a tree, also fragments without a vessel.
  numbers["lost"] =
    step.input.IsSurface() && step.input.Seeds.empty() ? Json::array() : TreesNotFound(trees);
  numbers["checks"] = DescribeChecks(tree);
  for (const auto& check : numbers["checks"])
  {
    char sure[40];
    std::snprintf(sure, sizeof(sure), " (confidence %.2f)", check["confidence"].get<double>());
    step.warnings.push_back(check["what"].get<std::string>() + sure);
  }
  numbers["complete"] = complete && complete->GetTuple1(0) != 0.0;
  numbers["branches"] = tree->GetNumberOfLines();
  numbers["bifurcations"] = forks->GetNumberOfPoints();
  numbers["dominance"] = dominance && dominance->GetNumberOfValues() > 0
    ? std::string(dominance->GetValue(0))
    : std::string();
  numbers["image_blur"] = Numbers(raw, vtkCoronaryArrayNames::ImageBlur);
  step.summary =
    std::to_string(tree->GetNumberOfLines()) + " branches, " + Format(std::round(length)) + " mm";
  if (!numbers["edits"].empty())
  {
    step.summary += "; " + DescribeLastEdit(numbers["edits"]);
  }
  return numbers;
}

Json MakeSurface(RunStep& step)
{
  const RunSettings& settings = step.input.Settings;
  vtkSmartPointer<vtkPolyData> surface;
  auto caps = vtkSmartPointer<vtkPolyData>::New();
  const bool given = step.input.IsSurface() && settings.surface == "given";
  const auto tree = ReadTree(step);
  if (!step.input.IsSurface())
  {
    RequireVessels(tree, PathOf(step, "centerline.vtp"), settings.maximumRadius);
  }
  if (given)
  {
    surface = ReadLines(step, "given_surface.vtp");
  }
  else
  {
    vtkNew<vtkFrenetSweepSurface> sweep;
    sweep->SetInputData(tree);
    if (settings.contours && !step.input.IsSurface())
    {
      NeedReference(step);
      sweep->SetImageData(step.input.Reference);
    }
    sweep->SetMinimumEdgeLength(settings.edges[0]);
    sweep->SetMaximumEdgeLength(settings.edges[1]);
    sweep->SetCapping(!settings.openEnds);
    Update(sweep, step);
    surface = sweep->GetOutput();
    caps = sweep->GetCaps();
  }
  WritePolyData(step.Add("surface.vtp"), surface, step.input.Messages);
  WritePolyData(step.Add("caps.vtp"), caps, step.input.Messages);
  step.summary = std::to_string(surface->GetNumberOfPolys()) + " triangles";
  Json numbers = { { "file", "surface.vtp" }, { "caps_file", "caps.vtp" },
    { "kind", given ? "given" : "swept" }, { "triangles", surface->GetNumberOfPolys() },
    { "points", surface->GetNumberOfPoints() }, { "caps", caps->GetNumberOfPoints() } };
  DescribeChanges(surface, numbers);
  if (!numbers["left_out"].empty())
  {
    step.summary += ", " + std::to_string(numbers["left_out"].size()) + " branches left out";
  }
  return numbers;
}

Json MakeVolume(RunStep& step)
{
  vtkMessageTrap& messages = step.input.Messages;
  const auto surface = ReadLines(step, "surface.vtp");
  // Branches that have no wall have no bones.
  const auto tree = SweptPart(ReadTree(step), surface);
  vtkNew<vtkCenterlineSkeleton> skeleton;
  skeleton->SetInputData(tree);
  UpdateAtTime(skeleton, 0, 0.0, messages, [](double) {});
  vtkPolyData* bones = skeleton->GetOutput();
  vtkNew<vtkTetrahedralMesher> mesher;
  mesher->SetSkeletonData(bones);
  // Where the wall was smoothed, the line may leave it.
  mesher->LeaveOutsideOn();
  // The smallest vessels of a coarse image may need smaller ones than the filter's default allows; the report
  // has the least.
  mesher->SetMinimumVolume(0.0);
  const std::string helped = FillSurface(mesher, surface, tree, [&] { Update(mesher, step); });
  vtkUnstructuredGrid* volume = mesher->GetOutput();
  WritePolyData(step.Add("skeleton.vtp"), bones, messages);
  vtkNew<vtkTGFWriter> graph;
  graph->SetInputData(bones);
  graph->SetFileName(step.Add("skeleton.tgf").c_str());
  graph->Write();
  messages.ThrowIfError();
  WriteUnstructuredGrid(step.Add("volume.vtu"), volume, messages);
  WritePolyData(step.Add("volume_boundary.vtp"), mesher->GetBoundary(), messages);
  WritePolyData(step.Add("volume_skeleton.vtp"), mesher->GetEdges(), messages);
  auto* backend = vtkStringArray::SafeDownCast(
    volume->GetFieldData()->GetAbstractArray(vtkCoronaryArrayNames::Backend));
  step.summary = std::to_string(volume->GetNumberOfCells()) + " tetrahedra";
  return { { "file", "volume.vtu" }, { "boundary_file", "volume_boundary.vtp" },
    { "skeleton_file", "volume_skeleton.vtp" },
    { "backend",
      backend && backend->GetNumberOfValues() > 0 ? std::string(backend->GetValue(0))
                                                  : std::string() },
    { "tetrahedra", volume->GetNumberOfCells() }, { "points", volume->GetNumberOfPoints() },
    { "least_dihedral_angle_rad",
      Numbers(volume, vtkCoronaryArrayNames::MeshMinimumDihedralAngle) },
    { "least_volume_mm3", Numbers(volume, vtkCoronaryArrayNames::MeshMinimumVolume) },
    { "total_volume_mm3", Numbers(volume, vtkCoronaryArrayNames::TotalVolume) },
    { "tries", Numbers(volume, vtkCoronaryArrayNames::Tries) }, { "helped_by", helped } };
}

/// A row a point, a column a bone, out of the compact form that moves the mesh.
Eigen::MatrixXd WeightMatrix(vtkUnstructuredGrid* mesh, vtkIdType bones)
{
  vtkDataArray* indices = mesh->GetPointData()->GetArray(vtkCoronaryArrayNames::BoneIndices);
  vtkDataArray* weights = mesh->GetPointData()->GetArray(vtkCoronaryArrayNames::BoneWeightsCompact);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(mesh->GetNumberOfPoints(), bones);
  for (vtkIdType point = 0; point < mesh->GetNumberOfPoints(); ++point)
  {
    for (int n = 0; n < indices->GetNumberOfComponents(); ++n)
    {
      const auto bone = static_cast<vtkIdType>(indices->GetComponent(point, n));
      if (bone >= 0)
      {
        matrix(point, bone) = weights->GetComponent(point, n);
      }
    }
  }
  return matrix;
}

Json MakeWeights(RunStep& step)
{
  const RunSettings& settings = step.input.Settings;
  const auto bones = ReadLines(step, "skeleton.vtp");
  vtkNew<vtkBiharmonicSkinWeights> weights;
  weights->SetInputData(ReadUnstructuredGrid(PathOf(step, "volume.vtu"), step.input.Messages));
  weights->SetSkeletonData(bones);
  weights->SetCacheFolder(settings.weightCache.c_str());
  weights->SetLeaveOutside(settings.leaveBonesOutside);
  Update(weights, step);
  vtkUnstructuredGrid* bound = weights->GetOutput();
  const std::string mesh = step.Add("weights.vtu");
  std::future<void> matrix = std::async(std::launch::async,
    [bound, path = step.Add("weights.dmat"), count = bones->GetNumberOfLines()]
    { WriteMatrixFile(path, WeightMatrix(bound, count)); });
  WriteUnstructuredGrid(mesh, bound, step.input.Messages);
  matrix.get();
  Json numbers = { { "file", "weights.vtu" }, { "matrix_file", "weights.dmat" },
    { "skeleton_file", "skeleton.vtp" }, { "skeleton_graph_file", "skeleton.tgf" },
    { "bones", bones->GetNumberOfLines() }, { "joints", bones->GetNumberOfPoints() },
    { "converged", Numbers(bound, vtkCoronaryArrayNames::WeightsConverged) },
    { "iterations", Numbers(bound, vtkCoronaryArrayNames::WeightsIterations) },
    { "residual", Numbers(bound, vtkCoronaryArrayNames::WeightsResidual) },
    { "energy_gap", Numbers(bound, vtkCoronaryArrayNames::WeightsEnergyGap) },
    { "row_sums", Numbers(bound, vtkCoronaryArrayNames::WeightsRowSums) },
    { "error_on_bones", Numbers(bound, vtkCoronaryArrayNames::WeightsOnBones) } };
  if (settings.leaveBonesOutside)
  {
    numbers["left_out_bones"] = Numbers(bound, vtkCoronaryArrayNames::LeftOutBones);
  }
  step.summary = std::to_string(bones->GetNumberOfLines()) + " bones";
  return numbers;
}

/// The masks of a series.json, one a phase; empty when none of them has one.
std::vector<std::string> MasksOfSeries(const std::string& path)
{
  std::vector<std::string> masks;
  bool any = false;
  for (const SeriesDescription::Phase& phase : ReadSeriesDescription(path).phases)
  {
    masks.push_back(ResolveSeriesPath(path, phase.mask));
    any = any || !phase.mask.empty();
  }
  return any ? masks : std::vector<std::string>();
}

/// Of the phases with a mask the one nearest to a time; -1: none has one.
int NearestWithMask(const RunInput& input, double time)
{
  int best = -1;
  for (int phase = 0; phase < input.Reader->GetNumberOfPhases(); ++phase)
  {
    const auto away = [&](int other) { return std::abs(input.Reader->GetPhaseTime(other) - time); };
    if (!input.MaskOf(phase).empty() && (best < 0 || away(phase) < away(best)))
    {
      best = phase;
    }
  }
  return best;
}
}

std::string RunInput::MaskOf(int phase) const
{
  if (!this->Settings.mask.empty())
  {
    return this->Settings.mask;
  }
  const auto number = static_cast<std::size_t>(phase);
  return phase >= 0 && number < this->Masks.size() ? this->Masks[number] : std::string();
}

bool RunInput::HasMasks() const
{
  return !this->Settings.mask.empty() || !this->Masks.empty();
}

RunInput::RunInput(
  const RunSettings& settings, vtkMessageTrap& messages, std::vector<TreeEdit> edits)
  : Settings(settings)
  , Messages(messages)
  , Edits(std::move(edits))
  , Seeds(settings.seeds)
{
  if (!settings.seedFile.empty())
  {
    for (const Markup& markup : ReadMarkupsFile(settings.seedFile))
    {
      for (const Markup::Point& point : markup.points)
      {
        this->Seeds.insert(this->Seeds.end(), point.position.data(), point.position.data() + 3);
      }
    }
    if (this->Seeds.size() == settings.seeds.size())
    {
      throw std::runtime_error("'" + settings.seedFile + "' has no points.");
    }
  }
  if (this->IsMask())
  {
    return;
  }
  const auto surfaces = std::count_if(settings.input.begin(), settings.input.end(), IsSurfaceFile);
  if (surfaces > 0)
  {
    if (settings.input.size() > 1)
    {
      throw std::runtime_error("'" + settings.input[0] + "' and " +
        std::to_string(settings.input.size() - 1) + " more: a surface is the only input of a run.");
    }
    if (!std::ifstream(settings.input.front()))
    {
      throw std::runtime_error("Cannot open '" + settings.input.front() + "'.");
    }
    return;
  }
  this->Reader = vtkSmartPointer<vtkGatedImageReader>::New();
  for (const std::string& path : settings.input)
  {
    this->Reader->AddFileName(path.c_str());
  }
  for (std::size_t i = 0; i < settings.fractions.size(); ++i)
  {
    this->Reader->SetPhaseFraction(static_cast<int>(i), settings.fractions[i]);
  }
  this->Reader->SetCycleLength(settings.cycleMs / 1000.0);
  if (!settings.series.empty())
  {
    this->Reader->SetSeriesInstanceUID(settings.series.c_str());
  }
  this->Reader->UpdateInformation();
  messages.ThrowIfError();
  const std::string& first = settings.input.front();
  if (settings.input.size() == 1 && fs::path(first).extension() == ".json")
  {
    this->Masks = MasksOfSeries(first);
  }
  if (!settings.mask.empty() && std::isnan(settings.time) && this->Reader->GetNumberOfPhases() > 1)
  {
    throw UsageError("--mask: --time has to say which of the " +
      std::to_string(this->Reader->GetNumberOfPhases()) + " phases the mask is of");
  }
}

RunInput::~RunInput() = default;

std::vector<std::string> RunInput::Files() const
{
  std::vector<std::string> files = this->Settings.input;
  const fs::path folder = files.empty() ? fs::path() : fs::path(files.front()).parent_path();
  for (const std::string& file : this->Masks)
  {
    if (!file.empty())
    {
      files.push_back(file);
    }
  }
  for (const std::string& file : { this->Settings.mask, this->Settings.seedFile })
  {
    if (!file.empty())
    {
      files.push_back(file);
    }
  }
  for (int n = 0; this->Reader && n < this->Reader->GetNumberOfPhases(); ++n)
  {
    // Those of a series.json are named as in it.
    const std::string name = this->Reader->GetPhaseFileName(n);
    std::error_code error;
    files.push_back(fs::exists(folder / name, error) ? (folder / name).string() : name);
  }
  return files;
}

std::string RunInput::ReasonWithoutMotion() const
{
  if (this->IsSurface() || this->IsMask())
  {
    return this->IsMask() ? "a mask has no images to track" : "a surface has no images to track";
  }
  const int phases = this->Reader->GetNumberOfPhases();
  if (phases < 2)
  {
    return "one phase only";
  }
  return phases < 3 && this->Settings.tracked == "even" ? "two phases, of which one is tracked"
                                                        : std::string();
}

std::string RunStep::Add(const std::string& name)
{
  this->files.push_back(name);
  return this->folder.Add(name);
}

void FindReference(RunStep& step)
{
  RunInput& input = step.input;
  vtkGatedImageReader* reader = input.Reader;
  const bool automatic = std::isnan(input.Settings.time) && reader->GetNumberOfPhases() > 1;
  LoadReference(step, automatic,
    std::isnan(input.Settings.time) ? reader->GetPhaseTime(0) : input.Settings.time);
  double time = reader->GetPhaseTime(0);
  if (vtkDataArray* found =
        input.Reference->GetFieldData()->GetArray(vtkCoronaryArrayNames::PhaseTime))
  {
    time = found->GetTuple1(0);
  }
  int phase = PhaseAt(reader, time);
  // Of several masks that of the quietest phase; where there is none, the nearest.
  if (automatic && input.HasMasks() && NearestWithMask(input, time) != phase)
  {
    phase = NearestWithMask(input, time);
    input.Reference = nullptr;
    LoadReference(step, false, reader->GetPhaseTime(phase));
  }
  input.Chosen = { phase, reader->GetPhaseTime(phase), reader->GetPhaseFileName(phase) };
  step.report.SetReference(*input.Chosen);
  FindHeart(step);
}

bool IsShared(RunStage stage)
{
  return stage == RunStage::Vesselness || stage == RunStage::Motion;
}

Json MakeStage(RunStage stage, RunStep& step)
{
  switch (stage)
  {
    case RunStage::Vesselness:
      return MakeVesselness(step);
    case RunStage::Segmentation:
      return MakeSegmentation(step);
    case RunStage::Centerline:
      return MakeCenterline(step);
    case RunStage::Surface:
      return MakeSurface(step);
    case RunStage::Volume:
      return MakeVolume(step);
    case RunStage::Weights:
      return MakeWeights(step);
    case RunStage::Motion:
      return MakeMotion(step);
  }
  return {};
}

void ReleaseImages(RunInput& input, RunStage next)
{
  if (next > RunStage::Centerline)
  {
    input.Vesselness = nullptr;
    input.Mask = nullptr;
    if (next > RunStage::Surface || !input.Settings.contours)
    {
      input.Reference = nullptr;
      if (input.Reader)
      {
        input.Reader->GetOutput()->ReleaseData();
      }
    }
  }
}

std::vector<std::string> UsualFiles(const std::string& folder, RunStage from)
{
  const std::vector<std::vector<std::string>> byStage = {
    { "vesselness.mha" },
    { "mask.mha", "ostia.vtp", "aorta.vtp", "bridges.vtp", "aorta_wall.vtp",
      "aorta_centerline.vtp" },
    { "given_surface.vtp", "centerline.vtp", "bifurcations.vtp", "centerline_lines.vtp",
      "status.csv", "lesions.csv", "calcium.mha", "edited_mask.mha" },
    { "surface.vtp", "caps.vtp" },
    { "skeleton.vtp", "skeleton.tgf", "volume.vtu", "volume_boundary.vtp", "volume_skeleton.vtp" },
    { "weights.vtu", "weights.dmat" },
    { "motion.pvd" },
  };
  std::vector<std::string> names;
  for (auto n = static_cast<std::size_t>(from); n < byStage.size(); ++n)
  {
    names.insert(names.end(), byStage[n].begin(), byStage[n].end());
  }
  for (const std::string& name : MeshSequenceFiles(folder + "/motion/mesh.json"))
  {
    names.push_back("motion/" + name);
  }
  for (const char* stem : { "centerline", "skeleton" })
  {
    const std::string begin = std::string("motion/").append(stem);
    const std::string list = begin + ".vtp.series";
    try
    {
      for (const TimedFile& file : ReadFileSeries((fs::path(folder) / list).string()))
      {
        const std::string name = (fs::path("motion") / fs::path(file.path).filename()).string();
        if (name.rfind(begin + "_", 0) == 0)
        {
          names.push_back(name);
        }
      }
      names.push_back(list);
      names.push_back(begin + ".pvd");
    }
    catch (const std::runtime_error&)
    {
      // There is none.
    }
  }
  return names;
}
}
