#include "CalciumObjects.h"

#include "BlurredDisc.h"
#include "CrossFrame.h"
#include "GridIndex.h"
#include "LumenMeasurement.h"
#include "Median.h"
#include "Require.h"
#include "VoxelLattice.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace coronary
{
namespace
{
constexpr double DimmestLevel = 0.9;      ///< of the tree's usual one, that thresholds start from
constexpr double SliceThickness = 3.0;    ///< mm, of Agatston's rule
constexpr double MinimumSliceArea = 1.0;  ///< mm^2, of Agatston's rule
constexpr double HighestDensity = 3000.0; ///< HU, of what is taken for a deposit's own value
constexpr double WallDistance = 2.5; ///< mm from the lumen's wall: what is farther off is no plaque
constexpr double SeedShare = 0.30;   ///< of the lumen's contrast: above it an object's core
constexpr double SeedDeviations = 5.0; ///< and so many standard deviations of the noise
constexpr double GrowShare = 0.15;     ///< the same for its surroundings
constexpr double GrowDeviations = 3.0;
constexpr std::size_t MinimumVoxels = 2; ///< of an object

/// What a voxel has to be brighter than: where the lumen seems dim it may only be blurred.
double LevelAt(const LumenLevels& levels, std::int64_t point)
{
  return std::max(levels.level[point], DimmestLevel * levels.usual);
}

double ContrastAt(const LumenLevels& levels, std::int64_t point)
{
  return std::max(1.0, LevelAt(levels, point) - levels.background);
}

/// Voxels above the lower threshold beside the tree, by offset, without labels.
std::vector<CalciumVoxel> BrightVoxels(const VesselTree& tree, const ScalarImage& image,
  const LumenLevels& levels, const ProgressCallback& progress)
{
  const VoxelLattice lattice(image.grid);
  const ImageInterpolator interpolator(image);
  const std::array<int, 6>& e = image.grid.extent;
  const Vector3 first(e[0], e[2], e[4]);
  const std::array<int, 6> extent{ 0, e[1] - e[0], 0, e[3] - e[2], 0, e[5] - e[4] };
  const auto threshold = [&](std::size_t p)
  {
    return LevelAt(levels, static_cast<std::int64_t>(p)) +
      std::max(GrowShare * ContrastAt(levels, static_cast<std::int64_t>(p)),
        GrowDeviations * levels.noise);
  };
  std::unordered_map<std::int64_t, CalciumVoxel> found;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    if (p % 256 == 0)
    {
      Report(progress, static_cast<double>(p) / static_cast<double>(tree.points.size()));
    }
    const double minimum = threshold(p);
    const double reach = tree.radius[p] + WallDistance;
    // Relative to the first voxel.
    const IndexBox box = BoxAround(interpolator.ToIndex(tree.points[p]) - first,
      Vector3::Constant(reach).cwiseQuotient(lattice.Spacing), extent);
    std::visit(
      [&](const auto* values)
      {
        box.ForEach(
          [&](int i, int j, int k)
          {
            const std::int64_t offset = lattice.Index(i, j, k);
            const auto value = static_cast<double>(values[offset]);
            if (!(value > minimum))
            {
              return;
            }
            const auto distance =
              static_cast<float>((lattice.World({ i, j, k }) - tree.points[p]).norm());
            if (static_cast<double>(distance) > reach)
            {
              return;
            }
            const auto [voxel, isNew] = found.try_emplace(offset);
            if (isNew || distance < voxel->second.distance)
            {
              voxel->second = { offset, 0, static_cast<std::int64_t>(p), distance,
                static_cast<float>(value) };
            }
          });
      },
      image.values);
  }
  std::vector<CalciumVoxel> voxels;
  for (const auto& [offset, voxel] : found)
  {
    // What is nearer to another point is held against that point's threshold.
    if (static_cast<double>(voxel.value) > threshold(static_cast<std::size_t>(voxel.point)))
    {
      voxels.push_back(voxel);
    }
  }
  std::sort(voxels.begin(), voxels.end(),
    [](const CalciumVoxel& a, const CalciumVoxel& b) { return a.offset < b.offset; });
  return voxels;
}

void IndexVoxels(CalciumMap& map)
{
  map.index.clear();
  for (std::size_t v = 0; v < map.voxels.size(); ++v)
  {
    map.index[map.voxels[v].offset] = static_cast<std::int64_t>(v);
  }
}

/// Share of the full circle that an object takes around a section, degrees.
double ArcAround(const CalciumMap& calcium, const std::vector<std::int64_t>& voxels,
  const VoxelLattice& lattice, const Vector3& centre, const Vector3& tangent)
{
  constexpr int bins = 72;
  const double voxel = lattice.Spacing.maxCoeff();
  const CrossFrame frame(tangent);
  std::array<bool, bins> covered{};
  for (const std::int64_t n : voxels)
  {
    const Vector3 offset = lattice.World(lattice.Place(calcium.voxels[n].offset)) - centre;
    if (std::abs(offset.dot(tangent)) > 0.75 * voxel)
    {
      continue;
    }
    const double x = offset.dot(frame.u);
    const double y = offset.dot(frame.v);
    const double half = std::atan2(0.5 * voxel, std::max(1e-6, std::hypot(x, y)));
    const double angle = std::atan2(y, x);
    const auto first = static_cast<int>(std::floor((angle - half) / (2.0 * M_PI) * bins));
    const auto last = static_cast<int>(std::floor((angle + half) / (2.0 * M_PI) * bins));
    for (int bin = first; bin <= last; ++bin)
    {
      covered[static_cast<std::size_t>(((bin % bins) + bins) % bins)] = true;
    }
  }
  return 360.0 / bins * static_cast<double>(std::count(covered.begin(), covered.end(), true));
}

double Score(
  const CalciumMap& calcium, const std::vector<std::int64_t>& voxels, const VoxelLattice& lattice)
{
  struct Slice
  {
    double volume = 0.0;
    double peak = 0.0;
  };
  std::map<std::int64_t, Slice> slices;
  for (const std::int64_t n : voxels)
  {
    const CalciumVoxel& voxel = calcium.voxels[n];
    const double z = lattice.World(lattice.Place(voxel.offset))[2];
    Slice& slice = slices[std::llround(std::floor(z / SliceThickness))];
    slice.volume += lattice.VoxelVolume();
    slice.peak = std::max(slice.peak, static_cast<double>(voxel.value));
  }
  double score = 0.0;
  for (const auto& [number, slice] : slices)
  {
    const double area = slice.volume / SliceThickness;
    if (area >= MinimumSliceArea)
    {
      score += area * AgatstonWeight(slice.peak);
    }
  }
  return score;
}

/// What would be there without calcium: the lumen's blurred disc in dark surroundings.
class Surroundings
{
public:
  Surroundings(const VesselTree& tree, const LumenLevels& levels, double blur,
    const Vector3& centre, double reach)
    : Tree(tree)
    , Levels(levels)
    , Blur(blur)
    , Background(levels.background)
  {
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      if ((tree.points[p] - centre).squaredNorm() < reach * reach)
      {
        this->Near.push_back(p);
      }
    }
  }

  double At(const Vector3& position) const
  {
    double value = this->Background;
    double nearest = 1e30;
    for (const std::size_t p : this->Near)
    {
      const double distance = (this->Tree.points[p] - position).squaredNorm();
      if (distance < nearest)
      {
        nearest = distance;
        const double share =
          BlurredDisc(std::sqrt(distance) / this->Blur, this->Tree.radius[p] / this->Blur);
        value = this->Background + share * (this->Levels.level[p] - this->Background);
      }
    }
    return value;
  }

  /// What lies around vessels here.
  void SetBackground(double value) { this->Background = value; }

  /// Share of the lumen in what is seen at a position, 0 to 1.
  double LumenShare(const Vector3& position) const
  {
    double share = 0.0;
    for (const std::size_t p : this->Near)
    {
      share = std::max(share,
        BlurredDisc((this->Tree.points[p] - position).norm() / this->Blur,
          this->Tree.radius[p] / this->Blur));
    }
    return share;
  }

private:
  const VesselTree& Tree;
  const LumenLevels& Levels;
  double Blur;
  double Background;
  std::vector<std::size_t> Near;
};

