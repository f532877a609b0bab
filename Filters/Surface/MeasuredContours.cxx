#include "MeasuredContours.h"

#include "Numbers.h"
#include "Require.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
/// Relative radii as a series over the angle: 1, cos, sin, cos 2, ...
using Series = Eigen::VectorXd;

Series Basis(double angle, int harmonics)
{
  Series row(2 * harmonics + 1);
  row[0] = 1.0;
  for (int n = 1; n <= harmonics; ++n)
  {
    row[2 * n - 1] = std::cos(n * angle);
    row[2 * n] = std::sin(n * angle);
  }
  return row;
}

/// @return false when too few rays find a wall
bool MeasureSection(const ImageInterpolator& image, const ContourSettings& settings,
  const Vector3& centre, const Vector3& normal, const Vector3& binormal, double radius,
  Series& series)
{
  const double step = std::min(0.1 * radius, 0.25 * image.MinimumSpacing());
  const double lumen = image.At(centre);
  const int steps = static_cast<int>(std::ceil((settings.reach + 0.4) * radius / step));
  std::vector<double> fall(settings.samples);
  std::vector<double> wall(settings.samples);
  std::vector<double> values(steps + 1);
  for (int k = 0; k < settings.samples; ++k)
  {
    const double angle = 2.0 * Pi * k / settings.samples;
    const Vector3 way = std::cos(angle) * normal + std::sin(angle) * binormal;
    int minimum = 0;
    for (int i = 0; i <= steps; ++i)
    {
      values[i] = image.At(centre + i * step * way);
      minimum = values[i] < values[minimum] ? i : minimum;
    }
    fall[k] = image.Contains(centre + steps * step * way) ? lumen - values[minimum] : 0.0;
    const double level = lumen - 0.5 * fall[k];
    int i = 0;
    while (i < steps && values[i + 1] > level)
    {
      ++i;
    }
    const double drop = values[i] - values[std::min(i + 1, steps)];
    wall[k] = (i + (drop > 0.0 ? (values[i] - level) / drop : 0.0)) * step / radius;
  }
  const double strongest = *std::max_element(fall.begin(), fall.end());
  if (!(strongest > 0.0))
  {
    return false;
  }
  const int unknowns = 2 * settings.harmonics + 1;
  Eigen::MatrixXd normalMatrix = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Series right = Series::Zero(unknowns);
  int found = 0;
  for (int k = 0; k < settings.samples; ++k)
  {
    if (fall[k] < settings.contrast * strongest || wall[k] < 0.4 || wall[k] > settings.reach)
    {
      continue;
    }
    ++found;
    const Series row = Basis(2.0 * Pi * k / settings.samples, settings.harmonics);
    normalMatrix += row * row.transpose();
    right += wall[k] * row;
  }
  if (3 * found < 2 * settings.samples)
  {
    return false;
  }
  // Gaps between the rays must not be filled by wild waves.
  for (int n = 1; n <= settings.harmonics; ++n)
  {
    normalMatrix(2 * n - 1, 2 * n - 1) += 0.01 * n * n * settings.samples;
    normalMatrix(2 * n, 2 * n) += 0.01 * n * n * settings.samples;
  }
  series = normalMatrix.ldlt().solve(right);
  if (!(series[0] > 0.3))
  {
    return false;
  }
  series /= series[0];
  return series.allFinite();
}

/// How many times branches go out from each point: two on a vessel's way, whether one branch or two;
/// else an end or a node.
std::map<std::int64_t, int> CountUses(const VesselTree& tree)
{
  const std::size_t n = tree.points.size();
  std::map<std::int64_t, int> uses;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (const std::int64_t p : branch.points)
    {
      if (p < 0 || p >= static_cast<std::int64_t>(n) || tree.radius.size() != n)
      {
        throw std::invalid_argument("MeasureContours: a branch names point " + std::to_string(p) +
          " of " + std::to_string(std::min(n, tree.radius.size())));
      }
    }
    for (std::size_t i = 0; i < branch.points.size(); ++i)
    {
      uses[branch.points[i]] += i == 0 || i + 1 == branch.points.size() ? 1 : 2;
    }
  }
  return uses;
}

/// What is measured across a branch.
struct Section
{
  Vector3 normal;
  std::vector<double> contour; ///< empty: not this branch's
  bool measured = false;
};

