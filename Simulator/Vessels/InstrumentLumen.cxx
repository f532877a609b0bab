#include "InstrumentLumen.h"

#include "JoinedLumen.h"

namespace coronary
{
void ArteryLumen::Find(const ContactSample& sample, double reach, SampleContacts& contacts)
{
  const std::int64_t index = sample.index;
  if (index >= static_cast<std::int64_t>(this->Out.size()))
  {
    this->Out.resize(static_cast<std::size_t>(index) + 1, 0);
  }
  if (!this->Out[index])
  {
    this->Out[index] = 1;
    // What comes out of the catheter is in the vessel that the wire before it is in.
    const std::int64_t before = index - this->Stride;
    if (before < 0 || !this->Out[before] || !this->Artery.PlaceBeside(index, before))
    {
      this->Artery.Place(index, this->Inlet);
    }
  }
  this->Artery.Find(sample, reach, contacts);
}

void ArteryLumen::Forget(std::int64_t sample)
{
  if (sample < static_cast<std::int64_t>(this->Out.size()))
  {
    this->Out[sample] = 0;
  }
  this->Artery.Forget(sample);
}

bool ArteryLumen::Outside(const ContactSample& sample, WallPlace& place, Vector3& velocity)
{
  const bool outside = this->Artery.Outside(sample, place);
  velocity = outside ? this->Artery.Velocity(place) : Vector3(Vector3::Zero());
  return outside;
}

AortaAndArtery::AortaAndArtery(
  VesselWall& aorta, VesselWall& artery, std::int64_t inlet, std::int64_t offset, AortaSide first)
  : Aorta(aorta)
  , Artery(artery)
  , Inlet(inlet)
  , Offset(offset)
  , First(first)
{
}

void AortaAndArtery::Forget(std::int64_t sample)
{
  if (sample < static_cast<std::int64_t>(this->Sides.size()))
  {
    this->Sides[sample] = AortaSide::Unknown;
  }
  this->Aorta.Forget(sample + this->Offset);
  this->Artery.Forget(sample + this->Offset);
}

/// Where it is now; what is left behind is forgotten.
AortaSide& AortaAndArtery::Side(const ContactSample& sample, ContactSample& own)
{
  own = sample;
  own.index = sample.index + this->Offset;
  if (sample.index >= static_cast<std::int64_t>(this->Sides.size()))
  {
    this->Sides.resize(static_cast<std::size_t>(sample.index) + 1, AortaSide::Unknown);
  }
  AortaSide& side = this->Sides[sample.index];
  const bool near = (sample.centre - this->Mouth).norm() <= MouthReach;
  if (near && side != AortaSide::Mouth)
  {
    if (side != AortaSide::Artery)
    {
      this->Artery.Place(own.index, this->Inlet);
    }
    side = AortaSide::Mouth;
  }
  else if (!near && side != AortaSide::Aorta && side != AortaSide::Artery)
  {
    const bool inside = (side == AortaSide::Unknown && this->First == AortaSide::Aorta) ||
      this->Aorta.Closest(sample.centre).distance > 0.0;
    if (side == AortaSide::Unknown && !inside)
    {
      this->Artery.Place(own.index, this->Inlet);
    }
    (inside ? this->Artery : this->Aorta).Forget(own.index);
    side = inside ? AortaSide::Aorta : AortaSide::Artery;
  }
  return side;
}

void AortaAndArtery::Find(const ContactSample& sample, double reach, SampleContacts& contacts)
{
  ContactSample own;
  switch (this->Side(sample, own))
  {
    case AortaSide::Mouth:
      JoinedLumen(this->Aorta, this->Artery, this->Mouth, MouthReach).Find(own, reach, contacts);
      break;
    case AortaSide::Artery:
      this->Artery.Find(own, reach, contacts);
      break;
    default:
      this->Aorta.Find(own, reach, contacts);
  }
}

bool AortaAndArtery::Outside(const ContactSample& sample, WallPlace& place, Vector3& velocity)
{
  ContactSample own;
  const AortaSide side = this->Side(sample, own);
  WallPlace ofAorta;
  if (side != AortaSide::Artery && !this->Aorta.Outside(own, ofAorta))
  {
    return false;
  }
  if (side != AortaSide::Aorta)
  {
    WallPlace ofArtery;
    if (!this->Artery.Outside(own, ofArtery))
    {
      return false;
    }
    if (side == AortaSide::Artery || ofArtery.distance > ofAorta.distance)
    {
      place = ofArtery;
      velocity = this->Artery.Velocity(place);
      return true;
    }
  }
  place = ofAorta;
  velocity = this->Aorta.Velocity(place);
  return true;
}

int AortaAndArtery::BranchAt(const ContactSample& sample)
{
  ContactSample own;
  const AortaSide side = this->Side(sample, own);
  WallPlace place;
  const bool inAorta =
    side == AortaSide::Aorta || (side == AortaSide::Mouth && !this->Aorta.Outside(own, place));
  return inAorta ? -1 : this->Artery.BranchAt(own);
}
}
