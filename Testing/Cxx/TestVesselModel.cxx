// Vessels out of a run's files: the right points move with the right bones, and what is broken is named.
#include "Scenario.h"
#include "VesselLesions.h"
#include "VesselModel.h"

#include "VesselTestData.h"

#include <gtest/gtest.h>
#include <vtkVersionMacros.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace TestVesselModel
{
namespace fs = std::filesystem;

using coronary::Vector3;
using coronary::VesselModel;
using coronary::VesselMotion;
using coronary::VesselSource;

namespace
{
constexpr int Bones = 4;

class TestVesselModel : public ::testing::Test
{
protected:
  void SetUp() override
  {
    this->Folder = fs::temp_directory_path() / ("vessel model." + std::to_string(getpid()));
    SaveChainRun(this->Folder, Bones);
  }

  void TearDown() override { fs::remove_all(this->Folder); }

  VesselModel Load(VesselMotion motion = VesselMotion::Automatic)
  {
    VesselSource source;
    source.kind = VesselSource::Kind::Run;
    source.path = this->Folder.string();
    source.motion = motion;
    return coronary::LoadVessels(source);
  }

  /// One sentence that names the file.
  void ExpectFailure(
    const std::string& file, const std::string& part, VesselMotion motion = VesselMotion::Automatic)
  {
    try
    {
      this->Load(motion);
      ADD_FAILURE() << "nothing was thrown, wanted: " << part;
    }
    catch (const std::exception& error)
    {
      const std::string text = error.what();
      EXPECT_NE(text.find(file), std::string::npos) << text;
      EXPECT_NE(text.find(part), std::string::npos) << text;
    }
  }

  fs::path Folder;
};
}

TEST_F(TestVesselModel, KnowsTheLesionsOfTheRun)
{
  EXPECT_TRUE(this->Load().wall->Topology().axisReference.empty()) << "an older run has none";
  auto tree = ChainTree(Bones);
  vtkNew<vtkDoubleArray> healthy;
  healthy->SetName("ReferenceRadius");
  vtkNew<vtkIntArray> calcium;
  calcium->SetName("CalciumLabel");
  for (vtkIdType n = 0; n < tree->GetNumberOfPoints(); ++n)
  {
    const bool narrow = n > 7 && n < 12;
    tree->GetPointData()->GetArray(0)->SetComponent(n, 0, narrow ? 0.6 : 1.5);
    healthy->InsertNextValue(n == 3 ? 1.55 : 1.5);
    calcium->InsertNextValue(n == 9 ? 2 : 0);
  }
  tree->GetPointData()->AddArray(healthy);
  tree->GetPointData()->AddArray(calcium);
  Save(vtkNew<vtkXMLPolyDataWriter>(), tree, this->Folder / "centerline.vtp");
  std::ofstream(this->Folder / "report.json")
    << R"({"centerline": {"calcium": {"objects": [{"label": 2, "arc_deg": 140.0}]}}})";
  const coronary::WallTopology topology = this->Load().wall->Topology();
  ASSERT_EQ(topology.axisReference.size(), 1U);
  EXPECT_EQ(topology.axisReference[0][3], 1.5) << "irregular, but no lesion";
  EXPECT_EQ(topology.axisCalcium[0][9], 140.0);
  EXPECT_EQ(topology.axisCalcium[0][8], 0.0);
  const std::vector<coronary::FoundLesion> lesions = coronary::FindLesions(topology);
  ASSERT_EQ(lesions.size(), 1U);
  EXPECT_EQ(lesions[0].vessel, "pRCA");
  EXPECT_NEAR(lesions[0].degree, 0.6, 1e-12);
  EXPECT_EQ(lesions[0].points.size(), 4U);
}

TEST_F(TestVesselModel, MovesWithItsSkeleton)
{
  const VesselModel model = this->Load();
  const coronary::WallTopology& topology = model.wall->Topology();
  EXPECT_EQ(model.motion, "tracked at 5 moments");
  EXPECT_NEAR(model.heartRate, 62.5, 1e-9) << "of a cycle of 0.96 s";
  EXPECT_TRUE(model.notes.empty());
  EXPECT_EQ(model.heart, nullptr) << "nothing says where a bar's heart is";
  ASSERT_EQ(topology.axis.size(), 1U);
  EXPECT_EQ(topology.groupName[0], "pRCA");
  EXPECT_EQ(topology.parent[0], -1);
  EXPECT_EQ(topology.axisRadius[0].front(), 1.5);
  EXPECT_EQ(coronary::RootBranch(topology, "RCA"), 0);
  for (const int group : topology.group)
  {
    EXPECT_EQ(group, 0) << "the only branch";
  }
  EXPECT_EQ(std::count(topology.entity.begin(), topology.entity.end(), 2),
    std::count(topology.entity.begin(), topology.entity.end(), 3));

  std::vector<Vector3> rest;
  std::vector<Vector3> axis;
  model.wall->Positions(0.0, rest);
  EXPECT_EQ(static_cast<std::int64_t>(rest.size()), topology.points);
  std::vector<Vector3> moved;
  for (const double phase : { 0.0, 0.2, 0.4, 0.8, 1.2 })
  {
    model.wall->Positions(phase, moved);
    model.wall->AxisPositions(phase, axis);
    // Where the axis bends, its points do; the bone's ends are exactly known.
    for (int j = 0; j <= Bones; ++j)
    {
      const std::array<double, 3> joint = ChainJoint(j, phase);
      EXPECT_LT((axis[static_cast<std::size_t>(5 * j)] - Vector3(joint.data())).norm(), 0.25)
        << phase << " " << j;
    }
    // Wall points stay beside their place of the axis.
    for (std::size_t n = 0; n < rest.size(); ++n)
    {
      const auto place = static_cast<std::size_t>(std::lround(rest[n].z()));
      const double before = std::hypot(rest[n].x(), rest[n].y());
      EXPECT_NEAR((moved[n] - axis[place]).norm(), before, 0.8) << phase;
    }
  }
  model.wall->Positions(0.2, moved);
  double most = 0.0;
  for (std::size_t n = 0; n < rest.size(); ++n)
  {
    most = std::max(most, (moved[n] - rest[n]).norm());
  }
  EXPECT_GT(most, 2.0);
}

TEST_F(TestVesselModel, StandsStillOrContractsWithoutMotion)
{
  fs::remove_all(this->Folder / "motion");
  fs::remove(this->Folder / "weights.vtu");
  const VesselModel still = this->Load();
  EXPECT_EQ(still.motion, "still");
  EXPECT_EQ(still.heartRate, 0.0);
  ASSERT_EQ(still.notes.size(), 1U);
  EXPECT_NE(still.notes[0].find("stand still"), std::string::npos);
  std::vector<Vector3> a;
  std::vector<Vector3> b;
  still.wall->Positions(0.0, a);
  still.wall->Positions(0.4, b);
  EXPECT_EQ(a, b);
  const VesselModel beating = this->Load(VesselMotion::Contraction);
  beating.wall->Positions(0.0, b);
  double most = 0.0;
  for (const double phase : { 0.0, 0.35 })
  {
    beating.wall->Positions(phase, b);
    for (std::size_t n = 0; n < a.size(); ++n)
    {
      most = std::max(most, (a[n] - b[n]).norm());
    }
    EXPECT_TRUE(phase == 0.0 ? most < 1e-9 : most > 5.0) << most;
  }
  this->ExpectFailure("motion/skeleton.vtp.series", "is missing", VesselMotion::Tracked);
}

TEST_F(TestVesselModel, NamesWhatIsMissing)
{
  const auto without = [&](const char* name, const std::string& part)
  {
    fs::rename(this->Folder / name, this->Folder / "away");
    this->ExpectFailure(name, part);
    fs::rename(this->Folder / "away", this->Folder / name);
  };
  without("weights.vtu", "is missing");
  without("centerline.vtp", "is missing");
  without("skeleton.vtp", "is missing");
  without("volume_boundary.vtp", "is missing");
  without("motion/skeleton_03.vtp", "Cannot open");
  this->Folder /= "nowhere";
  this->ExpectFailure("nowhere", "is no folder");
  this->Folder = this->Folder.parent_path();
}

TEST_F(TestVesselModel, NamesWhatIsBroken)
{
  // A mesh without weights.
  const auto volume = ChainVolume(Bones);
  volume->GetPointData()->RemoveArray("BoneIndices");
  Save(vtkNew<vtkXMLUnstructuredGridWriter>(), volume, this->Folder / "weights.vtu");
  this->ExpectFailure("weights.vtu", "mesh without weights");
  // Weights of bones that the skeleton does not have.
  Save(
    vtkNew<vtkXMLUnstructuredGridWriter>(), ChainVolume(Bones + 1), this->Folder / "weights.vtu");
  this->ExpectFailure("vessel model", "the skeleton has 4");
  Save(
    vtkNew<vtkXMLUnstructuredGridWriter>(), ChainVolume(Bones - 1), this->Folder / "weights.vtu");
  this->ExpectFailure("volume_boundary.vtp", "does not belong to");
  std::ofstream(this->Folder / "weights.vtu") << "no XML";
  this->ExpectFailure("weights.vtu", "is not a VTK XML");
  Save(vtkNew<vtkXMLUnstructuredGridWriter>(), ChainVolume(Bones), this->Folder / "weights.vtu");

  // Another skeleton at one moment.
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainSkeleton(Bones - 1),
    this->Folder / "motion/skeleton_02.vtp");
  this->ExpectFailure("motion/skeleton_02.vtp", "has 4 joints");

  // A wall with a hole.
  const auto boundary = ChainBoundary(ChainVolume(Bones), Bones);
  auto open = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkCellArray> polys;
  for (vtkIdType n = 1; n < boundary->GetNumberOfPolys(); ++n)
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    boundary->GetPolys()->GetCellAtId(n, count, ids);
    polys->InsertNextCell(count, ids);
  }
  open->SetPoints(boundary->GetPoints());
  open->SetPolys(polys);
  Save(vtkNew<vtkXMLPolyDataWriter>(), open, this->Folder / "volume_boundary.vtp");
  this->ExpectFailure("volume_boundary.vtp", "edge", VesselMotion::Still);

  // No tree.
  auto tree = ChainTree(Bones);
  tree->GetPointData()->RemoveArray("MaximumInscribedSphereRadius");
  Save(vtkNew<vtkXMLPolyDataWriter>(), tree, this->Folder / "centerline.vtp");
  this->ExpectFailure("centerline.vtp", "MaximumInscribedSphereRadius");
  Save(vtkNew<vtkXMLPolyDataWriter>(), vtkNew<vtkPolyData>(), this->Folder / "centerline.vtp");
#if VTK_MAJOR_VERSION == 9 && VTK_MINOR_VERSION < 3
  const char* fault = "Cannot read"; // it takes a file without pieces for a damaged one
#else
  const char* fault = "is no tree of centerlines";
#endif
  this->ExpectFailure("centerline.vtp", fault);
}
}
