#include "ContrastTracers.h"

#include "CounterRandom.h"
#include "CyclicTime.h"
#include "Fnv1a.h"
#include "KernelChoice.h"
#include "Numbers.h"
#include "Require.h"
#include "VesselFrames.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double DirectionLength = 3.0; // mm over which a branch's direction at a node is taken
constexpr std::size_t BatchSize = 64;   // of crossings
constexpr int CellsOfSegment = 64;      // for thinning
constexpr int Crossings = 1000;         // of segments in a step; more are short of a fault

constexpr RequireOf RequireTracers{ "contrast tracers" };

/// Part of the flux of laminar flow through the unit circle that is on the side of x below h.
double ExactFluxBelow(double h)
{
  const double x = std::clamp(h, -1.0, 1.0);
  return 0.5 + (x * (5.0 - 2.0 * x * x) * std::sqrt(1.0 - x * x) + 3.0 * std::asin(x)) / (3.0 * Pi);
}

/// Part of the flux of a chord's points that is below y of its half length.
double ExactChordFluxBelow(double y)
{
  return (2.0 + 3.0 * y - y * y * y) / 4.0;
}

constexpr int TableSize = 1024;
using Table = std::array<float, TableSize + 1>;

/// Between the table's values, place from 0 to 1.
float Interpolate(const Table& table, float place)
{
  const float t = place * TableSize;
  const int k = std::min(static_cast<int>(t), TableSize - 1);
  return table[k] + (t - static_cast<float>(k)) * (table[k + 1] - table[k]);
}

/// Inverse of a part of the flux that grows from 0 at -1 to 1 at 1, the same on both sides. By the root of the flux, as
/// the inverse is not smooth at the ends.
class InverseTable
{
public:
  explicit InverseTable(double (*fluxBelow)(double))
  {
    for (int k = 0; k <= TableSize; ++k)
    {
      const double root = k * std::sqrt(0.5) / TableSize;
      double low = -1.0;
      double high = 0.0;
      for (int step = 0; step < 60; ++step)
      {
        const double middle = 0.5 * (low + high);
        (fluxBelow(middle) < root * root ? low : high) = middle;
      }
      this->Values[k] = static_cast<float>(0.5 * (low + high));
    }
  }
  float operator()(float flux) const
  {
    const float less = std::max(0.0F, std::min(flux, 1.0F - flux));
    return std::copysign(Interpolate(this->Values, std::sqrt(2.0F * less)), flux - 0.5F);
  }

private:
  Table Values{};
};

/// ExactFluxBelow and its inverse to 1e-6 and 1e-4: hundreds of tracers cross nodes in a step.
struct FluxTables
{
  FluxTables()
  {
    for (int k = 0; k <= TableSize; ++k)
    {
      this->flux[k] = static_cast<float>(ExactFluxBelow(2.0 * k / TableSize - 1.0));
    }
  }
  float FluxBelow(float x) const
  {
    return Interpolate(this->flux, 0.5F * (std::max(-1.0F, std::min(x, 1.0F)) + 1.0F));
  }
  Table flux{};
  InverseTable chordOf{ ExactFluxBelow };
  InverseTable placeOnChord{ ExactChordFluxBelow }; ///< of its half length
};

const FluxTables& Tables()
{
  static const FluxTables tables;
  return tables;
}

/// Speed as a part of that on the axis.
template <typename Place>
double Inside(const Place& place)
{
  return 1.0 - static_cast<double>(place.x) * place.x - static_cast<double>(place.y) * place.y;
}

/// Keeps a tracer off the wall itself, where nothing moves.
void KeepInside(float& x, float& y)
{
  constexpr float maximum = 0.9999F;
  const float square = x * x + y * y;
  if (square > maximum * maximum)
  {
    const float scale = maximum / std::sqrt(square);
    x *= scale;
    y *= scale;
  }
}

Vector3 AxisPoint(const FlowNetwork& network, int branch, double abscissa)
{
  const std::vector<double>& s = network.Branches()[branch].abscissa;
  const std::vector<Vector3>& axis = network.Topology().axis[branch];
  const auto k =
    std::clamp<std::ptrdiff_t>(std::upper_bound(s.begin(), s.end(), abscissa) - s.begin(), 1,
      static_cast<std::ptrdiff_t>(s.size()) - 1);
  const double length = s[k] - s[k - 1];
  const double t = length > 0.0 ? std::clamp((abscissa - s[k - 1]) / length, 0.0, 1.0) : 0.0;
  return axis[k - 1] + t * (axis[k] - axis[k - 1]);
}
}

