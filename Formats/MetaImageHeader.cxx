#include "VolumeHeaderParsers.h"

#include <algorithm>
#include <map>

namespace coronary
{
namespace
{
bool IsTrue(const HeaderFields& fields, std::initializer_list<const char*> keys, bool otherwise)
{
  const std::string* value = fields.Find(keys);
  return value ? (!value->empty() && ((*value)[0] == 'T' || (*value)[0] == 't' || *value == "1"))
               : otherwise;
}

VoxelType TypeOf(const std::string& name, const std::string& path)
{
  static const std::map<std::string, VoxelType> types = { { "MET_CHAR", VoxelType::Int8 },
    { "MET_UCHAR", VoxelType::UInt8 }, { "MET_SHORT", VoxelType::Int16 },
    { "MET_USHORT", VoxelType::UInt16 }, { "MET_INT", VoxelType::Int32 },
    { "MET_UINT", VoxelType::UInt32 }, { "MET_LONG", VoxelType::Int32 },
    { "MET_ULONG", VoxelType::UInt32 }, { "MET_LONG_LONG", VoxelType::Int64 },
    { "MET_ULONG_LONG", VoxelType::UInt64 }, { "MET_FLOAT", VoxelType::Float32 },
    { "MET_DOUBLE", VoxelType::Float64 } };
  const auto found = types.find(name);
  if (found == types.end())
  {
    FormatError(path, "ElementType '" + name.substr(0, 32) + "' is not supported");
  }
  return found->second;
}

// Reads the "key = value" lines up to ElementDataFile, which is the last; returns where they end.
std::size_t ReadFields(HeaderFields& fields)
{
  const std::string text = ReadHeaderText(fields.path);
  std::size_t position = 0;
  while (position < text.size())
  {
    const std::string line = NextLine(text, position);
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos)
    {
      if (!Trimmed(line).empty())
      {
        break;
      }
      continue;
    }
    const std::string key = Trimmed(line.substr(0, equals));
    fields.values[key] = Trimmed(line.substr(equals + 1));
    if (key == "ElementDataFile")
    {
      return position;
    }
  }
  FormatError(fields.path, "is not a MetaImage: no ElementDataFile in its header");
}

void SetGeometry(VolumeHeader& header, const HeaderFields& fields, std::size_t dimensions)
{
  VolumeInfo& info = header.info;
  const std::vector<int> size = fields.Integers("DimSize", dimensions, 1);
  info.phases = dimensions == 4 ? size[3] : 1;

  std::vector<double> spacing(dimensions, 1.0);
  if (const std::string* text = fields.Find({ "ElementSpacing", "ElementSize" }))
  {
    spacing = ParseNumbers(*text, dimensions, info.path, "ElementSpacing");
  }
  else
  {
    info.warnings.push_back("'" + info.path + "': no ElementSpacing; 1 mm is assumed.");
  }
  const std::string* offset = fields.Find({ "Offset", "Origin", "Position" });
  if (offset)
  {
    const std::vector<double> origin = ParseNumbers(*offset, dimensions, info.path, "Offset");
    info.grid.origin = Vector3(origin[0], origin[1], origin[2]);
  }
  Matrix3 axes = Matrix3::Identity();
  if (const std::string* text = fields.Find({ "TransformMatrix", "Rotation", "Orientation" }))
  {
    const std::vector<double> matrix =
      ParseNumbers(*text, dimensions * dimensions, info.path, "TransformMatrix");
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      for (std::size_t world = 0; world < 3; ++world)
      {
        axes(world, axis) = matrix[axis * dimensions + world];
      }
    }
  }
  else if (const std::string* letters = fields.Find("AnatomicalOrientation"))
  {
    // ITK takes the identity then, and so every program built on it.
    if (*letters != "RAI" && letters->find('?') == std::string::npos)
    {
      info.warnings.push_back("'" + info.path + "': AnatomicalOrientation is " +
        letters->substr(0, 8) + " but there is no TransformMatrix; the axes are taken as LPS.");
    }
  }
  for (int axis = 0; axis < 3; ++axis)
  {
    if (!(spacing[axis] > 0.0))
    {
      FormatError(info.path, "ElementSpacing is not positive");
    }
  }
  // The matrix is checked before it is scaled: its columns must be unit vectors.
  axes =
    Orthonormalised(axes, info.path) * Vector3(spacing[0], spacing[1], spacing[2]).asDiagonal();
  SetAxes(header, size, axes);
}
}

VolumeHeader ReadMetaImageHeader(const std::string& path)
{
  VolumeHeader header;
  header.info.path = path;
  header.info.format = "MetaImage";
  HeaderFields fields{ path, {} };
  const std::size_t headerSize = ReadFields(fields);
  const int dimensions = fields.Dimensions("NDims");
  const int channels = fields.Integer("ElementNumberOfChannels", 1, 1);
  if (channels != 1)
  {
    FormatError(path, "image has " + std::to_string(channels) + " components; one is needed");
  }
  if (!IsTrue(fields, { "BinaryData" }, true))
  {
    FormatError(path, "BinaryData = False (voxels as text) is not supported");
  }
  header.type = TypeOf(fields.Text("ElementType"), path);
  header.bigEndian = IsTrue(fields, { "BinaryDataByteOrderMSB", "ElementByteOrderMSB" }, false);
  header.compressed = IsTrue(fields, { "CompressedData" }, false);
  header.slope = fields.Number("ElementToIntensityFunctionSlope", 1.0);
  header.intercept = fields.Number("ElementToIntensityFunctionOffset", 0.0);
  SetGeometry(header, fields, static_cast<std::size_t>(dimensions));

  const std::string& data = fields.Text("ElementDataFile");
  if (data == "LOCAL" || data == "Local" || data == "local")
  {
    header.dataFiles = { path };
    header.dataOffset = headerSize;
    return header;
  }
  if (data.empty() || data.compare(0, 4, "LIST") == 0 || data.find('%') != std::string::npos)
  {
    FormatError(path,
      "ElementDataFile = " + data.substr(0, 64) + " is not supported; one file or LOCAL is needed");
  }
  header.dataFiles = { PathBeside(path, data) };
  const int headerBytes = fields.Integer("HeaderSize", -1, 0);
  if (headerBytes < 0)
  {
    FormatError(path, "HeaderSize = -1 is not supported");
  }
  header.dataOffset = static_cast<std::uint64_t>(headerBytes);
  return header;
}
}
