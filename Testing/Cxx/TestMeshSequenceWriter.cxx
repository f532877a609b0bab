// vtkMeshSequenceWriter through the VTK pipeline: one topology, ids and files of all formats, inverted elements, refusals.
#include "vtkMeshSequenceWriter.h"

#include "FileSeries.h"
#include "FilterMessages.h"
#include "GltfEvaluator.h"
#include "MeshQuality.h"
#include "MeshSequenceReport.h"
#include "SequenceTestData.h"
#include "TimedTestSource.h"
#include "vtkCardiacPhaseInterpolator.h"
#include "vtkSkinDeformation.h"

#include "vtkCompositeDataIterator.h"
#include "vtkCompositeDataSet.h"
#include "vtkGLTFReader.h"
#include "vtkOBJReader.h"
#include "vtkPLYReader.h"
#include "vtkSTLReader.h"
#include "vtkTable.h"
#include "vtkXMLPolyDataReader.h"
#include "vtkXMLUnstructuredGridReader.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <unistd.h>

namespace TestMeshSequenceWriter
{
namespace fs = std::filesystem;
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace
{
constexpr int Bones = 2;

/// The bar at rest at time 0, 0.25 .. 1, bent by shear, and with what can go wrong at one time.
class MovingBar : public TimedTestSource
{
public:
  static MovingBar* New();
  vtkTypeMacro(MovingBar, TimedTestSource);

  enum Spoils
  {
    Nothing,
    Coordinate,
    Points,
    Cells,
    Connectivity,
    Kind,
    Empty,
    Fail
  };

  vtkSmartPointer<vtkUnstructuredGrid> Rest = ChainVolume(Bones);
  Spoils Spoil = Nothing;
  double SpoiledTime = 0.5;
  bool Turned = false;
  bool SameCells = true; ///< shared between phases, or copies

protected:
  MovingBar() { this->Steps = { 0.0, 0.25, 0.5, 0.75, 1.0 }; }

  vtkSmartPointer<vtkDataObject> NewOutput() override
  {
    return vtkSmartPointer<vtkUnstructuredGrid>::New();
  }

  bool Make(double time, vtkDataObject* data) override
  {
    if (!this->Steps.empty()) // a reader gives the step before
    {
      const auto after = std::upper_bound(this->Steps.begin(), this->Steps.end(), time);
      time = after == this->Steps.begin() ? this->Steps.front() : *(after - 1);
    }
    auto* output = vtkUnstructuredGrid::SafeDownCast(data);
    const bool spoiled = this->Spoil != Nothing && time == this->SpoiledTime;
    if (spoiled && this->Spoil == Fail)
    {
      vtkErrorMacro("no such data");
      return false;
    }
    output->ShallowCopy(this->Rest);
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    points->DeepCopy(this->Rest->GetPoints());
    for (vtkIdType n = 0; n < points->GetNumberOfPoints(); ++n)
    {
      double x[3];
      points->GetPoint(n, x);
      x[0] += 0.1 * time * x[2] * x[2];
      points->SetPoint(n, x);
    }
    output->SetPoints(points);
    const bool other =
      spoiled && (this->Spoil == Cells || this->Spoil == Connectivity || this->Spoil == Kind);
    if (this->Turned || other || !this->SameCells)
    {
      vtkNew<vtkUnstructuredGrid> cells;
      cells->SetPoints(points);
      for (const auto& t : TetrahedraOf(this->Rest))
      {
        vtkIdType ids[4] = { t[0], t[1], t[2], t[3] };
        const vtkIdType n = cells->GetNumberOfCells();
        if (this->Turned || (other && this->Spoil == Connectivity && n == 17))
        {
          std::swap(ids[1], ids[2]);
        }
        const bool triangle = other && this->Spoil == Kind && n == 3;
        cells->InsertNextCell(triangle ? VTK_TRIANGLE : VTK_TETRA, triangle ? 3 : 4, ids);
      }
      if (other && this->Spoil == Cells)
      {
        const vtkIdType ids[4] = { 0, 1, 2, 3 };
        cells->InsertNextCell(VTK_TETRA, 4, ids);
      }
      output->CopyStructure(cells);
    }
    if (spoiled && this->Spoil == Coordinate)
    {
      points->SetPoint(5, 0.0, std::numeric_limits<double>::quiet_NaN(), 0.0);
    }
    if (spoiled && this->Spoil == Points)
    {
      points->InsertNextPoint(0.0, 0.0, 0.0);
    }
    if (spoiled && this->Spoil == Empty)
    {
      output->Initialize();
    }
    output->GetInformation()->Set(vtkDataObject::DATA_TIME_STEP(), time);
    return true;
  }
};
vtkStandardNewMacro(MovingBar);

class TestMeshSequenceWriter : public ::testing::Test
{
protected:
  void SetUp() override
  {
    this->Folder = fs::temp_directory_path() / ("mesh-sequence." + std::to_string(getpid()));
    fs::create_directories(this->Folder);
    this->Writer->SetFileName((this->Folder / "bar.json").c_str());
    this->Boundary = ChainBoundary(this->Bar->Rest, Bones);
  }

  void TearDown() override { fs::remove_all(this->Folder); }

  /// The bar, its boundary and its caps.
  void Connect()
  {
    this->Writer->SetInputConnection(this->Bar->GetOutputPort());
    this->Writer->SetInputData(1, this->Boundary);
    this->Writer->SetInputData(2, this->Caps);
  }

  void Write()
  {
    Messages messages(this->Writer);
    EXPECT_EQ(this->Writer->Write(), 1);
    EXPECT_TRUE(messages.Errors.empty()) << messages.Errors.front();
    EXPECT_TRUE(messages.Warnings.empty()) << messages.Warnings.front();
  }

  /// The next Write() is one error, and there is nothing in the folder.
  void ExpectRefusal(const std::string& part)
  {
    Messages messages(this->Writer);
    EXPECT_EQ(this->Writer->Write(), 0);
    ASSERT_EQ(messages.Errors.size(), 1U) << part;
    EXPECT_NE(messages.Errors[0].find(part), std::string::npos) << messages.Errors[0];
    EXPECT_TRUE(fs::is_empty(this->Folder)) << part;
    EXPECT_EQ(this->Writer->GetQuality()->GetNumberOfRows(), 0);
  }

  vtkSmartPointer<vtkUnstructuredGrid> ReadGrid(const std::string& path) const
  {
    vtkNew<vtkXMLUnstructuredGridReader> reader;
    reader->SetFileName((this->Folder / path).c_str());
    reader->Update();
    return reader->GetOutput();
  }

  vtkSmartPointer<vtkPolyData> ReadSurface(const std::string& path) const
  {
    vtkNew<vtkXMLPolyDataReader> reader;
    reader->SetFileName((this->Folder / path).c_str());
    reader->Update();
    return reader->GetOutput();
  }

  nlohmann::json Report() const
  {
    std::ifstream file(this->Folder / "bar.json");
    return nlohmann::json::parse(file);
  }

  static std::vector<std::int64_t> Connectivity(vtkCellArray* cells)
  {
    std::vector<std::int64_t> ids;
    for (vtkIdType n = 0; n < cells->GetNumberOfCells(); ++n)
    {
      vtkIdType count = 0;
      const vtkIdType* corners = nullptr;
      cells->GetCellAtId(n, count, corners);
      ids.push_back(-count);
      ids.insert(ids.end(), corners, corners + count);
    }
    return ids;
  }

  static std::vector<double> Values(vtkFieldData* data, const char* name)
  {
    vtkDataArray* array = data->GetArray(name);
    if (!array)
    {
      ADD_FAILURE() << "no array " << name;
      return {};
    }
    std::vector<double> values;
    for (vtkIdType n = 0; n < array->GetNumberOfTuples(); ++n)
    {
      values.push_back(array->GetComponent(n, 0));
    }
    return values;
  }

  static coronary::TetrahedraQuality Measure(vtkUnstructuredGrid* grid)
  {
    return coronary::MeasureTetrahedra(PointsOf(grid), TetrahedraOf(grid));
  }

  static std::vector<coronary::Vector3> PointsOf(vtkPointSet* data)
  {
    std::vector<coronary::Vector3> points(static_cast<std::size_t>(data->GetNumberOfPoints()));
    for (std::size_t n = 0; n < points.size(); ++n)
    {
      data->GetPoint(static_cast<vtkIdType>(n), points[n].data());
    }
    return points;
  }

  static std::vector<vtkDataObject*> Leaves(vtkDataObject* tree)
  {
    std::vector<vtkDataObject*> leaves;
    vtkSmartPointer<vtkCompositeDataIterator> each;
    each.TakeReference(vtkCompositeDataSet::SafeDownCast(tree)->NewIterator());
    for (each->InitTraversal(); !each->IsDoneWithTraversal(); each->GoToNextItem())
    {
      leaves.push_back(each->GetCurrentDataObject());
    }
    return leaves;
  }

  static double Enclosed(vtkPolyData* surface)
  {
    std::vector<coronary::Triangle> triangles;
    for (vtkIdType n = 0; n < surface->GetNumberOfPolys(); ++n)
    {
      vtkIdType count = 0;
      const vtkIdType* ids = nullptr;
      surface->GetPolys()->GetCellAtId(n, count, ids);
      triangles.push_back({ ids[0], ids[1], ids[2] });
    }
    return coronary::MeasureTriangles(PointsOf(surface), triangles).enclosedVolume;
  }

  fs::path Folder;
  vtkNew<vtkMeshSequenceWriter> Writer;
  vtkNew<MovingBar> Bar;
  vtkSmartPointer<vtkPolyData> Boundary;
  vtkSmartPointer<vtkPolyData> Caps = ChainCaps();
};
}

TEST_F(TestMeshSequenceWriter, AllPhasesHaveOneTopologyAndTheIdsOfTheBoundary)
{
  this->Connect();
  this->Bar->SameCells = false; // equal, not shared
  this->Write();
  const auto volumes = coronary::ReadFileSeries((this->Folder / "bar_volume.pvd").string());
  const auto surfaces =
    coronary::ReadFileSeries((this->Folder / "bar_surface.vtp.series").string());
  ASSERT_EQ(volumes.size(), 5U);
  ASSERT_EQ(surfaces.size(), 5U);
  std::vector<std::int64_t> cells;
  std::vector<std::int64_t> triangles;
  std::vector<double> entity;
  for (std::size_t k = 0; k < 5; ++k)
  {
    EXPECT_EQ(volumes[k].time, this->Bar->Steps[k]);
    const auto volume = this->ReadGrid(fs::path(volumes[k].path).filename());
    const auto surface = this->ReadSurface(fs::path(surfaces[k].path).filename());
    ASSERT_EQ(volume->GetNumberOfPoints(), this->Bar->Rest->GetNumberOfPoints());
    if (k == 0)
    {
      cells = Connectivity(volume->GetCells());
      triangles = Connectivity(surface->GetPolys());
      entity = Values(surface->GetCellData(), "CellEntityIds");
      EXPECT_EQ(cells, Connectivity(this->Bar->Rest->GetCells()));
      // In the order of the boundary that was given, with its data.
      EXPECT_EQ(entity, Values(this->Boundary->GetCellData(), "CellEntityIds"));
      EXPECT_EQ((std::set<double>(entity.begin(), entity.end())), (std::set<double>{ 1, 2, 3 }));
    }
    EXPECT_EQ(Connectivity(volume->GetCells()), cells);
    EXPECT_EQ(Connectivity(surface->GetPolys()), triangles);
    EXPECT_EQ(Values(surface->GetCellData(), "CellEntityIds"), entity);
    EXPECT_EQ(Values(surface->GetCellData(), "GroupIds"),
      Values(this->Boundary->GetCellData(), "GroupIds"));
    for (vtkIdType n = 0; n < volume->GetNumberOfPoints(); ++n)
    {
      double rest[3];
      double moved[3];
      this->Bar->Rest->GetPoint(n, rest);
      volume->GetPoint(n, moved);
      ASSERT_DOUBLE_EQ(moved[0], rest[0] + 0.1 * this->Bar->Steps[k] * rest[2] * rest[2]);
    }
    // The surface's points are the volume's.
    const std::vector<double> ids = Values(surface->GetPointData(), "MeshPointId");
    ASSERT_EQ(static_cast<vtkIdType>(ids.size()), surface->GetNumberOfPoints());
    EXPECT_LT(surface->GetNumberOfPoints(), volume->GetNumberOfPoints());
    for (std::size_t n = 0; n < ids.size(); ++n)
    {
      double a[3];
      double b[3];
      surface->GetPoint(static_cast<vtkIdType>(n), a);
      volume->GetPoint(static_cast<vtkIdType>(ids[n]), b);
      ASSERT_TRUE(std::equal(a, a + 3, b));
    }
    EXPECT_EQ(volume->GetPointData()->GetArray("BoneIndices"), nullptr);
    EXPECT_EQ(Values(volume->GetFieldData(), "PhaseTime").at(0), this->Bar->Steps[k]);
    // Of this phase, not of the mesh at rest.
    const auto quality = Measure(volume);
    EXPECT_EQ(Values(volume->GetCellData(), "TetrahedronVolume"), quality.volume);
    EXPECT_EQ(Values(volume->GetCellData(), "MinimumDihedralAngle"), quality.minimumDihedral);
    EXPECT_EQ(Values(volume->GetFieldData(), "MeshMinimumDihedralAngle").at(0),
      quality.minimumDihedralAngle);
    EXPECT_TRUE(Values(volume->GetFieldData(), "InvertedTetrahedra").empty());
    EXPECT_NEAR(Enclosed(surface), quality.totalVolume, 1e-9 * quality.totalVolume);
    vtkTable* table = this->Writer->GetQuality();
    ASSERT_EQ(table->GetNumberOfRows(), 5);
    EXPECT_EQ(table->GetValueByName(static_cast<vtkIdType>(k), "TotalVolume").ToDouble(),
      quality.totalVolume);
  }
  // Shear keeps the volume of a bar: 3 x 3 x 10 mm.
  EXPECT_NEAR(this->Writer->GetQuality()->GetValueByName(4, "TotalVolume").ToDouble(), 90.0, 0.05);
  EXPECT_LT(this->Writer->GetQuality()->GetValueByName(4, "MeshMinimumDihedralAngle").ToDouble(),
    this->Writer->GetQuality()->GetValueByName(0, "MeshMinimumDihedralAngle").ToDouble());
  EXPECT_FALSE(fs::exists(this->Folder / "bar_simvascular"));
  EXPECT_FALSE(fs::exists(this->Folder / "bar_vmtk.pvd"));
  EXPECT_EQ(this->Report()["phases"].size(), 5U);
}

TEST_F(TestMeshSequenceWriter, SimVascularFoldersFitTogether)
{
  this->Connect();
  this->Writer->WriteSeriesOff();
  this->Writer->WriteSimVascularOn();
  this->Writer->SetSimVascularUnit(10.0);
  this->Write();
  EXPECT_EQ(std::distance(fs::directory_iterator(this->Folder), fs::directory_iterator()), 3);
  std::vector<double> firstElements;
  for (int k = 0; k < 5; ++k)
  {
    const std::string folder = "bar_simvascular/phase_00" + std::to_string(k) + "/mesh-complete/";
    const auto mesh = this->ReadGrid(folder + "mesh-complete.mesh.vtu");
    const vtkIdType points = mesh->GetNumberOfPoints();
    ASSERT_EQ(points, this->Bar->Rest->GetNumberOfPoints());
    // The solver takes 32-bit integers only.
    for (vtkDataArray* ids : { mesh->GetPointData()->GetArray("GlobalNodeID"),
           mesh->GetCellData()->GetArray("GlobalElementID"),
           mesh->GetCellData()->GetArray("ModelRegionID") })
    {
      ASSERT_TRUE(vtkIntArray::SafeDownCast(ids));
    }
    EXPECT_EQ(Values(mesh->GetPointData(), "GlobalNodeID").front(), 1.0);
    EXPECT_EQ(Values(mesh->GetPointData(), "GlobalNodeID").back(), static_cast<double>(points));
    EXPECT_EQ(Values(mesh->GetCellData(), "GlobalElementID").back(),
      static_cast<double>(mesh->GetNumberOfCells()));
    const auto tetrahedra = TetrahedraOf(mesh);
    std::multiset<double> together;
    const std::map<std::string, int> faces = { { "wall", 1 }, { "inlet_pRCA", 2 },
      { "outlet_R-PDA_1", 3 } };
    for (const std::string name : { "mesh-complete.exterior", "walls_combined",
           "mesh-surfaces/wall", "mesh-surfaces/inlet_pRCA", "mesh-surfaces/outlet_R-PDA_1" })
    {
      const auto face = this->ReadSurface(folder + name + ".vtp");
      ASSERT_GT(face->GetNumberOfPolys(), 0) << name;
      ASSERT_TRUE(vtkIntArray::SafeDownCast(face->GetPointData()->GetArray("GlobalNodeID")));
      ASSERT_TRUE(vtkIntArray::SafeDownCast(face->GetCellData()->GetArray("GlobalElementID")));
      const std::vector<double> nodes = Values(face->GetPointData(), "GlobalNodeID");
      const std::vector<double> elements = Values(face->GetCellData(), "GlobalElementID");
      const std::vector<double> ids = Values(face->GetCellData(), "ModelFaceID");
      for (vtkIdType n = 0; n < face->GetNumberOfPoints(); ++n)
      {
        double a[3];
        double b[3];
        face->GetPoint(n, a);
        mesh->GetPoint(static_cast<vtkIdType>(nodes[n]) - 1, b);
        ASSERT_TRUE(std::equal(a, a + 3, b)) << name;
      }
      for (vtkIdType n = 0; n < face->GetNumberOfPolys(); ++n)
      {
        vtkIdType count = 0;
        const vtkIdType* corners = nullptr;
        face->GetPolys()->GetCellAtId(n, count, corners);
        const auto& t = tetrahedra[static_cast<std::size_t>(elements[n]) - 1];
        for (vtkIdType c = 0; c < count; ++c)
        {
          const auto node = static_cast<std::int64_t>(nodes[corners[c]]) - 1;
          ASSERT_NE(std::find(t.begin(), t.end(), node), t.end()) << name;
        }
      }
      if (name == "mesh-complete.exterior")
      {
        EXPECT_NEAR(Enclosed(face), Measure(mesh).totalVolume, 1e-9);
        together.insert(elements.begin(), elements.end());
        if (k == 0)
        {
          firstElements = elements;
        }
        EXPECT_EQ(elements, firstElements);
      }
      else if (name != "walls_combined")
      {
        const int id = faces.at(name.substr(name.find('/') + 1));
        EXPECT_EQ(std::count(ids.begin(), ids.end(), id), static_cast<std::ptrdiff_t>(ids.size()));
        for (const double element : elements)
        {
          const auto found = together.find(element);
          ASSERT_NE(found, together.end());
          together.erase(found);
        }
      }
    }
    EXPECT_TRUE(together.empty()) << "faces do not make up the exterior";
    // Centimetres.
    EXPECT_NEAR(Measure(mesh).totalVolume, 0.09, 1e-4);
  }
}

TEST_F(TestMeshSequenceWriter, VmtkMeshesHaveTetrahedraThenTriangles)
{
  this->Connect();
  this->Writer->WriteSeriesOff();
  this->Writer->WriteVmtkOn();
  this->Write();
  const auto files = coronary::ReadFileSeries((this->Folder / "bar_vmtk.vtu.series").string());
  ASSERT_EQ(files.size(), 5U);
  std::vector<double> first;
  for (const auto& file : files)
  {
    const auto mesh = this->ReadGrid(fs::path(file.path).filename());
    const vtkIdType tetrahedra = this->Bar->Rest->GetNumberOfCells();
    ASSERT_EQ(mesh->GetNumberOfCells(), tetrahedra + this->Boundary->GetNumberOfPolys());
    const std::vector<double> ids = Values(mesh->GetCellData(), "CellEntityIds");
    for (vtkIdType n = 0; n < mesh->GetNumberOfCells(); ++n)
    {
      ASSERT_EQ(mesh->GetCellType(n), n < tetrahedra ? VTK_TETRA : VTK_TRIANGLE);
      ASSERT_EQ(ids[n] == 0.0, n < tetrahedra);
    }
    EXPECT_EQ(std::vector<double>(ids.begin() + tetrahedra, ids.end()),
      Values(this->Boundary->GetCellData(), "CellEntityIds"));
    first = first.empty() ? ids : first;
    EXPECT_EQ(ids, first);
  }
}

TEST_F(TestMeshSequenceWriter, FacesHaveTheNamesThatAreGiven)
{
  this->Connect();
  this->Writer->SetFaceName(1, "lumen");
  this->Writer->SetFaceName(3, "out-1");
  this->Write();
  auto faces = this->Report()["faces"];
  ASSERT_EQ(faces.size(), 3U);
  EXPECT_EQ(faces[0]["name"], "lumen");
  EXPECT_EQ(faces[1]["name"], "inlet_pRCA");
  EXPECT_EQ(faces[2]["name"], "out-1");
  EXPECT_EQ(faces[2]["triangles"], 72);

  this->Writer->RemoveAllFaceNames();
  vtkStringArray::SafeDownCast(this->Caps->GetPointData()->GetAbstractArray("SegmentLabel"))
    ->SetValue(0, "R-PDA/1");
  vtkIntArray::SafeDownCast(this->Caps->GetPointData()->GetArray("IsInlet"))->SetValue(0, 0);
  this->Caps->Modified();
  this->Write();
  faces = this->Report()["faces"];
  EXPECT_EQ(faces[1]["name"], "outlet_R-PDA_1_2"); // no two files of one name
  EXPECT_EQ(faces[2]["name"], "outlet_R-PDA_1_3");

  this->Writer->SetInputConnection(2, nullptr);
  this->Write();
  EXPECT_EQ(this->Report()["faces"][2]["name"], "cap_3");
  this->Writer->SetInputConnection(1, nullptr);
  this->Write();
  ASSERT_EQ(this->Report()["faces"].size(), 1U);
  EXPECT_EQ(this->Report()["faces"][0]["name"], "wall");
}

TEST_F(TestMeshSequenceWriter, ItsOwnSurfaceIsABoundary)
{
  this->Connect();
  this->Write();
  const auto surface = this->ReadSurface("bar_surface_003.vtp");
  const auto faces = this->Report()["faces"];
  this->Writer->SetInputData(1, surface);
  this->Write();
  EXPECT_EQ(this->Report()["faces"], faces);
  EXPECT_EQ(Values(this->ReadSurface("bar_surface_000.vtp")->GetCellData(), "CellEntityIds"),
    Values(this->Boundary->GetCellData(), "CellEntityIds"));
}

TEST_F(TestMeshSequenceWriter, AFoldIsReportedWhereItIs)
{
  vtkNew<vtkSkinDeformation> deformation;
  deformation->SetInputData(0, this->Bar->Rest);
  deformation->SetInputData(1, ChainSkeleton(Bones));
  vtkNew<BendingChain> chain;
  chain->Bones = Bones;
  deformation->SetPoseConnection(chain->GetOutputPort());
  deformation->DoublePrecisionOn();
  deformation->SetTetrahedra(vtkSkinDeformation::CheckTetrahedra);
  auto folded = ChainSkeleton(Bones);
  folded->GetPoints()->SetPoint(2, 1.0, 0.0, 0.3); // the second bone lies back on the first
  this->Writer->SetInputConnection(deformation->GetOutputPort());
  this->Write(); // the arc does not fold
  EXPECT_EQ(this->Writer->GetQuality()->GetNumberOfRows(), 11);

  deformation->SetInputData(2, folded);
  Messages messages(this->Writer);
  EXPECT_EQ(this->Writer->Write(), 1);
  EXPECT_TRUE(messages.Errors.empty());
  ASSERT_EQ(messages.Warnings.size(), 1U);
  EXPECT_NE(messages.Warnings[0].find("1 of 1 phases have inverted tetrahedra"), std::string::npos);
  const auto volume = this->ReadGrid("bar_volume_000.vtu");
  const auto quality = Measure(volume);
  ASSERT_GT(quality.inverted.size(), 10U);
  EXPECT_EQ(this->Report()["phases"][0]["inverted_ids"], quality.inverted);
  EXPECT_EQ(this->Report()["phases"][0]["quality"]["poor_tetrahedra"], quality.poor);
  EXPECT_EQ(Values(volume->GetFieldData(), "InvertedTetrahedra"),
    std::vector<double>(quality.inverted.begin(), quality.inverted.end()));
  EXPECT_EQ(this->Writer->GetQuality()->GetValueByName(0, "InvertedTetrahedra").ToDouble(),
    static_cast<double>(quality.inverted.size()));
  EXPECT_LT(this->Writer->GetQuality()->GetValueByName(0, "MeshMinimumVolume").ToDouble(), 0.0);
  std::ifstream csv(this->Folder / "bar_quality.csv");
  std::string line;
  ASSERT_TRUE(std::getline(csv, line) && std::getline(csv, line));
  EXPECT_EQ(line.rfind("0,0.0," + std::to_string(quality.inverted.size()) + ",", 0), 0U) << line;
}

TEST_F(TestMeshSequenceWriter, OtherOrderOfCornersIsTurnedOver)
{
  this->Connect();
  this->Write();
  const double volume = this->Writer->GetQuality()->GetValueByName(2, "TotalVolume").ToDouble();
  this->Bar->Turned = true;
  this->Bar->Modified();
  this->Writer->WriteVmtkOn();
  this->Write();
  EXPECT_EQ(this->Writer->GetQuality()->GetValueByName(2, "InvertedTetrahedra").ToDouble(), 0.0);
  EXPECT_NEAR(
    this->Writer->GetQuality()->GetValueByName(2, "TotalVolume").ToDouble(), volume, 1e-9);
  EXPECT_TRUE(Measure(this->ReadGrid("bar_volume_002.vtu")).inverted.empty());
  EXPECT_GT(Enclosed(this->ReadSurface("bar_surface_002.vtp")), 0.0);
}

TEST_F(TestMeshSequenceWriter, PhasesAreChosen)
{
  vtkNew<BendingChain> chain;
  chain->Bones = Bones;
  vtkNew<vtkCardiacPhaseInterpolator> interpolator;
  interpolator->SetInputConnection(chain->GetOutputPort());
  vtkNew<vtkSkinDeformation> deformation;
  deformation->SetInputData(0, this->Bar->Rest);
  deformation->SetInputData(1, ChainSkeleton(Bones));
  deformation->SetPoseConnection(interpolator->GetOutputPort());
  this->Writer->SetInputConnection(deformation->GetOutputPort());
  this->Writer->SetPhases(vtkMeshSequenceWriter::EvenPhases);
  this->Writer->SetNumberOfPhases(8);
  this->Writer->SetStartTime(-0.05);
  this->Write();
  auto files = coronary::ReadFileSeries((this->Folder / "bar_volume.pvd").string());
  ASSERT_EQ(files.size(), 8U);
  EXPECT_EQ(files[0].time, -0.05);
  EXPECT_DOUBLE_EQ(files[7].time, -0.05 + 7.0 / 8.0);
  this->Writer->SetPhases(vtkMeshSequenceWriter::ListedTimes);
  this->Writer->AddTime(0.33);
  this->Writer->AddTime(1.33); // the same moment of the next cycle
  this->Write();
  const auto a = this->ReadGrid("bar_volume_000.vtu");
  const auto b = this->ReadGrid("bar_volume_001.vtu");
  for (vtkIdType n = 0; n < a->GetNumberOfPoints(); ++n)
  {
    for (int c = 0; c < 3; ++c)
    {
      ASSERT_NEAR(a->GetPoint(n)[c], b->GetPoint(n)[c], 1e-5);
    }
  }
  EXPECT_EQ(chain->Executions, 11) << "poses are read once";
}

TEST_F(TestMeshSequenceWriter, ASurfaceAlone)
{
  vtkNew<BendingChain> chain;
  chain->Bones = Bones;
  vtkNew<vtkSkinDeformation> deformation;
  deformation->SetInputData(0, ChainTube(Bones, 1.0));
  deformation->SetInputData(1, ChainSkeleton(Bones));
  deformation->SetPoseConnection(chain->GetOutputPort());
  this->Writer->SetInputConnection(deformation->GetOutputPort());
  this->Write();
  EXPECT_FALSE(fs::exists(this->Folder / "bar_volume.pvd"));
  const auto files = coronary::ReadFileSeries((this->Folder / "bar_surface.pvd").string());
  ASSERT_EQ(files.size(), 11U);
  const auto first = this->ReadSurface("bar_surface_000.vtp");
  const auto last = this->ReadSurface("bar_surface_010.vtp");
  EXPECT_EQ(Connectivity(first->GetPolys()), Connectivity(last->GetPolys()));
  EXPECT_EQ(Values(first->GetCellData(), "CellEntityIds"),
    std::vector<double>(static_cast<std::size_t>(first->GetNumberOfPolys()), 1.0));
  // 32 flat sides of a tube.
  EXPECT_NEAR(this->Writer->GetQuality()->GetValueByName(0, "SurfaceArea").ToDouble(),
    16.0 * 2.0 * std::sin(3.14159265358979 / 16.0) * 10.0, 1e-3);
  this->Writer->WriteSimVascularOn();
  fs::remove_all(this->Folder);
  fs::create_directories(this->Folder);
  this->ExpectRefusal("need tetrahedra");
  this->Writer->WriteSimVascularOff();
  this->Writer->SetInputData(1, this->Boundary);
  this->ExpectRefusal("is for tetrahedra");
}

TEST_F(TestMeshSequenceWriter, SurfacesForOtherPrograms)
{
  this->Connect();
  this->Writer->WriteObjOn();
  this->Writer->WritePlyOn();
  this->Writer->WriteStlOn();
  this->Write();
  const auto files = this->Report()["files"];
  EXPECT_EQ(files["obj"], "bar_surface.obj.series");
  const auto list = coronary::ReadFileSeries((this->Folder / "bar_surface.ply.series").string());
  ASSERT_EQ(list.size(), 5U);
  std::vector<std::int64_t> ofObj;
  for (std::size_t k = 0; k < 5; ++k)
  {
    const auto phase = this->Report()["phases"][k]["files"];
    const auto truth = this->ReadSurface(phase["surface"].get<std::string>());
    const auto pathOf = [&](const char* kind)
    { return (this->Folder / phase[kind].get<std::string>()).string(); };
    const auto read = [&](auto reader, const char* kind)
    {
      reader->SetFileName(pathOf(kind).c_str());
      reader->Update();
      return vtkSmartPointer<vtkPolyData>(reader->GetOutput());
    };
    const auto obj = read(vtkSmartPointer<vtkOBJReader>::New(), "obj");
    const auto ply = read(vtkSmartPointer<vtkPLYReader>::New(), "ply");
    const auto stl = read(vtkSmartPointer<vtkSTLReader>::New(), "stl");
    // The same points in the same order; .stl knows corners only, which the reader merges.
    for (const auto& surface : { obj, ply })
    {
      ASSERT_EQ(surface->GetNumberOfPoints(), truth->GetNumberOfPoints());
      for (vtkIdType n = 0; n < truth->GetNumberOfPoints(); ++n)
      {
        for (int c = 0; c < 3; ++c)
        {
          ASSERT_FLOAT_EQ(
            static_cast<float>(surface->GetPoint(n)[c]), static_cast<float>(truth->GetPoint(n)[c]));
        }
      }
    }
    EXPECT_EQ(Connectivity(ply->GetPolys()), Connectivity(truth->GetPolys()));
    EXPECT_EQ(stl->GetNumberOfPoints(), truth->GetNumberOfPoints());
    ASSERT_EQ(stl->GetNumberOfPolys(), truth->GetNumberOfPolys());
    EXPECT_NEAR(Enclosed(stl), Enclosed(truth), 1e-5 * Enclosed(truth)) << "looks outwards";
    EXPECT_NEAR(Enclosed(obj), Enclosed(truth), 1e-5 * Enclosed(truth));
    if (k == 0)
    {
      ofObj = Connectivity(obj->GetPolys());
    }
    EXPECT_EQ(Connectivity(obj->GetPolys()), ofObj) << "another topology";
    // One group a face, as large as the report says.
    std::ifstream text(pathOf("obj"));
    std::map<std::string, std::int64_t> groups;
    std::string group;
    for (std::string line; std::getline(text, line);)
    {
      if (line.rfind("g ", 0) == 0)
      {
        group = line.substr(2);
        EXPECT_EQ(groups.count(group), 0U) << "two groups " << group;
      }
      groups[group] += line.rfind("f ", 0) == 0 ? 1 : 0;
    }
    const nlohmann::json report = this->Report();
    for (const auto& face : report["faces"])
    {
      EXPECT_EQ(groups[face["name"].get<std::string>()], face["triangles"].get<std::int64_t>());
    }
  }
  // A shorter sequence takes all of it away.
  this->Bar->Steps = { 0.0 };
  this->Bar->Modified();
  this->Writer->WriteStlOff();
  this->Write();
  EXPECT_TRUE(fs::exists(this->Folder / "bar_surface_000.obj"));
  EXPECT_FALSE(fs::exists(this->Folder / "bar_surface_001.obj"));
  EXPECT_FALSE(fs::exists(this->Folder / "bar_surface_000.stl"));
  EXPECT_FALSE(fs::exists(this->Folder / "bar_surface.stl.series"));
}

TEST_F(TestMeshSequenceWriter, GltfShowsTheMovedSurface)
{
  vtkNew<BendingChain> chain;
  chain->Bones = Bones;
  vtkNew<vtkSkinDeformation> deformation;
  deformation->SetInputData(0, this->Bar->Rest);
  deformation->SetInputData(1, ChainSkeleton(Bones));
  deformation->SetPoseConnection(chain->GetOutputPort());
  deformation->DoublePrecisionOn();
  deformation->SetVolumeConservation(1.0);
  this->Writer->SetInputConnection(deformation->GetOutputPort());
  this->Writer->SetInputData(1, this->Boundary);
  this->Writer->SetInputData(2, this->Caps);
  this->Writer->WriteGltfOn();
  this->Write();
  EXPECT_EQ(this->Report()["files"]["gltf"], "bar_skin.glb");
  EXPECT_EQ(
    this->ReadSurface("bar_surface_000.vtp")->GetFieldData()->GetArray("BoneMotion"), nullptr)
    << "what is for glTF goes into no other file";
  std::ifstream stream(this->Folder / "bar_skin.glb", std::ios::binary);
  const GltfEvaluator file(std::string(std::istreambuf_iterator<char>(stream), {}));
  ASSERT_EQ(file.Times().size(), 11U);
  double maximumMove = 0.0;
  for (int k = 0; k < 11; ++k)
  {
    const auto surface =
      this->ReadSurface(this->Report()["phases"][static_cast<std::size_t>(k)]["files"]["surface"]);
    const std::vector<double> entity = Values(surface->GetCellData(), "CellEntityIds");
    for (int face = 1; face <= 3; ++face)
    {
      std::set<vtkIdType> used;
      for (vtkIdType n = 0; n < surface->GetNumberOfPolys(); ++n)
      {
        vtkIdType count = 0;
        const vtkIdType* ids = nullptr;
        surface->GetPolys()->GetCellAtId(n, count, ids);
        if (entity[static_cast<std::size_t>(n)] == face)
        {
          used.insert(ids, ids + count);
        }
      }
      const char* mesh = face == 1 ? "wall" : "caps";
      const std::size_t primitive = face == 3 ? 1 : 0;
      const auto vertices = file.Vertices(mesh, k, primitive);
      const auto rest = file.Vertices(mesh, -1, primitive);
      ASSERT_EQ(vertices.size(), used.size());
      std::size_t n = 0;
      for (const vtkIdType point : used)
      {
        const coronary::Vector3 truth(surface->GetPoint(point));
        ASSERT_LT((vertices[n] - truth).norm(), 1e-4) << "key " << k;
        maximumMove = std::max(maximumMove, (rest[n] - truth).norm());
        ++n;
      }
    }
  }
  EXPECT_GT(maximumMove, 2.0);

  // VTK's own reader. A new one each time: asked for a second time, it leaves the last primitive where it was.
  for (const int key : { 3, 8 })
  {
    vtkNew<vtkGLTFReader> reader;
    reader->SetFileName((this->Folder / "bar_skin.glb").c_str());
    reader->UpdateInformation();
    ASSERT_EQ(reader->GetNumberOfAnimations(), 1);
    reader->EnableAnimation(0);
    reader->SetApplyDeformationsToGeometry(true);
    reader->UpdateInformation();
    reader->UpdateTimeStep(file.Times()[static_cast<std::size_t>(key)]);
    Eigen::AlignedBox3d bounds;
    for (vtkDataObject* block : Leaves(reader->GetOutputDataObject(0)))
    {
      for (const coronary::Vector3& point : PointsOf(vtkPointSet::SafeDownCast(block)))
      {
        bounds.extend(point);
      }
    }
    double truth[6];
    this->ReadSurface(this->Report()["phases"][static_cast<std::size_t>(key)]["files"]["surface"])
      ->GetBounds(truth);
    EXPECT_NEAR(bounds.max()[0], truth[1] / 1000.0, 1e-5) << "left";
    EXPECT_NEAR(bounds.max()[1], truth[5] / 1000.0, 1e-5) << "superior is up";
    EXPECT_NEAR(bounds.max()[2], -truth[2] / 1000.0, 1e-5) << "anterior is towards the viewer";
  }
}

TEST_F(TestMeshSequenceWriter, GltfNeedsBones)
{
  this->Connect();
  this->Writer->WriteGltfOn();
  this->ExpectRefusal("Displacement");
  this->Writer->SetGltfInfluences(7);
  this->ExpectRefusal("GltfInfluences");
}

TEST_F(TestMeshSequenceWriter, WithoutTimeThereIsOnePhase)
{
  this->Writer->SetInputData(0, this->Bar->Rest);
  this->Write();
  EXPECT_EQ(this->Report()["phases"].size(), 1U);
  fs::remove_all(this->Folder);
  fs::create_directories(this->Folder);
  this->Writer->SetPhases(vtkMeshSequenceWriter::EvenPhases);
  this->ExpectRefusal("has no time");
}

TEST_F(TestMeshSequenceWriter, RefusesAMeshThatChanges)
{
  this->Connect();
  this->Bar->SameCells = false;
  const std::map<MovingBar::Spoils, std::string> spoils = { { MovingBar::Coordinate,
                                                              "point 5 is not finite" },
    { MovingBar::Points, "points instead of" }, { MovingBar::Cells, "cells instead of" },
    { MovingBar::Connectivity, "cell 17 of the mesh has other points" },
    { MovingBar::Kind, "Cell 3 of the mesh is not a tetrahedron" },
    { MovingBar::Empty, "The mesh is empty" } };
  for (const auto& [spoil, part] : spoils)
  {
    this->Bar->Spoil = spoil;
    this->Bar->Modified();
    ASSERT_NO_FATAL_FAILURE(this->ExpectRefusal(part));
    ASSERT_NO_FATAL_FAILURE(this->ExpectRefusal("phase 2 (time 0.5)")); // every time
  }
  this->Bar->Spoil = MovingBar::Fail;
  this->Bar->Modified();
  {
    Messages ofBar(this->Bar);
    ASSERT_NO_FATAL_FAILURE(this->ExpectRefusal("the input failed"));
  }
  this->Bar->Spoil = MovingBar::Nothing;
  this->Bar->Modified();
  this->Write();
}

TEST_F(TestMeshSequenceWriter, RefusesBoundariesOfOtherMeshes)
{
  this->Connect();
  const auto copy = [&]
  {
    auto boundary = vtkSmartPointer<vtkPolyData>::New();
    boundary->DeepCopy(this->Boundary);
    this->Writer->SetInputData(1, boundary);
    return boundary;
  };
  copy()->GetCellData()->RemoveArray("CellEntityIds");
  this->ExpectRefusal("no cell array CellEntityIds");
  copy()->GetCellData()->GetArray("CellEntityIds")->SetComponent(4, 0, 0.0);
  this->ExpectRefusal("that of cell 4 is not");
  copy()->GetPoints()->InsertNextPoint(0, 0, 0);
  this->ExpectRefusal("must be on the same points");
  auto boundary = copy();
  const vtkIdType inside[3] = { 0, 1, 300 };
  boundary->GetPolys()->ReplaceCellAtId(6, 3, inside);
  this->ExpectRefusal("Triangle 6 of the boundary");
  boundary = copy();
  vtkNew<vtkCellArray> fewer;
  const vtkIdType count = boundary->GetNumberOfPolys();
  for (vtkIdType n = 0; n + 1 < count; ++n)
  {
    vtkNew<vtkIdList> ids;
    boundary->GetPolys()->GetCellAtId(n, ids);
    fewer->InsertNextCell(ids);
  }
  boundary->SetPolys(fewer);
  boundary->GetCellData()->GetArray("CellEntityIds")->SetNumberOfTuples(count - 1);
  boundary->GetCellData()->GetArray("GroupIds")->SetNumberOfTuples(count - 1);
  this->ExpectRefusal("1 faces of the tetrahedra are missing");
  this->Writer->SetInputData(1, ChainSkeleton(2));
  this->ExpectRefusal("vertices, lines or strips");
  this->Writer->SetInputData(1, this->Boundary);
  this->Caps->GetPointData()->RemoveArray("CellEntityIds");
  this->Caps->Modified();
  this->ExpectRefusal("The caps have no point array CellEntityIds");
}

TEST_F(TestMeshSequenceWriter, RefusesSettingsOutOfRange)
{
  this->Connect();
  const auto refuses = [&](const std::string& part, const std::function<void()>& undo)
  {
    this->ExpectRefusal(part);
    undo();
  };
  auto* w = this->Writer.GetPointer();
  w->SetPhases(3);
  refuses("Phases must", [&] { w->SetPhases(vtkMeshSequenceWriter::EvenPhases); });
  w->SetNumberOfPhases(0);
  refuses("NumberOfPhases must", [&] { w->SetNumberOfPhases(3); });
  w->SetPeriod(0.0);
  refuses("Period must", [&] { w->SetPeriod(1.0); });
  w->SetStartTime(std::numeric_limits<double>::infinity());
  refuses("StartTime must", [&] { w->SetStartTime(0.0); });
  // The bar knows 0, 0.25, ..; it answers for a third with its mesh of 0.25.
  refuses("with its mesh of time 0.25", [&] { w->SetPhases(vtkMeshSequenceWriter::ListedTimes); });
  refuses("Times: none", [&] { w->AddTime(0.5); });
  w->AddTime(0.25);
  refuses("phase 1 (time 0.25) does not", [&] { w->RemoveAllTimes(); });
  w->SetPhases(vtkMeshSequenceWriter::InputSteps);
  w->SetSimVascularUnit(-1.0);
  refuses("SimVascularUnit must", [&] { w->SetSimVascularUnit(1.0); });
  w->SetPoorDihedralAngle(71.0);
  refuses("PoorDihedralAngle must", [&] { w->SetPoorDihedralAngle(15.0); });
  w->SetDigits(0);
  refuses("Digits must", [&] { w->SetDigits(3); });
  w->WriteSeriesOff();
  refuses("nothing to write", [&] { w->WriteSeriesOn(); });
  w->SetFaceName(1, "../wall");
  refuses("FaceName '../wall'", [&] { w->RemoveAllFaceNames(); });
  w->SetFaceName(7, "seven");
  refuses("which the mesh has not", [&] { w->RemoveAllFaceNames(); });
  w->SetFaceName(2, "end");
  w->SetFaceName(3, "end");
  refuses("given to two faces", [&] { w->RemoveAllFaceNames(); });
  w->SetFileName("");
  refuses("FileName is not set", [&] { w->SetFileName("bar.vtu"); });
  refuses("'bar.vtu' is not", [&] { w->SetFileName((this->Folder / "bar.json").c_str()); });
  this->Write();
}

TEST_F(TestMeshSequenceWriter, AShorterSequenceTakesThePlaceOfALongerOne)
{
  this->Connect();
  this->Writer->WriteSimVascularOn();
  this->Writer->WriteVmtkOn();
  this->Write();
  std::ofstream(this->Folder / "bar_mine.txt") << "mine";
  std::ofstream(this->Folder / "bar_simvascular/phase_004/mine.txt") << "mine";
  const auto files = [&]
  {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(this->Folder))
    {
      if (entry.is_regular_file())
      {
        names.insert(fs::relative(entry.path(), this->Folder).string());
      }
    }
    return names;
  };
  const std::set<std::string> longer = files();
  ASSERT_EQ(longer.count("bar_simvascular/phase_004/mesh-complete/mesh-surfaces/wall.vtp"), 1U);
  // The same, shorter: what is left is what a new folder would have, and what is not ours.
  this->Writer->WriteVmtkOff();
  this->Writer->SetPhases(vtkMeshSequenceWriter::ListedTimes);
  this->Writer->AddTime(0.0);
  this->Writer->AddTime(0.5);
  this->Write();
  const std::set<std::string> shorter = files();
  const fs::path old = this->Folder;
  this->Folder = fs::path(old.string() + ".new");
  fs::create_directories(this->Folder);
  this->Writer->SetFileName((this->Folder / "bar.json").c_str());
  this->Write();
  std::set<std::string> fresh = files();
  fs::remove_all(this->Folder);
  this->Folder = old;
  EXPECT_LT(fresh.size(), longer.size());
  fresh.insert("bar_mine.txt");
  fresh.insert("bar_simvascular/phase_004/mine.txt");
  EXPECT_EQ(shorter, fresh);
}

