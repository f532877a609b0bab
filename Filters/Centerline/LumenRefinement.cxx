#include "LumenRefinement.h"

#include "BlurredDisc.h"
#include "CrossFrame.h"
#include "CurveSmoothing.h"
#include "GridIndex.h"
#include "LumenMeasurement.h"
#include "Median.h"
#include "PartialProgress.h"
#include "Require.h"
#include "TreeLinks.h"
#include "VoxelLattice.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <unordered_set>

namespace coronary
{
namespace
{
constexpr int Rays = 24;
constexpr double MinimumRadius = 0.05;        ///< mm
constexpr double MaximumGrowth = 1.4;         ///< of a radius by its measurement anew
constexpr double MinimumChange = 0.05;        ///< mm, of a radius: less counts little
constexpr double MinimumBridgedRadius = 0.25; ///< mm
constexpr double RingStart = 1.8;             ///< blurs outside of the wall the surroundings begin
constexpr double RingEnd = 3.0;
constexpr double CalciumHalo = 2.0; ///< blurs around an object that its blooming changes
/// Of the contrast's brightness at a place, relative.
constexpr double LevelUncertainty = 0.06;
/// mm along a vessel that smoothing halves in the refined radii.
constexpr double Wavelength = 3.0;
constexpr double MouthReach = 2.0; ///< mm behind a mouth
/// Degrees of the wall behind calcium beyond which nothing is measured.
constexpr double MaximumArc = 180.0;
constexpr double MinimumRays = 0.4; ///< share of rays that have to count
/// Plaque around a lumen, of the contrast between fat and lumen: 0 to 110 HU in most, mean and standard deviation.
constexpr double WallLevel = 0.35;
constexpr double WallLevelDeviation = 0.1;
/// From here on a lumen alone does not explain a section: misfit of the noise, and of the contrast (discs in voxels are no discs).
constexpr double WallMisfit[] = { 0.85, 0.02 };
constexpr double WallBetter = 0.75; ///< of its misfit that one with a wall has at most
constexpr double MinimumWall =
  0.25; ///< mm that the wall is thick in the mean: less the blur does not show
constexpr double WallWindow =
  15.0; ///< mm along the vessel in which its outer wall is as wide as the widest lumen, or less
constexpr double WallGrowth = 1.4; ///< and more by remodelling

/// Values of a section in polar coordinates around a place.
struct PolarSection
{
  double step = 0.0; ///< mm between samples of a ray
  int count = 0;     ///< samples a ray; the first lies half a step from the centre
  std::vector<float> values;
  std::vector<char> hidden; ///< by calcium

  double Distance(int sample) const { return (sample + 0.5) * this->step; }
  /// Cosine and sine.
  static std::array<double, 2> Direction(int ray)
  {
    const double angle = 2.0 * M_PI * ray / Rays;
    return { std::cos(angle), std::sin(angle) };
  }
  std::size_t At(int ray, int sample) const
  {
    return static_cast<std::size_t>(ray) * this->count + sample;
  }
};

struct Fit
{
  bool found = false;
  double x = 0.0; ///< mm from the section's centre
  double y = 0.0;
  double radius = 0.0;    ///< mm
  double deviation = 0.0; ///< mm
  double level = 0.0;
  double misfit = 1e30;   ///< root mean square, image values
  double hiddenArc = 0.0; ///< degrees of the wall behind calcium
};

/// A disc of plaque with the lumen in it.
struct WalledFit
{
  Fit lumen;
  Fit wall; ///< its outer border and its level
};

struct Prior
{
  double radius = 1.0; ///< mm, where the search begins
  double level = 0.0;
  double levelDeviation = 0.0;
  double shift = 0.3; ///< mm, standard deviation of the centre
  double noise = 10.0;
};

/// A blurred disc's share at a distance from its centre, mm, with derivatives by the distance and the radius, 1/mm.
class DiscShares
{
public:
  struct Share
  {
    double value;
    double byDistance;
    double byRadius;
  };

  DiscShares(double radius, double blur)
    : Blur(blur)
    , Radius(radius / blur)
    , Disc(this->Radius)
    , Wider(this->Radius + E)
    , Thinner(std::max(0.0, this->Radius - E))
  {
  }
  Share At(double distance) const
  {
    const double d = distance / this->Blur;
    const double near = std::max(0.0, d - E);
    return { this->Disc.At(d),
      (this->Disc.At(d + E) - this->Disc.At(near)) / (d + E - near) / this->Blur,
      (this->Wider.At(d) - this->Thinner.At(d)) /
        (this->Radius + E - std::max(0.0, this->Radius - E)) / this->Blur };
  }

private:
  static constexpr double E = 0.02; ///< blurs, half of the differences' step

  double Blur;
  double Radius; ///< blurs
  BlurredProfile Disc;
  BlurredProfile Wider;
  BlurredProfile Thinner;
};

/// Normal equations of weighted residuals.
template <int Count>
struct FitEquations
{
  using Matrix = Eigen::Matrix<double, Count, Count>;
  using Vector = Eigen::Matrix<double, Count, 1>;

  Matrix normal = Matrix::Zero();
  Vector right = Vector::Zero();
  double squares = 0.0;
  double area = 0.0;

