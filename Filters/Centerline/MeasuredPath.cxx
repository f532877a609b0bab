#include "MeasuredPath.h"

#include "CrossFrame.h"
#include "CurveSmoothing.h"
#include "Median.h"
#include "ParallelFor.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
/// By chords over three voxels.
std::vector<Vector3> Tangents(
  const std::vector<Vector3>& points, const PathMeasurement& measurement)
{
  std::vector<Vector3> tangents(points.size());
  const auto last = static_cast<std::ptrdiff_t>(points.size()) - 1;
  const auto reach =
    std::max<std::ptrdiff_t>(1, std::lround(1.5 * measurement.voxel / measurement.step));
  for (std::ptrdiff_t i = 0; i <= last; ++i)
  {
    const Vector3 chord =
      points[std::min(last, i + reach)] - points[std::max<std::ptrdiff_t>(0, i - reach)];
    tangents[i] = chord.norm() > 0.0 ? Vector3(chord.normalized()) : Vector3::UnitX();
  }
  return tangents;
}

/// What speaks against a vessel because it is wider than what it comes from: no section of a chamber is quite
/// clear, and an aneurysm's are.
/// @param before  radii upstream, the nearest last
std::vector<double> Outgrowth(
  const MeasuredPath& path, std::vector<double> before, const PathMeasurement& measurement)
{
  constexpr double far = 25.0; // mm upstream that are compared
  constexpr double near = 4.0; // mm that may have begun to widen
  constexpr double wide = 1.5; // as much as an ectatic artery
  constexpr double most = 0.5;
  const std::size_t known = before.size();
  before.insert(before.end(), path.radius.begin(), path.radius.end());
  std::vector<double> against(path.size(), 0.0);
  const auto steps = [&](double length)
  { return static_cast<std::size_t>(length / measurement.step); };
  for (std::size_t i = 0; i < path.size(); ++i)
  {
    const std::size_t end = known + i > steps(near) ? known + i - steps(near) : 0;
    const std::size_t begin = end > steps(far) ? end - steps(far) : 0;
    if (end - begin < steps(2.0 * near))
    {
      continue;
    }
    // Lesions narrow what is upstream.
    const double usual = QuantileOf<double>({ before.begin() + static_cast<std::ptrdiff_t>(begin),
                                              before.begin() + static_cast<std::ptrdiff_t>(end) },
      0.8);
    against[i] =
      std::clamp(std::log(path.radius[i] / (wide * usual + 0.5 * measurement.voxel)), 0.0, most);
  }
  return against;
}
}

void MeasuredPath::ReplaceStart(std::size_t first, const std::vector<Vector3>& start)
{
  this->resize(this->size()); // what was not measured yet
  const auto replace = [&](auto& values, auto value)
  {
    values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(first));
    values.insert(values.begin(), start.size(), value);
  };
  replace(this->radius, this->radius[first]);
  replace(this->confidence, 0.0);
  replace(this->lumen, 0.0);
  replace(this->behind, 0.0);
  replace(this->crossing, '\0');
  replace(this->points, Vector3(Vector3::Zero()));
  std::copy(start.begin(), start.end(), this->points.begin());
}

PathMeasurement::PathMeasurement(const CenterlineSettings& chosen, const ImageGrid& grid)
  : settings(chosen)
  , voxel(std::cbrt(grid.spacing.prod()))
  , step(chosen.resampling > 0.0 ? chosen.resampling : 0.6 * voxel)
{
}

void PathMeasurement::Measure(MeasuredPath& path, bool move) const
{
  const std::vector<Vector3> tangents = Tangents(path.points, *this);
  path.radius.resize(path.size(), this->voxel);
  path.confidence.resize(path.size(), 0.0);
  path.lumen.resize(path.size(), 0.0);
  path.behind.resize(path.size(), 0.0);
  std::vector<LumenSection> sections(path.size());
  ParallelFor(static_cast<std::int64_t>(path.size()), 16,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const auto p = static_cast<std::size_t>(i);
        sections[p] = MeasureLumen(*this->image, path.points[p], tangents[p],
          std::max(path.radius[p], this->voxel), this->lumen);
      }
    });
  for (std::size_t i = 0; i < path.size(); ++i)
  {
    const LumenSection& section = sections[i];
    const double shift = (section.centre - path.points[i]).norm();
    path.confidence[i] = section.confidence;
    path.lumen[i] = section.lumen;
    path.behind[i] = section.behind;
    if (section.confidence > 0.0)
    {
      path.radius[i] = section.radius;
      // A centre that is another vessel's.
      if (shift > 1.5 * section.radius + this->voxel)
      {
        path.confidence[i] = 0.0;
      }
      else if (move)
      {
        path.points[i] = section.centre;
      }
    }
  }
}

