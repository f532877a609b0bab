#include "OstialOutlets.h"

#include "CheapestFirst.h"
#include "DistanceTransform.h"
#include "HiddenMouths.h"
#include "Median.h"
#include "MultiscaleVesselness.h"
#include "Numbers.h"
#include "VoxelLattice.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
/// A piece of the aortic wall: height over a tangent plane, second order.
struct WallPatch
{
  using Coefficients = Eigen::Matrix<double, 6, 1>;
  Vector3 origin;
  Vector3 outward; ///< unit vector square to the aorta's axis
  Vector3 up;      ///< unit vector along the aorta
  Coefficients height = Coefficients::Zero();
  bool known = false;

  Vector3 Local(const Vector3& p) const
  {
    const Vector3 d = p - this->origin;
    return { d.dot(this->up.cross(this->outward)), d.dot(this->up), d.dot(this->outward) };
  }
  static Coefficients Row(const Vector3& local)
  {
    Coefficients r;
    r << 1.0, local[0], local[1], local[0] * local[0], local[0] * local[1], local[1] * local[1];
    return r;
  }
  /// mm outside the wall, along `outward`
  double Above(const Vector3& p) const
  {
    const Vector3 local = this->Local(p);
    return local[2] - Row(local).dot(this->height);
  }
};

std::vector<AorticSection> EveryThird(const std::vector<AorticSection>& sections)
{
  std::vector<AorticSection> result;
  for (std::size_t n = 0; n < sections.size(); n += 3)
  {
    result.push_back(sections[n]);
  }
  if ((sections.size() - 1) % 3 != 0)
  {
    result.push_back(sections.back());
  }
  return result;
}

class OutletSearch
{
public:
  OutletSearch(const ScalarImage& image, const AorticTube& tube,
    const CoronaryOstiaSettings& settings, const ProgressCallback& progress);

  std::vector<Outlet> Find() const;

  double BloodMean = 0.0;
  double BloodDeviation = 0.0;
  std::vector<double> SectionMeans; ///< NaN: unknown
  double Chambers = 0.0;            ///< mm^3

private:
  static constexpr double Below = 25.0; ///< mm below the lowest circle: the root is no circle

  void Blood(const AorticTube& tube);
  void Bodies(const ProgressCallback& progress);
  void MeasureChambers();
  void Vessels(const ProgressCallback& progress);
  void March();
  bool OnTube(const Vector3& p) const
  {
    const TubeAxis::Place place = this->CoarseAxis.At(p);
    return place.length > -Below && place.distance < 1.25 * place.radius + 1.5;
  }
  bool Contains(const std::array<int, 3>& p) const
  {
    const std::array<int, 3>& n = this->Volume.size;
    return p[0] >= 0 && p[1] >= 0 && p[2] >= 0 && p[0] < n[0] && p[1] < n[1] && p[2] < n[2];
  }
  /// 0 to 1: how much a voxel looks like vessel
  float Brightness(std::int64_t p) const { return this->Likeness[p]; }
  bool Describe(Outlet& outlet, const std::vector<std::int64_t>& members) const;
  Outlet Describe(const HiddenMouth& mouth) const;
  float TubenessAt(std::int64_t p) const;
  void Orient(Outlet& outlet, const Vector3& farther) const;
  void FollowToWall(CoronaryOstium& ostium) const;
  double Recentre(Vector3& centre, double& radius, const Vector3& axis, bool adapt) const;
  WallPatch FitWall(const Vector3& around, const std::vector<Vector3>& vessel, double radius) const;
  float At(const Vector3& p) const { return this->Volume.At(p); }
  Vector3 World(std::int64_t p) const { return this->Volume.World(this->Volume.Place(p)); }

  const CoronaryOstiaSettings& Settings;
  TubeAxis Axis;
  TubeAxis CoarseAxis; ///< of every third section: what is asked for each voxel
  Matrix3 Upright;     ///< turns the aorta's axis upwards, the shortest way
  WorldVolume Volume;
  float Half = 0.0f;                ///< HU at a wall
  std::vector<unsigned char> Body;  ///< 1 large body, 2 large body on the aorta
  std::vector<float> Likeness;      ///< 0 to 1: vessel
  std::vector<float> Tubeness;      ///< vesselness, 0 to 1
  std::vector<float> Length;        ///< mm along the path from the wall; negative: not reached
  std::vector<float> Shade;         ///< mm of darkness along that path
  std::vector<std::int64_t> Root;   ///< voxel of the wall the path starts at
  std::vector<std::int64_t> Before; ///< previous voxel of the path
};

