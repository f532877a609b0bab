/**
 * @file MotionTestData.h
 * @brief Settings of the regularisation of motion, for the tests.
 */
#ifndef DynamicCoronary_MotionTestData_h
#define DynamicCoronary_MotionTestData_h

#include "MotionRegularization.h"

#include <limits>

/// The default weights, and no limit of bending, curvature, strain and step.
inline coronary::MotionRegularizationSettings NoLimits()
{
  constexpr double infinity = std::numeric_limits<double>::infinity();
  coronary::MotionRegularizationSettings settings;
  settings.maximumBending = EIGEN_PI;
  settings.minimumCurvatureRadius = 0.0;
  settings.maximumStrain = infinity;
  settings.maximumStep = infinity;
  return settings;
}

#endif
