/**
 * @class   vtkCenterlineMetrics
 * @brief   Agreement of centerlines with a reference: the overlap and distance measures of CAT08.
 *
 * Schaap et al., Med Image Anal 2009;13:701: OV, OF, OT, AD, AI, AT, from connections between
 * samples of both sides and the vessel's radius in the reference. Two lines are compared along an
 * ordered correspondence, as the challenge does; trees as a whole by nearest connections, or path
 * by path. See docs/metrics.md for the definitions.
 *
 * @par Input ports:
 * - 0: vtkPolyData, the result; lines, other cells are ignored. A radius array is optional.
 * - 1: vtkPolyData, the reference; lines with a point array of radii:
 *   `MaximumInscribedSphereRadius`, or `Radius` where there is no such array.
 *
 * Lines run from the root to the tips, and hang together where the first point of one is a point of
 * another, by index or by position.
 *
 * @par Output ports:
 * - 0, vtkTable: one row for each line of the reference (or for each path from a root to a tip),
 *   the last one for all together. Columns: `Name` (string: "line 3", "path 0 2 5", "total"; with
 *   the segment where the reference has a cell array `SegmentLabel`), `ReferenceLine`, `ResultLine`
 *   (int: index of the line or the path's last line; -1 where there is none), `OV`, `OF`, `OT`
 *   (double, 0 to 1, NaN where there is nothing to compare), `AD`, `AI`, `AT` (double, mm, NaN
 *   without connections), `RadiusError`, `RadiusBias` (double, mm, NaN where the result has no
 *   radii), `TPR`, `FN`, `TPM`, `FP` (vtkIdType, samples), `ReferenceLength`, `ResultLength`
 *   (double, mm). Field data `LongestFalse`, `LongestMissed` (double, mm, 1 value; trees only).
 * - 1, vtkPolyData: the lines of both sides. Point data `CenterlineMatch` (int: 1 true positive, 2
 *   false negative, 3 false positive, 0 not compared), `CenterlineDistance` (double, mm, of the
 *   shortest connection; NaN without one), `FromReference` (int, 0 or 1), and
 *   `MaximumInscribedSphereRadius` (double, mm, NaN unknown). Cell data `FromReference` (int).
 *
 * The output is whole in piece 0, and empty in every other piece. Blocks of a composite result are
 * treated one by one.
 *
 * @par Time:
 * The output has the time steps of the result (input 0); both inputs are asked for the same time.
 *
 * @par Failure:
 * A setting out of range, a reference without radii, a radius that is negative or not finite, a
 * coordinate that is not finite: one error that names it, and no output. Without lines the output
 * has no row but the total. An aborted execution leaves an empty output and is started anew by the
 * next request.
 *
 * @par Sources:
 * Schaap et al., Med Image Anal 2009;13:701 (CAT08).
 *
 * @sa coronary::CompareCenterlines, coronary::CompareCenterlineTrees, docs/metrics.md
 */
#ifndef vtkCenterlineMetrics_h
#define vtkCenterlineMetrics_h

#include "vtkCoronaryMetricsModule.h" // for the export macro
#include "vtkTableAlgorithm.h"

#include <string> // for std::string

class vtkPolyData;

class VTKCORONARYMETRICS_EXPORT vtkCenterlineMetrics : public vtkTableAlgorithm
{
public:
  static vtkCenterlineMetrics* New();
  vtkTypeMacro(vtkCenterlineMetrics, vtkTableAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum InputPorts
  {
    ResultPort = 0,
    ReferencePort = 1
  };

  enum OutputPorts
  {
    TablePort = 0,
    LinesPort = 1
  };

  enum Methods
  {
    AutomaticMethod = 0, ///< paths when both sides are one line, else the trees as a whole
    TreeMethod = 1,      ///< nearest connections, a row a line
    PathMethod = 2       ///< ordered correspondence, a row a path from root to tip
  };

  ///@{
  /**
   * The reference.
   */
  void SetReferenceConnection(vtkAlgorithmOutput* output)
  {
    this->SetInputConnection(ReferencePort, output);
  }
  void SetReferenceData(vtkPolyData* reference);
  ///@}

  ///@{
  /**
   * How samples are connected. Default AutomaticMethod.
   */
  vtkSetMacro(Method, int);
  vtkGetMacro(Method, int);
  ///@}

  ///@{
  /**
   * Distance of the samples in mm, positive. Default 0.03, as the challenge has it.
   */
  vtkSetMacro(Spacing, double);
  vtkGetMacro(Spacing, double);
  ///@}

  ///@{
  /**
   * Radius in mm from which a vessel counts for OT and AT, 0 or more. Default 0.75.
   */
  vtkSetMacro(RelevantRadius, double);
  vtkGetMacro(RelevantRadius, double);
  ///@}

  ///@{
  /**
   * Vessels are left out where no radius at or downstream is this large, in mm, and so is what of the
   * result is nearest to such a place. Whole trees only. 0 or more. Default 0.
   */
  vtkSetMacro(LeastRadius, double);
  vtkGetMacro(LeastRadius, double);
  ///@}

  ///@{
  /**
   * Misses within this length from the reference's start do not end OF; mm, 0 or more. Default 5.
   */
  vtkSetMacro(StartLength, double);
  vtkGetMacro(StartLength, double);
  ///@}

  ///@{
  /**
   * Whether the result is cut where it first passes the disc across the reference's start that is
   * two radii wide. Paths only. Default on.
   */
  vtkSetMacro(ClipStart, bool);
  vtkGetMacro(ClipStart, bool);
  vtkBooleanMacro(ClipStart, bool);
  ///@}

  vtkPolyData* GetLines();

protected:
  vtkCenterlineMetrics();
  ~vtkCenterlineMetrics() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkCenterlineMetrics(const vtkCenterlineMetrics&) = delete;
  void operator=(const vtkCenterlineMetrics&) = delete;

  int Method = AutomaticMethod;
  double Spacing = 0.03;
  double RelevantRadius = 0.75;
  double LeastRadius = 0.0;
  double StartLength = 5.0;
  bool ClipStart = true;
};

#endif
