/**
 * @class   vtkTetrahedralMesher
 * @brief   Tetrahedra in closed triangle surfaces, with a skeleton's points and edges among theirs.
 *
 * Constrained Delaunay tetrahedralization by TetGen, or Delaunay refinement by CGAL, each in a
 * process of its own that can crash, hang or leave without harm. The worst tetrahedra are improved
 * afterwards. See docs/surface.md.
 *
 * @par Input ports:
 * - 0: vtkPolyData, one or more closed surfaces of triangles. Cell data `CellEntityIds` (optional;
 *   without it all is wall, 1) is kept on the boundary.
 * - 1, optional: vtkPolyData, the skeleton: lines whose points become vertices and whose segments
 *   become edges of the mesh. Point data: radius in mm, by default `MaximumInscribedSphereRadius`,
 *   or `Radius` where there is no such array, or none.
 *
 * @par Output ports:
 * - 0, vtkUnstructuredGrid of tetrahedra. Point data `SurfacePointId`, `SkeletonPointId` (vtkIdType,
 *   -1 elsewhere). Cell data `RegionIds` (int, number of the component, from 0 in the order of the
 *   surface's cells), `CellEntityIds` (int, 0), `TetrahedronVolume` (double, mm^3),
 *   `MinimumDihedralAngle` (double, radians), `RadiusEdgeRatio` (double). Field data, the summary:
 *   `Backend` (string), `Tries` (int), `RepairDisplacement` (double, mm), `MeshMinimumDihedralAngle`
 *   (double, radians), `PoorFraction` (double: share of tetrahedra below 15 degrees), `MeshMinimumVolume`,
 *   `TotalVolume` (double, mm^3), `MeshMaximumRadiusEdgeRatio` (double), `Warnings` (string).
 * - 1, vtkPolyData: the boundary, on the same points. Cell data of the input's surface, with
 *   `CellEntityIds`, and `SurfaceCellId`, `TetrahedronId` (vtkIdType); point data as of port 0.
 * - 2, vtkPolyData: the mesh's edges along the skeleton, on the same points. Cell data
 *   `SkeletonEdgeId` (vtkIdType: segments of the skeleton's lines, counted through).
 *
 * The output is whole in piece 0, and empty in every other piece. An empty input gives an empty
 * output.
 *
 * @par Time:
 * Passes through from input 0: every time step is computed by itself. Two steps have
 * different tetrahedra; for one topology move one mesh with vtkSkinDeformation.
 *
 * @par Failure:
 * A surface that is open, not a manifold, doubled, without volume or cuts itself, cells that are no
 * triangles, a skeleton point outside, a setting out of range, a backend that is not there or fails
 * twice: one error that names cells and position, and no output. Inside-out surfaces are turned over
 * with a warning. An aborted execution leaves an empty output and is started anew by the next
 * request.
 *
 * @par Python:
 * @code{.py}
 * tree = TGFSkeletonReader(FileName="tree.tgf", Radius=1.5)
 * wall = FrenetSweepSurface(Input=tree["Tree"], MinimumEdgeLength=0.4, MaximumEdgeLength=1)
 * skeleton = CenterlineSkeleton(Centerlines=tree["Tree"])
 * mesh = TetrahedralMesher(Surface=wall["Surface"], Skeleton=skeleton, LeaveOutPointsOutside=1)
 * mesh.UpdatePipeline()
 * print(mesh["Volume"].GetDataInformation().GetNumberOfCells(), "tetrahedra")
 * @endcode
 *
 * @sa coronary::MakeTetrahedralMesh
 */
#ifndef vtkTetrahedralMesher_h
#define vtkTetrahedralMesher_h

#include "vtkCoronaryVolumeModule.h" // for the export macro
#include "vtkUnstructuredGridAlgorithm.h"

#include <string> // for std::string

class vtkPolyData;

