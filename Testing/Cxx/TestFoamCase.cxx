// Case folders of OpenFOAM: VTK's reader opens them, and OpenFOAM's own check finds nothing.
#include "AtomicFile.h"
#include "FlowTestTubes.h"
#include "FoamCase.h"
#include "FoamMesh.h"
#include "Refusals.h"

#include "vtkCellArray.h"
#include "vtkCompositeDataIterator.h"
#include "vtkDataArraySelection.h"
#include "vtkDataSet.h"
#include "vtkInformation.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkOpenFOAMReader.h"
#include "vtkSmartPointer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <unistd.h>
#include <vector>

namespace TestFoamCase
{
namespace fs = std::filesystem;

namespace
{
std::string ReadText(const fs::path& path)
{
  std::ifstream file(path, std::ios::binary);
  return { std::istreambuf_iterator<char>(file), {} };
}

class FoamCases : public ::testing::Test
{
protected:
  void SetUp() override
  {
    if (!coronary::HasTetrahedralBackend(coronary::TetrahedralBackend::TetGen))
    {
      GTEST_SKIP() << "built without TetGen";
    }
    // OpenFOAM bears no blanks in paths.
    this->Folder = fs::temp_directory_path() / ("foam-case." + std::to_string(getpid()));
    coronary::LayeredMeshSettings settings;
    settings.layers = 3;
    settings.extension = 0.5;
    this->Mesh = coronary::MakeLayeredMesh(
      FlowFork(0.45), settings, { { 2, "inlet" }, { 3, "outlet_dLAD" }, { 4, "outlet_D1" } });
    coronary::FoamCase flow;
    flow.title = "A fork";
    flow.moving = true;
    flow.inflow = { 1e-6, 5e-7, -2e-7 };
    flow.outlets = { { "outlet_dLAD", 1e9, 1e9, 1e-10 }, { "outlet_D1", 2e9, 2e9, 0.0 } };
    flow.musclePressure = { 5000.0, 1000.0, 0.0 };
    flow.venousPressure = 600.0;
    flow.startPressure = 9000.0;
    for (const auto& [name, text] :
      coronary::FoamMeshFiles(this->Mesh.cells, this->Mesh.points, "wall"))
    {
      this->Put("constant/polyMesh/" + name, text);
    }
    for (const auto& [name, text] : coronary::FoamCaseFiles(flow))
    {
      this->Put(name, text);
    }
    for (const auto& [name, text] : coronary::FoamMotionPoints(this->Mesh.cells, this->Mesh.points))
    {
      this->Put("constant/boundaryData/" + name, text);
    }
  }

  void TearDown() override
  {
    if (!this->Folder.empty())
    {
      fs::remove_all(this->Folder);
    }
  }

  void Put(const std::string& name, const std::string& text) const
  {
    fs::create_directories((this->Folder / name).parent_path());
    coronary::WriteFileAtomically((this->Folder / name).string(), text);
  }

  int Run(const std::string& command) const
  {
    return std::system(("cd '" + this->Folder.string() +
      "' && : \"${WM_PROJECT_DIR:=/usr/share/openfoam}\" && export WM_PROJECT_DIR && " + command +
      " >stdout 2>stderr")
                         .c_str());
  }

