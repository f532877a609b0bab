#include "CenterlineTracking.h"

#include "DisplacementLabels.h"
#include "SparseVolume.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr double NaN = std::numeric_limits<double>::quiet_NaN();
/// Nearer in time than this, modulo the cycle, two phases show the same moment.
constexpr double SameMoment = 0.02;
/// Correlation of a vessel with what was expected, above which it counts as seen.
constexpr double TrackedLikeness = 0.65;
constexpr double TrackedConfidence = 0.5;
constexpr double WeakConfidence = 0.2;
constexpr double FilledConfidence = 0.3; ///< at most
constexpr double LostDeviation = 2.0;    ///< mm
/// Nothing is found better than that, or than a share of a voxel, mm.
constexpr double TissueDeviation = 0.5;
constexpr double VesselDeviation = 0.15;
/// Beyond the patch, the search and the smearing: what the places may still move, mm.
constexpr double Spare = 3.0;

void RequireRange(const char* name, double value, double least, double greatest)
{
  if (!(value >= least && value <= greatest))
  {
    throw std::invalid_argument(std::string("CenterlineTrackingSettings: ") + name +
      " must be from " + std::to_string(least) + " to " + std::to_string(greatest));
  }
}

/// Distance of two times modulo the cycle.
double CyclicDistance(double a, double b)
{
  const double apart = std::abs(a - b);
  return std::abs(apart - std::round(apart));
}

/// Places of a sphere around a node, on a lattice, with weights that fall off outwards.
struct Patch
{
  std::vector<std::array<int, 3>> places;
  std::vector<float> weights;
  int reach = 0;
  double step = 1.0;

  /// From the node, mm.
  Vector3 Offset(std::size_t p) const
  {
    return this->step * Vector3(this->places[p][0], this->places[p][1], this->places[p][2]);
  }

  Patch(double radius, double spacing)
    : reach(static_cast<int>(radius / spacing))
    , step(spacing)
  {
    for (int k = -this->reach; k <= this->reach; ++k)
    {
      for (int j = -this->reach; j <= this->reach; ++j)
      {
        for (int i = -this->reach; i <= this->reach; ++i)
        {
          const double apart = spacing * std::sqrt(i * i + j * j + k * k) / radius;
          if (apart <= 1.0)
          {
            this->places.push_back({ i, j, k });
            this->weights.push_back(static_cast<float>(std::exp(-1.5 * apart * apart)));
          }
        }
      }
    }
    const float sum = std::accumulate(this->weights.begin(), this->weights.end(), 0.0F);
    for (float& weight : this->weights)
    {
      weight /= sum;
    }
  }
};

/// Weighted mean squared difference of `wanted` and the block, for every shift of the lattice.
void SumsOfSquares(const std::vector<float>& block, int blockSide, const Patch& patch,
  const std::vector<float>& weights, const std::vector<float>& wanted, int labelReach,
  std::vector<float>& costs)
{
  const int side = 2 * labelReach + 1;
  costs.assign(static_cast<std::size_t>(side) * side * side, 0.0F);
  for (std::size_t p = 0; p < patch.places.size(); ++p)
  {
    const std::array<int, 3>& place = patch.places[p];
    const float weight = weights[p];
    if (weight <= 0.0F)
    {
      continue;
    }
    const float value = wanted[p];
    // The block's corner is -(patch reach + label reach).
    const float* corner = block.data() +
      ((place[2] + patch.reach) * blockSide + place[1] + patch.reach) * blockSide + place[0] +
      patch.reach;
    for (int k = 0; k < side; ++k)
    {
      for (int j = 0; j < side; ++j)
      {
        const float* row = corner + (k * blockSide + j) * blockSide;
        float* out = costs.data() + (k * side + j) * side;
        for (int i = 0; i < side; ++i)
        {
          const float difference = row[i] - value;
          out[i] += weight * difference * difference;
        }
      }
    }
  }
}

/// What the sums of squares say, in natural logarithms: 0 for the best candidate, limited, since a
/// patch may show something that the reference does not.
void ToLikelihoods(
  std::vector<std::vector<float>>& costs, double independent, double limit, double floor)
{
  std::vector<float> least;
  least.reserve(costs.size());
  for (const std::vector<float>& one : costs)
  {
    least.push_back(*std::min_element(one.begin(), one.end()));
  }
  std::vector<float> sorted = least;
  std::nth_element(
    sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const float typical = std::max(sorted[sorted.size() / 2], static_cast<float>(floor));
  for (std::size_t n = 0; n < costs.size(); ++n)
  {
    const float scale = static_cast<float>(0.5 * independent) / std::max(least[n], typical);
    for (float& value : costs[n])
    {
      value = std::min((value - least[n]) * scale, static_cast<float>(limit));
    }
  }
}

struct Window
{
  float low = 0.0F;
  float high = 0.0F;
  float operator()(float value) const { return std::clamp(value, this->low, this->high); }
};

double Correlation(const std::vector<float>& a, const std::vector<float>& b)
{
  const auto count = static_cast<double>(a.size());
  const double meanA = std::accumulate(a.begin(), a.end(), 0.0) / count;
  const double meanB = std::accumulate(b.begin(), b.end(), 0.0) / count;
  double aa = 0.0;
  double bb = 0.0;
  double ab = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n)
  {
    aa += (a[n] - meanA) * (a[n] - meanA);
    bb += (b[n] - meanB) * (b[n] - meanB);
    ab += (a[n] - meanA) * (b[n] - meanB);
  }
  return ab / std::sqrt(std::max(aa * bb, 1e-9));
}

/**
 * Mean outer products of an image's gradients, of which a part is the image's noise: what is left
 * without it. Noise has gradients along an even vessel too, which say nothing about the way along it.
 */
class SignalCurvature
{
public:
  SignalCurvature(const Matrix3& curvature, double noise)
    : Eigen(curvature)
    , Left(this->Eigen.eigenvalues().unaryExpr(
        [&](double value) { return std::max(value - noise, 0.0); }))
    , Noise(noise)
  {
  }

  /// The noise takes part in the error: l^2 / (l + noise) instead of l.
  Matrix3 Information() const
  {
    return this->Along(this->Left.unaryExpr(
      [&](double value) { return value > 0.0 ? value * value / (value + this->Noise) : 0.0; }));
  }

  Vector3 Solve(const Vector3& pull) const
  {
    const double damping = 0.2 * this->Noise + 1e-3 * this->Left.sum() + 1e-3;
    return this->Along((this->Left.array() + damping).inverse()) * pull;
  }

  /// Of nodes with as many images averaged in each: the noise in one, when the third of them that has the
  /// least to be seen in some direction has nothing there but noise.
  static double NoiseOf(const std::vector<Matrix3>& curvatures, const std::vector<int>& averaged)
  {
    std::vector<double> least;
    for (std::size_t n = 0; n < curvatures.size(); ++n)
    {
      if (curvatures[n].trace() > 0.0)
      {
        least.push_back(
          averaged[n] * Eigen::SelfAdjointEigenSolver<Matrix3>(curvatures[n]).eigenvalues()[0]);
      }
    }
    if (least.empty())
    {
      return 0.0;
    }
    const auto third = least.begin() + static_cast<std::ptrdiff_t>(least.size() / 3);
    std::nth_element(least.begin(), third, least.end());
    return std::max(*third, 0.0);
  }

private:
  Matrix3 Along(const Vector3& values) const
  {
    return this->Eigen.eigenvectors() * values.asDiagonal() *
      this->Eigen.eigenvectors().transpose();
  }

