#include "CenterlineExtraction.h"

#include "BifurcationFit.h"
#include "CurveSmoothing.h"
#include "DistanceTransform.h"
#include "FastMarching.h"
#include "LumenMeasurement.h"
#include "Median.h"
#include "OstialRoot.h"
#include "ThinBranches.h"
#include "TurnedBranches.h"
#include "VeinRejection.h"
#include "VoxelRegion.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::uint32_t None = VoxelRegion::notAMember;
constexpr std::int32_t NoOwner = -1;

void Require(bool condition, const std::string& requirement)
{
  if (!condition)
  {
    throw std::invalid_argument("CenterlineSettings: " + requirement);
  }
}

std::string Text(const Vector3& position)
{
  std::ostringstream text;
  text << '(' << position[0] << ", " << position[1] << ", " << position[2] << ')';
  return text.str();
}

/// A way through the region, in mm along the axes of the grid (index times spacing).
struct Way
{
  std::vector<Vector3> points;  ///< from the tip down to the source or the tree
  std::int32_t owner = NoOwner; ///< point of the tree that it met
  bool closed = true;           ///< met the source or the tree
};

/// Measured samples of one path, root first.
struct Course
{
  std::vector<Vector3> points; ///< mm, world
  std::vector<double> radius;
  std::vector<double> confidence;
  std::vector<double> lumen;  ///< image value
  std::vector<double> behind; ///< image value behind the wall
  std::vector<char> crossing; ///< on a bridge

  std::size_t size() const { return points.size(); }
  void resize(std::size_t count)
  {
    points.resize(count);
    radius.resize(count);
    confidence.resize(count);
    lumen.resize(count);
    behind.resize(count);
    crossing.resize(count);
  }
};

/// Position on a polyline nearest to another one's straight continuation.
double LineDistance(const Vector3& point, const Vector3& origin, const Vector3& direction)
{
  const Vector3 offset = point - origin;
  return (offset - offset.dot(direction) * direction).norm();
}

/// Points of a tree one after the other, across forks.
struct Strand
{
  std::vector<std::int64_t> points;
  std::vector<std::size_t> joints; ///< numbers of the forks between its ends
  double length = 0.0;             ///< mm

  /// @returns false when it has become longer than `reach`: the rest is left out
  bool Append(const CenterlineTree& tree, const std::vector<std::int64_t>& branch, double reach);
};

bool Strand::Append(
  const CenterlineTree& tree, const std::vector<std::int64_t>& branch, double reach)
{
  if (this->points.empty())
  {
    this->points.push_back(branch.front());
  }
  else
  {
    this->joints.push_back(this->points.size() - 1);
  }
  for (std::size_t i = 1; i < branch.size(); ++i)
  {
    this->length += (tree.points[static_cast<std::size_t>(branch[i])] -
      tree.points[static_cast<std::size_t>(branch[i - 1])])
                      .norm();
    this->points.push_back(branch[i]);
    if (this->length > reach)
    {
      return false;
    }
  }
  return true;
}

/// A branch from its end on against the flow.
Strand Upstream(const CenterlineTree& tree, std::size_t branch, double reach)
{
  Strand strand;
  for (int at = static_cast<int>(branch); at >= 0;
       at = tree.branches[static_cast<std::size_t>(at)].parentGroupId)
  {
    std::vector<std::int64_t> points = tree.branches[static_cast<std::size_t>(at)].points;
    std::reverse(points.begin(), points.end());
    if (!strand.Append(tree, points, reach))
    {
      break;
    }
  }
  return strand;
}

/// A branch and the widest ones that follow.
Strand Downstream(const CenterlineTree& tree, std::size_t branch, double reach)
{
  Strand strand;
  double widest = 1.0;
  while (widest > 0.0 && strand.Append(tree, tree.branches[branch].points, reach))
  {
    widest = 0.0;
    const int group = tree.branches[branch].groupId;
    for (std::size_t b = 0; b < tree.branches.size(); ++b)
    {
      const std::vector<std::int64_t>& own = tree.branches[b].points;
      const double radius = tree.radius[static_cast<std::size_t>(own[own.size() / 2])];
      if (tree.branches[b].parentGroupId == group && radius > widest)
      {
        widest = radius;
        branch = b;
      }
    }
  }
  return strand;
}

struct Fork
{
  std::size_t parent = 0; ///< branches
  std::array<std::size_t, 2> daughters{};
};

/// Forks of two daughters, in the order of their points. Branches are split there, and numbered by their groups.
std::vector<Fork> ForksOfTwo(const CenterlineTree& tree)
{
  std::map<std::int64_t, std::vector<std::size_t>> daughters;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    if (tree.branches[b].parentGroupId >= 0)
    {
      daughters[tree.branches[b].points.front()].push_back(b);
    }
  }
  std::vector<Fork> forks;
  for (const auto& [point, branches] : daughters)
  {
    if (branches.size() == 2)
    {
      const int parent = tree.branches[branches[0]].parentGroupId;
      forks.push_back({ static_cast<std::size_t>(parent), { branches[0], branches[1] } });
    }
  }
  return forks;
}

constexpr double LeastUnseen = 1.5;     ///< mm of a way across a lesion that are a passage
constexpr double SamePlace = 3.0;       ///< mm: where a vein was rejected before
constexpr double LongestCrossing = 6.0; ///< mm within a vein, at most, of what crosses it
constexpr double GreatBranch = 0.6;     ///< radius in radii of its parent
/// Between where a great branch's axis can be seen and the parent's axis; mean of phantoms. Radians.
constexpr double GreatBranchBend = 0.2;
/// A vessel goes straight on if it bends by no more, and the other one by so much more. Radians.
constexpr double MostBend = 0.5;
constexpr double LeastTurn = 0.35;

class Extractor
{
public:
  /// @param given     the same input in world coordinates, for messages
  /// @param excluded  voxels that are no artery; empty: none are known
  Extractor(const CenterlineInput& input, const CenterlineInput& given,
    const std::vector<unsigned char>& excluded, const CenterlineSettings& settings,
    const ProgressCallback& progress)
    : Input(input)
    , Given(given)
    , Excluded(excluded)
    , Settings(settings)
    , Progress(progress)
    , Spacing(input.grid.spacing)
    , Finest(input.grid.spacing.minCoeff())
    , Voxel(std::cbrt(input.grid.spacing.prod()))
    , Step(settings.resampling > 0.0 ? settings.resampling : 0.6 * Voxel)
  {
    const std::array<int, 6>& e = input.grid.extent;
    this->Size = { e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1 };
  }

  CenterlineResult Run();

  /// After Run: branches of its tree that are veins are added to the excluded voxels, and to what was rejected.
  /// @returns whether there is one
  bool ExcludeVeins(std::vector<unsigned char>& excluded, std::vector<RejectedVein>& veins,
    std::vector<VeinBranch>& judged) const;

private:
  // Places.
  Vector3 ToIndex(const Vector3& world) const
  {
    return (this->Input.grid.direction.transpose() * (world - this->Input.grid.origin))
      .cwiseQuotient(this->Spacing);
  }
  Vector3 FrameToWorld(const Vector3& frame) const
  {
    return this->Input.grid.origin + this->Input.grid.direction * frame;
  }
  /// In the coordinates that the input was given in.
  Vector3 ToGiven(const Vector3& frame) const
  {
    return this->Given.grid.origin + this->Given.grid.direction * frame;
  }
  std::size_t Offset(int i, int j, int k) const
  {
    const std::array<int, 6>& e = this->Input.grid.extent;
    return (static_cast<std::size_t>(k - e[4]) * this->Size[1] +
             static_cast<std::size_t>(j - e[2])) *
      this->Size[0] +
      static_cast<std::size_t>(i - e[0]);
  }
  bool InImage(const Vector3& index) const
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      if (!(index[axis] >= this->Input.grid.extent[2 * axis] - 0.5) ||
        !(index[axis] <= this->Input.grid.extent[2 * axis + 1] + 0.5))
      {
        return false;
      }
    }
    return true;
  }

  void PrepareMeasurement();
  void MakeRegion();
  std::uint32_t NearestMember(const Vector3& index, double reach, bool reachedOnly) const;
  bool PlaceSeeds();
  void MarchFrom();
  bool Gradient(const Vector3& index, Vector3& gradient) const;
  Way WayBack(const Vector3& from, std::uint32_t member) const;
  std::vector<Vector3> Tangents(const std::vector<Vector3>& points) const;
  void Measure(Course& course, bool move) const;
  void Recentre(Course& course) const;
  void SmoothPositions(Course& course, double start, double end) const;
  void SmoothRadii(Course& course) const;
  void Calibrate(const Course& course);
  void CorrectRadii();
  bool IsExcludedAt(const Vector3& point) const;
  bool IsExcluded(const std::vector<Vector3>& points) const;
  void SettleOstia();
  void MarkCrossings(Course& course) const;
  void MarkBridged();
  std::vector<double> Outgrowth(const Course& course, std::vector<double> before) const;
  std::size_t SeenUpTo(
    const Course& course, double parentRadius, const std::vector<double>& before) const;
  std::int64_t Append(const Way& way, int treeId, bool wanted);
  std::vector<Vector3> FollowOuterWall(const Course& course, std::size_t good,
    const std::function<double(const Vector3&)>& outside) const;
  std::size_t JoinParent(Course& course, std::int32_t owner) const;
  void Own(std::size_t branch);
  void FindTips();
  bool ThinBranchesFor(ThinBranchSettings& settings) const;
  void FollowThinBranches();
  void LengthenTips();
  void TurnBranches();
  void Remove(std::size_t index);
  void FollowTargets();
  void StraightenFork(
    CenterlineTree& tree, std::size_t parent, std::size_t turning, std::size_t straight) const;
  void StraightenForks(CenterlineTree& tree) const;
  struct ForkFit
  {
    BifurcationFit fit;
    Strand through;
    std::size_t fork = 0; ///< number in `through`
    Strand side;
  };
  ForkFit FitFork(const CenterlineTree& tree, std::size_t parent, std::size_t turning,
    std::size_t straight, double leastTurn) const;
  void MoveFork(CenterlineTree& tree, const ForkFit& fork) const;
  void FitForks(CenterlineTree& tree) const;
  void Finish();
  void SeedsInOneVessel();

  const CenterlineInput& Input;
  const CenterlineInput& Given;
  const std::vector<unsigned char>& Excluded;
  const CenterlineSettings& Settings;
  const ProgressCallback& Progress;
  Vector3 Spacing;
  double Finest;
  double Voxel;
  double Step;
  std::array<int, 3> Size;

  std::vector<std::int16_t> MaskImage;
  std::vector<float> MaskDistance;
  ScalarImage MeasuredImage;
  std::unique_ptr<ImageInterpolator> Image;
  LumenSettings Lumen;
  double Blur = 0.0;
  double SpeedThreshold = 0.0;
  double SpeedScale = 1.0;
  double IntensityThreshold = -std::numeric_limits<double>::infinity();

  VoxelRegion Region;
  std::unique_ptr<FastMarching> Marching;
  std::vector<std::uint32_t> SeedMembers;
  std::vector<char> SeedUsed;
  std::vector<std::int32_t> Owner; ///< of a member: the point of the tree whose lumen it is in
  std::vector<bool> Covered;       ///< members where no further tip is looked for
  CenterlineTree Tree;             ///< not split
  std::vector<double> PointLumen;  ///< image value at a point of the tree
  bool Calibrated = false;
  std::vector<std::int32_t> BranchOf; ///< of a point of the tree
  CenterlineResult Result;
};

