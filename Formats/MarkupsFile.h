/**
 * @file MarkupsFile.h
 * @brief Markups of 3D Slicer (.mrk.json): named curves and points.
 *
 * What is written follows schema 1.0.3 of Slicer's markups, in LPS and mm, for Slicer 4.13 and later. Values that each
 * control point has, such as a radius, are a measurement with `controlPointValues`, which Slicer reads and keeps,
 * and with which it can colour the curve.
 */
#ifndef DynamicCoronary_MarkupsFile_h
#define DynamicCoronary_MarkupsFile_h

#include "Geometry.h"

#include <array>
#include <string>
#include <vector>

namespace coronary
{
struct Markup
{
  struct Point
  {
    std::string label;
    std::string description;
    Vector3 position = Vector3::Zero(); ///< LPS, mm
  };

  /// One value a control point.
  struct Measurement
  {
    std::string name;
    std::string unit; ///< UCUM code, "mm"; empty: none
    std::vector<double> values;
  };

  std::string type = "Curve"; ///< Fiducial, Line, Angle, Curve, ClosedCurve, Plane, ROI
  std::string name;
  std::string description;
  std::vector<Point> points;
  std::vector<Measurement> measurements;
  std::array<double, 3> color{ 1.0, 0.5, 0.5 };
  double glyphScale = 1.0; ///< size of the points, percent of the window
  bool labels = false;     ///< of the points are shown

  /// Null: there is none.
  const Measurement* Find(const std::string& measurement) const;
};

/**
 * Reads the text of a .mrk.json file. Positions are turned into LPS millimetres: `coordinateSystem` is "LPS" (also when it is
 * missing), "RAS", or the numbers that older files have, 0 (RAS) and 1 (LPS); `coordinateUnits` is "mm" (also when it is
 * missing) or "um", as a word or as a code of three. Points without a position (`positionStatus` other than "defined") are
 * left out. Measurements without `controlPointValues`, or with others than one number a point, are left out.
 *
 * @param name  of the file, for messages
 * @throws std::runtime_error with one sentence naming `name` and the entry at fault: no JSON, no markups, another type, a
 *   position that is not three finite numbers, another system or unit
 */
std::vector<Markup> ParseMarkups(const std::string& text, const std::string& name);

/// The same of a file of at most 64 MiB.
std::vector<Markup> ReadMarkupsFile(const std::string& path);

/**
 * The text of a .mrk.json file; numbers are read back to the same bits.
 * @throws std::invalid_argument naming the markup: a position or value that is not finite, measurements that are not one a
 *   point; text that is not UTF-8
 */
std::string MarkupsText(const std::vector<Markup>& markups);

/// Whether a name ends in .mrk.json.
bool IsMarkupsFileName(const std::string& path);
}

#endif
