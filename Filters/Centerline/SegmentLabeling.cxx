#include "SegmentLabeling.h"

#include "SegmentAtlas.h"

#include <Eigen/SVD>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr double Infinity = std::numeric_limits<double>::infinity();

// All lengths from here on are millimetres of the mean heart.
constexpr double ChunkLength = 6.0;     ///< pieces that get one name
constexpr double SampleSpacing = 2.0;   ///< points of a piece that are compared with the atlas
constexpr double Deviation = 8.0;       ///< of a vessel's course between individuals
constexpr double Correlation = 10.0;    ///< length of vessel that counts as one observation
constexpr double Misfit = 4.5;          ///< greatest cost of an observation
constexpr double CourseWeight = 1.0;    ///< of 1 - cos(angle between courses)
constexpr double Unnamed = 2.2;         ///< cost of an observation on a vessel without a name
constexpr double LongestUnnamed = 25.0; ///< conus, sinus node and atrial branches are short
constexpr double UnnamedLength = 0.12;  ///< cost of a longer one with what hangs on it, for each mm
constexpr double LeastNumbered = 8.0;   ///< shorter side branches are not counted
constexpr double OriginDeviation = 8.0; ///< of a side branch's origin along its vessel
constexpr double NumberedCourse = 1.0;  ///< weight of a side branch's course beside its origin
constexpr double SkippedNumber = 2.0;   ///< cost of a first, second, ... branch that is not there
constexpr double StemLength = 5.0;      ///< three arteries that leave the left main nearly together
constexpr double StemCost = 1.0;        ///< of a ramus that leaves such a stem

using Costs = std::array<double, NumberOfVessels>;

int I(Vessel vessel)
{
  return static_cast<int>(vessel);
}

bool IsTrunk(Vessel vessel)
{
  return vessel == Vessel::LeftMain || vessel == Vessel::AnteriorDescending ||
    vessel == Vessel::Circumflex || vessel == Vessel::RightCoronary;
}

enum class Side
{
  Left,
  Right,
  Neither
};

/// A short piece of a branch.
struct Chunk
{
  int branch = 0;
  std::size_t first = 0; ///< index in the branch's points; the first point belongs to the piece
  std::size_t last = 0;  ///< before it, except at a root
  double length = 0.0;
  int parent = -1;
  std::vector<int> children;
  bool startsBranch = false;
  std::size_t firstSample = 0;
  std::size_t lastSample = 0; ///< one past
};

struct Sample
{
  Vector3 position;
  Vector3 tangent;
  double weight;
  int tree;
};

/// y = matrix x + shift, from the trees' coordinates (centred, in units near mm) to the atlas'.
struct Pose
{
  Matrix3 matrix = Matrix3::Identity();
  Vector3 shift = Vector3::Zero();
  Vector3 Apply(const Vector3& x) const { return this->matrix * x + this->shift; }
};

/// What may branch off what, and how unusual that is (negative logarithm of a likelihood).
const std::array<Costs, NumberOfVessels>& BranchingCosts()
{
  static const std::array<Costs, NumberOfVessels> costs = []
  {
    std::array<Costs, NumberOfVessels> c{};
    for (Costs& row : c)
    {
      row.fill(Infinity);
    }
    const auto set = [&](Vessel from, Vessel to, double cost) { c[I(from)][I(to)] = cost; };
    using V = Vessel;
    for (int v = 0; v < NumberOfVessels; ++v)
    {
      c[v][I(V::Other)] = 2.5;
      c[v][v] = IsTrunk(static_cast<V>(v)) ? 0.0 : 0.3;
    }
    c[I(V::Other)][I(V::Other)] = 0.0;
    set(V::LeftMain, V::AnteriorDescending, 0.0);
    set(V::LeftMain, V::Circumflex, 0.0);
    set(V::LeftMain, V::Ramus, 1.0);
    set(V::LeftMain, V::Diagonal, 3.0);
    set(V::LeftMain, V::ObtuseMarginal, 3.0);
    set(V::AnteriorDescending, V::Diagonal, 0.3);
    set(V::AnteriorDescending, V::Septal, 0.3);
    set(V::AnteriorDescending, V::Ramus, 3.0);
    set(V::AnteriorDescending, V::Circumflex, 4.0);
    set(V::Circumflex, V::AnteriorDescending, 4.0);
    set(V::Circumflex, V::ObtuseMarginal, 0.3);
    set(V::Circumflex, V::Ramus, 3.0);
    set(V::Circumflex, V::LeftPosterolateral, 0.5);
    set(V::Circumflex, V::LeftPosteriorDescending, 0.5);
    set(V::LeftPosteriorDescending, V::LeftPosterolateral, 1.5);
    set(V::LeftPosterolateral, V::LeftPosteriorDescending, 1.5);
    set(V::RightCoronary, V::RightVentricular, 0.3);
    set(V::RightCoronary, V::AcuteMarginal, 0.3);
    set(V::RightCoronary, V::RightPosteriorDescending, 0.3);
    set(V::RightCoronary, V::RightPosterolateral, 0.3);
    set(V::RightCoronary, V::InferiorRight, 1.0);
    set(V::RightPosterolateral, V::InferiorRight, 0.5);
    set(V::RightPosterolateral, V::RightPosteriorDescending, 3.0);
    set(V::RightPosteriorDescending, V::RightPosterolateral, 3.0);
    set(V::Ramus, V::Diagonal, 4.0);
    set(V::Ramus, V::ObtuseMarginal, 4.0);
    return c;
  }();
  return costs;
}

