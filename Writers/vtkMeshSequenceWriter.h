/**
 * @class vtkMeshSequenceWriter
 * @brief Writes a mesh that moves as one mesh with many positions, for simulations of blood flow.
 *
 * All phases have the same points, elements, boundary triangles and ids. That is checked, not assumed.
 * Beside the meshes stands how good their elements are at every phase: inverted and poor tetrahedra,
 * least volume and angle, radius-edge ratio, total volume, surface area. See docs/exchange.md.
 *
 * @par Input ports:
 * - 0: vtkUnstructuredGrid of tetrahedra, or vtkPolyData of triangles, with time; usually
 *   vtkSkinDeformation behind vtkCardiacPhaseInterpolator. Data without time are one phase.
 * - 1, optional: vtkPolyData, the boundary triangles with cell data `CellEntityIds` (1 wall, 2.. caps), on
 *   the same points: port 1 of vtkTetrahedralMesher. Or with point data `MeshPointId`, as this
 *   writer makes it. Without it all of the boundary is wall. Only for tetrahedra: a surface has its own.
 * - 2, optional: vtkPolyData, the caps: point data `CellEntityIds`, `IsInlet`, `SegmentLabel`, as
 *   port 2 of vtkFrenetSweepSurface. They give the caps their names.
 *
 * @par Files, all beside FileName, DIR/NAME.json:
 * - series (ParaView): NAME_volume_000.vtu .., NAME_surface_000.vtp .., and of both a .pvd and a .series list
 * - SimVascular: NAME_simvascular/phase_000/mesh-complete/ with mesh-complete.mesh.vtu,
 *   mesh-complete.exterior.vtp, walls_combined.vtp, mesh-surfaces/FACE.vtp: `GlobalNodeID`, `GlobalElementID`,
 *   `ModelFaceID`, `ModelRegionID` (int, from 1)
 * - VMTK: NAME_vmtk_000.vtu ..: the tetrahedra with `CellEntityIds` 0, then the boundary triangles with theirs
 * - OBJ, PLY, STL: the surface, NAME_surface_000.obj .., and a .series list
 * - glTF: NAME_skin.glb, or NAME_skin.gltf: the surface at rest, its bones as a skin, and their motion. Needs the arrays
 *   of vtkSkinDeformation: `Displacement`, `BoneIndices`, `BoneWeightsCompact`, field data of vtkBoneMotion.h
 * - NAME_quality.csv, and NAME.json: quality, faces and files
 *
 * Tetrahedra come out with `TetrahedronVolume`, `MinimumDihedralAngle`, `RadiusEdgeRatio` of the phase, and field
 * data `PhaseTime`, `InvertedTetrahedra` (ids), `PoorFraction`, `MeshMinimumVolume`, `MeshMinimumDihedralAngle`,
 * `MeshMaximumRadiusEdgeRatio`, `TotalVolume`, `SurfaceArea`. A mesh whose tetrahedra are nearly all inside out at the
 * first phase has another order of corners, and is turned over at all phases.
 *
 * With PrefixFiles off, `NAME_` is left out: surface_000.vtp. Digits is the least number of digits of a phase.
 *
 * All files appear together when the last one is whole; older ones stay until then. Then those that an older
 * NAME.json stands for are gone: nothing of a longer sequence stays among the new one.
 *
 * @par Time:
 * Writes the phases that `Phases` says, one after the other, and asks its input for each.
 *
 * @par Failure:
 * Other points or cells at one phase, cells of other kinds, a position that is not finite, a boundary that is not
 * the mesh's, times that do not increase, an input that does not answer for a time, a setting out of
 * range, a file that can not be written: one error that names it, Write() returns 0 and no file is changed.
 * Inverted tetrahedra are no failure: one warning names the phases.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, SurfaceSpacing=1, Phases=[0.0, 0.5])
 * SaveData("wall.json", proxy=phantom["Surface"], STL=1)
 * print(open("wall_quality.csv").readline())
 * @endcode
 *
 * @sa vtkSkinDeformation, vtkCardiacPhaseInterpolator, vtkTetrahedralMesher, coronary::MeasureTetrahedra
 */
#ifndef vtkMeshSequenceWriter_h
#define vtkMeshSequenceWriter_h

