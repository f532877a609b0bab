/**
 * @file SweepRescue.h
 * @brief What is done where a tree can not be swept as it is, so that the rest of it can.
 */
#ifndef DynamicCoronary_SweepRescue_h
#define DynamicCoronary_SweepRescue_h

#include "AdaptiveRemesher.h"
#include "SweepSurface.h"

namespace coronary
{
/// "R-PDA (group 4)"; "group 4" where the group has no name.
std::string VesselName(const VesselTree& tree, int groupId);

/// "(12.5, -3, 40.1)"
std::string SweepPlace(const Vector3& position);

/// Adds what was changed with its sentence.
void AddRepair(std::vector<SweepRepair>& repairs, std::vector<std::string>& remarks,
  const VesselTree& tree, int groupId, const std::string& what, const Vector3& place);

/// Adds what is missing with its sentence, which says what helps.
void AddLeftOut(std::vector<SweepLeftOut>& leftOut, std::vector<std::string>& remarks,
  const VesselTree& tree, int groupId, const std::string& reason, const Vector3& place,
  double length);

/// Two vessels that run through each other without joining; the tree can not be swept with both.
struct SweepCollision
{
  int groups[2];
  Vector3 places[2]; ///< on the axes, mm
  double reach;      ///< mm, the sum of the radii there
};

/// What a cut takes away.
struct SweepCut
{
  std::vector<SweepLeftOut> parts; ///< one a branch, without reasons
  double length = 0.0;             ///< of all, mm
  bool atRoot = false;             ///< the part before the place, with the inlet
};

/**
 * Cuts a branch before a place, and takes away all that hangs on the part behind it. A place near
 * the root of a tree, or near its only branch's start, takes away the part before it instead.
 *
 * @param groupId  of the branch; its point nearest to the place counts
 * @param reach    so far from the place nothing of the branch stays, mm
 * @return what was taken away, never nothing while the group has a branch
 */
SweepCut CutTree(VesselTree& tree, int groupId, const Vector3& place, double reach);

/// Triangles with what belongs to them, as a remesher leaves them.
struct RescueMesh
{
  std::vector<RemeshVertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<int> entity;
  std::vector<unsigned char> replaced; ///< per vertex: beside triangles that were not there before
};

/**
 * Takes out triangles that are folded, cut others or have no area, closes what that opens and
 * betters thin ones (CleanSurface), where the rest must stay what it was.
 *
 * @param components  closed surfaces that it must have before and after
 * @return whether the result has passed the tetrahedral mesher's check, has all caps, no handles and
 *         about the same volume, and no angle below `minimumAngle` degrees; else the mesh is unchanged
 */
bool CleanSweptMesh(RescueMesh& mesh, int components, double minimumAngle);

/// Cells at which the tetrahedral mesher would refuse the surface; empty when it would not.
std::vector<std::int64_t> CellsThatFail(
  const std::vector<Vector3>& points, const std::vector<Triangle>& triangles);
}

#endif
