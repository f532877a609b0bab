/**
 * @class   vtkBranchMetrics
 * @brief   Branch Completeness Ratio and Branch Continuity Score of a tree, as the paper writes them and
 * bounded, branch by branch, with the overlap measures of CAT08.
 *
 * Branches are the ways between forks and ends, found the same way on both sides, and matched one to
 * one by their overlap. BCR and BCS are Eq. 17 of the paper and can exceed 1; BCR_bounded is the share
 * of the reference's branches of which at least `DetectedShare` is covered, BCS_bounded the mean
 * covered share of branches that hang on what they should. See coronary::BranchMetrics and
 * docs/metrics.md for the definitions.
 *
 * @par Input ports:
 * - 0: the result, vtkPolyData or a composite of vtkPolyData, whose blocks are one tree then.
 * - 1: the reference, the same.
 *
 * Either is centerlines (lines from root to tip; optional point data `MaximumInscribedSphereRadius` or
 * `Radius`, cell data `GroupIds`), or a surface whose points have the branch (`GroupIds`) and the way
 * from the root (`Abscissas`): each branch is then the line through the middles of its points. A bare
 * surface has no branches: give its centerline instead.
 *
 * @par Output ports:
 * - 0, vtkTable: a row for each branch of the reference, then for each branch of the result without a
 *   match. Columns: `Name` (string), `ReferenceBranch`, `ResultBranch` (vtkIdType, cells of output 1
 *   of either side, -1: none), `ReferenceGroup`, `ResultGroup` (vtkIdType, -1: none),
 *   `ReferenceLength`, `ResultLength` (double, mm, NaN: none), `LengthRatio`, `Overlap`, `Covered`,
 *   `Continuity` (double, 0 to 1 but for the ratio), `LongestGap` (double, mm), `Detected` (int).
 *   Field data (double, one value each): `BCR`, `BCS`, `BCR_bounded`, `BCS_bounded`, `BCS_matched`,
 *   `LengthDetected`, `ReferenceBranches`, `ResultBranches`, `MatchedBranches`, `DetectedBranches`,
 *   `FalseBranches`, `FalseLength` (mm), `OV`, `OF`, `OT`, `AD`, `AI`, `AT`.
 * - 1, vtkPolyData: the branches of both sides as lines, those of the reference first. Cell data
 *   `FromReference` (int, 0 or 1), `GroupIds` (vtkIdType), `BranchMatch` (vtkIdType, number of the
 *   matched branch on the other side, -1: none), `Covered` (double, 0 to 1), `Length` (double, mm).
 *   The field data of the table.
 *
 * @par Time:
 * As vtkMeshDistanceMetrics. The outputs are whole in piece 0, and empty in every other piece.
 *
 * @par Failure:
 * A setting out of range, a bare surface, a coordinate or radius that is not finite, times that do not
 * match: one error that names it, and no output. Without lines the table has no rows, and measures are
 * NaN. An aborted execution leaves empty outputs and is started anew by the next request.
 *
 * @par Sources:
 * Eq. 17 of Wang et al., arXiv 2503.02218; Schaap et al., Med Image Anal 2009;13:701, for OV to AT.
 *
 * @sa coronary::CompareBranches, vtkCenterlineMetrics, vtkMeshDistanceMetrics, docs/metrics.md
 */
#ifndef vtkBranchMetrics_h
#define vtkBranchMetrics_h

#include "vtkCoronaryMetricsModule.h" // for the export macro
#include "vtkTableAlgorithm.h"

#include <string> // for std::string

class vtkPolyData;

class VTKCORONARYMETRICS_EXPORT vtkBranchMetrics : public vtkTableAlgorithm
{
public:
  static vtkBranchMetrics* New();
  vtkTypeMacro(vtkBranchMetrics, vtkTableAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum InputPorts
  {
    ResultPort = 0,
    ReferencePort = 1
  };

  enum OutputPorts
  {
    TablePort = 0,
    BranchesPort = 1
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
   * Distance of the samples along the branches in mm, positive. Default 0.25.
   */
  vtkSetMacro(Spacing, double);
  vtkGetMacro(Spacing, double);
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
   * Least overlap of two branches that are matched, 0 to 1. Default 0.25.
   */
  vtkSetMacro(OverlapGate, double);
  vtkGetMacro(OverlapGate, double);
  ///@}

  ///@{
  /**
   * Ends of a tree that are shorter are no branches; mm, 0 or more. Default 3.
   */
  vtkSetMacro(LeastLength, double);
  vtkGetMacro(LeastLength, double);
  ///@}

  ///@{
  /**
   * Whether each line of the inputs is a branch, instead of the ways between forks and ends. Default
   * off.
   */
  vtkSetMacro(LinesAreBranches, bool);
  vtkGetMacro(LinesAreBranches, bool);
  vtkBooleanMacro(LinesAreBranches, bool);
  ///@}

  ///@{
  /**
   * How far apart two times may be to be one; 0 or more. Default 1e-3.
   */
  vtkSetMacro(TimeTolerance, double);
  vtkGetMacro(TimeTolerance, double);
  ///@}

  vtkPolyData* GetBranches();

protected:
  vtkBranchMetrics();
  ~vtkBranchMetrics() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkBranchMetrics(const vtkBranchMetrics&) = delete;
  void operator=(const vtkBranchMetrics&) = delete;

  double Spacing = 0.25;
  double Tolerance = 1.0;
  double DetectedShare = 0.8;
  double OverlapGate = 0.25;
  double LeastLength = 3.0;
  bool LinesAreBranches = false;
  double TimeTolerance = 1e-3;
};

#endif
