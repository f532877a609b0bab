/**
 * @class   vtkSurfaceCleaner
 * @brief   Makes closed, manifold surfaces without self-intersections of what others deliver.
 *
 * Merges points, leaves out degenerate, doubled and small parts, cuts open where the surface is not a
 * manifold, orients outwards, joins open ends that face each other, fills holes, closes open vessel
 * ends by flat caps, takes out triangles that cut others, and betters thin triangles. See
 * docs/surface.md.
 *
 * @par Input:
 * vtkPolyData with polygons or strips; lines and vertices are left out. Cell data `CellEntityIds`
 * (optional; without it all is wall, 1).
 *
 * @par Output:
 * vtkPolyData of triangles that look outwards. Point and cell data of the input (new points and
 * triangles have the nearest one's), with
 * - point data `SurfacePointId` (vtkIdType, of the input, -1 for new ones);
 * - cell data `SurfaceCellId` (vtkIdType, of the input, -1 for new ones), `CellEntityIds` (int; caps
 *   follow after the input's greatest, the largest cap first), `RegionIds` (int, component, from 0,
 *   the largest first);
 * - field data `Repairs` (string, a sentence for each kind of repair, with the first place),
 *   `Warnings` (string, what could not be put right), `MaximumDisplacement` (double, mm, of a point
 *   of the input that is still there), and counts (vtkIdType, 1 value): `MergedPoints`,
 *   `DegenerateTriangles`, `DuplicateTriangles`, `NonManifoldEdges`, `NonManifoldPoints`,
 *   `TurnedTriangles`, `SmallComponents`, `InnerComponents`, `SelfIntersections`, `JoinedEnds`,
 *   `FilledHoles`, `Caps`, `BadTriangles`, and of what is left `OpenEdges`,
 *   `RemainingIntersections`, `RemainingBadTriangles`.
 *
 * The output is whole in piece 0, and empty in every other piece. An empty input gives an empty
 * output.
 *
 * @par Time:
 * Passes through from input 0: every time step is computed by itself.
 *
 * @par Failure:
 * A setting out of range, a coordinate that is not finite: one error, and no output. What can not be
 * put right is a warning. An aborted execution leaves an empty output and is started anew by the next
 * request.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, SurfaceSpacing=0.8)
 * wall = ReferencePhase(Input=phantom["Surface"], Automatic=0, Time=0.75)
 * clean = SurfaceCleaner(Surface=wall, MinimumAngle=10)
 * clean.UpdatePipeline()
 * print(clean.GetDataInformation().GetNumberOfCells(), "triangles")
 * @endcode
 *
 * @sa coronary::CleanSurface, vtkTetrahedralMesher
 */
#ifndef vtkSurfaceCleaner_h
#define vtkSurfaceCleaner_h

#include "vtkCoronaryVolumeModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <string> // for std::string

class VTKCORONARYVOLUME_EXPORT vtkSurfaceCleaner : public vtkPolyDataAlgorithm
{
public:
  static vtkSurfaceCleaner* New();
  vtkTypeMacro(vtkSurfaceCleaner, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * A component with less than this part of the largest one's area is left out, 0 to 1. Default
   * 0.01.
   */
  vtkSetMacro(MinimumComponentShare, double);
  vtkGetMacro(MinimumComponentShare, double);
  ///@}

  ///@{
  /**
   * Open ends that face each other at less than this are joined; in their radii, 0 (never) to 10.
   * Default 1.
   */
  vtkSetMacro(JoinDistance, double);
  vtkGetMacro(JoinDistance, double);
  ///@}

  ///@{
  /**
   * Whether holes in the wall are filled. Default true.
   */
  vtkSetMacro(FillHoles, bool);
  vtkGetMacro(FillHoles, bool);
  vtkBooleanMacro(FillHoles, bool);
  ///@}

  ///@{
  /**
   * Whether open ends of vessels get flat caps. Default true.
   */
  vtkSetMacro(CapEnds, bool);
  vtkGetMacro(CapEnds, bool);
  vtkBooleanMacro(CapEnds, bool);
  ///@}

  ///@{
  /**
   * Whether triangles that cut others are taken out, with what is then inside, and replaced. Default
   * true.
   */
  vtkSetMacro(ResolveIntersections, bool);
  vtkGetMacro(ResolveIntersections, bool);
  vtkBooleanMacro(ResolveIntersections, bool);
  ///@}

  ///@{
  /**
   * Triangles with a smaller angle are worked on; degrees, 0 (none) to 30. Default 10.
   */
  vtkSetMacro(MinimumAngle, double);
  vtkGetMacro(MinimumAngle, double);
  ///@}

  ///@{
  /**
   * Name of the array with the ids of wall and caps. Default CellEntityIds.
   */
  vtkSetMacro(EntityArrayName, std::string);
  vtkGetMacro(EntityArrayName, std::string);
  ///@}

protected:
  vtkSurfaceCleaner();
  ~vtkSurfaceCleaner() override = default;

  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkSurfaceCleaner(const vtkSurfaceCleaner&) = delete;
  void operator=(const vtkSurfaceCleaner&) = delete;

  double MinimumComponentShare = 0.01;
  double JoinDistance = 1.0;
  bool FillHoles = true;
  bool CapEnds = true;
  bool ResolveIntersections = true;
  double MinimumAngle = 10.0;
  std::string EntityArrayName;
};

#endif
