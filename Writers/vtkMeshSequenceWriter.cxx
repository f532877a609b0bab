#include "vtkMeshSequenceWriter.h"

#include "ItemSharing.h"
#include "MeshSequenceReport.h"
#include "Numbers.h"
#include "ParallelFor.h"
#include "PartialProgress.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkCoronaryUpstream.h"
#include "vtkSequenceFormats.h"

#include "vtkDataSetAttributes.h"
#include "vtkDoubleArray.h"
#include "vtkExecutive.h"
#include "vtkInformation.h"
#include "vtkObjectFactory.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkTable.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <future>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace fs = std::filesystem;
namespace names = vtkCoronaryArrayNames;
using vtkCoronary::Require;
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkStandardNewMacro(vtkMeshSequenceWriter);

namespace
{
constexpr int MostAtOnce = 4; ///< phases whose files are packed: each is held in memory meanwhile

/// As the report counts them.
std::string PhaseName(std::size_t phase, double time)
{
  std::ostringstream text;
  text << "phase " << phase << " (time " << time << ')';
  return text.str();
}

/// What the report has of a phase as plain numbers, and back.
std::vector<double> NumbersOf(const vtkMeshSequence::PhaseMesh& phase)
{
  const coronary::TetrahedraQuality& t = phase.tetrahedra;
  const coronary::TrianglesQuality& s = phase.surface;
  std::vector<double> numbers = { phase.time, static_cast<double>(t.poor), t.minimumVolume,
    static_cast<double>(t.minimumVolumeAt), t.totalVolume, t.minimumDihedralAngle,
    static_cast<double>(t.minimumDihedralAngleAt), t.maximumRadiusEdgeRatio,
    static_cast<double>(t.maximumRadiusEdgeRatioAt), s.area, s.enclosedVolume, s.minimumAngle,
    static_cast<double>(s.minimumAngleAt), static_cast<double>(t.inverted.size()) };
  numbers.insert(numbers.end(), t.inverted.begin(), t.inverted.end());
  numbers.insert(numbers.end(), s.degenerate.begin(), s.degenerate.end());
  return numbers;
}

void TakeNumbers(const std::vector<double>& numbers, coronary::MeshSequenceReport::Phase& phase)
{
  auto next = numbers.begin();
  const auto whole = [&] { return static_cast<std::int64_t>(*next++); };
  coronary::TetrahedraQuality& t = phase.tetrahedra;
  coronary::TrianglesQuality& s = phase.surface;
  phase.time = *next++;
  t.poor = whole();
  t.minimumVolume = *next++;
  t.minimumVolumeAt = whole();
  t.totalVolume = *next++;
  t.minimumDihedralAngle = *next++;
  t.minimumDihedralAngleAt = whole();
  t.maximumRadiusEdgeRatio = *next++;
  t.maximumRadiusEdgeRatioAt = whole();
  s.area = *next++;
  s.enclosedVolume = *next++;
  s.minimumAngle = *next++;
  s.minimumAngleAt = whole();
  const auto middle = next + 1 + static_cast<std::ptrdiff_t>(*next);
  t.inverted.assign(next + 1, middle);
  s.degenerate.assign(middle, numbers.end());
}

/// One sentence about the phases that have inverted tetrahedra; empty when there are none.
std::string InversionWarning(const std::vector<coronary::MeshSequenceReport::Phase>& phases)
{
  std::size_t bad = 0;
  std::string list;
  for (std::size_t k = 0; k < phases.size(); ++k)
  {
    const std::size_t count = phases[k].tetrahedra.inverted.size();
    if (count > 0)
    {
      ++bad;
      if (bad <= 10)
      {
        list +=
          (bad > 1 ? ", " : "") + std::to_string(count) + " at " + PhaseName(k, phases[k].time);
      }
    }
  }
  if (bad == 0)
  {
    return {};
  }
  return std::to_string(bad) + " of " + std::to_string(phases.size()) +
    " phases have inverted tetrahedra: " + list + (bad > 10 ? ", .." : "");
}

void FillTable(const coronary::MeshSequenceReport& report, vtkTable* table)
{
  const bool volume = report.tetrahedra > 0;
  std::vector<std::pair<const char*, std::vector<double>>> columns = { { "Phase", {} },
    { names::PhaseTime, {} }, { names::InvertedTetrahedra, {} }, { "PoorTetrahedra", {} },
    { names::PoorFraction, {} }, { names::MeshMinimumVolume, {} },
    { names::MeshMinimumDihedralAngle, {} }, { names::MeshMaximumRadiusEdgeRatio, {} },
    { names::TotalVolume, {} }, { names::SurfaceArea, {} }, { "DegenerateTriangles", {} } };
  for (std::size_t k = 0; k < report.phases.size(); ++k)
  {
    const auto& phase = report.phases[k];
    const auto& t = phase.tetrahedra;
    const double values[] = { static_cast<double>(k), phase.time,
      static_cast<double>(t.inverted.size()), static_cast<double>(t.poor),
      volume ? static_cast<double>(t.poor) / static_cast<double>(report.tetrahedra) : 0.0,
      t.minimumVolume, t.minimumDihedralAngle, t.maximumRadiusEdgeRatio,
      volume ? t.totalVolume : phase.surface.enclosedVolume, phase.surface.area,
      static_cast<double>(phase.surface.degenerate.size()) };
    for (std::size_t c = 0; c < columns.size(); ++c)
    {
      columns[c].second.push_back(values[c]);
    }
  }
  for (const auto& [name, values] : columns)
  {
    vtkCoronary::AddArray<vtkDoubleArray>(table->GetRowData(), name, values);
  }
}
}

