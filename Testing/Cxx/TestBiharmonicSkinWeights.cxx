// vtkBiharmonicSkinWeights through the VTK pipeline: arrays, summary, cache, pieces, blocks, refusals.
#include "vtkBiharmonicSkinWeights.h"

#include "FilterMessages.h"
#include "ParallelFor.h"
#include "SkinWeightCache.h"
#include "TetrahedralMesh.h"
#include "TetrahedronTestMeshes.h"
#include "vtkCenterlineSkeleton.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkFrenetSweepSurface.h"
#include "vtkTetrahedralMesher.h"

#include "vtkCellArray.h"
#include "vtkCellType.h"
#include "vtkCompositeDataPipeline.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIntArray.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkUnstructuredGrid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace TestBiharmonicSkinWeights
{
using coronary::SkinWeightInput;
using coronary::Vector3;

namespace
{
vtkSmartPointer<vtkUnstructuredGrid> MeshOf(const SkinWeightInput& input)
{
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Vector3& p : input.points)
  {
    points->InsertNextPoint(p.data());
  }
  grid->SetPoints(points);
  vtkNew<vtkCellArray> cells;
  for (const auto& t : input.tetrahedra)
  {
    const vtkIdType corners[4] = { t[0], t[1], t[2], t[3] };
    cells->InsertNextCell(4, corners);
  }
  grid->SetCells(VTK_TETRA, cells);
  return grid;
}

vtkSmartPointer<vtkPolyData> SkeletonOf(const SkinWeightInput& input)
{
  auto skeleton = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Vector3& p : input.joints)
  {
    points->InsertNextPoint(p.data());
  }
  skeleton->SetPoints(points);
  vtkNew<vtkCellArray> lines;
  for (const auto& bone : input.bones)
  {
    const vtkIdType ends[2] = { bone.first, bone.second };
    lines->InsertNextCell(2, ends);
  }
  skeleton->SetLines(lines);
  return skeleton;
}

const SkinWeightInput& Comb()
{
  static const SkinWeightInput comb = coronary::MeshOfComb(3, 2, 4, 1, 0.5);
  return comb;
}

/// The comb's mesh and skeleton, set as the filter's inputs.
void SetComb(vtkBiharmonicSkinWeights* filter)
{
  filter->SetInputData(MeshOf(Comb()));
  filter->SetSkeletonData(SkeletonOf(Comb()));
}

void ExpectRefusal(vtkBiharmonicSkinWeights* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
}

vtkDataArray* PointArray(vtkDataSet* data, const char* name)
{
  vtkDataArray* array = data->GetPointData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array;
}

double Field(vtkDataObject* data, const char* name, vtkIdType place = 0)
{
  vtkDataArray* array = data->GetFieldData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array != nullptr ? array->GetComponent(place, 0) : std::nan("");
}

std::string BytesOf(vtkDataArray* array)
{
  return { static_cast<const char*>(array->GetVoidPointer(0)),
    static_cast<std::size_t>(array->GetDataSize() * array->GetDataTypeSize()) };
}

/// A folder that goes away with its contents.
struct TemporaryFolder
{
  TemporaryFolder()
    : Path(std::filesystem::temp_directory_path() /
        ("skin-weight-test-" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
          "-" + std::to_string(reinterpret_cast<std::uintptr_t>(this))))
  {
    std::filesystem::remove_all(this->Path);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(this->Path); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::vector<std::filesystem::path> Files() const
  {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(this->Path))
    {
      files.push_back(entry.path());
    }
    return files;
  }

  std::filesystem::path Path;
};
}

