/**
 * @class   vtkFrangiVesselness
 * @brief   How much each voxel of an image looks like a vessel, over several vessel sizes.
 *
 * Eq. 1 and 2 of the paper (Frangi et al., MICCAI 1998): eigenvalues |l1| <= |l2| <= |l3| of the
 * Hessian at scale sigma, times sigma squared, give
 * (1 - exp(-Ra^2 / 2 Alpha^2)) exp(-Rb^2 / 2 Beta^2) (1 - exp(-S^2 / 2 C^2)) with Ra = |l2| / |l3|,
 * Rb = |l1| / sqrt(|l2 l3|), S the norm; 0 where l2 or l3 has the wrong sign. The result is the
 * maximum over the scales. Two other measures of the same Hessian: Sato et al., Med Image Anal
 * 1998;2:143, and Jerman et al., IEEE Trans Med Imaging 2016;35:2107 (fuller at bifurcations).
 * Derivatives are in mm; spacing may differ along the axes, and direction matrices are honoured.
 *
 * The filter streams: of its input it asks for the requested extent and a halo of 5 times
 * SigmaMax, as far as the image goes; beyond the border the border voxels are repeated. The result
 * has the same bits however the image is cut into extents or pieces, and on any number of threads.
 *
 * @par The automatic C:
 * Half the largest norm of the Hessian (Frangi's proposal; Jerman's method needs the largest |l3|
 * in the same way). It is measured once, over the whole image (within Region and mask, if given)
 * at the reference time, by asking the input for it, if need be in slabs of at most
 * MeasurementBlockSize voxels. The value serves every time, extent and piece, until the input
 * pipeline or a property that matters for it changes: so the response does not jump from phase to
 * phase. With several MPI ranks every rank measures the whole image, which needs no communication.
 *
 * @par Input ports:
 * - 0: vtkImageData, three-dimensional. Any numeric point array of one component: that chosen with
 *   SetInputArrayToProcess(0, ...), by default, or as "Automatic", the active scalars (HU). Computed in float. Voxels
 *   that are NaN or infinite give 0 as far as the kernels reach around them.
 * - 1, optional: vtkImageData on the same grid; result 0 where its scalars
 *   (MaskArrayName) are 0 or NaN.
 *
 * @par Output:
 * vtkImageData, grid and extent as the input. It carries the result alone, not the image: that
 * needs no second copy of the voxels. Point data `Vesselness` (float, the scalars, 0 to 1; Sato:
 * HU); if asked for, `VesselScale` (float, mm, sigma of the maximum, 0 where there is none) and
 * `VesselDirection` (float[3], unit axis of the vessel in world coordinates, either sense, 0 where
 * there is none). Field data: that of the input, `VesselnessSigmas` (double, mm), and
 * `VesselnessC` (double, HU, method Frangi) or `VesselnessLambda3` (double, HU, one value a scale,
 * method Jerman).
 *
 * @par Time:
 * Passes through from input 0. The automatic C is measured at one time and serves all.
 *
 * @par Failure:
 * A setting out of its range, a missing, non-numeric or multi-component array, an image of fewer
 * than three dimensions, a mask on another grid: one error that names it, and no output. A SigmaMin
 * below half the largest voxel spacing is a warning. An aborted execution leaves an empty output
 * and is started anew by the next request.
 *
 * @par Sources:
 * Frangi et al., MICCAI 1998, LNCS 1496:130. Sato et al., Med Image Anal 1998;2:143. Jerman et al., IEEE
 * Trans Med Imaging 2016;35:2107.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1, Spacing=[1.0, 1.0, 1.0], TemporalWindow=0)
 * phase = ReferencePhase(Input=phantom["Image"], Automatic=0, Time=0.75)
 * vesselness = FrangiVesselness(Input=phase, SigmaMin=0.5, SigmaMax=2.0, AutomaticC=0, C=100)
 * vesselness.UpdatePipeline()
 * print(vesselness.PointData["Vesselness"].GetRange())
 * @endcode
 *
 * @sa coronary::MultiscaleVesselness, docs/vesselness.md
 */
#ifndef vtkFrangiVesselness_h
#define vtkFrangiVesselness_h

#include "vtkCoronaryVesselnessModule.h" // for the export macro
#include "vtkImageAlgorithm.h"

#include <memory> // for std::unique_ptr
#include <string> // for std::string

