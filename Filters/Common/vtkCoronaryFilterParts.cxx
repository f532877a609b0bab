#include "vtkCoronaryFilterParts.h"

#include "ParallelFor.h"

#include "vtkAlgorithm.h"
#include "vtkDataArray.h"
#include "vtkDataArrayRange.h"
#include "vtkDataObject.h"
#include "vtkDemandDrivenPipeline.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMatrix3x3.h"
#include "vtkShortArray.h"
#include "vtkUnsignedShortArray.h"

#include <cctype>
#include <new>
#include <stdexcept>

namespace vtkCoronary
{
coronary::ImageGrid GridOf(vtkImageData* image)
{
  coronary::ImageGrid grid;
  image->GetExtent(grid.extent.data());
  image->GetOrigin(grid.origin.data());
  image->GetSpacing(grid.spacing.data());
  grid.direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
    image->GetDirectionMatrix()->GetData());
  return grid;
}

coronary::ScalarImage ScalarImageOf(
  vtkImageData* image, vtkDataArray* array, std::vector<float>& copy)
{
  coronary::ScalarImage result;
  result.grid = GridOf(image);
  if (auto* shorts = vtkArrayDownCast<vtkShortArray>(array))
  {
    result.values = static_cast<const std::int16_t*>(shorts->GetPointer(0));
  }
  else if (auto* unsignedShorts = vtkArrayDownCast<vtkUnsignedShortArray>(array))
  {
    result.values = static_cast<const std::uint16_t*>(unsignedShorts->GetPointer(0));
  }
  else if (auto* floats = vtkArrayDownCast<vtkFloatArray>(array))
  {
    result.values = static_cast<const float*>(floats->GetPointer(0));
  }
  else
  {
    const auto range = vtk::DataArrayValueRange<1>(array);
    copy.assign(range.begin(), range.end());
    result.values = static_cast<const float*>(copy.data());
  }
  return result;
}

void Require(bool condition, const std::string& requirement)
{
  if (!condition)
  {
    throw std::invalid_argument(requirement);
  }
}

std::string PropertyMessage(std::string message, std::initializer_list<const char*> prefixes)
{
  for (const std::string prefix : prefixes)
  {
    if (message.compare(0, prefix.size(), prefix) == 0)
    {
      message.erase(0, prefix.size());
    }
  }
  if (!message.empty())
  {
    message.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(message.front())));
  }
  return message;
}

int FinishFailedRequest(vtkAlgorithm* filter, vtkInformationVector* outputs,
  const std::string& memory, std::initializer_list<const char*> prefixes)
{
  int result = 0;
  try
  {
    throw;
  }
  catch (const coronary::Cancelled&)
  {
    vtkDebugWithObjectMacro(filter, "aborted");
    result = 1;
  }
  catch (const std::bad_alloc&)
  {
    vtkErrorWithObjectMacro(filter, << "Not enough memory " << memory);
  }
  catch (const std::exception& error)
  {
    vtkErrorWithObjectMacro(filter, << PropertyMessage(error.what(), prefixes));
  }
  for (int port = 0; port < outputs->GetNumberOfInformationObjects(); ++port)
  {
    vtkInformation* info = outputs->GetInformationObject(port);
    if (vtkDataObject* output = vtkDataObject::GetData(info))
    {
      output->Initialize();
    }
    info->Set(vtkDemandDrivenPipeline::DATA_NOT_GENERATED(), 1);
  }
  return result;
}
}
