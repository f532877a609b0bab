// vtkCoronaryPhantomSource through the VTK pipeline: time, extents, pieces, ports, abort, errors.
#include "vtkCoronaryPhantomSource.h"

#include "CoronaryPhantom.h"
#include "FilterMessages.h"
#include "ParallelFor.h"

#include "vtkCallbackCommand.h"
#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkMatrix3x3.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkStructuredGrid.h"
#include "vtkXMLDataElement.h"
#include "vtkXMLUtilities.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace TestCoronaryPhantomSource
{
namespace
{
using Source = vtkCoronaryPhantomSource;
using SDDP = vtkStreamingDemandDrivenPipeline;

constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

/// A phantom that is cheap to compute: its image is a small block around the left main artery.
vtkSmartPointer<Source> MakeSource()
{
  auto source = vtkSmartPointer<Source>::New();
  source->AutomaticGridOff();
  source->SetOrigin(-20.0, -25.0, -30.0);
  source->SetDimensions(40, 42, 36);
  source->SetSpacing(1.0, 1.0, 1.0);
  source->SetSurfaceSpacing(1.5);
  source->SetCenterlineSpacing(2.0);
  return source;
}

coronary::PhantomSettings SettingsOf(Source* source)
{
  coronary::PhantomSettings settings;
  settings.surfaceSpacing = source->GetSurfaceSpacing();
  settings.centerlineSpacing = source->GetCenterlineSpacing();
  return settings;
}

vtkDataObject* Request(Source* source, int port, double time)
{
  source->UpdateInformation();
  source->GetOutputInformation(port)->Set(SDDP::UPDATE_TIME_STEP(), time);
  source->Update(port);
  return source->GetOutputDataObject(port);
}

vtkPointSet* RequestPoints(Source* source, int port, double time)
{
  return vtkPointSet::SafeDownCast(Request(source, port, time));
}

vtkImageData* RequestImage(Source* source, double time)
{
  return vtkImageData::SafeDownCast(Request(source, Source::ImagePort, time));
}

std::vector<double> Flat(vtkDataArray* array)
{
  std::vector<double> values;
  if (!array)
  {
    return values;
  }
  for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i)
  {
    for (int c = 0; c < array->GetNumberOfComponents(); ++c)
    {
      values.push_back(array->GetComponent(i, c));
    }
  }
  return values;
}

std::vector<double> Voxels(vtkImageData* image)
{
  return Flat(image->GetPointData()->GetScalars());
}

std::vector<double> Positions(vtkPointSet* points)
{
  return Flat(points->GetPoints()->GetData());
}

double FieldValue(vtkDataObject* data, const char* name)
{
  vtkDataArray* array = data->GetFieldData()->GetArray(name);
  return array && array->GetNumberOfValues() == 1 ? array->GetComponent(0, 0) : NaN;
}

struct Column
{
  const char* name;
  int type;
  int components;
};

void ExpectColumns(vtkDataSetAttributes* attributes, const std::vector<Column>& columns)
{
  EXPECT_EQ(attributes->GetNumberOfArrays(), static_cast<int>(columns.size()));
  for (const Column& column : columns)
  {
    SCOPED_TRACE(column.name);
    vtkAbstractArray* array = attributes->GetAbstractArray(column.name);
    ASSERT_NE(array, nullptr);
    EXPECT_EQ(array->GetDataType(), column.type);
    EXPECT_EQ(array->GetNumberOfComponents(), column.components);
  }
}

void ExpectTreeColumns(vtkPolyData* tree)
{
  ExpectColumns(tree->GetPointData(),
    { { "MaximumInscribedSphereRadius", VTK_DOUBLE, 1 }, { "Abscissas", VTK_DOUBLE, 1 },
      { "SegmentIds", VTK_INT, 1 }, { "Displacement", VTK_DOUBLE, 3 },
      { "Velocity", VTK_DOUBLE, 3 }, { "Visibility", VTK_DOUBLE, 1 } });
  ExpectColumns(tree->GetCellData(),
    { { "GroupIds", VTK_INT, 1 }, { "ParentGroupIds", VTK_INT, 1 }, { "TreeIds", VTK_INT, 1 },
      { "BranchGeneration", VTK_INT, 1 }, { "StrahlerOrder", VTK_INT, 1 },
      { "SegmentIds", VTK_INT, 1 }, { "SegmentLabel", VTK_STRING, 1 }, { "Length", VTK_DOUBLE, 1 },
      { "Tortuosity", VTK_DOUBLE, 1 } });
}

void ExpectSurfaceColumns(vtkPolyData* surface)
{
  ExpectColumns(surface->GetPointData(),
    { { "GroupIds", VTK_INT, 1 }, { "Abscissas", VTK_DOUBLE, 1 }, { "Displacement", VTK_DOUBLE, 3 },
      { "Velocity", VTK_DOUBLE, 3 } });
  ExpectColumns(surface->GetCellData(), { { "CellEntityIds", VTK_INT, 1 } });
}

void ExpectOstiaColumns(vtkPolyData* ostia)
{
  ExpectColumns(ostia->GetPointData(),
    { { "Name", VTK_STRING, 1 }, { "Axis", VTK_DOUBLE, 3 },
      { "MaximumInscribedSphereRadius", VTK_DOUBLE, 1 } });
}

TEST(CoronaryPhantomSource, GivesTheDocumentedArrays)
{
  const auto source = MakeSource();
  vtkImageData* image = RequestImage(source, 0.3);
  ExpectColumns(image->GetPointData(), { { "HU", VTK_SHORT, 1 } });
  EXPECT_STREQ(image->GetPointData()->GetScalars()->GetName(), "HU");

  auto* tree = vtkPolyData::SafeDownCast(Request(source, Source::TreePort, 0.3));
  ExpectTreeColumns(tree);
  EXPECT_GT(tree->GetNumberOfLines(), 10);
  EXPECT_EQ(tree->GetNumberOfCells(), tree->GetNumberOfLines());
  auto* labels =
    vtkStringArray::SafeDownCast(tree->GetCellData()->GetAbstractArray("SegmentLabel"));
  EXPECT_GE(labels->LookupValue("LM"), 0);
  EXPECT_GE(labels->LookupValue("pRCA"), 0);

  auto* surface = vtkPolyData::SafeDownCast(Request(source, Source::SurfacePort, 0.3));
  ExpectSurfaceColumns(surface);
  EXPECT_EQ(surface->GetPolys()->GetMaxCellSize(), 3);
  EXPECT_EQ(surface->GetNumberOfCells(), surface->GetNumberOfPolys());

  auto* ostia = vtkPolyData::SafeDownCast(Request(source, Source::OstiaPort, 0.3));
  ExpectOstiaColumns(ostia);
  EXPECT_EQ(ostia->GetNumberOfVerts(), 2);

  auto* vein = vtkPolyData::SafeDownCast(Request(source, Source::VeinPort, 0.3));
  ExpectTreeColumns(vein);
  EXPECT_EQ(vein->GetNumberOfLines(), 1);

  for (int port = 0; port < source->GetNumberOfOutputPorts(); ++port)
  {
    vtkDataObject* data = Request(source, port, 0.3);
    EXPECT_EQ(FieldValue(data, "CycleLength"), 0.8) << port;
    EXPECT_EQ(FieldValue(data, "PhaseTime"), 0.3) << port;
    EXPECT_EQ(data->GetInformation()->Get(vtkDataObject::DATA_TIME_STEP()), 0.3) << port;
  }
}

TEST(CoronaryPhantomSource, OffersItsPhases)
{
  const auto source = MakeSource();
  source->UpdateInformation();
  const std::vector<double> paper = coronary::PaperPhases();
  for (int port = 0; port < source->GetNumberOfOutputPorts(); ++port)
  {
    vtkInformation* info = source->GetOutputInformation(port);
    ASSERT_EQ(info->Length(SDDP::TIME_STEPS()), 20);
    EXPECT_TRUE(std::equal(paper.begin(), paper.end(), info->Get(SDDP::TIME_STEPS())));
    EXPECT_EQ(info->Get(SDDP::TIME_RANGE())[0], paper.front());
    EXPECT_EQ(info->Get(SDDP::TIME_RANGE())[1], paper.back());
  }

  source->ClearPhases();
  source->AddPhase(0.25);
  source->AddPhase(0.75);
  EXPECT_EQ(source->GetNumberOfPhases(), 2);
  EXPECT_EQ(source->GetPhase(1), 0.75);
  EXPECT_TRUE(std::isnan(source->GetPhase(2)));
  source->UpdateInformation();
  vtkInformation* info = source->GetOutputInformation(Source::TreePort);
  EXPECT_EQ(info->Length(SDDP::TIME_STEPS()), 2);
  EXPECT_EQ(info->Get(SDDP::TIME_RANGE())[1], 0.75);

  // Nobody asked for a time: the first phase.
  source->Update(Source::TreePort);
  EXPECT_EQ(FieldValue(source->GetOutputDataObject(Source::TreePort), "PhaseTime"), 0.25);
}

TEST(CoronaryPhantomSource, AnswersEveryTimeExactly)
{
  const auto source = MakeSource();
  const coronary::CoronaryPhantom phantom(SettingsOf(source));
  // On a phase, between two, and outside the offered range.
  for (const double time : { coronary::PaperPhases()[4], 0.4321, -3.7, 12.25 })
  {
    SCOPED_TRACE(time);
    const coronary::PhantomTree tree = phantom.Tree(time);
    vtkPointSet* points = RequestPoints(source, Source::TreePort, time);
    ASSERT_EQ(points->GetNumberOfPoints(), static_cast<vtkIdType>(tree.points.size()));
    const std::vector<double> positions = Positions(points);
    EXPECT_EQ(
      std::memcmp(positions.data(), tree.points.data(), positions.size() * sizeof(double)), 0);
    EXPECT_EQ(Flat(points->GetPointData()->GetArray("MaximumInscribedSphereRadius")), tree.radius);
    EXPECT_EQ(FieldValue(points, "PhaseTime"), time);

    // The wall moves with the tissue: its velocity is the phantom's at the point at rest.
    vtkPointSet* surface = RequestPoints(source, Source::SurfacePort, time);
    for (vtkIdType i = 0; i < surface->GetNumberOfPoints(); i += 97)
    {
      coronary::Vector3 position;
      coronary::Vector3 displacement;
      coronary::Vector3 velocity;
      surface->GetPoint(i, position.data());
      surface->GetPointData()->GetArray("Displacement")->GetTuple(i, displacement.data());
      surface->GetPointData()->GetArray("Velocity")->GetTuple(i, velocity.data());
      EXPECT_EQ(velocity, phantom.Velocity(position - displacement, time));
    }
  }

  const std::vector<double> before = Positions(RequestPoints(source, Source::TreePort, 0.35));
  const std::vector<double> later = Positions(RequestPoints(source, Source::TreePort, 1.35));
  const std::vector<double> rest = Positions(RequestPoints(source, Source::TreePort, 0.0));
  double period = 0.0;
  double motion = 0.0;
  for (std::size_t i = 0; i < before.size(); ++i)
  {
    period = std::max(period, std::abs(before[i] - later[i]));
    motion = std::max(motion, std::abs(before[i] - rest[i]));
  }
  EXPECT_LT(period, 1e-9);
  EXPECT_GT(motion, 5.0);
}

TEST(CoronaryPhantomSource, ImageFollowsTheTime)
{
  const auto source = MakeSource();
  source->SetNoise(0.0);
  const std::vector<double> diastole = Voxels(RequestImage(source, 0.0));
  const std::vector<double> systole = Voxels(RequestImage(source, 0.35));
  EXPECT_NE(diastole, systole);
  EXPECT_EQ(diastole, Voxels(RequestImage(source, 0.0)));
}

TEST(CoronaryPhantomSource, StreamsTheImageByExtent)
{
  const auto source = MakeSource();
  const std::vector<double> whole = Voxels(RequestImage(source, 0.3));
  std::array<int, 6> extent;
  source->GetOutputInformation(Source::ImagePort)->Get(SDDP::WHOLE_EXTENT(), extent.data());

  for (int axis = 0; axis < 3; ++axis)
  {
    SCOPED_TRACE(axis);
    const int middle = (extent[2 * axis] + extent[2 * axis + 1]) / 2;
    std::array<int, 6> low = extent;
    std::array<int, 6> high = extent;
    low[2 * axis + 1] = middle;
    high[2 * axis] = middle + 1;
    vtkNew<vtkImageData> joined;
    joined->SetExtent(extent.data());
    joined->AllocateScalars(VTK_SHORT, 1);
    for (const std::array<int, 6>& half : { low, high })
    {
      const auto part = MakeSource();
      part->UpdateInformation();
      part->GetOutputInformation(Source::ImagePort)->Set(SDDP::UPDATE_TIME_STEP(), 0.3);
      part->UpdateExtent(half.data());
      auto* image = vtkImageData::SafeDownCast(part->GetOutputDataObject(Source::ImagePort));
      ASSERT_TRUE(std::equal(half.begin(), half.end(), image->GetExtent()));
      joined->CopyAndCastFrom(image, const_cast<int*>(half.data()));
    }
    EXPECT_EQ(Voxels(joined), whole);
  }
}

TEST(CoronaryPhantomSource, ComputesOnlyThePortThatIsAskedFor)
{
  const auto source = MakeSource();
  int executions = 0;
  vtkNew<vtkCallbackCommand> count;
  count->SetClientData(&executions);
  count->SetCallback(
    [](vtkObject*, unsigned long, void* counter, void*) { ++*static_cast<int*>(counter); });
  source->AddObserver(vtkCommand::StartEvent, count);
  const auto pointsAt = [&](int port)
  { return vtkDataSet::SafeDownCast(source->GetOutputDataObject(port))->GetNumberOfPoints(); };

  Request(source, Source::TreePort, 0.3);
  EXPECT_EQ(executions, 1);
  EXPECT_GT(pointsAt(Source::TreePort), 0);
  EXPECT_EQ(pointsAt(Source::ImagePort), 0);
  EXPECT_EQ(pointsAt(Source::SurfacePort), 0);

  // A later request at another port executes, and leaves the first alone.
  auto* tree = vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::TreePort));
  const vtkPoints* treePoints = tree->GetPoints();
  Request(source, Source::ImagePort, 0.3);
  EXPECT_EQ(executions, 2);
  EXPECT_GT(pointsAt(Source::ImagePort), 0);
  EXPECT_EQ(pointsAt(Source::SurfacePort), 0);
  EXPECT_EQ(tree->GetPoints(), treePoints);

  // Both are up to date now.
  Request(source, Source::TreePort, 0.3);
  Request(source, Source::ImagePort, 0.3);
  EXPECT_EQ(executions, 2);

  // A new time at one port, then at the other.
  Request(source, Source::TreePort, 0.7);
  EXPECT_EQ(executions, 3);
  EXPECT_EQ(FieldValue(source->GetOutputDataObject(Source::ImagePort), "PhaseTime"), 0.3);
  Request(source, Source::ImagePort, 0.7);
  EXPECT_EQ(executions, 4);
  EXPECT_EQ(FieldValue(source->GetOutputDataObject(Source::ImagePort), "PhaseTime"), 0.7);

  // A changed setting reaches every port.
  source->SetCalibre(1.5);
  Request(source, Source::TreePort, 0.7);
  Request(source, Source::ImagePort, 0.7);
  EXPECT_EQ(executions, 6);
}

