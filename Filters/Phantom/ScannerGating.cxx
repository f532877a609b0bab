#include "ScannerGating.h"

#include "CounterRandom.h"
#include "Numbers.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
namespace
{
constexpr std::uint64_t BeatPurpose = 401;
constexpr std::uint64_t SlabPurpose = 402;
constexpr int BeatsBefore = 2;    ///< views of early phases begin in the beat before
constexpr int BeatsAfter = 3;     ///< and those of late ones end in the beat after
constexpr double EarlyBeat = 0.6; ///< an extrasystole's interval, share of the mean
constexpr double Settling = 0.1;  ///< share of a beat in which the heart takes its new place
constexpr double SegmentBlend =
  6.0; ///< degrees over which the views of one segment replace another's

std::string Milliseconds(double seconds)
{
  return std::to_string(std::lround(1000.0 * seconds)) + " ms";
}
}

ScannerSchedule::ScannerSchedule(
  const ScannerSettings& settings, double low, double high, double cycleLength)
  : Settings(settings)
  , Low(low)
  , High(high)
  , CycleLength(cycleLength)
  , ViewTime(settings.turnTime / settings.viewsPerTurn)
{
  settings.Validate();
  const double height = settings.SlabHeight();
  Require(settings.HalfScanTime() < cycleLength,
    "scanner: a half scan takes " + Milliseconds(settings.HalfScanTime()) +
      ", longer than the R-R interval of " + Milliseconds(cycleLength) + ": shorten turn_s");
  this->Step = (1.0 - settings.overlap) * height;
  this->Speed = settings.pitch * height / settings.turnTime;
  int count = 0;
  if (this->Speed > 0.0)
  {
    // A slice has to be before the detector in as many beats as there are segments, the longest ones too.
    const double longest = cycleLength * (1.0 + 2.0 * settings.beatDeviation);
    const double seen = settings.segments * longest + settings.HalfScanTime();
    const double greatest = settings.turnTime / seen;
    Require(settings.pitch <= greatest + 1e-9,
      "scanner: a pitch of " + std::to_string(settings.pitch) + " leaves holes: " +
        std::to_string(settings.segments) + " beats of up to " + Milliseconds(longest) +
        " and a half scan need pitch " + std::to_string(greatest) + " or less");
    const double feed = this->Speed * cycleLength;
    this->Top = high + feed * settings.segments;
    count = static_cast<int>(std::ceil((this->Top - low) / feed)) + settings.segments + 1;
  }
  else
  {
    this->Slabs =
      1 + std::max(0, static_cast<int>(std::ceil((high - low - height) / this->Step - 1e-9)));
    Require(
      this->Slabs <= 200, "scanner: the image takes more than 200 slabs: the rows are too few");
    this->Top = 0.5 * (low + high) + 0.5 * (this->Slabs - 1) * this->Step;
    count = this->Slabs * (settings.segments + 1);
  }
  Require(count <= 1000, "scanner: the image takes more than 1000 beats: the rows are too few");
  RandomStream random(settings.seed, BeatPurpose);
  RandomStream places(settings.seed, SlabPurpose);
  this->FirstAngle = places.Uniform(0.0, 2.0 * Pi);
  this->Beats.resize(count + BeatsBefore + BeatsAfter);
  for (ScannerBeat& beat : this->Beats)
  {
    beat.interval = cycleLength * (1.0 + settings.beatDeviation * random.Normal(2.0));
    for (int axis = 0; axis < 3; ++axis)
    {
      beat.shift[axis] = settings.heartShift * places.Normal(2.0);
    }
  }
  if (settings.extrasystole > 0 && settings.extrasystole <= count)
  {
    // The early beat, and the pause after it: together they last two beats.
    const std::size_t early = BeatsBefore + settings.extrasystole - 1;
    this->Beats[early].interval = EarlyBeat * cycleLength;
    this->Beats[early + 1].interval = (2.0 - EarlyBeat) * cycleLength;
  }
  double start = 0.0;
  for (int b = 0; b < BeatsBefore; ++b)
  {
    start -= this->Beats[b].interval;
  }
  for (ScannerBeat& beat : this->Beats)
  {
    beat.start = start;
    start += beat.interval;
  }
}

