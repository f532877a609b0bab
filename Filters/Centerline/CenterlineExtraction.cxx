#include "CenterlineExtraction.h"

#include "BranchMouth.h"
#include "CurveSmoothing.h"
#include "ExcludedVoxels.h"
#include "ForkAxes.h"
#include "GridIndex.h"
#include "LesionCrossings.h"
#include "MeasuredPath.h"
#include "Median.h"
#include "OstialRoot.h"
#include "Require.h"
#include "ThinBranches.h"
#include "TurnedBranches.h"
#include "VesselMarch.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr std::uint32_t None = VoxelRegion::notAMember;

std::string Text(const Vector3& position)
{
  std::ostringstream text;
  text << '(' << position[0] << ", " << position[1] << ", " << position[2] << ')';
  return text.str();
}

class Extractor
{
public:
  /// @param given     the same input in world coordinates, for messages
  /// @param excluded  voxels that are no artery
  Extractor(const CenterlineInput& input, const CenterlineInput& given,
    const ExcludedVoxels& excluded, const CenterlineSettings& settings,
    const ProgressCallback& progress)
    : Input(input)
    , Given(given)
    , Excluded(excluded)
    , Settings(settings)
    , Progress(progress)
    , Paths(settings, input.grid)
    , March(input, settings)
  {
  }

  CenterlineResult Run();

  /// What JudgeBranches says of the tree that Run made.
  /// @param before  left out of the trees before
  std::vector<VeinBranch> JudgeVeins(const std::vector<RejectedVein>& before) const;

  /// mm, edge
  double Voxel() const { return this->Paths.voxel; }

private:
  /// In the coordinates that the input was given in.
  Vector3 ToGiven(const Vector3& frame) const
  {
    return this->Given.grid.origin + this->Given.grid.direction * frame;
  }

  void PrepareMeasurement();
  double IntensityThreshold() const;
  double SeedReach() const;
  std::uint32_t Locate(const Vector3& point, const std::string& name, CenterlineEnd& end) const;
  bool PlaceSeeds();
  void MarchFromSeeds();
  void Calibrate(const MeasuredPath& path);
  void MeasureBlur();
  void CorrectRadii();
  void SettleOstia();
  std::int64_t Append(const MinimalPath& way, int treeId, bool wanted);
  void Own(std::size_t branch);
  void FindTips();
  bool ThinBranchesFor(ThinBranchSettings& settings);
  void FollowThinBranches(std::int64_t from);
  void LengthenTips();
  void TurnBranches();
  void Remove(std::size_t index);
  void FollowTargets();
  void Finish();

  const CenterlineInput& Input;
  const CenterlineInput& Given;
  const ExcludedVoxels& Excluded;
  const CenterlineSettings& Settings;
  const ProgressCallback& Progress;
  std::vector<std::int16_t> MaskImage;
  ScalarImage MeasuredImage;
  PathMeasurement Paths;
  double Blur = 0.0;
  std::optional<NoisePaths> Noise;
  VesselMarch March;
  std::vector<std::uint32_t> SeedMembers;
  std::vector<std::int32_t> Owner; ///< of a member: the point of the tree whose lumen it is in
  std::vector<bool> Covered;       ///< members where no further tip is looked for
  VesselTree Tree;                 ///< not split
  std::vector<double> PointLumen;  ///< image value at a point of the tree
  bool Calibrated = false;
  std::vector<std::int32_t> BranchOf; ///< of a point of the tree
  CenterlineResult Result;
};

