/**
 * @file vtkVesselPictures.h
 * @brief Pictures in which a tree is judged by the image it was found in: straightened views and thin slabs.
 *
 * What was not seen is drawn so: orange and dashed where a gap was bridged, grey and dashed where a radius was
 * interpolated; what was edited by hand is pink; calcium is yellow, a narrowing is written with its degree, pixels
 * outside of the image are hatched. The outer boundary, where fat shows it, is violet. None of it needs a display.
 */
#ifndef vtkVesselPictures_h
#define vtkVesselPictures_h

#include "CurvedReformat.h"
#include "VesselChains.h"
#include "vtkMarkedPicture.h"
#include "vtkRunResult.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace coronary
{
struct ViewSettings
{
  double halfWidth = 8.0;     ///< of a straightened view to each side of the axis, mm
  double thickness = 8.0;     ///< of slabs, mm
  std::vector<double> window; ///< image values that are black and white; empty: by the lumen's
};

/// Image values that are black and white.
struct GreyWindow
{
  double low = 0.0;
  double high = 1.0;
};

/// A picture, and where in it what is: docs/evaluation.md, "A run without a truth".
struct ViewPicture
{
  MarkedPicture picture;
  nlohmann::ordered_json layout;
};

/// A vessel in its pictures.
struct VesselView
{
  VesselChain chain;
  std::string name;          ///< unique among the vessels
  double bridged = 0.0;      ///< mm of it that were guessed across gaps
  double edited = 0.0;       ///< mm of it that were seen, and edited by hand
  double interpolated = 0.0; ///< mm of it whose radius was interpolated
  double narrowest = 0.0;    ///< greatest degree of a narrowing of 0.25 or more, to 1; 0: none
  std::vector<Vector3> path; ///< places of it, 1 mm apart from its beginning, without the lead-in
};

/// The vessels of a run, from the largest tree's beginning on.
std::vector<VesselView> ViewsOf(const RunResult& result);

/// From well below soft tissue to twice what the lumen has on the axes (the upper quartile), where those are Hounsfield units; else from the
/// image's least values.
GreyWindow WindowOf(const RunResult& result, const ImageInterpolator& image);

class VesselPainter
{
public:
  /// All have to outlive this.
  VesselPainter(const RunResult& result, const ImageInterpolator& image,
    const ResultLabels& calcium, const ViewSettings& settings);

  const GreyWindow& Window() const { return this->Greys; }

  /// Two straightened cuts, under them branches and millimetres, diameter, and the image's values on the axis.
  ViewPicture Straightened(const VesselView& view, const ProgressCallback& progress = {}) const;

  /// A slab that follows the vessel, seen at right angles to the plane in which it is longest.
  ViewPicture Slab(const VesselView& view, const ProgressCallback& progress = {}) const;

  /// On a curved sheet, unrolled: the vessel keeps its length and its bends.
  ViewPicture Curved(const VesselView& view, const ProgressCallback& progress = {}) const;

  /// Cross-sections 1 mm apart, those of VesselView::path, in rows; without marks: the layout has the boundaries.
  ViewPicture Sections(const VesselView& view, const ProgressCallback& progress = {}) const;

  /// Slabs side by side through all of the heart around the trees. @param direction  0 axial, 1 coronal, 2 sagittal
  ViewPicture Sheet(int direction, const ProgressCallback& progress = {}) const;

  static const char* SheetName(int direction);

private:
  struct Profile;
  Profile ProfileOf(const VesselView& view, const FramedCurve& curve) const;
  void DrawCut(MarkedPicture& picture, const GreyPicture& cut, int x, int y) const;
  void DrawWalls(MarkedPicture& picture, const Profile& profile, double step, int x, int y) const;
  void DrawOuter(MarkedPicture& picture, const VesselBoundaries& boundaries, std::size_t places,
    double angle, double step, int x, int y) const;
  VesselBoundaries BoundariesOf(
    const FramedCurve& curve, const VesselView& view, const ProgressCallback& progress) const;
  void DrawCalcium(MarkedPicture& picture, const FramedCurve& curve,
    const std::vector<Vector3>& across, int x, int y) const;
  void DrawRuler(MarkedPicture& picture, const VesselView& view, const FramedCurve& curve,
    double lead, int x, int y) const;
  void DrawDiameter(MarkedPicture& picture, const Profile& profile, int x, int y) const;
  void DrawAttenuation(MarkedPicture& picture, const GreyPicture& cut, int x, int y) const;
  void DrawTree(MarkedPicture& picture, const SlabPlane& plane, const std::vector<float>& depths,
    int x, int y, bool thin) const;
  bool Meets(const SlabPlane& plane) const;
  unsigned char Grey(float value) const;

  const RunResult& Result;
  const ImageInterpolator& Image;
  const ResultLabels& Calcium;
  const ViewSettings Settings;
  const GreyWindow Greys;
};
}

#endif
