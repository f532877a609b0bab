#include "CtScanner.h"

#include "CounterRandom.h"
#include "PartialProgress.h"
#include "PhantomMotion.h"
#include "Require.h"
#include "ScannedAnatomy.h"
#include "ScannerPhysics.h"
#include "ScannerReconstruction.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr std::uint64_t NoisePurpose = 403;
// Shares of a slab's time, for the progress.
constexpr double ProjectionShare = 0.7;

/// A view of a half scan.
struct TimedView
{
  int number;   ///< in the order of angles
  double angle; ///< of the tube, rad
  double seconds;
  double phase;      ///< of the heart
  std::uint64_t key; ///< of its noise
};
}

struct CtScanner::Internals
{
  Internals(const CoronaryPhantom& phantom, const ScannerSettings& settings, const ImageGrid& grid)
    : Settings(settings)
    , Anatomy(phantom)
    , Grid(grid)
    , Cycle(this->Anatomy.CycleLength())
    , Schedule(settings, this->Height(grid.extent[4]), this->Height(grid.extent[5]), this->Cycle)
    , Physics(settings)
    , Reconstruction(this->Settings)
  {
    Require((grid.direction - Matrix3::Identity()).norm() < 1e-6,
      "scanner: it makes axial slices: the image's direction has to be the identity");
    const CoronaryPhantom::Box body = this->Anatomy.Body();
    this->Axis = 0.5 * (body.low + body.high);
    this->BodyRadius = 0.5 * std::max(body.high[0] - body.low[0], body.high[1] - body.low[1]);
    Require(this->BodyRadius < settings.FieldRadius(),
      "scanner: the patient does not fit into the field of " +
        std::to_string(std::lround(2.0 * settings.FieldRadius())) +
        " mm: more channels, or a longer channel_pitch_mm");
    const std::array<int, 6>& e = grid.extent;
    for (const int i : { e[0], e[1] })
    {
      for (const int j : { e[2], e[3] })
      {
        const Vector3 corner = grid.IndexToWorld(i, j, e[4]) - this->Axis;
        Require(std::hypot(corner[0], corner[1]) < settings.FieldRadius(),
          "scanner: the image reaches out of the field of " +
            std::to_string(std::lround(2.0 * settings.FieldRadius())) + " mm around x " +
            std::to_string(std::lround(this->Axis[0])) + ", y " +
            std::to_string(std::lround(this->Axis[1])) + " mm");
      }
    }
  }

  double Height(int k) const { return this->Grid.origin[2] + k * this->Grid.spacing[2]; }

  double Current(double phase) const
  {
    const double cycle = phase - std::floor(phase);
    const double full =
      SmoothStep((cycle - 0.55) / 0.08) * (1.0 - SmoothStep((cycle - 0.88) / 0.08));
    return this->Settings.systolicCurrent + (1.0 - this->Settings.systolicCurrent) * full;
  }

  std::vector<TimedView> Views(std::size_t slabNumber, double phase) const;
  void Project(const ScannerSlab& slab, const std::vector<TimedView>& views,
    std::vector<std::vector<float>>& data, const ProgressCallback& progress) const;
  void AddSlab(std::size_t number, double phase, std::vector<float>& image,
    const ProgressCallback& progress) const;

  const ScannerSettings Settings;
  const ScannedPhantom Anatomy;
  const ImageGrid Grid;
  const double Cycle; ///< mean R-R interval, s
  const ScannerSchedule Schedule;
  const ScannerPhysics Physics;
  const HalfScanReconstruction Reconstruction;
  Vector3 Axis;
  double BodyRadius; ///< mm
};

/// The views of a half scan, in the order of their angles.
std::vector<TimedView> CtScanner::Internals::Views(std::size_t slabNumber, double phase) const
{
  const ScannerSettings& s = this->Settings;
  const ScannerSlab& slab = this->Schedule.Slabs()[slabNumber];
  const int count = s.HalfScanViews();
  const int quarter = s.viewsPerTurn / 4;
  // The second tube stands a quarter turn ahead: it takes the rest of the angles in the same time.
  const int turned = s.sources == 1 ? count : count - quarter;
  const double step = s.turnTime / s.viewsPerTurn;
  const auto first =
    static_cast<std::int64_t>(std::lround(phase * this->Cycle / step - 0.5 * (turned - 1)));
  const std::uint64_t scan = MixBits(MixBits(s.seed) + NoisePurpose + slabNumber);
  std::vector<TimedView> views(count);
  for (int i = 0; i < count; ++i)
  {
    const bool second = s.sources == 2 && i >= count / 2;
    const std::int64_t number = first + i - (second ? quarter : 0);
    TimedView& view = views[i];
    view.number = i;
    view.angle = slab.gantryAngle + static_cast<double>(first + i) * s.ViewAngle();
    view.seconds = slab.start + static_cast<double>(number) * step;
    view.phase = this->Schedule.Phase(view.seconds);
    view.key = MixBits(scan + static_cast<std::uint64_t>(2 * number + (second ? 1 : 0)));
  }
  return views;
}

