// vtkVesselEdits through the VTK pipeline: the phantom's tree and a mask corrected, arrays, names, refusals.
#include "vtkVesselEdits.h"

#include "FilterMessages.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkCoronaryTreeTopology.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <string>

namespace TestVesselEdits
{
namespace
{
constexpr double Time = 0.75;

/// The phantom, its named tree, and its image around the left coronary artery.
struct Phantom
{
  vtkNew<vtkCoronaryPhantomSource> source;
  vtkNew<vtkCoronaryTreeTopology> topology;

  Phantom()
  {
    this->source->SetSeed(3);
    this->source->SetSpacing(0.6, 0.6, 0.6);
    this->source->UpdateInformation();
    vtkNew<vtkPolyData> tree;
    this->At(vtkCoronaryPhantomSource::TreePort);
    tree->ShallowCopy(this->source->GetOutputDataObject(vtkCoronaryPhantomSource::TreePort));
    this->topology->SetInputData(tree);
    this->topology->Update();
  }

  vtkDataObject* At(int port)
  {
    this->source->GetOutputInformation(port)->Set(
      vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), Time);
    this->source->Update(port);
    return this->source->GetOutputDataObject(port);
  }
};

Phantom& Heart()
{
  static Phantom phantom;
  return phantom;
}

vtkPolyData* Tree()
{
  return Heart().topology->GetOutput();
}

std::map<std::string, double> LengthsOf(vtkPolyData* tree)
{
  std::map<std::string, double> lengths;
  auto* labels =
    vtkStringArray::SafeDownCast(tree->GetCellData()->GetAbstractArray("SegmentLabel"));
  vtkDataArray* length = tree->GetCellData()->GetArray("Length");
  for (vtkIdType n = 0; labels && n < tree->GetNumberOfLines(); ++n)
  {
    lengths[labels->GetValue(n)] += length->GetTuple1(n);
  }
  return lengths;
}

/// Place of a vessel's point, as a share of its longest branch's points.
std::array<double, 3> PlaceOn(vtkPolyData* tree, const std::string& name, double share)
{
  auto* labels =
    vtkStringArray::SafeDownCast(tree->GetCellData()->GetAbstractArray("SegmentLabel"));
  std::array<double, 3> place{};
  vtkIdType longest = 0;
  for (vtkIdType n = 0; n < tree->GetNumberOfLines(); ++n)
  {
    vtkIdList* ids = tree->GetCell(n)->GetPointIds();
    if (name == std::string(labels->GetValue(n)) && ids->GetNumberOfIds() > longest)
    {
      longest = ids->GetNumberOfIds();
      tree->GetPoint(
        ids->GetId(static_cast<vtkIdType>(share * static_cast<double>(longest - 1))), place.data());
    }
  }
  EXPECT_GT(longest, 0) << name;
  return place;
}

std::string Json(const std::array<double, 3>& p)
{
  char text[120];
  std::snprintf(text, sizeof(text), "[%.6f, %.6f, %.6f]", p[0], p[1], p[2]);
  return text;
}

/// Both trees are the same in all arrays, bit by bit.
void ExpectSame(vtkPolyData* a, vtkPolyData* b)
{
  ASSERT_EQ(a->GetNumberOfPoints(), b->GetNumberOfPoints());
  ASSERT_EQ(a->GetNumberOfLines(), b->GetNumberOfLines());
  for (vtkIdType p = 0; p < a->GetNumberOfPoints(); ++p)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      EXPECT_EQ(a->GetPoint(p)[axis], b->GetPoint(p)[axis]);
    }
  }
  for (vtkDataSetAttributes* data : { static_cast<vtkDataSetAttributes*>(a->GetPointData()),
         static_cast<vtkDataSetAttributes*>(a->GetCellData()) })
  {
    vtkDataSetAttributes* other = data == a->GetPointData()
      ? static_cast<vtkDataSetAttributes*>(b->GetPointData())
      : static_cast<vtkDataSetAttributes*>(b->GetCellData());
    ASSERT_EQ(data->GetNumberOfArrays(), other->GetNumberOfArrays());
    for (int n = 0; n < data->GetNumberOfArrays(); ++n)
    {
      vtkDataArray* one = data->GetArray(n);
      vtkDataArray* two = other->GetArray(one ? one->GetName() : "");
      for (vtkIdType v = 0; one && two && v < one->GetNumberOfValues(); ++v)
      {
        ASSERT_EQ(one->GetVariantValue(v).ToDouble(), two->GetVariantValue(v).ToDouble())
          << one->GetName();
      }
    }
  }
}