  Eigen::SelfAdjointEigenSolver<Matrix3> Eigen;
  Vector3 Left;
  double Noise;
};

/// An inverse covariance after the method's own error, mm, was added.
Matrix3 Limited(const Matrix3& information, double deviation)
{
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(information);
  const Vector3 limited = eigen.eigenvalues().unaryExpr(
    [&](double value) { return value > 0.0 ? 1.0 / (1.0 / value + deviation * deviation) : 0.0; });
  return eigen.eigenvectors() * limited.asDiagonal() * eigen.eigenvectors().transpose();
}

std::vector<std::vector<int>> Daughters(const LineNodes& nodes)
{
  std::vector<std::vector<int>> daughters(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    if (nodes.parent[n] >= 0)
    {
      daughters[nodes.parent[n]].push_back(static_cast<int>(n));
    }
  }
  return daughters;
}

double NodeRadius(const LineNodes& nodes, int node)
{
  return nodes.radius.empty() ? 1.5 : nodes.radius[node];
}

/**
 * Where things around a node go when all vessels widen: outwards from the nearest axis by its distance
 * from it, beyond the wall less and less. On a lattice, mm per unit of the logarithm of the radius.
 */
class WideningField
{
public:
  WideningField(const LineNodes& nodes, const std::vector<std::vector<int>>& daughters, int node)
  {
    struct Step
    {
      Vector3 start;
      Vector3 end;
      double radius;
      double wider;
    };
    std::vector<Step> steps;
    const Vector3& centre = nodes.position[node];
    // Vessels that are near in space are near in the tree, but for crossings.
    std::vector<std::pair<int, int>> open{ { node, -1 } };
    while (!open.empty())
    {
      // No structured binding: clang 14 lets no lambda capture one.
      const int at = open.back().first;
      const int from = open.back().second;
      open.pop_back();
      const auto go = [&](int next, int upper, int lower)
      {
        if (next < 0 || next == from)
        {
          return;
        }
        const double wide = NodeRadius(nodes, upper);
        steps.push_back({ nodes.position[upper] - centre, nodes.position[lower] - centre, wide,
          NodeRadius(nodes, lower) - wide });
        if ((nodes.position[next] - centre).norm() < 2.0 * Reach)
        {
          open.emplace_back(next, at);
        }
      };
      go(nodes.parent[at], nodes.parent[at], at);
      for (const int daughter : daughters[at])
      {
        go(daughter, at, daughter);
      }
    }
    this->Values.resize(static_cast<std::size_t>(Side) * Side * Side, Eigen::Vector3f::Zero());
    std::size_t index = 0;
    for (int k = 0; k < Side; ++k)
    {
      for (int j = 0; j < Side; ++j)
      {
        for (int i = 0; i < Side; ++i, ++index)
        {
          const Vector3 place = Spacing * Vector3(i, j, k) - Vector3::Constant(Reach);
          double least = Beyond;
          Vector3 out = Vector3::Zero();
          for (const Step& step : steps)
          {
            const SegmentPlace near = NearestOnSegment(place, step.start, step.end);
            const double fromWall =
              std::sqrt(near.squaredDistance) - step.radius - near.fraction * step.wider;
            if (fromWall < least)
            {
              least = fromWall;
              out = place - near.position;
            }
          }
          const double share = std::clamp((Beyond - least) / (Beyond - Within), 0.0, 1.0);
          this->Values[index] = (share * out).cast<float>();
        }
      }
    }
  }

  /// @param place  mm from the node, at rest
  Vector3 At(const Vector3& place) const
  {
    const Vector3 index = (place + Vector3::Constant(Reach)) / Spacing;
    if (!((index.array() >= 0.0).all() && (index.array() < Side - 1).all()))
    {
      return Vector3::Zero();
    }
    const Eigen::Vector3i corner = index.cast<int>();
    const Vector3 part = index - corner.cast<double>();
    Vector3 sum = Vector3::Zero();
    for (int c = 0; c < 8; ++c)
    {
      const int i = corner[0] + (c & 1);
      const int j = corner[1] + ((c >> 1) & 1);
      const int k = corner[2] + (c >> 2);
      const double share = ((c & 1) != 0 ? part[0] : 1.0 - part[0]) *
        ((c & 2) != 0 ? part[1] : 1.0 - part[1]) * ((c & 4) != 0 ? part[2] : 1.0 - part[2]);
      sum += share * this->Values[(k * Side + j) * Side + i].cast<double>();
    }
    return sum;
  }

private:
  static constexpr double Spacing = 0.5;
  static constexpr double Reach = 4.5; // mm, of the core and what it is smeared by
  static constexpr int Side = 19;
  // Things move with the wall as far as it is blurred, and not at all further out, mm from it.
  static constexpr double Within = 0.4;
  static constexpr double Beyond = 1.2;
  std::vector<Eigen::Vector3f> Values;
};

class Tracker
{
public:
  Tracker(const MovingLines& lines, double referenceTime, const std::vector<double>& times,
    const std::function<ScalarImage(double time)>& imageAt,
    const CenterlineTrackingSettings& settings, CenterlineTrackingReport& report,
    const ProgressCallback& progress, RankGroup& ranks)
    : Lines(lines)
    , ReferenceTime(referenceTime)
    , Times(times)
    , ImageAt(imageAt)
    , Settings(settings)
    , Result(report)
    , Progress(progress)
    , Ranks(ranks)
    , Nodes(PlaceNodes(lines, settings.nodeSpacing))
    , Coarse(settings.coarseRadius, settings.coarseSpacing)
    , Fine(settings.fineRadius, 1.0)
    , Core(3.0, 0.5)
  {
  }

  PoseSequence Run();

private:
  using PerPhase = std::vector<std::vector<Vector3>>;
  using Measurements = std::vector<std::vector<TrajectoryMeasurement>>;

  struct Seen
  {
    PerPhase displacement;                         ///< per phase and node, mm
    std::vector<std::vector<Matrix3>> information; ///< of each, 1/mm^2
    double robustScale = 1.0;                      ///< mm
  };

