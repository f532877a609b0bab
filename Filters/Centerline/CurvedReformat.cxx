#include "CurvedReformat.h"

#include "Median.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr double Degrees = M_PI / 180.0;
constexpr double NotSeen = std::numeric_limits<double>::quiet_NaN();
constexpr double MostPixels = 16e6;

/// The direction of a ruled sheet's columns.
Vector3 RulingOf(const std::vector<Vector3>& points, double angle)
{
  const Vector3 normal = PlaneOfVessel(points, 0.0, 1.0).towards;
  Vector3 along = points.back() - points.front();
  along -= along.dot(normal) * normal;
  // A closed vessel has no way from its beginning to its end.
  const Vector3 turn =
    along.norm() > 1e-6 ? Vector3(along.normalized()) : Vector3(normal.unitOrthogonal());
  return Vector3(Eigen::AngleAxisd(angle * Degrees, turn) * normal);
}

/// The straightened sheet: the axis is the middle row.
void LayStraight(VesselReformat& reformat, double angle)
{
  const FramedCurve& axis = reformat.axis;
  for (std::size_t n = 0; n < axis.position.size(); ++n)
  {
    reformat.track.push_back({ double(n) * axis.step, 0.0 });
    reformat.column.push_back(double(n));
    reformat.up.emplace_back(
      std::cos(angle * Degrees) * axis.normal[n] + std::sin(angle * Degrees) * axis.binormal[n]);
  }
}

/// The unrolled sheet: what of the vessel's way is not along the columns is laid out to the right.
void LayCurved(VesselReformat& reformat, double angle)
{
  const FramedCurve& axis = reformat.axis;
  const Vector3 ruling = RulingOf(axis.position, angle);
  double right = 0.0;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (std::size_t n = 0; n < axis.position.size(); ++n)
  {
    const double height = axis.position[n].dot(ruling);
    if (n > 0)
    {
      const Vector3 way = axis.position[n] - axis.position[n - 1];
      right += (way - way.dot(ruling) * ruling).norm();
    }
    reformat.track.push_back({ right, height });
    low = std::min(low, height);
    high = std::max(high, height);
  }
  for (PicturePlace& place : reformat.track)
  {
    place[1] -= 0.5 * (low + high);
  }
  std::size_t n = 0;
  const auto count = static_cast<std::size_t>(right / reformat.spacing * (1.0 + 1e-12)) + 1;
  for (std::size_t x = 0; x < count; ++x)
  {
    const double wanted = double(x) * reformat.spacing;
    while (n + 2 < reformat.track.size() && reformat.track[n + 1][0] < wanted)
    {
      ++n;
    }
    const double span = reformat.track[n + 1][0] - reformat.track[n][0];
    const double part =
      span > 0.0 ? std::clamp((wanted - reformat.track[n][0]) / span, 0.0, 1.0) : 0.0;
    reformat.column.push_back(double(n) + part);
    reformat.up.push_back(ruling);
  }
}

Vector3 Between(const std::vector<Vector3>& values, double at)
{
  const auto first = std::min(static_cast<std::size_t>(at), values.size() - 1);
  const double part = at - double(first);
  return part > 0.0 ? Vector3((1.0 - part) * values[first] + part * values[first + 1])
                    : values[first];
}

double Between(const std::vector<PicturePlace>& track, double at)
{
  const auto first = std::min(static_cast<std::size_t>(at), track.size() - 1);
  const double part = at - double(first);
  return part > 0.0 ? (1.0 - part) * track[first][1] + part * track[first + 1][1] : track[first][1];
}

/// Where a ray has left the wall: NaN when it does not within reach.
double OuterAlong(const ImageInterpolator& image, const Vector3& from, const Vector3& direction,
  double begin, const BoundarySettings& settings)
{
  const double step = 0.5 * image.MinimumSpacing();
  double before = image.At(from + begin * direction);
  for (double away = begin + step; away <= begin + settings.reach; away += step)
  {
    const Vector3 place = from + away * direction;
    const double value = image.At(place);
    if (value <= settings.outerLevel)
    {
      const double fall = before - value;
      const double over = fall > 0.0 ? (value - settings.outerLevel) / fall : 0.0;
      return image.Contains(place) ? away + std::max(-1.0, over) * step : NotSeen;
    }
    before = value;
  }
  return NotSeen;
}

/// Medians of neighbours around and along; what most neighbours see is seen.
std::vector<double> Steadied(
  const std::vector<double>& distances, std::size_t places, int rays, int around, int along)
{
  std::vector<double> steady(distances.size(), NotSeen);
  for (std::size_t n = 0; n < places; ++n)
  {
    const auto first = static_cast<std::int64_t>(n) - along;
    const auto last = static_cast<std::int64_t>(n) + along;
    for (int ray = 0; ray < rays; ++ray)
    {
      std::vector<double> near;
      std::size_t all = 0;
      for (std::int64_t m = std::max<std::int64_t>(0, first);
           m <= std::min(last, static_cast<std::int64_t>(places) - 1); ++m)
      {
        for (int k = -around; k <= around; ++k, ++all)
        {
          const double one =
            distances[static_cast<std::size_t>(m) * rays + (ray + k + rays) % rays];
          if (!std::isnan(one))
          {
            near.push_back(one);
          }
        }
      }
      if (2 * near.size() > all)
      {
        steady[n * rays + ray] = MedianOf(std::move(near));
      }
    }
  }
  return steady;
}

