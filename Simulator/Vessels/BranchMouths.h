/**
 * @file BranchMouths.h
 * @brief How the mouth of a side branch is narrowed by what opens the vessel that it leaves: carina and plaque shift.
 */
#ifndef DynamicCoronary_BranchMouths_h
#define DynamicCoronary_BranchMouths_h

#include "DilatableWall.h"
#include "WallMotion.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace coronary
{
/// Of a side branch, against the vessel that goes on beside it.
struct BranchMouth
{
  int branch = -1;
  int beside = -1;      ///< that the vessel goes on as
  double cosine = 0.0;  ///< of the angle between parent and branch
  std::int64_t at = -1; ///< point of the axes where they part
  std::vector<std::pair<std::int64_t, double>>
    own;                            ///< its points, and how much of the narrowing each has
  std::vector<std::int64_t> before; ///< points of the parent at the mouth
  std::vector<std::int64_t> beyond; ///< points beside it
  double parentRadius = 0.0;        ///< mm, references
  double besideRadius = 0.0;
  double degreeBefore = 0.0; ///< of the diameter, narrowest place, when the session began
  double shift = 0.0;        ///< how far the carina is over the mouth, 0 to 1
  double degree = 0.0;       ///< narrowest place now
  bool closed = false;       ///< no blood comes in
};

/**
 * Vassilev and Gil (J Interv Cardiol 2008;21:493; 57 lesions, r^2 0.82): a stent in the parent as wide as that leaves a branch
 * at an angle a to it a stenosis of cos a of its diameter. Here the shift is 0 where the vessel beside the mouth has its own
 * calibre and 1 where it has the parent's, linear between (chosen); what a stent holds stays, what a balloon does goes with it.
 * From their cut-off of 70 % on a branch closes that no wire is in; with one it keeps LeastRadius (chosen). A balloon in the
 * mouth opens it.
 */
class BranchMouths
{
public:
  static constexpr double ClosesAt = 0.7;     ///< of the diameter
  static constexpr double LeastRadius = 0.36; ///< mm, beside a wire
  static constexpr double ReopenedAt = 0.5;   ///< of the diameter, that a balloon leaves open

  BranchMouths() = default;
  explicit BranchMouths(const WallTopology& topology);

  /// After balloons and stents have moved the wall. @param within  branches that wires' tips are in; -1: in none
  void Answer(const std::vector<int>& within, DilatableWall& wall);

  const std::vector<BranchMouth>& All() const { return this->Mouths; }

private:
  void Add(const WallTopology& topology, const std::vector<std::vector<double>>& reference,
    int branch, int beside);
  bool IsBehind(int branch, int ancestor) const;
  void Answer(BranchMouth& mouth, bool wired, DilatableWall& wall) const;

  std::vector<int> Parent;
  std::vector<BranchMouth> Mouths;
};
}

#endif
