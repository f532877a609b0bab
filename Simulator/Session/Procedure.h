/**
 * @file Procedure.h
 * @brief What a trainee is to do, a step after another, how far that was done, and a score with its formula.
 *
 * A step is done when its goal was seen once, in the order of the steps. Weights of the score are chosen, after the errors
 * that studies of simulators count (docs/simulator-guide.md); they were not fitted to experts.
 */
#ifndef DynamicCoronary_Procedure_h
#define DynamicCoronary_Procedure_h

#include "CArm.h"
#include "LesionWatch.h"
#include "Scenario.h"
#include "SessionMetrics.h"
#include "VesselTears.h"

#include <cstddef>
#include <string>
#include <vector>

namespace coronary
{
/// How far the steps were done.
struct ProcedureState
{
  std::vector<double> reached; ///< s, of the steps that are done
};

/// Of one moment, for the goals.
struct ProcedureMoment
{
  const TickReport& report;
  const SessionMetrics& metrics;
  const CArmPose& pose;
  bool cine = false;                              ///< radiating
  std::int64_t run = 0;                           ///< cine runs that were begun
  double injected = 0.0;                          ///< mL
  std::size_t wire = 0;                           ///< number of the wire in use, as WireOf
  std::size_t balloon = 0;                        ///< likewise, as BalloonOf
  const std::vector<VesselTear>* tears = nullptr; ///< of walls; null: none
};

class ProcedureWatch
{
public:
  /// @throws std::invalid_argument  a step needs a lesion, a vessel or a balloon that the session has not
  ProcedureWatch(const std::vector<ProcedureStep>& steps, const WallTopology& topology,
    const std::vector<LesionResult>& lesions, bool hasBalloon,
    const std::vector<MouthResult>& mouths = {});

  /// Whether the next goal needs these, or mouths.
  bool NeedsLesions() const;
  bool Done() const { return this->State_.reached.size() == this->Steps.size(); }

  /// @param said  gets a sentence when a step is done
  void Step(const ProcedureMoment& moment, const std::vector<LesionResult>& lesions,
    const std::vector<StentResult>& stents, std::vector<std::string>& said,
    const std::vector<MouthResult>& mouths = {});

  const ProcedureState& State() const { return this->State_; }

private:
  bool Reached(const ProcedureMoment& moment, const std::vector<LesionResult>& lesions,
    const std::vector<StentResult>& stents, const std::vector<MouthResult>& mouths);
  bool IsIn(int branch, const std::string& vessel) const;
  bool SeesView(const ProcedureMoment& moment, double views);
  bool IsBehind(int branch, int ancestor) const;

  std::vector<ProcedureStep> Steps;
  std::vector<std::size_t> LesionOf; ///< of each step
  std::vector<int> Parent;           ///< of branches
  std::vector<std::string> Names;    ///< of branches
  ProcedureState State_;
  std::vector<Vector3> Views; ///< directions of the beam
  std::int64_t Run = 0;       ///< that is looked at
  double RunInjected = 0.0;   ///< mL, at its beginning
  bool RunCounts = false;
};

struct ScoreItem
{
  std::string name;
  double amount = 0.0;
  std::string unit;
  double weight = 0.0; ///< points lost for each
  double most = 0.0;   ///< points lost at most
  double Lost() const;
};

struct ProcedureScore
{
  double points = 100.0;             ///< 0 to 100: 100 less what the items lose
  bool passed = false;               ///< nothing failed
  std::vector<std::string> failures; ///< a sentence each
  std::vector<ScoreItem> items;
};

ProcedureScore ScoreOf(const std::vector<ProcedureStep>& steps, const ProcedureState& state,
  const SessionMetrics& metrics, const std::vector<StentResult>& stents, const TickReport& last,
  const std::vector<MouthResult>& mouths = {});

/// For people: the result, then what failed, then each item that lost something, with its part of the formula.
std::vector<std::string> LinesOf(const ProcedureScore& score);

/// What is to be done now; empty: nothing is asked for.
std::string NextOf(const std::vector<ProcedureStep>& steps, const ProcedureState& state);
}

#endif
