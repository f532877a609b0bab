#include "NrrdSequenceWriter.h"

#include "AtomicFile.h"
#include "ByteStream.h"
#include "TextScanner.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::size_t BlockBytes = 1u << 20;

/// A header and then bytes, which may be packed.
class Output
{
public:
  Output(const std::string& path, const std::string& header, bool compress)
    : Target(path)
    , File(std::fopen(this->Target.TemporaryPath().c_str(), "wb"), &std::fclose)
    , Compress(compress)
  {
    this->Write(header.data(), header.size());
    // Level 1: the voxels are noisy. 16 more than the window bits: with gzip's header, without a date.
    if (compress && deflateInit2(&this->Stream, 1, Z_DEFLATED, 31, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    {
      throw std::runtime_error("zlib can not be initialised.");
    }
  }

  ~Output()
  {
    if (this->Compress)
    {
      deflateEnd(&this->Stream);
    }
  }

  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  void Add(const void* data, std::size_t bytes)
  {
    if (!this->Compress)
    {
      this->Write(data, bytes);
      return;
    }
    const auto* from = static_cast<const unsigned char*>(data);
    for (std::size_t done = 0; done < bytes;)
    {
      const std::size_t block = std::min(BlockBytes, bytes - done);
      this->Deflate(from + done, block, Z_NO_FLUSH);
      done += block;
    }
  }

  void Commit()
  {
    if (this->Compress)
    {
      this->Deflate(nullptr, 0, Z_FINISH);
    }
    // A full disk may show only when the buffer is flushed.
    if (std::fclose(this->File.release()) != 0)
    {
      this->Fail();
    }
    this->Target.Commit();
  }

private:
  void Deflate(const unsigned char* data, std::size_t bytes, int flush)
  {
    // zlib's interface is not const-correct; it does not write to its input.
    this->Stream.next_in = const_cast<unsigned char*>(data);
    this->Stream.avail_in = static_cast<uInt>(bytes);
    do
    {
      this->Stream.next_out = this->Packed.data();
      this->Stream.avail_out = static_cast<uInt>(this->Packed.size());
      deflate(&this->Stream, flush);
      this->Write(this->Packed.data(), this->Packed.size() - this->Stream.avail_out);
    } while (this->Stream.avail_out == 0);
  }

  void Write(const void* data, std::size_t bytes)
  {
    if (!this->File || std::fwrite(data, 1, bytes, this->File.get()) != bytes)
    {
      this->Fail();
    }
  }

  [[noreturn]] void Fail() const
  {
    throw std::runtime_error(
      "Cannot write '" + this->Target.Path() + "': " + std::strerror(errno) + ".");
  }

  AtomicFile Target;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> File;
  bool Compress;
  z_stream Stream{};
  std::vector<unsigned char> Packed = std::vector<unsigned char>(BlockBytes);
};

std::string VectorText(const Vector3& vector)
{
  std::string text = "(";
  for (int axis = 0; axis < 3; ++axis)
  {
    text += axis > 0 ? "," : "";
    AppendNumber(text, vector[axis]);
  }
  return text + ")";
}

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
  header += " " + std::to_string(index.values.size()) + "\nspace directions:";
  for (int axis = 0; axis < 3; ++axis)
  {
    header += " " + VectorText(grid.direction.col(axis) * grid.spacing[axis]);
  }
  header += std::string(" none\nkinds: domain domain domain list\n") +
    "endian: " + (HostIsBigEndian() ? "big" : "little") +
    "\nencoding: " + (compress ? "gzip" : "raw") + "\nlabels: \"\" \"\" \"\" \"" + index.name +
    "\"\nunits: \"\" \"\" \"\" \"" + index.unit +
    "\"\nspace origin: " + VectorText(grid.IndexToWorld(e[0], e[2], e[4])) +
    "\naxis 3 index type:=numeric\naxis 3 index values:=";
  for (std::size_t n = 0; n < index.values.size(); ++n)
  {
    header += n > 0 ? " " : "";
    AppendNumber(header, index.values[n]);
  }
  header += "\nDataNodeClassName:=vtkMRMLScalarVolumeNode\n\n";
  Output output(path, header, compress);
  std::vector<T> volume(voxels);
  for (std::size_t n = 0; n < index.values.size(); ++n)
  {
    read(n, volume.data());
    output.Add(volume.data(), volume.size() * sizeof(T));
  }
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
