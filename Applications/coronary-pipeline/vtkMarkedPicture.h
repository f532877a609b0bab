/**
 * @file vtkMarkedPicture.h
 * @brief A grey picture of an image with a layer of marks that can be taken off.
 */
#ifndef vtkMarkedPicture_h
#define vtkMarkedPicture_h

#include "vtkPictureCanvas.h"

#include <array>
#include <string>
#include <vector>

namespace coronary
{
/// Pixels and what lies over them; both are as large. What lies outside is not drawn.
class MarkedPicture
{
public:
  using Place =
    std::array<double, 2>; ///< pixels to the right and down; whole numbers: a pixel's centre

  MarkedPicture(int width, int height, const Colour& background = { 0, 0, 0 });

  PictureCanvas plain;

  /// A line of round ends in the layer. @param width, dash  pixels; dash 0: solid
  void Line(const std::vector<Place>& points, double width, const Colour& colour, double dash = 0.0,
    double opacity = 1.0);
  /// A filled rectangle in the layer.
  void Fill(int x, int y, int width, int height, const Colour& colour, double opacity);
  /// As PictureCanvas::Write, in the layer, with a dark rim.
  void Write(int x, int y, const std::string& text, int size, const Colour& colour,
    PictureCanvas::Anchor anchor = PictureCanvas::Anchor::Left);

  ///@{
  /// PNG files in memory: the picture, the layer (with transparency), both together.
  std::string PlainPng() const;
  std::string LayerPng() const;
  std::string WholePng() const;
  ///@}

private:
  void Blend(int x, int y, const Colour& colour, double opacity);
  void Stroke(const Place& a, const Place& b, double width, const Colour& colour, double opacity);

  std::vector<unsigned char> Layer; ///< red, green, blue, alpha
};
}

#endif
