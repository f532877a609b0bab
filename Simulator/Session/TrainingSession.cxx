#include "TrainingSession.h"

#include "AortaMotion.h"
#include "Attenuation.h"
#include "ExposureControl.h"
#include "Fnv1a.h"
#include "GuideLumen.h"
#include "HandAxes.h"
#include "Numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

namespace coronary
{
namespace
{
constexpr double ContrastStep = 0.005;    // s
constexpr double GoalStep = 0.05;         // s
constexpr double FlushSpeed = 3.0;        // mL/s
constexpr double FastestInjection = 12.0; // mL/s: no hand and no injector of a laboratory does more
constexpr double NearestDetector = 50.0;  // mm behind the isocentre
constexpr double FurthestDetector = 1500.0; // mm from the source
constexpr double FurthestTable = 500.0;     // mm

constexpr double PlacedFor = 0.3; // s that a guide has to lie so, to be told

enum class GuidePlace : int
{
  Aorta,
  Ostium,
  Deep
};

GuidePlace PlaceOf(const GuideSeat& seat)
{
  return seat.Deep() ? GuidePlace::Deep : seat.engaged ? GuidePlace::Ostium : GuidePlace::Aorta;
}

const char* KindOf(const Guidewire&)
{
  return "wire";
}

const char* KindOf(const BalloonCatheter& balloon)
{
  return balloon.Kind();
}

double Limited(double value, double low, double high, double otherwise)
{
  return std::isfinite(value) ? std::clamp(value, low, high) : otherwise;
}

InterventionSettings WithRoot(const WallMotion& wall, const Scenario& scenario)
{
  InterventionSettings settings = scenario.settings;
  settings.guideFromArch = settings.guideFromArch && wall.Topology().aorta;
  if (settings.rootBranch < 0)
  {
    settings.rootBranch = RootBranch(wall.Topology(), scenario.artery);
  }
  return settings;
}

AcquisitionSettings AcquisitionOf(const Scenario& scenario)
{
  AcquisitionSettings settings;
  settings.tickRate = static_cast<int>(std::lround(scenario.settings.tickRate));
  settings.fluoroscopyRate = FrameRateOf(scenario.imaging.frameRate);
  settings.cineRate = FrameRateOf(scenario.imaging.cineRate);
  return settings;
}
}

struct TrainingSession::Internals
{
  Internals(std::shared_ptr<WallMotion> motion, const Scenario& scenario,
    std::shared_ptr<const VolumeProjector> patient)
    : Wall(std::move(motion))
    , Settings(WithRoot(*this->Wall, scenario))
    , Imaging(scenario.imaging)
    , Physics(this->Wall, scenario.wire, scenario.catheter, this->Settings, scenario.balloon,
        scenario.secondWire)
    , Medium(this->Wall->Topology(), scenario.contrast, scenario.seed)
    , Watch(this->Wall->Topology(), this->Medium, this->Physics.Mouths())
    , Incidents(this->Medium.FlowModel().Network())
    , Tears(this->Medium.FlowModel().Network(), this->Settings.sealTime)
    , Heart(this->Medium.FlowModel())
    , Clock(AcquisitionOf(scenario))
    , Breath(scenario.imaging.breathing)
    , HeartRate(this->Settings.heartRate)
    , TicksOfContrast(std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(std::lround(this->Settings.tickRate * ContrastStep))))
    , TicksOfProcedure(std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(std::lround(this->Settings.tickRate * GoalStep))))
    , Field(scenario.imaging.fieldOfView)
    , GuideRadius(scenario.catheter.innerRadius)
  {
    if (scenario.contrast.guideLumen)
    {
      this->Guide.emplace(scenario.catheter.innerRadius, scenario.catheter.length);
    }
    this->Pose = scenario.imaging.pose;
    this->SetField();
    this->Artery = scenario.artery == "any" ? "artery" : scenario.artery;
    if (patient && this->Imaging.exposureControl)
    {
      this->Control.emplace(
        std::move(patient), Attenuation(this->Imaging.energy).Of(XRayMaterial::Water));
    }
    this->Planned = scenario.incidents;
    this->Happened.assign(this->Planned.size(), 0);
    for (const Incident& incident : this->Planned)
    {
      if (!incident.vessel.empty())
      {
        this->Incidents.BranchesNamed(incident.vessel);
      }
    }
    this->Steps = scenario.procedure;
    this->Procedure.emplace(this->Steps, this->Wall->Topology(),
      this->Watch.Results(this->Physics, this->Medium), scenario.balloon.has_value(),
      this->Watch.Mouths(this->Physics, this->Medium));
    for (std::size_t n = 0; const BalloonCatheter* one = BalloonOf(scenario, n); ++n)
    {
      RequireFit(*one, scenario.catheter);
      this->Balloons.push_back(*one);
    }
    for (std::size_t n = 0; const Guidewire* one = WireOf(scenario, n); ++n)
    {
      RequireFit(*one, scenario.catheter);
      this->Wires.push_back(*one);
      for (const BalloonCatheter& balloon : this->Balloons)
      {
        RequireFit(*one, balloon);
        if (scenario.secondWire)
        {
          RequireFitBeside(balloon, *one, scenario.catheter);
        }
      }
    }
    this->WireNumbers = { 0, scenario.secondWire ? this->Wires.size() - 1 : 0 };
  }

  void SetView(const SessionInput& input);
  void SetField();
  DetectorFormat Format() const;
  void ControlExposure(const SessionInput& input);
  void StepContrast(const SessionInput& input);
  double PushedMedium(const SessionInput& input, double seconds);
  void StepGuide(double seconds, double pushed);
  void StepTears(double seconds);
  void StepIncidents(double seconds, double pushed);
  void Happen(const Incident& incident);
  void BlockWithAir(double volume, const std::string& vessel);
  bool Call(double number);
  bool Flush(double volume);
  double EngagedShare() const;
  double PlaceInAorta() const;
  ContrastBalance Balance() const;
  void StepIschaemia(double seconds);
  void Measure(const SessionInput& input);
  void MeasureHands(const SessionInput& input);
  void StepProcedure();
  void TellOfGuide();
  /// mmHg at the guide's tip. Vessels whose blood is squeezed out collapse, which the network does not know: no less than the
  /// atrium's.
  double TipPressure() const
  {
    const TickReport& tick = this->Report.tick;
    const CoronaryFlow& flow = this->Medium.FlowModel();
    return tick.seat.engaged ? std::max(flow.Settings().venousPressure,
                                 flow.PressureAt({ this->Settings.rootBranch, tick.catheterTip }))
                             : this->Medium.AorticPressure();
  }
  bool TakeWire(double number);
  template <typename Instrument>
  bool Exchange(
    double number, const std::vector<Instrument>& list, std::size_t& inUse, const char* what);

  std::shared_ptr<WallMotion> Wall;
  InterventionSettings Settings;
  ImagingSettings Imaging;
  Intervention Physics;
  ContrastModel Medium;
  LesionWatch Watch;
  VesselIncidents Incidents;
  VesselTears Tears;
  std::vector<Incident> Planned; // of the scenario
  std::vector<char> Happened;    // of these
  double InjectedAir = 0.0;      // mL in the aorta, so far
  double AirAtHub = 0.0;         // mL that come in with the next step
  std::string AirGoesTo;         // vessel of the last air; empty: where most blood flows
  double Drawn = 0.0;            // mL of this step
  Ischaemia Heart;
  std::vector<ProcedureStep> Steps;
  std::optional<ProcedureWatch> Procedure;
  double LastMoved = 0.0; // s
  std::string Artery;
  ///@{
  /// Of a guide from the arch: how it was told to lie, how it lies, and since when, s.
  GuidePlace ToldPlace = GuidePlace::Aorta;
  GuidePlace LastPlace = GuidePlace::Aorta;
  double PlacedSince = 0.0;
  ///@}
  std::vector<BalloonCatheter> Balloons;
  std::size_t BalloonNumber = 0;
  std::vector<Guidewire> Wires;
  std::array<std::size_t, TickReport::MostWires> WireNumbers{}; // in use
  std::size_t InHand = 0;
  ExposureClock Clock;
  std::optional<ExposureControl> Control; // none: the dose is always the same
  std::optional<std::pair<CArmPose, DetectorFormat>> Measured;
  Breathing Breath;
  double HeartRate;
  std::uint64_t TicksOfContrast;
  std::uint64_t TicksOfProcedure;
  double Field;
  Collimation Shutters;
  double GuideRadius;              // mm, of its lumen
  std::optional<GuideLumen> Guide; // none: it is as if it were without volume
  bool GuideUsed = false;          // something was pushed or drawn
  double Flushing = 0.0;  // mL of saline that are still to be pushed; negative: to be drawn back
  double Pushed = 0.0;    // mL of contrast medium into the guide, so far
  double DrawnBack = 0.0; // mL of it that came back
  CArmPose Pose;
  SessionReport Report;
  SessionMetrics Metrics;
  SessionInput Start;
  SessionInput Last;
  double Plunger = 0.0;   // mL
  double Delivered = 0.0; // mL: where the plunger would be for what has left the syringe
  bool FarTooFast = false;
  std::vector<std::string> Messages;
  std::uint64_t Tick = 0;
};

