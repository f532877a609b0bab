/**
 * @file RisingRoot.h
 * @brief The root of a rising function.
 */
#ifndef DynamicCoronary_RisingRoot_h
#define DynamicCoronary_RisingRoot_h

namespace coronary
{
/// The root of a rising function between two values (Illinois); the end that is nearer to it where there is none.
template <typename Function>
double RisingRoot(const Function& function, double low, double high, double tolerance)
{
  double atLow = function(low);
  double atHigh = function(high);
  if (atLow >= 0.0 || atHigh <= 0.0)
  {
    return atLow >= 0.0 ? low : high;
  }
  for (int k = 0, side = 0; k < 60 && high - low > tolerance; ++k)
  {
    const double middle = (low * atHigh - high * atLow) / (atHigh - atLow);
    const double value = function(middle);
    if (value == 0.0)
    {
      return middle;
    }
    if (value > 0.0)
    {
      high = middle;
      atHigh = value;
      atLow *= side > 0 ? 0.5 : 1.0;
      side = 1;
    }
    else
    {
      low = middle;
      atLow = value;
      atHigh *= side < 0 ? 0.5 : 1.0;
      side = -1;
    }
  }
  return 0.5 * (low + high);
}
}

#endif
