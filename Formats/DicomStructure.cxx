#include "DicomStructure.h"

#include "ByteOrder.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::uint32_t ItemTag = 0xfffee000u;
constexpr std::uint32_t ItemEnd = 0xfffee00du;
constexpr std::uint32_t SequenceEnd = 0xfffee0ddu;
constexpr std::uint32_t PixelDataTag = 0x7fe00010u;
constexpr std::uint32_t UndefinedLength = 0xffffffffu;
constexpr int DeepestNesting = 32;

// What DicomFile reads; nothing else is kept, so that a strange file costs no memory.
bool IsWanted(std::uint32_t tag)
{
  static const std::uint32_t wanted[] = { 0x00080008u, 0x00080016u, 0x00080018u, 0x00080032u,
    0x00080060u, 0x0008103eu, 0x00180050u, 0x00180088u, 0x00181060u, 0x00181062u, 0x00181088u,
    0x00189118u, 0x0020000eu, 0x00200012u, 0x00200013u, 0x00200032u, 0x00200037u, 0x00200052u,
    0x00200100u, 0x00209113u, 0x00209116u, 0x00209153u, 0x00209241u, 0x00209251u, 0x00280002u,
    0x00280008u, 0x00280010u, 0x00280011u, 0x00280030u, 0x00280100u, 0x00280101u, 0x00280103u,
    0x00281052u, 0x00281053u, 0x00289110u, 0x00289145u, 0x52009229u, 0x52009230u };
  return std::binary_search(std::begin(wanted), std::end(wanted), tag);
}

class Parser
{
public:
  Parser(const std::string& path, DicomStructure& structure)
    : Path(path)
    , Structure(structure)
    , Stream(path, std::ios::binary)
    , Size(std::filesystem::file_size(path))
  {
    if (!this->Stream)
    {
      throw std::runtime_error("File '" + path + "' cannot be read.");
    }
  }

  void Run()
  {
    std::uint64_t position = 0;
    if (this->Has(132) && this->Bytes.compare(128, 4, "DICM") == 0)
    {
      position = 132;
    }
    else if (!this->BeginsWithoutPreamble())
    {
      return;
    }
    this->Structure.isDicom = true;
    position = this->ParseMetaInformation(position);
    this->SetSyntax(position);
    position =
      this->ParseDataSet(position, this->Size, this->Explicit, 0, false, &this->Structure.data);
    this->Bytes.resize(static_cast<std::size_t>(position));
    this->Structure.header = std::move(this->Bytes);
    this->Structure.bigEndian = this->BigEndian;
  }

private:
  struct Element
  {
    std::uint32_t tag = 0;
    std::string representation; ///< empty when the encoding has none
    std::uint64_t value = 0;    ///< position
    std::uint32_t length = 0;
  };

  [[noreturn]] void Damaged() const
  {
    throw std::runtime_error("'" + this->Path + "' is a DICOM file, but truncated or damaged.");
  }

  // Makes the first `end` bytes of the file available; false when it is shorter.
  bool Has(std::uint64_t end)
  {
    if (end > this->Size)
    {
      return false;
    }
    if (end > this->Bytes.size())
    {
      const std::size_t old = this->Bytes.size();
      const auto wanted = static_cast<std::size_t>(
        std::min<std::uint64_t>(this->Size, std::max<std::uint64_t>(end, old + (16u << 10))));
      this->Bytes.resize(wanted);
      this->Stream.read(&this->Bytes[old], static_cast<std::streamsize>(wanted - old));
      if (static_cast<std::size_t>(this->Stream.gcount()) != wanted - old)
      {
        this->Damaged();
      }
    }
    return true;
  }

  unsigned Byte(std::uint64_t position) const
  {
    return static_cast<unsigned char>(this->Bytes[static_cast<std::size_t>(position)]);
  }

  std::uint32_t Number(std::uint64_t position, unsigned bytes)
  {
    if (!this->Has(position + bytes))
    {
      this->Damaged();
    }
    const char* at = this->Bytes.data() + position;
    return bytes == 2 ? NumberAt<std::uint16_t>(at, this->BigEndian)
                      : NumberAt<std::uint32_t>(at, this->BigEndian);
  }

  std::uint32_t Tag(std::uint64_t position)
  {
    const std::uint32_t group = this->Number(position, 2);
    return group << 16 | this->Number(position + 2, 2);
  }

  bool IsRepresentation(std::uint64_t position) const
  {
    const auto isCapital = [this](std::uint64_t p)
    { return this->Byte(p) >= 'A' && this->Byte(p) <= 'Z'; };
    return isCapital(position) && isCapital(position + 1);
  }

  // Old files begin with their first element: of group 0002 or 0008, with a plausible length.
  bool BeginsWithoutPreamble()
  {
    if (!this->Has(8))
    {
      return false;
    }
    const std::uint32_t group = this->Number(0, 2);
    return (group == 2 || group == 8) && this->Byte(3) == 0 &&
      (this->IsRepresentation(4) || (this->Byte(6) == 0 && this->Byte(7) == 0));
  }

  Element ReadElement(std::uint64_t position, bool isExplicit)
  {
    Element element;
    element.tag = this->Tag(position);
    if (!isExplicit || element.tag >> 16 == 0xfffeu)
    {
      element.length = this->Number(position + 4, 4);
      element.value = position + 8;
      return element;
    }
    this->Number(position + 4, 4);
    if (!this->IsRepresentation(position + 4))
    {
      this->Damaged();
    }
    element.representation = this->Bytes.substr(static_cast<std::size_t>(position) + 4, 2);
    static const char* const longOnes[] = { "OB", "OD", "OF", "OL", "OV", "OW", "SQ", "SV", "UC",
      "UN", "UR", "UT", "UV" };
    const bool isLong = std::any_of(std::begin(longOnes), std::end(longOnes),
      [&element](const char* name) { return element.representation == name; });
    element.length = this->Number(position + (isLong ? 8 : 6), isLong ? 4 : 2);
    element.value = position + (isLong ? 12 : 8);
    return element;
  }

