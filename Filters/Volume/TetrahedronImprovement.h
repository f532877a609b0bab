/**
 * @file TetrahedronImprovement.h
 * @brief Better shapes for the worst tetrahedra of a mesh, without touching its boundary.
 */
#ifndef DynamicCoronary_TetrahedronImprovement_h
#define DynamicCoronary_TetrahedronImprovement_h

#include "ParallelFor.h"
#include "TetrahedronQuality.h"

#include <utility>
#include <vector>

namespace coronary
{
struct ImprovementSettings
{
  double wantedSine =
    0.26; ///< tetrahedra below this least sine of the dihedral angles are worked on
  double minimumVolume = 0.0; ///< smaller ones count as bad, mm^3
  int passes = 8;             ///< at most
};

struct ImprovementCounts
{
  std::int64_t moves = 0;        ///< points
  std::int64_t edgeRemovals = 0; ///< an edge's ring of tetrahedra replaced
  std::int64_t faceFlips = 0;    ///< two tetrahedra made three
  std::int64_t contractions = 0; ///< points taken out
  std::int64_t insertions = 0;   ///< points put in
};

/**
 * Goes over the bad tetrahedra, worst first, and takes every change that makes the worst one around
 * better: removal of an edge with the best new triangulation of its ring (Klincsek's dynamic
 * programme), flips of a face, moves and contractions of inner points, new points in star-shaped
 * cavities. Nothing that it does makes any tetrahedron worse than the worst one there.
 * After Freitag and Ollivier-Gooch, Int J Numer Meth Engng 40, 1997, and Klingner and Shewchuk,
 * "Aggressive tetrahedral mesh improvement", 2007.
 *
 * @param points  mm; points may be added at the end; those no tetrahedron uses any more stay
 * @param fixed   per point: whether it stays where it is; grows with the points
 * @param edges   that must stay
 * @throws Cancelled
 */
ImprovementCounts ImproveTetrahedra(std::vector<Vector3>& points,
  std::vector<Tetrahedron>& tetrahedra, std::vector<char>& fixed,
  const std::vector<std::pair<std::int64_t, std::int64_t>>& edges,
  const ImprovementSettings& settings, const ProgressCallback& progress = {});
}

#endif