TEST(BiharmonicSkinWeightsFilter, WeightsOfAComb)
{
  const auto mesh = MeshOf(Comb());
  const auto skeleton = SkeletonOf(Comb());
  vtkNew<vtkStringArray> names;
  names->SetName("BoneName");
  for (std::size_t b = 0; b < Comb().bones.size(); ++b)
  {
    names->InsertNextValue("LAD-" + std::to_string(b));
  }
  skeleton->GetFieldData()->AddArray(names);
  const vtkMTimeType before = mesh->GetMTime();
  vtkNew<vtkBiharmonicSkinWeights> filter;
  filter->SetInputData(mesh);
  filter->SetSkeletonData(skeleton);
  filter->DenseOn();
  filter->Update();
  EXPECT_EQ(mesh->GetMTime(), before);
  EXPECT_EQ(mesh->GetPointData()->GetNumberOfArrays(), 0);
  EXPECT_EQ(mesh->GetFieldData()->GetNumberOfArrays(), 0);

  vtkUnstructuredGrid* output = filter->GetOutput();
  ASSERT_EQ(output->GetNumberOfCells(), mesh->GetNumberOfCells());
  vtkDataArray* dense = PointArray(output, "BoneWeights");
  vtkDataArray* bones = PointArray(output, "BoneIndices");
  vtkDataArray* compact = PointArray(output, "BoneWeightsCompact");
  vtkDataArray* dropped = PointArray(output, "DroppedWeight");
  const auto count = static_cast<int>(Comb().bones.size());
  ASSERT_EQ(dense->GetNumberOfComponents(), count);
  EXPECT_STREQ(dense->GetComponentName(2), "LAD-2");
  ASSERT_EQ(bones->GetNumberOfComponents(), 8);
  ASSERT_EQ(compact->GetNumberOfComponents(), 8);
  for (vtkIdType i = 0; i < output->GetNumberOfPoints(); ++i)
  {
    double sum = 0.0;
    for (int b = 0; b < count; ++b)
    {
      const double w = dense->GetComponent(i, b);
      EXPECT_GE(w, 0.0);
      EXPECT_LE(w, 1.0);
      sum += w;
    }
    EXPECT_NEAR(sum, 1.0, 1e-9);
    double kept = 0.0;
    double maximum = 1.0;
    for (int k = 0; k < 8; ++k)
    {
      const auto b = static_cast<int>(bones->GetComponent(i, k));
      const double w = compact->GetComponent(i, k);
      EXPECT_LE(w, maximum + 1e-6);
      maximum = w;
      kept += w;
      EXPECT_EQ(b < 0, w == 0.0);
      if (b >= 0)
      {
        EXPECT_NEAR(w * (1.0 - dropped->GetComponent(i, 0)), dense->GetComponent(i, b), 1e-6);
      }
    }
    EXPECT_NEAR(kept, 1.0, 1e-6);
  }
  // On its bone a weight is 1, at a joint of two bones it is a half.
  for (vtkIdType i = 0; i < output->GetNumberOfPoints(); ++i)
  {
    const Vector3 p(output->GetPoint(i));
    if ((p - Vector3(1.0, 0.0, 0.0)).norm() < 1e-9)
    {
      EXPECT_EQ(dense->GetComponent(i, 0), 1.0);
    }
    if ((p - Vector3(2.0, 2.0, 0.0)).norm() < 1e-9)
    {
      EXPECT_EQ(std::lround(2.0 * compact->GetComponent(i, 0)), 1);
    }
  }
  EXPECT_EQ(Field(output, "WeightsConverged"), 1.0);
  EXPECT_GT(Field(output, "WeightsIterations"), 1.0);
  EXPECT_LE(Field(output, "WeightsResidual", 0), 1e-6);
  EXPECT_LE(Field(output, "WeightsResidual", 1), 1e-5);
  EXPECT_GT(Field(output, "WeightsEnergy"), 0.0);
  EXPECT_LE(Field(output, "WeightsEnergyGap"), 1e-3);
  EXPECT_NEAR(Field(output, "WeightsRowSums", 0), 1.0, 1e-9);
  EXPECT_NEAR(Field(output, "WeightsRowSums", 1), 1.0, 1e-9);
  EXPECT_EQ(output->GetFieldData()->GetArray("BoneLengthOutside")->GetNumberOfTuples(), count);
  EXPECT_EQ(
    vtkStringArray::SafeDownCast(output->GetFieldData()->GetAbstractArray("BoneName"))->GetValue(1),
    "LAD-1");
}

TEST(BiharmonicSkinWeightsFilter, ModesAndInfluences)
{
  for (int mode = vtkBiharmonicSkinWeights::JointMode;
       mode <= vtkBiharmonicSkinWeights::HarmonicMode; ++mode)
  {
    SCOPED_TRACE(mode);
    vtkNew<vtkBiharmonicSkinWeights> filter;
    SetComb(filter);
    filter->SetMode(mode);
    filter->SetInfluences(2);
    filter->Update();
    vtkUnstructuredGrid* output = filter->GetOutput();
    EXPECT_EQ(output->GetPointData()->GetArray("BoneWeights"), nullptr);
    vtkDataArray* compact = PointArray(output, "BoneWeightsCompact");
    ASSERT_EQ(compact->GetNumberOfComponents(), 2);
    EXPECT_GT(PointArray(output, "DroppedWeight")->GetRange()[1], 0.01);
    EXPECT_EQ(
      Field(output, "WeightsRowSums", 1) > 1.01, mode == vtkBiharmonicSkinWeights::IndependentMode);
  }
}

