#include "TearImage.h"

#include "Numbers.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double FaintestTear = 1e-5; // mL
constexpr double StripeRadius = 0.5;  // mm
constexpr double Dilution = 6.0;      // mL of a cloud for each of its medium
constexpr double LeastSigma = 0.8;    // mm
constexpr double SpreadSigma = 14.0;  // mm

/// A part of what is beside a hole. In sigmas of a ball of it all: outwards, along, its own.
struct Puff
{
  double outwards;
  double along;
  double sigma;
  double share;
};
constexpr std::array<Puff, 5> Puffs{ { { 0.8, 0.0, 0.65, 0.25 }, { 1.6, 1.1, 0.8, 0.2 },
  { 1.8, -1.4, 0.7, 0.2 }, { 2.7, 0.1, 0.9, 0.2 }, { 1.3, 2.6, 0.9, 0.15 } } };

/// Unit, away from the middle and across the vessel.
Vector3 OutwardsAt(
  const std::vector<Vector3>& axis, std::int64_t point, const Vector3& middle, const Vector3& along)
{
  Vector3 out = axis[point] - middle;
  out -= out.dot(along) * along;
  return out.norm() > 1e-6 ? Vector3(out.normalized()) : along.unitOrthogonal();
}
}

void AddTears(const std::vector<VesselTear>& tears, const std::vector<Vector3>& axis,
  const std::vector<double>& lumen, double attenuation, const CArmGeometry& geometry,
  LineIntegrals& image)
{
  Vector3 middle = Vector3::Zero();
  for (const Vector3& point : axis)
  {
    middle += point / static_cast<double>(axis.size());
  }
  std::vector<ContrastBlush> clouds;
  std::vector<ContrastBranch> stripes;
  for (const VesselTear& tear : tears)
  {
    const std::int64_t before = std::max<std::int64_t>(tear.point - 1, 0);
    const auto after =
      std::min<std::int64_t>(tear.point + 1, static_cast<std::int64_t>(axis.size()) - 1);
    const Vector3 along = (axis[after] - axis[before]).stableNormalized();
    const Vector3 out = OutwardsAt(axis, tear.point, middle, along);
    const Vector3 wall = axis[tear.point] + lumen[tear.point] * out;
    if (tear.beside > FaintestTear)
    {
      const double ball =
        std::max(LeastSigma, std::cbrt(750.0 * Dilution * tear.beside / Pi) / std::sqrt(5.0));
      for (const Puff& puff : Puffs)
      {
        clouds.push_back({ wall + ball * (puff.outwards * out + puff.along * along),
          puff.share * tear.beside, puff.sigma * ball });
      }
    }
    if (tear.spread > FaintestTear)
    {
      clouds.push_back({ wall + SpreadSigma * out, tear.spread, SpreadSigma });
    }
    if (tear.inWall > FaintestTear && tear.last > tear.first)
    {
      ContrastBranch stripe;
      double volume = 0.0;
      for (std::int64_t k = tear.first; k <= tear.last; ++k)
      {
        stripe.points.push_back(
          axis[k] + (lumen[k] + StripeRadius) * OutwardsAt(axis, k, middle, along));
        stripe.radii.push_back(StripeRadius);
        volume += k > tear.first ? 1e-3 * Pi * StripeRadius * StripeRadius *
            (stripe.points.back() - stripe.points[stripe.points.size() - 2]).norm()
                                 : 0.0;
      }
      stripe.concentrations.assign(
        stripe.points.size() - 1, std::min(1.0, tear.inWall / std::max(volume, FaintestTear)));
      stripes.push_back(std::move(stripe));
    }
  }
  if (!stripes.empty())
  {
    AddContrast(stripes, attenuation, geometry, image);
  }
  if (!clouds.empty())
  {
    AddBlush(clouds, attenuation, geometry, image);
  }
}
}
