#include "CenterlineTopology.h"

#include "BifurcationGeometry.h"
#include "DraftBranches.h"
#include "LineGraph.h"
#include "Median.h"
#include "Numbers.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr double LongestLine = 1e6; ///< in median radii: edges lie in cells of two radii

void Check(const Polylines& lines, const std::vector<Vector3>& roots)
{
  if (lines.radius.size() != lines.points.size())
  {
    throw std::invalid_argument(
      "There must be one radius a point: " + std::to_string(lines.points.size()) + " points, " +
      std::to_string(lines.radius.size()) + " radii");
  }
  for (std::size_t i = 0; i < lines.points.size(); ++i)
  {
    if (!lines.points[i].allFinite())
    {
      throw std::invalid_argument("Point " + std::to_string(i) + " is not finite");
    }
    if (!std::isfinite(lines.points[i].squaredNorm()))
    {
      throw std::invalid_argument(
        "Point " + std::to_string(i) + " is too far away to measure lengths");
    }
  }
  for (std::size_t l = 0; l < lines.lines.size(); ++l)
  {
    for (const std::int64_t point : lines.lines[l])
    {
      if (point < 0 || point >= static_cast<std::int64_t>(lines.points.size()))
      {
        throw std::invalid_argument("Line " + std::to_string(l) + " refers to point " +
          std::to_string(point) + ", which does not exist");
      }
      if (!(std::isfinite(lines.radius[point]) && lines.radius[point] > 0.0))
      {
        throw std::invalid_argument(
          "The radius of point " + std::to_string(point) + " is not a positive number");
      }
    }
  }
  for (const Vector3& root : roots)
  {
    if (!root.allFinite())
    {
      throw std::invalid_argument("A root's position is not finite");
    }
  }
}

/// @returns the median radius of the points that lines have, mm; 0 if no line has a length
double CheckedMedianRadius(const Polylines& lines)
{
  std::vector<double> radii;
  double extent = 0.0;
  for (const auto& line : lines.lines)
  {
    double length = 0.0;
    for (std::size_t i = 0; i < line.size(); ++i)
    {
      radii.push_back(lines.radius[line[i]]);
      length += i > 0 ? (lines.points[line[i]] - lines.points[line[i - 1]]).norm() : 0.0;
    }
    extent = std::max(extent, length);
  }
  if (radii.empty() || extent <= 0.0)
  {
    return 0.0;
  }
  const double radius = MedianOf(radii);
  if (extent > LongestLine * radius)
  {
    throw std::invalid_argument("A line is more than a million times as long as the median radius");
  }
  return radius;
}

/**
 * Points and branches out of a graph.
 * @param which    drafts in the order that their branches get, parents first
 * @param indexOf  of a draft: its branch
 * @returns for each vertex its point, -1 if it has none
 */
std::vector<std::int64_t> FillBranches(CenterlineTopology& tree, const LineGraph& graph,
  const std::vector<DraftBranch>& drafts, const std::vector<int>& which, std::vector<int>& indexOf)
{
  tree.points.clear();
  tree.radius.clear();
  tree.source.clear();
  tree.branches.clear();
  tree.meanRadius.clear();
  std::vector<std::int64_t> index(graph.points.size(), -1);
  for (const int d : which)
  {
    const DraftBranch& draft = drafts[d];
    VesselTree::Branch branch;
    branch.groupId = static_cast<int>(tree.branches.size());
    indexOf[d] = branch.groupId;
    branch.parentGroupId = draft.parent < 0 ? -1 : indexOf[draft.parent];
    branch.treeId = draft.tree;
    for (const int v : draft.vertices)
    {
      if (index[v] < 0)
      {
        index[v] = static_cast<std::int64_t>(tree.points.size());
        tree.points.push_back(graph.points[v]);
        tree.radius.push_back(graph.radius[v]);
        tree.source.push_back(graph.source[v]);
      }
      branch.points.push_back(index[v]);
    }
    double integral = 0.0;
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const double step =
        (tree.points[branch.points[i]] - tree.points[branch.points[i - 1]]).norm();
      branch.length += step;
      integral += 0.5 * step * (tree.radius[branch.points[i]] + tree.radius[branch.points[i - 1]]);
    }
    tree.meanRadius.push_back(integral / branch.length);
    const double chord =
      (tree.points[branch.points.back()] - tree.points[branch.points.front()]).norm();
    branch.tortuosity =
      chord > 1e-6 * branch.length ? std::max(0.0, branch.length / chord - 1.0) : 0.0;
    tree.branches.push_back(branch);
  }
  return index;
}