TEST_F(TestMeshSequenceWriter, FilesWithoutThePrefix)
{
  this->Connect();
  this->Writer->PrefixFilesOff();
  this->Writer->SetDigits(2);
  this->Write();
  std::ofstream(this->Folder / "surface_mine.txt") << "mine";
  const auto surfaces = coronary::ReadFileSeries((this->Folder / "surface.pvd").string());
  ASSERT_GT(surfaces.size(), 1U);
  EXPECT_EQ(fs::path(surfaces[1].path).filename(), "surface_01.vtp");
  EXPECT_TRUE(fs::exists(this->Folder / "volume_01.vtu"));
  EXPECT_TRUE(fs::exists(this->Folder / "quality.csv"));
  const auto listed = coronary::MeshSequenceFiles((this->Folder / "bar.json").string());
  EXPECT_EQ(std::count(listed.begin(), listed.end(), "surface_01.vtp"), 1);
  // One phase takes their place.
  this->Writer->SetPhases(vtkMeshSequenceWriter::ListedTimes);
  this->Writer->AddTime(0.0);
  this->Write();
  EXPECT_TRUE(fs::exists(this->Folder / "surface_00.vtp"));
  EXPECT_TRUE(fs::exists(this->Folder / "surface_mine.txt"));
  EXPECT_FALSE(fs::exists(this->Folder / "surface_01.vtp"));
  EXPECT_FALSE(fs::exists(this->Folder / "volume_01.vtu"));
  // And names of a report that are not such a report's are nobody's to remove.
  std::ofstream(this->Folder / "bar.json")
    << R"({"prefix": "", "files": {"surface": "surface.pvd", "mine": "mine.txt", "up": "surface_/../../a"}})";
  EXPECT_EQ(coronary::MeshSequenceFiles((this->Folder / "bar.json").string()),
    (std::vector<std::string>{ "surface.pvd", "surface.vtp.series", "bar.json" }));
}

