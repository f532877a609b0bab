/**
 * @file LumenSight.h
 * @brief What an image shows where lines are said to be: how far beside them a lumen is, and how bright they are.
 */
#ifndef DynamicCoronary_LumenSight_h
#define DynamicCoronary_LumenSight_h

#include "ItemSharing.h"
#include "ParallelFor.h"
#include "Polylines.h"
#include "PoseSequence.h"
#include "ScalarImage.h"

#include <functional>
#include <vector>

namespace coronary
{
/// Where there is no lumen to be seen, mm beside.
inline constexpr double NoLumenBeside = 2.0;

/// Of one phase, per point.
struct LumenSight
{
  std::vector<double>
    beside; ///< mm from the place to the middle of the lumen, NoLumenBeside at most
  std::vector<double>
    contrast; ///< of the place over its surroundings, in the image's values, 0 or more
};

/**
 * Measured in sections about 1 mm apart; points between them have the values of the one before. Points on no line: 0.
 * @param lines   at rest; without radii 1.5 mm
 * @param places  of the same points in the image, mm
 * @throws std::invalid_argument when these are others
 */
LumenSight SeeLumens(
  const ScalarImage& image, const Polylines& lines, const std::vector<Vector3>& places);

/**
 * The same of all phases of lines that move.
 * @param imageAt  gives the image of a time; one that was given before need not stay
 * @param sharing  who reads which phases
 */
std::vector<LumenSight> SeeLumens(const Polylines& lines, const PoseSequence& poses,
  const std::function<ScalarImage(double time)>& imageAt, const ProgressCallback& progress = {},
  ItemSharing& sharing = ItemSharing::None());
}

#endif
