/**
 * @file ScannerReconstruction.h
 * @brief Half-scan filtered back-projection from a circle.
 *
 * Feldkamp, Davis, Kress, J Opt Soc Am A 1984;1:612, for equal angles in the fan; weights of the half
 * scan: Parker, Med Phys 1982;9:254.
 */
#ifndef DynamicCoronary_ScannerReconstruction_h
#define DynamicCoronary_ScannerReconstruction_h

#include "ParallelFor.h"
#include "ScannerProjection.h"

namespace coronary
{
/// A view that was filtered.
struct FilteredView
{
  double angle;              ///< of the tube, rad
  double height;             ///< of the central plane, mm
  std::vector<float> values; ///< [column][row]
};

class HalfScanReconstruction
{
public:
  /// @param settings  has to live as long; its kernel does not count
  HalfScanReconstruction(const ScannerSettings& settings, ReconstructionKernel kernel);

  /// Window on the ramp at a frequency. @param frequency  share of Nyquist's, 0 to 1
  static double Window(ReconstructionKernel kernel, double frequency);

  /**
   * Parker's weight: those of a ray and of the same ray from the other side sum to one.
   * @param view    from the first of the half scan
   * @param column  of the detector
   */
  double Weight(int view, double column) const;

  /**
   * Weights and filters the middle columns of a view.
   * @param view     from the first of the half scan
   * @param share    of the view among those at its angle
   * @param values   mm of water, [column][row]
   * @param columns  first and last that are needed of the result; the others are not written
   * @param result   [column][row]
   */
  void Filter(int view, float share, const float* values, const std::array<int, 2>& columns,
    float* result) const;

  /// First and last column in whose rays a grid's slices can lie, from any angle.
  std::array<int, 2> Columns(const Vector3& axis, const ImageGrid& grid) const;

  /**
   * What noise of the views becomes in an image's axis of rotation: each result is the sum of the views'
   * cells times a weight; the squares of these weights for the columns of a view.
   * @param view  from the first of the half scan
   */
  std::vector<double> AxisWeights(int view) const;

  /**
   * Back-projects filtered views onto slices.
   * @param axis     a point of the axis, mm; its height does not count
   * @param grid     direction identity; all of grid.extent is made
   * @param values   1 is water; [j][i][k], k fastest
   * @throws Cancelled
   */
  void BackProject(const std::vector<FilteredView>& views, const Vector3& axis,
    const ImageGrid& grid, float* values, const ProgressCallback& progress) const;

private:
  const ScannerSettings& Settings;
  double HalfFan;            ///< rad: of the half scan, at least that of the detector
  std::vector<float> Kernel; ///< by distance in columns
};
}

#endif
