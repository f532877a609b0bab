#include "CenterlineOverlap.h"

#include "CenterlineSamples.h"
#include "Numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
using Measures = CenterlineOverlapMeasures;
constexpr double MaximumPairs = 4e10; // 5 GB of directions
constexpr double CoarseSteps = 10.0;  // of the spacing, to choose which paths are compared

void CheckPoints(const std::vector<Vector3>& points, const char* side)
{
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (!points[i].allFinite())
    {
      FailOverlap("point " + std::to_string(i) + " of the " + side + " is not finite");
    }
  }
}

void CheckRadius(
  const std::vector<double>& radius, std::size_t points, bool needed, const char* side)
{
  if (radius.size() != points && (needed || !radius.empty()))
  {
    FailOverlap(std::string("the ") + side + " has " + std::to_string(radius.size()) +
      " radii for " + std::to_string(points) + " points");
  }
  for (std::size_t i = 0; i < radius.size(); ++i)
  {
    if (!(radius[i] >= 0.0 && std::isfinite(radius[i])))
    {
      FailOverlap("the radius of point " + std::to_string(i) + " of the " + side +
        " is negative or not finite");
    }
  }
}

void CheckSet(const Polylines& set, bool needRadius, const char* side)
{
  CheckPoints(set.points, side);
  CheckRadius(set.radius, set.points.size(), needRadius, side);
  const auto count = static_cast<std::int64_t>(set.points.size());
  for (std::size_t l = 0; l < set.lines.size(); ++l)
  {
    for (const std::int64_t point : set.lines[l])
    {
      if (point < 0 || point >= count)
      {
        FailOverlap("line " + std::to_string(l) + " of the " + side + " refers to point " +
          std::to_string(point) + ", which does not exist");
      }
    }
  }
}

// ---------------------------------------------------------------------------------------------
// Sums that become measures
// ---------------------------------------------------------------------------------------------

struct Mean
{
  double sum = 0.0;
  std::int64_t count = 0;

  void Add(double value)
  {
    this->sum += value;
    ++this->count;
  }
  void Add(const Mean& other)
  {
    this->sum += other.sum;
    this->count += other.count;
  }
  double Value() const { return this->count > 0 ? this->sum / static_cast<double>(count) : NaN; }
};

struct Tally
{
  // Found or right, and all.
  std::int64_t reference = 0, referenceAll = 0;
  std::int64_t result = 0, resultAll = 0;
  std::int64_t relevant = 0, relevantAll = 0; ///< of both sides
  std::int64_t beforeError = 0;               ///< of the reference
  Mean distance, distanceInside, distanceRelevant;
  Mean radiusError, radiusBias;
  double referenceLength = 0.0, resultLength = 0.0;

  void Add(const Tally& other)
  {
    this->reference += other.reference;
    this->referenceAll += other.referenceAll;
    this->result += other.result;
    this->resultAll += other.resultAll;
    this->relevant += other.relevant;
    this->relevantAll += other.relevantAll;
    this->beforeError += other.beforeError;
    this->distance.Add(other.distance);
    this->distanceInside.Add(other.distanceInside);
    this->distanceRelevant.Add(other.distanceRelevant);
    this->radiusError.Add(other.radiusError);
    this->radiusBias.Add(other.radiusBias);
    this->referenceLength += other.referenceLength;
    this->resultLength += other.resultLength;
  }

  void AddRadius(double difference)
  {
    this->radiusError.Add(std::abs(difference));
    this->radiusBias.Add(difference);
  }

