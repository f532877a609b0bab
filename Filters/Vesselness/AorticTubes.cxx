#include "AorticTubes.h"

#include "Median.h"
#include "Numbers.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double RimGradient = 25.0; ///< HU/mm that make an edge
constexpr int Rays = 48;

/// Rays that must meet a rim: half of those that the field of view does not cut, a fifth of all.
std::size_t MinimumRim(int unknown)
{
  return static_cast<std::size_t>(std::max(Rays / 5, (Rays - unknown) / 2));
}

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
    const int radii =
      1 + static_cast<int>((settings.maximumAorticRadius - settings.minimumAorticRadius) / h);
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
          const double distance = settings.minimumAorticRadius / h + r;
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
      Disc disc{ x, y, settings.minimumAorticRadius + h * bestRadius[order[n]], 0.0, 0.0 };
      if (this->Fit(disc, settings) && disc.mean >= settings.minimumBlood)
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
        if (this->Raw[v * this->Nx + u] <= WorldVolume::Nothing)
        {
          return false;
        }
      }
    }
    return true;
  }
  bool Inside(double x, double y) const
  {
    return x >= 0.0 && y >= 0.0 && x <= this->Nx - 1.0 && y <= this->Ny - 1.0 &&
      this->Raw[static_cast<int>(std::lround(y)) * this->Nx + std::lround(x)] >
      WorldVolume::Nothing;
  }
  float At(int x, int y) const { return this->Smooth[y * this->Nx + x]; }
  float At(double x, double y) const
  {
    return InterpolateKnown(this->Smooth.data(), { this->Nx, this->Ny, 1 }, { x, y, 0.0 });
  }

  /// Moves the disc onto the steepest descents along rays; false when too few are found.
  bool Fit(Disc& disc, const CoronaryOstiaSettings& settings) const
  {
    const double h = this->Volume.spacing;
    std::vector<std::array<double, 2>> rim;
    int unknown = 0;
    for (int pass = 0; pass < 3; ++pass)
    {
      std::vector<double> distances;
      std::vector<std::array<double, 2>> points;
      unknown = 0;
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
          if (!this->Inside(disc.x + (rho + 0.75) / h * cosine, disc.y + (rho + 0.75) / h * sine))
          {
            // The field of view ends here: what lies behind is not against a rim.
            unknown += place > 0.0 ? 0 : 1;
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
      if (distances.size() < MinimumRim(unknown))
      {
        return false;
      }
      const double middle = MedianOf(distances);
      // Through the points near the median distance.
      rim.clear();
      CircleFit fit;
      for (const auto& p : points)
      {
        const double u = p[0] - disc.x;
        const double v = p[1] - disc.y;
        if (std::abs(std::hypot(u, v) * h - middle) < 0.15 * middle)
        {
          fit.Add(u, v);
          rim.push_back(p);
        }
      }
      if (rim.size() < MinimumRim(unknown))
      {
        return false;
      }
      const auto [cx, cy, power] = fit.Solve();
      const double radius = std::sqrt(std::max(0.0, power + cx * cx + cy * cy)) * h;
      if (!(std::hypot(cx, cy) * h < disc.radius) || !(radius > settings.minimumAorticRadius) ||
        !(radius < settings.maximumAorticRadius))
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
          if (value <= WorldVolume::Nothing)
          {
            continue;
          }
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
    disc.score = std::clamp(static_cast<double>(rim.size()) / (Rays - unknown) -
        0.3 * unknown / Rays - 2.0 * deviation - std::max(0.0, uneven - 0.1),
      0.0, 1.0);
    return disc.score > 0.35;
  }

  const WorldVolume& Volume;
  int Nx;
  int Ny;
  std::vector<float> Smooth;
  const float* Raw;
};

/// Best chain upwards that ends in a disc.
struct Link
{
  double score;
  int slice; ///< of the disc below, -1: none
  int disc;
};

/// Takes the best chain out of the discs; false when it is none.
bool TakeChain(std::vector<std::vector<Disc>>& discs, const WorldVolume& volume, AorticTube& tube)
{
  constexpr int longestGap = 3;    // slices
  constexpr double shortest = 6.0; // mm
  const double h = volume.spacing;
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
    return false;
  }
  std::vector<double> means;
  int lowest = best.slice;
  for (int k = best.slice, d = best.disc; k >= 0;)
  {
    Disc& disc = discs[k][d];
    tube.sections.push_back(
      { volume.World(Vector3(disc.x, disc.y, k)), disc.radius, volume.axes.col(2) });
    tube.scores.push_back(disc.score);
    means.push_back(disc.mean);
    lowest = k;
    disc.score = -1.0;
    const Link link = links[k][d];
    k = link.slice;
    d = link.disc;
  }
  for (std::vector<Disc>& slice : discs)
  {
    slice.erase(
      std::remove_if(slice.begin(), slice.end(), [](const Disc& disc) { return disc.score < 0.0; }),
      slice.end());
  }
  std::reverse(tube.sections.begin(), tube.sections.end());
  std::reverse(tube.scores.begin(), tube.scores.end());
  tube.mean = MedianOf(means);
  return (best.slice - lowest) * h >= shortest;
}

