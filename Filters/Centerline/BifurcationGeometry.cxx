#include "BifurcationGeometry.h"

#include "Median.h"
#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace coronary
{
namespace
{
/// Direction of a branch over a stretch from one of its ends, by a fitted line; away from the end.
Vector3 EndDirection(const CenterlineTopology& tree, const VesselTree::Branch& branch,
  bool fromStart, double low, double high)
{
  Vector3 meanPoint = Vector3::Zero();
  double meanArc = 0.0;
  std::vector<std::pair<double, Vector3>> used;
  double arc = 0.0;
  const auto n = static_cast<int>(branch.points.size());
  Vector3 last = Vector3::Zero();
  const double reach = std::min(high, branch.length);
  for (int i = 0; i < n; ++i)
  {
    const Vector3& p = tree.points[branch.points[fromStart ? i : n - 1 - i]];
    arc += i > 0 ? (p - last).norm() : 0.0;
    last = p;
    if ((arc >= std::min(low, 0.5 * branch.length) && arc <= reach) || (i > 0 && used.size() < 2))
    {
      used.emplace_back(arc, p);
    }
    if (arc > reach && used.size() >= 2)
    {
      break;
    }
  }
  if (used.size() < 2)
  {
    used.insert(
      used.begin(), { 0.0, tree.points[fromStart ? branch.points.front() : branch.points.back()] });
  }
  for (const auto& [s, p] : used)
  {
    meanArc += s / static_cast<double>(used.size());
    meanPoint += p / static_cast<double>(used.size());
  }
  Vector3 slope = Vector3::Zero();
  for (const auto& [s, p] : used)
  {
    slope += (s - meanArc) * (p - meanPoint);
  }
  return slope.norm() > 0.0 ? Vector3(slope.normalized()) : Vector3(Vector3::UnitX());
}

/// Median radius of a branch between two distances from one of its ends.
double EndCalibre(const CenterlineTopology& tree, const VesselTree::Branch& branch, bool fromStart,
  double low, double high)
{
  std::vector<double> values;
  double arc = 0.0;
  const auto n = static_cast<int>(branch.points.size());
  const double first = std::min(low, 0.5 * branch.length);
  for (int i = 0; i < n; ++i)
  {
    const auto point = branch.points[fromStart ? i : n - 1 - i];
    if (i > 0)
    {
      arc += (tree.points[point] - tree.points[branch.points[fromStart ? i - 1 : n - i]]).norm();
    }
    // The shared point belongs to the parent.
    if (arc >= first && arc <= high && !(fromStart && i == 0))
    {
      values.push_back(tree.radius[point]);
    }
  }
  if (values.empty())
  {
    return tree.radius[branch.points[fromStart ? std::min(1, n - 1) : n - 1]];
  }
  return MedianOf(values);
}

double AngleBetween(const Vector3& a, const Vector3& b)
{
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

double MurrayResidual(double parent, const std::vector<double>& daughters, double exponent)
{
  double sum = 0.0;
  for (const double daughter : daughters)
  {
    sum += std::pow(daughter / parent, exponent);
  }
  return 1.0 - sum;
}

/// The exponent that leaves the least error over all bifurcations, in logarithms of calibre.
double FitExponent(const std::vector<Bifurcation>& bifurcations)
{
  std::vector<const Bifurcation*> used;
  for (const Bifurcation& bifurcation : bifurcations)
  {
    if (std::isfinite(bifurcation.fittedExponent))
    {
      used.push_back(&bifurcation);
    }
  }
  if (used.empty())
  {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto error = [&](double x)
  {
    double sum = 0.0;
    for (const Bifurcation* bifurcation : used)
    {
      const double off =
        std::log(1.0 - MurrayResidual(bifurcation->parentRadius, bifurcation->daughterRadius, x)) /
        x;
      sum += off * off;
    }
    return sum;
  };
  double best = 0.5;
  for (int i = 50; i <= 1000; ++i)
  {
    const double x = 0.01 * i;
    best = error(x) < error(best) ? x : best;
  }
  double low = std::max(0.1, best - 0.01);
  double high = best + 0.01;
  for (int i = 0; i < 60; ++i)
  {
    const double a = low + (high - low) / 3.0;
    const double b = high - (high - low) / 3.0;
    (error(a) < error(b) ? high : low) = error(a) < error(b) ? b : a;
  }
  return 0.5 * (low + high);
}
}

int ChooseContinuation(const CenterlineTopology& tree, const VesselTree::Branch& parent,
  const std::vector<int>& daughters)
{
  const double r = EndCalibre(tree, parent, false, 0.0, 3.0 * tree.radius[parent.points.back()]);
  const Vector3 course = -EndDirection(tree, parent, false, 0.0, 4.0 * r);
  int best = -1;
  double minimum = Infinity;
  for (const int d : daughters)
  {
    const VesselTree::Branch& daughter = tree.branches[d];
    const double turn = AngleBetween(course, EndDirection(tree, daughter, true, 0.5 * r, 4.0 * r));
    const double calibre = EndCalibre(tree, daughter, true, r, 4.0 * r);
    // Thirty degrees of turn weigh as much as a calibre of two thirds.
    const double cost = turn / (Pi / 6.0) - std::log(calibre / r) / std::log(1.5);
    if (cost < minimum)
    {
      minimum = cost;
      best = d;
    }
  }
  return best;
}

double SolveMurrayExponent(double parent, const std::vector<double>& daughters)
{
  constexpr double maximum = 20.0;
  if (daughters.size() < 2 || MurrayResidual(parent, daughters, maximum) < 0.0)
  {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double low = 0.0;
  double high = maximum;
  for (int i = 0; i < 100; ++i)
  {
    const double middle = 0.5 * (low + high);
    (MurrayResidual(parent, daughters, middle) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

void DescribeBifurcations(
  CenterlineTopology& tree, const std::vector<std::vector<int>>& daughters, double exponent)
{
  for (const VesselTree::Branch& parent : tree.branches)
  {
    std::vector<int> leaving = daughters[parent.groupId];
    if (leaving.size() < 2)
    {
      continue;
    }
    Bifurcation bifurcation;
    bifurcation.point = parent.points.back();
    bifurcation.parent = parent.groupId;
    const double scale = tree.radius[bifurcation.point];
    bifurcation.parentRadius = EndCalibre(tree, parent, false, scale, 4.0 * scale);
    const double r = bifurcation.parentRadius;
    std::map<int, double> calibre;
    for (const int d : leaving)
    {
      calibre[d] = EndCalibre(tree, tree.branches[d], true, r, 4.0 * r);
    }
    std::stable_sort(
      leaving.begin(), leaving.end(), [&](int a, int b) { return calibre[a] > calibre[b]; });
    bifurcation.daughters = leaving;
    const Vector3 course = -EndDirection(tree, parent, false, 0.5 * r, 3.0 * r);
    std::vector<Vector3> directions;
    double areas = 0.0;
    for (const int d : leaving)
    {
      bifurcation.daughterRadius.push_back(calibre[d]);
      areas += calibre[d] * calibre[d];
      directions.push_back(EndDirection(tree, tree.branches[d], true, 0.5 * r, 3.0 * r));
      bifurcation.daughterAngles.push_back(AngleBetween(course, directions.back()));
    }
    const double r1 = bifurcation.daughterRadius[0];
    const double r2 = bifurcation.daughterRadius[1];
    bifurcation.angle = AngleBetween(directions[0], directions[1]);
    bifurcation.areaRatio = areas / (r * r);
    bifurcation.daughterAreaRatio = r2 * r2 / (r1 * r1);
    bifurcation.murrayResidual = MurrayResidual(r, bifurcation.daughterRadius, exponent);
    bifurcation.huoKassabResidual = MurrayResidual(r, bifurcation.daughterRadius, 7.0 / 3.0);
    bifurcation.finetRatio = r / (r1 + r2);
    bifurcation.fittedExponent = SolveMurrayExponent(r, bifurcation.daughterRadius);
    tree.bifurcations.push_back(bifurcation);
  }
  tree.fittedExponent = FitExponent(tree.bifurcations);
}
}
