/**
 * @file vtkSimulatorScene.h
 * @brief The anatomy in three dimensions: beating heart and arteries, instruments, contrast medium.
 */
#ifndef vtkSimulatorScene_h
#define vtkSimulatorScene_h

#include "HeartShell.h"
#include "Scenario.h"
#include "TrainingSession.h"

#include "vtkNew.h"

#include <cstdint>
#include <memory>
#include <vector>

class vtkActor;
class vtkPoints;
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
  void MakeWall(WallMotion& wall, std::int64_t triangles);
  void MakeHeart();
  void MakeInstruments(const Scenario& scenario);
  void MakeTracers();

  std::shared_ptr<const HeartShell> Heart;
  std::vector<std::int64_t> Drawn;
  std::vector<Vector3> HeartPoints;

  vtkNew<vtkRenderer> Renderer_;
  vtkNew<vtkPolyData> WallMesh;
  vtkNew<vtkActor> WallActor;
  vtkNew<vtkPolyData> HeartMesh;
  vtkNew<vtkActor> HeartActor;
  vtkNew<vtkPolyData> WireLine;
  vtkNew<vtkTubeFilter> WireTube;
  vtkNew<vtkActor> WireActor;
  vtkNew<vtkPolyData> CatheterLine;
  vtkNew<vtkTubeFilter> CatheterTube;
  vtkNew<vtkActor> CatheterActor;
  vtkNew<vtkPolyData> TracerPoints;
  vtkNew<vtkActor> TracerActor;
};
}

#endif
