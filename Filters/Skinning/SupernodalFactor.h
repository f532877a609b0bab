/**
 * @file SupernodalFactor.h
 * @brief Cholesky factor in single precision, for solves that are corrected from outside.
 *
 * Inside the library only. The symbolic analysis is CHOLMOD's; factorisation and solves are our own:
 * they need no BLAS, whichever is installed, and may run in several threads at once.
 */
#ifndef DynamicCoronary_SupernodalFactor_h
#define DynamicCoronary_SupernodalFactor_h

#include "SparseCholesky.h"

#include <memory>

namespace coronary
{
class SupernodalFactor
{
public:
  /**
   * Finds an order and the pattern of the factor of the submatrix of `rows` (ascending).
   * @throws std::bad_alloc
   */
  SupernodalFactor(const SparseMatrix& matrix, const std::vector<std::int32_t>& rows);
  ~SupernodalFactor();
  SupernodalFactor(const SupernodalFactor&) = delete;
  SupernodalFactor& operator=(const SupernodalFactor&) = delete;

  /**
   * Factors D (A + shift diag(A)) D, D scaling the diagonal to 1: single precision is enough as long
   * as the shift is not very small.
   * @throws std::runtime_error when it is not positive definite
   */
  void Factorize(const SparseMatrix& matrix, double shift);

  /**
   * Adds the solution for `columns` (at most 8) right-hand sides, one after the other in memory, to
   * `solution`; to about six digits. @param scratch  kept from call to call, one for each thread
   */
  void AddSolution(
    const double* right, double* solution, std::int64_t columns, std::vector<float>& scratch) const;

  /// Number of entries of the factor.
  std::int64_t Entries() const { return static_cast<std::int64_t>(this->Values.size()); }

private:
  std::vector<std::int32_t> Rows;        ///< of the matrix, in the order of the factor
  std::vector<std::int32_t> Source;      ///< place in `rows`, in the order of the factor
  std::vector<std::int32_t> First;       ///< first row of a supernode, and the end
  std::vector<std::int64_t> RowOffset;   ///< of a supernode's list of rows
  std::vector<std::int32_t> RowList;     ///< rows of the supernodes, ascending in each
  std::vector<std::int64_t> ValueOffset; ///< of a supernode's panel
  std::vector<std::int32_t> SupernodeOf; ///< per row
  std::int64_t MostBelow = 0;
  std::vector<float> Values;
  std::vector<float> Scale;
};
}

#endif
