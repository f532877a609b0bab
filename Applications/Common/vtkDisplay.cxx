#include "vtkDisplay.h"

#include "vtkNew.h"
#include "vtkRenderWindow.h"

#include <dlfcn.h>

#include <cstdlib>

namespace coronary
{
bool HasDisplay(std::string& why)
{
  void* library = dlopen("libX11.so.6", RTLD_NOW | RTLD_LOCAL);
  if (!library)
  {
    why = "libX11.so.6 is missing";
    return false;
  }
  using Open = void* (*)(const char*);
  using Query = int (*)(void*, const char*, int*, int*, int*);
  using Close = int (*)(void*);
  const auto open = reinterpret_cast<Open>(dlsym(library, "XOpenDisplay"));
  const auto query = reinterpret_cast<Query>(dlsym(library, "XQueryExtension"));
  const auto close = reinterpret_cast<Close>(dlsym(library, "XCloseDisplay"));
  bool there = false;
  if (open && query && close)
  {
    void* display = open(nullptr);
    const char* name = std::getenv("DISPLAY");
    if (!display)
    {
      why = name && *name ? std::string("the X server '") + name + "' does not answer"
                          : std::string("there is no display (DISPLAY is not set)");
    }
    else
    {
      int ignored[3];
      there = query(display, "GLX", ignored, ignored + 1, ignored + 2) != 0;
      if (!there)
      {
        why = std::string("the X server '") + (name ? name : "") + "' has no GLX";
      }
      // One connection stays until the end of the process: xvfb-run's server resets itself when its last
      // client leaves, and whoever connects meanwhile, as between two windows of VTK's, is dropped.
      static void* kept = nullptr;
      if (there && !kept)
      {
        kept = display;
      }
      else
      {
        close(display);
      }
    }
  }
  else
  {
    why = "libX11.so.6 is not what it should be";
  }
  // The library stays: VTK uses it too.
  return there;
}

bool CanDraw(std::string& why)
{
  vtkNew<vtkRenderWindow> window;
  return !window->IsA("vtkXOpenGLRenderWindow") || HasDisplay(why);
}
}
