#include "BranchMetrics.h"

#include "PartialProgress.h"
#include "Require.h"
#include "SurfaceEnds.h" // for MergeCoincidentPoints
#include "TriangleBvh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace coronary
{
namespace
{
double LengthOf(const std::vector<Vector3>& points)
{
  double length = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i)
  {
    length += (points[i] - points[i - 1]).norm();
  }
  return length;
}

void Check(const Polylines& set, const std::string& side)
{
  const auto count = static_cast<std::int64_t>(set.points.size());
  Require(set.radius.empty() || set.radius.size() == set.points.size(),
    side + " has another number of radii than of points");
  Require(set.groups.empty() || set.groups.size() == set.lines.size(),
    side + " has another number of groups than of lines");
  for (std::size_t i = 0; i < set.lines.size(); ++i)
  {
    for (const std::int64_t point : set.lines[i])
    {
      Require(point >= 0 && point < count,
        "line " + std::to_string(i) + " of " + side + " refers to point " + std::to_string(point) +
          " of " + std::to_string(count));
      Require(set.points[point].allFinite(),
        "point " + std::to_string(point) + " of " + side + " is not finite");
      Require(set.radius.empty() || (std::isfinite(set.radius[point]) && set.radius[point] >= 0.0),
        "the radius of point " + std::to_string(point) + " of " + side +
          " is negative or not finite");
    }
  }
}

/// The lines as a graph of places.
class TreeGraph
{
public:
  explicit TreeGraph(const Polylines& tree)
    : Tree(tree)
    , Place(MergeCoincidentPoints(tree.points))
  {
    for (std::size_t line = 0; line < tree.lines.size(); ++line)
    {
      const std::vector<std::int64_t>& points = tree.lines[line];
      for (std::size_t i = 1; i < points.size(); ++i)
      {
        const std::int32_t from = this->Place[points[i - 1]];
        const std::int32_t to = this->Place[points[i]];
        if (from != to && this->Known.insert(std::minmax(from, to)).second)
        {
          this->Next[from].push_back({ to, line });
          this->Previous[to].push_back(from);
          this->Next.try_emplace(to);
          this->Previous.try_emplace(from);
        }
      }
    }
  }

  std::vector<TreeBranch> Branches(double minimumLength)
  {
    for (;;)
    {
      const std::vector<Chain> chains = this->Chains();
      std::vector<const Chain*> twigs;
      for (const Chain& chain : chains)
      {
        const bool ends = this->Next.at(chain.places.back()).empty() &&
          this->Previous.at(chain.places.back()).size() == 1;
        const bool begins = this->Previous.at(chain.places.front()).empty() &&
          this->Next.at(chain.places.front()).size() == 1;
        if (ends && !begins && this->LengthOfChain(chain) < minimumLength)
        {
          twigs.push_back(&chain);
        }
      }
      if (twigs.empty())
      {
        std::vector<TreeBranch> branches;
        branches.reserve(chains.size());
        for (const Chain& chain : chains)
        {
          branches.push_back(this->BranchOf(chain));
        }
        return branches;
      }
      // Of twigs at one fork the shortest goes first: what is left of the fork may be one branch then.
      std::map<std::int32_t, const Chain*> shortest;
      for (const Chain* twig : twigs)
      {
        const Chain*& best = shortest[twig->places.front()];
        if (best == nullptr || this->LengthOfChain(*twig) < this->LengthOfChain(*best))
        {
          best = twig;
        }
      }
      for (const auto& [place, twig] : shortest)
      {
        this->Remove(*twig);
      }
    }
  }

private:
  struct Step
  {
    std::int32_t to;
    std::size_t line;
  };
  struct Chain
  {
    std::vector<std::int32_t> places;
    std::vector<std::size_t> lines; ///< of each step
  };

  bool Passes(std::int32_t place) const
  {
    return this->Next.at(place).size() == 1 && this->Previous.at(place).size() == 1;
  }

  double LengthOfChain(const Chain& chain) const
  {
    double length = 0.0;
    for (std::size_t i = 1; i < chain.places.size(); ++i)
    {
      length +=
        (this->Tree.points[chain.places[i]] - this->Tree.points[chain.places[i - 1]]).norm();
    }
    return length;
  }

  std::vector<Chain> Chains() const
  {
    std::vector<Chain> chains;
    std::set<std::int32_t> passed;
    const auto follow = [&](std::int32_t from, const Step& first)
    {
      Chain chain;
      chain.places = { from, first.to };
      chain.lines = { first.line };
      while (this->Passes(chain.places.back()) && chain.places.back() != from)
      {
        passed.insert(chain.places.back());
        const Step& step = this->Next.at(chain.places.back()).front();
        chain.places.push_back(step.to);
        chain.lines.push_back(step.line);
      }
      chains.push_back(std::move(chain));
    };
    for (const auto& [place, steps] : this->Next)
    {
      if (!this->Passes(place))
      {
        for (const Step& step : steps)
        {
          follow(place, step);
        }
      }
    }
    // Rings without a fork.
    for (const auto& [place, steps] : this->Next)
    {
      if (this->Passes(place) && passed.count(place) == 0)
      {
        passed.insert(place);
        follow(place, steps.front());
      }
    }
    // In the order of their lines, as they were given.
    std::stable_sort(chains.begin(), chains.end(),
      [](const Chain& s, const Chain& t) { return s.lines.front() < t.lines.front(); });
    return chains;
  }

  TreeBranch BranchOf(const Chain& chain) const
  {
    TreeBranch branch;
    std::map<std::size_t, double> share;
    for (std::size_t i = 0; i < chain.places.size(); ++i)
    {
      branch.points.push_back(this->Tree.points[chain.places[i]]);
      if (!this->Tree.radius.empty())
      {
        branch.radius.push_back(this->Tree.radius[chain.places[i]]);
      }
      if (i > 0)
      {
        share[chain.lines[i - 1]] += (branch.points[i] - branch.points[i - 1]).norm();
      }
    }
    branch.length = LengthOf(branch.points);
    const std::size_t line = std::max_element(share.begin(), share.end(),
      [](const auto& s, const auto& t) {
        return s.second < t.second;
      })->first;
    branch.group =
      this->Tree.groups.empty() ? static_cast<std::int64_t>(line) : this->Tree.groups[line];
    branch.isRoot = this->Previous.at(chain.places.front()).empty();
    return branch;
  }

  void Remove(const Chain& chain)
  {
    for (std::size_t i = 1; i < chain.places.size(); ++i)
    {
      const std::int32_t from = chain.places[i - 1];
      const std::int32_t to = chain.places[i];
      std::vector<Step>& next = this->Next[from];
      next.erase(
        std::find_if(next.begin(), next.end(), [&](const Step& step) { return step.to == to; }));
      std::vector<std::int32_t>& previous = this->Previous[to];
      previous.erase(std::find(previous.begin(), previous.end(), from));
    }
    for (std::size_t i = 1; i < chain.places.size(); ++i)
    {
      if (this->Next[chain.places[i]].empty() && this->Previous[chain.places[i]].empty())
      {
        this->Next.erase(chain.places[i]);
        this->Previous.erase(chain.places[i]);
      }
    }
  }

  const Polylines& Tree;
  std::vector<std::int32_t> Place;
  std::set<std::pair<std::int32_t, std::int32_t>> Known;
  std::map<std::int32_t, std::vector<Step>> Next;
  std::map<std::int32_t, std::vector<std::int32_t>> Previous;
};

/// Samples of all branches of a side: the middles of equal steps.
struct Samples
{
  std::vector<Vector3> points;
  std::vector<double> tolerance;
  std::vector<double> length;       ///< that each stands for
  std::vector<std::int64_t> branch; ///< ascending
  std::vector<std::size_t> first;   ///< of each branch, and the end
};

Samples SampleBranches(
  const std::vector<TreeBranch>& branches, const BranchMetricsSettings& settings)
{
  Samples samples;
  for (std::size_t b = 0; b < branches.size(); ++b)
  {
    const TreeBranch& branch = branches[b];
    samples.first.push_back(samples.points.size());
    const auto count = std::max<std::int64_t>(1, std::llround(branch.length / settings.spacing));
    const double step = branch.length / static_cast<double>(count);
    std::size_t segment = 1;
    double passed = 0.0;
    double size = (branch.points[1] - branch.points[0]).norm();
    for (std::int64_t i = 0; i < count; ++i)
    {
      const double at = (static_cast<double>(i) + 0.5) * step;
      while (passed + size < at && segment + 1 < branch.points.size())
      {
        passed += size;
        ++segment;
        size = (branch.points[segment] - branch.points[segment - 1]).norm();
      }
      const double t = size > 0.0 ? std::clamp((at - passed) / size, 0.0, 1.0) : 0.0;
      samples.points.emplace_back(
        (1.0 - t) * branch.points[segment - 1] + t * branch.points[segment]);
      const double radius = branch.radius.empty()
        ? 0.0
        : (1.0 - t) * branch.radius[segment - 1] + t * branch.radius[segment];
      samples.tolerance.push_back(std::max(settings.tolerance, radius));
      samples.length.push_back(step);
      samples.branch.push_back(static_cast<std::int64_t>(b));
    }
  }
  samples.first.push_back(samples.points.size());
  return samples;
}

/// The segments of all branches: a tree of triangles without area.
class BranchLocator
{
public:
  explicit BranchLocator(const std::vector<TreeBranch>& branches)
  {
    std::vector<Vector3> points;
    std::vector<Triangle> segments;
    for (std::size_t b = 0; b < branches.size(); ++b)
    {
      for (std::size_t i = 0; i < branches[b].points.size(); ++i)
      {
        points.push_back(branches[b].points[i]);
        this->Radius.push_back(branches[b].radius.empty() ? 0.0 : branches[b].radius[i]);
        if (i > 0)
        {
          const auto last = static_cast<std::int64_t>(points.size()) - 1;
          segments.push_back({ last - 1, last, last });
          this->Branch.push_back(static_cast<std::int64_t>(b));
        }
      }
    }
    this->Ends = segments;
    this->Points = points;
    this->Tree = TriangleBvh(points, segments);
  }

  struct Found
  {
    std::int64_t branch = -1;
    double distance = std::numeric_limits<double>::infinity();
    double radius = 0.0;
  };

  Found Nearest(const Vector3& p) const
  {
    const TriangleBvh::Nearest nearest = this->Tree.Closest(p);
    if (nearest.triangle < 0)
    {
      return {};
    }
    const Triangle& ends = this->Ends[nearest.triangle];
    const double size = (this->Points[ends[1]] - this->Points[ends[0]]).norm();
    const double t = size > 0.0 ? (nearest.point - this->Points[ends[0]]).norm() / size : 0.0;
    return { this->Branch[nearest.triangle], nearest.distance,
      (1.0 - t) * this->Radius[ends[0]] + t * this->Radius[ends[1]] };
  }

private:
  std::vector<Vector3> Points;
  std::vector<double> Radius;
  std::vector<Triangle> Ends;
  std::vector<std::int64_t> Branch;
  TriangleBvh Tree;
};

/// Which column each row goes with so that the sum of the gains is greatest; -1: none. Source: Kuhn, The
/// Hungarian method for the assignment problem, Naval Research Logistics 1955;2:83, with potentials.
std::vector<std::int64_t> Assign(const Eigen::MatrixXd& gain)
{
  const Eigen::Index n = std::max(gain.rows(), gain.cols());
  Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(n, n);
  cost.topLeftCorner(gain.rows(), gain.cols()) = -gain;
  std::vector<double> rowPotential(n + 1, 0.0);
  std::vector<double> columnPotential(n + 1, 0.0);
  std::vector<Eigen::Index> rowOf(n + 1, 0); // of each column, from 1; 0: free
  std::vector<Eigen::Index> before(n + 1, 0);
  for (Eigen::Index row = 1; row <= n; ++row)
  {
    rowOf[0] = row;
    Eigen::Index column = 0;
    std::vector<double> slack(n + 1, std::numeric_limits<double>::infinity());
    std::vector<std::uint8_t> used(n + 1, 0);
    do
    {
      used[column] = 1;
      const Eigen::Index current = rowOf[column];
      double minimum = std::numeric_limits<double>::infinity();
      Eigen::Index next = 0;
      for (Eigen::Index j = 1; j <= n; ++j)
      {
        if (used[j] == 0)
        {
          const double reduced =
            cost(current - 1, j - 1) - rowPotential[current] - columnPotential[j];
          if (reduced < slack[j])
          {
            slack[j] = reduced;
            before[j] = column;
          }
          if (slack[j] < minimum)
          {
            minimum = slack[j];
            next = j;
          }
        }
      }
      for (Eigen::Index j = 0; j <= n; ++j)
      {
        if (used[j] != 0)
        {
          rowPotential[rowOf[j]] += minimum;
          columnPotential[j] -= minimum;
        }
        else
        {
          slack[j] -= minimum;
        }
      }
      column = next;
    } while (rowOf[column] != 0);
    do
    {
      const Eigen::Index next = before[column];
      rowOf[column] = rowOf[next];
      column = next;
    } while (column != 0);
  }
  std::vector<std::int64_t> columnOf(gain.rows(), -1);
  for (Eigen::Index j = 1; j <= gain.cols(); ++j)
  {
    if (rowOf[j] >= 1 && rowOf[j] <= gain.rows())
    {
      columnOf[rowOf[j] - 1] = j - 1;
    }
  }
  return columnOf;
}

/// The branches as lines again, for the overlap measures.
Polylines LinesOf(const std::vector<TreeBranch>& branches, double tolerance, bool needsRadius)
{
  Polylines set;
  for (const TreeBranch& branch : branches)
  {
    set.lines.emplace_back();
    for (std::size_t i = 0; i < branch.points.size(); ++i)
    {
      set.lines.back().push_back(static_cast<std::int64_t>(set.points.size()));
      set.points.push_back(branch.points[i]);
      if (!branch.radius.empty() || needsRadius)
      {
        set.radius.push_back(branch.radius.empty() ? tolerance : branch.radius[i]);
      }
    }
  }
  if (set.radius.size() != set.points.size())
  {
    set.radius.clear();
  }
  return set;
}

/// Nearest places of another tree's branches.
std::vector<BranchLocator::Found> Locate(const Samples& samples, const BranchLocator& locator)
{
  std::vector<BranchLocator::Found> found(samples.points.size());
  ParallelFor(static_cast<std::int64_t>(found.size()), 512,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        found[i] = locator.Nearest(samples.points[i]);
      }
    });
  return found;
}

