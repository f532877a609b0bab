/**
 * @class   vtkFrenetSweepSurface
 * @brief   A closed surface of a vessel tree, with triangles for simulation, from axes and radii.
 *
 * Cross-sections in the normal plane of a moving frame (Frenet-Serret where the axis bends, least
 * twist where it does not) are swept along smooth axes; where vessels meet, the tubes are joined by
 * fillets; vessels that merely pass close never merge. The triangles have the size
 * h = MinimumEdgeLength + (MaximumEdgeLength - MinimumEdgeLength) exp(-CurvatureWeight kappa)
 * (Eq. 4 of Wang et al., arXiv 2503.02218), kappa the greatest principal curvature of the wall,
 * capped by EdgeLengthPerRadius times the local radius. Every artery is closed, 2-manifold, of
 * genus 0, oriented outwards, and no triangles cut each other. See docs/surface.md.
 *
 * @par Input port 0:
 * vtkPolyData with one polyline a branch, in the direction of flow, that share a point where they
 * meet (as of vtkCoronaryTreeTopology); points of the same position count as one; other cells are
 * ignored. Point data: a positive radius in mm, by default `MaximumInscribedSphereRadius`, or
 * `Radius` where there is no such array. Optional: contours of cross-sections that are not round,
 * ContourArrayName, with as many components as directions (at least 6): radii in mm in equal steps
 * of the angle from `FrenetNormal` (double[3]) towards tangent x normal;
 * EndNormalArrayName (3 components), normals of the planes that cut the free ends, at most 60
 * degrees off the axis, zero for across the axis. Cell data, optional: `GroupIds` (else the number
 * of the line), `SegmentIds`, `SegmentLabel`.
 *
 * @par Input port 1, optional:
 * vtkImageData in which the vessels are brighter than what is around them; InputImageArrayName is a
 * point array of one component. The cross-sections get the shape that rays find in it, and keep
 * their size (coronary::MeasureContours); it takes the place of ContourArrayName.
 *
 * @par Output ports:
 * - 0, vtkPolyData: the surface, triangles. Point data `GroupIds` (int), `Abscissas` (double, mm
 *   from the root along the axes), `MaximumInscribedSphereRadius` (double, mm, of the vessel),
 *   `WallCurvature` (double, kappa, 1/mm), `EdgeLength` (double, h, mm), `Normals` (double[3], the
 *   active normals, unit, outwards). Cell data `CellEntityIds` (int: 1 wall, 2.. caps, inlets first),
 *   `GroupIds` (int), and what the input has of
 *   `SegmentIds` (int) and `SegmentLabel` (string). Field data: that of the input. Only where the
 *   tree could not be swept as it is, point data `Repaired` (uchar, 1 where triangles were
 *   replaced) and field data, one value a change: `Repairs` (string), `RepairVessels` (string),
 *   `RepairPlaces` (double[3], mm); one a branch that is missing: `LeftOut` (string, why),
 *   `LeftOutVessels` (string), `LeftOutPlaces` (double[3], mm, where it begins to be missing),
 *   `LeftOutLengths` (double, mm); and `LeftOutPoints` (idtype, the input's points that are on no
 *   branch of the surface).
 * - 1, vtkMultiBlockDataSet: a vtkStructuredGrid for each branch, the tube alone, whatever joins
 *   it: PatchSamples + 1 points around (the first once more as the last), patches along it in the
 *   second direction. Block names: `SegmentLabel`, or "Group n". Point data `Abscissas`,
 *   `MaximumInscribedSphereRadius` (double, mm), `PatchCentre` (double[3], mm), `FrenetTangent`,
 *   `FrenetNormal`, `FrenetBinormal` (double[3], unit), `Curvature`, `Torsion` (double, 1/mm),
 *   `FrameTwist` (double, 1/mm, of the frame against least twist), the same for all points of a
 *   patch. Field data `GroupIds` (int).
 * - 2, vtkPolyData: the inlets and outlets as vertices, in the order of their ids, also when they
 *   are open. Point data `CellEntityIds`, `GroupIds` (int), `CapNormal` (double[3], unit,
 *   outwards), `MaximumInscribedSphereRadius` (double, mm), `IsInlet` (int, 0 or 1), `SegmentLabel`
 *   (string).
 *
 * The output is whole in piece 0 and empty, with all arrays, in every other piece. Blocks of a
 * composite input are treated one by one.
 *
 * @par Time:
 * Passes through from input 0: every time step is computed by itself. Two steps have
 * different triangles; for one topology move one surface with vtkSkinDeformation.
 *
 * @par Failure:
 * A setting out of range, a missing array, a radius that is not positive, a branch without length:
 * one error that names it, and no output. Input without lines gives an empty output. What can not
 * be swept as it is stays local: a branch too short to leave its parent is lengthened or left out;
 * an end that folds over its cap is laid straight or limited in slope; where triangles stay
 * bad they are replaced; a branch that forms a loop, runs through another one without joining, or can
 * not be meshed at all is left out from there on. A warning names vessel, place and remedy, and what
 * comes out has always passed the tetrahedral mesher's check. Only when nothing is left there is an
 * error. An aborted execution leaves an empty output and is started anew by the next request.
 *
 * @par Sources:
 * Eq. 4 of Wang et al., arXiv 2503.02218, for the size of the triangles.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1)
 * tree = ReferencePhase(Input=phantom["Centerlines"], Automatic=0, Time=0.75)
 * wall = FrenetSweepSurface(Input=tree, MinimumEdgeLength=0.4, MaximumEdgeLength=1.0)
 * wall.UpdatePipeline()
 * print(wall["Surface"].GetDataInformation().GetNumberOfCells(), "triangles")
 * @endcode
 *
 * @sa coronary::SweepVesselTree, vtkCoronaryTreeTopology, docs/surface.md
 */
