// The file formats in plain C++: geometry, values, times, and the message for every kind of bad
// input. The files are written by FormatTestFiles, not by the code under test.
#include "AtomicFile.h"
#include "FileSeries.h"
#include "FormatTestFiles.h"
#include "GatedSeries.h"
#include "MarkupsFile.h"
#include "MetaImageWriter.h"
#include "SeriesDescription.h"
#include "SimVascularFile.h"
#include "TextFile.h"
#include "VolumeFile.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <limits>
#include <sstream>
#include <sys/resource.h>
#include <sys/stat.h>

namespace UnitTestFormats
{
using namespace coronary;
using namespace formattest;

namespace
{
constexpr double Nan = std::numeric_limits<double>::quiet_NaN();
const std::array<int, 3> Size{ 4, 3, 2 };

std::string MessageOf(const std::function<void()>& action)
{
  try
  {
    action();
  }
  catch (const Cancelled&)
  {
    return "cancelled";
  }
  catch (const std::runtime_error& error)
  {
    return error.what();
  }
  return "no exception";
}

void ExpectMessage(const std::string& message, const std::vector<std::string>& parts)
{
  for (const std::string& part : parts)
  {
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in: " << message;
  }
}

// Opens and reads everything, as a program would.
void ReadAll(const std::vector<std::string>& paths, const GatedSeriesOptions& options = {})
{
  const GatedSeries series(paths, options);
  const std::array<int, 6>& e = series.Grid().extent;
  std::vector<float> values(static_cast<std::size_t>(e[1] + 1) *
    static_cast<std::size_t>(e[3] + 1) * static_cast<std::size_t>(e[5] + 1));
  for (int p = 0; p < series.NumberOfPhases(); ++p)
  {
    series.Source(p).Read(series.IndexInSource(p), e, values.data());
  }
}

std::string MessageOfReading(const std::string& path, const GatedSeriesOptions& options = {})
{
  return MessageOf([&] { ReadAll({ path }, options); });
}

std::vector<short> Shorts(const GatedSeries& series, int phase)
{
  const std::array<int, 6>& e = series.Grid().extent;
  std::vector<short> values(static_cast<std::size_t>(e[1] + 1) *
    static_cast<std::size_t>(e[3] + 1) * static_cast<std::size_t>(e[5] + 1));
  EXPECT_TRUE(series.Source(phase).Read(series.IndexInSource(phase), e, values.data()));
  return values;
}

void ExpectValues(const GatedSeries& series, int phase)
{
  const std::array<int, 6>& e = series.Grid().extent;
  const std::vector<short> values = Shorts(series, phase);
  std::size_t v = 0;
  for (int k = 0; k <= e[5]; ++k)
  {
    for (int j = 0; j <= e[3]; ++j)
    {
      for (int i = 0; i <= e[1]; ++i)
      {
        ASSERT_EQ(values[v++], Value(i, j, k, phase)) << i << " " << j << " " << k;
      }
    }
  }
}

void ExpectNear(const Vector3& a, const Vector3& b, double tolerance = 1e-4)
{
  EXPECT_LT((a - b).norm(), tolerance) << a.transpose() << " and " << b.transpose();
}

Matrix3 ObliqueRotation()
{
  return (Eigen::AngleAxisd(0.4, Vector3(1, 2, 3).normalized()) *
    Eigen::AngleAxisd(-0.9, Vector3::UnitX()))
    .toRotationMatrix();
}

std::string NrrdHeaderText(const std::string& fields)
{
  return "NRRD0004\n# written by a test\ntype: short\nencoding: raw\nendian: little\n" + fields;
}

const std::string Nrrd3 = "dimension: 3\nsizes: 4 3 2\nkinds: domain domain domain\n"
                          "space: left-posterior-superior\n"
                          "space directions: (0.5,0,0) (0,0.5,0) (0,0,1)\nspace origin: (1,2,3)\n";

const std::string Mha3 = "ObjectType = Image\nNDims = 3\nBinaryData = True\n"
                         "BinaryDataByteOrderMSB = False\nElementSpacing = 0.5 0.5 1\n"
                         "DimSize = 4 3 2\nElementType = MET_SHORT\nElementDataFile = LOCAL\n";

std::string Replaced(std::string text, const std::string& what, const std::string& with)
{
  const std::size_t position = text.find(what);
  EXPECT_NE(position, std::string::npos) << what;
  return text.replace(position, what.size(), with);
}
}

TEST(AtomicFile, KeepsTheOldFileUntilTheNewOneIsWhole)
{
  const TemporaryFolder folder;
  const std::string path = folder / "a.txt";
  WriteText(path, "old");
  {
    const AtomicFile file(path);
    WriteText(file.TemporaryPath(), "half");
    EXPECT_EQ(ReadBytes(path), Bytes({ 'o', 'l', 'd' }));
  }
  EXPECT_EQ(folder.NumberOfEntries(), 1);
  WriteFileAtomically(path, "new");
  EXPECT_EQ(ReadBytes(path), Bytes({ 'n', 'e', 'w' }));
  EXPECT_EQ(folder.NumberOfEntries(), 1);
}

TEST(AtomicFile, WhatKilledProcessesLeftIsRemoved)
{
  const TemporaryFolder folder;
  const std::string path = folder / "weights.bin";
  const AtomicFile young(path);
  const std::string left[] = { folder / ".weights.123-4.bin", folder / ".weights.12a-4.bin",
    folder / ".weights.123-4.txt", folder / ".other.123-4.bin", folder / "weights.1-2.bin" };
  for (const std::string& name : left)
  {
    WriteText(name, "half");
    std::filesystem::last_write_time(
      name, std::filesystem::file_time_type::clock::now() - std::chrono::hours(2));
  }
  RemoveAbandonedFiles(path);
  EXPECT_FALSE(std::filesystem::exists(left[0]));
  EXPECT_TRUE(std::filesystem::exists(young.TemporaryPath()));
  for (int n = 1; n < 5; ++n)
  {
    EXPECT_TRUE(std::filesystem::exists(left[n])) << left[n];
  }
  RemoveAbandonedFiles(folder / "other");
  EXPECT_TRUE(std::filesystem::exists(left[3]));
  std::filesystem::rename(left[3], folder / ".other.123-4");
  RemoveAbandonedFiles(folder / "other");
  EXPECT_FALSE(std::filesystem::exists(folder / ".other.123-4"));
  RemoveAbandonedFiles(folder / "nowhere/weights.bin");
}

TEST(AtomicFile, SaysWhyItCannotWrite)
{
  const TemporaryFolder folder;
  ExpectMessage(MessageOf([&] { WriteFileAtomically((folder / "x") + "/missing/a", "b"); }),
    { "Cannot write", "missing/a", "No such file or directory" });
  std::filesystem::create_directory(folder / "sub");
  ExpectMessage(
    MessageOf([&] { WriteFileAtomically(folder / "sub", "b"); }), { "sub'", "it is a folder" });
}

TEST(SeriesDescription, WritingAndReadingGivesTheSame)
{
  const TemporaryFolder folder;
  SeriesDescription d;
  d.cycleMs = 1000.0 / 3.0;
  d.phases = { { -0.05, "phase_00.mha", "truth/surface_00.vtp", "truth/centerline_00.vtp" },
    { 0.1 + 0.2, "phase_01.mha", "", "" } };
  d.seeds = { { "LCA", Vector3(1.0 / 3.0, -2e-300, 1e20) },
    { "R \"C\" A\xc3\xa9", Vector3::Ones() } };
  const std::string path = folder / "series.json";
  WriteSeriesDescription(path, d);
  const SeriesDescription r = ReadSeriesDescription(path);
  EXPECT_EQ(r.cycleMs, d.cycleMs);
  ASSERT_EQ(r.phases.size(), 2u);
  for (std::size_t p = 0; p < 2; ++p)
  {
    EXPECT_EQ(r.phases[p].fraction, d.phases[p].fraction);
    EXPECT_EQ(r.phases[p].image, d.phases[p].image);
    EXPECT_EQ(r.phases[p].surface, d.phases[p].surface);
    EXPECT_EQ(r.phases[p].centerline, d.phases[p].centerline);
  }
  ASSERT_EQ(r.seeds.size(), 2u);
  EXPECT_EQ(r.seeds[0].position, d.seeds[0].position);
  EXPECT_EQ(r.seeds[1].name, d.seeds[1].name);
  EXPECT_EQ(ResolveSeriesPath("/a/b/series.json", "c/d.mha"), "/a/b/c/d.mha");
  EXPECT_EQ(ResolveSeriesPath("/a/b/series.json", "/c/d.mha"), "/c/d.mha");
}

TEST(SeriesDescription, BadInputGivesOneClearMessage)
{
  const TemporaryFolder folder;
  const std::string path = folder / "series.json";
  const auto message = [&](const std::string& text)
  {
    WriteText(path, text);
    return MessageOf([&] { ReadSeriesDescription(path); });
  };
  const std::string good = R"("phases":[{"fraction":0,"image":"a.mha"}])";
  EXPECT_EQ(message("{" + good + R"(,"note":[1,{"x":null}]})"), "no exception");
  ExpectMessage(message(""), { "series.json", "is empty" });
  ExpectMessage(message("\x89PNG garbage"), { "series.json", "is not JSON" });
  ExpectMessage(message(R"({"phases":)"), { "series.json", "is not JSON" });
  ExpectMessage(message("[]"), { "not a JSON object" });
  ExpectMessage(message("{}"), { "no list 'phases'" });
  ExpectMessage(message(R"({"phases":[]})"), { "has no phases" });
  ExpectMessage(message(R"({"phases":[{"image":"a"}]})"), { "phases[0] has no 'fraction'" });
  ExpectMessage(message(R"({"phases":[{"fraction":0}]})"), { "phases[0] has no 'image'" });
  ExpectMessage(message(R"({"phases":[{"fraction":NaN,"image":"a"}]})"),
    { "phases[0].fraction is not a finite number" });
  ExpectMessage(
    message(R"({"phases":[{"fraction":0.1,"image":"a"},{"fraction":0.1,"image":"b"}]})"),
    { "phases[1].fraction is not greater" });
  ExpectMessage(message("{" + good + R"(,"cycle_ms":0})"), { "cycle_ms is not a positive number" });
  ExpectMessage(message("{" + good + R"(,"cycle_ms":"1"})"), { "cycle_ms is not a finite number" });
  ExpectMessage(message("{" + good + R"(,"seeds":[{"name":"NaN","position":[0,NaN,0]}]})"),
    { "seeds[0] ('NaN'): position[1] is not a finite number" });
  ExpectMessage(message("{" + good + R"(,"seeds":[{"name":"L","position":[0,0]}]})"),
    { "seeds[0] ('L')", "three numbers" });
  ExpectMessage(MessageOf([&] { ReadSeriesDescription(folder / "none.json"); }),
    { "none.json' does not exist" });

  SeriesDescription d;
  d.phases = { { 0.0, "a.mha", "", "" } };
  d.seeds = { { "L", Vector3(0, Nan, 0) } };
  ExpectMessage(
    MessageOf([&] { WriteSeriesDescription(folder / "w.json", d); }), { "seeds[0]", "not finite" });
  EXPECT_FALSE(std::filesystem::exists(folder / "w.json"));
}

TEST(TextFile, IsReadWholeUpToItsBound)
{
  const TemporaryFolder folder;
  std::string text(200000, 'x');
  text += std::string("\0\n\r\n", 4);
  WriteText(folder / "a.txt", text);
  EXPECT_EQ(ReadTextFile(folder / "a.txt", "a test", text.size()), text);
  ExpectMessage(MessageOf([&] { ReadTextFile(folder / "a.txt", "a test", text.size() - 1); }),
    { "a.txt': is too large for a test" });
  WriteText(folder / "empty", "");
  EXPECT_EQ(ReadTextFile(folder / "empty", "a test", 0), "");
  ExpectMessage(
    MessageOf([&] { ReadTextFile(folder / "none", "a test"); }), { "Cannot open", "none'" });
  ExpectMessage(MessageOf([&] { ReadTextFile(folder / "", "a test"); }), { "cannot be read" });
  ExpectMessage(MessageOf([] { ReadTextFile("/dev/zero", "a test", 100000); }), { "too large" });

  // The formats that a window reads do not wait for who writes into a pipe.
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (void (*const read)(const std::string&) :
    { +[](const std::string& path) { ReadSeriesDescription(path); },
      +[](const std::string& path) { ReadFileSeries(path); },
      +[](const std::string& path) { ReadMarkupsFile(path); },
      +[](const std::string& path) { ReadSimVascularFile(path); } })
  {
    ExpectMessage(MessageOf([&] { read(folder / "pipe"); }), { "pipe' is not a file" });
    ExpectMessage(MessageOf([&] { read(folder / "none"); }), { "none' does not exist" });
  }
}

TEST(MetaImage, WrittenImagesComeBackWithTheirGeometry)
{
  const TemporaryFolder folder;
  ImageGrid grid;
  grid.extent = { 2, 5, -1, 1, 0, 1 };
  grid.origin = Vector3(1.25, -200.0 / 3.0, 3e-4);
  grid.spacing = Vector3(0.4, 0.45, 0.6);
  grid.direction = ObliqueRotation();
  std::vector<short> values;
  std::vector<float> reals;
  for (int v = 0; v < 24; ++v)
  {
    values.push_back(Value(v % 4, v / 4 % 3, v / 12));
    reals.push_back(static_cast<float>(values.back()) + 0.25f);
  }
  for (const bool compress : { false, true })
  {
    const std::string path = folder / (compress ? "c.mha" : "r.mha");
    WriteMetaImage(path, grid, values.data(), compress);
    const GatedSeries series({ path });
    ExpectValues(series, 0);
    EXPECT_TRUE(series.FitsShort());
    ExpectNear(series.Grid().origin, grid.IndexToWorld(2, -1, 0), 1e-12);
    EXPECT_LT((series.Grid().direction - grid.direction).norm(), 1e-12);
    EXPECT_LT((series.Grid().spacing - grid.spacing).norm(), 1e-12);
  }
  const std::string path = folder / "f.mha";
  WriteMetaImage(path, grid, reals.data(), true);
  const GatedSeries series({ path });
  EXPECT_FALSE(series.FitsShort());
  std::vector<float> read(24);
  series.Source(0).Read(0, series.Grid().extent, read.data());
  EXPECT_EQ(read, reals);
  // A sub-extent.
  std::vector<float> part(2);
  series.Source(0).Read(0, { 1, 2, 2, 2, 1, 1 }, part.data());
  EXPECT_EQ(part, std::vector<float>({ reals[21], reals[22] }));
}

TEST(MetaImage, DamageIsFoundThatMakesOtherData)
{
  // Data that can be decoded, and more of it than voxels: only the checksum behind tells.
  const TemporaryFolder folder;
  ImageGrid grid;
  grid.extent = { 0, 3, 0, 2, 0, 1 };
  const std::vector<unsigned char> more(100, 7);
  std::vector<unsigned char> packed(200);
  uLongf size = packed.size();
  ASSERT_EQ(compress(packed.data(), &size, more.data(), more.size()), Z_OK);
  const std::string path = folder / "c.mha";
  WriteMetaImage(path, grid, std::vector<short>(24, 7).data(), true);
  const Bytes whole = ReadBytes(path);
  const std::string text(whole.begin(), whole.end());
  const std::string last = "ElementDataFile = LOCAL\n";
  Bytes bytes(
    whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(text.find(last) + last.size()));
  bytes.insert(bytes.end(), packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size));
  std::vector<float> read(24);
  const auto message = [&]
  {
    WriteBytes(path, bytes);
    return MessageOf(
      [&]
      {
        const GatedSeries series({ path });
        series.Source(0).Read(0, series.Grid().extent, read.data());
      });
  };
  EXPECT_EQ(message(), "no exception");
  bytes.back() = static_cast<unsigned char>(bytes.back() ^ 1U);
  ExpectMessage(message(), { "c.mha", "damaged", "data check" });
  bytes.resize(bytes.size() - 2);
  ExpectMessage(message(), { "c.mha", "damaged", "end is missing" });
}

