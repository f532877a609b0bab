#include "StraightenedView.h"

#include "CurveGeometry.h"
#include "Require.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr float Outside = std::numeric_limits<float>::quiet_NaN();
constexpr double MostPlaces = 1e6;
constexpr double MostPixels = 16e6;
constexpr int MostRows = 2000;
/// Directions that are nearer to each other than this give no plane, sine.
constexpr double Parallel = 0.05;

/// A unit vector at right angles to another, the same for the same.
Vector3 AnyNormal(const Vector3& direction)
{
  Vector3 axis = Vector3::Zero();
  Eigen::Index minimum = 0;
  direction.cwiseAbs().minCoeff(&minimum);
  axis[minimum] = 1.0;
  return (axis - axis.dot(direction) * direction).normalized();
}

/// Chords around each place, weighted by a Gaussian of the arc; where they cancel out, the step itself.
std::vector<Vector3> Tangents(const std::vector<Vector3>& positions, double step, double smoothing)
{
  const auto count = static_cast<std::int64_t>(positions.size());
  const auto reach = std::max<std::int64_t>(1, std::llround(2.0 * smoothing / step));
  std::vector<double> weights;
  for (std::int64_t k = 0; k <= reach; ++k)
  {
    const double part = smoothing > 0.0 ? double(k) * step / smoothing : 0.0;
    weights.push_back(std::exp(-0.5 * part * part));
  }
  std::vector<Vector3> tangents(positions.size());
  for (std::int64_t n = 0; n < count; ++n)
  {
    Vector3 sum = Vector3::Zero();
    for (std::int64_t k = -reach; k < reach; ++k)
    {
      const std::int64_t from = n + k;
      if (from >= 0 && from + 1 < count)
      {
        const auto weight =
          weights[static_cast<std::size_t>(std::max(std::abs(k), std::abs(k + 1)))];
        sum += weight * (positions[from + 1] - positions[from]);
      }
    }
    if (sum.norm() < 1e-6 * step)
    {
      const std::int64_t from = std::min(n, count - 2);
      sum = positions[from + 1] - positions[from];
    }
    tangents[n] =
      sum.norm() > 0.0 ? Vector3(sum.normalized()) : (n > 0 ? tangents[n - 1] : Vector3::UnitX());
  }
  return tangents;
}

/// The normal at the next place by two reflections: no twist up to the fourth order of the step.
Vector3 Carried(const Vector3& normal, const Vector3& way, const Vector3& from, const Vector3& to)
{
  const double length = way.squaredNorm();
  Vector3 reflected = normal;
  Vector3 tangent = from;
  if (length > 0.0)
  {
    reflected -= 2.0 / length * way.dot(normal) * way;
    tangent -= 2.0 / length * way.dot(from) * way;
  }
  const Vector3 second = to - tangent;
  const double size = second.squaredNorm();
  if (size > 0.0)
  {
    reflected -= 2.0 / size * second.dot(reflected) * second;
  }
  const Vector3 upright = reflected - reflected.dot(to) * to;
  return upright.norm() > 1e-9 ? Vector3(upright.normalized()) : AnyNormal(to);
}
}

std::vector<double> FramedCurve::Interpolated(const std::vector<double>& values) const
{
  std::vector<double> result;
  for (const double one : this->place)
  {
    const auto first = std::min(static_cast<std::size_t>(one), values.size() - 1);
    const auto second = std::min(first + 1, values.size() - 1);
    const double part = one - double(first);
    // What is not known at one end is not known between.
    result.push_back(
      part > 0.0 ? (1.0 - part) * values[first] + part * values[second] : values[first]);
  }
  return result;
}

std::vector<double> FramedCurve::Nearest(const std::vector<double>& values) const
{
  std::vector<double> result;
  for (const double one : this->place)
  {
    const auto index = static_cast<std::size_t>(std::llround(one));
    result.push_back(values[std::min(index, values.size() - 1)]);
  }
  return result;
}

