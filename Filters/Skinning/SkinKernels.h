// Inner loops of SkinDeformation, one set for each generation of processors.
#ifndef DynamicCoronary_SkinKernels_h
#define DynamicCoronary_SkinKernels_h

#include <cstdint>

namespace coronary
{
template <typename Kernels>
class KernelChoice;

/// Points go through the loops in blocks of so many.
constexpr int SkinLanes = 16;

/// Points in blocks, each with the bones that any of its points hangs on.
struct SkinBlocks
{
  const float* x; ///< SkinLanes a block, from the middle of the mesh; the same for y, z
  const float* y;
  const float* z;
  const std::int32_t* offset; ///< blocks + 1: where a block's entries begin
  const std::int32_t* bone;   ///< of every entry
  const float* weight;        ///< SkinLanes an entry
  const std::int32_t* pivot;  ///< SkinLanes a block: the bone of the greatest weight
  const std::int32_t* point;  ///< SkinLanes a block: where the result goes
  std::int64_t points;        ///< all blocks but the last one are full
};

/// A number of a bone that moves, with its derivative by time.
struct MovingFloat
{
  float value;
  float rate;
};

/// What the loops need of a bone. Affine maps are three rows of four.
template <typename Number>
struct BasicSkinBone
{
  Number rigid[12];   ///< LinearBlend: rotation and translation; DualQuaternion: 4 real, 4 dual
  Number stretch[4];  ///< times t: what the stretch adds
  Number section[12]; ///< of the part beside the bone
  Number turned[12];  ///< of the same, turned by a quarter about the bone
  Number calibre[2];  ///< factor at t = 0, its change to t = 1
  Number twist;       ///< radians at t = 1
  Number unused;
  float along[4]; ///< affine: t before it is limited to 0 .. 1
};

using SkinBone = BasicSkinBone<float>;
using MovingSkinBone = BasicSkinBone<MovingFloat>;

/// Blocks first to last - 1; `centre` is added to the positions, which go to 3 point, 3 point + 1, ...
using SkinPositions = void (*)(const SkinBlocks& blocks, const SkinBone* bones, const float* centre,
  std::int64_t first, std::int64_t last, float* positions);

/// The same positions to the bit, and velocities beside them.
using SkinMotion = void (*)(const SkinBlocks& blocks, const MovingSkinBone* bones,
  const float* centre, std::int64_t first, std::int64_t last, float* positions, float* velocities);

/// The first index: linear, dual quaternions; the second one: with calibre and twist.
struct SkinKernels
{
  SkinPositions positions[2][2];
  SkinMotion motion[2][2];
};

/// Which set runs, in the whole process.
KernelChoice<SkinKernels>& SkinKernelChoice();

extern const SkinKernels SkinKernelsBaseline;
extern const SkinKernels SkinKernelsAvx2;
extern const SkinKernels SkinKernelsAvx512;
}

#endif
