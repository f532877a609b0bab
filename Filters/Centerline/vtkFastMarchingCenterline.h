/**
 * @class   vtkFastMarchingCenterline
 * @brief   Trees of centerlines with radii out of an image, a mask or a closed surface.
 *
 * A front marches from every seed through the vessels (second-order fast marching in a narrow
 * region, on the image's own spacing and direction). All tips are found by themselves, or targets are
 * given; the fastest paths back are put on the axis of the lumen by measured cross-sections, cut
 * where no vessel is to be seen any more, and joined where a branch's axis meets its parent's.
 *
 * What can not be reached is said, by index and reason, in the field data and as a warning; a limit
 * of time or size ends the work with a message and what was found until then.
 *
 * Lengths given as 0 are automatic, and follow voxels and radii: the same data in metres give the
 * same tree in metres.
 *
 * @par Input ports:
 * - 0: vtkImageData with a speed (any measure that is greatest on the axes: vesselness) or a mask, or a
 *   vtkPolyData that is a closed surface.
 * - 1: seeds, any vtkPointSet: one point for each tree, its root. Optional where SetSeedPoint gives some.
 * - 2, optional: targets, any vtkPointSet; SetTargetPoint gives more.
 * - 3, optional: the vtkImageData in which lumens are measured (HU), on any grid. Without it the radius is
 *   that of the mask or surface, and on a speed alone a rough one.
 * - 4, optional: a vtkImageData on the voxels of input 0 whose first point array limits a speed image to
 *   where it is not 0.
 *
 * @par Output ports:
 * - 0, vtkPolyData: the trees, one polyline a branch from root to tip; the first point of a branch is the
 *   last of its parent. Point data `MaximumInscribedSphereRadius` (double, mm: of the circle with the
 *   section's mean wall distance; on masks and surfaces to their wall), `Abscissas` (double, mm from the
 *   root), `Confidence` (double, 0 a guess to 1 clearly seen), `Bridged` (unsigned char, 1: guessed on a
 *   way across a lesion that the mask's field data describe), `BridgeConfidence` (double, 0 to 1: that what
 *   is behind such ways belongs to the tree; 1 before the first), `OstiumConfidence` (double, 0 to 1: the seed's
 *   `Confidence`, else 1), `VeinProbability` (double, 0 to 1: that it, or what it hangs on, is a vein; from the image). Cell data `GroupIds`,
 *   `ParentGroupIds` (-1 at a root), `TreeIds` (index of the seed; all int), `Length` (double, mm),
 *   `Tortuosity` (double, length / chord - 1). Field data `VeinPositions` (double[3], mm), `VeinLengths`
 *   (double, mm), `VeinProbabilities` (double): what touched the trees, was taken for a vein, and left out.
 * - 1, vtkPolyData: VMTK's form: for each tip or target one line from its root for each piece between bifurcations,
 *   proximal pieces repeated. Point data as output 0; cell data `CenterlineIds`, `TractIds`,
 *   `GroupIds`, `Blanking` (all int; Blanking is 0: bifurcations are points here).
 * - 2, vtkPolyData: bifurcations as vertices. Point data `ParentGroupIds` (int), `TreeIds` (int),
 *   `DaughterGroupIds` (int, two or more components, -1: none), `MaximumInscribedSphereRadius`.
 *
 * Field data of all outputs: what the input has; `SeedStatus`, `TargetStatus` (int,
 * coronary::EndStatus), `SeedMessage`, `TargetMessage` (string, "reached" or why not), `ImageBlur` (double,
 * mm), `Complete` (unsigned char, 0 when a limit ended the work).
 *
 * The output is whole in piece 0 and empty, with all arrays, in every other piece.
 *
 * @par Time:
 * Passes through from input 0: every time step is computed by itself. Put vtkReferencePhase
 * before it for what is made once for a heart.
 *
 * @par Failure:
 * A missing array, seeds that are not there or a setting out of range is one error and no output. An
 * empty image, surface or seed list is a normal piece of a pipeline: empty outputs, no error.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Spacing=[1.0, 1.0, 1.0], TemporalWindow=0)
 * phase = ReferencePhase(Input=phantom["Image"], Automatic=0, Time=0.75)
 * vesselness = FrangiVesselness(Input=phase, AutomaticC=0, C=100)
 * lumen = VesselSegmentation(Image=phase, Vesselness=vesselness)
 * lines = FastMarchingCenterline(Input=vesselness, Seeds=lumen["Seeds"], CTImage=phase, Mask=lumen["Vessel Mask"])
 * lines.UpdatePipeline()
 * print(lines["Centerlines"].GetDataInformation().GetNumberOfCells(), "vessels")
 * @endcode
 *
 * @sa coronary::ExtractCenterlines, vtkCoronaryTreeTopology
 */
