#include "ThinBranches.h"

#include "CrossFrame.h"
#include "Median.h"
#include "ParallelFor.h"
#include "Require.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <unordered_map>
#include <utility>

namespace coronary
{
namespace
{
constexpr int Sectors = 8;
/// Share of a branch's length by which it must depart from the tree, up to a length in voxels.
constexpr double MinimumDeparture = 0.35;
constexpr double FullDeparture = 40.0;
/// Share of the contrast by which the way from the parent may be darker than the branch itself.
constexpr double DeepestValley = 0.1;
/// Share of the contrast that a path must show on every side, mean.
constexpr double MinimumContrast = 0.12;
/// Standard errors of noise that the path's mean must exceed.
constexpr double Significance = 8.0;
/// Length of the paths that say what noise alone shows, in samples.
constexpr std::size_t NoiseSamples = 32;
/// Spreads by which a new branch must exceed them, since it is the best of thousands that were tried, and by which a tip
/// must that goes on.
constexpr double BeyondNoise = 5.0;
constexpr double TipBeyondNoise = 2.0;
/// Distance of a path's samples, in voxels.
constexpr double Stride = 0.75;

/// The lumens of a tree, for "how far is the nearest wall".
class LumenDistance
{
public:
  LumenDistance(const VesselTree& tree, double reach)
    : Tree(tree)
    , Reach(reach)
  {
    double widest = 0.0;
    for (const double radius : tree.radius)
    {
      widest = std::max(widest, radius);
    }
    this->Cell = widest + reach;
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      this->Cells[this->Key(tree.points[p], 0, 0, 0)].push_back(static_cast<std::int32_t>(p));
    }
    this->BranchOf.assign(tree.points.size(), NoBranch);
    for (std::size_t b = 0; b < tree.branches.size(); ++b)
    {
      for (const std::int64_t p : tree.branches[b].points)
      {
        // The first point may be its parent's, which comes before.
        std::int32_t& owner = this->BranchOf[static_cast<std::size_t>(p)];
        owner = owner == NoBranch ? static_cast<std::int32_t>(b) : owner;
      }
    }
  }

  struct Nearest
  {
    double wall; ///< mm outside of the nearest lumen, at most the reach; negative inside
    std::int32_t point = -1;
  };

  static constexpr std::int32_t NoBranch = -1;

  /// @param without  a branch whose lumen does not count
  Nearest operator()(const Vector3& position, std::int32_t without = NoBranch) const
  {
    Nearest nearest{ this->Reach };
    for (int near = 0; near < 27; ++near)
    {
      const auto cell =
        this->Cells.find(this->Key(position, near % 3 - 1, near / 3 % 3 - 1, near / 9 - 1));
      if (cell == this->Cells.end())
      {
        continue;
      }
      for (const std::int32_t p : cell->second)
      {
        if (without != NoBranch && this->BranchOf[static_cast<std::size_t>(p)] == without)
        {
          continue;
        }
        const double wall = (this->Tree.points[p] - position).norm() - this->Tree.radius[p];
        if (wall < nearest.wall || (wall == nearest.wall && p < nearest.point))
        {
          nearest = { wall, p };
        }
      }
    }
    return nearest;
  }

private:
  std::int64_t Key(const Vector3& position, int i, int j, int k) const
  {
    const auto part = [&](int axis, int shift)
    {
      return (static_cast<std::int64_t>(std::floor(position[axis] / this->Cell)) + shift +
               (std::int64_t{ 1 } << 20)) &
        ((std::int64_t{ 1 } << 21) - 1);
    };
    return part(0, i) << 42 | part(1, j) << 21 | part(2, k);
  }