vtkMeshSequenceWriter::vtkMeshSequenceWriter()
{
  this->SetNumberOfInputPorts(3);
}

vtkMeshSequenceWriter::~vtkMeshSequenceWriter()
{
  delete[] this->FileName;
}

int vtkMeshSequenceWriter::FillInputPortInformation(int port, vtkInformation* info)
{
  if (port == 0)
  {
    info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkUnstructuredGrid");
    info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
    return 1;
  }
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  info->Set(vtkAlgorithm::INPUT_IS_OPTIONAL(), 1);
  return 1;
}

void vtkMeshSequenceWriter::AddTime(double time)
{
  this->Times.push_back(time);
  this->Modified();
}

void vtkMeshSequenceWriter::RemoveAllTimes()
{
  this->Times.clear();
  this->Modified();
}

void vtkMeshSequenceWriter::SetFaceName(int id, const char* name)
{
  this->FaceNames[id] = name ? name : "";
  this->Modified();
}

void vtkMeshSequenceWriter::RemoveAllFaceNames()
{
  this->FaceNames.clear();
  this->Modified();
}

vtkTable* vtkMeshSequenceWriter::GetQuality()
{
  return this->Quality;
}

void vtkMeshSequenceWriter::Validate() const
{
  const std::string path = this->FileName ? this->FileName : "";
  Require(!path.empty(), "FileName is not set");
  Require(fs::path(path).extension() == ".json" && !fs::path(path).stem().empty(),
    "FileName must be the report's, NAME.json; '" + path + "' is not");
  Require(this->WriteSeries || this->WriteSimVascular || this->WriteVmtk || this->WriteObj ||
      this->WritePly || this->WriteStl || this->WriteGltf || this->WriteGltfJson,
    "There is nothing to write: WriteSeries, WriteSimVascular, WriteVmtk, WriteObj, WritePly, "
    "WriteStl, "
    "WriteGltf and WriteGltfJson are off");
  Require(this->GltfInfluences >= 4 && this->GltfInfluences <= 16 && this->GltfInfluences % 4 == 0,
    "GltfInfluences must be 4, 8, 12 or 16");
  Require(this->Phases >= InputSteps && this->Phases <= ListedTimes, "Phases must be 0, 1 or 2");
  Require(this->NumberOfPhases >= 1 && this->NumberOfPhases <= 100000,
    "NumberOfPhases must be 1 to 100000");
  Require(std::isfinite(this->StartTime), "StartTime must be finite");
  Require(std::isfinite(this->Period) && this->Period > 0.0, "Period must be positive");
  Require(std::isfinite(this->SimVascularUnit) && this->SimVascularUnit > 0.0,
    "SimVascularUnit must be positive");
  Require(this->PoorDihedralAngle >= 0.0 && this->PoorDihedralAngle <= 70.0,
    "PoorDihedralAngle must be 0 to 70 degrees");
  Require(this->Digits >= 1 && this->Digits <= 9, "Digits must be 1 to 9");
  for (const auto& [id, name] : this->FaceNames)
  {
    Require(id >= 1, "FaceName: ids begin with 1");
    Require(!name.empty() && name.front() != '.' &&
        std::all_of(name.begin(), name.end(), vtkMeshSequence::IsNameCharacter),
      "FaceName '" + name + "' must be of letters, digits, '-', '_' and '.'");
  }
}

