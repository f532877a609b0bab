/**
 * @file vtkMessageTrap.h
 * @brief What VTK's classes report goes to the program instead of the console.
 */
#ifndef vtkMessageTrap_h
#define vtkMessageTrap_h

#include "vtkNew.h"
#include "vtkSmartPointer.h"

#include <functional>
#include <string>
#include <vector>

class vtkAlgorithm;
class vtkOutputWindow;

/// While it lives, it takes the place of VTK's output window.
class vtkMessageTrap
{
public:
  vtkMessageTrap();
  ~vtkMessageTrap();
  vtkMessageTrap(const vtkMessageTrap&) = delete;
  vtkMessageTrap& operator=(const vtkMessageTrap&) = delete;

  /// Prints the warnings that came since the last call, one a line, on standard error.
  void PrintWarnings();

  void ForgetWarnings();

  /// The warnings that came since the last call.
  std::vector<std::string> TakeWarnings();

  /// @throws std::runtime_error with the text of the first error, and forgets all of them.
  void ThrowIfError();

private:
  class Window;
  vtkNew<Window> Trap;
  vtkSmartPointer<vtkOutputWindow> Previous;
  int Verbosity;
};

/**
 * Reports the progress of an algorithm, 0 to 1, while `run` makes it work, and aborts it when the program is interrupted.
 * @throws coronary::Cancelled when the program was interrupted
 */
void WithProgress(vtkAlgorithm* algorithm, const std::function<void(double)>& report,
  const std::function<void()>& run);

/// That its first output offers; after its information was updated.
std::vector<double> TimeSteps(vtkAlgorithm* algorithm);

/**
 * Brings one output port up to date for one time.
 *
 * @param report  gets the algorithm's progress, 0 to 1
 * @throws coronary::Cancelled when the program was interrupted; std::runtime_error with what the
 *   algorithm reported.
 */
void UpdateAtTime(vtkAlgorithm* algorithm, int port, double time, vtkMessageTrap& messages,
  const std::function<void(double)>& report);

#endif
