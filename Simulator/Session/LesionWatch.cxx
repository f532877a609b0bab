#include "LesionWatch.h"

#include "VesselTears.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace coronary
{
namespace
{
constexpr double PressureTime = 2.0;    // s of the running means
constexpr double ThinnestGraded = 0.75; // mm, radius without the lesion, as in docs/lesions.md
constexpr double Relaxed = 0.5;         // atm: what is below is another inflation
constexpr double SpringBack = 0.1;      // s after which a stent is judged
constexpr double LongestChange = 0.5;   // s without another look at the flow
constexpr double ClosedMouth = 0.02;    // mm that blood has of a branch that is closed
constexpr double StentBears = 0.5;      // N along it: the weakest of three (Jikeikai 2015) shortens

std::string Format(const char* text, ...)
{
  char buffer[300];
  std::va_list values;
  va_start(values, text);
  std::vsnprintf(buffer, sizeof(buffer), text, values);
  va_end(values);
  return buffer;
}

bool Has(const std::vector<StentRingResult>& rings, std::int64_t point)
{
  return std::any_of(
    rings.begin(), rings.end(), [&](const StentRingResult& ring) { return ring.point == point; });
}
}

const char* NameOf(ProcedureEvent::Kind kind, const char*& quantity)
{
  static const char* const names[][2] = { { "over_expansion", "diameter_over_reference" },
    { "over_rated_pressure", "atm" }, { "stent_over_expansion", "diameter_over_greatest" },
    { "under_expansion", "area_over_reference" }, { "malapposition", "gap_mm" },
    { "geographic_miss", "disease_mm" }, { "beyond_vessel", "stent_mm" },
    { "ischaemia", "share_without_blood" }, { "vasospasm", "narrowing" },
    { "air_embolism", "air_mL" }, { "side_branch_closed", "carina_shift" },
    { "jailed_wire_pulled", "N" }, { "dissection", "flap" }, { "perforation", "hole_mm" },
    { "tamponade", "mmHg" } };
  const auto& [name, value] = names[static_cast<int>(kind)];
  quantity = value;
  return name;
}

LesionWatch::LesionWatch(
  const WallTopology& topology, const ContrastModel& medium, const std::vector<BranchMouth>& mouths)
  : Reference(ReferenceRadii(topology))
  , Closed(ClosedRadii(topology))
  , Names(topology.groupName)
{
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    this->First.push_back(FirstAxisPoint(topology, static_cast<int>(b)));
    this->Resting.insert(
      this->Resting.end(), topology.axisRadius[b].begin(), topology.axisRadius[b].end());
  }
  for (FoundLesion& lesion : FindLesions(topology))
  {
    Watched one;
    const std::int64_t last = lesion.points.back();
    const int branch = this->BranchOf(last);
    const FlowBranch& along = medium.FlowModel().Network().Branches()[branch];
    one.reference = this->Reference[lesion.branch][lesion.throat - this->First[lesion.branch]];
    if (one.reference < ThinnestGraded)
    {
      continue;
    }
    const auto axisAt = [&](std::int64_t point)
    {
      const int b = this->BranchOf(point);
      return topology.axis[b][point - this->First[b]];
    };
    for (std::size_t n = 0; n < lesion.points.size(); ++n)
    {
      one.along.push_back(n == 0
          ? 0.0
          : one.along.back() + (axisAt(lesion.points[n]) - axisAt(lesion.points[n - 1])).norm());
    }
    const VesselWay way = WayThrough(topology, branch);
    for (std::size_t n = 0; n < way.points.size(); ++n)
    {
      one.from = way.points[n] == lesion.points.front() ? way.place[n] : one.from;
      one.to = way.points[n] == last ? way.place[n] : one.to;
    }
    this->Distal.push_back({ branch, along.abscissa[last - this->First[branch]] });
    one.lesion = std::move(lesion);
    this->Lesions.push_back(std::move(one));
  }
  for (std::size_t n = 0; n < mouths.size(); ++n)
  {
    this->WatchMouth(mouths[n], n, topology);
  }
  this->Reserve = this->ReserveBefore = medium.FlowModel().FlowReserves(this->Distal);
}

