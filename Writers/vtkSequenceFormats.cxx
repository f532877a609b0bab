#include "vtkSequenceFormats.h"

#include "AtomicFile.h"
#include "FileSeries.h"
#include "MeshFile.h"
#include "vtkBoneMotion.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkCoronaryFilterParts.h"
#include "vtkGltfModel.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkIntArray.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkUnstructuredGrid.h"
#include "vtkXMLPolyDataWriter.h"
#include "vtkXMLUnstructuredGridWriter.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace names = vtkCoronaryArrayNames;

namespace vtkMeshSequence
{
namespace
{
// Of SimVascular and svFSIplus, which take 32-bit integers only.
constexpr const char* GlobalNodeID = "GlobalNodeID";
constexpr const char* GlobalElementID = "GlobalElementID";
constexpr const char* ModelFaceID = "ModelFaceID";
constexpr const char* ModelRegionID = "ModelRegionID";

template <std::size_t Corners>
vtkSmartPointer<vtkCellArray> MakeCells(
  const std::vector<std::array<std::int64_t, Corners>>& elements)
{
  auto cells = vtkSmartPointer<vtkCellArray>::New();
  const auto count = static_cast<vtkIdType>(elements.size());
  cells->AllocateExact(count, static_cast<vtkIdType>(Corners) * count);
  for (const auto& element : elements)
  {
    std::array<vtkIdType, Corners> ids{};
    std::copy(element.begin(), element.end(), ids.begin());
    cells->InsertNextCell(static_cast<vtkIdType>(Corners), ids.data());
  }
  return cells;
}

bool IsWeight(const char* name)
{
  const std::string text = name ? name : "";
  return text == names::BoneIndices || text == names::BoneWeightsCompact ||
    text == names::BoneWeights || text == names::DroppedWeight;
}

void RemoveWeights(vtkPointData* data)
{
  for (const char* name :
    { names::BoneIndices, names::BoneWeightsCompact, names::BoneWeights, names::DroppedWeight })
  {
    data->RemoveArray(name);
  }
}

std::string XmlOf(vtkDataSet* shared)
{
  // VTK's writer keeps in each array what its range is, and phases that are packed beside each other share arrays.
  vtkSmartPointer<vtkDataSet> data;
  data.TakeReference(shared->NewInstance());
  data->DeepCopy(shared);
  vtkSmartPointer<vtkXMLUnstructuredDataWriter> writer;
  if (vtkPolyData::SafeDownCast(shared))
  {
    writer = vtkSmartPointer<vtkXMLPolyDataWriter>::New();
  }
  else
  {
    writer = vtkSmartPointer<vtkXMLUnstructuredGridWriter>::New();
  }
  // Into memory: VTK's writer does not notice when the last bytes find no room on the disk. And not
  // appended, which Debian's expat makes unreadable for VTK.
  writer->SetInputData(data);
  writer->WriteToOutputStringOn();
  writer->SetDataModeToBinary();
  writer->SetCompressionLevel(1); // 1.4 % larger than by VTK's own 5, in two thirds of the time
  if (!writer->Write())
  {
    throw std::runtime_error("VTK's XML writer failed");
  }
  return writer->GetOutputString();
}

void AddNumber(vtkFieldData* data, const char* name, double value)
{
  vtkCoronary::AddArray<vtkDoubleArray>(data, name, std::vector<double>{ value });
}

/// Ids that begin with 1.
void AddIds(vtkFieldData* data, const char* name, const std::vector<std::int64_t>& fromZero)
{
  vtkNew<vtkIntArray> ids;
  ids->SetName(name);
  ids->SetNumberOfValues(static_cast<vtkIdType>(fromZero.size()));
  for (std::size_t n = 0; n < fromZero.size(); ++n)
  {
    ids->SetValue(static_cast<vtkIdType>(n), static_cast<int>(fromZero[n] + 1));
  }
  data->AddArray(ids);
}

std::vector<std::int64_t> Numbered(std::size_t count)
{
  std::vector<std::int64_t> numbers(count);
  for (std::size_t n = 0; n < count; ++n)
  {
    numbers[n] = static_cast<std::int64_t>(n);
  }
  return numbers;
}

/// Values of the chosen tuples, of arrays of numbers.
void CopyTuples(vtkDataSetAttributes* from, const std::vector<vtkIdType>& tuples, bool keepWeights,
  vtkDataSetAttributes* to)
{
  vtkNew<vtkIdList> ids;
  ids->SetNumberOfIds(static_cast<vtkIdType>(tuples.size()));
  std::copy(tuples.begin(), tuples.end(), ids->begin());
  for (int n = 0; n < from->GetNumberOfArrays(); ++n)
  {
    vtkDataArray* array = from->GetArray(n);
    if (!array || (!keepWeights && IsWeight(array->GetName())))
    {
      continue;
    }
    vtkSmartPointer<vtkDataArray> part;
    part.TakeReference(array->NewInstance());
    part->SetName(array->GetName());
    part->SetNumberOfComponents(array->GetNumberOfComponents());
    part->SetNumberOfTuples(ids->GetNumberOfIds());
    for (int c = 0; c < array->GetNumberOfComponents(); ++c)
    {
      part->SetComponentName(c, array->GetComponentName(c));
    }
    array->GetTuples(ids, part);
    to->AddArray(part);
  }
}

vtkSmartPointer<vtkPoints> PointsOf(
  vtkPointSet* mesh, const std::vector<vtkIdType>& chosen, double unit)
{
  auto points = vtkSmartPointer<vtkPoints>::New();
  points->SetDataType(mesh->GetPoints()->GetDataType());
  points->SetNumberOfPoints(static_cast<vtkIdType>(chosen.size()));
  for (std::size_t n = 0; n < chosen.size(); ++n)
  {
    double x[3];
    mesh->GetPoint(chosen[n], x);
    points->SetPoint(static_cast<vtkIdType>(n), x[0] / unit, x[1] / unit, x[2] / unit);
  }
  return points;
}

/// A vector array of the mesh, if it has it, as three numbers a point: `letter` and x, y or z.
void AddVectors(vtkPointSet* mesh, const char* name, const std::string& letter,
  const std::vector<vtkIdType>& points, coronary::FileMesh& surface)
{
  vtkDataArray* array = mesh->GetPointData()->GetArray(name);
  for (int c = 0; array != nullptr && array->GetNumberOfComponents() == 3 && c < 3; ++c)
  {
    std::vector<float> values;
    values.reserve(points.size());
    for (const vtkIdType point : points)
    {
      values.push_back(static_cast<float>(array->GetComponent(point, c)));
    }
    surface.vertexValues.emplace_back(letter + "xyz"[c], std::move(values));
  }
}

/// Field data of the phase instead of those at rest.
void AddFields(const Files& shared, const PhaseMesh& phase, vtkDataSet* data)
{
  vtkNew<vtkFieldData> fields;
  fields->ShallowCopy(phase.mesh->GetFieldData());
  if (!shared.keepWeights)
  {
    vtkBoneMotion::Remove(fields);
  }
  AddNumber(fields, names::PhaseTime, phase.time);
  AddNumber(fields, names::SurfaceArea, phase.surface.area);
  if (!shared.topology.tetrahedra.empty())
  {
    const coronary::TetrahedraQuality& quality = phase.tetrahedra;
    vtkNew<vtkIdTypeArray> inverted;
    inverted->SetName(names::InvertedTetrahedra);
    for (const std::int64_t id : quality.inverted)
    {
      inverted->InsertNextValue(id);
    }
    fields->AddArray(inverted);
    AddNumber(fields, names::PoorFraction,
      static_cast<double>(quality.poor) / static_cast<double>(shared.topology.tetrahedra.size()));
    AddNumber(fields, names::MeshMinimumVolume, quality.minimumVolume);
    AddNumber(fields, names::TotalVolume, quality.totalVolume);
    AddNumber(fields, names::MeshMinimumDihedralAngle, quality.minimumDihedralAngle);
    AddNumber(fields, names::MeshMaximumRadiusEdgeRatio, quality.maximumRadiusEdgeRatio);
  }
  data->SetFieldData(fields);
}

/// A numbered file a phase, and lists of them.
class NumberedFiles : public Format
{
public:
  using Encoder = std::string (*)(const Files&, const PhaseMesh&);

