#include "Intervention.h"

#include "BalloonOnWire.h"
#include "CatheterPath.h"
#include "CyclicTime.h"
#include "DrivenWire.h"
#include "Fnv1a.h"
#include "GuideFromArch.h"
#include "OstialTree.h"
#include "SettingLimits.h"
#include "VesselWall.h"
#include "WallMotion.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double DrawnCatheter = 220.0; // mm
constexpr double CatheterReach = 10.0;  // mm into the vessel
constexpr double BalloonParked = 5.0;   // mm behind the simulated wire's end, at the beginning
constexpr double ParkedWithin = 1.0;    // mm from there: it can be exchanged
constexpr double Emptied = 0.5;         // atm, likewise
const std::int64_t SamplesPerSegment = InstrumentRod().samples + 1;

}

void InterventionSettings::Validate() const
{
  RequireWithin(this->tickRate, 500.0, 20000.0, "tickRate");
  RequireWithin(this->ticksPerFrame, 1, 1000, "ticksPerFrame");
  RequireWithin(this->heartRate, 0.0, 240.0, "heartRate");
  RequireWithin(this->startPhase, -10.0, 10.0, "startPhase");
  RequireWithin(this->segmentLength, 0.5, 4.0, "segmentLength");
  RequireWithin(this->capacity, 20, 1000, "capacity");
  RequireWithin(this->insideCatheter, 5.0, 100.0, "insideCatheter");
  RequireWithin(this->rootBranch, -1, 1e6, "rootBranch");
  RequireWithin(this->engagement, 0.5, CatheterReach, "engagement");
  RequireWithin(this->wallFriction, 0.0, 10.0, "wallFriction");
  RequireWithin(this->wallStiffness, 0.1, 1000.0, "wallStiffness");
  RequireWithin(this->drag, 0.0, 10.0, "drag");
  RequireWithin(this->maximumSpeed, 1.0, 2000.0, "maximumSpeed");
  RequireWithin(this->maximumTurning, 1.0, 1000.0, "maximumTurning");
  RequireWithin(this->sealTime, 1.0, 3600.0, "sealTime");
}

struct Intervention::Internals
{
  std::shared_ptr<WallMotion> Motion;
  WireRoom Room;

  double Step = 0.0; // s
  double Phase = 0.0;
  double FrameSeconds = 0.0;
  int TickInFrame = 0;
  std::size_t RootFirst = 0; // of the axis' points
  std::size_t RootCount = 0;
  std::vector<Vector3> LastPoints; // of the whole wall at the frame's beginning and end
  std::vector<Vector3> NextPoints;
  std::vector<Vector3> NowPoints;
  OstialTree Tree; // the engaged one: no wire comes to another
  std::vector<Vector3> NextTreePoints;
  std::vector<Vector3> LastAxis;
  std::vector<Vector3> Axis;
  std::vector<Vector3> RootAxis;

  std::unique_ptr<VesselWall> Wall;
  // The guide is one of both: rigid at the ostium, or free in the aorta.
  std::unique_ptr<CatheterPath> Rigid;
  std::unique_ptr<GuideFromArch> Free;
  std::unique_ptr<LengthenedInlet> Inlet; // with the free one
  std::unique_ptr<ArteryLumen> Artery;    // with the rigid one
  InstrumentLumen* Lumen = nullptr;

  std::vector<std::unique_ptr<DrivenWire>> Wires;
  std::size_t InHand = 0;
  std::vector<std::pair<const Guidewire*, double>> InGuide; // with the free one

  double HandPosition = 0.0; // as accepted, of whatever wire
  double HandAngle = 0.0;

  // Null without a balloon; then nothing of these is used.
  std::unique_ptr<BalloonOnWire> Sleeve;
  std::size_t SleeveWire = 0; // that it runs on
  std::unique_ptr<DilatableWall> Opening;
  BranchMouths Mouths;
  VesselWay SleeveWay;
  int SleeveWayBranch = -1;
  double SleeveStart = 0.0; // u, where it is parked
  double SleeveHand = 0.0;  // as accepted
  std::vector<PlacedStent> Stents;
  double Inflator = 0.0; // atm
  bool ToldNoBalloon = false;

