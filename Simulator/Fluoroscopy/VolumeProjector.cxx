#include "VolumeProjector.h"

#include "KernelChoice.h"
#include "XRayKernels.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace coronary
{
namespace
{
constexpr int BlockSize = 8; // voxels
constexpr int TileSize = 8;  // pixels: as many columns as a packet has rays
constexpr double Steps = 65535.0;
constexpr double MaximumAttenuation = 100.0; // 1/mm
constexpr std::int64_t MaximumSize = std::int64_t{ 1 } << 30;
static_assert(TileSize == XRayLanes);

using Sizes = std::array<int, 3>;

std::int64_t Product(const Sizes& n)
{
  return static_cast<std::int64_t>(n[0]) * n[1] * n[2];
}

float CheckedAttenuation(const std::function<double(double)>& attenuation, double value)
{
  const double result = attenuation(value);
  if (!(result >= 0.0 && result < MaximumAttenuation))
  {
    throw std::invalid_argument("volume: the attenuation of the value " + std::to_string(value) +
      " is " + std::to_string(result) + " 1/mm; it has to be within 0 to 100");
  }
  return static_cast<float>(result);
}

/// Attenuation as whole numbers times `scale`.
struct Quantised
{
  std::vector<std::uint16_t> values;
  float scale = 0.0F;
};

float ScaleOf(const std::vector<float>& values)
{
  return *std::max_element(values.begin(), values.end()) / static_cast<float>(Steps);
}

std::uint16_t Rounded(float value, float scale)
{
  return scale > 0.0F
    ? static_cast<std::uint16_t>(std::min(Steps, std::round(double(value) / scale)))
    : std::uint16_t{ 0 };
}

/// Each value that occurs is asked for once.
template <typename T>
Quantised QuantisedValues(
  const T* values, std::int64_t count, const std::function<double(double)>& attenuation)
{
  constexpr int low = std::numeric_limits<T>::min();
  constexpr int numberOfValues = 65536;
  std::vector<char> occurs(numberOfValues, 0);
  for (std::int64_t k = 0; k < count; ++k)
  {
    occurs[values[k] - low] = 1;
  }
  std::vector<float> table(numberOfValues, 0.0F);
  for (int k = 0; k < numberOfValues; ++k)
  {
    if (occurs[k] != 0)
    {
      table[k] = CheckedAttenuation(attenuation, k + low);
    }
  }
  Quantised result;
  result.scale = ScaleOf(table);
  std::vector<std::uint16_t> rounded(numberOfValues);
  std::transform(table.begin(), table.end(), rounded.begin(),
    [&](float value) { return Rounded(value, result.scale); });
  result.values.resize(count);
  ParallelFor(count, 1 << 18,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t k = first; k < last; ++k)
      {
        result.values[k] = rounded[values[k] - low];
      }
    });
  return result;
}

template <>
Quantised QuantisedValues<float>(
  const float* values, std::int64_t count, const std::function<double(double)>& attenuation)
{
  std::vector<float> table(count);
  for (std::int64_t k = 0; k < count; ++k)
  {
    table[k] = CheckedAttenuation(attenuation, values[k]);
  }
  Quantised result;
  result.scale = ScaleOf(table);
  result.values.resize(count);
  std::transform(table.begin(), table.end(), result.values.begin(),
    [&](float value) { return Rounded(value, result.scale); });
  return result;
}

/// Which axis is which when rays follow one of them.
struct AxisOrder
{
  int slice;
  int u; ///< next to each other in memory
  int v;
};
constexpr AxisOrder Orders[3] = { { 0, 1, 2 }, { 1, 0, 2 }, { 2, 0, 1 } };

/// The rays of a geometry in a volume's indices.
struct IndexRays
{
  Vector3 source;
  Vector3 firstPixel; ///< from the source
  Vector3 nextColumn;
  Vector3 nextRow;

  /// From the source to a pixel.
  Vector3 Way(int column, int row) const
  {
    return this->firstPixel + column * this->nextColumn + row * this->nextRow;
  }
};

/// The rays at the corners of a tile: all its others are between them.
using Corners = std::array<Vector3, 4>;

/// What is common to a rectangle and an image's part.
PixelRectangle Common(const PixelRectangle& a, const PixelRectangle& b)
{
  const auto end = [](int first, int count) { return std::int64_t{ first } + std::max(0, count); };
  PixelRectangle common;
  common.column = std::max(a.column, b.column);
  common.row = std::max(a.row, b.row);
  const std::int64_t right = std::min(end(a.column, a.columns), end(b.column, b.columns));
  const std::int64_t bottom = std::min(end(a.row, a.rows), end(b.row, b.rows));
  common.columns = static_cast<int>(std::max<std::int64_t>(0, right - common.column));
  common.rows = static_cast<int>(std::max<std::int64_t>(0, bottom - common.row));
  return common;
}

