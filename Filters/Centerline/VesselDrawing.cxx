#include "VesselDrawing.h"

#include "CurveSmoothing.h"
#include "GridIndex.h"
#include "Median.h"
#include "VesselMarch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace coronary
{
namespace
{
constexpr std::uint32_t None = VoxelRegion::notAMember;

/// Where nothing looks like a vessel: a gap is crossed, but no detour through other vessels of more than some ten times
/// its length is taken instead.
constexpr double LeastSpeed = 0.1;
constexpr double Margin = 8.0;      ///< mm around the places that a way may use
constexpr double MarginShare = 0.3; ///< of the places' distance, more
/// A way may leave the straight line between its ends by about so much: the nearer two clicks are, the more they say.
constexpr double CorridorShare = 0.35; ///< of their distance
constexpr double Corridor = 2.5;       ///< mm at least
constexpr double LeastInCorridor = 0.05;
constexpr double ClickRadius = 1.25; ///< mm that a click may be beside the axis
constexpr std::size_t Samples = 400; ///< of the tree, for what is usual in it

constexpr double UnseenWeight = 0.3; ///< of a place of the way without a section, in the smoothing

/// What of an image's extent lies around places; its indices are the image's.
ImageGrid BoxOf(const ImageGrid& grid, const std::vector<Vector3>& places, double margin)
{
  ImageGrid box = grid;
  for (int axis = 0; axis < 3; ++axis)
  {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (const Vector3& place : places)
    {
      const double index = GridIndex(grid, place)[axis];
      low = std::min(low, index);
      high = std::max(high, index);
    }
    const double steps = margin / grid.spacing[axis];
    const double first = grid.extent[2 * axis];
    const double last = grid.extent[2 * axis + 1];
    box.extent[2 * axis] = static_cast<int>(std::clamp(std::floor(low - steps), first, last));
    box.extent[2 * axis + 1] = static_cast<int>(std::clamp(std::ceil(high + steps), first, last));
  }
  return box;
}

Vector3 World(const ImageGrid& grid, const Vector3& frame)
{
  return grid.origin + grid.direction * frame;
}
}

/// A march through a box of the image.
struct VesselDrawing::Front
{
  CenterlineInput input;
  CenterlineSettings settings;
  std::vector<float> speed;
  std::unique_ptr<VesselMarch> march;

  /// From a place back to the source, in mm of the world. Empty: the front has not come there.
  std::vector<Vector3> BackFrom(const Vector3& place) const
  {
    const Vector3 index = GridIndex(this->input.grid, place);
    const std::uint32_t member = this->march->MemberAt(index);
    if (member == None || !std::isfinite(this->march->Marched().Arrival()[member]))
    {
      return {};
    }
    const std::vector<std::int32_t> owner(this->march->Region().Size(), MinimalPath::noOwner);
    std::vector<Vector3> way;
    for (const Vector3& frame : this->march->Backtrack(index, member, owner).points)
    {
      way.push_back(World(this->input.grid, frame));
    }
    return way;
  }
};

VesselDrawing::VesselDrawing(const VesselTree& tree, const EditScene& scene)
  : Tree(tree)
  , Scene(scene)
  , Paths(Settings, scene.image->grid)
  , ImageBlur(scene.blur > 0.0 ? scene.blur : 0.8 * Paths.voxel)
{
  this->Paths.image = std::make_unique<ImageInterpolator>(*scene.image);
  this->Paths.lumen.blur = scene.blur;
  this->MeasureLevels();
}

VesselDrawing::~VesselDrawing() = default;

void VesselDrawing::MeasureLevels()
{
  std::vector<double> lumen;
  std::vector<double> behind;
  std::vector<double> tubes;
  std::vector<double> radii;
  const ImageGrid& grid = this->Scene.image->grid;
  const std::size_t step = std::max<std::size_t>(1, this->Tree.points.size() / Samples);
  for (std::size_t p = 0; p < this->Tree.points.size(); p += step)
  {
    const Vector3 index = GridIndex(grid, this->Tree.points[p]);
    LumenReference reference;
    if (!IsInGrid(grid, index) ||
      !MeasureReference(*this->Paths.image, this->Tree.points[p], reference))
    {
      continue;
    }
    lumen.push_back(reference.lumen);
    behind.push_back(reference.background);
    radii.push_back(reference.radius);
    if (this->Scene.vesselness)
    {
      tubes.push_back(
        this->Scene.vesselness[GridOffset(grid, static_cast<int>(std::lround(index[0])),
          static_cast<int>(std::lround(index[1])), static_cast<int>(std::lround(index[2])))]);
    }
  }
  if (lumen.empty())
  {
    throw std::invalid_argument("the image shows no vessel along the tree: it is another image");
  }
  LumenReference& reference = this->Paths.lumen.reference;
  reference.lumen = QuantileOf(lumen, 0.75);
  reference.background = QuantileOf(behind, 0.25);
  reference.radius = MedianOf(radii);
  this->Paths.lumen.maximumRadius =
    std::max({ 2.0 * reference.radius, 6.0 * this->Paths.voxel, 3.0 });
  this->UsualVesselness = tubes.empty() ? 0.0 : MedianOf(tubes);
}

double VesselDrawing::SpeedAt(const Vector3& world, double vesselness) const
{
  const LumenReference& reference = this->Paths.lumen.reference;
  const double bright = std::clamp((this->Paths.image->At(world) - reference.background) /
      std::max(reference.lumen - reference.background, 1e-30) / 0.7,
    0.0, 1.0);
  const double tube =
    this->UsualVesselness > 0.0 ? std::min(vesselness / this->UsualVesselness, 1.5) : 1.0;
  return LeastSpeed + bright * bright * tube * tube;
}

Vector3 VesselDrawing::OnVessel(const Vector3& place) const
{
  const ImageGrid& grid = this->Scene.image->grid;
  Vector3 best = place;
  double greatest = 2.0 * LeastSpeed; // below it nothing is there
  BoxAround(
    GridIndex(grid, place), Vector3::Constant(ClickRadius).cwiseQuotient(grid.spacing), grid.extent)
    .ForEach(
      [&](int i, int j, int k)
      {
        const Vector3 at = grid.IndexToWorld(i, j, k);
        const double away = (at - place).norm();
        if (away > ClickRadius)
        {
          return;
        }
        const double tube =
          this->Scene.vesselness ? this->Scene.vesselness[GridOffset(grid, i, j, k)] : 0.0;
        // The nearer of two that are alike.
        const double value =
          this->SpeedAt(at, tube) * (1.0 - 0.5 * away * away / (ClickRadius * ClickRadius));
        if (value > greatest)
        {
          greatest = value;
          best = at;
        }
      });
  return best;
}

std::unique_ptr<VesselDrawing::Front> VesselDrawing::MarchFrom(
  const Vector3& from, const Vector3* to, double margin, const ProgressCallback& progress) const
{
  auto front = std::make_unique<Front>();
  const ImageGrid& grid = this->Scene.image->grid;
  front->input.grid = BoxOf(grid, { from, to ? *to : from }, margin);
  const double width = to ? std::max(Corridor, CorridorShare * (*to - from).norm()) : 0.0;
  const ImageGrid& box = front->input.grid;
  front->speed.resize(GridSize(box));
  const std::array<int, 6>& e = box.extent;
  ParallelFor(e[5] - e[4] + 1, 1,
    [&](std::int64_t first, std::int64_t last)
    {
      for (int k = e[4] + static_cast<int>(first); k < e[4] + static_cast<int>(last); ++k)
      {
        for (int j = e[2]; j <= e[3]; ++j)
        {
          for (int i = e[0]; i <= e[1]; ++i)
          {
            const double tube =
              this->Scene.vesselness ? this->Scene.vesselness[GridOffset(grid, i, j, k)] : 0.0;
            const Vector3 at = box.IndexToWorld(i, j, k);
            const double beside =
              to ? NearestOnSegment(at, from, *to).squaredDistance / (width * width) : 0.0;
            front->speed[GridOffset(box, i, j, k)] = static_cast<float>(
              this->SpeedAt(at, tube) * std::max(LeastInCorridor, std::exp(-beside)));
          }
        }
      }
    });
  front->input.speed = front->speed.data();
  front->input.seeds = { from };
  front->settings.speedThreshold = 0.0; // all of the box
  front->march = std::make_unique<VesselMarch>(front->input, front->settings);
  VesselMarch& march = *front->march;
  march.MakeRegion(*this->Paths.image, std::numeric_limits<double>::quiet_NaN(), nullptr);
  std::vector<float> speed(march.Region().Size());
  march.Region().ForEach(
    [&](std::uint32_t number, VoxelRegion::Address address)
    {
      const std::array<int, 3> at = march.Region().IndexOf(address);
      speed[number] = front->speed[GridOffset(box, at[0], at[1], at[2])];
    });
  march.March(std::move(speed), { march.MemberAt(GridIndex(box, from)) }, progress);
  return front;
}

std::vector<Vector3> VesselDrawing::Way(
  const Vector3& from, const Vector3& to, const ProgressCallback& progress) const
{
  const double margin = Margin + MarginShare * (to - from).norm();
  std::vector<Vector3> way = this->MarchFrom(from, &to, margin, progress)->BackFrom(to);
  std::reverse(way.begin(), way.end());
  return way;
}

std::vector<Vector3> VesselDrawing::WayFromTree(
  const Vector3& to, double reach, std::int64_t& owner, const ProgressCallback& progress) const
{
  owner = -1;
  const std::unique_ptr<Front> front = this->MarchFrom(to, nullptr, reach, progress);
  const std::vector<float>& arrival = front->march->Marched().Arrival();
  float earliest = std::numeric_limits<float>::infinity();
  for (const VesselTree::Branch& branch : this->Tree.branches)
  {
    for (const std::int64_t p : branch.points)
    {
      const Vector3& point = this->Tree.points[p];
      const std::uint32_t member = front->march->MemberAt(GridIndex(front->input.grid, point));
      if (member != None && (point - to).norm() <= reach && arrival[member] < earliest)
      {
        earliest = arrival[member];
        owner = p;
      }
    }
  }
  return owner < 0 ? std::vector<Vector3>() : front->BackFrom(this->Tree.points[owner]);
}

MeasuredPath VesselDrawing::Measured(
  const std::vector<Vector3>& way, double start, double end) const
{
  MeasuredPath path;
  path.points = ResampleCurve(way, this->Paths.step);
  path.confidence.assign(path.size(), 1.0);
  path.crossing.assign(path.size(), 0);
  if (path.size() < 3)
  {
    return path;
  }
  // Steps of voxels gone; then the sections.
  this->Paths.SmoothPositions(path, 10.0, 10.0);
  this->Recentre(path, [this](MeasuredPath& moved) { this->Paths.Measure(moved, true); });
  this->Recentre(path, [this](MeasuredPath& moved) { this->Paths.Recentre(moved); });
  for (int round = 0; round < 2; ++round)
  {
    this->Smooth(path, start, end);
    path.points = ResampleCurve(path.points, this->Paths.step);
    path.resize(path.points.size());
    this->Recentre(path, [this](MeasuredPath& moved) { this->Paths.Measure(moved, true); });
  }
  return path;
}

void VesselDrawing::Recentre(
  MeasuredPath& path, const std::function<void(MeasuredPath&)>& measure) const
{
  const std::vector<Vector3> before = path.points;
  measure(path);
  // In a dark gap what looks a little like a section is something else's.
  for (std::size_t i = 0; i < path.size(); ++i)
  {
    path.points[i] =
      path.confidence[i] < this->Settings.minimumConfidence ? before[i] : path.points[i];
  }
}

void VesselDrawing::Smooth(MeasuredPath& path, double start, double end) const
{
  MeasuredPath held = path;
  for (double& confidence : held.confidence)
  {
    confidence = std::max(confidence, UnseenWeight);
  }
  this->Paths.SmoothPositions(held, start, end);
  path.points = std::move(held.points);
}

void VesselDrawing::CorrectRadii(MeasuredPath& path) const
{
  this->Paths.SmoothRadii(path);
  for (double& radius : path.radius)
  {
    radius = std::max(0.5 * this->ImageBlur, RadiusFromHalfMaximum(radius, this->ImageBlur));
  }
}
}
