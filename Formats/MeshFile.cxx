#include "MeshFile.h"

#include "AtomicFile.h"
#include "TextScanner.h"
#include "TextWords.h"

#include <map>
#include <stdexcept>

namespace coronary
{
namespace
{
void AddPolygon(std::vector<Triangle>& triangles, const std::vector<std::int64_t>& corners)
{
  for (std::size_t n = 2; n < corners.size(); ++n)
  {
    triangles.push_back({ corners[0], corners[n - 1], corners[n] });
  }
}

std::int64_t Corner(const TextScanner& file, std::int64_t index, std::size_t points)
{
  if (index < 0 || index >= static_cast<std::int64_t>(points))
  {
    file.Fail("a corner is point " + std::to_string(index) + " counted from 0, there are " +
      std::to_string(points));
  }
  return index;
}

/// A number of points or cells; each of them needs some characters.
std::int64_t Count(TextScanner& file)
{
  const std::int64_t count = file.Integer();
  if (count < 0 || count > static_cast<std::int64_t>(file.Text().size()))
  {
    file.Fail("the file is too short for " + std::to_string(count) + " points or cells");
  }
  return count;
}

FileMesh ReadObj(TextScanner& file)
{
  file.SetComment('#');
  FileMesh mesh;
  std::vector<std::int64_t> corners;
  while (!file.AtEnd())
  {
    const std::string_view keyword = file.Word();
    if (keyword == "v")
    {
      mesh.points.push_back(file.Point());
    }
    else if (keyword == "f")
    {
      corners.clear();
      while (!file.AtLineEnd())
      {
        const std::string_view word = file.Word();
        if (word == "\\")
        {
          file.SkipLine();
          if (file.AtEnd())
          {
            break;
          }
          continue;
        }
        const std::string_view first = word.substr(0, word.find('/'));
        std::int64_t index = 0;
        if (!ParseNumber(first, index) || index == 0)
        {
          file.Fail("a face has a corner that is no number of a point");
        }
        const auto points = static_cast<std::int64_t>(mesh.points.size());
        corners.push_back(Corner(file, index > 0 ? index - 1 : points + index, mesh.points.size()));
      }
      if (corners.size() < 3)
      {
        file.Fail("a face has fewer than three corners");
      }
      AddPolygon(mesh.triangles, corners);
    }
    file.SkipLine();
  }
  return mesh;
}

FileMesh ReadOff(TextScanner& file)
{
  file.SetComment('#');
  FileMesh mesh;
  const std::string_view head = file.Word();
  if (head.size() < 3 || head.substr(head.size() - 3) != "OFF" || head.find('4') != head.npos ||
    head.find('n') != head.npos)
  {
    file.Fail("the file does not begin with OFF, or is not of three dimensions");
  }
  if (!file.AtLineEnd() && file.Text().compare(file.Position(), 6, "BINARY") == 0)
  {
    file.Fail("binary OFF files are not read");
  }
  const std::int64_t points = Count(file);
  const std::int64_t faces = Count(file);
  file.SkipLine(); // the number of edges, which some leave out
  for (std::int64_t n = 0; n < points; ++n)
  {
    mesh.points.push_back(file.Point());
    file.SkipLine();
  }
  std::vector<std::int64_t> corners;
  for (std::int64_t n = 0; n < faces; ++n)
  {
    const std::int64_t count = Count(file);
    if (count < 3)
    {
      file.Fail("a face has fewer than three corners");
    }
    corners.clear();
    for (std::int64_t c = 0; c < count; ++c)
    {
      corners.push_back(Corner(file, file.Integer(), mesh.points.size()));
    }
    AddPolygon(mesh.triangles, corners);
    file.SkipLine();
  }
  return mesh;
}

FileMesh ReadMedit(TextScanner& file)
{
  file.SetComment('#');
  FileMesh mesh;
  // Numbers of an entry of what is passed over.
  static const std::map<std::string_view, int> passed{ { "Edges", 3 }, { "Hexahedra", 9 },
    { "Corners", 1 }, { "Ridges", 1 }, { "RequiredVertices", 1 }, { "RequiredEdges", 1 },
    { "RequiredTriangles", 1 }, { "RequiredQuadrilaterals", 1 }, { "Normals", 3 },
    { "Tangents", 3 }, { "NormalAtVertices", 2 }, { "TangentAtVertices", 2 },
    { "NormalAtTriangleVertices", 3 } };
  if (file.Word() != "MeshVersionFormatted")
  {
    file.Fail("the file does not begin with MeshVersionFormatted (Medit's text format)");
  }
  file.Integer();
  bool hasPoints = false;
  while (!file.AtEnd())
  {
    const std::string keyword(file.Word());
    if (keyword == "End")
    {
      break;
    }
    if (keyword == "Dimension")
    {
      if (file.Integer() != 3)
      {
        file.Fail("the mesh is not of three dimensions");
      }
      continue;
    }
    if (keyword == "Vertices")
    {
      const std::int64_t count = Count(file);
      for (std::int64_t n = 0; n < count; ++n)
      {
        mesh.points.push_back(file.Point());
        file.Number(); // its reference
      }
      hasPoints = true;
    }
    else if (keyword == "Triangles" || keyword == "Quadrilaterals" || keyword == "Tetrahedra")
    {
      if (!hasPoints)
      {
        file.Fail(keyword + " come before the vertices");
      }
      const std::size_t width = keyword == "Triangles" ? 3 : 4;
      const std::int64_t count = Count(file);
      std::vector<std::int64_t> corners(width);
      for (std::int64_t n = 0; n < count; ++n)
      {
        for (std::int64_t& corner : corners)
        {
          const std::int64_t index = file.Integer();
          // From 1; the least integer has no one before it.
          corner = Corner(file, index < 1 ? -1 : index - 1, mesh.points.size());
        }
        file.Number();
        if (keyword == "Tetrahedra")
        {
          mesh.tetrahedra.push_back({ corners[0], corners[1], corners[2], corners[3] });
        }
        else
        {
          AddPolygon(mesh.triangles, corners);
        }
      }
    }
    else
    {
      const auto known = passed.find(keyword);
      if (known == passed.end())
      {
        file.Fail("a part of the mesh is not known");
      }
      const std::int64_t count = Count(file);
      for (std::int64_t n = 0; n < count * known->second; ++n)
      {
        file.Word();
      }
    }
  }
  return mesh;
}

/// A line for each of `lines`: what stands before its numbers, the numbers, what stands behind them.
template <typename Lines>
void AppendLines(std::string& text, const char* before, const Lines& lines, const char* behind)
{
  for (const auto& numbers : lines)
  {
    text += before;
    AppendNumbers(text, numbers);
    text += behind;
  }
}

/// Cells whose corners count from 1.
template <typename Cell>
std::vector<Cell> FromOne(std::vector<Cell> cells)
{
  for (Cell& cell : cells)
  {
    for (std::int64_t& corner : cell)
    {
      ++corner;
    }
  }
  return cells;
}

void CheckMesh(const std::string& path, const FileMesh& mesh)
{
  const auto points = static_cast<std::int64_t>(mesh.points.size());
  const auto fail = [&](const std::string& what)
  { throw std::runtime_error("Cannot write '" + path + "': " + what + "."); };
  for (std::size_t n = 0; n < mesh.points.size(); ++n)
  {
    if (!mesh.points[n].allFinite())
    {
      fail("point " + std::to_string(n) + " has a coordinate that is not finite");
    }
  }
  const auto check = [&](const auto& cells, const char* what)
  {
    for (std::size_t n = 0; n < cells.size(); ++n)
    {
      for (const std::int64_t corner : cells[n])
      {
        if (corner < 0 || corner >= points)
        {
          fail(what + std::to_string(n) + " has a corner that does not exist");
        }
      }
    }
  };
  check(mesh.triangles, "triangle ");
  check(mesh.tetrahedra, "tetrahedron ");
  if (!mesh.tetrahedra.empty() && !EndsWith(path, ".mesh"))
  {
    fail("only .mesh files have tetrahedra");
  }
}

[[noreturn]] void RefuseName(const std::string& path)
{
  throw std::runtime_error("'" + path + "' is no .obj, .off or .mesh file.");
}
}

bool IsMeshFile(const std::string& path)
{
  return EndsWith(path, ".obj") || EndsWith(path, ".off") || EndsWith(path, ".mesh");
}

FileMesh ReadMeshFile(const std::string& path)
{
  if (!IsMeshFile(path))
  {
    RefuseName(path);
  }
  TextScanner file(path);
  return EndsWith(path, ".obj") ? ReadObj(file)
    : EndsWith(path, ".off")    ? ReadOff(file)
                                : ReadMedit(file);
}

void WriteMeshFile(const std::string& path, const FileMesh& mesh)
{
  if (!IsMeshFile(path))
  {
    RefuseName(path);
  }
  CheckMesh(path, mesh);
  std::string text;
  if (EndsWith(path, ".obj"))
  {
    text = ObjText(mesh);
  }
  else if (EndsWith(path, ".off"))
  {
    text = "OFF\n" + std::to_string(mesh.points.size()) + ' ' +
      std::to_string(mesh.triangles.size()) + " 0\n";
    AppendLines(text, "", mesh.points, "\n");
    AppendLines(text, "3 ", mesh.triangles, "\n");
  }
  else
  {
    text = "MeshVersionFormatted 2\nDimension 3\n";
    const auto add = [&](const char* keyword, const auto& lines)
    {
      text += keyword + std::string("\n") + std::to_string(lines.size()) + "\n";
      AppendLines(text, "", lines, " 0\n");
    };
    add("Vertices", mesh.points);
    add("Triangles", FromOne(mesh.triangles));
    add("Tetrahedra", FromOne(mesh.tetrahedra));
    text += "End\n";
  }
  WriteFileAtomically(path, text);
}

std::string ObjText(const FileMesh& mesh)
{
  std::string text = mesh.comment.empty() ? "" : "# " + InOneLine(mesh.comment) + "\n";
  AppendLines(text, "v ", mesh.points, "\n");
  const std::vector<Triangle> triangles = FromOne(mesh.triangles);
  if (mesh.faces.empty())
  {
    AppendLines(text, "f ", triangles, "\n");
  }
  for (const auto& [id, name] : mesh.faces)
  {
    text += "g " + name + "\n";
    for (std::size_t n = 0; n < triangles.size(); ++n)
    {
      if (mesh.face[n] == id)
      {
        AppendLines(text, "f ", std::array<Triangle, 1>{ triangles[n] }, "\n");
      }
    }
  }
  return text;
}
}
