#include "ByteOrder.h"
#include "MeshFile.h"
#include "TextScanner.h"
#include "TextWords.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <vector>

namespace coronary
{
namespace
{
[[noreturn]] void Refuse(const TextScanner& file, const std::string& what)
{
  throw std::runtime_error("'" + file.Path() + "' " + what + ".");
}

// STL -----------------------------------------------------------------------------------------------------------------
constexpr std::size_t StlHead = 84;
constexpr std::size_t StlTriangle = 50;

/// Points that are the same become one.
class PointMerger
{
public:
  explicit PointMerger(std::vector<Vector3>& points)
    : Points(points)
  {
  }

  std::int64_t Add(const Vector3& point)
  {
    const std::array<double, 3> key{ point.x() + 0.0, point.y() + 0.0, point.z() + 0.0 };
    const auto [place, isNew] =
      this->Known.emplace(key, static_cast<std::int64_t>(this->Points.size()));
    if (isNew)
    {
      this->Points.emplace_back(key[0], key[1], key[2]);
    }
    return place->second;
  }

private:
  std::vector<Vector3>& Points;
  std::map<std::array<double, 3>, std::int64_t> Known;
};

void AddTriangle(FileMesh& mesh, const Triangle& corners)
{
  if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
  {
    mesh.triangles.push_back(corners);
  }
}

void ReadBinaryStl(const TextScanner& file, std::size_t count, FileMesh& mesh)
{
  PointMerger merger(mesh.points);
  for (std::size_t t = 0; t < count; ++t)
  {
    const char* at = file.Text().data() + StlHead + t * StlTriangle + 12; // behind the normal
    Triangle corners;
    for (std::size_t c = 0; c < 3; ++c)
    {
      Vector3 point;
      for (int axis = 0; axis < 3; ++axis, at += 4)
      {
        point[axis] = static_cast<double>(NumberAt<float>(at, false));
      }
      if (!point.allFinite())
      {
        Refuse(file,
          "has a coordinate that is not finite, in triangle " + std::to_string(t) +
            " counted from 0");
      }
      corners[c] = merger.Add(point);
    }
    AddTriangle(mesh, corners);
  }
}

void ReadTextStl(TextScanner& file, FileMesh& mesh)
{
  PointMerger merger(mesh.points);
  std::vector<std::int64_t> corners;
  bool ended = false;
  while (!file.AtEnd())
  {
    const std::string_view word = file.Word();
    ended = word == "endsolid";
    if (word == "solid" || ended)
    {
      file.SkipLine();
    }
    else if (word == "facet")
    {
      corners.clear();
      file.SkipLine();
    }
    else if (word == "vertex")
    {
      corners.push_back(merger.Add(file.Point()));
    }
    else if (word == "endfacet")
    {
      if (corners.size() != 3)
      {
        file.Fail("a facet has " + std::to_string(corners.size()) + " corners instead of 3");
      }
      AddTriangle(mesh, { corners[0], corners[1], corners[2] });
    }
    else if (word != "outer" && word != "loop" && word != "endloop")
    {
      file.Fail("this is no word of an STL file");
    }
  }
  if (!ended)
  {
    Refuse(file, "ends before its 'endsolid'");
  }
}

// PLY -----------------------------------------------------------------------------------------------------------------
struct PlyType
{
  std::size_t bytes = 0;
  double (*read)(const char* at, bool bigEndian) = nullptr;
};

template <typename Value>
PlyType TypeFor()
{
  return { sizeof(Value), [](const char* at, bool bigEndian) {
            return static_cast<double>(NumberAt<Value>(at, bigEndian));
          } };
}

PlyType TypeOf(const TextScanner& file, std::string_view name)
{
  static const std::map<std::string_view, PlyType> types{ { "char", TypeFor<std::int8_t>() },
    { "int8", TypeFor<std::int8_t>() }, { "uchar", TypeFor<std::uint8_t>() },
    { "uint8", TypeFor<std::uint8_t>() }, { "short", TypeFor<std::int16_t>() },
    { "int16", TypeFor<std::int16_t>() }, { "ushort", TypeFor<std::uint16_t>() },
    { "uint16", TypeFor<std::uint16_t>() }, { "int", TypeFor<std::int32_t>() },
    { "int32", TypeFor<std::int32_t>() }, { "uint", TypeFor<std::uint32_t>() },
    { "uint32", TypeFor<std::uint32_t>() }, { "float", TypeFor<float>() },
    { "float32", TypeFor<float>() }, { "double", TypeFor<double>() },
    { "float64", TypeFor<double>() } };
  const auto found = types.find(name);
  if (found == types.end())
  {
    file.Fail("this is no type of a PLY file");
  }
  return found->second;
}

struct PlyProperty
{
  std::string name;
  PlyType type;
  bool isList = false;
  PlyType count; ///< of a list
};

struct PlyElement
{
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

/// The numbers behind the header, in either form.
class PlyValues
{
public:
  enum class Form
  {
    Text,
    Little,
    Big
  };

