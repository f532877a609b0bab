#include "TubeProjection.h"

#include "KernelChoice.h"
#include "XRayKernels.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace coronary
{
namespace
{
// Nearer to the source than this is nothing.
constexpr double MinimumDepth = 10.0;  // mm
constexpr double MinimumRadius = 1e-4; // mm
// A sharper bend than 120 degrees is cut straight at both its sides.
constexpr double MinimumCosine = 0.5;

/// The rays of an image.
struct Beam
{
  explicit Beam(const CArmGeometry& carm)
    : geometry(carm)
    , nextColumn(carm.PixelPosition(1, 0) - carm.PixelPosition(0, 0))
    , nextRow(carm.PixelPosition(0, 1) - carm.PixelPosition(0, 0))
  {
  }
  const CArmGeometry& geometry;
  Vector3 nextColumn;
  Vector3 nextRow;
};

struct Part
{
  Vector3 first;
  Vector3 last;
  Vector3 axis;
  double length;
  const TubeSection* section;
  Vector3 cut[2]; // normals
};

/// Those with a length, with their cuts.
std::vector<Part> PartsOf(
  const std::vector<Vector3>& points, const std::vector<TubeSection>& sections)
{
  std::vector<Part> parts;
  parts.reserve(sections.size());
  for (std::size_t k = 0; k < sections.size(); ++k)
  {
    const Vector3 way = points[k + 1] - points[k];
    const double length = way.norm();
    if (length > 1e-9)
    {
      const Vector3 axis = way / length;
      parts.push_back({ points[k], points[k + 1], axis, length, &sections[k], { axis, axis } });
    }
  }
  for (std::size_t k = 1; k < parts.size(); ++k)
  {
    Part& before = parts[k - 1];
    Part& after = parts[k];
    const Vector3 sum = before.axis + after.axis;
    const double cosine = 0.5 * sum.norm(); // of half the bend
    if (cosine > MinimumCosine)
    {
      before.cut[1] = after.cut[0] = sum / (2.0 * cosine * cosine);
    }
  }
  return parts;
}

/// Of f(d) = factor . d, linear in the ray d.
PixelPlane PlaneOf(const Vector3& factor, const Vector3& ray, const Beam& beam)
{
  return { static_cast<float>(factor.dot(ray)), static_cast<float>(factor.dot(beam.nextColumn)),
    static_cast<float>(factor.dot(beam.nextRow)) };
}

/// Of the three components of v x d.
void CrossPlanes(const Vector3& v, const Vector3& ray, const Beam& beam, PixelPlane* planes)
{
  for (int k = 0; k < 3; ++k)
  {
    planes[k] = PlaneOf(Vector3::Unit(k).cross(v), ray, beam);
  }
}

/// @param ray  to the pixel that offsets are counted from
TubePart KernelPart(const Part& part, const Vector3& ray, const Beam& beam, double maximumDepth)
{
  const Vector3 from = beam.geometry.Source() - part.first;
  const Vector3 moment = from.cross(part.axis);
  TubePart kernel{};
  for (int k = 0; k < 3; ++k)
  {
    kernel.ray[k] = PlaneOf(Vector3::Unit(k), ray, beam);
  }
  CrossPlanes(part.axis, ray, beam, kernel.cross);
  CrossPlanes(from, ray, beam, kernel.along);
  kernel.moment = PlaneOf(moment, ray, beam);
  for (int end = 0; end < 2; ++end)
  {
    kernel.crossCut[end] = PlaneOf(part.cut[end].cross(part.axis), ray, beam);
    kernel.rayCut[end] = PlaneOf(part.cut[end], ray, beam);
    kernel.outer[end] = static_cast<float>(std::max(MinimumRadius, part.section->outer[end]));
    kernel.inner[end] = static_cast<float>(part.section->inner[end]);
  }
  kernel.length = static_cast<float>(part.length);
  kernel.inverseLength = static_cast<float>(1.0 / part.length);
  kernel.step = std::max(std::abs(kernel.moment.b), std::abs(kernel.moment.c));
  const double pixel = std::max(beam.nextColumn.norm(), beam.nextRow.norm());
  kernel.maximumPixel =
    static_cast<float>(pixel * maximumDepth / beam.geometry.Pose().sourceToDetector);
  kernel.attenuation = static_cast<float>(part.section->attenuation);
  return kernel;
}

/// The part of an image that a tube is within: a band of pixels around its axis.
struct Band
{
  double column; ///< of its middle
  double row;
  double columnWay; ///< unit, of its axis
  double rowWay;
  double halfLength; ///< pixels
  double halfWidth;

  /// Columns [first, last] of a row.
  std::pair<double, double> ColumnsOf(double atRow) const
  {
    const double down = atRow - this->row;
    double first =
      -std::abs(this->columnWay) * this->halfLength - std::abs(this->rowWay) * this->halfWidth;
    double last = -first;
    // A line's column in this row, for both pairs of the band's sides.
    const auto narrow = [&](double way, double across, double half)
    {
      if (std::abs(across) > 1e-3)
      {
        const double centre = down * way / across;
        const double reach = half / std::abs(across);
        first = std::max(first, centre - reach);
        last = std::min(last, centre + reach);
      }
    };
    narrow(this->columnWay, this->rowWay, this->halfWidth);
    narrow(-this->rowWay, this->columnWay, this->halfLength);
    return { this->column + first, this->column + last };
  }
  double HalfHeight() const
  {
    return std::abs(this->rowWay) * this->halfLength + std::abs(this->columnWay) * this->halfWidth;
  }
};

Band BandOf(const Part& part, const Vector3& start, const Vector3& end, const Beam& beam)
{
  const double pitch = std::min(beam.nextColumn.norm(), beam.nextRow.norm());
  const double radius = std::max(part.section->outer[0], part.section->outer[1]);
  const double depth = std::max(MinimumDepth, std::min(start.z(), end.z()) - radius);
  // Off the centre a circle's shadow is an ellipse.
  const Vector3 ray =
    beam.geometry.PixelPosition(0.5 * (start.x() + end.x()), 0.5 * (start.y() + end.y())) -
    beam.geometry.Source();
  const double length = ray.norm();
  const double obliquity = length / beam.geometry.Pose().sourceToDetector;
  Band band{};
  band.column = 0.5 * (start.x() + end.x());
  band.row = 0.5 * (start.y() + end.y());
  const double across = end.x() - start.x();
  const double down = end.y() - start.y();
  const double projected = std::hypot(across, down);
  band.columnWay = projected > 1e-9 ? across / projected : 1.0;
  band.rowWay = projected > 1e-9 ? down / projected : 0.0;
  const double shadow = radius * beam.geometry.Magnification(depth) * obliquity / pitch;
  // Bevelled ends and those seen obliquely reach beyond the axis.
  const double bevel = std::max((part.cut[0] - part.axis).norm(), (part.cut[1] - part.axis).norm());
  const double tilt = std::abs(part.axis.dot(ray)) / length;
  band.halfWidth = shadow + 0.55;
  band.halfLength = 0.5 * projected + (bevel + tilt) * shadow + 0.85;
  return band;
}

/// Gives a tube's pixels to the kernel, many at a time.
class PixelCollector
{
public:
  PixelCollector(const XRayKernels& kernels, LineIntegrals& image)
    : Kernels(kernels)
    , Image(image)
  {
  }

  /// Columns [left, right] of a row; offsets count from the origin.
  void Add(const TubePart& part, int row, int left, int right, int originColumn, int originRow)
  {
    while (left <= right)
    {
      const int count = std::min(right - left + 1, TubePixels::Most - this->List.count);
      const int first = this->List.count;
      const int index = row * this->Image.columns + left;
      for (int k = 0; k < count; ++k)
      {
        this->List.i[first + k] = static_cast<float>(left - originColumn + k);
        this->List.j[first + k] = static_cast<float>(row - originRow);
        this->List.index[first + k] = index + k;
      }
      this->List.count += count;
      left += count;
      if (this->List.count == TubePixels::Most)
      {
        this->Finish(part);
      }
    }
  }

  void Finish(const TubePart& part)
  {
    this->Kernels.addTube(part, this->List, this->Image.values.data());
    this->List.count = 0;
  }

private:
  const XRayKernels& Kernels;
  LineIntegrals& Image;
  TubePixels List;
};

void AddPart(
  const Part& part, const Beam& beam, const LineIntegrals& image, PixelCollector& collector)
{
  const Vector3 start = beam.geometry.Project(part.first);
  const Vector3 end = beam.geometry.Project(part.last);
  if (start.z() < MinimumDepth || end.z() < MinimumDepth)
  {
    return;
  }
  const Band band = BandOf(part, start, end, beam);
  const double halfHeight = band.HalfHeight();
  const auto first = [](double place, int count)
  { return static_cast<int>(std::ceil(std::clamp(place, 0.0, double(count)))); };
  const auto last = [](double place, int count)
  { return static_cast<int>(std::floor(std::clamp(place, -1.0, count - 1.0))); };
  const int firstRow = first(band.row - halfHeight, image.rows);
  const int lastRow = last(band.row + halfHeight, image.rows);
  const int originColumn = std::max(0, last(band.column, image.columns));
  const int originRow = std::max(0, last(band.row, image.rows));
  const Vector3 ray = beam.geometry.PixelPosition(originColumn, originRow) - beam.geometry.Source();
  const TubePart kernel = KernelPart(part, ray, beam, std::max(start.z(), end.z()));
  for (int row = firstRow; row <= lastRow; ++row)
  {
    const auto [left, right] = band.ColumnsOf(row);
    collector.Add(
      kernel, row, first(left, image.columns), last(right, image.columns), originColumn, originRow);
  }
  collector.Finish(kernel);
}
}

void AddTubes(const std::vector<Vector3>& points, const std::vector<TubeSection>& sections,
  const CArmGeometry& geometry, LineIntegrals& image)
{
  const Beam beam(geometry);
  PixelCollector collector(XRayKernelChoice().Get(), image);
  for (const Part& part : PartsOf(points, sections))
  {
    const TubeSection& section = *part.section;
    if (section.attenuation > 0.0 && std::max(section.outer[0], section.outer[1]) > MinimumRadius)
    {
      AddPart(part, beam, image, collector);
    }
  }
}

void RequireFormat(const char* what, const CArmGeometry& geometry, const LineIntegrals& image)
{
  const DetectorFormat& format = geometry.Format();
  if (image.columns != format.columns || image.rows != format.rows ||
    image.values.size() != static_cast<std::size_t>(image.columns) * image.rows)
  {
    throw std::invalid_argument(std::string(what) + ": the image has " +
      std::to_string(image.columns) + " x " + std::to_string(image.rows) +
      " pixels, the detector " + std::to_string(format.columns) + " x " +
      std::to_string(format.rows));
  }
}

void RequireWithin(
  const char* what, const char* property, double value, double minimum, double maximum)
{
  if (!(value >= minimum && value <= maximum))
  {
    throw std::invalid_argument(std::string(what) + ": " + property + " is " +
      std::to_string(value) + "; it has to be within " + std::to_string(minimum) + " to " +
      std::to_string(maximum));
  }
}

void RequirePoints(const char* what, const std::vector<Vector3>& points)
{
  for (const Vector3& point : points)
  {
    RequireWithin(what, "a point's distance from the origin", point.norm(), 0.0, 1e6);
  }
}
}
