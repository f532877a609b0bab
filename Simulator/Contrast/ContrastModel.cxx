#include "ContrastModel.h"

#include "Fnv1a.h"
#include "Numbers.h"
#include "Require.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double DepressedFlow = 0.45;  // of the flow before
constexpr double DepressionTime = 1.9;  // s, of each of two filters
constexpr double MinimumVolume = 1e-15; // of a slab without length, mL
constexpr std::size_t CellsOfSlab =
  4; // in the mean; the more, the fewer cells have the end of a slab in them

constexpr RequireOf RequireContrast{ "contrast" };

const ContrastSettings& Checked(const ContrastSettings& settings)
{
  settings.Validate();
  return settings;
}
}

void ContrastSettings::Validate() const
{
  this->flow.Validate();
  this->tracers.Validate();
  this->aorta.Validate();
  RequireContrast(Within(this->smoothing, 0.0, 20.0), "smoothing", this->smoothing, "0 to 20 mm");
  RequireContrast(
    Within(this->flowDepression, 0.0, 1.0), "flowDepression", this->flowDepression, "0 to 1");
}

ContrastModel::ContrastModel(
  const WallTopology& topology, const ContrastSettings& settings, std::uint64_t seed)
  : Settings_(Checked(settings))
  , Flow_(topology, settings.flow)
  , Tracers_(this->Flow_.Network(), settings.tracers, seed)
  , Aorta_(SectionsOfAorta(topology), settings.aorta)
{
  this->MakeSlabs();
  this->MakeSmoothing();
  this->BlushVolume_.assign(this->Flow_.Network().Branches().size(), 0.0);
  this->Arrived.assign(this->Flow_.Network().Roots().size(), 0.0);
  this->Depressed = this->Arrived;
}

void ContrastModel::MakeSlabs()
{
  for (std::size_t b = 0; b < this->Flow_.Network().Branches().size(); ++b)
  {
    const FlowBranch& branch = this->Flow_.Network().Branches()[b];
    const std::size_t count = branch.abscissa.size() - 1;
    this->BranchSlab.push_back(this->Slabs_.size());
    for (std::size_t k = 0; k < count; ++k)
    {
      this->Slabs_.push_back(
        { static_cast<int>(b), branch.firstPoint + static_cast<std::int64_t>(k),
          branch.volume[k + 1] - branch.volume[k] });
      this->SlabLength.push_back(branch.abscissa[k + 1] - branch.abscissa[k]);
      this->SlabBegin.push_back(branch.volume[k]);
    }
    const std::size_t cells = CellsOfSlab * count;
    std::size_t slab = 0;
    for (std::size_t cell = 0; cell < cells; ++cell)
    {
      const double from =
        branch.volume.back() * static_cast<double>(cell) / static_cast<double>(cells);
      while (slab + 1 < count && branch.volume[slab + 1] <= from)
      {
        ++slab;
      }
      this->SlabOfCell.push_back(static_cast<std::int32_t>(this->BranchSlab.back() + slab));
    }
    this->CellsOfVolume.push_back(static_cast<double>(cells) / branch.volume.back());
  }
  this->BranchSlab.push_back(this->Slabs_.size());
  this->Concentration_.assign(this->Slabs_.size(), 0.0);
}

std::size_t ContrastModel::SlabAt(int branch, double volume) const
{
  const std::size_t first = this->BranchSlab[branch];
  const std::size_t last = this->BranchSlab[branch + 1] - 1;
  const auto cells = static_cast<int>(CellsOfSlab * (last + 1 - first));
  const int cell = std::clamp(static_cast<int>(volume * this->CellsOfVolume[branch]), 0, cells - 1);
  auto slab = static_cast<std::size_t>(this->SlabOfCell[CellsOfSlab * first + cell]);
  while (slab < last && this->SlabBegin[slab + 1] <= volume)
  {
    ++slab;
  }
  return slab;
}

