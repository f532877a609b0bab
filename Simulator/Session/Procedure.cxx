#include "Procedure.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace coronary
{
namespace
{
using Goal = ProcedureStep::Goal;

constexpr double ViewsApart = 25.0 * Degree;
constexpr double Injection = 2.0;      // mL in a run, for vessels that are seen
constexpr double OpenBalloon = 0.5;    // atm
constexpr double InGuide = 0.5;        // mm of wire that are still taken for none
constexpr double IschaemiaFree = 60.0; // s

bool IsOfLesion(Goal goal)
{
  return goal == Goal::WireAtLesion || goal == Goal::MicrocatheterAtLesion ||
    goal == Goal::WireBeyondLesion || goal == Goal::BalloonInLesion ||
    goal == Goal::StentInLesion || goal == Goal::StenosisBelow || goal == Goal::ReserveAbove;
}

bool NeedsBalloon(Goal goal)
{
  return goal == Goal::BalloonInLesion || goal == Goal::StentInLesion ||
    goal == Goal::SideBranchOpen || goal == Goal::MicrocatheterAtLesion;
}

/// The step's lesion among the session's.
std::size_t LesionFor(const ProcedureStep& step, const std::vector<LesionResult>& lesions)
{
  std::size_t best = lesions.size();
  for (std::size_t n = 0; n < lesions.size(); ++n)
  {
    const bool named = step.vessel.empty() || lesions[n].vessel == step.vessel;
    if (named && (best == lesions.size() || lesions[n].degreeBefore > lesions[best].degreeBefore))
    {
      best = n;
    }
  }
  if (best == lesions.size())
  {
    throw std::invalid_argument("The procedure's step '" + step.text + "' needs a lesion" +
      (step.vessel.empty() ? "" : " in '" + step.vessel + "'") + ", and the vessels have none.");
  }
  return best;
}

/// There is a hole in a wall, and all of them are so.
template <typename Property>
bool HolesAre(const ProcedureMoment& moment, Property are)
{
  bool any = false;
  bool all = true;
  for (const VesselTear& tear : moment.tears ? *moment.tears : std::vector<VesselTear>())
  {
    const bool hole = tear.kind == VesselTear::Kind::Perforation;
    any = any || hole;
    all = all && (!hole || are(tear));
  }
  return any && all;
}

double Counted(const SessionMetrics& metrics, ProcedureEvent::Kind kind)
{
  return static_cast<double>(std::count_if(metrics.events.begin(), metrics.events.end(),
    [kind](const ProcedureEvent& event) { return event.kind == kind; }));
}
}

ProcedureWatch::ProcedureWatch(const std::vector<ProcedureStep>& steps,
  const WallTopology& topology, const std::vector<LesionResult>& lesions, bool hasBalloon,
  const std::vector<MouthResult>& mouths)
  : Steps(steps)
  , Parent(topology.parent)
  , Names(topology.groupName)
{
  for (const ProcedureStep& step : steps)
  {
    this->LesionOf.push_back(IsOfLesion(step.goal) ? LesionFor(step, lesions) : 0);
    if (NeedsBalloon(step.goal) && !hasBalloon)
    {
      throw std::invalid_argument(
        "The procedure's step '" + step.text + "' needs a balloon, and the scenario has none.");
    }
    if (step.goal == Goal::WireIn &&
      std::find(this->Names.begin(), this->Names.end(), step.vessel) == this->Names.end())
    {
      throw std::invalid_argument("The procedure's step '" + step.text +
        "' needs a vessel that is not there: '" + step.vessel + "'.");
    }
    if (step.goal == Goal::SideBranchOpen &&
      std::none_of(mouths.begin(), mouths.end(),
        [&](const MouthResult& mouth) { return mouth.vessel == step.vessel; }))
    {
      std::string names;
      for (const MouthResult& mouth : mouths)
      {
        names += (names.empty() ? "" : ", ") + mouth.vessel;
      }
      throw std::invalid_argument("The procedure's step '" + step.text +
        "' needs a side branch of 1.5 mm or more that is not there: '" + step.vessel +
        "'; there are " + (names.empty() ? "none" : names) + ".");
    }
  }
}

bool ProcedureWatch::NeedsLesions() const
{
  const std::size_t n = this->State_.reached.size();
  return n < this->Steps.size() &&
    (IsOfLesion(this->Steps[n].goal) || this->Steps[n].goal == Goal::SideBranchOpen);
}

/// In the vessel or behind it.
bool ProcedureWatch::IsIn(int branch, const std::string& vessel) const
{
  while (branch >= 0 && this->Names[static_cast<std::size_t>(branch)] != vessel)
  {
    branch = this->Parent[static_cast<std::size_t>(branch)];
  }
  return branch >= 0;
}

bool ProcedureWatch::IsBehind(int branch, int ancestor) const
{
  while (branch >= 0 && branch != ancestor)
  {
    const auto n = static_cast<std::size_t>(branch);
    branch = n < this->Parent.size() ? this->Parent[n] : -1;
  }
  return branch >= 0;
}

/// A run counts when enough contrast medium was given in it, and from another side than those that did.
bool ProcedureWatch::SeesView(const ProcedureMoment& moment, double views)
{
  if (!moment.cine)
  {
    this->RunCounts = false;
    return false;
  }
  if (moment.run != this->Run || !this->RunCounts)
  {
    this->Run = moment.run;
    this->RunInjected = moment.injected;
    this->RunCounts = true;
  }
  const Vector3 direction = BeamDirection(moment.pose);
  const bool isNew = std::all_of(this->Views.begin(), this->Views.end(),
    [&](const Vector3& other)
    { return std::acos(std::clamp(direction.dot(other), -1.0, 1.0)) > ViewsApart; });
  if (moment.injected - this->RunInjected >= Injection && isNew)
  {
    this->Views.push_back(direction);
  }
  return static_cast<double>(this->Views.size()) >= views;
}

bool ProcedureWatch::Reached(const ProcedureMoment& moment,
  const std::vector<LesionResult>& lesions, const std::vector<StentResult>& stents,
  const std::vector<MouthResult>& mouths)
{
  const std::size_t n = this->State_.reached.size();
  const ProcedureStep& step = this->Steps[n];
  const TickReport& report = moment.report;
  const LesionResult* lesion = IsOfLesion(step.goal) ? &lesions.at(this->LesionOf[n]) : nullptr;
  const bool open = report.balloon.pressure > OpenBalloon;
  switch (step.goal)
  {
    case Goal::Angiogram:
      return this->SeesView(moment, step.value);
    case Goal::GuideIn:
      return report.catheterTip >= 0.0;
    case Goal::WireIn:
      return this->IsIn(
        step.wire < 0 ? report.branch : report.wires.at(step.wire).branch, step.vessel);
    case Goal::WireAtLesion:
      return this->IsBehind(lesion->branch, report.branch) &&
        report.catheterTip + report.inserted >= lesion->from - step.value;
    case Goal::MicrocatheterAtLesion:
      // The wire's tip says which way it is on.
      return report.balloon.microcatheter && report.balloon.place >= 0 &&
        (this->IsBehind(lesion->branch, report.branch) ||
          this->IsBehind(report.branch, lesion->branch)) &&
        report.balloon.middle >= lesion->from - step.value;
    case Goal::WireTaken:
      return static_cast<double>(moment.wire) == step.value;
    case Goal::BalloonTaken:
      return static_cast<double>(moment.balloon) == step.value;
    case Goal::WireBeyondLesion:
      return this->IsBehind(report.branch, lesion->branch) &&
        report.catheterTip + report.inserted - lesion->to >= step.value;
    case Goal::BalloonInLesion:
      return report.balloon.pressure >= step.value && report.balloon.place >= 0 &&
        report.balloon.middle >= lesion->from && report.balloon.middle <= lesion->to &&
        lesion->holdsBalloon;
    case Goal::StentInLesion:
      return std::any_of(stents.begin(), stents.end(),
        [&](const StentResult& stent)
        { return !stent.missedAll && stent.from <= lesion->to && stent.to >= lesion->from; });
    case Goal::StenosisBelow:
      return !open && 100.0 * lesion->degree < step.value;
    case Goal::ReserveAbove:
      return !open && lesion->reserve > step.value;
    case Goal::WireBack:
      if (step.wire >= 0)
      {
        return report.wires.at(step.wire).inserted < InGuide;
      }
      return report.wires[0].inserted < InGuide && report.wires[1].inserted < InGuide &&
        report.balloon.place < 0;
    case Goal::SideBranchOpen:
      return !open &&
        std::all_of(mouths.begin(), mouths.end(),
          [&](const MouthResult& mouth)
          { return mouth.vessel != step.vessel || (!mouth.closed && mouth.reserve > step.value); });
    case Goal::LeakStopped:
      return HolesAre(moment, [](const VesselTear& hole) { return hole.sealed || hole.covered; });
    case Goal::LeakSealed:
      return HolesAre(moment, [](const VesselTear& hole) { return hole.sealed; });
  }
  return false;
}

void ProcedureWatch::Step(const ProcedureMoment& moment, const std::vector<LesionResult>& lesions,
  const std::vector<StentResult>& stents, std::vector<std::string>& said,
  const std::vector<MouthResult>& mouths)
{
  while (!this->Done() && this->Reached(moment, lesions, stents, mouths))
  {
    const std::size_t n = this->State_.reached.size();
    this->State_.reached.push_back(moment.metrics.procedureSeconds);
    this->Views.clear();
    this->RunCounts = false;
    said.push_back("Step " + std::to_string(n + 1) + " of " + std::to_string(this->Steps.size()) +
      " is done: " + this->Steps[n].text + ".");
    if (this->NeedsLesions() && lesions.empty() && mouths.empty())
    {
      return;
    }
  }
}

double ScoreItem::Lost() const
{
  return std::min(this->most, this->weight * this->amount);
}

ProcedureScore ScoreOf(const std::vector<ProcedureStep>& steps, const ProcedureState& state,
  const SessionMetrics& metrics, const std::vector<StentResult>& stents, const TickReport& last,
  const std::vector<MouthResult>& mouths)
{
  using Kind = ProcedureEvent::Kind;
  ProcedureScore score;
  for (std::size_t n = state.reached.size(); n < steps.size(); ++n)
  {
    score.failures.push_back("not done: " + steps[n].text);
  }
  if (last.balloon.wallPressure > 0.0 && !last.balloon.microcatheter)
  {
    score.failures.emplace_back("a balloon is left open in the vessel");
  }
  for (const MouthResult& mouth : mouths)
  {
    if (mouth.closed)
    {
      score.failures.push_back("the side branch " + mouth.vessel + " is left closed");
    }
  }
  // A procedure that asks for a sealed hole forgives one.
  const auto asked = static_cast<double>(std::count_if(steps.begin(), steps.end(),
    [](const ProcedureStep& step) { return step.goal == Goal::LeakSealed; }));
  if (Counted(metrics, Kind::Perforation) > asked)
  {
    score.failures.emplace_back("a vessel was perforated");
  }
  if (metrics.openHoles > 0)
  {
    score.failures.emplace_back("a perforation is left open");
  }
  if (Counted(metrics, Kind::Tamponade) > 0.0)
  {
    score.failures.emplace_back("the heart was tamponaded");
  }
  const auto stentsThat = [&](const auto& are)
  { return static_cast<double>(std::count_if(stents.begin(), stents.end(), are)); };
  score.items = {
    { "tip pressed on the wall (above 0.1 N)", metrics.forcefulSeconds, "s", 2.0, 20.0 },
    { "wire moved without X-ray", metrics.blindTravel, "mm", 0.1, 20.0 },
    { "X-ray while nothing moves for more than 3 s", metrics.idleBeamSeconds, "s", 1.0, 10.0 },
    { "vessel closed by a balloon, beyond 60 s",
      std::max(0.0, metrics.occludedSeconds - IschaemiaFree), "s", 0.5, 20.0 },
    { "balloon beyond its rated pressure", Counted(metrics, Kind::OverPressure), "times", 10.0,
      20.0 },
    { "wall stretched beyond 1.3 of its reference", Counted(metrics, Kind::OverExpansion), "times",
      15.0, 30.0 },
    { "stent wider than its design", Counted(metrics, Kind::StentOverExpansion), "times", 15.0,
      15.0 },
    { "stent left below 80 % of the reference area",
      stentsThat(
        [](const StentResult& stent)
        {
          const StentRingResult* ring = stent.LeastExpanded();
          return ring && ring->Expansion() < StentResult::ExpansionTold;
        }),
      "stents", 10.0, 20.0 },
    { "stent left beside the wall",
      stentsThat(
        [](const StentResult& stent)
        {
          const StentRingResult* ring = stent.GreatestGap();
          return ring && ring->gap > StentResult::GapTold;
        }),
      "stents", 10.0, 20.0 },
    { "disease left beside a stent",
      stentsThat(
        [](const StentResult& stent)
        {
          return stent.missedAll || stent.missedBefore > StentResult::MissTold ||
            stent.missedBehind > StentResult::MissTold;
        }),
      "stents", 10.0, 20.0 },
    { "stent beyond the vessel", Counted(metrics, Kind::BeyondVessel), "times", 10.0, 10.0 },
    { "side branch closed", Counted(metrics, Kind::SideBranchClosed), "times", 20.0, 40.0 },
    { "jailed wire pulled with more than 0.5 N", Counted(metrics, Kind::JailedWirePulled), "times",
      10.0, 10.0 },
    { "wall dissected", Counted(metrics, Kind::Dissection), "times", 10.0, 20.0 },
    { "blood in the pericardium", metrics.pericardialBlood, "mL", 0.2, 40.0 },
  };
  for (const ScoreItem& item : score.items)
  {
    score.points -= item.Lost();
  }
  score.points = std::max(0.0, score.points);
  score.passed = score.failures.empty();
  return score;
}

std::vector<std::string> LinesOf(const ProcedureScore& score)
{
  char text[200];
  std::snprintf(text, sizeof(text), "%s: %.0f of 100 points.",
    score.passed ? "Procedure done" : "Procedure failed", score.points);
  std::vector<std::string> lines{ text };
  for (const std::string& failure : score.failures)
  {
    lines.push_back("Failed: " + failure + ".");
  }
  for (const ScoreItem& item : score.items)
  {
    if (item.Lost() > 0.0)
    {
      std::snprintf(text, sizeof(text), "-%.1f: %s, %.3g %s x %g, at most %g.", item.Lost(),
        item.name.c_str(), item.amount, item.unit.c_str(), item.weight, item.most);
      lines.emplace_back(text);
    }
  }
  return lines;
}

std::string NextOf(const std::vector<ProcedureStep>& steps, const ProcedureState& state)
{
  const std::size_t n = state.reached.size();
  if (steps.empty())
  {
    return {};
  }
  return n < steps.size()
    ? "Step " + std::to_string(n + 1) + " of " + std::to_string(steps.size()) + ": " + steps[n].text
    : "All " + std::to_string(steps.size()) + " steps are done.";
}
}