/// Common length by that of both branches; 0 below the gate, which is no match, and must not keep a
/// branch from another one.
Eigen::MatrixXd OverlapOf(const Eigen::MatrixXd& common, const BranchMetrics& metrics, double gate)
{
  Eigen::MatrixXd overlap(common.rows(), common.cols());
  for (Eigen::Index r = 0; r < common.rows(); ++r)
  {
    for (Eigen::Index i = 0; i < common.cols(); ++i)
    {
      const double share = common(r, i) / (metrics.reference[r].length + metrics.result[i].length);
      overlap(r, i) = share >= gate && share > 0.0 ? share : 0.0;
    }
  }
  return overlap;
}
}

void BranchMetricsSettings::Validate() const
{
  const auto share = [](double value) { return value >= 0.0 && value <= 1.0; };
  Require(
    spacing > 0.0 && std::isfinite(spacing), "BranchMetricsSettings: spacing must be positive");
  Require(tolerance > 0.0 && std::isfinite(tolerance),
    "BranchMetricsSettings: tolerance must be positive");
  Require(share(detectedShare), "BranchMetricsSettings: detectedShare must be from 0 to 1");
  Require(share(overlapGate), "BranchMetricsSettings: overlapGate must be from 0 to 1");
  Require(minimumLength >= 0.0 && std::isfinite(minimumLength),
    "BranchMetricsSettings: minimumLength must be 0 or more");
}

