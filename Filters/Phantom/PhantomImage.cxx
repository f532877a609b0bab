#include "PhantomImage.h"

#include "CounterRandom.h"
#include "CyclicTime.h"
#include "PartialProgress.h"
#include "PhantomNoise.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double Root2 = 1.41421356237309505;

/// Integral of the standard normal density up to x, tabulated: exact to 1e-5, flat beyond 4.
class NormalIntegral
{
public:
  static float Of(float x)
  {
    if (x <= -Saturated)
    {
      return 0.0f;
    }
    if (x >= Saturated)
    {
      return 1.0f;
    }
    static const NormalIntegral table;
    const float position = (x + Saturated) * Scale;
    const int i = static_cast<int>(position);
    const float f = position - static_cast<float>(i);
    return table.Values[i] + f * (table.Values[i + 1] - table.Values[i]);
  }

private:
  static constexpr int Count = 1024;
  static constexpr float Scale = Count / (2.0f * Saturated);
  NormalIntegral()
  {
    for (int i = 0; i <= Count + 1; ++i)
    {
      const double x = i / static_cast<double>(Scale) - Saturated;
      this->Values[i] = static_cast<float>(0.5 * std::erfc(-x / Root2));
    }
    this->Values[0] = 0.0f;
    this->Values[Count] = this->Values[Count + 1] = 1.0f;
  }
  float Values[Count + 2];
};

/// DiscResponse over disc radius and distance from the disc's rim.
class DiscTable
{
public:
  static constexpr double MinimumRadius = 0.25;
  static constexpr double MaximumRadius = 8.0;
  static constexpr int RadiusSteps = 62; // of 0.125
  static constexpr int RimSteps = 96;    // of 0.125, from -8 to 4

  static const DiscTable& Instance()
  {
    static const DiscTable table;
    return table;
  }

  float operator()(float offset, float radius) const
  {
    if (radius > static_cast<float>(MaximumRadius))
    {
      // Towards the half space the difference goes with the curvature.
      const float half = NormalIntegral::Of(radius - offset);
      const auto maximum = static_cast<float>(MaximumRadius);
      return half +
        ((*this)(std::max(0.0f, offset - radius + maximum), maximum) - half) * maximum / radius;
    }
    float scale = 1.0f;
    if (radius < static_cast<float>(MinimumRadius))
    {
      // A thin disc answers in proportion to its area.
      const float ratio = radius / static_cast<float>(MinimumRadius);
      scale = ratio * ratio;
      offset += static_cast<float>(MinimumRadius) - radius;
      radius = static_cast<float>(MinimumRadius);
    }
    const float rim = (offset - radius + 8.0f) * 8.0f;
    if (rim >= static_cast<float>(RimSteps))
    {
      return 0.0f;
    }
    const float r = (radius - static_cast<float>(MinimumRadius)) * 8.0f;
    const int i = static_cast<int>(r);
    const int j = static_cast<int>(std::max(0.0f, rim));
    const float f = r - static_cast<float>(i);
    const float g = std::max(0.0f, rim) - static_cast<float>(j);
    const auto at = [this](int a, int b) { return this->Values[a * (RimSteps + 1) + b]; };
    return scale *
      ((1.0f - f) * ((1.0f - g) * at(i, j) + g * at(i, j + 1)) +
        f * ((1.0f - g) * at(i + 1, j) + g * at(i + 1, j + 1)));
  }

private:
  DiscTable()
  {
    this->Values.resize((RadiusSteps + 2) * (RimSteps + 1));
    for (int i = 0; i <= RadiusSteps + 1; ++i)
    {
      for (int j = 0; j <= RimSteps; ++j)
      {
        const double radius = MinimumRadius + 0.125 * i;
        const double offset = std::max(0.0, radius - 8.0 + 0.125 * j);
        this->Values[i * (RimSteps + 1) + j] =
          j == RimSteps ? 0.0f : static_cast<float>(Integrate(offset, radius));
      }
    }
  }

  static double Integrate(double offset, double radius)
  {
    // Rows of the disc: normal density across times the normal integral along.
    constexpr int rows = 128;
    double sum = 0.0;
    for (int row = 0; row < rows; ++row)
    {
      // Cosine spacing resolves the disc's flat top and bottom.
      const double angle = 3.14159265358979323846 * (row + 0.5) / rows;
      const double y = -radius * std::cos(angle);
      const double width = radius * std::sin(angle) * 3.14159265358979323846 / rows;
      const double half = radius * std::sin(angle);
      const double along =
        0.5 * (std::erf((half - offset) / Root2) + std::erf((half + offset) / Root2));
      sum += width * along * std::exp(-0.5 * y * y) * 0.3989422804014327;
    }
    return sum;
  }

  std::vector<float> Values;
};

/// A small sphere of calcium, or one step of the vein.
struct Extra
{
  Vector3 start;
  Vector3 axis;
  double radius;
  double reach;
};

