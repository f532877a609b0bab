/**
 * @class   vtkSkinDeformation
 * @brief   Moves any points that hang on bones: mesh, weights and pose(t) to mesh(t).
 *
 * Works on surfaces, tetrahedra and any other point set with the weights of the bones. What the weights,
 * the mesh at rest and the skeleton at rest give is kept; a new pose or time costs one pass over the points
 * (under a millisecond for 100,000 of them, in single precision).
 *
 * @par Input ports:
 * - 0: vtkPointSet or a composite of them, the mesh at rest. Point data `BoneIndices` (integers, one component a bone of a point,
 *   -1 where there is none) and `BoneWeightsCompact` (as many components), as of
 *   vtkBiharmonicSkinWeights.
 * - 1: vtkPolyData, the skeleton at rest that the weights were made with: points are joints, lines of two
 *   points bones, in the order of the indices.
 * - 2: vtkPolyData, the skeleton posed: the same cells, other points. Cell data `BoneRotation`
 *   (double[4], w x y z) and `BoneTwist` (double, radians), point data `CalibreFactor` (double): all optional. Without
 *   rotations bones turn with the least twist. Their derivatives, as of vtkCardiacPhaseInterpolator, are for the velocity: point
 *   data `Velocity` (double[3], mm/s), `CalibreRate` (double, 1/s), cell data `BoneAngularVelocity` (double[3], radians/s about axes
 *   of the world), `BoneTwistRate` (double, radians/s). May have time; the output has the same.
 *
 * @par Output port:
 * - 0: the mesh with moved points. Cells and all other arrays are the input's own, but for its active
 *   normals, which would be wrong. Point data `Displacement` (float[3], double[3] with DoublePrecision; mm, from rest), `Velocity`
 *   (the same, mm/s, optional), `Normals` (the same, unit, of the moved triangles, optional). Cell data `VolumeRatio` (double,
 *   tetrahedra: signed volume / that at rest; NaN for other cells) when tetrahedra are checked. Field
 *   data: `InvertedTetrahedra` (vtkIdType, cells that are left, with a warning), `RepairedTetrahedra`
 *   (vtkIdType, how many were repaired), `BoneEndsAtRest`, `BoneParent`, `BoneMotion` (see vtkBoneMotion.h), that
 *   of the mesh and of the pose.
 *
 * Points move by themselves: pieces of a mesh may be on different ranks, each has the whole skeleton
 * (normals at the seams of pieces are those of the piece). Blocks of a composite mesh are moved one by
 * one; blocks that are no point sets are passed on as they are.
 *
 * @par Time:
 * TIME_STEPS and TIME_RANGE are those of the pose (input 2). A request goes to the pose; mesh and skeleton at rest are
 * read once.
 *
 * @par Failure:
 * A missing or wrong array, a point without weights, an index of a bone that does not exist, a pose
 * with other bones, with values that are not finite or with a bone without length: one error and no output. An
 * empty mesh gives an empty output. An aborted execution leaves an empty output and is started anew by
 * the next request.
 *
 * @par Python:
 * @code{.py}
 * tree = TGFSkeletonReader(FileName="tree.tgf", Radius=1.5)
 * wall = FrenetSweepSurface(Input=tree["Tree"], MinimumEdgeLength=0.4, MaximumEdgeLength=1)
 * skeleton = CenterlineSkeleton(Centerlines=tree["Tree"])
 * mesh = TetrahedralMesher(Surface=wall["Surface"], Skeleton=skeleton, LeaveOutPointsOutside=1, MinimumVolume=0)
 * weights = BiharmonicSkinWeights(Mesh=mesh["Volume"], Skeleton=skeleton)
 * pose = SkeletonPose(Skeleton=skeleton, MoveTheChosenJoint=1, ChosenJoint=5, JointRotation=[0, 20, 0])
 * moved = SkinDeformation(Mesh=weights, SkeletonAtRest=skeleton, PosedSkeleton=pose)
 * moved.UpdatePipeline()
 * print(moved.GetDataInformation().GetBounds())
 * @endcode
 *
 * @sa coronary::SkinDeformation, vtkSkeletonPose, vtkBiharmonicSkinWeights
 */
#ifndef vtkSkinDeformation_h
#define vtkSkinDeformation_h

#include "vtkCoronarySkinningModule.h" // for the export macro
#include "vtkPassInputTypeAlgorithm.h"

#include <functional> // for std::function
#include <memory>     // for std::unique_ptr
#include <string>     // for std::string

class vtkPointSet;

