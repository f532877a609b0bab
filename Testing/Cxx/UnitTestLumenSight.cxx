// What an image shows where lines are said to be: tubes of known middle and brightness.

#include "LumenSight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <stdexcept>
#include <vector>

namespace UnitTestLumenSight
{
using namespace coronary;

namespace
{
constexpr int Side = 80;
constexpr double Spacing = 0.25; // mm
constexpr double Bright = 300.0;
constexpr double Radius = 1.5; // mm

/// A tube along z whose brightness falls over 1 mm around its wall.
struct Tube
{
  std::vector<float> values;

  explicit Tube(double x, double bright = Bright)
  {
    for (int k = 0; k < Side; ++k)
    {
      for (int j = 0; j < Side; ++j)
      {
        for (int i = 0; i < Side; ++i)
        {
          const double r = std::hypot(Spacing * i - x, Spacing * j - 10.0);
          this->values.push_back(
            static_cast<float>(bright * std::clamp(Radius + 0.5 - r, 0.0, 1.0)));
        }
      }
    }
  }

  ScalarImage View() const
  {
    ScalarImage image;
    image.values = this->values.data();
    image.grid.extent = { 0, Side - 1, 0, Side - 1, 0, Side - 1 };
    image.grid.spacing = Vector3::Constant(Spacing);
    return image;
  }
};

/// A line along z at each x, of points 0.5 mm apart.
Polylines LinesAt(std::initializer_list<double> places)
{
  Polylines lines;
  for (const double x : places)
  {
    lines.lines.emplace_back();
    for (int n = 0; n <= 20; ++n)
    {
      lines.lines.back().push_back(static_cast<std::int64_t>(lines.points.size()));
      lines.points.emplace_back(x, 10.0, 5.0 + 0.5 * n);
      lines.radius.push_back(Radius);
    }
  }
  return lines;
}

TEST(LumenSight, HowFarBesideTheLumenIsAndHowBright)
{
  const Tube tube(10.0);
  const Polylines lines = LinesAt({ 10.0 });
  const LumenSight on = SeeLumens(tube.View(), lines, lines.points);
  const Polylines off = LinesAt({ 10.6 });
  const LumenSight beside = SeeLumens(tube.View(), off, off.points);
  ASSERT_EQ(on.beside.size(), lines.points.size());
  for (std::size_t p = 0; p < lines.points.size(); ++p)
  {
    EXPECT_NEAR(on.beside[p], 0.0, 0.03);
    EXPECT_NEAR(on.contrast[p], Bright, 1.0);
    EXPECT_NEAR(beside.beside[p], 0.6, 0.06);
    EXPECT_LT(beside.contrast[p], Bright - 1.0);
  }
}

TEST(LumenSight, WhereThereIsNoLumen)
{
  const Tube tube(5.0);
  const Polylines lines = LinesAt({ 5.0, 5.0, 14.0 });
  const LumenSight sight = SeeLumens(tube.View(), lines, lines.points);
  EXPECT_NEAR(sight.beside[0], 0.0, 0.03);
  EXPECT_EQ(sight.beside.back(), NoLumenBeside);
  EXPECT_NEAR(sight.contrast.back(), 0.0, 1e-6);

  const Tube nothing(5.0, 0.0);
  for (const double beside : SeeLumens(nothing.View(), lines, lines.points).beside)
  {
    EXPECT_EQ(beside, NoLumenBeside);
  }
}

TEST(LumenSight, EachPhaseInItsImage)
{
  const Tube still(10.0);
  const Tube moved(11.0);
  const Polylines lines = LinesAt({ 10.0 });
  PoseSequence poses;
  poses.times = { 0.2, 0.7 };
  poses.points = { lines.points, lines.points };
  const std::vector<LumenSight> sights =
    SeeLumens(lines, poses, [&](double time) { return time < 0.5 ? still.View() : moved.View(); });
  ASSERT_EQ(sights.size(), 2U);
  EXPECT_NEAR(sights[0].beside[10], 0.0, 0.03);
  EXPECT_NEAR(sights[1].beside[10], 1.0, 0.1);
}

TEST(LumenSight, RefusesOtherPoints)
{
  const Tube tube(10.0);
  const Polylines lines = LinesAt({ 10.0 });
  EXPECT_THROW(SeeLumens(tube.View(), lines, {}), std::invalid_argument);
}
}
}
