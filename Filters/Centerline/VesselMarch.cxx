#include "VesselMarch.h"

#include "DistanceTransform.h"
#include "GridIndex.h"
#include "Median.h"
#include "VoxelCell.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace coronary
{
namespace
{
constexpr std::uint32_t None = VoxelRegion::notAMember;

/// 2 % of the 99.99th percentile, by a histogram relative to the greatest: any speed, any unit.
double AutomaticSpeedThreshold(const float* speed, std::int64_t voxels)
{
  float maximum = 0.0F;
  for (std::int64_t v = 0; v < voxels; ++v)
  {
    maximum = std::isfinite(speed[v]) ? std::max(maximum, speed[v]) : maximum;
  }
  std::vector<std::int64_t> histogram(1000, 0);
  if (maximum > 0.0F)
  {
    for (std::int64_t v = 0; v < voxels; ++v)
    {
      if (std::isfinite(speed[v]) && speed[v] > 1e-3F * maximum)
      {
        ++histogram[std::min<std::size_t>(
          999, static_cast<std::size_t>(1000.0F * speed[v] / maximum))];
      }
    }
  }
  std::int64_t above = 0;
  std::size_t bin = 1000;
  const std::int64_t tail = std::max<std::int64_t>(1, voxels / 10000);
  while (bin > 1 && above < tail)
  {
    above += histogram[--bin];
  }
  return 0.02 * static_cast<double>(maximum) * static_cast<double>(bin + 1) / 1000.0;
}
}

VesselMarch::VesselMarch(const CenterlineInput& input, const CenterlineSettings& settings)
  : Input(input)
  , Settings(settings)
  , Voxel(std::cbrt(input.grid.spacing.prod()))
{
  if (!input.speed && !input.wallDistance)
  {
    // A mask alone: fastest where its border is farthest. The border lies half a voxel from the
    // centres of the outermost voxels.
    this->MaskDistance =
      SquaredDistanceTransform(input.mask, GridDimensions(input.grid), input.grid.spacing, {});
    for (float& distance : this->MaskDistance)
    {
      distance = std::min(std::sqrt(distance), 1e6F * static_cast<float>(this->Voxel)) -
        0.5F * static_cast<float>(this->Voxel);
    }
  }
}

const float* VesselMarch::WallDistance() const
{
  return this->Input.wallDistance ? this->Input.wallDistance
    : this->Input.speed           ? nullptr
                                  : this->MaskDistance.data();
}

void VesselMarch::MakeRegion(
  const ImageInterpolator& image, double intensityThreshold, const unsigned char* excluded)
{
  const float* distance = this->WallDistance();
  const float* speed = distance ? distance : this->Input.speed;
  const unsigned char* mask = this->Input.wallDistance ? nullptr : this->Input.mask;
  // A mask is somebody's decision of what is vessel: automatic thresholds, which cut thin branches off
  // where the measure is low, at their roots, do not overrule it.
  const bool decided = mask != nullptr && !distance;
  const bool anySpeed = decided && std::isnan(this->Settings.speedThreshold);
  double speedThreshold = this->Settings.speedThreshold;
  if (distance)
  {
    // Thin vessels hold together where the wall is within half a voxel.
    speedThreshold =
      this->Input.wallDistance ? -0.5 * this->Voxel : -std::numeric_limits<double>::infinity();
  }
  else if (std::isnan(speedThreshold) && !anySpeed)
  {
    speedThreshold =
      AutomaticSpeedThreshold(speed, static_cast<std::int64_t>(GridSize(this->Input.grid)));
  }

  const float threshold =
    anySpeed ? -std::numeric_limits<float>::infinity() : static_cast<float>(speedThreshold);
  const bool gate = this->Input.intensity && std::isfinite(intensityThreshold) &&
    !(decided && std::isnan(this->Settings.intensityThreshold));
  const int columns = GridDimensions(this->Input.grid)[0];
  this->Members = VoxelRegion(this->Input.grid.extent,
    [&](int j, int k, unsigned char* flags)
    {
      const std::array<int, 6>& e = this->Input.grid.extent;
      const std::size_t row = GridOffset(this->Input.grid, e[0], j, k);
      for (int i = 0; i < columns; ++i)
      {
        const std::size_t v = row + static_cast<std::size_t>(i);
        flags[i] = (mask == nullptr || mask[v] != 0) && speed[v] > threshold &&
          (excluded == nullptr || excluded[v] == 0) &&
          (!gate || image.At(this->Input.grid.IndexToWorld(i + e[0], j, k)) > intensityThreshold);
      }
    });
  if (!this->Input.wallDistance)
  {
    // Thin vessels hang together by corners; the front goes through faces.
    this->Members.JoinDiagonals();
  }
}

std::uint32_t VesselMarch::MemberAt(const Vector3& index) const
{
  return this->Members.NumberOf(static_cast<int>(std::lround(index[0])),
    static_cast<int>(std::lround(index[1])), static_cast<int>(std::lround(index[2])));
}

Vector3 VesselMarch::IndexOf(std::uint32_t member) const
{
  Vector3 index = Vector3::Zero();
  this->Members.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      if (number == member)
      {
        const std::array<int, 3> at = this->Members.IndexOf(address);
        index = Vector3(at[0], at[1], at[2]);
      }
    });
  return index;
}