const ScannerBeat& ScannerSchedule::Beat(int number) const
{
  return this->Beats.at(number + BeatsBefore);
}

double ScannerSchedule::Phase(double seconds) const
{
  const auto after = std::upper_bound(this->Beats.begin() + 1, this->Beats.end(), seconds,
    [](double at, const ScannerBeat& beat) { return at < beat.start; });
  const ScannerBeat& beat = *(after - 1);
  return static_cast<double>(after - this->Beats.begin() - 1 - BeatsBefore) +
    (seconds - beat.start) / beat.interval;
}

Vector3 ScannerSchedule::Shift(double seconds) const
{
  const double phase = this->Phase(seconds) + BeatsBefore;
  const int last = static_cast<int>(this->Beats.size()) - 1;
  const int beat = std::clamp(static_cast<int>(std::floor(phase)), 0, last);
  // The place changes around the R peak.
  const double in = phase - beat;
  const int other = std::clamp(in < 0.5 ? beat - 1 : beat + 1, 0, last);
  const double away = std::min(1.0, (in < 0.5 ? in : 1.0 - in) / (0.5 * Settling));
  const double own = 0.5 + 0.5 * away * away * (3.0 - 2.0 * away);
  Vector3 shift = own * this->Beats[beat].shift + (1.0 - own) * this->Beats[other].shift;
  const double end = this->Beats[last - BeatsAfter].start + this->Beats[last - BeatsAfter].interval;
  shift[2] -= this->Settings.breathing * std::clamp(seconds / end, 0.0, 1.0);
  return shift;
}

double ScannerSchedule::Iodine(double seconds) const
{
  return std::pow(1.0 - this->Settings.contrastLoss, std::max(0.0, this->Phase(seconds)));
}

double ScannerSchedule::Table(double seconds) const
{
  if (this->Speed > 0.0)
  {
    return this->Top - this->Speed * seconds;
  }
  // Slab s is seen in beats s (segments + 1) and on; in the beat after them the table moves.
  const double slab =
    std::floor((this->Phase(seconds) + 0.5) / static_cast<double>(this->Settings.segments + 1));
  return this->Top - this->Step * std::clamp(slab, 0.0, static_cast<double>(this->Slabs - 1));
}

double ScannerSchedule::Angle(std::int64_t view, int tube) const
{
  const int quarter = this->Settings.viewsPerTurn / 4;
  return this->FirstAngle + static_cast<double>(view + tube * quarter) * this->Settings.ViewAngle();
}

double ScannerSchedule::Moment(int beat, double phase) const
{
  const ScannerBeat& one = this->Beat(beat);
  return one.start + phase * (this->Speed > 0.0 ? one.interval : this->CycleLength);
}

