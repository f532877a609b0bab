/**
 * @file vtkVesselTree.h
 * @brief Poly data that hold a vessel tree, or lines that are none: to coronary::VesselTree and coronary::Polylines, and back.
 */
#ifndef vtkVesselTree_h
#define vtkVesselTree_h

#include "Polylines.h"
#include "VesselTree.h"
#include "VmtkTracts.h"
#include "vtkCoronaryCommonModule.h" // for the export macro

#include "vtkType.h"

#include <vector>

class vtkDataArray;
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
 * Polylines as the branches of a tree; points keep their indices. What TreeOf does not need stays unknown: AddPointValues.
 * @throws std::invalid_argument naming the array that is missing or unfit, or as coronary::CheckTree
 */
VTKCORONARYCOMMON_EXPORT coronary::VesselTree TreeOf(
  vtkPolyData* data, Radii radii = Radii::Needed);

/// Of the points, what the data have of `Confidence`, `Bridged`, `BridgeConfidence` and `SegmentIds`.
VTKCORONARYCOMMON_EXPORT void AddPointValues(vtkPolyData* data, coronary::VesselTree& tree);

/**
 * Polylines as branches whether or not they are a tree, in their order and unchecked: without the cell array `GroupIds`
 * the number of the line, without `ParentGroupIds` no parent; names are those of `SegmentLabel`. Arrays that are too short
 * count as missing. Lengths and abscissas stay unknown.
 * @param radius  of the points; null: not known
 */
VTKCORONARYCOMMON_EXPORT coronary::VesselTree BranchesOf(vtkPolyData* data, vtkDataArray* radius);

/// Points and polylines as they are; without groups.
/// @param radius  of the points; null: not known
VTKCORONARYCOMMON_EXPORT coronary::Polylines LinesOf(
  vtkPolyData* data, vtkDataArray* radius = nullptr);

/**
 * Polylines as VMTK's tracts; `source` holds the indices of the points. `Blanking` may be missing.
 * @throws std::invalid_argument naming the array that is missing or unfit
 */
VTKCORONARYCOMMON_EXPORT std::vector<coronary::VmtkTract> TractsOf(
  vtkPolyData* data, Radii radii = Radii::Needed);

/// What is written of the branches.
enum class BranchArrays
{
  Measured, ///< `GroupIds`, `ParentGroupIds`, `TreeIds`, `Length`, `Tortuosity`
  Named     ///< and `BranchGeneration`, `StrahlerOrder`, `SegmentIds`, `SegmentLabel`
};

/**
 * Points, lines, `MaximumInscribedSphereRadius` and `Abscissas` of the points, and arrays of the branches. Arrays of these
 * names are replaced; what only some trees know of their points is added by the filter that knows it.
 * @param pointType  VTK_DOUBLE or VTK_FLOAT
 */
VTKCORONARYCOMMON_EXPORT void SetTree(vtkPolyData* data, const coronary::VesselTree& tree,
  BranchArrays arrays = BranchArrays::Measured, int pointType = VTK_DOUBLE);

/// Points and lines; no arrays.
/// @param pointType  VTK_DOUBLE or VTK_FLOAT
VTKCORONARYCOMMON_EXPORT void SetLines(
  vtkPolyData* data, const coronary::Polylines& lines, int pointType = VTK_DOUBLE);

/// Lines with points of their own, and `CenterlineIds`, `TractIds`, `GroupIds` and `Blanking`; not the radii.
VTKCORONARYCOMMON_EXPORT void SetTracts(
  vtkPolyData* data, const std::vector<coronary::VmtkTract>& tracts);
}

#endif
