// vtkFastMarchingCenterline through the VTK pipeline: the phantom from image to tree, real surfaces,
// arrays, refusals.
#include "vtkFastMarchingCenterline.h"

#include "CenterlineExtraction.h"
#include "FilterMessages.h"
#include "Geometry.h"
#include "SharedSurface.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkFrangiVesselness.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkIdList.h"
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
#include "vtkUnsignedCharArray.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace TestFastMarchingCenterline
{
using coronary::Vector3;

namespace
{
vtkSmartPointer<vtkPolyData> PointSet(const std::vector<Vector3>& positions)
{
  auto data = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  for (const Vector3& position : positions)
  {
    points->InsertNextPoint(position.data());
  }
  data->SetPoints(points);
  return data;
}

/// A straight vessel along x as mask and as HU.
vtkSmartPointer<vtkImageData> Vessel()
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(60, 24, 24);
  image->SetSpacing(0.5, 0.5, 0.5);
  vtkNew<vtkUnsignedCharArray> mask;
  mask->SetName("Mask");
  vtkNew<vtkFloatArray> hu;
  hu->SetName("HU");
  for (int k = 0; k < 24; ++k)
  {
    for (int j = 0; j < 24; ++j)
    {
      for (int i = 0; i < 60; ++i)
      {
        const double wall = 0.5 * std::hypot(j - 11.5, k - 11.5) - 1.6;
        mask->InsertNextValue(wall < 0.0 && i > 3 && i < 56 ? 1 : 0);
        hu->InsertNextValue(static_cast<float>(-100.0 + 250.0 * std::erfc(wall / 0.5)));
      }
    }
  }
  image->GetPointData()->SetScalars(mask);
  image->GetPointData()->AddArray(hu);
  return image;
}

int Statuses(vtkPolyData* data, const char* name, int index)
{
  auto* array = vtkIntArray::SafeDownCast(data->GetFieldData()->GetArray(name));
  return array && index < array->GetNumberOfValues() ? array->GetValue(index) : -1;
}
}

