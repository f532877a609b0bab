/**
 * @file vtkVmtkLines.h
 * @brief A tree of centerlines as VMTK's lines, and back, without loss.
 *
 * | form | cells | cell arrays that make it |
 * |---|---|---|
 * | tree | a polyline for each branch, joined at shared points | `GroupIds`, `ParentGroupIds` |
 * | VMTK's lines | a polyline for each branch of each path from a root to a tip, on top of each other | `CenterlineIds`, `TractIds`, `GroupIds` (as vmtkbranchextractor gives) |
 *
 * All point arrays go along with their points, all cell arrays with their branches: what VMTK's form does not need
 * (`SegmentLabel`, `TreeIds`, ...) is kept there, and comes back. Positions are double. Field data pass.
 *
 * @sa coronary::ToVmtkTracts, coronary::FromVmtkTracts, vtkVesselTree.h
 */
#ifndef vtkVmtkLines_h
#define vtkVmtkLines_h

#include "vtkCoronaryCommonModule.h" // for the export macro

class vtkPolyData;

namespace vtkCoronary
{
/**
 * A tree (CenterlineForm::Tree) as VMTK's lines; nothing of a tree without lines. New or replaced are the cell data
 * `CenterlineIds`, `TractIds`, `GroupIds`, `Blanking` (int). A tree whose branches leave others in their middle is split.
 * @throws std::invalid_argument naming the array that is missing or unfit
 */
VTKCORONARYCOMMON_EXPORT void ToVmtkLines(vtkPolyData* tree, vtkPolyData* lines);

/**
 * VMTK's lines (CenterlineForm::Vmtk) as a tree. New or replaced are the point data `Abscissas` (double, mm) and the cell
 * data `GroupIds`, `ParentGroupIds`, `TreeIds` (int, the lines' own if they have them, else counted), `Length`,
 * `Tortuosity` (double). Blanked tracts are branches like the others.
 * @param tolerance  how far apart, in mm, the end of a tract and the beginning of the next may lie to be one point; 0 or
 *                   more. VMTK's own branches need more than 1e-6, where points were stored in float.
 * @throws std::invalid_argument naming the array that is missing or unfit
 */
VTKCORONARYCOMMON_EXPORT void FromVmtkLines(
  vtkPolyData* lines, double tolerance, vtkPolyData* tree);
}

#endif
