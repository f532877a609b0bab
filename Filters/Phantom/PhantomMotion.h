/**
 * @file PhantomMotion.h
 * @brief The phantom's heart frame and its closed-form motion.
 */
#ifndef DynamicCoronary_PhantomMotion_h
#define DynamicCoronary_PhantomMotion_h

#include "CoronaryPhantom.h"
#include "SmoothRandomField.h"

namespace coronary
{
/// A C2 step from 0 (u <= 0) to 1 (u >= 1).
inline double SmoothStep(double u)
{
  u = u < 0.0 ? 0.0 : (u > 1.0 ? 1.0 : u);
  return u * u * u * (10.0 + u * (6.0 * u - 15.0));
}

/**
 * Axes of the heart: a from the RCA side to the LCx side, b upwards, c from the base to the apex,
 * with the atrioventricular plane at c = 0. Fitted to Dodge's points (plane RMS 1.5 mm, ellipsoid
 * RMS 3.3 mm). Lengths are those of the mean heart; `size` scales all of them.
 */
struct HeartFrame
{
  explicit HeartFrame(double heartSize = 1.0);

  Vector3 ToHeart(const Vector3& world) const;
  Vector3 ToWorld(const Vector3& heart) const;

  /// Level of the epicardial ellipsoid at heart coordinates: 1 on it, below 1 inside.
  static double Level(const Vector3& heart);

  /// The point of the ellipsoid at an azimuth about c (degrees, 0 = a, 90 = b) and height c.
  static Vector3 OnEpicardium(double azimuthDegrees, double c);

  static const Vector3 Centre;               ///< of the ellipsoid, heart coordinates, mm
  static const Vector3 Radii;                ///< mm
  static constexpr double ApexHeight = 91.5; ///< c of the apex, mm

  double size = 1.0;
  Vector3 origin; ///< world, mm
  Matrix3 axes;   ///< rows a, b, c
};

/// Position and velocity of material points. PhantomMotion.cxx has the formulas.
class PhantomMotion
{
public:
  PhantomMotion(const PhantomSettings& settings, const HeartFrame& frame);

  /// How far the whole heart lies off, mm, in the beat in which the phase `t` is seen; zero without irregularity.
  Vector3 BeatShift(double t) const;

  /// World position of a material point, mm, in a beat that is off by `shift`; its velocity in mm/s
  /// when asked for.
  Vector3 Position(
    const Vector3& reference, double t, const Vector3& shift, Vector3* velocity = nullptr) const;

  /// Unit normal, at time t, of the material plane that rests at `reference` with unit `normal`.
  Vector3 PlaneNormal(
    const Vector3& reference, const Vector3& normal, double t, const Vector3& shift) const;

  /**
   * Material point at `position`: fixed-point iteration, starting from `guess`.
   * The field's displacement gradient stays below 1, so that the iteration contracts.
   */
  Vector3 ReferencePosition(const Vector3& position, double t, const Vector3& shift,
    const Vector3& guess, double tolerance) const;

  /// Contraction s(t): about 0 at end diastole, 1 at end systole (35 %); periodic.
  static double Activation(double t, double* derivative = nullptr);

  /// Systolic pulse of the lumen area, 0..1, periodic, 1 at 32 %.
  static double PressurePulse(double t);

private:
  double BeatFactor(double t) const;

  const PhantomSettings& Settings;
  HeartFrame Frame;
  SmoothRandomField Amplitude;
};
}

#endif