void LesionWatch::WatchMouth(
  const BranchMouth& mouth, std::size_t number, const WallTopology& topology)
{
  for (WatchedMouth& one : this->Branches)
  {
    if (one.result.branch == mouth.branch)
    {
      one.numbers.push_back(number);
      return;
    }
  }
  const std::int64_t last = mouth.own.back().first;
  const std::int64_t k = last - this->First[mouth.branch];
  WatchedMouth one;
  one.result.reference = 2.0 * this->Reference[mouth.branch][k];
  if (one.result.reference < 2.0 * ThinnestGraded)
  {
    return;
  }
  one.result.branch = mouth.branch;
  one.result.vessel = this->NameOfBranch(mouth.branch);
  one.result.degreeBefore = mouth.degreeBefore;
  one.at = mouth.at;
  one.numbers.push_back(number);
  const VesselWay way = WayThrough(topology, mouth.branch);
  double along = 0.0; // mm of the branch
  for (std::size_t n = 0; n < way.points.size(); ++n)
  {
    one.result.place = way.points[n] == mouth.at ? way.place[n] : one.result.place;
    along = way.points[n] == last ? way.place[n] : along;
  }
  const auto begin = std::find(way.branch.begin(), way.branch.end(), mouth.branch);
  const double from = way.place[static_cast<std::size_t>(begin - way.branch.begin())];
  this->Distal.push_back({ mouth.branch, along - from });
  this->Branches.push_back(std::move(one));
}

int LesionWatch::BranchOf(std::int64_t point) const
{
  return static_cast<int>(
    std::upper_bound(this->First.begin(), this->First.end(), point) - this->First.begin() - 1);
}

void LesionWatch::StepFlow(double seconds, const Intervention& instruments,
  const VesselIncidents& incidents, const VesselTears& tears, ContrastModel& medium)
{
  this->FlowIsNew_ = false;
  const DilatableWall* wall = instruments.Dilated();
  const auto [guideFirst, guideCount] = instruments.GuideCovers();
  if (wall || guideCount > 0 || incidents.Any() || tears.Any() || !this->Filled_.empty())
  {
    std::vector<double> lumen = wall ? wall->Radii() : this->Resting;
    for (const BranchMouth& mouth : instruments.Mouths())
    {
      for (std::size_t n = 0; n < mouth.own.size() && mouth.closed; ++n)
      {
        lumen[mouth.own[n].first] = std::min(lumen[mouth.own[n].first], ClosedMouth);
      }
    }
    std::vector<double> filled(lumen.size(), 0.0);
    if (wall)
    {
      for (const auto& [point, radius] : instruments.Balloon()->Sections())
      {
        filled[point] = radius;
      }
    }
    for (std::int64_t point = guideFirst; point < guideFirst + guideCount; ++point)
    {
      filled[point] = std::max(filled[point], instruments.Catheter().outerRadius);
    }
    if (incidents.Any())
    {
      incidents.Apply(lumen, filled);
    }
    tears.Apply(lumen, filled);
    if (filled != this->Filled_ || lumen != this->Lumen_)
    {
      this->Filled_ = std::move(filled);
      this->Lumen_ = std::move(lumen);
      medium.SetLumen(this->Lumen_, this->Filled_);
      this->ReserveIsOld = true;
      this->ReserveAsked.clear();
      this->ChangesFor += seconds;
      this->FlowIsNew_ = this->ChangesFor >= LongestChange;
    }
    else if (this->ReserveIsOld)
    {
      // A network to be solved until it rests: not while a balloon moves or fills.
      this->Reserve = this->ReserveNow(medium);
      this->ReserveIsOld = false;
      this->FlowIsNew_ = true;
    }
    this->ChangesFor = this->FlowIsNew_ ? 0.0 : this->ChangesFor;
  }
  const double share = -std::expm1(-seconds / PressureTime);
  for (std::size_t n = 0; n < this->Lesions.size(); ++n)
  {
    Watched& one = this->Lesions[n];
    const double aortic = medium.AorticPressure();
    const double distal = medium.FlowModel().PressureAt(this->Distal[n]);
    const bool first = one.meanAortic == 0.0;
    one.meanAortic += (first ? 1.0 : share) * (aortic - one.meanAortic);
    one.meanDistal += (first ? 1.0 : share) * (distal - one.meanDistal);
  }
}

void LesionWatch::Renew()
{
  this->ReserveIsOld = true;
  this->ReserveAsked.clear();
}

void LesionWatch::Note(
  const ProcedureEvent& event, const std::string& text, std::vector<std::string>& said)
{
  this->Events_.push_back(event);
  said.push_back(text);
}

std::string LesionWatch::NameOfBranch(int branch) const
{
  const auto n = static_cast<std::size_t>(branch);
  const bool named = n < this->Names.size() && !this->Names[n].empty();
  return named ? this->Names[n] : "a vessel without a name";
}