/// Every angle of a half scan from the beat, and the tube, that see it nearest to the wanted moment;
/// the half scan starts where these distances are smallest.
void ScannerSchedule::ChooseViews(GatedStack& stack, const std::vector<double>& moments) const
{
  const ScannerSettings& s = this->Settings;
  const std::int64_t turn = s.viewsPerTurn;
  const int count = s.HalfScanViews();
  struct Candidate
  {
    double centre; ///< in views
    int tube;
  };
  std::vector<Candidate> candidates;
  for (const double moment : moments)
  {
    for (int tube = 0; tube < s.sources; ++tube)
    {
      candidates.push_back({ moment / this->ViewTime, tube });
    }
  }
  const auto nearest = [&](std::int64_t position, const Candidate& candidate)
  {
    const std::int64_t base = position - candidate.tube * (turn / 4);
    return base +
      turn *
      std::llround((candidate.centre - static_cast<double>(base)) / static_cast<double>(turn));
  };
  // Square distances of all angles of a turn from the nearest moment.
  std::vector<double> cost(turn);
  std::vector<int> choice(turn);
  for (std::int64_t a = 0; a < turn; ++a)
  {
    cost[a] = std::numeric_limits<double>::max();
    for (std::size_t n = 0; n < candidates.size(); ++n)
    {
      const double away = static_cast<double>(nearest(a, candidates[n])) - candidates[n].centre;
      if (away * away < cost[a])
      {
        cost[a] = away * away;
        choice[a] = static_cast<int>(n);
      }
    }
  }
  std::int64_t start = 0;
  double least = std::numeric_limits<double>::max();
  for (std::int64_t first = 0; first < turn; ++first)
  {
    double sum = 0.0;
    for (int p = 0; p < count; ++p)
    {
      sum += cost[(first + p) % turn];
    }
    if (sum < least)
    {
      least = sum;
      start = first;
    }
  }
  stack.firstAngle = this->Angle(start, 0);
  const int blend = std::max(0, static_cast<int>(0.5 * SegmentBlend * Pi / 180.0 / s.ViewAngle()));
  std::vector<float> weights(candidates.size());
  for (int p = 0; p < count; ++p)
  {
    std::fill(weights.begin(), weights.end(), 0.0f);
    const int low = std::max(0, p - blend);
    const int high = std::min(count - 1, p + blend);
    for (int q = low; q <= high; ++q)
    {
      weights[choice[(start + q) % turn]] += 1.0f / static_cast<float>(high - low + 1);
    }
    for (std::size_t n = 0; n < candidates.size(); ++n)
    {
      if (weights[n] > 0.0f)
      {
        const std::int64_t number = nearest(start + p, candidates[n]);
        stack.views.push_back({ p, number, candidates[n].tube, weights[n] });
        stack.worst = std::max(stack.worst,
          this->ViewTime * std::abs(static_cast<double>(number) - candidates[n].centre));
      }
    }
  }
}

std::vector<GatedStack> ScannerSchedule::Stacks(double phase) const
{
  const int segments = this->Settings.segments;
  const int beats = static_cast<int>(this->Beats.size()) - BeatsBefore - BeatsAfter;
  std::vector<GatedStack> stacks;
  const int step = this->Speed > 0.0 ? 1 : segments + 1;
  for (int first = 0; first + segments <= beats; first += step)
  {
    GatedStack stack;
    std::vector<double> moments;
    for (int b = first; b < first + segments; ++b)
    {
      stack.beats.push_back(b);
      moments.push_back(this->Moment(b, phase));
      stack.centre += this->Speed > 0.0 ? this->Table(moments.back()) / segments : 0.0;
    }
    if (this->Speed <= 0.0)
    {
      const int slab = first / step;
      stack.centre = this->Top - this->Step * slab;
    }
    stack.middle = moments.front();
    stacks.push_back(std::move(stack));
    if (this->Speed > 0.0 && stacks.back().centre < this->Low)
    {
      break;
    }
  }
  // Stacks above the image are not needed but for the last of them.
  while (stacks.size() > 1 && stacks[1].centre >= this->High)
  {
    stacks.erase(stacks.begin());
  }
  for (GatedStack& stack : stacks)
  {
    std::vector<double> moments;
    for (const int beat : stack.beats)
    {
      moments.push_back(this->Moment(beat, phase));
    }
    this->ChooseViews(stack, moments);
  }
  return stacks;
}

std::vector<double> ScannerSchedule::Weights(const std::vector<GatedStack>& stacks, double z) const
{
  const double share = this->Settings.overlap / (1.0 - this->Settings.overlap);
  std::vector<double> weights(stacks.size(), 0.0);
  // From the first stack on: each border hands over what the stacks above have left.
  double rest = 1.0;
  for (std::size_t n = 0; n < stacks.size(); ++n)
  {
    double below = 0.0;
    if (n + 1 < stacks.size())
    {
      const double border = 0.5 * (stacks[n].centre + stacks[n + 1].centre);
      const double ramp = std::max(1e-3, share * (stacks[n].centre - stacks[n + 1].centre));
      below = std::clamp(0.5 - (z - border) / ramp, 0.0, 1.0);
    }
    weights[n] = rest * (1.0 - below);
    rest *= below;
  }
  return weights;
}
}