DetectorFormat TrainingSession::Internals::Format() const
{
  return { this->Imaging.columns, this->Imaging.columns, this->Field, this->Field };
}

void TrainingSession::Internals::SetField()
{
  this->Clock.SetFieldArea(ReferenceFieldArea(this->Pose, this->Format(), this->Shutters));
}

/// Looks through the patient when a frame is due from another view than the last one's.
void TrainingSession::Internals::ControlExposure(const SessionInput& input)
{
  if (!this->Control || (input.pedals & (FluoroscopyPedal | CinePedal)) == 0 ||
    !this->Clock.IsDue())
  {
    return;
  }
  const std::pair view(this->Pose, this->Format());
  if (this->Measured != view)
  {
    this->Clock.SetView(this->Control->Of(view.first, view.second));
    this->Measured = view;
  }
}

void TrainingSession::Internals::SetView(const SessionInput& input)
{
  const CArmPose before = this->Pose;
  const CArmPose& start = this->Imaging.pose;
  constexpr HandAxis Primary = HandAxisTable[IndexOf(AxisKind::Primary)];
  constexpr HandAxis Secondary = HandAxisTable[IndexOf(AxisKind::Secondary)];
  this->Pose.primary = Limited(input.primary, Primary.low, Primary.high, before.primary);
  this->Pose.secondary = Limited(input.secondary, Secondary.low, Secondary.high, before.secondary);
  this->Pose.sourceToDetector = Limited(input.sourceToDetector,
    start.sourceToIsocentre + NearestDetector, FurthestDetector, before.sourceToDetector);
  for (int axis = 0; axis < 3; ++axis)
  {
    this->Pose.isocentre[axis] = start.isocentre[axis] +
      Limited(input.table[axis], -FurthestTable, FurthestTable,
        before.isocentre[axis] - start.isocentre[axis]);
  }
  if (this->Pose.sourceToDetector != before.sourceToDetector)
  {
    this->SetField();
  }
}

