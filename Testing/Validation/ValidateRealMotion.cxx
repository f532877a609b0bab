// Tracking under the motion of a measured heart: a coronary tree carried on its epicardial surface, CT-like images
// of it, tracked, against where it was carried.
#include "BranchPlacement.h"
#include "CarriedHeart.h"
#include "CenterlineTracking.h"
#include "CounterRandom.h"
#include "DistanceTransform.h"
#include "LumenSight.h"
#include "MotionRegularization.h"
#include "PhaseInterpolation.h"
#include "ScannedHeart.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
using namespace coronary;

constexpr int NoData = 125; // what CTest takes as skipped

// What must be reached, mm, of the whole run and of the quick one.
constexpr double MaximumMean[2] = { 0.40, 0.6 };
constexpr double MaximumPercentile[2] = { 0.9, 2.0 };

const std::vector<std::string> VesselNames = { "RCA", "AM", "LAD", "D1", "LCx", "OM1", "OM2" };

/// Nearer to where a hidden vessel leaves another one, that one is seen, mm.
constexpr double FromFork = 4.0;

/// When a vessel may be hidden: early systole, three of the frames that are tracked.
bool IsHidden(double time)
{
  return time > 0.23 && time < 0.41;
}

/// What a CT of the moving heart shows.
class Scanner
{
public:
  /// @param hidden  vessel that is not shown in systole; -1: none
  Scanner(const Heart& heart, const LargerMotion& motion, const CarriedTree& tree, double spacing,
    double window, int moments, int hidden)
    : Body(heart)
    , Motion(motion)
    , Tree(tree)
    , Window(window)
    , Moments(window > 0.0 ? moments : 1)
    , Hidden(hidden)
  {
    Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
    Vector3 high = -low;
    for (int k = 0; k < Frames; ++k)
    {
      for (const Vector3& point : motion.At(TimeOf(k)))
      {
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
      }
    }
    this->Grid.origin = low - Vector3::Constant(12.0);
    this->Grid.spacing = Vector3::Constant(spacing);
    for (int axis = 0; axis < 3; ++axis)
    {
      this->Size[axis] = static_cast<int>((high[axis] - low[axis] + 24.0) / spacing) + 1;
      this->Grid.extent[2 * axis] = 0;
      this->Grid.extent[2 * axis + 1] = this->Size[axis] - 1;
    }
    this->Voxels = static_cast<std::size_t>(this->Size[0]) * this->Size[1] * this->Size[2];
  }