/// The axis that a ray passes most voxels along.
int MainAxis(const Vector3& way)
{
  Eigen::Index axis = 0;
  way.cwiseAbs().maxCoeff(&axis);
  return static_cast<int>(axis);
}

/// Whether all rays pass slices across the axis at no less than about half a slice a voxel.
bool AllFollow(const Corners& corners, int axis)
{
  return std::all_of(corners.begin(), corners.end(),
    [&](const Vector3& way)
    {
      return way[axis] * corners[0][axis] > 0.0 &&
        std::abs(way[axis]) >= 0.5 * way.cwiseAbs().maxCoeff();
    });
}

void CheckGrid(const ScalarImage& volume)
{
  const Sizes n = volume.Dimensions();
  if (n[0] < 1 || n[1] < 1 || n[2] < 1 || volume.NumberOfVoxels() > MaximumSize ||
    std::max({ n[0], n[1], n[2] }) > 1 << 15)
  {
    throw std::invalid_argument("volume: it has " + std::to_string(n[0]) + " x " +
      std::to_string(n[1]) + " x " + std::to_string(n[2]) +
      " voxels; it has to have at least one, no more than 2^30, and 2^15 along each axis");
  }
  const ImageGrid& grid = volume.grid;
  if (!(grid.spacing.minCoeff() > 0.0) || !(grid.spacing.maxCoeff() < 1e4))
  {
    throw std::invalid_argument("volume: its spacing has to be positive, and below 10 m");
  }
  if (!((grid.direction.transpose() * grid.direction - Matrix3::Identity()).norm() < 1e-3) ||
    !(grid.origin.norm() < 1e6))
  {
    throw std::invalid_argument("volume: its axes have to be perpendicular, its origin near");
  }
}
}

/// Around the voxels is a layer of zeros. Indices count from it.
struct VolumeProjector::Volume
{
  Sizes size{};                   ///< with that layer
  std::vector<std::uint16_t> byI; ///< i next to each other, then j
  std::vector<std::uint16_t> byJ; ///< j next to each other, then k
  Sizes blocks{};
  std::vector<std::uint16_t> blockMaximum; ///< in each block, i fastest
  std::uint16_t negligible = 0;
  float scale = 0.0F;                ///< 1/mm
  Vector3 origin{ Vector3::Zero() }; ///< of index 0, 0, 0
  Matrix3 toIndex{ Matrix3::Identity() };
  Vector3 spacing{ Vector3::Ones() };
  const XRayKernels* kernels = nullptr;

  void Fill(const Quantised& quantised);
  void FillBlocks();
  IndexRays RaysOf(const CArmGeometry& geometry) const;
  SliceVolume Slices(const AxisOrder& order) const;
  bool IsEmpty(const Sizes& first, const Sizes& last) const;
  void FindRuns(
    const Vector3& source, const Corners& corners, int axis, std::vector<SliceRun>& runs) const;
  void ProjectRow(const IndexRays& rays, const PixelRectangle& tile, int row,
    const AxisOrder& order, const std::vector<SliceRun>& runs, float* values) const;
  void ProjectTile(const IndexRays& rays, const PixelRectangle& tile, const PixelRectangle& wanted,
    std::vector<SliceRun>& runs, LineIntegrals& image) const;
};

void VolumeProjector::Volume::Fill(const Quantised& quantised)
{
  const Sizes n{ this->size[0] - 2, this->size[1] - 2, this->size[2] - 2 };
  this->byI.assign(Product(this->size), 0);
  this->byJ.assign(Product(this->size), 0);
  const auto at = [&](int a, int b, int c, const Sizes& order)
  { return (static_cast<std::int64_t>(c) * this->size[order[1]] + b) * this->size[order[0]] + a; };
  ParallelFor(n[2], 1,
    [&](std::int64_t firstSlice, std::int64_t lastSlice)
    {
      for (int k = static_cast<int>(firstSlice); k < lastSlice; ++k)
      {
        const std::uint16_t* from = &quantised.values[static_cast<std::int64_t>(k) * n[0] * n[1]];
        for (int j = 0; j < n[1]; ++j)
        {
          std::copy_n(from + static_cast<std::int64_t>(j) * n[0], n[0],
            &this->byI[at(1, j + 1, k + 1, { 0, 1, 2 })]);
        }
        for (int i = 0; i < n[0]; ++i)
        {
          std::uint16_t* to = &this->byJ[at(1, k + 1, i + 1, { 1, 2, 0 })];
          for (int j = 0; j < n[1]; ++j)
          {
            to[j] = from[static_cast<std::int64_t>(j) * n[0] + i];
          }
        }
      }
    });
}