/// Density and volume up to half of the object's own contrast.
void MeasureVolume(CalciumObject& object, const CalciumMap& calcium,
  const std::vector<std::int64_t>& own, const VoxelLattice& lattice, const ImageInterpolator& image,
  Surroundings& surroundings, double blur)
{
  // The two brightest voxels together: one alone is the noise's.
  std::vector<std::int64_t> order = own;
  std::sort(order.begin(), order.end(),
    [&](std::int64_t a, std::int64_t b)
    {
      return calcium.voxels[a].value != calcium.voxels[b].value
        ? calcium.voxels[a].value > calcium.voxels[b].value
        : calcium.voxels[a].offset < calcium.voxels[b].offset;
    });
  const std::size_t top = std::min<std::size_t>(2, order.size());
  // The object with all that blur may have made of it, in eighths of voxels.
  std::vector<std::int64_t> region;
  std::size_t outermost = 0; // of the region, from here on
  {
    std::unordered_map<std::int64_t, bool> member;
    for (const std::int64_t n : own)
    {
      member[calcium.voxels[n].offset] = true;
      region.push_back(calcium.voxels[n].offset);
    }
    const auto rings = static_cast<int>(std::ceil(2.0 * blur / lattice.Spacing.minCoeff()));
    std::size_t begin = 0;
    for (int ring = 0; ring < std::min(rings, 4); ++ring)
    {
      const std::size_t end = region.size();
      for (std::size_t n = begin; n < end; ++n)
      {
        lattice.Neighbours(region[n],
          [&](std::int64_t other, float)
          {
            const std::int64_t known = calcium.Find(other);
            if ((known < 0 || calcium.voxels[known].label == object.label) &&
              member.emplace(other, true).second)
            {
              region.push_back(other);
            }
          });
      }
      begin = end;
      outermost = end;
    }
  }
  std::vector<double> outside;
  for (std::size_t n = outermost; n < region.size(); ++n)
  {
    const Vector3 place = lattice.World(lattice.Place(region[n]));
    if (surroundings.LumenShare(place) < 0.05)
    {
      outside.push_back(image.At(place));
    }
  }
  if (outside.size() >= 8)
  {
    surroundings.SetBackground(MedianOf(std::move(outside)));
  }
  double bright = 0.0;
  double around = 0.0;
  for (std::size_t n = 0; n < top; ++n)
  {
    const CalciumVoxel& voxel = calcium.voxels[order[n]];
    bright += voxel.value / static_cast<double>(top);
    around +=
      surroundings.At(lattice.World(lattice.Place(voxel.offset))) / static_cast<double>(top);
  }
  // What is brighter than half of the peak, over what would be there, in eighths of voxels.
  const double excess = std::max(1.0, bright - around);
  double volume = 0.0;
  for (const std::int64_t offset : region)
  {
    const Vector3 centre = lattice.World(lattice.Place(offset));
    for (int corner = 0; corner < 8; ++corner)
    {
      const Vector3 shift((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5, (corner >> 2) - 0.5);
      const Vector3 place =
        centre + lattice.Grid.direction * (0.5 * lattice.Spacing.cwiseProduct(shift));
      volume +=
        image.At(place) - surroundings.At(place) > 0.5 * excess ? lattice.VoxelVolume() / 8.0 : 0.0;
    }
  }
  // The ball that shows so much above half of its own peak.
  const auto volumeOf = [](double radius) { return 4.0 / 3.0 * M_PI * radius * radius * radius; };
  double low = 0.0;
  double high = std::cbrt(0.75 / M_PI * volume) / blur + 2.0;
  for (int round = 0; round < 40; ++round)
  {
    const double radius = 0.5 * (low + high);
    (volumeOf(blur * BallHalfMaximum(radius)) < volume ? low : high) = radius;
  }
  const double share = std::max(BlurredBallCentre(high), 0.15);
  object.density = std::min(std::max(HighestDensity, bright), around + excess / share);
  object.correctedVolume = volumeOf(blur * high);
}
}

