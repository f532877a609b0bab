#include "XrayAngiogram.h"

#include "AtomicFile.h"
#include "Fnv1a.h"
#include "Require.h"

#include <gdcmWriter.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <utility>

namespace coronary
{
namespace
{
constexpr const char* XaImageStorage = "1.2.840.10008.5.1.4.1.1.12.1";
constexpr double DecigrayPerGray = 10.0;
/// More than this is no movement, degrees and mm.
constexpr double Movement = 0.01;

/// A decimal string has at most 16 characters.
std::string Decimal(double value)
{
  char text[32];
  std::snprintf(text, sizeof text, "%.8g", value);
  return text;
}

std::string Whole(double value)
{
  return std::to_string(std::lround(value));
}

/// What names and descriptions can hold: no separators, at most 50 bytes, not cut within a letter of UTF-8.
std::string NameText(std::string text)
{
  constexpr std::size_t Longest = 50;
  for (char& c : text)
  {
    const auto code = static_cast<unsigned char>(c);
    c = code < 0x20U || code == 0x7fU || c == '\\' || c == '^' || c == '=' ? ' ' : c;
  }
  std::size_t end = std::min(text.size(), Longest);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U)
  {
    --end;
  }
  return text.substr(0, end);
}

/// As a UUID (PS3.5 B.2): 2.25. and 128 bits as a decimal number.
std::string UniqueIdentifier(const std::string& what)
{
  const std::uint64_t low = Fnv1a(what.data(), what.size());
  const std::uint64_t high = Fnv1a(what.data(), what.size(), ~low);
  std::array<std::uint32_t, 4> parts{ static_cast<std::uint32_t>(high >> 32U),
    static_cast<std::uint32_t>(high), static_cast<std::uint32_t>(low >> 32U),
    static_cast<std::uint32_t>(low) };
  std::string digits;
  while (std::any_of(parts.begin(), parts.end(), [](std::uint32_t part) { return part != 0; }))
  {
    std::uint64_t rest = 0;
    for (std::uint32_t& part : parts)
    {
      rest = (rest << 32U) + part;
      part = static_cast<std::uint32_t>(rest / 10);
      rest %= 10;
    }
    digits += static_cast<char>('0' + rest);
  }
  std::reverse(digits.begin(), digits.end());
  return "2.25." + (digits.empty() ? "0" : digits);
}

class DataSetWriter
{
public:
  explicit DataSetWriter(gdcm::DataSet& data)
    : Data(data)
  {
  }

  void Text(std::uint16_t group, std::uint16_t element, gdcm::VR::VRType type, std::string value)
  {
    if (value.size() % 2 != 0)
    {
      value += type == gdcm::VR::UI ? '\0' : ' ';
    }
    this->Bytes(group, element, type, value.data(), value.size());
  }

  void Decimals(std::uint16_t group, std::uint16_t element, const std::vector<double>& values)
  {
    std::string text;
    for (const double value : values)
    {
      text += (text.empty() ? "" : "\\") + Decimal(value);
    }
    this->Text(group, element, gdcm::VR::DS, text);
  }

  void Numbers(std::uint16_t group, std::uint16_t element, const std::vector<std::uint16_t>& values)
  {
    std::string bytes;
    for (const std::uint16_t value : values)
    {
      bytes += static_cast<char>(value & 0xffU);
      bytes += static_cast<char>(value >> 8U);
    }
    this->Bytes(group, element, gdcm::VR::US, bytes.data(), bytes.size());
  }

