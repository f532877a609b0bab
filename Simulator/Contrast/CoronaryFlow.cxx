#include "CoronaryFlow.h"

#include "CyclicTime.h"
#include "Fnv1a.h"
#include "HeartPressures.h"
#include "Numbers.h"
#include "Require.h"
#include "VesselLesions.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace coronary
{
namespace
{
constexpr double PascalPerMmHg = 133.322387415;
constexpr double ReferenceLength = 100.0; // mm
constexpr double OutletLength = 10.0;     // mm before a tip whose mean radius is the outlet's
constexpr double ExpansionLoss = 1.52;    // K_t of Seeley and Young
constexpr int StepsOfCycle = 160;
constexpr double ClosedRadius = 0.02; // mm of what an instrument leaves, at least, and an occlusion

constexpr RequireOf RequireFlow{ "coronary flow" };

HeartPressures PressuresOf(const CoronaryFlowSettings& settings)
{
  return { settings.systolicPressure, settings.diastolicPressure, settings.ejectionBegin,
    settings.systoleEnd };
}

/// integral ds / r^4 where r goes from a to b over a length, 1/mm^3.
double InverseFourth(double length, double a, double b)
{
  return length * (a * a + a * b + b * b) / (3.0 * a * a * a * b * b * b);
}

/// mmHg s/mL for 1/mm^3.
double PoiseuilleFactor(double viscosity)
{
  return 8.0 / Pi * (1e-3 * viscosity) * 1e3 / PascalPerMmHg;
}

/// Kinetic energy that a jet through `throat` loses in a vessel of `area` (mm^2): mmHg s^2/mL^2.
double JetLoss(double density, double area, double throat)
{
  const double widening = area / throat - 1.0;
  return ExpansionLoss * 0.5 * density * widening * widening / (area * area) / PascalPerMmHg;
}

/// mm of a free lumen with the same resistance as the annulus around an instrument.
double AnnulusRadius(double lumen, double instrument)
{
  if (instrument <= 0.0)
  {
    return lumen;
  }
  if (instrument >= 0.999 * lumen)
  {
    return ClosedRadius;
  }
  const double a = instrument * instrument;
  const double b = lumen * lumen;
  const double fourth = (b * b - a * a) - (b - a) * (b - a) / (0.5 * std::log(b / a));
  return std::max(ClosedRadius, std::pow(std::max(0.0, fourth), 0.25));
}

const CoronaryFlowSettings& Checked(const CoronaryFlowSettings& settings)
{
  settings.Validate();
  return settings;
}
}

void CoronaryFlowSettings::Validate() const
{
  RequireFlow(Within(this->viscosity, 0.5, 20.0), "viscosity", this->viscosity, "0.5 to 20 mPa s");
  RequireFlow(Within(this->density, 500.0, 2000.0), "density", this->density, "500 to 2000 kg/m^3");
  RequireFlow(Within(this->systolicPressure, 20.0, 300.0), "systolicPressure",
    this->systolicPressure, "20 to 300 mmHg");
  RequireFlow(Within(this->diastolicPressure, 10.0, this->systolicPressure), "diastolicPressure",
    this->diastolicPressure, "10 mmHg to systolicPressure");
  RequireFlow(this->venousPressure >= -10.0 && this->venousPressure <= 30.0 &&
      this->venousPressure < this->diastolicPressure,
    "venousPressure", this->venousPressure, "-10 to 30 mmHg and below diastolicPressure");
  RequireFlow(
    Within(this->ejectionBegin, 0.01, 0.15), "ejectionBegin", this->ejectionBegin, "0.01 to 0.15");
  RequireFlow(Within(this->systoleEnd, 0.2, 0.6), "systoleEnd", this->systoleEnd, "0.2 to 0.6");
  RequireFlow(Within(this->leftAxialSpeed, 1.0, 200.0), "leftAxialSpeed", this->leftAxialSpeed,
    "1 to 200 cm/s");
  RequireFlow(Within(this->rightAxialSpeed, 1.0, 200.0), "rightAxialSpeed", this->rightAxialSpeed,
    "1 to 200 cm/s");
  RequireFlow(Within(this->leftDiastolicRatio, 0.3, 5.0), "leftDiastolicRatio",
    this->leftDiastolicRatio, "0.3 to 5");
  RequireFlow(Within(this->rightDiastolicRatio, 0.3, 5.0), "rightDiastolicRatio",
    this->rightDiastolicRatio, "0.3 to 5");
  RequireFlow(
    Within(this->outletExponent, 1.0, 4.0), "outletExponent", this->outletExponent, "1 to 4");
  RequireFlow(
    Within(this->arterialShare, 0.05, 0.95), "arterialShare", this->arterialShare, "0.05 to 0.95");
  RequireFlow(Within(this->outletTime, 0.02, 5.0), "outletTime", this->outletTime, "0.02 to 5 s");
  RequireFlow(Within(this->referenceHeartRate, 30.0, 200.0), "referenceHeartRate",
    this->referenceHeartRate, "30 to 200 per minute");
  RequireFlow(Within(this->stenosisThreshold, 0.05, 0.9), "stenosisThreshold",
    this->stenosisThreshold, "0.05 to 0.9");
  RequireFlow(Within(this->stenosisNeighbourhood, 1.0, 100.0), "stenosisNeighbourhood",
    this->stenosisNeighbourhood, "1 to 100 mm");
  for (const StatedStenosis& stenosis : this->stenoses)
  {
    RequireFlow(Within(stenosis.diameterReduction, 0.0, 0.95), "diameterReduction of a stenosis",
      stenosis.diameterReduction, "0 to 0.95");
    RequireFlow(Within(stenosis.length, 0.5, 100.0), "length of a stenosis", stenosis.length,
      "0.5 to 100 mm");
  }
}

double AorticPressure(const CoronaryFlowSettings& settings, double phase)
{
  return PressuresOf(settings).Aortic(phase);
}

double VentricularPressure(const CoronaryFlowSettings& settings, double phase)
{
  return PressuresOf(settings).Ventricular(phase);
}

CoronaryFlow::CoronaryFlow(const WallTopology& topology, const CoronaryFlowSettings& settings)
  : Settings_(settings)
  , Network_(topology, Checked(settings).sides)
{
  const std::size_t segments = this->Network_.Segments().size();
  const std::size_t nodes = this->Network_.Nodes().size();
  const std::size_t trees = this->Network_.Roots().size();
  this->Flow_.assign(segments, 0.0);
  this->AtTop.resize(segments);
  this->Pressure_.assign(nodes, 0.0);
  this->OutletResistance_.assign(nodes, 0.0);
  this->Compliance.assign(nodes, 0.0);
  this->Compartment.assign(nodes, 0.0);
  this->Demands.resize(nodes);
  this->Fraction.assign(trees, 0.0);
  this->OutletFactor.assign(trees, 1.0);

  this->Closed = ClosedRadii(this->Network_.Topology());
  this->OpenRadius = this->Network_.Topology().axisRadius;
  for (std::size_t b = 0; b < this->Closed.size(); ++b)
  {
    for (std::size_t k = 0; k < this->Closed[b].size(); ++k)
    {
      double& open = this->OpenRadius[b][k];
      open = open > this->Closed[b][k] ? open : ClosedRadius;
    }
  }
  if (topology.axisReference.empty())
  {
    this->FindStenoses();
  }
  else
  {
    this->TakeLesions();
  }
  for (const StatedStenosis& stenosis : settings.stenoses)
  {
    this->AddStatedStenosis(stenosis);
  }
  this->MeasureResistances();
  this->ChooseOutletWeights();
  this->ChoosePaths();
  for (std::size_t t = 0; t < trees; ++t)
  {
    const bool right = this->Network_.RightSide()[t];
    this->CalibrateMean(
      static_cast<int>(t), right ? settings.rightAxialSpeed : settings.leftAxialSpeed);
  }
  for (std::size_t t = 0; t < trees; ++t)
  {
    const bool right = this->Network_.RightSide()[t];
    this->CalibrateRatio(
      static_cast<int>(t), right ? settings.rightDiastolicRatio : settings.leftDiastolicRatio);
  }
  this->HealthyFlow = this->TipFlows();
  for (std::size_t s = 0; s < segments; ++s)
  {
    const FlowSegment& segment = this->Network_.Segments()[s];
    this->Losses[s] = this->LossBetween(static_cast<int>(s), segment.from, segment.to);
  }
  this->Settle(0.0);
}

void CoronaryFlow::FindStenoses()
{
  const FlowNetwork& network = this->Network_;
  const std::vector<std::vector<double>> references =
    ReferenceRadii(network.Topology(), this->Settings_.stenosisNeighbourhood);
  for (std::size_t b = 0; b < network.Branches().size(); ++b)
  {
    const std::vector<double>& s = network.Branches()[b].abscissa;
    const std::vector<double>& radius = network.Topology().axisRadius[b];
    std::vector<double> healthy = radius;
    std::size_t narrowest = s.size(); // of the stretch that we are in
    std::vector<std::int64_t> points;
    const auto close = [&]
    {
      if (narrowest < s.size())
      {
        const double area = Pi * healthy[narrowest] * healthy[narrowest];
        const double throat = Pi * radius[narrowest] * radius[narrowest];
        this->Stenoses.push_back({ network.Locate({ static_cast<int>(b), s[narrowest] }).segment,
          s[narrowest], 0.0, JetLoss(this->Settings_.density, area, throat), area, points });
        narrowest = s.size();
        points.clear();
      }
    };
    for (std::size_t k = 0; k < s.size(); ++k)
    {
      const double reference = references[b][k];
      if (radius[k] >= (1.0 - this->Settings_.stenosisThreshold) * reference)
      {
        close();
        continue;
      }
      healthy[k] = reference;
      points.push_back(network.Branches()[b].firstPoint + static_cast<std::int64_t>(k));
      if (narrowest == s.size() || radius[k] < radius[narrowest])
      {
        narrowest = k;
      }
    }
    close();
    this->HealthyRadius.push_back(std::move(healthy));
  }
}

/// What the vessels are without their lesions is known.
void CoronaryFlow::TakeLesions()
{
  const WallTopology& topology = this->Network_.Topology();
  this->HealthyRadius = topology.axisReference;
  for (FoundLesion& lesion : FindLesions(topology, this->Settings_.stenosisThreshold))
  {
    const FlowBranch& branch = this->Network_.Branches()[lesion.branch];
    const auto k = static_cast<std::size_t>(lesion.throat - branch.firstPoint);
    const double healthy = topology.axisReference[lesion.branch][k];
    const double radius = topology.axisRadius[lesion.branch][k];
    const double area = Pi * healthy * healthy;
    const FlowNetwork::Place place = this->Network_.Locate({ lesion.branch, branch.abscissa[k] });
    this->Stenoses.push_back({ place.segment, place.abscissa, 0.0,
      JetLoss(this->Settings_.density, area, Pi * radius * radius), area,
      std::move(lesion.points) });
  }
}

void CoronaryFlow::AddStatedStenosis(const StatedStenosis& stenosis)
{
  const FlowNetwork::Place place = this->Network_.Locate(stenosis.place);
  const double radius = this->Network_.RadiusAt(stenosis.place.branch, place.abscissa);
  const double area = Pi * radius * radius;
  const double diameter = 2.0 * radius;
  const double open = 1.0 - stenosis.diameterReduction;
  // Seeley and Young's viscous loss, less the loss of the vessel that the axis shows.
  const double length = 0.83 * stenosis.length + 1.64 * open * diameter;
  const double viscous = std::max(0.0, length / std::pow(open, 4.0) - stenosis.length);
  const double linear = 32.0 * viscous / (diameter * diameter) *
    (1e-3 * this->Settings_.viscosity) * 1e3 / area / PascalPerMmHg;
  this->Stenoses.push_back({ place.segment, place.abscissa, linear,
    JetLoss(this->Settings_.density, area, open * open * area), 0.0, {} });
}

void CoronaryFlow::MeasureResistances()
{
  this->AlongBranch.resize(this->Network_.Branches().size());
  for (std::size_t b = 0; b < this->AlongBranch.size(); ++b)
  {
    this->MeasureBranch(b);
  }
}

void CoronaryFlow::MeasureBranch(std::size_t branch)
{
  const double factor = PoiseuilleFactor(this->Settings_.viscosity);
  const std::vector<double>& s = this->Network_.Branches()[branch].abscissa;
  const std::vector<double>& radius = this->OpenRadius[branch];
  const std::vector<double>& healthy = this->HealthyRadius[branch];
  BranchResistance& along = this->AlongBranch[branch];
  along.actual.assign(s.size(), 0.0);
  along.healthy.assign(s.size(), 0.0);
  for (std::size_t k = 1; k < s.size(); ++k)
  {
    const double length = s[k] - s[k - 1];
    along.actual[k] =
      along.actual[k - 1] + factor * InverseFourth(length, radius[k - 1], radius[k]);
    along.healthy[k] =
      along.healthy[k - 1] + factor * InverseFourth(length, healthy[k - 1], healthy[k]);
  }
}

void CoronaryFlow::SetLumen(
  const std::vector<double>& radius, const std::vector<double>& instrument)
{
  std::vector<char> changed(this->OpenRadius.size(), 0);
  const auto branchOf = [&](std::int64_t point)
  {
    std::size_t b = 0;
    while (b + 1 < this->OpenRadius.size() && this->Network_.Branches()[b + 1].firstPoint <= point)
    {
      ++b;
    }
    return b;
  };
  std::size_t point = 0;
  for (std::size_t b = 0; b < this->OpenRadius.size(); ++b)
  {
    for (std::size_t k = 0; k < this->OpenRadius[b].size(); ++k, ++point)
    {
      double& open = this->OpenRadius[b][k];
      const double lumen = radius.at(point);
      const double now =
        lumen > this->Closed[b][k] ? AnnulusRadius(lumen, instrument.at(point)) : ClosedRadius;
      changed[b] |= now != open ? 1 : 0;
      open = now;
    }
    if (changed[b] != 0)
    {
      this->MeasureBranch(b);
    }
  }
  for (Stenosis& stenosis : this->Stenoses)
  {
    double least = 1e9;
    for (const std::int64_t one : stenosis.points)
    {
      const std::size_t b = branchOf(one);
      least = std::min(least, this->OpenRadius[b][one - this->Network_.Branches()[b].firstPoint]);
    }
    if (stenosis.points.empty())
    {
      continue;
    }
    // Nothing makes a jet where an instrument fills the lumen, or where it is wide.
    const double throat = Pi * least * least;
    const bool jet = throat < stenosis.area && least > 2.0 * ClosedRadius;
    stenosis.quadratic = jet ? JetLoss(this->Settings_.density, stenosis.area, throat) : 0.0;
    changed[this->Network_.Segments()[stenosis.segment].branch] = 1;
  }
  for (std::size_t s = 0; s < this->Losses.size(); ++s)
  {
    const FlowSegment& segment = this->Network_.Segments()[s];
    if (changed[segment.branch] != 0)
    {
      this->Losses[s] = this->LossBetween(static_cast<int>(s), segment.from, segment.to);
    }
  }
}

double CoronaryFlow::OpenTo(int segment) const
{
  const FlowSegment& here = this->Network_.Segments()[segment];
  const std::vector<double>& s = this->Network_.Branches()[here.branch].abscissa;
  for (std::size_t k = 0; k < s.size(); ++k)
  {
    const bool within = s[k] >= here.from && s[k] < here.to;
    if (within && this->Closed[here.branch][k] > 0.0 &&
      this->OpenRadius[here.branch][k] <= ClosedRadius)
    {
      return s[k];
    }
  }
  return here.to;
}

double CoronaryFlow::PressureAt(const CatheterTip& place) const
{
  const FlowNetwork::Place here = this->Network_.Locate(place);
  const FlowSegment& segment = this->Network_.Segments()[here.segment];
  const Loss loss = this->LossBetween(here.segment, segment.from, here.abscissa);
  const double flow = this->FlowAtBeginning(here.segment);
  return this->Pressure_[segment.above] - loss.linear * flow -
    loss.quadratic * std::abs(flow) * flow;
}

double CoronaryFlow::MeanAorticPressure() const
{
  double mean = 0.0;
  for (int k = 0; k < StepsOfCycle; ++k)
  {
    mean += AorticPressure(this->Settings_, (k + 1.0) / StepsOfCycle) / StepsOfCycle;
  }
  return this->PressureFactor * mean;
}

/// All outlets' resistances times a factor, until nothing moves any more.
CoronaryFlow CoronaryFlow::InSteadyFlow(double outletFactor) const
{
  constexpr int MostSteps = 200;
  CoronaryFlow steady = *this;
  steady.SetInjector(0.0, {});
  for (double& resistance : steady.OutletResistance_)
  {
    resistance *= outletFactor;
  }
  const double aortic = this->MeanAorticPressure();
  bool moved = true;
  for (int k = 0; k < MostSteps && moved; ++k)
  {
    const std::vector<double> before = steady.Pressure_;
    steady.SolveSteady(aortic);
    moved = !std::equal(before.begin(), before.end(), steady.Pressure_.begin(),
      [aortic](double a, double b) { return std::abs(a - b) < 1e-12 * aortic; });
  }
  return steady;
}

std::vector<double> CoronaryFlow::FlowReserves(const std::vector<CatheterTip>& places) const
{
  std::vector<double> reserves;
  if (!places.empty())
  {
    const CoronaryFlow steady = this->InSteadyFlow(1.0 / HyperaemicFlow);
    const double aortic = this->MeanAorticPressure();
    for (const CatheterTip& place : places)
    {
      reserves.push_back(steady.PressureAt(place) / aortic);
    }
  }
  return reserves;
}

std::vector<double> CoronaryFlow::TipFlows() const
{
  const CoronaryFlow steady = this->InSteadyFlow(1.0);
  const std::vector<FlowNode>& nodes = this->Network_.Nodes();
  std::vector<double> flows(nodes.size(), 0.0);
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    if (this->Network_.IsTip(static_cast<int>(n)))
    {
      flows[n] = steady.Flow_[nodes[n].above];
    }
  }
  return flows;
}

