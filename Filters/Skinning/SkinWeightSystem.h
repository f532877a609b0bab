/**
 * @file SkinWeightSystem.h
 * @brief The quadratic energy of skin weights and its constraints, from a mesh and bones.
 *
 * Inside the library only. Lengths are in units of the mesh's mean edge here, points are numbered in a
 * fill-reducing order.
 */
#ifndef DynamicCoronary_SkinWeightSystem_h
#define DynamicCoronary_SkinWeightSystem_h

#include "BiharmonicSkinWeights.h"
#include "SupernodalPattern.h"

namespace coronary
{
struct SkinWeightSystem
{
  /// Value of a bone's weight somewhere.
  struct Target
  {
    std::int32_t bone;
    double value;
  };
  /// A place of a bone inside a tetrahedron.
  struct Sample
  {
    std::array<std::int64_t, 4> points;
    std::array<double, 4> barycentric;
    double size; ///< share of the tetrahedron's size that the bone covers from here
    std::vector<Target> targets;
  };
  struct Entry
  {
    std::int32_t row;
    double value;
  };

  double unit = 1.0; ///< length of 1 here, in the input's unit
  std::int64_t bones = 0;

  std::vector<std::vector<Target>> fixed; ///< per point; empty where it is free
  std::vector<Sample> samples;
  std::vector<double> lengthOutside; ///< per bone, in the input's unit
  /// Bones wholly outside, where they may be left out: then nothing that follows is filled.
  std::vector<std::int64_t> outside;
  double radius = 1.0;           ///< median over the bones of what is around them
  std::vector<double> diameters; ///< per bone: its length in diameters of what is around it

  // Rows are the free points.
  std::vector<std::int64_t> pointOfRow;
  SparseMatrix energy; ///< with the penalties
  std::vector<double> diagonal;
  std::vector<std::vector<Entry>> linear; ///< per bone: energy = 1/2 w'Qw + linear'w + constant
  std::vector<double> constant;           ///< per bone
  std::vector<std::int32_t> nearest;      ///< per row: the bone that is nearest along the mesh
  std::vector<std::vector<std::int32_t>>
    neighbours; ///< per bone: bones whose regions touch its own
};

/// @throws as ComputeSkinWeights
SkinWeightSystem MakeSkinWeightSystem(const SkinWeightInput& input,
  const SkinWeightSettings& settings, const ProgressCallback& progress);
}

#endif