/// One cone of a lesion's part.
struct PartPiece
{
  PartPiece(const PhantomTube& tube, int number, const Matrix3& covariance)
    : start(tube.start)
    , axis(tube.end - tube.start)
    , length(this->axis.norm())
    , radius(tube.startRadius)
    , widening(tube.endRadius - tube.startRadius)
    , part(number)
  {
    this->axis /= std::max(1e-9, this->length);
    const double along = this->axis.dot(covariance * this->axis);
    this->alongScale = static_cast<float>(1.0 / std::sqrt(along));
    this->acrossScale = static_cast<float>(1.0 / std::sqrt(0.5 * (covariance.trace() - along)));
  }

  /// How much of a voxel's response lies in it: a Gaussian over a disc, between two planes.
  float Coverage(const DiscTable& disc, const Vector3& world) const
  {
    const Vector3 offset = world - this->start;
    const double u = offset.dot(this->axis);
    const float between =
      NormalIntegral::Of(static_cast<float>(this->length - u) * this->alongScale) -
      NormalIntegral::Of(static_cast<float>(-u) * this->alongScale);
    if (between <= 0.0f)
    {
      return 0.0f;
    }
    const double away = (offset - u * this->axis).norm();
    const double r =
      this->radius + this->widening * std::clamp(u / std::max(1e-9, this->length), 0.0, 1.0);
    return between *
      disc(static_cast<float>(away) * this->acrossScale, static_cast<float>(r) * this->acrossScale);
  }

  Vector3 start;
  Vector3 axis; ///< unit vector
  double length;
  double radius;
  double widening;
  int part;
  float alongScale; ///< 1 / standard deviation of the blur along the axis
  float acrossScale;
};

/// The image's index grid in tiles, so that any part of the image gets the same values.
struct Tiles
{
  Tiles(const ImageGrid& imageGrid, const std::array<int, 6>& imagePart)
    : grid(imageGrid)
    , part(imagePart)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      const auto tileOf = [&](int index)
      { return (index - this->grid.extent[2 * axis]) / this->size[axis]; };
      this->size[axis] = std::clamp(static_cast<int>(4.0 / this->grid.spacing[axis]), 3, 16);
      this->first[axis] = tileOf(this->part[2 * axis]);
      this->count[axis] = tileOf(this->part[2 * axis + 1]) - this->first[axis] + 1;
    }
  }

  /// Index of a tile's first voxel.
  int Base(int axis, int tile) const
  {
    return this->grid.extent[2 * axis] + (this->first[axis] + tile) * this->size[axis];
  }

  /// Inclusive index range of the tiles `from` to before `to` inside the part.
  void Range(int axis, int from, int to, int& low, int& high) const
  {
    low = std::max(this->part[2 * axis], this->Base(axis, from));
    high = std::min(this->part[2 * axis + 1], this->Base(axis, to) - 1);
  }

  Vector3 Corner(int i, int j, int k) const
  {
    return this->grid.IndexToWorld(this->Base(0, i), this->Base(1, j), this->Base(2, k));
  }

  const ImageGrid& grid;
  const std::array<int, 6>& part;
  int size[3];  ///< voxels
  int first[3]; ///< tile of the part's first voxel
  int count[3]; ///< tiles that the part touches
};

/// One image: what holds for all of its tiles.
class Rendering
{
public:
  /// @param pointSpread  standard deviations along the image's axes, mm
  Rendering(const PhantomSettings& settings, const PhantomAnatomy& anatomy, const ImageGrid& grid,
    const std::array<int, 6>& part, const std::vector<PhantomMoment>& moments,
    const std::vector<double>& lost, const Vector3& pointSpread);

  /// Finds where the material at the tile corners rests; in between the field is near linear.
  void PlaceCorners(const PhantomMotion& motion, const ProgressCallback& progress);

  /// Renders all bands into the part's values, x fastest.
  void Run(
    const CorrelatedNoise& noise, std::int16_t* values, const ProgressCallback& progress) const;

  /// Renders all tissues but arteries and plaques, in the palette's colours; k fastest.
  void RunMaps(const PhantomPalette& palette, const std::array<float*, 3>& maps,
    const ProgressCallback& progress);

private:
  /// Tiles of one z and a few y, all x. Big enough that the noise's halo stays small.
  struct Band
  {
    int tileZ;
    int firstTileY;
    int endTileY;
    std::array<int, 6> box;    ///< inclusive index ranges
    std::vector<float> signal; ///< of each image
    std::size_t size;          ///< voxels of an image

    std::size_t Place(int j, int k) const
    {
      return (static_cast<std::size_t>(k - this->box[4]) * (this->box[3] - this->box[2] + 1) +
               (j - this->box[2])) *
        (this->box[1] - this->box[0] + 1);
    }
    float* Row(int j, int k, int image = 0)
    {
      return &this->signal[image * this->size + this->Place(j, k)];
    }
    const float* Row(int j, int k, int image = 0) const
    {
      return &this->signal[image * this->size + this->Place(j, k)];
    }
  };