class VTKCORONARYVESSELNESS_EXPORT vtkFrangiVesselness : public vtkImageAlgorithm
{
public:
  static vtkFrangiVesselness* New();
  vtkTypeMacro(vtkFrangiVesselness, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum Methods
  {
    Frangi = 0,
    Sato = 1,
    Jerman = 2
  };

  enum Spacings
  {
    Linear = 0,
    Logarithmic = 1
  };

  ///@{
  /**
   * Optional mask: the vesselness is computed where it is not 0.
   */
  void SetMaskConnection(vtkAlgorithmOutput* mask) { this->SetInputConnection(1, mask); }
  void SetMaskData(vtkDataObject* mask) { this->SetInputData(1, mask); }
  ///@}

  ///@{
  /**
   * Point array of the mask. Default "Automatic", or empty: the active scalars, or its first numeric
   * array of one component.
   */
  // No SetInputArrayToProcess(1, ...): ParaView 5.11 crashes on arrays of two inputs chosen so.
  vtkSetStdStringFromCharMacro(MaskArrayName);
  vtkGetCharFromStdStringMacro(MaskArrayName);
  ///@}

  ///@{
  /**
   * Smallest and largest scale, the standard deviation of the Gaussian in mm. A vessel of radius R
   * answers most at R / sqrt(2). Defaults 0.5 and 2.5.
   */
  vtkSetMacro(SigmaMin, double);
  vtkGetMacro(SigmaMin, double);
  vtkSetMacro(SigmaMax, double);
  vtkGetMacro(SigmaMax, double);
  ///@}

  ///@{
  /**
   * Number of scales from SigmaMin to SigmaMax, 1 to 100, 1 takes SigmaMin alone (default 5), and
   * whether they have equal differences or equal ratios (default linear).
   */
  vtkSetMacro(NumberOfScales, int);
  vtkGetMacro(NumberOfScales, int);
  vtkSetMacro(ScaleSpacing, int);
  vtkGetMacro(ScaleSpacing, int);
  void SetScaleSpacingToLinear() { this->SetScaleSpacing(Linear); }
  void SetScaleSpacingToLogarithmic() { this->SetScaleSpacing(Logarithmic); }
  ///@}

  ///@{
  /**
   * The measure. Default Frangi.
   */
  vtkSetMacro(Method, int);
  vtkGetMacro(Method, int);
  void SetMethodToFrangi() { this->SetMethod(Frangi); }
  void SetMethodToSato() { this->SetMethod(Sato); }
  void SetMethodToJerman() { this->SetMethod(Jerman); }
  ///@}

  ///@{
  /**
   * Frangi: sensitivity to plates; smaller values admit flatter structures. Sato: weight where
   * the curvature along the vessel is positive. Positive. Default 0.5.
   */
  vtkSetMacro(Alpha, double);
  vtkGetMacro(Alpha, double);
  ///@}

  ///@{
  /**
   * Frangi: sensitivity to blobs; larger values admit shorter structures. Positive. Default 0.5.
   */
  vtkSetMacro(Beta, double);
  vtkGetMacro(Beta, double);
  ///@}

  ///@{
  /**
   * Frangi: norm of the Hessian from which on structure counts, HU, positive (default 100), and
   * whether it is measured instead (default on).
   */
  vtkSetMacro(AutomaticC, bool);
  vtkGetMacro(AutomaticC, bool);
  vtkBooleanMacro(AutomaticC, bool);
  vtkSetMacro(C, double);
  vtkGetMacro(C, double);
  ///@}

  ///@{
  /**
   * Time at which the automatic C is measured: the first one of the input (default on), or the
   * step that is nearest to ReferenceTime (default 0). Without meaning for an input without time.
   */
  vtkSetMacro(AutomaticReferenceTime, bool);
  vtkGetMacro(AutomaticReferenceTime, bool);
  vtkBooleanMacro(AutomaticReferenceTime, bool);
  vtkSetMacro(ReferenceTime, double);
  vtkGetMacro(ReferenceTime, double);
  ///@}

  ///@{
  /**
   * The input is asked for at most so many voxels at once when C is measured, but always for one
   * slice and its halo. Default 2^26.
   */
  vtkSetMacro(MeasurementBlockSize, vtkIdType);
  vtkGetMacro(MeasurementBlockSize, vtkIdType);
  ///@}

  /**
   * The c of the last execution, HU: measured or given; 0 before the first one, for the other
   * methods, and for an image without any structure.
   */
  double GetUsedC() const { return this->UsedC; }

  ///@{
  /**
   * Jerman: weak structure counts as if it had this share of the strongest, 0.5 to 1. Default 0.75.
   */
  vtkSetMacro(Tau, double);
  vtkGetMacro(Tau, double);
  ///@}

  ///@{
  /**
   * Whether vessels are brighter than what surrounds them. Default on.
   */
  vtkSetMacro(Bright, bool);
  vtkGetMacro(Bright, bool);
  vtkBooleanMacro(Bright, bool);
  ///@}

  ///@{
  /**
   * Further output arrays. Default off.
   */
  vtkSetMacro(GenerateScale, bool);
  vtkGetMacro(GenerateScale, bool);
  vtkBooleanMacro(GenerateScale, bool);
  vtkSetMacro(GenerateDirection, bool);
  vtkGetMacro(GenerateDirection, bool);
  vtkBooleanMacro(GenerateDirection, bool);
  ///@}

  ///@{
  /**
   * Compute only inside an extent of the image, in voxel indices, inclusive; 0 outside. The image
   * around it still counts. Default off.
   */
  vtkSetMacro(UseRegion, bool);
  vtkGetMacro(UseRegion, bool);
  vtkBooleanMacro(UseRegion, bool);
  vtkSetVector6Macro(Region, int);
  vtkGetVector6Macro(Region, int);
  ///@}

protected:
  vtkFrangiVesselness();
  ~vtkFrangiVesselness() override;

  /// One that hands composite data over as they are, so that they are refused: C belongs to one
  /// image.
  vtkExecutive* CreateDefaultExecutive() override;
  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkFrangiVesselness(const vtkFrangiVesselness&) = delete;
  void operator=(const vtkFrangiVesselness&) = delete;

  double SigmaMin = 0.5;
  double SigmaMax = 2.5;
  int NumberOfScales = 5;
  int ScaleSpacing = Linear;
  int Method = Frangi;
  double Alpha = 0.5;
  double Beta = 0.5;
  bool AutomaticC = true;
  double C = 100.0;
  bool AutomaticReferenceTime = true;
  double ReferenceTime = 0.0;
  vtkIdType MeasurementBlockSize = vtkIdType{ 1 } << 26;
  double Tau = 0.75;
  bool Bright = true;
  bool GenerateScale = false;
  bool GenerateDirection = false;
  bool UseRegion = false;
  int Region[6] = { 0, 0, 0, 0, 0, 0 };
  std::string MaskArrayName = "Automatic";
  double UsedC = 0.0;

  struct Internals;
  std::unique_ptr<Internals> Data;
};

#endif