/// Depth first, the vessel's continuation before its side branches.
/// @param tree  the branches of the drafts `which` in any order
std::vector<int> DepthFirst(const CenterlineTopology& tree, const std::vector<DraftBranch>& drafts,
  const std::vector<int>& which, const std::vector<int>& indexOf)
{
  std::vector<int> sorted;
  std::vector<int> stack;
  for (auto d = which.rbegin(); d != which.rend(); ++d)
  {
    if (drafts[*d].parent < 0)
    {
      stack.push_back(*d);
    }
  }
  while (!stack.empty())
  {
    const int d = stack.back();
    stack.pop_back();
    sorted.push_back(d);
    std::vector<int> daughters = drafts[d].daughters;
    if (daughters.empty())
    {
      continue;
    }
    std::vector<int> indices;
    indices.reserve(daughters.size());
    for (const int daughter : daughters)
    {
      indices.push_back(indexOf[daughter]);
    }
    const int best = ChooseContinuation(tree, tree.branches[indexOf[d]], indices);
    std::stable_sort(daughters.begin(), daughters.end(),
      [&](int a, int b)
      {
        const auto rank = [&](int x)
        { return std::make_pair(indexOf[x] == best, tree.meanRadius[indexOf[x]]); };
        return rank(a) < rank(b);
      });
    stack.insert(stack.end(), daughters.begin(), daughters.end());
  }
  return sorted;
}

/// Numbers the trees in the order of their roots in the input, and what follows from the order of the branches.
/// @returns the daughters of each branch
std::vector<std::vector<int>> LinkBranches(CenterlineTopology& tree)
{
  std::vector<std::vector<int>> daughters(tree.branches.size());
  tree.abscissa.assign(tree.points.size(), 0.0);
  tree.continuation.assign(tree.branches.size(), -1);
  tree.inLoop.assign(tree.branches.size(), 0);
  std::map<int, int> treeNumber;
  for (VesselTree::Branch& branch : tree.branches)
  {
    treeNumber.emplace(branch.treeId, static_cast<int>(treeNumber.size()));
    branch.treeId = treeNumber[branch.treeId];
    if (branch.parentGroupId >= 0)
    {
      std::vector<int>& siblings = daughters[branch.parentGroupId];
      if (siblings.empty())
      {
        tree.continuation[branch.parentGroupId] = branch.groupId;
      }
      siblings.push_back(branch.groupId);
      branch.generation = tree.branches[branch.parentGroupId].generation + 1;
    }
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      tree.abscissa[branch.points[i]] = tree.abscissa[branch.points[i - 1]] +
        (tree.points[branch.points[i]] - tree.points[branch.points[i - 1]]).norm();
    }
  }
  tree.trees = static_cast<int>(treeNumber.size());
  return daughters;
}

/// @param loops  of the graph's vertices
/// @param index  of a vertex: its point
void AddLoops(CenterlineTopology& tree, const LineGraph& graph,
  const std::vector<std::vector<int>>& loops, const std::vector<std::int64_t>& index)
{
  for (const auto& loop : loops)
  {
    CenterlineLoop out;
    std::set<std::int64_t> members;
    for (std::size_t i = 0; i < loop.size(); ++i)
    {
      out.length += (graph.points[loop[i]] - graph.points[loop[(i + 1) % loop.size()]]).norm();
      if (index[loop[i]] >= 0)
      {
        out.points.push_back(index[loop[i]]);
        members.insert(index[loop[i]]);
      }
    }
    for (const VesselTree::Branch& branch : tree.branches)
    {
      if (members.count(branch.points[branch.points.size() / 2]) > 0)
      {
        tree.inLoop[branch.groupId] = 1;
      }
    }
    tree.loops.push_back(out);
  }
}

void AssignStrahler(CenterlineTopology& tree, const std::vector<std::vector<int>>& daughters)
{
  for (std::size_t b = tree.branches.size(); b-- > 0;)
  {
    int order = 1;
    int same = 0;
    for (const int d : daughters[b])
    {
      const int below = tree.branches[d].strahlerOrder;
      same = below == order ? same + 1 : (below > order ? 1 : same);
      order = std::max(order, below);
    }
    tree.branches[b].strahlerOrder = order + (same > 1 ? 1 : 0);
  }
}

