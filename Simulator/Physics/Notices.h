/**
 * @file Notices.h
 * @brief What an intervention says when it clamps or resets something, every kind at most once a second.
 */
#ifndef DynamicCoronary_Notices_h
#define DynamicCoronary_Notices_h

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
enum class Notice : int
{
  NotFinite = 0,
  TooFast,
  TurnedTooFast,
  CatheterLimit,
  WireAtTip,
  WireAtEnd,
  Reset,
  PutBack,
  BalloonLimit,
  StentInGuide,
  NotExchanged,
  WireNotExchanged,
  MicrocatheterLimit,
  WireAtMicrocatheter,
  NoBalloon,
  MicrocatheterNotExchanged,
  WireOutOfMicrocatheter,
  Count
};

class Notices
{
public:
  explicit Notices(double tickRate = 1.0)
    : TickRate(tickRate)
  {
  }
  /// @param more  what is added to the sentence
  void Say(Notice notice, std::uint64_t tick, const std::string& more = {});
  /// Since the last call, a sentence each.
  std::vector<std::string> Take();

private:
  double TickRate;
  std::array<std::uint64_t, static_cast<int>(Notice::Count)> LastTick{};
  std::vector<std::string> Messages;
};
}

#endif