std::int64_t CalciumMap::Find(std::int64_t offset) const
{
  const auto found = this->index.find(offset);
  return found == this->index.end() ? -1 : found->second;
}

int AgatstonWeight(double peak)
{
  return peak < 130.0 ? 0 : std::min(4, static_cast<int>(std::max(1.0, std::floor(peak / 100.0))));
}

CalciumMap FindCalcium(const VesselTree& tree, const ScalarImage& image, const LumenLevels& levels,
  const ProgressCallback& progress)
{
  CheckTree(tree);
  const VoxelLattice lattice(image.grid);
  CalciumMap map;
  map.voxels = BrightVoxels(tree, image, levels, progress);
  IndexVoxels(map);
  struct Component
  {
    std::vector<std::int64_t> voxels;
    std::int64_t firstPoint;
  };
  std::vector<Component> components;
  std::vector<char> seen(map.voxels.size(), 0);
  for (std::size_t start = 0; start < map.voxels.size(); ++start)
  {
    Component component;
    bool dense = false;
    component.firstPoint = map.voxels[start].point;
    for (const std::int64_t offset : lattice.Connected(map.voxels[start].offset,
           [&](std::int64_t other)
           {
             const std::int64_t index = map.Find(other);
             return index >= 0 && std::exchange(seen[index], 1) == 0;
           }))
    {
      component.voxels.push_back(map.Find(offset));
      const CalciumVoxel& voxel = map.voxels[component.voxels.back()];
      component.firstPoint = std::min(component.firstPoint, voxel.point);
      dense = dense ||
        static_cast<double>(voxel.value) > LevelAt(levels, voxel.point) +
            std::max(SeedShare * ContrastAt(levels, voxel.point), SeedDeviations * levels.noise);
    }
    if (dense && component.voxels.size() >= MinimumVoxels)
    {
      components.push_back(std::move(component));
    }
  }
  std::stable_sort(components.begin(), components.end(),
    [](const Component& a, const Component& b) { return a.firstPoint < b.firstPoint; });
  for (const Component& component : components)
  {
    CalciumObject object;
    object.label = static_cast<int>(map.objects.size()) + 1;
    for (const std::int64_t voxel : component.voxels)
    {
      map.voxels[voxel].label = object.label;
    }
    map.objects.push_back(object);
  }
  map.voxels.erase(std::remove_if(map.voxels.begin(), map.voxels.end(),
                     [](const CalciumVoxel& voxel) { return voxel.label == 0; }),
    map.voxels.end());
  IndexVoxels(map);
  Report(progress, 1.0);
  return map;
}

