/**
 * @file Dual.h
 * @brief A number with its derivative: what is computed with dual numbers has its exact derivative beside it.
 *
 * Forward mode of automatic differentiation: Griewank & Walther, "Evaluating Derivatives", SIAM 2008,
 * chapter 3.
 */
#ifndef DynamicCoronary_Dual_h
#define DynamicCoronary_Dual_h

#include <Eigen/Core>

#include <cmath>

namespace coronary
{
/// By time, where it is not said otherwise. Numbers without a derivative are constants. Order is that of
/// the values.
struct Dual
{
  double value = 0.0;
  double rate = 0.0;

  Dual() = default;
  Dual(double constant) // NOLINT(google-explicit-constructor)
    : value(constant)
  {
  }
  Dual(double number, double derivative)
    : value(number)
    , rate(derivative)
  {
  }

  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend Dual operator-(const Dual& a) { return { -a.value, -a.rate }; }
  friend Dual operator+(const Dual& a, const Dual& b)
  {
    return { a.value + b.value, a.rate + b.rate };
  }
  friend Dual operator-(const Dual& a, const Dual& b)
  {
    return { a.value - b.value, a.rate - b.rate };
  }
  friend Dual operator*(const Dual& a, const Dual& b)
  {
    return { a.value * b.value, a.rate * b.value + a.value * b.rate };
  }
  friend Dual operator/(const Dual& a, const Dual& b)
  {
    const double quotient = a.value / b.value;
    return { quotient, (a.rate - quotient * b.rate) / b.value };
  }
  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.value >= b.value; }
  /// Of both parts: what is 0 now and changes is not 0.
  friend bool operator==(const Dual& a, const Dual& b)
  {
    return a.value == b.value && a.rate == b.rate;
  }
  friend bool operator!=(const Dual& a, const Dual& b) { return !(a == b); }
};

inline bool isfinite(const Dual& a)
{
  return std::isfinite(a.value) && std::isfinite(a.rate);
}

inline Dual abs(const Dual& a)
{
  return a.value < 0.0 ? -a : a;
}

/// The rate of 0 is 0: where a sum of squares is 0, it is least.
inline Dual sqrt(const Dual& a)
{
  const double root = std::sqrt(a.value);
  return { root, root > 0.0 ? 0.5 * a.rate / root : 0.0 };
}

inline Dual sin(const Dual& a)
{
  return { std::sin(a.value), std::cos(a.value) * a.rate };
}

inline Dual cos(const Dual& a)
{
  return { std::cos(a.value), -std::sin(a.value) * a.rate };
}

/// For a place (x, y) that is not the origin.
inline Dual atan2(const Dual& y, const Dual& x)
{
  return { std::atan2(y.value, x.value),
    (x.value * y.rate - y.value * x.rate) / (x.value * x.value + y.value * y.value) };
}

/// For a base above 0.
inline Dual pow(const Dual& base, double exponent)
{
  const double power = std::pow(base.value, exponent);
  return { power, exponent * power / base.value * base.rate };
}
}

namespace Eigen
{
template <>
struct NumTraits<coronary::Dual> : NumTraits<double>
{
  using Real = coronary::Dual;
  using NonInteger = coronary::Dual;
  using Nested = coronary::Dual;
  using Literal = coronary::Dual;
  enum
  {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 2,
    AddCost = 2,
    MulCost = 4
  };
};
}

#endif
