/**
 * @file vtkCoronaryFilterParts.h
 * @brief What the thin filters have in common: settings checked, grids read, arrays written.
 */
#ifndef vtkCoronaryFilterParts_h
#define vtkCoronaryFilterParts_h

#include "Geometry.h"
#include "Require.h"
#include "ScalarImage.h"
#include "VesselBridge.h"
#include "vtkCoronaryCommonModule.h" // for the export macro

#include "vtkFieldData.h"
#include "vtkNew.h"

#include <initializer_list>
#include <string>
#include <vector>

class vtkAlgorithm;
class vtkDataArray;
class vtkImageData;
class vtkInformationVector;
class vtkPolyData;

namespace vtkCoronary
{
/// Extent, origin, spacing and direction of an image.
VTKCORONARYCOMMON_EXPORT coronary::ImageGrid GridOf(vtkImageData* image);

/// Whether the name of an array leaves the choice to the filter: it is empty, or "Automatic" as ParaView's panels call it.
VTKCORONARYCOMMON_EXPORT bool IsAutomatic(const std::string& arrayName);

/// One array of an image, of one value a voxel, as the algorithms take it. Types that they do not know
/// are copied into `copy`; the result is valid as long as the image and the copy are.
VTKCORONARYCOMMON_EXPORT coronary::ScalarImage ScalarImageOf(
  vtkImageData* image, vtkDataArray* array, std::vector<float>& copy);

/**
 * The array of an image that a filter works on, one value a voxel: the point array `chosen`; when that is empty or
 * "Automatic", the active scalars, or the first numeric array of one component where none are active.
 * @param whose  for messages: "the image"
 * @throws std::invalid_argument naming the array and what is wrong with it
 */
VTKCORONARYCOMMON_EXPORT vtkDataArray* VoxelArrayOf(
  vtkImageData* image, const std::string& chosen, const std::string& whose);

/// The name of the point array that SetInputArrayToProcess(0, ...) chose; empty when it chose none.
/// @param whose  for messages: "the image"
/// @throws std::invalid_argument when the array is to be one of the cells
VTKCORONARYCOMMON_EXPORT std::string ChosenPointArray(
  vtkAlgorithm* filter, const std::string& whose);

/**
 * Radii of lines, mm, one value a point: the array `chosen`; when that is empty or "Automatic",
 * `MaximumInscribedSphereRadius`, or `Radius` as some programs call it. Null when neither is there.
 * @throws std::invalid_argument naming `chosen` when it is missing, or the array that has other than one value a point
 */
VTKCORONARYCOMMON_EXPORT vtkDataArray* FindRadius(
  vtkPolyData* lines, const std::string& chosen = {});

/// The same where it is needed.
/// @param whose  for messages: "The input has"
/// @throws std::invalid_argument also when there is none
VTKCORONARYCOMMON_EXPORT vtkDataArray* RadiusOf(
  vtkPolyData* lines, const std::string& whose, const std::string& chosen = {});

/// Ways across lesions as field data: BridgePoints, BridgeConfidences, BridgeUnseen.
VTKCORONARYCOMMON_EXPORT void SetBridges(
  vtkFieldData* data, const std::vector<coronary::VesselBridge>& bridges);

/// What SetBridges wrote; nothing where it did not.
/// @throws std::invalid_argument that names the array that does not fit
VTKCORONARYCOMMON_EXPORT std::vector<coronary::VesselBridge> BridgesOf(vtkFieldData* data);

using coronary::Require;

/// The message of an algorithm as the filter's: without the name of the settings' structure that it
/// begins with, if it is one of `prefixes`, and with a capital letter; so that it begins with the
/// name of a property.
VTKCORONARYCOMMON_EXPORT std::string PropertyMessage(
  std::string message, std::initializer_list<const char*> prefixes = {});

/**
 * Reports why a request failed as one error of the filter: of ports and times that fail for the same reason, one after
 * the other with nothing changed between, the first one says it, and VTK's executive does not print the request as
 * well. Who observes the filter's errors gets all.
 * @return what the request has to return: 0
 */
VTKCORONARYCOMMON_EXPORT int ReportFailure(vtkAlgorithm* filter, const std::string& message);

/// The same for a request that leaves empty outputs.
/// @return 0; in ParaView 1, as its representations print at every picture that they have no data when the filter fails
VTKCORONARYCOMMON_EXPORT int ReportEmptied(vtkAlgorithm* filter, const std::string& message);

/**
 * For the end of RequestData, inside of `catch (...)`: reports the exception that is being handled as an error of
 * the filter (a cancellation is none), empties all outputs, and marks them as not generated, so that the next
 * request executes again.
 * @param memory    what memory was wanted for: "for the motion"
 * @param prefixes  as of PropertyMessage
 * @return what RequestData has to return: 1 after a cancellation, that of ReportEmptied after an error
 */
VTKCORONARYCOMMON_EXPORT int FinishFailedRequest(vtkAlgorithm* filter,
  vtkInformationVector* outputs, const std::string& memory,
  std::initializer_list<const char*> prefixes = {});

/// Adds vectors as a new array of doubles of three components, which replaces one of the same name.
VTKCORONARYCOMMON_EXPORT void AddVectors(
  vtkFieldData* data, const std::string& name, const std::vector<coronary::Vector3>& values);

/// Adds `values` as a new array, which replaces one of the same name.
template <typename Array, typename Value>
void AddArray(vtkFieldData* data, const std::string& name, const std::vector<Value>& values)
{
  vtkNew<Array> array;
  array->SetName(name.c_str());
  array->SetNumberOfValues(static_cast<vtkIdType>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
  {
    array->SetValue(static_cast<vtkIdType>(i), values[i]);
  }
  data->AddArray(array);
}
}

#endif
