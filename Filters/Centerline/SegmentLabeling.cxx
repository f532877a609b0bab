#include "SegmentLabeling.h"

#include "LabelPieces.h"
#include "Numbers.h"
#include "SegmentAtlas.h"
#include "SegmentNaming.h"
#include "TreeAssignment.h"
#include "VesselPriors.h"

#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double Correlation = 10.0; ///< length of vessel that counts as one observation
constexpr double CourseWeight = 1.0; ///< of 1 - cos(angle between courses)
constexpr double Unnamed = 2.2;      ///< cost of an observation on a vessel without a name

class Labeler
{
public:
  Labeler(CenterlineTopology& tree, const LabelingSettings& settings)
    : Tree(tree)
    , Settings(settings)
    , Atlas(SegmentAtlas::Get())
    , Pieces(tree)
  {
  }

  LabelingResult Run(const ProgressCallback& progress);

private:
  struct Candidate
  {
    AtlasPose pose;
    std::vector<TreeSide> sides; ///< of the trees that took part; the others' are chosen later
    double cost = Infinity;
  };

  std::vector<Candidate> FindPoses(const ProgressCallback& progress);
  Candidate Align(
    const std::vector<int>& trees, const std::vector<TreeSide>& sides, double spin) const;
  double RotationCost(const AtlasPose& pose) const;
  std::vector<VesselCosts> Compare(const AtlasPose& pose) const;
  LabelAssignment Assign(
    const AtlasPose& pose, const std::vector<TreeSide>& fixed, Dominance dominance) const;
  AtlasPose Refine(const AtlasPose& pose, const LabelAssignment& assignment) const;
  void ApplyDefinitions(LabelAssignment& assignment) const;

  CenterlineTopology& Tree;
  const LabelingSettings& Settings;
  const SegmentAtlas& Atlas;
  LabelPieces Pieces;
};

double Labeler::RotationCost(const AtlasPose& pose) const
{
  const double size = std::cbrt(std::abs(pose.matrix.determinant()));
  const Matrix3 rotation = pose.matrix / size;
  const double angle = std::acos(std::clamp(0.5 * (rotation.trace() - 1.0), -1.0, 1.0));
  const double turns = angle / (50.0 * Pi / 180.0);
  const double growth = std::log(size) / 0.15;
  // Limited: a clear shape decides against the orientation.
  return this->Settings.orientationWeight * std::min(1.5, 0.5 * turns * turns) +
    0.5 * growth * growth;
}

