#include "CtScanner.h"

#include "CounterRandom.h"
#include "EdgeSmoothing.h"
#include "PartialProgress.h"
#include "PhantomMotion.h"
#include "Require.h"
#include "ScannerPhysics.h"
#include "ScannerReconstruction.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr std::uint64_t NoisePurpose = 403;
constexpr double PartUnit = 8.0; ///< parts are kept in eighths of HU
constexpr int NoiseViews = 8;    ///< of so many views one tells the noise
// Times of a view and of back-projecting a voxel, s: for the progress.
constexpr double ViewCost = 0.03;
constexpr double VoxelCost = 2e-9;

/// A view of the scan: number in time, tube.
using ViewKey = std::pair<std::int64_t, int>;

/// Slices of one phase to be made of the same views.
struct Job
{
  std::string name;
  GatedStack stack;
  ImageGrid grid; ///< extent: its slices
  ViewKey last;   ///< of its views
};

std::uint64_t NoiseKey(std::uint64_t seed, const ViewKey& view)
{
  return MixBits(MixBits(seed) + NoisePurpose +
    MixBits(static_cast<std::uint64_t>(2 * view.first + view.second)));
}
}

struct CtScanner::Internals
{
  Internals(const ScannedAnatomy& anatomy, const ScannerSettings& settings, const ImageGrid& grid,
    const std::vector<double>& phases, const std::vector<ScanVariant>& variants)
    : Settings(settings)
    , Anatomy(anatomy)
    , Grid(grid)
    , Variants(variants)
    , Schedule(
        settings, this->Height(grid.extent[4]), this->Height(grid.extent[5]), anatomy.CycleLength())
    , Physics(settings)
  {
    Require((grid.direction - Matrix3::Identity()).norm() < 1e-6,
      "scanner: it makes axial slices: the image's direction has to be the identity");
    if (this->Variants.empty())
    {
      this->Variants.push_back({ settings.kernel, settings.imageNoise });
    }
    for (const double phase : phases)
    {
      this->Stacks.push_back(this->Schedule.Stacks(phase));
    }
    for (const ScanVariant& variant : this->Variants)
    {
      this->Reconstructions.emplace_back(this->Settings, variant.kernel);
    }
    this->Currents.assign(this->Variants.size(), 1.0);
    const CoronaryPhantom::Box body = anatomy.Body();
    this->Axis = 0.5 * (body.low + body.high);
    const double radius = 0.5 * std::max(body.high[0] - body.low[0], body.high[1] - body.low[1]);
    const std::string field = std::to_string(std::lround(2.0 * settings.FieldRadius())) + " mm";
    Require(radius < settings.FieldRadius(),
      "scanner: the patient does not fit into the field of " + field +
        ": more channels, or a longer channel_pitch_mm");
    const std::array<int, 6>& e = grid.extent;
    for (const int i : { e[0], e[1] })
    {
      for (const int j : { e[2], e[3] })
      {
        const Vector3 corner = grid.IndexToWorld(i, j, e[4]) - this->Axis;
        Require(std::hypot(corner[0], corner[1]) < settings.FieldRadius(),
          "scanner: the image reaches out of the field of " + field + " around x " +
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

  PatientState Patient(double seconds) const
  {
    return { this->Schedule.Phase(seconds), this->Schedule.Shift(seconds),
      this->Schedule.Iodine(seconds) };
  }

  ScannerView Stand(const ViewKey& view) const
  {
    Vector3 axis = this->Axis;
    axis[2] = this->Schedule.Table(this->Schedule.Seconds(view.first));
    return { this->Schedule.Angle(view.first, view.second), axis };
  }

  /// Views of one step see the same maps of the anatomy.
  double Step(const ViewKey& view) const
  {
    return std::floor(this->Schedule.Seconds(view.first) / this->Settings.anatomyStep);
  }

  static std::string PartName(std::size_t phase, std::size_t stack, std::size_t variant)
  {
    return std::to_string(phase) + "-" + std::to_string(stack) + "-" + std::to_string(variant);
  }

  bool Slices(
    const std::vector<GatedStack>& stacks, std::size_t number, std::array<int, 2>& range) const;
  std::vector<Job> Jobs(const ScanStore& store) const;
  void FindCurrents(const ProgressCallback& progress);
  void TakeViews(const std::vector<ViewKey>& views, ScannedPatient& patient,
    std::map<ViewKey, std::vector<std::vector<float>>>& taken,
    const ProgressCallback& progress) const;
  void Reconstruct(const Job& job, const std::map<ViewKey, std::vector<std::vector<float>>>& taken,
    ScanStore& store, const ProgressCallback& progress) const;

  const ScannerSettings Settings;
  const ScannedAnatomy& Anatomy;
  const ImageGrid Grid;
  std::vector<ScanVariant> Variants;
  const ScannerSchedule Schedule;
  std::vector<std::vector<GatedStack>> Stacks; ///< of each phase
  const ScannerPhysics Physics;
  std::vector<HalfScanReconstruction> Reconstructions;
  std::vector<double> Currents; ///< share of the settings' current
  std::vector<double> Levels;   ///< the different ones among them
  Vector3 Axis;
};

/// The slices in which a stack has a share.
bool CtScanner::Internals::Slices(
  const std::vector<GatedStack>& stacks, std::size_t number, std::array<int, 2>& range) const
{
  range = { this->Grid.extent[5] + 1, this->Grid.extent[4] - 1 };
  for (int k = this->Grid.extent[4]; k <= this->Grid.extent[5]; ++k)
  {
    if (this->Schedule.Weights(stacks, this->Height(k))[number] > 0.0)
    {
      range = { std::min(range[0], k), k };
    }
  }
  return range[0] <= range[1];
}

/// What the store does not have, in the order in which views come.
std::vector<Job> CtScanner::Internals::Jobs(const ScanStore& store) const
{
  std::vector<Job> jobs;
  for (std::size_t p = 0; p < this->Stacks.size(); ++p)
  {
    const std::vector<GatedStack>& stacks = this->Stacks[p];
    for (std::size_t n = 0; n < stacks.size(); ++n)
    {
      bool done = true;
      for (std::size_t v = 0; v < this->Variants.size(); ++v)
      {
        done = done && store.Has(PartName(p, n, v));
      }
      std::array<int, 2> slices;
      if (done || !this->Slices(stacks, n, slices))
      {
        continue;
      }
      Job job{ std::to_string(p) + "-" + std::to_string(n), stacks[n], this->Grid, {} };
      job.grid.extent[4] = slices[0];
      job.grid.extent[5] = slices[1];
      for (const GatedView& view : stacks[n].views)
      {
        job.last = std::max(job.last, ViewKey{ view.number, view.tube });
      }
      jobs.push_back(std::move(job));
    }
  }
  std::stable_sort(
    jobs.begin(), jobs.end(), [](const Job& a, const Job& b) { return a.last < b.last; });
  return jobs;
}

/// Sets the tube as a scanner does that knows the patient: noise in the middle of the body, at the
/// middle height of the image, by the reconstruction's weights on the views' own variances.
void CtScanner::Internals::FindCurrents(const ProgressCallback& progress)
{
  const double middle =
    0.5 * (this->Height(this->Grid.extent[4]) + this->Height(this->Grid.extent[5]));
  const bool wanted = this->Settings.noise != 0 &&
    std::any_of(this->Variants.begin(), this->Variants.end(),
      [](const ScanVariant& variant) { return variant.imageNoise > 0.0; });
  if (wanted)
  {
    const std::vector<GatedStack>& stacks = this->Stacks.front();
    const auto stack = std::min_element(stacks.begin(), stacks.end(),
      [&](const GatedStack& a, const GatedStack& b)
      { return std::abs(a.centre - middle) < std::abs(b.centre - middle); });
    ScannedPatient patient(this->Anatomy, this->Settings);
    const PatientState state = this->Patient(stack->middle);
    patient.Prepare(state, stack->centre, PartOf(progress, 0.0, 0.5));
    const int count = static_cast<int>(stack->views.size() + NoiseViews - 1) / NoiseViews;
    std::vector<std::vector<std::array<double, 2>>> sums(
      count, std::vector<std::array<double, 2>>(this->Variants.size()));
    ParallelFor(
      count, 1,
      [&](std::int64_t begin, std::int64_t end)
      {
        ViewPaths paths;
        TransmittedView transmitted;
        for (std::int64_t n = begin; n < end; ++n)
        {
          const GatedView& view = stack->views[n * NoiseViews];
          ScannerView stand = this->Stand({ view.number, view.tube });
          stand.axis[2] = stack->centre;
          patient.Project(stand, state, paths);
          this->Physics.Transmit(paths, transmitted);
          for (std::size_t v = 0; v < this->Variants.size(); ++v)
          {
            const std::vector<double> weights = this->Reconstructions[v].AxisWeights(view.position);
            for (int c = 0; c < this->Settings.channels; ++c)
            {
              const std::array<double, 2> variance =
                this->Physics.Variance(transmitted, c, this->Settings.rows / 2);
              for (const int part : { 0, 1 })
              {
                sums[n][v][part] += NoiseViews * view.weight * weights[c] * 1e6 * variance[part];
              }
            }
          }
        }
      },
      PartOf(progress, 0.5, 1.0));
    for (std::size_t v = 0; v < this->Variants.size(); ++v)
    {
      std::array<double, 2> sum{ 0.0, 0.0 };
      for (const auto& one : sums)
      {
        sum[0] += one[v][0];
        sum[1] += one[v][1];
      }
      const double noise = this->Variants[v].imageNoise;
      if (noise > 0.0)
      {
        // photons / current + electronics / current^2 = noise^2
        const double half = 0.5 * sum[0] / (noise * noise);
        this->Currents[v] = half + std::sqrt(half * half + sum[1] / (noise * noise));
      }
    }
  }
  this->Levels = this->Currents;
  std::sort(this->Levels.begin(), this->Levels.end());
  this->Levels.erase(std::unique(this->Levels.begin(), this->Levels.end()), this->Levels.end());
}

/// Line integrals of views that are close in time, for each level of current.
void CtScanner::Internals::TakeViews(const std::vector<ViewKey>& views, ScannedPatient& patient,
  std::map<ViewKey, std::vector<std::vector<float>>>& taken, const ProgressCallback& progress) const
{
  const ScannerSettings& s = this->Settings;
  // The same for the same view, whichever others are taken with it.
  const double middle = (this->Step(views.front()) + 0.5) * s.anatomyStep;
  patient.Prepare(this->Patient(middle), this->Schedule.Table(middle), PartOf(progress, 0.0, 0.5));
  for (const ViewKey& view : views)
  {
    taken[view].assign(this->Levels.size(), {});
  }
  ParallelFor(
    static_cast<std::int64_t>(views.size()), 1,
    [&](std::int64_t begin, std::int64_t end)
    {
      ViewPaths paths;
      TransmittedView transmitted;
      for (std::int64_t n = begin; n < end; ++n)
      {
        const PatientState state = this->Patient(this->Schedule.Seconds(views[n].first));
        patient.Project(this->Stand(views[n]), state, paths);
        this->Physics.Transmit(paths, transmitted);
        std::vector<std::vector<float>>& levels = taken.at(views[n]);
        for (std::size_t level = 0; level < levels.size(); ++level)
        {
          levels[level].resize(static_cast<std::size_t>(s.channels) * s.rows);
          this->Physics.Detect(transmitted, this->Levels[level] * this->Current(state.phase),
            NoiseKey(s.seed, views[n]), levels[level].data());
        }
      }
    },
    PartOf(progress, 0.5, 1.0));
}

void CtScanner::Internals::Reconstruct(const Job& job,
  const std::map<ViewKey, std::vector<std::vector<float>>>& taken, ScanStore& store,
  const ProgressCallback& progress) const
{
  const std::array<int, 6>& e = job.grid.extent;
  const std::size_t nx = e[1] - e[0] + 1;
  const std::size_t ny = e[3] - e[2] + 1;
  const std::size_t nz = e[5] - e[4] + 1;
  std::vector<float> values(nx * ny * nz);
  std::vector<std::int16_t> part(values.size());
  std::vector<FilteredView> filtered(job.stack.views.size());
  for (std::size_t v = 0; v < this->Variants.size(); ++v)
  {
    const std::string name = job.name + "-" + std::to_string(v);
    if (store.Has(name))
    {
      continue;
    }
    const auto share = [&](double done)
    { return (static_cast<double>(v) + done) / static_cast<double>(this->Variants.size()); };
    const HalfScanReconstruction& reconstruction = this->Reconstructions[v];
    const std::array<int, 2> columns = reconstruction.Columns(this->Axis, job.grid);
    const std::size_t level =
      std::lower_bound(this->Levels.begin(), this->Levels.end(), this->Currents[v]) -
      this->Levels.begin();
    ParallelFor(
      static_cast<std::int64_t>(filtered.size()), 4,
      [&](std::int64_t begin, std::int64_t end)
      {
        for (std::int64_t n = begin; n < end; ++n)
        {
          const GatedView& view = job.stack.views[n];
          const std::vector<float>& line = taken.at({ view.number, view.tube })[level];
          const ScannerView stand = this->Stand({ view.number, view.tube });
          filtered[n].angle = stand.angle;
          filtered[n].height = stand.axis[2];
          filtered[n].values.resize(line.size());
          reconstruction.Filter(
            view.position, view.weight, line.data(), columns, filtered[n].values.data());
        }
      },
      PartOf(progress, share(0.0), share(0.3)));
    reconstruction.BackProject(
      filtered, this->Axis, job.grid, values.data(), PartOf(progress, share(0.3), share(1.0)));
    for (std::size_t k = 0; k < nz; ++k)
    {
      for (std::size_t n = 0; n < nx * ny; ++n)
      {
        const float hounsfield =
          std::clamp(1000.0f * (values[n * nz + k] - 1.0f), -1024.0f, 3071.0f);
        part[k * nx * ny + n] =
          static_cast<std::int16_t>(std::lround(static_cast<float>(PartUnit) * hounsfield));
      }
    }
    store.Put(name, part);
  }
}

CtScanner::CtScanner(const ScannedAnatomy& anatomy, const ScannerSettings& settings,
  const ImageGrid& grid, const std::vector<double>& phases,
  const std::vector<ScanVariant>& variants)
  : Data(std::make_unique<Internals>(anatomy, settings, grid, phases, variants))
{
}

CtScanner::~CtScanner() = default;

void CtScanner::Scan(ScanStore& store, const ProgressCallback& progress)
{
  Internals& data = *this->Data;
  data.FindCurrents(PartOf(progress, 0.0, 0.01));
  const std::vector<Job> jobs = data.Jobs(store);
  std::map<ViewKey, std::size_t> lastUse; // the job after which a view is not needed
  for (std::size_t j = 0; j < jobs.size(); ++j)
  {
    for (const GatedView& view : jobs[j].stack.views)
    {
      lastUse[{ view.number, view.tube }] = j;
    }
  }
  const auto costOf = [&](const Job& job)
  {
    const std::array<int, 6>& e = job.grid.extent;
    return VoxelCost * (e[1] - e[0] + 1) * (e[3] - e[2] + 1) * (e[5] - e[4] + 1) *
      static_cast<double>(job.stack.views.size() * data.Variants.size());
  };
  double whole = ViewCost * static_cast<double>(lastUse.size());
  for (const Job& job : jobs)
  {
    whole += costOf(job);
  }
  double spent = 0.0;
  const auto next = [&](double cost)
  {
    const double first = 0.01 + 0.99 * spent / whole;
    spent += cost;
    return PartOf(progress, first, 0.01 + 0.99 * spent / whole);
  };
  std::map<ViewKey, std::vector<std::vector<float>>> taken;
  ScannedPatient patient(data.Anatomy, data.Settings);
  std::size_t ready = 0;
  for (auto view = lastUse.begin(); view != lastUse.end();)
  {
    std::vector<ViewKey> together;
    const double step = data.Step(view->first);
    for (; view != lastUse.end() && data.Step(view->first) == step; ++view)
    {
      together.push_back(view->first);
    }
    data.TakeViews(together, patient, taken, next(ViewCost * static_cast<double>(together.size())));
    for (; ready < jobs.size() && jobs[ready].last <= together.back(); ++ready)
    {
      data.Reconstruct(jobs[ready], taken, store, next(costOf(jobs[ready])));
      for (auto old = taken.begin(); old != taken.end();)
      {
        old = lastUse.at(old->first) <= ready ? taken.erase(old) : std::next(old);
      }
    }
  }
}

void CtScanner::Image(std::size_t phase, std::size_t variant, const ScanStore& store,
  std::int16_t* values, const ProgressCallback& progress) const
{
  const Internals& data = *this->Data;
  const std::array<int, 6>& e = data.Grid.extent;
  const std::size_t plane = static_cast<std::size_t>(e[1] - e[0] + 1) * (e[3] - e[2] + 1);
  std::vector<float> image(plane * (e[5] - e[4] + 1));
  const std::vector<GatedStack>& stacks = data.Stacks[phase];
  for (std::size_t n = 0; n < stacks.size(); ++n)
  {
    std::array<int, 2> slices;
    if (!data.Slices(stacks, n, slices))
    {
      continue;
    }
    const std::vector<std::int16_t> part = store.Get(Internals::PartName(phase, n, variant));
    for (int k = slices[0]; k <= slices[1]; ++k)
    {
      const auto weight =
        static_cast<float>(data.Schedule.Weights(stacks, data.Height(k))[n] / PartUnit);
      const std::int16_t* from = &part[(k - slices[0]) * plane];
      float* to = &image[(k - e[4]) * plane];
      for (std::size_t i = 0; i < plane; ++i)
      {
        to[i] += weight * static_cast<float>(from[i]);
      }
    }
  }
  if (data.Settings.iterative > 0.0)
  {
    SmoothWithinEdges(image, { e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1 },
      data.Settings.iterative, progress);
  }
  std::transform(image.begin(), image.end(), values,
    [](float hounsfield)
    { return static_cast<std::int16_t>(std::lround(std::clamp(hounsfield, -1024.0f, 3071.0f))); });
}

std::vector<ScannedStack> CtScanner::Stacks(std::size_t phase) const
{
  const Internals& data = *this->Data;
  std::vector<ScannedStack> result;
  for (const GatedStack& stack : data.Stacks[phase])
  {
    const PatientState middle = data.Patient(stack.middle);
    ScannedStack scanned;
    scanned.shift = middle.shift;
    scanned.iodine = middle.iodine;
    scanned.interval = data.Schedule.Beat(stack.beats.front()).interval;
    scanned.firstPhase = std::numeric_limits<double>::max();
    scanned.lastPhase = -scanned.firstPhase;
    scanned.current = 0.0;
    double weights = 0.0;
    for (const GatedView& view : stack.views)
    {
      const double heart = data.Schedule.Phase(data.Schedule.Seconds(view.number));
      scanned.firstPhase = std::min(scanned.firstPhase, heart);
      scanned.lastPhase = std::max(scanned.lastPhase, heart);
      scanned.current += view.weight * data.Current(heart);
      weights += view.weight;
    }
    scanned.current /= weights;
    scanned.stack = stack;
    result.push_back(std::move(scanned));
  }
  return result;
}

double CtScanner::Milliamperes(std::size_t variant) const
{
  return this->Data->Settings.milliamperes * this->Data->Currents.at(variant);
}
}
