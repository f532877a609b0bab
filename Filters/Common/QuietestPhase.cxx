#include "QuietestPhase.h"

#include "CyclicTime.h"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double MidDiastole = 0.75;

double MeanDifference(const std::vector<float>& a, const std::vector<float>& b)
{
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t n = 0; n < a.size(); ++n)
  {
    const double difference = std::abs(static_cast<double>(a[n]) - static_cast<double>(b[n]));
    if (std::isfinite(difference))
    {
      sum += difference;
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}
}

std::size_t QuietestPhase(
  const std::vector<double>& times, const std::vector<std::vector<float>>& samples)
{
  if (times.empty() || times.size() != samples.size())
  {
    throw std::invalid_argument("QuietestPhase: there must be one sample of at least one phase");
  }
  for (std::size_t n = 1; n < times.size(); ++n)
  {
    if (!(times[n] > times[n - 1]) || samples[n].size() != samples[0].size())
    {
      throw std::invalid_argument(
        "QuietestPhase: times must increase, and samples have the same length");
    }
  }
  const std::size_t last = times.size() - 1;
  std::size_t quietest = 0;
  double minimum = std::numeric_limits<double>::max();
  double before = 0.0;
  for (std::size_t n = 0; n < last + 1; ++n)
  {
    const double after = n < last ? MeanDifference(samples[n], samples[n + 1]) : 0.0;
    const double span = times[n < last ? n + 1 : n] - times[n > 0 ? n - 1 : n];
    const double motion = span > 0.0 ? (before + after) / span : 0.0;
    const double toRest = CyclicDistance(times[n], MidDiastole);
    if (motion < minimum ||
      (motion == minimum && toRest < CyclicDistance(times[quietest], MidDiastole)))
    {
      minimum = motion;
      quietest = n;
    }
    before = after;
  }
  return quietest;
}
}
