/**
 * @file CosseratRod.h
 * @brief An elastic rod of rigid segments with joints between them, in contact with what it touches.
 *
 * Every segment has a position and an orientation; a joint resists gaps, bending about two axes and
 * torsion. A step is implicit Euler: Newton's method for the balance of forces and moments at its end, with the
 * equations of all segments solved at once (block tridiagonal, 6x6 blocks, O(segments)). A contact and its
 * friction touch one segment, so they only change that segment's block.
 *
 * Sources: joints of segments: Kugelstadt & Schoemer, "Position and orientation based Cosserat rods",
 * SCA 2016; direct solution: Deul, Kugelstadt, Weiler, Bender, "Direct position-based solver for stiff rods",
 * CGF 2018. docs/simulator.md has the equations and where they differ from those.
 */
#ifndef DynamicCoronary_CosseratRod_h
#define DynamicCoronary_CosseratRod_h

#include "ContactSurface.h"
#include "Geometry.h"

#include <array>
#include <cstdint>
#include <vector>

namespace coronary
{
/// A rigid piece of a rod. Units are mm, N, s, so masses are in t (1 t = 1000 kg).
struct RodSegment
{
  double length = 1.0;              ///< mm, positive
  double mass = 1e-9;               ///< t, positive
  double transverseInertia = 1e-10; ///< about an axis across, t mm^2, positive
  double axialInertia = 1e-11;      ///< about its own axis, t mm^2, positive
  double radius = 0.178;            ///< mm, of what touches, positive
  double friction = 0.0;            ///< handed to the ContactSurface
  double drag = 0.0;                ///< N s/mm, against the medium
  double rotationalDrag = 0.0;      ///< N mm s
  int samples = 0;                  ///< fewer of them than RodSettings::samples; 0: as many
};

/// Of homogeneous round material. @param density  kg/m^3 @param radius  mm, of the mass
RodSegment MakeRodSegment(double length, double radius, double density);

/// Between a segment and the next one.
struct RodJoint
{
  Vector3 angularStiffness = Vector3::Ones(); ///< EI1/l, EI2/l, GJ/l, N mm/rad, not negative
  double stretchStiffness = 1e4;              ///< EA/l, in all directions, N/mm, positive
  Vector3 restAngle =
    Vector3::Zero();     ///< rotation vector of the next segment's frame in this one's, rad
  double lossTime = 0.0; ///< s: of the material; moment = stiffness (angle + lossTime d(angle)/dt)
};

/// What came of a step, and is there until the next one.
struct RodContact
{
  std::int64_t segment = 0;
  int sample = 0; ///< of the segment
  Vector3 normal = Vector3::Zero();
  Vector3 point = Vector3::Zero();    ///< the sample's centre, mm
  double gap = 0.0;                   ///< mm, at the end of the step
  double force = 0.0;                 ///< N along the normal
  Vector3 friction = Vector3::Zero(); ///< N on the rod
  bool slips = false;
};

struct RodStep
{
  double maximumGap = 0.0;         ///< mm, of a joint
  double maximumPenetration = 0.0; ///< mm
  double meanPenetration = 0.0;    ///< mm, over all contacts with a force
  int touching = 0;                ///< contacts with a force
  double maximumUpdate = 0.0;      ///< mm, of the last iteration
  int pressed = 0;                 ///< planes that came to be contacts within the step
  int calmed = 0; ///< times that the equations were damped more, to keep moves across within trust
  int indefinite = 0;        ///< iterations whose exact matrix was not positive definite
  double frictionWork = 0.0; ///< N mm that friction took away in this step
  double wallWork = 0.0;     ///< N mm that the moving wall did on the rod in this step
  bool finite = true;        ///< false: the step failed, and the rod is as it was before
};

struct RodSettings
{
  int iterations = 1;              ///< Newton iterations a step, 1 to 1000
  double tolerance = 0.0;          ///< mm: fewer iterations when all updates are below
  double reach = 0.3;              ///< mm: how far away surfaces are asked for contacts, positive
  double softness = 0.02;          ///< mm: distance over which a contact comes into force, positive
  double frictionStiffness = 20.0; ///< N/mm of a contact that sticks, positive
  double maximumMove = 0.4;        ///< mm and, for turns, half as many rad: limit of an iteration
  int samples = 2; ///< of a segment that are asked for contacts, 1 to 4, evenly spread
  /// mm by which a segment may move across in a step, beside what the walls carry it: a rod that snaps over takes
  /// several steps for it. 0: any way. For rods that are so light that nothing else slows them down.
  double trust = 0.0;
  bool mediumFollowsWalls = false; ///< the medium moves as the walls around it; otherwise it rests
  bool tipSample = true;           ///< and the free end of the first segment