/// The same inside a branch, where the side branch that marks the change was not seen.
double ChangeCost(Vessel from, Vessel to)
{
  if (from == to)
  {
    return 0.0;
  }
  using V = Vessel;
  const auto is = [&](V a, V b) { return from == a && to == b; };
  if (is(V::LeftMain, V::AnteriorDescending) || is(V::LeftMain, V::Circumflex))
  {
    return 2.5;
  }
  if (is(V::Circumflex, V::LeftPosterolateral) || is(V::Circumflex, V::LeftPosteriorDescending) ||
    is(V::RightCoronary, V::RightPosterolateral) || is(V::RightCoronary, V::InferiorRight) ||
    is(V::RightCoronary, V::RightPosteriorDescending))
  {
    return 2.0;
  }
  if (is(V::RightCoronary, V::AcuteMarginal) || is(V::Circumflex, V::ObtuseMarginal) ||
    is(V::AnteriorDescending, V::Diagonal))
  {
    return 4.0;
  }
  return Infinity;
}

double RootCost(Side side, Vessel vessel)
{
  using V = Vessel;
  if (side == Side::Left)
  {
    return vessel == V::LeftMain                                   ? 0.0
      : vessel == V::AnteriorDescending || vessel == V::Circumflex ? 4.0
                                                                   : Infinity;
  }
  return vessel == V::RightCoronary ? 0.0 : Infinity;
}

/// Kinds of vessel that there are on a side under a dominance.
bool Exists(Vessel vessel, Side side, Dominance dominance)
{
  using V = Vessel;
  if (vessel == V::Other)
  {
    return true;
  }
  if (IsLeft(vessel) != (side == Side::Left))
  {
    return false;
  }
  switch (vessel)
  {
    case V::LeftPosteriorDescending:
      return dominance == Dominance::Left;
    case V::LeftPosterolateral:
      return dominance != Dominance::Right;
    case V::RightPosteriorDescending:
    case V::InferiorRight:
      return dominance != Dominance::Left;
    case V::RightPosterolateral:
      return dominance == Dominance::Right;
    default:
      return true;
  }
}

/// -log of how often it occurs.
double DominanceCost(Dominance dominance)
{
  // Where only a posterolateral branch is seen on the left, nothing speaks for a left dominance.
  return dominance == Dominance::Right ? 0.2 : dominance == Dominance::Left ? 2.4 : 2.3;
}

class Labeler
{
public:
  Labeler(CenterlineTopology& tree, const LabelingSettings& settings)
    : Tree(tree)
    , Settings(settings)
    , Atlas(SegmentAtlas::Get())
  {
    this->Normalise();
    this->Cut();
  }

  LabelingResult Run(const ProgressCallback& progress);

private:
  struct Candidate
  {
    Pose pose;
    std::vector<Side> sides; ///< of the trees that took part; the others' are chosen later
    double cost = Infinity;
  };
  struct Assignment
  {
    std::vector<Vessel> vessels; ///< one a piece
    std::vector<Side> sides;
    Dominance dominance = Dominance::Right;
    double cost = Infinity;
  };

  void Normalise();
  void Cut();
  std::vector<Candidate> FindPoses(const ProgressCallback& progress);
  Candidate Align(const std::vector<int>& trees, const std::vector<Side>& sides, double spin) const;
  double RotationCost(const Pose& pose) const;
  std::vector<Costs> Compare(const Pose& pose) const;
  Assignment Assign(const Pose& pose, const std::vector<Side>& fixed, Dominance dominance) const;
  double AssignTree(int tree, Side side, Dominance dominance, const std::vector<Costs>& fit,
    std::uint32_t forbidden, std::vector<Vessel>& vessels) const;
  std::vector<double> CourseCosts(
    const Pose& pose, const Assignment& assignment, int start, std::size_t numbers) const;
  Pose Refine(const Pose& pose, const Assignment& assignment) const;
  void ApplyDefinitions(Assignment& assignment) const;
  void NameSegments(const Pose& pose, const Assignment& assignment);

  CenterlineTopology& Tree;
  const LabelingSettings& Settings;
  const SegmentAtlas& Atlas;
  Vector3 Centre = Vector3::Zero();
  double Unit = 1.0; ///< of the input, in mm or near it
  std::vector<Chunk> Chunks;
  std::vector<Sample> Samples;
  std::vector<std::vector<int>> Roots; ///< first pieces of every tree
  std::vector<double> TreeLength;
  std::vector<Vector3> RootPosition;
  std::vector<double> Below;                     ///< length of a piece and of all that hangs on it
  std::vector<const Bifurcation*> BifurcationOf; ///< of a branch's end
};

void Labeler::Normalise()
{
  // Power of ten that brings the extent and the calibre of the trees near those of a heart in mm.
  double weight = 0.0;
  for (const auto& branch : this->Tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const Vector3& a = this->Tree.points[branch.points[i - 1]];
      const Vector3& b = this->Tree.points[branch.points[i]];
      this->Centre += (b - a).norm() * 0.5 * (a + b);
      weight += (b - a).norm();
    }
  }
  this->Centre /= weight;
  double spread = 0.0;
  double calibre = 0.0;
  for (const auto& branch : this->Tree.branches)
  {
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      const Vector3& a = this->Tree.points[branch.points[i - 1]];
      const Vector3& b = this->Tree.points[branch.points[i]];
      const double step = (b - a).norm();
      spread += step / weight * (0.5 * (a + b) - this->Centre).squaredNorm();
      calibre += step / weight * this->Tree.radius[branch.points[i]];
    }
  }
  const double power = 0.5 * (std::log10(std::sqrt(spread) / 38.0) + std::log10(calibre / 0.95));
  this->Unit = std::pow(10.0, std::round(power));
}