/// The equations of SmoothBranch, eliminated.
void ContrastModel::MakeSmoothing()
{
  const double square = this->Settings_.smoothing * this->Settings_.smoothing;
  const auto conductance = [&](std::size_t k) // between k and k + 1
  {
    const double apart = std::max(0.5 * (this->SlabLength[k] + this->SlabLength[k + 1]), 1e-6);
    const double area = (this->SlabVolume(k) + this->SlabVolume(k + 1)) / (2.0 * apart);
    return square * area / apart;
  };
  this->Smoothing.resize(this->Slabs_.size());
  for (std::size_t b = 0; b + 1 < this->BranchSlab.size(); ++b)
  {
    double before = 0.0; // conductance to the slab before
    double ratio = 0.0;  // of the eliminated equation before
    for (std::size_t k = this->BranchSlab[b]; k < this->BranchSlab[b + 1]; ++k)
    {
      const double behind = k + 1 < this->BranchSlab[b + 1] ? conductance(k) : 0.0;
      const double pivot = this->SlabVolume(k) + before + behind - before * ratio;
      ratio = behind / pivot;
      this->Smoothing[k] = { 1.0 / pivot, before / pivot, ratio };
      before = behind;
    }
  }
}

/// Slabs without volume take their neighbours' fraction.
double ContrastModel::SlabVolume(std::size_t slab) const
{
  return std::max(this->Slabs_[slab].volume, MinimumVolume);
}

void ContrastModel::Step(double dt, double phase, double heartRate, double injection,
  const CatheterTip& tip, double medium, double beside)
{
  RequireContrast(Within(dt, 0.0005, 0.02), "time step", dt, "0.0005 to 0.02 s");
  RequireContrast(std::isfinite(phase), "phase", phase, "finite");
  RequireContrast(Within(heartRate, 0.0, 300.0), "heart rate", heartRate, "0 to 300 per minute");
  RequireContrast(Within(injection, 0.0, 50.0), "injection", injection, "0 to 50 mL/s");
  RequireContrast(Within(medium, 0.0, 1.0), "fraction of medium", medium, "0 to 1");
  RequireContrast(Within(beside, 0.0, 50.0), "medium beside the ostium", beside, "0 to 50 mL/s");
  if (injection > 0.0 && tip.branch != -1)
  {
    this->Flow_.Network().Locate(tip);
  }
  this->Flow_.Step(dt, phase, heartRate, injection, tip);
  TracerFlow flow;
  flow.flow = &this->Flow_.Flow();
  flow.injector = this->Flow_.Injector();
  flow.injection = injection;
  flow.medium = medium;
  if (flow.injector.segment >= 0)
  {
    flow.flowAbove = this->Flow_.FlowAtBeginning(flow.injector.segment);
  }
  const double before = this->Tracers_.Spilled();
  this->Tracers_.Step(dt, flow);
  this->Beside += dt * beside;
  // What is injected in the aorta counts as spilled, too.
  const double spilled = this->Tracers_.Spilled() - before;
  const bool inAorta = tip.branch == -1;
  this->StepAorta(dt,
    this->Stroke *
      EjectedFlow(this->Settings_.aorta, this->Settings_.flow.ejectionBegin,
        this->Settings_.flow.systoleEnd, phase, heartRate),
    inAorta ? 0.0 : spilled, dt * beside + (inAorta ? spilled : 0.0), tip);
  this->UpdateBlush();
  if (this->Settings_.flowDepression > 0.0)
  {
    this->DepressFlow(dt);
  }
  this->Current = false;
}

/// @param spilled  mL out of an ostium  @param beside  mL out of a tip that is in the aorta, or past the ostium
void ContrastModel::StepAorta(
  double dt, double flow, double spilled, double beside, const CatheterTip& tip)
{
  const FlowNetwork& network = this->Flow_.Network();
  const int segment = this->Flow_.Injector().segment;
  if (segment >= 0)
  {
    this->LastMouth =
      static_cast<std::size_t>(network.Nodes()[network.Segments()[segment].above].tree);
  }
  AorticContrast::Inflow inflow;
  inflow.mouth = this->LastMouth;
  inflow.spilled = spilled;
  inflow.direct = beside;
  inflow.place = tip.branch == -1 ? tip.abscissa : this->Aorta_.Sections().mouths[this->LastMouth];
  this->Aorta_.Step(dt, flow, inflow);
}

int ContrastModel::OpenHole(const CatheterTip& place)
{
  const int node = this->Flow_.OpenHole(place);
  this->Tracers_.OpenHole(this->Flow_.Network(), node);
  return node;
}

void ContrastModel::SetHeart(double stroke, double pressure)
{
  RequireContrast(Within(stroke, 0.0, 1.0), "factor of the stroke volume", stroke, "0 to 1");
  this->Flow_.SetPressureFactor(pressure);
  this->Stroke = stroke;
}

