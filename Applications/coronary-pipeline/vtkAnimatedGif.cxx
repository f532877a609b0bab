#include "vtkAnimatedGif.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <new>
#include <stdexcept>

#ifdef DYNAMICCORONARY_WITH_GIF
#include <gif_lib.h>
#endif

namespace coronary
{
#ifdef DYNAMICCORONARY_WITH_GIF
namespace
{
constexpr int PaletteSize = 256;
// Five bits a channel tell colours apart.
constexpr int Shift = 3;
constexpr std::size_t CellCount = std::size_t(1) << 15;

std::size_t CellOf(const unsigned char* pixel)
{
  return (std::size_t(pixel[0] >> Shift) << 10) | (std::size_t(pixel[1] >> Shift) << 5) |
    std::size_t(pixel[2] >> Shift);
}

/// Pixels of one cell of the colour space.
struct ColourCell
{
  std::size_t cell = 0;
  std::uint64_t count = 0;
  std::array<std::uint64_t, 3> sum = { 0, 0, 0 };
};

/// A part of the cells, for the median cut.
struct ColourBox
{
  std::size_t begin = 0;
  std::size_t end = 0;
  int axis = 0;
  double spread = 0.0; ///< sum of squared differences from the mean along the axis
};

double Component(const ColourCell& cell, int axis)
{
  return double(cell.sum[axis]) / double(cell.count);
}

void Measure(const std::vector<ColourCell>& cells, ColourBox& box)
{
  box.spread = 0.0;
  for (int axis = 0; axis < 3; ++axis)
  {
    double count = 0.0;
    double sum = 0.0;
    double squares = 0.0;
    for (std::size_t k = box.begin; k < box.end; ++k)
    {
      // The root: a background of half of the pixels must not get half of the palette.
      const double weight = std::sqrt(double(cells[k].count));
      const double value = Component(cells[k], axis);
      count += weight;
      sum += weight * value;
      squares += weight * value * value;
    }
    const double spread = squares - sum * sum / count;
    if (box.end - box.begin > 1 && spread > box.spread)
    {
      box.spread = spread;
      box.axis = axis;
    }
  }
}

/// Palette, and the palette's index of every cell.
struct Quantized
{
  std::vector<Colour> palette;
  std::vector<unsigned char> indices = std::vector<unsigned char>(CellCount, 0);
};

Quantized Quantize(const std::vector<PictureCanvas>& frames)
{
  std::vector<ColourCell> all(CellCount);
  for (const PictureCanvas& frame : frames)
  {
    for (int y = 0; y < frame.Height(); ++y)
    {
      const unsigned char* pixel = frame.Row(y);
      for (int x = 0; x < frame.Width(); ++x, pixel += 3)
      {
        ColourCell& cell = all[CellOf(pixel)];
        ++cell.count;
        for (int axis = 0; axis < 3; ++axis)
        {
          cell.sum[axis] += pixel[axis];
        }
      }
    }
  }
  std::vector<ColourCell> cells;
  for (std::size_t k = 0; k < CellCount; ++k)
  {
    if (all[k].count > 0)
    {
      all[k].cell = k;
      cells.push_back(all[k]);
    }
  }
  std::vector<ColourBox> boxes = { { 0, cells.size() } };
  Measure(cells, boxes[0]);
  while (boxes.size() < PaletteSize)
  {
    const auto widest = std::max_element(boxes.begin(), boxes.end(),
      [](const ColourBox& a, const ColourBox& b) { return a.spread < b.spread; });
    if (widest->spread <= 0.0)
    {
      break;
    }
    const ColourBox box = *widest;
    const auto begin = cells.begin() + static_cast<std::ptrdiff_t>(box.begin);
    const auto end = cells.begin() + static_cast<std::ptrdiff_t>(box.end);
    std::sort(begin, end,
      [&](const ColourCell& a, const ColourCell& b)
      {
        const double left = Component(a, box.axis);
        const double right = Component(b, box.axis);
        return left < right || (left == right && a.cell < b.cell);
      });
    double total = 0.0;
    for (auto k = begin; k != end; ++k)
    {
      total += std::sqrt(double(k->count));
    }
    std::size_t middle = box.begin;
    for (double sum = 0.0; middle + 1 < box.end && sum < 0.5 * total; ++middle)
    {
      sum += std::sqrt(double(cells[middle].count));
    }
    middle = std::clamp(middle, box.begin + 1, box.end - 1);
    ColourBox left{ box.begin, middle };
    ColourBox right{ middle, box.end };
    Measure(cells, left);
    Measure(cells, right);
    *widest = left;
    boxes.push_back(right);
  }
  Quantized result;
  for (const ColourBox& box : boxes)
  {
    std::array<std::uint64_t, 3> sum = { 0, 0, 0 };
    std::uint64_t count = 0;
    for (std::size_t k = box.begin; k < box.end; ++k)
    {
      count += cells[k].count;
      for (int axis = 0; axis < 3; ++axis)
      {
        sum[axis] += cells[k].sum[axis];
      }
      result.indices[cells[k].cell] = static_cast<unsigned char>(result.palette.size());
    }
    Colour colour{};
    for (int axis = 0; axis < 3; ++axis)
    {
      colour[axis] =
        static_cast<unsigned char>((sum[axis] + count / 2) / std::max<std::uint64_t>(1, count));
    }
    result.palette.push_back(colour);
  }
  return result;
}

int Append(GifFileType* file, const GifByteType* bytes, int count)
{
  static_cast<std::string*>(file->UserData)->append(reinterpret_cast<const char*>(bytes), count);
  return count;
}

/// A GIF in memory: giflib makes files that only their owner may read.
class GifStream
{
public:
  GifStream()
    : File(EGifOpen(&this->Bytes, Append, nullptr))
  {
    if (!this->File)
    {
      throw std::bad_alloc();
    }
    EGifSetGifVersion(this->File, true);
  }
  ~GifStream()
  {
    if (this->File)
    {
      EGifCloseFile(this->File, nullptr);
    }
  }
  GifStream(const GifStream&) = delete;
  GifStream& operator=(const GifStream&) = delete;