double CoronaryFlow::ResistanceTo(int branch, double abscissa) const
{
  const std::vector<double>& s = this->Network_.Branches()[branch].abscissa;
  const std::vector<double>& along = this->AlongBranch[branch].actual;
  const std::vector<double>& radius = this->OpenRadius[branch];
  if (abscissa >= s.back())
  {
    return along.back();
  }
  const std::size_t k =
    static_cast<std::size_t>(std::upper_bound(s.begin() + 1, s.end(), abscissa) - s.begin()) - 1;
  return along[k] +
    PoiseuilleFactor(this->Settings_.viscosity) *
    InverseFourth(abscissa - s[k], radius[k],
      radius[k] + (abscissa - s[k]) / (s[k + 1] - s[k]) * (radius[k + 1] - radius[k]));
}

CoronaryFlow::Loss CoronaryFlow::LossBetween(int segment, double from, double to) const
{
  const int branch = this->Network_.Segments()[segment].branch;
  Loss loss;
  loss.linear = this->ResistanceTo(branch, to) - this->ResistanceTo(branch, from);
  for (const Stenosis& stenosis : this->Stenoses)
  {
    if (stenosis.segment == segment && stenosis.abscissa > from && stenosis.abscissa <= to)
    {
      loss.linear += stenosis.linear;
      loss.quadratic += stenosis.quadratic;
    }
  }
  return loss;
}

