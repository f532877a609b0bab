#include "DistanceTransform.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace coronary
{
namespace
{
constexpr float Infinite = std::numeric_limits<float>::infinity();

/// Lower envelope of parabolas over one line of voxels.
class LineTransform
{
public:
  LineTransform(int count, double spacing)
    : Count(count)
    , Step(spacing)
    , Input(count)
    , Place(count)
    , Border(count + 1)
  {
  }

  void Run(float* line, std::int64_t stride)
  {
    // Parabolas with their tops at infinity take no part.
    int top = -1;
    for (int q = 0; q < this->Count; ++q)
    {
      const float value = line[q * stride];
      this->Input[q] = value;
      if (value == Infinite)
      {
        continue;
      }
      double from = -std::numeric_limits<double>::infinity();
      while (top >= 0)
      {
        from = this->Meeting(this->Place[top], q);
        if (from > this->Border[top])
        {
          break;
        }
        --top;
      }
      if (top < 0)
      {
        from = -std::numeric_limits<double>::infinity();
      }
      ++top;
      this->Place[top] = q;
      this->Border[top] = from;
    }
    if (top < 0)
    {
      return;
    }
    int k = 0;
    for (int q = 0; q < this->Count; ++q)
    {
      while (k < top && this->Border[k + 1] < q)
      {
        ++k;
      }
      const double d = (q - this->Place[k]) * this->Step;
      line[q * stride] = static_cast<float>(d * d + this->Input[this->Place[k]]);
    }
  }

private:
  double Meeting(int p, int q) const
  {
    const double square = this->Step * this->Step;
    return 0.5 *
      ((this->Input[q] - this->Input[p]) / (square * (q - p)) + static_cast<double>(q) + p);
  }

  int Count;
  double Step;
  std::vector<double> Input;
  std::vector<int> Place;
  std::vector<double> Border;
};

/// Steps from the ball's centre to its rim up to which windows are used.
constexpr int LongestWindow = 24;

/// Places in a row: from first up to, not including, last.
struct Range
{
  int first = 0;
  int last = 0;
};

/**
 * Whether a 0 is within a small distance, for each voxel: the least over windows along i, j and k in turn, with the sums
 * of the distance transform, so that both agree to the last bit. Of the distances only as many slices are kept as
 * the ball is high; rows, and parts of rows, where nothing is open cost next to nothing.
 */
class BallWindow
{
public:
  BallWindow(const unsigned char* mask, const std::array<int, 3>& dimensions,
    const Vector3& spacing, double square)
    : Mask(mask)
    , Size(dimensions)
    , Square(square)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      for (int step = 0;; ++step)
      {
        const double d = step * spacing[axis];
        if (!(static_cast<float>(d * d) <= square))
        {
          break;
        }
        this->Squares[axis].push_back(d * d);
      }
    }
    this->Reach = static_cast<int>(this->Squares[2].size()) - 1;
    this->Slots = std::min(dimensions[2], SlabSlices + 2 * this->Reach);
  }

  std::vector<unsigned char> Run(const ProgressCallback& progress);

private:
  static constexpr int SlabSlices = 16;

  /// Of a row: where distances are finite, and where they are not 0.
  struct Ranges
  {
    Range finite;
    Range open;
  };

  std::size_t Row(int j, int k) const
  {
    return static_cast<std::size_t>(k % this->Slots) * this->Size[1] + j;
  }
  Ranges AlongI(int j, int k, float* row) const;
  void Slice(int k);
  void Minimum(float* best, const Range& open, const float* other, const Range& finite,
    double square, Range& grown) const;
  void Finish(int j, int k, float* best, unsigned char* result) const;

  const unsigned char* Mask;
  std::array<int, 3> Size;
  double Square;
  std::array<std::vector<double>, 3> Squares; ///< of the steps within reach along each axis
  int Reach = 0;                              ///< slices
  int Slots = 0;                              ///< slices that are kept, in turn
  std::vector<float> Squared;                 ///< within the slice
  std::vector<Ranges> Known;                  ///< of the rows of Squared
};