double ContrastModel::Absorb(int branch, double from, double to, double part)
{
  const FlowNetwork& network = this->Flow_.Network();
  double taken = 0.0;
  for (const int s : network.Branches().at(branch).segments)
  {
    const FlowSegment& segment = network.Segments()[s];
    if (segment.to > from && segment.from < to)
    {
      taken += this->Tracers_.Absorb(s, network.VolumeAt(branch, from) - segment.volumeFrom,
        network.VolumeAt(branch, to) - segment.volumeFrom, part);
    }
  }
  this->Current = this->Current && taken == 0.0;
  return taken;
}

void ContrastModel::UpdateBlush()
{
  for (const FlowSegment& segment : this->Flow_.Network().Segments())
  {
    if (this->Flow_.Network().IsTip(segment.below))
    {
      this->BlushVolume_[segment.branch] = this->Tracers_.Blush()[segment.below];
    }
  }
}

void ContrastModel::DepressFlow(double dt)
{
  const FlowNetwork& network = this->Flow_.Network();
  for (std::size_t t = 0; t < this->Arrived.size(); ++t)
  {
    double medium = 0.0;
    double blood = 0.0;
    for (std::size_t s = 0; s < network.Segments().size(); ++s)
    {
      const FlowSegment& segment = network.Segments()[s];
      if (network.IsTip(segment.below) &&
        network.Nodes()[segment.below].tree == static_cast<int>(t))
      {
        medium += this->Tracers_.Outflow()[segment.below];
        blood += dt * std::max(this->Flow_.Flow()[s], 0.0);
      }
    }
    const double part = blood > 0.0 ? medium / blood : 0.0; // of few tracers: above 1 at times
    const double share = -std::expm1(-dt / DepressionTime);
    this->Arrived[t] += share * (part - this->Arrived[t]);
    this->Depressed[t] += share * (this->Arrived[t] - this->Depressed[t]);
    const double fall =
      this->Settings_.flowDepression * (1.0 - DepressedFlow) * std::min(this->Depressed[t], 1.0);
    this->Flow_.SetOutletFactor(static_cast<int>(t), 1.0 / (1.0 - fall));
  }
}

const std::vector<double>& ContrastModel::Concentration() const
{
  if (this->Current)
  {
    return this->Concentration_;
  }
  this->Current = true;
  std::fill(this->Concentration_.begin(), this->Concentration_.end(), 0.0);
  const std::vector<FlowSegment>& segments = this->Flow_.Network().Segments();
  for (std::int64_t i = 0; i < this->Tracers_.Size(); ++i)
  {
    const FlowSegment& segment = segments[this->Tracers_.Segment(i)];
    const std::size_t slab =
      this->SlabAt(segment.branch, segment.volumeFrom + this->Tracers_.Lumen(i));
    this->Concentration_[slab] += this->Tracers_.Volume(i);
  }
  for (std::size_t b = 0; b + 1 < this->BranchSlab.size(); ++b)
  {
    this->SmoothBranch(b);
    this->LimitBranch(b);
  }
  if (!this->Flow_.Network().Topology().axisOcclusion.empty())
  {
    this->FillStumps();
  }
  return this->Concentration_;
}

/// Nothing flows there, but what passes the mouth of a stump mixes into it: at once, and uncounted.
void ContrastModel::FillStumps() const
{
  const FlowNetwork& network = this->Flow_.Network();
  for (std::size_t s = 0; s < network.Segments().size(); ++s)
  {
    const FlowSegment& segment = network.Segments()[s];
    const int before = network.Nodes()[segment.above].above;
    const double openTo = this->Flow_.OpenTo(static_cast<int>(s));
    if (openTo >= segment.to || before < 0)
    {
      continue;
    }
    const FlowSegment& above = network.Segments()[before];
    const double mouth = this->Concentration_[this->SlabAt(
      above.branch, above.volumeFrom + (1.0 - 1e-9) * above.volume)];
    const std::vector<double>& place = network.Branches()[segment.branch].abscissa;
    for (std::size_t k = 0; k + 1 < place.size(); ++k)
    {
      if (place[k] >= segment.from && place[k + 1] <= openTo)
      {
        this->Concentration_[this->BranchSlab[segment.branch] + k] = mouth;
      }
    }
  }
}