  ScalarImage ImageAt(double time)
  {
    std::vector<float> sum(this->Voxels, 0.0F);
    const int hidden = IsHidden(time) ? this->Hidden : -1;
    for (int m = 0; m < this->Moments; ++m)
    {
      const double at = time + this->Window / CycleSeconds * ((m + 0.5) / this->Moments - 0.5);
      this->AddMoment(at, hidden, sum);
    }
    this->Blur(sum);
    this->Values.resize(this->Voxels);
    RandomStream random(17, static_cast<std::uint64_t>(std::llround(1e6 * (time + 2.0))));
    for (std::size_t n = 0; n < this->Voxels; ++n)
    {
      this->Values[n] = static_cast<std::int16_t>(
        std::lround(sum[n] / static_cast<float>(this->Moments) + 25.0 * random.Normal()));
    }
    ScalarImage image;
    image.grid = this->Grid;
    image.values = static_cast<const std::int16_t*>(this->Values.data());
    return image;
  }

private:
  /// A part of the image that another image on parallel axes shows, by linear interpolation; 0 outside of it.
  std::vector<float> OnGrid(const VesselImage& other) const
  {
    std::vector<float> result(this->Voxels, 0.0F);
    const std::array<int, 6>& e = other.grid.extent;
    const std::int64_t rows = e[1] + 1;
    const std::int64_t slices = rows * (e[3] + 1);
    ParallelFor(this->Size[2], 1,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t k = first; k < last; ++k)
        {
          for (int j = 0; j < this->Size[1]; ++j)
          {
            for (int i = 0; i < this->Size[0]; ++i)
            {
              const Vector3 index =
                (this->Grid.IndexToWorld(i, j, static_cast<double>(k)) - other.grid.origin) /
                other.grid.spacing[0];
              const Vector3 low = index.array().floor();
              if (low.minCoeff() < 0.0 || low[0] >= e[1] || low[1] >= e[3] || low[2] >= e[5])
              {
                continue;
              }
              const Vector3 share = index - low;
              const float* corner = other.values.data() +
                static_cast<std::int64_t>(low[2]) * slices +
                static_cast<std::int64_t>(low[1]) * rows + static_cast<std::int64_t>(low[0]);
              double value = 0.0;
              for (int c = 0; c < 8; ++c)
              {
                const int x = c & 1;
                const int y = c >> 1 & 1;
                const int z = c >> 2;
                value += (x != 0 ? share[0] : 1.0 - share[0]) *
                  (y != 0 ? share[1] : 1.0 - share[1]) * (z != 0 ? share[2] : 1.0 - share[2]) *
                  corner[z * slices + y * rows + x];
              }
              result[(k * this->Size[1] + j) * this->Size[0] + i] = static_cast<float>(value);
            }
          }
        }
      });
    return result;
  }

  /// mm to where the share is at least a half (or below it).
  std::vector<float> DistanceTo(const std::vector<float>& share, bool inside) const
  {
    std::vector<unsigned char> mask(share.size());
    std::transform(share.begin(), share.end(), mask.begin(),
      [&](float value) { return static_cast<unsigned char>((value >= 0.5F) == inside ? 0 : 1); });
    std::vector<float> distance =
      SquaredDistanceTransform(mask.data(), this->Size, this->Grid.spacing);
    for (float& value : distance)
    {
      value = std::sqrt(value);
    }
    return distance;
  }

  void AddMoment(double time, int hidden, std::vector<float>& sum) const
  {
    const std::vector<Vector3> points = this->Motion.At(time);
    const double spacing = this->Grid.spacing[0];
    const std::vector<float> heart = this->OnGrid(this->Body.Epicardium.Filled(points, spacing));
    const std::vector<float> left = this->OnGrid(this->Body.LeftVentricle.Filled(points, spacing));
    const std::vector<float> outside = this->DistanceTo(heart, true);
    const std::vector<float> depth = this->DistanceTo(heart, false);
    const std::vector<float> fromLeft = this->DistanceTo(left, true);
    const std::vector<float> lumen = this->LumenOf(this->Tree.At(points), hidden);
    for (std::size_t n = 0; n < sum.size(); ++n)
    {
      // The right ventricle's wall is 4 mm thick, the septum 9 mm.
      const float right =
        std::clamp(depth[n] - 4.0F, 0.0F, 1.0F) * std::clamp(fromLeft[n] - 9.0F, 0.0F, 1.0F);
      const float inner =
        left[n] * 400.0F + (1.0F - left[n]) * (right * 250.0F + (1.0F - right) * 40.0F);
      const float lung = std::clamp(outside[n] - 6.0F, 0.0F, 1.0F);
      const float outer = -80.0F - 670.0F * lung;
      const float tissue = heart[n] * inner + (1.0F - heart[n]) * outer;
      sum[n] += lumen[n] * 400.0F + (1.0F - lumen[n]) * tissue;
    }
  }

  std::vector<float> LumenOf(const std::vector<Vector3>& points, int hidden) const
  {
    std::vector<float> lumen(this->Voxels, 0.0F);
    const Polylines& lines = this->Tree.Reference();
    const double spacing = this->Grid.spacing[0];
    for (std::size_t vessel = 0; vessel < lines.lines.size(); ++vessel)
    {
      const std::vector<std::int64_t>& line = lines.lines[vessel];
      for (std::size_t n = 0; static_cast<int>(vessel) != hidden && n + 1 < line.size(); ++n)
      {
        const Vector3& a = points[line[n]];
        const Vector3& b = points[line[n + 1]];
        const double reach = std::max(lines.radius[line[n]], lines.radius[line[n + 1]]) + spacing;
        std::array<int, 3> low{};
        std::array<int, 3> high{};
        for (int axis = 0; axis < 3; ++axis)
        {
          const double origin = this->Grid.origin[axis];
          low[axis] =
            std::clamp(static_cast<int>((std::min(a[axis], b[axis]) - reach - origin) / spacing), 0,
              this->Size[axis] - 1);
          high[axis] = std::clamp(
            static_cast<int>((std::max(a[axis], b[axis]) + reach - origin) / spacing) + 1, 0,
            this->Size[axis] - 1);
        }
        for (int k = low[2]; k <= high[2]; ++k)
        {
          for (int j = low[1]; j <= high[1]; ++j)
          {
            for (int i = low[0]; i <= high[0]; ++i)
            {
              const SegmentPlace place = NearestOnSegment(this->Grid.IndexToWorld(i, j, k), a, b);
              const double radius = (1.0 - place.fraction) * lines.radius[line[n]] +
                place.fraction * lines.radius[line[n + 1]];
              float& value =
                lumen[(static_cast<std::size_t>(k) * this->Size[1] + j) * this->Size[0] + i];
              value = std::max(value,
                static_cast<float>(std::clamp(
                  0.5 + (radius - std::sqrt(place.squaredDistance)) / spacing, 0.0, 1.0)));
            }
          }
        }
      }
    }
    return lumen;
  }

  /// The point spread function: a Gaussian of 0.5 mm.
  void Blur(std::vector<float>& values) const
  {
    constexpr int reach = 2;
    std::array<float, 2 * reach + 1> kernel{};
    float total = 0.0F;
    for (int n = -reach; n <= reach; ++n)
    {
      const double apart = n * this->Grid.spacing[0] / 0.5;
      total += kernel[n + reach] = static_cast<float>(std::exp(-0.5 * apart * apart));
    }
    const std::int64_t strides[3] = { 1, this->Size[0],
      static_cast<std::int64_t>(this->Size[0]) * this->Size[1] };
    std::vector<float> before;
    for (int axis = 0; axis < 3; ++axis)
    {
      before = values;
      for (std::int64_t n = 0; n < static_cast<std::int64_t>(values.size()); ++n)
      {
        const auto index = static_cast<int>(n / strides[axis] % this->Size[axis]);
        float sum = 0.0F;
        for (int w = -reach; w <= reach; ++w)
        {
          const int other = std::clamp(index + w, 0, this->Size[axis] - 1);
          sum += kernel[w + reach] * before[n + (other - index) * strides[axis]];
        }
        values[n] = sum / total;
      }
    }
  }

  const Heart& Body;
  const LargerMotion& Motion;
  const CarriedTree& Tree;
  const double Window;
  const int Moments;
  const int Hidden;
  ImageGrid Grid;
  std::array<int, 3> Size{};
  std::size_t Voxels = 0;
  std::vector<std::int16_t> Values;
};