/// What is behind walls along the axis, the same for all of it; NaN: there is no wall.
double BackgroundOf(const ImageInterpolator& image, const FramedCurve& axis)
{
  constexpr double Apart = 5.0; // mm
  std::vector<double> all;
  const auto every = static_cast<std::size_t>(std::max(1.0, Apart / axis.step));
  for (std::size_t n = 0; n < axis.position.size(); n += every)
  {
    LumenReference reference;
    if (image.Contains(axis.position[n]) && MeasureReference(image, axis.position[n], reference))
    {
      all.push_back(reference.background);
    }
  }
  return all.empty() ? NotSeen : MedianOf(std::move(all));
}
}

void ReformatSettings::Validate() const
{
  const RequireOf require{ "ReformatSettings" };
  require(this->kind == ReformatKind::Straightened || this->kind == ReformatKind::Curved,
    "Kind must be 0 (straightened) or 1 (curved)");
  require.Range("Angle", this->angle, -360.0, 360.0);
  require.Range("HalfWidth", this->halfWidth, 1.0, 50.0);
  require.Range("Spacing", this->spacing, 0.02, 5.0);
  require.Range("Smoothing", this->smoothing, 0.0, 20.0);
}

void BoundarySettings::Validate() const
{
  const RequireOf require{ "BoundarySettings" };
  require.Range("Rays", this->rays, 8, 360);
  require(std::isfinite(this->outerLevel), "OuterLevel must be finite");
  require.Range("Reach", this->reach, 0.5, 20.0);
}

Vector3 VesselReformat::WorldOf(const PicturePlace& at) const
{
  const double x =
    std::clamp(at[0] / this->spacing, 0.0, static_cast<double>(this->column.size() - 1));
  const auto first = static_cast<std::size_t>(x);
  const std::size_t second = std::min(first + 1, this->column.size() - 1);
  const double part = x - double(first);
  const auto on = [&](std::size_t n)
  {
    return Vector3(Between(this->axis.position, this->column[n]) +
      (at[1] - Between(this->track, this->column[n])) * this->up[n]);
  };
  return (1.0 - part) * on(first) + part * on(second);
}

PicturePlace VesselReformat::Beside(std::size_t n, double distance) const
{
  const std::size_t before = n > 0 ? n - 1 : n;
  const std::size_t after = std::min(n + 1, this->track.size() - 1);
  const double right = this->track[after][0] - this->track[before][0];
  const double rise = this->track[after][1] - this->track[before][1];
  const double length = std::hypot(right, rise);
  const PicturePlace& at = this->track[n];
  return length > 0.0
    ? PicturePlace{ at[0] - distance * rise / length, at[1] + distance * right / length }
    : PicturePlace{ at[0], at[1] + distance };
}

VesselReformat ReformatVessel(const ImageInterpolator& image, const std::vector<Vector3>& axis,
  const ReformatSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  VesselReformat reformat;
  reformat.spacing = settings.spacing;
  reformat.axis = FollowAxis(axis, settings.spacing, settings.smoothing);
  if (settings.kind == ReformatKind::Straightened)
  {
    LayStraight(reformat, settings.angle);
  }
  else
  {
    LayCurved(reformat, settings.angle);
  }
  double highest = 0.0;
  for (const PicturePlace& place : reformat.track)
  {
    highest = std::max(highest, std::abs(place[1]));
  }
  const auto half =
    static_cast<int>(std::ceil((highest + settings.halfWidth) / settings.spacing - 1e-9));
  GreyPicture& picture = reformat.picture;
  picture.width = static_cast<int>(reformat.column.size());
  picture.height = 2 * half + 1;
  Require(double(picture.width) * picture.height <= MostPixels,
    "The reformat has too many pixels: Spacing is too small for so long a vessel.");
  const std::size_t pixels =
    static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  picture.values.resize(pixels);
  reformat.place.resize(pixels);
  ParallelFor(
    picture.width, 8,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t x = first; x < last; ++x)
      {
        const Vector3 middle = Between(reformat.axis.position, reformat.column[x]);
        const double height = Between(reformat.track, reformat.column[x]);
        for (int row = 0; row < picture.height; ++row)
        {
          const double away = double(half - row) * settings.spacing - height;
          const Vector3 place = middle + away * reformat.up[x];
          const std::size_t pixel =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width) +
            static_cast<std::size_t>(x);
          reformat.place[pixel] = place;
          picture.values[pixel] = image.Contains(place) ? static_cast<float>(image.At(place))
                                                        : std::numeric_limits<float>::quiet_NaN();
        }
      }
    },
    progress);
  return reformat;
}

