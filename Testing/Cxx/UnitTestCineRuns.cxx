// Cine runs of a session, and their DICOM files, read back by GDCM.
#include "CineRuns.h"
#include "Numbers.h"
#include "Refusals.h"
#include "XrayAngiogram.h"

#include <gdcmImageReader.h>
#include <gdcmStringFilter.h>
#include <gdcmUIDGenerator.h>

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>
#include <vector>

namespace UnitTestCineRuns
{
using coronary::CineRuns;
using coronary::XrayAngiogram;
namespace fs = std::filesystem;

namespace
{
/// Three frames of 7 x 5 pixels: an odd number of bytes.
XrayAngiogram SmallRun()
{
  XrayAngiogram run;
  run.patient = "Ph\xc3\xa4ntom^\\one";
  run.view = "RAO 30 CRA 20";
  run.program = "test 1";
  run.study = 77;
  run.run = 2;
  run.columns = 7;
  run.rows = 5;
  run.width = 210.0;
  run.height = 150.0;
  run.sourceToDetector = 1100.0;
  run.sourceToIsocentre = 800.0;
  run.areaDose = 0.0123;
  for (int f = 0; f < 3; ++f)
  {
    XrayAngiogram::Frame frame;
    for (int p = 0; p < 35; ++p)
    {
      frame.pixels.push_back(static_cast<std::uint8_t>(100 * f + p));
    }
    frame.primary = -30.25;
    frame.secondary = 20.0;
    frame.seconds = 4.0 + f / 15.0;
    frame.afterRWave = f == 1;
    run.frames.push_back(frame);
  }
  return run;
}

class CineFiles : public ::testing::Test
{
protected:
  void SetUp() override
  {
    this->Folder = fs::temp_directory_path() / ("cine runs." + std::to_string(getpid()));
    fs::create_directories(this->Folder);
  }
  void TearDown() override { fs::remove_all(this->Folder); }

  std::string Write(const XrayAngiogram& run, const std::string& name = "run.dcm")
  {
    const std::string path = (this->Folder / name).string();
    WriteXrayAngiogram(run, path);
    return path;
  }

  /// A value as text, without what pads it.
  static std::string Value(const std::string& path, std::uint16_t group, std::uint16_t element)
  {
    gdcm::Reader reader;
    reader.SetFileName(path.c_str());
    EXPECT_TRUE(reader.Read());
    gdcm::StringFilter filter;
    filter.SetFile(reader.GetFile());
    std::string text = filter.ToString(gdcm::Tag(group, element));
    while (!text.empty() && (text.back() == ' ' || text.back() == '\0'))
    {
      text.pop_back();
    }
    return text;
  }

  static std::string BytesOf(const std::string& path)
  {
    std::ifstream file(path, std::ios::binary);
    return { std::istreambuf_iterator<char>(file), {} };
  }

