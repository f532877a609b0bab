/**
 * @file WallMotion.h
 * @brief The wall of the coronary arteries at any moment of the cycle.
 */
#ifndef DynamicCoronary_WallMotion_h
#define DynamicCoronary_WallMotion_h

#include "Geometry.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// The aorta, where it is known.
struct AortaAtRest
{
  std::vector<Vector3> points;     ///< mm, of its wall
  std::vector<Triangle> triangles; ///< closed, outwards
  std::vector<Vector3> axis;       ///< mm, from the valve to the diaphragm
};

/// What does not move: how the wall's points are connected, and where they belong.
struct WallTopology
{
  std::int64_t points = 0;
  std::vector<Triangle> triangles;    ///< closed with its caps, oriented outwards
  std::vector<int> entity;            ///< per triangle: 1 wall, 2.. caps (CellEntityIds)
  std::vector<int> group;             ///< per point: branch (GroupIds)
  std::vector<std::string> groupName; ///< per branch: name for people, "mLAD"; may be empty
  /// Axis of the vessels at rest, one polyline a branch, from its root on; index = branch.
  std::vector<std::vector<Vector3>> axis;
  std::vector<std::vector<double>> axisRadius; ///< mm, as axis
  std::vector<int> parent;                     ///< per branch: the one that it leaves, -1 at a root
  /// mm, as axis: of the vessel without its lesions; empty: not known.
  std::vector<std::vector<double>> axisReference;
  /// Degrees of the section that calcium takes, as axis; empty: none.
  std::vector<std::vector<double>> axisCalcium;
  /// MPa that the tissue bears which fills the vessel there, as axis; 0: open. Empty: no vessel is occluded.
  std::vector<std::vector<double>> axisOcclusion;
  std::shared_ptr<const AortaAtRest> aorta; ///< null: not known
};

/// Positions of the wall's points over the cycle. Periodic; any real phase is taken modulo 1.
class WallMotion
{
public:
  virtual ~WallMotion() = default;
  virtual const WallTopology& Topology() const = 0;

  /// @param positions  x, y, z of each point, mm; resized. Allocates nothing once it has been used before.
  virtual void Positions(double phase, std::vector<Vector3>& positions) = 0;

  /// Of the axis' points at a phase, branch by branch as in Topology, in one list; used for the catheter.
  virtual void AxisPositions(double phase, std::vector<Vector3>& positions) = 0;
};
}

#endif