TEST(MetaImage, WritingLeavesNothingHalfDone)
{
  const TemporaryFolder folder;
  ImageGrid grid;
  grid.extent = { 0, 127, 0, 127, 0, 127 };
  const std::vector<short> values(128 * 128 * 128, 7);
  ExpectMessage(
    MessageOf([&] { WriteMetaImage((folder / "x") + "/no/a.mha", grid, values.data(), false); }),
    { "Cannot write", "no/a.mha" });
  EXPECT_EQ(MessageOf(
              [&]
              {
                WriteMetaImage(
                  folder / "b.mha", grid, values.data(), false, [](double f) { return f < 0.5; });
              }),
    "cancelled");
  ImageGrid bad = grid;
  bad.spacing[1] = Nan;
  ExpectMessage(MessageOf([&] { WriteMetaImage(folder / "c.mha", bad, values.data(), false); }),
    { "c.mha", "finite" });

  // A limit on file sizes acts as a full disk does.
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  rlimit small = old;
  small.rlim_cur = 100000;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string message =
    MessageOf([&] { WriteMetaImage(folder / "d.mha", grid, values.data(), false); });
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  ExpectMessage(message, { "Cannot write", "d.mha", "File too large" });
  EXPECT_EQ(folder.NumberOfEntries(), 0);
}