  fs::path Folder;
};
}

TEST_F(CineFiles, GdcmReadsWhatWasWritten)
{
  const XrayAngiogram run = SmallRun();
  const std::string path = this->Write(run);
  gdcm::ImageReader reader;
  reader.SetFileName(path.c_str());
  ASSERT_TRUE(reader.Read());
  EXPECT_EQ(reader.GetFile().GetHeader().GetMediaStorageAsString(), "1.2.840.10008.5.1.4.1.1.12.1");
  const gdcm::Image& image = reader.GetImage();
  ASSERT_EQ(image.GetNumberOfDimensions(), 3U);
  EXPECT_EQ(image.GetDimension(0), 7U);
  EXPECT_EQ(image.GetDimension(1), 5U);
  EXPECT_EQ(image.GetDimension(2), 3U);
  EXPECT_EQ(image.GetPhotometricInterpretation(),
    gdcm::PhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2));
  std::vector<char> pixels(image.GetBufferLength());
  ASSERT_EQ(pixels.size(), 105U);
  ASSERT_TRUE(image.GetBuffer(pixels.data()));
  for (std::size_t n = 0; n < pixels.size(); ++n)
  {
    ASSERT_EQ(static_cast<std::uint8_t>(pixels[n]), run.frames[n / 35].pixels[n % 35]) << n;
  }
  const std::vector<std::pair<std::pair<int, int>, std::string>> expected{
    { { 0x0008, 0x0060 }, "XA" },
    { { 0x0008, 0x0008 }, "ORIGINAL\\PRIMARY\\SINGLE PLANE" },
    { { 0x0010, 0x0010 }, "Simulated^Ph\xc3\xa4ntom  one" }, // no separators of DICOM
    { { 0x0008, 0x103e }, "RAO 30 CRA 20" },
    { { 0x0018, 0x1063 }, "66.666667" },
    { { 0x0018, 0x1110 }, "1100" },
    { { 0x0018, 0x1111 }, "800" },
    { { 0x0018, 0x1114 }, "1.375" },
    { { 0x0018, 0x1164 }, "30\\30" },
    { { 0x0018, 0x115e }, "0.123" }, // dGy cm^2
    { { 0x0018, 0x1500 }, "STATIC" },
    { { 0x0018, 0x1134 }, "STATIC" },
    { { 0x0018, 0x1510 }, "-30.25" },
    { { 0x0018, 0x1511 }, "20" },
    { { 0x0020, 0x0012 }, "2" },
    { { 0x0028, 0x0008 }, "3" },
    { { 0x0028, 0x1040 }, "DISP" },
    { { 0x0028, 0x6040 }, "2" },
  };
  for (const auto& [tag, value] : expected)
  {
    EXPECT_EQ(
      Value(path, static_cast<std::uint16_t>(tag.first), static_cast<std::uint16_t>(tag.second)),
      value)
      << std::hex << tag.first << "," << tag.second;
  }
}

TEST_F(CineFiles, ShuttersAreWrittenWhereThereAreAny)
{
  XrayAngiogram run = SmallRun();
  EXPECT_EQ(Value(this->Write(run), 0x0018, 0x1700), "");
  run.shutterLeft = 1;
  run.shutterRight = 2;
  run.shutterBottom = 1;
  const std::string path = this->Write(run);
  EXPECT_EQ(Value(path, 0x0018, 0x1700), "RECTANGULAR");
  // The last column, or row, that is covered; all are counted from 1.
  EXPECT_EQ(Value(path, 0x0018, 0x1702), "1");
  EXPECT_EQ(Value(path, 0x0018, 0x1704), "6");
  EXPECT_EQ(Value(path, 0x0018, 0x1706), "0");
  EXPECT_EQ(Value(path, 0x0018, 0x1708), "5");
}

TEST_F(CineFiles, IdentifiersAreThoseOfTheImages)
{
  XrayAngiogram run = SmallRun();
  const std::string one = this->Write(run, "one.dcm");
  EXPECT_EQ(BytesOf(one), BytesOf(this->Write(run, "again.dcm")));
  run.frames[1].pixels[3] ^= 1U;
  const std::string other = this->Write(run, "other.dcm");
  EXPECT_NE(Value(one, 0x0008, 0x0018), Value(other, 0x0008, 0x0018));
  EXPECT_EQ(Value(one, 0x0020, 0x000d), Value(other, 0x0020, 0x000d));
  for (const auto& [group, element] :
    std::vector<std::pair<int, int>>{ { 0x0008, 0x0018 }, { 0x0020, 0x000d }, { 0x0020, 0x000e } })
  {
    const std::string uid =
      Value(one, static_cast<std::uint16_t>(group), static_cast<std::uint16_t>(element));
    EXPECT_TRUE(gdcm::UIDGenerator::IsValid(uid.c_str())) << uid;
    EXPECT_EQ(uid.rfind("2.25.", 0), 0U) << uid;
  }
}

