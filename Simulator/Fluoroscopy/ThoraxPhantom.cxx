#include "ThoraxPhantom.h"

#include "CounterRandom.h"
#include "Require.h"
#include "ThoraxAnatomy.h"
#include "VoxelCell.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr RequireOf RequireThorax{ "thorax" };

constexpr double Below = -208.0; ///< world z of the volume's ends, mm
constexpr double Above = 148.0;
constexpr int SlabThickness = 4; ///< slices that are made together

constexpr float Far = 1e9F;               ///< mm
constexpr double MediastinumMargin = 2.5; ///< fat between it and the lungs, mm
constexpr float Outside = -1000.0F;
constexpr float Skin = 40.0F;
constexpr float Fat = -95.0F;
constexpr float Muscle = 52.0F;
constexpr float Lung = -830.0F;
constexpr float Heart = 48.0F;
constexpr float Abdomen = 38.0F;
constexpr float Liver = 60.0F;
constexpr float Gas = -980.0F;

/// Smooth noise of mean 0 and amplitude about 1: random values on a lattice, linear between them, periodic.
class LatticeNoise
{
public:
  LatticeNoise(std::uint64_t seed, double spacing)
    : PerMillimetre(1.0 / spacing)
    , Values(static_cast<std::size_t>(Side) * Side * Side)
  {
    RandomStream random(seed, 600);
    for (float& value : this->Values)
    {
      value = static_cast<float>(random.Uniform(-1.0, 1.0));
    }
  }

  float operator()(const Vector3& p) const
  {
    const Vector3 place = p * this->PerMillimetre;
    const Vector3 floor = place.array().floor();
    const Eigen::Vector3f f = (place - floor).cast<float>();
    const Eigen::Vector3i i = floor.cast<int>();
    std::array<float, 8> cell{};
    for (int corner = 0; corner < 8; ++corner)
    {
      cell[corner] = this->Values[(static_cast<std::size_t>((i.z() + (corner >> 2)) & Mask) * Side +
                                    static_cast<std::size_t>((i.y() + (corner >> 1 & 1)) & Mask)) *
          Side +
        static_cast<std::size_t>((i.x() + (corner & 1)) & Mask)];
    }
    return Trilinear<float>(cell.data(), { 1, 2, 4 }, { f.x(), f.y(), f.z() });
  }

private:
  static constexpr int Side = 64;
  static constexpr int Mask = Side - 1;
  double PerMillimetre;
  std::vector<float> Values;
};

/// Share of a voxel that is inside a surface at a distance.
float Covered(double distance, double spacing)
{
  return static_cast<float>(std::clamp(0.5 - distance / spacing, 0.0, 1.0));
}

float Mixed(float outside, float inside, float share)
{
  return outside + share * (inside - outside);
}

class ThoraxRaster
{
public:
  ThoraxRaster(const ThoraxSettings& settings, HounsfieldVolume& volume)
    : Anatomy(settings)
    , Fine(settings.seed + 1000, 5.0)
    , Coarse(settings.seed + 2000, 21.0)
    , FatThickness(settings.fat)
    , Spacing(settings.spacing)
    , Volume(volume)
  {
    for (const auto* group :
      { &this->Anatomy.vessels, &this->Anatomy.airways, &this->Anatomy.bones })
    {
      for (const ThoraxTissue& tissue : *group)
      {
        this->Tissues.push_back({ &tissue, {}, {} });
        for (const ThoraxPart& part : tissue.parts)
        {
          this->Tissues.back().boxes.push_back(BoxOf(part));
          this->Tissues.back().box.Add(this->Tissues.back().boxes.back());
        }
      }
    }
  }

  /// Slices first to last - 1.
  void Make(int first, int last)
  {
    const ScalarImage view = this->Volume.View();
    const std::array<int, 3> n = view.Dimensions();
    Slab slab;
    slab.first = first;
    slab.columns = n[0];
    slab.rows = n[1];
    slab.slices = last - first;
    slab.values.resize(static_cast<std::size_t>(n[0]) * n[1] * slab.slices);
    slab.distances.resize(slab.values.size());
    std::size_t index = 0;
    this->MeasureMediastinum(slab);
    for (int k = first; k < last; ++k)
    {
      const ThoraxSlice slice =
        this->Anatomy.Slice(this->Volume.grid.origin.z() + k * this->Spacing);
      for (int j = 0; j < n[1]; ++j)
      {
        for (int i = 0; i < n[0]; ++i)
        {
          slab.values[index] = this->SoftTissue(slice, this->Place(i, j, k), slab.distances[index]);
          ++index;
        }
      }
    }
    for (const BoxedTissue& tissue : this->Tissues)
    {
      this->Paint(tissue, slab);
    }
    std::int16_t* out = this->Volume.values.data() + static_cast<std::size_t>(first) * n[0] * n[1];
    std::transform(slab.values.begin(), slab.values.end(), out,
      [](float value)
      { return static_cast<std::int16_t>(std::lround(std::clamp(value, -1024.0F, 3071.0F))); });
  }

private:
  struct BoxedTissue
  {
    const ThoraxTissue* tissue;
    std::vector<ThoraxBox> boxes; ///< of the parts
    ThoraxBox box;
  };
  struct Slab
  {
    int first;
    int columns;
    int rows;
    int slices;
    std::vector<float> values;
    std::vector<float> distances; ///< scratch, of one tissue
    std::size_t Index(int i, int j, int k) const
    {
      return (static_cast<std::size_t>(k - this->first) * this->rows + j) * this->columns + i;
    }
  };
  using Range = std::array<int, 6>;