TEST_F(TestMeshSequenceWriter, OlderFilesStayUntilAllIsWritten)
{
  this->Connect();
  this->Write();
  const auto read = [&]
  {
    std::map<std::string, std::string> texts;
    for (const auto& entry : fs::recursive_directory_iterator(this->Folder))
    {
      std::ifstream file(entry.path(), std::ios::binary);
      texts[entry.path().string()] = std::string(std::istreambuf_iterator<char>(file), {});
    }
    return texts;
  };
  const auto before = read();
  EXPECT_EQ(before.size(), 5U + 5U + 4U + 2U);
  this->Bar->Spoil = MovingBar::Coordinate;
  this->Bar->SpoiledTime = 1.0; // the last
  this->Bar->Modified();
  {
    Messages messages(this->Writer);
    EXPECT_EQ(this->Writer->Write(), 0);
    EXPECT_EQ(messages.Errors.size(), 1U);
  }
  EXPECT_EQ(read(), before);

  this->Bar->Spoil = MovingBar::Nothing;
  this->Bar->SpoiledTime = 0.0;
  this->Bar->Modified();
  vtkNew<vtkCallbackCommand> stop;
  stop->SetCallback(
    [](vtkObject* sender, unsigned long, void*, void*)
    {
      auto* writer = static_cast<vtkAlgorithm*>(sender);
      if (writer->GetProgress() > 0.5)
      {
        writer->SetAbortExecute(1);
      }
    });
  const unsigned long tag = this->Writer->AddObserver(vtkCommand::ProgressEvent, stop);
  {
    Messages messages(this->Writer);
    EXPECT_EQ(this->Writer->Write(), 0);
    EXPECT_TRUE(messages.Errors.empty());
  }
  EXPECT_EQ(read(), before);
  this->Writer->RemoveObserver(tag);
  this->Writer->SetAbortExecute(0);
  this->Write();
  EXPECT_EQ(read(), before); // the same bits again

  this->Writer->SetFileName("/proc/none/bar.json");
  Messages messages(this->Writer);
  EXPECT_EQ(this->Writer->Write(), 0);
  EXPECT_TRUE(messages.HasError("/proc/none"));
}
}
