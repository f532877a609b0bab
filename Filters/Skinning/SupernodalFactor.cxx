#include "SupernodalFactor.h"

#include "SupernodalKernels.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
const SupernodalKernels& Kernels()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static const bool wide = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return wide ? SupernodalKernelsAvx2 : SupernodalKernelsBaseline;
#else
  return SupernodalKernelsBaseline;
#endif
}
}

SupernodalFactor::SupernodalFactor(
  const SparseMatrix& matrix, const std::vector<std::int32_t>& rows)
{
  SupernodalPattern pattern = FindSupernodes(matrix, rows);
  this->Source = std::move(pattern.order);
  this->First = std::move(pattern.first);
  this->RowOffset = std::move(pattern.rowOffset);
  this->RowList = std::move(pattern.rows);
  this->Rows.reserve(rows.size());
  for (const std::int32_t i : this->Source)
  {
    this->Rows.push_back(rows[i]);
  }
  this->SupernodeOf.resize(rows.size());
  this->ValueOffset.assign(1, 0);
  for (std::size_t s = 0; s + 1 < this->First.size(); ++s)
  {
    std::fill(this->SupernodeOf.begin() + this->First[s],
      this->SupernodeOf.begin() + this->First[s + 1], static_cast<std::int32_t>(s));
    const std::int64_t width = this->First[s + 1] - this->First[s];
    const std::int64_t height = this->RowOffset[s + 1] - this->RowOffset[s];
    this->MostBelow = std::max(this->MostBelow, height - width);
    this->ValueOffset.push_back(this->ValueOffset.back() + width * height);
  }
}

SupernodalFactor::~SupernodalFactor() = default;

void SupernodalFactor::Factorize(const SparseMatrix& matrix, double shift)
{
  const auto count = static_cast<std::int64_t>(this->Rows.size());
  std::vector<std::int32_t> local(matrix.rows, -1);
  this->Scale.resize(count);
  for (std::int64_t i = 0; i < count; ++i)
  {
    const std::int32_t row = this->Rows[i];
    local[row] = static_cast<std::int32_t>(i);
    const auto first = matrix.column.begin() + matrix.offset[row];
    const auto last = matrix.column.begin() + matrix.offset[row + 1];
    const double diagonal =
      matrix.value[std::lower_bound(first, last, row) - matrix.column.begin()];
    this->Scale[i] = static_cast<float>(1.0 / std::sqrt(diagonal * (1.0 + shift)));
  }
  this->Values.assign(this->ValueOffset.back(), 0.0f);

  const SupernodalKernels& kernels = Kernels();
  std::vector<std::int32_t> place(count, -1);
  std::vector<std::int32_t> targets;
  std::vector<float> update;
  const auto supernodes = static_cast<std::int32_t>(this->First.size()) - 1;
  for (std::int32_t s = 0; s < supernodes; ++s)
  {
    const std::int32_t* list = this->RowList.data() + this->RowOffset[s];
    const std::int64_t height = this->RowOffset[s + 1] - this->RowOffset[s];
    for (std::int64_t i = 0; i < height; ++i)
    {
      place[list[i]] = static_cast<std::int32_t>(i);
    }
    for (std::int32_t j = this->First[s]; j < this->First[s + 1]; ++j)
    {
      float* column = this->Values.data() + this->ValueOffset[s] + (j - this->First[s]) * height;
      const std::int32_t row = this->Rows[j];
      for (std::int64_t a = matrix.offset[row]; a < matrix.offset[row + 1]; ++a)
      {
        const std::int32_t i = local[matrix.column[a]];
        if (i > j)
        {
          column[place[i]] += static_cast<float>(matrix.value[a] * this->Scale[i] * this->Scale[j]);
        }
      }
      column[place[j]] += 1.0f;
    }
  }
  for (std::int32_t s = 0; s < supernodes; ++s)
  {
    const std::int32_t* list = this->RowList.data() + this->RowOffset[s];
    const std::int64_t height = this->RowOffset[s + 1] - this->RowOffset[s];
    const std::int64_t width = this->First[s + 1] - this->First[s];
    float* panel = this->Values.data() + this->ValueOffset[s];
    if (!kernels.factorPanel(panel, height, width))
    {
      throw std::runtime_error("the equations of the skin weights cannot be solved: the matrix is "
                               "not positive definite; some tetrahedra are too flat");
    }
    // What it takes from the supernodes of the rows below.
    for (std::int64_t first = width; first < height;)
    {
      const std::int32_t target = this->SupernodeOf[list[first]];
      std::int64_t last = first + 1;
      while (last < height && this->SupernodeOf[list[last]] == target)
      {
        ++last;
      }
      const std::int64_t m = height - first;
      const std::int64_t n = last - first;
      const std::int32_t* other = this->RowList.data() + this->RowOffset[target];
      const std::int64_t otherHeight = this->RowOffset[target + 1] - this->RowOffset[target];
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
      update.assign(m * n, 0.0f);
      kernels.subtractProduct(
        panel + first, height, panel + first, height, m, n, width, update.data(), m);
      float* to = this->Values.data() + this->ValueOffset[target];
      for (std::int64_t j = 0; j < n; ++j)
      {
        float* column = to + static_cast<std::int64_t>(targets[j]) * otherHeight;
        for (std::int64_t i = j; i < m; ++i)
        {
          column[targets[i]] += update[j * m + i];
        }
      }
      first = last;
    }
  }
}

