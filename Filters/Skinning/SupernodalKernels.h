// Inner loops of SupernodalFactor, one set for each generation of processors.
#ifndef DynamicCoronary_SupernodalKernels_h
#define DynamicCoronary_SupernodalKernels_h

#include <cstdint>

namespace coronary
{
/// Right-hand sides that are solved for together.
constexpr int SupernodalColumns = 8;

/// Matrices are stored column by column, `ld` values from one column to the next.
struct SupernodalKernels
{
  /// c -= a b', c of m x n, a of m x k, b of n x k.
  void (*subtractProduct)(const float* a, std::int64_t lda, const float* b, std::int64_t ldb,
    std::int64_t m, std::int64_t n, std::int64_t k, float* c, std::int64_t ldc);
  /// Cholesky factor of the upper `width` rows of a panel, and what follows for the rows below.
  /// Diagonals become their reciprocals.
  /// @return false where a pivot is not positive
  bool (*factorPanel)(float* panel, std::int64_t height, std::int64_t width);
  /// Solves with the panel's triangle: x of width x SupernodalColumns, row by row; then
  /// below = (rows below) x.
  void (*forward)(
    const float* panel, std::int64_t height, std::int64_t width, float* x, float* below);
  /// x -= (rows below)' below, then solves with the triangle's transpose.
  void (*backward)(
    const float* panel, std::int64_t height, std::int64_t width, float* x, const float* below);
};

extern const SupernodalKernels SupernodalKernelsBaseline;
extern const SupernodalKernels SupernodalKernelsAvx2;
}

#endif
