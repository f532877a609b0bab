/**
 * @file vtkRunResult.h
 * @brief What `run` left in a folder, read again to be looked at: its report, its tree with all marks, its image.
 */
#ifndef vtkRunResult_h
#define vtkRunResult_h

#include "LumenMeasurement.h"
#include "ParallelFor.h"
#include "VesselTree.h"

#include "vtkImageData.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <string>
#include <vector>

class vtkGatedImageReader;
class vtkMessageTrap;

namespace coronary
{
/// An image and what samples it.
struct ResultImage
{
  vtkSmartPointer<vtkImageData> data;
  std::vector<float> copy; ///< of voxels in a type that algorithms do not take
  std::unique_ptr<ImageInterpolator> values;
};

/// Objects by number on the voxels of an image, 0: none.
class ResultLabels
{
public:
  ResultLabels() = default;
  explicit ResultLabels(vtkImageData* image);

  bool Empty() const { return this->Data == nullptr; }

  /// That of the voxel in which a place lies; outside of the image 0.
  int At(const Vector3& world) const;

private:
  vtkSmartPointer<vtkImageData> Data;
  ImageGrid Grid;
  Matrix3 Inverse = Matrix3::Identity();
};

struct RunResult
{
  std::string folder;
  nlohmann::ordered_json report; ///< an object
  double time = 0.0;             ///< of the reference phase, fraction of R-R
  vtkSmartPointer<vtkPolyData> lines;
  VesselTree tree;
  std::vector<std::string> names; ///< of the tree's branches, SCCT; empty where there is none

  ///@{
  /// One a point of the tree; empty: the run says nothing of it.
  std::vector<double> bridged;          ///< 1: guessed across a gap
  std::vector<double> bridgeConfidence; ///< 0 to 1
  std::vector<double> edited;           ///< above 0: by hand
  std::vector<double> interpolated;     ///< 1: the radius was not measured here
  std::vector<double> stenosis;         ///< 0 to 1, by diameter
  std::vector<double> reference;        ///< radius of the vessel were it healthy, mm
  std::vector<double> calcium;          ///< label of the calcification beside; 0: none
  ///@}

  /// The member of the stage `centerline` of the report: "bridges", "lesions", "calcium"; null: there is none.
  nlohmann::ordered_json Findings(const std::string& name) const;

  /// The same of the stage `motion`: "filled", "limits".
  nlohmann::ordered_json MotionFindings(const std::string& name) const;

  /// What the stages and the run warned of, and why it stopped, in the order of the stages.
  std::vector<std::string> Warnings() const;
};

/**
 * Reads report.json and centerline.vtp of a folder.
 * @throws std::runtime_error naming the folder or file and what is missing
 */
RunResult ReadRunResult(const std::string& folder, vtkMessageTrap& messages);

/**
 * The images that the run was made of, with their phases.
 * @param files  as of ReadRunImage
 * @throws std::runtime_error as ReadRunImage
 */
vtkSmartPointer<vtkGatedImageReader> OpenRunImages(
  const RunResult& result, const std::vector<std::string>& files, vtkMessageTrap& messages);

/**
 * The image that the tree was found in.
 * @param files  where it is now; empty: where the report says that it was
 * @throws std::runtime_error naming it, with the option that gives it another place; Cancelled
 */
ResultImage ReadRunImage(const RunResult& result, const std::vector<std::string>& files,
  vtkMessageTrap& messages, const ProgressCallback& progress = {});

/// Calcifications, calcium.mha of the folder; empty: there is none.
ResultLabels ReadRunCalcium(const RunResult& result, vtkMessageTrap& messages);
}

#endif
