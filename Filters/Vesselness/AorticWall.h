/**
 * @file AorticWall.h
 * @brief The wall of the aortic root and of the ascending aorta in a contrast-enhanced CT, as cross-sections.
 *
 * The aorta that FindCoronaryOstia found is followed to where the image ends. In planes square to it, rays from the axis
 * end where the image is half way from the blood to what lies behind; a smooth surface is fitted to these places, which
 * also spans the mouths of the coronary arteries and where another chamber lies against the wall. It begins at the
 * valve's plane: at the narrowest section 8 to 22 mm below the lower ostium, or 14 mm below it when none is narrower
 * than both its sides.
 */
#ifndef DynamicCoronary_AorticWall_h
#define DynamicCoronary_AorticWall_h

#include "AorticModel.h"
#include "CoronaryOstia.h"

#include <optional>
#include <string>
#include <vector>

namespace coronary
{
struct AorticWall
{
  std::vector<AorticRing> rings; ///< from the valve upwards, about 1 mm apart; empty: there is none
  std::string why;               ///< empty, or why there is none, after "no wall of the aorta: "
  double seen = 0.0;             ///< share of the rays that meet the wall where the surface is
  bool annulus = false;  ///< whether the valve's plane was seen; else it is where it usually is
  bool toBorder = false; ///< whether it ends at the image's border, else where the wall is lost
};

/// mm of axis from the lower ostium down to the valve, where no narrowest section tells (chosen: 12 to 17 mm is usual).
constexpr double ValveBelowOstia = 14.0;

/**
 * @param image  HU, LPS
 * @param found  in this image
 */
AorticWall MeasureAorticWall(const ScalarImage& image, const CoronaryOstia& found);

/// The line along which the descending aorta was found; nothing: it was not.
std::optional<DescendingAorta> DescendingLine(const CoronaryOstia& found);
}

#endif