  TickReport Report;
  std::vector<Vector3> Line;
  std::vector<Vector3> CatheterPoints;

  void Say(Notice notice) { this->Room.notices.Say(notice, this->Room.tick); }
  DrivenWire& Hand() { return *this->Wires[this->InHand]; }
  DrivenWire& Carrier() { return *this->Wires[this->SleeveWire]; }

  /// mm to be added to u, so that it is counted from the ostium.
  double FromOstium() const
  {
    return this->Free ? this->Report.catheterTip - this->Room.catheterTip : 0.0;
  }
  /// The balloon is wholly in the guide.
  bool SleeveIsParked() const { return this->Sleeve->Tip() <= this->SleeveStart + ParkedWithin; }

  void Engage(const std::vector<Vector3>& points);
  void RequireRoom(int root) const;
  void AddWire(const Guidewire& wire);
  void MakeTreePoints(const Vector3& direction);
  void BeginFrame();
  void Drive(const DriveInput& input);
  void DriveSleeve(const DriveInput& input);
  void OpenWall();
  double SleevePlace();
  void RequireFitting(const BalloonCatheter& balloon) const;
  void TakeBalloon(const BalloonCatheter& balloon);
  void StepWires();
  void Measure();
};

void Intervention::Internals::Engage(const std::vector<Vector3>& points)
{
  const WallTopology& topology = this->Motion->Topology();
  const int root = RootOf(topology, this->Room.settings.rootBranch);
  this->RootFirst = static_cast<std::size_t>(FirstAxisPoint(topology, root));
  this->RootCount = topology.axis[root].size();
  this->Motion->AxisPositions(this->Phase, this->Axis);
  this->RootAxis.assign(this->Axis.begin() + static_cast<std::ptrdiff_t>(this->RootFirst),
    this->Axis.begin() + static_cast<std::ptrdiff_t>(this->RootFirst + this->RootCount));
  const double behind = this->Room.settings.insideCatheter + 25.0;
  this->Rigid = std::make_unique<CatheterPath>(
    this->RootAxis, this->Room.catheter, this->Room.settings.engagement, behind, CatheterReach);
  this->Room.path = this->Rigid.get();
  this->Room.catheterTip = std::min(this->Room.settings.engagement, this->Room.path->Last());
  this->RequireRoom(root);
  this->Tree = MakeOstialTree(
    topology, points, this->RootAxis.front(), this->Room.path->At(this->Room.catheterTip).position);
  if (this->Room.settings.guideFromArch && topology.aorta)
  {
    GuideSettings guide;
    guide.tickRate = this->Room.settings.tickRate;
    this->Free = std::make_unique<GuideFromArch>(this->Room.catheter, topology, this->Axis, root,
      this->Room.settings.engagement, behind, guide);
    this->Inlet = std::make_unique<LengthenedInlet>(this->Tree, this->Free->InletLength());
    this->Room.path = this->Free.get();
    this->Rigid.reset();
    this->Room.catheterTip = this->Free->TipPlace();
  }
  this->MakeTreePoints(DirectionAtOstium(this->RootAxis));
  VesselWallSettings settings;
  settings.friction = this->Room.settings.wallFriction;
  settings.stiffness = this->Room.settings.wallStiffness;
  if (this->Tree.cap > 1)
  {
    settings.openCaps.push_back(this->Tree.cap);
  }
  this->Wall = std::make_unique<VesselWall>(this->Tree.topology, this->NextTreePoints, settings);
  if (this->Free)
  {
    this->Free->Join(*this->Wall, this->Tree.inlet);
    this->Lumen = &this->Free->Lumen();
    return;
  }
  this->Artery = std::make_unique<ArteryLumen>(*this->Wall, this->Tree.inlet, SamplesPerSegment);
  this->Lumen = this->Artery.get();
}

