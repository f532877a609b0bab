/**
 * @class   vtkSkeletonPose
 * @brief   Poses a skeleton by hand: a list of edits, done one after the other.
 *
 * Forward kinematics: what is beyond a joint turns and moves with it. Every edit has a joint, a twist
 * along the bone that ends in it, a rotation, a translation, and a change of the cross-section (a
 * stenosis or a dilatation). Then one joint, the chosen one, may be put at a place, with what is beyond it
 * or alone, and turned: that is what ParaView's handle does. Undo and redo are those of the properties.
 *
 * @par Input ports:
 * - 0: vtkPolyData, the skeleton at rest, as of vtkCenterlineSkeleton: points are joints, lines of two points
 *   bones; point data `ParentJoint` (optional).
 * - 1, optional: vtkPolyData, the same skeleton posed: where the edits begin. Its time goes on.
 *
 * @par Output port:
 * - 0: vtkPolyData, the skeleton with the same cells and arrays and other points. Cell data
 *   `BoneRotation` (double[4]: w x y z, from rest, at the bone's first joint), `BoneTwist` (double,
 *   radians by which the bone's second end is turned about it against the first), `AxialStrain` (double,
 *   posed length / rest length - 1). Point data `CalibreFactor` (double, of the radius).
 *
 * The output is whole in piece 0, and empty in every other piece. An empty input gives an empty output.
 *
 * @par Time:
 * With input 1 TIME_STEPS and TIME_RANGE are those of input 1, else time passes through from input 0.
 *
 * @par Failure:
 * A joint that does not exist, a number that is not finite, a calibre that is not positive, a bone that
 * would lose its length, lines that are no bones, a posed skeleton with other bones: one error and no output.
 * An aborted execution leaves an empty output and is started anew by the next request.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1)
 * tree = ReferencePhase(Input=phantom["Centerlines"], Automatic=0, Time=0.75)
 * skeleton = CenterlineSkeleton(Centerlines=tree)
 * pose = SkeletonPose(Skeleton=skeleton, MoveTheChosenJoint=1, ChosenJoint=5, JointRotation=[0, 20, 0])
 * pose.UpdatePipeline()
 * print(pose.GetDataInformation().GetBounds())
 * @endcode
 *
 * @sa coronary::ApplyPoseEdit, vtkSkinDeformation
 */
#ifndef vtkSkeletonPose_h
#define vtkSkeletonPose_h

#include "vtkCoronarySkinningModule.h" // for the export macro
#include "vtkNew.h"                    // for vtkNew
#include "vtkPolyDataAlgorithm.h"

#include <array>  // for std::array
#include <string> // for std::string
#include <vector> // for std::vector

class vtkDoubleArray;

namespace coronary
{
class SkeletonRig;
template <typename Scalar>
struct BasicSkeletonPose;
using SkeletonPose = BasicSkeletonPose<double>;
}

class VTKCORONARYSKINNING_EXPORT vtkSkeletonPose : public vtkPolyDataAlgorithm
{
public:
  static vtkSkeletonPose* New();
  vtkTypeMacro(vtkSkeletonPose, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /// The pose that the edits begin with (port 1).
  void SetStartConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }

  ///@{
  /**
   * The list of edits. Twist and rotation in degrees, the rotation as a vector along its axis with the
   * angle as its length; translation in mm; calibre: factor of the radius, 1 for none; reach: mm along
   * the skeleton within which the change of calibre falls to nothing on both sides, 0 for the joint alone.
   */
  void AddEdit(double joint, double twist, double rotationX, double rotationY, double rotationZ,
    double translationX, double translationY, double translationZ, double calibre, double reach);
  void RemoveAllEdits();
  int GetNumberOfEdits() const { return static_cast<int>(this->Edits.size()); }
  ///@}

  ///@{
  /**
   * Whether the chosen joint is put at JointPosition, after the list. Default off.
   */
  vtkSetMacro(MoveJoint, bool);
  vtkGetMacro(MoveJoint, bool);
  vtkBooleanMacro(MoveJoint, bool);
  ///@}

  ///@{
  /**
   * The chosen joint, a point of the skeleton. Default 0.
   */
  vtkSetMacro(Joint, vtkIdType);
  vtkGetMacro(Joint, vtkIdType);
  ///@}

  ///@{
  /**
   * Where the chosen joint is put, mm. Default 0 0 0.
   */
  vtkSetVector3Macro(JointPosition, double);
  vtkGetVector3Macro(JointPosition, double);
  ///@}

  enum MoveModes
  {
    MoveAlone = 0,
    MoveBeyond = 1,
    TurnBone = 2,
    TurnBoneOnly = 3
  };

  ///@{
  /**
   * What moves with the chosen joint: nothing (0), what is beyond it without turning (1), the bone that ends in
   * it turns towards the place, and stretches to it, with all that is beyond it (2), or turns and keeps
   * its length, so that the joint comes to lie on the line to the place (3). Default 1. At a root, which no
   * bone ends in, 2 and 3 are 1.
   */
  vtkSetClampMacro(MoveMode, int, MoveAlone, TurnBoneOnly);
  vtkGetMacro(MoveMode, int);
  ///@}

  ///@{
  /**
   * Rotation of all beyond the chosen joint about it, after it was put at its place: a vector along the axis with
   * the angle in degrees as its length. Not with MoveAlone. Default 0 0 0.
   */
  vtkSetVector3Macro(JointRotation, double);
  vtkGetVector3Macro(JointRotation, double);
  ///@}

  /**
   * Of the last execution: places of all joints, x y z after each other, mm, when the edits were done and
   * before the chosen joint was moved. Where a handle begins. Empty after an error.
   */
  vtkDoubleArray* GetJointPlaces();

  /**
   * Of the last execution: the move of the chosen joint as an edit, 10 values as of AddEdit. Empty
   * when there was none, or one that is no edit (MoveAlone).
   */
  vtkDoubleArray* GetMoveAsEdit();

protected:
  vtkSkeletonPose();
  ~vtkSkeletonPose() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkSkeletonPose(const vtkSkeletonPose&) = delete;
  void operator=(const vtkSkeletonPose&) = delete;

  void Move(const coronary::SkeletonRig& rig, coronary::SkeletonPose& pose);

  std::vector<std::array<double, 10>> Edits;
  bool MoveJoint = false;
  vtkIdType Joint = 0;
  double JointPosition[3] = { 0.0, 0.0, 0.0 };
  int MoveMode = MoveBeyond;
  double JointRotation[3] = { 0.0, 0.0, 0.0 };
  vtkNew<vtkDoubleArray> JointPlaces;
  vtkNew<vtkDoubleArray> MoveAsEdit;
};

#endif
