#include "Intervention.h"

#include "BalloonOnWire.h"
#include "CatheterPath.h"
#include "CosseratRod.h"
#include "CyclicTime.h"
#include "Fnv1a.h"
#include "GuideFromArch.h"
#include "OstialTree.h"
#include "SettingLimits.h"
#include "VesselWall.h"
#include "WallMotion.h"
#include "WireInGuide.h"

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
constexpr double FloppyTip = 35.0;      // mm from the tip in which segments have two samples
constexpr double ShortTip = 12.0;       // mm from the tip on which segments are half as long
constexpr double StartInside =
  2.0; // mm of the catheter between its tip and the wire's, at the beginning
constexpr double SoftTip = 3.0;   // mm of the catheter
constexpr double LossTime = 2e-3; // s
constexpr double SpinDrag = 1e-6; // N s
constexpr int MinimumSegments = 4;
constexpr double CatheterReach = 10.0; // mm into the vessel
constexpr double BalloonParked = 5.0;  // mm behind the simulated wire's end, at the beginning
constexpr double ParkedWithin = 1.0;   // mm from there: it can be exchanged
constexpr double Emptied = 0.5;        // atm, likewise

/// How much harder a vessel is than its stiffness against the bare wire: what begins a tick deep inside the wall, as a tip that
/// a hand jams into the end of a thin vessel, must not come through with its middle. Usual contacts are a tenth as deep.
double Hardening(double gap)
{
  constexpr double deepInside = 0.05;   // mm
  constexpr double twiceAsHard = 0.025; // mm deeper
  return 1.0 + std::max(0.0, -gap - deepInside) / twiceAsHard;
}

enum class Notice : int
{
  NotFinite = 0,
  TooFast,
  TurnedTooFast,
  CatheterLimit,
  WireAtTip,
  WireAtEnd,
  Reset,
  PutBack,
  BalloonLimit,
  StentInGuide,
  NotExchanged,
  WireNotExchanged,
  Count
};

const char* const NoticeText[] = { "the input is not finite: the instruments are held",
  "the wire is driven faster than hands can: its speed is limited",
  "the wire is turned faster than hands can: its speed is limited",
  "the catheter is at the end of its way", "the wire is drawn back to the end of its way",
  "no more of the wire can be simulated: it is advanced no further",
  "the wire's equations could not be solved: it is set back to where it was last sane",
  "the wire left the lumen and was put back",
  "the balloon is at the end of its way: it has to stay on the wire, and in the guide",
  "the stent is not wholly out of the guide catheter: its balloon is not inflated",
  "the balloon is not exchanged: first it has to be emptied and drawn back into the guide",
  "the wire is not exchanged: first it has to be drawn back into the guide" };
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
}

struct Intervention::Internals : ContactSurface
{
  std::shared_ptr<WallMotion> Motion;
  Guidewire Wire;
  GuideCatheter Catheter;
  InterventionSettings Settings;

  double Step = 0.0; // s
  std::uint64_t Tick = 0;
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
  std::vector<Vector3> Axis;
  std::vector<Vector3> RootAxis;

  std::unique_ptr<VesselWall> Wall;
  // The guide is one of both: rigid at the ostium, or free in the aorta.
  std::unique_ptr<CatheterPath> Rigid;
  std::unique_ptr<GuideFromArch> Free;
  std::unique_ptr<LengthenedInlet> Inlet; // with the free one
  GuideWay* Path = nullptr;
  std::unique_ptr<ArteryLumen> Artery; // with the rigid one
  InstrumentLumen* Lumen = nullptr;
  std::unique_ptr<CosseratRod> Rod;

  // All segments that there can be, from the tip.
  std::vector<RodSegment> Segments;
  std::vector<RodJoint> Joints;
  std::vector<double> Places; // of their centres from the tip, mm
  std::vector<char> InVessel; // per sample

  double Fed = 0.0; // mm, where the tip would be on the straightened way: its u without bends
  double HandPosition = 0.0; // as accepted
  double HandAngle = 0.0;
  double CatheterTip = 0.0; // u
  double CatheterAngle = 0.0;
  double LastFed = 0.0; // of the tick before
  double LastCatheterTip = 0.0;
  double LastCatheterAngle = 0.0;
  WireInGuide Behind; // the wire between the rod and the hand

  // Null without a balloon; then nothing of these is used.
  std::unique_ptr<BalloonOnWire> Sleeve;
  std::unique_ptr<DilatableWall> Opening;
  VesselWay SleeveWay;
  int SleeveWayBranch = -1;
  double SleeveStart = 0.0; // u, where it is parked
  double SleeveHand = 0.0;  // as accepted
  std::vector<PlacedStent> Stents;
  double Inflator = 0.0; // atm