/// @throws std::invalid_argument  an instrument does not fit where it is at the beginning
void Intervention::Internals::RequireRoom(int root) const
{
  const double narrowest = NarrowestBefore(this->Motion->Topology(), root, this->Room.catheterTip);
  if (this->Room.catheter.outerRadius > narrowest)
  {
    char text[256];
    std::snprintf(text, sizeof(text),
      "the catheter '%s' is thicker (radius %.3f mm) than the lumen at the ostium (radius %.3f mm)",
      this->Room.catheter.name.c_str(), this->Room.catheter.outerRadius, narrowest);
    throw std::invalid_argument(text);
  }
}

/// @throws std::invalid_argument  it does not fit
void Intervention::Internals::AddWire(const Guidewire& wire)
{
  RequireFit(wire, this->Room.catheter);
  // Numbers of samples of two wires are a segment apart.
  const auto number = static_cast<std::int64_t>(this->Wires.size());
  const std::int64_t first = number * (this->Room.settings.capacity + 1) * SamplesPerSegment;
  this->Wires.push_back(std::make_unique<DrivenWire>(wire, this->Room, *this->Lumen, first));
}

/// Of the engaged tree, out of the whole wall's that come next.
void Intervention::Internals::MakeTreePoints(const Vector3& direction)
{
  this->NextTreePoints.resize(this->Tree.points.size());
  for (std::size_t i = 0; i < this->Tree.points.size(); ++i)
  {
    this->NextTreePoints[i] = this->NextPoints[this->Tree.points[i]];
  }
  if (this->Inlet)
  {
    this->Inlet->Lengthen(this->NextTreePoints, direction);
  }
}

void Intervention::Internals::BeginFrame()
{
  const double next = this->Phase + this->FrameSeconds * this->Room.settings.heartRate / 60.0;
  this->LastPoints.swap(this->NextPoints);
  this->Motion->Positions(next, this->NextPoints);
  if (this->Sleeve)
  {
    this->OpenWall();
  }
  this->LastAxis.swap(this->Axis);
  this->Motion->AxisPositions(next, this->Axis);
  if (this->Sleeve)
  {
    this->Opening->Deform(this->Axis, this->NextPoints);
    for (std::size_t n = 0; n < this->Wires.size() && this->Wires.size() > 1; ++n)
    {
      this->Wires[n]->Trap().BeginFrame(this->Stents,
        n == this->SleeveWire || this->Sleeve->Device().IsMicrocatheter() ? nullptr
                                                                          : this->Sleeve.get(),
        *this->Opening, this->LastAxis, this->Axis, this->FrameSeconds);
    }
  }
  std::copy_n(this->Axis.begin() + static_cast<std::ptrdiff_t>(this->RootFirst), this->RootCount,
    this->RootAxis.begin());
  this->MakeTreePoints(DirectionAtOstium(this->RootAxis));
  this->Wall->BeginFrame(this->NextTreePoints, this->FrameSeconds);
  if (this->Free)
  {
    this->Free->BeginFrame(this->Axis, this->FrameSeconds);
  }
  else
  {
    this->Rigid->SetAngle(this->Room.catheterAngle);
    this->Rigid->BeginFrame(this->RootAxis, this->FrameSeconds);
  }
  this->Room.plugs.BeginFrame(this->Axis, this->FrameSeconds);
  this->TickInFrame = 0;
}

/// mm from the ostium of the balloon's middle, along its way.
double Intervention::Internals::SleevePlace()
{
  const double middle = this->Sleeve->Tip() - this->Sleeve->Device().Middle();
  if (middle <= this->Room.catheterTip)
  {
    return middle + this->FromOstium();
  }
  const DrivenWire& wire = this->Carrier();
  const CosseratRod& rod = wire.Rod();
  const double behind = wire.Fed() - middle; // mm of the wire
  std::int64_t i = 0;
  while (i + 1 < rod.Size() && wire.Places()[i + 1] < behind)
  {
    ++i;
  }
  const Vector3 point = rod.Position(i) + (behind - wire.Places()[i]) * rod.Axis(i);
  double nearest = std::numeric_limits<double>::infinity();
  double place = 0.0;
  for (std::size_t n = 1; n < this->SleeveWay.points.size(); ++n)
  {
    const SegmentPlace candidate = NearestOnSegment(
      point, this->Axis[this->SleeveWay.points[n - 1]], this->Axis[this->SleeveWay.points[n]]);
    if (candidate.squaredDistance < nearest)
    {
      nearest = candidate.squaredDistance;
      place = this->SleeveWay.place[n - 1] +
        candidate.fraction * (this->SleeveWay.place[n] - this->SleeveWay.place[n - 1]);
    }
  }
  return place;
}