TEST(CoronaryPhantomSource, OtherPiecesAreEmptyAndValid)
{
  const auto source = MakeSource();
  source->UpdateInformation();
  for (const int port : { Source::TreePort, Source::SurfacePort, Source::OstiaPort,
         Source::VeinPort, Source::ProbePort })
  {
    SCOPED_TRACE(port);
    vtkInformation* info = source->GetOutputInformation(port);
    info->Set(SDDP::UPDATE_NUMBER_OF_PIECES(), 3);
    info->Set(SDDP::UPDATE_PIECE_NUMBER(), 2);
    source->Update(port);
    auto* data = vtkPolyData::SafeDownCast(source->GetOutputDataObject(port));
    EXPECT_EQ(data->GetNumberOfPoints(), 0);
    EXPECT_EQ(data->GetNumberOfCells(), 0);
    EXPECT_EQ(FieldValue(data, "CycleLength"), 0.8);
  }
  ExpectTreeColumns(vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::TreePort)));
  ExpectSurfaceColumns(vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::SurfacePort)));
  ExpectOstiaColumns(vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::OstiaPort)));
  ExpectTreeColumns(vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::VeinPort)));

  // Piece 0 of several has everything.
  vtkInformation* info = source->GetOutputInformation(Source::TreePort);
  info->Set(SDDP::UPDATE_PIECE_NUMBER(), 0);
  source->Update(Source::TreePort);
  EXPECT_GT(
    vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::TreePort))->GetNumberOfPoints(),
    0);
}

