#include "XmlText.h"

#include "TextWords.h"

#include <expat.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <new>
#include <vector>

namespace coronary
{
namespace
{
constexpr std::size_t Deepest = 32; // VTK's own files have 7, SimVascular's 6
// Expat looks again at a tag that is longer than what it was given, and copies what it is given.
constexpr std::size_t Block = std::size_t(16) << 20;

// Where expat is in what it was given, and the length of what it found there; 2.9 has other names for them.
#if XML_MAJOR_VERSION > 2 || XML_MINOR_VERSION >= 9
constexpr auto CurrentByte = &XML_GetCurrentByteIndex64;
constexpr auto CurrentBytes = &XML_GetCurrentByteCount64;
#else
constexpr auto CurrentByte = &XML_GetCurrentByteIndex;
constexpr auto CurrentBytes = &XML_GetCurrentByteCount;
#endif

[[noreturn]] void FailAt(
  std::string_view text, std::size_t byte, const std::string& file, const std::string& what)
{
  const std::string_view before = text.substr(0, byte);
  FormatError(file,
    "line " + std::to_string(std::count(before.begin(), before.end(), '\n') + 1) + ": " + what);
}

/// Expat is C, through which no exception may pass: they wait until it has returned.
class XmlReader
{
public:
  XmlReader(const std::string& text, const std::string& file,
    const std::function<void(const XmlElement&)>& use, std::string_view last)
    : Parser(XML_ParserCreate(nullptr), &XML_ParserFree)
    , Use(use)
    , Last(last)
  {
    if (!this->Parser)
    {
      throw std::bad_alloc();
    }
    this->Element.text = text;
    this->Element.file = file;
  }

  void Read()
  {
    if (this->ReadRoot() == XML_ERROR_JUNK_AFTER_DOC_ELEMENT)
    {
      this->Root = this->Place();
      XML_ParserReset(this->Parser.get(), nullptr);
      this->ReadRoot();
    }
    const XML_Error error = XML_GetErrorCode(this->Parser.get());
    if (this->Failure)
    {
      std::rethrow_exception(this->Failure);
    }
    if (error == XML_ERROR_NONE || this->Stopped)
    {
      return;
    }
    const bool inside = !this->Element.path.empty();
    const std::string name = Quoted(this->Element.Name());
    if (error == XML_ERROR_NO_ELEMENTS && inside)
    {
      FailAt(this->Element.text, this->Element.text.size(), this->Element.file,
        "ends inside the element " + name);
    }
    FailAt(this->Element.text, this->Place(), this->Element.file,
      std::string("is no XML: ") + XML_ErrorString(error) + (inside ? " inside " + name : ""));
  }

private:
  XML_Error ReadRoot()
  {
    XML_Parser parser = this->Parser.get();
    XML_SetUserData(parser, this);
    XML_SetElementHandler(parser, &XmlReader::Begin, &XmlReader::End);
    XML_SetStartDoctypeDeclHandler(parser, &XmlReader::Doctype);
    const std::string_view text = this->Element.text;
    XML_Status status = XML_STATUS_OK;
    for (std::size_t at = this->Root; status == XML_STATUS_OK;)
    {
      const std::size_t size = std::min(Block, text.size() - at);
      const bool final = at + size == text.size();
      status = XML_Parse(parser, text.data() + at, static_cast<int>(size), final);
      at += size;
      if (final)
      {
        break;
      }
    }
    return XML_GetErrorCode(parser);
  }

  /// The byte of the text that expat is at.
  std::size_t Place() const
  {
    const auto index = CurrentByte(this->Parser.get());
    return this->Root + (index > 0 ? static_cast<std::size_t>(index) : 0);
  }

  template <typename Work>
  void Guard(const Work& work)
  {
    try
    {
      work();
    }
    catch (...)
    {
      this->Failure = std::current_exception();
      XML_StopParser(this->Parser.get(), XML_FALSE);
    }
  }

  static void Begin(void* reader, const XML_Char* name, const XML_Char** attributes)
  {
    auto& self = *static_cast<XmlReader*>(reader);
    self.Guard([&] { self.BeginElement(name, attributes); });
  }

