/**
 * @file vtkVesselTree.h
 * @brief Poly data that hold a tree of centerlines: as a tree, or as VMTK's lines.
 */
#ifndef vtkVesselTree_h
#define vtkVesselTree_h

#include "CenterlineConversion.h"
#include "VesselTree.h"
#include "vtkCoronaryCommonModule.h" // for the export macro

#include <vector>

class vtkPolyData;

namespace vtkCoronary
{
enum class CenterlineForm
{
  Unknown,
  Tree, ///< one polyline a branch, with cell arrays `GroupIds` and `ParentGroupIds`
  Vmtk  ///< lines from a root to every tip, with `CenterlineIds`, `TractIds` and `GroupIds`
};

/// As the cell arrays tell. What has both kinds of arrays is a tree.
VTKCORONARYCOMMON_EXPORT CenterlineForm FormOf(vtkPolyData* data);

/// What is done about radii (vtkCoronary::FindRadius).
enum class Radii
{
  Needed,
  IfThere, ///< else 0
  Ignored  ///< 0
};

/**
 * Polylines as the branches of a tree; points keep their indices.
 * @throws std::invalid_argument naming the array that is missing or unfit, or as coronary::CheckTree
 */
VTKCORONARYCOMMON_EXPORT coronary::VesselTree TreeOf(
  vtkPolyData* data, Radii radii = Radii::Needed);

/**
 * Polylines as VMTK's tracts; `source` holds the indices of the points. `Blanking` may be missing.
 * @throws std::invalid_argument naming the array that is missing or unfit
 */
VTKCORONARYCOMMON_EXPORT std::vector<coronary::VmtkTract> TractsOf(
  vtkPolyData* data, Radii radii = Radii::Needed);

/// Points, lines, and the arrays of a tree: `MaximumInscribedSphereRadius`, `Abscissas`;
/// `GroupIds`, `ParentGroupIds`, `TreeIds`, `Length`, `Tortuosity`. Arrays of these names are replaced.
VTKCORONARYCOMMON_EXPORT void SetTree(vtkPolyData* data, const coronary::VesselTree& tree);
}

#endif
