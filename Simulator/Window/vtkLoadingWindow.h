/**
 * @file vtkLoadingWindow.h
 * @brief What is seen while a patient is loaded: how far it is, and a way to stop it.
 */
#ifndef vtkLoadingWindow_h
#define vtkLoadingWindow_h

#include "SessionWorld.h"

#include <QString>
#include <QWidget>

#include <functional>

class QLabel;
class QProgressBar;

namespace coronary
{
/// As large as the window that takes its place.
class LoadingWindow : public QWidget
{
public:
  LoadingWindow(const QString& title, int width, int height);

  /**
   * Shows the window, does the work on a thread of its own, and stays.
   * @return false: the window was closed, and the work with it
   * @throws what the work throws; Cancelled: interrupted
   */
  bool Run(const std::function<void(const WorldProgress& progress)>& work);

private:
  QLabel* Text;
  QProgressBar* Bar;
};
}

#endif