KernelChoice<TracerKernels>& TracerKernelChoice()
{
#if defined(DYNAMICCORONARY_WIDE_KERNELS)
  static KernelChoice<TracerKernels> choice(TracerKernelsBaseline, &TracerKernelsAvx2);
#else
  static KernelChoice<TracerKernels> choice(TracerKernelsBaseline);
#endif
  return choice;
}

void ContrastTracerSettings::Validate() const
{
  RequireTracers(Within(static_cast<double>(this->capacity), 1000.0, 1e7), "capacity",
    static_cast<double>(this->capacity), "1000 to 10000000");
  RequireTracers(Within(this->volume, 1e-7, 0.1), "volume", this->volume, "1e-7 to 0.1 mL");
  RequireTracers(Within(this->radialDiffusivity, 0.0, 100.0), "radialDiffusivity",
    this->radialDiffusivity, "0 to 100 mm^2/s");
  RequireTracers(Within(this->axialDiffusivity, 0.0, 100.0), "axialDiffusivity",
    this->axialDiffusivity, "0 to 100 mm^2/s");
  RequireTracers(
    Within(this->blushTime, 0.05, 100.0), "blushTime", this->blushTime, "0.05 to 100 s");
}

ContrastTracers::ContrastTracers(
  const FlowNetwork& network, const ContrastTracerSettings& settings, std::uint64_t seed)
  : Settings_(settings)
  , Key(MixBits(seed))
  , TracerVolume(settings.volume)
{
  settings.Validate();
  this->Leaked_.assign(network.Nodes().size(), 0.0);
  this->MakeSegments(network);
  this->MakeJunctions(network);
  const auto capacity = static_cast<std::size_t>(settings.capacity);
  this->Segment_.resize(capacity);
  this->Part_.resize(capacity);
  this->X_.resize(capacity);
  this->Y_.resize(capacity);
  this->Volume_.resize(capacity);
  this->Leaving.resize(capacity + 1);
  this->Order.resize(capacity);
  this->Batch.resize(BatchSize);
  this->Blush_.assign(network.Nodes().size(), 0.0);
  this->Outflow_.assign(network.Nodes().size(), 0.0);
}

void ContrastTracers::MakeSegments(const FlowNetwork& network)
{
  this->Segments.clear();
  for (const FlowSegment& segment : network.Segments())
  {
    this->Segments.push_back({ segment.above, segment.below, segment.volume, segment.Radius(),
      segment.to - segment.from });
  }
  const std::size_t segments = this->Segments.size();
  this->Motions.resize(segments);
  this->AxialSteps.resize(segments);
  this->FlowTop.assign(segments, 0.0);
  this->FlowBottom.assign(segments, 0.0);
  this->CellBegin.resize(segments * CellsOfSegment + 1);
}

void ContrastTracers::OpenHole(const FlowNetwork& network, int node)
{
  const std::int32_t upper = network.Nodes()[node].above;
  const double volume = network.Segments()[upper].volume;
  const double whole = volume + network.Segments()[upper + 1].volume;
  for (std::int64_t i = 0; i < this->Size_; ++i)
  {
    std::int32_t& segment = this->Segment_[i];
    if (segment != upper)
    {
      segment += segment > upper ? 1 : 0;
      continue;
    }
    const double lumen = this->Part_[i] * whole;
    segment += lumen > volume ? 1 : 0;
    this->Part_[i] =
      static_cast<float>(lumen > volume ? (lumen - volume) / (whole - volume) : lumen / volume);
  }
  for (std::vector<double>* ofNodes : { &this->Blush_, &this->Outflow_, &this->Leaked_ })
  {
    ofNodes->resize(network.Nodes().size(), 0.0);
  }
  std::vector<char> holes;
  for (const Junction& junction : this->Junctions)
  {
    holes.push_back(junction.hole ? 1 : 0);
  }
  holes.push_back(1);
  this->MakeSegments(network);
  this->Junctions.clear();
  this->MakeJunctions(network);
  for (std::size_t n = 0; n < holes.size(); ++n)
  {
    Junction& junction = this->Junctions[n];
    if (holes[n] != 0)
    {
      junction.hole = true;
      junction.segments.push_back(-1); // at one side of the wall
      junction.tubes.reserve(junction.segments.size());
    }
  }
}

