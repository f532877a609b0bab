/**
 * @class   vtkReferencePhase
 * @brief   One phase of a time series, as data without time.
 *
 * Takes one time of its input and hides the others: TIME_STEPS and TIME_RANGE end here. What
 * follows is static: moving the time slider executes nothing of it again, nor this filter.
 *
 * The phase is given (Time), or found: the quietest one, whose neighbours in time differ least
 * from it. For that the filter asks its input for every step once: of an image only the middle
 * slices (at most 16 along k), averaged over 4 x 4 x 4 voxels against noise; of point sets the
 * positions. The choice is kept until the input pipeline changes. With several MPI ranks every
 * rank looks at the same data and finds the same phase.
 *
 * @par Input port:
 * 0: any data object. Without time steps it is passed on as it is; with a continuous time range
 * alone the automatic choice is not possible.
 *
 * @par Output:
 * Type and content of the input at the chosen time, shared, not copied. Field data: that of the
 * input, among it `CycleLength`; `PhaseTime` (double, fraction of the R-R interval) is added where
 * the input has none.
 *
 * @par Time:
 * Ends here: the output has neither TIME_STEPS nor TIME_RANGE.
 *
 * @par Failure:
 * A Time that is not finite, or not available in the exact mode; an automatic choice among data
 * that do not compare from phase to phase: one error that says so, and no output.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Spacing=[1.5, 1.5, 1.5], Phases=[0.05, 0.35, 0.75])
 * phase = ReferencePhase(Input=phantom["Image"], Automatic=1)   # the quietest one
 * phase.UpdatePipeline()
 * phase.UpdatePropertyInformation()
 * print(phase.GetPropertyValue("UsedTime"))
 * @endcode
 *
 * @sa coronary::QuietestPhase
 */
#ifndef vtkReferencePhase_h
#define vtkReferencePhase_h

#include "vtkCoronaryCommonModule.h" // for the export macro
#include "vtkPassInputTypeAlgorithm.h"

#include <memory> // for std::unique_ptr

class VTKCORONARYCOMMON_EXPORT vtkReferencePhase : public vtkPassInputTypeAlgorithm
{
public:
  static vtkReferencePhase* New();
  vtkTypeMacro(vtkReferencePhase, vtkPassInputTypeAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Find the quietest phase. Default on.
   */
  vtkSetMacro(Automatic, bool);
  vtkGetMacro(Automatic, bool);
  vtkBooleanMacro(Automatic, bool);
  ///@}

  ///@{
  /**
   * The phase, when it is not found automatically: fraction of the R-R interval. Of an input with time
   * steps the nearest one is taken. Default 0.75.
   */
  vtkSetMacro(Time, double);
  vtkGetMacro(Time, double);
  ///@}

  /// The time of the last execution's output; NaN before it, and for data without time.
  double GetUsedTime() const { return this->UsedTime; }

  vtkTypeBool ProcessRequest(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

protected:
  vtkReferencePhase();
  ~vtkReferencePhase() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkReferencePhase(const vtkReferencePhase&) = delete;
  void operator=(const vtkReferencePhase&) = delete;

  bool Automatic = true;
  double Time = 0.75;
  double UsedTime;

  struct Internals;
  std::unique_ptr<Internals> Data;
};

#endif
