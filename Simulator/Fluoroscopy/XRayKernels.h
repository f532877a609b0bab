// Inner loops of the projectors, once for each generation of processors; all give the same bits.
#ifndef DynamicCoronary_XRayKernels_h
#define DynamicCoronary_XRayKernels_h

#include <cstddef>
#include <cstdint>

namespace coronary
{
template <typename Kernels>
class KernelChoice;

constexpr int XRayLanes = 8;

/// Slices [first, last).
struct SliceRun
{
  int first;
  int last;
};

/// Eight rays through the slices of a volume, in its indices: (u, v) = start + slope (slice - middle).
struct SlicePacket
{
  float startU[XRayLanes];
  float startV[XRayLanes];
  float slopeU[XRayLanes];
  float slopeV[XRayLanes];
  float firstSlice[XRayLanes]; ///< of the ray between source and detector
  float lastSlice[XRayLanes];
  float sum[XRayLanes]; ///< in and out: of bilinear values
};

/// Voxels with u next to each other; those at the border are 0.
struct SliceVolume
{
  const std::uint16_t* voxels;
  std::ptrdiff_t sliceStride;
  std::int32_t rowStride; ///< from v to v + 1
  int middle;             ///< slice
  float maximumU;         ///< just below the last index
  float maximumV;
};

/// a + b i + c j, i and j being columns and rows from a pixel near the segment.
struct PixelPlane
{
  float a;
  float b;
  float c;
};

/**
 * Part of a chain of tubes, from P to P + length axis. d: from the source to a pixel; w = source - P. A cut is the plane
 * that ends it: its normal's product with the axis is 1.
 */
struct TubePart
{
  PixelPlane ray[3];      ///< d, mm
  PixelPlane cross[3];    ///< axis x d, mm
  PixelPlane moment;      ///< w . (axis x d), mm^2
  PixelPlane along[3];    ///< w x d, mm^2
  PixelPlane crossCut[2]; ///< (axis x d) . normal, mm
  PixelPlane rayCut[2];   ///< d . normal, mm
  float length;           ///< mm
  float inverseLength;
  float outer[2]; ///< radius at its ends, mm
  float inner[2]; ///< 0: solid
  float step; ///< of the distance between axis and ray, from pixel to pixel, times |axis x d|; mm^2
  float maximumPixel; ///< a pixel's size where the segment is, mm
  float attenuation;  ///< 1/mm
};

/// Some pixels, all different; what lies beyond `count` up to a multiple of the lanes is read, and not used.
struct TubePixels
{
  static constexpr int Most = 256;
  int count = 0;
  float i[Most] = {};
  float j[Most] = {};
  std::int32_t index[Most] = {}; ///< in the image
};

struct XRayKernels
{
  void (*sumSlices)(
    const SliceVolume& volume, const SliceRun* runs, int numberOfRuns, SlicePacket& packet);
  void (*addTube)(const TubePart& part, const TubePixels& list, float* pixels);
};

/// Which set runs, in the whole process.
KernelChoice<XRayKernels>& XRayKernelChoice();

extern const XRayKernels XRayKernelsBaseline;
extern const XRayKernels XRayKernelsAvx2;
}

#endif