  fs::path Folder;
  coronary::LayeredMesh Mesh;
};
}

TEST_F(FoamCases, VtksReaderOpensThem)
{
  vtkNew<vtkOpenFOAMReader> reader;
  reader->SetFileName((this->Folder / "case.foam").c_str());
  reader->UpdateInformation();
  reader->EnableAllPatchArrays();
  reader->EnableAllCellArrays();
  reader->Update();
  std::map<std::string, vtkIdType> cells;
  vtkSmartPointer<vtkCompositeDataIterator> blocks;
  blocks.TakeReference(reader->GetOutput()->NewIterator());
  for (blocks->InitTraversal(); !blocks->IsDoneWithTraversal(); blocks->GoToNextItem())
  {
    auto* block = vtkDataSet::SafeDownCast(blocks->GetCurrentDataObject());
    const char* name = blocks->GetCurrentMetaData()->Get(vtkCompositeDataSet::NAME());
    ASSERT_NE(block, nullptr);
    cells[name ? name : ""] = block->GetNumberOfCells();
  }
  EXPECT_EQ(cells["internalMesh"], this->Mesh.cells.cells);
  for (const auto& patch : this->Mesh.cells.patches)
  {
    EXPECT_EQ(cells[patch.name], patch.faces) << patch.name;
  }
}

TEST_F(FoamCases, OpenFoamsCheckFindsNothing)
{
  if (this->Run("command -v checkMesh") != 0)
  {
    GTEST_SKIP() << "OpenFOAM is not installed";
  }
  // Of the motion there is no frame here, and checkMesh does not ask for it.
  ASSERT_EQ(this->Run("checkMesh -allTopology"), 0) << ReadText(this->Folder / "stdout");
  const std::string text = ReadText(this->Folder / "stdout");
  EXPECT_NE(text.find("Mesh OK."), std::string::npos) << text;
  EXPECT_EQ(text.find("***"), std::string::npos) << text;
  // Our own check says the same.
  const auto quality = coronary::MeasurePolyhedra(this->Mesh.cells, this->Mesh.points);
  const auto number = [&](const std::string& before)
  {
    const std::size_t at = text.find(before);
    return at == std::string::npos ? -1.0 : std::strtod(text.c_str() + at + before.size(), nullptr);
  };
  EXPECT_NEAR(
    number("Mesh non-orthogonality Max: "), quality.maximumNonOrthogonality * 180.0 / M_PI, 1e-3);
  EXPECT_NEAR(number("average: "), quality.meanNonOrthogonality * 180.0 / M_PI, 1e-3);
  EXPECT_NEAR(number("Max skewness = "), quality.maximumSkewness, 1e-4);
  EXPECT_NEAR(1e9 * number("Total volume = "), quality.totalVolume, 1e-6 * quality.totalVolume);
}

TEST_F(FoamCases, AStoppedCaseWithMovingWallsGoesOn)
{
  if (this->Run("command -v pimpleFoam") != 0)
  {
    GTEST_SKIP() << "OpenFOAM is not installed";
  }
  // The fork sways by 0.4 mm in the time of a picture, twenty steps.
  for (const double time : { 0.0, 0.02, 0.04 })
  {
    std::vector<coronary::Vector3> moved = this->Mesh.points;
    for (coronary::Vector3& point : moved)
    {
      point.x() += 20.0 * time * point.z() / 24.0;
    }
    for (const auto& [name, text] :
      coronary::FoamMotionFrame(this->Mesh.cells, this->Mesh.points, moved, time))
    {
      this->Put("constant/boundaryData/" + name, text);
    }
  }
  const auto solve = [this](int steps)
  {
    return this->Run("sed -i -e 's/^endTime .*/endTime " + std::to_string(0.001 * steps) +
      ";/' -e 's/^writeInterval .*/writeInterval 0.002;/' system/controlDict && sh Allrun");
  };
  // Row of a time in what is written of a patch, by the start that came last.
  const auto row = [this](const std::string& what, const std::string& start)
  {
    const std::string text =
      ReadText(this->Folder / "postProcessing" / what / start / "surfaceFieldValue.dat");
    const std::size_t at = text.rfind('\t');
    return at == std::string::npos ? std::nan("") : std::strtod(text.c_str() + at, nullptr);
  };
  const std::vector<std::string> ends{ "flow_outlet_dLAD", "flow_outlet_D1", "pressure_inlet",
    "pressure_outlet_dLAD" };
  ASSERT_EQ(solve(8), 0) << ReadText(this->Folder / "log.solver");
  std::vector<double> whole;
  for (const std::string& end : ends)
  {
    whole.push_back(row(end, "0"));
  }
  // As if it had been killed while it wrote the third picture.
  fs::remove_all(this->Folder / "0.008");
  fs::resize_file(this->Folder / "0.006" / "p", fs::file_size(this->Folder / "0.006" / "p") / 2);
  ASSERT_EQ(solve(8), 0) << ReadText(this->Folder / "log.solver");
  EXPECT_NE(
    ReadText(this->Folder / "stderr").find("0.006 was not written to its end"), std::string::npos);
  EXPECT_TRUE(fs::exists(this->Folder / "0.008" / "U"));
  for (std::size_t k = 0; k < ends.size(); ++k)
  {
    EXPECT_NEAR(row(ends[k], "0.004"), whole[k], 1e-6 * std::abs(whole[k])) << ends[k];
  }
  // A finished case has nothing left to do.
  ASSERT_EQ(solve(8), 0) << ReadText(this->Folder / "log.solver");
}

TEST_F(FoamCases, CasesThatMakeNoSenseAreRefused)
{
  coronary::FoamCase flow;
  ExpectRefusal([&] { coronary::FoamCaseFiles(flow); }, "outlet");
  flow.outlets.push_back({ "outlet", 1.0, 0.0, 1.0 });
  ExpectRefusal([&] { coronary::FoamCaseFiles(flow); }, "outlet outlet");
  flow.outlets[0].distal = 1.0;
  flow.cycles = 1.33;
  ExpectRefusal([&] { coronary::FoamCaseFiles(flow); }, "whole parts of 20");
  flow.cycles = 1.0;
  flow.cycle = 0.0;
  ExpectRefusal([&] { coronary::FoamCaseFiles(flow); }, "positive");
}
}
