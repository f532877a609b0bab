#include "vtkCoronaryCompatibility.h"

namespace vtkCoronary
{
bool CheckAbort(vtkAlgorithm* algorithm)
{
#if VTK_VERSION_NUMBER >= VTK_VERSION_CHECK(9, 2, 20220827)
  return algorithm->CheckAbort();
#else
  return algorithm->GetAbortExecute() != 0;
#endif
}

std::function<bool(double)> ProgressOf(vtkAlgorithm* algorithm, double first, double last)
{
  return [=](double fraction)
  {
    algorithm->UpdateProgress(first + (last - first) * fraction);
    return !CheckAbort(algorithm);
  };
}
}