  Measures Finish() const
  {
    const auto share = [](std::int64_t part, std::int64_t all)
    { return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : NaN; };
    Measures m;
    m.foundReference = this->reference;
    m.missedReference = this->referenceAll - this->reference;
    m.rightResult = this->result;
    m.falseResult = this->resultAll - this->result;
    m.referenceLength = this->referenceLength;
    m.resultLength = this->resultLength;
    m.overlap = share(this->reference + this->result, this->referenceAll + this->resultAll);
    m.overlapToFirstError = share(this->beforeError, this->referenceAll);
    m.overlapRelevant = share(this->relevant, this->relevantAll);
    m.distance = this->distance.Value();
    m.distanceInside = this->distanceInside.Value();
    m.distanceRelevant = this->distanceRelevant.Value();
    m.radiusError = this->radiusError.Value();
    m.radiusBias = this->radiusBias.Value();
    return m;
  }
};

double OverlapScore(double overlap, double observer)
{
  if (!std::isfinite(overlap) || !std::isfinite(observer))
  {
    return NaN;
  }
  // The challenge prints percentages with one digit, and gives full marks to 100.0.
  if (overlap >= 0.9995)
  {
    return 100.0;
  }
  return overlap <= observer ? 50.0 * overlap / observer
                             : 50.0 + 50.0 * (overlap - observer) / (1.0 - observer);
}

double DistanceScore(double distance, double observer)
{
  if (distance <= observer)
  {
    return observer > 0.0 ? 100.0 - 50.0 * distance / observer : 100.0;
  }
  return 50.0 * observer / distance;
}

// ---------------------------------------------------------------------------------------------
// Two lines
// ---------------------------------------------------------------------------------------------

struct Connection
{
  std::int64_t reference, result;
  double length;
};

