#include "DicomFile.h"

#include "ByteOrder.h"
#include "DicomStructure.h"
#include "TextWords.h"

#include <gdcmImageReader.h>
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
const char* const RunLengthSyntax = "1.2.840.10008.1.2.5";

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

/// The values of a data set, by tag (group << 16 | element).
class Reader
{
public:
  Reader(const DicomStructure& structure, const DicomDataSet& data)
    : Structure(&structure)
    , Data(&data)
  {
  }

  bool Has(std::uint32_t tag) const { return this->Data->elements.count(tag) > 0; }

  std::string Text(std::uint32_t tag) const
  {
    std::string text = this->Raw(tag);
    text.erase(std::find(text.begin(), text.end(), '\0'), text.end());
    const std::size_t first = text.find_first_not_of(' ');
    const std::size_t last = text.find_last_not_of(' ');
    return first == std::string::npos ? std::string() : text.substr(first, last - first + 1);
  }

  // A decimal string of several values, separated by backslashes; empty when one is no number.
  std::vector<double> Numbers(std::uint32_t tag) const
  {
    const std::string text = this->Text(tag);
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

  std::optional<double> Number(std::uint32_t tag) const
  {
    const std::vector<double> values = this->Numbers(tag);
    return values.empty() ? std::nullopt : std::optional<double>(values.front());
  }

  // A value that is stored as binary.
  template <typename T>
  std::optional<double> Binary(std::uint32_t tag) const
  {
    const std::string raw = this->Raw(tag);
    if (raw.size() < sizeof(T))
    {
      return std::nullopt;
    }
    const auto number = static_cast<double>(NumberAt<T>(raw.data(), this->Structure->bigEndian));
    return std::isfinite(number) ? std::optional<double>(number) : std::nullopt;
  }

  const std::vector<DicomDataSet>& Items(std::uint32_t tag) const
  {
    static const std::vector<DicomDataSet> none;
    const auto found = this->Data->elements.find(tag);
    return found == this->Data->elements.end() ? none : found->second.items;
  }

private:
  std::string Raw(std::uint32_t tag) const
  {
    const auto found = this->Data->elements.find(tag);
    return found == this->Data->elements.end()
      ? std::string()
      : this->Structure->header.substr(
          static_cast<std::size_t>(found->second.offset), found->second.length);
  }

  const DicomStructure* Structure;
  const DicomDataSet* Data;
};

/// Looks attributes up in a frame's functional groups, then in the shared ones, then at the top.
class FrameData
{
public:
  FrameData(const DicomStructure& structure, std::size_t frame)
    : Structure(structure)
  {
    const Reader top(structure, structure.data);
    const std::vector<DicomDataSet>& own = top.Items(0x52009230u);
    const std::vector<DicomDataSet>& shared = top.Items(0x52009229u);
    this->Groups[0] = frame < own.size() ? &own[frame] : nullptr;
    this->Groups[1] = shared.empty() ? nullptr : &shared.front();
  }