#include "vtkCoronaryWritersModule.h" // for the export macro
#include "vtkNew.h"                   // for vtkNew
#include "vtkWriter.h"

#include <map>    // for std::map
#include <string> // for std::string
#include <vector> // for std::vector

class vtkInformation;
class vtkTable;

namespace coronary
{
class ItemSharing;
class StagedFolder;
}

class VTKCORONARYWRITERS_EXPORT vtkMeshSequenceWriter : public vtkWriter
{
public:
  static vtkMeshSequenceWriter* New();
  vtkTypeMacro(vtkMeshSequenceWriter, vtkWriter);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /// Boundary (port 1) and caps (port 2). Optional.
  void SetBoundaryConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetCapsConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }
  ///@}

  ///@{
  /// The report, DIR/NAME.json; the other files stand beside it. Default: none.
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

#ifndef __VTK_WRAP__
  /**
   * Who writes which phases, to unfinished files that all of these have in common: for the folder of FileName, and
   * committed by its owner when all have written. The owner also writes the report and the lists. Not owned;
   * without (default): all is written here, and committed.
   */
  void SetSharing(coronary::ItemSharing* sharing, coronary::StagedFolder* folder)
  {
    this->Sharing = sharing;
    this->Folder = folder;
  }
#endif

  enum PhaseKinds
  {
    InputSteps = 0,
    EvenPhases = 1,
    ListedTimes = 2
  };

  ///@{
  /// Which phases: the time steps of the input (0, default), NumberOfPhases even ones of a cycle (1), or a list (2).
  vtkSetMacro(Phases, int);
  vtkGetMacro(Phases, int);
  ///@}

  ///@{
  /// Of even phases: StartTime + k Period / NumberOfPhases. 1 to 100000. Default 20.
  vtkSetMacro(NumberOfPhases, int);
  vtkGetMacro(NumberOfPhases, int);
  ///@}

  ///@{
  /// The first of the even phases, in the unit of the input's time. Default 0.
  vtkSetMacro(StartTime, double);
  vtkGetMacro(StartTime, double);
  ///@}

  ///@{
  /// One cycle in the unit of the input's time, positive: of even phases, and of glTF's loop. Default 1.
  vtkSetMacro(Period, double);
  vtkGetMacro(Period, double);
  ///@}

  ///@{
  /// The list of times, increasing.
  void AddTime(double time);
  void RemoveAllTimes();
  ///@}

  ///@{
  /// ParaView's series. Default on.
  vtkSetMacro(WriteSeries, bool);
  vtkGetMacro(WriteSeries, bool);
  vtkBooleanMacro(WriteSeries, bool);
  ///@}

  ///@{
  /// SimVascular's folders. Needs tetrahedra. Default off.
  vtkSetMacro(WriteSimVascular, bool);
  vtkGetMacro(WriteSimVascular, bool);
  vtkBooleanMacro(WriteSimVascular, bool);
  ///@}

  ///@{
  /// VMTK's meshes. Needs tetrahedra. Default off.
  vtkSetMacro(WriteVmtk, bool);
  vtkGetMacro(WriteVmtk, bool);
  vtkBooleanMacro(WriteVmtk, bool);
  ///@}

  ///@{
  /// The surface as numbered files of other programs, and their .series lists. Default off.
  vtkSetMacro(WriteObj, bool);
  vtkGetMacro(WriteObj, bool);
  vtkBooleanMacro(WriteObj, bool);
  vtkSetMacro(WritePly, bool);
  vtkGetMacro(WritePly, bool);
  vtkBooleanMacro(WritePly, bool);
  vtkSetMacro(WriteStl, bool);
  vtkGetMacro(WriteStl, bool);
  vtkBooleanMacro(WriteStl, bool);
  ///@}

  ///@{
  /// The surface on its bones as one animated glTF file, binary (.glb) or text (.gltf). Default off.
  vtkSetMacro(WriteGltf, bool);
  vtkGetMacro(WriteGltf, bool);
  vtkBooleanMacro(WriteGltf, bool);
  vtkSetMacro(WriteGltfJson, bool);
  vtkGetMacro(WriteGltfJson, bool);
  vtkBooleanMacro(WriteGltfJson, bool);
  ///@}

  ///@{
  /// Nodes that a point of the glTF file may hang on: 4 (default; what every viewer reads), 8, 12 or 16.
  vtkSetMacro(GltfInfluences, int);
  vtkGetMacro(GltfInfluences, int);
  ///@}

  ///@{
  /// Whether the glTF animation comes back to its first phase after a Period; phases beyond it are left out. Default on.
  vtkSetMacro(GltfLoop, bool);
  vtkGetMacro(GltfLoop, bool);
  vtkBooleanMacro(GltfLoop, bool);
  ///@}

  ///@{
  /// Unit of length in SimVascular's folders, in mm, positive: 1 (default) mm, 10 cm.
  vtkSetMacro(SimVascularUnit, double);
  vtkGetMacro(SimVascularUnit, double);
  ///@}

  ///@{
  /// Whether the weights of the bones go into the files. Default off: they are large, and the same at all phases.
  vtkSetMacro(KeepWeights, bool);
  vtkGetMacro(KeepWeights, bool);
  vtkBooleanMacro(KeepWeights, bool);
  ///@}

  ///@{
  /**
   * Whether the names of the other files begin with the report's: NAME_surface_000.vtp; else surface_000.vtp. Default
   * on.
   */
  vtkSetMacro(PrefixFiles, bool);
  vtkGetMacro(PrefixFiles, bool);
  vtkBooleanMacro(PrefixFiles, bool);
  ///@}

  ///@{
  /// Least number of digits of a phase in the names of files, 1 to 9. Default 3.
  vtkSetMacro(Digits, int);
  vtkGetMacro(Digits, int);
  ///@}

  ///@{
  /// A tetrahedron with a smaller dihedral angle is poor; degrees, 0 to 70. Default 15.
  vtkSetMacro(PoorDihedralAngle, double);
  vtkGetMacro(PoorDihedralAngle, double);
  ///@}

  ///@{
  /**
   * Names of faces by their ids, in files and report: letters, digits, `-`, `_` and `.`. Without one, 1 is
   * `wall`, and a cap is `inlet_` or `outlet_` and the name of its vessel (port 2), or `cap_` and its id.
   */
  void SetFaceName(int id, const char* name);
  void RemoveAllFaceNames();
  ///@}

  ///@{
  /// Name of the cell array with the ids of the faces. Default `CellEntityIds`.
  ///@}

  /**
   * Of the last Write(): a row a phase with `Phase`, `PhaseTime`, `InvertedTetrahedra`, `PoorTetrahedra`,
   * `PoorFraction`, `MeshMinimumVolume` (mm^3), `MeshMinimumDihedralAngle` (radians), `MeshMaximumRadiusEdgeRatio`,
   * `TotalVolume` (mm^3; of a surface, what it encloses), `SurfaceArea` (mm^2), `DegenerateTriangles`. Empty after a failure.
   */
  vtkTable* GetQuality();

  /// @return 1, or 0 when nothing was written
  int Write() override;