/// The ordered set of connections with the least sum of lengths, from the starts to the ends.
std::vector<Connection> Correspond(const CenterlineSamples& reference,
  const CenterlineSamples& result, const ProgressCallback& progress)
{
  const std::int64_t rows = reference.Count();
  const std::int64_t columns = result.Count();
  if (static_cast<double>(rows) * static_cast<double>(columns) > MaximumPairs)
  {
    FailOverlap("lines of " + std::to_string(rows) + " and " + std::to_string(columns) +
      " samples are too long to be compared; take a larger spacing");
  }
  std::vector<double> x(columns), y(columns), z(columns);
  for (std::int64_t j = 0; j < columns; ++j)
  {
    x[j] = result.points[j].x();
    y[j] = result.points[j].y();
    z[j] = result.points[j].z();
  }
  // Whether the best way to a pair comes along the result (else along the reference).
  std::vector<bool> alongResult(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  std::vector<double> cost(columns, Infinity);
  std::vector<double> length(columns);
  for (std::int64_t i = 0; i < rows; ++i)
  {
    const Vector3 p = reference.points[i];
    for (std::int64_t j = 0; j < columns; ++j)
    {
      const double dx = x[j] - p.x();
      const double dy = y[j] - p.y();
      const double dz = z[j] - p.z();
      length[j] = std::sqrt(dx * dx + dy * dy + dz * dz);
    }
    double left = i == 0 ? 0.0 : Infinity;
    auto bit = alongResult.begin() + i * columns;
    for (std::int64_t j = 0; j < columns; ++j, ++bit)
    {
      const bool along = left < cost[j];
      *bit = along;
      left = (along ? left : cost[j]) + length[j];
      cost[j] = left;
    }
    if (i % 64 == 0)
    {
      Report(progress, static_cast<double>(i) / static_cast<double>(rows));
    }
  }
  std::vector<Connection> connections;
  connections.reserve(rows + columns - 1);
  for (std::int64_t i = rows - 1, j = columns - 1;;)
  {
    connections.push_back({ i, j, (reference.points[i] - result.points[j]).norm() });
    if (i == 0 && j == 0)
    {
      break;
    }
    // The first row has no other row to come from, and the first column no other column.
    if (j > 0 && (i == 0 || alongResult[i * columns + j]))
    {
      --j;
    }
    else
    {
      --i;
    }
  }
  std::reverse(connections.begin(), connections.end());
  Report(progress, 1.0);
  return connections;
}

struct LineComparison
{
  Tally tally;
  CenterlineOverlapScores scores;
  std::vector<CenterlinePointMatch> reference, result; ///< one a sample
};

LineComparison CompareSamples(const CenterlineSamples& reference, const CenterlineSamples& result,
  const CenterlineOverlapSettings& settings, const ProgressCallback& progress)
{
  LineComparison comparison;
  Tally& tally = comparison.tally;
  const std::int64_t rows = reference.Count();
  const std::int64_t columns = result.Count();
  tally.referenceAll = rows;
  tally.resultAll = columns;
  tally.referenceLength = reference.length;
  tally.resultLength = result.length;
  comparison.reference.assign(rows, { CenterlineMatch::FalseNegative, NaN });
  comparison.result.assign(columns, { CenterlineMatch::FalsePositive, NaN });

  std::int64_t lastRelevant = -1;
  for (std::int64_t i = 0; i < rows; ++i)
  {
    lastRelevant = reference.radius[i] >= settings.relevantRadius ? i : lastRelevant;
  }
  // Where one side is missing there are no connections.
  const std::vector<Connection> connections =
    rows > 0 && columns > 0 ? Correspond(reference, result, progress) : std::vector<Connection>();

  Mean score, scoreInside, scoreRelevant;
  std::int64_t relevantColumns = 0;
  // Up to the first connection of the last relevant sample: what else is connected to it lies
  // beyond.
  bool relevantPart = lastRelevant >= 0;
  for (const Connection& c : connections)
  {
    const bool inside = c.length <= reference.radius[c.reference];
    for (CenterlinePointMatch* match :
      { &comparison.reference[c.reference], &comparison.result[c.result] })
    {
      match->match = inside ? CenterlineMatch::TruePositive : match->match;
      match->distance =
        std::isnan(match->distance) ? c.length : std::min(match->distance, c.length);
    }
    tally.distance.Add(c.length);
    if (inside)
    {
      tally.distanceInside.Add(c.length);
      if (!result.radius.empty() && reference.radius[c.reference] >= settings.relevantRadius)
      {
        tally.AddRadius(result.radius[c.result] - reference.radius[c.reference]);
      }
    }
    if (relevantPart)
    {
      tally.distanceRelevant.Add(c.length);
      relevantColumns = c.result + 1;
    }
    if (!reference.extra.empty())
    {
      const double value = DistanceScore(c.length, reference.extra[c.reference]);
      score.Add(value);
      if (inside)
      {
        scoreInside.Add(value);
      }
      if (relevantPart)
      {
        scoreRelevant.Add(value);
      }
    }
    relevantPart = relevantPart && c.reference < lastRelevant;
  }
  comparison.scores.distance = score.Value();
  comparison.scores.distanceInside = scoreInside.Value();
  comparison.scores.distanceRelevant = scoreRelevant.Value();

  tally.beforeError = rows;
  for (std::int64_t i = rows - 1; i >= 0; --i)
  {
    const bool found = comparison.reference[i].match == CenterlineMatch::TruePositive;
    tally.reference += found ? 1 : 0;
    if (i <= lastRelevant)
    {
      tally.relevant += found ? 1 : 0;
      ++tally.relevantAll;
    }
    if (!found && static_cast<double>(i) * settings.spacing >= settings.startLength)
    {
      tally.beforeError = i;
    }
  }
  // A line that was never found has no part before the error either.
  tally.beforeError = tally.reference > 0 ? tally.beforeError : 0;
  for (std::int64_t j = 0; j < columns; ++j)
  {
    const bool right = comparison.result[j].match == CenterlineMatch::TruePositive;
    tally.result += right ? 1 : 0;
    if (j < relevantColumns)
    {
      tally.relevant += right ? 1 : 0;
      ++tally.relevantAll;
    }
  }
  return comparison;
}

/// Copies the matches of samples to the input's points. Of a shared point the best counts.
void SpreadMatches(const std::vector<std::int64_t>& line, const CenterlineSamples& samples,
  const std::vector<CenterlinePointMatch>& matches, std::vector<CenterlinePointMatch>& points)
{
  for (std::size_t i = 0; i < samples.ofVertex.size(); ++i)
  {
    const std::int64_t sample = samples.ofVertex[i];
    if (sample < 0)
    {
      continue;
    }
    const CenterlinePointMatch& match = matches[sample];
    CenterlinePointMatch& point = points[line[i]];
    const bool better = point.match == CenterlineMatch::NotCompared ||
      (match.match == CenterlineMatch::TruePositive && match.match != point.match) ||
      (match.match == point.match && match.distance < point.distance);
    if (better)
    {
      point = match;
    }
  }
}

/// Longest way down the lines whose samples all are `which`.
double LongestRun(const LineTree& tree,
  const std::vector<std::vector<CenterlinePointMatch>>& matches, CenterlineMatch which)
{
  double longest = 0.0;
  std::vector<std::vector<double>> runs(tree.lines.size());
  for (const int l : tree.order)
  {
    const CenterlineSamples& samples = tree.lines[l].samples;
    double run = 0.0;
    if (tree.lines[l].parent >= 0)
    {
      run = runs[tree.lines[l].parent][tree.ParentSample(l)];
    }
    runs[l].resize(samples.points.size());
    for (std::int64_t n = 0; n < samples.Count(); ++n)
    {
      const bool is = matches[l][n].match == which;
      const double step = n > 0 ? (samples.points[n] - samples.points[n - 1]).norm() : 0.0;
      run = is ? run + step : 0.0;
      runs[l][n] = run;
      longest = std::max(longest, run);
    }
  }
  return longest;
}

/// One way from a root to a tip.
struct Path
{
  std::vector<std::int64_t> lines;
  std::vector<std::int64_t> points; ///< of the set
};

std::vector<Path> PathsOf(const Polylines& set, const LineTree& tree)
{
  std::vector<Path> paths;
  for (std::size_t l = 0; l < tree.lines.size(); ++l)
  {
    if (!tree.Exists(static_cast<int>(l)) || !tree.lines[l].isTip)
    {
      continue;
    }
    Path path;
    std::size_t end = set.lines[l].size();
    for (int line = static_cast<int>(l); line >= 0; line = tree.lines[line].parent)
    {
      path.lines.push_back(line);
      path.points.insert(path.points.end(),
        set.lines[line].rend() - static_cast<std::ptrdiff_t>(end), set.lines[line].rend());
      // With the point that both have: it may be two points at one place.
      end = tree.lines[line].place + 1;
    }
    std::reverse(path.lines.begin(), path.lines.end());
    std::reverse(path.points.begin(), path.points.end());
    paths.push_back(std::move(path));
  }
  return paths;
}

CenterlineSamples SamplePath(const Polylines& set, const Path& path, double spacing)
{
  std::vector<Vector3> points;
  std::vector<double> radius;
  for (const std::int64_t point : path.points)
  {
    points.push_back(set.points[point]);
    if (!set.radius.empty())
    {
      radius.push_back(set.radius[point]);
    }
  }
  return SampleLine(points, radius, {}, spacing);
}

/// The connections of two trees compared with each other.
class TreeComparison
{
public:
  TreeComparison(const Polylines& reference, const Polylines& result,
    const CenterlineOverlapSettings& settings, const ProgressCallback& progress);

  TreeOverlap Run();

private:
  template <typename Body>
  void ForSamples(const CenterlineSamples& samples, const Body& body);
  void MatchReference();
  void FindReached();
  void TallyReference();
  void MatchResult();
  TreeOverlap Finish() const;

  const Polylines& Reference;
  const Polylines& Result;
  const CenterlineOverlapSettings& Settings;
  const ProgressCallback& Progress;
  const LineTree Truth;
  const LineTree Found;
  const SampleSearch InTruth;
  const SampleSearch InFound;
  const bool HaveRadius;
  double Work = 0.0; ///< samples
  double Done = 0.0;
  std::vector<Tally> Tallies; ///< by connection of the reference
  Tally Strays;               ///< where there is no reference at all
  std::vector<std::vector<CenterlinePointMatch>> TruthMatches;
  std::vector<std::vector<CenterlinePointMatch>> FoundMatches;
  std::vector<std::vector<double>> FoundRadius;
  const std::vector<std::vector<char>> Relevant;
  const std::vector<std::vector<char>> Counts;
  std::vector<std::vector<char>> Reached; ///< from the roots without a miss
};

TreeComparison::TreeComparison(const Polylines& reference, const Polylines& result,
  const CenterlineOverlapSettings& settings, const ProgressCallback& progress)
  : Reference(reference)
  , Result(result)
  , Settings(settings)
  , Progress(progress)
  , Truth(reference, settings.spacing)
  , Found(result, settings.spacing)
  , InTruth(this->Truth.AllSamples())
  , InFound(this->Found.AllSamples())
  , HaveRadius(!result.radius.empty())
  , Tallies(this->Truth.lines.size())
  , TruthMatches(this->Truth.lines.size())
  , FoundMatches(this->Found.lines.size())
  , FoundRadius(this->Truth.lines.size())
  , Relevant(this->Truth.WideUpTo(settings.relevantRadius))
  , Counts(this->Truth.WideUpTo(settings.minimumRadius))
  , Reached(this->Truth.lines.size())
{
  for (const LineTree* tree : { &this->Truth, &this->Found })
  {
    for (const LineTree::Line& line : tree->lines)
    {
      this->Work += static_cast<double>(line.samples.Count());
    }
  }
}

TreeOverlap TreeComparison::Run()
{
  this->MatchReference();
  this->FindReached();
  this->TallyReference();
  this->MatchResult();
  return this->Finish();
}

template <typename Body>
void TreeComparison::ForSamples(const CenterlineSamples& samples, const Body& body)
{
  constexpr std::int64_t grain = 256;
  const auto count = static_cast<double>(samples.Count());
  ParallelFor(
    samples.Count(), grain,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t n = first; n < last; ++n)
      {
        body(n);
      }
    },
    [&](double fraction)
    {
      return !this->Progress ||
        this->Progress((this->Done + fraction * count) / std::max(1.0, this->Work));
    });
  this->Done += count;
}

