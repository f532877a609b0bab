#include "SimVascularFile.h"

#include "ByteStream.h"
#include "TextFile.h"
#include "TextScanner.h"
#include "VolumeHeaderParsers.h"
#include "XmlText.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::uint64_t LargestFile = 256u << 20;
constexpr std::size_t DeepestElement = 32;

/// The elements of an XML text one after the other. Text between tags means nothing in these files.
class XmlScanner
{
public:
  XmlScanner(const std::string& text, const std::string& name)
    : Text(text)
    , Name(name)
  {
  }

  /// The next begin of an element; false at the end of the text.
  bool Next()
  {
    if (this->Empty)
    {
      this->Open.pop_back();
      this->Empty = false;
    }
    for (;;)
    {
      this->Position = this->Text.find('<', this->Position);
      if (this->Position == std::string::npos)
      {
        if (!this->Open.empty())
        {
          this->Position = this->Text.size();
          this->Fail("ends inside the element '" + this->Open.back() + "'");
        }
        return false;
      }
      if (this->Skip("<!--", "-->") || this->Skip("<?", "?>") || this->Skip("<!", ">"))
      {
        continue;
      }
      ++this->Position;
      if (this->At() == '/')
      {
        ++this->Position;
        this->End();
        continue;
      }
      this->Begin();
      return true;
    }
  }

  /// Names of the elements that are open, with a slash between them: "path/timestep".
  bool Is(const char* path) const
  {
    std::string open;
    for (const std::string& name : this->Open)
    {
      open += (open.empty() ? "" : "/") + name;
    }
    return open == path;
  }

  double Number(const char* attribute) const
  {
    const auto found = this->Attributes.find(attribute);
    double value = 0.0;
    if (found == this->Attributes.end())
    {
      this->Fail("'" + this->Open.back() + "' has no " + attribute);
    }
    if (!ParseNumber(found->second, value) || !std::isfinite(value))
    {
      this->Fail("'" + this->Open.back() + "': " + attribute + " is '" +
        found->second.substr(0, 32) + "', which is not a finite number");
    }
    return value;
  }

  Vector3 Vector() const { return { this->Number("x"), this->Number("y"), this->Number("z") }; }

  /// A whole number, 0 when it is missing.
  int Integer(const char* attribute) const
  {
    if (this->Attributes.count(attribute) == 0)
    {
      return 0;
    }
    const double value = this->Number(attribute);
    if (value != std::rint(value) || std::abs(value) > 1e9)
    {
      this->Fail("'" + this->Open.back() + "': " + attribute + " is no whole number");
    }
    return static_cast<int>(value);
  }

  std::string String(const char* attribute) const
  {
    const auto found = this->Attributes.find(attribute);
    return found == this->Attributes.end() ? std::string() : found->second;
  }

  [[noreturn]] void Fail(const std::string& what) const
  {
    const auto end =
      this->Text.begin() + static_cast<std::ptrdiff_t>(std::min(this->Position, this->Text.size()));
    FormatError(this->Name,
      "line " + std::to_string(std::count(this->Text.begin(), end, '\n') + 1) + ": " + what);
  }

private:
  char At() const { return this->Position < this->Text.size() ? this->Text[this->Position] : '\0'; }

  bool Skip(const char* begin, const char* end)
  {
    if (this->Text.compare(this->Position, std::string(begin).size(), begin) != 0)
    {
      return false;
    }
    const std::size_t found = this->Text.find(end, this->Position);
    if (found == std::string::npos)
    {
      this->Fail("is truncated inside '" + std::string(begin) + "'");
    }
    this->Position = found + std::string(end).size();
    return true;
  }

  void SkipBlanks()
  {
    while (this->At() == ' ' || this->At() == '\t' || this->At() == '\n' || this->At() == '\r')
    {
      ++this->Position;
    }
  }

  std::string Word()
  {
    const std::size_t end = this->Text.find_first_of(" \t\r\n=/><\"'", this->Position);
    const std::size_t last = std::min(end, this->Text.size());
    std::string word = this->Text.substr(this->Position, last - this->Position);
    if (word.empty() || word.size() > 256)
    {
      this->Fail("is no XML: a name is expected");
    }
    this->Position = last;
    return word;
  }

