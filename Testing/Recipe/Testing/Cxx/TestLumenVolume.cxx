// The recipe of docs/development.md: its algorithm against closed forms, its filter through the pipeline.
#include "FilterMessages.h"
#include "LumenVolume.h"
#include "vtkCoronaryPhantomSource.h"
#include "vtkLumenVolume.h"

#include "vtkCellData.h"
#include "vtkDataArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPolyData.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

using coronary::LumenVolume;
using coronary::Vector3;

TEST(LumenVolume, CylinderAndCone)
{
  EXPECT_NEAR(LumenVolume({ Vector3(1, 2, 3), Vector3(1, 2, 5), Vector3(1, 2, 13) }, { 2, 2, 2 }),
    M_PI * 4.0 * 10.0, 1e-12);
  EXPECT_NEAR(
    LumenVolume({ Vector3(0, 0, 0), Vector3(3, 0, 4) }, { 3, 0 }), M_PI * 9.0 * 5.0 / 3.0, 1e-12);
}

TEST(LumenVolume, NothingWithoutLength)
{
  EXPECT_EQ(LumenVolume({}, {}), 0.0);
  EXPECT_EQ(LumenVolume({ Vector3(1, 1, 1) }, { 2 }), 0.0);
}

TEST(LumenVolume, RefusesWrongRadii)
{
  EXPECT_THROW(LumenVolume({ Vector3(0, 0, 0) }, {}), std::invalid_argument);
  EXPECT_THROW(LumenVolume({ Vector3(0, 0, 0) }, { -1 }), std::invalid_argument);
  EXPECT_THROW(LumenVolume({ Vector3(0, 0, 0) }, { std::numeric_limits<double>::quiet_NaN() }),
    std::invalid_argument);
}

TEST(VtkLumenVolume, BranchesOfThePhantom)
{
  vtkNew<vtkCoronaryPhantomSource> phantom;
  vtkNew<vtkLumenVolume> filter;
  filter->SetInputConnection(phantom->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  filter->Update();
  vtkDataArray* volumes = filter->GetOutput()->GetCellData()->GetArray("LumenVolume");
  vtkDataArray* lengths = filter->GetOutput()->GetCellData()->GetArray("Length");
  vtkDataArray* radii =
    filter->GetOutput()->GetPointData()->GetArray("MaximumInscribedSphereRadius");
  ASSERT_NE(volumes, nullptr);
  ASSERT_EQ(volumes->GetNumberOfTuples(), lengths->GetNumberOfTuples());
  double range[2];
  radii->GetRange(range);
  for (vtkIdType branch = 0; branch < volumes->GetNumberOfTuples(); ++branch)
  {
    const double length = lengths->GetTuple1(branch);
    EXPECT_GE(volumes->GetTuple1(branch), 0.99 * M_PI * range[0] * range[0] * length);
    EXPECT_LE(volumes->GetTuple1(branch), 1.01 * M_PI * range[1] * range[1] * length);
  }
}

TEST(VtkLumenVolume, EmptyInputAndMissingRadii)
{
  vtkNew<vtkLumenVolume> filter;
  vtkNew<vtkPolyData> empty;
  filter->SetInputData(empty);
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetNumberOfCells(), 0);

  vtkNew<vtkCoronaryPhantomSource> phantom;
  filter->SetInputConnection(phantom->GetOutputPort(vtkCoronaryPhantomSource::TreePort));
  filter->SetRadiusArrayName("Width");
  ExpectFilterError(filter, "RadiusArrayName: there is no point array 'Width'");
}