void ComputeGeometry(
  CenterlineTopology& tree, const CurveSmoothing& smoothing, const ProgressCallback& progress)
{
  const std::size_t n = tree.points.size();
  tree.tangent.assign(n, Vector3::UnitX());
  tree.normal.assign(n, Vector3::UnitY());
  tree.binormal.assign(n, Vector3::UnitZ());
  tree.curvature.assign(n, 0.0);
  tree.torsion.assign(n, 0.0);
  tree.area.resize(n);
  for (std::size_t i = 0; i < n; ++i)
  {
    tree.area[i] = Pi * tree.radius[i] * tree.radius[i];
  }
  // Whole vessels, so that a bifurcation on the way does not disturb their geometry.
  std::vector<int> heads;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.parentGroupId < 0 || tree.continuation[branch.parentGroupId] != branch.groupId)
    {
      heads.push_back(branch.groupId);
    }
  }
  struct Course
  {
    std::vector<std::int64_t> points;
    CurveGeometry curve;
  };
  std::vector<Course> courses(heads.size());
  ParallelFor(
    static_cast<std::int64_t>(heads.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t h = first; h < last; ++h)
      {
        std::vector<std::int64_t>& way = courses[h].points;
        for (int b = heads[h]; b >= 0; b = tree.continuation[b])
        {
          const auto& points = tree.branches[b].points;
          way.insert(way.end(), points.begin() + (way.empty() ? 0 : 1), points.end());
        }
        std::vector<Vector3> positions;
        std::vector<double> radii;
        for (const std::int64_t point : way)
        {
          positions.push_back(tree.points[point]);
          radii.push_back(tree.radius[point]);
        }
        CurveSmoothing used = smoothing;
        // Bends shorter than two diameters are the detector's, not the vessel's.
        used.minimumWavelength = std::max(used.minimumWavelength, 4.0 * MedianOf(radii));
        courses[h].curve = ComputeCurveGeometry(positions, used);
      }
    },
    progress);
  // One after another: two vessels that begin at one root share its point.
  for (std::size_t h = 0; h < heads.size(); ++h)
  {
    const auto& [way, curve] = courses[h];
    // A daughter's first point is its parent's.
    const bool root = tree.branches[heads[h]].parentGroupId < 0;
    for (std::size_t i = root ? 0 : 1; i < way.size(); ++i)
    {
      tree.tangent[way[i]] = curve.tangent[i];
      tree.normal[way[i]] = curve.normal[i];
      tree.binormal[way[i]] = curve.binormal[i];
      tree.curvature[way[i]] = curve.curvature[i];
      tree.torsion[way[i]] = curve.torsion[i];
    }
  }
}
}

void TopologySettings::Validate() const
{
  Require(this->gapRatio >= 0.0 && this->gapRatio <= 20.0, "The gap ratio must be from 0 to 20");
  Require(
    this->mergeRatio >= 0.0 && this->mergeRatio <= 1.0, "The merge ratio must be from 0 to 1");
  Require(
    this->pruneRatio >= 0.0 && this->pruneRatio <= 100.0, "The prune ratio must be from 0 to 100");
  Require(this->murrayExponent >= 0.5 && this->murrayExponent <= 10.0,
    "Murray's exponent must be from 0.5 to 10");
  Require(std::isfinite(this->smoothing.wavelength),
    "The wavelength of the smoothing must be a finite number");
  Require(std::isfinite(this->smoothing.minimumWavelength),
    "The least wavelength of the smoothing must be a finite number");
}

CenterlineTopology BuildTopology(const Polylines& lines, const TopologySettings& settings,
  const std::vector<Vector3>& roots, const ProgressCallback& progress)
{
  settings.Validate();
  Check(lines, roots);
  CenterlineTopology tree;
  const double radius = CheckedMedianRadius(lines);
  if (radius <= 0.0)
  {
    tree.fittedExponent = std::numeric_limits<double>::quiet_NaN();
    return tree;
  }
  LineGraph graph;
  graph.cellSize = 2.0 * radius;
  tree.mergedPoints = InsertLines(graph, lines, settings.mergeRatio, radius, progress);
  tree.closedGaps = CloseGaps(graph, settings.gapRatio);
  const std::vector<int> starts = FindRoots(graph, roots);
  std::vector<std::vector<int>> loops;
  std::vector<DraftBranch> drafts;
  for (std::size_t r = 0; r < starts.size(); ++r)
  {
    CutLoops(graph, starts[r], loops);
    DraftTree(graph, starts[r], static_cast<int>(r), drafts);
  }
  Prune(graph, settings.pruneRatio, drafts, tree.prunedTwigs, tree.prunedLength);
  Report(progress, 0.5);

  // The order needs courses and calibres: for that the branches exist twice for a moment.
  std::vector<int> indexOf(drafts.size(), -1);
  const std::vector<int> which = LivingDrafts(drafts);
  FillBranches(tree, graph, drafts, which, indexOf);
  const std::vector<std::int64_t> index =
    FillBranches(tree, graph, drafts, DepthFirst(tree, drafts, which, indexOf), indexOf);
  const std::vector<std::vector<int>> daughters = LinkBranches(tree);
  AssignStrahler(tree, daughters);
  AddLoops(tree, graph, loops, index);
  ComputeGeometry(tree, settings.smoothing,
    progress ? [&](double fraction) { return progress(0.5 + 0.45 * fraction); }
             : ProgressCallback());
  DescribeBifurcations(tree, daughters, settings.murrayExponent);
  tree.segmentId.assign(tree.points.size(), 0);
  Report(progress, 1.0);
  return tree;
}
}
