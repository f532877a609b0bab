/**
 * @file OcclusionPlug.h
 * @brief The tissue of a chronic total occlusion in front of a wire's tip.
 */
#ifndef DynamicCoronary_OcclusionPlug_h
#define DynamicCoronary_OcclusionPlug_h

#include "ContactSurface.h"
#include "CosseratRod.h"
#include "VesselLesions.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/**
 * A plane across the vessel, from its axis' first occluded point on. It is elastic up to strength x section of the tip; what is
 * beyond moves it on, and it does not come back: behind it the wall's channel (ChannelRadius) is open for every wire. In the
 * channel the tissue rubs more than a wall does.
 */
class OcclusionPlug
{
public:
  static constexpr double Stiffness = 10.0;     ///< N/mm, chosen
  static constexpr double TissueFriction = 2.0; ///< times that on the wall, chosen

  /// @param axis  points of all axes, now
  OcclusionPlug(const Occlusion& occlusion, const std::vector<Vector3>& axis);

  /// What came next is now; the axes come to be these after `seconds`.
  void BeginFrame(const std::vector<Vector3>& axis, double seconds);
  /// Since the frame began, s.
  void SetTime(double seconds);

  /// More friction in the tissue, and the plane, if it is in reach; of three planes the furthest goes.
  void Meet(const ContactSample& sample, double reach, SampleContacts& contacts) const;
  /// Of contacts: it is this plane.
  bool Is(const Vector3& normal) const { return !this->IsCrossed() && normal == -this->Tangent; }
  /// In the channel.
  bool Holds(const Vector3& point) const;

  /// N that a tip has to press with. @param radius  mm, of the tip
  double YieldForce(double radius) const;
  /// After a step. @param force  N of the tip's contact
  void Yield(double force, double radius);

  double Crossed() const { return this->Front; }               ///< mm, of Length()
  double Length() const { return this->Filled.places.back(); } ///< mm
  bool IsCrossed() const { return this->Front >= this->Length(); }

  std::uint64_t Hash(std::uint64_t hash) const;

private:
  Vector3 At(std::size_t point) const
  {
    return this->Current[point] + this->Share * (this->Next[point] - this->Current[point]);
  }

  Occlusion Filled;
  double Front = 0.0; ///< mm from the first point at rest
  std::vector<Vector3> Current;
  std::vector<Vector3> Next;
  double Seconds = 1.0;
  double Share = 0.0; ///< of the frame that is over
  Vector3 Middle = Vector3::Zero();
  double Reach = 0.0; ///< mm from there: nothing of it is further away in this frame
  ///@{
  /// Of the plane, now.
  Vector3 Place = Vector3::Zero();
  Vector3 Tangent = Vector3::UnitZ(); ///< unit, away from the root
  Vector3 Velocity = Vector3::Zero(); ///< mm/s
  ///@}
};

/// All of the vessels.
class OcclusionPlugs
{
public:
  OcclusionPlugs() = default;
  /// @param axis  points of all axes, now
  OcclusionPlugs(const WallTopology& topology, const std::vector<Vector3>& axis);

  ///@{
  /// As OcclusionPlug.
  void BeginFrame(const std::vector<Vector3>& axis, double seconds);
  void SetTime(double seconds);
  void Meet(const ContactSample& sample, double reach, SampleContacts& contacts) const;
  std::uint64_t Hash(std::uint64_t hash) const;
  ///@}

  /// After a step: the rod's free end presses on them. @return N
  double Press(const CosseratRod& rod);
  /// It is one of the planes, or in a channel.
  bool Holds(const RodContact& contact) const;

  const std::vector<OcclusionPlug>& All() const { return this->Plugs; }

private:
  std::vector<OcclusionPlug> Plugs;
};
}

#endif
