// The pictures of a small made-up case: a forked tree that moves, its truth beside it. Pixels are counted.
#include "Refusals.h"
#include "vtkAnimatedGif.h"
#include "vtkDisplay.h"
#include "vtkEvaluationPictures.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkImageData.h"
#include "vtkIntArray.h"
#include "vtkNew.h"
#include "vtkPNGReader.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkRenderWindow.h"
#include "vtkTriangleFilter.h"
#include "vtkTubeFilter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

/// A trunk along -z with two branches in the frontal plane, moved to the left by `left` and stretched.
vtkSmartPointer<vtkPolyData> Tree(double left, double stretch)
{
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  vtkNew<vtkIntArray> groups;
  groups->SetName("GroupIds");
  const std::array<std::array<double, 4>, 3> ends = { { { 0, 0, 0, -20 }, { 0, -20, 25, -45 },
    { 0, -20, -25, -50 } } };
  for (int branch = 0; branch < 3; ++branch)
  {
    constexpr int Steps = 20;
    lines->InsertNextCell(Steps + 1);
    for (int k = 0; k <= Steps; ++k)
    {
      const double t = double(k) / Steps;
      const double x = ends[branch][0] + t * (ends[branch][2] - ends[branch][0]);
      const double z = ends[branch][1] + t * (ends[branch][3] - ends[branch][1]);
      lines->InsertCellPoint(points->InsertNextPoint(stretch * x + left, 0.0, z));
    }
    groups->InsertNextValue(branch);
  }
  auto tree = vtkSmartPointer<vtkPolyData>::New();
  tree->SetPoints(points);
  tree->SetLines(lines);
  tree->GetCellData()->AddArray(groups);
  return tree;
}

vtkSmartPointer<vtkPolyData> Surface(vtkPolyData* tree)
{
  vtkNew<vtkTubeFilter> tube;
  tube->SetInputData(tree);
  tube->SetRadius(1.5);
  tube->SetNumberOfSides(16);
  tube->CappingOn();
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputConnection(tube->GetOutputPort());
  triangles->Update();
  return triangles->GetOutput();
}

class Picture
{
public:
  explicit Picture(const std::string& path)
  {
    vtkNew<vtkPNGReader> reader;
    reader->SetFileName(path.c_str());
    reader->Update();
    this->Image = reader->GetOutput();
  }
  int Width() const { return this->Image->GetDimensions()[0]; }
  int Height() const { return this->Image->GetDimensions()[1]; }
  /// From the upper left corner.
  std::array<int, 3> At(int x, int y) const
  {
    const auto* pixel = static_cast<const unsigned char*>(
      this->Image->GetScalarPointer(x, this->Height() - 1 - y, 0));
    return { pixel[0], pixel[1], pixel[2] };
  }

  using Choice = std::function<bool(const std::array<int, 3>&)>;
  /// Number of such pixels, and the middle of their columns.
  std::pair<int, double> Find(const Choice& choice, int left, int top, int right, int bottom) const
  {
    int count = 0;
    double sum = 0.0;
    for (int y = std::max(0, top); y < std::min(bottom, this->Height()); ++y)
    {
      for (int x = std::max(0, left); x < std::min(right, this->Width()); ++x)
      {
        if (choice(this->At(x, y)))
        {
          ++count;
          sum += x;
        }
      }
    }
    return { count, sum / std::max(1, count) };
  }
  int Count(const Choice& choice) const
  {
    return this->Find(choice, 0, 0, this->Width(), this->Height()).first;
  }

private:
  vtkSmartPointer<vtkImageData> Image;
};

bool IsRed(const std::array<int, 3>& p)
{
  return p[0] > 80 && p[0] > 2 * p[1] && p[0] > 2 * p[2];
}
bool IsGreen(const std::array<int, 3>& p)
{
  return p[1] > 60 && 2 * p[1] > 3 * p[0] && 4 * p[1] > 5 * p[2];
}
bool IsBlack(const std::array<int, 3>& p)
{
  return p[0] == 20 && p[1] == 20 && p[2] == 20;
}
bool IsOrange(const std::array<int, 3>& p)
{
  return p[0] == 230 && p[1] == 120 && p[2] == 0;
}

