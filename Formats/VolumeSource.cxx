#include "VolumeSource.h"

#include <Eigen/SVD>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <type_traits>

namespace coronary
{
namespace
{
// Returns false when a value is no short.
template <typename Stored>
bool Convert(
  const unsigned char* bytes, std::size_t count, double slope, double intercept, short* values)
{
  // Integers of up to 16 bits with an integral rescale need no floating point: 65536 * slope is far
  // inside 64 bits for every slope that can give a short.
  const bool integral = std::is_integral<Stored>::value && sizeof(Stored) <= 2 &&
    slope == std::rint(slope) && intercept == std::rint(intercept) && std::abs(slope) < 1e9 &&
    std::abs(intercept) < 1e12;
  constexpr double low = std::numeric_limits<short>::min();
  constexpr double high = std::numeric_limits<short>::max();
  bool good = true;
  if (integral)
  {
    const auto a = static_cast<std::int64_t>(slope);
    const auto b = static_cast<std::int64_t>(intercept);
    for (std::size_t i = 0; i < count; ++i)
    {
      Stored stored;
      std::memcpy(&stored, bytes + i * sizeof(Stored), sizeof(Stored));
      const std::int64_t value = a * static_cast<std::int64_t>(stored) + b;
      values[i] = static_cast<short>(value);
      good = good && value == values[i];
    }
    return good;
  }
  for (std::size_t i = 0; i < count; ++i)
  {
    Stored stored;
    std::memcpy(&stored, bytes + i * sizeof(Stored), sizeof(Stored));
    const double value = slope * static_cast<double>(stored) + intercept;
    if (!(value >= low && value <= high) || value != std::rint(value))
    {
      return false;
    }
    values[i] = static_cast<short>(value);
  }
  return true;
}

template <typename Stored>
bool Convert(
  const unsigned char* bytes, std::size_t count, double slope, double intercept, float* values)
{
  for (std::size_t i = 0; i < count; ++i)
  {
    Stored stored;
    std::memcpy(&stored, bytes + i * sizeof(Stored), sizeof(Stored));
    values[i] = static_cast<float>(slope * static_cast<double>(stored) + intercept);
  }
  return true;
}

/// Calls visit with a value of the type.
template <typename Visit>
auto VisitVoxel(VoxelType type, const Visit& visit)
{
  switch (type)
  {
    case VoxelType::Int8:
      return visit(std::int8_t{});
    case VoxelType::UInt8:
      return visit(std::uint8_t{});
    case VoxelType::Int16:
      return visit(std::int16_t{});
    case VoxelType::UInt16:
      return visit(std::uint16_t{});
    case VoxelType::Int32:
      return visit(std::int32_t{});
    case VoxelType::UInt32:
      return visit(std::uint32_t{});
    case VoxelType::Int64:
      return visit(std::int64_t{});
    case VoxelType::UInt64:
      return visit(std::uint64_t{});
    case VoxelType::Float32:
      return visit(float{});
    case VoxelType::Float64:
      break;
  }
  return visit(double{});
}
}

std::size_t VoxelBytes(VoxelType type)
{
  return VisitVoxel(type, [](auto value) { return sizeof(value); });
}

VolumeSource::~VolumeSource() = default;

template <typename T>
bool VolumeSource::ReadPlanes(
  int phase, const std::array<int, 6>& extent, T* values, const ProgressCallback& progress)
{
  const std::array<int, 6>& whole = this->Header.grid.extent;
  for (int axis = 0; axis < 3; ++axis)
  {
    if (extent[2 * axis] < whole[2 * axis] || extent[2 * axis + 1] > whole[2 * axis + 1] ||
      extent[2 * axis] > extent[2 * axis + 1])
    {
      throw std::runtime_error(
        "'" + this->Header.path + "': the extent asked for is not inside the image.");
    }
  }
  if (phase < 0 || phase >= this->Header.phases)
  {
    throw std::runtime_error(
      "'" + this->Header.path + "' has no phase " + std::to_string(phase) + ".");
  }
  struct Closer
  {
    VolumeSource* Source;
    ~Closer() { this->Source->EndOfVolume(); }
  };
  const Closer closer{ this };

  const auto rowLength = static_cast<std::size_t>(extent[1] - extent[0] + 1);
  const auto wholeRow = static_cast<std::size_t>(whole[1] - whole[0] + 1);
  const auto rows = static_cast<std::size_t>(extent[3] - extent[2] + 1);
  const int count = extent[5] - extent[4] + 1;
  // False: a value that has no place in T.
  const auto readInto = [&](int n, Plane& plane, const Poll& poll)
  {
    this->ReadPlane(phase, extent[4] + n, plane, poll);
    const std::size_t size = VoxelBytes(plane.type);
    T* to = values + static_cast<std::size_t>(n) * rows * rowLength;
    for (int j = extent[2]; j <= extent[3]; ++j, to += rowLength)
    {
      const std::size_t first = static_cast<std::size_t>(j) * wholeRow + extent[0];
      const unsigned char* bytes = plane.bytes.data() + first * size;
      const bool good = VisitVoxel(plane.type,
        [&](auto stored)
        { return Convert<decltype(stored)>(bytes, rowLength, plane.slope, plane.intercept, to); });
      if (!good)
      {
        return false;
      }
    }
    return true;
  };
  std::atomic<bool> good{ true };
  if (this->HasSeparatePlanes(phase))
  {
    ParallelFor(
      count, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        Plane plane;
        for (std::int64_t n = first; n < last && good; ++n)
        {
          if (!readInto(static_cast<int>(n), plane, [] {}))
          {
            good = false;
          }
        }
      },
      progress);
    return good;
  }
  Plane plane;
  double done = 0.0;
  const Poll poll = [&progress, &done] { Report(progress, done); };
  for (int n = 0; n < count && good; ++n)
  {
    done = static_cast<double>(n) / count;
    poll();
    good = readInto(n, plane, poll);
  }
  if (good)
  {
    Report(progress, 1.0);
  }
  return good;
}

bool VolumeSource::Read(
  int phase, const std::array<int, 6>& extent, short* values, const ProgressCallback& progress)
{
  return this->ReadPlanes(phase, extent, values, progress);
}

void VolumeSource::Read(
  int phase, const std::array<int, 6>& extent, float* values, const ProgressCallback& progress)
{
  this->ReadPlanes(phase, extent, values, progress);
}

Matrix3 Orthonormalised(const Matrix3& direction, const std::string& path)
{
  constexpr double tolerance = 1e-3;
  // The nearest orthogonal matrix in the sense of least squares, which keeps the handedness.
  if (direction.allFinite())
  {
    const Eigen::JacobiSVD<Matrix3> svd(direction, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Matrix3 nearest = svd.matrixU() * svd.matrixV().transpose();
    if ((nearest - direction).cwiseAbs().maxCoeff() <= tolerance)
    {
      return nearest;
    }
  }
  throw std::runtime_error("'" + path + "': the image axes are not perpendicular unit vectors.");
}
}
