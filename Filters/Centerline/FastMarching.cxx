#include "FastMarching.h"

#include "HugeArray.h"
#include "KernelChoice.h"
#include "MarchingQueue.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <unordered_map>

namespace coronary
{
namespace
{
using Address = VoxelRegion::Address;

constexpr float Infinite = std::numeric_limits<float>::infinity();
constexpr double Third = 1.0 / 3.0;
constexpr std::uint32_t CheckInterval = 16384;
/// An array over all addresses of the box is faster, and not greater than one over the members
/// with what finding their numbers needs, up to this many addresses for each member.
constexpr double MostAddressesPerMember = 1.3;

// While marching the bits of an arrival say what a voxel is. As numbers without sign:
// final arrivals < not reached < not in the region < on the front (the sign is set).
constexpr std::uint32_t NotReached = 0x7f800000U; ///< infinity
constexpr std::uint32_t OutsideGrid = 0x7fffffffU;
constexpr std::uint32_t OnFront = 0x80000000U;

inline std::uint32_t BitsOf(float value)
{
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits;
}

inline float FromBits(std::uint32_t bits)
{
  float value;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

inline bool IsFinal(std::uint32_t bits)
{
  return bits < NotReached;
}

/// Arrays over all addresses.
struct DenseLayout
{
  std::size_t addresses;
  std::uint32_t operator()(Address address) const { return address; }
  std::size_t Size() const { return this->addresses; }
};

/// Arrays over the members, and one more entry for what is none.
struct SparseLayout
{
  const VoxelRegion* region;
  std::uint32_t outside;
  std::uint32_t operator()(Address address) const
  {
    const std::uint32_t number = this->region->Number(address);
    return number == VoxelRegion::notAMember ? this->outside : number;
  }
  std::size_t Size() const { return static_cast<std::size_t>(this->outside) + 1; }
};

/// The discrete equation: alpha (T - beta)^2 summed over the axes is the slowness squared. Axes
/// without a known neighbour have alpha 0. Values are relative to the newest known arrival, which
/// keeps the digits where the front is far from its source.
struct Terms
{
  double alpha[3]; ///< 1/mm^2
  double beta[3];
  double first[3]; ///< the neighbour's arrival
};

/// Solves without the latest neighbours, one after the other, that the front passes later.
__attribute__((noinline)) double SolveWithoutLatest(Terms& terms, double slowness)
{
  for (;;)
  {
    double a = 0.0;
    double b = 0.0;
    double c = -slowness * slowness;
    int latest = -1;
    int count = 0;
    for (int t = 0; t < 3; ++t)
    {
      if (terms.alpha[t] > 0.0)
      {
        a += terms.alpha[t];
        b += terms.alpha[t] * terms.beta[t];
        c += terms.alpha[t] * terms.beta[t] * terms.beta[t];
        latest = latest < 0 || terms.first[t] > terms.first[latest] ? t : latest;
        ++count;
      }
    }
    const double discriminant = b * b - a * c;
    const double value = discriminant >= 0.0 ? (b + std::sqrt(discriminant)) / a
                                             : -std::numeric_limits<double>::infinity();
    if (count <= 1 || value >= terms.first[latest])
    {
      return value;
    }
    // The front passes that neighbour later: it can not have come from there.
    terms.alpha[latest] = 0.0;
  }
}

/// @param latest  greatest of the known terms' first
inline double Solve(Terms& terms, double slowness, double latest)
{
  const double a = terms.alpha[0] + terms.alpha[1] + terms.alpha[2];
  const double weighted[3] = { terms.alpha[0] * terms.beta[0], terms.alpha[1] * terms.beta[1],
    terms.alpha[2] * terms.beta[2] };
  const double b = weighted[0] + weighted[1] + weighted[2];
  const double c = -slowness * slowness + weighted[0] * terms.beta[0] +
    weighted[1] * terms.beta[1] + weighted[2] * terms.beta[2];
  const double discriminant = b * b - a * c;
  const double value = (b + std::sqrt(discriminant)) / a;
  if (__builtin_expect(value >= latest, 1)) // false for what is not a number
  {
    return value;
  }
  return SolveWithoutLatest(terms, slowness);
}

/// Upwind differences of first and second order along the axes.
struct Differences
{
  double weight[3];      ///< 1/mm^2
  double distance[2][3]; ///< mm, of differences of first and second order

  explicit Differences(const Vector3& spacing)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      this->weight[axis] = 1.0 / (spacing[axis] * spacing[axis]);
      this->distance[0][axis] = spacing[axis];
      this->distance[1][axis] = spacing[axis] / 1.5;
    }
  }

