// Lists of files over time, .series and .pvd: there and back, and what is wrong with them; the report of a sequence.
#include "AtomicFile.h"
#include "FileSeries.h"
#include "MeshSequenceReport.h"
#include "Refusals.h"
#include "StagedFolder.h"
#include "XmlText.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <unistd.h>

namespace UnitTestFileSeries
{
namespace fs = std::filesystem;

namespace
{
class UnitTestFileSeries : public ::testing::Test
{
protected:
  void SetUp() override
  {
    this->Folder = fs::temp_directory_path() / ("file-series." + std::to_string(getpid()));
    fs::create_directories(this->Folder);
  }
  void TearDown() override { fs::remove_all(this->Folder); }

  std::string Put(const std::string& name, const std::string& text)
  {
    const std::string path = (this->Folder / name).string();
    coronary::WriteFileAtomically(path, text);
    return path;
  }

  void ExpectFailure(const std::string& text, const std::string& part)
  {
    const std::string path = this->Put("list", text);
    ExpectError([&] { coronary::ReadFileSeries(path); }, path, part);
  }

  fs::path Folder;
};

const std::vector<coronary::TimedFile> Files = { { "a_000.vtp", -0.05 },
  { "a & <b> \"1\".vtp", 0.1 }, { "sub/a_002.vtp", 0.30000000000000004 } };
}

TEST_F(UnitTestFileSeries, ComesBack)
{
  for (const std::string& text : { coronary::FileSeriesText(Files), coronary::PvdText(Files) })
  {
    const auto read = coronary::ReadFileSeries(this->Put("list", text));
    ASSERT_EQ(read.size(), Files.size());
    for (std::size_t n = 0; n < read.size(); ++n)
    {
      EXPECT_EQ(read[n].path, (this->Folder / Files[n].path).string());
      EXPECT_EQ(read[n].time, Files[n].time);
    }
  }
}

TEST_F(UnitTestFileSeries, ReadsWhatParaViewWrites)
{
  const auto pvd = coronary::ReadFileSeries(this->Put("list",
    "<?xml version=\"1.0\"?>\n<VTKFile type='Collection' version='0.1' compressor=''>\n"
    "<Collection>\n<!-- <DataSet timestep=\"9\" file=\"no\"/> -->\n"
    "<DataSet timestep='0' group='' part='0'\n file='/x/y.vtp' ></DataSet>"
    "<DataSet file=\"z.vtp\" timestep=\"1e-1\"/></Collection></VTKFile>"));
  ASSERT_EQ(pvd.size(), 2U);
  EXPECT_EQ(pvd[0].path, "/x/y.vtp");
  EXPECT_EQ(pvd[1].time, 0.1);
  const auto series = coronary::ReadFileSeries(this->Put("list",
    "{\"file-series-version\":\"1.0\",\"files\":[{\"name\":\"a.vtp\",\"time\":0},{\"time\":2,"
    "\"name\":\"./b.vtp\"}]}"));
  ASSERT_EQ(series.size(), 2U);
  EXPECT_EQ(series[1].path, (this->Folder / "b.vtp").string());
}

TEST_F(UnitTestFileSeries, NumbersSort)
{
  EXPECT_EQ(coronary::SeriesNumber(0, 1), "00");
  EXPECT_EQ(coronary::SeriesNumber(9, 100), "09");
  EXPECT_EQ(coronary::SeriesNumber(9, 101), "009");
  EXPECT_EQ(coronary::SeriesNumber(100, 101), "100");
  EXPECT_EQ(coronary::SeriesNumber(7, 10, 1), "7");
  EXPECT_EQ(coronary::SeriesNumber(7, 20, 3), "007");
}

TEST(XmlText, ValuesThereAndBack)
{
  const auto value = [](const std::string& text)
  {
    std::string read;
    coronary::ReadXml("<a>\n<b value=\"" + text + "\"/></a>", "a.xml",
      [&](const coronary::XmlElement& element)
      { read = element.Is("a/b") ? element.Required("value") : ""; });
    return read;
  };
  const std::string text = "a < b > \"c\" & 'd' \xC3\xA9\t\n\r";
  EXPECT_EQ(value(coronary::EscapedXml(text)), text);
  EXPECT_EQ(value(coronary::EscapedXml("a\x01z")), "a z");
  EXPECT_EQ(value("&#65;&#x41;&#xe9;&#x20AC;&#x1F600;&apos;&amp;lt;"),
    "AA\xC3\xA9\xE2\x82\xAC\xF0\x9F\x98\x80'&lt;");
  EXPECT_EQ(value("a\r\nb\tc"), "a b c");
  for (const char* wrong : { "&", "&;", "&lt", "&LT;", "&nbsp;", "&#;", "&#x;", "&#0;", "&#7;",
         "&#xD800;", "&#x110000;", "&#99999999999;", "&#-1;", "&#6 5;", "&amp &lt;", "\xFF" })
  {
    ExpectError([&] { value(wrong); }, "'a.xml': line 2: is no XML: ");
  }
}

TEST(XmlText, ElementsWithTheirPlaces)
{
  const std::string text = "<?xml version=\"1.0\"?>\n<a x='1'><!-- <b/> --><b\n y=\"2\"/>\n"
                           "<c><b/></c></a>\n<d/><e> any <bytes \xFF";
  std::string paths;
  coronary::ReadXml(
    text, "a.xml",
    [&](const coronary::XmlElement& element)
    {
      paths += element.path + " ";
      const std::string tag = text.substr(element.begin, element.end - element.begin);
      EXPECT_EQ(tag.rfind("<" + std::string(element.Name()), 0), 0U) << tag;
      EXPECT_EQ(tag.find('>'), tag.size() - 1) << tag;
    },
    "d");
  EXPECT_EQ(paths, "a a/b a/c a/c/b d ");
  // Two roots, but not three; an error of the caller's passes through.
  const auto none = [](const coronary::XmlElement&) {};
  ExpectError([&] { coronary::ReadXml(text, "a.xml", none); }, "line 5: is no XML: junk after");
  const auto lines = [](const coronary::XmlElement& element) { element.Fail(element.path); };
  ExpectError([&] { coronary::ReadXml("\n\n<a>", "b.xml", lines); }, "'b.xml': line 3: a.");
}

TEST(XmlText, LongTextsAreReadInBlocks)
{
  const std::string blanks(std::size_t(20) << 20, '\n');
  const std::string text =
    "<a>" + blanks + "<b c=\"" + std::string(20 << 20, ' ') + "1\"/>" + blanks + "<d/></a>";
  std::size_t elements = 0;
  coronary::ReadXml(text, "a.xml",
    [&](const coronary::XmlElement& element)
    {
      ++elements;
      EXPECT_EQ(element.begin, text.find("<" + std::string(element.Name())));
      EXPECT_EQ(element.end, text.find('>', element.begin) + 1);
      EXPECT_EQ(element.Integer("c"), element.Is("a/b") ? 1 : 0);
    });
  EXPECT_EQ(elements, 3U);
}

TEST_F(UnitTestFileSeries, SaysWhatIsWrong)
{
  this->ExpectFailure("", "neither a .series nor a .pvd");
  this->ExpectFailure("hello", "neither a .series nor a .pvd");
  this->ExpectFailure("{\"files\": [", "is not JSON");
  this->ExpectFailure("{\"file\": []}", "no list 'files'");
  this->ExpectFailure("{\"files\": []}", "lists no files");
  this->ExpectFailure("{\"files\": [{\"time\": 1}]}", "files[0] has no 'name'");
  this->ExpectFailure(
    "{\"files\": [{\"name\": \"a\", \"time\": \"1\"}]}", "files[0] has no 'time'");
  this->ExpectFailure("{\"files\": [{\"name\": \"\", \"time\": 1}]}", "file 0 has no name");
  this->ExpectFailure(
    "{\"files\": [{\"name\": \"a\", \"time\": 1}, {\"name\": \"b\", \"time\": 1}]}",
    "the time of 'b'");
  const std::string open = "<VTKFile><Collection>";
  const std::string close = "</Collection></VTKFile>";
  this->ExpectFailure("<html></html>", "is not a .pvd");
  this->ExpectFailure(open, "line 1: ends inside the element 'Collection'");
  this->ExpectFailure(open + close, "lists no files");
  this->ExpectFailure(open + "\n<!-- " + close, "line 2: is no XML: unclosed token");
  this->ExpectFailure(open + "<DataSet timestep='0'/>" + close, "line 1: 'DataSet' has no file");
  this->ExpectFailure(open + "<DataSet file='a'/>" + close, "'DataSet' has no timestep");
  this->ExpectFailure(
    open + "<DataSet file='a' timestep='x'/>" + close, "timestep is 'x', which is not a");
  this->ExpectFailure(open + "<DataSet file='a' timestep='nan'/>" + close, "not a finite number");
  this->ExpectFailure(open + "<DataSet file='&bad;' timestep='0'/>" + close, "undefined entity");
  this->ExpectFailure(
    "<!DOCTYPE a [<!ENTITY b 'c'>]>" + open + close, "a document type or entities");
  this->ExpectFailure(
    "{\"files\": [{\"name\": \"a\\nb\", \"time\": 1}]}", "file 0 has a control character");
  this->ExpectFailure(open + close + "<DataSet file='a", "unclosed token");
  this->ExpectFailure(open + "<DataSet file='a' timestep='0' part='0'/>" +
      "<DataSet file='b' timestep='0' part='1'/>" + close,
    "several files at the time");
  EXPECT_THROW(coronary::ReadFileSeries((this->Folder / "none").string()), std::runtime_error);
  EXPECT_THROW(coronary::ReadFileSeries(this->Folder.string()), std::runtime_error);
}

TEST_F(UnitTestFileSeries, StagedFilesAppearTogetherInDeepFolders)
{
  const fs::path folder = this->Folder / "made";
  {
    coronary::StagedFolder staged(folder.string());
    coronary::WriteFileAtomically(staged.Add("a/b/c.txt"), "deep");
    EXPECT_FALSE(fs::exists(folder / "a"));
  }
  EXPECT_FALSE(fs::exists(folder));
  coronary::StagedFolder staged(folder.string());
  coronary::WriteFileAtomically(staged.Add("a/b/c.txt"), "deep");
  coronary::WriteFileAtomically(staged.Add("last.txt"), "last");
  staged.Commit();
  EXPECT_TRUE(fs::is_regular_file(folder / "a/b/c.txt"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 2);
}

TEST_F(UnitTestFileSeries, AShorterSetTakesThePlaceOfALongerOne)
{
  const fs::path folder = this->Folder / "set";
  fs::create_directories(folder / "below/deep");
  for (const char* name :
    { "set/a_000", "set/a_001", "set/below/deep/b", "set/below/mine", "set/mine", "outside" })
  {
    coronary::WriteFileAtomically((this->Folder / name).string(), "old");
  }
  fs::create_symlink(this->Folder / "outside", folder / "link");
  coronary::StagedFolder staged(folder.string());
  coronary::WriteFileAtomically(staged.Add("a_000"), "new");
  staged.TakePlaceOf({ "a_000", "a_001", "./below//deep/b", "../outside", "below/../../outside",
    (this->Folder / "outside").string(), "link", "below", "none", "" });
  EXPECT_TRUE(fs::exists(folder / "a_001"));
  staged.Commit();
  EXPECT_EQ(fs::file_size(folder / "a_000"), 3u);
  EXPECT_FALSE(fs::exists(folder / "a_001"));
  EXPECT_FALSE(fs::exists(folder / "below/deep"));
  EXPECT_TRUE(fs::exists(folder / "below/mine"));
  EXPECT_TRUE(fs::exists(folder / "mine"));
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_TRUE(fs::exists(this->Folder / "outside"));
}

TEST_F(UnitTestFileSeries, AnOlderDescriptionStaysOnlyWhereItDescribesNoneOfTheFiles)
{
  const fs::path folder = this->Folder / "set";
  for (const bool keep : { false, true })
  {
    fs::remove_all(folder);
    fs::create_directories(folder);
    coronary::WriteFileAtomically((folder / "list").string(), "old");
    coronary::WriteFileAtomically((folder / "more").string(), "old");
    coronary::StagedFolder staged(folder.string());
    for (const char* name : { "file", "list" })
    {
      coronary::WriteFileAtomically(staged.Add(name), "new one");
    }
    staged.TakePlaceOf({ "more" });
    if (keep)
    {
      staged.KeepLast();
    }
    // It breaks off at the first file.
    fs::create_directories(folder / "file/in the way");
    EXPECT_THROW(staged.Commit(), std::runtime_error);
    EXPECT_EQ(fs::exists(folder / "list"), keep);
    EXPECT_TRUE(fs::exists(folder / "more"));
    fs::remove_all(folder / "file");
    staged.Commit();
    EXPECT_EQ(fs::file_size(folder / "list"), 7u);
    EXPECT_FALSE(fs::exists(folder / "more"));
  }
}

TEST(UnitTestMeshSequenceReport, NumbersAndNames)
{
  coronary::MeshSequenceReport report;
  report.points = 5;
  report.tetrahedra = 4;
  report.triangles = 6;
  report.faces = { { 1, "wall", 4 }, { 2, "inlet\xff", 2 } };
  report.files = { { "volume", "m_volume.pvd" } };
  report.phases.resize(2);
  report.phases[0].time = 0.1;
  report.phases[1].time = 0.6;
  report.phases[1].tetrahedra.inverted = { 1, 3 };
  report.phases[1].tetrahedra.poor = 3;
  report.phases[1].tetrahedra.maximumRadiusEdgeRatio = std::numeric_limits<double>::infinity();
  report.phases[1].files = { { "volume", "m_volume_001.vtu" } };

  const auto json = nlohmann::json::parse(coronary::MeshSequenceJson(report));
  EXPECT_EQ(json["poor_below_deg"].get<double>(), 15.0);
  EXPECT_EQ(json["faces"][0]["type"], "wall");
  EXPECT_EQ(json["faces"][1]["type"], "cap");
  EXPECT_EQ(json["files"]["volume"], "m_volume.pvd");
  ASSERT_EQ(json["phases"].size(), 2U);
  EXPECT_EQ(json["phases"][1]["phase"], 1);
  EXPECT_EQ(json["phases"][1]["inverted_ids"], (std::vector<int>{ 1, 3 }));
  EXPECT_EQ(json["phases"][1]["quality"]["poor_fraction"], 0.75);
  EXPECT_TRUE(json["phases"][1]["quality"]["greatest_radius_edge_ratio"].is_null());
  EXPECT_EQ(json["phases"][1]["files"]["volume"], "m_volume_001.vtu");

  std::istringstream csv(coronary::MeshSequenceCsv(report));
  std::string head;
  std::string first;
  std::string second;
  std::string rest;
  ASSERT_TRUE(std::getline(csv, head) && std::getline(csv, first) && std::getline(csv, second));
  EXPECT_FALSE(std::getline(csv, rest));
  EXPECT_EQ(head.rfind("phase,time,inverted_tetrahedra,poor_tetrahedra,poor_fraction,", 0), 0U);
  EXPECT_EQ(first.rfind("0,0.1,0,0,0.0,", 0), 0U) << first;
  EXPECT_EQ(second.rfind("1,0.6,2,3,0.75,", 0), 0U) << second;
  EXPECT_NE(second.find(",inf,"), std::string::npos);
  EXPECT_EQ(second.substr(second.rfind(',')), ",1 3");
  EXPECT_EQ(std::count(head.begin(), head.end(), ','), std::count(first.begin(), first.end(), ','));

  report.tetrahedra = 0;
  EXPECT_NE(coronary::MeshSequenceCsv(report).find("enclosed_volume_mm3"), std::string::npos);
}

TEST(StagedFolder, RemovesWhatKilledProcessesLeft)
{
  const std::filesystem::path folder =
    std::filesystem::path(testing::TempDir()) / "staged-abandoned";
  std::filesystem::remove_all(folder);
  const auto old = std::filesystem::file_time_type::clock::now() - std::chrono::hours(1);
  std::filesystem::create_directories(folder / ".unfinished-killed" / "motion");
  std::filesystem::last_write_time(folder / ".unfinished-killed", old);
  coronary::StagedFolder working(folder.string());
  const std::filesystem::path inTheMaking =
    std::filesystem::path(working.Add("a.txt")).parent_path();
  std::filesystem::last_write_time(inTheMaking, old);
  {
    coronary::StagedFolder other(folder.string());
  }
  EXPECT_FALSE(std::filesystem::exists(folder / ".unfinished-killed"));
  EXPECT_TRUE(std::filesystem::exists(inTheMaking)) << "someone works there";
}
}
