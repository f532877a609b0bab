/**
 * @file SimulatorWindow.h
 * @brief The program a trainee sits at: X-ray monitor, anatomy, panel, traces.
 */
#ifndef DynamicCoronary_SimulatorWindow_h
#define DynamicCoronary_SimulatorWindow_h

#include "SessionEngine.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace coronary
{
struct WindowOptions
{
  std::vector<std::string> devices;      ///< URIs, in the order of their priority
  int igtlPort = 0;                      ///< for 3D Slicer and others; 0: none
  std::string igtlAddress = "127.0.0.1"; ///< where it listens
  std::string script;                    ///< of driving; empty: none
  std::string replay;                    ///< recording to begin with; empty: none
  std::string record;                    ///< recording of the first session; empty: none
  std::string screenshots; ///< folder of pictures of the window; empty: none by itself
  std::vector<double> screenshotSeconds; ///< of simulated time, at which pictures are made
  std::string video;                     ///< .ogv of the first session; empty: none
  double quitAfter = 0.0;                ///< s of simulated time; 0: when it is closed
  int width = 1500;
  int height = 860;
  std::int64_t triangles = 9000; ///< of the wall in the anatomy
  bool heart = true;
  bool quiet = false; ///< no summary on the standard output
};

/// What can be known before anything is made, which takes long.
/// @throws UsageError: no such kind of device; std::runtime_error: no display, no place for a file
void CheckWindow(const WindowOptions& options);

/// Makes what the sessions share, on a thread beside the window.
using WorldLoader = std::function<SessionWorld(const WorldProgress& progress)>;

/**
 * The window is there at once and says how far the loader is. Returns when it has been closed. Needs a display with
 * OpenGL 3.2.
 * @param scenario  that the loader makes the world of, for the title
 * @throws what the loader throws; Cancelled: interrupted; std::runtime_error: no OpenGL; what went wrong in the sessions, the
 * first; devices, files as SessionEngine
 */
void RunWindow(const Scenario& scenario, const WorldLoader& load, const WindowOptions& options);
}

#endif
