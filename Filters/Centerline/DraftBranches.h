/**
 * @file DraftBranches.h
 * @brief The branches of a graph without closed ways, before they are a tree: twigs can still be cut off.
 */
#ifndef DynamicCoronary_DraftBranches_h
#define DynamicCoronary_DraftBranches_h

#include "LineGraph.h"

namespace coronary
{
/// A branch while the tree is being made: graph vertices and links by index.
struct DraftBranch
{
  std::vector<int> vertices;
  int parent = -1;
  std::vector<int> daughters;
  int tree = 0;
  bool alive = true;
};

/// Adds the branches of the piece that a root is in.
void DraftTree(const LineGraph& graph, int root, int tree, std::vector<DraftBranch>& drafts);

/**
 * Removes the shortest twig, joins what it parted, and so on until none is too short.
 * @param ratio   see TopologySettings::pruneRatio
 * @param count   how many were removed is added
 * @param length  mm that were removed are added
 */
void Prune(const LineGraph& graph, double ratio, std::vector<DraftBranch>& drafts, int& count,
  double& length);

/// Those that are left, parents first.
std::vector<int> LivingDrafts(const std::vector<DraftBranch>& drafts);
}

#endif