TEST(MetaImage, BigEndianDataInAnotherFile)
{
  const TemporaryFolder folder;
  std::string header = Replaced(Mha3, "MSB = False", "MSB = True");
  header = Replaced(header, "LOCAL", "sub/a.raw");
  header = Replaced(header, "NDims = 3\n",
    "NDims = 3\nTransformMatrix = 0 1 0 -1 0 0 0 0 1\n"
    "Offset = 10 20 30\n");
  WriteText(folder / "a.mhd", header);
  WriteBytes(folder / "sub/a.raw", Voxels(Size, 1, true));
  const GatedSeries series({ folder / "a.mhd" });
  ExpectValues(series, 0);
  // Axis i goes along +y, axis j along -x.
  ExpectNear(series.Grid().IndexToWorld(1, 0, 0), Vector3(10, 20.5, 30));
  ExpectNear(series.Grid().IndexToWorld(0, 1, 0), Vector3(9.5, 20, 30));
}

TEST(MetaImage, FourthAxisIsTime)
{
  const TemporaryFolder folder;
  std::string header = Replaced(Mha3, "NDims = 3", "NDims = 4");
  header = Replaced(header, "= 4 3 2", "= 4 3 2 3");
  header = Replaced(header, "0.5 0.5 1", "0.5 0.5 1 1");
  WriteBytes(folder / "a.mha", Concatenated(header, Voxels(Size, 3)));
  const GatedSeries series({ folder / "a.mha" });
  ASSERT_EQ(series.NumberOfPhases(), 3);
  EXPECT_DOUBLE_EQ(series.Fraction(2), 2.0 / 3.0);
  for (const int p : { 2, 0, 1 })
  {
    ExpectValues(series, p);
  }
}

TEST(Nifti, SformIsTurnedFromRasToLps)
{
  const TemporaryFolder folder;
  const Matrix3 axes = ObliqueRotation() * Vector3(0.5, 0.75, 1.5).asDiagonal();
  NiftiOptions o;
  o.sform = 1;
  o.qform = 1; // The sform has precedence; this says something else.
  o.affine = { axes(0, 0), axes(0, 1), axes(0, 2), 10, axes(1, 0), axes(1, 1), axes(1, 2), 20,
    axes(2, 0), axes(2, 1), axes(2, 2), 30 };
  for (const bool big : { false, true })
  {
    for (const bool version2 : { false, true })
    {
      o.bigEndian = big;
      o.version2 = version2;
      WriteBytes(folder / "a.nii", Nifti(o));
      const GatedSeries series({ folder / "a.nii" });
      ExpectValues(series, 0);
      const Vector3 ras = axes * Vector3(3, 2, 1) + Vector3(10, 20, 30);
      ExpectNear(series.Grid().IndexToWorld(3, 2, 1), Vector3(-ras.x(), -ras.y(), ras.z()));
    }
  }
  // Metres.
  o.units = 1;
  WriteBytes(folder / "m.nii", Nifti(o));
  EXPECT_NEAR(GatedSeries({ folder / "m.nii" }).Grid().spacing[2], 1500.0, 1e-3);
}

TEST(Nifti, QformWithBothHandednesses)
{
  const TemporaryFolder folder;
  // A quarter turn about z: i goes to +y, j to -x (RAS).
  for (const double qfac : { 1.0, -1.0 })
  {
    NiftiOptions o;
    o.qform = 1;
    o.pixdim = { qfac, 0.5, 0.75, 1.5, 0, 0, 0, 0 };
    o.quaternion = { 0, 0, std::sqrt(0.5), 10, 20, 30 };
    WriteBytes(folder / "a.nii", Nifti(o));
    const GatedSeries series({ folder / "a.nii" });
    ExpectNear(series.Grid().IndexToWorld(0, 0, 0), Vector3(-10, -20, 30));
    ExpectNear(series.Grid().IndexToWorld(1, 0, 0), Vector3(-10, -20.5, 30));
    ExpectNear(series.Grid().IndexToWorld(0, 1, 0), Vector3(-9.25, -20, 30));
    ExpectNear(series.Grid().IndexToWorld(0, 0, 1), Vector3(-10, -20, 30 + 1.5 * qfac));
    EXPECT_NEAR(series.Grid().direction.determinant(), qfac, 1e-6);
  }
}