void Labeler::Cut()
{
  const std::size_t count = this->Tree.branches.size();
  this->BifurcationOf.assign(count, nullptr);
  for (const Bifurcation& bifurcation : this->Tree.bifurcations)
  {
    this->BifurcationOf[bifurcation.parent] = &bifurcation;
  }
  int trees = 0;
  for (const auto& branch : this->Tree.branches)
  {
    trees = std::max(trees, branch.treeId + 1);
  }
  this->Roots.resize(trees);
  this->TreeLength.assign(trees, 0.0);
  this->RootPosition.assign(trees, Vector3::Zero());
  std::vector<int> lastChunk(count, -1);
  for (std::size_t b = 0; b < count; ++b)
  {
    const auto& branch = this->Tree.branches[b];
    const double length = branch.length / this->Unit;
    this->TreeLength[branch.treeId] += length;
    const int pieces = std::max(1, static_cast<int>(std::lround(length / ChunkLength)));
    int parent = branch.parentGroupId < 0 ? -1 : lastChunk[branch.parentGroupId];
    if (parent < 0)
    {
      this->RootPosition[branch.treeId] =
        (this->Tree.points[branch.points[0]] - this->Centre) / this->Unit;
    }
    std::size_t at = 0;
    double arc = 0.0;
    for (int piece = 0; piece < pieces; ++piece)
    {
      Chunk chunk;
      chunk.branch = static_cast<int>(b);
      chunk.first = at;
      chunk.startsBranch = piece == 0;
      chunk.firstSample = this->Samples.size();
      const double end = branch.length * (piece + 1) / pieces;
      double sampled = arc - 0.5 * SampleSpacing * this->Unit;
      const double start = arc;
      while (at + 1 < branch.points.size() && (arc < end || piece + 1 == pieces))
      {
        const auto point = branch.points[at + 1];
        const double step =
          (this->Tree.points[point] - this->Tree.points[branch.points[at]]).norm();
        if (arc + 0.5 * step > end && piece + 1 < pieces && at > chunk.first)
        {
          break;
        }
        arc += step;
        ++at;
        if (arc - sampled >= SampleSpacing * this->Unit || at + 1 == branch.points.size())
        {
          const double calibre = this->Tree.radius[point] / this->Unit;
          this->Samples.push_back(
            { (this->Tree.points[point] - this->Centre) / this->Unit, this->Tree.tangent[point],
              (arc - sampled) / this->Unit * std::clamp(calibre, 0.5, 2.0), branch.treeId });
          sampled = arc;
        }
      }
      chunk.last = at;
      chunk.lastSample = this->Samples.size();
      chunk.length = (arc - start) / this->Unit;
      if (chunk.last == chunk.first)
      {
        continue;
      }
      if (chunk.firstSample == chunk.lastSample)
      {
        const auto point = branch.points[at];
        this->Samples.push_back({ (this->Tree.points[point] - this->Centre) / this->Unit,
          this->Tree.tangent[point], chunk.length, branch.treeId });
        chunk.lastSample = this->Samples.size();
      }
      const int index = static_cast<int>(this->Chunks.size());
      chunk.parent = parent;
      if (parent >= 0)
      {
        this->Chunks[parent].children.push_back(index);
      }
      else
      {
        this->Roots[branch.treeId].push_back(index);
      }
      this->Chunks.push_back(chunk);
      parent = index;
    }
    lastChunk[b] = parent;
  }
  this->Below.assign(this->Chunks.size(), 0.0);
  for (std::size_t c = this->Chunks.size(); c-- > 0;)
  {
    this->Below[c] += this->Chunks[c].length;
    if (this->Chunks[c].parent >= 0)
    {
      this->Below[this->Chunks[c].parent] += this->Below[c];
    }
  }
}

