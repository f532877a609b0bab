/**
 * @file vtkSurfaceInput.h
 * @brief Surfaces and trees of a pipeline for the metrics, and times of two inputs.
 */
#ifndef vtkSurfaceInput_h
#define vtkSurfaceInput_h

#include "BranchMetrics.h"
#include "MeshDistance.h"
#include "vtkCoronaryMetricsModule.h" // for the export macro

#include "vtkSmartPointer.h"
#include "vtkType.h"

#include <string>
#include <vector>

class vtkDataArray;
class vtkDataObject;
class vtkInformation;
class vtkInformationVector;
class vtkPolyData;

namespace vtkCoronary
{
/// The poly data; of a composite data object, all that are in its blocks in one. Null: there are none.
VTKCORONARYMETRICS_EXPORT vtkSmartPointer<vtkPolyData> PolyDataOf(vtkDataObject* input);

/// The same in triangles; lines and vertices are left out. Shares the input's arrays where nothing has to
/// be changed.
VTKCORONARYMETRICS_EXPORT vtkSmartPointer<vtkPolyData> TrianglesOf(vtkDataObject* input);

/**
 * Points, triangles and what arrays say of them. Arrays that are missing leave their part empty.
 * @param groupName  point or cell array, one integer each
 * @param capName    cell array; values above 1 are caps
 * @throws std::invalid_argument naming an array that has other than one component
 */
VTKCORONARYMETRICS_EXPORT coronary::SurfaceMesh SurfaceOf(
  vtkPolyData* triangles, const std::string& groupName, const std::string& capName);

/// Whole numbers, one each, of a point or cell array.
/// @throws std::invalid_argument naming the array
VTKCORONARYMETRICS_EXPORT std::vector<std::int64_t> IdsOf(
  vtkDataArray* array, vtkIdType count, const std::string& kind);

/// Inside RequestInformation: the outputs have the steps of input 0, else those of input 1, else the
/// range that both offer.
VTKCORONARYMETRICS_EXPORT void PublishCommonTime(
  vtkInformationVector** inputs, vtkInformationVector* outputs);

/**
 * Inside RequestUpdateExtent: input 0 is asked for its step that is nearest to the request, input 1
 * for its step that is nearest to that one.
 */
VTKCORONARYMETRICS_EXPORT void RequestCommonTime(
  vtkInformationVector** inputs, vtkInformation* output);

/// Inside RequestData: empty when both inputs are of one time, or one of them has none; else what is
/// wrong, a sentence.
VTKCORONARYMETRICS_EXPORT std::string TimeMismatch(vtkInformationVector** inputs, double tolerance);

/// Inside RequestData: writes the time that was compared into the outputs.
VTKCORONARYMETRICS_EXPORT void SetCommonTime(
  vtkInformationVector** inputs, vtkInformationVector* outputs);

/**
 * The lines of poly data as a tree; of a surface whose points have a group and an abscissa, the middles of
 * its slices; nothing of null or empty data.
 * @param side  "result" or "reference", for messages
 * @throws std::invalid_argument naming an array that is missing or does not fit
 */
VTKCORONARYMETRICS_EXPORT coronary::Polylines TreeOf(vtkPolyData* data, const std::string& side);
}

#endif
