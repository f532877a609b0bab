// The wall of what was collected to less than a voxel, islands and holes.
#include "VoxelSegmentation.h"

#include "DistanceTransform.h"
#include "SlicePieces.h"

#include <cmath>
#include <limits>

namespace coronary
{
/**
 * Lumen and surroundings by blocks: the brightest smoothed member, and the mean outside the band.
 * @param reach  blocks around one that its values are taken from, for each axis
 */
template <typename T>
BlockValues VoxelSegmentation<T>::MeasureBlocks(
  const std::array<int, 3>& reach, const ProgressCallback& progress) const
{
  BlockValues near(this->L.Blocks);
  for (const Member& m : this->Members)
  {
    const std::array<int, 3> at = this->L.Place(m.voxel);
    float sum = static_cast<float>(this->Image[m.voxel]);
    int count = 1;
    for (const VoxelLattice::Neighbour& n : this->L.Around)
    {
      if (std::abs(n.di) + std::abs(n.dj) + std::abs(n.dk) == 1 &&
        this->L.Contains(at[0] + n.di, at[1] + n.dj, at[2] + n.dk))
      {
        sum += static_cast<float>(this->Image[m.voxel + n.offset]);
        ++count;
      }
    }
    float& lumen = near.values[near.Number(this->L.PlaceOfBlock(at))].lumen;
    lumen = std::max(lumen, sum / static_cast<float>(count));
  }
  near.Grow(reach, 2);
  ParallelFor(
    static_cast<std::int64_t>(near.values.size()), 4096,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        BlockValue& block = near.values[static_cast<std::size_t>(n)];
        const std::array<int, 3> corner{ block.place[0] * this->L.Factor[0],
          block.place[1] * this->L.Factor[1], block.place[2] * this->L.Factor[2] };
        for (int k = corner[2]; k < std::min(this->L.Size[2], corner[2] + this->L.Factor[2]); ++k)
        {
          for (int j = corner[1]; j < std::min(this->L.Size[1], corner[1] + this->L.Factor[1]); ++j)
          {
            for (int i = corner[0]; i < std::min(this->L.Size[0], corner[0] + this->L.Factor[0]);
                 ++i)
            {
              const std::int64_t p = this->L.Index(i, j, k);
              const auto value = static_cast<float>(this->Image[p]);
              if (this->States[p] == Unknown && std::isfinite(value) && this->Likelihood(p) < 0.5f)
              {
                block.outsideSum += value;
                block.outsideCount += 1.0f;
              }
            }
          }
        }
      }
    },
    progress);
  return near;
}

template <typename T>
void VoxelSegmentation<T>::RefineWall(
  std::vector<float>* probability, const ProgressCallback& progress)
{
  // Wide enough for the next voxel along each axis, mm.
  const Vector3 band = (1.2 * this->L.Spacing).cwiseMax(0.8);
  // How far from a voxel its lumen is looked for, mm: a place in the band must find it.
  const Vector3 lumenReach = (1.2 * this->L.BlockSpacing).cwiseMax(1.5);
  constexpr double surroundings = 1.8; // mm: how far the local values are taken from

  // The band, from the members that have a neighbour outside.
  std::vector<std::int64_t> candidates;
  for (const Member& m : this->Members)
  {
    candidates.push_back(m.voxel);
  }
  for (std::size_t m = 0; m < this->Members.size(); ++m)
  {
    const std::array<int, 3> at = this->L.Place(this->Members[m].voxel);
    const bool rim = std::any_of(this->L.Around.begin(), this->L.Around.end(),
      [&](const VoxelLattice::Neighbour& n)
      {
        return this->L.Contains(at[0] + n.di, at[1] + n.dj, at[2] + n.dk) &&
          this->States[this->Members[m].voxel + n.offset] == Unknown;
      });
    if (rim)
    {
      this->L.Ball(at, band.maxCoeff(),
        [&](std::int64_t p, const std::array<int, 3>& place)
        {
          const Vector3 d = this->L.Spacing.cwiseProduct(
            Vector3(place[0] - at[0], place[1] - at[1], place[2] - at[2]));
          if (this->States[p] == Unknown && d.cwiseQuotient(band).squaredNorm() <= 1.0)
          {
            this->States[p] = Band;
            candidates.push_back(p);
          }
        });
    }
  }

  std::array<int, 3> reach;
  for (int axis = 0; axis < 3; ++axis)
  {
    reach[axis] =
      std::max(1, static_cast<int>(std::lround(surroundings / this->L.BlockSpacing[axis])));
  }
  const BlockValues near = this->MeasureBlocks(reach, PartOf(progress, 0.2, 0.4));
  // What the blocks around one count.
  struct Neighbour
  {
    std::array<int, 3> step;
    float weight;
    bool lumen; ///< whether its lumen is looked at
  };
  std::vector<Neighbour> around;
  for (int z = -reach[2]; z <= reach[2]; ++z)
  {
    for (int y = -reach[1]; y <= reach[1]; ++y)
    {
      for (int x = -reach[0]; x <= reach[0]; ++x)
      {
        const Vector3 d = this->L.BlockSpacing.cwiseProduct(Vector3(x, y, z));
        around.push_back({ { x, y, z }, static_cast<float>(std::exp(-0.5 * d.squaredNorm())),
          d.cwiseQuotient(lumenReach).squaredNorm() <= 1.0 });
      }
    }
  }

  // Half way between the two, per candidate.
  if (probability != nullptr)
  {
    probability->assign(this->States.size(), 0.0f);
  }
  const float blood = this->Tissue + 1.0f / this->InverseContrast;
  const float softness = 0.12f / this->InverseContrast;
  std::vector<unsigned char> inside(candidates.size(), 0);
  ParallelFor(
    static_cast<std::int64_t>(candidates.size()), 4096,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const std::int64_t p = candidates[n];
        float brightest = -std::numeric_limits<float>::infinity();
        float sum = 0.0f;
        float weights = 0.0f;
        const std::array<int, 3> at = this->L.PlaceOfBlock(this->L.Place(p));
        for (const Neighbour& neighbour : around)
        {
          const BlockValue* block = near.Find(
            { at[0] + neighbour.step[0], at[1] + neighbour.step[1], at[2] + neighbour.step[2] });
          if (block == nullptr)
          {
            continue;
          }
          sum += neighbour.weight * block->outsideSum;
          weights += neighbour.weight * block->outsideCount;
          if (neighbour.lumen)
          {
            brightest = std::max(brightest, block->lumen);
          }
        }
        brightest = std::min(brightest, blood);
        const float outside = weights > 0.0f ? std::min(sum / weights, brightest) : this->Tissue;
        const float value = static_cast<float>(this->Image[p]);
        const float above = value - 0.5f * (brightest + outside);
        inside[n] = above > 0.0f && std::isfinite(above) ? 1 : 0;
        if (probability != nullptr && std::isfinite(above))
        {
          (*probability)[p] = 1.0f / (1.0f + std::exp(-above / softness));
        }
      }
    },
    PartOf(progress, 0.4, 1.0));
  for (std::size_t n = 0; n < candidates.size(); ++n)
  {
    this->States[candidates[n]] = inside[n] ? Vessel : Unknown;
  }
}