TEST(Nifti, ShearedSformFallsBackOrFails)
{
  const TemporaryFolder folder;
  NiftiOptions o;
  o.sform = 1;
  o.affine[1] = 0.1;
  WriteBytes(folder / "a.nii", Nifti(o));
  ExpectMessage(MessageOfReading(folder / "a.nii"), { "a.nii", "sform matrix is sheared" });
  o.qform = 1;
  WriteBytes(folder / "a.nii", Nifti(o));
  const GatedSeries series({ folder / "a.nii" });
  ASSERT_EQ(series.Warnings().size(), 1u);
  ExpectMessage(series.Warnings().front(), { "qform is used" });
}

TEST(Nifti, RescaleDecidesTheType)
{
  const TemporaryFolder folder;
  NiftiOptions o;
  o.sform = 1;
  o.slope = 2.0;
  o.intercept = -10.0;
  WriteBytes(folder / "a.nii", Nifti(o));
  const GatedSeries integral({ folder / "a.nii" });
  EXPECT_TRUE(integral.FitsShort());
  EXPECT_EQ(Shorts(integral, 0)[1], 2 * Value(1, 0, 0) - 10);
  o.slope = 0.5;
  WriteBytes(folder / "b.nii", Nifti(o));
  const GatedSeries half({ folder / "b.nii" });
  EXPECT_FALSE(half.FitsShort());
  std::vector<float> values(24);
  half.Source(0).Read(0, half.Grid().extent, values.data());
  EXPECT_EQ(values[1], 0.5f * static_cast<float>(Value(1, 0, 0)) - 10.0f);
  // 16 bits, but not within short.
  o.slope = 1.0;
  o.intercept = 40000.0;
  WriteBytes(folder / "c.nii", Nifti(o));
  const GatedSeries large({ folder / "c.nii" });
  std::vector<short> shorts(24);
  EXPECT_TRUE(large.FitsShort());
  EXPECT_FALSE(large.Source(0).Read(0, large.Grid().extent, shorts.data()));
}

TEST(Nifti, PhasesOfACompressedFileInAnyOrder)
{
  const TemporaryFolder folder;
  NiftiOptions o;
  o.n = { 40, 30, 20 };
  o.phases = 6;
  o.sform = 1;
  o.pixdim[4] = 0.15;
  o.units = 2 + 8;
  const Bytes packed = Gzip(Nifti(o));
  WriteBytes(folder / "a.nii.gz", packed);
  const GatedSeries series({ folder / "a.nii.gz" });
  ASSERT_EQ(series.NumberOfPhases(), 6);
  EXPECT_NEAR(series.CycleSeconds(), 0.9, 1e-6);
  EXPECT_TRUE(series.CycleIsKnown());
  for (const int p : { 0, 1, 2, 5, 4, 0, 3, 3 })
  {
    ExpectValues(series, p);
  }
  // What is there can be read; what is not is an error with numbers.
  WriteBytes(folder / "t.nii.gz", Bytes(packed.begin(), packed.begin() + long(packed.size() / 2)));
  const GatedSeries truncated({ folder / "t.nii.gz" });
  ExpectValues(truncated, 0);
  ExpectMessage(MessageOf([&] { Shorts(truncated, 5); }),
    { "t.nii.gz", "truncated: expected 288352 bytes, got" });
  EXPECT_EQ(MessageOf(
              [&]
              {
                std::vector<short> v(40 * 30 * 20);
                series.Source(5).Read(
                  5, series.Grid().extent, v.data(), [](double f) { return f < 0.3; });
              }),
    "cancelled");
  ExpectValues(series, 1);
}

TEST(Nifti, ATimeStepThatIsNoHeartCycleIsIgnored)
{
  const TemporaryFolder folder;
  NiftiOptions o;
  o.phases = 20;
  o.sform = 1;
  o.pixdim[4] = 1.0;
  o.units = 2 + 8;
  WriteBytes(folder / "a.nii", Nifti(o));
  const GatedSeries series({ folder / "a.nii" });
  EXPECT_FALSE(series.CycleIsKnown());
  EXPECT_EQ(series.CycleSeconds(), 1.0);
  ASSERT_EQ(series.Warnings().size(), 1u);
  ExpectMessage(series.Warnings().front(), { "20.000000 s", "no heart cycle" });
}

TEST(Nrrd, SpacesAndUnits)
{
  const TemporaryFolder folder;
  const std::map<std::string, Vector3> signs = { { "left-posterior-superior", Vector3(1, 1, 1) },
    { "LPS", Vector3(1, 1, 1) }, { "right-anterior-superior", Vector3(-1, -1, 1) },
    { "RAS", Vector3(-1, -1, 1) }, { "left-anterior-superior", Vector3(1, -1, 1) },
    { "scanner-xyz", Vector3(1, 1, 1) } };
  for (const auto& [space, sign] : signs)
  {
    const std::string header = NrrdHeaderText("dimension: 3\nsizes: 4 3 2\nspace: " + space +
      "\nspace directions: (0,0.5,0) (-0.75,0,0) (0,0,1.5)\nspace origin: (10,20,30)\n\n");
    WriteBytes(folder / "a.nrrd", Concatenated(header, Voxels(Size)));
    const GatedSeries series({ folder / "a.nrrd" });
    ExpectValues(series, 0);
    ExpectNear(series.Grid().IndexToWorld(2, 2, 1), sign.cwiseProduct(Vector3(8.5, 21, 31.5)));
  }
  const std::string metres = NrrdHeaderText(
    "dimension: 3\nsizes: 4 3 2\nspace: LPS\nspace units: \"m\" \"m\" \"m\"\n"
    "space directions: (0.0005,0,0) (0,0.0005,0) (0,0,0.001)\nspace origin: (0.001,0,0)\n\n");
  WriteBytes(folder / "m.nrrd", Concatenated(metres, Voxels(Size)));
  ExpectNear(GatedSeries({ folder / "m.nrrd" }).Grid().IndexToWorld(1, 0, 1), Vector3(1.5, 0, 1));
}

TEST(Nrrd, PhasesFirstOrLast)
{
  const TemporaryFolder folder;
  const std::string space = "space: LPS\nspace origin: (0,0,0)\n";
  const std::string first =
    NrrdHeaderText("dimension: 4\nsizes: 3 4 3 2\nkinds: list domain domain "
                   "domain\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n" +
      space + "\n");
  const std::string last =
    NrrdHeaderText("dimension: 4\nsizes: 4 3 2 3\nkinds: domain domain domain "
                   "time\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n" +
      space + "\n");
  WriteBytes(folder / "first.nrrd", Concatenated(first, VoxelsPhasesFirst(Size, 3)));
  WriteBytes(folder / "last.nrrd", Concatenated(last, Voxels(Size, 3)));
  WriteBytes(folder / "gzip.nrrd",
    Concatenated(Replaced(first, "raw", "gzip"), Gzip(VoxelsPhasesFirst(Size, 3))));
  for (const char* name : { "first.nrrd", "last.nrrd", "gzip.nrrd" })
  {
    const GatedSeries series({ folder / name });
    ASSERT_EQ(series.NumberOfPhases(), 3);
    for (const int p : { 0, 2, 1, 0 })
    {
      ExpectValues(series, p);
    }
  }
}

