#include "WallKernels.h"

#include <limits>

#if defined(__AVX2__)
#define CORONARY_WALL_KERNELS WallKernelsAvx2
#else
#define CORONARY_WALL_KERNELS WallKernelsBaseline
#endif

namespace coronary
{
namespace
{
void Sift(const CandidateRun& run, int count, Candidate* found)
{
  const CandidateRun own = run;
  for (int i = 0; i < count; ++i)
  {
    const float ago = own.now - own.passed[i];
    const float slack =
      own.distance[i] - (own.speed[i] + own.change) * (ago < 0.0F ? -ago : ago) - own.limit;
    const float x = own.at[0] - own.place[0][i];
    const float y = own.at[1] - own.place[1][i];
    const float z = own.at[2] - own.place[2][i];
    const float moved = x * x + y * y + z * z;
    const float more = slack - own.further;
    const bool beyond = (slack > 0.0F) & (slack * slack > moved);
    const bool farBeyond = (more > 0.0F) & (more * more > moved);
    found[i] = !beyond ? Candidate::Now : farBeyond ? Candidate::TooFar : Candidate::Later;
  }
}

inline double Dot(double x, double y, double z, double u, double v, double w)
{
  return x * u + y * v + z * w;
}

// NearestOnTriangle without a branch: every case is computed, and one is taken.
void Nearest(TriangleBatch& batch, int count, const double* place)
{
  constexpr double Infinity = std::numeric_limits<double>::infinity();
  const double px = place[0];
  const double py = place[1];
  const double pz = place[2];
  // Whole registers: what is beyond `count` is computed and not read.
  const int padded = (count + 3) & ~3;
  for (int i = 0; i < padded; ++i)
  {
    const double ax = batch.corner[0][i];
    const double ay = batch.corner[1][i];
    const double az = batch.corner[2][i];
    const double abx = batch.corner[3][i] - ax;
    const double aby = batch.corner[4][i] - ay;
    const double abz = batch.corner[5][i] - az;
    const double acx = batch.corner[6][i] - ax;
    const double acy = batch.corner[7][i] - ay;
    const double acz = batch.corner[8][i] - az;
    const double apx = px - ax;
    const double apy = py - ay;
    const double apz = pz - az;
    const double d00 = Dot(abx, aby, abz, abx, aby, abz);
    const double d01 = Dot(abx, aby, abz, acx, acy, acz);
    const double d11 = Dot(acx, acy, acz, acx, acy, acz);
    const double d1 = Dot(abx, aby, abz, apx, apy, apz);
    const double d2 = Dot(acx, acy, acz, apx, apy, apz);
    const double area = d00 * d11 - d01 * d01;
    const double v = d11 * d1 - d01 * d2;
    const double w = d00 * d2 - d01 * d1;
    const double sum = v + w;
    const double scale = 1.0 / area;
    // AB
    double x = d1 <= 0.0 ? 0.0 : d1 >= d00 ? 1.0 : d1 / d00;
    double y = 0.0;
    double feature = d1 <= 0.0 ? 4.0 : d1 >= d00 ? 5.0 : 1.0;
    double squared = w <= 0.0 ? x * (x * d00 - 2.0 * d1) : Infinity;
    // CA
    const double t = d2 <= 0.0 ? 0.0 : d2 >= d11 ? 1.0 : d2 / d11;
    const double atCA = v <= 0.0 ? t * (t * d11 - 2.0 * d2) : Infinity;
    const double featureCA = d2 <= 0.0 ? 4.0 : d2 >= d11 ? 6.0 : 3.0;
    const bool isCA = atCA < squared;
    x = isCA ? 0.0 : x;
    y = isCA ? t : y;
    feature = isCA ? featureCA : feature;
    squared = isCA ? atCA : squared;
    // BC
    const double along = (d2 - d01) - (d1 - d00);
    const double length = d00 + d11 - 2.0 * d01;
    const double q = along <= 0.0 ? 0.0 : along >= length ? 1.0 : along / length;
    const double u = 1.0 - q;
    const double onBC = u * (u * d00 - 2.0 * d1) + q * (q * d11 - 2.0 * d2) + 2.0 * u * q * d01;
    const double atBC = sum >= area ? onBC : Infinity;
    const double featureBC = along <= 0.0 ? 5.0 : along >= length ? 6.0 : 2.0;
    const bool isBC = atBC < squared;
    x = isBC ? u : x;
    y = isBC ? q : y;
    feature = isBC ? featureBC : feature;
    // Within
    const bool face = (v > 0.0) & (w > 0.0) & (sum < area);
    x = face ? scale * v : x;
    y = face ? scale * w : y;
    feature = face ? 0.0 : feature;
    feature = area > 1e-8 * d00 * d11 ? feature : -1.0;
    const double nx = ax + x * abx + y * acx;
    const double ny = ay + x * aby + y * acy;
    const double nz = az + x * abz + y * acz;
    const double dx = px - nx;
    const double dy = py - ny;
    const double dz = pz - nz;
    batch.b[i] = x;
    batch.c[i] = y;
    batch.feature[i] = feature;
    batch.point[0][i] = nx;
    batch.point[1][i] = ny;
    batch.point[2][i] = nz;
    batch.squaredDistance[i] = Dot(dx, dy, dz, dx, dy, dz);
  }
}
}

extern const WallKernels CORONARY_WALL_KERNELS = { Sift, Nearest };
}