  const VesselTree& Tree;
  double Reach;
  double Cell = 1.0;
  std::unordered_map<std::int64_t, std::vector<std::int32_t>> Cells;
  std::vector<std::int32_t> BranchOf; ///< of a point of the tree
};

class Finder
{
public:
  /// @param sign  -1: dark vessels, of which there are none
  Finder(const ImageInterpolator& image, const VesselTree& tree, const ThinBranchSettings& settings,
    double sign = 1.0)
    : Image(image)
    , Tree(tree)
    , Settings(settings)
    , Sign(sign)
    , Lumen(tree, 6.0 * settings.voxel)
    , Noise(MeasureNoise(image, tree, settings.voxel))
    , Joint(tree.points.size(), 0)
  {
    for (const VesselTree::Branch& branch : tree.branches)
    {
      this->Joint[branch.points.front()] = 1;
    }
  }

  NoisePaths TryPaths() const;
  std::vector<ThinBranch> Run(std::int64_t from) const;
  TipPath FollowTip(std::int32_t number) const;

private:
  struct Spot
  {
    Vector3 position;
    Vector3 outwards;
    std::int32_t parent;
  };
  struct Sample
  {
    Vector3 position;
    double minimum; ///< core over the second brightest sector around it
    double core;
    double wall;        ///< mm from the tree's lumen
    double going = 0.0; ///< contrast that speaks neither for going on nor against it, there
    bool known = true;  ///< whether the contrast can be seen
  };

  double At(const Vector3& position) const { return this->Sign * this->Image.At(position); }
  std::vector<Spot> FindSpots(std::int64_t from) const;
  double Core(const Vector3& position, const CrossFrame& frame) const;
  double Profile(const Vector3& position, const Vector3& tangent) const;
  double Ahead(const Vector3& position, const Vector3& direction) const;
  bool Evidence(
    const Vector3& position, const Vector3& tangent, std::int32_t own, Sample& sample) const;
  Vector3 Turn(const Vector3& position, const Vector3& direction) const;
  Vector3 Centre(const Vector3& position, const Vector3& tangent) const;
  /// What a path must show.
  struct Bar
  {
    double minimum = 0.0;      ///< contrast to any side, mean of the path
    double significance = 0.0; ///< standard errors, mean of the path
    double beyondNoise = 0.0;  ///< spreads by which it must exceed what a path in noise shows
    double going = 0.0;        ///< contrast that speaks neither for going on nor against it
    /// The same where the core is this bright: what is beside the vessel changes, not the vessel.
    double goingBright = 0.0;
    double bright = std::numeric_limits<double>::infinity();
    bool unknownGoesOn = false; ///< where the contrast can not be seen
    /// Above 0: vessels taper, and blur makes thin ones fade. What counts is what the last samples showed, down to this.
    double least = 0.0;

    double Going(const Sample& sample) const
    {
      return sample.core >= this->bright ? this->goingBright : this->going;
    }
  };
  bool Trace(Vector3 position, Vector3 direction, std::size_t most, std::size_t ownLumen,
    const Bar& bar, std::vector<Sample>& samples) const;
  static void Adapt(const std::vector<Sample>& samples, const Bar& first, Bar& bar);
  Vector3 Away(const Spot& spot, double& ahead) const;
  bool IsVessel(const std::vector<Sample>& samples, const Bar& bar, double& contrast,
    double& significance) const;
  bool Follow(const Spot& spot, ThinBranch& branch) const;