  /// @param kind  in the report
  NumberedFiles(
    Files& files, std::string kind, const std::string& stem, std::string extension, Encoder encode)
    : Format(files)
    , Kind(std::move(kind))
    , Stem(files.prefix + stem)
    , Extension(std::move(extension))
    , Encode(encode)
  {
  }

  void Name(std::size_t phase, double time, coronary::MeshSequenceReport::Phase& entry) override
  {
    const std::string file = this->Stem + "_" + this->Shared.Number(phase) + "." + this->Extension;
    this->List.push_back({ file, time });
    entry.files.emplace_back(this->Kind, file);
  }

  void Write(const PhaseMesh& phase) override
  {
    this->Shared.Write(this->List[phase.index].path, this->Encode(this->Shared, phase));
  }

  void Finish(coronary::MeshSequenceReport& report) override
  {
    const std::string list = this->Stem + "." + this->Extension + ".series";
    const bool xml = this->Kind != this->Extension; // a .pvd list is for VTK's own
    this->Shared.Write(list, coronary::FileSeriesText(this->List));
    if (xml)
    {
      this->Shared.Write(this->Stem + ".pvd", coronary::PvdText(this->List));
    }
    report.files.emplace_back(this->Kind, xml ? this->Stem + ".pvd" : list);
  }

private:
  const std::string Kind;
  const std::string Stem; ///< of the files' names
  const std::string Extension;
  const Encoder Encode;
  std::vector<coronary::TimedFile> List;
};

/// A folder a phase with the mesh and each of its faces.
class SimVascularFolders : public Format
{
public:
  SimVascularFolders(Files& files, double unit)
    : Format(files)
    , Unit(unit)
  {
    for (const auto& face : files.faces)
    {
      this->Faces.emplace(face.id, files.topology.PatchOf(face.id));
    }
  }