  OcclusionPlugs Plugs;

  struct Sane
  {
    std::vector<Vector3> position;
    std::vector<Eigen::Quaterniond> orientation;
    double fed = 0.0;
    double angle = 0.0; // of the rod's end
  };
  Sane Last;

  TickReport Report;
  std::vector<Vector3> Line;
  std::vector<Vector3> CatheterPoints;
  std::array<std::uint64_t, static_cast<int>(Notice::Count)> NoticeTick{};
  std::vector<std::string> Messages;

  void Say(Notice notice)
  {
    std::uint64_t& last = this->NoticeTick[static_cast<int>(notice)];
    if (last == 0 || this->Tick - last >= static_cast<std::uint64_t>(this->Settings.tickRate))
    {
      last = this->Tick;
      char text[192];
      std::snprintf(text, sizeof(text), "%.3f s: %s", static_cast<double>(this->Tick) * this->Step,
        NoticeText[static_cast<int>(notice)]);
      if (this->Messages.size() < 1000)
      {
        this->Messages.emplace_back(text);
      }
    }
  }

  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override
  {
    const int perSegment = this->Rod->SamplesPerSegment();
    const std::int64_t segment = sample.index / perSegment;
    const double expected = this->Fed - this->Places[segment];
    char& inVessel = this->InVessel[sample.index];
    contacts.count = 0;
    if (expected < this->CatheterTip + 15.0)
    {
      const double u = this->Path->Nearest(
        sample.centre, expected - 6.0, std::min(expected + 6.0, this->CatheterTip));
      if (u < this->CatheterTip - 1e-9)
      {
        if (inVessel)
        {
          inVessel = 0;
          this->Lumen->Forget(sample.index);
        }
        const PathPlace place = this->Path->At(u);
        Vector3 across = sample.centre - place.position;
        across -= place.tangent * place.tangent.dot(across);
        const double distance = across.norm();
        const double gap = this->Catheter.innerRadius - sample.radius - distance;
        if (gap < reach && distance > 1e-9)
        {
          contacts.count = 1;
          ContactPlane& plane = contacts.plane[0];
          plane = ContactPlane();
          plane.normal = across / -distance;
          plane.gap = gap;
          plane.wallVelocity = place.velocity;
          plane.friction = this->Catheter.friction;
          // Its tip is soft: the wire's load goes over from place to place as they leave it.
          plane.stiffness =
            this->Settings.wallStiffness * std::clamp((this->CatheterTip - u) / SoftTip, 0.01, 1.0);
          if (this->InSleeve(segment))
          {
            this->NoFriction(contacts);
          }
        }
        return;
      }
    }
    inVessel = 1;
    this->Lumen->Find(sample, reach, contacts);
    if (this->InSleeve(segment))
    {
      this->NoFriction(contacts);
      if (this->Sleeve->Opened(this->BehindSleeve(segment)))
      {
        this->OnlyAcross(this->Rod->Axis(segment), contacts);
      }
      return;
    }
    for (int p = 0; p < contacts.count; ++p)
    {
      contacts.plane[p].stiffness *= Hardening(contacts.plane[p].gap);
    }
    this->Plugs.Meet(sample, reach, contacts);
  }

  /// mm to be added to u, so that it is counted from the ostium.
  double FromOstium() const
  {
    return this->Free ? this->Report.catheterTip - this->CatheterTip : 0.0;
  }
  /// N by which the wire is pushed out of the catheter's tip.
  double Thrust() const;

  /// mm behind the sleeve's tip.
  double BehindSleeve(std::int64_t segment) const
  {
    return this->Places[segment] - this->Fed + this->Sleeve->Tip();
  }
  bool InSleeve(std::int64_t segment) const
  {
    return this->Sleeve && this->Sleeve->Covers(this->BehindSleeve(segment));
  }
  /// An open balloon is pressed along the vessel where that narrows; the wire in it is not: it slides.
  static void OnlyAcross(const Vector3& axis, SampleContacts& contacts)
  {
    constexpr double Least = 0.3; // of a normal that is across
    int kept = 0;
    for (int n = 0; n < contacts.count; ++n)
    {
      ContactPlane plane = contacts.plane[n];
      const Vector3 across = plane.normal - plane.normal.dot(axis) * axis;
      const double share = across.norm();
      if (share > Least)
      {
        plane.normal = across / share;
        plane.gap /= share;
        contacts.plane[kept++] = plane;
      }
    }
    contacts.count = kept;
  }
  /// What touches is the sleeve; its friction is the sleeve's.
  static void NoFriction(SampleContacts& contacts)
  {
    for (int n = 0; n < contacts.count; ++n)
    {
      contacts.plane[n].friction = 0.0;
    }
  }

