/**
 * @file BifurcationFit.h
 * @brief The axes of a bifurcation, by the surface of two tubes that run into one another.
 *
 * Inside the parent's lumen no section is the daughter's alone, and the sections of the vessel that goes straight on are drawn
 * towards the mouth. But what the wall around the mouth looks like depends on where both axes run: the outer
 * wall of the parent, the daughter's wall down to both corners of the mouth, and the carina. A tube along a Bezier
 * curve for each vessel, the daughter's beginning on the other one's, and an edge rounded by a radius of its own between them (a
 * union with a circular fillet) are fitted to points on the wall.
 */
#ifndef DynamicCoronary_BifurcationFit_h
#define DynamicCoronary_BifurcationFit_h

#include "LumenMeasurement.h"

#include <array>
#include <cstddef>
#include <vector>

namespace coronary
{
/// Axes before the fit, mm, in steps much shorter than a radius.
struct BifurcationAxes
{
  std::vector<Vector3> through;      ///< parent and the daughter that goes straight on
  std::vector<double> throughRadius; ///< one a point
  std::size_t fork = 0;              ///< index in `through`
  std::vector<Vector3> side;         ///< the other daughter, from the fork on
  std::vector<double> sideRadius;
};

/// Four points of a cubic Bezier curve.
using BezierCurve = std::array<Vector3, 4>;

/// t is 0 to 1.
Vector3 BezierPoint(const BezierCurve& curve, double t);

struct BifurcationFit
{
  bool found = false;
  // What the fit replaces: the points of `through` from `first` to `last`, those of `side` up to `end`.
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t end = 0;
  BezierCurve through;     ///< from `first` to `last`
  BezierCurve side;        ///< from the fork to `end`
  double meeting = 0.0;    ///< of the fork, parameter of `through`
  double radius = 0.0;     ///< of the parent, mm
  double sideRadius = 0.0; ///< of the daughter at the side, mm
  double rounding = 0.0;   ///< radius of the edge in daughter's radii
  double deviation = 0.0;  ///< of the fork along `through`, standard deviation by the fit, mm
  double turn = 0.0;       ///< of the side daughter more than of the other one, radians
  double misfit = 0.0;     ///< root of the mean of squares, outliers limited, voxels
};

/**
 * Fits both axes around a bifurcation to the wall, for images and not for fixed levels.
 *
 * The wall, and the fork as it was given, are weighed by their variances.
 * @param minimumTurn  radians that the side daughter turns by more than the other one: less is not fitted
 * @returns not found where an axis ends too near, the daughters do not part, or the wall is not that of
 *          two tubes
 */
BifurcationFit FitBifurcation(const ImageInterpolator& image, const BifurcationAxes& axes,
  const LumenSettings& settings, double minimumTurn);
}

#endif
