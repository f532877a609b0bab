// Files of 3D Slicer and SimVascular: what is read, what is refused, and what comes back.
#include "FormatTestFiles.h"

#include "GatedSeries.h"
#include "MarkupsFile.h"
#include "MaskResampling.h"
#include "NrrdSequenceWriter.h"
#include "Refusals.h"
#include "SegmentationFile.h"
#include "SeriesDescription.h"
#include "SimVascularFile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace UnitTestExchangeFormats
{
using namespace coronary;
using namespace formattest;

namespace
{
/// Two layers of 4 x 3 x 2 voxels: vessel (1) and plaque (2) share the first, the aorta has the second.
const std::string Notes =
  "Segment0_ID:=Segment_1\nSegment0_Name:=Vessel\nSegment0_LabelValue:=1\n"
  "Segment0_Layer:=0\nSegment0_Extent:=0 3 0 2 0 1\n"
  "Segment1_ID:=Segment_2\nSegment1_Name:=Plaque\\nold\n"
  "Segment1_LabelValue:=2\nSegment1_Layer:=0\nSegment1_Extent:=1 1 1 1 0 0\n"
  "Segment2_ID:=Segment_3\nSegment2_Name:=Aorta\nSegment2_LabelValue:=1\n"
  "Segment2_Layer:=1\nSegment2_Extent:=0 0 0 0 1 1\n"
  "Segmentation_ReferenceImageExtentOffset:=10 20 30\n";

std::string Header(const std::string& notes)
{
  return "NRRD0004\ntype: unsigned char\ndimension: 4\nspace: left-posterior-superior\n"
         "sizes: 2 4 3 2\nspace directions: none (0.5,0,0) (0,0.5,0) (0,0,1)\n"
         "kinds: list domain domain domain\nencoding: raw\nspace origin: (10,-20,5)\n" +
    notes + "\n";
}

Bytes Layers()
{
  Bytes bytes(2 * 24, 0);
  const auto set = [&](int layer, int i, int j, int k, unsigned char value)
  { bytes[static_cast<std::size_t>(((k * 3 + j) * 4 + i) * 2 + layer)] = value; };
  set(0, 0, 0, 0, 1);
  set(0, 3, 2, 1, 1);
  set(0, 1, 1, 0, 2);
  set(1, 0, 0, 1, 1);
  set(1, 3, 0, 1, 1); // outside of the extent of the layer's segments
  return bytes;
}

std::string MarkupsWith(const std::string& fields, const std::string& points)
{
  return "{\"@schema\": \"markups-schema-v1.0.3.json#\", \"markups\": [{\"type\": \"Curve\"" +
    fields + ", \"controlPoints\": [" + points + "]}]}";
}

const std::string OnePoint = "{\"label\": \"a\", \"position\": [1.0, 2.0, 3.0]}";
}

TEST(Segmentation, SegmentsOfLayers)
{
  const TemporaryFolder folder;
  const std::string path = folder / "a.seg.nrrd";
  WriteBytes(path, Concatenated(Header(Notes), Layers()));
  const SegmentationFile file(path);
  ASSERT_EQ(file.Segments().size(), 3u);
  EXPECT_EQ(file.Segments()[1].name, "Plaque\nold");
  EXPECT_EQ(file.Segments()[2].layer, 1);
  EXPECT_EQ(file.Mask({ "Vessel" }).count, 2);
  EXPECT_EQ(file.Mask({ "Segment_2" }).count, 1);
  // Not the voxel that is outside of the layer's extent.
  EXPECT_EQ(file.Mask({ "Aorta" }).count, 1);
  EXPECT_EQ(file.Mask({ "Vessel", "Segment_2" }).count, 3);
  const SegmentationMask all = file.Mask({});
  EXPECT_EQ(all.count, 4);
  EXPECT_EQ(all.voxels[0], 1);
  EXPECT_TRUE(all.grid.IndexToWorld(0, 0, 0).isApprox(Vector3(10.0, -20.0, 5.0)));
  EXPECT_TRUE(all.grid.IndexToWorld(1, 1, 1).isApprox(Vector3(10.5, -19.5, 6.0)));
  ExpectError([&] { (void)file.Mask({ "Vein" }); }, "no segment 'Vein'; there are 'Vessel'");
}

TEST(Segmentation, LabelMapWithoutSegments)
{
  const TemporaryFolder folder;
  const std::string path = folder / "labels.nrrd";
  const std::string header = "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\nendian: little\n"
                             "space: RAS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
                             "space origin: (1,2,3)\nencoding: gzip\n\n";
  Bytes labels(48, 0);
  labels[0] = 3;
  labels[2] = 4;
  WriteBytes(path, Concatenated(header, Gzip(labels)));
  const SegmentationFile file(path);
  EXPECT_TRUE(file.Segments().empty());
  EXPECT_EQ(file.Mask({}).count, 2);
  EXPECT_EQ(file.Mask({ "3" }).count, 1);
  EXPECT_EQ(file.Mask({ "Segment_4" }).count, 1);
  EXPECT_TRUE(file.Grid().origin.isApprox(Vector3(-1.0, -2.0, 3.0)));
  ExpectError([&] { (void)file.Mask({ "5" }); }, "no voxel is of the segment '5'");
  ExpectError([&] { (void)file.Mask({ "LAD" }); }, "has no names of segments");
}

TEST(Segmentation, Hostile)
{
  const TemporaryFolder folder;
  const std::string path = folder / "bad.seg.nrrd";
  const auto refuse = [&](const std::string& notes, const std::string& part)
  {
    WriteBytes(path, Concatenated(Header(notes), Layers()));
    ExpectError([&] { (void)SegmentationFile(path).Mask({}); }, part);
  };
  refuse("Segment0_ID:=a\nSegment0_Layer:=7\n", "Segment0_Layer is 7, but there are 2 layers");
  refuse("Segment0_ID:=a\nSegment0_Layer:=-1\n", "Segment0_Layer is out of range");
  refuse("Segment0_ID:=a\nSegment0_LabelValue:=nan\n", "Segment0_LabelValue holds 'nan'");
  refuse("Segment0_ID:=a\nSegment0_LabelValue:=2000000000\n", "above 16777216");
  refuse("Segment0_ID:=a\nSegment0_Extent:=0 1 2\n", "Segment0_Extent has 3 values");
  refuse("Segment0_ID:=a\nSegment1_ID:=a\n", "two segments have the ID 'a'");
  refuse("Segment1_ID:=a\n", "2 volumes and no segments");
  refuse("Segment0_ID:=a\nSegment0_LabelValue:=9\n", "all its voxels are background");
  const Bytes whole = Concatenated(Header(Notes), Layers());
  for (std::size_t size = 0; size < whole.size(); size += 7)
  {
    WriteBytes(path, Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
    EXPECT_THROW((void)SegmentationFile(path).Mask({}), std::runtime_error) << size;
  }
  std::string huge = Header(Notes);
  huge.replace(huge.find("sizes: 2 4 3 2"), 14, "sizes: 2 2000000000 2000000000 2000000000");
  WriteBytes(path, Concatenated(huge, Layers()));
  ExpectError([&] { (void)SegmentationFile(path).Mask({}); }, "impossible");
  std::string fractions = Header("Segment0_ID:=a\nSegment0_Layer:=0\n");
  fractions.replace(fractions.find("unsigned char"), 13, "float\nendian: little");
  const float half = 0.5F;
  Bytes values(24 * 2 * 4, 0);
  std::memcpy(values.data(), &half, sizeof(half));
  WriteBytes(path, Concatenated(fractions, values));
  ExpectError([&] { (void)SegmentationFile(path).Mask({}); }, "is no whole number");
  EXPECT_THROW(ParseSegments("no header at all", "x"), std::runtime_error);
  EXPECT_TRUE(ParseSegments("NRRD0004\ntype: short\n", "x").empty());
}

TEST(MaskResampling, SameShiftedAndTurnedVoxels)
{
  ImageGrid grid;
  grid.extent = { 0, 9, 0, 9, 0, 9 };
  grid.spacing = Vector3(0.5, 0.5, 0.75);
  std::vector<unsigned char> mask(1000, 0);
  for (int k = 3; k < 7; ++k)
  {
    for (int j = 2; j < 6; ++j)
    {
      for (int i = 1; i < 8; ++i)
      {
        mask[static_cast<std::size_t>((k * 10 + j) * 10 + i)] = 1;
      }
    }
  }
  const ResampledMask same = ResampleMask(grid, mask, grid);
  EXPECT_TRUE(same.sameVoxels);
  EXPECT_EQ(same.voxels, mask);
  EXPECT_EQ(same.insideShare, 1.0);
  // The same voxels, counted the other way round along x and y, and from elsewhere.
  ImageGrid turned = grid;
  turned.direction = Vector3(-1.0, -1.0, 1.0).asDiagonal();
  turned.origin = grid.IndexToWorld(11, 9, 0);
  turned.extent = { 0, 11, 0, 9, 0, 9 };
  const ResampledMask back = ResampleMask(grid, mask, turned);
  EXPECT_TRUE(back.sameVoxels);
  EXPECT_EQ(back.count, same.count);
  EXPECT_EQ(back.voxels[static_cast<std::size_t>((3 * 10 + (9 - 2)) * 12 + (11 - 1))], 1);
  // Finer voxels: eight for one, within the interpolation at the border.
  ImageGrid fine = grid;
  fine.origin = grid.IndexToWorld(-0.25, -0.25, -0.25);
  fine.spacing *= 0.5;
  fine.extent = { 0, 19, 0, 19, 0, 19 };
  const ResampledMask finer = ResampleMask(grid, mask, fine);
  EXPECT_FALSE(finer.sameVoxels);
  EXPECT_NEAR(
    static_cast<double>(finer.count) / (8.0 * static_cast<double>(same.count)), 1.0, 0.05);
  // Half of it only.
  ImageGrid half = grid;
  half.extent = { 0, 4, 0, 9, 0, 9 };
  EXPECT_NEAR(ResampleMask(grid, mask, half).insideShare, 4.0 / 7.0, 1e-9);
  ImageGrid away = grid;
  away.origin = Vector3(100.0, 0.0, 0.0);
  ExpectRefusal([&] { (void)ResampleMask(grid, mask, away); }, "does not overlap the image");
  ImageGrid corner = grid;
  corner.extent = { 9, 9, 9, 9, 9, 9 };
  ExpectRefusal([&] { (void)ResampleMask(grid, mask, corner); }, "No voxel of the mask");
  ExpectRefusal([&] { (void)ResampleMask(grid, { 1, 0 }, grid); }, "has 2 voxels");
}

TEST(Markups, SystemsAndUnits)
{
  const Vector3 lps(1.0, 2.0, 3.0);
  const Vector3 ras(-1.0, -2.0, 3.0);
  for (const auto& [system, expected] :
    { std::pair<std::string, Vector3>{ "", lps }, { ", \"coordinateSystem\": \"LPS\"", lps },
      { ", \"coordinateSystem\": \"RAS\"", ras }, { ", \"coordinateSystem\": 0", ras },
      { ", \"coordinateSystem\": 1", lps }, { ", \"coordinateSystem\": \"1\"", lps },
      { ", \"coordinateUnits\": [\"mm\", \"UCUM\", \"millimeter\"]", lps },
      { ", \"coordinateUnits\": \"um\"", 0.001 * lps } })
  {
    const auto markups = ParseMarkups(MarkupsWith(system, OnePoint), "x");
    ASSERT_EQ(markups.size(), 1u);
    EXPECT_TRUE(markups[0].points[0].position.isApprox(expected)) << system;
  }
}

TEST(Markups, RoundTrip)
{
  Markup curve;
  curve.name = "pLAD \"1\"";
  for (int n = 0; n < 5; ++n)
  {
    curve.points.push_back({ "p" + std::to_string(n), "", Vector3(0.1 * n, 1.0 / 3.0, -n) });
  }
  curve.measurements = { { "Radius", "mm", { 1.0 / 3.0, 1.1, 1.2, 1.3, 1.4 } } };
  const auto back = ParseMarkups(MarkupsText({ curve }), "x");
  ASSERT_EQ(back.size(), 1u);
  EXPECT_EQ(back[0].type, "Curve");
  EXPECT_EQ(back[0].name, curve.name);
  ASSERT_EQ(back[0].points.size(), 5u);
  for (std::size_t n = 0; n < 5; ++n)
  {
    EXPECT_EQ(back[0].points[n].position, curve.points[n].position);
  }
  ASSERT_NE(back[0].Find("Radius"), nullptr);
  EXPECT_EQ(back[0].Find("Radius")->values, curve.measurements[0].values);
  EXPECT_EQ(back[0].Find("Radius")->unit, "mm");
  curve.points[2].position[0] = std::nan("");
  ExpectRefusal([&] { (void)MarkupsText({ curve }); }, "not finite");
  curve.points.pop_back();
  curve.points[2].position[0] = 0.0;
  ExpectRefusal([&] { (void)MarkupsText({ curve }); }, "4 points and 5 values of Radius");
}

TEST(Markups, PointsWithoutAPositionAreLeftOutWithTheirValues)
{
  const std::string text = "{\"markups\": [{\"type\": \"Curve\", \"controlPoints\": [" + OnePoint +
    ", {\"positionStatus\": \"undefined\", \"position\": \"\"}, " + OnePoint +
    "], \"measurements\": [{\"name\": \"Radius\", \"controlPointValues\": [1, 2, 3]}]}]}";
  const auto markups = ParseMarkups(text, "x");
  ASSERT_EQ(markups[0].points.size(), 2u);
  EXPECT_EQ(markups[0].Find("Radius")->values, (std::vector<double>{ 1.0, 3.0 }));
}

TEST(Markups, Hostile)
{
  const auto refuse = [](const std::string& text, const std::string& part)
  { ExpectError([&] { (void)ParseMarkups(text, "bad.mrk.json"); }, part); };
  refuse("", "is not JSON");
  refuse("[]", "has no list 'markups'");
  refuse("{\"markups\": 3}", "has no list 'markups'");
  refuse("{\"markups\": [3]}", "markups[0] is not an object");
  refuse("{\"markups\": [{}]}", "is no type of markups");
  refuse("{\"markups\": [{\"type\": 7}]}", "markups[0].type is not a text");
  refuse(MarkupsWith("", "7"), "controlPoints[0] is not an object");
  refuse(MarkupsWith("", "{\"position\": [1, 2]}"), "position is not a list of three numbers");
  refuse(MarkupsWith("", "{\"position\": [1, 2, \"x\"]}"), "position[2] is not a finite number");
  refuse(MarkupsWith("", "{\"position\": [1, 2, 1e999]}"), "");
  refuse(MarkupsWith("", "{\"position\": [1, 2, NaN]}"), "is not JSON");
  refuse(MarkupsWith(", \"coordinateSystem\": \"XYZ\"", OnePoint), "coordinateSystem is \"XYZ\"");
  refuse(MarkupsWith(", \"coordinateSystem\": 2", OnePoint), "coordinateSystem is 2");
  refuse(MarkupsWith(", \"coordinateUnits\": \"inch\"", OnePoint), "coordinateUnits");
  refuse(std::string(100000, '['), "is nested more than 64 times");
  refuse(std::string(100000, '[') + std::string(100000, ']'), "is nested more than 64 times");
  const std::string whole = MarkupsWith("", OnePoint);
  for (std::size_t size = 0; size < whole.size(); size += 3)
  {
    EXPECT_THROW((void)ParseMarkups(whole.substr(0, size), "x"), std::runtime_error) << size;
  }
}

TEST(NrrdSequence, IsReadBack)
{
  const TemporaryFolder folder;
  ImageGrid grid;
  grid.extent = { 2, 5, 0, 2, 1, 2 };
  grid.origin = Vector3(1.0, -2.0, 0.1);
  grid.spacing = Vector3(0.5, 0.6, 0.7);
  grid.direction = Eigen::AngleAxisd(0.3, Vector3(1.0, 2.0, 0.5).normalized()).toRotationMatrix();
  const SequenceIndex index{ "time", "ms", { 0.0, 250.5, 700.0 } };
  for (const bool compress : { false, true })
  {
    const std::string path = folder / "a.seq.nrrd";
    WriteNrrdSequence(path, grid, index, compress,
      std::function<void(std::size_t, short*)>(
        [&](std::size_t volume, short* voxels)
        {
          for (int n = 0; n < 24; ++n)
          {
            voxels[n] = static_cast<short>(100 * static_cast<int>(volume) - n);
          }
        }));
    const GatedSeries series({ path });
    ASSERT_EQ(series.NumberOfPhases(), 3);
    EXPECT_TRUE(series.Grid().IndexToWorld(1, 2, 1).isApprox(grid.IndexToWorld(3, 2, 2), 1e-12));
    std::vector<short> voxels(24);
    ASSERT_TRUE(
      series.Source(2).Read(series.IndexInSource(2), series.Grid().extent, voxels.data()));
    EXPECT_EQ(voxels[5], 195);
    const Bytes bytes = ReadBytes(path);
    const std::string text(bytes.begin(), bytes.end());
    EXPECT_NE(text.find("axis 3 index values:=0 250.5 700\n"), std::string::npos);
    EXPECT_NE(text.find("units: \"\" \"\" \"\" \"ms\"\n"), std::string::npos);
    EXPECT_NE(text.find("kinds: domain domain domain list\n"), std::string::npos);
  }
  const std::function<void(std::size_t, float*)> none;
  ExpectRefusal(
    [&] {
      WriteNrrdSequence(folder / "b", grid, { "time", "ms", { 1.0, 1.0 } }, false, none);
    },
    "has to be finite and to increase");
}

TEST(SimVascular, PathAndContours)
{
  SimVascularPath path;
  path.id = 4;
  path.controlPoints = { Vector3(0, 0, 0), Vector3(1, 1.0 / 3.0, 2) };
  path.points = { { 0, Vector3(0, 0, 0), Vector3::UnitZ(), Vector3::UnitX() },
    { 1, Vector3(1, 1.0 / 3.0, 2), Vector3::UnitZ(), Vector3::UnitX() } };
  const SimVascularPath back = ParseSimVascularPath(SimVascularPathText(path), "x");
  EXPECT_EQ(back.id, 4);
  EXPECT_EQ(back.controlPoints, path.controlPoints);
  ASSERT_EQ(back.points.size(), 2u);
  EXPECT_EQ(back.points[1].position, path.points[1].position);
  SimVascularContourGroup group;
  group.pathName = "a <&> \"b\"";
  group.pathId = 4;
  SimVascularContour contour;
  contour.type = "Circle";
  contour.frame = path.points[1];
  for (int n = 0; n < 200; ++n)
  {
    const double angle = 2.0 * M_PI * n / 200.0;
    contour.contourPoints.emplace_back(3.0 + 2.0 * std::cos(angle), 2.0 * std::sin(angle), 5.0);
  }
  contour.controlPoints = { Vector3(3, 0, 5) };
  group.contours = { contour };
  const SimVascularContourGroup again =
    ParseSimVascularContours(SimVascularContourText(group), "x");
  EXPECT_EQ(again.pathName, group.pathName);
  ASSERT_EQ(again.contours.size(), 1u);
  EXPECT_EQ(again.contours[0].contourPoints, contour.contourPoints);
  EXPECT_NEAR(again.contours[0].Radius(), 2.0, 1e-3);
  EXPECT_TRUE(again.contours[0].Center().isApprox(Vector3(3, 0, 5), 1e-9));
}

TEST(SimVascular, OlderFilesWithTwoRootsAndSeveralTimes)
{
  const std::string text =
    "<?xml version=\"1.0\" ?>\n<format version=\"1.0\" />\n<path id=\"1\" method=\"0\">\n"
    "<timestep id=\"0\"><path_element><control_points><point id=\"0\" x=\"1\" y=\"2\" z=\"3\" />"
    "</control_points><path_points><path_point id=\"0\"><pos x=\"1\" y=\"2\" z=\"3\"/><tangent "
    "x='0' "
    "y='0' z='1'/><rotation x='1' y='0' "
    "z='0'/></path_point></path_points></path_element></timestep>"
    "<timestep id=\"1\"><path_element><path_points><path_point id=\"0\"><pos x=\"9\" y=\"9\" "
    "z=\"9\"/>"
    "</path_point></path_points></path_element></timestep></path>\n";
  const SimVascularPath path = ParseSimVascularPath(text, "x");
  ASSERT_EQ(path.points.size(), 1u);
  EXPECT_EQ(path.points[0].position, Vector3(1, 2, 3));
  const auto refuse = [](const std::string& bad, const std::string& part)
  { ExpectError([&] { (void)ParseSimVascularPath(bad, "bad.pth"); }, part); };
  refuse("", "line 1: is no XML: no element found");
  refuse("<other/>", "has no element 'path'");
  refuse("<path>", "ends inside the element 'path'");
  refuse("<path></path>", "has no points");
  refuse("<path></other>", "line 1: is no XML: mismatched tag inside 'path'");
  refuse("\n<path id=3></path>", "line 2: is no XML: not well-formed");
  refuse("<!-- ", "unclosed token");
  refuse("<format/><path><timestep><path_element><path_points><path_pointed><pos/></path_pointed>"
         "</path_points></path_element></timestep></path>",
    "has no points");
  std::string deep;
  for (int n = 0; n < 1000; ++n)
  {
    deep += "<a>";
  }
  refuse(deep, "elements in each other");
  for (const char* number : { "nan", "inf", "1e999", "x", "" })
  {
    std::string bad = text;
    bad.replace(bad.find("y=\"2\""), 5, std::string("y=\"") + number + "\"");
    refuse(bad, "which is not a finite number");
  }
  for (std::size_t size = 0; size + 2 < text.size(); size += 5)
  {
    EXPECT_THROW((void)ParseSimVascularPath(text.substr(0, size), "x"), std::runtime_error) << size;
  }
}

TEST(SeriesDescriptionMask, IsKept)
{
  const TemporaryFolder folder;
  SeriesDescription series;
  series.phases = { { 0.0, "a.mha", "", "", "a.seg.nrrd" }, { 0.5, "b.mha", "", "", "" } };
  WriteSeriesDescription(folder / "series.json", series);
  const SeriesDescription back = ReadSeriesDescription(folder / "series.json");
  EXPECT_EQ(back.phases[0].mask, "a.seg.nrrd");
  EXPECT_EQ(back.phases[1].mask, "");
  WriteText(
    folder / "bad.json", "{\"phases\": [{\"fraction\": 0, \"image\": \"a.mha\", \"mask\": 3}]}");
  ExpectError(
    [&] { (void)ReadSeriesDescription(folder / "bad.json"); }, "phases[0].mask is not a text");
}
}
