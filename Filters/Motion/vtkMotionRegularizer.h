/**
 * @class   vtkMotionRegularizer
 * @brief   Makes the motion of a tree smooth in time and along the vessels, and keeps it within limits.
 *
 * Reads every time step of its input once, and moves the points of all of them at once: least is the sum of
 * the squared moves, weighted by the square of the confidence, of TemporalWeight times an energy in time, of
 * SpatialWeight times one along the vessels, and of VelocityWeight times the squared differences of velocity along the
 * vessels (Eq. 13, 14). Time is taken modulo one cycle. Then corners, lengths and steps from phase to phase are
 * held within their limits. A point that was tracked well is moved by no more than Tolerance; where that
 * stands against a limit, the limit gives way and is counted.
 *
 * @par Input ports:
 * - 0: vtkPolyData with lines only (a tree or a skeleton), the same at every time step. Optional point arrays:
 *   `TrackingConfidence` (0 to 1; without it all points weigh the same and none counts as tracked well),
 *   `TrackingStatus`, `CalibreFactor`; optional cell array `BoneRotation` (double[4], w x y z).
 * - 1, optional: vtkPolyData, the same lines at rest. Without it rest is the time step that is nearest to ReferenceTime.
 *
 * @par Output port:
 * - 0: vtkPolyData, the input at the nearest time step, with other points. `BoneRotation` of lines of two
 *   points follows them. Point data: `MotionClamps` (int, bits: 1 bending, 2 radius of curvature, 4 strain, 8 step,
 *   16 tolerance; a bit is set where the input or its smooth form was beyond the limit), `RegularizationMove`
 *   (double[3], mm). Cell data: `AxialStrain` (double, length / rest length - 1), `AxialStress` (double, MPa).
 *   Field data, the same at all times: `TemporalEnergy`, `SpatialEnergy`, `TotalEnergy` (double, two values: before and
 *   after; Eq. 14, mm^2), `MotionObjective` (double, two values: what is minimised), `ClampedPoints` (vtkIdType, five
 *   values: points and phases for each bit), `LimitViolations` (vtkIdType, limits that are not kept),
 *   `LimitIterations` (int), `MaximumMove` (double, mm), `MotionNoise` (double, a value for each time step, mm along each axis), `PhaseTime` (double, the time step).
 *
 * The output is whole in piece 0, and empty in every other piece. An empty input gives an empty output.
 *
 * @par Time:
 * TIME_STEPS and TIME_RANGE are those of the input; another time gives the nearest step. The first request reads all
 * steps of the input.
 *
 * @par Failure:
 * Less than two time steps, steps that do not increase strictly or are not finite, other points or lines at another
 * step, a position that is not finite, cells that are no lines, a segment without length at rest, an array of
 * wrong form, a setting out of range: one error and no output.
 *
 * @par Sources:
 * Eq. 13 and 14 of Wang et al., arXiv 2503.02218.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, CenterlineSpacing=2, Phases=[0.05, 0.2, 0.35, 0.5, 0.75])
 * motion = MotionRegularizer(Motion=phantom["Centerlines"], MaximumBending=50)
 * motion.UpdatePipeline(0.35)
 * print(motion.GetDataInformation().GetBounds())
 * @endcode
 *
 * @sa coronary::RegularizeMotion, vtkCardiacPhaseInterpolator
 */
#ifndef vtkMotionRegularizer_h
#define vtkMotionRegularizer_h

#include "vtkCoronaryMotionModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <memory> // for std::unique_ptr
#include <string> // for std::string

class VTKCORONARYMOTION_EXPORT vtkMotionRegularizer : public vtkPolyDataAlgorithm
{
public:
  static vtkMotionRegularizer* New();
  vtkTypeMacro(vtkMotionRegularizer, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /// The lines at rest (port 1).
  void SetRestConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }

  enum Energies
  {
    Displacement = 0,
    Position = 1
  };

  ///@{
  /**
   * What is meant by smooth: the acceleration and the bending of the displacement from rest (0), or Eq. 14 as it
   * stands (1), which shrinks the motion and straightens vessels. Default displacement.
   */
  vtkSetMacro(Energy, int);
  vtkGetMacro(Energy, int);
  void SetEnergyToDisplacement() { this->SetEnergy(Displacement); }
  void SetEnergyToPosition() { this->SetEnergy(Position); }
  ///@}

