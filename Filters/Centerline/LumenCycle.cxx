#include "LumenCycle.h"

#include "Median.h"
#include "Require.h"
#include "TreeLinks.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace coronary
{
namespace
{
constexpr double NotSeen = std::numeric_limits<double>::quiet_NaN();

void CheckLumen(const VesselTree& tree, const RefinedLumen& lumen)
{
  const std::size_t points = tree.points.size();
  Require(lumen.radius.size() == points && lumen.measured.size() == points &&
      lumen.deviation.size() == points && lumen.interpolated.size() == points &&
      lumen.calcium.size() == points && lumen.calciumArc.size() == points,
    "A lumen over the cycle has other than one value a point of the tree.");
}

/// Medians over the phases of what was measured.
RefinedLumen MedianLumen(const std::vector<RefinedLumen>& lumens)
{
  RefinedLumen median = lumens.front();
  for (std::size_t p = 0; p < median.radius.size(); ++p)
  {
    std::vector<double> radii;
    std::vector<double> measured;
    std::vector<double> deviations;
    std::vector<double> arcs;
    std::vector<int> calcium;
    std::size_t hidden = 0;
    for (const RefinedLumen& lumen : lumens)
    {
      hidden += lumen.interpolated[p] != 0 ? 1 : 0;
      radii.push_back(lumen.radius[p]);
      arcs.push_back(lumen.calciumArc[p]);
      calcium.push_back(lumen.calcium[p]);
      if (lumen.measured[p] > 0.0)
      {
        measured.push_back(lumen.measured[p]);
        deviations.push_back(lumen.deviation[p]);
      }
    }
    median.interpolated[p] = 2 * hidden > lumens.size() ? 1 : 0;
    median.calciumArc[p] = MedianOf(std::move(arcs));
    median.calcium[p] = *std::max_element(calcium.begin(), calcium.end());
    median.radius[p] =
      MedianOf(measured.empty() ? std::move(radii) : std::vector<double>(measured));
    // Of single sections: what all phases have alike, as the blur, they have wrong alike.
    median.deviation[p] = deviations.empty() ? 0.0 : MedianOf(std::move(deviations));
    median.measured[p] = measured.empty() ? 0.0 : MedianOf(std::move(measured));
  }
  return median;
}

/// A radius where it was seen. What no section was fitted to, as in mouths of branches, has its neighbours'.
std::vector<double> SeenRadius(const VesselTree& tree, const RefinedLumen& lumen)
{
  std::vector<double> radius = lumen.radius;
  for (std::size_t p = 0; p < radius.size(); ++p)
  {
    if (lumen.interpolated[p] != 0 || IsBridged(tree, static_cast<std::int64_t>(p)) ||
      !(radius[p] > 0.0))
    {
      radius[p] = NotSeen;
    }
  }
  return radius;
}

/// Points of a lesion: those of its vessel between its ends.
std::vector<std::int64_t> PointsOf(
  const VesselTree& tree, const std::vector<VesselPath>& paths, const Stenosis& lesion)
{
  std::vector<std::int64_t> points;
  for (const VesselPath& path : paths)
  {
    const auto own = path.points.begin() + static_cast<std::ptrdiff_t>(path.FirstOwn());
    if (std::find(own, path.points.end(), lesion.point) == path.points.end())
    {
      continue;
    }
    std::copy_if(own, path.points.end(), std::back_inserter(points),
      [&](std::int64_t point)
      {
        return tree.abscissa[point] >= lesion.abscissaStart &&
          tree.abscissa[point] <= lesion.abscissaEnd;
      });
  }
  if (points.empty())
  {
    points.push_back(lesion.point);
  }
  return points;
}

CycleLesion Follow(
  const LumenCycle& cycle, const Stenosis& lesion, const std::vector<std::int64_t>& points)
{
  CycleLesion followed;
  followed.median = lesion;
  for (std::size_t k = 0; k < cycle.times.size(); ++k)
  {
    double least = NotSeen;
    double reference = NotSeen;
    for (const std::int64_t point : points)
    {
      const double radius = cycle.radius[k][point];
      if (!std::isnan(radius) && !(radius >= least))
      {
        least = radius;
        reference = cycle.reference[k][point];
      }
    }
    followed.diameter.push_back(2.0 * least);
    followed.degree.push_back(
      reference > 0.0 ? std::clamp(1.0 - least / reference, 0.0, 1.0) : NotSeen);
    if (!std::isnan(followed.degree.back()) &&
      (followed.worst < 0 || followed.degree.back() > followed.degree[followed.worst]))
    {
      followed.worst = static_cast<int>(k);
    }
  }
  return followed;
}
}

RefinedLumen LumenOf(const VesselTree& tree)
{
  RefinedLumen lumen;
  const std::size_t points = tree.points.size();
  lumen.points = tree.points;
  lumen.radius = tree.radius;
  lumen.measured = tree.radius;
  lumen.deviation.assign(points, 0.0);
  lumen.calciumArc.assign(points, 0.0);
  lumen.interpolated.assign(points, 0);
  lumen.calcium.assign(points, 0);
  return lumen;
}

LumenCycle GradeOverCycle(const VesselTree& given, const std::vector<double>& times,
  const std::vector<RefinedLumen>& lumens, const ProgressCallback& progress)
{
  Require(!lumens.empty(), "A lumen over the cycle has no phase.");
  Require(lumens.size() == times.size(), "A lumen over the cycle has other than one time a phase.");
  CheckTree(given);
  for (const RefinedLumen& lumen : lumens)
  {
    CheckLumen(given, lumen);
  }
  VesselTree tree = given;
  MeasureTree(tree);
  const std::vector<VesselPath> paths = VesselPaths(tree);
  const auto grade = [&](const RefinedLumen& lumen)
  {
    VesselTree own = tree;
    own.radius = lumen.radius;
    return GradeStenoses(own, paths, lumen);
  };
  LumenCycle cycle;
  cycle.times = times;
  // The last one is the median.
  std::vector<StenosisGrading> gradings(lumens.size() + 1);
  const RefinedLumen median = MedianLumen(lumens);
  ParallelFor(
    static_cast<std::int64_t>(gradings.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t k = first; k < last; ++k)
      {
        const auto phase = static_cast<std::size_t>(k);
        gradings[phase] = grade(phase < lumens.size() ? lumens[phase] : median);
      }
    },
    progress);
  for (std::size_t k = 0; k < lumens.size(); ++k)
  {
    cycle.radius.push_back(SeenRadius(tree, lumens[k]));
    cycle.reference.push_back(std::move(gradings[k].referenceRadius));
    cycle.degree.push_back(std::move(gradings[k].degree));
  }
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    std::vector<double> seen;
    for (const std::vector<double>& radius : cycle.radius)
    {
      if (!std::isnan(radius[p]))
      {
        seen.push_back(radius[p]);
      }
    }
    const bool any = !seen.empty();
    cycle.least.push_back(any ? *std::min_element(seen.begin(), seen.end()) : NotSeen);
    cycle.greatest.push_back(any ? *std::max_element(seen.begin(), seen.end()) : NotSeen);
    cycle.median.push_back(any ? MedianOf(std::move(seen)) : NotSeen);
  }
  StenosisGrading& grading = gradings.back();
  cycle.medianReference = std::move(grading.referenceRadius);
  cycle.medianDegree = std::move(grading.degree);
  for (const Stenosis& lesion : grading.lesions)
  {
    cycle.lesions.push_back(Follow(cycle, lesion, PointsOf(tree, paths, lesion)));
  }
  return cycle;
}
}