FramedCurve FollowAxis(const std::vector<Vector3>& axis, double step, double smoothing)
{
  Require(axis.size() >= 2, "A vessel's axis has at least two points.");
  Require(std::all_of(axis.begin(), axis.end(), [](const Vector3& p) { return p.allFinite(); }),
    "A vessel's axis has coordinates that are not finite.");
  Require(step > 0.0 && std::isfinite(step), "The step along a vessel has to be above 0.");
  Require(smoothing >= 0.0 && std::isfinite(smoothing), "The smoothing of tangents is negative.");
  const double length = PolylineLength(axis);
  Require(length > 0.0, "A vessel's axis has no length.");
  Require(length / step < MostPlaces, "A vessel has more than a million steps.");

  FramedCurve curve;
  curve.step = step;
  // A shorter vessel has its two ends' neighbourhood at least.
  const auto count =
    std::max<std::size_t>(2, static_cast<std::size_t>(length / step * (1.0 + 1e-12)) + 1);
  double before = 0.0;
  std::size_t piece = 1;
  double span = (axis[1] - axis[0]).norm();
  for (std::size_t n = 0; n < count; ++n)
  {
    const double arc = std::min(double(n) * step, length);
    while (piece + 1 < axis.size() && before + span < arc)
    {
      before += span;
      ++piece;
      span = (axis[piece] - axis[piece - 1]).norm();
    }
    const double part = span > 0.0 ? std::clamp((arc - before) / span, 0.0, 1.0) : 0.0;
    curve.position.emplace_back(axis[piece - 1] + part * (axis[piece] - axis[piece - 1]));
    curve.place.push_back(double(piece - 1) + part);
  }
  curve.tangent = Tangents(curve.position, step, smoothing);
  curve.normal.push_back(AnyNormal(curve.tangent.front()));
  for (std::size_t n = 1; n < count; ++n)
  {
    curve.normal.push_back(Carried(curve.normal.back(), curve.position[n] - curve.position[n - 1],
      curve.tangent[n - 1], curve.tangent[n]));
  }
  for (std::size_t n = 0; n < count; ++n)
  {
    curve.binormal.emplace_back(curve.tangent[n].cross(curve.normal[n]));
  }
  return curve;
}

std::array<GreyPicture, 2> StraightenVessel(const ImageInterpolator& image,
  const FramedCurve& curve, double halfWidth, const ProgressCallback& progress)
{
  Require(halfWidth > 0.0 && halfWidth / curve.step < 0.5 * MostRows,
    "The width of a straightened view is out of range.");
  const int half = std::max(1, static_cast<int>(std::lround(halfWidth / curve.step)));
  std::array<GreyPicture, 2> cuts;
  for (GreyPicture& cut : cuts)
  {
    cut.width = static_cast<int>(curve.position.size());
    cut.height = 2 * half + 1;
    cut.values.resize(static_cast<std::size_t>(cut.width) * static_cast<std::size_t>(cut.height));
  }
  ParallelFor(
    2 * cuts[0].height, 8,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        GreyPicture& cut = cuts[n / cuts[0].height];
        const auto& across = n < cuts[0].height ? curve.normal : curve.binormal;
        const auto row = n % cuts[0].height;
        const double aside = double(half - row) * curve.step;
        float* values = cut.values.data() + row * cut.width;
        for (std::size_t x = 0; x < curve.position.size(); ++x)
        {
          const Vector3 place = curve.position[x] + aside * across[x];
          values[x] = image.Contains(place) ? static_cast<float>(image.At(place)) : Outside;
        }
      }
    },
    progress);
  return cuts;
}

Vector3 SlabPlane::ToPicture(const Vector3& world) const
{
  const Vector3 from = world - this->corner;
  return { from.dot(this->right) / this->spacing, from.dot(this->down) / this->spacing,
    from.dot(this->towards) };
}

SlabPlane PlaneTowards(const Vector3& towards)
{
  Require(towards.norm() > 0.0, "A picture has to look from somewhere.");
  SlabPlane plane;
  plane.towards = towards.normalized();
  const Vector3 head = Vector3::UnitZ();
  const Vector3 front = -Vector3::UnitY();
  const Vector3& above = plane.towards.cross(head).norm() > Parallel ? head : front;
  plane.down = -(above - above.dot(plane.towards) * plane.towards).normalized();
  plane.right = plane.towards.cross(plane.down);
  return plane;
}