/// What the virtual scanner makes of it, all frames in one scan.
class ScannerImages
{
public:
  ScannerImages(const MeshAnatomy& anatomy, const std::string& preset, double spacing,
    double beatDeviation, const std::vector<double>& times)
    : Times(times)
  {
    const CoronaryPhantom::Box& heart = anatomy.Heart();
    this->Grid.origin = heart.low - Vector3::Constant(4.0);
    this->Grid.spacing = Vector3::Constant(spacing);
    this->Voxels = 1;
    for (int axis = 0; axis < 3; ++axis)
    {
      const auto size = static_cast<int>((heart.high[axis] - heart.low[axis] + 8.0) / spacing) + 1;
      this->Grid.extent[2 * axis + 1] = size - 1;
      this->Voxels *= static_cast<std::size_t>(size);
    }
    ScannerSettings settings = ScannerPreset(preset);
    settings.heartShift = 0.0; // the truth has one place for a phase
    settings.beatDeviation = beatDeviation;
    this->Scan = std::make_unique<CtScanner>(anatomy, settings, this->Grid, times);
    this->Scan->Scan(this->Store);
  }

  ScalarImage ImageAt(double time)
  {
    this->Values.resize(this->Voxels);
    const auto phase = std::find(this->Times.begin(), this->Times.end(), time);
    this->Scan->Image(
      static_cast<std::size_t>(phase - this->Times.begin()), 0, this->Store, this->Values.data());
    ScalarImage image;
    image.grid = this->Grid;
    image.values = static_cast<const std::int16_t*>(this->Values.data());
    return image;
  }

private:
  const std::vector<double> Times;
  ImageGrid Grid;
  std::size_t Voxels = 0;
  MemoryScanStore Store;
  std::unique_ptr<CtScanner> Scan;
  std::vector<std::int16_t> Values;
};

