/**
 * @file SessionInput.h
 * @brief What a trainee's hands and feet do, at one tick, whatever device they are on.
 */
#ifndef DynamicCoronary_SessionInput_h
#define DynamicCoronary_SessionInput_h

#include "DriveInput.h"
#include "Geometry.h"

#include <cstdint>

namespace coronary
{
/// Bits of SessionInput::pedals.
enum Pedal : std::uint32_t
{
  FluoroscopyPedal = 1U,
  CinePedal = 2U,
  MaskPedal = 4U ///< takes the mask of a subtracted image, or of a roadmap
};

/// Places, not movements, so that an input that is lost loses nothing: those of the instruments and the syringe are
/// counted from the start of the session, those of C-arm and table are what they are.
struct SessionInput
{
  DriveInput drive;
  double syringe =
    0.0; ///< mL pushed out since the start; going back refills the syringe and sucks nothing
  std::uint32_t pedals = 0;         ///< bits of Pedal
  double primary = 0.0;             ///< of the C-arm, radians, LAO positive
  double secondary = 0.0;           ///< radians, cranial positive
  double sourceToDetector = 1100.0; ///< mm
  Vector3 table{ Vector3::Zero() }; ///< mm that the isocentre is moved in the patient, LPS
};
}

#endif
