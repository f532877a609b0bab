#include "vtkLumenCycle.h"

#include "CoronaryAnatomy.h"
#include "LumenCycle.h"
#include "TreeLinks.h"
#include "VesselChains.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryCompatibility.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkMovedLines.h"
#include "vtkPoseSequences.h"
#include "vtkVesselTree.h"

#include "vtkCellArray.h"
#include "vtkDataArray.h"
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
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkTable.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <vector>

namespace names = vtkCoronaryArrayNames;
using coronary::LumenCycle;
using coronary::VesselTree;
using vtkCoronary::Require;
using vtkMovedLines::Connection;
using vtkMovedLines::FieldValue;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkLumenCycle);

namespace
{
enum CyclePorts
{
  CycleLinesPort = 0,
  CycleImagePort = 1
};

constexpr double NotKnown = std::numeric_limits<double>::quiet_NaN();
constexpr double Percent = 100.0;
/// Fraction of R-R: phases of images and lines that are nearer are one.
constexpr double SameTime = 1e-3;

/// "35 %", with the fraction where two phases would have one name.
std::vector<std::string> PhaseNames(const std::vector<double>& times)
{
  for (const int digits : { 0, 1, 3 })
  {
    std::vector<std::string> list;
    for (const double time : times)
    {
      std::array<char, 40> text;
      std::snprintf(text.data(), text.size(), "%.*f %%", digits, Percent * time);
      list.emplace_back(text.data());
    }
    std::vector<std::string> sorted = list;
    std::sort(sorted.begin(), sorted.end());
    if (digits == 3 || std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end())
    {
      return list;
    }
  }
  return {};
}

template <typename Array, typename Value>
void AddColumn(vtkTable* table, const std::string& name, const std::vector<Value>& values)
{
  vtkCoronary::AddArray<Array>(table->GetRowData(), name, values);
}

double AreaOf(double radius)
{
  return M_PI * radius * radius;
}

/// Values of some points, as they are asked for by a function of the point.
template <typename Get>
std::vector<double> Picked(const std::vector<std::int64_t>& points, const Get& get)
{
  std::vector<double> values;
  values.reserve(points.size());
  for (const std::int64_t point : points)
  {
    values.push_back(get(static_cast<std::size_t>(point)));
  }
  return values;
}
}

struct vtkLumenCycle::Internals
{
  // What was measured, and of what.
  bool Known = false;
  vtkMTimeType LinesTime = 0;
  vtkMTimeType ImageTime = 0;
  double Blur = 0.0;
  std::string ImageArrayName;
  int Measurements = 0;
  vtkCoronary::Moment LinesAsked;
  vtkCoronary::Moment ImageAsked;

  VesselTree Tree;                                 ///< at the reference phase
  std::vector<vtkSmartPointer<vtkPolyData>> Lines; ///< at each phase
  LumenCycle Cycle;
  bool HasTimes = false;

  bool Knows(const vtkLumenCycle& self, vtkInformationVector** inputs) const
  {
    vtkInformation* image = Connection(inputs, CycleImagePort);
    return this->Known && this->Blur == self.Blur && this->ImageArrayName == self.ImageArrayName &&
      this->LinesTime == vtkCoronary::UpstreamTime(Connection(inputs, CycleLinesPort)) &&
      this->ImageTime == (image != nullptr ? vtkCoronary::UpstreamTime(image) : 0);
  }

  std::vector<std::string> Names() const
  {
    std::vector<std::string> list;
    for (const VesselTree::Branch& branch : this->Tree.branches)
    {
      list.push_back(branch.name);
    }
    return list;
  }

  void WriteProfile(const coronary::VesselChain& vessel, vtkTable* table) const;
  void WriteMap(const coronary::VesselChain& vessel, vtkPolyData* map) const;
  void WriteLesions(vtkTable* table) const;
  void WriteTree(std::size_t phase, vtkPolyData* output) const;
};

