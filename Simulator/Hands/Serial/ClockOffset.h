/**
 * @file ClockOffset.h
 * @brief How far a device's clock is ahead, out of answers to PING.
 */
#ifndef DynamicCoronary_ClockOffset_h
#define DynamicCoronary_ClockOffset_h

#include <array>
#include <cstddef>
#include <cstdint>

namespace coronary
{
/**
 * An answer that came fast was delayed little on either way: of the last Window round trips the fastest counts, and is
 * wrong by half of it at most.
 */
class ClockOffset
{
public:
  static constexpr std::size_t Window = 32;

  /// All in microseconds. @param sent, received  on the host's clock  @param device  on the device's, in between
  void Add(std::uint64_t sent, std::uint64_t received, std::uint64_t device);

  bool Known() const { return this->Count > 0; }
  double Offset() const { return this->Best.offset; } ///< microseconds that the device is ahead
  double RoundTrip() const { return this->Best.roundTrip; } ///< microseconds, of the fastest
  /// Parts in a million that the device's clock is faster, between the fastest of the first window and of the last
  /// complete one; 0 before there are two.
  double Drift() const;

private:
  struct Sample
  {
    std::uint64_t sent = 0;
    double offset = 0.0;
    double roundTrip = 0.0;
  };
  const Sample& Fastest() const;

  std::array<Sample, Window> Samples{};
  std::uint64_t Count = 0;
  Sample Best;
  Sample FirstWindow;
  Sample LastWindow;
};
}

#endif
