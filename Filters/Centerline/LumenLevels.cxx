#include "LumenLevels.h"

#include "BlurredDisc.h"
#include "CrossFrame.h"
#include "CurveSmoothing.h"
#include "LumenMeasurement.h"
#include "Median.h"
#include "TreeLinks.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double LevelWavelength = 50.0; ///< mm, of changes along a vessel that are followed
constexpr double WideEnough = 2.5;       ///< blurs: such a radius shows its contrast at its centre
constexpr double Spread = 0.07;          ///< of levels, relative; what is farther off counts less
constexpr double BrightestShare = 1.25;  ///< of the tree's median: what is above is calcium

constexpr double UsualShare = 0.7; ///< of the wide places are dimmer: some were only taken for wide
constexpr double DimmestShare = 0.6;  ///< of the usual contrast: what shows less is no wide lumen
constexpr double MinimumShare = 0.75; ///< of the level upstream: what is below is the blur's
constexpr double MinimumWideLength = 8.0; ///< mm: fewer wide places tell nothing

struct PointValues
{
  double lumen = 0.0;  ///< mean over a small disc
  double share = 1.0;  ///< of the contrast that blur leaves there
  double around = 0.0; ///< lower quartile of a ring outside of the wall
};

PointValues ValuesAt(const ImageInterpolator& image, const Vector3& position,
  const Vector3& tangent, double radius, double blur)
{
  constexpr int directions = 12;
  const CrossFrame frame(tangent);
  PointValues values;
  values.lumen = image.At(position);
  std::vector<double> ring;
  const double disc = std::min(0.4 * radius, image.MinimumSpacing());
  for (int i = 0; i < directions; ++i)
  {
    const Vector3 direction = frame.Ray(i, directions);
    values.lumen += image.At(position + disc * direction);
    ring.push_back(image.At(position + (radius + 2.5 * blur) * direction));
  }
  values.lumen /= directions + 1;
  values.share =
    (BlurredDisc(0.0, radius / blur) + directions * BlurredDisc(disc / blur, radius / blur)) /
    (directions + 1);
  values.around = InclusiveQuantileOf(ring, 0.25);
  return values;
}

/// Of single voxels on the axes of wide vessels, against what is around them along the axis: calcium and narrowings are
/// outliers, and blood that changes from place to place is no noise.
double NoiseOnAxes(const VesselTree& tree, const std::vector<VesselPath>& paths,
  const ImageInterpolator& values, const ScalarImage& image, double blur,
  const std::vector<char>& counts, double usual)
{
  constexpr double around =
    10.0; // mm, of the axis to either side: farther than noise hangs together
  constexpr std::size_t minimum = 5;
  const std::array<int, 3> size = image.Dimensions();
  std::vector<double> deviations;
  for (const VesselPath& path : paths)
  {
    std::vector<std::pair<double, double>> voxels; // mm along, value; each voxel once
    Vector3 before = Vector3::Constant(-1e9);
    for (std::size_t i = path.FirstOwn(); i < path.points.size(); ++i)
    {
      const std::int64_t p = path.points[i];
      if (counts[p] == 0 || !(tree.radius[p] > 2.5 * blur + 0.5 * values.MinimumSpacing()))
      {
        continue;
      }
      const Vector3 index = values.ToIndex(tree.points[p]).array().round();
      bool inside = index != before;
      for (int axis = 0; axis < 3; ++axis)
      {
        inside = inside && index[axis] >= image.grid.extent[2 * axis] &&
          index[axis] < image.grid.extent[2 * axis] + size[axis];
      }
      if (inside)
      {
        before = index;
        voxels.emplace_back(
          path.arc[i], values.At(image.grid.IndexToWorld(index[0], index[1], index[2])));
      }
    }
    for (const auto& [arc, value] : voxels)
    {
      std::vector<double> near;
      for (const auto& [otherArc, other] : voxels)
      {
        if (std::abs(otherArc - arc) <= around)
        {
          near.push_back(other);
        }
      }
      if (near.size() >= minimum)
      {
        deviations.push_back(std::abs(value - InclusiveQuantileOf(std::move(near), 0.5)));
      }
    }
  }
  return deviations.size() >= 10 ? 1.4826 * InclusiveQuantileOf(std::move(deviations), 0.5) : usual;
}
}