  /// @param share  independent values that this one stands for
  void Add(const Vector& row, double residual, double share, double noise)
  {
    // What fits badly is something else.
    const double far = residual / (4.0 * noise);
    const double weight = share / (1.0 + far * far);
    this->normal += weight * row * row.transpose();
    this->right += weight * residual * row;
    this->squares += weight * residual * residual;
    this->area += weight;
  }
  double Misfit() const { return std::sqrt(this->squares / this->area); }
};

class SectionFitter
{
public:
  SectionFitter(const ScalarImage& image, double blur, double background,
    const std::unordered_set<std::int64_t>& hidden)
    : Image(image)
    , Grid(image.grid)
    , Size(image.Dimensions())
    , Blur(blur)
    , Background(background)
    , Hidden(hidden)
  {
  }

  Fit Measure(const Vector3& position, const Vector3& tangent, const Prior& prior, double reach,
    bool calcium) const
  {
    const PolarSection section = this->Sample(position, tangent, reach, calcium);
    Fit fit;
    fit.radius = prior.radius;
    fit.level = prior.level;
    for (int round = 0; round < 5; ++round)
    {
      std::array<double, Rays> around;
      std::array<char, Rays> counts;
      if (!this->MeasureAround(section, fit, around, counts) ||
        !this->Solve(section, prior, around, counts, fit))
      {
        fit.found = false;
        break;
      }
    }
    fit.hiddenArc = this->HiddenArc(section, fit);
    return fit;
  }

  /**
   * The lumen in a plaque: a blurred disc within another one, whose level lies between.
   * @param alone  what a lumen alone would be
   * @param widest  mm, of the outer wall
   * @return the lumen, found if that explains the section much better than a lumen alone
   */
  Fit MeasureWalled(const Vector3& position, const Vector3& tangent, const Prior& prior,
    const Fit& alone, double widest) const
  {
    const PolarSection section =
      this->Sample(position, tangent, widest + (RingEnd + 0.5) * this->Blur, false);
    WalledFit fit;
    if (!this->BeginWall(section, prior, widest, fit))
    {
      return {};
    }
    WalledFit one;
    one.lumen = one.wall = alone;
    std::array<double, Rays> around;
    std::array<char, Rays> counts;
    std::array<double, Rays> aroundOne;
    std::array<char, Rays> countsOne;
    if (!this->MeasureAround(section, alone, aroundOne, countsOne))
    {
      return {};
    }
    constexpr int rounds = 4;
    for (int round = 0; round < rounds; ++round)
    {
      if (!this->MeasureAround(section, fit.wall, around, counts) ||
        !this->SolveWalled(section, prior, widest, around, counts, fit))
      {
        return {};
      }
      // What is not on the way to a better fit is given up.
      const double better = round + 1 < rounds ? 1.0 : WallBetter;
      fit.lumen.misfit = this->MisfitOf(section, fit, around, counts, fit);
      if (fit.lumen.misfit > better * this->MisfitOf(section, one, aroundOne, counts, fit))
      {
        return {};
      }
    }
    fit.lumen.found = fit.wall.radius - fit.lumen.radius > MinimumWall;
    return fit.lumen;
  }

private:
  PolarSection Sample(
    const Vector3& position, const Vector3& tangent, double reach, bool calcium) const
  {
    PolarSection section;
    const CrossFrame frame(tangent);
    section.step = 0.4 * this->Image.MinimumSpacing();
    section.count = std::max(4, static_cast<int>(std::ceil(reach / section.step)));
    section.values.resize(static_cast<std::size_t>(Rays) * section.count);
    section.hidden.assign(section.values.size(), 0);
    for (int ray = 0; ray < Rays; ++ray)
    {
      const Vector3 direction = frame.Ray(ray, Rays);
      for (int s = 0; s < section.count; ++s)
      {
        const Vector3 place = position + section.Distance(s) * direction;
        section.values[section.At(ray, s)] = static_cast<float>(this->Image.At(place));
        section.hidden[section.At(ray, s)] = calcium && this->IsHidden(place) ? 1 : 0;
      }
    }
    return section;
  }

  bool IsHidden(const Vector3& place) const
  {
    const Vector3 index = this->Image.ToIndex(place);
    std::int64_t offset = 0;
    for (int axis = 2; axis >= 0; --axis)
    {
      const std::int64_t n = std::llround(index[axis]) - this->Grid.extent[2 * axis];
      if (n < 0 || n >= this->Size[axis])
      {
        return false;
      }
      offset = offset * this->Size[axis] + n;
    }
    return this->Hidden.count(offset) > 0;
  }

  /// From the fitted centre along a ray of the section to the same angle: the distance from the centre.
  static double DistanceFrom(const Fit& fit, double x, double y)
  {
    return std::hypot(x - fit.x, y - fit.y);
  }

