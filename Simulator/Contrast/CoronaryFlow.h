/**
 * @file CoronaryFlow.h
 * @brief Blood flow in the coronary arteries over the cycle: a network of resistances with a microcirculation that
 *        the heart squeezes.
 *
 * Units: pressure mmHg, flow mL/s, resistance mmHg s/mL, compliance mL/mmHg. docs/contrast.md has the equations.
 */
#ifndef DynamicCoronary_CoronaryFlow_h
#define DynamicCoronary_CoronaryFlow_h

#include "FlowNetwork.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// A narrowing that the axis' radii do not show.
struct StatedStenosis
{
  CatheterTip place;
  double diameterReduction = 0.5; ///< of the axis' diameter there, 0 to 0.95
  double length = 10.0;           ///< mm, 0.5 to 100
};

struct CoronaryFlowSettings
{
  double viscosity = 3.5;  ///< mPa s, blood at high shear, 0.5 to 20
  double density = 1060.0; ///< kg/m^3, 500 to 2000

  // Pressures (mmHg). Phase 0 is the R wave; ejection begins at `ejectionBegin`, and the aortic valve closes at
  // `systoleEnd`.
  double systolicPressure = 120.0; ///< aortic, 20 to 300
  double diastolicPressure = 80.0; ///< aortic, 10 to systolicPressure
  double venousPressure = 5.0;     ///< right atrium, -10 to 30, below diastolicPressure
  double ejectionBegin = 0.05;     ///< fraction of R-R, 0.01 to 0.15
  double systoleEnd = 0.35;        ///< fraction of R-R, 0.2 to 0.6

  /// Mean over the cycle and over the first 100 mm of the LAD (of the tree's main path if nothing is called LAD) of
  /// the speed on the vessel's axis, cm/s, 1 to 200: what a Doppler wire measures as average peak velocity, in the
  /// LAD 24.6 +- 3.5 proximal and 21.7 +- 6.9 distal. The mean over the cross-section is half of it.
  double leftAxialSpeed = 25.0;
  double rightAxialSpeed = 25.0; ///< the same of a right tree's main path

  /// Mean flow in diastole / mean flow in systole, at the same place, 0.3 to 5: 1.79 +- 0.48 in the left main,
  /// 2.1 +- 0.8 in the LAD, 1.00 +- 0.32 in the right coronary artery.
  double leftDiastolicRatio = 1.95;
  double rightDiastolicRatio = 1.0; ///< the same in a right tree

  /// Mean flow of an outlet is as its diameter to this power, 1 to 4: 3 is Murray's law; 2.27 fits what Doriot et al.
  /// (Coron Artery Dis 2000;11:495) measured at coronary bifurcations (van der Giessen et al., J Biomech 2011;44:1089).
  double outletExponent = 2.27;
  /// Of an outlet's resistance that is before its compliance, 0.05 to 0.95.
  double arterialShare = 0.6;
  double outletTime = 0.4;          ///< time constant of an outlet, s, 0.02 to 5
  double referenceHeartRate = 75.0; ///< 1/min, at which the ratios above hold, 30 to 200

  /// A narrowing by this part of the diameter is a stenosis (see CoronaryFlow), 0.05 to 0.9.
  double stenosisThreshold = 0.3;
  double stenosisNeighbourhood = 15.0; ///< mm on either side that it is compared with, 1 to 100
  std::vector<StatedStenosis> stenoses;
  std::vector<CoronarySide> sides; ///< per root, as FlowNetwork

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

///@{
/// As HeartPressures, mmHg.
double AorticPressure(const CoronaryFlowSettings& settings, double phase);
double VentricularPressure(const CoronaryFlowSettings& settings, double phase);
///@}

/**
 * Segments: laminar flow, resistance 8 eta / pi integral ds / r^4, exact for truncated cones between the axis'
 * points (Poiseuille). Stenoses: loss of the jet's kinetic energy behind the throat, K_t rho / 2 (A0 / A1 - 1)^2
 * (Q / A0)^2 with K_t = 1.52 (Young and Tsai, J Biomech 1973;6:395; Seeley and Young, J Biomech 1976;9:439). They
 * are taken to be where the radius is smaller by `stenosisThreshold` than the lesser of the greatest radii within
 * `stenosisNeighbourhood` before and behind it on its branch (so that taper is none), the narrowest place of each
 * such stretch; and where the user says so, then with the viscous loss of that paper too.
 *
 * Outlets: R1 from the tip to a compliance C against the intramyocardial pressure, R2 from there to the right atrium
 * (the family of Mantero et al., J Biomech 1992;25:1; Kim et al., Ann Biomed Eng 2010;38:3195). Intramyocardial
 * pressure is a fraction of the left ventricle's, one for each tree. Backward Euler; a step is one elimination from
 * the tips to the root.
 *
 * At construction, each tree is calibrated without its stenoses: outlet resistances to its mean axial speed, by
 * bisection of the steady flow (the mean of a periodic flow does not depend on compliances); the fraction of the
 * ventricle's pressure (0 to 1) to its diastolic ratio, in closed form from two solutions because flow is linear in
 * it. Stenoses then reduce flow; their autoregulation is not modelled.
 *
 * Injection: a source Q_inj at the tip's place. Blood that comes from above is what the tree below takes minus Q_inj
 * (the pressure at the tip rises by Q_inj times the resistance towards the ostium, which in epicardial arteries is
 * little, so that nearly all of Q_inj displaces blood); where that is negative, flow is towards the aorta (reflux).
 * Volume is conserved at every node, with or without injection.
 */
class CoronaryFlow
{
public:
  /// @throws std::invalid_argument as FlowNetwork and CoronaryFlowSettings::Validate; a stenosis of no branch
  CoronaryFlow(const WallTopology& topology, const CoronaryFlowSettings& settings);

