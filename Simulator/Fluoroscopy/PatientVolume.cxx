#include "PatientVolume.h"

#include "DisjointSets.h"
#include "DistanceTransform.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double BlockLength = 1.5;          // mm, as near as whole voxels come
constexpr std::int16_t NothingThere = -1000; // HU
constexpr float Solid = -500.0F;             // HU: above is what is neither air nor lung
constexpr float MostOfAir =
  -970.0F; // HU: the mean around a piece; lung is above, even of a deep breath
constexpr double ThinnestBody =
  8.0; // mm, radius: boards, cables, clothes are thinner, and vessels of the lung
constexpr double BackMargin = 10.0; // mm of the image behind a back that is in it
constexpr double BackCurve = 60.0;  // mm that a back curves forward
constexpr int BackWindow = 10;      // blocks to either side that say where the back is
constexpr double BallRadius = 4.5;  // mm: thicker than coronary arteries
constexpr double RootReach = 15.0;  // mm from an ostium to the middle of the aortic root
constexpr double Gap = 5.0;         // mm between bodies of blood: a valve, a wall between chambers
constexpr double Rim = 2.0; // mm around a body that partial volume and the opening's corners take
constexpr double Darker =
  0.25; // of what blood is above tissue: blood that flows to the aorta differs less
constexpr double MostlyBright =
  0.5; // share of a body that is not darker: bone is a shell around something that is
constexpr double Calcium = 4.0 / 3.0; // of the blood's HU

using Counts = std::array<int, 3>;
using Mask = std::vector<unsigned char>;