std::string LesionWatch::NameAt(std::int64_t point) const
{
  return this->NameOfBranch(this->BranchOf(point));
}

void LesionWatch::TellIschaemia(
  const Ischaemia& heart, double seconds, double place, std::vector<std::string>& said)
{
  const std::vector<int> branches = heart.BranchesWithout();
  // Parts of one vessel are one.
  std::vector<std::string> names;
  std::string list;
  for (const int branch : branches)
  {
    const std::string name = this->NameOfBranch(branch);
    if (std::find(names.begin(), names.end(), name) == names.end())
    {
      list += (names.empty() ? " (" : ", ") + name;
      names.push_back(name);
    }
  }
  const double share = heart.ShareWithout();
  said.push_back(
    Format(
      "The ST segment is up by %.1f mV: %.0f %% of the heart that these arteries supply lack blood",
      Ischaemia::Elevated, 100.0 * share) +
    list + (list.empty() ? "." : ")."));
  this->Events_.push_back({ ProcedureEvent::Kind::Ischaemia, seconds,
    branches.empty() ? -1 : branches.front(), share, place });
}

/// @param point  of the axes where it is; -1: in the guide
void LesionWatch::Tell(
  ProcedureEvent event, std::int64_t point, const std::string& text, std::vector<std::string>& said)
{
  event.branch = point >= 0 ? this->BranchOf(point) : -1;
  this->Events_.push_back(event);
  said.push_back(point < 0 ? text + " It is in the guide catheter."
                           : Format("%s It is in %s, %.1f mm from the ostium.", text.c_str(),
                               this->NameAt(point).c_str(), event.place));
}

void LesionWatch::StepTick(double seconds, const Intervention& instruments,
  const BalloonCatheter& balloon, std::vector<std::string>& said)
{
  using Kind = ProcedureEvent::Kind;
  const BalloonReport& report = instruments.Report().balloon;
  const double tearing = instruments.Dilated()->Settings().tearing;
  const char* name = balloon.name.c_str();
  if (report.stretch > tearing && !this->Stretched)
  {
    this->Tell({ Kind::OverExpansion, seconds, -1, report.stretch, report.stretchedPlace },
      report.stretched,
      Format("The balloon '%s' stretches the wall to %.2f of its reference diameter: dissection "
             "threatens.",
        name, report.stretch),
      said);
  }
  if (report.pressure > balloon.ratedPressure && !this->Pressed)
  {
    this->Tell({ Kind::OverPressure, seconds, -1, report.pressure, report.middle }, report.place,
      Format("The balloon '%s' is at %.1f atm, above its rated pressure.", name, report.pressure),
      said);
  }
  if (report.ringStretch > 1.0 && !this->Overwide)
  {
    this->Tell({ Kind::StentOverExpansion, seconds, -1, report.ringStretch, report.ringPlace },
      report.ringPoint,
      Format("The balloon '%s' opens a stent to %.2f of the diameter that its design allows.", name,
        report.ringStretch),
      said);
  }
  const bool open = report.pressure > Relaxed;
  this->Stretched = report.stretch > tearing || (this->Stretched && open);
  this->Pressed = report.pressure > balloon.ratedPressure || (this->Pressed && open);
  this->Overwide = report.ringStretch > 1.0 || (this->Overwide && open);
  this->StepMouths(seconds, instruments, said);
  for (Watched& one : this->Lesions)
  {
    const std::vector<std::int64_t>& points = one.lesion.points;
    if (report.stretch > one.stretch &&
      std::find(points.begin(), points.end(), report.place) != points.end())
    {
      one.stretch = report.stretch;
    }
  }
  if (instruments.Stents().empty())
  {
    return;
  }
  this->StepJail(seconds, instruments, said);
  if (open)
  {
    this->LastHeld = seconds;
    this->ToJudge = true;
  }
  else if (this->ToJudge && seconds - this->LastHeld > SpringBack)
  {
    this->ToJudge = false;
    const std::vector<StentResult> stents = this->Stents(instruments);
    this->Judgements.resize(stents.size());
    for (std::size_t n = 0; n < stents.size(); ++n)
    {
      this->Judge(seconds, stents[n], this->Judgements[n], said);
    }
  }
}

