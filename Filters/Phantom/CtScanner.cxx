#include "CtScanner.h"

#include "CounterRandom.h"
#include "PartialProgress.h"
#include "PhantomMotion.h"
#include "Require.h"
#include "ScannerPhysics.h"
#include "ScannerProjection.h"
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
    : Phantom(phantom)
    , Settings(settings)
    , Grid(grid)
    , Cycle(phantom.Settings().cycleLength)
    , Schedule(settings, this->Height(grid.extent[4]), this->Height(grid.extent[5]), this->Cycle)
    , Physics(settings)
    , Projector(this->Settings)
    , Reconstruction(this->Settings)
  {
    Require((grid.direction - Matrix3::Identity()).norm() < 1e-6,
      "scanner: it makes axial slices: the image's direction has to be the identity");
    const CoronaryPhantom::Box body = phantom.Body();
    this->Axis = 0.5 * (body.low + body.high);
    this->BodyRadius = 0.5 * std::max(body.high[0] - body.low[0], body.high[1] - body.low[1]);
    this->Body = body;
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
  std::vector<ScannedTube> Tubes(const ScannerSlab& slab, double phase) const;
  std::vector<ScannedBall> Balls(const ScannerSlab& slab, double phase) const;
  MaterialAmounts Amounts(PhantomTissue tissue, double hounsfield, double iodine) const;
  ImageGrid MapGrid(const ScannerSlab& slab) const;
  void RenderMaps(const ScannerSlab& slab, double phase, MaterialVolume& volume,
    const ProgressCallback& progress) const;
  void Project(const ScannerSlab& slab, const std::vector<TimedView>& views,
    std::vector<std::vector<float>>& data, const ProgressCallback& progress) const;
  void AddSlab(std::size_t number, double phase, std::vector<float>& image,
    const ProgressCallback& progress) const;

  const CoronaryPhantom& Phantom;
  const ScannerSettings Settings;
  const ImageGrid Grid;
  const double Cycle; ///< mean R-R interval, s
  const ScannerSchedule Schedule;
  const ScannerPhysics Physics;
  const ScannerProjector Projector;
  const HalfScanReconstruction Reconstruction;
  const TissueMaterials Tissue;
  CoronaryPhantom::Box Body;
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

MaterialAmounts CtScanner::Internals::Amounts(
  PhantomTissue tissue, double hounsfield, double iodine) const
{
  MaterialAmounts amounts;
  switch (tissue)
  {
    case PhantomTissue::Lung:
      return this->Tissue.Lung(hounsfield);
    case PhantomTissue::Fat:
      return this->Tissue.Fat(hounsfield);
    case PhantomTissue::Soft:
      return this->Tissue.Soft(hounsfield);
    case PhantomTissue::Calcified:
      return this->Tissue.Calcified(hounsfield);
    case PhantomTissue::Muscle:
      amounts = this->Tissue.Muscle(hounsfield);
      break;
    case PhantomTissue::Blood:
      amounts = this->Tissue.Blood(hounsfield);
      break;
  }
  amounts[1] *= static_cast<float>(iodine);
  return amounts;
}

std::vector<ScannedTube> CtScanner::Internals::Tubes(const ScannerSlab& slab, double phase) const
{
  const double reach = 0.5 * (this->MapGrid(slab).extent[5] + 1) * this->Settings.anatomySpacing;
  const MaterialAmounts coats[2] = { this->Amounts(PhantomTissue::Fat,
                                       CoronaryPhantom::CoatValue(false), slab.iodine),
    this->Amounts(PhantomTissue::Muscle, CoronaryPhantom::CoatValue(true), slab.iodine) };
  std::vector<ScannedTube> tubes;
  for (const PhantomTube& tube : this->Phantom.Tubes(phase))
  {
    const Vector3 start = tube.start + slab.shift;
    if (std::abs(start[2] - slab.centre) < reach)
    {
      tubes.push_back({ start, tube.end + slab.shift, tube.startRadius, tube.endRadius, tube.round,
        this->Amounts(PhantomTissue::Blood, tube.value, slab.iodine) -
          coats[tube.inMuscle ? 1 : 0] });
    }
  }
  return tubes;
}

std::vector<ScannedBall> CtScanner::Internals::Balls(const ScannerSlab& slab, double phase) const
{
  const MaterialAmounts coat =
    this->Amounts(PhantomTissue::Fat, CoronaryPhantom::CoatValue(false), slab.iodine);
  std::vector<ScannedBall> balls;
  for (const PhantomPlaque& plaque : this->Phantom.Plaques(phase))
  {
    balls.push_back({ plaque.centre + slab.shift, plaque.radius,
      this->Amounts(PhantomTissue::Calcified, plaque.value, slab.iodine) - coat });
  }
  return balls;
}

/// Voxels around all that the rays of a slab meet.
ImageGrid CtScanner::Internals::MapGrid(const ScannerSlab& slab) const
{
  const ScannerSettings& s = this->Settings;
  ImageGrid grid;
  grid.spacing = Vector3::Constant(s.anatomySpacing);
  const double height =
    (0.5 * s.rows * s.rowPitch) * (s.sourceToAxis + this->BodyRadius) / s.sourceToDetector;
  Vector3 half = 0.5 * (this->Body.high - this->Body.low) + Vector3::Constant(s.anatomySpacing);
  half[2] = height + s.anatomySpacing;
  Vector3 centre = this->Axis + slab.shift;
  centre[2] = slab.centre;
  for (int axis = 0; axis < 3; ++axis)
  {
    const int steps = static_cast<int>(std::ceil(2.0 * half[axis] / s.anatomySpacing));
    grid.extent[2 * axis] = 0;
    grid.extent[2 * axis + 1] = steps;
    grid.origin[axis] = centre[axis] - 0.5 * steps * s.anatomySpacing;
  }
  return grid;
}

void CtScanner::Internals::RenderMaps(const ScannerSlab& slab, double phase, MaterialVolume& volume,
  const ProgressCallback& progress) const
{
  const ImageGrid grid = this->MapGrid(slab);
  volume.SetGrid(grid);
  ImageGrid atRest = grid; // the patient is elsewhere: so are the places of the phantom
  atRest.origin -= slab.shift;
  this->Phantom.RenderMaterials(
    atRest, phase,
    [&](PhantomTissue tissue, double hounsfield)
    {
      const MaterialAmounts amounts = this->Amounts(tissue, hounsfield, slab.iodine);
      return std::array<float, 3>{ amounts[0], amounts[1], amounts[2] };
    },
    { volume.maps[0].data(), volume.maps[1].data(), volume.maps[2].data() }, progress);
  volume.FindColumns();
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
  MaterialVolume volume;
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
    this->RenderMaps(slab,
      this->Schedule.Phase((static_cast<double>(moment) + 0.5) * s.anatomyStep), volume,
      PartOf(progress, share(first), mapped));
    ParallelFor(
      static_cast<std::int64_t>(last - first), 1,
      [&](std::int64_t begin, std::int64_t end)
      {
        ViewPaths paths;
        for (std::int64_t n = begin; n < end; ++n)
        {
          const TimedView& view = inTime[first + n];
          const ScannerView stand{ view.angle, axis };
          this->Projector.Clear(paths);
          this->Projector.Add(volume, stand, paths);
          this->Projector.Add(
            this->Tubes(slab, view.phase), this->Balls(slab, view.phase), stand, paths);
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