  /// Which neighbours are known is as good as random: selections instead of branches.
  template <bool SecondOrder>
  inline __attribute__((always_inline)) void SetTerm(
    Terms& terms, int axis, std::uint32_t nearest, std::uint32_t beyond, double origin) const
  {
    const bool known = IsFinal(nearest);
    const float first = FromBits(nearest);
    terms.first[axis] = known ? first - origin : 0.0;
    terms.beta[axis] = terms.first[axis];
    terms.alpha[axis] = known ? this->weight[axis] : 0.0;
    if (SecondOrder)
    {
      const bool second = known && beyond <= nearest;
      const float difference = second ? first - FromBits(beyond) : 0.0F;
      terms.alpha[axis] *= second ? 2.25 : 1.0;
      terms.beta[axis] += difference * Third;
    }
  }
};

/// What is read of a neighbour, side by side.
struct Voxel
{
  std::uint32_t bits; ///< arrival, or what the voxel is
  float
    speedThenLength; ///< the speed is needed until the arrival is final, the length from then on
};

/// Not a prefetch: of many at a time the processor drops most.
inline __attribute__((always_inline)) void Load(const Voxel* voxels, std::uint32_t voxel)
{
  const std::uint32_t bits = voxels[voxel].bits;
  asm volatile("" : : "r"(bits)); // the compiler may not leave it out
}

/// The lines of memory that the update of a voxel's neighbours reads.
template <typename Layout>
inline __attribute__((always_inline)) void LoadAround(
  const VoxelRegion& region, const Layout& layout, const Voxel* voxels, Address address)
{
  Address outwards[3]; // to the nearest next cell
  for (int axis = 0; axis < 3; ++axis)
  {
    const std::array<Address, 4>& steps = region.Steps(address, axis);
    Load(voxels, layout(address + steps[0]));
    Load(voxels, layout(address + steps[3]));
    outwards[axis] = steps[(address >> axis & 1) != 0 ? 2 : 1];
  }
  for (int axis = 0; axis < 3; ++axis)
  {
    Load(voxels, layout(address + outwards[axis] + outwards[(axis + 1) % 3]));
  }
}

/// Two steps down, one down, one up, two up along each axis.
struct Neighbours
{
  std::uint32_t places[3][4];
  std::uint32_t bits[3][4];
};

/// Of the two voxels beside a voxel along each axis those that the front reached first.
struct Upwind
{
  std::uint32_t nearest[3];
  bool up[3];
  std::uint32_t earliest = 0; ///< axis

  inline __attribute__((always_inline)) explicit Upwind(const Neighbours& around)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      this->up[axis] = around.bits[axis][2] < around.bits[axis][1];
      this->nearest[axis] = this->up[axis] ? around.bits[axis][2] : around.bits[axis][1];
    }
    this->earliest = this->nearest[1] < this->nearest[0] ? 1 : 0;
    this->earliest = this->nearest[2] < this->nearest[this->earliest] ? 2 : this->earliest;
  }

  std::uint32_t Earliest(const Neighbours& around) const
  {
    return around.places[this->earliest][this->up[this->earliest] ? 2 : 1];
  }
};

