/**
 * @file MeasuredHeart.h
 * @brief Reads the surfaces of a measured heart: legacy VTK files of version 5, ASCII, triangles.
 */
#ifndef DynamicCoronary_MeasuredHeart_h
#define DynamicCoronary_MeasuredHeart_h

#include "Geometry.h"

#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace coronary
{
struct HeartSurface
{
  std::vector<Vector3> points;
  std::vector<Triangle> triangles;
};

/// Number of frames of biv-motion, over one beat.
constexpr int MeasuredFrames = 25;

/// "EPICARDIAL" or "LV_ENDOCARDIAL" at one frame; false when the file is not there or not whole.
inline bool ReadHeartSurface(
  const std::string& folder, const char* name, int frame, HeartSurface& surface)
{
  char file[64];
  std::snprintf(file, sizeof file, "/patient1_%s_%03d.vtk", name, frame);
  std::ifstream stream(folder + file);
  std::string word;
  while (stream >> word && word != "POINTS")
  {
  }
  std::size_t count = 0;
  if (!(stream >> count >> word))
  {
    return false;
  }
  surface.points.resize(count);
  for (Vector3& point : surface.points)
  {
    stream >> point.x() >> point.y() >> point.z();
  }
  while (stream >> word && word != "CONNECTIVITY")
  {
  }
  stream >> word;
  surface.triangles.clear();
  for (Triangle corner{}; stream >> corner[0] >> corner[1] >> corner[2];)
  {
    surface.triangles.push_back(corner);
  }
  return !surface.triangles.empty();
}
}

#endif