TEST(BiharmonicSkinWeightsFilter, SameBitsOnAnyNumberOfThreads)
{
  std::vector<std::string> results;
  for (const int threads : { 1, 2, 5 })
  {
    coronary::SetNumberOfThreads(threads);
    vtkNew<vtkBiharmonicSkinWeights> filter;
    SetComb(filter);
    filter->DenseOn();
    filter->Update();
    results.push_back(BytesOf(PointArray(filter->GetOutput(), "BoneWeights")));
  }
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST(BiharmonicSkinWeightsFilter, PhantomTreesWithTheBonesAmongTheEdges)
{
  if (!coronary::HasTetrahedralBackend(coronary::TetrahedralBackend::TetGen))
  {
    GTEST_SKIP() << "built without TetGen";
  }
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetSeed(5);
  vtkNew<vtkFrenetSweepSurface> surface;
  surface->SetInputConnection(source->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  surface->SetMinimumEdgeLength(0.5);
  surface->SetMaximumEdgeLength(1.2);
  vtkNew<vtkCenterlineSkeleton> skeleton;
  skeleton->SetInputConnection(source->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  vtkNew<vtkTetrahedralMesher> mesher;
  mesher->SetInputConnection(surface->GetOutputPort());
  mesher->SetSkeletonConnection(skeleton->GetOutputPort());
  mesher->LeaveOutsideOn();
  vtkNew<vtkBiharmonicSkinWeights> filter;
  filter->SetInputConnection(mesher->GetOutputPort());
  filter->SetSkeletonConnection(skeleton->GetOutputPort());
  filter->Update();
  vtkUnstructuredGrid* output = filter->GetOutput();
  ASSERT_GT(output->GetNumberOfPoints(), 1000);
  EXPECT_EQ(Field(output, "WeightsConverged"), 1.0);
  EXPECT_LE(Field(output, "WeightsResidual", 1), 1e-5);
  EXPECT_LE(Field(output, "WeightsOnBones"), 0.05);
  EXPECT_LE(PointArray(output, "DroppedWeight")->GetRange()[1], 0.05);
  vtkDataArray* compact = PointArray(output, "BoneWeightsCompact");
  for (vtkIdType i = 0; i < output->GetNumberOfPoints(); ++i)
  {
    double sum = 0.0;
    for (int k = 0; k < 8; ++k)
    {
      sum += compact->GetComponent(i, k);
    }
    EXPECT_NEAR(sum, 1.0, 1e-6);
  }

  // The same without bounds, and with the harmonic energy.
  for (const int mode :
    { vtkBiharmonicSkinWeights::UnboundedMode, vtkBiharmonicSkinWeights::HarmonicMode })
  {
    SCOPED_TRACE(mode);
    const bool bounded = mode == vtkBiharmonicSkinWeights::HarmonicMode;
    filter->SetMode(mode);
    filter->DenseOn();
    const Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.Errors.empty());
    EXPECT_EQ(Field(output, "WeightsConverged"), 1.0);
    EXPECT_LE(Field(output, "WeightsOnBones"), 0.05);
    EXPECT_GT(Field(output, "WeightsEnergy"), 0.0);
    vtkDataArray* all = PointArray(output, "BoneWeights");
    vtkDataArray* few = PointArray(output, "BoneWeightsCompact");
    double minimum = 0.0;
    double maximum = 0.0;
    double worst = 0.0;
    for (vtkIdType i = 0; i < all->GetNumberOfTuples(); ++i)
    {
      double sum = 0.0;
      for (int b = 0; b < all->GetNumberOfComponents(); ++b)
      {
        const double w = all->GetComponent(i, b);
        ASSERT_TRUE(std::isfinite(w));
        minimum = std::min(minimum, w);
        maximum = std::max(maximum, w);
        sum += w;
      }
      worst = std::max(worst, std::abs(sum - 1.0));
      double kept = 0.0;
      for (int k = 0; k < few->GetNumberOfComponents(); ++k)
      {
        kept += few->GetComponent(i, k);
      }
      EXPECT_NEAR(kept, 1.0, 1e-5);
    }
    EXPECT_LE(worst, 1e-6);
    // They overshoot without bounds, but stay weights.
    EXPECT_EQ(minimum < -0.01, !bounded);
    EXPECT_EQ(maximum > 1.01, !bounded);
    EXPECT_GT(minimum, -5.0);
    EXPECT_LT(maximum, 5.0);
    RecordProperty("least" + std::to_string(mode), std::to_string(minimum));
    RecordProperty("greatest" + std::to_string(mode), std::to_string(maximum));
  }
}

TEST(BiharmonicSkinWeightsCache, ReadsWhatItWrote)
{
  const TemporaryFolder folder;
  const std::string path = (folder.Path / "deep").string();
  const auto run = [&](bool dense = true)
  {
    vtkNew<vtkBiharmonicSkinWeights> filter;
    SetComb(filter);
    filter->SetDense(dense);
    filter->SetCacheFolder(path.c_str());
    const Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.Errors.empty());
    return std::make_pair(
      BytesOf(PointArray(filter->GetOutput(), dense ? "BoneWeights" : "BoneIndices")),
      messages.Warnings);
  };
  const auto [first, noWarnings] = run();
  EXPECT_TRUE(noWarnings.empty());
  const auto entries = [&]
  {
    std::vector<std::filesystem::path> list;
    for (const auto& entry : std::filesystem::directory_iterator(path))
    {
      list.push_back(entry.path());
    }
    return list;
  };
  ASSERT_EQ(entries().size(), 1U);
  const std::filesystem::path file = entries()[0];
  std::ifstream stream(file, std::ios::binary);
  std::string whole{ std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>() };
  // That it is read, and not solved again, shows when another result is in it.
  coronary::SkinWeights changed;
  ASSERT_TRUE(coronary::ReadSkinWeights(file.string(), Comb(), changed));
  std::fill(changed.weight.begin(), changed.weight.end(), 0.25);
  coronary::WriteSkinWeights(file.string(), changed);
  EXPECT_NE(run().first, first);

  // Damaged in one bit, cut off, foreign, of another mesh: a warning, and written anew.
  const auto put = [&](const std::string& bytes)
  { std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes; };
  std::string damaged = whole;
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 4);
  for (const std::string& bytes : { damaged, whole.substr(0, whole.size() / 2), whole.substr(0, 5),
         std::string(), std::string("some text that somebody put here for a reason") })
  {
    put(bytes);
    const auto [again, warnings] = run();
    EXPECT_EQ(again, first);
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_NE(warnings[0].find(file.string()), std::string::npos) << warnings[0];
    EXPECT_TRUE(run().second.empty());
  }
  changed.offset.pop_back();
  coronary::WriteSkinWeights(file.string(), changed);
  const auto [again, warnings] = run();
  EXPECT_EQ(again, first);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("another mesh"), std::string::npos) << warnings[0];
  EXPECT_EQ(entries().size(), 1U);
}

