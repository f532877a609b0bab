#include "CenterlineSamples.h"

#include <map>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double MaximumSamples = 2e8; // of one side

struct Positions
{
  bool operator()(const Vector3& a, const Vector3& b) const
  {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  }
};
}

void FailOverlap(const std::string& message)
{
  throw std::invalid_argument("Centerline overlap: " + message);
}

CenterlineSamples SampleLine(const std::vector<Vector3>& points, const std::vector<double>& radius,
  const std::vector<double>& extra, double spacing)
{
  CenterlineSamples samples;
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
  if (samples.length / spacing > MaximumSamples)
  {
    FailOverlap("a line of length " + std::to_string(samples.length) +
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

void DropFirst(CenterlineSamples& samples, std::int64_t count)
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

std::int64_t SamplesBeforeStart(const CenterlineSamples& reference, const CenterlineSamples& result)
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

LineTree::LineTree(const Polylines& set, double spacing)
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
    this->lines[l].samples = SampleLine(points, radius, {}, spacing);
    length += this->lines[l].samples.length;
    if (length / spacing > MaximumSamples)
    {
      FailOverlap("the lines have too many samples of spacing " + std::to_string(spacing));
    }
  }
  this->FindParents(set);
}

std::vector<std::vector<char>> LineTree::WideUpTo(double radius) const
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

void LineTree::FindParents(const Polylines& set)
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
}
