/**
 * @file vtkPosingModel.h
 * @brief A coronary tree that is posed by its joints: what the posing window edits, without the window.
 *
 * The work is done by vtkSkeletonPose and vtkSkinDeformation. docs/deformation.md says how it is used.
 */
#ifndef vtkPosingModel_h
#define vtkPosingModel_h

#include "Geometry.h"
#include "PosingSession.h"
#include "SkeletonPose.h"

#include "vtkNew.h"
#include "vtkSmartPointer.h"

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

class vtkMessageTrap;
class vtkPolyData;
class vtkSkeletonPose;
class vtkSkinDeformation;
class vtkUnstructuredGrid;

namespace coronary
{
/// What the deformation has come to.
struct PosingReport
{
  double maximumDisplacement = 0.0;     ///< of a point of the mesh, mm
  double maximumStrain = 0.0;           ///< of a bone, |posed / rest length - 1|
  double minimumVolumeRatio = 1.0;      ///< signed volume of a tetrahedron / that at rest
  double maximumVolumeRatio = 1.0;      ///< the same
  std::int64_t inverted = 0;            ///< tetrahedra that are inverted, after a repair
  std::int64_t repaired = 0;            ///< tetrahedra that were repaired
  double deformationMilliseconds = 0.0; ///< wall time of the last pose and deformation
};

/// Skeleton, tetrahedra with their weights and boundary out of a folder of `coronary-pipeline run`.
class vtkPosingModel
{
public:
  /**
   * At rest; joint 0 is chosen.
   * @param messages  of VTK; has to live longer
   * @throws std::runtime_error naming the file: the folder is no run until its weights, a file is
   * damaged, files do not belong together
   */
  vtkPosingModel(const std::string& folder, vtkMessageTrap& messages);
  ~vtkPosingModel();
  vtkPosingModel(const vtkPosingModel&) = delete;
  vtkPosingModel& operator=(const vtkPosingModel&) = delete;

  const PosingSettings& Settings() const { return this->Settings_; }
  /// Deforms anew where that changes the skin. @throws std::invalid_argument: bones is not 1 to 64
  void SetSettings(const PosingSettings& settings);

  ///@{
  /// The chosen joint. @throws std::invalid_argument: there is no such joint
  std::int64_t Chosen() const { return this->Chosen_; }
  void Choose(std::int64_t joint);
  ///@}
  std::int64_t NumberOfJoints() const { return this->Rig.NumberOfJoints(); }
  std::int64_t Parent(std::int64_t joint) const; ///< -1 at a root
  std::vector<std::int64_t> Daughters(std::int64_t joint) const;
  Vector3 Joint(std::int64_t joint) const;        ///< where it is now, mm
  std::string BoneName(std::int64_t joint) const; ///< of the bone that ends in it; empty: none

  ///@{
  /**
   * The chosen joint moves. Between BeginMove and EndMove only the last place counts, the list of what can be
   * undone grows by one, and nothing is repaired; CancelMove goes back to the beginning.
   * @param wanted  mm
   * @throws std::runtime_error: not finite, a bone would lose its length; all stays as it was
   */
  void BeginMove();
  void MoveTo(const Vector3& wanted);
  void EndMove();
  void CancelMove();
  bool Moving() const;
  ///@}

  ///@{
  /// One step each, as vtkSkeletonPose::AddEdit has it, of the chosen joint.
  /// @throws std::runtime_error as MoveTo
  void Move(const Vector3& millimetres);
  void Turn(const Vector3& axisTimesRadians); ///< all beyond the joint about it
  void Twist(double radians);              ///< all beyond the joint about the bone that ends in it
  void Widen(double factor, double reach); ///< of the radius; reach: mm along the skeleton
  ///@}

  ///@{
  bool CanUndo() const { return this->Now > 0; }
  bool CanRedo() const { return this->Now + 1 < this->Steps.size(); }
  bool Undo(); ///< false when there is nothing to undo
  bool Redo();
  void Reset(); ///< to rest; may be undone
  ///@}

  ///@{
  /// A .vtp file: joints, and what there is of BoneRotation, BoneTwist, CalibreFactor. Reading may be undone.
  /// @throws std::runtime_error naming the file
  void ReadPose(const std::string& path);
  void WritePose(const std::string& path) const;
  ///@}
  /// The boundary as it is now with its arrays and Displacement, .vtp.
  /// @throws std::runtime_error naming the file
  void WriteSurface(const std::string& path) const;

  vtkPolyData* Pose() const; ///< of vtkSkeletonPose
  vtkPolyData* BoundaryAtRest() const;
  /// Of vtkSkinDeformation; its first points are those of the boundary.
  vtkUnstructuredGrid* Skin() const;
  const PosingReport& Report() const { return this->Report_; }

private:
  /// At least the joint itself, which comes last.
  std::vector<std::int64_t> Chain(std::int64_t joint) const;
  vtkSmartPointer<vtkPolyData> Moved(vtkPolyData* start, const Vector3& wanted);
  void AddEdit(std::int64_t joint, double twist, const Vector3& turn, const Vector3& shift,
    double calibre, double reach);
  void Edit(double twist, const Vector3& turn, double calibre, double reach);
  vtkSmartPointer<vtkPolyData> Posed(vtkPolyData* start);
  void Push(const vtkSmartPointer<vtkPolyData>& pose);
  void Show(const vtkSmartPointer<vtkPolyData>& pose, bool repair);
  void Deform(vtkPolyData* pose, bool repair);
  void MakeReport(vtkPolyData* pose);

  vtkMessageTrap& Messages;
  vtkSmartPointer<vtkPolyData> Rest;
  vtkSmartPointer<vtkPolyData> Boundary;
  vtkSmartPointer<vtkUnstructuredGrid> Mesh;
  SkeletonRig Rig;
  std::vector<std::int64_t> BoneInto; ///< per joint: the bone that ends in it, -1 at a root
  vtkNew<vtkSkeletonPose> Poser;
  vtkNew<vtkSkinDeformation> Deformer;
  PosingSettings Settings_;
  PosingReport Report_;
  std::int64_t Chosen_ = 0;
  std::deque<vtkSmartPointer<vtkPolyData>> Steps; ///< never changed once they are here
  std::size_t Now = 0;
  vtkSmartPointer<vtkPolyData> Current;   ///< what is shown
  vtkSmartPointer<vtkPolyData> MoveStart; ///< null: nothing is being moved
};
}

#endif