std::vector<double> vtkMeshSequenceWriter::WantedTimes(vtkInformation* info) const
{
  std::vector<double> times;
  switch (this->Phases)
  {
    case EvenPhases:
      for (int k = 0; k < this->NumberOfPhases; ++k)
      {
        times.push_back(this->StartTime + this->Period * k / this->NumberOfPhases);
      }
      break;
    case ListedTimes:
      times = this->Times;
      Require(!times.empty(), "Times: none are listed");
      break;
    default:
      if (info->Has(SDDP::TIME_STEPS()))
      {
        const double* steps = info->Get(SDDP::TIME_STEPS());
        times.assign(steps, steps + info->Length(SDDP::TIME_STEPS()));
      }
      Require(!times.empty() || !info->Has(SDDP::TIME_RANGE()),
        "The input has no time steps: say which phases, with even phases or listed times");
      break;
  }
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    Require(std::isfinite(times[k]) && (k == 0 || times[k] > times[k - 1]),
      "The times of the phases must be finite and increase: that of " + PhaseName(k, times[k]) +
        " does not");
  }
  Require(times.empty() || info->Has(SDDP::TIME_STEPS()) || info->Has(SDDP::TIME_RANGE()),
    "The input has no time: it can not be asked for a phase");
  return times;
}

int vtkMeshSequenceWriter::Write()
{
  this->Written = false;
  return this->Superclass::Write() && this->Written ? 1 : 0;
}

void vtkMeshSequenceWriter::WriteData()
{
  this->Quality->Initialize();
  try
  {
    this->Validate();
    this->WritePhases(this->GetExecutive()->GetInputInformation(0, 0));
    this->Written = true;
  }
  catch (const coronary::Cancelled&)
  {
    // Nothing was written; the caller knows.
  }
  catch (const std::exception& error)
  {
    vtkErrorMacro(<< error.what());
  }
}

/// One Write().
class vtkMeshSequenceWriter::Run
{
public:
  Run(vtkMeshSequenceWriter* self, vtkInformation* info);

  void WriteAll();

  /// Of the report, when all is written.
  bool IsOwner() const { return this->Folder->IsOwner(); }

  coronary::MeshSequenceReport Result;

private:
  vtkPointSet* MeshAt(std::size_t k);
  void Begin();
  void NamePhases();
  void CollectBefore(std::size_t end);
  vtkMeshSequence::PhaseMesh Measure(std::size_t k, vtkPointSet* mesh) const;
  std::string WritePhase(std::size_t k);
  void BeginToWrite(std::shared_ptr<const vtkMeshSequence::PhaseMesh> phase);
  void WaitForFiles(int left = 0);
  void TakePhase(const std::string& bytes, coronary::MeshSequenceReport::Phase& entry);
  void Finish();

  vtkMeshSequenceWriter* Self;
  vtkInformation* Info;
  coronary::ItemSharing& Sharing;
  coronary::ProgressCallback Progress;
  std::vector<double> Times;
  vtkCoronary::Moment Moment;
  vtkCoronary::UpstreamRequest Request;
  std::pair<std::size_t, vtkPointSet*> Last{ 0,
    nullptr };                                       ///< phase and mesh, as they were asked for
  std::unique_ptr<coronary::StagedFolder> OwnFolder; ///< when the first phase is known
  coronary::StagedFolder* Folder = nullptr;
  std::unique_ptr<vtkMeshSequence::Files> Files;
  std::vector<std::unique_ptr<vtkMeshSequence::Format>> Formats;
  std::size_t Collected = 0; ///< phases
  /// The files of phases, while the next one is moved; last, so that they end before what they use.
  std::deque<std::future<void>> Writing;
};