void vtkLumenCycle::Internals::WriteProfile(
  const coronary::VesselChain& vessel, vtkTable* table) const
{
  const std::vector<std::int64_t>& points = vessel.points;
  AddColumn<vtkDoubleArray>(table, "Position", vessel.arc);
  std::vector<vtkStdString> segments;
  for (const double arc : vessel.arc)
  {
    const auto piece = std::find_if(vessel.pieces.begin(), vessel.pieces.end(),
      [&](const coronary::VesselPiece& one) { return arc <= one.end + 1e-9; });
    segments.emplace_back(piece == vessel.pieces.end() ? vessel.pieces.back().name : piece->name);
  }
  AddColumn<vtkStringArray>(table, "Segment", segments);
  const LumenCycle& cycle = this->Cycle;
  const std::vector<std::string> phases =
    this->HasTimes ? PhaseNames(cycle.times) : std::vector<std::string>{ "Diameter" };
  for (std::size_t k = 0; k < phases.size(); ++k)
  {
    AddColumn<vtkDoubleArray>(
      table, phases[k], Picked(points, [&](std::size_t p) { return 2.0 * cycle.radius[k][p]; }));
  }
  const auto diameters = [&](const char* name, const std::vector<double>& radii)
  {
    AddColumn<vtkDoubleArray>(
      table, name, Picked(points, [&](std::size_t p) { return 2.0 * radii[p]; }));
  };
  diameters("Least", cycle.least);
  diameters("Median", cycle.median);
  diameters("Greatest", cycle.greatest);
  diameters("Healthy", cycle.medianReference);
  AddColumn<vtkDoubleArray>(table, "Stenosis",
    Picked(points, [&](std::size_t p) { return Percent * cycle.medianDegree[p]; }));
  AddColumn<vtkDoubleArray>(
    table, "Area", Picked(points, [&](std::size_t p) { return AreaOf(cycle.median[p]); }));
}

void vtkLumenCycle::Internals::WriteMap(const coronary::VesselChain& vessel, vtkPolyData* map) const
{
  const auto width = static_cast<vtkIdType>(vessel.points.size());
  const auto height = static_cast<vtkIdType>(this->Cycle.times.size());
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  std::vector<double> diameter;
  std::vector<double> area;
  std::vector<double> degree;
  for (vtkIdType k = 0; k < height; ++k)
  {
    const auto phase = static_cast<std::size_t>(k);
    for (vtkIdType n = 0; n < width; ++n)
    {
      const auto point = static_cast<std::size_t>(vessel.points[static_cast<std::size_t>(n)]);
      const double radius = this->Cycle.radius[phase][point];
      points->InsertNextPoint(
        vessel.arc[static_cast<std::size_t>(n)], Percent * this->Cycle.times[phase], 0.0);
      diameter.push_back(2.0 * radius);
      area.push_back(AreaOf(radius));
      degree.push_back(std::isnan(radius) ? NotKnown : this->Cycle.degree[phase][point]);
    }
  }
  vtkNew<vtkCellArray> quads;
  for (vtkIdType k = 0; k + 1 < height; ++k)
  {
    for (vtkIdType n = 0; n + 1 < width; ++n)
    {
      const std::array<vtkIdType, 4> corners{ k * width + n, k * width + n + 1,
        (k + 1) * width + n + 1, (k + 1) * width + n };
      quads->InsertNextCell(4, corners.data());
    }
  }
  map->SetPoints(points);
  map->SetPolys(quads);
  vtkCoronary::AddArray<vtkDoubleArray>(map->GetPointData(), names::Diameter, diameter);
  vtkCoronary::AddArray<vtkDoubleArray>(map->GetPointData(), names::Area, area);
  vtkCoronary::AddArray<vtkDoubleArray>(map->GetPointData(), names::StenosisDegree, degree);
}