class VTKCORONARYVOLUME_EXPORT vtkTetrahedralMesher : public vtkUnstructuredGridAlgorithm
{
public:
  static vtkTetrahedralMesher* New();
  vtkTypeMacro(vtkTetrahedralMesher, vtkUnstructuredGridAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum InputPorts
  {
    SurfacePort = 0,
    SkeletonPort = 1
  };

  enum OutputPorts
  {
    VolumePort = 0,
    BoundaryPort = 1,
    EdgesPort = 2
  };

  enum Backends
  {
    AutomaticBackend = 0, ///< TetGen where it was built in, else CGAL
    TetGenBackend = 1,    ///< keeps the surface
    CgalBackend = 2       ///< meshes the surface anew
  };

  ///@{
  /**
   * The skeleton. Optional.
   */
  void SetSkeletonConnection(vtkAlgorithmOutput* output)
  {
    this->SetInputConnection(SkeletonPort, output);
  }
  void SetSkeletonData(vtkPolyData* skeleton);
  ///@}

  ///@{
  /**
   * Who meshes. Default AutomaticBackend.
   */
  vtkSetMacro(Backend, int);
  vtkGetMacro(Backend, int);
  ///@}

  ///@{
  /**
   * Bound on the radius of the circumscribed sphere over the shortest edge, 1.1 to 10. Default 1.4.
   */
  vtkSetMacro(RadiusEdgeRatio, double);
  vtkGetMacro(RadiusEdgeRatio, double);
  ///@}

  ///@{
  /**
   * Dihedral angle in degrees that is aimed at, 0 to 20; nearly all tetrahedra reach it. Default 15.
   */
  vtkSetMacro(MinimumDihedralAngle, double);
  vtkGetMacro(MinimumDihedralAngle, double);
  ///@}

  ///@{
  /**
   * A tetrahedron that is not larger than this is an error; mm^3, 0 or more. Default 1e-7.
   */
  vtkSetMacro(MinimumVolume, double);
  vtkGetMacro(MinimumVolume, double);
  ///@}

  ///@{
  /**
   * Edge length inside over the local radius, 0.05 to 10; never finer than the wall. 0, the default:
   * the edges grow from the wall inwards.
   */
  vtkSetMacro(SizeFactor, double);
  vtkGetMacro(SizeFactor, double);
  ///@}

  ///@{
  /**
   * Whether a surface that cuts itself, fails, or leaves tetrahedra below 5 degrees is repaired once
   * and meshed again, with displacements below 1 % of the local radius. Default on.
   */
  vtkSetMacro(Repair, bool);
  vtkGetMacro(Repair, bool);
  vtkBooleanMacro(Repair, bool);
  ///@}

  ///@{
  /**
   * Whether skeleton points outside of the surface are left out with a warning; else they are an
   * error. Default off.
   */
  vtkSetMacro(LeaveOutside, bool);
  vtkGetMacro(LeaveOutside, bool);
  vtkBooleanMacro(LeaveOutside, bool);
  ///@}

  ///@{
  /**
   * Seconds of processor time, or of doing nothing, after which a mesher's process is stopped, positive.
   * Default 300.
   */
  vtkSetMacro(TimeLimit, double);
  vtkGetMacro(TimeLimit, double);
  ///@}

  ///@{
  /**
   * Folder of the workers' executables; empty, the default: where they were installed.
   */
  vtkSetStdStringFromCharMacro(WorkerFolder);
  vtkGetCharFromStdStringMacro(WorkerFolder);
  ///@}

  ///@{
  /**
   * Name of the arrays with the ids of wall and caps, in the surface and in the outputs.
   * Default `CellEntityIds`.
   */
  vtkSetStdStringFromCharMacro(EntityArrayName);
  vtkGetCharFromStdStringMacro(EntityArrayName);
  ///@}

  vtkPolyData* GetBoundary();
  vtkPolyData* GetEdges();

protected:
  vtkTetrahedralMesher();
  ~vtkTetrahedralMesher() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkTetrahedralMesher(const vtkTetrahedralMesher&) = delete;
  void operator=(const vtkTetrahedralMesher&) = delete;

  int Backend = AutomaticBackend;
  double RadiusEdgeRatio = 1.4;
  double MinimumDihedralAngle = 15.0;
  double MinimumVolume = 1e-7;
  double SizeFactor = 0.0;
  bool Repair = true;
  bool LeaveOutside = false;
  double TimeLimit = 300.0;
  std::string WorkerFolder;
  std::string EntityArrayName;
};

#endif
