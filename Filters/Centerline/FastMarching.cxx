#include "FastMarching.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
constexpr float Infinite = std::numeric_limits<float>::infinity();
constexpr std::uint32_t NotOnFront = 0xffffffffU;
constexpr std::uint32_t Children = 4; ///< of a heap's node: flatter than 2, one cache line
constexpr std::uint32_t CheckInterval = 16384;

void Require(bool condition, const char* requirement)
{
  if (!condition)
  {
    throw std::invalid_argument(std::string("FastMarching: ") + requirement);
  }
}

/// One axis of the discrete equation: alpha (T - beta)^2 summed over the axes is the slowness squared.
struct Term
{
  double alpha;  ///< 1/mm^2
  double beta;   ///< relative to the newest arrival
  double first;  ///< the neighbour's arrival, relative as well
  double length; ///< as beta, of the length
};
}

FastMarching::FastMarching(const VoxelRegion& region, std::vector<float> speed,
  const FastMarchingSettings& settings, const ProgressCallback& progress)
  : Region(region)
  , Settings(settings)
  , Progress(progress)
  , Speeds(std::move(speed))
{
  Require(
    settings.spacing.allFinite() && settings.spacing.minCoeff() > 0.0, "spacing must be positive");
  Require(settings.sourceRadius >= 0.0 && std::isfinite(settings.sourceRadius),
    "sourceRadius must not be negative");
  Require(!(settings.stopAtArrival < 0.0), "stopAtArrival must not be negative");
  Require(this->Speeds.size() == region.Size(), "one speed for each voxel of the region is needed");
  Require(std::all_of(this->Speeds.begin(), this->Speeds.end(),
            [](float value) { return value > 0.0F && value < Infinite; }),
    "speeds must be positive and finite");
}

inline void FastMarching::Place(std::uint32_t at, const Entry& entry)
{
  this->Heap[at] = entry;
  this->Positions[entry.number] = at;
}

inline void FastMarching::SiftUp(std::uint32_t at, const Entry& entry)
{
  while (at > 0)
  {
    const std::uint32_t parent = (at - 1) / Children;
    if (!(entry.key < this->Heap[parent].key))
    {
      break;
    }
    this->Place(at, this->Heap[parent]);
    at = parent;
  }
  this->Place(at, entry);
}

inline void FastMarching::SiftDown(std::uint32_t at, const Entry& entry)
{
  const auto size = static_cast<std::uint32_t>(this->Heap.size());
  for (;;)
  {
    const std::uint32_t first = at * Children + 1;
    if (first >= size)
    {
      break;
    }
    std::uint32_t least = first;
    const std::uint32_t end = std::min(first + Children, size);
    for (std::uint32_t child = first + 1; child < end; ++child)
    {
      least = this->Heap[child].key < this->Heap[least].key ? child : least;
    }
    if (!(this->Heap[least].key < entry.key))
    {
      break;
    }
    this->Place(at, this->Heap[least]);
    at = least;
  }
  this->Place(at, entry);
}

void FastMarching::Seed(const FastMarchingSource& source)
{
  const Vector3& spacing = this->Settings.spacing;
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
  const auto numberAt = [&](const Vector3& index)
  {
    return this->Region.NumberOf(static_cast<int>(std::lround(index[0])),
      static_cast<int>(std::lround(index[1])), static_cast<int>(std::lround(index[2])));
  };
  for (int k = range[4]; k <= range[5]; ++k)
  {
    for (int j = range[2]; j <= range[3]; ++j)
    {
      for (int i = range[0]; i <= range[1]; ++i)
      {
        const VoxelRegion::Address address = this->Region.AddressOf(i, j, k);
        const std::uint32_t number = this->Region.Number(address);
        const Vector3 offset = Vector3(i, j, k) - source.index;
        const double distance = spacing.cwiseProduct(offset).norm();
        if (number == VoxelRegion::notAMember || distance > reach)
        {
          continue;
        }
        // The slowness along the straight line, unless that leaves the region. The source itself
        // may lie beside it.
        const int pieces =
          std::max(1, static_cast<int>(std::ceil(2.0 * offset.cwiseAbs().maxCoeff())));
        double slowness = 0.0;
        bool inside = true;
        for (int piece = 0; piece < pieces && inside; ++piece)
        {
          const Vector3 step = (piece + 0.5) / pieces * offset;
          const std::uint32_t here = numberAt(source.index + step);
          const bool member = here != VoxelRegion::notAMember;
          inside = member || step.cwiseAbs().maxCoeff() <= 0.75;
          slowness += 1.0 / static_cast<double>(this->Speeds[member ? here : number]);
        }
        const auto arrival = static_cast<float>(distance * slowness / pieces);
        const std::uint32_t position = this->Positions[number];
        if (!inside || (position != NotOnFront && this->Heap[position].key <= arrival))
        {
          continue;
        }
        this->Labels[number] = static_cast<std::uint8_t>(source.label);
        this->Fixed[number] = true;
        if (this->Settings.lengths)
        {
          this->Lengths[number] = static_cast<float>(distance);
        }
        const Entry entry{ arrival, number, address };
        if (position == NotOnFront)
        {
          this->Heap.push_back(entry);
        }
        this->SiftUp(
          position == NotOnFront ? static_cast<std::uint32_t>(this->Heap.size()) - 1 : position,
          entry);
      }
    }
  }
}

