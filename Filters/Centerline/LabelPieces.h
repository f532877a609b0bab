/**
 * @file LabelPieces.h
 * @brief Trees in short pieces that get one name each, near the size of a heart in mm; for SegmentLabeling.
 */
#ifndef DynamicCoronary_LabelPieces_h
#define DynamicCoronary_LabelPieces_h

#include "CenterlineTopology.h"
#include "CoronaryAnatomy.h"
#include "SegmentAtlas.h"

#include <cstddef>
#include <limits>
#include <vector>

namespace coronary
{
// All lengths are millimetres of the mean heart.
constexpr double PositionDeviation = 8.0;      ///< of a vessel's course between individuals
constexpr double MaximumObservationCost = 4.5; ///< greatest cost of an observation

enum class TreeSide
{
  Left,
  Right,
  Neither
};

/// A short piece of a branch.
struct LabelPiece
{
  int branch = 0;
  std::size_t first = 0; ///< index in the branch's points; the first point belongs to the piece
  std::size_t last = 0;  ///< before it, except at a root
  double length = 0.0;
  int parent = -1;
  std::vector<int> children;
  bool startsBranch = false;
  std::size_t firstSample = 0;
  std::size_t lastSample = 0; ///< one past
};

struct LabelSample
{
  Vector3 position;
  Vector3 tangent;
  double weight;
  int tree;
};

/// y = matrix x + shift, from the trees' coordinates (centred, in units near mm) to the atlas'.
struct AtlasPose
{
  Matrix3 matrix = Matrix3::Identity();
  Vector3 shift = Vector3::Zero();
  Vector3 Apply(const Vector3& x) const { return this->matrix * x + this->shift; }
};

/// One name a piece.
struct LabelAssignment
{
  std::vector<Vessel> vessels; ///< one a piece
  std::vector<TreeSide> sides;
  Dominance dominance = Dominance::Right;
  double cost = std::numeric_limits<double>::infinity();
};

struct LabelPieces
{
  /// @param tree  with a branch; must outlive this
  explicit LabelPieces(const CenterlineTopology& tree);

  Vector3 centre = Vector3::Zero();
  double unit = 1.0;              ///< of the input, in mm or near it
  std::vector<LabelPiece> pieces; ///< children have higher indices than their parents
  std::vector<LabelSample> samples;
  std::vector<std::vector<int>> roots; ///< first pieces of every tree
  std::vector<double> treeLength;
  std::vector<Vector3> rootPosition;
  std::vector<double> below;                     ///< length of a piece and of all that hangs on it
  std::vector<const Bifurcation*> bifurcationOf; ///< of a branch's end

private:
  void Normalise(const CenterlineTopology& tree);
  void Cut(const CenterlineTopology& tree);
};
}

#endif
