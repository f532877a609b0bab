/**
 * @file MeasuredLesions.h
 * @brief Lumen, calcium and narrowings along a tree as the product measures them, and which of a phantom's lesions they are.
 */
#ifndef DynamicCoronary_MeasuredLesions_h
#define DynamicCoronary_MeasuredLesions_h

#include "CoronaryPhantom.h"
#include "LumenRefinement.h"
#include "StenosisGrading.h"

#include <string>
#include <vector>

namespace coronary
{
struct MeasuredLesions : TreeLumen
{
  VesselTree refined;      ///< the given tree with this lumen
  StenosisGrading grading; ///< of the refined tree
};

/// @param blur  standard deviation of the image's blur, mm, positive
/// @throws std::invalid_argument as CheckTree
MeasuredLesions MeasureLesions(const VesselTree& tree, const ScalarImage& image, double blur);

/// What became of a true lesion.
struct LesionMatch
{
  PhantomStenosis truth;
  int lesion = -1;       ///< index of the one that was measured, -1: none
  bool reached = false;  ///< the tree comes within 1.5 mm
  double distance = 0.0; ///< mm, to the measured one
  double error =
    0.0; ///< of the degree by diameter; of one that is not listed, its whole degree is missing
  bool inRange = false; ///< the true degree lies in the stated range

  /// 1 mm or more is left: wide enough to be measured by its edge.
  bool Wide() const { return this->truth.minimumRadius >= 0.5; }
  /// Healthy, the vessel is as wide as those that are graded.
  bool Graded() const { return this->truth.referenceRadius >= MinimumGradedRadius; }
};

/// Each true lesion with the nearest measured one within 6 mm that is not another's.
std::vector<LesionMatch> MatchLesions(const std::vector<PhantomStenosis>& truth,
  const std::vector<Vector3>& treePoints, const std::vector<Stenosis>& measured);

/// How well degrees are measured.
struct DegreeTally
{
  static constexpr double MaximumError = 0.10; ///< of the diameter, absolute

  int listed = 0;
  int within = 0;  ///< MaximumError
  int inRange = 0; ///< the true degree lies in the stated range
  double sum = 0.0;
  int unreached = 0; ///< lesions without a tree
  int unlisted = 0;  ///< reached, but not listed

  void Add(const LesionMatch& match);
  void Add(const DegreeTally& other);
  int Lesions() const { return this->listed + this->unreached + this->unlisted; }
};

/// "97 %" of a part of a whole, "-" of none.
std::string ShareText(int part, int whole);
}

#endif
