/**
 * @file SegmentationFile.h
 * @brief Segmentations as 3D Slicer keeps them (.seg.nrrd), and label maps of any volume format.
 *
 * A .seg.nrrd is a NRRD of label values. Segments that do not overlap share a layer; a fourth, first axis of
 * the kind `list` counts the layers. What a segment is called and which value it has is in lines
 * `SegmentN_ID:=`, `_Name:=`, `_LabelValue:=`, `_Layer:=` and `_Extent:=` of the header, N from 0 without gaps.
 * `Segmentation_ReferenceImageExtentOffset` is of no use here: the origin of the file already is that of its
 * first voxel.
 */
#ifndef DynamicCoronary_SegmentationFile_h
#define DynamicCoronary_SegmentationFile_h

#include "Geometry.h"
#include "ParallelFor.h"

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace coronary
{
struct Segment
{
  std::string id;                                   ///< unique in the file, "Segment_1"
  std::string name;                                 ///< for people; may be there twice
  int layer = 0;                                    ///< from 0
  std::int64_t value = 1;                           ///< of its voxels in the layer
  std::array<int, 6> extent{ 0, -1, 0, -1, 0, -1 }; ///< of its voxels, in those of the file
  bool hasExtent = false;
};

/**
 * The segments out of the header of a .seg.nrrd, up to the empty line or the end.
 * Without `SegmentN_Layer` each segment has a layer of its own, and without `SegmentN_LabelValue` the value 1, as
 * Slicer 4.10 wrote them. A file without segments has none.
 * @param name  of the file, for messages
 * @throws std::runtime_error naming `name` and the entry that is no number or negative, or an ID that is there twice
 */
std::vector<Segment> ParseSegments(const std::string& header, const std::string& name);

/// One mask out of a file.
struct SegmentationMask
{
  ImageGrid grid;                    ///< extent begins at 0
  std::vector<unsigned char> voxels; ///< 0 or 1, i fastest
  std::int64_t count = 0;            ///< of those that are 1
};

class SegmentationFile
{
public:
  /**
   * Opens a file from its header.
   * @throws std::runtime_error as ReadVolumeHeader() and ParseSegments(); a layer that the file does not have
   */
  explicit SegmentationFile(const std::string& path);

  const std::string& Path() const { return this->Name; }
  const ImageGrid& Grid() const { return this->VoxelGrid; }
  int NumberOfLayers() const { return this->Layers; }
  const std::vector<Segment>& Segments() const { return this->List; }

  /// Of the header: spaces that had to be guessed, ...
  const std::vector<std::string>& Warnings() const { return this->Notices; }

  /**
   * The union of segments.
   * @param wanted  names or IDs; empty: all segments. In a file without segments, a value, or "Segment_3" for the
   *                value 3, as Slicer calls it then; empty: all that is not 0
   * @throws std::runtime_error naming the file: no segment of that name (those that there are are listed), values that
   *   are no whole numbers, no voxel in the mask, truncated or damaged voxels
   * @throws Cancelled when progress returned false
   */
  SegmentationMask Mask(
    const std::vector<std::string>& wanted, const ProgressCallback& progress = {}) const;

private:
  std::vector<Segment> Choose(const std::vector<std::string>& wanted) const;

  std::string Name;
  ImageGrid VoxelGrid;
  int Layers = 1;
  std::vector<Segment> List;
  std::vector<std::string> Notices;
};

/// What a segment is called and looks like in 3D Slicer.
struct SegmentLook
{
  std::string name;
  std::array<double, 3> color{ 0.85, 0.30, 0.25 };
  std::string
    terminology; ///< SNOMED CT type of an anatomical structure, "41801008^Coronary artery"; empty: none
};

/**
 * Writes a mask as a .seg.nrrd of one segment, `Segment_1`, with the value 1; gzip; atomically.
 * @throws std::invalid_argument: voxels that are not those of the grid, a name of several lines; std::runtime_error naming
 *   `path`
 */
void WriteSegmentation(
  const std::string& path, const SegmentationMask& mask, const SegmentLook& look);
}

#endif
