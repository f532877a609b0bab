#include "vtkAnimatedGif.h"

#include "AtomicFile.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>

#ifdef DYNAMICCORONARY_WITH_GIF
#include "vtkImageData.h"
#include "vtkImageQuantizeRGBToIndex.h"
#include "vtkLookupTable.h"
#include "vtkNew.h"
#include "vtkSmartPointer.h"

#include <gif_lib.h>
#endif

namespace coronary
{
#ifdef DYNAMICCORONARY_WITH_GIF
namespace
{
constexpr int PaletteSize = 256;

/// All frames under each other, so that one palette is right for all of them.
vtkSmartPointer<vtkImageData> Stacked(const std::vector<PictureCanvas>& frames)
{
  const int height = frames[0].Height();
  auto stack = vtkSmartPointer<vtkImageData>::New();
  stack->SetDimensions(frames[0].Width(), height * static_cast<int>(frames.size()), 1);
  stack->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (std::size_t k = 0; k < frames.size(); ++k)
  {
    std::memcpy(stack->GetScalarPointer(0, height * static_cast<int>(k), 0), frames[k].Row(0),
      3 * std::size_t(frames[k].Width()) * std::size_t(height));
  }
  return stack;
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
  vtkNew<vtkImageQuantizeRGBToIndex> quantizer;
  quantizer->SetInputData(Stacked(frames));
  quantizer->SetNumberOfColors(PaletteSize);
  quantizer->Update();
  std::vector<GifColorType> palette(PaletteSize, GifColorType{ 0, 0, 0 });
  vtkLookupTable* colours = quantizer->GetLookupTable();
  for (vtkIdType k = 0; k < std::min<vtkIdType>(PaletteSize, colours->GetNumberOfTableValues());
       ++k)
  {
    double rgba[4];
    colours->GetTableValue(k, rgba);
    const auto byte = [](double part)
    { return static_cast<GifByteType>(std::lround(255.0 * part)); };
    palette[static_cast<std::size_t>(k)] = { byte(rgba[0]), byte(rgba[1]), byte(rgba[2]) };
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
    const auto* index = static_cast<const unsigned short*>(
      quantizer->GetOutput()->GetScalarPointer(0, height * static_cast<int>(k), 0));
    for (int y = 0; y < height; ++y, index += width)
    {
      std::copy(index, index + width, line.begin());
      file.Require(EGifPutLine(file.Get(), line.data(), width));
    }
  }
  WriteFileAtomically(path, file.Finish());
#else
  throw std::runtime_error("Cannot write '" + path + "': built without giflib.");
#endif
}
}