TEST(CoronaryPhantomSource, SplitsTheImageOverPieces)
{
  const auto source = MakeSource();
  const vtkIdType whole = RequestImage(source, 0.3)->GetNumberOfCells();
  vtkIdType sum = 0;
  for (int piece = 0; piece < 3; ++piece)
  {
    source->UpdatePiece(piece, 3, 0);
    auto* image = vtkImageData::SafeDownCast(source->GetOutputDataObject(Source::ImagePort));
    EXPECT_LT(image->GetNumberOfCells(), whole);
    sum += image->GetNumberOfCells();
  }
  EXPECT_EQ(sum, whole);
}

TEST(CoronaryPhantomSource, StopsSoonAndStartsAnew)
{
  using Clock = std::chrono::steady_clock;
  struct Stop
  {
    Source* source;
    Clock::time_point when;
    int reports;
  };
  for (const int port : { Source::ImagePort, Source::SurfacePort })
  {
    SCOPED_TRACE(port);
    const auto source = MakeSource();
    source->AutomaticGridOn();
    source->SetSurfaceSpacing(0.35);
    Stop stop{ source, {}, 0 };
    vtkNew<vtkCallbackCommand> observer;
    observer->SetClientData(&stop);
    observer->SetCallback(
      [](vtkObject*, unsigned long, void* data, void* progress)
      {
        auto* s = static_cast<Stop*>(data);
        ++s->reports;
        if (*static_cast<double*>(progress) > 0.1 && !s->source->GetAbortExecute())
        {
          s->when = Clock::now();
          s->source->SetAbortExecute(1);
        }
      });
    const unsigned long tag = source->AddObserver(vtkCommand::ProgressEvent, observer);
    auto* data = vtkDataSet::SafeDownCast(Request(source, port, 0.3));
    const std::chrono::duration<double> delay = Clock::now() - stop.when;
    EXPECT_GT(stop.reports, 2);
    EXPECT_LT(delay.count(), 0.5);
    EXPECT_EQ(data->GetNumberOfPoints(), 0);

    source->RemoveObserver(tag);
    source->SetAbortExecute(0);
    data = vtkDataSet::SafeDownCast(Request(source, port, 0.3));
    EXPECT_GT(data->GetNumberOfPoints(), 0);
  }
}

