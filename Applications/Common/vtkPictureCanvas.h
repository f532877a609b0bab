/**
 * @file vtkPictureCanvas.h
 * @brief A picture in memory: what was rendered, with frames, colours and writing around it.
 */
#ifndef vtkPictureCanvas_h
#define vtkPictureCanvas_h

#include "vtkSmartPointer.h"

#include <array>
#include <functional>
#include <string>
#include <vector>

class vtkImageData;

namespace coronary
{
using Colour = std::array<unsigned char, 3>;

/// Pixels in red, green and blue, row by row from the top. What lies outside is not drawn.
class PictureCanvas
{
public:
  enum class Anchor
  {
    Left,
    Centre,
    Right
  };

  PictureCanvas() = default;
  PictureCanvas(int width, int height, const Colour& background = { 255, 255, 255 });

  int Width() const { return this->Columns; }
  int Height() const { return this->Rows; }
  unsigned char* Row(int y) { return this->Pixels.data() + 3 * this->Columns * std::size_t(y); }
  const unsigned char* Row(int y) const
  {
    return this->Pixels.data() + 3 * this->Columns * std::size_t(y);
  }

  void Fill(int x, int y, int width, int height, const Colour& colour);
  void Draw(const PictureCanvas& other, int x, int y);

  /// Inside of the rectangle; dash 0: solid.
  void Frame(
    int x, int y, int width, int height, int thickness, const Colour& colour, int dash = 0);

  /// One line; x: its left end, centre or right end, y: its middle. Pixels high from top to bottom of a letter with both.
  /// @return its width
  int Write(int x, int y, const std::string& text, int size, const Colour& colour,
    Anchor anchor = Anchor::Left, bool bold = false);

  /// Means of blocks of pixels.
  PictureCanvas Shrunk(int factor) const;

  /// @throws std::runtime_error naming the file
  void WritePng(const std::string& path) const;

private:
  int Columns = 0;
  int Rows = 0;
  std::vector<unsigned char> Pixels;
};

/// @param row  fills one, by its number from the top
vtkSmartPointer<vtkImageData> ImageOfRows(
  int width, int height, int components, const std::function<void(int y, unsigned char* to)>& row);

/// The bytes of a PNG file.
std::string PngBytes(vtkImageData* image);

/// @throws std::runtime_error naming the file
void WritePngFile(vtkImageData* image, const std::string& path);
}

#endif
