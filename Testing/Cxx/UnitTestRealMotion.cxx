// A real heart: lines carried on its epicardial surface, every other frame held out, frames lost.
#include "MeasuredHeart.h"
#include "MotionRegularization.h"
#include "PhaseInterpolation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <queue>
#include <random>
#include <string>

namespace UnitTestRealMotion
{
using coronary::PhaseInterpolation;
using coronary::PhaseInterpolationMode;
using coronary::PhaseInterpolationSettings;
using coronary::Polylines;
using coronary::PoseSequence;
using coronary::Vector3;

namespace
{
constexpr int Frames = coronary::MeasuredFrames;

struct Surface
{
  std::vector<Vector3> points;
  std::vector<std::vector<int>> neighbours;
};

bool Read(int frame, Surface& surface)
{
  coronary::HeartSurface heart;
  if (!coronary::ReadHeartSurface(
        DYNAMICCORONARY_DATA_DIR "/biv-motion", "EPICARDIAL", frame, heart))
  {
    return false;
  }
  surface.points = std::move(heart.points);
  surface.neighbours.resize(surface.points.size());
  for (const coronary::Triangle& corner : heart.triangles)
  {
    for (int n = 0; n < 3; ++n)
    {
      const auto a = static_cast<int>(corner[n]);
      const auto b = static_cast<int>(corner[(n + 1) % 3]);
      surface.neighbours[a].push_back(b);
      surface.neighbours[b].push_back(a);
    }
  }
  return true;
}

/// Along edges, the shortest way.
std::vector<int> Path(const Surface& surface, int from, int to)
{
  std::vector<double> distance(surface.points.size(), std::numeric_limits<double>::infinity());
  std::vector<int> before(surface.points.size(), -1);
  std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>>
    front;
  distance[from] = 0.0;
  front.emplace(0.0, from);
  while (!front.empty())
  {
    const auto [length, at] = front.top();
    front.pop();
    for (const int next : surface.neighbours[at])
    {
      const double longer = length + (surface.points[next] - surface.points[at]).norm();
      if (length <= distance[at] && longer < distance[next])
      {
        distance[next] = longer;
        before[next] = at;
        front.emplace(longer, next);
      }
    }
  }
  std::vector<int> path;
  for (int at = to; at >= 0; at = before[at])
  {
    path.insert(path.begin(), at);
  }
  return path;
}

/// Lines over the heart, from its base to its apex and around, at all frames. A node is a mean of points of
/// the surface, always the same ones.
bool RealMotion(Polylines& lines, PoseSequence& motion)
{
  std::vector<Surface> frames(Frames);
  for (int k = 0; k < Frames; ++k)
  {
    if (!Read(k, frames[k]) || frames[k].points.size() != frames[0].points.size())
    {
      return false;
    }
    motion.times.push_back(static_cast<double>(k) / Frames);
    motion.points.emplace_back();
  }
  // Ends: the points that are farthest out in twelve directions from the middle.
  const Surface& first = frames[0];
  Vector3 middle = Vector3::Zero();
  for (const Vector3& point : first.points)
  {
    middle += point / static_cast<double>(first.points.size());
  }
  std::vector<int> ends;
  for (int n = 0; n < 12; ++n)
  {
    const double height = 1.0 - (2.0 * n + 1.0) / 12.0;
    const double angle = 2.399963 * n;
    const double radius = std::sqrt(1.0 - height * height);
    const Vector3 direction(radius * std::cos(angle), radius * std::sin(angle), height);
    int farthest = -1;
    for (std::size_t p = 0; p < first.points.size(); ++p)
    {
      if (!first.neighbours[p].empty() &&
        (farthest < 0 ||
          (first.points[p] - middle).dot(direction) >
            (first.points[farthest] - middle).dot(direction)))
      {
        farthest = static_cast<int>(p);
      }
    }
    ends.push_back(farthest);
  }
  constexpr int Window = 4;
  for (std::size_t n = 0; n + 1 < ends.size(); n += 2)
  {
    const std::vector<int> path = Path(first, ends[n], ends[n + 1]);
    if (path.size() < 3 * Window)
    {
      continue;
    }
    lines.lines.emplace_back();
    for (std::size_t p = Window; p + Window < path.size(); ++p)
    {
      lines.lines.back().push_back(static_cast<std::int64_t>(motion.points[0].size()));
      for (int k = 0; k < Frames; ++k)
      {
        Vector3 mean = Vector3::Zero();
        double sum = 0.0;
        for (int w = -Window; w <= Window; ++w)
        {
          const double weight = Window + 1 - std::abs(w);
          mean +=
            weight * frames[k].points[path[p + Window - static_cast<std::size_t>(Window - w)]];
          sum += weight;
        }
        motion.points[k].emplace_back(mean / sum);
      }
    }
  }
  lines.points = motion.points[18]; // mid-diastole
  return lines.lines.size() >= 3;
}

struct Errors
{
  double mean = 0.0;
  double maximum = 0.0;
};

Errors ErrorsOf(
  const PhaseInterpolation& motion, const PoseSequence& truth, const std::vector<int>& frames)
{
  Errors errors;
  std::size_t count = 0;
  coronary::InterpolatedPose pose;
  for (const int k : frames)
  {
    motion.Evaluate(truth.times[k], pose);
    for (std::size_t n = 0; n < pose.points.size(); ++n)
    {
      const double error = (pose.points[n] - truth.points[k][n]).norm();
      errors.mean += error;
      errors.maximum = std::max(errors.maximum, error);
      ++count;
    }
  }
  errors.mean /= static_cast<double>(count);
  return errors;
}

PoseSequence Select(const PoseSequence& motion, int step, double noise)
{
  PoseSequence part;
  std::mt19937 random(5);
  std::normal_distribution<double> any(0.0, noise);
  for (int k = 0; k < Frames; k += step)
  {
    part.times.push_back(motion.times[k]);
    part.points.push_back(motion.points[k]);
    for (Vector3& point : part.points.back())
    {
      if (noise > 0.0)
      {
        point += Vector3(any(random), any(random), any(random));
      }
    }
  }
  return part;
}
}

/// The frames were fitted one by one to images: they scatter about the motion by some tenths of a mm. This is
/// the motion without that: few modes and harmonics, fitted to all frames.
PoseSequence Denoised(const PoseSequence& motion, coronary::LowNoiseFit& fit)
{
  PhaseInterpolationSettings settings;
  settings.mode = PhaseInterpolationMode::LowNoise;
  const PhaseInterpolation smooth(motion, settings);
  fit = smooth.Fit();
  PoseSequence result = motion;
  coronary::InterpolatedPose pose;
  for (int k = 0; k < Frames; ++k)
  {
    smooth.Evaluate(motion.times[k], pose);
    result.points[k] = pose.points;
  }
  return result;
}

TEST(RealMotion, HeldOutFrames)
{
  Polylines lines;
  PoseSequence raw;
  if (!RealMotion(lines, raw))
  {
    GTEST_SKIP() << "no data in " << DYNAMICCORONARY_DATA_DIR;
  }
  coronary::LowNoiseFit fit;
  const PoseSequence smooth = Denoised(raw, fit);
  double amplitude = 0.0;
  for (std::size_t n = 0; n < lines.points.size(); ++n)
  {
    double most = 0.0;
    for (int k = 0; k < Frames; ++k)
    {
      most = std::max(most, (raw.points[k][n] - raw.points[0][n]).norm());
    }
    amplitude += most / static_cast<double>(lines.points.size());
  }
  std::printf("%zu points on %zu lines, moving by %.1f mm on average; scatter of the frames %.2f "
              "mm rms, rank %d "
              "order %d ridge %g\n",
    lines.points.size(), lines.lines.size(), amplitude, fit.residual, fit.rank, fit.order,
    fit.ridge);
  const char* names[] = { "linear", "periodic cubic", "low noise" };
  const auto hold = [&](
                      const PoseSequence& motion, const char* what, double noise, Errors errors[3])
  {
    std::vector<int> out;
    for (int k = 1; k < Frames; k += 2)
    {
      out.push_back(k);
    }
    const PoseSequence known = Select(motion, 2, noise);
    for (int mode = 0; mode < 3; ++mode)
    {
      PhaseInterpolationSettings settings;
      settings.mode = static_cast<PhaseInterpolationMode>(mode);
      errors[mode] = ErrorsOf(PhaseInterpolation(known, settings), motion, out);
      std::printf("%s, noise %.1f mm an axis, %-14s mean %.3f greatest %.2f mm\n", what, noise,
        names[mode], errors[mode].mean, errors[mode].maximum);
    }
  };
  Errors frames[3];
  hold(raw, "frames as they are", 0.0, frames);
  Errors exact[3];
  hold(smooth, "motion without scatter", 0.0, exact);
  Errors noisy[3];
  hold(smooth, "motion without scatter", 0.3, noisy);
  Errors noisier[3];
  hold(smooth, "motion without scatter", 0.6, noisier);
  // Scatter is what the spline amplifies, and what few modes take away.
  EXPECT_LT(frames[2].mean, frames[1].mean);
  EXPECT_LT(frames[2].mean, 1.1 * frames[0].mean);
  EXPECT_LT(exact[1].mean, exact[0].mean);
  EXPECT_LT(exact[0].mean, 0.5);
  EXPECT_LT(noisy[2].mean, noisy[1].mean);
  EXPECT_LT(noisier[2].mean, 0.9 * noisier[0].mean);
  EXPECT_LT(noisier[2].mean, 0.8 * noisier[1].mean);
}

TEST(RealMotion, LostFramesAndLostPoints)
{
  Polylines lines;
  PoseSequence raw;
  if (!RealMotion(lines, raw))
  {
    GTEST_SKIP() << "no data in " << DYNAMICCORONARY_DATA_DIR;
  }
  coronary::LowNoiseFit fit;
  const PoseSequence motion = Denoised(raw, fit);
  lines.points = motion.points[18];
  PoseSequence spoiled = Select(motion, 1, 0.2);
  std::mt19937 random(9);
  std::normal_distribution<double> any(0.0, 4.0);
  for (int k = 0; k < Frames; ++k)
  {
    spoiled.confidence.emplace_back(lines.points.size(), 0.95);
    for (std::size_t n = 0; n < lines.points.size(); ++n)
    {
      // One systolic frame wholly, and 40 % in two others, in stretches.
      if (k == 8 || ((k == 6 || k == 11) && n % 20 < 8))
      {
        spoiled.points[k][n] += Vector3(any(random), any(random), any(random));
        spoiled.confidence[k][n] = 0.02;
      }
    }
  }
  const coronary::RegularizedMotion result = coronary::RegularizeMotion(spoiled, lines);
  double before = 0.0;
  double after = 0.0;
  double lostBefore = 0.0;
  double lostAfter = 0.0;
  double lost = 0.0;
  double moved = 0.0;
  double beyond = 0.0; ///< the tolerance of a noisy phase
  for (int k = 0; k < Frames; ++k)
  {
    for (std::size_t n = 0; n < lines.points.size(); ++n)
    {
      const double b = (spoiled.points[k][n] - motion.points[k][n]).norm();
      const double a = (result.poses.points[k][n] - motion.points[k][n]).norm();
      before += b;
      after += a;
      if (spoiled.confidence[k][n] < 0.5)
      {
        lostBefore += b;
        lostAfter += a;
        lost += 1.0;
      }
      else
      {
        moved = std::max(moved, (result.poses.points[k][n] - spoiled.points[k][n]).norm());
        beyond = std::max(beyond,
          (result.poses.points[k][n] - spoiled.points[k][n]).norm() - 0.3 - 3.0 * result.noise[k]);
      }
    }
  }
  const double all = static_cast<double>(Frames) * static_cast<double>(lines.points.size());
  std::printf(
    "regularised: all points %.3f -> %.3f mm, lost ones %.2f -> %.2f mm, tracked ones moved "
    "by %.2f mm at most, %d iterations, %d limits left\n",
    before / all, after / all, lostBefore / lost, lostAfter / lost, moved, result.iterations,
    static_cast<int>(result.violations));
  EXPECT_LE(beyond, 1e-9);
  EXPECT_LT(lostAfter / lost, 0.7);
  EXPECT_LT(after, 0.5 * before);
}
}
