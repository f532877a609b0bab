// The review page's bytes, read again by a reader of their own and compared with what was put in.
#include "WebReview.h"
#include "vtkWebReview.h"

#include "MeshDistance.h"
#include "TriangleBvh.h"
#include "vtkSurfaceInput.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkStringArray.h"
#include "vtkTriangleFilter.h"
#include "vtkTubeFilter.h"

#include <gtest/gtest.h>

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;
using Json = nlohmann::json;

constexpr const char* Hostile =
  "</script><script>alert(1)</script> <b>&amp; \"'\\ \xF0\x9F\xAB\x80 \xFF";
constexpr double MaximumError = 0.01;

/// A forked tree of lines that moves to the left and grows.
vtkSmartPointer<vtkPolyData> Tree(double left, double stretch, int steps = 30)
{
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkIntArray> groups;
  groups->SetName("GroupIds");
  vtkNew<vtkStringArray> names;
  names->SetName("SegmentLabel");
  const double ends[3][4] = { { 0, 0, 0, -20 }, { 0, -20, 25, -45 }, { 0, -20, -25, -50 } };
  const char* labels[3] = { "LM", Hostile, "" };
  for (int branch = 0; branch < 3; ++branch)
  {
    lines->InsertNextCell(steps + 1);
    for (int k = 0; k <= steps; ++k)
    {
      const double t = double(k) / steps;
      const double x = ends[branch][0] + t * (ends[branch][2] - ends[branch][0]);
      const double z = ends[branch][1] + t * (ends[branch][3] - ends[branch][1]);
      lines->InsertCellPoint(
        points->InsertNextPoint(stretch * x + left, 2.0 * std::sin(4.0 * t), z));
    }
    groups->InsertNextValue(4 + branch);
    names->InsertNextValue(labels[branch]);
  }
  auto tree = vtkSmartPointer<vtkPolyData>::New();
  tree->SetPoints(points);
  tree->SetLines(lines);
  tree->GetCellData()->AddArray(groups);
  tree->GetCellData()->AddArray(names);
  return tree;
}

vtkSmartPointer<vtkPolyData> Surface(vtkPolyData* tree)
{
  vtkNew<vtkTubeFilter> tube;
  tube->SetInputData(tree);
  tube->SetRadius(1.5);
  tube->SetNumberOfSides(24);
  tube->CappingOn();
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputConnection(tube->GetOutputPort());
  triangles->Update();
  return triangles->GetOutput();
}

CaseEvaluation FourPhases()
{
  CaseEvaluation one;
  one.name = Hostile;
  for (int k = 0; k < 4; ++k)
  {
    PhaseEvaluation phase;
    phase.phase = k;
    phase.fraction = 0.25 * k;
    phase.interpolated = k % 2 == 1;
    phase.measures.hausdorff = 2.0 + 0.1 * k;
    BranchEvaluation branch;
    branch.group = 7;
    branch.label = Hostile;
    branch.length = 80.0;
    branch.covered = k == 3 ? 0.5 : 1.0;
    phase.branches.push_back(branch);
    one.phases.push_back(phase);
  }
  return one;
}

/// What a browser makes of it: only `html` is read.
class Page
{
public:
  explicit Page(const std::string& html)
    : Html(html)
    , Data(Json::parse(Element("<script type=\"application/json\" id=\"data\">")))
  {
  }

  std::string Element(const std::string& begin) const
  {
    const std::size_t from = this->Html.find(begin) + begin.size();
    return this->Html.substr(from, this->Html.find("</script>", from) - from);
  }

