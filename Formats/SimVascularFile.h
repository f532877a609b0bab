/**
 * @file SimVascularFile.h
 * @brief Paths (.pth) and contour groups (.ctgr) of SimVascular projects.
 *
 * Both are XML, the older ones with two roots (`<format/>` and the contents). SimVascular knows no unit; coordinates
 * stay as they are in the file.
 */
#ifndef DynamicCoronary_SimVascularFile_h
#define DynamicCoronary_SimVascularFile_h

#include "Geometry.h"

#include <string>
#include <vector>

namespace coronary
{
/// A place on a path, with the frame of the plane across it.
struct PathFrame
{
  int id = 0;                          ///< number of the point on its path
  Vector3 position = Vector3::Zero();  ///< unit of the file
  Vector3 tangent = Vector3::UnitZ();  ///< unit vector
  Vector3 rotation = Vector3::UnitX(); ///< unit vector in the plane
};

struct SimVascularPath
{
  int id = 0;
  std::vector<Vector3> controlPoints;
  std::vector<PathFrame> points; ///< of the first time step
};

struct SimVascularContour
{
  int id = 0;
  std::string type; ///< Circle, Contour, SplinePolygon, ...
  PathFrame frame;
  std::vector<Vector3> controlPoints;
  std::vector<Vector3> contourPoints; ///< around the lumen, closed without repeating the first one

  /// Of a circle of the same area; 0 for less than three contour points.
  double Radius() const;

  /// The mean of the contour points; the frame's position without any.
  Vector3 Center() const;
};

struct SimVascularContourGroup
{
  std::string pathName;
  int pathId = 0;
  std::vector<SimVascularContour> contours; ///< of the first time step
};

/**
 * @param name  of the file, for messages
 * @throws std::runtime_error naming `name`, and the line and element at fault: no XML, no `path` in it, a coordinate that is
 *   missing or no finite number, a path without points
 */
SimVascularPath ParseSimVascularPath(const std::string& text, const std::string& name);

/// The same for the `contourgroup` of a .ctgr file; contours without a point are left out.
SimVascularContourGroup ParseSimVascularContours(const std::string& text, const std::string& name);

/// Numbers are read back to the same bits.
std::string SimVascularPathText(const SimVascularPath& path);

/// As splines are lofted through: with the loft's parameters that SimVascular's own projects begin with.
std::string SimVascularContourText(const SimVascularContourGroup& group);

/// The text of a file of at most 256 MiB. @throws std::runtime_error naming it
std::string ReadSimVascularFile(const std::string& path);
}

#endif
