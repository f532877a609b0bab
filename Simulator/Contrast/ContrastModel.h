/**
 * @file ContrastModel.h
 * @brief Contrast medium in the coronary arteries: injected at a catheter's tip, carried by the blood.
 */
#ifndef DynamicCoronary_ContrastModel_h
#define DynamicCoronary_ContrastModel_h

#include "AorticContrast.h"
#include "ContrastTracers.h"
#include "CoronaryFlow.h"
#include "VesselFrames.h"

#include <cstdint>
#include <vector>

namespace coronary
{
struct ContrastSettings
{
  CoronaryFlowSettings flow;
  ContrastTracerSettings tracers;
  AorticFlowSettings aorta;

  /// Length over which Concentration() is smoothed along a branch, mm, 0 (not at all) to 20. It hides the noise of
  /// the tracers' number.
  double smoothing = 1.5;

  /// Strength of the fall of flow that contrast medium causes, 0 (off) to 1 (as published: flow falls to 45 % at
  /// 1.9 s after neat contrast medium reached the myocardium of dogs; Invest Radiol 1985).
  double flowDepression = 0.0;

  /// Sessions: the guide catheter's lumen has a volume, which is to be filled; else medium leaves it at once.
  bool guideLumen = false;

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

/// The lumen between two neighbouring points of a branch's axis.
struct ContrastSlab
{
  int branch = 0;
  /// Its root-side end in the list of all branches' axis points; the other one is point + 1.
  std::int64_t point = 0;
  double volume = 0.0; ///< mL at rest
};

/// mL of contrast medium; injected = inGuide + inTree + blush + washedOut + spilled + leaked + inWall.
struct ContrastBalance
{
  double injected = 0.0;
  double inGuide = 0.0;   ///< in the guide catheter, or drawn back into the syringe
  double inTree = 0.0;    ///< in the arteries
  double blush = 0.0;     ///< in the myocardium
  double washedOut = 0.0; ///< left the myocardium
  double spilled =
    0.0; ///< into the aorta: injected there, refluxed, or flowed back through an ostium
  double inAorta = 0.0;   ///< of that, in root and ascending aorta
  double leftAorta = 0.0; ///< of that, beyond
  double leaked = 0.0;    ///< out of the vessels through holes in their wall
  double inWall = 0.0;    ///< in the wall, where it is torn
};

/**
 * CoronaryFlow carries ContrastTracers. For given arguments, settings, seed and processor architecture, all results
 * are the same bits.
 *
 * Injection: the medium enters undiluted (c0 = 1) at the tip and is at once mixed with the blood that passes it, over
 * the whole cross-section: below the tip c = Q_inj / (Q_inj + Q_blood), Q_blood what comes from above. When the tree
 * takes less than Q_inj, c = 1 below, and the excess flows upstream: into what branches off there, and out of the
 * ostium into the aorta (AorticContrast), from where it does not come back. Branches above the tip get medium only so.
 */
class ContrastModel
{
public:
  /**
   * @param topology  its axis, radii, parents and names are used; not kept
   * @throws std::invalid_argument as FlowNetwork and ContrastSettings::Validate
   */
  ContrastModel(const WallTopology& topology, const ContrastSettings& settings, std::uint64_t seed);

  /**
   * @param dt         s, 0.0005 to 0.02; meant to be called at a fixed 0.005
   * @param phase      fraction of R-R now, modulo 1
   * @param heartRate  1/min, 0 to 300; 0: the heart stands still
   * @param injection  mL/s, 0 to 50
   * @param tip        where; branch -1: in the aorta, abscissa mm along its axis from the valve; everything spills
   * @param medium     fraction of the injection that is contrast medium, 0 to 1
   * @param beside     mL/s of contrast medium that leave the catheter and miss the ostium, 0 to 50
   * @throws std::invalid_argument naming the argument; nothing has changed then
   */
  void Step(double dt, double phase, double heartRate, double injection, const CatheterTip& tip,
    double medium = 1.0, double beside = 0.0);

  /// What Concentration() is of: branch by branch from its beginning on; axis points - 1 a branch.
  const std::vector<ContrastSlab>& Slabs() const { return this->Slabs_; }

  /// Fraction of contrast medium, 0 to 1, per slab: the tracers' volume, smoothed along each branch by one implicit
  /// step of diffusion, which keeps it; only where a whole branch would be above 1, it is cut. Made when asked for,
  /// once a step; not for two threads at a time.
  const std::vector<double>& Concentration() const;

