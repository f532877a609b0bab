/**
 * @file vtkMovingMesh.h
 * @brief From poses to the files of a moving mesh: what `run` and `sequence` have in common.
 */
#ifndef vtkMovingMesh_h
#define vtkMovingMesh_h

#include "vtkNew.h"

#include <functional>
#include <string>
#include <vector>

class vtkCardiacPhaseInterpolator;
class vtkMeshSequenceWriter;
class vtkMessageTrap;
class vtkSkinDeformation;

namespace coronary
{
/// "linear", "cubic" or "low-noise", as a mode of the interpolator.
int InterpolationMode(const std::string& name);
std::vector<std::string> InterpolationModes();

/// Interpolator, deformation and writer, connected. The interpolator lacks its poses, the deformation mesh and rest.
class MovingMesh
{
public:
  MovingMesh();
  ~MovingMesh();

  /**
   * Writes the mesh at these times, increasing, beside `path`, DIR/NAME.json.
   * @throws Cancelled, std::runtime_error
   */
  void Write(const std::string& path, const std::vector<double>& times, vtkMessageTrap& messages,
    const std::function<void(double)>& progress);

  vtkNew<vtkCardiacPhaseInterpolator> Interpolator;
  vtkNew<vtkSkinDeformation> Deformation;
  vtkNew<vtkMeshSequenceWriter> Writer;
};
}

#endif