/// Length of the fastest path to a voxel whose arrival is final.
template <bool SecondOrder>
inline __attribute__((always_inline)) float PathLength(const Voxel* voxels, std::uint32_t voxel,
  const Neighbours& around, const Upwind& upwind, const Differences& differences)
{
  std::uint32_t latestBits = 0;
  for (int axis = 0; axis < 3; ++axis)
  {
    latestBits = std::max(latestBits, IsFinal(upwind.nearest[axis]) ? upwind.nearest[axis] : 0U);
  }
  const double origin = FromBits(latestBits);
  Terms terms;
  double along[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    const std::uint32_t beyond = upwind.up[axis] ? around.bits[axis][3] : around.bits[axis][0];
    differences.SetTerm<SecondOrder>(terms, axis, upwind.nearest[axis], beyond, origin);
    const bool known = IsFinal(upwind.nearest[axis]);
    const double length = voxels[around.places[axis][upwind.up[axis] ? 2 : 1]].speedThenLength;
    along[axis] = known ? length : 0.0;
    if (SecondOrder)
    {
      const bool second = known && beyond <= upwind.nearest[axis];
      const double former = voxels[around.places[axis][upwind.up[axis] ? 3 : 0]].speedThenLength;
      along[axis] += second ? (length - former) * Third : 0.0;
    }
  }
  const double value = Solve(terms, 1.0 / static_cast<double>(voxels[voxel].speedThenLength), 0.0);
  // The path comes along the gradient: the derivative of its length in that direction is 1.
  double sum = 0.0;
  double weighted = 0.0;
  double norm = 0.0;
  for (int axis = 0; axis < 3; ++axis)
  {
    const double rise = std::max(0.0, value - terms.beta[axis]);
    sum += terms.alpha[axis] * rise;
    weighted += terms.alpha[axis] * rise * along[axis];
    norm += terms.alpha[axis] * rise * rise;
  }
  return sum > 0.0 ? static_cast<float>((weighted + std::sqrt(norm)) / sum)
                   : voxels[upwind.Earliest(around)].speedThenLength;
}

/// The march itself.
template <typename Layout>
class Front
{
public:
  Front(const VoxelRegion& region, const FastMarchingSettings& settings,
    const ProgressCallback& progress, const Layout& layout, double bucketWidth, bool oneLabel)
    : Region(region)
    , Settings(settings)
    , Progress(progress)
    , Place(layout)
    , Queue(bucketWidth)
    , Voxels(layout.Size(), { OutsideGrid, 1.0F })
    , Labels(oneLabel ? 0 : layout.Size(), FastMarching::noSource)
    , OneLabel(oneLabel)
  {
  }
  void Seed(const FastMarchingSource& source);
  void Run();
  std::size_t MemorySize() const
  {
    return this->Voxels.MemorySize() + this->Labels.MemorySize() + this->Queue.MemorySize();
  }

private:
  template <bool SecondOrder, bool WithLengths>
  void RunAs();
  void RunAny();
  void RunWithAvx2();

  const VoxelRegion& Region;
  const FastMarchingSettings& Settings;
  const ProgressCallback& Progress;
  Layout Place;

public:
  MarchingQueue Queue;
  HugeArray<Voxel> Voxels;
  HugeArray<std::uint8_t> Labels; ///< empty if all sources have the same

private:
  bool OneLabel;
  /// Lengths of what is on the front and was taken along straight lines from a source.
  std::unordered_map<std::uint32_t, float> Fixed;
};