  std::string Bytes(int number) const
  {
    const std::string text =
      this->Element("<script type=\"text/plain\" id=\"shapes-" + std::to_string(number) + "\">");
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string deflated;
    unsigned int bits = 0;
    int count = 0;
    for (const char c : text)
    {
      const std::size_t value = letters.find(c);
      if (value == std::string::npos)
      {
        break;
      }
      bits = (bits << 6) | static_cast<unsigned int>(value);
      count += 6;
      if (count >= 8)
      {
        count -= 8;
        deflated += static_cast<char>((bits >> count) & 0xFFU);
      }
    }
    std::string bytes(this->Data["cases"][number]["bytes"].get<std::size_t>(), '\0');
    uLongf size = bytes.size();
    EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(bytes.data()), &size,
                reinterpret_cast<const Bytef*>(deflated.data()), deflated.size()),
      Z_OK);
    EXPECT_EQ(size, bytes.size());
    return bytes;
  }

  std::string Html;
  Json Data;
};

int UnZigZag(unsigned int value)
{
  return static_cast<int>(value >> 1) ^ -static_cast<int>(value & 1U);
}

unsigned int ByteAt(const std::string& bytes, std::size_t place)
{
  return static_cast<unsigned char>(bytes.at(place));
}

/// A series as it comes out of the page.
struct Decoded
{
  std::vector<std::vector<unsigned int>> cells; ///< of each topology
  std::vector<std::vector<Vector3>> positions;  ///< of each phase, mm
  std::vector<std::vector<double>> distances;   ///< of each phase, mm

  Decoded(const Json& layout, const std::string& bytes)
  {
    for (const Json& topology : layout["topologies"])
    {
      const std::size_t count = topology["indices"];
      const std::size_t place = topology["cells"];
      std::vector<unsigned int> indices;
      int last = 0;
      for (std::size_t k = 0; k < count; ++k)
      {
        unsigned int value = 0;
        for (std::size_t plane = 0; plane < 4; ++plane)
        {
          value |= ByteAt(bytes, place + plane * count + k) << (8 * plane);
        }
        last += UnZigZag(value);
        indices.push_back(static_cast<unsigned int>(last));
      }
      this->cells.push_back(indices);
    }
    std::vector<std::vector<int>> before(this->cells.size());
    std::vector<std::vector<int>> farBefore(this->cells.size());
    for (const Json& frame : layout["frames"])
    {
      const std::size_t topology = frame["topology"];
      const std::size_t count = layout["topologies"][topology]["points"];
      std::vector<Vector3> points(count);
      before[topology].resize(3 * count);
      for (std::size_t axis = 0; axis < 3; ++axis)
      {
        int move = 0;
        for (std::size_t k = 0; k < count; ++k)
        {
          const std::size_t at = frame["positions"].get<std::size_t>() + 2 * axis * count + k;
          move = (move + UnZigZag(ByteAt(bytes, at) | ByteAt(bytes, at + count) << 8)) & 0xFFFF;
          int& number = before[topology][3 * k + axis];
          number = (number + move) & 0xFFFF;
          points[k][static_cast<int>(axis)] =
            layout["low"][axis].get<double>() + number * layout["step"][axis].get<double>();
        }
      }
      this->positions.push_back(points);
      std::vector<double> far;
      if (frame.contains("distances"))
      {
        farBefore[topology].resize(count);
        int move = 0;
        for (std::size_t k = 0; k < count; ++k)
        {
          const std::size_t at = frame["distances"].get<std::size_t>() + k;
          move = (move + UnZigZag(ByteAt(bytes, at) | ByteAt(bytes, at + count) << 8)) & 0xFFFF;
          int& number = farBefore[topology][k];
          number = (number + move) & 0xFFFF;
          const int value = number < 32768 ? number : number - 65536;
          far.push_back(value == -32768 ? std::numeric_limits<double>::quiet_NaN()
                                        : value * layout["distance_step"].get<double>());
        }
      }
      this->distances.push_back(far);
    }
  }
};

class WebReviewPage : public testing::Test
{
protected:
  void SetUp() override
  {
    this->Evaluation = FourPhases();
    this->Scene.evaluation = &this->Evaluation;
    this->Scene.centerline = [](int k) { return Tree(3.0 * k, 1.0); };
    this->Scene.truthCenterline = [](int k) { return Tree(3.0 * k + 2.0, 1.1); };
    this->Scene.model = [this](int k) { return Surface(this->Scene.centerline(k)); };
    this->Scene.truth = [this](int k) { return Surface(this->Scene.truthCenterline(k)); };
  }

