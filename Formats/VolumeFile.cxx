#include "VolumeFile.h"

#include "ByteOrder.h"
#include "VolumeHeaderParsers.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace fs = std::filesystem;

namespace
{
// Deflate can not do better than this (zlib's technical details).
constexpr std::uint64_t MaximumDeflateRatio = 1032;

std::uint64_t NumberOfVoxels(const ImageGrid& grid)
{
  std::uint64_t count = 1;
  for (int axis = 0; axis < 3; ++axis)
  {
    count *= static_cast<std::uint64_t>(grid.extent[2 * axis + 1] + 1);
  }
  return count;
}

std::uint64_t NumberOfBytes(const VolumeHeader& header)
{
  return NumberOfVoxels(header.info.grid) * static_cast<std::uint64_t>(header.info.phases) *
    VoxelBytes(header.type);
}

// A size is believed only when the files can hold it.
void CheckSizes(const VolumeHeader& header)
{
  const std::string& path = header.info.path;
  // No product of the sizes below may overflow.
  double voxels = header.info.phases;
  for (int axis = 0; axis < 3; ++axis)
  {
    voxels *= header.info.grid.extent[2 * axis + 1] + 1.0;
  }
  if (voxels > 1e15)
  {
    FormatError(path, "the image size in the header is impossible");
  }
  const std::uint64_t expected = NumberOfBytes(header);
  const std::uint64_t files = header.dataFiles.size();
  if (expected % files != 0)
  {
    FormatError(path, "its voxels can not be shared by " + std::to_string(files) + " data files");
  }
  for (const std::string& file : header.dataFiles)
  {
    const std::uint64_t size = CheckedFileSize(file);
    const std::uint64_t available = size > header.dataOffset ? size - header.dataOffset : 0;
    if (!header.compressed && available < expected / files)
    {
      throw std::runtime_error("'" + file + "' is truncated: expected " +
        std::to_string(expected / files) + " bytes of voxels, got " + std::to_string(available) +
        ".");
    }
    if (header.compressed && expected / files / MaximumDeflateRatio > size)
    {
      throw std::runtime_error("'" + file + "' is truncated: the header promises " +
        std::to_string(expected / files) + " bytes of voxels, more than its " +
        std::to_string(size) + " bytes can hold.");
    }
  }
}

class VolumeFile : public VolumeSource
{
public:
  explicit VolumeFile(VolumeHeader header)
    : Layout(std::move(header))
  {
    this->Header = this->Layout.info;
  }

protected:
  void ReadPlane(int phase, int k, Plane& plane, const Poll& poll) override
  {
    const ImageGrid& grid = this->Header.grid;
    const auto planeVoxels = static_cast<std::uint64_t>(grid.extent[1] + 1) *
      static_cast<std::uint64_t>(grid.extent[3] + 1);
    const std::size_t valueBytes = VoxelBytes(this->Layout.type);
    plane.type = this->Layout.type;
    plane.slope = this->Layout.slope;
    plane.intercept = this->Layout.intercept;
    plane.bytes.resize(planeVoxels * valueBytes);
    const auto phases = static_cast<std::uint64_t>(this->Header.phases);
    const auto slices = static_cast<std::uint64_t>(grid.extent[5] + 1);
    if (this->Layout.phasesFirst)
    {
      this->Interleaved.resize(plane.bytes.size() * phases);
      this->ReadBytes(k * planeVoxels * phases * valueBytes, this->Interleaved, poll);
      for (std::uint64_t v = 0; v < planeVoxels; ++v)
      {
        std::memcpy(plane.bytes.data() + v * valueBytes,
          this->Interleaved.data() + (v * phases + phase) * valueBytes, valueBytes);
      }
    }
    else
    {
      this->ReadBytes((phase * slices + k) * planeVoxels * valueBytes, plane.bytes, poll);
    }
    ToHostOrder(plane.bytes, valueBytes, this->Layout.bigEndian);
  }

  void EndOfVolume() override
  {
    // Between the phases of a compressed 4-D file the decoder's position is worth keeping.
    if (!(this->Layout.compressed && this->Header.phases > 1))
    {
      this->Stream.reset();
    }
  }

private:
  void ReadBytes(std::uint64_t position, std::vector<unsigned char>& bytes, const Poll& poll)
  {
    const std::uint64_t share = NumberOfBytes(this->Layout) / this->Layout.dataFiles.size();
    for (std::size_t done = 0; done < bytes.size();)
    {
      const auto file = static_cast<std::size_t>((position + done) / share);
      const std::uint64_t inFile = (position + done) % share;
      const auto size =
        static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size() - done, share - inFile));
      if (!this->Stream || this->OpenFile != file)
      {
        // The header of a .nii.gz is inside the compressed stream, that of a .mha before it.
        this->Stream = std::make_unique<ByteStream>(this->Layout.dataFiles[file],
          this->Layout.wholeFile ? 0 : this->Layout.dataOffset, this->Layout.compressed);
        this->OpenFile = file;
      }
      const std::uint64_t before = this->Layout.wholeFile ? this->Layout.dataOffset : 0;
      this->Stream->Read(before + inFile, bytes.data() + done, size, before + share, poll);
      done += size;
    }
  }

  VolumeHeader Layout;
  std::unique_ptr<ByteStream> Stream;
  std::size_t OpenFile = 0;
  std::vector<unsigned char> Interleaved;
};

