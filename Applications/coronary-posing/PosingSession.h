/**
 * @file PosingSession.h
 * @brief Posing the skeleton of a coronary tree: what is asked for, with and without a window.
 */
#ifndef DynamicCoronary_PosingSession_h
#define DynamicCoronary_PosingSession_h

#include "Geometry.h"

#include <cstdint>
#include <string>
#include <vector>

namespace coronary
{
/// What goes with a joint that is moved.
enum class JointDrag
{
  Alone = 0,  ///< nothing
  Beyond = 1, ///< all beyond it, without turning
  Turn = 2,   ///< the bones before it turn, and all beyond them with them; at a root it is Beyond
};

struct PosingSettings
{
  JointDrag drag = JointDrag::Turn;
  int bones = 6;           ///< Turn: bones before the joint that share the bend, at least 1
  bool keepLengths = true; ///< Turn: no bone changes its length, the joint gets as near as it can
  bool dualQuaternions = true; ///< else linear blending
  bool stretch = true;         ///< the skin follows the stretch of its bones
  bool keepVolume = false;     ///< cross-sections answer to the stretch
  bool repair = true;          ///< inverted tetrahedra are repaired when a move is over
};

/// A move that is written down.
struct PosingMove
{
  std::int64_t joint = 0;
  Vector3 millimetres = Vector3::Zero();
};

/// Of "JOINT:DX,DY,DZ". @throws std::invalid_argument: it is not of that form
PosingMove PosingMoveOf(const std::string& text);

struct PosingOptions
{
  PosingSettings settings;
  std::string start;             ///< pose to begin with, .vtp; empty: rest
  std::vector<PosingMove> moves; ///< done one after the other at the start
  std::string output;            ///< pose after the moves, .vtp; empty: not written
  std::string surface;           ///< surface after the moves, .vtp; empty: not written
  std::string
    screenshots; ///< folder for a picture before the first and after every move; then the window closes
  std::int64_t triangles = 40000; ///< that are drawn at most
  int width = 1500;
  int height = 860;
};

/// The moves without window and display; says on the standard output what has come of it.
/// @throws as vtkPosingModel
void PoseWithoutWindow(const std::string& folder, const PosingOptions& options, bool quiet);

/**
 * The window; returns when it has been closed, or with `screenshots` after the last picture. Needs a display with
 * OpenGL 3.2. Only where the program was built with its window.
 * @param folder  of `coronary-pipeline run --until weights`
 * @return 0; 1 when a picture or a file could not be written: the reason was printed
 * @throws std::runtime_error: no display or no OpenGL; as vtkPosingModel
 */
int RunPosingWindow(const std::string& folder, const PosingOptions& options);
}

#endif
