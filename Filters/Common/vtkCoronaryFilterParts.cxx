#include "vtkCoronaryFilterParts.h"

#include "vtkImageData.h"
#include "vtkMatrix3x3.h"

#include <cctype>
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
}