  /// A part of the whole progress.
  ProgressCallback Part(double from, double to) const;
  ScalarImage Read(double time);
  void MeasureContrast();
  void SearchCoarsely();
  /// Positions in `order`, each of the phase whose place is the guess of the one at this position; none: -1.
  std::vector<std::ptrdiff_t> Guesses(const std::vector<std::size_t>& order) const;
  /// Looks for the surroundings of the nodes without the vessels, which may be invisible, or with
  /// them.
  Seen SearchFinely(bool vessels, double progressFrom);
  /// Per node: the patch's weights without what is nearer to a vessel's wall than `margin`, sum 1; all 0
  /// where too little is left.
  std::vector<std::vector<float>> WithoutVessels(const Patch& patch, double margin) const;
  void Align(double robustScale, double progressFrom);
  void Finish(PoseSequence& sequence);
  /// Per phase: factor of the radius, of all vessels together.
  std::vector<double> MeasureCalibre() const;
  /// Mean distance, across the vessels, of what was seen in phases that show the same moment.
  void MeasureRepeatability();
  /// Fits the trajectories to what was measured; what does not agree counts less.
  void Fit(const std::vector<const Seen*>& seen);
  std::vector<const Seen*> WithSurroundings(const Seen& seen) const
  {
    return this->Settings.tissue ? std::vector<const Seen*>{ &seen, &this->Surroundings }
                                 : std::vector<const Seen*>{ &seen };
  }
  double Keep() const { return this->Settings.fineRadius + this->Settings.fineRange + Spare; }
  /// Squared difference that is not worth mentioning: of 4 % of a vessel's contrast.
  double NoiseFloor() const { return 0.0016 * this->Contrast * this->Contrast; }
  double WindowOfCycle() const
  {
    return this->Settings.temporalWindow / this->Settings.cycleLength;
  }
  /// How far the node moves from its place at `time` over the window, at even moments of it.
  std::vector<Vector3> Smear(int node, double time) const;
  /// The rotation from the reference to the phase, without a twist about the vessel.
  Matrix3 Turn(int node, const std::vector<Vector3>& displacement) const;
  std::vector<Vector3> PlacesAt(const std::vector<Vector3>& displacement) const;

  const MovingLines& Lines;
  const double ReferenceTime;
  const std::vector<double>& Times;
  const std::function<ScalarImage(double time)>& ImageAt;
  const CenterlineTrackingSettings& Settings;
  CenterlineTrackingReport& Result;
  const ProgressCallback& Progress;
  RankGroup& Ranks;

  LineNodes Nodes;
  Patch Coarse;
  Patch Fine;
  Patch Core;
  Vector3 Low;
  Vector3 High;
  Window Limits;
  double Contrast = 1.0; ///< of the vessels in the reference
  double Voxel = 0.4;    ///< largest edge of the reference's voxels, mm
  SparseVolume Reference;
  std::vector<bool> Own;             ///< per phase: of this rank's share
  std::vector<SparseVolume> Volumes; ///< per phase; empty where it is another rank's
  PerPhase Displacement;             ///< per phase and node: the present trajectories
  Trajectories Motion;
  Seen Surroundings; ///< where the tissue around the nodes was found; empty: not looked for
  Seen Vessels;      ///< by the last alignment
  std::vector<std::vector<double>> Likeness; ///< per phase and node: correlation of the core
};

ProgressCallback Tracker::Part(double from, double to) const
{
  return this->Progress ? ProgressCallback([this, from, to](double done)
                            { return this->Progress(from + done * (to - from)); })
                        : ProgressCallback();
}

ScalarImage Tracker::Read(double time)
{
  ++this->Result.imagesRead;
  ScalarImage image = this->ImageAt(time);
  const std::array<int, 3> size = image.Dimensions();
  if (size[0] < 1 || size[1] < 1 || size[2] < 1 ||
    std::visit([](const auto* values) { return values == nullptr; }, image.values))
  {
    throw std::invalid_argument("The image at " + std::to_string(time) + " has no voxels");
  }
  return image;
}

std::vector<Vector3> Tracker::PlacesAt(const std::vector<Vector3>& displacement) const
{
  std::vector<Vector3> places(this->Nodes.size());
  for (std::size_t n = 0; n < places.size(); ++n)
  {
    places[n] = this->Nodes.position[n] + displacement[n];
  }
  return places;
}

Matrix3 Tracker::Turn(int node, const std::vector<Vector3>& displacement) const
{
  // The tangent's change by the displacements of the neighbours.
  const int parent = this->Nodes.parent[node];
  if (parent < 0)
  {
    return Matrix3::Identity();
  }
  const Vector3 rest = this->Nodes.position[node] - this->Nodes.position[parent];
  const Vector3 moved = rest + displacement[node] - displacement[parent];
  if (rest.norm() < 1e-6 || moved.norm() < 1e-6)
  {
    return Matrix3::Identity();
  }
  return Eigen::Quaterniond::FromTwoVectors(rest, moved).toRotationMatrix();
}

std::vector<Vector3> Tracker::Smear(int node, double time) const
{
  const double window = this->WindowOfCycle();
  if (window <= 0.0)
  {
    return { Vector3::Zero() };
  }
  const Vector3 now = this->Motion.Displacement(node, time);
  const double length = (this->Motion.Displacement(node, time + 0.5 * window) - now).norm() +
    (now - this->Motion.Displacement(node, time - 0.5 * window)).norm();
  const int count = std::clamp(2 * static_cast<int>(std::ceil(length / 1.2)) + 1, 1, 13);
  std::vector<Vector3> result;
  for (int n = 0; n < count; ++n)
  {
    const double at = time + window * ((n + 0.5) / count - 0.5);
    result.push_back(this->Motion.Displacement(node, at) - now);
  }
  return result;
}

void Tracker::MeasureContrast()
{
  std::vector<float> contrasts;
  for (const Vector3& centre : this->Nodes.position)
  {
    std::vector<float> values;
    for (std::size_t p = 0; p < this->Core.places.size(); ++p)
    {
      const float value = this->Reference.Sample(centre + this->Core.Offset(p));
      if (!std::isnan(value))
      {
        values.push_back(value);
      }
    }
    if (2 * values.size() > this->Core.places.size())
    {
      std::sort(values.begin(), values.end());
      contrasts.push_back(values[values.size() * 19 / 20] - values[values.size() / 20]);
    }
  }
  if (2 * contrasts.size() < this->Nodes.size())
  {
    throw std::invalid_argument(
      "Most of the lines are outside of the image at the reference time " +
      std::to_string(this->ReferenceTime));
  }
  std::sort(contrasts.begin(), contrasts.end());
  this->Contrast = contrasts[contrasts.size() / 2];
  if (!(this->Contrast > 0.0))
  {
    throw std::invalid_argument("The image at the reference time " +
      std::to_string(this->ReferenceTime) + " is the same everywhere along the lines");
  }
}

