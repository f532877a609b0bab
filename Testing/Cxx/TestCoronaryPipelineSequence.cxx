// coronary-pipeline sequence as a user runs it: poses in all forms, files that fit, messages, exit codes.
#include "AtomicFile.h"
#include "FileSeries.h"
#include "SequenceTestData.h"
#include "vtkVesselTree.h"

#include "vtkXMLPolyDataWriter.h"
#include "vtkXMLUnstructuredGridReader.h"
#include "vtkXMLUnstructuredGridWriter.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

namespace fs = std::filesystem;

namespace
{
constexpr int Bones = 2;

std::string ReadText(const fs::path& path)
{
  std::ifstream file(path, std::ios::binary);
  return { std::istreambuf_iterator<char>(file), {} };
}

void Save(vtkXMLUnstructuredDataWriter* writer, vtkDataSet* data, const fs::path& path)
{
  writer->SetInputData(data);
  writer->SetFileName(path.c_str());
  writer->SetDataModeToBinary();
  ASSERT_EQ(writer->Write(), 1);
}

class TestCoronaryPipelineSequence : public ::testing::Test
{
protected:
  /// What `run --until weights` leaves, and poses of a bar that bends to and fro.
  void SetUp() override
  {
    this->Folder = fs::temp_directory_path() / ("pipeline sequence." + std::to_string(getpid()));
    fs::create_directories(this->Folder / "result/motion");
    const auto volume = ChainVolume(Bones);
    Save(vtkNew<vtkXMLUnstructuredGridWriter>(), volume, this->Folder / "result/weights.vtu");
    Save(vtkNew<vtkXMLPolyDataWriter>(), ChainBoundary(volume, Bones),
      this->Folder / "result/volume_boundary.vtp");
    Save(vtkNew<vtkXMLPolyDataWriter>(), ChainCaps(), this->Folder / "result/caps.vtp");
    Save(
      vtkNew<vtkXMLPolyDataWriter>(), ChainSkeleton(Bones), this->Folder / "result/skeleton.vtp");
    std::vector<coronary::TimedFile> files;
    for (int k = 0; k < 5; ++k)
    {
      const double time = 0.2 * k;
      auto pose = ChainSkeleton(Bones);
      for (vtkIdType j = 0; j <= Bones; ++j)
      {
        const auto at =
          BendingChain::Bent(5.0 * static_cast<double>(j), std::sin(2.0 * 3.14159265358979 * time));
        pose->GetPoints()->SetPoint(j, at.data());
      }
      const std::string name = "skeleton_00" + std::to_string(k) + ".vtp";
      Save(vtkNew<vtkXMLPolyDataWriter>(), pose, this->Folder / "result/motion" / name);
      files.push_back({ name, time });
    }
    this->Put("result/motion/skeleton.vtp.series", coronary::FileSeriesText(files));
    this->Put("result/motion/skeleton.pvd", coronary::PvdText(files));
  }

  void TearDown() override { fs::remove_all(this->Folder); }

  void Put(const std::string& name, const std::string& text) const
  {
    coronary::WriteFileAtomically((this->Folder / name).string(), text);
  }

  /// A named vessel inside of the bar.
  void PutCenterline() const
  {
    coronary::VesselTree tree;
    coronary::VesselTree::Branch branch;
    for (int k = 0; k <= 20; ++k)
    {
      tree.points.emplace_back(0.0, 0.0, 5.0 * Bones * k / 20.0);
      tree.radius.push_back(1.2);
      branch.points.push_back(k);
    }
    branch.treeId = 1;
    branch.segmentId = 1;
    tree.branches.push_back(branch);
    coronary::MeasureTree(tree);
    vtkNew<vtkPolyData> lines;
    vtkCoronary::SetTree(lines, tree, vtkCoronary::BranchArrays::Named);
    Save(vtkNew<vtkXMLPolyDataWriter>(), lines, this->Folder / "result/centerline.vtp");
  }