void Extractor::PrepareMeasurement()
{
  const std::int64_t voxels =
    static_cast<std::int64_t>(this->Size[0]) * this->Size[1] * this->Size[2];
  if (!this->Input.speed && !this->Input.wallDistance)
  {
    // A mask alone: fastest where its border is farthest. The border lies half a voxel from the
    // centres of the outermost voxels.
    this->MaskDistance = SquaredDistanceTransform(this->Input.mask, this->Size, this->Spacing, {});
    for (float& distance : this->MaskDistance)
    {
      distance = std::min(std::sqrt(distance), 1e6F * static_cast<float>(this->Voxel)) -
        0.5F * static_cast<float>(this->Voxel);
    }
  }
  if (this->Input.intensity)
  {
    this->MeasuredImage = *this->Input.intensity;
  }
  else if (this->Input.wallDistance)
  {
    this->MeasuredImage = { this->Input.wallDistance, this->Input.grid };
    this->Lumen.level = 0.0;
  }
  else if (this->Input.mask && !this->Input.speed)
  {
    this->MaskImage.resize(static_cast<std::size_t>(voxels));
    std::transform(this->Input.mask, this->Input.mask + voxels, this->MaskImage.begin(),
      [](unsigned char value) { return static_cast<std::int16_t>(value ? 100 : 0); });
    this->MeasuredImage = { this->MaskImage.data(), this->Input.grid };
    this->Lumen.level = 50.0;
  }
  else
  {
    this->MeasuredImage = { this->Input.speed, this->Input.grid };
  }
  this->Image = std::make_unique<ImageInterpolator>(this->MeasuredImage);
  this->Blur = this->Settings.blur > 0.0 ? this->Settings.blur : 0.8 * this->Voxel;

  // What a lumen looks like: the median of what the seeds show.
  std::vector<LumenReference> seen;
  if (std::isnan(this->Lumen.level))
  {
    for (const Vector3& seed : this->Input.seeds)
    {
      LumenReference reference;
      if (this->Image->Contains(seed) && MeasureReference(*this->Image, seed, reference))
      {
        seen.push_back(reference);
      }
    }
    if (!seen.empty())
    {
      const auto median = [&](double LumenReference::*member)
      {
        std::vector<double> values;
        values.reserve(seen.size());
        for (const LumenReference& reference : seen)
        {
          values.push_back(reference.*member);
        }
        std::sort(values.begin(), values.end());
        return values[values.size() / 2];
      };
      this->Lumen.reference = { median(&LumenReference::lumen), 0.0,
        median(&LumenReference::radius) };
      this->Lumen.reference.background = std::min_element(seen.begin(), seen.end(),
        [](const LumenReference& a, const LumenReference& b) {
          return a.background < b.background;
        })->background;
    }
  }
  this->Lumen.maximumRadius = this->Settings.maximumRadius;
  if (this->Lumen.maximumRadius == 0.0)
  {
    if (!std::isnan(this->Lumen.level))
    {
      const float* distance =
        this->Input.wallDistance ? this->Input.wallDistance : this->MaskDistance.data();
      this->Lumen.maximumRadius =
        1.5 * static_cast<double>(*std::max_element(distance, distance + voxels)) + this->Voxel;
    }
    else
    {
      // Seeds beside the axis show less than the vessel's width: 3 mm, as coronary arteries have, are always looked for.
      // No scanner's voxels are smaller than 0.02 mm: then the unit is the metre.
      const double usual = this->Voxel < 0.02 ? 0.003 : 3.0;
      this->Lumen.maximumRadius =
        std::max({ 2.0 * this->Lumen.reference.radius, 6.0 * this->Voxel, usual });
    }
  }
  if (this->Input.intensity)
  {
    this->IntensityThreshold = std::isnan(this->Settings.intensityThreshold)
      ? this->Lumen.reference.background +
        0.4 * (this->Lumen.reference.lumen - this->Lumen.reference.background)
      : this->Settings.intensityThreshold;
  }
}

void Extractor::MakeRegion()
{
  const std::int64_t voxels =
    static_cast<std::int64_t>(this->Size[0]) * this->Size[1] * this->Size[2];
  const float* distance = this->Input.wallDistance ? this->Input.wallDistance
    : this->Input.speed                            ? nullptr
                                                   : this->MaskDistance.data();
  const float* speed = distance ? distance : this->Input.speed;
  const unsigned char* mask = this->Input.wallDistance ? nullptr : this->Input.mask;
  // A mask is somebody's decision of what is vessel: automatic thresholds, which cut thin branches off
  // where the measure is low, at their roots, do not overrule it.
  const bool decided = mask != nullptr && !distance;
  const bool anySpeed = decided && std::isnan(this->Settings.speedThreshold);
  if (distance)
  {
    // Thin vessels hold together where the wall is within half a voxel.
    this->SpeedThreshold =
      this->Input.wallDistance ? -0.5 * this->Voxel : -std::numeric_limits<double>::infinity();
  }
  else
  {
    this->SpeedThreshold = this->Settings.speedThreshold;
    if (std::isnan(this->SpeedThreshold) && !anySpeed)
    {
      // A histogram of logarithms: any speed, any unit.
      float greatest = 0.0F;
      for (std::int64_t v = 0; v < voxels; ++v)
      {
        greatest = std::isfinite(speed[v]) ? std::max(greatest, speed[v]) : greatest;
      }
      std::vector<std::int64_t> histogram(1000, 0);
      if (greatest > 0.0F)
      {
        for (std::int64_t v = 0; v < voxels; ++v)
        {
          if (std::isfinite(speed[v]) && speed[v] > 1e-3F * greatest)
          {
            ++histogram[std::min<std::size_t>(
              999, static_cast<std::size_t>(1000.0F * speed[v] / greatest))];
          }
        }
      }
      std::int64_t above = 0;
      std::size_t bin = 1000;
      const std::int64_t tail = std::max<std::int64_t>(1, voxels / 10000);
      while (bin > 1 && above < tail)
      {
        above += histogram[--bin];
      }
      this->SpeedThreshold =
        0.02 * static_cast<double>(greatest) * static_cast<double>(bin + 1) / 1000.0;
    }
  }

  const float threshold =
    anySpeed ? -std::numeric_limits<float>::infinity() : static_cast<float>(this->SpeedThreshold);
  const bool gate = this->Input.intensity && std::isfinite(this->IntensityThreshold) &&
    !(decided && std::isnan(this->Settings.intensityThreshold));
  this->Region = VoxelRegion(this->Input.grid.extent,
    [&](int j, int k, unsigned char* flags)
    {
      const std::array<int, 6>& e = this->Input.grid.extent;
      const std::size_t row = this->Offset(e[0], j, k);
      for (int i = 0; i < this->Size[0]; ++i)
      {
        const std::size_t v = row + static_cast<std::size_t>(i);
        flags[i] = (mask == nullptr || mask[v] != 0) && speed[v] > threshold &&
          (this->Excluded.empty() || this->Excluded[v] == 0) &&
          (!gate ||
            this->Image->At(this->Input.grid.IndexToWorld(i + e[0], j, k)) >
              this->IntensityThreshold);
      }
    });
  if (!this->Input.wallDistance)
  {
    // Thin vessels hang together by corners; the front goes through faces.
    this->Region.JoinDiagonals();
  }
  this->Result.regionVoxels = this->Region.Size();
}

std::uint32_t Extractor::NearestMember(const Vector3& index, double reach, bool reachedOnly) const
{
  const std::array<int, 6>& box = this->Region.Box();
  if (this->Region.Size() == 0)
  {
    return None;
  }
  std::array<int, 6> range;
  for (int axis = 0; axis < 3; ++axis)
  {
    const double steps = reach / this->Spacing[axis] + 0.5;
    range[2 * axis] =
      static_cast<int>(std::max<double>(box[2 * axis], std::ceil(index[axis] - steps)));
    range[2 * axis + 1] =
      static_cast<int>(std::min<double>(box[2 * axis + 1], std::floor(index[axis] + steps)));
  }
  std::uint32_t nearest = None;
  double least = std::numeric_limits<double>::infinity();
  for (int k = range[4]; k <= range[5]; ++k)
  {
    for (int j = range[2]; j <= range[3]; ++j)
    {
      for (int i = range[0]; i <= range[1]; ++i)
      {
        const std::uint32_t number = this->Region.NumberOf(i, j, k);
        if (number == None || (reachedOnly && !std::isfinite(this->Marching->Arrival()[number])))
        {
          continue;
        }
        const double distance = (Vector3(i, j, k) - index).cwiseProduct(this->Spacing).norm();
        if (distance < least)
        {
          least = distance;
          nearest = number;
        }
      }
    }
  }
  return nearest;
}

bool Extractor::PlaceSeeds()
{
  const double reach = this->Settings.snapDistance > 0.0
    ? this->Settings.snapDistance
    : std::max(3.0 * this->Voxel, this->Lumen.reference.radius);
  this->SeedMembers.assign(this->Input.seeds.size(), None);
  this->SeedUsed.assign(this->Input.seeds.size(), 0);
  bool any = false;
  for (std::size_t s = 0; s < this->Input.seeds.size(); ++s)
  {
    CenterlineEnd& end = this->Result.seeds[s];
    end.treeId = static_cast<int>(s);
    const Vector3 index = this->ToIndex(this->Input.seeds[s]);
    const std::string name = "seed " + std::to_string(s) + " at " + Text(this->Given.seeds[s]);
    if (!this->InImage(index))
    {
      end.status = EndStatus::OutsideImage;
      end.message = name + " lies outside the image";
      continue;
    }
    this->SeedMembers[s] = this->NearestMember(index, reach, false);
    if (this->SeedMembers[s] == None)
    {
      end.status = EndStatus::OutsideRegion;
      std::ostringstream text;
      text << name << " has no vessel within " << reach
           << " mm: no voxel there is above the threshold";
      end.message = text.str();
      continue;
    }
    end.status = EndStatus::Reached;
    this->SeedUsed[s] = 1;
    any = true;
  }
  return any;
}

void Extractor::MarchFrom()
{
  const float* distance = this->Input.wallDistance ? this->Input.wallDistance
    : this->Input.speed                            ? nullptr
                                                   : this->MaskDistance.data();
  const float* values = distance ? distance : this->Input.speed;
  std::vector<float> speed(this->Region.Size());
  const double shift = distance ? 0.75 * this->Voxel : 0.0;
  this->Region.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      const std::array<int, 3> index = this->Region.IndexOf(address);
      speed[number] = values[this->Offset(index[0], index[1], index[2])];
    });
  // Relative to what vessels have here: the upper tenth.
  std::vector<float> sorted = speed;
  const std::size_t tenth = sorted.size() - 1 - sorted.size() / 10;
  std::nth_element(
    sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(tenth), sorted.end());
  const double scale = std::max<double>(sorted[tenth] + shift, 1e-30);
  const LumenReference& reference = this->Lumen.reference;
  const double contrast = reference.lumen - reference.background;
  this->Region.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      const double relative = std::min(100.0, std::max(0.0, (speed[number] + shift) / scale));
      double value = 0.01 + std::pow(relative, this->Settings.speedExponent);
      if (this->Input.intensity && contrast > 0.0)
      {
        const std::array<int, 3> index = this->Region.IndexOf(address);
        const double bright =
          (this->Image->At(this->Input.grid.IndexToWorld(index[0], index[1], index[2])) -
            reference.background) /
          contrast;
        const double likely = std::min(1.0, std::max(0.1, bright / 0.7));
        value *= likely * likely;
      }
      speed[number] = static_cast<float>(value);
    });

  FastMarchingSettings settings;
  settings.spacing = this->Spacing;
  std::vector<FastMarchingSource> sources;
  for (std::size_t s = 0; s < this->Input.seeds.size(); ++s)
  {
    if (this->SeedUsed[s])
    {
      // The fastest way begins at the given point if that is in a vessel, else beside it.
      const Vector3 index = this->ToIndex(this->Input.seeds[s]);
      const std::uint32_t here = this->Region.NumberOf(static_cast<int>(std::lround(index[0])),
        static_cast<int>(std::lround(index[1])), static_cast<int>(std::lround(index[2])));
      FastMarchingSource source{ index, static_cast<int>(s) };
      if (here == None)
      {
        this->Region.ForEach(
          [&](std::uint32_t number, VoxelRegion::Address address)
          {
            if (number == this->SeedMembers[s])
            {
              const std::array<int, 3> at = this->Region.IndexOf(address);
              source.index = Vector3(at[0], at[1], at[2]);
            }
          });
      }
      sources.push_back(source);
    }
  }
  const ProgressCallback progress = this->Progress
    ? ProgressCallback([&](double fraction) { return this->Progress(0.1 + 0.5 * fraction); })
    : ProgressCallback();
  this->Marching =
    std::make_unique<FastMarching>(this->Region, std::move(speed), settings, progress);
  this->Marching->March(sources);
  this->Result.memory = this->Marching->MemorySize() +
    this->Region.Size() * (sizeof(float) + sizeof(std::int32_t)) +
    this->MaskImage.size() * sizeof(std::int16_t) + this->MaskDistance.size() * sizeof(float);
}

