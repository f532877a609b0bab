/**
 * @file CoronaryPhantom.h
 * @brief A beating heart with both coronary trees, known exactly at every place and moment.
 *
 * Anatomy: control points and diameters of Dodge et al. (Circulation 1988;78:1167 and 1992;86:232)
 * on an epicardial ellipsoid. Motion: one closed-form displacement field of position and time.
 * Images: tissue values, partial volume, point spread function, temporal window and noise of a
 * cardiac CT. Nothing here uses the reconstruction code that the phantom is there to judge.
 * docs/phantom.md has the sources, and what the phantom does not model.
 *
 * Time t is the fraction of the R-R interval, any real number; the motion is periodic, t modulo 1.
 * Positions are LPS in mm, with the left coronary ostium of the reference heart at the origin.
 */
#ifndef DynamicCoronary_CoronaryPhantom_h
#define DynamicCoronary_CoronaryPhantom_h

#include "AorticModel.h"
#include "CoronaryAnatomy.h"
#include "Geometry.h"
#include "ParallelFor.h"
#include "PhantomDisease.h"
#include "VesselTree.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace coronary
{
/// A phase of the cycle in which the vessels are (partly) impossible to track.
struct LostPhase
{
  double time = 0.0;     ///< fraction of the R-R interval
  double fraction = 1.0; ///< share of the tree's length that is lost, 0 to 1; 1: everything
};

/// Everything that decides what the phantom is. Defaults give the embedded standard phantom.
struct PhantomSettings
{
  // Anatomy.
  std::uint64_t seed = 1; ///< 0: the mean anatomy without any random variation
  Dominance dominance = Dominance::Right;
  bool ramus = false;             ///< add a ramus intermedius at the left main's end
  double calibre = 1.0;           ///< factor on all diameters, 0.5 to 2
  double positionVariation = 5.0; ///< standard deviation of the course of the vessels, mm, 0 to 10
  double calibreVariation = 0.10; ///< relative standard deviation of a vessel's diameter, 0 to 0.3
  double tortuosity = 1.0;        ///< factor on the lateral waves of the vessels, 0 to 3
  int stenoses = 0;               ///< number of narrowings, placed by the seed, 0 to 20
  double stenosisDegree = 0.5;    ///< their diameter reduction, 0 to 0.99
  int calcifiedPlaques = 0;       ///< number of calcifications, placed by the seed, 0 to 50
  bool chronicOcclusion = false;  ///< close 15 mm of the mid RCA; filled from its far end on
  PhantomDisease disease;         ///< beside these three

  // Motion.
  double cycleLength = 0.8;       ///< R-R interval in seconds, 0.3 to 3
  double motionAmplitude = 1.0;   ///< factor on the whole displacement field, 0 to 1.3
  double axialMotionRight = 18.0; ///< AV-plane excursion on the RCA side, mm, 0 to 24
  double axialMotionLeft = 12.0;  ///< the same on the LCx side, mm, 0 to 24
  double regionalLag = 0.02;      ///< greatest regional lead or lag, fraction of R-R, 0 to 0.05
  double regionalAmplitude =
    0.06;                     ///< relative standard deviation of the regional amplitude, 0 to 0.1
  double beatVariation = 0.0; ///< relative amplitude change from beat to beat, 0 to 0.1;
                              ///< above 0 the motion is no longer periodic
  /// How far the whole heart lies off in the beat of each phase, mm, root mean square in 3-D, 0 to 5.
  /// Above 0 every time is a phase with a beat of its own: motion is no longer continuous.
  double beatIrregularity = 0.0;
  double areaPulse = 0.08; ///< systolic increase of the lumen area, 0 to 0.3

  // Image.
  double temporalWindow = 0.066;  ///< seconds: 0 ideal, 0.066 dual source, 0.140 single source
  double noise = 25.0;            ///< standard deviation in HU at full dose, 0 to 200
  double noiseCorrelation = 0.32; ///< standard deviation of the noise's kernel, mm, 0 to 2
  double systolicNoise = 1.5;     ///< factor on the noise where the tube current is reduced, 1 to 4
  /// Standard deviation along the image axes, mm: 0.9, 0.9, 0.8 mm as full width at half maximum.
  double pointSpread[3] = { 0.38, 0.38, 0.34 };
  double lumenHU = 420.0;            ///< at the ostia, 0 to 1500
  double attenuationGradient = -1.5; ///< change of the lumen along the vessel, HU per cm, -20 to 5
  double veinHU = 150.0;             ///< great cardiac vein (contrast-poor)
  std::vector<LostPhase> lostPhases;

  // Discretisation of the truth.
  double centerlineSpacing = 0.5; ///< mm between tree points, 0.1 to 5
  double surfaceSpacing = 0.35;   ///< edge length of the truth surface, mm, 0.15 to 1.5

  /// @throws std::invalid_argument that names the first setting out of range or not finite.
  void Validate() const;
};

/// The vessels' axes at one moment, a split tree: 0 left, 1 right. Ids, order and counts are the same at every moment,
/// and so are the abscissas: along the reference tree.
struct PhantomTree : VesselTree
{
  std::vector<Vector3> displacement; ///< mm from the reference position
  std::vector<Vector3> velocity;     ///< mm/s
  std::vector<double> visibility;    ///< 0 lost .. 1 full contrast at this moment: d / (d + blur),
                                     ///< times 0 where the phase is lost or the vessel occluded
};

/// A closed, oriented, 2-manifold triangle mesh around the lumen. One connectivity at all moments.
struct PhantomSurface
{
  std::vector<Vector3> points;       ///< mm
  std::vector<Vector3> displacement; ///< mm from the reference position
  std::vector<int> groupId;          ///< branch of the nearest axis point, per point
  std::vector<double> abscissa;      ///< of the nearest axis point, mm, per point
  std::vector<Triangle> triangles;
  std::vector<int> entityId; ///< per triangle: 1 wall, 2 and 3 the left and right ostium,
                             ///< 4.. the ends of the branches
};

struct PhantomOstium
{
  std::string name; ///< "LCA" or "RCA"
  Vector3 position; ///< mm
  Vector3 axis;     ///< unit vector into the vessel
  double radius;    ///< mm
};

/// A narrowing of a vessel: what a stenosis that was measured is compared with.
struct PhantomStenosis
{
  std::string vessel;           ///< "LAD", "LCx", "RCA", "D1", ...
  int segmentId = 0;            ///< of the narrowest place
  std::int64_t point = -1;      ///< of PhantomTree, the narrowest place
  Vector3 position;             ///< mm, of that point
  double abscissa = 0.0;        ///< mm from the ostium along the reference tree
  double length = 0.0;          ///< mm along the vessel, at half the depth of the narrowing
  double degree = 0.0;          ///< share of the diameter that is gone, 0 to 1
  double minimumRadius = 0.0;   ///< mm, that is left
  double referenceRadius = 0.0; ///< mm, without the lesion
};

/// A calcification: a ball whose part inside the lumen is not rendered.
struct PhantomPlaque
{
  std::string vessel;
  int segmentId = 0;
  std::int64_t point = -1; ///< of PhantomTree, beside the plaque
  double abscissa = 0.0;   ///< mm from the ostium along the reference tree
  Vector3 centre;          ///< mm
  double radius = 0.0;     ///< mm
  double value = 0.0;      ///< HU before blurring
};

/// What a lesion truly is: at rest, without the pulse. Volumes by sampling at 0.1 mm.
struct PhantomLesionTruth
{
  PhantomLesion lesion;       ///< as asked for
  int segmentId = 0;          ///< of `point`
  std::int64_t point = -1;    ///< of PhantomTree, where the lumen differs most from the healthy one
  double middle = 0.0;        ///< mm from the vessel's origin
  double abscissa = 0.0;      ///< of `point`, mm from the ostium
  double degree = 0.0;        ///< share of the diameter that is gone; below 0: wider; 1: occluded
  double areaDegree = 0.0;    ///< share of the area that is gone
  double minimumRadius = 0.0; ///< mm, at `point`
  double referenceRadius = 0.0; ///< mm, there, without lesions
  double wallRadius = 0.0;      ///< mm, of the outer wall there
  double fibrousVolume = 0.0;   ///< mm^3, with the rim of a core
  double lipidVolume = 0.0;     ///< mm^3
  double calciumVolume = 0.0;   ///< mm^3
  double agatston = 0.0;        ///< of the calcium alone, see docs/phantom.md
};

/// A collateral vessel at one moment.
struct PhantomCollateralTruth
{
  PhantomCollateral collateral;
  std::vector<Vector3> points; ///< mm, from the artery that it leaves
  double radius;               ///< mm, at that moment
  double value;                ///< HU
  double length;               ///< mm, at that moment
  double
    clearance; ///< mm to the wall of another artery at rest, away from its ends; below 0: runs into it
};

/// A vessel by its name.
struct PhantomVessel
{
  std::string name;
  std::string parent;                            ///< empty: an ostium
  int treeId = 0;                                ///< 0 left, 1 right, 3 a graft
  double length = 0.0;                           ///< mm
  std::vector<std::array<double, 2>> occlusions; ///< from, to, mm from its origin
  double lateFrom = -1.0;                        ///< fills late from here on, mm; -1: does not
};

enum class PhantomTissue
{
  Lung,
  Fat,
  Soft,
  Muscle,    ///< perfused
  Blood,     ///< with contrast medium
  Calcified, ///< bone, plaque
  Metal      ///< stents, leads
};

/// A piece of an artery, a plaque or a device at one moment, as rays meet it: a straight cone.
struct PhantomTube
{
  Vector3 start; ///< mm
  Vector3 end;
  double startRadius; ///< mm, across the axis
  double endRadius;
  bool round; ///< another piece ends at `start`: a ball fills the bend between them
  PhantomTissue tissue;
  double value;  ///< HU
  bool inMuscle; ///< the coat around it is muscle, else fat
};

/// Amounts of three basis materials in a tissue of so many HU.
using PhantomMaterials = std::function<std::array<float, 3>(PhantomTissue, double hounsfield)>;

/// How a vessel moves over one cycle.
struct PhantomMotionSummary
{
  std::string name;       ///< "LM", "LAD proximal", ..., "RCA", ...
  double amplitude = 0.0; ///< mean over the points of the greatest distance between two moments, mm
  double meanSpeed = 0.0; ///< mm/s
  double peakSpeed = 0.0; ///< mm/s
  double systolicRest = 0.0;   ///< ms: longest window in 20..55 % with all displacements < 1 mm
  double diastolicRest = 0.0;  ///< ms: the same in 55..95 %
  double systolicStrain = 0.0; ///< length change from t = 0 to 0.35, relative
};

/// Immutable after construction, and safe to use from several threads.
class CoronaryPhantom
{
public:
  /// @throws std::invalid_argument as PhantomSettings::Validate.
  explicit CoronaryPhantom(const PhantomSettings& settings);
  ~CoronaryPhantom();
  CoronaryPhantom(const CoronaryPhantom&) = delete;
  CoronaryPhantom& operator=(const CoronaryPhantom&) = delete;

  const PhantomSettings& Settings() const;

  /// Where the material point that rests at `reference` is at time t, mm.
  Vector3 Position(const Vector3& reference, double t) const;

  /// Its velocity within a beat, mm/s.
  Vector3 Velocity(const Vector3& reference, double t) const;

  /// The material point that is at `position` at time t, to 1e-6 mm.
  Vector3 ReferencePosition(const Vector3& position, double t) const;

  PhantomTree Tree(double t) const;

  /// The great cardiac vein beside the LAD and in the AV groove: one branch, treeId 2.
  PhantomTree Vein(double t) const;

  /// All lesions: those that settings ask for by number, those of the disease, balls of calcium.
  std::vector<PhantomLesionTruth> Lesions() const;

  std::vector<PhantomVessel> Vessels() const;

  /// They are no part of the tree, nor of the surface.
  std::vector<PhantomCollateralTruth> Collaterals(double t) const;

  std::vector<PhantomOstium> Ostia(double t) const;

  /// The aorta's wall without the mouths of the arteries: sections 1 mm apart at rest, from 14 mm below the ostia to 160 mm
  /// above, far beyond any image.
  std::vector<AorticRing> Aorta(double t) const;

  ///@{
  /// Narrowings of all kinds, and balls of calcium.
  std::vector<PhantomStenosis> Stenoses(double t) const;
  std::vector<PhantomPlaque> Plaques(double t) const;
  ///@}

  /**
   * The lumen's wall. The mesh is made once, at the first call; at time t its points are carried
   * by the motion and then put on the zero of LumenDistance(., t) to 1e-4 mm.
   * @throws Cancelled
   */
  PhantomSurface Surface(double t, const ProgressCallback& progress = {}) const;

  /**
   * The outer wall of all arteries, closed like the lumen's: around plaques, stents and occlusions,
   * and the lumen's wall elsewhere. One connectivity at all times.
   * @throws Cancelled
   */
  PhantomSurface OuterWall(double t, const ProgressCallback& progress = {}) const;

  /// Signed distance to the wall at time t in mm, negative inside; exact near the wall, bounded
  /// by +-`farAway` elsewhere.
  double LumenDistance(const Vector3& position, double t) const;
  static constexpr double farAway = 5.0;

  /**
   * The same at the centres of all voxels `part` of a grid, limited to +-`reach` mm (at most
   * `farAway`): what segmentations are compared with.
   * @param distances  room for all voxels of `part`, i fastest
   * @throws Cancelled; std::invalid_argument for a grid that is not one
   */
  void LumenDistances(const ImageGrid& grid, const std::array<int, 6>& part, double t, double reach,
    float* distances, const ProgressCallback& progress = {}) const;

  /// A grid around the whole tree over the whole cycle, with `margin` mm on every side.
  ImageGrid DefaultGrid(double spacing, double margin = 8.0) const;

  /**
   * Renders the voxels `part` of the image at time t, in HU, rounded and limited to -1024..3071.
   *
   * The values do not depend on how the image is cut into parts, nor on the number of threads.
   * @param grid    the whole image
   * @param part    inclusive index ranges inside grid.extent
   * @param values  room for all voxels of `part`, i fastest
   * @throws Cancelled; std::invalid_argument for a grid that is not one
   */
  void Render(const ImageGrid& grid, const std::array<int, 6>& part, double t, std::int16_t* values,
    const ProgressCallback& progress = {}) const;

  /// All arteries at time t, but where they are occluded, and what lesions are made of: where tubes
  /// overlap, the first of them counts.
  std::vector<PhantomTube> Tubes(double t) const;

  /**
   * Three basis materials of all tissues at time t, sharp but for the voxels' own size. In place of
   * arteries and plaques there is their coat: Tubes() and Plaques() have these exactly.
   * @param maps  [i][j][k], k fastest, over grid.extent
   * @throws Cancelled; std::invalid_argument for a grid that is not one
   */
  void RenderMaterials(const ImageGrid& grid, double t, const PhantomMaterials& materials,
    const std::array<float*, 3>& maps, const ProgressCallback& progress = {}) const;

  /// The trunk, which does not end above and below.
  struct Box
  {
    Vector3 low; ///< mm
    Vector3 high;
  };
  Box Body() const;

  /// HU of the coat of arteries in muscle, and in fat.
  static double CoatValue(bool inMuscle);

  /// Motion of each named vessel, from the tree at 200 moments.
  std::vector<PhantomMotionSummary> SummarizeMotion() const;

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