  /// @throws std::invalid_argument naming the setting
  void Validate() const;
};

/// Of a wire or a guide catheter in vessels that beat: light, and carried along by blood.
RodSettings InstrumentRod();

/**
 * Segments are numbered along the rod; the third axis of a segment's frame points to the next one. New ones are
 * added at the end: the first keep their numbers, and with them what surfaces remember of them.
 * Allocates nothing up to the capacity. Deterministic.
 */
class CosseratRod
{
public:
  explicit CosseratRod(std::int64_t capacity, const RodSettings& settings = {});

  /// @param joint  to the segment before; of the first one not used
  /// @throws std::invalid_argument a property out of range; std::length_error at the capacity
  void Append(const RodSegment& segment, const RodJoint& joint, const Vector3& position,
    const Eigen::Quaterniond& orientation);
  void RemoveLast();

  std::int64_t Size() const { return static_cast<std::int64_t>(this->Bodies.size()); }

  ///@{
  /// Where a segment's centre is, mm, and how its frame is turned.
  const Vector3& Position(std::int64_t i) const { return this->Bodies[i].position; }
  const Eigen::Quaterniond& Orientation(std::int64_t i) const
  {
    return this->Bodies[i].orientation;
  }
  const Vector3& Velocity(std::int64_t i) const { return this->Bodies[i].velocity; }
  Vector3 Axis(std::int64_t i) const; ///< unit
  Vector3 FirstEnd(std::int64_t i) const;
  Vector3 LastEnd(std::int64_t i) const;
  ///@}
  const RodSegment& Segment(std::int64_t i) const { return this->Bodies[i].segment; }
  const RodJoint& Joint(std::int64_t i) const { return this->Joints[i].joint; } ///< of i and i + 1
  RodJoint& Joint(std::int64_t i) { return this->Joints[i].joint; }

  /// Puts a segment somewhere, at once and at rest.
  void Place(std::int64_t i, const Vector3& position, const Eigen::Quaterniond& orientation);
  /// From now on the segment is held; at the end of the next step it is there.
  void Prescribe(std::int64_t i, const Vector3& position, const Eigen::Quaterniond& orientation);
  /**
   * A segment that is held is so but for turns about its own axis: it hangs on a torsion spring whose other end is
   * turned as Prescribe says. The spring may be wound up by any number of turns.
   * @param stiffness  N mm/rad; 0: it is held altogether
   * @param lag        by which it is turned against the spring's other end, about its axis, rad
   */
  void HangOnSpring(std::int64_t i, double stiffness, double lag);
  double Lag(std::int64_t i) const { return this->Bodies[i].lag; } ///< rad, see HangOnSpring
  /// From now on the segment moves by the forces on it.
  void Release(std::int64_t i);
  /// Of what touches, mm.
  void SetRadius(std::int64_t i, double radius) { this->Bodies[i].segment.radius = radius; }
  void SetVelocity(std::int64_t i, const Vector3& velocity, const Vector3& turning);

  ///@{
  /// Dead loads on a segment: N at its centre, N mm; until set again.
  void SetForce(std::int64_t i, const Vector3& force) { this->Bodies[i].force = force; }
  void SetTorque(std::int64_t i, const Vector3& torque) { this->Bodies[i].torque = torque; }
  ///@}

  /**
   * @param seconds  positive
   * @param surface  at the end of the step; may be null
   */
  const RodStep& Step(double seconds, ContactSurface* surface = nullptr);

  ///@{
  /// Of the last step: N that the next segment (i + 1) puts on segment i, and N mm in the joint, in the world.
  Vector3 JointForce(std::int64_t i) const { return this->Joints[i].force; }
  Vector3 JointMoment(std::int64_t i) const { return this->Joints[i].moment; }
  ///@}
  /// N and N mm about its centre that hold a prescribed segment, of the last step.
  void Reaction(std::int64_t i, Vector3& force, Vector3& torque) const;

  const RodStep& LastStep() const { return this->Last; }
  const std::vector<RodContact>& Contacts() const { return this->Touched; } ///< of the last step

  ///@{
  /// N mm.
  double ElasticEnergy() const;
  double KineticEnergy() const;
  double ContactEnergy() const; ///< in walls and sticking friction, of the last step
  ///@}

  /// FNV-1a of the bits of positions, orientations, velocities and the memory of friction.
  std::uint64_t Hash(std::uint64_t seed = 0xcbf29ce484222325ULL) const;

  /// Number of samples of a segment; the index of a sample that surfaces see is segment * this + sample.
  int SamplesPerSegment() const { return this->Settings.samples + 1; }
  Vector3 SamplePoint(std::int64_t i, int sample) const;