  void Begin()
  {
    if (this->Open.size() >= DeepestElement)
    {
      this->Fail("has more than " + std::to_string(DeepestElement) + " elements in each other");
    }
    this->Open.push_back(this->Word());
    this->Attributes.clear();
    for (;;)
    {
      this->SkipBlanks();
      if (this->At() == '>')
      {
        ++this->Position;
        return;
      }
      if (this->At() == '/' && this->Position + 1 < this->Text.size() &&
        this->Text[this->Position + 1] == '>')
      {
        this->Position += 2;
        this->Empty = true;
        return;
      }
      const std::string name = this->Word();
      this->SkipBlanks();
      if (this->At() != '=')
      {
        this->Fail("is no XML: '" + name + "' has no value");
      }
      ++this->Position;
      this->SkipBlanks();
      const char quote = this->At();
      const std::size_t end = quote == '"' || quote == '\''
        ? this->Text.find(quote, this->Position + 1)
        : std::string::npos;
      if (end == std::string::npos)
      {
        this->Fail("is no XML: the value of '" + name + "' is not quoted, or truncated");
      }
      try
      {
        this->Attributes[name] =
          UnescapedXml(this->Text.substr(this->Position + 1, end - this->Position - 1));
      }
      catch (const std::runtime_error& error)
      {
        this->Fail("is no XML: " + std::string(error.what()));
      }
      this->Position = end + 1;
    }
  }

  void End()
  {
    const std::string name = this->Word();
    this->SkipBlanks();
    if (this->At() != '>' || this->Open.empty() || this->Open.back() != name)
    {
      this->Fail("is no XML: '" + name + "' ends, which is not open");
    }
    ++this->Position;
    this->Open.pop_back();
  }

  const std::string& Text;
  const std::string& Name;
  std::size_t Position = 0;
  std::vector<std::string> Open;
  std::map<std::string, std::string> Attributes;
  bool Empty = false;
};

std::string Element(const std::string& name, const Vector3& vector)
{
  std::string text = "<" + name;
  for (int axis = 0; axis < 3; ++axis)
  {
    text += std::string(" ") + "xyz"[axis] + "=\"";
    AppendNumber(text, vector[axis]);
    text += "\"";
  }
  return text + " />\n";
}

std::string Points(const std::string& name, const std::vector<Vector3>& points)
{
  std::string text = "<" + name + ">\n";
  for (std::size_t n = 0; n < points.size(); ++n)
  {
    text += Element("point id=\"" + std::to_string(n) + "\"", points[n]);
  }
  return text + "</" + name + ">\n";
}

std::string FrameText(const PathFrame& frame)
{
  return "<path_point id=\"" + std::to_string(frame.id) + "\">\n" + Element("pos", frame.position) +
    Element("tangent", frame.tangent) + Element("rotation", frame.rotation) + "</path_point>\n";
}

constexpr const char* Declaration = "<?xml version=\"1.0\" encoding=\"UTF-8\" ?>\n";
}

double SimVascularContour::Radius() const
{
  // The area is that of the fan around the centre, whatever plane the contour lies in.
  const Vector3 center = this->Center();
  Vector3 area = Vector3::Zero();
  const std::size_t count = this->contourPoints.size();
  for (std::size_t n = 0; count >= 3 && n < count; ++n)
  {
    area +=
      0.5 * (this->contourPoints[n] - center).cross(this->contourPoints[(n + 1) % count] - center);
  }
  return std::sqrt(area.norm() / 3.14159265358979323846);
}

Vector3 SimVascularContour::Center() const
{
  if (this->contourPoints.empty())
  {
    return this->frame.position;
  }
  // Weighted with the length of contour that each point stands for: points may lie unevenly.
  Vector3 sum = Vector3::Zero();
  double weights = 0.0;
  const std::size_t count = this->contourPoints.size();
  for (std::size_t n = 0; n < count; ++n)
  {
    const Vector3& point = this->contourPoints[n];
    const double weight = (this->contourPoints[(n + 1) % count] - point).norm() +
      (this->contourPoints[(n + count - 1) % count] - point).norm();
    sum += weight * point;
    weights += weight;
  }
  return weights > 0.0 ? Vector3(sum / weights) : this->contourPoints.front();
}

SimVascularPath ParseSimVascularPath(const std::string& text, const std::string& name)
{
  XmlScanner xml(text, name);
  SimVascularPath path;
  bool there = false;
  int steps = 0;
  while (xml.Next())
  {
    if (xml.Is("path"))
    {
      there = true;
      path.id = xml.Integer("id");
    }
    steps += xml.Is("path/timestep") ? 1 : 0;
    if (steps > 1)
    {
      continue;
    }
    if (xml.Is("path/timestep/path_element/control_points/point"))
    {
      path.controlPoints.push_back(xml.Vector());
    }
    else if (xml.Is("path/timestep/path_element/path_points/path_point"))
    {
      path.points.emplace_back();
      path.points.back().id = xml.Integer("id");
    }
    else if (xml.Is("path/timestep/path_element/path_points/path_point/pos"))
    {
      path.points.back().position = xml.Vector();
    }
    else if (xml.Is("path/timestep/path_element/path_points/path_point/tangent"))
    {
      path.points.back().tangent = xml.Vector();
    }
    else if (xml.Is("path/timestep/path_element/path_points/path_point/rotation"))
    {
      path.points.back().rotation = xml.Vector();
    }
  }
  if (!there)
  {
    FormatError(name, "is no path of SimVascular: it has no element 'path'");
  }
  if (path.points.empty())
  {
    FormatError(name, "the path has no points");
  }
  path.timesteps = steps;
  return path;
}

