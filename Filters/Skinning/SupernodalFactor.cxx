#include "SupernodalFactor.h"

#include "KernelChoice.h"
#include "SupernodalKernels.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

namespace coronary
{
namespace
{
template <typename Real>
const PanelKernels<Real>& Kernels()
{
  if constexpr (std::is_same_v<Real, float>)
  {
    return SupernodalKernelChoice().Get().single;
  }
  else
  {
    return SupernodalKernelChoice().Get().twice;
  }
}
}

KernelChoice<SupernodalKernels>& SupernodalKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<SupernodalKernels> choice(SupernodalKernelsBaseline, &SupernodalKernelsAvx2);
#else
  static KernelChoice<SupernodalKernels> choice(SupernodalKernelsBaseline);
#endif
  return choice;
}

template <typename Real>
SupernodalFactor<Real>::SupernodalFactor(
  const SparseMatrix& matrix, const std::vector<std::int32_t>& rows, EliminationOrder order)
  : Pattern(FindSupernodes(matrix, rows, order))
{
  this->Rows.reserve(rows.size());
  for (const std::int32_t i : this->Pattern.order)
  {
    this->Rows.push_back(rows[i]);
  }
}

template <typename Real>
void SupernodalFactor<Real>::Assemble(const SparseMatrix& matrix)
{
  const SupernodalPattern& pattern = this->Pattern;
  std::vector<std::int32_t> local(matrix.rows, -1);
  for (std::size_t i = 0; i < this->Rows.size(); ++i)
  {
    local[this->Rows[i]] = static_cast<std::int32_t>(i);
  }
  this->Values.assign(pattern.valueOffset.back(), Real(0));
  std::vector<std::int32_t> place(this->Rows.size(), -1);
  for (std::int32_t s = 0; s < pattern.Supernodes(); ++s)
  {
    const std::int64_t height = pattern.Height(s);
    for (std::int64_t i = 0; i < height; ++i)
    {
      place[pattern.RowsOf(s)[i]] = static_cast<std::int32_t>(i);
    }
    for (std::int32_t j = pattern.first[s]; j < pattern.first[s + 1]; ++j)
    {
      Real* column = this->Values.data() + pattern.valueOffset[s] + (j - pattern.first[s]) * height;
      const std::int32_t row = this->Rows[j];
      for (std::int64_t a = matrix.offset[row]; a < matrix.offset[row + 1]; ++a)
      {
        const std::int32_t i = local[matrix.column[a]];
        if (i > j)
        {
          column[place[i]] += static_cast<Real>(matrix.value[a] * this->Scale[i] * this->Scale[j]);
        }
      }
      column[place[j]] += Real(1);
    }
  }
}

template <typename Real>
void SupernodalFactor<Real>::Update(
  std::int32_t supernode, std::vector<std::int32_t>& targets, std::vector<Real>& update)
{
  const SupernodalPattern& pattern = this->Pattern;
  const std::int32_t* list = pattern.RowsOf(supernode);
  const std::int64_t height = pattern.Height(supernode);
  const std::int64_t width = pattern.Width(supernode);
  const Real* panel = this->Values.data() + pattern.valueOffset[supernode];
  for (std::int64_t first = width; first < height;)
  {
    const std::int32_t target = pattern.supernodeOf[list[first]];
    std::int64_t last = first + 1;
    while (last < height && pattern.supernodeOf[list[last]] == target)
    {
      ++last;
    }
    const std::int64_t m = height - first;
    const std::int64_t n = last - first;
    const std::int32_t* other = pattern.RowsOf(target);
    const std::int64_t otherHeight = pattern.Height(target);
    targets.resize(m);
    std::int32_t at = 0;
    for (std::int64_t i = 0; i < m; ++i)
    {
      while (other[at] != list[first + i])
      {
        ++at;
      }
      targets[i] = at;
    }
    update.assign(m * n, Real(0));
    Kernels<Real>().subtractProduct(
      panel + first, height, panel + first, height, m, n, width, update.data(), m);
    Real* to = this->Values.data() + pattern.valueOffset[target];
    for (std::int64_t j = 0; j < n; ++j)
    {
      Real* column = to + static_cast<std::int64_t>(targets[j]) * otherHeight;
      for (std::int64_t i = j; i < m; ++i)
      {
        column[targets[i]] += update[j * m + i];
      }
    }
    first = last;
  }
}

