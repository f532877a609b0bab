/**
 * @file PartialProgress.h
 * @brief Progress of work in parts, and from inside of loops: often enough to stop at once.
 */
#ifndef DynamicCoronary_PartialProgress_h
#define DynamicCoronary_PartialProgress_h

#include "ParallelFor.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <numeric>
#include <vector>

namespace coronary
{
/// The callback of a part whose 0 to 1 is `first` to `last` of the whole; empty when `progress` is,
/// which has to outlive it.
inline ProgressCallback PartOf(const ProgressCallback& progress, double first, double last)
{
  if (!progress)
  {
    return {};
  }
  return [&progress, first, last](double done) { return progress(first + (last - first) * done); };
}

/// Work in parts that take shares of the time, in any unit; 0 for what is not done this time.
class WorkParts
{
public:
  WorkParts(const ProgressCallback& progress, std::initializer_list<double> shares)
    : Progress(progress)
    , Ends(shares.size())
  {
    std::partial_sum(shares.begin(), shares.end(), this->Ends.begin());
  }

  ProgressCallback operator()(std::size_t part) const
  {
    const double first = part > 0 ? this->Ends[part - 1] : 0.0;
    return PartOf(this->Progress, first / this->Ends.back(), this->Ends[part] / this->Ends.back());
  }

private:
  const ProgressCallback& Progress;
  std::vector<double> Ends;
};

/// Called in every step of a loop; reports a hundred times, and at least every 16384 steps.
class LoopReport
{
public:
  LoopReport(const ProgressCallback& progress, std::int64_t count)
    : Progress(progress)
    , Count(std::max<std::int64_t>(1, count))
    , Every(std::clamp<std::int64_t>(count / 100, 1, 16384))
  {
  }

  /// @throws Cancelled
  void operator()(std::int64_t step)
  {
    if (step >= this->Next)
    {
      this->Next = step + this->Every;
      Report(this->Progress,
        std::min(1.0, static_cast<double>(step) / static_cast<double>(this->Count)));
    }
  }

private:
  const ProgressCallback& Progress;
  std::int64_t Count;
  std::int64_t Every;
  std::int64_t Next = 0;
};

/// Work that turned out not to be needed, or to be less than expected: goes from `first` to `last` in
/// steps as the rest does.
inline void SkipProgress(const ProgressCallback& progress, double first, double last)
{
  for (double done = first; progress && done < last; done += 0.01)
  {
    Report(progress, done);
  }
}

/// The grain of a ParallelFor that, where it has to report, is small enough for a hundred reports.
inline std::int64_t ReportingGrain(
  const ProgressCallback& progress, std::int64_t count, std::int64_t grain)
{
  return progress ? std::clamp<std::int64_t>(count / 200, 1, grain) : grain;
}
}

#endif