/// mL that the syringe pushes in a step.
double TrainingSession::Internals::PushedMedium(const SessionInput& input, double seconds)
{
  const double plunger = std::isfinite(input.syringe) ? input.syringe : this->Plunger;
  // Drawing back stops the flow and fills the syringe: it goes on from there.
  this->Delivered = plunger < this->Plunger ? plunger : this->Delivered;
  this->Plunger = plunger;
  const double wanted = plunger - this->Delivered;
  const double pushed = std::clamp(wanted, 0.0, FastestInjection * seconds);
  this->Delivered += pushed;
  if (wanted > 2.0 && !this->FarTooFast)
  {
    this->Messages.emplace_back("The syringe is pushed faster than contrast medium can flow.");
  }
  this->FarTooFast = wanted > 2.0;
  return pushed;
}

/// Of what leaves the tip: the part of its lumen's section that lies in the artery's.
double TrainingSession::Internals::EngagedShare() const
{
  const TickReport& tick = this->Report.tick;
  if (tick.catheterTip < 0.0)
  {
    return 0.0;
  }
  const double b =
    this->Medium.FlowModel().Network().RadiusAt(this->Settings.rootBranch, tick.catheterTip);
  const double a = std::min(this->GuideRadius, b);
  const double d = tick.seat.engaged ? tick.seat.offset : 0.0;
  if (d <= b - a)
  {
    return 1.0;
  }
  if (d >= a + b)
  {
    return 0.0;
  }
  // Two circles' lens.
  const double x = (d * d + a * a - b * b) / (2.0 * d);
  const double y = std::sqrt(std::max(0.0, a * a - x * x));
  const double lens = a * a * std::acos(std::clamp(x / a, -1.0, 1.0)) +
    b * b * std::acos(std::clamp((d - x) / b, -1.0, 1.0)) - d * y;
  return lens / (Pi * a * a);
}

/// mm from the valve, of the guide's tip.
double TrainingSession::Internals::PlaceInAorta() const
{
  const std::vector<Vector3>& sections = this->Medium.Aorta().Sections().points;
  const std::vector<Vector3>& line = this->Physics.CatheterLine();
  return sections.empty() || line.empty() ? 0.0 : PlaceAlong(sections, line.front());
}

/// @param pushed  mL of contrast medium
void TrainingSession::Internals::StepGuide(double seconds, double pushed)
{
  // One hand: saline waits for the syringe.
  const double flush =
    pushed > 0.0 ? 0.0 : std::clamp(this->Flushing, -FlushSpeed * seconds, FlushSpeed * seconds);
  this->Flushing -= flush;
  this->Pushed += pushed;
  this->GuideUsed = this->GuideUsed || pushed > 0.0 || flush != 0.0;
  this->Drawn = std::max(0.0, -flush);
  GuideLumen::Outflow out = this->Guide->Push({ std::exchange(this->AirAtHub, 0.0), 0.0, true });
  const GuideLumen::Outflow syringe = this->Guide->Push({ pushed, 1.0, false });
  const GuideLumen::Outflow saline = this->Guide->Push({ flush, 0.0, false });
  this->DrawnBack += this->Guide->Draw(-flush).medium;
  for (const GuideLumen::Outflow& more : { syringe, saline })
  {
    out.liquid += more.liquid;
    out.medium += more.medium;
    out.air += more.air;
  }
  if (out.air > 0.0)
  {
    this->BlockWithAir(out.air, this->AirGoesTo);
  }
  const double share = this->EngagedShare();
  const double medium = out.liquid > 0.0 ? std::min(1.0, out.medium / out.liquid) : 1.0;
  const double flow = out.liquid / seconds;
  this->Report.injection = flow;
  const bool inAorta = share == 0.0;
  this->Medium.Step(seconds, this->Report.tick.phase, this->HeartRate,
    inAorta ? flow : share * flow,
    { inAorta ? -1 : this->Settings.rootBranch,
      inAorta ? this->PlaceInAorta() : this->Report.tick.catheterTip },
    medium, inAorta ? 0.0 : (1.0 - share) * flow * medium);
}

