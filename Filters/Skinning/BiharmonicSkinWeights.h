/**
 * @file BiharmonicSkinWeights.h
 * @brief Smooth, bounded weights that tie every point of a tetrahedral mesh to the bones inside it.
 *
 * Source of the energy and the bounds: Jacobson, Baran, Popovic, Sorkine, "Bounded biharmonic weights
 * for real-time deformation", SIGGRAPH 2011. Here the weights are found together, with their sum in
 * the optimisation. docs/skinning.md has the equations.
 */
#ifndef DynamicCoronary_BiharmonicSkinWeights_h
#define DynamicCoronary_BiharmonicSkinWeights_h

#include "Geometry.h"
#include "ParallelFor.h"

#include <string>
#include <utility>
#include <vector>

namespace coronary
{
enum class SkinWeightMode
{
  Joint = 0,       ///< bounds and sum 1 in one optimisation over all bones
  Independent = 1, ///< each bone by itself within its bounds, then divided by the sum (Eq. 7)
  Unbounded = 2,   ///< biharmonic, without bounds: the sum is 1, the values overshoot
  Harmonic = 3     ///< harmonic: within bounds but for flat tetrahedra, with kinks at the bones
};

struct SkinWeightSettings
{
  SkinWeightMode mode = SkinWeightMode::Joint;
  double tolerance =
    1e-6; ///< of the conditions of optimality, see SkinWeights::residual; 1e-10 to 0.01
  int iterations = 2000; ///< limit for the alternating directions, 1 to 1000000
  bool polish = true;    ///< solve exactly for the set of bounds that was found to hold
  /// Joint and Independent: a bone may have weight only where a bone that it is solved together with is
  /// nearer than so many diameters of the vessel, along the bones; 0: everywhere.
  /// SkinWeights::energyGap says what it costs.
  double neighbourhood = 1.75;
  /// Makes sure that `neighbourhood` changes nothing: it is only where the solver begins (Joint: with 0.75 at
  /// most), bones get weight wherever they would have some, until residualEverywhere is at most 10 tolerances.
  bool widen = true;
  /// Bones wholly outside of the mesh have no weight anywhere, and are told in SkinWeights::leftOut; else they
  /// are refused.
  bool leaveOutside = false;
  double penalty =
    1e4; ///< of a bone's weight that is not 1 where the bone runs between the points,
         ///< in units of the energy's diagonal, 1 to 1e8

  /// @throws std::invalid_argument naming the setting.
  void Validate() const;
};

struct SkinWeightInput
{
  std::vector<Vector3> points;                         ///< any unit of length
  std::vector<std::array<std::int64_t, 4>> tetrahedra; ///< either orientation
  std::vector<Vector3> joints;
  std::vector<std::pair<std::int64_t, std::int64_t>> bones; ///< straight, between two joints
};

/// Weights by rows: those of point i are the entries offset[i] to offset[i + 1] - 1, bones ascending.
struct SkinWeights
{
  std::vector<std::int64_t> offset; ///< points + 1 values
  std::vector<std::int32_t> bone;
  std::vector<double> weight; ///< not 0; Joint, Independent and Harmonic: within 0 to 1
  std::int64_t bones = 0;

  bool converged = false;
  int iterations = 0;     ///< of the alternating directions
  int factorizations = 0; ///< of the whole system
  int polishSteps = 0;
  double neighbourhood =
    0.0; ///< in the end, but for what the weights themselves asked for; 0: everywhere
  double penaltyParameter = 0.0; ///< of the alternating directions, at the end

  /// Greatest violation of the conditions of optimality at any point and any bone that may have
  /// weight there, divided by the energy's second derivative in that weight: so it is a weight.
  double residual = 0.0;
  /// The same over all bones, also where `neighbourhood` forbids them.
  double residualEverywhere = 0.0;
  /// Sum over bones of 1/2 w'Qw, 1 / unit of length, before Eq. 7 where that applies.
  double energy = 0.0;
  /// Proven bound on the share of `energy` that is above the least possible one, with all bones
  /// allowed everywhere (Frank-Wolfe gap). Not less than 0 but for rounding.
  double energyGap = 0.0;
  double maximumSum = 1.0; ///< of a row, before it was divided by it
  double minimumSum = 1.0; ///< of a row, before it was divided by it
  /// Greatest distance of a weight on a bone from its wanted value, where bones run between points.
  double constraintResidual = 0.0;
  std::int64_t fixedPoints = 0;      ///< points of the mesh on bones
  std::int64_t samples = 0;          ///< places of bones between the points of the mesh
  std::vector<double> lengthOutside; ///< per bone: unit of length outside of the mesh
  std::vector<std::int64_t> leftOut; ///< bones wholly outside of the mesh, ascending
  double maximumDomainShare = 1.0;   ///< of the points in which a bone may have weight
};

/**
 * Weights of every bone at every point of the mesh.
 *
 * On a bone its weight is 1 and those of the others are 0; bones that share a joint share it evenly.
 * The boundary of the mesh is free. Points of the mesh that lie on a bone (within 1e-5 of the mesh's
 * diagonal) are fixed; where a bone runs between them, the weights interpolated there are drawn to
 * their values with `penalty`.
 *
 * The same input and settings give the same bits, on any number of threads.
 * @throws std::invalid_argument naming the setting, tetrahedron, point or bone at fault: an index out
 * of range, a tetrahedron without volume, a point without tetrahedron, a bone without length or outside
 * of the mesh (with `leaveOutside`: all bones outside), a point on two bones that do not meet there, a connected part of the mesh without bone.
 * @throws std::runtime_error when the equations cannot be solved; Cancelled; std::bad_alloc
 */
SkinWeights ComputeSkinWeights(const SkinWeightInput& input,
  const SkinWeightSettings& settings = {}, const ProgressCallback& progress = {});

/// The greatest weights of every point, as a loop over vertices wants them.
struct CompactSkinWeights
{
  int influences = 0;             ///< entries a point
  std::vector<std::int32_t> bone; ///< points * influences, greatest weight first; 0 when unused
  std::vector<float> weight;      ///< the same size; sum 1, 0 when unused
  std::vector<float> dropped;     ///< per point: weight that was left out (and shared by the rest)
  double maximumDropped = 0.0;
};

/// @param influences  1 to 64
/// @throws std::invalid_argument
CompactSkinWeights CompactWeights(const SkinWeights& weights, int influences = 8);
}

#endif