  /// @param apart  from the mediastinum, mm
  float SoftTissue(const ThoraxSlice& slice, const Vector3& p, float apart) const
  {
    const double skin = ThoraxAnatomy::SkinDistance(slice, p);
    if (skin > this->Spacing)
    {
      return Outside;
    }
    double radius = 0.0;
    const double level = this->Anatomy.WallLevel(slice, p, radius);
    const double wall = ThoraxAnatomy::WallDistance(level, radius);
    if (wall < -this->Spacing)
    {
      return this->Inside(slice, p, level, wall, apart);
    }
    // Fat is thicker at the flanks, and lies between muscles.
    const float rough = this->Coarse(p);
    const double fat = this->FatThickness * (1.0 + 0.25 * rough);
    const float muscle =
      Muscle + (rough > 0.45F ? 90.0F * (0.45F - rough) : 0.0F) + 8.0F * this->Fine(p);
    float value =
      Mixed(Fat + 10.0F * this->Fine(p), muscle, Covered(skin + fat, 2.0 * this->Spacing));
    value = Mixed(value, Skin, 1.0F - Covered(skin + 1.6, this->Spacing));
    value = Mixed(Outside, value, Covered(skin, this->Spacing));
    if (wall < 0.5 * this->Spacing)
    {
      value =
        Mixed(value, this->Inside(slice, p, level, wall, apart), Covered(wall, this->Spacing));
    }
    return value;
  }

  /// Within the ribs.
  float Inside(
    const ThoraxSlice& slice, const Vector3& p, double level, double wall, double apart) const
  {
    constexpr double pleura = 5.5; ///< lungs begin so far inside of the ribs' middle
    const double below = p.z() - this->Anatomy.DiaphragmHeight(slice, p);
    const double heart = ThoraxAnatomy::HeartDistance(p);
    const float fine = this->Fine(p);
    // Fat and vessels between the lungs; fat around the heart.
    float value = -15.0F + 30.0F * this->Coarse(p) + 8.0F * fine;
    value = Mixed(value, Fat, Covered(heart - 7.0, this->Spacing));
    value = Mixed(value, Heart + 4.0F * fine, Covered(heart, this->Spacing));
    if (below < this->Spacing)
    {
      value = Mixed(value, this->Organs(slice, p), Covered(below, this->Spacing));
    }
    const double lung = std::max({ wall + pleura, -below, MediastinumMargin - apart,
      7.0 - heart - 2.0, p.z() - ThoraxAnatomy::LungTop(level) });
    if (lung < this->Spacing)
    {
      // Lying on the back: denser behind.
      const auto behind = static_cast<float>(p.y() + 20.0) * 0.45F;
      const float air = Lung + behind + 22.0F * fine + 18.0F * this->Coarse(p);
      value = Mixed(value, air, Covered(lung, this->Spacing));
    }
    return value;
  }

  float Organs(const ThoraxSlice& slice, const Vector3& p) const
  {
    const double x = p.x() - slice.middleX;
    const float fine = this->Fine(p);
    const float mixed = Abdomen + 28.0F * this->Coarse(p) + 6.0F * fine;
    float value =
      Mixed(mixed, Liver + 5.0F * fine, Covered(x - 25.0 + 0.35 * (p.z() + 100.0), 12.0));
    // The bubble of the stomach under the left dome.
    const Vector3 q = (Vector3(x, p.y(), p.z()) - Vector3(66.0, -30.0, -117.0))
                        .cwiseQuotient(Vector3(30.0, 17.0, 13.0));
    return Mixed(
      value, Gas, Covered(13.0 * (q.norm() - 1.0 + 0.2F * this->Coarse(p)), 3.0 * this->Spacing));
  }

  /// Voxels of a slab that a box may touch; empty when first > last.
  Range Voxels(const ThoraxBox& box, const Slab& slab) const
  {
    const Vector3 margin = Vector3::Constant(this->Spacing);
    const Vector3 low = (box.low - margin - this->Volume.grid.origin) / this->Spacing;
    const Vector3 high = (box.high + margin - this->Volume.grid.origin) / this->Spacing;
    const auto first = [](double value, int minimum)
    { return std::max(minimum, static_cast<int>(std::floor(std::max(value, -1e6)))); };
    const auto last = [](double value, int most)
    { return std::min(most, static_cast<int>(std::ceil(std::min(value, 1e6)))); };
    return { first(low.x(), 0), last(high.x(), slab.columns - 1), first(low.y(), 0),
      last(high.y(), slab.rows - 1), first(low.z(), slab.first),
      last(high.z(), slab.first + slab.slices - 1) };
  }