BallWindow::Ranges BallWindow::AlongI(int j, int k, float* row) const
{
  const int n = this->Size[0];
  const unsigned char* mask = this->Mask + (static_cast<std::size_t>(k) * this->Size[1] + j) * n;
  const std::vector<double>& squares = this->Squares[0];
  const int reach = static_cast<int>(squares.size()) - 1;
  Ranges ranges{ { n, 0 }, { n, 0 } };
  // The nearest 0 before each voxel, then behind it.
  int before = -reach - 1;
  for (int i = 0; i < n; ++i)
  {
    if (mask[i] == 0)
    {
      before = i;
    }
    const int away = i - before;
    row[i] = away <= reach ? static_cast<float>(squares[away]) : Infinite;
  }
  int behind = n + reach;
  for (int i = n - 1; i >= 0; --i)
  {
    if (mask[i] == 0)
    {
      behind = i;
      ranges.finite.first = i;
      ranges.finite.last = std::max(ranges.finite.last, i + 1);
      continue;
    }
    ranges.open.first = i;
    ranges.open.last = std::max(ranges.open.last, i + 1);
    const int away = behind - i;
    if (away <= reach)
    {
      row[i] = std::min(row[i], static_cast<float>(squares[away]));
    }
  }
  if (ranges.finite.first < ranges.finite.last)
  {
    ranges.finite.first = std::max(0, ranges.finite.first - reach);
    ranges.finite.last = std::min(n, ranges.finite.last + reach);
  }
  return ranges;
}

/// The distances over a row that is some steps away take part where this row's are open.
void BallWindow::Minimum(float* best, const Range& open, const float* other, const Range& finite,
  double square, Range& grown) const
{
  const int first = std::max(open.first, finite.first);
  const int last = std::min(open.last, finite.last);
  for (int i = first; i < last; ++i)
  {
    const auto sum = static_cast<float>(square + static_cast<double>(other[i]));
    best[i] = sum < best[i] ? sum : best[i];
  }
  if (first < last)
  {
    grown.first = std::min(grown.first, first);
    grown.last = std::max(grown.last, last);
  }
}

/// Distances within one slice.
void BallWindow::Slice(int k)
{
  const int nx = this->Size[0];
  const int ny = this->Size[1];
  thread_local std::vector<float> rows;
  thread_local std::vector<Ranges> ranges;
  rows.resize(static_cast<std::size_t>(nx) * ny);
  ranges.resize(static_cast<std::size_t>(ny));
  for (int j = 0; j < ny; ++j)
  {
    ranges[j] = this->AlongI(j, k, &rows[static_cast<std::size_t>(j) * nx]);
  }
  const int reach = static_cast<int>(this->Squares[1].size()) - 1;
  for (int j = 0; j < ny; ++j)
  {
    float* best = &this->Squared[this->Row(j, k) * nx];
    std::copy_n(&rows[static_cast<std::size_t>(j) * nx], nx, best);
    Ranges& known = this->Known[this->Row(j, k)];
    known = ranges[j];
    for (int from = std::max(0, j - reach); from <= std::min(ny - 1, j + reach); ++from)
    {
      if (from != j)
      {
        this->Minimum(best, ranges[j].open, &rows[static_cast<std::size_t>(from) * nx],
          ranges[from].finite, this->Squares[1][std::abs(from - j)], known.finite);
      }
    }
  }
}

/// Across the slices, for one row.
void BallWindow::Finish(int j, int k, float* best, unsigned char* result) const
{
  const int nx = this->Size[0];
  const std::size_t row = this->Row(j, k);
  std::copy_n(&this->Squared[row * nx], nx, best);
  Range grown{ nx, 0 };
  for (int from = std::max(0, k - this->Reach);
       from <= std::min(this->Size[2] - 1, k + this->Reach); ++from)
  {
    const std::size_t other = this->Row(j, from);
    if (from != k)
    {
      this->Minimum(best, this->Known[row].open, &this->Squared[other * nx],
        this->Known[other].finite, this->Squares[2][std::abs(from - k)], grown);
    }
  }
  for (int i = 0; i < nx; ++i)
  {
    result[i] = best[i] <= this->Square ? 1 : 0;
  }
}

