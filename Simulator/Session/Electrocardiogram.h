/**
 * @file Electrocardiogram.h
 * @brief The trace on the monitor: a lead of the electrocardiogram as a function of the cardiac phase.
 */
#ifndef DynamicCoronary_Electrocardiogram_h
#define DynamicCoronary_Electrocardiogram_h

#include <array>
#include <cmath>

namespace coronary
{
/**
 * Waves P, Q, R, S, T as bells about their places in the cycle, with the parameters of McSharry et al. 2003 (IEEE
 * Trans Biomed Eng 50:289, table I), the bells summed directly instead of by their differential equation. For the eye.
 * @param phase  fraction of the R-R interval, the R wave at 0; any real number
 * @return mV, about -0.2 to 1.1
 */
inline double ElectrocardiogramAt(double phase)
{
  struct Wave
  {
    double angle;  // radians from the R wave
    double height; // mV
    double width;  // radians
  };
  constexpr std::array<Wave, 5> waves{ Wave{ -M_PI / 3.0, 0.12, 0.25 },
    Wave{ -M_PI / 12.0, -0.13, 0.1 }, Wave{ 0.0, 1.1, 0.1 }, Wave{ M_PI / 12.0, -0.22, 0.1 },
    Wave{ M_PI / 2.0, 0.28, 0.4 } };
  double sum = 0.0;
  for (const Wave& wave : waves)
  {
    const double turn = phase - wave.angle / (2.0 * M_PI);
    const double away = 2.0 * M_PI * (turn - std::round(turn));
    sum += wave.height * std::exp(-0.5 * away * away / (wave.width * wave.width));
  }
  return sum;
}
}

#endif
