// What a guide catheter shows as pressure: the aortic one, less what the gap between it and the ostium takes.
#include "AortaTestBench.h"
#include "ContrastTestData.h"
#include "CoronaryFlow.h"
#include "Scenario.h"
#include "TrainingSession.h"
#include "WallMotions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <string>
#include <vector>

namespace UnitTestDampedPressure
{
using namespace coronary;

namespace
{
constexpr double Spacing = 0.25; // mm of the axis
constexpr double SixFrench = 1.025;
constexpr double Dt = 0.005;
constexpr int StepsOfBeat = 160; // at 75 a minute

/// An artery of one width, with a guide in its first millimetres.
struct DampedTube
{
  CoronaryFlow flow;
  CatheterTip tip;

  DampedTube(double radius, double depth, const CoronaryFlowSettings& settings = {})
    : flow(Tube(80.0, radius, radius, static_cast<int>(80.0 / Spacing)), settings)
    , tip{ 0, depth }
  {
    const std::size_t points = this->flow.Network().Topology().axisRadius[0].size();
    std::vector<double> guide(points, 0.0);
    for (std::size_t k = 0; k < points && Spacing * static_cast<double>(k) <= depth; ++k)
    {
      guide[k] = SixFrench;
    }
    this->flow.SetLumen(std::vector<double>(points, radius), guide);
  }
};
}

TEST(DampedPressure, TheGapTakesResistanceTimesFlow)
{
  for (const double diameter : { 2.2, 2.5, 3.0, 4.5 })
  {
    for (const double depth : { 3.0, 5.0, 8.0 })
    {
      DampedTube tube(0.5 * diameter, depth);
      for (int k = 0; k < 4000; ++k)
      {
        tube.flow.Step(Dt, 0.6, 0.0);
      }
      const double exact =
        AnnularResistance(SixFrench, 0.5 * diameter, depth) * tube.flow.TreeFlow(0);
      const double lost = tube.flow.AorticPressureNow() - tube.flow.PressureAt(tube.tip);
      EXPECT_GT(lost, 0.0);
      EXPECT_NEAR(lost / exact, 1.0, 1e-9) << diameter << ", " << depth;
      if (depth == 5.0)
      {
        Row("6F guide 5 mm deep in " + std::to_string(diameter).substr(0, 3) +
            " mm: pressure lost, mmHg",
          exact, lost, "1e-9");
      }
    }
  }
}

// Harmonic by harmonic the tip has Z / (R + Z) of the aortic pressure, Z what is beyond it; of time steps h,
// d/dt is (1 - exp(-i w h)) / h.
TEST(DampedPressure, ThePulseIsThatOfTheVoltageDivider)
{
  CoronaryFlowSettings settings;
  settings.leftDiastolicRatio = settings.rightDiastolicRatio = 0.3; // nothing squeezes the outlets
  const double depth = 5.0;
  const double radius = 1.2;
  DampedTube tube(radius, depth, settings);
  const std::complex<double> i(0.0, 1.0);
  std::vector<double> aortic;
  std::vector<double> tip;
  constexpr int Beats = 12;
  for (int k = 1; k <= Beats * StepsOfBeat; ++k)
  {
    tube.flow.Step(Dt, static_cast<double>(k) / StepsOfBeat, 75.0);
    if (k > (Beats - 1) * StepsOfBeat)
    {
      aortic.push_back(tube.flow.AorticPressureNow());
      tip.push_back(tube.flow.PressureAt(tube.tip));
    }
  }
  const double gap = AnnularResistance(SixFrench, radius, depth);
  const double beyond = tube.flow.SegmentResistance(0) - gap;
  const double outlet = tube.flow.OutletResistance(1);
  const double before = settings.arterialShare * outlet;
  const double behind = outlet - before;
  const double time = settings.outletTime / settings.arterialShare; // of R2 C
  for (const int n : { 1, 2, 3 })
  {
    std::complex<double> a;
    std::complex<double> t;
    const double turn = 2.0 * M_PI * n / StepsOfBeat;
    for (int k = 0; k < StepsOfBeat; ++k)
    {
      a += aortic[static_cast<std::size_t>(k)] * std::exp(-i * (turn * k));
      t += tip[static_cast<std::size_t>(k)] * std::exp(-i * (turn * k));
    }
    const std::complex<double> rate = (1.0 - std::exp(-i * turn)) / Dt;
    const std::complex<double> z = beyond + before + behind / (1.0 + rate * time);
    const std::complex<double> exact = z / (gap + z);
    EXPECT_LT(std::abs(exact), 0.97);
    EXPECT_LT(std::abs(t / a - exact), 1e-9) << n;
    Row("the same in 2.4 mm: harmonic " + std::to_string(n) + " of the aortic one", std::abs(exact),
      std::abs(t / a), "1e-9");
  }
}

TEST(DampedPressure, AGuideThatFillsTheOstiumShowsWhatIsBehindIt)
{
  DampedTube tube(SixFrench, 5.0);
  double low = 1e9;
  double high = 0.0;
  for (int k = 1; k <= 20 * StepsOfBeat; ++k)
  {
    tube.flow.Step(Dt, static_cast<double>(k) / StepsOfBeat, 75.0);
    EXPECT_LT(tube.flow.TreeFlow(0), k > StepsOfBeat ? 0.02 : 10.0);
    if (k > 19 * StepsOfBeat)
    {
      low = std::min(low, tube.flow.PressureAt(tube.tip));
      high = std::max(high, tube.flow.PressureAt(tube.tip));
    }
  }
  // That of the squeezed myocardium, not the aorta's 80 to 120 mmHg.
  EXPECT_LT(high, 60.0);
  std::printf("a guide that fills the ostium: %.1f to %.1f mmHg\n", low, high);
}

namespace
{
/// A session whose guide comes through the bench's aorta; the heart stands still.
struct GuideSession
{
  TrainingSession session;
  SessionInput input;

