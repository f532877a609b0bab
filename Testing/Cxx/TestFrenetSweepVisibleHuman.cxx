// vtkFrenetSweepSurface on coronary arteries of people: foreign surfaces are cleaned, their
// centerlines found, and swept.
#include "vtkFrenetSweepSurface.h"

#include "FilterMessages.h"
#include "Instrumented.h"
#include "SharedSurface.h"
#include "SurfaceMeasures.h"
#include "TriangleBvh.h"
#include "TriangleIntersections.h"
#include "vtkFastMarchingCenterline.h"
#include "vtkSurfaceCleaner.h"

#include "vtkCellArray.h"
#include "vtkDataArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkPolyDataConnectivityFilter.h"
#include "vtkSmartPointer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>
#include <map>
#include <string>
#include <vector>

namespace TestFrenetSweepVisibleHuman
{
namespace
{
using coronary::Vector3;

/// The highest point of each component, which is near its ostium.
vtkSmartPointer<vtkPolyData> HighestPoints(vtkPolyData* surface)
{
  vtkNew<vtkPolyDataConnectivityFilter> components;
  components->SetInputData(surface);
  components->SetExtractionModeToAllRegions();
  components->ColorRegionsOn();
  components->Update();
  vtkPolyData* colored = components->GetOutput();
  vtkDataArray* region = colored->GetPointData()->GetArray("RegionId");
  std::map<int, Vector3> highest;
  for (vtkIdType i = 0; i < colored->GetNumberOfPoints(); ++i)
  {
    const Vector3 p(colored->GetPoint(i));
    Vector3& top = highest.emplace(static_cast<int>(region->GetTuple1(i)), p).first->second;
    top = p[2] > top[2] ? p : top;
  }
  auto seeds = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  for (const auto& entry : highest)
  {
    points->InsertNextPoint(entry.second.data());
  }
  seeds->SetPoints(points);
  return seeds;
}

void SweepCoronaries(const std::string& name)
{
  vtkSmartPointer<vtkPolyData> given = ReadSharedSurface("hra-coronaries/" + name);
  if (!given)
  {
    GTEST_SKIP() << "no data in " << DYNAMICCORONARY_DATA_DIR;
  }
  vtkNew<vtkSurfaceCleaner> cleaner;
  cleaner->SetInputData(given);
  cleaner->Update();
  const auto seeds = HighestPoints(cleaner->GetOutput());
  ASSERT_EQ(seeds->GetNumberOfPoints(), 2);
  vtkNew<vtkFastMarchingCenterline> centerlines;
  centerlines->SetInputConnection(0, cleaner->GetOutputPort());
  centerlines->SetInputDataObject(1, seeds);
  centerlines->SetSnapDistance(3.0);
  centerlines->Update();
  ASSERT_GT(centerlines->GetOutput()->GetNumberOfLines(), 10);

  vtkNew<vtkFrenetSweepSurface> sweep;
  sweep->SetInputConnection(centerlines->GetOutputPort());
  Messages messages(sweep);
  const std::clock_t start = std::clock();
  sweep->Update();
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  EXPECT_TRUE(messages.Errors.empty()) << messages.Errors.front();
  for (const std::string& warning : messages.Warnings)
  {
    std::cout << warning << "\n";
  }

  vtkPolyData* surface = sweep->GetOutput();
  std::vector<Vector3> points;
  std::vector<coronary::Triangle> triangles;
  std::vector<double> wanted;
  vtkDataArray* lengths = surface->GetPointData()->GetArray("EdgeLength");
  for (vtkIdType i = 0; i < surface->GetNumberOfPoints(); ++i)
  {
    points.emplace_back(surface->GetPoint(i));
    wanted.push_back(lengths->GetTuple1(i));
  }
  vtkNew<vtkIdList> ids;
  for (vtkIdType c = 0; c < surface->GetNumberOfPolys(); ++c)
  {
    surface->GetPolys()->GetCellAtId(c, ids);
    triangles.push_back({ ids->GetId(0), ids->GetId(1), ids->GetId(2) });
  }
  const auto measures = coronary::MeasureSurface(points, triangles);
  EXPECT_TRUE(measures.Closed());
  EXPECT_TRUE(measures.Manifold());
  EXPECT_EQ(measures.unusedPoints, 0U);
  EXPECT_EQ(measures.components, 2);
  EXPECT_EQ(measures.eulerCharacteristic, 4);
  EXPECT_GT(measures.volume, 0.0);
  EXPECT_TRUE(coronary::FindSelfIntersections(points, triangles).empty());
  EXPECT_GE(measures.WorstAngle(), 10.0);
  EXPECT_LE(measures.ShareBelow(20.0), 0.005);
  const auto edges = coronary::RelativeEdgeLengths(points, triangles, wanted);
  const auto good =
    std::count_if(edges.begin(), edges.end(), [](double e) { return std::abs(e - 1.0) <= 0.3; });
  EXPECT_GE(static_cast<double>(good), 0.95 * static_cast<double>(edges.size()));
#ifdef NDEBUG
  if (!coronary::Instrumented)
  {
    EXPECT_LE(seconds, 10.0);
  }
#endif

  // What was swept is what was given: half of its wall's points are within a fifth of a radius of
  // the new wall, whose sections are circles of the inscribed radius, and few are far away.
  vtkDataArray* radii =
    centerlines->GetOutput()->GetPointData()->GetArray("MaximumInscribedSphereRadius");
  double sum = 0.0;
  for (vtkIdType i = 0; i < radii->GetNumberOfTuples(); ++i)
  {
    sum += radii->GetTuple1(i) / static_cast<double>(radii->GetNumberOfTuples());
  }
  const coronary::TriangleBvh tree(points, triangles);
  std::vector<double> away;
  vtkPolyData* clean = cleaner->GetOutput();
  for (vtkIdType i = 0; i < clean->GetNumberOfPoints(); i += 7)
  {
    away.push_back(tree.Closest(Vector3(clean->GetPoint(i))).distance / sum);
  }
  std::sort(away.begin(), away.end());
  std::cout << name << ": " << triangles.size() << " triangles, smallest angle "
            << measures.WorstAngle() << ", " << 100.0 * measures.ShareBelow(20.0) << " % below 20, "
            << 100.0 * static_cast<double>(good) / edges.size() << " % of the edges good, "
            << seconds << " s; given wall away in mean radii: half " << away[away.size() / 2]
            << ", 90 % " << away[away.size() * 9 / 10] << "\n";
  EXPECT_LT(away[away.size() / 2], 0.2);
  EXPECT_LT(away[away.size() * 9 / 10], 1.0);
}
}

TEST(FrenetSweepVisibleHuman, Female)
{
  SweepCoronaries("F_coronary_arteries.vtp");
}

TEST(FrenetSweepVisibleHuman, Male)
{
  SweepCoronaries("M_coronary_arteries.vtp");
}
}