  /// A tile at one moment, and what of the anatomy can matter inside it.
  struct Tile
  {
    std::size_t moment;
    float weight;
    int base[3];            ///< index of the first voxel
    std::array<int, 6> box; ///< inclusive index ranges inside the part
    Vector3 centre;
    double ball;       ///< mm around the centre
    Vector3 corner[8]; ///< from the corners to where their material rests
    TileLayers layers;
    PhantomLumen::Candidates candidates;
    PhantomLumen::Candidates walls;
    std::vector<Extra> vein;
    std::vector<std::pair<Extra, float>> plaques; ///< with their HU
    std::vector<const PartPiece*> parts;          ///< in the order of their layers

    bool OnlyTissues() const
    {
      return this->candidates.Empty() && this->walls.Empty() && this->vein.empty() &&
        this->plaques.empty() && this->parts.empty();
    }
    bool Uniform() const
    {
      return this->OnlyTissues() &&
        std::all_of(this->layers.layers.begin(), this->layers.layers.end(),
          [](const TileLayers::Active& layer) { return layer.count == 0; });
    }
  };

  /// A row of samples in each image.
  using PaintedRow = std::array<std::array<float, Tissues::Row::Longest>, 3>;

  /// Paints a share of a sample.
  void Mix(PaintedRow& painted, int sample, float share, const PhantomColour& colour) const
  {
    for (int image = 0; image < this->Palette.images; ++image)
    {
      float& value = painted[image][sample];
      value += share * (colour[image] - value);
    }
  }
  void PaintLayer(
    const TileLayers::Active& layer, const Tissues::Row& samples, PaintedRow& painted) const;
  const PhantomColour& Coat(bool inMuscle) const
  {
    return inMuscle ? this->Palette.muscle : this->Palette.fat;
  }

  Band RenderBand(std::int64_t number) const;
  void Store(const Band& band, std::int16_t* values) const;
  void Locate(const Band& band, int tileX, int tileY, Tile& tile) const;
  void Collect(std::size_t moment, int tileX, int tileY, int tileZ, Tile& tile) const;
  void Paint(const Tile& tile, Tissues::Row& samples, Band& band) const;
  void PlaceSamples(const Tile& tile, int j, int k, Tissues::Row& samples) const;
  void PaintTissues(const Tile& tile, const Tissues::Row& samples, int j, int k,
    PhantomLumen::Sample* vessel, PaintedRow& painted) const;
  float CoverVein(const Tile& tile, const Vector3& world) const;
  float PaintPlaques(const Tile& tile, const Vector3& world, float value) const;
  void PaintParts(
    const Tile& tile, const Vector3& world, bool metal, int sample, PaintedRow& painted) const;
  float PaintVessel(
    const PhantomMoment& moment, const PhantomLumen::Sample& sample, float value) const;

  const PhantomSettings& Settings;
  const PhantomAnatomy& Anatomy;
  const std::vector<PhantomMoment>& Moments;
  const std::vector<double>& Lost;
  const DiscTable& Disc = DiscTable::Instance();
  Tissues Around;
  PhantomPalette Palette;
  bool Vessels = true; ///< arteries and plaques are painted
  Tiles Grid;
  Vector3 Variance; ///< of the blur along the image's axes, mm^2
  Matrix3 Covariance;
  double MeanBlur; ///< mm
  double Reach;    ///< mm from a wall at which it can still be seen
  std::vector<std::unique_ptr<PhantomLumen>> Lumens; ///< of each moment
  std::vector<std::unique_ptr<PhantomLumen>> Walls;  ///< the same; empty: they are the lumens'
  std::vector<std::vector<Extra>> Veins;
  std::vector<std::vector<PartPiece>> Parts; ///< of each moment
  std::vector<Eigen::Vector3f> Rest;         ///< from each tile corner and moment to where it rests
  int BandTiles;
  int BandsInY;
};