  const ImageInterpolator& Image;
  const VesselTree& Tree;
  const ThinBranchSettings& Settings;
  double Sign;
  LumenDistance Lumen;
  double Noise;
  std::vector<char> Joint; ///< of a point of the tree: a branch begins there
};

/// Local maxima of the image on surfaces beside the lumens.
std::vector<Finder::Spot> Finder::FindSpots(std::int64_t from) const
{
  const double voxel = this->Settings.voxel;
  std::vector<Spot> spots;
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    const std::size_t count = branch.points.size();
    if (count < 3 || branch.points.back() < from)
    {
      continue;
    }
    const auto point = [&](std::size_t i) -> const Vector3&
    { return this->Tree.points[branch.points[i]]; };
    // A frame that does not turn about the axis.
    std::vector<Vector3> across(count);
    std::vector<Vector3> tangents(count);
    double length = 0.0;
    for (std::size_t i = 0; i < count; ++i)
    {
      tangents[i] = (point(std::min(count - 1, i + 2)) - point(i > 2 ? i - 2 : 0)).normalized();
      const Vector3 before = i == 0 ? tangents[i].unitOrthogonal() : across[i - 1];
      across[i] = (before - before.dot(tangents[i]) * tangents[i]).normalized();
      length += i == 0 ? 0.0 : (point(i) - point(i - 1)).norm();
    }
    const double step = length / static_cast<double>(count - 1);
    const auto stride =
      std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(0.75 * voxel / step)));
    for (const double away : { 1.5, 3.0, 4.5 })
    {
      constexpr int around = 48;
      const std::size_t rows = (count + stride - 1) / stride;
      std::vector<double> map(rows * around);
      const auto place = [&](std::size_t row, int angle) -> Vector3
      {
        const std::size_t i = row * stride;
        const double radius = this->Tree.radius[branch.points[i]] + away * voxel;
        const double a = 2.0 * M_PI * angle / around;
        return point(i) +
          radius * (std::cos(a) * across[i] + std::sin(a) * tangents[i].cross(across[i]));
      };
      ParallelFor(static_cast<std::int64_t>(rows), 16,
        [&](std::int64_t first, std::int64_t last)
        {
          for (std::int64_t row = first; row < last; ++row)
          {
            for (int angle = 0; angle < around; ++angle)
            {
              map[static_cast<std::size_t>(row) * around + static_cast<std::size_t>(angle)] =
                this->At(place(static_cast<std::size_t>(row), angle));
            }
          }
        });
      for (std::size_t row = 0; row < rows; ++row)
      {
        const double radius = this->Tree.radius[branch.points[row * stride]] + away * voxel;
        const int reach = std::max(
          1, std::min(around / 6, static_cast<int>(voxel / (2.0 * M_PI * radius / around))));
        for (int angle = 0; angle < around; ++angle)
        {
          const double here = map[row * around + static_cast<std::size_t>(angle)];
          bool maximum = true;
          for (std::size_t r = row > 1 ? row - 2 : 0; maximum && r <= std::min(rows - 1, row + 2);
               ++r)
          {
            for (int a = angle - reach; a <= angle + reach; ++a)
            {
              const double other =
                map[r * around + static_cast<std::size_t>((a + around) % around)];
              const bool before = r < row || (r == row && a < angle);
              if (before ? other >= here : other > here)
              {
                maximum = false;
                break;
              }
            }
          }
          if (!maximum)
          {
            continue;
          }
          const Vector3 position = place(row, angle);
          // What a branch that is known covers is no new one.
          const LumenDistance::Nearest nearest = this->Lumen(position);
          if (nearest.wall < (away - 0.5) * voxel || !this->Image.Contains(position))
          {
            continue;
          }
          const auto parent = static_cast<std::int32_t>(branch.points[row * stride]);
          if (parent < from)
          {
            continue;
          }
          spots.push_back(
            { position, (position - this->Tree.points[parent]).normalized(), parent });
        }
      }
    }
  }
  return spots;
}

double Finder::Core(const Vector3& position, const CrossFrame& frame) const
{
  const Vector3 u = 0.5 * this->Settings.voxel * frame.u;
  const Vector3 v = 0.5 * this->Settings.voxel * frame.v;
  return 0.2 *
    (this->At(position) + this->At(position + u) + this->At(position - u) + this->At(position + v) +
      this->At(position - v));
}

/// Core over the mean of the ring.
double Finder::Profile(const Vector3& position, const Vector3& tangent) const
{
  const CrossFrame frame(tangent);
  const double ring = 2.5 * this->Settings.voxel;
  double sum = 0.0;
  for (int i = 0; i < 6; ++i)
  {
    sum += this->At(position + ring * frame.Ray(i, 6));
  }
  return this->Core(position, frame) - sum / 6.0;
}