void LesionWatch::StepMouths(
  double seconds, const Intervention& instruments, std::vector<std::string>& said)
{
  for (WatchedMouth& one : this->Branches)
  {
    bool closed = false;
    double shift = 0.0;
    for (const std::size_t number : one.numbers)
    {
      const BranchMouth& mouth = instruments.Mouths()[number];
      closed = closed || mouth.closed;
      shift = std::max(shift, mouth.shift);
    }
    if (closed == one.toldClosed)
    {
      continue;
    }
    one.toldClosed = closed;
    const char* name = one.result.vessel.c_str();
    if (closed)
    {
      this->Note({ ProcedureEvent::Kind::SideBranchClosed, seconds, one.result.branch, shift,
                   one.result.place },
        Format("The side branch %s is closed: carina and plaque were shifted over its mouth, and "
               "no wire is in it. It leaves %.1f mm from the ostium.",
          name, one.result.place),
        said);
    }
    else
    {
      said.push_back(Format("The side branch %s is open again.", name));
    }
  }
}

void LesionWatch::StepJail(
  double seconds, const Intervention& instruments, std::vector<std::string>& said)
{
  static const char* const names[TickReport::MostWires] = { "first", "second" };
  const TickReport& report = instruments.Report();
  for (std::size_t n = 0; n < instruments.NumberOfWires(); ++n)
  {
    const WireReport& wire = report.wires[n];
    if (wire.jailed != this->Jailed[n])
    {
      this->Jailed[n] = wire.jailed;
      said.push_back(wire.jailed
          ? Format("The %s wire is jailed between the stent and the wall.", names[n])
          : Format("The %s wire is free of the stent.", names[n]));
    }
    const bool hard = n == report.hand && wire.jailed && wire.grip > StentBears;
    if (hard && !this->PulledHard[n])
    {
      this->Tell({ ProcedureEvent::Kind::JailedWirePulled, seconds, -1, wire.grip,
                   instruments.Stents().back().middle },
        instruments.Stents().back().points.front(),
        Format("The jailed %s wire is pulled with %.2f N: the stent may be shortened.", names[n],
          wire.grip),
        said);
    }
    this->PulledHard[n] = hard || (this->PulledHard[n] && wire.jailed);
  }
}

void LesionWatch::Judge(
  double seconds, const StentResult& stent, Judged& before, std::vector<std::string>& said)
{
  using Kind = ProcedureEvent::Kind;
  const char* name = stent.name.c_str();
  const StentRingResult* narrowest = stent.Narrowest();
  if (!narrowest)
  {
    return;
  }
  const double area = narrowest->Area();
  if (std::abs(area - before.leastArea) > 0.01 * area)
  {
    before.leastArea = area;
    said.push_back(
      Format("The stent of '%s' lies in %s, %.1f to %.1f mm from the ostium: least area %.2f mm2, "
             "least expansion %.0f %% of the reference area, residual stenosis %.0f %%.",
        name, stent.vessel.c_str(), stent.from, stent.to, area,
        100.0 * stent.LeastExpanded()->Expansion(), 100.0 * stent.residual));
  }
  const auto tell = [&](bool now, bool& told, Kind kind, double value, const StentRingResult& where,
                      const char* text)
  {
    if (now && !told)
    {
      this->Tell(
        { kind, seconds, -1, value, where.place }, where.point, Format(text, name, value), said);
    }
    told = now;
  };
  const StentRingResult& tight = *stent.LeastExpanded();
  tell(tight.Expansion() < StentResult::ExpansionTold, before.underExpanded, Kind::UnderExpansion,
    tight.Expansion(), tight,
    "The stent of '%s' is under-expanded: its area is %.2f of the reference.");
  const StentRingResult& loose = *stent.GreatestGap();
  tell(loose.gap > StentResult::GapTold, before.malapposed, Kind::Malapposition, loose.gap, loose,
    "The stent of '%s' does not reach the wall: a gap of %.2f mm.");
  const double missed = std::max(stent.missedBefore, stent.missedBehind);
  const StentRingResult& end =
    stent.missedBefore > stent.missedBehind ? stent.rings.front() : stent.rings.back();
  tell(stent.missedAll || missed > StentResult::MissTold, before.missed, Kind::GeographicMiss,
    missed, end,
    stent.missedAll ? "The stent of '%s' covers no lesion."
                    : "The stent of '%s' ends in the lesion: %.1f mm of it go on beside it.");
  tell(stent.beyond > 0.0, before.beyond, Kind::BeyondVessel, stent.beyond, stent.rings.back(),
    "The stent of '%s' is longer than the vessel that it is in: %.1f mm are beyond its end.");
}

