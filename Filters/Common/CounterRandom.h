/**
 * @file CounterRandom.h
 * @brief Random numbers that are a pure function of a key and a counter.
 *
 * The standard library's distributions may differ between its versions, and a generator with
 * state ties a number to the order of the calls. These give the same bits for the same arguments,
 * whatever the thread, the extent or the library.
 * Source of the mixing function: Steele, Lea, Flood, "Fast splittable pseudorandom number
 * generators", OOPSLA 2014 (SplitMix64).
 */
#ifndef DynamicCoronary_CounterRandom_h
#define DynamicCoronary_CounterRandom_h

#include <cmath>
#include <cstdint>

namespace coronary
{
/// A bijective scrambling of 64 bits.
inline std::uint64_t MixBits(std::uint64_t z)
{
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// A stream of random numbers, named by a seed and a purpose so that streams do not overlap.
class RandomStream
{
public:
  explicit RandomStream(std::uint64_t seed, std::uint64_t purpose = 0)
    : Key(MixBits(MixBits(seed) + purpose))
  {
  }

  /// Uniform 64 bits.
  std::uint64_t Bits() { return MixBits(this->Key + this->Counter++); }

  /// Uniform in (0, 1).
  double Uniform() { return (static_cast<double>(this->Bits() >> 11) + 0.5) * 0x1p-53; }

  /// Uniform in (low, high).
  double Uniform(double low, double high) { return low + (high - low) * this->Uniform(); }

  /// Standard normal (Box-Muller; one number a call).
  double Normal()
  {
    const double u = this->Uniform();
    const double v = this->Uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(6.283185307179586477 * v);
  }

  /// Normal, cut at +-limit standard deviations.
  double Normal(double limit)
  {
    const double n = this->Normal();
    return n > limit ? limit : (n < -limit ? -limit : n);
  }

private:
  std::uint64_t Key;
  std::uint64_t Counter = 0;
};
}

#endif