double Finder::Ahead(const Vector3& position, const Vector3& direction) const
{
  double sum = 0.0;
  for (const double s : { 1.0, 2.0, 3.0, 4.0 })
  {
    sum += this->Profile(position + s * this->Settings.voxel * direction, direction);
  }
  return 0.25 * sum;
}

/// @param own  the branch that it belongs to: blurred, its lumen comes near the sectors
/// @returns false if too much around it lies in lumens that are known
bool Finder::Evidence(
  const Vector3& position, const Vector3& tangent, std::int32_t own, Sample& sample) const
{
  const double voxel = this->Settings.voxel;
  const CrossFrame frame(tangent);
  sample.position = position;
  sample.core = this->Core(position, frame);
  std::array<double, Sectors> sectors;
  int known = 0;
  for (int i = 0; i < Sectors; ++i)
  {
    const Vector3 side = frame.Ray(i, Sectors);
    const Vector3 place = position + 3.0 * voxel * side;
    const double wall = this->Lumen(place).wall;
    if (wall < 1.5 * voxel &&
      (own == LumenDistance::NoBranch || wall < 0.75 * voxel ||
        this->Lumen(place, own).wall < 1.5 * voxel))
    {
      continue;
    }
    sectors[static_cast<std::size_t>(known++)] =
      (this->At(place) + this->At(place + voxel * tangent) + this->At(place - voxel * tangent) +
        this->At(place - 0.5 * voxel * side)) /
      4.0;
  }
  if (known < Sectors / 2)
  {
    return false;
  }
  // The second brightest: a vessel may cross.
  double brightest = -std::numeric_limits<double>::infinity();
  double second = brightest;
  for (int i = 0; i < known; ++i)
  {
    const double value = sectors[static_cast<std::size_t>(i)];
    second = std::max(second, std::min(value, brightest));
    brightest = std::max(brightest, value);
  }
  sample.minimum = sample.core - second;
  return true;
}

/// The direction near this one along which the tube goes on best.
Vector3 Finder::Turn(const Vector3& position, const Vector3& direction) const
{
  Vector3 best = direction;
  double maximum = this->Ahead(position, direction);
  for (const double cone : { 0.3, 0.12 })
  {
    const Vector3 from = best;
    const CrossFrame frame(from);
    for (int i = 0; i < 8; ++i)
    {
      const Vector3 turned = (from + std::tan(cone) * frame.Ray(i, 8)).normalized();
      const double value = this->Ahead(position, turned);
      if (value > maximum)
      {
        maximum = value;
        best = turned;
      }
    }
  }
  return best;
}

/// Towards the top of the parabola through the core's values across.
Vector3 Finder::Centre(const Vector3& position, const Vector3& tangent) const
{
  const CrossFrame frame(tangent);
  const double h = 0.75 * this->Settings.voxel;
  const auto value = [&](const Vector3& p)
  {
    return this->Core(p, frame) + this->Core(p + this->Settings.voxel * tangent, frame) +
      this->Core(p - this->Settings.voxel * tangent, frame);
  };
  Vector3 centre = position;
  const double here = value(position);
  for (const Vector3& side : { frame.u, frame.v })
  {
    const double above = value(position + h * side);
    const double below = value(position - h * side);
    const double bend = above - 2.0 * here + below;
    const double shift = bend < 0.0 ? 0.5 * h * (below - above) / bend : 0.0;
    centre += std::min(0.5 * h, std::max(-0.5 * h, shift)) * side;
  }
  return centre;
}