void Intervention::Internals::OpenWall()
{
  const int branch = this->Carrier().Report().branch;
  if (branch >= 0 && branch != this->SleeveWayBranch)
  {
    this->SleeveWayBranch = branch;
    this->SleeveWay = WayThrough(this->Motion->Topology(), this->SleeveWayBranch);
  }
  this->Sleeve->Inflate(this->FrameSeconds, this->Inflator, this->SleevePlace(),
    this->Room.catheterTip + this->FromOstium(), this->SleeveWay, *this->Opening);
  if (std::optional<PlacedStent> placed = this->Sleeve->TakePlaced())
  {
    for (std::size_t n = 0; n < this->Wires.size(); ++n)
    {
      if (n != this->SleeveWire)
      {
        this->Wires[n]->Trap().Jail(this->Stents.size());
      }
    }
    this->Stents.push_back(std::move(*placed));
  }
  if (!this->Mouths.All().empty())
  {
    std::vector<int> within;
    for (const std::unique_ptr<DrivenWire>& wire : this->Wires)
    {
      within.push_back(wire->Report().branch);
    }
    this->Mouths.Answer(within, *this->Opening);
  }
  if (this->Sleeve->Report().caught)
  {
    this->Say(Notice::StentInGuide);
  }
}

void Intervention::Internals::DriveSleeve(const DriveInput& input)
{
  const double most = this->Room.settings.maximumSpeed * this->Step;
  double way = 0.0;
  if (std::isfinite(input.balloonPosition) && std::isfinite(input.inflation))
  {
    way = std::clamp(input.balloonPosition - this->SleeveHand, -most, most);
    this->SleeveHand += way;
    this->Inflator = std::clamp(input.inflation, -1.0, 40.0);
  }
  const bool microcatheter = this->Sleeve->Device().IsMicrocatheter();
  const bool inflated = microcatheter && this->Inflator > Emptied;
  if (inflated && !this->ToldNoBalloon)
  {
    this->Say(Notice::NoBalloon);
  }
  this->ToldNoBalloon = inflated;
  const double share =
    static_cast<double>(this->TickInFrame) / static_cast<double>(this->Room.settings.ticksPerFrame);
  DrivenWire& wire = this->Carrier();
  if (!this->Sleeve->Drive(way, most, wire.Rail(), share, wire.Rod()))
  {
    this->Say(microcatheter ? Notice::MicrocatheterLimit : Notice::BalloonLimit);
  }
}

/// @throws std::invalid_argument  it does not fit into the guide, or not beside the other wire
void Intervention::Internals::RequireFitting(const BalloonCatheter& balloon) const
{
  RequireFit(balloon, this->Room.catheter);
  RequireFit(this->Wires[this->InHand]->Device(), balloon);
  if (this->Wires.size() > 1)
  {
    for (const std::unique_ptr<DrivenWire>& wire : this->Wires)
    {
      RequireFitBeside(balloon, wire->Device(), this->Room.catheter);
    }
  }
}

/// @throws std::invalid_argument  it does not fit
void Intervention::Internals::TakeBalloon(const BalloonCatheter& balloon)
{
  this->RequireFitting(balloon);
  const WallTopology& topology = this->Motion->Topology();
  this->SleeveStart = this->Room.catheterTip - this->Room.settings.insideCatheter - BalloonParked;
  this->Sleeve = std::make_unique<BalloonOnWire>(balloon, this->Room.catheter, this->SleeveStart);
  this->Opening = std::make_unique<DilatableWall>(topology, this->NextPoints, this->Axis);
  if (this->Room.settings.branchesAnswer)
  {
    this->Mouths = BranchMouths(topology);
  }
  this->Carrier().SetSleeve(this->Sleeve.get());
  int root = 0;
  while (FirstAxisPoint(topology, root) < static_cast<std::int64_t>(this->RootFirst))
  {
    ++root;
  }
  this->SleeveWay = WayThrough(topology, root);
  this->SleeveWayBranch = root;
}