bool Extractor::Gradient(const Vector3& index, Vector3& gradient) const
{
  const std::vector<float>& arrival = this->Marching->Arrival();
  gradient.setZero();
  double total = 0.0;
  const int base[3] = { static_cast<int>(std::floor(index[0])),
    static_cast<int>(std::floor(index[1])), static_cast<int>(std::floor(index[2])) };
  for (int corner = 0; corner < 8; ++corner)
  {
    int at[3];
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis)
    {
      const int up = corner >> axis & 1;
      at[axis] = base[axis] + up;
      const double fraction = index[axis] - base[axis];
      weight *= up ? fraction : 1.0 - fraction;
    }
    if (weight <= 0.0 || !this->Region.InBox(at[0], at[1], at[2]))
    {
      continue;
    }
    const VoxelRegion::Address address = this->Region.AddressOf(at[0], at[1], at[2]);
    const std::uint32_t centre = this->Region.Number(address);
    if (centre == None || !std::isfinite(arrival[centre]))
    {
      continue;
    }
    total += weight;
    for (int axis = 0; axis < 3; ++axis)
    {
      const std::uint32_t below = this->Region.Number(this->Region.Below(address, axis));
      const std::uint32_t above = this->Region.Number(this->Region.Above(address, axis));
      const double here = arrival[centre];
      const bool low = below != None && std::isfinite(arrival[below]);
      const bool high = above != None && std::isfinite(arrival[above]);
      const double down = low ? here - arrival[below] : 0.0;
      const double up = high ? arrival[above] - here : 0.0;
      gradient[axis] +=
        weight * (low && high ? 0.5 * (down + up) : down + up) / this->Spacing[axis];
    }
  }
  if (!(total > 0.0) || !(gradient.norm() > 0.0))
  {
    return false;
  }
  gradient.normalize();
  return true;
}

Way Extractor::WayBack(const Vector3& from, std::uint32_t member) const
{
  const std::vector<float>& arrival = this->Marching->Arrival();
  const int label = this->Marching->Source()[member];
  const Vector3 source =
    this->ToIndex(this->Input.seeds[static_cast<std::size_t>(label)]).cwiseProduct(this->Spacing);
  const auto memberAt = [&](const Vector3& frame)
  {
    const Vector3 index = frame.cwiseQuotient(this->Spacing);
    const std::uint32_t number = this->Region.NumberOf(static_cast<int>(std::lround(index[0])),
      static_cast<int>(std::lround(index[1])), static_cast<int>(std::lround(index[2])));
    return number != None && std::isfinite(arrival[number]) ? number : None;
  };

  Way way;
  Vector3 at = from.cwiseProduct(this->Spacing);
  way.points.push_back(at);
  std::uint32_t here = member;
  // The earliest voxel on the way so far, and where the way was there.
  std::uint32_t earliest = member;
  std::size_t earliestSize = 1;
  int idle = 0;
  const double step = 0.3 * this->Finest;
  const double near = 1.5 * this->Spacing.maxCoeff();
  for (;;)
  {
    if (this->Owner[here] != NoOwner)
    {
      way.owner = this->Owner[here];
      return way;
    }
    if ((at - source).norm() < near || arrival[here] <= 0.0F)
    {
      way.points.push_back(source);
      return way;
    }
    // Fourth-order Runge-Kutta along the direction of steepest descent.
    const auto direction = [&](const Vector3& frame, Vector3& result)
    { return this->Gradient(frame.cwiseQuotient(this->Spacing), result); };
    Vector3 k1;
    Vector3 k2;
    Vector3 k3;
    Vector3 k4;
    bool moved = false;
    if (idle < 10 && direction(at, k1) && direction(at - 0.5 * step * k1, k2) &&
      direction(at - 0.5 * step * k2, k3) && direction(at - step * k3, k4))
    {
      const Vector3 next = at - step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
      const std::uint32_t there = memberAt(next);
      if (there != None && (next - at).norm() > 0.3 * step)
      {
        at = next;
        here = there;
        moved = true;
        ++idle;
        way.points.push_back(at);
        if (arrival[here] < arrival[earliest])
        {
          earliest = here;
          earliestSize = way.points.size();
          idle = 0;
        }
      }
    }
    if (!moved)
    {
      // In a kink or on a plateau the descent goes to and fro: from its earliest voxel to the
      // earliest neighbour. So every ten steps the way comes to an earlier voxel, and ends.
      idle = 0;
      way.points.resize(earliestSize);
      const Vector3 index = way.points.back().cwiseQuotient(this->Spacing);
      std::uint32_t best = earliest;
      for (int k = -1; k <= 1; ++k)
      {
        for (int j = -1; j <= 1; ++j)
        {
          for (int i = -1; i <= 1; ++i)
          {
            const Vector3 next(
              std::lround(index[0]) + i, std::lround(index[1]) + j, std::lround(index[2]) + k);
            const std::uint32_t number = this->Region.NumberOf(
              static_cast<int>(next[0]), static_cast<int>(next[1]), static_cast<int>(next[2]));
            if (number != None && arrival[number] < arrival[best])
            {
              best = number;
              at = next.cwiseProduct(this->Spacing);
            }
          }
        }
      }
      if (best == earliest)
      {
        // A source's own voxel, or a hollow that rounding made.
        way.closed = (way.points.back() - source).norm() < 4.0 * near;
        way.points.push_back(source);
        return way;
      }
      here = best;
      earliest = best;
      way.points.push_back(at);
      earliestSize = way.points.size();
    }
  }
}

std::vector<Vector3> Extractor::Tangents(const std::vector<Vector3>& points) const
{
  std::vector<Vector3> tangents(points.size());
  const auto last = static_cast<std::ptrdiff_t>(points.size()) - 1;
  const auto reach = std::max<std::ptrdiff_t>(1, std::lround(1.5 * this->Voxel / this->Step));
  for (std::ptrdiff_t i = 0; i <= last; ++i)
  {
    const Vector3 chord = points[static_cast<std::size_t>(std::min(last, i + reach))] -
      points[static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, i - reach))];
    tangents[static_cast<std::size_t>(i)] =
      chord.norm() > 0.0 ? Vector3(chord.normalized()) : Vector3::UnitX();
  }
  return tangents;
}

void Extractor::Measure(Course& course, bool move) const
{
  const std::vector<Vector3> tangents = this->Tangents(course.points);
  course.radius.resize(course.size(), this->Voxel);
  course.confidence.resize(course.size(), 0.0);
  course.lumen.resize(course.size(), 0.0);
  course.behind.resize(course.size(), 0.0);
  std::vector<LumenSection> sections(course.size());
  ParallelFor(static_cast<std::int64_t>(course.size()), 16,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t i = first; i < last; ++i)
      {
        const auto p = static_cast<std::size_t>(i);
        sections[p] = MeasureLumen(*this->Image, course.points[p], tangents[p],
          std::max(course.radius[p], this->Voxel), this->Lumen);
      }
    });
  for (std::size_t i = 0; i < course.size(); ++i)
  {
    const LumenSection& section = sections[i];
    const double shift = (section.centre - course.points[i]).norm();
    course.confidence[i] = section.confidence;
    course.lumen[i] = section.lumen;
    course.behind[i] = section.behind;
    if (section.confidence > 0.0)
    {
      course.radius[i] = section.radius;
      // A centre that is another vessel's.
      if (shift > 1.5 * section.radius + this->Voxel)
      {
        course.confidence[i] = 0.0;
      }
      else if (move)
      {
        course.points[i] = section.centre;
      }
    }
  }
}

/// Beside something much darker or brighter the speed is greatest off the axis, so that no section is found from
/// there: sections are looked for around the points of longer parts that have none.
void Extractor::Recentre(Course& course) const
{
  const std::vector<Vector3> tangents = this->Tangents(course.points);
  const auto unseen = [&](std::size_t i)
  { return course.confidence[i] < this->Settings.minimumConfidence; };
  const auto longest = static_cast<std::size_t>(5.0 * this->Voxel / this->Step);
  for (std::size_t begin = 0; begin < course.size();)
  {
    std::size_t end = begin;
    while (end < course.size() && unseen(end))
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
            LumenSection& found = best[static_cast<std::size_t>(n)];
            const std::size_t i = begin + static_cast<std::size_t>(n);
            const Vector3 u = tangents[i].unitOrthogonal();
            const Vector3 v = tangents[i].cross(u);
            for (const double away : { 1.25, 2.5 })
            {
              for (int side = 0; side < 8; ++side)
              {
                const double angle = 0.25 * M_PI * side;
                const Vector3 place = course.points[i] +
                  away * this->Voxel * (std::cos(angle) * u + std::sin(angle) * v);
                const LumenSection section =
                  MeasureLumen(*this->Image, place, tangents[i], this->Voxel, this->Lumen);
                // The same lumen: the point is in it.
                if (section.confidence > std::max(found.confidence, course.confidence[i]) &&
                  (section.centre - course.points[i]).norm() <= section.radius + 0.5 * this->Voxel)
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
          course.points[i] = section.centre;
          course.radius[i] = section.radius;
          course.confidence[i] = section.confidence;
          course.lumen[i] = section.lumen;
          course.behind[i] = section.behind;
        }
      }
    }
    begin = std::max(end, begin + 1);
  }
}

void Extractor::SmoothPositions(Course& course, double start, double end) const
{
  std::vector<double> weights(course.size());
  for (std::size_t i = 0; i < course.size(); ++i)
  {
    weights[i] = std::max(0.01, course.confidence[i]);
  }
  weights.front() = std::max(weights.front(), start);
  weights.back() = std::max(weights.back(), end);
  const double wavelength =
    this->Settings.smoothing > 0.0 ? this->Settings.smoothing : 12.0 * this->Voxel;
  course.points = SmoothCurve(course.points, weights, wavelength / this->Step);
}