void TreeComparison::MatchReference()
{
  for (std::size_t l = 0; l < this->Truth.lines.size(); ++l)
  {
    const CenterlineSamples& samples = this->Truth.lines[l].samples;
    this->TruthMatches[l].assign(samples.points.size(), { CenterlineMatch::FalseNegative, NaN });
    this->FoundRadius[l].assign(samples.points.size(), NaN);
    if (this->InFound.Empty())
    {
      continue;
    }
    this->ForSamples(samples,
      [&](std::int64_t n)
      {
        const SampleSearch::Place place = this->InFound.Nearest(samples.points[n]);
        const bool inside = place.distance <= samples.radius[n];
        this->TruthMatches[l][n] = {
          inside ? CenterlineMatch::TruePositive : CenterlineMatch::FalseNegative, place.distance
        };
        this->FoundRadius[l][n] = place.radius;
      });
  }
}

void TreeComparison::FindReached()
{
  std::vector<double> startAbscissa(this->Truth.lines.size(), 0.0);
  for (const int l : this->Truth.order)
  {
    const CenterlineSamples& samples = this->Truth.lines[l].samples;
    const int parent = this->Truth.lines[l].parent;
    bool intact = true;
    if (parent >= 0)
    {
      const std::int64_t at = this->Truth.ParentSample(l);
      intact = this->Reached[parent][at] != 0;
      startAbscissa[l] = startAbscissa[parent] + static_cast<double>(at) * this->Settings.spacing;
    }
    for (std::int64_t n = 0; n < samples.Count(); ++n)
    {
      const bool excused = startAbscissa[l] + static_cast<double>(n) * this->Settings.spacing <
        this->Settings.startLength;
      intact =
        intact && (excused || this->TruthMatches[l][n].match == CenterlineMatch::TruePositive);
      this->Reached[l].push_back(intact ? 1 : 0);
    }
  }
}