TEST(CoronaryPhantomSource, DoesNotDependOnTheNumberOfThreads)
{
  std::vector<std::vector<double>> images;
  std::vector<std::vector<double>> surfaces;
  for (const int threads : { 1, 2, 5 })
  {
    coronary::SetNumberOfThreads(threads);
    const auto source = MakeSource();
    images.push_back(Voxels(RequestImage(source, 0.3)));
    surfaces.push_back(Positions(RequestPoints(source, Source::SurfacePort, 0.3)));
  }
  coronary::SetNumberOfThreads(0);
  EXPECT_EQ(images[0], images[1]);
  EXPECT_EQ(images[0], images[2]);
  EXPECT_EQ(surfaces[0], surfaces[1]);
  EXPECT_EQ(surfaces[0], surfaces[2]);
}

TEST(CoronaryPhantomSource, RepeatsBySeed)
{
  std::vector<std::vector<double>> images;
  std::vector<std::vector<double>> trees;
  for (const int seed : { 7, 7, 8 })
  {
    const auto source = MakeSource();
    source->SetSeed(seed);
    source->SetStenoses(3);
    images.push_back(Voxels(RequestImage(source, 0.3)));
    trees.push_back(Positions(RequestPoints(source, Source::TreePort, 0.3)));
  }
  EXPECT_EQ(images[0], images[1]);
  EXPECT_EQ(trees[0], trees[1]);
  EXPECT_NE(images[0], images[2]);
  EXPECT_NE(trees[0], trees[2]);
}

