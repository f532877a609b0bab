#include "ByteOrder.h"
#include "VolumeHeaderParsers.h"

#include <cmath>
#include <cstring>

namespace coronary
{
namespace
{
// Fields of the NIfTI-1 (348 bytes) and NIfTI-2 (540 bytes) headers, by offset.
class Bytes
{
public:
  std::vector<unsigned char> Data;
  bool BigEndian = false;

  template <typename T>
  T Get(std::size_t offset) const
  {
    return NumberAt<T>(this->Data.data() + offset, this->BigEndian);
  }
};

using Affine = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

struct Nifti
{
  bool version2 = false;
  std::array<double, 8> dim{};
  std::array<double, 8> pixdim{};
  int datatype = 0;
  double offset = 0.0;
  double slope = 0.0;
  double intercept = 0.0;
  int units = 0;
  int qform = 0;
  int sform = 0;
  std::array<double, 6> quaternion{}; ///< b, c, d, offset x, y, z
  Affine affine = Affine::Zero();
};

/// Where the fields are: bytes from the beginning.
struct Places
{
  std::size_t dim, pixdim, datatype, offset, slope, intercept, qform, sform, quaternion, affine,
    units;
};

template <typename Size, typename Real, typename Offset, typename Code, typename Units>
Nifti ParseFields(const Bytes& bytes, const Places& at)
{
  Nifti n;
  const auto reals = [&bytes](std::size_t from, double* to, std::size_t count)
  {
    for (std::size_t i = 0; i < count; ++i)
    {
      to[i] = bytes.Get<Real>(from + i * sizeof(Real));
    }
  };
  for (std::size_t i = 0; i < 8; ++i)
  {
    n.dim[i] = static_cast<double>(bytes.Get<Size>(at.dim + i * sizeof(Size)));
  }
  reals(at.pixdim, n.pixdim.data(), 8);
  reals(at.slope, &n.slope, 1);
  reals(at.intercept, &n.intercept, 1);
  reals(at.quaternion, n.quaternion.data(), 6);
  reals(at.affine, n.affine.data(), 12);
  n.datatype = bytes.Get<std::int16_t>(at.datatype);
  n.offset = static_cast<double>(bytes.Get<Offset>(at.offset));
  n.qform = bytes.Get<Code>(at.qform);
  n.sform = bytes.Get<Code>(at.sform);
  n.units = bytes.Get<Units>(at.units);
  return n;
}

Nifti ParseHeader(const std::string& path, bool compressed, bool& bigEndian)
{
  ByteStream stream(path, 0, compressed);
  Bytes bytes;
  bytes.Data.resize(540);
  const std::size_t got = stream.ReadSome(0, bytes.Data.data(), bytes.Data.size());
  for (const bool order : { false, true })
  {
    bigEndian = bytes.BigEndian = order;
    const auto size = bytes.Get<std::int32_t>(0);
    if (size == 348 && got >= 348)
    {
      if (std::memcmp(bytes.Data.data() + 344, "n+1", 4) == 0)
      {
        return ParseFields<std::int16_t, float, float, std::int16_t, std::uint8_t>(
          bytes, { 40, 76, 70, 108, 112, 116, 252, 254, 256, 280, 123 });
      }
      FormatError(path,
        "is no single-file NIfTI (its magic is not 'n+1'); .hdr/.img pairs and "
        "Analyze files are not supported");
    }
    if (size == 540 && got >= 540 && std::memcmp(bytes.Data.data() + 4, "n+2", 4) == 0)
    {
      Nifti n = ParseFields<std::int64_t, double, std::int64_t, std::int32_t, std::int32_t>(
        bytes, { 16, 104, 12, 168, 176, 184, 344, 348, 352, 400, 500 });
      n.version2 = true;
      return n;
    }
  }
  FormatError(path, "is not a NIfTI file, or it ends inside its header");
}

VoxelType TypeOf(int datatype, const std::string& path)
{
  switch (datatype)
  {
    case 2:
      return VoxelType::UInt8;
    case 4:
      return VoxelType::Int16;
    case 8:
      return VoxelType::Int32;
    case 16:
      return VoxelType::Float32;
    case 64:
      return VoxelType::Float64;
    case 256:
      return VoxelType::Int8;
    case 512:
      return VoxelType::UInt16;
    case 768:
      return VoxelType::UInt32;
    case 1024:
      return VoxelType::Int64;
    case 1280:
      return VoxelType::UInt64;
    case 32:
    case 1792:
      FormatError(path, "image has 2 components (complex numbers); one is needed");
    case 128:
      FormatError(path, "image has 3 components; one is needed");
    case 2304:
      FormatError(path, "image has 4 components; one is needed");
    default:
      FormatError(path, "NIfTI datatype " + std::to_string(datatype) + " is not supported");
  }
}

// Method 2 of the NIfTI standard; the quaternion's first entry follows from its unit length.
Matrix3 QuaternionAxes(const Nifti& n)
{
  const double b = n.quaternion[0];
  const double c = n.quaternion[1];
  const double d = n.quaternion[2];
  const double rest = 1.0 - b * b - c * c - d * d;
  const double a = rest > 1e-7 ? std::sqrt(rest) : 0.0;
  Matrix3 rotation;
  rotation << a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c),
    2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b), 2 * (b * d - a * c),
    2 * (c * d + a * b), a * a + d * d - b * b - c * c;
  const double qfac = n.pixdim[0] < 0.0 ? -1.0 : 1.0;
  return rotation * Vector3(n.pixdim[1], n.pixdim[2], qfac * n.pixdim[3]).asDiagonal();
}

