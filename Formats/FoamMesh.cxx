#include "FoamMesh.h"

#include <algorithm>
#include <cstdio>

namespace coronary
{
namespace
{
constexpr int ExactDigits = 17;
constexpr int MotionDigits = 10;

void Append(std::string& text, const Vector3& vector, double scale, int digits)
{
  char line[120];
  const int length = std::snprintf(line, sizeof line, "(%.*g %.*g %.*g)\n", digits,
    scale * vector.x(), digits, scale * vector.y(), digits, scale * vector.z());
  text.append(line, static_cast<std::size_t>(length));
}

std::string Labels(const std::vector<std::int64_t>& labels)
{
  std::string text = std::to_string(labels.size()) + "\n(\n";
  for (const std::int64_t label : labels)
  {
    text += std::to_string(label);
    text += '\n';
  }
  return text + ")\n";
}

std::string Faces(const PolyhedralMesh& mesh)
{
  std::string text = std::to_string(mesh.NumberOfFaces()) + "\n(\n";
  for (std::int64_t f = 0; f < mesh.NumberOfFaces(); ++f)
  {
    const std::int64_t begin = mesh.faceOffset[f];
    const std::int64_t end = mesh.faceOffset[f + 1];
    text += std::to_string(end - begin);
    for (std::int64_t k = begin; k < end; ++k)
    {
      text += k == begin ? '(' : ' ';
      text += std::to_string(mesh.corners[k]);
    }
    text += ")\n";
  }
  return text + ")\n";
}

std::string Boundary(const PolyhedralMesh& mesh, const std::string& wall)
{
  std::string text = std::to_string(mesh.patches.size()) + "\n(\n";
  for (const PolyhedralMesh::Patch& patch : mesh.patches)
  {
    text += "    " + patch.name + "\n    {\n        type    " +
      (patch.name == wall ? "wall" : "patch") + ";\n        nFaces  " +
      std::to_string(patch.faces) + ";\n        startFace " + std::to_string(patch.firstFace) +
      ";\n    }\n";
  }
  return text + ")\n";
}
}

std::string FoamHeader(
  const std::string& kind, const std::string& location, const std::string& object)
{
  return "FoamFile\n{\n    version  2.0;\n    format   ascii;\n    class    " + kind +
    ";\n    location \"" + location + "\";\n    object   " + object + ";\n}\n\n";
}

std::vector<std::pair<std::string, std::string>> FoamMeshFiles(const PolyhedralMesh& mesh,
  const std::vector<Vector3>& points, const std::string& wall, double scale)
{
  const std::string place = "constant/polyMesh";
  return {
    { "points",
      FoamHeader("vectorField", place, "points") + FoamVectors(points, scale, ExactDigits) },
    { "faces", FoamHeader("faceList", place, "faces") + Faces(mesh) },
    { "owner", FoamHeader("labelList", place, "owner") + Labels(mesh.owner) },
    { "neighbour", FoamHeader("labelList", place, "neighbour") + Labels(mesh.neighbour) },
    { "boundary", FoamHeader("polyBoundaryMesh", place, "boundary") + Boundary(mesh, wall) },
  };
}

std::string FoamVectors(const std::vector<Vector3>& vectors, double scale, int digits)
{
  std::string text = std::to_string(vectors.size()) + "\n(\n";
  for (const Vector3& vector : vectors)
  {
    Append(text, vector, scale, digits);
  }
  return text + ")\n";
}

std::vector<std::int64_t> PointsOfPatch(const PolyhedralMesh& mesh, std::size_t patch)
{
  const PolyhedralMesh::Patch& wanted = mesh.patches[patch];
  std::vector<std::int64_t> points(mesh.corners.begin() + mesh.faceOffset[wanted.firstFace],
    mesh.corners.begin() + mesh.faceOffset[wanted.firstFace + wanted.faces]);
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

std::vector<std::pair<std::string, std::string>> FoamMotionPoints(
  const PolyhedralMesh& mesh, const std::vector<Vector3>& rest, double scale)
{
  std::vector<std::pair<std::string, std::string>> files;
  for (std::size_t p = 0; p < mesh.patches.size(); ++p)
  {
    std::vector<Vector3> places;
    for (const std::int64_t point : PointsOfPatch(mesh, p))
    {
      places.push_back(rest[point]);
    }
    files.emplace_back(mesh.patches[p].name + "/points", FoamVectors(places, scale, ExactDigits));
  }
  return files;
}

std::vector<std::pair<std::string, std::string>> FoamMotionFrame(const PolyhedralMesh& mesh,
  const std::vector<Vector3>& rest, const std::vector<Vector3>& moved, double time, double scale)
{
  std::vector<std::pair<std::string, std::string>> files;
  for (std::size_t p = 0; p < mesh.patches.size(); ++p)
  {
    std::vector<Vector3> ways;
    for (const std::int64_t point : PointsOfPatch(mesh, p))
    {
      ways.emplace_back(moved[point] - rest[point]);
    }
    files.emplace_back(mesh.patches[p].name + "/" + FoamTime(time) + "/pointDisplacement",
      FoamVectors(ways, scale, MotionDigits));
  }
  return files;
}

std::string FoamTime(double seconds)
{
  char text[40];
  std::snprintf(text, sizeof text, "%.10g", seconds);
  return text;
}
}
