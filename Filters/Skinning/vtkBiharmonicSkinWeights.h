/**
 * @class   vtkBiharmonicSkinWeights
 * @brief   Smooth weights within 0 and 1 that tie every point of a tetrahedral mesh to bones inside it.
 *
 * Bounded biharmonic weights (Eq. 5-7 of the method; Jacobson et al., SIGGRAPH 2011), with their sum in
 * the optimisation by default. On a bone its weight is 1 and those of the others are 0; bones that
 * share a joint share it evenly; the wall is free. See docs/skinning.md.
 *
 * @par Input ports:
 * - 0: vtkUnstructuredGrid of tetrahedra, of one or more connected parts, as of vtkTetrahedralMesher.
 *   Bones need not run along its edges.
 * - 1: vtkPolyData, the skeleton: every step of its lines is a bone, as of vtkCenterlineSkeleton or
 *   vtkTGFReader. Field data `BoneName` (string, one a bone; optional).
 *
 * @par Output port:
 * - 0: the mesh of port 0. Point data: `BoneIndices` (int[n], the bones with the greatest weights,
 *   greatest first; -1 where there are fewer), `BoneWeightsCompact` (float[n], theirs, sum 1, 0 where
 *   there are fewer), `DroppedWeight` (float, sum of the weights that found no place and that the
 *   others got in proportion), n = Influences; with Dense, `BoneWeights` (double[bones], components
 *   named as the bones). Field data: that of the mesh; `BoneName` (string); `WeightsConverged` (int, 1
 *   or 0), `WeightsIterations` (int), `WeightsResidual` (double, 2 values: greatest violation of the
 *   conditions of optimality, a weight, where bones may have weight and everywhere), `WeightsEnergy`
 *   (double, 1 / unit of length), `WeightsEnergyGap` (double, bound on the share of the energy above
 *   the least possible one), `WeightsRowSums` (double, 2 values, least and greatest sum before Eq. 7),
 *   `WeightsOnBones` (double, greatest distance from the wanted value on bones that are no edges of the
 *   mesh), `BoneLengthOutside` (double, one a bone); with LeaveOutside `LeftOutBones` (int) and `LeftOutBoneNames` (string).
 *
 * The output is whole in piece 0, and empty in every other piece. Blocks of a composite mesh are
 * treated one by one. An empty mesh gives an empty output. The same bits on any number of threads.
 *
 * @par Time:
 * Passes through from input 0. Weights belong to the mesh and skeleton at rest: put vtkReferencePhase before
 * both, or every time step solves for its own.
 *
 * @par Failure:
 * A setting out of range, cells that are no tetrahedra or have no volume, points without tetrahedra, a
 * skeleton without bones, a bone without length or outside of the mesh, two bones at one point, a part
 * of the mesh without bone: one error that names it, and no output. What did not converge within the
 * iterations, and bones that leave the mesh, are a warning. An aborted execution leaves an empty output
 * and is started anew by the next request.
 *
 * @par Sources:
 * Jacobson et al., Bounded biharmonic weights for real-time deformation, ACM Trans Graph (SIGGRAPH) 2011;30:78. Eq. 5 to 7
 * of Wang et al., arXiv 2503.02218.
 *
 * @par Python:
 * @code{.py}
 * tree = TGFSkeletonReader(FileName="tree.tgf", Radius=1.5)
 * wall = FrenetSweepSurface(Input=tree["Tree"], MinimumEdgeLength=0.4, MaximumEdgeLength=1)
 * skeleton = CenterlineSkeleton(Centerlines=tree["Tree"])
 * mesh = TetrahedralMesher(Surface=wall["Surface"], Skeleton=skeleton, LeaveOutPointsOutside=1, MinimumVolume=0)
 * weights = BiharmonicSkinWeights(Mesh=mesh["Volume"], Skeleton=skeleton, Influences=4)
 * weights.UpdatePipeline()
 * print(weights.PointData["BoneWeightsCompact"].GetNumberOfComponents(), "weights a point")
 * @endcode
 *
 * @sa coronary::ComputeSkinWeights, vtkCenterlineSkeleton
 */
