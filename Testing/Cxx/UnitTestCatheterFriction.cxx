// What a hand feels of a wire in a bent catheter, against closed forms, an integration along the bends, and the balance of power.

#include "CatheterFriction.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace coronary;

namespace
{
constexpr double Exponent = 0.1 * 305.0 * M_PI / 180.0; // of a JL4 and a usual coefficient
constexpr double Radius = 0.18;                         // mm

TEST(CatheterFriction, IsTheCapstanForPushAndPullAtBothEnds)
{
  const CatheterFriction friction(Exponent, Radius);
  for (const double size : { 0.005, 0.05, 0.5, 5.0 })
  {
    const double grown = size * std::exp(Exponent);
    const double shrunk = size * std::exp(-Exponent);
    // Pushed against what resists; pulled while something holds it: the hand needs more.
    EXPECT_NEAR(friction.AtHand({ size, 0.0 }, 20.0, 0.0).force, grown, 1e-12 * grown);
    EXPECT_NEAR(friction.AtHand({ -size, 0.0 }, -20.0, 0.0).force, -grown, 1e-12 * grown);
    // Let back while it is pressed out; let forwards while it is drawn in: the hand holds it with less.
    EXPECT_NEAR(friction.AtHand({ size, 0.0 }, -20.0, 0.0).force, shrunk, 1e-12 * shrunk);
    EXPECT_NEAR(friction.AtHand({ -size, 0.0 }, 20.0, 0.0).force, -shrunk, 1e-12 * shrunk);
  }
}

TEST(CatheterFriction, TurningRubsAroundTheWire)
{
  const CatheterFriction friction(Exponent, Radius);
  for (const double force : { -0.7, 0.7 })
  {
    for (const double turning : { -10.0, 10.0 })
    {
      const HandLoad felt = friction.AtHand({ force, 0.4 }, 0.0, turning);
      EXPECT_EQ(felt.force, force);
      EXPECT_NEAR(
        felt.torque, 0.4 + std::copysign(Exponent * Radius * std::abs(force), turning), 1e-12);
    }
  }
  // The wire slides one way only: while it is pushed, hardly anything holds it against turning.
  const double slow = friction.AtHand({ 0.7, 0.0 }, 100.0, 1.0).torque;
  EXPECT_LT(slow, 0.01 * friction.AtHand({ 0.7, 0.0 }, 0.0, 10.0).torque);
}

TEST(CatheterFriction, IsTheIntegralAlongTheBends)
{
  const CatheterFriction friction(Exponent, Radius);
  for (const double force : { -0.3, 0.3 })
  {
    for (const double advancing : { -6.0, 6.0 })
    {
      const double turning = 40.0;
      const double around = turning * Radius;
      const double speed = std::hypot(advancing, around);
      // From the far end to the hand in small bends, each pressed by the force in it.
      constexpr int count = 200000;
      double axial = force;
      double torque = 0.1;
      for (int n = 0; n < count; ++n)
      {
        const double rubs = Exponent / count * std::abs(axial);
        axial += rubs * advancing / speed;
        torque += rubs * Radius * around / speed;
      }
      const HandLoad felt = friction.AtHand({ force, 0.1 }, advancing, turning);
      EXPECT_NEAR(felt.force, axial, 1e-5);
      EXPECT_NEAR(felt.torque, torque, 1e-5);
    }
  }
}

TEST(CatheterFriction, WorkIsHandedOnOrRubbedAway)
{
  const CatheterFriction friction(Exponent, Radius);
  for (const double force : { -2.0, -0.02, 0.02, 2.0 })
  {
    for (const double advancing : { -30.0, -2.0, 2.0, 30.0 })
    {
      for (const double turning : { -12.0, 0.0, 12.0 })
      {
        const HandLoad there{ force, 0.2 };
        const HandLoad felt = friction.AtHand(there, advancing, turning);
        const double lost =
          (felt.force - there.force) * advancing + (felt.torque - there.torque) * turning;
        EXPECT_GT(lost, 0.0);
        // Friction's power is that of the pressing force: between those of the forces at the two ends.
        const double speed = std::hypot(advancing, turning * Radius);
        const double most = std::max(std::abs(felt.force), std::abs(there.force));
        const double least = std::min(std::abs(felt.force), std::abs(there.force));
        EXPECT_LE(lost, Exponent * most * speed * (1.0 + 1e-9));
        EXPECT_GE(lost, Exponent * least * speed * (1.0 - 1e-9));
      }
    }
  }
}

TEST(CatheterFriction, AWireAtRestIsHeldByNothing)
{
  const HandLoad felt = CatheterFriction(Exponent, Radius).AtHand({ -0.3, 0.2 }, 0.0, 0.0);
  EXPECT_EQ(felt.force, -0.3);
  EXPECT_EQ(felt.torque, 0.2);
}
}