TEST(Nrrd, DetachedData)
{
  const TemporaryFolder folder;
  WriteText(folder / "a.nhdr", NrrdHeaderText(Nrrd3 + "byte skip: 5\ndata file: a.raw\n"));
  WriteBytes(folder / "a.raw", Concatenated("12345", Voxels(Size)));
  ExpectValues(GatedSeries({ folder / "a.nhdr" }), 0);
  // One file a slice, big endian.
  const Bytes all = Voxels(Size, 1, true);
  WriteBytes(folder / "s0.raw", Bytes(all.begin(), all.begin() + 24));
  WriteBytes(folder / "s1.raw", Bytes(all.begin() + 24, all.end()));
  WriteText(folder / "b.nhdr",
    Replaced(NrrdHeaderText(Nrrd3 + "data file: LIST\ns0.raw\ns1.raw\n"), "little", "big"));
  ExpectValues(GatedSeries({ folder / "b.nhdr" }), 0);
}

TEST(BadInput, EveryHeaderFaultHasItsMessage)
{
  const TemporaryFolder folder;
  struct Case
  {
    std::string name;
    Bytes bytes;
    std::vector<std::string> message;
  };
  const Bytes voxels = Voxels(Size);
  const auto mha = [&](const std::string& what, const std::string& with)
  { return Concatenated(Replaced(Mha3, what, with), voxels); };
  const auto nrrd = [&](const std::string& what, const std::string& with)
  { return Concatenated(Replaced(NrrdHeaderText(Nrrd3 + "\n"), what, with), voxels); };
  const auto nifti = [](const std::function<void(NiftiOptions&)>& change)
  {
    NiftiOptions o;
    o.sform = 1;
    change(o);
    return Nifti(o);
  };
  const auto shortened = [](Bytes bytes, std::size_t by)
  {
    bytes.resize(bytes.size() - by);
    return bytes;
  };
  const std::vector<Case> cases = {
    { "empty.mha", {}, { "is empty" } },
    { "garbage.mha", Bytes(1000, 0xa5), { "is not a MetaImage" } },
    { "truncated.mha", shortened(mha("MSB", "MSB"), 1),
      { "truncated: expected 48 bytes of voxels, got 47" } },
    { "huge.mha", mha("4 3 2", "40000 40000 40000"), { "truncated: expected" } },
    { "absurd.mha", mha("4 3 2", "2147483647 2147483647 2147483647"), { "image size" } },
    { "negative.mha", mha("4 3 2", "-4 3 2"), { "DimSize is out of range" } },
    { "nan.mha", mha("0.5 0.5 1", "0.5 nan 1"), { "ElementSpacing", "not a finite number" } },
    { "zero.mha", mha("0.5 0.5 1", "0.5 0 1"), { "ElementSpacing is not positive" } },
    { "two.mha", mha("NDims = 3", "NDims = 2"), { "has 2 dimensions" } },
    { "type.mha", mha("MET_SHORT", "MET_STRING"), { "ElementType 'MET_STRING'" } },
    { "vector.mha", mha("NDims = 3", "NDims = 3\nElementNumberOfChannels = 3"),
      { "image has 3 components" } },
    { "text.mha", mha("BinaryData = True", "BinaryData = False"), { "BinaryData = False" } },
    { "list.mhd", mha("LOCAL", "LIST"), { "ElementDataFile = LIST is not supported" } },
    { "nodata.mhd", mha("LOCAL", "none.raw"), { "none.raw' does not exist" } },
    { "skew.mha", mha("NDims = 3", "NDims = 3\nTransformMatrix = 1 0.1 0 0 1 0 0 0 1"),
      { "not perpendicular" } },
    { "zlib.mha", mha("NDims = 3", "NDims = 3\nCompressedData = True"), { "damaged" } },
    { "garbage.nrrd", Bytes(1000, 0xa5), { "is not a NRRD" } },
    { "truncated.nrrd", shortened(nrrd("raw", "raw"), 3), { "expected 48", "got 45" } },
    { "header.nrrd", Concatenated("NRRD0004\ntype: short\n", {}), { "no 'dimension'" } },
    { "bzip2.nrrd", nrrd("raw", "bzip2"), { "encoding 'bzip2' is not supported" } },
    { "kinds.nrrd", nrrd("kinds: domain", "kinds: vector"), { "image has 4 components" } },
    { "four.nrrd",
      Concatenated(NrrdHeaderText("dimension: 4\nsizes: 3 4 3 2\nkinds: 3-vector domain domain "
                                  "domain\n\n"),
        voxels),
      { "image has 3 components" } },
    { "space.nrrd", nrrd("left-posterior-superior", "somewhere"), { "space 'somewhere'" } },
    { "endian.nrrd", nrrd("endian: little\n", ""), { "no 'endian'" } },
    { "nan.nrrd", nrrd("(0.5,0,0)", "(nan,0,0)"), { "space directions", "finite" } },
    { "zero.nrrd", nrrd("(0.5,0,0)", "(0,0,0)"), { "spacing along axis 0" } },
    { "garbage.nii", Bytes(1000, 0xa5), { "is not a NIfTI" } },
    { "garbage.nii.gz", Bytes(1000, 0xa5), { "is not a NIfTI" } },
    { "truncated.nii", shortened(nifti([](NiftiOptions&) {}), 1), { "expected 48", "got 47" } },
    { "huge.nii.gz",
      Gzip(shortened(nifti(
                       [](NiftiOptions& o) {
                         o.n = { 30, 30, 30 };
                       }),
        50000)),
      { "truncated: expected 54352 bytes, got 4352" } },
    { "rgb.nii", nifti([](NiftiOptions& o) { o.datatype = 128; }), { "image has 3 components" } },
    { "type.nii", nifti([](NiftiOptions& o) { o.datatype = 77; }), { "datatype 77" } },
    { "nan.nii", nifti([](NiftiOptions& o) { o.affine[0] = Nan; }), { "spacing along axis 0" } },
    { "zero.nii", nifti([](NiftiOptions& o) { o.affine[0] = 0; }), { "spacing along axis 0" } },
    { "photo.xyz", Bytes(10, 1), { "no known format" } },
  };
  for (const Case& c : cases)
  {
    const std::string path = folder / c.name;
    WriteBytes(path, c.bytes);
    const std::string message = MessageOfReading(path);
    std::vector<std::string> parts = c.message;
    if (c.name != "nodata.mhd")
    {
      parts.push_back(c.name);
    }
    ExpectMessage(message, parts);
    EXPECT_EQ(message.back(), '.');
  }
  ExpectMessage(MessageOfReading(folder / "none.nii"), { "none.nii' does not exist" });
  ExpectMessage(MessageOf([] { GatedSeries({}); }), { "No image file" });
}