  /// What lies behind the wall, without what the lumen's blur adds there, for each ray.
  bool MeasureAround(const PolarSection& section, const Fit& fit, std::array<double, Rays>& around,
    std::array<char, Rays>& counts) const
  {
    const double contrast = std::max(1.0, fit.level - this->Background);
    // Air behind fat is no part of the wall.
    const double floor = this->Background - 0.1 * contrast;
    const BlurredProfile lumen(fit.radius / this->Blur);
    std::array<double, Rays> own;
    std::vector<double> known;
    for (int ray = 0; ray < Rays; ++ray)
    {
      const auto [c, s] = PolarSection::Direction(ray);
      double sum = 0.0;
      double weight = 0.0;
      int all = 0;
      for (int n = 0; n < section.count; ++n)
      {
        const double rho = section.Distance(n);
        const double d = DistanceFrom(fit, rho * c, rho * s) - fit.radius;
        if (d < RingStart * this->Blur || d > RingEnd * this->Blur)
        {
          continue;
        }
        ++all;
        if (section.hidden[section.At(ray, n)] != 0)
        {
          continue;
        }
        const double share = lumen.At((d + fit.radius) / this->Blur);
        const double value =
          (section.values[section.At(ray, n)] - share * fit.level) / (1.0 - share);
        sum += std::max(floor, value);
        weight += 1.0;
      }
      counts[ray] = weight > 0.5 * all && all > 0 ? 1 : 0;
      own[ray] = counts[ray] != 0 ? sum / weight : 0.0;
      if (counts[ray] != 0)
      {
        known.push_back(own[ray]);
      }
    }
    if (static_cast<double>(known.size()) < MinimumRays * Rays)
    {
      return false;
    }
    const double usual = MedianOf(std::move(known));
    // A branch or a neighbour: no wall to be seen there.
    for (int ray = 0; ray < Rays; ++ray)
    {
      if (counts[ray] != 0 && own[ray] > usual + 0.4 * (fit.level - usual))
      {
        counts[ray] = 0;
      }
    }
    int left = 0;
    for (int ray = 0; ray < Rays; ++ray)
    {
      double sum = 0.0;
      int neighbours = 0;
      for (const int side : { -1, 0, 1 })
      {
        const int other = (ray + side + Rays) % Rays;
        if (counts[other] != 0)
        {
          sum += own[other];
          ++neighbours;
        }
      }
      around[ray] = neighbours > 0 ? sum / neighbours : usual;
      left += counts[ray];
    }
    return left >= MinimumRays * Rays;
  }

  /// mm^2 of one independent value: noise is the same over about a voxel.
  double Patch() const
  {
    const double correlated = std::max(0.9 * this->Image.MinimumSpacing(), this->Blur);
    return 4.0 * M_PI * correlated * correlated;
  }

  /// Gauss-Newton for centre, radius and level, with surroundings that are given.
  bool Solve(const PolarSection& section, const Prior& prior,
    const std::array<double, Rays>& around, const std::array<char, Rays>& counts, Fit& fit) const
  {
    using Matrix4 = FitEquations<4>::Matrix;
    using Vector4 = FitEquations<4>::Vector;
    const double patch = this->Patch();
    const double most = section.count * section.step - RingStart * this->Blur;
    double noise = std::max(prior.noise, 1e-6);
    for (int iteration = 0; iteration < 4; ++iteration)
    {
      FitEquations<4> equations;
      const DiscShares lumen(fit.radius, this->Blur);
      for (int ray = 0; ray < Rays; ++ray)
      {
        if (counts[ray] == 0)
        {
          continue;
        }
        const auto [c, s] = PolarSection::Direction(ray);
        for (int n = 0; n < section.count; ++n)
        {
          const double rho = section.Distance(n);
          const double dx = rho * c - fit.x;
          const double dy = rho * s - fit.y;
          const double distance = std::hypot(dx, dy);
          if (distance > fit.radius + RingStart * this->Blur)
          {
            if (rho > fit.radius + std::hypot(fit.x, fit.y) + RingStart * this->Blur)
            {
              break;
            }
            continue;
          }
          const std::size_t at = section.At(ray, n);
          if (section.hidden[at] != 0)
          {
            continue;
          }
          const double contrast = fit.level - around[ray];
          const DiscShares::Share share = lumen.At(distance);
          const double residual = section.values[at] - (around[ray] + share.value * contrast);
          const double inverse = distance > 1e-9 ? 1.0 / distance : 0.0;
          const Vector4 row(-contrast * share.byDistance * dx * inverse,
            -contrast * share.byDistance * dy * inverse, contrast * share.byRadius, share.value);
          equations.Add(row, residual, rho * section.step * (2.0 * M_PI / Rays) / patch, noise);
        }
      }
      if (!(equations.area > 0.0))
      {
        return false;
      }
      fit.misfit = equations.Misfit();
      noise = std::max(prior.noise, fit.misfit);
      const double precision = 1.0 / (noise * noise);
      Matrix4 information = precision * equations.normal;
      Vector4 gradient = precision * equations.right;
      const double held = 1.0 / (prior.shift * prior.shift);
      information(0, 0) += held;
      information(1, 1) += held;
      gradient[0] -= held * fit.x;
      gradient[1] -= held * fit.y;
      const double known = 1.0 / (prior.levelDeviation * prior.levelDeviation);
      information(3, 3) += known;
      gradient[3] += known * (prior.level - fit.level);
      // A radius of which nothing is seen is not determined.
      information(2, 2) += 1e-2;
      const Matrix4 covariance = information.inverse();
      Vector4 change = covariance * gradient;
      const double step = 0.5 * std::max(fit.radius, this->Blur);
      for (int n = 0; n < 3; ++n)
      {
        change[n] = std::clamp(change[n], -step, step);
      }
      fit.x += change[0];
      fit.y += change[1];
      fit.radius = std::clamp(fit.radius + change[2], MinimumRadius, std::max(MinimumRadius, most));
      fit.level += change[3];
      fit.deviation = std::sqrt(std::max(0.0, covariance(2, 2)));
      fit.found = std::isfinite(fit.radius) && std::isfinite(fit.x) && std::isfinite(fit.y);
      if (!fit.found)
      {
        return false;
      }
    }
    return true;
  }

