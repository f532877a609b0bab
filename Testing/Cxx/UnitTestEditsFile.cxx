// edits.json: what is written comes back, and what is wrong is named.

#include "EditsFile.h"

#include "Refusals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace UnitTestEditsFile
{
using namespace coronary;

namespace
{
std::vector<TreeEdit> OneOfEach()
{
  std::vector<TreeEdit> edits(8);
  for (std::size_t n = 0; n < edits.size(); ++n)
  {
    edits[n].kind = EditKinds()[n];
    edits[n].points = { Vector3(0.1 + static_cast<double>(n), -1.0 / 3.0, 1e-7) };
  }
  edits[0].points.emplace_back(4.0, 5.0, 6.0);
  edits[0].name = "OM2";
  edits[0].radius = 0.7;
  edits[2].points.clear();
  edits[2].name = "D1";
  edits[3].points.emplace_back(1.0, 2.0, 3.0);
  edits[4].newName = "R-PDA";
  edits[5].points.emplace_back(1.0, 2.0, 3.0);
  edits[5].reach = 12.5;
  edits[6].radius = edits[7].radius = 1.25;
  return edits;
}

TEST(EditsFile, ComesBackBitByBit)
{
  const std::vector<TreeEdit> edits = OneOfEach();
  const std::string text = EditsText(edits);
  const std::vector<TreeEdit> back = ParseEdits(text, "edits.json");
  ASSERT_EQ(back.size(), edits.size());
  for (std::size_t n = 0; n < edits.size(); ++n)
  {
    EXPECT_EQ(back[n].kind, edits[n].kind);
    ASSERT_EQ(back[n].points.size(), edits[n].points.size());
    for (std::size_t p = 0; p < edits[n].points.size(); ++p)
    {
      EXPECT_EQ(back[n].points[p], edits[n].points[p]);
    }
    EXPECT_EQ(back[n].name, edits[n].name);
    EXPECT_EQ(back[n].newName, edits[n].newName);
    EXPECT_EQ(back[n].radius, edits[n].radius);
    EXPECT_EQ(back[n].reach, edits[n].reach);
    EXPECT_EQ(EditText(ParseEdit(EditText(edits[n]), "one")), EditText(edits[n]));
  }
  EXPECT_EQ(EditsText(back), text);
  EXPECT_TRUE(ParseEdits(EditsText({}), "edits.json").empty());
  // An edit a line.
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 6 + static_cast<long>(edits.size()));
}

TEST(EditsFile, WhatIsWrongIsNamed)
{
  const auto refuse = [](const std::string& edits, const auto&... parts)
  {
    ExpectError(
      [&] {
        ParseEdits(
          R"({"format": "coronary edits", "version": 1, "edits": )" + edits + "}", "my.json");
      },
      "my.json", parts...);
  };
  refuse("{}", "edits is not a list");
  refuse("[3]", "edits[0] is not an object");
  refuse(R"([{"edit": "cut", "points": [[1, 2, 3]]}, {"edit": "glue"}])", "edits[1].edit", "glue",
    "add-branch");
  refuse(R"([{"edit": "cut"}])", "edits[0]", "1 point, not 0");
  refuse(R"([{"edit": "cut", "points": [[1, 2]]}])", "edits[0].points[0]", "three numbers");
  refuse(R"([{"edit": "cut", "points": [[1, 2, "x"]]}])", "edits[0].points[0]", "number");
  refuse(R"([{"edit": "cut", "points": 5}])", "edits[0].points is not a list");
  refuse(R"([{"edit": "cut", "point": [[1, 2, 3]]}])", "'point'", "not known");
  refuse(R"([{"edit": "delete", "name": 5}])", "edits[0].name", "text");
  refuse(R"([{"edit": "delete", "name": "LAD9"}])", "LAD9", "SCCT");
  refuse(R"([{"edit": "paint", "points": [[1, 2, 3]], "radius": "1"}])", "edits[0].radius");
  refuse(R"([{"edit": "paint", "points": [[1, 2, 3]], "radius": -1}])", "radius");
  ExpectError([] { ParseEdits("nonsense", "my.json"); }, "my.json", "not JSON");
  ExpectError([] { ParseEdits("[]", "my.json"); }, "my.json", "the file is not an object");
  ExpectError([] { ParseEdits(R"({"version": 1, "edits": []})", "my.json"); }, "format");
  ExpectError([]
    { ParseEdits(R"({"format": "coronary edits", "version": 2, "edits": []})", "my.json"); },
    "version is 2", "reads 1");
  ExpectError([] { ReadEditsFile("/does/not/exist.json"); }, "/does/not/exist.json");
}
}
}
