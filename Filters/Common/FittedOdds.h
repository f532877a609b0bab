/**
 * @file FittedOdds.h
 * @brief Odds made of weighted signs: logistic regression whose weights scripts/fit-odds.sh fits to phantoms.
 */
#ifndef DynamicCoronary_FittedOdds_h
#define DynamicCoronary_FittedOdds_h

#include <array>
#include <cmath>
#include <cstddef>

namespace coronary
{
/// What a unit of a sign adds to the odds, as a logarithm.
struct FittedSign
{
  const char* name;
  double weight;
};

/// The odds, as a logarithm.
template <std::size_t N>
double FittedOdds(
  double intercept, const std::array<FittedSign, N>& fitted, const std::array<double, N>& signs)
{
  double odds = intercept;
  for (std::size_t n = 0; n < N; ++n)
  {
    odds += fitted[n].weight * signs[n];
  }
  return odds;
}

inline double ProbabilityOf(double odds)
{
  return 1.0 / (1.0 + std::exp(-odds));
}

template <std::size_t N>
std::array<const char*, N> NamesOf(const std::array<FittedSign, N>& fitted)
{
  std::array<const char*, N> names{};
  for (std::size_t n = 0; n < N; ++n)
  {
    names[n] = fitted[n].name;
  }
  return names;
}
}

#endif
