#include "vtkScenePainter.h"

#include "Interruption.h"
#include "Numbers.h"

#include "vtkActor.h"
#include "vtkCamera.h"
#include "vtkImageData.h"
#include "vtkPolyData.h"
#include "vtkPolyDataMapper.h"
#include "vtkProperty.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkScalarsToColors.h"
#include "vtkWindowToImageFilter.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace coronary
{
namespace
{
// Edges are smoothed by rendering larger: that is the same on every driver.
constexpr int Oversampling = 2;

PictureView ViewFrom(double leftAnterior, double cranial)
{
  const double a = leftAnterior * Degree;
  const double c = cranial * Degree;
  PictureView view;
  // LPS: x to the patient's left, y backwards, z to the head.
  view.towardsViewer = { std::sin(a) * std::cos(c), -std::cos(a) * std::cos(c), std::sin(c) };
  view.right = Vector3::UnitZ().cross(view.towardsViewer).normalized();
  view.up = view.towardsViewer.cross(view.right);
  view.leftAnterior = leftAnterior;
  view.cranial = cranial;
  return view;
}

/// Extent along both axes of the picture.
struct Extent
{
  std::array<double, 2> low = { std::numeric_limits<double>::infinity(),
    std::numeric_limits<double>::infinity() };
  std::array<double, 2> high = { -std::numeric_limits<double>::infinity(),
    -std::numeric_limits<double>::infinity() };
};

Extent ExtentOf(const std::vector<Vector3>& points, const PictureView& view)
{
  Extent extent;
  for (const Vector3& point : points)
  {
    const double x = point.dot(view.right);
    const double y = point.dot(view.up);
    extent.low = { std::min(extent.low[0], x), std::min(extent.low[1], y) };
    extent.high = { std::max(extent.high[0], x), std::max(extent.high[1], y) };
  }
  return extent;
}

/// Number of cells of a picture of 200 rows that points lie in.
std::size_t CoveredCells(const std::vector<Vector3>& points, const PictureView& view)
{
  const double cell = view.height / 100.0;
  const int side = 512;
  std::vector<bool> covered(std::size_t(side) * side, false);
  std::size_t count = 0;
  for (const Vector3& point : points)
  {
    const Vector3 from = point - view.centre;
    const int x =
      std::clamp(static_cast<int>(from.dot(view.right) / cell + 0.5 * side), 0, side - 1);
    const int y = std::clamp(static_cast<int>(from.dot(view.up) / cell + 0.5 * side), 0, side - 1);
    const std::size_t index = std::size_t(y) * side + x;
    if (!covered[index])
    {
      covered[index] = true;
      ++count;
    }
  }
  return count;
}
}

std::array<double, 2> PictureView::PixelOf(const Vector3& point, int width, int pictureHeight) const
{
  const double scale = pictureHeight / this->height;
  const Vector3 from = point - this->centre;
  return { 0.5 * width + scale * from.dot(this->right),
    0.5 * pictureHeight - scale * from.dot(this->up) };
}

std::string PictureView::Name() const
{
  const auto part = [](double angle, const char* positive, const char* negative)
  {
    return std::string(angle < 0 ? negative : positive) + " " +
      std::to_string(std::lround(std::abs(angle))) + "\xC2\xB0";
  };
  if (this->leftAnterior == 0.0 && this->cranial == 0.0)
  {
    return "AP";
  }
  std::string name;
  name = this->leftAnterior == 0.0 ? "AP" : part(this->leftAnterior, "LAO", "RAO");
  if (this->cranial != 0.0)
  {
    name += ", " + part(this->cranial, "CRA", "CAU");
  }
  return name;
}

PictureView Reframe(
  PictureView view, const std::vector<Vector3>& framed, double aspect, double margin)
{
  const Extent extent = ExtentOf(framed, view);
  const double width = extent.high[0] - extent.low[0];
  const double height = extent.high[1] - extent.low[1];
  view.height = std::max({ height, width / aspect, 1e-3 }) / (1.0 - 2.0 * margin);
  // The depth does not matter, but the centre should not be far away.
  double depth = 0.0;
  for (const Vector3& point : framed)
  {
    depth += point.dot(view.towardsViewer) / static_cast<double>(framed.size());
  }
  view.centre = 0.5 * (extent.low[0] + extent.high[0]) * view.right +
    0.5 * (extent.low[1] + extent.high[1]) * view.up + depth * view.towardsViewer;
  return view;
}

PictureView FindView(const std::vector<Vector3>& shape, const std::vector<Vector3>& framed,
  double aspect, double margin)
{
  PictureView best;
  std::size_t most = 0;
  for (int leftAnterior = -45; leftAnterior <= 45; leftAnterior += 5)
  {
    for (int cranial = -30; cranial <= 30; cranial += 5)
    {
      const PictureView view = Reframe(ViewFrom(leftAnterior, cranial), framed, aspect, margin);
      const std::size_t covered = CoveredCells(shape, view);
      if (covered > most)
      {
        most = covered;
        best = view;
      }
    }
  }
  return best;
}

ScenePainter::ScenePainter()
{
  this->Window->OffScreenRenderingOn();
  this->Window->SetMultiSamples(0);
  this->Window->AddRenderer(this->Renderer);
  this->Renderer->SetBackground(1.0, 1.0, 1.0);
}

ScenePainter::~ScenePainter() = default;

PictureCanvas ScenePainter::Paint(
  const std::vector<PictureItem>& items, const PictureView& view, int width, int height)
{
  ThrowIfInterrupted();
  this->Renderer->RemoveAllViewProps();
  bool translucent = false;
  for (const PictureItem& item : items)
  {
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(item.data);
    if (item.map)
    {
      mapper->SetLookupTable(item.map);
      mapper->UseLookupTableScalarRangeOn();
      mapper->SetScalarModeToUsePointData();
    }
    else if (item.cellColours)
    {
      mapper->SetScalarModeToUseCellData();
      mapper->SetColorModeToDirectScalars();
    }
    else
    {
      mapper->ScalarVisibilityOff();
    }
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    vtkProperty* property = actor->GetProperty();
    property->SetColor(item.colour[0] / 255.0, item.colour[1] / 255.0, item.colour[2] / 255.0);
    property->SetOpacity(item.opacity);
    property->SetLineWidth(static_cast<float>(Oversampling * item.lineWidth));
    // Colours that are read off must not be hidden by shade.
    property->SetAmbient(item.map ? 0.4 : 0.18);
    property->SetDiffuse(item.map ? 0.65 : 0.82);
    property->SetSpecular(item.map ? 0.04 : 0.12);
    property->SetSpecularPower(25.0);
    if (item.data->GetNumberOfPolys() == 0)
    {
      property->LightingOff();
    }
    translucent = translucent || item.opacity < 1.0;
    this->Renderer->AddActor(actor);
  }
  this->Renderer->SetUseDepthPeeling(translucent);
  this->Renderer->SetMaximumNumberOfPeels(12);
  vtkCamera* camera = this->Renderer->GetActiveCamera();
  camera->ParallelProjectionOn();
  camera->SetParallelScale(0.5 * view.height);
  camera->SetFocalPoint(view.centre.data());
  const Vector3 place = view.centre + 20.0 * view.height * view.towardsViewer;
  camera->SetPosition(place.data());
  camera->SetViewUp(view.up.data());
  this->Renderer->ResetCameraClippingRange();

  this->Window->SetSize(Oversampling * width, Oversampling * height);
  vtkNew<vtkWindowToImageFilter> grabber;
  grabber->SetInput(this->Window);
  grabber->SetInputBufferTypeToRGB();
  grabber->ReadFrontBufferOff();
  grabber->Update();
  vtkImageData* image = grabber->GetOutput();
  PictureCanvas canvas(image->GetDimensions()[0], image->GetDimensions()[1]);
  for (int y = 0; y < canvas.Height(); ++y)
  {
    std::memcpy(canvas.Row(y), image->GetScalarPointer(0, canvas.Height() - 1 - y, 0),
      3 * std::size_t(canvas.Width()));
  }
  return canvas.Shrunk(Oversampling);
}
}
