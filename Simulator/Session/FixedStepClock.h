/**
 * @file FixedStepClock.h
 * @brief How many steps of fixed length are due, when real time runs beside the simulation.
 */
#ifndef DynamicCoronary_FixedStepClock_h
#define DynamicCoronary_FixedStepClock_h

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace coronary
{
/**
 * The simulation follows real time in whole steps. When it comes to be late by more than a limit it does not
 * catch up: it goes on from there, slower than real time, and the time that was lost is counted.
 */
class FixedStepClock
{
public:
  /// @param rate  steps a second, positive  @param catchUp  s that are made up for at most, not negative
  /// @throws std::invalid_argument
  explicit FixedStepClock(double rate, double catchUp = 0.004)
    : Rate(rate)
    , MostSteps(std::max<std::int64_t>(1, std::llround(rate * catchUp)))
  {
    if (!(rate > 0.0) || !std::isfinite(rate) || !(catchUp >= 0.0) || !std::isfinite(catchUp))
    {
      throw std::invalid_argument(
        "a clock needs a positive rate and a time to catch up of 0 or more");
    }
  }

  /// Real time has gone on to `now`, s, on a clock that does not go back. @return steps to make now
  std::int64_t Due(double now)
  {
    if (!this->Started)
    {
      this->Started = true;
      this->Origin = now;
    }
    const auto wanted = static_cast<std::int64_t>(std::floor((now - this->Origin) * this->Rate));
    std::int64_t steps = std::max<std::int64_t>(0, wanted - this->Made);
    if (steps > this->MostSteps)
    {
      const std::int64_t lost = steps - this->MostSteps;
      this->Lost += lost;
      this->Origin += static_cast<double>(lost) / this->Rate;
      ++this->Overruns_;
      steps = this->MostSteps;
    }
    this->Made += steps;
    return steps;
  }

  std::int64_t Steps() const { return this->Made; }         ///< in all
  std::int64_t Overruns() const { return this->Overruns_; } ///< times that it could not catch up
  /// s by which the simulation is behind real time for good.
  double LostSeconds() const { return static_cast<double>(this->Lost) / this->Rate; }

private:
  double Rate;
  std::int64_t MostSteps;
  bool Started = false;
  double Origin = 0.0;
  std::int64_t Made = 0;
  std::int64_t Lost = 0;
  std::int64_t Overruns_ = 0;
};
}

#endif
