/**
 * @file SparseCholesky.h
 * @brief Symmetric sparse matrices, and their factorisation by CHOLMOD.
 */
#ifndef DynamicCoronary_SparseCholesky_h
#define DynamicCoronary_SparseCholesky_h

#include <cstdint>
#include <memory>
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

/**
 * The factor of a symmetric positive definite matrix. Solving changes nothing in it, and may be done
 * by several threads at once.
 */
class SparseCholesky
{
public:
  /**
   * The submatrix of `rows` (ascending), plus `shift` on its diagonal, is factored in the given order.
   * @param shift  one value a row of `rows`, or null
   * @throws std::runtime_error when it is not positive definite; std::bad_alloc
   */
  SparseCholesky(
    const SparseMatrix& matrix, const std::vector<std::int32_t>& rows, const double* shift);
  ~SparseCholesky();
  SparseCholesky(const SparseCholesky&) = delete;
  SparseCholesky& operator=(const SparseCholesky&) = delete;

  /// Room for solving that is kept from call to call; one for each thread.
  class Workspace
  {
  public:
    Workspace();
    ~Workspace();
    Workspace(const Workspace&) = delete;
    Workspace& operator=(const Workspace&) = delete;

  private:
    friend class SparseCholesky;
    struct Content;
    std::unique_ptr<Content> Inside;
  };

  /// Solves for `columns` right-hand sides, one after the other in memory.
  void Solve(
    const double* right, double* solution, std::int64_t columns, Workspace& workspace) const;

  /// Number of entries of the factor.
  double Entries() const;

private:
  struct Content;
  std::unique_ptr<Content> Inside;
};

/// Supernodes of a factor: consecutive rows whose entries lie in the same rows below.
struct SupernodalPattern
{
  std::vector<std::int32_t> order;     ///< place in the given rows of each row of the factor
  std::vector<std::int32_t> first;     ///< first row of each supernode, and the number of rows
  std::vector<std::int64_t> rowOffset; ///< of the supernode's rows: its own, then those below
  std::vector<std::int32_t> rows;      ///< ascending in each supernode
};

/// Analyses the submatrix of `rows` (ascending) in a fill-reducing order. The same on every run.
/// @throws std::bad_alloc
SupernodalPattern FindSupernodes(const SparseMatrix& matrix, const std::vector<std::int32_t>& rows);

/// A fill-reducing order of a symmetric matrix: the old row of each new one. The same on every run.
/// @throws std::bad_alloc
std::vector<std::int32_t> FillReducingOrder(const SparseMatrix& matrix);
}

#endif
