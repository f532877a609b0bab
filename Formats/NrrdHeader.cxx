#include "VolumeHeaderParsers.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <map>

namespace coronary
{
namespace
{
/// Names in lower case.
struct Fields : HeaderFields
{
  std::map<std::string, std::string> notes; ///< "key:=value", as the writer spelled the key
  std::vector<std::string> list;            ///< file names after "data file: LIST"
  std::size_t end = 0;                      ///< where the header ends
  bool closed = false;                      ///< by an empty line, so that data may follow
};

// The value of a note: "\\n" and "\\\\" stand for the end of a line and a backslash.
std::string NoteValue(const std::string& text)
{
  std::string value;
  for (std::size_t i = 0; i < text.size(); ++i)
  {
    const char next = text[i] == '\\' && i + 1 < text.size() ? text[i + 1] : '\0';
    const bool escaped = next == 'n' || next == '\\';
    value += !escaped ? text[i] : next == 'n' ? '\n' : '\\';
    i += escaped ? 1 : 0;
  }
  return value;
}

Fields ParseFields(const std::string& text, const std::string& path)
{
  if (text.compare(0, 7, "NRRD000") != 0)
  {
    FormatError(path, "is not a NRRD file: it does not begin with 'NRRD000'");
  }
  Fields fields;
  fields.path = path;
  std::size_t position = 0;
  NextLine(text, position);
  bool inList = false;
  while (position < text.size())
  {
    const std::string line = NextLine(text, position);
    if (line.empty())
    {
      fields.closed = true;
      break;
    }
    if (line[0] == '#')
    {
      continue;
    }
    if (inList)
    {
      fields.list.push_back(Trimmed(line));
      continue;
    }
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos)
    {
      FormatError(
        path, "the header line '" + line.substr(0, 32) + "' is neither field nor comment");
    }
    // "key:=value" is a note of the writer, not a field.
    if (colon + 1 < line.size() && line[colon + 1] == '=')
    {
      fields.notes[line.substr(0, colon)] = NoteValue(line.substr(colon + 2));
      continue;
    }
    std::string key = LowerCase(Trimmed(line.substr(0, colon)));
    // Both spellings are in the standard.
    static const std::map<std::string, std::string> aliases = { { "datafile", "data file" },
      { "lineskip", "line skip" }, { "byteskip", "byte skip" }, { "axismins", "axis mins" } };
    const auto alias = aliases.find(key);
    key = alias == aliases.end() ? key : alias->second;
    fields.values[key] = Trimmed(line.substr(colon + 1));
    inList = key == "data file" && fields.values[key].compare(0, 4, "LIST") == 0;
  }
  fields.end = position;
  return fields;
}

VoxelType NrrdTypeOf(const std::string& name, const std::string& path)
{
  static const std::map<std::string, VoxelType> types = { { "signed char", VoxelType::Int8 },
    { "int8", VoxelType::Int8 }, { "int8_t", VoxelType::Int8 }, { "uchar", VoxelType::UInt8 },
    { "unsigned char", VoxelType::UInt8 }, { "uint8", VoxelType::UInt8 },
    { "uint8_t", VoxelType::UInt8 }, { "short", VoxelType::Int16 },
    { "short int", VoxelType::Int16 }, { "signed short", VoxelType::Int16 },
    { "signed short int", VoxelType::Int16 }, { "int16", VoxelType::Int16 },
    { "int16_t", VoxelType::Int16 }, { "ushort", VoxelType::UInt16 },
    { "unsigned short", VoxelType::UInt16 }, { "unsigned short int", VoxelType::UInt16 },
    { "uint16", VoxelType::UInt16 }, { "uint16_t", VoxelType::UInt16 }, { "int", VoxelType::Int32 },
    { "signed int", VoxelType::Int32 }, { "int32", VoxelType::Int32 },
    { "int32_t", VoxelType::Int32 }, { "uint", VoxelType::UInt32 },
    { "unsigned int", VoxelType::UInt32 }, { "uint32", VoxelType::UInt32 },
    { "uint32_t", VoxelType::UInt32 }, { "longlong", VoxelType::Int64 },
    { "long long", VoxelType::Int64 }, { "long long int", VoxelType::Int64 },
    { "signed long long", VoxelType::Int64 }, { "signed long long int", VoxelType::Int64 },
    { "int64", VoxelType::Int64 }, { "int64_t", VoxelType::Int64 },
    { "ulonglong", VoxelType::UInt64 }, { "unsigned long long", VoxelType::UInt64 },
    { "unsigned long long int", VoxelType::UInt64 }, { "uint64", VoxelType::UInt64 },
    { "uint64_t", VoxelType::UInt64 }, { "float", VoxelType::Float32 },
    { "double", VoxelType::Float64 } };
  const auto found = types.find(LowerCase(name));
  if (found == types.end())
  {
    FormatError(path, "type '" + name.substr(0, 32) + "' is not supported");
  }
  return found->second;
}

// "none" or "(x,y,z)"; an axis without direction gives an empty vector.
std::vector<double> ParseVector(
  const std::string& text, const std::string& path, const std::string& key)
{
  if (text.size() < 2 || text.front() != '(' || text.back() != ')')
  {
    FormatError(path, key + " holds '" + text.substr(0, 32) + "', which is not a vector");
  }
  std::string inside = text.substr(1, text.size() - 2);
  const auto count = static_cast<std::size_t>(std::count(inside.begin(), inside.end(), ',')) + 1;
  std::replace(inside.begin(), inside.end(), ',', ' ');
  return ParseNumbers(inside, count, path, key);
}

// Vectors are separated by blanks, and may have blanks inside.
std::vector<std::vector<double>> ParseDirections(const std::string& text, const std::string& path)
{
  const std::string key = "space directions";
  std::vector<std::vector<double>> result;
  std::size_t position = 0;
  for (;;)
  {
    position = text.find_first_not_of(" \t", position);
    if (position == std::string::npos)
    {
      return result;
    }
    if (text.compare(position, 4, "none") == 0)
    {
      result.emplace_back();
      position += 4;
      continue;
    }
    const std::size_t close = text.find(')', position);
    if (close == std::string::npos)
    {
      FormatError(path, key + " is not a list of vectors");
    }
    result.push_back(ParseVector(text.substr(position, close + 1 - position), path, key));
    position = close + 1;
  }
}

// The signs that turn the coordinates of the file into LPS.
Vector3 SignsOfSpace(const std::string& space, VolumeInfo& info)
{
  std::string name = LowerCase(space);
  const std::string time = "-time";
  if (name.size() > time.size() && name.compare(name.size() - time.size(), time.size(), time) == 0)
  {
    name.erase(name.size() - time.size());
  }
  if (name == "right-anterior-superior" || name == "ras" || name == "rast")
  {
    return { -1.0, -1.0, 1.0 };
  }
  if (name == "left-anterior-superior" || name == "las" || name == "last")
  {
    return { 1.0, -1.0, 1.0 };
  }
  if (name == "left-posterior-superior" || name == "lps" || name == "lpst")
  {
    return { 1.0, 1.0, 1.0 };
  }
  if (name == "scanner-xyz" || name == "3d-right-handed" || name == "3d-left-handed")
  {
    info.warnings.push_back("'" + info.path + "': the space is " + name +
      ", which says nothing about the patient; it is taken as LPS.");
    return { 1.0, 1.0, 1.0 };
  }
  FormatError(info.path, "space '" + space.substr(0, 32) + "' is not supported");
}

double MillimetresOfUnit(const std::string& unit, VolumeInfo& info)
{
  static const std::map<std::string, double> units = { { "mm", 1.0 }, { "millimeter", 1.0 },
    { "millimetre", 1.0 }, { "cm", 10.0 }, { "m", 1000.0 }, { "um", 0.001 }, { "", 1.0 },
    { "???", 1.0 } };
  const auto found = units.find(unit);
  if (found == units.end())
  {
    info.warnings.push_back("'" + info.path + "': the space unit '" + unit.substr(0, 16) +
      "' is not known; millimetres are assumed.");
    return 1.0;
  }
  return found->second;
}

// "mm" "mm" "mm"
std::vector<std::string> QuotedWords(const std::string& text)
{
  std::vector<std::string> words;
  std::size_t position = 0;
  for (;;)
  {
    const std::size_t open = text.find('"', position);
    const std::size_t close = open == std::string::npos ? open : text.find('"', open + 1);
    if (close == std::string::npos)
    {
      return words;
    }
    words.push_back(text.substr(open + 1, close - open - 1));
    position = close + 1;
  }
}

bool IsListKind(const std::string& kind)
{
  return kind == "list" || kind == "time" || kind == "none" || kind == "???" || kind == "point";
}

bool IsSpaceKind(const std::string& kind)
{
  return kind == "domain" || kind == "space";
}

// Which of four axes counts the phases: the one without direction, else by kind, else the last.
int PhaseAxis(const std::vector<std::string>& kinds,
  const std::vector<std::vector<double>>& directions, const VolumeInfo& info)
{
  int axis = 3;
  for (int a = 3; a >= 0; --a)
  {
    if (!kinds.empty() && !IsSpaceKind(kinds[a]))
    {
      axis = a;
    }
  }
  for (int a = 3; a >= 0; --a)
  {
    if (!directions.empty() && directions[a].empty())
    {
      axis = a;
    }
  }
  if (axis != 0 && axis != 3)
  {
    FormatError(info.path,
      "axis " + std::to_string(axis) + " counts the phases; it must be the first or the last");
  }
  return axis;
}

void SetGeometry(VolumeHeader& header, const Fields& fields, const std::vector<int>& spatialSize,
  const std::vector<int>& spatialAxes, std::vector<std::vector<double>> directions)
{
  VolumeInfo& info = header.info;
  Matrix3 axes = Matrix3::Identity();
  Vector3 origin = Vector3::Zero();
  Vector3 scale = Vector3::Ones();
  if (const std::string* space = fields.Find("space"))
  {
    scale = SignsOfSpace(*space, info);
  }
  else
  {
    info.warnings.push_back("'" + info.path + "': no 'space' in the header; LPS is assumed.");
  }
  if (const std::string* units = fields.Find("space units"))
  {
    const std::vector<std::string> words = QuotedWords(*units);
    for (std::size_t axis = 0; axis < std::min<std::size_t>(3, words.size()); ++axis)
    {
      scale[static_cast<int>(axis)] *= MillimetresOfUnit(words[axis], info);
    }
  }
  if (!directions.empty())
  {
    for (int a = 0; a < 3; ++a)
    {
      std::vector<double>& vector = directions[spatialAxes[a]];
      if (vector.size() < 3)
      {
        FormatError(info.path,
          "space directions has no three-dimensional vector for axis " +
            std::to_string(spatialAxes[a]));
      }
      axes.col(a) = Vector3(vector[0], vector[1], vector[2]);
    }
  }
  else if (const std::string* spacings = fields.Find("spacings"))
  {
    const std::vector<std::string> words = Words(*spacings);
    for (int a = 0; a < 3; ++a)
    {
      const auto axis = static_cast<std::size_t>(spatialAxes[a]);
      axes(a, a) =
        ParseNumbers(axis < words.size() ? words[axis] : "", 1, info.path, "spacings").front();
      if (!(axes(a, a) > 0.0))
      {
        FormatError(info.path, "spacings is not positive");
      }
    }
  }
  else
  {
    info.warnings.push_back("'" + info.path + "': no voxel spacing; 1 mm is assumed.");
  }
  if (const std::string* text = fields.Find("space origin"))
  {
    const std::vector<double> vector = ParseVector(*text, info.path, "space origin");
    if (vector.size() < 3)
    {
      FormatError(info.path, "space origin has fewer than three numbers");
    }
    origin = Vector3(vector[0], vector[1], vector[2]);
  }
  info.grid.origin = scale.cwiseProduct(origin);
  SetAxes(header, spatialSize, scale.asDiagonal() * axes);
}

std::uint64_t SkipLines(const std::string& file, std::uint64_t offset, int lines)
{
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(offset));
  for (int line = 0; line < lines; ++line)
  {
    std::string ignored;
    if (!std::getline(stream, ignored))
    {
      FormatError(file, "ends within the lines that 'line skip' counts");
    }
    offset += ignored.size() + 1;
  }
  return offset;
}

