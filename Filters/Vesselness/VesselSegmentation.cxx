#include "VesselSegmentation.h"

#include "DistanceTransform.h"
#include "Median.h"
#include "SlicePieces.h"
#include "VoxelSegmentation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <stdexcept>
#include <unordered_set>
#include <utility>

namespace coronary
{
namespace
{
// Around a seed: where its vessel is looked for, and what surrounds it, mm.
constexpr double NearSeed = 2.5;
constexpr double FarFromSeed = 12.0;
}

template <typename T>
double VoxelSegmentation<T>::BrightestNear(const std::array<int, 3>& place) const
{
  double best = -std::numeric_limits<double>::infinity();
  this->L.Ball(place, NearSeed,
    [&](std::int64_t, const std::array<int, 3>& at)
    {
      double sum = 0.0;
      int count = 0;
      for (int dk = -1; dk <= 1; ++dk)
      {
        for (int dj = -1; dj <= 1; ++dj)
        {
          for (int di = -1; di <= 1; ++di)
          {
            if (this->L.Contains(at[0] + di, at[1] + dj, at[2] + dk))
            {
              sum +=
                static_cast<double>(this->Image[this->L.Index(at[0] + di, at[1] + dj, at[2] + dk)]);
              ++count;
            }
          }
        }
      }
      best = std::max(best, sum / count);
    });
  return best;
}

template <typename T>
double VoxelSegmentation<T>::ContrastToNoise(const std::array<int, 3>& place) const
{
  // Farther apart than noise of a reconstruction is alike.
  const int lag = std::max(1, static_cast<int>(std::lround(1.2 / this->L.Spacing[0])));
  std::vector<float> values;
  std::vector<float> differences;
  this->L.Ball(place, FarFromSeed,
    [&](std::int64_t p, const std::array<int, 3>& at)
    {
      const auto value = static_cast<float>(this->Image[p]);
      if (!std::isfinite(value))
      {
        return;
      }
      values.push_back(value);
      const float other = this->L.Contains(at[0] + lag, at[1], at[2])
        ? static_cast<float>(this->Image[this->L.Index(at[0] + lag, at[1], at[2])])
        : std::numeric_limits<float>::quiet_NaN();
      if (std::isfinite(other))
      {
        differences.push_back(std::abs(other - value));
      }
    });
  // The median of differences of normally distributed values, as their standard deviation.
  constexpr double deviations = 1.0 / (0.6745 * 1.4142);
  const double noise = deviations * MedianOf(std::move(differences));
  const double contrast = this->BrightestNear(place) - QuantileOf(std::move(values), 0.25);
  return noise > 0.0 ? contrast / noise : std::numeric_limits<double>::infinity();
}

template <typename T>
BloodWindow VoxelSegmentation<T>::MeasureWindow(const std::vector<std::array<int, 3>>& places) const
{
  // Blood: the brightest mean of 3 x 3 x 3 voxels near a seed. Tissue: the median of what is
  // darker than half of it a little farther away; fat and air count as none.
  std::vector<double> bloods;
  std::vector<double> values;
  bool darker = false;
  for (const std::array<int, 3>& place : places)
  {
    const double best = this->BrightestNear(place);
    bloods.push_back(best);
    this->L.Ball(place, FarFromSeed,
      [&](std::int64_t p, const std::array<int, 3>&)
      {
        const auto value = static_cast<float>(this->Image[p]);
        darker = darker || value < 0.5 * best;
        if (value > 0.0f && value < 0.5 * best)
        {
          values.push_back(value);
        }
      });
  }
  BloodWindow window;
  window.blood = MedianOf(std::move(bloods));
  window.tissue = darker ? 0.0 : window.blood;
  if (!values.empty())
  {
    window.tissue = MedianOf(std::move(values));
  }
  return window;
}

/// Near the seeds the brightest vesselness of what is bright belongs to the vessels: most of the
/// rest is inside of the aorta, and gives nearly none.
template <typename T>
double VoxelSegmentation<T>::MeasureTubular(const std::vector<std::array<int, 3>>& places) const
{
  constexpr double radius = 20.0;
  constexpr double percentile = 0.995;
  constexpr double share = 0.6;
  std::vector<double> values;
  for (const std::array<int, 3>& place : places)
  {
    this->L.Ball(place, radius,
      [&](std::int64_t p, const std::array<int, 3>&)
      {
        if (this->Share(p) > 0.4f && std::isfinite(this->Vesselness[p]))
        {
          values.push_back(this->Vesselness[p]);
        }
      });
  }
  const float bright = QuantileOf(std::move(values), percentile);
  return bright > 0.0f ? share * bright : 1.0;
}

template <typename T>
void VoxelSegmentation<T>::FindBodies(const ProgressCallback& progress)
{
  const std::array<int, 3>& blocks = this->L.Blocks;
  std::vector<unsigned char> blood(static_cast<std::size_t>(blocks[0]) * blocks[1] * blocks[2], 0);
  ParallelFor(
    blocks[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      std::vector<float> sums(static_cast<std::size_t>(blocks[0]) * blocks[1]);
      std::vector<int> counts(sums.size());
      for (int c = static_cast<int>(first); c < last; ++c)
      {
        std::fill(sums.begin(), sums.end(), 0.0f);
        std::fill(counts.begin(), counts.end(), 0);
        const int end = std::min(this->L.Size[2], (c + 1) * this->L.Factor[2]);
        for (int k = c * this->L.Factor[2]; k < end; ++k)
        {
          for (int j = 0; j < this->L.Size[1]; ++j)
          {
            const T* row = this->Image + this->L.Index(0, j, k);
            const std::size_t target = static_cast<std::size_t>(j / this->L.Factor[1]) * blocks[0];
            for (int i = 0; i < this->L.Size[0]; ++i)
            {
              const auto value = static_cast<float>(row[i]);
              if (std::isfinite(value))
              {
                sums[target + i / this->L.Factor[0]] += value;
                ++counts[target + i / this->L.Factor[0]];
              }
            }
          }
        }
        for (std::size_t b = 0; b < sums.size(); ++b)
        {
          const float share =
            (sums[b] / static_cast<float>(std::max(1, counts[b])) - this->Tissue) *
            this->InverseContrast;
          blood[static_cast<std::size_t>(c) * sums.size() + b] =
            counts[b] > 0 && share > 0.5f ? 1 : 0;
        }
      }
    },
    PartOf(progress, 0.0, 0.3));
  std::vector<unsigned char> body = OpenWithBall(blood.data(), blocks, this->L.BlockSpacing,
    this->Settings.maximumRadius, PartOf(progress, 0.3, 0.7));
  blood = std::vector<unsigned char>();
  // The rim of a body is bright as well, and no vessel unless it is tubular.
  for (unsigned char& b : body)
  {
    b = b ? 0 : 1;
  }
  const double rim = 1.1 * this->L.BlockSpacing.maxCoeff();
  const std::vector<unsigned char> near =
    NearZeros(body.data(), blocks, this->L.BlockSpacing, rim * rim, PartOf(progress, 0.7, 0.9));
  this->States.assign(
    static_cast<std::size_t>(this->L.Size[0]) * this->L.Size[1] * this->L.Size[2], Unknown);
  ParallelFor(
    this->L.Size[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (int k = static_cast<int>(first); k < last; ++k)
      {
        for (int j = 0; j < this->L.Size[1]; ++j)
        {
          for (int i = 0; i < this->L.Size[0]; ++i)
          {
            const std::int64_t p = this->L.Index(i, j, k);
            const std::int64_t block = this->L.BlockOf({ i, j, k });
            if (body[block] == 0 || (near[block] != 0 && !(this->Vesselness[p] >= this->Tubular)))
            {
              this->States[p] = Body;
            }
          }
        }
      }
    },
    PartOf(progress, 0.9, 1.0));
}

/// A chamber that is dimmer than the arteries, in much noise: so many of its voxels look like vessel that they hang
/// together, though no ball is full of them. Means tell it.
template <typename T>
void VoxelSegmentation<T>::FindNoisyBodies(const ProgressCallback& progress)
{
  constexpr double cellSize = 2.0; // mm
  // So many standard deviations above the mean a fortieth of all voxels looks like vessel by brightness. In a lattice of
  // 26 neighbours a tenth hangs together (site percolation: 0.098, Kurzawski and Malarz, Rep. Math. Phys. 70, 2012); what
  // noise makes tubular does the rest.
  constexpr double exceeded = 2.0;
  constexpr double surelyBlood = 0.7;
  std::array<int, 3> factor{};
  std::array<int, 3> cells{};
  Vector3 spacing;
  for (int axis = 0; axis < 3; ++axis)
  {
    factor[axis] = std::max(1, static_cast<int>(std::lround(cellSize / this->L.Spacing[axis])));
    cells[axis] = (this->L.Size[axis] + factor[axis] - 1) / factor[axis];
    spacing[axis] = this->L.Spacing[axis] * factor[axis];
  }
  const auto cellOf = [&](int i, int j, int k)
  {
    return (static_cast<std::size_t>(k / factor[2]) * cells[1] + j / factor[1]) * cells[0] +
      i / factor[0];
  };
  const std::size_t count = static_cast<std::size_t>(cells[0]) * cells[1] * cells[2];
  std::vector<float> means(count, 0.0f);
  std::vector<float> deviations(count, 0.0f);
  std::vector<int> counts(count, 0);
  ParallelFor(
    cells[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      const int end = std::min(this->L.Size[2], static_cast<int>(last) * factor[2]);
      for (int k = static_cast<int>(first) * factor[2]; k < end; ++k)
      {
        for (int j = 0; j < this->L.Size[1]; ++j)
        {
          for (int i = 0; i < this->L.Size[0]; ++i)
          {
            const float share = this->Share(this->L.Index(i, j, k));
            if (std::isfinite(share))
            {
              const std::size_t cell = cellOf(i, j, k);
              means[cell] += share;
              deviations[cell] += share * share;
              ++counts[cell];
            }
          }
        }
      }
    },
    PartOf(progress, 0.0, 0.5));
  std::vector<double> noises;
  for (std::size_t c = 0; c < count; ++c)
  {
    const auto n = static_cast<float>(std::max(1, counts[c]));
    means[c] /= n;
    deviations[c] = std::sqrt(std::max(0.0f, deviations[c] / n - means[c] * means[c]));
    if (counts[c] > 1 && means[c] > surelyBlood)
    {
      noises.push_back(deviations[c]);
    }
  }
  const double weakShare = 0.3 + 0.45 * this->Settings.weak;
  const double minimum = weakShare - exceeded * MedianOf(std::move(noises));
  if (minimum >= 0.5)
  {
    return; // FindBodies() has them
  }
  std::vector<unsigned char> bright(count);
  for (std::size_t c = 0; c < count; ++c)
  {
    bright[c] = means[c] > minimum ? 1 : 0;
  }
  // Vessels fill cells only in part: half a cell more is surely none.
  std::vector<unsigned char> body = OpenWithBall(bright.data(), cells, spacing,
    this->Settings.maximumRadius + 0.5 * spacing.maxCoeff(), PartOf(progress, 0.5, 1.0));
  for (int k = 0; k < this->L.Size[2]; ++k)
  {
    for (int j = 0; j < this->L.Size[1]; ++j)
    {
      for (int i = 0; i < this->L.Size[0]; ++i)
      {
        // A vessel on its surface may share a cell with it.
        const std::int64_t p = this->L.Index(i, j, k);
        if (body[cellOf(i, j, k)] != 0 && !(this->Vesselness[p] >= this->Tubular))
        {
          this->States[p] = Body;
        }
      }
    }
  }
}

template <typename T>
void VoxelSegmentation<T>::Collect(const std::vector<VesselSeed>& seeds,
  const std::vector<std::array<int, 3>>& places, const ProgressCallback& progress)
{
  // The rim that belongs to no vessel is Body; around a seed the vessel begins in it.
  constexpr double mouth = 6.0; // mm
  const double ballRadius = std::max(2.0, 1.5 * this->L.Spacing.maxCoeff());
  for (std::size_t s = 0; s < seeds.size(); ++s)
  {
    if (seeds[s].axis.squaredNorm() > 0.0)
    {
      const Vector3 axis = seeds[s].axis.normalized();
      // A cylinder along the axis, open; what lies before the ostium is aorta.
      this->L.Ball(places[s], mouth,
        [&](std::int64_t p, const std::array<int, 3>& at)
        {
          const Vector3 d = this->L.World(at) - seeds[s].position;
          const double along = d.dot(axis);
          const double across = (d - along * axis).norm();
          if (along < 0.0)
          {
            this->States[p] = Body;
          }
          else if (across < 0.75 * this->Settings.maximumRadius && this->States[p] == Body)
          {
            this->States[p] = Unknown;
          }
        });
    }
    else
    {
      this->L.Ball(places[s], ballRadius,
        [&](std::int64_t p, const std::array<int, 3>&)
        {
          if (this->States[p] == Body)
          {
            this->States[p] = Unknown;
          }
        });
    }
  }

  struct Entry
  {
    float path;
    std::int32_t
      origin; ///< number of the seed, times Ways, and of the neighbour that it was reached from
    std::int64_t voxel;
    bool operator<(const Entry& other) const
    {
      return this->path != other.path ? this->path > other.path : this->voxel > other.voxel;
    }
  };
  constexpr std::int32_t ways = 32;
  constexpr std::int32_t none = ways - 1;
  std::priority_queue<Entry> queue;
  // The shortest path that waits for a voxel: a longer one need not wait as well.
  SparseVoxels<float> shortest = this->Sparse(std::numeric_limits<float>::infinity());
  const auto weak = static_cast<float>(this->Settings.weak);
  for (std::size_t s = 0; s < seeds.size(); ++s)
  {
    this->L.Ball(places[s], ballRadius,
      [&](std::int64_t p, const std::array<int, 3>& at)
      {
        if (((this->States[p] == Unknown && this->Likelihood(p) >= weak) ||
              this->States[p] == Bridge) &&
          shortest.Get(at) > 0.0f)
        {
          shortest.At(at) = 0.0f;
          queue.push({ 0.0f, static_cast<std::int32_t>(s) * ways + none, p });
        }
      });
  }
  const auto longest = static_cast<float>(this->Settings.longestPath);
  std::int64_t popped = 0;
  while (!queue.empty())
  {
    const Entry top = queue.top();
    queue.pop();
    if (this->States[top.voxel] != Unknown && this->States[top.voxel] != Bridge)
    {
      continue;
    }
    this->States[top.voxel] = Vessel;
    const std::int32_t way = top.origin % ways;
    this->Members.push_back({ top.voxel, top.path, top.origin / ways,
      way == none ? -1 : top.voxel - this->L.Around[static_cast<std::size_t>(way)].offset });
    if (++popped % 65536 == 0)
    {
      Report(progress, std::min(1.0f, top.path / longest));
    }
    const std::array<int, 3> at = this->L.Place(top.voxel);
    for (std::size_t w = 0; w < this->L.Around.size(); ++w)
    {
      const VoxelLattice::Neighbour& n = this->L.Around[w];
      if (!this->L.Contains(at[0] + n.di, at[1] + n.dj, at[2] + n.dk))
      {
        continue;
      }
      const std::int64_t q = top.voxel + n.offset;
      const float path = top.path + n.length;
      const bool free =
        (this->States[q] == Unknown && this->Likelihood(q) >= weak) || this->States[q] == Bridge;
      if (!free || path > longest)
      {
        continue;
      }
      float& minimum = shortest.At(at[0] + n.di, at[1] + n.dj, at[2] + n.dk);
      if (path < minimum)
      {
        minimum = path;
        queue.push({ path, top.origin / ways * ways + static_cast<std::int32_t>(w), q });
      }
    }
  }
}

/// Slices of equal path length fall into connected pieces; a piece's parents are the pieces of the
/// slice before that touch it.
template <typename T>
void VoxelSegmentation<T>::CutLeakage()
{
  const double thickness = std::max(1.5, 1.5 * this->L.Spacing.maxCoeff());
  const double maximumArea =
    1.6 * 3.14159265358979 * this->Settings.maximumRadius * this->Settings.maximumRadius;
  const SparseVoxels<std::int32_t> numbers = this->MemberNumbers();
  const auto sliceOf = [&](std::int32_t m)
  { return static_cast<int>(this->Members[m].path / thickness); };
  const auto visit = [&](std::int32_t m, const auto& f)
  {
    const std::array<int, 3> at = this->L.Place(this->Members[m].voxel);
    for (const VoxelLattice::Neighbour& n : this->L.Around)
    {
      const std::int32_t other = numbers.Get(at[0] + n.di, at[1] + n.dj, at[2] + n.dk);
      if (other >= 0)
      {
        f(other);
      }
    }
  };
  std::vector<std::int32_t> pieceOf(this->Members.size(), -1);
  std::vector<SlicePiece> pieces;
  std::vector<std::int32_t> stack;
  const auto strong = static_cast<float>(this->Settings.strong);
  for (std::size_t m = 0; m < this->Members.size(); ++m)
  {
    if (pieceOf[m] >= 0)
    {
      continue;
    }
    const auto piece = static_cast<std::int32_t>(pieces.size());
    pieces.emplace_back();
    pieces[piece].slice = sliceOf(static_cast<std::int32_t>(m));
    stack.assign(1, static_cast<std::int32_t>(m));
    pieceOf[m] = piece;
    while (!stack.empty())
    {
      const std::int32_t n = stack.back();
      stack.pop_back();
      ++pieces[piece].voxels;
      pieces[piece].tube = std::max(pieces[piece].tube, this->Vesselness[this->Members[n].voxel]);
      pieces[piece].strong =
        pieces[piece].strong || this->Likelihood(this->Members[n].voxel) >= strong;
      visit(n,
        [&](std::int32_t o)
        {
          if (pieceOf[o] < 0 && sliceOf(o) == pieces[piece].slice)
          {
            pieceOf[o] = piece;
            stack.push_back(o);
          }
        });
    }
  }
  // Larger than a vessel; or large, and nowhere like a tube, as the rims of chambers are.
  for (SlicePiece& piece : pieces)
  {
    const double area = static_cast<double>(piece.voxels) * this->L.VoxelVolume() / thickness;
    const bool rim = area > 0.15 * maximumArea && piece.tube < 0.5f * this->Tubular;
    piece.dropped = (area > maximumArea && piece.slice > 0) ||
      (rim && thickness * piece.slice > 2.0 * this->Settings.maximumRadius);
  }
  std::vector<std::pair<std::int32_t, std::int32_t>> contacts;
  for (std::size_t m = 0; m < this->Members.size(); ++m)
  {
    visit(static_cast<std::int32_t>(m),
      [&](std::int32_t o)
      {
        const std::pair<std::int32_t, std::int32_t> contact(pieceOf[m], pieceOf[o]);
        if (contact.first < contact.second && (contacts.empty() || contacts.back() != contact))
        {
          contacts.push_back(contact);
        }
      });
  }
  DropTwigs(pieces, std::move(contacts));
  // What can still be reached from the seeds without the dropped pieces.
  std::vector<char> reached(this->Members.size(), 0);
  stack.clear();
  for (std::size_t m = 0; m < this->Members.size() && this->Members[m].path <= 0.0f; ++m)
  {
    reached[m] = 1;
    stack.push_back(static_cast<std::int32_t>(m));
  }
  while (!stack.empty())
  {
    const std::int32_t n = stack.back();
    stack.pop_back();
    visit(n,
      [&](std::int32_t o)
      {
        if (!reached[o] && !pieces[pieceOf[o]].dropped)
        {
          reached[o] = 1;
          stack.push_back(o);
        }
      });
  }
  std::vector<Member> kept;
  for (std::size_t m = 0; m < this->Members.size(); ++m)
  {
    if (reached[m])
    {
      kept.push_back(this->Members[m]);
    }
    else
    {
      const SlicePiece& piece = pieces[pieceOf[m]];
      this->States[this->Members[m].voxel] = piece.dropped && !piece.twig ? Leak : Unknown;
      this->Leakage += piece.twig ? 0.0 : this->L.VoxelVolume();
    }
  }
  this->Members = std::move(kept);
}

/**
 * Seeds that hardly anything hangs on: what begins there may be hidden by a lesion.
 * @param seen  mm of vessel that are enough to go on from
 */
template <typename T>
std::vector<VesselRoot> VoxelSegmentation<T>::HiddenRoots(
  const std::vector<VesselSeed>& seeds, double seen) const
{
  constexpr double minimum = 2.0; // mm: less has no direction, and may be the aorta's blurred wall
  std::vector<const Member*> farthest(seeds.size(), nullptr);
  for (const Member& m : this->Members)
  {
    const auto s = static_cast<std::size_t>(m.seed);
    if (farthest[s] == nullptr || m.path > farthest[s]->path)
    {
      farthest[s] = &m;
    }
  }
  std::vector<VesselRoot> roots;
  for (std::size_t s = 0; s < seeds.size(); ++s)
  {
    const double path = farthest[s] != nullptr ? static_cast<double>(farthest[s]->path) : 0.0;
    if (path >= seen || !(seeds[s].axis.squaredNorm() > 0.0))
    {
      continue;
    }
    const Vector3 axis = seeds[s].axis.normalized();
    VesselRoot root{ seeds[s].position + minimum * axis, axis, minimum };
    if (path > minimum)
    {
      // The middle of its blunt end.
      Vector3 sum = Vector3::Zero();
      int count = 0;
      for (const Member& m : this->Members)
      {
        if (static_cast<std::size_t>(m.seed) == s && static_cast<double>(m.path) > path - 1.0)
        {
          sum += this->L.World(this->L.Place(m.voxel));
          ++count;
        }
      }
      root.position = sum / count;
      const Vector3 way = root.position - seeds[s].position;
      root.reach = way.norm();
      root.outwards = (axis + way.normalized()).normalized();
    }
    roots.push_back(root);
  }
  return roots;
}

/// Round by round what hangs on nothing is linked to what is there, and collected from there on.
template <typename T>
void VoxelSegmentation<T>::CrossLesions(const std::vector<VesselSeed>& seeds,
  const std::vector<std::array<int, 3>>& places, const ProgressCallback& progress)
{
  const ImageInterpolator interpolator(this->Whole);
  const auto weak = static_cast<float>(this->Settings.weak);
  // Where nothing is collected at a seed, links arrive at its first voxels.
  std::vector<std::int64_t> bare;
  LinkingImage image{ this->L, interpolator,
    static_cast<double>(this->Tissue + 1.0f / this->InverseContrast),
    static_cast<double>(this->Tissue), this->Settings.maximumRadius,
    [this](std::int64_t p) { return this->Share(p); },
    [this](std::int64_t p) { return this->Vesselness[p] * this->InverseTubular; },
    [this, weak](std::int64_t p)
    { return this->States[p] == Unknown && this->Likelihood(p) >= weak; },
    [this, &bare](std::int64_t p)
    { return this->States[p] == Vessel || std::find(bare.begin(), bare.end(), p) != bare.end(); },
    [this](std::int64_t p) { return this->States[p] == Body || this->States[p] == Leak; }, {} };
  LinkingSettings settings;
  settings.minimumConfidence = this->Settings.minimumLinkConfidence;
  settings.longestGap = this->Settings.longestGap;
  // Each round can only add; more than a handful of lesions in a row does not happen.
  constexpr int rounds = 8;
  VesselLinker linker(image, settings);
  std::unordered_set<std::int64_t> refused;
  for (int round = 0; round < rounds; ++round)
  {
    std::vector<std::pair<std::int64_t, float>> tree;
    tree.reserve(this->Members.size());
    for (const Member& m : this->Members)
    {
      tree.emplace_back(m.voxel, m.path);
    }
    image.roots = this->HiddenRoots(seeds, settings.minimumPiece);
    bare.clear();
    for (const VesselRoot& root : image.roots)
    {
      const std::optional<std::array<int, 3>> first =
        this->L.Nearest(root.position - 0.5 * root.reach * root.outwards);
      if (first)
      {
        const std::int64_t voxel = this->L.Index((*first)[0], (*first)[1], (*first)[2]);
        if (this->States[voxel] == Unknown)
        {
          bare.push_back(voxel);
          tree.emplace_back(voxel, 0.0f);
        }
      }
    }
    if (tree.empty())
    {
      break;
    }
    std::vector<VesselLink> links = linker.Find(
      tree, PartOf(progress, static_cast<double>(round) / rounds, (round + 1.0) / rounds));
    for (ConsideredLink& link : linker.TakeConsidered())
    {
      this->Considered.push_back(std::move(link));
    }
    // What was linked once and dropped again would be so in every round.
    links.erase(std::remove_if(links.begin(), links.end(),
                  [&](const VesselLink& link) { return refused.count(link.voxels.back()) != 0; }),
      links.end());
    if (links.empty())
    {
      break;
    }
    for (VesselLink& link : links)
    {
      this->Links.push_back(std::move(link));
    }
    for (const Member& m : this->Members)
    {
      this->States[m.voxel] = Unknown;
    }
    for (const VesselLink& link : this->Links)
    {
      for (const std::int64_t voxel : link.voxels)
      {
        if (this->States[voxel] == Unknown)
        {
          this->States[voxel] = Bridge;
        }
      }
    }
    this->Members.clear();
    this->Leakage = 0.0;
    this->Collect(seeds, places, {});
    this->CutLeakage();
    // A link leads to something, or it is none.
    const auto dead = std::stable_partition(this->Links.begin(), this->Links.end(),
      [&](const VesselLink& link) { return this->States[link.voxels.back()] == Vessel; });
    for (auto link = dead; link != this->Links.end(); ++link)
    {
      refused.insert(link->voxels.back());
      for (const std::int64_t voxel : link->voxels)
      {
        if (this->States[voxel] == Bridge)
        {
          this->States[voxel] = Unknown;
        }
      }
    }
    this->Links.erase(dead, this->Links.end());
  }
  for (unsigned char& state : this->States)
  {
    state = state == Leak || state == Bridge ? static_cast<unsigned char>(Unknown) : state;
  }
}

/// A narrow place may lie within a wall that was put half way between wide places: what is behind it keeps the
/// way that it was collected by.
template <typename T>
void VoxelSegmentation<T>::KeepConnected()
{
  const SparseVoxels<std::int32_t> numbers = this->MemberNumbers();
  constexpr unsigned char connected = 8;
  const auto flood = [&](std::int64_t from)
  {
    this->L.Connected(from,
      [this](std::int64_t voxel)
      {
        const bool vessel = this->States[voxel] == Vessel;
        this->States[voxel] = vessel ? connected : this->States[voxel];
        return vessel;
      });
  };
  // In the order of their paths: what is before a member is decided when it comes.
  for (const Member& m : this->Members)
  {
    if (m.before < 0 && this->States[m.voxel] == Vessel)
    {
      flood(m.voxel);
    }
    if (this->States[m.voxel] != Vessel)
    {
      continue;
    }
    std::vector<std::int64_t> way;
    std::int64_t at = m.before;
    while (at >= 0 && this->States[at] != connected)
    {
      way.push_back(at);
      const std::int32_t before = numbers.Get(this->L.Place(at));
      at = before < 0 ? -1 : this->Members[static_cast<std::size_t>(before)].before;
    }
    for (const std::int64_t voxel : way)
    {
      this->States[voxel] = Vessel;
    }
    flood(m.voxel);
  }
  for (unsigned char& state : this->States)
  {
    state = state == connected ? static_cast<unsigned char>(Vessel) : state;
  }
}

template <typename T>
VesselSegmentationResult VoxelSegmentation<T>::Run(
  const std::vector<VesselSeed>& seeds, bool probability, const ProgressCallback& progress)
{
  std::vector<std::array<int, 3>> places;
  for (std::size_t s = 0; s < seeds.size(); ++s)
  {
    const std::optional<std::array<int, 3>> place = this->L.Nearest(seeds[s].position);
    if (!place)
    {
      throw std::invalid_argument("seed " + std::to_string(s) + " is outside the image");
    }
    if (!seeds[s].axis.allFinite())
    {
      throw std::invalid_argument("the axis of seed " + std::to_string(s) + " is not finite");
    }
    places.push_back(*place);
  }
  VesselSegmentationResult result;
  for (const std::array<int, 3>& place : places)
  {
    result.seedContrast.push_back(this->ContrastToNoise(place));
  }
  result.window = this->Settings.window ? *this->Settings.window : this->MeasureWindow(places);
  const double contrast = result.window.blood - result.window.tissue;
  if (!(contrast > 0.0) || !std::isfinite(contrast))
  {
    throw std::invalid_argument(this->Settings.window
        ? "window.blood must be above window.tissue"
        : "nothing is brighter than its surroundings at the seeds");
  }
  this->Tissue = static_cast<float>(result.window.tissue);
  this->InverseContrast = static_cast<float>(1.0 / contrast);
  this->Tubular = static_cast<float>(
    this->Settings.tubular ? *this->Settings.tubular : this->MeasureTubular(places));
  this->InverseTubular = 1.0f / this->Tubular;
  result.tubular = this->Tubular;

  this->FindBodies(PartOf(progress, 0.0, 0.2));
  this->FindNoisyBodies(PartOf(progress, 0.2, 0.3));
  this->Collect(seeds, places, PartOf(progress, 0.3, 0.5));
  result.seedVolume.assign(seeds.size(), 0.0);
  this->CutLeakage();
  if (this->Settings.crossLesions)
  {
    this->CrossLesions(seeds, places, PartOf(progress, 0.5, 0.6));
  }
  for (const Member& m : this->Members)
  {
    result.seedVolume[m.seed] += this->L.VoxelVolume();
  }
  result.leakageVolume = this->Leakage;
  Report(progress, 0.6);
  if (this->Settings.refineWall || probability)
  {
    const std::vector<unsigned char> collected =
      this->Settings.refineWall ? std::vector<unsigned char>() : this->States;
    this->RefineWall(probability ? &result.probability : nullptr, PartOf(progress, 0.6, 0.9));
    if (!this->Settings.refineWall)
    {
      this->States = collected;
    }
    else if (this->Settings.crossLesions)
    {
      this->KeepConnected();
    }
  }
  this->DropIslands();
  if (this->Settings.fillHoles)
  {
    this->FillHoles();
  }
  for (unsigned char& state : this->States)
  {
    state = state == Vessel ? 1 : 0;
  }
  result.mask = std::move(this->States);
  result.links = std::move(this->Links);
  result.considered = std::move(this->Considered);
  if (probability)
  {
    // A filled hole is vessel; a dropped island is none.
    const float justBelow = std::nextafter(0.5f, 0.0f);
    for (std::size_t p = 0; p < result.mask.size(); ++p)
    {
      float& value = result.probability[p];
      value = result.mask[p] ? std::max(value, 0.5f) : std::min(value, justBelow);
    }
  }
  Report(progress, 1.0);
  return result;
}

void VesselSegmentationSettings::Validate() const
{
  const auto check = [](bool good, const char* what)
  {
    if (!good)
    {
      throw std::invalid_argument(what);
    }
  };
  check(!this->window ||
      (this->window->blood > this->window->tissue && std::isfinite(this->window->blood) &&
        std::isfinite(this->window->tissue)),
    "window.blood must be above window.tissue");
  check(this->strong >= 0.0 && this->strong <= 1.0, "strong must be 0 to 1");
  check(this->weak > 0.0 && this->weak <= this->strong, "weak must be above 0, at most strong");
  check(!this->tubular || (*this->tubular > 0.0 && std::isfinite(*this->tubular)),
    "tubular must be positive");
  check(
    this->maximumRadius >= 1.0 && this->maximumRadius <= 50.0, "maximumRadius must be 1 to 50 mm");
  check(
    this->longestPath > 0.0 && std::isfinite(this->longestPath), "longestPath must be positive");
  check(this->longestGap >= 0.0 && this->longestGap <= 40.0, "longestGap must be 0 to 40 mm");
  check(this->minimumLinkConfidence >= 0.0 && this->minimumLinkConfidence <= 1.0,
    "minimumLinkConfidence must be 0 to 1");
  check(this->minimumIslandVolume >= 0.0 && std::isfinite(this->minimumIslandVolume),
    "minimumIslandVolume must not be negative");
}

VesselSegmentationResult SegmentVessels(const ScalarImage& image, const float* vesselness,
  const std::vector<VesselSeed>& seeds, const VesselSegmentationSettings& settings,
  bool probability, const ProgressCallback& progress)
{
  settings.Validate();
  if (seeds.empty())
  {
    throw std::invalid_argument("there is no seed");
  }
  const std::array<int, 3> size = image.Dimensions();
  if (size[0] < 1 || size[1] < 1 || size[2] < 1 || !(image.grid.spacing.minCoeff() > 0.0))
  {
    throw std::invalid_argument("the image is empty");
  }
  return std::visit(
    [&](const auto* values)
    {
      VoxelSegmentation segmentation(values, image, vesselness, settings);
      return segmentation.Run(seeds, probability, progress);
    },
    image.values);
}
}
