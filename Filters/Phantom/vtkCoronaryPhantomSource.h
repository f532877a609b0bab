/**
 * @class   vtkCoronaryPhantomSource
 * @brief   A beating heart with both coronary trees, as image, axes and surface at any time.
 *
 * The pipeline's side of coronary::CoronaryPhantom: CT images of a beating heart, and the exact
 * truth that belongs to them. The truth comes from closed formulas; none of the reconstruction
 * code is involved.
 *
 * Pipeline time is the fraction of the R-R interval. The source offers TIME_STEPS (the phases, by
 * default the 20 of the paper, -5 % to 106 %) and TIME_RANGE, and answers every requested time
 * exactly, also between the phases and outside their range. Without a request it gives the first
 * phase. Positions are LPS in mm; at the reference the left coronary ostium is the origin.
 *
 * Only the output that is asked for is computed: to show the surface renders no image. The image
 * is made for the requested extent alone, with the same values whatever the extent. The other
 * outputs are whole in piece 0 and empty, with all their arrays, in every other piece.
 *
 * Every output has the field data `CycleLength` (double, s) and `PhaseTime` (double, fraction of
 * the R-R interval).
 *
 * @par Output ports:
 * - 0, vtkImageData: CT image. Point data `HU` (short, Hounsfield units; the scalars).
 * - 1, vtkPolyData: centerline tree, one polyline a branch from root to tip; the first point of a
 *   branch is the last of its parent. Point data `MaximumInscribedSphereRadius` (double, mm),
 *   `Abscissas` (double, mm from the ostium along the reference tree), `SegmentIds` (int,
 *   coronary::SegmentId), `Displacement` (double[3], mm from the reference position), `Velocity`
 *   (double[3], mm/s), `Visibility` (double, 0 lost to 1 full contrast in the image). Cell data
 *   `GroupIds`, `ParentGroupIds` (-1 at a root), `TreeIds` (0 left, 1 right),
 *   `BranchGeneration` (0 at a root), `StrahlerOrder`, `SegmentIds` (all int), `SegmentLabel`
 *   (string, SCCT name), `Length` (double, mm), `Tortuosity` (double, length / chord - 1).
 * - 2, vtkPolyData: closed surface of the lumen, triangles, oriented outwards, one connectivity at
 *   all times. Point data `GroupIds` (int), `Abscissas` (double, mm), `Displacement` (double[3],
 *   mm), `Velocity` (double[3], mm/s: of the tissue there, without the pulse of the lumen). Cell
 *   data `CellEntityIds` (int: 1 wall, 2 left ostium, 3 right ostium, 4.. ends of branches).
 * - 3, vtkPolyData: ostia as vertices. Point data `Name` (string, LCA or RCA), `Axis` (double[3],
 *   unit vector into the vessel), `MaximumInscribedSphereRadius` (double, mm).
 * - 4, vtkPolyData: great cardiac vein, arrays as port 1, `TreeIds` 2.
 * - 5, type of the input: the points of the input, taken as reference positions, where they are
 *   at the time. Adds the point data `Displacement` (double[3], mm) and `Velocity` (double[3],
 *   mm/s) to what the input has. Empty vtkPolyData without an input.
 * - 6, vtkPolyData: outer wall of the arteries, arrays as port 2: around plaques, stents and
 *   occlusions, elsewhere it is the lumen's wall.
 *
 * @par Input port:
 * 0, optional, one vtkPointSet: points to be carried by the motion to output 5.
 *
 * @par Time:
 * TIME_STEPS are the phases, TIME_RANGE is from the first to the last; any time is answered exactly, also between and
 * outside of them. Without a request the first phase is given.
 *
 * @par Failure:
 * A setting out of its range or not finite is one error that names the property, and no output.
 * An aborted execution leaves an empty output and is started anew by the next request.
 *
 * @par Sources:
 * Anatomy: Dodge et al., Circulation 1988;78:1167 and 1992;86:232. Motion: Shechter et al. 2005 (PMC2396325),
 * Mao et al., J Comput Assist Tomogr 2000;24:253. More in docs/phantom.md.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Spacing=[1.5, 1.5, 1.5], MotionAmplitude=0.8)
 * phantom.UpdatePipeline(0.35)                     # a fraction of the R-R interval
 * print(phantom["Image"].PointData["HU"].GetRange())
 * print(phantom["Surface"].GetDataInformation().GetNumberOfPoints())
 * @endcode
 *
 * @sa coronary::CoronaryPhantom
 */