void Tracker::SearchCoarsely()
{
  const std::size_t phases = this->Times.size();
  const auto nodes = static_cast<std::int64_t>(this->Nodes.size());
  const LabelLattice lattice{ static_cast<int>(std::ceil(
                                this->Settings.captureRange / this->Settings.coarseSpacing)),
    this->Settings.coarseSpacing };
  const int blockReach = this->Coarse.reach + lattice.reach;
  const int blockSide = 2 * blockReach + 1;

  this->Low = Vector3::Constant(std::numeric_limits<double>::infinity());
  this->High = -this->Low;
  for (const Vector3& place : this->Nodes.position)
  {
    this->Low = this->Low.cwiseMin(place);
    this->High = this->High.cwiseMax(place);
  }
  const Vector3 margin = Vector3::Constant(
    std::max(30.0, 2.0 * this->Settings.captureRange) + this->Settings.coarseRadius);
  this->Low -= margin;
  this->High += margin;

  // The reference.
  AveragedVolume averaged;
  {
    const ScalarImage image = this->Read(this->ReferenceTime);
    this->Voxel = image.grid.spacing.maxCoeff();
    averaged = AverageBlocks(image, this->Settings.coarseSpacing, this->Low, this->High);
    this->Reference = SparseVolume(image, this->Nodes.position, this->Keep());
  }
  this->MeasureContrast();
  const std::vector<std::vector<float>> weights = this->Settings.tissue
    ? this->WithoutVessels(this->Coarse, 0.5 * this->Settings.coarseSpacing)
    : std::vector<std::vector<float>>(nodes, this->Coarse.weights);
  std::vector<std::vector<float>> wanted(nodes);
  std::vector<float> all;
  for (std::int64_t n = 0; n < nodes; ++n)
  {
    for (std::size_t p = 0; p < this->Coarse.places.size(); ++p)
    {
      wanted[n].push_back(averaged.Sample(this->Nodes.position[n] + this->Coarse.Offset(p)));
      all.push_back(wanted[n].back());
    }
  }
  // Air and bone would outvote the rest.
  std::sort(all.begin(), all.end());
  const float median = all[all.size() / 2];
  const float spread =
    std::max(all[all.size() * 9 / 10] - all[all.size() / 10], static_cast<float>(this->Contrast));
  this->Limits = { median - spread, median + spread };
  for (std::vector<float>& one : wanted)
  {
    std::transform(one.begin(), one.end(), one.begin(), this->Limits);
  }

  // Outwards from the reference, so that a neighbour in time is known.
  std::vector<std::size_t> order(phases);
  std::iota(order.begin(), order.end(), std::size_t{ 0 });
  std::stable_sort(order.begin(), order.end(),
    [&](std::size_t a, std::size_t b)
    {
      return CyclicDistance(this->Times[a], this->ReferenceTime) <
        CyclicDistance(this->Times[b], this->ReferenceTime);
    });
  const std::vector<std::ptrdiff_t> guesses = this->Guesses(order);
  this->Displacement.assign(phases, {});
  this->Volumes.resize(phases);
  this->Own.assign(phases, false);
  const auto search = [&](
                        std::size_t position, const ScalarImage& image, const AveragedVolume& moved)
  {
    const std::size_t phase = order[position];
    std::vector<Vector3> places = guesses[position] < 0
      ? std::vector<Vector3>(nodes, Vector3::Zero())
      : this->Displacement[order[static_cast<std::size_t>(guesses[position])]];
    std::vector<std::vector<float>> costs(nodes);
    ParallelFor(
      nodes, 4,
      [&](std::int64_t first, std::int64_t last)
      {
        std::vector<float> block(static_cast<std::size_t>(blockSide) * blockSide * blockSide);
        for (std::int64_t n = first; n < last; ++n)
        {
          const Vector3 centre = this->Nodes.position[n] + places[n];
          std::size_t at = 0;
          for (int k = -blockReach; k <= blockReach; ++k)
          {
            for (int j = -blockReach; j <= blockReach; ++j)
            {
              for (int i = -blockReach; i <= blockReach; ++i)
              {
                block[at++] = this->Limits(moved.Sample(centre + lattice.step * Vector3(i, j, k)));
              }
            }
          }
          SumsOfSquares(
            block, blockSide, this->Coarse, weights[n], wanted[n], lattice.reach, costs[n]);
        }
      },
      this->Part(0.6 * (static_cast<double>(position) + 0.3) / static_cast<double>(phases),
        0.6 * static_cast<double>(position + 1) / static_cast<double>(phases)));
    ToLikelihoods(costs, 30.0, 20.0, 0.1 * this->NoiseFloor());
    const std::vector<Vector3> best = BestDisplacements(this->Nodes, lattice, costs, 0.5);
    for (std::int64_t n = 0; n < nodes; ++n)
    {
      places[n] += best[n];
    }
    this->Volumes[phase] = SparseVolume(image, this->PlacesAt(places), this->Keep());
    return places;
  };
  // A phase for each rank at a time: all read theirs at once, and search when the guess is known.
  const auto ranks = static_cast<std::size_t>(this->Ranks.Size());
  for (std::size_t first = 0; first < phases; first += ranks)
  {
    const std::size_t end = std::min(phases, first + ranks);
    const std::size_t own = first + static_cast<std::size_t>(this->Ranks.Rank());
    ScalarImage image;
    AveragedVolume moved;
    if (own < end)
    {
      this->Own[order[own]] = true;
      image = this->Read(this->Times[order[own]]);
      moved = AverageBlocks(image, this->Settings.coarseSpacing, this->Low, this->High);
    }
    std::vector<bool> ready;
    const auto isOpen = [&](std::size_t position)
    { return this->Displacement[order[position]].empty(); };
    for (std::size_t open = end - first; open > 0;)
    {
      ready.assign(end - first, false);
      for (std::size_t position = first; position < end; ++position)
      {
        const std::ptrdiff_t guess = guesses[position];
        ready[position - first] =
          isOpen(position) && (guess < 0 || !isOpen(static_cast<std::size_t>(guess)));
      }
      std::vector<std::vector<Vector3>> found(phases);
      if (own < end && ready[own - first])
      {
        found[order[own]] = search(own, image, moved);
      }
      ShareLists(this->Ranks, found);
      for (std::size_t position = first; position < end; ++position)
      {
        if (ready[position - first])
        {
          this->Displacement[order[position]] = std::move(found[order[position]]);
          --open;
        }
      }
    }
  }
  const Seen seen{ this->Displacement,
    std::vector<std::vector<Matrix3>>(
      phases, std::vector<Matrix3>(nodes, Matrix3::Identity() / (1.5 * 1.5))),
    2.5 };
  this->Fit({ &seen });
}

std::vector<std::ptrdiff_t> Tracker::Guesses(const std::vector<std::size_t>& order) const
{
  std::vector<std::ptrdiff_t> guesses(order.size(), -1);
  for (std::size_t position = 0; position < order.size(); ++position)
  {
    const double time = this->Times[order[position]];
    double nearest = CyclicDistance(time, this->ReferenceTime);
    for (std::size_t before = 0; before < position; ++before)
    {
      const double apart = CyclicDistance(time, this->Times[order[before]]);
      if (apart < nearest)
      {
        nearest = apart;
        guesses[position] = static_cast<std::ptrdiff_t>(before);
      }
    }
  }
  return guesses;
}