void Extractor::SmoothRadii(Course& course) const
{
  std::vector<double> weights(course.size());
  for (std::size_t i = 0; i < course.size(); ++i)
  {
    weights[i] = course.confidence[i] * course.confidence[i];
  }
  if (*std::max_element(weights.begin(), weights.end()) <= 0.0)
  {
    return;
  }
  const double wavelength =
    this->Settings.smoothing > 0.0 ? this->Settings.smoothing : 12.0 * this->Voxel;
  std::vector<double> smooth = SmoothSequence(course.radius, weights, wavelength / this->Step);
  for (int pass = 0; pass < 2; ++pass)
  {
    std::vector<double> robust = weights;
    for (std::size_t i = 0; i < course.size(); ++i)
    {
      const double residual = (course.radius[i] - smooth[i]) / std::max(0.15 * smooth[i], 1e-12);
      robust[i] /= 1.0 + residual * residual;
    }
    smooth = SmoothSequence(course.radius, robust, wavelength / this->Step);
  }
  // Ends without a measurement follow a straight line: not beyond what was seen.
  double low = std::numeric_limits<double>::infinity();
  double high = 0.0;
  for (std::size_t i = 0; i < course.size(); ++i)
  {
    if (weights[i] > 0.0)
    {
      low = std::min(low, course.radius[i]);
      high = std::max(high, course.radius[i]);
    }
  }
  for (std::size_t i = 0; i < course.size(); ++i)
  {
    course.radius[i] = std::min(high, std::max(low, smooth[i]));
  }
}

/// An ostium is at the edge of the aorta, its surroundings are not a vessel's: once a whole vessel is
/// known, its lumen is what others are compared with.
void Extractor::Calibrate(const Course& course)
{
  if (!std::isnan(this->Lumen.level))
  {
    return;
  }
  std::vector<double> values;
  std::vector<double> behind;
  for (std::size_t i = 0; i < course.size(); ++i)
  {
    if (course.confidence[i] > 0.8)
    {
      values.push_back(course.lumen[i]);
      behind.push_back(course.behind[i]);
    }
  }
  if (values.size() >= 10)
  {
    const auto quartile = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 3 / 4);
    std::nth_element(values.begin(), quartile, values.end());
    this->Lumen.reference.lumen = std::max(this->Lumen.reference.lumen, *quartile);
    // The darkest surroundings: elsewhere muscle may lie against the vessel.
    const auto dark = behind.begin() + static_cast<std::ptrdiff_t>(behind.size() / 4);
    std::nth_element(behind.begin(), dark, behind.end());
    this->Lumen.reference.background = *dark;
    this->Calibrated = true;
  }
}

/// Half-maximum radii to true ones. How blurred the image is shows in the small vessels: the less
/// of the great vessels' contrast they have at their size, the more.
void Extractor::CorrectRadii()
{
  if (!this->Input.intensity)
  {
    return;
  }
  const LumenReference& reference = this->Lumen.reference;
  const double contrast = reference.lumen - reference.background;
  if (this->Settings.blur == 0.0 && contrast > 0.0)
  {
    std::vector<double> blurs;
    for (std::size_t p = 0; p < this->Tree.points.size(); ++p)
    {
      const double share = (this->PointLumen[p] - reference.background) / contrast;
      if (this->Tree.confidence[p] > 0.8 && share > 0.4 && share < 0.85)
      {
        blurs.push_back(BlurFromContrast(this->Tree.radius[p], share));
      }
    }
    if (blurs.size() >= 20)
    {
      const auto middle = blurs.begin() + static_cast<std::ptrdiff_t>(blurs.size() / 2);
      std::nth_element(blurs.begin(), middle, blurs.end());
      this->Blur = std::min(std::max(*middle, 0.4 * this->Voxel), 2.0 * this->Voxel);
    }
  }
  this->Result.blur = this->Blur;
  // A vessel thinner than half the blur shows less than 12 % of its contrast: what is seen is wider,
  // and what was measured narrower, or continued into the parent, is not the vessel's width.
  const double least = 0.5 * this->Blur;
  for (double& radius : this->Tree.radius)
  {
    radius = std::max(least, RadiusFromHalfMaximum(radius, this->Blur));
  }
}

/// Which samples lie on a way across a lesion.
void Extractor::MarkCrossings(Course& course) const
{
  course.crossing.assign(course.size(), 0);
  const double reach = 2.0 * this->Voxel + 0.5 * this->Step;
  for (const VesselBridge& bridge : this->Input.bridges)
  {
    for (std::size_t i = 0; i < course.size(); ++i)
    {
      course.crossing[i] = course.crossing[i] != 0 ||
        std::any_of(bridge.points.begin(), bridge.points.end(),
          [&](const Vector3& p) { return (p - course.points[i]).squaredNorm() <= reach * reach; });
    }
  }
}

/// What was guessed on the ways across lesions, and how certain it is that what lies behind them belongs to the tree.
void Extractor::MarkBridged()
{
  CenterlineTree& tree = this->Tree;
  tree.bridged.assign(tree.points.size(), 0);
  tree.bridgeConfidence.assign(tree.points.size(), 1.0);
  if (this->Input.bridges.empty())
  {
    return;
  }
  const double reach = 2.0 * this->Voxel + 0.5 * this->Step;
  for (const CenterlineTree::Branch& branch : tree.branches)
  {
    double certain = branch.parentGroupId < 0
      ? 1.0
      : tree.bridgeConfidence[static_cast<std::size_t>(branch.points[0])];
    std::vector<char> passed(this->Input.bridges.size(), 0);
    std::vector<double> unseen(this->Input.bridges.size(), 0.0); // mm along each
    for (std::size_t i = branch.parentGroupId < 0 ? 0 : 1; i < branch.points.size(); ++i)
    {
      const auto p = static_cast<std::size_t>(branch.points[i]);
      for (std::size_t b = 0; b < this->Input.bridges.size(); ++b)
      {
        const VesselBridge& bridge = this->Input.bridges[b];
        const bool here = std::any_of(bridge.points.begin(), bridge.points.end(),
          [&](const Vector3& q) { return (q - tree.points[p]).squaredNorm() <= reach * reach; });
        if (!here)
        {
          continue;
        }
        if (tree.confidence[p] < this->Settings.minimumConfidence)
        {
          tree.bridged[p] = 1;
          unseen[b] += this->Step;
        }
        // The middle of the way, and more than a moment of it unseen, are what a branch that only begins at one of its
        // ends does not pass.
        const Vector3& middle = bridge.points[bridge.points.size() / 2];
        if (passed[b] == 0 &&
          (unseen[b] >= LeastUnseen || (middle - tree.points[p]).squaredNorm() <= reach * reach))
        {
          passed[b] = 1;
          certain *= bridge.confidence;
        }
      }
      tree.bridgeConfidence[p] = certain;
    }
  }
}

/// What speaks against a vessel because it is wider than what it comes from: no section of a chamber is quite
/// clear, and an aneurysm's are.
/// @param before  radii upstream, the nearest last
std::vector<double> Extractor::Outgrowth(const Course& course, std::vector<double> before) const
{
  constexpr double far = 25.0; // mm upstream that are compared
  constexpr double near = 4.0; // mm that may have begun to widen
  constexpr double wide = 1.5; // as much as an ectatic artery
  constexpr double most = 0.5;
  const std::size_t known = before.size();
  before.insert(before.end(), course.radius.begin(), course.radius.end());
  std::vector<double> against(course.size(), 0.0);
  const auto steps = [&](double length) { return static_cast<std::size_t>(length / this->Step); };
  for (std::size_t i = 0; i < course.size(); ++i)
  {
    const std::size_t end = known + i > steps(near) ? known + i - steps(near) : 0;
    const std::size_t begin = end > steps(far) ? end - steps(far) : 0;
    if (end - begin < steps(2.0 * near))
    {
      continue;
    }
    // Lesions narrow what is upstream.
    const double usual = QuantileOf({ before.begin() + static_cast<std::ptrdiff_t>(begin),
                                      before.begin() + static_cast<std::ptrdiff_t>(end) },
      0.8);
    against[i] =
      std::clamp(std::log(course.radius[i] / (wide * usual + 0.5 * this->Voxel)), 0.0, most);
  }
  return against;
}

/// @param before  radii upstream
/// @returns the number of samples up to where a vessel is seen, 0 if there is none
std::size_t Extractor::SeenUpTo(
  const Course& course, double parentRadius, const std::vector<double>& before) const
{
  const double gap =
    this->Settings.maximumGap > 0.0 ? this->Settings.maximumGap : 10.0 * this->Voxel;
  // Next to its parent no section is a vessel of its own.
  const auto first = static_cast<std::size_t>(parentRadius / this->Step);
  // Where the sum of what speaks for a vessel and what speaks against it is greatest.
  std::size_t end = 0;
  double greatest = 0.0;
  double sum = 0.0;
  double unseen = 0.0;
  const std::vector<double> outgrowth = this->Outgrowth(course, before);
  for (std::size_t i = first; i < course.size(); ++i)
  {
    // On a way across a lesion nothing need be seen, if something is behind it.
    const double seen = course.confidence[i] - this->Settings.minimumConfidence - outgrowth[i];
    const double evidence = course.crossing[i] != 0 ? std::max(0.0, seen) : seen;
    sum += evidence;
    unseen = evidence < 0.0 ? unseen + this->Step : 0.0;
    if (unseen > gap)
    {
      break;
    }
    if (sum > greatest)
    {
      greatest = sum;
      end = i + 1;
    }
  }
  // On the whole a vessel: a quarter of what a perfect one would bring.
  const double perfect = (1.0 - this->Settings.minimumConfidence) *
    (static_cast<double>(end) - static_cast<double>(std::min(first, end)));
  return greatest >= 0.25 * perfect ? end : 0;
}

/// Centres of a branch that leaves its parent's lumen, found by the part of its wall that is not the parent's.
/// @param good     sample of the course that stands alone
/// @param outside  distance from the parent's axis in its radii
/// @returns the centres before `good`, nearest to the parent first
std::vector<Vector3> Extractor::FollowOuterWall(const Course& course, std::size_t good,
  const std::function<double(const Vector3&)>& outside) const
{
  const auto after = [&](double length)
  { return std::min(course.size() - 1, good + static_cast<std::size_t>(length / this->Step)); };
  std::vector<double> radii;
  std::vector<double> values;
  for (std::size_t i = good; i <= after(3.0 * course.radius[good]); ++i)
  {
    if (course.confidence[i] >= this->Settings.minimumConfidence)
    {
      radii.push_back(course.radius[i]);
      values.push_back(course.lumen[i]);
    }
  }
  if (radii.size() < 3)
  {
    return {};
  }
  std::sort(radii.begin(), radii.end());
  std::sort(values.begin(), values.end());
  const double radius = radii[radii.size() / 2];
  const double lumen = values[values.size() / 2];
  const auto isOwn = [&](const Vector3& wall) { return outside(wall) > 1.1; };

  // The centre nearest to the parent last.
  std::vector<Vector3> centres;
  for (std::size_t i = after(1.5 * radius) + 1; i-- > good;)
  {
    centres.push_back(course.points[i]);
  }
  const std::size_t known = centres.size();
  const auto chord = std::max<std::size_t>(2, static_cast<std::size_t>(1.5 * radius / this->Step));
  while (centres.size() < known + 200)
  {
    const Vector3& last = centres.back();
    const Vector3 back =
      (last - centres[centres.size() - 1 - std::min(chord, centres.size() - 1)]).normalized();
    const Vector3 next = last + this->Step * back;
    Vector3 centre;
    if (!back.allFinite() || outside(next) < 0.25 || outside(next) >= outside(last) ||
      !MeasureArc(*this->Image, next, back, radius, lumen, isOwn, this->Lumen, centre) ||
      (centre - next).norm() > 0.15 * radius)
    {
      break;
    }
    centres.push_back(centre);
  }
  return { centres.rbegin(), centres.rend() - static_cast<std::ptrdiff_t>(known) };
}