void Intervention::Internals::Drive(const DriveInput& input)
{
  if (!std::isfinite(input.wirePosition) || !std::isfinite(input.wireAngle) ||
    !std::isfinite(input.catheterPosition) || !std::isfinite(input.catheterAngle))
  {
    this->Say(Notice::NotFinite);
    return;
  }
  const double most = this->Room.settings.maximumSpeed * this->Step;
  double way = input.wirePosition - this->HandPosition;
  if (std::abs(way) > most * (1.0 + 1e-9))
  {
    this->Say(Notice::TooFast);
    way = std::clamp(way, -most, most);
  }
  const double mostTurn = this->Room.settings.maximumTurning * this->Step;
  double turn = input.wireAngle - this->HandAngle;
  if (std::abs(turn) > mostTurn * (1.0 + 1e-9))
  {
    this->Say(Notice::TurnedTooFast);
    turn = std::clamp(turn, -mostTurn, mostTurn);
  }
  this->HandAngle += turn;
  this->HandPosition += way;
  this->Hand().Advance(way, turn);

  // The catheter is moved by a hand, too: slowly.
  const double mostTip = 50.0 * this->Step;
  const double wanted = this->Room.settings.engagement + input.catheterPosition;
  const double least = this->Free ? this->Room.settings.engagement + this->Free->Least() : 0.5;
  const double greatest =
    this->Free ? this->Room.settings.engagement + this->Free->Most() : this->Room.path->Last();
  const double allowed = std::clamp(wanted, least, greatest);
  if (wanted != allowed)
  {
    this->Say(Notice::CatheterLimit);
  }
  const double moved = std::clamp(allowed - this->Room.catheterTip, -mostTip, mostTip);
  this->Room.catheterTip += moved;
  // A guide that is brought to the ostium takes the wires along: the valve at its end holds them.
  for (std::size_t n = 0; n < this->Wires.size() && this->Free; ++n)
  {
    this->Wires[n]->Carry(moved);
  }
  this->Room.catheterAngle +=
    std::clamp(input.catheterAngle - this->Room.catheterAngle, -2.0 * this->Step, 2.0 * this->Step);
  if (this->Free)
  {
    this->InGuide.clear();
    double thrust = 0.0;
    for (const std::unique_ptr<DrivenWire>& wire : this->Wires)
    {
      this->InGuide.emplace_back(&wire->Device(), wire->Beyond());
      thrust += wire->Thrust();
    }
    this->Free->Step(this->Room.catheterTip - this->Room.settings.engagement,
      this->Room.catheterAngle, this->InGuide, thrust);
  }
}

void Intervention::Internals::StepWires()
{
  this->Report.outside = 0;
  for (const std::unique_ptr<DrivenWire>& wire : this->Wires)
  {
    wire->Step(this->Step);
    this->Report.outside += wire->PutBackNow();
  }
}

void Intervention::Internals::Measure()
{
  TickReport& report = this->Report;
  report.tick = this->Room.tick;
  report.phase = Modulo(this->Phase);
  report.catheterTip = this->Room.catheterTip;
  if (this->Free)
  {
    report.seat = this->Free->Seat();
    report.catheterTip = report.seat.engaged
      ? std::max(0.0, report.seat.depth + this->Free->MouthPlace())
      : -(this->Room.path->At(this->Room.catheterTip).position - this->Free->Mouth().position)
           .norm();
  }
  report.hand = this->InHand;
  for (std::size_t n = 0; n < this->Wires.size(); ++n)
  {
    report.wires[n] = this->Wires[n]->Report();
  }
  this->Hand().Measure(report);
  if (this->Sleeve)
  {
    this->Sleeve->Feel(this->Carrier().Rod(), this->Carrier().Rail());
    report.balloon = this->Sleeve->Report();
  }
}

