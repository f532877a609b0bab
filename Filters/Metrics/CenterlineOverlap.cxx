#include "CenterlineOverlap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
using Measures = CenterlineOverlapMeasures;
constexpr double NaN = Measures::NaN;
constexpr double Infinite = std::numeric_limits<double>::infinity();
constexpr double LargestPairs = 4e10;   // 5 GB of directions
constexpr double LargestSamples = 2e8;  // of one side
constexpr double CoarseSteps = 10.0;    // of the spacing, to choose which paths are compared
constexpr std::int64_t LeafSamples = 8; // of the search tree

[[noreturn]] void Fail(const std::string& message)
{
  throw std::invalid_argument("Centerline overlap: " + message);
}

void CheckPoints(const std::vector<Vector3>& points, const char* side)
{
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    if (!points[i].allFinite())
    {
      Fail("point " + std::to_string(i) + " of the " + side + " is not finite");
    }
  }
}

void CheckRadius(
  const std::vector<double>& radius, std::size_t points, bool needed, const char* side)
{
  if (radius.size() != points && (needed || !radius.empty()))
  {
    Fail(std::string("the ") + side + " has " + std::to_string(radius.size()) + " radii for " +
      std::to_string(points) + " points");
  }
  for (std::size_t i = 0; i < radius.size(); ++i)
  {
    if (!(radius[i] >= 0.0 && std::isfinite(radius[i])))
    {
      Fail("the radius of point " + std::to_string(i) + " of the " + side +
        " is negative or not finite");
    }
  }
}

void CheckSet(const CenterlineSet& set, bool needRadius, const char* side)
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
        Fail("line " + std::to_string(l) + " of the " + side + " refers to point " +
          std::to_string(point) + ", which does not exist");
      }
    }
  }
}

// ---------------------------------------------------------------------------------------------
// Samples
// ---------------------------------------------------------------------------------------------

/// Points at equal steps along a polyline, and the polyline's end.
struct Samples
{
  std::vector<Vector3> points;
  std::vector<double> radius;         ///< empty: not known
  std::vector<double> extra;          ///< another value of the points, or empty
  std::vector<std::int64_t> ofVertex; ///< the sample nearest to each point of the polyline
  double length = 0.0;
  double spacing = 0.0;

  std::int64_t Count() const { return static_cast<std::int64_t>(this->points.size()); }

  /// What so many of the samples stand for.
  double LengthOf(std::int64_t samples) const
  {
    return this->points.empty()
      ? 0.0
      : this->length * static_cast<double>(samples) / static_cast<double>(this->Count());
  }
};

/// Nothing for a line of no length.
Samples Sample(const std::vector<Vector3>& points, const std::vector<double>& radius,
  const std::vector<double>& extra, double spacing)
{
  Samples samples;
  samples.spacing = spacing;
  std::vector<double> abscissa(points.size(), 0.0);
  for (std::size_t i = 1; i < points.size(); ++i)
  {
    abscissa[i] = abscissa[i - 1] + (points[i] - points[i - 1]).norm();
  }
  if (points.size() < 2 || !(abscissa.back() > 0.0))
  {
    return samples;
  }
  samples.length = abscissa.back();
  if (samples.length / spacing > LargestSamples)
  {
    Fail("a line of length " + std::to_string(samples.length) +
      " has too many samples of spacing " + std::to_string(spacing));
  }
  // What rounding leaves of a last step is no step.
  const auto steps = static_cast<std::int64_t>(std::ceil(samples.length / spacing - 1e-6));
  std::size_t segment = 0;
  for (std::int64_t n = 0; n <= steps; ++n)
  {
    const double s = n == steps ? samples.length : static_cast<double>(n) * spacing;
    while (segment + 2 < points.size() && abscissa[segment + 1] <= s)
    {
      ++segment;
    }
    const double width = abscissa[segment + 1] - abscissa[segment];
    const double f = width > 0.0 ? std::min(1.0, (s - abscissa[segment]) / width) : 1.0;
    const auto between = [=](const std::vector<double>& values)
    { return (1.0 - f) * values[segment] + f * values[segment + 1]; };
    samples.points.emplace_back((1.0 - f) * points[segment] + f * points[segment + 1]);
    if (!radius.empty())
    {
      samples.radius.push_back(between(radius));
    }
    if (!extra.empty())
    {
      samples.extra.push_back(between(extra));
    }
  }
  for (const double s : abscissa)
  {
    const auto n = static_cast<std::int64_t>(std::lround(s / spacing));
    const bool last = samples.length - s < 0.5 * (samples.length - (steps - 1) * spacing);
    samples.ofVertex.push_back(last ? steps : std::min(n, steps - 1));
  }
  return samples;
}