TEST(BiharmonicSkinWeightsCache, EverythingThatMattersIsInTheName)
{
  const SkinWeightInput& input = Comb();
  const coronary::SkinWeightSettings settings;
  std::vector<std::string> names{ coronary::SkinWeightCachePath("x", input, settings) };
  EXPECT_EQ(coronary::SkinWeightCachePath("x", Comb(), settings), names[0]);
  const auto changed = [&](const auto& change)
  {
    SkinWeightInput otherInput = input;
    coronary::SkinWeightSettings otherSettings;
    change(otherInput, otherSettings);
    names.push_back(coronary::SkinWeightCachePath("x", otherInput, otherSettings));
  };
  changed([](auto& i, auto&) { i.points[7][1] = std::nextafter(i.points[7][1], 100.0); });
  changed([](auto& i, auto&) { std::swap(i.tetrahedra[0], i.tetrahedra[1]); });
  changed([](auto& i, auto&) { i.joints[1][0] += 1e-12; });
  changed([](auto& i, auto&) { std::swap(i.bones[0].first, i.bones[0].second); });
  changed([](auto&, auto& s) { s.mode = coronary::SkinWeightMode::Independent; });
  changed([](auto&, auto& s) { s.tolerance = 1e-5; });
  changed([](auto&, auto& s) { s.leaveOutside = true; });
  changed([](auto&, auto& s) { s.iterations = 9; });
  changed([](auto&, auto& s) { s.polish = false; });
  changed([](auto&, auto& s) { s.neighbourhood = 3.0; });
  changed([](auto&, auto& s) { s.widen = false; });
  changed([](auto&, auto& s) { s.penalty = 10.0; });
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::unique(names.begin(), names.end()), names.end());
}