TEST(CoronaryPhantomSource, CarriesProbePoints)
{
  const auto source = MakeSource();
  const coronary::CoronaryPhantom phantom(SettingsOf(source));
  EXPECT_EQ(RequestPoints(source, Source::ProbePort, 0.3)->GetNumberOfPoints(), 0);

  vtkNew<vtkPoints> points;
  points->InsertNextPoint(0.0, 0.0, 0.0);
  points->InsertNextPoint(20.0, -10.0, -30.0);
  points->InsertNextPoint(500.0, 0.0, 0.0);
  vtkNew<vtkPolyData> input;
  input->SetPoints(points);
  vtkNew<vtkCellArray> line;
  line->InsertNextCell({ 0, 1 });
  input->SetLines(line);
  const std::vector<double> rest = Positions(input);

  source->SetInputDataObject(input);
  auto* moved = vtkPolyData::SafeDownCast(Request(source, Source::ProbePort, 0.3));
  ASSERT_NE(moved, nullptr);
  ASSERT_EQ(moved->GetNumberOfPoints(), 3);
  EXPECT_EQ(moved->GetNumberOfLines(), 1);
  for (int i = 0; i < 3; ++i)
  {
    const coronary::Vector3 reference(points->GetPoint(i));
    coronary::Vector3 displacement;
    coronary::Vector3 velocity;
    moved->GetPointData()->GetArray("Displacement")->GetTuple(i, displacement.data());
    moved->GetPointData()->GetArray("Velocity")->GetTuple(i, velocity.data());
    EXPECT_EQ(coronary::Vector3(moved->GetPoint(i)), phantom.Position(reference, 0.3));
    EXPECT_EQ(displacement, phantom.Position(reference, 0.3) - reference);
    EXPECT_EQ(velocity, phantom.Velocity(reference, 0.3));
  }
  EXPECT_EQ(Positions(input), rest);
  EXPECT_EQ(input->GetPointData()->GetNumberOfArrays(), 0);
  // Float points stay float at the input and become double at the output.
  EXPECT_EQ(moved->GetPoints()->GetDataType(), VTK_DOUBLE);

  // A type with an extent of its own, beside an image with another extent.
  vtkNew<vtkStructuredGrid> grid;
  grid->SetDimensions(3, 1, 1);
  grid->SetPoints(points);
  source->SetInputDataObject(grid);
  EXPECT_GT(RequestImage(source, 0.3)->GetNumberOfPoints(), 3);
  EXPECT_STREQ(Request(source, Source::ProbePort, 0.3)->GetClassName(), "vtkStructuredGrid");
  EXPECT_EQ(RequestPoints(source, Source::ProbePort, 0.3)->GetNumberOfPoints(), 3);

  source->SetInputDataObject(nullptr);
  EXPECT_EQ(RequestPoints(source, Source::ProbePort, 0.3)->GetNumberOfPoints(), 0);
}

