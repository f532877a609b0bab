/**
 * @file vtkWindowRecorder.h
 * @brief Pictures and a film of the window, and X-ray images, in files.
 */
#ifndef vtkWindowRecorder_h
#define vtkWindowRecorder_h

#include "SessionEngine.h"
#include "SimulatorWindow.h"
#include "vtkVideoFile.h"

#include <QAction>
#include <QElapsedTimer>
#include <QWidget>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>

namespace coronary
{
class WindowRecorder
{
public:
  /// @param window  lives longer  @param options  likewise
  WindowRecorder(QWidget& window, const WindowOptions& options);

  ///@{
  /// Set first.
  std::function<void(const QString&)> say;
  std::function<void(const QString&)> fail;
  QAction* filming = nullptr; ///< is checked while there is a film
  ///@}

  void SaveScreenshot();
  void Film(bool on);

  /// Pictures that are due, and the film's next one. @param shown  the last X-ray image
  void Update(const SessionSnapshot& now, const ShownImage& shown);

private:
  void Save(const QString& path);
  void SaveXRay(const QString& name, const ShownImage& shown);
  void AddToFilm(bool begun);

  QWidget& Window;
  const WindowOptions& Options;
  std::size_t NextScreenshot = 0;
  std::unique_ptr<vtkVideoFile> Video;
  QElapsedTimer VideoClock;
  std::int64_t Filmed = 0; ///< places of the film that have passed
};
}

#endif