TEST_F(CineFiles, WhatMovesAndWhatIsMissingIsWritten)
{
  XrayAngiogram run = SmallRun();
  run.frames[1].primary = -29.0;
  run.frames[2].primary = -27.0;
  run.frames[2].isocentre = { 5.0, -2.0, 1.0 };
  run.frames[2].seconds = run.frames[1].seconds + 0.2;
  run.dropped = 4;
  run.subtracted = true;
  const std::string path = this->Write(run);
  EXPECT_EQ(Value(path, 0x0018, 0x1500), "DYNAMIC");
  EXPECT_EQ(Value(path, 0x0018, 0x1520), "0\\1.25\\3.25");
  EXPECT_EQ(Value(path, 0x0018, 0x1521), "0\\0\\0");
  EXPECT_EQ(Value(path, 0x0018, 0x1134), "DYNAMIC");
  EXPECT_EQ(Value(path, 0x0018, 0x1135), "0\\0\\2");
  EXPECT_EQ(Value(path, 0x0018, 0x1136), "0\\0\\-5");
  EXPECT_EQ(Value(path, 0x0018, 0x1137), "0\\0\\-1");
  EXPECT_EQ(Value(path, 0x0018, 0x1065), "0\\66.666667\\200");
  EXPECT_EQ(Value(path, 0x0018, 0x1063), "");
  EXPECT_EQ(Value(path, 0x0008, 0x0008), "DERIVED\\PRIMARY\\SINGLE PLANE");
  EXPECT_NE(Value(path, 0x0020, 0x4000).find("first 4 frames"), std::string::npos);
}

TEST_F(CineFiles, RefusesWhatIsNoRun)
{
  const auto write = [this](const XrayAngiogram& run)
  { WriteXrayAngiogram(run, (this->Folder / "no.dcm").string()); };
  ExpectRefusal([&] { write(XrayAngiogram()); }, "no frame");
  XrayAngiogram run = SmallRun();
  run.frames[2].pixels.pop_back();
  ExpectRefusal([&] { write(run); }, "different sizes");
  run = SmallRun();
  run.columns = 70000;
  ExpectRefusal([&] { write(run); }, "too large");
  EXPECT_FALSE(fs::exists(this->Folder / "no.dcm"));
  EXPECT_THROW(WriteXrayAngiogram(SmallRun(), (this->Folder / "none" / "no.dcm").string()),
    std::runtime_error);
}

namespace
{
constexpr int Size = 16;

/// An exposure of a session that beats once a second, at 15 Hz.
coronary::SessionSnapshot Moment(int frame, std::int64_t run)
{
  coronary::SessionSnapshot moment;
  moment.seconds = frame / 15.0;
  moment.tick = static_cast<std::uint64_t>(1 + 2000 * frame / 15);
  moment.report.phase = moment.seconds - static_cast<int>(moment.seconds);
  moment.fieldOfView = 200.0;
  moment.exposure.cine = run > 0;
  moment.exposure.run = run;
  moment.metrics.doseAreaProduct = 0.5 * frame;
  moment.contrast.injected = 0.25 * frame;
  moment.pose.primary = 30.0 * coronary::Degree;
  return moment;
}

coronary::GreyImage Grey(int value)
{
  return { Size, Size, std::vector<std::uint8_t>(Size * Size, static_cast<std::uint8_t>(value)) };
}

constexpr auto Plain = coronary::ImageMode::Plain;
}