/// From mL to fractions: (V + L) c = mL, L the conductances between neighbours (Thomas algorithm).
void ContrastModel::SmoothBranch(std::size_t branch) const
{
  const std::size_t first = this->BranchSlab[branch];
  const std::size_t last = this->BranchSlab[branch + 1];
  double before = 0.0; // the slab before, eliminated
  for (std::size_t k = first; k < last; ++k)
  {
    const SmoothedSlab& row = this->Smoothing[k];
    before = row.own * this->Concentration_[k] + row.above * before;
    this->Concentration_[k] = before;
  }
  for (std::size_t k = last - 1; k-- > first;)
  {
    this->Concentration_[k] += this->Smoothing[k].below * this->Concentration_[k + 1];
  }
}

/// The tracers' number is random, a fraction is at most 1: what is above goes to the neighbours.
void ContrastModel::LimitBranch(std::size_t branch) const
{
  const std::size_t first = this->BranchSlab[branch];
  const std::size_t last = this->BranchSlab[branch + 1];
  double excess = 0.0; // mL
  const auto limit = [&](std::size_t k)
  {
    const double volume = this->SlabVolume(k);
    const double whole = this->Concentration_[k] + excess / volume;
    this->Concentration_[k] = std::min(whole, 1.0);
    excess = (whole - this->Concentration_[k]) * volume;
  };
  for (std::size_t k = first; k < last; ++k)
  {
    limit(k);
  }
  for (std::size_t k = last; k-- > first && excess > 0.0;)
  {
    limit(k);
  }
}

void ContrastModel::TracerPositions(const std::vector<Vector3>& axis,
  std::vector<Vector3>& positions, std::vector<float>& volumes) const
{
  const FlowNetwork& network = this->Flow_.Network();
  ComputeVesselFrames(network, axis, this->Frames);
  const auto count = static_cast<std::size_t>(this->Tracers_.Size());
  positions.resize(count);
  volumes.resize(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    const auto tracer = static_cast<std::int64_t>(i);
    const FlowSegment& segment = network.Segments()[this->Tracers_.Segment(tracer)];
    const double along = segment.volumeFrom + this->Tracers_.Lumen(tracer);
    const std::size_t slab = this->SlabAt(segment.branch, along);
    const double t = std::clamp((along - this->SlabBegin[slab]) / this->SlabVolume(slab), 0.0, 1.0);
    const std::int64_t p = this->Slabs_[slab].point;
    const std::vector<double>& radii = network.Topology().axisRadius[segment.branch];
    const auto k = static_cast<std::size_t>(p - network.Branches()[segment.branch].firstPoint);
    const double radius = radii[k] + t * (radii[k + 1] - radii[k]);
    const VesselFrame& a = this->Frames[p];
    const VesselFrame& b = this->Frames[p + 1];
    const Vector3 normal = a.normal + t * (b.normal - a.normal);
    const Vector3 binormal = a.binormal + t * (b.binormal - a.binormal);
    positions[i] = axis[p] + t * (axis[p + 1] - axis[p]) +
      radius * (this->Tracers_.X(tracer) * normal + this->Tracers_.Y(tracer) * binormal);
    volumes[i] = static_cast<float>(this->Tracers_.Volume(tracer));
  }
}

double ContrastModel::Flow(int branch) const
{
  return this->Flow_.FlowAtBeginning(this->Flow_.Network().Branches().at(branch).segments.front());
}

double ContrastModel::Speed(int branch) const
{
  const int first = this->Flow_.Network().Branches().at(branch).segments.front();
  const double radius = this->Flow_.Network().Segments()[first].Radius();
  return 100.0 * this->Flow(branch) / (Pi * radius * radius); // mL/s / mm^2 = m/s
}

ContrastBalance ContrastModel::Balance() const
{
  ContrastBalance balance;
  balance.injected = this->Tracers_.Injected() + this->Beside;
  balance.inTree = this->Tracers_.InTree();
  for (const double blush : this->Tracers_.Blush())
  {
    balance.blush += blush;
  }
  balance.washedOut = this->Tracers_.WashedOut();
  balance.spilled = this->Tracers_.Spilled() + this->Beside;
  balance.inAorta = this->Aorta_.InAorta();
  balance.leftAorta = this->Aorta_.Left();
  for (const double leaked : this->Tracers_.Leaked())
  {
    balance.leaked += leaked;
  }
  balance.inWall = this->Tracers_.Absorbed();
  return balance;
}

std::uint64_t ContrastModel::StateHash() const
{
  std::uint64_t hash = this->Tracers_.StateHash();
  hash = Fnv1a(this->Arrived.data(), this->Arrived.size() * sizeof(double), hash);
  hash = Fnv1a(this->Depressed.data(), this->Depressed.size() * sizeof(double), hash);
  return this->Flow_.StateHash(hash);
}
}