#ifndef vtkFastMarchingCenterline_h
#define vtkFastMarchingCenterline_h

#include "vtkCoronaryCenterlineModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <array>  // for std::array
#include <string> // for std::string
#include <vector> // for std::vector

class vtkImageData;

namespace coronary
{
struct CenterlineResult;
struct CenterlineSettings;
}

class VTKCORONARYCENTERLINE_EXPORT vtkFastMarchingCenterline : public vtkPolyDataAlgorithm
{
public:
  static vtkFastMarchingCenterline* New();
  vtkTypeMacro(vtkFastMarchingCenterline, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum OutputPorts
  {
    TreePort = 0,
    LinesPort = 1,
    BifurcationsPort = 2
  };

  enum ImageKinds
  {
    SpeedImage = 0,
    MaskImage = 1
  };

  ///@{
  /**
   * Connections by name: seeds (port 1), targets (port 2), the measured image (port 3), a mask (port 4).
   */
  void SetSeedConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetTargetConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }
  void SetIntensityConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(3, output); }
  void SetMaskConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(4, output); }
  ///@}

  ///@{
  /**
   * Seeds and targets beside those of the inputs 1 and 2, mm. Default none. An index that is not there is an error.
   */
  void SetSeedPoint(int index, double x, double y, double z);
  void SetNumberOfSeedPoints(int count);
  int GetNumberOfSeedPoints() { return static_cast<int>(this->SeedPoints.size()); }
  void SetTargetPoint(int index, double x, double y, double z);
  void SetNumberOfTargetPoints(int count);
  int GetNumberOfTargetPoints() { return static_cast<int>(this->TargetPoints.size()); }
  ///@}

  ///@{
  /**
   * What the image of input 0 is: a speed or a mask. Default a speed.
   */
  vtkSetClampMacro(ImageKind, int, SpeedImage, MaskImage);
  vtkGetMacro(ImageKind, int);
  ///@}

  ///@{
  /**
   * Speeds at or below are no vessel. Default 0: 2 % of the speed's 99.99th percentile; with a mask none.
   */
  vtkSetMacro(SpeedThreshold, double);
  vtkGetMacro(SpeedThreshold, double);
  ///@}

  ///@{
  /**
   * Intensities at or below are no vessel, HU. Default 0: 40 % of the way from the surroundings to the
   * lumen as they are at the seeds; with a mask none.
   */
  vtkSetMacro(IntensityThreshold, double);
  vtkGetMacro(IntensityThreshold, double);
  ///@}

  ///@{
  /**
   * The front's speed is the given one to this power, 0.5 to 6. Default 2.
   */
  vtkSetMacro(SpeedExponent, double);
  vtkGetMacro(SpeedExponent, double);
  ///@}

  ///@{
  /**
   * Whether tips are looked for also when targets are given. Default off: then only the targets.
   */
  vtkSetMacro(FindTips, bool);
  vtkGetMacro(FindTips, bool);
  vtkBooleanMacro(FindTips, bool);
  ///@}

  ///@{
  /**
   * Shorter branches are no branches, mm. Default 0: ten voxels, and one and a half radii of the parent.
   */
  vtkSetMacro(MinimumBranchLength, double);
  vtkGetMacro(MinimumBranchLength, double);
  ///@}

  ///@{
  /**
   * Confidence from which on a section speaks for a vessel, 0 to 1. Default 0.5.
   */
  vtkSetMacro(MinimumConfidence, double);
  vtkGetMacro(MinimumConfidence, double);
  ///@}

  ///@{
  /**
   * Length without a visible vessel that a branch may bridge, mm. Default 0: ten voxels.
   */
  vtkSetMacro(MaximumGap, double);
  vtkGetMacro(MaximumGap, double);
  ///@}

  ///@{
  /**
   * Greatest radius that is measured, mm. Default 0: twice the radius at the seeds, at least 3 mm and 6 voxels.
   */
  vtkSetMacro(MaximumRadius, double);
  vtkGetMacro(MaximumRadius, double);
  ///@}

  ///@{
  /**
   * How far a seed or target may lie from a vessel, mm. Default 0: three voxels or the radius at the seeds.
   */
  vtkSetMacro(SnapDistance, double);
  vtkGetMacro(SnapDistance, double);
  ///@}

  ///@{
  /**
   * Voxel size of the grid in which a surface is marched, mm. Default 0: an eighth of the mean
   * diameter, limited to 24 million voxels.
   */
  vtkSetMacro(SurfaceSpacing, double);
  vtkGetMacro(SurfaceSpacing, double);
  ///@}

  ///@{
  /**
   * The work ends, with a warning and what was found, after so many points on the ways back from
   * possible tips. It counts work, not time: the result is the same on a slow or busy machine. Default
   * 5 million; the largest trees take some hundred thousand.
   */
  vtkSetMacro(StepLimit, vtkIdType);
  vtkGetMacro(StepLimit, vtkIdType);
  ///@}

  ///@{
  /**
   * Point array of the image at input 3. Default "Automatic", or empty: its active scalars, or its
   * first numeric array of one component.
   */
  // No SetInputArrayToProcess(1, ...): ParaView 5.11 crashes on arrays of two inputs chosen so.
  vtkSetMacro(IntensityArrayName, std::string);
  vtkGetMacro(IntensityArrayName, std::string);
  ///@}

