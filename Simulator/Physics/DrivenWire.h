/**
 * @file DrivenWire.h
 * @brief One guidewire of an intervention: a rod from its tip to inside the guide catheter, and the wire from there to the hand.
 */
#ifndef DynamicCoronary_DrivenWire_h
#define DynamicCoronary_DrivenWire_h

#include "BalloonOnWire.h"
#include "CosseratRod.h"
#include "GuideWay.h"
#include "InstrumentLumen.h"
#include "Intervention.h"
#include "Notices.h"
#include "TrappedWire.h"
#include "WireInGuide.h"

#include <cstdint>
#include <vector>

namespace coronary
{
/// What all wires of an intervention have around them.
struct WireRoom
{
  InterventionSettings settings;
  GuideCatheter catheter;
  GuideWay* path = nullptr;
  double catheterTip = 0.0;   ///< u
  double catheterAngle = 0.0; ///< rad
  OcclusionPlugs plugs;
  Notices notices;
  std::uint64_t tick = 0;
};

/**
 * Places along the way are u: 0 at the ostium. Its hand feeds and turns it; a wire that no hand is on is held where it leaves
 * the guide.
 */
class DrivenWire : public ContactSurface
{
public:
  /// @param room, lumen  have to live as long as this  @param firstSample  by which surfaces know its samples: others' numbers differ
  DrivenWire(
    const Guidewire& wire, WireRoom& room, InstrumentLumen& lumen, std::int64_t firstSample);

  /// Another wire in its place, its tip where this one's was: both turned as the hand is, and at rest.
  void Take(const Guidewire& wire);
  /// Likewise through the sleeve: the new one lies as this one did. It is not twisted: its hand holds it as it came.
  void TakeAlong(const Guidewire& wire);
  /// A balloon runs on it; null: none does. It has to live until another one is set.
  void SetSleeve(BalloonOnWire* sleeve) { this->Sleeve = sleeve; }

  ///@{
  /// Before a step: what its hand does, mm and rad, and then the guide's part of it.
  void Advance(double way, double turn);
  void Carry(double way) { this->Fed_ += way; }
  void Feed();
  ///@}
  void Step(double seconds);
  /// Into what a report has of the wire in hand.
  void Measure(TickReport& report) const;
  /// Of the last steps.
  const WireReport& Report() const { return this->Report_; }
  int PutBackNow() const { return this->PutBack_; } ///< samples, in the last step

  const Guidewire& Device() const { return this->Wire; }
  const CosseratRod& Rod() const { return this->Rod_; }
  CosseratRod& Rod() { return this->Rod_; }
  const std::vector<double>& Places() const { return this->Places_; }
  const std::vector<RodSegment>& Segments() const { return this->Segments_; }
  BalloonOnWire::Rail Rail() const;
  TrappedWire& Trap() { return this->Trap_; }
  double Fed() const { return this->Fed_; } ///< u, where the tip would be on the straightened way
  double Angle() const { return this->HandAngle; } ///< rad, of its proximal end
  double Beyond() const { return this->Fed_ - this->Room.catheterTip; } ///< mm
  double Thrust() const; ///< N by which it is pushed out of the catheter's tip
  /// Ends of the simulated segments from the tip on, mm.
  void Line(std::vector<Vector3>& line) const;
  std::uint64_t Hash(std::uint64_t hash) const { return this->Behind.Hash(hash); }

  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override;

private:
  struct Sane
  {
    std::vector<Vector3> position;
    std::vector<Eigen::Quaterniond> orientation;
    double fed = 0.0;
    double angle = 0.0; ///< of the rod's end
  };

  void MakeSegments();
  Eigen::Quaterniond HeldOrientation(const PathPlace& place) const;
  double EndAngle() const;
  void AppendSegment();
  void PlaceOnPath();
  void DriveBehind();
  void PutBack();
  void Reset();
  void KeepSane();
  void Settle();
  void MeasureTrap();
  bool InGuide(const ContactSample& sample, double expected, double reach, bool sleeved,
    SampleContacts& contacts);
  double SampleLength(std::int64_t segment) const; ///< mm of the wire
  /// mm behind the sleeve's tip.
  double BehindSleeve(std::int64_t segment) const
  {
    return this->Places_[segment] - this->Fed_ + this->Sleeve->Tip();
  }
  bool InSleeve(std::int64_t segment) const
  {
    return this->Sleeve && this->Sleeve->Covers(this->BehindSleeve(segment));
  }
  void Say(Notice notice) { this->Room.notices.Say(notice, this->Room.tick); }

  WireRoom& Room;
  InstrumentLumen& Lumen;
  Guidewire Wire;
  std::int64_t FirstSample;
  CosseratRod Rod_;
  // All segments that there can be, from the tip.
  std::vector<RodSegment> Segments_;
  std::vector<RodJoint> Joints;
  std::vector<double> Places_;       ///< of their centres from the tip, mm
  std::vector<char> InVessel;        ///< per sample
  std::vector<TrappedWire::At> Held; ///< per sample
  double Fed_ = 0.0;
  double HandAngle = 0.0;
  double LastFed = 0.0; ///< of the step before
  double LastCatheterTip = 0.0;
  double LastCatheterAngle = 0.0;
  WireInGuide Behind; ///< the wire between the rod and the hand
  BalloonOnWire* Sleeve = nullptr;
  TrappedWire Trap_;
  WireReport Report_;
  int PutBack_ = 0;
  double CapForce = 0.0; ///< N
  Sane Last;
};
}

#endif