Rendering::Rendering(const PhantomSettings& settings, const PhantomAnatomy& anatomy,
  const ImageGrid& grid, const std::array<int, 6>& part, const std::vector<PhantomMoment>& moments,
  const std::vector<double>& lost, const Vector3& pointSpread)
  : Settings(settings)
  , Anatomy(anatomy)
  , Moments(moments)
  , Lost(lost)
  , Around(settings, anatomy)
  , Grid(grid, part)
  , BandTiles(std::max(1, 48 / this->Grid.size[1]))
  , BandsInY((this->Grid.count[1] + this->BandTiles - 1) / this->BandTiles)
{
  for (const Tissues::Layer& layer : this->Around.Layers)
  {
    this->Palette.layers.push_back({ layer.value });
  }
  this->Palette.vein[0] = static_cast<float>(settings.veinHU);
  // The voxel is an average over its box: that blurs like a standard deviation of spacing/sqrt(12).
  for (int axis = 0; axis < 3; ++axis)
  {
    const double psf = pointSpread[axis];
    this->Variance[axis] = psf * psf + grid.spacing[axis] * grid.spacing[axis] / 12.0;
  }
  this->Covariance = grid.direction * this->Variance.asDiagonal() * grid.direction.transpose();
  this->MeanBlur = std::sqrt(this->Variance.mean());
  this->Reach = std::max(3.4, Saturated * std::sqrt(this->Variance.maxCoeff()) + 0.5);
  const std::vector<char> open(anatomy.occluded.size(), 0);
  for (const PhantomMoment& moment : moments)
  {
    this->Lumens.push_back(std::make_unique<PhantomLumen>(anatomy, moment.tree.points,
      moment.tree.radius, moment.endNormals, this->Reach, anatomy.occluded));
    if (!moment.wall.points.empty())
    {
      this->Walls.push_back(std::make_unique<PhantomLumen>(
        anatomy, moment.wall.points, moment.wall.radius, moment.endNormals, this->Reach, open));
    }
    std::vector<Extra>& pieces = this->Veins.emplace_back();
    const PhantomTree& vein = moment.vein;
    for (std::size_t p = 0; p + 1 < vein.points.size(); p += 2)
    {
      const std::size_t q = std::min(p + 2, vein.points.size() - 1);
      pieces.push_back({ vein.points[p], vein.points[q] - vein.points[p], vein.radius[p],
        vein.radius[p] + this->Reach });
    }
    std::vector<PartPiece>& parts = this->Parts.emplace_back();
    for (std::size_t n = 0; n < moment.parts.size(); ++n)
    {
      for (const PhantomTube& tube : moment.parts[n])
      {
        parts.emplace_back(tube, static_cast<int>(n), this->Covariance);
      }
    }
  }
}

void Rendering::PlaceCorners(const PhantomMotion& motion, const ProgressCallback& progress)
{
  const int columns = this->Grid.count[0] + 1;
  const int rows = this->Grid.count[1] + 1;
  const int slices = this->Grid.count[2] + 1;
  const std::size_t momentCount = this->Moments.size();
  this->Rest.resize(static_cast<std::int64_t>(columns) * rows * slices * momentCount);
  ParallelFor(
    static_cast<std::int64_t>(rows) * slices, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t row = first; row < last; ++row)
      {
        const int j = static_cast<int>(row % rows);
        const int k = static_cast<int>(row / rows);
        for (int i = 0; i < columns; ++i)
        {
          const Vector3 world = this->Grid.Corner(i, j, k);
          Vector3 guess = world;
          for (std::size_t m = 0; m < momentCount; ++m)
          {
            const PhantomMoment& moment = this->Moments[m];
            guess = motion.ReferencePosition(world, moment.t, moment.shift, guess, 2e-3);
            this->Rest[(row * columns + i) * momentCount + m] = (guess - world).cast<float>();
          }
        }
      }
    },
    progress);
}

void Rendering::Run(
  const CorrelatedNoise& noise, std::int16_t* values, const ProgressCallback& progress) const
{
  ParallelFor(
    static_cast<std::int64_t>(this->Grid.count[2]) * this->BandsInY, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t band = first; band < last; ++band)
      {
        Band rendered = this->RenderBand(band);
        noise.Add(rendered.box, rendered.signal);
        this->Store(rendered, values);
      }
    },
    progress);
}

void Rendering::RunMaps(const PhantomPalette& palette, const std::array<float*, 3>& maps,
  const ProgressCallback& progress)
{
  this->Palette = palette;
  this->Vessels = false;
  const std::array<int, 6>& part = this->Grid.part;
  const std::int64_t slices = part[5] - part[4] + 1;
  const std::int64_t rows = part[3] - part[2] + 1;
  ParallelFor(
    static_cast<std::int64_t>(this->Grid.count[2]) * this->BandsInY, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t number = first; number < last; ++number)
      {
        const Band band = this->RenderBand(number);
        const std::int64_t columns = part[1] - part[0] + 1;
        const std::int64_t plane = columns * (band.box[3] - band.box[2] + 1);
        for (int image = 0; image < palette.images; ++image)
        {
          for (int j = band.box[2]; j <= band.box[3]; ++j)
          {
            const float* in = band.Row(j, band.box[4], image);
            float* out = maps[image] + (j - part[2]) * slices + (band.box[4] - part[4]);
            for (std::int64_t i = 0; i < columns; ++i)
            {
              for (std::int64_t k = 0; k <= band.box[5] - band.box[4]; ++k)
              {
                out[i * rows * slices + k] = in[k * plane + i];
              }
            }
          }
        }
      }
    },
    progress);
}

