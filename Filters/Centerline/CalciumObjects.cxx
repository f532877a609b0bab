#include "CalciumObjects.h"

#include "BlurredDisc.h"
#include "LumenMeasurement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr double DimmestLevel = 0.9;      ///< of the tree's usual one, that thresholds start from
constexpr double SliceThickness = 3.0;    ///< mm, of Agatston's rule
constexpr double LeastSliceArea = 1.0;    ///< mm^2, of Agatston's rule
constexpr double HighestDensity = 3000.0; ///< HU, of what is taken for a deposit's own value

void Require(bool condition, const char* requirement)
{
  if (!condition)
  {
    throw std::invalid_argument(std::string("CalciumSettings: ") + requirement);
  }
}

/// The voxels of an image by their index along the axes.
struct Lattice
{
  explicit Lattice(const ScalarImage& image)
    : grid(image.grid)
    , size(image.Dimensions())
  {
    this->inverse =
      this->grid.spacing.cwiseInverse().asDiagonal() * this->grid.direction.transpose();
    this->volume = this->grid.spacing.prod();
  }

  std::array<std::int64_t, 3> IndexOf(std::int64_t offset) const
  {
    return { offset % this->size[0], offset / this->size[0] % this->size[1],
      offset / this->size[0] / this->size[1] };
  }
  bool Contains(const std::array<std::int64_t, 3>& n) const
  {
    return n[0] >= 0 && n[1] >= 0 && n[2] >= 0 && n[0] < this->size[0] && n[1] < this->size[1] &&
      n[2] < this->size[2];
  }
  std::int64_t OffsetOf(const std::array<std::int64_t, 3>& n) const
  {
    return (n[2] * this->size[1] + n[1]) * this->size[0] + n[0];
  }
  Vector3 PositionOf(const std::array<std::int64_t, 3>& n) const
  {
    return this->grid.IndexToWorld(static_cast<double>(n[0] + this->grid.extent[0]),
      static_cast<double>(n[1] + this->grid.extent[2]),
      static_cast<double>(n[2] + this->grid.extent[4]));
  }
  /// Relative to the first voxel, not rounded.
  Vector3 ToIndex(const Vector3& position) const
  {
    return this->inverse * (position - this->grid.origin) -
      Vector3(this->grid.extent[0], this->grid.extent[2], this->grid.extent[4]);
  }

  ImageGrid grid;
  std::array<int, 3> size;
  Matrix3 inverse;
  double volume; ///< of a voxel, mm^3
};