TEST(BiharmonicSkinWeightsCache, FolderThatCannotBeIsAWarning)
{
  const TemporaryFolder folder;
  std::ofstream(folder.Path) << "a file";
  vtkNew<vtkBiharmonicSkinWeights> filter;
  SetComb(filter);
  filter->SetCacheFolder(folder.Path.string().c_str());
  const Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  ASSERT_EQ(messages.Warnings.size(), 1U);
  EXPECT_NE(messages.Warnings[0].find("not kept"), std::string::npos) << messages.Warnings[0];
  EXPECT_EQ(Field(filter->GetOutput(), "WeightsConverged"), 1.0);
}

TEST(BiharmonicSkinWeightsFilter, BonesOutsideAreLeftOutWhereWanted)
{
  // One far away, in the middle of the list, and one that goes on where a twig has left the mesh.
  SkinWeightInput input = Comb();
  const std::int64_t tip = input.bones.back().second;
  const Vector3 away =
    (input.joints[tip] - input.joints[input.bones.back().first]).normalized() * 3.0;
  input.joints.push_back(input.joints[tip] + away);
  input.joints.push_back(input.joints[tip] + 2.0 * away);
  const auto outer = static_cast<std::int64_t>(input.joints.size()) - 1;
  input.bones.emplace_back(outer - 1, outer);
  input.joints.emplace_back(100, 0, 0);
  input.joints.emplace_back(101, 0, 0);
  const std::int64_t far = 2;
  input.bones.insert(input.bones.begin() + far,
    { static_cast<std::int64_t>(input.joints.size()) - 2,
      static_cast<std::int64_t>(input.joints.size()) - 1 });
  const auto twig = static_cast<std::int64_t>(input.bones.size()) - 1;
  const auto skeleton = SkeletonOf(input);
  vtkNew<vtkStringArray> names;
  names->SetName("BoneName");
  for (std::size_t b = 0; b < input.bones.size(); ++b)
  {
    names->InsertNextValue("LAD-" + std::to_string(b));
  }
  skeleton->GetFieldData()->AddArray(names);
  vtkNew<vtkBiharmonicSkinWeights> plain;
  SetComb(plain);
  plain->DenseOn();
  const auto folder =
    std::filesystem::path(testing::TempDir()) / "TestBiharmonicSkinWeights-outside";
  std::filesystem::remove_all(folder);
  for (const int mode :
    { vtkBiharmonicSkinWeights::JointMode, vtkBiharmonicSkinWeights::HarmonicMode })
  {
    plain->SetMode(mode);
    plain->Update();
    vtkDataArray* expected = PointArray(plain->GetOutput(), "BoneWeights");
    vtkNew<vtkBiharmonicSkinWeights> filter;
    filter->SetMode(mode);
    filter->SetInputData(MeshOf(Comb()));
    filter->SetSkeletonData(skeleton);
    filter->DenseOn();
    ExpectRefusal(filter, "outside of the mesh");
    filter->LeaveOutsideOn();
    filter->SetCacheFolder(folder.c_str());
    // Computed, and read again.
    for (int time = 0; time < 2; ++time)
    {
      filter->Modified();
      const Messages messages(filter);
      filter->Update();
      ASSERT_TRUE(messages.Errors.empty());
      ASSERT_EQ(messages.Warnings.size(), 1U);
      const std::string list = "LAD-2, LAD-" + std::to_string(twig);
      EXPECT_NE(messages.Warnings[0].find("2 bones lie outside"), std::string::npos);
      EXPECT_NE(messages.Warnings[0].find(list), std::string::npos) << messages.Warnings[0];
      vtkFieldData* field = filter->GetOutput()->GetFieldData();
      vtkDataArray* left = field->GetArray("LeftOutBones");
      ASSERT_NE(left, nullptr);
      ASSERT_EQ(left->GetNumberOfTuples(), 2);
      EXPECT_EQ(left->GetComponent(0, 0), far);
      EXPECT_EQ(left->GetComponent(1, 0), twig);
      auto* leftNames = vtkStringArray::SafeDownCast(field->GetAbstractArray("LeftOutBoneNames"));
      ASSERT_NE(leftNames, nullptr);
      EXPECT_EQ(leftNames->GetValue(1), "LAD-" + std::to_string(twig));
      EXPECT_NEAR(field->GetArray("BoneLengthOutside")->GetComponent(far, 0), 1.0, 1e-9);
      EXPECT_EQ(field->GetArray("BoneLengthOutside")->GetComponent(0, 0), 0.0);
      // The weights are those without these bones, in their old columns.
      vtkDataArray* weights = PointArray(filter->GetOutput(), "BoneWeights");
      ASSERT_EQ(weights->GetNumberOfComponents(), expected->GetNumberOfComponents() + 2);
      for (vtkIdType i = 0; i < weights->GetNumberOfTuples(); ++i)
      {
        for (int b = 0; b < weights->GetNumberOfComponents(); ++b)
        {
          const double value =
            b == far || b == twig ? 0.0 : expected->GetComponent(i, b > far ? b - 1 : b);
          ASSERT_EQ(weights->GetComponent(i, b), value) << i << ' ' << b;
        }
      }
    }
  }
  std::filesystem::remove_all(folder);
  // Nothing is left out, and nothing is said.
  plain->LeaveOutsideOn();
  const Messages messages(plain);
  plain->Update();
  EXPECT_TRUE(messages.Warnings.empty());
  EXPECT_EQ(plain->GetOutput()->GetFieldData()->GetArray("LeftOutBones")->GetNumberOfTuples(), 0);
  // All outside.
  SkinWeightInput nowhere = Comb();
  for (Vector3& joint : nowhere.joints)
  {
    joint += Vector3(100, 0, 0);
  }
  vtkNew<vtkBiharmonicSkinWeights> filter;
  filter->SetInputData(MeshOf(Comb()));
  filter->SetSkeletonData(SkeletonOf(nowhere));
  filter->LeaveOutsideOn();
  ExpectRefusal(filter, "All bones lie outside of the mesh");
}