void TreeComparison::TallyReference()
{
  for (const int l : this->Truth.order)
  {
    const CenterlineSamples& samples = this->Truth.lines[l].samples;
    Tally& tally = this->Tallies[l];
    for (std::int64_t n = 0; n < samples.Count(); ++n)
    {
      CenterlinePointMatch& match = this->TruthMatches[l][n];
      if (this->Counts[l][n] == 0)
      {
        match.match = CenterlineMatch::NotCompared;
        continue;
      }
      const bool right = match.match == CenterlineMatch::TruePositive;
      ++tally.referenceAll;
      tally.reference += right ? 1 : 0;
      tally.beforeError += this->Reached[l][n];
      if (this->Relevant[l][n] != 0)
      {
        ++tally.relevantAll;
        tally.relevant += right ? 1 : 0;
      }
      if (this->InFound.Empty())
      {
        continue;
      }
      tally.distance.Add(match.distance);
      if (this->Relevant[l][n] != 0)
      {
        tally.distanceRelevant.Add(match.distance);
      }
      if (right)
      {
        tally.distanceInside.Add(match.distance);
        if (this->HaveRadius && samples.radius[n] >= this->Settings.relevantRadius)
        {
          tally.AddRadius(this->FoundRadius[l][n] - samples.radius[n]);
        }
      }
    }
    tally.referenceLength = samples.LengthOf(tally.referenceAll);
    // The part before the error is nothing where nothing was this->Found.
    tally.beforeError = tally.reference > 0 ? tally.beforeError : 0;
  }
}

