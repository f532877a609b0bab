#include "PhantomComposition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <vector>

namespace coronary
{
namespace
{
// Whole numbers of samples fit into pixels, and of pixels into blocks.
constexpr double Step = 0.1;        // mm
constexpr int BlockSamples = 15;    // 1.5 mm
constexpr int PixelSamples = 5;     // 0.5 mm
constexpr int SliceSamples = 30;    // 3 mm
constexpr double Unenhanced = 45.0; // HU of blood and wall without contrast

struct Cone
{
  PhantomTube tube;
  PartLayer layer;
};

bool Contains(const PhantomTube& tube, const Vector3& p)
{
  const Vector3 axis = tube.end - tube.start;
  const Vector3 offset = p - tube.start;
  const double u = offset.dot(axis) / std::max(1e-12, axis.squaredNorm());
  if (u >= 0.0 && u <= 1.0)
  {
    const double radius = tube.startRadius + u * (tube.endRadius - tube.startRadius);
    return (offset - u * axis).squaredNorm() < radius * radius;
  }
  return tube.round && offset.squaredNorm() < tube.startRadius * tube.startRadius;
}

/// Samples of calcium in a pixel of a slice: slice, row, column.
using Pixels = std::map<std::array<int, 3>, int>;

struct Tally
{
  std::array<std::int64_t, 5> samples{}; ///< of each layer
  Pixels calcium;
};

int FloorOf(double value)
{
  return static_cast<int>(std::floor(value));
}

/// Whole samples below zero go down, too.
int PartOfWhole(int sample, int size)
{
  return FloorOf((sample + 0.5) / size);
}

/// Adds what lies in a block of samples.
void CountBlock(const std::array<int, 3>& block, const std::vector<Cone>& cones,
  const PhantomLumen& lumen, Tally& tally)
{
  const Vector3 centre =
    (Vector3(block[0], block[1], block[2]) + Vector3::Constant(0.5)) * (BlockSamples * Step);
  const double ball = 0.5 * std::sqrt(3.0) * BlockSamples * Step;
  std::vector<const Cone*> near;
  for (const Cone& cone : cones)
  {
    const PhantomTube& tube = cone.tube;
    const double reach =
      ball + std::max(tube.startRadius, tube.endRadius) + 0.5 * (tube.end - tube.start).norm();
    if ((0.5 * (tube.start + tube.end) - centre).squaredNorm() < reach * reach)
    {
      near.push_back(&cone);
    }
  }
  for (int n = 0; !near.empty() && n < BlockSamples * BlockSamples * BlockSamples; ++n)
  {
    const int i = block[0] * BlockSamples + n % BlockSamples;
    const int j = block[1] * BlockSamples + n / BlockSamples % BlockSamples;
    const int k = block[2] * BlockSamples + n / (BlockSamples * BlockSamples);
    const Vector3 p = Step * (Vector3(i, j, k) + Vector3::Constant(0.5));
    int top = -1;
    for (const Cone* cone : near)
    {
      if (static_cast<int>(cone->layer) > top && Contains(cone->tube, p))
      {
        top = static_cast<int>(cone->layer);
      }
    }
    if (top < 0 || lumen.Evaluate(p).distance < 0.0)
    {
      continue;
    }
    ++tally.samples[top];
    if (top == static_cast<int>(PartLayer::Calcium))
    {
      ++tally.calcium[{
        PartOfWhole(k, SliceSamples), PartOfWhole(j, PixelSamples), PartOfWhole(i, PixelSamples) }];
    }
  }
}

double Agatston(const Pixels& calcium, double hounsfield)
{
  constexpr double whole = PixelSamples * PixelSamples * SliceSamples;
  constexpr double pixelArea = PixelSamples * Step * PixelSamples * Step; // mm^2
  std::map<std::array<int, 3>, double> bright;
  for (const auto& [pixel, samples] : calcium)
  {
    const double value = Unenhanced + (hounsfield - Unenhanced) * samples / whole;
    if (value >= 130.0)
    {
      bright[pixel] = value;
    }
  }
  double score = 0.0;
  while (!bright.empty())
  {
    // What hangs together in a slice.
    std::vector<std::array<int, 3>> open{ bright.begin()->first };
    double peak = bright.begin()->second;
    bright.erase(bright.begin());
    double area = 0.0;
    while (!open.empty())
    {
      const std::array<int, 3> at = open.back();
      open.pop_back();
      area += pixelArea;
      for (const auto& [dj, di] : { std::array<int, 2>{ 0, 1 }, { 0, -1 }, { 1, 0 }, { -1, 0 } })
      {
        const auto next = bright.find({ at[0], at[1] + dj, at[2] + di });
        if (next != bright.end())
        {
          peak = std::max(peak, next->second);
          open.push_back(next->first);
          bright.erase(next);
        }
      }
    }
    const double weight = peak < 200.0 ? 1.0 : peak < 300.0 ? 2.0 : peak < 400.0 ? 3.0 : 4.0;
    score += area >= 1.0 ? weight * area : 0.0;
  }
  return score;
}
}

void MeasureComposition(const PhantomAnatomy& anatomy, const PhantomLumen& lumen, int lesion,
  int spot, PhantomLesionTruth& truth)
{
  std::vector<Cone> cones;
  for (const PhantomPart& part : anatomy.parts)
  {
    if (part.lesion == lesion && part.layer != PartLayer::Metal)
    {
      std::vector<PhantomTube> tubes;
      part.Place([](const Vector3& rest) { return rest; }, 0.0, tubes);
      for (const PhantomTube& tube : tubes)
      {
        cones.push_back({ tube, part.layer });
      }
    }
  }
  if (spot >= 0)
  {
    const Plaque& ball = anatomy.plaques[spot];
    cones.push_back({ { ball.centre, ball.centre, ball.radius, ball.radius, true,
                        PhantomTissue::Calcified, ball.value, false },
      PartLayer::Calcium });
  }
  if (cones.empty())
  {
    return;
  }
  int low[3];
  int count[3];
  for (int axis = 0; axis < 3; ++axis)
  {
    double first = cones.front().tube.start[axis];
    double last = first;
    for (const Cone& cone : cones)
    {
      const double r = std::max(cone.tube.startRadius, cone.tube.endRadius);
      first = std::min({ first, cone.tube.start[axis] - r, cone.tube.end[axis] - r });
      last = std::max({ last, cone.tube.start[axis] + r, cone.tube.end[axis] + r });
    }
    low[axis] = FloorOf(first / (BlockSamples * Step));
    count[axis] = FloorOf(last / (BlockSamples * Step)) - low[axis] + 1;
  }
  Tally total;
  std::mutex mutex;
  ParallelFor(static_cast<std::int64_t>(count[1]) * count[2], 1,
    [&](std::int64_t first, std::int64_t last)
    {
      Tally tally;
      for (std::int64_t row = first; row < last; ++row)
      {
        for (int i = 0; i < count[0]; ++i)
        {
          CountBlock({ low[0] + i, low[1] + static_cast<int>(row % count[1]),
                       low[2] + static_cast<int>(row / count[1]) },
            cones, lumen, tally);
        }
      }
      const std::lock_guard<std::mutex> lock(mutex);
      for (std::size_t layer = 0; layer < tally.samples.size(); ++layer)
      {
        total.samples[layer] += tally.samples[layer];
      }
      for (const auto& [pixel, samples] : tally.calcium)
      {
        total.calcium[pixel] += samples;
      }
    });
  const auto volume = [&](PartLayer layer)
  { return Step * Step * Step * static_cast<double>(total.samples[static_cast<int>(layer)]); };
  truth.fibrousVolume = volume(PartLayer::Wall) + volume(PartLayer::Rim);
  truth.lipidVolume = volume(PartLayer::Core);
  truth.calciumVolume = volume(PartLayer::Calcium);
  truth.agatston = Agatston(total.calcium, truth.lesion.calciumValue);
}
}