  /// A first wall, where rays fall half way from plaque to what is around, and a first lumen, where it is brightest.
  bool BeginWall(
    const PolarSection& section, const Prior& prior, double widest, WalledFit& fit) const
  {
    const double contrast = prior.level - this->Background;
    fit.lumen.level = prior.level;
    fit.wall.level = this->Background + WallLevel * contrast;
    const double border = this->Background + 0.5 * WallLevel * contrast;
    std::vector<double> distances;
    double most = -1e30;
    for (int ray = 0; ray < Rays; ++ray)
    {
      const auto [c, s] = PolarSection::Direction(ray);
      int n = 0;
      for (; n < section.count && section.values[section.At(ray, n)] > border; ++n)
      {
        // The mean of three: noise is brighter than a thin lumen.
        const double value = section.values[section.At(ray, n)] +
          section.values[section.At((ray + 1) % Rays, n)] +
          section.values[section.At((ray + Rays - 1) % Rays, n)];
        if (section.Distance(n) < 0.7 * widest && value > most)
        {
          most = value;
          fit.lumen.x = section.Distance(n) * c;
          fit.lumen.y = section.Distance(n) * s;
        }
      }
      if (n < section.count && n > 0)
      {
        const double distance = section.Distance(n);
        distances.push_back(distance);
        fit.wall.x += 2.0 * distance * c;
        fit.wall.y += 2.0 * distance * s;
      }
    }
    if (static_cast<double>(distances.size()) < MinimumRays * Rays)
    {
      return false;
    }
    fit.wall.x /= static_cast<double>(distances.size());
    fit.wall.y /= static_cast<double>(distances.size());
    fit.wall.radius = std::min(widest, MedianOf(std::move(distances)));
    fit.lumen.radius = std::min(this->Blur, 0.6 * fit.wall.radius);
    return std::hypot(fit.wall.x, fit.wall.y) < fit.wall.radius;
  }

  /// Calls for each sample that counts: at(ray, sample, distance from the section's centre, weight of its area).
  template <typename At>
  void ForWalled(const PolarSection& section, const WalledFit& within,
    const std::array<char, Rays>& counts, const At& at) const
  {
    const double reach = within.wall.radius + RingStart * this->Blur;
    for (int ray = 0; ray < Rays; ++ray)
    {
      const auto [c, s] = PolarSection::Direction(ray);
      for (int n = 0; counts[ray] != 0 && n < section.count; ++n)
      {
        const double rho = section.Distance(n);
        if (DistanceFrom(within.wall, rho * c, rho * s) <= reach)
        {
          at(ray, n, rho, rho * section.step * (2.0 * M_PI / Rays));
        }
      }
    }
  }

  /// Root mean square of what a fit leaves over, on the samples that are within another one.
  double MisfitOf(const PolarSection& section, const WalledFit& fit,
    const std::array<double, Rays>& around, const std::array<char, Rays>& counts,
    const WalledFit& within) const
  {
    const BlurredProfile lumen(fit.lumen.radius / this->Blur);
    const BlurredProfile wall(fit.wall.radius / this->Blur);
    double squares = 0.0;
    double area = 0.0;
    this->ForWalled(section, within, counts,
      [&](int ray, int n, double rho, double weight)
      {
        const auto [c, s] = PolarSection::Direction(ray);
        const double inner = lumen.At(DistanceFrom(fit.lumen, rho * c, rho * s) / this->Blur);
        const double outer = wall.At(DistanceFrom(fit.wall, rho * c, rho * s) / this->Blur);
        const double residual = section.values[section.At(ray, n)] -
          (around[ray] + outer * (fit.wall.level - around[ray]) +
            inner * (fit.lumen.level - fit.wall.level));
        squares += weight * residual * residual;
        area += weight;
      });
    return area > 0.0 ? std::sqrt(squares / area) : 1e30;
  }