bool FastMarching::March(const std::vector<FastMarchingSource>& sources)
{
  const std::size_t count = this->Region.Size();
  this->Times.assign(count + 1, Infinite);
  this->Labels.assign(count, noSource);
  this->Lengths.assign(this->Settings.lengths ? count + 1 : 0, Infinite);
  this->Positions.assign(count, NotOnFront);
  this->Fixed.assign(count, false);
  this->Heap.clear();
  for (const FastMarchingSource& source : sources)
  {
    Require(source.label >= 0 && source.label < noSource, "labels must be 0 to 254");
    Require(source.index.allFinite(), "sources must be finite");
    this->Seed(source);
  }
  const bool exhausted = this->RunFastest();
  // What is still on the front has no final value.
  for (const Entry& entry : this->Heap)
  {
    this->Labels[entry.number] = noSource;
    if (this->Settings.lengths)
    {
      this->Lengths[entry.number] = Infinite;
    }
  }
  this->Times.resize(count);
  this->Lengths.resize(this->Settings.lengths ? count : 0);
  this->HeapPeak = this->Heap.capacity();
  std::vector<Entry>().swap(this->Heap);
  std::vector<std::uint32_t>().swap(this->Positions);
  std::vector<bool>().swap(this->Fixed);
  return exhausted;
}