bool IsIntegral(double value)
{
  return value == std::rint(value);
}

// What follows from the header whatever the format.
void Complete(VolumeHeader& header)
{
  VolumeInfo& info = header.info;
  if (!info.grid.origin.allFinite())
  {
    FormatError(info.path, "the image origin is not finite");
  }
  if (!std::isfinite(header.slope) || !std::isfinite(header.intercept))
  {
    FormatError(info.path, "the rescale slope or intercept is not finite");
  }
  CheckSizes(header);
  const bool smallInteger = header.type == VoxelType::Int8 || header.type == VoxelType::UInt8 ||
    header.type == VoxelType::Int16 || header.type == VoxelType::UInt16;
  info.fitsShort = smallInteger && IsIntegral(header.slope) && IsIntegral(header.intercept);
  const std::string name = fs::path(info.path).filename().string();
  for (int phase = 0; phase < info.phases; ++phase)
  {
    info.phaseNames.push_back(info.phases == 1 ? name : name + " [" + std::to_string(phase) + "]");
  }
}
}

bool IsVolumeFileName(const std::string& path)
{
  const std::string name = LowerCase(path);
  for (const char* end : { ".mha", ".mhd", ".nrrd", ".nhdr", ".nii", ".nii.gz" })
  {
    if (EndsWith(name, end))
    {
      return true;
    }
  }
  return false;
}

VolumeHeader ReadVolumeHeader(const std::string& path)
{
  CheckedFileSize(path);
  const std::string name = LowerCase(path);
  VolumeHeader header;
  if (EndsWith(name, ".mha") || EndsWith(name, ".mhd"))
  {
    header = ReadMetaImageHeader(path);
  }
  else if (EndsWith(name, ".nrrd") || EndsWith(name, ".nhdr"))
  {
    header = ReadNrrdHeader(path);
  }
  else if (EndsWith(name, ".nii") || EndsWith(name, ".nii.gz"))
  {
    header = ReadNiftiHeader(path);
  }
  else
  {
    FormatError(
      path, "is of no known format; the extensions are .mha, .mhd, .nrrd, .nhdr, .nii and .nii.gz");
  }
  Complete(header);
  return header;
}

std::unique_ptr<VolumeSource> OpenVolumeFile(const std::string& path)
{
  return std::make_unique<VolumeFile>(ReadVolumeHeader(path));
}

const std::string* HeaderFields::Find(std::initializer_list<const char*> names) const
{
  for (const char* name : names)
  {
    const auto found = this->values.find(name);
    if (found != this->values.end())
    {
      return &found->second;
    }
  }
  return nullptr;
}

const std::string& HeaderFields::Text(const char* name) const
{
  const std::string* text = this->Find(name);
  if (!text)
  {
    FormatError(this->path, std::string("the header has no '") + name + "'");
  }
  return *text;
}

std::vector<int> HeaderFields::Integers(const char* name, std::size_t count, int low) const
{
  return ParseIntegers(this->Text(name), count, low, this->path, name);
}

int HeaderFields::Integer(const char* name, int low, int otherwise) const
{
  return this->Find(name) ? this->Integer(name, low) : otherwise;
}

double HeaderFields::Number(const char* name, double otherwise) const
{
  const std::string* text = this->Find(name);
  return text ? ParseNumbers(*text, 1, this->path, name).front() : otherwise;
}

int HeaderFields::Dimensions(const char* name) const
{
  const int dimensions = this->Integer(name, 1);
  if (dimensions != 3 && dimensions != 4)
  {
    FormatError(this->path, "has " + std::to_string(dimensions) + " dimensions; 3 or 4 are needed");
  }
  return dimensions;
}

std::string PathBeside(const std::string& file, const std::string& name)
{
  return (fs::path(file).parent_path() / name).string();
}

std::string ReadHeaderText(const std::string& path)
{
  std::string text(1u << 20, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.gcount() <= 0)
  {
    throw std::runtime_error("File '" + path + "' cannot be read.");
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

bool ArePerpendicular(const Matrix3& axes)
{
  for (int a = 0; a < 3; ++a)
  {
    const int b = (a + 1) % 3;
    const double cosine = axes.col(a).normalized().dot(axes.col(b).normalized());
    // Two unit vectors off by 1e-3 each.
    if (!(std::abs(cosine) <= 2e-3))
    {
      return false;
    }
  }
  return true;
}

void SetAxes(VolumeHeader& header, const std::vector<int>& size, const Matrix3& axes)
{
  ImageGrid& grid = header.info.grid;
  const std::string& path = header.info.path;
  for (int axis = 0; axis < 3; ++axis)
  {
    grid.extent[2 * axis] = 0;
    grid.extent[2 * axis + 1] = size[axis] - 1;
    grid.spacing[axis] = axes.col(axis).norm();
    if (!std::isfinite(grid.spacing[axis]) || !(grid.spacing[axis] > 0.0))
    {
      FormatError(
        path, "the voxel spacing along axis " + std::to_string(axis) + " is not a positive number");
    }
    grid.direction.col(axis) = axes.col(axis) / grid.spacing[axis];
  }
  grid.direction = Orthonormalised(grid.direction, path);
}
}