std::vector<TreeBranch> FindBranches(const Polylines& tree, const BranchMetricsSettings& settings)
{
  settings.Validate();
  Check(tree, "the tree");
  if (!settings.linesAreBranches)
  {
    return TreeGraph(tree).Branches(settings.minimumLength);
  }
  std::vector<TreeBranch> branches;
  std::set<std::int32_t> inner;
  const std::vector<std::int32_t> place = MergeCoincidentPoints(tree.points);
  for (const std::vector<std::int64_t>& line : tree.lines)
  {
    for (std::size_t i = 1; i < line.size(); ++i)
    {
      inner.insert(place[line[i]]);
    }
  }
  for (std::size_t i = 0; i < tree.lines.size(); ++i)
  {
    TreeBranch branch;
    for (const std::int64_t point : tree.lines[i])
    {
      branch.points.push_back(tree.points[point]);
      if (!tree.radius.empty())
      {
        branch.radius.push_back(tree.radius[point]);
      }
    }
    branch.length = LengthOf(branch.points);
    branch.group = tree.groups.empty() ? static_cast<std::int64_t>(i) : tree.groups[i];
    if (branch.points.size() > 1 && branch.length > 0.0 && branch.length >= settings.minimumLength)
    {
      branch.isRoot = inner.count(place[tree.lines[i].front()]) == 0;
      branches.push_back(std::move(branch));
    }
  }
  return branches;
}

