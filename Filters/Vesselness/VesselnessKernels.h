// Inner loops of MultiscaleVesselness, one set for each generation of processors.
#ifndef DynamicCoronary_VesselnessKernels_h
#define DynamicCoronary_VesselnessKernels_h

namespace coronary
{
template <typename Kernels>
class KernelChoice;

/// Rows are padded to a multiple of it, so that a voxel goes through the same instructions wherever
/// a part begins.
constexpr int VesselnessLanes = 16;

/// Second derivatives of the voxels of one row at one scale, times sigma squared.
struct HessianRow
{
  const float* xx;
  const float* yy;
  const float* zz;
  const float* xy;
  const float* xz;
  const float* yz;
};

struct RowParameters
{
  float sign;      ///< -1 turns dark vessels into bright ones
  float halfAlpha; ///< 1 / (2 alpha^2), and so on
  float halfBeta;
  float halfC;
};

/// Widths are multiples of VesselnessLanes. Kernels are right halves, from the centre on.
struct VesselnessKernels
{
  /// out[n] = smooth, first, second derivative (n < orders) across 2 radius + 1 rows.
  void (*filterAcross)(const float* const* rows, int radius, const float* const* kernels,
    int orders, int width, float* const* out);
  /// Along a row; `in` has `radius` samples before the first and after the last output.
  void (*filterAlong)(
    const float* in, int radius, const float* kernel, int order, int width, float* out);
  void (*frangi)(const HessianRow& h, const RowParameters& parameters, int width, float* result);
  void (*sato)(const HessianRow& h, float sign, float alpha, int width, float* result);
  void (*jerman)(const HessianRow& h, float sign, float cutoff, int width, float* result);
  void (*squaredNorm)(const HessianRow& h, int width, float* result);
  void (*lambda3)(const HessianRow& h, float sign, int width, float* result);
};

/// Which set runs, in the whole process.
KernelChoice<VesselnessKernels>& VesselnessKernelChoice();

extern const VesselnessKernels VesselnessKernelsBaseline;
extern const VesselnessKernels VesselnessKernelsAvx2;
extern const VesselnessKernels VesselnessKernelsAvx512;
}

#endif
