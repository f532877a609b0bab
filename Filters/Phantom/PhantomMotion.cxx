#include "PhantomMotion.h"

#include "CounterRandom.h"
#include "Numbers.h"

#include <Eigen/Geometry>

#include <cmath>
#include <cstring>

// With S = s(t - lag(X)) (1 + amplitude(X)), w from 0 (RCA side) to 1 (LCx side), z01 = (91.5 - c) / 91.5 limited to
// 0..1 by a smooth clamp:
// axial: A(w) S z01 towards the apex, A from 18 mm (right) to 12 mm (left); 55 % less over 25 mm above the AV plane;
// radial: distance from the axis times 1 - 0.10 S sin(pi (0.15 + 0.85 z01)); twist: (9 - 13 z01) degrees times S about
// the axis;
// all fades to zero between 1.3 and 2.5 times the epicardial ellipsoid; lag up to 2 % R-R (right and inferior later),
// amplitude 6 % with 40 mm correlation.

namespace coronary
{
namespace
{
constexpr std::uint64_t AmplitudePurpose = 201;
constexpr std::uint64_t BeatPurpose = 202;
constexpr std::uint64_t ShiftPurpose = 203;

/// 0 below, u inside, 1 above, without a corner: the clamp of the motion's formula, made smooth.
double SoftClamp(double u)
{
  constexpr double sharpness = 25.0;
  const auto softPlus = [](double x) { return x > 30.0 ? x : std::log1p(std::exp(x)); };
  return (softPlus(sharpness * u) - softPlus(sharpness * (u - 1.0))) / sharpness;
}
}

const Vector3 HeartFrame::Centre(-3.9, -2.2, 29.8);
const Vector3 HeartFrame::Radii(54.2, 41.7, 58.0);

HeartFrame::HeartFrame(double heartSize)
  : size(heartSize)
  , origin(Vector3(-7.8, -9.8, -38.8) * heartSize)
{
  // Base to apex, then RCA side to LCx side; orthonormal to the last digit.
  const Vector3 c = Vector3(0.680, -0.681, -0.273).normalized();
  Vector3 a(0.730, 0.591, 0.343);
  a = (a - a.dot(c) * c).normalized();
  this->axes.row(0) = a;
  this->axes.row(1) = c.cross(a);
  this->axes.row(2) = c;
}

Vector3 HeartFrame::ToHeart(const Vector3& world) const
{
  return this->axes * (world - this->origin) / this->size;
}

Vector3 HeartFrame::ToWorld(const Vector3& heart) const
{
  return this->origin + this->axes.transpose() * heart * this->size;
}

double HeartFrame::Level(const Vector3& heart)
{
  return (heart - Centre).cwiseQuotient(Radii).norm();
}

Vector3 HeartFrame::OnEpicardium(double azimuthDegrees, double c)
{
  const double azimuth = azimuthDegrees * Pi / 180.0;
  const Vector3 ray(std::cos(azimuth), std::sin(azimuth), 0.0);
  // Solve |(ray * rho + (0, 0, c) - Centre) / Radii| = 1 for the far root.
  const Vector3 u = ray.cwiseQuotient(Radii);
  const Vector3 v = (Vector3(0.0, 0.0, c) - Centre).cwiseQuotient(Radii);
  const double b = u.dot(v) / u.squaredNorm();
  const double q = (v.squaredNorm() - 1.0) / u.squaredNorm();
  const double rho = -b + std::sqrt(std::max(0.0, b * b - q));
  return ray * rho + Vector3(0.0, 0.0, c);
}

PhantomMotion::PhantomMotion(const PhantomSettings& settings, const HeartFrame& frame)
  : Settings(settings)
  , Frame(frame)
{
  if (settings.seed != 0 && settings.regionalAmplitude > 0.0)
  {
    this->Amplitude = SmoothRandomField(settings.seed, AmplitudePurpose, 40.0, 16);
  }
}

double PhantomMotion::Activation(double t, double* derivative)
{
  // Fourier series fitted so that rest windows and speeds agree with Shechter 2005 and Mao 2000.
  constexpr double mean = 0.4153;
  constexpr double cosine[8] = { -0.2948, -0.1180, 0.0102, -0.0191, 0.0030, 0.0042, -0.0011,
    0.0024 };
  constexpr double sine[8] = { 0.2935, -0.1000, 0.0139, -0.0076, -0.0082, 0.0007, -0.0008,
    -0.0012 };
  const double angle = 2.0 * Pi * t;
  const double c1 = std::cos(angle);
  const double s1 = std::sin(angle);
  double c = 1.0;
  double s = 0.0;
  double value = mean;
  double slope = 0.0;
  for (int k = 0; k < 8; ++k)
  {
    const double next = c * c1 - s * s1;
    s = s * c1 + c * s1;
    c = next;
    value += cosine[k] * c + sine[k] * s;
    slope += 2.0 * Pi * (k + 1) * (sine[k] * c - cosine[k] * s);
  }
  if (derivative)
  {
    *derivative = slope;
  }
  return value;
}

double PhantomMotion::PressurePulse(double t)
{
  // A von Mises bump: smooth, periodic, full width at half maximum near 40 % of the cycle.
  constexpr double concentration = 1.8;
  const double low = std::exp(-2.0 * concentration);
  const double bump = std::exp(concentration * (std::cos(2.0 * Pi * (t - 0.32)) - 1.0));
  return (bump - low) / (1.0 - low);
}

double PhantomMotion::BeatFactor(double t) const
{
  if (this->Settings.beatVariation <= 0.0)
  {
    return 1.0;
  }
  const auto beat = static_cast<std::int64_t>(std::floor(t));
  RandomStream random(this->Settings.seed, BeatPurpose + static_cast<std::uint64_t>(beat) * 7919);
  return 1.0 + this->Settings.beatVariation * random.Normal(2.0);
}

Vector3 PhantomMotion::BeatShift(double t) const
{
  Vector3 shift = Vector3::Zero();
  if (this->Settings.beatIrregularity > 0.0)
  {
    // A phase is its time to the last bit: no two share a beat.
    std::uint64_t key = 0;
    const double exactTime = t == 0.0 ? 0.0 : t; // one zero
    std::memcpy(&key, &exactTime, sizeof(key));
    RandomStream random(this->Settings.seed, MixBits(key) + ShiftPurpose);
    for (double& component : shift)
    {
      component = random.Normal() * this->Settings.beatIrregularity / std::sqrt(3.0);
    }
  }
  return shift;
}

Vector3 PhantomMotion::Position(
  const Vector3& reference, double t, const Vector3& shift, Vector3* velocity) const
{
  const Vector3 q = this->Frame.ToHeart(reference);
  const double far = 1.0 - SmoothStep((HeartFrame::Level(q) - 1.3) / 1.2);
  if (far <= 0.0)
  {
    if (velocity)
    {
      velocity->setZero();
    }
    return reference;
  }

  // Regions do not contract as one: the right and the inferior side come later, and every region
  // has an amplitude of its own. Without that all motion would be of rank one.
  const double later = this->Settings.seed == 0
    ? 0.0
    : this->Settings.regionalLag * std::tanh(-0.8 * q[0] / 45.0 - 0.5 * q[1] / 40.0);
  const double amplitude = this->Settings.motionAmplitude * this->BeatFactor(t - later) *
    (1.0 + this->Settings.regionalAmplitude * std::tanh(this->Amplitude(reference)));
  double slope = 0.0;
  const double contraction = amplitude * Activation(t - later, velocity ? &slope : nullptr);

  const double height = SoftClamp((HeartFrame::ApexHeight - q[2]) / HeartFrame::ApexHeight);
  const double aboveBase = 1.0 - 0.55 * SmoothStep(-q[2] / 25.0);
  const double leftness = SmoothStep((q[0] + 54.0) / 108.0);
  const double excursion = this->Settings.axialMotionRight +
    leftness * (this->Settings.axialMotionLeft - this->Settings.axialMotionRight);

  const double axial = excursion * height * aboveBase;
  const double narrowing = 0.10 * std::sin(Pi * (0.15 + 0.85 * height));
  const double twist = (9.0 - 13.0 * height) * aboveBase * Pi / 180.0;

  const Eigen::Vector2d p(q[0] - HeartFrame::Centre[0], q[1] - HeartFrame::Centre[1]);
  const Eigen::Rotation2Dd rotation(twist * contraction);
  const Eigen::Vector2d turned = rotation * p;
  const Eigen::Vector2d moved = turned * (1.0 - narrowing * contraction);

  // The excursion is in millimetres whatever the heart's size.
  Vector3 u;
  u << (moved - p) * this->Frame.size, axial * contraction;
  if (velocity)
  {
    const double rate = amplitude * slope / this->Settings.cycleLength;
    const Eigen::Vector2d across(-turned[1], turned[0]);
    const Eigen::Vector2d change =
      across * twist * (1.0 - narrowing * contraction) - turned * narrowing;
    Vector3 v;
    v << change * this->Frame.size, axial;
    *velocity = this->Frame.axes.transpose() * v * (far * rate);
  }
  return reference + (this->Frame.axes.transpose() * u + shift) * far;
}

Vector3 PhantomMotion::PlaneNormal(
  const Vector3& reference, const Vector3& normal, double t, const Vector3& shift) const
{
  constexpr double h = 1e-3;
  const Vector3 u = normal.unitOrthogonal();
  const Vector3 v = normal.cross(u);
  const Vector3 alongU =
    this->Position(reference + h * u, t, shift) - this->Position(reference - h * u, t, shift);
  const Vector3 alongV =
    this->Position(reference + h * v, t, shift) - this->Position(reference - h * v, t, shift);
  return alongU.cross(alongV).normalized();
}

Vector3 PhantomMotion::ReferencePosition(const Vector3& position, double t, const Vector3& shift,
  const Vector3& guess, double tolerance) const
{
  Vector3 reference = guess;
  for (int iteration = 0; iteration < 200; ++iteration)
  {
    const Vector3 residual = position - this->Position(reference, t, shift);
    reference += residual;
    if (residual.squaredNorm() < tolerance * tolerance)
    {
      break;
    }
  }
  return reference;
}
}
