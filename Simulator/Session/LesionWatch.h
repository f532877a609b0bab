/**
 * @file LesionWatch.h
 * @brief The lesions of a session: how open they are, what flows through them, and what balloons and stents did to
 * them.
 */
#ifndef DynamicCoronary_LesionWatch_h
#define DynamicCoronary_LesionWatch_h

#include "ContrastModel.h"
#include "Intervention.h"
#include "Ischaemia.h"
#include "StentResult.h"
#include "VesselIncidents.h"
#include "VesselLesions.h"

#include <array>
#include <string>
#include <vector>

namespace coronary
{
class VesselTears;

struct LesionResult
{
  std::string vessel;
  int branch = 0;             ///< with the narrowest place
  double reference = 0.0;     ///< mm, diameter without the lesion at its narrowest place
  double least = 0.0;         ///< mm, diameter now
  double degreeBefore = 0.0;  ///< of the diameter, when the session began; 1: occluded
  double degree = 0.0;        ///< now; after a dilation the residual stenosis
  double pressureRatio = 0.0; ///< Pd / Pa, means over about two seconds
  double reserveBefore = 0.0; ///< FFR when the session began
  double reserve = 0.0;       ///< FFR now
  double stretch = 0.0;       ///< greatest diameter that a balloon gave it, over the reference
  double from = 0.0;          ///< mm from the ostium
  double to = 0.0;
  bool holdsBalloon = false; ///< the balloon's middle is in it
};

/// The mouth of a side branch.
struct MouthResult
{
  std::string vessel;
  int branch = 0;
  double reference = 0.0;     ///< mm, diameter of the branch
  double place = 0.0;         ///< mm from the ostium
  double degreeBefore = 0.0;  ///< of the diameter, when the session began
  double degree = 0.0;        ///< now; 1: closed
  bool closed = false;        ///< no blood comes in, though the branch was open
  double reserveBefore = 0.0; ///< FFR behind it when the session began
  double reserve = 0.0;       ///< FFR now
};

/// Something that a report has to name.
struct ProcedureEvent
{
  enum class Kind
  {
    OverExpansion, ///< wall beyond 1.3 of its reference: dissection threatens; value: diameter over reference
    OverPressure,       ///< balloon beyond its rated pressure; value: atm
    StentOverExpansion, ///< wider than its design allows; value: diameter over that
    UnderExpansion,     ///< value: least area over the reference's
    Malapposition,      ///< value: mm from stent to wall
    GeographicMiss,     ///< value: mm of the disease that are beside the stent
    BeyondVessel,       ///< value: mm of the stent without a vessel around
    Ischaemia,          ///< the ST segment is up; value: share of the heart without blood
    Spasm,              ///< value: narrowing of the diameter
    Air,                ///< in an artery; value: mL
    SideBranchClosed, ///< what was opened beside it closed it; value: how far the carina is over its mouth
    JailedWirePulled, ///< beyond what stents bear along; value: N
    Dissection,       ///< value: part of the diameter that its flap takes
    Perforation,      ///< value: mm of the hole
    Tamponade         ///< blood presses on the heart; value: mmHg
  };
  Kind kind = Kind::OverExpansion;
  double seconds = 0.0;
  int branch = -1;
  double value = 0.0;
  double place = 0.0; ///< mm from the ostium
};

/// Words of result files for it. @param quantity  name of its value, with unit
const char* NameOf(ProcedureEvent::Kind kind, const char*& quantity);

class LesionWatch
{
public:
  /// @param mouths  of side branches that are watched, too
  LesionWatch(const WallTopology& topology, const ContrastModel& medium,
    const std::vector<BranchMouth>& mouths = {});

  /// A step of the flow: the lumen as it is now, and what lies in it, goes into the network.
  void StepFlow(double seconds, const Intervention& instruments, const VesselIncidents& incidents,
    const VesselTears& tears, ContrastModel& medium);
  /// What blood gets has changed, though the lumen has not.
  void Renew();
  /// Whether it is another flow since this was true before: the lumen has come to rest, or has changed for half a second.
  bool FlowIsNew() const { return this->FlowIsNew_; }
  /// @param place  mm from the ostium
  void TellIschaemia(
    const Ischaemia& heart, double seconds, double place, std::vector<std::string>& said);
  /// @param text  a sentence, for people
  void Note(const ProcedureEvent& event, const std::string& text, std::vector<std::string>& said);
  /// @param said  gets a sentence of each new event
  void StepTick(double seconds, const Intervention& instruments, const BalloonCatheter& balloon,
    std::vector<std::string>& said);

