/**
 * @file VolumeSource.h
 * @brief One file or folder that holds the voxels of one or more phases on one grid.
 */
#ifndef DynamicCoronary_VolumeSource_h
#define DynamicCoronary_VolumeSource_h

#include "ByteStream.h"
#include "Geometry.h"
#include "ParallelFor.h"

#include <array>
#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

namespace coronary
{
enum class VoxelType
{
  Int8,
  UInt8,
  Int16,
  UInt16,
  Int32,
  UInt32,
  Int64,
  UInt64,
  Float32,
  Float64
};

/// Of a C++ type of numbers.
template <typename Value>
constexpr VoxelType VoxelTypeOf()
{
  constexpr bool isSigned = std::is_signed_v<Value>;
  if constexpr (std::is_floating_point_v<Value>)
  {
    return sizeof(Value) == 4 ? VoxelType::Float32 : VoxelType::Float64;
  }
  else
  {
    return sizeof(Value) == 1 ? (isSigned ? VoxelType::Int8 : VoxelType::UInt8)
      : sizeof(Value) == 2    ? (isSigned ? VoxelType::Int16 : VoxelType::UInt16)
      : sizeof(Value) == 4    ? (isSigned ? VoxelType::Int32 : VoxelType::UInt32)
                              : (isSigned ? VoxelType::Int64 : VoxelType::UInt64);
  }
}

/// Bytes of one value.
std::size_t VoxelBytes(VoxelType type);

/// What a header says, in the terms of this project.
struct VolumeInfo
{
  std::string path;
  std::string format;   ///< e.g. "NIfTI-1"
  std::string modality; ///< of DICOM files, "CT", "MR", ...; empty: the format does not say
  ImageGrid grid;       ///< extent begins at 0; LPS millimetres
  int phases = 1;
  std::vector<double> fractions;       ///< of the R-R interval, one a phase; empty: not in the file
  std::vector<std::string> phaseNames; ///< one a phase, for messages and users
  double cycleSeconds = 0.0;           ///< R-R interval; 0 when the file does not say

  /**
   * True when stored values are integers of at most 16 bits and the rescale is integral, so that
   * short is the natural type. A volume of such a source may still hold single values beyond it.
   */
  bool fitsShort = false;

  std::vector<std::string> warnings; ///< full sentences
  std::vector<std::string> notes;    ///< full sentences: skipped files, series found, ...
};

/// Reads voxels plane by plane, so that only the caller's buffer is as large as a volume.
class VolumeSource
{
public:
  virtual ~VolumeSource();
  VolumeSource() = default;
  VolumeSource(const VolumeSource&) = delete;
  VolumeSource& operator=(const VolumeSource&) = delete;

  const VolumeInfo& Info() const { return this->Header; }

  /**
   * Reads a sub-extent of one phase, rescaled, i fastest.
   *
   * @param extent  inside Info().grid.extent
   * @param values  room for the voxels of the extent
   * @returns false when a value is no integer within the range of short; `values` is then undefined
   * @throws std::runtime_error naming the file: truncated, damaged, vanished, changed
   * @throws Cancelled when progress returned false
   */
  bool Read(int phase, const std::array<int, 6>& extent, short* values,
    const ProgressCallback& progress = {});

  /// The same in single precision, which never fails for the values' sake.
  void Read(int phase, const std::array<int, 6>& extent, float* values,
    const ProgressCallback& progress = {});

protected:
  /// The stored values of one plane of constant k, host byte order, and how to rescale them.
  struct Plane
  {
    VoxelType type = VoxelType::Int16;
    double slope = 1.0;
    double intercept = 0.0;
    std::vector<unsigned char> bytes;
  };

  /// Fills the plane k of a phase; `plane` may keep its buffer from call to call.
  virtual void ReadPlane(int phase, int k, Plane& plane, const Poll& poll) = 0;

  /// Whether ReadPlane may be called from several threads at once, for planes of this phase.
  virtual bool HasSeparatePlanes(int /*phase*/) const { return false; }

  /// Called after the last plane of a Read, also when it failed: closes what need not stay open.
  virtual void EndOfVolume() {}

  VolumeInfo Header;

private:
  template <typename T>
  bool ReadPlanes(
    int phase, const std::array<int, 6>& extent, T* values, const ProgressCallback& progress);
};

/**
 * Turns a matrix of nearly orthonormal columns into an orthonormal one, handedness kept.
 * @throws std::runtime_error naming `path` when an entry is off by more than 1e-3
 */
Matrix3 Orthonormalised(const Matrix3& direction, const std::string& path);
}

#endif