void TrainingSession::Internals::StepContrast(const SessionInput& input)
{
  const double seconds = static_cast<double>(this->TicksOfContrast) / this->Settings.tickRate;
  const double pushed = this->PushedMedium(input, seconds);
  this->StepIncidents(seconds, pushed);
  if (this->Settings.wallTears)
  {
    this->StepTears(seconds);
  }
  this->Watch.StepFlow(seconds, this->Physics, this->Incidents, this->Tears, this->Medium);
  this->StepIschaemia(seconds);
  if (this->Guide)
  {
    this->StepGuide(seconds, pushed);
    return;
  }
  this->Report.injection = pushed / seconds;
  const double place = this->Report.tick.catheterTip;
  this->Medium.Step(seconds, this->Report.tick.phase, this->HeartRate, this->Report.injection,
    { place >= 0.0 ? this->Settings.rootBranch : -1,
      place >= 0.0     ? place
        : pushed > 0.0 ? this->PlaceInAorta()
                       : 0.0 });
}

void TrainingSession::Internals::StepTears(double seconds)
{
  SessionMetrics& metrics = this->Metrics;
  this->Tears.Step(seconds, metrics.procedureSeconds, this->Physics, *this->Wall, this->Medium,
    this->Watch, this->Messages);
  metrics.pericardialBlood = this->Tears.Sac().Volume();
  metrics.pericardialPressure = this->Tears.Sac().Pressure();
  metrics.strokeShare = this->Tears.Sac().StrokeFactor();
  metrics.openHoles = this->Tears.OpenHoles();
}

void TrainingSession::Internals::StepIncidents(double seconds, double pushed)
{
  const TickReport& tick = this->Report.tick;
  const auto isNow = [&](const Incident& incident)
  {
    const std::vector<std::string>& names = this->Wall->Topology().groupName;
    switch (incident.when)
    {
      case Incident::When::Time:
        return static_cast<double>(this->Tick) >= incident.at * this->Settings.tickRate;
      case Incident::When::Injection:
        return pushed > 0.0;
      case Incident::When::Inflation:
        return tick.balloon.wallPressure > 0.0;
      case Incident::When::WireIn:
        return tick.branch >= 0 && names[static_cast<std::size_t>(tick.branch)] == incident.vessel;
      case Incident::When::Called:
        break;
    }
    return false;
  };
  for (std::size_t n = 0; n < this->Planned.size(); ++n)
  {
    if (this->Happened[n] == 0 && isNow(this->Planned[n]))
    {
      this->Happened[n] = 1;
      this->Happen(this->Planned[n]);
    }
  }
  if (this->Incidents.Any())
  {
    const bool blocked = this->Incidents.Blocked();
    this->Incidents.Step(seconds, tick.catheterTip >= 0.0 ? this->Drawn : 0.0);
    if (blocked && !this->Incidents.Blocked())
    {
      this->Messages.emplace_back("The air in the arteries is gone.");
    }
  }
}

void TrainingSession::Internals::Happen(const Incident& incident)
{
  if (incident.kind == Incident::Kind::Spasm)
  {
    this->Incidents.BeginSpasm(incident.vessel, incident.narrowing, incident.onset);
    char text[160];
    std::snprintf(text, sizeof(text), "Vasospasm: the %s narrows by %.0f %%.",
      incident.vessel.c_str(), 100.0 * incident.narrowing);
    this->Watch.Note({ ProcedureEvent::Kind::Spasm, this->Metrics.procedureSeconds,
                       this->Incidents.BranchesNamed(incident.vessel).front(), incident.narrowing },
      text, this->Messages);
    return;
  }
  this->AirGoesTo = incident.vessel;
  if (!this->Guide)
  {
    this->BlockWithAir(incident.volume, incident.vessel);
    return;
  }
  this->AirAtHub += incident.volume;
  char text[120];
  std::snprintf(
    text, sizeof(text), "%.2g mL of air have come into the guide catheter's hub.", incident.volume);
  this->Messages.emplace_back(text);
}