TEST(VesselEdits, WithoutEditsTheTreeGoesOn)
{
  vtkNew<vtkVesselEdits> edits;
  edits->SetInputData(Tree());
  edits->Update();
  ExpectSame(vtkPolyData::SafeDownCast(edits->GetOutputDataObject(0)), Tree());
  EXPECT_EQ(edits->GetBifurcations()->GetNumberOfPoints(),
    Heart().topology->GetBifurcations()->GetNumberOfPoints());
}

TEST(VesselEdits, NamesAndAllElseStayWhereNothingIsEdited)
{
  vtkNew<vtkVesselEdits> edits;
  edits->SetInputData(Tree());
  edits->AddEdit(R"({"edit": "rename", "name": "D1", "new_name": "D2"})");
  edits->AddEdit(R"({"edit": "rename", "name": "D2", "new_name": "D1"})");
  edits->Update();
  auto* output = vtkPolyData::SafeDownCast(edits->GetOutputDataObject(0));
  std::map<std::string, double> before = LengthsOf(Tree());
  std::map<std::string, double> after = LengthsOf(output);
  // Both diagonals have one name then.
  before["D1"] += before["D2"];
  before.erase("D2");
  ASSERT_EQ(before.size(), after.size());
  for (const auto& [name, length] : before)
  {
    EXPECT_NEAR(length, after[name], 1e-6) << name;
  }
  EXPECT_EQ(output->GetNumberOfPoints(), Tree()->GetNumberOfPoints());
  EXPECT_TRUE(output->GetFieldData()->HasArray("HeartFrame"));
  vtkDataArray* numbers = output->GetPointData()->GetArray("EditNumber");
  ASSERT_NE(numbers, nullptr);
  EXPECT_EQ(numbers->GetRange()[1], 2.0);
  auto* notes = vtkStringArray::SafeDownCast(output->GetFieldData()->GetAbstractArray("EditNotes"));
  ASSERT_NE(notes, nullptr);
  EXPECT_EQ(notes->GetNumberOfValues(), 2);
}

TEST(VesselEdits, ALostBranchIsDrawnInTheImage)
{
  vtkNew<vtkImageData> image;
  image->ShallowCopy(Heart().At(vtkCoronaryPhantomSource::ImagePort));
  const std::array<double, 3> start = PlaceOn(Tree(), "D1", 0.0);
  const std::array<double, 3> middle = PlaceOn(Tree(), "D1", 0.5);
  const std::array<double, 3> tip = PlaceOn(Tree(), "D1", 0.95);
  vtkNew<vtkVesselEdits> edits;
  edits->SetInputData(Tree());
  edits->SetInputData(1, image);
  edits->AddEdit(R"({"edit": "delete", "name": "D1"})");
  edits->Update();
  auto* output = vtkPolyData::SafeDownCast(edits->GetOutputDataObject(0));
  EXPECT_EQ(LengthsOf(output).count("D1"), 0U);
  vtkNew<vtkPolyData> without;
  without->DeepCopy(output);

  edits->SetKind(vtkVesselEdits::AddBranchEdit);
  edits->SetNumberOfPoints(3);
  edits->SetPoint(0, start[0], start[1], start[2]);
  edits->SetPoint(1, middle[0], middle[1], middle[2] + 0.5);
  edits->SetPoint(2, tip[0] + 0.4, tip[1], tip[2]);
  edits->Update();
  output = vtkPolyData::SafeDownCast(edits->GetOutputDataObject(0));
  // The name is found, since it is free.
  std::map<std::string, double> lengths = LengthsOf(output);
  std::map<std::string, double> truth = LengthsOf(Tree());
  EXPECT_NEAR(lengths["D1"], 0.95 * truth["D1"], 3.0);
  EXPECT_NEAR(lengths["pLAD"], truth["pLAD"], 2.0);
  // Where it was.
  vtkDataArray* numbers = output->GetPointData()->GetArray("EditNumber");
  double sum = 0.0;
  int count = 0;
  for (vtkIdType p = 0; p < output->GetNumberOfPoints(); ++p)
  {
    if (numbers->GetTuple1(p) == 2.0)
    {
      double nearest[3];
      Tree()->GetPoint(Tree()->FindPoint(output->GetPoint(p)), nearest);
      const double* at = output->GetPoint(p);
      sum += std::hypot(at[0] - nearest[0], at[1] - nearest[1], at[2] - nearest[2]);
      ++count;
    }
  }
  EXPECT_GT(count, 40);
  EXPECT_LT(sum / count, 0.5);
  EXPECT_GT(output->GetFieldData()->GetArray("EditSeen")->GetTuple1(1), 0.7);

  // Undone: to the bit as before it.
  EXPECT_NE(std::string(edits->GetCurrentEdit()).find("add-branch"), std::string::npos);
  edits->SetKind(vtkVesselEdits::NoEdit);
  edits->Update();
  ExpectSame(vtkPolyData::SafeDownCast(edits->GetOutputDataObject(0)), without);
}