void PathMeasurement::Recentre(MeasuredPath& path) const
{
  const std::vector<Vector3> tangents = Tangents(path.points, *this);
  const auto unseen = [&](std::size_t i)
  { return path.confidence[i] < this->settings.minimumConfidence; };
  const auto longest = static_cast<std::size_t>(5.0 * this->voxel / this->step);
  for (std::size_t begin = 0; begin < path.size();)
  {
    std::size_t end = begin;
    while (end < path.size() && unseen(end))
    {
      ++end;
    }
    if (end - begin > longest)
    {
      std::vector<LumenSection> best(end - begin);
      ParallelFor(static_cast<std::int64_t>(end - begin), 4,
        [&](std::int64_t first, std::int64_t last)
        {
          for (std::int64_t n = first; n < last; ++n)
          {
            LumenSection& found = best[n];
            const std::size_t i = begin + static_cast<std::size_t>(n);
            const CrossFrame frame(tangents[i]);
            for (const double away : { 1.25, 2.5 })
            {
              for (int side = 0; side < 8; ++side)
              {
                const Vector3 place = path.points[i] + away * this->voxel * frame.Ray(side, 8);
                const LumenSection section =
                  MeasureLumen(*this->image, place, tangents[i], this->voxel, this->lumen);
                // The same lumen: the point is in it.
                if (section.confidence > std::max(found.confidence, path.confidence[i]) &&
                  (section.centre - path.points[i]).norm() <= section.radius + 0.5 * this->voxel)
                {
                  found = section;
                }
              }
            }
          }
        });
      for (std::size_t i = begin; i < end; ++i)
      {
        const LumenSection& section = best[i - begin];
        if (section.confidence > 0.0)
        {
          path.points[i] = section.centre;
          path.radius[i] = section.radius;
          path.confidence[i] = section.confidence;
          path.lumen[i] = section.lumen;
          path.behind[i] = section.behind;
        }
      }
    }
    begin = std::max(end, begin + 1);
  }
}

void PathMeasurement::SmoothPositions(MeasuredPath& path, double start, double end) const
{
  std::vector<double> weights(path.size());
  for (std::size_t i = 0; i < path.size(); ++i)
  {
    weights[i] = std::max(0.01, path.confidence[i]);
  }
  weights.front() = std::max(weights.front(), start);
  weights.back() = std::max(weights.back(), end);
  const double wavelength =
    this->settings.smoothing > 0.0 ? this->settings.smoothing : 12.0 * this->voxel;
  path.points = SmoothCurve(path.points, weights, wavelength / this->step);
}

void PathMeasurement::SmoothRadii(MeasuredPath& path) const
{
  std::vector<double> weights(path.size());
  for (std::size_t i = 0; i < path.size(); ++i)
  {
    weights[i] = path.confidence[i] * path.confidence[i];
  }
  if (*std::max_element(weights.begin(), weights.end()) <= 0.0)
  {
    return;
  }
  const double wavelength =
    this->settings.smoothing > 0.0 ? this->settings.smoothing : 12.0 * this->voxel;
  std::vector<double> smooth = SmoothSequence(path.radius, weights, wavelength / this->step);
  for (int pass = 0; pass < 2; ++pass)
  {
    std::vector<double> robust = weights;
    for (std::size_t i = 0; i < path.size(); ++i)
    {
      const double residual = (path.radius[i] - smooth[i]) / std::max(0.15 * smooth[i], 1e-12);
      robust[i] /= 1.0 + residual * residual;
    }
    smooth = SmoothSequence(path.radius, robust, wavelength / this->step);
  }
  // Ends without a measurement follow a straight line: not beyond what was seen.
  double low = std::numeric_limits<double>::infinity();
  double high = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i)
  {
    if (weights[i] > 0.0)
    {
      low = std::min(low, path.radius[i]);
      high = std::max(high, path.radius[i]);
    }
  }
  for (std::size_t i = 0; i < path.size(); ++i)
  {
    path.radius[i] = std::min(high, std::max(low, smooth[i]));
  }
}

std::size_t PathMeasurement::SeenUpTo(
  const MeasuredPath& path, double parentRadius, const std::vector<double>& before) const
{
  const double gap =
    this->settings.maximumGap > 0.0 ? this->settings.maximumGap : 10.0 * this->voxel;
  // Next to its parent no section is a vessel of its own.
  const auto first = static_cast<std::size_t>(parentRadius / this->step);
  // Where the sum of what speaks for a vessel and what speaks against it is greatest.
  std::size_t end = 0;
  double maximum = 0.0;
  double sum = 0.0;
  double unseen = 0.0;
  const std::vector<double> outgrowth = Outgrowth(path, before, *this);
  for (std::size_t i = first; i < path.size(); ++i)
  {
    // On a way across a lesion nothing need be seen, if something is behind it.
    const double seen = path.confidence[i] - this->settings.minimumConfidence - outgrowth[i];
    const double evidence = path.crossing[i] != 0 ? std::max(0.0, seen) : seen;
    sum += evidence;
    unseen = evidence < 0.0 ? unseen + this->step : 0.0;
    if (unseen > gap)
    {
      break;
    }
    if (sum > maximum)
    {
      maximum = sum;
      end = i + 1;
    }
  }
  // On the whole a vessel: a quarter of what a perfect one would bring.
  const double perfect = (1.0 - this->settings.minimumConfidence) *
    (static_cast<double>(end) - static_cast<double>(std::min(first, end)));
  return maximum >= 0.25 * perfect ? end : 0;
}
}