/// Circles in planes of any direction.
class PlaneFit
{
public:
  PlaneFit(const WorldVolume& volume, const CoronaryOstiaSettings& settings)
    : Volume(volume)
    , Settings(settings)
  {
  }

  /**
   * Moves a section within its plane onto the rim that is seen there.
   * @param mean   HU inside
   * @returns 0 to 1: how much of the rim is there, and how round it is; 0: nothing found
   */
  double Fit(AorticSection& section, double& mean) const
  {
    const Vector3 u = section.normal.unitOrthogonal();
    const Vector3 v = section.normal.cross(u);
    std::vector<std::array<double, 2>> rim;
    int unknown = 0;
    for (int pass = 0; pass < 2; ++pass)
    {
      std::vector<double> distances;
      std::vector<std::array<double, 2>> points;
      unknown = 0;
      for (int ray = 0; ray < Rays; ++ray)
      {
        const Vector3 along =
          std::cos(2.0 * Pi * ray / Rays) * u + std::sin(2.0 * Pi * ray / Rays) * v;
        const double place = this->Edge(section, along, unknown);
        if (place > 0.0)
        {
          distances.push_back(place);
          points.push_back({ place * along.dot(u), place * along.dot(v) });
        }
      }
      if (distances.size() < MinimumRim(unknown))
      {
        return 0.0;
      }
      const double middle = MedianOf(distances);
      CircleFit fit;
      rim.clear();
      for (const auto& p : points)
      {
        if (std::abs(std::hypot(p[0], p[1]) - middle) < 0.15 * middle)
        {
          fit.Add(p[0], p[1]);
          rim.push_back(p);
        }
      }
      if (rim.size() < MinimumRim(unknown))
      {
        return 0.0;
      }
      const CircleFit::Circle circle = fit.Solve();
      const Vector3 move = circle.x * u + circle.y * v;
      const double radius = std::sqrt(std::max(0.0, circle.power + move.squaredNorm()));
      if (!(move.norm() < section.radius) || !(radius > this->Settings.minimumAorticRadius) ||
        !(radius < this->Settings.maximumAorticRadius))
      {
        return 0.0;
      }
      for (auto& p : rim)
      {
        p = { p[0] - circle.x, p[1] - circle.y };
      }
      section.centre += move;
      section.radius = radius;
    }
    double squares = 0.0;
    for (const auto& p : rim)
    {
      squares += std::pow(std::hypot(p[0], p[1]) - section.radius, 2);
    }
    const double deviation = std::sqrt(squares / static_cast<double>(rim.size())) / section.radius;
    mean = this->Inside(section, u, v);
    return std::clamp(
      static_cast<double>(rim.size()) / (Rays - unknown) - 0.3 * unknown / Rays - 2.0 * deviation,
      0.0, 1.0);
  }

private:
  /// Distance of the steepest descent along a ray, or 0.
  double Edge(const AorticSection& section, const Vector3& along, int& unknown) const
  {
    constexpr double step = 0.75;  // mm
    constexpr double apart = 2.25; // mm between the two means of a descent
    const double from = 0.65 * section.radius - 1.5;
    const int count = 6 + static_cast<int>(std::ceil(0.7 * section.radius / step));
    std::array<float, 96> values;
    int known = 0;
    for (; known < std::min(count, 96); ++known)
    {
      const float value = this->Volume.At(section.centre + (from + known * step) * along);
      if (value < -1050.0f)
      {
        break;
      }
      values[known] = std::clamp(value, 0.0f, 600.0f);
    }
    double steepest = RimGradient;
    double place = 0.0;
    for (int i = 2; i + 2 < known; ++i)
    {
      const double drop =
        0.5 * (values[i - 2] + values[i - 1] - values[i + 1] - values[i + 2]) / apart;
      if (drop > steepest)
      {
        steepest = drop;
        place = from + i * step;
      }
    }
    unknown += place == 0.0 && known < count ? 1 : 0;
    return place;
  }

