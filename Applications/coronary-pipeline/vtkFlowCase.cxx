#include "vtkFlowCase.h"

#include "AtomicFile.h"
#include "BoundedJson.h"
#include "FoamMesh.h"
#include "LayeredMesh.h"
#include "OutletModel.h"
#include "StagedFolder.h"
#include "TextFile.h"
#include "WeightTransfer.h"
#include "vtkMessageTrap.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkDataArray.h"
#include "vtkFloatArray.h"
#include "vtkFrenetSweepSurface.h"
#include "vtkIdList.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSkinDeformation.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
namespace fs = std::filesystem;
namespace names = vtkCoronaryArrayNames;

constexpr double InletSpeed =
  125.0; // mm/s, mean of the section and the cycle: half of what a Doppler wire sees
constexpr double LeftDiastolicRatio = 1.95;
constexpr double RightDiastolicRatio = 1.0;
constexpr int RightTree = 1;

/// Of a tree, before its walls move.
struct Vessels
{
  int tree = 0;
  std::string name; ///< of the inlet's vessel
  CappedSurface surface;
  std::map<int, std::string> patches; ///< by entity
  int inlet = 0;                      ///< entity
};

std::string FileNameOf(std::string text)
{
  for (char& c : text)
  {
    c = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' ? c : '_';
  }
  return text;
}

std::vector<int> TreesOf(vtkPolyData* trees)
{
  vtkDataArray* ids = trees->GetCellData()->GetArray(names::TreeIds);
  if (!ids)
  {
    throw std::runtime_error(
      std::string("The centerlines have no cell array '") + names::TreeIds + "'.");
  }
  std::set<int> found;
  for (vtkIdType n = 0; n < ids->GetNumberOfTuples(); ++n)
  {
    found.insert(static_cast<int>(ids->GetTuple1(n)));
  }
  return { found.begin(), found.end() };
}

vtkSmartPointer<vtkPolyData> LinesOfTree(vtkPolyData* trees, int tree)
{
  vtkDataArray* ids = trees->GetCellData()->GetArray(names::TreeIds);
  auto lines = vtkSmartPointer<vtkPolyData>::New();
  lines->SetPoints(trees->GetPoints());
  lines->GetPointData()->ShallowCopy(trees->GetPointData());
  lines->GetCellData()->CopyAllocate(trees->GetCellData());
  vtkNew<vtkCellArray> cells;
  vtkNew<vtkIdList> points;
  for (vtkIdType n = 0; n < trees->GetNumberOfCells(); ++n)
  {
    if (static_cast<int>(ids->GetTuple1(n)) == tree)
    {
      trees->GetCellPoints(n, points);
      lines->GetCellData()->CopyData(trees->GetCellData(), n, cells->InsertNextCell(points));
    }
  }
  lines->SetLines(cells);
  return lines;
}