  std::string Uid(const Element& element) const
  {
    std::string uid = this->Bytes.substr(
      static_cast<std::size_t>(element.value), static_cast<std::size_t>(element.length));
    uid.erase(
      std::find_if(uid.begin(), uid.end(), [](char c) { return c != '.' && (c < '0' || c > '9'); }),
      uid.end());
    return uid;
  }

  // Group 0002 is explicit little endian whatever follows.
  std::uint64_t ParseMetaInformation(std::uint64_t position)
  {
    while (this->Has(position + 8) && this->Tag(position) >> 16 == 2)
    {
      const Element element = this->ReadElement(position, true);
      const std::uint64_t end = element.value + element.length;
      if (!this->Has(end))
      {
        this->Damaged();
      }
      if (element.tag == 0x00020010u)
      {
        this->Structure.transferSyntax = this->Uid(element);
      }
      if (element.tag == 0x00020002u)
      {
        this->Structure.mediaStorage = this->Uid(element);
      }
      position = end;
    }
    return position;
  }

  void SetSyntax(std::uint64_t position)
  {
    const std::string& uid = this->Structure.transferSyntax;
    if (uid == "1.2.840.10008.1.2.1.99")
    {
      throw std::runtime_error(
        "'" + this->Path + "': the deflated transfer syntax of DICOM is not supported.");
    }
    this->BigEndian = uid == "1.2.840.10008.1.2.2";
    this->Explicit = uid.empty() ? this->Has(position + 8) && this->IsRepresentation(position + 4)
                                 : uid != "1.2.840.10008.1.2";
  }

  bool BeginsWithItem(const Element& element)
  {
    return element.length >= 8 && this->Has(element.value + 4) &&
      this->Tag(element.value) == ItemTag;
  }

  // Returns where the data set ends: at `end`, behind its delimiter, or at the pixel data.
  std::uint64_t ParseDataSet(std::uint64_t position, std::uint64_t end, bool isExplicit, int depth,
    bool delimited, DicomDataSet* into)
  {
    if (depth > DeepestNesting)
    {
      this->Damaged();
    }
    while (position < end)
    {
      const Element element = this->ReadElement(position, isExplicit);
      if (delimited && element.tag == ItemEnd)
      {
        return element.value;
      }
      if (depth == 0 && element.tag == PixelDataTag)
      {
        this->SetPixels(element);
        return position;
      }
      DicomElement* kept = nullptr;
      if (into && IsWanted(element.tag))
      {
        kept = &into->elements[element.tag];
        *kept = {};
      }
      position = this->ParseValue(element, end, isExplicit, depth, kept);
    }
    if (delimited)
    {
      this->Damaged();
    }
    return position;
  }

  std::uint64_t ParseValue(
    const Element& element, std::uint64_t end, bool isExplicit, int depth, DicomElement* kept)
  {
    const bool mayNest =
      !isExplicit || element.representation == "SQ" || element.representation == "UN";
    // The items of an unknown element are implicit little endian.
    const bool inner = isExplicit && element.representation != "UN";
    if (element.length == UndefinedLength)
    {
      return this->ParseItems(element.value, end, inner, depth + 1, true, mayNest, kept);
    }
    const std::uint64_t last = element.value + element.length;
    if (last > end || last > this->Size)
    {
      this->Damaged();
    }
    if (mayNest && this->BeginsWithItem(element))
    {
      this->ParseItems(element.value, last, inner, depth + 1, false, true, kept);
    }
    else if (kept)
    {
      kept->offset = element.value;
      kept->length = element.length;
    }
    return last;
  }

  std::uint64_t ParseItems(std::uint64_t position, std::uint64_t end, bool isExplicit, int depth,
    bool delimited, bool nested, DicomElement* kept)
  {
    while (position < end)
    {
      const Element item = this->ReadElement(position, false);
      if (delimited && item.tag == SequenceEnd)
      {
        return item.value;
      }
      if (item.tag != ItemTag)
      {
        this->Damaged();
      }
      DicomDataSet* into = nullptr;
      if (kept && nested)
      {
        into = &kept->items.emplace_back();
      }
      if (item.length == UndefinedLength)
      {
        position = this->ParseDataSet(item.value, end, isExplicit, depth, true, into);
        continue;
      }
      const std::uint64_t last = item.value + item.length;
      if (last > end)
      {
        this->Damaged();
      }
      if (nested)
      {
        this->ParseDataSet(item.value, last, isExplicit, depth, false, into);
      }
      position = last;
    }
    if (delimited)
    {
      this->Damaged();
    }
    return position;
  }

  void SetPixels(const Element& element)
  {
    this->Structure.encapsulated = element.length == UndefinedLength;
    this->Structure.pixelOffset = element.value;
    this->Structure.pixelBytes = this->Size > element.value ? this->Size - element.value : 0;
  }

  const std::string& Path;
  DicomStructure& Structure;
  std::ifstream Stream;
  std::uint64_t Size;
  std::string Bytes; ///< the file up to where it has been read
  bool BigEndian = false;
  bool Explicit = true;
};
}

DicomStructure ReadDicomStructure(const std::string& path)
{
  DicomStructure structure;
  Parser(path, structure).Run();
  return structure;
}
}
