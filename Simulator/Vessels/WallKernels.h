// The loops over triangles that a sample may touch, one set for each generation of processors; all give the same bits.
#ifndef DynamicCoronary_WallKernels_h
#define DynamicCoronary_WallKernels_h

#include <cstdint>

namespace coronary
{
template <typename Kernels>
class KernelChoice;

/// Some triangles, and where they are nearest to a point: as TrianglePoint.
struct TriangleBatch
{
  static constexpr int Size = 32;

  double corner[9][Size]; ///< x, y, z of the corners A, B, C; mm
  double point[3][Size];
  double squaredDistance[Size];
  double b[Size];
  double c[Size];
  double feature[Size]; ///< as TriangleFeature; below 0: a sliver, for which nothing else is known
};

/// Triangles that may matter, and where the sample was when each was looked at last: until both have moved by what it
/// was too far, it need not be looked at.
struct CandidateRun
{
  const float* distance = nullptr; ///< mm, rounded down
  const float* speed = nullptr;    ///< mm/s: greatest of its corners against the path
  const float* passed = nullptr;   ///< s since triangles were looked up
  const float* place[3] = {};      ///< of the sample against the path, mm
  float at[3] = {};                ///< now
  float now = 0.0F;                ///< s since triangles were looked up
  float change = 0.0F;             ///< mm/s by which all speeds may be greater
  float limit = 0.0F;              ///< mm: what may be nearer is looked at
  float further = 0.0F; ///< mm beyond the limit: what may be nearer may be asked for later
};

enum class Candidate : std::uint8_t
{
  TooFar,
  Later,
  Now
};

struct WallKernels
{
  void (*sift)(const CandidateRun& run, int count, Candidate* found);
  /// As NearestOnTriangle.
  /// @param count  triangles, at most TriangleBatch::Size  @param place  x, y, z
  void (*nearest)(TriangleBatch& batch, int count, const double* place);
};

/// Which set runs, in the whole process.
KernelChoice<WallKernels>& WallKernelChoice();

extern const WallKernels WallKernelsBaseline;
extern const WallKernels WallKernelsAvx2;
}

#endif
