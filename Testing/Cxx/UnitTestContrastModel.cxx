// Contrast medium in whole trees: what is injected, where it goes, how long it takes, and that none is lost.
#include "ContrastModel.h"
#include "ContrastTestData.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

namespace UnitTestContrastModel
{
using namespace coronary;

namespace
{
constexpr double Dt = 0.005;

int BranchNamed(const WallTopology& topology, const std::string& name)
{
  const auto found = std::find(topology.groupName.begin(), topology.groupName.end(), name);
  return static_cast<int>(found - topology.groupName.begin());
}

const WallTopology& Phantom()
{
  static const WallTopology vessels = PhantomVessels({});
  return vessels;
}

/// A heart of 75 beats a minute, or one that stands still in diastole.
struct Patient
{
  explicit Patient(const WallTopology& vessels, const ContrastSettings& settings = {},
    std::uint64_t seed = 1, double start = 0.0)
    : phase(start)
    , model(vessels, settings, seed)
  {
  }
  void Beat(double seconds, double injection = 0.0, const CatheterTip& tip = {})
  {
    for (int k = 0; k < static_cast<int>(std::lround(seconds / Dt)); ++k)
    {
      phase += 0.00625;
      model.Step(Dt, phase, 75.0, injection, tip);
    }
  }
  void Stand(double seconds, double injection = 0.0, const CatheterTip& tip = {})
  {
    for (int k = 0; k < static_cast<int>(std::lround(seconds / Dt)); ++k)
    {
      model.Step(Dt, 0.6, 0.0, injection, tip);
    }
  }
  double phase;
  ContrastModel model;
};

double Off(const ContrastBalance& balance)
{
  return std::abs(balance.inTree + balance.blush + balance.washedOut + balance.spilled -
           balance.injected) /
    std::max(balance.injected, 1e-300);
}

/// mL of contrast medium (by its tracers), and of lumen, in a branch.
std::pair<double, double> Inside(const ContrastModel& model, int branch)
{
  std::pair<double, double> sum(0.0, 0.0);
  const FlowNetwork& network = model.FlowModel().Network();
  for (std::int64_t i = 0; i < model.NumberOfTracers(); ++i)
  {
    const bool here = network.Segments()[model.Tracers().Segment(i)].branch == branch;
    sum.first += here ? model.Tracers().Volume(i) : 0.0;
  }
  sum.second = network.Branches()[branch].volume.back();
  return sum;
}

/// Mean over some time of the fraction in a branch.
double MeanFraction(
  Patient& patient, int branch, int samples, double injection, const CatheterTip& tip)
{
  double mean = 0.0;
  for (int k = 0; k < samples; ++k)
  {
    patient.Stand(0.05, injection, tip);
    const std::pair<double, double> inside = Inside(patient.model, branch);
    mean += inside.first / inside.second / samples;
  }
  return mean;
}

TEST(ContrastModel, SteadyInfusionIsDiluted)
{
  const CatheterTip tip{ BranchNamed(Phantom(), "LM"), 0.0 };
  ContrastSettings settings;
  settings.tracers.capacity = 400000;
  settings.tracers.volume = 2e-5;
  for (const double share : { 0.2, 0.6 })
  {
    Patient patient(Phantom(), settings);
    patient.Stand(12.0);
    const double taken = patient.model.TreeFlow(0);
    const double injection = share * taken;
    patient.Stand(4.0, injection, tip);
    // Blood makes up for the rest of what the tree takes.
    const double blood = patient.model.TreeFlow(0);
    EXPECT_NEAR(blood, taken - injection, 1e-9);
    for (const char* name : { "LM", "pLAD", "pLCx", "dLAD" })
    {
      const double c = MeanFraction(patient, BranchNamed(Phantom(), name), 80, injection, tip);
      const double exact = injection / (injection + blood);
      Row(
        "steady infusion, " + std::to_string(share).substr(0, 3) + " of the flow: c in the " + name,
        exact, c, "1 %");
      EXPECT_NEAR(c / exact, 1.0, 0.01) << name;
    }
    EXPECT_EQ(patient.model.Balance().spilled, 0.0);
  }
}

TEST(ContrastModel, ExcessSpillsIntoTheAorta)
{
  const CatheterTip tip{ BranchNamed(Phantom(), "LM"), 0.0 };
  ContrastSettings settings;
  settings.tracers.capacity = 200000;
  settings.tracers.volume = 5e-5;
  Patient patient(Phantom(), settings);
  patient.Stand(12.0);
  const double injection = patient.model.TreeFlow(0) + 1.5;
  patient.Stand(2.0, injection, tip);
  const ContrastBalance balance = patient.model.Balance();
  Row("reflux of 1.5 mL/s above what the tree takes, in 2 s: mL", 3.0, balance.spilled, "1e-9");
  EXPECT_NEAR(balance.spilled, 3.0, 3e-9);
  EXPECT_LT(Off(balance), 1e-12);
  const double c = MeanFraction(patient, tip.branch, 40, injection, tip);
  Row("the same: c in the LM", 1.0, c, "1 %");
  EXPECT_NEAR(c, 1.0, 0.01);
  const std::vector<double>& fractions = patient.model.Concentration();
  EXPECT_LE(*std::max_element(fractions.begin(), fractions.end()), 1.0);
  // Nothing is in the other artery.
  EXPECT_EQ(Inside(patient.model, BranchNamed(Phantom(), "pRCA")).first, 0.0);
}

// Dodge et al., Cathet Cardiovasc Diagn 1998: what a hand injects.
TEST(ContrastModel, DodgesInjections)
{
  struct Injection
  {
    const char* branch;
    double volume;
    double time;
  };
  for (const Injection& test : { Injection{ "LM", 7.1, 3.6 }, Injection{ "pRCA", 4.8, 3.0 } })
  {
    const CatheterTip tip{ BranchNamed(Phantom(), test.branch), 2.0 };
    Patient patient(Phantom());
    double worst = 0.0;
    double densest = 0.0;
    for (int k = 0; k < static_cast<int>(10.0 * test.time + 0.5); ++k)
    {
      patient.Beat(0.1, test.volume / test.time, tip);
      worst = std::max(worst, Off(patient.model.Balance()));
      const std::pair<double, double> inside = Inside(patient.model, tip.branch);
      densest = std::max(densest, inside.first / inside.second);
    }
    EXPECT_LE(patient.model.NumberOfTracers(), 20000);
    Row(std::string("Dodge's injection, ") + test.branch + ": mL", test.volume,
      patient.model.Balance().injected, "1e-9");
    EXPECT_NEAR(patient.model.Balance().injected, test.volume, 1e-9);
    EXPECT_GT(densest, 0.7);
    double before = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 80; ++k)
    {
      patient.Beat(0.1);
      const ContrastBalance balance = patient.model.Balance();
      worst = std::max(worst, Off(balance));
      EXPECT_LE(balance.inTree, before); // wash-out is monotone
      before = balance.inTree;
    }
    Row(std::string("the same, ") + test.branch + ": greatest relative error of the balance", 0.0,
      worst, "1e-12");
    EXPECT_LT(worst, 1e-12);
    EXPECT_LT(before, 0.01 * test.volume);
  }
}

TEST(ContrastModel, WashOutIsMonotone)
{
  const CatheterTip tip{ BranchNamed(Phantom(), "LM"), 0.0 };
  ContrastSettings settings;
  settings.tracers.capacity = 400000;
  settings.tracers.volume = 2e-5;
  Patient patient(Phantom(), settings);
  patient.Stand(4.0, 2.0, tip);
  double before = 0.0;
  double rise = 0.0;
  double first = 0.0;
  for (int k = 0; k < 40; ++k)
  {
    patient.Stand(0.1);
    double medium = 0.0;
    double lumen = 0.0;
    for (std::size_t b = 0; b < Phantom().axis.size(); ++b)
    {
      if (Phantom().groupName[b].find("LAD") != std::string::npos)
      {
        medium += Inside(patient.model, static_cast<int>(b)).first;
        lumen += Inside(patient.model, static_cast<int>(b)).second;
      }
    }
    first = k == 0 ? medium / lumen : first;
    rise = k == 0 ? 0.0 : std::max(rise, medium / lumen - before);
    before = medium / lumen;
  }
  Row("wash-out of the LAD, 40 times 0.1 s: greatest rise of c", 0.0, rise, "0.001");
  EXPECT_LT(rise, 0.001);
  EXPECT_GT(first, 0.5);
  EXPECT_LT(before, 0.01);
}

/// Seconds until the first tracer has passed 100 mm of the LAD; beating, or at a constant pressure.
double FrontTime(const WallTopology& vessels, double start, bool beating)
{
  ContrastSettings settings;
  settings.tracers.volume = 2e-5;
  if (!beating)
  {
    settings.flow.systolicPressure = 93.0;
    settings.flow.diastolicPressure = 93.0;
  }
  Patient patient(vessels, settings, 1, start);
  const FlowNetwork& network = patient.model.FlowModel().Network();
  const std::vector<int>& path = patient.model.FlowModel().ReferencePath(0);
  double before = 0.0; // mm to the last segment
  for (std::size_t k = 0; k + 1 < path.size(); ++k)
  {
    before += network.Segments()[path[k]].to - network.Segments()[path[k]].from;
  }
  const FlowSegment& end = network.Segments()[path.back()];
  const double beyond = network.VolumeAt(end.branch, end.from + 100.0 - before) - end.volumeFrom;
  const CatheterTip tip{ network.Segments()[path.front()].branch, 0.0 };
  patient.Stand(beating ? 0.0 : 12.0);
  for (int step = 1; step < 1000; ++step)
  {
    if (beating)
    {
      patient.Beat(Dt, 0.4, tip);
    }
    else
    {
      patient.Stand(Dt, 0.4, tip);
    }
    for (std::int64_t i = 0; i < patient.model.NumberOfTracers(); ++i)
    {
      if (patient.model.Tracers().Segment(i) == path.back() &&
        patient.model.Tracers().Lumen(i) >= beyond)
      {
        return step * Dt;
      }
    }
  }
  return std::numeric_limits<double>::infinity();
}

// 10 cm at 25 cm/s on the axis, at the cycle's mean pressure. In a beating heart what starts in systole is slower, so
// that there the speeds are averaged.
TEST(ContrastModel, FrontPassesTheLad)
{
  for (const std::uint64_t seed : { 0U, 1U, 4U })
  {
    PhantomSettings phantom;
    phantom.seed = seed;
    const WallTopology vessels = PhantomVessels(phantom);
    const std::string who = "10 cm of the LAD, phantom " + std::to_string(seed);
    const double steady = FrontTime(vessels, 0.0, false);
    Row("front, mean flow, " + who + ": s", 0.4, steady, "10 %");
    EXPECT_NEAR(steady, 0.4, 0.04);
    constexpr int starts = 8;
    double speed = 0.0;
    for (int start = 0; start < starts; ++start)
    {
      const double time = FrontTime(vessels, static_cast<double>(start) / starts, true);
      speed += 10.0 / time / starts;
    }
    Row("mean speed of eight fronts, beating, " + who + ": cm/s", 25.0, speed, "10 %");
    EXPECT_NEAR(speed, 25.0, 2.5);
  }
}

TEST(ContrastModel, SelectiveInjectionStaysSelective)
{
  const int distal = BranchNamed(Phantom(), "mLAD");
  const int main = BranchNamed(Phantom(), "LM");
  const int other = BranchNamed(Phantom(), "pLCx");
  const CatheterTip tip{ distal, 3.0 };
  Patient patient(Phantom());
  patient.Beat(3.0, 0.1, tip);
  EXPECT_GT(Inside(patient.model, distal).first, 0.0);
  EXPECT_EQ(Inside(patient.model, main).first, 0.0);
  EXPECT_EQ(Inside(patient.model, other).first, 0.0);
  EXPECT_EQ(patient.model.Balance().spilled, 0.0);
  // More than the artery takes reaches the main stem, the other branch and the aorta.
  patient.Beat(3.0, 6.0, tip);
  EXPECT_GT(Inside(patient.model, main).first, 0.1);
  EXPECT_GT(Inside(patient.model, other).first, 0.1);
  EXPECT_GT(patient.model.Balance().spilled, 1.0);
  EXPECT_LT(Off(patient.model.Balance()), 1e-12);
}

TEST(ContrastModel, SameSeedSameBits)
{
  std::vector<std::uint64_t> hashes;
  for (const std::uint64_t seed : { 3U, 3U, 4U })
  {
    Patient patient(Phantom(), {}, seed);
    patient.Beat(1.5, 3.0, { BranchNamed(Phantom(), "LM"), 1.0 });
    patient.Beat(0.5);
    hashes.push_back(patient.model.StateHash());
  }
  Row("same seed, same bits: states that differ", 0.0, hashes[0] == hashes[1] ? 0.0 : 1.0, "0");
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_NE(hashes[0], hashes[2]);
}

TEST(ContrastModel, AskingChangesNothing)
{
  Patient asked(Phantom());
  Patient silent(Phantom());
  std::vector<Vector3> axis;
  for (const std::vector<Vector3>& branch : Phantom().axis)
  {
    axis.insert(axis.end(), branch.begin(), branch.end());
  }
  std::vector<Vector3> positions;
  std::vector<float> volumes;
  for (int k = 0; k < 100; ++k)
  {
    asked.Beat(Dt, 2.0, { 0, 0.0 });
    silent.Beat(Dt, 2.0, { 0, 0.0 });
    asked.model.Concentration();
    asked.model.TracerPositions(axis, positions, volumes);
  }
  EXPECT_EQ(asked.model.StateHash(), silent.model.StateHash());
}

TEST(ContrastModel, HeartPausesDuringAnInjection)
{
  const CatheterTip tip{ BranchNamed(Phantom(), "LM"), 0.0 };
  Patient patient(Phantom());
  patient.Beat(1.0, 2.0, tip);
  patient.Stand(10.0, 2.0, tip);
  const double steady = patient.model.Flow(tip.branch);
  patient.Stand(1.0, 2.0, tip);
  EXPECT_NEAR(patient.model.Flow(tip.branch), steady, 1e-6);
  EXPECT_GT(steady, 0.5);
  patient.Beat(2.0);
  EXPECT_LT(Off(patient.model.Balance()), 1e-12);
  for (const double c : patient.model.Concentration())
  {
    ASSERT_TRUE(c >= 0.0 && c <= 1.0);
  }
}

TEST(ContrastModel, UnevenSlabsHoldAllOfIt)
{
  // Intervals of 0.05 to 5 mm, and one without length.
  WallTopology vessels;
  vessels.axis.emplace_back();
  double z = 0.0;
  for (int k = 0; k < 120; ++k)
  {
    vessels.axis[0].emplace_back(0.0, 0.0, z);
    z += k == 60 ? 0.0 : 0.05 * std::pow(100.0, 0.5 + 0.5 * std::sin(1.7 * k));
  }
  vessels.axisRadius.assign(1, std::vector<double>(120, 1.2));
  vessels.parent = { -1 };
  for (const double smoothing : { 0.0, 1.5, 20.0 })
  {
    ContrastSettings settings;
    settings.smoothing = smoothing;
    settings.tracers.volume = 2e-5;
    Patient patient(vessels, settings);
    patient.Stand(2.0);
    patient.Stand(5.0, 0.5 * patient.model.Flow(0), { 0, 0.0 });
    double medium = 0.0;
    double rough = 0.0;
    for (std::size_t k = 0; k < patient.model.Slabs().size(); ++k)
    {
      const double c = patient.model.Concentration()[k];
      ASSERT_TRUE(c >= 0.0 && c <= 1.0);
      medium += c * patient.model.Slabs()[k].volume;
      rough = std::max(rough, std::abs(c - 0.5));
    }
    EXPECT_NEAR(medium / patient.model.Balance().inTree, 1.0, 1e-12) << smoothing;
    if (smoothing == 1.5)
    {
      Row("uneven slabs, c = 0.5: greatest noise of a slab", 0.0, rough, "0.1");
      EXPECT_LT(rough, 0.1);
    }
  }
}

TEST(ContrastModel, TracersAreInTheLumen)
{
  const WallTopology vessels = Fork(1.5, 1.0);
  ContrastSettings settings;
  settings.tracers.radialDiffusivity = 0.0;
  Patient patient(vessels, settings);
  patient.Stand(1.0);
  patient.Stand(2.0, 0.5, { 0, 0.0 });
  std::vector<Vector3> axis;
  for (const std::vector<Vector3>& branch : vessels.axis)
  {
    axis.insert(axis.end(), branch.begin(), branch.end());
  }
  std::vector<Vector3> positions;
  std::vector<float> volumes;
  patient.model.TracerPositions(axis, positions, volumes);
  ASSERT_EQ(static_cast<std::int64_t>(positions.size()), patient.model.NumberOfTracers());
  ASSERT_GT(positions.size(), 500U);
  double sum = 0.0;
  for (std::size_t i = 0; i < positions.size(); ++i)
  {
    sum += volumes[i];
    const int branch = patient.model.FlowModel()
                         .Network()
                         .Segments()[patient.model.Tracers().Segment(static_cast<std::int64_t>(i))]
                         .branch;
    double nearest = 1e9;
    for (std::size_t k = 1; k < vessels.axis[branch].size(); ++k)
    {
      nearest = std::min(nearest,
        NearestOnSegment(positions[i], vessels.axis[branch][k - 1], vessels.axis[branch][k])
          .squaredDistance);
    }
    EXPECT_LT(std::sqrt(nearest), vessels.axisRadius[branch][1] + 1e-6);
  }
  EXPECT_NEAR(sum, patient.model.Balance().inTree, 1e-6);
  axis.pop_back();
  EXPECT_THROW(patient.model.TracerPositions(axis, positions, volumes), std::invalid_argument);
}

TEST(ContrastModel, MediumDepressesFlow)
{
  const CatheterTip tip{ BranchNamed(Phantom(), "LM"), 0.0 };
  const int left = BranchNamed(Phantom(), "pLAD");
  const int right = BranchNamed(Phantom(), "pRCA");
  ContrastSettings settings;
  settings.flowDepression = 1.0;
  Patient patient(Phantom(), settings);
  patient.Stand(12.0);
  const double free = patient.model.Flow(left);
  const double other = patient.model.Flow(right);
  patient.Stand(20.0, 5.0, tip);
  Row("flow under neat contrast medium, with depression", 0.45, patient.model.Flow(left) / free,
    "0.04");
  EXPECT_NEAR(patient.model.Flow(left) / free, 0.45, 0.04);
  EXPECT_NEAR(patient.model.Flow(right), other, 1e-6);
  patient.Stand(25.0);
  EXPECT_NEAR(patient.model.Flow(left) / free, 1.0, 0.02);
}

TEST(ContrastModel, EmptyUntilInjected)
{
  Patient patient(Phantom());
  patient.Beat(0.1);
  EXPECT_TRUE(patient.model.Empty());
  for (const double c : patient.model.Concentration())
  {
    ASSERT_EQ(c, 0.0);
  }
  patient.Beat(0.1, 3.0, { -1, 0.0 });
  EXPECT_FALSE(patient.model.Empty());
  EXPECT_NEAR(patient.model.Balance().spilled, 0.3, 1e-12);
  EXPECT_EQ(patient.model.NumberOfTracers(), 0);
  patient.Beat(2.0, 3.0, { BranchNamed(Phantom(), "LM"), 0.0 });
  const std::vector<double>& blush = patient.model.BlushVolume();
  EXPECT_NEAR(
    std::accumulate(blush.begin(), blush.end(), 0.0), patient.model.Balance().blush, 1e-12);
  EXPECT_GT(patient.model.Balance().blush, 0.1);
}

TEST(ContrastModel, RefusesBadInput)
{
  ContrastModel model(Phantom(), {}, 1);
  const std::uint64_t before = model.StateHash();
  const CatheterTip tip{ 0, 0.0 };
  const double nan = std::nan("");
  EXPECT_THROW(model.Step(0.0001, 0.0, 75.0, 0.0, tip), std::invalid_argument);
  EXPECT_THROW(model.Step(0.05, 0.0, 75.0, 0.0, tip), std::invalid_argument);
  EXPECT_THROW(model.Step(Dt, nan, 75.0, 0.0, tip), std::invalid_argument);
  EXPECT_THROW(model.Step(Dt, 0.0, 301.0, 0.0, tip), std::invalid_argument);
  EXPECT_THROW(model.Step(Dt, 0.0, 75.0, -0.1, tip), std::invalid_argument);
  EXPECT_THROW(model.Step(Dt, 0.0, 75.0, 1e9, tip), std::invalid_argument);
  EXPECT_THROW(model.Step(Dt, 0.0, 75.0, 1.0, { 99, 0.0 }), std::invalid_argument);
  EXPECT_THROW(model.Step(Dt, 0.0, 75.0, 1.0, { -2, 0.0 }), std::invalid_argument);
  EXPECT_THROW(model.Step(Dt, 0.0, 75.0, 1.0, { 0, nan }), std::invalid_argument);
  EXPECT_EQ(model.StateHash(), before);
  ContrastSettings settings;
  settings.smoothing = -1.0;
  EXPECT_THROW(ContrastModel(Phantom(), settings, 1), std::invalid_argument);
  settings = {};
  settings.flowDepression = 2.0;
  EXPECT_THROW(settings.Validate(), std::invalid_argument);
}
}
}