  void Name(std::size_t phase, double, coronary::MeshSequenceReport::Phase& entry) override
  {
    entry.files.emplace_back("simvascular", this->FolderOf(phase));
  }
  void Write(const PhaseMesh& phase) override;
  void Finish(coronary::MeshSequenceReport&) override {}

private:
  std::string FolderOf(std::size_t phase) const
  {
    return this->Shared.prefix + "simvascular/phase_" + this->Shared.Number(phase) +
      "/mesh-complete";
  }

  const double Unit; ///< mm
  std::map<int, Patch> Faces;
};

/// One file of all phases.
class GltfAnimation : public Format
{
public:
  GltfAnimation(const FormatSettings& settings, Files& files, vtkPointSet* mesh);

  void Name(std::size_t, double, coronary::MeshSequenceReport::Phase&) override {}
  void Write(const PhaseMesh&) override {}
  bool NeedsAll() const override { return true; }
  void Collect(vtkPointSet* mesh, double time) override { this->Gltf.AddPhase(mesh, time); }
  void Finish(coronary::MeshSequenceReport& report) override;

private:
  vtkGltfModel Gltf;
  const bool Binary;
  const bool Text;
};

std::string VolumeBytes(const Files& shared, const PhaseMesh& phase)
{
  const Topology& topology = shared.topology;
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->ShallowCopy(phase.mesh);
  grid->SetCells(VTK_TETRA, shared.tetrahedra);
  if (!shared.keepWeights)
  {
    RemoveWeights(grid->GetPointData());
  }
  vtkCellData* cells = grid->GetCellData();
  vtkCoronary::AddArray<vtkIntArray>(
    cells, topology.entityIdsName, std::vector<int>(topology.tetrahedra.size(), 0));
  vtkCoronary::AddArray<vtkDoubleArray>(cells, names::TetrahedronVolume, phase.tetrahedra.volume);
  vtkCoronary::AddArray<vtkDoubleArray>(
    cells, names::MinimumDihedralAngle, phase.tetrahedra.minimumDihedral);
  vtkCoronary::AddArray<vtkDoubleArray>(
    cells, names::RadiusEdgeRatio, phase.tetrahedra.radiusEdgeRatio);
  AddFields(shared, phase, grid);
  return XmlOf(grid);
}

std::string SurfaceBytes(const Files& shared, const PhaseMesh& phase)
{
  const Topology& topology = shared.topology;
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  if (topology.tetrahedra.empty())
  {
    surface->ShallowCopy(phase.mesh);
    if (!shared.keepWeights)
    {
      RemoveWeights(surface->GetPointData());
    }
  }
  else
  {
    surface->SetPoints(PointsOf(phase.mesh, shared.surface.points, 1.0));
    surface->SetPolys(shared.surface.cells);
    CopyTuples(phase.mesh->GetPointData(), shared.surface.points, shared.keepWeights,
      surface->GetPointData());
    vtkCoronary::AddArray<vtkIdTypeArray>(
      surface->GetPointData(), names::MeshPointId, shared.surface.points);
    if (topology.data)
    {
      const std::vector<std::int64_t> all = Numbered(topology.triangles.size());
      CopyTuples(topology.data, std::vector<vtkIdType>(all.begin(), all.end()), shared.keepWeights,
        surface->GetCellData());
    }
    vtkCoronary::AddArray<vtkIdTypeArray>(
      surface->GetCellData(), names::TetrahedronId, topology.behind);
  }
  vtkCoronary::AddArray<vtkIntArray>(
    surface->GetCellData(), topology.entityIdsName, topology.entity);
  AddFields(shared, phase, surface);
  return XmlOf(surface);
}

std::string VmtkBytes(const Files& shared, const PhaseMesh& phase)
{
  const Topology& topology = shared.topology;
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  grid->SetPoints(phase.mesh->GetPoints());
  grid->GetPointData()->ShallowCopy(phase.mesh->GetPointData());
  if (!shared.keepWeights)
  {
    RemoveWeights(grid->GetPointData());
  }
  const std::size_t tetrahedra = topology.tetrahedra.size();
  std::vector<int> ids(tetrahedra, 0);
  ids.insert(ids.end(), topology.entity.begin(), topology.entity.end());
  std::vector<int> types(tetrahedra, VTK_TETRA);
  types.resize(ids.size(), VTK_TRIANGLE);
  vtkNew<vtkCellArray> cells;
  cells->DeepCopy(shared.tetrahedra);
  cells->Append(MakeCells(topology.triangles));
  grid->SetCells(types.data(), cells);
  vtkCoronary::AddArray<vtkIntArray>(grid->GetCellData(), topology.entityIdsName, ids);
  return XmlOf(grid);
}

/// The surface for formats of other programs.
/// @param values  whether displacements and velocities are wanted, as far as the mesh has them
coronary::FileMesh PlainSurface(const Files& shared, const PhaseMesh& phase, bool values)
{
  coronary::FileMesh surface;
  std::ostringstream comment;
  comment << "DynamicCoronary, mm, LPS, time " << phase.time;
  surface.comment = comment.str();
  surface.points.resize(shared.surface.points.size());
  for (std::size_t n = 0; n < surface.points.size(); ++n)
  {
    phase.mesh->GetPoint(shared.surface.points[n], surface.points[n].data());
  }
  surface.triangles = ReadCells<3>(shared.surface.cells);
  surface.face = shared.topology.entity;
  for (const auto& face : shared.faces)
  {
    surface.faces.emplace_back(face.id, face.name);
  }
  if (values)
  {
    AddVectors(phase.mesh, names::Displacement, "d", shared.surface.points, surface);
    AddVectors(phase.mesh, names::Velocity, "v", shared.surface.points, surface);
  }
  return surface;
}

std::string ObjBytes(const Files& shared, const PhaseMesh& phase)
{
  return coronary::ObjText(PlainSurface(shared, phase, false));
}

std::string PlyBytes(const Files& shared, const PhaseMesh& phase)
{
  return coronary::PlyBytes(PlainSurface(shared, phase, true));
}

std::string StlBytes(const Files& shared, const PhaseMesh& phase)
{
  return coronary::StlBytes(PlainSurface(shared, phase, false));
}

/// A face, or all of them, on points of its own.
vtkSmartPointer<vtkPolyData> FaceOf(
  const Topology& topology, const PhaseMesh& phase, const Patch& patch, double unit)
{
  auto face = vtkSmartPointer<vtkPolyData>::New();
  face->SetPoints(PointsOf(phase.mesh, patch.points, unit));
  face->SetPolys(patch.cells);
  AddIds(face->GetPointData(), GlobalNodeID,
    std::vector<std::int64_t>(patch.points.begin(), patch.points.end()));
  std::vector<std::int64_t> elements;
  std::vector<int> ids;
  for (const std::int64_t n : patch.triangles)
  {
    elements.push_back(topology.behind[static_cast<std::size_t>(n)]);
    ids.push_back(topology.entity[static_cast<std::size_t>(n)]);
  }
  AddIds(face->GetCellData(), GlobalElementID, elements);
  vtkCoronary::AddArray<vtkIntArray>(face->GetCellData(), ModelFaceID, ids);
  return face;
}

void SimVascularFolders::Write(const PhaseMesh& phase)
{
  Files& shared = this->Shared;
  const Topology& topology = shared.topology;
  const std::string folder = this->FolderOf(phase.index);
  vtkNew<vtkUnstructuredGrid> grid;
  const std::vector<std::int64_t> all = Numbered(static_cast<std::size_t>(topology.points));
  grid->SetPoints(PointsOf(phase.mesh, std::vector<vtkIdType>(all.begin(), all.end()), this->Unit));
  grid->SetCells(VTK_TETRA, shared.tetrahedra);
  AddIds(grid->GetPointData(), GlobalNodeID, all);
  AddIds(grid->GetCellData(), GlobalElementID, Numbered(topology.tetrahedra.size()));
  vtkCoronary::AddArray<vtkIntArray>(
    grid->GetCellData(), ModelRegionID, std::vector<int>(topology.tetrahedra.size(), 1));
  shared.Write(folder + "/mesh-complete.mesh.vtu", XmlOf(grid));
  shared.Write(folder + "/mesh-complete.exterior.vtp",
    XmlOf(FaceOf(topology, phase, shared.surface, this->Unit)));
  for (const auto& face : shared.faces)
  {
    const std::string text = XmlOf(FaceOf(topology, phase, this->Faces.at(face.id), this->Unit));
    shared.Write(folder + "/mesh-surfaces/" + face.name + ".vtp", text);
    if (face.id == WallId)
    {
      shared.Write(folder + "/walls_combined.vtp", text);
    }
  }
}

GltfAnimation::GltfAnimation(const FormatSettings& settings, Files& files, vtkPointSet* mesh)
  : Format(files)
  , Gltf(mesh, files.surface.points, settings.gltfInfluences)
  , Binary(settings.gltf)
  , Text(settings.gltfJson)
{
  const std::vector<Triangle> triangles = ReadCells<3>(files.surface.cells);
  for (const auto& face : files.faces)
  {
    coronary::GltfFace part{ face.name, face.id != WallId, {} };
    for (std::size_t n = 0; n < triangles.size(); ++n)
    {
      if (files.topology.entity[n] == face.id)
      {
        part.triangles.push_back(triangles[n]);
      }
    }
    this->Gltf.Model.faces.push_back(std::move(part));
  }
  this->Gltf.Model.name = files.name;
  this->Gltf.Model.period = settings.period;
  this->Gltf.Model.loop = settings.gltfLoop;
}

void GltfAnimation::Finish(coronary::MeshSequenceReport& report)
{
  const auto write = [&](const char* kind, const char* extension, const std::string& bytes)
  {
    const std::string file = this->Shared.prefix + "skin." + extension;
    this->Shared.Write(file, bytes);
    report.files.emplace_back(kind, file);
  };
  if (this->Binary)
  {
    write("gltf", "glb", coronary::GltfBinary(this->Gltf.Model, *this->Gltf.Skin));
  }
  if (this->Text)
  {
    write("gltf-json", "gltf", coronary::GltfText(this->Gltf.Model, *this->Gltf.Skin));
  }
}
}

Files::Files(std::string ofReport, std::string begin, int minimumDigits, std::size_t phaseCount,
  Topology same, std::vector<coronary::MeshSequenceReport::Face> named, bool weights,
  coronary::StagedFolder& to)
  : name(std::move(ofReport))
  , prefix(std::move(begin))
  , topology(std::move(same))
  , faces(std::move(named))
  , keepWeights(weights)
  , surface(this->topology.PatchOf(0))
  , Folder(to)
  , Phases(phaseCount)
  , Digits(static_cast<std::size_t>(minimumDigits))
{
  if (!this->topology.tetrahedra.empty())
  {
    this->tetrahedra =
      this->topology.turned ? MakeCells(this->topology.tetrahedra) : this->topology.inputCells;
  }
}

std::string Files::Number(std::size_t phase) const
{
  return coronary::SeriesNumber(phase, this->Phases, this->Digits);
}

void Files::Write(const std::string& file, const std::string& bytes)
{
  std::string path;
  {
    const std::lock_guard<std::mutex> lock(this->Adding);
    path = this->Folder.Add(file);
  }
  coronary::WriteFileAtomically(path, bytes);
}

std::vector<std::unique_ptr<Format>> MakeFormats(
  const FormatSettings& settings, Files& files, vtkPointSet* mesh)
{
  std::vector<std::unique_ptr<Format>> formats;
  const auto add = [&](bool wanted, const char* kind, const char* stem, const char* extension,
                     NumberedFiles::Encoder encode)
  {
    if (wanted)
    {
      formats.push_back(std::make_unique<NumberedFiles>(files, kind, stem, extension, encode));
    }
  };
  const bool volume = !files.topology.tetrahedra.empty();
  add(settings.series && volume, "volume", "volume", "vtu", VolumeBytes);
  add(settings.series, "surface", "surface", "vtp", SurfaceBytes);
  add(settings.vmtk, "vmtk", "vmtk", "vtu", VmtkBytes);
  add(settings.obj, "obj", "surface", "obj", ObjBytes);
  add(settings.ply, "ply", "surface", "ply", PlyBytes);
  add(settings.stl, "stl", "surface", "stl", StlBytes);
  if (settings.simVascular)
  {
    formats.push_back(std::make_unique<SimVascularFolders>(files, settings.simVascularUnit));
  }
  if ((settings.gltf || settings.gltfJson) && files.IsOwner())
  {
    formats.push_back(std::make_unique<GltfAnimation>(settings, files, mesh));
  }
  return formats;
}
}