std::vector<StentResult> LesionWatch::Stents(const Intervention& instruments) const
{
  std::vector<StentResult> results;
  for (const PlacedStent& stent : instruments.Stents())
  {
    StentResult result = MeasureStent(stent, *instruments.Dilated());
    if (!stent.points.empty())
    {
      result.vessel = this->NameAt(stent.points[stent.points.size() / 2]);
    }
    for (StentRingResult& ring : result.rings)
    {
      ring.branch = this->BranchOf(ring.point);
    }
    result.missedAll = !this->Lesions.empty();
    results.push_back(std::move(result));
  }
  // Of each lesion, what is before the first and behind the last point that any stent covers.
  for (const Watched& one : this->Lesions)
  {
    const std::vector<std::int64_t>& points = one.lesion.points;
    const auto covers = [&](const StentResult& stent, std::size_t n)
    { return Has(stent.rings, points[n]); };
    std::size_t first = points.size();
    std::size_t last = 0;
    for (std::size_t n = 0; n < points.size(); ++n)
    {
      if (std::any_of(results.begin(), results.end(),
            [&](const StentResult& stent) { return covers(stent, n); }))
      {
        first = std::min(first, n);
        last = n;
      }
    }
    for (StentResult& stent : results)
    {
      for (std::size_t n = first; n <= last && n < points.size(); ++n)
      {
        stent.missedAll = stent.missedAll && !covers(stent, n);
      }
      if (first < points.size() && covers(stent, first))
      {
        stent.missedBefore = std::max(stent.missedBefore, one.along[first]);
      }
      if (first < points.size() && covers(stent, last))
      {
        stent.missedBehind = std::max(stent.missedBehind, one.along.back() - one.along[last]);
      }
    }
  }
  return results;
}

const std::vector<double>& LesionWatch::ReserveNow(const ContrastModel& medium) const
{
  if (!this->ReserveIsOld)
  {
    return this->Reserve;
  }
  if (this->ReserveAsked.empty())
  {
    this->ReserveAsked = medium.FlowModel().FlowReserves(this->Distal);
  }
  return this->ReserveAsked;
}

std::vector<MouthResult> LesionWatch::Mouths(
  const Intervention& instruments, const ContrastModel& medium) const
{
  const std::vector<double>& reserve = this->ReserveNow(medium);
  std::vector<MouthResult> results;
  for (std::size_t n = 0; n < this->Branches.size(); ++n)
  {
    MouthResult result = this->Branches[n].result;
    for (const std::size_t number : this->Branches[n].numbers)
    {
      const BranchMouth& mouth = instruments.Mouths()[number];
      result.degree = std::max(result.degree, mouth.degree);
      result.closed = result.closed || mouth.closed;
    }
    result.reserveBefore = this->ReserveBefore[this->Lesions.size() + n];
    result.reserve = reserve[this->Lesions.size() + n];
    results.push_back(std::move(result));
  }
  return results;
}

std::vector<LesionResult> LesionWatch::Results(
  const Intervention& instruments, const ContrastModel& medium) const
{
  const DilatableWall* wall = instruments.Dilated();
  const std::vector<double>& reserve = this->ReserveNow(medium);
  std::vector<LesionResult> results;
  for (std::size_t n = 0; n < this->Lesions.size(); ++n)
  {
    const Watched& one = this->Lesions[n];
    LesionResult result;
    result.branch = one.lesion.branch;
    result.vessel = this->NameOfBranch(result.branch);
    result.reference = 2.0 * one.reference;
    result.degreeBefore = result.degree = one.lesion.degree;
    result.least = 2.0 * one.reference * (1.0 - one.lesion.degree);
    if (wall)
    {
      result.degree = 0.0;
      result.least = 1e9;
      for (const std::int64_t point : one.lesion.points)
      {
        const int branch = this->BranchOf(point);
        const std::int64_t k = point - this->First[branch];
        const double radius = wall->Radii()[point];
        const double open = radius > this->Closed[branch][k] ? radius : 0.0;
        result.degree = std::max(result.degree, 1.0 - open / this->Reference[branch][k]);
        result.least = std::min(result.least, 2.0 * open);
      }
    }
    result.pressureRatio = one.meanAortic > 0.0 ? one.meanDistal / one.meanAortic : 0.0;
    result.reserveBefore = this->ReserveBefore[n];
    result.reserve = reserve[n];
    result.stretch = one.stretch;
    result.from = one.from;
    result.to = one.to;
    const std::vector<std::int64_t>& points = one.lesion.points;
    result.holdsBalloon =
      std::find(points.begin(), points.end(), instruments.Report().balloon.place) != points.end();
    results.push_back(std::move(result));
  }
  return results;
}
}
