/**
 * @class   vtkVesselSegmentation
 * @brief   The coronary lumen as a mask: what hangs on the ostia, without aorta and chambers.
 *
 * Voxels that are as bright as blood, or less bright but tubular, are collected from the ostia on;
 * large bodies of blood and what leaks into them are cut off; then the wall is put half way between
 * the local lumen and its surroundings. See VesselSegmentation.h for the steps.
 *
 * @par Seeds:
 * The vessels begin at the points of input 2 and those of AddSeed. Without any, and with
 * AutomaticOstia on (the default), the ascending aorta and the two coronary ostia are looked for in
 * the image (see CoronaryOstia.h): for that the image must be HU, in LPS, and contrast-enhanced.
 * When the search is not sure of its result it says so in a warning and in `Confidence`.
 *
 * @par Input ports:
 * - 0: vtkImageData, three-dimensional, one component: the CT image. Array chosen with
 *   SetInputArrayToProcess(0, ...), by default, or as "Automatic", the active scalars.
 * - 1, optional: vtkImageData on the same voxels: vesselness, not negative
 *   (InputVesselnessArrayName). Without it, Frangi's with five scales from 0.5 to 2.5 mm (and
 *   not below half the largest voxel spacing) is computed here.
 * - 2, optional: vtkPolyData whose points are seeds, mm. Point data `Axis` (double[3], into the
 *   vessel), if there, says where the aorta ends.
 *
 * @par Output ports:
 * - 0, vtkImageData: point data `VesselMask` (unsigned char, 0 or 1, the scalars); if asked for
 *   `VesselProbability` (float, 0 to 1, 0.5 at the wall). Field data: that of the input, and
 *   `BloodWindow` (double, two values: tissue, blood).
 * - 1, vtkPolyData: the seeds as vertices. Point data `Name` (string: LCA, RCA, or the seed's
 *   number), `Axis` (double[3], zero: not known), `MaximumInscribedSphereRadius` (double, mm, 0:
 *   not known), `Confidence` (double, 0 to 1; 1 for given seeds), `SeedVolume` (double, mm^3 of
 *   vessel that hang on it).
 * - 2, vtkPolyData: the ascending aorta as a polyline, upwards; point data
 *   `MaximumInscribedSphereRadius` (double, mm). Empty when the seeds were given.
 * - 3, vtkPolyData: the ways across lesions as polylines, from what hangs on a seed to a piece of
 *   vessel behind it. Cell data `BridgeConfidence` (double, 0 to 1), `Length` and `BridgeUnseen`
 *   (double, mm: all of it, and what shows no tube). The mask's field data have them too
 *   (`BridgePoints`, `BridgeConfidences`, `BridgeUnseen`), for the centerlines that are made in it.
 *
 * The whole image is needed at once, so every MPI rank works on all of it and gives its piece;
 * outputs 1 to 3 are in piece 0 only. Time passes through. Same bits on any number of threads.
 *
 * @par Time:
 * Passes through from input 0: every time step is computed by itself. Put vtkReferencePhase
 * before it for what is made once for a heart.
 *
 * @par Failure:
 * A setting out of its range, a missing or multi-component array, an image of fewer than three
 * dimensions, a vesselness on another grid, a seed outside the image, no seed and no ostium found:
 * one error that names it, and no output. A given seed that is in no vessel is a warning that says
 * why. An aborted execution leaves an empty output and is started anew by the next request.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Spacing=[1.0, 1.0, 1.0], TemporalWindow=0)
 * phase = ReferencePhase(Input=phantom["Image"], Automatic=0, Time=0.75)
 * vesselness = FrangiVesselness(Input=phase, AutomaticC=0, C=100)
 * lumen = VesselSegmentation(Image=phase, Vesselness=vesselness)
 * lumen.UpdatePipeline()
 * print(lumen["Seeds"].PointData["Confidence"].GetRange())
 * @endcode
 *
 * @sa coronary::SegmentVessels, coronary::FindCoronaryOstia, vtkFrangiVesselness
 */
#ifndef vtkVesselSegmentation_h
#define vtkVesselSegmentation_h

#include "vtkCoronaryVesselnessModule.h" // for the export macro
#include "vtkImageAlgorithm.h"

#include <array>  // for std::array
#include <memory> // for std::shared_ptr
#include <string> // for std::string
#include <vector> // for std::vector

namespace coronary
{
struct CoronaryOstia;
struct ScalarImage;
struct VesselSeed;
struct VesselSegmentationResult;
struct VesselSegmentationSettings;
}

class VTKCORONARYVESSELNESS_EXPORT vtkVesselSegmentation : public vtkImageAlgorithm
{
public:
  static vtkVesselSegmentation* New();
  vtkTypeMacro(vtkVesselSegmentation, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum OutputPorts
  {
    MaskPort = 0,
    SeedsPort = 1,
    AortaPort = 2,
    BridgesPort = 3
  };

  ///@{
  /**
   * Optional vesselness and seeds, inputs 1 and 2.
   */
  void SetVesselnessConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetVesselnessData(vtkDataObject* data) { this->SetInputData(1, data); }
  void SetSeedsConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(2, output); }
  void SetSeedsData(vtkDataObject* data) { this->SetInputData(2, data); }
  ///@}

  ///@{
  /**
   * Seeds beside those of input 2, mm.
   */
  void AddSeed(double x, double y, double z);
  void SetSeed(int index, double x, double y, double z);
  void SetNumberOfSeeds(int count);
  int GetNumberOfSeeds() { return static_cast<int>(this->Seeds.size()); }
  void ClearSeeds() { this->SetNumberOfSeeds(0); }
  ///@}