Polylines TreeOfSurface(const std::vector<Vector3>& points, const std::vector<std::int64_t>& group,
  const std::vector<double>& abscissa, double spacing)
{
  Require(group.size() == points.size() && abscissa.size() == points.size(),
    "a surface's points need a group and an abscissa each");
  Require(spacing > 0.0 && std::isfinite(spacing), "the spacing must be positive");
  struct Slice
  {
    Vector3 sum = Vector3::Zero();
    double abscissa = 0.0;
    std::vector<std::size_t> points;
  };
  std::map<std::int64_t, std::map<std::int64_t, Slice>> slices;
  std::map<std::int64_t, std::pair<double, double>> ends;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    Require(points[i].allFinite() && std::isfinite(abscissa[i]) && std::abs(abscissa[i]) < 1e12,
      "point " + std::to_string(i) + " of a surface, or its abscissa, is not finite");
    const auto [end, isNew] = ends.try_emplace(group[i], abscissa[i], abscissa[i]);
    end->second.first = std::min(end->second.first, abscissa[i]);
    end->second.second = std::max(end->second.second, abscissa[i]);
  }
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    const auto& [first, last] = ends[group[i]];
    const double count = std::max(1.0, std::round((last - first) / spacing));
    const double width = (last - first) / count;
    const auto number = width > 0.0
      ? static_cast<std::int64_t>(std::min(count - 1.0, std::floor((abscissa[i] - first) / width)))
      : 0;
    Slice& slice = slices[group[i]][number];
    slice.sum += points[i];
    slice.abscissa += abscissa[i];
    slice.points.push_back(i);
  }
  Polylines tree;
  for (const auto& [id, ofGroup] : slices)
  {
    if (ofGroup.size() < 2)
    {
      continue;
    }
    const auto firstPoint = static_cast<std::int64_t>(tree.points.size());
    std::vector<double> where;
    for (const auto& [number, slice] : ofGroup)
    {
      const auto count = static_cast<double>(slice.points.size());
      const Vector3 middle = slice.sum / count;
      double radius = 0.0;
      for (const std::size_t i : slice.points)
      {
        radius += (points[i] - middle).norm() / count;
      }
      tree.points.push_back(middle);
      tree.radius.push_back(radius);
      where.push_back(slice.abscissa / count);
    }
    // The slices' middles lie half a slice inside of the ends: the line goes on straight to these.
    const auto [minimum, maximum] = ends[id];
    const auto extend = [&, first = minimum, last = maximum](bool atEnd)
    {
      const std::int64_t size = static_cast<std::int64_t>(tree.points.size()) - firstPoint;
      const std::int64_t a = atEnd ? size - 1 : 0;
      const std::int64_t b = atEnd ? size - 2 : 1;
      const double gap = atEnd ? last - where[a] : where[a] - first;
      const double apart = std::abs(where[a] - where[b]);
      const Vector3 end = tree.points[firstPoint + a];
      return apart > 0.0 ? Vector3(end + gap / apart * (end - tree.points[firstPoint + b])) : end;
    };
    const Vector3 begin = extend(false);
    const Vector3 finish = extend(true);
    tree.points[firstPoint] = begin;
    tree.points.back() = finish;
    tree.lines.emplace_back();
    for (auto p = firstPoint; p < static_cast<std::int64_t>(tree.points.size()); ++p)
    {
      tree.lines.back().push_back(p);
    }
    tree.groups.push_back(id);
  }
  return tree;
}