SlabPlane Framed(
  const SlabPlane& plane, const std::vector<Vector3>& points, double margin, double spacing)
{
  Require(!points.empty(), "A slab without points has no place.");
  Require(spacing > 0.0 && margin >= 0.0, "The pixels or the margin of a slab are out of range.");
  constexpr double Huge = std::numeric_limits<double>::max();
  Vector3 low = Vector3::Constant(Huge);
  Vector3 high = Vector3::Constant(-Huge);
  for (const Vector3& point : points)
  {
    const Vector3 place(point.dot(plane.right), point.dot(plane.down), point.dot(plane.towards));
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  SlabPlane framed = plane;
  framed.spacing = spacing;
  const Vector3 size = (high - low + Vector3::Constant(2.0 * margin)) / spacing;
  Require(size.allFinite() && size[0] * size[1] < MostPixels, "A slab has too many pixels.");
  framed.width = static_cast<int>(std::ceil(size[0])) + 1;
  framed.height = static_cast<int>(std::ceil(size[1])) + 1;
  const Vector3 middle = 0.5 * (low + high);
  framed.corner = (middle[0] - 0.5 * (framed.width - 1) * spacing) * plane.right +
    (middle[1] - 0.5 * (framed.height - 1) * spacing) * plane.down + middle[2] * plane.towards;
  return framed;
}

SlabPlane PlaneOfVessel(
  const std::vector<Vector3>& points, double margin, double spacing, double straightness)
{
  Require(!points.empty(), "A slab without points has no place.");
  Vector3 mean = Vector3::Zero();
  for (const Vector3& point : points)
  {
    mean += point / double(points.size());
  }
  Matrix3 spread = Matrix3::Zero();
  for (const Vector3& point : points)
  {
    spread += (point - mean) * (point - mean).transpose() / double(points.size());
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> axes(spread);
  const Vector3 front = -Vector3::UnitY();
  Vector3 towards = axes.eigenvectors().col(0);
  if (axes.eigenvalues()[1] < straightness * straightness)
  {
    const Vector3 along = axes.eigenvectors().col(2);
    towards = front - front.dot(along) * along;
    if (towards.norm() < Parallel)
    {
      towards = AnyNormal(along);
    }
  }
  // The largest part of the direction decides the side, so that noise does not: from the front, the head, the left.
  const Vector3 wanted(0.3, -1.0, 0.6);
  Eigen::Index maximum = 0;
  towards.cwiseAbs().cwiseProduct(wanted.cwiseAbs()).maxCoeff(&maximum);
  if (towards[maximum] * wanted[maximum] < 0.0)
  {
    towards = -towards;
  }
  return Framed(PlaneTowards(towards), points, margin, spacing);
}

std::vector<float> DepthsAlong(const SlabPlane& plane, const std::vector<Vector3>& points,
  double softness, const ProgressCallback& progress)
{
  Require(!points.empty(), "A slab without points has no place.");
  Require(softness > 0.0, "The softness of a slab has to be above 0.");
  std::vector<Vector3> places;
  for (const Vector3& point : points)
  {
    places.push_back(plane.ToPicture(point));
  }
  const double soft = softness * softness / (plane.spacing * plane.spacing);
  std::vector<float> depths(
    static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height));
  ParallelFor(
    plane.height, 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t y = first; y < last; ++y)
      {
        for (std::int64_t x = 0; x < plane.width; ++x)
        {
          double sum = 0.0;
          double weights = 0.0;
          for (const Vector3& place : places)
          {
            const double dx = place[0] - double(x);
            const double dy = place[1] - double(y);
            const double near = 1.0 / (dx * dx + dy * dy + soft);
            sum += near * near * place[2];
            weights += near * near;
          }
          depths[y * plane.width + x] = static_cast<float>(sum / weights);
        }
      }
    },
    progress);
  return depths;
}

GreyPicture ProjectSlab(const ImageInterpolator& image, const SlabPlane& plane,
  const std::vector<float>& depths, double thickness, const ProgressCallback& progress)
{
  GreyPicture picture;
  picture.width = plane.width;
  picture.height = plane.height;
  picture.values.assign(
    static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height), Outside);
  Require(thickness >= 0.0 && std::isfinite(thickness), "A slab's thickness is out of range.");
  Require(depths.empty() || depths.size() == picture.values.size(),
    "A slab has another number of depths than pixels.");
  // Finer than the voxels, that no bright one is passed.
  const int samples = 1 + static_cast<int>(std::ceil(thickness / (0.7 * image.MinimumSpacing())));
  const double between = samples > 1 ? thickness / (samples - 1) : 0.0;
  ParallelFor(
    plane.height, 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t y = first; y < last; ++y)
      {
        for (std::int64_t x = 0; x < plane.width; ++x)
        {
          const auto pixel = static_cast<std::size_t>(y * plane.width + x);
          const double middle = depths.empty() ? 0.0 : double(depths[pixel]);
          const Vector3 centre =
            plane.corner + plane.spacing * (double(x) * plane.right + double(y) * plane.down);
          float& value = picture.values[pixel];
          for (int n = 0; n < samples; ++n)
          {
            const double depth = middle - 0.5 * thickness + n * between;
            const Vector3 place = centre + depth * plane.towards;
            if (image.Contains(place))
            {
              const auto sample = static_cast<float>(image.At(place));
              value = std::isnan(value) ? sample : std::max(value, sample);
            }
          }
        }
      }
    },
    progress);
  return picture;
}
}