  void MakeSegments();
  void Engage(const std::vector<Vector3>& points, std::int64_t samplesPerSegment);
  void RequireRoom(int root) const;
  void MakeTreePoints(const Vector3& direction);
  Eigen::Quaterniond HeldOrientation(const PathPlace& place) const;
  double EndAngle() const;
  void AppendSegment();
  void PlaceOnPath();
  void BeginFrame();
  void Drive(const DriveInput& input);
  void Feed();
  void DriveSleeve(const DriveInput& input);
  void OpenWall();
  double SleevePlace() const;
  BalloonOnWire::Rail Rail() const;
  void TakeBalloon(const BalloonCatheter& balloon);
  void DriveBehind();
  void PutBack();
  void Reset();
  void KeepSane();
  void Measure();
};

void Intervention::Internals::MakeSegments()
{
  this->Segments.clear();
  this->Joints.clear();
  this->Places.clear();
  const double whole = this->Settings.segmentLength;
  double from = 0.0;
  for (int i = 0; i < this->Settings.capacity; ++i)
  {
    const double length = from < ShortTip ? 0.5 * whole : whole;
    const double middle = from + 0.5 * length;
    const auto value = [&](double at, auto property)
    { return AlongWire(this->Wire, at, property); };
    RodSegment segment =
      MakeRodSegment(length, value(middle, [](const WireSection& s) { return s.radius; }),
        value(middle, [](const WireSection& s) { return s.density; }));
    segment.friction = value(middle, [](const WireSection& s) { return s.friction; });
    // 1 Pa s = 1e-6 N s/mm^2
    segment.drag = this->Settings.drag * 1e-6 * length;
    // More than blood would, too: a twisted wire that comes free spins within its lumen, not within a tick.
    segment.rotationalDrag = SpinDrag * length;
    // Where segments are short, or too stiff to bend between samples, one is enough.
    segment.samples = length < whole || middle > FloppyTip ? 1 : 0;
    this->Segments.push_back(segment);
    this->Places.push_back(middle);
    RodJoint joint;
    if (i > 0)
    {
      const double distance = middle - this->Places[i - 1];
      joint.angularStiffness =
        Vector3(value(from, [](const WireSection& s) { return s.bendingStiffness1; }),
          value(from, [](const WireSection& s) { return s.bendingStiffness2; }),
          value(from, [](const WireSection& s) { return s.torsionalStiffness; })) /
        distance;
      joint.stretchStiffness =
        value(from, [](const WireSection& s) { return s.axialStiffness; }) / distance;
      joint.restAngle = Vector3(distance * RestCurvature(this->Wire, from), 0.0, 0.0);
      joint.lossTime = LossTime;
    }
    this->Joints.push_back(joint);
    from += length;
  }
}

void Intervention::Internals::Engage(
  const std::vector<Vector3>& points, std::int64_t samplesPerSegment)
{
  const WallTopology& topology = this->Motion->Topology();
  const int root = RootOf(topology, this->Settings.rootBranch);
  this->RootFirst = static_cast<std::size_t>(FirstAxisPoint(topology, root));
  this->RootCount = topology.axis[root].size();
  this->Motion->AxisPositions(this->Phase, this->Axis);
  this->RootAxis.assign(this->Axis.begin() + static_cast<std::ptrdiff_t>(this->RootFirst),
    this->Axis.begin() + static_cast<std::ptrdiff_t>(this->RootFirst + this->RootCount));
  const double behind = this->Settings.insideCatheter + 25.0;
  this->Rigid = std::make_unique<CatheterPath>(
    this->RootAxis, this->Catheter, this->Settings.engagement, behind, CatheterReach);
  this->Path = this->Rigid.get();
  this->CatheterTip = std::min(this->Settings.engagement, this->Path->Last());
  this->RequireRoom(root);
  this->Tree = MakeOstialTree(
    topology, points, this->RootAxis.front(), this->Path->At(this->CatheterTip).position);
  if (this->Settings.guideFromArch && topology.aorta)
  {
    GuideSettings guide;
    guide.tickRate = this->Settings.tickRate;
    this->Free = std::make_unique<GuideFromArch>(
      this->Catheter, topology, this->Axis, root, this->Settings.engagement, behind, guide);
    this->Inlet = std::make_unique<LengthenedInlet>(this->Tree, this->Free->InletLength());
    this->Path = this->Free.get();
    this->Rigid.reset();
    this->CatheterTip = this->Free->TipPlace();
  }
  this->MakeTreePoints(DirectionAtOstium(this->RootAxis));
  VesselWallSettings settings;
  settings.friction = this->Settings.wallFriction;
  settings.stiffness = this->Settings.wallStiffness;
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
  this->Artery = std::make_unique<ArteryLumen>(*this->Wall, this->Tree.inlet, samplesPerSegment);
  this->Lumen = this->Artery.get();
}