struct Errors
{
  std::vector<double> values;

  double Mean() const
  {
    double sum = 0.0;
    for (const double value : this->values)
    {
      sum += value / static_cast<double>(this->values.size());
    }
    return sum;
  }

  double Percentile(double share) const
  {
    std::vector<double> sorted = this->values;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
};

double DistanceToAxis(
  const Polylines& lines, const std::vector<Vector3>& points, const Vector3& place)
{
  double minimum = std::numeric_limits<double>::infinity();
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    for (std::size_t n = 0; n + 1 < line.size(); ++n)
    {
      minimum = std::min(
        minimum, NearestOnSegment(place, points[line[n]], points[line[n + 1]]).squaredDistance);
    }
  }
  return std::sqrt(minimum);
}

/// Lines as a legacy VTK file.
void WriteLines(const std::string& path, const Polylines& lines, const std::vector<Vector3>& points,
  const std::vector<double>& errors)
{
  std::ofstream file(path);
  file << "# vtk DataFile Version 3.0\nlines\nASCII\nDATASET POLYDATA\nPOINTS " << points.size()
       << " double\n";
  for (const Vector3& point : points)
  {
    file << point.transpose() << "\n";
  }
  std::size_t size = 0;
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    size += line.size() + 1;
  }
  file << "LINES " << lines.lines.size() << " " << size << "\n";
  for (const std::vector<std::int64_t>& line : lines.lines)
  {
    file << line.size();
    for (const std::int64_t point : line)
    {
      file << " " << point;
    }
    file << "\n";
  }
  file << "POINT_DATA " << points.size() << "\nSCALARS Error double 1\nLOOKUP_TABLE default\n";
  for (const double error : errors)
  {
    file << error << "\n";
  }
  if (!file)
  {
    throw std::runtime_error("cannot write '" + path + "'");
  }
}

/// The slice through the middle of the left ventricle, for a look at it: a PGM file.
void WriteSlice(const std::string& path, const ScalarImage& image)
{
  const std::array<int, 3> size = image.Dimensions();
  const auto* values = std::get<const std::int16_t*>(image.values);
  std::ofstream file(path, std::ios::binary);
  file << "P5\n" << size[0] << " " << size[1] << "\n255\n";
  const std::int16_t* slice = values + static_cast<std::int64_t>(size[2] / 2) * size[0] * size[1];
  for (std::int64_t n = 0; n < static_cast<std::int64_t>(size[0]) * size[1]; ++n)
  {
    file.put(static_cast<char>(std::clamp((slice[n] + 200) * 255 / 700, 0, 255)));
  }
}

struct Settings
{
  std::string data = DYNAMICCORONARY_DATA_DIR "/biv-motion";
  std::string output;
  double spacing = 0.8;
  double window = 0.066;
  double captureRange = CenterlineTrackingSettings().captureRange;
  double fineRange = CenterlineTrackingSettings().fineRange;
  std::string hidden;         ///< vessel; empty: none
  std::string scanner;        ///< preset; empty: images by a formula
  double beatDeviation = 0.0; ///< of the scanner's R-R intervals, relative
  double larger = 1.0;        ///< factor of the motion
  bool filling = true;
  bool asMeasured = false;
  bool quick = false;
};

