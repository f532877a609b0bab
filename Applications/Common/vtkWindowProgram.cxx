#include "vtkWindowProgram.h"

#include "vtkDisplay.h"

#include "QVTKOpenGLNativeWidget.h"

#include <QApplication>
#include <QOffscreenSurface>
#include <QOpenGLContext>
#include <QSurfaceFormat>

#include <stdexcept>

namespace coronary
{
namespace
{
void RequireOpenGL()
{
  QOffscreenSurface surface;
  surface.setFormat(QSurfaceFormat::defaultFormat());
  surface.create();
  QOpenGLContext context;
  context.setFormat(QSurfaceFormat::defaultFormat());
  if (!surface.isValid() || !context.create() || !context.makeCurrent(&surface) ||
    context.format().version() < qMakePair(3, 2))
  {
    throw std::runtime_error("The display has no OpenGL 3.2, which the view of the anatomy needs; "
                             "without a window the program runs with --headless.");
  }
  context.doneCurrent();
}
}

void RequireDisplay()
{
  std::string why;
  if (!HasDisplay(why))
  {
    throw std::runtime_error("There is no display for the window (" + why +
      "); without one the program runs with --headless.");
  }
}

vtkWindowProgram::vtkWindowProgram(const std::string& name, const char* title)
  : Name(name)
  , Arguments{ this->Name.data(), nullptr }
{
  RequireDisplay();
  QSurfaceFormat::setDefaultFormat(QVTKOpenGLNativeWidget::defaultFormat());
  this->Application = std::make_unique<QApplication>(this->Count, this->Arguments);
  QApplication::setApplicationDisplayName(title);
  RequireOpenGL();
}

vtkWindowProgram::~vtkWindowProgram() = default;
}
