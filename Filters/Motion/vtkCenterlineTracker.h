/**
 * @class   vtkCenterlineTracker
 * @brief   Carries a tree of centerlines through all phases of a gated series.
 *
 * The tree was found once, at the reference phase. Its motion is found in the images of the other phases:
 * surroundings of every place along the vessels are looked for, first coarsely and far, then finely, then
 * the vessel itself, compared with the reference smeared along its motion; and one robust fit over all
 * places and phases, periodic in time, decides. What is not visible is filled from its neighbours in space
 * and time. The tree keeps all its branches at all phases. docs/tracking.md has the steps.
 *
 * The first request reads every tracked phase, one volume in memory at a time; then any time is answered
 * without reading an image again.
 *
 * @par Input ports:
 * - 0: vtkImageData with time steps (fractions of R-R), the series: short, unsigned short, float or any
 *   other scalars. Grids may differ from phase to phase. Masks work as well (ImageContent). Or vtkPolyData
 *   with time steps: closed surfaces of the vessels at every phase (polygons or strips, turned the same way), or
 *   the lines of every phase with radii, as found in it by whatever means. Neither need the same points nor
 *   the same branches at all phases.
 * - 1: vtkPolyData, lines to track, at the reference phase. Point data `MaximumInscribedSphereRadius` or `Radius`,
 *   `Confidence`, `OstiumConfidence`, `VeinProbability` (all optional). Field data `PhaseTime` (optional): the reference phase.
 * - 2, optional: vtkPolyData, a skeleton made of the same lines, of which the second output is made.
 *
 * @par Output ports:
 * - 0: vtkPolyData, the lines with points moved; cells and other arrays are the input's own. Point data
 *   `PlacementConfidence` (double, 0 to 1: probability that the branch is within 1 mm of an artery at that phase),
 *   `TrackingConfidence` (double, 0 to 1), `TrackingStatus` (int, coronary::TrackingStatus: 0 tracked, 1 weak, 2 lost,
 *   3 filled), `CalibreFactor` (double, of the radius), `Displacement` (double[3], mm, from the
 *   reference); of CT also `LumenBeside` (double, mm, 2 at most: where the phase's image has the middle of the lumen,
 *   from the point), `LumenContrast` (double, HU: of the point over its surroundings). Cell data `AxialStrain` (double: length / length at the reference - 1).
 * - 1: vtkPolyData, the skeleton with the same arrays, as vtkSkinDeformation takes it.
 * Both have TIME_STEPS and TIME_RANGE of the tracked phases; another time gives the nearest one. Field data:
 * that of the lines, `CycleLength` (double, s; 0.8 where the inputs do not say it), `ReferenceTime` (double, fraction of R-R), `TrackedShare` (double, one value
 * a tracked phase: share of places that were tracked), `TrackingRepeatability` (double, mm: phases that show the same moment against each
 * other; NaN when there are none).
 *
 * The output is whole in piece 0, and empty in every other piece. Lines without points give an empty output.
 *
 * @par Time:
 * TIME_STEPS and TIME_RANGE are the tracked phases; another time gives the nearest one. The first request reads all
 * tracked phases, CT twice, later ones read no image.
 *
 * @par Failure:
 * An input without time steps or with one only, times that do not increase, lines outside the image, a
 * reference that is not known, a phase without voxels or shapes, a surface that is not closed, no phase in which
 * anything was found: one error and no output. Phases in which
 * nothing was found are filled, with a warning.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Spacing=[1.2, 1.2, 1.2], TemporalWindow=0, Phases=[0.05, 0.35, 0.75])
 * tree = ReferencePhase(Input=phantom["Centerlines"], Automatic=0, Time=0.75)
 * motion = CenterlineTracker(Series=phantom["Image"], Centerlines=tree, NodeSpacing=5, CaptureRange=14)
 * motion.UpdatePipeline(0.35)
 * print(motion["Centerlines"].PointData["TrackingConfidence"].GetRange())
 * @endcode
 *
 * @sa coronary::TrackCenterlines, vtkMotionRegularizer, vtkCardiacPhaseInterpolator
 */
#ifndef vtkCenterlineTracker_h
#define vtkCenterlineTracker_h

#include "vtkCoronaryMotionModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <memory> // for std::unique_ptr
#include <string> // for std::string
#include <vector> // for std::vector