/// Drops the first `count` samples.
void DropFirst(Samples& samples, std::int64_t count)
{
  const auto drop = [=](auto& values)
  {
    if (!values.empty())
    {
      values.erase(values.begin(), values.begin() + count);
    }
  };
  samples.length -= static_cast<double>(count) * samples.spacing;
  drop(samples.points);
  drop(samples.radius);
  drop(samples.extra);
  for (std::int64_t& sample : samples.ofVertex)
  {
    sample -= count;
  }
}

/// Samples of the result that lie before its first way through the disc across the reference's
/// start.
std::int64_t SamplesBeforeStart(const Samples& reference, const Samples& result)
{
  const Vector3 start = reference.points[0];
  // Over one radius the direction is the vessel's; a first step may be noise.
  std::int64_t ahead = 1;
  while (
    ahead + 1 < reference.Count() && (reference.points[ahead] - start).norm() < reference.radius[0])
  {
    ++ahead;
  }
  const Vector3 direction = reference.points[ahead] - start;
  for (std::int64_t n = 1; n + 1 < result.Count(); ++n)
  {
    const double before = (result.points[n - 1] - start).dot(direction);
    const double after = (result.points[n] - start).dot(direction);
    if (before < 0.0 && after >= 0.0)
    {
      const double f = before / (before - after);
      const Vector3 crossing = (1.0 - f) * result.points[n - 1] + f * result.points[n];
      if ((crossing - start).norm() < 2.0 * reference.radius[0])
      {
        return n;
      }
    }
  }
  return 0;
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
std::vector<Connection> Correspond(
  const Samples& reference, const Samples& result, const ProgressCallback& progress)
{
  const std::int64_t rows = reference.Count();
  const std::int64_t columns = result.Count();
  if (static_cast<double>(rows) * static_cast<double>(columns) > LargestPairs)
  {
    Fail("lines of " + std::to_string(rows) + " and " + std::to_string(columns) +
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
  std::vector<double> cost(columns, Infinite);
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
    double left = i == 0 ? 0.0 : Infinite;
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

LineComparison CompareSamples(const Samples& reference, const Samples& result,
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

// ---------------------------------------------------------------------------------------------
// Search
// ---------------------------------------------------------------------------------------------

/// Samples of many lines, in a tree of boxes.
class SampleSearch
{
public:
  /// @param lines  stay where they are
  explicit SampleSearch(const std::vector<const Samples*>& lines)
    : Lines(lines)
  {
    for (std::size_t l = 0; l < lines.size(); ++l)
    {
      for (std::int64_t n = 0; n < lines[l]->Count(); ++n)
      {
        this->Items.push_back({ lines[l]->points[n],
          lines[l]->radius.empty() ? 0.0 : lines[l]->radius[n], static_cast<std::int32_t>(l), n });
      }
    }
    if (!this->Items.empty())
    {
      this->Nodes.reserve(this->Items.size() / 2 + 2);
      this->Build(0, static_cast<std::int64_t>(this->Items.size()));
    }
  }

  bool Empty() const { return this->Items.empty(); }

  struct Place
  {
    double distance = Infinite; ///< to the lines, not to their samples
    std::int32_t line = -1;
    std::int64_t sample = -1; ///< the nearest one
    double radius = 0.0;      ///< at the place
  };

  Place Nearest(const Vector3& p) const
  {
    std::int64_t best = -1;
    double bestSquare = Infinite;
    this->Visit(
      p, [&](const Node& node) { return node.box.squaredExteriorDistance(p) < bestSquare; },
      [&](std::int64_t item)
      {
        const double square = (this->Items[item].point - p).squaredNorm();
        if (square < bestSquare)
        {
          bestSquare = square;
          best = item;
        }
      });
    Place place;
    if (best < 0)
    {
      return place;
    }
    const Item& item = this->Items[best];
    const Samples& line = *this->Lines[item.line];
    place = { std::sqrt(bestSquare), item.line, item.sample, item.radius };
    for (const std::int64_t other : { item.sample - 1, item.sample + 1 })
    {
      if (other < 0 || other >= line.Count())
      {
        continue;
      }
      const Vector3 along = line.points[other] - item.point;
      const double square = along.squaredNorm();
      const double f =
        square > 0.0 ? std::clamp((p - item.point).dot(along) / square, 0.0, 1.0) : 0.0;
      const double distance = (item.point + f * along - p).norm();
      if (distance < place.distance)
      {
        place.distance = distance;
        place.radius = line.radius.empty() ? 0.0 : (1.0 - f) * item.radius + f * line.radius[other];
      }
    }
    return place;
  }

  /// Whether p lies within the radius of any sample.
  bool Inside(const Vector3& p) const
  {
    bool inside = false;
    this->Visit(
      p,
      [&](const Node& node)
      { return !inside && node.box.squaredExteriorDistance(p) <= node.radius * node.radius; },
      [&](std::int64_t item)
      {
        const double radius = this->Items[item].radius;
        inside = inside || (this->Items[item].point - p).squaredNorm() <= radius * radius;
      });
    return inside;
  }

private:
  struct Item
  {
    Vector3 point;
    double radius;
    std::int32_t line;
    std::int64_t sample;
  };
  struct Node
  {
    Eigen::AlignedBox3d box;
    double radius = 0.0; ///< the largest
    std::int64_t first = 0, last = 0;
    std::int32_t left = -1, right = -1;
  };

  std::int32_t Build(std::int64_t first, std::int64_t last)
  {
    const auto index = static_cast<std::int32_t>(this->Nodes.size());
    this->Nodes.emplace_back();
    Node node;
    node.first = first;
    node.last = last;
    for (std::int64_t i = first; i < last; ++i)
    {
      node.box.extend(this->Items[i].point);
      node.radius = std::max(node.radius, this->Items[i].radius);
    }
    if (last - first > LeafSamples)
    {
      int axis = 0;
      node.box.sizes().maxCoeff(&axis);
      const std::int64_t middle = (first + last) / 2;
      std::nth_element(this->Items.begin() + first, this->Items.begin() + middle,
        this->Items.begin() + last,
        [=](const Item& a, const Item& b) { return a.point[axis] < b.point[axis]; });
      node.left = this->Build(first, middle);
      node.right = this->Build(middle, last);
    }
    this->Nodes[index] = node;
    return index;
  }

  template <typename Wanted, typename Look>
  void Visit(const Vector3& p, const Wanted& wanted, const Look& look) const
  {
    if (this->Nodes.empty())
    {
      return;
    }
    std::array<std::int32_t, 128> stack;
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0)
    {
      const Node& node = this->Nodes[stack[--depth]];
      if (!wanted(node))
      {
        continue;
      }
      if (node.left < 0)
      {
        for (std::int64_t i = node.first; i < node.last; ++i)
        {
          look(i);
        }
        continue;
      }
      const double left = this->Nodes[node.left].box.squaredExteriorDistance(p);
      const double right = this->Nodes[node.right].box.squaredExteriorDistance(p);
      // The nearer one is looked at first.
      stack[depth++] = left < right ? node.right : node.left;
      stack[depth++] = left < right ? node.left : node.right;
    }
  }

  const std::vector<const Samples*> Lines;
  std::vector<Item> Items;
  std::vector<Node> Nodes;
};

// ---------------------------------------------------------------------------------------------
// Trees
// ---------------------------------------------------------------------------------------------

struct Positions
{
  bool operator()(const Vector3& a, const Vector3& b) const
  {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  }
};

/// How lines hang together, and their samples.
struct LineTree
{
  struct Line
  {
    int parent = -1;
    std::size_t place = 0; ///< where in the parent's list of points it begins
    bool isTip = true;     ///< nothing begins at its end
    Samples samples;
  };
  std::vector<Line> lines;
  std::vector<int> order; ///< parents first

  LineTree(const CenterlineSet& set, double spacing)
    : lines(set.lines.size())
  {
    double length = 0.0;
    for (std::size_t l = 0; l < set.lines.size(); ++l)
    {
      std::vector<Vector3> points;
      std::vector<double> radius;
      for (const std::int64_t point : set.lines[l])
      {
        points.push_back(set.points[point]);
        if (!set.radius.empty())
        {
          radius.push_back(set.radius[point]);
        }
      }
      this->lines[l].samples = Sample(points, radius, {}, spacing);
      length += this->lines[l].samples.length;
      if (length / spacing > LargestSamples)
      {
        Fail("the lines have too many samples of spacing " + std::to_string(spacing));
      }
    }
    this->FindParents(set);
  }

  bool Exists(int line) const { return !this->lines[line].samples.points.empty(); }

  /// Sample of the parent at which a line begins.
  std::int64_t ParentSample(int line) const
  {
    const Line& l = this->lines[line];
    return this->lines[l.parent].samples.ofVertex[l.place];
  }

  /// For each sample of each line, whether a radius is at least this there or downstream.
  std::vector<std::vector<char>> WideUpTo(double radius) const
  {
    std::vector<std::vector<char>> wide(this->lines.size());
    for (std::size_t l = 0; l < this->lines.size(); ++l)
    {
      for (const double r : this->lines[l].samples.radius)
      {
        wide[l].push_back(r >= radius ? 1 : 0);
      }
    }
    // From the tips up: daughters before their parents.
    for (auto l = this->order.rbegin(); l != this->order.rend(); ++l)
    {
      std::vector<char>& flags = wide[*l];
      for (std::size_t n = flags.size() - 1; n > 0; --n)
      {
        flags[n - 1] = flags[n - 1] != 0 || flags[n] != 0 ? 1 : 0;
      }
      if (this->lines[*l].parent >= 0 && flags[0] != 0)
      {
        wide[this->lines[*l].parent][this->ParentSample(*l)] = 1;
      }
    }
    return wide;
  }

  std::vector<const Samples*> AllSamples() const
  {
    std::vector<const Samples*> all;
    for (const Line& line : this->lines)
    {
      all.push_back(&line.samples);
    }
    return all;
  }

private:
  void FindParents(const CenterlineSet& set)
  {
    struct Use
    {
      int line;
      std::size_t place;
    };
    std::map<Vector3, std::vector<Use>, Positions> uses;
    for (std::size_t l = 0; l < set.lines.size(); ++l)
    {
      for (std::size_t i = 1; this->Exists(static_cast<int>(l)) && i < set.lines[l].size(); ++i)
      {
        uses[set.points[set.lines[l][i]]].push_back({ static_cast<int>(l), i });
      }
    }
    std::vector<std::vector<int>> daughters(this->lines.size());
    std::vector<char> visited(this->lines.size(), 0);
    std::vector<int> roots;
    for (std::size_t l = 0; l < set.lines.size(); ++l)
    {
      if (!this->Exists(static_cast<int>(l)))
      {
        continue;
      }
      const auto found = uses.find(set.points[set.lines[l].front()]);
      const Use* best = nullptr;
      if (found != uses.end())
      {
        for (const Use& use : found->second)
        {
          // A line's own points are no place to begin at.
          if (use.line != static_cast<int>(l) && best == nullptr)
          {
            best = &use;
          }
        }
      }
      if (best != nullptr)
      {
        this->lines[l].parent = best->line;
        this->lines[l].place = best->place;
      }
    }
    for (std::size_t l = 0; l < this->lines.size(); ++l)
    {
      // Lines that begin on each other in a circle: the first one met is a root.
      int top = static_cast<int>(l);
      for (std::size_t step = 0; this->lines[top].parent >= 0; ++step)
      {
        top = this->lines[top].parent;
        if (top == static_cast<int>(l) || step > this->lines.size())
        {
          if (top == static_cast<int>(l))
          {
            this->lines[l].parent = -1;
          }
          break;
        }
      }
    }
    for (std::size_t l = 0; l < this->lines.size(); ++l)
    {
      const int parent = this->lines[l].parent;
      if (parent >= 0)
      {
        daughters[parent].push_back(static_cast<int>(l));
        const bool atEnd = this->lines[l].place + 1 == set.lines[parent].size();
        this->lines[parent].isTip = this->lines[parent].isTip && !atEnd;
      }
      else if (this->Exists(static_cast<int>(l)))
      {
        roots.push_back(static_cast<int>(l));
      }
    }
    for (std::size_t next = 0; next < roots.size(); ++next)
    {
      this->order.push_back(roots[next]);
      roots.insert(roots.end(), daughters[roots[next]].begin(), daughters[roots[next]].end());
    }
  }
};

/// Copies the matches of samples to the input's points. Of a shared point the best counts.
void SpreadMatches(const std::vector<std::int64_t>& line, const Samples& samples,
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
    const Samples& samples = tree.lines[l].samples;
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

std::vector<Path> PathsOf(const CenterlineSet& set, const LineTree& tree)
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

Samples SamplePath(const CenterlineSet& set, const Path& path, double spacing)
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
  return Sample(points, radius, {}, spacing);
}
}

void CenterlineOverlapSettings::Validate() const
{
  const auto check = [](const char* name, double value, bool zero)
  {
    if (!std::isfinite(value) || value < 0.0 || (value == 0.0 && !zero))
    {
      Fail(std::string(name) + " must be " + (zero ? "0 or more" : "positive") + ", not " +
        std::to_string(value));
    }
  };
  check("the spacing", this->spacing, false);
  check("the relevant radius", this->relevantRadius, true);
  check("the least radius", this->leastRadius, true);
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
    Fail("there are " + std::to_string(observers.distance.size()) + " observer distances for " +
      std::to_string(reference.points.size()) + " points of the reference");
  }
  for (std::size_t i = 0; i < observers.distance.size(); ++i)
  {
    if (!(observers.distance[i] >= 0.0 && std::isfinite(observers.distance[i])))
    {
      Fail("observer distance " + std::to_string(i) + " is negative or not finite");
    }
  }
  LineOverlap overlap;
  overlap.reference.resize(reference.points.size());
  overlap.result.resize(result.points.size());
  const Samples a =
    Sample(reference.points, reference.radius, observers.distance, settings.spacing);
  Samples b = Sample(result.points, result.radius, {}, settings.spacing);
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
  const auto spread = [](const Samples& samples, const std::vector<CenterlinePointMatch>& matches,
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

TreeOverlap CompareCenterlineTrees(const CenterlineSet& reference, const CenterlineSet& result,
  const CenterlineOverlapSettings& settings, const ProgressCallback& progress)
{
  settings.Validate();
  CheckSet(reference, true, "reference");
  CheckSet(result, false, "result");
  const LineTree truth(reference, settings.spacing);
  const LineTree found(result, settings.spacing);
  const SampleSearch inTruth(truth.AllSamples());
  const SampleSearch inFound(found.AllSamples());
  const bool haveRadius = !result.radius.empty();
  constexpr std::int64_t grain = 256;

  // Connections of the reference.
  const std::size_t lineCount = truth.lines.size();
  std::vector<Tally> tallies(lineCount);
  std::vector<std::vector<CenterlinePointMatch>> truthMatches(lineCount);
  std::vector<std::vector<double>> foundRadius(lineCount);
  double work = 0.0;
  double done = 0.0;
  for (const LineTree* tree : { &truth, &found })
  {
    for (const LineTree::Line& line : tree->lines)
    {
      work += static_cast<double>(line.samples.Count());
    }
  }
  const auto forSamples = [&](const Samples& samples, const auto& body)
  {
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
      { return !progress || progress((done + fraction * count) / std::max(1.0, work)); });
    done += count;
  };
  for (std::size_t l = 0; l < lineCount; ++l)
  {
    const Samples& samples = truth.lines[l].samples;
    truthMatches[l].assign(samples.points.size(), { CenterlineMatch::FalseNegative, NaN });
    foundRadius[l].assign(samples.points.size(), NaN);
    if (inFound.Empty())
    {
      continue;
    }
    forSamples(samples,
      [&](std::int64_t n)
      {
        const SampleSearch::Place place = inFound.Nearest(samples.points[n]);
        const bool inside = place.distance <= samples.radius[n];
        truthMatches[l][n] = {
          inside ? CenterlineMatch::TruePositive : CenterlineMatch::FalseNegative, place.distance
        };
        foundRadius[l][n] = place.radius;
      });
  }

  const std::vector<std::vector<char>> relevant = truth.WideUpTo(settings.relevantRadius);
  const std::vector<std::vector<char>> counts = truth.WideUpTo(settings.leastRadius);

  // What can be reached from the roots without a miss.
  std::vector<std::vector<char>> reached(lineCount);
  std::vector<double> startAbscissa(lineCount, 0.0);
  for (const int l : truth.order)
  {
    const Samples& samples = truth.lines[l].samples;
    const int parent = truth.lines[l].parent;
    bool intact = true;
    if (parent >= 0)
    {
      const std::int64_t at = truth.ParentSample(l);
      intact = reached[parent][at] != 0;
      startAbscissa[l] = startAbscissa[parent] + static_cast<double>(at) * settings.spacing;
    }
    for (std::int64_t n = 0; n < samples.Count(); ++n)
    {
      const bool excused =
        startAbscissa[l] + static_cast<double>(n) * settings.spacing < settings.startLength;
      intact = intact && (excused || truthMatches[l][n].match == CenterlineMatch::TruePositive);
      reached[l].push_back(intact ? 1 : 0);
    }
  }

  for (const int l : truth.order)
  {
    const Samples& samples = truth.lines[l].samples;
    Tally& tally = tallies[l];
    for (std::int64_t n = 0; n < samples.Count(); ++n)
    {
      CenterlinePointMatch& match = truthMatches[l][n];
      if (counts[l][n] == 0)
      {
        match.match = CenterlineMatch::NotCompared;
        continue;
      }
      const bool right = match.match == CenterlineMatch::TruePositive;
      ++tally.referenceAll;
      tally.reference += right ? 1 : 0;
      tally.beforeError += reached[l][n];
      if (relevant[l][n] != 0)
      {
        ++tally.relevantAll;
        tally.relevant += right ? 1 : 0;
      }
      if (inFound.Empty())
      {
        continue;
      }
      tally.distance.Add(match.distance);
      if (relevant[l][n] != 0)
      {
        tally.distanceRelevant.Add(match.distance);
      }
      if (right)
      {
        tally.distanceInside.Add(match.distance);
        if (haveRadius && samples.radius[n] >= settings.relevantRadius)
        {
          tally.AddRadius(foundRadius[l][n] - samples.radius[n]);
        }
      }
    }
    tally.referenceLength = samples.LengthOf(tally.referenceAll);
    // The part before the error is nothing where nothing was found.
    tally.beforeError = tally.reference > 0 ? tally.beforeError : 0;
  }

  // Connections of the result.
  std::vector<std::vector<CenterlinePointMatch>> foundMatches(found.lines.size());
  Tally strays; // where there is no reference at all
  for (std::size_t l = 0; l < found.lines.size(); ++l)
  {
    const Samples& samples = found.lines[l].samples;
    foundMatches[l].assign(samples.points.size(), { CenterlineMatch::FalsePositive, NaN });
    if (inTruth.Empty())
    {
      strays.resultAll += samples.Count();
      strays.resultLength += samples.length;
      continue;
    }
    std::vector<SampleSearch::Place> places(samples.points.size());
    forSamples(samples,
      [&](std::int64_t n)
      {
        places[n] = inTruth.Nearest(samples.points[n]);
        const bool inside = inTruth.Inside(samples.points[n]);
        foundMatches[l][n] = { inside ? CenterlineMatch::TruePositive
                                      : CenterlineMatch::FalsePositive,
          places[n].distance };
      });
    for (std::int64_t n = 0; n < samples.Count(); ++n)
    {
      const SampleSearch::Place& place = places[n];
      CenterlinePointMatch& match = foundMatches[l][n];
      if (counts[place.line][place.sample] == 0)
      {
        match.match = CenterlineMatch::NotCompared;
        continue;
      }
      const bool right = match.match == CenterlineMatch::TruePositive;
      Tally& tally = tallies[place.line];
      ++tally.resultAll;
      tally.result += right ? 1 : 0;
      tally.resultLength += samples.LengthOf(1);
      tally.distance.Add(match.distance);
      const bool beyond = truth.lines[place.line].isTip &&
        place.sample + 1 == truth.lines[place.line].samples.Count() && !right;
      if (relevant[place.line][place.sample] != 0 && !beyond)
      {
        ++tally.relevantAll;
        tally.relevant += right ? 1 : 0;
        tally.distanceRelevant.Add(match.distance);
      }
      if (right)
      {
        tally.distanceInside.Add(match.distance);
        if (haveRadius && place.distance <= place.radius && place.radius >= settings.relevantRadius)
        {
          tally.AddRadius(samples.radius[n] - place.radius);
        }
      }
    }
  }

  TreeOverlap overlap;
  Tally total = strays;
  for (std::size_t l = 0; l < lineCount; ++l)
  {
    overlap.rows.push_back({ { static_cast<std::int64_t>(l) }, {}, tallies[l].Finish() });
    total.Add(tallies[l]);
  }
  overlap.total = total.Finish();
  overlap.reference.resize(reference.points.size());
  overlap.result.resize(result.points.size());
  for (std::size_t l = 0; l < lineCount; ++l)
  {
    SpreadMatches(reference.lines[l], truth.lines[l].samples, truthMatches[l], overlap.reference);
  }
  for (std::size_t l = 0; l < found.lines.size(); ++l)
  {
    SpreadMatches(result.lines[l], found.lines[l].samples, foundMatches[l], overlap.result);
  }
  overlap.longestFalse = LongestRun(found, foundMatches, CenterlineMatch::FalsePositive);
  overlap.longestMissed = LongestRun(truth, truthMatches, CenterlineMatch::FalseNegative);
  Report(progress, 1.0);
  return overlap;
}

TreeOverlap CompareCenterlinePaths(const CenterlineSet& reference, const CenterlineSet& result,
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
    Samples samples;
    std::unique_ptr<SampleSearch> search;

    Candidate(const CenterlineSet& set, const Path& path, double spacing)
      : samples(SamplePath(set, path, spacing))
      , search(std::make_unique<SampleSearch>(std::vector<const Samples*>{ &this->samples }))
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
    const Samples a = SamplePath(reference, truths[t], settings.spacing);
    // A path in another vessel is no result for this one.
    Samples b =
      best >= 0 && bestShare > 0.0 ? SamplePath(result, founds[best], settings.spacing) : Samples();
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
