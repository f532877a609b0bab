// The drawings of an evaluation: marks where their values are, every text escaped, tags balanced.
#include "EvaluationPlots.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

const std::string Nasty = "<script>alert(\"1\" & '2')</script>\x01";
const std::string NastyEscaped = "&lt;script&gt;alert(&quot;1&quot; &amp; '2')&lt;/script&gt; ";

/// HD is 2.0, 2.1, 2.2, 2.3, the detected length nearly the same in all.
CaseEvaluation FourPhases(const std::string& name)
{
  CaseEvaluation one;
  one.name = name;
  for (int k = 0; k < 4; ++k)
  {
    PhaseEvaluation phase;
    phase.phase = k;
    phase.fraction = 0.25 * k;
    phase.interpolated = k % 2 == 1;
    phase.lost = k == 2;
    phase.measures.hausdorff = 2.0 + 0.1 * k;
    phase.measures.found = 0.999 + 0.0002 * k;
    one.phases.push_back(phase);
  }
  return one;
}

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
std::string NestingError(const std::string& xml)
{
  std::vector<std::string> open;
  for (std::size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at))
  {
    const std::size_t end = xml.find('>', at);
    if (end == std::string::npos)
    {
      return "a tag without an end";
    }
    const std::string tag = xml.substr(at + 1, end - at - 1);
    at = end;
    const std::string name = tag.substr(0, tag.find(' '));
    if (name[0] == '/')
    {
      if (open.empty() || "/" + open.back() != name)
      {
        return "<" + name + "> closes " + (open.empty() ? "nothing" : "<" + open.back() + ">");
      }
      open.pop_back();
    }
    else if (tag.back() != '/')
    {
      open.push_back(name);
    }
  }
  return open.empty() ? "" : "<" + open.back() + "> stays open";
}

using Place = std::array<double, 2>;

/// Of the marks of a kind in a case, without those that say what marks mean.
std::vector<Place> Marks(const std::string& svg, const std::string& kind, int number = 0)
{
  const std::size_t begin = svg.find("data-case=\"" + std::to_string(number) + "\"");
  const std::string group = svg.substr(begin, svg.find("</g>", begin) - begin);
  const std::regex mark("class=\"mark " + kind + "\" transform=\"translate\\(([^ ]*) ([^)]*)\\)\"");
  std::vector<Place> places;
  for (std::sregex_iterator at(group.begin(), group.end(), mark), end; at != end; ++at)
  {
    places.push_back({ std::stod((*at)[1]), std::stod((*at)[2]) });
  }
  return places;
}

TEST(EvaluationPlots, MarksAreWhereTheirValuesAre)
{
  const std::vector<EvaluationPlot> plots = DrawPlots({ FourPhases("one") });
  ASSERT_EQ(plots.size(), 2U) << "measures that are known";
  EXPECT_EQ(plots[0].key, "found");
  EXPECT_EQ(plots[1].key, "HD");
  for (const auto& [key, svg] : plots)
  {
    SCOPED_TRACE(key);
    EXPECT_EQ(NestingError(svg), "");
    const std::vector<Place> tracked = Marks(svg, "tracked");
    const std::vector<Place> interpolated = Marks(svg, "interpolated");
    const std::vector<Place> lost = Marks(svg, "lost");
    ASSERT_EQ(tracked.size(), 1U);
    ASSERT_EQ(interpolated.size(), 2U);
    ASSERT_EQ(lost.size(), 1U);
    const std::array<Place, 4> places = { tracked[0], interpolated[0], lost[0], interpolated[1] };
    // The line goes through the middles of the marks.
    std::smatch line;
    ASSERT_TRUE(std::regex_search(svg, line, std::regex("class=\"curve\"[^>]* d=\"M([^\"]*)\"")));
    std::istringstream stream(std::regex_replace(line[1].str(), std::regex("L"), " "));
    for (const Place& place : places)
    {
      Place at{};
      ASSERT_TRUE(stream >> at[0] >> at[1]);
      EXPECT_EQ(at, place);
    }
    // Evenly spaced in both directions, upwards.
    for (std::size_t k = 2; k < 4; ++k)
    {
      EXPECT_NEAR(places[k][0] - places[k - 1][0], places[1][0] - places[0][0], 0.1);
      EXPECT_NEAR(places[k][1] - places[k - 1][1], places[1][1] - places[0][1], 0.1);
    }
    EXPECT_LT(places[1][1], places[0][1] - 1.0);
    // Where the axis says that phases are.
    std::smatch frame;
    ASSERT_TRUE(std::regex_search(svg, frame,
      std::regex(
        "data-frame=\"([^ ]*) ([^ ]*) ([^ ]*) ([^ ]*) ([^ ]*) ([^\"]*)\" data-over=\"fraction\"")));
    const auto part = [&](std::size_t k) { return std::stod(frame[k]); };
    EXPECT_NEAR(
      places[2][0], part(3) + (part(4) - part(3)) * (50.0 - part(1)) / (part(2) - part(1)), 0.05);
    EXPECT_GT(places[3][1], part(5));
    EXPECT_LT(places[0][1], part(6));
    // On its own scale: neither the paper's 5.42 nor 0 press the distances together.
    if (key == "HD")
    {
      EXPECT_GT(places[0][1] - places[3][1], 0.6 * (part(6) - part(5)));
    }
  }
  EXPECT_EQ(Count(plots[1].svg, "paper's case 1: 5.42"), 1U);
  EXPECT_EQ(Count(plots[0].svg, "paper"), 0U) << "a measure that the paper has not";
  EXPECT_EQ(Count(plots[0].svg, "class=\"names\""), 0U);
}

TEST(EvaluationPlots, SeveralCasesHaveAColourAndANameEach)
{
  CaseEvaluation second = FourPhases("second " + Nasty);
  for (PhaseEvaluation& phase : second.phases)
  {
    phase.measures.hausdorff *= 1.5;
    phase.fraction = EvaluationMeasures::NaN; // over the number then
  }
  const std::string svg = DrawPlots({ FourPhases("first " + Nasty), second })[1].svg;
  EXPECT_EQ(NestingError(svg), "");
  for (const char* part :
    { "data-case=\"0\" color=\"#0072b2\"", "data-case=\"1\" color=\"#d55e00\"", "fill=\"#0072b2\"",
      "fill=\"#d55e00\"", "data-over=\"phase\"", "paper's five: 4.96" })
  {
    EXPECT_EQ(Count(svg, part), 1U) << part;
  }
  EXPECT_EQ(Count(svg, ">first " + NastyEscaped + "<"), 1U);
  EXPECT_EQ(Count(svg, ">second " + NastyEscaped + "<"), 1U);
  EXPECT_EQ(Count(svg, "<script"), 0U);
  EXPECT_LT(Marks(svg, "lost", 1)[0][1], Marks(svg, "lost", 0)[0][1] - 10.0);
  EXPECT_EQ(Marks(svg, "lost", 1)[0][0], Marks(svg, "lost", 0)[0][0]);
}

TEST(EvaluationPlots, WithoutNumbersThereIsNone)
{
  EXPECT_TRUE(DrawPlots({}).empty());
  CaseEvaluation one = FourPhases("one");
  one.phases.resize(1);
  EXPECT_EQ(Marks(DrawPlots({ one })[0].svg, "tracked").size(), 1U) << "one phase alone";
  one.phases[0].measures = EvaluationMeasures();
  EXPECT_TRUE(DrawPlots({ one }).empty());
}
}