  template <typename Function>
  static void ForRows(const Range& range, const Slab& slab, const Function& function)
  {
    for (int k = range[4]; k <= range[5]; ++k)
    {
      for (int j = range[2]; j <= range[3]; ++j)
      {
        function(j, k, slab.Index(range[0], j, k));
      }
    }
  }

  Vector3 Place(int i, int j, int k) const
  {
    return this->Volume.grid.origin + this->Spacing * Vector3(i, j, k);
  }

  /// Makes distances less where a part is nearer.
  void Measure(const ThoraxPart& part, const Range& range, Slab& slab) const
  {
    std::visit(
      [&](const auto& shape)
      {
        ForRows(range, slab,
          [&](int j, int k, std::size_t index)
          {
            for (int i = range[0]; i <= range[1]; ++i, ++index)
            {
              slab.distances[index] = std::min(
                slab.distances[index], static_cast<float>(DistanceTo(shape, this->Place(i, j, k))));
            }
          });
      },
      part);
  }

  void MeasureMediastinum(Slab& slab) const
  {
    std::fill(slab.distances.begin(), slab.distances.end(), Far);
    for (const ThoraxPart& part : this->Anatomy.mediastinum)
    {
      ThoraxBox box = BoxOf(part);
      box.low.array() -= MediastinumMargin;
      box.high.array() += MediastinumMargin;
      this->Measure(part, this->Voxels(box, slab), slab);
    }
  }

  void Paint(const BoxedTissue& boxed, Slab& slab) const
  {
    const Range whole = this->Voxels(boxed.box, slab);
    if (whole[0] > whole[1] || whole[2] > whole[3] || whole[4] > whole[5])
    {
      return;
    }
    const int width = whole[1] - whole[0] + 1;
    ForRows(whole, slab,
      [&](int, int, std::size_t index)
      { std::fill_n(slab.distances.begin() + static_cast<std::ptrdiff_t>(index), width, Far); });
    for (std::size_t part = 0; part < boxed.boxes.size(); ++part)
    {
      this->Measure(boxed.tissue->parts[part], this->Voxels(boxed.boxes[part], slab), slab);
    }
    const ThoraxTissue& tissue = *boxed.tissue;
    ForRows(whole, slab,
      [&](int, int, std::size_t index)
      {
        for (int i = 0; i < width; ++i, ++index)
        {
          const float distance = slab.distances[index];
          if (distance < this->Spacing)
          {
            float& value = slab.values[index];
            value = this->Painted(tissue, distance, value);
          }
        }
      });
  }

  float Painted(const ThoraxTissue& tissue, float distance, float before) const
  {
    const float whole = Covered(distance, this->Spacing);
    if (tissue.shell <= 0.0)
    {
      return Mixed(before, tissue.coreValue, whole);
    }
    // A shell thinner than a voxel has the share of it that it fills.
    const float core = Covered(distance + tissue.shell, this->Spacing);
    return (1.0F - whole) * before + (whole - core) * tissue.shellValue + core * tissue.coreValue;
  }

  ThoraxAnatomy Anatomy;
  LatticeNoise Fine;
  LatticeNoise Coarse;
  double FatThickness;
  double Spacing;
  HounsfieldVolume& Volume;
  std::vector<BoxedTissue> Tissues;
};
}

void ThoraxSettings::Validate() const
{
  RequireThorax(
    this->spacing >= 0.8 && this->spacing <= 6.0, "spacing", this->spacing, "0.8 to 6 mm");
  RequireThorax(
    this->width >= 260.0 && this->width <= 420.0, "width", this->width, "260 to 420 mm");
  RequireThorax(this->fat >= 4.0 && this->fat <= 40.0, "fat", this->fat, "4 to 40 mm");
}

HounsfieldVolume MakeThoraxPhantom(const ThoraxSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  HounsfieldVolume volume;
  const double spacing = settings.spacing;
  const double half = 0.5 * settings.width * 1.12 + settings.fat + 4.0;
  const double depth = 0.5 * settings.width + settings.fat;
  const auto count = [spacing](double length)
  { return static_cast<int>(std::ceil(length / spacing)) + 1; };
  volume.grid.spacing = Vector3::Constant(spacing);
  volume.grid.origin = Vector3(-20.0 - half, 8.0 - 0.82 * depth, Below);
  volume.grid.extent = { 0, count(2.0 * half) - 1, 0, count(1.64 * depth) - 1, 0,
    count(Above - Below) - 1 };
  volume.values.resize(static_cast<std::size_t>(volume.View().NumberOfVoxels()));
  ThoraxRaster raster(settings, volume);
  const int slices = volume.grid.extent[5] + 1;
  ParallelFor((slices + SlabThickness - 1) / SlabThickness, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t slab = first; slab < last; ++slab)
      {
        const int begin = static_cast<int>(slab) * SlabThickness;
        raster.Make(begin, std::min(begin + SlabThickness, slices));
      }
    },
    progress);
  return volume;
}
}