void CoronaryFlow::ChooseOutletWeights()
{
  const std::vector<FlowSegment>& segments = this->Network_.Segments();
  this->Weight.assign(this->Network_.Nodes().size(), 0.0);
  for (std::size_t s = segments.size(); s-- > 0;)
  {
    const FlowSegment& segment = segments[s];
    if (this->Network_.IsTip(segment.below))
    {
      const double from = std::max(segment.from, segment.to - OutletLength);
      const double volume = this->Network_.VolumeAt(segment.branch, segment.to) -
        this->Network_.VolumeAt(segment.branch, from);
      const double radius = std::sqrt(1e3 * volume / (Pi * (segment.to - from)));
      this->Weight[segment.below] = std::pow(2.0 * radius, this->Settings_.outletExponent);
    }
    this->Weight[segment.above] += this->Weight[segment.below];
  }
}

void CoronaryFlow::ChoosePaths()
{
  const std::vector<FlowSegment>& segments = this->Network_.Segments();
  const auto isLad = [&](int s)
  {
    return this->Network_.Topology().groupName[segments[s].branch].find("LAD") != std::string::npos;
  };
  for (std::size_t t = 0; t < this->Network_.Roots().size(); ++t)
  {
    int node = this->Network_.Roots()[t];
    for (std::size_t s = 0; s < segments.size(); ++s)
    {
      if (this->Network_.Nodes()[segments[s].above].tree == static_cast<int>(t) &&
        isLad(static_cast<int>(s)))
      {
        node = segments[s].above;
        break;
      }
    }
    std::vector<int> path;
    double length = 0.0;
    while (!this->Network_.IsTip(node) && length < ReferenceLength)
    {
      const std::vector<int>& below = this->Network_.Nodes()[node].below;
      const int next = *std::max_element(below.begin(), below.end(),
        [&](int a, int b)
        {
          return std::make_pair(isLad(a), this->Weight[segments[a].below]) <
            std::make_pair(isLad(b), this->Weight[segments[b].below]);
        });
      path.push_back(next);
      length += segments[next].to - segments[next].from;
      node = segments[next].below;
    }
    this->Path.push_back(std::move(path));
    this->PathLength.push_back(std::min(length, ReferenceLength));
  }
}