TEST(VesselEdits, AFileAndAListAreOneList)
{
  const std::string path = testing::TempDir() + "vessel-edits.json";
  vtkNew<vtkVesselEdits> edits;
  edits->SetInputData(Tree());
  edits->AddEdit(R"({"edit": "delete", "name": "D1"})");
  std::ofstream(path) << edits->GetEditsText();
  edits->RemoveAllEdits();
  edits->SetFileName(path.c_str());
  edits->AddEdit(
    ("{\"edit\": \"cut\", \"points\": [" + Json(PlaceOn(Tree(), "mRCA", 0.5)) + "]}").c_str());
  edits->Update();
  auto* output = vtkPolyData::SafeDownCast(edits->GetOutputDataObject(0));
  std::map<std::string, double> lengths = LengthsOf(output);
  EXPECT_EQ(lengths.count("D1"), 0U);
  EXPECT_EQ(lengths.count("dRCA"), 0U);
  EXPECT_LT(lengths["mRCA"], LengthsOf(Tree())["mRCA"]);
  // A trunk that ends in full calibre is said.
  EXPECT_TRUE(output->GetFieldData()->HasArray("Warnings"));
  std::remove(path.c_str());
  edits->Modified();
  ExpectFilterError(edits, path);
}

TEST(VesselEdits, AMaskIsPaintedAndErased)
{
  vtkNew<vtkImageData> mask;
  mask->SetDimensions(40, 40, 40);
  mask->SetSpacing(0.5, 0.5, 0.5);
  mask->SetOrigin(-10.0, -10.0, -10.0);
  mask->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  mask->GetPointData()->GetScalars()->SetName("VesselMask");
  mask->GetPointData()->GetScalars()->Fill(0.0);
  vtkNew<vtkVesselEdits> edits;
  edits->SetInputData(mask);
  edits->AddEdit(R"({"edit": "paint", "points": [[0, 0, 0]], "radius": 3})");
  edits->AddEdit(R"({"edit": "delete", "name": "D1"})"); // of the tree: nothing here
  edits->Update();
  auto* painted = vtkImageData::SafeDownCast(edits->GetOutputDataObject(0));
  ASSERT_NE(painted, nullptr);
  const auto volume = [](vtkImageData* image)
  {
    double sum = 0.0;
    for (vtkIdType v = 0; v < image->GetNumberOfPoints(); ++v)
    {
      sum += 0.125 * image->GetPointData()->GetArray("VesselMask")->GetTuple1(v);
    }
    return sum;
  };
  EXPECT_NEAR(volume(painted), 4.0 / 3.0 * M_PI * 27.0, 4.0);
  EXPECT_EQ(volume(mask), 0.0); // the input is as it was
  EXPECT_EQ(edits->GetBifurcations()->GetNumberOfPoints(), 0);
  edits->SetKind(vtkVesselEdits::EraseEdit);
  edits->SetNumberOfPoints(1);
  edits->SetPoint(0, 9.0, 9.0, 9.0);
  edits->SetRadius(1.0);
  ExpectFilterError(edits, "dit 3 (erase): nothing of the mask is around (9.0, 9.0, 9.0)");
}

TEST(VesselEdits, Refusals)
{
  vtkNew<vtkVesselEdits> edits;
  edits->SetInputData(Tree());
  edits->AddEdit(R"({"edit": "cut", "points": [[1000, 0, 0]]})");
  ExpectFilterError(edits, "dit 1 (cut): no vessel of the tree is within");
  EXPECT_EQ(vtkPolyData::SafeDownCast(edits->GetOutputDataObject(0))->GetNumberOfPoints(), 0);
  edits->RemoveAllEdits();
  edits->AddEdit("{");
  ExpectFilterError(edits, "not JSON");
  edits->RemoveAllEdits();
  edits->SetKind(vtkVesselEdits::JoinEdit);
  ExpectFilterError(edits, "2 points, not 0");
  edits->SetKind(vtkVesselEdits::NoEdit);
  // An empty tree is a normal piece of a pipeline.
  vtkNew<vtkPolyData> empty;
  edits->SetInputData(empty);
  edits->Update();
  EXPECT_EQ(vtkPolyData::SafeDownCast(edits->GetOutputDataObject(0))->GetNumberOfPoints(), 0);
}
}
}