SlabPlane SectionPlane(
  const FramedCurve& axis, std::size_t place, double angle, double halfWidth, double spacing)
{
  Require(place < axis.position.size(), "A section is beyond the vessel's end.");
  Require(halfWidth > 0.0 && spacing > 0.0 && halfWidth / spacing < 2000.0,
    "The width or the pixels of a section are out of range.");
  const int half = std::max(1, static_cast<int>(std::lround(halfWidth / spacing)));
  SlabPlane plane;
  plane.towards = -axis.tangent[place];
  plane.down = -(std::cos(angle * Degrees) * axis.normal[place] +
    std::sin(angle * Degrees) * axis.binormal[place]);
  plane.right = plane.towards.cross(plane.down);
  plane.spacing = spacing;
  plane.width = plane.height = 2 * half + 1;
  plane.corner = axis.position[place] - half * spacing * (plane.right + plane.down);
  return plane;
}

double VesselBoundaries::At(const std::vector<double>& of, std::size_t place, double angle) const
{
  const double turn = angle / 360.0 - std::floor(angle / 360.0);
  const double at = turn * this->rays;
  const int first = static_cast<int>(at) % this->rays;
  const double part = at - std::floor(at);
  const double* distances = of.data() + place * static_cast<std::size_t>(this->rays);
  // What is not seen on one side is not seen between.
  return part > 0.0 ? (1.0 - part) * distances[first] + part * distances[(first + 1) % this->rays]
                    : distances[first];
}

double VesselBoundaries::Area(const std::vector<double>& of, std::size_t place) const
{
  const double* distances = of.data() + place * static_cast<std::size_t>(this->rays);
  std::vector<int> seen;
  for (int ray = 0; ray < this->rays; ++ray)
  {
    if (!std::isnan(distances[ray]))
    {
      seen.push_back(ray);
    }
  }
  if (3 * static_cast<int>(seen.size()) < 2 * this->rays)
  {
    return NotSeen;
  }
  // A sector between two rays, of a radius that changes evenly with the angle.
  double area = 0.0;
  for (std::size_t k = 0; k < seen.size(); ++k)
  {
    const int next = k + 1 < seen.size() ? seen[k + 1] : seen.front() + this->rays;
    const double a = distances[seen[k]];
    const double b = distances[next % this->rays];
    area += (a * a + a * b + b * b) / 6.0 * 2.0 * M_PI * (next - seen[k]) / this->rays;
  }
  return area;
}

VesselBoundaries TraceBoundaries(const ImageInterpolator& image, const FramedCurve& axis,
  const std::vector<double>& radius, const BoundarySettings& settings,
  const ProgressCallback& progress)
{
  settings.Validate();
  const std::size_t places = axis.position.size();
  Require(radius.size() == places, "Boundaries need one radius a place.");
  const auto rays = static_cast<std::size_t>(settings.rays);
  std::vector<double> lumen(places * rays, NotSeen);
  std::vector<double> outer(places * rays, NotSeen);
  const double background = BackgroundOf(image, axis);
  ParallelFor(
    static_cast<std::int64_t>(places), 8,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const Vector3& position = axis.position[n];
        LumenSettings search;
        search.rays = settings.rays;
        search.reference.lumen = image.At(position);
        // Fat behind a thin wall is no part of the lumen's edge: nothing is darker than the level between the two.
        search.reference.background =
          std::max(background, (settings.outerLevel + 0.1 * search.reference.lumen) / 1.1);
        if (!image.Contains(position) || !(search.reference.lumen > search.reference.background))
        {
          continue;
        }
        const std::vector<double> walls = MeasureWall(image, position, axis.normal[n],
          axis.binormal[n], radius[n], search.reference.lumen, search);
        for (std::size_t ray = 0; ray < rays; ++ray)
        {
          const double angle = 2.0 * M_PI * double(ray) / double(rays);
          const Vector3 direction =
            std::cos(angle) * axis.normal[n] + std::sin(angle) * axis.binormal[n];
          lumen[n * rays + ray] = walls[ray];
          outer[n * rays + ray] = OuterAlong(
            image, position, direction, std::isnan(walls[ray]) ? radius[n] : walls[ray], settings);
        }
      }
    },
    progress);
  // Half a millimetre along, and an eighth of the way around.
  const int along = std::max(1, static_cast<int>(std::lround(0.5 / axis.step)));
  const int around = std::max(1, settings.rays / 16);
  VesselBoundaries boundaries;
  boundaries.rays = settings.rays;
  boundaries.lumen = Steadied(lumen, places, settings.rays, around, along);
  boundaries.outer = Steadied(outer, places, settings.rays, around, along);
  return boundaries;
}
}