double CoronaryFlow::AxialSpeed(int tree) const
{
  double left = this->PathLength[tree];
  double time = 0.0;
  for (const int s : this->Path[tree])
  {
    const FlowSegment& segment = this->Network_.Segments()[s];
    const double length = std::min(left, segment.to - segment.from);
    const double volume =
      this->Network_.VolumeAt(segment.branch, segment.from + length) - segment.volumeFrom;
    time += volume / (2.0 * this->Flow_[s]);
    left -= length;
  }
  return 0.1 * this->PathLength[tree] / time;
}

void CoronaryFlow::CalibrateMean(int tree, double target)
{
  const std::size_t nodes = this->Network_.Nodes().size();
  const std::vector<FlowSegment>& segments = this->Network_.Segments();
  const double aortic = this->MeanAorticPressure();
  const auto speed = [&](double scale)
  {
    for (std::size_t n = 0; n < nodes; ++n)
    {
      if (this->Network_.Nodes()[n].tree == tree || this->OutletResistance_[n] == 0.0)
      {
        this->OutletResistance_[n] = scale / this->Weight[n];
      }
    }
    this->SolveSteady(aortic);
    return this->AxialSpeed(tree);
  };
  const auto bisect = [&](double low, double high)
  {
    for (int k = 0; k < 60 && high / low > 1.0 + 1e-14; ++k)
    {
      const double middle = std::sqrt(low * high);
      (speed(middle) > target ? low : high) = middle;
    }
    return std::sqrt(low * high);
  };
  this->Losses.assign(segments.size(), Loss());
  const double ideal = bisect(1e-6, 1e12); // nothing is lost on the way to the outlets
  for (std::size_t s = 0; s < segments.size(); ++s)
  {
    const FlowBranch& branch = this->Network_.Branches()[segments[s].branch];
    const std::vector<double>& along = this->AlongBranch[segments[s].branch].healthy;
    const auto healthyTo = [&](double abscissa)
    {
      const auto k = std::clamp<std::ptrdiff_t>(
        std::lower_bound(branch.abscissa.begin(), branch.abscissa.end(), abscissa) -
          branch.abscissa.begin(),
        1, static_cast<std::ptrdiff_t>(along.size()) - 1);
      const double length = branch.abscissa[k] - branch.abscissa[k - 1];
      const double t = length > 0.0 ? (abscissa - branch.abscissa[k - 1]) / length : 1.0;
      return along[k - 1] + t * (along[k] - along[k - 1]);
    };
    this->Losses[s].linear = healthyTo(segments[s].to) - healthyTo(segments[s].from);
  }
  speed(bisect(ideal / HyperaemicFlow, ideal));
  for (std::size_t n = 0; n < nodes; ++n)
  {
    const double before = this->Settings_.arterialShare;
    this->Compliance[n] =
      this->Settings_.outletTime / (before * (1.0 - before) * this->OutletResistance_[n]);
  }
}