  /// Gauss-Newton for both discs: centre, radius and level of the lumen, then of the wall.
  bool SolveWalled(const PolarSection& section, const Prior& prior, double widest,
    const std::array<double, Rays>& around, const std::array<char, Rays>& counts,
    WalledFit& fit) const
  {
    using Matrix8 = FitEquations<8>::Matrix;
    using Vector8 = FitEquations<8>::Vector;
    const double contrast = std::max(1.0, prior.level - this->Background);
    const double patch = this->Patch();
    double noise = std::max(prior.noise, 1e-6);
    for (int iteration = 0; iteration < 4; ++iteration)
    {
      FitEquations<8> equations;
      const DiscShares lumen(fit.lumen.radius, this->Blur);
      const DiscShares wall(fit.wall.radius, this->Blur);
      this->ForWalled(section, fit, counts,
        [&](int ray, int n, double rho, double size)
        {
          const auto [c, s] = PolarSection::Direction(ray);
          Vector8 row;
          double value = around[ray];
          const auto add = [&](const Fit& disc, const DiscShares& shares, double under, int first)
          {
            const double dx = rho * c - disc.x;
            const double dy = rho * s - disc.y;
            const double distance = std::hypot(dx, dy);
            const DiscShares::Share at = shares.At(distance);
            const double inverse = distance > 1e-9 ? 1.0 / distance : 0.0;
            row.segment<4>(first) << -(disc.level - under) * at.byDistance * dx * inverse,
              -(disc.level - under) * at.byDistance * dy * inverse,
              (disc.level - under) * at.byRadius, at.value;
            value += at.value * (disc.level - under);
          };
          add(fit.wall, wall, around[ray], 4);
          add(fit.lumen, lumen, fit.wall.level, 0);
          row[7] -= row[3];
          const double residual = section.values[section.At(ray, n)] - value;
          equations.Add(row, residual, size / patch, noise);
        });
      if (!(equations.area > 0.0))
      {
        return false;
      }
      noise = std::max(prior.noise, equations.Misfit());
      Matrix8 information = equations.normal / (noise * noise);
      Vector8 gradient = equations.right / (noise * noise);
      const auto hold = [&](int n, double off, double deviation)
      {
        information(n, n) += 1.0 / (deviation * deviation);
        gradient[n] += off / (deviation * deviation);
      };
      // The line runs somewhere in the wall; the lumen is anywhere in it.
      hold(0, fit.wall.x - fit.lumen.x, 0.5 * fit.wall.radius);
      hold(1, fit.wall.y - fit.lumen.y, 0.5 * fit.wall.radius);
      hold(2, 0.0, 10.0);
      hold(3, prior.level - fit.lumen.level, prior.levelDeviation);
      hold(4, -fit.wall.x, 0.5 * widest);
      hold(5, -fit.wall.y, 0.5 * widest);
      hold(6, 0.0, 10.0);
      hold(
        7, this->Background + WallLevel * contrast - fit.wall.level, WallLevelDeviation * contrast);
      const Matrix8 covariance = information.inverse();
      const Vector8 change = covariance * gradient;
      const auto move = [&](Fit& disc, int first, double most)
      {
        const double step = 0.5 * std::max(disc.radius, this->Blur);
        disc.x += std::clamp(change[first], -step, step);
        disc.y += std::clamp(change[first + 1], -step, step);
        disc.radius = std::clamp(disc.radius + std::clamp(change[first + 2], -step, step),
          MinimumRadius, std::max(MinimumRadius, most));
        disc.level += change[first + 3];
      };
      move(fit.wall, 4, widest);
      move(fit.lumen, 0, fit.wall.radius);
      // A lumen of which little is seen is known by its area: what it may be grows with the root of that.
      const double byArea = 2.0 * fit.lumen.radius * std::sqrt(std::max(0.0, covariance(2, 2)));
      fit.lumen.deviation =
        std::sqrt(fit.lumen.radius * fit.lumen.radius + byArea) - fit.lumen.radius;
      fit.lumen.found = std::isfinite(fit.lumen.radius + fit.lumen.x + fit.lumen.y) &&
        std::isfinite(fit.wall.radius + fit.wall.x + fit.wall.y);
      if (!fit.lumen.found)
      {
        return false;
      }
    }
    return true;
  }

  double HiddenArc(const PolarSection& section, const Fit& fit) const
  {
    int rays = 0;
    for (int ray = 0; ray < Rays; ++ray)
    {
      const auto [c, s] = PolarSection::Direction(ray);
      for (int n = 0; n < section.count; ++n)
      {
        const double rho = section.Distance(n);
        const double d = DistanceFrom(fit, rho * c, rho * s) - fit.radius;
        if (std::abs(d) < this->Blur && section.hidden[section.At(ray, n)] != 0)
        {
          ++rays;
          break;
        }
      }
    }
    return 360.0 * rays / Rays;
  }

  ImageInterpolator Image;
  ImageGrid Grid;
  std::array<int, 3> Size;
  double Blur;
  double Background;
  const std::unordered_set<std::int64_t>& Hidden;
};

/// The objects' voxels with those that their blooming reaches.
std::unordered_set<std::int64_t> HiddenVoxels(
  const CalciumMap& calcium, const ScalarImage& image, double blur)
{
  const VoxelLattice lattice(image.grid);
  const double reach = CalciumHalo * blur;
  const std::array<int, 3>& n = lattice.Size;
  const std::array<int, 6> extent{ 0, n[0] - 1, 0, n[1] - 1, 0, n[2] - 1 };
  std::unordered_set<std::int64_t> hidden;
  for (const CalciumVoxel& voxel : calcium.voxels)
  {
    const std::array<int, 3> at = lattice.Place(voxel.offset);
    const Vector3 centre(at[0], at[1], at[2]);
    BoxAround(centre, Vector3::Constant(reach).cwiseQuotient(lattice.Spacing), extent)
      .ForEach(
        [&](int i, int j, int k)
        {
          if (lattice.Spacing.cwiseProduct(Vector3(i, j, k) - centre).norm() <= reach)
          {
            hidden.insert(lattice.Index(i, j, k));
          }
        });
  }
  return hidden;
}

/// Whether a section lies in the lumen of the vessel that this one leaves.
bool InParent(
  const VesselTree& tree, const VesselPath& parent, const Vector3& position, double margin)
{
  for (const std::int64_t p : parent.points)
  {
    const double reach = tree.radius[p] + margin;
    if ((tree.points[p] - position).squaredNorm() < reach * reach)
    {
      return true;
    }
  }
  return false;
}

/// What a path was measured to be, before anything is smoothed.
struct PathWork
{
  /// mm that an outer wall may be wide at a place: as the lumen was before and behind a plaque, and remodelled.
  double WidestNear(std::size_t place) const
  {
    double widest = 0.0;
    for (std::size_t i = 0; i < this->expected.size(); ++i)
    {
      if (std::abs(this->path->arc[i] - this->path->arc[place]) < WallWindow)
      {
        widest = std::max(widest, this->expected[i]);
      }
    }
    return WallGrowth * widest;
  }

