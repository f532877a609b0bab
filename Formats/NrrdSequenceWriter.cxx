#include "NrrdSequenceWriter.h"

#include "ByteOrder.h"
#include "NrrdText.h"
#include "PackedFile.h"
#include "TextWords.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace coronary
{
namespace
{
void Check(const std::string& path, const ImageGrid& grid, const SequenceIndex& index)
{
  const auto refuse = [&](const char* what)
  { throw std::invalid_argument("Cannot write '" + path + "': " + what + "."); };
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    if (grid.extent[2 * axis] > grid.extent[2 * axis + 1])
    {
      refuse("the volumes have no voxels");
    }
  }
  if (!grid.origin.allFinite() || !grid.spacing.allFinite() || !grid.direction.allFinite())
  {
    refuse("origin, spacing and direction must be finite");
  }
  if (index.values.empty())
  {
    refuse("there are no volumes");
  }
  for (std::size_t n = 0; n < index.values.size(); ++n)
  {
    if (!std::isfinite(index.values[n]) || (n > 0 && !(index.values[n] > index.values[n - 1])))
    {
      refuse("the index of the volumes has to be finite and to increase");
    }
  }
  if ((index.name + index.unit).find_first_of("\"\n\r") != std::string::npos)
  {
    refuse("name and unit of the index must have no quotes and no ends of lines");
  }
}

template <typename T>
void Write(const std::string& path, const ImageGrid& grid, const SequenceIndex& index,
  bool compress, const std::function<void(std::size_t, T*)>& read, const char* type)
{
  Check(path, grid, index);
  const std::array<int, 6>& e = grid.extent;
  std::string header =
    std::string("NRRD0005\n# Volumes over time, written by coronary-pipeline\n") + "type: " + type +
    "\ndimension: 4\nspace: left-posterior-superior\nsizes:";
  std::uint64_t voxels = 1;
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const std::int64_t size = std::int64_t(e[2 * axis + 1]) - e[2 * axis] + 1;
    header += " " + std::to_string(size);
    voxels *= static_cast<std::uint64_t>(size);
  }
  header +=
    " " + std::to_string(index.values.size()) + "\nspace directions:" + NrrdDirections(grid);
  header += std::string(" none\nkinds: domain domain domain list\n") +
    "endian: " + (HostIsBigEndian() ? "big" : "little") +
    "\nencoding: " + (compress ? "gzip" : "raw") + "\nlabels: \"\" \"\" \"\" \"" + index.name +
    "\"\nunits: \"\" \"\" \"\" \"" + index.unit + "\"\nspace origin: " + NrrdOrigin(grid) +
    "\naxis 3 index type:=numeric\naxis 3 index values:=";
  AppendNumbers(header, index.values);
  header += "\nDataNodeClassName:=vtkMRMLScalarVolumeNode\n\n";
  PackedFile output(path, header, compress ? Packing::Gzip : Packing::None);
  std::vector<T> volume(voxels);
  for (std::size_t n = 0; n < index.values.size(); ++n)
  {
    read(n, volume.data());
    output.Add(volume.data(), volume.size() * sizeof(T));
  }
  output.Finish();
  output.Commit();
}
}

void WriteNrrdSequence(const std::string& path, const ImageGrid& grid, const SequenceIndex& index,
  bool compress, const std::function<void(std::size_t, short*)>& read)
{
  Write<short>(path, grid, index, compress, read, "short");
}

void WriteNrrdSequence(const std::string& path, const ImageGrid& grid, const SequenceIndex& index,
  bool compress, const std::function<void(std::size_t, float*)>& read)
{
  Write<float>(path, grid, index, compress, read, "float");
}
}
