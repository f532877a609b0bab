// The loop that moves contrast tracers, one for each generation of processors; all give the same bits.
#ifndef DynamicCoronary_TracerKernels_h
#define DynamicCoronary_TracerKernels_h

#include <cstdint>

namespace coronary
{
template <typename Kernels>
class KernelChoice;

/// What the loop needs of a segment.
struct TracerMotion
{
  float rate;   ///< 2 Q dt below the injector / the segment's volume
  float radial; ///< half width of a step of (x, y)
};

/// Tracers, and what moves them in a step.
struct TracerRun
{
  const std::int32_t* segment = nullptr;
  float* part = nullptr; ///< of the segment's volume that is before the tracer
  float* x = nullptr;
  float* y = nullptr;
  const TracerMotion* motions = nullptr; ///< per segment
  const float* axial =
    nullptr;                  ///< per segment: half width of a step of `part`; null: no such steps
  std::int32_t injected = -1; ///< segment with a flow of its own above a place; -1: none
  float injectedPart = 0.0F;  ///< that place, as part
  float injectedRate = 0.0F;  ///< there
  std::uint64_t random = 0;   ///< key of this step's random numbers
};

struct TracerKernels
{
  /// Moves tracers 0 to `count` - 1 as if no segment ended. Lists those that are beyond an end of theirs and returns
  /// how many; `leaving` has room for `count` + 1.
  std::int64_t (*move)(const TracerRun& run, std::int64_t count, std::int32_t* leaving);
};

/// Which set runs, in the whole process.
KernelChoice<TracerKernels>& TracerKernelChoice();

extern const TracerKernels TracerKernelsBaseline;
extern const TracerKernels TracerKernelsAvx2;
}

#endif