/// Out of the guide's tip.
void TrainingSession::Internals::BlockWithAir(double volume, const std::string& vessel)
{
  if (this->Report.tick.catheterTip < 0.0)
  {
    if (this->InjectedAir == 0.0)
    {
      this->Messages.emplace_back("Air goes out of the guide catheter into the aorta.");
    }
    this->InjectedAir += volume;
    return;
  }
  const bool before = this->Incidents.Blocked();
  const int branch = this->Incidents.AddAir(
    volume, vessel, this->Medium.FlowModel().Flow(), this->Settings.rootBranch);
  if (!before)
  {
    const double all = volume + (this->Guide ? this->Guide->Air() : 0.0);
    this->Watch.Note({ ProcedureEvent::Kind::Air, this->Metrics.procedureSeconds, branch, all },
      "Air goes into the coronary artery: no blood passes it in the " +
        this->Wall->Topology().groupName[static_cast<std::size_t>(branch)] + ".",
      this->Messages);
  }
}

/// @param number  of the scenario's event, from 1 on; 0: nitrates
bool TrainingSession::Internals::Call(double number)
{
  if (number == 0.0)
  {
    this->Incidents.GiveNitrates();
    this->Messages.emplace_back("Nitrates are given.");
    return true;
  }
  if (!(number >= 1.0) || number > static_cast<double>(this->Planned.size()) ||
    number != std::floor(number))
  {
    char text[120];
    std::snprintf(text, sizeof(text), "There is no event number %g: the scenario has %zu.", number,
      this->Planned.size());
    this->Messages.emplace_back(text);
    return false;
  }
  const auto n = static_cast<std::size_t>(number) - 1;
  this->Happened[n] = 1;
  this->Happen(this->Planned[n]);
  return true;
}

/// @param volume  mL of saline; negative: drawn back
bool TrainingSession::Internals::Flush(double volume)
{
  if (!this->Guide)
  {
    this->Messages.emplace_back(
      "The guide catheter has no volume in this scenario: it cannot be flushed.");
    return false;
  }
  this->Flushing = volume;
  return true;
}

ContrastBalance TrainingSession::Internals::Balance() const
{
  ContrastBalance balance = this->Medium.Balance();
  if (this->Guide)
  {
    balance.inGuide = this->Guide->Medium() + this->DrawnBack;
    balance.injected = this->Pushed;
  }
  return balance;
}

void TrainingSession::Internals::StepIschaemia(double seconds)
{
  if (this->Watch.FlowIsNew())
  {
    this->Heart.SetFlow(this->Medium.FlowModel());
  }
  const bool before = this->Heart.IsElevated();
  this->Heart.Step(seconds);
  const bool now = this->Heart.IsElevated();
  SessionMetrics& metrics = this->Metrics;
  metrics.stShift = this->Heart.StShift();
  metrics.greatestStShift = std::max(metrics.greatestStShift, metrics.stShift);
  metrics.elevatedSeconds += metrics.stShift >= Ischaemia::Elevated ? seconds : 0.0;
  if (now && !before)
  {
    this->Watch.TellIschaemia(
      this->Heart, metrics.procedureSeconds, this->Report.tick.balloon.middle, this->Messages);
  }
  else if (before && !now)
  {
    this->Messages.emplace_back("The ST segment is back.");
  }
}

void TrainingSession::Internals::Measure(const SessionInput& input)
{
  SessionMetrics& metrics = this->Metrics;
  const TickReport& tick = this->Report.tick;
  const double seconds = 1.0 / this->Settings.tickRate;
  metrics.procedureSeconds = static_cast<double>(this->Tick) * seconds;
  const DoseCounters total = this->Clock.Total();
  metrics.fluoroscopySeconds = total.seconds;
  metrics.cineSeconds = this->Clock.Cine().seconds;
  metrics.frames = total.frames;
  metrics.airKerma = total.airKerma;
  metrics.doseAreaProduct = total.doseAreaProduct;
  metrics.contrast = this->Guide ? this->Pushed : this->Medium.Tracers().Injected();
  metrics.maximumWallForce = std::max(metrics.maximumWallForce, tick.maximumForce);
  metrics.maximumTipForce = std::max(metrics.maximumTipForce, tick.tipForce);
  metrics.forcefulSeconds += tick.tipForce > ForcefulTip ? seconds : 0.0;
  metrics.occludedSeconds += tick.balloon.wallPressure > 0.0 ? seconds : 0.0;
  if (this->Settings.wallTears)
  {
    this->Tears.Press(
      tick.tipThrust, PunctureForce(this->Wires[this->WireNumbers[this->InHand]]), seconds);
  }
  this->MeasureHands(input);
  metrics.deepest = std::max(metrics.deepest, tick.inserted);
  if (tick.branch >= 0 &&
    std::find(metrics.branches.begin(), metrics.branches.end(), tick.branch) ==
      metrics.branches.end())
  {
    metrics.branches.push_back(tick.branch);
  }
  if (!this->Balloons.empty())
  {
    this->Watch.StepTick(
      metrics.procedureSeconds, this->Physics, this->Balloons[this->BalloonNumber], this->Messages);
  }
  if (metrics.events.size() < this->Watch.Events().size())
  {
    metrics.events = this->Watch.Events();
  }
  if (this->Settings.guideFromArch && this->Tick % this->TicksOfProcedure == 0)
  {
    this->TellOfGuide();
  }
  if (!this->Procedure->Done() && this->Tick % this->TicksOfProcedure == 0)
  {
    this->StepProcedure();
  }
}

