// Trees as VMTK's lines and back, as functions and as an output of the topology; vtkTGFWriter and vtkTGFReader.
#include "FilterMessages.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkCoronaryTreeTopology.h"
#include "vtkTGFReader.h"
#include "vtkTGFWriter.h"
#include "vtkVmtkLines.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkIdList.h"
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

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace TestCenterlineConversion
{
namespace
{
using SDDP = vtkStreamingDemandDrivenPipeline;

vtkSmartPointer<vtkPolyData> PhantomTree()
{
  vtkNew<vtkCoronaryPhantomSource> source;
  source->SetSeed(3);
  source->Update(vtkCoronaryPhantomSource::TreePort);
  auto tree = vtkSmartPointer<vtkPolyData>::New();
  tree->ShallowCopy(source->GetOutputDataObject(vtkCoronaryPhantomSource::TreePort));
  return tree;
}

vtkSmartPointer<vtkPolyData> LinesOf(vtkPolyData* tree)
{
  auto lines = vtkSmartPointer<vtkPolyData>::New();
  vtkCoronary::ToVmtkLines(tree, lines);
  return lines;
}

vtkSmartPointer<vtkPolyData> TreeOf(vtkPolyData* lines, double tolerance = 1e-6)
{
  auto tree = vtkSmartPointer<vtkPolyData>::New();
  vtkCoronary::FromVmtkLines(lines, tolerance, tree);
  return tree;
}

/// What a branch is made of, by its group id: positions, radii, parent, name.
struct BranchContents
{
  std::vector<std::array<double, 4>> points;
  int parent = 0;
  int tree = 0;
  std::string name;

  bool operator==(const BranchContents& other) const
  {
    return this->points == other.points && this->parent == other.parent &&
      this->tree == other.tree && this->name == other.name;
  }
};

std::map<int, BranchContents> ContentsOf(vtkPolyData* data)
{
  std::map<int, BranchContents> contents;
  vtkDataArray* radius = data->GetPointData()->GetArray("MaximumInscribedSphereRadius");
  auto* names = vtkStringArray::SafeDownCast(data->GetCellData()->GetAbstractArray("SegmentLabel"));
  vtkNew<vtkIdList> ids;
  for (vtkIdType cell = 0; cell < data->GetNumberOfCells(); ++cell)
  {
    BranchContents branch;
    data->GetCellPoints(cell, ids);
    for (const vtkIdType id : *ids)
    {
      const double* p = data->GetPoint(id);
      branch.points.push_back({ p[0], p[1], p[2], radius->GetComponent(id, 0) });
    }
    const auto value = [&](const char* name)
    { return static_cast<int>(data->GetCellData()->GetArray(name)->GetComponent(cell, 0)); };
    branch.parent = value("ParentGroupIds");
    branch.tree = value("TreeIds");
    branch.name = names->GetValue(cell);
    contents[value("GroupIds")] = branch;
  }
  return contents;
}

void ExpectOneError(const Messages& messages, const std::string& text)
{
  ASSERT_EQ(messages.Errors.size(), 1U) << (messages.Errors.empty() ? "" : messages.Errors.back());
  EXPECT_NE(messages.Errors[0].find(text), std::string::npos) << messages.Errors[0];
}

std::string WorkFile(const std::string& name)
{
  return testing::TempDir() + "/TestCenterlineConversion-" + name;
}

std::string TextOf(const std::string& path)
{
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The positions of the joints in a TGF file, as text, and how many lines follow them.
std::vector<std::string> JointsOf(const std::string& path, int& bones)
{
  std::vector<std::string> joints;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && line != "#")
  {
    joints.push_back(line.substr(line.find(' ') + 1));
  }
  for (bones = 0; std::getline(file, line); ++bones)
  {
  }
  std::sort(joints.begin(), joints.end());
  return joints;
}
}

TEST(CenterlineConversion, TreesComeBackFromVmtkForm)
{
  const auto tree = PhantomTree();
  const auto lines = LinesOf(tree);
  vtkCellData* cells = lines->GetCellData();
  EXPECT_EQ(cells->GetArray("ParentGroupIds"), nullptr);
  for (const char* name : { "CenterlineIds", "TractIds", "GroupIds", "Blanking", "TreeIds" })
  {
    ASSERT_NE(cells->GetArray(name), nullptr) << name;
    EXPECT_EQ(cells->GetArray(name)->GetNumberOfTuples(), lines->GetNumberOfCells()) << name;
  }
  // A path for every tip, whole: each tract begins where the one before ends.
  vtkDataArray* parents = tree->GetCellData()->GetArray("ParentGroupIds");
  vtkDataArray* groups = tree->GetCellData()->GetArray("GroupIds");
  int tips = 0;
  for (vtkIdType cell = 0; cell < tree->GetNumberOfCells(); ++cell)
  {
    bool tip = true;
    for (vtkIdType other = 0; other < tree->GetNumberOfCells(); ++other)
    {
      tip = tip && parents->GetComponent(other, 0) != groups->GetComponent(cell, 0);
    }
    tips += tip ? 1 : 0;
  }
  EXPECT_EQ(cells->GetArray("CenterlineIds")->GetRange(0)[1] + 1, tips);
  vtkNew<vtkIdList> before;
  vtkNew<vtkIdList> here;
  for (vtkIdType cell = 0; cell < lines->GetNumberOfCells(); ++cell)
  {
    if (cells->GetArray("TractIds")->GetComponent(cell, 0) > 0)
    {
      lines->GetCellPoints(cell - 1, before);
      lines->GetCellPoints(cell, here);
      const std::array<double, 3> end = { lines->GetPoint(
                                            before->GetId(before->GetNumberOfIds() - 1))[0],
        lines->GetPoint(before->GetId(before->GetNumberOfIds() - 1))[1],
        lines->GetPoint(before->GetId(before->GetNumberOfIds() - 1))[2] };
      const double* start = lines->GetPoint(here->GetId(0));
      EXPECT_EQ(end, (std::array<double, 3>{ start[0], start[1], start[2] }));
    }
  }

  const auto back = TreeOf(lines);
  EXPECT_EQ(back->GetNumberOfPoints(), tree->GetNumberOfPoints());
  EXPECT_EQ(back->GetCellData()->GetArray("CenterlineIds"), nullptr);
  EXPECT_TRUE(ContentsOf(back) == ContentsOf(tree));
  // The shared points are shared again, and all arrays are there.
  for (int i = 0; i < tree->GetPointData()->GetNumberOfArrays(); ++i)
  {
    EXPECT_NE(
      back->GetPointData()->GetAbstractArray(tree->GetPointData()->GetArrayName(i)), nullptr)
      << tree->GetPointData()->GetArrayName(i);
  }
}

TEST(CenterlineConversion, TheTopologyGivesAndTakesVmtkLines)
{
  vtkNew<vtkCoronaryTreeTopology> topology;
  topology->SetInputData(PhantomTree());
  topology->Update();
  vtkPolyData* lines = topology->GetVmtkLines();
  EXPECT_TRUE(ContentsOf(TreeOf(lines)) == ContentsOf(topology->GetOutput()));
  EXPECT_NE(lines->GetFieldData()->GetAbstractArray("Dominance"), nullptr);
  // Paths on top of each other are one tree again.
  vtkNew<vtkCoronaryTreeTopology> again;
  again->SetInputData(lines);
  again->Update();
  EXPECT_TRUE(ContentsOf(again->GetOutput()) == ContentsOf(topology->GetOutput()));
  topology->UpdatePiece(1, 2, 0);
  EXPECT_EQ(topology->GetVmtkLines()->GetNumberOfCells(), 0);
}

TEST(CenterlineConversion, KeepsTheInputAndItsOrderOfBranches)
{
  // A daughter that stands before its parent, after a vertex cell.
  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  for (int i = 0; i < 4; ++i)
  {
    points->InsertNextPoint(i, 0.0, 0.0);
  }
  vtkNew<vtkCellArray> vertices;
  vertices->InsertNextCell({ 0 });
  vtkNew<vtkCellArray> lines;
  lines->InsertNextCell({ 1, 2, 3 });
  lines->InsertNextCell({ 0, 1 });
  data->SetPoints(points);
  data->SetVerts(vertices);
  data->SetLines(lines);
  const auto add = [](vtkDataSetAttributes* to, const char* name, const std::vector<int>& values)
  {
    vtkNew<vtkIntArray> array;
    array->SetName(name);
    for (const int value : values)
    {
      array->InsertNextValue(value);
    }
    to->AddArray(array);
  };
  add(data->GetPointData(), "MaximumInscribedSphereRadius", { 4, 3, 2, 1 });
  add(data->GetCellData(), "GroupIds", { -7, 5, 9 });
  add(data->GetCellData(), "ParentGroupIds", { -7, 9, -1 });
  add(data->GetCellData(), "Mark", { 70, 50, 90 });
  const auto vmtk = LinesOf(data);
  ASSERT_EQ(vmtk->GetNumberOfCells(), 2);
  vtkDataArray* mark = vmtk->GetCellData()->GetArray("Mark");
  EXPECT_EQ(mark->GetComponent(0, 0), 90.0);
  EXPECT_EQ(mark->GetComponent(1, 0), 50.0);
  const auto back = TreeOf(vmtk);
  EXPECT_EQ(back->GetNumberOfPoints(), 4);
  EXPECT_EQ(back->GetCellData()->GetArray("ParentGroupIds")->GetComponent(1, 0), 9.0);
  EXPECT_EQ(
    back->GetPointData()->GetArray("MaximumInscribedSphereRadius")->GetComponent(3, 0), 1.0);
}

TEST(CenterlineConversion, NothingOfNothing)
{
  vtkNew<vtkPolyData> nothing;
  EXPECT_EQ(LinesOf(nothing)->GetNumberOfCells(), 0);
}

TEST(CenterlineConversion, RefusesByName)
{
  const auto refuse = [](const auto& convert, const std::string& text)
  {
    try
    {
      convert();
      FAIL() << "no refusal: " << text;
    }
    catch (const std::invalid_argument& error)
    {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  };
  const auto without = [](const char* point, const char* cell)
  {
    auto tree = PhantomTree();
    tree->GetPointData()->RemoveArray(point);
    tree->GetCellData()->RemoveArray(cell);
    return tree;
  };
  refuse(
    [&] { LinesOf(without("MaximumInscribedSphereRadius", "")); }, "MaximumInscribedSphereRadius");
  refuse([&] { LinesOf(without("", "GroupIds")); }, "GroupIds");
  refuse([&] { LinesOf(without("", "ParentGroupIds")); }, "ParentGroupIds");
  const auto lines = LinesOf(PhantomTree());
  refuse([&] { TreeOf(lines, -1.0); }, "tolerance");
  vtkIntArray::SafeDownCast(lines->GetCellData()->GetArray("TractIds"))->SetValue(0, 9);
  refuse([&] { TreeOf(lines); }, "tract");
}

TEST(TGF, SkeletonsComeBack)
{
  const auto tree = PhantomTree();
  const std::string path = WorkFile("tree.tgf");
  vtkNew<vtkTGFWriter> writer;
  writer->SetInputData(tree);
  writer->SetFileName(path.c_str());
  EXPECT_EQ(writer->Write(), 1);

  vtkNew<vtkTGFReader> reader;
  reader->SetFileName(path.c_str());
  reader->SetRadius(0.25);
  reader->Update();
  vtkPolyData* read = reader->GetOutput();
  EXPECT_EQ(read->GetNumberOfPoints(), tree->GetNumberOfPoints());
  EXPECT_EQ(read->GetPointData()->GetArray("MaximumInscribedSphereRadius")->GetRange(0)[1], 0.25);
  double a[6];
  double b[6];
  tree->GetBounds(a);
  read->GetBounds(b);
  EXPECT_TRUE(std::equal(a, a + 6, b));

  // Written again, also by way of VMTK's form, they are the same joints and bones.
  int bones = 0;
  const std::vector<std::string> joints = JointsOf(path, bones);
  EXPECT_EQ(static_cast<vtkIdType>(joints.size()), tree->GetNumberOfPoints());
  const std::string again = WorkFile("again.tgf");
  writer->SetFileName(again.c_str());
  const vtkSmartPointer<vtkPolyData> lines = LinesOf(read);
  for (vtkPolyData* form : { read, lines.Get() })
  {
    writer->SetInputData(form);
    EXPECT_EQ(writer->Write(), 1);
    int bonesAgain = 0;
    EXPECT_EQ(JointsOf(again, bonesAgain), joints);
    EXPECT_EQ(bonesAgain, bones);
  }
  std::remove(path.c_str());
  std::remove(again.c_str());
}

TEST(TGF, RefusesByName)
{
  const std::string path = WorkFile("kept.tgf");
  std::ofstream(path) << "1 0 0 0\n2 1 0 0\n#\n1 3\n";
  {
    vtkNew<vtkTGFReader> reader;
    reader->SetFileName(path.c_str());
    const Messages messages(reader);
    reader->Update();
    ExpectOneError(messages, path);
  }
  {
    vtkNew<vtkTGFReader> reader;
    reader->SetFileName("/nowhere/skeleton.tgf");
    const Messages messages(reader);
    reader->Update();
    ExpectOneError(messages, "/nowhere/skeleton.tgf");
  }
  const std::string before = TextOf(path);
  vtkNew<vtkPolyData> nothing;
  const auto refuse = [&](vtkPolyData* data, const char* file)
  {
    vtkNew<vtkTGFWriter> writer;
    writer->SetInputData(data);
    writer->SetFileName(file);
    const Messages messages(writer);
    EXPECT_EQ(writer->Write(), 0);
    ExpectOneError(messages, file != nullptr ? file : "FileName");
  };
  refuse(nothing, path.c_str());
  EXPECT_EQ(TextOf(path), before);
  refuse(PhantomTree(), "/nowhere/skeleton.tgf");
  refuse(PhantomTree(), nullptr);
  std::remove(path.c_str());
}

TEST(TGF, PrintsAllSettings)
{
  std::ostringstream text;
  vtkNew<vtkTGFReader> reader;
  reader->Print(text);
  vtkNew<vtkTGFWriter> writer;
  writer->Print(text);
  for (const char* name : { "Tolerance", "FileName", "Radius" })
  {
    EXPECT_NE(text.str().find(std::string(name) + ":"), std::string::npos) << name;
  }
}
}