  double Inside(const AorticSection& section, const Vector3& u, const Vector3& v) const
  {
    std::vector<double> values;
    for (const double share : { 0.0, 0.25, 0.5, 0.7 })
    {
      for (int ray = 0; ray < 12; ++ray)
      {
        const double angle = 2.0 * Pi * (ray + share) / 12.0;
        const float value = this->Volume.At(
          section.centre + share * section.radius * (std::cos(angle) * u + std::sin(angle) * v));
        if (value > -1050.0f)
        {
          values.push_back(value);
        }
      }
    }
    return MedianOf(values);
  }

  const WorldVolume& Volume;
  const CoronaryOstiaSettings& Settings;
};

/// Goes on from the last section of a chain, square to it, while circles continue it.
void Follow(const WorldVolume& volume, const CoronaryOstiaSettings& settings, double blood,
  double farthest, std::vector<AorticSection>& chain, std::vector<double>& scores)
{
  constexpr double step = 1.5;     // mm
  constexpr double reach = 12.0;   // mm of chain that gives its direction
  constexpr int longestGap = 3;    // steps
  constexpr double minimum = 0.35; // score
  const double maximumTurn = std::cos(75.0 * Pi / 180.0);
  const PlaneFit fit(volume, settings);
  const Vector3 first = chain.back().normal;
  double length = 0.0;
  int missed = 0;
  AorticSection at = chain.back();
  while (missed <= longestGap && length < farthest)
  {
    length += step;
    AorticSection next = at;
    next.centre += step * at.normal;
    AorticSection found = next;
    double mean = 0.0;
    const double score = fit.Fit(found, mean);
    const bool good = score > minimum && mean >= settings.minimumBlood &&
      std::abs(mean - blood) < 0.2 * blood && (found.centre - next.centre).norm() < 2.0 + missed &&
      std::abs(found.radius - chain.back().radius) < 1.5 * (1 + missed);
    if (!good)
    {
      ++missed;
      at.centre = next.centre;
      continue;
    }
    missed = 0;
    chain.push_back(found);
    scores.push_back(score);
    // Its direction: from a few millimetres before to here, slowly.
    std::size_t before = chain.size() - 1;
    while (before > 0 && (chain[before].centre - found.centre).norm() < reach)
    {
      --before;
    }
    const Vector3 chord = found.centre - chain[before].centre;
    if (chord.norm() > 0.5 * reach)
    {
      chain.back().normal = (0.7 * found.normal + 0.3 * chord.normalized()).normalized();
    }
    if (chain.back().normal.dot(first) < maximumTurn)
    {
      return; // the arch
    }
    at = chain.back();
  }
}
}

std::vector<AorticTube> FindAorticTubes(const WorldVolume& volume,
  const CoronaryOstiaSettings& settings, const ProgressCallback& progress)
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
  constexpr std::size_t tubesAtMost = 6;
  std::vector<AorticTube> result;
  while (result.size() < tubesAtMost)
  {
    AorticTube tube;
    if (!TakeChain(discs, volume, tube))
    {
      break;
    }
    result.push_back(std::move(tube));
  }
  return result;
}