void TrainingSession::Internals::TellOfGuide()
{
  const GuideSeat& seat = this->Report.tick.seat;
  const GuidePlace place = PlaceOf(seat);
  const double now = this->Metrics.procedureSeconds;
  this->PlacedSince = place == this->LastPlace ? this->PlacedSince : now;
  this->LastPlace = place;
  if (place == this->ToldPlace || now - this->PlacedSince < PlacedFor)
  {
    return;
  }
  this->ToldPlace = place;
  char text[160];
  switch (place)
  {
    case GuidePlace::Aorta:
      std::snprintf(text, sizeof(text), "The guide catheter has left the ostium of the %s.",
        this->Artery.c_str());
      break;
    case GuidePlace::Ostium:
      std::snprintf(text, sizeof(text),
        "The guide catheter is in the ostium of the %s: %.1f mm deep, %.0f degrees off its axis%s.",
        this->Artery.c_str(), seat.depth, seat.angle / Degree,
        seat.Coaxial() ? "" : ", not coaxial");
      break;
    case GuidePlace::Deep:
      std::snprintf(text, sizeof(text), "The guide catheter is deep in the %s: %.1f mm.",
        this->Artery.c_str(), seat.depth);
      break;
  }
  this->Messages.emplace_back(text);
}

void TrainingSession::Internals::MeasureHands(const SessionInput& input)
{
  SessionMetrics& metrics = this->Metrics;
  const double seconds = 1.0 / this->Settings.tickRate;
  const double travel = std::abs(input.drive.wirePosition - this->Last.drive.wirePosition);
  const double turn = std::abs(input.drive.wireAngle - this->Last.drive.wireAngle);
  metrics.wireTravel += std::isfinite(travel) ? travel : 0.0;
  metrics.wireTurning += std::isfinite(turn) ? turn : 0.0;
  const bool radiates = this->Clock.Radiating();
  if (!radiates && this->Report.tick.inserted > 0.0)
  {
    metrics.blindTravel += std::isfinite(travel) ? travel : 0.0;
  }
  const auto values = [](const SessionInput& hands)
  {
    return std::array<double, 13>{ hands.drive.wirePosition, hands.drive.wireAngle,
      hands.drive.catheterPosition, hands.drive.catheterAngle, hands.drive.balloonPosition,
      hands.drive.inflation, hands.syringe, hands.primary, hands.secondary, hands.sourceToDetector,
      hands.table.x(), hands.table.y(), hands.table.z() };
  };
  if (!radiates || values(input) != values(this->Last))
  {
    this->LastMoved = metrics.procedureSeconds;
  }
  metrics.idleBeamSeconds +=
    metrics.procedureSeconds - this->LastMoved > LongestLook ? seconds : 0.0;
}

void TrainingSession::Internals::StepProcedure()
{
  const bool lesions = this->Procedure->NeedsLesions();
  this->Procedure->Step({ this->Report.tick, this->Metrics, this->Pose,
                          this->Clock.Radiating() && this->Clock.Last().cine, this->Clock.Runs(),
                          this->Medium.Tracers().Injected(), this->WireNumbers[this->InHand],
                          this->BalloonNumber, &this->Tears.All() },
    lesions ? this->Watch.Results(this->Physics, this->Medium) : std::vector<LesionResult>(),
    lesions ? this->Watch.Stents(this->Physics) : std::vector<StentResult>(), this->Messages,
    lesions ? this->Watch.Mouths(this->Physics, this->Medium) : std::vector<MouthResult>());
}

/// @param number  in `list`, becomes `inUse`  @return false: there is none
template <typename Instrument>
bool TrainingSession::Internals::Exchange(
  double number, const std::vector<Instrument>& list, std::size_t& inUse, const char* what)
{
  const bool known =
    number >= 0.0 && number < static_cast<double>(list.size()) && number == std::floor(number);
  if (!known)
  {
    char text[120];
    std::snprintf(text, sizeof(text), "There is no %s number %g: the scenario has %zu.", what,
      number, list.size());
    this->Messages.emplace_back(text);
    return false;
  }
  const auto wanted = static_cast<std::size_t>(number);
  if (this->Physics.Exchange(list[wanted]))
  {
    inUse = wanted;
    this->Messages.push_back(
      std::string("The ") + KindOf(list[wanted]) + " '" + list[wanted].name + "' is taken.");
  }
  return true;
}

/// @return false: there is no such wire
bool TrainingSession::Internals::TakeWire(double number)
{
  static const char* const names[] = { "first", "second" };
  if (number != 0.0 && (number != 1.0 || this->Physics.NumberOfWires() < 2))
  {
    this->Messages.emplace_back("There is no second wire in this scenario.");
    return false;
  }
  const auto wanted = static_cast<std::size_t>(number);
  if (wanted != this->InHand)
  {
    this->InHand = wanted;
    this->Physics.TakeWire(wanted);
    this->Messages.push_back(std::string("The hand is on the ") + names[wanted] + " wire.");
  }
  return true;
}

