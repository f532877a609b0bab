// Masks of several phases, as ParaView opens them.
#include "FilterMessages.h"
#include "FormatTestFiles.h"
#include "vtkSegmentationReader.h"

#include "vtkDataArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkStreamingDemandDrivenPipeline.h"

#include <gtest/gtest.h>

#include <string>

namespace TestSegmentationReader
{
using namespace formattest;
using SDDP = vtkStreamingDemandDrivenPipeline;

namespace
{
/// A row of four voxels of 0.5 mm along y, of which those of `values` that are not 0 are segments.
void WriteRow(const std::string& path, const Bytes& values, double origin)
{
  const std::string header = "NRRD0004\ntype: unsigned char\ndimension: 3\n"
                             "space: left-posterior-superior\nsizes: 4 1 1\n"
                             "space directions: (0,0.5,0) (1,0,0) (0,0,1)\n"
                             "kinds: domain domain domain\nencoding: raw\nspace origin: (0," +
    std::to_string(origin) +
    ",0)\nSegment0_ID:=a\nSegment0_Name:=LAD\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
    "Segment1_ID:=b\nSegment1_Name:=RCA\nSegment1_LabelValue:=2\nSegment1_Layer:=0\n\n";
  WriteBytes(path, Concatenated(header, values));
}

std::string Mask(vtkSegmentationReader* reader, double time)
{
  reader->UpdateTimeStep(time);
  vtkDataArray* values = reader->GetOutput()->GetPointData()->GetArray("VesselMask");
  std::string text;
  for (vtkIdType n = 0; values != nullptr && n < values->GetNumberOfTuples(); ++n)
  {
    text += values->GetTuple1(n) != 0.0 ? '1' : '0';
  }
  return text;
}
}

TEST(SegmentationReader, PhasesSegmentsAndPlaces)
{
  const TemporaryFolder folder;
  WriteRow(folder / "0.seg.nrrd", { 1, 1, 2, 0 }, 0.0);
  WriteRow(folder / "1.seg.nrrd", { 0, 1, 2, 0 }, 0.5); // one voxel further
  vtkNew<vtkSegmentationReader> reader;
  reader->AddFileName((folder / "0.seg.nrrd").c_str());
  reader->AddFileName((folder / "1.seg.nrrd").c_str());
  EXPECT_EQ(Mask(reader, 0.0), "1110");
  EXPECT_EQ(Mask(reader, 0.5), "0011");
  reader->AddSegment("LAD");
  EXPECT_EQ(Mask(reader, 0.1), "1100");
  EXPECT_EQ(Mask(reader, 0.6), "0010");
  vtkInformation* info = reader->GetOutputInformation(0);
  ASSERT_EQ(info->Length(SDDP::TIME_STEPS()), 2);
  EXPECT_EQ(info->Get(SDDP::TIME_STEPS())[1], 0.5);
  double point[3];
  reader->GetOutput()->GetPoint(3, point);
  EXPECT_DOUBLE_EQ(point[0], 0.0);
  EXPECT_DOUBLE_EQ(point[1], 1.5);
}

TEST(SegmentationReader, OneErrorThatNamesTheFault)
{
  const TemporaryFolder folder;
  WriteRow(folder / "0.seg.nrrd", { 1, 1, 2, 0 }, 0.0);
  WriteRow(folder / "1.seg.nrrd", { 1, 1, 2, 0 }, 100.0);
  const auto expect = [](vtkSegmentationReader* reader, double time, const std::string& part)
  {
    const Messages messages(reader);
    reader->UpdateTimeStep(time);
    EXPECT_EQ(messages.Errors.size(), 1u);
    EXPECT_TRUE(messages.HasError(part)) << part;
    EXPECT_EQ(reader->GetOutput()->GetNumberOfPoints(), 0);
  };
  vtkNew<vtkSegmentationReader> reader;
  reader->SetFileName((folder / "0.seg.nrrd").c_str());
  reader->AddFileName((folder / "1.seg.nrrd").c_str());
  expect(reader, 0.5, "does not overlap the image");
  reader->AddSegment("Vein");
  expect(reader, 0.0, "no segment 'Vein'");
  reader->SetPhaseFraction(0, 0.5);
  expect(reader, 0.0, "PhaseFractions: 1 for 2 files");
  reader->SetFileName((folder / "none.seg.nrrd").c_str());
  expect(reader, 0.5, "none.seg.nrrd");
}
}