namespace
{
/// From column by column to SupernodalRows rows at a time.
template <typename Real>
void Pack(Real* panel, std::int64_t height, std::int64_t width, std::vector<Real>& columns)
{
  columns.assign(panel, panel + height * width);
  const auto pack = [&](std::int64_t first, std::int64_t last)
  {
    for (std::int64_t start = first; start < last; start += SupernodalRows)
    {
      const std::int64_t rows = std::min<std::int64_t>(SupernodalRows, last - start);
      Real* to = panel + start * width;
      for (std::int64_t k = 0; k < width; ++k)
      {
        to = std::copy_n(columns.data() + k * height + start, rows, to);
      }
    }
  };
  pack(0, width);
  pack(width, height);
}
}

template <typename Real>
void SupernodalFactor<Real>::Factorize(const SparseMatrix& matrix, double shift)
{
  this->Scale.clear();
  for (const std::int32_t row : this->Rows)
  {
    double diagonal = 0.0;
    for (std::int64_t a = matrix.offset[row]; a < matrix.offset[row + 1]; ++a)
    {
      diagonal += matrix.column[a] == row ? matrix.value[a] : 0.0;
    }
    this->Scale.push_back(static_cast<Real>(1.0 / std::sqrt(diagonal * (1.0 + shift))));
  }
  this->Assemble(matrix);
  std::vector<std::int32_t> targets;
  std::vector<Real> update;
  for (std::int32_t s = 0; s < this->Pattern.Supernodes(); ++s)
  {
    if (!Kernels<Real>().factorPanel(this->Values.data() + this->Pattern.valueOffset[s],
          this->Pattern.Height(s), this->Pattern.Width(s)))
    {
      throw std::runtime_error("the equations of the skin weights cannot be solved: the matrix is "
                               "not positive definite; some tetrahedra are too flat");
    }
    this->Update(s, targets, update);
    Pack(this->Values.data() + this->Pattern.valueOffset[s], this->Pattern.Height(s),
      this->Pattern.Width(s), update);
  }
}

template <typename Real>
void SupernodalFactor<Real>::AddSolution(
  const double* right, double* solution, std::int64_t columns, std::vector<Real>& scratch) const
{
  constexpr std::int64_t lanes = SupernodalColumns;
  const SupernodalPattern& pattern = this->Pattern;
  const auto count = static_cast<std::int64_t>(this->Rows.size());
  scratch.assign(count * lanes, Real(0));
  Real* y = scratch.data();
  for (std::int64_t i = 0; i < count; ++i)
  {
    for (std::int64_t c = 0; c < columns; ++c)
    {
      y[i * lanes + c] = static_cast<Real>(right[c * count + pattern.order[i]] * this->Scale[i]);
    }
  }
  const PanelKernels<Real>& kernels = Kernels<Real>();
  for (std::int32_t s = 0; s < pattern.Supernodes(); ++s)
  {
    kernels.forward(this->Values.data() + pattern.valueOffset[s], pattern.Height(s),
      pattern.Width(s), pattern.RowsOf(s), y);
  }
  for (std::int32_t s = pattern.Supernodes() - 1; s >= 0; --s)
  {
    kernels.backward(this->Values.data() + pattern.valueOffset[s], pattern.Height(s),
      pattern.Width(s), pattern.RowsOf(s), y);
  }
  for (std::int64_t i = 0; i < count; ++i)
  {
    for (std::int64_t c = 0; c < columns; ++c)
    {
      solution[c * count + pattern.order[i]] +=
        static_cast<double>(y[i * lanes + c]) * this->Scale[i];
    }
  }
}

template class SupernodalFactor<float>;
template class SupernodalFactor<double>;
}
