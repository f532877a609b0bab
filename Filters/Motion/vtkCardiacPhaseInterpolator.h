/**
 * @class   vtkCardiacPhaseInterpolator
 * @brief   Any moment of the heart's cycle out of the phases of an input.
 *
 * Reads every time step of its input once, and then answers for any time, before, between or beyond them,
 * modulo one cycle. Time is the fraction of the R-R interval (or what Period says). Phases that come twice
 * in a cycle, as the last of the paper's 20 phases do, are brought together: their mean, weighted by
 * confidence, counts.
 *
 * Three ways: linear (Eq. 8), a periodic cubic spline (position, velocity and acceleration are continuous,
 * over the cycle's seam too), and low noise (few spatial modes, each a Fourier series; their numbers are
 * those that predict phases left out best; samples count by their confidence). Rotations are interpolated on the
 * sphere. The cross-section keeps to pi a b = A0 (1 + eps_r) with |eps_r| limited (Eq. 10, 11).
 *
 * @par Input port:
 * - 0: vtkPointSet (a tree, a skeleton, any mesh) with the same points and cells at every time step. Optional point
 *   arrays: `TrackingConfidence` (0 to 1), `TrackingStatus`, `CalibreFactor` (factor of the radius), the
 *   radius (mm), `EllipseMajor` and `EllipseMinor` (semi-axes, mm). Optional cell array: `BoneRotation`
 *   (double[4], w x y z). Field data: `CycleLength` (double, s).
 *
 * @par Output port:
 * - 0: the input's type, cells and arrays, with the points of the moment. Point data: `Velocity`
 *   (double[3], mm/s, derivative of what is interpolated); `TrackingConfidence` and `TrackingStatus` where the
 *   input has them; where the calibre changes `CalibreFactor` (double, after the limit), `CalibreRate` (double, 1/s, 0 at
 *   the limit), `AreaStrain` (double, eps_r) and the radius (type as in the input, mm); with Ellipses, or where the input has them, `EllipseMajor` and
 *   `EllipseMinor` (double, mm). Cell data: `BoneRotation` (double[4], w x y z), `BoneAngularVelocity`
 *   (double[3], radians/s about axes of the world) where the input has rotations, `BoneTwistRate` (double, radians/s)
 *   where it has twists. Other arrays that
 *   change with time are interpolated linearly when they hold floating-point numbers, else they are those of
 *   the nearest phase. Field data: `PhaseTime` (double, the time), `CycleLength` (double, s), `ClampedSections`
 *   (vtkIdType, points where eps_r was limited), `Repeatability` (double, mm, root mean square distance
 *   of phases that come twice from their mean), and in the mode low noise `LowNoiseFit` (double[4]: rank,
 *   order, ridge, root mean square error in mm of phases left out).
 *
 * A0 is the area where `CalibreFactor` is 1; without that array, the area at ReferenceTime.
 *
 * The output is whole in piece 0, and empty in every other piece. An empty input gives an empty output.
 *
 * @par Time:
 * Any time is answered, modulo Period. TIME_STEPS are offered for players only: by default the paper's 20 phases (`Steps`).
 * TIME_RANGE is TimeRange, stretched to hold all steps. The first request reads all steps of the input.
 *
 * @par Failure:
 * Less than two time steps, steps that do not increase strictly or are not finite, other points, cells or lines at
 * another step, a position that is not finite, an array of wrong form, a setting out of range, composite data: one
 * error and no output.
 *
 * @par Sources:
 * Eq. 8, 10 and 11 of Wang et al., arXiv 2503.02218.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Phases=[0.0, 0.25, 0.5, 0.75])
 * moment = CardiacPhaseInterpolator(Input=phantom["Centerlines"], Mode="Periodic Cubic")
 * moment.UpdatePipeline(0.6)
 * print(moment.GetDataInformation().GetBounds())
 * @endcode
 *
 * @sa coronary::PhaseInterpolation, vtkMotionRegularizer
 */
#ifndef vtkCardiacPhaseInterpolator_h
#define vtkCardiacPhaseInterpolator_h

#include "vtkCoronaryMotionModule.h" // for the export macro
#include "vtkPassInputTypeAlgorithm.h"

#include <memory> // for std::unique_ptr
#include <string> // for std::string
#include <vector> // for std::vector