void TreeComparison::MatchResult()
{
  for (std::size_t l = 0; l < this->Found.lines.size(); ++l)
  {
    const CenterlineSamples& samples = this->Found.lines[l].samples;
    this->FoundMatches[l].assign(samples.points.size(), { CenterlineMatch::FalsePositive, NaN });
    if (this->InTruth.Empty())
    {
      this->Strays.resultAll += samples.Count();
      this->Strays.resultLength += samples.length;
      continue;
    }
    std::vector<SampleSearch::Place> places(samples.points.size());
    this->ForSamples(samples,
      [&](std::int64_t n)
      {
        places[n] = this->InTruth.Nearest(samples.points[n]);
        const bool inside = this->InTruth.Inside(samples.points[n]);
        this->FoundMatches[l][n] = { inside ? CenterlineMatch::TruePositive
                                            : CenterlineMatch::FalsePositive,
          places[n].distance };
      });
    for (std::int64_t n = 0; n < samples.Count(); ++n)
    {
      const SampleSearch::Place& place = places[n];
      CenterlinePointMatch& match = this->FoundMatches[l][n];
      if (this->Counts[place.line][place.sample] == 0)
      {
        match.match = CenterlineMatch::NotCompared;
        continue;
      }
      const bool right = match.match == CenterlineMatch::TruePositive;
      Tally& tally = this->Tallies[place.line];
      ++tally.resultAll;
      tally.result += right ? 1 : 0;
      tally.resultLength += samples.LengthOf(1);
      tally.distance.Add(match.distance);
      const bool beyond = this->Truth.lines[place.line].isTip &&
        place.sample + 1 == this->Truth.lines[place.line].samples.Count() && !right;
      if (this->Relevant[place.line][place.sample] != 0 && !beyond)
      {
        ++tally.relevantAll;
        tally.relevant += right ? 1 : 0;
        tally.distanceRelevant.Add(match.distance);
      }
      if (right)
      {
        tally.distanceInside.Add(match.distance);
        if (this->HaveRadius && place.distance <= place.radius &&
          place.radius >= this->Settings.relevantRadius)
        {
          tally.AddRadius(samples.radius[n] - place.radius);
        }
      }
    }
  }
}

