/**
 * @file Ischaemia.h
 * @brief What a territory without blood does to the electrocardiogram: the ST segment rises, and comes back.
 */
#ifndef DynamicCoronary_Ischaemia_h
#define DynamicCoronary_Ischaemia_h

#include "CoronaryFlow.h"

#include <vector>

namespace coronary
{
/**
 * Each tip of the arteries stands for as much heart as it takes blood. It lacks blood when it gets less than its widest
 * microcirculation could make up for (CoronaryFlow::LeastSupply), and less than when the session began: what a lesion leaves
 * is what its territory lives with. Its injury then grows towards the part that it lacks, and heals with blood; the ST
 * segment shifts by the sum of injury times heart.
 *
 * Calibrated on occlusions of Griffin et al. 1987 (30 s of balloon; ST up by 0.1 mV after 19 +- 12 s, back 20 +- 9 s
 * later): two time constants that give 19 and 20 s where 40 % of the flow are cut off. The shift of a whole heart without
 * blood, 1 mV, is chosen.
 */
class Ischaemia
{
public:
  static constexpr double Elevated = 0.1; ///< mV that are told
  static constexpr double Back =
    0.08; ///< mV below which they are over: what hovers about a limit is told once

  explicit Ischaemia(const CoronaryFlow& flow);

  /// With the lumen as it is now.
  void SetFlow(const CoronaryFlow& flow);
  /// @param seconds  since the last step, at least 0
  void Step(double seconds);

  double StShift() const; ///< mV, at least 0
  /// From `Elevated` on, until it is below `Back`.
  bool IsElevated() const { return this->Up; }
  /// Of the heart that the arteries here supply: how much lacks blood now, 0 to 1.
  double ShareWithout() const;
  /// Branches whose tips lack blood, those with most heart first.
  std::vector<int> BranchesWithout() const;

private:
  struct Tip
  {
    int node = 0;
    int branch = 0;
    double share = 0.0;  ///< of the heart
    double needs = 0.0;  ///< of its flow without lesions
    double lacks = 0.0;  ///< of what it needs, 0 to 1
    double injury = 0.0; ///< 0 to 1
  };
  std::vector<Tip> Tips;
  bool Up = false;
};
}

#endif