/// What a vessel must show to go on, by what it showed some samples before.
void Finder::Adapt(const std::vector<Sample>& samples, const Bar& first, Bar& bar)
{
  constexpr std::size_t begin = 16;
  constexpr std::size_t end = 4; // of them count: an end is abrupt
  constexpr std::size_t enough = 6;
  std::vector<double> contrasts;
  std::vector<double> cores;
  for (std::size_t i = samples.size() > begin ? samples.size() - begin : 0;
       i + end < samples.size(); ++i)
  {
    if (samples[i].known)
    {
      contrasts.push_back(samples[i].minimum);
      cores.push_back(samples[i].core);
    }
  }
  if (contrasts.size() < enough)
  {
    return;
  }
  const double half = 0.5 * MedianOf(std::move(contrasts));
  bar.going = std::clamp(half, first.least, std::max(first.least, first.going));
  bar.goingBright = std::min(bar.going, first.goingBright);
  bar.bright = MedianOf(std::move(cores)) - half;
}

/// Follows the tube, as far as the path speaks for a vessel.
/// @param ownLumen  so many samples may lie in the tree's lumen
/// @returns false if it leads into a vessel that is known
bool Finder::Trace(Vector3 position, Vector3 direction, std::size_t most, std::size_t ownLumen,
  const Bar& bar, std::vector<Sample>& samples) const
{
  const double step = Stride * this->Settings.voxel;
  constexpr std::size_t window = 8;
  Bar now = bar;
  while (samples.size() < most && this->Image.Contains(position))
  {
    Sample sample;
    sample.known = this->Evidence(position, direction, LumenDistance::NoBranch, sample);
    if (bar.least > 0.0)
    {
      Adapt(samples, bar, now);
    }
    sample.going = now.Going(sample);
    if (!sample.known)
    {
      sample.minimum = bar.unknownGoesOn ? sample.going : 0.0;
    }
    sample.wall = this->Lumen(position).wall;
    if (sample.wall < 0.0 && samples.size() >= ownLumen)
    {
      return false;
    }
    samples.push_back(sample);
    if (samples.size() >= window)
    {
      double recent = 0.0;
      for (std::size_t i = samples.size() - window; i < samples.size(); ++i)
      {
        recent += (samples[i].minimum - samples[i].going) / static_cast<double>(window);
      }
      if (recent < 0.0)
      {
        break;
      }
    }
    const Vector3 ahead = this->Turn(position, direction);
    const Vector3 before = position;
    position = this->Centre(position + step * ahead, ahead);
    const Vector3 gone = position - before;
    if (!(gone.norm() > 0.3 * step))
    {
      break;
    }
    direction = (0.5 * direction + 0.5 * gone.normalized()).normalized();
  }

  std::size_t end = 0;
  double sum = 0.0;
  double top = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i)
  {
    sum += samples[i].minimum - samples[i].going;
    if (sum > top)
    {
      top = sum;
      end = i + 1;
    }
  }
  samples.resize(end);
  return true;
}

/// Whether noise could not have made it.
bool Finder::IsVessel(
  const std::vector<Sample>& samples, const Bar& bar, double& contrast, double& significance) const
{
  const auto count = static_cast<double>(samples.size());
  contrast = 0.0;
  std::size_t clear = 0;
  for (const Sample& sample : samples)
  {
    contrast += sample.minimum / count;
    clear += sample.minimum >= sample.going ? 1 : 0;
  }
  // Samples three voxels apart are independent; four in the core, four in a sector.
  const double independent = std::max(1.0, count * Stride / 3.0);
  significance =
    contrast / std::max(this->Noise * std::sqrt(0.5 / independent), 1e-9 * this->Settings.contrast);
  const double noise = this->Settings.noise.contrast +
    bar.beyondNoise * this->Settings.noise.spread * std::sqrt(NoiseSamples / count);
  return contrast >= std::max(bar.minimum, noise) && significance >= bar.significance &&
    static_cast<double>(clear) >= 0.8 * count;
}

/// Of all directions that lead away from the tree the one that shows most.
Vector3 Finder::Away(const Spot& spot, double& ahead) const
{
  Vector3 direction = spot.outwards;
  ahead = -std::numeric_limits<double>::infinity();
  constexpr int directions = 80;
  for (int i = 0; i < directions; ++i)
  {
    const Vector3 candidate = SphereDirection(i, directions);
    if (candidate.dot(spot.outwards) < 0.25)
    {
      continue;
    }
    const double value = this->Ahead(spot.position, candidate);
    if (value > ahead)
    {
      ahead = value;
      direction = candidate;
    }
  }
  return direction;
}