AorticTube SliceSquare(
  const WorldVolume& volume, const AorticTube& tube, const CoronaryOstiaSettings& settings)
{
  // From the middle of the best 12 mm.
  const std::size_t window = std::min<std::size_t>(8, tube.sections.size());
  std::size_t best = 0;
  double maximum = -1.0;
  for (std::size_t n = 0; n + window <= tube.sections.size(); ++n)
  {
    double sum = 0.0;
    for (std::size_t m = n; m < n + window; ++m)
    {
      sum += tube.scores[m];
    }
    if (sum > maximum)
    {
      maximum = sum;
      best = n;
    }
  }
  const AorticSection& low = tube.sections[best];
  const AorticSection& high = tube.sections[best + window - 1];
  AorticSection middle = tube.sections[best + window / 2];
  middle.normal = (high.centre - low.centre).normalized();
  const PlaneFit fit(volume, settings);
  AorticTube result;
  result.mean = tube.mean;
  double mean = 0.0;
  const double score = fit.Fit(middle, mean);
  if (!(score > 0.0) || !(mean >= settings.minimumBlood))
  {
    return result;
  }
  constexpr double upwards = 60.0;   // mm
  constexpr double downwards = 60.0; // mm
  std::vector<AorticSection> down{ middle };
  std::vector<double> downScores{ score };
  down.front().normal = -middle.normal;
  Follow(volume, settings, mean, downwards, down, downScores);
  result.sections.assign(down.rbegin(), down.rend());
  result.scores.assign(downScores.rbegin(), downScores.rend());
  for (AorticSection& section : result.sections)
  {
    section.normal = -section.normal;
  }
  Follow(volume, settings, mean, upwards, result.sections, result.scores);
  return result;
}

TubeAxis::TubeAxis(const std::vector<AorticSection>& sections)
{
  const auto add = [this](const AorticSection& section)
  {
    this->Sections.push_back(section);
    this->Lengths.push_back(this->Lengths.empty() ? 0.0
                                                  : this->Lengths.back() +
          (section.centre - this->Sections[this->Sections.size() - 2].centre).norm());
  };
  constexpr double beyond = 80.0; // mm: farther than anything that is asked for
  // Straight on at both ends, along what the last millimetres do.
  const Vector3 low = EndDirection(sections, false);
  const Vector3 high = EndDirection(sections, true);
  add({ sections.front().centre - beyond * low, sections.front().radius, low });
  for (const AorticSection& section : sections)
  {
    add(section);
  }
  add({ sections.back().centre + beyond * high, sections.back().radius, high });
  this->Bottom = this->Lengths[1];
}

TubeAxis::Place TubeAxis::At(const Vector3& p) const
{
  Place place;
  double minimum = std::numeric_limits<double>::infinity();
  for (std::size_t n = 1; n < this->Sections.size(); ++n)
  {
    const AorticSection& a = this->Sections[n - 1];
    const AorticSection& b = this->Sections[n];
    const SegmentPlace near = NearestOnSegment(p, a.centre, b.centre);
    if (near.squaredDistance < minimum)
    {
      minimum = near.squaredDistance;
      place.centre = near.position;
      place.radius = a.radius + near.fraction * (b.radius - a.radius);
      place.direction = (b.centre - a.centre).normalized();
      place.length = this->Lengths[n - 1] +
        near.fraction * (this->Lengths[n] - this->Lengths[n - 1]) - this->Bottom;
    }
  }
  place.distance = std::sqrt(minimum);
  return place;
}

Vector3 TubeAxis::Direction() const
{
  constexpr double span = 40.0;     // mm
  constexpr double shortest = 10.0; // mm
  std::size_t widest = 1;
  for (std::size_t n = 1; n + 1 < this->Sections.size(); ++n)
  {
    widest = this->Sections[n].radius > this->Sections[widest].radius ? n : widest;
  }
  const std::size_t last = this->Sections.size() - 2;
  std::size_t low = widest;
  while (low > 1 && this->Lengths[last] - this->Lengths[low] < shortest)
  {
    --low;
  }
  std::size_t high = low;
  while (high < last && this->Lengths[high] - this->Lengths[low] < span)
  {
    ++high;
  }
  const Vector3 way = this->Sections[high].centre - this->Sections[low].centre;
  return way.norm() > 0.0 ? Vector3(way.normalized()) : Vector3(Vector3::UnitZ());
}

Vector3 TubeAxis::EndDirection(const std::vector<AorticSection>& sections, bool upper)
{
  constexpr double span = 15.0; // mm
  const std::size_t count = sections.size();
  const AorticSection& end = upper ? sections.back() : sections.front();
  const AorticSection* other = &end;
  for (std::size_t n = 0; n < count; ++n)
  {
    const AorticSection& section = sections[upper ? count - 1 - n : n];
    other = &section;
    if ((section.centre - end.centre).norm() >= span)
    {
      break;
    }
  }
  const Vector3 way =
    upper ? Vector3(end.centre - other->centre) : Vector3(other->centre - end.centre);
  return way.norm() > 3.0 ? Vector3(way.normalized()) : end.normal;
}
}
