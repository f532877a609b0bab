// Steps of a procedure, moment by moment, and the score.
#include "Numbers.h"
#include "Procedure.h"
#include "Refusals.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace UnitTestProcedure
{
using namespace coronary;
using Goal = ProcedureStep::Goal;

namespace
{
/// LM, which becomes mLAD, which becomes dLAD; dLCx leaves the LM.
WallTopology Tree()
{
  WallTopology topology;
  topology.groupName = { "LM", "mLAD", "dLAD", "dLCx" };
  topology.parent = { -1, 0, 1, 0 };
  return topology;
}

LesionResult Narrowing()
{
  LesionResult lesion;
  lesion.vessel = "mLAD";
  lesion.branch = 1;
  lesion.degree = lesion.degreeBefore = 0.7;
  lesion.reserve = lesion.reserveBefore = 0.5;
  lesion.from = 20.0;
  lesion.to = 34.0;
  return lesion;
}

ProcedureStep Step(Goal goal, double value = 0.0, const std::string& vessel = "")
{
  return { goal, "do it", vessel, value };
}

/// A session whose moments are set by hand.
struct Played
{
  explicit Played(const std::vector<ProcedureStep>& steps)
    : Watch(steps, Tree(), this->Lesions, true)
  {
  }

  std::size_t Go()
  {
    this->Metrics.procedureSeconds += 1.0;
    this->Watch.Step({ this->Report, this->Metrics, this->Pose, this->Cine, this->Run,
                       this->Injected, this->Wire, this->Balloon },
      this->Lesions, this->Stents, this->Said);
    return this->Watch.State().reached.size();
  }

  std::vector<LesionResult> Lesions{ Narrowing() };
  std::vector<StentResult> Stents;
  TickReport Report;
  SessionMetrics Metrics;
  CArmPose Pose;
  bool Cine = false;
  std::int64_t Run = 0;
  double Injected = 0.0;
  std::size_t Wire = 0;
  std::size_t Balloon = 0;
  std::vector<std::string> Said;
  ProcedureWatch Watch;
};
}

TEST(Procedure, AnglesCountWhenVesselsAreSeenFromAnotherSide)
{
  Played played({ Step(Goal::Angiogram, 3) });
  const auto run = [&](double degrees, double injected)
  {
    played.Pose.primary = degrees * Degree;
    ++played.Run;
    played.Cine = true;
    played.Go();
    played.Injected += injected;
    const std::size_t reached = played.Go();
    played.Cine = false;
    played.Go();
    return reached;
  };
  played.Injected = 9.0; // given before, and not seen
  EXPECT_EQ(run(-30.0, 3.0), 0U);
  EXPECT_EQ(run(-30.0, 3.0), 0U) << "the same side";
  EXPECT_EQ(run(-10.0, 3.0), 0U) << "nearly";
  EXPECT_EQ(run(30.0, 1.5), 0U) << "little to be seen";
  EXPECT_EQ(run(30.0, 2.0), 0U);
  EXPECT_EQ(run(60.0, 2.0), 1U);
  ASSERT_EQ(played.Said.size(), 1U);
  EXPECT_EQ(played.Said[0], "Step 1 of 1 is done: do it.");
  EXPECT_TRUE(played.Watch.Done());
}

TEST(Procedure, StepsAreDoneInTheirOrder)
{
  Played played({ Step(Goal::WireBeyondLesion, 20.0), Step(Goal::BalloonInLesion, 6.0),
    Step(Goal::StenosisBelow, 30.0), Step(Goal::ReserveAbove, 0.8), Step(Goal::WireBack) });
  TickReport& report = played.Report;
  LesionResult& lesion = played.Lesions[0];
  // Far enough, but in another vessel; then not far enough.
  report.catheterTip = 2.0;
  report.inserted = 60.0;
  report.branch = 3;
  EXPECT_EQ(played.Go(), 0U);
  report.branch = 2;
  report.inserted = 51.9;
  EXPECT_EQ(played.Go(), 0U);
  report.inserted = 52.0;
  EXPECT_EQ(played.Go(), 1U);
  EXPECT_EQ(played.Watch.State().reached[0], 3.0);

  // The narrowing is open already: it counts when it is asked for.
  report.balloon.pressure = 8.0;
  report.balloon.place = 7;
  report.balloon.middle = 12.0;
  lesion.degree = 0.1;
  lesion.reserve = 0.95;
  EXPECT_EQ(played.Go(), 1U) << "before the narrowing";
  report.balloon.middle = 25.0;
  EXPECT_EQ(played.Go(), 1U) << "as far from the ostium, in another branch";
  lesion.holdsBalloon = true;
  EXPECT_EQ(played.Go(), 2U) << "a balloon holds it open";
  report.balloon.pressure = -0.9;
  EXPECT_EQ(played.Go(), 4U);
  report.inserted = 0.0;
  EXPECT_EQ(played.Go(), 4U) << "the balloon is in the vessel";
  report.balloon.place = -1;
  EXPECT_EQ(played.Go(), 5U);
}

TEST(Procedure, WiresAtALesion)
{
  Played played({ Step(Goal::WireAtLesion, 3.0), Step(Goal::WireTaken, 1.0) });
  TickReport& report = played.Report;
  report.catheterTip = 2.0;
  report.inserted = 15.5;
  report.branch = 3;
  EXPECT_EQ(played.Go(), 0U) << "in another branch";
  report.branch = -1;
  EXPECT_EQ(played.Go(), 0U) << "not known yet";
  report.branch = 0; // before it
  report.inserted = 14.9;
  EXPECT_EQ(played.Go(), 0U);
  report.inserted = 15.0;
  EXPECT_EQ(played.Go(), 1U);
  EXPECT_EQ(played.Go(), 1U);
  played.Wire = 1;
  EXPECT_EQ(played.Go(), 2U);
}

TEST(Procedure, AMicrocatheterAtALesion)
{
  Played played({ Step(Goal::MicrocatheterAtLesion, 3.0), Step(Goal::BalloonTaken, 1.0) });
  TickReport& report = played.Report;
  report.branch = 0;
  report.balloon.place = 7;
  report.balloon.middle = 17.5;
  EXPECT_EQ(played.Go(), 0U) << "it is a balloon";
  report.balloon.microcatheter = true;
  report.branch = 3;
  EXPECT_EQ(played.Go(), 0U) << "on a wire in another branch";
  report.branch = 2; // the wire is beyond
  report.balloon.middle = 16.5;
  EXPECT_EQ(played.Go(), 0U);
  report.balloon.middle = 17.5;
  EXPECT_EQ(played.Go(), 1U);
  played.Wire = 1;
  EXPECT_EQ(played.Go(), 1U);
  played.Balloon = 1;
  EXPECT_EQ(played.Go(), 2U);
  ExpectRefusal([&]
    { ProcedureWatch({ Step(Goal::MicrocatheterAtLesion, 3.0) }, Tree(), played.Lesions, false); },
    "needs a balloon");
}

TEST(Procedure, VesselsAndStents)
{
  Played played({ Step(Goal::WireIn, 0.0, "mLAD"), Step(Goal::StentInLesion) });
  played.Report.branch = 3;
  EXPECT_EQ(played.Go(), 0U);
  played.Report.branch = 2; // behind it
  EXPECT_EQ(played.Go(), 1U);
  StentResult stent;
  stent.from = 40.0;
  stent.to = 52.0;
  stent.missedAll = true;
  played.Stents = { stent };
  EXPECT_EQ(played.Go(), 1U);
  stent.missedAll = false;
  stent.from = 30.0;
  played.Stents = { stent };
  EXPECT_EQ(played.Go(), 2U);
}

TEST(Procedure, TheWorstLesionIsMeantUnlessOneIsNamed)
{
  LesionResult other = Narrowing();
  other.vessel = "dLCx";
  other.degreeBefore = 0.8;
  other.degree = 0.2;
  for (const char* vessel : { "", "mLAD" })
  {
    Played played({});
    played.Lesions = { Narrowing(), other };
    played.Watch =
      ProcedureWatch({ Step(Goal::StenosisBelow, 30.0, vessel) }, Tree(), played.Lesions, true);
    EXPECT_EQ(played.Go(), vessel[0] == '\0' ? 1U : 0U);
  }
}

TEST(Procedure, RefusesWhatCanNotBeDone)
{
  const std::vector<LesionResult> none;
  const std::vector<LesionResult> one{ Narrowing() };
  ExpectRefusal([&] { ProcedureWatch({ Step(Goal::ReserveAbove, 0.8) }, Tree(), none, true); },
    "'do it' needs a lesion");
  ExpectRefusal([&]
    { ProcedureWatch({ Step(Goal::StenosisBelow, 20.0, "dLCx") }, Tree(), one, true); },
    "lesion in 'dLCx'");
  ExpectRefusal(
    [&] { ProcedureWatch({ Step(Goal::StentInLesion) }, Tree(), one, false); }, "needs a balloon");
  ExpectRefusal(
    [&] { ProcedureWatch({ Step(Goal::WireIn, 0.0, "OM1") }, Tree(), one, true); }, "'OM1'");
}

TEST(Procedure, TheScoreIsItsFormula)
{
  const std::vector<ProcedureStep> steps{ Step(Goal::WireBack), Step(Goal::StentInLesion) };
  SessionMetrics metrics;
  TickReport last;
  ProcedureScore score = ScoreOf(steps, { { 1.0, 2.0 } }, metrics, {}, last);
  EXPECT_TRUE(score.passed);
  EXPECT_EQ(score.points, 100.0);
  EXPECT_EQ(LinesOf(score), std::vector<std::string>{ "Procedure done: 100 of 100 points." });

  metrics.forcefulSeconds = 3.0;  // 2 a second
  metrics.blindTravel = 1000.0;   // at most 20
  metrics.occludedSeconds = 70.0; // 0.5 for each second beyond 60
  metrics.events = { { ProcedureEvent::Kind::OverPressure, 1.0, 0, 20.0, 3.0 } };
  StentResult stent;
  stent.missedBehind = 3.0;
  stent.rings = { { 0, 0, 10.0, 2.5, 2.9, 3.0, 0.4 } };
  score = ScoreOf(steps, { { 1.0, 2.0 } }, metrics, { stent }, last);
  EXPECT_TRUE(score.passed);
  EXPECT_NEAR(score.points, 100.0 - 6.0 - 20.0 - 5.0 - 10.0 - 3 * 10.0, 1e-12);
  EXPECT_EQ(LinesOf(score).size(), 8U);

  last.balloon.wallPressure = 2.0;
  score = ScoreOf(steps, { { 1.0 } }, metrics, { stent }, last);
  EXPECT_FALSE(score.passed);
  ASSERT_EQ(score.failures.size(), 2U);
  EXPECT_EQ(score.failures[0], "not done: do it");
  metrics.forcefulSeconds = metrics.idleBeamSeconds = 1e6;
  metrics.occludedSeconds = 1e6;
  metrics.events.assign(9, { ProcedureEvent::Kind::OverExpansion, 1.0, 0, 1.4, 3.0 });
  EXPECT_EQ(ScoreOf(steps, {}, metrics, { stent }, last).points, 0.0);
}

TEST(Procedure, WhatIsNextIsSaid)
{
  const std::vector<ProcedureStep> steps{ Step(Goal::WireBack), Step(Goal::WireBack) };
  EXPECT_EQ(NextOf({}, {}), "");
  EXPECT_EQ(NextOf(steps, { { 1.0 } }), "Step 2 of 2: do it");
  EXPECT_EQ(NextOf(steps, { { 1.0, 2.0 } }), "All 2 steps are done.");
}
}