/// A grid of blocks of voxels over a volume.
class Blocks
{
public:
  explicit Blocks(const HounsfieldVolume& volume)
    : Grid(volume.grid)
    , Voxels(volume.View().Dimensions())
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      this->Factor[axis] =
        std::max(1, static_cast<int>(std::lround(BlockLength / this->Grid.spacing[axis])));
      this->Count[axis] = (this->Voxels[axis] + this->Factor[axis] - 1) / this->Factor[axis];
      this->Spacing[axis] = this->Grid.spacing[axis] * this->Factor[axis];
    }
  }

  std::size_t Number() const
  {
    return static_cast<std::size_t>(this->Count[0]) * this->Count[1] * this->Count[2];
  }
  int Columns() const { return this->Count[0]; }
  std::size_t Slices() const { return static_cast<std::size_t>(this->Count[2]); }
  std::size_t At(int i, int j, int k) const
  {
    return (static_cast<std::size_t>(k) * this->Count[1] + j) * this->Count[0] + i;
  }

  /// Calls visit(block, voxel) for every voxel, blocks of a slice in one thread.
  template <typename Visit>
  void ForVoxels(const Visit& visit, const ProgressCallback& progress) const
  {
    ParallelFor(
      this->Count[2], 1,
      [&](std::int64_t first, std::int64_t last)
      {
        const int end = std::min<int>(static_cast<int>(last) * this->Factor[2], this->Voxels[2]);
        for (int k = static_cast<int>(first) * this->Factor[2]; k < end; ++k)
        {
          for (int j = 0; j < this->Voxels[1]; ++j)
          {
            std::size_t voxel =
              (static_cast<std::size_t>(k) * this->Voxels[1] + j) * this->Voxels[0];
            const std::size_t row = this->At(0, j / this->Factor[1], k / this->Factor[2]);
            for (int i = 0; i < this->Voxels[0]; ++i, ++voxel)
            {
              visit(row + i / this->Factor[0], voxel);
            }
          }
        }
      },
      progress);
  }

  std::vector<float> Means(const HounsfieldVolume& volume, const ProgressCallback& progress) const
  {
    std::vector<float> sums(this->Number(), 0.0F);
    std::vector<std::uint16_t> members(this->Number(), 0);
    this->ForVoxels(
      [&](std::size_t block, std::size_t voxel)
      {
        sums[block] += volume.values[voxel];
        ++members[block];
      },
      progress);
    for (std::size_t n = 0; n < sums.size(); ++n)
    {
      sums[n] /= static_cast<float>(members[n]);
    }
    return sums;
  }

  Mask Opened(const Mask& mask, double radius) const
  {
    return OpenWithBall(mask.data(), this->Count, this->Spacing, radius);
  }

  /// 1 in blocks of the mask and in those within `radius` mm of one.
  Mask Grown(const Mask& mask, double radius) const
  {
    Mask outside(mask.size());
    std::transform(mask.begin(), mask.end(), outside.begin(),
      [](unsigned char inside) { return static_cast<unsigned char>(inside == 0); });
    return NearZeros(outside.data(), this->Count, this->Spacing, radius * radius);
  }

  /// Numbers of the connected pieces of a mask, by faces, from 0; -1 outside. @param pieces  how many there are
  std::vector<int> Pieces(const Mask& mask, int& pieces) const
  {
    DisjointSets sets(mask.size());
    const std::array<std::size_t, 3> step = { 1, static_cast<std::size_t>(this->Count[0]),
      static_cast<std::size_t>(this->Count[0]) * this->Count[1] };
    this->ForBlocks(
      [&](const Counts& place, std::size_t n)
      {
        for (std::size_t axis = 0; axis < 3; ++axis)
        {
          if (place[axis] > 0 && mask[n] != 0 && mask[n - step[axis]] != 0)
          {
            sets.Join(static_cast<std::int64_t>(n), static_cast<std::int64_t>(n - step[axis]));
          }
        }
      });
    std::vector<int> numbers(mask.size(), -1);
    pieces = 0;
    for (std::size_t n = 0; n < mask.size(); ++n)
    {
      if (mask[n] != 0)
      {
        // The lowest of a set comes first.
        const auto first = static_cast<std::size_t>(sets.Find(static_cast<std::int64_t>(n)));
        numbers[n] = first == n ? pieces++ : numbers[first];
      }
    }
    return numbers;
  }

  template <typename Visit>
  void ForBlocks(const Visit& visit) const
  {
    std::size_t n = 0;
    for (int k = 0; k < this->Count[2]; ++k)
    {
      for (int j = 0; j < this->Count[1]; ++j)
      {
        for (int i = 0; i < this->Count[0]; ++i, ++n)
        {
          visit(Counts{ i, j, k }, n);
        }
      }
    }
  }

  /// Calls visit(neighbour) for the blocks that are `steps` away along an axis.
  template <typename Visit>
  void ForNeighbours(const Counts& place, int steps, const Visit& visit) const
  {
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      for (const int side : { -steps, steps })
      {
        Counts other = place;
        other[axis] += side;
        if (other[axis] >= 0 && other[axis] < this->Count[axis])
        {
          visit(this->At(other[0], other[1], other[2]));
        }
      }
    }
  }

  /// Middle of a block, mm.
  Vector3 Middle(const Counts& place) const
  {
    const auto index = [&](int axis)
    {
      return this->Grid.extent[2 * axis] +
        this->Factor[axis] * (place[static_cast<std::size_t>(axis)] + 0.5) - 0.5;
    };
    return this->Grid.IndexToWorld(index(0), index(1), index(2));
  }

private:
  ImageGrid Grid;
  Counts Voxels;
  Counts Factor{};
  Counts Count{};
  Vector3 Spacing;
};

/// Pieces with surroundings like air: two blocks away, since the next ones are blurred.
std::vector<bool> InAir(const Blocks& blocks, const std::vector<int>& pieces, int count,
  const Mask& solid, const std::vector<float>& means)
{
  std::vector<double> around(static_cast<std::size_t>(count), 0.0);
  std::vector<std::int64_t> faces(around.size(), 0);
  blocks.ForBlocks(
    [&](const Counts& place, std::size_t n)
    {
      if (pieces[n] < 0)
      {
        return;
      }
      const auto piece = static_cast<std::size_t>(pieces[n]);
      blocks.ForNeighbours(place, 2,
        [&](std::size_t other)
        {
          if (solid[other] == 0)
          {
            around[piece] += means[other];
            ++faces[piece];
          }
        });
    });
  std::vector<bool> inAir(around.size());
  for (std::size_t piece = 0; piece < around.size(); ++piece)
  {
    inAir[piece] =
      faces[piece] > 0 && around[piece] < MostOfAir * static_cast<double>(faces[piece]);
  }
  return inAir;
}

