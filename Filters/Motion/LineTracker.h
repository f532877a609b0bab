/**
 * @file LineTracker.h
 * @brief Tracks the nodes of a centerline through the phases of a series, step by step.
 */
#ifndef DynamicCoronary_LineTracker_h
#define DynamicCoronary_LineTracker_h

#include "CenterlineTracking.h"
#include "CyclicTime.h"
#include "DisplacementLabels.h"
#include "LineNodes.h"
#include "LocalDeformation.h"
#include "MotionFilling.h"
#include "PatchMatching.h"
#include "SparseVolume.h"
#include "TrajectoryModel.h"

#include <functional>
#include <string>
#include <vector>

namespace coronary
{
class WideningField;

/// Beyond the patch, the search and the smearing: what the places may still move, mm.
constexpr double SpareReach = 3.0;

/// Of what is compared of a vessel in the first search, mm.
constexpr double CoarseVesselRadius = 6.0;

inline double NodeRadius(const LineNodes& nodes, int node)
{
  return nodes.radius.empty() ? 1.5 : nodes.radius[node];
}

/// Steps in LineTrackerSearch.cxx (discrete search of the surroundings), LineTrackerAlignment.cxx (continuous
/// alignment of the vessels), LineTrackerCalibre.cxx, and CenterlineTracking.cxx (trajectories, report).
class LineTracker
{
public:
  LineTracker(const Polylines& lines, double referenceTime, const std::vector<double>& times,
    const std::function<ScalarImage(double time)>& imageAt,
    const CenterlineTrackingSettings& settings, CenterlineTrackingReport& report,
    const ProgressCallback& progress, ItemSharing& sharing)
    : Lines(lines)
    , ReferenceTime(referenceTime)
    , Times(times)
    , ImageAt(imageAt)
    , Settings(settings)
    , Result(report)
    , Progress(progress)
    , Sharing(sharing)
    , Nodes(PlaceNodes(lines, settings.nodeSpacing))
    , Deformation(this->Nodes)
    , Coarse(settings.coarseRadius, settings.coarseSpacing)
    , CoarseVessel(CoarseVesselRadius, settings.coarseSpacing)
    , Fine(settings.fineRadius, 1.0)
    , Core(3.0, 0.5)
  {
  }

  PoseSequence Run();

private:
  using PerPhase = std::vector<std::vector<Vector3>>;

  using Seen = MotionMeasurements;

  /// What is expected to be seen of a node at a phase.
  struct Sight
  {
    std::vector<float> wanted;
    std::vector<Eigen::Vector3f> gradient;
    std::vector<float> weight;
  };
  /// What the first search compares with.
  struct CoarseReference
  {
    AveragedVolume image;
    std::vector<std::vector<float>> weights; ///< per node, of Coarse
  };
  /// Of a node's widening at a phase, and what it is worth.
  struct Widening
  {
    double value = 0.0; ///< of the logarithm of the radius
    double information = 0.0;
  };