  void Bytes(std::uint16_t group, std::uint16_t element, gdcm::VR::VRType type, const char* bytes,
    std::size_t size)
  {
    gdcm::DataElement entry(gdcm::Tag(group, element));
    entry.SetVR(type);
    entry.SetByteValue(bytes, gdcm::VL(static_cast<std::uint32_t>(size)));
    this->Data.Replace(entry);
  }

private:
  gdcm::DataSet& Data;
};

/// A value of each frame less that of the first.
template <typename Value>
std::vector<double> Increments(const XrayAngiogram& run, const Value& value)
{
  std::vector<double> increments;
  for (const XrayAngiogram::Frame& frame : run.frames)
  {
    increments.push_back(value(frame) - value(run.frames.front()));
  }
  return increments;
}

/// Since the frame before, ms.
std::vector<double> Intervals(const XrayAngiogram& run)
{
  std::vector<double> intervals{ 0.0 };
  for (std::size_t n = 1; n < run.frames.size(); ++n)
  {
    intervals.push_back(1000.0 * (run.frames[n].seconds - run.frames[n - 1].seconds));
  }
  return intervals;
}

/// Frames may be missing between others.
bool IsEven(const XrayAngiogram& run)
{
  const std::vector<double> intervals = Intervals(run);
  constexpr double Tolerance = 1.5; // ms
  return std::all_of(intervals.begin() + 1, intervals.end(),
    [&](double interval) { return std::abs(interval - 1000.0 / run.frameRate) < Tolerance; });
}

template <typename Moved>
bool AnyFrame(const XrayAngiogram& run, const Moved& moved)
{
  return std::any_of(run.frames.begin(), run.frames.end(), moved);
}

/// Whose images, made where and by what. What a simulation does not know is empty, where the standard asks for the entry.
void AddStudy(DataSetWriter& data, const XrayAngiogram& run, const std::string& instance)
{
  using gdcm::VR;
  const std::string study = std::to_string(run.study);
  data.Text(0x0008, 0x0005, VR::CS, "ISO_IR 192");
  data.Text(0x0008, 0x0008, VR::CS,
    std::string(run.subtracted ? "DERIVED" : "ORIGINAL") + "\\PRIMARY\\SINGLE PLANE");
  data.Text(0x0008, 0x0016, VR::UI, XaImageStorage);
  data.Text(0x0008, 0x0018, VR::UI, instance);
  data.Text(0x0008, 0x0020, VR::DA, "");
  data.Text(0x0008, 0x0030, VR::TM, "");
  data.Text(0x0008, 0x0050, VR::SH, "");
  data.Text(0x0008, 0x0060, VR::CS, "XA");
  data.Text(0x0008, 0x0070, VR::LO, "DynamicCoronary");
  data.Text(0x0008, 0x0090, VR::PN, "");
  data.Text(0x0008, 0x1030, VR::LO, "Simulated coronary angiography");
  data.Text(0x0008, 0x103e, VR::LO, NameText(run.view));
  data.Text(0x0008, 0x1090, VR::LO, "coronary-simulator");
  data.Text(0x0010, 0x0010, VR::PN, "Simulated^" + NameText(run.patient));
  data.Text(0x0010, 0x0020, VR::LO, "Simulated");
  data.Text(0x0010, 0x0030, VR::DA, "");
  data.Text(0x0010, 0x0040, VR::CS, "");
  data.Text(0x0018, 0x0015, VR::CS, "HEART");
  data.Text(0x0018, 0x1020, VR::LO, NameText(run.program));
  data.Text(0x0020, 0x000d, VR::UI, UniqueIdentifier("study " + study));
  data.Text(0x0020, 0x000e, VR::UI, UniqueIdentifier("series " + study));
  data.Text(0x0020, 0x0010, VR::SH, "1");
  data.Text(0x0020, 0x0011, VR::IS, "1");
  data.Text(0x0020, 0x0012, VR::IS, std::to_string(run.run));
  // 100 parts of a run are more than an hour.
  data.Text(0x0020, 0x0013, VR::IS, std::to_string(100 * run.run + run.part));
  data.Text(0x0020, 0x0020, VR::CS, "");
  data.Text(0x0020, 0x4000, VR::LT,
    "Simulated: not an examination of a patient." +
      (run.dropped > 0
          ? " The first " + std::to_string(run.dropped) + " frames of this run were not kept."
          : ""));
}

/// How the images were exposed, and from where.
void AddAcquisition(DataSetWriter& data, const XrayAngiogram& run)
{
  using gdcm::VR;
  const XrayAngiogram::Frame& first = run.frames.front();
  data.Text(0x0008, 0x2144, VR::IS, Whole(run.frameRate));
  if (run.contrast > 0.0)
  {
    data.Text(0x0018, 0x0010, VR::LO, "Iodinated contrast medium");
    data.Text(0x0018, 0x1040, VR::LO, "Intra-arterial");
    data.Text(0x0018, 0x1041, VR::DS, Decimal(run.contrast));
    data.Text(0x0018, 0x1049, VR::DS, Decimal(run.iodine));
  }
  data.Text(0x0018, 0x0040, VR::IS, Whole(run.frameRate));
  data.Text(0x0018, 0x0060, VR::DS, "");
  if (IsEven(run))
  {
    data.Text(0x0018, 0x1063, VR::DS, Decimal(1000.0 / run.frameRate));
  }
  else
  {
    data.Decimals(0x0018, 0x1065, Intervals(run));
  }
  data.Text(0x0018, 0x1110, VR::DS, Decimal(run.sourceToDetector));
  data.Text(0x0018, 0x1111, VR::DS, Decimal(run.sourceToIsocentre));
  data.Text(0x0018, 0x1114, VR::DS, Decimal(run.sourceToDetector / run.sourceToIsocentre));
  data.Text(0x0018, 0x1147, VR::CS, "RECTANGLE");
  data.Text(0x0018, 0x1149, VR::IS, Whole(run.height) + "\\" + Whole(run.width));
  data.Text(0x0018, 0x1150, VR::IS, "");
  data.Text(0x0018, 0x1151, VR::IS, "");
  data.Text(0x0018, 0x1152, VR::IS, "");
  data.Text(0x0018, 0x1155, VR::CS, "GR");
  data.Text(0x0018, 0x115e, VR::DS, Decimal(DecigrayPerGray * run.areaDose));
  data.Decimals(0x0018, 0x1164, { run.height / run.rows, run.width / run.columns });
  if (run.shutterLeft + run.shutterRight + run.shutterTop + run.shutterBottom > 0)
  {
    // The edges' own column or row, counted from 1.
    data.Text(0x0018, 0x1700, VR::CS, "RECTANGULAR");
    data.Text(0x0018, 0x1702, VR::IS, std::to_string(run.shutterLeft));
    data.Text(0x0018, 0x1704, VR::IS, std::to_string(run.columns + 1 - run.shutterRight));
    data.Text(0x0018, 0x1706, VR::IS, std::to_string(run.shutterTop));
    data.Text(0x0018, 0x1708, VR::IS, std::to_string(run.rows + 1 - run.shutterBottom));
  }
  const bool turns = AnyFrame(run,
    [&](const XrayAngiogram::Frame& frame)
    {
      return std::abs(frame.primary - first.primary) > Movement ||
        std::abs(frame.secondary - first.secondary) > Movement;
    });
  const bool slides = AnyFrame(run,
    [&](const XrayAngiogram::Frame& frame)
    { return (frame.isocentre - first.isocentre).norm() > Movement; });
  data.Text(0x0018, 0x1134, VR::CS, slides ? "DYNAMIC" : "STATIC");
  if (slides)
  {
    // The table goes the other way than the isocentre in the patient. Positive: down, to the patient's left, to the head.
    data.Decimals(
      0x0018, 0x1135, Increments(run, [](const auto& frame) { return -frame.isocentre.y(); }));
    data.Decimals(
      0x0018, 0x1136, Increments(run, [](const auto& frame) { return -frame.isocentre.x(); }));
    data.Decimals(
      0x0018, 0x1137, Increments(run, [](const auto& frame) { return -frame.isocentre.z(); }));
  }
  data.Text(0x0018, 0x1500, VR::CS, turns ? "DYNAMIC" : "STATIC");
  data.Text(0x0018, 0x1510, VR::DS, Decimal(first.primary));
  data.Text(0x0018, 0x1511, VR::DS, Decimal(first.secondary));
  if (turns)
  {
    data.Decimals(0x0018, 0x1520, Increments(run, [](const auto& frame) { return frame.primary; }));
    data.Decimals(
      0x0018, 0x1521, Increments(run, [](const auto& frame) { return frame.secondary; }));
  }
}

void AddImage(DataSetWriter& data, const XrayAngiogram& run)
{
  using gdcm::VR;
  data.Numbers(0x0028, 0x0002, { 1 });
  data.Text(0x0028, 0x0004, VR::CS, "MONOCHROME2");
  data.Text(0x0028, 0x0008, VR::IS, std::to_string(run.frames.size()));
  // Frame Time, or Frame Time Vector.
  const char timing[4] = { 0x18, 0x00, IsEven(run) ? '\x63' : '\x65', 0x10 };
  data.Bytes(0x0028, 0x0009, VR::AT, timing, sizeof timing);
  data.Numbers(0x0028, 0x0010, { static_cast<std::uint16_t>(run.rows) });
  data.Numbers(0x0028, 0x0011, { static_cast<std::uint16_t>(run.columns) });
  data.Numbers(0x0028, 0x0100, { 8 });
  data.Numbers(0x0028, 0x0101, { 8 });
  data.Numbers(0x0028, 0x0102, { 7 });
  data.Numbers(0x0028, 0x0103, { 0 });
  data.Text(0x0028, 0x0301, VR::CS, "NO");
  data.Text(0x0028, 0x1040, VR::CS, "DISP");
  data.Text(0x0028, 0x1050, VR::DS, "128");
  data.Text(0x0028, 0x1051, VR::DS, "256");
  data.Text(0x0028, 0x2110, VR::CS, "00");
  std::vector<std::uint16_t> beats;
  for (std::size_t n = 0; n < run.frames.size(); ++n)
  {
    if (run.frames[n].afterRWave)
    {
      beats.push_back(static_cast<std::uint16_t>(n + 1));
    }
  }
  if (!beats.empty())
  {
    data.Numbers(0x0028, 0x6040, beats);
  }
}

void RequireFrames(const XrayAngiogram& run)
{
  Require(!run.frames.empty(), "an X-ray run has no frame");
  constexpr int Most = std::numeric_limits<std::uint16_t>::max();
  Require(run.columns > 0 && run.columns <= Most && run.rows > 0 && run.rows <= Most &&
      run.frames.size() <= static_cast<std::size_t>(Most),
    "an X-ray run is too large for a file");
  Require(run.width > 0.0 && run.height > 0.0 && run.frameRate > 0.0 &&
      run.sourceToDetector > 0.0 && run.sourceToIsocentre > 0.0,
    "an X-ray run's detector, rate and distances must be positive");
  const std::size_t size = static_cast<std::size_t>(run.columns) * run.rows;
  for (const XrayAngiogram::Frame& frame : run.frames)
  {
    Require(frame.pixels.size() == size, "frames of an X-ray run are of different sizes");
  }
  Require(run.Bytes() < std::numeric_limits<std::uint32_t>::max(),
    "an X-ray run is too large for a file");
}
}