/// Paths from everywhere beside the tree, wherever they lead.
NoisePaths Finder::TryPaths() const
{
  const std::vector<Spot> spots = this->FindSpots(0);
  constexpr std::size_t most = 256;
  const std::size_t count = std::min(most, spots.size());
  Bar bar;
  bar.going = -100.0 * this->Settings.contrast;
  bar.goingBright = bar.going;
  std::vector<double> tried(count, std::numeric_limits<double>::quiet_NaN());
  ParallelFor(static_cast<std::int64_t>(count), 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const auto number = static_cast<std::size_t>(n);
        const Spot& spot = spots[number * spots.size() / count];
        double ahead = 0.0;
        const Vector3 direction = this->Turn(spot.position, this->Away(spot, ahead));
        std::vector<Sample> samples;
        if (this->Trace(
              this->Centre(spot.position, direction), direction, NoiseSamples, 0, bar, samples) &&
          samples.size() == NoiseSamples)
        {
          tried[number] = 0.0;
          for (const Sample& sample : samples)
          {
            tried[number] += sample.minimum / static_cast<double>(NoiseSamples);
          }
        }
      }
    });
  std::vector<double> shown;
  std::copy_if(tried.begin(), tried.end(), std::back_inserter(shown),
    [](double one) { return !std::isnan(one); });
  constexpr std::size_t enough = 16;
  if (shown.size() < enough)
  {
    return {};
  }
  NoisePaths noise;
  noise.contrast = std::max(0.0, MedianOf(shown));
  for (double& one : shown)
  {
    one = std::abs(one - noise.contrast);
  }
  noise.spread = 1.4826 * MedianOf(std::move(shown));
  return noise;
}

bool Finder::Follow(const Spot& spot, ThinBranch& branch) const
{
  const double voxel = this->Settings.voxel;
  const double step = Stride * voxel;
  double maximum = 0.0;
  Vector3 direction = this->Away(spot, maximum);
  const double minimum = MinimumContrast * this->Settings.contrast;
  if (maximum < minimum)
  {
    return false;
  }
  direction = this->Turn(spot.position, direction);

  std::vector<Sample> samples;
  const Vector3 position = this->Centre(spot.position, direction);
  const auto most = static_cast<std::size_t>(this->Settings.maximumLength / step);
  Bar bar;
  bar.minimum = minimum;
  bar.beyondNoise = BeyondNoise;
  bar.significance = Significance;
  bar.going = 0.5 * minimum;
  if (!this->Trace(position, direction, most, 0, bar, samples))
  {
    return false;
  }
  const std::size_t end = samples.size();
  if (end < 4 || static_cast<double>(end) * step < this->Settings.minimumLength)
  {
    return false;
  }
  const auto beside = std::count_if(samples.begin(), samples.end(),
    [&](const Sample& sample) { return sample.wall < 2.5 * voxel; });
  if (!this->IsVessel(samples, bar, branch.contrast, branch.significance) ||
    static_cast<double>(beside) > 0.5 * static_cast<double>(end))
  {
    return false;
  }

  // Away from the tree: what runs beside a vessel for long is its vein.
  double farthest = 0.0;
  for (std::size_t i = 0; i < end; i += 4)
  {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t p = 0; p < this->Tree.points.size(); ++p)
    {
      nearest = std::min(
        nearest, (this->Tree.points[p] - samples[i].position).norm() - this->Tree.radius[p]);
    }
    farthest = std::max(farthest, nearest);
  }
  branch.length = static_cast<double>(end) * step + samples.front().wall;
  if (farthest < MinimumDeparture * std::min(branch.length, FullDeparture * voxel))
  {
    return false;
  }
  // Back to the parent's axis: bright all the way.
  const auto parent = static_cast<std::size_t>(spot.parent);
  const Vector3& from = samples.front().position;
  const Vector3& root = this->Tree.points[parent];
  const int pieces = std::max(2, static_cast<int>((root - from).norm() / (0.25 * voxel)));
  double lowest = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= pieces; ++i)
  {
    lowest = std::min(lowest, this->At(from + (root - from) * (static_cast<double>(i) / pieces)));
  }
  std::vector<double> cores;
  for (std::size_t i = 0; i < std::min<std::size_t>(end, 10); ++i)
  {
    cores.push_back(samples[i].core);
  }
  const double begin = MedianOf(std::move(cores));
  if (begin - lowest > DeepestValley * this->Settings.contrast + 2.0 * this->Noise)
  {
    return false;
  }
  branch.parent = spot.parent;
  std::vector<Vector3> path = { root };
  for (const Sample& sample : samples)
  {
    path.push_back(sample.position);
  }
  branch.points = std::move(path);
  return true;
}

