/**
 * @file vtkSimulatorScene.h
 * @brief The anatomy in three dimensions: beating heart and arteries, instruments, contrast medium.
 */
#ifndef vtkSimulatorScene_h
#define vtkSimulatorScene_h

#include "AortaMotion.h"
#include "HeartShell.h"
#include "Scenario.h"
#include "TrainingSession.h"

#include "vtkNew.h"

#include <cstdint>
#include <memory>
#include <vector>

class vtkActor;
class vtkPoints;
class vtkFloatArray;
class vtkPolyData;
class vtkRenderer;
class vtkTubeFilter;

namespace coronary
{
struct SceneSettings
{
  std::int64_t triangles = 9000; ///< of the wall at most: software OpenGL draws no more in time
};

class vtkSimulatorScene
{
public:
  /// @param wall  for its points at rest; not kept  @param heart  may be null: no heart is drawn
  vtkSimulatorScene(WallMotion& wall, const Scenario& scenario,
    std::shared_ptr<const HeartShell> heart, const SceneSettings& settings = {});
  ~vtkSimulatorScene();
  vtkSimulatorScene(const vtkSimulatorScene&) = delete;
  vtkSimulatorScene& operator=(const vtkSimulatorScene&) = delete;

  vtkRenderer* Renderer() const { return this->Renderer_; }

  /// Points of the wall that are drawn: SessionSnapshot::wall has to be of these.
  const std::vector<std::int64_t>& WallPoints() const { return this->Drawn; }
  std::int64_t NumberOfTriangles() const; ///< that are drawn in all

  void Update(const SessionSnapshot& snapshot);

  void ShowHeart(bool shown);
  void ShowTracers(bool shown);
  void SetWallOpacity(double opacity); ///< 0 to 1

  /// The camera where the C-arm's detector is, towards the source: as the X-ray image is seen.
  void LookAsCArm(const CArmPose& pose);
  /// From the front, all of it in the view.
  void LookFromFront();

private:
  /// A drawn point's normal as it is on the whole wall, in a frame of the vessel's axis that it moves with.
  struct AxisNormal
  {
    std::size_t before = 0; ///< places in SessionSnapshot::axis: the axis runs from here
    std::size_t at = 0;
    std::size_t after = 0;            ///< to here
    Vector3 normal = Vector3::Zero(); ///< outwards, along, around
  };
  static Matrix3 FrameOf(
    const AxisNormal& anchor, const std::vector<Vector3>& axis, const Vector3& point);

  void MakeWall(WallMotion& wall, std::int64_t triangles);
  void AnchorNormals(WallMotion& wall, vtkPolyData* whole, const std::vector<Vector3>& rest);
  void TurnNormals(const std::vector<Vector3>& points, const std::vector<Vector3>& axis);
  void MakeHeart();
  void MakeAorta();
  void MakeInstruments(const Scenario& scenario);
  void MakeTracers();
  void MakeTears();
  void SetTears(const SessionSnapshot& snapshot);
  void SetStents(const std::vector<StentShape>& stents);

  std::shared_ptr<const HeartShell> Heart;
  std::vector<std::int64_t> Drawn;
  std::vector<AxisNormal> Normals;
  std::vector<Vector3> HeartPoints;
  WallTopology Vessels;                     ///< axes and aorta alone
  std::unique_ptr<const AortaMotion> Aorta; ///< null: no guide came through it yet
  std::vector<Vector3> AortaPoints;

  vtkNew<vtkRenderer> Renderer_;
  vtkNew<vtkPolyData> WallMesh;
  vtkNew<vtkFloatArray> WallNormals;
  vtkNew<vtkActor> WallActor;
  vtkNew<vtkPolyData> HeartMesh;
  vtkNew<vtkActor> HeartActor;
  vtkNew<vtkPolyData> AortaMesh;
  vtkNew<vtkActor> AortaActor;
  vtkNew<vtkPolyData> WireLine;
  vtkNew<vtkTubeFilter> WireTube;
  vtkNew<vtkActor> WireActor;
  vtkNew<vtkPolyData> SecondLine; ///< likewise
  vtkNew<vtkTubeFilter> SecondTube;
  vtkNew<vtkActor> SecondActor;
  vtkNew<vtkPolyData> CatheterLine;
  vtkNew<vtkTubeFilter> CatheterTube;
  vtkNew<vtkActor> CatheterActor;
  vtkNew<vtkPolyData> BalloonLine;
  vtkNew<vtkTubeFilter> BalloonTube;
  vtkNew<vtkActor> BalloonActor;
  vtkNew<vtkPolyData> StentLines;
  vtkNew<vtkTubeFilter> StentTube;
  vtkNew<vtkActor> StentActor;
  vtkNew<vtkPolyData> TracerPoints;
  vtkNew<vtkActor> TracerActor;
  vtkNew<vtkPolyData> TearPoints;
  vtkNew<vtkActor> TearActor;
};
}

#endif