  Page Make(std::int64_t triangles)
  {
    WebReview review;
    review.Add(this->Evaluation, MakeReviewCase(this->Scene, triangles));
    review.AddIllustration("png", "pictures/overlay.png", Hostile);
    review.SetPlots(DrawPlots({ this->Evaluation, this->Evaluation }));
    return Page(review.Html({ "coronary-pipeline 0", std::string("evaluate ") + Hostile,
      { { Hostile, Hostile } }, { { Hostile, Hostile } }, { Hostile }, { "table1.csv" } }));
  }

  CaseEvaluation Evaluation;
  EvaluationScene Scene;
};

TEST_F(WebReviewPage, AllTrianglesComeBackWithinTheStatedError)
{
  const Page page = this->Make(1000000);
  const Json& shapes = page.Data["cases"][0]["shapes"];
  const std::string bytes = page.Bytes(0);
  for (const char* side : { "model", "truth" })
  {
    const Json& layout = shapes[side];
    ASSERT_EQ(layout["topologies"].size(), 1U) << "one connectivity for all phases";
    const Decoded decoded(layout, bytes);
    ASSERT_EQ(decoded.positions.size(), 4U);
    for (int k = 0; k < 4; ++k)
    {
      const bool model = std::string(side) == "model";
      const SurfaceMesh own =
        vtkCoronary::SurfaceOf(model ? this->Scene.model(k) : this->Scene.truth(k), "", "");
      const SurfaceMesh other =
        vtkCoronary::SurfaceOf(model ? this->Scene.truth(k) : this->Scene.model(k), "", "");
      ASSERT_EQ(decoded.cells[0].size(), 3 * own.triangles.size());
      for (std::size_t n = 0; n < own.triangles.size(); ++n)
      {
        for (std::size_t corner = 0; corner < 3; ++corner)
        {
          ASSERT_EQ(decoded.cells[0][3 * n + corner], own.triangles[n][corner]);
        }
      }
      const MeshDistance expected = CompareSurfaces(own, other);
      for (std::size_t n = 0; n < own.points.size(); ++n)
      {
        for (int axis = 0; axis < 3; ++axis)
        {
          // Points are of single precision.
          const double stated = 0.5 * layout["step"][axis].get<double>() + 5e-6;
          ASSERT_LT(stated, MaximumError);
          ASSERT_NEAR(decoded.positions[std::size_t(k)][n][axis], own.points[n][axis], stated);
        }
        ASSERT_NEAR(decoded.distances[std::size_t(k)][n], expected.pointDistancesA[n],
          0.5 * layout["distance_step"].get<double>() + 2e-5);
      }
    }
    EXPECT_EQ(layout["deviation"], 0.0);
    EXPECT_LT(layout["distance_step"].get<double>(), MaximumError);
  }
  // Outside and inside.
  const Decoded model(shapes["model"], bytes);
  const auto [minimum, maximum] =
    std::minmax_element(model.distances[0].begin(), model.distances[0].end());
  EXPECT_LT(*minimum, -0.5);
  EXPECT_GT(*maximum, 1.0);
}

