#include "HeartPressures.h"

#include "CyclicTime.h"

#include <cmath>

namespace coronary
{
namespace
{
constexpr double EndDiastolicPressure = 8.0;   // left ventricle, mmHg
constexpr double EarlyDiastolicPressure = 5.0; // mmHg
constexpr double RelaxationTime = 0.08;        // isovolumic, fraction of R-R
constexpr double NotchHeight = 0.6; // of the pulse pressure, that is left when the valve closes
constexpr double RunOff = 1.5;      // exponent of the aorta's fall over diastole

/// From `a` at t = 0 to `b` at t = 1, level at both.
double HalfCosine(double a, double b, double t)
{
  return a + (b - a) * 0.5 * (1.0 - std::cos(M_PI * t));
}

/// When the valve closes.
double NotchPressure(const HeartPressures& pressures)
{
  return pressures.diastolic + NotchHeight * (pressures.systolic - pressures.diastolic);
}
}

double HeartPressures::Aortic(double phase) const
{
  const double length = this->systoleEnd - this->ejectionBegin;
  const double since = Modulo(Modulo(phase) - this->ejectionBegin);
  const double notch = NotchPressure(*this);
  if (since < 0.5 * length)
  {
    return HalfCosine(this->diastolic, this->systolic, since / (0.5 * length));
  }
  if (since < length)
  {
    return HalfCosine(this->systolic, notch, since / (0.5 * length) - 1.0);
  }
  const double t = (since - length) / (1.0 - length);
  const double last = std::exp(-RunOff);
  return this->diastolic +
    (notch - this->diastolic) * (std::exp(-RunOff * t) - last) / (1.0 - last);
}

double HeartPressures::Ventricular(double phase) const
{
  const double u = Modulo(phase);
  if (u < this->ejectionBegin)
  {
    return HalfCosine(EndDiastolicPressure, this->diastolic, u / this->ejectionBegin);
  }
  if (u < this->systoleEnd)
  {
    return this->Aortic(u);
  }
  const double relaxed = this->systoleEnd + RelaxationTime;
  if (u < relaxed)
  {
    return HalfCosine(
      NotchPressure(*this), EarlyDiastolicPressure, (u - this->systoleEnd) / RelaxationTime);
  }
  return EarlyDiastolicPressure +
    (EndDiastolicPressure - EarlyDiastolicPressure) * (u - relaxed) / (1.0 - relaxed);
}
}