class VTKCORONARYSKINNING_EXPORT vtkSkinDeformation : public vtkPassInputTypeAlgorithm
{
public:
  static vtkSkinDeformation* New();
  vtkTypeMacro(vtkSkinDeformation, vtkPassInputTypeAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Connections by name: skeleton at rest (port 1), posed skeleton (port 2).
   */
  void SetRestConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetPoseConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }
  ///@}

  enum BlendModes
  {
    LinearBlend = 0,
    DualQuaternion = 1
  };

  ///@{
  /**
   * How the motions of several bones are blended: linearly (default), or as dual quaternions, which
   * keep the calibre in strong bends and twists.
   */
  vtkSetClampMacro(Blend, int, LinearBlend, DualQuaternion);
  vtkGetMacro(Blend, int);
  ///@}

  ///@{
  /**
   * Whether points follow the stretch of their bones, evenly along them. Default on.
   */
  vtkSetMacro(Stretch, bool);
  vtkGetMacro(Stretch, bool);
  vtkBooleanMacro(Stretch, bool);
  ///@}

  ///@{
  /**
   * Cross-sections answer to the stretch: 0 (default) not at all, 1 such that the volume is kept.
   */
  vtkSetMacro(VolumeConservation, double);
  vtkGetMacro(VolumeConservation, double);
  ///@}

  ///@{
  /**
   * Whether the moved points are in double precision, about 40 times slower. Default off.
   */
  vtkSetMacro(DoublePrecision, bool);
  vtkGetMacro(DoublePrecision, bool);
  vtkBooleanMacro(DoublePrecision, bool);
  ///@}

  ///@{
  /**
   * Whether the velocity is computed: the exact derivative of the points by time, out of that of the pose. Where the
   * pose has `Velocity` and the derivative of all its other arrays, these are taken. Else the pose is differentiated: where
   * poses come at any time (of a source with TIME_RANGE that gives what it is asked for), by the central difference over two
   * thousandths of the range, beyond the range's ends too when the source is periodic, else at its ends by the parabola through
   * the next three poses; where they come at steps only, by the difference of the steps before and after, in seconds by
   * the pose's field array `CycleLength`, those of a unit of time; without it time itself is taken for seconds.
   * Default off.
   */
  vtkSetMacro(ComputeVelocity, bool);
  vtkGetMacro(ComputeVelocity, bool);
  vtkBooleanMacro(ComputeVelocity, bool);
  ///@}

  ///@{
  /**
   * Whether normals of the moved triangles are computed, of poly data. Default off.
   */
  vtkSetMacro(ComputeNormals, bool);
  vtkGetMacro(ComputeNormals, bool);
  vtkBooleanMacro(ComputeNormals, bool);
  ///@}

  enum TetrahedronModes
  {
    IgnoreTetrahedra = 0,
    CheckTetrahedra = 1,
    RepairTetrahedra = 2
  };

  ///@{
  /**
   * What is done about inverted tetrahedra of an unstructured grid: nothing, report, or repair and report
   * what is left (default).
   */
  vtkSetClampMacro(Tetrahedra, int, IgnoreTetrahedra, RepairTetrahedra);
  vtkGetMacro(Tetrahedra, int);
  ///@}

  ///@{
  /**
   * Tetrahedra at or below this share of their volume at rest count as inverted, 0 to 0.5. Default 0.
   */
  vtkSetMacro(MinimumVolumeRatio, double);
  vtkGetMacro(MinimumVolumeRatio, double);
  ///@}

  /// For tests: how often a mesh and its weights were read.
  int GetNumberOfSetups() const;

protected:
  vtkSkinDeformation();
  ~vtkSkinDeformation() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkSkinDeformation(const vtkSkinDeformation&) = delete;
  void operator=(const vtkSkinDeformation&) = delete;

  struct Internals;
  struct Stencil;
  /// For poses without velocities: asks for those around the one that is there, which is there again in the end.
  void FindStencil(vtkInformation* poseInfo, Stencil& stencil);
  template <typename Array>
  void Execute(vtkPointSet* mesh, vtkInformationVector** inputs, const Stencil& stencil,
    vtkPointSet* output, const std::function<bool(double)>& progress);
  void Execute(vtkDataObject* mesh, vtkInformationVector** inputs, const Stencil& stencil,
    vtkDataObject* output, const std::function<bool(double)>& progress);

  int Blend = LinearBlend;
  bool Stretch = true;
  double VolumeConservation = 0.0;
  bool DoublePrecision = false;
  bool ComputeVelocity = false;
  bool ComputeNormals = false;
  int Tetrahedra = RepairTetrahedra;
  double MinimumVolumeRatio = 0.0;
  std::unique_ptr<Internals> Data;
};

#endif
