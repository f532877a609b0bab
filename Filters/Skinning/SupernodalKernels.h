// Inner loops of SupernodalFactor, one set for each generation of processors.
#ifndef DynamicCoronary_SupernodalKernels_h
#define DynamicCoronary_SupernodalKernels_h

#include <cstdint>

namespace coronary
{
template <typename Kernels>
class KernelChoice;

/// Right-hand sides that are solved for together.
constexpr int SupernodalColumns = 8;

/// Rows of a finished panel that lie together: block by block of so many rows, column by column in a
/// block; the triangle's last block and the last one below have what is left. Solves run through it
/// from front to back.
constexpr int SupernodalRows = 8;

/// Matrices are stored column by column, `ld` values from one column to the next, but for the panels
/// that `forward` and `backward` take.
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
  /// Solves with the panel's triangle for the rows `list[0]` and the next, as many as it is wide, and
  /// takes what the other rows of the list get from them. `all` has SupernodalColumns values a row.
  void (*forward)(const Real* panel, std::int64_t height, std::int64_t width,
    const std::int32_t* list, Real* all);
  /// The same backwards, with the transpose: first takes what those rows get from the others.
  void (*backward)(const Real* panel, std::int64_t height, std::int64_t width,
    const std::int32_t* list, Real* all);
};

struct SupernodalKernels
{
  PanelKernels<float> single;
  PanelKernels<double> twice;
};

/// Which set runs, in the whole process.
KernelChoice<SupernodalKernels>& SupernodalKernelChoice();

extern const SupernodalKernels SupernodalKernelsBaseline;
extern const SupernodalKernels SupernodalKernelsAvx2;
}

#endif
