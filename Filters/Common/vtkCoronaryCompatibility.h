/**
 * @file vtkCoronaryCompatibility.h
 * @brief The one place that knows how VTK 9.1 and the VTK of ParaView 5.11 differ.
 */
#ifndef vtkCoronaryCompatibility_h
#define vtkCoronaryCompatibility_h

#include "vtkCoronaryCommonModule.h" // for the export macro

#include "vtkAlgorithm.h"
#include "vtkVersionMacros.h"

#include <functional>

namespace vtkCoronary
{
/**
 * True when the user or the application asked the running algorithm to stop.
 *
 * VTK 9.1 knows only vtkAlgorithm::AbortExecute of the filter itself; from 9.2.20220827 on,
 * vtkAlgorithm::CheckAbort also looks up the pipeline.
 */
VTKCORONARYCOMMON_EXPORT bool CheckAbort(vtkAlgorithm* algorithm);

/**
 * A coronary::ProgressCallback that reports to the algorithm's progress events and returns false
 * once it is to abort. Progress from the callback is mapped into [first, last].
 */
VTKCORONARYCOMMON_EXPORT std::function<bool(double)> ProgressOf(
  vtkAlgorithm* algorithm, double first = 0.0, double last = 1.0);
}

#endif
