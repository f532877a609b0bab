// Compiled once for the baseline processor and, by ReconstructionKernelsAvx2.cxx, once more, so it may
// include nothing that emits shared inline functions: the linker could keep the widest of them.
#include "ReconstructionKernels.h"

#if defined(__AVX2__)
#include <immintrin.h>
#define CORONARY_RECONSTRUCTION_KERNELS ReconstructionKernelsAvx2
#else
#define CORONARY_RECONSTRUCTION_KERNELS ReconstructionKernelsBaseline
#endif

namespace coronary
{
namespace
{
constexpr int Lanes = 8;
constexpr int Columns = 4; ///< of the result that share the values of one pass
using Pack = float __attribute__((vector_size(sizeof(float) * Lanes)));
using LoosePack = float __attribute__((vector_size(sizeof(float) * Lanes), aligned(4), may_alias));

inline Pack Load(const float* from)
{
  return *reinterpret_cast<const LoosePack*>(from);
}

inline void Store(float* to, Pack values)
{
  *reinterpret_cast<LoosePack*>(to) = values;
}

inline int Distance(int a, int b)
{
  return a < b ? b - a : a - b;
}

void Convolve(
  const float* kernel, const float* in, int channels, int rows, int first, int last, float* out)
{
  const int whole = rows / Lanes * Lanes;
  for (int c = first; c <= last; c += Columns)
  {
    const int count = last - c + 1 < Columns ? last - c + 1 : Columns;
    for (int r = 0; r < whole; r += Lanes)
    {
      Pack sums[Columns] = {};
      for (int n = 0; n < channels; ++n)
      {
        const Pack value = Load(in + static_cast<long>(n) * rows + r);
        for (int k = 0; k < Columns; ++k)
        {
          // A column beyond the last one is computed, too, but for the kernel's end.
          const int d = Distance(c + k, n);
          sums[k] += value * kernel[d < channels ? d : channels - 1];
        }
      }
      for (int k = 0; k < count; ++k)
      {
        Store(out + static_cast<long>(c + k) * rows + r, sums[k]);
      }
    }
    for (int k = 0; k < count; ++k)
    {
      for (int r = whole; r < rows; ++r)
      {
        float sum = 0.0f;
        for (int n = 0; n < channels; ++n)
        {
          sum += in[static_cast<long>(n) * rows + r] * kernel[Distance(c + k, n)];
        }
        out[static_cast<long>(c + k) * rows + r] = sum;
      }
    }
  }
}

/// Abramowitz and Stegun 4.4.49: within 2e-8 up to 45 degrees.
inline double ArcTangent(double t)
{
  const double s = t * t;
  return t *
    (1.0 +
      s *
        (-0.3333314528 +
          s *
            (0.1999355085 +
              s *
                (-0.1420889944 +
                  s *
                    (0.1065626393 +
                      s *
                        (-0.0752896400 +
                          s * (0.0429096138 + s * (-0.0161657367 + s * 0.0028662257))))))));
}

/// Adds values between the rows of a line to voxels; beyond its ends it stays the same.
void AddLine(const float* line, int rows, float start, float slope, float* out, int voxels)
{
  const auto lastRow = static_cast<float>(rows - 1);
  int k = 0;
#if defined(__AVX2__)
  const __m256 steps = _mm256_setr_ps(0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f);
  const __m256 slopes = _mm256_set1_ps(slope);
  for (; k + Lanes <= voxels; k += Lanes)
  {
    const __m256 at = _mm256_add_ps(steps, _mm256_set1_ps(static_cast<float>(k)));
    __m256 row = _mm256_fmadd_ps(at, slopes, _mm256_set1_ps(start));
    row = _mm256_min_ps(_mm256_set1_ps(lastRow), _mm256_max_ps(_mm256_setzero_ps(), row));
    const __m256i whole = _mm256_cvttps_epi32(row);
    const __m256 low = _mm256_i32gather_ps(line, whole, 4);
    const __m256 high = _mm256_i32gather_ps(line + 1, whole, 4);
    const __m256 rest = _mm256_sub_ps(row, _mm256_cvtepi32_ps(whole));
    const __m256 value = _mm256_fmadd_ps(rest, _mm256_sub_ps(high, low), low);
    _mm256_storeu_ps(out + k, _mm256_add_ps(_mm256_loadu_ps(out + k), value));
  }
#endif
  for (; k < voxels; ++k)
  {
    float row = start + static_cast<float>(k) * slope;
    row = row < 0.0f ? 0.0f : row;
    row = row > lastRow ? lastRow : row;
    const int whole = static_cast<int>(row);
    out[k] += line[whole] + (row - static_cast<float>(whole)) * (line[whole + 1] - line[whole]);
  }
}

void BackProject(const BackProjectedRow& b)
{
  constexpr int block = 16;
  double columns[block];
  double squares[block];
  double scales[block];
  const int rows = b.rows;
  for (int first = 0; first < b.pixels; first += block)
  {
    for (int n = 0; n < block; ++n)
    {
      const double x = b.x + (first + n) * b.step;
      // From the tube: along the central ray, and to its left.
      const double along = b.distance - (x * b.towards[0] + b.y * b.towards[1]);
      const double left = x * b.towards[1] - b.y * b.towards[0];
      columns[n] = ArcTangent(left / along) / b.columnPitch + b.middle;
      squares[n] = along * along + left * left;
      scales[n] = b.rowScale / __builtin_sqrt(squares[n]);
    }
    const int count = b.pixels - first < block ? b.pixels - first : block;
    for (int n = 0; n < count; ++n)
    {
      const int column = static_cast<int>(columns[n]);
      if (columns[n] < 0.0 || column + 1 >= b.channels)
      {
        continue;
      }
      const auto right = static_cast<float>((columns[n] - column) / squares[n]);
      const auto rest = static_cast<float>(1.0 / squares[n]) - right;
      const float* one = b.view + static_cast<long>(column) * rows;
      const float* other = one + rows;
      for (int r = 0; r < rows; ++r)
      {
        b.line[r] = rest * one[r] + right * other[r];
      }
      b.line[rows] = b.line[rows - 1];
      AddLine(b.line, rows, static_cast<float>(b.height * scales[n] + 0.5 * (rows - 1)),
        static_cast<float>(b.rise * scales[n]), b.out + static_cast<long>(first + n) * b.voxels,
        b.voxels);
    }
  }
}
}

const ReconstructionKernels CORONARY_RECONSTRUCTION_KERNELS{ Convolve, BackProject };
}
