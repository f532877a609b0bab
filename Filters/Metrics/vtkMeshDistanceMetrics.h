/**
 * @class   vtkMeshDistanceMetrics
 * @brief   Distances between two surfaces: Hausdorff, mean, RMS, percentile; per point and per branch.
 *
 * Distances are from points of one surface to the nearest point of the other one, on its triangles, not
 * only its vertices. HD is Eq. 15 of the paper, exact up to `ErrorBound`; MSD is Eq. 16, the mean over
 * the result's vertices, one-sided; the other means are weighted by area, two-sided. See
 * coronary::MeshDistance and docs/metrics.md for the definitions.
 *
 * @par Input ports:
 * - 0: the result (A), vtkPolyData or a composite of vtkPolyData, whose blocks are one surface then.
 * - 1: the reference (B), the same.
 *
 * Polygons and strips are triangulated; lines and vertices are left out. Arrays, all optional: point or
 * cell data `GroupIds` (branch), cell data `CellEntityIds` (above 1: caps, for `EndLength`).
 *
 * @par Output ports:
 * - 0, vtkPolyData: the result, in triangles, with its arrays; point data `SurfaceDistance` (double, mm:
 *   distance from the reference; where the reference is closed and `SignedDistances` is on, negative
 *   inside of it; NaN where a point was not compared).
 * - 1, vtkPolyData: the reference with its distance from the result.
 * - 2, vtkTable: a row for each branch of the result, a row for each branch of the reference, and
 *   the last one for all together. Columns: `Name` (string), `Side` (int: 0 result, 1 reference, -1
 *   both), `GroupId` (vtkIdType, -1 for all), then (double, mm, NaN where it does not apply): `HD`,
 *   `HD_AB`, `HD_BA`, `HD95`, `HD95_AB`, `HD95_BA`, `HD95_pooled`, `MSD`, `MSD_BA`, `MSD_area`,
 *   `MSD_area_AB`, `MSD_area_BA`, `RMS`, `RMS_AB`, `RMS_BA`, `error_bound` (what HD can be too
 *   small by), `quadrature_error` (estimate, of MSD_area), `Area_A`, `Area_B` (double, mm^2). A branch is
 *   compared with the whole of the other surface; `HD`, `HD95`, `MSD`, `MSD_area`, `RMS` of its row
 *   are its own side's.
 *
 * Field data of all outputs: the columns of the last row (double, one value each) by their names;
 * `HausdorffPoints` (double[3], mm, 4 tuples: where HD_AB is attained on the result, the reference's
 * point that is nearest to it, the same of HD_BA on the reference and the result); `SignedDistance`
 * (int, 2 values, 1 when the distances of output 0, 1 have a sign).
 *
 * @par Time:
 * The outputs have the time steps of the result, or, where that has none, of the reference. The
 * reference is asked for its step nearest to the result's; more than `TimeTolerance` apart is an
 * error. An input without time is compared with all times of the other one.
 *
 * The outputs are whole in piece 0, and empty in every other piece.
 *
 * @par Failure:
 * A setting out of range, an input without triangles, a coordinate that is not finite, times that do
 * not match: one error that names it, and no output. A warning when one surface is about 10, 100 or
 * 1000 times as large as the other one: other units. An aborted execution leaves empty outputs and
 * is started anew by the next request.
 *
 * @par Sources:
 * Eq. 15 and 16 of Wang et al., arXiv 2503.02218.
 *
 * @par Python:
 * @code{.py}
 * model = CoronaryPhantom(Seed=1, SurfaceSpacing=1)
 * truth = CoronaryPhantom(Seed=1, SurfaceSpacing=1.1, Tortuosity=0.9)
 * distance = MeshDistanceMetrics(Result=model["Surface"], Reference=truth["Surface"])
 * distance.UpdatePipeline(0.75)
 * print(distance["Measures"].FieldData["HD95"].GetRange())
 * @endcode
 *
 * @sa coronary::CompareSurfaces, vtkBranchMetrics, docs/metrics.md
 */
#ifndef vtkMeshDistanceMetrics_h
#define vtkMeshDistanceMetrics_h

#include "vtkCoronaryMetricsModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <string> // for std::string

class vtkTable;

class VTKCORONARYMETRICS_EXPORT vtkMeshDistanceMetrics : public vtkPolyDataAlgorithm
{
public:
  static vtkMeshDistanceMetrics* New();
  vtkTypeMacro(vtkMeshDistanceMetrics, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Ports
  {
    ResultPort = 0,
    ReferencePort = 1,
    TablePort = 2
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
   * What HD may be too small by, and what the estimated error of MSD_area may be; mm, positive.
   * Default 1e-3.
   */
  vtkSetMacro(ErrorBound, double);
  vtkGetMacro(ErrorBound, double);
  ///@}

  ///@{
  /**
   * Whether distances are negative inside of a closed surface. Default on.
   */
  vtkSetMacro(SignedDistances, bool);
  vtkGetMacro(SignedDistances, bool);
  vtkBooleanMacro(SignedDistances, bool);
  ///@}

  ///@{
  /**
   * Leave out the ends of vessels: caps (by `CellEntityIds`), and on both surfaces what lies beyond an
   * end of either one, so far from it; mm, positive. Default 0: nothing is left out.
   */
  vtkSetMacro(EndLength, double);
  vtkGetMacro(EndLength, double);
  ///@}

  ///@{
  /**
   * How far apart two times may be to be one; 0 or more. Default 1e-3.
   */
  vtkSetMacro(TimeTolerance, double);
  vtkGetMacro(TimeTolerance, double);
  ///@}

  vtkPolyData* GetReferenceOutput();
  vtkTable* GetTable();

protected:
  vtkMeshDistanceMetrics();
  ~vtkMeshDistanceMetrics() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkMeshDistanceMetrics(const vtkMeshDistanceMetrics&) = delete;
  void operator=(const vtkMeshDistanceMetrics&) = delete;

  double ErrorBound = 1e-3;
  bool SignedDistances = true;
  double EndLength = 0.0;
  double TimeTolerance = 1e-3;
};

#endif
