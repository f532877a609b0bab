#include "SimVascularFile.h"

#include "ByteStream.h"
#include "TextFile.h"
#include "TextWords.h"
#include "XmlText.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

namespace coronary
{
namespace
{
constexpr std::uint64_t MaximumFile = 256u << 20;
Vector3 Vector(const XmlElement& xml)
{
  return { xml.Number("x"), xml.Number("y"), xml.Number("z") };
}

/// What an element says of the path point whose element is at `point`.
void ReadFrame(const XmlElement& xml, std::string_view point, PathFrame& frame)
{
  const std::string_view path = xml.path;
  if (path.substr(0, point.size()) != point)
  {
    return;
  }
  const std::string_view part = path.substr(point.size());
  if (part.empty())
  {
    frame.id = xml.Integer("id");
  }
  else if (part == "/pos")
  {
    frame.position = Vector(xml);
  }
  else if (part == "/tangent")
  {
    frame.tangent = Vector(xml);
  }
  else if (part == "/rotation")
  {
    frame.rotation = Vector(xml);
  }
}

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
  SimVascularPath path;
  bool there = false;
  int steps = 0;
  constexpr const char* Point = "path/timestep/path_element/path_points/path_point";
  ReadXml(text, name,
    [&](const XmlElement& xml)
    {
      if (xml.Is("path"))
      {
        there = true;
        path.id = xml.Integer("id");
      }
      steps += xml.Is("path/timestep") ? 1 : 0;
      if (steps > 1)
      {
        return;
      }
      if (xml.Is("path/timestep/path_element/control_points/point"))
      {
        path.controlPoints.push_back(Vector(xml));
      }
      if (xml.Is(Point))
      {
        path.points.emplace_back();
      }
      if (!path.points.empty())
      {
        ReadFrame(xml, Point, path.points.back());
      }
    });
  if (!there)
  {
    FormatError(name, "is no path of SimVascular: it has no element 'path'");
  }
  if (path.points.empty())
  {
    FormatError(name, "the path has no points");
  }
  return path;
}

SimVascularContourGroup ParseSimVascularContours(const std::string& text, const std::string& name)
{
  SimVascularContourGroup group;
  bool there = false;
  int steps = 0;
  ReadXml(text, name,
    [&](const XmlElement& xml)
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
        return;
      }
      if (xml.Is("contourgroup/timestep/contour"))
      {
        group.contours.emplace_back();
        group.contours.back().id = xml.Integer("id");
        group.contours.back().type = xml.String("type");
      }
      if (group.contours.empty())
      {
        return;
      }
      SimVascularContour& contour = group.contours.back();
      ReadFrame(xml, "contourgroup/timestep/contour/path_point", contour.frame);
      if (xml.Is("contourgroup/timestep/contour/control_points/point"))
      {
        contour.controlPoints.push_back(Vector(xml));
      }
      else if (xml.Is("contourgroup/timestep/contour/contour_points/point"))
      {
        contour.contourPoints.push_back(Vector(xml));
      }
    });
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
  return ReadTextFile(path, "a path or contours", MaximumFile);
}
}