void Extractor::PrepareMeasurement()
{
  const auto voxels = static_cast<std::int64_t>(GridSize(this->Input.grid));
  if (this->Input.intensity)
  {
    this->MeasuredImage = *this->Input.intensity;
  }
  else if (this->Input.wallDistance)
  {
    this->MeasuredImage = { this->Input.wallDistance, this->Input.grid };
    this->Paths.lumen.level = 0.0;
  }
  else if (this->Input.mask && !this->Input.speed)
  {
    this->MaskImage.resize(static_cast<std::size_t>(voxels));
    std::transform(this->Input.mask, this->Input.mask + voxels, this->MaskImage.begin(),
      [](unsigned char value) { return static_cast<std::int16_t>(value ? 100 : 0); });
    this->MeasuredImage = { this->MaskImage.data(), this->Input.grid };
    this->Paths.lumen.level = 50.0;
  }
  else
  {
    this->MeasuredImage = { this->Input.speed, this->Input.grid };
  }
  this->Paths.image = std::make_unique<ImageInterpolator>(this->MeasuredImage);
  this->Blur = this->Settings.blur > 0.0 ? this->Settings.blur : 0.8 * this->Paths.voxel;

  // What a lumen looks like: the median of what the seeds show.
  std::vector<LumenReference> seen;
  if (std::isnan(this->Paths.lumen.level))
  {
    for (const Vector3& seed : this->Input.seeds)
    {
      LumenReference reference;
      if (this->Paths.image->Contains(seed) &&
        MeasureReference(*this->Paths.image, seed, reference))
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
        return MedianOf(std::move(values));
      };
      this->Paths.lumen.reference = { median(&LumenReference::lumen), 0.0,
        median(&LumenReference::radius) };
      this->Paths.lumen.reference.background = std::min_element(seen.begin(), seen.end(),
        [](const LumenReference& a, const LumenReference& b)
        { return a.background < b.background; })->background;
    }
  }
  this->Paths.lumen.maximumRadius = this->Settings.maximumRadius;
  if (this->Paths.lumen.maximumRadius == 0.0)
  {
    if (!std::isnan(this->Paths.lumen.level))
    {
      const float* distance = this->March.WallDistance();
      this->Paths.lumen.maximumRadius =
        1.5 * static_cast<double>(*std::max_element(distance, distance + voxels)) +
        this->Paths.voxel;
    }
    else
    {
      // Seeds beside the axis show less than the vessel's width: 3 mm, as coronary arteries have, are always looked for.
      // No scanner's voxels are smaller than 0.02 mm: then the unit is the metre.
      const double usual = this->Paths.voxel < 0.02 ? 0.003 : 3.0;
      this->Paths.lumen.maximumRadius =
        std::max({ 2.0 * this->Paths.lumen.reference.radius, 6.0 * this->Paths.voxel, usual });
    }
  }
}

/// At or below nothing is vessel.
double Extractor::IntensityThreshold() const
{
  if (!this->Input.intensity)
  {
    return -std::numeric_limits<double>::infinity();
  }
  return std::isnan(this->Settings.intensityThreshold) ? this->Paths.lumen.reference.background +
      0.4 * (this->Paths.lumen.reference.lumen - this->Paths.lumen.reference.background)
                                                       : this->Settings.intensityThreshold;
}

/// Mm from a given point to its vessel, at most.
double Extractor::SeedReach() const
{
  return this->Settings.snapDistance > 0.0
    ? this->Settings.snapDistance
    : std::max(3.0 * this->Paths.voxel, this->Paths.lumen.reference.radius);
}

/// The member nearest to a given point, or None: then `end` says why.
std::uint32_t Extractor::Locate(
  const Vector3& point, const std::string& name, CenterlineEnd& end) const
{
  const double reach = this->SeedReach();
  const Vector3 index = GridIndex(this->Input.grid, point);
  if (!IsInGrid(this->Input.grid, index))
  {
    end.status = EndStatus::OutsideImage;
    end.message = name + " lies outside the image";
    return None;
  }
  const std::uint32_t member = this->March.NearestMember(index, reach, false);
  if (member == None)
  {
    end.status = EndStatus::OutsideRegion;
    std::ostringstream text;
    text << name << " has no vessel within " << reach
         << " mm: no voxel there is above the threshold";
    end.message = text.str();
  }
  return member;
}