void Tracker::Fit(const std::vector<const Seen*>& seen)
{
  const std::size_t phases = this->Times.size();
  const std::size_t nodes = this->Nodes.size();
  std::vector<double> times = this->Times;
  times.push_back(this->ReferenceTime);
  // At the reference the lines are where they are.
  const TrajectoryMeasurement fixed{ static_cast<int>(phases), Vector3::Zero(),
    Matrix3::Identity() / (0.05 * 0.05) };
  for (int round = 0; round < 6; ++round)
  {
    Measurements measurements(nodes, { fixed });
    for (const Seen* one : seen)
    {
      const double scale = one->robustScale * std::max(1.0, 3.0 - round);
      for (std::size_t n = 0; n < nodes; ++n)
      {
        for (std::size_t k = 0; k < phases; ++k)
        {
          const Vector3& displacement = one->displacement[k][n];
          double share = 1.0;
          if (round > 0)
          {
            const double apart =
              (this->Motion.Displacement(static_cast<int>(n), times[k]) - displacement).norm();
            share = 1.0 / (1.0 + apart * apart / (scale * scale));
          }
          measurements[n].push_back({ static_cast<int>(k), displacement,
            one->information[k][n] * share * share }); // Geman & McClure
        }
      }
    }
    this->Motion = FitTrajectories(this->Nodes, times, measurements, this->Settings.prior);
  }
  for (std::size_t k = 0; k < phases; ++k)
  {
    for (std::size_t n = 0; n < nodes; ++n)
    {
      this->Displacement[k][n] = this->Motion.Displacement(static_cast<int>(n), times[k]);
    }
  }
}

std::vector<std::vector<float>> Tracker::WithoutVessels(const Patch& patch, double margin) const
{
  const auto nodes = static_cast<std::int64_t>(this->Nodes.size());
  std::vector<std::vector<float>> weights(nodes, patch.weights);
  const double reach = patch.reach * patch.step;
  ParallelFor(nodes, 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        const Vector3& centre = this->Nodes.position[n];
        for (std::int64_t other = 0; other < nodes; ++other)
        {
          const int parent = this->Nodes.parent[other];
          const Vector3& a = this->Nodes.position[other];
          const Vector3& b = this->Nodes.position[parent >= 0 ? parent : other];
          const double wall = NodeRadius(this->Nodes, static_cast<int>(other)) + margin;
          if ((a - centre).norm() > reach + wall + (b - a).norm())
          {
            continue;
          }
          for (std::size_t p = 0; p < patch.places.size(); ++p)
          {
            if (NearestOnSegment(centre + patch.Offset(p), a, b).squaredDistance < wall * wall)
            {
              weights[n][p] = 0.0F;
            }
          }
        }
        const float sum = std::accumulate(weights[n].begin(), weights[n].end(), 0.0F);
        for (float& weight : weights[n])
        {
          weight = sum > 0.1F ? weight / sum : 0.0F;
        }
      }
    });
  return weights;
}

Tracker::Seen Tracker::SearchFinely(bool vessels, double progressFrom)
{
  const std::size_t phases = this->Times.size();
  const auto nodes = static_cast<std::int64_t>(this->Nodes.size());
  const LabelLattice lattice{ static_cast<int>(std::ceil(this->Settings.fineRange)), 1.0 };
  const int blockReach = this->Fine.reach + lattice.reach;
  const int blockSide = 2 * blockReach + 1;
  const std::size_t samples = this->Fine.places.size();
  const std::vector<std::vector<float>> weights = vessels
    ? std::vector<std::vector<float>>(nodes, this->Fine.weights)
    : this->WithoutVessels(this->Fine, 0.8);
  Seen seen{ PerPhase(phases), std::vector<std::vector<Matrix3>>(phases), 1.5 };
  for (std::size_t k = 0; k < phases; ++k)
  {
    if (!this->Own[k])
    {
      continue;
    }
    seen.information[k].assign(nodes, Matrix3::Zero());
    const std::vector<Vector3> places = this->PlacesAt(this->Displacement[k]);
    if (!std::all_of(places.begin(), places.end(),
          [&](const Vector3& place)
          { return this->Volumes[k].Covers(place, this->Keep() - Spare); }))
    {
      this->Volumes[k] = SparseVolume(this->Read(this->Times[k]), places, this->Keep());
    }
    std::vector<std::vector<float>> costs(nodes);
    std::vector<std::vector<float>> blocks(nodes);
    std::vector<std::vector<float>> expected(nodes);
    std::vector<Matrix3> curvature(nodes, Matrix3::Zero());
    std::vector<int> averaged(nodes, 1);
    ParallelFor(
      nodes, 4,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          const Matrix3 back = this->Turn(static_cast<int>(n), this->Displacement[k]).transpose();
          const std::vector<Vector3> smear = this->Smear(static_cast<int>(n), this->Times[k]);
          averaged[n] = static_cast<int>(smear.size());
          const auto expect = [&](const Vector3& offset)
          {
            float sum = 0.0F;
            int count = 0;
            for (const Vector3& moved : smear)
            {
              const float value =
                this->Reference.Sample(this->Nodes.position[n] + back * (offset - moved));
              if (!std::isnan(value))
              {
                sum += this->Limits(value);
                ++count;
              }
            }
            return count > 0 ? sum / static_cast<float>(count) : this->Limits.low;
          };
          std::vector<float>& wanted = expected[n];
          wanted.resize(samples);
          for (std::size_t p = 0; p < samples; ++p)
          {
            if (weights[n][p] <= 0.0F)
            {
              continue;
            }
            const Vector3 offset = this->Fine.Offset(p);
            wanted[p] = expect(offset);
            if (!vessels)
            {
              Vector3 gradient;
              for (int axis = 0; axis < 3; ++axis)
              {
                const Vector3 away = 0.5 * Vector3::Unit(axis);
                gradient[axis] = expect(offset + away) - expect(offset - away);
              }
              curvature[n] += weights[n][p] * gradient * gradient.transpose();
            }
          }
          std::vector<float>& block = blocks[n];
          block.reserve(static_cast<std::size_t>(blockSide) * blockSide * blockSide);
          for (int c = -blockReach; c <= blockReach; ++c)
          {
            for (int b = -blockReach; b <= blockReach; ++b)
            {
              for (int a = -blockReach; a <= blockReach; ++a)
              {
                const float value = this->Volumes[k].Sample(places[n] + Vector3(a, b, c));
                block.push_back(std::isnan(value) ? this->Limits.low : this->Limits(value));
              }
            }
          }
          SumsOfSquares(block, blockSide, this->Fine, weights[n], wanted, lattice.reach, costs[n]);
        }
      },
      this->Part(progressFrom + 0.1 * static_cast<double>(k) / static_cast<double>(phases),
        progressFrom + 0.1 * static_cast<double>(k + 1) / static_cast<double>(phases)));
    const double noise = SignalCurvature::NoiseOf(curvature, averaged);
    std::vector<float> least(nodes);
    for (std::int64_t n = 0; n < nodes; ++n)
    {
      least[n] = *std::min_element(costs[n].begin(), costs[n].end());
    }
    ToLikelihoods(costs, 30.0, 15.0, 0.1 * this->NoiseFloor());
    seen.displacement[k] = BestDisplacements(this->Nodes, lattice, costs, 0.25);
    for (std::int64_t n = 0; n < nodes; ++n)
    {
      if (vessels)
      {
        // Is there a vessel where it was found?
        const Vector3& shift = seen.displacement[k][n];
        const int at[3] = { static_cast<int>(std::lround(shift[0])),
          static_cast<int>(std::lround(shift[1])), static_cast<int>(std::lround(shift[2])) };
        std::vector<float> there;
        std::vector<float> wanted;
        for (std::size_t p = 0; p < samples; ++p)
        {
          const std::array<int, 3>& place = this->Fine.places[p];
          if (place[0] * place[0] + place[1] * place[1] + place[2] * place[2] <= 9)
          {
            there.push_back(blocks[n][((place[2] + at[2] + blockReach) * blockSide + place[1] +
                                        at[1] + blockReach) *
                blockSide +
              place[0] + at[0] + blockReach]);
            wanted.push_back(expected[n][p]);
          }
        }
        const double trust = std::clamp((Correlation(there, wanted) - 0.4) / 0.4, 0.0, 1.0);
        seen.information[k][n] = Matrix3::Identity() * (trust * trust / (0.6 * 0.6));
      }
      else
      {
        seen.information[k][n] =
          Limited(SignalCurvature(curvature[n], noise / averaged[n]).Information() *
              (30.0 / std::max<double>(least[n], this->NoiseFloor())),
            std::max(TissueDeviation, 0.8 * this->Voxel));
      }
      seen.displacement[k][n] += this->Displacement[k][n];
    }
  }
  ShareLists(this->Ranks, seen.displacement);
  ShareLists(this->Ranks, seen.information);
  return seen;
}