void MeasureCalcium(CalciumMap& calcium, const VesselTree& tree,
  const std::vector<VesselPath>& paths, const ScalarImage& image, const LumenLevels& levels,
  double blur)
{
  const VoxelLattice lattice(image.grid);
  const ImageInterpolator values(image);
  std::vector<Vector3> tangents(tree.points.size(), Vector3::UnitZ());
  for (const VesselPath& path : paths)
  {
    const std::vector<Vector3> along = PathTangents(tree, path, 1.0);
    for (std::size_t i = path.FirstOwn(); i < path.points.size(); ++i)
    {
      tangents[path.points[i]] = along[i];
    }
  }
  std::vector<std::vector<std::int64_t>> own(calcium.objects.size());
  for (std::size_t v = 0; v < calcium.voxels.size(); ++v)
  {
    own[calcium.voxels[v].label - 1].push_back(static_cast<std::int64_t>(v));
  }
  ParallelFor(static_cast<std::int64_t>(calcium.objects.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        CalciumObject& object = calcium.objects[n];
        double weight = 0.0;
        Vector3 low = Vector3::Constant(1e30);
        Vector3 high = -low;
        object.centre.setZero();
        object.abscissaStart = 1e30;
        object.abscissaEnd = 0.0;
        std::vector<std::int64_t> touched;
        for (const std::int64_t v : own[n])
        {
          const CalciumVoxel& voxel = calcium.voxels[v];
          const Vector3 position = lattice.World(lattice.Place(voxel.offset));
          const double more =
            std::max(1.0, static_cast<double>(voxel.value) - levels.level[voxel.point]);
          object.centre += more * position;
          weight += more;
          low = low.cwiseMin(position);
          high = high.cwiseMax(position);
          object.peak = std::max(object.peak, static_cast<double>(voxel.value));
          if (!tree.abscissa.empty())
          {
            object.abscissaStart = std::min(object.abscissaStart, tree.abscissa[voxel.point]);
            object.abscissaEnd = std::max(object.abscissaEnd, tree.abscissa[voxel.point]);
          }
          touched.push_back(voxel.point);
        }
        object.centre /= weight;
        object.volume = static_cast<double>(own[n].size()) * lattice.VoxelVolume();
        std::sort(touched.begin(), touched.end());
        touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
        double nearest = 1e30;
        for (const std::int64_t p : touched)
        {
          object.arc =
            std::max(object.arc, ArcAround(calcium, own[n], lattice, tree.points[p], tangents[p]));
          const double distance = (tree.points[p] - object.centre).squaredNorm();
          if (distance < nearest)
          {
            nearest = distance;
            object.point = p;
          }
        }
        object.segmentId = tree.segmentId.empty() ? 0 : tree.segmentId[object.point];
        object.score = Score(calcium, own[n], lattice);
        Surroundings surroundings(
          tree, levels, blur, 0.5 * (low + high), 0.5 * (high - low).norm() + 8.0);
        MeasureVolume(object, calcium, own[n], lattice, values, surroundings, blur);
      }
    });
}
}