/// Replaces the part of a course inside its parent's lumen by the meeting of the two axes.
/// @returns the index of the parent's point in the tree
std::size_t Extractor::JoinParent(Course& course, std::int32_t owner) const
{
  const auto parent = static_cast<std::size_t>(this->BranchOf[static_cast<std::size_t>(owner)]);
  const std::vector<std::int64_t>& chain = this->Tree.branches[parent].points;
  const auto meeting = std::find(chain.begin(), chain.end(), owner) - chain.begin();
  const double parentRadius = this->Tree.radius[static_cast<std::size_t>(owner)];
  const auto window =
    static_cast<std::ptrdiff_t>(std::ceil((3.5 * parentRadius + 3.0 * this->Voxel) / this->Step));
  const auto low = std::max<std::ptrdiff_t>(0, meeting - window);
  const auto high =
    std::min<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(chain.size()) - 1, meeting + window);

  const auto outside = [&](const Vector3& point)
  {
    // In units of the parent's radius.
    double least = std::numeric_limits<double>::infinity();
    for (std::ptrdiff_t i = low; i <= high; ++i)
    {
      const auto p = static_cast<std::size_t>(chain[static_cast<std::size_t>(i)]);
      least = std::min(least, (point - this->Tree.points[p]).norm() / this->Tree.radius[p]);
    }
    return least;
  };

  // The first part that is clearly a vessel of its own.
  std::size_t first = 0;
  while (first + 1 < course.size() && outside(course.points[first]) < 1.15)
  {
    ++first;
  }
  std::size_t good = first;
  while (good < course.size() && course.confidence[good] < this->Settings.minimumConfidence)
  {
    ++good;
  }
  if (good >= course.size())
  {
    good = std::min(first, course.size() - 1);
  }
  // A great branch stands alone far from the axis only: from there back into the parent's lumen, as
  // far as its outer wall is to be seen. Not in masks and surfaces: there an axis is that of
  // inscribed spheres, and a lumen that widens before it divides has no circle.
  const bool great =
    std::isnan(this->Lumen.level) && course.radius[good] > GreatBranch * parentRadius;
  const std::vector<Vector3> arcs =
    great ? this->FollowOuterWall(course, good, outside) : std::vector<Vector3>();
  std::vector<Vector3> samples = arcs;
  // Over a short chord: a branch may turn within two radii of its mouth.
  const double length =
    std::max((arcs.empty() ? 1.4 : 1.0) * course.radius[good], 4.0 * this->Voxel);
  for (std::size_t i = good; i < course.size() && samples.size() * this->Step <= length; ++i)
  {
    if (course.confidence[i] >= this->Settings.minimumConfidence || i == good)
    {
      samples.push_back(course.points[i]);
    }
  }
  samples.resize(std::min(
    samples.size(), std::max<std::size_t>(4, static_cast<std::size_t>(length / this->Step))));
  auto best = static_cast<std::size_t>(owner);
  double least = std::numeric_limits<double>::infinity();
  if (samples.size() >= 3)
  {
    Vector3 direction = (samples.back() - samples.front()).normalized();
    if (great)
    {
      // A great branch leaves in the direction of the flow and bends away, inside the lumen too.
      const auto at = [&](std::ptrdiff_t i) -> const Vector3&
      {
        const std::int64_t p = chain[static_cast<std::size_t>(i)];
        return this->Tree.points[static_cast<std::size_t>(p)];
      };
      direction = (direction + GreatBranchBend * (at(high) - at(low)).normalized()).normalized();
    }
    for (std::ptrdiff_t i = low; i <= high; ++i)
    {
      const auto p = static_cast<std::size_t>(chain[static_cast<std::size_t>(i)]);
      // Behind the daughter's beginning, and not far away.
      const double along = (this->Tree.points[p] - samples.front()).dot(direction);
      const double distance = LineDistance(this->Tree.points[p], samples.front(), direction) +
        (along > 0.0 ? 2.0 * along : 0.0) - 0.02 * along;
      if (distance < least)
      {
        least = distance;
        best = p;
      }
    }
  }
  if (least > 1.2 * parentRadius + this->Voxel)
  {
    least = std::numeric_limits<double>::infinity();
    for (std::ptrdiff_t i = low; i <= high; ++i)
    {
      const auto p = static_cast<std::size_t>(chain[static_cast<std::size_t>(i)]);
      const double distance = (this->Tree.points[p] - course.points[good]).norm();
      if (distance < least)
      {
        least = distance;
        best = p;
      }
    }
  }

  // A straight line from axis to axis; its samples are guesses.
  Course joined;
  const auto add = [&](const Vector3& point, double confidence)
  {
    joined.points.push_back(point);
    joined.radius.push_back(course.radius[good]);
    joined.confidence.push_back(confidence);
    joined.lumen.push_back(0.0);
  };
  const std::vector<Vector3> bridge = ResampleCurve(
    { this->Tree.points[best], arcs.empty() ? course.points[good] : arcs.front() }, this->Step);
  for (std::size_t i = 0; i + 1 < bridge.size(); ++i)
  {
    add(bridge[i], 0.0);
  }
  for (const Vector3& arc : arcs)
  {
    add(arc, 0.5 * course.confidence[good]);
  }
  joined.points.insert(joined.points.end(),
    course.points.begin() + static_cast<std::ptrdiff_t>(good), course.points.end());
  joined.radius.insert(joined.radius.end(),
    course.radius.begin() + static_cast<std::ptrdiff_t>(good), course.radius.end());
  joined.confidence.insert(joined.confidence.end(),
    course.confidence.begin() + static_cast<std::ptrdiff_t>(good), course.confidence.end());
  joined.lumen.insert(joined.lumen.end(), course.lumen.begin() + static_cast<std::ptrdiff_t>(good),
    course.lumen.end());
  course = std::move(joined);
  return best;
}

/// @returns the last point of the new branch in the tree, or -1 if there is none
std::int64_t Extractor::Append(const Way& way, int treeId, bool wanted)
{
  if (!way.closed)
  {
    return -1;
  }
  std::vector<Vector3> points(way.points.rbegin(), way.points.rend());
  for (Vector3& point : points)
  {
    point = this->FrameToWorld(point);
  }
  Course course;
  course.points = ResampleCurve(points, this->Step);
  if (course.size() < 3)
  {
    return -1;
  }
  const bool root = way.owner == NoOwner;
  const double parentRadius = root ? 0.0 : this->Tree.radius[static_cast<std::size_t>(way.owner)];
  const double least = this->Settings.minimumBranchLength > 0.0
    ? this->Settings.minimumBranchLength
    : std::max(10.0 * this->Voxel, 1.5 * parentRadius);
  if (!wanted && (course.size() - 1) * this->Step < least)
  {
    return -1;
  }

  // Steps of voxels gone; then the sections of a path that is still off the axis.
  course.confidence.assign(course.size(), 1.0);
  this->SmoothPositions(course, 10.0, 10.0);
  this->Measure(course, this->Settings.snap);
  if (this->Settings.snap)
  {
    this->Recentre(course);
  }
  if (!wanted)
  {
    this->MarkCrossings(course);
    std::vector<double> before;
    if (!root)
    {
      const auto parent =
        static_cast<std::size_t>(this->BranchOf[static_cast<std::size_t>(way.owner)]);
      for (const std::int64_t p : this->Tree.branches[parent].points)
      {
        before.push_back(this->Tree.radius[static_cast<std::size_t>(p)]);
        if (p == way.owner)
        {
          break;
        }
      }
    }
    const std::size_t end =
      this->SeenUpTo(course, root ? this->Lumen.maximumRadius : parentRadius, before);
    course.resize(end);
    if ((static_cast<double>(end) - 1.0) * this->Step < least)
    {
      return -1;
    }
  }
  if (root && !this->Calibrated)
  {
    this->Calibrate(course);
  }
  if (this->Settings.snap)
  {
    for (int round = 0; round < 2; ++round)
    {
      this->SmoothPositions(course, root ? 0.05 : 0.0, 0.0);
      course.points = ResampleCurve(course.points, this->Step);
      course.resize(course.points.size());
      this->Measure(course, true);
    }
  }
  std::int64_t start = -1;
  if (!root)
  {
    start = static_cast<std::int64_t>(this->JoinParent(course, way.owner));
  }
  if (course.size() < 3)
  {
    return -1;
  }
  if (this->Settings.snap)
  {
    this->SmoothPositions(course, root ? 0.05 : 1e3, 0.0);
  }
  this->SmoothRadii(course);

  CenterlineTree::Branch branch;
  branch.groupId = static_cast<int>(this->Tree.branches.size());
  branch.treeId = treeId;
  if (!root)
  {
    branch.parentGroupId = this->BranchOf[static_cast<std::size_t>(start)];
    branch.points.push_back(start);
  }
  for (std::size_t i = root ? 0 : 1; i < course.size(); ++i)
  {
    branch.points.push_back(static_cast<std::int64_t>(this->Tree.points.size()));
    this->Tree.points.push_back(course.points[i]);
    this->Tree.radius.push_back(course.radius[i]);
    this->Tree.confidence.push_back(course.confidence[i]);
    this->PointLumen.push_back(course.lumen[i]);
    this->BranchOf.push_back(branch.groupId);
  }
  this->Tree.branches.push_back(branch);
  this->Own(this->Tree.branches.size() - 1);
  return branch.points.back();
}

void Extractor::Own(std::size_t index)
{
  const CenterlineTree::Branch& branch = this->Tree.branches[index];
  for (const std::int64_t p : branch.points)
  {
    const auto point = static_cast<std::size_t>(p);
    const Vector3 centre = this->ToIndex(this->Tree.points[point]);
    const double own = this->Tree.radius[point] + 0.25 * this->Voxel;
    const double cover = 1.3 * this->Tree.radius[point] + 1.5 * this->Voxel;
    const std::array<int, 6>& box = this->Region.Box();
    int range[6];
    for (int axis = 0; axis < 3; ++axis)
    {
      const double steps = cover / this->Spacing[axis];
      range[2 * axis] =
        static_cast<int>(std::max<double>(box[2 * axis], std::ceil(centre[axis] - steps)));
      range[2 * axis + 1] =
        static_cast<int>(std::min<double>(box[2 * axis + 1], std::floor(centre[axis] + steps)));
    }
    for (int k = range[4]; k <= range[5]; ++k)
    {
      for (int j = range[2]; j <= range[3]; ++j)
      {
        for (int i = range[0]; i <= range[1]; ++i)
        {
          const std::uint32_t number = this->Region.NumberOf(i, j, k);
          if (number == None)
          {
            continue;
          }
          const double distance = (Vector3(i, j, k) - centre).cwiseProduct(this->Spacing).norm();
          if (distance > cover)
          {
            continue;
          }
          this->Covered[number] = true;
          if (distance <= own)
          {
            const std::int32_t old = this->Owner[number];
            if (old == NoOwner ||
              distance <
                (Vector3(i, j, k) - this->ToIndex(this->Tree.points[static_cast<std::size_t>(old)]))
                  .cwiseProduct(this->Spacing)
                  .norm())
            {
              this->Owner[number] = static_cast<std::int32_t>(p);
            }
          }
        }
      }
    }
  }
}

