/**
 * @file NrrdSequenceWriter.h
 * @brief Volumes over time as one NRRD that 3D Slicer opens as a sequence (.seq.nrrd).
 */
#ifndef DynamicCoronary_NrrdSequenceWriter_h
#define DynamicCoronary_NrrdSequenceWriter_h

#include "Geometry.h"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace coronary
{
/// What counts the volumes.
struct SequenceIndex
{
  std::string name = "time"; ///< one word
  std::string unit = "ms";
  std::vector<double> values; ///< finite, strictly increasing, one a volume
};

/**
 * Writes a four-dimensional NRRD, volumes last, in LPS millimetres, atomically. The last axis is of the kind `list`, its
 * label and unit are those of `index`; `axis 3 index type` and `axis 3 index values` are where Slicer's volume
 * sequences keep their index.
 *
 * @param compress  gzip, or raw
 * @param read      fills the voxels of a volume, i fastest; called once for each, in order; may throw
 * @throws std::invalid_argument naming what is not finite, not increasing or empty; std::runtime_error naming `path`
 */
void WriteNrrdSequence(const std::string& path, const ImageGrid& grid, const SequenceIndex& index,
  bool compress, const std::function<void(std::size_t volume, short* voxels)>& read);

/// The same in single precision.
void WriteNrrdSequence(const std::string& path, const ImageGrid& grid, const SequenceIndex& index,
  bool compress, const std::function<void(std::size_t volume, float* voxels)>& read);
}

#endif