TEST(GatedSeries, FractionsAndCycleFromTheOptions)
{
  const TemporaryFolder folder;
  std::vector<std::string> paths;
  for (int p = 0; p < 4; ++p)
  {
    paths.push_back(folder / ("phase_" + std::to_string(p) + ".mha"));
    WriteBytes(paths.back(), Concatenated(Mha3, Voxels(Size)));
  }
  EXPECT_DOUBLE_EQ(GatedSeries(paths).Fraction(3), 0.75);
  EXPECT_DOUBLE_EQ(GatedSeries({ paths[0] }).Fraction(0), 0.0);
  GatedSeriesOptions options;
  options.fractions = { -0.05, 0.25, 0.5, 1.06 };
  options.cycleSeconds = 0.8;
  const GatedSeries series(paths, options);
  EXPECT_EQ(series.Fraction(3), 1.06);
  EXPECT_EQ(series.CycleSeconds(), 0.8);
  EXPECT_EQ(series.NearestPhase(0.375), 1); // The earlier one of two at the same distance.
  EXPECT_EQ(series.NearestPhase(0.41), 2);
  EXPECT_EQ(series.NearestPhase(-9.0), 0);
  EXPECT_EQ(series.NearestPhase(9.0), 3);
  options.fractions = { 0.0, 0.1 };
  ExpectMessage(MessageOf([&] { GatedSeries(paths, options); }),
    { "PhaseFractions has 2 values, but there are 4 phases" });
  options.fractions = { 0.0, 0.1, 0.1, 0.2 };
  ExpectMessage(
    MessageOf([&] { GatedSeries(paths, options); }), { "PhaseFractions[2] is not greater" });
  options.fractions = { 0.0, Nan, 0.1, 0.2 };
  ExpectMessage(
    MessageOf([&] { GatedSeries(paths, options); }), { "PhaseFractions[1] is not a finite" });
  options.fractions.clear();
  options.cycleSeconds = Nan;
  ExpectMessage(MessageOf([&] { GatedSeries(paths, options); }), { "CycleLength" });
}

TEST(GatedSeries, PhasesMustLieOnOneGrid)
{
  const TemporaryFolder folder;
  WriteBytes(folder / "a.mha", Concatenated(Mha3, Voxels(Size)));
  WriteBytes(folder / "b.mha", Concatenated(Replaced(Mha3, "4 3 2", "2 3 4"), Voxels(Size)));
  WriteBytes(
    folder / "c.mha", Concatenated(Replaced(Mha3, "0.5 0.5 1", "0.5 0.51 1"), Voxels(Size)));
  ExpectMessage(MessageOf(
                  [&] {
                    GatedSeries({ folder / "a.mha", folder / "b.mha" });
                  }),
    { "a.mha' has 4x3x2 voxels", "b.mha' has 2x3x4" });
  ExpectMessage(MessageOf(
                  [&] {
                    GatedSeries({ folder / "a.mha", folder / "c.mha" });
                  }),
    { "a.mha' and", "c.mha' are up to 0.02" });
}

TEST(GatedSeries, DescriptionListsPhases)
{
  const TemporaryFolder folder;
  for (int p = 0; p < 2; ++p)
  {
    WriteBytes(folder / ("sub/p" + std::to_string(p) + ".mha"), Concatenated(Mha3, Voxels(Size)));
  }
  WriteText(folder / "series.json",
    R"({"cycle_ms":750,"phases":[{"fraction":-0.05,"image":"sub/p0.mha"},
      {"fraction":0.5,"image":"sub/p1.mha"}],"seeds":[{"name":"LCA","position":[1,2,3]}]})");
  const GatedSeries series({ folder / "series.json" });
  EXPECT_EQ(series.NumberOfPhases(), 2);
  EXPECT_EQ(series.Fraction(0), -0.05);
  EXPECT_EQ(series.CycleSeconds(), 0.75);
  ASSERT_EQ(series.Seeds().size(), 1u);
  ExpectMessage(series.Summary(), { "Phases: 2", "-0.05 0.5", "0.75 s", "4x3x2", "Seeds: 1" });
  WriteText(folder / "bad.json", R"({"phases":[{"fraction":0,"image":"none.mha"}]})");
  ExpectMessage(MessageOfReading(folder / "bad.json"), { "none.mha' does not exist" });
}

// A folder of phases x slices; `change` may alter an image or, returning false, leave it out.
void WriteDicomFolder(const TemporaryFolder& folder, const std::string& name, int phases,
  int slices, const std::function<bool(DicomOptions&)>& change = {})
{
  for (int p = 0; p < phases; ++p)
  {
    for (int s = 0; s < slices; ++s)
    {
      DicomOptions o;
      o.phase = p;
      o.slice = s;
      o.position = "10\\20\\" + std::to_string(30 + 2 * s);
      if (phases > 1)
      {
        o.more[{ "0018,1060", "DS" }] = std::to_string(800.0 / phases * p);
        o.more[{ "0018,1062", "IS" }] = "800";
      }
      if (!change || change(o))
      {
        // The names are in no order.
        WriteDicom(folder /
            (name + "/" + std::to_string((s * 7 + p * 3) % 10) + "_" + std::to_string(p) + "_" +
              std::to_string(s) + o.seriesUid + ".dcm"),
          o);
      }
    }
  }
}

TEST(Dicom, PhasesAndPositionsAreSorted)
{
  const TemporaryFolder folder;
  WriteDicomFolder(folder, "d", 4, 3);
  WriteText(folder / "d/readme.txt", "not an image");
  DicomOptions localizer;
  localizer.imageType = "ORIGINAL\\PRIMARY\\LOCALIZER";
  localizer.seriesUid = "9.9";
  WriteDicom(folder / "d/sub/localizer.dcm", localizer);
  const GatedSeries series({ folder / "d" });
  ASSERT_EQ(series.NumberOfPhases(), 4);
  EXPECT_DOUBLE_EQ(series.CycleSeconds(), 0.8);
  for (int p = 0; p < 4; ++p)
  {
    EXPECT_NEAR(series.Fraction(p), 0.25 * p, 1e-9);
    ExpectValues(series, p);
  }
  ExpectNear(series.Grid().IndexToWorld(3, 2, 1), Vector3(11.5, 21, 32));
  EXPECT_TRUE(series.Warnings().empty());
  ExpectMessage(
    series.Summary(), { "1 files that are not DICOM", "1 localizers", "trigger time", "12 files" });
}

TEST(Dicom, ObliqueOrientationAndPixelSpacing)
{
  const TemporaryFolder folder;
  const Matrix3 axes = ObliqueRotation();
  const auto text = [](const Vector3& v)
  {
    std::ostringstream s;
    s.precision(10);
    s << v.x() << "\\" << v.y() << "\\" << v.z();
    return s.str();
  };
  WriteDicomFolder(folder, "d", 1, 3,
    [&](DicomOptions& o)
    {
      o.orientation = text(axes.col(0)) + "\\" + text(axes.col(1));
      o.position = text(Vector3(5, 6, 7) + 2.5 * o.slice * axes.col(2));
      o.spacing = "0.7\\0.3"; // between rows, between columns
      return true;
    });
  const GatedSeries series({ folder / "d" });
  ExpectValues(series, 0);
  EXPECT_NEAR(series.Grid().direction.determinant(), 1.0, 1e-9);
  ExpectNear(
    series.Grid().IndexToWorld(3, 2, 1), Vector3(5, 6, 7) + axes * Vector3(3 * 0.3, 2 * 0.7, 2.5));
}

