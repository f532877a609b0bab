/**
 * @file SkinWeightOptimizer.h
 * @brief Bounded skin weights: alternating directions, then an exact solve on the active set.
 *
 * Inside the library only.
 *
 * Minimises the sum over bones of 1/2 w'Qw + c'w over weights in a set that is simple at every point:
 * the simplex over the bones that may have weight there (Joint), or an interval each (Independent).
 * Douglas-Rachford splitting in its scaled form, with R = rho diag(Q):
 *   z = projection of s,  x = (Q + R)^-1 (R (2 z - s) - c),  s += relaxation (x - z),
 * sped up by Anderson acceleration. At its fixed point Qz + c = R (z - s), so that s - z is the
 * multiplier of the bounds.
 */
#ifndef DynamicCoronary_SkinWeightOptimizer_h
#define DynamicCoronary_SkinWeightOptimizer_h

#include "SkinWeightSystem.h"
#include "SupernodalFactor.h"

#include <functional>
#include <memory>

namespace coronary
{
class SkinWeightOptimizer
{
public:
  SkinWeightOptimizer(const SkinWeightSystem& system, const SkinWeightSettings& settings);

  void Run(const ProgressCallback& progress);

  /// Convergence, energy and violations.
  void Describe(SkinWeights& result) const;

  /// Calls function(bone, weight) for the bones that may have weight in a row, ascending.
  template <typename Function>
  void ForWeights(std::int64_t row, const Function& function) const
  {
    for (std::int64_t p = this->PairOffset[row]; p < this->PairOffset[row + 1]; ++p)
    {
      function(this->PairBone[p], this->Weights[this->PairIndex[p]]);
    }
  }

private:
  using Values = std::vector<double>;

  /// Bones that may have weight in about the same rows: they share a factor.
  struct Group
  {
    std::vector<std::int32_t> bones;
    std::vector<std::int32_t> rows; ///< ascending
    std::int64_t base = 0;          ///< of its first value; then bone by bone
    std::unique_ptr<SupernodalFactor<float>> factor;
    double factorRho = 0.0; ///< that the factor is for; 0: not yet
  };
  /// Columns of one group that one thread solves for at a time.
  struct Task
  {
    std::size_t group;
    std::int64_t firstColumn;
    std::int64_t columns;
  };
  struct Violation
  {
    double inside = 0.0;     ///< where bones may have weight
    double everywhere = 0.0; ///< all bones
    double energy = 0.0;
    double gap = 0.0;
  };

  /// A place where a bone would have weight, were it allowed to.
  struct Violator
  {
    std::int32_t row;
    std::int32_t bone;
  };
  using Rows = std::vector<std::int32_t>; ///< ascending

  /// Adds to the domains what is within `Reach` of their bones.
  void ReachDomains();
  /// Bones whose domains are about the same share a group.
  void MakeGroups();
  /// Of all groups as they are: tasks, pairs, and what goes with them.
  void MakePairs();
  /// The rows where bones have weight or violate, and those that the energy ties to them, `rings` times.
  std::vector<Rows> Support(
    const Values& z, const std::vector<Violator>& violators, int rings) const;
  /// The domains become what the weights need.
  /// @return false when they stay, since that is not `needed` and would not make iterations shorter
  bool Follow(
    const Values& z, const std::vector<Violator>& violators, bool needed, Values& s, Values& x);
  /// Lets the bones have weight where they would.
  /// @return true
  bool Grow(const Values& z, const std::vector<Violator>& violators, Values& s, Values& x);
  /// Lets the bones have weight in rows one diameter further away, and keeps the weights.
  void Widen();
  /// Calls `change`, which makes other pairs, and carries the values over; 0 where there were none.
  void Rearrange(const std::function<void()>& change, const std::vector<Values*>& values);
  /// Estimate of the time that an iteration takes.
  double Effort() const;
  void Factorize();
  /// @return false when the neighbourhood is too small
  bool Iterate(const ProgressCallback& progress, double first, double last);
  bool CanWiden() const;
  void Project(const Values& s, Values& z) const;
  /// x = (Q + R)^-1 (R (2 z - s) - c), by adding what the change of the right-hand side changes; or,
  /// when `exact`, what the true residual of x does.
  void Solve(const Values& s, const Values& z, Values& right, Values& x, bool exact) const;
  /// What a bone would feel in a row where it is not allowed.
  struct Outside
  {
    std::int32_t row;
    double gradient;
  };
  /// Qz + c for all pairs, and by bone what is outside of its domain.
  /// @return energy
  double Gradients(const Values& z, Values& gradient, bool everywhere,
    std::vector<std::vector<Outside>>& outside) const;
  /// @param multiplier  by row, of the sum, Joint
  /// @param lowest      by row, gradient of any bone
  void JudgeRows(const Values& z, const Values& gradient, Values& multiplier, Values& lowest,
    Violation& violation) const;
  /// Bones that are not allowed somewhere. Where a bone's weight is far away, its gradient is 0.
  void JudgeOutside(const std::vector<std::vector<Outside>>& outside, const Values& multiplier,
    Values& lowest, Violation& violation, std::vector<Violator>* violators) const;
  /// Qz + c for all pairs; `everywhere` judges the other bones too, and lists where they violate.
  Violation Judge(const Values& z, Values& gradient, bool everywhere,
    std::vector<Violator>* violators = nullptr) const;
  /// Another penalty when one of the residuals lags behind, as OSQP does.
  void Balance(const Values& x, const Values& z, const Values& previous, Values& s);
  /// Change of the pairs that are free, with all others held; by rows.
  /// @param pivot  by row the pair that follows from the others, Joint; else -1
  Values NewtonStep(const std::vector<std::int64_t>& unknowns,
    const std::vector<std::int64_t>& offset, const std::vector<std::int64_t>& pivot,
    const Values& gradient) const;
  /// Exact solves with the bounds that hold as equations, until these are the right ones.
  void Polish(const ProgressCallback& progress);
  static double Dot(const Values& a, const Values& b);
  /// Products of the vectors with `b`, in one go.
  static std::vector<double> Dots(
    const std::vector<const std::vector<float>*>& vectors, const std::vector<float>& b);

  class Acceleration;

  const SkinWeightSystem& System;
  const SkinWeightSettings Settings;
  const bool Joint;
  std::vector<Rows> Domains; ///< per bone: where it may have weight, at least
  bool Follows = false;      ///< the domains follow the weights, no longer `Reach`
  int Changes = 0;           ///< of the domains
  std::vector<Group> Groups;
  std::vector<Task> Tasks;
  std::int64_t Size = 0; ///< number of pairs of a row and a bone
  // Pairs by rows.
  std::vector<std::int64_t> PairOffset;
  std::vector<std::int32_t> PairBone;
  std::vector<std::int64_t> PairIndex; ///< into the values
  // Pairs by values.
  std::vector<std::int32_t> RowOfValue;
  Values Linear;

  double Reach; ///< diameters around a group that it may have weight at; 0: everywhere
  double Rho = 0.0;
  Values Weights;
  Violation Quality;
  bool Converged = false;
  int Iterations = 0;
  int Factorizations = 0;
  int PolishSteps = 0;
};
}

#endif