  GifFileType* Get() const { return this->File; }
  static void Require(int result)
  {
    if (result != GIF_OK)
    {
      throw std::runtime_error("An animation could not be encoded.");
    }
  }
  const std::string& Finish()
  {
    GifFileType* file = this->File;
    this->File = nullptr;
    Require(EGifCloseFile(file, nullptr));
    return this->Bytes;
  }

private:
  std::string Bytes;
  GifFileType* File;
};
}
#endif

bool CanWriteGif()
{
#ifdef DYNAMICCORONARY_WITH_GIF
  return true;
#else
  return false;
#endif
}

void WriteAnimatedGif(
  const std::vector<PictureCanvas>& frames, const std::vector<int>& delays, const std::string& path)
{
  if (frames.empty() || delays.size() != frames.size())
  {
    throw std::invalid_argument("An animation needs frames and as many delays.");
  }
  const int width = frames[0].Width();
  const int height = frames[0].Height();
  for (const PictureCanvas& frame : frames)
  {
    if (frame.Width() != width || frame.Height() != height)
    {
      throw std::invalid_argument("The frames of an animation must be of one size.");
    }
  }
#ifdef DYNAMICCORONARY_WITH_GIF
  const Quantized colours = Quantize(frames);
  std::vector<GifColorType> palette(PaletteSize, GifColorType{ 0, 0, 0 });
  for (std::size_t k = 0; k < colours.palette.size(); ++k)
  {
    palette[k] = { colours.palette[k][0], colours.palette[k][1], colours.palette[k][2] };
  }
  ColorMapObject* map = GifMakeMapObject(PaletteSize, palette.data());
  if (!map)
  {
    throw std::bad_alloc();
  }
  GifStream file;
  const int described = EGifPutScreenDesc(file.Get(), width, height, 8, 0, map);
  GifFreeMapObject(map);
  file.Require(described);
  // Netscape's extension: again and again, without end.
  const unsigned char loop[3] = { 1, 0, 0 };
  file.Require(EGifPutExtensionLeader(file.Get(), APPLICATION_EXT_FUNC_CODE));
  file.Require(EGifPutExtensionBlock(file.Get(), 11, "NETSCAPE2.0"));
  file.Require(EGifPutExtensionBlock(file.Get(), 3, loop));
  file.Require(EGifPutExtensionTrailer(file.Get()));
  std::vector<GifPixelType> line(width);
  for (std::size_t k = 0; k < frames.size(); ++k)
  {
    const GraphicsControlBlock control = { DISPOSE_DO_NOT, false, delays[k], NO_TRANSPARENT_COLOR };
    GifByteType bytes[4];
    const std::size_t size = EGifGCBToExtension(&control, bytes);
    file.Require(
      EGifPutExtension(file.Get(), GRAPHICS_EXT_FUNC_CODE, static_cast<int>(size), bytes));
    file.Require(EGifPutImageDesc(file.Get(), 0, 0, width, height, false, nullptr));
    for (int y = 0; y < height; ++y)
    {
      const unsigned char* pixel = frames[k].Row(y);
      for (int x = 0; x < width; ++x, pixel += 3)
      {
        line[x] = colours.indices[CellOf(pixel)];
      }
      file.Require(EGifPutLine(file.Get(), line.data(), width));
    }
  }
  std::ofstream stream(path, std::ios::binary);
  stream << file.Finish();
  stream.close();
  if (!stream)
  {
    throw std::runtime_error("Can not write '" + path + "'.");
  }
#else
  throw std::runtime_error("Can not write '" + path + "': built without giflib.");
#endif
}
}