template <typename T>
void VoxelSegmentation<T>::DropIslands()
{
  const auto minimum =
    static_cast<std::size_t>(std::ceil(this->Settings.minimumIslandVolume / this->L.VoxelVolume()));
  constexpr unsigned char seen = 8;
  for (std::size_t p = 0; p < this->States.size(); ++p)
  {
    const std::vector<std::int64_t> piece = this->L.Connected(static_cast<std::int64_t>(p),
      [this](std::int64_t voxel)
      {
        const bool vessel = this->States[voxel] == Vessel;
        this->States[voxel] = vessel ? seen : this->States[voxel];
        return vessel;
      });
    if (piece.size() < minimum)
    {
      for (const std::int64_t q : piece)
      {
        this->States[q] = Unknown;
      }
    }
  }
  for (unsigned char& state : this->States)
  {
    state = state == seen ? static_cast<unsigned char>(Vessel) : state;
  }
}

/// Fills what is closed in on all sides: what a flood along faces from the box's border misses.
template <typename T>
void VoxelSegmentation<T>::FillHoles()
{
  std::array<int, 3> low = this->L.Size;
  std::array<int, 3> high{ -1, -1, -1 };
  for (std::size_t p = 0; p < this->States.size(); ++p)
  {
    if (this->States[p] == Vessel)
    {
      const std::array<int, 3> at = this->L.Place(static_cast<std::int64_t>(p));
      for (int axis = 0; axis < 3; ++axis)
      {
        low[axis] = std::min(low[axis], at[axis]);
        high[axis] = std::max(high[axis], at[axis]);
      }
    }
  }
  if (high[0] < 0)
  {
    return;
  }
  // One voxel of margin, so that the outside is connected.
  const std::array<int, 3> n{ high[0] - low[0] + 3, high[1] - low[1] + 3, high[2] - low[2] + 3 };
  std::vector<unsigned char> open(static_cast<std::size_t>(n[0]) * n[1] * n[2], 0);
  const auto vessel = [&](const std::array<int, 3>& at)
  {
    const int i = at[0] + low[0] - 1;
    const int j = at[1] + low[1] - 1;
    const int k = at[2] + low[2] - 1;
    return this->L.Contains(i, j, k) && this->States[this->L.Index(i, j, k)] == Vessel;
  };
  const auto index = [&](const std::array<int, 3>& at)
  { return (static_cast<std::size_t>(at[2]) * n[1] + at[1]) * n[0] + at[0]; };
  std::vector<std::array<int, 3>> stack{ { 0, 0, 0 } };
  open[0] = 1;
  while (!stack.empty())
  {
    const std::array<int, 3> at = stack.back();
    stack.pop_back();
    for (int face = 0; face < 6; ++face)
    {
      std::array<int, 3> next = at;
      next[face / 2] += face % 2 ? 1 : -1;
      if (next[face / 2] < 0 || next[face / 2] >= n[face / 2] || open[index(next)] || vessel(next))
      {
        continue;
      }
      open[index(next)] = 1;
      stack.push_back(next);
    }
  }
  for (int k = 1; k + 1 < n[2]; ++k)
  {
    for (int j = 1; j + 1 < n[1]; ++j)
    {
      for (int i = 1; i + 1 < n[0]; ++i)
      {
        if (!open[index({ i, j, k })])
        {
          this->States[this->L.Index(i + low[0] - 1, j + low[1] - 1, k + low[2] - 1)] = Vessel;
        }
      }
    }
  }
}

template void VoxelSegmentation<std::int16_t>::RefineWall(
  std::vector<float>*, const ProgressCallback&);
template void VoxelSegmentation<std::int16_t>::DropIslands();
template void VoxelSegmentation<std::int16_t>::FillHoles();
template void VoxelSegmentation<std::uint16_t>::RefineWall(
  std::vector<float>*, const ProgressCallback&);
template void VoxelSegmentation<std::uint16_t>::DropIslands();
template void VoxelSegmentation<std::uint16_t>::FillHoles();
template void VoxelSegmentation<float>::RefineWall(std::vector<float>*, const ProgressCallback&);
template void VoxelSegmentation<float>::DropIslands();
template void VoxelSegmentation<float>::FillHoles();
}