TEST_F(WebReviewPage, AResultWithoutATruthHasDashesWhereItWasGuessed)
{
  ResultScene scene;
  scene.count = 4;
  scene.centerline = this->Scene.centerline;
  scene.guessed.assign(static_cast<std::size_t>(Tree(0.0, 1.0)->GetNumberOfPoints()), 0.0);
  std::fill(scene.guessed.begin() + 5, scene.guessed.begin() + 16, 1.0); // of the first line
  for (const bool surface : { false, true })
  {
    scene.model = surface ? this->Scene.model : EvaluationScene::Source();
    WebReview review;
    EXPECT_THROW(review.SetRun({}), std::invalid_argument);
    review.Add(this->Evaluation, MakeResultCase(scene, 1000000));
    EXPECT_EQ(review.AddPicture("one"), 0U);
    EXPECT_EQ(review.AddPicture("two"), 1U);
    review.SetRun({ { "warnings", { Hostile } } });
    const Page page(review.Html({ "coronary-pipeline 0", "review", {}, {}, {}, {} }));
    EXPECT_EQ(page.Element("<script type=\"text/plain\" id=\"picture-1\">"), "dHdv");
    const Json& one = page.Data["cases"][0];
    EXPECT_EQ(one["run"]["warnings"].size(), 1U);
    const Json& shapes = one["shapes"];
    EXPECT_TRUE(shapes["truth"].is_null());
    EXPECT_TRUE(shapes["truth_lines"].is_null());
    EXPECT_EQ(shapes["model"].is_null(), !surface);
    const std::string bytes = page.Bytes(0);
    if (surface)
    {
      const Decoded model(shapes["model"], bytes);
      ASSERT_EQ(model.positions.size(), 4U);
      EXPECT_TRUE(model.distances[0].empty());
    }
    // Pieces by the point that they end at; those from 4 to 5 .. 15 to 16 touch a guessed point.
    const auto ends = [&](const char* name)
    {
      const std::vector<unsigned int> cells = Decoded(shapes[name], bytes).cells[0];
      std::set<unsigned int> points;
      for (std::size_t k = 0; k < cells.size(); k += 2)
      {
        EXPECT_EQ(cells[k + 1], cells[k] + 1);
        points.insert(cells[k + 1]);
      }
      return points;
    };
    const std::set<unsigned int> seen = ends("model_lines");
    const std::set<unsigned int> dashes = ends("guessed_lines");
    EXPECT_EQ(seen.size(), 3U * 30U - 12U);
    for (const unsigned int point : seen)
    {
      EXPECT_TRUE(point < 5 || point > 16) << point;
    }
    // Dashes of 1.5 mm and gaps as long between, in pieces of 0.7 mm.
    EXPECT_EQ(dashes.count(5), 1U);
    EXPECT_GE(dashes.size(), 5U);
    EXPECT_LE(dashes.size(), 8U);
    EXPECT_GE(*dashes.begin(), 5U);
    EXPECT_LE(*dashes.rbegin(), 16U);
  }
  scene.centerline = [](int) { return vtkSmartPointer<vtkPolyData>(); };
  scene.model = nullptr;
  EXPECT_THROW(MakeResultCase(scene, 1000), std::invalid_argument);
}

TEST_F(WebReviewPage, ReducedSurfacesKeepPointsAndSayHowFarOffTheyAre)
{
  const Page page = this->Make(1500);
  const Json& shapes = page.Data["cases"][0]["shapes"];
  const Json& layout = shapes["model"];
  const Decoded decoded(layout, page.Bytes(0));
  const SurfaceMesh first = vtkCoronary::SurfaceOf(this->Scene.model(0), "", "");
  EXPECT_EQ(layout["original_cells"], first.triangles.size());
  EXPECT_GT(first.triangles.size(), 4000U);
  EXPECT_LE(decoded.cells[0].size(), 3U * 1600U);
  const double stated = layout["deviation"];
  EXPECT_GT(stated, 0.0);
  EXPECT_LT(stated, 0.5);
  const std::set<unsigned int> used(decoded.cells[0].begin(), decoded.cells[0].end());
  EXPECT_EQ(used.size(), decoded.positions[0].size()) << "no point without triangle";
  double maximum = 0.0;
  for (int k = 0; k < 4; ++k)
  {
    const SurfaceMesh whole = vtkCoronary::SurfaceOf(this->Scene.model(k), "", "");
    SurfaceMesh shown;
    shown.points = decoded.positions[std::size_t(k)];
    for (std::size_t n = 0; n < decoded.cells[0].size(); n += 3)
    {
      shown.triangles.push_back(
        { decoded.cells[0][n], decoded.cells[0][n + 1], decoded.cells[0][n + 2] });
    }
    maximum = std::max(maximum, CompareSurfaces(shown, whole).hausdorff);
    // Each of its points is one of the whole surface, with the distance that it has there.
    const SurfaceMesh truth = vtkCoronary::SurfaceOf(this->Scene.truth(k), "", "");
    const MeshDistance expected = CompareSurfaces(whole, truth);
    for (std::size_t n = 0; n < shown.points.size(); n += 7)
    {
      std::size_t nearest = 0;
      for (std::size_t m = 0; m < whole.points.size(); ++m)
      {
        if ((whole.points[m] - shown.points[n]).squaredNorm() <
          (whole.points[nearest] - shown.points[n]).squaredNorm())
        {
          nearest = m;
        }
      }
      ASSERT_LT((whole.points[nearest] - shown.points[n]).norm(), MaximumError);
      ASSERT_NEAR(
        decoded.distances[std::size_t(k)][n], expected.pointDistancesA[nearest], 2 * MaximumError);
    }
  }
  EXPECT_NEAR(maximum, stated, 0.02);
}