void Extractor::FindTips()
{
  // Tips are where the fastest path is longest among all neighbours.
  const std::vector<float>& length = this->Marching->Length();
  struct Tip
  {
    float length;
    std::uint32_t number;
    VoxelRegion::Address address;
  };
  std::vector<Tip> tips;
  const double least = this->Settings.minimumBranchLength > 0.0 ? this->Settings.minimumBranchLength
                                                                : 10.0 * this->Voxel;
  this->Region.ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      if (!std::isfinite(length[number]) || length[number] < least)
      {
        return;
      }
      for (int k = 0; k < 3; ++k)
      {
        for (int j = 0; j < 3; ++j)
        {
          for (int i = 0; i < 3; ++i)
          {
            VoxelRegion::Address near = address;
            near = i == 0 ? this->Region.Below(near, 0)
              : i == 2    ? this->Region.Above(near, 0)
                          : near;
            near = j == 0 ? this->Region.Below(near, 1)
              : j == 2    ? this->Region.Above(near, 1)
                          : near;
            near = k == 0 ? this->Region.Below(near, 2)
              : k == 2    ? this->Region.Above(near, 2)
                          : near;
            const std::uint32_t other = this->Region.Number(near);
            if (other != None && std::isfinite(length[other]) && length[other] > length[number])
            {
              return;
            }
          }
        }
      }
      tips.push_back({ length[number], number, address });
    });
  std::sort(tips.begin(), tips.end(),
    [](const Tip& a, const Tip& b)
    { return a.length != b.length ? a.length > b.length : a.number < b.number; });

  std::size_t done = 0;
  std::int64_t steps = 0;
  for (const Tip& tip : tips)
  {
    Report(
      this->Progress, 0.6 + 0.38 * static_cast<double>(done++) / static_cast<double>(tips.size()));
    if (this->Covered[tip.number])
    {
      continue;
    }
    if (steps >= this->Settings.stepLimit)
    {
      this->Result.complete = false;
      std::ostringstream text;
      text << "stopped by the limit of " << this->Settings.stepLimit
           << " steps while following branches: " << tips.size() - done + 1
           << " possible tips were not looked at";
      this->Result.messages.push_back(text.str());
      return;
    }
    const std::array<int, 3> index = this->Region.IndexOf(tip.address);
    const Way way = this->WayBack(Vector3(index[0], index[1], index[2]), tip.number);
    steps += static_cast<std::int64_t>(way.points.size());
    if (this->Append(way, this->Marching->Source()[tip.number], false) >= 0)
    {
      continue;
    }
    // Tips beside this one share its way, and what was seen along it.
    for (std::size_t p = 0; p < way.points.size() / 2; ++p)
    {
      const Vector3 centre = way.points[p].cwiseQuotient(this->Spacing);
      for (int near = 0; near < 27; ++near)
      {
        const std::uint32_t number =
          this->Region.NumberOf(static_cast<int>(std::lround(centre[0])) + near % 3 - 1,
            static_cast<int>(std::lround(centre[1])) + near / 3 % 3 - 1,
            static_cast<int>(std::lround(centre[2])) + near / 9 - 1);
        if (number != None)
        {
          this->Covered[number] = true;
        }
      }
    }
  }
}

/// @returns false if none are to be followed
bool Extractor::ThinBranchesFor(ThinBranchSettings& settings) const
{
  const double contrast = this->Lumen.reference.lumen - this->Lumen.reference.background;
  if (!this->Settings.thinBranches || !this->Input.intensity || !this->Calibrated ||
    !(contrast > 0.0))
  {
    return false;
  }
  settings.voxel = this->Voxel;
  settings.step = this->Step;
  settings.minimumLength = std::max(this->Settings.minimumBranchLength, 15.0 * this->Voxel);
  settings.maximumLength = 200.0 * this->Voxel;
  settings.contrast = contrast;
  return true;
}

bool Extractor::IsExcludedAt(const Vector3& point) const
{
  const Vector3 index = this->ToIndex(point);
  return !this->Excluded.empty() && this->InImage(index) &&
    this->Excluded[this->Offset(static_cast<int>(std::lround(index[0])),
      static_cast<int>(std::lround(index[1])), static_cast<int>(std::lround(index[2])))] != 0;
}

/// Whether a way leads into what is known to be no artery: for a quarter of it.
bool Extractor::IsExcluded(const std::vector<Vector3>& points) const
{
  if (this->Excluded.empty())
  {
    return false;
  }
  std::size_t inside = 0;
  double length = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (this->IsExcludedAt(points[i]))
    {
      ++inside;
      length += i > 0 ? (points[i] - points[i - 1]).norm() : 0.0;
    }
  }
  // Along a vein, not across it.
  return length > LongestCrossing || 4 * inside > points.size();
}

/// @param excluded  may be what this one was made with: it is read before it is changed
bool Extractor::ExcludeVeins(std::vector<unsigned char>& excluded, std::vector<RejectedVein>& veins,
  std::vector<VeinBranch>& judged) const
{
  if (!this->Input.intensity || !this->Calibrated)
  {
    return false;
  }
  const CenterlineTree& tree = this->Result.tree;
  std::vector<VeinBranch> found;
  const auto closedBefore = [&](const Vector3& point) { return this->IsExcludedAt(point); };
  for (VeinBranch& branch :
    JudgeBranches(tree, *this->Image, this->Lumen.reference, this->Blur, closedBefore))
  {
    if (branch.probability >= 0.5)
    {
      found.push_back(branch);
    }
    judged.push_back(std::move(branch));
  }
  if (found.empty())
  {
    return false;
  }
  excluded.resize(static_cast<std::size_t>(this->Size[0]) * this->Size[1] * this->Size[2], 0);
  // In units of the radius the nearest lumen has a voxel.
  const auto mark = [&](std::size_t p, double reach, unsigned char value)
  {
    const Vector3 centre = this->ToIndex(tree.points[p]);
    const std::array<int, 6>& e = this->Input.grid.extent;
    int range[6];
    for (int axis = 0; axis < 3; ++axis)
    {
      const double steps = reach / this->Spacing[axis];
      range[2 * axis] = std::max(e[2 * axis], static_cast<int>(std::ceil(centre[axis] - steps)));
      range[2 * axis + 1] =
        std::min(e[2 * axis + 1], static_cast<int>(std::floor(centre[axis] + steps)));
    }
    for (int k = range[4]; k <= range[5]; ++k)
    {
      for (int j = range[2]; j <= range[3]; ++j)
      {
        for (int i = range[0]; i <= range[1]; ++i)
        {
          if ((Vector3(i, j, k) - centre).cwiseProduct(this->Spacing).norm() <= reach)
          {
            excluded[this->Offset(i, j, k)] = value;
          }
        }
      }
    }
  };
  std::vector<char> closed(tree.points.size(), 0);
  for (const VeinBranch& vein : found)
  {
    double length = 0.0;
    for (std::size_t i = 0; i < vein.closed.size(); ++i)
    {
      const auto p = static_cast<std::size_t>(vein.closed[i]);
      closed[p] = 1;
      mark(p, tree.radius[p] + 0.5 * this->Voxel, 1);
      length += i == 0
        ? 0.0
        : (tree.points[p] - tree.points[static_cast<std::size_t>(vein.closed[i - 1])]).norm();
    }
    const Vector3& place = tree.points[static_cast<std::size_t>(vein.closed.front())];
    const auto known = std::find_if(veins.begin(), veins.end(),
      [&](const RejectedVein& other) { return (other.position - place).norm() < SamePlace; });
    if (known != veins.end())
    {
      known->length = std::max(known->length, length);
      known->probability = std::max(known->probability, vein.probability);
    }
    else
    {
      veins.push_back({ place, length, vein.probability });
    }
  }
  // What the arteries' own lumens cover stays theirs.
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    if (closed[p] == 0)
    {
      mark(p, tree.radius[p], 0);
    }
  }
  // What leaves a vein may be an artery that it crosses: the way across stays open.
  for (const CenterlineTree::Branch& branch : tree.branches)
  {
    const auto first = static_cast<std::size_t>(branch.points.front());
    const auto second = static_cast<std::size_t>(branch.points[1]);
    if (closed[first] != 0 && closed[second] == 0)
    {
      const auto middle = static_cast<std::size_t>(branch.points[branch.points.size() / 2]);
      mark(first, tree.radius[first] + tree.radius[middle] + 2.0 * this->Voxel, 0);
    }
  }
  return true;
}

/// What is too thin for the region, by the image alone.
void Extractor::FollowThinBranches()
{
  ThinBranchSettings settings;
  if (!this->ThinBranchesFor(settings))
  {
    return;
  }
  // Several spots lead to one vessel: what was followed once, whether to keep or not, is done.
  std::vector<Vector3> done;
  for (const ThinBranch& branch : FindThinBranches(*this->Image, this->Tree, settings))
  {
    std::size_t known = 0;
    for (const Vector3& point : branch.points)
    {
      known += std::any_of(done.begin(), done.end(),
        [&](const Vector3& other)
        { return (other - point).squaredNorm() < 4.0 * this->Voxel * this->Voxel; });
    }
    if (2 * known > branch.points.size() || this->IsExcluded(branch.points))
    {
      continue;
    }
    done.insert(done.end(), branch.points.begin(), branch.points.end());
    Way way;
    way.owner = branch.parent;
    way.points.assign(branch.points.rbegin(), branch.points.rend());
    const auto parent =
      static_cast<std::size_t>(this->BranchOf[static_cast<std::size_t>(branch.parent)]);
    this->Append(way, this->Tree.branches[parent].treeId, false);
  }
}

/// What goes on beyond a tip, by the image alone.
void Extractor::LengthenTips()
{
  ThinBranchSettings settings;
  if (!this->ThinBranchesFor(settings) || this->Tree.points.empty())
  {
    return;
  }
  const std::vector<TipPath> paths = FollowTips(*this->Image, this->Tree, settings);
  for (std::size_t b = 0; b < paths.size(); ++b)
  {
    if (paths[b].points.empty() || this->IsExcluded(paths[b].points))
    {
      continue;
    }
    std::vector<std::int64_t>& chain = this->Tree.branches[b].points;
    // With a part of what is known, so that it goes on smoothly.
    const std::size_t known = std::min<std::size_t>(paths[b].known, 12);
    Course course;
    for (std::size_t i = paths[b].known - known; i < paths[b].known; ++i)
    {
      course.points.push_back(this->Tree.points[static_cast<std::size_t>(chain[i])]);
    }
    course.points.insert(course.points.end(), paths[b].points.begin(), paths[b].points.end());
    course.points = ResampleCurve(course.points, this->Step);
    course.confidence.assign(course.size(), 0.2);
    std::fill_n(course.confidence.begin(), std::min(known, course.size()), 1.0);
    this->SmoothPositions(course, 1e3, 0.0);
    this->Measure(course, false);
    this->SmoothRadii(course);
    std::size_t at = paths[b].known;
    for (std::size_t i = known; i < course.size(); ++i, ++at)
    {
      if (at == chain.size())
      {
        chain.push_back(static_cast<std::int64_t>(this->Tree.points.size()));
        this->Tree.points.emplace_back();
        this->Tree.radius.emplace_back();
        this->Tree.confidence.emplace_back();
        this->PointLumen.emplace_back();
        this->BranchOf.push_back(static_cast<std::int32_t>(b));
      }
      const auto point = static_cast<std::size_t>(chain[at]);
      this->Tree.points[point] = course.points[i];
      this->Tree.radius[point] = course.radius[i];
      this->Tree.confidence[point] = course.confidence[i];
      this->PointLumen[point] = course.lumen[i];
    }
    chain.resize(at);
    this->Own(b);
  }
}

