/**
 * @class   vtkLumenCycle
 * @brief   Diameter, area and stenosis along a vessel over the heart cycle: tables for charts, a map, lesions.
 *
 * With gated images the lumen is measured anew at each phase, where the lines are at that phase: a blurred disc is fitted
 * in each section, as `coronary-pipeline run` does at the reference phase (docs/lesions.md). Without images the radii are
 * those of the lines. Places are points of the tree that move with it, so each has one distance from its ostium at all phases.
 *
 * Where the tracker did not see the lines (`TrackingStatus` lost or filled), across bridges and where calcium hides the
 * lumen, nothing is known, and nothing is drawn. Lesions are found in the median over the phases.
 *
 * @par Input ports:
 * - 0: vtkPolyData, a tree of centerlines with or without time steps, with the same points at all of them: polylines with
 *   cell data `GroupIds`, `ParentGroupIds`, and `SegmentIds`, `SegmentLabel` (optional). Point data
 *   `MaximumInscribedSphereRadius` or `Radius`; `TrackingStatus`, `Bridged` (optional). Field data `ImageBlur` (optional).
 * - 1, optional: vtkImageData, the gated images, HU. The phases are those of their time steps at which the lines have
 *   one, too; lines without time steps are measured where they stand.
 *
 * @par Output ports:
 * - 0: vtkTable, the chosen vessel's profile for line charts, a row a point. Columns: `Position` (double, mm from the
 *   ostium), `Segment` (string), for each phase one that is named after it, as `35 %` (double, diameter, mm), then
 *   `Least`, `Median`, `Greatest` (double, mm, over the phases), `Healthy` (double, mm, of the median), `Stenosis`
 *   (double, per cent of the diameter, of the median), `Area` (double, mm^2, of the median).
 * - 1: vtkPolyData, the map, quads: x is mm from the ostium, y the phase in per cent of the R-R interval. Point data
 *   `Diameter` (double, mm), `Area` (double, mm^2), `StenosisDegree` (double, 0 to 1, by diameter).
 * - 2: vtkTable, the lesions of all vessels, a row each. Columns: `Vessel` (string), `Position`, `Start`, `End` (double, mm
 *   from the ostium), `X`, `Y`, `Z` (double, mm), `Length` (double, mm), `LeastDiameter`, `HealthyDiameter` (double, mm),
 *   `Stenosis`, `AreaStenosis`, `Low`, `High` (double, per cent; the last two a 90 % range), `Kind` (string), `Phases`
 *   (int, at which it was seen), `WorstStenosis` (double, per cent), `WorstPhase` (double, per cent of R-R),
 *   `LeastStenosis` (double, per cent), `Pulsation` (double, per cent: greatest over least diameter - 1).
 * - 3: vtkPolyData, the lines at the asked time. Point data of the input, and `Diameter` (double, mm), `Area` (double,
 *   mm^2), `StenosisDegree` (double, 0 to 1) at that phase, `ReferenceRadius` (double, mm), `LeastDiameter`,
 *   `MedianDiameter`, `GreatestDiameter`, `HealthyDiameter` (double, mm), `MedianDegree` (double, 0 to 1).
 * What is not known is NaN in all of them.
 *
 * The outputs are whole in piece 0, and empty in every other piece. Lines without points give empty outputs.
 *
 * @par Time:
 * TIME_STEPS and TIME_RANGE are the phases. The first request reads all of them, one image in memory at a time; later
 * ones read nothing again. Tables and map are the same at all times.
 *
 * @par Failure:
 * Lines that are no tree or differ from phase to phase, a vessel that the tree does not have, an image without voxels or
 * scalars, an unknown blur, lines with none of the images' times: one error that names it, and no output.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Phases=[0.05, 0.35, 0.75])
 * cycle = LumenCycle(Input=phantom["Centerlines"], Vessel="LAD")
 * cycle.UpdatePipeline(0.75)
 * print(cycle["Map"].PointData["Diameter"].GetRange())
 * @endcode
 *
 * @sa coronary::GradeOverCycle, coronary::MeasureTreeLumen, vtkCurvedReformat
 */
#ifndef vtkLumenCycle_h
#define vtkLumenCycle_h

#include "vtkCoronaryMotionModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <memory> // for std::unique_ptr
#include <string> // for std::string
#include <vector> // for std::vector

class VTKCORONARYMOTION_EXPORT vtkLumenCycle : public vtkPolyDataAlgorithm
{
public:
  static vtkLumenCycle* New();
  vtkTypeMacro(vtkLumenCycle, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum OutputPorts
  {
    ProfilePort = 0,
    MapPort = 1,
    LesionPort = 2,
    TreePort = 3
  };

  /// Connection by name: the gated images (port 1).
  void SetImageConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }

  ///@{
  /**
   * The vessel of profile and map: an artery (LAD, LCx, RCA) or a segment (mLAD, D1), whatever the case of its letters,
   * from the ostium to the tip. Empty (default): the longest one.
   */
  vtkSetMacro(Vessel, std::string);
  vtkGetMacro(Vessel, std::string);
  ///@}

  ///@{
  /**
   * Blur of the images, standard deviation in mm. 0 (default): that of the lines' field array `ImageBlur`.
   */
  vtkSetMacro(Blur, double);
  vtkGetMacro(Blur, double);
  ///@}

  ///@{
  /**
   * Point array of the images. "Automatic" (default): their scalars.
   */
  vtkSetMacro(ImageArrayName, std::string);
  vtkGetMacro(ImageArrayName, std::string);
  ///@}

  /// The phases, after UpdateInformation: times of the images at which the lines are there, too; of lines alone theirs.
  std::vector<double> GetPhases();

  /// Times that the phases have been read and measured.
  int GetNumberOfMeasurements() const;

protected:
  vtkLumenCycle();
  ~vtkLumenCycle() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkLumenCycle(const vtkLumenCycle&) = delete;
  void operator=(const vtkLumenCycle&) = delete;

  static std::vector<double> PhasesOf(vtkInformation* lines, vtkInformation* image);
  void Measure(vtkInformationVector** inputs);

  std::string Vessel;
  std::string ImageArrayName = "Automatic";
  double Blur = 0.0;

  struct Internals;
  std::unique_ptr<Internals> Data;
};

#endif