void SetGeometry(VolumeHeader& header, const Nifti& n, const std::vector<int>& size)
{
  VolumeInfo& info = header.info;
  Matrix3 axes = Vector3(n.pixdim[1], n.pixdim[2], n.pixdim[3]).asDiagonal();
  Vector3 origin = Vector3::Zero();
  bool useQuaternion = n.sform <= 0 && n.qform > 0;
  if (n.sform > 0)
  {
    axes = n.affine.leftCols<3>();
    origin = n.affine.col(3);
    const bool usable = axes.allFinite() && axes.colwise().norm().minCoeff() > 0.0;
    if (usable && !ArePerpendicular(axes))
    {
      if (n.qform <= 0)
      {
        FormatError(info.path, "the sform matrix is sheared and there is no qform to use instead");
      }
      info.warnings.push_back(
        "'" + info.path + "': the sform matrix is sheared; the qform is used instead.");
      useQuaternion = true;
    }
  }
  if (useQuaternion)
  {
    axes = QuaternionAxes(n);
    origin = Vector3(n.quaternion[3], n.quaternion[4], n.quaternion[5]);
  }
  if (n.sform <= 0 && n.qform <= 0)
  {
    info.warnings.push_back(
      "'" + info.path + "': no orientation in the header; the axes are taken as RAS.");
  }
  double scale = 1.0;
  switch (n.units & 7)
  {
    case 1:
      scale = 1000.0;
      break;
    case 3:
      scale = 0.001;
      break;
    default:
      break;
  }
  // RAS to LPS.
  const Matrix3 toLps = Vector3(-scale, -scale, scale).asDiagonal();
  info.grid.origin = toLps * origin;
  SetAxes(header, size, toLps * axes);
}

// A cycle is believed when it could be a heart's: many writers leave the time step at 1 s.
void SetCycle(VolumeInfo& info, const Nifti& n)
{
  double unit = 0.0;
  switch (n.units & 0x38)
  {
    case 8:
      unit = 1.0;
      break;
    case 16:
      unit = 1e-3;
      break;
    case 24:
      unit = 1e-6;
      break;
    default:
      break;
  }
  const double cycle = info.phases * n.pixdim[4] * unit;
  if (info.phases < 2 || !(cycle > 0.0) || !std::isfinite(cycle))
  {
    return;
  }
  if (cycle >= 0.2 && cycle <= 3.0)
  {
    info.cycleSeconds = cycle;
  }
  else
  {
    info.warnings.push_back("'" + info.path + "': its " + std::to_string(info.phases) +
      " phases take " + std::to_string(cycle) +
      " s, which is no heart cycle; the time step is ignored.");
  }
}
}

VolumeHeader ReadNiftiHeader(const std::string& path)
{
  VolumeHeader header;
  VolumeInfo& info = header.info;
  info.path = path;
  header.compressed = IsGzipFile(path);
  header.wholeFile = header.compressed;
  const Nifti n = ParseHeader(path, header.compressed, header.bigEndian);
  info.format = n.version2 ? "NIfTI-2" : "NIfTI-1";
  const double dimensions = n.dim[0];
  if (!(dimensions >= 3 && dimensions <= 7))
  {
    FormatError(path, "the image has fewer than 3 or more than 7 dimensions");
  }
  std::vector<int> size;
  for (int axis = 1; axis <= static_cast<int>(dimensions); ++axis)
  {
    if (!(n.dim[axis] >= 1 && n.dim[axis] <= 2147483647.0))
    {
      FormatError(path, "dim[" + std::to_string(axis) + "] is out of range");
    }
    size.push_back(static_cast<int>(n.dim[axis]));
  }
  size.resize(7, 1);
  for (int axis = 4; axis < 7; ++axis)
  {
    if (size[axis] != 1)
    {
      FormatError(path, "image has " + std::to_string(size[axis]) + " components; one is needed");
    }
  }
  info.phases = size[3];
  header.type = TypeOf(n.datatype, path);
  // A slope of zero means that the values are not to be scaled.
  if (std::isfinite(n.slope) && n.slope != 0.0)
  {
    header.slope = n.slope;
    header.intercept = n.intercept;
  }
  const double minimum = n.version2 ? 540 : 348;
  if (!(n.offset >= minimum && n.offset <= 1e9))
  {
    FormatError(path, "vox_offset is out of range");
  }
  header.dataOffset = static_cast<std::uint64_t>(n.offset);
  header.dataFiles = { path };
  SetGeometry(header, n, size);
  SetCycle(info, n);
  return header;
}
}
