/**
 * @class vtkCenterlineConversion
 * @brief Centerlines as a tree, or as VMTK's lines, and back, without loss.
 *
 * | form | cells | cell arrays that make it |
 * |---|---|---|
 * | tree | a polyline for each branch, joined at shared points | `GroupIds`, `ParentGroupIds` |
 * | VMTK's lines | a polyline for each branch of each path from a root to a tip, on top of each other | `CenterlineIds`, `TractIds`, `GroupIds` (as vmtkbranchextractor gives) |
 *
 * The form of the input is found by its arrays (both kinds: a tree). An input that has the wanted
 * form already passes through.
 *
 * @par Input:
 * vtkPolyData: polylines, and a point array with the radius (`MaximumInscribedSphereRadius` or `Radius`). Blanked tracts
 * are branches like the others. A tree whose branches leave others in their middle is split for
 * VMTK's lines.
 *
 * @par Output:
 * vtkPolyData: the other form; positions in double. All point arrays go along with their
 * points, all cell arrays with their branches: what VMTK's form does not need (`SegmentLabel`,
 * `TreeIds`, ...) is kept there, and comes back. New or replaced are
 * - tree: point data `Abscissas` (double, mm); cell data `GroupIds`, `ParentGroupIds`, `TreeIds` (int,
 *   the tree's own if the input has them, else counted), `Length`, `Tortuosity` (double)
 * - VMTK's lines: cell data `CenterlineIds`, `TractIds`, `GroupIds`, `Blanking` (int)
 *
 * Field data pass. The output is whole in piece 0 and empty in every other piece. Blocks of a
 * composite input are treated one by one.
 *
 * @par Time:
 * Passes through: every time step is converted by itself.
 *
 * @par Failure:
 * An array that is missing, not of one component or does not fit: one error that names it, and no
 * output.
 *
 * @sa coronary::ToVmtkTracts, coronary::FromVmtkTracts, vtkTGFWriter
 */
#ifndef vtkCenterlineConversion_h
#define vtkCenterlineConversion_h

#include "vtkCoronaryCenterlineModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <string> // for std::string

class VTKCORONARYCENTERLINE_EXPORT vtkCenterlineConversion : public vtkPolyDataAlgorithm
{
public:
  static vtkCenterlineConversion* New();
  vtkTypeMacro(vtkCenterlineConversion, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Forms
  {
    TreeForm = 0,
    VmtkForm = 1
  };

  ///@{
  /**
   * What to make: TreeForm or VmtkForm. Default VmtkForm.
   */
  vtkSetMacro(OutputForm, int);
  vtkGetMacro(OutputForm, int);
  ///@}

  ///@{
  /**
   * How far apart, in mm, the end of a tract and the beginning of the next may lie to be one point;
   * 0 or more. Default 1e-6. VMTK's own branches need more, where points were stored in float.
   */
  vtkSetMacro(Tolerance, double);
  vtkGetMacro(Tolerance, double);
  ///@}

protected:
  vtkCenterlineConversion();
  ~vtkCenterlineConversion() override = default;

  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkCenterlineConversion(const vtkCenterlineConversion&) = delete;
  void operator=(const vtkCenterlineConversion&) = delete;

  void ToVmtk(vtkPolyData* input, vtkPolyData* output) const;
  void ToTree(vtkPolyData* input, vtkPolyData* output) const;

  int OutputForm = VmtkForm;
  double Tolerance = 1e-6;
};

#endif
