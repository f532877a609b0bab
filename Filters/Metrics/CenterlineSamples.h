/**
 * @file CenterlineSamples.h
 * @brief Centerlines as points at equal steps, how they hang together, and a search for the nearest.
 */
#ifndef DynamicCoronary_CenterlineSamples_h
#define DynamicCoronary_CenterlineSamples_h

#include "CenterlineOverlap.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace coronary
{
/// @throws std::invalid_argument
[[noreturn]] void FailOverlap(const std::string& message);

/// Points at equal steps along a polyline, and the polyline's end.
struct CenterlineSamples
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
CenterlineSamples SampleLine(const std::vector<Vector3>& points, const std::vector<double>& radius,
  const std::vector<double>& extra, double spacing);

/// Drops the first `count` samples.
void DropFirst(CenterlineSamples& samples, std::int64_t count);

/// CenterlineSamples of the result that lie before its first way through the disc across the reference's
/// start.
std::int64_t SamplesBeforeStart(
  const CenterlineSamples& reference, const CenterlineSamples& result);

/// CenterlineSamples of many lines, in a tree of boxes.
class SampleSearch
{
public:
  /// @param lines  stay where they are
  explicit SampleSearch(const std::vector<const CenterlineSamples*>& lines)
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
    double distance =
      std::numeric_limits<double>::infinity(); ///< to the lines, not to their samples
    std::int32_t line = -1;
    std::int64_t sample = -1; ///< the nearest one
    double radius = 0.0;      ///< at the place
  };

  Place Nearest(const Vector3& p) const
  {
    std::int64_t best = -1;
    double bestSquare = std::numeric_limits<double>::infinity();
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
    const CenterlineSamples& line = *this->Lines[item.line];
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
  static constexpr std::int64_t LeafItems = 8;
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
    if (last - first > LeafItems)
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

  const std::vector<const CenterlineSamples*> Lines;
  std::vector<Item> Items;
  std::vector<Node> Nodes;
};

/// How lines hang together, and their samples.
struct LineTree
{
  struct Line
  {
    int parent = -1;
    std::size_t place = 0; ///< where in the parent's list of points it begins
    bool isTip = true;     ///< nothing begins at its end
    CenterlineSamples samples;
  };
  std::vector<Line> lines;
  std::vector<int> order; ///< parents first

  LineTree(const Polylines& set, double spacing);

  bool Exists(int line) const { return !this->lines[line].samples.points.empty(); }

  /// Sample of the parent at which a line begins.
  std::int64_t ParentSample(int line) const
  {
    const Line& l = this->lines[line];
    return this->lines[l.parent].samples.ofVertex[l.place];
  }

  /// For each sample of each line, whether a radius is at least this there or downstream.
  std::vector<std::vector<char>> WideUpTo(double radius) const;

  std::vector<const CenterlineSamples*> AllSamples() const
  {
    std::vector<const CenterlineSamples*> all;
    for (const Line& line : this->lines)
    {
      all.push_back(&line.samples);
    }
    return all;
  }

private:
  void FindParents(const Polylines& set);
};
}

#endif
