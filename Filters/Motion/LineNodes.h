/**
 * @file LineNodes.h
 * @brief Evenly spaced nodes on lines, as a rooted forest.
 */
#ifndef DynamicCoronary_LineNodes_h
#define DynamicCoronary_LineNodes_h

#include "PoseSequence.h"

#include <vector>

namespace coronary
{
/// Nodes at every end and meeting of lines, and between them evenly.
struct LineNodes
{
  /// Where a point of the lines is: the fraction of the way from one node to another.
  struct Place
  {
    int first = 0;
    int second = 0;
    double fraction = 0.0;
  };

  std::vector<Vector3> position; ///< at rest, mm
  std::vector<Vector3> tangent;  ///< unit, at rest
  std::vector<double> radius;    ///< mm; empty when the lines have none
  std::vector<int> parent;       ///< per node: towards the root of its tree, -1 at a root
  std::vector<double> step;      ///< per node: mm along the line to the parent
  std::vector<int> order;        ///< every node after its parent
  std::vector<Place> points;     ///< per point of the lines

  std::size_t size() const { return this->position.size(); }

  /// Values at the points of the lines out of values at the nodes, linear between them.
  template <typename Value>
  std::vector<Value> AtPoints(const std::vector<Value>& values) const
  {
    std::vector<Value> result;
    result.reserve(this->points.size());
    for (const Place& place : this->points)
    {
      result.push_back(
        values[place.first] * (1.0 - place.fraction) + values[place.second] * place.fraction);
    }
    return result;
  }
};

/**
 * Points that are on no line stand alone, as trees of one node. Of a ring of lines one step has no
 * effect: a forest has none.
 * @param spacing  greatest distance of neighbouring nodes along the lines, mm
 * @throws std::invalid_argument  as CheckPolylines
 */
LineNodes PlaceNodes(const Polylines& lines, double spacing);
}

#endif