TEST(CoronaryPhantomSource, RefusesAProbeOfManyBlocks)
{
  vtkNew<vtkMultiBlockDataSet> blocks;
  blocks->SetBlock(0, vtkNew<vtkPolyData>());
  const auto source = MakeSource();
  const Messages messages(source);
  source->SetInputDataObject(blocks);
  source->Update(Source::ProbePort);
  EXPECT_EQ(messages.Echoes.size(), 1U);
}

TEST(CoronaryPhantomSource, ProbeOfAnotherPhantomKeepsTheTimesApart)
{
  const auto still = MakeSource();
  still->SetCycleLength(1.25);
  still->Update(Source::TreePort);
  const auto source = MakeSource();
  source->SetInputDataObject(still->GetOutputDataObject(Source::TreePort));
  vtkDataObject* tree = Request(source, Source::TreePort, 0.6);
  vtkDataObject* probe = Request(source, Source::ProbePort, 0.3);
  EXPECT_EQ(FieldValue(tree, "PhaseTime"), 0.6);
  EXPECT_EQ(FieldValue(tree, "CycleLength"), 0.8);
  EXPECT_EQ(FieldValue(probe, "PhaseTime"), 0.3);
  EXPECT_EQ(FieldValue(probe, "CycleLength"), 0.8);
}

TEST(CoronaryPhantomSource, AutomaticGridHoldsTheTree)
{
  const auto source = MakeSource();
  source->AutomaticGridOn();
  source->SetSpacing(2.0, 2.0, 2.0);
  const coronary::CoronaryPhantom phantom(SettingsOf(source));
  const coronary::ImageGrid isotropic = phantom.DefaultGrid(2.0);
  vtkImageData* image = RequestImage(source, 0.0);
  EXPECT_TRUE(std::equal(isotropic.extent.begin(), isotropic.extent.end(), image->GetExtent()));
  EXPECT_EQ(coronary::Vector3(image->GetOrigin()), isotropic.origin);

  // Turned by 30 degrees about the third axis, and not isotropic.
  const double c = std::sqrt(0.75);
  const double turn[9] = { c, -0.5, 0.0, 0.5, c, 0.0, 0.0, 0.0, 1.0 };
  source->SetDirection(turn);
  source->SetSpacing(2.0, 2.5, 3.0);
  image = RequestImage(source, 0.35);
  EXPECT_EQ(image->GetDirectionMatrix()->GetElement(0, 1), -0.5);
  EXPECT_EQ(image->GetSpacing()[1], 2.5);
  const std::array<int, 6> extent = { image->GetExtent()[0], image->GetExtent()[1],
    image->GetExtent()[2], image->GetExtent()[3], image->GetExtent()[4], image->GetExtent()[5] };
  vtkPointSet* tree = RequestPoints(source, Source::TreePort, 0.35);
  for (vtkIdType i = 0; i < tree->GetNumberOfPoints(); ++i)
  {
    double index[3];
    image->TransformPhysicalPointToContinuousIndex(tree->GetPoint(i), index);
    for (int axis = 0; axis < 3; ++axis)
    {
      ASSERT_GE(index[axis], extent[2 * axis]);
      ASSERT_LE(index[axis], extent[2 * axis + 1]);
    }
  }
}

TEST(CoronaryPhantomSource, ExplicitGridIsTaken)
{
  const auto source = MakeSource();
  source->SetOrigin(-20.0, -30.0, -40.0);
  source->SetDimensions(9, 8, 7);
  vtkImageData* image = RequestImage(source, 0.0);
  EXPECT_EQ(image->GetOrigin()[2], -40.0);
  EXPECT_EQ(image->GetDimensions()[0], 9);
  EXPECT_EQ(image->GetDimensions()[2], 7);
  EXPECT_EQ(image->GetNumberOfPoints(), 9 * 8 * 7);
}