void VolumeProjector::Volume::FillBlocks()
{
  for (int a = 0; a < 3; ++a)
  {
    this->blocks[a] = (this->size[a] + BlockSize - 1) / BlockSize;
  }
  this->blockMaximum.assign(Product(this->blocks), 0);
  ParallelFor(this->blocks[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      const int lastSlice =
        static_cast<int>(std::min<std::int64_t>(last * BlockSize, this->size[2]));
      for (int k = static_cast<int>(first) * BlockSize; k < lastSlice; ++k)
      {
        for (int j = 0; j < this->size[1]; ++j)
        {
          const std::uint16_t* row =
            &this->byI[(static_cast<std::int64_t>(k) * this->size[1] + j) * this->size[0]];
          std::uint16_t* blockRow =
            &this->blockMaximum[(static_cast<std::int64_t>(k / BlockSize) * this->blocks[1] +
                                  j / BlockSize) *
              this->blocks[0]];
          for (int i = 0; i < this->size[0]; ++i)
          {
            blockRow[i / BlockSize] = std::max(blockRow[i / BlockSize], row[i]);
          }
        }
      }
    });
}

SliceVolume VolumeProjector::Volume::Slices(const AxisOrder& order) const
{
  const std::ptrdiff_t row = order.slice == 0 ? this->size[1] : this->size[0];
  const std::ptrdiff_t slice = row * (order.slice == 0 ? this->size[2] : this->size[1]);
  const auto below = [&](int axis)
  { return std::nextafter(static_cast<float>(this->size[axis] - 1), 0.0F); };
  SliceVolume view{};
  view.voxels = order.slice == 0 ? this->byJ.data() : this->byI.data();
  // Along j the slices are rows, and their rows are slices.
  view.sliceStride = order.slice == 1 ? row : slice;
  view.rowStride = static_cast<std::int32_t>(order.slice == 1 ? slice : row);
  view.middle = this->size[order.slice] / 2;
  view.maximumU = below(order.u);
  view.maximumV = below(order.v);
  return view;
}

/// No voxel from first to last, both included, attenuates.
bool VolumeProjector::Volume::IsEmpty(const Sizes& first, const Sizes& last) const
{
  for (int k = first[2] / BlockSize; k <= last[2] / BlockSize; ++k)
  {
    for (int j = first[1] / BlockSize; j <= last[1] / BlockSize; ++j)
    {
      const std::uint16_t* row =
        &this->blockMaximum[(static_cast<std::int64_t>(k) * this->blocks[1] + j) * this->blocks[0]];
      for (int i = first[0] / BlockSize; i <= last[0] / BlockSize; ++i)
      {
        if (row[i] > this->negligible)
        {
          return false;
        }
      }
    }
  }
  return true;
}

IndexRays VolumeProjector::Volume::RaysOf(const CArmGeometry& geometry) const
{
  const Vector3 first = geometry.PixelPosition(0, 0);
  return { this->toIndex * (geometry.Source() - this->origin),
    this->toIndex * (first - geometry.Source()),
    this->toIndex * (geometry.PixelPosition(1, 0) - first),
    this->toIndex * (geometry.PixelPosition(0, 1) - first) };
}