Vessels VesselsOf(vtkPolyData* trees, int tree, double edge, vtkMessageTrap& messages)
{
  vtkNew<vtkFrenetSweepSurface> sweep;
  sweep->SetInputData(LinesOfTree(trees, tree));
  sweep->SetEdgeLengthPerRadius(edge);
  // The radius alone decides: a flow has no use for a finer wall where it bends.
  sweep->SetMinimumEdgeLength(0.01);
  sweep->SetMaximumEdgeLength(10.0);
  sweep->SetCurvatureWeight(0.0);
  sweep->SetSharpestBend(0.5);
  UpdateAtTime(sweep, 0, 0.0, messages, [](double) {});
  vtkPolyData* wall = sweep->GetOutput();
  vtkPolyData* caps = sweep->GetCaps();
  Vessels vessels;
  vessels.tree = tree;
  for (vtkIdType n = 0; n < wall->GetNumberOfPoints(); ++n)
  {
    vessels.surface.points.emplace_back(wall->GetPoint(n));
  }
  vtkDataArray* entity = wall->GetCellData()->GetArray(names::CellEntityIds);
  vtkNew<vtkIdList> corners;
  for (vtkIdType n = 0; n < wall->GetNumberOfCells(); ++n)
  {
    wall->GetCellPoints(n, corners);
    vessels.surface.triangles.push_back(
      { corners->GetId(0), corners->GetId(1), corners->GetId(2) });
    vessels.surface.entity.push_back(static_cast<int>(entity->GetTuple1(n)));
  }
  vtkDataArray* capEntity = caps->GetPointData()->GetArray(names::CellEntityIds);
  vtkDataArray* inlet = caps->GetPointData()->GetArray(names::IsInlet);
  auto* label =
    vtkStringArray::SafeDownCast(caps->GetPointData()->GetAbstractArray(names::SegmentLabel));
  std::set<std::string> taken{ "wall", "inlet" };
  vessels.patches[1] = "wall";
  for (vtkIdType n = 0; n < caps->GetNumberOfPoints(); ++n)
  {
    const int id = static_cast<int>(capEntity->GetTuple1(n));
    const std::string vessel = label ? FileNameOf(std::string(label->GetValue(n))) : std::string();
    if (inlet->GetTuple1(n) != 0.0 && vessels.inlet == 0)
    {
      vessels.inlet = id;
      vessels.name = vessel.empty() ? "tree" + std::to_string(tree) : vessel;
      vessels.patches[id] = "inlet";
      continue;
    }
    const std::string plain = "outlet_" + (vessel.empty() ? std::to_string(id) : vessel);
    std::string own = plain;
    for (int k = 2; !taken.insert(own).second; ++k)
    {
      own = plain + "_" + std::to_string(k);
    }
    vessels.patches[id] = own;
  }
  if (vessels.inlet == 0 || vessels.patches.size() < 3)
  {
    throw std::runtime_error("Tree " + std::to_string(tree) + " has no inlet, or no outlet.");
  }
  return vessels;
}

CompactSkinWeights WeightsOf(vtkUnstructuredGrid* mesh)
{
  vtkDataArray* bones = mesh->GetPointData()->GetArray(names::BoneIndices);
  vtkDataArray* weights = mesh->GetPointData()->GetArray(names::BoneWeightsCompact);
  if (!bones || !weights || bones->GetNumberOfComponents() != weights->GetNumberOfComponents())
  {
    throw std::runtime_error("The tetrahedra have no skin weights.");
  }
  CompactSkinWeights compact;
  compact.influences = weights->GetNumberOfComponents();
  for (vtkIdType n = 0; n < mesh->GetNumberOfPoints(); ++n)
  {
    for (int c = 0; c < compact.influences; ++c)
    {
      compact.bone.push_back(static_cast<std::int32_t>(bones->GetComponent(n, c)));
      compact.weight.push_back(static_cast<float>(weights->GetComponent(n, c)));
    }
  }
  return compact;
}

/// The mesh as the deformation wants it: points and weights.
vtkSmartPointer<vtkUnstructuredGrid> SkinnedPoints(
  vtkUnstructuredGrid* from, const LayeredMesh& mesh)
{
  std::vector<Vector3> points;
  for (vtkIdType n = 0; n < from->GetNumberOfPoints(); ++n)
  {
    points.emplace_back(from->GetPoint(n));
  }
  std::vector<Tetrahedron> tetrahedra;
  vtkNew<vtkIdList> corners;
  for (vtkIdType n = 0; n < from->GetNumberOfCells(); ++n)
  {
    from->GetCellPoints(n, corners);
    tetrahedra.push_back(
      { corners->GetId(0), corners->GetId(1), corners->GetId(2), corners->GetId(3) });
  }
  std::vector<Vector3> places;
  auto data = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> own;
  own->SetDataTypeToDouble();
  for (const Vector3& point : mesh.points)
  {
    places.push_back(mesh.WithoutExtension(point));
    own->InsertNextPoint(point.data());
  }
  data->SetPoints(own);
  const CompactSkinWeights weights = TransferWeights(points, tetrahedra, WeightsOf(from), places);
  vtkNew<vtkIntArray> bone;
  vtkNew<vtkFloatArray> weight;
  bone->SetName(names::BoneIndices);
  weight->SetName(names::BoneWeightsCompact);
  bone->SetNumberOfComponents(weights.influences);
  weight->SetNumberOfComponents(weights.influences);
  bone->SetNumberOfTuples(own->GetNumberOfPoints());
  weight->SetNumberOfTuples(own->GetNumberOfPoints());
  for (std::size_t k = 0; k < weights.bone.size(); ++k)
  {
    bone->SetValue(static_cast<vtkIdType>(k), weights.bone[k]);
    weight->SetValue(static_cast<vtkIdType>(k), weights.weight[k]);
  }
  data->GetPointData()->AddArray(bone);
  data->GetPointData()->AddArray(weight);
  vtkNew<vtkIdList> tetrahedron;
  data->Allocate(static_cast<vtkIdType>(mesh.tetrahedra.size()));
  for (const Tetrahedron& t : mesh.tetrahedra)
  {
    tetrahedron->SetNumberOfIds(4);
    std::copy(t.begin(), t.end(), tetrahedron->begin());
    data->InsertNextCell(VTK_TETRA, tetrahedron);
  }
  return data;
}

