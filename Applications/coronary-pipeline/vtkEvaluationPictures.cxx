#include "vtkEvaluationPictures.h"

#include "MeshDistance.h"
#include "vtkAnimatedGif.h"
#include "vtkCoronaryArrayNames.h"
#include "vtkPictureCanvas.h"
#include "vtkScenePainter.h"
#include "vtkSurfaceInput.h"

#include "vtkAppendPolyData.h"
#include "vtkCellArray.h"
#include "vtkCellArrayIterator.h"
#include "vtkCellData.h"
#include "vtkColorTransferFunction.h"
#include "vtkDoubleArray.h"
#include "vtkFloatArray.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkPolyDataNormals.h"
#include "vtkRenderWindow.h"
#include "vtkSphereSource.h"
#include "vtkTubeFilter.h"
#include "vtkUnsignedCharArray.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
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

std::string Distances(const PhaseEvaluation& phase)
{
  return "HD " + Number(phase.measures.hausdorff, 2) + "   MSD " + Number(phase.measures.msd, 2) +
    " mm";
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

constexpr int FrameThickness = 4;
constexpr int Dash = 16;

void DrawFrame(
  PictureCanvas& page, int x, int y, int width, int height, const PhaseEvaluation& phase)
{
  page.Frame(x, y, width, height, FrameThickness, phase.lost ? Orange : Black,
    phase.interpolated ? Dash : 0);
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

bool CanDraw(std::string& why)
{
  vtkNew<vtkRenderWindow> window;
  if (!window->IsA("vtkXOpenGLRenderWindow"))
  {
    return true;
  }
  void* library = dlopen("libX11.so.6", RTLD_NOW | RTLD_LOCAL);
  if (!library)
  {
    why = "libX11.so.6 is missing";
    return false;
  }
  using Open = void* (*)(const char*);
  using Query = int (*)(void*, const char*, int*, int*, int*);
  using Close = int (*)(void*);
  const auto open = reinterpret_cast<Open>(dlsym(library, "XOpenDisplay"));
  const auto query = reinterpret_cast<Query>(dlsym(library, "XQueryExtension"));
  const auto close = reinterpret_cast<Close>(dlsym(library, "XCloseDisplay"));
  bool there = false;
  if (open && query && close)
  {
    void* display = open(nullptr);
    const char* name = std::getenv("DISPLAY");
    if (!display)
    {
      why = name && *name ? std::string("the X server '") + name + "' does not answer"
                          : std::string("there is no display (DISPLAY is not set)");
    }
    else
    {
      int ignored[3];
      there = query(display, "GLX", ignored, ignored + 1, ignored + 2) != 0;
      if (!there)
      {
        why = std::string("the X server '") + (name ? name : "") + "' has no GLX";
      }
      close(display);
    }
  }
  else
  {
    why = "libX11.so.6 is not what it should be";
  }
  // The library stays: VTK uses it too.
  return there;
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
  // Writing above and below what is magnified.
  constexpr int Band = 60;
  const int largeInside = largeHeight - 2 * Band;
  const int gridBottom = Margin + Header + rows * (height + Gap);
  const int pageHeight = gridBottom + Margin + (shown == 0 ? 0 : 100 + largeHeight);

  PictureCanvas page(pageWidth, pageHeight);
  const double aspect = double(width) / height;
  const PictureView view = stage.View(aspect, 0.09);
  page.Write(Margin, Margin + 16, stage.Name(), 40, Black, Anchor::Left, true);
  page.Write(pageWidth - Margin, Margin + 16, "view " + view.Name(), 28, Grey, Anchor::Right);
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

  const int inside = FrameThickness + 2;
  for (int k = 0; k < count; ++k)
  {
    const int left = Margin + (k % columns) * (width + Gap);
    const int top = Margin + Header + (k / columns) * (height + Gap);
    const PhaseEvaluation& phase = stage.Phase(k);
    page.Draw(PaintOverlay(stage, k, view, width - 2 * inside, height - 2 * inside), left + inside,
      top + inside);
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
        view.PixelOf(close.centre, width - 2 * inside, height - 2 * inside);
      const double scale = (height - 2 * inside) / view.height;
      const int boxHeight = static_cast<int>(scale * close.height);
      const int boxWidth = boxHeight * largeWidth / largeInside;
      page.Frame(left + inside + static_cast<int>(centre[0]) - boxWidth / 2,
        top + inside + static_cast<int>(centre[1]) - boxHeight / 2, boxWidth, boxHeight, 2, Grey);
    }
    DrawFrame(page, left, top, width, height, phase);
  }
  DrawScaleBar(page, pageWidth - Margin, y + 12, view, height - 2 * inside);

  if (shown > 0)
  {
    page.Write(Margin, gridBottom + 40,
      (lost >= 0 ? "Magnified: the phase whose tracking was lost and its neighbours"
                 : "Magnified: the phase with the greatest Hausdorff distance and its neighbours"),
      30, Black, Anchor::Left, true);
    const int top = gridBottom + 80;
    for (int k = 0; k < shown; ++k)
    {
      const PhaseEvaluation& phase = stage.Phase(first + k);
      const int left = Margin + k * (largeWidth + Gap);
      page.Draw(PaintOverlay(stage, first + k, close, largeWidth - 2 * inside, largeInside),
        left + inside, top + Band);
      page.Write(left + 22, top + 32,
        PhaseName(phase) +
          (phase.lost ? ", tracking lost" : (phase.interpolated ? ", interpolated" : ", tracked")),
        30, phase.lost ? Orange : Black, Anchor::Left, true);
      page.Write(left + largeWidth - 22, top + 32, Percent(phase), 26, Black, Anchor::Right);
      page.Write(left + 22, top + largeHeight - 32, Distances(phase), 26, Black);
      DrawFrame(page, left, top, largeWidth, largeHeight, phase);
    }
    DrawScaleBar(page, Margin + shown * (largeWidth + Gap) - Gap - 30, top + largeHeight - 18,
      close, largeInside);
  }
  page.WritePng(path);
}
}
