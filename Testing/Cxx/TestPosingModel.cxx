// Posing by hand without a window: edits, what can be undone, files, and what is refused.
#include "vtkPosingModel.h"

#include "Refusals.h"
#include "VesselTestData.h"
#include "vtkDataFiles.h"
#include "vtkMessageTrap.h"
#include "vtkSkinDeformation.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace TestPosingModel
{
namespace fs = std::filesystem;

using coronary::JointDrag;
using coronary::PosingSettings;
using coronary::Vector3;
using coronary::vtkPosingModel;

namespace
{
constexpr int Bones = 4;

/// All joints and all points of the skin.
std::vector<double> BitsOf(const vtkPosingModel& model)
{
  std::vector<double> values;
  for (vtkPointSet* data :
    { static_cast<vtkPointSet*>(model.Pose()), static_cast<vtkPointSet*>(model.Skin()) })
  {
    for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
    {
      const double* point = data->GetPoint(n);
      values.insert(values.end(), point, point + 3);
    }
  }
  return values;
}

bool SameBits(const std::vector<double>& a, const std::vector<double>& b)
{
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

class TestPosingModel : public ::testing::Test
{
protected:
  void SetUp() override
  {
    this->Folder = fs::temp_directory_path() / ("posing model." + std::to_string(getpid()));
    SaveChainRun(this->Folder, Bones);
  }

  void TearDown() override { fs::remove_all(this->Folder); }

  std::unique_ptr<vtkPosingModel> Load()
  {
    return std::make_unique<vtkPosingModel>(this->Folder.string(), this->Messages);
  }

  std::string Path(const char* name) const { return (this->Folder / name).string(); }

  /// One sentence that names the file.
  template <typename Function>
  void ExpectFailure(const Function& function, const std::string& file, const std::string& part)
  {
    ExpectError(function, file, part);
    this->Messages.ForgetWarnings();
  }

  fs::path Folder;
  vtkMessageTrap Messages;
};

PosingSettings Dragging(JointDrag drag, int bones = 1, bool keepLengths = true)
{
  PosingSettings settings;
  settings.drag = drag;
  settings.bones = bones;
  settings.keepLengths = keepLengths;
  return settings;
}

double LengthInto(const vtkPosingModel& model, std::int64_t joint)
{
  return (model.Joint(joint) - model.Joint(model.Parent(joint))).norm();
}
}

TEST_F(TestPosingModel, BeginsAtRest)
{
  const auto model = this->Load();
  EXPECT_EQ(model->NumberOfJoints(), Bones + 1);
  EXPECT_EQ(model->Parent(0), -1);
  EXPECT_EQ(model->Parent(3), 2);
  EXPECT_EQ(model->Daughters(3), std::vector<std::int64_t>{ 4 });
  EXPECT_TRUE(model->Daughters(4).empty());
  EXPECT_FALSE(model->CanUndo());
  EXPECT_FALSE(model->CanRedo());
  EXPECT_LT(model->Report().maximumDisplacement, 1e-5);
  EXPECT_NEAR(model->Report().minimumVolumeRatio, 1.0, 1e-4);
  EXPECT_NEAR(model->Report().maximumVolumeRatio, 1.0, 1e-4);
  EXPECT_EQ(model->Report().inverted, 0);
}

TEST_F(TestPosingModel, WhatIsBeyondGoesWithAJoint)
{
  const auto model = this->Load();
  model->SetSettings(Dragging(JointDrag::Beyond));
  model->Choose(3);
  model->Move({ 2.0, 0.0, 1.0 });
  EXPECT_LT((model->Joint(2) - Vector3(0.0, 0.0, 10.0)).norm(), 1e-12);
  EXPECT_LT((model->Joint(3) - Vector3(2.0, 0.0, 16.0)).norm(), 1e-12);
  EXPECT_LT((model->Joint(4) - Vector3(2.0, 0.0, 21.0)).norm(), 1e-12);
  // A bone alone carries the far end of the bar, rigidly; the near end hangs on bones that stay.
  vtkPolyData* rest = model->BoundaryAtRest();
  int far = 0;
  for (vtkIdType n = 0; n < rest->GetNumberOfPoints(); ++n)
  {
    const Vector3 was(rest->GetPoint(n));
    const Vector3 moved = Vector3(model->Skin()->GetPoint(n)) - was;
    if (was.z() == 20.0)
    {
      ++far;
      EXPECT_NEAR(moved.norm(), std::sqrt(5.0), 0.6) << n;
    }
    if (was.z() <= 5.0)
    {
      EXPECT_LT(moved.norm(), 1e-4) << n;
    }
  }
  EXPECT_GT(far, 0);
  EXPECT_NEAR(model->Report().maximumStrain, std::hypot(2.0, 6.0) / 5.0 - 1.0, 1e-12);
}

TEST_F(TestPosingModel, OnlyTheJointMovesAlone)
{
  const auto model = this->Load();
  model->SetSettings(Dragging(JointDrag::Alone));
  model->Choose(2);
  model->Move({ 0.0, 1.5, 0.0 });
  EXPECT_LT((model->Joint(2) - Vector3(0.0, 1.5, 10.0)).norm(), 1e-12);
  for (const int other : { 0, 1, 3, 4 })
  {
    EXPECT_LT((model->Joint(other) - Vector3(0.0, 0.0, 5.0 * other)).norm(), 1e-12) << other;
  }
}

TEST_F(TestPosingModel, TheSkinIsThatOfTheFilter)
{
  const auto model = this->Load();
  model->Choose(3);
  model->Move({ 2.0, 1.0, -0.5 });
  model->Twist(0.4);
  model->Widen(0.7, 6.0);
  vtkNew<vtkSkinDeformation> filter;
  filter->SetInputDataObject(
    0, coronary::ReadUnstructuredGrid(this->Path("weights.vtu"), this->Messages));
  filter->SetInputDataObject(1, coronary::ReadPolyData(this->Path("skeleton.vtp"), this->Messages));
  filter->SetInputDataObject(2, model->Pose());
  filter->SetBlend(vtkSkinDeformation::DualQuaternion);
  filter->Update();
  auto* wanted = vtkPointSet::SafeDownCast(filter->GetOutputDataObject(0));
  ASSERT_EQ(wanted->GetNumberOfPoints(), model->Skin()->GetNumberOfPoints());
  double maximum = 0.0;
  for (vtkIdType n = 0; n < wanted->GetNumberOfPoints(); ++n)
  {
    EXPECT_EQ(Vector3(wanted->GetPoint(n)), Vector3(model->Skin()->GetPoint(n))) << n;
    const double* was = model->BoundaryAtRest()->GetPoint(n);
    maximum = std::max(maximum, (Vector3(wanted->GetPoint(n)) - Vector3(was)).norm());
  }
  EXPECT_NEAR(model->Report().maximumDisplacement, maximum, 1e-5);
  EXPECT_GT(maximum, 2.0);
}

TEST_F(TestPosingModel, BonesShareABendAndKeepTheirLengths)
{
  const auto model = this->Load();
  model->SetSettings(Dragging(JointDrag::Turn, 3));
  model->Choose(4);
  const Vector3 wanted(4.0, 0.0, 18.0);
  model->BeginMove();
  model->MoveTo(wanted);
  model->EndMove();
  EXPECT_LT((model->Joint(4) - wanted).norm(), 1e-6);
  EXPECT_LT((model->Joint(1) - Vector3(0.0, 0.0, 5.0)).norm(), 1e-12);
  double maximum = 0.0;
  for (int joint = 1; joint <= Bones; ++joint)
  {
    EXPECT_NEAR(LengthInto(*model, joint), 5.0, 1e-10) << joint;
    const Vector3 along = (model->Joint(joint) - model->Joint(joint - 1)).normalized();
    const Vector3 before = joint > 1
      ? Vector3((model->Joint(joint - 1) - model->Joint(joint - 2)).normalized())
      : Vector3::UnitZ();
    maximum = std::max(maximum, std::acos(std::min(1.0, along.dot(before))));
  }
  // With equal turns the chord of three bones is 5 (1 + 2 cos turn).
  const double evenest = std::acos(0.5 * (std::hypot(4.0, 13.0) / 5.0 - 1.0));
  EXPECT_LT(maximum, 1.25 * evenest);
  EXPECT_LT(model->Report().maximumStrain, 1e-10);
  EXPECT_EQ(model->Report().inverted, 0);
}

TEST_F(TestPosingModel, OutOfReachABoneKeepsItsLengthOrStretches)
{
  const auto model = this->Load();
  model->SetSettings(Dragging(JointDrag::Turn, 2));
  model->Choose(4);
  model->Move({ 30.0, 0.0, 0.0 });
  EXPECT_NEAR(LengthInto(*model, 4), 5.0, 1e-10);
  EXPECT_NEAR(LengthInto(*model, 3), 5.0, 1e-10);
  EXPECT_LT((model->Joint(4) - model->Joint(2)).norm(), 10.0 + 1e-9);
  ASSERT_TRUE(model->Undo());
  model->SetSettings(Dragging(JointDrag::Turn, 2, false));
  model->Move({ 30.0, 0.0, 0.0 });
  EXPECT_LT((model->Joint(4) - Vector3(30.0, 0.0, 20.0)).norm(), 1e-9);
  EXPECT_GT(model->Report().maximumStrain, 1.0);
}

TEST_F(TestPosingModel, UndoRedoAndResetAreExact)
{
  const auto model = this->Load();
  std::vector<std::vector<double>> states{ BitsOf(*model) };
  model->Choose(2);
  const auto did = [&] { states.push_back(BitsOf(*model)); };
  model->Move({ 1.0, 0.5, 0.0 });
  did();
  model->Turn({ 0.3, 0.0, 0.1 });
  did();
  model->Choose(4);
  model->Twist(0.5);
  did();
  model->Widen(1.3, 4.0);
  did();
  for (std::size_t n = 1; n < states.size(); ++n)
  {
    EXPECT_FALSE(SameBits(states[n], states[n - 1])) << n;
  }
  for (std::size_t n = states.size() - 1; n-- > 0;)
  {
    ASSERT_TRUE(model->Undo());
    EXPECT_TRUE(SameBits(BitsOf(*model), states[n])) << n;
  }
  EXPECT_FALSE(model->Undo());
  for (std::size_t n = 1; n < states.size(); ++n)
  {
    ASSERT_TRUE(model->Redo());
    EXPECT_TRUE(SameBits(BitsOf(*model), states[n])) << n;
  }
  EXPECT_FALSE(model->Redo());
  model->Reset();
  EXPECT_TRUE(SameBits(BitsOf(*model), states.front()));
  ASSERT_TRUE(model->Undo());
  EXPECT_TRUE(SameBits(BitsOf(*model), states.back()));
  // A new edit forgets what was undone.
  ASSERT_TRUE(model->Undo());
  model->Move({ 0.0, 0.2, 0.0 });
  EXPECT_FALSE(model->CanRedo());
}

TEST_F(TestPosingModel, AMoveIsOneStepAndMayBeCancelled)
{
  const auto model = this->Load();
  const std::vector<double> rest = BitsOf(*model);
  model->Choose(3);
  model->BeginMove();
  model->MoveTo({ 9.0, 0.0, 12.0 });
  model->CancelMove();
  EXPECT_TRUE(SameBits(BitsOf(*model), rest));
  EXPECT_FALSE(model->CanUndo());
  model->Move({ 1.0, 0.0, 0.0 });
  const std::vector<double> once = BitsOf(*model);
  model->Undo();
  model->BeginMove();
  model->MoveTo({ 7.0, 3.0, 9.0 });
  model->MoveTo({ 1.0, 0.0, 15.0 });
  model->EndMove();
  EXPECT_TRUE(SameBits(BitsOf(*model), once)) << "only the last place counts";
  ASSERT_TRUE(model->Undo());
  EXPECT_FALSE(model->CanUndo());
  model->BeginMove();
  model->EndMove();
  EXPECT_FALSE(model->CanUndo()) << "nothing was moved";
}

TEST_F(TestPosingModel, ASavedPoseGivesTheSame)
{
  const auto model = this->Load();
  model->Choose(3);
  model->Move({ 2.0, 1.0, 0.0 });
  model->Twist(-0.3);
  model->Widen(0.8, 3.0);
  const std::vector<double> posed = BitsOf(*model);
  const std::string path = this->Path("posed.vtp");
  model->WritePose(path);
  const auto other = this->Load();
  other->ReadPose(path);
  EXPECT_TRUE(SameBits(BitsOf(*other), posed));
  ASSERT_TRUE(other->Undo());
  EXPECT_FALSE(SameBits(BitsOf(*other), posed));
  model->WriteSurface(this->Path("posed_surface.vtp"));
  const auto surface = coronary::ReadPolyData(this->Path("posed_surface.vtp"), this->Messages);
  ASSERT_EQ(surface->GetNumberOfPoints(), model->BoundaryAtRest()->GetNumberOfPoints());
  EXPECT_EQ(surface->GetNumberOfPolys(), model->BoundaryAtRest()->GetNumberOfPolys());
  vtkDataArray* displacement = surface->GetPointData()->GetArray("Displacement");
  ASSERT_NE(displacement, nullptr);
  for (vtkIdType n = 0; n < surface->GetNumberOfPoints(); ++n)
  {
    const Vector3 now(surface->GetPoint(n));
    EXPECT_EQ(now, Vector3(model->Skin()->GetPoint(n)));
    const Vector3 was(model->BoundaryAtRest()->GetPoint(n));
    EXPECT_LT((now - was - Vector3(displacement->GetTuple3(n))).norm(), 1e-5);
  }
  // A pose of a run has places only.
  other->ReadPose(this->Path("motion/skeleton_01.vtp"));
  EXPECT_LT((other->Joint(4) - Vector3(ChainJoint(4, 0.2).data())).norm(), 1e-12);
}

TEST_F(TestPosingModel, WhatIsRefusedChangesNothing)
{
  const auto model = this->Load();
  model->SetSettings(Dragging(JointDrag::Beyond));
  EXPECT_THROW(model->Choose(Bones + 1), std::invalid_argument);
  EXPECT_THROW(model->Choose(-1), std::invalid_argument);
  EXPECT_THROW(model->SetSettings(Dragging(JointDrag::Turn, 0)), std::invalid_argument);
  model->Choose(3);
  const std::vector<double> rest = BitsOf(*model);
  const auto refused = [&](const auto& edit, const std::string& part)
  {
    this->ExpectFailure(edit, "", part);
    EXPECT_TRUE(SameBits(BitsOf(*model), rest)) << part;
    EXPECT_FALSE(model->CanUndo()) << part;
    EXPECT_FALSE(model->Moving()) << part;
  };
  refused([&] { model->Move({ 0.0, 0.0, -5.0 }); }, "has no length");
  refused([&] { model->Move({ std::nan(""), 0.0, 0.0 }); }, "finite");
  refused([&] { model->Widen(0.0, 3.0); }, "calibre must be positive");
  model->Choose(0);
  refused([&] { model->Twist(0.2); }, "no bone ends in it");
  refused([&] { model->ReadPose(this->Path("nothing.vtp")); }, "nothing.vtp");
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainSkeleton(Bones + 1), this->Folder / "longer.vtp");
  refused([&] { model->ReadPose(this->Path("longer.vtp")); }, "6 joints");
  this->ExpectFailure(
    [&] { model->WritePose(this->Path("no folder/pose.vtp")); }, "no folder/pose.vtp", "");
}

TEST_F(TestPosingModel, BadFoldersAreNamed)
{
  const auto load = [this] { this->Load(); };
  const fs::path folder = this->Folder;
  this->Folder = folder / "nowhere";
  this->ExpectFailure(load, "nowhere", "is no folder");
  this->Folder = folder;
  const auto without = [&](const char* name)
  {
    fs::rename(folder / name, folder / "aside");
    this->ExpectFailure(load, name, "is missing: posing needs skeleton and skin weights");
    this->ExpectFailure(load, name, "--until weights");
    fs::rename(folder / "aside", folder / name);
  };
  without("skeleton.vtp");
  without("weights.vtu");
  without("volume_boundary.vtp");
  const auto broken = [&](const char* name, const char* part)
  {
    this->ExpectFailure(load, name, part);
    SaveChainRun(folder, Bones);
  };
  std::ofstream(folder / "weights.vtu") << "<VTKFile";
  broken("weights.vtu", "");
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainTree(Bones), folder / "skeleton.vtp");
  broken("skeleton.vtp", "a bone has two");
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainSkeleton(2), folder / "skeleton.vtp");
  broken("weights.vtu", "one");
  auto other = ChainVolume(Bones);
  other->GetPoints()->SetPoint(0, 9.0, 9.0, 9.0);
  Save(vtkNew<vtkXMLUnstructuredGridWriter>(), other, folder / "weights.vtu");
  broken("volume_boundary.vtp", "does not belong to");
  Save(vtkNew<vtkXMLPolyDataWriter>(), ChainTree(Bones), folder / "volume_boundary.vtp");
  broken("volume_boundary.vtp", "no surface of triangles");
  auto bare = ChainVolume(Bones);
  bare->GetPointData()->Initialize();
  Save(vtkNew<vtkXMLUnstructuredGridWriter>(), bare, folder / "weights.vtu");
  broken("weights.vtu", "BoneIndices");
}

TEST(PosingMove, IsReadFromText)
{
  const coronary::PosingMove move = coronary::PosingMoveOf("12:1.5,-2,3e-1");
  EXPECT_EQ(move.joint, 12);
  EXPECT_EQ(move.millimetres, Vector3(1.5, -2.0, 0.3));
  for (const char* text : { "", "12", "12:1,2", "12:1,2,3,4", "-1:1,2,3", "1:nan,0,0", "a:1,2,3" })
  {
    EXPECT_THROW(coronary::PosingMoveOf(text), std::invalid_argument) << text;
  }
}
}