int CoronaryFlow::CyclesToSettle() const
{
  // To exp(-10) of what it was.
  return static_cast<int>(
    std::ceil(10.0 * this->Settings_.outletTime * this->Settings_.referenceHeartRate / 60.0));
}

double CoronaryFlow::PeriodicRatioParts(int tree, double fraction, double& systole)
{
  this->Fraction[tree] = fraction;
  double diastole = 0.0;
  const double dt = 60.0 / this->Settings_.referenceHeartRate / StepsOfCycle;
  const int cycles = 2 + this->CyclesToSettle();
  int inSystole = 0;
  systole = 0.0;
  this->Ventricular = VentricularPressure(this->Settings_, 0.0);
  for (int k = 0; k < cycles * StepsOfCycle; ++k)
  {
    const double phase = Modulo((k + 1.0) / StepsOfCycle);
    this->Advance(
      dt, AorticPressure(this->Settings_, phase), VentricularPressure(this->Settings_, phase));
    if (k >= (cycles - 1) * StepsOfCycle)
    {
      const double flow = this->Flow_[this->Path[tree].front()];
      const bool early = phase < this->Settings_.systoleEnd;
      (early ? systole : diastole) += flow;
      inSystole += early ? 1 : 0;
    }
  }
  systole /= inSystole;
  return diastole / (StepsOfCycle - inSystole);
}