template <typename Layout>
void Front<Layout>::Seed(const FastMarchingSource& source)
{
  const Vector3& spacing = this->Settings.spacing;
  Voxel* const voxels = this->Voxels.Data();
  const double reach =
    this->Settings.sourceRadius > 0.0 ? this->Settings.sourceRadius : 3.0 * spacing.maxCoeff();
  const std::array<int, 6>& box = this->Region.Box();
  std::array<int, 6> range;
  for (int axis = 0; axis < 3; ++axis)
  {
    const double steps = reach / spacing[axis];
    const double low = std::max<double>(box[2 * axis], std::ceil(source.index[axis] - steps));
    const double high = std::min<double>(box[2 * axis + 1], std::floor(source.index[axis] + steps));
    if (high < low)
    {
      return;
    }
    range[2 * axis] = static_cast<int>(low);
    range[2 * axis + 1] = static_cast<int>(high);
  }
  for (int k = range[4]; k <= range[5]; ++k)
  {
    for (int j = range[2]; j <= range[3]; ++j)
    {
      for (int i = range[0]; i <= range[1]; ++i)
      {
        const Address address = this->Region.AddressOf(i, j, k);
        const Vector3 offset = Vector3(i, j, k) - source.index;
        const double distance = spacing.cwiseProduct(offset).norm();
        if (this->Region.Number(address) == VoxelRegion::notAMember || distance > reach)
        {
          continue;
        }
        const std::uint32_t voxel = this->Place(address);
        // The slowness along the straight line, unless that leaves the region. The source itself
        // may lie beside it.
        const int pieces =
          std::max(1, static_cast<int>(std::ceil(2.0 * offset.cwiseAbs().maxCoeff())));
        double slowness = 0.0;
        bool inside = true;
        for (int piece = 0; piece < pieces && inside; ++piece)
        {
          const Vector3 step = (piece + 0.5) / pieces * offset;
          const Vector3 at = source.index + step;
          const std::array<int, 3> index = { static_cast<int>(std::lround(at[0])),
            static_cast<int>(std::lround(at[1])), static_cast<int>(std::lround(at[2])) };
          const bool member =
            this->Region.NumberOf(index[0], index[1], index[2]) != VoxelRegion::notAMember;
          inside = member || step.cwiseAbs().maxCoeff() <= 0.75;
          slowness += 1.0 /
            static_cast<double>(
              voxels[member ? this->Place(this->Region.AddressOf(index[0], index[1], index[2]))
                            : voxel]
                .speedThenLength);
        }
        const auto arrival = static_cast<float>(distance * slowness / pieces);
        const std::uint32_t before = voxels[voxel].bits;
        if (!inside || !(arrival < Infinite) ||
          (before != NotReached && FromBits(before & ~OnFront) <= arrival))
        {
          continue;
        }
        this->Fixed[voxel] = static_cast<float>(distance);
        if (!this->OneLabel)
        {
          this->Labels.Data()[voxel] = static_cast<std::uint8_t>(source.label);
        }
        voxels[voxel].bits = BitsOf(arrival) | OnFront;
        this->Queue.Push(MarchingQueue::MakeEntry(BitsOf(arrival), address));
      }
    }
  }
}