void VesselMarch::March(const ImageInterpolator& image, const LumenReference& reference,
  const std::vector<std::uint32_t>& seedMembers, const ProgressCallback& progress)
{
  const float* distance = this->WallDistance();
  const float* values = distance ? distance : this->Input.speed;
  std::vector<float> speed(this->Members.Size());
  const double shift = distance ? 0.75 * this->Voxel : 0.0;
  this->Members.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      const std::array<int, 3> index = this->Members.IndexOf(address);
      speed[number] = values[GridOffset(this->Input.grid, index[0], index[1], index[2])];
    });
  // Relative to what vessels have here: the upper tenth.
  const std::size_t tenth = speed.size() - 1 - speed.size() / 10;
  const double scale =
    std::max<double>(ValueOfRank(speed, static_cast<double>(tenth)) + shift, 1e-30);
  const double contrast = reference.lumen - reference.background;
  this->Members.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      const double relative = std::min(100.0, std::max(0.0, (speed[number] + shift) / scale));
      double value = 0.01 + std::pow(relative, this->Settings.speedExponent);
      if (this->Input.intensity && contrast > 0.0)
      {
        const std::array<int, 3> index = this->Members.IndexOf(address);
        const double bright =
          (image.At(this->Input.grid.IndexToWorld(index[0], index[1], index[2])) -
            reference.background) /
          contrast;
        const double likely = std::min(1.0, std::max(0.1, bright / 0.7));
        value *= likely * likely;
      }
      speed[number] = static_cast<float>(value);
    });
  this->March(std::move(speed), seedMembers, progress);
}

void VesselMarch::March(std::vector<float> speed, const std::vector<std::uint32_t>& seedMembers,
  const ProgressCallback& progress)
{
  FastMarchingSettings settings;
  settings.spacing = this->Input.grid.spacing;
  std::vector<FastMarchingSource> sources;
  for (std::size_t s = 0; s < seedMembers.size(); ++s)
  {
    if (seedMembers[s] != None)
    {
      // The fastest way begins at the given point if that is in a vessel, else beside it.
      const Vector3 index = GridIndex(this->Input.grid, this->Input.seeds[s]);
      const bool inside = this->MemberAt(index) != None;
      sources.push_back({ inside ? index : this->IndexOf(seedMembers[s]), static_cast<int>(s) });
    }
  }
  this->Front = std::make_unique<FastMarching>(this->Members, std::move(speed), settings, progress);
  this->Front->March(sources);
}

std::uint32_t VesselMarch::NearestMember(const Vector3& index, double reach, bool reachedOnly) const
{
  std::uint32_t nearest = None;
  double minimum = std::numeric_limits<double>::infinity();
  const Vector3 steps =
    Vector3::Constant(reach).cwiseQuotient(this->Input.grid.spacing) + Vector3::Constant(0.5);
  BoxAround(index, steps, this->Members.Box())
    .ForEach(
      [&](int i, int j, int k)
      {
        const std::uint32_t number = this->Members.NumberOf(i, j, k);
        if (number == None || (reachedOnly && !std::isfinite(this->Front->Arrival()[number])))
        {
          return;
        }
        const double distance =
          (Vector3(i, j, k) - index).cwiseProduct(this->Input.grid.spacing).norm();
        if (distance < minimum)
        {
          minimum = distance;
          nearest = number;
        }
      });
  return nearest;
}

bool VesselMarch::Gradient(const Vector3& index, Vector3& gradient) const
{
  const std::vector<float>& arrival = this->Front->Arrival();
  gradient.setZero();
  double total = 0.0;
  const int base[3] = { static_cast<int>(std::floor(index[0])),
    static_cast<int>(std::floor(index[1])), static_cast<int>(std::floor(index[2])) };
  const std::array<double, 3> part = { index[0] - base[0], index[1] - base[1], index[2] - base[2] };
  for (int corner = 0; corner < 8; ++corner)
  {
    const int at[3] = { base[0] + (corner & 1), base[1] + (corner >> 1 & 1),
      base[2] + (corner >> 2) };
    const double weight = TrilinearWeight(corner, part);
    if (weight <= 0.0 || !this->Members.InBox(at[0], at[1], at[2]))
    {
      continue;
    }
    const VoxelRegion::Address address = this->Members.AddressOf(at[0], at[1], at[2]);
    const std::uint32_t centre = this->Members.Number(address);
    if (centre == None || !std::isfinite(arrival[centre]))
    {
      continue;
    }
    total += weight;
    for (int axis = 0; axis < 3; ++axis)
    {
      const std::uint32_t below = this->Members.Number(this->Members.Below(address, axis));
      const std::uint32_t above = this->Members.Number(this->Members.Above(address, axis));
      const double here = arrival[centre];
      const bool low = below != None && std::isfinite(arrival[below]);
      const bool high = above != None && std::isfinite(arrival[above]);
      const double down = low ? here - arrival[below] : 0.0;
      const double up = high ? arrival[above] - here : 0.0;
      gradient[axis] +=
        weight * (low && high ? 0.5 * (down + up) : down + up) / this->Input.grid.spacing[axis];
    }
  }
  if (!(total > 0.0) || !(gradient.norm() > 0.0))
  {
    return false;
  }
  gradient.normalize();
  return true;
}

