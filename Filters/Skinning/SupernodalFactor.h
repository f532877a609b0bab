/**
 * @file SupernodalFactor.h
 * @brief Cholesky factor of a symmetric sparse matrix, in single or double precision. Inside the library only.
 *
 * No BLAS is called, whichever is installed; several threads may be at work at once.
 */
#ifndef DynamicCoronary_SupernodalFactor_h
#define DynamicCoronary_SupernodalFactor_h

#include "SupernodalPattern.h"

namespace coronary
{
/// @tparam Real  float, for solves that are corrected from outside, or double
template <typename Real>
class SupernodalFactor
{
public:
  /**
   * Finds an order and the pattern of the factor of the submatrix of `rows` (ascending).
   * @throws std::bad_alloc
   */
  SupernodalFactor(const SparseMatrix& matrix, const std::vector<std::int32_t>& rows,
    EliminationOrder order = EliminationOrder::FillReducing);

  /**
   * Factors D (A + shift diag(A)) D, D scaling the diagonal to 1: single precision is enough as long
   * as the shift is not very small.
   * @throws std::runtime_error when it is not positive definite
   */
  void Factorize(const SparseMatrix& matrix, double shift);

  /**
   * Adds the solution for `columns` (at most 8) right-hand sides, one after the other in memory, to
   * `solution`; to about six digits in single precision. Changes nothing in the factor.
   * @param scratch  kept from call to call, one for each thread
   */
  void AddSolution(
    const double* right, double* solution, std::int64_t columns, std::vector<Real>& scratch) const;

  /// Number of entries of the factor.
  std::int64_t Entries() const { return static_cast<std::int64_t>(this->Values.size()); }

private:
  void Assemble(const SparseMatrix& matrix);
  /// Takes what a supernode changes from the supernodes of the rows below it.
  void Update(
    std::int32_t supernode, std::vector<std::int32_t>& targets, std::vector<Real>& update);

  SupernodalPattern Pattern;
  std::vector<std::int32_t> Rows; ///< of the matrix, in the order of the factor
  std::vector<Real> Values;
  std::vector<Real> Scale;
};

extern template class SupernodalFactor<float>;
extern template class SupernodalFactor<double>;
}

#endif
