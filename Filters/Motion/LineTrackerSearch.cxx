#include "LineTracker.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace coronary
{
namespace
{
/// Nothing is found better than that, or than a share of a voxel, mm.
constexpr double TissueDeviation = 0.5;
/// What the first search is told by the tissue around a vessel, and by the vessel with what lies next to it: so much at most, in
/// natural logarithms. A heart that contracts bends the tissue, which is then alike elsewhere.
constexpr double CoarseTissueLimit = 2.0;
constexpr double CoarseLimit = 20.0;
/// How far a vessel moves between phases that are neighbours in time: one standard deviation along each axis, mm.
constexpr double UsualStep = 8.0;
/// The reference is deformed as the phase before was found, then as this one was.
constexpr int CoarseRounds = 2;

/// Of the patch around a place of the reference, whose offsets are turned and stretched back.
std::vector<float> ValuesAround(const Vector3& place, const Matrix3& back, const Patch& patch,
  const AveragedVolume& volume, const ValueWindow& limits)
{
  std::vector<float> values;
  values.reserve(patch.places.size());
  for (std::size_t p = 0; p < patch.places.size(); ++p)
  {
    values.push_back(limits(volume.Sample(place + back * patch.Offset(p))));
  }
  return values;
}

/// What UsualStep says of every shift.
void PreferShort(const LabelLattice& lattice, std::vector<std::vector<float>>& costs)
{
  std::vector<float> far;
  for (int k = -lattice.reach; k <= lattice.reach; ++k)
  {
    for (int j = -lattice.reach; j <= lattice.reach; ++j)
    {
      for (int i = -lattice.reach; i <= lattice.reach; ++i)
      {
        const double steps = lattice.step / UsualStep;
        far.push_back(static_cast<float>(0.5 * steps * steps * (i * i + j * j + k * k)));
      }
    }
  }
  for (std::vector<float>& own : costs)
  {
    std::transform(own.begin(), own.end(), far.begin(), own.begin(), std::plus<>());
  }
}
}

void LineTracker::PlaceBox()
{
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
}

void LineTracker::LimitValues(std::vector<float> all)
{
  std::sort(all.begin(), all.end());
  const float median = all[all.size() / 2];
  const float spread =
    std::max(all[all.size() * 9 / 10] - all[all.size() / 10], static_cast<float>(this->Contrast));
  this->Limits = { median - spread, median + spread };
}

std::vector<std::vector<float>> LineTracker::CoarseCosts(const CoarseReference& reference,
  const AveragedVolume& moved, const LabelLattice& lattice, const std::vector<Vector3>& guess,
  const std::vector<Vector3>& places, const ProgressCallback& progress) const
{
  const auto nodes = static_cast<std::int64_t>(this->Nodes.size());
  const int blockReach = std::max(this->Coarse.reach, this->CoarseVessel.reach) + lattice.reach;
  const int blockSide = 2 * blockReach + 1;
  std::vector<std::vector<float>> costs(nodes);
  std::vector<std::vector<float>> ofVessels(nodes);
  ParallelFor(
    nodes, 4,
    [&](std::int64_t first, std::int64_t last)
    {
      std::vector<float> block(static_cast<std::size_t>(blockSide) * blockSide * blockSide);
      for (std::int64_t n = first; n < last; ++n)
      {
        const Vector3 centre = this->Nodes.position[n] + guess[n];
        const Matrix3 back = this->Deformation.At(static_cast<int>(n), places).inverse();
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
        SumsOfSquares(block, blockSide, this->Coarse, reference.weights[n],
          ValuesAround(this->Nodes.position[n], back, this->Coarse, reference.image, this->Limits),
          lattice.reach, costs[n]);
        if (this->Settings.tissue)
        {
          SumsOfSquares(block, blockSide, this->CoarseVessel, this->CoarseVessel.weights,
            ValuesAround(
              this->Nodes.position[n], back, this->CoarseVessel, reference.image, this->Limits),
            lattice.reach, ofVessels[n]);
        }
      }
    },
    progress);
  ToLikelihoods(
    costs, 30.0, this->Settings.tissue ? CoarseTissueLimit : CoarseLimit, 0.1 * this->NoiseFloor());
  if (this->Settings.tissue)
  {
    ToLikelihoods(ofVessels, 10.0, CoarseLimit, 0.1 * this->NoiseFloor());
    for (std::int64_t n = 0; n < nodes; ++n)
    {
      std::transform(
        costs[n].begin(), costs[n].end(), ofVessels[n].begin(), costs[n].begin(), std::plus<>());
    }
  }
  return costs;
}

void LineTracker::SearchCoarsely()
{
  const std::size_t phases = this->Times.size();
  const auto nodes = static_cast<std::int64_t>(this->Nodes.size());
  const LabelLattice lattice{ static_cast<int>(std::ceil(
                                this->Settings.captureRange / this->Settings.coarseSpacing)),
    this->Settings.coarseSpacing };
  this->PlaceBox();

  // The reference.
  CoarseReference reference;
  {
    const ScalarImage image = this->Read(this->ReferenceTime);
    this->Voxel = image.grid.spacing.maxCoeff();
    reference.image = AverageBlocks(image, this->Settings.coarseSpacing, this->Low, this->High);
    this->Reference = SparseVolume(image, this->Nodes.position, this->Keep());
  }
  this->MeasureContrast();
  reference.weights = this->Settings.tissue
    ? this->WithoutVessels(this->Coarse, 0.5 * this->Settings.coarseSpacing)
    : std::vector<std::vector<float>>(nodes, this->Coarse.weights);
  std::vector<float> all;
  constexpr ValueWindow any{ std::numeric_limits<float>::lowest(),
    std::numeric_limits<float>::max() };
  for (const Vector3& place : this->Nodes.position)
  {
    const std::vector<float> own =
      ValuesAround(place, Matrix3::Identity(), this->Coarse, reference.image, any);
    all.insert(all.end(), own.begin(), own.end());
  }
  this->LimitValues(std::move(all));

  this->SortPhases();
  const std::vector<std::ptrdiff_t> guesses = this->Guesses();
  this->Displacement.assign(phases, {});
  this->Volumes.resize(phases);
  const auto search = [&](
                        std::size_t position, const ScalarImage& image, const AveragedVolume& moved)
  {
    const std::size_t phase = this->Order[position];
    std::vector<Vector3> places = guesses[position] < 0
      ? std::vector<Vector3>(nodes, Vector3::Zero())
      : this->Displacement[this->Order[static_cast<std::size_t>(guesses[position])]];
    const std::vector<Vector3> guess = places;
    for (int round = 0; round < CoarseRounds; ++round)
    {
      std::vector<std::vector<float>> costs = this->CoarseCosts(reference, moved, lattice, guess,
        places,
        this->Part(
          0.6 * (static_cast<double>(position) + 0.3 + 0.35 * round) / static_cast<double>(phases),
          0.6 * (static_cast<double>(position) + 0.65 + 0.35 * round) /
            static_cast<double>(phases)));
      PreferShort(lattice, costs);
      const std::vector<Vector3> best = BestDisplacements(this->Nodes, lattice, costs, 0.5);
      for (std::int64_t n = 0; n < nodes; ++n)
      {
        places[n] = guess[n] + best[n];
      }
    }
    this->Volumes[phase] = SparseVolume(image, this->PlacesAt(places), this->Keep());
    return places;
  };
  for (std::size_t first = 0; first < phases; first += this->Sharing.AtOnce())
  {
    std::vector<std::size_t> open(std::min(phases - first, this->Sharing.AtOnce()));
    std::iota(open.begin(), open.end(), first);
    // Of these one is done here. Its image is read at once, and searched when the guess is known.
    ScalarImage image;
    AveragedVolume moved;
    this->Sharing.Results(open,
      [&](std::size_t position)
      {
        image = this->Read(this->Times[this->Order[position]]);
        moved = AverageBlocks(image, this->Settings.coarseSpacing, this->Low, this->High);
        return std::string();
      });
    while (!open.empty())
    {
      const auto waiting = std::stable_partition(open.begin(), open.end(),
        [&](std::size_t position)
        {
          const std::ptrdiff_t guess = guesses[position];
          return guess < 0 ||
            !this->Displacement[this->Order[static_cast<std::size_t>(guess)]].empty();
        });
      const std::vector<std::size_t> ready(open.begin(), waiting);
      open.erase(open.begin(), waiting);
      const std::vector<std::string> found = this->Sharing.Results(
        ready, [&](std::size_t position) { return Packed(search(position, image, moved)); });
      for (std::size_t n = 0; n < ready.size(); ++n)
      {
        Unpack(found[n], this->Displacement[this->Order[ready[n]]]);
      }
    }
  }
  const Seen seen{ this->Displacement,
    std::vector<std::vector<Matrix3>>(
      phases, std::vector<Matrix3>(nodes, Matrix3::Identity() / (1.5 * 1.5))),
    2.5 };
  this->Fit({ &seen });
}

void LineTracker::SortPhases()
{
  this->Order.resize(this->Times.size());
  std::iota(this->Order.begin(), this->Order.end(), std::size_t{ 0 });
  std::stable_sort(this->Order.begin(), this->Order.end(),
    [&](std::size_t a, std::size_t b)
    {
      return CyclicDistance(this->Times[a], this->ReferenceTime) <
        CyclicDistance(this->Times[b], this->ReferenceTime);
    });
}

std::vector<std::ptrdiff_t> LineTracker::Guesses() const
{
  std::vector<std::ptrdiff_t> guesses(this->Order.size(), -1);
  for (std::size_t position = 0; position < this->Order.size(); ++position)
  {
    const double time = this->Times[this->Order[position]];
    double nearest = CyclicDistance(time, this->ReferenceTime);
    for (std::size_t before = 0; before < position; ++before)
    {
      const double apart = CyclicDistance(time, this->Times[this->Order[before]]);
      if (apart < nearest)
      {
        nearest = apart;
        guesses[position] = static_cast<std::ptrdiff_t>(before);
      }
    }
  }
  return guesses;
}

std::vector<std::string> LineTracker::OfPhases(
  const std::function<std::string(std::size_t phase)>& measure) const
{
  // Each by its position in Order, one phase after the other.
  std::vector<std::size_t> items(this->Order.size());
  for (std::size_t position = 0; position < items.size(); ++position)
  {
    items[this->Order[position]] = position;
  }
  return this->Sharing.Results(
    items, [&](std::size_t position) { return measure(this->Order[position]); });
}

std::vector<std::vector<float>> LineTracker::WithoutVessels(const Patch& patch, double margin) const
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

LineTracker::Seen LineTracker::SearchFinely(bool vessels, double range, double progressFrom)
{
  const std::size_t phases = this->Times.size();
  const auto nodes = static_cast<std::int64_t>(this->Nodes.size());
  const LabelLattice lattice{ static_cast<int>(std::ceil(range)), 1.0 };
  const int blockReach = this->Fine.reach + lattice.reach;
  const int blockSide = 2 * blockReach + 1;
  const std::size_t samples = this->Fine.places.size();
  const std::vector<std::vector<float>> weights = vessels
    ? std::vector<std::vector<float>>(nodes, this->Fine.weights)
    : this->WithoutVessels(this->Fine, 0.8);
  const auto search = [&](std::size_t k)
  {
    std::vector<Matrix3> information(nodes, Matrix3::Zero());
    const std::vector<Vector3> places = this->PlacesAt(this->Displacement[k]);
    if (!std::all_of(places.begin(), places.end(),
          [&](const Vector3& place)
          { return this->Volumes[k].Covers(place, this->Settings.fineRadius + range); }))
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
      this->Part(progressFrom + 0.08 * static_cast<double>(k) / static_cast<double>(phases),
        progressFrom + 0.08 * static_cast<double>(k + 1) / static_cast<double>(phases)));
    const double noise = SignalCurvature::NoiseOf(curvature, averaged);
    std::vector<float> minimum(nodes);
    for (std::int64_t n = 0; n < nodes; ++n)
    {
      minimum[n] = *std::min_element(costs[n].begin(), costs[n].end());
    }
    ToLikelihoods(costs, 30.0, 15.0, 0.1 * this->NoiseFloor());
    std::vector<Vector3> displacement = BestDisplacements(this->Nodes, lattice, costs, 0.25);
    for (std::int64_t n = 0; n < nodes; ++n)
    {
      if (vessels)
      {
        // Is there a vessel where it was found?
        const Vector3& shift = displacement[n];
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
        information[n] = Matrix3::Identity() * (trust * trust / (0.6 * 0.6));
      }
      else
      {
        information[n] = Limited(SignalCurvature(curvature[n], noise / averaged[n]).Information() *
            (30.0 / std::max<double>(minimum[n], this->NoiseFloor())),
          std::max(TissueDeviation, 0.8 * this->Voxel));
      }
      displacement[n] += this->Displacement[k][n];
    }
    return Packed(displacement, information);
  };
  Seen seen{ PerPhase(phases), std::vector<std::vector<Matrix3>>(phases), 1.5 };
  const std::vector<std::string> results = this->OfPhases(search);
  for (std::size_t k = 0; k < phases; ++k)
  {
    Unpack(results[k], seen.displacement[k], seen.information[k]);
  }
  return seen;
}
}
