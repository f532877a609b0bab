#include "DicomFile.h"

#include "DicomStructure.h"

#include <gdcmAttribute.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace coronary
{
namespace
{
[[noreturn]] void Fail(const std::string& path, const std::string& what)
{
  throw std::runtime_error("'" + path + "': " + what + ".");
}

// GDCM writes to the console by itself; what it finds is reported by our exceptions.
void SilenceGdcm()
{
  static const bool once = []
  {
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
    return true;
  }();
  static_cast<void>(once);
}

std::string TextOf(const gdcm::DataSet& data, const gdcm::Tag& tag)
{
  if (!data.FindDataElement(tag))
  {
    return {};
  }
  const gdcm::ByteValue* value = data.GetDataElement(tag).GetByteValue();
  if (!value || !value->GetPointer())
  {
    return {};
  }
  std::string text(value->GetPointer(), value->GetLength());
  text.erase(std::find(text.begin(), text.end(), '\0'), text.end());
  const std::size_t first = text.find_first_not_of(' ');
  const std::size_t last = text.find_last_not_of(' ');
  return first == std::string::npos ? std::string() : text.substr(first, last - first + 1);
}

// A decimal string of several values, separated by backslashes; empty when one is no number.
std::vector<double> NumbersOf(const gdcm::DataSet& data, const gdcm::Tag& tag)
{
  const std::string text = TextOf(data, tag);
  std::vector<double> values;
  std::size_t position = 0;
  while (position <= text.size() && !text.empty())
  {
    const std::size_t end = std::min(text.find('\\', position), text.size());
    const std::optional<double> value = ParseDicomNumber(text.substr(position, end - position));
    if (!value)
    {
      return {};
    }
    values.push_back(*value);
    position = end + 1;
  }
  return values;
}

std::optional<double> NumberOf(const gdcm::DataSet& data, const gdcm::Tag& tag)
{
  const std::vector<double> values = NumbersOf(data, tag);
  return values.empty() ? std::nullopt : std::optional<double>(values.front());
}

// A value that is stored as binary.
template <std::uint16_t Group, std::uint16_t Element>
std::optional<double> BinaryOf(const gdcm::DataSet& data)
{
  using Attribute = gdcm::Attribute<Group, Element>;
  const gdcm::Tag tag(Group, Element);
  if (!data.FindDataElement(tag))
  {
    return std::nullopt;
  }
  const gdcm::ByteValue* value = data.GetDataElement(tag).GetByteValue();
  if (!value || value->GetLength() < sizeof(typename Attribute::ArrayType))
  {
    return std::nullopt;
  }
  Attribute attribute;
  attribute.SetFromDataElement(data.GetDataElement(tag));
  const auto number = static_cast<double>(attribute.GetValue());
  return std::isfinite(number) ? std::optional<double>(number) : std::nullopt;
}

using Sequence = gdcm::SmartPointer<gdcm::SequenceOfItems>;

Sequence SequenceOf(const gdcm::DataSet& data, const gdcm::Tag& tag)
{
  return data.FindDataElement(tag) ? data.GetDataElement(tag).GetValueAsSQ() : Sequence();
}

/// Looks attributes up in a frame's functional groups, then in the shared ones, then at the top.
class FrameData
{
public:
  FrameData(const gdcm::DataSet& top, const Sequence& frames, std::size_t frame)
    : Top(top)
  {
    if (frames && frames->GetNumberOfItems() > frame)
    {
      this->Own = &frames->GetItem(frame + 1).GetNestedDataSet();
    }
    this->SharedGroups = SequenceOf(top, gdcm::Tag(0x5200, 0x9229));
  }

  // The data set that holds `tag`: the first item of the group `macro`, or the top level.
  const gdcm::DataSet& Holder(const gdcm::Tag& macro, const gdcm::Tag& tag)
  {
    const gdcm::DataSet* shared = this->SharedGroups && this->SharedGroups->GetNumberOfItems() > 0
      ? &this->SharedGroups->GetItem(1).GetNestedDataSet()
      : nullptr;
    for (const gdcm::DataSet* groups : { this->Own, shared })
    {
      if (!groups)
      {
        continue;
      }
      this->Found = SequenceOf(*groups, macro);
      if (this->Found && this->Found->GetNumberOfItems() > 0)
      {
        const gdcm::DataSet& item = this->Found->GetItem(1).GetNestedDataSet();
        if (item.FindDataElement(tag))
        {
          return item;
        }
      }
    }
    return this->Top;
  }

private:
  const gdcm::DataSet& Top;
  const gdcm::DataSet* Own = nullptr;
  Sequence SharedGroups;
  Sequence Found; ///< keeps the item alive that Holder() returned
};

std::optional<double> Positive(const std::optional<double>& value)
{
  return value && *value > 0.0 ? value : std::nullopt;
}

void ReadTimes(FrameData& data, DicomFrame& frame)
{
  const gdcm::Tag synchronization(0x0018, 0x9118);
  const gdcm::Tag triggerTime(0x0018, 0x1060);
  const gdcm::Tag triggerDelay(0x0020, 0x9153);
  frame.triggerTime = NumberOf(data.Holder(synchronization, triggerTime), triggerTime);
  if (!frame.triggerTime)
  {
    frame.triggerTime = BinaryOf<0x0020, 0x9153>(data.Holder(synchronization, triggerDelay));
  }
  frame.nominalPercentage =
    BinaryOf<0x0020, 0x9241>(data.Holder(synchronization, gdcm::Tag(0x0020, 0x9241)));
  const gdcm::Tag interval(0x0018, 0x1062);
  frame.rrInterval = Positive(NumberOf(data.Holder(synchronization, interval), interval));
  if (!frame.rrInterval)
  {
    frame.rrInterval =
      Positive(BinaryOf<0x0020, 0x9251>(data.Holder(synchronization, gdcm::Tag(0x0020, 0x9251))));
  }
  if (!frame.rrInterval)
  {
    const gdcm::Tag heartRate(0x0018, 0x1088);
    const std::optional<double> rate =
      Positive(NumberOf(data.Holder(synchronization, heartRate), heartRate));
    if (rate)
    {
      frame.rrInterval = 60000.0 / *rate;
    }
  }
}

// False when the frame has no position: it is no slice of a volume.
bool ReadFrame(FrameData& data, const std::string& path, DicomFrame& frame)
{
  const gdcm::Tag position(0x0020, 0x0032);
  const gdcm::Tag orientation(0x0020, 0x0037);
  const gdcm::Tag spacing(0x0028, 0x0030);
  const gdcm::DataSet& placed = data.Holder(gdcm::Tag(0x0020, 0x9113), position);
  if (!placed.FindDataElement(position))
  {
    return false;
  }
  const std::vector<double> p = NumbersOf(placed, position);
  const std::vector<double> o =
    NumbersOf(data.Holder(gdcm::Tag(0x0020, 0x9116), orientation), orientation);
  const std::vector<double> s = NumbersOf(data.Holder(gdcm::Tag(0x0028, 0x9110), spacing), spacing);
  if (p.size() != 3)
  {
    Fail(path, "ImagePositionPatient is not three finite numbers");
  }
  if (o.size() != 6)
  {
    Fail(path, "ImageOrientationPatient is not six finite numbers");
  }
  if (s.size() != 2 || !(s[0] > 0.0) || !(s[1] > 0.0))
  {
    Fail(path, "PixelSpacing is not two positive numbers");
  }
  frame.position = Vector3(p[0], p[1], p[2]);
  frame.rowAxis = Vector3(o[0], o[1], o[2]);
  frame.columnAxis = Vector3(o[3], o[4], o[5]);
  if (std::abs(frame.rowAxis.norm() - 1.0) > 1e-3 ||
    std::abs(frame.columnAxis.norm() - 1.0) > 1e-3 ||
    std::abs(frame.rowAxis.dot(frame.columnAxis)) > 1e-3)
  {
    Fail(path, "the axes in ImageOrientationPatient are not perpendicular unit vectors");
  }
  frame.rowSpacing = s[0];
  frame.columnSpacing = s[1];

  const gdcm::Tag transformation(0x0028, 0x9145);
  const gdcm::Tag slope(0x0028, 0x1053);
  const gdcm::Tag intercept(0x0028, 0x1052);
  frame.slope = NumberOf(data.Holder(transformation, slope), slope).value_or(1.0);
  frame.intercept = NumberOf(data.Holder(transformation, intercept), intercept).value_or(0.0);
  ReadTimes(data, frame);
  return true;
}

std::string SkipReason(const gdcm::File& file)
{
  const gdcm::DataSet& data = file.GetDataSet();
  const std::string kind = TextOf(data, gdcm::Tag(0x0008, 0x0016));
  const std::string imageType = TextOf(data, gdcm::Tag(0x0008, 0x0008));
  if (TextOf(file.GetHeader(), gdcm::Tag(0x0002, 0x0002)) == "1.2.840.10008.1.3.10")
  {
    return "DICOMDIR";
  }
  if (!data.FindDataElement(gdcm::Tag(0x0028, 0x0010)))
  {
    return "DICOM files without an image";
  }
  if (kind.compare(0, 25, "1.2.840.10008.5.1.4.1.1.7") == 0)
  {
    return "secondary captures";
  }
  if (imageType.find("LOCALIZER") != std::string::npos)
  {
    return "localizers";
  }
  return {};
}

// What decoded voxels take is believed only as far as the file can hold it.
void CheckPixelSize(const DicomFile& file)
{
  // Encoders of constant images reach some hundreds.
  constexpr std::uint64_t largestRatio = 10000;
  const std::uint64_t expected = std::uint64_t(file.rows) * std::uint64_t(file.columns) *
    std::uint64_t(file.frames.size()) * std::uint64_t(file.bitsAllocated) / 8;
  if (file.pixelBytes < (file.encapsulated ? expected / largestRatio : expected))
  {
    throw std::runtime_error("'" + file.path + "' is truncated: expected " +
      std::to_string(expected) + " bytes of voxels, got " + std::to_string(file.pixelBytes) + ".");
  }
}

void ReadImageHeader(const gdcm::File& header, DicomFile& file)
{
  const gdcm::DataSet& data = header.GetDataSet();
  file.seriesUid = TextOf(data, gdcm::Tag(0x0020, 0x000e));
  file.instanceUid = TextOf(data, gdcm::Tag(0x0008, 0x0018));
  file.seriesDescription = TextOf(data, gdcm::Tag(0x0008, 0x103e));
  file.modality = TextOf(data, gdcm::Tag(0x0008, 0x0060));
  file.frameOfReferenceUid = TextOf(data, gdcm::Tag(0x0020, 0x0052));
  file.rows = static_cast<int>(BinaryOf<0x0028, 0x0010>(data).value_or(0.0));
  file.columns = static_cast<int>(BinaryOf<0x0028, 0x0011>(data).value_or(0.0));
  file.bitsAllocated = static_cast<int>(BinaryOf<0x0028, 0x0100>(data).value_or(0.0));
  if (file.rows < 1 || file.columns < 1)
  {
    Fail(file.path, "the image has no rows or no columns");
  }
  if (file.bitsAllocated != 8 && file.bitsAllocated != 16 && file.bitsAllocated != 32)
  {
    Fail(file.path, std::to_string(file.bitsAllocated) + " bits a voxel are not supported");
  }
  file.bitsStored = static_cast<int>(BinaryOf<0x0028, 0x0101>(data).value_or(file.bitsAllocated));
  file.isSigned = BinaryOf<0x0028, 0x0103>(data).value_or(0.0) == 1.0;
  const double samples = BinaryOf<0x0028, 0x0002>(data).value_or(1.0);
  if (samples != 1.0)
  {
    Fail(file.path,
      "image has " + std::to_string(static_cast<int>(samples)) + " components; one is needed");
  }
  file.sliceSpacing = NumberOf(data, gdcm::Tag(0x0018, 0x0088))
                        .value_or(NumberOf(data, gdcm::Tag(0x0018, 0x0050)).value_or(0.0));
  file.acquisitionOrder = { NumberOf(data, gdcm::Tag(0x0020, 0x0100)).value_or(0.0),
    NumberOf(data, gdcm::Tag(0x0020, 0x0012)).value_or(0.0),
    NumberOf(data, gdcm::Tag(0x0008, 0x0032)).value_or(0.0),
    NumberOf(data, gdcm::Tag(0x0020, 0x0013)).value_or(0.0) };

  const double frames = NumberOf(data, gdcm::Tag(0x0028, 0x0008)).value_or(1.0);
  const Sequence groups = SequenceOf(data, gdcm::Tag(0x5200, 0x9230));
  // One item a frame, so the number of frames is bounded by the size of the file.
  if (frames > 1.0 && (!groups || static_cast<double>(groups->GetNumberOfItems()) != frames))
  {
    file.skipReason = "multi-frame images without frame positions";
    return;
  }
  for (std::size_t f = 0; f < static_cast<std::size_t>(std::max(1.0, frames)); ++f)
  {
    FrameData frameData(data, groups, f);
    DicomFrame frame;
    if (!ReadFrame(frameData, file.path, frame))
    {
      file.skipReason = "images without a position";
      return;
    }
    file.frames.push_back(frame);
  }
}
}

std::optional<double> ParseDicomNumber(const std::string& text)
{
  const std::size_t first = text.find_first_not_of(" +");
  if (first == std::string::npos)
  {
    return std::nullopt;
  }
  const std::size_t last = text.find_last_not_of(' ');
  double value = 0.0;
  const char* end = text.data() + last + 1;
  const std::from_chars_result result = std::from_chars(text.data() + first, end, value);
  return result.ec == std::errc() && result.ptr == end && std::isfinite(value)
    ? std::optional<double>(value)
    : std::nullopt;
}

DicomFile ReadDicomHeader(const std::string& path)
{
  SilenceGdcm();
  DicomFile file;
  file.path = path;
  DicomStructure structure = ReadDicomStructure(path);
  if (!structure.isDicom)
  {
    file.skipReason = "files that are not DICOM";
    return file;
  }
  std::istringstream stream(std::move(structure.header));
  gdcm::Reader reader;
  reader.SetStream(stream);
  bool good = false;
  try
  {
    good = reader.Read();
  }
  catch (const std::exception&)
  {
    good = false;
  }
  if (!good)
  {
    Fail(path, "is a DICOM file, but damaged");
  }
  file.skipReason = SkipReason(reader.GetFile());
  if (!file.skipReason.empty())
  {
    return file;
  }
  file.encapsulated = structure.encapsulated;
  file.bigEndian = structure.bigEndian;
  file.pixelOffset = structure.pixelOffset;
  file.pixelBytes = structure.pixelBytes;
  ReadImageHeader(reader.GetFile(), file);
  if (file.skipReason.empty())
  {
    CheckPixelSize(file);
  }
  return file;
}

struct DicomPixelReader::Internals
{
  std::string Path; ///< the file whose decoded frames are in Values
  std::vector<char> Values;

  void Decode(const DicomFile& file);
};

namespace
{
VoxelType TypeOf(const DicomFile& file)
{
  switch (file.bitsAllocated)
  {
    case 8:
      return file.isSigned ? VoxelType::Int8 : VoxelType::UInt8;
    case 16:
      return file.isSigned ? VoxelType::Int16 : VoxelType::UInt16;
    default:
      return file.isSigned ? VoxelType::Int32 : VoxelType::UInt32;
  }
}

std::size_t FrameBytes(const DicomFile& file)
{
  return std::size_t(file.rows) * std::size_t(file.columns) * VoxelBytes(TypeOf(file));
}

// Bits above those stored may hold an overlay, and the sign is not always extended into them.
void ClearUnusedBits(const DicomFile& file, std::vector<unsigned char>& bytes)
{
  if (file.bitsAllocated != 16 || file.bitsStored >= 16 || file.bitsStored < 1)
  {
    return;
  }
  const unsigned mask = (1u << file.bitsStored) - 1u;
  const unsigned sign = file.isSigned ? 1u << (file.bitsStored - 1) : 0u;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2)
  {
    std::uint16_t stored = 0;
    std::memcpy(&stored, bytes.data() + i, 2);
    const unsigned value = stored & mask;
    stored = static_cast<std::uint16_t>((value ^ sign) - sign);
    std::memcpy(bytes.data() + i, &stored, 2);
  }
}
}

