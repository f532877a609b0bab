/**
 * @file MultiscaleVesselness.h
 * @brief Hessian vesselness over several scales, in millimetres, on anisotropic voxels.
 *
 * Eq. 1 and 2 of the paper (Frangi et al., MICCAI 1998), and two relatives: Sato et al., Med Image
 * Anal 1998;2:143, and Jerman et al., IEEE Trans Med Imaging 2016;35:2107.
 */
#ifndef DynamicCoronary_MultiscaleVesselness_h
#define DynamicCoronary_MultiscaleVesselness_h

#include "Geometry.h"
#include "ParallelFor.h"

namespace coronary
{
enum class VesselnessMethod : int
{
  Frangi = 0,
  Sato = 1,
  Jerman = 2
};

struct VesselnessSettings
{
  VesselnessMethod method = VesselnessMethod::Frangi;
  std::vector<double> sigmas; ///< standard deviations of the scales, mm, positive
  bool bright = true;         ///< vessels are brighter than their surroundings
  double alpha = 0.5;         ///< Frangi: plate against line; Sato: weight where lambda 1 > 0
  double beta = 0.5;          ///< Frangi: blob against line
  double c = 100.0;           ///< Frangi: Hessian norm at which structure counts, HU
  double tau = 0.75;          ///< Jerman: uniformity, 0.5 to 1
  /// Jerman: largest |lambda 3| of each scale over the sequence, HU; see Measure()
  std::vector<double> jermanMaxima;

  /// @throws std::invalid_argument that names the first setting that is out of range
  void Validate() const;
};

/// `count` scales from low to high in mm, with equal differences or equal ratios.
/// @throws std::invalid_argument unless 0 < low <= high and count > 0
std::vector<double> VesselnessScales(double low, double high, int count, bool logarithmic);

/// Part of an image in memory.
struct VoxelBlock
{
  const float* values;       ///< i fastest
  std::array<int, 6> extent; ///< inclusive
};

/// Largest response over the scales, from the eigenvalues of the Hessian times sigma squared.
class MultiscaleVesselness
{
public:
  /**
   * @param settings  see there
   * @param spacing   mm, positive
   * @param whole     extent of the whole image: beyond it the border voxels are repeated
   */
  MultiscaleVesselness(
    const VesselnessSettings& settings, const Vector3& spacing, const std::array<int, 6>& whole);

  /// How many voxels around a part its result depends on, along each axis.
  std::array<int, 3> Halo() const;

  struct Output
  {
    float* vesselness = nullptr; ///< 0 to 1 (Frangi, Jerman); Sato: HU
    float* scale = nullptr;      ///< sigma of the maximum, mm, 0 where there is none; may be null
    float* direction = nullptr;  ///< 3 values a voxel: unit axis in index directions; may be null
  };

  /**
   * Computes the voxels of `part`. The same bits however the image is cut into parts.
   *
   * Voxels that are NaN or infinite give 0 as far as the kernels of a scale reach around them.
   * Frangi's values below 1e-6 are rounding, and become 0.
   *
   * @param input   must hold `part` grown by Halo(), as far as that lies in the whole image
   * @param mask    one value for each voxel of `part`, 0: leave out (result 0); may be null. Pieces of rows outside
   *                of it are not computed
   * @throws Cancelled, and std::invalid_argument if the input lacks part of the halo
   */
  void Compute(const VoxelBlock& input, const std::array<int, 6>& part, const unsigned char* mask,
    const Output& output, const ProgressCallback& progress = {}) const;

  struct Extremes
  {
    double hessianNorm = 0.0;          ///< largest Frobenius norm of the Hessian, all scales, HU
    std::vector<double> jermanMaxima;  ///< largest |lambda 3| of each scale, HU; method Jerman only
    void Merge(const Extremes& other); ///< of two parts
  };

  /**
   * What has to be known of a whole sequence before the first voxel of it: half the largest norm of
   * the normalised Hessian is Frangi's usual c; Jerman's method needs the largest |lambda 3| where
   * it is that of a bright (or dark) structure. Voxels that are NaN or infinite do not count.
   *
   * @param mask    as in Compute()
   */
  Extremes Measure(const VoxelBlock& input, const std::array<int, 6>& part,
    const unsigned char* mask, const ProgressCallback& progress = {}) const;

private:
  template <typename Consumer>
  void ForEachRow(const VoxelBlock& input, const std::array<int, 6>& part,
    const unsigned char* mask, const Consumer& consume, const ProgressCallback& progress) const;

  VesselnessSettings Settings;
  Vector3 Spacing;
  std::array<int, 6> Whole;
  std::vector<std::array<std::vector<float>, 9>> Taps; ///< [scale][3 * axis + derivative]
};
}

#endif