  bool Empty() const { return this->Lesions.empty(); }
  std::vector<LesionResult> Results(
    const Intervention& instruments, const ContrastModel& medium) const;
  /// Of side branches that are not thin.
  std::vector<MouthResult> Mouths(
    const Intervention& instruments, const ContrastModel& medium) const;
  /// Of the stents in the wall.
  std::vector<StentResult> Stents(const Intervention& instruments) const;
  const std::vector<ProcedureEvent>& Events() const { return this->Events_; }

  ///@{
  /// mm, per point of the axes in one list; empty without what changes or fills it.
  const std::vector<double>& Lumen() const { return this->Lumen_; }
  const std::vector<double>& Filled() const
  {
    return this->Filled_;
  } ///< by balloon and guide catheter
  ///@}

private:
  struct Watched
  {
    FoundLesion lesion;
    std::vector<double> along; ///< mm from its beginning, of its points
    double reference = 0.0;    ///< mm, radius
    double from = 0.0;         ///< mm from the ostium
    double to = 0.0;
    double stretch = 0.0;
    double meanDistal = 0.0; ///< mmHg
    double meanAortic = 0.0;
  };
  /// What was said of a stent.
  struct Judged
  {
    double leastArea = 0.0;
    bool underExpanded = false;
    bool malapposed = false;
    bool missed = false;
    bool beyond = false;
  };
  /// Of a side branch, all its mouths.
  struct WatchedMouth
  {
    MouthResult result;
    std::int64_t at = -1;             ///< point of the axes
    std::vector<std::size_t> numbers; ///< in Intervention::Mouths
    bool toldClosed = false;
  };
  const std::vector<double>& ReserveNow(const ContrastModel& medium) const;
  int BranchOf(std::int64_t point) const;
  void WatchMouth(const BranchMouth& mouth, std::size_t number, const WallTopology& topology);
  void StepMouths(double seconds, const Intervention& instruments, std::vector<std::string>& said);
  void StepJail(double seconds, const Intervention& instruments, std::vector<std::string>& said);
  std::string NameOfBranch(int branch) const;
  std::string NameAt(std::int64_t point) const;
  void Tell(ProcedureEvent event, std::int64_t point, const std::string& text,
    std::vector<std::string>& said);
  void Judge(
    double seconds, const StentResult& stent, Judged& before, std::vector<std::string>& said);

  std::vector<Watched> Lesions;
  std::vector<WatchedMouth> Branches;
  std::vector<CatheterTip> Distal; ///< place behind each lesion, and then each mouth
  std::vector<double> ReserveBefore;
  std::vector<double> Reserve; ///< of the lumen when it last stayed for a step
  bool ReserveIsOld = false;   ///< the lumen has changed since
  mutable std::vector<double>
    ReserveAsked;          ///< of the lumen now, when it is old; empty: nobody asked
  double ChangesFor = 0.0; ///< s
  bool FlowIsNew_ = false;
  std::vector<std::int64_t> First;            ///< point of each branch
  std::vector<std::vector<double>> Reference; ///< mm, radii
  std::vector<std::vector<double>> Closed;    ///< mm, ClosedRadii
  std::vector<std::string> Names;             ///< of branches
  std::vector<double>
    Resting; ///< mm, per point of the axes in one list: of the lumen without a balloon
  std::vector<double> Lumen_;
  std::vector<double> Filled_;
  std::vector<ProcedureEvent> Events_;
  std::vector<Judged> Judgements; ///< of the stents
  bool Stretched = false;
  bool Pressed = false;
  bool Overwide = false;
  std::array<bool, TickReport::MostWires> Jailed{}; ///< wires that were told of
  std::array<bool, TickReport::MostWires> PulledHard{};
  double LastHeld = 0.0; ///< s, when a balloon was open last
  bool ToJudge = false;
};
}

#endif