TreeOverlap TreeComparison::Finish() const
{
  TreeOverlap overlap;
  Tally total = this->Strays;
  for (std::size_t l = 0; l < this->Truth.lines.size(); ++l)
  {
    overlap.rows.push_back({ { static_cast<std::int64_t>(l) }, {}, this->Tallies[l].Finish() });
    total.Add(this->Tallies[l]);
  }
  overlap.total = total.Finish();
  overlap.reference.resize(this->Reference.points.size());
  overlap.result.resize(this->Result.points.size());
  for (std::size_t l = 0; l < this->Truth.lines.size(); ++l)
  {
    SpreadMatches(this->Reference.lines[l], this->Truth.lines[l].samples, this->TruthMatches[l],
      overlap.reference);
  }
  for (std::size_t l = 0; l < this->Found.lines.size(); ++l)
  {
    SpreadMatches(
      this->Result.lines[l], this->Found.lines[l].samples, this->FoundMatches[l], overlap.result);
  }
  overlap.longestFalse =
    LongestRun(this->Found, this->FoundMatches, CenterlineMatch::FalsePositive);
  overlap.longestMissed =
    LongestRun(this->Truth, this->TruthMatches, CenterlineMatch::FalseNegative);
  return overlap;
}
}

void CenterlineOverlapSettings::Validate() const
{
  const auto check = [](const char* name, double value, bool zero)
  {
    if (!std::isfinite(value) || value < 0.0 || (value == 0.0 && !zero))
    {
      FailOverlap(std::string(name) + " must be " + (zero ? "0 or more" : "positive") + ", not " +
        std::to_string(value));
    }
  };
  check("the spacing", this->spacing, false);
  check("the relevant radius", this->relevantRadius, true);
  check("the least radius", this->minimumRadius, true);
  check("the start length", this->startLength, true);
}

LineOverlap CompareCenterlines(const OverlapLine& reference, const OverlapLine& result,
  const CenterlineOverlapSettings& settings, const ObserverAgreement& observers,
  const ProgressCallback& progress)
{
  settings.Validate();
  CheckPoints(reference.points, "reference");
  CheckPoints(result.points, "result");
  CheckRadius(reference.radius, reference.points.size(), true, "reference");
  CheckRadius(result.radius, result.points.size(), false, "result");
  if (!observers.distance.empty() && observers.distance.size() != reference.points.size())
  {
    FailOverlap("there are " + std::to_string(observers.distance.size()) +
      " observer distances for " + std::to_string(reference.points.size()) +
      " points of the reference");
  }
  for (std::size_t i = 0; i < observers.distance.size(); ++i)
  {
    if (!(observers.distance[i] >= 0.0 && std::isfinite(observers.distance[i])))
    {
      FailOverlap("observer distance " + std::to_string(i) + " is negative or not finite");
    }
  }
  LineOverlap overlap;
  overlap.reference.resize(reference.points.size());
  overlap.result.resize(result.points.size());
  const CenterlineSamples a =
    SampleLine(reference.points, reference.radius, observers.distance, settings.spacing);
  CenterlineSamples b = SampleLine(result.points, result.radius, {}, settings.spacing);
  if (a.points.empty())
  {
    return overlap;
  }
  if (settings.clipStart && b.Count() > 1)
  {
    DropFirst(b, SamplesBeforeStart(a, b));
  }
  const LineComparison comparison = CompareSamples(a, b, settings, progress);
  overlap.measures = comparison.tally.Finish();
  overlap.scores = comparison.scores;
  overlap.scores.overlap = OverlapScore(overlap.measures.overlap, observers.overlap);
  overlap.scores.overlapToFirstError =
    OverlapScore(overlap.measures.overlapToFirstError, observers.overlapToFirstError);
  overlap.scores.overlapRelevant =
    OverlapScore(overlap.measures.overlapRelevant, observers.overlapRelevant);
  const auto spread = [](const CenterlineSamples& samples,
                        const std::vector<CenterlinePointMatch>& matches,
                        std::vector<CenterlinePointMatch>& points)
  {
    std::vector<std::int64_t> all(points.size());
    std::iota(all.begin(), all.end(), 0);
    SpreadMatches(all, samples, matches, points);
  };
  spread(a, comparison.reference, overlap.reference);
  spread(b, comparison.result, overlap.result);
  return overlap;
}