  /**
   * Of all tracers, for drawing.
   * @param axis       of WallMotion::AxisPositions now; its points as many as the topology's
   * @param positions  mm; resized
   * @param volumes    mL of contrast medium; resized
   * @throws std::invalid_argument for another number of points
   */
  void TracerPositions(const std::vector<Vector3>& axis, std::vector<Vector3>& positions,
    std::vector<float>& volumes) const;
  std::int64_t NumberOfTracers() const { return this->Tracers_.Size(); }

  /// mL of contrast medium in the myocardium behind a branch's tip; per branch, 0 where its end is no outlet.
  const std::vector<double>& BlushVolume() const { return this->BlushVolume_; }

  /// mL/s at the branch's beginning, away from the root.
  double Flow(int branch) const;
  /// cm/s there, mean over the cross-section; on the axis it is twice that.
  double Speed(int branch) const;
  /// mL/s into a tree from the aorta.
  double TreeFlow(int tree) const { return this->Flow_.TreeFlow(tree); }
  double AorticPressure() const { return this->Flow_.AorticPressureNow(); } ///< mmHg

  ContrastBalance Balance() const; ///< exact to round-off
  bool Empty() const               ///< nothing was ever injected
  {
    return this->Tracers_.Injected() + this->Beside == 0.0;
  }
  std::uint64_t StateHash() const; ///< over the bits of all that the next step depends on

  /// As CoronaryFlow::SetLumen; what tracers count as volume stays.
  void SetLumen(const std::vector<double>& radius, const std::vector<double>& instrument)
  {
    this->Flow_.SetLumen(radius, instrument);
  }

  ///@{
  /// As CoronaryFlow's; contrast medium leaks with the blood.
  int OpenHole(const CatheterTip& place);
  void SetHole(int node, double conductance, double outside)
  {
    this->Flow_.SetHole(node, conductance, outside);
  }
  double LeakFlow(int node) const { return this->Flow_.LeakFlow(node); } ///< mL/s
  /// mL of contrast medium, so far.
  double Leaked(int node) const { return this->Tracers_.Leaked()[static_cast<std::size_t>(node)]; }
  ///@}
  /// A heart that ejects less, from the next step on. @param stroke, pressure  times stroke volume and pressures, 0 to 1
  void SetHeart(double stroke, double pressure);
  /// The wall takes a part of what is in the lumen beside it. @param from, to  mm along a branch @param part  0 to 1
  /// @return mL of contrast medium
  double Absorb(int branch, double from, double to, double part);

  const CoronaryFlow& FlowModel() const { return this->Flow_; }
  const ContrastTracers& Tracers() const { return this->Tracers_; }
  /// It follows from the rest's states, and is not in StateHash().
  const AorticContrast& Aorta() const { return this->Aorta_; }

private:
  /// A row of the equations that smooth, eliminated from a branch's beginning on.
  struct SmoothedSlab
  {
    double own;   ///< of its mL of contrast medium
    double above; ///< of the slab before, eliminated
    double below; ///< of the slab behind
  };

  void MakeSlabs();
  void MakeSmoothing();
  void DepressFlow(double dt);
  void StepAorta(double dt, double flow, double spilled, double beside, const CatheterTip& tip);
  void UpdateBlush();
  /// The slab of a place along a branch, mL from its beginning.
  std::size_t SlabAt(int branch, double volume) const;
  double SlabVolume(std::size_t slab) const; ///< mL, above 0
  void SmoothBranch(std::size_t branch) const;
  void LimitBranch(std::size_t branch) const;
  void FillStumps() const;

  ContrastSettings Settings_;
  CoronaryFlow Flow_;
  ContrastTracers Tracers_;
  AorticContrast Aorta_;
  double Beside = 0.0;       ///< mL, so far
  double Stroke = 1.0;       ///< times the stroke volume
  std::size_t LastMouth = 0; ///< tree of the last injection
  std::vector<ContrastSlab> Slabs_;
  std::vector<double> SlabLength;      ///< mm
  std::vector<double> SlabBegin;       ///< mL along the branch
  std::vector<std::size_t> BranchSlab; ///< per branch: its first slab; and one more
  std::vector<std::int32_t>
    SlabOfCell;                        ///< where cells of equal volume begin, CellsOfSlab to a slab
  std::vector<double> CellsOfVolume;   ///< per branch: cells a mL
  std::vector<SmoothedSlab> Smoothing; ///< per slab
  std::vector<double> BlushVolume_;
  /// Per tree: part of contrast medium in what flows into the myocardium, filtered.
  std::vector<double> Arrived;
  std::vector<double> Depressed; ///< Arrived, filtered again
  mutable std::vector<double> Concentration_;
  mutable std::vector<VesselFrame> Frames;
  mutable bool Current = false;
};
}

#endif