LumenLevels MeasureLumenLevels(const VesselTree& tree, const std::vector<VesselPath>& paths,
  const ScalarImage& image, double blur)
{
  CheckTree(tree);
  if (!(blur > 0.0) || !std::isfinite(blur))
  {
    throw std::invalid_argument("MeasureLumenLevels: the image's blur must be positive");
  }
  const ImageInterpolator values(image);
  LumenLevels result;
  const std::size_t count = tree.points.size();
  result.level.assign(count, 0.0);
  std::vector<PointValues> seen(count);
  std::vector<double> wide;
  std::vector<double> around;
  std::vector<double> thin;
  for (const VesselPath& path : paths)
  {
    const std::vector<Vector3> tangents = PathTangents(tree, path, 1.0);
    for (std::size_t i = path.FirstOwn(); i < path.points.size(); ++i)
    {
      const std::int64_t p = path.points[i];
      seen[p] = ValuesAt(values, tree.points[p], tangents[i], tree.radius[p], blur);
      around.push_back(seen[p].around);
      (tree.radius[p] > WideEnough * blur ? wide : thin).push_back(seen[p].lumen);
    }
  }
  // A tree of thin vessels only: the brightest of them say most.
  const double usual =
    wide.size() >= 10 ? InclusiveQuantileOf(wide, UsualShare) : InclusiveQuantileOf(thin, 0.9);
  result.usual = usual;
  // Fat: the darkest that is common around vessels. What is darker than that by half of the contrast is the lung beside it.
  const double middle = InclusiveQuantileOf(around, 0.5);
  around.erase(std::remove_if(around.begin(), around.end(),
                 [&](double value) { return value < middle - 0.5 * (usual - middle); }),
    around.end());
  result.background = InclusiveQuantileOf(around, 0.1);
  std::vector<char> counts(count, 0); // wide, and bright as contrast is
  for (const VesselPath& path : paths)
  {
    const std::size_t points = path.points.size();
    std::vector<double> own(points, 0.0);
    std::vector<double> weights(points, 0.0);
    std::size_t first = points;
    std::size_t last = 0;
    for (std::size_t i = 0; i < points; ++i)
    {
      const std::int64_t p = path.points[i];
      const double r = tree.radius[p] / blur;
      const double share = seen[p].share;
      own[i] = result.background + (seen[p].lumen - result.background) / std::max(share, 0.5);
      const bool bridged = IsBridged(tree, p);
      if (r > WideEnough && own[i] < BrightestShare * usual && !bridged &&
        own[i] - result.background > DimmestShare * (usual - result.background))
      {
        weights[i] = share * (tree.confidence.empty() ? 1.0 : std::max(0.1, tree.confidence[p]));
        counts[p] = 1;
        first = std::min(first, i);
        last = i;
      }
    }
    const double before = path.parent < 0 ? usual : result.level[path.points.front()];
    if (first >= points || path.arc[last] - path.arc[first] < MinimumWideLength)
    {
      for (std::size_t i = path.FirstOwn(); i < points; ++i)
      {
        result.level[path.points[i]] = before;
      }
      continue;
    }
    const double step = path.Step();
    // At its origin a vessel has its parent's blood.
    if (path.parent >= 0)
    {
      own[0] = before;
      weights[0] = 4.0 / step;
      first = 0;
    }
    std::vector<double> smooth;
    std::vector<double> robust = weights;
    double scale = 0.3;
    for (int pass = 0; pass < 6; ++pass)
    {
      smooth = SmoothSequence(own, robust, LevelWavelength / step);
      scale = std::max(Spread, 0.5 * scale);
      for (std::size_t i = 0; i < points; ++i)
      {
        const double residual = (own[i] - smooth[i]) / (scale * std::max(std::abs(usual), 1.0));
        robust[i] = weights[i] / ((1.0 + residual * residual) * (1.0 + residual * residual));
      }
    }
    for (std::size_t i = path.FirstOwn(); i < points; ++i)
    {
      // Blood loses some of its contrast on its way, and gains none.
      result.level[path.points[i]] = std::clamp(
        smooth[std::clamp(i, first, last)], MinimumShare * before, BrightestShare * before);
    }
  }
  result.noise = NoiseOnAxes(tree, paths, values, image, blur, counts, 0.05 * usual);
  return result;
}
}