namespace coronary
{
class ItemSharing;
}

class VTKCORONARYMOTION_EXPORT vtkCenterlineTracker : public vtkPolyDataAlgorithm
{
public:
  static vtkCenterlineTracker* New();
  vtkTypeMacro(vtkCenterlineTracker, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Connections by name: lines (port 1), skeleton (port 2).
   */
  void SetLinesConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetSkeletonConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }
  ///@}

  ///@{
  /**
   * Take the reference phase from the field array `PhaseTime` of the lines. Default on.
   */
  vtkSetMacro(AutomaticReference, bool);
  vtkGetMacro(AutomaticReference, bool);
  vtkBooleanMacro(AutomaticReference, bool);
  ///@}

  ///@{
  /**
   * The phase that the lines were found at, when it is not automatic. Default 0.75.
   */
  vtkSetMacro(ReferenceTime, double);
  vtkGetMacro(ReferenceTime, double);
  ///@}

  enum PhaseSelections
  {
    AllPhases = 0,
    EvenPhases = 1,
    ListedPhases = 2
  };

  ///@{
  /**
   * Which phases are tracked: all time steps (default), every other one from the first on (as the paper
   * does, to judge the others by), or those of the list, each the nearest time step.
   */
  vtkSetClampMacro(TrackedPhases, int, AllPhases, ListedPhases);
  vtkGetMacro(TrackedPhases, int);
  void AddTrackedTime(double time);
  void RemoveAllTrackedTimes();
  int GetNumberOfTrackedTimes() const { return static_cast<int>(this->TrackedTimes.size()); }
  ///@}

  enum ImageContents
  {
    Tomogram = 0,
    Mask = 1
  };

  ///@{
  /**
   * Whether images show the tissue around the vessels too (CT, default), or the vessels alone (masks,
   * probabilities).
   */
  vtkSetClampMacro(ImageContent, int, Tomogram, Mask);
  vtkGetMacro(ImageContent, int);
  ///@}

  ///@{
  /**
   * The point array of the images. Default "Automatic", or empty: their active scalars, or their first
   * numeric array of one component.
   */
  vtkSetMacro(ImageArrayName, std::string);
  vtkGetMacro(ImageArrayName, std::string);
  ///@}

  ///@{
  /**
   * Seconds over which an image was taken: half a turn of the gantry, a quarter with two sources. Default 0.066.
   * Not used for masks, surfaces and lines, which are taken for those of one moment.
   */
  vtkSetMacro(TemporalWindow, double);
  vtkGetMacro(TemporalWindow, double);
  ///@}

  ///@{
  /**
   * Greatest distance of the places that are tracked, along the vessels, mm. Default 2.
   */
  vtkSetMacro(NodeSpacing, double);
  vtkGetMacro(NodeSpacing, double);
  ///@}

  ///@{
  /**
   * How far a vessel may move between tracked phases that are neighbours in time, along each axis, mm.
   * Default 16.
   */
  vtkSetMacro(CaptureRange, double);
  vtkGetMacro(CaptureRange, double);
  ///@}

#ifndef __VTK_WRAP__
  /**
   * Who reads and measures which phases; the output is the same. Not owned; null (default): all are measured here.
   */
  void SetSharing(coronary::ItemSharing* sharing)
  {
    this->Sharing = sharing;
  }
#endif

  /// For tests: how often the series was read.
  int GetNumberOfTrackings() const;

protected:
  vtkCenterlineTracker();
  ~vtkCenterlineTracker() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkCenterlineTracker(const vtkCenterlineTracker&) = delete;
  void operator=(const vtkCenterlineTracker&) = delete;

  std::vector<double> Selected(const std::vector<double>& steps) const;
  void Track(vtkInformationVector** inputs);

  bool AutomaticReference = true;
  double ReferenceTime = 0.75;
  int TrackedPhases = AllPhases;
  std::vector<double> TrackedTimes;
  int ImageContent = Tomogram;
  std::string ImageArrayName = "Automatic";
  double TemporalWindow = 0.066;
  double NodeSpacing = 2.0;
  double CaptureRange = 16.0;
  coronary::ItemSharing* Sharing = nullptr;
  struct Internals;
  std::unique_ptr<Internals> Data;
};

#endif