TEST(Dicom, TimesFromOtherSources)
{
  const TemporaryFolder folder;
  const auto strip = [](DicomOptions& o) { o.more.clear(); };
  WriteDicomFolder(folder, "percentage", 4, 2,
    [&](DicomOptions& o)
    {
      strip(o);
      o.more[{ "0020,9241", "FL" }] = std::to_string(10 + 20 * o.phase);
      return true;
    });
  EXPECT_NEAR(GatedSeries({ folder / "percentage" }).Fraction(2), 0.5, 1e-6);
  // One series a phase.
  WriteDicomFolder(folder, "description", 4, 2,
    [&](DicomOptions& o)
    {
      strip(o);
      o.seriesUid = "1.2." + std::to_string(o.phase);
      o.description = "CTA 0.6 B26f " + std::to_string(30 + 10 * o.phase) + " %";
      return true;
    });
  const GatedSeries description({ folder / "description" });
  EXPECT_NEAR(description.Fraction(3), 0.6, 1e-9);
  ExpectValues(description, 3);
  WriteDicomFolder(folder, "order", 4, 2,
    [&](DicomOptions& o)
    {
      strip(o);
      o.more[{ "0020,0013", "IS" }] = std::to_string(100 - 10 * o.phase + o.slice);
      return true;
    });
  const GatedSeries order({ folder / "order" });
  EXPECT_DOUBLE_EQ(order.Fraction(1), 0.25);
  EXPECT_EQ(Shorts(order, 0)[0], Value(0, 0, 0, 3));
  ASSERT_EQ(order.Warnings().size(), 1u);
  ExpectMessage(order.Warnings().front(), { "order of acquisition" });
  // No R-R interval: phases times step.
  WriteDicomFolder(folder, "norr", 4, 2,
    [&](DicomOptions& o)
    {
      strip(o);
      o.more[{ "0018,1060", "DS" }] = std::to_string(225 * o.phase);
      return true;
    });
  const GatedSeries norr({ folder / "norr" });
  EXPECT_NEAR(norr.Fraction(1), 0.25, 1e-9);
  EXPECT_NEAR(norr.CycleSeconds(), 0.9, 1e-9);
  WriteDicomFolder(folder, "rate", 4, 2,
    [&](DicomOptions& o)
    {
      strip(o);
      o.more[{ "0018,1060", "DS" }] = std::to_string(200 * o.phase);
      o.more[{ "0018,1088", "IS" }] = "60";
      return true;
    });
  EXPECT_NEAR(GatedSeries({ folder / "rate" }).Fraction(1), 0.2, 1e-9);
}

TEST(Dicom, MissingAndDoubleSlices)
{
  const TemporaryFolder folder;
  WriteDicomFolder(
    folder, "missing", 4, 3, [](DicomOptions& o) { return o.phase != 2 || o.slice != 1; });
  ExpectMessage(MessageOfReading(folder / "missing"),
    { "missing", "phase 2 (fraction 0.5) at position (10, 20, 32) mm" });
  WriteDicomFolder(folder, "double", 4, 3);
  DicomOptions copy;
  copy.slice = 1;
  copy.phase = 2;
  copy.position = "10\\20\\32";
  WriteDicom(folder / "double/zz_copy.dcm", copy);
  copy.instanceUid = "1.2.77";
  copy.more[{ "0018,1060", "DS" }] = "400";
  copy.more[{ "0018,1062", "IS" }] = "800";
  WriteDicom(folder / "double/zz_again.dcm", copy);
  const GatedSeries series({ folder / "double" });
  ASSERT_EQ(series.Warnings().size(), 2u);
  ExpectMessage(series.Warnings()[0], { "1 duplicates", "zz_copy.dcm" });
  ExpectMessage(series.Warnings()[1], { "1 duplicates" });
  ExpectValues(series, 2);
  WriteDicomFolder(folder, "gap", 1, 5, [](DicomOptions& o) { return o.slice != 3; });
  const GatedSeries gap({ folder / "gap" });
  ASSERT_EQ(gap.Warnings().size(), 1u);
  ExpectMessage(gap.Warnings()[0], { "2 to 4 mm apart", "4 mm after slice 2" });
}

TEST(Dicom, MixedSeriesAreListed)
{
  const TemporaryFolder folder;
  WriteDicomFolder(folder, "d", 1, 3);
  const auto add = [&](const std::string& name, const std::function<void(DicomOptions&)>& change)
  {
    const TemporaryFolder other;
    WriteDicomFolder(folder, name, 1, 3);
    WriteDicomFolder(folder, name, 1, 3,
      [&](DicomOptions& o)
      {
        o.seriesUid = "7.7.7";
        o.description = "Other";
        change(o);
        return true;
      });
    return MessageOfReading(folder / name);
  };
  const std::vector<std::string> both = { "mixed series", "1.2.3 ('Cardiac', CT, 3 files)",
    "7.7.7 ('Other', CT, 3 files)", "SeriesInstanceUID" };
  ExpectMessage(add("matrix", [](DicomOptions& o) { o.rows = 5; }), both);
  ExpectMessage(add("axes", [](DicomOptions& o) { o.orientation = "0\\1\\0\\0\\0\\-1"; }), both);
  ExpectMessage(add("frame", [](DicomOptions& o) { o.frameOfReference = "8.8"; }), both);
  ExpectMessage(add("same", [](DicomOptions&) {}), both);
  ExpectMessage(add("beside", [](DicomOptions& o) { o.position += "0"; }), both);
  ExpectMessage(
    add("modality", [](DicomOptions& o) { o.modality = "PT"; }), { "modality CT and PT" });
  GatedSeriesOptions options;
  options.seriesInstanceUid = "1.2.3";
  EXPECT_EQ(MessageOfReading(folder / "matrix", options), "no exception");
  options.seriesInstanceUid = "6.6";
  ExpectMessage(MessageOfReading(folder / "matrix", options), { "6.6", "7.7.7" });
}

TEST(Dicom, ValuesOfEveryEncoding)
{
  const TemporaryFolder folder;
  for (const bool runLength : { true, false })
  {
    const std::string name = runLength ? "rle" : "jpeg";
    WriteDicomFolder(folder, name, 1, 2,
      [](DicomOptions& o)
      {
        o.isSigned = false;
        o.bitsStored = 16;
        o.values.clear();
        for (int v = 0; v < o.rows * o.columns; ++v)
        {
          o.values.push_back(static_cast<short>(Value(v % 4, v / 4, o.slice) + 1000));
        }
        o.intercept = "-1000";
        return true;
      });
    for (const auto& entry : std::filesystem::directory_iterator(folder / name))
    {
      ASSERT_TRUE(CompressDicom(entry.path().string(), runLength)) << name;
    }
    ExpectValues(GatedSeries({ folder / name }), 0);
  }
  // 12 bits, signed, with an overlay in the upper bits; own slope in each file.
  WriteDicomFolder(folder, "bits", 1, 2,
    [](DicomOptions& o)
    {
      o.bitsStored = 12;
      o.values.assign(12, 0);
      o.values[0] = static_cast<short>(0x5fff); // -1 in twelve bits
      o.values[1] = static_cast<short>(0xa005);
      o.slope = o.slice == 0 ? "1" : "3";
      return true;
    });
  const std::vector<short> values = Shorts(GatedSeries({ folder / "bits" }), 0);
  EXPECT_EQ(values[0], -1);
  EXPECT_EQ(values[1], 5);
  EXPECT_EQ(values[12], -3);
  EXPECT_EQ(values[13], 15);
}

