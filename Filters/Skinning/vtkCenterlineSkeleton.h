/**
 * @class   vtkCenterlineSkeleton
 * @brief   Joints and bones along the centerlines of a forest of vessels.
 *
 * Joints stand at every root, bifurcation and end, and between them so that bones are some radii
 * long, shorter where the vessel is curved. See docs/skinning.md.
 *
 * @par Input port:
 * - 0: vtkPolyData, a tree of centerlines: polylines with cell arrays `GroupIds`, `ParentGroupIds`,
 *   as of vtkCoronaryTreeTopology or vtkTGFReader. Point data: radius in mm, by default
 *   `MaximumInscribedSphereRadius`, or `Radius` where there is no such array; `SegmentIds`
 *   (optional). Cell data `TreeIds`, `SegmentIds` (optional).
 *
 * @par Output port:
 * - 0: vtkPolyData. Points are joints, a parent before its daughters; cells are lines of two points,
 *   bones in the order of their ids. Point data: `ParentJoint` (vtkIdType, the next joint towards the
 *   root, -1 at a root), `MaximumInscribedSphereRadius` (double, mm), `Abscissas` (double, mm from
 *   the root along the tree). Cell data: `BoneId` (int), `GroupIds` (int, branch of the input that
 *   the bone is of), `TreeIds`, `SegmentIds` (int, coronary::SegmentId, 0 unnamed), `Length`
 *   (double, mm along the vessel). Field data: `BoneName` (string, one a bone: `pLAD-2`), and that
 *   of the input.
 *
 * The same tree gives the same joints, ids and names. The output is whole in piece 0, and empty in
 * every other piece. Blocks of a composite input are treated one by one. An empty input gives an
 * empty output.
 *
 * @par Time:
 * Passes through from input 0: every time step is computed by itself. Put vtkReferencePhase
 * before it for what is made once for a heart.
 *
 * @par Failure:
 * A setting out of range, lines that are no tree, a radius array that is missing or unfit, a
 * coordinate that is not finite, a branch without length: one error that names it, and no output.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1)
 * tree = ReferencePhase(Input=phantom["Centerlines"], Automatic=0, Time=0.75)
 * skeleton = CenterlineSkeleton(Centerlines=tree, LengthPerRadius=2.5)
 * skeleton.UpdatePipeline()
 * print(skeleton.GetDataInformation().GetNumberOfCells(), "bones")
 * @endcode
 *
 * @sa coronary::MakeCenterlineSkeleton, vtkBiharmonicSkinWeights
 */
#ifndef vtkCenterlineSkeleton_h
#define vtkCenterlineSkeleton_h

#include "vtkCoronarySkinningModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <string> // for std::string

class VTKCORONARYSKINNING_EXPORT vtkCenterlineSkeleton : public vtkPolyDataAlgorithm
{
public:
  static vtkCenterlineSkeleton* New();
  vtkTypeMacro(vtkCenterlineSkeleton, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Shortest bone in mm along the vessel, positive; a shorter branch is one bone. Default 3.
   */
  vtkSetMacro(MinimumLength, double);
  vtkGetMacro(MinimumLength, double);
  ///@}

  ///@{
  /**
   * Longest bone in mm along the vessel, at least twice the shortest. Default 8.
   */
  vtkSetMacro(MaximumLength, double);
  vtkGetMacro(MaximumLength, double);
  ///@}

  ///@{
  /**
   * Wanted length of a bone in local radii, 0.5 to 50. Default 3.
   */
  vtkSetMacro(RadiusFactor, double);
  vtkGetMacro(RadiusFactor, double);
  ///@}

  ///@{
  /**
   * Greatest wanted distance of the vessel's axis from the bone in local radii, 0.01 to 1. Default
   * 0.25.
   */
  vtkSetMacro(SagittaRatio, double);
  vtkGetMacro(SagittaRatio, double);
  ///@}

  ///@{
  /**
   * Whether every step of the lines is a bone, whatever its length: for lines that are a skeleton
   * already, as of vtkTGFReader. Default off.
   */
  vtkSetMacro(EveryStep, bool);
  vtkGetMacro(EveryStep, bool);
  vtkBooleanMacro(EveryStep, bool);
  ///@}

protected:
  vtkCenterlineSkeleton();
  ~vtkCenterlineSkeleton() override = default;

  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkCenterlineSkeleton(const vtkCenterlineSkeleton&) = delete;
  void operator=(const vtkCenterlineSkeleton&) = delete;

  double MinimumLength = 3.0;
  double MaximumLength = 8.0;
  double RadiusFactor = 3.0;
  double SagittaRatio = 0.25;
  bool EveryStep = false;
};

#endif