bool Extractor::PlaceSeeds()
{
  this->SeedMembers.assign(this->Input.seeds.size(), None);
  bool any = false;
  for (std::size_t s = 0; s < this->Input.seeds.size(); ++s)
  {
    CenterlineEnd& end = this->Result.seeds[s];
    end.treeId = static_cast<int>(s);
    const std::string name = "seed " + std::to_string(s) + " at " + Text(this->Given.seeds[s]);
    this->SeedMembers[s] = this->Locate(this->Input.seeds[s], name, end);
    if (this->SeedMembers[s] == None)
    {
      continue;
    }
    end.status = EndStatus::Reached;
    any = true;
  }
  return any;
}

void Extractor::MarchFromSeeds()
{
  const ProgressCallback progress = this->Progress
    ? ProgressCallback([&](double fraction) { return this->Progress(0.1 + 0.5 * fraction); })
    : ProgressCallback();
  this->March.March(*this->Paths.image, this->Paths.lumen.reference, this->SeedMembers, progress);
  this->Result.memory = this->March.MemorySize() +
    this->March.Region().Size() * (sizeof(float) + sizeof(std::int32_t)) +
    this->MaskImage.size() * sizeof(std::int16_t);
}

/// An ostium is at the edge of the aorta, its surroundings are not a vessel's: once a whole vessel is
/// known, its lumen is what others are compared with.
void Extractor::Calibrate(const MeasuredPath& path)
{
  if (!std::isnan(this->Paths.lumen.level))
  {
    return;
  }
  std::vector<double> values;
  std::vector<double> behind;
  for (std::size_t i = 0; i < path.size(); ++i)
  {
    if (path.confidence[i] > 0.8)
    {
      values.push_back(path.lumen[i]);
      behind.push_back(path.behind[i]);
    }
  }
  if (values.size() >= 10)
  {
    this->Paths.lumen.reference.lumen =
      std::max(this->Paths.lumen.reference.lumen, QuantileOf(std::move(values), 0.75));
    // The darkest surroundings: elsewhere muscle may lie against the vessel.
    this->Paths.lumen.reference.background = QuantileOf(std::move(behind), 0.25);
    this->Calibrated = true;
  }
}

/// How blurred the image is shows in the small vessels: the less of the great vessels' contrast they have at their size,
/// the more.
void Extractor::MeasureBlur()
{
  const LumenReference& reference = this->Paths.lumen.reference;
  const double contrast = reference.lumen - reference.background;
  if (this->Settings.blur != 0.0 || !this->Input.intensity || !(contrast > 0.0))
  {
    return;
  }
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
    this->Blur = std::min(
      std::max(MedianOf(std::move(blurs)), 0.4 * this->Paths.voxel), 4.0 * this->Paths.voxel);
  }
}

/// Half-maximum radii to true ones.
void Extractor::CorrectRadii()
{
  if (!this->Input.intensity)
  {
    return;
  }
  this->MeasureBlur();
  this->Result.blur = this->Blur;
  // A vessel thinner than half the blur shows less than 12 % of its contrast: what is seen is wider,
  // and what was measured narrower, or continued into the parent, is not the vessel's width.
  const double minimum = 0.5 * this->Blur;
  for (double& radius : this->Tree.radius)
  {
    radius = std::max(minimum, RadiusFromHalfMaximum(radius, this->Blur));
  }
}