/// How far back a body reaches in every column of a slice and those beside it, mm of y; infinity where that is not the back: where
/// a small field of view cuts the chest, lung lies behind the heart.
std::vector<double> Backs(const Blocks& blocks, const Mask& body)
{
  constexpr double Nowhere = std::numeric_limits<double>::infinity();
  double end = -Nowhere; // of the image
  blocks.ForBlocks(
    [&](const Counts& place, std::size_t) { end = std::max(end, blocks.Middle(place).y()); });
  const std::ptrdiff_t columns = blocks.Columns();
  std::vector<double> backs(blocks.Slices() * columns, -Nowhere);
  blocks.ForBlocks(
    [&](const Counts& place, std::size_t n)
    {
      if (body[n] == 0)
      {
        return;
      }
      const double y = blocks.Middle(place).y();
      const int first = std::max(0, place[0] - BackWindow);
      const int last = std::min(blocks.Columns() - 1, place[0] + BackWindow);
      for (int i = first; i <= last; ++i)
      {
        double& back = backs[static_cast<std::size_t>(place[2]) * columns + i];
        back = std::max(back, y);
      }
    });
  for (auto slice = backs.begin(); slice != backs.end(); slice += columns)
  {
    const double hindmost = *std::max_element(slice, slice + columns);
    std::replace_if(
      slice, slice + columns,
      [&](double back) { return hindmost > end - BackMargin || !(back > hindmost - BackCurve); },
      Nowhere);
  }
  return backs;
}
}

std::int64_t RemoveSurroundings(HounsfieldVolume& volume, const ProgressCallback& progress)
{
  const Blocks blocks(volume);
  const std::vector<float> means = blocks.Means(volume, progress);
  // A thin board shows in the brightest voxel of a block, not in the mean.
  Mask solid(blocks.Number(), 0);
  blocks.ForVoxels(
    [&](std::size_t block, std::size_t voxel)
    {
      if (volume.values[voxel] > Solid)
      {
        solid[block] = 1;
      }
    },
    progress);
  const Mask body = blocks.Opened(solid, ThinnestBody);
  const Mask near = blocks.Grown(body, Rim);
  Mask thin(solid.size());
  std::transform(solid.begin(), solid.end(), near.begin(), thin.begin(),
    [](unsigned char is, unsigned char ofBody)
    { return static_cast<unsigned char>(is != 0 && ofBody == 0); });
  int count = 0;
  const std::vector<int> pieces = blocks.Pieces(thin, count);
  const std::vector<bool> inAir = InAir(blocks, pieces, count, solid, means);
  const std::vector<double> backs = Backs(blocks, body);
  // Its rim, too, but nothing that is solid and stays.
  Mask gone(blocks.Number(), 0);
  blocks.ForBlocks(
    [&](const Counts& place, std::size_t n)
    {
      const double back = backs[static_cast<std::size_t>(place[2]) * blocks.Columns() + place[0]];
      if (pieces[n] >= 0 &&
        (inAir[static_cast<std::size_t>(pieces[n])] || blocks.Middle(place).y() > back + Rim))
      {
        gone[n] = 1;
        blocks.ForNeighbours(
          place, 1, [&](std::size_t other) { gone[other] = solid[other] == 0 ? 1 : gone[other]; });
      }
    });
  std::vector<std::int32_t> changed(blocks.Number(), 0);
  blocks.ForVoxels(
    [&](std::size_t block, std::size_t voxel)
    {
      if (gone[block] != 0 && volume.values[voxel] > NothingThere)
      {
        volume.values[voxel] = NothingThere;
        ++changed[block];
      }
    },
    progress);
  return std::accumulate(changed.begin(), changed.end(), std::int64_t(0));
}