double ContrastTracers::Absorb(int segment, double from, double to, double part)
{
  double taken = 0.0;
  for (std::int64_t i = 0; i < this->Size_; ++i)
  {
    const double lumen = this->Segment_[i] == segment ? this->Lumen(i) : -1.0;
    if (lumen >= from && lumen <= to)
    {
      const double more = part * this->Volume_[i];
      this->Volume_[i] -= more;
      taken += more;
    }
  }
  this->Absorbed_ += taken;
  return taken;
}

void ContrastTracers::MakeJunctions(const FlowNetwork& network)
{
  std::vector<Vector3> points;
  for (const std::vector<Vector3>& axis : network.Topology().axis)
  {
    points.insert(points.end(), axis.begin(), axis.end());
  }
  std::vector<VesselFrame> frames;
  ComputeVesselFrames(network, points, frames);
  for (std::size_t n = 0; n < network.Nodes().size(); ++n)
  {
    const FlowNode& node = network.Nodes()[n];
    Junction junction;
    junction.tip = node.below.empty();
    junction.root = node.above < 0;
    // The frame of the cross-section that is cut.
    const FlowSegment& cut = network.Segments()[junction.root ? node.below[0] : node.above];
    const FlowBranch& branch = network.Branches()[cut.branch];
    const double place = junction.root ? cut.from : cut.to;
    const auto k = std::clamp<std::ptrdiff_t>(
      std::lower_bound(branch.abscissa.begin(), branch.abscissa.end(), place) -
        branch.abscissa.begin(),
      0, static_cast<std::ptrdiff_t>(branch.abscissa.size()) - 1);
    const VesselFrame& frame = frames[branch.firstPoint + k];
    std::vector<Eigen::Vector2d> ways;
    for (const int s : node.below)
    {
      const FlowSegment& segment = network.Segments()[s];
      const double end = std::min(segment.to, segment.from + DirectionLength);
      const Vector3 way =
        (AxisPoint(network, segment.branch, end) - AxisPoint(network, segment.branch, segment.from))
          .stableNormalized();
      ways.emplace_back(way.dot(frame.normal), way.dot(frame.binormal));
    }
    Eigen::Vector2d parting = Eigen::Vector2d::Zero();
    for (std::size_t a = 0; a < ways.size(); ++a)
    {
      for (std::size_t b = a + 1; b < ways.size(); ++b)
      {
        const Eigen::Vector2d apart = ways[b] - ways[a];
        parting = apart.squaredNorm() > parting.squaredNorm() ? apart : parting;
      }
    }
    parting = parting.norm() > 1e-6 ? Eigen::Vector2d(parting.normalized())
                                    : Eigen::Vector2d(Eigen::Vector2d::UnitX());
    junction.partingX = static_cast<float>(parting.x());
    junction.partingY = static_cast<float>(parting.y());
    std::vector<std::pair<double, int>> order;
    for (std::size_t a = 0; a < ways.size(); ++a)
    {
      order.emplace_back(ways[a].dot(parting), node.below[a]);
    }
    if (!junction.root)
    {
      order.emplace_back(0.0, node.above);
    }
    if (junction.root || junction.tip)
    {
      order.emplace_back(0.0, -1);
    }
    std::sort(order.begin(), order.end());
    for (const auto& [along, segment] : order)
    {
      junction.segments.push_back(segment);
    }
    junction.tubes.reserve(junction.segments.size());
    this->Junctions.push_back(std::move(junction));
  }
}