#ifndef vtkBiharmonicSkinWeights_h
#define vtkBiharmonicSkinWeights_h

#include "vtkCoronarySkinningModule.h" // for the export macro
#include "vtkUnstructuredGridAlgorithm.h"

#include <string> // for std::string

class vtkPolyData;

class VTKCORONARYSKINNING_EXPORT vtkBiharmonicSkinWeights : public vtkUnstructuredGridAlgorithm
{
public:
  static vtkBiharmonicSkinWeights* New();
  vtkTypeMacro(vtkBiharmonicSkinWeights, vtkUnstructuredGridAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum InputPorts
  {
    MeshPort = 0,
    SkeletonPort = 1
  };

  enum Modes
  {
    JointMode = 0,       ///< bounds and sum 1 in one optimisation over all bones
    IndependentMode = 1, ///< each bone by itself within its bounds, then divided by the sum (Eq. 7)
    UnboundedMode = 2,   ///< biharmonic without bounds
    HarmonicMode = 3     ///< harmonic, with kinks at the bones
  };

  ///@{
  /**
   * The skeleton.
   */
  void SetSkeletonConnection(vtkAlgorithmOutput* output)
  {
    this->SetInputConnection(SkeletonPort, output);
  }
  void SetSkeletonData(vtkPolyData* skeleton);
  ///@}

  ///@{
  /**
   * What is minimised under which conditions. Default JointMode.
   */
  vtkSetMacro(Mode, int);
  vtkGetMacro(Mode, int);
  ///@}

  ///@{
  /**
   * Greatest violation of the conditions of optimality, a weight, 1e-10 to 0.01. Default 1e-6.
   */
  vtkSetMacro(Tolerance, double);
  vtkGetMacro(Tolerance, double);
  ///@}

  ///@{
  /**
   * Limit of the iterations, 1 to 1000000. Default 2000.
   */
  vtkSetMacro(Iterations, int);
  vtkGetMacro(Iterations, int);
  ///@}

  ///@{
  /**
   * Joint and Independent: how far a bone may have weight, in diameters of the vessel along the bones;
   * 0: everywhere. Default 1.75.
   */
  vtkSetMacro(Neighbourhood, double);
  vtkGetMacro(Neighbourhood, double);
  ///@}

  ///@{
  /**
   * Whether bones wholly outside of the mesh are left out, with a warning: they have no weight anywhere, and
   * the bones keep their numbers. Else they are an error. Default off.
   */
  vtkSetMacro(LeaveOutside, bool);
  vtkGetMacro(LeaveOutside, bool);
  vtkBooleanMacro(LeaveOutside, bool);
  ///@}

  ///@{
  /**
   * Bones a point in the compact form, 1 to 64. Default 8.
   */
  vtkSetMacro(Influences, int);
  vtkGetMacro(Influences, int);
  ///@}

  ///@{
  /**
   * Whether the weights of all bones at all points are given too. Default off.
   */
  vtkSetMacro(Dense, bool);
  vtkGetMacro(Dense, bool);
  vtkBooleanMacro(Dense, bool);
  ///@}

  ///@{
  /**
   * Folder for weights that were computed: the same mesh, skeleton and settings are read from there.
   * It is made when it is missing. Damaged files are a warning, and written anew. Default empty: none.
   */
  vtkSetStdStringFromCharMacro(CacheFolder);
  vtkGetCharFromStdStringMacro(CacheFolder);
  ///@}

protected:
  vtkBiharmonicSkinWeights();
  ~vtkBiharmonicSkinWeights() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkBiharmonicSkinWeights(const vtkBiharmonicSkinWeights&) = delete;
  void operator=(const vtkBiharmonicSkinWeights&) = delete;

  int Mode = JointMode;
  double Tolerance = 1e-6;
  int Iterations = 2000;
  double Neighbourhood = 1.75;
  bool LeaveOutside = false;
  int Influences = 8;
  bool Dense = false;
  std::string CacheFolder;
};

#endif