  /// Runs `sequence` in the folder.
  int Run(const std::string& options) const
  {
    const std::string command = "cd '" + this->Folder.string() +
      "' && '" DYNAMICCORONARY_PIPELINE "' sequence " + options + " >stdout 2>stderr";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  /// Exit code and one line that says why; nothing is written.
  void ExpectFailure(int code, const std::string& options, const std::string& part) const
  {
    EXPECT_EQ(this->Run(options + " --quiet --output bad"), code) << options;
    const std::string text = ReadText(this->Folder / "stderr");
    EXPECT_EQ(text.rfind("coronary-pipeline sequence: ", 0), 0U) << text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << text;
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_FALSE(fs::exists(this->Folder / "bad")) << options;
  }

  nlohmann::json Report(const std::string& folder) const
  {
    return nlohmann::json::parse(ReadText(this->Folder / folder / "mesh.json"));
  }

  fs::path Folder;
};
}

TEST_F(TestCoronaryPipelineSequence, PhasesOfOneTopologyInAllFormats)
{
  ASSERT_EQ(
    this->Run("result --phases 20 --formats series,simvascular,vmtk,obj,ply,stl,gltf,gltf-json "
              "--gltf-influences 8 --simvascular-unit cm "
              "--velocity --cycle-ms 800 --threads 1 --output out"),
    0)
    << ReadText(this->Folder / "stderr");
  EXPECT_NE(ReadText(this->Folder / "stdout").find("out: 20 phases, 0 inverted tetrahedra"),
    std::string::npos)
    << ReadText(this->Folder / "stdout");
  const auto report = this->Report("out");
  ASSERT_EQ(report["phases"].size(), 20U);
  EXPECT_EQ(report["phases"][5]["time"], 0.25);
  EXPECT_EQ(report["faces"][1]["name"], "inlet_pRCA");
  for (const auto& phase : report["phases"])
  {
    EXPECT_EQ(phase["quality"]["inverted_tetrahedra"], 0);
    EXPECT_NEAR(phase["quality"]["total_volume_mm3"].get<double>(), 90.0, 5.0);
    for (const auto& file : phase["files"])
    {
      EXPECT_TRUE(fs::exists(this->Folder / "out" / file.get<std::string>()));
    }
    EXPECT_TRUE(fs::is_regular_file(this->Folder / "out" /
      phase["files"]["simvascular"].get<std::string>() / "mesh-surfaces/outlet_R-PDA_1.vtp"));
  }
  EXPECT_EQ(coronary::ReadFileSeries((this->Folder / "out/mesh_vmtk.pvd").string()).size(), 20U);
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName((this->Folder / "out/mesh_volume_005.vtu").c_str());
  reader->Update();
  EXPECT_EQ(reader->GetOutput()->GetPoints()->GetDataType(), VTK_DOUBLE);

  ASSERT_EQ(
    this->Run("result --phases 20 --formats series,simvascular,vmtk,obj,ply,stl,gltf,gltf-json "
              "--gltf-influences 8 --simvascular-unit cm "
              "--velocity --cycle-ms 800 --threads 3 --quiet --output out3"),
    0);
  EXPECT_EQ(ReadText(this->Folder / "stdout") + ReadText(this->Folder / "stderr"), "");
  EXPECT_EQ(std::system(("diff -r '" + (this->Folder / "out").string() + "' '" +
              (this->Folder / "out3").string() + "'")
                          .c_str()),
    0)
    << "another number of threads gave other files";
}

TEST_F(TestCoronaryPipelineSequence, CasesForOpenFoamReplaceOlderOnesButNoResults)
{
  this->PutCenterline();
  const std::string options =
    "result --formats openfoam --flow-frames 8 --flow-layers 2 --flow-edge 0.5 "
    "--flow-extension 0.5 --threads 1 --output out";
  ASSERT_EQ(this->Run(options + " --cycle-ms 800"), 0) << ReadText(this->Folder / "stderr");
  const fs::path folder = this->Folder / "out/mesh_openfoam_pRCA";
  const std::string said = ReadText(this->Folder / "stdout");
  EXPECT_NE(said.find("out/mesh_openfoam_pRCA: "), std::string::npos) << said;
  EXPECT_EQ(said.find("will not bear"), std::string::npos) << said;
  for (const char* name :
    { "constant/polyMesh/points", "0/U", "0/p", "0/pointDisplacement", "system/controlDict",
      "constant/boundaryData/wall/points", "constant/boundaryData/inlet/0.8/pointDisplacement",
      "constant/boundaryData/outlet_pRCA/0.1/pointDisplacement", "README.md", "Allrun",
      "case.foam" })
  {
    EXPECT_TRUE(fs::is_regular_file(folder / name)) << name;
  }
  // No point of the wall has moved at first, nor after the whole cycle; half way between, some has.
  const std::string first = ReadText(folder / "constant/boundaryData/wall/0/pointDisplacement");
  EXPECT_EQ(ReadText(folder / "constant/boundaryData/wall/0.8/pointDisplacement"), first);
  EXPECT_NE(ReadText(folder / "constant/boundaryData/wall/0.2/pointDisplacement"), first);
  std::istringstream rows(ReadText(folder / "quality.csv"));
  std::string row;
  std::getline(rows, row);
  int frames = 0;
  for (; std::getline(rows, row); ++frames)
  {
    std::istringstream numbers(row);
    std::vector<double> values;
    for (std::string value; std::getline(numbers, value, ',');)
    {
      values.push_back(std::stod(value));
    }
    ASSERT_EQ(values.size(), 7U) << row;
    EXPECT_GT(values[1], 0.0) << row;
    EXPECT_EQ(values[2], 0.0) << row;
    EXPECT_GT(values[6], 0.5) << row;
  }
  EXPECT_EQ(frames, 9);

  // A shorter one, at rest, with other names: nothing of the old one stays.
  ASSERT_EQ(this->Run(options + " --flow-rest --flow-blood carreau --quiet"), 0)
    << ReadText(this->Folder / "stderr");
  EXPECT_FALSE(fs::exists(folder / "constant/boundaryData"));
  EXPECT_NE(
    ReadText(folder / "constant/transportProperties").find("BirdCarreau"), std::string::npos);
  EXPECT_EQ(ReadText(folder / "0/U").find("pos()"), std::string::npos);

  // Results belong to the mesh that is there.
  const std::string before = ReadText(folder / "0/U");
  fs::create_directories(folder / "0.05");
  EXPECT_EQ(this->Run(options + " --quiet"), 1);
  EXPECT_NE(
    ReadText(this->Folder / "stderr").find("has results of a solver (0.05)"), std::string::npos)
    << ReadText(this->Folder / "stderr");
  EXPECT_EQ(ReadText(folder / "0/U"), before);
  this->ExpectFailure(1, "result --formats openfoam --flow-tree 3", "no tree 3");
  fs::remove(this->Folder / "result/centerline.vtp");
  this->ExpectFailure(1, "result --formats openfoam", "centerline.vtp");
}

TEST_F(TestCoronaryPipelineSequence, TheKhronosValidatorFindsNothing)
{
  ASSERT_EQ(this->Run("result --phases 20 --volume-conservation 1 --formats gltf,gltf-json "
                      "--quiet --output many"),
    0)
    << ReadText(this->Folder / "stderr");
  // One bone, one phase, four more influences than there are nodes.
  const auto volume = ChainVolume(1);
  Save(vtkNew<vtkXMLUnstructuredGridWriter>(), volume, this->Folder / "result/weights.vtu");
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainBoundary(volume, 1),
    this->Folder / "result/volume_boundary.vtp");
  for (const char* name : { "skeleton.vtp", "motion/skeleton_000.vtp", "motion/skeleton_001.vtp" })
  {
    Save(vtkNew<vtkXMLPolyDataWriter>(), ChainSkeleton(1), this->Folder / "result" / name);
  }
  ASSERT_EQ(
    this->Run("result --poses result/motion/skeleton_000.vtp result/motion/skeleton_001.vtp "
              "--pose-times 0,0.4 --times 0.4 --formats gltf --gltf-influences 8 --quiet "
              "--output one"),
    0)
    << ReadText(this->Folder / "stderr");
  const std::string command = "cd '" + this->Folder.string() +
    "' && '" DYNAMICCORONARY_SOURCE_DIR "/scripts/gltf-validator.sh' many/mesh_skin.glb "
    "many/mesh_skin.gltf one/mesh_skin.glb >stdout 2>stderr";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 125)
  {
    GTEST_SKIP() << ReadText(this->Folder / "stderr");
  }
  EXPECT_EQ(WEXITSTATUS(status), 0)
    << ReadText(this->Folder / "stdout") << ReadText(this->Folder / "stderr");
  const std::string found = ReadText(this->Folder / "stdout");
  EXPECT_NE(found.find("one/mesh_skin.glb: 0 errors, 0 warnings"), std::string::npos) << found;
}

