/**
 * @file CurveGeometry.h
 * @brief Frenet frame, curvature and torsion of a sampled space curve with noise.
 *
 * Curvature needs the second derivative of the curve and torsion the third; finite differences of
 * a measured centerline give mostly noise. Here a quintic smoothing spline is fitted: the curve f
 * that minimises sum |f(t_i) - p_i|^2 + lambda * integral |f'''|^2, in the basis of quintic
 * B-splines. Where the noise is not known, lambda is found by generalised cross-validation
 * (Craven and Wahba, Numer Math 1979;31:377), with the degrees of freedom counted 1.4 times against
 * undersmoothing (Kim and Gu, J R Stat Soc B 2004;66:337). The parameter t is the arc length of the
 * fitted curve, found in a few rounds, because the chords of noisy points are too long.
 */
#ifndef DynamicCoronary_CurveGeometry_h
#define DynamicCoronary_CurveGeometry_h

#include "Geometry.h"

#include <vector>

namespace coronary
{
/// How much a curve is smoothed before it is differentiated.
struct CurveSmoothing
{
  /// Wavelength that is halved by the smoothing, in the unit of the points; much longer ones pass
  /// unchanged, much shorter ones vanish. Negative: found from the points themselves.
  double wavelength = -1.0;

  /// Lower limit of the wavelength that is found, in the unit of the points.
  double minimumWavelength = 0.0;
};

/// One value a point of the curve.
struct CurveGeometry
{
  std::vector<Vector3> position; ///< on the smooth curve
  std::vector<Vector3> tangent;  ///< unit vector towards the curve's end
  std::vector<Vector3> normal;   ///< unit vector to the centre of curvature; where the curve is
                                 ///< straight, carried on from the nearest bend without twist
  std::vector<Vector3> binormal; ///< tangent x normal
  std::vector<double> curvature; ///< 1 / radius of the osculating circle, not negative
  std::vector<double> torsion;   ///< rate at which the binormal turns, positive for a right-handed
                                 ///< helix; drawn to 0 where the curvature is not above its error
  std::vector<double> arcLength; ///< of the smooth curve, from its first point
  double wavelength = 0.0;       ///< that was used
};

/**
 * Differential geometry of the curve through `points`.
 *
 * Two points give a straight line; a single or several coincident points give the x axis as
 * tangent. The result does not depend on rotation, and scales with the points.
 * @param points  in order along the curve, not necessarily evenly spaced; coincident neighbours
 *                are allowed
 * @throws std::invalid_argument for no points, or a coordinate or setting that is not finite
 */
CurveGeometry ComputeCurveGeometry(
  const std::vector<Vector3>& points, const CurveSmoothing& smoothing = {});

/// Sum of the lengths of the polyline's steps.
double PolylineLength(const std::vector<Vector3>& points);

/**
 * Length over distance of the ends, minus 1 (VMTK's definition): 0 for a straight line.
 * A closed or point-like curve has no chord and gives 0.
 */
double PolylineTortuosity(const std::vector<Vector3>& points);
}

#endif
