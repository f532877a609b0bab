#include "HeartRegion.h"

#include "DistanceTransform.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double BlockSize = 3.0; ///< mm
/// HU, half way between lung (-850) and the least that is around the arteries: fat (-100).
constexpr double SolidValue = -475.0;
/// mm: vessels of the lung are thinner, but for those at its hilum.
constexpr double LungVessel = 6.0;
/// mm around what is solid; the fat that arteries run in is itself.
constexpr double Margin = 15.0;
/// mm from the middle of the ostia to the right, to the front and down, and to the left, to the back and up. A heart is
/// 120 mm long and 90 mm wide, an enlarged one 180 and 150 mm; its long axis points to the left, to the front and down.
const Vector3 Low(-90.0, -110.0, -180.0);
const Vector3 High(140.0, 110.0, 70.0);
}

HeartRegion::HeartRegion(const ImageGrid& grid)
  : Grid(grid)
{
  for (int axis = 0; axis < 3; ++axis)
  {
    this->Size[axis] = grid.extent[2 * axis + 1] - grid.extent[2 * axis] + 1;
    this->Factor[axis] = std::max(1, static_cast<int>(std::lround(BlockSize / grid.spacing[axis])));
    this->Count[axis] = (this->Size[axis] + this->Factor[axis] - 1) / this->Factor[axis];
  }
}

HeartRegion::HeartRegion(const ImageGrid& grid, std::string blocks)
  : HeartRegion(grid)
{
  if (blocks.size() != this->Slice() * this->Count[2])
  {
    throw std::invalid_argument("HeartRegion: the blocks are of another grid");
  }
  this->Inside = std::move(blocks);
}

HeartRegion::HeartRegion(
  const ScalarImage& image, const std::vector<Vector3>& ostia, const ProgressCallback& progress)
  : HeartRegion(image.grid)
{
  if (ostia.empty())
  {
    throw std::invalid_argument("HeartRegion: there is no ostium");
  }
  Vector3 middle = Vector3::Zero();
  for (const Vector3& ostium : ostia)
  {
    middle += ostium / static_cast<double>(ostia.size());
  }
  const Vector3 spacing =
    this->Grid.spacing.cwiseProduct(Vector3(this->Factor[0], this->Factor[1], this->Factor[2]));
  std::vector<unsigned char> solid = this->Solid(image, progress);
  solid = OpenWithBall(solid.data(), this->Count, spacing, LungVessel);
  for (unsigned char& block : solid)
  {
    block = block != 0 ? 0 : 1;
  }
  const std::vector<unsigned char> near =
    NearZeros(solid.data(), this->Count, spacing, Margin * Margin);
  this->Inside.assign(near.size(), 0);
  for (int c = 0; c < this->Count[2]; ++c)
  {
    for (int b = 0; b < this->Count[1]; ++b)
    {
      for (int a = 0; a < this->Count[0]; ++a)
      {
        const std::size_t block =
          c * this->Slice() + static_cast<std::size_t>(b) * this->Count[0] + a;
        const auto at = [&](int n, int axis)
        { return this->Grid.extent[2 * axis] + (n + 0.5) * this->Factor[axis] - 0.5; };
        const Vector3 away = this->Grid.IndexToWorld(at(a, 0), at(b, 1), at(c, 2)) - middle;
        const bool reached =
          (away.array() >= Low.array()).all() && (away.array() <= High.array()).all();
        this->Inside[block] = near[block] != 0 && reached ? 1 : 0;
      }
    }
  }
}

int HeartRegion::End(int block, int axis) const
{
  return std::min(this->Size[axis], (block + 1) * this->Factor[axis]);
}

/// Blocks of less air than lung has.
std::vector<unsigned char> HeartRegion::Solid(
  const ScalarImage& image, const ProgressCallback& progress) const
{
  const std::size_t slice = this->Slice();
  std::vector<unsigned char> solid(slice * this->Count[2]);
  const auto work = [&](const auto* values, std::int64_t first, std::int64_t last)
  {
    std::vector<double> sums(slice);
    std::vector<int> counts(slice);
    for (int c = static_cast<int>(first); c < last; ++c)
    {
      std::fill(sums.begin(), sums.end(), 0.0);
      std::fill(counts.begin(), counts.end(), 0);
      for (int k = c * this->Factor[2]; k < this->End(c, 2); ++k)
      {
        for (int j = 0; j < this->Size[1]; ++j)
        {
          const auto* row =
            values + (static_cast<std::int64_t>(k) * this->Size[1] + j) * this->Size[0];
          const std::size_t blocks = static_cast<std::size_t>(j / this->Factor[1]) * this->Count[0];
          for (int a = 0; a < this->Count[0]; ++a)
          {
            for (int i = a * this->Factor[0]; i < this->End(a, 0); ++i)
            {
              const auto value = static_cast<double>(row[i]);
              sums[blocks + a] += std::isfinite(value) ? value : 0.0;
              counts[blocks + a] += std::isfinite(value) ? 1 : 0;
            }
          }
        }
      }
      for (std::size_t b = 0; b < slice; ++b)
      {
        solid[c * slice + b] = counts[b] > 0 && sums[b] > SolidValue * counts[b] ? 1 : 0;
      }
    }
  };
  std::visit(
    [&](const auto* values)
    {
      ParallelFor(
        this->Count[2], 1,
        [&](std::int64_t first, std::int64_t last) { work(values, first, last); }, progress);
    },
    image.values);
  return solid;
}

double HeartRegion::Share() const
{
  double inside = 0.0;
  for (std::size_t n = 0; n < this->Inside.size(); ++n)
  {
    if (this->Inside[n] != 0)
    {
      const auto width = [&](std::size_t block, int axis) {
        return this->End(static_cast<int>(block), axis) -
          static_cast<int>(block) * this->Factor[axis];
      };
      inside += static_cast<double>(width(n % this->Count[0], 0)) *
        width(n / this->Count[0] % this->Count[1], 1) * width(n / this->Slice(), 2);
    }
  }
  return inside / (static_cast<double>(this->Size[0]) * this->Size[1] * this->Size[2]);
}

void HeartRegion::Fill(unsigned char* voxels) const
{
  ParallelFor(this->Size[2], 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t k = first; k < last; ++k)
      {
        for (int j = 0; j < this->Size[1]; ++j)
        {
          unsigned char* row = voxels + (k * this->Size[1] + j) * this->Size[0];
          const char* blocks = this->Inside.data() + k / this->Factor[2] * this->Slice() +
            static_cast<std::size_t>(j / this->Factor[1]) * this->Count[0];
          for (int a = 0; a < this->Count[0]; ++a)
          {
            std::fill(row + a * this->Factor[0], row + this->End(a, 0),
              static_cast<unsigned char>(blocks[a] != 0 ? 1 : 0));
          }
        }
      }
    });
}
}