OutletModel OutletsOf(const Vessels& vessels, const LayeredMesh& mesh,
  const FlowCaseSettings& settings, std::vector<std::string>& patches)
{
  std::vector<double> diameters;
  OutletModelSettings model;
  model.cycle = settings.cycle;
  model.diastolicRatio = vessels.tree == RightTree ? RightDiastolicRatio : LeftDiastolicRatio;
  model.meanFlow = settings.meanFlow;
  for (const EndExtension& end : mesh.ends)
  {
    if (end.entity == vessels.inlet)
    {
      if (!(settings.meanFlow > 0.0))
      {
        model.meanFlow = 1e-3 * InletSpeed * M_PI * end.radius * end.radius;
      }
      continue;
    }
    patches.push_back(vessels.patches.at(end.entity));
    diameters.push_back(2.0 * end.radius);
  }
  return MakeOutletModel(diameters, model);
}

FoamCase CaseOf(const Vessels& vessels, const LayeredMesh& mesh, const FlowCaseSettings& settings)
{
  std::vector<std::string> patches;
  const OutletModel model = OutletsOf(vessels, mesh, settings, patches);
  FoamCase flow;
  flow.title = "Blood flow in the vessels of " + vessels.name;
  flow.moving = !settings.rest;
  flow.blood = settings.blood;
  flow.cycle = settings.cycle;
  flow.cycles = settings.cycles;
  flow.stepsPerCycle = settings.steps;
  flow.inflow = model.inflow;
  flow.musclePressure = model.musclePressure;
  flow.venousPressure = model.venousPressure;
  flow.startPressure = model.startPressure;
  for (std::size_t n = 0; n < patches.size(); ++n)
  {
    const OutletModel::Outlet& outlet = model.outlets[n];
    flow.outlets.push_back({ patches[n], outlet.proximal, outlet.distal, outlet.compliance });
  }
  return flow;
}

/// One tree's folder.
class CaseWriter
{
public:
  CaseWriter(const FlowCaseInput& input, const FlowCaseSettings& settings,
    const std::string& output, const std::string& prefix, StagedFolder& folder,
    vtkMessageTrap& messages)
    : Input(input)
    , Settings(settings)
    , Output(output)
    , Prefix(prefix)
    , Folder(folder)
    , Messages(messages)
  {
  }

  std::string Write(int tree, const std::function<void(double)>& progress);

  std::vector<std::string> Files;

private:
  void RequireNoResults(const std::string& name) const;
  void Add(const std::string& name, const std::string& text);
  std::vector<Vector3> MovedTo(double phase);
  PolyhedralQuality WriteMotion(const LayeredMesh& mesh, const std::vector<Vector3>& first,
    const std::function<void(double)>& progress, double& least);

  const FlowCaseInput& Input;
  const FlowCaseSettings& Settings;
  const std::string Output;
  const std::string Prefix;
  StagedFolder& Folder;
  vtkMessageTrap& Messages;
  std::string Case; ///< folder below the output
};