void SupernodalFactor::AddSolution(
  const double* right, double* solution, std::int64_t columns, std::vector<float>& scratch) const
{
  constexpr std::int64_t lanes = SupernodalColumns;
  const auto count = static_cast<std::int64_t>(this->Rows.size());
  scratch.assign((count + this->MostBelow) * lanes, 0.0f);
  float* y = scratch.data();
  float* below = y + count * lanes;
  for (std::int64_t i = 0; i < count; ++i)
  {
    for (std::int64_t c = 0; c < columns; ++c)
    {
      y[i * lanes + c] = static_cast<float>(right[c * count + this->Source[i]] * this->Scale[i]);
    }
  }
  const SupernodalKernels& kernels = Kernels();
  const auto supernodes = static_cast<std::int32_t>(this->First.size()) - 1;
  for (std::int32_t s = 0; s < supernodes; ++s)
  {
    const std::int32_t* list = this->RowList.data() + this->RowOffset[s];
    const std::int64_t height = this->RowOffset[s + 1] - this->RowOffset[s];
    const std::int64_t width = this->First[s + 1] - this->First[s];
    kernels.forward(
      this->Values.data() + this->ValueOffset[s], height, width, y + this->First[s] * lanes, below);
    for (std::int64_t i = width; i < height; ++i)
    {
      for (std::int64_t c = 0; c < lanes; ++c)
      {
        y[list[i] * lanes + c] -= below[(i - width) * lanes + c];
      }
    }
  }
  for (std::int32_t s = supernodes - 1; s >= 0; --s)
  {
    const std::int32_t* list = this->RowList.data() + this->RowOffset[s];
    const std::int64_t height = this->RowOffset[s + 1] - this->RowOffset[s];
    const std::int64_t width = this->First[s + 1] - this->First[s];
    for (std::int64_t i = width; i < height; ++i)
    {
      for (std::int64_t c = 0; c < lanes; ++c)
      {
        below[(i - width) * lanes + c] = y[list[i] * lanes + c];
      }
    }
    kernels.backward(
      this->Values.data() + this->ValueOffset[s], height, width, y + this->First[s] * lanes, below);
  }
  for (std::int64_t i = 0; i < count; ++i)
  {
    for (std::int64_t c = 0; c < columns; ++c)
    {
      solution[c * count + this->Source[i]] +=
        static_cast<double>(y[i * lanes + c]) * this->Scale[i];
    }
  }
}
}