TEST(FastMarchingCenterline, ThePhantomsTreeFromItsImage)
{
  vtkNew<vtkCoronaryPhantomSource> phantom;
  phantom->SetSeed(21);
  phantom->SetSpacing(0.5, 0.5, 0.5);
  vtkNew<vtkFrangiVesselness> vesselness;
  vesselness->SetInputConnection(phantom->GetOutputPort(vtkCoronaryPhantomSource::ImagePort));
  vtkNew<vtkFastMarchingCenterline> filter;
  filter->SetInputConnection(vesselness->GetOutputPort());
  filter->SetSeedConnection(phantom->GetOutputPort(vtkCoronaryPhantomSource::OstiaPort));
  filter->SetIntensityConnection(phantom->GetOutputPort(vtkCoronaryPhantomSource::ImagePort));
  Messages messages(filter);
  filter->UpdateTimeStep(0.75);
  EXPECT_TRUE(messages.Errors.empty()) << messages.Errors.front();
  EXPECT_TRUE(messages.Warnings.empty()) << messages.Warnings.front();
  vtkPolyData* tree = filter->GetOutput(vtkFastMarchingCenterline::TreePort);
  phantom->GetOutputInformation(vtkCoronaryPhantomSource::TreePort)
    ->Set(vtkStreamingDemandDrivenPipeline::UPDATE_TIME_STEP(), 0.75);
  phantom->Update(vtkCoronaryPhantomSource::TreePort);
  auto* truth =
    vtkPolyData::SafeDownCast(phantom->GetOutputDataObject(vtkCoronaryPhantomSource::TreePort));
  ASSERT_GT(tree->GetNumberOfLines(), 15);
  EXPECT_EQ(Statuses(tree, "SeedStatus", 0), 0);
  EXPECT_EQ(Statuses(tree, "SeedStatus", 1), 0);

  // How much of the true vessels of 1.5 mm and more is found, and what is found that is not there.
  auto* radius =
    vtkDoubleArray::SafeDownCast(tree->GetPointData()->GetArray("MaximumInscribedSphereRadius"));
  auto* trueRadius =
    vtkDoubleArray::SafeDownCast(truth->GetPointData()->GetArray("MaximumInscribedSphereRadius"));
  ASSERT_NE(radius, nullptr);
  const auto nearest = [](vtkPolyData* data, const Vector3& p)
  {
    vtkIdType best = 0;
    double minimum = std::numeric_limits<double>::infinity();
    for (vtkIdType n = 0; n < data->GetNumberOfPoints(); ++n)
    {
      const double d = (Vector3(data->GetPoint(n)) - p).squaredNorm();
      if (d < minimum)
      {
        minimum = d;
        best = n;
      }
    }
    return std::make_pair(best, std::sqrt(minimum));
  };
  int found = 0;
  int all = 0;
  for (vtkIdType n = 0; n < truth->GetNumberOfPoints(); ++n)
  {
    if (trueRadius->GetValue(n) >= 0.75)
    {
      ++all;
      found += nearest(tree, Vector3(truth->GetPoint(n))).second < trueRadius->GetValue(n) ? 1 : 0;
    }
  }
  ASSERT_GT(all, 500);
  EXPECT_GT(found, 0.97 * all);
  int right = 0;
  double distance = 0.0;
  double error = 0.0;
  for (vtkIdType n = 0; n < tree->GetNumberOfPoints(); ++n)
  {
    const auto match = nearest(truth, Vector3(tree->GetPoint(n)));
    if (match.second < trueRadius->GetValue(match.first) + 0.25)
    {
      ++right;
      distance += match.second;
      error += std::abs(radius->GetValue(n) - trueRadius->GetValue(match.first));
    }
  }
  EXPECT_GT(right, 0.97 * static_cast<double>(tree->GetNumberOfPoints()));
  std::cout << "found " << found << " of " << all << ", right " << right << " of "
            << tree->GetNumberOfPoints() << ", distance " << distance / right << ", radius error "
            << error / right << '\n';
  EXPECT_LT(distance / right, 0.3);
  EXPECT_LT(error / right, 0.15);

  // VMTK's form: pieces of a line follow each other from root to tip.
  vtkPolyData* lines = filter->GetOutput(vtkFastMarchingCenterline::LinesPort);
  auto* ids = vtkIntArray::SafeDownCast(lines->GetCellData()->GetArray("CenterlineIds"));
  auto* tracts = vtkIntArray::SafeDownCast(lines->GetCellData()->GetArray("TractIds"));
  ASSERT_NE(ids, nullptr);
  ASSERT_NE(lines->GetCellData()->GetArray("Blanking"), nullptr);
  vtkNew<vtkIdList> before;
  vtkNew<vtkIdList> cell;
  for (vtkIdType c = 1; c < lines->GetNumberOfLines(); ++c)
  {
    if (ids->GetValue(c) == ids->GetValue(c - 1))
    {
      EXPECT_EQ(tracts->GetValue(c), tracts->GetValue(c - 1) + 1);
      lines->GetLines()->GetCellAtId(c - 1, before);
      lines->GetLines()->GetCellAtId(c, cell);
      EXPECT_EQ(Vector3(lines->GetPoint(before->GetId(before->GetNumberOfIds() - 1))),
        Vector3(lines->GetPoint(cell->GetId(0))));
    }
    else
    {
      EXPECT_EQ(tracts->GetValue(c), 0);
    }
  }
  // A tree with n tips has n - 1 more branches than its bifurcations' parents tell.
  vtkPolyData* forks = filter->GetOutput(vtkFastMarchingCenterline::BifurcationsPort);
  auto* daughters = vtkIntArray::SafeDownCast(forks->GetPointData()->GetArray("DaughterGroupIds"));
  int count = 2;
  for (vtkIdType n = 0; n < forks->GetNumberOfPoints(); ++n)
  {
    for (int k = 0; k < daughters->GetNumberOfComponents(); ++k)
    {
      count += daughters->GetTypedComponent(n, k) >= 0 ? 1 : 0;
    }
  }
  EXPECT_EQ(count, tree->GetNumberOfLines());
}

