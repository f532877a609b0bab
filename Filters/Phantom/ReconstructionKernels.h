/**
 * @file ReconstructionKernels.h
 * @brief Inner loops of filtered back-projection, compiled for several generations of processors.
 */
#ifndef DynamicCoronary_ReconstructionKernels_h
#define DynamicCoronary_ReconstructionKernels_h

#include "KernelChoice.h"

namespace coronary
{
/// A view onto a row of pixel columns, which stand over each other along z.
struct BackProjectedRow
{
  const float* view; ///< filtered, [column][row]
  int channels;
  int rows;
  double middle;      ///< column of the central ray
  double columnPitch; ///< rad
  double towards[2];  ///< unit vector from the axis to the tube
  double distance;    ///< of the tube from the axis, mm
  double x;           ///< of the first pixel from the axis, mm
  double step;        ///< between pixels, mm
  double y;           ///< of the row, mm
  double height;      ///< of the lowest voxel over the central plane, mm
  double rise;        ///< between voxels, mm
  double
    rowScale; ///< detector rows a mm of height and 1/mm of distance: to the detector over the pitch
  int pixels;
  int voxels;  ///< along z
  float* line; ///< room for rows + 1
  float* out;  ///< [pixel][voxel], added to
};

struct ReconstructionKernels
{
  /// out[c][r] = sum over n of kernel[|c - n|] in[n][r], for the columns first..last
  void (*convolve)(
    const float* kernel, const float* in, int channels, int rows, int first, int last, float* out);
  void (*backProject)(const BackProjectedRow& row);
};

/// Which set runs, in the whole process.
KernelChoice<ReconstructionKernels>& ReconstructionKernelChoice();

extern const ReconstructionKernels ReconstructionKernelsBaseline;
extern const ReconstructionKernels ReconstructionKernelsAvx2;
}

#endif