void CoronaryFlow::CalibrateRatio(int tree, double target)
{
  double systole0 = 0.0;
  double systole1 = 0.0;
  const double diastole0 = this->PeriodicRatioParts(tree, 0.0, systole0);
  const double diastole1 = this->PeriodicRatioParts(tree, 1.0, systole1) - diastole0;
  systole1 -= systole0;
  // (diastole0 + f diastole1) = target (systole0 + f systole1)
  const double slope = diastole1 - target * systole1;
  this->Fraction[tree] =
    slope > 0.0 ? std::clamp((target * systole0 - diastole0) / slope, 0.0, 1.0) : 0.0;
}

/// Into the periodic flow's state at a phase.
void CoronaryFlow::Settle(double phase)
{
  const double dt = 60.0 / this->Settings_.referenceHeartRate / StepsOfCycle;
  const int steps = this->CyclesToSettle() * StepsOfCycle;
  this->Ventricular = VentricularPressure(this->Settings_, phase);
  for (int k = 1 - steps; k <= 0; ++k)
  {
    const double then = phase + static_cast<double>(k) / StepsOfCycle;
    this->Advance(
      dt, AorticPressure(this->Settings_, then), VentricularPressure(this->Settings_, then));
  }
}

void CoronaryFlow::SetOutletFactor(int tree, double factor)
{
  RequireFlow(factor > 0.0 && factor < 1e6, "factor of the outlets' resistance", factor, "above 0");
  this->OutletFactor[tree] = factor;
}

void CoronaryFlow::SolveSteady(double aortic)
{
  for (std::size_t n = 0; n < this->Demands.size(); ++n)
  {
    const bool tip = this->Network_.IsTip(static_cast<int>(n));
    const double conductance = tip ? 1.0 / this->OutletResistance_[n] : 0.0;
    this->Demands[n] = { conductance, conductance * this->Settings_.venousPressure };
  }
  this->DemandOfHoles();
  this->SolveTrees(aortic);
}