  // The data set that holds `tag`: the first item of the group `macro`, or the top level.
  Reader Holder(std::uint32_t macro, std::uint32_t tag) const
  {
    for (const DicomDataSet* groups : this->Groups)
    {
      if (!groups)
      {
        continue;
      }
      const std::vector<DicomDataSet>& items = Reader(this->Structure, *groups).Items(macro);
      if (!items.empty() && Reader(this->Structure, items.front()).Has(tag))
      {
        return { this->Structure, items.front() };
      }
    }
    return { this->Structure, this->Structure.data };
  }

private:
  const DicomStructure& Structure;
  std::array<const DicomDataSet*, 2> Groups{};
};

std::optional<double> Positive(const std::optional<double>& value)
{
  return value && *value > 0.0 ? value : std::nullopt;
}

void ReadTimes(const FrameData& data, DicomFrame& frame)
{
  constexpr std::uint32_t synchronization = 0x00189118u;
  const auto holder = [&data](std::uint32_t tag) { return data.Holder(synchronization, tag); };
  frame.triggerTime = holder(0x00181060u).Number(0x00181060u);
  if (!frame.triggerTime)
  {
    frame.triggerTime = holder(0x00209153u).Binary<double>(0x00209153u);
  }
  frame.nominalPercentage = holder(0x00209241u).Binary<float>(0x00209241u);
  frame.rrInterval = Positive(holder(0x00181062u).Number(0x00181062u));
  if (!frame.rrInterval)
  {
    frame.rrInterval = Positive(holder(0x00209251u).Binary<double>(0x00209251u));
  }
  const std::optional<double> rate = Positive(holder(0x00181088u).Number(0x00181088u));
  if (!frame.rrInterval && rate)
  {
    frame.rrInterval = 60000.0 / *rate;
  }
}

// False when the frame has no position: it is no slice of a volume.
bool ReadFrame(const FrameData& data, const std::string& path, DicomFrame& frame)
{
  constexpr std::uint32_t position = 0x00200032u;
  constexpr std::uint32_t orientation = 0x00200037u;
  constexpr std::uint32_t spacing = 0x00280030u;
  const Reader placed = data.Holder(0x00209113u, position);
  if (!placed.Has(position))
  {
    return false;
  }
  const std::vector<double> p = placed.Numbers(position);
  const std::vector<double> o = data.Holder(0x00209116u, orientation).Numbers(orientation);
  const std::vector<double> s = data.Holder(0x00289110u, spacing).Numbers(spacing);
  if (p.size() != 3)
  {
    FormatError(path, "ImagePositionPatient is not three finite numbers");
  }
  if (o.size() != 6)
  {
    FormatError(path, "ImageOrientationPatient is not six finite numbers");
  }
  if (s.size() != 2 || !(s[0] > 0.0) || !(s[1] > 0.0))
  {
    FormatError(path, "PixelSpacing is not two positive numbers");
  }
  frame.position = Vector3(p[0], p[1], p[2]);
  frame.rowAxis = Vector3(o[0], o[1], o[2]);
  frame.columnAxis = Vector3(o[3], o[4], o[5]);
  if (std::abs(frame.rowAxis.norm() - 1.0) > 1e-3 ||
    std::abs(frame.columnAxis.norm() - 1.0) > 1e-3 ||
    std::abs(frame.rowAxis.dot(frame.columnAxis)) > 1e-3)
  {
    FormatError(path, "the axes in ImageOrientationPatient are not perpendicular unit vectors");
  }
  frame.rowSpacing = s[0];
  frame.columnSpacing = s[1];

  constexpr std::uint32_t slope = 0x00281053u;
  constexpr std::uint32_t intercept = 0x00281052u;
  constexpr std::uint32_t transformation = 0x00289145u;
  frame.slope = data.Holder(transformation, slope).Number(slope).value_or(1.0);
  frame.intercept = data.Holder(transformation, intercept).Number(intercept).value_or(0.0);
  ReadTimes(data, frame);
  return true;
}

std::string SkipReason(const DicomStructure& structure)
{
  const Reader data(structure, structure.data);
  if (structure.mediaStorage == "1.2.840.10008.1.3.10")
  {
    return "DICOMDIR";
  }
  if (!data.Has(0x00280010u))
  {
    return "DICOM files without an image";
  }
  if (data.Text(0x00080016u).compare(0, 25, "1.2.840.10008.5.1.4.1.1.7") == 0)
  {
    return "secondary captures";
  }
  if (data.Text(0x00080008u).find("LOCALIZER") != std::string::npos)
  {
    return "localizers";
  }
  return {};
}

// What decoded voxels take is believed only as far as the file can hold it.
void CheckPixelSize(const DicomFile& file)
{
  // Encoders of constant images reach some hundreds.
  constexpr std::uint64_t maximumRatio = 10000;
  const std::uint64_t expected = std::uint64_t(file.rows) * std::uint64_t(file.columns) *
    std::uint64_t(file.frames.size()) * std::uint64_t(file.bitsAllocated) / 8;
  if (file.pixelBytes < (file.encapsulated ? expected / maximumRatio : expected))
  {
    throw std::runtime_error("'" + file.path + "' is truncated: expected " +
      std::to_string(expected) + " bytes of voxels, got " + std::to_string(file.pixelBytes) + ".");
  }
}

void ReadImageHeader(const DicomStructure& structure, DicomFile& file)
{
  const Reader data(structure, structure.data);
  const auto integer = [&data](std::uint32_t tag, int otherwise)
  { return static_cast<int>(data.Binary<std::uint16_t>(tag).value_or(otherwise)); };
  file.seriesUid = data.Text(0x0020000eu);
  file.instanceUid = data.Text(0x00080018u);
  file.seriesDescription = data.Text(0x0008103eu);
  file.modality = data.Text(0x00080060u);
  file.frameOfReferenceUid = data.Text(0x00200052u);
  file.transferSyntax = structure.transferSyntax;
  file.encapsulated = structure.encapsulated;
  file.bigEndian = structure.bigEndian;
  file.pixelOffset = structure.pixelOffset;
  file.pixelBytes = structure.pixelBytes;
  file.rows = integer(0x00280010u, 0);
  file.columns = integer(0x00280011u, 0);
  file.bitsAllocated = integer(0x00280100u, 0);
  file.bitsStored = integer(0x00280101u, file.bitsAllocated);
  file.isSigned = integer(0x00280103u, 0) == 1;
  if (file.rows < 1 || file.columns < 1)
  {
    FormatError(file.path, "the image has no rows or no columns");
  }
  if (file.bitsAllocated != 8 && file.bitsAllocated != 16 && file.bitsAllocated != 32)
  {
    FormatError(file.path, std::to_string(file.bitsAllocated) + " bits a voxel are not supported");
  }
  if (file.bitsStored < 1 || file.bitsStored > file.bitsAllocated)
  {
    FormatError(file.path, "BitsStored is out of range");
  }
  const int samples = integer(0x00280002u, 1);
  if (samples != 1)
  {
    FormatError(file.path, "image has " + std::to_string(samples) + " components; one is needed");
  }
  file.sliceSpacing = data.Number(0x00180088u).value_or(data.Number(0x00180050u).value_or(0.0));
  file.acquisitionOrder = { data.Number(0x00200100u).value_or(0.0),
    data.Number(0x00200012u).value_or(0.0), data.Number(0x00080032u).value_or(0.0),
    data.Number(0x00200013u).value_or(0.0) };

  const double frames = data.Number(0x00280008u).value_or(1.0);
  // One item a frame, so the number of frames is bounded by the size of the file.
  if (frames > 1.0 && static_cast<double>(data.Items(0x52009230u).size()) != frames)
  {
    file.skipReason = "multi-frame images without frame positions";
    return;
  }
  for (std::size_t f = 0; f < static_cast<std::size_t>(std::max(1.0, frames)); ++f)
  {
    const FrameData frameData(structure, f);
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
  double value = 0.0;
  return ParseNumber(Trimmed(text), value) && std::isfinite(value) ? std::optional<double>(value)
                                                                   : std::nullopt;
}

DicomFile ReadDicomHeader(const std::string& path)
{
  DicomFile file;
  file.path = path;
  const DicomStructure structure = ReadDicomStructure(path);
  file.skipReason = structure.isDicom ? SkipReason(structure) : "files that are not DICOM";
  if (file.skipReason.empty())
  {
    ReadImageHeader(structure, file);
  }
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

namespace
{
/// Writes the elements of a DICOM file, explicit little endian.
class Encoder
{
public:
  std::string Bytes;

  void Short(std::size_t value)
  {
    AppendLittleEndian(this->Bytes, static_cast<std::uint16_t>(value));
  }

  void Long(std::size_t value)
  {
    AppendLittleEndian(this->Bytes, static_cast<std::uint32_t>(value));
  }

  void Tag(std::uint32_t tag)
  {
    this->Short(tag >> 16);
    this->Short(tag & 0xffffu);
  }

  void Short(std::uint32_t tag, int value)
  {
    this->Tag(tag);
    this->Bytes += "US";
    this->Short(2);
    this->Short(static_cast<std::size_t>(value));
  }

  void Text(std::uint32_t tag, const char* representation, std::string value)
  {
    if (value.size() % 2 == 1)
    {
      value += representation == std::string("UI") ? '\0' : ' ';
    }
    this->Tag(tag);
    this->Bytes += representation;
    this->Short(value.size());
    this->Bytes += value;
  }
};

struct Fragment
{
  std::uint64_t offset = 0; ///< from the beginning of the pixels
  std::uint64_t size = 0;
};

// The fragments of compressed pixels, every length checked; the first is a table of offsets.
std::vector<Fragment> ListFragments(const DicomFile& file, ByteStream& stream)
{
  constexpr std::uint32_t item = 0xe000fffeu;
  constexpr std::uint32_t end = 0xe0ddfffeu;
  std::vector<Fragment> fragments;
  const auto number = [&](std::uint64_t position)
  {
    std::array<unsigned char, 4> bytes{};
    stream.Read(position, bytes.data(), bytes.size(), position + bytes.size());
    return NumberAt<std::uint32_t>(bytes.data(), false);
  };
  std::uint64_t position = 0;
  for (;;)
  {
    const std::uint32_t tag = number(position);
    const std::uint64_t length = number(position + 4);
    position += 8;
    if (tag == end)
    {
      return fragments;
    }
    if (tag != item || length > file.pixelBytes || position + length > file.pixelBytes)
    {
      FormatError(file.path, "its compressed pixels are truncated or damaged");
    }
    fragments.push_back({ position, length });
    position += length;
  }
}

/// What the header of a JPEG, JPEG-LS or JPEG 2000 stream says.
struct CodestreamSize
{
  unsigned rows = 0;
  unsigned columns = 0;
  unsigned components = 0;
  unsigned bits = 0;
};

// All zero when there is no such header in `bytes`.
CodestreamSize ReadCodestreamSize(const std::string& bytes)
{
  const auto number = [&bytes](std::size_t at, std::size_t count)
  {
    unsigned value = 0;
    for (std::size_t b = 0; b < count && at + b < bytes.size(); ++b)
    {
      value = value << 8 | static_cast<unsigned char>(bytes[at + b]);
    }
    return value;
  };
  // JPEG 2000: the size comes first.
  if (number(0, 4) == 0xff4fff51u)
  {
    return { number(12, 4) - number(20, 4), number(8, 4) - number(16, 4), number(40, 2),
      (number(42, 1) & 127u) + 1 };
  }
  for (std::size_t at = 2; at + 10 < bytes.size() && number(at, 1) == 0xff;)
  {
    const unsigned marker = number(at + 1, 1);
    const bool frame = marker == 0xf7 ||
      (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc);
    if (frame)
    {
      return { number(at + 5, 2), number(at + 7, 2), number(at + 9, 1), number(at + 4, 1) };
    }
    at += 2 + number(at + 2, 2);
  }
  return {};
}

// GDCM's decoders crash when a compressed frame is of another kind than the header of the file says.
void CheckCodestreams(
  const DicomFile& file, const std::string& bytes, const std::vector<Fragment>& fragments)
{
  std::size_t begins = 0;
  for (const Fragment& fragment : fragments)
  {
    const std::string part = bytes.substr(
      static_cast<std::size_t>(fragment.offset), static_cast<std::size_t>(fragment.size));
    // A frame may go on in further fragments, which have no header.
    if (part.compare(0, 3, "\xff\xd8\xff") != 0 && part.compare(0, 4, "\xff\x4f\xff\x51") != 0)
    {
      continue;
    }
    ++begins;
    const CodestreamSize size = ReadCodestreamSize(part);
    if (size.rows != static_cast<unsigned>(file.rows) ||
      size.columns != static_cast<unsigned>(file.columns) || size.components != 1 ||
      size.bits < 2 || size.bits > static_cast<unsigned>(file.bitsAllocated))
    {
      FormatError(file.path, "its compressed pixels do not agree with its header");
    }
  }
  if (begins != file.frames.size())
  {
    FormatError(file.path, "its compressed pixels are damaged, or of a kind that is not supported");
  }
}

// The fragments as they are in the file, with their delimiter.
std::string ReadFragments(const DicomFile& file)
{
  ByteStream stream(file.path, file.pixelOffset, false);
  const std::vector<Fragment> fragments = ListFragments(file, stream);
  const std::uint64_t size =
    fragments.empty() ? 8 : fragments.back().offset + fragments.back().size + 8;
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.Read(0, bytes.data(), bytes.size(), size);
  CheckCodestreams(file, bytes, fragments);
  return bytes;
}

// One segment of run-length encoding (PS3.5 annex G) into every `stride`-th byte; false when it ends
// early.
bool DecodeSegment(const unsigned char* in, const unsigned char* end, unsigned char* out,
  std::size_t count, std::size_t stride)
{
  std::size_t done = 0;
  while (done < count && in < end)
  {
    const unsigned code = *in++;
    if (code == 128)
    {
      continue;
    }
    const std::size_t run = std::min<std::size_t>(code < 128 ? code + 1 : 257 - code, count - done);
    const bool literal = code < 128;
    if (static_cast<std::size_t>(end - in) < (literal ? run : 1))
    {
      return false;
    }
    for (std::size_t i = 0; i < run; ++i)
    {
      out[(done + i) * stride] = literal ? in[i] : in[0];
    }
    in += literal ? run : 1;
    done += run;
  }
  return done == count;
}

// GDCM's decoder of run lengths aborts the program when the data is damaged.
void DecodeRunLength(const DicomFile& file, std::size_t frame, std::vector<unsigned char>& bytes)
{
  ByteStream stream(file.path, file.pixelOffset, false);
  const std::vector<Fragment> fragments = ListFragments(file, stream);
  const std::size_t valueBytes = VoxelBytes(TypeOf(file));
  const std::size_t count = bytes.size() / valueBytes;
  const std::string damaged = "its run-length encoded pixels are truncated or damaged";
  if (fragments.size() != file.frames.size() + 1 || fragments[frame + 1].size < 64)
  {
    FormatError(file.path, damaged);
  }
  std::vector<unsigned char> in(static_cast<std::size_t>(fragments[frame + 1].size));
  stream.Read(fragments[frame + 1].offset, in.data(), in.size(), in.size());
  const auto number = [&in](std::size_t index) -> std::size_t
  { return NumberAt<std::uint32_t>(in.data() + 4 * index, false); };
  if (number(0) != valueBytes)
  {
    FormatError(file.path, damaged);
  }
  // The segments hold the bytes of all values, the most significant first.
  for (std::size_t segment = 0; segment < valueBytes; ++segment)
  {
    const std::size_t first = number(segment + 1);
    const std::size_t last = segment + 1 < valueBytes ? number(segment + 2) : in.size();
    const std::size_t byte = HostIsBigEndian() ? segment : valueBytes - 1 - segment;
    if (first < 64 || first > last || last > in.size() ||
      !DecodeSegment(in.data() + first, in.data() + last, bytes.data() + byte, count, valueBytes))
    {
      FormatError(file.path, damaged);
    }
  }
}

// A file that has nothing but what decoding needs. GDCM aborts the program for some damaged headers:
// so it never sees that of the file.
std::string CleanFile(const DicomFile& file)
{
  const bool single = file.frames.size() == 1;
  const std::string kind = single ? "1.2.840.10008.5.1.4.1.1.7" : "1.2.840.10008.5.1.4.1.1.7.3";
  Encoder meta;
  meta.Text(0x00020002u, "UI", kind);
  meta.Text(0x00020003u, "UI", "1.2.3");
  meta.Text(0x00020010u, "UI", file.transferSyntax);
  Encoder all;
  all.Bytes = std::string(128, '\0') + "DICM";
  all.Tag(0x00020000u);
  all.Bytes += "UL";
  all.Short(4);
  all.Long(meta.Bytes.size());
  all.Bytes += meta.Bytes;
  all.Text(0x00080016u, "UI", kind);
  all.Text(0x00080018u, "UI", "1.2.3");
  all.Short(0x00280002u, 1);
  all.Text(0x00280004u, "CS", "MONOCHROME2");
  if (!single)
  {
    all.Text(0x00280008u, "IS", std::to_string(file.frames.size()));
  }
  all.Short(0x00280010u, file.rows);
  all.Short(0x00280011u, file.columns);
  all.Short(0x00280100u, file.bitsAllocated);
  all.Short(0x00280101u, file.bitsStored);
  all.Short(0x00280102u, file.bitsStored - 1);
  all.Short(0x00280103u, file.isSigned ? 1 : 0);
  all.Tag(0x7fe00010u);
  all.Bytes += std::string("OB\0\0", 4);
  all.Long(0xffffffffu);
  all.Bytes += ReadFragments(file);
  return all.Bytes;
}
}

void DicomPixelReader::Internals::Decode(const DicomFile& file)
{
  SilenceGdcm();
  this->Path.clear();
  const gdcm::TransferSyntax::TSType syntax =
    gdcm::TransferSyntax::GetTSType(file.transferSyntax.c_str());
  if (syntax == gdcm::TransferSyntax::TS_END || !gdcm::TransferSyntax(syntax).IsEncapsulated())
  {
    FormatError(file.path, "its transfer syntax '" + file.transferSyntax + "' is not supported");
  }
  std::istringstream stream(CleanFile(file));
  bool good = false;
  const std::size_t expected = FrameBytes(file) * file.frames.size();
  try
  {
    gdcm::ImageReader reader;
    reader.SetStream(stream);
    good = reader.Read();
    const gdcm::Image& image = reader.GetImage();
    if (good && image.GetBufferLength() != expected)
    {
      FormatError(file.path, "its pixels are not of the size that its header says");
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
    FormatError(file.path, "its pixels cannot be decoded; the file is truncated or damaged");
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
  const std::size_t size = FrameBytes(file);
  const std::size_t first = size * static_cast<std::size_t>(frame);
  bytes.resize(size);
  if (file.encapsulated && file.transferSyntax == RunLengthSyntax)
  {
    DecodeRunLength(file, static_cast<std::size_t>(frame), bytes);
  }
  else if (file.encapsulated)
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
    ToHostOrder(bytes, VoxelBytes(TypeOf(file)), file.bigEndian);
  }
  ClearUnusedBits(file, bytes);
  return TypeOf(file);
}

void DicomPixelReader::Close()
{
  this->Impl = std::make_unique<Internals>();
}
}
