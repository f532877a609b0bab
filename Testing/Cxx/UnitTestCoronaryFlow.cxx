// Flow in the coronary arteries against closed forms, and against what was measured in patients.
#include "ContrastTestData.h"
#include "CoronaryFlow.h"
#include "Refusals.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace UnitTestCoronaryFlow
{
using namespace coronary;

namespace
{
constexpr double Pi = 3.14159265358979323846;
constexpr double Dt = 0.005;

// mmHg s/mL of a cone of `length` mm, at 3.5 mPa s.
double ConeResistance(double length, double a, double b)
{
  const double integral = length * (a * a + a * b + b * b) / (3.0 * std::pow(a * b, 3.0)) * 1e9;
  return 8.0 * 3.5e-3 / Pi * integral * 1e-6 / 133.322387415;
}

void StandStill(CoronaryFlow& flow, double phase, double injection = 0.0, CatheterTip tip = {})
{
  for (int k = 0; k < 4000; ++k)
  {
    flow.Step(Dt, phase, 0.0, injection, tip);
  }
}

double MaximumImbalance(const CoronaryFlow& flow)
{
  double maximum = 0.0;
  for (const FlowNode& node : flow.Network().Nodes())
  {
    if (node.above >= 0 && !node.below.empty())
    {
      double sum = flow.Flow()[node.above];
      for (const int s : node.below)
      {
        sum -= flow.FlowAtBeginning(s);
      }
      maximum = std::max(maximum, std::abs(sum));
    }
  }
  return maximum;
}

struct Cycle
{
  std::vector<double> mean;  // per segment, mL/s
  std::vector<double> ratio; // per tree
};

Cycle OneCycle(CoronaryFlow& flow, double heartRate = 75.0)
{
  const std::size_t trees = flow.Network().Roots().size();
  const int steps = static_cast<int>(std::lround(60.0 / heartRate / Dt));
  Cycle cycle;
  cycle.mean.assign(flow.Flow().size(), 0.0);
  std::vector<double> early(trees, 0.0);
  std::vector<double> late(trees, 0.0);
  int inSystole = 0;
  for (int k = 1; k <= 3 * steps; ++k)
  {
    const double phase = static_cast<double>(k % steps) / steps;
    flow.Step(Dt, phase, heartRate);
    if (k <= 2 * steps)
    {
      continue;
    }
    const bool systole = phase < flow.Settings().systoleEnd;
    inSystole += systole ? 1 : 0;
    for (std::size_t s = 0; s < cycle.mean.size(); ++s)
    {
      cycle.mean[s] += flow.Flow()[s] / steps;
    }
    for (std::size_t t = 0; t < trees; ++t)
    {
      (systole ? early : late)[t] += flow.Flow()[flow.ReferencePath(static_cast<int>(t)).front()];
    }
  }
  for (std::size_t t = 0; t < trees; ++t)
  {
    cycle.ratio.push_back(late[t] / (steps - inSystole) / (early[t] / inSystole));
  }
  return cycle;
}

TEST(CoronaryFlow, PoiseuilleLosesPressureExactly)
{
  for (const int intervals : { 1, 7, 1000 })
  {
    CoronaryFlow flow(Tube(80.0, 1.9, 0.7, intervals), {});
    StandStill(flow, 0.6);
    const double exact = ConeResistance(80.0, 1.9, 0.7) * flow.Flow()[0];
    const double measured = flow.Pressure()[0] - flow.Pressure()[1];
    EXPECT_GT(measured, 0.5);
    EXPECT_NEAR(measured / exact, 1.0, 1e-10);
    if (intervals == 7)
    {
      Row("Poiseuille, cone of 80 mm: loss of pressure, mmHg", exact, measured, "1e-10");
    }
  }
}

TEST(CoronaryFlow, NodesBalanceAndSegmentsObeyTheirLaw)
{
  PhantomSettings settings;
  settings.stenoses = 6;
  settings.stenosisDegree = 0.6;
  CoronaryFlow flow(PhantomVessels(settings), {});
  EXPECT_GE(flow.NumberOfStenoses(), 4U);
  double imbalance = 0.0;
  for (int k = 0; k < 640; ++k)
  {
    const double injection = k % 200 < 100 ? 0.02 * (k % 100) : 0.0;
    flow.Step(Dt, 0.00625 * k, 75.0, injection, { (7 * k) % 30, 0.37 * (k % 90) });
    imbalance = std::max(imbalance, MaximumImbalance(flow));
  }
  Row("node balance in a phantom, injecting: mL/s", 0.0, imbalance, "1e-12");
  EXPECT_LT(imbalance, 1e-12);
}

// The elimination against a dense solution of all pressures.
TEST(CoronaryFlow, EqualsDenseSolution)
{
  CoronaryFlow flow(PhantomVessels({}), {});
  StandStill(flow, 0.7, 0.8, { 3, 4.0 });
  const FlowNetwork& network = flow.Network();
  const auto nodes = static_cast<Eigen::Index>(network.Nodes().size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(nodes + 1, nodes + 1);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(nodes + 1);
  const auto connect = [&](Eigen::Index a, Eigen::Index b, double resistance)
  {
    matrix(a, a) += 1.0 / resistance;
    matrix(a, b) -= 1.0 / resistance;
    matrix(b, b) += 1.0 / resistance;
    matrix(b, a) -= 1.0 / resistance;
  };
  for (std::size_t s = 0; s < network.Segments().size(); ++s)
  {
    const FlowSegment& segment = network.Segments()[s];
    const double whole = flow.SegmentResistance(static_cast<int>(s));
    if (static_cast<int>(s) != flow.Injector().segment)
    {
      connect(segment.above, segment.below, whole);
      continue;
    }
    // The axis has a point every half millimetre.
    double before = 0.0;
    const std::vector<double>& radius = network.Topology().axisRadius[3];
    const std::vector<double>& abscissa = network.Branches()[3].abscissa;
    for (std::size_t k = 0; abscissa[k] < 4.0; ++k)
    {
      const double end = std::min(4.0, abscissa[k + 1]);
      before += ConeResistance(end - abscissa[k], radius[k], network.RadiusAt(3, end));
    }
    connect(segment.above, nodes, before);
    connect(nodes, segment.below, whole - before);
    right[nodes] = 0.8;
  }
  for (Eigen::Index n = 0; n < nodes; ++n)
  {
    if (network.IsTip(static_cast<int>(n)))
    {
      matrix(n, n) += 1.0 / flow.OutletResistance(static_cast<int>(n));
      right[n] += flow.Settings().venousPressure / flow.OutletResistance(static_cast<int>(n));
    }
  }
  for (const int root : network.Roots())
  {
    matrix.row(root).setZero();
    matrix(root, root) = 1.0;
    right[root] = AorticPressure(flow.Settings(), 0.7);
  }
  const Eigen::VectorXd pressure = matrix.partialPivLu().solve(right);
  double worst = 0.0;
  for (Eigen::Index n = 0; n < nodes; ++n)
  {
    worst = std::max(worst, std::abs(pressure[n] - flow.Pressure()[n]));
  }
  Row("all pressures of a phantom, against a dense solution: mmHg", 0.0, worst, "1e-9");
  EXPECT_LT(worst, 1e-9);
}

TEST(CoronaryFlow, DiastolicRatioAndSpeedInPhantoms)
{
  const char* names[] = { "right", "left", "balanced" };
  for (int dominance = 0; dominance < 3; ++dominance)
  {
    for (const std::uint64_t seed : { 0U, 1U, 5U, 11U })
    {
      PhantomSettings settings;
      settings.seed = seed;
      settings.dominance = static_cast<Dominance>(dominance);
      CoronaryFlow flow(PhantomVessels(settings), {});
      const Cycle cycle = OneCycle(flow);
      ASSERT_EQ(cycle.ratio.size(), 2U);
      const std::string who =
        std::string(names[dominance]) + " dominant phantom " + std::to_string(seed);
      double total = 0.0;
      for (int t = 0; t < 2; ++t)
      {
        const bool right = flow.Network().RightSide()[t];
        const double low = right ? 0.9 : 1.8;
        const double high = right ? 1.1 : 2.1;
        EXPECT_GT(cycle.ratio[t], low) << who;
        EXPECT_LT(cycle.ratio[t], high) << who;
        if (seed < 2)
        {
          Row("diastolic / systolic flow, " + who + (right ? ", RCA" : ", LAD"), right ? 1.0 : 1.95,
            cycle.ratio[t], right ? "0.9 to 1.1" : "1.8 to 2.1");
        }
        double length = 0.0;
        double time = 0.0;
        for (const int s : flow.ReferencePath(t))
        {
          const FlowSegment& segment = flow.Network().Segments()[s];
          const double part = std::min(segment.to - segment.from, 100.0 - length);
          length += part;
          time +=
            (flow.Network().VolumeAt(segment.branch, segment.from + part) - segment.volumeFrom) /
            (2.0 * cycle.mean[s]);
        }
        EXPECT_NEAR(0.1 * length / time, 25.0, 0.25) << who;
        if (seed == 1 && dominance == 0)
        {
          Row(std::string("mean axial speed of the ") + (right ? "RCA" : "LAD") + ", cm/s", 25.0,
            0.1 * length / time, "1 %");
        }
        for (const int s : flow.Network().Nodes()[flow.Network().Roots()[t]].below)
        {
          total += cycle.mean[s];
        }
      }
      // About a twentieth of the heart's output of 5 L/min.
      EXPECT_GT(60.0 * total, 150.0) << who;
      EXPECT_LT(60.0 * total, 350.0) << who;
      if (seed < 2)
      {
        Row("flow of both arteries, mL/min, " + who, 250.0, 60.0 * total, "150 to 350");
      }
    }
  }
}

TEST(CoronaryFlow, JetBehindAStenosisLosesItsEnergy)
{
  WallTopology tube = Tube(60.0, 1.5, 1.5, 120);
  std::vector<double>& radius = tube.axisRadius[0];
  for (int k = 50; k <= 70; ++k)
  {
    radius[k] = 1.5 - 0.9 * 0.5 * (1.0 + std::cos(Pi * (k - 60) / 10.0));
  }
  CoronaryFlow flow(tube, {});
  ASSERT_EQ(flow.NumberOfStenoses(), 1U);
  StandStill(flow, 0.2);
  double laminar = 0.0;
  for (std::size_t k = 1; k < radius.size(); ++k)
  {
    laminar += ConeResistance(0.5, radius[k - 1], radius[k]);
  }
  const double q = flow.Flow()[0];
  const double area = Pi * 1.5 * 1.5;
  const double widening = 1.5 * 1.5 / (0.6 * 0.6) - 1.0;
  const double speed = q / area; // m/s
  const double jet = 1.52 * 0.5 * 1060.0 * widening * widening * speed * speed / 133.322387415;
  const double measured = flow.Pressure()[0] - flow.Pressure()[1];
  Row("stenosis of 60 % of the diameter: loss of pressure, mmHg", laminar * q + jet, measured,
    "1e-9");
  EXPECT_GT(jet, 1.0);
  EXPECT_NEAR(measured / (laminar * q + jet), 1.0, 1e-9);
}

TEST(CoronaryFlow, TaperIsNoStenosisAndAStatedOneIs)
{
  EXPECT_EQ(CoronaryFlow(Tube(100.0, 2.0, 0.5, 200), {}).NumberOfStenoses(), 0U);
  CoronaryFlowSettings settings;
  double before = std::numeric_limits<double>::infinity();
  for (const double reduction : { 0.0, 0.5, 0.7, 0.8, 0.9 })
  {
    settings.stenoses = { { { 0, 50.0 }, reduction, 10.0 } };
    CoronaryFlow flow(Tube(100.0, 1.5, 1.5, 200), settings);
    StandStill(flow, 0.5);
    EXPECT_LT(flow.Flow()[0], before);
    before = flow.Flow()[0];
  }
  settings.stenoses = { { { 3, 50.0 }, 0.5, 10.0 } };
  EXPECT_THROW(CoronaryFlow(Tube(100.0, 1.5, 1.5, 200), settings), std::invalid_argument);
}

TEST(CoronaryFlow, InjectionDisplacesBlood)
{
  CoronaryFlow flow(Fork(1.6, 1.2), {});
  StandStill(flow, 0.5);
  const double free = flow.Flow()[1];
  const double tip = flow.Pressure()[1];
  StandStill(flow, 0.5, 0.5 * free, { 1, 20.0 });
  EXPECT_NEAR(flow.FlowAtBeginning(1), flow.Flow()[1] - 0.5 * free, 1e-12);
  EXPECT_GT(flow.Flow()[1], free); // pressure rose
  EXPECT_LT(flow.Flow()[1], 1.02 * free);
  EXPECT_GT(flow.Pressure()[1], tip);
  StandStill(flow, 0.5, 3.0 * free, { 1, 20.0 });
  EXPECT_LT(flow.FlowAtBeginning(1), -1.8 * free);
  EXPECT_LT(MaximumImbalance(flow), 1e-12);
  // In the aorta it changes nothing.
  StandStill(flow, 0.5, 5.0, { -1, 0.0 });
  EXPECT_NEAR(flow.Flow()[1], free, 1e-9);
}

TEST(CoronaryFlow, HeartStandsStill)
{
  CoronaryFlow flow(PhantomVessels({}), {});
  for (int k = 0; k < 100; ++k)
  {
    flow.Step(Dt, 0.01 * k, 75.0);
  }
  StandStill(flow, 0.1);
  const std::vector<double> steady = flow.Flow();
  // Without a beat, changing the phase moves the aortic pressure, and squeezes nothing.
  StandStill(flow, 0.35);
  StandStill(flow, 0.1);
  for (std::size_t s = 0; s < steady.size(); ++s)
  {
    ASSERT_TRUE(std::isfinite(steady[s]));
    EXPECT_NEAR(flow.Flow()[s], steady[s], 1e-9);
    const int node = flow.Network().Segments()[s].below;
    if (flow.Network().IsTip(node))
    {
      EXPECT_NEAR((flow.Pressure()[node] - 5.0) / flow.OutletResistance(node), steady[s], 1e-9);
    }
  }
}

TEST(CoronaryFlow, IsOfFirstOrderInTime)
{
  double at[3];
  for (int level = 0; level < 3; ++level)
  {
    CoronaryFlow flow(Fork(1.6, 1.2), {});
    const int steps = 400 << level;
    flow.Step(1e-9, 0.0, 75.0);
    for (int k = 1; k <= steps; ++k)
    {
      flow.Step(0.8 / steps, 0.6 * k / steps, 45.0);
    }
    at[level] = flow.Flow()[0];
  }
  const double order = std::log2((at[0] - at[1]) / (at[1] - at[2]));
  Row("order of convergence in time, flow", 1.0, order, "0.9 to 1.1");
  EXPECT_NEAR(order, 1.0, 0.1);
}

TEST(CoronaryFlow, CalibratesOtherTrees)
{
  // One thin vessel; a vessel of one interval; a bush that leaves its parent in the middle of it.
  WallTopology bush = Tube(90.0, 2.0, 1.0, 90);
  for (int k = 0; k < 8; ++k)
  {
    AddBranch(bush, 0, Vector3(0.3, 0.0, 10.0 + 10.0 * k), Vector3(1.0, 0.1 * k, 0.5), 30.0, 0.8,
      0.4, 3 + 40 * k);
  }
  for (const WallTopology& topology :
    { Tube(120.0, 0.3, 0.15, 11), Tube(2.0, 1.5, 1.5, 1), bush, Fork(1.0, 1.9) })
  {
    CoronaryFlow flow(topology, {});
    const Cycle cycle = OneCycle(flow);
    EXPECT_GT(cycle.ratio[0], 1.8);
    EXPECT_LT(cycle.ratio[0], 2.1);
    EXPECT_GT(cycle.mean[0], 0.0);
    EXPECT_LT(MaximumImbalance(flow), 1e-12);
  }
  const CoronaryFlow flow(bush, {});
  EXPECT_EQ(flow.Network().Branches()[0].segments.size(), 9U);
  EXPECT_EQ(flow.Network().Segments().size(), 17U);
  EXPECT_NEAR(flow.Network().Segments()[3].to, 40.0, 1e-9);
}

TEST(CoronaryFlow, KnowsItsSides)
{
  WallTopology two = Tube(50.0, 2.0, 1.0, 50);
  AddBranch(two, -1, Vector3(-30.0, 0.0, 0.0), Vector3::UnitZ(), 50.0, 2.0, 1.0, 50);
  EXPECT_EQ(FlowNetwork(two).RightSide(), (std::vector<bool>{ false, true }));
  two.groupName = { "pRCA", "LM" };
  EXPECT_EQ(FlowNetwork(two).RightSide(), (std::vector<bool>{ true, false }));
  EXPECT_EQ(
    FlowNetwork(two, { CoronarySide::Left }).RightSide(), (std::vector<bool>{ false, false }));
}

TEST(CoronaryFlow, RefusesBadInput)
{
  const WallTopology good = Fork(1.5, 1.5);
  const auto refused = [](const WallTopology& topology, const CoronaryFlowSettings& settings)
  { EXPECT_THROW(CoronaryFlow(topology, settings), std::invalid_argument); };
  refused({}, {});
  WallTopology bad = good;
  bad.parent = { -1, 2, 1 };
  refused(bad, {});
  bad.parent = { -1, 1, 0 };
  refused(bad, {});
  bad.parent = { -1, 0, 7 };
  refused(bad, {});
  bad = good;
  bad.axisRadius[1][3] = 0.0;
  refused(bad, {});
  bad = good;
  bad.axisRadius[1].pop_back();
  refused(bad, {});
  bad = good;
  bad.axis[2][5].x() = std::numeric_limits<double>::quiet_NaN();
  refused(bad, {});
  bad = good;
  std::fill(bad.axis[2].begin(), bad.axis[2].end(), Vector3::Zero());
  refused(bad, {});
  CoronaryFlowSettings settings;
  settings.viscosity = 0.0;
  refused(good, settings);
  settings = {};
  settings.outletTime = std::numeric_limits<double>::quiet_NaN();
  ExpectRefusal([&] { settings.Validate(); }, "outletTime");
  CoronaryFlow flow(good, {});
  EXPECT_THROW(flow.Step(0.0, 0.0, 75.0), std::invalid_argument);
  EXPECT_THROW(flow.Step(Dt, INFINITY, 75.0), std::invalid_argument);
  EXPECT_THROW(flow.Step(Dt, 0.0, -1.0), std::invalid_argument);
  EXPECT_THROW(flow.Step(Dt, 0.0, 75.0, -1.0), std::invalid_argument);
  EXPECT_THROW(flow.Step(Dt, 0.0, 75.0, 1.0, { 9, 0.0 }), std::invalid_argument);
  EXPECT_THROW(flow.Step(Dt, 0.0, 75.0, 1.0, { 0, NAN }), std::invalid_argument);
}
}
}
