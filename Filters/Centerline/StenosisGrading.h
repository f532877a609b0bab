/**
 * @file StenosisGrading.h
 * @brief Narrowings of vessels against what their calibre would be: where, how long, how much.
 *
 * The healthy calibre is a robust regression of the measured radius on the length of each vessel, with a step allowed where
 * a branch leaves; lesions pull it little. Diffuse disease hides in it: so each lesion also tells the diameter
 * that its segment has in the population (Dodge et al., Circulation 1992;86:232).
 */
#ifndef DynamicCoronary_StenosisGrading_h
#define DynamicCoronary_StenosisGrading_h

#include "LumenRefinement.h"

#include <string>
#include <vector>

namespace coronary
{
enum class LesionKind : int
{
  Soft = 0,      ///< no calcium beside it
  Calcified = 1, ///< calcium along more than half of it
  Mixed = 2,     ///< calcium along a part
  Occluded = 3,  ///< no lumen is seen
  Bridged = 4,   ///< the line was guessed across it; not an occlusion by what is seen
  Lost = 5       ///< the line ends in it: its degree is what is seen of it or more
};

/// "soft", "calcified", "mixed", "occluded", "bridged", "lost".
const char* LesionKindName(LesionKind kind);

/// One narrowing. Degrees are shares of the healthy diameter or area that are gone, 0 to 1.
struct Stenosis
{
  std::int64_t point = -1;            ///< of the tree, the narrowest place
  Vector3 position = Vector3::Zero(); ///< mm
  int treeId = 0;
  int segmentId = 0;
  double abscissaStart = 0.0;   ///< mm from the root: where half of the narrowing is reached
  double abscissaMinimum = 0.0; ///< of the narrowest place
  double abscissaEnd = 0.0;
  double length = 0.0;            ///< mm, from start to end
  double minimumDiameter = 0.0;   ///< mm
  double referenceDiameter = 0.0; ///< mm, of the healthy vessel at the narrowest place
  double populationDiameter =
    0.0;               ///< mm, mean of the segment in men with right dominance; 0: not known
  double degree = 0.0; ///< by diameter
  double areaDegree = 0.0;
  double degreeLow = 0.0; ///< 90 % range of `degree`
  double degreeHigh = 0.0;
  double confidence = 0.0; ///< 0 to 1: less the wider the range, and across bridges theirs
  LesionKind kind = LesionKind::Soft;
  bool bridged = false;      ///< a part of it was not seen but guessed
  bool interpolated = false; ///< calcium hides the narrowest place: the true one may be narrower
};

constexpr double MinimumGradedRadius = 0.75; ///< mm: thinner healthy vessels are not graded

struct StenosisGrading
{
  std::vector<Stenosis> lesions; ///< by tree and abscissa
  std::vector<double> degree; ///< one value a point, by diameter, 0 to 1; 0 where it is not graded
  std::vector<double> referenceRadius; ///< one value a point, mm
};

/**
 * @param lumen  of the same tree
 * @throws std::invalid_argument as CheckTree, or for a lumen of another number of points
 */
StenosisGrading GradeStenoses(
  const VesselTree& tree, const std::vector<VesselPath>& paths, const RefinedLumen& lumen);

/// Mean diameter of a segment in the middle of its length, men with right dominance, mm (Dodge 1992); 0: not known.
double PopulationDiameter(int segmentId);
}

#endif
