#include "vtkRunResult.h"

#include "BoundedJson.h"
#include "ReportJson.h"
#include "RunSettings.h"
#include "TextFile.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkDataFiles.h"
#include "vtkGatedImageReader.h"
#include "vtkMessageTrap.h"
#include "vtkVesselTree.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkStringArray.h"

#include <Eigen/LU>

#include <cmath>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The member, or null.
bool IsFile(const fs::path& path)
{
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::vector<double> PointValues(vtkPolyData* lines, const char* name)
{
  vtkDataArray* array = lines->GetPointData()->GetArray(name);
  std::vector<double> values;
  if (array && array->GetNumberOfComponents() == 1)
  {
    for (vtkIdType k = 0; k < array->GetNumberOfTuples(); ++k)
    {
      values.push_back(array->GetTuple1(k));
    }
  }
  return values;
}

/// Each branch's label and segment, which the file has by group.
void TakeNames(vtkPolyData* lines, RunResult& result)
{
  vtkCellData* cells = lines->GetCellData();
  auto* labels =
    vtkStringArray::SafeDownCast(cells->GetAbstractArray(vtkCoronaryArrayNames::SegmentLabel));
  vtkDataArray* segments = cells->GetArray(vtkCoronaryArrayNames::SegmentIds);
  vtkDataArray* groups = cells->GetArray(vtkCoronaryArrayNames::GroupIds);
  std::map<int, vtkIdType> cellOf;
  for (vtkIdType k = 0; groups && k < groups->GetNumberOfTuples(); ++k)
  {
    cellOf.emplace(static_cast<int>(groups->GetTuple1(k)), k);
  }
  for (VesselTree::Branch& branch : result.tree.branches)
  {
    const auto cell = cellOf.find(branch.groupId);
    const bool known = cell != cellOf.end();
    result.names.push_back(labels && known ? labels->GetValue(cell->second) : vtkStdString());
    branch.segmentId = segments && known ? static_cast<int>(segments->GetTuple1(cell->second)) : 0;
  }
}

void Prepare(ResultImage& image, vtkImageData* data)
{
  image.data = data;
  image.values = std::make_unique<ImageInterpolator>(
    vtkCoronary::ScalarImageOf(data, data->GetPointData()->GetScalars(), image.copy));
}

/// As the report has them, found again.
std::vector<std::string> InputFiles(const RunResult& result)
{
  std::vector<std::string> files;
  const Json input = Member(Member(result.report, "settings"), "input");
  for (const Json& one : input)
  {
    if (one.is_string())
    {
      files.push_back(one.get<std::string>());
    }
  }
  return FindRunInput(std::move(files), result.folder);
}
}

ResultLabels::ResultLabels(vtkImageData* image)
  : Data(image)
  , Grid(vtkCoronary::GridOf(image))
  , Inverse((this->Grid.direction * this->Grid.spacing.asDiagonal()).inverse())
{
}

int ResultLabels::At(const Vector3& world) const
{
  if (this->Empty())
  {
    return 0;
  }
  const Vector3 index = this->Inverse * (world - this->Grid.origin);
  vtkIdType voxel = 0;
  for (int axis = 2; axis >= 0; --axis)
  {
    const int first = this->Grid.extent[2 * axis];
    const int last = this->Grid.extent[2 * axis + 1];
    if (!(index[axis] > first - 0.5 && index[axis] < last + 0.5))
    {
      return 0;
    }
    voxel = voxel * (last - first + 1) + (std::lround(index[axis]) - first);
  }
  return static_cast<int>(this->Data->GetPointData()->GetScalars()->GetComponent(voxel, 0));
}

Json RunResult::Findings(const std::string& name) const
{
  return Member(Member(this->report, "centerline"), name);
}

Json RunResult::MotionFindings(const std::string& name) const
{
  return Member(Member(this->report, "motion"), name);
}

std::vector<std::string> RunResult::Warnings() const
{
  std::vector<std::string> warnings;
  for (const Json& stage : Member(this->report, "stages"))
  {
    const Json name = Member(stage, "name");
    const std::string begin = name.is_string() ? name.get<std::string>() + ": " : std::string();
    for (const Json& text : Member(stage, "warnings"))
    {
      if (text.is_string())
      {
        warnings.push_back(begin + text.get<std::string>());
      }
    }
    const Json reason = Member(stage, "reason");
    if (reason.is_string())
    {
      warnings.push_back(begin + "left out: " + reason.get<std::string>());
    }
  }
  for (const Json& one : Member(Member(this->report, "centerline"), "trees"))
  {
    const Json status = Member(one, "status");
    const Json name = Member(one, "name");
    const Json message = Member(one, "message");
    if (status.is_number_integer() && status != 0 && name.is_string() && message.is_string())
    {
      warnings.push_back(
        "centerline: " + name.get<std::string>() + ": " + message.get<std::string>());
    }
  }
  const Json stopped = Member(this->report, "stopped");
  const Json stage = Member(stopped, "stage");
  const Json reason = Member(stopped, "reason");
  if (stage.is_string() && reason.is_string())
  {
    warnings.push_back(
      "the run ended in " + stage.get<std::string>() + ": " + reason.get<std::string>());
  }
  return warnings;
}