Rendering::Band Rendering::RenderBand(std::int64_t number) const
{
  const std::array<int, 6>& part = this->Grid.part;
  Band band;
  band.tileZ = static_cast<int>(number / this->BandsInY);
  band.firstTileY = static_cast<int>(number % this->BandsInY) * this->BandTiles;
  band.endTileY = std::min(this->Grid.count[1], band.firstTileY + this->BandTiles);
  band.box[0] = part[0];
  band.box[1] = part[1];
  this->Grid.Range(1, band.firstTileY, band.endTileY, band.box[2], band.box[3]);
  this->Grid.Range(2, band.tileZ, band.tileZ + 1, band.box[4], band.box[5]);
  const int nx = part[1] - part[0] + 1;
  const int ny = band.box[3] - band.box[2] + 1;
  const int nz = band.box[5] - band.box[4] + 1;
  band.size = static_cast<std::size_t>(nx) * ny * nz;
  band.signal.assign(band.size * this->Palette.images, 0.0f);

  Tile tile;
  Tissues::Row samples;
  for (int ty = band.firstTileY; ty < band.endTileY; ++ty)
  {
    for (int tx = 0; tx < this->Grid.count[0]; ++tx)
    {
      this->Locate(band, tx, ty, tile);
      for (std::size_t m = 0; m < this->Moments.size(); ++m)
      {
        this->Collect(m, tx, ty, band.tileZ, tile);
        this->Paint(tile, samples, band);
      }
    }
  }
  return band;
}

void Rendering::Store(const Band& band, std::int16_t* values) const
{
  const std::array<int, 6>& part = this->Grid.part;
  const int nx = part[1] - part[0] + 1;
  const std::int64_t rowStride = nx;
  const std::int64_t sliceStride = rowStride * (part[3] - part[2] + 1);
  for (int k = band.box[4]; k <= band.box[5]; ++k)
  {
    for (int j = band.box[2]; j <= band.box[3]; ++j)
    {
      const float* in = band.Row(j, k);
      std::int16_t* out = values + (k - part[4]) * sliceStride + (j - part[2]) * rowStride;
      for (int i = 0; i < nx; ++i)
      {
        out[i] = static_cast<std::int16_t>(std::lround(std::clamp(in[i], -1024.0f, 3071.0f)));
      }
    }
  }
}

void Rendering::Locate(const Band& band, int tileX, int tileY, Tile& tile) const
{
  const int tileZ = band.tileZ;
  this->Grid.Range(0, tileX, tileX + 1, tile.box[0], tile.box[1]);
  this->Grid.Range(1, tileY, tileY + 1, tile.box[2], tile.box[3]);
  tile.box[4] = band.box[4];
  tile.box[5] = band.box[5];
  tile.base[0] = this->Grid.Base(0, tileX);
  tile.base[1] = this->Grid.Base(1, tileY);
  tile.base[2] = this->Grid.Base(2, tileZ);
  const Vector3 low = this->Grid.Corner(tileX, tileY, tileZ);
  const Vector3 high = this->Grid.Corner(tileX + 1, tileY + 1, tileZ + 1);
  tile.centre = 0.5 * (low + high);
  tile.ball = 0.5 * (high - low).norm();
}

void Rendering::Collect(std::size_t moment, int tileX, int tileY, int tileZ, Tile& tile) const
{
  const PhantomMoment& now = this->Moments[moment];
  tile.moment = moment;
  tile.weight = static_cast<float>(now.weight);
  const std::int64_t columns = this->Grid.count[0] + 1;
  const std::int64_t rows = this->Grid.count[1] + 1;
  Vector3 middle = Vector3::Zero();
  for (int n = 0; n < 8; ++n)
  {
    const std::int64_t at =
      ((tileZ + (n >> 2)) * rows + tileY + ((n >> 1) & 1)) * columns + tileX + (n & 1);
    tile.corner[n] = this->Rest[at * this->Moments.size() + moment].cast<double>();
    middle += tile.corner[n] / 8.0;
  }
  double spread = 0.0;
  for (const Vector3& c : tile.corner)
  {
    spread = std::max(spread, (c - middle).norm());
  }
  const Vector3 restCentre = tile.centre + middle;
  const HeartFrame& frame = this->Anatomy.frame;
  // Heart coordinates are in units of the heart's size: distances grow by 1 / size.
  DecideLayers(this->Around, restCentre, frame.ToHeart(restCentre),
    (tile.ball + spread) / std::min(1.0, frame.size), this->MeanBlur, tile.layers);
  this->Lumens[moment]->Collect(tile.centre, tile.ball, tile.candidates);
  if (!this->Walls.empty())
  {
    this->Walls[moment]->Collect(tile.centre, tile.ball, tile.walls);
  }
  tile.vein.clear();
  for (const Extra& piece : this->Veins[moment])
  {
    if ((piece.start + 0.5 * piece.axis - tile.centre).norm() <
      tile.ball + piece.reach + 0.5 * piece.axis.norm())
    {
      tile.vein.push_back(piece);
    }
  }
  tile.plaques.clear();
  for (std::size_t p = 0; this->Vessels && p < now.plaques.size(); ++p)
  {
    const double radius = this->Anatomy.plaques[p].radius;
    if ((now.plaques[p] - tile.centre).norm() < tile.ball + radius + this->Reach)
    {
      tile.plaques.emplace_back(Extra{ now.plaques[p], Vector3::Zero(), radius, 0.0 },
        static_cast<float>(this->Anatomy.plaques[p].value));
    }
  }
  tile.parts.clear();
  for (const PartPiece& piece : this->Parts[moment])
  {
    const double reach =
      std::max(piece.radius, piece.radius + piece.widening) + 0.5 * piece.length + this->Reach;
    if ((piece.start + 0.5 * piece.length * piece.axis - tile.centre).squaredNorm() <
      (tile.ball + reach) * (tile.ball + reach))
    {
      tile.parts.push_back(&piece);
    }
  }
}

