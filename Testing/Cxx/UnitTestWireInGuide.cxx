// A wire in a bent guide: pressed on by its stiffness, its axial force and its curvature at rest, against closed forms.

#include "InstrumentCatalogue.h"
#include "TableRow.h"
#include "WireInGuide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace UnitTestWireInGuide
{
using namespace coronary;

namespace
{
constexpr double Radius = 0.178; // mm
constexpr double Limp = 1e-9;    // N mm^2: bending stiffness that presses nothing

Guidewire EvenWire(double bending, double torsional, double curved = 0.0)
{
  WireSection section;
  section.length = 100.0;
  section.bendingStiffness1 = section.bendingStiffness2 = bending;
  section.torsionalStiffness = torsional;
  section.radius = Radius;
  section.restCurvature = curved;
  Guidewire wire;
  section.length = 1800.0;
  wire.sections.assign(1, section);
  return wire;
}

GuideCatheter Guide(std::vector<CatheterArc> shape, double friction, double length = 0.0)
{
  GuideCatheter guide;
  guide.innerRadius = 0.9;
  guide.friction = friction;
  guide.shape = std::move(shape);
  for (const CatheterArc& arc : guide.shape)
  {
    guide.length = &arc == guide.shape.data() ? arc.length : guide.length + arc.length;
  }
  guide.length = std::max(guide.length, length);
  return guide;
}

double TurnOf(const GuideCatheter& guide)
{
  double angle = 0.0;
  for (const CatheterArc& arc : guide.shape)
  {
    angle += std::abs(arc.curvature) * arc.length;
  }
  return angle;
}

/// Slides until all friction is that of sliding. The far end turns freely.
void Slide(WireInGuide& wire, double force, double way, double hand = 0.0)
{
  for (int n = 0; n < 40; ++n)
  {
    wire.Drive(100.0, way, hand);
    wire.Settle(force, wire.Angle());
  }
}

void Turn(WireInGuide& wire, double force, double from, double to, double step = 0.002)
{
  const int count = static_cast<int>(std::ceil(std::abs(to - from) / step));
  for (int n = 1; n <= count; ++n)
  {
    wire.Drive(100.0, 0.0, from + (to - from) * n / count);
    wire.Settle(force, wire.Angle());
  }
}

TEST(WireInGuide, IsTheCapstanForPushAndPullAtBothEnds)
{
  const GuideCatheter guide = BuiltInCatalogue().Catheter("JL4-6F").catheter;
  double worst = 0.0;
  for (const double size : { 0.005, 0.05, 0.5, 5.0 })
  {
    for (const double force : { size, -size })
    {
      for (const double way : { 0.01, -0.01 })
      {
        WireInGuide wire(EvenWire(Limp, 80.0), guide, 0.0);
        Slide(wire, force, way);
        // Against what resists the hand needs more, with what helps it less.
        const double exponent = guide.friction * TurnOf(guide) * (force * way > 0.0 ? 1.0 : -1.0);
        const double expected = force * std::exp(exponent);
        worst = std::max(worst, std::abs(wire.AtHand().force / expected - 1.0));
      }
    }
  }
  EXPECT_LT(worst, 1e-3);
  Row("wire in a JL4 guide pushed and pulled, 0.005 to 5 N: hand's force over capstan's (worst)",
    1.0, 1.0 + worst, "0.1 %");
}

TEST(WireInGuide, ItsStiffnessPressesItOntoALongBend)
{
  // The wire's curvature grows evenly from 0 to that of the bend, from the outer wall to the inner one.
  const double stiffness = 80.0;
  const double curvature = 1.0 / 20.0;
  const double clearance = 0.9 - Radius;
  const double reach = std::sqrt(12.0 * clearance / curvature);
  const double expected = 2.0 * 2.0 * stiffness * curvature / (2.0 * reach); // two ends, two walls
  const GuideCatheter guide =
    Guide({ { 60.0, 0.0, 0.0 }, { 60.0, curvature, 0.0 }, { 60.0, 0.0, 0.0 } }, 0.1);
  for (const double way : { 0.01, -0.01 })
  {
    WireInGuide wire(EvenWire(stiffness, 80.0), guide, 0.0);
    Slide(wire, 0.0, way);
    EXPECT_NEAR(wire.Pressing(), expected, 0.03 * expected);
    // Nothing holds its far end. What it is pressed on with grows through the bend, as force does.
    const double force = wire.AtHand().force;
    EXPECT_GT(force / way, 0.0);
    EXPECT_GT(std::abs(force), 0.1 * expected);
    EXPECT_LT(std::abs(force), 0.1 * expected * std::exp(0.1 * TurnOf(guide)));
    if (way > 0.0)
    {
      Row("stiff wire in a long bend: N in all on the guide's walls", expected, wire.Pressing(),
        "3 %");
    }
  }
}

TEST(WireInGuide, ItsStiffnessPressesItOntoAShortBend)
{
  // On three points: at the middle of the bend, and to both sides of it.
  const double stiffness = 80.0;
  const double length = 12.0;
  const double angle = 80.0 * M_PI / 180.0;
  const double clearance = 0.9 - Radius;
  const double reach = 12.0 * clearance / angle + 0.75 * length;
  const double expected = 4.0 * stiffness * angle / (reach * reach);
  WireInGuide wire(EvenWire(stiffness, 80.0),
    Guide({ { 60.0, 0.0, 0.0 }, { length, angle / length, 0.3 }, { 60.0, 0.0, 0.0 } }, 0.1), 0.0);
  Slide(wire, 0.0, 0.01);
  EXPECT_NEAR(wire.Pressing(), expected, 0.03 * expected);
  Row(
    "stiff wire in a short bend: N in all on the guide's walls", expected, wire.Pressing(), "3 %");
}

class Lag : public testing::Test
{
protected:
  static constexpr double Length = 200.0;
  static constexpr double Torsional = 10.0;
  static constexpr double Force = 2.0;
  const GuideCatheter Bent = Guide({ { Length, 1.0 / 60.0, 0.0 } }, 0.1);
  const double Rubs = 0.1 * Force / 60.0 * Radius; // N mm per mm
  const double Expected = Rubs * Length * Length / (2.0 * Torsional);
};

TEST_F(Lag, TheFarEndLagsByWhatFrictionTwists)
{
  WireInGuide wire(EvenWire(Limp, Torsional), Bent, 0.0);
  wire.Drive(100.0, 0.0, 0.0);
  wire.Settle(Force, 0.0);
  Turn(wire, Force, 0.0, 6.0);
  EXPECT_NEAR(wire.AtHand().torque, Rubs * Length, 1e-3 * Rubs * Length);
  EXPECT_NEAR(wire.AtHand().force, Force, 1e-9) << "it slides around, not along";
  const double lag = 6.0 - wire.Angle();
  EXPECT_NEAR(lag, Expected, 0.01 * Expected);
  Row("turned in a bent guide: rad by which the far end lags", Expected, lag, "1 %");

  // The other way round friction has to be reversed along all of it before the far end follows.
  const double before = wire.Angle();
  const double followed = 0.2; // more than friction gives while it sticks
  double hand = 6.0;
  while (wire.Angle() > before - followed && hand > 0.0)
  {
    Turn(wire, Force, hand, hand - 0.01);
    hand -= 0.01;
  }
  EXPECT_NEAR(6.0 - hand, 2.0 * Expected + followed, 0.02 * Expected);
  Turn(wire, Force, hand, -6.0);
  EXPECT_NEAR(wire.Angle() - -6.0, Expected, 0.01 * Expected);
  EXPECT_NEAR(wire.AtHand().torque, -Rubs * Length, 1e-3 * Rubs * Length);
}

TEST_F(Lag, AWireThatIsAdvancedTurnsFreely)
{
  WireInGuide wire(EvenWire(Limp, Torsional), Bent, 0.0);
  double hand = 0.0;
  const double turn = 0.002;
  const double way = 0.01;
  for (int n = 0; n < 4000; ++n)
  {
    hand += turn;
    wire.Drive(100.0, way, hand);
    wire.Settle(Force, wire.Angle());
  }
  // Friction is against the way that the surface slides: along, mostly.
  const double slope = Radius * turn / std::hypot(way, Radius * turn);
  const double exponent = 0.1 * Length / 60.0 * way / std::hypot(way, Radius * turn);
  double expected =
    0.0; // of the twist: friction at s grows by the capstan's law and twists all that is behind it
  constexpr int parts = 2000;
  for (int i = 0; i < parts; ++i)
  {
    const double s = (i + 0.5) / parts;
    expected +=
      Rubs * slope * std::exp(exponent * s) * (1.0 - s) * Length * Length / parts / Torsional;
  }
  EXPECT_LT(expected, 0.1 * Expected);
  EXPECT_NEAR(hand - wire.Angle(), expected, 0.02 * expected);
}

class Whip : public testing::Test
{
protected:
  static constexpr double Length = 100.0;
  static constexpr double Torsional = 10.0;
  static constexpr double Bending = 13.0;
  static constexpr double Curvature = 1.0 / 50.0;
  static constexpr double Easy = -0.5 * M_PI; ///< the hand's angle at which both bend the same way
  static constexpr double Hard = 0.5 * M_PI;

  /// @param number  length * sqrt(EI k0 k / GJ)
  static WireInGuide Curved(double number)
  {
    const double curved = number * number * Torsional / (Length * Length * Bending * Curvature);
    WireInGuide wire(
      EvenWire(Bending, Torsional, curved), Guide({ { Length, Curvature, 0.0 } }, 0.0), 0.0);
    Turn(wire, 0.0, 0.0, Easy);
    Hold(wire, Easy);
    return wire;
  }

  static void Hold(WireInGuide& wire, double hand)
  {
    for (int n = 0; n < 3000; ++n)
    {
      wire.Drive(100.0, 0.0, hand);
      wire.Settle(0.0, wire.Angle());
    }
  }

  static double Slope(WireInGuide& wire, double at)
  {
    Hold(wire, at - 1e-4);
    const double before = wire.Angle();
    Hold(wire, at + 1e-4);
    return (wire.Angle() - before) / 2e-4;
  }
};

TEST_F(Whip, BelowTheBifurcationTheFarEndFollows)
{
  for (const double number : { 0.5, 1.0, 1.4 })
  {
    WireInGuide wire = Curved(number);
    EXPECT_NEAR(Slope(wire, Easy), 1.0 / std::cosh(number), 0.005 / std::cosh(number));
    Turn(wire, 0.0, Easy, Hard);
    const double slope = Slope(wire, Hard);
    EXPECT_NEAR(slope, 1.0 / std::cos(number), 0.02 / std::cos(number)) << number;
  }
}

TEST_F(Whip, AboveTheBifurcationTheFarEndJumps)
{
  double below = 1.4;
  double above = 1.8;
  while (above - below > 1e-3)
  {
    const double number = 0.5 * (below + above);
    WireInGuide wire = Curved(number);
    Turn(wire, 0.0, Easy, Hard);
    Hold(wire, Hard);
    (std::abs(wire.Angle() - Hard) > 0.02 ? above : below) = number;
  }
  const double critical = 0.5 * (below + above);
  EXPECT_NEAR(critical, 0.5 * M_PI, 0.01 * 0.5 * M_PI);
  Row("curved wire turned in a bent guide: length sqrt(EI k0 k / GJ) at which it whips", 0.5 * M_PI,
    critical, "1 %");

  // Half way round the far end hangs back by A, that of a pendulum whose quarter period is the number.
  for (const double number : { 1.65, 1.8, 2.2 })
  {
    WireInGuide wire = Curved(number);
    Turn(wire, 0.0, Easy, Hard);
    Hold(wire, Hard);
    const double lag = Hard - wire.Angle();
    EXPECT_NEAR(std::comp_ellint_1(std::sin(0.5 * lag)), number, 0.01 * number);
    // And forth by as much when it comes from the other side.
    Turn(wire, 0.0, Hard, 2.0 * M_PI + Easy);
    Hold(wire, 2.0 * M_PI + Easy);
    EXPECT_NEAR(wire.Angle(), 2.0 * M_PI + Easy, 1e-3) << "it has whipped round";
    Turn(wire, 0.0, 2.0 * M_PI + Easy, Hard);
    Hold(wire, Hard);
    EXPECT_NEAR(wire.Angle() - Hard, lag, 0.01 * lag);
  }
}

TEST(WireInGuide, WorkIsHandedOnOrRubbedAway)
{
  const GuideCatheter& guide = BuiltInCatalogue().Catheter("JL4-6F").catheter;
  const Guidewire& real = BuiltInCatalogue().Wire("workhorse").wire;
  WireInGuide wire(real, guide, 12.0);
  const double loaded = 0.4; // N mm/rad that the far end is held with
  double inserted = 100.0;
  double hand = 0.0;
  double far = 0.0;
  double in = 0.0;
  double out = 0.0;
  double most = 0.0;
  HandLoad before;
  double torqueBefore = 0.0;
  double forceBefore = 0.0;
  for (int n = 0; n < 40000; ++n)
  {
    const double t = n * 5e-4;
    const double way = 0.005 * std::sin(2.0 * M_PI * t);
    const double turn = 0.002 * std::sin(2.0 * M_PI * 0.31 * t);
    const double force = 0.4 * std::sin(2.0 * M_PI * 0.83 * t);
    inserted += way;
    hand += turn;
    wire.Drive(inserted, way, hand);
    const double next = wire.Stiffness() * wire.Angle() / (wire.Stiffness() + loaded);
    const double torque = loaded * next;
    wire.Settle(force, next);
    const HandLoad& felt = wire.AtHand();
    in += 0.5 * (felt.force + before.force) * way + 0.5 * (felt.torque + before.torque) * turn;
    most += std::abs(felt.force * way) + std::abs(felt.torque * turn);
    out += 0.5 * (force + forceBefore) * way + 0.5 * (torque + torqueBefore) * (next - far);
    far = next;
    before = felt;
    forceBefore = force;
    torqueBefore = torque;
  }
  const double kept = wire.ElasticEnergy();
  EXPECT_GT(wire.Rubbed(), 0.2 * most);
  EXPECT_NEAR(in, out + wire.Rubbed() + kept, 0.01 * most)
    << in << " in, " << out << " out, " << wire.Rubbed() << " rubbed, " << kept << " kept";
  Row("hand's work of 20 s, pushing, pulling and turning against a load, N mm", in,
    out + wire.Rubbed() + kept, "1 %");
}

TEST(WireInGuide, AWireAtRestIsHeldAsItWasLeft)
{
  const GuideCatheter& guide = BuiltInCatalogue().Catheter("JL4-6F").catheter;
  WireInGuide wire(BuiltInCatalogue().Wire("workhorse").wire, guide, 12.0);
  wire.Drive(100.0, 0.0, 0.0);
  wire.Settle(0.3, 0.0);
  EXPECT_EQ(wire.AtHand().force, 0.3) << "nobody has moved it yet";
  Slide(wire, 0.3, 0.01);
  const double pushed = wire.AtHand().force;
  EXPECT_GT(pushed, 0.35);
  Slide(wire, 0.3, 0.0);
  EXPECT_NEAR(wire.AtHand().force, pushed, 1e-9);
  // It slides out by itself only when friction can not hold it: the hand needs less to hold than to push.
  Slide(wire, 0.3, -0.01);
  EXPECT_LT(wire.AtHand().force, 0.25);
}

TEST(WireInGuide, AStraightGuideDoesNotRub)
{
  WireInGuide wire(EvenWire(80.0, 60.0), Guide({}, 0.1, 1000.0), 12.0);
  Slide(wire, 0.7, 0.01, 2.0);
  EXPECT_EQ(wire.AtHand().force, 0.7);
  EXPECT_NEAR(wire.Stiffness(), 60.0 / (1000.0 - 12.0), 1e-12);
  EXPECT_EQ(wire.Angle(), 2.0);
}
}
}
