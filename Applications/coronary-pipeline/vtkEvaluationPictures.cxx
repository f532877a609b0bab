#include "vtkEvaluationPictures.h"

#include "Median.h"
#include "MeshDistance.h"
#include "vtkAnimatedGif.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkPictureCanvas.h"
#include "vtkScenePainter.h"
#include "vtkSurfaceInput.h"

#include "vtkCellArray.h"
#include "vtkCellArrayIterator.h"
#include "vtkCellData.h"
#include "vtkColorTransferFunction.h"
#include "vtkFloatArray.h"
#include "vtkGlyph3D.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataNormals.h"
#include "vtkSphereSource.h"
#include "vtkTubeFilter.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace coronary
{
/// What the pictures of a scene share.
struct PictureStore
{
  std::map<int, vtkSmartPointer<vtkPolyData>> models;
  std::map<int, vtkSmartPointer<vtkPolyData>> truths;
  std::map<int, vtkSmartPointer<vtkPolyData>> centerlines;
  ScenePainter painter;
  std::vector<Vector3> shape;  ///< some points of the first phase
  std::vector<Vector3> framed; ///< some points of all phases
};

namespace
{
constexpr Colour Red = { 214, 39, 40 };
constexpr Colour Green = { 60, 179, 80 };
constexpr Colour Black = { 20, 20, 20 };
constexpr Colour Grey = { 110, 110, 110 };
constexpr Colour Orange = { 230, 120, 0 };
constexpr int PageWidth = 2400;
constexpr int Margin = 40;
constexpr double OverlayAspect = 10.0 / 9.0;
constexpr double OverlayMargin = 0.09;
using Anchor = PictureCanvas::Anchor;

/// Points and normals in single precision, triangles with 32 bits an index, nothing else.
vtkSmartPointer<vtkPolyData> LeanSurface(vtkPolyData* surface)
{
  const vtkSmartPointer<vtkPolyData> triangles = vtkCoronary::TrianglesOf(surface);
  vtkNew<vtkPolyData> bare;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  if (triangles && triangles->GetPoints())
  {
    points->DeepCopy(triangles->GetPoints());
  }
  bare->SetPoints(points);
  vtkNew<vtkCellArray> cells;
  if (triangles)
  {
    cells->DeepCopy(triangles->GetPolys());
  }
  cells->ConvertTo32BitStorage();
  bare->SetPolys(cells);
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(bare);
  normals->SplittingOff();
  normals->ConsistencyOff();
  normals->Update();
  auto lean = vtkSmartPointer<vtkPolyData>::New();
  lean->SetPoints(bare->GetPoints());
  lean->SetPolys(cells);
  lean->GetPointData()->SetNormals(normals->GetOutput()->GetPointData()->GetNormals());
  return lean;
}

vtkSmartPointer<vtkPolyData> LeanLines(vtkPolyData* tree)
{
  auto lean = vtkSmartPointer<vtkPolyData>::New();
  lean->SetPoints(tree->GetPoints());
  lean->SetLines(tree->GetLines());
  vtkDataArray* groups = tree->GetCellData()->GetArray(vtkCoronaryArrayNames::GroupIds);
  // Cell data count vertices first.
  if (groups && tree->GetNumberOfVerts() == 0)
  {
    lean->GetCellData()->AddArray(groups);
  }
  return lean;
}

void AppendSome(vtkPolyData* data, vtkIdType wanted, std::vector<Vector3>& points)
{
  const vtkIdType step = std::max<vtkIdType>(1, data->GetNumberOfPoints() / wanted);
  for (vtkIdType k = 0; k < data->GetNumberOfPoints(); k += step)
  {
    Vector3 point;
    data->GetPoint(k, point.data());
    if (point.allFinite())
    {
      points.push_back(point);
    }
  }
}

/// The scene with its store: reads what was not read yet.
class Stage
{
public:
  explicit Stage(const EvaluationScene& scene)
    : Scene(scene)
  {
    if (!scene.evaluation || scene.evaluation->phases.empty())
    {
      throw std::invalid_argument("There is no phase to draw.");
    }
    if (!scene.model || !scene.truth)
    {
      throw std::invalid_argument("There are no surfaces to draw.");
    }
    if (!scene.store)
    {
      scene.store = std::make_shared<PictureStore>();
    }
    PictureStore& store = *scene.store;
    if (store.framed.empty())
    {
      for (int k = 0; k < this->Count(); ++k)
      {
        AppendSome(this->Model(k), 4000, store.framed);
        AppendSome(this->Truth(k), 4000, store.framed);
      }
      AppendSome(this->Truth(0), 15000, store.shape);
      AppendSome(this->Model(0), 15000, store.shape);
      if (store.framed.empty())
      {
        throw std::invalid_argument("The surfaces to draw have no points.");
      }
    }
  }

  int Count() const { return static_cast<int>(this->Scene.evaluation->phases.size()); }
  const PhaseEvaluation& Phase(int k) const { return this->Scene.evaluation->phases[k]; }
  const std::string& Name() const { return this->Scene.evaluation->name; }

  vtkPolyData* Model(int k) const
  {
    return this->Surface(this->Scene.store->models, this->Scene.model, k, "model");
  }
  vtkPolyData* Truth(int k) const
  {
    return this->Surface(this->Scene.store->truths, this->Scene.truth, k, "truth");
  }
  /// May be null.
  vtkPolyData* Centerline(int k) const
  {
    auto& kept = this->Scene.store->centerlines;
    auto found = kept.find(k);
    if (found == kept.end())
    {
      const vtkSmartPointer<vtkPolyData> tree =
        this->Scene.centerline ? this->Scene.centerline(k) : nullptr;
      const bool lines = tree && tree->GetNumberOfPoints() > 0 && tree->GetNumberOfLines() > 0;
      found = kept.emplace(k, lines ? LeanLines(tree) : nullptr).first;
    }
    return found->second;
  }

  ScenePainter& Painter() const { return this->Scene.store->painter; }
  PictureView View(double aspect, double margin) const
  {
    return FindView(this->Scene.store->shape, this->Scene.store->framed, aspect, margin);
  }

  /// Index of the phase with the greatest HD among these; -1: none of them has one.
  int Worst(bool onlyLost) const
  {
    int worst = -1;
    for (int k = 0; k < this->Count(); ++k)
    {
      const double hd = this->Phase(k).measures.hausdorff;
      if (std::isfinite(hd) && (this->Phase(k).lost || !onlyLost) &&
        (worst < 0 || hd > this->Phase(worst).measures.hausdorff))
      {
        worst = k;
      }
    }
    return worst;
  }

  std::vector<Vector3> SomeOf(int k) const
  {
    std::vector<Vector3> points;
    AppendSome(this->Model(k), 15000, points);
    AppendSome(this->Truth(k), 15000, points);
    return points;
  }

  MeshDistance Distance(int k) const
  {
    MeshDistanceSettings settings;
    settings.areaMeasures = false;
    settings.signedDistances = false;
    settings.errorBound = 0.01;
    return CompareSurfaces(vtkCoronary::SurfaceOf(this->Model(k), "", ""),
      vtkCoronary::SurfaceOf(this->Truth(k), "", ""), settings);
  }

private:
  static vtkPolyData* Surface(std::map<int, vtkSmartPointer<vtkPolyData>>& kept,
    const EvaluationScene::Source& source, int k, const char* what)
  {
    auto found = kept.find(k);
    if (found == kept.end())
    {
      const vtkSmartPointer<vtkPolyData> surface = source(k);
      if (!surface)
      {
        throw std::invalid_argument(
          std::string("There is no surface of the ") + what + " to draw.");
      }
      found = kept.emplace(k, LeanSurface(surface)).first;
    }
    return found->second;
  }

  const EvaluationScene& Scene;
};

std::string Number(double value, int digits)
{
  if (!std::isfinite(value))
  {
    return "-";
  }
  char text[64];
  std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}

std::string Percent(const PhaseEvaluation& phase)
{
  return std::isfinite(phase.fraction) ? Number(100.0 * phase.fraction, 1) + " %R-R" : "";
}

std::string PhaseName(const PhaseEvaluation& phase)
{
  return "Phase " + std::to_string(phase.phase);
}

std::string PhaseTitle(const PhaseEvaluation& phase)
{
  return PhaseName(phase) +
    (phase.lost ? ", tracking lost" : (phase.interpolated ? ", interpolated" : ", tracked"));
}

std::string Distances(const PhaseEvaluation& phase)
{
  const EvaluationMeasures& m = phase.measures;
  const std::string found =
    std::isfinite(m.found) ? "found " + Number(100.0 * m.found, 1) + " %   " : "";
  return found + "ASSD " + Number(m.assd, 2) + "   HD " + Number(m.hausdorff, 2) + " mm";
}

/// A length that is round and about a fifth of the view, with its line.
void DrawScaleBar(PictureCanvas& page, int right, int bottom, const PictureView& view, int height)
{
  const double pixels = height / view.height; // a millimetre
  double length = 100.0;
  for (const double candidate : { 50.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1 })
  {
    if (length * pixels > 0.3 * height)
    {
      length = candidate;
    }
  }
  const int width = static_cast<int>(std::lround(length * pixels));
  page.Fill(right - width, bottom - 4, width, 4, Black);
  page.Fill(right - width, bottom - 10, 2, 16, Black);
  page.Fill(right - 2, bottom - 10, 2, 16, Black);
  char text[32];
  std::snprintf(text, sizeof(text), "%g mm", length);
  page.Write(right - width / 2, bottom - 22, text, 22, Black, Anchor::Centre);
}

/// A rectangle with what it means.
int DrawKey(PictureCanvas& page, int x, int y, const Colour& colour, const std::string& text)
{
  page.Fill(x, y - 12, 40, 24, colour);
  return x + 52 + page.Write(x + 52, y, text, 28, Black) + 44;
}

int DrawFrameKey(
  PictureCanvas& page, int x, int y, const Colour& colour, int dash, const std::string& text)
{
  page.Frame(x, y - 14, 44, 28, 4, colour, dash);
  return x + 56 + page.Write(x + 56, y, text, 28, Black) + 44;
}

void DrawTitle(
  PictureCanvas& page, const Stage& stage, const PictureView& view, const std::string& what = "")
{
  page.Write(Margin, Margin + 18, stage.Name() + what, 40, Black, Anchor::Left, true);
  page.Write(page.Width() - Margin, Margin + 18, "view " + view.Name(), 28, Grey, Anchor::Right);
}

constexpr int FrameThickness = 4;
constexpr int Inside = FrameThickness + 2;
constexpr int Dash = 16;

/// Part of a page.
struct Tile
{
  int left;
  int top;
  int width;
  int height;
};

void DrawFrame(PictureCanvas& page, const Tile& tile, const PhaseEvaluation& phase)
{
  page.Frame(tile.left, tile.top, tile.width, tile.height, FrameThickness,
    phase.lost ? Orange : Black, phase.interpolated ? Dash : 0);
}

/// Above and below the picture of a large tile.
constexpr int Band = 58;

/// The phase's name above, its distances below; the picture fills what is between.
void DrawLargeTile(
  PictureCanvas& page, const Tile& tile, const PictureCanvas& picture, const PhaseEvaluation& phase)
{
  const int right = tile.left + tile.width - 22;
  page.Draw(picture, tile.left + Inside, tile.top + Band);
  page.Write(tile.left + 22, tile.top + 32, PhaseTitle(phase), 30, phase.lost ? Orange : Black,
    Anchor::Left, true);
  page.Write(right, tile.top + 32, Percent(phase), 26, Black, Anchor::Right);
  page.Write(tile.left + 22, tile.top + tile.height - 31, Distances(phase), 26, Black);
  DrawFrame(page, tile, phase);
}

/// The centre of a magnified view with the most points in it; the place that is shown stays away from its edges.
Vector3 FullestCentre(
  const std::vector<Vector3>& points, const Vector3& place, const PictureView& view, double aspect)
{
  Vector3 best = place;
  std::size_t most = 0;
  const double halfHeight = 0.5 * view.height;
  const double halfWidth = halfHeight * aspect;
  for (int i = -2; i <= 2; ++i)
  {
    for (int j = -2; j <= 2; ++j)
    {
      const Vector3 centre =
        place + 0.3 * i * halfWidth * view.right + 0.3 * j * halfHeight * view.up;
      std::size_t inside = 0;
      for (const Vector3& point : points)
      {
        const Vector3 from = point - centre;
        if (std::abs(from.dot(view.right)) < halfWidth && std::abs(from.dot(view.up)) < halfHeight)
        {
          ++inside;
        }
      }
      // The middle where it makes no difference.
      if (inside > most || (inside == most && i == 0 && j == 0))
      {
        most = inside;
        best = centre;
      }
    }
  }
  return best;
}

PictureCanvas PaintOverlay(
  const Stage& stage, int k, const PictureView& view, int width, int height)
{
  return stage.Painter().Paint(
    { { stage.Model(k), Red }, { stage.Truth(k), Green } }, view, width, height);
}
}

void DrawOverlayGrid(const EvaluationScene& scene, const std::string& path)
{
  const Stage stage(scene);
  const int count = stage.Count();
  // Four rows of five for twenty phases, and near that shape for others.
  const int columns = std::max(1, static_cast<int>(std::ceil(std::sqrt(1.25 * count) - 1e-9)));
  const int rows = (count + columns - 1) / columns;
  constexpr int Gap = 14;
  constexpr int Header = 150;
  const int width =
    std::max(320, (PageWidth - 2 * Margin - (columns - 1) * Gap + columns - 1) / columns);
  const int height = std::min(width * 9 / 10, 900);
  const int pageWidth = 2 * Margin + columns * width + (columns - 1) * Gap;

  const int lost = stage.Worst(true);
  const int focus = lost >= 0 ? lost : stage.Worst(false);
  const int shown = focus < 0 ? 0 : std::min(3, count);
  const int first = shown == 0 ? 0 : std::clamp(focus - 1, 0, count - shown);
  const int largeWidth = shown == 0 ? 0 : (pageWidth - 2 * Margin - 2 * Gap) / 3;
  const int largeHeight = largeWidth * 3 / 4;
  const int largeInside = largeHeight - 2 * Band;
  const int gridBottom = Margin + Header + rows * (height + Gap);
  const int pageHeight = gridBottom + Margin + (shown == 0 ? 0 : 100 + largeHeight);

  PictureCanvas page(pageWidth, pageHeight);
  const double aspect = double(width) / height;
  const PictureView view = stage.View(aspect, OverlayMargin);
  DrawTitle(page, stage, view);
  int x = Margin;
  const int y = Margin + 92;
  x = DrawKey(page, x, y, Red, "model");
  x = DrawKey(page, x, y, Green, "truth");
  x = DrawFrameKey(page, x, y, Black, 0, "tracked");
  x = DrawFrameKey(page, x, y, Black, 10, "interpolated");
  if (lost >= 0)
  {
    DrawFrameKey(page, x, y, Orange, 0, "tracking lost");
  }

  // What is magnified: around the place of the greatest distance.
  PictureView close = view;
  if (shown > 0)
  {
    const MeshDistance distance = stage.Distance(focus);
    const SideDistance& side =
      distance.ab.hausdorff >= distance.ba.hausdorff ? distance.ab : distance.ba;
    close.height = 0.36 * view.height * width * largeInside / (double(height) * largeWidth);
    close.centre = FullestCentre(
      stage.SomeOf(focus), 0.5 * (side.at + side.nearest), close, double(largeWidth) / largeInside);
  }

  for (int k = 0; k < count; ++k)
  {
    const int left = Margin + (k % columns) * (width + Gap);
    const int top = Margin + Header + (k / columns) * (height + Gap);
    const PhaseEvaluation& phase = stage.Phase(k);
    page.Draw(PaintOverlay(stage, k, view, width - 2 * Inside, height - 2 * Inside), left + Inside,
      top + Inside);
    page.Write(left + 18, top + 26, PhaseName(phase), 26, Black, Anchor::Left, true);
    page.Write(left + width - 18, top + 26, Percent(phase), 22, Black, Anchor::Right);
    page.Write(left + 18, top + height - 26, Distances(phase), 20, Grey);
    if (phase.lost)
    {
      page.Write(left + width - 18, top + height - 26, "lost", 22, Orange, Anchor::Right, true);
    }
    if (k >= first && k < first + shown)
    {
      const std::array<double, 2> centre =
        view.PixelOf(close.centre, width - 2 * Inside, height - 2 * Inside);
      const double scale = (height - 2 * Inside) / view.height;
      const int boxHeight = static_cast<int>(scale * close.height);
      const int boxWidth = boxHeight * largeWidth / largeInside;
      page.Frame(left + Inside + static_cast<int>(centre[0]) - boxWidth / 2,
        top + Inside + static_cast<int>(centre[1]) - boxHeight / 2, boxWidth, boxHeight, 2, Grey);
    }
    DrawFrame(page, { left, top, width, height }, phase);
  }
  DrawScaleBar(page, pageWidth - Margin, y + 12, view, height - 2 * Inside);

  if (shown > 0)
  {
    page.Write(Margin, gridBottom + 40,
      (lost >= 0 ? "Magnified: the phase whose tracking was lost and its neighbours"
                 : "Magnified: the phase with the greatest Hausdorff distance and its neighbours"),
      30, Black, Anchor::Left, true);
    const int top = gridBottom + 80;
    for (int k = 0; k < shown; ++k)
    {
      DrawLargeTile(page, { Margin + k * (largeWidth + Gap), top, largeWidth, largeHeight },
        PaintOverlay(stage, first + k, close, largeWidth - 2 * Inside, largeInside),
        stage.Phase(first + k));
    }
    DrawScaleBar(page, Margin + shown * (largeWidth + Gap) - Gap - 30, top + largeHeight - 18,
      close, largeInside);
  }
  page.WritePng(path);
}

namespace
{
/// Dark to bright, even steps to the eye (viridis), in the order of the distance.
vtkSmartPointer<vtkColorTransferFunction> DistanceColours(double maximum)
{
  constexpr std::array<std::array<double, 3>, 6> Viridis = { { { 0.267, 0.005, 0.329 },
    { 0.254, 0.265, 0.530 }, { 0.164, 0.471, 0.558 }, { 0.135, 0.659, 0.518 },
    { 0.478, 0.821, 0.318 }, { 0.993, 0.906, 0.144 } } };
  auto map = vtkSmartPointer<vtkColorTransferFunction>::New();
  for (std::size_t k = 0; k < Viridis.size(); ++k)
  {
    const double at = maximum * static_cast<double>(k) / (Viridis.size() - 1);
    map->AddRGBPoint(at, Viridis[k][0], Viridis[k][1], Viridis[k][2]);
  }
  map->SetNanColor(0.7, 0.7, 0.7);
  return map;
}

/// 1, 2 or 5 times a power of ten, not below the value.
double RoundUp(double value)
{
  const double power = std::pow(10.0, std::floor(std::log10(std::max(value, 1e-6))));
  for (const double factor : { 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0 })
  {
    if (factor * power >= value * (1.0 - 1e-9))
    {
      return factor * power;
    }
  }
  return 10.0 * power;
}

void DrawColourBar(PictureCanvas& page, int x, int y, int width, int height,
  vtkColorTransferFunction* map, double maximum)
{
  for (int column = 0; column < width; ++column)
  {
    double rgb[3];
    map->GetColor(maximum * (column + 0.5) / width, rgb);
    page.Fill(x + column, y, 1, height,
      { static_cast<unsigned char>(std::lround(255.0 * rgb[0])),
        static_cast<unsigned char>(std::lround(255.0 * rgb[1])),
        static_cast<unsigned char>(std::lround(255.0 * rgb[2])) });
  }
  page.Frame(x, y, width, height, 2, Black);
  constexpr int Ticks = 5;
  for (int k = 0; k <= Ticks; ++k)
  {
    const int at = x + (width - 2) * k / Ticks;
    page.Fill(at, y + height, 2, 8, Black);
    char text[32];
    std::snprintf(
      text, sizeof(text), "%s%.3g", k == Ticks ? "\xE2\x89\xA5 " : "", maximum * k / Ticks);
    page.Write(at, y + height + 26, text, 26, Black, Anchor::Centre);
  }
}

/// Four phases that are evenly spread, the nearest of them replaced by that with the greatest HD.
std::vector<int> FourPhases(const Stage& stage)
{
  const int count = stage.Count();
  std::vector<int> chosen;
  for (int k = 0; k < std::min(4, count); ++k)
  {
    chosen.push_back(count <= 4 ? k : k * count / 4);
  }
  const int worst = stage.Worst(false);
  if (worst >= 0 && std::find(chosen.begin(), chosen.end(), worst) == chosen.end())
  {
    *std::min_element(chosen.begin(), chosen.end(),
      [&](int a, int b) { return std::abs(a - worst) < std::abs(b - worst); }) = worst;
  }
  return chosen;
}
}

vtkPolyData* ShownModel(const EvaluationScene& scene, int index)
{
  return Stage(scene).Model(index);
}

vtkPolyData* ShownTruth(const EvaluationScene& scene, int index)
{
  return Stage(scene).Truth(index);
}

PictureView OverlayView(const EvaluationScene& scene, double& aspect)
{
  aspect = OverlayAspect;
  return Stage(scene).View(OverlayAspect, OverlayMargin);
}

std::vector<int> DistancePhases(const EvaluationScene& scene)
{
  return FourPhases(Stage(scene));
}

double DistanceRange(const std::vector<double>& distances)
{
  std::vector<double> all;
  for (const double distance : distances)
  {
    if (std::isfinite(distance))
    {
      all.push_back(std::abs(distance));
    }
  }
  if (all.empty())
  {
    return 1.0;
  }
  // A few points far away must not take the colours from all others.
  return RoundUp(std::max(InclusiveQuantileOf(std::move(all), 0.995), 1e-3));
}

void DrawDistances(const EvaluationScene& scene, const std::string& path)
{
  const Stage stage(scene);
  const std::vector<int> phases = FourPhases(stage);
  std::vector<MeshDistance> distances;
  std::vector<double> all;
  for (const int k : phases)
  {
    distances.push_back(stage.Distance(k));
    const std::vector<double>& one = distances.back().pointDistancesA;
    all.insert(all.end(), one.begin(), one.end());
  }
  const double maximum = DistanceRange(all);
  const vtkSmartPointer<vtkColorTransferFunction> map = DistanceColours(maximum);

  constexpr int Gap = 14;
  constexpr int Header = 90;
  constexpr int Footer = 130;
  const int columns = phases.size() == 1 ? 1 : 2;
  const int rows = (static_cast<int>(phases.size()) + 1) / 2;
  const int width = (PageWidth - 2 * Margin - (columns - 1) * Gap) / columns;
  const int height = std::min(width * 3 / 4, 1000);
  PictureCanvas page(PageWidth, 2 * Margin + Header + rows * (height + Gap) + Footer);
  const PictureView view = stage.View(double(width - 2 * Inside) / (height - 2 * Band), 0.02);
  DrawTitle(page, stage, view, ": distance of the model from the truth");
  for (std::size_t k = 0; k < phases.size(); ++k)
  {
    vtkNew<vtkPolyData> coloured;
    coloured->ShallowCopy(stage.Model(phases[k]));
    vtkNew<vtkFloatArray> values;
    values->SetName(vtkCoronaryArrayNames::SurfaceDistance);
    values->SetNumberOfTuples(coloured->GetNumberOfPoints());
    for (vtkIdType point = 0; point < coloured->GetNumberOfPoints(); ++point)
    {
      values->SetValue(
        point, static_cast<float>(std::abs(distances[k].pointDistancesA[std::size_t(point)])));
    }
    coloured->GetPointData()->SetScalars(values);
    const int left = Margin + static_cast<int>(k % 2) * (width + Gap);
    const int top = Margin + Header + static_cast<int>(k / 2) * (height + Gap);
    PictureItem item{ coloured, Grey };
    item.map = map;
    DrawLargeTile(page, { left, top, width, height },
      stage.Painter().Paint({ item }, view, width - 2 * Inside, height - 2 * Band),
      stage.Phase(phases[k]));
    if (k + 1 == phases.size())
    {
      DrawScaleBar(page, left + width - 30, top + height - 18, view, height - 2 * Band);
    }
  }
  const int bar = Margin + Header + rows * (height + Gap) + 40;
  page.Write(PageWidth / 2 - 520, bar + 20, "distance (mm)", 30, Black, Anchor::Right);
  DrawColourBar(page, PageWidth / 2 - 480, bar, 960, 40, map, maximum);
  page.WritePng(path);
}

namespace
{
// Told apart by lightness as well (Tableau's twenty, the darker ones first).
constexpr std::array<Colour, 16> BranchColours = { { { 31, 119, 180 }, { 214, 39, 40 },
  { 44, 160, 44 }, { 255, 127, 14 }, { 148, 103, 189 }, { 140, 86, 75 }, { 227, 119, 194 },
  { 23, 190, 207 }, { 188, 189, 34 }, { 90, 90, 90 }, { 0, 80, 120 }, { 255, 152, 150 },
  { 90, 200, 120 }, { 255, 187, 80 }, { 180, 160, 220 }, { 120, 60, 20 } } };

/// Lines coloured by their branch.
vtkSmartPointer<vtkPolyData> ColouredLines(
  vtkPolyData* lines, const std::map<long long, std::size_t>& ranks)
{
  auto coloured = vtkSmartPointer<vtkPolyData>::New();
  coloured->CopyStructure(lines);
  vtkDataArray* groups = lines->GetCellData()->GetArray(vtkCoronaryArrayNames::GroupIds);
  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetNumberOfComponents(3);
  for (vtkIdType cell = 0; cell < lines->GetNumberOfLines(); ++cell)
  {
    const long long id = groups ? static_cast<long long>(groups->GetComponent(cell, 0)) : cell;
    const auto rank = ranks.find(id);
    colours->InsertNextTypedTuple(
      BranchColours[(rank == ranks.end() ? 0 : rank->second) % BranchColours.size()].data());
  }
  coloured->GetCellData()->SetScalars(colours);
  return coloured;
}

/// Branches in the order of their ids get colours in the order of the palette.
std::map<long long, std::size_t> RanksOf(vtkPolyData* lines)
{
  std::map<long long, std::size_t> ranks;
  vtkDataArray* groups = lines->GetCellData()->GetArray(vtkCoronaryArrayNames::GroupIds);
  for (vtkIdType cell = 0; cell < lines->GetNumberOfLines(); ++cell)
  {
    ranks[groups ? static_cast<long long>(groups->GetComponent(cell, 0)) : cell] = 0;
  }
  std::size_t next = 0;
  for (auto& [id, rank] : ranks)
  {
    rank = next++;
  }
  return ranks;
}

/// Points of the tree, spaced along its lines and with both of a line's ends.
std::vector<vtkIdType> SpacedPoints(vtkPolyData* lines, double spacing)
{
  std::vector<vtkIdType> chosen;
  auto cells = vtkSmartPointer<vtkCellArrayIterator>::Take(lines->GetLines()->NewIterator());
  for (cells->GoToFirstCell(); !cells->IsDoneWithTraversal(); cells->GoToNextCell())
  {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    cells->GetCurrentCell(count, ids);
    double length = 0.0;
    double last = -spacing;
    Vector3 before = Vector3::Zero();
    for (vtkIdType k = 0; k < count; ++k)
    {
      Vector3 point;
      lines->GetPoint(ids[k], point.data());
      length += k > 0 ? (point - before).norm() : 0.0;
      before = point;
      if (length >= last + spacing)
      {
        chosen.push_back(ids[k]);
        last = length;
      }
    }
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

/// Where points of the tree go, one tube each.
vtkSmartPointer<vtkPolyData> PathTubes(
  const std::vector<vtkPolyData*>& trees, const std::vector<vtkIdType>& chosen, double radius)
{
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> lines;
  for (const vtkIdType id : chosen)
  {
    lines->InsertNextCell(static_cast<int>(trees.size()));
    for (vtkPolyData* tree : trees)
    {
      lines->InsertCellPoint(points->InsertNextPoint(tree->GetPoint(id)));
    }
  }
  vtkNew<vtkPolyData> paths;
  paths->SetPoints(points);
  paths->SetLines(lines);
  vtkNew<vtkTubeFilter> tubes;
  tubes->SetInputData(paths);
  tubes->SetRadius(radius);
  tubes->SetNumberOfSides(10);
  tubes->CappingOn();
  tubes->Update();
  return tubes->GetOutput();
}

vtkSmartPointer<vtkPolyData> Spheres(
  vtkPolyData* tree, const std::vector<vtkIdType>& chosen, double radius)
{
  vtkNew<vtkPoints> points;
  for (const vtkIdType id : chosen)
  {
    points->InsertNextPoint(tree->GetPoint(id));
  }
  vtkNew<vtkPolyData> places;
  places->SetPoints(points);
  vtkNew<vtkSphereSource> sphere;
  sphere->SetRadius(radius);
  sphere->SetThetaResolution(14);
  sphere->SetPhiResolution(10);
  vtkNew<vtkGlyph3D> spheres;
  spheres->SetInputData(places);
  spheres->SetSourceConnection(sphere->GetOutputPort());
  spheres->Update();
  return spheres->GetOutput();
}

/// Root of the mean squared move between two phases, of points that correspond; of the middle, where none do.
double MoveBetween(vtkPolyData* a, vtkPolyData* b)
{
  if (a->GetNumberOfPoints() != b->GetNumberOfPoints() || a->GetNumberOfPoints() == 0)
  {
    Vector3 first;
    Vector3 second;
    a->GetCenter(first.data());
    b->GetCenter(second.data());
    return (first - second).norm();
  }
  double sum = 0.0;
  for (vtkIdType k = 0; k < a->GetNumberOfPoints(); ++k)
  {
    Vector3 first;
    Vector3 second;
    a->GetPoint(k, first.data());
    b->GetPoint(k, second.data());
    sum += (first - second).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(a->GetNumberOfPoints()));
}

/// 0, 1, 2, ...
std::vector<int> Numbers(int count)
{
  std::vector<int> numbers(static_cast<std::size_t>(count));
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

/// The two phases that are furthest apart, and the one that is furthest from both.
std::vector<int> ThreePhases(const Stage& stage)
{
  const int count = stage.Count();
  if (count <= 3)
  {
    return Numbers(count);
  }
  std::vector<std::vector<double>> moves(count, std::vector<double>(count, 0.0));
  int first = 0;
  int second = 1;
  for (int a = 0; a < count; ++a)
  {
    for (int b = a + 1; b < count; ++b)
    {
      moves[a][b] = moves[b][a] = MoveBetween(stage.Model(a), stage.Model(b));
      if (moves[a][b] > moves[first][second])
      {
        first = a;
        second = b;
      }
    }
  }
  int third = -1;
  for (int k = 0; k < count; ++k)
  {
    if (k != first && k != second &&
      (third < 0 ||
        std::min(moves[k][first], moves[k][second]) >
          std::min(moves[third][first], moves[third][second])))
    {
      third = k;
    }
  }
  std::vector<int> three = { first, second, third };
  std::sort(three.begin(), three.end());
  return three;
}

void DrawPanelTitle(PictureCanvas& page, int x, int y, const char* letter, const std::string& text)
{
  const int after = x + page.Write(x, y, letter, 38, Black, Anchor::Left, true);
  page.Write(after + 16, y, text, 32, Black);
}
}

void DrawSequence(const EvaluationScene& scene, const std::string& path)
{
  const Stage stage(scene);
  std::vector<vtkPolyData*> trees;
  for (int k = 0; k < stage.Count(); ++k)
  {
    if (vtkPolyData* tree = stage.Centerline(k))
    {
      trees.push_back(tree);
    }
  }
  const bool correspond = std::all_of(trees.begin(), trees.end(),
    [&](vtkPolyData* tree) { return tree->GetNumberOfPoints() == trees[0]->GetNumberOfPoints(); });
  const bool paths = correspond && trees.size() > 1;
  const int panels = 1 + (trees.empty() ? 0 : 1) + (paths ? 1 : 0);

  constexpr int Gap = 20;
  constexpr int Header = 150;
  const int width = (PageWidth - 2 * Margin - (panels - 1) * Gap) / panels;
  const int height = std::min(width, 1000);
  PictureCanvas page(PageWidth, 2 * Margin + Header + height);
  const PictureView view = stage.View(double(width) / height, 0.02);
  // As wide as it is seen well, whatever the tree's size.
  const double unit = view.height / 1000.0;
  DrawTitle(page, stage, view);
  const int titles = Margin + 100;
  const int top = Margin + Header;
  int left = Margin;
  char letter[] = "(a)";

  if (!trees.empty())
  {
    const auto ranks = RanksOf(trees[0]);
    std::vector<vtkSmartPointer<vtkPolyData>> kept;
    std::vector<PictureItem> items;
    for (vtkPolyData* tree : trees)
    {
      kept.push_back(ColouredLines(tree, ranks));
      PictureItem item{ kept.back(), Grey };
      item.lineWidth = 2.0;
      item.cellColours = true;
      items.push_back(item);
    }
    page.Draw(stage.Painter().Paint(items, view, width, height), left, top);
    DrawPanelTitle(page, left, titles, letter,
      "centerlines of " + std::to_string(trees.size()) + " phases, by branch");
    left += width + Gap;
    ++letter[1];
  }
  if (paths)
  {
    const std::vector<vtkIdType> chosen = SpacedPoints(trees[0], 28.0 * unit);
    const auto tubes = PathTubes(trees, chosen, 2.2 * unit);
    const auto spheres = Spheres(trees[0], chosen, 6.0 * unit);
    PictureItem trail{ tubes, { 40, 110, 200 } };
    trail.opacity = 0.45;
    PictureItem line{ trees[0], { 150, 150, 150 } };
    line.lineWidth = 1.5;
    page.Draw(
      stage.Painter().Paint({ line, { spheres, Red }, trail }, view, width, height), left, top);
    DrawPanelTitle(page, left, titles, letter, "paths from the first phase (red) on");
    left += width + Gap;
    ++letter[1];
  }
  const std::vector<int> three = ThreePhases(stage);
  constexpr std::array<Colour, 3> PhaseColours = { { { 66, 120, 190 }, { 236, 150, 40 },
    { 190, 60, 110 } } };
  std::vector<PictureItem> items;
  for (std::size_t k = 0; k < three.size(); ++k)
  {
    items.push_back({ stage.Model(three[k]), PhaseColours[k] });
  }
  page.Draw(stage.Painter().Paint(items, view, width, height), left, top);
  DrawPanelTitle(page, left, titles, letter,
    "mesh at " + std::to_string(three.size()) + (three.size() == 1 ? " phase" : " phases"));
  int y = top + 20;
  for (std::size_t k = 0; k < three.size(); ++k, y += 36)
  {
    const std::string percent = Percent(stage.Phase(three[k]));
    const int keyLeft = left + width - 190;
    page.Fill(keyLeft - 44, y - 11, 32, 22, PhaseColours[k]);
    page.Write(keyLeft, y, percent.empty() ? PhaseName(stage.Phase(three[k])) : percent, 26, Black);
  }
  DrawScaleBar(page, PageWidth - Margin - 4, top + height - 10, view, height);
  page.WritePng(path);
}

std::vector<std::string> DrawBeating(const EvaluationScene& scene, const std::string& folder)
{
  const Stage stage(scene);
  constexpr int Side = 640;
  constexpr int Band = 44;
  std::vector<int> order = Numbers(stage.Count());
  const bool fractions = std::all_of(
    order.begin(), order.end(), [&](int k) { return std::isfinite(stage.Phase(k).fraction); });
  if (fractions)
  {
    std::stable_sort(order.begin(), order.end(),
      [&](int a, int b) { return stage.Phase(a).fraction < stage.Phase(b).fraction; });
  }
  const PictureView view = stage.View(double(Side) / (Side - 2 * Band), 0.02);
  std::vector<PictureCanvas> frames;
  std::vector<int> delays;
  std::vector<std::string> written;
  for (std::size_t k = 0; k < order.size(); ++k)
  {
    const PhaseEvaluation& phase = stage.Phase(order[k]);
    PictureCanvas frame(Side, Side);
    frame.Draw(PaintOverlay(stage, order[k], view, Side, Side - 2 * Band), 0, Band);
    frame.Write(
      14, Band / 2, PhaseTitle(phase), 22, phase.lost ? Orange : Black, Anchor::Left, true);
    frame.Write(Side - 14, Band / 2, Percent(phase), 22, Black, Anchor::Right);
    frame.Fill(14, Side - Band / 2 - 9, 28, 18, Red);
    const int after = 50 + frame.Write(50, Side - Band / 2, "model", 20, Black) + 24;
    frame.Fill(after, Side - Band / 2 - 9, 28, 18, Green);
    frame.Write(after + 36, Side - Band / 2, "truth", 20, Black);
    frame.Write(Side - 14, Side - Band / 2, Distances(phase), 18, Grey, Anchor::Right);
    char name[48];
    std::snprintf(name, sizeof(name), "/beating_%02zu.png", k);
    written.push_back(folder + name);
    frame.WritePng(written.back());
    // Two seconds a cycle; what follows the last phase is as far away as the first from its next.
    const double step = !fractions || order.size() < 2 ? 1.0 / static_cast<double>(order.size())
      : k + 1 < order.size() ? stage.Phase(order[k + 1]).fraction - phase.fraction
                             : phase.fraction - stage.Phase(order[k - 1]).fraction;
    delays.push_back(std::clamp(static_cast<int>(std::lround(200.0 * step)), 3, 100));
    frames.push_back(std::move(frame));
  }
  if (CanWriteGif())
  {
    written.push_back(folder + "/beating.gif");
    WriteAnimatedGif(frames, delays, written.back());
  }
  return written;
}
}
