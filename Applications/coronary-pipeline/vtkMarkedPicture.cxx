#include "vtkMarkedPicture.h"

#include "vtkImageData.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace coronary
{
MarkedPicture::MarkedPicture(int width, int height, const Colour& background)
  : plain(width, height, background)
  , Layer(4 * std::size_t(width) * std::size_t(height))
{
}

void MarkedPicture::Blend(int x, int y, const Colour& colour, double opacity)
{
  if (x < 0 || y < 0 || x >= this->plain.Width() || y >= this->plain.Height() || opacity <= 0.0)
  {
    return;
  }
  unsigned char* pixel =
    this->Layer.data() + 4 * (std::size_t(y) * std::size_t(this->plain.Width()) + std::size_t(x));
  const double before = pixel[3] / 255.0 * (1.0 - opacity);
  const double alpha = opacity + before;
  for (std::size_t c = 0; c < 3; ++c)
  {
    pixel[c] =
      static_cast<unsigned char>(std::lround((opacity * colour[c] + before * pixel[c]) / alpha));
  }
  pixel[3] = static_cast<unsigned char>(std::lround(255.0 * alpha));
}

void MarkedPicture::Stroke(
  const Place& a, const Place& b, double width, const Colour& colour, double opacity)
{
  const double reach = 0.5 * width + 0.5;
  const auto bound = [](double value, int limit)
  { return static_cast<int>(std::clamp(value, -1.0, double(limit))); };
  const int left = bound(std::floor(std::min(a[0], b[0]) - reach), this->plain.Width());
  const int right = bound(std::ceil(std::max(a[0], b[0]) + reach), this->plain.Width());
  const int top = bound(std::floor(std::min(a[1], b[1]) - reach), this->plain.Height());
  const int bottom = bound(std::ceil(std::max(a[1], b[1]) + reach), this->plain.Height());
  const double wx = b[0] - a[0];
  const double wy = b[1] - a[1];
  const double square = wx * wx + wy * wy;
  for (int y = top; y <= bottom; ++y)
  {
    for (int x = left; x <= right; ++x)
    {
      const double part =
        square > 0.0 ? std::clamp(((x - a[0]) * wx + (y - a[1]) * wy) / square, 0.0, 1.0) : 0.0;
      const double away = std::hypot(x - a[0] - part * wx, y - a[1] - part * wy);
      this->Blend(x, y, colour, opacity * std::clamp(reach - away, 0.0, 1.0));
    }
  }
}

void MarkedPicture::Line(
  const std::vector<Place>& points, double width, const Colour& colour, double dash, double opacity)
{
  double arc = 0.0;
  for (std::size_t k = 1; k < points.size(); ++k)
  {
    const Place& a = points[k - 1];
    const Place& b = points[k];
    const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
    if (!(length < 1e4))
    {
      continue; // not a place in any picture
    }
    if (dash <= 0.0)
    {
      this->Stroke(a, b, width, colour, opacity);
      continue;
    }
    // Dashes as long as the gaps between them.
    for (double from = 0.0; from < length;)
    {
      const double phase = std::fmod(arc + from, 2.0 * dash);
      const double left = phase < dash ? dash - phase : 2.0 * dash - phase;
      const double to = std::min(length, from + std::max(left, 1e-3));
      if (phase < dash)
      {
        const auto at = [&](double place) -> Place
        {
          const double part = place / length;
          return { a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]) };
        };
        this->Stroke(at(from), at(to), width, colour, opacity);
      }
      from = to;
    }
    arc += length;
  }
}

void MarkedPicture::Fill(int x, int y, int width, int height, const Colour& colour, double opacity)
{
  for (int row = std::max(0, y); row < std::min(this->plain.Height(), y + height); ++row)
  {
    for (int column = std::max(0, x); column < std::min(this->plain.Width(), x + width); ++column)
    {
      this->Blend(column, row, colour, opacity);
    }
  }
}

void MarkedPicture::Write(int x, int y, const std::string& text, int size, const Colour& colour,
  PictureCanvas::Anchor anchor)
{
  // White on black: how bright a pixel is, is how much of the letter covers it.
  PictureCanvas letters(static_cast<int>(text.size()) * size + 8, 2 * size, { 0, 0, 0 });
  const int width = letters.Write(2, size, text, size, { 255, 255, 255 });
  const int left = anchor == PictureCanvas::Anchor::Left
    ? x - 2
    : (anchor == PictureCanvas::Anchor::Centre ? x - 2 - width / 2 : x - 2 - width);
  const auto cover = [&](int column, int row)
  {
    return column < 0 || row < 0 || column >= letters.Width() || row >= letters.Height()
      ? 0.0
      : letters.Row(row)[3 * column] / 255.0;
  };
  for (const bool rim : { true, false })
  {
    for (int row = 0; row < letters.Height(); ++row)
    {
      for (int column = 0; column < letters.Width(); ++column)
      {
        double most = 0.0;
        for (int k = 0; rim && k < 9; ++k)
        {
          most = std::max(most, cover(column + k % 3 - 1, row + k / 3 - 1));
        }
        const double opacity = rim ? 0.7 * most : cover(column, row);
        this->Blend(left + column, y - size + row, rim ? Colour{ 0, 0, 0 } : colour, opacity);
      }
    }
  }
}

std::string MarkedPicture::PlainPng() const
{
  const int width = this->plain.Width();
  bool grey = true;
  for (int y = 0; grey && y < this->plain.Height(); ++y)
  {
    const unsigned char* row = this->plain.Row(y);
    for (int x = 0; grey && x < width; ++x)
    {
      grey = row[3 * x] == row[3 * x + 1] && row[3 * x] == row[3 * x + 2];
    }
  }
  return PngBytes(ImageOfRows(width, this->plain.Height(), grey ? 1 : 3,
    [&](int y, unsigned char* to)
    {
      const unsigned char* from = this->plain.Row(y);
      for (int x = 0; grey && x < width; ++x)
      {
        to[x] = from[3 * x];
      }
      if (!grey)
      {
        std::memcpy(to, from, 3 * std::size_t(width));
      }
    }));
}

std::string MarkedPicture::LayerPng() const
{
  const std::size_t bytes = 4 * std::size_t(this->plain.Width());
  return PngBytes(ImageOfRows(this->plain.Width(), this->plain.Height(), 4,
    [&](int y, unsigned char* to)
    { std::memcpy(to, this->Layer.data() + std::size_t(y) * bytes, bytes); }));
}

std::string MarkedPicture::WholePng() const
{
  const int width = this->plain.Width();
  return PngBytes(ImageOfRows(width, this->plain.Height(), 3,
    [&](int y, unsigned char* to)
    {
      const unsigned char* below = this->plain.Row(y);
      const unsigned char* above = this->Layer.data() + 4 * std::size_t(y) * std::size_t(width);
      for (int x = 0; x < width; ++x)
      {
        const int alpha = above[4 * x + 3];
        for (int c = 0; c < 3; ++c)
        {
          to[3 * x + c] = static_cast<unsigned char>(
            (above[4 * x + c] * alpha + below[3 * x + c] * (255 - alpha) + 127) / 255);
        }
      }
    }));
}
}
