/**
 * @file vtkBridgeReport.h
 * @brief What a run says of the ways across lesions that it followed without seeing a vessel.
 */
#ifndef vtkBridgeReport_h
#define vtkBridgeReport_h

#include "VesselBridge.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

class vtkImageData;
class vtkPolyData;

namespace coronary
{
/// The polylines of a segmentation's bridges.
/// @throws std::runtime_error when their confidence is missing
std::vector<VesselBridge> BridgesOfLines(vtkPolyData* lines);

/**
 * One object a bridge that the tree runs across: "vessel", "from", "to" (mm), "length_mm", "unseen_mm", "confidence",
 * "kind": "calcium" (brighter than blood), "occlusion" (nothing is seen) or "stenosis" (a thin lumen is).
 * @param tree       with segment labels
 * @param reference  the image that the bridges are of
 * @param blood      its value of undiluted contrast medium
 */
nlohmann::ordered_json DescribeBridges(
  vtkPolyData* lines, vtkPolyData* tree, vtkImageData* reference, double blood);

/// What touched the trees and was left out as a vein: "position" (mm), "length_mm", "probability".
/// @param tree  with the centerline filter's field data
nlohmann::ordered_json DescribeVeins(vtkPolyData* tree);

/// A sentence for each bridge of a report that a user should look at: what is not seen for 3 mm or more.
std::vector<std::string> BridgeWarnings(const nlohmann::ordered_json& bridges);

/// A sentence for each vein of a report that may be an artery.
std::vector<std::string> VeinWarnings(const nlohmann::ordered_json& veins);
}

#endif