Intervention::Intervention(std::shared_ptr<WallMotion> wall, const Guidewire& wire,
  const GuideCatheter& catheter, const InterventionSettings& settings,
  const std::optional<BalloonCatheter>& balloon, const std::optional<Guidewire>& second)
  : Data(std::make_unique<Internals>())
{
  settings.Validate();
  wire.Validate();
  catheter.Validate();
  if (!wall)
  {
    throw std::invalid_argument("an intervention needs vessels");
  }
  Internals& data = *this->Data;
  data.Motion = std::move(wall);
  data.Room.catheter = catheter;
  data.Room.settings = settings;
  data.Room.notices = Notices(settings.tickRate);
  data.Step = 1.0 / settings.tickRate;
  data.FrameSeconds = data.Step * settings.ticksPerFrame;
  data.Phase = Modulo(settings.startPhase);
  data.Motion->Positions(data.Phase, data.NextPoints);
  data.LastPoints = data.NextPoints;
  data.Engage(data.NextPoints);
  data.Room.plugs = OcclusionPlugs(data.Motion->Topology(), data.Axis);
  data.AddWire(wire);
  if (second)
  {
    second->Validate();
    data.AddWire(*second);
  }
  data.Line.reserve(settings.capacity + 1);
  if (balloon)
  {
    data.TakeBalloon(*balloon);
  }
}

Intervention::~Intervention() = default;
Intervention::Intervention(Intervention&&) noexcept = default;
Intervention& Intervention::operator=(Intervention&&) noexcept = default;

const TickReport& Intervention::Step(const DriveInput& input)
{
  Internals& data = *this->Data;
  if (data.TickInFrame == 0 || data.TickInFrame >= data.Room.settings.ticksPerFrame)
  {
    data.BeginFrame();
  }
  ++data.Room.tick;
  ++data.TickInFrame;
  const double inFrame = data.Step * data.TickInFrame;
  data.Wall->SetTime(inFrame);
  data.Room.path->SetTime(inFrame);
  data.Room.plugs.SetTime(inFrame);
  data.Phase += data.Step * data.Room.settings.heartRate / 60.0;
  data.Phase = Modulo(data.Phase);
  data.Drive(input);
  for (const std::unique_ptr<DrivenWire>& wire : data.Wires)
  {
    wire->Trap().SetTime(inFrame);
    wire->Feed();
  }
  if (data.Sleeve)
  {
    data.DriveSleeve(input);
  }
  data.StepWires();
  data.Measure();
  return data.Report;
}

std::size_t Intervention::NumberOfWires() const
{
  return this->Data->Wires.size();
}

bool Intervention::TakeWire(std::size_t number)
{
  if (number >= this->Data->Wires.size())
  {
    return false;
  }
  this->Data->InHand = number;
  return true;
}

const TickReport& Intervention::Report() const
{
  return this->Data->Report;
}

void Intervention::SetHeartRate(double beatsPerMinute)
{
  if (beatsPerMinute >= 0.0 && beatsPerMinute <= 240.0)
  {
    this->Data->Room.settings.heartRate = beatsPerMinute;
  }
}

std::int64_t Intervention::NumberOfSegments() const
{
  return this->Data->Wires[0]->Rod().Size();
}

const std::vector<Vector3>& Intervention::Centerline(std::size_t wire) const
{
  Internals& data = *this->Data;
  data.Wires.at(wire)->Line(data.Line);
  return data.Line;
}

const std::vector<Vector3>& Intervention::CatheterLine() const
{
  Internals& data = *this->Data;
  data.Room.path->Line(data.Room.catheterTip, DrawnCatheter, data.CatheterPoints);
  return data.CatheterPoints;
}