void ContrastTracers::PrepareMotion(double dt, const TracerFlow& flow)
{
  this->Flow = flow;
  this->Dt = dt;
  for (std::size_t s = 0; s < this->Segments.size(); ++s)
  {
    const TracerSegment& segment = this->Segments[s];
    const bool here = static_cast<int>(s) == flow.injector.segment;
    this->FlowBottom[s] = (*flow.flow)[s];
    this->FlowTop[s] = here ? flow.flowAbove : this->FlowBottom[s];
    TracerMotion& motion = this->Motions[s];
    motion.rate = static_cast<float>(2.0 * dt * this->FlowBottom[s] / segment.volume);
    // Uniform steps of variance 2 D dt.
    motion.radial =
      static_cast<float>(std::sqrt(6.0 * this->Settings_.radialDiffusivity * dt) / segment.radius);
    // As a fraction of a cylinder with the segment's length and volume: of its length.
    this->AxialSteps[s] =
      static_cast<float>(std::sqrt(6.0 * this->Settings_.axialDiffusivity * dt) / segment.length);
  }
}

/// What leaves each node through each of its ways, as stream-tubes.
void ContrastTracers::PrepareJunctions()
{
  for (std::size_t n = 0; n < this->Junctions.size(); ++n)
  {
    Junction& junction = this->Junctions[n];
    const auto outOf = [&](int s) // mL/s
    {
      return this->Segments[s].above == static_cast<int>(n) ? this->FlowTop[s]
                                                            : -this->FlowBottom[s];
    };
    double rest = 0.0;
    for (const int s : junction.segments)
    {
      rest -= s >= 0 ? outOf(s) : 0.0;
    }
    if (junction.hole)
    {
      // Round-off of a closed hole lets nothing through.
      const double passes = std::abs(outOf(junction.segments.front()));
      rest = rest > 1e-9 * passes ? rest : 0.0;
    }
    double total = 0.0;
    for (const int s : junction.segments)
    {
      total += std::max(s >= 0 ? outOf(s) : rest, 0.0);
    }
    double before = 0.0;
    junction.tubes.clear();
    for (const int s : junction.segments)
    {
      const double out = s >= 0 ? outOf(s) : rest;
      if (out > 0.0)
      {
        junction.tubes.push_back(
          { s, static_cast<float>(before / total), static_cast<float>(total / out) });
        before += out;
      }
    }
  }
}

void ContrastTracers::WashOut(double dt)
{
  const double gone = -std::expm1(-dt / this->Settings_.blushTime);
  for (double& blush : this->Blush_)
  {
    const double washed = blush * gone;
    blush -= washed;
    this->WashedOut_ += washed;
  }
}

/// Moves all as if no segment ended; returns how many of `Leaving` are beyond an end of theirs.
std::int64_t ContrastTracers::MoveWithinSegments()
{
  TracerRun run;
  run.segment = this->Segment_.data();
  run.part = this->Part_.data();
  run.x = this->X_.data();
  run.y = this->Y_.data();
  run.motions = this->Motions.data();
  run.axial = this->Settings_.axialDiffusivity > 0.0 ? this->AxialSteps.data() : nullptr;
  run.random = MixBits(this->Key + this->Steps);
  const int injected = this->Flow.injector.segment;
  if (injected >= 0 && this->Flow.injector.volume > 0.0)
  {
    const double volume = this->Segments[injected].volume;
    run.injected = injected;
    run.injectedPart = static_cast<float>(this->Flow.injector.volume / volume);
    run.injectedRate = static_cast<float>(2.0 * this->Dt * this->FlowTop[injected] / volume);
  }
  return TracerKernelChoice().Get().move(run, this->Size_, this->Leaving.data());
}

void ContrastTracers::Move()
{
  const std::int64_t leave = this->MoveWithinSegments();
  const auto batch = static_cast<std::int64_t>(this->Batch.size());
  for (std::int64_t first = 0; first < leave; first += batch)
  {
    this->CrossBatch(this->Leaving.data() + first, std::min(batch, leave - first));
  }
  std::int64_t gone = 0;
  for (std::int64_t k = 0; k < leave; ++k)
  {
    const std::int32_t i = this->Leaving[k];
    this->Leaving[gone] = i;
    gone += this->Segment_[i] < 0 ? 1 : 0;
  }
  // From the last one on, the place of one that left the tree is taken by the last one there is.
  while (gone > 0)
  {
    this->Copy(--this->Size_, this->Leaving[--gone]);
  }
}

