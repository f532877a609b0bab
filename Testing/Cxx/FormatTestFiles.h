/**
 * @file FormatTestFiles.h
 * @brief Small files of every format, written without the code under test.
 */
#ifndef DynamicCoronary_FormatTestFiles_h
#define DynamicCoronary_FormatTestFiles_h

#include "Geometry.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace formattest
{
/// A folder that goes away with its contents.
class TemporaryFolder
{
public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  /// The path of `name` in the folder; its parent folders are made.
  std::string operator/(const std::string& name) const;

  /// Number of files and folders in it.
  int NumberOfEntries() const;

private:
  std::filesystem::path Path;
};

using Bytes = std::vector<unsigned char>;

void WriteBytes(const std::string& path, const Bytes& bytes);
void WriteText(const std::string& path, const std::string& text);
Bytes ReadBytes(const std::string& path);
Bytes Gzip(const Bytes& bytes);
Bytes Concatenated(const std::string& head, const Bytes& tail);

/// The voxel (i, j, k) of phase p in all test volumes: distinct, and negative for some.
short Value(int i, int j, int k, int p = 0);

/// Values of a volume of size n, i fastest, phases last, as bytes of shorts.
Bytes Voxels(const std::array<int, 3>& n, int phases = 1, bool bigEndian = false);

/// The same with the phases of a voxel together.
Bytes VoxelsPhasesFirst(const std::array<int, 3>& n, int phases);

struct NiftiOptions
{
  std::array<int, 3> n{ 4, 3, 2 };
  int phases = 1;
  bool bigEndian = false;
  bool version2 = false;
  std::array<double, 8> pixdim{ 1, 1, 1, 1, 0, 0, 0, 0 };
  int qform = 0;
  int sform = 0;
  std::array<double, 6> quaternion{};
  std::array<double, 12> affine{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0 };
  double slope = 0.0;
  double intercept = 0.0;
  int units = 2;
  int datatype = 4;
};

/// Header and voxels of a single-file NIfTI.
Bytes Nifti(const NiftiOptions& options);

struct DicomOptions
{
  int rows = 3;
  int columns = 4;
  std::vector<short> values; ///< rows * columns; empty: Value(i, j, slice, phase)
  int slice = 0;
  int phase = 0;
  std::string position = "0\\0\\0";
  std::string orientation = "1\\0\\0\\0\\1\\0";
  std::string spacing = "0.5\\0.5";
  std::string seriesUid = "1.2.3";
  std::string instanceUid; ///< empty: made from slice and phase and series
  std::string frameOfReference = "1.2.3.4";
  std::string modality = "CT";
  std::string description = "Cardiac";
  std::string imageType = "ORIGINAL\\PRIMARY\\AXIAL";
  std::string slope = "1";
  std::string intercept = "0";
  bool isSigned = true;
  int bitsStored = 16;
  int samples = 1;
  /// More elements, by "gggg,eeee" and VR, as text; a value replaces that of the options above.
  std::map<std::pair<std::string, std::string>, std::string> more;
};

/// Writes one slice with GDCM, explicit little endian.
void WriteDicom(const std::string& path, const DicomOptions& options);

/// Writes all phases and slices into one enhanced multi-frame file, slice (s) at (10, 20, 30 + 2 s) with
/// 0.5 mm pixels, phase p at 10 + 20 p per cent of an R-R interval of 800 ms; rescale intercept -7.
void WriteEnhancedDicom(const std::string& path, int phases, int slices);

/// Rewrites a DICOM file with GDCM in a compressed transfer syntax; false if that fails.
bool CompressDicom(const std::string& path, bool runLength);
}

#endif