/// How far the vessels are carried.
void TellMotion(const Settings& options, const Heart& heart, const Polylines& lines,
  const std::vector<std::vector<Vector3>>& truth)
{
  double excursion = 0.0;
  double step = 0.0;
  double range = 0.0;
  for (int k = 0; k < Frames; ++k)
  {
    for (std::size_t n = 0; n < lines.points.size(); ++n)
    {
      excursion = std::max(excursion, (truth[k][n] - truth[ReferenceFrame][n]).norm());
      step = std::max(step, k < 2 ? 0.0 : (truth[k][n] - truth[k - 2][n]).norm());
      for (int other = 0; other < k; ++other)
      {
        range = std::max(range, (truth[k][n] - truth[other][n]).norm());
      }
    }
  }
  std::printf(
    "A measured heart%s: %zu points on %zu vessels, up to %.1f mm from the reference and "
    "%.1f mm between any two frames, %.1f mm between tracked frames that follow each other\n",
    options.asMeasured ? ", frames as they are" : "", lines.points.size(), lines.lines.size(),
    excursion, range, step);
  if (!options.asMeasured)
  {
    std::printf("Motion without the frames' scatter of %.2f mm: rank %d, order %d\n",
      heart.Fit().residual, heart.Fit().rank, heart.Fit().order);
  }
}

struct Judgement
{
  Errors across[2]; ///< tracked frames, others
  Errors carried[2];
  Errors unseen;           ///< places of a hidden vessel, from where they were carried
  Errors unseenAcross;     ///< the same, from its axis
  double confidence = 0.0; ///< greatest of them, away from the fork
  int called = 0;
  int near = 0;
  int nearAxis = 0;
  double worst = 0.0; ///< mean of a vessel at a frame
  std::size_t worstVessel = 0;
  int worstFrame = 0;
  std::vector<double> means;                ///< per frame
  std::vector<std::vector<Vector3>> places; ///< per frame
  std::vector<std::vector<double>> errors;  ///< per frame and point
};

double MeanOf(const std::vector<std::int64_t>& line, const std::vector<double>& errors)
{
  double mean = 0.0;
  for (const std::int64_t point : line)
  {
    mean += errors[point] / static_cast<double>(line.size());
  }
  return mean;
}

Judgement Judge(const Polylines& lines, const std::vector<std::vector<Vector3>>& truth,
  const PoseSequence& poses, int hidden)
{
  const PhaseInterpolation between(poses, {});
  InterpolatedPose pose;
  Judgement result;
  const std::vector<std::int64_t>* own = hidden >= 0 ? &lines.lines[hidden] : nullptr;
  for (int k = 0; k < Frames; ++k)
  {
    between.Evaluate(TimeOf(k), pose);
    const bool isTracked = k % 2 == 0;
    std::vector<double> errors;
    double sum = 0.0;
    for (std::size_t n = 0; n < pose.points.size(); ++n)
    {
      errors.push_back(DistanceToAxis(lines, truth[k], pose.points[n]));
      sum += errors.back();
      const double material = (pose.points[n] - truth[k][n]).norm();
      result.across[k % 2].values.push_back(errors.back());
      result.carried[k % 2].values.push_back(material);
      if (own && isTracked && IsHidden(TimeOf(k)) &&
        std::find(own->begin() + 1, own->end(), static_cast<std::int64_t>(n)) != own->end())
      {
        result.unseen.values.push_back(material);
        result.unseenAcross.values.push_back(errors.back());
        if ((lines.points[n] - lines.points[own->front()]).norm() > FromFork)
        {
          result.confidence = std::max(result.confidence, poses.confidence[k / 2][n]);
        }
      }
      if (isTracked && poses.status[k / 2][n] == TrackingStatus::Tracked)
      {
        ++result.called;
        result.near += material <= 1.0 ? 1 : 0;
        result.nearAxis += errors.back() <= 1.0 ? 1 : 0;
      }
    }
    for (std::size_t vessel = 0; vessel < lines.lines.size(); ++vessel)
    {
      const double mean = MeanOf(lines.lines[vessel], errors);
      if (mean > result.worst)
      {
        result.worst = mean;
        result.worstVessel = vessel;
        result.worstFrame = k;
      }
    }
    result.means.push_back(sum / static_cast<double>(errors.size()));
    result.places.push_back(pose.points);
    result.errors.push_back(std::move(errors));
  }
  return result;
}