void SetData(VolumeHeader& header, const Fields& fields)
{
  const std::string& path = header.info.path;
  const std::string encoding = LowerCase(fields.Text("encoding"));
  header.compressed = encoding == "gzip" || encoding == "gz";
  if (!header.compressed && encoding != "raw")
  {
    FormatError(
      path, "encoding '" + encoding.substr(0, 16) + "' is not supported; raw and gzip are");
  }
  if (VoxelBytes(header.type) > 1)
  {
    const std::string endian = LowerCase(fields.Text("endian"));
    if (endian != "big" && endian != "little")
    {
      FormatError(path, "endian is neither little nor big");
    }
    header.bigEndian = endian == "big";
  }
  const std::string* data = fields.Find("data file");
  if (!data)
  {
    if (!fields.closed)
    {
      FormatError(path, "ends inside its header");
    }
    header.dataFiles = { path };
    header.dataOffset = fields.end;
  }
  else
  {
    std::vector<std::string> names = fields.list;
    if (data->compare(0, 4, "LIST") != 0)
    {
      if (data->empty() || data->find('%') != std::string::npos)
      {
        FormatError(path, "data file: '" + data->substr(0, 64) + "' is not supported");
      }
      names = { *data };
    }
    if (names.empty())
    {
      FormatError(path, "data file: LIST names no files");
    }
    for (const std::string& name : names)
    {
      header.dataFiles.push_back(PathBeside(path, name));
      CheckedFileSize(header.dataFiles.back());
    }
  }
  const int lines = fields.Integer("line skip", 0, 0);
  if (lines > 0 && header.dataFiles.size() > 1)
  {
    FormatError(path, "line skip with several data files is not supported");
  }
  header.dataOffset = SkipLines(header.dataFiles.front(), header.dataOffset, lines);
  const int bytes = fields.Integer("byte skip", -1, 0);
  if (bytes < 0 || (bytes > 0 && header.compressed))
  {
    FormatError(path, "byte skip: " + fields.Text("byte skip") + " is not supported here");
  }
  header.dataOffset += static_cast<std::uint64_t>(bytes);
}
}