  PlyValues(TextScanner& file, Form form)
    : File(file)
    , Kind(form)
    , At(file.Position())
  {
  }

  /// Bytes that are left: no element needs fewer than one.
  std::size_t Left() const
  {
    return this->File.Text().size() - (this->Kind == Form::Text ? this->File.Position() : this->At);
  }

  double Next(const PlyType& type)
  {
    if (this->Kind == Form::Text)
    {
      return this->File.Number();
    }
    if (this->Left() < type.bytes)
    {
      Refuse(this->File, "ends before its last element");
    }
    const char* at = this->File.Text().data() + this->At;
    this->At += type.bytes;
    return type.read(at, this->Kind == Form::Big);
  }

  /// How many numbers a property has of the element that comes next.
  std::int64_t LengthOf(const PlyProperty& property)
  {
    return property.isList ? this->Whole(property.count, 4294967295.0, "a list of no length") : 1;
  }

  /// A whole number from 0 to `most`. @param what  it is, for the message
  std::int64_t Whole(const PlyType& type, double most, const char* what)
  {
    const double value = this->Next(type);
    if (!(value >= 0.0 && value <= most && value == std::floor(value)))
    {
      Refuse(this->File, std::string("has ") + what);
    }
    return static_cast<std::int64_t>(value);
  }

private:
  TextScanner& File;
  Form Kind;
  std::size_t At; ///< of binary numbers
};

PlyProperty ReadProperty(TextScanner& file)
{
  PlyProperty property;
  std::string_view type = file.Word();
  property.isList = type == "list";
  if (property.isList)
  {
    property.count = TypeOf(file, file.Word());
    type = file.Word();
  }
  property.type = TypeOf(file, type);
  property.name = file.Word();
  return property;
}

PlyValues::Form ReadPlyForm(TextScanner& file)
{
  const std::string_view word = file.Word();
  if (word == "ascii")
  {
    return PlyValues::Form::Text;
  }
  if (word != "binary_little_endian" && word != "binary_big_endian")
  {
    file.Fail("this is no form of a PLY file");
  }
  return word == "binary_big_endian" ? PlyValues::Form::Big : PlyValues::Form::Little;
}

/// Up to the end of the line behind `end_header`.
PlyValues ReadPlyHeader(TextScanner& file, std::vector<PlyElement>& elements)
{
  if (file.AtEnd() || file.Word() != "ply")
  {
    Refuse(file, "is no PLY file: it does not begin with 'ply'");
  }
  PlyValues::Form form = PlyValues::Form::Text;
  for (;;)
  {
    const std::string_view word = file.Word();
    if (word == "end_header")
    {
      break;
    }
    if (word == "format")
    {
      form = ReadPlyForm(file);
    }
    else if (word == "element")
    {
      elements.emplace_back();
      elements.back().name = file.Word();
      elements.back().count = file.Integer();
    }
    else if (word == "property")
    {
      if (elements.empty())
      {
        file.Fail("a property stands before the first element");
      }
      elements.back().properties.push_back(ReadProperty(file));
    }
    else if (word != "comment" && word != "obj_info")
    {
      file.Fail("this is no word of the header of a PLY file");
    }
    file.SkipLine();
  }
  file.SkipLine();
  if (file.Position() < file.Text().size())
  {
    file.SkipCharacter();
  }
  return { file, form };
}

void ReadVertices(TextScanner& file, PlyValues& values, const PlyElement& element, FileMesh& mesh)
{
  std::array<std::size_t, 3> place{};
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const std::string name(1, "xyz"[axis]);
    const auto found = std::find_if(element.properties.begin(), element.properties.end(),
      [&](const PlyProperty& property) { return property.name == name && !property.isList; });
    if (found == element.properties.end())
    {
      Refuse(file, "has vertices without '" + name + "'");
    }
    place[axis] = static_cast<std::size_t>(found - element.properties.begin());
  }
  for (std::int64_t n = 0; n < element.count; ++n)
  {
    Vector3 point = Vector3::Zero();
    for (std::size_t p = 0; p < element.properties.size(); ++p)
    {
      const PlyProperty& property = element.properties[p];
      double value = 0.0;
      for (std::int64_t left = values.LengthOf(property); left > 0; --left)
      {
        value = values.Next(property.type);
      }
      for (std::size_t axis = 0; axis < 3; ++axis)
      {
        point[static_cast<int>(axis)] = place[axis] == p ? value : point[static_cast<int>(axis)];
      }
    }
    if (!point.allFinite())
    {
      Refuse(file, "has a coordinate that is not finite, at vertex " + std::to_string(n));
    }
    mesh.points.push_back(point);
  }
}

void ReadOthers(PlyValues& values, const PlyElement& element, FileMesh& mesh)
{
  std::vector<std::int64_t> corners;
  for (std::int64_t n = 0; n < element.count; ++n)
  {
    for (const PlyProperty& property : element.properties)
    {
      std::int64_t left = values.LengthOf(property);
      if (element.name != "face" ||
        (property.name != "vertex_indices" && property.name != "vertex_index"))
      {
        for (; left > 0; --left)
        {
          values.Next(property.type);
        }
        continue;
      }
      corners.clear();
      for (; left > 0; --left)
      {
        corners.push_back(values.Whole(property.type, static_cast<double>(mesh.points.size()) - 1.0,
          "a corner that is none of its vertices"));
      }
      for (std::size_t c = 2; c < corners.size(); ++c)
      {
        AddTriangle(mesh, { corners[0], corners[c - 1], corners[c] });
      }
    }
  }
}

void AppendFloats(std::string& bytes, const Vector3& v)
{
  for (int c = 0; c < 3; ++c)
  {
    AppendLittleEndian(bytes, static_cast<float>(v[c]));
  }
}
}

FileMesh ReadStlFile(const std::string& path)
{
  TextScanner file(path);
  const std::string& bytes = file.Text();
  const std::size_t claimed =
    bytes.size() >= StlHead ? NumberAt<std::uint32_t>(bytes.data() + StlHead - 4, false) : 0;
  const bool fits = bytes.size() >= StlHead && claimed == (bytes.size() - StlHead) / StlTriangle &&
    (bytes.size() - StlHead) % StlTriangle == 0;
  FileMesh mesh;
  if (!fits && bytes.compare(0, 5, "solid") == 0)
  {
    ReadTextStl(file, mesh);
  }
  else if (bytes.size() < StlHead)
  {
    Refuse(file, "is no STL file: it is shorter than the head of one");
  }
  else if (claimed > (bytes.size() - StlHead) / StlTriangle)
  {
    Refuse(file,
      "is no STL file or cut off: it says that it has " + std::to_string(claimed) +
        " triangles, and has room for " + std::to_string((bytes.size() - StlHead) / StlTriangle));
  }
  else
  {
    ReadBinaryStl(file, claimed, mesh);
  }
  return mesh;
}

FileMesh ReadPlyFile(const std::string& path)
{
  TextScanner file(path);
  std::vector<PlyElement> elements;
  PlyValues values = ReadPlyHeader(file, elements);
  FileMesh mesh;
  for (const PlyElement& element : elements)
  {
    if (element.properties.empty())
    {
      continue;
    }
    if (element.count < 0 || static_cast<std::size_t>(element.count) > values.Left())
    {
      Refuse(file,
        "is too short for the " + std::to_string(element.count) + " elements '" +
          element.name.substr(0, 40) + "' that it says it has");
    }
    if (element.name == "vertex")
    {
      ReadVertices(file, values, element, mesh);
    }
    else
    {
      ReadOthers(values, element, mesh);
    }
  }
  return mesh;
}

std::string PlyBytes(const FileMesh& mesh)
{
  std::string file =
    "ply\nformat binary_little_endian 1.0\ncomment " + InOneLine(mesh.comment) + "\n";
  for (const auto& [id, name] : mesh.faces)
  {
    file += "comment face_id " + std::to_string(id) + " " + InOneLine(name) + "\n";
  }
  file += "element vertex " + std::to_string(mesh.points.size()) +
    "\nproperty float x\nproperty float y\nproperty float z\n";
  for (const auto& [name, values] : mesh.vertexValues)
  {
    file.append("property float ").append(name).append("\n");
  }
  file += "element face " + std::to_string(mesh.triangles.size()) +
    "\nproperty list uchar int vertex_indices\nproperty int face_id\nend_header\n";
  for (std::size_t n = 0; n < mesh.points.size(); ++n)
  {
    AppendFloats(file, mesh.points[n]);
    for (const auto& [name, values] : mesh.vertexValues)
    {
      AppendLittleEndian(file, values[n]);
    }
  }
  for (std::size_t n = 0; n < mesh.triangles.size(); ++n)
  {
    file += '\3';
    for (const std::int64_t corner : mesh.triangles[n])
    {
      AppendLittleEndian(file, static_cast<std::int32_t>(corner));
    }
    AppendLittleEndian(file, static_cast<std::int32_t>(mesh.face[n]));
  }
  return file;
}

std::string StlBytes(const FileMesh& mesh)
{
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max())
  {
    throw std::invalid_argument("A surface has too many triangles for an .stl file");
  }
  constexpr std::size_t HeaderSize = 80;
  std::string file = InOneLine(mesh.comment);
  file.resize(HeaderSize, ' '); // may not begin with "solid", which a text file does
  AppendLittleEndian(file, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& triangle : mesh.triangles)
  {
    const Vector3& a = mesh.points[static_cast<std::size_t>(triangle[0])];
    const Vector3& b = mesh.points[static_cast<std::size_t>(triangle[1])];
    const Vector3& c = mesh.points[static_cast<std::size_t>(triangle[2])];
    AppendFloats(file, (b - a).cross(c - a).stableNormalized());
    AppendFloats(file, a);
    AppendFloats(file, b);
    AppendFloats(file, c);
    AppendLittleEndian(file, std::uint16_t{ 0 });
  }
  return file;
}
}
