/**
 * @file vtkPosingScene.h
 * @brief Vessels, bones and joints of a vtkPosingModel as a renderer draws them.
 */
#ifndef vtkPosingScene_h
#define vtkPosingScene_h

#include "Geometry.h"

#include "vtkNew.h"

#include <cstdint>
#include <vector>

class vtkActor;
class vtkFloatArray;
class vtkPolyData;
class vtkRenderer;

namespace coronary
{
class vtkPosingModel;

class vtkPosingScene
{
public:
  /// @param model      has to live longer
  /// @param triangles  of the vessels at most; where there are more, points are taken away
  vtkPosingScene(const vtkPosingModel& model, std::int64_t triangles);
  ~vtkPosingScene();
  vtkPosingScene(const vtkPosingScene&) = delete;
  vtkPosingScene& operator=(const vtkPosingScene&) = delete;

  vtkRenderer* Renderer() const { return this->Renderer_; }  ///< of the vessels; has the camera
  vtkRenderer* FrontRenderer() const { return this->Front; } ///< of bones and joints, layer 1
  std::int64_t NumberOfTriangles() const;

  /// Takes over the pose, the skin and the choice of the model.
  void Update();

  double Opacity() const;
  void SetOpacity(double opacity); ///< of the vessels, 0 to 1
  void LookFromFront();            ///< all of it

  /// The joint at a place of the picture, the nearest one to the eye; -1: none.
  /// @param x, y, radius  pixels from the lower left
  std::int64_t JointAt(double x, double y, double radius) const;
  /// The point under a place of the picture that is as deep as `depthOf`, mm.
  Vector3 PlaceAt(double x, double y, const Vector3& depthOf) const;

private:
  void MakeVessels(std::int64_t triangles);
  void MakeSkeleton();
  Vector3 InPicture(const Vector3& place) const; ///< pixels, depth

  const vtkPosingModel& Model;
  vtkNew<vtkRenderer> Renderer_;
  vtkNew<vtkRenderer> Front;
  vtkNew<vtkPolyData> Vessels;
  vtkNew<vtkFloatArray> Normals;
  std::vector<Triangle> Triangles; ///< of the vessels
  std::vector<std::int64_t> Drawn; ///< per point of the vessels: that of the skin
  vtkNew<vtkPolyData> Skeleton;
  vtkNew<vtkPolyData> Joints;
  vtkNew<vtkPolyData> Chosen;
  vtkNew<vtkActor> VesselActor;
};
}

#endif
