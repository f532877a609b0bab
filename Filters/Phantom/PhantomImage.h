/**
 * @file PhantomImage.h
 * @brief Cardiac CT images of the phantom.
 */
#ifndef DynamicCoronary_PhantomImage_h
#define DynamicCoronary_PhantomImage_h

#include "PhantomLumen.h"
#include "PhantomTissues.h"

namespace coronary
{
/// What something looks like in each of up to three images that are painted together.
using PhantomColour = std::array<float, 3>;

/// What the parts of the anatomy are painted with: Hounsfield units, or the amounts of materials.
struct PhantomPalette
{
  int images = 1;
  std::vector<PhantomColour> layers; ///< of Tissues::Layers
  PhantomColour background{ Tissues::Background };
  PhantomColour fat{ Fat };
  PhantomColour muscle{ Muscle };
  PhantomColour vein{};
};

/// Everything of one moment inside the temporal window.
struct PhantomMoment
{
  double t;
  Vector3 shift; ///< mm, of its beat
  double weight; ///< of all moments together: 1
  PhantomTree tree;
  PhantomTree vein;
  std::vector<Vector3> plaques;
  std::vector<Vector3> endNormals;             ///< as PhantomLumen takes them
  std::vector<std::vector<PhantomTube>> parts; ///< cones of each of the anatomy's parts
  PhantomTree wall;                            ///< outer walls; empty: they are the lumen's
};

/**
 * Renders voxels. Blurring by the point spread function and by the voxel's own size is done in
 * closed form: a wall's profile is the error function, a small vessel's the integral of a Gaussian
 * over a disc. So there is no sampling error and no filtering pass.
 */
class PhantomImage
{
public:
  PhantomImage(
    const PhantomSettings& settings, const PhantomAnatomy& anatomy, const PhantomMotion& motion);

  /// See CoronaryPhantom::Render. `lost` gives the share of contrast lost at each tree point.
  void Render(const ImageGrid& grid, const std::array<int, 6>& part, double t,
    const std::vector<PhantomMoment>& moments, const std::vector<double>& lost,
    double wholePhaseLost, std::int16_t* values, const ProgressCallback& progress) const;

  /**
   * Renders the whole grid at one moment, sharp but for the voxels' own size, without arteries and
   * plaques: where they are, there is their coat.
   * @param maps  one for each of the palette's images: [i][j][k], k fastest
   */
  void RenderMaps(const ImageGrid& grid, const PhantomMoment& moment, const PhantomPalette& palette,
    const std::array<float*, 3>& maps, const ProgressCallback& progress) const;

  /// Standard deviation of the noise at time t, HU.
  double NoiseLevel(double t, double wholePhaseLost) const;

private:
  const PhantomSettings& Settings;
  const PhantomAnatomy& Anatomy;
  const PhantomMotion& Motion;
};

/// @throws std::invalid_argument for a grid that is not one, or a part outside its extent
void RequireGrid(const ImageGrid& grid, const std::array<int, 6>& part);

/**
 * Share of a Gaussian, centred at `offset` from the middle of a disc, that lies in the disc; all in
 * units of the Gaussian's standard deviation. Exact to 4e-3.
 */
double DiscResponse(double offset, double discRadius);
}

#endif
