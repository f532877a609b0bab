#include "OcclusionPlug.h"

#include "Fnv1a.h"
#include "Numbers.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double Around = 1.0;  // mm from its middle, where the plane ends
constexpr double MostWay = 0.2; // mm in a step
}

OcclusionPlug::OcclusionPlug(const Occlusion& occlusion, const std::vector<Vector3>& axis)
  : Filled(occlusion)
{
  for (const std::int64_t point : occlusion.points)
  {
    this->Next.push_back(axis[point]);
  }
  this->BeginFrame(axis, 1.0); // at rest
}

void OcclusionPlug::BeginFrame(const std::vector<Vector3>& axis, double seconds)
{
  this->Current = this->Next;
  for (std::size_t n = 0; n < this->Next.size(); ++n)
  {
    this->Next[n] = axis[this->Filled.points[n]];
  }
  this->Seconds = seconds;
  this->Middle = this->Next[this->Next.size() / 2];
  double furthest = 0.0;
  for (std::size_t n = 0; n < this->Next.size(); ++n)
  {
    furthest = std::max({ furthest, (this->Next[n] - this->Middle).squaredNorm(),
      (this->Current[n] - this->Middle).squaredNorm() });
  }
  this->Reach = std::sqrt(furthest) + Around;
  this->SetTime(0.0);
}

void OcclusionPlug::SetTime(double seconds)
{
  this->Share = std::clamp(seconds / this->Seconds, 0.0, 1.0);
  const std::vector<double>& places = this->Filled.places;
  const auto n = static_cast<std::size_t>(
    std::upper_bound(places.begin() + 1, places.end() - 1, this->Front) - places.begin() - 1);
  const double step = places[n + 1] - places[n];
  const double t = step > 0.0 ? (this->Front - places[n]) / step : 0.0;
  const Vector3 way = this->At(n + 1) - this->At(n);
  this->Place = this->At(n) + t * way;
  this->Tangent = way.normalized();
  this->Velocity = ((1.0 - t) * (this->Next[n] - this->Current[n]) +
                     t * (this->Next[n + 1] - this->Current[n + 1])) /
    this->Seconds;
}

bool OcclusionPlug::Holds(const Vector3& point) const
{
  if ((point - this->Middle).squaredNorm() > this->Reach * this->Reach)
  {
    return false;
  }
  for (std::size_t n = 0; n + 1 < this->Next.size(); ++n)
  {
    if (NearestOnSegment(point, this->At(n), this->At(n + 1)).squaredDistance <
      ChannelRadius * ChannelRadius)
    {
      return true;
    }
  }
  return false;
}

void OcclusionPlug::Meet(const ContactSample& sample, double reach, SampleContacts& contacts) const
{
  if (this->Holds(sample.centre))
  {
    for (int n = 0; n < contacts.count; ++n)
    {
      contacts.plane[n].friction *= TissueFriction;
    }
  }
  const Vector3 from = sample.centre - this->Place;
  const double along = from.dot(this->Tangent);
  const double gap = -along - sample.radius;
  if (this->IsCrossed() || gap > reach || along > Around ||
    (from - along * this->Tangent).squaredNorm() > Around * Around)
  {
    return;
  }
  ContactPlane plane;
  plane.normal = -this->Tangent;
  plane.gap = gap;
  plane.wallVelocity = this->Velocity;
  plane.friction = TissueFriction * sample.friction;
  plane.stiffness = Stiffness;
  if (contacts.count == 2 && contacts.plane[1].gap < contacts.plane[0].gap)
  {
    contacts.plane[0] = contacts.plane[1];
  }
  contacts.count = std::min(contacts.count, 1);
  plane.identity = contacts.count > 0 && contacts.plane[0].identity == 0 ? 1 : 0;
  contacts.plane[contacts.count++] = plane;
}

double OcclusionPlug::YieldForce(double radius) const
{
  return this->Filled.strength * Pi * radius * radius;
}

void OcclusionPlug::Yield(double force, double radius)
{
  const double beyond = (force - this->YieldForce(radius)) / Stiffness;
  this->Front = std::min(this->Front + std::clamp(beyond, 0.0, MostWay), this->Length());
}

std::uint64_t OcclusionPlug::Hash(std::uint64_t hash) const
{
  return Fnv1a(&this->Front, sizeof(this->Front), hash);
}

OcclusionPlugs::OcclusionPlugs(const WallTopology& topology, const std::vector<Vector3>& axis)
{
  for (const Occlusion& occlusion : FindOcclusions(topology))
  {
    this->Plugs.emplace_back(occlusion, axis);
  }
}

void OcclusionPlugs::BeginFrame(const std::vector<Vector3>& axis, double seconds)
{
  for (OcclusionPlug& plug : this->Plugs)
  {
    plug.BeginFrame(axis, seconds);
  }
}

void OcclusionPlugs::SetTime(double seconds)
{
  for (OcclusionPlug& plug : this->Plugs)
  {
    plug.SetTime(seconds);
  }
}

void OcclusionPlugs::Meet(const ContactSample& sample, double reach, SampleContacts& contacts) const
{
  for (const OcclusionPlug& plug : this->Plugs)
  {
    plug.Meet(sample, reach, contacts);
  }
}

std::uint64_t OcclusionPlugs::Hash(std::uint64_t hash) const
{
  for (const OcclusionPlug& plug : this->Plugs)
  {
    hash = plug.Hash(hash);
  }
  return hash;
}

double OcclusionPlugs::Press(const CosseratRod& rod)
{
  double force = 0.0;
  for (OcclusionPlug& plug : this->Plugs)
  {
    for (const RodContact& contact : rod.Contacts())
    {
      const bool isEnd = contact.segment == 0 && contact.sample + 1 == rod.SamplesPerSegment();
      if (isEnd && plug.Is(contact.normal))
      {
        force += contact.force;
        plug.Yield(contact.force, rod.Segment(0).radius);
      }
    }
  }
  return force;
}

bool OcclusionPlugs::Holds(const RodContact& contact) const
{
  return std::any_of(this->Plugs.begin(), this->Plugs.end(),
    [&](const OcclusionPlug& plug)
    { return plug.Is(contact.normal) || plug.Holds(contact.point); });
}
}
