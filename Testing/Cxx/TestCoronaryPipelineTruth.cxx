// The truth that the program writes is that of the source, and VTK can read it.
#include "CoronaryPhantom.h"
#include "SeriesDescription.h"
#include "vtkCoronaryArrayNames.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkXMLPolyDataReader.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <unistd.h>
#include <utility>

namespace
{
namespace names = vtkCoronaryArrayNames;
using coronary::Vector3;

class TestCoronaryPipelineTruth : public ::testing::Test
{
protected:
  static void SetUpTestSuite()
  {
    Folder = std::filesystem::temp_directory_path() /
      ("coronary-pipeline-truth." + std::to_string(getpid()));
    const std::string command = std::string("\"") + DYNAMICCORONARY_PIPELINE +
      "\" phantom --quiet --seed 4 --fractions 0,0.35 --cycle-ms 900 --spacing 3 --window 0"
      " --surface-spacing 1 --centerline-spacing 1 --origin 0 0 0 --dimensions 4 4 4 --output \"" +
      Folder.string() + "\"";
    ASSERT_EQ(std::system(command.c_str()), 0);
  }

  static void TearDownTestSuite() { std::filesystem::remove_all(Folder); }

  static void Read(vtkXMLPolyDataReader* reader, const std::string& name)
  {
    reader->SetFileName((Folder / name).c_str());
    reader->Update();
    vtkPolyData* data = reader->GetOutput();
    ASSERT_GT(data->GetNumberOfPoints(), 0) << name;
    vtkDataArray* time = data->GetFieldData()->GetArray(names::PhaseTime);
    vtkDataArray* cycle = data->GetFieldData()->GetArray(names::CycleLength);
    ASSERT_TRUE(time && cycle) << name;
    EXPECT_EQ(time->GetComponent(0, 0), 0.35);
    EXPECT_EQ(cycle->GetComponent(0, 0), 0.9);
  }

  static coronary::PhantomSettings Settings()
  {
    coronary::PhantomSettings settings;
    settings.seed = 4;
    settings.cycleLength = 0.9;
    settings.surfaceSpacing = 1.0;
    settings.centerlineSpacing = 1.0;
    return settings;
  }

  static std::filesystem::path Folder;
};

std::filesystem::path TestCoronaryPipelineTruth::Folder;

TEST_F(TestCoronaryPipelineTruth, CenterlineIsExact)
{
  vtkNew<vtkXMLPolyDataReader> reader;
  ASSERT_NO_FATAL_FAILURE(Read(reader, "truth/centerline_01.vtp"));
  vtkPolyData* data = reader->GetOutput();
  const coronary::PhantomTree tree = coronary::CoronaryPhantom(Settings()).Tree(0.35);
  ASSERT_EQ(data->GetNumberOfPoints(), static_cast<vtkIdType>(tree.points.size()));
  ASSERT_EQ(data->GetNumberOfLines(), static_cast<vtkIdType>(tree.branches.size()));
  vtkDataArray* radius = data->GetPointData()->GetArray(names::Radius);
  vtkDataArray* velocity = data->GetPointData()->GetArray(names::Velocity);
  ASSERT_TRUE(radius && velocity);
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i)
  {
    ASSERT_EQ(Vector3(data->GetPoint(i)), tree.points[i]);
    ASSERT_EQ(radius->GetComponent(i, 0), tree.radius[i]);
    ASSERT_EQ(Vector3(velocity->GetTuple3(i)), tree.velocity[i]);
  }
  auto* labels =
    vtkStringArray::SafeDownCast(data->GetCellData()->GetAbstractArray(names::SegmentLabel));
  ASSERT_TRUE(labels);
  EXPECT_EQ(labels->GetValue(0), coronary::SegmentName(tree.branches[0].segmentId));
}

TEST_F(TestCoronaryPipelineTruth, SurfaceIsClosed)
{
  vtkNew<vtkXMLPolyDataReader> reader;
  ASSERT_NO_FATAL_FAILURE(Read(reader, "truth/surface_01.vtp"));
  vtkPolyData* data = reader->GetOutput();
  ASSERT_TRUE(data->GetCellData()->GetArray(names::CellEntityIds));
  // Every edge is used once in each direction.
  std::map<std::pair<vtkIdType, vtkIdType>, int> edges;
  for (vtkIdType cell = 0; cell < data->GetNumberOfCells(); ++cell)
  {
    vtkIdType count = 0;
    const vtkIdType* points = nullptr;
    data->GetCellPoints(cell, count, points);
    ASSERT_EQ(count, 3);
    for (int i = 0; i < 3; ++i)
    {
      ++edges[{ points[i], points[(i + 1) % 3] }];
    }
  }
  for (const auto& [edge, uses] : edges)
  {
    ASSERT_EQ(uses, 1);
    ASSERT_EQ(edges.count({ edge.second, edge.first }), 1u);
  }
}

TEST_F(TestCoronaryPipelineTruth, SeedsAreTheOstia)
{
  const coronary::SeriesDescription series =
    coronary::ReadSeriesDescription((Folder / "series.json").string());
  ASSERT_EQ(series.phases.size(), 2u);
  EXPECT_EQ(series.cycleMs, 900.0);
  // The heart is at rest in both phases, and which of them is quieter depends on the seed.
  const coronary::CoronaryPhantom phantom(Settings());
  const auto speed = [&](double t)
  {
    double sum = 0.0;
    for (const Vector3& velocity : phantom.Tree(t).velocity)
    {
      sum += velocity.norm();
    }
    return sum;
  };
  const auto ostia = phantom.Ostia(speed(0.0) <= speed(0.35) ? 0.0 : 0.35);
  ASSERT_EQ(series.seeds.size(), ostia.size());
  for (std::size_t i = 0; i < ostia.size(); ++i)
  {
    EXPECT_EQ(series.seeds[i].name, ostia[i].name);
    EXPECT_EQ(series.seeds[i].position, ostia[i].position);
  }
}
}