TEST(FastMarchingCenterline, MaskWithTargetsAndTheirStatus)
{
  vtkNew<vtkFastMarchingCenterline> filter;
  filter->SetInputDataObject(0, Vessel());
  filter->SetInputDataObject(1, PointSet({ Vector3(2.5, 5.75, 5.75) }));
  filter->SetInputDataObject(
    2, PointSet({ Vector3(27.0, 5.75, 5.75), Vector3(15.0, 0.5, 0.5), Vector3(0.0, 99.0, 0.0) }));
  filter->SetImageKind(vtkFastMarchingCenterline::MaskImage);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_TRUE(messages.HasWarning("target 1"));
  EXPECT_TRUE(messages.HasWarning("target 2"));
  vtkPolyData* tree = filter->GetOutput();
  ASSERT_EQ(tree->GetNumberOfLines(), 1);
  EXPECT_EQ(Statuses(tree, "TargetStatus", 0), static_cast<int>(coronary::EndStatus::Reached));
  EXPECT_EQ(
    Statuses(tree, "TargetStatus", 1), static_cast<int>(coronary::EndStatus::OutsideRegion));
  EXPECT_EQ(Statuses(tree, "TargetStatus", 2), static_cast<int>(coronary::EndStatus::OutsideImage));
  auto* texts =
    vtkStringArray::SafeDownCast(tree->GetFieldData()->GetAbstractArray("TargetMessage"));
  ASSERT_NE(texts, nullptr);
  EXPECT_EQ(texts->GetValue(0), "reached");
  EXPECT_EQ(vtkPolyData::SafeDownCast(filter->GetOutputDataObject(1))->GetNumberOfLines(), 1);
  for (vtkIdType n = 10; n < tree->GetNumberOfPoints() - 10; ++n)
  {
    EXPECT_NEAR(tree->GetPoint(n)[1], 5.75, 0.1);
    EXPECT_NEAR(
      tree->GetPointData()->GetArray("MaximumInscribedSphereRadius")->GetTuple1(n), 1.6, 0.15);
  }
}

TEST(FastMarchingCenterline, PointsThatAreSetAreAsGoodAsConnectedOnes)
{
  const Vector3 seed(2.5, 5.75, 5.75);
  const Vector3 target(27.0, 5.75, 5.75);
  vtkNew<vtkFastMarchingCenterline> connected;
  connected->SetInputDataObject(0, Vessel());
  connected->SetInputDataObject(1, PointSet({ seed }));
  connected->SetInputDataObject(2, PointSet({ target }));
  connected->SetImageKind(vtkFastMarchingCenterline::MaskImage);
  connected->Update();
  vtkNew<vtkFastMarchingCenterline> set;
  set->SetInputDataObject(0, Vessel());
  set->SetImageKind(vtkFastMarchingCenterline::MaskImage);
  {
    Messages messages(set);
    set->Update();
    EXPECT_TRUE(messages.HasError("no seed: connect"));
    set->SetSeedPoint(0, seed.x(), seed.y(), seed.z());
    EXPECT_TRUE(messages.HasError("no seed or target point 0"));
  }
  set->SetNumberOfSeedPoints(1);
  set->SetSeedPoint(0, seed.x(), seed.y(), seed.z());
  set->SetNumberOfTargetPoints(1);
  set->SetTargetPoint(0, target.x(), target.y(), target.z());
  Messages messages(set);
  set->Update();
  EXPECT_TRUE(messages.Errors.empty());
  ASSERT_GT(set->GetOutput()->GetNumberOfPoints(), 10);
  ASSERT_EQ(set->GetOutput()->GetNumberOfPoints(), connected->GetOutput()->GetNumberOfPoints());
  for (vtkIdType n = 0; n < set->GetOutput()->GetNumberOfPoints(); ++n)
  {
    EXPECT_EQ(Vector3(set->GetOutput()->GetPoint(n)), Vector3(connected->GetOutput()->GetPoint(n)));
  }
  // The same values again are no change.
  const vtkMTimeType before = set->GetMTime();
  set->SetNumberOfSeedPoints(1);
  set->SetSeedPoint(0, seed.x(), seed.y(), seed.z());
  EXPECT_EQ(set->GetMTime(), before);
}