void vtkLumenCycle::Internals::WriteLesions(vtkTable* table) const
{
  const std::vector<coronary::CycleLesion>& lesions = this->Cycle.lesions;
  std::vector<vtkStdString> vessels;
  std::vector<vtkStdString> kinds;
  std::vector<int> phases;
  const std::vector<std::int64_t> owners = coronary::BranchesOfPoints(this->Tree);
  for (const coronary::CycleLesion& lesion : lesions)
  {
    vessels.emplace_back(
      this->Tree.branches[static_cast<std::size_t>(owners[lesion.median.point])].name);
    kinds.emplace_back(coronary::LesionKindName(lesion.median.kind));
    phases.push_back(static_cast<int>(std::count_if(lesion.degree.begin(), lesion.degree.end(),
      [](double degree) { return !std::isnan(degree); })));
  }
  const auto numbers = [&](const char* name, const auto& get)
  {
    std::vector<double> values;
    for (const coronary::CycleLesion& lesion : lesions)
    {
      values.push_back(get(lesion));
    }
    AddColumn<vtkDoubleArray>(table, name, values);
  };
  using Lesion = const coronary::CycleLesion&;
  AddColumn<vtkStringArray>(table, "Vessel", vessels);
  numbers("Position", [](Lesion l) { return l.median.abscissaMinimum; });
  numbers("Start", [](Lesion l) { return l.median.abscissaStart; });
  numbers("End", [](Lesion l) { return l.median.abscissaEnd; });
  numbers("X", [](Lesion l) { return l.median.position[0]; });
  numbers("Y", [](Lesion l) { return l.median.position[1]; });
  numbers("Z", [](Lesion l) { return l.median.position[2]; });
  numbers("Length", [](Lesion l) { return l.median.length; });
  numbers("LeastDiameter", [](Lesion l) { return l.median.minimumDiameter; });
  numbers("HealthyDiameter", [](Lesion l) { return l.median.referenceDiameter; });
  numbers("Stenosis", [](Lesion l) { return Percent * l.median.degree; });
  numbers("AreaStenosis", [](Lesion l) { return Percent * l.median.areaDegree; });
  numbers("Low", [](Lesion l) { return Percent * l.median.degreeLow; });
  numbers("High", [](Lesion l) { return Percent * l.median.degreeHigh; });
  AddColumn<vtkStringArray>(table, "Kind", kinds);
  AddColumn<vtkIntArray>(table, "Phases", phases);
  numbers(
    "WorstStenosis", [](Lesion l) { return l.worst < 0 ? NotKnown : Percent * l.degree[l.worst]; });
  numbers("WorstPhase",
    [&](Lesion l) { return l.worst < 0 ? NotKnown : Percent * this->Cycle.times[l.worst]; });
  const auto range = [](const std::vector<double>& values)
  {
    double low = NotKnown;
    double high = NotKnown;
    for (const double value : values)
    {
      if (!std::isnan(value))
      {
        low = value >= low ? low : value;
        high = value <= high ? high : value;
      }
    }
    return std::array<double, 2>{ low, high };
  };
  numbers("LeastStenosis", [&](Lesion l) { return Percent * range(l.degree)[0]; });
  numbers("Pulsation",
    [&](Lesion l)
    {
      const std::array<double, 2> diameters = range(l.diameter);
      return Percent * (diameters[1] / diameters[0] - 1.0);
    });
}

