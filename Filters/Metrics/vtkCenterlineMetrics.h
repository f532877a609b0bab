/**
 * @class   vtkCenterlineMetrics
 * @brief   Agreement of centerlines with a reference: overlap and distance (CAT08), and which branches
 * were found (BCR and BCS of the paper, and bounded).
 *
 * Schaap et al., Med Image Anal 2009;13:701: OV, OF, OT, AD, AI, AT, from connections between
 * samples of both sides and the vessel's radius in the reference. Two lines are compared along an
 * ordered correspondence, as the challenge does; trees as a whole by nearest connections, or path
 * by path.
 *
 * Branches are the ways between forks and ends, found the same way on both sides, and matched one to
 * one by their overlap. BCR and BCS are Eq. 17 of the paper and can exceed 1; BCR_bounded is the share
 * of the reference's branches of which at least `DetectedShare` is covered, BCS_bounded the mean
 * covered share of branches that hang on what they should. See docs/metrics.md for the definitions.
 *
 * @par Input ports:
 * - 0: the result, vtkPolyData or a composite of vtkPolyData, whose blocks are one tree then.
 * - 1: the reference, the same. Where it has no radii, `Tolerance` stands for them.
 *
 * Either is centerlines (lines from root to tip that hang together where the first point of one is a
 * point of another, by index or by position; optional point data `MaximumInscribedSphereRadius` or
 * `Radius`, cell data `GroupIds`), or a surface whose points have the branch (`GroupIds`) and the way
 * from the root (`Abscissas`): each branch is then the line through the middles of its points. A bare
 * surface has no branches: give its centerline instead.
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
 * - 2, vtkTable: a row for each branch of the reference, then for each branch of the result without a
 *   match. Columns: `Name` (string), `ReferenceBranch`, `ResultBranch` (vtkIdType, cells of output 3
 *   of either side, -1: none), `ReferenceGroup`, `ResultGroup` (vtkIdType, -1: none),
 *   `ReferenceLength`, `ResultLength` (double, mm, NaN: none), `LengthRatio`, `Overlap`, `Covered`,
 *   `Continuity` (double, 0 to 1 but for the ratio), `LongestGap` (double, mm), `Detected` (int).
 *   Field data (double, one value each): `BCR`, `BCS`, `BCR_bounded`, `BCS_bounded`, `BCS_matched`,
 *   `LengthDetected`, `ReferenceBranches`, `ResultBranches`, `MatchedBranches`, `DetectedBranches`,
 *   `FalseBranches`, `FalseLength` (mm), `OV`, `OF`, `OT`, `AD`, `AI`, `AT`.
 * - 3, vtkPolyData: the branches of both sides as lines, those of the reference first. Cell data
 *   `FromReference` (int, 0 or 1), `GroupIds` (vtkIdType), `BranchMatch` (vtkIdType, number of the
 *   matched branch on the other side, -1: none), `Covered` (double, 0 to 1), `Length` (double, mm).
 *   The field data of output 2.
 *
 * @par Time:
 * As vtkMeshDistanceMetrics, with times that are one when they differ by 1e-3 at most. The outputs are
 * whole in piece 0, and empty in every other piece.
 *
 * @par Failure:
 * A setting out of range, a bare surface, a radius that is negative or not finite, a coordinate that is
 * not finite, times that do not match: one error that names it, and no output. Without lines the first
 * table has no row but the total, the second none, and measures are NaN. An aborted execution leaves
 * empty outputs and is started anew by the next request.
 *
 * @par Sources:
 * Schaap et al., Med Image Anal 2009;13:701 (CAT08); Eq. 17 of Wang et al., arXiv 2503.02218.
 *
 * @par Python:
 * @code{.py}
 * model = CoronaryPhantom(Seed=1)
 * truth = CoronaryPhantom(Seed=1, Tortuosity=0.9)
 * agreement = CenterlineMetrics(Result=model["Centerlines"], Reference=truth["Centerlines"], RelevantRadius=0.75)
 * agreement.UpdatePipeline(0.75)
 * print(agreement["Branch Measures"].FieldData["OV"].GetRange())
 * @endcode
 *
 * @sa coronary::CompareCenterlines, coronary::CompareCenterlineTrees, coronary::CompareBranches,
 * vtkMeshDistanceMetrics, docs/metrics.md
 */
#ifndef vtkCenterlineMetrics_h
#define vtkCenterlineMetrics_h

#include "vtkCoronaryMetricsModule.h" // for the export macro
#include "vtkTableAlgorithm.h"

class vtkPolyData;

namespace coronary
{
struct Polylines;
}

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
    LinesPort = 1,
    BranchTablePort = 2,
    BranchesPort = 3
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
  void SetReferenceData(vtkDataObject* reference);
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
  vtkSetMacro(MinimumRadius, double);
  vtkGetMacro(MinimumRadius, double);
  ///@}

  ///@{
  /**
   * A place of the reference is covered by what is within its radius, or this far where that is more;
   * mm, positive. Default 1.
   */
  vtkSetMacro(Tolerance, double);
  vtkGetMacro(Tolerance, double);
  ///@}

  ///@{
  /**
   * Covered share from which a branch is detected, 0 to 1. Default 0.8.
   */
  vtkSetMacro(DetectedShare, double);
  vtkGetMacro(DetectedShare, double);
  ///@}

  ///@{
  /**
   * Ends of a tree that are shorter are no branches; mm, 0 or more. Default 3.
   */
  vtkSetMacro(MinimumLength, double);
  vtkGetMacro(MinimumLength, double);
  ///@}

  vtkPolyData* GetLines();
  vtkTable* GetBranchTable();
  vtkPolyData* GetBranches();

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
  void CompareLines(const coronary::Polylines& result, const coronary::Polylines& reference,
    vtkPolyData* referenceData, vtkInformationVector* outputs);
  void CompareBranches(const coronary::Polylines& result, const coronary::Polylines& reference,
    vtkInformationVector* outputs);

  vtkCenterlineMetrics(const vtkCenterlineMetrics&) = delete;
  void operator=(const vtkCenterlineMetrics&) = delete;

  int Method = AutomaticMethod;
  double RelevantRadius = 0.75;
  double MinimumRadius = 0.0;
  double Tolerance = 1.0;
  double DetectedShare = 0.8;
  double MinimumLength = 3.0;
};

#endif
