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
 * @param phase    fraction of the R-R interval, the R wave at 0; any real number
 * @param stShift  mV that the trace is lifted by between the S wave and the end of the T wave
 * @return mV, about -0.2 to 1.1 without shift
 */
inline double ElectrocardiogramAt(double phase, double stShift = 0.0)
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
  // Two logistic steps, at the end of the S wave and in the falling part of the T wave.
  const double angle = 2.0 * M_PI * (phase - std::floor(phase));
  double sum =
    stShift / (1.0 + std::exp((0.45 - angle) / 0.04)) / (1.0 + std::exp((angle - 2.0) / 0.12));
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
