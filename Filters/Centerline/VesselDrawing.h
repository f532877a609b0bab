/**
 * @file VesselDrawing.h
 * @brief A vessel that a person points at: the cheapest way between places in the image, put on its axis and measured.
 */
#ifndef DynamicCoronary_VesselDrawing_h
#define DynamicCoronary_VesselDrawing_h

#include "MeasuredPath.h"
#include "TreeEdits.h"

#include <functional>
#include <memory>
#include <vector>

namespace coronary
{
class VesselDrawing
{
public:
  /// @param tree   what is known of the vessels: what bright is, and what a vesselness is worth
  /// @param scene  with an image; must outlive this, as the tree
  VesselDrawing(const VesselTree& tree, const EditScene& scene);
  ~VesselDrawing();
  VesselDrawing(const VesselDrawing&) = delete;
  VesselDrawing& operator=(const VesselDrawing&) = delete;

  bool Contains(const Vector3& place) const { return this->Paths.image->Contains(place); }

  /// The middle of what looks most like a vessel within some mm of a place; the place itself where nothing does.
  Vector3 OnVessel(const Vector3& place) const;

  /// The cheapest way, at distances below a voxel, both ends included.
  std::vector<Vector3> Way(
    const Vector3& from, const Vector3& to, const ProgressCallback& progress) const;

  /**
   * The cheapest way from some point of the tree to a place.
   * @param reach  mm around the place in which the tree is looked for
   * @param owner  the tree's point, -1: none is near enough
   */
  std::vector<Vector3> WayFromTree(
    const Vector3& to, double reach, std::int64_t& owner, const ProgressCallback& progress) const;

  /// Put on the axis and measured; radii are the image's half maxima.
  /// @param way    from the tree to the tip
  /// @param start, end  how firmly its ends are held, 0 to 1e3
  MeasuredPath Measured(const std::vector<Vector3>& way, double start, double end) const;

  /// Smooths the positions: what is not seen stays by the way that was given.
  void Smooth(MeasuredPath& path, double start, double end) const;

  /// Half maxima to true radii. @param path  its points without a section follow the others
  void CorrectRadii(MeasuredPath& path) const;

  const PathMeasurement& Measurement() const { return this->Paths; }
  double Blur() const { return this->ImageBlur; }

private:
  struct Front;
  /// A march from a place through a box around it. @param to  where it is to go, rather straight; null: anywhere
  std::unique_ptr<Front> MarchFrom(
    const Vector3& from, const Vector3* to, double margin, const ProgressCallback& progress) const;
  void MeasureLevels();
  /// Measures, and takes over the centres of sections that are clear.
  void Recentre(MeasuredPath& path, const std::function<void(MeasuredPath&)>& measure) const;
  double SpeedAt(const Vector3& world, double vesselness) const;

  const VesselTree& Tree;
  const EditScene& Scene;
  CenterlineSettings Settings;
  PathMeasurement Paths;
  double ImageBlur;
  double UsualVesselness = 0.0; ///< on the axes of the tree; 0: there is none
};
}

#endif