void Print(const Judgement& one, const std::string& hidden)
{
  for (int odd = 0; odd < 2; ++odd)
  {
    std::printf("%s frames: to the axis mean %.3f, 95 %% %.3f mm; to where it was carried mean "
                "%.3f, 95 %% %.3f mm\n",
      odd != 0 ? "other" : "tracked", one.across[odd].Mean(), one.across[odd].Percentile(0.95),
      one.carried[odd].Mean(), one.carried[odd].Percentile(0.95));
  }
  std::printf("farthest off: %s at frame %d, mean %.2f mm\n", VesselNames[one.worstVessel].c_str(),
    one.worstFrame, one.worst);
  if (!hidden.empty())
  {
    std::printf("%s, not shown in tracked frames of systole: from where it was carried mean %.2f, "
                "median %.2f, 95 %% %.2f, greatest %.2f mm; from its axis mean %.2f, 95 %% %.2f "
                "mm; confidence at most %.2f\n",
      hidden.c_str(), one.unseen.Mean(), one.unseen.Percentile(0.5), one.unseen.Percentile(0.95),
      one.unseen.Percentile(1.0), one.unseenAcross.Mean(), one.unseenAcross.Percentile(0.95),
      one.confidence);
  }
}

/// How far the lumens that the images show are from where they are, and from where they were tracked; and how likely each branch
/// was said to be within 1 mm of its axis. @param errors  mm, per frame and point
void TellSights(const Settings& options, const Polylines& lines,
  const std::vector<std::vector<Vector3>>& truth, const PoseSequence& poses,
  const std::vector<std::vector<double>>& errors,
  const std::function<ScalarImage(double time)>& imageAt)
{
  Errors fromTruth;
  Errors fromTracked;
  std::size_t places = 0;
  PlacementEvidence evidence;
  for (std::size_t k = 0; k < poses.times.size(); ++k)
  {
    const ScalarImage image = imageAt(poses.times[k]);
    const std::vector<double> ofTruth = SeeLumens(image, lines, truth[2 * k]).beside;
    evidence.sights.push_back(SeeLumens(image, lines, poses.points[k]));
    const std::vector<double>& ofTracked = evidence.sights.back().beside;
    places += ofTruth.size();
    for (std::size_t n = 0; n < ofTruth.size(); ++n)
    {
      if (std::max(ofTruth[n], ofTracked[n]) < NoLumenBeside)
      {
        fromTruth.values.push_back(ofTruth[n]);
        fromTracked.values.push_back(ofTracked[n]);
      }
    }
  }
  if (!fromTruth.values.empty())
  {
    std::printf("%.3f of the places are beside a lumen that the images of tracked frames show: "
                "%.3f mm from the truth, %.3f mm from where they were tracked\n",
      static_cast<double>(fromTruth.values.size()) / static_cast<double>(places), fromTruth.Mean(),
      fromTracked.Mean());
  }
  const std::vector<std::vector<double>> said = PlacementConfidences(
    lines, evidence, poses, { TimeOf(ReferenceFrame), options.window / CycleSeconds });
  int misplaced = 0;
  int sure = 0;
  double greatest = 0.0;
  for (std::size_t k = 0; k < poses.times.size(); ++k)
  {
    for (const std::vector<std::int64_t>& line : lines.lines)
    {
      const double mean = MeanOf(line, errors[2 * k]);
      const double confidence = said[k][line.back()];
      misplaced += mean > PlacedWithin ? 1 : 0;
      if (mean > PlacedWithin && confidence > 0.5)
      {
        ++sure;
        greatest = std::max(greatest, confidence);
        std::printf("  %s at %.2f: %.2f mm off, said %.2f\n",
          VesselNames[static_cast<std::size_t>(&line - lines.lines.data())].c_str(), poses.times[k],
          mean, confidence);
      }
    }
  }
  std::printf("%zu branches at tracked frames, %d not within %.0f mm, of these with a confidence "
              "above 0.5: %d "
              "(at most %.2f)\n",
    poses.times.size() * lines.lines.size(), misplaced, PlacedWithin, sure, greatest);
}

