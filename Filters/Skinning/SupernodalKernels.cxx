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
template <int Value>
struct Constant
{
  static constexpr int value = Value;
};
static_assert(Lanes == SupernodalColumns, "a row of right-hand sides is one pack");
template <typename Real>
struct Packs;
template <>
struct Packs<float>
{
  using Pack [[gnu::vector_size(32)]] = float;
  using LoosePack [[gnu::vector_size(32), gnu::aligned(4), gnu::may_alias]] = float;
  static constexpr int Tile = 3; ///< that fit into the registers with four columns
  static constexpr int RowTile = 8;
};
template <>
struct Packs<double>
{
  using Pack [[gnu::vector_size(64)]] = double;
  using LoosePack [[gnu::vector_size(64), gnu::aligned(8), gnu::may_alias]] = double;
  static constexpr int Tile = 1;
  static constexpr int RowTile = 4;
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

/// sum -= `Rows` rows of a block of `stride` rows, times x; the first `count` columns.
template <int Rows, typename Real>
INLINE void SubtractRows(const Real* block, std::int64_t stride, std::int64_t count, const Real* x,
  PackOf<Real> (&sum)[Rows])
{
  for (std::int64_t k = 0; k < count; ++k)
  {
    const PackOf<Real> right = Load(x + k * Lanes);
    for (int r = 0; r < Rows; ++r)
    {
      sum[r] -= block[k * stride + r] * right;
    }
  }
}

/// x -= (`Rows` rows of a block of `stride` rows)' values; the first `count` columns.
template <int Rows, typename Real>
INLINE void SubtractTransposed(const Real* block, std::int64_t stride, std::int64_t count, Real* x,
  const PackOf<Real> (&values)[Rows])
{
  for (std::int64_t k = 0; k < count; ++k)
  {
    // Two sums, so that the additions wait less for each other.
    PackOf<Real> sum = block[k * stride] * values[0];
    PackOf<Real> other = {};
    for (int r = 1; r < Rows; ++r)
    {
      (r % 2 == 0 ? sum : other) += block[k * stride + r] * values[r];
    }
    Store(x + k * Lanes, Load(x + k * Lanes) - (sum + other));
  }
}

/// What a loop over `rows` rows does at once: what fits into the registers.
template <typename Real, typename Function>
INLINE void ForTiles(std::int64_t rows, const Function& function)
{
  constexpr int tile = Packs<Real>::RowTile;
  std::int64_t r = 0;
  for (; r + tile <= rows; r += tile)
  {
    function(r, Constant<tile>{});
  }
  for (; r < rows; ++r)
  {
    function(r, Constant<1>{});
  }
}

template <typename Real>
void Forward(
  const Real* panel, std::int64_t height, std::int64_t width, const std::int32_t* list, Real* all)
{
  Real* x = all + list[0] * Lanes;
  for (std::int64_t start = 0; start < width; start += SupernodalRows)
  {
    const std::int64_t rows = start + SupernodalRows < width ? SupernodalRows : width - start;
    const Real* block = panel + start * width;
    ForTiles<Real>(
      rows, [&](std::int64_t r, auto size) __attribute__((always_inline)) {
        PackOf<Real> sum[size.value];
        for (int t = 0; t < size.value; ++t)
        {
          sum[t] = Load(x + (start + r + t) * Lanes);
        }
        SubtractRows(block + r, rows, start, x, sum);
        for (int t = 0; t < size.value; ++t)
        {
          Store(x + (start + r + t) * Lanes, sum[t]);
        }
      });
    const Real* triangle = block + start * rows;
    for (std::int64_t j = 0; j < rows; ++j)
    {
      Real* to = x + (start + j) * Lanes;
      const PackOf<Real> value = Load(to) * triangle[j * rows + j];
      Store(to, value);
      for (std::int64_t i = j + 1; i < rows; ++i)
      {
        Real* other = x + (start + i) * Lanes;
        Store(other, Load(other) - triangle[j * rows + i] * value);
      }
    }
  }
  for (std::int64_t start = width; start < height; start += SupernodalRows)
  {
    const std::int64_t rows = start + SupernodalRows < height ? SupernodalRows : height - start;
    ForTiles<Real>(
      rows, [&](std::int64_t r, auto size) __attribute__((always_inline)) {
        const std::int32_t* place = list + start + r;
        PackOf<Real> sum[size.value];
        for (int t = 0; t < size.value; ++t)
        {
          sum[t] = Load(all + place[t] * Lanes);
        }
        SubtractRows(panel + start * width + r, rows, width, x, sum);
        for (int t = 0; t < size.value; ++t)
        {
          Store(all + place[t] * Lanes, sum[t]);
        }
      });
  }
}

template <typename Real>
void Backward(
  const Real* panel, std::int64_t height, std::int64_t width, const std::int32_t* list, Real* all)
{
  Real* x = all + list[0] * Lanes;
  const auto subtract = [&](const Real* block, std::int64_t rows, std::int64_t count,
    const std::int32_t* place) __attribute__((always_inline))
  {
    ForTiles<Real>(
      rows, [&](std::int64_t r, auto size) __attribute__((always_inline)) {
        PackOf<Real> pack[size.value];
        for (int t = 0; t < size.value; ++t)
        {
          pack[t] = Load(all + place[r + t] * Lanes);
        }
        SubtractTransposed(block + r, rows, count, x, pack);
      });
  };
  for (std::int64_t start = width; start < height; start += SupernodalRows)
  {
    const std::int64_t rows = start + SupernodalRows < height ? SupernodalRows : height - start;
    subtract(panel + start * width, rows, width, list + start);
  }
  for (std::int64_t start = (width - 1) / SupernodalRows * SupernodalRows; start >= 0;
       start -= SupernodalRows)
  {
    const std::int64_t rows = start + SupernodalRows < width ? SupernodalRows : width - start;
    const Real* block = panel + start * width;
    const Real* triangle = block + start * rows;
    for (std::int64_t j = rows - 1; j >= 0; --j)
    {
      Real* to = x + (start + j) * Lanes;
      PackOf<Real> value = Load(to);
      for (std::int64_t i = j + 1; i < rows; ++i)
      {
        value -= triangle[j * rows + i] * Load(x + (start + i) * Lanes);
      }
      Store(to, value * triangle[j * rows + j]);
    }
    subtract(block, rows, start, list + start);
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