/// @returns the last point of the new branch in the tree, or -1 if there is none
std::int64_t Extractor::Append(const MinimalPath& way, int treeId, bool wanted)
{
  if (!way.closed)
  {
    return -1;
  }
  MeasuredPath path;
  path.points = ResampleCurve({ way.points.rbegin(), way.points.rend() }, this->Paths.step);
  if (path.size() < 3)
  {
    return -1;
  }
  const bool root = way.owner == MinimalPath::noOwner;
  const double parentRadius = root ? 0.0 : this->Tree.radius[way.owner];
  const double minimum = this->Settings.minimumBranchLength > 0.0
    ? this->Settings.minimumBranchLength
    : std::max(10.0 * this->Paths.voxel, 1.5 * parentRadius);
  if (!wanted && (path.size() - 1) * this->Paths.step < minimum)
  {
    return -1;
  }

  // Steps of voxels gone; then the sections of a path that is still off the axis.
  path.confidence.assign(path.size(), 1.0);
  this->Paths.SmoothPositions(path, 10.0, 10.0);
  this->Paths.Measure(path, this->Settings.snap);
  if (this->Settings.snap)
  {
    this->Paths.Recentre(path);
  }
  if (!wanted)
  {
    MarkCrossings(path, this->Input.bridges, this->Paths);
    std::vector<double> before;
    if (!root)
    {
      const auto parent = static_cast<std::size_t>(this->BranchOf[way.owner]);
      for (const std::int64_t p : this->Tree.branches[parent].points)
      {
        before.push_back(this->Tree.radius[p]);
        if (p == way.owner)
        {
          break;
        }
      }
    }
    const std::size_t end =
      this->Paths.SeenUpTo(path, root ? this->Paths.lumen.maximumRadius : parentRadius, before);
    path.resize(end);
    if ((static_cast<double>(end) - 1.0) * this->Paths.step < minimum)
    {
      return -1;
    }
  }
  if (root && !this->Calibrated)
  {
    this->Calibrate(path);
  }
  if (this->Settings.snap)
  {
    for (int round = 0; round < 2; ++round)
    {
      this->Paths.SmoothPositions(path, root ? 0.05 : 0.0, 0.0);
      path.points = ResampleCurve(path.points, this->Paths.step);
      path.resize(path.points.size());
      this->Paths.Measure(path, true);
    }
  }
  std::int64_t start = -1;
  if (!root)
  {
    const auto parent = static_cast<std::size_t>(this->BranchOf[way.owner]);
    start = static_cast<std::int64_t>(
      JoinParent(path, this->Tree, this->Tree.branches[parent].points, way.owner, this->Paths));
  }
  if (path.size() < 3)
  {
    return -1;
  }
  if (this->Settings.snap)
  {
    this->Paths.SmoothPositions(path, root ? 0.05 : 1e3, 0.0);
  }
  this->Paths.SmoothRadii(path);

  VesselTree::Branch branch;
  branch.groupId = static_cast<int>(this->Tree.branches.size());
  branch.treeId = treeId;
  if (!root)
  {
    branch.parentGroupId = this->BranchOf[start];
    branch.points.push_back(start);
  }
  for (std::size_t i = root ? 0 : 1; i < path.size(); ++i)
  {
    branch.points.push_back(static_cast<std::int64_t>(this->Tree.points.size()));
    this->Tree.points.push_back(path.points[i]);
    this->Tree.radius.push_back(path.radius[i]);
    this->Tree.confidence.push_back(path.confidence[i]);
    this->PointLumen.push_back(path.lumen[i]);
    this->BranchOf.push_back(branch.groupId);
  }
  this->Tree.branches.push_back(branch);
  this->Own(this->Tree.branches.size() - 1);
  return branch.points.back();
}