template <typename Layout>
template <bool SecondOrder, bool WithLengths>
inline __attribute__((always_inline)) void Front<Layout>::RunAs()
{
  const VoxelRegion& region = this->Region;
  const Layout layout = this->Place;
  MarchingQueue& queue = this->Queue;
  Voxel* const voxels = this->Voxels.Data();
  std::uint8_t* const labels = this->Labels.Data();
  const bool oneLabel = this->OneLabel;
  const Differences differences(this->Settings.spacing);
  const auto bitsAt = [voxels](std::uint32_t voxel) { return voxels[voxel].bits; };
  const auto keep = [&](MarchingQueue::Entry entry)
  {
    return bitsAt(layout(MarchingQueue::Address(entry))) ==
      (MarchingQueue::ArrivalBits(entry) | OnFront);
  };
  const auto expect = [&](MarchingQueue::Entry entry)
  { Load(voxels, layout(MarchingQueue::Address(entry))); };
  const auto prepare = [&](MarchingQueue::Entry entry)
  { LoadAround(region, layout, voxels, MarchingQueue::Address(entry)); };

  std::uint32_t reached = 0;
  while (queue.Find(keep, expect, prepare))
  {
    if (reached % CheckInterval == CheckInterval - 1)
    {
      Report(this->Progress, static_cast<double>(reached) / region.Size());
    }
    const MarchingQueue::Entry entry = queue.Minimum();
    const float arrival = MarchingQueue::Arrival(entry);
    const std::uint32_t arrivalBits = MarchingQueue::ArrivalBits(entry);
    const Address address = MarchingQueue::Address(entry);
    queue.RemoveMinimum();
    ++reached;
    const std::uint32_t voxel = layout(address);
    voxels[voxel].bits = arrivalBits;

    Neighbours around;
    for (int axis = 0; axis < 3; ++axis)
    {
      const std::array<Address, 4>& steps = region.Steps(address, axis);
      for (int step = 0; step < 4; ++step)
      {
        around.places[axis][step] = layout(address + steps[step]);
        around.bits[axis][step] = bitsAt(around.places[axis][step]);
      }
    }

    const auto fixed = this->Fixed.empty() ? this->Fixed.end() : this->Fixed.find(voxel);
    if (fixed != this->Fixed.end())
    {
      if (WithLengths)
      {
        voxels[voxel].speedThenLength = fixed->second;
      }
      this->Fixed.erase(fixed);
    }
    else
    {
      const Upwind upwind(around);
      if (!oneLabel)
      {
        labels[voxel] = labels[upwind.Earliest(around)];
      }
      if (WithLengths)
      {
        voxels[voxel].speedThenLength =
          PathLength<SecondOrder>(voxels, voxel, around, upwind, differences);
      }
    }

    for (int axis = 0; axis < 3; ++axis)
    {
      for (int side = 0; side < 2; ++side)
      {
        const std::uint32_t before = around.bits[axis][1 + side];
        const std::uint32_t opposite = around.bits[axis][3 * side];
        // Final, outside, or known already from its other side: then this one changes nothing.
        if (IsFinal(before) || before == OutsideGrid || opposite < arrivalBits)
        {
          continue;
        }
        const std::uint32_t other = around.places[axis][1 + side];
        const Address otherAddress = address + region.Steps(address, axis)[1 + side];
        const double slowness = 1.0 / static_cast<double>(voxels[other].speedThenLength);
        const std::uint32_t behind = around.bits[axis][2 - side];
        double value;
        if (before == NotReached)
        {
          // No other neighbour is known.
          const bool second = SecondOrder && behind <= arrivalBits;
          const float difference = second ? arrival - FromBits(behind) : 0.0F;
          value = slowness * differences.distance[second ? 1 : 0][axis] + difference * Third;
        }
        else
        {
          Terms terms;
          for (int a = 0; a < 3; ++a)
          {
            const std::array<Address, 4>& steps = region.Steps(otherAddress, a);
            const std::uint32_t below = bitsAt(layout(otherAddress + steps[1]));
            const std::uint32_t above = bitsAt(layout(otherAddress + steps[2]));
            const bool up = above < below;
            const std::uint32_t beyond = bitsAt(layout(otherAddress + (up ? steps[3] : steps[0])));
            differences.SetTerm<SecondOrder>(terms, a, up ? above : below, beyond, arrival);
          }
          value = Solve(terms, slowness, 0.0);
        }
        // Never before the voxel that it comes from: rounding, and differences of second order.
        const auto there = static_cast<float>(value + arrival);
        const std::uint32_t after = BitsOf(there > arrival ? there : arrival) | OnFront;
        if (after == before || after == (NotReached | OnFront))
        {
          continue;
        }
        // A value from more neighbours replaces an earlier one even where it is later; but the
        // straight lines around a source are better than any difference.
        if (!this->Fixed.empty())
        {
          const auto straight = this->Fixed.find(other);
          if (straight != this->Fixed.end())
          {
            if (after >= before || oneLabel || labels[other] == labels[voxel])
            {
              continue;
            }
            this->Fixed.erase(straight);
          }
        }
        voxels[other].bits = after;
        queue.Push(MarchingQueue::MakeEntry(after & ~OnFront, otherAddress));
      }
    }
  }
  Report(this->Progress, 1.0);
}

template <typename Layout>
inline __attribute__((always_inline)) void Front<Layout>::RunAny()
{
  if (this->Settings.secondOrder)
  {
    return this->Settings.lengths ? this->RunAs<true, true>() : this->RunAs<true, false>();
  }
  return this->Settings.lengths ? this->RunAs<false, true>() : this->RunAs<false, false>();
}

#if defined(__x86_64__)
template <typename Layout>
__attribute__((target("avx2,bmi,bmi2,popcnt"))) void Front<Layout>::RunWithAvx2()
{
  return this->RunAny();
}
#endif

template <typename Layout>
void Front<Layout>::Run()
{
#if defined(__x86_64__)
  // Shorter code, and counting the bits of a word is one instruction. Without fused multiplication:
  // the same result to the bit on any processor.
  if (ProcessorHas(Instructions::Avx2))
  {
    return this->RunWithAvx2();
  }
#endif
  return this->RunAny();
}

/// A hundredth of the time from voxel to voxel; the queue corrects it.
double BucketWidth(const std::vector<float>& speeds, const Vector3& spacing)
{
  const std::size_t step = speeds.size() / 1000 + 1;
  double slowness = 0.0;
  std::size_t count = 0;
  for (std::size_t number = 0; number < speeds.size(); number += step)
  {
    slowness += 1.0 / static_cast<double>(speeds[number]);
    ++count;
  }
  return 0.01 * spacing.minCoeff() * slowness / static_cast<double>(count);
}
}