RecordingHeader HeaderOf(const Scenario& scenario, std::uint64_t wallHash, const std::string& build,
  const std::string& started)
{
  RecordingHeader header;
  header.build = build;
  header.scenario = ScenarioText(scenario);
  header.meshHash = wallHash;
  header.seed = scenario.seed;
  header.tickRate = scenario.settings.tickRate;
  header.started = started;
  return header;
}

RecordedForces ForcesOf(const TickReport& report)
{
  return { static_cast<float>(report.proximalForce), static_cast<float>(report.proximalTorque),
    static_cast<float>(report.tipForce), static_cast<float>(report.maximumForce) };
}

SessionInput StartInputOf(const Scenario& scenario)
{
  const CArmPose& pose = scenario.imaging.pose;
  SessionInput input;
  input.primary = pose.primary;
  input.secondary = pose.secondary;
  input.sourceToDetector = pose.sourceToDetector;
  return input;
}

TrainingSession::TrainingSession(std::shared_ptr<WallMotion> wall, const Scenario& scenario,
  std::shared_ptr<const VolumeProjector> patient)
  : Data(std::make_unique<Internals>(std::move(wall), scenario, std::move(patient)))
{
  this->Data->Last = this->Data->Start = StartInputOf(scenario);
}

TrainingSession::~TrainingSession() = default;

const SessionInput& TrainingSession::StartInput() const
{
  return this->Data->Start;
}

const SessionReport& TrainingSession::Step(const SessionInput& input)
{
  Internals& data = *this->Data;
  data.SetView(input);
  data.Report.tick = data.Physics.Step(input.drive);
  if (data.Tick % data.TicksOfContrast == 0)
  {
    data.StepContrast(input);
  }
  ++data.Tick;
  data.Breath.Step(1.0 / data.Settings.tickRate);
  data.ControlExposure(input);
  data.Report.exposed = data.Clock.Step((input.pedals & FluoroscopyPedal) != 0,
    (input.pedals & CinePedal) != 0, (input.pedals & MaskPedal) != 0);
  data.Measure(input);
  data.Last = input;
  return data.Report;
}

bool TrainingSession::Apply(const RecordedEvent& event)
{
  Internals& data = *this->Data;
  if (!std::isfinite(event.value))
  {
    return false;
  }
  double value = event.value;
  for (const EventMember& member : EventMembers)
  {
    value = member.kind == event.kind ? std::clamp(value, member.least, member.most) : value;
  }
  switch (event.kind)
  {
    case RecordedEvent::HeartRate:
      data.HeartRate = value;
      data.Physics.SetHeartRate(data.HeartRate);
      return true;
    case RecordedEvent::FrameRate:
      if (event.value != 7.5 && event.value != 15.0 && event.value != 30.0)
      {
        return false;
      }
      data.Clock.SetFluoroscopyRate(FrameRateOf(event.value));
      return true;
    case RecordedEvent::FieldOfView:
      data.Field = value;
      data.SetField();
      return true;
    case RecordedEvent::Exchange:
      return data.Exchange(event.value, data.Balloons, data.BalloonNumber, "balloon");
    case RecordedEvent::ExchangeWire:
      return data.Exchange(event.value, data.Wires, data.WireNumbers[data.InHand], "wire");
    case RecordedEvent::TakeWire:
      return data.TakeWire(event.value);
    case RecordedEvent::Flush:
      return data.Flush(value);
    case RecordedEvent::ShutterSides:
      data.Shutters.left = data.Shutters.right = value;
      data.SetField();
      return true;
    case RecordedEvent::ShutterEnds:
      data.Shutters.top = data.Shutters.bottom = value;
      data.SetField();
      return true;
    case RecordedEvent::Incident:
      return data.Call(event.value);
    case RecordedEvent::Breaths:
      data.Breath.SetRate(value);
      return true;
    default:
      return false;
  }
}

const SessionReport& TrainingSession::Report() const
{
  return this->Data->Report;
}

const SessionMetrics& TrainingSession::Metrics() const
{
  return this->Data->Metrics;
}

const Intervention& TrainingSession::Instruments() const
{
  return this->Data->Physics;
}

const ContrastModel& TrainingSession::Contrast() const
{
  return this->Data->Medium;
}

ContrastBalance TrainingSession::Balance() const
{
  return this->Data->Balance();
}

std::vector<LesionResult> TrainingSession::Lesions() const
{
  return this->Data->Watch.Results(this->Data->Physics, this->Data->Medium);
}

std::vector<StentResult> TrainingSession::Stents() const
{
  return this->Data->Watch.Stents(this->Data->Physics);
}

std::vector<MouthResult> TrainingSession::Mouths() const
{
  return this->Data->Watch.Mouths(this->Data->Physics, this->Data->Medium);
}