void CtScanner::Internals::Project(const ScannerSlab& slab, const std::vector<TimedView>& views,
  std::vector<std::vector<float>>& data, const ProgressCallback& progress) const
{
  const ScannerSettings& s = this->Settings;
  std::vector<TimedView> inTime = views;
  std::stable_sort(inTime.begin(), inTime.end(),
    [](const TimedView& a, const TimedView& b) { return a.seconds < b.seconds; });
  const auto momentOf = [&](const TimedView& view)
  { return static_cast<std::int64_t>(std::floor(view.seconds / s.anatomyStep)); };
  Vector3 axis = this->Axis;
  axis[2] = slab.centre;
  ScannedPatient patient(this->Anatomy, s);
  const auto stateAt = [&](double phase) { return PatientState{ phase, slab.shift, slab.iodine }; };
  for (std::size_t first = 0; first < inTime.size();)
  {
    const std::int64_t moment = momentOf(inTime[first]);
    std::size_t last = first;
    while (last < inTime.size() && momentOf(inTime[last]) == moment)
    {
      ++last;
    }
    const auto share = [&](std::size_t n)
    { return static_cast<double>(n) / static_cast<double>(inTime.size()); };
    const double mapped = share(first) + 0.4 * (share(last) - share(first));
    patient.Prepare(
      stateAt(this->Schedule.Phase((static_cast<double>(moment) + 0.5) * s.anatomyStep)),
      slab.centre, PartOf(progress, share(first), mapped));
    ParallelFor(
      static_cast<std::int64_t>(last - first), 1,
      [&](std::int64_t begin, std::int64_t end)
      {
        ViewPaths paths;
        for (std::int64_t n = begin; n < end; ++n)
        {
          const TimedView& view = inTime[first + n];
          patient.Project({ view.angle, axis }, stateAt(view.phase), paths);
          std::vector<float>& result = data[view.number];
          result.resize(static_cast<std::size_t>(s.channels) * s.rows);
          this->Physics.Measure({ paths[0].data(), paths[1].data(), paths[2].data() },
            this->Current(view.phase), view.key, result.data());
          this->Reconstruction.Filter(view.number, result.data());
        }
      },
      PartOf(progress, mapped, share(last)));
    first = last;
  }
}

void CtScanner::Internals::AddSlab(std::size_t number, double phase, std::vector<float>& image,
  const ProgressCallback& progress) const
{
  const ScannerSlab& slab = this->Schedule.Slabs()[number];
  ImageGrid part = this->Grid;
  std::array<int, 6>& e = part.extent;
  while (e[4] <= e[5] && this->Schedule.Weight(number, this->Height(e[4])) <= 0.0)
  {
    ++e[4];
  }
  while (e[5] > e[4] && this->Schedule.Weight(number, this->Height(e[5])) <= 0.0)
  {
    --e[5];
  }
  if (e[4] > e[5])
  {
    return; // between two slices
  }
  const std::vector<TimedView> views = this->Views(number, phase);
  std::vector<std::vector<float>> data(views.size());
  this->Project(slab, views, data, PartOf(progress, 0.0, ProjectionShare));
  std::vector<double> angles(views.size());
  std::transform(
    views.begin(), views.end(), angles.begin(), [](const TimedView& view) { return view.angle; });
  const std::size_t nx = e[1] - e[0] + 1;
  const std::size_t ny = e[3] - e[2] + 1;
  const std::size_t nz = e[5] - e[4] + 1;
  std::vector<float> values(nx * ny * nz);
  Vector3 axis = this->Axis;
  axis[2] = slab.centre;
  this->Reconstruction.BackProject(
    angles, data, axis, part, values.data(), PartOf(progress, ProjectionShare, 1.0));
  for (std::size_t k = 0; k < nz; ++k)
  {
    const int slice = e[4] + static_cast<int>(k);
    const auto weight = static_cast<float>(this->Schedule.Weight(number, this->Height(slice)));
    float* out = &image[(slice - this->Grid.extent[4]) * nx * ny];
    for (std::size_t n = 0; n < nx * ny; ++n)
    {
      out[n] += weight * values[n * nz + k];
    }
  }
}

CtScanner::CtScanner(
  const CoronaryPhantom& phantom, const ScannerSettings& settings, const ImageGrid& grid)
  : Data(std::make_unique<Internals>(phantom, settings, grid))
{
}

CtScanner::~CtScanner() = default;

void CtScanner::Scan(double phase, std::int16_t* values, const ProgressCallback& progress) const
{
  const Internals& data = *this->Data;
  const std::array<int, 6>& e = data.Grid.extent;
  std::vector<float> image(
    static_cast<std::size_t>(e[1] - e[0] + 1) * (e[3] - e[2] + 1) * (e[5] - e[4] + 1));
  const std::size_t count = data.Schedule.Slabs().size();
  for (std::size_t s = 0; s < count; ++s)
  {
    const auto share = [&](std::size_t n)
    { return static_cast<double>(n) / static_cast<double>(count); };
    data.AddSlab(s, phase, image, PartOf(progress, share(s), share(s + 1)));
  }
  std::transform(image.begin(), image.end(), values,
    [](float water)
    {
      return static_cast<std::int16_t>(
        std::lround(std::clamp(1000.0f * (water - 1.0f), -1024.0f, 3071.0f)));
    });
}

std::vector<ScannedSlab> CtScanner::Slabs(double phase) const
{
  const Internals& data = *this->Data;
  std::vector<ScannedSlab> slabs;
  for (std::size_t s = 0; s < data.Schedule.Slabs().size(); ++s)
  {
    const std::vector<TimedView> views = data.Views(s, phase);
    ScannedSlab scanned{ data.Schedule.Slabs()[s], views.front().phase, views.front().phase, 0.0 };
    for (const TimedView& view : views)
    {
      scanned.firstPhase = std::min(scanned.firstPhase, view.phase);
      scanned.lastPhase = std::max(scanned.lastPhase, view.phase);
      scanned.current += data.Current(view.phase) / static_cast<double>(views.size());
    }
    slabs.push_back(scanned);
  }
  return slabs;
}
}