/// Branches that were entered from their ends begin where they leave their own vessel.
void Extractor::TurnBranches()
{
  if (!this->Image || !std::isnan(this->Lumen.level) || this->Tree.branches.empty())
  {
    return;
  }
  const auto at = [&](std::int64_t point)
  { return Text(this->ToGiven(this->Tree.points[static_cast<std::size_t>(point)])); };
  std::vector<TurnedBranch> turned = FindTurnedBranches(*this->Image, this->Tree, this->Voxel);
  for (const TurnedBranch& one : turned)
  {
    const CenterlineTree::Branch branch = this->Tree.branches[one.branch];
    const std::string text = "a vessel of " + std::to_string(std::lround(one.length)) +
      " mm from " + at(branch.points.back()) + " to " + at(branch.points.front()) +
      " touches another one at its end";
    bool joined = false;
    if (one.root >= 0)
    {
      Way way;
      way.owner = static_cast<std::int32_t>(one.root);
      for (std::size_t i = one.contact; i < branch.points.size(); ++i)
      {
        way.points.push_back(this->Tree.points[static_cast<std::size_t>(branch.points[i])]);
      }
      way.points.insert(way.points.end(), one.way.rbegin(), one.way.rend());
      joined = !this->IsExcluded(one.way) && this->Append(way, branch.treeId, true) >= 0;
    }
    this->Result.messages.push_back(text +
      (joined ? "; it is taken for a branch that leaves at " + at(one.root)
              : "; where it begins is not seen, and it is left out"));
  }
  for (auto one = turned.rbegin(); one != turned.rend(); ++one)
  {
    this->Remove(one->branch);
  }
}

/// A branch without daughters.
void Extractor::Remove(std::size_t index)
{
  const auto removed = static_cast<int>(index);
  const int parent = this->Tree.branches[index].parentGroupId;
  this->Tree.branches.erase(this->Tree.branches.begin() + removed);
  for (CenterlineTree::Branch& branch : this->Tree.branches)
  {
    branch.groupId -= branch.groupId > removed ? 1 : 0;
    branch.parentGroupId -= branch.parentGroupId > removed ? 1 : 0;
  }
  for (std::int32_t& branch : this->BranchOf)
  {
    branch = branch == removed ? parent : branch;
    branch -= branch > removed ? 1 : 0;
  }
}

void Extractor::FollowTargets()
{
  const double reach = this->Settings.snapDistance > 0.0
    ? this->Settings.snapDistance
    : std::max(3.0 * this->Voxel, this->Lumen.reference.radius);
  for (std::size_t t = 0; t < this->Input.targets.size(); ++t)
  {
    CenterlineEnd& end = this->Result.targets[t];
    const Vector3 index = this->ToIndex(this->Input.targets[t]);
    const std::string name = "target " + std::to_string(t) + " at " + Text(this->Given.targets[t]);
    if (!this->InImage(index))
    {
      end.status = EndStatus::OutsideImage;
      end.message = name + " lies outside the image";
      continue;
    }
    const std::uint32_t nearest = this->NearestMember(index, reach, false);
    if (nearest == None)
    {
      end.status = EndStatus::OutsideRegion;
      std::ostringstream text;
      text << name << " has no vessel within " << reach
           << " mm: no voxel there is above the threshold";
      end.message = text.str();
      continue;
    }
    const std::uint32_t member = this->NearestMember(index, reach, true);
    if (member == None)
    {
      end.status = this->Result.complete ? EndStatus::NotConnected : EndStatus::LimitReached;
      end.message = name +
        (this->Result.complete ? " can not be reached from any seed through vessels"
                               : " was not reached before the limit");
      continue;
    }
    end.treeId = this->Marching->Source()[member];
    const std::uint32_t here = this->Region.NumberOf(static_cast<int>(std::lround(index[0])),
      static_cast<int>(std::lround(index[1])), static_cast<int>(std::lround(index[2])));
    Vector3 from = index;
    if (here != member)
    {
      this->Region.ForEach(
        [&](std::uint32_t number, VoxelRegion::Address address)
        {
          if (number == member)
          {
            const std::array<int, 3> at = this->Region.IndexOf(address);
            from = Vector3(at[0], at[1], at[2]);
          }
        });
    }
    if (this->Owner[member] != NoOwner)
    {
      end.status = EndStatus::Reached;
      end.point = this->Owner[member];
      continue;
    }
    end.point = this->Append(this->WayBack(from, member), end.treeId, true);
    end.status = end.point >= 0 ? EndStatus::Reached : EndStatus::TooShort;
    if (end.point < 0)
    {
      end.message = name + " lies in the lumen of its seed or branch: there is no path to draw";
    }
  }
}

/// Sets `turning` off from the straight axis of `parent` and `straight`, if these two are that.
void Extractor::StraightenFork(
  CenterlineTree& tree, std::size_t parent, std::size_t turning, std::size_t straight) const
{
  const auto at = [&](std::int64_t point) -> Vector3&
  { return tree.points[static_cast<std::size_t>(point)]; };
  const auto radiusAt = [&](std::int64_t point) -> double&
  { return tree.radius[static_cast<std::size_t>(point)]; };
  const auto after = [&](const std::vector<std::int64_t>& points, std::size_t from, double length)
  {
    std::size_t i = from;
    for (double passed = 0.0; i + 1 < points.size() && passed < length; ++i)
    {
      passed += (at(points[i + 1]) - at(points[i])).norm();
    }
    return i;
  };
  // All from the fork on.
  std::vector<std::int64_t> behind = tree.branches[parent].points;
  std::reverse(behind.begin(), behind.end());
  const std::vector<std::int64_t>& ahead = tree.branches[straight].points;
  const std::vector<std::int64_t>& aside = tree.branches[turning].points;
  const double wide = radiusAt(behind.front());

  // The straight axis is a cubic curve between the parts that the mouth does not reach.
  const double reach = wide + 0.5 * radiusAt(aside[aside.size() / 2]);
  const double chord = 1.5 * wide + 2.0 * this->Voxel;
  const std::size_t low = after(behind, 0, reach);
  const std::size_t high = after(ahead, 0, reach);
  const std::size_t lowest = after(behind, low, chord);
  const std::size_t highest = after(ahead, high, chord);
  const std::size_t out = after(aside, 0, reach + wide);
  const std::size_t farthest = after(aside, out, chord);
  const Vector3 from = at(behind[low]);
  const Vector3 to = at(ahead[high]);
  const auto isShort = [&](const std::vector<std::int64_t>& points, std::size_t i, std::size_t j)
  { return (at(points[j]) - at(points[i])).norm() < 0.5 * chord; };
  if (isShort(behind, low, lowest) || isShort(ahead, high, highest) ||
    isShort(aside, out, farthest))
  {
    return;
  }
  const Vector3 forwards = (from - at(behind[lowest])).normalized();
  const Vector3 onwards = (at(ahead[highest]) - to).normalized();
  const Vector3 away = (at(aside[farthest]) - at(aside[out])).normalized();
  const double bend = std::acos(std::min(1.0, std::max(-1.0, forwards.dot(onwards))));
  if (bend > MostBend || forwards.dot(away) > std::cos(bend + LeastTurn))
  {
    return;
  }
  const double handle = (to - from).norm() / 3.0;
  const BezierCurve bezier{ from, from + handle * forwards, to - handle * onwards, to };
  const auto axis = [&](double t) { return BezierPoint(bezier, t); };
  constexpr int pieces = 100;
  const auto distance = [&](const Vector3& point)
  {
    double least = std::numeric_limits<double>::infinity();
    for (int piece = 0; piece <= pieces; ++piece)
    {
      least = std::min(least, (axis(static_cast<double>(piece) / pieces) - point).norm());
    }
    return least;
  };
  std::size_t alone = 1;
  while (alone < out &&
    (distance(at(aside[alone])) < 1.15 * wide ||
      tree.confidence[static_cast<std::size_t>(aside[alone])] < this->Settings.minimumConfidence))
  {
    ++alone;
  }
  const Vector3 origin = at(aside[alone]);
  const double own = radiusAt(aside[alone]);
  const std::size_t end = after(aside, alone, std::max(1.4 * own, 4.0 * this->Voxel));
  Vector3 direction = (at(aside[end]) - origin).normalized();
  if (own > GreatBranch * wide)
  {
    direction = (direction + GreatBranchBend * forwards).normalized();
  }
  double least = std::numeric_limits<double>::infinity();
  double meeting = 0.0;
  for (int piece = 0; piece <= pieces; ++piece)
  {
    const double t = static_cast<double>(piece) / pieces;
    const double lateral = LineDistance(axis(t), origin, direction);
    if (lateral < least)
    {
      least = lateral;
      meeting = t;
    }
  }
  if (least > wide || meeting < 0.02 || meeting > 0.98)
  {
    return;
  }
  const Vector3 fork = axis(meeting);
  const auto place = [&](const std::vector<std::int64_t>& points, std::size_t last,
                       const std::function<Vector3(double)>& curve)
  {
    for (std::size_t i = 0; i < last; ++i)
    {
      at(points[i]) = curve(static_cast<double>(i) / static_cast<double>(last));
      tree.confidence[static_cast<std::size_t>(points[i])] = 0.0;
    }
  };
  place(aside, alone, [&](double t) -> Vector3 { return fork + t * (origin - fork); });
  for (std::size_t i = 1; i < alone; ++i)
  {
    radiusAt(aside[i]) = std::min(radiusAt(aside[i]), own);
  }
  place(behind, low, [&](double t) { return axis(meeting * (1.0 - t)); });
  place(ahead, high, [&](double t) { return axis(meeting + (1.0 - meeting) * t); });
}

/// A path that turned off is rounded where it did, and the vessel that went straight on was set on
/// to that curve. Only the two axes' places change.
void Extractor::StraightenForks(CenterlineTree& tree) const
{
  for (const auto& [parent, two] : ForksOfTwo(tree))
  {
    const auto pathOf = [&](std::int64_t p) { return this->BranchOf[static_cast<std::size_t>(p)]; };
    const std::vector<std::int64_t>& before = tree.branches[parent].points;
    const int path = pathOf(before[before.size() - 2]);
    for (std::size_t turning = 0; turning < 2; ++turning)
    {
      // The path that the other one was set on to.
      if (pathOf(tree.branches[two[turning]].points[1]) == path)
      {
        this->StraightenFork(tree, parent, two[turning], two[1 - turning]);
      }
    }
  }
}

Extractor::ForkFit Extractor::FitFork(const CenterlineTree& tree, std::size_t parent,
  std::size_t turning, std::size_t straight, double leastTurn) const
{
  // As far as the fit looks; the vessel that goes straight on also across its other forks.
  const double wide = tree.radius[static_cast<std::size_t>(tree.branches[parent].points.back())];
  const double reach = 8.0 * wide + 16.0 * this->Voxel;
  const Strand before = Upstream(tree, parent, reach);
  const Strand behind = Downstream(tree, straight, reach);
  ForkFit result;
  result.fork = before.points.size() - 1;
  result.through.points.assign(before.points.rbegin(), before.points.rend());
  result.through.points.insert(
    result.through.points.end(), behind.points.begin() + 1, behind.points.end());
  for (const std::size_t joint : before.joints)
  {
    result.through.joints.push_back(result.fork - joint);
  }
  for (const std::size_t joint : behind.joints)
  {
    result.through.joints.push_back(result.fork + joint);
  }
  result.side.Append(tree, tree.branches[turning].points, reach);

  BifurcationAxes axes;
  axes.fork = result.fork;
  for (const std::int64_t point : result.through.points)
  {
    axes.through.push_back(tree.points[static_cast<std::size_t>(point)]);
    axes.throughRadius.push_back(tree.radius[static_cast<std::size_t>(point)]);
  }
  for (const std::int64_t point : result.side.points)
  {
    axes.side.push_back(tree.points[static_cast<std::size_t>(point)]);
    axes.sideRadius.push_back(tree.radius[static_cast<std::size_t>(point)]);
  }
  result.fit = FitBifurcation(*this->Image, axes, this->Lumen, leastTurn);
  return result;
}