void Tracker::Align(double robustScale, double progressFrom)
{
  const std::size_t phases = this->Times.size();
  const auto nodes = static_cast<std::int64_t>(this->Nodes.size());
  const double h = 0.25;
  PerPhase measured(phases);
  std::vector<std::vector<Matrix3>> information(phases);
  this->Likeness.assign(phases, {});
  const std::size_t samples = this->Core.places.size();
  // What is expected to be seen of a node.
  struct Sight
  {
    std::vector<float> wanted;
    std::vector<Eigen::Vector3f> gradient;
    std::vector<float> weight;
  };
  std::vector<Sight> sights(nodes);
  for (std::size_t k = 0; k < phases; ++k)
  {
    if (!this->Own[k])
    {
      continue;
    }
    measured[k].assign(nodes, Vector3::Zero());
    information[k].assign(nodes, Matrix3::Zero());
    this->Likeness[k].assign(nodes, 0.0);
    std::vector<Matrix3> expectedCurvature(nodes, Matrix3::Zero());
    std::vector<int> averaged(nodes, 1);
    const auto part = [&](double from, double to)
    {
      const double share = 0.05 / static_cast<double>(phases);
      // NOLINTNEXTLINE(clang-analyzer-cplusplus.NewDeleteLeaks): std::function frees what it holds
      return this->Part(progressFrom + share * (static_cast<double>(k) + from),
        progressFrom + share * (static_cast<double>(k) + to));
    };
    ParallelFor(
      nodes, 4,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          std::vector<float>& wanted = sights[n].wanted;
          std::vector<Eigen::Vector3f>& gradient = sights[n].gradient;
          std::vector<float>& weight = sights[n].weight;
          wanted.resize(samples);
          gradient.resize(samples);
          weight.resize(samples);
          const Matrix3 back = this->Turn(static_cast<int>(n), this->Displacement[k]).transpose();
          const std::vector<Vector3> smear = this->Smear(static_cast<int>(n), this->Times[k]);
          const auto expected = [&](const Vector3& offset)
          {
            float sum = 0.0F;
            for (const Vector3& moved : smear)
            {
              sum += this->Reference.Sample(this->Nodes.position[n] + back * (offset - moved));
            }
            return sum / static_cast<float>(smear.size());
          };
          for (std::size_t p = 0; p < samples; ++p)
          {
            const Vector3 offset = this->Core.Offset(p);
            wanted[p] = expected(offset);
            for (int axis = 0; axis < 3; ++axis)
            {
              const Vector3 away = h * Vector3::Unit(axis);
              gradient[p][axis] =
                (expected(offset + away) - expected(offset - away)) / static_cast<float>(2.0 * h);
            }
            weight[p] = std::isfinite(wanted[p] + gradient[p].sum()) ? this->Core.weights[p] : 0.0F;
          }
          Vector3 mean = Vector3::Zero();
          double sum = 0.0;
          for (std::size_t p = 0; p < samples; ++p)
          {
            if (weight[p] > 0.0F)
            {
              const Vector3 g = gradient[p].cast<double>();
              mean += weight[p] * g;
              expectedCurvature[n] += weight[p] * g * g.transpose();
              sum += weight[p];
            }
          }
          if (sum > 0.0)
          {
            expectedCurvature[n] =
              expectedCurvature[n] / sum - mean * mean.transpose() / (sum * sum);
          }
          averaged[n] = static_cast<int>(smear.size());
        }
      },
      part(0.0, 0.5));
    const double imageNoise = SignalCurvature::NoiseOf(expectedCurvature, averaged);
    ParallelFor(
      nodes, 4,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          const std::vector<float>& wanted = sights[n].wanted;
          const std::vector<Eigen::Vector3f>& gradient = sights[n].gradient;
          const std::vector<float>& weight = sights[n].weight;
          // Gauss-Newton on the shift and a constant difference of brightness.
          Vector3 shift = Vector3::Zero();
          Matrix3 curvature = Matrix3::Zero();
          double noise = 0.0;
          double likeness = 0.0;
          const Vector3 centre = this->Nodes.position[n] + this->Displacement[k][n];
          std::vector<float> seen(samples);
          for (int round = 0; round < 8; ++round)
          {
            double sum = 0.0;
            double sumSeen = 0.0;
            double sumWanted = 0.0;
            for (std::size_t p = 0; p < samples; ++p)
            {
              seen[p] = this->Volumes[k].Sample(centre + shift + this->Core.Offset(p));
              if (weight[p] > 0.0F && !std::isnan(seen[p]))
              {
                sum += weight[p];
                sumSeen += weight[p] * seen[p];
                sumWanted += weight[p] * wanted[p];
              }
            }
            if (sum < 0.3)
            {
              curvature.setZero();
              break;
            }
            const double meanSeen = sumSeen / sum;
            const double meanWanted = sumWanted / sum;
            Vector3 meanGradient = Vector3::Zero();
            for (std::size_t p = 0; p < samples; ++p)
            {
              if (weight[p] > 0.0F && !std::isnan(seen[p]))
              {
                meanGradient += weight[p] / sum * gradient[p].cast<double>();
              }
            }
            curvature.setZero();
            Vector3 pull = Vector3::Zero();
            double varSeen = 0.0;
            double varWanted = 0.0;
            double both = 0.0;
            double squares = 0.0;
            for (std::size_t p = 0; p < samples; ++p)
            {
              if (!(weight[p] > 0.0F) || std::isnan(seen[p]))
              {
                continue;
              }
              const double a = seen[p] - meanSeen;
              const double b = wanted[p] - meanWanted;
              const Vector3 g = gradient[p].cast<double>() - meanGradient;
              const double w = weight[p] / sum;
              varSeen += w * a * a;
              varWanted += w * b * b;
              both += w * a * b;
              squares += w * (a - b) * (a - b);
              curvature += w * g * g.transpose();
              pull += w * (a - b) * g;
            }
            likeness = both / std::sqrt(std::max(varSeen * varWanted, 1e-9));
            noise = squares;
            // The image moved by +shift shows what was expected: seen(x + shift) = wanted(x).
            Vector3 change = -SignalCurvature(curvature, imageNoise / averaged[n]).Solve(pull);
            const double length = change.norm();
            if (length > 0.7)
            {
              change *= 0.7 / length;
            }
            shift += change;
            if (length < 0.01 || shift.norm() > 2.5)
            {
              break;
            }
          }
          this->Likeness[k][n] = likeness;
          measured[k][n] = this->Displacement[k][n] + shift;
          // Of the samples about one in eight says something of its own; patches of neighbours overlap.
          const double trust = std::clamp((likeness - 0.4) / 0.4, 0.0, 1.0);
          if (trust > 0.0 && curvature.trace() > 0.0)
          {
            information[k][n] = trust * trust *
              Limited(SignalCurvature(curvature, imageNoise / averaged[n]).Information() *
                  (60.0 / std::max(noise, this->NoiseFloor())),
                std::max(VesselDeviation, 0.35 * this->Voxel));
          }
        }
      },
      part(0.5, 1.0));
  }
  ShareLists(this->Ranks, measured);
  ShareLists(this->Ranks, information);
  ShareLists(this->Ranks, this->Likeness);
  Seen seen{ std::move(measured), std::move(information), robustScale };
  this->Fit(this->WithSurroundings(seen));
  this->Vessels = std::move(seen);
}

