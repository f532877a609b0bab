/**
 * @file vtkSimVascularForms.h
 * @brief Trees as SimVascular has them: one merged centerline with point arrays, or paths with contours.
 *
 * The centerline is what SimVascular extracts for its 0D and 1D simulations (svZeroDSolver, svOneDSolver): one connected
 * line of two-point cells, upstream end first. Point arrays: `BranchId` (from 0, -1 in a bifurcation), `BifurcationId` (from
 * 0, -1 in a branch), `CenterlineId` (a component for each outlet: 1 on the way there), `Path` (length from the beginning of
 * the branch), `GlobalNodeId` (0 at the inlet), `MaximumInscribedSphereRadius`, `CenterlineSectionArea`,
 * `CenterlineSectionNormal`, `CenterlineSectionMinSize`, `CenterlineSectionMaxSize`, `CenterlineSectionShape`,
 * `CenterlineSectionClosed`.
 */
#ifndef vtkSimVascularForms_h
#define vtkSimVascularForms_h

#include "SimVascularFile.h"

#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <string>
#include <vector>

namespace coronary
{
/// Whether lines have a `BranchId` and a `BifurcationId` at their points.
bool IsSimVascularCenterline(vtkPolyData* lines);

/**
 * A tree as SimVascular's centerline. Branches that have one daughter only go on in it. A bifurcation is the fork and, of the
 * daughters, what is nearer to it than the parent's radius; where points are too few, some are added on the straight lines
 * between them.
 * @param tree  as of vtkCoronaryTreeTopology: one tree
 * @param unit  of the result, in mm: 1, or 10 for centimetres
 * @throws std::runtime_error when there are several trees; std::invalid_argument naming the missing array
 */
vtkSmartPointer<vtkPolyData> ToSimVascular(vtkPolyData* tree, double unit);

/**
 * The tree of a SimVascular centerline, root at `GlobalNodeId` 0. Radii are `MaximumInscribedSphereRadius`, else those of
 * circles of `CenterlineSectionArea`.
 * @throws std::invalid_argument naming the missing array, or the loop
 */
vtkSmartPointer<vtkPolyData> FromSimVascular(vtkPolyData* lines, double unit);

/// Of one vessel, from a root or a fork along its widest daughters.
struct SimVascularVessel
{
  std::string name;
  SimVascularPath path;
  SimVascularContourGroup contours;
};

/// A path and circles for each vessel; names are those of the vessels' first segments, fit for files.
std::vector<SimVascularVessel> VesselsOf(vtkPolyData* tree, double unit);

/// A path as a polyline. @param radius  in mm
vtkSmartPointer<vtkPolyData> LineOf(
  const SimVascularPath& path, const std::string& name, double radius, double unit);

/// The line through the middles of the contours, with their radii. @throws std::runtime_error for less than two
vtkSmartPointer<vtkPolyData> LineOf(const SimVascularContourGroup& contours, double unit);
}

#endif
