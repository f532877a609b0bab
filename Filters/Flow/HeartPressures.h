/**
 * @file HeartPressures.h
 * @brief Pressures in the aorta and the left ventricle over the cycle, by a few numbers.
 */
#ifndef DynamicCoronary_HeartPressures_h
#define DynamicCoronary_HeartPressures_h

namespace coronary
{
/// mmHg and fractions of R-R; phase 0 is the R wave.
struct HeartPressures
{
  double systolic = 120.0; ///< aortic
  double diastolic = 80.0; ///< aortic
  double ejectionBegin = 0.05;
  double systoleEnd = 0.35; ///< the aortic valve closes

  /// In the aorta's root at a phase (modulo 1). Rises and falls by half cosines in ejection, and exponentially falls in
  /// diastole.
  double Aortic(double phase) const;
  /// In the left ventricle: the aortic one in ejection, 5 to 8 mmHg in filling.
  double Ventricular(double phase) const;
};
}

#endif