std::map<std::string, std::string> ParseNrrdNotes(const std::string& text, const std::string& path)
{
  return ParseFields(text, path).notes;
}

VolumeHeader ReadNrrdHeader(const std::string& path)
{
  VolumeHeader header;
  VolumeInfo& info = header.info;
  info.path = path;
  info.format = "NRRD";
  const Fields fields = ParseFields(ReadHeaderText(path), path);
  header.notes = fields.notes;
  const int dimension = fields.Dimensions("dimension");
  const auto count = static_cast<std::size_t>(dimension);
  const std::vector<int> size = fields.Integers("sizes", count, 1);
  std::vector<std::string> kinds;
  if (const std::string* text = fields.Find("kinds"))
  {
    kinds = Words(LowerCase(*text));
    if (kinds.size() != count)
    {
      FormatError(path,
        "kinds has " + std::to_string(kinds.size()) + " words instead of " +
          std::to_string(dimension));
    }
  }
  std::vector<std::vector<double>> directions;
  if (const std::string* text = fields.Find("space directions"))
  {
    directions = ParseDirections(*text, path);
    if (directions.size() != count)
    {
      FormatError(path,
        "space directions has " + std::to_string(directions.size()) + " vectors instead of " +
          std::to_string(dimension));
    }
  }
  const int phaseAxis = dimension == 4 ? PhaseAxis(kinds, directions, info) : -1;
  std::vector<int> spatialAxes;
  for (int axis = 0; axis < dimension; ++axis)
  {
    const bool listOfPhases = axis == phaseAxis;
    const bool known = kinds.empty() ||
      (listOfPhases ? IsListKind(kinds[axis]) || IsSpaceKind(kinds[axis])
                    : IsSpaceKind(kinds[axis]) || kinds[axis] == "???" || kinds[axis] == "none");
    if (!known && !(listOfPhases && size[axis] == 1))
    {
      FormatError(path,
        "image has " + std::to_string(size[axis]) + " components (axis " + std::to_string(axis) +
          " is of kind '" + kinds[axis].substr(0, 32) + "'); one is needed");
    }
    if (!listOfPhases)
    {
      spatialAxes.push_back(axis);
    }
  }
  info.phases = phaseAxis >= 0 ? size[phaseAxis] : 1;
  header.phasesFirst = phaseAxis == 0;
  header.type = NrrdTypeOf(fields.Text("type"), path);
  SetGeometry(header, fields, { size[spatialAxes[0]], size[spatialAxes[1]], size[spatialAxes[2]] },
    spatialAxes, directions);
  SetData(header, fields);
  return header;
}
}