template <bool SecondOrder, bool WithLengths>
inline __attribute__((always_inline)) bool FastMarching::Run()
{
  using Address = VoxelRegion::Address;
  constexpr std::uint32_t none = VoxelRegion::notAMember;
  const VoxelRegion& region = this->Region;
  float* const times = this->Times.data();
  float* const lengths = this->Lengths.data();
  const double limit = this->Settings.stopAtArrival;
  double weight[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    weight[axis] = 1.0 / (this->Settings.spacing[axis] * this->Settings.spacing[axis]);
  }

  // A voxel that is no member reads as one that is never reached.
  const std::uint32_t outside = region.Size();
  const auto numberOr = [&region, outside](Address address)
  {
    const std::uint32_t number = region.Number(address);
    return number == none ? outside : number;
  };

  std::uint32_t reached = 0;
  while (!this->Heap.empty())
  {
    if (reached % CheckInterval == CheckInterval - 1)
    {
      Report(this->Progress, static_cast<double>(reached) / region.Size());
      if (this->Settings.goOn && !this->Settings.goOn(reached))
      {
        return false;
      }
    }
    const Entry nearest = this->Heap.front();
    if (nearest.key > limit)
    {
      return false;
    }
    const Entry last = this->Heap.back();
    this->Heap.pop_back();
    if (!this->Heap.empty())
    {
      this->SiftDown(0, last);
    }
    ++reached;
    times[nearest.number] = nearest.key;
    this->Positions[nearest.number] = NotOnFront;

    for (int side = 0; side < 6; ++side)
    {
      const Address address = side % 2 == 0 ? region.Below(nearest.address, side / 2)
                                            : region.Above(nearest.address, side / 2);
      const std::uint32_t number = region.Number(address);
      if (number == none || times[number] < Infinite)
      {
        continue;
      }

      // Upwind differences along each axis that has a known neighbour. Values are taken relative
      // to the newest arrival, which keeps the digits where the front is far from its source.
      // Which neighbours are known is as good as random: selections instead of branches.
      const double origin = nearest.key;
      Term terms[3];
      int count = 0;
      for (int axis = 0; axis < 3; ++axis)
      {
        const Address before = region.Below(address, axis);
        const Address after = region.Above(address, axis);
        const std::uint32_t below = numberOr(before);
        const std::uint32_t above = numberOr(after);
        const bool down = times[below] <= times[above];
        const std::uint32_t neighbour = down ? below : above;
        const float first = times[neighbour];
        Term& term = terms[count];
        term.alpha = weight[axis];
        term.first = first - origin;
        term.beta = term.first;
        term.length = WithLengths ? lengths[neighbour] : 0.0F;
        if (SecondOrder)
        {
          const std::uint32_t beyond =
            numberOr(down ? region.Below(before, axis) : region.Above(after, axis));
          const float second = times[beyond];
          const double known = second <= first ? 1.0 : 0.0;
          const double difference = second <= first ? first - second : 0.0F;
          term.alpha *= 1.0 + 1.25 * known;
          term.beta += difference / 3.0;
          if (WithLengths)
          {
            term.length +=
              known > 0.0 ? (term.length - static_cast<double>(lengths[beyond])) / 3.0 : 0.0;
          }
        }
        count += first < Infinite ? 1 : 0;
      }

      const double slowness = 1.0 / static_cast<double>(this->Speeds[number]);
      double value = 0.0;
      for (;;)
      {
        double a = 0.0;
        double b = 0.0;
        double c = -slowness * slowness;
        int latest = 0;
        for (int t = 0; t < count; ++t)
        {
          a += terms[t].alpha;
          b += terms[t].alpha * terms[t].beta;
          c += terms[t].alpha * terms[t].beta * terms[t].beta;
          latest = terms[t].first > terms[latest].first ? t : latest;
        }
        const double discriminant = b * b - a * c;
        value = discriminant >= 0.0 ? (b + std::sqrt(discriminant)) / a
                                    : -std::numeric_limits<double>::infinity();
        if (count == 1 || value >= terms[latest].first)
        {
          break;
        }
        // The front passes that neighbour later: it can not have come from there.
        terms[latest] = terms[--count];
      }
      // Never before the voxel that it comes from: rounding, and differences of second order.
      const float arrival = std::max(static_cast<float>(value + origin), nearest.key);

      // A value from more neighbours replaces an earlier one even where it is later; but the
      // straight lines around a source are better than any difference.
      const std::uint32_t position = this->Positions[number];
      const bool sooner = position == NotOnFront || arrival < this->Heap[position].key;
      if (this->Fixed[number] && (!sooner || this->Labels[number] == this->Labels[nearest.number]))
      {
        continue;
      }
      this->Labels[number] = this->Labels[nearest.number];
      if (WithLengths)
      {
        // The path comes along the gradient: the derivative of its length in that direction is 1.
        double sum = 0.0;
        double weighted = 0.0;
        double norm = 0.0;
        for (int t = 0; t < count; ++t)
        {
          const double rise = std::max(0.0, value - terms[t].beta);
          sum += terms[t].alpha * rise;
          weighted += terms[t].alpha * rise * terms[t].length;
          norm += terms[t].alpha * rise * rise;
        }
        lengths[number] = sum > 0.0 ? static_cast<float>((weighted + std::sqrt(norm)) / sum)
                                    : lengths[nearest.number];
      }
      const Entry entry{ arrival, number, address };
      if (position == NotOnFront)
      {
        this->Heap.push_back(entry);
        this->SiftUp(static_cast<std::uint32_t>(this->Heap.size()) - 1, entry);
      }
      else if (sooner)
      {
        this->SiftUp(position, entry);
      }
      else
      {
        this->SiftDown(position, entry);
      }
    }
  }
  Report(this->Progress, 1.0);
  return true;
}

inline __attribute__((always_inline)) bool FastMarching::RunAny()
{
  if (this->Settings.secondOrder)
  {
    return this->Settings.lengths ? this->Run<true, true>() : this->Run<true, false>();
  }
  return this->Settings.lengths ? this->Run<false, true>() : this->Run<false, false>();
}

#if defined(__x86_64__)
__attribute__((target("popcnt"))) bool FastMarching::RunCountingBits()
{
  return this->RunAny();
}
#endif

bool FastMarching::RunFastest()
{
#if defined(__x86_64__)
  // Counting the bits of a word is one instruction on any processor since 2008, but the compiler
  // may not assume it.
  if (__builtin_cpu_supports("popcnt"))
  {
    return this->RunCountingBits();
  }
#endif
  return this->RunAny();
}

std::size_t FastMarching::MemorySize() const
{
  return this->Region.MemorySize() + this->Speeds.capacity() * sizeof(float) +
    this->Times.capacity() * sizeof(float) + this->Lengths.capacity() * sizeof(float) +
    this->Labels.capacity() + this->Times.capacity() * sizeof(std::uint32_t) +
    this->Times.capacity() / 8 + this->HeapPeak * sizeof(Entry);
}
}