/// @throws std::invalid_argument  an instrument does not fit where it is at the beginning
void Intervention::Internals::RequireRoom(int root) const
{
  const double narrowest = NarrowestBefore(this->Motion->Topology(), root, this->CatheterTip);
  if (this->Catheter.outerRadius > narrowest)
  {
    char text[256];
    std::snprintf(text, sizeof(text),
      "the catheter '%s' is thicker (radius %.3f mm) than the lumen at the ostium (radius %.3f mm)",
      this->Catheter.name.c_str(), this->Catheter.outerRadius, narrowest);
    throw std::invalid_argument(text);
  }
  RequireFit(this->Wire, this->Catheter);
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

Eigen::Quaterniond Intervention::Internals::HeldOrientation(const PathPlace& place) const
{
  const double angle = this->Behind.Angle();
  const Vector3 first =
    std::cos(angle) * place.side + std::sin(angle) * place.tangent.cross(place.side);
  Matrix3 frame;
  frame.col(2) = -place.tangent; // from the tip backwards
  frame.col(0) = first;
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return Eigen::Quaterniond(frame);
}

/// By which the rod's end is turned: it lags behind what it hangs on.
double Intervention::Internals::EndAngle() const
{
  return this->Behind.Angle() - this->Rod->Lag(this->Rod->Size() - 1);
}

void Intervention::Internals::AppendSegment()
{
  const std::int64_t i = this->Rod->Size();
  const PathPlace place = this->Path->At(this->Fed - this->Places[i]);
  const double lag = i > 0 ? this->Rod->Lag(i - 1) : 0.0;
  this->Rod->Append(this->Segments[i], this->Joints[i], place.position,
    this->HeldOrientation(place) * Eigen::Quaterniond(Eigen::AngleAxisd(lag, Vector3::UnitZ())));
}

void Intervention::Internals::PlaceOnPath()
{
  const double datum = this->CatheterTip - this->Settings.insideCatheter;
  while (
    this->Rod->Size() < MinimumSegments || this->Fed - this->Places[this->Rod->Size() - 1] > datum)
  {
    this->AppendSegment();
  }
  const std::int64_t last = this->Rod->Size() - 1;
  this->Rod->Prescribe(last, this->Rod->Position(last), this->Rod->Orientation(last));
}

void Intervention::Internals::BeginFrame()
{
  const double next = this->Phase + this->FrameSeconds * this->Settings.heartRate / 60.0;
  this->LastPoints.swap(this->NextPoints);
  this->Motion->Positions(next, this->NextPoints);
  if (this->Sleeve)
  {
    this->OpenWall();
  }
  this->Motion->AxisPositions(next, this->Axis);
  if (this->Sleeve)
  {
    this->Opening->Deform(this->Axis, this->NextPoints);
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
    this->Rigid->SetAngle(this->CatheterAngle);
    this->Rigid->BeginFrame(this->RootAxis, this->FrameSeconds);
  }
  this->Plugs.BeginFrame(this->Axis, this->FrameSeconds);
  this->TickInFrame = 0;
}

BalloonOnWire::Rail Intervention::Internals::Rail() const
{
  return { this->Fed, this->CatheterTip, &this->Places, &this->Segments, &this->Joints };
}

/// mm from the ostium of the balloon's middle, along its way.
double Intervention::Internals::SleevePlace() const
{
  const double middle = this->Sleeve->Tip() - this->Sleeve->Device().Middle();
  if (middle <= this->CatheterTip)
  {
    return middle + this->FromOstium();
  }
  const double behind = this->Fed - middle; // mm of the wire
  std::int64_t i = 0;
  while (i + 1 < this->Rod->Size() && this->Places[i + 1] < behind)
  {
    ++i;
  }
  const Vector3 point = this->Rod->Position(i) + (behind - this->Places[i]) * this->Rod->Axis(i);
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
  if (this->Report.branch >= 0 && this->Report.branch != this->SleeveWayBranch)
  {
    this->SleeveWayBranch = this->Report.branch;
    this->SleeveWay = WayThrough(this->Motion->Topology(), this->SleeveWayBranch);
  }
  this->Sleeve->Inflate(this->FrameSeconds, this->Inflator, this->SleevePlace(),
    this->CatheterTip + this->FromOstium(), this->SleeveWay, *this->Opening);
  if (std::optional<PlacedStent> placed = this->Sleeve->TakePlaced())
  {
    this->Stents.push_back(std::move(*placed));
  }
  if (this->Sleeve->Report().caught)
  {
    this->Say(Notice::StentInGuide);
  }
}

void Intervention::Internals::DriveSleeve(const DriveInput& input)
{
  const double most = this->Settings.maximumSpeed * this->Step;
  double way = 0.0;
  if (std::isfinite(input.balloonPosition) && std::isfinite(input.inflation))
  {
    way = std::clamp(input.balloonPosition - this->SleeveHand, -most, most);
    this->SleeveHand += way;
    this->Inflator = std::clamp(input.inflation, -1.0, 40.0);
  }
  const double share =
    static_cast<double>(this->TickInFrame) / static_cast<double>(this->Settings.ticksPerFrame);
  if (!this->Sleeve->Drive(way, most, this->Rail(), share, *this->Rod))
  {
    this->Say(Notice::BalloonLimit);
  }
}

/// @throws std::invalid_argument  it does not fit
void Intervention::Internals::TakeBalloon(const BalloonCatheter& balloon)
{
  RequireFit(balloon, this->Catheter);
  const WallTopology& topology = this->Motion->Topology();
  this->SleeveStart = this->CatheterTip - this->Settings.insideCatheter - BalloonParked;
  this->Sleeve = std::make_unique<BalloonOnWire>(balloon, this->Catheter, this->SleeveStart);
  this->Opening = std::make_unique<DilatableWall>(topology, this->NextPoints, this->Axis);
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
  const double most = this->Settings.maximumSpeed * this->Step;
  double way = input.wirePosition - this->HandPosition;
  if (std::abs(way) > most * (1.0 + 1e-9))
  {
    this->Say(Notice::TooFast);
    way = std::clamp(way, -most, most);
  }
  const double mostTurn = this->Settings.maximumTurning * this->Step;
  double turn = input.wireAngle - this->HandAngle;
  if (std::abs(turn) > mostTurn * (1.0 + 1e-9))
  {
    this->Say(Notice::TurnedTooFast);
    turn = std::clamp(turn, -mostTurn, mostTurn);
  }
  this->HandAngle += turn;
  this->HandPosition += way;
  this->Fed += way;

  // The catheter is moved by a hand, too: slowly.
  const double mostTip = 50.0 * this->Step;
  const double wanted = this->Settings.engagement + input.catheterPosition;
  const double least = this->Free ? this->Settings.engagement + this->Free->Least() : 0.5;
  const double greatest =
    this->Free ? this->Settings.engagement + this->Free->Most() : this->Path->Last();
  const double allowed = std::clamp(wanted, least, greatest);
  if (wanted != allowed)
  {
    this->Say(Notice::CatheterLimit);
  }
  const double moved = std::clamp(allowed - this->CatheterTip, -mostTip, mostTip);
  this->CatheterTip += moved;
  // A guide that is brought to the ostium takes the wire along: the valve at its end holds it.
  this->Fed += this->Free ? moved : 0.0;
  this->CatheterAngle +=
    std::clamp(input.catheterAngle - this->CatheterAngle, -2.0 * this->Step, 2.0 * this->Step);
  if (this->Free)
  {
    this->Free->Step(this->CatheterTip - this->Settings.engagement, this->CatheterAngle, this->Wire,
      this->Fed - this->CatheterTip, this->Thrust());
  }
}

double Intervention::Internals::Thrust() const
{
  // Of the joint next to the tip, along it.
  std::int64_t i = 0;
  while (i + 2 < this->Rod->Size() && this->Places[i + 1] < this->Fed - this->CatheterTip)
  {
    ++i;
  }
  return -this->Rod->JointForce(i).dot(this->Rod->Axis(i));
}

void Intervention::Internals::Feed()
{
  const double torque = this->Behind.Stiffness() * this->Rod->Lag(this->Rod->Size() - 1);
  const double datum = this->CatheterTip - this->Settings.insideCatheter;
  const double minimum = datum + this->Places[MinimumSegments - 1];
  if (this->Fed < minimum)
  {
    this->Say(Notice::WireAtTip);
    this->Fed = minimum;
  }
  const double most = datum + this->Places[this->Settings.capacity - 1];
  if (this->Fed > most)
  {
    this->Say(Notice::WireAtEnd);
    this->Fed = most;
  }
  this->DriveBehind();
  while (this->Fed - this->Places[this->Rod->Size() - 1] > datum &&
    this->Rod->Size() < this->Settings.capacity)
  {
    this->Rod->Release(this->Rod->Size() - 1);
    this->AppendSegment();
  }
  while (
    this->Rod->Size() > MinimumSegments && this->Fed - this->Places[this->Rod->Size() - 2] < datum)
  {
    this->Rod->RemoveLast();
  }
  const std::int64_t last = this->Rod->Size() - 1;
  const PathPlace place = this->Path->At(this->Fed - this->Places[last]);
  this->Rod->Prescribe(last, place.position, this->HeldOrientation(place));
  this->Rod->HangOnSpring(last, this->Behind.Stiffness(), torque / this->Behind.Stiffness());
}

/// The wire behind the rod, within the guide: what the rod's end hangs on.
void Intervention::Internals::DriveBehind()
{
  const double tip = this->CatheterTip - this->LastCatheterTip;
  this->Behind.Drive(this->Fed - this->CatheterTip, this->Fed - this->LastFed - tip,
    this->HandAngle, this->CatheterAngle - this->LastCatheterAngle);
  this->LastFed = this->Fed;
  this->LastCatheterTip = this->CatheterTip;
  this->LastCatheterAngle = this->CatheterAngle;
}

void Intervention::Internals::PutBack()
{
  // A sample whose centre is outside of the lumen: its segment is moved in. Rare; counted and told.
  for (const RodContact& contact : this->Rod->Contacts())
  {
    const std::int64_t i = contact.segment;
    const double radius = this->Segments[i].radius;
    const std::int64_t index = i * this->Rod->SamplesPerSegment() + contact.sample;
    if (contact.gap > -0.9 * radius || !this->InVessel[index] || i + 1 == this->Rod->Size())
    {
      continue;
    }
    ContactSample sample;
    sample.index = index;
    sample.centre = this->Rod->SamplePoint(i, contact.sample);
    sample.radius = radius;
    WallPlace place;
    Vector3 velocity = Vector3::Zero();
    if (this->Lumen->Outside(sample, place, velocity))
    {
      const Vector3 inward = place.point - sample.centre;
      const double distance = inward.norm();
      const Vector3 move = distance > 1e-9
        ? Vector3(inward * ((distance + 0.5 * radius) / distance))
        : Vector3::Zero();
      this->Rod->Place(i, this->Rod->Position(i) + move, this->Rod->Orientation(i));
      this->Rod->SetVelocity(i, velocity, Vector3::Zero());
      ++this->Report.outside;
      this->Say(Notice::PutBack);
    }
  }
}

void Intervention::Internals::KeepSane()
{
  this->Last.position.clear();
  this->Last.orientation.clear();
  for (std::int64_t i = 0; i < this->Rod->Size(); ++i)
  {
    this->Last.position.push_back(this->Rod->Position(i));
    this->Last.orientation.push_back(this->Rod->Orientation(i));
  }
  this->Last.fed = this->Fed;
  this->Last.angle = this->EndAngle();
}

void Intervention::Internals::Reset()
{
  this->Say(Notice::Reset);
  this->Fed = this->LastFed = this->Last.fed;
  this->Behind.Rest(this->HandAngle, this->Last.angle);
  this->DriveBehind();
  const std::int64_t count = static_cast<std::int64_t>(this->Last.position.size());
  while (this->Rod->Size() > count)
  {
    this->Rod->RemoveLast();
  }
  while (this->Rod->Size() < count)
  {
    this->Rod->Release(this->Rod->Size() - 1);
    this->AppendSegment();
  }
  for (std::int64_t i = 0; i < count; ++i)
  {
    this->Rod->Place(i, this->Last.position[i], this->Last.orientation[i]);
  }
  this->Rod->HangOnSpring(
    count - 1, this->Behind.Stiffness(), this->Behind.Angle() - this->Last.angle);
}

void Intervention::Internals::Measure()
{
  const RodStep& step = this->Rod->LastStep();
  TickReport& report = this->Report;
  report.tick = this->Tick;
  report.phase = Modulo(this->Phase);
  report.inserted = std::max(0.0, this->Fed - this->CatheterTip);
  report.catheterTip = this->CatheterTip;
  if (this->Free)
  {
    report.seat = this->Free->Seat();
    report.catheterTip = report.seat.engaged
      ? std::max(0.0, report.seat.depth + this->Free->MouthPlace())
      : -(this->Path->At(this->CatheterTip).position - this->Free->Mouth().position).norm();
  }
  report.jointGap = step.maximumGap;
  report.tipForce = 0.0;
  report.maximumForce = 0.0;
  report.contacts = 0;
  report.maximumPenetration = 0.0;
  report.meanPenetration = 0.0;
  for (const RodContact& contact : this->Rod->Contacts())
  {
    const std::int64_t index = contact.segment * this->Rod->SamplesPerSegment() + contact.sample;
    // An open balloon's force on the wall is that of its balance.
    if (!this->InVessel[index] ||
      (this->Sleeve && this->Sleeve->Opened(this->BehindSleeve(contact.segment))))
    {
      continue;
    }
    const double force = std::hypot(contact.force, contact.friction.norm());
    const double depth = std::max(0.0, -contact.gap);
    ++report.contacts;
    report.maximumForce = std::max(report.maximumForce, force);
    report.maximumPenetration = std::max(report.maximumPenetration, depth);
    report.meanPenetration += depth;
    if (this->Places[contact.segment] < 3.0 && !this->Plugs.Holds(contact))
    {
      report.tipForce += force;
    }
  }
  if (report.contacts > 0)
  {
    report.meanPenetration /= report.contacts;
  }

  const std::int64_t last = this->Rod->Size() - 1;
  Vector3 force;
  Vector3 torque;
  this->Rod->Reaction(last, force, torque);
  const Vector3 forward = -this->Rod->Axis(last);
  this->Behind.Settle(force.dot(forward), this->EndAngle());
  if (this->Sleeve)
  {
    this->Sleeve->Feel(*this->Rod, this->Rail());
    report.balloon = this->Sleeve->Report();
  }
  const HandLoad& felt = this->Behind.AtHand();
  report.proximalForce = felt.force;
  report.proximalTorque = felt.torque;
  if (report.inserted <= 0.0)
  {
    report.branch = -1;
  }
  else if (this->Tick % 20 == 0)
  {
    ContactSample tip;
    tip.index = this->Rod->SamplesPerSegment() - 1;
    tip.centre = this->Rod->FirstEnd(0);
    tip.radius = this->Segments[0].radius;
    report.branch = this->InVessel[tip.index] ? this->Lumen->BranchAt(tip) : -1;
  }
}

Intervention::Intervention(std::shared_ptr<WallMotion> wall, const Guidewire& wire,
  const GuideCatheter& catheter, const InterventionSettings& settings,
  const std::optional<BalloonCatheter>& balloon)
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
  data.Wire = wire;
  data.Catheter = catheter;
  data.Settings = settings;
  data.Behind = WireInGuide(wire, catheter, settings.insideCatheter);
  data.Step = 1.0 / settings.tickRate;
  data.FrameSeconds = data.Step * settings.ticksPerFrame;
  data.Phase = Modulo(settings.startPhase);
  data.MakeSegments();
  data.Motion->Positions(data.Phase, data.NextPoints);
  data.LastPoints = data.NextPoints;
  data.Rod = std::make_unique<CosseratRod>(settings.capacity, InstrumentRod());
  data.Engage(data.NextPoints, data.Rod->SamplesPerSegment());
  data.Plugs = OcclusionPlugs(data.Motion->Topology(), data.Axis);
  data.InVessel.assign(settings.capacity * data.Rod->SamplesPerSegment(), 0);
  data.Line.reserve(settings.capacity + 1);
  data.Last.position.reserve(settings.capacity);
  data.Last.orientation.reserve(settings.capacity);
  data.Fed = data.LastFed = data.CatheterTip - StartInside;
  data.LastCatheterTip = data.CatheterTip;
  data.DriveBehind();
  data.PlaceOnPath();
  data.KeepSane();
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
  if (data.TickInFrame == 0 || data.TickInFrame >= data.Settings.ticksPerFrame)
  {
    data.BeginFrame();
  }
  ++data.Tick;
  ++data.TickInFrame;
  data.Report.outside = 0;
  const double inFrame = data.Step * data.TickInFrame;
  data.Wall->SetTime(inFrame);
  data.Path->SetTime(inFrame);
  data.Plugs.SetTime(inFrame);
  data.Phase += data.Step * data.Settings.heartRate / 60.0;
  data.Phase = Modulo(data.Phase);
  data.Drive(input);
  data.Feed();
  if (data.Sleeve)
  {
    data.DriveSleeve(input);
  }
  const RodStep& step = data.Rod->Step(data.Step, &data);
  if (!step.finite || step.maximumGap > 5.0)
  {
    data.Reset();
  }
  else
  {
    data.PutBack();
    data.Report.capForce = data.Plugs.Press(*data.Rod);
    if (data.Tick % 200 == 0 && step.maximumGap < 0.05 && data.Report.outside == 0)
    {
      data.KeepSane();
    }
  }
  data.Measure();
  return data.Report;
}