TEST(BiharmonicSkinWeightsFilter, PiecesEmptyInputsAndAborts)
{
  vtkNew<vtkBiharmonicSkinWeights> filter;
  SetComb(filter);
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  filter->UpdatePiece(0, 2, 0);
  EXPECT_GT(filter->GetOutput()->GetNumberOfPoints(), 0);

  vtkNew<vtkBiharmonicSkinWeights> aborted;
  SetComb(aborted);
  UpdateAborted(aborted);
  EXPECT_EQ(aborted->GetOutput()->GetNumberOfPoints(), 0);
  aborted->Update();
  EXPECT_GT(aborted->GetOutput()->GetNumberOfPoints(), 0);

  vtkNew<vtkUnstructuredGrid> nothing;
  filter->SetInputData(nothing);
  const Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
}

TEST(BiharmonicSkinWeightsFilter, BlocksOneByOne)
{
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(0, MeshOf(Comb()));
  blocks->SetBlock(2, MeshOf(Comb()));
  vtkNew<vtkBiharmonicSkinWeights> filter;
  vtkNew<vtkCompositeDataPipeline> executive;
  filter->SetExecutive(executive);
  filter->SetInputDataObject(blocks);
  filter->SetSkeletonData(SkeletonOf(Comb()));
  filter->Update();
  auto* output = vtkMultiBlockDataSet::SafeDownCast(filter->GetOutputDataObject(0));
  ASSERT_NE(output, nullptr);
  for (const unsigned int b : { 0U, 2U })
  {
    auto* mesh = vtkUnstructuredGrid::SafeDownCast(output->GetBlock(b));
    ASSERT_NE(mesh, nullptr);
    EXPECT_NE(mesh->GetPointData()->GetArray("BoneIndices"), nullptr);
  }
}

TEST(BiharmonicSkinWeightsFilter, ReportsProgressWithoutGoingBack)
{
  vtkNew<vtkBiharmonicSkinWeights> filter;
  SetComb(filter);
  std::vector<double> reports;
  vtkNew<vtkCallbackCommand> observer;
  observer->SetClientData(&reports);
  observer->SetCallback([](vtkObject*, unsigned long, void* list, void* value)
    { static_cast<std::vector<double>*>(list)->push_back(*static_cast<double*>(value)); });
  filter->AddObserver(vtkCommand::ProgressEvent, observer);
  filter->Update();
  EXPECT_GT(reports.size(), 10U);
  EXPECT_TRUE(std::is_sorted(reports.begin(), reports.end()));
  EXPECT_LE(reports.back(), 1.0);
}