void Extractor::Own(std::size_t index)
{
  const VesselTree::Branch& branch = this->Tree.branches[index];
  for (const std::int64_t p : branch.points)
  {
    const auto point = static_cast<std::size_t>(p);
    const Vector3 centre = GridIndex(this->Input.grid, this->Tree.points[point]);
    const double own = this->Tree.radius[point] + 0.25 * this->Paths.voxel;
    const double cover = 1.3 * this->Tree.radius[point] + 1.5 * this->Paths.voxel;
    const auto distanceTo = [&](const Vector3& from, const Vector3& to)
    { return (to - from).cwiseProduct(this->Input.grid.spacing).norm(); };
    BoxAround(centre, Vector3::Constant(cover).cwiseQuotient(this->Input.grid.spacing),
      this->March.Region().Box())
      .ForEach(
        [&](int i, int j, int k)
        {
          const std::uint32_t number = this->March.Region().NumberOf(i, j, k);
          if (number == None)
          {
            return;
          }
          const Vector3 voxel(i, j, k);
          const double distance = distanceTo(centre, voxel);
          if (distance > cover)
          {
            return;
          }
          this->Covered[number] = true;
          const std::int32_t old = this->Owner[number];
          if (distance <= own &&
            (old == MinimalPath::noOwner ||
              distance < distanceTo(GridIndex(this->Input.grid, this->Tree.points[old]), voxel)))
          {
            this->Owner[number] = static_cast<std::int32_t>(p);
          }
        });
  }
}