std::vector<Section> MeasureBranch(const ImageInterpolator& image, const ContourSettings& settings,
  const VesselTree& tree, const std::vector<std::int64_t>& list,
  const std::map<std::int64_t, int>& usesOfPoints)
{
  const auto uses = [&](std::int64_t p) { return usesOfPoints.at(p); };
  const std::size_t count = list.size();
  std::vector<double> s(count, 0.0);
  for (std::size_t i = 1; i < count; ++i)
  {
    s[i] = s[i - 1] + (tree.points[list[i]] - tree.points[list[i - 1]]).norm();
  }
  std::vector<Section> sections(count);
  std::vector<Series> series(count);
  std::vector<Vector3> normals(count, Vector3::UnitX());
  Vector3 normal = Vector3::Zero();
  for (std::size_t i = 0; i < count; ++i)
  {
    const double radius = tree.radius[list[i]];
    std::size_t low = i;
    std::size_t high = i;
    while (low > 0 && s[i] - s[low] < radius)
    {
      --low;
    }
    while (high + 1 < count && s[high] - s[i] < radius)
    {
      ++high;
    }
    const Vector3 along = tree.points[list[high]] - tree.points[list[low]];
    if (!(along.norm() > 0.0))
    {
      continue;
    }
    const Vector3 tangent = along.normalized();
    normal -= normal.dot(tangent) * tangent;
    normal = normal.norm() > 1e-6 ? Vector3(normal.normalized()) : tangent.unitOrthogonal();
    normals[i] = normal;
    const double room =
      std::min(uses(list.front()) > 2 ? s[i] - 2.0 * tree.radius[list.front()] : 1e9,
        uses(list.back()) > 2 ? s.back() - s[i] - 2.0 * tree.radius[list.back()] : 1e9);
    if (room > 0.0 && radius > 0.0)
    {
      MeasureSection(
        image, settings, tree.points[list[i]], normal, tangent.cross(normal), radius, series[i]);
    }
  }
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::int64_t p = list[i];
    const bool own = uses(p) <= 2 && (i > 0 || uses(p) == 1);
    if (!own)
    {
      continue; // a node has no section of its own
    }
    Series sum = Series::Zero(2 * settings.harmonics + 1);
    double weights = 0.0;
    const double reach = tree.radius[p];
    const auto add = [&](std::size_t j)
    {
      const double weight = 1.0 - std::abs(s[j] - s[i]) / (1.001 * reach);
      // Where nothing was measured it is round.
      sum[0] += weight;
      weights += weight;
      if (series[j].size() > 0)
      {
        sum.tail(sum.size() - 1) += weight * series[j].tail(sum.size() - 1);
      }
    };
    for (std::size_t j = i; j < count && s[j] - s[i] < reach; ++j)
    {
      add(j);
    }
    for (std::size_t j = i; j-- > 0 && s[i] - s[j] < reach;)
    {
      add(j);
    }
    sum /= weights;
    Section& section = sections[i];
    section.measured = series[i].size() > 0;
    section.normal = normals[i];
    for (int k = 0; k < settings.samples; ++k)
    {
      const double value = sum.dot(Basis(2.0 * Pi * k / settings.samples, settings.harmonics));
      section.contour.push_back(tree.radius[p] * std::clamp(value, 0.5, settings.reach));
    }
  }
  return sections;
}

/// A node's contour is round, whatever its normal; it must not lie along the axis.
void TurnNodes(const std::map<std::int64_t, int>& uses, const VesselTree& tree,
  std::vector<Vector3>& contourNormals)
{
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (const std::int64_t p : { branch.points.front(), branch.points.back() })
    {
      if (uses.at(p) > 1 && branch.points.size() > 1)
      {
        const Vector3 along = p == branch.points.front()
          ? Vector3(tree.points[branch.points[1]] - tree.points[p])
          : Vector3(tree.points[p] - tree.points[branch.points[branch.points.size() - 2]]);
        if (along.norm() > 0.0)
        {
          contourNormals[p] = along.unitOrthogonal();
        }
      }
    }
  }
}
}

void ContourSettings::Validate() const
{
  constexpr RequireOf require{ "ContourSettings" };
  require(this->samples >= 12 && this->samples <= 360, "samples must be 12 to 360");
  require(this->harmonics >= 1 && this->harmonics <= 4, "harmonics must be 1 to 4");
  require(Within(this->reach, 1.1, 3.0), "reach must be 1.1 to 3");
  require(Within(this->contrast, 0.1, 0.9), "contrast must be 0.1 to 0.9");
}

double MeasureContours(const ImageInterpolator& image, const ContourSettings& settings,
  const VesselTree& tree, SweepSections& sections, const ProgressCallback& progress)
{
  settings.Validate();
  const std::size_t n = tree.points.size();
  const std::map<std::int64_t, int> uses = CountUses(tree);
  sections.contourSamples = settings.samples;
  sections.contours.resize(n * settings.samples);
  sections.contourNormals.assign(n, Vector3::UnitX());
  for (std::size_t p = 0; p < n; ++p)
  {
    std::fill_n(sections.contours.begin() + p * settings.samples, settings.samples, tree.radius[p]);
  }
  std::vector<char> measured(n, 0);
  std::vector<std::vector<Section>> measurements(tree.branches.size());
  ParallelFor(
    static_cast<std::int64_t>(tree.branches.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t b = first; b < last; ++b)
      {
        measurements[b] = MeasureBranch(image, settings, tree, tree.branches[b].points, uses);
      }
    },
    progress);
  for (std::size_t b = 0; b < measurements.size(); ++b)
  {
    for (std::size_t i = 0; i < measurements[b].size(); ++i)
    {
      const Section& section = measurements[b][i];
      const std::int64_t p = tree.branches[b].points[i];
      if (!section.contour.empty())
      {
        measured[p] = section.measured ? 1 : 0;
        sections.contourNormals[p] = section.normal;
        std::copy(section.contour.begin(), section.contour.end(),
          sections.contours.begin() + p * settings.samples);
      }
    }
  }
  TurnNodes(uses, tree, sections.contourNormals);
  return n > 0
    ? static_cast<double>(std::count(measured.begin(), measured.end(), 1)) / static_cast<double>(n)
    : 0.0;
}
}
