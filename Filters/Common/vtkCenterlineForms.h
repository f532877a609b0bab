/**
 * @file vtkCenterlineForms.h
 * @brief Poly data that hold a tree of centerlines: as a tree, or as VMTK's lines.
 */
#ifndef vtkCenterlineForms_h
#define vtkCenterlineForms_h

#include "CenterlineConversion.h"
#include "CenterlineTree.h"
#include "vtkCoronaryCommonModule.h" // for the export macro

#include <string>
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

/**
 * Polylines as the branches of a tree; points keep their indices. Radii are 0 when `radiusName` is
 * empty.
 * @throws std::invalid_argument naming the array that is missing or unfit, or as coronary::CheckTree
 */
VTKCORONARYCOMMON_EXPORT coronary::CenterlineTree TreeOf(
  vtkPolyData* data, const std::string& radiusName);

/**
 * Polylines as VMTK's tracts; `source` holds the indices of the points. Radii are 0 when
 * `radiusName` is empty; `Blanking` may be missing.
 * @throws std::invalid_argument naming the array that is missing or unfit
 */
VTKCORONARYCOMMON_EXPORT std::vector<coronary::VmtkTract> TractsOf(
  vtkPolyData* data, const std::string& radiusName);

/// Points, lines, and the arrays of a tree: radii (not when `radiusName` is empty), `Abscissas`;
/// `GroupIds`, `ParentGroupIds`, `TreeIds`, `Length`, `Tortuosity`. Arrays of these names are replaced.
VTKCORONARYCOMMON_EXPORT void SetTree(
  vtkPolyData* data, const coronary::CenterlineTree& tree, const std::string& radiusName);
}

#endif
