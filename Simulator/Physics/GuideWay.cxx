#include "GuideWay.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace coronary
{
void GuideWay::MakeTangents(const Vector3& otherwise)
{
  const std::size_t count = this->Now.size();
  this->Tangents.resize(count);
  for (std::size_t i = 0; i < count; ++i)
  {
    const std::size_t before = i > 0 ? i - 1 : i;
    const std::size_t after = std::min(i + 1, count - 1);
    const Vector3 way = this->Now[after] - this->Now[before];
    const double length = way.norm();
    this->Tangents[i] = length > 0.0 ? Vector3(way / length)
      : i > 0                        ? this->Tangents[i - 1]
                                     : otherwise;
  }
}

void GuideWay::CarrySides(std::size_t from, const Vector3& side)
{
  this->Sides.resize(this->Now.size());
  const auto across = [this](std::size_t i, const Vector3& before)
  { return Vector3((before - this->Tangents[i] * this->Tangents[i].dot(before)).normalized()); };
  this->Sides[from] = across(from, side);
  for (std::size_t i = from; i-- > 0;)
  {
    this->Sides[i] = across(i, this->Sides[i + 1]);
  }
  for (std::size_t i = from + 1; i < this->Now.size(); ++i)
  {
    this->Sides[i] = across(i, this->Sides[i - 1]);
  }
}

PathPlace GuideWay::At(double u) const
{
  const double index =
    std::clamp((u - this->Begin) / Spacing, 0.0, static_cast<double>(this->Now.size() - 1));
  const std::size_t before = std::min(static_cast<std::size_t>(index), this->Now.size() - 2);
  const double share = index - static_cast<double>(before);
  PathPlace place;
  place.position = (1.0 - share) * this->Now[before] + share * this->Now[before + 1];
  place.tangent =
    ((1.0 - share) * this->Tangents[before] + share * this->Tangents[before + 1]).normalized();
  const Vector3 side = (1.0 - share) * this->Sides[before] + share * this->Sides[before + 1];
  place.side = (side - place.tangent * place.tangent.dot(side)).normalized();
  place.velocity = this->VelocityAt(before, share);
  // Beyond an end it goes straight on.
  const double beyond = u - std::clamp(u, this->First(), this->Last());
  place.position += beyond * place.tangent;
  return place;
}

double GuideWay::Nearest(const Vector3& point, double from, double to) const
{
  const int last = static_cast<int>(this->Now.size()) - 2;
  const auto pieceOf = [this](double u)
  { return static_cast<int>(std::floor((u - this->Begin) / Spacing)); };
  const int first = std::clamp(pieceOf(from), 0, last);
  const int end = std::clamp(pieceOf(to), first, last);
  double best = std::numeric_limits<double>::infinity();
  double found = from;
  for (int i = first; i <= end; ++i)
  {
    const SegmentPlace place = NearestOnSegment(point, this->Now[i], this->Now[i + 1]);
    if (place.squaredDistance < best)
    {
      best = place.squaredDistance;
      found = this->Begin + (i + place.fraction) * Spacing;
    }
  }
  return std::clamp(found, from, to);
}
}
