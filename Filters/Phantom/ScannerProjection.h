/**
 * @file ScannerProjection.h
 * @brief Paths of a scanner's rays through matter: exact through tubes and balls, by Joseph's method
 * through voxels.
 *
 * Source: Joseph, "An improved algorithm for reprojecting rays through pixel images", IEEE Trans Med
 * Imaging 1982;1:192.
 */
#ifndef DynamicCoronary_ScannerProjection_h
#define DynamicCoronary_ScannerProjection_h

#include "ScannerPhysics.h"

namespace coronary
{
/// Where tube and detector stand.
struct ScannerView
{
  double angle = 0.0;             ///< of the tube about the axis, from x to y, rad
  Vector3 axis = Vector3::Zero(); ///< a point of the axis in the central plane, mm
};

/// Voxels of the basis materials; the grid's direction is the identity.
struct MaterialVolume
{
  ImageGrid grid;
  std::array<std::vector<float>, BasisMaterials> maps; ///< [i][j][k], k fastest

  /// Makes room; what the maps hold is any.
  void SetGrid(const ImageGrid& where);
  /// Notes which columns of voxels have a material: to be called when the maps are filled.
  void FindColumns();

  std::array<std::vector<char>, BasisMaterials> present; ///< [i][j]
};

/// A cone, in place of what the voxels have there.
struct ScannedTube
{
  Vector3 start; ///< mm
  Vector3 end;
  double startRadius; ///< mm, across the axis
  double endRadius;
  bool round;                 ///< a ball at the start joins it to the one before
  MaterialAmounts difference; ///< from what the voxels have
};

/// A ball, but for what of it is inside tubes or balls before it.
struct ScannedBall
{
  Vector3 centre; ///< mm
  double radius;  ///< mm
  MaterialAmounts difference;
};

class ScannerProjector
{
public:
  explicit ScannerProjector(const ScannerSettings& settings)
    : Settings(settings)
  {
  }

  /// Makes all paths zero.
  void Clear(ViewPaths& paths) const;

  /// Adds voxels, one ray through the middle of each cell. Above and below the volume its outermost
  /// slices go on.
  void Add(const MaterialVolume& volume, const ScannerView& view, ViewPaths& paths) const;

  /**
   * Adds tubes and balls; a cell has the mean of 2 x 2 rays. Where tubes overlap the first counts. Tubes
   * that are thinner than 0.1 mm, such as struts, would fall between rays: the cell that one is
   * before gets all of its volume, whatever else is there.
   */
  void Add(const std::vector<ScannedTube>& tubes, const std::vector<ScannedBall>& balls,
    const ScannerView& view, ViewPaths& paths) const;

private:
  void AddThin(const ScannedTube& tube, const ScannerView& view, ViewPaths& paths) const;

  const ScannerSettings& Settings;
};
}

#endif
