#include "CenterlineTracking.h"

#include "LineTracker.h"
#include "Median.h"
#include "Numbers.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace coronary
{
namespace
{
/// Correlation of a vessel with what was expected, above which it counts as seen.
constexpr double TrackedLikeness = 0.65;
constexpr double TrackedConfidence = 0.5;
constexpr double WeakConfidence = 0.2;
constexpr double FilledConfidence = 0.3; ///< at most
constexpr double ChanceConfidence = 0.4; ///< at most
constexpr double LostDeviation = 2.0;    ///< mm
constexpr double SearchedAgain = 0.5;    ///< mm
constexpr double TissueRangeAnew = 3.0;  ///< mm
/// What is seen alone among places that are not seen is seen by chance: mm around it.
constexpr double SupportingReach = 8.0;
constexpr double ChanceShare = 1.0 / 3.0;
}

ProgressCallback LineTracker::Part(double from, double to) const
{
  return this->Progress ? ProgressCallback([this, from, to](double done)
                            { return this->Progress(from + done * (to - from)); })
                        : ProgressCallback();
}

ScalarImage LineTracker::Read(double time)
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

std::vector<Vector3> LineTracker::PlacesAt(const std::vector<Vector3>& displacement) const
{
  std::vector<Vector3> places(this->Nodes.size());
  for (std::size_t n = 0; n < places.size(); ++n)
  {
    places[n] = this->Nodes.position[n] + displacement[n];
  }
  return places;
}

Matrix3 LineTracker::Turn(int node, const std::vector<Vector3>& displacement) const
{
  return RotationOf(this->Deformation.At(node, displacement));
}

std::vector<Vector3> LineTracker::Smear(int node, double time) const
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

void LineTracker::MeasureContrast()
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
  this->Contrast = MedianOf(std::move(contrasts));
  if (!(this->Contrast > 0.0))
  {
    throw std::invalid_argument("The image at the reference time " +
      std::to_string(this->ReferenceTime) + " is the same everywhere along the lines");
  }
}

void LineTracker::Take(Trajectories motion)
{
  this->Motion = std::move(motion);
  for (std::size_t k = 0; k < this->Times.size(); ++k)
  {
    for (std::size_t n = 0; n < this->Nodes.size(); ++n)
    {
      this->Displacement[k][n] = this->Motion.Displacement(static_cast<int>(n), this->Times[k]);
    }
  }
}

void LineTracker::Fit(const std::vector<const Seen*>& seen)
{
  this->Take(
    FitRobustly(this->Nodes, this->Times, this->ReferenceTime, seen, this->Settings.prior));
}

std::vector<std::vector<bool>> LineTracker::SeenPlaces() const
{
  const std::size_t phases = this->Times.size();
  const std::size_t nodes = this->Nodes.size();
  std::vector<std::vector<int>> around(nodes);
  for (std::size_t n = 0; n < nodes; ++n)
  {
    const int parent = this->Nodes.parent[n];
    if (parent >= 0)
    {
      around[n].push_back(parent);
      around[parent].push_back(static_cast<int>(n));
    }
  }
  std::vector<std::vector<bool>> seen(phases, std::vector<bool>(nodes, false));
  for (std::size_t k = 0; k < phases; ++k)
  {
    const auto alike = [&](int n) { return this->Likeness[k][n] >= TrackedLikeness; };
    std::size_t count = 0;
    for (std::size_t n = 0; n < nodes; ++n)
    {
      // Along its own vessel: one that meets it is seen or not for itself.
      std::vector<std::pair<int, int>> open{ { static_cast<int>(n), -1 } };
      int near = 0;
      int alikeNear = 0;
      for (std::size_t at = 0; at < open.size(); ++at)
      {
        const auto [here, from] = open[at];
        ++near;
        alikeNear += alike(here) ? 1 : 0;
        const bool isFork = around[here].size() > 2 && at > 0;
        for (const int next : around[here])
        {
          if (next != from && !isFork &&
            (this->Nodes.position[next] - this->Nodes.position[n]).norm() <= SupportingReach)
          {
            open.emplace_back(next, here);
          }
        }
      }
      seen[k][n] = alike(static_cast<int>(n)) && 2 * alikeNear >= near;
      count += seen[k][n] ? 1 : 0;
    }
    // So many are alike by chance where there is nothing to be seen.
    if (static_cast<double>(count) < ChanceShare * static_cast<double>(nodes))
    {
      seen[k].assign(nodes, false);
    }
  }
  return seen;
}