vtkMeshSequenceWriter::Run::Run(vtkMeshSequenceWriter* self, vtkInformation* info)
  : Self(self)
  , Info(info)
  , Sharing(self->Sharing != nullptr ? *self->Sharing : coronary::ItemSharing::None())
  , Progress(
      [self](double fraction)
      {
        self->UpdateProgress(fraction);
        return !self->GetAbortExecute();
      })
  , Times(self->WantedTimes(info))
  , Request(info, info)
{
  this->Moment.exists = !this->Times.empty();
  if (this->Times.empty())
  {
    this->Times.push_back(0.0);
  }
  this->Result.poorAngle = self->PoorDihedralAngle * coronary::Degree;
}

/// @throws std::invalid_argument when it is empty or of another time
vtkPointSet* vtkMeshSequenceWriter::Run::MeshAt(std::size_t k)
{
  if (this->Last.second != nullptr && this->Last.first == k)
  {
    return this->Last.second;
  }
  const double time = this->Times[k];
  this->Moment.time = time;
  this->Request.Ask(nullptr, this->Moment);
  auto* mesh = vtkPointSet::SafeDownCast(vtkDataObject::GetData(this->Info));
  const std::string name = PhaseName(k, time);
  Require(mesh != nullptr && mesh->GetNumberOfPoints() > 0 && mesh->GetNumberOfCells() > 0,
    "The mesh is empty at " + name);
  if (this->Moment.exists && mesh->GetInformation()->Has(vtkDataObject::DATA_TIME_STEP()))
  {
    const double given = mesh->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP());
    std::ostringstream text;
    text << "The input answers for " << name << " with its mesh of time " << given
         << ": take its time steps, or put a vtkCardiacPhaseInterpolator before it";
    Require(std::abs(given - time) <= 1e-9 * std::max(1.0, std::abs(time)), text.str());
  }
  this->Last = { k, mesh };
  return mesh;
}

/// The first phase says what all have to be like.
void vtkMeshSequenceWriter::Run::Begin()
{
  vtkMeshSequenceWriter* self = this->Self;
  vtkPointSet* mesh = this->MeshAt(0);
  vtkMeshSequence::Topology topology = vtkMeshSequence::TopologyOf(
    mesh, vtkPolyData::SafeDownCast(self->GetInput(1)), names::CellEntityIds);
  Require(!topology.tetrahedra.empty() || (!self->WriteSimVascular && !self->WriteVmtk),
    "WriteSimVascular and WriteVmtk need tetrahedra, and the mesh is a surface");
  this->Result.points = topology.points;
  this->Result.tetrahedra = static_cast<std::int64_t>(topology.tetrahedra.size());
  this->Result.triangles = static_cast<std::int64_t>(topology.triangles.size());
  this->Result.faces = vtkMeshSequence::FacesOf(topology, self->FaceNames,
    vtkMeshSequence::NamesOfCaps(
      vtkPolyData::SafeDownCast(self->GetInput(2)), names::CellEntityIds));
  const fs::path path(self->FileName);
  this->Folder = self->Folder;
  if (this->Folder == nullptr)
  {
    this->OwnFolder = std::make_unique<coronary::StagedFolder>(
      path.has_parent_path() ? path.parent_path().string() : ".");
    this->Folder = this->OwnFolder.get();
  }
  const std::string stem = path.stem().string();
  this->Files = std::make_unique<vtkMeshSequence::Files>(stem,
    self->PrefixFiles ? stem + "_" : std::string(), self->Digits, this->Times.size(),
    std::move(topology), this->Result.faces, self->KeepWeights, *this->Folder);
  this->Result.prefix = this->Files->prefix;
  this->Result.surfacePoints = static_cast<std::int64_t>(this->Files->surface.points.size());

  vtkMeshSequence::FormatSettings formats;
  formats.series = self->WriteSeries;
  formats.simVascular = self->WriteSimVascular;
  formats.vmtk = self->WriteVmtk;
  formats.obj = self->WriteObj;
  formats.ply = self->WritePly;
  formats.stl = self->WriteStl;
  formats.gltf = self->WriteGltf;
  formats.gltfJson = self->WriteGltfJson;
  formats.simVascularUnit = self->SimVascularUnit;
  formats.gltfInfluences = self->GltfInfluences;
  formats.period = self->Period;
  formats.gltfLoop = self->GltfLoop;
  this->Formats = vtkMeshSequence::MakeFormats(formats, *this->Files, mesh);
}

