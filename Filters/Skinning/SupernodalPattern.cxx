#include "SupernodalPattern.h"

#include <amd.h>

#include <algorithm>
#include <new>
#include <numeric>

namespace coronary
{
namespace
{
using Index = std::int32_t;

/// Per row the columns of both triangles, in any order, without the diagonal.
struct Graph
{
  std::vector<SuiteSparse_long> offset;
  std::vector<SuiteSparse_long> column;

  Index Rows() const { return static_cast<Index>(this->offset.size()) - 1; }
};

Graph GraphOf(const SparseMatrix& matrix, const std::vector<Index>& rows)
{
  std::vector<Index> local(matrix.rows, -1);
  for (std::size_t i = 0; i < rows.size(); ++i)
  {
    local[rows[i]] = static_cast<Index>(i);
  }
  Graph graph;
  graph.offset.assign(1, 0);
  graph.offset.reserve(rows.size() + 1);
  for (const Index row : rows)
  {
    for (std::int64_t a = matrix.offset[row]; a < matrix.offset[row + 1]; ++a)
    {
      if (matrix.column[a] != row && local[matrix.column[a]] >= 0)
      {
        graph.column.push_back(local[matrix.column[a]]);
      }
    }
    graph.offset.push_back(static_cast<SuiteSparse_long>(graph.column.size()));
  }
  return graph;
}

Graph Permuted(const Graph& graph, const std::vector<Index>& order)
{
  std::vector<Index> place(order.size());
  for (std::size_t i = 0; i < order.size(); ++i)
  {
    place[order[i]] = static_cast<Index>(i);
  }
  Graph result;
  result.offset.assign(1, 0);
  result.offset.reserve(graph.offset.size());
  result.column.reserve(graph.column.size());
  for (const Index row : order)
  {
    for (SuiteSparse_long a = graph.offset[row]; a < graph.offset[row + 1]; ++a)
    {
      result.column.push_back(place[graph.column[a]]);
    }
    result.offset.push_back(static_cast<SuiteSparse_long>(result.column.size()));
  }
  return result;
}

std::vector<Index> MinimumDegreeOrder(const Graph& graph)
{
  std::vector<SuiteSparse_long> order(graph.Rows());
  std::iota(order.begin(), order.end(), 0);
  // It takes no null for an empty list.
  if (!graph.column.empty())
  {
    const auto status = amd_l_order(
      graph.Rows(), graph.offset.data(), graph.column.data(), order.data(), nullptr, nullptr);
    if (status != AMD_OK && status != AMD_OK_BUT_JUMBLED)
    {
      throw std::bad_alloc(); // what else can go wrong with a valid graph
    }
  }
  return { order.begin(), order.end() };
}

/// Per row the next one that it changes when it is eliminated, -1 at a root.
std::vector<Index> EliminationTree(const Graph& graph)
{
  std::vector<Index> parent(graph.Rows(), -1);
  std::vector<Index> ancestor(graph.Rows(), -1); // with shorter ways
  for (Index row = 0; row < graph.Rows(); ++row)
  {
    for (SuiteSparse_long a = graph.offset[row]; a < graph.offset[row + 1]; ++a)
    {
      auto at = static_cast<Index>(graph.column[a]);
      while (at != -1 && at < row)
      {
        const Index next = ancestor[at];
        ancestor[at] = row;
        if (next == -1)
        {
          parent[at] = row;
        }
        at = next;
      }
    }
  }
  return parent;
}

/// Daughters before their parents, those with the smallest weight first.
std::vector<Index> Postorder(const std::vector<Index>& parent, const std::vector<Index>& weight)
{
  const auto count = static_cast<Index>(parent.size());
  std::vector<Index> byWeight(count);
  std::iota(byWeight.begin(), byWeight.end(), 0);
  std::stable_sort(
    byWeight.begin(), byWeight.end(), [&](Index a, Index b) { return weight[a] > weight[b]; });
  // Lists of daughters, begun with the heaviest: each one goes before those that are there.
  std::vector<Index> head(count, -1);
  std::vector<Index> next(count, -1);
  Index roots = -1;
  for (const Index row : byWeight)
  {
    Index& list = parent[row] == -1 ? roots : head[parent[row]];
    next[row] = list;
    list = row;
  }
  std::vector<Index> order;
  order.reserve(count);
  std::vector<Index> stack;
  for (Index root = roots; root != -1; root = next[root])
  {
    stack.push_back(root);
    while (!stack.empty())
    {
      const Index row = stack.back();
      const Index daughter = head[row];
      if (daughter != -1)
      {
        head[row] = next[daughter];
        stack.push_back(daughter);
      }
      else
      {
        stack.pop_back();
        order.push_back(row);
      }
    }
  }
  return order;
}

/// Entries in the columns of the factor, with the diagonal, of a graph in a postorder of its tree.
std::vector<Index> ColumnCounts(const Graph& graph, const std::vector<Index>& parent)
{
  const Index count = graph.Rows();
  std::vector<Index> counts(count, 0);
  std::vector<Index> firstDescendant(count, -1);
  for (Index row = 0; row < count; ++row)
  {
    counts[row] = firstDescendant[row] == -1 ? 1 : 0; // a leaf
    for (Index at = row; at != -1 && firstDescendant[at] == -1; at = parent[at])
    {
      firstDescendant[at] = row;
    }
  }
  std::vector<Index> lastLeaf(count, -1); // of the tree of a row's entries
  std::vector<Index> maximum(count, -1);  // first descendant among these leaves
  std::vector<Index> ancestor(count);
  std::iota(ancestor.begin(), ancestor.end(), 0);
  for (Index column = 0; column < count; ++column)
  {
    if (parent[column] != -1)
    {
      --counts[parent[column]];
    }
    for (SuiteSparse_long a = graph.offset[column]; a < graph.offset[column + 1]; ++a)
    {
      const auto row = static_cast<Index>(graph.column[a]);
      if (row <= column || firstDescendant[column] <= maximum[row])
      {
        continue;
      }
      maximum[row] = firstDescendant[column];
      const Index before = lastLeaf[row];
      lastLeaf[row] = column;
      ++counts[column];
      if (before != -1)
      {
        // What both leaves have in common was counted twice.
        Index common = before;
        while (ancestor[common] != common)
        {
          common = ancestor[common];
        }
        for (Index at = before; at != common;)
        {
          const Index onwards = ancestor[at];
          ancestor[at] = common;
          at = onwards;
        }
        --counts[common];
      }
    }
    if (parent[column] != -1)
    {
      ancestor[column] = parent[column];
    }
  }
  for (Index column = 0; column < count; ++column)
  {
    if (parent[column] != -1)
    {
      counts[parent[column]] += counts[column];
    }
  }
  return counts;
}

/// Whether so many columns are worth so large a share of zeros: few columns cost more time than zeros.
bool WorthMerging(double width, double zeros, double entries)
{
  const double share = zeros / entries;
  return width <= 4.0 || zeros == 0.0 || (width <= 16.0 && share < 0.8) ||
    (width <= 48.0 && share < 0.1) || share < 0.05;
}

/// First rows of the supernodes, and the number of rows.
std::vector<Index> MergeColumns(const std::vector<Index>& parent, const std::vector<Index>& counts)
{
  const auto rows = static_cast<Index>(parent.size());
  std::vector<Index> daughters(rows, 0);
  for (const Index p : parent)
  {
    if (p != -1)
    {
      ++daughters[p];
    }
  }
  // Columns that have the same rows below.
  struct Node
  {
    Index first;
    double width;
    double height; ///< of the first column
    double zeros;
    Index parent; ///< node that the last column hangs on
  };
  std::vector<Node> nodes;
  std::vector<Index> nodeOf(rows);
  for (Index j = 0; j < rows; ++j)
  {
    const bool same =
      j > 0 && parent[j - 1] == j && counts[j - 1] == counts[j] + 1 && daughters[j] == 1;
    if (same)
    {
      nodes.back().width += 1.0;
    }
    else
    {
      nodes.push_back({ j, 1.0, static_cast<double>(counts[j]), 0.0, -1 });
    }
    nodeOf[j] = static_cast<Index>(nodes.size()) - 1;
  }
  const auto count = static_cast<Index>(nodes.size());
  for (Index s = 0; s < count; ++s)
  {
    const Index last = (s + 1 < count ? nodes[s + 1].first : rows) - 1;
    nodes[s].parent = parent[last] == -1 ? -1 : nodeOf[parent[last]];
  }
  // From the roots on: a node and the one after it, when it hangs on that (or on what was merged into it).
  std::vector<Index> into(count);
  std::iota(into.begin(), into.end(), 0);
  std::vector<char> gone(count, 0);
  for (Index s = count - 2; s >= 0; --s)
  {
    Index target = nodes[s].parent;
    while (target != -1 && into[target] != target)
    {
      target = into[target] = into[into[target]];
    }
    if (target != s + 1)
    {
      continue;
    }
    Node& node = nodes[s];
    const Node& next = nodes[s + 1];
    const double width = node.width + next.width;
    const double zeros = next.zeros + node.width * (next.height + node.width - node.height);
    const double entries = 0.5 * width * (width + 1.0) + width * (next.height - next.width);
    if (WorthMerging(width, zeros, entries))
    {
      node.height = node.width + next.height;
      node.width = width;
      node.zeros = zeros;
      into[s + 1] = s;
      gone[s + 1] = 1;
    }
  }
  std::vector<Index> first;
  for (Index s = 0; s < count; ++s)
  {
    if (!gone[s])
    {
      first.push_back(nodes[s].first);
    }
  }
  first.push_back(rows);
  return first;
}

/// Rows of every supernode: those of its columns, and those of the supernodes that hang on it.
void FindRows(const Graph& graph, SupernodalPattern& pattern)
{
  const Index supernodes = pattern.Supernodes();
  pattern.rowOffset.assign(1, 0);
  pattern.valueOffset.assign(1, 0);
  pattern.supernodeOf.resize(graph.Rows());
  for (Index s = 0; s < supernodes; ++s)
  {
    std::fill(pattern.supernodeOf.begin() + pattern.first[s],
      pattern.supernodeOf.begin() + pattern.first[s + 1], s);
  }
  std::vector<std::vector<Index>> daughters(supernodes);
  std::vector<Index> seen(graph.Rows(), -1);
  for (Index s = 0; s < supernodes; ++s)
  {
    const auto begin = static_cast<std::int64_t>(pattern.rows.size());
    const Index end = pattern.first[s + 1];
    const auto take = [&](Index row)
    {
      if (row >= end && seen[row] != s)
      {
        seen[row] = s;
        pattern.rows.push_back(row);
      }
    };
    for (Index j = pattern.first[s]; j < end; ++j)
    {
      pattern.rows.push_back(j);
    }
    for (Index j = pattern.first[s]; j < end; ++j)
    {
      for (SuiteSparse_long a = graph.offset[j]; a < graph.offset[j + 1]; ++a)
      {
        take(static_cast<Index>(graph.column[a]));
      }
    }
    for (const Index daughter : daughters[s])
    {
      for (std::int64_t a = pattern.rowOffset[daughter]; a < pattern.rowOffset[daughter + 1]; ++a)
      {
        take(pattern.rows[a]);
      }
    }
    std::sort(pattern.rows.begin() + begin, pattern.rows.end());
    const auto height = static_cast<std::int64_t>(pattern.rows.size()) - begin;
    const std::int64_t width = pattern.Width(s);
    if (height > width)
    {
      daughters[pattern.supernodeOf[pattern.rows[begin + width]]].push_back(s);
    }
    pattern.rowOffset.push_back(begin + height);
    pattern.valueOffset.push_back(pattern.valueOffset.back() + width * height);
  }
}

/// `order` composed with a later one.
std::vector<Index> Composed(const std::vector<Index>& order, const std::vector<Index>& later)
{
  std::vector<Index> result;
  result.reserve(order.size());
  for (const Index i : later)
  {
    result.push_back(order[i]);
  }
  return result;
}

/// An order and a postorder after it, that with the greatest columns last: and what it leads to.
struct Elimination
{
  std::vector<Index> order;
  Graph graph; ///< in that order
  std::vector<Index> parent;
  std::vector<Index> counts;
};

Elimination Eliminate(const Graph& given, std::vector<Index> order)
{
  Elimination result;
  result.order = std::move(order);
  result.graph = Permuted(given, result.order);
  std::vector<Index> weight(given.Rows(), 0);
  // Twice: the numbers of entries are found in a postorder, and say which one is best.
  for (int time = 0; time < 2; ++time)
  {
    const std::vector<Index> post = Postorder(EliminationTree(result.graph), weight);
    result.order = Composed(result.order, post);
    result.graph = Permuted(result.graph, post);
    result.parent = EliminationTree(result.graph);
    result.counts = ColumnCounts(result.graph, result.parent);
    weight = result.counts;
  }
  return result;
}
}

SupernodalPattern FindSupernodes(
  const SparseMatrix& matrix, const std::vector<std::int32_t>& rows, EliminationOrder order)
{
  const Graph graph = GraphOf(matrix, rows);
  std::vector<Index> begin(rows.size());
  std::iota(begin.begin(), begin.end(), 0);
  Elimination elimination = Eliminate(
    graph, order == EliminationOrder::FillReducing ? MinimumDegreeOrder(graph) : std::move(begin));
  SupernodalPattern pattern;
  pattern.order = std::move(elimination.order);
  pattern.first = MergeColumns(elimination.parent, elimination.counts);
  FindRows(elimination.graph, pattern);
  return pattern;
}

std::vector<std::int32_t> FillReducingOrder(const SparseMatrix& matrix)
{
  std::vector<Index> rows(matrix.rows);
  std::iota(rows.begin(), rows.end(), 0);
  const Graph graph = GraphOf(matrix, rows);
  return Eliminate(graph, MinimumDegreeOrder(graph)).order;
}
}