OutletSearch::OutletSearch(const ScalarImage& image, const AorticTube& tube,
  const CoronaryOstiaSettings& settings, const ProgressCallback& progress)
  : Settings(settings)
  , Axis(tube.sections)
  , CoarseAxis(EveryThird(tube.sections))
  , Upright(Eigen::Quaterniond::FromTwoVectors(this->Axis.Direction(), Vector3::UnitZ())
              .toRotationMatrix())
{
  constexpr double spacing = 0.75;
  constexpr double around = 45.0; // mm beside the aorta
  constexpr double reach = 70.0;  // mm: the ostia are near the lower end of a long aorta
  const auto [imageLow, imageHigh] = BoundsAlong(image.grid, Matrix3::Identity());
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  const auto include = [&](const AorticSection& section, double along)
  {
    const Vector3 centre = section.centre + along * section.normal;
    // A disc with a margin: wide across the axis, little along it.
    const Vector3 across = (Vector3::Ones() - section.normal.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
    const Vector3 margin = (section.radius + around) * across;
    low = low.cwiseMin(centre - margin);
    high = high.cwiseMax(centre + margin);
  };
  include(tube.sections.front(), -Below);
  double length = 0.0;
  std::size_t last = 0;
  for (; last < tube.sections.size() && length <= reach; ++last)
  {
    include(tube.sections[last], 0.0);
    length = last + 1 < tube.sections.size()
      ? length + (tube.sections[last + 1].centre - tube.sections[last].centre).norm()
      : length;
  }
  include(tube.sections[last - 1], 10.0);
  this->Volume = ResampleToWorld(image, low.cwiseMax(imageLow), high.cwiseMin(imageHigh), spacing,
    Matrix3::Identity(), [&](double f) { return !progress || progress(0.4 * f); });
  this->Blood(tube);
  if (!(this->BloodMean > settings.softTissue))
  {
    return; // and Find() finds nothing
  }
  this->Bodies([&](double f) { return !progress || progress(0.4 + 0.3 * f); });
  this->Vessels([&](double f) { return !progress || progress(0.7 + 0.2 * f); });
  this->March();
  Report(progress, 0.9);
}

void OutletSearch::Blood(const AorticTube& tube)
{
  // The middle of the sections' medians: a section that is none, or is below the valve, does not move it.
  std::vector<double> means;
  std::vector<double> deviations;
  std::vector<double> inside;
  for (const AorticSection& section : tube.sections)
  {
    const Vector3 u = section.normal.unitOrthogonal();
    const Vector3 v = section.normal.cross(u);
    const int reach = static_cast<int>(0.6 * section.radius / this->Volume.spacing);
    inside.clear();
    for (int j = -reach; j <= reach; ++j)
    {
      for (int i = -reach; i <= reach; ++i)
      {
        const Vector3 at =
          this->Volume.ToIndex(section.centre + this->Volume.spacing * (i * u + j * v))
            .array()
            .round();
        const std::array<int, 3> p{ static_cast<int>(at[0]), static_cast<int>(at[1]),
          static_cast<int>(at[2]) };
        if (std::hypot(i, j) > reach || !this->Contains(p))
        {
          continue;
        }
        const float value = this->Volume.values[this->Volume.Index(p[0], p[1], p[2])];
        if (value > WorldVolume::Nothing)
        {
          inside.push_back(value);
        }
      }
    }
    this->SectionMeans.push_back(std::numeric_limits<double>::quiet_NaN());
    if (inside.size() < 20)
    {
      continue;
    }
    const double median = MedianOf(inside);
    this->SectionMeans.back() = median;
    means.push_back(median);
    for (double& value : inside)
    {
      value = std::abs(value - median);
    }
    deviations.push_back(1.4826 * MedianOf(inside));
  }
  this->BloodMean = MedianOf(means);
  this->BloodDeviation = MedianOf(deviations);
  const double contrast = this->BloodMean - this->Settings.softTissue;
  this->Half = static_cast<float>(this->Settings.softTissue + 0.5 * contrast);
}

void OutletSearch::Bodies(const ProgressCallback& progress)
{
  std::vector<unsigned char> blood(this->Volume.values.size());
  for (std::size_t p = 0; p < blood.size(); ++p)
  {
    blood[p] = this->Volume.values[p] > this->Half ? 1 : 0;
  }
  const Vector3 spacing = Vector3::Constant(this->Volume.spacing);
  this->Body = OpenWithBall(
    blood.data(), this->Volume.size, spacing, this->Settings.maximumVesselRadius, progress);
  ParallelFor(this->Volume.size[2], 4,
    [&](std::int64_t first, std::int64_t last)
    {
      const std::int64_t slice = this->Volume.Index(0, 0, 1);
      for (std::int64_t p = first * slice; p < last * slice; ++p)
      {
        if (this->Body[p] && this->OnTube(this->Volume.World(this->Volume.Place(p))))
        {
          this->Body[p] = 2;
        }
      }
    });
  this->MeasureChambers();
}

/// Arterial blood in bodies of 9 mm radius at least that are not the tube.
void OutletSearch::MeasureChambers()
{
  const std::array<int, 3>& n = this->Volume.size;
  const int deep = static_cast<int>(9.0 / this->Volume.spacing);
  const double contrast = this->BloodMean - this->Settings.softTissue;
  const auto darkest = static_cast<float>(this->BloodMean - 0.2 * contrast);
  const auto brightest = static_cast<float>(this->BloodMean + 0.3 * contrast);
  const std::array<std::int64_t, 3> steps{ deep, this->Volume.Index(0, deep, 0),
    this->Volume.Index(0, 0, deep) };
  std::int64_t count = 0;
  for (int k = deep; k + deep < n[2]; ++k)
  {
    for (int j = deep; j + deep < n[1]; ++j)
    {
      for (int i = deep; i + deep < n[0]; ++i)
      {
        const std::int64_t p = this->Volume.Index(i, j, k);
        bool inside = this->Body[p] == 1 && this->Volume.values[p] > darkest &&
          this->Volume.values[p] < brightest;
        for (const std::int64_t step : steps)
        {
          inside = inside && this->Body[p - step] && this->Body[p + step];
        }
        count += inside ? 1 : 0;
      }
    }
  }
  this->Chambers = std::pow(this->Volume.spacing, 3) * static_cast<double>(count);
}

/// What is as bright as blood; or less bright, as thin vessels in coarse voxels are, but tubular.
void OutletSearch::Vessels(const ProgressCallback& progress)
{
  const auto soft = static_cast<float>(this->Settings.softTissue);
  const auto contrast = static_cast<float>(this->BloodMean - this->Settings.softTissue);
  VesselnessSettings settings;
  settings.sigmas = { 0.75, 1.05, 1.5, 2.1 };
  settings.c = 0.25 * contrast;
  const std::array<int, 6> extent{ 0, this->Volume.size[0] - 1, 0, this->Volume.size[1] - 1, 0,
    this->Volume.size[2] - 1 };
  const MultiscaleVesselness filter(settings, Vector3::Constant(this->Volume.spacing), extent);
  this->Tubeness.resize(this->Volume.values.size());
  this->Likeness.resize(this->Volume.values.size());
  MultiscaleVesselness::Output output;
  output.vesselness = this->Tubeness.data();
  filter.Compute({ this->Volume.values.data(), extent }, extent, nullptr, output, progress);
  constexpr float tubular = 0.3f; // vesselness of a clear tube
  for (std::size_t p = 0; p < this->Likeness.size(); ++p)
  {
    const float share = (this->Volume.values[p] - soft) / contrast;
    const float blood = std::clamp((share - 0.3f) / 0.45f, 0.0f, 1.0f);
    const float thin =
      std::clamp((share - 0.1f) / 0.35f, 0.0f, 1.0f) * std::min(1.0f, this->Tubeness[p] / tubular);
    this->Likeness[p] = std::max(blood, thin);
  }
}

void OutletSearch::March()
{
  constexpr double longest = 80.0; // mm
  const std::size_t voxels = this->Volume.values.size();
  std::vector<float> cost(voxels, std::numeric_limits<float>::infinity());
  this->Shade.assign(voxels, 0.0f);
  this->Length.assign(voxels, -1.0f);
  this->Root.assign(voxels, -1);
  this->Before.assign(voxels, -1);
  CheapestFirst queue;
  for (std::size_t p = 0; p < voxels; ++p)
  {
    if (this->Body[p] == 2)
    {
      const auto index = static_cast<std::int64_t>(p);
      cost[p] = 0.0f;
      this->Length[p] = 0.0f;
      this->Root[p] = index;
      queue.push({ 0.0f, index });
    }
  }
  const VoxelLattice lattice(this->Volume.Grid());
  while (!queue.empty())
  {
    const WaitingVoxel top = queue.top();
    queue.pop();
    const std::int64_t p = top.voxel;
    if (top.cost > cost[p])
    {
      continue;
    }
    lattice.Neighbours(p,
      [&](std::int64_t q, float step)
      {
        if (this->Body[q])
        {
          return;
        }
        const float brightness = this->Brightness(q);
        const float total = cost[p] + step / (0.01f + brightness * brightness * brightness);
        // The path may pass a narrowing, but no wall and gap.
        const float length = this->Length[p] + step;
        const float dark = this->Shade[p] + step * (1.0f - brightness);
        if (!(total < cost[q]) || length > longest ||
          dark > 4.0f + 0.08f * std::max(0.0f, length - 10.0f))
        {
          return;
        }
        cost[q] = total;
        this->Shade[q] = dark;
        this->Length[q] = length;
        this->Root[q] = this->Root[p];
        this->Before[q] = p;
        queue.push({ total, q });
      });
  }
}

std::vector<Outlet> OutletSearch::Find() const
{
  // What hangs on each voxel of the wall.
  struct Share
  {
    double volume = 0.0;
    std::vector<std::int64_t> members;
  };
  std::vector<std::pair<std::int64_t, std::int64_t>> owned; // root, voxel
  for (std::size_t p = 0; p < this->Root.size(); ++p)
  {
    if (this->Root[p] >= 0 && !this->Body[p] &&
      this->Brightness(static_cast<std::int64_t>(p)) > 0.5f)
    {
      owned.emplace_back(this->Root[p], static_cast<std::int64_t>(p));
    }
  }
  std::sort(owned.begin(), owned.end());
  struct Place
  {
    std::int64_t root;
    std::size_t first;
    std::size_t last;
  };
  std::vector<Place> places;
  for (std::size_t n = 0; n < owned.size(); ++n)
  {
    if (places.empty() || places.back().root != owned[n].first)
    {
      places.push_back({ owned[n].first, n, n });
    }
    places.back().last = n + 1;
  }
  std::sort(places.begin(), places.end(),
    [](const Place& a, const Place& b)
    {
      const std::size_t x = a.last - a.first;
      const std::size_t y = b.last - b.first;
      return x != y ? x > y : a.root < b.root;
    });
  std::vector<Outlet> result;
  std::vector<char> used(places.size(), 0);
  constexpr double apart = 6.0; // mm between two ostia
  for (std::size_t n = 0; n < places.size() && result.size() < 12; ++n)
  {
    if (used[n])
    {
      continue;
    }
    const Vector3 centre = this->Volume.World(this->Volume.Place(places[n].root));
    std::vector<std::int64_t> members;
    for (std::size_t m = n; m < places.size(); ++m)
    {
      if (!used[m] &&
        (this->Volume.World(this->Volume.Place(places[m].root)) - centre).norm() < apart)
      {
        used[m] = 1;
        for (std::size_t o = places[m].first; o < places[m].last; ++o)
        {
          members.push_back(owned[o].second);
        }
      }
    }
    Outlet outlet;
    outlet.volume = static_cast<double>(members.size()) * std::pow(this->Volume.spacing, 3);
    if (this->Describe(outlet, members))
    {
      result.push_back(outlet);
    }
  }
  // Directions of vessels are known to some 20 degrees, a place 10 mm ahead to about the 3 mm that make it useful.
  constexpr double farthest = 10.0; // mm
  constexpr double tree = 15.0;     // mm: what is shorter may be a blot
  MouthImage image{ this->Volume, this->Body, this->Likeness, this->Tubeness, this->Length };
  image.lung = static_cast<float>(
    this->Settings.softTissue - 1.5 * (this->BloodMean - this->Settings.softTissue));
  image.maximumVesselRadius = this->Settings.maximumVesselRadius;
  for (const HiddenMouth& mouth : FindHiddenMouths(image, farthest, tree))
  {
    result.push_back(this->Describe(mouth));
  }
  return result;
}

/// The largest around a voxel: a path need not run in the middle.
float OutletSearch::TubenessAt(std::int64_t p) const
{
  const std::array<int, 3> at = this->Volume.Place(p);
  float best = 0.0f;
  for (int k = std::max(0, at[2] - 1); k <= std::min(this->Volume.size[2] - 1, at[2] + 1); ++k)
  {
    for (int j = std::max(0, at[1] - 1); j <= std::min(this->Volume.size[1] - 1, at[1] + 1); ++j)
    {
      for (int i = std::max(0, at[0] - 1); i <= std::min(this->Volume.size[0] - 1, at[0] + 1); ++i)
      {
        best = std::max(best, this->Tubeness[this->Volume.Index(i, j, k)]);
      }
    }
  }
  return best;
}

bool OutletSearch::Describe(Outlet& outlet, const std::vector<std::int64_t>& members) const
{
  // The longest path, and the vessel's middle along its first millimetres.
  std::int64_t tip = -1;
  for (const std::int64_t p : members)
  {
    if (tip < 0 || this->Length[p] > this->Length[tip])
    {
      tip = p;
    }
  }
  constexpr double shortest = 8.0; // mm: less is a bump of the wall
  if (tip < 0 || this->Length[tip] < shortest)
  {
    return false;
  }
  outlet.ostium.length = this->Length[tip];
  std::vector<std::int64_t> path;
  for (std::int64_t p = tip; p >= 0; p = this->Before[p])
  {
    path.push_back(p);
  }
  std::reverse(path.begin(), path.end());

  constexpr double start = 10.0;
  constexpr double minimum = 4.0;
  constexpr double most = 45.0;
  int count = 0;
  for (const std::int64_t p : path)
  {
    if (this->Length[p] < minimum || this->Length[p] > most)
    {
      continue;
    }
    outlet.tubular += this->TubenessAt(p);
    ++count;
  }
  outlet.tubular /= std::max(1, count);
  for (const std::int64_t p : path)
  {
    if (this->Length[p] <= start)
    {
      outlet.shade = this->Shade[p];
    }
  }

  constexpr double first = 1.0;
  constexpr double last = 5.0;
  std::vector<Vector3> middles;
  std::vector<double> areas;
  for (const std::int64_t p : path)
  {
    const double length = this->Length[p];
    if (length < first || length > last)
    {
      continue;
    }
    // Bright voxels that are as far along, around here.
    const Vector3 here = this->Volume.World(this->Volume.Place(p));
    Vector3 sum = Vector3::Zero();
    double weight = 0.0;
    for (const std::int64_t m : members)
    {
      const Vector3 there = this->Volume.World(this->Volume.Place(m));
      if (std::abs(this->Length[m] - length) < 0.75 && (there - here).norm() < 5.0)
      {
        const double w = this->Brightness(m);
        sum += w * there;
        weight += w;
      }
    }
    if (weight > 0.0)
    {
      middles.emplace_back(sum / weight);
      areas.push_back(weight * std::pow(this->Volume.spacing, 3) / 1.5);
    }
  }
  if (middles.size() < 3)
  {
    return false;
  }
  outlet.ostium.radius = std::sqrt(MedianOf(areas) / Pi);
  Vector3 mean = Vector3::Zero();
  for (const Vector3& m : middles)
  {
    mean += m;
  }
  mean /= static_cast<double>(middles.size());
  Matrix3 scatter = Matrix3::Zero();
  for (const Vector3& m : middles)
  {
    scatter += (m - mean) * (m - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(scatter);
  Vector3 axis = solver.eigenvectors().col(2);
  if (axis.dot(middles.back() - middles.front()) < 0.0)
  {
    axis = -axis;
  }
  outlet.ostium.axis = axis;

  outlet.ostium.position = middles.front();
  this->FollowToWall(outlet.ostium);
  Vector3 farther = outlet.ostium.position;
  constexpr double along = 40.0; // mm
  for (const std::int64_t p : path)
  {
    if (this->Length[p] <= along)
    {
      farther = this->World(p);
    }
  }
  this->Orient(outlet, farther);
  return true;
}

/// Where an outlet lies about the aorta.
/// @param farther  a place 40 mm along the vessel, or its end
void OutletSearch::Orient(Outlet& outlet, const Vector3& farther) const
{
  const Vector3& position = outlet.ostium.position;
  const TubeAxis::Place place = this->Axis.At(position);
  outlet.level = place.length;
  const Vector3 outward = this->Upright * (position - place.centre);
  outlet.azimuth = std::atan2(-outward[1], outward[0]);
  outlet.departure = outlet.ostium.axis.dot((position - place.centre).normalized());
  outlet.course = this->Upright * (farther - position);
}

/// An outlet whose vessel is not seen at the wall.
Outlet OutletSearch::Describe(const HiddenMouth& mouth) const
{
  constexpr double opening = 5.0; // mm that give the direction at the wall
  constexpr double shaded = 10.0; // mm, and the others below, as for what is seen
  constexpr double along = 40.0;
  constexpr double most = 45.0;
  constexpr double longest = 80.0;
  Outlet outlet;
  outlet.volume = mouth.volume;
  outlet.ostium.hidden = mouth.hidden;
  outlet.unseen = mouth.unseen;
  outlet.ostium.length = std::min(longest, mouth.length);
  outlet.ostium.radius = mouth.radius;
  std::vector<std::int64_t> path = mouth.way;
  path.insert(path.end(), mouth.along.begin() + 1, mouth.along.end());
  const Vector3 first = this->World(path.front());
  Vector3 ahead = first;
  Vector3 farther = first;
  double length = 0.0;
  int count = 0;
  for (std::size_t n = 1; n < path.size(); ++n)
  {
    const Vector3 here = this->World(path[n]);
    const double step = (here - this->World(path[n - 1])).norm();
    length += step;
    outlet.shade += length <= shaded ? step * (1.0 - this->Brightness(path[n])) : 0.0;
    if (n >= mouth.way.size() && length <= most)
    {
      outlet.tubular += this->TubenessAt(path[n]);
      ++count;
    }
    ahead = length <= opening ? here : ahead;
    farther = length <= along ? here : farther;
  }
  outlet.tubular /= std::max(1, count);
  outlet.ostium.axis = (ahead - first).normalized();
  outlet.ostium.position = this->World(mouth.way[std::min<std::size_t>(2, mouth.way.size() - 1)]);
  this->FollowToWall(outlet.ostium);
  outlet.ostium.radius = mouth.radius;
  const Vector3 axis = ahead - outlet.ostium.position;
  outlet.ostium.axis = axis.norm() > 0.0 ? Vector3(axis.normalized()) : outlet.ostium.axis;
  this->Orient(outlet, farther);
  return outlet;
}

/// The wall around a place on it, without the vessel's mouth, continued over that.
WallPatch OutletSearch::FitWall(
  const Vector3& around, const std::vector<Vector3>& vessel, double radius) const
{
  constexpr double extent = 12.0; // mm of wall to fit
  WallPatch patch;
  patch.origin = around;
  const TubeAxis::Place place = this->Axis.At(around);
  patch.up = place.direction;
  patch.outward = around - place.centre;
  patch.outward -= patch.outward.dot(patch.up) * patch.up;
  if (!(patch.outward.norm() > 0.0))
  {
    return patch;
  }
  patch.outward.normalize();

  // Faces between the aorta and what is not blood.
  std::vector<Vector3> points;
  const auto collect = [&](const std::array<int, 3>& at)
  {
    const std::int64_t p = this->Volume.Index(at[0], at[1], at[2]);
    if (this->Body[p] != 2)
    {
      return;
    }
    for (int direction = 0; direction < 6; ++direction)
    {
      std::array<int, 3> next = at;
      const int axis = direction / 2;
      next[axis] += direction % 2 ? 1 : -1;
      if (next[axis] < 0 || next[axis] >= this->Volume.size[axis])
      {
        continue;
      }
      const float inside = this->Volume.values[p];
      const float outside = this->Volume.values[this->Volume.Index(next[0], next[1], next[2])];
      if (outside >= this->Half || outside <= WorldVolume::Nothing)
      {
        continue;
      }
      const double f = (inside - this->Half) / (inside - outside);
      const Vector3 edge = (1.0 - f) * this->Volume.World(at) + f * this->Volume.World(next);
      const bool mouth = std::any_of(vessel.begin(), vessel.end(),
        [&](const Vector3& v) { return (edge - v).norm() < 1.3 * radius + 0.5; });
      const Vector3 local = patch.Local(edge);
      if (!mouth && local.norm() < extent && local[2] > -0.5 * extent)
      {
        points.push_back(local);
      }
    }
  };
  const Vector3 middle = (around - this->Volume.corner) / this->Volume.spacing;
  const int reach = static_cast<int>(extent / this->Volume.spacing) + 1;
  std::array<int, 3> low;
  std::array<int, 3> high;
  for (int axis = 0; axis < 3; ++axis)
  {
    low[axis] = std::max(0, static_cast<int>(middle[axis]) - reach);
    high[axis] = std::min(this->Volume.size[axis] - 1, static_cast<int>(middle[axis]) + reach);
  }
  for (int k = low[2]; k <= high[2]; ++k)
  {
    for (int j = low[1]; j <= high[1]; ++j)
    {
      for (int i = low[0]; i <= high[0]; ++i)
      {
        collect({ i, j, k });
      }
    }
  }
  constexpr std::size_t enough = 40;
  if (points.size() < enough)
  {
    return patch;
  }
  // Least squares, with less and less say for outliers.
  double width = 1e9;
  for (int pass = 0; pass < 6; ++pass)
  {
    Eigen::Matrix<double, 6, 6> normal = 1e-9 * Eigen::Matrix<double, 6, 6>::Identity();
    WallPatch::Coefficients right = WallPatch::Coefficients::Zero();
    for (const Vector3& p : points)
    {
      const WallPatch::Coefficients r = WallPatch::Row(p);
      const double e = (p[2] - r.dot(patch.height)) / width;
      const double w = 1.0 / ((1.0 + e * e) * (1.0 + e * e));
      normal += w * r * r.transpose();
      right += w * p[2] * r;
    }
    patch.height = normal.ldlt().solve(right);
    width = pass < 2 ? 2.0 : 0.7;
  }
  patch.known = true;
  return patch;
}

/**
 * Moves `centre` across the axis to the middle of the vessel, as far as its rim is visible: where
 * the vessel opens into the aorta there is none, and the radius of before has to do.
 * @return how much of the rim is visible, 0 to 1; 0 when the centre stays
 */
double OutletSearch::Recentre(
  Vector3& centre, double& radius, const Vector3& axis, bool adapt) const
{
  constexpr int rays = 24;
  constexpr double step = 0.15;
  const Vector3 u = axis.unitOrthogonal();
  const Vector3 v = axis.cross(u);
  std::vector<std::array<double, 2>> rim;
  for (int ray = 0; ray < rays; ++ray)
  {
    const double cosine = std::cos(2.0 * Pi * ray / rays);
    const double sine = std::sin(2.0 * Pi * ray / rays);
    float before = this->At(centre);
    // In the vessel's funnel the wall is there, but it is not that of the vessel any more.
    const double reach = adapt ? 1.6 * radius + 0.5 : 1.35 * radius + 0.4;
    const int steps = static_cast<int>(std::ceil(reach / step));
    for (int i = 1; i < steps; ++i)
    {
      const double rho = i * step;
      const float value = this->At(centre + rho * (cosine * u + sine * v));
      if (value < this->Half)
      {
        if (before >= this->Half)
        {
          const double exact = rho - step * (this->Half - value) / (before - value);
          rim.push_back({ exact * cosine, exact * sine });
        }
        break;
      }
      before = value;
    }
  }
  if (rim.size() < rays / 4)
  {
    return 0.0;
  }
  double x = 0.0;
  double y = 0.0;
  double r = radius;
  const bool whole = adapt && rim.size() > rays * 2 / 3;
  for (int pass = 0; pass < 10; ++pass)
  {
    // Gauss-Newton on the distances to the rim; a little weight keeps what the rim leaves open.
    Matrix3 normal = Vector3(1.0, 1.0, whole ? 1.0 : 1e9).asDiagonal();
    Vector3 right(-x, -y, 0.0);
    for (const auto& p : rim)
    {
      const double dx = p[0] - x;
      const double dy = p[1] - y;
      const double d = std::max(1e-6, std::hypot(dx, dy));
      const double e = d - r;
      const double w = 1.0 / (1.0 + e * e / 0.25);
      const Vector3 g(-dx / d, -dy / d, -1.0);
      normal += w * g * g.transpose();
      right -= w * e * g;
    }
    const Vector3 move = normal.ldlt().solve(right);
    x += move[0];
    y += move[1];
    r += move[2];
  }
  if (!(std::hypot(x, y) < radius) || !(r > 0.3) || !(r < 2.0 * radius + 0.5))
  {
    return 0.0;
  }
  centre += x * u + y * v;
  radius = r;
  return static_cast<double>(rim.size()) / rays;
}

/// From a place inside the vessel back along its middle to the aortic wall.
void OutletSearch::FollowToWall(CoronaryOstium& ostium) const
{
  constexpr double step = 0.5;
  constexpr double farthest = 12.0;
  Vector3 axis = ostium.axis;
  double radius = std::clamp(ostium.radius, 0.8, this->Settings.maximumVesselRadius);
  for (int pass = 0; pass < 2; ++pass)
  {
    this->Recentre(ostium.position, radius, axis, true);
  }
  ostium.radius = radius;

  // A first idea of the place: straight back until the aorta's body begins.
  const auto inBody = [&](const Vector3& p)
  {
    std::array<int, 3> at;
    for (int i = 0; i < 3; ++i)
    {
      at[i] = static_cast<int>(std::lround((p[i] - this->Volume.corner[i]) / this->Volume.spacing));
      if (at[i] < 0 || at[i] >= this->Volume.size[i])
      {
        return true;
      }
    }
    return this->Body[this->Volume.Index(at[0], at[1], at[2])] != 0;
  };
  std::vector<Vector3> vessel{ ostium.position };
  while (!inBody(vessel.back()) && step * static_cast<double>(vessel.size()) < farthest)
  {
    vessel.emplace_back(vessel.back() - step * axis);
  }
  Vector3 crossing = vessel.back();

  // Then along the middle of what is visible, until the wall that the surroundings suggest.
  for (int pass = 0; pass < 2; ++pass)
  {
    const WallPatch wall = this->FitWall(crossing, vessel, radius);
    if (!wall.known)
    {
      break;
    }
    Vector3 direction = axis;
    vessel.assign(1, ostium.position);
    double above = wall.Above(vessel.back());
    double before = above;
    // A vessel that leaves along the wall is half open where its axis meets it.
    int open = 0;
    while (above > 0.0 && open < 2 && step * static_cast<double>(vessel.size()) < farthest)
    {
      Vector3 next = vessel.back() - step * direction;
      const double visible = this->Recentre(next, radius, direction, false);
      open = visible < 0.5 ? open + 1 : 0;
      if (visible > 0.8)
      {
        const Vector3 turned = (vessel.back() - next).normalized();
        if (turned.dot(direction) > 0.5)
        {
          direction = (0.8 * direction + 0.2 * turned).normalized();
        }
      }
      vessel.push_back(next);
      before = above;
      above = wall.Above(next);
    }
    if (open == 2)
    {
      crossing = vessel[vessel.size() - 2];
      break;
    }
    if (above > 0.0)
    {
      break;
    }
    crossing = vessel.back();
    if (vessel.size() > 1)
    {
      const double f = before / (before - above);
      crossing = (1.0 - f) * vessel[vessel.size() - 2] + f * vessel.back();
    }
  }
  ostium.position = crossing;
}
}

AorticOutlets FindOutlets(const ScalarImage& image, const AorticTube& tube,
  const CoronaryOstiaSettings& settings, const ProgressCallback& progress)
{
  const OutletSearch search(image, tube, settings, progress);
  AorticOutlets result;
  result.mean = search.BloodMean;
  result.deviation = search.BloodDeviation;
  result.sectionMeans = search.SectionMeans;
  result.chambers = search.Chambers;
  if (search.BloodMean > settings.softTissue)
  {
    result.outlets = search.Find();
  }
  return result;
}
}
