#include <DynamicCoronary/SkeletonPose.h>

// Debian's baseline has registers of 16 bytes, and the library is compiled for it.
static_assert(alignof(coronary::BoneTransform) == 16);