bool Run(const Settings& options)
{
  const Heart heart(options.data, options.asMeasured);
  const CarriedTree tree(heart);
  const LargerMotion motion(heart, options.larger);
  const Polylines& lines = tree.Reference();
  const int hidden = options.hidden.empty()
    ? -1
    : static_cast<int>(
        std::find(VesselNames.begin(), VesselNames.end(), options.hidden) - VesselNames.begin());
  std::vector<std::vector<Vector3>> truth;
  std::vector<double> times;
  for (int k = 0; k < Frames; ++k)
  {
    truth.push_back(tree.At(motion.At(TimeOf(k))));
    if (k % 2 == 0)
    {
      times.push_back(TimeOf(k));
    }
  }
  TellMotion(options, heart, lines, truth);
  std::unique_ptr<MeshAnatomy> anatomy;
  std::function<ScalarImage(double time)> imageAt;
  if (!options.scanner.empty())
  {
    anatomy = std::make_unique<MeshAnatomy>(AnatomyOf(heart, tree, motion, 400.0));
    std::vector<double> wanted = times;
    wanted.push_back(TimeOf(ReferenceFrame));
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    const auto images = std::make_shared<ScannerImages>(
      *anatomy, options.scanner, options.spacing, options.beatDeviation, wanted);
    imageAt = [images](double time) { return images->ImageAt(time); };
  }
  else
  {
    const auto scanner = std::make_shared<Scanner>(
      heart, motion, tree, options.spacing, options.window, options.quick ? 3 : 5, hidden);
    imageAt = [scanner](double time) { return scanner->ImageAt(time); };
  }
  CenterlineTrackingSettings settings;
  settings.temporalWindow = options.window;
  settings.cycleLength = CycleSeconds;
  settings.captureRange = options.captureRange;
  settings.fineRange = options.fineRange;
  settings.fillUnseen = options.filling;
  CenterlineTrackingReport report;
  const PoseSequence poses = TrackCenterlines(
    lines, TimeOf(ReferenceFrame), times,
    [&](double time)
    {
      const ScalarImage image = imageAt(time);
      if (!options.output.empty())
      {
        WriteSlice(
          options.output + "/slice_" + std::to_string(std::lround(100.0 * time)) + ".pgm", image);
      }
      return image;
    },
    settings, &report);
  MotionRegularizationSettings limits;
  limits.temporalWeight = TemporalWeightOf(times.size());

  const Judgement tracked = Judge(lines, truth, poses, hidden);
  const Judgement limited =
    Judge(lines, truth, RegularizeMotion(poses, lines, limits).poses, hidden);
  std::printf("frame: mean distance to the axis, mm (share tracked)\n");
  for (int k = 0; k < Frames; ++k)
  {
    std::printf("  %2d: %.2f", k, tracked.means[k]);
    std::printf(
      k % 2 == 0 ? " (%.2f)\n" : "\n", report.trackedShare[static_cast<std::size_t>(k) / 2]);
    if (!options.output.empty())
    {
      char name[32];
      std::snprintf(name, sizeof name, "_%02d.vtk", k);
      WriteLines(options.output + "/found" + name, lines, tracked.places[k], tracked.errors[k]);
      WriteLines(options.output + "/carried" + name, lines, truth[k],
        std::vector<double>(truth[k].size(), 0.0));
    }
  }
  Print(tracked, options.hidden);
  std::printf(
    "called tracked: %.3f of the places, of them within 1 mm of the axis %.3f, of where they were "
    "carried %.3f; %d images read\n",
    tracked.called / static_cast<double>(tracked.carried[0].values.size()),
    static_cast<double>(tracked.nearAxis) / std::max(tracked.called, 1),
    static_cast<double>(tracked.near) / std::max(tracked.called, 1), report.imagesRead);
  if (!options.scanner.empty())
  {
    TellSights(options, lines, truth, poses, tracked.errors, imageAt);
  }
  std::printf("Within limits, as `run` goes on with it:\n");
  Print(limited, options.hidden);
  const int judged = options.asMeasured ? 0 : 1; // frames that scatter cannot be interpolated
  const bool met = limited.across[judged].Mean() <= MaximumMean[options.quick] &&
    limited.across[judged].Percentile(0.95) <= MaximumPercentile[options.quick];
  std::printf("%s frames: mean at most %.2f mm, 95 %% at most %.2f mm: %s\n",
    judged != 0 ? "Other" : "Tracked", MaximumMean[options.quick], MaximumPercentile[options.quick],
    met ? "met" : "**MISSED**");
  return met;
}
}

