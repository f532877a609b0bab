/**
 * @file DriveInput.h
 * @brief What hands do to the instruments.
 */
#ifndef DynamicCoronary_DriveInput_h
#define DynamicCoronary_DriveInput_h

namespace coronary
{
/// What hands do, in one tick: where the proximal ends of the instruments are.
struct DriveInput
{
  double wirePosition = 0.0; ///< mm advanced since the start
  double wireAngle = 0.0;    ///< radians turned since the start, right-handed about the way forward
  double catheterPosition =
    0.0;                      ///< mm the catheter's tip is advanced into the vessel since the start
  double catheterAngle = 0.0; ///< radians
  double inflation = 0.0;     ///< atm at the balloon's inflator
  double balloonPosition = 0.0; ///< mm the balloon is advanced since the start
};
}

#endif