void Intervention::BalloonLine(std::vector<Vector3>& line, std::vector<double>& radii) const
{
  Internals& data = *this->Data;
  line.clear();
  radii.clear();
  if (!data.Sleeve)
  {
    return;
  }
  const DrivenWire& wire = data.Carrier();
  const CosseratRod& rod = wire.Rod();
  const double tip = wire.Fed() - data.Sleeve->Tip(); // mm of the wire before it
  double along = 0.0;
  double wanted = tip;
  for (std::int64_t i = 0; i < rod.Size(); ++i)
  {
    const double length = wire.Segments()[i].length;
    for (; wanted <= along + length; wanted += BalloonOnWire::Spacing)
    {
      line.push_back(rod.Position(i) + (wanted - along - 0.5 * length) * rod.Axis(i));
      radii.push_back(data.Sleeve->RadiusAt(wanted - tip));
    }
    along += length;
  }
}

const std::vector<Vector3>& Intervention::WallPoints() const
{
  Internals& data = *this->Data;
  const double share =
    static_cast<double>(data.TickInFrame) / static_cast<double>(data.Room.settings.ticksPerFrame);
  data.NowPoints.resize(data.NextPoints.size());
  for (std::size_t i = 0; i < data.NowPoints.size(); ++i)
  {
    data.NowPoints[i] = (1.0 - share) * data.LastPoints[i] + share * data.NextPoints[i];
  }
  return data.NowPoints;
}

void Intervention::SomeWallPoints(
  const std::vector<std::int64_t>& which, std::vector<Vector3>& positions) const
{
  const Internals& data = *this->Data;
  const double share =
    static_cast<double>(data.TickInFrame) / static_cast<double>(data.Room.settings.ticksPerFrame);
  positions.resize(which.size());
  for (std::size_t n = 0; n < which.size(); ++n)
  {
    const auto i = static_cast<std::size_t>(which[n]);
    positions[n] = (1.0 - share) * data.LastPoints[i] + share * data.NextPoints[i];
  }
}

std::uint64_t Intervention::StateHash() const
{
  const Internals& data = *this->Data;
  const DrivenWire& first = *data.Wires[0];
  std::uint64_t hash = first.Rod().Hash();
  for (const double value : { first.Fed(), first.Angle(), data.Room.catheterTip,
         data.Room.catheterAngle, data.Phase, static_cast<double>(data.Room.tick) })
  {
    hash = Fnv1a(&value, sizeof(value), hash);
  }
  hash = data.Room.plugs.Hash(first.Hash(hash));
  hash = data.Free ? data.Free->Hash(hash) : hash;
  for (std::size_t n = 1; n < data.Wires.size(); ++n)
  {
    const DrivenWire& wire = *data.Wires[n];
    for (const double value : { wire.Fed(), wire.Angle(), static_cast<double>(data.InHand == n),
           static_cast<double>(data.SleeveWire == n) })
    {
      hash = Fnv1a(&value, sizeof(value), hash);
    }
    hash = wire.Hash(wire.Rod().Hash(hash));
  }
  return data.Sleeve ? data.Opening->Hash(data.Sleeve->Hash(hash)) : hash;
}

const GuideCatheter& Intervention::Catheter() const
{
  return this->Data->Room.catheter;
}

std::pair<std::int64_t, std::int64_t> Intervention::GuideCovers() const
{
  const Internals& data = *this->Data;
  std::int64_t first = 0;
  std::int64_t count = 0;
  if (data.Free && data.Report.seat.engaged)
  {
    // What of the axis lies in the aorta is no vessel.
    double along = 0.0;
    for (std::size_t i = 0; i < data.RootCount && along <= data.Report.catheterTip; ++i)
    {
      (along < data.Free->MouthPlace() ? first : count) += 1;
      along += i + 1 < data.RootCount ? (data.RootAxis[i + 1] - data.RootAxis[i]).norm() : 0.0;
    }
  }
  return { static_cast<std::int64_t>(data.RootFirst) + first, count };
}

const BalloonOnWire* Intervention::Balloon() const
{
  return this->Data->Sleeve.get();
}

const DilatableWall* Intervention::Dilated() const
{
  return this->Data->Opening.get();
}

const std::vector<BranchMouth>& Intervention::Mouths() const
{
  return this->Data->Mouths.All();
}

const std::vector<PlacedStent>& Intervention::Stents() const
{
  return this->Data->Stents;
}