TreeOverlap CompareCenterlineTrees(const Polylines& reference, const Polylines& result,
  const CenterlineOverlapSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  CheckSet(reference, true, "reference");
  CheckSet(result, false, "result");
  TreeOverlap overlap = TreeComparison(reference, result, settings, progress).Run();
  Report(progress, 1.0);
  return overlap;
}

TreeOverlap CompareCenterlinePaths(const Polylines& reference, const Polylines& result,
  const CenterlineOverlapSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  CheckSet(reference, true, "reference");
  CheckSet(result, false, "result");
  const double coarse = CoarseSteps * settings.spacing;
  const std::vector<Path> truths = PathsOf(reference, LineTree(reference, coarse));
  const std::vector<Path> founds = PathsOf(result, LineTree(result, coarse));
  struct Candidate
  {
    CenterlineSamples samples;
    std::unique_ptr<SampleSearch> search;

    Candidate(const Polylines& set, const Path& path, double spacing)
      : samples(SamplePath(set, path, spacing))
      , search(
          std::make_unique<SampleSearch>(std::vector<const CenterlineSamples*>{ &this->samples }))
    {
    }
  };
  std::vector<std::unique_ptr<Candidate>> candidates;
  candidates.reserve(founds.size());
  for (const Path& path : founds)
  {
    candidates.push_back(std::make_unique<Candidate>(result, path, coarse));
  }

  TreeOverlap overlap;
  overlap.reference.resize(reference.points.size());
  overlap.result.resize(result.points.size());
  Tally total;
  for (std::size_t t = 0; t < truths.size(); ++t)
  {
    const auto part = [&](double fraction)
    {
      return !progress ||
        progress((static_cast<double>(t) + fraction) / static_cast<double>(truths.size()));
    };
    const Candidate truth(reference, truths[t], coarse);
    int best = -1;
    double bestShare = -1.0;
    for (std::size_t f = 0; f < candidates.size(); ++f)
    {
      const Candidate& found = *candidates[f];
      std::int64_t inside = 0;
      for (std::int64_t n = 0; n < truth.samples.Count(); ++n)
      {
        inside += found.search->Nearest(truth.samples.points[n]).distance <= truth.samples.radius[n]
          ? 1
          : 0;
      }
      for (const Vector3& p : found.samples.points)
      {
        inside += truth.search->Inside(p) ? 1 : 0;
      }
      const double share = static_cast<double>(inside) /
        static_cast<double>(truth.samples.Count() + found.samples.Count());
      if (share > bestShare)
      {
        bestShare = share;
        best = static_cast<int>(f);
      }
    }
    const CenterlineSamples a = SamplePath(reference, truths[t], settings.spacing);
    // A path in another vessel is no result for this one.
    CenterlineSamples b = best >= 0 && bestShare > 0.0
      ? SamplePath(result, founds[best], settings.spacing)
      : CenterlineSamples();
    if (settings.clipStart && b.Count() > 1)
    {
      DropFirst(b, SamplesBeforeStart(a, b));
    }
    const LineComparison comparison = CompareSamples(a, b, settings, part);
    total.Add(comparison.tally);
    TreeOverlapRow row;
    row.lines = truths[t].lines;
    row.measures = comparison.tally.Finish();
    SpreadMatches(truths[t].points, a, comparison.reference, overlap.reference);
    if (b.Count() > 0)
    {
      row.resultLines = founds[best].lines;
      SpreadMatches(founds[best].points, b, comparison.result, overlap.result);
    }
    overlap.rows.push_back(std::move(row));
  }
  overlap.total = total.Finish();
  Report(progress, 1.0);
  return overlap;
}
}
