/**
 * @file vtkRunTrees.h
 * @brief What report.json and status.csv of `run` tell of seeds and trees.
 */
#ifndef vtkRunTrees_h
#define vtkRunTrees_h

#include <nlohmann/json.hpp>

#include <string>

class vtkDataSet;
class vtkImageData;
class vtkPolyData;

namespace coronary
{
/// The values of a field array; none without it.
nlohmann::ordered_json Numbers(vtkDataSet* data, const char* name);

/// Seeds with name, position, confidence, radius and volume.
nlohmann::ordered_json DescribeSeeds(vtkPolyData* seeds);

/// What became of each seed: reached, or why not, with the tree that hangs on it.
nlohmann::ordered_json DescribeTrees(vtkPolyData* lines, vtkPolyData* seeds);

/// Trees of which no ostium was found, with a sentence of what to do. @param seeds  as of DescribeSeeds()
nlohmann::ordered_json OstiaNotFound(const nlohmann::ordered_json& seeds);

/// Trees that have no branch. @param trees  as of DescribeTrees()
nlohmann::ordered_json TreesNotFound(const nlohmann::ordered_json& trees);

/**
 * What the image shows and the trees do not hold: added to the warnings in the tree's field data. Of trees without names, of
 * which the heart's place is not known, nothing is said.
 * @param image, vesselness  on one grid
 * @param tissue, blood      the image's values of muscle and of undiluted contrast medium
 */
void AddLooseVessels(
  vtkPolyData* tree, vtkImageData* image, vtkImageData* vesselness, double tissue, double blood);

/// What the checks of the named trees found: what, vessel, place, confidence.
nlohmann::ordered_json DescribeChecks(vtkPolyData* tree);

/// status.csv. @param trees  as of DescribeTrees()
std::string StatusTable(const nlohmann::ordered_json& trees);
}

#endif