void Intervention::StentShapes(std::vector<StentShape>& shapes) const
{
  const Internals& data = *this->Data;
  shapes.clear();
  std::vector<Vector3> axis;
  if (!data.Stents.empty())
  {
    data.Motion->AxisPositions(data.Phase, axis);
  }
  for (const PlacedStent& stent : data.Stents)
  {
    StentShape shape;
    shape.design = stent.design;
    for (std::size_t n = 0; n < stent.points.size(); ++n)
    {
      shape.line.push_back(axis[stent.points[n]]);
      shape.radii.push_back(data.Opening->Rings(stent.points[n])[stent.rings[n]].radius);
    }
    shapes.push_back(std::move(shape));
  }
  if (data.Sleeve && data.Sleeve->Report().crimped)
  {
    StentShape shape;
    shape.design = *data.Sleeve->Stent();
    std::vector<double> radii;
    this->BalloonLine(shape.line, radii);
    // From the tip on, a point each Spacing.
    const double half = 0.5 * shape.design.CrimpedLength();
    const double middle = data.Sleeve->Device().Middle();
    const auto number = [&](double behind)
    {
      return std::min(shape.line.size(),
        static_cast<std::size_t>(std::ceil(std::max(0.0, behind) / BalloonOnWire::Spacing)));
    };
    const std::size_t end = number(middle + half);
    shape.line.resize(end);
    shape.line.erase(shape.line.begin(),
      shape.line.begin() + static_cast<std::ptrdiff_t>(std::min(end, number(middle - half))));
    std::reverse(shape.line.begin(), shape.line.end());
    shape.radii.assign(shape.line.size(), shape.design.crimpedRadius - shape.design.strut);
    shapes.push_back(std::move(shape));
  }
}

bool Intervention::Exchange(const BalloonCatheter& balloon)
{
  Internals& data = *this->Data;
  if (!data.Sleeve)
  {
    throw std::logic_error("there is no balloon in this session that could be exchanged");
  }
  data.RequireFitting(balloon);
  if (!data.SleeveIsParked() || data.Sleeve->Report().pressure > Emptied)
  {
    data.Say(data.Sleeve->Device().IsMicrocatheter() ? Notice::MicrocatheterNotExchanged
                                                     : Notice::NotExchanged);
    return false;
  }
  data.Carrier().SetSleeve(nullptr);
  data.Sleeve = std::make_unique<BalloonOnWire>(balloon, data.Room.catheter, data.SleeveStart);
  data.SleeveWire = data.InHand;
  data.Carrier().SetSleeve(data.Sleeve.get());
  data.Inflator = 0.0;
  data.Report.balloon = data.Sleeve->Report();
  return true;
}

bool Intervention::Exchange(const Guidewire& wire)
{
  Internals& data = *this->Data;
  RequireFit(wire, data.Room.catheter);
  const bool through = data.Sleeve && data.SleeveWire == data.InHand;
  if (through)
  {
    RequireFit(wire, data.Sleeve->Device());
  }
  DrivenWire& hand = data.Hand();
  if (hand.Beyond() <= 0.0)
  {
    hand.Take(wire);
    return true;
  }
  if (!through || !data.Sleeve->Device().IsMicrocatheter())
  {
    data.Say(Notice::WireNotExchanged);
    return false;
  }
  const double out = hand.Fed() - data.Sleeve->Tip();
  if (out > MostOut)
  {
    char text[80];
    std::snprintf(text, sizeof(text), "%.1f mm; up to %g mm it can be", out, MostOut);
    data.Room.notices.Say(Notice::WireOutOfMicrocatheter, data.Room.tick, text);
    return false;
  }
  hand.TakeAlong(wire);
  return true;
}

const Guidewire& Intervention::Wire(std::size_t number) const
{
  return this->Data->Wires.at(number)->Device();
}

const std::vector<OcclusionPlug>& Intervention::Plugs() const
{
  return this->Data->Room.plugs.All();
}

std::vector<std::string> Intervention::TakeMessages()
{
  return this->Data->Room.notices.Take();
}
}
