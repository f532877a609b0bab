// Inner loops of SupernodalFactor, one set for each generation of processors.
#ifndef DynamicCoronary_SupernodalKernels_h
#define DynamicCoronary_SupernodalKernels_h

#include <cstdint>

namespace coronary
{
/// Right-hand sides that are solved for together.
constexpr int SupernodalColumns = 8;

/// Matrices are stored column by column, `ld` values from one column to the next.
template <typename Real>
struct PanelKernels
{
  /// c -= a b', c of m x n, a of m x k, b of n x k.
  void (*subtractProduct)(const Real* a, std::int64_t lda, const Real* b, std::int64_t ldb,
    std::int64_t m, std::int64_t n, std::int64_t k, Real* c, std::int64_t ldc);
  /// Cholesky factor of the upper `width` rows of a panel, and what follows for the rows below.
  /// Diagonals become their reciprocals.
  /// @return false where a pivot is not positive
  bool (*factorPanel)(Real* panel, std::int64_t height, std::int64_t width);
  /// Solves with the panel's triangle: x of width x SupernodalColumns, row by row; then
  /// below = (rows below) x.
  void (*forward)(const Real* panel, std::int64_t height, std::int64_t width, Real* x, Real* below);
  /// x -= (rows below)' below, then solves with the triangle's transpose.
  void (*backward)(
    const Real* panel, std::int64_t height, std::int64_t width, Real* x, const Real* below);
};

struct SupernodalKernels
{
  PanelKernels<float> single;
  PanelKernels<double> twice;
};

extern const SupernodalKernels SupernodalKernelsBaseline;
extern const SupernodalKernels SupernodalKernelsAvx2;

/// For tests: which loops SupernodalFactor calls; false when this processor has not those.
bool SetSupernodalWide(bool wide);
}

#endif