void vtkMeshSequenceWriter::Run::NamePhases()
{
  for (std::size_t k = 0; k < this->Times.size(); ++k)
  {
    coronary::MeshSequenceReport::Phase entry;
    entry.time = this->Times[k];
    for (const auto& format : this->Formats)
    {
      format->Name(k, entry.time, entry);
    }
    this->Result.phases.push_back(std::move(entry));
  }
}

/// Files of all phases need the meshes of all of them, one after the other.
void vtkMeshSequenceWriter::Run::CollectBefore(std::size_t end)
{
  for (; this->Collected < end; ++this->Collected)
  {
    for (const auto& format : this->Formats)
    {
      if (format->NeedsAll())
      {
        format->Collect(this->MeshAt(this->Collected), this->Times[this->Collected]);
      }
    }
  }
}

vtkMeshSequence::PhaseMesh vtkMeshSequenceWriter::Run::Measure(
  std::size_t k, vtkPointSet* mesh) const
{
  const vtkMeshSequence::Topology& topology = this->Files->topology;
  vtkMeshSequence::PhaseMesh phase;
  // Its own: the input's next phase takes the place of this one.
  phase.mesh.TakeReference(mesh->NewInstance());
  phase.mesh->ShallowCopy(mesh);
  phase.index = k;
  phase.time = this->Times[k];
  try
  {
    vtkMeshSequence::RequireSame(topology, mesh);
    const std::vector<coronary::Vector3> points = vtkMeshSequence::ReadPoints(mesh);
    phase.tetrahedra =
      coronary::MeasureTetrahedra(points, topology.tetrahedra, this->Result.poorAngle);
    phase.surface = coronary::MeasureTriangles(points, topology.triangles);
  }
  catch (const std::invalid_argument& error)
  {
    throw std::invalid_argument("At " + PhaseName(k, phase.time) + ": " + error.what());
  }
  return phase;
}

/// @return what was measured, and where phases are shared the names of the files, for all who share them
std::string vtkMeshSequenceWriter::Run::WritePhase(std::size_t k)
{
  const auto count = static_cast<double>(this->Times.size());
  coronary::Report(this->Progress, static_cast<double>(k) / count);
  this->CollectBefore(k);
  vtkPointSet* mesh = this->MeshAt(k);
  this->CollectBefore(k + 1);
  const auto phase = std::make_shared<const vtkMeshSequence::PhaseMesh>(this->Measure(k, mesh));
  coronary::Report(this->Progress, (static_cast<double>(k) + 0.5) / count);
  std::vector<char> names;
  if (this->Sharing.AtOnce() > 1)
  {
    const std::size_t before = this->Folder->Added().size();
    this->BeginToWrite(phase);
    this->WaitForFiles();
    for (std::size_t n = before; n < this->Folder->Added().size(); ++n)
    {
      const std::string& name = this->Folder->Added()[n];
      names.insert(names.end(), name.begin(), name.end());
      names.push_back('\n');
    }
  }
  else
  {
    this->WaitForFiles(std::min(MostAtOnce, coronary::NumberOfThreads()) - 1);
    this->BeginToWrite(phase);
  }
  return coronary::Packed(NumbersOf(*phase), names);
}

void vtkMeshSequenceWriter::Run::TakePhase(
  const std::string& bytes, coronary::MeshSequenceReport::Phase& entry)
{
  std::vector<double> numbers;
  std::vector<char> names;
  coronary::Unpack(bytes, numbers, names);
  TakeNumbers(numbers, entry);
  const std::vector<std::string>& known = this->Folder->Added();
  std::istringstream lines(std::string(names.begin(), names.end()));
  for (std::string name; std::getline(lines, name);)
  {
    if (std::find(known.begin(), known.end(), name) == known.end())
    {
      this->Folder->Add(name);
    }
  }
}

/// Beside what comes next: packing the files takes longer than moving the mesh, and one thread for each phase.
void vtkMeshSequenceWriter::Run::BeginToWrite(
  std::shared_ptr<const vtkMeshSequence::PhaseMesh> phase)
{
  this->Writing.push_back(std::async(std::launch::async,
    [this, phase]
    {
      for (const auto& format : this->Formats)
      {
        format->Write(*phase);
      }
    }));
}

