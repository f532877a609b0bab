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
class HalfScanReconstruction
{
public:
  explicit HalfScanReconstruction(const ScannerSettings& settings);

  /// Window on the ramp at a frequency. @param frequency  share of Nyquist's, 0 to 1
  static double Window(ReconstructionKernel kernel, double frequency);

  /**
   * Parker's weight: those of a ray and of the same ray from the other side sum to one.
   * @param view    from the first of the half scan
   * @param column  of the detector
   */
  double Weight(int view, double column) const;

  /// Weights and filters a view in place, [column][row], in mm of water.
  void Filter(int view, float* values) const;

  /**
   * Back-projects filtered views onto slices.
   * @param angles   of the tube in the views, rad
   * @param views    filtered, [column][row] each
   * @param axis     a point of the axis in the central plane, mm
   * @param grid     direction identity; all of grid.extent is made
   * @param values   1 is water; [j][i][k], k fastest
   * @throws Cancelled
   */
  void BackProject(const std::vector<double>& angles, const std::vector<std::vector<float>>& views,
    const Vector3& axis, const ImageGrid& grid, float* values,
    const ProgressCallback& progress) const;

private:
  const ScannerSettings& Settings;
  double HalfFan;            ///< rad: of the half scan, at least that of the detector
  std::vector<float> Kernel; ///< by distance in columns
};
}

#endif