const TickReport& Intervention::Report() const
{
  return this->Data->Report;
}

void Intervention::SetHeartRate(double beatsPerMinute)
{
  if (beatsPerMinute >= 0.0 && beatsPerMinute <= 240.0)
  {
    this->Data->Settings.heartRate = beatsPerMinute;
  }
}

std::int64_t Intervention::NumberOfSegments() const
{
  return this->Data->Rod->Size();
}

const std::vector<Vector3>& Intervention::Centerline() const
{
  Internals& data = *this->Data;
  data.Line.clear();
  const std::int64_t count = data.Rod->Size();
  data.Line.push_back(data.Rod->FirstEnd(0));
  for (std::int64_t i = 0; i + 1 < count; ++i)
  {
    data.Line.push_back(0.5 * (data.Rod->LastEnd(i) + data.Rod->FirstEnd(i + 1)));
  }
  data.Line.push_back(data.Rod->LastEnd(count - 1));
  return data.Line;
}

const std::vector<Vector3>& Intervention::CatheterLine() const
{
  Internals& data = *this->Data;
  data.Path->Line(data.CatheterTip, DrawnCatheter, data.CatheterPoints);
  return data.CatheterPoints;
}

void Intervention::BalloonLine(std::vector<Vector3>& line, std::vector<double>& radii) const
{
  const Internals& data = *this->Data;
  line.clear();
  radii.clear();
  if (!data.Sleeve)
  {
    return;
  }
  const double tip = data.Fed - data.Sleeve->Tip(); // mm of the wire before it
  double along = 0.0;
  double wanted = tip;
  for (std::int64_t i = 0; i < data.Rod->Size(); ++i)
  {
    const double length = data.Segments[i].length;
    for (; wanted <= along + length; wanted += BalloonOnWire::Spacing)
    {
      line.push_back(data.Rod->Position(i) + (wanted - along - 0.5 * length) * data.Rod->Axis(i));
      radii.push_back(data.Sleeve->RadiusAt(wanted - tip));
    }
    along += length;
  }
}