/// Slices in which a tile's rays may meet something.
void VolumeProjector::Volume::FindRuns(
  const Vector3& source, const Corners& corners, int axis, std::vector<SliceRun>& runs) const
{
  runs.clear();
  double nearest = source[axis];
  double farthest = source[axis];
  for (const Vector3& way : corners)
  {
    nearest = std::min(nearest, source[axis] + way[axis]);
    farthest = std::max(farthest, source[axis] + way[axis]);
  }
  for (int first = 0; first < this->size[axis]; first += BlockSize)
  {
    const int last = std::min(first + BlockSize, this->size[axis]);
    if (last < nearest || first > farthest)
    {
      continue;
    }
    Vector3 low = Vector3::Constant(std::numeric_limits<double>::max());
    Vector3 high = -low;
    for (const Vector3& way : corners)
    {
      for (const int slice : { first, last - 1 })
      {
        const Vector3 place = source + ((slice - source[axis]) / way[axis]) * way;
        low = low.cwiseMin(place);
        high = high.cwiseMax(place);
      }
    }
    Sizes from{};
    Sizes to{};
    bool beside = false;
    for (int a = 0; a < 3; ++a)
    {
      const double maximum = this->size[a] - 1;
      // A little more than the kernel's rounding.
      beside = beside || high[a] < -0.01 || low[a] > maximum + 0.01;
      from[a] = static_cast<int>(std::clamp(std::floor(low[a] - 0.01), 0.0, maximum));
      to[a] = static_cast<int>(std::clamp(std::floor(high[a] + 1.01), 0.0, maximum));
    }
    from[axis] = first;
    to[axis] = last - 1;
    if (beside || this->IsEmpty(from, to))
    {
      continue;
    }
    if (!runs.empty() && runs.back().last == first)
    {
      runs.back().last = last;
    }
    else
    {
      runs.push_back({ first, last });
    }
  }
}

/// @param values  one a column of the tile
void VolumeProjector::Volume::ProjectRow(const IndexRays& rays, const PixelRectangle& tile, int row,
  const AxisOrder& order, const std::vector<SliceRun>& runs, float* values) const
{
  const SliceVolume slices = this->Slices(order);
  SlicePacket packet{};
  double length[XRayLanes];
  for (int l = 0; l < XRayLanes; ++l)
  {
    // A lane without a pixel does the last one's work again.
    const Vector3 way = rays.Way(tile.column + std::min(l, tile.columns - 1), row);
    const double start = rays.source[order.slice];
    const double across = 1.0 / way[order.slice];
    const Vector3 middle = rays.source + (slices.middle - start) * across * way;
    packet.startU[l] = static_cast<float>(middle[order.u]);
    packet.startV[l] = static_cast<float>(middle[order.v]);
    packet.slopeU[l] = static_cast<float>(way[order.u] * across);
    packet.slopeV[l] = static_cast<float>(way[order.v] * across);
    packet.firstSlice[l] = static_cast<float>(std::min(start, start + way[order.slice]));
    packet.lastSlice[l] = static_cast<float>(std::max(start, start + way[order.slice]));
    length[l] = this->spacing.cwiseProduct(way).norm() * std::abs(across);
  }
  this->kernels->sumSlices(slices, runs.data(), static_cast<int>(runs.size()), packet);
  for (int l = 0; l < tile.columns; ++l)
  {
    values[l] = static_cast<float>(packet.sum[l] * this->scale * length[l]);
  }
}

void VolumeProjector::Volume::ProjectTile(const IndexRays& rays, const PixelRectangle& tile,
  const PixelRectangle& wanted, std::vector<SliceRun>& runs, LineIntegrals& image) const
{
  const int lastColumn = tile.column + tile.columns - 1;
  const int lastRow = tile.row + tile.rows - 1;
  const Corners corners{ rays.Way(tile.column, tile.row), rays.Way(lastColumn, tile.row),
    rays.Way(tile.column, lastRow), rays.Way(lastColumn, lastRow) };
  const int axis = MainAxis(corners[0] + corners[3]);
  const PixelRectangle part = Common(tile, wanted);
  if (!AllFollow(corners, axis))
  {
    // Pixels so large that their rays have not one direction: one by one.
    for (int k = 0; k < part.columns * part.rows; ++k)
    {
      const PixelRectangle pixel{ part.column + k % part.columns, part.row + k / part.columns, 1,
        1 };
      this->ProjectTile(rays, pixel, pixel, runs, image);
    }
    return;
  }
  this->FindRuns(rays.source, corners, axis, runs);
  for (int row = part.row; row < part.row + part.rows; ++row)
  {
    float values[XRayLanes];
    this->ProjectRow(rays, tile, row, Orders[axis], runs, values);
    std::copy_n(values + (part.column - tile.column), part.columns,
      &image.values[static_cast<std::size_t>(row) * image.columns + part.column]);
  }
}

