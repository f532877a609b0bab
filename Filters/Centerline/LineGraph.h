/**
 * @file LineGraph.h
 * @brief Centerlines as one graph: what runs together once, what nearly meets joined, closed ways cut open.
 */
#ifndef DynamicCoronary_LineGraph_h
#define DynamicCoronary_LineGraph_h

#include "CenterlineTopology.h"

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

namespace coronary
{
using GraphCell = std::array<std::int64_t, 3>;
struct GraphCellHash
{
  std::size_t operator()(const GraphCell& cell) const
  {
    std::uint64_t h = 0x9e3779b97f4a7c15ULL;
    for (const std::int64_t c : cell)
    {
      h = (h ^ static_cast<std::uint64_t>(c)) * 0xff51afd7ed558ccdULL;
      h ^= h >> 32;
    }
    return h;
  }
};

struct NearestEdge
{
  double distance = std::numeric_limits<double>::infinity();
  int from = -1; ///< vertices of the edge
  int to = -1;
  double fraction = 0.0; ///< from `from` to `to`
  bool Found() const { return this->from >= 0; }
  int Vertex() const { return this->fraction <= 0.5 ? this->from : this->to; }
};

/// The lines as one graph.
struct LineGraph
{
  std::vector<Vector3> points;
  std::vector<double> radius;
  std::vector<std::int64_t> source;
  std::vector<std::vector<int>> neighbours;
  std::vector<int> starts; ///< number of input lines that start at a vertex
  std::vector<int> others; ///< number of input lines that end there, pass or hang on it

  double cellSize = 1.0;
  std::unordered_map<GraphCell, std::vector<std::pair<int, int>>, GraphCellHash> edges;

  int AddVertex(const Vector3& p, double r, std::int64_t from);
  bool Linked(int a, int b) const;
  void Link(int a, int b);
  void Unlink(int a, int b);

  /// The nearest edge within `reach` that `accept` takes.
  NearestEdge FindNearest(
    const Vector3& p, double reach, const std::function<bool(int, int)>& accept) const;
};

/**
 * Puts lines into an empty graph one after the other, the longest first, each only where no line before it runs.
 * @param mergeRatio  see TopologySettings
 * @param radius      median of all, mm
 * @param progress    0 to 0.4
 * @returns the number of points that another line already had
 */
int InsertLines(LineGraph& graph, const Polylines& lines, double mergeRatio, double radius,
  const ProgressCallback& progress);

/// Ties pieces together whose ends nearly meet. @returns how many
int CloseGaps(LineGraph& graph, double gapRatio);

/// One root a piece: the given ones for the pieces that they are nearest to, the others by the direction of a piece's
/// lines or by calibre.
std::vector<int> FindRoots(const LineGraph& graph, const std::vector<Vector3>& given);

/**
 * Walks from the root by the way of least resistance, and cuts every closed way where the two
 * sides meet.
 * @param loops  the ways that were cut are added
 */
void CutLoops(LineGraph& graph, int root, std::vector<std::vector<int>>& loops);
}

#endif