class VTKCORONARYMOTION_EXPORT vtkCardiacPhaseInterpolator : public vtkPassInputTypeAlgorithm
{
public:
  static vtkCardiacPhaseInterpolator* New();
  vtkTypeMacro(vtkCardiacPhaseInterpolator, vtkPassInputTypeAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Modes
  {
    Linear = 0,
    PeriodicCubic = 1,
    LowNoise = 2
  };

  ///@{
  /**
   * Linear (0), periodic cubic (1) or low noise (2). Default periodic cubic.
   */
  vtkSetMacro(Mode, int);
  vtkGetMacro(Mode, int);
  void SetModeToLinear() { this->SetMode(Linear); }
  void SetModeToPeriodicCubic() { this->SetMode(PeriodicCubic); }
  void SetModeToLowNoise() { this->SetMode(LowNoise); }
  ///@}

  ///@{
  /**
   * Phases that are nearer to each other than this, modulo one cycle, are repetitions of one. Fraction of
   * the R-R interval, 0 to 0.1. Default 0.01.
   */
  vtkSetMacro(MergeTolerance, double);
  vtkGetMacro(MergeTolerance, double);
  ///@}

  ///@{
  /**
   * One cycle in the unit of the input's time: 1 where time is the fraction of the R-R interval, 0.8
   * where it is seconds and the cycle takes 0.8 s. Greater than 0. Default 1.
   */
  vtkSetMacro(Period, double);
  vtkGetMacro(Period, double);
  ///@}

  ///@{
  /**
   * The R-R interval in seconds, for an input without the field array `CycleLength`. Greater than 0. Default
   * 0.8.
   */
  vtkSetMacro(CycleLength, double);
  vtkGetMacro(CycleLength, double);
  ///@}

  ///@{
  /**
   * Most spatial modes and most harmonics that the mode low noise tries, each 1 to 20. Defaults 6 and 8.
   */
  vtkSetMacro(MaximumRank, int);
  vtkGetMacro(MaximumRank, int);
  vtkSetMacro(MaximumOrder, int);
  vtkGetMacro(MaximumOrder, int);
  ///@}

  ///@{
  /**
   * Limit of |eps_r| in Eq. 11, 0 to 0.9. Default 0.05, the paper's.
   */
  vtkSetMacro(AreaStrainLimit, double);
  vtkGetMacro(AreaStrainLimit, double);
  ///@}

  ///@{
  /**
   * The moment at which a radius that changes with time is that of A0; not used where the input has
   * `CalibreFactor`. In the unit of the input's time. Default 0.75.
   */
  vtkSetMacro(ReferenceTime, double);
  vtkGetMacro(ReferenceTime, double);
  ///@}

  ///@{
  /**
   * Give the semi-axes of the cross-section also where the input has none. Default off.
   */
  vtkSetMacro(Ellipses, bool);
  vtkGetMacro(Ellipses, bool);
  vtkBooleanMacro(Ellipses, bool);
  ///@}

  ///@{
  /**
   * Eccentricity sqrt(1 - b^2 / a^2) of these ellipses, where the input has none; 0 (round) to 0.99. Default 0.
   */
  vtkSetMacro(Eccentricity, double);
  vtkGetMacro(Eccentricity, double);
  ///@}

  enum StepKinds
  {
    PaperSteps = 0,
    InputSteps = 1,
    EvenSteps = 2,
    ListedSteps = 3
  };

  ///@{
  /**
   * The time steps that are offered, for players; any other time is answered too. The paper's 20 phases from -5 %
   * to 106 % of a cycle (0), those of the input (1), NumberOfSteps even ones over TimeRange (2), or a list
   * (3). Default the paper's.
   */
  vtkSetMacro(Steps, int);
  vtkGetMacro(Steps, int);
  ///@}

  ///@{
  /**
   * Of Steps even, both ends included. 2 to 100000. Default 21.
   */
  vtkSetMacro(NumberOfSteps, int);
  vtkGetMacro(NumberOfSteps, int);
  ///@}

  ///@{
  /**
   * The list of Steps listed, in the unit of the input's time; sorted, and without repetitions.
   */
  void AddStep(double time);
  void RemoveAllSteps();
  ///@}

  ///@{
  /**
   * The times that are offered, in cycles; the steps are added to it. Default 0 1.
   */
  vtkSetVector2Macro(TimeRange, double);
  vtkGetVector2Macro(TimeRange, double);
  ///@}

  /// Times that the input's steps have been read; once, as long as the input does not change.
  int GetNumberOfReads() const;

  vtkTypeBool ProcessRequest(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

protected:
  vtkCardiacPhaseInterpolator();
  ~vtkCardiacPhaseInterpolator() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkCardiacPhaseInterpolator(const vtkCardiacPhaseInterpolator&) = delete;
  void operator=(const vtkCardiacPhaseInterpolator&) = delete;

  int Mode = PeriodicCubic;
  double MergeTolerance = 0.01;
  double Period = 1.0;
  double CycleLength = 0.8;
  int MaximumRank = 6;
  int MaximumOrder = 8;
  double AreaStrainLimit = 0.05;
  double ReferenceTime = 0.75;
  bool Ellipses = false;
  double Eccentricity = 0.0;
  int Steps = PaperSteps;
  int NumberOfSteps = 21;
  std::vector<double> ListedTimes;
  double TimeRange[2] = { 0.0, 1.0 };

  struct Internals;
  std::unique_ptr<Internals> Data;
};

#endif