Labeler::Candidate Labeler::Align(
  const std::vector<int>& trees, const std::vector<TreeSide>& sides, double spin) const
{
  Candidate candidate;
  candidate.sides.assign(this->Pieces.roots.size(), TreeSide::Neither);
  bool used[2] = { false, false };
  Vector3 from = Vector3::Zero();
  Vector3 to = Vector3::Zero();
  for (std::size_t i = 0; i < trees.size(); ++i)
  {
    candidate.sides[trees[i]] = sides[i];
    used[sides[i] == TreeSide::Right] = true;
    from += this->Pieces.rootPosition[trees[i]] / static_cast<double>(trees.size());
    to += (sides[i] == TreeSide::Left ? this->Atlas.leftOstium : this->Atlas.rightOstium) /
      static_cast<double>(trees.size());
  }
  Vector3 centre = Vector3::Zero();
  double weights = 0.0;
  std::vector<const LabelSample*> samples;
  for (std::size_t i = 0; i < this->Pieces.samples.size(); i += 2)
  {
    const LabelSample& sample = this->Pieces.samples[i];
    if (candidate.sides[sample.tree] != TreeSide::Neither)
    {
      samples.push_back(&sample);
      centre += sample.weight * sample.position;
      weights += sample.weight;
    }
  }
  centre /= weights;
  std::vector<const SegmentAtlas::Point*> targets[2];
  Vector3 atlasCentre = Vector3::Zero();
  double atlasCount = 0.0;
  for (const SegmentAtlas::Point& point : this->Atlas.points)
  {
    const int side = IsLeft(point.vessel) ? 0 : 1;
    if (used[side])
    {
      targets[side].push_back(&point);
      atlasCentre += point.position;
      atlasCount += 1.0;
    }
  }
  atlasCentre /= atlasCount;

  // Axis from the roots to the middle of the trees onto the atlas', turned about it.
  Vector3 axis = centre - from;
  Vector3 atlasAxis = atlasCentre - to;
  axis = axis.norm() > 1e-9 ? Vector3(axis.normalized()) : Vector3(Vector3::UnitX());
  atlasAxis.normalize();
  const auto basis = [](const Vector3& a)
  {
    Matrix3 m;
    m.row(0) = a;
    m.row(1) = a.unitOrthogonal();
    m.row(2) = a.cross(Vector3(m.row(1)));
    return m;
  };
  AtlasPose& pose = candidate.pose;
  pose.matrix = basis(atlasAxis).transpose() *
    Eigen::AngleAxisd(spin, Vector3::UnitX()).toRotationMatrix() * basis(axis);
  pose.shift = 0.5 * (to + atlasCentre) - pose.matrix * (0.5 * (from + centre));

  constexpr int rounds = 30;
  double residual = 0.0;
  for (int round = 0; round <= rounds; ++round)
  {
    const double scale = std::max(8.0, 35.0 * std::pow(0.9, round));
    Vector3 meanX = Vector3::Zero();
    Vector3 meanY = Vector3::Zero();
    double sum = 0.0;
    residual = 0.0;
    std::vector<std::tuple<double, Vector3, Vector3>> pairs;
    const auto pair = [&](const Vector3& x, const Vector3& y, double w)
    {
      pairs.emplace_back(w, x, y);
      meanX += w * x;
      meanY += w * y;
      sum += w;
    };
    for (const LabelSample* sample : samples)
    {
      const Vector3 at = pose.Apply(sample->position);
      double best = Infinity;
      const SegmentAtlas::Point* nearest = nullptr;
      for (const SegmentAtlas::Point* point :
        targets[candidate.sides[sample->tree] == TreeSide::Right])
      {
        const double squared = (point->position - at).squaredNorm();
        if (squared < best)
        {
          best = squared;
          nearest = point;
        }
      }
      const double ratio = best / (scale * scale);
      pair(sample->position, nearest->position, sample->weight / ((1.0 + ratio) * (1.0 + ratio)));
      const Vector3 course = (pose.matrix * sample->tangent).normalized();
      residual += sample->weight / weights *
        std::min(MaximumObservationCost,
          best / (2.0 * PositionDeviation * PositionDeviation) +
            CourseWeight * (1.0 - course.dot(nearest->tangent)));
    }
    for (std::size_t i = 0; i < trees.size(); ++i)
    {
      const Vector3 ostium =
        sides[i] == TreeSide::Left ? this->Atlas.leftOstium : this->Atlas.rightOstium;
      const double ratio =
        (pose.Apply(this->Pieces.rootPosition[trees[i]]) - ostium).squaredNorm() /
        (4.0 * scale * scale);
      pair(this->Pieces.rootPosition[trees[i]], ostium,
        0.1 * weights / ((1.0 + ratio) * (1.0 + ratio)));
      residual += 0.1 * std::min(MaximumObservationCost, 2.0 * ratio);
    }
    if (round == rounds)
    {
      break;
    }
    meanX /= sum;
    meanY /= sum;
    Matrix3 covariance = Matrix3::Zero();
    double variance = 0.0;
    for (const auto& [w, x, y] : pairs)
    {
      covariance += w * (y - meanY) * (x - meanX).transpose();
      variance += w * (x - meanX).squaredNorm();
    }
    const Eigen::JacobiSVD<Matrix3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vector3 sign(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
    const Matrix3 rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    // A nearest-point fit likes to shrink: the size stays near that of a heart.
    const double size =
      std::clamp(svd.singularValues().dot(sign) / std::max(1e-12, variance), 0.72, 1.4);
    pose.matrix = size * rotation;
    pose.shift = meanY - pose.matrix * meanX;
  }
  candidate.cost = residual * weights / Correlation + this->RotationCost(pose);
  return candidate;
}

std::vector<Labeler::Candidate> Labeler::FindPoses(const ProgressCallback& progress)
{
  // The longest trees decide about the pose.
  std::vector<int> trees(this->Pieces.roots.size());
  std::iota(trees.begin(), trees.end(), 0);
  std::stable_sort(trees.begin(), trees.end(),
    [&](int a, int b) { return this->Pieces.treeLength[a] > this->Pieces.treeLength[b]; });
  while (trees.size() > 1 &&
    (trees.size() > 3 ||
      this->Pieces.treeLength[trees.back()] < 0.1 * this->Pieces.treeLength[trees.front()]))
  {
    trees.pop_back();
  }
  constexpr int spins = 12;
  const int cases = 1 << trees.size();
  std::vector<Candidate> candidates(static_cast<std::size_t>(cases) * spins);
  ParallelFor(
    static_cast<std::int64_t>(candidates.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        std::vector<TreeSide> sides;
        for (std::size_t t = 0; t < trees.size(); ++t)
        {
          sides.push_back(((i / spins) >> t & 1) == 0 ? TreeSide::Left : TreeSide::Right);
        }
        candidates[i] =
          this->Align(trees, sides, 2.0 * Pi * static_cast<double>(i % spins) / spins);
      }
    },
    progress);
  std::stable_sort(candidates.begin(), candidates.end(),
    [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  // Many starts end in the same place.
  std::vector<Candidate> distinct;
  for (const Candidate& candidate : candidates)
  {
    const bool known = std::any_of(distinct.begin(), distinct.end(),
      [&](const Candidate& other)
      {
        return other.sides == candidate.sides &&
          (other.pose.matrix - candidate.pose.matrix).norm() < 0.15;
      });
    if (!known)
    {
      distinct.push_back(candidate);
    }
    if (distinct.size() == 8)
    {
      break;
    }
  }
  return distinct;
}

std::vector<VesselCosts> Labeler::Compare(const AtlasPose& pose) const
{
  std::vector<VesselCosts> result(this->Pieces.pieces.size());
  for (std::size_t c = 0; c < this->Pieces.pieces.size(); ++c)
  {
    const LabelPiece& chunk = this->Pieces.pieces[c];
    VesselCosts mean{};
    for (std::size_t s = chunk.firstSample; s < chunk.lastSample; ++s)
    {
      const Vector3 at = pose.Apply(this->Pieces.samples[s].position);
      const Vector3 course = (pose.matrix * this->Pieces.samples[s].tangent).normalized();
      VesselCosts best;
      best.fill(MaximumObservationCost);
      for (const SegmentAtlas::Point& point : this->Atlas.points)
      {
        const double near =
          (point.position - at).squaredNorm() * (0.5 / (PositionDeviation * PositionDeviation));
        double& minimum = best[IndexOf(point.vessel)];
        if (near < minimum)
        {
          minimum = std::min(minimum, near + CourseWeight * (1.0 - course.dot(point.tangent)));
        }
      }
      best[IndexOf(Vessel::Other)] = Unnamed;
      for (int v = 0; v < NumberOfVessels; ++v)
      {
        mean[v] += best[v] / static_cast<double>(chunk.lastSample - chunk.firstSample);
      }
    }
    for (int v = 0; v < NumberOfVessels; ++v)
    {
      result[c][v] = mean[v] * chunk.length / Correlation;
    }
  }
  return result;
}

LabelAssignment Labeler::Assign(
  const AtlasPose& pose, const std::vector<TreeSide>& fixed, Dominance dominance) const
{
  const std::vector<VesselCosts> fit = this->Compare(pose);
  LabelAssignment result;
  result.dominance = dominance;
  result.vessels.assign(this->Pieces.pieces.size(), Vessel::Other);
  result.sides.assign(this->Pieces.roots.size(), TreeSide::Neither);
  result.cost = DominanceCost(dominance) + this->RotationCost(pose);
  std::vector<int> order(this->Pieces.roots.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
    [&](int a, int b) { return this->Pieces.treeLength[a] > this->Pieces.treeLength[b]; });
  // A trunk that one tree has is not looked for in another.
  std::uint32_t taken = 0;
  for (const int tree : order)
  {
    double best = Unnamed * this->Pieces.treeLength[tree] / Correlation + 3.0;
    std::vector<Vessel> vessels(this->Pieces.pieces.size(), Vessel::Other);
    std::vector<Vessel> chosen = vessels;
    TreeSide side = TreeSide::Neither;
    for (const TreeSide candidate : { TreeSide::Left, TreeSide::Right })
    {
      if (fixed[tree] != TreeSide::Neither && fixed[tree] != candidate)
      {
        continue;
      }
      const double cost =
        AssignTree(this->Tree, this->Pieces, tree, candidate, dominance, fit, taken, vessels);
      if (cost < best)
      {
        best = cost;
        side = candidate;
        chosen = vessels;
      }
    }
    result.cost += best;
    result.sides[tree] = side;
    std::map<Vessel, double> lengths;
    for (std::size_t c = 0; c < this->Pieces.pieces.size(); ++c)
    {
      if (this->Tree.branches[this->Pieces.pieces[c].branch].treeId == tree)
      {
        result.vessels[c] = side == TreeSide::Neither ? Vessel::Other : chosen[c];
        lengths[result.vessels[c]] += this->Pieces.pieces[c].length;
      }
    }
    for (const auto& [vessel, length] : lengths)
    {
      if (IsTrunk(vessel))
      {
        taken |= 1U << IndexOf(vessel);
      }
    }
  }
  return result;
}

AtlasPose Labeler::Refine(const AtlasPose& pose, const LabelAssignment& assignment) const
{
  // Linear least squares onto the nearest points of the vessels that the pieces were named after;
  // held near the similarity by a penalty on the change of the matrix.
  Eigen::Matrix<double, 4, 4> left = Eigen::Matrix<double, 4, 4>::Zero();
  Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
  double weights = 0.0;
  const auto add = [&](const Vector3& x, const Vector3& y, double w)
  {
    const Eigen::Vector4d row(x[0], x[1], x[2], 1.0);
    left += w * row * row.transpose();
    right += w * row * y.transpose();
    weights += w;
  };
  for (std::size_t c = 0; c < this->Pieces.pieces.size(); ++c)
  {
    const LabelPiece& chunk = this->Pieces.pieces[c];
    for (std::size_t s = chunk.firstSample; s < chunk.lastSample; ++s)
    {
      const LabelSample& sample = this->Pieces.samples[s];
      const Vector3 at = pose.Apply(sample.position);
      const auto [nearest, best] = this->Atlas.NearestOf(assignment.vessels[c], at);
      if (nearest != nullptr)
      {
        const double ratio = best / (4.0 * PositionDeviation * PositionDeviation);
        add(sample.position, nearest->position, sample.weight / ((1.0 + ratio) * (1.0 + ratio)));
      }
    }
  }
  for (std::size_t tree = 0; tree < this->Pieces.roots.size(); ++tree)
  {
    if (assignment.sides[tree] != TreeSide::Neither)
    {
      add(this->Pieces.rootPosition[tree],
        assignment.sides[tree] == TreeSide::Left ? this->Atlas.leftOstium : this->Atlas.rightOstium,
        0.05 * weights);
    }
  }
  if (weights <= 0.0)
  {
    return pose;
  }
  const double hold = 0.2 * weights * 30.0 * 30.0;
  for (int i = 0; i < 3; ++i)
  {
    left(i, i) += hold;
    right.row(i) += hold * pose.matrix.col(i).transpose();
  }
  const Eigen::Matrix<double, 4, 3> solution = left.inverse() * right;
  AtlasPose refined;
  refined.matrix = solution.topRows<3>().transpose();
  refined.shift = solution.row(3).transpose();
  return refined.matrix.allFinite() && refined.matrix.determinant() > 0.0 ? refined : pose;
}

/// What position and course can not decide, but the words say: the right coronary's last segment goes as far as the
/// posterior descending artery leaves, and who descends alone behind is that artery.
void Labeler::ApplyDefinitions(LabelAssignment& assignment) const
{
  using V = Vessel;
  std::vector<V>& vessels = assignment.vessels;
  const auto has = [&](V vessel)
  { return std::find(vessels.begin(), vessels.end(), vessel) != vessels.end(); };
  if (has(V::InferiorRight) && !has(V::RightPosteriorDescending))
  {
    std::replace(vessels.begin(), vessels.end(), V::InferiorRight, V::RightPosteriorDescending);
  }
  // Children have higher indices than their parents.
  std::vector<char> leads(vessels.size(), 0);
  for (std::size_t c = vessels.size(); c-- > 0;)
  {
    if (leads[c] != 0 && vessels[c] == V::RightPosterolateral)
    {
      vessels[c] = V::RightCoronary;
    }
    const int parent = this->Pieces.pieces[c].parent;
    if (parent >= 0 && (leads[c] != 0 || vessels[c] == V::RightPosteriorDescending))
    {
      leads[static_cast<std::size_t>(parent)] = 1;
    }
  }
}

LabelingResult Labeler::Run(const ProgressCallback& progress)
{
  const std::vector<Candidate> candidates = this->FindPoses(
    progress ? [&](double fraction) { return progress(0.6 * fraction); } : ProgressCallback());
  std::vector<Dominance> dominances = { Dominance::Right, Dominance::Left, Dominance::Balanced };
  if (this->Settings.dominance >= 0)
  {
    dominances.assign(1, static_cast<Dominance>(this->Settings.dominance));
  }
  std::vector<std::pair<LabelAssignment, AtlasPose>> results(candidates.size() * dominances.size());
  ParallelFor(
    static_cast<std::int64_t>(results.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const Candidate& candidate = candidates[i / dominances.size()];
        const Dominance dominance = dominances[i % dominances.size()];
        AtlasPose pose = candidate.pose;
        LabelAssignment best = this->Assign(pose, candidate.sides, dominance);
        results[i] = { best, pose };
        constexpr int rounds = 4;
        for (int round = 0; round < rounds; ++round)
        {
          pose = this->Refine(pose, best);
          best = this->Assign(pose, candidate.sides, dominance);
          if (best.cost < results[i].first.cost)
          {
            results[i] = { best, pose };
          }
        }
      }
    },
    progress ? [&](double fraction) { return progress(0.6 + 0.35 * fraction); }
             : ProgressCallback());
  std::size_t chosen = 0;
  for (std::size_t i = 1; i < results.size(); ++i)
  {
    chosen = results[i].first.cost < results[chosen].first.cost ? i : chosen;
  }
  LabelingResult result;
  this->ApplyDefinitions(results[chosen].first);
  const auto& [assignment, pose] = results[chosen];
  result.cost = assignment.cost;
  result.dominance = assignment.dominance;
  result.margin = Infinity;
  for (const auto& [other, otherPose] : results)
  {
    if (other.dominance != result.dominance)
    {
      result.margin = std::min(result.margin, other.cost - result.cost);
    }
  }

  double distance = 0.0;
  double weight = 0.0;
  for (std::size_t c = 0; c < this->Pieces.pieces.size(); ++c)
  {
    for (std::size_t s = this->Pieces.pieces[c].firstSample; s < this->Pieces.pieces[c].lastSample;
         ++s)
    {
      const double best =
        this->Atlas.NearestOf(assignment.vessels[c], pose.Apply(this->Pieces.samples[s].position))
          .squared;
      if (best < Infinity)
      {
        distance += std::sqrt(best);
        weight += 1.0;
      }
    }
  }
  result.meanDistance = weight > 0.0 ? distance / weight : 0.0;

  // The nearest similarity to the affine fit is the heart's frame.
  const Eigen::JacobiSVD<Matrix3> svd(pose.matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Matrix3 rotation = svd.matrixU() * svd.matrixV().transpose();
  const double size = svd.singularValues().mean();
  result.heart.axes = this->Atlas.axes * rotation;
  result.heart.size = this->Pieces.unit / size;
  result.heart.origin = this->Pieces.centre +
    this->Pieces.unit * (pose.matrix.inverse() * (this->Atlas.origin - pose.shift));
  result.fit.matrix = pose.matrix / this->Pieces.unit;
  result.fit.shift = pose.shift - result.fit.matrix * this->Pieces.centre;
  NameSegments(this->Tree, this->Pieces, pose, assignment);
  return result;
}
}

HeartPose HeartPoseOf(const std::array<double, 16>& matrix)
{
  HeartPose heart;
  Vector3 shift;
  for (int row = 0; row < 3; ++row)
  {
    for (int column = 0; column < 3; ++column)
    {
      heart.axes(row, column) = matrix[static_cast<std::size_t>(4 * row + column)];
    }
    shift[row] = matrix[static_cast<std::size_t>(4 * row + 3)];
  }
  heart.size = 1.0 / heart.axes.row(0).norm();
  heart.axes *= heart.size;
  heart.origin = -heart.size * (heart.axes.transpose() * shift);
  return heart;
}

void LabelingSettings::Validate() const
{
  if (!(this->orientationWeight >= 0.0 && this->orientationWeight <= 100.0))
  {
    throw std::invalid_argument("The orientation weight must be from 0 to 100");
  }
  if (this->dominance < -1 || this->dominance > 2)
  {
    throw std::invalid_argument("The dominance must be -1 (find out), 0, 1 or 2");
  }
}

LabelingResult LabelSegments(
  CenterlineTopology& tree, const LabelingSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  if (tree.branches.empty())
  {
    return {};
  }
  Report(progress, 0.0);
  Labeler labeler(tree, settings);
  LabelingResult result = labeler.Run(progress);
  Report(progress, 1.0);
  return result;
}

int SplitAtSegmentBorders(CenterlineTopology& tree)
{
  const std::size_t count = tree.branches.size();
  std::vector<VesselTree::Branch> branches;
  std::vector<double> meanRadius;
  std::vector<char> inLoop;
  std::vector<int> first(count, 0);
  std::vector<int> last(count, 0);
  int cuts = 0;
  for (std::size_t b = 0; b < count; ++b)
  {
    const VesselTree::Branch& branch = tree.branches[b];
    // Where stretches of one segment start, as indices of steps.
    std::vector<std::size_t> starts{ 1 };
    const auto segmentOf = [&](std::size_t step) { return tree.segmentId[branch.points[step]]; };
    const auto lengthOf = [&](std::size_t from, std::size_t to)
    {
      double length = 0.0;
      for (std::size_t i = from; i < to; ++i)
      {
        length += (tree.points[branch.points[i]] - tree.points[branch.points[i - 1]]).norm();
      }
      return length;
    };
    const double minimum = 2.0 * tree.meanRadius[b];
    for (std::size_t i = 2; i < branch.points.size(); ++i)
    {
      if (segmentOf(i) == segmentOf(i - 1))
      {
        continue;
      }
      if (lengthOf(starts.back(), i) >= minimum)
      {
        starts.push_back(i);
      }
      else if (starts.size() > 1 && segmentOf(i) == segmentOf(starts[starts.size() - 2]))
      {
        starts.pop_back();
      }
      // Else the short stretch stays the beginning of the one that follows.
    }
    while (starts.size() > 1 && lengthOf(starts.back(), branch.points.size()) < minimum)
    {
      starts.pop_back();
    }
    cuts += static_cast<int>(starts.size()) - 1;
    first[b] = static_cast<int>(branches.size());
    for (std::size_t p = 0; p < starts.size(); ++p)
    {
      const std::size_t end = p + 1 < starts.size() ? starts[p + 1] : branch.points.size();
      VesselTree::Branch piece = branch;
      piece.points.assign(branch.points.begin() + static_cast<std::ptrdiff_t>(starts[p]) - 1,
        branch.points.begin() + static_cast<std::ptrdiff_t>(end));
      piece.groupId = static_cast<int>(branches.size());
      piece.parentGroupId = p > 0  ? piece.groupId - 1
        : branch.parentGroupId < 0 ? -1
                                   : last[branch.parentGroupId];
      std::vector<Vector3> way;
      std::map<int, double> lengths;
      double integral = 0.0;
      for (std::size_t i = 0; i < piece.points.size(); ++i)
      {
        way.push_back(tree.points[piece.points[i]]);
        if (i > 0)
        {
          const double step = (way[i] - way[i - 1]).norm();
          lengths[tree.segmentId[piece.points[i]]] += step;
          integral +=
            0.5 * step * (tree.radius[piece.points[i]] + tree.radius[piece.points[i - 1]]);
        }
      }
      piece.length = PolylineLength(way);
      piece.tortuosity = PolylineTortuosity(way);
      piece.segmentId = std::max_element(lengths.begin(), lengths.end(),
        [](const auto& a, const auto& c) {
          return a.second < c.second;
        })->first;
      meanRadius.push_back(integral / piece.length);
      inLoop.push_back(tree.inLoop[b]);
      branches.push_back(piece);
    }
    last[b] = static_cast<int>(branches.size()) - 1;
  }
  if (cuts == 0)
  {
    return 0;
  }
  std::vector<int> continuation(branches.size(), -1);
  for (std::size_t b = 0; b < count; ++b)
  {
    for (int piece = first[b]; piece < last[b]; ++piece)
    {
      continuation[piece] = piece + 1;
    }
    continuation[last[b]] = tree.continuation[b] < 0 ? -1 : first[tree.continuation[b]];
  }
  for (Bifurcation& bifurcation : tree.bifurcations)
  {
    bifurcation.parent = last[bifurcation.parent];
    for (int& daughter : bifurcation.daughters)
    {
      daughter = first[daughter];
    }
  }
  tree.branches = std::move(branches);
  tree.meanRadius = std::move(meanRadius);
  tree.inLoop = std::move(inLoop);
  tree.continuation = std::move(continuation);
  return cuts;
}
}