TEST_F(TestCoronaryPipelineSequence, VelocityIsThatOfThePoints)
{
  ASSERT_EQ(
    this->Run("result --quiet --times 0.29,0.3,0.31 --velocity --cycle-ms 500 --output out"), 0)
    << ReadText(this->Folder / "stderr");
  std::vector<vtkSmartPointer<vtkUnstructuredGrid>> phases;
  for (int k = 0; k < 3; ++k)
  {
    vtkNew<vtkXMLUnstructuredGridReader> reader;
    reader->SetFileName(
      (this->Folder / ("out/mesh_volume_00" + std::to_string(k) + ".vtu")).c_str());
    reader->Update();
    phases.emplace_back(reader->GetOutput());
  }
  vtkDataArray* velocity = phases[1]->GetPointData()->GetArray("Velocity");
  ASSERT_TRUE(velocity);
  double maximum = 0.0;
  double error = 0.0;
  for (vtkIdType n = 0; n < phases[1]->GetNumberOfPoints(); ++n)
  {
    for (int c = 0; c < 3; ++c)
    {
      const double wanted = (phases[2]->GetPoint(n)[c] - phases[0]->GetPoint(n)[c]) / (0.02 * 0.5);
      maximum = std::max(maximum, std::abs(wanted));
      error = std::max(error, std::abs(velocity->GetComponent(n, c) - wanted));
    }
  }
  EXPECT_GT(maximum, 5.0);
  EXPECT_LT(error, 0.02 * maximum);
}

