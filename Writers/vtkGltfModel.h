/**
 * @file vtkGltfModel.h
 * @brief What glTF needs of a mesh that vtkSkinDeformation has moved.
 */
#ifndef vtkGltfModel_h
#define vtkGltfModel_h

#include "GltfSkin.h"

#include "vtkType.h"

#include <memory>
#include <vector>

class vtkPointSet;

/// Collects phases of a mesh, or of some of its points, for coronary::GltfSkin.
class vtkGltfModel
{
public:
  /**
   * At rest: points less `Displacement`, `BoneIndices` and `BoneWeightsCompact`, the field data of vtkBoneMotion.
   * @param mesh    at any phase
   * @param points  of the mesh that are wanted, in the order of the file
   * @throws std::invalid_argument naming the array that is missing or unfit, as coronary::GltfSkin
   */
  vtkGltfModel(vtkPointSet* mesh, std::vector<vtkIdType> points, int influences);

  /// @throws std::invalid_argument as above
  void AddPhase(vtkPointSet* mesh, double time);

  coronary::GltfModel Model; ///< faces and times are the caller's
  std::unique_ptr<coronary::GltfSkin> Skin;

private:
  std::vector<vtkIdType> Points;
};

#endif