BranchMetrics CompareBranches(const Polylines& result, const Polylines& reference,
  const BranchMetricsSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  Check(result, "the result");
  Check(reference, "the reference");
  Report(progress, 0.0);
  BranchMetrics metrics;
  metrics.result = FindBranches(result, settings);
  metrics.reference = FindBranches(reference, settings);
  const WorkParts work(progress, { 1.0, 3.0 });
  const auto countI = static_cast<Eigen::Index>(metrics.result.size());
  const auto countR = static_cast<Eigen::Index>(metrics.reference.size());
  const Samples samplesI = SampleBranches(metrics.result, settings);
  const Samples samplesR = SampleBranches(metrics.reference, settings);
  const BranchLocator locatorI(metrics.result);
  const BranchLocator locatorR(metrics.reference);
  const std::vector<BranchLocator::Found> foundR = Locate(samplesR, locatorI);
  const std::vector<BranchLocator::Found> foundI = Locate(samplesI, locatorR);

  Eigen::MatrixXd common = Eigen::MatrixXd::Zero(countR, countI);
  const auto nearR = [&](std::size_t i) { return foundR[i].distance <= samplesR.tolerance[i]; };
  // Of the result's sample the radius of the reference decides, as on the other side.
  const auto nearI = [&](std::size_t i)
  { return foundI[i].distance <= std::max(settings.tolerance, foundI[i].radius); };
  for (std::size_t i = 0; i < foundR.size(); ++i)
  {
    if (nearR(i))
    {
      common(samplesR.branch[i], foundR[i].branch) += samplesR.length[i];
    }
  }
  for (std::size_t i = 0; i < foundI.size(); ++i)
  {
    if (nearI(i))
    {
      common(foundI[i].branch, samplesI.branch[i]) += samplesI.length[i];
    }
    else
    {
      metrics.falseLength += samplesI.length[i];
    }
  }
  const Eigen::MatrixXd overlap = OverlapOf(common, metrics, settings.overlapGate);
  const std::vector<std::int64_t> matchOf =
    countR > 0 && countI > 0 ? Assign(overlap) : std::vector<std::int64_t>(countR, -1);
  Report(work(0), 1.0);

  std::vector<std::uint8_t> isMatched(countI, 0);
  double ratios = 0.0;
  double continuity = 0.0;
  double covered = 0.0;
  double length = 0.0;
  for (Eigen::Index r = 0; r < countR; ++r)
  {
    const TreeBranch& branch = metrics.reference[r];
    BranchAgreement row;
    row.reference = r;
    if (matchOf[r] >= 0 && overlap(r, matchOf[r]) > 0.0)
    {
      row.result = matchOf[r];
      row.overlap = overlap(r, row.result);
      row.lengthRatio = metrics.result[row.result].length / branch.length;
      isMatched[row.result] = 1;
      ratios += row.lengthRatio;
      ++metrics.matched;
    }
    double gap = 0.0;
    double missing = 0.0;
    double begins = std::numeric_limits<double>::infinity(); // way to the first covered sample
    double way = 0.0;
    for (std::size_t i = samplesR.first[r]; i < samplesR.first[r + 1]; ++i)
    {
      if (nearR(i))
      {
        gap = 0.0;
        begins = std::min(begins, way);
      }
      else
      {
        gap += samplesR.length[i];
        missing += samplesR.length[i];
        row.longestGap = std::max(row.longestGap, gap);
      }
      way += samplesR.length[i];
    }
    row.covered = std::max(0.0, 1.0 - missing / branch.length);
    // Up to rounding: the samples' lengths are added up.
    row.detected = row.covered >= settings.detectedShare - 1e-9;
    // A branch that hangs on nothing is not continuous; a root has nothing to hang on.
    const bool hangs = branch.isRoot || begins <= samplesR.tolerance[samplesR.first[r]];
    row.continuity = hangs ? row.covered : 0.0;
    metrics.detected += row.detected ? 1 : 0;
    continuity += row.continuity;
    covered += row.covered * branch.length;
    length += branch.length;
    metrics.rows.push_back(row);
  }
  for (Eigen::Index i = 0; i < countI; ++i)
  {
    double own = 0.0;
    for (std::size_t s = samplesI.first[i]; s < samplesI.first[i + 1]; ++s)
    {
      own += nearI(s) ? samplesI.length[s] : 0.0;
    }
    const double share = std::min(1.0, own / metrics.result[i].length);
    metrics.falseBranches += share < settings.detectedShare - 1e-9 ? 1 : 0;
    if (isMatched[i] == 0)
    {
      BranchAgreement row;
      row.result = i;
      row.covered = share;
      metrics.rows.push_back(row);
    }
  }
  if (countR > 0)
  {
    const auto number = static_cast<double>(countR);
    metrics.completenessRatio = static_cast<double>(countI) / number;
    metrics.boundedCompleteness = static_cast<double>(metrics.detected) / number;
    metrics.boundedContinuity = continuity / number;
    metrics.lengthDetected = covered / length;
  }
  if (countI > 0 && countR > 0)
  {
    metrics.continuityScore = ratios / static_cast<double>(countI);
  }
  if (metrics.matched > 0)
  {
    metrics.matchedLengthRatio = ratios / static_cast<double>(metrics.matched);
  }
  metrics.overlap = CompareCenterlineTrees(LinesOf(metrics.reference, settings.tolerance, true),
    LinesOf(metrics.result, settings.tolerance, false), CenterlineOverlapSettings(), work(1))
                      .total;
  return metrics;
}
}