std::vector<unsigned char> BallWindow::Run(const ProgressCallback& progress)
{
  const int nx = this->Size[0];
  const int ny = this->Size[1];
  const int nz = this->Size[2];
  std::vector<unsigned char> result(static_cast<std::size_t>(nx) * ny * nz);
  Report(progress, 0.0);
  if (result.empty())
  {
    return result;
  }
  this->Squared.resize(static_cast<std::size_t>(this->Slots) * ny * nx);
  this->Known.resize(static_cast<std::size_t>(this->Slots) * ny);
  int known = 0; // slices
  for (int begin = 0; begin < nz; begin += SlabSlices)
  {
    const int end = std::min(nz, begin + SlabSlices);
    const int needed = std::min(nz, end + this->Reach);
    ParallelFor(needed - known, 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          this->Slice(known + static_cast<int>(n));
        }
      });
    known = needed;
    ParallelFor(static_cast<std::int64_t>(end - begin) * ny, 64,
      [&](std::int64_t first, std::int64_t last)
      {
        std::vector<float> best(static_cast<std::size_t>(nx));
        for (std::int64_t n = first; n < last; ++n)
        {
          const int k = begin + static_cast<int>(n / ny);
          const int j = static_cast<int>(n % ny);
          this->Finish(j, k, best.data(), &result[(static_cast<std::size_t>(k) * ny + j) * nx]);
        }
      });
    Report(progress, static_cast<double>(end) / nz);
  }
  return result;
}
}

std::vector<float> SquaredDistanceTransform(const unsigned char* mask,
  const std::array<int, 3>& dimensions, const Vector3& spacing, const ProgressCallback& progress)
{
  const std::int64_t nx = dimensions[0];
  const std::int64_t ny = dimensions[1];
  const std::int64_t nz = dimensions[2];
  std::vector<float> squared(nx * ny * nz);
  if (squared.empty())
  {
    return squared;
  }
  const auto part = [&](double from)
  {
    return progress
      ? ProgressCallback([&progress, from](double f) { return progress(from + 0.5 * f); })
      : ProgressCallback();
  };

  // Lines along i and j stay within one slice.
  ParallelFor(
    nz, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      LineTransform alongI(static_cast<int>(nx), spacing[0]);
      LineTransform alongJ(static_cast<int>(ny), spacing[1]);
      for (std::int64_t k = first; k < last; ++k)
      {
        const std::int64_t offset = k * nx * ny;
        for (std::int64_t p = offset; p < offset + nx * ny; ++p)
        {
          squared[p] = mask[p] ? Infinite : 0.0f;
        }
        for (std::int64_t j = 0; j < ny; ++j)
        {
          alongI.Run(&squared[offset + j * nx], 1);
        }
        for (std::int64_t i = 0; i < nx; ++i)
        {
          alongJ.Run(&squared[offset + i], nx);
        }
      }
    },
    part(0.0));
  ParallelFor(
    ny, 4,
    [&](std::int64_t first, std::int64_t last)
    {
      LineTransform alongK(static_cast<int>(nz), spacing[2]);
      for (std::int64_t j = first; j < last; ++j)
      {
        for (std::int64_t i = 0; i < nx; ++i)
        {
          alongK.Run(&squared[j * nx + i], nx * ny);
        }
      }
    },
    part(0.5));
  Report(progress, 1.0);
  return squared;
}

std::vector<unsigned char> NearZeros(const unsigned char* mask,
  const std::array<int, 3>& dimensions, const Vector3& spacing, double square,
  const ProgressCallback& progress)
{
  for (int axis = 0; axis < 3; ++axis)
  {
    // Where a ball spans many voxels a window over all of them costs more than the transform.
    if (!(square <= std::pow(LongestWindow * spacing[axis], 2)))
    {
      const std::vector<float> squared =
        SquaredDistanceTransform(mask, dimensions, spacing, progress);
      std::vector<unsigned char> result(squared.size());
      for (std::size_t p = 0; p < squared.size(); ++p)
      {
        result[p] = squared[p] <= square ? 1 : 0;
      }
      return result;
    }
  }
  return BallWindow(mask, dimensions, spacing, square).Run(progress);
}

std::vector<unsigned char> OpenWithBall(const unsigned char* mask,
  const std::array<int, 3>& dimensions, const Vector3& spacing, double radius,
  const ProgressCallback& progress)
{
  const auto part = [&](double from)
  {
    return progress
      ? ProgressCallback([&progress, from](double f) { return progress(from + 0.5 * f); })
      : ProgressCallback();
  };
  const auto square = static_cast<double>(static_cast<float>(radius * radius));
  // Where the ball's centre may not be; then what it covers from where it may.
  const std::vector<unsigned char> outside =
    NearZeros(mask, dimensions, spacing, square, part(0.0));
  return NearZeros(outside.data(), dimensions, spacing, square, part(0.5));
}
}