std::vector<double> Tracker::MeasureCalibre() const
{
  const std::size_t phases = this->Times.size();
  const std::size_t nodes = this->Nodes.size();
  const std::size_t samples = this->Core.places.size();
  // Least squares for the widening w in seen = constant + expected + w d(expected)/d(log radius), and a
  // shift and a blur that the alignment and the smearing may have left.
  constexpr int unknowns = 6;
  using Row = Eigen::Matrix<double, unknowns, 1>;
  struct Estimate
  {
    double widening = 0.0;
    double information = 0.0;
  };
  std::vector<std::vector<Estimate>> estimates(phases);
  for (std::size_t k = 0; k < phases; ++k)
  {
    estimates[k].resize(this->Own[k] ? nodes : 0);
  }
  const std::vector<std::vector<int>> daughters = Daughters(this->Nodes);
  ParallelFor(static_cast<std::int64_t>(nodes), 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (auto n = static_cast<int>(first); n < last; ++n)
      {
        const WideningField field(this->Nodes, daughters, n);
        const Vector3& position = this->Nodes.position[n];
        const double radius = NodeRadius(this->Nodes, n);
        for (std::size_t k = 0; k < phases; ++k)
        {
          if (!this->Own[k])
          {
            continue;
          }
          // Where a vessel is smeared over several of its diameters nothing is left to be measured.
          const std::vector<Vector3> smear = this->Smear(n, this->Times[k]);
          const double smeared = (smear.back() - smear.front()).norm() / std::max(radius, 0.3);
          if (this->Likeness[k][n] < 0.7 || smeared > 3.0)
          {
            continue;
          }
          const Matrix3 back = this->Turn(n, this->Displacement[k]).transpose();
          const Vector3 centre = position + this->Displacement[k][n];
          // Expected at an offset from the centre, and its change by widening.
          const auto expected = [&](const Vector3& offset, bool widening)
          {
            float sum = 0.0F;
            for (const Vector3& moved : smear)
            {
              const Vector3 rest = back * (offset - moved);
              if (!widening)
              {
                sum += this->Reference.Sample(position + rest);
              }
              else if (const Vector3 out = field.At(rest); out.squaredNorm() > 0.0)
              {
                constexpr double part = 0.05;
                sum += (this->Reference.Sample(position + rest - part * out) -
                         this->Reference.Sample(position + rest + part * out)) /
                  static_cast<float>(2.0 * part);
              }
            }
            return static_cast<double>(sum / static_cast<float>(smear.size()));
          };
          Eigen::Matrix<double, unknowns, unknowns> normal;
          normal.setZero();
          Row right = Row::Zero();
          double sum = 0.0;
          for (std::size_t p = 0; p < samples; ++p)
          {
            const Vector3 offset = this->Core.Offset(p);
            const double seen = this->Volumes[k].Sample(centre + offset);
            const double wanted = expected(offset, false);
            Row row;
            row << expected(offset, true), 1.0, 0.0, 0.0, 0.0, -6.0 * wanted;
            for (int axis = 0; axis < 3; ++axis)
            {
              const Vector3 step = this->Core.step * Vector3::Unit(axis);
              const double above = expected(offset + step, false);
              const double below = expected(offset - step, false);
              row[2 + axis] = above - below;
              row[5] += above + below;
            }
            if (std::isfinite(seen + row.sum()))
            {
              const double weight = this->Core.weights[p];
              normal += weight * row * row.transpose();
              right += weight * (seen - wanted) * row;
              sum += weight;
            }
          }
          if (sum < 0.3 || !(normal(0, 0) > 0.0))
          {
            continue;
          }
          const auto others = normal.bottomRightCorner<unknowns - 1, unknowns - 1>();
          const Eigen::Matrix<double, unknowns - 1, 1> share =
            others.completeOrthogonalDecomposition().solve(normal.col(0).tail<unknowns - 1>());
          const double information = normal(0, 0) - share.dot(normal.col(0).tail<unknowns - 1>());
          const double widening = (right[0] - share.dot(right.tail<unknowns - 1>())) / information;
          // No artery widens so much: it is not there, or it is another one.
          if (information > 0.01 * normal(0, 0) && std::abs(widening) < 0.25)
          {
            const double clear = 1.0 / ((1.0 + smeared * smeared) * (1.0 + smeared * smeared));
            estimates[k][n].widening = widening;
            estimates[k][n].information = clear * information;
          }
        }
      }
    });
  ShareLists(this->Ranks, estimates);
  // A node alone is too noisy: the weighted median of all.
  std::vector<double> widening(phases, 0.0);
  std::vector<double> trust(phases, 0.0);
  for (std::size_t k = 0; k < phases; ++k)
  {
    std::vector<Estimate>& all = estimates[k];
    std::sort(all.begin(), all.end(),
      [](const Estimate& a, const Estimate& b) { return a.widening < b.widening; });
    for (const Estimate& one : all)
    {
      trust[k] += one.information;
    }
    double sum = 0.0;
    for (const Estimate& one : all)
    {
      sum += one.information;
      if (sum >= 0.5 * trust[k])
      {
        widening[k] = one.widening;
        break;
      }
    }
  }
  // A pulse: three harmonics of the cycle, nothing at the reference.
  constexpr int harmonics = 3;
  constexpr int size = 2 * harmonics;
  const Eigen::VectorXd zero = PeriodicBasis(this->ReferenceTime, harmonics).tail(size);
  const double most = *std::max_element(trust.begin(), trust.end());
  // The m-th is expected to be 0.03 / m^2; the phase that is seen best has an error of about 0.003.
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  for (int row = 0; row < size; ++row)
  {
    const int harmonic = 1 + row / 2;
    matrix(row, row) = 0.01 * std::pow(harmonic, 4);
  }
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (std::size_t k = 0; k < phases && most > 0.0; ++k)
  {
    const Eigen::VectorXd row = PeriodicBasis(this->Times[k], harmonics).tail(size) - zero;
    matrix += trust[k] / most * row * row.transpose();
    right += trust[k] / most * widening[k] * row;
  }
  const Eigen::VectorXd pulse = matrix.ldlt().solve(right);
  std::vector<double> calibre;
  for (const double time : this->Times)
  {
    calibre.push_back(1.0 + pulse.dot(PeriodicBasis(time, harmonics).tail(size) - zero));
  }
  return calibre;
}