TEST_F(WebReviewPage, LinesHaveTheirNames)
{
  const Page page = this->Make(1500);
  const Json& layout = page.Data["cases"][0]["shapes"]["truth_lines"];
  const Decoded lines(layout, page.Bytes(0));
  ASSERT_EQ(lines.cells[0].size(), 2U * 3U * 30U);
  EXPECT_EQ(layout["branches"][0], "LM");
  EXPECT_EQ(layout["branches"][2], "branch 6") << "a group without a name";
  ASSERT_EQ(layout["topologies"][0]["labels"].size(), 2U);
  for (const Json& label : layout["topologies"][0]["labels"])
  {
    const std::size_t point = label["point"];
    EXPECT_EQ(point % 31, 15U) << "the middle of a line";
  }
  EXPECT_NEAR(lines.positions[3][0].x(), 11.0, MaximumError);
  EXPECT_EQ(page.Data["cases"][0]["view"]["centre"].size(), 3U);
}

TEST_F(WebReviewPage, AnotherConnectivityIsAnotherTopology)
{
  this->Scene.centerline = [](int k) { return Tree(3.0 * k, 1.0, k < 2 ? 30 : 20); };
  const Page page = this->Make(1000000);
  const Json& layout = page.Data["cases"][0]["shapes"]["model"];
  EXPECT_EQ(layout["topologies"].size(), 2U);
  EXPECT_EQ(layout["frames"][1]["topology"], 0);
  EXPECT_EQ(layout["frames"][3]["topology"], 1);
  const Decoded decoded(layout, page.Bytes(0));
  const SurfaceMesh last = vtkCoronary::SurfaceOf(this->Scene.model(3), "", "");
  ASSERT_EQ(decoded.positions[3].size(), last.points.size());
  for (std::size_t n = 0; n < last.points.size(); ++n)
  {
    ASSERT_LT((decoded.positions[3][n] - last.points[n]).norm(), MaximumError);
  }
}

TEST_F(WebReviewPage, HostileTextsStayTexts)
{
  const Page page = this->Make(1500);
  const auto count = [&](const std::string& what)
  {
    int found = 0;
    for (std::size_t at = page.Html.find(what); at != std::string::npos;
         at = page.Html.find(what, at + 1))
    {
      ++found;
    }
    return found;
  };
  EXPECT_EQ(count("<script"), 4) << "the data, the shapes of the case, a picture, the program";
  EXPECT_EQ(count("</script>"), 4);
  EXPECT_EQ(count("alert(1)</"), 0);
  EXPECT_EQ(count("<b>"), 0);
  EXPECT_EQ(count("src=\""), 0) << "nothing is loaded";
  EXPECT_EQ(count("{{"), 0);
  // The byte that is no UTF-8 is replaced, all others come back.
  std::string expected = Hostile;
  expected.replace(expected.find('\xFF'), 1, "\xEF\xBF\xBD");
  EXPECT_EQ(page.Data["cases"][0]["name"], expected);
  EXPECT_EQ(page.Data["table1"]["cases"][0]["name"], expected);
  EXPECT_EQ(page.Data["command"], "evaluate " + expected);
  EXPECT_EQ(page.Data["settings"][0], Json::array({ expected, expected }));
  EXPECT_EQ(page.Data["inputs"][0]["truth"], expected);
  EXPECT_EQ(page.Data["warnings"][0], expected);
  EXPECT_EQ(page.Data["files"], Json::array({ "table1.csv" }));
  EXPECT_EQ(page.Data["cases"][0]["branches"][3][0]["label"], expected);
  EXPECT_EQ(page.Data["cases"][0]["branches"][3][0]["covered"], 0.5);
  EXPECT_TRUE(page.Data["cases"][0]["branches"][3][0]["HD"].is_null()) << "not known";
  EXPECT_EQ(page.Data["cases"][0]["pictures"][0]["title"], expected);
  EXPECT_EQ(page.Element("<script type=\"text/plain\" id=\"picture-0\">"), "cG5n");
  ASSERT_EQ(page.Data["plots"].size(), 1U);
  EXPECT_EQ(page.Data["plots"][0]["key"], "HD");
  EXPECT_EQ(page.Data["plots"][0]["svg"].get<std::string>().find("<script"), std::string::npos);
  EXPECT_EQ(page.Html, this->Make(1500).Html) << "the same bytes again";
}

