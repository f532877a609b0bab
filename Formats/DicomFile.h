/**
 * @file DicomFile.h
 * @brief One DICOM file: what its header says of place and time, and its pixels. Not installed.
 */
#ifndef DynamicCoronary_DicomFile_h
#define DynamicCoronary_DicomFile_h

#include "VolumeSource.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace coronary
{
/// One image of a file; files of the older kinds have exactly one.
struct DicomFrame
{
  Vector3 position = Vector3::Zero();   ///< of the centre of the first pixel, LPS mm
  Vector3 rowAxis = Vector3::Zero();    ///< unit vector of increasing column index
  Vector3 columnAxis = Vector3::Zero(); ///< unit vector of increasing row index
  double rowSpacing = 0.0;              ///< between rows, mm
  double columnSpacing = 0.0;           ///< between columns, mm
  double slope = 1.0;
  double intercept = 0.0;
  std::optional<double> triggerTime;       ///< ms after the R wave
  std::optional<double> nominalPercentage; ///< of the R-R interval
  std::optional<double> rrInterval;        ///< ms
};

struct DicomFile
{
  std::string path;
  std::string skipReason; ///< not empty: no image to use, and why (a plural noun, for a list)
  std::string seriesUid;
  std::string instanceUid;
  std::string seriesDescription;
  std::string modality;
  std::string frameOfReferenceUid;
  int rows = 0;
  int columns = 0;
  int bitsAllocated = 0; ///< 8, 16 or 32
  int bitsStored = 0;
  bool isSigned = false;
  std::string transferSyntax; ///< UID
  bool encapsulated = false;  ///< the pixels are compressed
  bool bigEndian = false;
  std::uint64_t pixelOffset = 0; ///< in the file
  std::uint64_t pixelBytes = 0;  ///< in the file, from pixelOffset on
  double sliceSpacing = 0.0;     ///< between slices, or their thickness, mm; 0 if not given
  std::vector<DicomFrame> frames;
  /// Temporal position, acquisition number, acquisition time, instance number.
  std::tuple<double, double, double, double> acquisitionOrder;
};

/**
 * Reads the header of any file. A file that is no DICOM image comes back with a skipReason.
 * @throws std::runtime_error naming the file when it is a DICOM image, but damaged, truncated, without
 *   a usable position, or of several components
 */
DicomFile ReadDicomHeader(const std::string& path);

/// A DICOM decimal or integer string as a number; none when it is not one.
std::optional<double> ParseDicomNumber(const std::string& text);

/// Decodes frames; keeps a multi-frame file open until Close().
class DicomPixelReader
{
public:
  DicomPixelReader();
  ~DicomPixelReader();

  /**
   * Fills `bytes` with the stored values of one frame, host byte order, unused bits cleared.
   * @throws std::runtime_error naming the file when it can not be decoded or has changed
   */
  VoxelType Read(const DicomFile& file, int frame, std::vector<unsigned char>& bytes);

  void Close();

private:
  struct Internals;
  std::unique_ptr<Internals> Impl;
};
}

#endif