const std::vector<Vector3>& Intervention::WallPoints() const
{
  Internals& data = *this->Data;
  const double share =
    static_cast<double>(data.TickInFrame) / static_cast<double>(data.Settings.ticksPerFrame);
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
    static_cast<double>(data.TickInFrame) / static_cast<double>(data.Settings.ticksPerFrame);
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
  std::uint64_t hash = data.Rod->Hash();
  for (const double value : { data.Fed, data.HandAngle, data.CatheterTip, data.CatheterAngle,
         data.Phase, static_cast<double>(data.Tick) })
  {
    hash = Fnv1a(&value, sizeof(value), hash);
  }
  hash = data.Plugs.Hash(data.Behind.Hash(hash));
  hash = data.Free ? data.Free->Hash(hash) : hash;
  return data.Sleeve ? data.Opening->Hash(data.Sleeve->Hash(hash)) : hash;
}

const GuideCatheter& Intervention::Catheter() const
{
  return this->Data->Catheter;
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
  RequireFit(balloon, data.Catheter);
  if (data.Sleeve->Tip() > data.SleeveStart + ParkedWithin ||
    data.Sleeve->Report().pressure > Emptied)
  {
    data.Say(Notice::NotExchanged);
    return false;
  }
  data.Sleeve = std::make_unique<BalloonOnWire>(balloon, data.Catheter, data.SleeveStart);
  data.Inflator = 0.0;
  data.Report.balloon = data.Sleeve->Report();
  return true;
}

bool Intervention::Exchange(const Guidewire& wire)
{
  Internals& data = *this->Data;
  RequireFit(wire, data.Catheter);
  if (data.Fed > data.CatheterTip)
  {
    data.Say(Notice::WireNotExchanged);
    return false;
  }
  data.Wire = wire;
  data.MakeSegments();
  data.Behind = WireInGuide(wire, data.Catheter, data.Settings.insideCatheter);
  data.DriveBehind(); // how stiff it is, for how it rests
  data.Behind.Rest(data.HandAngle, data.HandAngle);
  data.DriveBehind();
  *data.Rod = CosseratRod(data.Settings.capacity, InstrumentRod());
  data.PlaceOnPath();
  data.KeepSane();
  return true;
}

const Guidewire& Intervention::Wire() const
{
  return this->Data->Wire;
}

const std::vector<OcclusionPlug>& Intervention::Plugs() const
{
  return this->Data->Plugs.All();
}

std::vector<std::string> Intervention::TakeMessages()
{
  std::vector<std::string> taken;
  taken.swap(this->Data->Messages);
  return taken;
}
}