void CaseWriter::RequireNoResults(const std::string& name) const
{
  std::error_code ignored;
  for (const fs::directory_entry& entry :
    fs::directory_iterator(fs::path(this->Output) / name, ignored))
  {
    const std::string file = entry.path().filename().string();
    if (file != "0" && std::isdigit(static_cast<unsigned char>(file.front())) != 0 &&
      entry.is_directory(ignored))
    {
      throw std::runtime_error("'" + (fs::path(this->Output) / name).string() +
        "' has results of a solver (" + file +
        "), which belong to the mesh that is there: move them away, or choose another --output.");
    }
  }
}

void CaseWriter::Add(const std::string& name, const std::string& text)
{
  const std::string path = this->Case + "/" + name;
  WriteFileAtomically(this->Folder.Add(path), text);
  this->Files.push_back(path);
}

std::vector<Vector3> CaseWriter::MovedTo(double phase)
{
  UpdateAtTime(this->Input.deformation, 0, phase, this->Messages, [](double) {});
  auto* moved = vtkPointSet::SafeDownCast(this->Input.deformation->GetOutputDataObject(0));
  std::vector<Vector3> points;
  for (vtkIdType n = 0; n < moved->GetNumberOfPoints(); ++n)
  {
    points.emplace_back(moved->GetPoint(n));
  }
  return points;
}

/// Frames, and the quality of each; the worst of all is returned.
PolyhedralQuality CaseWriter::WriteMotion(const LayeredMesh& mesh,
  const std::vector<Vector3>& first, const std::function<void(double)>& progress, double& least)
{
  PolyhedralQuality worst = MeasurePolyhedra(mesh.cells, first);
  std::string table = "time_s,least_volume_mm3,not_positive,non_orthogonality_deg,skewness,volume_"
                      "mm3,least_volume_ratio_to_next\n";
  for (const auto& [name, text] : FoamMotionPoints(mesh.cells, first))
  {
    this->Add("constant/boundaryData/" + name, text);
  }
  std::vector<Vector3> now = first;
  for (int k = 0; k <= this->Settings.frames; ++k)
  {
    progress(static_cast<double>(k) / (this->Settings.frames + 1));
    const double phase = static_cast<double>(k) / this->Settings.frames;
    for (const auto& [name, text] :
      FoamMotionFrame(mesh.cells, first, now, phase * this->Settings.cycle))
    {
      this->Add("constant/boundaryData/" + name, text);
    }
    const PolyhedralQuality quality = MeasurePolyhedra(mesh.cells, now);
    double ratio = 1.0;
    if (k < this->Settings.frames)
    {
      // The last one is the first one, to the bit.
      std::vector<Vector3> next =
        k + 1 < this->Settings.frames ? this->MovedTo((k + 1.0) / this->Settings.frames) : first;
      ratio = LeastVolumeRatioBetween(mesh.cells, now, next);
      now = std::move(next);
    }
    char line[240];
    std::snprintf(line, sizeof line, "%.10g,%.6g,%lld,%.4f,%.4f,%.8g,%.4f\n",
      phase * this->Settings.cycle, quality.minimumVolume,
      static_cast<long long>(quality.notPositive), quality.maximumNonOrthogonality * 180.0 / M_PI,
      quality.maximumSkewness, quality.totalVolume, ratio);
    table += line;
    least = std::min(least, ratio);
    worst.notPositive = std::max(worst.notPositive, quality.notPositive);
    worst.wrongPyramids = std::max(worst.wrongPyramids, quality.wrongPyramids);
    worst.maximumNonOrthogonality =
      std::max(worst.maximumNonOrthogonality, quality.maximumNonOrthogonality);
    worst.maximumSkewness = std::max(worst.maximumSkewness, quality.maximumSkewness);
  }
  this->Add("quality.csv", table);
  return worst;
}