void vtkLumenCycle::Internals::WriteTree(std::size_t phase, vtkPolyData* output) const
{
  output->ShallowCopy(this->Lines[phase]);
  const LumenCycle& cycle = this->Cycle;
  const std::size_t count = this->Tree.points.size();
  const auto add = [&](const char* name, const auto& get)
  {
    std::vector<double> values;
    values.reserve(count);
    for (std::size_t p = 0; p < count; ++p)
    {
      values.push_back(get(p));
    }
    vtkCoronary::AddArray<vtkDoubleArray>(output->GetPointData(), name, values);
  };
  const std::vector<double>& radius = cycle.radius[phase];
  add(names::Diameter, [&](std::size_t p) { return 2.0 * radius[p]; });
  add(names::Area, [&](std::size_t p) { return AreaOf(radius[p]); });
  add(names::StenosisDegree,
    [&](std::size_t p) { return std::isnan(radius[p]) ? NotKnown : cycle.degree[phase][p]; });
  add(names::ReferenceRadius, [&](std::size_t p) { return cycle.reference[phase][p]; });
  add(names::LeastDiameter, [&](std::size_t p) { return 2.0 * cycle.least[p]; });
  add(names::MedianDiameter, [&](std::size_t p) { return 2.0 * cycle.median[p]; });
  add(names::GreatestDiameter, [&](std::size_t p) { return 2.0 * cycle.greatest[p]; });
  add(names::HealthyDiameter, [&](std::size_t p) { return 2.0 * cycle.medianReference[p]; });
  add(names::MedianDegree, [&](std::size_t p) { return cycle.medianDegree[p]; });
}

vtkLumenCycle::vtkLumenCycle()
  : Data(new Internals)
{
  this->SetNumberOfInputPorts(2);
  this->SetNumberOfOutputPorts(4);
}

vtkLumenCycle::~vtkLumenCycle() = default;

std::vector<double> vtkLumenCycle::PhasesOf(vtkInformation* lines, vtkInformation* image)
{
  const std::vector<double> own = vtkPoseSequences::StepsOf(lines);
  if (image == nullptr)
  {
    return own;
  }
  // Lines of another moment would be measured beside their vessels.
  std::vector<double> phases = vtkPoseSequences::StepsOf(image);
  const auto alone = [&](double time)
  {
    return std::none_of(
      own.begin(), own.end(), [time](double one) { return std::abs(one - time) < SameTime; });
  };
  if (!own.empty())
  {
    phases.erase(std::remove_if(phases.begin(), phases.end(), alone), phases.end());
    Require(!phases.empty(), "The lines have none of the times of the images");
  }
  return phases;
}

std::vector<double> vtkLumenCycle::GetPhases()
{
  try
  {
    vtkInformation* image = this->GetNumberOfInputConnections(CycleImagePort) > 0
      ? this->GetInputInformation(CycleImagePort, 0)
      : nullptr;
    return PhasesOf(this->GetInputInformation(CycleLinesPort, 0), image);
  }
  catch (const std::invalid_argument&)
  {
    return {};
  }
}

int vtkLumenCycle::GetNumberOfMeasurements() const
{
  return this->Data->Measurements;
}

int vtkLumenCycle::FillInputPortInformation(int port, vtkInformation* info)
{
  info->Set(INPUT_REQUIRED_DATA_TYPE(), port == CycleLinesPort ? "vtkPolyData" : "vtkImageData");
  if (port == CycleImagePort)
  {
    info->Set(INPUT_IS_OPTIONAL(), 1);
  }
  return 1;
}

int vtkLumenCycle::FillOutputPortInformation(int port, vtkInformation* info)
{
  const bool table = port == ProfilePort || port == LesionPort;
  info->Set(vtkDataObject::DATA_TYPE_NAME(), table ? "vtkTable" : "vtkPolyData");
  return 1;
}

int vtkLumenCycle::RequestInformation(
  vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  try
  {
    vtkMovedLines::SetTimes(
      outputs, PhasesOf(Connection(inputs, CycleLinesPort), Connection(inputs, CycleImagePort)));
    return 1;
  }
  catch (const std::invalid_argument& error)
  {
    vtkErrorMacro(<< error.what());
    return 0;
  }
}

