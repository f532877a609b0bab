#include "CoronaryOstia.h"

#include "DistanceTransform.h"
#include "MultiscaleVesselness.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr float Nothing = -2000.0f; ///< outside the image; no tissue is that dark

/// Voxels of a cube-shaped grid along the world axes.
struct WorldVolume
{
  Vector3 corner; ///< centre of voxel (0, 0, 0), mm
  double spacing; ///< mm
  std::array<int, 3> size;
  std::vector<float> values;

  std::int64_t Index(int i, int j, int k) const
  {
    return (static_cast<std::int64_t>(k) * this->size[1] + j) * this->size[0] + i;
  }
  std::array<int, 3> Place(std::int64_t p) const
  {
    const std::int64_t row = p / this->size[0];
    return { static_cast<int>(p % this->size[0]), static_cast<int>(row % this->size[1]),
      static_cast<int>(row / this->size[1]) };
  }
  Vector3 World(const std::array<int, 3>& p) const
  {
    return this->corner + this->spacing * Vector3(p[0], p[1], p[2]);
  }
};

/// Trilinear value of the corners that have one, or Nothing outside and where none has.
template <typename T>
float Interpolate(
  const T* values, const std::array<int, 3>& n, const std::array<double, 3>& position)
{
  std::array<int, 3> low;
  std::array<float, 3> f;
  for (int axis = 0; axis < 3; ++axis)
  {
    // Half a voxel of border belongs to the image.
    if (!(position[axis] >= -0.5 && position[axis] <= n[axis] - 0.5))
    {
      return Nothing;
    }
    const double inside = std::clamp(position[axis], 0.0, n[axis] - 1.0);
    low[axis] = std::min(static_cast<int>(inside), std::max(0, n[axis] - 2));
    f[axis] = static_cast<float>(inside - low[axis]);
  }
  const std::int64_t dx = n[0] > 1 ? 1 : 0;
  const std::int64_t dy = n[1] > 1 ? n[0] : 0;
  const std::int64_t dz = n[2] > 1 ? static_cast<std::int64_t>(n[0]) * n[1] : 0;
  const T* p = values + (static_cast<std::int64_t>(low[2]) * n[1] + low[1]) * n[0] + low[0];
  const auto row = [&](const T* q)
  { return (1.0f - f[0]) * static_cast<float>(q[0]) + f[0] * static_cast<float>(q[dx]); };
  const auto plane = [&](const T* q) { return (1.0f - f[1]) * row(q) + f[1] * row(q + dy); };
  const float value = (1.0f - f[2]) * plane(p) + f[2] * plane(p + dz);
  if (std::isfinite(value))
  {
    return value;
  }
  float sum = 0.0f;
  float weights = 0.0f;
  for (int corner = 0; corner < 8; ++corner)
  {
    const float at =
      static_cast<float>(p[(corner & 1 ? dx : 0) + (corner & 2 ? dy : 0) + (corner & 4 ? dz : 0)]);
    const float weight = (corner & 1 ? f[0] : 1.0f - f[0]) * (corner & 2 ? f[1] : 1.0f - f[1]) *
      (corner & 4 ? f[2] : 1.0f - f[2]);
    if (std::isfinite(at))
    {
      sum += weight * at;
      weights += weight;
    }
  }
  return weights > 0.0f ? sum / weights : Nothing;
}

/// The image on a world grid; each value is the mean of 2 x 2 x 2 samples.
WorldVolume Resample(const ScalarImage& image, const Vector3& low, const Vector3& high,
  double spacing, const ProgressCallback& progress)
{
  WorldVolume result;
  result.corner = low;
  result.spacing = spacing;
  for (int axis = 0; axis < 3; ++axis)
  {
    result.size[axis] =
      std::max(1, 1 + static_cast<int>(std::floor((high[axis] - low[axis]) / spacing + 1e-6)));
  }
  result.values.resize(static_cast<std::size_t>(result.size[0]) * result.size[1] * result.size[2]);
  const ImageGrid& grid = image.grid;
  const Matrix3 toIndex = grid.spacing.cwiseInverse().asDiagonal() * grid.direction.transpose();
  const Vector3 shift(grid.extent[0], grid.extent[2], grid.extent[4]);
  const std::array<int, 3> n = image.Dimensions();
  std::visit(
    [&](const auto* values)
    {
      ParallelFor(
        result.size[2], 1,
        [&](std::int64_t first, std::int64_t last)
        {
          for (int k = static_cast<int>(first); k < last; ++k)
          {
            for (int j = 0; j < result.size[1]; ++j)
            {
              for (int i = 0; i < result.size[0]; ++i)
              {
                const Vector3 centre = result.World({ i, j, k });
                float sum = 0.0f;
                int samples = 0;
                for (int corner = 0; corner < 8; ++corner)
                {
                  const Vector3 offset(corner & 1 ? 0.25 : -0.25, corner & 2 ? 0.25 : -0.25,
                    corner & 4 ? 0.25 : -0.25);
                  const Vector3 index = toIndex * (centre + spacing * offset - grid.origin) - shift;
                  const float value = Interpolate(values, n, { index[0], index[1], index[2] });
                  if (value > Nothing)
                  {
                    sum += value;
                    ++samples;
                  }
                }
                result.values[result.Index(i, j, k)] = samples == 0 ? Nothing : sum / samples;
              }
            }
          }
        },
        progress);
    },
    image.values);
  return result;
}