void Rendering::Paint(const Tile& tile, Tissues::Row& samples, Band& band) const
{
  const int ix0 = tile.box[0];
  const int ix1 = tile.box[1];
  const std::vector<TileLayers::Active>& layers = tile.layers.layers;
  const bool uniform = tile.Uniform();
  const PhantomColour& even =
    layers.empty() ? this->Palette.background : this->Palette.layers[layers.back().layer];
  for (int k = tile.box[4]; k <= tile.box[5]; ++k)
  {
    for (int j = tile.box[2]; j <= tile.box[3]; ++j)
    {
      if (uniform)
      {
        for (int image = 0; image < this->Palette.images; ++image)
        {
          float* row = band.Row(j, k, image);
          for (int i = ix0; i <= ix1; ++i)
          {
            row[i - band.box[0]] += tile.weight * even[image];
          }
        }
        continue;
      }
      this->PlaceSamples(tile, j, k, samples);
      PaintedRow painted;
      PhantomLumen::Sample vessel[Tissues::Row::Longest];
      this->PaintTissues(tile, samples, j, k, vessel, painted);
      for (int i = ix0; i <= ix1 && !tile.OnlyTissues(); ++i)
      {
        const Vector3 world = this->Grid.grid.IndexToWorld(i, j, k);
        const int sample = i - tile.base[0];
        if (!tile.vein.empty())
        {
          this->Mix(painted, sample, this->CoverVein(tile, world), this->Palette.vein);
        }
        if (this->Vessels)
        {
          float& value = painted[0][sample];
          value = this->PaintPlaques(tile, world, value);
          this->PaintParts(tile, world, false, sample, painted);
          if (!tile.candidates.Empty())
          {
            value = this->PaintVessel(this->Moments[tile.moment], vessel[sample], value);
          }
        }
        this->PaintParts(tile, world, true, sample, painted);
      }
      for (int image = 0; image < this->Palette.images; ++image)
      {
        float* row = band.Row(j, k, image);
        for (int i = ix0; i <= ix1; ++i)
        {
          row[i - band.box[0]] += tile.weight * painted[image][i - tile.base[0]];
        }
      }
    }
  }
}

/// All samples of the tile's row, whatever part of it is asked for.
void Rendering::PlaceSamples(const Tile& tile, int j, int k, Tissues::Row& samples) const
{
  const ImageGrid& grid = this->Grid.grid;
  const HeartFrame& frame = this->Anatomy.frame;
  const int* size = this->Grid.size;
  const double fy = static_cast<double>(j - tile.base[1]) / size[1];
  const double fz = static_cast<double>(k - tile.base[2]) / size[2];
  const Vector3* corner = tile.corner;
  Vector3 ends[2];
  for (int n = 0; n < 2; ++n)
  {
    ends[n] = (1.0 - fz) * ((1.0 - fy) * corner[n] + fy * corner[2 + n]) +
      fz * ((1.0 - fy) * corner[4 + n] + fy * corner[6 + n]);
  }
  const Vector3 firstWorld = grid.IndexToWorld(tile.base[0], j, k);
  const Vector3 worldStep = grid.direction.col(0) * grid.spacing[0];
  const Vector3 firstMaterial = firstWorld + ends[0];
  const Vector3 materialStep = worldStep + (ends[1] - ends[0]) / size[0];
  const Vector3 firstHeart = frame.ToHeart(firstMaterial);
  const Vector3 heartStep = frame.ToHeart(firstMaterial + materialStep) - firstHeart;
  samples.count = (size[0] + 3) / 4 * 4;
  for (int axis = 0; axis < 3; ++axis)
  {
    const auto w0 = static_cast<float>(firstMaterial[axis]);
    const auto w1 = static_cast<float>(materialStep[axis]);
    const auto h0 = static_cast<float>(firstHeart[axis]);
    const auto h1 = static_cast<float>(heartStep[axis]);
    for (int i = 0; i < samples.count; ++i)
    {
      samples.world[axis][i] = w0 + static_cast<float>(i) * w1;
      samples.heart[axis][i] = h0 + static_cast<float>(i) * h1;
    }
  }
}

/// Everything but the vessels' content; the coat of the coronary arteries goes below the great vessels.
void Rendering::PaintLayer(
  const TileLayers::Active& layer, const Tissues::Row& samples, PaintedRow& painted) const
{
  float coverage[Tissues::Row::Longest];
  CoverRow(this->Around, layer, samples, coverage);
  const PhantomColour& colour = this->Palette.layers[layer.layer];
  for (int image = 0; image < this->Palette.images; ++image)
  {
    for (int i = 0; i < samples.count; ++i)
    {
      float& value = painted[image][i];
      value += coverage[i] * (colour[image] - value);
    }
  }
}