class EvaluationPictures : public testing::Test
{
protected:
  void SetUp() override
  {
    std::string why;
    ASSERT_TRUE(CanDraw(why)) << why;
    std::string pattern =
      (std::filesystem::temp_directory_path() / "evaluation-pictures-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    this->Folder = pattern;
    this->Case.name = "a < b & \"c\"";
    for (int k = 0; k < 4; ++k)
    {
      PhaseEvaluation phase;
      phase.phase = k;
      phase.fraction = 0.25 * k;
      phase.interpolated = k % 2 == 1;
      phase.lost = k == 2;
      phase.measures.hausdorff = 2.0 + 0.1 * k;
      phase.measures.msd = 1.0;
      phase.measures.completenessRatio = 1.0;
      phase.measures.found = 0.999 + 0.0002 * k;
      this->Case.phases.push_back(phase);
    }
    this->Scene.evaluation = &this->Case;
    this->Scene.model = [this](int k)
    {
      ++this->Reads;
      return Surface(Tree(2.0 * k, 1.0));
    };
    // 2 mm further to the patient's left, and longer: the distances grow along the branches.
    this->Scene.truth = [](int k) { return Surface(Tree(2.0 * k + 2.0, 1.1)); };
    this->Scene.centerline = [](int k) { return Tree(2.0 * k, 1.0); };
  }
  void TearDown() override { std::filesystem::remove_all(this->Folder); }

  std::string Path(const std::string& name) const { return this->Folder + "/" + name; }

  std::string Folder;
  CaseEvaluation Case;
  EvaluationScene Scene;
  int Reads = 0;
};

TEST_F(EvaluationPictures, OverlayHasATilePerPhaseWithItsFrame)
{
  DrawOverlayGrid(this->Scene, this->Path("overlay.png"));
  EXPECT_EQ(this->Reads, 4) << "each surface is read once";
  const Picture picture(this->Path("overlay.png"));
  ASSERT_GE(picture.Width(), 2400);
  // Four phases: three columns, two rows. The first row's frames begin below the keys.
  const auto topOf = [&](int x, int from)
  {
    for (int y = from; y < picture.Height(); ++y)
    {
      if (IsBlack(picture.At(x, y)) || IsOrange(picture.At(x, y)))
      {
        return y;
      }
    }
    return -1;
  };
  const int tile = picture.Width() / 3;
  const int top = topOf(60, 160);
  ASSERT_GT(top, 0);
  // Along the upper edge: solid, dashed, and solid in the colour of what was lost.
  const auto changes = [&](int column)
  {
    int count = 0;
    for (int x = column * tile + 60; x < (column + 1) * tile - 60; ++x)
    {
      count += picture.At(x, top + 1) != picture.At(x + 1, top + 1) ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(changes(0), 0);
  EXPECT_GT(changes(1), 20);
  EXPECT_EQ(changes(2), 0);
  EXPECT_TRUE(IsBlack(picture.At(tile / 2, top + 1)));
  EXPECT_TRUE(IsOrange(picture.At(2 * tile + tile / 2, top + 1)));
  for (int column = 0; column < 3; ++column)
  {
    const auto [red, redAt] =
      picture.Find(IsRed, column * tile + 30, top + 60, (column + 1) * tile - 30, top + tile / 2);
    const auto [green, greenAt] =
      picture.Find(IsGreen, column * tile + 30, top + 60, (column + 1) * tile - 30, top + tile / 2);
    EXPECT_GT(red, 1000) << column;
    EXPECT_GT(green, 1000) << column;
    // The patient's left is on the right.
    EXPECT_GT(greenAt, redAt) << column;
  }
  // No fifth or sixth tile: white where they would be.
  const int second = topOf(60, top + tile / 2 + 100);
  EXPECT_EQ(picture
              .Find([](const auto& p) { return p[0] < 250; }, tile + 30, top + 720 + 60,
                picture.Width(), top + 2 * 720 - 60)
              .first,
    0)
    << second;
  // The lost phase and both neighbours, magnified: one more orange frame, below.
  const int lower = picture.Height() - 300;
  const auto orange =
    picture.Find(IsOrange, tile - 30, lower, 2 * tile + 30, picture.Height()).first;
  EXPECT_GT(orange, 1000);
  EXPECT_GT(picture.Find(IsRed, tile, picture.Height() - 600, 2 * tile, lower + 200).first, 3000);
}

TEST_F(EvaluationPictures, DistancesAreColouredFromNearToFar)
{
  DrawDistances(this->Scene, this->Path("distances.png"));
  const Picture picture(this->Path("distances.png"));
  EXPECT_EQ(picture.Width(), 2400);
  const int bar = picture.Height() - 180;
  const auto purple = [](const std::array<int, 3>& p)
  { return p[2] > p[1] + 20 && p[2] >= p[0] && p[2] < 200; };
  const auto yellow = [](const std::array<int, 3>& p)
  { return p[0] > 150 && p[1] > 150 && p[2] < 110; };
  EXPECT_GT(picture.Find(purple, 0, 130, 2400, bar).first, 2000) << "near";
  EXPECT_GT(picture.Find(yellow, 0, 130, 2400, bar).first, 500) << "far";
  EXPECT_GT(picture.Find(yellow, 0, bar, 2400, picture.Height()).first, 1000) << "the bar";
}

TEST_F(EvaluationPictures, SequenceHasPathsOnlyWithCenterlines)
{
  DrawSequence(this->Scene, this->Path("sequence.png"));
  const Picture all(this->Path("sequence.png"));
  EXPECT_EQ(all.Width(), 2400);
  const auto coloured = [](const std::array<int, 3>& p)
  { return *std::max_element(p.begin(), p.end()) - *std::min_element(p.begin(), p.end()) > 60; };
  for (int panel = 0; panel < 3; ++panel)
  {
    EXPECT_GT(
      all.Find(coloured, panel * 800 + 20, 190, panel * 800 + 780, all.Height()).first, 2000)
      << panel;
  }
  EXPECT_GT(all.Find(IsRed, 820, 190, 1580, all.Height()).first, 1000) << "spheres";
  // Moves to the patient's left: paths lie to the right of the first phase.
  const auto trail = [](const std::array<int, 3>& p) { return p[2] > p[0] + 40; };
  const auto [blue, blueAt] = all.Find(trail, 820, 190, 1580, all.Height());
  EXPECT_GT(blue, 1000);
  EXPECT_GT(blueAt, all.Find(IsRed, 820, 190, 1580, all.Height()).second);

  this->Scene.centerline = [](int) { return vtkSmartPointer<vtkPolyData>(); };
  this->Scene.store.reset();
  DrawSequence(this->Scene, this->Path("mesh.png"));
  const Picture mesh(this->Path("mesh.png"));
  EXPECT_GT(mesh.Find(coloured, 0, 190, 2400, mesh.Height()).first, 5000);
}

TEST_F(EvaluationPictures, BeatingIsInTheOrderOfTheFractions)
{
  std::swap(this->Case.phases[1].fraction, this->Case.phases[3].fraction);
  std::vector<std::string> frames = DrawBeating(this->Scene, this->Folder);
  ASSERT_EQ(frames.size(), CanWriteGif() ? 5U : 4U);
  frames.resize(4);
  std::vector<double> places;
  for (const std::string& path : frames)
  {
    const Picture frame(path);
    EXPECT_EQ(frame.Width(), 640);
    EXPECT_EQ(frame.Height(), 640);
    EXPECT_GT(frame.Count(IsGreen), 500);
    const auto [count, place] = frame.Find(IsRed, 0, 50, 640, 590);
    EXPECT_GT(count, 500);
    places.push_back(place);
  }
  // Phases 0, 3, 2, 1; each is further to the right than the one of a lower number.
  EXPECT_LT(places[0], places[3]);
  EXPECT_LT(places[3], places[2]);
  EXPECT_LT(places[2], places[1]);
  if (!CanWriteGif())
  {
    GTEST_SKIP() << "built without giflib";
  }
  std::ifstream file(this->Path("beating.gif"), std::ios::binary);
  const std::string gif((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  ASSERT_GT(gif.size(), 1000U);
  EXPECT_EQ(gif.substr(0, 6), "GIF89a");
  EXPECT_EQ(static_cast<unsigned char>(gif[6]) + 256 * gif[7], 640);
  EXPECT_NE(gif.find("NETSCAPE2.0"), std::string::npos);
  EXPECT_EQ(gif.back(), ';');
  // One control block a frame: a quarter of two seconds.
  std::size_t controls = 0;
  const std::string control = { '\x21', '\xF9', '\x04', '\x04', 50, 0 };
  for (std::size_t at = gif.find(control); at != std::string::npos; at = gif.find(control, at + 1))
  {
    ++controls;
  }
  EXPECT_EQ(controls, 4U);
}

TEST_F(EvaluationPictures, WithoutNumbersThereIsStillAPicture)
{
  this->Case.phases.resize(1);
  this->Case.phases[0].measures = EvaluationMeasures();
  this->Case.phases[0].fraction = EvaluationMeasures::NaN;
  DrawOverlayGrid(this->Scene, this->Path("one.png"));
  DrawSequence(this->Scene, this->Path("one-sequence.png"));
  EXPECT_GT(Picture(this->Path("one.png")).Count(IsRed), 3000);
  EXPECT_EQ(DrawBeating(this->Scene, this->Folder).size(), CanWriteGif() ? 2U : 1U);
}

TEST_F(EvaluationPictures, ErrorsNameWhatIsWrong)
{
  ExpectError(
    [&] { DrawOverlayGrid(this->Scene, this->Path("no/overlay.png")); }, "no/overlay.png");
  EXPECT_THROW(DrawBeating(this->Scene, this->Path("no")), std::runtime_error);
  EXPECT_THROW(DrawOverlayGrid(EvaluationScene(), this->Path("x.png")), std::invalid_argument);
  EvaluationScene empty = this->Scene;
  empty.store.reset();
  empty.model = empty.truth = [](int) { return vtkSmartPointer<vtkPolyData>::New(); };
  EXPECT_THROW(DrawOverlayGrid(empty, this->Path("x.png")), std::invalid_argument);
}

TEST_F(EvaluationPictures, ADisplayThatIsNotThereIsSaid)
{
  const char* known = std::getenv("DISPLAY");
  if (!known)
  {
    GTEST_SKIP() << "there is no display that could go";
  }
  const std::string display = known;
  const auto expectNone = [](const std::string& name)
  {
    std::string why;
    EXPECT_FALSE(HasDisplay(why));
    EXPECT_NE(why.find(name), std::string::npos) << why;
    // VTK 9.6 draws without one.
    vtkNew<vtkRenderWindow> window;
    EXPECT_EQ(CanDraw(why), !window->IsA("vtkXOpenGLRenderWindow"));
  };
  setenv("DISPLAY", ":4711", 1);
  expectNone(":4711");
  unsetenv("DISPLAY");
  expectNone("DISPLAY");
  setenv("DISPLAY", display.c_str(), 1);
  std::string why;
  EXPECT_TRUE(HasDisplay(why)) << why;
  EXPECT_TRUE(CanDraw(why)) << why;
}
}