TEST(FastMarchingCenterline, RefusalsAndEmptyInput)
{
  vtkNew<vtkFastMarchingCenterline> filter;
  vtkSmartPointer<vtkImageData> vessel = Vessel();
  filter->SetInputDataObject(0, vessel);
  filter->SetInputDataObject(1, PointSet({ Vector3(2.5, 5.75, 5.75) }));
  filter->SetSpeedExponent(20.0);
  {
    Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.HasError("SpeedExponent must be"));
    EXPECT_EQ(filter->GetOutput()->GetNumberOfPoints(), 0);
  }
  filter->SetSpeedExponent(2.0);
  filter->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, "NotThere");
  {
    Messages messages(filter);
    filter->Update();
    EXPECT_TRUE(messages.HasError("no point array"));
  }
  // Nothing in, nothing out: with the arrays, without an error.
  for (const bool noSeeds : { false, true })
  {
    vtkNew<vtkFastMarchingCenterline> other;
    vtkNew<vtkImageData> nothing;
    other->SetInputDataObject(0, noSeeds ? vessel.Get() : nothing.Get());
    other->SetInputDataObject(1, noSeeds ? PointSet({}) : PointSet({ Vector3(2.5, 5.75, 5.75) }));
    Messages messages(other);
    other->Update();
    EXPECT_TRUE(messages.Errors.empty());
    EXPECT_EQ(other->GetOutput()->GetNumberOfPoints(), 0);
    EXPECT_NE(other->GetOutput()->GetCellData()->GetArray("GroupIds"), nullptr);
    EXPECT_NE(other->GetOutput()->GetPointData()->GetArray("Confidence"), nullptr);
  }
}

TEST(FastMarchingCenterline, CoronariesOfTheVisibleHuman)
{
  vtkSmartPointer<vtkPolyData> surface =
    ReadSharedSurface("hra-coronaries/F_coronary_arteries.vtp");
  if (!surface)
  {
    GTEST_SKIP() << "no data in " << DYNAMICCORONARY_DATA_DIR;
  }
  // The highest point of each of the two components is near its ostium.
  vtkNew<vtkFastMarchingCenterline> filter;
  filter->SetInputDataObject(0, surface);
  std::vector<int> component(static_cast<std::size_t>(surface->GetNumberOfPoints()), -1);
  surface->BuildLinks();
  std::vector<Vector3> seeds;
  vtkNew<vtkIdList> cells;
  vtkNew<vtkIdList> points;
  for (vtkIdType start = 0; start < surface->GetNumberOfPoints(); ++start)
  {
    if (component[static_cast<std::size_t>(start)] >= 0)
    {
      continue;
    }
    std::vector<vtkIdType> stack{ start };
    component[static_cast<std::size_t>(start)] = static_cast<int>(seeds.size());
    Vector3 top(surface->GetPoint(start));
    std::size_t size = 0;
    while (!stack.empty())
    {
      const vtkIdType point = stack.back();
      stack.pop_back();
      ++size;
      const Vector3 p(surface->GetPoint(point));
      top = p[2] > top[2] ? p : top;
      surface->GetPointCells(point, cells);
      for (vtkIdType c = 0; c < cells->GetNumberOfIds(); ++c)
      {
        surface->GetCellPoints(cells->GetId(c), points);
        for (vtkIdType n = 0; n < points->GetNumberOfIds(); ++n)
        {
          int& mark = component[static_cast<std::size_t>(points->GetId(n))];
          if (mark < 0)
          {
            mark = static_cast<int>(seeds.size());
            stack.push_back(points->GetId(n));
          }
        }
      }
    }
    if (size > 10)
    {
      seeds.push_back(top);
    }
  }
  ASSERT_EQ(seeds.size(), 2u);
  filter->SetInputDataObject(1, PointSet(seeds));
  filter->SetSnapDistance(3.0);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  EXPECT_TRUE(messages.Warnings.empty()) << messages.Warnings.front();
  vtkPolyData* tree = filter->GetOutput();
  // Branches without a parent begin at their tree's seed, which may lie between two of them.
  auto* parents = vtkIntArray::SafeDownCast(tree->GetCellData()->GetArray("ParentGroupIds"));
  auto* trees = vtkIntArray::SafeDownCast(tree->GetCellData()->GetArray("TreeIds"));
  std::map<int, vtkIdType> roots;
  vtkNew<vtkIdList> line;
  for (vtkIdType c = 0; c < tree->GetNumberOfLines(); ++c)
  {
    if (parents->GetValue(c) == -1)
    {
      tree->GetLines()->GetCellAtId(c, line);
      EXPECT_EQ(roots.emplace(trees->GetValue(c), line->GetId(0)).first->second, line->GetId(0));
    }
  }
  EXPECT_EQ(roots.size(), 2u);
  EXPECT_GT(tree->GetNumberOfLines(), 10);
  // Every point of the wall belongs to a vessel with an axis.
  vtkDataArray* radius = tree->GetPointData()->GetArray("MaximumInscribedSphereRadius");
  int missed = 0;
  for (vtkIdType n = 0; n < surface->GetNumberOfPoints(); n += 7)
  {
    const Vector3 p(surface->GetPoint(n));
    double minimum = std::numeric_limits<double>::infinity();
    for (vtkIdType m = 0; m < tree->GetNumberOfPoints(); ++m)
    {
      minimum = std::min(minimum, (Vector3(tree->GetPoint(m)) - p).norm() / radius->GetTuple1(m));
    }
    missed += minimum > 2.5 ? 1 : 0;
  }
  const double share = 7.0 * missed / static_cast<double>(surface->GetNumberOfPoints());
  std::cout << tree->GetNumberOfLines() << " branches, " << 100.0 * share
            << " % of the wall without an axis\n";
  EXPECT_LT(share, 0.03);
}