void CoronaryFlow::Advance(double dt, double aortic, double ventricular)
{
  const std::vector<FlowNode>& nodes = this->Network_.Nodes();
  const double share = this->Settings_.arterialShare;
  const auto parts = [&](std::size_t n, double& before, double& behind, double& storage)
  {
    const double whole = this->OutletResistance_[n] * this->OutletFactor[nodes[n].tree];
    before = 1.0 / (share * whole);
    behind = 1.0 / ((1.0 - share) * whole);
    storage = this->Compliance[n] / dt;
  };
  const auto supply = [&](std::size_t n, double behind, double storage)
  {
    const double squeeze = this->Fraction[nodes[n].tree] * (ventricular - this->Ventricular);
    return behind * this->Settings_.venousPressure + storage * (this->Compartment[n] + squeeze);
  };
  double before = 0.0;
  double behind = 0.0;
  double storage = 0.0;
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    this->Demands[n] = Demand();
    if (this->Network_.IsTip(static_cast<int>(n)))
    {
      parts(n, before, behind, storage);
      const double sum = before + behind + storage;
      this->Demands[n] = { before * (behind + storage) / sum,
        before * supply(n, behind, storage) / sum };
    }
  }
  this->DemandOfHoles();
  this->SolveTrees(aortic);
  for (std::size_t n = 0; n < nodes.size(); ++n)
  {
    if (this->Network_.IsTip(static_cast<int>(n)))
    {
      parts(n, before, behind, storage);
      this->Compartment[n] =
        (before * this->Pressure_[n] + supply(n, behind, storage)) / (before + behind + storage);
    }
  }
  this->Aortic = aortic;
  this->Ventricular = ventricular;
}

/// Nothing comes back through a hole.
void CoronaryFlow::DemandOfHoles()
{
  for (const Hole& hole : this->Holes)
  {
    if (this->Pressure_[hole.node] > hole.outside)
    {
      this->Demands[hole.node] = { hole.conductance, hole.conductance * hole.outside };
    }
  }
}

int CoronaryFlow::OpenHole(const CatheterTip& place)
{
  const double pressure = this->PressureAt(place);
  const int node = this->Network_.Split(place);
  const int number = this->Network_.Nodes()[node].above;
  const FlowSegment& upper = this->Network_.Segments()[number];
  const FlowSegment& lower = this->Network_.Segments()[number + 1];
  const auto twice = [number](auto& list) { list.insert(list.begin() + number + 1, list[number]); };
  twice(this->Flow_);
  twice(this->AtTop);
  twice(this->Losses);
  if (this->Injector_.segment == number && this->Injector_.abscissa > upper.to)
  {
    this->Flow_[number] -= this->Injection_;
    ++this->Injector_.segment;
  }
  else if (this->Injector_.segment > number)
  {
    ++this->Injector_.segment;
  }
  for (Stenosis& stenosis : this->Stenoses)
  {
    const bool behind = stenosis.segment == number && stenosis.abscissa > upper.to;
    stenosis.segment += stenosis.segment > number || behind ? 1 : 0;
  }
  for (std::vector<int>& path : this->Path)
  {
    for (std::size_t k = path.size(); k-- > 0;)
    {
      path[k] += path[k] > number ? 1 : 0;
      if (path[k] == number)
      {
        path.insert(path.begin() + static_cast<std::ptrdiff_t>(k) + 1, number + 1);
      }
    }
  }
  for (std::vector<double>* ofNodes : { &this->Weight, &this->OutletResistance_, &this->HealthyFlow,
         &this->Compliance, &this->Compartment })
  {
    ofNodes->push_back(0.0);
  }
  this->Demands.emplace_back();
  this->Pressure_.push_back(pressure);
  this->Losses[number] = this->LossBetween(number, upper.from, upper.to);
  this->Losses[number + 1] = this->LossBetween(number + 1, lower.from, lower.to);
  this->Holes.push_back({ node });
  return node;
}

void CoronaryFlow::SetHole(int node, double conductance, double outside)
{
  RequireFlow(
    conductance >= 0.0 && conductance < 1e6, "conductance of a hole", conductance, "at least 0");
  RequireFlow(std::isfinite(outside), "pressure outside of a hole", outside, "finite");
  const auto hole = std::find_if(
    this->Holes.begin(), this->Holes.end(), [node](const Hole& one) { return one.node == node; });
  RequireFlow(hole != this->Holes.end(), "node of a hole", node, "one that OpenHole gave");
  hole->conductance = conductance;
  hole->outside = outside;
}

double CoronaryFlow::LeakFlow(int node) const
{
  const auto hole = std::find_if(
    this->Holes.begin(), this->Holes.end(), [node](const Hole& one) { return one.node == node; });
  return hole != this->Holes.end() ? hole->flow : 0.0;
}

void CoronaryFlow::SetPressureFactor(double factor)
{
  RequireFlow(Within(factor, 0.0, 1.0), "factor of the pressures", factor, "0 to 1");
  this->PressureFactor = factor;
}