int vtkLumenCycle::RequestUpdateExtent(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkCoronary::RequestWholeForFirstPiece(request, inputs, 2, outputs);
  // What they have already, so that what is known is not made again.
  const auto ask = [&](int port, const vtkCoronary::Moment& asked)
  {
    vtkInformation* info = Connection(inputs, port);
    if (info == nullptr)
    {
      return;
    }
    const std::vector<double> steps = vtkPoseSequences::StepsOf(info);
    if (this->Data->Known && asked.exists)
    {
      info->Set(SDDP::UPDATE_TIME_STEP(), asked.time);
    }
    else if (!steps.empty())
    {
      info->Set(SDDP::UPDATE_TIME_STEP(), steps.front());
    }
    if (info->Has(SDDP::WHOLE_EXTENT()))
    {
      int whole[6];
      info->Get(SDDP::WHOLE_EXTENT(), whole);
      info->Set(SDDP::UPDATE_EXTENT(), whole, 6);
    }
  };
  ask(CycleLinesPort, this->Data->LinesAsked);
  ask(CycleImagePort, this->Data->ImageAsked);
  return 1;
}

void vtkLumenCycle::Measure(vtkInformationVector** inputs)
{
  Internals& data = *this->Data;
  data.Known = false;
  vtkInformation* linesInfo = Connection(inputs, CycleLinesPort);
  vtkInformation* imageInfo = Connection(inputs, CycleImagePort);
  const vtkMTimeType linesTime = vtkCoronary::UpstreamTime(linesInfo);
  const vtkMTimeType imageTime = imageInfo != nullptr ? vtkCoronary::UpstreamTime(imageInfo) : 0;
  std::vector<double> times = PhasesOf(linesInfo, imageInfo);
  data.HasTimes = !times.empty();
  if (!data.HasTimes)
  {
    times.push_back(0.0);
  }

  // All lines first: what they are made of may be the images, which one request after the other would make twice.
  data.Lines.clear();
  std::vector<VesselTree> trees;
  vtkCoronary::UpstreamRequest askLines(linesInfo, linesInfo);
  for (const double time : times)
  {
    data.LinesAsked = vtkCoronary::NearestMoment(linesInfo, false, time);
    askLines.Ask(nullptr, data.LinesAsked);
    vtkPolyData* now = vtkPolyData::GetData(linesInfo);
    vtkNew<vtkPolyData> kept;
    kept->ShallowCopy(now);
    data.Lines.emplace_back(kept);
    VesselTree tree = vtkCoronary::TreeOf(kept);
    vtkCoronary::AddPointValues(kept, tree);
    if (!trees.empty())
    {
      const auto same = [](const VesselTree::Branch& a, const VesselTree::Branch& b)
      { return a.points == b.points; };
      Require(tree.points.size() == trees.front().points.size() &&
          std::equal(tree.branches.begin(), tree.branches.end(), trees.front().branches.begin(),
            trees.front().branches.end(), same),
        "The lines at the time " + std::to_string(time) + " are not those of the first phase");
    }
    trees.push_back(std::move(tree));
  }
  const double reference = FieldValue(data.Lines.front(), names::ReferenceTime,
    FieldValue(data.Lines.front(), names::PhaseTime, times.front()));
  data.Tree = trees[vtkMovedLines::NearestIndex(times, reference)];

  const double blur =
    this->Blur > 0.0 ? this->Blur : FieldValue(data.Lines.front(), names::ImageBlur, 0.0);
  Require(std::isfinite(this->Blur) && this->Blur >= 0.0, "Blur must be 0 or more");
  Require(imageInfo == nullptr || blur > 0.0,
    "Blur is not known: the lines have no field array ImageBlur; give its standard deviation in "
    "mm");
  std::vector<coronary::RefinedLumen> lumens;
  const std::vector<coronary::VesselPath> paths = coronary::VesselPaths(data.Tree);
  std::unique_ptr<vtkCoronary::UpstreamRequest> askImage;
  if (imageInfo != nullptr)
  {
    askImage = std::make_unique<vtkCoronary::UpstreamRequest>(imageInfo, imageInfo);
  }
  std::array<int, 6> whole{ 0, -1, 0, -1, 0, -1 };
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    const double first = 0.9 * double(k) / double(times.size());
    if (imageInfo != nullptr)
    {
      imageInfo->Get(SDDP::WHOLE_EXTENT(), whole.data());
      data.ImageAsked = vtkCoronary::NearestMoment(imageInfo, false, times[k]);
      askImage->Ask(&whole, data.ImageAsked);
      vtkImageData* image = vtkImageData::GetData(imageInfo);
      Require(image != nullptr && image->GetNumberOfPoints() > 0, "The image has no voxels");
      std::vector<float> copy;
      const coronary::ScalarImage voxels = vtkCoronary::ScalarImageOf(
        image, vtkCoronary::VoxelArrayOf(image, this->ImageArrayName, "the image"), copy);
      lumens.push_back(coronary::MeasureTreeLumen(trees[k], paths, voxels, blur,
        vtkCoronary::ProgressOf(this, first, first + 0.9 / double(times.size())))
                         .lumen);
    }
    else
    {
      lumens.push_back(coronary::LumenOf(trees[k]));
    }
    vtkDataArray* status = data.Lines[k]->GetPointData()->GetArray(names::TrackingStatus);
    for (std::size_t p = 0; status != nullptr && p < lumens[k].radius.size(); ++p)
    {
      if (coronary::IsUnseen(static_cast<coronary::TrackingStatus>(
            static_cast<int>(status->GetComponent(static_cast<vtkIdType>(p), 0)))))
      {
        lumens[k].measured[p] = 0.0;
        lumens[k].interpolated[p] = 1;
      }
    }
  }
  data.Cycle =
    coronary::GradeOverCycle(data.Tree, times, lumens, vtkCoronary::ProgressOf(this, 0.9, 1.0));
  ++data.Measurements;
  data.Known = true;
  data.Blur = this->Blur;
  data.ImageArrayName = this->ImageArrayName;
  data.LinesTime = linesTime;
  data.ImageTime = imageTime;
}