const std::vector<VesselTear>& TrainingSession::Tears() const
{
  return this->Data->Tears.All();
}

const ProcedureState& TrainingSession::Procedure() const
{
  return this->Data->Procedure->State();
}

ProcedureScore TrainingSession::Score() const
{
  const Internals& data = *this->Data;
  return ScoreOf(data.Steps, data.Procedure->State(), data.Metrics, this->Stents(),
    data.Report.tick, this->Mouths());
}

const WallTopology& TrainingSession::Topology() const
{
  return this->Data->Wall->Topology();
}

const CArmPose& TrainingSession::Pose() const
{
  return this->Data->Pose;
}

double TrainingSession::FieldOfView() const
{
  return this->Data->Field;
}

double TrainingSession::TickRate() const
{
  return this->Data->Settings.tickRate;
}

std::uint64_t TrainingSession::Ticks() const
{
  return this->Data->Tick;
}

std::uint64_t TrainingSession::StateHash() const
{
  const Internals& data = *this->Data;
  std::uint64_t hash = data.Physics.StateHash();
  const auto add = [&hash](std::uint64_t more) { hash = Fnv1a(&more, sizeof(more), hash); };
  if (!data.Medium.Empty())
  {
    add(data.Medium.StateHash());
  }
  if (data.Tears.Any())
  {
    hash = data.Tears.Hash(hash);
  }
  if (data.Guide && data.GuideUsed)
  {
    hash = data.Guide->Hash(hash);
  }
  if (data.Metrics.frames > 0)
  {
    add(data.Clock.StateHash());
  }
  return hash;
}

std::vector<std::string> TrainingSession::TakeMessages()
{
  std::vector<std::string> messages = this->Data->Physics.TakeMessages();
  for (std::string& own : this->Data->Messages)
  {
    messages.push_back(std::move(own));
  }
  this->Data->Messages.clear();
  return messages;
}

void TrainingSession::SnapshotOfImage(SessionSnapshot& snapshot) const
{
  const Internals& data = *this->Data;
  snapshot.tick = data.Tick;
  snapshot.seconds = static_cast<double>(data.Tick) / data.Settings.tickRate;
  snapshot.heartRate = data.HeartRate;
  snapshot.report = data.Report.tick;
  snapshot.metrics = data.Metrics;
  snapshot.procedure = data.Procedure->State();
  snapshot.tears = data.Tears.All();
  snapshot.contrast = data.Balance();
  const AorticContrast& aorta = data.Medium.Aorta();
  snapshot.aorta = aorta.Empty() ? std::vector<double>() : aorta.Concentration();
  snapshot.sinuses = aorta.Empty() ? std::vector<double>() : aorta.Sinuses();
  snapshot.guide.clear();
  if (data.Guide)
  {
    snapshot.guide.assign(data.Guide->Plugs().begin(), data.Guide->Plugs().end());
  }
  snapshot.injection = data.Report.injection;
  snapshot.tipPressure = data.TipPressure();
  snapshot.input = data.Last;
  snapshot.pose = data.Pose;
  snapshot.fieldOfView = data.Field;
  snapshot.shutters = data.Shutters;
  snapshot.frameRate = FramesPerSecond(data.Clock.Settings().fluoroscopyRate);
  snapshot.diaphragm = data.Breath.Diaphragm();
  snapshot.radiating = data.Clock.Radiating();
  snapshot.exposure = data.Clock.Last();
  snapshot.wire = data.Physics.Centerline();
  snapshot.wireNumber = data.WireNumbers[0];
  snapshot.secondNumber = data.WireNumbers[1];
  if (data.Physics.NumberOfWires() > 1)
  {
    snapshot.secondWire = data.Physics.Centerline(1);
  }
  snapshot.catheter = data.Physics.CatheterLine();
  snapshot.guideFromArch = data.Settings.guideFromArch;
  data.Wall->AxisPositions(data.Report.tick.phase, snapshot.axis);
  snapshot.concentration = data.Medium.Concentration();
  snapshot.blush = data.Medium.BlushVolume();
  snapshot.balloonNumber = data.BalloonNumber;
  data.Physics.StentShapes(snapshot.stents);
  snapshot.lumen = data.Watch.Lumen();
  snapshot.filled = data.Watch.Filled();
  data.Physics.BalloonLine(snapshot.balloon, snapshot.balloonRadii);
}

void TrainingSession::SnapshotOfScene(
  const std::vector<std::int64_t>& wallPoints, SessionSnapshot& snapshot) const
{
  this->SnapshotOfImage(snapshot);
  snapshot.lesions = this->Lesions();
  snapshot.results = this->Stents();
  snapshot.mouths = this->Mouths();
  this->Data->Physics.SomeWallPoints(wallPoints, snapshot.wall);
  this->Data->Medium.TracerPositions(snapshot.axis, snapshot.tracers, snapshot.tracerVolumes);
}
}
