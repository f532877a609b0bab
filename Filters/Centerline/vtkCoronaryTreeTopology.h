/**
 * @class   vtkCoronaryTreeTopology
 * @brief   Ordered trees with geometry, bifurcations and SCCT names out of any centerlines.
 *
 * The input may be branches that share their bifurcation points, whole paths from root to tip that
 * run on top of each other (VMTK's form, one line per source-target pair), pieces with gaps, twigs
 * and loops, in any mixture, direction and unit. Lines are merged where they coincide or run
 * alongside, gaps are closed, loops are found, reported and cut open, spurious twigs are removed;
 * then branches are split at the bifurcations, ordered, measured and named.
 *
 * Curvature and torsion come from a quintic smoothing spline through each vessel, whose smoothness
 * is found by cross-validation: they are usable on tracked, noisy lines. The points themselves are
 * not moved, and `Length`, `Abscissas` and `Tortuosity` are those of the polylines.
 *
 * Names follow the SCCT model (Raff et al., 2009). They come from the shape of the trees alone: the
 * trees are fitted onto a mean heart, which also gives the heart's frame. Neither the orientation
 * of the patient nor the unit is assumed, and branches may be missing. See docs/topology.md.
 *
 * @par Input ports:
 * - 0: vtkPolyData with lines; other cells are ignored. A positive point array with the radius: by
 *   default `MaximumInscribedSphereRadius`, or `Radius` where there is no such array.
 * - 1, optional: vtkPolyData whose points are the places where the trees start (ostia). Without it
 *   a tree starts where all its lines start, or at its widest end.
 *
 * @par Output ports:
 * - 0, vtkPolyData: one polyline a branch, from root to tip; the first point of a branch is the
 *   last of its parent, whose data it has. Depth first, a vessel's continuation before its side
 *   branches. Point data: that of the input, and `MaximumInscribedSphereRadius` (double, mm),
 *   `Abscissas` (double, mm along the tree from its root), `FrenetTangent`, `FrenetNormal`,
 *   `FrenetBinormal` (double[3], unit), `Curvature`, `Torsion` (double, 1/mm), `SectionArea`
 *   (double, mm^2), `SegmentIds` (int, coronary::SegmentId, 0 unnamed). Cell data: `GroupIds`
 *   (int), `ParentGroupIds` (int, -1 at a root), `TreeIds` (int: 0 left, 1 right, -1 neither;
 *   numbered 0, 1, ... when not labelled), `BranchGeneration`, `StrahlerOrder`, `SegmentIds`
 *   (int), `SegmentLabel` (string, empty unnamed), `Length` (double, mm), `Tortuosity` (double,
 *   length / chord - 1).
 * - 1, vtkPolyData: bifurcations as vertices. Point data `ParentGroupIds` (int), `DaughterGroupIds`
 *   (int[n], n at least 3, widest first, -1 none), `TreeIds`, `SegmentIds` (int, of the parent),
 *   `BifurcationAngle` (double, radians, between the two widest daughters), `DaughterAngles`
 *   (double[n], radians, between the parent's course and each daughter), `ParentRadius` (double, mm),
 *   `DaughterRadii` (double[n], mm), `AreaRatio` (double, sum of daughters over parent),
 *   `DaughterAreaRatio` (double, second over widest), `MurrayExponent` (double, x), `MurrayResidual`
 *   (double, (r_p^x - sum r_d^x) / r_p^x; Eq. 3 of the paper: x = 3), `HuoKassabResidual` (double, the
 *   same with x = 7/3), `FinetRatio` (double, r_p / (r_1 + r_2)), `FittedExponent` (double, the x
 *   without residual, NaN where there is none). In doubles[n] a missing daughter is -1.
 * - 2, vtkPolyData: the loops that were found, as closed polylines. Cell data `Length` (double, mm).
 * - 3, vtkPolyData: output 0 as VMTK's lines, as of vmtkbranchextractor: a polyline for each branch of each path from a
 *   root to a tip, on top of each other. All arrays of output 0 but `ParentGroupIds`, and cell data `CenterlineIds`,
 *   `TractIds`, `Blanking` (int).
 *
 * Field data of outputs 0, 1 and 3: that of the input, `PrunedTwigs`, `ClosedGaps` (int),
 * `LoopLengths` (double, mm), `FittedExponent` (double, over all bifurcations; no value where none
 * fits), and when labelled `Dominance` (string) and `HeartFrame` (double[16], 4x4 matrix row by row:
 * from world to heart coordinates in mm of the mean heart; first axis from the right coronary's to
 * the circumflex' side, third from base to apex, origin in the atrioventricular groove). Where the
 * check of labelled trees finds what healthy hearts do not have (an artery that ends in full
 * calibre, a wall without any), one value each of `Warnings` (string, a sentence with vessel and
 * place), `WarningVessels` (string, SCCT name), `WarningPlaces` (double[3]) and
 * `WarningConfidences` (double, 0 to 1); nothing where all is well.
 *
 * The output is whole in piece 0 and empty, with all arrays, in every other piece. Blocks of a
 * composite input are treated one by one.
 *
 * @par Time:
 * Passes through from input 0: every time step is computed by itself. Put vtkReferencePhase
 * before it for what is made once for a heart.
 *
 * @par Failure:
 * A setting out of range, a missing radius array, a radius that is not a positive number, a
 * coordinate that is not finite: one error that names it, and no output. An input without lines
 * gives an empty output. Loops are a warning. An aborted execution leaves an empty output and is
 * started anew by the next request.
 *
 * @par Sources:
 * Names: Raff et al., J Cardiovasc Comput Tomogr 2009;3:122 (SCCT). Exponents of the bifurcations: Murray 1926,
 * Huo and Kassab, Finet et al.; see docs/topology.md.
 *
 * @par Python:
 * @code{.py}
 * phantom = CoronaryPhantom(Seed=1)
 * tree = ReferencePhase(Input=phantom["Centerlines"], Automatic=0, Time=0.75)
 * named = CoronaryTreeTopology(Input=tree, Dominance="Find out")
 * named.UpdatePipeline()
 * print(named["Tree"].GetDataInformation().GetNumberOfCells(), "segments")
 * @endcode
 *
 * @sa coronary::BuildTopology, coronary::LabelSegments, docs/topology.md
 */