#ifndef vtkCoronaryPhantomSource_h
#define vtkCoronaryPhantomSource_h

#include "vtkAlgorithm.h"
#include "vtkCoronaryPhantomModule.h" // for the export macro

#include <memory> // for std::unique_ptr

namespace coronary
{
struct ImageGrid;
struct PhantomDisease;
}

class VTKCORONARYPHANTOM_EXPORT vtkCoronaryPhantomSource : public vtkAlgorithm
{
public:
  static vtkCoronaryPhantomSource* New();
  vtkTypeMacro(vtkCoronaryPhantomSource, vtkAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum OutputPorts
  {
    ImagePort = 0,
    TreePort = 1,
    SurfacePort = 2,
    OstiaPort = 3,
    VeinPort = 4,
    ProbePort = 5,
    WallPort = 6
  };

  enum DominanceTypes
  {
    RightDominance = 0,
    LeftDominance = 1,
    BalancedDominance = 2
  };

  ///@{
  /**
   * Names the individual: course, calibre and tortuosity of the vessels, regional motion, place
   * of the lesions, noise. 0 is the mean anatomy without random variation. Default 1.
   */
  void SetSeed(int seed);
  int GetSeed();
  ///@}

  ///@{
  /**
   * Which artery feeds the posterior descending and posterolateral branches: right, left, or
   * balanced (the first from the right, the second from the left). Default right.
   */
  void SetDominance(int dominance);
  int GetDominance();
  void SetDominanceToRight() { this->SetDominance(RightDominance); }
  void SetDominanceToLeft() { this->SetDominance(LeftDominance); }
  void SetDominanceToBalanced() { this->SetDominance(BalancedDominance); }
  ///@}

  ///@{
  /**
   * A ramus intermedius at the end of the left main. Default off.
   */
  void SetRamus(bool ramus);
  bool GetRamus();
  vtkBooleanMacro(Ramus, bool);
  ///@}

  ///@{
  /**
   * Factor on all vessel diameters, 0.5 to 2. Default 1.
   */
  void SetCalibre(double factor);
  double GetCalibre();
  ///@}

  ///@{
  /**
   * Standard deviation of the course of the vessels over the seeds, 0 to 10 mm. Default 5.
   */
  void SetPositionVariation(double deviation);
  double GetPositionVariation();
  ///@}

  ///@{
  /**
   * Relative standard deviation of a vessel's diameter over the seeds, 0 to 0.3. Default 0.1.
   */
  void SetCalibreVariation(double deviation);
  double GetCalibreVariation();
  ///@}

  ///@{
  /**
   * Factor on the lateral waves of the vessels, 0 to 3. Default 1.
   */
  void SetTortuosity(double factor);
  double GetTortuosity();
  ///@}

  ///@{
  /**
   * Number of narrowings, 0 to 20, and their diameter reduction, 0 to 0.99. Defaults 0 and 0.5.
   */
  void SetStenoses(int count);
  int GetStenoses();
  void SetStenosisDegree(double reduction);
  double GetStenosisDegree();
  ///@}

  ///@{
  /**
   * Number of calcifications in the walls, 0 to 50. Default 0.
   */
  void SetCalcifiedPlaques(int count);
  int GetCalcifiedPlaques();
  ///@}

  ///@{
  /**
   * Closes 15 mm of the mid right coronary artery. Default off.
   */
  void SetChronicOcclusion(bool occlusion);
  bool GetChronicOcclusion();
  vtkBooleanMacro(ChronicOcclusion, bool);
  ///@}

  ///@{
  /**
   * Disease of the arteries beside these: names of coronary::DiseasePresets(), apart by commas, or
   * any list in C++. Default none.
   */
  void SetDiseases(const char* names);
  const char* GetDiseases();
  void SetDisease(const coronary::PhantomDisease& disease);
  ///@}

  ///@{
  /**
   * R-R interval, 0.3 to 3 s. Default 0.8.
   */
  void SetCycleLength(double seconds);
  double GetCycleLength();
  ///@}

  ///@{
  /**
   * Factor on the whole displacement field, 0 to 1.3. Default 1.
   */
  void SetMotionAmplitude(double factor);
  double GetMotionAmplitude();
  ///@}

  ///@{
  /**
   * Excursion of the atrioventricular plane at the side of the right coronary and at the side of
   * the circumflex artery, 0 to 24 mm. Defaults 18 and 12.
   */
  void SetAxialMotionRight(double excursion);
  double GetAxialMotionRight();
  void SetAxialMotionLeft(double excursion);
  double GetAxialMotionLeft();
  ///@}

  ///@{
  /**
   * Greatest lead or lag of a region, 0 to 0.05 of the R-R interval (default 0.02), and relative
   * standard deviation of the regional amplitude, 0 to 0.1 (default 0.06).
   */
  void SetRegionalLag(double fraction);
  double GetRegionalLag();
  void SetRegionalAmplitude(double deviation);
  double GetRegionalAmplitude();
  ///@}

  ///@{
  /**
   * Relative change of the amplitude from beat to beat, 0 to 0.1. Above 0 the motion is no longer
   * periodic. Default 0.
   */
  void SetBeatVariation(double deviation);
  double GetBeatVariation();
  ///@}

  ///@{
  /**
   * How far the whole heart lies off in the beat of each phase, mm, root mean square in 3-D, 0 to 5.
   * Above 0 every time is a phase with a beat of its own: image and truth of one time agree, but
   * there is no motion from one time to the next. Default 0.
   */
  void SetBeatIrregularity(double distance);
  double GetBeatIrregularity();
  ///@}

  ///@{
  /**
   * Systolic increase of the lumen's area, 0 to 0.3. Default 0.08.
   */
  void SetAreaPulse(double increase);
  double GetAreaPulse();
  ///@}

  ///@{
  /**
   * Temporal window of the image in seconds: 0 ideal, 0.066 dual source, 0.140 single source CT.
   * Default 0.066.
   */
  void SetTemporalWindow(double seconds);
  double GetTemporalWindow();
  ///@}

  ///@{
  /**
   * Image noise: standard deviation at full dose, 0 to 200 HU (default 25); standard deviation of
   * the kernel that correlates it, 0 to 2 mm (default 0.32); factor where the tube current is
   * reduced in systole, 1 to 4 (default 1.5).
   */
  void SetNoise(double deviation);
  double GetNoise();
  void SetNoiseCorrelation(double length);
  double GetNoiseCorrelation();
  void SetSystolicNoise(double factor);
  double GetSystolicNoise();
  ///@}

  ///@{
  /**
   * Standard deviations of the point spread function along the image axes, mm: 0.42 times the full
   * width at half maximum. Default 0.38, 0.38, 0.34 (0.9, 0.9, 0.8 mm: medium kernel).
   */
  void SetPointSpread(double i, double j, double k);
  void SetPointSpread(const double deviations[3])
  {
    this->SetPointSpread(deviations[0], deviations[1], deviations[2]);
  }
  double* GetPointSpread() VTK_SIZEHINT(3);
  ///@}

  ///@{
  /**
   * Attenuation of the lumen at the ostia, 0 to 1500 HU (default 420), and its change along the
   * vessel, -20 to 5 HU per cm (default -1.5).
   */
  void SetLumenHU(double attenuation);
  double GetLumenHU();
  void SetAttenuationGradient(double change);
  double GetAttenuationGradient();
  ///@}

  ///@{
  /**
   * Attenuation of the great cardiac vein, HU. Default 150.
   */
  void SetVeinHU(double attenuation);
  double GetVeinHU();
  ///@}

  ///@{
  /**
   * Phases in which a share of the tree (0 to 1) can not be tracked. Default none.
   */
  void AddLostPhase(double time, double fraction);
  void ClearLostPhases();
  int GetNumberOfLostPhases();
  ///@}

  ///@{
  /**
   * Distance of the tree's points, 0.1 to 5 mm (default 0.5), and edge length of the surface,
   * 0.15 to 1.5 mm (default 0.35).
   */
  void SetCenterlineSpacing(double distance);
  double GetCenterlineSpacing();
  void SetSurfaceSpacing(double length);
  double GetSurfaceSpacing();
  ///@}

  ///@{
  /**
   * The phases that TIME_STEPS offers, in fractions of the R-R interval, strictly increasing.
   * Default: the paper's 20 phases.
   */
  void AddPhase(double time);
  void ClearPhases();
  int GetNumberOfPhases();
  double GetPhase(int index);
  ///@}

  ///@{
  /**
   * Voxel size along the image axes, mm. Default 0.8, 0.8, 0.8.
   */
  vtkSetVector3Macro(Spacing, double);
  vtkGetVector3Macro(Spacing, double);
  ///@}

  ///@{
  /**
   * World axes of i, j and k, the columns of an orthonormal matrix in row order.
   * Default the identity.
   */
  vtkSetVectorMacro(Direction, double, 9);
  vtkGetVectorMacro(Direction, double, 9);
  ///@}

  ///@{
  /**
   * Whether the image's origin and dimensions are chosen so that the whole tree fits in over the
   * whole cycle, with the given spacing and direction. Default on.
   */
  vtkSetMacro(AutomaticGrid, bool);
  vtkGetMacro(AutomaticGrid, bool);
  vtkBooleanMacro(AutomaticGrid, bool);
  ///@}

  ///@{
  /**
   * World position of voxel (0, 0, 0), mm, and number of voxels along the image axes. Both are
   * used when AutomaticGrid is off. Defaults (-100, -100, -100) and 256, 256, 256.
   */
  vtkSetVector3Macro(Origin, double);
  vtkGetVector3Macro(Origin, double);
  vtkSetVector3Macro(Dimensions, int);
  vtkGetVector3Macro(Dimensions, int);
  ///@}

  vtkTypeBool ProcessRequest(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

protected:
  vtkCoronaryPhantomSource();
  ~vtkCoronaryPhantomSource() override;

  /// One that hands blocks over as they are, so that a probe of many blocks is refused: else the
  /// other outputs would be made once a block.
  vtkExecutive* CreateDefaultExecutive() override;
  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;

private:
  vtkCoronaryPhantomSource(const vtkCoronaryPhantomSource&) = delete;
  void operator=(const vtkCoronaryPhantomSource&) = delete;

  template <typename Value>
  void Set(Value& setting, Value value);
  int RequestDataObject(vtkInformationVector** inputs, vtkInformationVector* outputs);
  int RequestInformation(vtkInformationVector* outputs);
  int RequestUpdateExtent(vtkInformation* request, vtkInformationVector** inputs);
  int RequestDataNotGenerated(vtkInformation* request, vtkInformationVector* outputs);
  int RequestData(vtkInformationVector** inputs, vtkInformationVector* outputs);
  void Generate(int port, vtkInformation* outInfo, vtkInformationVector** inputs);
  void GenerateImage(const coronary::ImageGrid& grid, vtkInformation* outInfo, double time);
  coronary::ImageGrid MakeGrid();

  double Spacing[3] = { 0.8, 0.8, 0.8 };
  double Origin[3] = { -100.0, -100.0, -100.0 };
  double Direction[9] = { 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0 };
  int Dimensions[3] = { 256, 256, 256 };
  bool AutomaticGrid = true;

  struct Internals;
  std::unique_ptr<Internals> Data;
};

#endif