TEST(WebReview, SeveralCasesAreInOnePage)
{
  WebReview review;
  const ReviewCase nothing;
  review.Add(FourPhases(), nothing);
  review.Add(FourPhases(), nothing);
  const Page page(review.Html(ReviewOrigin()));
  EXPECT_EQ(page.Data["cases"].size(), 2U);
  EXPECT_TRUE(page.Data["cases"][1]["shapes"]["model"].is_null());
  EXPECT_EQ(page.Data["table1"]["cases"].size(), 2U);
  EXPECT_EQ(page.Data["table1"]["cases"][1]["phases"][3]["HD"], 2.3);
}

TEST(WebReview, WhatIsNotKnownStaysUnknown)
{
  ReviewCase one;
  one.model.topologies.resize(1);
  one.model.topologies[0].points = 3;
  one.model.topologies[0].cells = { 0, 1, 2 };
  ReviewFrame frame;
  frame.positions = { 0, 0, 5, 10, 0, 5, 0, 20, 5 };
  frame.distances = { std::numeric_limits<float>::quiet_NaN(), -1.5F, 3.0F };
  one.model.frames = { frame };
  const PackedShapes packed = PackShapes(one);
  const Decoded decoded(packed.layout["model"], packed.bytes);
  EXPECT_TRUE(std::isnan(decoded.distances[0][0]));
  EXPECT_NEAR(decoded.distances[0][1], -1.5, 1e-4);
  EXPECT_NEAR(decoded.distances[0][2], 3.0, 1e-4);
  EXPECT_NEAR((decoded.positions[0][2] - Vector3(0, 20, 5)).norm(), 0.0, 1e-6) << "a flat box";

  const auto refused = [&](const std::function<void(ReviewSeries&)>& change)
  {
    ReviewCase wrong = one;
    change(wrong.model);
    EXPECT_THROW(PackShapes(wrong), std::invalid_argument);
  };
  refused([](ReviewSeries& series) { series.topologies[0].cells[1] = 3; });
  refused([](ReviewSeries& series) { series.topologies[0].branches = { 0 }; });
  refused([](ReviewSeries& series) { series.frames[0].topology = 1; });
  refused([](ReviewSeries& series) { series.frames[0].distances.pop_back(); });
  refused([](ReviewSeries& series)
    { series.frames[0].positions[4] = std::numeric_limits<float>::infinity(); });
  WebReview review;
  EXPECT_THROW(review.Add(FourPhases(), one), std::invalid_argument) << "one frame, four phases";
}

TEST(WebReview, ManyPhasesGetFewerTriangles)
{
  EXPECT_EQ(DefaultReviewTriangles(20), 150000);
  EXPECT_EQ(DefaultReviewTriangles(200), 15000);
  EXPECT_GT(DefaultReviewTriangles(1000000), 0);
}
}