VolumeProjector::VolumeProjector(const ScalarImage& volume,
  const std::function<double(double)>& attenuation, const VolumeProjectorSettings& settings)
{
  CheckGrid(volume);
  if (!(settings.negligible >= 0.0))
  {
    throw std::invalid_argument("volume: the negligible attenuation has to be 0 or more");
  }
  auto data = std::make_unique<Volume>();
  const Quantised quantised = std::visit([&](const auto* values)
    { return QuantisedValues(values, volume.NumberOfVoxels(), attenuation); },
    volume.values);
  const Sizes n = volume.Dimensions();
  data->size = { n[0] + 2, n[1] + 2, n[2] + 2 };
  data->scale = quantised.scale;
  data->Fill(quantised);
  data->FillBlocks();
  data->negligible = quantised.scale > 0.0F
    ? static_cast<std::uint16_t>(std::min(Steps, std::floor(settings.negligible / quantised.scale)))
    : std::uint16_t{ 0 };
  const ImageGrid& grid = volume.grid;
  data->spacing = grid.spacing;
  data->origin = grid.IndexToWorld(grid.extent[0] - 1, grid.extent[2] - 1, grid.extent[4] - 1);
  data->toIndex = grid.spacing.cwiseInverse().asDiagonal() * grid.direction.transpose();
  data->kernels = &XRayKernelChoice().Get();
  this->Data = std::move(data);
}

VolumeProjector::~VolumeProjector() = default;

LineIntegrals VolumeProjector::Project(
  const CArmGeometry& geometry, const ProgressCallback& progress) const
{
  const DetectorFormat& format = geometry.Format();
  LineIntegrals image(format.columns, format.rows);
  const std::int64_t bands = (format.rows + TileSize - 1) / TileSize;
  ParallelFor(
    bands, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      const int row = static_cast<int>(first) * TileSize;
      this->ProjectRectangle(
        geometry, { 0, row, format.columns, static_cast<int>(last - first) * TileSize }, image);
    },
    progress);
  return image;
}

void VolumeProjector::ProjectRectangle(
  const CArmGeometry& geometry, const PixelRectangle& rectangle, LineIntegrals& image) const
{
  const DetectorFormat& format = geometry.Format();
  if (image.columns != format.columns || image.rows != format.rows ||
    image.values.size() != static_cast<std::size_t>(format.columns) * format.rows)
  {
    throw std::invalid_argument("volume: the image has " + std::to_string(image.columns) + " x " +
      std::to_string(image.rows) + " pixels, the detector " + std::to_string(format.columns) +
      " x " + std::to_string(format.rows));
  }
  const PixelRectangle wanted = Common(rectangle, { 0, 0, format.columns, format.rows });
  const IndexRays rays = this->Data->RaysOf(geometry);
  std::vector<SliceRun> runs;
  // Tiles begin at multiples of their size, so that a pixel does not depend on the rectangle.
  for (int row = wanted.row / TileSize * TileSize; row < wanted.row + wanted.rows; row += TileSize)
  {
    for (int column = wanted.column / TileSize * TileSize; column < wanted.column + wanted.columns;
         column += TileSize)
    {
      const PixelRectangle tile{ column, row, std::min(TileSize, format.columns - column),
        std::min(TileSize, format.rows - row) };
      this->Data->ProjectTile(rays, tile, wanted, runs, image);
    }
  }
}

LineIntegrals Resampled(const LineIntegrals& image, int columns, int rows)
{
  if (image.columns < 1 || image.rows < 1 || columns < 1 || rows < 1)
  {
    throw std::invalid_argument("line integrals: an image without pixels can not be resampled");
  }
  struct Place
  {
    int first;
    int second;
    float rest;
  };
  const auto places = [](int from, int to)
  {
    std::vector<Place> result(to);
    for (int k = 0; k < to; ++k)
    {
      const double at = std::clamp((k + 0.5) * from / to - 0.5, 0.0, from - 1.0);
      const int first = static_cast<int>(at);
      result[k] = { first, std::min(first + 1, from - 1), static_cast<float>(at - first) };
    }
    return result;
  };
  const std::vector<Place> across = places(image.columns, columns);
  const std::vector<Place> down = places(image.rows, rows);
  LineIntegrals result(columns, rows);
  std::vector<float> mixed(image.columns);
  for (int j = 0; j < rows; ++j)
  {
    const float* above = &image.values[static_cast<std::size_t>(down[j].first) * image.columns];
    const float* below = &image.values[static_cast<std::size_t>(down[j].second) * image.columns];
    for (int i = 0; i < image.columns; ++i)
    {
      mixed[i] = above[i] + down[j].rest * (below[i] - above[i]);
    }
    float* row = &result.values[static_cast<std::size_t>(j) * columns];
    for (int i = 0; i < columns; ++i)
    {
      const float a = mixed[across[i].first];
      row[i] = a + across[i].rest * (mixed[across[i].second] - a);
    }
  }
  return result;
}
}