TEST(FastMarchingCenterline, AortaAgreesWithVmtk)
{
  vtkSmartPointer<vtkPolyData> surface = ReadSharedSurface("vmtk-aorta/aorta-surface.vtp");
  vtkSmartPointer<vtkPolyData> theirs = ReadSharedSurface("vmtk-aorta/aorta-centerline.vtp");
  if (!surface || !theirs)
  {
    GTEST_SKIP() << "no data in " << DYNAMICCORONARY_DATA_DIR;
  }
  std::vector<Vector3> targets;
  Vector3 seed;
  vtkNew<vtkIdList> ids;
  for (vtkIdType c = 0; c < theirs->GetNumberOfLines(); ++c)
  {
    theirs->GetLines()->GetCellAtId(c, ids);
    seed = Vector3(theirs->GetPoint(ids->GetId(0)));
    targets.emplace_back(theirs->GetPoint(ids->GetId(ids->GetNumberOfIds() - 1)));
  }
  vtkNew<vtkFastMarchingCenterline> filter;
  filter->SetInputDataObject(0, surface);
  filter->SetInputDataObject(1, PointSet({ seed }));
  filter->SetInputDataObject(2, PointSet(targets));
  filter->SetSnapDistance(5.0);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
  vtkPolyData* tree = filter->GetOutput();
  ASSERT_GT(tree->GetNumberOfPoints(), 10);
  double sum = 0.0;
  for (vtkIdType n = 0; n < tree->GetNumberOfPoints(); ++n)
  {
    double minimum = std::numeric_limits<double>::infinity();
    for (vtkIdType m = 0; m < theirs->GetNumberOfPoints(); ++m)
    {
      minimum =
        std::min(minimum, (Vector3(theirs->GetPoint(m)) - Vector3(tree->GetPoint(n))).norm());
    }
    sum += minimum / static_cast<double>(tree->GetNumberOfPoints());
  }
  std::cout << tree->GetNumberOfLines() << " branches, mean distance " << sum << " mm\n";
  EXPECT_LT(sum, 0.5 * 0.879);
}
}
