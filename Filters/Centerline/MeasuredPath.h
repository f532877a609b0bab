/**
 * @file MeasuredPath.h
 * @brief Samples along one path of an extraction: put on the axis, measured, smoothed, and cut where no vessel is seen.
 */
#ifndef DynamicCoronary_MeasuredPath_h
#define DynamicCoronary_MeasuredPath_h

#include "CenterlineExtraction.h"
#include "LumenMeasurement.h"

#include <cstddef>
#include <memory>
#include <vector>

namespace coronary
{
/// Measured samples of one path, root first.
struct MeasuredPath
{
  std::vector<Vector3> points; ///< mm, world
  std::vector<double> radius;
  std::vector<double> confidence;
  std::vector<double> lumen;  ///< image value
  std::vector<double> behind; ///< image value behind the wall
  std::vector<char> crossing; ///< on a bridge

  std::size_t size() const { return points.size(); }
  void resize(std::size_t count)
  {
    points.resize(count);
    radius.resize(count);
    confidence.resize(count);
    lumen.resize(count);
    behind.resize(count);
    crossing.resize(count);
  }

  /// Puts points in the place of the samples before `first`, with its radius, and not seen at all.
  void ReplaceStart(std::size_t first, const std::vector<Vector3>& start);
};

/// What the paths of one extraction are measured in and with.
struct PathMeasurement
{
  /// @param settings  must outlive this
  /// @param grid      that is marched in; its voxels and the settings give the lengths
  PathMeasurement(const CenterlineSettings& settings, const ImageGrid& grid);

  /// Sections at all samples. @param move  whether points are put on their sections' centres
  void Measure(MeasuredPath& path, bool move) const;

  /// Beside something much darker or brighter the speed is greatest off the axis, so that no section is found from
  /// there: sections are looked for around the points of longer parts that have none.
  void Recentre(MeasuredPath& path) const;

  /// @param start, end  least weights of the ends; samples weigh as much as their confidence
  void SmoothPositions(MeasuredPath& path, double start, double end) const;

  void SmoothRadii(MeasuredPath& path) const;

  /// @param before  radii upstream, the nearest last
  /// @returns the number of samples up to where a vessel is seen, 0 if there is none
  std::size_t SeenUpTo(
    const MeasuredPath& path, double parentRadius, const std::vector<double>& before) const;

  const CenterlineSettings& settings;
  double voxel; ///< mm, edge of a cube as large as a voxel
  double step;  ///< mm between samples
  std::unique_ptr<ImageInterpolator> image;
  LumenSettings lumen;
};
}

#endif