void Extractor::FindTips()
{
  // Tips are where the fastest path is longest among all neighbours.
  const std::vector<float>& length = this->March.Marched().Length();
  struct Tip
  {
    float length;
    std::uint32_t number;
    VoxelRegion::Address address;
  };
  std::vector<Tip> tips;
  const double minimum = this->Settings.minimumBranchLength > 0.0
    ? this->Settings.minimumBranchLength
    : 10.0 * this->Paths.voxel;
  this->March.Region().ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      if (!std::isfinite(length[number]) || length[number] < minimum)
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
            near = i == 0 ? this->March.Region().Below(near, 0)
              : i == 2    ? this->March.Region().Above(near, 0)
                          : near;
            near = j == 0 ? this->March.Region().Below(near, 1)
              : j == 2    ? this->March.Region().Above(near, 1)
                          : near;
            near = k == 0 ? this->March.Region().Below(near, 2)
              : k == 2    ? this->March.Region().Above(near, 2)
                          : near;
            const std::uint32_t other = this->March.Region().Number(near);
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
    const std::array<int, 3> index = this->March.Region().IndexOf(tip.address);
    const MinimalPath way =
      this->March.Backtrack(Vector3(index[0], index[1], index[2]), tip.number, this->Owner);
    steps += static_cast<std::int64_t>(way.points.size());
    if (this->Append(way, this->March.Marched().Source()[tip.number], false) >= 0)
    {
      continue;
    }
    // Tips beside this one share its way, and what was seen along it.
    for (std::size_t p = 0; p < way.points.size() / 2; ++p)
    {
      const Vector3 centre = way.points[p].cwiseQuotient(this->Input.grid.spacing);
      for (int near = 0; near < 27; ++near)
      {
        const std::uint32_t number =
          this->March.Region().NumberOf(static_cast<int>(std::lround(centre[0])) + near % 3 - 1,
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
bool Extractor::ThinBranchesFor(ThinBranchSettings& settings)
{
  const double contrast =
    this->Paths.lumen.reference.lumen - this->Paths.lumen.reference.background;
  if (!this->Settings.thinBranches || !this->Input.intensity || !this->Calibrated ||
    !(contrast > 0.0))
  {
    return false;
  }
  settings.voxel = this->Paths.voxel;
  settings.minimumLength = std::max(this->Settings.minimumBranchLength, 15.0 * this->Paths.voxel);
  settings.maximumLength = 200.0 * this->Paths.voxel;
  settings.contrast = contrast;
  if (!this->Noise)
  {
    this->Noise = LearnNoisePaths(*this->Paths.image, this->Tree, settings);
  }
  settings.noise = *this->Noise;
  return true;
}

std::vector<VeinBranch> Extractor::JudgeVeins(const std::vector<RejectedVein>& before) const
{
  if (!this->Input.intensity || !this->Calibrated)
  {
    return {};
  }
  return JudgeBranches(
    this->Result.tree, *this->Paths.image, this->Paths.lumen.reference, this->Blur,
    [this](const Vector3& point) { return this->Excluded.Contains(point); },
    std::accumulate(before.begin(), before.end(), 0.0,
      [](double sum, const RejectedVein& vein) { return sum + vein.probability; }));
}

/// What is too thin for the region, by the image alone.
/// @param from  points of the tree before this one are not looked beside
void Extractor::FollowThinBranches(std::int64_t from)
{
  ThinBranchSettings settings;
  if (!this->ThinBranchesFor(settings))
  {
    return;
  }
  // Several spots lead to one vessel: what was followed once is done. What could not be kept may be a vessel that was
  // entered from a wrong place: it is not followed again from there.
  std::vector<Vector3> done;
  std::vector<Vector3> refused;
  for (const ThinBranch& branch : FindThinBranches(*this->Paths.image, this->Tree, settings, from))
  {
    const auto isKnown = [&](const std::vector<Vector3>& places, std::size_t first)
    {
      std::size_t known = 0;
      for (std::size_t i = 0; i < first; ++i)
      {
        known += std::any_of(places.begin(), places.end(),
          [&](const Vector3& other) {
            return (other - branch.points[i]).squaredNorm() <
              4.0 * this->Paths.voxel * this->Paths.voxel;
          });
      }
      return 2 * known > first;
    };
    const std::size_t beginning = std::max<std::size_t>(4, branch.points.size() / 4);
    if (isKnown(done, branch.points.size()) || isKnown(refused, beginning) ||
      this->Excluded.LeadsInside(branch.points))
    {
      continue;
    }
    MinimalPath way;
    way.owner = branch.parent;
    way.points.assign(branch.points.rbegin(), branch.points.rend());
    const auto parent = static_cast<std::size_t>(this->BranchOf[branch.parent]);
    if (this->Append(way, this->Tree.branches[parent].treeId, false) >= 0)
    {
      done.insert(done.end(), branch.points.begin(), branch.points.end());
    }
    else
    {
      refused.insert(refused.end(), branch.points.begin(),
        branch.points.begin() + static_cast<std::ptrdiff_t>(beginning));
    }
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
  const std::vector<TipPath> paths = FollowTips(*this->Paths.image, this->Tree, settings);
  for (std::size_t b = 0; b < paths.size(); ++b)
  {
    if (paths[b].points.empty() || this->Excluded.LeadsInside(paths[b].points))
    {
      continue;
    }
    std::vector<std::int64_t>& chain = this->Tree.branches[b].points;
    // With a part of what is known, so that it goes on smoothly.
    const std::size_t known = std::min<std::size_t>(paths[b].known, 12);
    MeasuredPath path;
    for (std::size_t i = paths[b].known - known; i < paths[b].known; ++i)
    {
      path.points.push_back(this->Tree.points[chain[i]]);
    }
    path.points.insert(path.points.end(), paths[b].points.begin(), paths[b].points.end());
    path.points = ResampleCurve(path.points, this->Paths.step);
    path.confidence.assign(path.size(), 0.2);
    std::fill_n(path.confidence.begin(), std::min(known, path.size()), 1.0);
    this->Paths.SmoothPositions(path, 1e3, 0.0);
    this->Paths.Measure(path, false);
    this->Paths.SmoothRadii(path);
    std::size_t at = paths[b].known;
    for (std::size_t i = known; i < path.size(); ++i, ++at)
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
      this->Tree.points[point] = path.points[i];
      this->Tree.radius[point] = path.radius[i];
      this->Tree.confidence[point] = path.confidence[i];
      this->PointLumen[point] = path.lumen[i];
    }
    chain.resize(at);
    this->Own(b);
  }
}

/// Branches that were entered from their ends begin where they leave their own vessel.
void Extractor::TurnBranches()
{
  if (!this->Paths.image || !std::isnan(this->Paths.lumen.level) || this->Tree.branches.empty())
  {
    return;
  }
  const auto at = [&](std::int64_t point) { return Text(this->ToGiven(this->Tree.points[point])); };
  std::vector<TurnedBranch> turned =
    FindTurnedBranches(*this->Paths.image, this->Tree, this->Paths.voxel);
  for (const TurnedBranch& one : turned)
  {
    const VesselTree::Branch branch = this->Tree.branches[one.branch];
    const std::string text = "a vessel of " + std::to_string(std::lround(one.length)) +
      " mm from " + at(branch.points.back()) + " to " + at(branch.points.front()) +
      " touches another one at its end";
    bool joined = false;
    if (one.root >= 0)
    {
      MinimalPath way;
      way.owner = static_cast<std::int32_t>(one.root);
      for (std::size_t i = one.contact; i < branch.points.size(); ++i)
      {
        way.points.push_back(this->Tree.points[branch.points[i]]);
      }
      way.points.insert(way.points.end(), one.way.rbegin(), one.way.rend());
      joined = !this->Excluded.LeadsInside(one.way) && this->Append(way, branch.treeId, true) >= 0;
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
  for (VesselTree::Branch& branch : this->Tree.branches)
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
  for (std::size_t t = 0; t < this->Input.targets.size(); ++t)
  {
    CenterlineEnd& end = this->Result.targets[t];
    const std::string name = "target " + std::to_string(t) + " at " + Text(this->Given.targets[t]);
    if (this->Locate(this->Input.targets[t], name, end) == None)
    {
      continue;
    }
    const Vector3 index = GridIndex(this->Input.grid, this->Input.targets[t]);
    const std::uint32_t member = this->March.NearestMember(index, this->SeedReach(), true);
    if (member == None)
    {
      end.status = this->Result.complete ? EndStatus::NotConnected : EndStatus::LimitReached;
      end.message = name +
        (this->Result.complete ? " can not be reached from any seed through vessels"
                               : " was not reached before the limit");
      continue;
    }
    end.treeId = this->March.Marched().Source()[member];
    const Vector3 from =
      this->March.MemberAt(index) == member ? index : this->March.IndexOf(member);
    if (this->Owner[member] != MinimalPath::noOwner)
    {
      end.status = EndStatus::Reached;
      end.point = this->Owner[member];
      continue;
    }
    end.point = this->Append(this->March.Backtrack(from, member, this->Owner), end.treeId, true);
    end.status = end.point >= 0 ? EndStatus::Reached : EndStatus::TooShort;
    if (end.point < 0)
    {
      end.message = name + " lies in the lumen of its seed or branch: there is no path to draw";
    }
  }
}

/// Trees that come out of a wide body begin where their vessel leaves it.
void Extractor::SettleOstia()
{
  if (!this->Settings.snap || !this->Paths.image || !std::isnan(this->Paths.lumen.level))
  {
    return;
  }
  for (const OstialRoot& root : SettleRoots(this->Tree, *this->Paths.image, this->Paths.lumen))
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
    for (const VesselTree::Branch& branch : this->Tree.branches)
    {
      if (branch.parentGroupId == -1 && branch.treeId == static_cast<int>(s))
      {
        this->Result.seeds[s].point = branch.points.front();
        break;
      }
    }
    if (this->SeedMembers[s] != None && this->Result.seeds[s].point < 0)
    {
      this->Result.seeds[s].status = EndStatus::TooShort;
      this->Result.seeds[s].message = "seed " + std::to_string(s) + " at " +
        Text(this->Given.seeds[s]) + " has no branch that is long and clear enough";
    }
  }
  MarkBridged(this->Tree, this->Input.bridges, this->Paths);
  this->CorrectRadii();
  this->SettleOstia();
  this->Result.tree = SplitAtBifurcations(this->Tree);
  if (this->Settings.snap)
  {
    StraightenForks(this->Result.tree, this->BranchOf, this->Paths);
    if (std::isnan(this->Paths.lumen.level))
    {
      FitForks(this->Result.tree, this->Paths);
    }
    MeasureTree(this->Result.tree);
  }
  std::map<std::int64_t, CenterlineBifurcation> joints;
  for (const VesselTree::Branch& branch : this->Result.tree.branches)
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
  this->March.MakeRegion(*this->Paths.image, this->IntensityThreshold(), this->Excluded.Voxels());
  this->Result.regionVoxels = this->March.Region().Size();
  Report(this->Progress, 0.1);
  if (this->March.Region().Size() == 0)
  {
    this->Result.messages.emplace_back(
      "there is no voxel above the threshold: nothing to march in");
  }
  if (this->March.Region().Size() > this->Settings.voxelLimit)
  {
    this->Result.complete = false;
    this->Result.messages.push_back("the region has " +
      std::to_string(this->March.Region().Size()) + " voxels, more than the limit of " +
      std::to_string(this->Settings.voxelLimit) + ": raise the threshold, or give a mask");
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
    this->MarchFromSeeds();
    this->Owner.assign(this->March.Region().Size(), MinimalPath::noOwner);
    this->Covered.assign(this->March.Region().Size(), false);
    if (this->Settings.findTips || this->Input.targets.empty())
    {
      this->FindTips();
      // What is thinner than the region shows what the blur leaves of it.
      this->MeasureBlur();
      this->Paths.lumen.blur = this->Blur;
      this->FollowThinBranches(0);
      this->TurnBranches();
      const auto known = static_cast<std::int64_t>(this->Tree.points.size());
      this->LengthenTips();
      // Beyond the region vessels part as well.
      this->FollowThinBranches(known);
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
  constexpr RequireOf require{ "CenterlineSettings" };
  const auto length = [&](double value, const char* name)
  {
    require(
      std::isfinite(value) && value >= 0.0, (std::string(name) + " must not be negative").c_str());
  };
  require(!std::isinf(this->speedThreshold), "speedThreshold must be finite");
  require(!std::isinf(this->intensityThreshold), "intensityThreshold must be finite");
  require(
    this->speedExponent >= 0.5 && this->speedExponent <= 6.0, "speedExponent must be 0.5 to 6");
  require(this->minimumConfidence >= 0.0 && this->minimumConfidence <= 1.0,
    "minimumConfidence must be 0 to 1");
  length(this->minimumBranchLength, "minimumBranchLength");
  length(this->maximumGap, "maximumGap");
  length(this->maximumRadius, "maximumRadius");
  length(this->resampling, "resampling");
  length(this->smoothing, "smoothing");
  length(this->blur, "blur");
  length(this->snapDistance, "snapDistance");
  require(this->stepLimit > 0, "stepLimit must be positive");
  require(this->voxelLimit > 0, "voxelLimit must be positive");
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
  constexpr RequireOf require{ "CenterlineInput" };
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
  ExcludedVoxels excluded(framed.grid);
  std::vector<RejectedVein> veins;
  std::vector<VeinBranch> judged;
  CenterlineResult result;
  constexpr int rounds = 6;
  for (int round = 0;; ++round)
  {
    Extractor extractor(framed, input, excluded, settings, progress);
    result = extractor.Run();
    const std::vector<VeinBranch> branches = extractor.JudgeVeins(veins);
    judged.insert(judged.end(), branches.begin(), branches.end());
    std::vector<VeinBranch> found;
    std::copy_if(branches.begin(), branches.end(), std::back_inserter(found),
      [](const VeinBranch& branch) { return branch.probability >= 0.5; });
    if (round == rounds || found.empty())
    {
      result.veinProbability = VeinProbabilityOfPoints(result.tree, branches);
      break;
    }
    excluded.Close(found, result.tree, extractor.Voxel(), veins);
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
    std::for_each(branch.path.begin(), branch.path.end(), toWorld);
  }
  result.judged = std::move(judged);
  std::for_each(result.tree.points.begin(), result.tree.points.end(), toWorld);
  return result;
}
}