TEST(Dicom, FramesOfAnEnhancedFile)
{
  const TemporaryFolder folder;
  WriteEnhancedDicom(folder / "raw/a.dcm", 3, 2);
  WriteEnhancedDicom(folder / "rle/a.dcm", 3, 2);
  ASSERT_TRUE(CompressDicom(folder / "rle/a.dcm", true));
  for (const char* name : { "raw", "rle" })
  {
    const GatedSeries series({ folder / name });
    ASSERT_EQ(series.NumberOfPhases(), 3);
    EXPECT_NEAR(series.Fraction(1), 0.3, 1e-6);
    EXPECT_NEAR(series.CycleSeconds(), 0.8, 1e-9);
    ExpectNear(series.Grid().IndexToWorld(2, 1, 1), Vector3(11, 20.5, 32));
    for (const int p : { 2, 0 })
    {
      ExpectValues(series, p);
    }
  }
}

TEST(Dicom, BadInput)
{
  const TemporaryFolder folder;
  WriteText(folder / "text/a.txt", "hello");
  ExpectMessage(MessageOfReading(folder / "text"), { "text'", "holds no DICOM images", "1 files" });
  std::filesystem::create_directory(folder / "empty");
  ExpectMessage(MessageOfReading(folder / "empty"), { "empty'", "holds no DICOM images" });
  const auto broken = [&](const std::string& name, const std::function<void(DicomOptions&)>& change)
  {
    DicomOptions o;
    change(o);
    WriteDicom(folder / (name + "/a.dcm"), o);
    return MessageOfReading(folder / name);
  };
  ExpectMessage(broken("rgb", [](DicomOptions& o) { o.samples = 3; }), { "a.dcm", "3 components" });
  ExpectMessage(broken("nan", [](DicomOptions& o) { o.spacing = "nan\\1"; }), { "PixelSpacing" });
  ExpectMessage(broken("zero", [](DicomOptions& o) { o.spacing = "0\\1"; }), { "PixelSpacing" });
  ExpectMessage(
    broken("axes", [](DicomOptions& o) { o.orientation = "1\\0\\0\\1\\0\\0"; }), { "Orientation" });
  ExpectMessage(broken("position", [](DicomOptions& o) { o.position = "1\\2"; }), { "Position" });
  WriteDicom(folder / "cut/a.dcm", {});
  Bytes bytes = ReadBytes(folder / "cut/a.dcm");
  bytes.resize(bytes.size() - 1);
  WriteBytes(folder / "cut/a.dcm", bytes);
  ExpectMessage(MessageOfReading(folder / "cut"), { "a.dcm", "expected 24 bytes", "got 23" });
  bytes.resize(300);
  WriteBytes(folder / "cut/a.dcm", bytes);
  ExpectMessage(MessageOfReading(folder / "cut"), { "a.dcm", "damaged" });
}

TEST(Fuzz, DamagedHeadersNeverCrash)
{
  const TemporaryFolder folder;
  std::map<std::string, Bytes> files;
  files["a.mha"] = Concatenated(Replaced(Mha3, "NDims = 3\n",
                                  "NDims = 3\nOffset = 1 2 3\n"
                                  "TransformMatrix = 1 0 0 0 1 0 0 0 1\n"),
    Voxels(Size));
  files["a.nrrd"] = Concatenated(NrrdHeaderText(Nrrd3 + "\n"), Voxels(Size));
  NiftiOptions o;
  o.phases = 2;
  o.sform = 1;
  files["a.nii"] = Nifti(o);
  files["b.nii.gz"] = Gzip(Nifti(o));
  files["series.json"] = Concatenated(
    R"({"cycle_ms":1000,"phases":[{"fraction":0,"image":"good.mha"}],"seeds":[{"name":"L","position":[1,2,3]}]})",
    {});
  WriteBytes(folder / "good.mha", Concatenated(Mha3, Voxels(Size)));
  WriteDicom(folder / "d/a.dcm", {});
  files["d/a.dcm"] = ReadBytes(folder / "d/a.dcm");
  DicomOptions packed;
  WriteDicom(folder / "p/a.dcm", packed);
  CompressDicom(folder / "p/a.dcm", true);
  files["p/a.dcm"] = ReadBytes(folder / "p/a.dcm");
  packed.isSigned = false;
  WriteDicom(folder / "j/a.dcm", packed);
  CompressDicom(folder / "j/a.dcm", false);
  files["j/a.dcm"] = ReadBytes(folder / "j/a.dcm");
  WriteEnhancedDicom(folder / "e/a.dcm", 2, 2);
  files["e/a.dcm"] = ReadBytes(folder / "e/a.dcm");

  std::uint64_t state = 12345;
  const auto random = [&state](std::size_t limit)
  {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::size_t>(state >> 33) % limit;
  };
  int refused = 0;
  int count = 0;
  for (const auto& [name, good] : files)
  {
    const std::string path = folder / name;
    const bool dicom = name.find("dcm") != std::string::npos;
    for (int round = 0; round < 100; ++round)
    {
      Bytes bytes = good;
      for (std::size_t changes = 1 + random(4); changes > 0; --changes)
      {
        // The first 132 bytes of DICOM mean nothing.
        const std::size_t first = dicom ? 128 : 0;
        // What is inside a JPEG stream is up to GDCM's decoder, which aborts for some damage.
        const Bytes tag = { 0xe0, 0x7f, 0x10, 0x00 };
        const auto limit = static_cast<std::size_t>(name == "j/a.dcm"
            ? std::search(bytes.begin(), bytes.end(), tag.begin(), tag.end()) - bytes.begin()
            : bytes.end() - bytes.begin());
        const std::size_t at = first + random(std::max<std::size_t>(1, limit - first));
        switch (random(4))
        {
          case 0:
            bytes[at] = static_cast<unsigned char>(random(256));
            break;
          case 1:
            bytes[at] = 0xff;
            break;
          case 2:
            bytes[at] = "0123456789-.eE\n =(,"[random(19)];
            break;
          default:
            if (random(8) == 0)
            {
              bytes.resize(at + 1);
            }
            else
            {
              bytes[at] ^= static_cast<unsigned char>(1u << random(8));
            }
            break;
        }
      }
      WriteBytes(path, bytes);
      const std::string opened = dicom ? std::filesystem::path(path).parent_path().string() : path;
      // Anything but a runtime_error ends the test.
      const std::string message = MessageOfReading(opened);
      refused += message != "no exception" ? 1 : 0;
      EXPECT_FALSE(message.empty());
      ++count;
    }
    WriteBytes(path, good);
  }
  EXPECT_GT(refused, count / 20);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
#ifndef __SANITIZE_ADDRESS__
  // Kilobytes: no header may make us allocate what the file can not hold.
  EXPECT_LT(usage.ru_maxrss, 400000);
#endif
}
}
