// vtkCurvedReformat through the VTK pipeline: blocks, places, widths, vessels by name, time, refusals.
#include "vtkCurvedReformat.h"

#include "FilterMessages.h"
#include "TubeImage.h"
#include "vtkCoronaryPhantomSource.h"

#include "vtkCompositeDataSet.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkMultiBlockDataSet.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkStringArray.h"
#include "vtkStructuredGrid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace TestCurvedReformat
{
using coronary::TubeImage;

namespace
{
constexpr double Radius = 1.8;

/// A tube and its centerline, with the filter on them.
struct Case
{
  vtkNew<vtkImageData> image;
  vtkNew<vtkPolyData> lines;
  vtkNew<vtkCurvedReformat> filter;

  Case()
  {
    TubeImage::Render([](double) { return Radius; }, this->image);
    TubeImage::Centerline(Radius, this->lines);
    this->filter->SetInputData(0, this->image);
    this->filter->SetInputData(1, this->lines);
  }

  vtkMultiBlockDataSet* Output(int port) const
  {
    return vtkMultiBlockDataSet::SafeDownCast(this->filter->GetOutputDataObject(port));
  }
};

template <typename Data>
Data* Block(vtkMultiBlockDataSet* blocks, const std::string& name)
{
  for (unsigned int n = 0; n < blocks->GetNumberOfBlocks(); ++n)
  {
    if (name == blocks->GetMetaData(n)->Get(vtkCompositeDataSet::NAME()))
    {
      return Data::SafeDownCast(blocks->GetBlock(n));
    }
  }
  ADD_FAILURE() << "no block " << name;
  return nullptr;
}

double Field(vtkMultiBlockDataSet* blocks, const char* name)
{
  vtkDataArray* array = blocks->GetFieldData()->GetArray(name);
  EXPECT_NE(array, nullptr) << name;
  return array != nullptr ? array->GetComponent(0, 0) : 0.0;
}
}

TEST(CurvedReformat, FlatPicturesKnowTheirPlaces)
{
  Case tube;
  for (const int kind : { vtkCurvedReformat::Straightened, vtkCurvedReformat::Curved })
  {
    tube.filter->SetKind(kind);
    tube.filter->SetAngle(25.0);
    tube.filter->SetPosition(30.0);
    tube.filter->SetHalfWidth(5.0);
    tube.filter->Update();
    vtkMultiBlockDataSet* reformat = tube.Output(vtkCurvedReformat::ReformatPort);
    auto* picture = Block<vtkImageData>(reformat, "Picture");
    ASSERT_NE(picture, nullptr);
    const int* size = picture->GetDimensions();
    EXPECT_EQ(size[0], 241); // 60 mm
    EXPECT_EQ(size[1], 41);
    vtkDataArray* values = picture->GetPointData()->GetScalars();
    ASSERT_NE(values, nullptr);
    EXPECT_STREQ(values->GetName(), "HU");
    vtkDataArray* world = picture->GetPointData()->GetArray("WorldPosition");
    vtkDataArray* arc = picture->GetPointData()->GetArray("Abscissas");
    ASSERT_NE(world, nullptr);
    ASSERT_NE(arc, nullptr);
    for (vtkIdType n = 0; n < picture->GetNumberOfPoints(); n += 7)
    {
      double flat[3];
      double place[3];
      picture->GetPoint(n, flat);
      world->GetTuple(n, place);
      // Along the tube, as far as in the picture, and as far from its axis.
      EXPECT_NEAR(place[2], flat[0], 1e-9);
      EXPECT_NEAR(arc->GetTuple1(n), flat[0], 1e-9);
      EXPECT_NEAR(std::hypot(place[0], place[1]), std::abs(flat[1]), 1e-9);
      const double share =
        coronary::BlurredDisc(std::abs(flat[1]) / TubeImage::Blur, Radius / TubeImage::Blur);
      EXPECT_NEAR(values->GetTuple1(n), TubeImage::Fat + 480.0 * share, 40.0);
    }
    // The lumen's edges are a radius away, the axis in the middle, the place where it was asked for.
    auto* lumen = Block<vtkPolyData>(reformat, "Lumen");
    EXPECT_EQ(lumen->GetNumberOfLines(), 2);
    EXPECT_NEAR(lumen->GetBounds()[2], -Radius, 1e-6);
    EXPECT_NEAR(lumen->GetBounds()[3], Radius, 1e-6);
    EXPECT_NEAR(Block<vtkPolyData>(reformat, "Place")->GetBounds()[0], 30.0, 1e-9);
    EXPECT_NEAR(Block<vtkPolyData>(reformat, "Axis")->GetBounds()[1], 60.0, 1e-6);
    EXPECT_NEAR(Field(reformat, "VesselLength"), 60.0, 1e-9);
    auto* pieces =
      vtkStringArray::SafeDownCast(reformat->GetFieldData()->GetAbstractArray("VesselPieces"));
    ASSERT_NE(pieces, nullptr);
    EXPECT_EQ(pieces->GetValue(0), "mLAD");
  }
}

TEST(CurvedReformat, SectionsStandAcrossTheVessel)
{
  Case tube;
  tube.filter->SetPosition(21.1);
  tube.filter->Update(vtkCurvedReformat::SectionPort);
  vtkMultiBlockDataSet* section = tube.Output(vtkCurvedReformat::SectionPort);
  auto* picture = Block<vtkImageData>(section, "Picture");
  ASSERT_NE(picture, nullptr);
  vtkDataArray* values = picture->GetPointData()->GetScalars();
  vtkDataArray* world = picture->GetPointData()->GetArray("WorldPosition");
  for (vtkIdType n = 0; n < picture->GetNumberOfPoints(); n += 5)
  {
    double flat[3];
    double place[3];
    picture->GetPoint(n, flat);
    world->GetTuple(n, place);
    EXPECT_NEAR(place[2], 21.0, 1e-9); // the nearest quarter of a mm
    EXPECT_NEAR(std::hypot(place[0], place[1]), std::hypot(flat[0], flat[1]), 1e-9);
    if (std::hypot(place[0], place[1]) < 1.0)
    {
      EXPECT_GT(values->GetTuple1(n), 380.0);
    }
  }
  EXPECT_NEAR(Field(section, "SectionPosition"), 21.0, 1e-9);
  EXPECT_NEAR(Field(section, "LumenDiameter"), 2.0 * Radius, 1e-9);
  // Half way to the level of the outer boundary, which is above the fat's.
  EXPECT_NEAR(Field(section, "EdgeArea"), M_PI * Radius * Radius, 1.5);
  EXPECT_GT(Field(section, "OuterArea"), Field(section, "EdgeArea"));
  auto* lumen = Block<vtkPolyData>(section, "Lumen");
  for (vtkIdType n = 0; n < lumen->GetNumberOfPoints(); ++n)
  {
    double flat[3];
    lumen->GetPoint(n, flat);
    EXPECT_NEAR(std::hypot(flat[0], flat[1]), Radius, 1e-9);
  }
  // The same in the patient.
  vtkMultiBlockDataSet* inPlace = tube.Output(vtkCurvedReformat::InPlacePort);
  auto* plane = Block<vtkStructuredGrid>(inPlace, "Section");
  ASSERT_NE(plane, nullptr);
  ASSERT_EQ(plane->GetNumberOfPoints(), picture->GetNumberOfPoints());
  for (vtkIdType n = 0; n < plane->GetNumberOfPoints(); n += 9)
  {
    double place[3];
    world->GetTuple(n, place);
    double* there = plane->GetPoint(n);
    EXPECT_NEAR(there[0], place[0], 1e-9);
    EXPECT_NEAR(there[1], place[1], 1e-9);
    EXPECT_NEAR(there[2], place[2], 1e-9);
  }
  EXPECT_NE(Block<vtkStructuredGrid>(inPlace, "Sheet"), nullptr);
  // Where a point in the patient is nearest to the vessel.
  tube.filter->SetPoint(5.0, -3.0, 44.1);
  tube.filter->FollowPointOn();
  tube.filter->Update();
  EXPECT_NEAR(Field(tube.Output(vtkCurvedReformat::SectionPort), "SectionPosition"), 44.0, 1e-9);
  tube.filter->FollowPointOff();
  // Beyond the end is the end.
  tube.filter->SetPosition(1e6);
  tube.filter->Update();
  EXPECT_NEAR(Field(tube.Output(vtkCurvedReformat::SectionPort), "SectionPosition"), 60.0, 1e-9);
}

TEST(CurvedReformat, APhantomsVesselsByNameAtAnyPhase)
{
  vtkNew<vtkCoronaryPhantomSource> phantom;
  phantom->SetSpacing(1.0, 1.0, 1.0);
  vtkNew<vtkCurvedReformat> filter;
  filter->SetInputConnection(0, phantom->GetOutputPort(vtkCoronaryPhantomSource::ImagePort));
  filter->SetLinesConnection(phantom->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  double before = 0.0;
  for (const char* vessel : { "LAD", "LCx", "RCA", "D1" })
  {
    filter->SetVessel(vessel);
    filter->UpdateTimeStep(0.35);
    auto* reformat = vtkMultiBlockDataSet::SafeDownCast(filter->GetOutputDataObject(0));
    const double length = Field(reformat, "VesselLength");
    EXPECT_GT(length, 40.0) << vessel;
    auto* pieces =
      vtkStringArray::SafeDownCast(reformat->GetFieldData()->GetAbstractArray("VesselPieces"));
    const bool right = std::string(vessel) == "RCA";
    EXPECT_EQ(pieces->GetValue(0), right ? "pRCA" : "LM") << vessel;
    before = length;
  }
  // The vessel moves, and its picture with it.
  filter->UpdateTimeStep(0.75);
  auto* reformat = vtkMultiBlockDataSet::SafeDownCast(filter->GetOutputDataObject(0));
  EXPECT_NE(Field(reformat, "VesselLength"), before);
}

TEST(CurvedReformat, RefusesInOneSentence)
{
  Case tube;
  tube.filter->SetVessel("RCA");
  ExpectFilterError(tube.filter, "'RCA'; it has mLAD");
  EXPECT_EQ(tube.Output(0)->GetNumberOfBlocks(), 0U);
  tube.filter->SetVessel("");
  tube.filter->SetSpacing(0.0);
  ExpectFilterError(tube.filter, "Spacing must be");
  tube.filter->SetSpacing(0.25);
  tube.filter->SetKind(5);
  ExpectFilterError(tube.filter, "Kind must be");
  tube.filter->SetKind(0);
  tube.filter->SetPosition(std::nan(""));
  ExpectFilterError(tube.filter, "Position must be finite");
  tube.filter->SetPosition(1.0);
  tube.filter->SetPoint(0.0, std::nan(""), 0.0);
  ExpectFilterError(tube.filter, "Point must be finite");
  tube.filter->SetPoint(0.0, 0.0, 0.0);
  tube.filter->SetImageArrayName("Missing");
  ExpectFilterError(tube.filter, "'Missing'");
  tube.filter->SetImageArrayName("Automatic");
  tube.image->SetOrigin(500.0, 0.0, 0.0);
  ExpectFilterError(tube.filter, "outside of the image");
  tube.image->SetOrigin(-7.2, -7.2, -4.0);
  tube.filter->Update();
  EXPECT_EQ(tube.Output(0)->GetNumberOfBlocks(), 5U);
  tube.lines->GetPointData()->RemoveArray("MaximumInscribedSphereRadius");
  tube.lines->Modified();
  ExpectFilterError(tube.filter, "MaximumInscribedSphereRadius");
}

TEST(CurvedReformat, EmptyLinesOtherPiecesAndAborts)
{
  Case tube;
  UpdateAborted(tube.filter);
  EXPECT_EQ(tube.Output(0)->GetNumberOfBlocks(), 0U);
  tube.filter->Update();
  EXPECT_EQ(tube.Output(0)->GetNumberOfBlocks(), 5U);
  tube.filter->UpdatePiece(1, 2, 0);
  EXPECT_EQ(tube.Output(0)->GetNumberOfBlocks(), 0U);
  vtkNew<vtkPolyData> none;
  vtkNew<vtkCurvedReformat> filter;
  filter->SetInputData(0, tube.image);
  filter->SetInputData(1, none);
  Messages messages(filter);
  filter->Update();
  EXPECT_TRUE(messages.Errors.empty());
}
}
