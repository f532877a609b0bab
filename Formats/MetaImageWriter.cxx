#include "MetaImageWriter.h"

#include "AtomicFile.h"
#include "ByteStream.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <locale>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace coronary
{
namespace
{
constexpr std::size_t BlockBytes = 1u << 20;
// Room for any 64-bit number: the size of the compressed data is known only after it is written.
constexpr int SizeDigits = 20;

// Letters name the side an axis comes from, as ITK writes them: the axes of LPS are "RAI".
std::string AnatomicalOrientation(const Matrix3& direction)
{
  static const char* const letters[3] = { "RL", "AP", "IS" };
  // The largest cosines first, so that no world axis is named twice.
  std::string result = "???";
  std::array<bool, 3> used{};
  for (int step = 0; step < 3; ++step)
  {
    int axis = -1;
    int world = -1;
    for (int a = 0; a < 3; ++a)
    {
      for (int w = 0; w < 3; ++w)
      {
        if (result[a] == '?' && !used[w] &&
          (axis < 0 || std::abs(direction(w, a)) > std::abs(direction(world, axis))))
        {
          axis = a;
          world = w;
        }
      }
    }
    result[axis] = letters[world][direction(world, axis) < 0.0 ? 1 : 0];
    used[world] = true;
  }
  return result;
}

class Output
{
public:
  explicit Output(const std::string& path)
    : Target(path)
    , File(std::fopen(this->Target.TemporaryPath().c_str(), "wb"), &std::fclose)
  {
    if (!this->File)
    {
      this->Fail();
    }
  }

  void Write(const void* data, std::size_t bytes)
  {
    if (std::fwrite(data, 1, bytes, this->File.get()) != bytes)
    {
      this->Fail();
    }
  }

  void Write(const std::string& text) { this->Write(text.data(), text.size()); }

  void WriteAt(long position, const std::string& text)
  {
    if (std::fseek(this->File.get(), position, SEEK_SET) != 0)
    {
      this->Fail();
    }
    this->Write(text);
  }

  void Commit()
  {
    // A full disk may show only when the buffer is flushed.
    if (std::fclose(this->File.release()) != 0)
    {
      this->Fail();
    }
    this->Target.Commit();
  }

private:
  [[noreturn]] void Fail()
  {
    throw std::runtime_error(
      "Cannot write '" + this->Target.Path() + "': " + std::strerror(errno) + ".");
  }

  AtomicFile Target;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> File;
};

// Returns the number of bytes written.
std::uint64_t WriteCompressed(
  Output& output, const unsigned char* data, std::uint64_t bytes, const ProgressCallback& progress)
{
  z_stream stream{};
  // Noisy voxels gain little from higher levels, which are several times slower.
  if (deflateInit(&stream, 2) != Z_OK)
  {
    throw std::runtime_error("zlib can not be initialised.");
  }
  const std::unique_ptr<z_stream, int (*)(z_streamp)> guard(&stream, &deflateEnd);
  std::vector<unsigned char> packed(BlockBytes);
  std::uint64_t written = 0;
  for (std::uint64_t position = 0; position < bytes;)
  {
    const auto block =
      static_cast<std::size_t>(std::min<std::uint64_t>(BlockBytes, bytes - position));
    // zlib's interface is not const-correct; it does not write to its input.
    stream.next_in = const_cast<unsigned char*>(data + position);
    stream.avail_in = static_cast<uInt>(block);
    position += block;
    do
    {
      stream.next_out = packed.data();
      stream.avail_out = static_cast<uInt>(packed.size());
      deflate(&stream, position == bytes ? Z_FINISH : Z_NO_FLUSH);
      const std::size_t produced = packed.size() - stream.avail_out;
      output.Write(packed.data(), produced);
      written += produced;
    } while (stream.avail_out == 0);
    Report(progress, static_cast<double>(position) / static_cast<double>(bytes));
  }
  return written;
}

void WriteRaw(
  Output& output, const unsigned char* data, std::uint64_t bytes, const ProgressCallback& progress)
{
  for (std::uint64_t position = 0; position < bytes;)
  {
    const auto block =
      static_cast<std::size_t>(std::min<std::uint64_t>(BlockBytes, bytes - position));
    output.Write(data + position, block);
    position += block;
    Report(progress, static_cast<double>(position) / static_cast<double>(bytes));
  }
}

void Write(const std::string& path, const ImageGrid& grid, const void* values,
  std::size_t valueBytes, const char* elementType, bool compress, const ProgressCallback& progress)
{
  std::array<std::uint64_t, 3> size{};
  for (int axis = 0; axis < 3; ++axis)
  {
    const std::int64_t count =
      std::int64_t(grid.extent[2 * axis + 1]) - std::int64_t(grid.extent[2 * axis]) + 1;
    if (count < 1)
    {
      throw std::runtime_error("Cannot write '" + path + "': the image has no voxels.");
    }
    size[axis] = static_cast<std::uint64_t>(count);
  }
  if (!grid.origin.allFinite() || !grid.spacing.allFinite() || !grid.direction.allFinite() ||
    !(grid.spacing.minCoeff() > 0.0))
  {
    throw std::runtime_error("Cannot write '" + path +
      "': origin, spacing and direction must be finite, spacing positive.");
  }
  if (std::filesystem::path(path).extension() != ".mha")
  {
    throw std::runtime_error("Cannot write '" + path + "': the extension of a MetaImage is .mha.");
  }

  std::ostringstream header;
  header.imbue(std::locale::classic());
  header << std::setprecision(std::numeric_limits<double>::max_digits10);
  const Vector3 offset = grid.IndexToWorld(grid.extent[0], grid.extent[2], grid.extent[4]);
  header << "ObjectType = Image\nNDims = 3\nBinaryData = True\n"
         << "BinaryDataByteOrderMSB = " << (HostIsBigEndian() ? "True" : "False") << "\n"
         << "CompressedData = " << (compress ? "True" : "False") << "\n";
  const long sizePosition = static_cast<long>(header.str().size());
  const std::string sizeKey = "CompressedDataSize = ";
  if (compress)
  {
    header << sizeKey << std::string(SizeDigits, ' ') << "\n";
  }
  header << "TransformMatrix =";
  for (int axis = 0; axis < 3; ++axis)
  {
    for (int world = 0; world < 3; ++world)
    {
      header << ' ' << grid.direction(world, axis);
    }
  }
  header << "\nOffset = " << offset[0] << ' ' << offset[1] << ' ' << offset[2]
         << "\nCenterOfRotation = 0 0 0\nAnatomicalOrientation = "
         << AnatomicalOrientation(grid.direction) << "\nElementSpacing = " << grid.spacing[0] << ' '
         << grid.spacing[1] << ' ' << grid.spacing[2] << "\nDimSize = " << size[0] << ' ' << size[1]
         << ' ' << size[2] << "\nElementType = " << elementType << "\nElementDataFile = LOCAL\n";

  Output output(path);
  output.Write(header.str());
  const auto* bytes = static_cast<const unsigned char*>(values);
  const std::uint64_t total = size[0] * size[1] * size[2] * valueBytes;
  if (compress)
  {
    const std::uint64_t written = WriteCompressed(output, bytes, total, progress);
    output.WriteAt(sizePosition + static_cast<long>(sizeKey.size()), std::to_string(written));
  }
  else
  {
    WriteRaw(output, bytes, total, progress);
  }
  output.Commit();
}
}

void WriteMetaImage(const std::string& path, const ImageGrid& grid, const short* values,
  bool compress, const ProgressCallback& progress)
{
  Write(path, grid, values, sizeof(short), "MET_SHORT", compress, progress);
}

void WriteMetaImage(const std::string& path, const ImageGrid& grid, const float* values,
  bool compress, const ProgressCallback& progress)
{
  Write(path, grid, values, sizeof(float), "MET_FLOAT", compress, progress);
}

void WriteMetaImage(const std::string& path, const ImageGrid& grid, const unsigned char* values,
  bool compress, const ProgressCallback& progress)
{
  Write(path, grid, values, sizeof(unsigned char), "MET_UCHAR", compress, progress);
}
}
