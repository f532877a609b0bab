#include "LumenMeasurement.h"

#include "CrossFrame.h"
#include "Median.h"
#include "VoxelCell.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <utility>

namespace coronary
{
namespace
{
struct Wall
{
  double distance = 0.0; ///< mm; 0 where no wall was found
  double behind = 0.0;   ///< least value behind it
};

/// Where the wall is, for the radius.
constexpr double HalfMaximum = 0.5;
/// Higher up the fall, for the centre: what a vein against the wall adds is less there.
constexpr double CentreLevel = 0.7;

/// What rays of one lumen look for.
struct WallSearch
{
  const ImageInterpolator& image;
  double lumen;   ///< image value
  double minimum; ///< fall that is a wall
  double floor;   ///< what is darker is no part of a wall
  double step;    ///< mm
  double reach;   ///< mm

  /// @param minimumShare  of the contrast, that falls at a wall
  WallSearch(const ImageInterpolator& of, const LumenSettings& settings, double lumenValue,
    double minimumShare, double farthest)
    : image(of)
    , lumen(lumenValue)
    , minimum(minimumShare * (settings.reference.lumen - settings.reference.background))
    , floor(settings.reference.background -
        0.1 * (settings.reference.lumen - settings.reference.background))
    , step(0.5 * of.MinimumSpacing())
    , reach(farthest)
  {
  }

