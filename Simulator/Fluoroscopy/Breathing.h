/**
 * @file Breathing.h
 * @brief How the diaphragm goes up and down, and what of it the heart does.
 */
#ifndef DynamicCoronary_Breathing_h
#define DynamicCoronary_Breathing_h

#include "Geometry.h"

namespace coronary
{
struct BreathingSettings
{
  double rate = 15.0;      ///< breaths a minute; 0: the breath is held
  double amplitude = 10.0; ///< mm that the diaphragm goes down
};

/**
 * Begins at the end of expiration, where volumes of patients lie as they are. The diaphragm's way down is
 * amplitude sin^4(pi t rate): breathers stay longer at the end of expiration. Source: Lujan et al., Med Phys 26 (1999) 715.
 */
class Breathing
{
public:
  static constexpr double FastestRate = 60.0; ///< a minute

  explicit Breathing(const BreathingSettings& settings = {})
    : Settings(settings)
  {
  }

  void Step(double seconds);
  /// Breaths a minute; 0 holds the breath where it is.
  void SetRate(double rate) { this->Settings.rate = rate; }
  double Rate() const { return this->Settings.rate; }

  /// mm that the diaphragm is below its place at the end of expiration.
  double Diaphragm() const;

private:
  BreathingSettings Settings;
  double Phase = 0.0; ///< 0 to 1
};

/// Of what hangs on the diaphragm, LPS, mm.
Vector3 DiaphragmShift(double diaphragm);

/**
 * Of the heart with its vessels and what is in them: 0.6 of the diaphragm's way towards the feet (Danias et al., AJR 172
 * (1999) 1061), and as much towards the chest as 1.3 mm of 4.9 (Shechter et al., IEEE TMI 23 (2004) 1046, coronary
 * angiograms of ten patients who breathed). Its rotation of 1.5 degrees is left out.
 */
Vector3 HeartShift(double diaphragm);
}

#endif
