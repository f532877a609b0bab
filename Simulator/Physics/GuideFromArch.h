/**
 * @file GuideFromArch.h
 * @brief A guide catheter that comes through the aorta and has to find the ostium, as the way of what runs in it.
 */
#ifndef DynamicCoronary_GuideFromArch_h
#define DynamicCoronary_GuideFromArch_h

#include "AortaMotion.h"
#include "GuideInAorta.h"
#include "GuideWay.h"
#include "InstrumentLumen.h"

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace coronary
{
/**
 * u is `engagement` + mm that the hand has advanced the guide, at its tip; so a wire that is held stays where it is when the
 * guide slides over it. At the beginning the guide lies in the ascending aorta, StartsAbove the ostium, at rest: the wire over
 * which it was brought there was drawn out.
 */
class GuideFromArch : public GuideWay
{
public:
  static constexpr double StartsAbove = 35.0; ///< mm of the aorta's axis

  /**
   * @param topology    with an aorta; axes at rest
   * @param axis        of WallMotion::AxisPositions now
   * @param root        branch whose ostium is wanted
   * @param engagement  u of its tip at the beginning, mm
   * @param behind      mm of the way behind the tip
   * @throws std::invalid_argument  as AortaMotion and GuideInAorta; the aorta's wall is not at the ostium
   */
  GuideFromArch(const GuideCatheter& guide, const WallTopology& topology,
    const std::vector<Vector3>& axis, int root, double engagement, double behind,
    const GuideSettings& settings);
  ~GuideFromArch() override;

  /// mm that the artery's inlet has to be lengthened by, to begin within the aorta.
  double InletLength() const;

  /// Before the first step, which it takes some thousand of to come to rest. @param artery  lengthened; has to live as long as this
  void Join(VesselWall& artery, std::int64_t inlet);

  /// What came next is now. @param axis  of all vessels, after `seconds`
  void BeginFrame(const std::vector<Vector3>& axis, double seconds);
  void SetTime(double seconds) override;

  /**
   * @param position  mm  @param angle  rad: of the hand, since the start
   * @param wires     that lie in it, and mm of each beyond its tip
   * @param thrust    N by which they are pushed out of its tip
   */
  void Step(double position, double angle,
    const std::vector<std::pair<const Guidewire*, double>>& wires, double thrust);

  double TipPlace() const { return this->Engagement + this->Tube.Inserted() - this->Start; } ///< u
  double Least() const; ///< mm that the hand can be at, and at most
  double Most() const;
  GuideSeat Seat() const;
  double MouthPlace() const { return this->MouthAt; } ///< mm from the axis' first point
  const Ostium& Mouth() const { return this->Now_; }
  const GuideInAorta& Guide() const { return this->Tube; }
  /// For the wire out of it.
  AortaAndArtery& Lumen() { return *this->WireLumen; }

  void Line(double u, double length, std::vector<Vector3>& line) const override;
  std::uint64_t Hash(std::uint64_t hash) const;

private:
  /// Of the tube, on its axis.
  struct Node
  {
    Vector3 position;
    Vector3 tangent; ///< towards the tip
    Vector3 velocity;
    double behind; ///< mm behind the tip
  };

  Vector3 VelocityAt(std::size_t i, double share) const override;
  Ostium MouthOf(const std::vector<Vector3>& axis) const;
  void FindMouth();
  void MakeWay();

  WallTopology AortaTopology;
  AortaMotion Motion;
  std::vector<Vector3> AortaPoints;
  std::unique_ptr<VesselWall> AortaWall;
  std::unique_ptr<AortaAndArtery> TubeLumen;
  std::unique_ptr<AortaAndArtery> WireLumen;
  std::size_t RootFirst = 0; ///< of the axes' points
  std::size_t RootCount = 0;
  /// mm along the root's axis where it leaves the aorta; negative: before its first point.
  double MouthAt = 0.0;
  double MouthRadius = 0.0;
  Ostium Current;
  Ostium Next;
  Ostium Now_;
  double Seconds = 1.0;
  double Engagement;
  double Start = 0.0;
  int Behind; ///< points of the way
  GuideInAorta Tube;
  std::vector<double> Carried; ///< mm of wires that the tube's stiffness was last made for
  double Thrust = 0.0;         ///< N, smoothed
  double TickRate;
  std::vector<Node> Nodes;
  std::vector<Vector3> Velocities; ///< mm/s, per point of the way
};
}

#endif
