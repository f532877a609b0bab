#include "vtkPictureCanvas.h"

#include "AtomicFile.h"

#include "vtkImageData.h"
#include "vtkNew.h"
#include "vtkPNGWriter.h"
#include "vtkStdString.h"
#include "vtkTextProperty.h"
#include "vtkTextRenderer.h"
#include "vtkUnsignedCharArray.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace coronary
{
PictureCanvas::PictureCanvas(int width, int height, const Colour& background)
  : Columns(width)
  , Rows(height)
  , Pixels(3 * std::size_t(width) * std::size_t(height))
{
  this->Fill(0, 0, width, height, background);
}

void PictureCanvas::Fill(int x, int y, int width, int height, const Colour& colour)
{
  const int left = std::max(0, x);
  const int right = std::min(this->Columns, x + width);
  for (int row = std::max(0, y); row < std::min(this->Rows, y + height); ++row)
  {
    unsigned char* pixels = this->Row(row);
    for (int column = left; column < right; ++column)
    {
      std::copy(colour.begin(), colour.end(), pixels + 3 * column);
    }
  }
}

void PictureCanvas::Draw(const PictureCanvas& other, int x, int y)
{
  const int left = std::max(0, -x);
  const int right = std::min(other.Columns, this->Columns - x);
  for (int row = std::max(0, -y); row < std::min(other.Rows, this->Rows - y) && left < right; ++row)
  {
    std::memcpy(this->Row(y + row) + 3 * (x + left), other.Row(row) + 3 * left,
      3 * std::size_t(right - left));
  }
}

void PictureCanvas::Frame(
  int x, int y, int width, int height, int thickness, const Colour& colour, int dash)
{
  if (dash <= 0)
  {
    this->Fill(x, y, width, thickness, colour);
    this->Fill(x, y + height - thickness, width, thickness, colour);
    this->Fill(x, y, thickness, height, colour);
    this->Fill(x + width - thickness, y, thickness, height, colour);
    return;
  }
  // A side begins and ends with a dash, so that the corners are there.
  const auto side = [&](int length, auto&& piece)
  {
    const int gaps = std::max(1, static_cast<int>(std::lround((length - dash) / (1.7 * dash))));
    for (int k = 0; k <= gaps; ++k)
    {
      piece(static_cast<int>(std::lround(double(k) * (length - dash) / gaps)));
    }
  };
  side(width,
    [&](int at)
    {
      this->Fill(x + at, y, dash, thickness, colour);
      this->Fill(x + at, y + height - thickness, dash, thickness, colour);
    });
  side(height,
    [&](int at)
    {
      this->Fill(x, y + at, thickness, dash, colour);
      this->Fill(x + width - thickness, y + at, thickness, dash, colour);
    });
}

int PictureCanvas::Write(
  int x, int y, const std::string& text, int size, const Colour& colour, Anchor anchor, bool bold)
{
  vtkTextRenderer* renderer = vtkTextRenderer::GetInstance();
  if (!renderer || text.empty())
  {
    return 0;
  }
  vtkNew<vtkTextProperty> property;
  property->SetFontFamilyToArial();
  property->SetFontSize(size);
  property->SetBold(bold);
  property->SetColor(1.0, 1.0, 1.0);
  vtkNew<vtkImageData> image;
  int size2[2] = { 0, 0 };
  if (!renderer->RenderString(
        property, vtkStdString(text), image, size2, 72, vtkTextRenderer::FreeType) ||
    image->GetScalarType() != VTK_UNSIGNED_CHAR || image->GetNumberOfScalarComponents() != 4)
  {
    return 0;
  }
  const int width = std::min(size2[0], image->GetDimensions()[0]);
  const int height = std::min(size2[1], image->GetDimensions()[1]);
  const int stride = image->GetDimensions()[0];
  const auto* texture = static_cast<const unsigned char*>(image->GetScalarPointer());
  const int left =
    anchor == Anchor::Left ? x : (anchor == Anchor::Centre ? x - width / 2 : x - width);
  const int top = y - height / 2;
  for (int row = std::max(0, -top); row < std::min(height, this->Rows - top); ++row)
  {
    const unsigned char* from = texture + 4 * std::size_t(stride) * (height - 1 - row);
    unsigned char* to = this->Row(top + row);
    for (int column = std::max(0, -left); column < std::min(width, this->Columns - left); ++column)
    {
      const int alpha = from[4 * column + 3];
      for (int c = 0; c < 3; ++c)
      {
        unsigned char& pixel = to[3 * (left + column) + c];
        pixel = static_cast<unsigned char>((pixel * (255 - alpha) + colour[c] * alpha + 127) / 255);
      }
    }
  }
  return width;
}

PictureCanvas PictureCanvas::Shrunk(int factor) const
{
  PictureCanvas small(this->Columns / factor, this->Rows / factor);
  for (int y = 0; y < small.Rows; ++y)
  {
    unsigned char* to = small.Row(y);
    for (int x = 0; x < 3 * small.Columns; ++x)
    {
      int sum = factor * factor / 2;
      for (int row = 0; row < factor; ++row)
      {
        const unsigned char* from = this->Row(factor * y + row) + 3 * factor * (x / 3) + x % 3;
        for (int column = 0; column < factor; ++column)
        {
          sum += from[3 * column];
        }
      }
      to[x] = static_cast<unsigned char>(sum / (factor * factor));
    }
  }
  return small;
}

void PictureCanvas::WritePng(const std::string& path) const
{
  WritePngFile(ImageOfRows(this->Columns, this->Rows, 3,
                 [&](int y, unsigned char* to)
                 { std::memcpy(to, this->Row(y), 3 * std::size_t(this->Columns)); }),
    path);
}

vtkSmartPointer<vtkImageData> ImageOfRows(
  int width, int height, int components, const std::function<void(int, unsigned char*)>& row)
{
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(width, height, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, components);
  for (int y = 0; y < height; ++y)
  {
    row(y, static_cast<unsigned char*>(image->GetScalarPointer(0, height - 1 - y, 0)));
  }
  return image;
}

std::string PngBytes(vtkImageData* image)
{
  // By way of memory: the writer itself says that the disk is full, whatever is wrong with a file.
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(image);
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray* bytes = writer->GetResult();
  if (!bytes || bytes->GetNumberOfValues() == 0)
  {
    throw std::runtime_error("A picture could not be encoded.");
  }
  return { reinterpret_cast<const char*>(bytes->GetPointer(0)),
    static_cast<std::size_t>(bytes->GetNumberOfValues()) };
}

void WritePngFile(vtkImageData* image, const std::string& path)
{
  WriteFileAtomically(path, PngBytes(image));
}
}