  const FlowNetwork& Network() const { return this->Network_; }
  const CoronaryFlowSettings& Settings() const { return this->Settings_; }

  /**
   * The first step begins in the periodic flow of the reference heart rate.
   * @param dt         s, above 0
   * @param phase      any finite number, modulo 1
   * @param heartRate  1/min; 0: the heart stands still, pressures are those of the phase, and a phase that jumps
   *                   squeezes nothing
   * @param injection  mL/s, at least 0; in the aorta it changes nothing
   */
  void Step(
    double dt, double phase, double heartRate, double injection = 0.0, const CatheterTip& tip = {});

  /// mL/s away from the root, per segment: at its end, and at its beginning. They differ where the tip injects.
  const std::vector<double>& Flow() const { return this->Flow_; }
  double FlowAtBeginning(int segment) const;
  /// mL/s into a tree from the aorta.
  double TreeFlow(int tree) const;
  const std::vector<double>& Pressure() const { return this->Pressure_; } ///< mmHg, per node
  double AorticPressureNow() const { return this->Aortic; }               ///< mmHg
  /// Where contrast medium enters now; segment -1: nowhere.
  const FlowNetwork::Place& Injector() const { return this->Injector_; }
  double Injection() const { return this->Injection_; } ///< mL/s at Injector()

  /// Without the quadratic loss of its stenoses.
  double SegmentResistance(int segment) const { return this->Losses[segment].linear; }
  /// Of a tip: R1 + R2.
  double OutletResistance(int node) const { return this->OutletResistance_[node]; }
  /// Segments of the path that a tree is calibrated at, and how many mm of it.
  const std::vector<int>& ReferencePath(int tree) const { return this->Path[tree]; }
  std::size_t NumberOfStenoses() const { return this->Stenoses.size(); }

  /// All outlets' resistances of a tree times this from the next step on (> 0).
  void SetOutletFactor(int tree, double factor);

  ///@{
  /**
   * The lumen is another one from the next step on; outlets stay as they are calibrated. An occlusion that is not wider than it
   * was at rest lets nothing through. What lies in a lumen leaves an annulus:
   * r^4 of Poiseuille's law becomes (b^4 - a^4) - (b^2 - a^2)^2 / ln(b / a), b the lumen's radius, a the instrument's.
   * @param radius      mm, per point of the axes in one list
   * @param instrument  mm, likewise; 0: none
   */
  void SetLumen(const std::vector<double>& radius, const std::vector<double>& instrument);
  /// mm along a segment's branch, where an occlusion begins that lets nothing through; without one the segment's end.
  double OpenTo(int segment) const;
  /// mmHg now, at a place.
  double PressureAt(const CatheterTip& place) const;
  /// Fractional flow reserves: mean pressure at places over the aortic one in steady flow, with the outlets' resistance a
  /// quarter of what it is at rest (hyperaemia). The lumen alone decides. It takes some milliseconds.
  std::vector<double> FlowReserves(const std::vector<CatheterTip>& places) const;
  /// mL/s that tips take in steady flow at rest, per node (others: 0): with the lumen as it is, which takes some milliseconds...
  std::vector<double> TipFlows() const;
  /// ... and without lesions.
  const std::vector<double>& HealthyTipFlows() const { return this->HealthyFlow; }
  ///@}

  /// The microcirculation takes 1 / HyperaemicFlow of its resistance at rest at least (Gould, Lipscomb, Hamilton, Am J Cardiol
  /// 1974;33:87).
  static constexpr double HyperaemicFlow = 4.0;
  /// Where less than this of a tip's flow passes a lesion, even that does not bring it what it takes at rest: with a resistance
  /// R of the tip, a lesion of (1 - 1 / HyperaemicFlow) R.
  static constexpr double LeastSupply = 1.0 / (2.0 - 1.0 / HyperaemicFlow);