double Labeler::RotationCost(const Pose& pose) const
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
  const std::vector<int>& trees, const std::vector<Side>& sides, double spin) const
{
  Candidate candidate;
  candidate.sides.assign(this->Roots.size(), Side::Neither);
  bool used[2] = { false, false };
  Vector3 from = Vector3::Zero();
  Vector3 to = Vector3::Zero();
  for (std::size_t i = 0; i < trees.size(); ++i)
  {
    candidate.sides[trees[i]] = sides[i];
    used[sides[i] == Side::Right] = true;
    from += this->RootPosition[trees[i]] / static_cast<double>(trees.size());
    to += (sides[i] == Side::Left ? this->Atlas.leftOstium : this->Atlas.rightOstium) /
      static_cast<double>(trees.size());
  }
  Vector3 centre = Vector3::Zero();
  double weights = 0.0;
  std::vector<const Sample*> samples;
  for (std::size_t i = 0; i < this->Samples.size(); i += 2)
  {
    const Sample& sample = this->Samples[i];
    if (candidate.sides[sample.tree] != Side::Neither)
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
  Pose& pose = candidate.pose;
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
    for (const Sample* sample : samples)
    {
      const Vector3 at = pose.Apply(sample->position);
      double best = Infinity;
      const SegmentAtlas::Point* nearest = nullptr;
      for (const SegmentAtlas::Point* point : targets[candidate.sides[sample->tree] == Side::Right])
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
        std::min(Misfit,
          best / (2.0 * Deviation * Deviation) +
            CourseWeight * (1.0 - course.dot(nearest->tangent)));
    }
    for (std::size_t i = 0; i < trees.size(); ++i)
    {
      const Vector3 ostium =
        sides[i] == Side::Left ? this->Atlas.leftOstium : this->Atlas.rightOstium;
      const double ratio =
        (pose.Apply(this->RootPosition[trees[i]]) - ostium).squaredNorm() / (4.0 * scale * scale);
      pair(this->RootPosition[trees[i]], ostium, 0.1 * weights / ((1.0 + ratio) * (1.0 + ratio)));
      residual += 0.1 * std::min(Misfit, 2.0 * ratio);
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
  std::vector<int> trees(this->Roots.size());
  std::iota(trees.begin(), trees.end(), 0);
  std::stable_sort(trees.begin(), trees.end(),
    [&](int a, int b) { return this->TreeLength[a] > this->TreeLength[b]; });
  while (trees.size() > 1 &&
    (trees.size() > 3 || this->TreeLength[trees.back()] < 0.1 * this->TreeLength[trees.front()]))
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
        std::vector<Side> sides;
        for (std::size_t t = 0; t < trees.size(); ++t)
        {
          sides.push_back(((i / spins) >> t & 1) == 0 ? Side::Left : Side::Right);
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

std::vector<Costs> Labeler::Compare(const Pose& pose) const
{
  std::vector<Costs> result(this->Chunks.size());
  for (std::size_t c = 0; c < this->Chunks.size(); ++c)
  {
    const Chunk& chunk = this->Chunks[c];
    Costs mean{};
    for (std::size_t s = chunk.firstSample; s < chunk.lastSample; ++s)
    {
      const Vector3 at = pose.Apply(this->Samples[s].position);
      const Vector3 course = (pose.matrix * this->Samples[s].tangent).normalized();
      Costs best;
      best.fill(Misfit);
      for (const SegmentAtlas::Point& point : this->Atlas.points)
      {
        const double near = (point.position - at).squaredNorm() * (0.5 / (Deviation * Deviation));
        double& least = best[I(point.vessel)];
        if (near < least)
        {
          least = std::min(least, near + CourseWeight * (1.0 - course.dot(point.tangent)));
        }
      }
      best[I(Vessel::Other)] = Unnamed;
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

double Labeler::AssignTree(int tree, Side side, Dominance dominance, const std::vector<Costs>& fit,
  std::uint32_t forbidden, std::vector<Vessel>& vessels) const
{
  using V = Vessel;
  const auto& branching = BranchingCosts();
  const std::size_t count = this->Chunks.size();
  // The inferior branch is the right coronary's own end only when the left side has the
  // posterolateral wall.
  const double inferior = dominance == Dominance::Balanced ? 0.0 : 2.5;
  const auto extra = [&](V from, V to)
  { return from == V::RightCoronary && to == V::InferiorRight ? inferior : 0.0; };
  // Three arteries that leave the left main together come as two divisions with a stem between them.
  const auto isStem = [&](const Chunk& chunk)
  {
    return chunk.startsBranch && chunk.children.size() > 1 && chunk.length < StemLength &&
      this->Tree.branches[chunk.branch].generation <= 1;
  };
  std::vector<Costs> cost(count);
  std::vector<std::array<std::vector<V>, NumberOfVessels>> choice(count);
  const auto bit = [](V vessel) -> unsigned { return IsTrunk(vessel) ? 1U << I(vessel) : 0U; };

  // Backwards: children have higher indices than their parents.
  for (std::size_t c = count; c-- > 0;)
  {
    const Chunk& chunk = this->Chunks[c];
    cost[c].fill(Infinity);
    if (this->Tree.branches[chunk.branch].treeId != tree)
    {
      continue;
    }
    const bool divides = chunk.children.size() > 1;
    const Bifurcation* bifurcation = divides ? this->BifurcationOf[chunk.branch] : nullptr;
    // How unlikely it is that a child is the vessel's continuation.
    std::vector<double> detour(chunk.children.size(), 0.0);
    if (bifurcation != nullptr)
    {
      for (std::size_t i = 0; i < chunk.children.size(); ++i)
      {
        const int branch = this->Chunks[chunk.children[i]].branch;
        for (std::size_t d = 0; d < bifurcation->daughters.size(); ++d)
        {
          if (bifurcation->daughters[d] == branch)
          {
            const double turn = bifurcation->daughterAngles[d] / (40.0 * Pi / 180.0);
            const double narrow =
              std::log(bifurcation->daughterRadius[0] / bifurcation->daughterRadius[d]) / 0.35;
            detour[i] = std::min(2.5, 0.5 * turn * turn) + std::min(2.5, 0.5 * narrow * narrow);
          }
        }
      }
    }
    for (int p = 0; p < NumberOfVessels; ++p)
    {
      const V parent = static_cast<V>(p);
      if (!Exists(parent, side, dominance) || (forbidden >> p & 1U) != 0U)
      {
        continue;
      }
      double below = 0.0;
      std::vector<V> best;
      if (chunk.children.size() == 1)
      {
        const auto& child = cost[chunk.children[0]];
        below = Infinity;
        for (int v = 0; v < NumberOfVessels; ++v)
        {
          const double there =
            child[v] + ChangeCost(parent, static_cast<V>(v)) + extra(parent, static_cast<V>(v));
          if (there < below)
          {
            below = there;
            best.assign(1, static_cast<V>(v));
          }
        }
      }
      else if (divides)
      {
        // What leaves together with a child.
        const auto beside = [&](std::size_t child)
        {
          double longest = 0.0;
          for (std::size_t i = 0; i < chunk.children.size(); ++i)
          {
            longest = i == child ? longest : std::max(longest, this->Below[chunk.children[i]]);
          }
          return longest;
        };
        // Each trunk goes on in one child at most.
        std::map<unsigned, std::pair<double, std::vector<V>>> states;
        states[0] = { 0.0, {} };
        for (std::size_t i = 0; i < chunk.children.size(); ++i)
        {
          std::map<unsigned, std::pair<double, std::vector<V>>> next;
          for (const auto& [mask, state] : states)
          {
            for (int v = 0; v < NumberOfVessels; ++v)
            {
              const V vessel = static_cast<V>(v);
              const double child = cost[chunk.children[i]][v];
              double step = branching[p][v] + extra(parent, vessel);
              if (vessel == V::Other && parent != V::Other)
              {
                step +=
                  UnnamedLength * std::max(0.0, this->Below[chunk.children[i]] - LongestUnnamed);
              }
              if (vessel == V::Ramus && isStem(chunk) &&
                (parent == V::AnteriorDescending || parent == V::Circumflex))
              {
                step = StemCost;
              }
              // The left main ends at its first division that is more than a twig.
              const bool goesOn = parent == V::LeftMain && vessel == V::LeftMain;
              if (!(child + step < Infinity) || (mask & bit(vessel)) != 0U ||
                (goesOn && beside(i) > LongestUnnamed))
              {
                continue;
              }
              if (vessel == parent && IsTrunk(vessel))
              {
                step += detour[i];
              }
              const unsigned after = mask | bit(vessel);
              const double total = state.first + step + child;
              auto& slot =
                next.emplace(after, std::make_pair(Infinity, std::vector<V>())).first->second;
              if (total < slot.first)
              {
                slot.first = total;
                slot.second = state.second;
                slot.second.push_back(vessel);
              }
            }
          }
          states = std::move(next);
        }
        below = Infinity;
        for (const auto& [mask, state] : states)
        {
          double total = state.first;
          if (parent == V::LeftMain &&
            (mask & (bit(V::LeftMain) | bit(V::AnteriorDescending) | bit(V::Circumflex))) == 0U)
          {
            total += 4.0;
          }
          if ((parent == V::AnteriorDescending || parent == V::RightCoronary ||
                parent == V::Circumflex) &&
            (mask & bit(parent)) == 0U)
          {
            // Only the right coronary and the circumflex end in other named vessels.
            const bool ends = std::any_of(state.second.begin(), state.second.end(),
              [](V v)
              {
                return v == V::RightPosteriorDescending || v == V::RightPosterolateral ||
                  v == V::LeftPosteriorDescending || v == V::LeftPosterolateral ||
                  v == V::InferiorRight;
              });
            total += ends ? 0.0 : parent == V::AnteriorDescending ? 6.0 : 4.0;
          }
          if (total < below)
          {
            below = total;
            best = state.second;
          }
        }
      }
      else if (parent == V::LeftMain)
      {
        below = 4.0;
      }
      cost[c][p] = fit[c][p] + below;
      choice[c][p] = best;
    }
  }
  double total = 0.0;
  std::vector<std::pair<int, V>> stack;
  for (const int root : this->Roots[tree])
  {
    double best = Infinity;
    V vessel = V::Other;
    for (int v = 0; v < NumberOfVessels; ++v)
    {
      const double there = cost[root][v] + RootCost(side, static_cast<V>(v));
      if (there < best)
      {
        best = there;
        vessel = static_cast<V>(v);
      }
    }
    if (!(best < Infinity))
    {
      return Infinity;
    }
    total += best;
    stack.emplace_back(root, vessel);
  }
  while (!stack.empty())
  {
    const auto [c, vessel] = stack.back();
    stack.pop_back();
    vessels[c] = vessel;
    for (std::size_t i = 0; i < this->Chunks[c].children.size(); ++i)
    {
      stack.emplace_back(this->Chunks[c].children[i], choice[c][I(vessel)][i]);
    }
  }
  return total;
}

Labeler::Assignment Labeler::Assign(
  const Pose& pose, const std::vector<Side>& fixed, Dominance dominance) const
{
  const std::vector<Costs> fit = this->Compare(pose);
  Assignment result;
  result.dominance = dominance;
  result.vessels.assign(this->Chunks.size(), Vessel::Other);
  result.sides.assign(this->Roots.size(), Side::Neither);
  result.cost = DominanceCost(dominance) + this->RotationCost(pose);
  std::vector<int> order(this->Roots.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
    [&](int a, int b) { return this->TreeLength[a] > this->TreeLength[b]; });
  // A trunk that one tree has is not looked for in another.
  std::uint32_t taken = 0;
  for (const int tree : order)
  {
    double best = Unnamed * this->TreeLength[tree] / Correlation + 3.0;
    std::vector<Vessel> vessels(this->Chunks.size(), Vessel::Other);
    std::vector<Vessel> chosen = vessels;
    Side side = Side::Neither;
    for (const Side candidate : { Side::Left, Side::Right })
    {
      if (fixed[tree] != Side::Neither && fixed[tree] != candidate)
      {
        continue;
      }
      const double cost = this->AssignTree(tree, candidate, dominance, fit, taken, vessels);
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
    for (std::size_t c = 0; c < this->Chunks.size(); ++c)
    {
      if (this->Tree.branches[this->Chunks[c].branch].treeId == tree)
      {
        result.vessels[c] = side == Side::Neither ? Vessel::Other : chosen[c];
        lengths[result.vessels[c]] += this->Chunks[c].length;
      }
    }
    for (const auto& [vessel, length] : lengths)
    {
      if (IsTrunk(vessel))
      {
        taken |= 1U << I(vessel);
      }
    }
  }
  return result;
}

Pose Labeler::Refine(const Pose& pose, const Assignment& assignment) const
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
  for (std::size_t c = 0; c < this->Chunks.size(); ++c)
  {
    const Chunk& chunk = this->Chunks[c];
    for (std::size_t s = chunk.firstSample; s < chunk.lastSample; ++s)
    {
      const Sample& sample = this->Samples[s];
      const Vector3 at = pose.Apply(sample.position);
      const SegmentAtlas::Point* nearest = nullptr;
      double best = Infinity;
      for (const SegmentAtlas::Point& point : this->Atlas.points)
      {
        const double squared = (point.position - at).squaredNorm();
        if (point.vessel == assignment.vessels[c] && squared < best)
        {
          best = squared;
          nearest = &point;
        }
      }
      if (nearest != nullptr)
      {
        const double ratio = best / (4.0 * Deviation * Deviation);
        add(sample.position, nearest->position, sample.weight / ((1.0 + ratio) * (1.0 + ratio)));
      }
    }
  }
  for (std::size_t tree = 0; tree < this->Roots.size(); ++tree)
  {
    if (assignment.sides[tree] != Side::Neither)
    {
      add(this->RootPosition[tree],
        assignment.sides[tree] == Side::Left ? this->Atlas.leftOstium : this->Atlas.rightOstium,
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
  Pose refined;
  refined.matrix = solution.topRows<3>().transpose();
  refined.shift = solution.row(3).transpose();
  return refined.matrix.allFinite() && refined.matrix.determinant() > 0.0 ? refined : pose;
}

/// Numbers 1, 2, 3 for side branches in the order of their origins; a number may be left out when
/// the next one's usual origin is much nearer.
std::vector<int> NumberInOrder(const std::vector<std::vector<double>>& costs, int most)
{
  const std::size_t n = costs.size();
  // best[i][k]: the first i branches with the last numbered k.
  std::vector<std::vector<double>> best(n + 1, std::vector<double>(most + 1, Infinity));
  std::vector<std::vector<int>> from(n + 1, std::vector<int>(most + 1, 0));
  best[0][0] = 0.0;
  for (std::size_t i = 0; i < n; ++i)
  {
    for (int last = 0; last <= most; ++last)
    {
      for (int k = std::min(last + 1, most); k <= most; ++k)
      {
        // When there are more branches than numbers, some share the last one.
        const double repeated = last < most ? SkippedNumber * (k - last - 1)
          : static_cast<int>(n) > most      ? SkippedNumber
                                            : Infinity;
        const double total = best[i][last] + costs[i][k - 1] + repeated;
        if (total < best[i + 1][k])
        {
          best[i + 1][k] = total;
          from[i + 1][k] = last;
        }
      }
    }
  }
  std::vector<int> numbers(n, 0);
  int k = static_cast<int>(std::min_element(best[n].begin(), best[n].end()) - best[n].begin());
  for (std::size_t i = n; i > 0; --i)
  {
    numbers[i - 1] = k;
    k = from[i][k];
  }
  return numbers;
}

std::vector<double> Labeler::CourseCosts(
  const Pose& pose, const Assignment& assignment, int start, std::size_t numbers) const
{
  const Vessel kind = assignment.vessels[start];
  std::vector<double> sum(numbers, 0.0);
  double count = 0.0;
  std::vector<int> stack{ start };
  while (!stack.empty())
  {
    const Chunk& chunk = this->Chunks[stack.back()];
    stack.pop_back();
    for (std::size_t s = chunk.firstSample; s < chunk.lastSample; ++s)
    {
      const Vector3 at = pose.Apply(this->Samples[s].position);
      std::vector<double> best(numbers, Misfit);
      for (const SegmentAtlas::Point& point : this->Atlas.points)
      {
        if (point.vessel == kind)
        {
          double& least = best[point.number - 1];
          least =
            std::min(least, (point.position - at).squaredNorm() * (0.5 / (Deviation * Deviation)));
        }
      }
      for (std::size_t k = 0; k < numbers; ++k)
      {
        sum[k] += best[k];
      }
      count += 1.0;
    }
    stack.insert(stack.end(), chunk.children.begin(), chunk.children.end());
  }
  for (double& value : sum)
  {
    value *= NumberedCourse / count;
  }
  return sum;
}

/// What position and course can not decide, but the words say: the right coronary's last segment goes as far as the
/// posterior descending artery leaves, and who descends alone behind is that artery.
void Labeler::ApplyDefinitions(Assignment& assignment) const
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
    const int parent = this->Chunks[c].parent;
    if (parent >= 0 && (leads[c] != 0 || vessels[c] == V::RightPosteriorDescending))
    {
      leads[static_cast<std::size_t>(parent)] = 1;
    }
  }
}

void Labeler::NameSegments(const Pose& pose, const Assignment& assignment)
{
  using V = Vessel;
  const std::size_t count = this->Chunks.size();

  // Trunks as lists of points with the atlas' arc, and what leaves them.
  const auto atlasArc = [&](V vessel, std::int64_t point)
  {
    const Vector3 at = pose.Apply((this->Tree.points[point] - this->Centre) / this->Unit);
    double best = Infinity;
    double arc = 0.0;
    for (const SegmentAtlas::Point& candidate : this->Atlas.points)
    {
      if (candidate.vessel == vessel && (candidate.position - at).squaredNorm() < best)
      {
        best = (candidate.position - at).squaredNorm();
        arc = candidate.arc;
      }
    }
    return arc;
  };
  struct SideBranch
  {
    int chunk;
    std::int64_t origin;
    double along; ///< distance of the origin from the tree's root
    double arc;   ///< of the atlas' trunk there
    int number = 0;
  };
  const auto sideBranches = [&](V trunk, V kind)
  {
    std::vector<SideBranch> found;
    for (std::size_t c = 0; c < count; ++c)
    {
      const Chunk& chunk = this->Chunks[c];
      if (assignment.vessels[c] == kind && chunk.startsBranch && chunk.parent >= 0 &&
        assignment.vessels[chunk.parent] == trunk && this->Below[c] >= LeastNumbered)
      {
        const std::int64_t origin = this->Tree.branches[chunk.branch].points[0];
        found.push_back(
          { static_cast<int>(c), origin, this->Tree.abscissa[origin], atlasArc(trunk, origin), 0 });
      }
    }
    std::stable_sort(found.begin(), found.end(),
      [](const SideBranch& a, const SideBranch& b) { return a.along < b.along; });
    return found;
  };
  const auto usual = [&](V kind)
  {
    std::vector<double> arcs;
    for (const AtlasOrigin& origin : this->Atlas.origins)
    {
      if (origin.vessel == kind)
      {
        arcs.push_back(origin.arc);
      }
    }
    return arcs;
  };

  std::vector<int> numberOf(count, 0);
  const auto number = [&](V trunk, V kind)
  {
    std::vector<SideBranch> branches = sideBranches(trunk, kind);
    const std::vector<double> arcs = usual(kind);
    std::vector<std::vector<double>> costs;
    for (const SideBranch& branch : branches)
    {
      // The origin along the trunk, and the course of the branch.
      std::vector<double> cost = this->CourseCosts(pose, assignment, branch.chunk, arcs.size());
      for (std::size_t k = 0; k < arcs.size(); ++k)
      {
        const double off = (branch.arc - arcs[k]) / OriginDeviation;
        cost[k] += std::min(Misfit, 0.5 * off * off);
      }
      costs.push_back(cost);
    }
    const std::vector<int> numbers = NumberInOrder(costs, static_cast<int>(arcs.size()));
    for (std::size_t i = 0; i < branches.size(); ++i)
    {
      branches[i].number = numbers[i];
      numberOf[branches[i].chunk] = numbers[i];
    }
    return branches;
  };
  const auto diagonals = number(V::AnteriorDescending, V::Diagonal);
  const auto septals = number(V::AnteriorDescending, V::Septal);
  const auto marginals = number(V::Circumflex, V::ObtuseMarginal);
  const auto ventriculars = sideBranches(V::RightCoronary, V::RightVentricular);
  const auto acutes = sideBranches(V::RightCoronary, V::AcuteMarginal);

  // Borders on the trunks: at a side branch when it is there, else where it usually is. Each is a
  // distance from the root, or a place on the atlas' trunk.
  struct Border
  {
    double along = -1.0;
    double arc = 0.0;
  };
  const auto byNumber = [](const std::vector<SideBranch>& branches, int wanted) -> const SideBranch*
  {
    for (const SideBranch& branch : branches)
    {
      if (branch.number == wanted)
      {
        return &branch;
      }
    }
    return nullptr;
  };
  const auto nearest = [](const std::vector<SideBranch>& branches, double arc,
                         double reach) -> const SideBranch*
  {
    const SideBranch* best = nullptr;
    for (const SideBranch& branch : branches)
    {
      if (std::abs(branch.arc - arc) < reach)
      {
        best = &branch;
        reach = std::abs(branch.arc - arc);
      }
    }
    return best;
  };
  const auto border = [](const SideBranch* branch, double arc) {
    return branch != nullptr ? Border{ branch->along, arc } : Border{ -1.0, arc };
  };

  const SideBranch* firstDiagonal = byNumber(diagonals, 1);
  if (firstDiagonal == nullptr)
  {
    firstDiagonal = byNumber(septals, 1);
  }
  const Border ladProximal = border(firstDiagonal, usual(V::Diagonal)[0]);
  const Border ladMid = border(byNumber(diagonals, 3), this->Atlas.midLadEnd);
  const Border circumflex = border(byNumber(marginals, 1), this->Atlas.obtuseMarginArc);
  // The part of the circumflex beyond its last marginal that ends on the posterolateral wall is the
  // posterolateral branch, also where it still lies in the groove.
  bool endsPosterolateral = false;
  for (std::size_t c = 0; c < count; ++c)
  {
    const int parent = this->Chunks[c].parent;
    endsPosterolateral = endsPosterolateral ||
      (assignment.dominance == Dominance::Balanced && parent >= 0 &&
        assignment.vessels[c] == V::LeftPosterolateral &&
        assignment.vessels[parent] == V::Circumflex);
  }
  const Border groove = border(byNumber(marginals, 3), this->Atlas.leftGrooveEnd);
  const Border rcaProximal = border(
    nearest(ventriculars, usual(V::RightVentricular)[0], 18.0), usual(V::RightVentricular)[0]);
  const Border rcaMid =
    border(nearest(acutes, this->Atlas.acuteMarginArc, 25.0), this->Atlas.acuteMarginArc);

  const auto passed = [&](const Border& limit, V trunk, std::int64_t point)
  {
    return limit.along >= 0.0 ? this->Tree.abscissa[point] > limit.along * (1.0 + 1e-12)
                              : atlasArc(trunk, point) > limit.arc;
  };
  // Number of borders passed on the trunk: noise does not lead back over one.
  std::vector<int> stage(count, 0);
  for (std::size_t c = 0; c < count; ++c)
  {
    const Chunk& chunk = this->Chunks[c];
    const V vessel = assignment.vessels[c];
    // A side branch's number holds for all that hangs on it.
    if (numberOf[c] == 0 && chunk.parent >= 0 && assignment.vessels[chunk.parent] == vessel)
    {
      numberOf[c] = numberOf[chunk.parent];
    }
    const auto pick = [&](int first, int second, int third) {
      return numberOf[c] == 1 ? first : numberOf[c] == 2 ? second : numberOf[c] == 3 ? third : 0;
    };
    const auto& points = this->Tree.branches[chunk.branch].points;
    const bool root = chunk.parent < 0;
    if (!root && assignment.vessels[chunk.parent] == vessel)
    {
      stage[c] = stage[chunk.parent];
    }
    const auto advance = [&](std::int64_t point, const Border& first, const Border& second)
    {
      const int reached = passed(second, vessel, point) ? 2 : passed(first, vessel, point) ? 1 : 0;
      stage[c] = std::max(stage[c], reached);
      return stage[c];
    };
    const Border never{ Infinity, 0.0 };
    for (std::size_t i = chunk.first + (root ? 0 : 1); i <= chunk.last; ++i)
    {
      const std::int64_t point = points[i];
      int segment = 0;
      switch (vessel)
      {
        case V::LeftMain:
          segment = LeftMain;
          break;
        case V::AnteriorDescending:
          segment = ProximalLAD + advance(point, ladProximal, ladMid);
          break;
        case V::Circumflex:
        {
          constexpr int names[] = { ProximalLCx, DistalLCx, LeftPLB };
          segment = names[advance(point, circumflex, endsPosterolateral ? groove : never)];
          break;
        }
        case V::Ramus:
          segment = RamusIntermedius;
          break;
        case V::Diagonal:
          segment = pick(FirstDiagonal, SecondDiagonal, ThirdDiagonal);
          break;
        case V::Septal:
          segment = pick(FirstSeptal, SecondSeptal, ThirdSeptal);
          break;
        case V::ObtuseMarginal:
          segment = pick(FirstObtuseMarginal, SecondObtuseMarginal, ThirdObtuseMarginal);
          break;
        case V::LeftPosterolateral:
          segment = LeftPLB;
          break;
        case V::LeftPosteriorDescending:
          segment = LeftPDA;
          break;
        case V::RightCoronary:
          segment = ProximalRCA + advance(point, rcaProximal, rcaMid);
          break;
        case V::RightVentricular:
          segment = RightVentricularBranch;
          break;
        case V::AcuteMarginal:
          segment = AcuteMarginal;
          break;
        case V::RightPosteriorDescending:
          segment = RightPDA;
          break;
        case V::RightPosterolateral:
          segment = RightPLB;
          break;
        case V::InferiorRight:
          segment = InferiorRightBranch;
          break;
        case V::Other:
          break;
      }
      this->Tree.segmentId[point] = segment;
    }
  }
  for (auto& branch : this->Tree.branches)
  {
    std::map<int, double> lengths;
    for (std::size_t i = 1; i < branch.points.size(); ++i)
    {
      lengths[this->Tree.segmentId[branch.points[i]]] +=
        (this->Tree.points[branch.points[i]] - this->Tree.points[branch.points[i - 1]]).norm();
    }
    branch.segmentId = std::max_element(lengths.begin(), lengths.end(),
      [](const auto& a, const auto& b) {
        return a.second < b.second;
      })->first;
    const Side side = assignment.sides[branch.treeId];
    branch.treeId = side == Side::Left ? 0 : side == Side::Right ? 1 : -1;
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
  std::vector<std::pair<Assignment, Pose>> results(candidates.size() * dominances.size());
  ParallelFor(
    static_cast<std::int64_t>(results.size()), 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const Candidate& candidate = candidates[i / dominances.size()];
        const Dominance dominance = dominances[i % dominances.size()];
        Pose pose = candidate.pose;
        Assignment best = this->Assign(pose, candidate.sides, dominance);
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
  for (std::size_t c = 0; c < this->Chunks.size(); ++c)
  {
    for (std::size_t s = this->Chunks[c].firstSample; s < this->Chunks[c].lastSample; ++s)
    {
      double best = Infinity;
      for (const SegmentAtlas::Point& point : this->Atlas.points)
      {
        if (point.vessel == assignment.vessels[c])
        {
          best =
            std::min(best, (point.position - pose.Apply(this->Samples[s].position)).squaredNorm());
        }
      }
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
  result.heart.size = this->Unit / size;
  result.heart.origin =
    this->Centre + this->Unit * (pose.matrix.inverse() * (this->Atlas.origin - pose.shift));
  result.fit.matrix = pose.matrix / this->Unit;
  result.fit.shift = pose.shift - result.fit.matrix * this->Centre;
  this->NameSegments(pose, assignment);
  return result;
}
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
  std::vector<CenterlineTree::Branch> branches;
  std::vector<double> meanRadius;
  std::vector<char> inLoop;
  std::vector<int> first(count, 0);
  std::vector<int> last(count, 0);
  int cuts = 0;
  for (std::size_t b = 0; b < count; ++b)
  {
    const CenterlineTree::Branch& branch = tree.branches[b];
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
    const double least = 2.0 * tree.meanRadius[b];
    for (std::size_t i = 2; i < branch.points.size(); ++i)
    {
      if (segmentOf(i) == segmentOf(i - 1))
      {
        continue;
      }
      if (lengthOf(starts.back(), i) >= least)
      {
        starts.push_back(i);
      }
      else if (starts.size() > 1 && segmentOf(i) == segmentOf(starts[starts.size() - 2]))
      {
        starts.pop_back();
      }
      // Else the short stretch stays the beginning of the one that follows.
    }
    while (starts.size() > 1 && lengthOf(starts.back(), branch.points.size()) < least)
    {
      starts.pop_back();
    }
    cuts += static_cast<int>(starts.size()) - 1;
    first[b] = static_cast<int>(branches.size());
    for (std::size_t p = 0; p < starts.size(); ++p)
    {
      const std::size_t end = p + 1 < starts.size() ? starts[p + 1] : branch.points.size();
      CenterlineTree::Branch piece = branch;
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
