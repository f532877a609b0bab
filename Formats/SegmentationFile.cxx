#include "SegmentationFile.h"

#include "NrrdText.h"
#include "PackedFile.h"
#include "TextWords.h"
#include "VolumeFile.h"
#include "VolumeHeaderParsers.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace coronary
{
namespace
{
// Single precision, in which voxels are read, holds all whole numbers up to here.
constexpr std::int64_t MaximumLabel = std::int64_t(1) << 24;

// In one line, whatever it is.
std::string Quoted(const std::string& text)
{
  std::string line = text.substr(0, 64);
  std::replace_if(
    line.begin(), line.end(), [](char c) { return c >= 0 && c < ' '; }, ' ');
  return "'" + line + "'";
}

std::vector<Segment> SegmentsOf(
  const std::map<std::string, std::string>& notes, const std::string& path)
{
  std::vector<Segment> segments;
  std::set<std::string> ids;
  for (;;)
  {
    const std::string number = std::to_string(segments.size());
    const std::string prefix = "Segment" + number + "_";
    const auto note = [&](const char* key) -> const std::string*
    {
      const auto found = notes.find(prefix + key);
      return found == notes.end() ? nullptr : &found->second;
    };
    const std::string* id = note("ID");
    if (id == nullptr)
    {
      return segments;
    }
    Segment segment;
    segment.id = *id;
    if (!ids.insert(segment.id).second)
    {
      FormatError(path, "two segments have the ID " + Quoted(segment.id));
    }
    const std::string* name = note("Name");
    segment.name = name != nullptr ? *name : segment.id;
    const auto whole = [&](const char* key, int otherwise)
    {
      const std::string* text = note(key);
      return text != nullptr ? ParseIntegers(*text, 1, 0, path, prefix + key).front() : otherwise;
    };
    segment.layer = whole("Layer", static_cast<int>(segments.size()));
    segment.value = whole("LabelValue", 1);
    if (segment.value > MaximumLabel)
    {
      FormatError(path, prefix + "LabelValue is above 16777216");
    }
    if (const std::string* extent = note("Extent"))
    {
      // Empty segments have -1 as their last index.
      const std::vector<int> values = ParseIntegers(*extent, 6, -1, path, prefix + "Extent");
      std::copy(values.begin(), values.end(), segment.extent.begin());
      segment.hasExtent = true;
    }
    segments.push_back(segment);
  }
}

// As Slicer has it: of a layer the box around the extents of its segments counts.
std::array<int, 6> BoxOfLayer(
  const std::vector<Segment>& segments, int layer, const ImageGrid& grid)
{
  std::array<int, 6> box{ 0, -1, 0, -1, 0, -1 };
  bool any = false;
  for (const Segment& segment : segments)
  {
    if (segment.layer != layer)
    {
      continue;
    }
    if (!segment.hasExtent)
    {
      return grid.extent;
    }
    const std::array<int, 6>& e = segment.extent;
    if (e[0] > e[1] || e[2] > e[3] || e[4] > e[5])
    {
      continue;
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
      box[2 * axis] = any ? std::min(box[2 * axis], e[2 * axis]) : e[2 * axis];
      box[2 * axis + 1] = any ? std::max(box[2 * axis + 1], e[2 * axis + 1]) : e[2 * axis + 1];
    }
    any = true;
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    box[2 * axis] = std::max(box[2 * axis], 0);
    box[2 * axis + 1] = std::min(box[2 * axis + 1], grid.extent[2 * axis + 1]);
  }
  return box;
}
}

std::vector<Segment> ParseSegments(const std::string& header, const std::string& name)
{
  return SegmentsOf(ParseNrrdNotes(header, name), name);
}

SegmentationFile::SegmentationFile(const std::string& path)
  : Name(path)
{
  const VolumeHeader header = ReadVolumeHeader(path);
  this->VoxelGrid = header.info.grid;
  this->Layers = header.info.phases;
  this->Notices = header.info.warnings;
  this->List = SegmentsOf(header.notes, path);
  for (std::size_t n = 0; n < this->List.size(); ++n)
  {
    if (this->List[n].layer >= this->Layers)
    {
      FormatError(path,
        "Segment" + std::to_string(n) + "_Layer is " + std::to_string(this->List[n].layer) +
          ", but there are " + std::to_string(this->Layers) + " layers");
    }
  }
  if (this->List.empty() && this->Layers > 1)
  {
    FormatError(path,
      "has " + std::to_string(this->Layers) +
        " volumes and no segments in its header: which is the mask is not known");
  }
}

std::vector<Segment> SegmentationFile::Choose(const std::vector<std::string>& wanted) const
{
  if (this->List.empty())
  {
    std::vector<Segment> values;
    for (const std::string& name : wanted)
    {
      const std::string prefix = "Segment_";
      Segment segment;
      const std::string text =
        name.compare(0, prefix.size(), prefix) == 0 ? name.substr(prefix.size()) : name;
      double value = 0.0;
      if (!ParseNumber(text, value) || value != std::rint(value) || value < 1.0 ||
        value > static_cast<double>(MaximumLabel))
      {
        FormatError(this->Name,
          "has no names of segments, so that " + Quoted(name) +
            " can not be found; give the value of its voxels");
      }
      segment.value = static_cast<std::int64_t>(value);
      values.push_back(segment);
    }
    return values;
  }
  if (wanted.empty())
  {
    return this->List;
  }
  std::vector<Segment> chosen;
  for (const std::string& name : wanted)
  {
    const std::size_t before = chosen.size();
    for (const Segment& segment : this->List)
    {
      if (segment.id == name || segment.name == name)
      {
        chosen.push_back(segment);
      }
    }
    if (chosen.size() == before)
    {
      std::string there;
      for (const Segment& segment : this->List)
      {
        there += (there.empty() ? "" : ", ") + Quoted(segment.name);
      }
      FormatError(
        this->Name, "has no segment " + Quoted(name) + "; there are " + there.substr(0, 400));
    }
  }
  return chosen;
}

SegmentationMask SegmentationFile::Mask(
  const std::vector<std::string>& wanted, const ProgressCallback& progress) const
{
  const std::vector<Segment> chosen = this->Choose(wanted);
  const std::unique_ptr<VolumeSource> source = OpenVolumeFile(this->Name);
  SegmentationMask mask;
  mask.grid = this->VoxelGrid;
  const std::array<int, 6>& extent = mask.grid.extent;
  const auto nx = static_cast<std::size_t>(extent[1]) + 1;
  const auto ny = static_cast<std::size_t>(extent[3]) + 1;
  mask.voxels.assign(nx * ny * (static_cast<std::size_t>(extent[5]) + 1), 0);
  std::vector<float> labels(mask.voxels.size());
  std::set<int> layers;
  for (const Segment& segment : chosen)
  {
    layers.insert(segment.layer);
  }
  if (this->List.empty())
  {
    layers.insert(0);
  }
  double done = 0.0;
  for (const int layer : layers)
  {
    source->Read(layer, extent, labels.data(),
      [&](double fraction)
      { return !progress || progress((done + fraction) / static_cast<double>(layers.size())); });
    done += 1.0;
    std::set<float> values;
    for (const Segment& segment : chosen)
    {
      if (segment.layer == layer)
      {
        values.insert(static_cast<float>(segment.value));
      }
    }
    const std::array<int, 6> box =
      this->List.empty() ? extent : BoxOfLayer(this->List, layer, mask.grid);
    for (int k = box[4]; k <= box[5]; ++k)
    {
      for (int j = box[2]; j <= box[3]; ++j)
      {
        const std::size_t row =
          (static_cast<std::size_t>(k) * ny + static_cast<std::size_t>(j)) * nx;
        for (int i = box[0]; i <= box[1]; ++i)
        {
          const std::size_t voxel = row + static_cast<std::size_t>(i);
          const float value = labels[voxel];
          if (value == 0.0F)
          {
            continue;
          }
          if (!(value == std::rint(value)))
          {
            FormatError(this->Name,
              "is no segmentation: its voxel (" + std::to_string(i) + ", " + std::to_string(j) +
                ", " + std::to_string(k) + ") is no whole number");
          }
          if (mask.voxels[voxel] == 0 && (values.empty() || values.count(value) > 0))
          {
            mask.voxels[voxel] = 1;
            ++mask.count;
          }
        }
      }
    }
  }
  if (mask.count == 0)
  {
    FormatError(this->Name,
      wanted.empty() ? std::string("all its voxels are background")
                     : "no voxel is of the segment " + Quoted(wanted.front()));
  }
  return mask;
}

void WriteSegmentation(
  const std::string& path, const SegmentationMask& mask, const SegmentLook& look)
{
  const std::array<int, 6>& e = mask.grid.extent;
  std::string sizes;
  std::string extent;
  std::size_t voxels = 1;
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    const int size = std::max(0, e[2 * axis + 1] - e[2 * axis] + 1);
    voxels *= static_cast<std::size_t>(size);
    sizes += " " + std::to_string(size);
    extent += (axis > 0 ? " 0 " : "0 ") + std::to_string(size - 1);
  }
  if (voxels == 0 || mask.voxels.size() != voxels ||
    (look.name + look.terminology).find_first_of("\n\r") != std::string::npos)
  {
    throw std::invalid_argument(
      "Cannot write '" + path + "': voxels, grid or name of the segment do not fit.");
  }
  std::string header = "NRRD0005\n# A segmentation, written by coronary-pipeline\n"
                       "type: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes:" +
    sizes + "\nspace directions:" + NrrdDirections(mask.grid) +
    "\nkinds: domain domain domain\nencoding: gzip\nspace origin: " + NrrdOrigin(mask.grid) +
    "\nSegment0_Color:=";
  AppendNumbers(header, look.color);
  header += "\nSegment0_ColorAutoGenerated:=0\nSegment0_Extent:=" + extent +
    "\nSegment0_ID:=Segment_1\nSegment0_LabelValue:=1\nSegment0_Layer:=0\nSegment0_Name:=" +
    look.name + "\nSegment0_NameAutoGenerated:=0\nSegment0_Tags:=";
  if (!look.terminology.empty())
  {
    header += "TerminologyEntry:Segmentation category and type - 3D Slicer General Anatomy list~"
              "SCT^123037004^Anatomical Structure~SCT^" +
      look.terminology + "~^^~Anatomic codes - DICOM master list~^^~^^|";
  }
  header += "\nSegmentation_ContainedRepresentationNames:=Binary labelmap|"
            "\nSegmentation_ConversionParameters:="
            "\nSegmentation_MasterRepresentation:=Binary labelmap"
            "\nSegmentation_ReferenceImageExtentOffset:=0 0 0\n\n";
  PackedFile output(path, header, Packing::Gzip);
  output.Add(mask.voxels.data(), mask.voxels.size());
  output.Finish();
  output.Commit();
}
}
