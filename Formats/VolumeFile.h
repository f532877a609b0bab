/**
 * @file VolumeFile.h
 * @brief MetaImage, NRRD and NIfTI files, 3-D, or 4-D with time as the fourth axis.
 */
#ifndef DynamicCoronary_VolumeFile_h
#define DynamicCoronary_VolumeFile_h

#include "VolumeSource.h"

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// VolumeInfo and where and how the voxels are stored.
struct VolumeHeader
{
  VolumeInfo info;
  VoxelType type = VoxelType::Int16;
  bool bigEndian = false;
  double slope = 1.0;
  double intercept = 0.0;
  bool phasesFirst = false;           ///< the phases of a voxel lie together (NRRD lists)
  bool compressed = false;            ///< gzip or zlib
  bool wholeFile = false;             ///< the compressed stream holds the header too (.nii.gz)
  std::vector<std::string> dataFiles; ///< of equal shares, in the order of the voxels
  std::uint64_t dataOffset = 0;       ///< bytes before the voxels, in each data file
  std::map<std::string, std::string> notes; ///< "key:=value" lines of a NRRD header
};

/// True when the name ends as one of the formats that ReadVolumeHeader() knows.
bool IsVolumeFileName(const std::string& path);

/**
 * Reads and checks the header of a .mha, .mhd, .nrrd, .nhdr, .nii or .nii.gz file; no voxels.
 *
 * World coordinates are turned into LPS millimetres. Sizes are checked against the size of the data
 * files, so what a damaged header promises is never allocated.
 * @throws std::runtime_error with one sentence naming the file and the entry at fault
 */
VolumeHeader ReadVolumeHeader(const std::string& path);

/**
 * Opens a file by its header.
 * @throws std::runtime_error as ReadVolumeHeader() does
 */
std::unique_ptr<VolumeSource> OpenVolumeFile(const std::string& path);
}

#endif