  const VesselPath* path = nullptr;
  std::vector<double> expected; ///< mm
  std::vector<Vector3> tangents;
  std::size_t mouth = 0;     ///< sections at the beginning that lie in the parent's lumen
  std::vector<char> skipped; ///< in the mouth, or at an ostium
  std::vector<char> besideCalcium;
  std::vector<Fit> fits;
};
/// The parts of a refinement that all sections share.
struct Refiner
{
  const VesselTree& tree;
  const LumenLevels& levels;
  double blur;
  SectionFitter fitter;

  void Prepare(PathWork& work, const std::vector<VesselPath>& paths, RefinedLumen& result) const;
  std::vector<double> ExpectedRadii(const PathWork& work) const;
  Fit MeasureAt(const PathWork& work, std::size_t place) const;
  void Finish(const PathWork& work, RefinedLumen& result) const;
  bool IsMeasured(const Fit& fit) const
  {
    return fit.found && fit.hiddenArc <= MaximumArc &&
      fit.deviation < std::max(fit.radius, this->blur);
  }
};

void Refiner::Prepare(
  PathWork& work, const std::vector<VesselPath>& paths, RefinedLumen& result) const
{
  const VesselPath& path = *work.path;
  const std::size_t count = path.points.size();
  work.tangents = PathTangents(this->tree, path, 1.25);
  work.skipped.assign(count, 0);
  work.besideCalcium.assign(count, 0);
  work.fits.assign(count, {});
  bool inMouth = path.parent >= 0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::int64_t p = path.points[i];
    inMouth = inMouth &&
      InParent(this->tree, paths[path.parent], this->tree.points[p], 0.5 * this->tree.radius[p]);
    // At an ostium a part of the section is the aorta's.
    const bool atOstium = path.parent < 0 && path.arc[i] < 0.5 * this->tree.radius[p];
    work.mouth += inMouth ? 1 : 0;
    work.skipped[i] = inMouth || atOstium ? 1 : 0;
    work.besideCalcium[i] = result.calcium[p] != 0 ? 1 : 0;
  }
}

/// Where calcium may have been taken for lumen the radius follows from the vessel before and behind it. Beside a mouth the
/// tree's may be a slope that was carried on: a section there may be as wide as the vessel is a little farther on.
std::vector<double> Refiner::ExpectedRadii(const PathWork& work) const
{
  const VesselPath& path = *work.path;
  const std::size_t count = path.points.size();
  std::vector<double> radii(count);
  std::vector<double> weights(count, 1.0);
  bool any = false;
  for (std::size_t i = 0; i < count; ++i)
  {
    radii[i] = this->tree.radius[path.points[i]];
    weights[i] = work.besideCalcium[i] != 0 ? 1e-3 : 1.0;
    any = any || work.besideCalcium[i] != 0;
  }
  if (work.mouth > 0 && work.mouth < count)
  {
    const double begin = path.arc[work.mouth];
    const auto end = static_cast<std::size_t>(
      std::lower_bound(path.arc.begin(), path.arc.end(), begin + MouthReach) - path.arc.begin());
    const double behind = radii[std::min(end, count - 1)];
    for (std::size_t i = 0; i < std::min(end, count); ++i)
    {
      radii[i] = std::max(radii[i], behind);
    }
  }
  if (!any)
  {
    return radii;
  }
  std::vector<double> smooth = SmoothSequence(radii, weights, 10.0 / path.Step());
  for (std::size_t i = 0; i < count; ++i)
  {
    radii[i] = work.besideCalcium[i] != 0
      ? std::clamp(smooth[i], 0.5 * radii[i], std::max(radii[i], 0.5 * radii[i]))
      : radii[i];
  }
  return radii;
}

Fit Refiner::MeasureAt(const PathWork& work, std::size_t place) const
{
  const double expected = work.expected[place];
  const std::int64_t p = work.path->points[place];
  const Vector3& tangent = work.tangents[place];
  const double contrast = std::max(1.0, this->levels.level[p] - this->levels.background);
  const bool beside = work.besideCalcium[place] != 0;
  Prior prior;
  prior.radius = expected;
  prior.level = this->levels.level[p];
  prior.levelDeviation = LevelUncertainty * contrast;
  prior.shift = std::max(0.25, 0.25 * expected);
  prior.noise = std::max(this->levels.noise, 0.01 * contrast);
  const double reach = 1.25 * expected + (RingEnd + 1.0) * this->blur + 0.5;
  const Vector3& position = this->tree.points[p];
  Fit best = this->fitter.Measure(position, tangent, prior, reach, beside);
  if (!beside)
  {
    // A line that was led across a lesion may be much wider than what it runs through.
    for (const double start : { 0.5 * expected, this->blur })
    {
      if (this->IsMeasured(best) && best.misfit < 2.5 * prior.noise)
      {
        break;
      }
      prior.radius = std::min(start, expected);
      const Fit fit = this->fitter.Measure(position, tangent, prior, reach, false);
      if (this->IsMeasured(fit) && (!this->IsMeasured(best) || fit.misfit < 0.8 * best.misfit))
      {
        best = fit;
      }
    }
    if (best.found && best.misfit > std::max(WallMisfit[0] * prior.noise, WallMisfit[1] * contrast))
    {
      const Fit walled =
        this->fitter.MeasureWalled(position, tangent, prior, best, work.WidestNear(place));
      if (walled.found && this->IsMeasured(walled))
      {
        return walled;
      }
    }
    return best;
  }
  // The line may have been drawn onto the calcium: the lumen is looked for beside it.
  const CrossFrame frame(tangent);
  const auto cost = [&](const Fit& fit)
  {
    return !this->IsMeasured(fit)
      ? 1e30
      : std::pow(fit.misfit / prior.noise, 2) + std::pow(std::log(fit.radius / expected) / 0.3, 2) +
        std::pow((fit.level - prior.level) / prior.levelDeviation, 2) +
        std::pow(std::hypot(fit.x, fit.y) / std::max(0.8, expected), 2);
  };
  double minimum = cost(best);
  for (const double away : { 0.5, 1.0 })
  {
    for (int side = 0; side < 8; ++side)
    {
      const double distance = away * std::max(0.8, expected);
      const double x = distance * std::cos(0.25 * M_PI * side);
      const double y = distance * std::sin(0.25 * M_PI * side);
      Fit fit = this->fitter.Measure(position + frame.Place(x, y), tangent, prior, reach, true);
      fit.x += x;
      fit.y += y;
      // Another lumen than this one is none of its.
      if (cost(fit) < 0.8 * minimum && std::hypot(fit.x, fit.y) < expected + fit.radius)
      {
        minimum = cost(fit);
        best = fit;
      }
    }
  }
  return best;
}

/// Where nothing is known the radius goes evenly from what is seen before to what is seen behind: a smooth curve would
/// carry a slope on to a narrowing or a widening that nobody saw.
void BridgeUnknown(
  const VesselPath& path, const std::vector<char>& unknown, std::vector<double>& radii)
{
  const std::size_t count = radii.size();
  for (std::size_t first = 0; first < count; ++first)
  {
    if (unknown[first] == 0)
    {
      continue;
    }
    std::size_t after = first;
    while (after < count && unknown[after] != 0)
    {
      ++after;
    }
    if (first == 0 && after == count)
    {
      return;
    }
    const double from = first > 0 ? radii[first - 1] : radii[after];
    const double to = after < count ? radii[after] : from;
    const double begin = path.arc[first > 0 ? first - 1 : 0];
    const double end = path.arc[std::min(after, count - 1)];
    for (std::size_t i = first; i < after; ++i)
    {
      radii[i] = from + (to - from) * (path.arc[i] - begin) / std::max(1e-9, end - begin);
    }
    first = after;
  }
}

/// Radii and positions of a path from its sections.
void Refiner::Finish(const PathWork& work, RefinedLumen& result) const
{
  const VesselPath& path = *work.path;
  const std::size_t count = path.points.size();
  const double step = path.Step();
  std::vector<double> radii(count);
  std::vector<double> weights(count);
  std::array<std::vector<double>, 3> shifts;
  std::vector<double> shiftWeights(count, 0.0);
  std::vector<char> unknown(count, 0);
  for (std::vector<double>& shift : shifts)
  {
    shift.assign(count, 0.0);
  }
  bool moved = false;
  double total = 0.0;
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::int64_t p = path.points[i];
    const Fit& fit = work.fits[i];
    const bool own = i > 0 || path.parent < 0;
    radii[i] = this->tree.radius[p];
    if (i < work.mouth)
    {
      weights[i] = 1e-6;
      shiftWeights[i] = 1e3;
      unknown[i] = 1;
    }
    else if (work.skipped[i] != 0)
    {
      weights[i] = 1.0 / (0.04 + 0.01 * radii[i] * radii[i]);
      shiftWeights[i] = 1e3;
    }
    // Much wider than rays found it: a neighbour without a wall between, no lumen of its own.
    else if (this->IsMeasured(fit) &&
      fit.radius <= MaximumGrowth * std::max(radii[i], work.expected[i]) + 0.2)
    {
      radii[i] = fit.radius;
      weights[i] = 1.0 / (fit.deviation * fit.deviation + 0.0025);
      shiftWeights[i] = 1.0;
      if (work.besideCalcium[i] != 0)
      {
        const Vector3 shift = CrossFrame(work.tangents[i]).Place(fit.x, fit.y);
        for (int axis = 0; axis < 3; ++axis)
        {
          shifts[axis][i] = shift[axis];
        }
        moved = true;
      }
      if (own)
      {
        result.measured[p] = fit.radius;
        result.deviation[p] = fit.deviation;
      }
    }
    else if (work.besideCalcium[i] != 0)
    {
      weights[i] = 1e-6;
      shiftWeights[i] = 1e-3;
      unknown[i] = 1;
      if (own)
      {
        result.interpolated[p] = 1;
      }
    }
    else
    {
      // Not round, or not alone: as it was found.
      weights[i] = 1.0 / (0.04 + 0.01 * radii[i] * radii[i]);
      shiftWeights[i] = 1e3;
    }
    if (own)
    {
      result.calciumArc[p] = work.besideCalcium[i] != 0 ? fit.hiddenArc : 0.0;
    }
    total += weights[i];
  }
  if (total < 1e-3)
  {
    return; // Nothing was seen.
  }
  std::vector<double> smooth = SmoothSequence(radii, weights, Wavelength / step);
  std::vector<double> robust = weights;
  for (std::size_t i = 0; i < count; ++i)
  {
    const double far = (radii[i] - smooth[i]) / (0.1 * std::max(smooth[i], this->blur));
    robust[i] /= 1.0 + far * far;
  }
  smooth = SmoothSequence(radii, robust, Wavelength / step);
  BridgeUnknown(path, unknown, smooth);
  if (moved)
  {
    for (std::vector<double>& shift : shifts)
    {
      shift = SmoothSequence(shift, shiftWeights, Wavelength / step);
    }
  }
  for (std::size_t i = path.FirstOwn(); i < count; ++i)
  {
    const std::int64_t p = path.points[i];
    if (i < work.mouth)
    {
      result.radius[p] = std::max(MinimumRadius, smooth[i]);
    }
    else if (work.skipped[i] == 0)
    {
      const bool bridged = IsBridged(this->tree, p);
      // What is no more than the measurements' error changes nothing.
      const double change = smooth[i] - this->tree.radius[p];
      const double error = MinimumChange + 0.02 * this->tree.radius[p];
      const double radius =
        this->tree.radius[p] + change * change * change / (change * change + error * error);
      // A way across an occlusion stays a vessel.
      result.radius[p] = std::max(bridged ? MinimumBridgedRadius : MinimumRadius, radius);
    }
    if (moved && work.skipped[i] == 0)
    {
      result.points[p] += Vector3(shifts[0][i], shifts[1][i], shifts[2][i]);
    }
  }
}

