#include "TracerKernels.h"

#include <cstring>

#if defined(__AVX2__)
#define CORONARY_TRACER_KERNELS TracerKernelsAvx2
#else
#define CORONARY_TRACER_KERNELS TracerKernelsBaseline
#endif

namespace coronary
{
namespace
{
constexpr int BlockSize = 512;

/// What neighbouring tracers have besides their arrays.
struct Block
{
  TracerMotion motion[BlockSize];
  float axial[BlockSize];
  std::int32_t beyond[BlockSize]; ///< 1 where a tracer is beyond its segment
};

/// Scrambles 32 bits; loops over it are vectorised, which those over MixBits are not. Source of the constants: C.
/// Wellons, "Prospecting for hash functions", 2018 (lowbias32).
inline std::uint32_t MixBits32(std::uint32_t z)
{
  z ^= z >> 16;
  z *= 0x7feb352dU;
  z ^= z >> 15;
  z *= 0x846ca68bU;
  return z ^ (z >> 16);
}

/// Two numbers in -1 to 1, of mean 0, of 16 bits each.
inline float LowHalf(std::uint32_t bits)
{
  return (static_cast<float>(static_cast<std::int32_t>(bits & 0xffffU)) - 32767.5F) * 0x1p-15F;
}

inline float HighHalf(std::uint32_t bits)
{
  return LowHalf(bits >> 16);
}

void LookUpMotion(const TracerRun& run, std::int64_t first, int count, Block& block)
{
  const std::int32_t* const segment = run.segment + first;
  for (int i = 0; i < count; ++i)
  {
    block.motion[i] = run.motions[segment[i]];
  }
  if (run.axial)
  {
    for (int i = 0; i < count; ++i)
    {
      block.axial[i] = run.axial[segment[i]];
    }
  }
  if (run.injected >= 0)
  {
    const float* const part = run.part + first;
    for (int i = 0; i < count; ++i)
    {
      const bool above = segment[i] == run.injected && part[i] < run.injectedPart;
      block.motion[i].rate = above ? run.injectedRate : block.motion[i].rate;
    }
  }
}

template <bool Axial>
void MoveBlock(const TracerRun& run, std::int64_t first, int count, Block& block)
{
  float* __restrict__ const part = run.part + first;
  float* __restrict__ const xs = run.x + first;
  float* __restrict__ const ys = run.y + first;
  const std::uint32_t base =
    static_cast<std::uint32_t>(run.random) + static_cast<std::uint32_t>(first);
  const auto scramble = static_cast<std::uint32_t>(run.random >> 32);
  for (int i = 0; i < count; ++i)
  {
    const TracerMotion motion = block.motion[i];
    const std::uint32_t bits = MixBits32((base + static_cast<std::uint32_t>(i)) ^ scramble);
    const float stepX = motion.radial * LowHalf(bits);
    const float stepY = motion.radial * HighHalf(bits);
    const float farX = xs[i] + stepX;
    const float farY = ys[i] + stepY;
    const bool taken = farX * farX + farY * farY < 1.0F;
    const float x = taken ? farX : xs[i];
    const float y = taken ? farY : ys[i];
    float moved = part[i] + motion.rate * (1.0F - x * x - y * y);
    if (Axial)
    {
      moved += block.axial[i] * LowHalf(MixBits32(bits ^ scramble));
    }
    xs[i] = x;
    ys[i] = y;
    part[i] = moved;
    block.beyond[i] =
      static_cast<std::int32_t>(moved < 0.0F) | static_cast<std::int32_t>(moved > 1.0F);
  }
}

/// Most are not beyond: eight at a time.
std::int64_t ListBeyond(
  const Block& block, std::int64_t first, int count, std::int64_t listed, std::int32_t* leaving)
{
  for (int eight = 0; eight < count; eight += 8)
  {
    std::uint64_t any[4];
    std::memcpy(any, block.beyond + eight, sizeof(any));
    if ((any[0] | any[1] | any[2] | any[3]) != 0)
    {
      for (int i = eight; i < eight + 8; ++i)
      {
        leaving[listed] = static_cast<std::int32_t>(first + i);
        listed += block.beyond[i];
      }
    }
  }
  return listed;
}

std::int64_t Move(const TracerRun& run, std::int64_t count, std::int32_t* leaving)
{
  Block block;
  std::int64_t listed = 0;
  for (std::int64_t first = 0; first < count; first += BlockSize)
  {
    const int size = static_cast<int>(count - first < BlockSize ? count - first : BlockSize);
    if (size < BlockSize)
    {
      std::memset(block.beyond, 0, sizeof(block.beyond));
    }
    LookUpMotion(run, first, size, block);
    run.axial ? MoveBlock<true>(run, first, size, block)
              : MoveBlock<false>(run, first, size, block);
    listed = ListBeyond(block, first, size, listed, leaving);
  }
  return listed;
}
}

const TracerKernels CORONARY_TRACER_KERNELS{ &Move };
}