/// Those at nodes where flow parts go through short loops, so that the processor can work on several at a time.
void ContrastTracers::CrossBatch(const std::int32_t* leaving, std::int64_t count)
{
  const auto finish = [this](Crossing& crossing)
  {
    if (this->Cross(crossing))
    {
      this->Store(crossing.tracer, crossing.place);
    }
    else
    {
      this->Segment_[crossing.place] = -1;
    }
  };
  std::size_t parting = 0;
  for (std::int64_t k = 0; k < count; ++k)
  {
    const std::int32_t i = leaving[k];
    Crossing& crossing = this->Batch[parting];
    crossing.place = i;
    crossing.tracer = { this->Segment_[i], this->Lumen(i), this->X_[i], this->Y_[i],
      this->Volume_[i] };
    if (this->Reach(crossing) && this->Junctions[crossing.node].tubes.size() > 1)
    {
      ++parting;
    }
    else
    {
      finish(crossing);
    }
  }
  for (std::size_t k = 0; k < parting; ++k)
  {
    Crossing& crossing = this->Batch[k];
    TakeTube(this->Junctions[crossing.node], crossing.tracer);
  }
  for (std::size_t k = 0; k < parting; ++k)
  {
    Crossing& crossing = this->Batch[k];
    if (this->Enter(crossing))
    {
      finish(crossing);
    }
    else
    {
      this->Segment_[crossing.place] = -1;
    }
  }
}

void ContrastTracers::Store(const Tracer& tracer, std::int64_t i)
{
  this->Segment_[i] = tracer.segment;
  this->Part_[i] = static_cast<float>(tracer.lumen / this->Segments[tracer.segment].volume);
  this->X_[i] = tracer.x;
  this->Y_[i] = tracer.y;
  this->Volume_[i] = tracer.volume;
}

void ContrastTracers::Copy(std::int64_t from, std::int64_t to)
{
  this->Segment_[to] = this->Segment_[from];
  this->Part_[to] = this->Part_[from];
  this->X_[to] = this->X_[from];
  this->Y_[to] = this->Y_[from];
  this->Volume_[to] = this->Volume_[from];
}

/// A tracer goes on for what is left of the step. False: it left the tree, and has been counted.
bool ContrastTracers::Cross(Crossing& crossing)
{
  Tracer& tracer = crossing.tracer;
  for (int k = 0; k < Crossings; ++k)
  {
    if (!this->Reach(crossing))
    {
      return true;
    }
    const Junction& junction = this->Junctions[crossing.node];
    if (junction.tubes.empty())
    {
      break; // what comes in does not go out: round-off of a flow that stops
    }
    if (junction.tubes.size() > 1)
    {
      TakeTube(junction, tracer);
    }
    else
    {
      tracer.segment = junction.tubes.front().segment;
    }
    if (!this->Enter(crossing))
    {
      return false;
    }
  }
  tracer.lumen = std::clamp(tracer.lumen, 0.0, this->Segments[tracer.segment].volume);
  return true;
}

/// The node that a tracer reached whose lumen is beyond an end of its segment; false: none, it stays.
bool ContrastTracers::Reach(Crossing& crossing) const
{
  Tracer& tracer = crossing.tracer;
  const TracerSegment& segment = this->Segments[tracer.segment];
  const bool atBeginning = tracer.lumen < 0.0;
  if (!atBeginning && tracer.lumen <= segment.volume)
  {
    return false;
  }
  const double beyond = atBeginning ? -tracer.lumen : tracer.lumen - segment.volume;
  const double flow =
    atBeginning ? -this->FlowTop[tracer.segment] : this->FlowBottom[tracer.segment];
  if (flow <= 0.0)
  {
    // Against the flow only diffusion leads, and it is reflected.
    tracer.lumen = std::clamp(atBeginning ? beyond : segment.volume - beyond, 0.0, segment.volume);
    return false;
  }
  crossing.node = atBeginning ? segment.above : segment.below;
  crossing.left = beyond / (flow * Inside(tracer));
  return true;
}