  const RodSettings& GetSettings() const { return this->Settings; }
  RodSettings& GetSettings() { return this->Settings; }

private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  struct Memory
  {
    Vector3 spring = Vector3::Zero(); ///< mm that a contact is sheared by
    Vector3 slide = Vector3::Zero();  ///< mm over the wall in the last step
    double force = 0.0;               ///< N, 0: no contact
  };
  struct Body
  {
    RodSegment segment;
    Vector3 position = Vector3::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    Vector3 velocity = Vector3::Zero();
    Vector3 turning = Vector3::Zero();
    Vector3 force = Vector3::Zero();
    Vector3 torque = Vector3::Zero();
    Vector3 medium = Vector3::Zero();
    bool held = false;
    double spring = 0.0; ///< N mm/rad, of a held segment that hangs on one
    double lag = 0.0;    ///< rad
    Vector3 heldPosition = Vector3::Zero();
    Eigen::Quaterniond heldOrientation = Eigen::Quaterniond::Identity();
    std::array<std::array<Memory, 2>, 5> memory;
    // At the beginning of the step, and as inertia alone would have it.
    Vector3 oldPosition = Vector3::Zero();
    Eigen::Quaterniond oldOrientation = Eigen::Quaterniond::Identity();
    Vector3 freePosition = Vector3::Zero();
    Eigen::Quaterniond freeOrientation = Eigen::Quaterniond::Identity();
    Vector3 axis = Vector3::UnitZ();
    int nearWalls = 0;                      ///< planes that were found for it
    Vector3 wallVelocity = Vector3::Zero(); ///< mean of theirs, mm/s
    // Of the equations.
    Matrix6 matrix = Matrix6::Zero();
    Matrix6 coupling = Matrix6::Zero(); ///< to the next segment
    Vector6 right = Vector6::Zero();
  };
  struct JointState
  {
    RodJoint joint;
    Vector3 force = Vector3::Zero();
    Vector3 moment = Vector3::Zero();
    Vector3 oldAngle = Vector3::Zero();
    Vector3 localMoment = Vector3::Zero();
    // Of the last iteration.
    Vector3 gap = Vector3::Zero();
    Matrix3 map = Matrix3::Identity(); ///< turns of the segments to change of the angle
    Vector3 angle = Vector3::Zero();
  };
  struct Plane
  {
    RodContact contact;
    Vector3 arm = Vector3::Zero();   ///< from the segment's centre to the sample's
    Vector3 guess = Vector3::Zero(); ///< sample's centre where the plane was found
    double gapThere = 0.0;
    double radius = 0.0;
    double stiffness = 0.0;
    double friction = 0.0;
    Vector3 wallMotion = Vector3::Zero(); ///< in this step, mm
    Memory* memory = nullptr;
    bool pressed = false; ///< taken for a contact in earnest
    int changes = 0;      ///< of that in this step
    double law = 0.0;     ///< N at the last linearization
    double slope = 0.0;   ///< N/mm
    double gapLinear = 0.0;
    Matrix3 tangent = Matrix3::Zero();
    Vector3 shear = Vector3::Zero(); ///< mm, at the last linearization
    Vector3 pull = Vector3::Zero();  ///< friction at the last linearization, N
    Vector3 lever = Vector3::Zero(); ///< to where it touches
    Vector3 way = Vector3::Zero();   ///< unit, in which it is expected to slide
    bool slipping = false;
  };

  void Predict(double seconds);
  void FindContacts(double seconds, ContactSurface& surface);
  void AssembleBodies(double seconds);
  void AssembleJoints(double seconds, bool exact);
  void AssembleContacts(bool first);
  bool Solve();                ///< false: the matrix is not positive definite
  double SidewaysMove() const; ///< mm, greatest, of the solution
  bool ChangeContacts();       ///< true: the equations have changed
  double Update(double& scale);
  void Finish(double seconds);
  void Restore();
  int SamplesOf(std::int64_t i) const;
  double SampleOffset(std::int64_t i, int sample) const;

  RodSettings Settings;
  std::int64_t Capacity;
  std::vector<Body> Bodies;
  std::vector<JointState> Joints;
  std::vector<Vector3> Carried; ///< mm, where Newton's method begins
  std::vector<Plane> Planes;
  std::vector<RodContact> Touched;
  RodStep Last;
  double Calm = 0.0; ///< N/mm against moves across
};

///@{
/// Rotation vector of a unit quaternion (the shorter way round), and back.
Vector3 RotationVector(const Eigen::Quaterniond& rotation);
Eigen::Quaterniond RotationOf(const Vector3& vector);
///@}
}

#endif
