/**
 * @file ContrastTracers.h
 * @brief Contrast medium as particles that the blood carries along.
 */
#ifndef DynamicCoronary_ContrastTracers_h
#define DynamicCoronary_ContrastTracers_h

#include "CoronaryFlow.h"
#include "TracerKernels.h"

#include <array>
#include <cstdint>
#include <vector>

namespace coronary
{
struct ContrastTracerSettings
{
  std::int64_t capacity = 20000; ///< greatest number of tracers, 1000 to 10,000,000
  /// mL of contrast medium a tracer, 1e-7 to 0.1. Doubled while there are too many, halved again when there are few.
  double volume = 2.5e-4;
  /// Of the radial random walk, mm^2/s, 0 to 100: what secondary flow in bends and the pulse mix. No source has it for
  /// coronary arteries: 0.2 is 1/1000 to 1/500 of mean speed times radius. A cross-section of 1.5 mm radius is mixed in
  /// r^2 / (14.7 D) = 0.8 s, where molecular diffusion (0.001) takes minutes.
  double radialDiffusivity = 0.2;
  /// Along the axis, mm^2/s, 0 to 100. Little against what the velocity profile disperses; above 0 medium also creeps
  /// upstream of the tip, within its segment.
  double axialDiffusivity = 0.0;
  /// Time constant of the myocardium's wash-out, s, 0.05 to 100. A normal blush is gone within three cycles (TIMI
  /// myocardial perfusion grade 3; Gibson et al., Circulation 2000;101:125).
  double blushTime = 1.5;

  /// @throws std::invalid_argument that names the first setting out of range or not finite
  void Validate() const;
};

/// Flow that carries tracers during one step.
struct TracerFlow
{
  const std::vector<double>* flow = nullptr; ///< mL/s per segment, below the injector
  FlowNetwork::Place injector;               ///< segment -1: none
  double flowAbove = 0.0;                    ///< mL/s in the injector's segment above it
  double injection = 0.0;                    ///< mL/s
  double medium = 1.0;                       ///< fraction of it that is contrast medium
};

/**
 * A tracer is at a segment, a volume v of the segment's lumen from its beginning, and a point (x, y) of the unit
 * circle that stands for the cross-section. It moves by dv/dt = 2 Q (1 - x^2 - y^2), which is laminar flow in a tube of
 * any taper, and by a random walk of (x, y) whose steps out of the circle are not taken: a uniform cross-section stays
 * uniform exactly. The incoming flow of a node is cut into stream-tubes by chords across the direction in which the
 * branches part; a branch gets the side that it leaves from, with as much of the flux as it takes, and the stream-tube
 * is mapped onto the branch's whole circle so that flux is kept.
 *
 * Structure of arrays, all of it allocated at construction. Random numbers are functions of seed, step and place in the
 * arrays.
 */
class ContrastTracers
{
public:
  /// @throws std::invalid_argument as ContrastTracerSettings::Validate
  ContrastTracers(
    const FlowNetwork& network, const ContrastTracerSettings& settings, std::uint64_t seed);

  /// Injects, moves and washes out. An injector of segment -1 with injection above 0: into the aorta.
  void Step(double dt, const TracerFlow& flow);

  /// The network has a hole more: a node of a segment that was split. Tracers stay where they are. Not within a step.
  /// @param node  as FlowNetwork::Split
  void OpenHole(const FlowNetwork& network, int node);
  /// Tissue beside a stretch of a branch takes this part of what is in it. @param from, to  mL of a segment's lumen before it
  /// @return mL of contrast medium
  double Absorb(int segment, double from, double to, double part);

  const ContrastTracerSettings& Settings() const { return this->Settings_; }
  std::int64_t Size() const { return this->Size_; }
  int Segment(std::int64_t i) const { return this->Segment_[i]; }
  /// mL of the segment's lumen that are before it.
  double Lumen(std::int64_t i) const
  {
    return this->Part_[i] * this->Segments[this->Segment_[i]].volume;
  }
  double X(std::int64_t i) const { return this->X_[i]; }
  double Y(std::int64_t i) const { return this->Y_[i]; }
  double Volume(std::int64_t i) const { return this->Volume_[i]; } ///< mL of contrast medium