void Rendering::PaintTissues(const Tile& tile, const Tissues::Row& samples, int j, int k,
  PhantomLumen::Sample* vessel, PaintedRow& painted) const
{
  const std::vector<TileLayers::Active>& layers = tile.layers.layers;
  for (int image = 0; image < this->Palette.images; ++image)
  {
    painted[image].fill(this->Palette.background[image]);
  }
  std::size_t layer = 0;
  for (; layer < layers.size() && layers[layer].content != Tissues::Content::GreatVessel; ++layer)
  {
    this->PaintLayer(layers[layer], samples, painted);
  }
  if (!tile.candidates.Empty() || !tile.walls.Empty())
  {
    for (int i = tile.box[0]; i <= tile.box[1]; ++i)
    {
      const Vector3 world = this->Grid.grid.IndexToWorld(i, j, k);
      PhantomLumen::Sample& sample = vessel[i - tile.base[0]];
      sample = this->Lumens[tile.moment]->Evaluate(world, tile.candidates);
      const PhantomLumen::Sample outer =
        this->Walls.empty() ? sample : this->Walls[tile.moment]->Evaluate(world, tile.walls);
      if (outer.step < 0)
      {
        continue;
      }
      // Epicardial vessels lie in fat, intramural ones in muscle: where they touch a chamber, too.
      const AxisStep& step = this->Anatomy.steps[outer.step];
      const bool inMuscle = step.inMuscle;
      const bool bridged = inMuscle && this->Anatomy.intramural[step.vessel] == 0;
      const auto d = static_cast<float>(outer.distance);
      // In the map of a material muscle is not told from blood: there it coats all of the vessel.
      if (!inMuscle || bridged || !this->Vessels || painted[0][i - tile.base[0]] > Muscle)
      {
        const float coat = NormalIntegral::Of(inMuscle ? (2.0f - d) / 0.45f : (1.9f - d) / 0.35f);
        this->Mix(painted, i - tile.base[0], coat, this->Coat(inMuscle));
      }
    }
  }
  for (; layer < layers.size(); ++layer)
  {
    this->PaintLayer(layers[layer], samples, painted);
  }
  if (!this->Vessels && !tile.candidates.Empty())
  {
    // Where an artery begins in the aorta's wall, too, what it takes the place of is its coat.
    for (int i = tile.box[0]; i <= tile.box[1]; ++i)
    {
      const PhantomLumen::Sample& sample = vessel[i - tile.base[0]];
      if (sample.step >= 0)
      {
        this->Mix(painted, i - tile.base[0],
          NormalIntegral::Of(static_cast<float>(-sample.distance / this->MeanBlur)),
          this->Coat(this->Anatomy.steps[sample.step].inMuscle));
      }
    }
  }
}

/// Share of a place that the great cardiac vein covers.
float Rendering::CoverVein(const Tile& tile, const Vector3& world) const
{
  double nearest = this->Reach;
  double radius = 1.0;
  for (const Extra& piece : tile.vein)
  {
    const Vector3 offset = world - piece.start;
    const double u = std::clamp(offset.dot(piece.axis) / piece.axis.squaredNorm(), 0.0, 1.0);
    const double d = (offset - u * piece.axis).norm() - piece.radius;
    if (d < nearest)
    {
      nearest = d;
      radius = piece.radius;
    }
  }
  const auto scale = static_cast<float>(1.0 / this->MeanBlur);
  return this->Disc(static_cast<float>(std::max(0.0, nearest + radius)) * scale,
    static_cast<float>(radius) * scale);
}

float Rendering::PaintPlaques(const Tile& tile, const Vector3& world, float value) const
{
  for (const auto& [plaque, hounsfield] : tile.plaques)
  {
    // Dense calcium blooms.
    const double blur = std::sqrt(this->MeanBlur * this->MeanBlur + 0.3 * 0.3);
    const double d = (world - plaque.start).norm() - plaque.radius;
    value += NormalIntegral::Of(static_cast<float>(-d / blur)) * (hounsfield - value);
  }
  return value;
}

/**
 * The lesions' parts, without metal or of metal alone. In the map of a material all of them are
 * their coat.
 */
void Rendering::PaintParts(
  const Tile& tile, const Vector3& world, bool metal, int sample, PaintedRow& painted) const
{
  for (std::size_t n = 0; n < tile.parts.size();)
  {
    const int number = tile.parts[n]->part;
    const PhantomPart& part = this->Anatomy.parts[number];
    const bool wanted = (part.layer == PartLayer::Metal) == metal || !this->Vessels;
    float coverage = 0.0f;
    // Pieces of one part follow each other, and together they are it.
    for (; n < tile.parts.size() && tile.parts[n]->part == number; ++n)
    {
      coverage += wanted ? tile.parts[n]->Coverage(this->Disc, world) : 0.0f;
    }
    if (coverage > 0.0f)
    {
      const PhantomColour own{ static_cast<float>(part.value) };
      this->Mix(
        painted, sample, std::min(1.0f, coverage), this->Vessels ? own : this->Coat(part.inMuscle));
    }
  }
}