TipPath Finder::FollowTip(std::int32_t number) const
{
  const VesselTree::Branch& branch = this->Tree.branches[static_cast<std::size_t>(number)];
  const double voxel = this->Settings.voxel;
  const auto index = [&](std::size_t i) { return static_cast<std::size_t>(branch.points[i]); };
  const auto point = [&](std::size_t i) -> const Vector3& { return this->Tree.points[index(i)]; };
  // The very end may have been drawn into a corner of the region.
  const Vector3& tip = point(branch.points.size() - 1);
  const auto passed = [&](std::size_t i) { return (point(i) - tip).norm(); };
  std::size_t near = branch.points.size() - 1;
  while (near > 0 && passed(near) < 2.0 * voxel && !this->Joint[index(near)])
  {
    --near;
  }
  std::size_t far = near;
  while (far > 0 && passed(far) < 8.0 * voxel)
  {
    --far;
  }
  const Vector3 back = point(near) - point(far);
  if (!(back.norm() > 0.0))
  {
    return {};
  }
  // What the vessel shows before its tip; beyond it goes on like that.
  std::vector<double> contrasts;
  std::vector<double> cores;
  for (std::size_t i = far; i < near; ++i)
  {
    Sample sample;
    if (this->Evidence(point(i), back.normalized(), number, sample))
    {
      contrasts.push_back(sample.minimum);
      cores.push_back(sample.core);
    }
  }
  const double minimum = MinimumContrast * this->Settings.contrast;
  const double usual = contrasts.empty() ? minimum : MedianOf(std::move(contrasts));
  Bar bar;
  bar.minimum = 0.5 * minimum;
  bar.significance = 0.5 * Significance;
  bar.least = std::max(
    0.25 * minimum, this->Settings.noise.contrast + TipBeyondNoise * this->Settings.noise.spread);
  bar.going = std::max(bar.least, 0.5 * usual);
  bar.goingBright = std::min(bar.going, 0.5 * minimum);
  if (!cores.empty())
  {
    bar.bright = MedianOf(std::move(cores)) - 0.5 * usual;
  }
  bar.unknownGoesOn = true;
  const Vector3 direction = this->Turn(point(near), back.normalized());
  const double radius = this->Tree.radius[branch.points.back()];
  const auto own = static_cast<std::size_t>((passed(near) + radius) / (Stride * voxel)) + 3;
  std::vector<Sample> samples;
  double contrast = 0.0;
  double significance = 0.0;
  const auto most = own + static_cast<std::size_t>(this->Settings.maximumLength / (Stride * voxel));
  if (!this->Trace(this->Centre(point(near), direction), direction, most, own, bar, samples) ||
    samples.size() < 4 || !this->IsVessel(samples, bar, contrast, significance))
  {
    return {};
  }
  TipPath path;
  path.known = near + 1;
  for (const Sample& sample : samples)
  {
    if ((sample.position - point(near)).dot(direction) > 0.5 * Stride * voxel ||
      !path.points.empty())
    {
      path.points.push_back(sample.position);
    }
  }
  // Farther than before, or it is none.
  const bool beyond =
    !path.points.empty() && (path.points.back() - tip).dot(direction) > 0.5 * Stride * voxel;
  return beyond ? path : TipPath();
}