MinimalPath VesselMarch::Backtrack(
  const Vector3& from, std::uint32_t member, const std::vector<std::int32_t>& owner) const
{
  const std::vector<float>& arrival = this->Front->Arrival();
  const int label = this->Front->Source()[member];
  const Vector3 source =
    GridIndex(this->Input.grid, this->Input.seeds[static_cast<std::size_t>(label)])
      .cwiseProduct(this->Input.grid.spacing);
  const auto memberAt = [&](const Vector3& frame)
  {
    const Vector3 index = frame.cwiseQuotient(this->Input.grid.spacing);
    const std::uint32_t number = this->MemberAt(index);
    return number != None && std::isfinite(arrival[number]) ? number : None;
  };

  MinimalPath way;
  Vector3 at = from.cwiseProduct(this->Input.grid.spacing);
  way.points.push_back(at);
  std::uint32_t here = member;
  // The earliest voxel on the way so far, and where the way was there.
  std::uint32_t earliest = member;
  std::size_t earliestSize = 1;
  int idle = 0;
  const double step = 0.3 * this->Input.grid.spacing.minCoeff();
  const double near = 1.5 * this->Input.grid.spacing.maxCoeff();
  for (;;)
  {
    if (owner[here] != MinimalPath::noOwner)
    {
      way.owner = owner[here];
      return way;
    }
    if ((at - source).norm() < near || arrival[here] <= 0.0F)
    {
      way.points.push_back(source);
      return way;
    }
    // Fourth-order Runge-Kutta along the direction of steepest descent.
    const auto direction = [&](const Vector3& frame, Vector3& result)
    { return this->Gradient(frame.cwiseQuotient(this->Input.grid.spacing), result); };
    Vector3 k1;
    Vector3 k2;
    Vector3 k3;
    Vector3 k4;
    bool moved = false;
    if (idle < 10 && direction(at, k1) && direction(at - 0.5 * step * k1, k2) &&
      direction(at - 0.5 * step * k2, k3) && direction(at - step * k3, k4))
    {
      const Vector3 next = at - step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
      const std::uint32_t there = memberAt(next);
      if (there != None && (next - at).norm() > 0.3 * step)
      {
        at = next;
        here = there;
        moved = true;
        ++idle;
        way.points.push_back(at);
        if (arrival[here] < arrival[earliest])
        {
          earliest = here;
          earliestSize = way.points.size();
          idle = 0;
        }
      }
    }
    if (!moved)
    {
      // In a kink or on a plateau the descent goes to and fro: from its earliest voxel to the
      // earliest neighbour. So every ten steps the way comes to an earlier voxel, and ends.
      idle = 0;
      way.points.resize(earliestSize);
      const Vector3 index = way.points.back().cwiseQuotient(this->Input.grid.spacing);
      std::uint32_t best = earliest;
      for (int k = -1; k <= 1; ++k)
      {
        for (int j = -1; j <= 1; ++j)
        {
          for (int i = -1; i <= 1; ++i)
          {
            const Vector3 next(
              std::lround(index[0]) + i, std::lround(index[1]) + j, std::lround(index[2]) + k);
            const std::uint32_t number = this->Members.NumberOf(
              static_cast<int>(next[0]), static_cast<int>(next[1]), static_cast<int>(next[2]));
            if (number != None && arrival[number] < arrival[best])
            {
              best = number;
              at = next.cwiseProduct(this->Input.grid.spacing);
            }
          }
        }
      }
      if (best == earliest)
      {
        // A source's own voxel, or a hollow that rounding made.
        way.closed = (way.points.back() - source).norm() < 4.0 * near;
        way.points.push_back(source);
        return way;
      }
      here = best;
      earliest = best;
      way.points.push_back(at);
      earliestSize = way.points.size();
    }
  }
}

std::size_t VesselMarch::MemorySize() const
{
  return this->Front->MemorySize() + this->MaskDistance.size() * sizeof(float);
}
}