/// Puts the axes of a bifurcation where the fit has them; other forks stay where they are along theirs.
void Extractor::MoveFork(CenterlineTree& tree, const ForkFit& fork) const
{
  const BifurcationFit& fit = fork.fit;
  std::map<std::size_t, double> knots{ { fit.first, 0.0 }, { fork.fork, fit.meeting },
    { fit.last, 1.0 } };
  for (const std::size_t joint : fork.through.joints)
  {
    if (joint > fit.first && joint < fit.last)
    {
      const Vector3& point = tree.points[static_cast<std::size_t>(fork.through.points[joint])];
      double least = std::numeric_limits<double>::infinity();
      constexpr int pieces = 100;
      for (int i = 0; i <= pieces; ++i)
      {
        const double t = static_cast<double>(i) / pieces;
        const double distance = (BezierPoint(fit.through, t) - point).norm();
        if (distance < least)
        {
          least = distance;
          knots[joint] = t;
        }
      }
    }
  }
  for (auto knot = knots.begin(); std::next(knot) != knots.end(); ++knot)
  {
    if (std::next(knot)->second <= knot->second)
    {
      return;
    }
  }
  const auto place = [&](const std::vector<std::int64_t>& points, std::size_t from, std::size_t to,
                       const BezierCurve& curve, double start, double end)
  {
    for (std::size_t i = from; i <= to; ++i)
    {
      const double f = static_cast<double>(i - from) / static_cast<double>(to - from);
      tree.points[static_cast<std::size_t>(points[i])] =
        BezierPoint(curve, start + f * (end - start));
    }
  };
  for (auto knot = knots.begin(); std::next(knot) != knots.end(); ++knot)
  {
    place(fork.through.points, knot->first, std::next(knot)->first, fit.through, knot->second,
      std::next(knot)->second);
  }
  place(fork.side.points, 0, fit.end, fit.side, 0.0, 1.0);
}

/// The axes at the mouths of branches, as the wall around them has it.
void Extractor::FitForks(CenterlineTree& tree) const
{
  for (const auto& [parent, two] : ForksOfTwo(tree))
  {
    // Which one goes straight on is seen by the angles, or else by the wall.
    std::array<ForkFit, 2> fits;
    for (const double leastTurn : { LeastTurn, -2.0 * LeastTurn })
    {
      for (std::size_t turning = 0; turning < 2; ++turning)
      {
        fits[turning] = this->FitFork(tree, parent, two[turning], two[1 - turning], leastTurn);
      }
      if (fits[0].fit.found || fits[1].fit.found)
      {
        break;
      }
    }
    // Two that are as good as one another tell nothing.
    for (std::size_t turning = 0; turning < 2; ++turning)
    {
      const BifurcationFit& own = fits[turning].fit;
      const BifurcationFit& other = fits[1 - turning].fit;
      if (own.found && (!other.found || own.misfit < 0.9 * other.misfit))
      {
        this->MoveFork(tree, fits[turning]);
      }
    }
  }
}

/// Trees that come out of a wide body begin where their vessel leaves it.
void Extractor::SettleOstia()
{
  if (!this->Settings.snap || !this->Image || !std::isnan(this->Lumen.level))
  {
    return;
  }
  for (const OstialRoot& root : SettleRoots(this->Tree, *this->Image, this->Lumen))
  {
    if (!root.found)
    {
      this->Result.messages.push_back("the tree of seed " + std::to_string(root.treeId) +
        " begins at " + Text(this->ToGiven(root.position)) +
        ", which may be inside the aorta: no clear section of its first vessel before it parts");
    }
  }
}

void Extractor::Finish()
{
  for (std::size_t s = 0; s < this->Input.seeds.size(); ++s)
  {
    for (const CenterlineTree::Branch& branch : this->Tree.branches)
    {
      if (branch.parentGroupId == -1 && branch.treeId == static_cast<int>(s))
      {
        this->Result.seeds[s].point = branch.points.front();
        break;
      }
    }
    if (this->SeedUsed[s] && this->Result.seeds[s].point < 0)
    {
      this->Result.seeds[s].status = EndStatus::TooShort;
      this->Result.seeds[s].message = "seed " + std::to_string(s) + " at " +
        Text(this->Given.seeds[s]) + " has no branch that is long and clear enough";
    }
  }
  this->MarkBridged();
  this->CorrectRadii();
  this->SettleOstia();
  this->Result.tree = SplitAtBifurcations(this->Tree);
  if (this->Settings.snap)
  {
    this->StraightenForks(this->Result.tree);
    if (std::isnan(this->Lumen.level))
    {
      this->FitForks(this->Result.tree);
    }
    MeasureTree(this->Result.tree);
  }
  std::map<std::int64_t, CenterlineBifurcation> joints;
  for (const CenterlineTree::Branch& branch : this->Result.tree.branches)
  {
    if (branch.parentGroupId != -1)
    {
      CenterlineBifurcation& joint = joints[branch.points.front()];
      joint.point = branch.points.front();
      joint.parentGroupId = branch.parentGroupId;
      joint.daughterGroupIds.push_back(branch.groupId);
    }
  }
  for (const auto& [point, joint] : joints)
  {
    this->Result.bifurcations.push_back(joint);
  }
}

CenterlineResult Extractor::Run()
{
  this->Result.seeds.resize(this->Input.seeds.size());
  this->Result.targets.resize(this->Input.targets.size());
  this->PrepareMeasurement();
  Report(this->Progress, 0.05);
  this->MakeRegion();
  Report(this->Progress, 0.1);
  if (this->Region.Size() == 0)
  {
    this->Result.messages.emplace_back(
      "there is no voxel above the threshold: nothing to march in");
  }
  if (this->Region.Size() > this->Settings.voxelLimit)
  {
    this->Result.complete = false;
    this->Result.messages.push_back("the region has " + std::to_string(this->Region.Size()) +
      " voxels, more than the limit of " + std::to_string(this->Settings.voxelLimit) +
      ": raise the threshold, or give a mask");
    for (std::vector<CenterlineEnd>* ends : { &this->Result.seeds, &this->Result.targets })
    {
      for (CenterlineEnd& end : *ends)
      {
        end.status = EndStatus::LimitReached;
        end.message = "not followed: the region is larger than the limit";
      }
    }
    return this->Result;
  }
  const bool any = this->PlaceSeeds();
  if (any)
  {
    this->MarchFrom();
    this->Owner.assign(this->Region.Size(), NoOwner);
    this->Covered.assign(this->Region.Size(), false);
    if (this->Settings.findTips || this->Input.targets.empty())
    {
      this->FindTips();
      this->FollowThinBranches();
      this->TurnBranches();
      this->LengthenTips();
    }
    this->FollowTargets();
  }
  else
  {
    for (std::size_t t = 0; t < this->Input.targets.size(); ++t)
    {
      this->Result.targets[t].message =
        "target " + std::to_string(t) + " can not be reached: no seed lies in a vessel";
    }
  }
  this->Finish();
  Report(this->Progress, 1.0);
  return this->Result;
}
}

void CenterlineSettings::Validate() const
{
  const auto length = [](double value, const char* name)
  { Require(std::isfinite(value) && value >= 0.0, std::string(name) + " must not be negative"); };
  Require(!std::isinf(this->speedThreshold), "speedThreshold must be finite");
  Require(!std::isinf(this->intensityThreshold), "intensityThreshold must be finite");
  Require(
    this->speedExponent >= 0.5 && this->speedExponent <= 6.0, "speedExponent must be 0.5 to 6");
  Require(this->minimumConfidence >= 0.0 && this->minimumConfidence <= 1.0,
    "minimumConfidence must be 0 to 1");
  length(this->minimumBranchLength, "minimumBranchLength");
  length(this->maximumGap, "maximumGap");
  length(this->maximumRadius, "maximumRadius");
  length(this->resampling, "resampling");
  length(this->smoothing, "smoothing");
  length(this->blur, "blur");
  length(this->snapDistance, "snapDistance");
  Require(this->stepLimit > 0, "stepLimit must be positive");
  Require(this->voxelLimit > 0, "voxelLimit must be positive");
}

const char* EndStatusText(EndStatus status)
{
  switch (status)
  {
    case EndStatus::Reached:
      return "reached";
    case EndStatus::OutsideImage:
      return "outside the image";
    case EndStatus::OutsideRegion:
      return "no vessel there";
    case EndStatus::NotConnected:
      return "not connected";
    case EndStatus::InOtherTree:
      return "in another seed's vessel";
    case EndStatus::LimitReached:
      return "limit reached";
    case EndStatus::TooShort:
      return "too short";
  }
  return "";
}

CenterlineResult ExtractCenterlines(const CenterlineInput& input,
  const CenterlineSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  const auto require = [](bool condition, const char* requirement)
  {
    if (!condition)
    {
      throw std::invalid_argument(std::string("CenterlineInput: ") + requirement);
    }
  };
  require(input.speed || input.mask || input.wallDistance,
    "a speed, a mask or a wall distance is needed");
  require(!input.seeds.empty(), "at least one seed is needed");
  require(input.seeds.size() < 255, "at most 254 seeds are possible");
  require(input.grid.spacing.allFinite() && input.grid.spacing.minCoeff() > 0.0,
    "spacing must be positive");
  require(
    (input.grid.direction.transpose() * input.grid.direction - Matrix3::Identity()).norm() < 1e-6,
    "direction must be orthonormal");
  for (int axis = 0; axis < 3; ++axis)
  {
    require(input.grid.extent[2 * axis] <= input.grid.extent[2 * axis + 1], "the image is empty");
  }
  const auto finite = [](const Vector3& position) { return position.allFinite(); };
  require(std::all_of(input.seeds.begin(), input.seeds.end(), finite), "seeds must be finite");
  require(
    std::all_of(input.targets.begin(), input.targets.end(), finite), "targets must be finite");

  // Along the voxels' axes: rays and planes are the same for the same voxels, however the image lies in
  // the world.
  const Matrix3 turn = input.grid.direction.transpose();
  const Vector3 origin = input.grid.origin;
  const auto toFrame = [&](const Vector3& world) -> Vector3 { return turn * (world - origin); };
  CenterlineInput framed = input;
  framed.grid.origin = Vector3::Zero();
  framed.grid.direction = Matrix3::Identity();
  std::transform(framed.seeds.begin(), framed.seeds.end(), framed.seeds.begin(), toFrame);
  std::transform(framed.targets.begin(), framed.targets.end(), framed.targets.begin(), toFrame);
  for (VesselBridge& bridge : framed.bridges)
  {
    std::transform(bridge.points.begin(), bridge.points.end(), bridge.points.begin(), toFrame);
  }
  ScalarImage intensity;
  if (input.intensity)
  {
    intensity = *input.intensity;
    intensity.grid.origin = toFrame(intensity.grid.origin);
    intensity.grid.direction = turn * intensity.grid.direction;
    framed.intensity = &intensity;
  }
  // A vein that was followed is closed, and the trees are made anew: what was entered through it is entered where it
  // leaves its artery. A vein may cross every great branch of both coronary arteries, and what hangs on one crossing is
  // seen only when another one is closed.
  std::vector<unsigned char> excluded;
  std::vector<RejectedVein> veins;
  std::vector<VeinBranch> judged;
  CenterlineResult result;
  constexpr int rounds = 6;
  for (int round = 0; round <= rounds; ++round)
  {
    Extractor extractor(framed, input, excluded, settings, progress);
    result = extractor.Run();
    if (round == rounds || !extractor.ExcludeVeins(excluded, veins, judged))
    {
      break;
    }
  }
  const auto toWorld = [&](Vector3& point)
  { point = origin + input.grid.direction * Vector3(point); };
  for (RejectedVein& vein : veins)
  {
    toWorld(vein.position);
  }
  result.veins = std::move(veins);
  for (VeinBranch& branch : judged)
  {
    std::for_each(branch.course.begin(), branch.course.end(), toWorld);
  }
  result.judged = std::move(judged);
  std::for_each(result.tree.points.begin(), result.tree.points.end(), toWorld);
  return result;
}
}