#ifndef vtkCoronaryTreeTopology_h
#define vtkCoronaryTreeTopology_h

#include "vtkCoronaryCenterlineModule.h" // for the export macro
#include "vtkPolyDataAlgorithm.h"

#include <string> // for std::string

class VTKCORONARYCENTERLINE_EXPORT vtkCoronaryTreeTopology : public vtkPolyDataAlgorithm
{
public:
  static vtkCoronaryTreeTopology* New();
  vtkTypeMacro(vtkCoronaryTreeTopology, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum OutputPorts
  {
    TreePort = 0,
    BifurcationPort = 1,
    LoopPort = 2,
    VmtkPort = 3
  };

  enum DominanceTypes
  {
    FindDominance = -1,
    RightDominance = 0,
    LeftDominance = 1,
    BalancedDominance = 2
  };

  ///@{
  /**
   * Optional points at which the trees start.
   */
  void SetRootConnection(vtkAlgorithmOutput* output) { this->SetInputConnection(1, output); }
  void SetRootData(vtkPolyData* roots);
  ///@}

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
   * An end of a line is joined to another piece that is nearer than this many radii, 0 to 20.
   * Default 2.
   */
  vtkSetMacro(GapRatio, double);
  vtkGetMacro(GapRatio, double);
  ///@}

  ///@{
  /**
   * A twig shorter than this many radii of the vessel that it leaves is removed, 0 to 100.
   * Default 3.
   */
  vtkSetMacro(PruneRatio, double);
  vtkGetMacro(PruneRatio, double);
  ///@}

  ///@{
  /**
   * Exponent of `MurrayResidual`, 0.5 to 10. Default 3.
   */
  vtkSetMacro(MurrayExponent, double);
  vtkGetMacro(MurrayExponent, double);
  ///@}

  ///@{
  /**
   * Wavelength that the smoothing before differentiation halves, mm, up to 1000. Negative, the default
   * (-1): found from the lines themselves.
   */
  vtkSetMacro(SmoothingWavelength, double);
  vtkGetMacro(SmoothingWavelength, double);
  ///@}

  ///@{
  /**
   * Whether the segments are named. Off for trees that are not coronary. Default on. A branch that runs
   * through two segments, because the side branch between them was not found, is cut at their border:
   * so the name of each line holds for all of it.
   */
  vtkSetMacro(LabelSegments, bool);
  vtkGetMacro(LabelSegments, bool);
  vtkBooleanMacro(LabelSegments, bool);
  ///@}

  ///@{
  /**
   * Which artery feeds the posterior wall: found out, right, left, balanced. Default found out.
   */
  vtkSetMacro(Dominance, int);
  vtkGetMacro(Dominance, int);
  ///@}

  vtkPolyData* GetBifurcations() { return this->GetOutput(BifurcationPort); }
  vtkPolyData* GetLoops() { return this->GetOutput(LoopPort); }
  vtkPolyData* GetVmtkLines() { return this->GetOutput(VmtkPort); }

protected:
  vtkCoronaryTreeTopology();
  ~vtkCoronaryTreeTopology() override = default;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestUpdateExtent(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;
  int RequestData(
    vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkCoronaryTreeTopology(const vtkCoronaryTreeTopology&) = delete;
  void operator=(const vtkCoronaryTreeTopology&) = delete;

  double GapRatio = 2.0;
  double PruneRatio = 3.0;
  double MurrayExponent = 3.0;
  double SmoothingWavelength = -1.0;
  bool LabelSegments = true;
  int Dominance = FindDominance;

  std::string InputRadiusArrayName = "Automatic";
};

#endif