int vtkLumenCycle::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  vtkInformation* asked = vtkMovedLines::AskedOutput(request, outputs);
  if (asked->Get(SDDP::UPDATE_PIECE_NUMBER()) > 0 ||
    vtkPolyData::GetData(inputs[CycleLinesPort])->GetNumberOfLines() == 0)
  {
    return 1;
  }
  try
  {
    Internals& data = *this->Data;
    if (!data.Knows(*this, inputs))
    {
      this->Measure(inputs);
    }
    const coronary::VesselChain vessel =
      coronary::FindVessel(data.Tree, data.Names(), this->Vessel);
    data.WriteProfile(vessel, vtkTable::GetData(outputs, ProfilePort));
    data.WriteMap(vessel, vtkPolyData::GetData(outputs, MapPort));
    data.WriteLesions(vtkTable::GetData(outputs, LesionPort));
    const std::vector<double>& times = data.Cycle.times;
    const std::size_t phase =
      vtkMovedLines::NearestIndex(times, vtkMovedLines::AskedTime(request, outputs, times.front()));
    data.WriteTree(phase, vtkPolyData::GetData(outputs, TreePort));
    if (data.HasTimes)
    {
      for (int port = 0; port < this->GetNumberOfOutputPorts(); ++port)
      {
        vtkDataObject::GetData(outputs, port)
          ->GetInformation()
          ->Set(vtkDataObject::DATA_TIME_STEP(), times[phase]);
      }
    }
    this->UpdateProgress(1.0);
    return 1;
  }
  catch (...)
  {
    return vtkCoronary::FinishFailedRequest(this, outputs, "for the lumen over the cycle");
  }
}

void vtkLumenCycle::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Vessel: " << this->Vessel << "\n";
  os << indent << "Blur: " << this->Blur << "\n";
  os << indent << "ImageArrayName: " << this->ImageArrayName << "\n";
}