FastMarching::FastMarching(const VoxelRegion& region, std::vector<float> speed,
  const FastMarchingSettings& settings, const ProgressCallback& progress)
  : Region(region)
  , Settings(settings)
  , Progress(progress)
  , Speeds(std::move(speed))
{
  constexpr RequireOf require{ "FastMarching" };
  require(
    settings.spacing.allFinite() && settings.spacing.minCoeff() > 0.0, "spacing must be positive");
  require(settings.sourceRadius >= 0.0 && std::isfinite(settings.sourceRadius),
    "sourceRadius must not be negative");
  require(this->Speeds.size() == region.Size(), "one speed for each voxel of the region is needed");
  require(std::all_of(this->Speeds.begin(), this->Speeds.end(),
            [](float value) { return value > 0.0F && value < Infinite; }),
    "FastMarching: speeds must be positive and finite");
}

void FastMarching::March(const std::vector<FastMarchingSource>& sources)
{
  constexpr RequireOf require{ "FastMarching" };
  const std::uint32_t count = this->Region.Size();
  if (this->Speeds.size() != count)
  {
    throw std::logic_error("FastMarching: a march can not be repeated");
  }
  for (const FastMarchingSource& source : sources)
  {
    require(source.label >= 0 && source.label < noSource, "labels must be 0 to 254");
    require(source.index.allFinite(), "sources must be finite");
  }
  if (count == 0)
  {
    return;
  }
  if (static_cast<double>(this->Region.AddressCount()) <= MostAddressesPerMember * count)
  {
    return this->MarchIn(DenseLayout{ this->Region.AddressCount() }, sources);
  }
  return this->MarchIn(SparseLayout{ &this->Region, count }, sources);
}

template <typename Layout>
void FastMarching::MarchIn(const Layout& layout, const std::vector<FastMarchingSource>& sources)
{
  const std::uint32_t count = this->Region.Size();
  const bool oneLabel = std::all_of(sources.begin(), sources.end(),
    [&](const FastMarchingSource& source) { return source.label == sources.front().label; });
  Front<Layout> front(this->Region, this->Settings, this->Progress, layout,
    BucketWidth(this->Speeds, this->Settings.spacing), oneLabel);
  this->Region.ForEach(
    [&](std::uint32_t number, Address address) {
      front.Voxels.Data()[layout(address)] = { NotReached, this->Speeds[number] };
    });
  std::vector<float>().swap(this->Speeds);
  for (const FastMarchingSource& source : sources)
  {
    front.Seed(source);
  }
  front.Run();

  this->Times.resize(count);
  this->Lengths.resize(this->Settings.lengths ? count : 0);
  this->Peak =
    front.MemorySize() + (this->Times.capacity() + this->Lengths.capacity()) * sizeof(float);
  this->Region.ForEach(
    [&](std::uint32_t number, Address address)
    {
      // What is still on the front has no final value.
      const Voxel& voxel = front.Voxels.Data()[layout(address)];
      const bool final = IsFinal(voxel.bits);
      this->Times[number] = final ? FromBits(voxel.bits) : Infinite;
      if (this->Settings.lengths)
      {
        this->Lengths[number] = final ? voxel.speedThenLength : Infinite;
      }
    });
  front.Voxels.Clear();
  this->Labels.resize(count);
  const auto only = static_cast<std::uint8_t>(sources.empty() ? 0 : sources.front().label);
  this->Region.ForEach(
    [&](std::uint32_t number, Address address)
    {
      const std::uint8_t label = oneLabel ? only : front.Labels.Data()[layout(address)];
      this->Labels[number] = this->Times[number] < Infinite ? label : noSource;
    });
}

std::size_t FastMarching::MemorySize() const
{
  return this->Region.MemorySize() +
    std::max(this->Peak,
      this->Speeds.capacity() * sizeof(float) + this->Times.capacity() * sizeof(float) +
        this->Lengths.capacity() * sizeof(float) + this->Labels.capacity());
}
}