void DicomPixelReader::Internals::Decode(const DicomFile& file)
{
  this->Path.clear();
  bool good = false;
  const std::size_t expected = FrameBytes(file) * file.frames.size();
  try
  {
    gdcm::ImageReader reader;
    reader.SetFileName(file.path.c_str());
    good = reader.Read();
    const gdcm::Image& image = reader.GetImage();
    if (good && image.GetBufferLength() != expected)
    {
      Fail(file.path, "its pixels are not of the size that its header says");
    }
    this->Values.resize(expected);
    good = good && image.GetBuffer(this->Values.data());
  }
  catch (const gdcm::Exception&)
  {
    good = false;
  }
  if (!good)
  {
    Fail(file.path, "its pixels cannot be decoded; the file is truncated or damaged");
  }
  this->Path = file.path;
}

DicomPixelReader::DicomPixelReader()
  : Impl(std::make_unique<Internals>())
{
}

DicomPixelReader::~DicomPixelReader() = default;

VoxelType DicomPixelReader::Read(
  const DicomFile& file, int frame, std::vector<unsigned char>& bytes)
{
  SilenceGdcm();
  const std::size_t size = FrameBytes(file);
  const std::size_t first = size * static_cast<std::size_t>(frame);
  bytes.resize(size);
  if (file.encapsulated)
  {
    if (this->Impl->Path != file.path)
    {
      this->Impl->Decode(file);
    }
    std::memcpy(bytes.data(), this->Impl->Values.data() + first, size);
  }
  else
  {
    ByteStream stream(file.path, file.pixelOffset, false);
    stream.Read(first, bytes.data(), size, size * file.frames.size());
    const std::size_t valueBytes = VoxelBytes(TypeOf(file));
    if (file.bigEndian != HostIsBigEndian() && valueBytes > 1)
    {
      SwapBytes(bytes, valueBytes);
    }
  }
  ClearUnusedBits(file, bytes);
  return TypeOf(file);
}

void DicomPixelReader::Close()
{
  this->Impl = std::make_unique<Internals>();
}
}