void CoronaryFlow::SolveTrees(double aortic)
{
  // A demand seen through a loss, which is linear about the flow of the step before.
  struct Linear
  {
    double resistance;
    double offset; // pressure loss = resistance Q - offset
    Linear(const Loss& loss, double flow)
      : resistance(loss.linear + 2.0 * loss.quadratic * std::abs(flow))
      , offset(loss.quadratic * std::abs(flow) * flow)
    {
    }
    Demand Through(const Demand& behind) const
    {
      const double scale = 1.0 / (1.0 + behind.conductance * this->resistance);
      return { scale * behind.conductance,
        scale * (behind.offset - behind.conductance * this->offset) };
    }
    double Lost(double flow) const { return this->resistance * flow - this->offset; }
  };
  const std::vector<FlowSegment>& segments = this->Network_.Segments();
  const int injected = this->Injector_.segment;
  const double injection = this->Injection_;
  const double flowBelow = injected >= 0 ? this->Flow_[injected] : 0.0;
  const Linear upper(this->AboveInjector, flowBelow - injection);
  const Linear lower(this->BelowInjector, flowBelow);

  // `Demands` are those of the tips now, and become those of all that is beyond a node.
  for (std::size_t s = segments.size(); s-- > 0;)
  {
    Demand demand = this->Demands[segments[s].below];
    if (static_cast<int>(s) == injected)
    {
      demand = lower.Through(demand);
      demand.offset += injection;
      demand = upper.Through(demand);
    }
    else
    {
      demand = Linear(this->Losses[s], this->Flow_[s]).Through(demand);
    }
    this->AtTop[s] = demand;
    this->Demands[segments[s].above].conductance += demand.conductance;
    this->Demands[segments[s].above].offset += demand.offset;
  }
  for (const int root : this->Network_.Roots())
  {
    this->Pressure_[root] = aortic;
  }
  for (std::size_t s = 0; s < segments.size(); ++s)
  {
    const double above = this->Pressure_[segments[s].above];
    const double flow = this->AtTop[s].conductance * above - this->AtTop[s].offset;
    const bool here = static_cast<int>(s) == injected;
    const double lost = here ? upper.Lost(flow) + lower.Lost(flow + injection)
                             : Linear(this->Losses[s], this->Flow_[s]).Lost(flow);
    this->Pressure_[segments[s].below] = above - lost;
    this->Flow_[s] = here ? flow + injection : flow;
  }
  for (Hole& hole : this->Holes)
  {
    const FlowNode& node = this->Network_.Nodes()[hole.node];
    const double out = this->Flow_[node.above] - this->FlowAtBeginning(node.below.front());
    hole.flow = hole.conductance > 0.0 ? std::max(0.0, out) : 0.0;
  }
}

void CoronaryFlow::SetInjector(double injection, const CatheterTip& tip)
{
  this->Injector_ = FlowNetwork::Place();
  this->Injection_ = 0.0;
  if (injection > 0.0 && tip.branch >= 0)
  {
    this->Injector_ = this->Network_.Locate(tip);
    this->Injection_ = injection;
    const int s = this->Injector_.segment;
    const FlowSegment& segment = this->Network_.Segments()[s];
    this->AboveInjector = this->LossBetween(s, segment.from, this->Injector_.abscissa);
    this->BelowInjector = this->LossBetween(s, this->Injector_.abscissa, segment.to);
  }
}

void CoronaryFlow::Step(
  double dt, double phase, double heartRate, double injection, const CatheterTip& tip)
{
  RequireFlow(dt > 0.0 && dt < 1e6, "time step", dt, "above 0 s");
  RequireFlow(std::isfinite(phase), "phase", phase, "finite");
  RequireFlow(Within(heartRate, 0.0, 1000.0), "heart rate", heartRate, "0 to 1000 per minute");
  RequireFlow(Within(injection, 0.0, 1000.0), "injection", injection, "0 to 1000 mL/s");
  if (!this->Started)
  {
    this->SetInjector(0.0, tip);
    this->Settle(phase - dt * heartRate / 60.0);
    this->Started = true;
  }
  this->SetInjector(injection, tip);
  const double ventricular = this->PressureFactor * VentricularPressure(this->Settings_, phase);
  if (heartRate == 0.0)
  {
    this->Ventricular = ventricular;
  }
  this->Advance(dt, this->PressureFactor * AorticPressure(this->Settings_, phase), ventricular);
}

double CoronaryFlow::FlowAtBeginning(int segment) const
{
  return this->Flow_[segment] - (segment == this->Injector_.segment ? this->Injection_ : 0.0);
}

double CoronaryFlow::TreeFlow(int tree) const
{
  double flow = 0.0;
  for (const int s : this->Network_.Nodes()[this->Network_.Roots()[tree]].below)
  {
    flow += this->FlowAtBeginning(s);
  }
  return flow;
}

std::uint64_t CoronaryFlow::StateHash(std::uint64_t before) const
{
  std::uint64_t hash = before;
  for (const std::vector<double>* list :
    { &this->Flow_, &this->Pressure_, &this->Compartment, &this->OutletFactor })
  {
    hash = Fnv1a(list->data(), list->size() * sizeof(double), hash);
  }
  for (const Hole& hole : this->Holes)
  {
    for (const double value : { hole.conductance, hole.outside, this->PressureFactor })
    {
      hash = Fnv1a(&value, sizeof(value), hash);
    }
  }
  return Fnv1a(&this->Ventricular, sizeof(this->Ventricular), hash);
}
}