/// From a node into the tracer's next segment; false: out of the tree.
bool ContrastTracers::Enter(Crossing& crossing)
{
  Tracer& tracer = crossing.tracer;
  const int node = crossing.node;
  if (tracer.segment >= 0)
  {
    const TracerSegment& segment = this->Segments[tracer.segment];
    const double way = crossing.left * Inside(tracer); // mL of lumen for each mL/s
    tracer.lumen = segment.above == node ? way * this->FlowTop[tracer.segment]
                                         : segment.volume + way * this->FlowBottom[tracer.segment];
    return true;
  }
  if (this->Junctions[node].tip)
  {
    this->Blush_[node] += tracer.volume;
    this->Outflow_[node] += tracer.volume;
  }
  else if (this->Junctions[node].hole)
  {
    this->Leaked_[node] += tracer.volume;
  }
  else
  {
    this->Spilled_ += tracer.volume;
  }
  return false;
}

/// Which of several segments takes a tracer; its stream-tube becomes the whole of that segment's circle.
void ContrastTracers::TakeTube(const Junction& junction, Tracer& tracer)
{
  const FluxTables& tables = Tables();
  const float along = tracer.x * junction.partingX + tracer.y * junction.partingY;
  const float across = tracer.y * junction.partingX - tracer.x * junction.partingY;
  const float flux = tables.FluxBelow(along);
  // Counted, not searched: which tube it is cannot be predicted.
  std::size_t chosen = 0;
  for (std::size_t k = 1; k < junction.tubes.size(); ++k)
  {
    chosen += static_cast<std::size_t>(flux >= junction.tubes[k].begin);
  }
  const Tube& tube = junction.tubes[chosen];
  tracer.segment = tube.segment;
  const float x = tables.chordOf((flux - tube.begin) * tube.scale);
  const float y =
    across * std::sqrt(std::max(1.0F - x * x, 0.0F) / std::max(1.0F - along * along, 1e-6F));
  tracer.x = x * junction.partingX - y * junction.partingY;
  tracer.y = x * junction.partingY + y * junction.partingX;
  KeepInside(tracer.x, tracer.y);
}

void ContrastTracers::Step(double dt, const TracerFlow& flow)
{
  this->PrepareMotion(dt, flow);
  this->PrepareJunctions();
  std::fill(this->Outflow_.begin(), this->Outflow_.end(), 0.0);
  this->WashOut(dt);
  this->Move();
  if (flow.injection * flow.medium > 0.0)
  {
    this->Inject(flow.injection * dt * flow.medium);
  }
  else if (this->TracerVolume > this->Settings_.volume && this->Size_ == 0)
  {
    this->TracerVolume = this->Settings_.volume;
  }
  ++this->Steps;
}

void ContrastTracers::Inject(double volume)
{
  this->Injected_ += volume;
  const int segment = this->Flow.injector.segment;
  if (segment < 0)
  {
    this->Spilled_ += volume;
    return;
  }
  const double down = std::max(this->FlowBottom[segment], 0.0);
  const double up = std::max(-this->FlowTop[segment], 0.0);
  const double share = up > 0.0 ? up / (up + down) : 0.0;
  if (share < 1.0)
  {
    this->Emit((1.0 - share) * volume, true);
  }
  if (share > 0.0)
  {
    this->Emit(share * volume, false);
  }
}

void ContrastTracers::Emit(double volume, bool down)
{
  // Even over step and flux: additive recurrence with the plastic constant (Roberts 2018), shifted by the seed.
  constexpr double alphaX = 0.75487766624669276;
  constexpr double alphaY = 0.56984029099805327;
  RandomStream shift(this->Key, 1);
  const double shiftX = shift.Uniform();
  const double shiftY = shift.Uniform();
  const double shiftTime = shift.Uniform();
  const double wanted = std::ceil(volume / this->TracerVolume);
  const auto count = static_cast<std::int64_t>(
    std::clamp(wanted, 1.0, std::floor(static_cast<double>(this->Settings_.capacity) / 16.0)));
  this->MakeRoom(count);
  const int segment = this->Flow.injector.segment;
  const double rate = 2.0 * this->Dt * (down ? this->FlowBottom : this->FlowTop)[segment];
  for (std::int64_t k = 0; k < count; ++k)
  {
    const auto number = static_cast<double>(this->Emitted++ & 0xffffffffU);
    const float x = Tables().chordOf(static_cast<float>(Modulo(shiftX + alphaX * number)));
    const float y = Tables().placeOnChord(static_cast<float>(Modulo(shiftY + alphaY * number))) *
      std::sqrt(std::max(1.0F - x * x, 0.0F));
    const double time = (static_cast<double>(k) + shiftTime) / static_cast<double>(count);
    Crossing crossing{ { segment, 0.0, x, y, volume / static_cast<double>(count) } };
    Tracer& tracer = crossing.tracer;
    KeepInside(tracer.x, tracer.y);
    tracer.lumen = this->Flow.injector.volume + rate * (1.0 - time) * Inside(tracer);
    if (this->Cross(crossing))
    {
      this->Store(tracer, this->Size_++);
    }
  }
}