  ///@{
  /**
   * Look for aorta and ostia when no seed is given. Default on.
   */
  vtkSetMacro(AutomaticOstia, bool);
  vtkGetMacro(AutomaticOstia, bool);
  vtkBooleanMacro(AutomaticOstia, bool);
  ///@}

#ifndef __VTK_WRAP__
  /// What coronary::FindCoronaryOstia found in the image, for who has it already: it is not looked for again. Null
  /// (default): it is not known.
  void SetKnownOstia(std::shared_ptr<const coronary::CoronaryOstia> ostia);
#endif

  ///@{
  /**
   * Image values of the vessels' surroundings and of undiluted blood, and whether they are measured
   * instead: in the aorta, or around the given seeds (default on). Defaults 50 and 400 HU.
   */
  vtkSetMacro(AutomaticWindow, bool);
  vtkGetMacro(AutomaticWindow, bool);
  vtkBooleanMacro(AutomaticWindow, bool);
  vtkSetMacro(TissueValue, double);
  vtkGetMacro(TissueValue, double);
  vtkSetMacro(BloodValue, double);
  vtkGetMacro(BloodValue, double);
  ///@}

  ///@{
  /**
   * Hysteresis: likelihood of vessel down to which a vessel goes on (default 0.5), and that each
   * twig must reach somewhere (default 0.8). 0 to 1, Weak at most Strong.
   */
  vtkSetMacro(WeakThreshold, double);
  vtkGetMacro(WeakThreshold, double);
  vtkSetMacro(StrongThreshold, double);
  vtkGetMacro(StrongThreshold, double);
  ///@}

  ///@{
  /**
   * Vesselness of a clear tube, 0 or more. Default 0: it is measured around the seeds.
   */
  vtkSetMacro(TubularVesselness, double);
  vtkGetMacro(TubularVesselness, double);
  ///@}

  ///@{
  /**
   * Radius in mm from which on blood counts as aorta or chamber, 1 to 50. Default 4.5.
   */
  vtkSetMacro(MaximumRadius, double);
  vtkGetMacro(MaximumRadius, double);
  ///@}

  ///@{
  /**
   * Vessels end after so many mm from their seed, positive. Default 400.
   */
  vtkSetMacro(LongestPath, double);
  vtkGetMacro(LongestPath, double);
  ///@}

  ///@{
  /**
   * Pieces below this volume in mm^3 are dropped, 0 or more. Default 2.
   */
  vtkSetMacro(MinimumIslandVolume, double);
  vtkGetMacro(MinimumIslandVolume, double);
  ///@}

  ///@{
  /**
   * Go on behind lesions: pieces of vessel that no seed reaches are linked by their ends (default on), across at most
   * LongestGap mm (default 25, 0 to 40), when the link has at least MinimumLinkConfidence (default 0.5, 0 to 1).
   */
  vtkSetMacro(CrossLesions, bool);
  vtkGetMacro(CrossLesions, bool);
  vtkBooleanMacro(CrossLesions, bool);
  vtkSetMacro(LongestGap, double);
  vtkGetMacro(LongestGap, double);
  vtkSetMacro(MinimumLinkConfidence, double);
  vtkGetMacro(MinimumLinkConfidence, double);
  ///@}

  ///@{
  /**
   * Also give the probability array. Default off.
   */
  vtkSetMacro(GenerateProbability, bool);
  vtkGetMacro(GenerateProbability, bool);
  vtkBooleanMacro(GenerateProbability, bool);
  ///@}

  ///@{
  /**
   * Point array of the vesselness at input 1. Default "Automatic", or empty: its active scalars, or
   * its first numeric array of one component.
   */
  // No SetInputArrayToProcess(1, ...): ParaView 5.11 crashes on arrays of two inputs chosen so.
  vtkSetStdStringFromCharMacro(InputVesselnessArrayName);
  vtkGetCharFromStdStringMacro(InputVesselnessArrayName);
  ///@}

protected:
  vtkVesselSegmentation();
  ~vtkVesselSegmentation() override;

  vtkExecutive* CreateDefaultExecutive() override;
  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkVesselSegmentation(const vtkVesselSegmentation&) = delete;
  void operator=(const vtkVesselSegmentation&) = delete;

  coronary::VesselSegmentationSettings MakeSettings() const;
  vtkDataArray* InputArray(vtkInformationVector** inputs, int port);
  /// Why a given seed seems to be in no vessel, for a message; empty when it does not.
  static std::string DoubtOf(const std::vector<coronary::VesselSeed>& seeds,
    const coronary::VesselSegmentationResult& result, std::size_t s);
  coronary::CoronaryOstia FindOstia(const coronary::ScalarImage& image);
  void Execute(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs);

  std::vector<std::array<double, 3>> Seeds;
  std::shared_ptr<const coronary::CoronaryOstia> KnownOstia;
  bool AutomaticOstia = true;
  bool CrossLesions = true;
  double LongestGap = 25.0;
  double MinimumLinkConfidence = 0.5;
  bool AutomaticWindow = true;
  double TissueValue = 50.0;
  double BloodValue = 400.0;
  double WeakThreshold = 0.5;
  double StrongThreshold = 0.8;
  double TubularVesselness = 0.0;
  double MaximumRadius = 4.5;
  double LongestPath = 400.0;
  double MinimumIslandVolume = 2.0;
  bool GenerateProbability = false;
  std::string InputVesselnessArrayName = "Automatic";
};

#endif
