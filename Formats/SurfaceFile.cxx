#include "SurfaceFile.h"

#include "LittleEndian.h"
#include "TextScanner.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
/// One line.
std::string Line(std::string text)
{
  std::replace_if(
    text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

void AppendFloats(std::string& bytes, const Vector3& v)
{
  for (int c = 0; c < 3; ++c)
  {
    AppendLittleEndian(bytes, static_cast<float>(v[c]));
  }
}
}

std::string ObjText(const FileSurface& surface)
{
  std::string text = "# " + Line(surface.comment) + "\n";
  for (const Vector3& point : surface.points)
  {
    text += 'v';
    for (int c = 0; c < 3; ++c)
    {
      text += ' ';
      AppendNumber(text, point[c]);
    }
    text += '\n';
  }
  for (const auto& [id, name] : surface.faces)
  {
    text += "g " + name + "\n";
    for (std::size_t n = 0; n < surface.triangles.size(); ++n)
    {
      if (surface.face[n] != id)
      {
        continue;
      }
      text += 'f';
      for (const std::int64_t corner : surface.triangles[n])
      {
        text += ' ';
        AppendNumber(text, corner + 1);
      }
      text += '\n';
    }
  }
  return text;
}

std::string PlyBytes(const FileSurface& surface)
{
  std::string file =
    "ply\nformat binary_little_endian 1.0\ncomment " + Line(surface.comment) + "\n";
  for (const auto& [id, name] : surface.faces)
  {
    file += "comment face_id " + std::to_string(id) + " " + Line(name) + "\n";
  }
  file += "element vertex " + std::to_string(surface.points.size()) +
    "\nproperty float x\nproperty float y\nproperty float z\n";
  for (const auto& [name, values] : surface.vertexValues)
  {
    file.append("property float ").append(name).append("\n");
  }
  file += "element face " + std::to_string(surface.triangles.size()) +
    "\nproperty list uchar int vertex_indices\nproperty int face_id\nend_header\n";
  for (std::size_t n = 0; n < surface.points.size(); ++n)
  {
    AppendFloats(file, surface.points[n]);
    for (const auto& [name, values] : surface.vertexValues)
    {
      AppendLittleEndian(file, values[n]);
    }
  }
  for (std::size_t n = 0; n < surface.triangles.size(); ++n)
  {
    file += '\3';
    for (const std::int64_t corner : surface.triangles[n])
    {
      AppendLittleEndian(file, static_cast<std::int32_t>(corner));
    }
    AppendLittleEndian(file, static_cast<std::int32_t>(surface.face[n]));
  }
  return file;
}

std::string StlBytes(const FileSurface& surface)
{
  if (surface.triangles.size() > std::numeric_limits<std::uint32_t>::max())
  {
    throw std::invalid_argument("A surface has too many triangles for an .stl file");
  }
  constexpr std::size_t HeaderSize = 80;
  std::string file = Line(surface.comment);
  file.resize(HeaderSize, ' '); // may not begin with "solid", which a text file does
  AppendLittleEndian(file, static_cast<std::uint32_t>(surface.triangles.size()));
  for (const Triangle& triangle : surface.triangles)
  {
    const Vector3& a = surface.points[static_cast<std::size_t>(triangle[0])];
    const Vector3& b = surface.points[static_cast<std::size_t>(triangle[1])];
    const Vector3& c = surface.points[static_cast<std::size_t>(triangle[2])];
    AppendFloats(file, (b - a).cross(c - a).stableNormalized());
    AppendFloats(file, a);
    AppendFloats(file, b);
    AppendFloats(file, c);
    AppendLittleEndian(file, std::uint16_t{ 0 });
  }
  return file;
}
}
