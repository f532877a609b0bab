// The report's HTML: all parts, every text escaped, tags balanced, nothing from the network.
#include "EvaluationReport.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

const std::string Nasty = "<script>alert(\"1\" & '2')</script>";
const std::string NastyEscaped =
  "&lt;script&gt;alert(&quot;1&quot; &amp; &#39;2&#39;)&lt;/script&gt;";

class EvaluationReportTest : public testing::Test
{
protected:
  void SetUp() override
  {
    std::string pattern =
      (std::filesystem::temp_directory_path() / "evaluation-report-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    this->Folder = pattern;
    this->Write("picture.png", "\x89PNG-a");
    this->Write("frame.png", "\x89PNG-bc");
    this->Write("plot.svg",
      "<?xml version=\"1.0\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"12\" "
      "height=\"7\">"
      "<defs><symbol id=\"Circle\"></symbol></defs>"
      "<g clip-path=\"url(#Clip)\"><use xlink:href=\"#Circle\"/></g></svg>\n");
  }
  void TearDown() override { std::filesystem::remove_all(this->Folder); }

  void Write(const std::string& name, const std::string& bytes) const
  {
    std::ofstream(this->Folder + "/" + name, std::ios::binary) << bytes;
  }

  EvaluationReport Full() const
  {
    CaseEvaluation one;
    one.name = "case " + Nasty;
    for (int k = 0; k < 4; ++k)
    {
      PhaseEvaluation phase;
      phase.phase = k;
      phase.fraction = 0.25 * k;
      phase.interpolated = k % 2 == 1;
      phase.lost = k == 2;
      phase.measures.hausdorff = 1.0 + k; // 2 and 4 are interpolated
      phase.measures.msd = 0.125;
      BranchEvaluation branch;
      branch.group = 7;
      branch.label = "LAD " + Nasty;
      branch.length = 80.0;
      branch.covered = k == 3 ? 0.5 : 1.0;
      phase.branches.push_back(branch);
      one.phases.push_back(phase);
    }
    one.warnings = { "of the case " + Nasty };
    EvaluationReport report;
    report.title = "Title " + Nasty;
    report.settings = { { "name " + Nasty, "value " + Nasty } };
    report.cases = { one };
    report.illustrations = {
      { { { this->Folder + "/picture.png", "picture " + Nasty, "caption " + Nasty } },
        { this->Folder + "/frame.png", this->Folder + "/frame.png" } }
    };
    report.plots = { this->Folder + "/plot.svg", this->Folder + "/plot.svg" };
    report.warnings = { "of all " + Nasty };
    return report;
  }

  std::string Folder;
};

std::size_t Count(const std::string& text, const std::string& part)
{
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
  {
    ++count;
  }
  return count;
}

/// What is wrong with the nesting of the tags; empty: nothing.
std::string NestingError(const std::string& html)
{
  static const std::set<std::string> Void = { "meta", "img", "br", "input" };
  std::vector<std::string> open;
  std::size_t at = html.find("<html");
  while ((at = html.find('<', at)) != std::string::npos)
  {
    const std::size_t end = html.find('>', at);
    if (end == std::string::npos)
    {
      return "a tag without an end";
    }
    const std::string tag = html.substr(at + 1, end - at - 1);
    at = end;
    const bool closing = tag[0] == '/';
    const std::string name =
      tag.substr(closing ? 1 : 0, tag.find_first_of(" \n", 1) - (closing ? 1 : 0));
    if (closing)
    {
      if (open.empty() || open.back() != name)
      {
        return "</" + name + "> closes " + (open.empty() ? "nothing" : "<" + open.back() + ">");
      }
      open.pop_back();
    }
    else if (Void.count(name) == 0 && tag.back() != '/')
    {
      open.push_back(name);
      if (name == "script" || name == "style")
      {
        at = html.find("</" + name, at) - 1;
      }
    }
  }
  return open.empty() ? "" : "<" + open.back() + "> stays open";
}

TEST_F(EvaluationReportTest, HasAllPartsAndEscapesAllTexts)
{
  const std::string html = EvaluationHtml(this->Full());
  EXPECT_EQ(html.rfind("<!DOCTYPE html>\n<html lang=\"en\">", 0), 0U);
  EXPECT_EQ(NestingError(html), "");
  EXPECT_EQ(Count(html, "<script>"), 1U) << "only our own";
  EXPECT_EQ(html.find(Nasty), std::string::npos);
  for (const char* before :
    { "<title>Title ", "<h1>Title ", "<td>case ", "<li>of all ", "<li>of the case ", "<td>LAD ",
      "<h3>picture ", "<figcaption>caption ", "<td>name ", "<td class=\"text\">value " })
  {
    EXPECT_EQ(Count(html, before + NastyEscaped), 1U) << before;
  }
  EXPECT_NE(html.find("<meta charset=\"utf-8\">"), std::string::npos);
  EXPECT_NE(html.find("<meta name=\"viewport\""), std::string::npos);
  // Nothing is loaded from elsewhere; names of XML's languages are no addresses.
  const std::string plain =
    std::regex_replace(html, std::regex("xmlns(:xlink)?=\"[^\"]*\""), std::string());
  EXPECT_EQ(Count(plain, "http"), 0U);
  EXPECT_EQ(Count(plain, "src=\"") - Count(plain, "src=\"data:image/png;base64,"), 0U);
}

TEST_F(EvaluationReportTest, ShowsTheNumbersBesideThePapers)
{
  const std::string html = EvaluationHtml(this->Full());
  // Means over the interpolated phases, 2 and 4, with n - 1.
  EXPECT_NE(html.find("<td>3.000 &plusmn; 1.414</td><td>0.125 &plusmn; 0.000</td></tr>"),
    std::string::npos);
  EXPECT_NE(html.find("<tr class=\"interpolated\"><td>1</td><td>25.0</td><td class=\"text\">"
                      "interpolated</td><td>2.000</td><td>0.125</td><td class=\"paper\">5.75</td>"),
    std::string::npos);
  EXPECT_NE(html.find("<tr class=\"lost\"><td>2</td>"), std::string::npos);
  EXPECT_NE(
    html.find("<td>Mean, interpolated</td><td></td><td></td><td>3.000</td>"), std::string::npos);
  EXPECT_NE(html.find("<td class=\"paper\">5.42</td>"), std::string::npos) << "Part A's mean";
  EXPECT_NE(html.find("<tr class=\"sum\"><td>Mean</td><td>4.96</td>"), std::string::npos);
  // As printed, and not as computed from the rows.
  EXPECT_NE(html.find("<td class=\"paper\">2.60</td>"), std::string::npos);
  EXPECT_NE(html.find("<tr class=\"after\"><td>STD</td><td>1.78</td>"), std::string::npos);
  // A branch: group, phases, length, covered in the mean and at least.
  EXPECT_NE(
    html.find("<td>7</td><td>4</td><td>80.0</td><td>0.875</td><td>0.500</td>"), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
  EXPECT_EQ(Count(html, "HD95"), 0U) << "a measure that is not known";
}

TEST_F(EvaluationReportTest, EmbedsPicturesAndPlots)
{
  const std::string html = EvaluationHtml(this->Full());
  EXPECT_EQ(Count(html, "data:image/png;base64,iVBORy1h\""), 1U) << "six bytes";
  EXPECT_EQ(Count(html, "data:image/png;base64,iVBOR"), 3U);
  EXPECT_EQ(Count(html, "data:image/png;base64,iVBORy1iYw==\""), 2U) << "seven bytes";
  EXPECT_EQ(Count(html, " hidden>"), 1U) << "all frames but the first";
  EXPECT_NE(html.find("<input type=\"range\" min=\"0\" max=\"1\""), std::string::npos);
  // Two drawings with the same names inside: they get names of their own.
  for (const char* prefix : { "plot0-", "plot1-" })
  {
    EXPECT_EQ(Count(html, std::string("id=\"") + prefix + "Circle\""), 1U);
    EXPECT_EQ(Count(html, std::string("href=\"#") + prefix + "Circle\""), 1U);
    EXPECT_EQ(Count(html, std::string("url(#") + prefix + "Clip)"), 1U);
  }
  EXPECT_EQ(Count(html, "viewBox=\"0 0 12 7\""), 2U);
  EXPECT_EQ(html.find("<?xml"), std::string::npos);
}

TEST_F(EvaluationReportTest, LeavesOutWhatIsEmpty)
{
  EvaluationReport report = this->Full();
  report.illustrations.clear();
  report.plots.clear();
  report.settings.clear();
  report.warnings.clear();
  const std::string html = EvaluationHtml(report);
  EXPECT_EQ(NestingError(html), "");
  for (const char* part : { "<img", "<svg", "id=\"plots\"", "id=\"settings\"", "id=\"warnings\"" })
  {
    EXPECT_EQ(Count(html, part), 0U) << part;
  }
  EXPECT_EQ(NestingError(EvaluationHtml(EvaluationReport())), "");
}

TEST_F(EvaluationReportTest, NamesFilesThatAreMissing)
{
  EvaluationReport report = this->Full();
  report.plots = { this->Folder + "/none.svg" };
  ExpectError([&] { EvaluationHtml(report); }, "none.svg");
  report.plots = { this->Folder + "/picture.png" };
  EXPECT_THROW(EvaluationHtml(report), std::runtime_error) << "no SVG";
  report = this->Full();
  report.illustrations.resize(2);
  EXPECT_THROW(EvaluationHtml(report), std::invalid_argument);
  EXPECT_THROW(
    WriteEvaluationReport(this->Full(), this->Folder + "/no/report.html"), std::runtime_error);
  const std::string path = this->Folder + "/report.html";
  WriteEvaluationReport(this->Full(), path);
  EXPECT_EQ(std::filesystem::file_size(path), EvaluationHtml(this->Full()).size());
}
}