void ContrastTracers::MakeRoom(std::int64_t count)
{
  if (this->Size_ + count > this->Settings_.capacity)
  {
    this->TracerVolume *= 2.0;
    this->Thin(false);
  }
  if (this->Size_ + count > this->Settings_.capacity)
  {
    this->Thin(true); // so many segments that few tracers have a neighbour
  }
}

/// Of two neighbours one stays, with the volume of both; the greater one rather, so that the mean place is kept.
void ContrastTracers::Thin(bool anywhere)
{
  const auto cellOf = [this](std::int64_t i)
  {
    return this->Segment_[i] * CellsOfSegment +
      std::clamp(static_cast<int>(this->Part_[i] * CellsOfSegment), 0, CellsOfSegment - 1);
  };
  std::fill(this->CellBegin.begin(), this->CellBegin.end(), 0);
  for (std::int64_t i = 0; i < this->Size_; ++i)
  {
    ++this->CellBegin[cellOf(i) + 1];
  }
  for (std::size_t c = 1; c < this->CellBegin.size(); ++c)
  {
    this->CellBegin[c] += this->CellBegin[c - 1];
  }
  for (std::int64_t i = 0; i < this->Size_; ++i)
  {
    this->Order[this->CellBegin[cellOf(i)]++] = static_cast<std::int32_t>(i);
  }
  RandomStream random(this->Key + this->Steps, 2);
  for (std::int64_t k = 0; k + 1 < this->Size_; ++k)
  {
    const std::int32_t a = this->Order[k];
    const std::int32_t b = this->Order[k + 1];
    if (this->Segment_[a] == this->Segment_[b] || anywhere)
    {
      const double sum = this->Volume_[a] + this->Volume_[b];
      const bool first = random.Uniform() * sum < this->Volume_[a];
      this->Volume_[first ? a : b] = sum;
      this->Volume_[first ? b : a] = 0.0;
      ++k;
    }
  }
  std::int64_t kept = 0;
  for (std::int64_t i = 0; i < this->Size_; ++i)
  {
    if (this->Volume_[i] > 0.0)
    {
      this->Copy(i, kept++);
    }
  }
  this->Size_ = kept;
}

double ContrastTracers::InTree() const
{
  // Neumaier's sum: a million small volumes lose nothing.
  double sum = 0.0;
  double lost = 0.0;
  for (std::int64_t i = 0; i < this->Size_; ++i)
  {
    const double volume = this->Volume_[i];
    const double next = sum + volume;
    lost += sum >= volume ? (sum - next) + volume : (volume - next) + sum;
    sum = next;
  }
  return sum + lost;
}

std::uint64_t ContrastTracers::StateHash() const
{
  const auto size = static_cast<std::size_t>(this->Size_);
  std::uint64_t hash = Fnv1a(&this->Size_, sizeof(this->Size_));
  const auto add = [&hash](const auto& list, std::size_t count)
  { hash = Fnv1a(list.data(), count * sizeof(list[0]), hash); };
  add(this->Segment_, size);
  add(this->Part_, size);
  add(this->X_, size);
  add(this->Y_, size);
  add(this->Volume_, size);
  add(this->Blush_, this->Blush_.size());
  add(
    std::array<double, 4>{ this->Injected_, this->Spilled_, this->WashedOut_, this->TracerVolume },
    4);
  add(std::array<std::uint64_t, 3>{ this->Key, this->Steps, this->Emitted }, 3);
  if (std::any_of(this->Junctions.begin(), this->Junctions.end(),
        [](const Junction& junction) { return junction.hole; }))
  {
    add(this->Leaked_, this->Leaked_.size());
  }
  return hash;
}
}