std::size_t XrayAngiogram::Bytes() const
{
  return this->frames.size() * static_cast<std::size_t>(this->columns) * this->rows;
}

void WriteXrayAngiogram(XrayAngiogram run, const std::string& path)
{
  RequireFrames(run);
  std::vector<char> pixels;
  pixels.reserve(run.Bytes() + 1);
  for (XrayAngiogram::Frame& frame : run.frames)
  {
    pixels.insert(pixels.end(), frame.pixels.begin(), frame.pixels.end());
    frame.pixels = {};
  }
  const std::string instance = std::to_string(run.study) + " " + std::to_string(run.run) + " " +
    std::to_string(run.part) + " " + std::to_string(Fnv1a(pixels.data(), pixels.size()));
  if (pixels.size() % 2 != 0)
  {
    pixels.push_back(0);
  }
  gdcm::Writer writer;
  writer.GetFile().GetHeader().SetDataSetTransferSyntax(
    gdcm::TransferSyntax::ExplicitVRLittleEndian);
  DataSetWriter data(writer.GetFile().GetDataSet());
  AddStudy(data, run, UniqueIdentifier("instance " + instance));
  AddAcquisition(data, run);
  AddImage(data, run);
  data.Bytes(0x7fe0, 0x0010, gdcm::VR::OB, pixels.data(), pixels.size());
  pixels = {};
  AtomicFile file(path);
  writer.SetFileName(file.TemporaryPath().c_str());
  if (!writer.Write())
  {
    throw std::runtime_error("Could not write '" + path + "'.");
  }
  file.Commit();
}
}