/// The object beside each point: within the blooming around its lumen.
std::vector<int> LabelsBeside(
  const VesselTree& tree, const CalciumMap& calcium, const ScalarImage& image, double blur)
{
  std::vector<Vector3> positions;
  positions.reserve(calcium.voxels.size());
  const VoxelLattice lattice(image.grid);
  for (const CalciumVoxel& voxel : calcium.voxels)
  {
    positions.push_back(lattice.World(lattice.Place(voxel.offset)));
  }
  const double margin = (CalciumHalo + 1.0) * blur + 0.5 * image.grid.spacing.maxCoeff();
  std::vector<int> labels(tree.points.size(), 0);
  ParallelFor(static_cast<std::int64_t>(tree.points.size()), 64,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t p = first; p < last; ++p)
      {
        double nearest = std::pow(tree.radius[p] + margin, 2);
        for (std::size_t v = 0; v < positions.size(); ++v)
        {
          const double distance = (positions[v] - tree.points[p]).squaredNorm();
          if (distance < nearest)
          {
            nearest = distance;
            labels[p] = calcium.voxels[v].label;
          }
        }
      }
    });
  return labels;
}
}

RefinedLumen RefineLumen(const VesselTree& tree, const std::vector<VesselPath>& paths,
  const ScalarImage& image, const LumenLevels& levels, const CalciumMap& calcium, double blur,
  const ProgressCallback& progress)
{
  CheckTree(tree);
  if (!(blur > 0.0) || !std::isfinite(blur))
  {
    throw std::invalid_argument("RefineLumen: the image's blur must be positive");
  }
  const std::size_t count = tree.points.size();
  RefinedLumen result;
  result.points = tree.points;
  result.radius = tree.radius;
  result.measured.assign(count, 0.0);
  result.deviation.assign(count, 0.0);
  result.calciumArc.assign(count, 0.0);
  result.interpolated.assign(count, 0);
  result.calcium = LabelsBeside(tree, calcium, image, blur);
  const std::unordered_set<std::int64_t> hidden = HiddenVoxels(calcium, image, blur);
  const Refiner refiner{ tree, levels, blur,
    SectionFitter(image, blur, levels.background, hidden) };
  struct Place
  {
    std::size_t path;
    std::size_t point;
  };
  std::vector<PathWork> works(paths.size());
  std::vector<Place> places;
  for (std::size_t n = 0; n < paths.size(); ++n)
  {
    works[n].path = &paths[n];
    refiner.Prepare(works[n], paths, result);
    works[n].expected = refiner.ExpectedRadii(works[n]);
    for (std::size_t i = 0; i < paths[n].points.size(); ++i)
    {
      if (works[n].skipped[i] == 0)
      {
        places.push_back({ n, i });
      }
    }
  }
  ParallelFor(
    static_cast<std::int64_t>(places.size()), 16,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const Place& place = places[n];
        works[place.path].fits[place.point] = refiner.MeasureAt(works[place.path], place.point);
      }
    },
    progress);
  for (const PathWork& work : works)
  {
    refiner.Finish(work, result);
  }
  return result;
}

TreeLumen MeasureTreeLumen(const VesselTree& tree, const std::vector<VesselPath>& paths,
  const ScalarImage& image, double blur, const ProgressCallback& progress)
{
  constexpr double calciumShare = 0.2; // of the time
  TreeLumen measured;
  measured.levels = MeasureLumenLevels(tree, paths, image, blur);
  measured.calcium = FindCalcium(tree, image, measured.levels, PartOf(progress, 0.0, calciumShare));
  measured.lumen = RefineLumen(tree, paths, image, measured.levels, measured.calcium, blur,
    PartOf(progress, calciumShare, 1.0));
  return measured;
}

VesselTree WithLumen(VesselTree tree, const RefinedLumen& lumen)
{
  tree.points = lumen.points;
  tree.radius = lumen.radius;
  MeasureTree(tree);
  return tree;
}
}
