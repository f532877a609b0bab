/**
 * @file vtkRunLesions.h
 * @brief What `run` tells of calcium and stenoses along its centerlines.
 */
#ifndef vtkRunLesions_h
#define vtkRunLesions_h

#include <nlohmann/json.hpp>

#include <functional>
#include <string>

class vtkImageData;
class vtkPolyData;

namespace coronary
{
/// What GradeTreeLesions() found.
struct TreeLesions
{
  nlohmann::ordered_json lesions; ///< a list
  nlohmann::ordered_json calcium; ///< objects, scores by segment, stretches that calcium hides
  std::string table;              ///< lesions.csv
  bool hasCalcium = false;
};

/**
 * Stenoses and calcium along trees with names. The point arrays `StenosisDegree`, `ReferenceRadius`, `RadiusInterpolated`
 * and `CalciumLabel` are added to the tree.
 * @param calciumFile  where the labels of the calcium go, if there is any: a voxel the number of its object, else 0
 * @throws Cancelled; std::runtime_error naming the file that can not be written
 */
TreeLesions GradeTreeLesions(vtkPolyData* tree, vtkImageData* image, double blur,
  const std::function<std::string()>& calciumFile, const std::function<void(double)>& progress);
}

#endif