namespace
{
/// Bodies of blood that belong to the heart and its great vessels, 2 in their blocks, 1 in those of their rims.
Mask Bodies(const HounsfieldVolume& volume, const Blocks& blocks, const EnhancedBlood& blood,
  const ProgressCallback& progress)
{
  const std::vector<float> means = blocks.Means(volume, progress);
  Mask bright(means.size(), 0);
  const auto middle = static_cast<float>(0.5 * (blood.tissue + blood.blood));
  std::transform(means.begin(), means.end(), bright.begin(),
    [&](float mean) { return static_cast<unsigned char>(mean > middle); });
  const Mask thick = blocks.Opened(bright, BallRadius);
  int count = 0;
  const std::vector<int> pieces = blocks.Pieces(thick, count);

  struct Body
  {
    std::int64_t size = 0;
    std::int64_t bright = 0; ///< of its blocks
    bool blood = false;
    bool taken = false;
  };
  std::vector<Body> bodies(static_cast<std::size_t>(count));
  std::vector<bool> atRoot(bodies.size(), false);
  const double leastOfBlood = blood.blood - Darker * (blood.blood - blood.tissue);
  blocks.ForBlocks(
    [&](const Counts& place, std::size_t n)
    {
      if (pieces[n] < 0)
      {
        return;
      }
      const auto piece = static_cast<std::size_t>(pieces[n]);
      ++bodies[piece].size;
      bodies[piece].bright += means[n] > leastOfBlood ? 1 : 0;
      const Vector3 middleOfBlock = blocks.Middle(place);
      for (const Vector3& ostium : blood.ostia)
      {
        atRoot[piece] = atRoot[piece] || (middleOfBlock - ostium).norm() < RootReach;
      }
    });
  for (std::size_t piece = 0; piece < bodies.size(); ++piece)
  {
    Body& body = bodies[piece];
    body.blood = static_cast<double>(body.bright) >= MostlyBright * static_cast<double>(body.size);
    body.taken = body.blood && atRoot[piece];
  }

  Mask taken(means.size(), 0);
  for (bool more = true; more;)
  {
    for (std::size_t n = 0; n < taken.size(); ++n)
    {
      taken[n] = pieces[n] >= 0 && bodies[static_cast<std::size_t>(pieces[n])].taken ? 1 : 0;
    }
    const Mask near = blocks.Grown(taken, Gap);
    more = false;
    for (std::size_t n = 0; n < near.size(); ++n)
    {
      if (near[n] != 0 && pieces[n] >= 0)
      {
        Body& body = bodies[static_cast<std::size_t>(pieces[n])];
        more = more || (body.blood && !body.taken);
        body.taken = body.taken || body.blood;
      }
    }
  }
  Mask result = blocks.Grown(taken, Rim);
  std::transform(result.begin(), result.end(), taken.begin(), result.begin(), std::plus<>());
  return result;
}
}

std::int64_t RemoveContrastMedium(HounsfieldVolume& volume, const EnhancedBlood& blood,
  const std::vector<unsigned char>& vessels, const ProgressCallback& progress)
{
  if (!(blood.blood > blood.tissue) || blood.ostia.empty())
  {
    throw std::invalid_argument(
      "contrast medium of a CT: blood has to be brighter than tissue, and an ostium known");
  }
  if (!vessels.empty() && vessels.size() != volume.values.size())
  {
    throw std::invalid_argument("contrast medium of a CT: the mask has another size");
  }
  const Blocks blocks(volume);
  const Mask bodies = Bodies(volume, blocks, blood, progress);
  // Around a lumen, what its blur brightened.
  Mask thin(blocks.Number(), 0);
  if (!vessels.empty())
  {
    blocks.ForVoxels(
      [&](std::size_t block, std::size_t voxel)
      {
        if (vessels[voxel] != 0)
        {
          thin[block] = 1;
        }
      },
      progress);
    thin = blocks.Grown(thin, Rim);
  }
  const auto tissue = static_cast<std::int16_t>(std::lround(blood.tissue));
  const double calcium = Calcium * blood.blood;
  std::vector<std::int32_t> changed(blocks.Number(), 0);
  blocks.ForVoxels(
    [&](std::size_t block, std::size_t voxel)
    {
      std::int16_t& value = volume.values[voxel];
      const bool inside = bodies[block] == 2;
      const bool beside = bodies[block] == 1 || thin[block] != 0;
      if (value > tissue && (inside || (beside && value < calcium)))
      {
        value = tissue;
        ++changed[block];
      }
    },
    progress);
  return std::accumulate(changed.begin(), changed.end(), std::int64_t(0));
}
}