float Rendering::PaintVessel(
  const PhantomMoment& moment, const PhantomLumen::Sample& sample, float value) const
{
  if (sample.step < 0)
  {
    return value;
  }
  const AxisStep& step = this->Anatomy.steps[sample.step];
  // Blur across the vessel: the covariance seen along its axis.
  const Vector3 axis =
    (moment.tree.points[step.second] - moment.tree.points[step.first]).normalized();
  const double across = 0.5 * (this->Variance.sum() - axis.dot(this->Covariance * axis));
  const auto scale = static_cast<float>(1.0 / std::sqrt(across));
  const auto radius = static_cast<float>(sample.radius);
  const float offset = std::max(0.0f, radius + static_cast<float>(sample.distance));
  const double u = sample.fraction;
  const double path =
    moment.tree.abscissa[step.first] * (1.0 - u) + moment.tree.abscissa[step.second] * u;
  const double hidden = this->Lost[step.first] * (1.0 - u) + this->Lost[step.second] * u;
  const double change = this->Anatomy.contrastChange[step.first] * (1.0 - u) +
    this->Anatomy.contrastChange[step.second] * u;
  const auto contrast = static_cast<float>(
    this->Settings.lumenHU + this->Settings.attenuationGradient * path / 10.0 + change);
  return value +
    static_cast<float>(1.0 - 0.92 * hidden) * this->Disc(offset * scale, radius * scale) *
    (contrast - value);
}
}

double DiscResponse(double offset, double discRadius)
{
  return DiscTable::Instance()(static_cast<float>(offset), static_cast<float>(discRadius));
}

PhantomImage::PhantomImage(
  const PhantomSettings& settings, const PhantomAnatomy& anatomy, const PhantomMotion& motion)
  : Settings(settings)
  , Anatomy(anatomy)
  , Motion(motion)
{
}

double PhantomImage::NoiseLevel(double t, double wholePhaseLost) const
{
  const double cycle = Modulo(t);
  const double fullDose =
    SmoothStep((cycle - 0.55) / 0.08) * (1.0 - SmoothStep((cycle - 0.88) / 0.08));
  return this->Settings.noise * (1.0 + (this->Settings.systolicNoise - 1.0) * (1.0 - fullDose)) *
    (1.0 + 1.5 * wholePhaseLost);
}

void RequireGrid(const ImageGrid& grid, const std::array<int, 6>& part)
{
  for (int axis = 0; axis < 3; ++axis)
  {
    if (!(grid.spacing[axis] > 0.0) || !std::isfinite(grid.spacing[axis]) ||
      !std::isfinite(grid.origin[axis]) || part[2 * axis] < grid.extent[2 * axis] ||
      part[2 * axis + 1] > grid.extent[2 * axis + 1])
    {
      throw std::invalid_argument(
        "CoronaryPhantom: the image grid needs positive spacing, a finite origin and a part inside "
        "its extent");
    }
  }
  if ((grid.direction * grid.direction.transpose() - Matrix3::Identity()).norm() > 1e-6 ||
    !grid.direction.allFinite())
  {
    throw std::invalid_argument("CoronaryPhantom: the direction matrix is not orthonormal");
  }
}

void PhantomImage::Render(const ImageGrid& grid, const std::array<int, 6>& part, double t,
  const std::vector<PhantomMoment>& moments, const std::vector<double>& lost, double wholePhaseLost,
  std::int16_t* values, const ProgressCallback& progress) const
{
  RequireGrid(grid, part);
  if (part[1] < part[0] || part[3] < part[2] || part[5] < part[4])
  {
    return;
  }
  Rendering rendering(this->Settings, this->Anatomy, grid, part, moments, lost,
    Eigen::Map<const Vector3>(this->Settings.pointSpread));
  rendering.PlaceCorners(this->Motion, PartOf(progress, 0.0, 0.15));

  std::uint64_t momentKey = 0;
  const double exactTime = t == 0.0 ? 0.0 : t; // one zero
  std::memcpy(&momentKey, &exactTime, sizeof(momentKey));
  const CorrelatedNoise noise(grid, this->Settings.noiseCorrelation,
    this->NoiseLevel(t, wholePhaseLost), MixBits(MixBits(this->Settings.seed + 77) ^ momentKey));
  rendering.Run(noise, values, PartOf(progress, 0.15, 1.0));
}

void PhantomImage::RenderMaps(const ImageGrid& grid, const PhantomMoment& moment,
  const PhantomPalette& palette, const std::array<float*, 3>& maps,
  const ProgressCallback& progress) const
{
  RequireGrid(grid, grid.extent);
  const std::vector<PhantomMoment> moments{ moment };
  Rendering rendering(
    this->Settings, this->Anatomy, grid, grid.extent, moments, {}, Vector3::Zero());
  rendering.PlaceCorners(this->Motion, PartOf(progress, 0.0, 0.4));
  rendering.RunMaps(palette, maps, PartOf(progress, 0.4, 1.0));
}
}