TEST_F(TestCoronaryPipelineSequence, PosesInAllForms)
{
  ASSERT_EQ(this->Run("result --quiet --output a"), 0) << ReadText(this->Folder / "stderr");
  ASSERT_EQ(this->Report("a")["phases"].size(), 5U);
  ASSERT_EQ(this->Run("result --quiet --poses result/motion/skeleton.pvd --output b"), 0);
  ASSERT_EQ(this->Run("result --quiet --poses result/motion/skeleton_00*.vtp --pose-times "
                      "0,0.2,0.4,0.6,0.8 --output c"),
    0)
    << ReadText(this->Folder / "stderr");
  for (const std::string other : { "b", "c" })
  {
    const auto a = this->Report("a");
    const auto b = this->Report(other);
    for (std::size_t k = 0; k < 5; ++k)
    {
      EXPECT_NEAR(b["phases"][k]["time"].get<double>(), 0.2 * static_cast<double>(k), 1e-12);
      EXPECT_NEAR(a["phases"][k]["quality"]["least_volume_mm3"].get<double>(),
        b["phases"][k]["quality"]["least_volume_mm3"].get<double>(), 1e-9);
    }
  }
  for (const std::string mode : { "linear", "cubic", "low-noise" })
  {
    ASSERT_EQ(this->Run("result --quiet --times 0.9,0.1 --mode " + mode +
                " --blend dual-quaternion --volume-conservation 1 --output " + mode),
      0)
      << ReadText(this->Folder / "stderr");
    EXPECT_EQ(this->Report(mode)["phases"][0]["time"], 0.1);
  }
  EXPECT_NE(
    this->Report("linear")["phases"][0]["quality"], this->Report("cubic")["phases"][0]["quality"]);
}