  double Injected() const { return this->Injected_; }   ///< mL so far
  double Spilled() const { return this->Spilled_; }     ///< mL so far
  double WashedOut() const { return this->WashedOut_; } ///< mL so far
  /// mL so far, per node: through its hole.
  const std::vector<double>& Leaked() const { return this->Leaked_; }
  double Absorbed() const { return this->Absorbed_; }               ///< mL so far
  double InTree() const;                                            ///< mL
  const std::vector<double>& Blush() const { return this->Blush_; } ///< mL per node
  /// mL of contrast medium that came through the node's outlet in the last step.
  const std::vector<double>& Outflow() const { return this->Outflow_; }
  std::uint64_t StateHash() const;

private:
  struct Tracer
  {
    int segment;
    double lumen; ///< mL of the segment's lumen that are before it, or as far as its speed takes it
    float x;
    float y;
    double volume;
  };
  /// A tracer on its way through a node.
  struct Crossing
  {
    Tracer tracer;
    int node = -1;
    double left = 0.0;      ///< twice the time left, s
    std::int64_t place = 0; ///< in the arrays
  };
  struct TracerSegment
  {
    int above;     ///< node
    int below;     ///< node
    double volume; ///< mL
    double radius; ///< mm
    double length; ///< mm
  };
  /// Part of what comes into a node that leaves together.
  struct Tube
  {
    int segment; ///< into which; -1: out of the tree
    float begin; ///< part of the node's flux that is before it along `parting`
    float scale; ///< the node's flux / its own
  };
  struct Junction
  {
    /// What the node's blood can go into, in the order in which it leaves along `parting`; -1: out of the tree.
    std::vector<int> segments;
    std::vector<Tube> tubes; ///< of those of `segments` that blood goes into now
    float partingX = 1.0F;
    float partingY = 0.0F;
    bool tip = false;
    bool root = false;
    bool hole = false; ///< beside the segments there is a way out through the wall
  };
  void MakeSegments(const FlowNetwork& network);
  void MakeJunctions(const FlowNetwork& network);
  void PrepareMotion(double dt, const TracerFlow& flow);
  void PrepareJunctions();
  void WashOut(double dt);
  void Move();
  std::int64_t MoveWithinSegments();
  void CrossBatch(const std::int32_t* leaving, std::int64_t count);
  bool Cross(Crossing& crossing);
  bool Reach(Crossing& crossing) const;
  bool Enter(Crossing& crossing);
  static void TakeTube(const Junction& junction, Tracer& tracer);
  void Inject(double volume);
  void Emit(double volume, bool down);
  void MakeRoom(std::int64_t count);
  void Thin(bool anywhere);
  void Store(const Tracer& tracer, std::int64_t i);
  void Copy(std::int64_t from, std::int64_t to);

  ContrastTracerSettings Settings_;
  std::uint64_t Key;
  std::uint64_t Steps = 0;
  std::uint64_t Emitted = 0;
  double TracerVolume; ///< mL, now
  std::vector<TracerSegment> Segments;
  std::vector<Junction> Junctions;
  std::vector<TracerMotion> Motions;
  std::vector<float> AxialSteps;  ///< half width of a step along the segment, of its volume
  std::vector<double> FlowTop;    ///< mL/s per segment, at its beginning
  std::vector<double> FlowBottom; ///< at its end
  TracerFlow Flow;
  double Dt = 0.0;

  std::int64_t Size_ = 0;
  std::vector<std::int32_t> Segment_;
  std::vector<float> Part_; ///< of the segment's volume that is before the tracer, 0 to 1
  std::vector<float> X_;
  std::vector<float> Y_;
  std::vector<double> Volume_;
  std::vector<std::int32_t> Leaving; ///< tracers beyond an end of their segment
  std::vector<Crossing> Batch;
  std::vector<std::int32_t> Order; ///< for thinning
  std::vector<std::int32_t> CellBegin;

  double Injected_ = 0.0;
  double Spilled_ = 0.0;
  double WashedOut_ = 0.0;
  std::vector<double> Blush_;
  std::vector<double> Outflow_;
  std::vector<double> Leaked_;
  double Absorbed_ = 0.0;
};
}

#endif