RunResult ReadRunResult(const std::string& folder, vtkMessageTrap& messages)
{
  RunResult result;
  result.folder = folder;
  const fs::path report = fs::path(folder) / "report.json";
  const fs::path lines = fs::path(folder) / "centerline.vtp";
  if (!IsFile(report))
  {
    throw std::runtime_error("'" + folder + "' is no folder of run: it has no report.json.");
  }
  if (!IsFile(lines))
  {
    throw std::runtime_error(
      "'" + folder + "' has no centerline.vtp: let run go on with --resume --until centerline.");
  }
  result.report = ParseBoundedJson<Json>(
    ReadTextFile(report.string(), "the report of a run"), "'" + report.string() + "'");
  if (!result.report.is_object())
  {
    throw std::runtime_error("'" + report.string() + "' is not the report of a run.");
  }
  const Json time = Member(result.report, "time");
  result.time = time.is_number() && std::isfinite(time.get<double>()) ? time.get<double>() : 0.0;
  result.lines = ReadPolyData(lines.string(), messages);
  vtkPolyData* data = result.lines;
  if (data->GetNumberOfLines() == 0)
  {
    throw std::runtime_error("'" + lines.string() + "' has no branches to look at.");
  }
  try
  {
    result.tree = vtkCoronary::TreeOf(data, vtkCoronary::Radii::IfThere);
  }
  catch (const std::invalid_argument& error)
  {
    throw std::runtime_error("'" + lines.string() + "': " + error.what());
  }
  TakeNames(data, result);
  result.bridged = PointValues(data, vtkCoronaryArrayNames::Bridged);
  result.bridgeConfidence = PointValues(data, vtkCoronaryArrayNames::BridgeConfidence);
  result.edited = PointValues(data, vtkCoronaryArrayNames::EditNumber);
  result.interpolated = PointValues(data, vtkCoronaryArrayNames::RadiusInterpolated);
  result.stenosis = PointValues(data, vtkCoronaryArrayNames::StenosisDegree);
  result.reference = PointValues(data, vtkCoronaryArrayNames::ReferenceRadius);
  result.calcium = PointValues(data, vtkCoronaryArrayNames::CalciumLabel);
  return result;
}

vtkSmartPointer<vtkGatedImageReader> OpenRunImages(
  const RunResult& result, const std::vector<std::string>& files, vtkMessageTrap& messages)
{
  const std::vector<std::string> paths = files.empty() ? InputFiles(result) : files;
  if (paths.empty())
  {
    throw std::runtime_error(
      "'" + result.folder + "' does not say which image it was made of: --image gives it.");
  }
  for (const std::string& path : paths)
  {
    std::error_code error;
    if (!fs::exists(path, error))
    {
      throw std::runtime_error("The image '" + path + "' of '" + result.folder +
        "' is not there: --image says where it is now.");
    }
  }
  const Json settings = Member(result.report, "settings");
  auto reader = vtkSmartPointer<vtkGatedImageReader>::New();
  for (const std::string& path : paths)
  {
    reader->AddFileName(path.c_str());
  }
  int phase = 0;
  for (const Json& fraction : Member(settings, "fractions"))
  {
    if (fraction.is_number())
    {
      reader->SetPhaseFraction(phase++, fraction.get<double>());
    }
  }
  const Json series = Member(settings, "series");
  if (series.is_string() && !series.get<std::string>().empty())
  {
    reader->SetSeriesInstanceUID(series.get<std::string>().c_str());
  }
  reader->UpdateInformation();
  messages.ThrowIfError();
  return reader;
}

ResultImage ReadRunImage(const RunResult& result, const std::vector<std::string>& files,
  vtkMessageTrap& messages, const ProgressCallback& progress)
{
  const vtkSmartPointer<vtkGatedImageReader> reader = OpenRunImages(result, files, messages);
  UpdateAtTime(
    reader, 0, result.time, messages, [&](double fraction) { Report(progress, fraction); });
  ResultImage image;
  Prepare(image, reader->GetOutput());
  return image;
}

ResultLabels ReadRunCalcium(const RunResult& result, vtkMessageTrap& messages)
{
  const fs::path path = fs::path(result.folder) / "calcium.mha";
  if (!IsFile(path))
  {
    return {};
  }
  vtkNew<vtkGatedImageReader> reader;
  reader->SetFileName(path.string().c_str());
  reader->Update();
  messages.ThrowIfError();
  return ResultLabels(reader->GetOutput());
}
}
