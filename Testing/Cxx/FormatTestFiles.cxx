#include "FormatTestFiles.h"

#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmWriter.h>

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <random>
#include <stdexcept>

namespace formattest
{
namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder()
{
  std::random_device random;
  do
  {
    this->Path = fs::temp_directory_path() / ("dynamiccoronary-test-" + std::to_string(random()));
  } while (!fs::create_directory(this->Path));
}

TemporaryFolder::~TemporaryFolder()
{
  std::error_code ignored;
  fs::remove_all(this->Path, ignored);
}

std::string TemporaryFolder::operator/(const std::string& name) const
{
  const fs::path path = this->Path / name;
  fs::create_directories(path.parent_path());
  return path.string();
}

int TemporaryFolder::NumberOfEntries() const
{
  return static_cast<int>(std::distance(
    fs::recursive_directory_iterator(this->Path), fs::recursive_directory_iterator()));
}

void WriteBytes(const std::string& path, const Bytes& bytes)
{
  std::ofstream file(path, std::ios::binary);
  file.write(
    reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void WriteText(const std::string& path, const std::string& text)
{
  WriteBytes(path, Bytes(text.begin(), text.end()));
}

Bytes ReadBytes(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
}

Bytes Gzip(const Bytes& bytes)
{
  z_stream stream{};
  if (deflateInit2(&stream, 6, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
  {
    throw std::runtime_error("zlib");
  }
  Bytes packed(deflateBound(&stream, bytes.size()) + 64);
  stream.next_in = const_cast<unsigned char*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = packed.data();
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

Bytes Concatenated(const std::string& head, const Bytes& tail)
{
  Bytes all(head.begin(), head.end());
  all.insert(all.end(), tail.begin(), tail.end());
  return all;
}

short Value(int i, int j, int k, int p)
{
  return static_cast<short>(i + 10 * j + 100 * k + 1000 * p - 50);
}

namespace
{
void Append(Bytes& bytes, short value, bool bigEndian)
{
  const auto bits = static_cast<unsigned>(static_cast<std::uint16_t>(value));
  const auto low = static_cast<unsigned char>(bits & 255u);
  const auto high = static_cast<unsigned char>(bits >> 8);
  bytes.push_back(bigEndian ? high : low);
  bytes.push_back(bigEndian ? low : high);
}

template <typename T>
void Put(Bytes& bytes, std::size_t offset, T value, bool bigEndian)
{
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
  if (bigEndian)
  {
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(offset),
      bytes.begin() + static_cast<std::ptrdiff_t>(offset + sizeof(T)));
  }
}
}

Bytes Voxels(const std::array<int, 3>& n, int phases, bool bigEndian)
{
  Bytes bytes;
  for (int p = 0; p < phases; ++p)
  {
    for (int k = 0; k < n[2]; ++k)
    {
      for (int j = 0; j < n[1]; ++j)
      {
        for (int i = 0; i < n[0]; ++i)
        {
          Append(bytes, Value(i, j, k, p), bigEndian);
        }
      }
    }
  }
  return bytes;
}

Bytes VoxelsPhasesFirst(const std::array<int, 3>& n, int phases)
{
  Bytes bytes;
  for (int k = 0; k < n[2]; ++k)
  {
    for (int j = 0; j < n[1]; ++j)
    {
      for (int i = 0; i < n[0]; ++i)
      {
        for (int p = 0; p < phases; ++p)
        {
          Append(bytes, Value(i, j, k, p), false);
        }
      }
    }
  }
  return bytes;
}

Bytes Nifti(const NiftiOptions& o)
{
  const bool big = o.bigEndian;
  Bytes h(o.version2 ? 544 : 352, 0);
  const std::array<int, 8> dim{ o.phases > 1 ? 4 : 3, o.n[0], o.n[1], o.n[2], o.phases, 1, 1, 1 };
  if (o.version2)
  {
    Put<std::int32_t>(h, 0, 540, big);
    std::memcpy(h.data() + 4, "n+2\0\r\n\032\n", 8);
    Put<std::int16_t>(h, 12, static_cast<std::int16_t>(o.datatype), big);
    for (std::size_t a = 0; a < 8; ++a)
    {
      Put<std::int64_t>(h, 16 + 8 * a, dim[a], big);
      Put<double>(h, 104 + 8 * a, o.pixdim[a], big);
    }
    Put<std::int64_t>(h, 168, 544, big);
    Put<double>(h, 176, o.slope, big);
    Put<double>(h, 184, o.intercept, big);
    Put<std::int32_t>(h, 344, o.qform, big);
    Put<std::int32_t>(h, 348, o.sform, big);
    for (std::size_t a = 0; a < 6; ++a)
    {
      Put<double>(h, 352 + 8 * a, o.quaternion[a], big);
    }
    for (std::size_t a = 0; a < 12; ++a)
    {
      Put<double>(h, 400 + 8 * a, o.affine[a], big);
    }
    Put<std::int32_t>(h, 500, o.units, big);
  }
  else
  {
    Put<std::int32_t>(h, 0, 348, big);
    for (std::size_t a = 0; a < 8; ++a)
    {
      Put<std::int16_t>(h, 40 + 2 * a, static_cast<std::int16_t>(dim[a]), big);
      Put<float>(h, 76 + 4 * a, static_cast<float>(o.pixdim[a]), big);
    }
    Put<std::int16_t>(h, 70, static_cast<std::int16_t>(o.datatype), big);
    Put<float>(h, 108, 352.0f, big);
    Put<float>(h, 112, static_cast<float>(o.slope), big);
    Put<float>(h, 116, static_cast<float>(o.intercept), big);
    h[123] = static_cast<unsigned char>(o.units);
    Put<std::int16_t>(h, 252, static_cast<std::int16_t>(o.qform), big);
    Put<std::int16_t>(h, 254, static_cast<std::int16_t>(o.sform), big);
    for (std::size_t a = 0; a < 6; ++a)
    {
      Put<float>(h, 256 + 4 * a, static_cast<float>(o.quaternion[a]), big);
    }
    for (std::size_t a = 0; a < 12; ++a)
    {
      Put<float>(h, 280 + 4 * a, static_cast<float>(o.affine[a]), big);
    }
    std::memcpy(h.data() + 344, "n+1", 4);
  }
  const Bytes voxels = Voxels(o.n, o.phases, big);
  h.insert(h.end(), voxels.begin(), voxels.end());
  return h;
}

namespace
{
void Set(gdcm::DataSet& data, const gdcm::Tag& tag, const gdcm::VR& vr, std::string value)
{
  if (value.size() % 2 == 1)
  {
    value += vr == gdcm::VR::UI ? '\0' : ' ';
  }
  gdcm::DataElement element(tag);
  element.SetVR(vr);
  element.SetByteValue(value.data(), gdcm::VL(static_cast<std::uint32_t>(value.size())));
  data.Replace(element);
}

template <typename T>
void SetNumber(gdcm::DataSet& data, const gdcm::Tag& tag, const gdcm::VR& vr, T value)
{
  Set(data, tag, vr, std::string(reinterpret_cast<const char*>(&value), sizeof(T)));
}
}

void WriteDicom(const std::string& path, const DicomOptions& o)
{
  gdcm::Writer writer;
  gdcm::File& file = writer.GetFile();
  file.GetHeader().SetDataSetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
  gdcm::DataSet& data = file.GetDataSet();
  const std::string instance = o.instanceUid.empty()
    ? o.seriesUid + ".9." + std::to_string(o.slice) + "." + std::to_string(o.phase)
    : o.instanceUid;
  Set(data, { 0x0008, 0x0008 }, gdcm::VR::CS, o.imageType);
  Set(data, { 0x0008, 0x0016 }, gdcm::VR::UI, "1.2.840.10008.5.1.4.1.1.2");
  Set(data, { 0x0008, 0x0018 }, gdcm::VR::UI, instance);
  Set(data, { 0x0008, 0x0060 }, gdcm::VR::CS, o.modality);
  Set(data, { 0x0008, 0x103e }, gdcm::VR::LO, o.description);
  Set(data, { 0x0020, 0x000e }, gdcm::VR::UI, o.seriesUid);
  Set(data, { 0x0020, 0x0032 }, gdcm::VR::DS, o.position);
  Set(data, { 0x0020, 0x0037 }, gdcm::VR::DS, o.orientation);
  Set(data, { 0x0020, 0x0052 }, gdcm::VR::UI, o.frameOfReference);
  const auto us = [&data](std::uint16_t element, int value) {
    SetNumber(data, { 0x0028, element }, gdcm::VR::US, static_cast<std::uint16_t>(value));
  };
  us(0x0002, o.samples);
  Set(data, { 0x0028, 0x0004 }, gdcm::VR::CS, o.samples == 1 ? "MONOCHROME2" : "RGB");
  us(0x0010, o.rows);
  us(0x0011, o.columns);
  Set(data, { 0x0028, 0x0030 }, gdcm::VR::DS, o.spacing);
  us(0x0100, 16);
  us(0x0101, o.bitsStored);
  us(0x0102, o.bitsStored - 1);
  us(0x0103, o.isSigned ? 1 : 0);
  Set(data, { 0x0028, 0x1052 }, gdcm::VR::DS, o.intercept);
  Set(data, { 0x0028, 0x1053 }, gdcm::VR::DS, o.slope);
  for (const auto& [key, value] : o.more)
  {
    gdcm::Tag tag;
    tag.ReadFromCommaSeparatedString(key.first.c_str());
    const gdcm::VR vr = gdcm::VR::GetVRType(key.second.c_str());
    if (vr == gdcm::VR::FL)
    {
      SetNumber(data, tag, vr, std::stof(value));
    }
    else
    {
      Set(data, tag, vr, value);
    }
  }
  std::string pixels;
  for (int j = 0; j < o.rows; ++j)
  {
    for (int i = 0; i < o.columns; ++i)
    {
      const short value = o.values.empty()
        ? Value(i, j, o.slice, o.phase)
        : o.values[static_cast<std::size_t>(j) * static_cast<std::size_t>(o.columns) +
            static_cast<std::size_t>(i)];
      pixels.append(reinterpret_cast<const char*>(&value), 2);
    }
  }
  Set(data, { 0x7fe0, 0x0010 }, gdcm::VR::OW, pixels);
  writer.SetFileName(path.c_str());
  if (!writer.Write())
  {
    throw std::runtime_error("GDCM cannot write " + path);
  }
}

namespace
{
void SetSequence(gdcm::DataSet& data, const gdcm::Tag& tag, const std::vector<gdcm::DataSet>& items)
{
  gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = new gdcm::SequenceOfItems;
  sequence->SetLengthToUndefined();
  for (const gdcm::DataSet& nested : items)
  {
    gdcm::Item item;
    item.SetVLToUndefined();
    item.SetNestedDataSet(nested);
    sequence->AddItem(item);
  }
  gdcm::DataElement element(tag);
  element.SetVR(gdcm::VR::SQ);
  element.SetValue(*sequence);
  element.SetVLToUndefined();
  data.Replace(element);
}
}

void WriteEnhancedDicom(const std::string& path, int phases, int slices)
{
  const int rows = 3;
  const int columns = 4;
  gdcm::Writer writer;
  gdcm::File& file = writer.GetFile();
  file.GetHeader().SetDataSetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
  gdcm::DataSet& data = file.GetDataSet();
  Set(data, { 0x0008, 0x0016 }, gdcm::VR::UI, "1.2.840.10008.5.1.4.1.1.2.1");
  Set(data, { 0x0008, 0x0018 }, gdcm::VR::UI, "1.2.3.55");
  Set(data, { 0x0008, 0x0060 }, gdcm::VR::CS, "CT");
  Set(data, { 0x0020, 0x000e }, gdcm::VR::UI, "1.2.3");
  const auto us = [&data](std::uint16_t element, int value) {
    SetNumber(data, { 0x0028, element }, gdcm::VR::US, static_cast<std::uint16_t>(value));
  };
  us(0x0002, 1);
  Set(data, { 0x0028, 0x0004 }, gdcm::VR::CS, "MONOCHROME2");
  Set(data, { 0x0028, 0x0008 }, gdcm::VR::IS, std::to_string(phases * slices));
  us(0x0010, rows);
  us(0x0011, columns);
  us(0x0100, 16);
  us(0x0101, 16);
  us(0x0102, 15);
  us(0x0103, 1);
  gdcm::DataSet orientation;
  Set(orientation, { 0x0020, 0x0037 }, gdcm::VR::DS, "1\\0\\0\\0\\1\\0");
  gdcm::DataSet measures;
  Set(measures, { 0x0028, 0x0030 }, gdcm::VR::DS, "0.5\\0.5");
  gdcm::DataSet transformation;
  Set(transformation, { 0x0028, 0x1052 }, gdcm::VR::DS, "-7");
  Set(transformation, { 0x0028, 0x1053 }, gdcm::VR::DS, "1");
  gdcm::DataSet shared;
  SetSequence(shared, { 0x0020, 0x9116 }, { orientation });
  SetSequence(shared, { 0x0028, 0x9110 }, { measures });
  SetSequence(shared, { 0x0028, 0x9145 }, { transformation });
  SetSequence(data, { 0x5200, 0x9229 }, { shared });
  std::vector<gdcm::DataSet> frames;
  std::string pixels;
  for (int s = slices - 1; s >= 0; --s)
  {
    for (int p = 0; p < phases; ++p)
    {
      gdcm::DataSet position;
      Set(position, { 0x0020, 0x0032 }, gdcm::VR::DS, "10\\20\\" + std::to_string(30 + 2 * s));
      gdcm::DataSet synchronization;
      SetNumber(synchronization, { 0x0020, 0x9241 }, gdcm::VR::FL, static_cast<float>(10 + 20 * p));
      SetNumber(synchronization, { 0x0020, 0x9251 }, gdcm::VR::FD, 800.0);
      gdcm::DataSet frame;
      SetSequence(frame, { 0x0018, 0x9118 }, { synchronization });
      SetSequence(frame, { 0x0020, 0x9113 }, { position });
      frames.push_back(frame);
      for (int j = 0; j < rows; ++j)
      {
        for (int i = 0; i < columns; ++i)
        {
          const auto value = static_cast<short>(Value(i, j, s, p) + 7);
          pixels.append(reinterpret_cast<const char*>(&value), 2);
        }
      }
    }
  }
  SetSequence(data, { 0x5200, 0x9230 }, frames);
  Set(data, { 0x7fe0, 0x0010 }, gdcm::VR::OW, pixels);
  writer.SetFileName(path.c_str());
  if (!writer.Write())
  {
    throw std::runtime_error("GDCM cannot write " + path);
  }
}

bool CompressDicom(const std::string& path, bool runLength)
{
  gdcm::ImageReader reader;
  reader.SetFileName(path.c_str());
  if (!reader.Read())
  {
    return false;
  }
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(
    runLength ? gdcm::TransferSyntax::RLELossless : gdcm::TransferSyntax::JPEGLosslessProcess14_1);
  change.SetInput(reader.GetImage());
  if (!change.Change())
  {
    return false;
  }
  // gdcm::ImageWriter would write the functional groups anew.
  gdcm::Writer writer;
  writer.SetFile(reader.GetFile());
  writer.GetFile().GetHeader().SetDataSetTransferSyntax(change.GetOutput().GetTransferSyntax());
  writer.GetFile().GetDataSet().Replace(change.GetOutput().GetDataElement());
  writer.SetFileName(path.c_str());
  return writer.Write();
}
}
