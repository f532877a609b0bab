#include "MetaImageWriter.h"

#include "ByteOrder.h"
#include "PackedFile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::size_t WrittenAtOnce = 1u << 20;
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
  const std::size_t sizePosition = header.str().size();
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

  PackedFile output(path, header.str(), compress ? Packing::Zlib : Packing::None);
  const auto* bytes = static_cast<const unsigned char*>(values);
  const std::uint64_t total = size[0] * size[1] * size[2] * valueBytes;
  for (std::uint64_t position = 0; position < total;)
  {
    const auto block =
      static_cast<std::size_t>(std::min<std::uint64_t>(WrittenAtOnce, total - position));
    output.Add(bytes + position, block);
    position += block;
    Report(progress, static_cast<double>(position) / static_cast<double>(total));
  }
  const std::uint64_t written = output.Finish();
  if (compress)
  {
    output.Overwrite(sizePosition + sizeKey.size(), std::to_string(written));
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