/// Until the files of no more than so many phases are being written.
void vtkMeshSequenceWriter::Run::WaitForFiles(int left)
{
  while (static_cast<int>(this->Writing.size()) > left)
  {
    std::future<void> first = std::move(this->Writing.front());
    this->Writing.pop_front();
    first.get();
  }
}

/// Lists, the animation, the report; then the new files take the place of the old ones.
void vtkMeshSequenceWriter::Run::Finish()
{
  this->CollectBefore(this->Times.size());
  this->WaitForFiles();
  if (this->Folder->IsOwner())
  {
    vtkMeshSequence::Files& files = *this->Files;
    for (const auto& format : this->Formats)
    {
      format->Finish(this->Result);
    }
    const std::string quality = files.prefix + "quality.csv";
    this->Result.files.emplace_back("quality", quality);
    files.Write(quality, coronary::MeshSequenceCsv(this->Result));
    files.Write(files.name + ".json", coronary::MeshSequenceJson(this->Result));
    this->Folder->TakePlaceOf(coronary::MeshSequenceFiles(this->Self->FileName));
  }
  this->Request.Restore();
  coronary::Report(this->Progress, 1.0);
  if (this->OwnFolder)
  {
    this->OwnFolder->Commit();
  }
}

void vtkMeshSequenceWriter::Run::WriteAll()
{
  try
  {
    this->Begin();
    this->NamePhases();
    const std::vector<std::string> phases = this->Sharing.ResultsOfAll(
      this->Times.size(), [this](std::size_t k) { return this->WritePhase(k); });
    for (std::size_t k = 0; k < phases.size(); ++k)
    {
      this->TakePhase(phases[k], this->Result.phases[k]);
    }
    this->Finish();
  }
  catch (const std::exception& error)
  {
    for (const std::future<void>& files : this->Writing)
    {
      files.wait();
    }
    try
    {
      this->Request.Restore(); // else the next update would begin with the time that failed
    }
    catch (const std::exception&)
    {
      // The input has said why; what came first counts.
    }
    if (this->Folder != nullptr && dynamic_cast<const coronary::Cancelled*>(&error) == nullptr)
    {
      throw std::runtime_error(this->Folder->Translate(error.what()));
    }
    throw;
  }
}

void vtkMeshSequenceWriter::WritePhases(vtkInformation* info)
{
  Run run(this, info);
  run.WriteAll();
  FillTable(run.Result, this->Quality);
  const std::string warning = InversionWarning(run.Result.phases);
  if (!warning.empty() && run.IsOwner())
  {
    vtkWarningMacro(<< warning);
  }
}

void vtkMeshSequenceWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "FileName: " << (this->FileName ? this->FileName : "(none)") << '\n';
  os << indent << "Phases: " << this->Phases << '\n';
  os << indent << "NumberOfPhases: " << this->NumberOfPhases << '\n';
  os << indent << "StartTime: " << this->StartTime << '\n';
  os << indent << "Period: " << this->Period << '\n';
  os << indent << "Times:";
  for (const double time : this->Times)
  {
    os << ' ' << time;
  }
  os << '\n';
  os << indent << "WriteSeries: " << this->WriteSeries << '\n';
  os << indent << "WriteSimVascular: " << this->WriteSimVascular << '\n';
  os << indent << "WriteVmtk: " << this->WriteVmtk << '\n';
  os << indent << "WriteObj: " << this->WriteObj << '\n';
  os << indent << "WritePly: " << this->WritePly << '\n';
  os << indent << "WriteStl: " << this->WriteStl << '\n';
  os << indent << "WriteGltf: " << this->WriteGltf << '\n';
  os << indent << "WriteGltfJson: " << this->WriteGltfJson << '\n';
  os << indent << "GltfInfluences: " << this->GltfInfluences << '\n';
  os << indent << "GltfLoop: " << this->GltfLoop << '\n';
  os << indent << "SimVascularUnit: " << this->SimVascularUnit << '\n';
  os << indent << "KeepWeights: " << this->KeepWeights << '\n';
  os << indent << "PrefixFiles: " << this->PrefixFiles << '\n';
  os << indent << "Digits: " << this->Digits << '\n';
  os << indent << "PoorDihedralAngle: " << this->PoorDihedralAngle << '\n';
  for (const auto& [id, name] : this->FaceNames)
  {
    os << indent << "FaceName " << id << ": " << name << '\n';
  }
}