  /// A part of the whole progress.
  ProgressCallback Part(double from, double to) const;
  ScalarImage Read(double time);
  void MeasureContrast();
  /// The box that the nodes and their surroundings stay in.
  void PlaceBox();
  /// Air and bone would outvote the rest. @param values  of the reference around all nodes
  void LimitValues(std::vector<float> values);
  void SearchCoarsely();
  /// Per node, what an image says of all shifts from the guess, when the reference is deformed like `places`.
  std::vector<std::vector<float>> CoarseCosts(const CoarseReference& reference,
    const AveragedVolume& moved, const LabelLattice& lattice, const std::vector<Vector3>& guess,
    const std::vector<Vector3>& places, const ProgressCallback& progress) const;
  /// Outwards from the reference, so that a neighbour in time is known.
  void SortPhases();
  /// Positions in Order, each of the phase whose place is the guess of the one at this position; none: -1.
  std::vector<std::ptrdiff_t> Guesses() const;
  /// What is measured of each phase, by those who do it. @return per phase
  std::vector<std::string> OfPhases(
    const std::function<std::string(std::size_t phase)>& measure) const;
  /// Looks for the surroundings of the nodes without the vessels, which may be invisible, or with
  /// them, up to `range` mm from the present trajectories.
  Seen SearchFinely(bool vessels, double range, double progressFrom);
  /// Per node: the patch's weights without what is nearer to a vessel's wall than `margin`, sum 1; all 0
  /// where too little is left.
  std::vector<std::vector<float>> WithoutVessels(const Patch& patch, double margin) const;
  void Align(double robustScale, double progressFrom);
  /// @param curvature  mean outer product of the gradients. @return how many images are averaged in it
  int Expect(std::size_t k, int n, Sight& sight, Matrix3& curvature) const;
  /// Gauss-Newton on the shift and a constant difference of brightness.
  void AlignNode(std::size_t k, std::int64_t n, const Sight& sight, double noisePerImage,
    Vector3& measured, Matrix3& information, double& correlation) const;
  void Finish(PoseSequence& sequence);
  /// Per phase: factor of the radius, of all vessels together.
  /// @param seen  as of SeenPlaces()
  std::vector<double> MeasureCalibre(const std::vector<std::vector<bool>>& seen) const;
  Widening MeasureWidening(std::size_t k, int n, const WideningField& field) const;
  /// Three harmonics of the cycle, nothing at the reference, through each phase's widening.
  std::vector<double> PulseOf(
    const std::vector<double>& widening, const std::vector<double>& trust) const;
  /// Mean distance, across the vessels, of what was seen in phases that show the same moment.
  void MeasureRepeatability();
  /// Fits the trajectories to what was measured; what does not agree counts less.
  void Fit(const std::vector<const Seen*>& seen);
  void Take(Trajectories motion);
  /// Per phase and node: whether a vessel is there that is alike, and those around it are.
  std::vector<std::vector<bool>> SeenPlaces() const;
  /// Fits once more, with what was not seen where those that were seen say. @return the greatest change, mm
  double FillLost();
  std::vector<const Seen*> WithSurroundings(const Seen& seen) const
  {
    return this->Settings.tissue ? std::vector<const Seen*>{ &seen, &this->Surroundings }
                                 : std::vector<const Seen*>{ &seen };
  }
  double Keep() const { return this->Settings.fineRadius + this->Settings.fineRange + SpareReach; }
  /// Squared difference that is not worth mentioning: of 4 % of a vessel's contrast.
  double NoiseFloor() const { return 0.0016 * this->Contrast * this->Contrast; }
  double WindowOfCycle() const
  {
    return this->Settings.temporalWindow / this->Settings.cycleLength;
  }
  /// How far the node moves from its place at `time` over the window, at even moments of it.
  std::vector<Vector3> Smear(int node, double time) const;
  /// The rotation from the reference to the phase of what is around the node.
  Matrix3 Turn(int node, const std::vector<Vector3>& displacement) const;
  std::vector<Vector3> PlacesAt(const std::vector<Vector3>& displacement) const;

  const Polylines& Lines;
  const double ReferenceTime;
  const std::vector<double>& Times;
  const std::function<ScalarImage(double time)>& ImageAt;
  const CenterlineTrackingSettings& Settings;
  CenterlineTrackingReport& Result;
  const ProgressCallback& Progress;
  ItemSharing& Sharing;

  LineNodes Nodes;
  LocalDeformation Deformation;
  Patch Coarse;
  Patch CoarseVessel;
  Patch Fine;
  Patch Core;
  Vector3 Low;
  Vector3 High;
  ValueWindow Limits;
  double Contrast = 1.0; ///< of the vessels in the reference
  double Voxel = 0.4;    ///< largest edge of the reference's voxels, mm
  SparseVolume Reference;
  std::vector<std::size_t> Order;    ///< phases from the reference outwards: the items of Sharing
  std::vector<SparseVolume> Volumes; ///< per phase; empty where it is not measured here
  PerPhase Displacement;             ///< per phase and node: the present trajectories
  Trajectories Motion;
  Seen Surroundings; ///< where the tissue around the nodes was found; empty: not looked for
  Seen Vessels;      ///< by the last alignment
  std::vector<std::vector<double>> Likeness; ///< per phase and node: correlation of the core
};
}

#endif