#ifndef vtkFrenetSweepSurface_h
#define vtkFrenetSweepSurface_h

#include "vtkCoronarySurfaceModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <string> // for std::string

class vtkMultiBlockDataSet;

class VTKCORONARYSURFACE_EXPORT vtkFrenetSweepSurface : public vtkPolyDataAlgorithm
{
public:
  static vtkFrenetSweepSurface* New();
  vtkTypeMacro(vtkFrenetSweepSurface, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum OutputPorts
  {
    SurfacePort = 0,
    PatchPort = 1,
    CapPort = 2
  };

  enum FrameTypes
  {
    BlendedFrame = 0,
    RotationMinimisingFrame = 1
  };

  ///@{
  /**
   * Name of the input's point array with the radius. `Automatic`, the default:
   * `MaximumInscribedSphereRadius`, or `Radius` where there is no such array.
   */
  vtkSetStdStringFromCharMacro(InputRadiusArrayName);
  vtkGetCharFromStdStringMacro(InputRadiusArrayName);
  ///@}

  ///@{
  /**
   * Name of the input's point array with contours; empty or `None`, the default: round.
   */
  vtkSetStdStringFromCharMacro(ContourArrayName);
  vtkGetCharFromStdStringMacro(ContourArrayName);
  ///@}

  ///@{
  /**
   * Name of the input's point array with the normals of the planes that cut the free ends; empty or
   * `None`, the default: across the axis.
   */
  vtkSetStdStringFromCharMacro(EndNormalArrayName);
  vtkGetCharFromStdStringMacro(EndNormalArrayName);
  ///@}

  ///@{
  /**
   * Name of the image's point array from which contours are measured. `Automatic`, the default: its
   * active scalars, or its first numeric array of one component.
   */
  vtkSetStdStringFromCharMacro(InputImageArrayName);
  vtkGetCharFromStdStringMacro(InputImageArrayName);
  ///@}

  ///@{
  /**
   * The image from which contours are measured, port 1; optional.
   */
  void SetImageConnection(vtkAlgorithmOutput* image);
  void SetImageData(vtkDataObject* image);
  ///@}

  ///@{
  /**
   * h_min of Eq. 4, mm, positive. Default 0.15.
   */
  vtkSetMacro(MinimumEdgeLength, double);
  vtkGetMacro(MinimumEdgeLength, double);
  ///@}

  ///@{
  /**
   * h_max of Eq. 4, mm, at least MinimumEdgeLength. Default 0.7.
   */
  vtkSetMacro(MaximumEdgeLength, double);
  vtkGetMacro(MaximumEdgeLength, double);
  ///@}

  ///@{
  /**
   * alpha of Eq. 4, mm, at least 0. Default 1.
   */
  vtkSetMacro(CurvatureWeight, double);
  vtkGetMacro(CurvatureWeight, double);
  ///@}

  ///@{
  /**
   * Longest edge in local radii, 0.1 to 0.7. Default 0.5.
   */
  vtkSetMacro(EdgeLengthPerRadius, double);
  vtkGetMacro(EdgeLengthPerRadius, double);
  ///@}

  ///@{
  /**
   * Where the wall is more bent than the vessel is thin, the bend's own radius takes the place of the vessel's; but at least
   * this share of it, 0.05 to 1. Default 0.12.
   */
  vtkSetMacro(SharpestBend, double);
  vtkGetMacro(SharpestBend, double);
  ///@}

  ///@{
  /**
   * Radius of the fillets between vessels in radii of the smaller one, 0.1 to 1. Default 0.5.
   */
  vtkSetMacro(Blending, double);
  vtkGetMacro(Blending, double);
  ///@}

  ///@{
  /**
   * Waves of the axes shorter than this many radii are noise, 0 to 4. Default 0.5.
   */
  vtkSetMacro(Smoothing, double);
  vtkGetMacro(Smoothing, double);
  ///@}

  ///@{
  /**
   * Whether inlets and outlets are closed by flat caps. Default on.
   */
  vtkSetMacro(Capping, bool);
  vtkGetMacro(Capping, bool);
  vtkBooleanMacro(Capping, bool);
  ///@}

  ///@{
  /**
   * How normal and binormal of the cross-sections are chosen. Default BlendedFrame.
   */
  vtkSetMacro(Frame, int);
  vtkGetMacro(Frame, int);
  ///@}

  ///@{
  /**
   * Points around each structured patch, 6 to 360. Default 24.
   */
  vtkSetMacro(PatchSamples, int);
  vtkGetMacro(PatchSamples, int);
  ///@}

  ///@{
  /**
   * Distance of the structured patches along a branch in local radii, 0.1 to 4. Default 0.5.
   */
  vtkSetMacro(PatchSpacing, double);
  vtkGetMacro(PatchSpacing, double);
  ///@}

  vtkMultiBlockDataSet* GetPatches();
  vtkPolyData* GetCaps() { return this->GetOutput(CapPort); }

protected:
  vtkFrenetSweepSurface();
  ~vtkFrenetSweepSurface() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int FillOutputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkFrenetSweepSurface(const vtkFrenetSweepSurface&) = delete;
  void operator=(const vtkFrenetSweepSurface&) = delete;

  double MinimumEdgeLength = 0.15;
  double MaximumEdgeLength = 0.7;
  double CurvatureWeight = 1.0;
  double EdgeLengthPerRadius = 0.5;
  double SharpestBend = 0.12;
  double Blending = 0.5;
  double Smoothing = 0.5;
  bool Capping = true;
  int Frame = BlendedFrame;
  int PatchSamples = 24;
  double PatchSpacing = 0.5;

  std::string InputRadiusArrayName = "Automatic";
  std::string ContourArrayName = "None";
  std::string EndNormalArrayName = "None";
  std::string InputImageArrayName = "Automatic";

  class Reader;
  class Writer;
  void MeasureContoursIn(vtkInformationVector* images, Reader& reader);
};

#endif
