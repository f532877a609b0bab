// The inner loops of SupernodalFactor. Compiled once for each set of vector instructions, so it may
// include nothing that emits shared inline functions: the linker could keep the widest of them.

#include "SupernodalKernels.h"

// A function that stayed a call would keep its sums in memory.
#define INLINE __attribute__((always_inline)) inline

namespace coronary
{
namespace
{
constexpr int Lanes = 8;
static_assert(Lanes == SupernodalColumns, "a row of right-hand sides is one pack");
template <typename Real>
struct Packs;
template <>
struct Packs<float>
{
  using Pack [[gnu::vector_size(32)]] = float;
  using LoosePack [[gnu::vector_size(32), gnu::aligned(4), gnu::may_alias]] = float;
  static constexpr int Tile = 3; ///< that fit into the registers with four columns
};
template <>
struct Packs<double>
{
  using Pack [[gnu::vector_size(64)]] = double;
  using LoosePack [[gnu::vector_size(64), gnu::aligned(8), gnu::may_alias]] = double;
  static constexpr int Tile = 1;
};
template <typename Real>
using PackOf = typename Packs<Real>::Pack;

/// By reference: a pack returned by value would depend on the registers of the caller.
template <typename Real>
INLINE const typename Packs<Real>::LoosePack& Load(const Real* from)
{
  return *reinterpret_cast<const typename Packs<Real>::LoosePack*>(from);
}

template <typename Real>
INLINE void Store(Real* to, const PackOf<Real>& pack)
{
  *reinterpret_cast<typename Packs<Real>::LoosePack*>(to) = pack;
}

INLINE float Root(float square)
{
  return __builtin_sqrtf(square);
}

INLINE double Root(double square)
{
  return __builtin_sqrt(square);
}

/// `Count` packs of rows and `Columns` columns of c -= a b'.
template <int Count, int Columns, typename Real>
INLINE void Tile(const Real* a, std::int64_t lda, const Real* b, std::int64_t ldb, std::int64_t k,
  Real* c, std::int64_t ldc)
{
  PackOf<Real> sum[Columns][Count] = {};
  for (std::int64_t l = 0; l < k; ++l)
  {
    PackOf<Real> left[Count];
    for (int p = 0; p < Count; ++p)
    {
      left[p] = Load(a + l * lda + p * Lanes);
    }
    for (int j = 0; j < Columns; ++j)
    {
      for (int p = 0; p < Count; ++p)
      {
        sum[j][p] += left[p] * b[l * ldb + j];
      }
    }
  }
  for (int j = 0; j < Columns; ++j)
  {
    for (int p = 0; p < Count; ++p)
    {
      Real* to = c + j * ldc + p * Lanes;
      Store(to, Load(to) - sum[j][p]);
    }
  }
}

template <int Columns, typename Real>
INLINE void Strip(const Real* a, std::int64_t lda, const Real* b, std::int64_t ldb, std::int64_t m,
  std::int64_t k, Real* c, std::int64_t ldc)
{
  constexpr std::int64_t tile = Packs<Real>::Tile * Lanes;
  std::int64_t i = 0;
  for (; i + tile <= m; i += tile)
  {
    Tile<Packs<Real>::Tile, Columns>(a + i, lda, b, ldb, k, c + i, ldc);
  }
  for (; i + Lanes <= m; i += Lanes)
  {
    Tile<1, Columns>(a + i, lda, b, ldb, k, c + i, ldc);
  }
  for (; i < m; ++i)
  {
    Real sum[Columns] = {};
    for (std::int64_t l = 0; l < k; ++l)
    {
      for (int j = 0; j < Columns; ++j)
      {
        sum[j] += a[i + l * lda] * b[l * ldb + j];
      }
    }
    for (int j = 0; j < Columns; ++j)
    {
      c[i + j * ldc] -= sum[j];
    }
  }
}

template <typename Real>
void SubtractProduct(const Real* a, std::int64_t lda, const Real* b, std::int64_t ldb,
  std::int64_t m, std::int64_t n, std::int64_t k, Real* c, std::int64_t ldc)
{
  std::int64_t j = 0;
  for (; j + 4 <= n; j += 4)
  {
    Strip<4>(a, lda, b + j, ldb, m, k, c + j * ldc, ldc);
  }
  for (; j < n; ++j)
  {
    Strip<1>(a, lda, b + j, ldb, m, k, c + j * ldc, ldc);
  }
}

template <typename Real>
bool FactorPanel(Real* panel, std::int64_t height, std::int64_t width)
{
  constexpr std::int64_t block = 8;
  for (std::int64_t start = 0; start < width; start += block)
  {
    const std::int64_t end = start + block < width ? start + block : width;
    if (start > 0)
    {
      SubtractProduct(panel + start, height, panel + start, height, height - start, end - start,
        start, panel + start * height + start, height);
    }
    for (std::int64_t j = start; j < end; ++j)
    {
      Real* column = panel + j * height;
      for (std::int64_t l = start; l < j; ++l)
      {
        const Real* other = panel + l * height;
        const Real factor = other[j];
        for (std::int64_t i = j; i < height; ++i)
        {
          column[i] -= factor * other[i];
        }
      }
      if (!(column[j] > Real(0)))
      {
        return false;
      }
      const Real reciprocal = Real(1) / Root(column[j]);
      column[j] = reciprocal;
      for (std::int64_t i = j + 1; i < height; ++i)
      {
        column[i] *= reciprocal;
      }
    }
    // Later blocks multiply with this one's rows only from their own first row on: the
    // reciprocals on the diagonal are above.
  }
  return true;
}

/// below = rows of `Rows` x
template <int Rows, typename Real>
INLINE void MultiplyRows(
  const Real* rows, std::int64_t height, std::int64_t width, const Real* x, Real* below)
{
  PackOf<Real> sum[Rows] = {};
  for (std::int64_t k = 0; k < width; ++k)
  {
    const PackOf<Real> right = Load(x + k * Lanes);
    for (int r = 0; r < Rows; ++r)
    {
      sum[r] += rows[k * height + r] * right;
    }
  }
  for (int r = 0; r < Rows; ++r)
  {
    Store(below + r * Lanes, sum[r]);
  }
}

template <typename Real>
void Forward(const Real* panel, std::int64_t height, std::int64_t width, Real* x, Real* below)
{
  for (std::int64_t j = 0; j < width; ++j)
  {
    const PackOf<Real> value = Load(x + j * Lanes) * panel[j * height + j];
    Store(x + j * Lanes, value);
    for (std::int64_t i = j + 1; i < width; ++i)
    {
      Store(x + i * Lanes, Load(x + i * Lanes) - panel[j * height + i] * value);
    }
  }
  std::int64_t i = width;
  for (; i + 8 <= height; i += 8)
  {
    MultiplyRows<8>(panel + i, height, width, x, below + (i - width) * Lanes);
  }
  for (; i < height; ++i)
  {
    MultiplyRows<1>(panel + i, height, width, x, below + (i - width) * Lanes);
  }
}

/// x -= columns' below, for `Columns` columns
template <int Columns, typename Real>
INLINE void SubtractColumns(
  const Real* columns, std::int64_t height, std::int64_t rest, Real* x, const Real* below)
{
  PackOf<Real> sum[Columns] = {};
  for (std::int64_t i = 0; i < rest; ++i)
  {
    const PackOf<Real> right = Load(below + i * Lanes);
    for (int c = 0; c < Columns; ++c)
    {
      sum[c] += columns[c * height + i] * right;
    }
  }
  for (int c = 0; c < Columns; ++c)
  {
    Store(x + c * Lanes, Load(x + c * Lanes) - sum[c]);
  }
}

template <typename Real>
void Backward(
  const Real* panel, std::int64_t height, std::int64_t width, Real* x, const Real* below)
{
  const std::int64_t rest = height - width;
  std::int64_t k = 0;
  for (; k + 8 <= width; k += 8)
  {
    SubtractColumns<8>(panel + k * height + width, height, rest, x + k * Lanes, below);
  }
  for (; k < width; ++k)
  {
    SubtractColumns<1>(panel + k * height + width, height, rest, x + k * Lanes, below);
  }
  for (std::int64_t j = width - 1; j >= 0; --j)
  {
    PackOf<Real> value = Load(x + j * Lanes);
    for (std::int64_t i = j + 1; i < width; ++i)
    {
      value -= panel[j * height + i] * Load(x + i * Lanes);
    }
    Store(x + j * Lanes, value * panel[j * height + j]);
  }
}
}

#if defined(__AVX2__)
const SupernodalKernels SupernodalKernelsAvx2
#else
const SupernodalKernels SupernodalKernelsBaseline
#endif
  = { { SubtractProduct<float>, FactorPanel<float>, Forward<float>, Backward<float> },
      { SubtractProduct<double>, FactorPanel<double>, Forward<double>, Backward<double> } };
}
