#include "BroadBlur.h"

#include "DetectorKernels.h"
#include "KernelChoice.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace coronary
{
namespace
{
/// Cells have to be whole, and narrow against the Gaussian.
int CellSize(int pixels, double sigma)
{
  for (const int size : { 16, 8, 4, 2 })
  {
    if (pixels % size == 0 && sigma >= 2.0 * size)
    {
      return size;
    }
  }
  return 1;
}

/// Where, from the centre of a cell to that of the next, its first pixel is that is not before the centre.
double FirstFraction(int cell)
{
  return cell % 2 == 0 ? 0.5 / cell : 0.0;
}

/// The Gaussian between cells: what averaging over cells and interpolation between them leave to do.
std::vector<float> BetweenCells(double sigma, int cell)
{
  const double averaging = (cell * cell - 1.0) / 12.0;
  double interpolation = 0.0;
  for (int j = 0; j < cell; ++j)
  {
    const double fraction = FirstFraction(cell) + static_cast<double>(j) / cell;
    interpolation += 2.0 * fraction * fraction * (1.0 - fraction) * cell;
  }
  return GaussianHalf(std::sqrt(sigma * sigma - averaging - interpolation) / cell);
}
}

std::vector<float> GaussianHalf(double sigma)
{
  if (!(sigma > 0.0))
  {
    return { 1.0F };
  }
  const int radius = static_cast<int>(std::ceil(4.0 * sigma));
  std::vector<double> weights;
  weights.reserve(static_cast<std::size_t>(radius) + 1);
  double sum = 0.0;
  for (int r = 0; r <= radius; ++r)
  {
    weights.push_back(std::exp(-0.5 * r * r / (sigma * sigma)));
    sum += (r == 0 ? 1.0 : 2.0) * weights.back();
  }
  std::vector<float> half;
  half.reserve(weights.size());
  for (const double weight : weights)
  {
    half.push_back(static_cast<float>(weight / sum));
  }
  return half;
}

int Mirrored(int i, int count)
{
  const int period = 2 * count;
  const int place = ((i % period) + period) % period;
  return place < count ? place : period - 1 - place;
}

void BlurMirroredRow(const float* in, int width, const std::vector<float>& half,
  std::vector<float>& padded, float* result)
{
  const int radius = static_cast<int>(half.size()) - 1;
  padded.resize(static_cast<std::size_t>(width) + 2 * half.size());
  float* middle = padded.data() + radius;
  std::copy(in, in + width, middle);
  for (int r = 1; r <= radius; ++r)
  {
    middle[-r] = in[Mirrored(-r, width)];
    middle[width - 1 + r] = in[Mirrored(width - 1 + r, width)];
  }
  DetectorKernelChoice().Get().blurAlong(middle, half.data(), radius, width, result);
}

void PointToMirroredRows(
  const float* image, int columns, int rows, int row, std::vector<const float*>& around)
{
  int place = row - static_cast<int>(around.size() / 2);
  for (const float*& pointer : around)
  {
    pointer = image + static_cast<std::ptrdiff_t>(Mirrored(place++, rows)) * columns;
  }
}

void BroadBlur::Prepare(int columns, int rows, double sigma)
{
  this->Columns = columns;
  this->Rows = rows;
  this->CellColumns = CellSize(columns, sigma);
  this->CellRows = CellSize(rows, sigma);
  this->Along = BetweenCells(sigma, this->CellColumns);
  this->Across = BetweenCells(sigma, this->CellRows);
  const auto cells = static_cast<std::size_t>(columns / this->CellColumns) *
    static_cast<std::size_t>(rows / this->CellRows);
  this->Cells.assign(cells, 0.0F);
  this->Scratch.assign(cells, 0.0F);
}

void BroadBlur::Blur(const float* image)
{
  const int columns = this->Columns / this->CellColumns;
  const int rows = this->Rows / this->CellRows;
  const float share = 1.0F / static_cast<float>(this->CellColumns * this->CellRows);
  std::fill(this->Cells.begin(), this->Cells.end(), 0.0F);
  for (int row = 0; row < this->Rows; ++row)
  {
    DetectorKernelChoice().Get().addCells(image + static_cast<std::size_t>(row) * this->Columns,
      this->CellColumns, share, columns,
      this->Cells.data() + static_cast<std::size_t>(row / this->CellRows) * columns);
  }
  for (int row = 0; row < rows; ++row)
  {
    const std::size_t begin = static_cast<std::size_t>(row) * columns;
    BlurMirroredRow(
      this->Cells.data() + begin, columns, this->Along, this->Padded, this->Scratch.data() + begin);
  }
  const int radius = static_cast<int>(this->Across.size()) - 1;
  std::vector<const float*> around(2 * this->Across.size() - 1);
  for (int row = 0; row < rows; ++row)
  {
    PointToMirroredRows(this->Scratch.data(), columns, rows, row, around);
    DetectorKernelChoice().Get().blurAcross(around.data(), this->Across.data(), radius, columns,
      this->Cells.data() + static_cast<std::size_t>(row) * columns);
  }
}

void BroadBlur::Row(int row, float* result) const
{
  const int columns = this->Columns / this->CellColumns;
  const int rows = this->Rows / this->CellRows;
  const double place = (row + 0.5) / this->CellRows - 0.5;
  const int above = std::clamp(static_cast<int>(std::floor(place)), 0, rows - 1);
  const int below = std::min(above + 1, rows - 1);
  const auto down = static_cast<float>(std::clamp(place - above, 0.0, 1.0));
  const float* a = this->Cells.data() + static_cast<std::size_t>(above) * columns;
  const float* b = this->Cells.data() + static_cast<std::size_t>(below) * columns;
  const auto value = [=](int cell) { return a[cell] + down * (b[cell] - a[cell]); };

  // Outside the outermost centres it stays level.
  const int size = this->CellColumns;
  const int first = size / 2;
  const auto start = static_cast<float>(FirstFraction(size));
  const float step = 1.0F / static_cast<float>(size);
  float left = value(0);
  std::fill(result, result + first, left);
  for (int cell = 0; cell + 1 < columns; ++cell)
  {
    const float right = value(cell + 1);
    float* pixels = result + static_cast<std::ptrdiff_t>(cell) * size + first;
    for (int j = 0; j < size; ++j)
    {
      pixels[j] = left + (start + step * static_cast<float>(j)) * (right - left);
    }
    left = right;
  }
  std::fill(
    result + static_cast<std::ptrdiff_t>(columns - 1) * size + first, result + this->Columns, left);
}
}