SimVascularContourGroup ParseSimVascularContours(const std::string& text, const std::string& name)
{
  XmlScanner xml(text, name);
  SimVascularContourGroup group;
  bool there = false;
  int steps = 0;
  while (xml.Next())
  {
    if (xml.Is("contourgroup"))
    {
      there = true;
      group.pathName = xml.String("path_name");
      group.pathId = xml.Integer("path_id");
    }
    steps += xml.Is("contourgroup/timestep") ? 1 : 0;
    if (steps > 1)
    {
      continue;
    }
    if (xml.Is("contourgroup/timestep/contour"))
    {
      group.contours.emplace_back();
      group.contours.back().id = xml.Integer("id");
      group.contours.back().type = xml.String("type");
    }
    else if (xml.Is("contourgroup/timestep/contour/path_point"))
    {
      group.contours.back().frame.id = xml.Integer("id");
    }
    else if (xml.Is("contourgroup/timestep/contour/path_point/pos"))
    {
      group.contours.back().frame.position = xml.Vector();
    }
    else if (xml.Is("contourgroup/timestep/contour/path_point/tangent"))
    {
      group.contours.back().frame.tangent = xml.Vector();
    }
    else if (xml.Is("contourgroup/timestep/contour/path_point/rotation"))
    {
      group.contours.back().frame.rotation = xml.Vector();
    }
    else if (xml.Is("contourgroup/timestep/contour/control_points/point"))
    {
      group.contours.back().controlPoints.push_back(xml.Vector());
    }
    else if (xml.Is("contourgroup/timestep/contour/contour_points/point"))
    {
      group.contours.back().contourPoints.push_back(xml.Vector());
    }
  }
  if (!there)
  {
    FormatError(name, "are no contours of SimVascular: there is no element 'contourgroup'");
  }
  const auto empty = [](const SimVascularContour& contour)
  { return contour.contourPoints.empty(); };
  group.contours.erase(
    std::remove_if(group.contours.begin(), group.contours.end(), empty), group.contours.end());
  if (group.contours.empty())
  {
    FormatError(name, "the group has no contours with points");
  }
  group.timesteps = steps;
  return group;
}

std::string SimVascularPathText(const SimVascularPath& path)
{
  const std::string count = std::to_string(path.points.size());
  // Method 0: a given number of points in all.
  const std::string method = "method=\"0\" calculation_number=\"" + count + "\" spacing=\"0\"";
  std::string text = std::string(Declaration) + "<path id=\"" + std::to_string(path.id) + "\" " +
    method + " version=\"1.0\" reslice_size=\"5\" point_2D_display_size=\"\" point_size=\"\">\n" +
    "<timestep id=\"0\">\n<path_element " + method + ">\n" +
    Points("control_points", path.controlPoints) + "<path_points>\n";
  for (const PathFrame& frame : path.points)
  {
    text += FrameText(frame);
  }
  return text + "</path_points>\n</path_element>\n</timestep>\n</path>\n";
}

std::string SimVascularContourText(const SimVascularContourGroup& group)
{
  std::string text = std::string(Declaration) + "<contourgroup path_name=\"" +
    EscapedXml(group.pathName) + "\" path_id=\"" + std::to_string(group.pathId) +
    "\" reslice_size=\"5\" point_2D_display_size=\"\" point_size=\"\" version=\"1.0\">\n" +
    "<timestep id=\"0\">\n" +
    "<lofting_parameters method=\"nurbs\" sampling=\"60\" sample_per_seg=\"12\" "
    "use_linear_sample=\"1\" linear_multiplier=\"10\" use_fft=\"0\" num_modes=\"20\" "
    "u_degree=\"2\" "
    "v_degree=\"2\" u_knot_type=\"derivative\" v_knot_type=\"average\" "
    "u_parametric_type=\"centripetal\" v_parametric_type=\"chord\" />\n";
  for (const SimVascularContour& contour : group.contours)
  {
    text += "<contour id=\"" + std::to_string(contour.id) + "\" type=\"" +
      EscapedXml(contour.type) +
      "\" method=\"Manual\" closed=\"true\" min_control_number=\"2\" max_control_number=\"" +
      std::to_string(std::max<std::size_t>(2, contour.controlPoints.size())) +
      "\" subdivision_type=\"0\" subdivision_number=\"" +
      std::to_string(contour.contourPoints.size()) + "\" subdivision_spacing=\"0\">\n" +
      FrameText(contour.frame) + Points("control_points", contour.controlPoints) +
      Points("contour_points", contour.contourPoints) + "</contour>\n";
  }
  return text + "</timestep>\n</contourgroup>\n";
}

std::string ReadSimVascularFile(const std::string& path)
{
  RequireFile(path);
  return ReadTextFile(path, "a path or contours", LargestFile);
}
}