double LineTracker::FillLost()
{
  const std::size_t phases = this->Times.size();
  const std::size_t nodes = this->Nodes.size();
  const std::vector<std::vector<bool>> seen = this->SeenPlaces();
  if (std::all_of(seen.begin(), seen.end(),
        [](const std::vector<bool>& phase)
        { return std::all_of(phase.begin(), phase.end(), [](bool own) { return own; }); }))
  {
    return 0.0;
  }
  const PerPhase before = this->Displacement;
  this->Take(FitFilled(this->Nodes, this->Times, this->ReferenceTime, seen,
    this->WithSurroundings(this->Vessels), this->Settings.prior));
  double farthest = 0.0;
  for (std::size_t k = 0; k < phases; ++k)
  {
    for (std::size_t n = 0; n < nodes; ++n)
    {
      farthest = std::max(farthest, (this->Displacement[k][n] - before[k][n]).norm());
    }
  }
  return farthest;
}

void LineTracker::MeasureRepeatability()
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

void LineTracker::Finish(PoseSequence& sequence)
{
  const std::vector<std::vector<bool>> found = this->SeenPlaces();
  const std::vector<double> calibre = this->MeasureCalibre(found);
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
      // Alike by chance, or alike elsewhere than the trajectories go.
      const bool isThere = found[k][n] &&
        ApartOf(this->Vessels, k, n, this->Displacement[k][n]) <= this->Settings.trackedDeviation;
      seen[n] = isThere ? seen[n] : std::min(seen[n], ChanceConfidence);
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
      moved[p] += this->Lines.points[p];
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
    sequence.calibre.emplace_back(this->Lines.points.size(), calibre[k]);
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

PoseSequence LineTracker::Run()
{
  this->SearchCoarsely();
  if (this->Settings.tissue)
  {
    this->Surroundings = this->SearchFinely(false, this->Settings.fineRange, 0.6);
  }
  {
    // From where the first search ended: what bends deceives the surroundings more than the vessels.
    const Seen vessels = this->SearchFinely(true, this->Settings.fineRange, 0.68);
    this->Fit(this->WithSurroundings(vessels));
  }
  this->Align(1.0, 0.76);
  this->Align(1.0, 0.79);
  if (this->Settings.tissue)
  {
    // Anew: by now it is known how it turned and along what it was smeared.
    this->Surroundings =
      this->SearchFinely(false, std::min(TissueRangeAnew, this->Settings.fineRange), 0.82);
  }
  this->Align(0.5, 0.9);
  this->Align(0.5, 0.93);
  // A branch that was looked for in the wrong place may be seen where those around it say that it is.
  if (this->Settings.fillUnseen && this->FillLost() > SearchedAgain)
  {
    this->Align(0.5, 0.96);
    this->FillLost();
  }
  PoseSequence sequence;
  this->Finish(sequence);
  return sequence;
}

void CenterlineTrackingSettings::Validate() const
{
  constexpr RequireOf require{ "CenterlineTrackingSettings" };
  require.Range("temporalWindow", this->temporalWindow, 0.0, 1.0);
  require.Range("cycleLength", this->cycleLength, 0.2, 5.0);
  require.Range("nodeSpacing", this->nodeSpacing, 0.5, 10.0);
  require.Range("coarseSpacing", this->coarseSpacing, 1.0, 4.0);
  require.Range("coarseRadius", this->coarseRadius, 4.0, 30.0);
  require.Range("captureRange", this->captureRange, 2.0, 40.0);
  require.Range("fineRadius", this->fineRadius, 2.0, 12.0);
  require.Range("fineRange", this->fineRange, 1.0, 12.0);
  require.Range("trackedDeviation", this->trackedDeviation, 0.05, 10.0);
  this->prior.Validate();
}

PoseSequence TrackCenterlines(const Polylines& lines, double referenceTime,
  const std::vector<double>& times, const std::function<ScalarImage(double time)>& imageAt,
  const CenterlineTrackingSettings& settings, CenterlineTrackingReport* report,
  const ProgressCallback& progress, ItemSharing& sharing)
{
  settings.Validate();
  CenterlineTrackingReport own;
  CenterlineTrackingReport& result = report != nullptr ? *report : own;
  result = {};
  if (lines.points.empty())
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
  LineTracker tracker(lines, referenceTime, times, imageAt, settings, result, progress, sharing);
  return tracker.Run();
}
}