TEST(CoronaryPhantomSource, BadSettingsAreNamed)
{
  const double skew[9] = { 1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0 };
  const double noNumbers[9] = { NaN, NaN, NaN, NaN, NaN, NaN, NaN, NaN, NaN };
  const std::vector<std::pair<std::string, std::function<void(Source*)>>> cases = {
    { "Dominance", [](Source* s) { s->SetDominance(3); } },
    { "Calibre", [](Source* s) { s->SetCalibre(0.0); } },
    { "Calibre", [](Source* s) { s->SetCalibre(NaN); } },
    { "PositionVariation", [](Source* s) { s->SetPositionVariation(NaN); } },
    { "CalibreVariation", [](Source* s) { s->SetCalibreVariation(-0.1); } },
    { "Tortuosity", [](Source* s) { s->SetTortuosity(NaN); } },
    { "Stenoses", [](Source* s) { s->SetStenoses(-1); } },
    { "StenosisDegree", [](Source* s) { s->SetStenosisDegree(1.0); } },
    { "CalcifiedPlaques", [](Source* s) { s->SetCalcifiedPlaques(51); } },
    { "CycleLength", [](Source* s) { s->SetCycleLength(0.0); } },
    { "CycleLength", [](Source* s) { s->SetCycleLength(NaN); } },
    { "MotionAmplitude", [](Source* s) { s->SetMotionAmplitude(NaN); } },
    { "AxialMotionRight", [](Source* s) { s->SetAxialMotionRight(25.0); } },
    { "AxialMotionLeft", [](Source* s) { s->SetAxialMotionLeft(NaN); } },
    { "RegionalLag", [](Source* s) { s->SetRegionalLag(NaN); } },
    { "RegionalAmplitude", [](Source* s) { s->SetRegionalAmplitude(0.5); } },
    { "BeatVariation", [](Source* s) { s->SetBeatVariation(NaN); } },
    { "BeatIrregularity", [](Source* s) { s->SetBeatIrregularity(6.0); } },
    { "AreaPulse", [](Source* s) { s->SetAreaPulse(NaN); } },
    { "TemporalWindow", [](Source* s) { s->SetTemporalWindow(-1.0); } },
    { "Noise", [](Source* s) { s->SetNoise(NaN); } },
    { "NoiseCorrelation", [](Source* s) { s->SetNoiseCorrelation(3.0); } },
    { "SystolicNoise", [](Source* s) { s->SetSystolicNoise(0.0); } },
    { "PointSpread", [](Source* s) { s->SetPointSpread(0.3, NaN, 0.3); } },
    { "LumenHU", [](Source* s) { s->SetLumenHU(1e9); } },
    { "AttenuationGradient", [](Source* s) { s->SetAttenuationGradient(NaN); } },
    { "VeinHU", [](Source* s) { s->SetVeinHU(NaN); } },
    { "LostPhases", [](Source* s) { s->AddLostPhase(NaN, 1.0); } },
    { "LostPhases", [](Source* s) { s->AddLostPhase(0.3, 2.0); } },
    { "CenterlineSpacing", [](Source* s) { s->SetCenterlineSpacing(0.0); } },
    { "SurfaceSpacing", [](Source* s) { s->SetSurfaceSpacing(NaN); } },
    { "Phases", [](Source* s) { s->ClearPhases(); } },
    { "Phases", [](Source* s) { s->AddPhase(1.06); } },
    { "Phases", [](Source* s) { s->AddPhase(NaN); } },
    { "Spacing", [](Source* s) { s->SetSpacing(0.0, 1.0, 1.0); } },
    { "Spacing", [](Source* s) { s->SetSpacing(1.0, NaN, 1.0); } },
    { "Spacing", [](Source* s) { s->SetSpacing(1.0, 1.0, 1e-9); } },
    { "Direction", [&](Source* s) { s->SetDirection(skew); } },
    { "Direction", [&](Source* s) { s->SetDirection(noNumbers); } },
    { "Origin", [](Source* s) { s->SetOrigin(0.0, 0.0, NaN); } },
    { "Dimensions", [](Source* s) { s->SetDimensions(10, 0, 10); } },
    { "UPDATE_TIME_STEP",
      [](Source* s)
      {
        s->UpdateInformation();
        s->GetOutputInformation(Source::TreePort)->Set(SDDP::UPDATE_TIME_STEP(), NaN);
      } }
  };
  for (const auto& [name, spoil] : cases)
  {
    SCOPED_TRACE(name);
    const auto source = MakeSource();
    const Messages messages(source);
    spoil(source);
    source->Update(Source::TreePort);
    ASSERT_EQ(messages.Errors.size(), 1U);
    EXPECT_NE(messages.Errors[0].find(": " + name), std::string::npos) << messages.Errors[0];
    auto* tree = vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::TreePort));
    EXPECT_TRUE(!tree || tree->GetNumberOfPoints() == 0);

    // A second request does not pass in silence.
    const std::size_t before = messages.Errors.size() + messages.Echoes.size();
    source->Update(Source::TreePort);
    EXPECT_GT(messages.Errors.size() + messages.Echoes.size(), before);
  }
}