TEST_F(TestCoronaryPipelineSequence, FoldsAreReported)
{
  auto folded = ChainSkeleton(Bones);
  folded->GetPoints()->SetPoint(2, 1.0, 0.0, 0.3);
  Save(vtkNew<vtkXMLPolyDataWriter>(), folded, this->Folder / "result/motion/skeleton_002.vtp");
  ASSERT_EQ(this->Run("result --no-repair --output out"), 0);
  EXPECT_NE(ReadText(this->Folder / "stderr").find("1 of 5 phases have inverted tetrahedra"),
    std::string::npos)
    << ReadText(this->Folder / "stderr");
  const auto phases = this->Report("out")["phases"];
  EXPECT_GT(phases[2]["quality"]["inverted_tetrahedra"].get<int>(), 10);
  EXPECT_EQ(phases[2]["inverted_ids"].size(), phases[2]["quality"]["inverted_tetrahedra"]);
  EXPECT_EQ(phases[1]["quality"]["inverted_tetrahedra"], 0);
}

TEST_F(TestCoronaryPipelineSequence, SaysWhatIsWrong)
{
  this->ExpectFailure(1, "nowhere --poses result/motion/skeleton.pvd", "nowhere/weights.vtu");
  this->ExpectFailure(2, "nowhere", "--poses is needed");
  this->ExpectFailure(2, "result --velocity", "--cycle-ms is needed");
  this->ExpectFailure(2, "result --phases 0", "--phases");
  this->ExpectFailure(2, "result --phases 5 --times 0,1", "--times");
  this->ExpectFailure(2, "result --mode quintic", "--mode");
  this->ExpectFailure(2, "result --formats series,gmsh", "--formats");
  this->ExpectFailure(
    2, "result --poses result/motion/skeleton.pvd --pose-times 0,1", "has its times");
  this->ExpectFailure(2, "result --poses result/motion/skeleton_000.vtp", "--pose-times");
  this->ExpectFailure(2, "result --poses result/weights.vtu", "is neither");
  this->ExpectFailure(
    2, "result --poses result/skeleton.vtp result/skeleton.vtp --pose-times 1,1", "increase");
  this->ExpectFailure(1, "result --poses none.pvd", "'none.pvd' does not exist");
  this->ExpectFailure(1, "result --poses result/skeleton.vtp --pose-times 0", "needs at least two");
  this->Put("bad.pvd",
    "<VTKFile><Collection><DataSet timestep='0' file='none.vtp'/></Collection></VTKFile>");
  this->ExpectFailure(1, "result --poses bad.pvd", "none.vtp");
  // Of another heart.
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainSkeleton(3), this->Folder / "other.vtp");
  this->ExpectFailure(1, "result --poses other.vtp other.vtp --pose-times 0,0.5", "bones");
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainBoundary(ChainVolume(1), 1),
    this->Folder / "result/volume_boundary.vtp");
  this->ExpectFailure(1, "result", "must be on the same points");
  vtkNew<vtkUnstructuredGrid> points;
  points->SetPoints(ChainSkeleton(1)->GetPoints());
  Save(vtkNew<vtkXMLUnstructuredGridWriter>(), points, this->Folder / "result/weights.vtu");
  this->ExpectFailure(1, "result", "weights.vtu' is empty");
}