  Wall Find(const Vector3& from, const Vector3& direction, double share = HalfMaximum) const;
  Wall FindLevel(const Vector3& from, const Vector3& direction, double level) const;
};

/// First fall along a ray, to `share` of the way up from its foot.
Wall WallSearch::Find(const Vector3& from, const Vector3& direction, double share) const
{
  constexpr int capacity = 512;
  double values[capacity];
  const int count = std::min(capacity, static_cast<int>(std::ceil(this->reach / this->step)) + 1);
  values[0] = this->lumen;
  double lowest = this->lumen;
  int lowestAt = 0;
  int known = 1;
  for (int i = 1; i < count; ++i, ++known)
  {
    // Air behind the fat around a vessel is no part of its wall.
    values[i] = std::max(this->floor, this->image.At(from + i * this->step * direction));
    if (values[i] < lowest)
    {
      lowest = values[i];
      lowestAt = i;
    }
    // Another bright thing behind the wall, or the fall is over.
    else if (this->lumen - lowest > this->minimum &&
      (values[i] > lowest + 0.25 * (this->lumen - lowest) || i - lowestAt > 5))
    {
      break;
    }
  }
  if (this->lumen - lowest < this->minimum)
  {
    return {};
  }
  // The least value is the noise's; the wall's other side is the mean of the foot of the fall.
  int foot = lowestAt;
  while (foot > 1 && values[foot - 1] < lowest + 0.15 * (this->lumen - lowest))
  {
    --foot;
  }
  const int last = std::min(known - 1, lowestAt + 4);
  double behind = 0.0;
  int feet = 0;
  for (int i = foot; i <= last && values[i] < lowest + 0.25 * (this->lumen - lowest); ++i, ++feet)
  {
    behind += values[i];
  }
  behind /= feet;
  const double level = behind + share * (this->lumen - behind);
  for (int i = 1; i <= lowestAt; ++i)
  {
    if (values[i] <= level)
    {
      const double fraction = (values[i - 1] - level) / std::max(values[i - 1] - values[i], 1e-12);
      return { (i - 1 + std::min(1.0, std::max(0.0, fraction))) * this->step, behind };
    }
  }
  return {};
}

constexpr double TableStep = 0.05;

/// Exponentially scaled modified Bessel function I0. Abramowitz and Stegun 9.8.1, 9.8.2.
double ScaledBessel(double x)
{
  const auto polynomial = [](std::initializer_list<double> coefficients, double t)
  {
    double value = 0.0;
    for (const double coefficient : coefficients)
    {
      value = value * t + coefficient;
    }
    return value;
  };
  if (x < 3.75)
  {
    return std::exp(-x) *
      polynomial(
        { 0.0045813, 0.0360768, 0.2659732, 1.2067492, 3.0899424, 3.5156229, 1.0 }, x * x / 14.0625);
  }
  return polynomial({ 0.00392377, -0.01647633, 0.02635537, -0.02057706, 0.00916281, -0.00157565,
                      0.00225319, 0.01328592, 0.39894228 },
           3.75 / x) /
    std::sqrt(x);
}

/// Half-maximum radii of discs of radius TableStep, 2 TableStep, ... blurred by a Gaussian of
/// standard deviation 1.
const std::vector<double>& HalfMaxima()
{
  // The disc is integrated over rings; a ring's blurred profile is a Gaussian times I0.
  const auto profile = [](double distance, double radius)
  {
    constexpr int pieces = 64;
    double sum = 0.0;
    for (int i = 0; i < pieces; ++i)
    {
      const double r = radius * (i + 0.5) / pieces;
      sum += r * std::exp(-0.5 * (distance - r) * (distance - r)) * ScaledBessel(distance * r);
    }
    return sum * radius / pieces;
  };
  static const std::vector<double> table = [&]()
  {
    std::vector<double> values;
    for (int i = 1; i <= 100; ++i)
    {
      const double radius = TableStep * i;
      const double half = 0.5 * profile(0.0, radius);
      double low = 0.0;
      double high = radius + 3.0;
      for (int step = 0; step < 40; ++step)
      {
        const double middle = 0.5 * (low + high);
        (profile(middle, radius) > half ? low : high) = middle;
      }
      values.push_back(0.5 * (low + high));
    }
    return values;
  }();
  return table;
}

/// A small lumen is blurred: share of its contrast that a disc with this half-maximum radius shows, at most. Which of the
/// smallest ones it is its width hardly tells: the thinnest that is looked for shows 30 %.
double ExpectedShare(double halfMaximum, double blur, double voxel)
{
  constexpr double unknown = 1.1;   // voxels
  constexpr double thinnest = 0.85; // blurs
  if (!(blur > 0.0))
  {
    const double r = halfMaximum / (unknown * voxel);
    return -std::expm1(-0.5 * r * r);
  }
  const double r = std::max(thinnest, RadiusFromHalfMaximum(halfMaximum, blur) / blur);
  return -std::expm1(-0.5 * r * r);
}

/// Crossing of a fixed level.
Wall WallSearch::FindLevel(const Vector3& from, const Vector3& direction, double level) const
{
  double previous = this->lumen;
  for (int i = 1; i * this->step <= this->reach; ++i)
  {
    const double s = i * this->step;
    const double value = this->image.At(from + s * direction);
    if (value <= level && previous > level)
    {
      return { s - this->step + this->step * (previous - level) / (previous - value), value };
    }
    previous = value;
  }
  return {};
}
}

ImageInterpolator::ImageInterpolator(const ScalarImage& image)
  : Image(image)
{
  const ImageGrid& grid = image.grid;
  this->Inverse = grid.spacing.cwiseInverse().asDiagonal() * grid.direction.transpose();
}

bool ImageInterpolator::Contains(const Vector3& world) const
{
  const Vector3 index = this->ToIndex(world);
  for (int axis = 0; axis < 3; ++axis)
  {
    if (!(index[axis] >= this->Image.grid.extent[2 * axis] - 0.5) ||
      !(index[axis] <= this->Image.grid.extent[2 * axis + 1] + 0.5))
    {
      return false;
    }
  }
  return true;
}

double ImageInterpolator::At(const Vector3& world) const
{
  const VoxelCell<double> cell(this->ToIndex(world), this->Image.grid.extent);
  return std::visit(
    [&](const auto* values) { return cell.Interpolate(values); }, this->Image.values);
}

LumenSection MeasureLumen(const ImageInterpolator& image, const Vector3& position,
  const Vector3& tangent, double radiusGuess, const LumenSettings& settings)
{
  const bool fixed = !std::isnan(settings.level);
  const int rays = settings.rays;
  const LumenReference& reference = settings.reference;
  const double contrast = reference.lumen - reference.background;
  const CrossFrame frame(tangent.normalized());

  LumenSection section;
  section.centre = position;
  section.radius = radiusGuess;
  const double reach = settings.maximumRadius + (fixed ? 0.0 : 3.0 * image.MinimumSpacing());
  WallSearch search(image, settings, 0.0, 0.15, reach);
  std::vector<Wall> walls(rays);
  std::vector<char> good(rays);
  double offCentre = 0.0;
  double spread = 1.0;
  double behind = 0.0;
  int found = 0;
  constexpr int lastRound = 4;
  bool settled = false; // the centre is; what is left is the radius around it
  for (int iteration = 0; iteration < (fixed ? lastRound : lastRound + 1); ++iteration)
  {
    const bool centred = fixed || settled || iteration == lastRound;
    // The lumen's value over a small disc, which noise moves less than one point.
    double lumen = image.At(section.centre);
    const double disc = std::min(0.35 * section.radius, image.MinimumSpacing());
    for (int ray = 0; ray < 8; ++ray)
    {
      lumen += image.At(section.centre + disc * frame.Ray(ray, 8));
    }
    section.lumen = lumen / 9.0;
    search.lumen = section.lumen;

    std::vector<double> distances;
    for (int ray = 0; ray < rays; ++ray)
    {
      walls[ray] = fixed
        ? search.FindLevel(section.centre, frame.Ray(ray, rays), settings.level)
        : search.Find(section.centre, frame.Ray(ray, rays), centred ? HalfMaximum : CentreLevel);
      if (walls[ray].distance > 0.0 && walls[ray].distance <= settings.maximumRadius)
      {
        distances.push_back(walls[ray].distance);
      }
      else
      {
        walls[ray].distance = 0.0;
      }
    }
    if (static_cast<int>(distances.size()) < rays / 3)
    {
      section.confidence = 0.0;
      return section;
    }
    const double median = MedianOf(std::move(distances));

    // d(angle) = R + e . direction, without the rays that run far, twice.
    Vector3 fit(median, 0.0, 0.0);
    for (int pass = 0; pass < 3; ++pass)
    {
      Matrix3 normal = Matrix3::Zero();
      Vector3 right = Vector3::Zero();
      found = 0;
      double sum = 0.0;
      std::vector<double> lows;
      for (int ray = 0; ray < rays; ++ray)
      {
        const double angle = 2.0 * M_PI * ray / rays;
        const Vector3 row(1.0, std::cos(angle), std::sin(angle));
        const double residual = walls[ray].distance - row.dot(fit);
        good[ray] = walls[ray].distance > 0.0 && std::abs(residual) < 0.45 * fit[0];
        if (good[ray])
        {
          ++found;
          normal += row * row.transpose();
          right += walls[ray].distance * row;
          sum += residual * residual;
          lows.push_back(walls[ray].behind);
        }
      }
      if (found < rays / 3)
      {
        section.confidence = 0.0;
        return section;
      }
      behind = MedianOf(std::move(lows));
      spread = std::sqrt(sum / found) / fit[0];
      normal.diagonal() += Vector3(0.0, 1e-3 * rays, 1e-3 * rays);
      fit = normal.ldlt().solve(right);
    }
    section.radius = fit[0];
    if (!fixed && centred)
    {
      break;
    }
    const Vector3 shift = frame.Place(fit[1], fit[2]);
    offCentre = shift.norm();
    const double most = 0.7 * section.radius;
    section.centre += offCentre > most ? Vector3(most / offCentre * shift) : shift;
    if (offCentre < 0.02 * section.radius)
    {
      if (fixed)
      {
        break;
      }
      settled = true;
    }
  }

  // Around it a wall on all sides, round, and as bright as its size lets it be.
  const double share = static_cast<double>(found) / rays;
  const auto ramp = [](double x, double low, double high)
  { return std::min(1.0, std::max(0.0, (x - low) / (high - low))); };
  section.behind = behind;
  section.share = share;
  section.spread = spread;
  section.confidence = ramp(share, 0.45, 0.85) * ramp(spread, 0.4, 0.15);
  if (!fixed)
  {
    const double relative = (section.lumen - reference.background) / contrast;
    const double expected = ExpectedShare(section.radius, settings.blur, image.MinimumSpacing());
    section.confidence *= ramp(relative / std::min(1.0, expected + 0.05), 0.45, 0.7) *
      ramp((section.lumen - behind) / (contrast * std::min(1.0, expected + 0.05)), 0.15, 0.3);
  }
  return section;
}

bool MeasureArc(const ImageInterpolator& image, const Vector3& position, const Vector3& tangent,
  double radius, double lumen, const std::function<bool(const Vector3& wall)>& isOwn,
  const LumenSettings& settings, Vector3& centre)
{
  using Vector2 = Eigen::Vector2d;
  constexpr int rays = 36;
  const WallSearch search(
    image, settings, lumen, 0.15, 1.6 * radius + 3.0 * image.MinimumSpacing());
  const CrossFrame frame(tangent.normalized());
  centre = position;
  for (int iteration = 0; iteration < 4; ++iteration)
  {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Vector2 right = Vector2::Zero();
    double sum = 0.0;
    int found = 0;
    for (int ray = 0; ray < rays; ++ray)
    {
      const double angle = 2.0 * M_PI * ray / rays;
      const Vector2 row(std::cos(angle), std::sin(angle));
      const Vector3 direction = frame.Place(row[0], row[1]);
      const Wall wall = search.Find(centre, direction);
      const double residual = wall.distance - radius;
      if (wall.distance > 0.0 && std::abs(residual) < 0.5 * radius &&
        isOwn(centre + wall.distance * direction))
      {
        normal += row * row.transpose();
        right += residual * row;
        sum += residual * residual;
        ++found;
      }
    }
    // A sixth of the wall, and not all of it on one line.
    if (found < rays / 6 || normal.eigenvalues().real().minCoeff() < 0.3)
    {
      return false;
    }
    if (iteration == 3)
    {
      return std::sqrt(sum / found) < 0.25 * radius;
    }
    const Vector2 shift = (normal + 0.1 * Eigen::Matrix2d::Identity()).ldlt().solve(right);
    centre += frame.Place(shift[0], shift[1]);
    if ((centre - position).norm() > 0.6 * radius)
    {
      return false;
    }
  }
  return false;
}

std::vector<double> MeasureWall(const ImageInterpolator& image, const Vector3& position,
  const Vector3& u, const Vector3& v, double radius, double lumen, const LumenSettings& settings)
{
  // A fall of less than this share is a neighbour's side.
  const WallSearch search(image, settings, lumen, 0.4, 1.8 * radius + 4.0 * image.MinimumSpacing());
  std::vector<double> distances;
  for (int ray = 0; ray < settings.rays; ++ray)
  {
    const double angle = 2.0 * M_PI * ray / settings.rays;
    const Wall wall = search.Find(position, std::cos(angle) * u + std::sin(angle) * v);
    distances.push_back(
      wall.distance > 0.0 ? wall.distance : std::numeric_limits<double>::quiet_NaN());
  }
  return distances;
}

std::vector<Vector3> MeasureWall(const ImageInterpolator& image, const Vector3& position,
  const Vector3& tangent, double radius, double lumen, const LumenSettings& settings)
{
  const CrossFrame frame(tangent.normalized());
  const std::vector<double> distances =
    MeasureWall(image, position, frame.u, frame.v, radius, lumen, settings);
  std::vector<Vector3> points;
  for (int ray = 0; ray < settings.rays; ++ray)
  {
    if (!std::isnan(distances[ray]))
    {
      points.emplace_back(position + distances[ray] * frame.Ray(ray, settings.rays));
    }
  }
  return points;
}

bool MeasureReference(
  const ImageInterpolator& image, const Vector3& seed, LumenReference& reference)
{
  constexpr int directions = 64;
  const double spacing = image.MinimumSpacing();
  std::vector<double> values;
  values.reserve(directions);
  for (int i = 0; i < directions; ++i)
  {
    values.push_back(image.At(seed + 0.6 * spacing * SphereDirection(i, directions)));
  }
  std::sort(values.begin(), values.end());
  reference.lumen = values[directions / 2];
  // What is less than the noise is no wall.
  const double minimum = 2.0 * (values[directions * 7 / 8] - values[directions / 8]);

  WallSearch search(image, {}, reference.lumen, 0.0, 40.0 * spacing);
  search.minimum = std::max(minimum, 1e-3 * std::abs(reference.lumen));
  search.floor = -std::numeric_limits<double>::infinity();
  // Rays along the vessel come far, and those across find its wall.
  std::vector<double> behind;
  std::vector<double> distances;
  for (int i = 0; i < directions; ++i)
  {
    const Wall wall = search.Find(seed, SphereDirection(i, directions));
    if (wall.distance > 0.0)
    {
      behind.push_back(wall.behind);
      distances.push_back(wall.distance);
    }
  }
  if (distances.size() < directions / 4)
  {
    return false;
  }
  reference.background = QuantileOf(std::move(behind), 0.25);
  reference.radius = QuantileOf(std::move(distances), 1.0 / 3.0);
  return reference.background < reference.lumen;
}

double RadiusFromHalfMaximum(double measured, double blur)
{
  if (!(blur > 0.0))
  {
    return measured;
  }
  const double m = measured / blur;
  if (m > HalfMaxima().back())
  {
    // A wall that is nearly straight: its curvature moves the half maximum inwards.
    return measured + 0.5 * blur / m;
  }
  const std::vector<double>& table = HalfMaxima();
  if (m <= table.front())
  {
    return TableStep * blur;
  }
  const auto next = std::upper_bound(table.begin(), table.end(), m);
  const auto index = static_cast<double>(next - table.begin());
  const double fraction = (m - *(next - 1)) / (*next - *(next - 1));
  return TableStep * blur * (index + fraction);
}

double BlurFromContrast(double measured, double contrast)
{
  // With less blur the radius is greater and the centre brighter.
  double low = 0.05 * measured;
  double high = 0.84 * measured;
  for (int i = 0; i < 40; ++i)
  {
    const double blur = 0.5 * (low + high);
    const double radius = RadiusFromHalfMaximum(measured, blur) / blur;
    (1.0 - std::exp(-0.5 * radius * radius) > contrast ? low : high) = blur;
  }
  return 0.5 * (low + high);
}
}
