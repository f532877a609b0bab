/**
 * @file ContactSurface.h
 * @brief What a rod can touch: where, how deep, and how what is touched moves.
 */
#ifndef DynamicCoronary_ContactSurface_h
#define DynamicCoronary_ContactSurface_h

#include "Geometry.h"

#include <array>
#include <cstdint>

namespace coronary
{
/// One touched plane.
struct ContactPlane
{
  Vector3 normal = Vector3::UnitZ(); ///< unit, away from the material into the free space
  double gap = 0.0; ///< from the instrument's surface to the wall, mm; negative: inside the wall
  Vector3 wallVelocity = Vector3::Zero(); ///< of the wall's material there, mm/s
  double friction = 0.0;                  ///< Coulomb's coefficient of the pair, 0 or more
  double stiffness = 20.0;                ///< N/mm, positive
  int identity =
    0; ///< distinguishes the planes of one sample; a plane keeps its own while it lasts
};

/// The planes that one sample of a rod touches, or is about to touch.
struct SampleContacts
{
  std::array<ContactPlane, 2> plane;
  int count = 0;
};

/// A round sample of an instrument.
struct ContactSample
{
  std::int64_t index = 0; ///< names the place of the instrument: the same material at every step
  Vector3 centre = Vector3::Zero();
  double radius = 0.0;   ///< mm
  double friction = 0.0; ///< the instrument's own coefficient
};

/// Geometry that an instrument can touch at the moment that was set last.
class ContactSurface
{
public:
  virtual ~ContactSurface() = default;

  /**
   * Planes within `reach` of the sample's surface (and those that it is inside of).
   *
   * An implementation may keep what it found for `sample.index`, so the order of calls may matter for speed,
   * never for the result.
   */
  virtual void Find(const ContactSample& sample, double reach, SampleContacts& contacts) = 0;
};
}

#endif
