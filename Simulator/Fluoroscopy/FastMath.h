// exp and ln in single precision, as loops that a compiler can turn into vector code. Not installed.
#ifndef DynamicCoronary_FastMath_h
#define DynamicCoronary_FastMath_h

#include <cstdint>
#include <cstring>

namespace coronary::fastmath
{
inline float FromBits(std::uint32_t bits)
{
  float value;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

inline std::uint32_t ToBits(float value)
{
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits;
}

/// 2^n exp(r) with |r| <= ln(2) / 2, exp(r) by its series.
inline float Exp(float x)
{
  constexpr float limit = 87.0F;
  x = x > -limit ? x : -limit;
  x = x < limit ? x : limit;
  constexpr float rounding = 12582912.0F; // 1.5 * 2^23: adding it leaves a whole number
  const float shifted = x * 1.44269504F + rounding;
  const float n = shifted - rounding;
  const float r = (x - n * 0.693145752F) - n * 1.42860677e-6F;
  const float series = 1.0F +
    r *
      (1.0F +
        r *
          (0.5F +
            r * (1.0F / 6.0F + r * (1.0F / 24.0F + r * (1.0F / 120.0F + r * (1.0F / 720.0F))))));
  const std::uint32_t exponent = (ToBits(shifted) - ToBits(rounding) + 127U) << 23;
  return series * FromBits(exponent);
}

/// x = 2^e m with m in [sqrt(1/2), sqrt(2)); ln(m) = 2 artanh((m - 1) / (m + 1)) by its series.
inline float Log(float x)
{
  constexpr std::int32_t rootHalf = 0x3f3504f3;
  const auto bits = static_cast<std::int32_t>(ToBits(x));
  const std::int32_t e = (bits - rootHalf) >> 23;
  const float f =
    FromBits(static_cast<std::uint32_t>(bits) - (static_cast<std::uint32_t>(e) << 23)) - 1.0F;
  const float s = f / (2.0F + f);
  const float z = s * s;
  const float series = 2.0F * s + s * z * (2.0F / 3.0F + z * (2.0F / 5.0F + z * (2.0F / 7.0F)));
  return static_cast<float>(e) * 0.693147181F + series;
}
}

#endif