protected:
  vtkMeshSequenceWriter();
  ~vtkMeshSequenceWriter() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  void WriteData() override;

private:
  vtkMeshSequenceWriter(const vtkMeshSequenceWriter&) = delete;
  void operator=(const vtkMeshSequenceWriter&) = delete;

  void Validate() const;
  std::vector<double> WantedTimes(vtkInformation* info) const;
  void WritePhases(vtkInformation* info);
  class Run;

  char* FileName = nullptr;
  int Phases = InputSteps;
  int NumberOfPhases = 20;
  double StartTime = 0.0;
  double Period = 1.0;
  std::vector<double> Times;
  bool WriteSeries = true;
  bool WriteSimVascular = false;
  bool WriteVmtk = false;
  bool WriteObj = false;
  bool WritePly = false;
  bool WriteStl = false;
  bool WriteGltf = false;
  bool WriteGltfJson = false;
  int GltfInfluences = 4;
  bool GltfLoop = true;
  double SimVascularUnit = 1.0;
  bool KeepWeights = false;
  bool PrefixFiles = true;
  int Digits = 3;
  double PoorDihedralAngle = 15.0;
  std::map<int, std::string> FaceNames;
  vtkNew<vtkTable> Quality;
  bool Written = false;
  coronary::ItemSharing* Sharing = nullptr;
  coronary::StagedFolder* Folder = nullptr;
};

#endif
