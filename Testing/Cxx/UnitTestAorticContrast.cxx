// Contrast medium in the aorta, in the guide catheter, and what goes wrong in the arteries, against closed forms.
#include "AorticContrast.h"
#include "ContrastModel.h"
#include "ContrastTestData.h"
#include "CoronaryPhantom.h"
#include "GuideInAorta.h"
#include "GuideLumen.h"
#include "Refusals.h"
#include "VesselIncidents.h"
#include "WallMotions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace UnitTestAorticContrast
{
using namespace coronary;

namespace
{
constexpr double Dt = 0.005;

/// A tube of 30 mm with ostia in its third slice.
AorticSections Straight(int slices, std::size_t mouths)
{
  AorticSections sections;
  sections.radii.assign(static_cast<std::size_t>(slices) + 1, 15.0);
  sections.mouths.assign(mouths, 12.0);
  return sections;
}

double VolumeOf(const AorticSections& sections)
{
  double volume = 0.0;
  for (std::size_t i = 0; i + 1 < sections.radii.size(); ++i)
  {
    volume += sections.Volume(i);
  }
  return volume;
}
}

TEST(AorticContrast, AMixedRootWashesOutAsAnExponential)
{
  // Without sinuses, in fine steps: exp(-Q t / V).
  AorticContrast root(Straight(1, 0), {});
  const double volume = VolumeOf(root.Sections());
  root.Step(1e-5, 0.0, { 0.0, 0, 1.0, 0.0 });
  const double before = root.InAorta();
  for (int k = 0; k < 20000; ++k)
  {
    root.Step(1e-5, 20.0, {});
  }
  const double exact = before * std::exp(-20.0 * 0.2 / volume);
  Row("root mixed, 20 mL/s: mL after 0.2 s", exact, root.InAorta(), "0.1 %");
  EXPECT_NEAR(root.InAorta() / exact, 1.0, 1e-3);
}

TEST(AorticContrast, ABolusTakesTheVolumeOverTheFlow)
{
  // Stewart and Hamilton: flow = bolus / integral of the concentration that leaves; mean transit time = volume / flow.
  AorticFlowSettings settings;
  settings.axialDiffusivity = 0.0;
  AorticContrast aorta(Straight(20, 0), settings);
  const double volume = VolumeOf(aorta.Sections());
  const double flow = 85.0;
  aorta.Step(1e-3, flow, { 0.0, 0, 0.5, 0.0 });
  double area = aorta.Concentration().back() * 1e-3;
  double moment = 0.0;
  for (int k = 1; k < 20000; ++k)
  {
    aorta.Step(1e-3, flow, {});
    area += aorta.Concentration().back() * 1e-3;
    moment += aorta.Concentration().back() * 1e-3 * (1e-3 * k);
  }
  Row("bolus through the aorta: flow, mL/s", flow, 0.5 / area, "0.001 %");
  EXPECT_NEAR(0.5 / area / flow, 1.0, 1e-5);
  // It has pushed on as much as it is.
  const double transit = (volume - 0.5) / flow;
  Row("the same: mean transit time, s", transit, moment / area, "0.1 %");
  EXPECT_NEAR(moment / area / transit, 1.0, 1e-3);
}

TEST(AorticContrast, NothingIsLostAndNothingIsMoreThanNeat)
{
  AorticContrast aorta(Straight(24, 2), {});
  double entered = 0.0;
  double worst = 0.0;
  double most = 0.0;
  for (int k = 0; k < 4000; ++k)
  {
    const double phase = 0.00625 * k;
    AorticContrast::Inflow inflow;
    inflow.mouth = k % 700 < 350 ? 0 : 1;
    inflow.spilled = k % 300 < 120 ? Dt * 0.1 * (k % 120) : 0.0;
    inflow.direct = k % 500 < 60 ? Dt * 8.0 : 0.0;
    inflow.place = 0.2 * (k % 600);
    entered += inflow.spilled + inflow.direct;
    aorta.Step(Dt, EjectedFlow({}, 0.05, 0.35, phase, 75.0), inflow);
    worst =
      std::max(worst, std::abs(aorta.InAorta() + aorta.Left() - entered) / std::max(entered, 1e-9));
    for (const double c : aorta.Concentration())
    {
      EXPECT_GE(c, 0.0);
      most = std::max(most, c);
    }
    for (const double sinus : aorta.Sinuses())
    {
      EXPECT_LE(sinus, AorticFlowSettings().sinusVolume * (1.0 + 1e-12));
    }
  }
  EXPECT_GT(most, 0.05);
  EXPECT_LE(most, 1.0 + 1e-12);
  Row("aorta: relative error of the volume of contrast medium", 0.0, worst, "1e-12");
  EXPECT_LT(worst, 1e-12);
}

TEST(AorticContrast, TheHeartEjectsItsStrokeVolume)
{
  double sum = 0.0;
  for (int k = 0; k < 10000; ++k)
  {
    sum += EjectedFlow({}, 0.05, 0.35, (k + 0.5) / 10000.0, 60.0) / 10000.0;
  }
  EXPECT_NEAR(sum, AorticFlowSettings().strokeVolume, 1e-3);
  EXPECT_EQ(EjectedFlow({}, 0.05, 0.35, 0.6, 60.0), 0.0);
  EXPECT_EQ(EjectedFlow({}, 0.05, 0.35, 0.2, 0.0), 0.0) << "it stands still";
}

TEST(AorticContrast, ThePhantomsAortaIsMeasured)
{
  WallTopology vessels = PhantomVessels({});
  vessels.aorta = std::make_shared<AortaAtRest>(PhantomAorta(CoronaryPhantom({})));
  const AorticSections sections = SectionsOfAorta(vessels);
  ASSERT_EQ(sections.points.size(), sections.radii.size());
  ASSERT_EQ(sections.mouths.size(), 2U);
  EXPECT_EQ(sections.points.size(), static_cast<std::size_t>(AorticSections::Count) + 1);
  for (std::size_t k = 1; k < sections.points.size(); ++k)
  {
    EXPECT_GT(sections.radii[k], 8.0) << k;
    EXPECT_LT(sections.radii[k], 28.0) << k;
  }
  for (const double mouth : sections.mouths)
  {
    EXPECT_GT(mouth, 2.0);
    EXPECT_LT(mouth, 45.0);
  }
  std::printf("phantom: %.1f mm wide at the ostia, %.1f and %.1f mm above the valve\n",
    2.0 * sections.radii[static_cast<std::size_t>(sections.mouths[0] / AorticSections::Length)],
    sections.mouths[0], sections.mouths[1]);
}

// What a brisk injection spills is seen, and gone within some beats.
TEST(AorticContrast, RefluxIsWashedAway)
{
  const WallTopology vessels = PhantomVessels({});
  ContrastModel model(vessels, {}, 1);
  const auto root = static_cast<int>(
    std::find(vessels.parent.begin(), vessels.parent.end(), -1) - vessels.parent.begin());
  double phase = 0.0;
  const auto beat = [&](double seconds, double injection)
  {
    for (int k = 0; k < static_cast<int>(std::lround(seconds / Dt)); ++k)
    {
      phase += 0.00625;
      model.Step(Dt, phase, 75.0, injection, { root, 3.0 });
      const ContrastBalance now = model.Balance();
      ASSERT_NEAR(now.spilled, now.inAorta + now.leftAorta, 1e-11);
      ASSERT_NEAR(
        now.injected, now.inTree + now.blush + now.washedOut + now.inAorta + now.leftAorta, 1e-9);
    }
  };
  beat(1.0, 0.0);
  beat(1.6, 6.0);
  const double full = model.Balance().inAorta;
  EXPECT_GT(full, 0.5);
  beat(1.6, 0.0); // two beats
  const double later = model.Balance().inAorta;
  std::printf("in the aorta: %.2f mL, two beats later %.2f mL\n", full, later);
  EXPECT_LT(later, 0.25 * full);
}

TEST(GuideLumen, FillsAndIsFlushed)
{
  // 6F: 0.071 inch, 100 cm.
  GuideLumen guide(0.9017, 1000.0);
  const double volume = M_PI * 0.9017 * 0.9017;
  EXPECT_NEAR(guide.Volume(), volume, 1e-9);
  Row("lumen of a 6F guide of 100 cm, mL", 2.5543, guide.Volume(), "1e-4");
  double out = 0.0;
  double pushed = 0.0;
  double arrives = -1.0;
  for (int k = 0; k < 1000; ++k)
  {
    const GuideLumen::Outflow now = guide.Push({ 0.005, 1.0, false });
    pushed += 0.005;
    EXPECT_NEAR(now.liquid, 0.005, 1e-12);
    out += now.medium;
    arrives = arrives < 0.0 && now.medium > 0.0 ? pushed : arrives;
    EXPECT_NEAR(out + guide.Medium(), pushed, 1e-11);
  }
  EXPECT_NEAR(arrives, volume, 0.005);
  EXPECT_NEAR(out, pushed - volume, 1e-9);
  EXPECT_NEAR(guide.Medium(), volume, 1e-9);
  // Saline drives out what stayed in it; drawn back, it comes to the hub.
  EXPECT_NEAR(guide.Push({ 1.0, 0.0, false }).medium, 1.0, 1e-12);
  EXPECT_NEAR(guide.Draw(1.5).medium, 0.5, 1e-12);
  EXPECT_NEAR(guide.Medium(), volume - 1.5, 1e-9);
  EXPECT_NEAR(guide.Push({ volume, 0.0, false }).medium, volume - 1.5, 1e-9);
  EXPECT_NEAR(guide.Medium(), 0.0, 1e-12);
  // Air at the hub goes ahead of what follows, or is drawn back.
  guide.Push({ 0.1, 0.0, true });
  EXPECT_NEAR(guide.Draw(0.2).air, 0.1, 1e-12);
  guide.Push({ 0.1, 0.0, true });
  EXPECT_NEAR(guide.Air(), 0.1, 1e-12);
  EXPECT_NEAR(guide.Push({ volume, 1.0, false }).air, 0.1, 1e-12);
}

namespace
{
/// A tube that can go into spasm or be blocked by air, its lumen in the network.
struct Ill
{
  WallTopology topology;
  CoronaryFlow flow;
  VesselIncidents incidents;

  explicit Ill(WallTopology vessels)
    : topology(std::move(vessels))
    , flow(this->topology, {})
    , incidents(this->flow.Network())
  {
  }
  void Settle()
  {
    std::vector<double> lumen;
    for (const std::vector<double>& radii : this->topology.axisRadius)
    {
      lumen.insert(lumen.end(), radii.begin(), radii.end());
    }
    std::vector<double> filled(lumen.size(), 0.0);
    this->incidents.Apply(lumen, filled);
    this->flow.SetLumen(lumen, filled);
    for (int k = 0; k < 4000; ++k)
    {
      this->flow.Step(Dt, 0.6, 0.0);
    }
  }
};
}

TEST(VesselIncidents, ASpasmNarrowsAndNitratesRelaxIt)
{
  WallTopology tube = Tube(60.0, 1.5, 1.5, 240);
  tube.groupName[0] = "pRCA";
  Ill ill(tube);
  ill.Settle();
  const double before = ill.flow.TreeFlow(0);
  ill.incidents.BeginSpasm("pRCA", 0.6, 4.0);
  ill.incidents.Step(2.0, 0.0);
  EXPECT_NEAR(ill.incidents.Narrowing(), 0.3, 1e-12) << "half of its time";
  ill.incidents.Step(10.0, 0.0);
  EXPECT_NEAR(ill.incidents.Narrowing(), 0.6, 1e-12);
  ill.Settle();
  // 50 of its 60 mm with the whole narrowing: each mm has (1 - 0.6)^-4 of its resistance.
  const double poiseuille = AnnularResistance(0.0, 0.6, 50.0);
  const double lost = ill.flow.PressureAt({ 0, 5.0 }) - ill.flow.PressureAt({ 0, 55.0 });
  Row("spasm of 60 %, 50 mm: pressure lost, mmHg", poiseuille * ill.flow.TreeFlow(0), lost, "1e-6");
  EXPECT_NEAR(lost / (poiseuille * ill.flow.TreeFlow(0)), 1.0, 1e-6);
  EXPECT_LT(ill.flow.TreeFlow(0), 0.9 * before);
  ill.incidents.GiveNitrates();
  ill.incidents.Step(0.5 * VesselIncidents::Relaxation, 0.0);
  EXPECT_NEAR(ill.incidents.Narrowing(), 0.3, 1e-12);
  ill.incidents.Step(VesselIncidents::Relaxation, 0.0);
  ill.Settle();
  EXPECT_NEAR(ill.flow.TreeFlow(0) / before, 1.0, 1e-9);
}

TEST(VesselIncidents, AirBlocksUntilItIsAbsorbed)
{
  WallTopology fork = Fork(1.2, 0.9);
  fork.groupName = { "LM", "pLAD", "pLCx" };
  Ill ill(fork);
  ill.Settle();
  const double wide = ill.flow.Flow()[1];
  const double narrow = ill.flow.Flow()[2];
  ASSERT_GT(wide, narrow);
  EXPECT_EQ(ill.incidents.AddAir(0.1, "", ill.flow.Flow(), 0), 1) << "into the greater flow";
  ill.Settle();
  EXPECT_LT(ill.flow.Flow()[1], 1e-3 * wide);
  EXPECT_GT(ill.flow.Flow()[2], narrow);
  // 0.1 exp(-t / 60 s) is above 0.005 mL until 179.7 s.
  ill.incidents.Step(179.0, 0.0);
  EXPECT_TRUE(ill.incidents.Blocked());
  ill.incidents.Step(1.0, 0.0);
  EXPECT_FALSE(ill.incidents.Blocked());
  ill.Settle();
  EXPECT_NEAR(ill.flow.Flow()[1] / wide, 1.0, 1e-6);
  // Drawn back.
  ill.incidents.AddAir(0.1, "pLCx", ill.flow.Flow(), 0);
  ill.incidents.Step(1.1, 2.0);
  EXPECT_FALSE(ill.incidents.Blocked());
  ExpectRefusal([&] { ill.incidents.BeginSpasm("mLAD", 0.5, 1.0); },
    "An event is in the vessel 'mLAD', which is not there; there are 'LM', 'pLAD', 'pLCx'.");
}
}
