/**
 * @class   vtkPopulationMotion
 * @brief   Moves the coronary tree of one phase as the hearts of a population move on the average.
 *
 * For scans with one phase, or few. The heart's place, direction and length are taken from the named tree; then the
 * field of coronary::MoveByPopulation carries the tree through the cycle. It is **not the motion of this patient**: the field
 * array `MotionSource` says so in words, and `MotionDeviation` says how far a point may be off. At the tree's own phase
 * all points are where they were. Phases in which the tree was tracked bend the motion, and are met exactly.
 * docs/motion.md has the equations and the sources.
 *
 * @par Input ports:
 * - 0: vtkPolyData, the tree as vtkCoronaryTreeTopology names it: field array `HeartFrame` (double[16]), point array
 *   `SegmentIds` (else the cell array), cell arrays `GroupIds` and `ParentGroupIds`. Field data `PhaseTime` (optional): the
 *   reference phase; `CycleLength` (optional, s).
 * - 1, optional: vtkPolyData, a skeleton made of the same lines, of which the second output is made.
 * - 2, optional: vtkPolyData, the same lines with time steps, as vtkCenterlineTracker gives them: point arrays
 *   `TrackingConfidence`, `TrackingStatus` and `CalibreFactor` (optional).
 *
 * @par Output ports:
 * - 0: vtkPolyData, the lines with points moved; cells and other arrays are the input's own. Point data
 *   `PlacementConfidence` (double, 0 to 1: probability that the branch is within 1 mm of an artery at that phase),
 *   `TrackingConfidence` (double: 1 at the reference, the tracker's at tracked phases, else at most 0.5),
 *   `TrackingStatus` (int, coronary::TrackingStatus; 3 filled, where it is the population's), `CalibreFactor` (double),
 *   `MotionDeviation` (double, mm: one standard deviation of the distance from the truth), `Displacement` (double[3], mm,
 *   from the reference). Cell data `AxialStrain` (double).
 * - 1: vtkPolyData, the skeleton with the same arrays, as vtkSkinDeformation takes it.
 * Field data of both: that of the lines, `CycleLength` (double, s), `ReferenceTime` (double, fraction of R-R),
 * `PhaseTime` (double, of the output), `MotionSource` (string, one sentence), `MotionPhases` (int: phases of the patient that carry it),
 * `HeartLandmarks` (string, one a landmark: what it was taken from), `LongAxis` (double[6], mm: base and
 * apex), `LongAxisDeviation` (double, 3 values: radians, mm at the base, mm of its length),
 * `PopulationValues` (double, one a parameter, in the order of docs/motion.md), `PopulationMisfit` (double, mm, two values
 * with tracked phases, else none: the population's at these phases, and that of the bent motion before it met them).
 *
 * The output is whole in piece 0, and empty in every other piece. Lines without points give an empty output.
 *
 * @par Time:
 * TIME_STEPS and TIME_RANGE are NumberOfSteps moments of one cycle, the reference and the tracked phases among them; another
 * time gives the nearest one. Tracked phases are read at the first request.
 *
 * @par Failure:
 * Lines that are no tree, without `HeartFrame`, without a segment that is LAD, LCx or RCA; a mirrored frame, named vessels
 * where no heart has them; a reference that is not known; tracked lines that are others, or without time steps; a setting out of
 * range: one error and no output.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1)
 * tree = ReferencePhase(Input=phantom["Centerlines"], Automatic=0, Time=0.75)
 * named = CoronaryTreeTopology(Input=tree)
 * motion = PopulationMotion(Centerlines=named["Tree"], HeartRate=70)
 * motion.UpdatePipeline(0.35)
 * print(motion["Centerlines"].PointData["MotionDeviation"].GetRange())
 * @endcode
 *
 * @sa coronary::MoveByPopulation, coronary::EstimateHeart, vtkCenterlineTracker, vtkCardiacPhaseInterpolator
 */
#ifndef vtkPopulationMotion_h
#define vtkPopulationMotion_h

#include "vtkCoronaryMotionModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <memory> // for std::unique_ptr

class VTKCORONARYMOTION_EXPORT vtkPopulationMotion : public vtkPolyDataAlgorithm
{
public:
  static vtkPopulationMotion* New();
  vtkTypeMacro(vtkPopulationMotion, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Connections by name: skeleton (port 1), tracked lines (port 2).
   */
  void SetSkeletonConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetTrackedConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }
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
   * The phase that the lines are of, when it is not automatic. Default 0.75.
   */
  vtkSetMacro(ReferenceTime, double);
  vtkGetMacro(ReferenceTime, double);
  ///@}

  ///@{
  /**
   * Beats a minute, 30 to 180; 0 (default): from the field array `CycleLength` of the lines, 75 without it. Systole
   * is nearly as long at any rate, so that fast hearts have a short diastole.
   */
  vtkSetMacro(HeartRate, double);
  vtkGetMacro(HeartRate, double);
  ///@}

  ///@{
  /**
   * Factor on the amplitudes of the population, 0 (at rest) to 2. Default 1.
   */
  vtkSetMacro(Amplitude, double);
  vtkGetMacro(Amplitude, double);
  ///@}

  ///@{
  /**
   * Seconds over which an image was taken, 0 to 1: what moves far in that time is less likely in its place
   * (`PlacementConfidence`). Default 0.066.
   */
  vtkSetMacro(TemporalWindow, double);
  vtkGetMacro(TemporalWindow, double);
  ///@}

  ///@{
  /**
   * Moments of the cycle at which the lines are given, 4 to 200. Default 20.
   */
  vtkSetMacro(NumberOfSteps, int);
  vtkGetMacro(NumberOfSteps, int);
  ///@}

  /// For tests: how often the motion was made.
  int GetNumberOfMotions() const;

protected:
  vtkPopulationMotion();
  ~vtkPopulationMotion() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  vtkTypeBool ProcessRequest(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkPopulationMotion(const vtkPopulationMotion&) = delete;
  void operator=(const vtkPopulationMotion&) = delete;

  void Move(vtkInformationVector** inputs, vtkInformation* outInfo);

  bool AutomaticReference = true;
  double ReferenceTime = 0.75;
  double HeartRate = 0.0;
  double Amplitude = 1.0;
  double TemporalWindow = 0.066;
  int NumberOfSteps = 20;
  struct Internals;
  std::unique_ptr<Internals> Data;
};

#endif