TEST(CoronaryPhantomSource, RecoversFromABadSetting)
{
  const auto source = MakeSource();
  const std::vector<double> good = Positions(RequestPoints(source, Source::TreePort, 0.3));
  {
    const Messages messages(source);
    source->SetNoise(-1.0);
    source->Update(Source::TreePort);
    EXPECT_EQ(messages.Errors.size(), 1U);
    source->Update(Source::TreePort);
    EXPECT_EQ(messages.Errors.size(), 2U);
    auto* tree = vtkPolyData::SafeDownCast(source->GetOutputDataObject(Source::TreePort));
    EXPECT_EQ(tree->GetNumberOfPoints(), 0);
  }
  source->SetNoise(10.0);
  EXPECT_EQ(Positions(RequestPoints(source, Source::TreePort, 0.3)), good);
}

TEST(CoronaryPhantomSource, TreeIsTheSameWhateverTheImage)
{
  const auto source = MakeSource();
  const std::vector<double> before = Positions(RequestPoints(source, Source::TreePort, 0.3));
  source->SetNoise(0.0);
  source->SetTemporalWindow(0.14);
  EXPECT_EQ(Positions(RequestPoints(source, Source::TreePort, 0.3)), before);
}

TEST(CoronaryPhantomSource, LostPhaseShowsInTheVisibility)
{
  const auto source = MakeSource();
  const auto meanVisibility = [&](double time)
  {
    const std::vector<double> values =
      Flat(RequestPoints(source, Source::TreePort, time)->GetPointData()->GetArray("Visibility"));
    double sum = 0.0;
    for (const double value : values)
    {
      sum += value;
    }
    return sum / static_cast<double>(values.size());
  };
  const double before = meanVisibility(0.71);
  source->AddLostPhase(0.71, 1.0);
  EXPECT_EQ(source->GetNumberOfLostPhases(), 1);
  EXPECT_LT(meanVisibility(0.71), 0.01);
  source->ClearLostPhases();
  EXPECT_EQ(meanVisibility(0.71), before);
}

/// "Name: value value" lines of PrintSelf.
std::map<std::string, std::vector<double>> PrintedValues(Source* source)
{
  std::ostringstream text;
  source->Print(text);
  std::map<std::string, std::vector<double>> values;
  std::istringstream lines(text.str());
  for (std::string line; std::getline(lines, line);)
  {
    const std::size_t colon = line.find(": ");
    const std::size_t start = line.find_first_not_of(' ');
    if (colon == std::string::npos || start == std::string::npos)
    {
      continue;
    }
    std::istringstream numbers(line.substr(colon + 1));
    std::vector<double>& list = values[line.substr(start, colon - start)];
    for (double value = 0.0; numbers >> value;)
    {
      list.push_back(value);
    }
  }
  return values;
}

TEST(CoronaryPhantomSource, DefaultsAreThoseOfTheProxy)
{
  vtkNew<Source> source;
  const std::map<std::string, std::vector<double>> printed = PrintedValues(source);
  const std::string path = DYNAMICCORONARY_SOURCE_DIR "/ServerManagerXML/CoronaryPhantom.xml";
  const auto root =
    vtkSmartPointer<vtkXMLDataElement>::Take(vtkXMLUtilities::ReadElementFromFile(path.c_str()));
  ASSERT_NE(root, nullptr) << path;
  vtkXMLDataElement* proxy =
    root->FindNestedElementWithName("ProxyGroup")->FindNestedElementWithName("SourceProxy");
  int compared = 0;
  for (int i = 0; i < proxy->GetNumberOfNestedElements(); ++i)
  {
    vtkXMLDataElement* property = proxy->GetNestedElement(i);
    const char* defaults = property->GetAttribute("default_values");
    if (!defaults)
    {
      continue;
    }
    const std::string name = property->GetAttribute("name");
    SCOPED_TRACE(name);
    std::istringstream numbers(defaults);
    std::vector<double> values;
    for (double value = 0.0; numbers >> value;)
    {
      values.push_back(value);
    }
    ASSERT_EQ(printed.count(name), 1U);
    const std::vector<double>& expected = printed.at(name);
    ASSERT_EQ(values.size(), expected.size());
    for (std::size_t v = 0; v < values.size(); ++v)
    {
      EXPECT_NEAR(values[v], expected[v], 1e-5);
    }
    ++compared;
  }
  EXPECT_EQ(compared, 26);
}
}
}
