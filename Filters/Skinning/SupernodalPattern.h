/**
 * @file SupernodalPattern.h
 * @brief Where the entries of a Cholesky factor are, before there are any values. Inside the library only.
 *
 * Order: approximate minimum degree (Amestoy, Davis, Duff, "Algorithm 837: AMD", ACM TOMS 2004; the AMD library).
 * Elimination tree: Liu, "The role of elimination trees in sparse factorization", SIAM J. Matrix Anal. Appl. 1990.
 * Numbers of entries: Gilbert, Ng, Peyton, "An efficient algorithm to compute row and column counts for sparse
 * Cholesky factorization", SIAM J. Matrix Anal. Appl. 1994. Supernodes that are merged although that
 * stores zeros: Ashcraft & Grimes, "The influence of relaxed supernode partitions on the multifrontal method",
 * ACM TOMS 1989.
 */
#ifndef DynamicCoronary_SupernodalPattern_h
#define DynamicCoronary_SupernodalPattern_h

#include <cstdint>
#include <vector>

namespace coronary
{
/// Rows with ascending columns; a symmetric matrix is stored with both triangles.
struct SparseMatrix
{
  std::int64_t rows = 0;
  std::vector<std::int64_t> offset; ///< rows + 1 values
  std::vector<std::int32_t> column;
  std::vector<double> value;
};

/// Supernodes of a factor: consecutive rows whose entries lie in the same rows below.
struct SupernodalPattern
{
  std::vector<std::int32_t> order;       ///< place in the given rows of each row of the factor
  std::vector<std::int32_t> first;       ///< first row of each supernode, and the number of rows
  std::vector<std::int64_t> rowOffset;   ///< of the supernode's rows: its own, then those below
  std::vector<std::int32_t> rows;        ///< ascending in each supernode
  std::vector<std::int64_t> valueOffset; ///< of the supernode's panel: its rows times its columns
  std::vector<std::int32_t> supernodeOf; ///< per row of the factor

  std::int32_t Supernodes() const { return static_cast<std::int32_t>(this->first.size()) - 1; }
  std::int64_t Width(std::int32_t s) const { return this->first[s + 1] - this->first[s]; }
  std::int64_t Height(std::int32_t s) const { return this->rowOffset[s + 1] - this->rowOffset[s]; }
  const std::int32_t* RowsOf(std::int32_t s) const
  {
    return this->rows.data() + this->rowOffset[s];
  }
};

enum class EliminationOrder
{
  FillReducing,
  Given ///< but for a change that leaves the entries as many as they are
};

/// Analyses the submatrix of `rows` (ascending). The same on every run.
/// @throws std::bad_alloc
SupernodalPattern FindSupernodes(const SparseMatrix& matrix, const std::vector<std::int32_t>& rows,
  EliminationOrder order = EliminationOrder::FillReducing);

/// A fill-reducing order of a symmetric matrix: the old row of each new one. The same on every run.
/// @throws std::bad_alloc
std::vector<std::int32_t> FillReducingOrder(const SparseMatrix& matrix);
}

#endif