TEST(CineRuns, KeepFramesAndHowTheyWereMade)
{
  CineRuns runs(coronary::Scenario(), "test");
  runs.Add(Moment(13, 0), Grey(1), Plain);
  EXPECT_TRUE(runs.Runs().empty());
  for (int frame = 14; frame < 18; ++frame)
  {
    runs.Add(Moment(frame, 1), Grey(frame), Plain);
  }
  runs.Add(Moment(18, 0), Grey(1), Plain);
  runs.Add(Moment(19, 2), Grey(19), coronary::ImageMode::Subtraction);
  ASSERT_EQ(runs.Runs().size(), 2U);
  const XrayAngiogram& first = runs.Runs().front();
  ASSERT_EQ(first.frames.size(), 4U);
  EXPECT_EQ(first.run, 1);
  EXPECT_EQ(first.frames[2].pixels, Grey(16).values);
  EXPECT_NEAR(first.frames[2].primary, 30.0, 1e-12);
  EXPECT_NEAR(first.areaDose, 4 * 0.5, 1e-12);
  EXPECT_NEAR(first.contrast, 0.25 * 17, 1e-12);
  EXPECT_FALSE(first.frames[0].afterRWave);
  EXPECT_TRUE(first.frames[1].afterRWave); // at one second
  EXPECT_FALSE(first.frames[2].afterRWave);
  EXPECT_FALSE(first.subtracted);
  EXPECT_TRUE(runs.Runs().back().subtracted);
  EXPECT_EQ(runs.Runs().back().study, first.study);
  EXPECT_NEAR(runs.Runs().back().areaDose, 0.5, 1e-12);
}

TEST(CineRuns, AreStoredWithinTheirMemory)
{
  CineRuns runs(coronary::Scenario(), "test", 10 * Size * Size);
  for (int frame = 0; frame < 4; ++frame)
  {
    runs.Add(Moment(frame, 1), Grey(frame), Plain);
  }
  for (int frame = 5; frame < 13; ++frame)
  {
    runs.Add(Moment(frame, 2), Grey(frame), Plain);
  }
  // Twelve frames where there is room for ten.
  EXPECT_EQ(runs.Bytes(), 10U * Size * Size);
  ASSERT_EQ(runs.Runs().size(), 2U);
  EXPECT_EQ(runs.Runs().front().dropped, 2);
  EXPECT_EQ(runs.Runs().front().frames[0].pixels, Grey(2).values);
  EXPECT_EQ(runs.Runs().back().dropped, 0);
  EXPECT_EQ(runs.Runs().back().frames[7].pixels, Grey(12).values);
  // One frame always stays; runs without frames go.
  CineRuns none(coronary::Scenario(), "test", 0);
  none.Add(Moment(0, 1), Grey(0), Plain);
  none.Add(Moment(1, 2), Grey(1), Plain);
  none.Add(Moment(2, 2), Grey(2), Plain);
  ASSERT_EQ(none.Runs().size(), 1U);
  EXPECT_EQ(none.Runs().front().dropped, 1);
  EXPECT_EQ(none.Runs().front().frames[0].pixels, Grey(2).values);
}

TEST(CineRuns, AreHandedOverWholeOrInParts)
{
  CineRuns runs(coronary::Scenario(), "test");
  runs.Add(Moment(0, 1), Grey(0), Plain);
  runs.Add(Moment(1, 1), Grey(1), Plain);
  EXPECT_TRUE(runs.Take(false).empty());
  auto taken = runs.Take(true);
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(NameOfCineFile(taken[0]), "cine_01.dcm");
  EXPECT_EQ(runs.Bytes(), 0U);
  // Goes on in another part, and so it does in another field, or between other shutters.
  runs.Add(Moment(2, 1), Grey(2), Plain);
  coronary::SessionSnapshot wider = Moment(3, 1);
  wider.fieldOfView = 250.0;
  runs.Add(wider, Grey(3), Plain);
  runs.Add(Moment(4, 0), Grey(4), Plain);
  taken = runs.Take(false);
  ASSERT_EQ(taken.size(), 2U);
  EXPECT_EQ(NameOfCineFile(taken[0]), "cine_01_2.dcm");
  EXPECT_EQ(NameOfCineFile(taken[1]), "cine_01_3.dcm");
  EXPECT_EQ(taken[1].width, 250.0);
  EXPECT_EQ(taken[0].frames.size(), 1U);
}
}