std::string CaseWriter::Write(int tree, const std::function<void(double)>& progress)
{
  const Vessels vessels = VesselsOf(this->Input.trees, tree, this->Settings.edge, this->Messages);
  this->Case = this->Prefix + "_" + vessels.name;
  this->RequireNoResults(this->Case);
  LayeredMeshSettings layers;
  layers.layers = this->Settings.layers;
  layers.extension = this->Settings.extension;
  const LayeredMesh mesh = MakeLayeredMesh(vessels.surface, layers, vessels.patches);
  progress(0.2);
  this->Input.deformation->SetInputData(0, SkinnedPoints(this->Input.mesh, mesh));
  const std::vector<Vector3> first = this->MovedTo(0.0);
  double least = std::numeric_limits<double>::infinity();
  PolyhedralQuality quality = MeasurePolyhedra(mesh.cells, first);
  if (!this->Settings.rest)
  {
    quality = this->WriteMotion(
      mesh, first, [&](double done) { progress(0.2 + 0.8 * done); }, least);
  }
  for (const auto& [name, text] : FoamMeshFiles(mesh.cells, first, vessels.patches.at(1)))
  {
    this->Add("constant/polyMesh/" + name, text);
  }
  const FoamCase flow = CaseOf(vessels, mesh, this->Settings);
  for (const auto& [name, text] : FoamCaseFiles(flow))
  {
    this->Add(name, text);
  }
  char text[320];
  std::snprintf(text, sizeof text,
    "%s: %zu prisms, %zu tetrahedra, %zu outlets, non-orthogonality up to %.1f degrees, skewness "
    "up to %.2f",
    this->Case.c_str(), mesh.prisms.size(), mesh.tetrahedra.size(), flow.outlets.size(),
    quality.maximumNonOrthogonality * 180.0 / M_PI, quality.maximumSkewness);
  std::string sentence = text;
  if (!this->Settings.rest)
  {
    std::snprintf(text, sizeof text, ", no cell below %.0f %% of its volume from frame to frame",
      100.0 * least);
    sentence += text;
  }
  if (!quality.IsSound() || !(least > 0.0))
  {
    sentence += "; a solver will not bear this mesh: see quality.csv";
  }
  return sentence;
}

/// Of an older list; none when it is not there or no such list.
std::vector<std::string> FilesOfList(const std::string& path)
{
  std::error_code ignored;
  std::vector<std::string> files;
  if (!fs::is_regular_file(path, ignored))
  {
    return files;
  }
  const nlohmann::json list =
    nlohmann::json::parse(ReadTextFile(path, "a list of files"), nullptr, false);
  const auto entries = list.is_object() ? list.find("files") : list.end();
  if (list.is_object() && entries != list.end() && entries->is_array())
  {
    for (const nlohmann::json& entry : *entries)
    {
      if (entry.is_string())
      {
        files.push_back(entry.get<std::string>());
      }
    }
  }
  return files;
}
}

std::vector<std::string> WriteFlowCases(const FlowCaseInput& input,
  const FlowCaseSettings& settings, const std::string& output, const std::string& name,
  StagedFolder& folder, vtkMessageTrap& messages, const std::function<void(double)>& progress)
{
  std::vector<int> trees = TreesOf(input.trees);
  if (settings.tree >= 0)
  {
    if (std::find(trees.begin(), trees.end(), settings.tree) == trees.end())
    {
      throw std::runtime_error(
        "The centerlines have no tree " + std::to_string(settings.tree) + ".");
    }
    trees = { settings.tree };
  }
  CaseWriter writer(input, settings, output, name + "_openfoam", folder, messages);
  std::vector<std::string> sentences;
  for (std::size_t k = 0; k < trees.size(); ++k)
  {
    sentences.push_back(writer.Write(trees[k],
      [&](double done)
      { progress((static_cast<double>(k) + done) / static_cast<double>(trees.size())); }));
  }
  const std::string list = name + "_openfoam.json";
  folder.TakePlaceOf(FilesOfList((fs::path(output) / list).string()));
  nlohmann::ordered_json json;
  json["cases"] = sentences;
  json["files"] = writer.Files;
  WriteFileAtomically(folder.Add(list), json.dump(1) + "\n");
  return sentences;
}
}
