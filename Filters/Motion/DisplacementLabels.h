/**
 * @file DisplacementLabels.h
 * @brief The best displacement of every node of a forest out of a lattice of candidates.
 */
#ifndef DynamicCoronary_DisplacementLabels_h
#define DynamicCoronary_DisplacementLabels_h

#include "LineNodes.h"

#include <vector>

namespace coronary
{
/// A cube of candidate displacements around a centre: (2 reach + 1)^3, x fastest.
struct LabelLattice
{
  int reach = 5;
  double step = 1.0; ///< mm

  int Side() const { return 2 * this->reach + 1; }
  int Size() const { return this->Side() * this->Side() * this->Side(); }
};

/**
 * The displacements with the least sum of the nodes' costs and of
 *     |d_i - d_j|^2 / (2 stiffness^2 step_ij)
 * over neighbours: exact (min-sum on a tree; Felzenszwalb & Huttenlocher, "Efficient belief propagation for
 * early vision", IJCV 2006, for the quadratic). Between candidates by a parabola of the least sums.
 *
 * @param costs      per node: one value a candidate, negative logarithm of its likelihood
 * @param stiffness  mm per square root of mm along the vessel
 * @return per node: displacement from the lattice's centre, mm
 */
std::vector<Vector3> BestDisplacements(const LineNodes& nodes, const LabelLattice& lattice,
  const std::vector<std::vector<float>>& costs, double stiffness);
}

#endif