protected:
  vtkFastMarchingCenterline();
  ~vtkFastMarchingCenterline() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkFastMarchingCenterline(const vtkFastMarchingCenterline&) = delete;
  void operator=(const vtkFastMarchingCenterline&) = delete;

  using Points = std::vector<std::array<double, 3>>;
  void SetPoint(Points& points, int index, const std::array<double, 3>& point);
  void SetNumberOfPoints(Points& points, int count);

  /// @param wanted  false: only what an output without branches has
  void Execute(bool wanted, vtkInformationVector** inputs, vtkInformationVector* outputs);

  struct Source;
  coronary::CenterlineSettings ExtractionSettings() const;
  /// @param end  progress when it is done
  void ReadSurface(vtkPolyData* surface, double end, Source& source);
  void ReadImage(vtkImageData* image, vtkInformationVector** inputs, Source& source);
  void ReadIntensity(vtkImageData* measured, Source& source) const;
  coronary::CenterlineResult Extract(
    vtkInformationVector** inputs, const coronary::CenterlineSettings& settings, Source& source);

  Points SeedPoints;
  Points TargetPoints;
  int ImageKind = SpeedImage;
  double SpeedThreshold = 0.0;
  double IntensityThreshold = 0.0;
  double SpeedExponent = 2.0;
  bool FindTips = false;
  double MinimumBranchLength = 0.0;
  double MinimumConfidence = 0.5;
  double MaximumGap = 0.0;
  double MaximumRadius = 0.0;
  double SnapDistance = 0.0;
  double SurfaceSpacing = 0.0;
  vtkIdType StepLimit = 5000000;
  std::string IntensityArrayName = "Automatic";
};

#endif
