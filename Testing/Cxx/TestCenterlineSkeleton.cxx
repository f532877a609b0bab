// vtkCenterlineSkeleton through the VTK pipeline: arrays, names, pieces, blocks, refusals.
#include "vtkCenterlineSkeleton.h"

#include "FilterMessages.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkSkeletonPose.h"
#include "vtkTGFReader.h"
#include "vtkTGFWriter.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCompositeDataPipeline.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkIdTypeArray.h"
#include "vtkIntArray.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace TestCenterlineSkeleton
{
namespace
{
vtkSmartPointer<vtkPolyData> PhantomTree(int seed)
{
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetSeed(seed);
  source->Update(vtkCoronaryPhantomSource::TreePort);
  auto tree = vtkSmartPointer<vtkPolyData>::New();
  tree->ShallowCopy(source->GetOutputDataObject(vtkCoronaryPhantomSource::TreePort));
  return tree;
}

/// A trunk of 20 mm along z with two arms of 10 mm along x, radius 2.
vtkSmartPointer<vtkPolyData> Fork(const char* radiusName = "MaximumInscribedSphereRadius")
{
  auto fork = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  vtkNew<vtkDoubleArray> radius;
  radius->SetName(radiusName);
  for (const auto& p : std::vector<std::array<double, 3>>{
         { 0, 0, 0 }, { 0, 0, 8 }, { 0, 0, 20 }, { 10, 0, 20 }, { -10, 0, 20 } })
  {
    points->InsertNextPoint(p.data());
    radius->InsertNextValue(2.0);
  }
  vtkNew<vtkCellArray> lines;
  const vtkIdType trunk[3] = { 0, 1, 2 };
  const vtkIdType left[2] = { 2, 3 };
  const vtkIdType right[2] = { 2, 4 };
  lines->InsertNextCell(3, trunk);
  lines->InsertNextCell(2, left);
  lines->InsertNextCell(2, right);
  fork->SetPoints(points);
  fork->SetLines(lines);
  fork->GetPointData()->AddArray(radius);
  const auto ints = [&](const char* name, const std::array<int, 3>& values)
  {
    vtkNew<vtkIntArray> array;
    array->SetName(name);
    for (const int value : values)
    {
      array->InsertNextValue(value);
    }
    fork->GetCellData()->AddArray(array);
  };
  ints("GroupIds", { 7, 8, 9 });
  ints("ParentGroupIds", { -1, 7, 7 });
  return fork;
}

vtkDataArray* PointArray(vtkPolyData* data, const char* name)
{
  vtkDataArray* array = data->GetPointData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array;
}

vtkDataArray* CellArray(vtkPolyData* data, const char* name)
{
  vtkDataArray* array = data->GetCellData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array;
}

std::vector<std::string> NamesOf(vtkPolyData* skeleton)
{
  auto* names =
    vtkStringArray::SafeDownCast(skeleton->GetFieldData()->GetAbstractArray("BoneName"));
  std::vector<std::string> list;
  for (vtkIdType i = 0; names != nullptr && i < names->GetNumberOfValues(); ++i)
  {
    list.push_back(names->GetValue(i));
  }
  return list;
}

void ExpectRefusal(vtkCenterlineSkeleton* filter, const std::string& part)
{
  SCOPED_TRACE(part);
  ExpectFilterError(filter, part);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
}
}

TEST(CenterlineSkeleton, BonesOfAFork)
{
  const auto fork = Fork("Radius");
  const vtkMTimeType before = fork->GetMTime();
  vtkNew<vtkCenterlineSkeleton> filter;
  filter->SetInputData(fork);
  filter->Update();
  EXPECT_EQ(fork->GetMTime(), before);
  vtkPolyData* skeleton = filter->GetOutput();
  // 20 mm in bones of 6 mm: 4; arms of 10 mm: 2 each.
  ASSERT_EQ(skeleton->GetNumberOfLines(), 8);
  ASSERT_EQ(skeleton->GetNumberOfPoints(), 9);
  vtkDataArray* parent = PointArray(skeleton, "ParentJoint");
  vtkDataArray* abscissa = PointArray(skeleton, "Abscissas");
  EXPECT_EQ(parent->GetComponent(0, 0), -1.0);
  for (vtkIdType b = 0; b < 8; ++b)
  {
    vtkCell* bone = skeleton->GetCell(b);
    ASSERT_EQ(bone->GetNumberOfPoints(), 2);
    EXPECT_EQ(parent->GetComponent(bone->GetPointId(1), 0), bone->GetPointId(0));
    EXPECT_EQ(CellArray(skeleton, "BoneId")->GetComponent(b, 0), b);
    EXPECT_EQ(CellArray(skeleton, "GroupIds")->GetComponent(b, 0), b < 4 ? 7 : b < 6 ? 8 : 9);
    EXPECT_NEAR(CellArray(skeleton, "Length")->GetComponent(b, 0), 5.0, 1e-9);
    EXPECT_NEAR(abscissa->GetComponent(bone->GetPointId(1), 0) -
        abscissa->GetComponent(bone->GetPointId(0), 0),
      5.0, 1e-9);
  }
  EXPECT_EQ(PointArray(skeleton, "MaximumInscribedSphereRadius")->GetRange()[0], 2.0);
  EXPECT_EQ(NamesOf(skeleton),
    (std::vector<std::string>{ "branch7-1", "branch7-2", "branch7-3", "branch7-4", "branch8-1",
      "branch8-2", "branch9-1", "branch9-2" }));
}

TEST(CenterlineSkeleton, EveryStepOfASkeletonIsABone)
{
  vtkNew<vtkCenterlineSkeleton> filter;
  filter->SetInputData(Fork());
  filter->EveryStepOn();
  filter->Update();
  vtkPolyData* skeleton = filter->GetOutput();
  ASSERT_EQ(skeleton->GetNumberOfLines(), 4);
  vtkDataArray* length = CellArray(skeleton, "Length");
  EXPECT_EQ(length->GetComponent(0, 0), 8.0);
  EXPECT_EQ(length->GetComponent(1, 0), 12.0);
}

TEST(CenterlineSkeleton, ComesBackFromATgfFileBoneByBone)
{
  vtkNew<vtkCenterlineSkeleton> filter;
  filter->SetInputData(PhantomTree(5));
  vtkNew<vtkSkeletonPose> pose;
  pose->SetInputConnection(filter->GetOutputPort());
  pose->AddEdit(30, 20, 10, 0, 30, 1, 0, 0, 0.5, 10);
  pose->Update();
  const std::string path = testing::TempDir() + "/TestCenterlineSkeleton.tgf";
  for (vtkPolyData* skeleton : { filter->GetOutput(), pose->GetOutput() })
  {
    const vtkIdType bones = skeleton->GetNumberOfLines();
    ASSERT_GT(bones, 50);
    // Cells in another order, and one of them backwards: the ids count.
    vtkNew<vtkPolyData> shuffled;
    shuffled->ShallowCopy(skeleton);
    vtkNew<vtkCellArray> lines;
    vtkNew<vtkIntArray> ids;
    ids->SetName("BoneId");
    for (vtkIdType n = 0; n < bones; ++n)
    {
      const vtkIdType b = (n * 7 + 3) % bones;
      vtkCell* bone = skeleton->GetCell(b);
      const vtkIdType ends[2] = { bone->GetPointId(n == 4 ? 1 : 0),
        bone->GetPointId(n == 4 ? 0 : 1) };
      lines->InsertNextCell(2, ends);
      ids->InsertNextValue(static_cast<int>(b));
    }
    ASSERT_NE(bones % 7, 0);
    shuffled->SetLines(lines);
    shuffled->GetCellData()->Initialize();
    shuffled->GetCellData()->AddArray(ids);
    for (vtkPolyData* written : { skeleton, shuffled.Get() })
    {
      vtkNew<vtkTGFWriter> writer;
      writer->SetInputData(written);
      writer->SetFileName(path.c_str());
      ASSERT_EQ(writer->Write(), 1);
      vtkNew<vtkTGFReader> reader;
      reader->SetFileName(path.c_str());
      reader->Update();
      vtkPolyData* read = reader->GetOutput(vtkTGFReader::SkeletonPort);
      ASSERT_EQ(read->GetNumberOfPoints(), skeleton->GetNumberOfPoints());
      ASSERT_EQ(read->GetNumberOfLines(), bones);
      for (vtkIdType j = 0; j < read->GetNumberOfPoints(); ++j)
      {
        for (int c = 0; c < 3; ++c)
        {
          ASSERT_EQ(read->GetPoint(j)[c], skeleton->GetPoint(j)[c]) << j;
        }
        ASSERT_EQ(PointArray(read, "ParentJoint")->GetComponent(j, 0),
          PointArray(skeleton, "ParentJoint")->GetComponent(j, 0));
      }
      for (vtkIdType b = 0; b < bones; ++b)
      {
        ASSERT_EQ(read->GetCell(b)->GetPointId(0), skeleton->GetCell(b)->GetPointId(0)) << b;
        ASSERT_EQ(read->GetCell(b)->GetPointId(1), skeleton->GetCell(b)->GetPointId(1)) << b;
        ASSERT_EQ(CellArray(read, "BoneId")->GetComponent(b, 0), b);
      }
      EXPECT_EQ(read->GetCellData()->GetArray("ParentGroupIds"), nullptr);
      // A pose may begin with it.
      vtkNew<vtkSkeletonPose> again;
      again->SetInputData(filter->GetOutput());
      again->SetInputData(1, read);
      again->Update();
      EXPECT_EQ(again->GetOutput()->GetNumberOfLines(), bones);
    }
  }
  // Without ids, in the order of the lines; a loop is refused, and the old file stays.
  vtkNew<vtkPolyData> foreign;
  foreign->SetPoints(filter->GetOutput()->GetPoints());
  vtkNew<vtkCellArray> lines;
  for (const std::array<vtkIdType, 2>& bone :
    std::vector<std::array<vtkIdType, 2>>{ { 2, 5 }, { 5, 1 } })
  {
    lines->InsertNextCell(2, bone.data());
  }
  foreign->SetLines(lines);
  vtkNew<vtkTGFWriter> writer;
  writer->SetInputData(foreign);
  writer->SetFileName(path.c_str());
  EXPECT_EQ(writer->Write(), 1);
  const auto lastLines = [&]
  {
    std::ifstream file(path);
    std::string text;
    std::string line;
    while (std::getline(file, line))
    {
      if (line == "#")
      {
        text.clear();
        continue;
      }
      text += line;
      text += ";";
    }
    return text;
  };
  EXPECT_EQ(lastLines(), "3 6;6 2;");
  const vtkIdType closing[2] = { 1, 2 };
  lines->InsertNextCell(2, closing);
  foreign->Modified();
  Messages messages(writer);
  EXPECT_EQ(writer->Write(), 0);
  EXPECT_TRUE(messages.HasError("bone 2"));
  EXPECT_EQ(lastLines(), "3 6;6 2;");
  std::remove(path.c_str());
}

TEST(CenterlineSkeleton, PhantomTreesHaveNamedBonesOfTheWantedLength)
{
  for (const int seed : { 3, 12 })
  {
    vtkNew<vtkCenterlineSkeleton> filter;
    filter->SetInputData(PhantomTree(seed));
    filter->Update();
    vtkPolyData* skeleton = filter->GetOutput();
    const std::vector<std::string> names = NamesOf(skeleton);
    ASSERT_EQ(static_cast<vtkIdType>(names.size()), skeleton->GetNumberOfLines());
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
    EXPECT_EQ(std::count_if(names.begin(), names.end(),
                [](const std::string& name) { return name.rfind("branch", 0) == 0; }),
      0);
    // Two trees: a joint more than bones in each.
    EXPECT_EQ(skeleton->GetNumberOfPoints(), skeleton->GetNumberOfLines() + 2);
    EXPECT_EQ(CellArray(skeleton, "TreeIds")->GetRange()[1], 1.0);
    EXPECT_GT(CellArray(skeleton, "SegmentIds")->GetRange()[0], 0.0);
    EXPECT_LE(CellArray(skeleton, "Length")->GetRange()[1], 8.0 + 1e-9);
  }
}

TEST(CenterlineSkeleton, PiecesBeyondTheFirstAndEmptyInputsAreEmpty)
{
  vtkNew<vtkCenterlineSkeleton> filter;
  filter->SetInputData(Fork());
  filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  filter->UpdatePiece(0, 2, 0);
  EXPECT_EQ(filter->GetOutput()->GetNumberOfLines(), 8);

  vtkNew<vtkPolyData> nothing;
  filter->SetInputData(nothing);
  const Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
}

TEST(CenterlineSkeleton, BlocksOneByOne)
{
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(0, Fork());
  blocks->SetBlock(2, Fork());
  vtkNew<vtkCenterlineSkeleton> filter;
  vtkNew<vtkCompositeDataPipeline> executive;
  filter->SetExecutive(executive);
  filter->SetInputDataObject(blocks);
  filter->Update();
  auto* output = vtkMultiBlockDataSet::SafeDownCast(filter->GetOutputDataObject(0));
  ASSERT_NE(output, nullptr);
  for (const unsigned int b : { 0U, 2U })
  {
    auto* skeleton = vtkPolyData::SafeDownCast(output->GetBlock(b));
    ASSERT_NE(skeleton, nullptr);
    EXPECT_EQ(skeleton->GetNumberOfLines(), 8);
  }
}

TEST(CenterlineSkeleton, PrintsItsSettings)
{
  vtkNew<vtkCenterlineSkeleton> filter;
  std::ostringstream text;
  filter->Print(text);
  for (const char* name : { "MinimumLength: 3", "MaximumLength: 8", "RadiusFactor: 3",
         "SagittaRatio: 0.25", "EveryStep: 0" })
  {
    EXPECT_NE(text.str().find(name), std::string::npos) << name;
  }
}

TEST(CenterlineSkeletonRefuses, WhatIsNoTree)
{
  vtkNew<vtkCenterlineSkeleton> filter;
  filter->SetInputData(Fork("Calibre"));
  ExpectRefusal(filter, "no point array MaximumInscribedSphereRadius or Radius");

  auto fork = Fork();
  fork->GetCellData()->RemoveArray("ParentGroupIds");
  filter->SetInputData(fork);
  ExpectRefusal(filter, "vtkCoronaryTreeTopology");

  fork = Fork();
  fork->GetPoints()->SetPoint(1, 0.0, std::numeric_limits<double>::quiet_NaN(), 0.0);
  filter->SetInputData(fork);
  ExpectRefusal(filter, "finite");

  fork = Fork();
  fork->GetPoints()->SetPoint(3, 0.0, 0.0, 20.0);
  filter->SetInputData(fork);
  ExpectRefusal(filter, "ranch 8 has no length");
}

TEST(CenterlineSkeletonRefuses, SettingsOutOfRange)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuse = [](const std::string& part, const auto& change)
  {
    vtkNew<vtkCenterlineSkeleton> filter;
    filter->SetInputData(Fork());
    change(filter.Get());
    ExpectRefusal(filter, part);
  };
  refuse("MinimumLength", [](auto* f) { f->SetMinimumLength(0.0); });
  refuse("MaximumLength", [](auto* f) { f->SetMaximumLength(5.0); });
  refuse("RadiusFactor", [=](auto* f) { f->SetRadiusFactor(nan); });
  refuse("SagittaRatio", [](auto* f) { f->SetSagittaRatio(2.0); });
}
}