  static void End(void* reader, const XML_Char*)
  {
    auto& self = *static_cast<XmlReader*>(reader);
    self.Element.path.resize(self.Lengths.back());
    self.Lengths.pop_back();
  }

  static void Doctype(void* reader, const XML_Char*, const XML_Char*, const XML_Char*, int)
  {
    auto& self = *static_cast<XmlReader*>(reader);
    self.Guard(
      [&]
      {
        FailAt(self.Element.text, self.Place(), self.Element.file,
          "has a document type or entities, which are not read");
      });
  }

  void BeginElement(const XML_Char* name, const XML_Char** attributes)
  {
    XmlElement& element = this->Element;
    this->Lengths.push_back(element.path.size());
    element.path += (element.path.empty() ? "" : "/") + std::string(name);
    element.attributes.clear();
    for (; *attributes; attributes += 2)
    {
      element.attributes.emplace(attributes[0], attributes[1]);
    }
    element.begin = this->Place();
    element.end = element.begin + static_cast<std::size_t>(CurrentBytes(this->Parser.get()));
    if (this->Lengths.size() > Deepest)
    {
      element.Fail("has more than " + std::to_string(Deepest) + " elements in each other");
    }
    this->Use(element);
    if (element.Name() == this->Last)
    {
      this->Stopped = true;
      XML_StopParser(this->Parser.get(), XML_FALSE);
    }
  }

  std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> Parser;
  const std::function<void(const XmlElement&)>& Use;
  std::string_view Last;
  XmlElement Element;
  std::vector<std::size_t> Lengths; ///< of the path, before each open element
  std::size_t Root = 0;             ///< where the text begins that expat reads
  bool Stopped = false;
  std::exception_ptr Failure;
};
}

std::string_view XmlElement::Name() const
{
  return std::string_view(this->path).substr(this->path.rfind('/') + 1);
}

std::string_view XmlElement::Parent() const
{
  const std::size_t slash = this->path.rfind('/');
  const std::string_view around(this->path.data(), slash == std::string::npos ? 0 : slash);
  return around.substr(around.rfind('/') + 1);
}

std::string XmlElement::String(const char* attribute) const
{
  const auto found = this->attributes.find(attribute);
  return found == this->attributes.end() ? std::string() : found->second;
}

std::string XmlElement::Required(const char* attribute) const
{
  const auto found = this->attributes.find(attribute);
  if (found == this->attributes.end())
  {
    this->Fail(Quoted(this->Name()) + " has no " + attribute);
  }
  return found->second;
}

double XmlElement::Number(const char* attribute) const
{
  const std::string word = this->Required(attribute);
  double value = 0.0;
  if (!ParseNumber(Trimmed(word), value) || !std::isfinite(value))
  {
    this->Fail(Quoted(this->Name()) + ": " + attribute + " is " + Quoted(word) +
      ", which is not a finite number");
  }
  return value;
}

int XmlElement::Integer(const char* attribute) const
{
  const double value = this->attributes.count(attribute) == 0 ? 0.0 : this->Number(attribute);
  if (value != std::rint(value) || std::abs(value) > 1e9)
  {
    this->Fail(Quoted(this->Name()) + ": " + attribute + " is no whole number");
  }
  return static_cast<int>(value);
}

void XmlElement::Fail(const std::string& what) const
{
  FailAt(this->text, this->begin, this->file, what);
}

void ReadXml(const std::string& text, const std::string& file,
  const std::function<void(const XmlElement&)>& use, const char* last)
{
  XmlReader(text, file, use, last).Read();
}

std::string EscapedXml(std::string_view text)
{
  std::string result;
  for (const char c : text)
  {
    const bool blank = c == '\t' || c == '\n' || c == '\r';
    result += c == '&'                       ? "&amp;"
      : c == '<'                             ? "&lt;"
      : c == '>'                             ? "&gt;"
      : c == '"'                             ? "&quot;"
      : blank                                ? "&#" + std::to_string(int(c)) + ";"
      : static_cast<unsigned char>(c) < 0x20 ? " "
                                             : std::string(1, c);
  }
  return result;
}
}