  static Scenario Setting()
  {
    Scenario scenario = LoadScenario("engage-lca");
    scenario.artery = "any";
    scenario.catheter = BuiltInCatalogue().Catheter("JL4-6F").catheter;
    scenario.procedure.clear();
    scenario.settings.heartRate = 0.0;
    scenario.settings.startPhase = 0.6;
    return scenario;
  }
  /// @param radius  mm, of the artery that blood finds; the wall that the guide touches is wider
  GuideSession(double begins, double radius)
    : session(Wall(begins, radius), Setting())
    , input(this->session.StartInput())
  {
  }
  static std::shared_ptr<WallMotion> Wall(double begins, double radius)
  {
    TriangleBench bench(begins, 60.0, Spacing);
    // A mouth of the wall's width, which says whether the guide is in it.
    std::vector<double>& radii = bench.vessels.axisRadius[0];
    std::fill(radii.begin() + 1, radii.end(), radius);
    return std::make_shared<StillWallMotion>(bench.vessels, bench.points);
  }
  void Move(double seconds, double guide)
  {
    const int ticks = static_cast<int>(std::lround(2000.0 * seconds));
    for (int k = 0; k < ticks; ++k)
    {
      this->input.drive.catheterPosition += guide / ticks;
      this->session.Step(this->input);
    }
  }
  /// Pushed until it falls in.
  void Engage()
  {
    for (double pushed = 0.0; pushed < 130.0 && !this->Seat().engaged; pushed += 1.0)
    {
      this->Move(0.08, 1.0);
    }
    this->Move(2.0, 0.0);
  }
  const GuideSeat& Seat() const { return this->session.Report().tick.seat; }
  SessionSnapshot Now() const
  {
    SessionSnapshot now;
    this->session.SnapshotOfImage(now);
    return now;
  }
};
}

TEST(DampedPressure, ASessionShowsTheAorticOneUntilTheGuideIsTight)
{
  GuideSession wide(0.0, AortaBench::Coronary);
  wide.Move(0.5, 0.0);
  const double aortic = wide.session.Contrast().AorticPressure();
  EXPECT_EQ(wide.Now().tipPressure, aortic) << "in the aorta";
  wide.Engage();
  ASSERT_TRUE(wide.Seat().engaged);
  EXPECT_NEAR(wide.Now().tipPressure / aortic, 1.0, 0.01);
  EXPECT_LT(wide.Now().tipPressure, aortic);
  Row("JL4 6F in an ostium of 4.5 mm, " + std::to_string(wide.Seat().depth).substr(0, 3) +
      " mm deep: its pressure over the aortic one",
    1.0, wide.Now().tipPressure / aortic, "1 %");

  GuideSession tight(0.0, 1.25);
  tight.Move(0.5, 0.0); // as the other one
  tight.Engage();
  ASSERT_TRUE(tight.Seat().engaged) << tight.Seat().depth << ", " << tight.Seat().offset << ", "
                                    << tight.input.drive.catheterPosition;
  // The first interval of the axis is the wide mouth.
  const double exact = AnnularResistance(tight.session.Instruments().Catheter().outerRadius, 1.25,
                         tight.Seat().depth - Spacing) *
    tight.session.Contrast().TreeFlow(0);
  const double lost = aortic - tight.Now().tipPressure;
  EXPECT_GT(exact, 5.0);
  // The gap ends between two points of the axis.
  EXPECT_NEAR(lost / exact, 1.0, Spacing / tight.Seat().depth);
  Row("the same in 2.5 mm, " + std::to_string(tight.Seat().depth).substr(0, 3) +
      " mm deep: pressure lost, mmHg",
    exact, lost, "an interval of the axis");
}
}