/// World box around the image's voxels.
std::pair<Vector3, Vector3> Bounds(const ImageGrid& grid)
{
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (int corner = 0; corner < 8; ++corner)
  {
    const Vector3 p = grid.IndexToWorld(grid.extent[corner & 1 ? 1 : 0],
      grid.extent[corner & 2 ? 3 : 2], grid.extent[corner & 4 ? 5 : 4]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return { low, high };
}

double Median(std::vector<double>& values)
{
  if (values.empty())
  {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// ---------------------------------------------------------------------------------------------
// Bright circles in axial slices
// ---------------------------------------------------------------------------------------------

/// A bright disc in one axial slice.
struct Disc
{
  double x; ///< in voxels of the slice
  double y;
  double radius; ///< mm
  double mean;   ///< HU inside
  double score;  ///< 0 to 1: how much of the rim is there, and how round it is
};

/// One axial slice, limited to the values between muscle and blood, and smoothed.
class AxialSlice
{
public:
  AxialSlice(const WorldVolume& volume, int k)
    : Volume(volume)
    , Nx(volume.size[0])
    , Ny(volume.size[1])
    , Smooth(static_cast<std::size_t>(this->Nx) * this->Ny)
    , Raw(&volume.values[volume.Index(0, 0, k)])
  {
    constexpr std::array<float, 5> kernel{ 0.0545f, 0.2442f, 0.4026f, 0.2442f, 0.0545f };
    std::vector<float> rows(this->Smooth.size());
    for (int y = 0; y < this->Ny; ++y)
    {
      for (int x = 0; x < this->Nx; ++x)
      {
        float sum = 0.0f;
        for (int t = -2; t <= 2; ++t)
        {
          sum += kernel[t + 2] * this->Limited(std::clamp(x + t, 0, this->Nx - 1), y);
        }
        rows[y * this->Nx + x] = sum;
      }
    }
    for (int y = 0; y < this->Ny; ++y)
    {
      for (int x = 0; x < this->Nx; ++x)
      {
        float sum = 0.0f;
        for (int t = -2; t <= 2; ++t)
        {
          sum += kernel[t + 2] * rows[std::clamp(y + t, 0, this->Ny - 1) * this->Nx + x];
        }
        this->Smooth[y * this->Nx + x] = sum;
      }
    }
  }

  /// Discs whose rim is at least half there, best first.
  std::vector<Disc> Find(const CoronaryOstiaSettings& settings) const
  {
    const double h = this->Volume.spacing;
    const int radii = 1 + static_cast<int>((settings.largestAorta - settings.smallestAorta) / h);
    const std::size_t pixels = this->Smooth.size();
    std::vector<float> votes(pixels * radii, 0.0f);
    for (int y = 1; y + 1 < this->Ny; ++y)
    {
      for (int x = 1; x + 1 < this->Nx; ++x)
      {
        const double gx = this->At(x + 1, y) - this->At(x - 1, y);
        const double gy = this->At(x, y + 1) - this->At(x, y - 1);
        const double size = std::sqrt(gx * gx + gy * gy);
        if (size < 2.0 * h * RimGradient || !this->Known(x, y))
        {
          continue;
        }
        for (int r = 0; r < radii; ++r)
        {
          const double distance = settings.smallestAorta / h + r;
          const int cx = static_cast<int>(std::lround(x + distance * gx / size));
          const int cy = static_cast<int>(std::lround(y + distance * gy / size));
          if (cx >= 0 && cy >= 0 && cx < this->Nx && cy < this->Ny)
          {
            votes[r * pixels + cy * this->Nx + cx] += static_cast<float>(1.0 / distance);
          }
        }
      }
    }
    // Best radius of each centre; neighbouring centres and radii vote together.
    std::vector<float> best(pixels, 0.0f);
    std::vector<int> bestRadius(pixels, 0);
    for (int y = 1; y + 1 < this->Ny; ++y)
    {
      for (int x = 1; x + 1 < this->Nx; ++x)
      {
        for (int r = 0; r < radii; ++r)
        {
          float sum = 0.0f;
          for (int q = std::max(0, r - 1); q <= std::min(radii - 1, r + 1); ++q)
          {
            for (int dy = -1; dy <= 1; ++dy)
            {
              const float* row = &votes[q * pixels + (y + dy) * this->Nx + x];
              sum += row[-1] + row[0] + row[1];
            }
          }
          if (sum > best[y * this->Nx + x])
          {
            best[y * this->Nx + x] = sum;
            bestRadius[y * this->Nx + x] = r;
          }
        }
      }
    }
    std::vector<int> order(pixels);
    for (std::size_t p = 0; p < pixels; ++p)
    {
      order[p] = static_cast<int>(p);
    }
    constexpr std::size_t proposals = 400;
    const std::size_t count = std::min(proposals, pixels);
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count),
      order.end(), [&](int a, int b) { return best[a] != best[b] ? best[a] > best[b] : a < b; });
    std::vector<Disc> result;
    std::vector<std::array<double, 2>> taken;
    for (std::size_t n = 0; n < count && taken.size() < 16; ++n)
    {
      const double x = order[n] % this->Nx;
      const double y = order[n] / this->Nx; // NOLINT(bugprone-integer-division)
      const bool near = std::any_of(taken.begin(), taken.end(),
        [&](const auto& t) { return std::hypot(t[0] - x, t[1] - y) * h < 5.0; });
      if (near || best[order[n]] <= 0.0f)
      {
        continue;
      }
      taken.push_back({ x, y });
      Disc disc{ x, y, settings.smallestAorta + h * bestRadius[order[n]], 0.0, 0.0 };
      if (this->Fit(disc, settings) && disc.mean >= settings.smallestBlood)
      {
        const bool same = std::any_of(result.begin(), result.end(),
          [&](const Disc& other)
          {
            return std::hypot(other.x - disc.x, other.y - disc.y) * h < 3.0 &&
              std::abs(other.radius - disc.radius) < 2.0;
          });
        if (!same)
        {
          result.push_back(disc);
        }
      }
    }
    std::sort(
      result.begin(), result.end(), [](const Disc& a, const Disc& b) { return a.score > b.score; });
    return result;
  }

private:
  static constexpr double RimGradient = 25.0; ///< HU/mm that make an edge
  static constexpr int Rays = 48;

  float Limited(int x, int y) const
  {
    return std::clamp(this->Raw[y * this->Nx + x], 0.0f, 600.0f);
  }
  bool Known(int x, int y) const
  {
    // Edges of the image itself are no rims.
    for (int dy = -1; dy <= 1; ++dy)
    {
      for (int dx = -1; dx <= 1; ++dx)
      {
        const int u = std::clamp(x + dx, 0, this->Nx - 1);
        const int v = std::clamp(y + dy, 0, this->Ny - 1);
        if (this->Raw[v * this->Nx + u] <= Nothing)
        {
          return false;
        }
      }
    }
    return true;
  }
  float At(int x, int y) const { return this->Smooth[y * this->Nx + x]; }
  float At(double x, double y) const
  {
    return Interpolate(this->Smooth.data(), { this->Nx, this->Ny, 1 }, { x, y, 0.0 });
  }

  /// Moves the disc onto the steepest descents along rays; false when too few are found.
  bool Fit(Disc& disc, const CoronaryOstiaSettings& settings) const
  {
    const double h = this->Volume.spacing;
    std::vector<std::array<double, 2>> rim;
    for (int pass = 0; pass < 3; ++pass)
    {
      std::vector<double> distances;
      std::vector<std::array<double, 2>> points;
      for (int ray = 0; ray < Rays; ++ray)
      {
        const double cosine = std::cos(2.0 * Pi * ray / Rays);
        const double sine = std::sin(2.0 * Pi * ray / Rays);
        const double step = 0.5;
        double steepest = RimGradient;
        double place = -1.0;
        const double from = 0.65 * disc.radius;
        const int steps = static_cast<int>(std::ceil((1.35 * disc.radius - from) / step));
        for (int i = 0; i < steps; ++i)
        {
          const double rho = from + i * step;
          const float inner =
            this->At(disc.x + (rho - 0.75) / h * cosine, disc.y + (rho - 0.75) / h * sine);
          const float outer =
            this->At(disc.x + (rho + 0.75) / h * cosine, disc.y + (rho + 0.75) / h * sine);
          if (outer <= Nothing)
          {
            break;
          }
          const double drop = (inner - outer) / 1.5;
          if (drop > steepest)
          {
            steepest = drop;
            place = rho;
          }
        }
        if (place > 0.0)
        {
          distances.push_back(place);
          points.push_back({ disc.x + place / h * cosine, disc.y + place / h * sine });
        }
      }
      if (distances.size() < Rays / 2)
      {
        return false;
      }
      const double middle = Median(distances);
      // Least squares circle through the points near the median distance (Kasa).
      rim.clear();
      Matrix3 normal = Matrix3::Zero();
      Vector3 right = Vector3::Zero();
      for (const auto& p : points)
      {
        const double u = p[0] - disc.x;
        const double v = p[1] - disc.y;
        if (std::abs(std::hypot(u, v) * h - middle) < 0.15 * middle)
        {
          const Vector3 row(u, v, 1.0);
          normal += row * row.transpose();
          right += row * (u * u + v * v);
          rim.push_back(p);
        }
      }
      if (rim.size() < Rays / 2)
      {
        return false;
      }
      const Vector3 solution = normal.ldlt().solve(right);
      const double cx = 0.5 * solution[0];
      const double cy = 0.5 * solution[1];
      const double radius = std::sqrt(std::max(0.0, solution[2] + cx * cx + cy * cy)) * h;
      if (!(std::hypot(cx, cy) * h < disc.radius) || !(radius > settings.smallestAorta) ||
        !(radius < settings.largestAorta))
      {
        return false;
      }
      disc.x += cx;
      disc.y += cy;
      disc.radius = radius;
    }
    double squares = 0.0;
    for (const auto& p : rim)
    {
      const double d = std::hypot(p[0] - disc.x, p[1] - disc.y) * h - disc.radius;
      squares += d * d;
    }
    const double deviation = std::sqrt(squares / static_cast<double>(rim.size())) / disc.radius;

    double sum = 0.0;
    double sum2 = 0.0;
    int count = 0;
    const int reach = static_cast<int>(0.75 * disc.radius / h);
    for (int y = static_cast<int>(disc.y) - reach; y <= disc.y + reach; ++y)
    {
      for (int x = static_cast<int>(disc.x) - reach; x <= disc.x + reach; ++x)
      {
        if (x >= 0 && y >= 0 && x < this->Nx && y < this->Ny &&
          std::hypot(x - disc.x, y - disc.y) <= reach)
        {
          const double value = this->Raw[y * this->Nx + x];
          sum += value;
          sum2 += value * value;
          ++count;
        }
      }
    }
    if (count == 0)
    {
      return false;
    }
    disc.mean = sum / count;
    const double uneven =
      std::sqrt(std::max(0.0, sum2 / count - disc.mean * disc.mean)) / std::max(1.0, disc.mean);
    disc.score = std::clamp(
      static_cast<double>(rim.size()) / Rays - 2.0 * deviation - std::max(0.0, uneven - 0.1), 0.0,
      1.0);
    return disc.score > 0.35;
  }

  const WorldVolume& Volume;
  int Nx;
  int Ny;
  std::vector<float> Smooth;
  const float* Raw;
};

/// Discs of neighbouring slices that continue each other.
struct Tube
{
  std::vector<AorticSection> sections; ///< upwards
  double mean = 0.0;
  double score = 0.0; ///< sum over the slices
};

std::vector<Tube> FindTubes(const WorldVolume& volume, const CoronaryOstiaSettings& settings,
  const ProgressCallback& progress)
{
  std::vector<std::vector<Disc>> discs(volume.size[2]);
  ParallelFor(
    volume.size[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t k = first; k < last; ++k)
      {
        discs[k] = AxialSlice(volume, static_cast<int>(k)).Find(settings);
      }
    },
    progress);

  constexpr int longestGap = 3; // slices
  constexpr std::size_t tubesAtMost = 6;
  const double h = volume.spacing;
  std::vector<Tube> result;
  while (result.size() < tubesAtMost)
  {
    // Best chain upwards that ends in each disc.
    struct Link
    {
      double score;
      int slice;
      int disc;
    };
    std::vector<std::vector<Link>> links(discs.size());
    Link best{ 0.0, -1, -1 };
    for (int k = 0; k < static_cast<int>(discs.size()); ++k)
    {
      for (int d = 0; d < static_cast<int>(discs[k].size()); ++d)
      {
        const Disc& disc = discs[k][d];
        Link link{ disc.score, -1, -1 };
        for (int below = std::max(0, k - longestGap); below < k; ++below)
        {
          for (int e = 0; e < static_cast<int>(discs[below].size()); ++e)
          {
            const Disc& other = discs[below][e];
            const double rise = (k - below) * h;
            const double moved = std::hypot(disc.x - other.x, disc.y - other.y) * h;
            const double score =
              links[below][e].score + disc.score - 0.2 * (k - below - 1) - 0.1 * moved / rise;
            if (moved < 1.0 + 0.9 * rise && std::abs(disc.radius - other.radius) < 1.0 + rise &&
              std::abs(disc.mean - other.mean) < 0.15 * other.mean && score > link.score)
            {
              link = { score, below, e };
            }
          }
        }
        links[k].push_back(link);
        if (link.score > best.score)
        {
          best = { link.score, k, d };
        }
      }
    }
    if (best.slice < 0)
    {
      break;
    }
    Tube tube;
    tube.score = best.score;
    std::vector<double> means;
    for (int k = best.slice, d = best.disc; k >= 0;)
    {
      const Disc& disc = discs[k][d];
      tube.sections.push_back({ volume.corner + h * Vector3(disc.x, disc.y, k), disc.radius });
      means.push_back(disc.mean);
      discs[k][d].score = -1.0;
      const Link link = links[k][d];
      k = link.slice;
      d = link.disc;
    }
    for (std::vector<Disc>& slice : discs)
    {
      slice.erase(std::remove_if(
                    slice.begin(), slice.end(), [](const Disc& disc) { return disc.score < 0.0; }),
        slice.end());
    }
    std::reverse(tube.sections.begin(), tube.sections.end());
    tube.mean = Median(means);
    constexpr double shortest = 6.0; // mm
    if (tube.sections.back().centre[2] - tube.sections.front().centre[2] >= shortest)
    {
      result.push_back(std::move(tube));
    }
    else
    {
      break;
    }
  }
  return result;
}

/// The tube's axis at any height; below its lowest section the axis goes on straight.
class TubeAxis
{
public:
  explicit TubeAxis(const std::vector<AorticSection>& sections)
    : Sections(sections)
  {
    // Slope of the lowest 15 mm by least squares.
    constexpr double span = 15.0;
    double n = 0.0;
    double sz = 0.0;
    double szz = 0.0;
    Vector3 sc = Vector3::Zero();
    Vector3 szc = Vector3::Zero();
    const double bottom = sections.front().centre[2];
    for (const AorticSection& s : sections)
    {
      const double z = s.centre[2] - bottom;
      if (z <= span)
      {
        n += 1.0;
        sz += z;
        szz += z * z;
        sc += s.centre;
        szc += z * s.centre;
      }
    }
    const double determinant = n * szz - sz * sz;
    if (determinant > 1e-9)
    {
      this->Slope = (n * szc - sz * sc) / determinant;
      this->Slope[2] = 0.0;
      const double steep = this->Slope.norm();
      if (steep > 1.0)
      {
        this->Slope /= steep; // 45 degrees
      }
    }
  }

  AorticSection At(double z) const
  {
    const AorticSection& lowest = this->Sections.front();
    const AorticSection& highest = this->Sections.back();
    if (z <= lowest.centre[2])
    {
      const double down = z - lowest.centre[2];
      return { lowest.centre + down * (this->Slope + Vector3::UnitZ()), lowest.radius };
    }
    if (z >= highest.centre[2])
    {
      return { Vector3(highest.centre[0], highest.centre[1], z), highest.radius };
    }
    std::size_t above = 1;
    while (this->Sections[above].centre[2] < z)
    {
      ++above;
    }
    const AorticSection& a = this->Sections[above - 1];
    const AorticSection& b = this->Sections[above];
    const double f = (z - a.centre[2]) / (b.centre[2] - a.centre[2]);
    return { a.centre + f * (b.centre - a.centre), a.radius + f * (b.radius - a.radius) };
  }

  /// Unit vector upwards along the tube from its widest section, the sinuses, on.
  Vector3 Direction() const
  {
    constexpr double span = 40.0;     // mm
    constexpr double shortest = 10.0; // mm
    const auto widest = std::max_element(this->Sections.begin(), this->Sections.end(),
      [](const AorticSection& a, const AorticSection& b) { return a.radius < b.radius; });
    const double end = this->Sections.back().centre[2];
    double low = widest->centre[2];
    if (end - low < shortest)
    {
      low = std::max(end - shortest, this->Sections.front().centre[2]);
    }
    const double high = std::min(low + span, end);
    return (this->At(high).centre - this->At(low).centre).normalized();
  }

private:
  const std::vector<AorticSection>& Sections;
  Vector3 Slope = Vector3::Zero();
};

// ---------------------------------------------------------------------------------------------
// Vessels that leave the wall
// ---------------------------------------------------------------------------------------------

/// A place on the wall that vessel hangs on.
struct Outlet
{
  CoronaryOstium ostium;
  double volume = 0.0;  ///< mm^3 of bright vessel behind it
  double azimuth = 0.0; ///< radians about the aorta: 0 left, pi/2 anterior
  double level = 0.0;   ///< mm along the aorta
  double tubular = 0.0; ///< mean vesselness along the vessel, 0 to 1
  double shade = 0.0;   ///< mm of dark path within the first 10 mm
};

/// A piece of the aortic wall: height over a tangent plane, second order.
struct WallPatch
{
  using Coefficients = Eigen::Matrix<double, 6, 1>;
  Vector3 origin;
  Vector3 outward; ///< horizontal unit vector
  Coefficients height = Coefficients::Zero();
  bool known = false;

  Vector3 Local(const Vector3& p) const
  {
    const Vector3 d = p - this->origin;
    return { d.dot(Vector3::UnitZ().cross(this->outward)), d[2], d.dot(this->outward) };
  }
  static Coefficients Row(const Vector3& local)
  {
    Coefficients r;
    r << 1.0, local[0], local[1], local[0] * local[0], local[0] * local[1], local[1] * local[1];
    return r;
  }
  /// mm outside the wall, along `outward`
  double Above(const Vector3& p) const
  {
    const Vector3 local = this->Local(p);
    return local[2] - Row(local).dot(this->height);
  }
};

class OutletSearch
{
public:
  OutletSearch(const ScalarImage& image, const Tube& tube, const CoronaryOstiaSettings& settings,
    const ProgressCallback& progress)
    : Settings(settings)
    , Axis(tube.sections)
  {
    constexpr double spacing = 0.75;
    constexpr double around = 45.0; // mm beside the aorta
    constexpr double below = 25.0;  // mm below the lowest circle: the root is no circle
    constexpr double reach = 70.0;  // mm: the ostia are near the lower end of a long aorta
    const auto [imageLow, imageHigh] = Bounds(image.grid);
    Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
    Vector3 high = -low;
    const double bottom = tube.sections.front().centre[2];
    for (const AorticSection& section : tube.sections)
    {
      if (section.centre[2] <= bottom + reach)
      {
        const Vector3 margin(section.radius + around, section.radius + around, 0.0);
        low = low.cwiseMin(section.centre - margin);
        high = high.cwiseMax(section.centre + margin);
      }
    }
    low[2] = bottom - below;
    high[2] += 10.0;
    this->Volume = Resample(image, low.cwiseMax(imageLow), high.cwiseMin(imageHigh), spacing,
      [&](double f) { return !progress || progress(0.4 * f); });
    this->Blood(tube);
    if (!(this->BloodMean > settings.softTissue))
    {
      return; // and Find() finds nothing
    }
    this->Bodies([&](double f) { return !progress || progress(0.4 + 0.3 * f); });
    this->Vessels([&](double f) { return !progress || progress(0.7 + 0.2 * f); });
    this->March();
    Report(progress, 0.9);
  }

  double Mean() const { return this->BloodMean; }
  double Deviation() const { return this->BloodDeviation; }

  std::vector<Outlet> Find() const;

private:
  void Blood(const Tube& tube);
  void Bodies(const ProgressCallback& progress);
  void Vessels(const ProgressCallback& progress);
  void March();
  bool OnTube(const Vector3& p) const
  {
    const AorticSection s = this->Axis.At(p[2]);
    return std::hypot(p[0] - s.centre[0], p[1] - s.centre[1]) < 1.25 * s.radius + 1.5;
  }
  /// 0 to 1: how much a voxel looks like vessel
  float Brightness(std::int64_t p) const { return this->Likeness[p]; }
  bool Describe(Outlet& outlet, const std::vector<std::int64_t>& members) const;
  void FollowToWall(CoronaryOstium& ostium) const;
  double Recentre(Vector3& centre, double& radius, const Vector3& axis, bool adapt) const;
  WallPatch FitWall(const Vector3& around, const std::vector<Vector3>& vessel, double radius) const;
  float At(const Vector3& p) const
  {
    const Vector3 index = (p - this->Volume.corner) / this->Volume.spacing;
    return Interpolate(
      this->Volume.values.data(), this->Volume.size, { index[0], index[1], index[2] });
  }

  const CoronaryOstiaSettings& Settings;
  TubeAxis Axis;
  WorldVolume Volume;
  double BloodMean = 0.0;
  double BloodDeviation = 0.0;
  float Half = 0.0f;                ///< HU at a wall
  std::vector<unsigned char> Body;  ///< 1 large body, 2 large body on the aorta
  std::vector<float> Likeness;      ///< 0 to 1: vessel
  std::vector<float> Tubeness;      ///< vesselness, 0 to 1
  std::vector<float> Length;        ///< mm along the path from the wall; negative: not reached
  std::vector<float> Shade;         ///< mm of darkness along that path
  std::vector<std::int64_t> Root;   ///< voxel of the wall the path starts at
  std::vector<std::int64_t> Before; ///< previous voxel of the path
};

void OutletSearch::Blood(const Tube& tube)
{
  // Where the circles are: beyond them the axis may run out of the image or into the lung.
  std::vector<double> inside;
  for (int k = 0; k < this->Volume.size[2]; ++k)
  {
    const double z = this->Volume.World({ 0, 0, k })[2];
    if (z < tube.sections.front().centre[2] || z > tube.sections.back().centre[2])
    {
      continue;
    }
    const AorticSection s = this->Axis.At(z);
    const int reach = static_cast<int>(0.6 * s.radius / this->Volume.spacing);
    const Vector3 middle = (s.centre - this->Volume.corner) / this->Volume.spacing;
    for (int j = static_cast<int>(middle[1]) - reach; j <= middle[1] + reach; ++j)
    {
      for (int i = static_cast<int>(middle[0]) - reach; i <= middle[0] + reach; ++i)
      {
        if (i >= 0 && j >= 0 && i < this->Volume.size[0] && j < this->Volume.size[1] &&
          std::hypot(i - middle[0], j - middle[1]) <= reach)
        {
          const float value = this->Volume.values[this->Volume.Index(i, j, k)];
          if (value > Nothing)
          {
            inside.push_back(value);
          }
        }
      }
    }
  }
  this->BloodMean = Median(inside);
  for (double& value : inside)
  {
    value = std::abs(value - this->BloodMean);
  }
  this->BloodDeviation = 1.4826 * Median(inside);
  const double contrast = this->BloodMean - this->Settings.softTissue;
  this->Half = static_cast<float>(this->Settings.softTissue + 0.5 * contrast);
}

void OutletSearch::Bodies(const ProgressCallback& progress)
{
  std::vector<unsigned char> blood(this->Volume.values.size());
  for (std::size_t p = 0; p < blood.size(); ++p)
  {
    blood[p] = this->Volume.values[p] > this->Half ? 1 : 0;
  }
  const Vector3 spacing = Vector3::Constant(this->Volume.spacing);
  this->Body =
    OpenWithBall(blood.data(), this->Volume.size, spacing, this->Settings.largestVessel, progress);
  for (std::size_t p = 0; p < this->Body.size(); ++p)
  {
    if (this->Body[p] &&
      this->OnTube(this->Volume.World(this->Volume.Place(static_cast<std::int64_t>(p)))))
    {
      this->Body[p] = 2;
    }
  }
}

/// What is as bright as blood; or less bright, as thin vessels in coarse voxels are, but tubular.
void OutletSearch::Vessels(const ProgressCallback& progress)
{
  const auto soft = static_cast<float>(this->Settings.softTissue);
  const auto contrast = static_cast<float>(this->BloodMean - this->Settings.softTissue);
  VesselnessSettings settings;
  settings.sigmas = { 0.75, 1.05, 1.5, 2.1 };
  settings.c = 0.25 * contrast;
  const std::array<int, 6> extent{ 0, this->Volume.size[0] - 1, 0, this->Volume.size[1] - 1, 0,
    this->Volume.size[2] - 1 };
  const MultiscaleVesselness filter(settings, Vector3::Constant(this->Volume.spacing), extent);
  this->Tubeness.resize(this->Volume.values.size());
  this->Likeness.resize(this->Volume.values.size());
  MultiscaleVesselness::Output output;
  output.vesselness = this->Tubeness.data();
  filter.Compute({ this->Volume.values.data(), extent }, extent, nullptr, output, progress);
  constexpr float tubular = 0.3f; // vesselness of a clear tube
  for (std::size_t p = 0; p < this->Likeness.size(); ++p)
  {
    const float share = (this->Volume.values[p] - soft) / contrast;
    const float blood = std::clamp((share - 0.3f) / 0.45f, 0.0f, 1.0f);
    const float thin =
      std::clamp((share - 0.1f) / 0.35f, 0.0f, 1.0f) * std::min(1.0f, this->Tubeness[p] / tubular);
    this->Likeness[p] = std::max(blood, thin);
  }
}

void OutletSearch::March()
{
  constexpr double longest = 80.0; // mm
  const std::size_t voxels = this->Volume.values.size();
  std::vector<float> cost(voxels, std::numeric_limits<float>::infinity());
  this->Shade.assign(voxels, 0.0f);
  this->Length.assign(voxels, -1.0f);
  this->Root.assign(voxels, -1);
  this->Before.assign(voxels, -1);
  struct Entry
  {
    float cost;
    std::int64_t voxel;
    bool operator<(const Entry& other) const
    {
      return this->cost != other.cost ? this->cost > other.cost : this->voxel > other.voxel;
    }
  };
  std::priority_queue<Entry> queue;
  for (std::size_t p = 0; p < voxels; ++p)
  {
    if (this->Body[p] == 2)
    {
      const auto index = static_cast<std::int64_t>(p);
      cost[p] = 0.0f;
      this->Length[p] = 0.0f;
      this->Root[p] = index;
      queue.push({ 0.0f, index });
    }
  }
  const std::array<int, 3>& n = this->Volume.size;
  while (!queue.empty())
  {
    const Entry top = queue.top();
    queue.pop();
    const std::int64_t p = top.voxel;
    if (top.cost > cost[p])
    {
      continue;
    }
    const std::array<int, 3> at = this->Volume.Place(p);
    for (int dz = -1; dz <= 1; ++dz)
    {
      for (int dy = -1; dy <= 1; ++dy)
      {
        for (int dx = -1; dx <= 1; ++dx)
        {
          const std::array<int, 3> next{ at[0] + dx, at[1] + dy, at[2] + dz };
          if (next[0] < 0 || next[1] < 0 || next[2] < 0 || next[0] >= n[0] || next[1] >= n[1] ||
            next[2] >= n[2])
          {
            continue;
          }
          const std::int64_t q = this->Volume.Index(next[0], next[1], next[2]);
          if (this->Body[q])
          {
            continue;
          }
          const auto step =
            static_cast<float>(this->Volume.spacing * std::sqrt(dx * dx + dy * dy + dz * dz));
          const float brightness = this->Brightness(q);
          const float total = cost[p] + step / (0.01f + brightness * brightness * brightness);
          if (!(total < cost[q]))
          {
            continue;
          }
          // The path may pass a narrowing, but no wall and gap.
          const float length = this->Length[p] + step;
          const float dark = this->Shade[p] + step * (1.0f - brightness);
          if (length > longest || dark > 4.0f + 0.08f * std::max(0.0f, length - 10.0f))
          {
            continue;
          }
          cost[q] = total;
          this->Shade[q] = dark;
          this->Length[q] = length;
          this->Root[q] = this->Root[p];
          this->Before[q] = p;
          queue.push({ total, q });
        }
      }
    }
  }
}

std::vector<Outlet> OutletSearch::Find() const
{
  // What hangs on each voxel of the wall.
  struct Share
  {
    double volume = 0.0;
    std::vector<std::int64_t> members;
  };
  std::vector<std::pair<std::int64_t, std::int64_t>> owned; // root, voxel
  for (std::size_t p = 0; p < this->Root.size(); ++p)
  {
    if (this->Root[p] >= 0 && !this->Body[p] &&
      this->Brightness(static_cast<std::int64_t>(p)) > 0.5f)
    {
      owned.emplace_back(this->Root[p], static_cast<std::int64_t>(p));
    }
  }
  std::sort(owned.begin(), owned.end());
  struct Place
  {
    std::int64_t root;
    std::size_t first;
    std::size_t last;
  };
  std::vector<Place> places;
  for (std::size_t n = 0; n < owned.size(); ++n)
  {
    if (places.empty() || places.back().root != owned[n].first)
    {
      places.push_back({ owned[n].first, n, n });
    }
    places.back().last = n + 1;
  }
  std::sort(places.begin(), places.end(),
    [](const Place& a, const Place& b)
    {
      const std::size_t x = a.last - a.first;
      const std::size_t y = b.last - b.first;
      return x != y ? x > y : a.root < b.root;
    });
  std::vector<Outlet> result;
  std::vector<char> used(places.size(), 0);
  constexpr double apart = 6.0; // mm between two ostia
  for (std::size_t n = 0; n < places.size() && result.size() < 12; ++n)
  {
    if (used[n])
    {
      continue;
    }
    const Vector3 centre = this->Volume.World(this->Volume.Place(places[n].root));
    std::vector<std::int64_t> members;
    for (std::size_t m = n; m < places.size(); ++m)
    {
      if (!used[m] &&
        (this->Volume.World(this->Volume.Place(places[m].root)) - centre).norm() < apart)
      {
        used[m] = 1;
        for (std::size_t o = places[m].first; o < places[m].last; ++o)
        {
          members.push_back(owned[o].second);
        }
      }
    }
    Outlet outlet;
    outlet.volume = static_cast<double>(members.size()) * std::pow(this->Volume.spacing, 3);
    if (this->Describe(outlet, members))
    {
      result.push_back(outlet);
    }
  }
  return result;
}

bool OutletSearch::Describe(Outlet& outlet, const std::vector<std::int64_t>& members) const
{
  // The longest path, and the vessel's middle along its first millimetres.
  std::int64_t tip = -1;
  for (const std::int64_t p : members)
  {
    if (tip < 0 || this->Length[p] > this->Length[tip])
    {
      tip = p;
    }
  }
  constexpr double shortest = 8.0; // mm: less is a bump of the wall
  if (tip < 0 || this->Length[tip] < shortest)
  {
    return false;
  }
  outlet.ostium.length = this->Length[tip];
  std::vector<std::int64_t> path;
  for (std::int64_t p = tip; p >= 0; p = this->Before[p])
  {
    path.push_back(p);
  }
  std::reverse(path.begin(), path.end());

  constexpr double start = 10.0;
  constexpr double least = 4.0;
  constexpr double most = 45.0;
  int count = 0;
  for (const std::int64_t p : path)
  {
    if (this->Length[p] < least || this->Length[p] > most)
    {
      continue;
    }
    // The path need not run in the middle.
    const std::array<int, 3> at = this->Volume.Place(p);
    float best = 0.0f;
    for (int k = std::max(0, at[2] - 1); k <= std::min(this->Volume.size[2] - 1, at[2] + 1); ++k)
    {
      for (int j = std::max(0, at[1] - 1); j <= std::min(this->Volume.size[1] - 1, at[1] + 1); ++j)
      {
        for (int i = std::max(0, at[0] - 1); i <= std::min(this->Volume.size[0] - 1, at[0] + 1);
             ++i)
        {
          best = std::max(best, this->Tubeness[this->Volume.Index(i, j, k)]);
        }
      }
    }
    outlet.tubular += best;
    ++count;
  }
  outlet.tubular /= std::max(1, count);
  for (const std::int64_t p : path)
  {
    if (this->Length[p] <= start)
    {
      outlet.shade = this->Shade[p];
    }
  }

  constexpr double first = 1.0;
  constexpr double last = 5.0;
  std::vector<Vector3> middles;
  std::vector<double> areas;
  for (const std::int64_t p : path)
  {
    const double length = this->Length[p];
    if (length < first || length > last)
    {
      continue;
    }
    // Bright voxels that are as far along, around here.
    const Vector3 here = this->Volume.World(this->Volume.Place(p));
    Vector3 sum = Vector3::Zero();
    double weight = 0.0;
    for (const std::int64_t m : members)
    {
      const Vector3 there = this->Volume.World(this->Volume.Place(m));
      if (std::abs(this->Length[m] - length) < 0.75 && (there - here).norm() < 5.0)
      {
        const double w = this->Brightness(m);
        sum += w * there;
        weight += w;
      }
    }
    if (weight > 0.0)
    {
      middles.emplace_back(sum / weight);
      areas.push_back(weight * std::pow(this->Volume.spacing, 3) / 1.5);
    }
  }
  if (middles.size() < 3)
  {
    return false;
  }
  outlet.ostium.radius = std::sqrt(Median(areas) / Pi);
  Vector3 mean = Vector3::Zero();
  for (const Vector3& m : middles)
  {
    mean += m;
  }
  mean /= static_cast<double>(middles.size());
  Matrix3 scatter = Matrix3::Zero();
  for (const Vector3& m : middles)
  {
    scatter += (m - mean) * (m - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(scatter);
  Vector3 axis = solver.eigenvectors().col(2);
  if (axis.dot(middles.back() - middles.front()) < 0.0)
  {
    axis = -axis;
  }
  outlet.ostium.axis = axis;

  outlet.ostium.position = middles.front();
  this->FollowToWall(outlet.ostium);
  const Vector3& position = outlet.ostium.position;
  outlet.level = position.dot(this->Axis.Direction());
  const AorticSection s = this->Axis.At(position[2]);
  outlet.azimuth = std::atan2(s.centre[1] - position[1], position[0] - s.centre[0]);
  return true;
}

/// The wall around a place on it, without the vessel's mouth, continued over that.
WallPatch OutletSearch::FitWall(
  const Vector3& around, const std::vector<Vector3>& vessel, double radius) const
{
  constexpr double extent = 12.0; // mm of wall to fit
  WallPatch patch;
  patch.origin = around;
  patch.outward = around - this->Axis.At(around[2]).centre;
  patch.outward[2] = 0.0;
  if (!(patch.outward.norm() > 0.0))
  {
    return patch;
  }
  patch.outward.normalize();

  // Faces between the aorta and what is not blood.
  std::vector<Vector3> points;
  const auto collect = [&](const std::array<int, 3>& at)
  {
    const std::int64_t p = this->Volume.Index(at[0], at[1], at[2]);
    if (this->Body[p] != 2)
    {
      return;
    }
    for (int direction = 0; direction < 6; ++direction)
    {
      std::array<int, 3> next = at;
      const int axis = direction / 2;
      next[axis] += direction % 2 ? 1 : -1;
      if (next[axis] < 0 || next[axis] >= this->Volume.size[axis])
      {
        continue;
      }
      const float inside = this->Volume.values[p];
      const float outside = this->Volume.values[this->Volume.Index(next[0], next[1], next[2])];
      if (outside >= this->Half || outside <= Nothing)
      {
        continue;
      }
      const double f = (inside - this->Half) / (inside - outside);
      const Vector3 place = (1.0 - f) * this->Volume.World(at) + f * this->Volume.World(next);
      const bool mouth = std::any_of(vessel.begin(), vessel.end(),
        [&](const Vector3& v) { return (place - v).norm() < 1.3 * radius + 0.5; });
      const Vector3 local = patch.Local(place);
      if (!mouth && local.norm() < extent && local[2] > -0.5 * extent)
      {
        points.push_back(local);
      }
    }
  };
  const Vector3 middle = (around - this->Volume.corner) / this->Volume.spacing;
  const int reach = static_cast<int>(extent / this->Volume.spacing) + 1;
  std::array<int, 3> low;
  std::array<int, 3> high;
  for (int axis = 0; axis < 3; ++axis)
  {
    low[axis] = std::max(0, static_cast<int>(middle[axis]) - reach);
    high[axis] = std::min(this->Volume.size[axis] - 1, static_cast<int>(middle[axis]) + reach);
  }
  for (int k = low[2]; k <= high[2]; ++k)
  {
    for (int j = low[1]; j <= high[1]; ++j)
    {
      for (int i = low[0]; i <= high[0]; ++i)
      {
        collect({ i, j, k });
      }
    }
  }
  constexpr std::size_t enough = 40;
  if (points.size() < enough)
  {
    return patch;
  }
  // Least squares, with less and less say for outliers.
  double width = 1e9;
  for (int pass = 0; pass < 6; ++pass)
  {
    Eigen::Matrix<double, 6, 6> normal = 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
    WallPatch::Coefficients right = WallPatch::Coefficients::Zero();
    for (const Vector3& p : points)
    {
      const WallPatch::Coefficients r = WallPatch::Row(p);
      const double e = (p[2] - r.dot(patch.height)) / width;
      const double w = 1.0 / ((1.0 + e * e) * (1.0 + e * e));
      normal += w * r * r.transpose();
      right += w * p[2] * r;
    }
    patch.height = normal.ldlt().solve(right);
    width = pass < 2 ? 2.0 : 0.7;
  }
  patch.known = true;
  return patch;
}

/**
 * Moves `centre` across the axis to the middle of the vessel, as far as its rim is visible: where
 * the vessel opens into the aorta there is none, and the radius of before has to do.
 * @return how much of the rim is visible, 0 to 1; 0 when the centre stays
 */
double OutletSearch::Recentre(
  Vector3& centre, double& radius, const Vector3& axis, bool adapt) const
{
  constexpr int rays = 24;
  constexpr double step = 0.15;
  const Vector3 u = axis.unitOrthogonal();
  const Vector3 v = axis.cross(u);
  std::vector<std::array<double, 2>> rim;
  for (int ray = 0; ray < rays; ++ray)
  {
    const double cosine = std::cos(2.0 * Pi * ray / rays);
    const double sine = std::sin(2.0 * Pi * ray / rays);
    float before = this->At(centre);
    const int steps = static_cast<int>(std::ceil((1.6 * radius + 0.5) / step));
    for (int i = 1; i < steps; ++i)
    {
      const double rho = i * step;
      const float value = this->At(centre + rho * (cosine * u + sine * v));
      if (value < this->Half)
      {
        if (before >= this->Half)
        {
          const double exact = rho - step * (this->Half - value) / (before - value);
          rim.push_back({ exact * cosine, exact * sine });
        }
        break;
      }
      before = value;
    }
  }
  if (rim.size() < rays / 4)
  {
    return 0.0;
  }
  double x = 0.0;
  double y = 0.0;
  double r = radius;
  const bool whole = adapt && rim.size() > rays * 2 / 3;
  for (int pass = 0; pass < 10; ++pass)
  {
    // Gauss-Newton on the distances to the rim; a little weight keeps what the rim leaves open.
    Matrix3 normal = Vector3(1.0, 1.0, whole ? 1.0 : 1e9).asDiagonal();
    Vector3 right(-x, -y, 0.0);
    for (const auto& p : rim)
    {
      const double dx = p[0] - x;
      const double dy = p[1] - y;
      const double d = std::max(1e-6, std::hypot(dx, dy));
      const double e = d - r;
      const double w = 1.0 / (1.0 + e * e / 0.25);
      const Vector3 g(-dx / d, -dy / d, -1.0);
      normal += w * g * g.transpose();
      right -= w * e * g;
    }
    const Vector3 move = normal.ldlt().solve(right);
    x += move[0];
    y += move[1];
    r += move[2];
  }
  if (!(std::hypot(x, y) < radius) || !(r > 0.3) || !(r < 2.0 * radius + 0.5))
  {
    return 0.0;
  }
  centre += x * u + y * v;
  radius = r;
  return static_cast<double>(rim.size()) / rays;
}

/// From a place inside the vessel back along its middle to the aortic wall.
void OutletSearch::FollowToWall(CoronaryOstium& ostium) const
{
  constexpr double step = 0.5;
  constexpr double farthest = 12.0;
  Vector3 axis = ostium.axis;
  double radius = std::clamp(ostium.radius, 0.8, this->Settings.largestVessel);
  for (int pass = 0; pass < 2; ++pass)
  {
    this->Recentre(ostium.position, radius, axis, true);
  }
  ostium.radius = radius;

  // A first idea of the place: straight back until the aorta's body begins.
  const auto inBody = [&](const Vector3& p)
  {
    std::array<int, 3> at;
    for (int i = 0; i < 3; ++i)
    {
      at[i] = static_cast<int>(std::lround((p[i] - this->Volume.corner[i]) / this->Volume.spacing));
      if (at[i] < 0 || at[i] >= this->Volume.size[i])
      {
        return true;
      }
    }
    return this->Body[this->Volume.Index(at[0], at[1], at[2])] != 0;
  };
  std::vector<Vector3> vessel{ ostium.position };
  while (!inBody(vessel.back()) && step * static_cast<double>(vessel.size()) < farthest)
  {
    vessel.emplace_back(vessel.back() - step * axis);
  }
  Vector3 crossing = vessel.back();

  // Then along the middle of what is visible, until the wall that the surroundings suggest.
  for (int pass = 0; pass < 2; ++pass)
  {
    const WallPatch wall = this->FitWall(crossing, vessel, radius);
    if (!wall.known)
    {
      break;
    }
    Vector3 direction = axis;
    vessel.assign(1, ostium.position);
    double above = wall.Above(vessel.back());
    double before = above;
    // A vessel that leaves along the wall is half open where its axis meets it.
    int open = 0;
    while (above > 0.0 && open < 2 && step * static_cast<double>(vessel.size()) < farthest)
    {
      Vector3 next = vessel.back() - step * direction;
      const double visible = this->Recentre(next, radius, direction, false);
      open = visible < 0.5 ? open + 1 : 0;
      if (visible > 0.8)
      {
        const Vector3 turned = (vessel.back() - next).normalized();
        if (turned.dot(direction) > 0.5)
        {
          direction = (0.8 * direction + 0.2 * turned).normalized();
        }
      }
      vessel.push_back(next);
      before = above;
      above = wall.Above(next);
    }
    if (open == 2)
    {
      crossing = vessel[vessel.size() - 2];
      break;
    }
    if (above > 0.0)
    {
      break;
    }
    crossing = vessel.back();
    if (vessel.size() > 1)
    {
      const double f = before / (before - above);
      crossing = (1.0 - f) * vessel[vessel.size() - 2] + f * vessel.back();
    }
  }
  ostium.position = crossing;
}

/// Falls from 1 at the middle with a standard deviation of `width`; angles in radians.
double AngleScore(double angle, double middle, double width)
{
  const double d = std::remainder(angle - middle, 2.0 * Pi) / width;
  return std::exp(-0.5 * d * d);
}

/// How well an outlet would do as the left or the right ostium, 0 to 1.
double Suitability(const Outlet& outlet, bool left, const CoronaryOstiaSettings& settings)
{
  // Seen from above the right ostium is in front, the left one behind on the left.
  constexpr double leftAzimuth = -45.0 * Pi / 180.0;
  constexpr double rightAzimuth = 95.0 * Pi / 180.0;
  constexpr double width = 40.0 * Pi / 180.0;
  const double direction = AngleScore(outlet.azimuth, left ? leftAzimuth : rightAzimuth, width);
  const double length = std::min(1.0, outlet.ostium.length / settings.vesselLength);
  const double r = outlet.ostium.radius;
  const double usual = 0.8 * settings.largestVessel;
  const double calibre = std::clamp(r / 0.8, 0.0, 1.0) *
    (r > usual ? std::exp(-0.5 * std::pow((r - usual) / 0.7, 2)) : 1.0);
  // A narrow or hidden beginning may be a wall between two vessels.
  const double open = 1.0 - 0.5 * std::clamp((outlet.shade - 1.0) / 3.0, 0.0, 1.0);
  // The rims of chambers are bright and long as well, but no tubes.
  const double tubular = std::clamp((outlet.tubular - 0.05) / 0.2, 0.0, 1.0);
  return length * calibre * direction * open * tubular;
}

struct Choice
{
  double score = 0.0;
  int left = -1;
  int right = -1;
  double leftScore = 0.0;
  double rightScore = 0.0;
};

/// The best pair of outlets, or the best single one.
Choice Choose(const std::vector<Outlet>& outlets, const CoronaryOstiaSettings& settings)
{
  constexpr double apart = 8.0;      // mm
  constexpr double sameLevel = 12.0; // mm: both leave the root
  Choice best;
  const int count = static_cast<int>(outlets.size());
  for (int l = -1; l < count; ++l)
  {
    for (int r = -1; r < count; ++r)
    {
      if (l >= 0 && r >= 0 &&
        (l == r || (outlets[l].ostium.position - outlets[r].ostium.position).norm() < apart))
      {
        continue;
      }
      double left = l >= 0 ? Suitability(outlets[l], true, settings) : 0.0;
      double right = r >= 0 ? Suitability(outlets[r], false, settings) : 0.0;
      if (l >= 0 && r >= 0)
      {
        const double difference = std::abs(outlets[l].level - outlets[r].level);
        const double level =
          std::exp(-0.5 * std::pow(std::max(0.0, difference - sameLevel) / 8.0, 2));
        left *= level;
        right *= level;
      }
      // What has the wrong direction is no ostium, even when nothing better is there.
      constexpr double least = 0.05;
      if ((l >= 0 && left < least) || (r >= 0 && right < least))
      {
        continue;
      }
      if (left + right > best.score)
      {
        best = { left + right, l, r, left, right };
      }
    }
  }
  return best;
}
}

void CoronaryOstiaSettings::Validate() const
{
  const auto check = [](bool good, const char* what)
  {
    if (!good)
    {
      throw std::invalid_argument(what);
    }
  };
  check(this->smallestAorta >= 4.0 && this->smallestAorta < this->largestAorta &&
      this->largestAorta <= 60.0,
    "aortic radii must satisfy 4 <= smallestAorta < largestAorta <= 60 mm");
  check(
    this->largestVessel >= 1.0 && this->largestVessel <= 8.0, "largestVessel must be 1 to 8 mm");
  check(
    this->vesselLength >= 10.0 && this->vesselLength <= 80.0, "vesselLength must be 10 to 80 mm");
  check(std::isfinite(this->softTissue) && this->smallestBlood > this->softTissue &&
      std::isfinite(this->smallestBlood),
    "smallestBlood must be above softTissue");
}

CoronaryOstia FindCoronaryOstia(
  const ScalarImage& image, const CoronaryOstiaSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  CoronaryOstia result;
  const auto [low, high] = Bounds(image.grid);
  const std::array<int, 3> size = image.Dimensions();
  if (size[0] < 2 || size[1] < 2 || size[2] < 2)
  {
    throw std::invalid_argument("the image is not three-dimensional");
  }
  if (!(image.grid.spacing.minCoeff() > 0.0) || !image.grid.spacing.allFinite() ||
    !image.grid.origin.allFinite() || !image.grid.direction.allFinite())
  {
    throw std::invalid_argument("the image needs positive spacing and a finite position");
  }
  const auto part = [&](double from, double to)
  {
    return [&progress, from, to](double f)
    { return !progress || progress(from + (to - from) * f); };
  };
  constexpr double coarseSpacing = 1.5; // mm
  const std::vector<Tube> tubes = FindTubes(
    Resample(image, low, high, coarseSpacing, part(0.0, 0.15)), settings, part(0.15, 0.3));

  double best = 0.0;
  for (std::size_t t = 0; t < tubes.size(); ++t)
  {
    const Tube& tube = tubes[t];
    const double share = 0.7 / static_cast<double>(tubes.size());
    const double from = 0.3 + share * static_cast<double>(t);
    const OutletSearch search(image, tube, settings, part(from, from + share));
    if (!(search.Mean() > settings.softTissue))
    {
      continue;
    }
    const std::vector<Outlet> outlets = search.Find();
    const Choice choice = Choose(outlets, settings);
    // A tube of few or poor circles may be anything.
    const double length =
      tube.sections.back().centre[2] - tube.sections.front().centre[2] + coarseSpacing;
    const double roundness = tube.score / static_cast<double>(tube.sections.size());
    const double confidence = std::min(1.0, length / 15.0) * std::clamp(roundness / 0.7, 0.0, 1.0);
    if (confidence * (0.1 + choice.score) <= best)
    {
      continue;
    }
    best = confidence * (0.1 + choice.score);
    result.aorta.sections = tube.sections;
    result.aorta.mean = search.Mean();
    result.aorta.deviation = search.Deviation();
    result.aorta.confidence = confidence;
    result.ostia.clear();
    const auto add = [&](int chosen, double score, const char* name)
    {
      if (chosen >= 0)
      {
        CoronaryOstium ostium = outlets[chosen].ostium;
        ostium.name = name;
        ostium.confidence = std::min(1.0, 1.2 * score * confidence);
        result.ostia.push_back(ostium);
      }
    };
    add(choice.left, choice.leftScore, "LCA");
    add(choice.right, choice.rightScore, "RCA");
  }

  constexpr double sure = 0.5;
  if (result.aorta.sections.empty())
  {
    result.doubt = "no ascending aorta: no bright round cross-sections in a row";
  }
  else if (result.ostia.size() < 2)
  {
    result.doubt = result.ostia.empty() ? "no vessel leaves the aorta"
                                        : "only the " + result.ostia.front().name + " was found";
  }
  else
  {
    for (const CoronaryOstium& ostium : result.ostia)
    {
      if (ostium.confidence < sure)
      {
        result.doubt += (result.doubt.empty() ? "not sure of the " : " and the ") + ostium.name;
      }
    }
  }
  Report(progress, 1.0);
  return result;
}
}