  ///@{
  /**
   * omega_1, omega_2, and the smoothing of the velocity, against 1 for a sample of confidence 1. 0 or more. Defaults
   * 0.005, 0.1 and 0.02.
   */
  vtkSetMacro(TemporalWeight, double);
  vtkGetMacro(TemporalWeight, double);
  vtkSetMacro(SpatialWeight, double);
  vtkGetMacro(SpatialWeight, double);
  vtkSetMacro(VelocityWeight, double);
  vtkGetMacro(VelocityWeight, double);
  ///@}

  ///@{
  /**
   * Greatest angle between successive segments, in degrees: 1 to 180 (no limit). Default 60. A corner that is
   * beyond this or the next limit at rest may be a tenth sharper than there.
   */
  vtkSetMacro(MaximumBending, double);
  vtkGetMacro(MaximumBending, double);
  ///@}

  ///@{
  /**
   * Least radius of curvature, mm: of the circle through three successive points. 0 (no limit) or more. Default 1.
   */
  vtkSetMacro(MinimumCurvatureRadius, double);
  vtkGetMacro(MinimumCurvatureRadius, double);
  ///@}

  ///@{
  /**
   * Greatest |length / rest length - 1| of a segment: 0.001 to 0.9, or 0 for no limit. Default 0.25.
   */
  vtkSetMacro(MaximumStrain, double);
  vtkGetMacro(MaximumStrain, double);
  ///@}

  ///@{
  /**
   * delta: greatest distance of a point between two successive phases, mm; 0 for no limit. Default 15.
   */
  vtkSetMacro(MaximumStep, double);
  vtkGetMacro(MaximumStep, double);
  ///@}

  ///@{
  /**
   * The confidence from which a point counts as tracked well, 0 to 1, and how far such a point may be moved,
   * mm. Defaults 0.8 and 0.3.
   */
  vtkSetMacro(WellTracked, double);
  vtkGetMacro(WellTracked, double);
  vtkSetMacro(Tolerance, double);
  vtkGetMacro(Tolerance, double);
  ///@}

  ///@{
  /**
   * Whether the noise of each phase is measured (how far displacements are off a line over 8 mm of vessel): places of a noisy
   * phase weigh less, are smoothed along the vessels as the noise asks for, and may be moved by three of its
   * deviations more than the tolerance. Not with the energy of the position. Default true.
   */
  vtkSetMacro(MeasureNoise, bool);
  vtkGetMacro(MeasureNoise, bool);
  vtkBooleanMacro(MeasureNoise, bool);
  ///@}

  ///@{
  /**
   * E of Eq. 12, MPa. Default 1.55, a nominal value of the order of tensile tests of human coronary arteries (Karimi
   * et al., Mater Sci Eng C 2013;33:2550), to be set by who needs stress. Only AxialStress depends on it.
   */
  vtkSetMacro(YoungsModulus, double);
  vtkGetMacro(YoungsModulus, double);
  ///@}

  ///@{
  /**
   * To which the limits are kept, mm (1e-6 to 1), and the most iterations for that. Defaults 0.002 and 400.
   */
  vtkSetMacro(Precision, double);
  vtkGetMacro(Precision, double);
  vtkSetMacro(Iterations, int);
  vtkGetMacro(Iterations, int);
  ///@}

  ///@{
  /**
   * The time step that is nearest to it, modulo one cycle, is rest, where port 1 has no input. In the unit of the input's
   * time. Default 0.75.
   */
  vtkSetMacro(ReferenceTime, double);
  vtkGetMacro(ReferenceTime, double);
  ///@}

  ///@{
  /**
   * One cycle in the unit of the input's time. Greater than 0. Default 1.
   */
  vtkSetMacro(Period, double);
  vtkGetMacro(Period, double);
  ///@}

  /// Times that the motion has been computed; moving the time does not add to it.
  int GetNumberOfSolutions() const;

  vtkTypeBool ProcessRequest(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

protected:
  vtkMotionRegularizer();
  ~vtkMotionRegularizer() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkMotionRegularizer(const vtkMotionRegularizer&) = delete;
  void operator=(const vtkMotionRegularizer&) = delete;

  int Energy = Displacement;
  double TemporalWeight = 0.005;
  double SpatialWeight = 0.1;
  double VelocityWeight = 0.02;
  double MaximumBending = 60.0;
  double MinimumCurvatureRadius = 1.0;
  double MaximumStrain = 0.25;
  double MaximumStep = 15.0;
  double WellTracked = 0.8;
  double Tolerance = 0.3;
  bool MeasureNoise = true;
  double YoungsModulus = 1.55;
  double Precision = 0.002;
  int Iterations = 400;
  double ReferenceTime = 0.75;
  double Period = 1.0;

  struct Internals;
  std::unique_ptr<Internals> Data;
};

#endif
