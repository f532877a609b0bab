/**
 * @file ParallelFor.h
 * @brief Loops over all cores, with progress and cancellation, whatever backend VTK was built with.
 *
 * Debian's ParaView starts vtkSMPTools with its sequential backend, and the algorithms may not
 * depend on VTK: so they share this pool of threads.
 */
#ifndef DynamicCoronary_ParallelFor_h
#define DynamicCoronary_ParallelFor_h

#include <cstdint>
#include <functional>
#include <stdexcept>

namespace coronary
{
/// Takes the completed fraction, 0 to 1; returns false to ask the algorithm to stop.
/// An empty callback means: no report, never stop.
using ProgressCallback = std::function<bool(double)>;

/// Thrown by an algorithm whose ProgressCallback returned false.
struct Cancelled : std::runtime_error
{
  Cancelled()
    : std::runtime_error("cancelled")
  {
  }
};

/// Calls the callback, and throws Cancelled when it says stop.
void Report(const ProgressCallback& progress, double fraction);

/**
 * Number of threads that ParallelFor uses, at least 1.
 * By default the cores this process may run on, limited by VTK_SMP_MAX_THREADS when that is set.
 */
int NumberOfThreads();

/// Sets it for the whole process; 0 gives the default back. Not to be called inside a ParallelFor.
void SetNumberOfThreads(int threads);

/**
 * Calls body(first, last) for consecutive ranges of at most `grain` that together cover [0, count).
 *
 * Which thread runs which range is not fixed, so a body may write only what belongs to its range;
 * then the result does not depend on the number of threads. Progress is reported by the calling
 * thread only, 1 at the end at the latest: every loop can be cancelled. An exception in a body stops the loop and is thrown again here.
 * A loop inside a body runs on the body's own thread.
 *
 * @throws Cancelled when progress returned false.
 */
void ParallelFor(std::int64_t count, std::int64_t grain,
  const std::function<void(std::int64_t first, std::int64_t last)>& body,
  const ProgressCallback& progress = {});
}

#endif