TEST(BiharmonicSkinWeightsFilter, PrintsItsSettings)
{
  vtkNew<vtkBiharmonicSkinWeights> filter;
  filter->DenseOn();
  std::ostringstream text;
  filter->Print(text);
  for (const char* name : { "Mode: 0", "Tolerance: 1e-06", "Iterations: 2000",
         "Neighbourhood: 1.75", "Influences: 8", "Dense: 1", "CacheFolder: " })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}

TEST(BiharmonicSkinWeightsFilterRefuses, BadMeshesAndSkeletons)
{
  const auto refuse = [](const std::string& part, const auto& change)
  {
    SkinWeightInput input = Comb();
    change(input);
    vtkNew<vtkBiharmonicSkinWeights> filter;
    filter->SetInputData(MeshOf(input));
    filter->SetSkeletonData(SkeletonOf(input));
    ExpectRefusal(filter, part);
  };
  refuse("lies outside of the mesh",
    [](auto& i)
    {
      i.joints.emplace_back(100, 0, 0);
      i.joints.emplace_back(101, 0, 0);
      i.bones.emplace_back(i.joints.size() - 2, i.joints.size() - 1);
    });
  refuse("both run through point",
    [](auto& i)
    {
      i.joints.emplace_back(0.75, 0, 0);
      i.joints.emplace_back(1.75, 0, 0);
      i.bones.emplace_back(i.joints.size() - 2, i.joints.size() - 1);
    });
  refuse("part of the mesh has no bone",
    [](auto& i)
    {
      const auto first = static_cast<std::int64_t>(i.points.size());
      for (const Vector3& p :
        { Vector3(50, 0, 0), Vector3(51, 0, 0), Vector3(50, 1, 0), Vector3(50, 0, 1) })
      {
        i.points.push_back(p);
      }
      i.tetrahedra.push_back({ first, first + 1, first + 2, first + 3 });
    });
  refuse("no bones", [](auto& i) { i.bones.clear(); });
  refuse("has no length", [](auto& i) { i.bones.emplace_back(0, 0); });
  refuse("same joints", [](auto& i) { i.bones.push_back(i.bones[0]); });
  refuse("not finite", [](auto& i) { i.points[3][0] = std::numeric_limits<double>::quiet_NaN(); });
  refuse("belongs to no tetrahedron", [](auto& i) { i.points.emplace_back(0, 0, 0.1); });
  refuse(
    "has no volume", [](auto& i) { i.points[i.tetrahedra[0][0]] = i.points[i.tetrahedra[0][1]]; });
}

TEST(BiharmonicSkinWeightsFilterRefuses, OtherCellsAndSettings)
{
  vtkNew<vtkBiharmonicSkinWeights> filter;
  SetComb(filter);
  auto mesh = MeshOf(Comb());
  const vtkIdType corners[3] = { 0, 1, 2 };
  mesh->InsertNextCell(VTK_TRIANGLE, 3, corners);
  filter->SetInputData(mesh);
  ExpectRefusal(filter, "is no tetrahedron");

  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuse = [](const std::string& part, const auto& change)
  {
    vtkNew<vtkBiharmonicSkinWeights> one;
    SetComb(one);
    change(one.Get());
    ExpectRefusal(one, part);
  };
  refuse("Mode", [](auto* f) { f->SetMode(4); });
  refuse("Tolerance", [=](auto* f) { f->SetTolerance(nan); });
  refuse("Iterations", [](auto* f) { f->SetIterations(0); });
  refuse("Neighbourhood", [](auto* f) { f->SetNeighbourhood(-1.0); });
  refuse("Influences", [](auto* f) { f->SetInfluences(65); });
}

TEST(BiharmonicSkinWeightsFilter, TooFewIterationsAreAWarning)
{
  vtkNew<vtkBiharmonicSkinWeights> filter;
  // Too large for the exact polish, which would not need them.
  const SkinWeightInput comb = coronary::MeshOfComb(9, 4, 8, 2, 0.5);
  filter->SetInputData(MeshOf(comb));
  filter->SetSkeletonData(SkeletonOf(comb));
  filter->SetIterations(3);
  filter->SetTolerance(1e-10);
  const Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.HasWarning("did not converge"));
  EXPECT_EQ(Field(filter->GetOutput(), "WeightsConverged"), 0.0);
}
}
