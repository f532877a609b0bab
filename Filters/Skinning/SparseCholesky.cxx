#include "SparseCholesky.h"

#include <cholmod.h>

#include <Eigen/Dense>

#include <algorithm>
#include <mutex>
#include <new>
#include <stdexcept>

namespace coronary
{
namespace
{
struct Common
{
  Common()
  {
    cholmod_l_start(&this->c);
    this->c.print = 0;
    this->c.error_handler = nullptr;
    this->c.try_catch = 1;
    this->c.final_ll = 1;
    // Else it may be switched to another precision or a device by the environment.
    this->c.useGPU = 0;
  }
  ~Common() { cholmod_l_finish(&this->c); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;
  cholmod_common c{};
};

struct LowerTriangle
{
  std::vector<SuiteSparse_long> offset;
  std::vector<SuiteSparse_long> row;
  std::vector<double> value;

  cholmod_sparse View()
  {
    cholmod_sparse view{};
    view.nrow = view.ncol = this->offset.size() - 1;
    view.nzmax = this->row.size();
    view.p = this->offset.data();
    view.i = this->row.data();
    view.x = this->value.data();
    view.stype = -1;
    view.itype = CHOLMOD_LONG;
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    view.sorted = 1;
    view.packed = 1;
    return view;
  }
};

/// Debian's serial OpenBLAS gives wrong results, without a word, when two threads are in it.
std::mutex& BlasMutex()
{
  static std::mutex mutex;
  return mutex;
}

/// Solves with a supernodal factor L L', in place; `y` has one row of `columns` values per row of L.
/// Not CHOLMOD's own: that calls BLAS, which need not be safe to use from several threads.
template <int Columns>
void SolveInPlace(
  const cholmod_factor& factor, double* y, std::int64_t columns, std::vector<double>& below)
{
  using Block = Eigen::Matrix<double, Eigen::Dynamic, Columns,
    Columns == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
  using Lower = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  const auto* super = static_cast<const SuiteSparse_long*>(factor.super);
  const auto* pi = static_cast<const SuiteSparse_long*>(factor.pi);
  const auto* px = static_cast<const SuiteSparse_long*>(factor.px);
  const auto* rows = static_cast<const SuiteSparse_long*>(factor.s);
  const auto* values = static_cast<const double*>(factor.x);
  below.resize(factor.maxesize * columns);
  const auto visit = [&](std::int64_t k, bool forward)
  {
    const SuiteSparse_long width = super[k + 1] - super[k];
    const SuiteSparse_long height = pi[k + 1] - pi[k];
    const SuiteSparse_long rest = height - width;
    const Lower diagonal(values + px[k], width, width, Eigen::OuterStride<>(height));
    const Lower under(values + px[k] + width, rest, width, Eigen::OuterStride<>(height));
    Eigen::Map<Block> x(y + super[k] * columns, width, columns);
    Eigen::Map<Block> b(below.data(), rest, columns);
    const SuiteSparse_long* row = rows + pi[k] + width;
    if (forward)
    {
      diagonal.template triangularView<Eigen::Lower>().solveInPlace(x);
      b.noalias() = under * x;
      for (SuiteSparse_long i = 0; i < rest; ++i)
      {
        for (std::int64_t c = 0; c < columns; ++c)
        {
          y[row[i] * columns + c] -= below[i * columns + c];
        }
      }
    }
    else
    {
      for (SuiteSparse_long i = 0; i < rest; ++i)
      {
        for (std::int64_t c = 0; c < columns; ++c)
        {
          below[i * columns + c] = y[row[i] * columns + c];
        }
      }
      x.noalias() -= under.transpose() * b;
      diagonal.transpose().template triangularView<Eigen::Upper>().solveInPlace(x);
    }
  };
  const auto blocks = static_cast<std::int64_t>(factor.nsuper);
  for (std::int64_t k = 0; k < blocks; ++k)
  {
    visit(k, true);
  }
  for (std::int64_t k = blocks - 1; k >= 0; --k)
  {
    visit(k, false);
  }
}

LowerTriangle Extract(
  const SparseMatrix& matrix, const std::vector<std::int32_t>& rows, const double* shift)
{
  std::vector<std::int32_t> local(matrix.rows, -1);
  for (std::size_t i = 0; i < rows.size(); ++i)
  {
    local[rows[i]] = static_cast<std::int32_t>(i);
  }
  LowerTriangle lower;
  lower.offset.reserve(rows.size() + 1);
  lower.offset.push_back(0);
  for (std::size_t i = 0; i < rows.size(); ++i)
  {
    for (std::int64_t k = matrix.offset[rows[i]]; k < matrix.offset[rows[i] + 1]; ++k)
    {
      const std::int32_t j = local[matrix.column[k]];
      if (j >= static_cast<std::int32_t>(i))
      {
        lower.row.push_back(j);
        const bool diagonal = j == static_cast<std::int32_t>(i);
        lower.value.push_back(matrix.value[k] + (diagonal && shift != nullptr ? shift[i] : 0.0));
      }
    }
    lower.offset.push_back(static_cast<SuiteSparse_long>(lower.row.size()));
  }
  return lower;
}
}

struct SparseCholesky::Content
{
  ~Content()
  {
    if (this->factor != nullptr)
    {
      cholmod_l_free_factor(&this->factor, &this->common.c);
    }
  }
  Common common;
  cholmod_factor* factor = nullptr;
};

struct SparseCholesky::Workspace::Content
{
  std::vector<double> values; ///< right-hand sides in the order of the factor, row by row
  std::vector<double> below;  ///< rows under a diagonal block
};

SparseCholesky::Workspace::Workspace()
  : Inside(std::make_unique<Content>())
{
}
SparseCholesky::Workspace::~Workspace() = default;

SparseCholesky::SparseCholesky(
  const SparseMatrix& matrix, const std::vector<std::int32_t>& rows, const double* shift)
  : Inside(std::make_unique<Content>())
{
  LowerTriangle lower = Extract(matrix, rows, shift);
  cholmod_sparse view = lower.View();
  cholmod_common& c = this->Inside->common.c;
  c.supernodal = CHOLMOD_SUPERNODAL;
  c.nmethods = 1;
  c.method[0].ordering = CHOLMOD_NATURAL;
  c.postorder = 1;
  this->Inside->factor = cholmod_l_analyze(&view, &c);
  if (this->Inside->factor != nullptr)
  {
    const std::lock_guard<std::mutex> lock(BlasMutex());
    cholmod_l_factorize(&view, this->Inside->factor, &c);
  }
  if (c.status == CHOLMOD_OUT_OF_MEMORY || c.status == CHOLMOD_TOO_LARGE)
  {
    throw std::bad_alloc();
  }
  if (this->Inside->factor == nullptr || c.status != CHOLMOD_OK ||
    this->Inside->factor->minor < this->Inside->factor->n)
  {
    throw std::runtime_error(
      "the equations of the skin weights cannot be solved: the matrix is not "
      "positive definite; some tetrahedra are too flat");
  }
}

SparseCholesky::~SparseCholesky() = default;

double SparseCholesky::Entries() const
{
  return this->Inside->factor->is_super ? static_cast<double>(this->Inside->factor->xsize)
                                        : static_cast<double>(this->Inside->factor->nzmax);
}

void SparseCholesky::Solve(
  const double* right, double* solution, std::int64_t columns, Workspace& workspace) const
{
  const std::size_t n = this->Inside->factor->n;
  if (n == 0 || columns == 0)
  {
    return;
  }
  const cholmod_factor& factor = *this->Inside->factor;
  const auto* order = static_cast<const SuiteSparse_long*>(factor.Perm);
  Workspace::Content& w = *workspace.Inside;
  w.values.resize(n * columns);
  for (std::size_t i = 0; i < n; ++i)
  {
    for (std::int64_t c = 0; c < columns; ++c)
    {
      w.values[i * columns + c] = right[c * n + order[i]];
    }
  }
  if (columns == 1)
  {
    SolveInPlace<1>(factor, w.values.data(), columns, w.below);
  }
  else
  {
    SolveInPlace<Eigen::Dynamic>(factor, w.values.data(), columns, w.below);
  }
  for (std::size_t i = 0; i < n; ++i)
  {
    for (std::int64_t c = 0; c < columns; ++c)
    {
      solution[c * n + order[i]] = w.values[i * columns + c];
    }
  }
}

SupernodalPattern FindSupernodes(const SparseMatrix& matrix, const std::vector<std::int32_t>& rows)
{
  SupernodalPattern pattern;
  if (rows.empty())
  {
    pattern.first.assign(1, 0);
    pattern.rowOffset.assign(1, 0);
    return pattern;
  }
  LowerTriangle lower = Extract(matrix, rows, nullptr);
  cholmod_sparse view = lower.View();
  Common common;
  common.c.supernodal = CHOLMOD_SUPERNODAL;
  common.c.nmethods = 1;
  common.c.method[0].ordering = CHOLMOD_AMD;
  common.c.postorder = 1;
  cholmod_factor* factor = cholmod_l_analyze(&view, &common.c);
  if (factor == nullptr)
  {
    throw std::bad_alloc();
  }
  const auto* order = static_cast<const SuiteSparse_long*>(factor->Perm);
  const auto* first = static_cast<const SuiteSparse_long*>(factor->super);
  const auto* offset = static_cast<const SuiteSparse_long*>(factor->pi);
  const auto* list = static_cast<const SuiteSparse_long*>(factor->s);
  pattern.order.assign(order, order + rows.size());
  pattern.first.assign(first, first + factor->nsuper + 1);
  pattern.rowOffset.assign(offset, offset + factor->nsuper + 1);
  pattern.rows.assign(list, list + offset[factor->nsuper]);
  cholmod_l_free_factor(&factor, &common.c);
  return pattern;
}

std::vector<std::int32_t> FillReducingOrder(const SparseMatrix& matrix)
{
  std::vector<std::int32_t> rows(matrix.rows);
  for (std::size_t i = 0; i < rows.size(); ++i)
  {
    rows[i] = static_cast<std::int32_t>(i);
  }
  if (rows.empty())
  {
    return rows;
  }
  LowerTriangle lower = Extract(matrix, rows, nullptr);
  cholmod_sparse view = lower.View();
  Common common;
  common.c.nmethods = 1;
  common.c.method[0].ordering = CHOLMOD_AMD;
  common.c.postorder = 1;
  cholmod_factor* factor = cholmod_l_analyze(&view, &common.c);
  if (factor == nullptr)
  {
    throw std::bad_alloc();
  }
  const auto* order = static_cast<const SuiteSparse_long*>(factor->Perm);
  std::copy(order, order + rows.size(), rows.begin());
  cholmod_l_free_factor(&factor, &common.c);
  return rows;
}
}