std::vector<ThinBranch> Finder::Run(std::int64_t from) const
{
  if (this->Tree.points.empty())
  {
    return {};
  }
  const std::vector<Spot> spots = this->FindSpots(from);
  std::vector<ThinBranch> branches(spots.size());
  std::vector<char> found(spots.size(), 0);
  ParallelFor(static_cast<std::int64_t>(spots.size()), 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t s = first; s < last; ++s)
      {
        const auto spot = static_cast<std::size_t>(s);
        found[spot] = this->Follow(spots[spot], branches[spot]) ? 1 : 0;
      }
    });
  std::vector<ThinBranch> result;
  for (std::size_t s = 0; s < spots.size(); ++s)
  {
    if (found[s] != 0)
    {
      result.push_back(std::move(branches[s]));
    }
  }
  std::stable_sort(result.begin(), result.end(),
    [](const ThinBranch& a, const ThinBranch& b) { return a.significance > b.significance; });
  return result;
}
}

double MeasureNoise(const ImageInterpolator& image, const VesselTree& tree, double voxel)
{
  std::vector<double> differences;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t i = 4; i + 4 < branch.points.size(); i += 4)
    {
      const auto p = static_cast<std::size_t>(branch.points[i]);
      const Vector3 chord = tree.points[branch.points[i + 4]] - tree.points[branch.points[i - 4]];
      if (!(chord.norm() > 0.0))
      {
        continue;
      }
      const Vector3 tangent = chord.normalized();
      const CrossFrame frame(tangent);
      const double away = tree.radius[p] + 4.0 * voxel;
      for (int side = 0; side < 6; ++side)
      {
        const Vector3 place = tree.points[p] + away * frame.Ray(side, 6);
        if (image.Contains(place))
        {
          differences.push_back(std::abs(image.At(place - 3.0 * voxel * tangent) -
            2.0 * image.At(place) + image.At(place + 3.0 * voxel * tangent)));
        }
      }
    }
  }
  return MedianOf(std::move(differences)) * 1.4826 / std::sqrt(6.0);
}

void ThinBranchSettings::Validate() const
{
  constexpr RequireOf require{ "ThinBranchSettings" };
  require(this->voxel > 0.0, "voxel must be positive");
  require(this->minimumLength > 0.0, "minimumLength must be positive");
  require(
    this->maximumLength >= this->minimumLength, "maximumLength must not be below minimumLength");
  require(this->contrast > 0.0, "contrast must be positive");
  require(this->noise.contrast >= 0.0 && this->noise.spread >= 0.0, "noise must not be negative");
}

NoisePaths LearnNoisePaths(
  const ImageInterpolator& image, const VesselTree& tree, const ThinBranchSettings& settings)
{
  settings.Validate();
  return Finder(image, tree, settings, -1.0).TryPaths();
}

std::vector<ThinBranch> FindThinBranches(const ImageInterpolator& image, const VesselTree& tree,
  const ThinBranchSettings& settings, std::int64_t from)
{
  settings.Validate();
  return Finder(image, tree, settings).Run(from);
}

std::vector<TipPath> FollowTips(
  const ImageInterpolator& image, const VesselTree& tree, const ThinBranchSettings& settings)
{
  settings.Validate();
  const Finder finder(image, tree, settings);
  std::vector<TipPath> paths(tree.branches.size());
  ParallelFor(static_cast<std::int64_t>(paths.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t b = first; b < last; ++b)
      {
        const auto branch = static_cast<std::size_t>(b);
        paths[branch] = finder.FollowTip(static_cast<std::int32_t>(b));
      }
    });
  return paths;
}
}