  ///@{
  /**
   * Holes in the wall. Blood leaves through one by conductance times pressure difference, outwards only. It is a node of its own
   * (FlowNetwork::Split), so numbers of segments behind it change.
   * @return the node, whose hole is closed  @throws as FlowNetwork::Locate
   */
  int OpenHole(const CatheterTip& place);
  /// From the next step on. @param conductance  mL/s/mmHg, at least 0; 0: closed  @param outside  mmHg
  void SetHole(int node, double conductance, double outside);
  double LeakFlow(int node) const; ///< mL/s in the last step, at least 0; 0: no hole is there
  ///@}

  /// Aortic and ventricular pressures times this from the next step on, 0 to 1: of a heart that ejects less.
  void SetPressureFactor(double factor);

  /// Over the bits of all that the next step depends on. @param before  the digest to go on from
  std::uint64_t StateHash(std::uint64_t before) const;

private:
  struct Stenosis
  {
    int segment;
    double abscissa;
    double linear;                    ///< mmHg s/mL, beyond the axis' own
    double quadratic;                 ///< mmHg s^2/mL^2
    double area = 0.0;                ///< mm^2 without it; 0: stated
    std::vector<std::int64_t> points; ///< of the axes, in one list, that it takes
  };
  /// Of a branch's axis without its stenoses, and with them.
  struct BranchResistance
  {
    std::vector<double> healthy; ///< mmHg s/mL from the branch's beginning, per axis point
    std::vector<double> actual;
  };
  /// Pressure loss along a part of a segment: linear Q + quadratic |Q| Q.
  struct Loss
  {
    double linear = 0.0;
    double quadratic = 0.0;
  };
  /// What a tip, or all that is beyond a place, takes: conductance times pressure - offset.
  struct Demand
  {
    double conductance = 0.0;
    double offset = 0.0;
  };

  struct Hole
  {
    int node = -1;
    double conductance = 0.0; ///< mL/s/mmHg
    double outside = 0.0;     ///< mmHg
    double flow = 0.0;        ///< mL/s in the last step
  };

  void FindStenoses();
  void TakeLesions();
  void MeasureBranch(std::size_t branch);
  double MeanAorticPressure() const;
  void AddStatedStenosis(const StatedStenosis& stenosis);
  void MeasureResistances();
  double ResistanceTo(int branch, double abscissa) const;
  Loss LossBetween(int segment, double from, double to) const;
  void ChooseOutletWeights();
  void ChoosePaths();
  double AxialSpeed(int tree) const;
  void CalibrateMean(int tree, double target);
  void CalibrateRatio(int tree, double target);
  double PeriodicRatioParts(int tree, double fraction, double& systole);
  int CyclesToSettle() const;
  void Settle(double phase);
  void SolveSteady(double aortic);
  CoronaryFlow InSteadyFlow(double outletFactor) const;
  void Advance(double dt, double aortic, double ventricular);
  void SolveTrees(double aortic);
  void DemandOfHoles();
  void SetInjector(double injection, const CatheterTip& tip);

  CoronaryFlowSettings Settings_;
  FlowNetwork Network_;
  std::vector<std::vector<double>> HealthyRadius; ///< mm, per branch and axis point
  std::vector<std::vector<double>> OpenRadius;    ///< mm, likewise: what blood has of the lumen now
  std::vector<std::vector<double>> Closed;        ///< mm, likewise: ClosedRadii
  std::vector<BranchResistance> AlongBranch;
  std::vector<Stenosis> Stenoses;
  std::vector<Loss> Losses; ///< per segment; the calibration's are without stenoses
  // Per node; of tips.
  std::vector<double> Weight;
  std::vector<double> OutletResistance_; ///< R1 + R2
  std::vector<double> HealthyFlow;
  std::vector<double> Compliance;
  std::vector<double> Compartment; ///< pressure at the compliance
  std::vector<Demand> Demands;     ///< of the node and all beyond it
  std::vector<Demand> AtTop;       ///< per segment, at its root-side end
  // Per tree.
  std::vector<double> Fraction;
  std::vector<double> OutletFactor;
  std::vector<std::vector<int>> Path;
  std::vector<double> PathLength;

  std::vector<double> Flow_;
  std::vector<double> Pressure_;
  FlowNetwork::Place Injector_;
  double Injection_ = 0.0;
  Loss AboveInjector;
  Loss BelowInjector;
  double Aortic = 0.0;
  double Ventricular = 0.0;
  bool Started = false;
  std::vector<Hole> Holes;
  double PressureFactor = 1.0;
};
}

#endif