template <typename Visit>
void ForNeighbours(const Lattice& lattice, std::int64_t offset, const Visit& visit)
{
  const std::array<std::int64_t, 3> n = lattice.IndexOf(offset);
  for (int side = 0; side < 27; ++side)
  {
    const std::array<std::int64_t, 3> other{ n[0] + side % 3 - 1, n[1] + side / 3 % 3 - 1,
      n[2] + side / 9 - 1 };
    if (side != 13 && lattice.Contains(other))
    {
      visit(lattice.OffsetOf(other));
    }
  }
}

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
  const LumenLevels& levels, const CalciumSettings& settings, const ProgressCallback& progress)
{
  const Lattice lattice(image);
  const auto threshold = [&](std::size_t p)
  {
    return LevelAt(levels, static_cast<std::int64_t>(p)) +
      std::max(settings.growShare * ContrastAt(levels, static_cast<std::int64_t>(p)),
        settings.growDeviations * levels.noise);
  };
  std::unordered_map<std::int64_t, CalciumVoxel> found;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    if (p % 256 == 0)
    {
      Report(progress, static_cast<double>(p) / static_cast<double>(tree.points.size()));
    }
    const double least = threshold(p);
    const double reach = tree.radius[p] + settings.wallDistance;
    const Vector3 centre = lattice.ToIndex(tree.points[p]);
    std::array<std::int64_t, 3> low;
    std::array<std::int64_t, 3> high;
    bool inside = true;
    for (int axis = 0; axis < 3; ++axis)
    {
      const double extent = reach / lattice.grid.spacing[axis];
      low[axis] = std::max<std::int64_t>(0, std::llround(std::ceil(centre[axis] - extent)));
      high[axis] = std::min<std::int64_t>(
        lattice.size[axis] - 1, std::llround(std::floor(centre[axis] + extent)));
      inside = inside && low[axis] <= high[axis];
    }
    if (!inside)
    {
      continue;
    }
    std::visit(
      [&](const auto* values)
      {
        std::array<std::int64_t, 3> n;
        for (n[2] = low[2]; n[2] <= high[2]; ++n[2])
        {
          for (n[1] = low[1]; n[1] <= high[1]; ++n[1])
          {
            for (n[0] = low[0]; n[0] <= high[0]; ++n[0])
            {
              const std::int64_t offset = lattice.OffsetOf(n);
              const auto value = static_cast<double>(values[offset]);
              if (!(value > least))
              {
                continue;
              }
              const auto distance =
                static_cast<float>((lattice.PositionOf(n) - tree.points[p]).norm());
              if (static_cast<double>(distance) > reach)
              {
                continue;
              }
              const auto [voxel, isNew] = found.try_emplace(offset);
              if (isNew || distance < voxel->second.distance)
              {
                voxel->second = { offset, 0, static_cast<std::int64_t>(p), distance,
                  static_cast<float>(value) };
              }
            }
          }
        }
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
  const Lattice& lattice, const Vector3& centre, const Vector3& tangent)
{
  constexpr int bins = 72;
  const double voxel = lattice.grid.spacing.maxCoeff();
  const Vector3 u = tangent.unitOrthogonal();
  const Vector3 v = tangent.cross(u);
  std::array<bool, bins> covered{};
  for (const std::int64_t n : voxels)
  {
    const Vector3 offset = lattice.PositionOf(lattice.IndexOf(calcium.voxels[n].offset)) - centre;
    if (std::abs(offset.dot(tangent)) > 0.75 * voxel)
    {
      continue;
    }
    const double x = offset.dot(u);
    const double y = offset.dot(v);
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
  const CalciumMap& calcium, const std::vector<std::int64_t>& voxels, const Lattice& lattice)
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
    const double z = lattice.PositionOf(lattice.IndexOf(voxel.offset))[2];
    Slice& slice = slices[std::llround(std::floor(z / SliceThickness))];
    slice.volume += lattice.volume;
    slice.peak = std::max(slice.peak, static_cast<double>(voxel.value));
  }
  double score = 0.0;
  for (const auto& [number, slice] : slices)
  {
    const double area = slice.volume / SliceThickness;
    if (area >= LeastSliceArea)
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
  const std::vector<std::int64_t>& own, const Lattice& lattice, const ImageInterpolator& image,
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
    const auto rings = static_cast<int>(std::ceil(2.0 * blur / lattice.grid.spacing.minCoeff()));
    std::size_t begin = 0;
    for (int ring = 0; ring < std::min(rings, 4); ++ring)
    {
      const std::size_t end = region.size();
      for (std::size_t n = begin; n < end; ++n)
      {
        ForNeighbours(lattice, region[n],
          [&](std::int64_t other)
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
    const Vector3 place = lattice.PositionOf(lattice.IndexOf(region[n]));
    if (surroundings.LumenShare(place) < 0.05)
    {
      outside.push_back(image.At(place));
    }
  }
  if (outside.size() >= 8)
  {
    std::nth_element(outside.begin(), outside.begin() + outside.size() / 2, outside.end());
    surroundings.SetBackground(outside[outside.size() / 2]);
  }
  double bright = 0.0;
  double around = 0.0;
  for (std::size_t n = 0; n < top; ++n)
  {
    const CalciumVoxel& voxel = calcium.voxels[order[n]];
    bright += voxel.value / static_cast<double>(top);
    around +=
      surroundings.At(lattice.PositionOf(lattice.IndexOf(voxel.offset))) / static_cast<double>(top);
  }
  // What is brighter than half of the peak, over what would be there, in eighths of voxels.
  const double excess = std::max(1.0, bright - around);
  double volume = 0.0;
  for (const std::int64_t offset : region)
  {
    const Vector3 centre = lattice.PositionOf(lattice.IndexOf(offset));
    for (int corner = 0; corner < 8; ++corner)
    {
      const Vector3 shift((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5, (corner >> 2) - 0.5);
      const Vector3 place =
        centre + lattice.grid.direction * (0.5 * lattice.grid.spacing.cwiseProduct(shift));
      volume +=
        image.At(place) - surroundings.At(place) > 0.5 * excess ? lattice.volume / 8.0 : 0.0;
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

void CalciumSettings::Validate() const
{
  Require(this->wallDistance >= 0.5 && this->wallDistance <= 10.0,
    "wallDistance must be from 0.5 to 10 mm");
  Require(this->seedShare >= 0.1 && this->seedShare <= 2.0, "seedShare must be from 0.1 to 2");
  Require(this->seedDeviations >= 2.0 && this->seedDeviations <= 20.0,
    "seedDeviations must be from 2 to 20");
  Require(this->growShare >= 0.0 && this->growShare <= this->seedShare,
    "growShare must be from 0 to seedShare");
  Require(this->growDeviations >= 0.0 && this->growDeviations <= this->seedDeviations,
    "growDeviations must be from 0 to seedDeviations");
  Require(this->leastVoxels >= 1, "leastVoxels must be at least 1");
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
  const CalciumSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  CheckTree(tree);
  const Lattice lattice(image);
  CalciumMap map;
  map.voxels = BrightVoxels(tree, image, levels, settings, progress);
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
    if (seen[start] != 0)
    {
      continue;
    }
    seen[start] = 1;
    Component component{ { static_cast<std::int64_t>(start) }, map.voxels[start].point };
    bool dense = false;
    for (std::size_t n = 0; n < component.voxels.size(); ++n)
    {
      const CalciumVoxel& voxel = map.voxels[component.voxels[n]];
      component.firstPoint = std::min(component.firstPoint, voxel.point);
      dense = dense ||
        static_cast<double>(voxel.value) > LevelAt(levels, voxel.point) +
            std::max(settings.seedShare * ContrastAt(levels, voxel.point),
              settings.seedDeviations * levels.noise);
      ForNeighbours(lattice, voxel.offset,
        [&](std::int64_t other)
        {
          const std::int64_t index = map.Find(other);
          if (index >= 0 && seen[index] == 0)
          {
            seen[index] = 1;
            component.voxels.push_back(index);
          }
        });
    }
    if (dense && static_cast<int>(component.voxels.size()) >= settings.leastVoxels)
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
  const Lattice lattice(image);
  const ImageInterpolator values(image);
  std::vector<Vector3> tangents(tree.points.size(), Vector3::UnitZ());
  for (const VesselPath& path : paths)
  {
    const std::vector<Vector3> along = PathTangents(tree, path, 1.0);
    for (std::size_t i = path.parent < 0 ? 0 : 1; i < path.points.size(); ++i)
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
          const Vector3 position = lattice.PositionOf(lattice.IndexOf(voxel.offset));
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
        object.volume = static_cast<double>(own[n].size()) * lattice.volume;
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
