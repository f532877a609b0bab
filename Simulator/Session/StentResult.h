/**
 * @file StentResult.h
 * @brief What a stent in the wall is: how wide, how close to the wall, and where.
 */
#ifndef DynamicCoronary_StentResult_h
#define DynamicCoronary_StentResult_h

#include "BalloonOnWire.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// Diameters in mm.
struct StentRingResult
{
  std::int64_t point = 0;  ///< of the axes
  int branch = -1;         ///< of the axes
  double place = 0.0;      ///< mm from the ostium
  double diameter = 0.0;   ///< inside
  double lumen = 0.0;      ///< of the vessel around it
  double reference = 0.0;  ///< of the vessel without its lesion
  double gap = 0.0;        ///< mm from its outside to the wall
  double Expansion() const ///< of the area, over that of the reference
  {
    return this->diameter * this->diameter / (this->reference * this->reference);
  }
  double Area() const; ///< mm^2, inside
};

struct StentResult
{
  std::string name;   ///< of its balloon
  std::string vessel; ///< of the segment at its middle
  double from = 0.0;  ///< mm from the ostium
  double to = 0.0;
  std::vector<StentRingResult> rings; ///< from the ostium on
  double residual = 0.0;     ///< greatest stenosis of the lumen along it, of the diameter, 0 to 1
  double malapposed = 0.0;   ///< mm along it with a gap beyond GapTold
  double beyond = 0.0;       ///< mm of it that have no vessel around
  bool missedAll = false;    ///< there are lesions, and it covers none
  double missedBefore = 0.0; ///< mm of the disease before its end near the ostium
  double missedBehind = 0.0; ///< mm behind the other end

  static constexpr double GapTold = 0.3;       ///< mm
  static constexpr double ExpansionTold = 0.8; ///< below
  static constexpr double MissTold = 2.0;      ///< mm

  ///@{
  /// Of the ring in question; null: it has none.
  const StentRingResult* Narrowest() const;
  const StentRingResult* LeastExpanded() const;
  const StentRingResult* GreatestGap() const;
  ///@}
};

/// Without what it has missed, names and branches.
StentResult MeasureStent(const PlacedStent& stent, const DilatableWall& wall);
}

#endif
