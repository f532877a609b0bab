/**
 * @file vtkScenePainter.h
 * @brief Renders surfaces and lines into pictures in memory, and finds the place to look from.
 */
#ifndef vtkScenePainter_h
#define vtkScenePainter_h

#include "Geometry.h"
#include "vtkPictureCanvas.h"

#include "vtkNew.h"
#include "vtkSmartPointer.h"

#include <string>
#include <vector>

class vtkPolyData;
class vtkRenderer;
class vtkRenderWindow;
class vtkScalarsToColors;

namespace coronary
{
/// A parallel projection. Vectors are unit and at right angles.
struct PictureView
{
  Vector3 centre = Vector3::Zero();
  Vector3 right = Vector3::UnitX();
  Vector3 up = Vector3::UnitZ();
  Vector3 towardsViewer = -Vector3::UnitY();
  double height = 1.0; ///< of the picture, mm
  double leftAnterior =
    0.0; ///< angle of the view as cardiologists name it, degrees; negative: right anterior
  double cranial = 0.0; ///< degrees; negative: caudal

  /// Where a point is in a picture of this size, pixels from its upper left corner.
  std::array<double, 2> PixelOf(const Vector3& point, int width, int pictureHeight) const;

  /// "LAO 30, CRA 10"
  std::string Name() const;
};

/**
 * The view, of those that a heart is usually seen from (45 degrees to both sides, 30 up and down), in
 * which the points cover most of the picture.
 * @param shape   points that the direction is chosen for
 * @param framed  points that must be in the picture
 * @param aspect  width over height of the picture
 * @param margin  share of the picture's width and height that stays free on each side
 */
PictureView FindView(const std::vector<Vector3>& shape, const std::vector<Vector3>& framed,
  double aspect, double margin);

/// The same direction, another picture.
PictureView Reframe(
  PictureView view, const std::vector<Vector3>& framed, double aspect, double margin);

/// What is rendered. Colours come from the active scalars of the points when there is a map, of the cells when there
/// are colours of cells.
struct PictureItem
{
  vtkPolyData* data = nullptr;
  Colour colour = { 200, 200, 200 };
  double opacity = 1.0;
  double lineWidth = 1.0; ///< pixels
  vtkScalarsToColors* map = nullptr;
  bool cellColours = false; ///< cell scalars are red, green, blue
};

class ScenePainter
{
public:
  ScenePainter();
  ~ScenePainter();

  /// On white.
  PictureCanvas Paint(
    const std::vector<PictureItem>& items, const PictureView& view, int width, int height);

private:
  vtkNew<vtkRenderWindow> Window;
  vtkNew<vtkRenderer> Renderer;
};
}

#endif
