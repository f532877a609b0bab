// Inner loops of the image chain, one set for each generation of processors; all give the same bits.
#ifndef DynamicCoronary_DetectorKernels_h
#define DynamicCoronary_DetectorKernels_h

#include <cstdint>

namespace coronary
{
template <typename Kernels>
class KernelChoice;

/// Tables of Poisson's distribution: for means 0, 1 / PoissonTablesPerUnit, ... below MaximumTabledMean.
constexpr float MaximumTabledMean = 32.0F;
constexpr float PoissonTablesPerUnit = 4.0F;

struct DetectorKernels
{
  /// result = exp(-(first + second + third)) * columnShutter * rowShutter; second and third may be null.
  void (*transmit)(const float* first, const float* second, const float* third,
    const float* columnShutter, float rowShutter, int width, float* result);
  /// result = direct * transmission + veiled * veil
  void (*mix)(const float* transmission, const float* veil, float direct, float veiled, int width,
    float* result);
  /// What Poisson numbers need beside table look-ups. Below MaximumTabledMean: which table, and a Poisson number of
  /// what the mean is above the table's, from the lower 32 bits. From there on: the standard deviation, table -1.
  void (*photons)(const float* mean, const std::uint64_t* bits, int width, std::int32_t* table,
    float* fewOrDeviation);
  /// Symmetric kernel along a row that has `radius` samples before the first and after the last.
  void (*blurAlong)(const float* in, const float* kernel, int radius, int width, float* result);
  /// The same across 2 radius + 1 rows.
  void (*blurAcross)(
    const float* const* rows, const float* kernel, int radius, int width, float* result);
  /// cells[c] += share * (sum of the c-th `size` values)
  void (*addCells)(const float* in, int size, float share, int cells, float* sums);
  /// held = fresh + lag * (held - fresh)
  void (*lag)(const float* fresh, float lag, int width, float* held);
  /// result = ln(max(signal, least)) - unattenuated
  void (*logarithm)(
    const float* signal, float minimum, float unattenuated, std::int64_t count, float* result);
  /// grey = scale * value + offset, rounded and limited to 0 .. 255
  void (*grey)(
    const float* values, float scale, float offset, std::int64_t count, std::uint8_t* grey);
};

/// Which set runs, in the whole process.
KernelChoice<DetectorKernels>& DetectorKernelChoice();

extern const DetectorKernels DetectorKernelsBaseline;
extern const DetectorKernels DetectorKernelsAvx2;
}

#endif