int main(int argc, char** argv)
{
  try
  {
    CLI::App program("Tracking under the motion of a measured heart, against the carried truth");
    Settings options;
    program
      .add_option("--data", options.data, "Folder of the surfaces, patient1_EPICARDIAL_000.vtk ..")
      ->capture_default_str();
    program.add_option("--spacing", options.spacing, "Voxel size, mm")
      ->check(CLI::Range(0.4, 2.0))
      ->capture_default_str();
    double window = 1e3 * options.window;
    program.add_option("--window", window, "Temporal window, ms")
      ->check(CLI::Range(0.0, 400.0))
      ->capture_default_str();
    program.add_option("--capture-range", options.captureRange, "mm between tracked phases")
      ->check(CLI::Range(2.0, 40.0))
      ->capture_default_str();
    program.add_option("--fine-range", options.fineRange, "mm around what the first search found")
      ->check(CLI::Range(1.0, 12.0))
      ->capture_default_str();
    program
      .add_option("--hide", options.hidden, "Vessel that the images of early systole do not show")
      ->check(CLI::IsMember(VesselNames));
    program
      .add_option("--scanner", options.scanner,
        "Preset of the virtual CT scanner, with blood as bright as arteries and veins beside them; "
        "none: "
        "images by a formula")
      ->check(CLI::IsMember(ScannerPresets()))
      ->excludes("--hide");
    program
      .add_option("--beat-deviation", options.beatDeviation,
        "Of the scanner's R-R intervals, relative; it goes by their mean, and images then "
        "show other moments than the truth")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
    program.add_option("--larger", options.larger, "Factor of the motion")
      ->check(CLI::Range(0.1, 3.0))
      ->capture_default_str();
    program.add_flag(
      "!--no-filling", options.filling, "What is not seen by the trajectories alone");
    program.add_flag("--frames-as-they-are", options.asMeasured,
      "With the scatter of the frames, which were measured one by one; judged at tracked frames");
    program.add_option("--output", options.output, "Existing folder for lines and slices")
      ->check(CLI::ExistingDirectory);
    program.add_flag("--quick", options.quick, "Coarse voxels, with limits of its own");
    CLI11_PARSE(program, argc, argv);
    options.window = 1e-3 * window;
    options.spacing = options.quick ? 1.5 : options.spacing;
    HeartSurface any;
    if (!ReadHeartSurface(options.data, "EPICARDIAL", 0, any))
    {
      std::printf("skipped: no data in '%s'\n", options.data.c_str());
      return NoData;
    }
    return Run(options) ? 0 : 1;
  }
  catch (const std::exception& error)
  {
    std::fprintf(stderr, "validate-real-motion: %s\n", error.what());
    return 2;
  }
}
