/**
 * @class   vtkCurvedReformat
 * @brief   A look along a vessel: straightened or curved reformat, cross-sections, lumen and outer boundary.
 *
 * The vessel is a way of the tree from its ostium to its tip, chosen by name. The reformat is a sheet through the image
 * that follows it: straightened (every column at right angles to the axis, which does not twist) or curved (parallel
 * columns; the sheet is unrolled without stretching). A cross-section stands at any distance from the ostium. Flat pictures
 * have the place of every pixel in the patient; the third output has the same sheets where they are, for the view of the
 * tree, so that one slider moves all of them.
 *
 * With a tree that moves and gated images each time shows its phase. The outer boundary is where the tissue around the
 * lumen ends and fat begins; beside muscle, chambers and other vessels there is none.
 *
 * @par Input ports:
 * - 0: vtkImageData, the CT image. Point data: ImageArrayName, or the scalars (one value a voxel, HU).
 * - 1: vtkPolyData, a tree of centerlines: polylines with cell data `GroupIds`, `ParentGroupIds`, and `SegmentLabel`
 *   (string, names; optional). Point data `MaximumInscribedSphereRadius` or `Radius`.
 *
 * @par Output ports:
 * - 0: vtkMultiBlockDataSet, the reformat, flat: x is mm to the right from the ostium's column, y mm up from the middle
 *   row. Blocks "Picture" (vtkImageData), "Axis", "Lumen" (both edges, at the tree's radius), "Outer Boundary" (where it
 *   is seen) and "Place" (the section's column), vtkPolyData. Point data of all: `WorldPosition` (double[3], mm, in the
 *   patient), `Abscissas` (double, mm from the ostium); of the picture the image's array (float, its unit, NaN outside of
 *   the image). Field data: `VesselPieces` (string, names from the ostium to the tip), `VesselLength` (double, mm).
 * - 1: vtkMultiBlockDataSet, the cross-section, flat, seen downstream: x and y are mm from the axis. Blocks "Picture"
 *   (vtkImageData), "Lumen" (a circle of the tree's radius), "Edge" (where the image has fallen half way to the wall)
 *   and "Outer Boundary", vtkPolyData, with point data as output 0. Field data: `SectionPosition` (double, mm from the
 *   ostium), `LumenDiameter` (double, mm, of the tree), `EdgeArea`, `OuterArea` (double, mm^2, within these boundaries;
 *   -1 where a third of one is not seen).
 * - 2: vtkMultiBlockDataSet, the same in the patient: blocks "Sheet" and "Section" (vtkStructuredGrid), "Axis", "Lumen",
 *   "Edge" and "Outer Boundary" (vtkPolyData, the last three around the section), with point data as output 0.
 *
 * The outputs are whole in piece 0, and empty in every other piece. Without lines they have no blocks.
 *
 * @par Time:
 * Passes through: every time step is computed by itself.
 *
 * @par Failure:
 * An image without voxels or scalars, lines that are no tree, a vessel that the tree does not have, a vessel outside of the
 * image, settings out of range: one error that names it, and no output. A Position beyond the vessel's end means its end.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Spacing=[1.0, 1.0, 1.0], TemporalWindow=0)
 * sheet = CurvedReformat(Input=phantom["Image"], Centerlines=phantom["Centerlines"], Vessel="LAD", Position=40)
 * sheet.UpdatePipeline(0.75)
 * print(sheet["Section"].FieldData["LumenDiameter"].GetRange())
 * @endcode
 *
 * @sa coronary::ReformatVessel, coronary::TraceBoundaries, vtkLumenCycle
 */
#ifndef vtkCurvedReformat_h
#define vtkCurvedReformat_h

#include "vtkCoronaryCenterlineModule.h" // for the export macro
#include "vtkMultiBlockDataSetAlgorithm.h"

#include <string> // for std::string

class VTKCORONARYCENTERLINE_EXPORT vtkCurvedReformat : public vtkMultiBlockDataSetAlgorithm
{
public:
  static vtkCurvedReformat* New();
  vtkTypeMacro(vtkCurvedReformat, vtkMultiBlockDataSetAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum OutputPorts
  {
    ReformatPort = 0,
    SectionPort = 1,
    InPlacePort = 2
  };

  /// Connection by name: the tree (port 1).
  void SetLinesConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }

  ///@{
  /**
   * The vessel: an artery (LAD, LCx, RCA) or a segment (mLAD, D1), whatever the case of its letters. It is followed from
   * the ostium to the tip. Empty (default): the longest one.
   */
  vtkSetMacro(Vessel, std::string);
  vtkGetMacro(Vessel, std::string);
  ///@}

  enum Kinds
  {
    Straightened = 0,
    Curved = 1
  };

  ///@{
  /**
   * Straightened (default), or curved: the vessel keeps its bends in the direction of the columns.
   */
  vtkSetMacro(Kind, int);
  vtkGetMacro(Kind, int);
  ///@}

  ///@{
  /**
   * Turns the sheet, degrees: about the vessel's axis; curved, about the way from its beginning to its end, 0: across the
   * plane in which the vessel is longest, so that it hardly bends. Default 0.
   */
  vtkSetMacro(Angle, double);
  vtkGetMacro(Angle, double);
  ///@}

  ///@{
  /**
   * Where the cross-section stands, mm from the ostium along the vessel. Default 20.
   */
  vtkSetMacro(Position, double);
  vtkGetMacro(Position, double);
  ///@}

  ///@{
  /**
   * The cross-section stands where the vessel is nearest to a point, and not at Position. Default off; the point is
   * in mm in the patient, by default the origin.
   */
  vtkSetMacro(FollowPoint, bool);
  vtkGetMacro(FollowPoint, bool);
  vtkBooleanMacro(FollowPoint, bool);
  vtkSetVector3Macro(Point, double);
  vtkGetVector3Macro(Point, double);
  ///@}

  ///@{
  /**
   * Half of the pictures' width: mm to each side of the axis, 1 to 50. Default 8.
   */
  vtkSetMacro(HalfWidth, double);
  vtkGetMacro(HalfWidth, double);
  ///@}

  ///@{
  /**
   * Size of a pixel, mm, 0.02 to 5. Default 0.25.
   */
  vtkSetMacro(Spacing, double);
  vtkGetMacro(Spacing, double);
  ///@}

  ///@{
  /**
   * Value between the vessel's wall and the fat around it, HU. Default -25.
   */
  vtkSetMacro(OuterLevel, double);
  vtkGetMacro(OuterLevel, double);
  ///@}

  ///@{
  /**
   * Standard deviation over which the direction of the axis is averaged, mm, 0 to 20. Default 1.
   */
  vtkSetMacro(Smoothing, double);
  vtkGetMacro(Smoothing, double);
  ///@}

  ///@{
  /**
   * Point array of the image. "Automatic" (default): its scalars.
   */
  vtkSetMacro(ImageArrayName, std::string);
  vtkGetMacro(ImageArrayName, std::string);
  ///@}

protected:
  vtkCurvedReformat();
  ~vtkCurvedReformat() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkCurvedReformat(const vtkCurvedReformat&) = delete;
  void operator=(const vtkCurvedReformat&) = delete;

  class Writer;

  std::string Vessel;
  std::string ImageArrayName = "Automatic";
  int Kind = Straightened;
  double Angle = 0.0;
  double Position = 20.0;
  bool FollowPoint = false;
  double Point[3] = { 0.0, 0.0, 0.0 };
  double HalfWidth = 8.0;
  double Spacing = 0.25;
  double OuterLevel = -25.0;
  double Smoothing = 1.0;
};

#endif