void Tracker::MeasureRepeatability()
{
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t a = 0; a < this->Times.size(); ++a)
  {
    for (std::size_t b = a + 1; b < this->Times.size(); ++b)
    {
      if (CyclicDistance(this->Times[a], this->Times[b]) > SameMoment)
      {
        continue;
      }
      ++this->Result.repeatedPhases;
      for (std::size_t n = 0; n < this->Nodes.size(); ++n)
      {
        if (std::min(this->Likeness[a][n], this->Likeness[b][n]) < TrackedLikeness)
        {
          continue;
        }
        // What moves between the two moments is known better from all phases.
        const auto node = static_cast<int>(n);
        const Vector3 apart =
          (this->Vessels.displacement[a][n] - this->Motion.Displacement(node, this->Times[a])) -
          (this->Vessels.displacement[b][n] - this->Motion.Displacement(node, this->Times[b]));
        const Vector3& tangent = this->Nodes.tangent[n];
        sum += (apart - apart.dot(tangent) * tangent).norm();
        count += 1.0;
      }
    }
  }
  this->Result.repeatability = count > 0.0 ? sum / count : NaN;
}

void Tracker::Finish(PoseSequence& sequence)
{
  const std::vector<double> calibre = this->MeasureCalibre();
  this->MeasureRepeatability();
  const std::size_t phases = this->Times.size();
  const std::size_t nodes = this->Nodes.size();
  sequence.times = this->Times;
  double best = 0.0;
  for (std::size_t k = 0; k < phases; ++k)
  {
    std::vector<double> seen(nodes);
    std::vector<double> confidence(nodes);
    std::vector<double> deviation(nodes);
    double tracked = 0.0;
    for (std::size_t n = 0; n < nodes; ++n)
    {
      deviation[n] = this->Motion.Deviation(static_cast<int>(n), this->Times[k]);
      const double sure = this->Settings.trackedDeviation / deviation[n];
      const double certain = std::min(1.0, sure * sure);
      seen[n] = certain *
        std::clamp((this->Likeness[k][n] - 0.3) / (2.0 * (TrackedLikeness - 0.3)), 0.0, 1.0);
      // What was filled well is worth something to those who smooth the motion.
      confidence[n] = std::max(seen[n], FilledConfidence * certain);
      tracked += seen[n] >= TrackedConfidence ? 1.0 : 0.0;
    }
    this->Result.trackedShare.push_back(tracked / static_cast<double>(nodes));
    best = std::max(best, this->Result.trackedShare.back());
    if (this->Result.trackedShare.back() < 0.05)
    {
      this->Result.warnings.push_back("The phase at " + std::to_string(this->Times[k]) +
        " was lost: its pose is filled from its neighbours");
    }
    std::vector<Vector3> moved = this->Nodes.AtPoints(this->Displacement[k]);
    for (std::size_t p = 0; p < moved.size(); ++p)
    {
      moved[p] += this->Lines.rest[p];
    }
    sequence.points.push_back(std::move(moved));
    sequence.confidence.push_back(this->Nodes.AtPoints(confidence));
    const std::vector<double> spread = this->Nodes.AtPoints(deviation);
    const std::vector<double> sight = this->Nodes.AtPoints(seen);
    std::vector<TrackingStatus> status(spread.size());
    for (std::size_t p = 0; p < spread.size(); ++p)
    {
      status[p] = sight[p] >= TrackedConfidence ? TrackingStatus::Tracked
        : sight[p] >= WeakConfidence            ? TrackingStatus::Weak
        : spread[p] > LostDeviation             ? TrackingStatus::Lost
                                                : TrackingStatus::Filled;
    }
    sequence.status.push_back(std::move(status));
    sequence.calibre.emplace_back(this->Lines.rest.size(), calibre[k]);
  }
  if (best < 0.05)
  {
    throw std::runtime_error("The lines were found in none of the phases");
  }
  for (const SparseVolume& volume : this->Volumes)
  {
    this->Result.keptBytes += volume.Bytes();
  }
}

PoseSequence Tracker::Run()
{
  this->SearchCoarsely();
  if (this->Settings.tissue)
  {
    this->Surroundings = this->SearchFinely(false, 0.6);
    this->Fit({ &this->Surroundings });
  }
  {
    const Seen vessels = this->SearchFinely(true, 0.7);
    this->Fit(this->WithSurroundings(vessels));
  }
  for (int round = 0; round < 4; ++round)
  {
    this->Align(round < 2 ? 1.0 : 0.5, 0.8 + 0.05 * round);
  }
  PoseSequence sequence;
  this->Finish(sequence);
  return sequence;
}
}

void CenterlineTrackingSettings::Validate() const
{
  RequireRange("temporalWindow", this->temporalWindow, 0.0, 1.0);
  RequireRange("cycleLength", this->cycleLength, 0.2, 5.0);
  RequireRange("nodeSpacing", this->nodeSpacing, 0.5, 10.0);
  RequireRange("coarseSpacing", this->coarseSpacing, 1.0, 4.0);
  RequireRange("coarseRadius", this->coarseRadius, 4.0, 30.0);
  RequireRange("captureRange", this->captureRange, 2.0, 40.0);
  RequireRange("fineRadius", this->fineRadius, 2.0, 12.0);
  RequireRange("fineRange", this->fineRange, 1.0, 12.0);
  RequireRange("trackedDeviation", this->trackedDeviation, 0.05, 10.0);
  this->prior.Validate();
}

PoseSequence TrackCenterlines(const MovingLines& lines, double referenceTime,
  const std::vector<double>& times, const std::function<ScalarImage(double time)>& imageAt,
  const CenterlineTrackingSettings& settings, CenterlineTrackingReport* report,
  const ProgressCallback& progress, RankGroup& ranks)
{
  settings.Validate();
  CenterlineTrackingReport own;
  CenterlineTrackingReport& result = report != nullptr ? *report : own;
  result = {};
  if (lines.rest.empty())
  {
    throw std::invalid_argument("The lines to track have no points");
  }
  if (times.empty())
  {
    throw std::invalid_argument("There is no phase to track");
  }
  if (!std::isfinite(referenceTime))
  {
    throw std::invalid_argument("The reference time is not finite");
  }
  for (std::size_t k = 0; k < times.size(); ++k)
  {
    if (!std::isfinite(times[k]) || (k > 0 && times[k] <= times[k - 1]))
    {
      throw std::invalid_argument(
        "The times of the phases do not increase: number " + std::to_string(k));
    }
  }
  Tracker tracker(lines, referenceTime, times, imageAt, settings, result, progress, ranks);
  return tracker.Run();
}
}
