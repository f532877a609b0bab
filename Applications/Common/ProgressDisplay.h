/**
 * @file ProgressDisplay.h
 * @brief How far the work is: a bar on a terminal, plain lines elsewhere, on standard error.
 */
#ifndef DynamicCoronary_ProgressDisplay_h
#define DynamicCoronary_ProgressDisplay_h

#include <chrono>
#include <string>

namespace coronary
{
/// Shows the progress of a number of steps of about equal length.
class ProgressDisplay
{
public:
  /**
   * @param unit   what a step is, for example "phase"
   * @param steps  how many there are
   * @param quiet  show nothing
   */
  ProgressDisplay(std::string unit, int steps, bool quiet);
  /// Takes the bar off the terminal.
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// The step with this index, from 0, begins; `detail` is shown beside its number.
  void BeginStep(int step, const std::string& detail);

  /// The completed fraction of the step, 0 to 1.
  void Update(double fraction);

private:
  using Clock = std::chrono::steady_clock;

  void DrawBar();
  std::string Remaining() const;

  const std::string Unit;
  const int Steps;
  const bool Quiet;
  const bool Terminal;
  const bool Lines; ///< for a program that shows them: DYNAMICCORONARY_PROGRESS
  int Step = 0;
  double Fraction = 0.0; ///< of the step
  std::string Detail;
  Clock::time_point Start = Clock::now();
  Clock::time_point LastDrawn;
  bool Drawn = false;
};
}

#endif
