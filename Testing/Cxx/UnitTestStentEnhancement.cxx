// The mean of frames that were laid over each other by two markers, in images whose answer is known.
#include "StentEnhancement.h"
#include "XrayAngiogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>
#include <vector>

namespace UnitTestStentEnhancement
{
using namespace coronary;

namespace
{
using Place = std::complex<double>;

constexpr int Size = 160;
constexpr double Noise = 12.0;
constexpr double Depth = 24.0; // of what goes with the markers, at its middle
constexpr double Width = 2.0;  // pixels, its standard deviation
/// Of it, from the first marker, in distances of the markers: beside their line.
const Place Struts(0.5, 0.2);

double Bump(const Place& p, const Place& middle)
{
  return std::exp(-0.5 * std::norm(p - middle) / (Width * Width));
}

/// Markers that wander and turn about the middle; a spot that goes with them, and a spot that stands still.
XrayAngiogram Wandering(int frames, double noise, double shrinkOfEighth = 1.0, bool stands = true)
{
  XrayAngiogram run;
  run.columns = run.rows = Size;
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (int n = 0; n < frames; ++n)
  {
    const double angle = 0.4 * std::sin(0.7 * n);
    const double length = 40.0 * (n % 8 == 7 ? shrinkOfEighth : 1.0);
    const Place first(62.0 + 9.0 * std::sin(1.1 * n), 78.0 + 12.0 * std::cos(0.9 * n));
    const Place between = std::polar(length, angle);
    XrayAngiogram::Frame frame;
    frame.markers = { { first.real(), first.imag() },
      { (first + between).real(), (first + between).imag() } };
    for (int row = 0; row < Size; ++row)
    {
      for (int column = 0; column < Size; ++column)
      {
        const Place p(column, row);
        const double value = 128.0 + noise * normal(random) -
          Depth * (Bump(p, first + Struts * between) + (stands ? Bump(p, Place(80.0, 60.0)) : 0.0));
        frame.pixels.push_back(
          static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))));
      }
    }
    run.frames.push_back(std::move(frame));
  }
  return run;
}

struct Seen
{
  Place darkest;      ///< pixel
  double depth = 0.0; ///< of it, below the mean of what is not near it
  double noise = 0.0; ///< standard deviation of that
};

Seen Look(const EnhancedStent& stent)
{
  const int side = stent.image.columns;
  const auto place = [side](std::size_t i) { return Place(i % side, i / side); };
  const auto least = std::min_element(stent.mean.begin(), stent.mean.end());
  Seen seen;
  seen.darkest = place(least - stent.mean.begin());
  double sum = 0.0;
  double squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < stent.mean.size(); ++i)
  {
    if (std::abs(place(i) - seen.darkest) > 0.1 * side)
    {
      sum += stent.mean[i];
      squares += stent.mean[i] * stent.mean[i];
      ++count;
    }
  }
  const double mean = sum / count;
  seen.noise = std::sqrt(squares / count - mean * mean);
  seen.depth = mean - *least;
  return seen;
}
}

TEST(StentEnhancement, WhatGoesWithTheMarkersStaysWhereItIs)
{
  const EnhancedStent stent = EnhanceStent(Wandering(32, 0.0), 256);
  EXPECT_EQ(stent.frames, 32);
  ASSERT_EQ(stent.image.columns, 256);
  EXPECT_NEAR(stent.scale, 3.0 * 40.0 / 256, 1e-6);
  const Seen seen = Look(stent);
  // The square is about the middle of the markers.
  EXPECT_NEAR(std::abs(seen.darkest - Place(127.5, 127.5)) * stent.scale, 0.2 * 40.0, 0.5);
  EXPECT_NEAR(seen.depth, Depth, 0.05 * Depth);
  // In the shown image it is black, and what stood still is not.
  const auto black = std::count_if(stent.image.values.begin(), stent.image.values.end(),
    [](std::uint8_t value) { return value < 20; });
  EXPECT_LT(black, 0.03 * 256 * 256);
  EXPECT_EQ(stent.image.values[static_cast<std::size_t>(seen.darkest.imag()) * 256 +
              static_cast<std::size_t>(seen.darkest.real())],
    0);
}

TEST(StentEnhancement, NoiseFadesAsTheRootOfTheFrames)
{
  const int frames = 32;
  const EnhancedStent stent = EnhanceStent(Wandering(frames, Noise, 1.0, false), 256);
  const Seen seen = Look(stent);
  // A bilinear value at a random place has (2/3)^2 of a pixel's variance.
  const double expected = Noise * 2.0 / 3.0 / std::sqrt(frames);
  std::printf("noise of %d frames: expected %.3f, %.3f\n", frames, expected, seen.noise);
  EXPECT_NEAR(seen.noise, expected, 0.1 * expected);
}

TEST(StentEnhancement, FramesThatDoNotFitAreLeftOut)
{
  EXPECT_EQ(EnhanceStent(Wandering(32, Noise, 0.95)).frames, 32);
  EXPECT_EQ(EnhanceStent(Wandering(32, Noise, 0.7)).frames, 28);
  XrayAngiogram run = Wandering(16, 0.0);
  run.frames[3].markers.pop_back();
  run.frames[5].markers[1] = { 1e9, 0.0 };
  EXPECT_EQ(EnhanceStent(run).frames, 14);
  run.shutterTop = 80; // hides the first marker of some
  const int seen = EnhanceStent(run).frames;
  EXPECT_LT(seen, 14);
  run.shutterTop = Size - 1;
  EXPECT_EQ(EnhanceStent(run).frames, 0);
  EXPECT_EQ(EnhanceStent(Wandering(7, 0.0)).frames, 0);
  EXPECT_TRUE(EnhanceStent(Wandering(7, 0.0)).image.values.empty());
  EXPECT_EQ(EnhanceStent(XrayAngiogram()).frames, 0);
}
}
