#include "PhantomCollaterals.h"

#include "Numbers.h"
#include "PhantomCourses.h"
#include "Require.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr std::uint64_t CollateralPurpose =
  109;                             ///< of the random numbers, beside those of PhantomAnatomy.cxx
constexpr double CourseStep = 0.6; ///< mm between two places of the course

/// An ellipsoid of the heart along which a course runs, heart coordinates.
struct Layer
{
  Vector3 centre; ///< mm
  Vector3 radii;  ///< mm

  Vector3 Scaled(const Vector3& heart) const
  {
    return (heart - this->centre).cwiseQuotient(this->radii);
  }
  Vector3 Unscaled(const Vector3& scaled) const
  {
    return this->centre + scaled.cwiseProduct(this->radii);
  }
};

/// Nearest point of the tree to a share of a vessel's length.
std::int64_t PointAt(const PhantomAnatomy& anatomy, int vessel, double fraction)
{
  double length = 0.0;
  for (std::size_t p = 0; p < anatomy.tree.points.size(); ++p)
  {
    length = anatomy.pointVessel[p] == vessel ? std::max(length, anatomy.pointArc[p]) : length;
  }
  std::int64_t nearest = -1;
  double least = 0.0;
  for (std::size_t p = 0; p < anatomy.tree.points.size(); ++p)
  {
    const double off = std::abs(anatomy.pointArc[p] - fraction * length);
    if (anatomy.pointVessel[p] == vessel && !anatomy.occluded[p] && (nearest < 0 || off < least))
    {
      nearest = static_cast<std::int64_t>(p);
      least = off;
    }
  }
  return nearest;
}

/**
 * From one place to another along an ellipsoid of the heart, winding like a corkscrew.
 * Collaterals wind, and are 0.3 mm (CC1) to 0.4 mm and more (CC2) wide: Werner, Curr Cardiol Rev 2014;10:57.
 * @param bow  how far the middle is off the shortest way, mm
 */
std::vector<Vector3> Course(const PhantomAnatomy& anatomy, const Vector3& start, const Vector3& end,
  bool septal, double bow, const std::array<double, 2>& phases)
{
  // In the middle of the left ventricle's wall, or in the fat on the heart.
  const Layer layer = septal ? Layer{ Vector3(15.0, -4.0, 26.5), Vector3(26.5, 27.0, 48.2) }
                             : Layer{ HeartFrame::Centre, HeartFrame::Radii };
  const HeartFrame& frame = anatomy.frame;
  const Vector3 from = layer.Scaled(frame.ToHeart(start));
  const Vector3 to = layer.Scaled(frame.ToHeart(end));
  const double whole = (end - start).norm();
  const Vector3 aside = from.cross(to).normalized();
  const int count = std::max(12, static_cast<int>(std::ceil(1.3 * whole / CourseStep)));
  std::vector<Vector3> points;
  for (int i = 0; i <= count; ++i)
  {
    const double u = static_cast<double>(i) / count;
    Vector3 direction = ((1.0 - u) * from.normalized() + u * to.normalized()).normalized();
    direction = (direction + bow * 4.0 * u * (1.0 - u) / layer.radii.mean() * aside).normalized();
    // It goes straight to its layer: beside the septum there is blood.
    const double within = SmoothStep(std::min(u, 1.0 - u) * whole / 8.0);
    const double ends = u < 0.5 ? from.norm() : to.norm();
    points.push_back(frame.ToWorld(layer.Unscaled(direction * (ends + within * (1.0 - ends)))));
  }
  constexpr double amplitude = 1.1; // mm
  constexpr double wave = 7.0;      // mm along the course
  std::vector<Vector3> wound = points;
  double arc = 0.0;
  for (int i = 1; i < count; ++i)
  {
    arc += (points[i] - points[i - 1]).norm();
    const Vector3 tangent = (points[i + 1] - points[i - 1]).normalized();
    const Vector3 normal = EpicardialNormal(frame, points[i], tangent);
    const double reach = std::min({ 1.0, arc / 4.0, (points[count] - points[i]).norm() / 4.0 });
    const double angle = 2.0 * Pi * arc / wave;
    wound[i] += amplitude * reach *
      (std::sin(angle + phases[0]) * normal.cross(tangent) +
        (septal ? 0.7 : 0.4) * std::sin(1.3 * angle + phases[1]) * normal);
  }
  return wound;
}

/// From its wall to those of other arteries, away from its ends, mm.
double Clearance(const PhantomAnatomy& anatomy, const std::vector<Vector3>& course, double radius)
{
  double least = 1e3;
  for (const Vector3& place : course)
  {
    if ((place - course.front()).norm() < 5.0 || (place - course.back()).norm() < 5.0)
    {
      continue;
    }
    for (std::size_t p = 0; p < anatomy.tree.points.size(); ++p)
    {
      least = std::min(
        least, (place - anatomy.tree.points[p]).norm() - anatomy.healthyRadius[p] - radius);
    }
  }
  return least;
}

void AddOne(PhantomAnatomy& anatomy, const PhantomSettings& settings, std::size_t number)
{
  const PhantomCollateral& wanted = settings.disease.collaterals[number];
  const std::string where = "PhantomSettings: collateral " + wanted.name + ": ";
  const std::vector<std::string>& names = anatomy.vesselNames;
  const auto pointOf = [&](const std::string& vessel, double fraction)
  {
    const auto found = std::find(names.begin(), names.end(), vessel);
    Require(found != names.end(), where + "there is no vessel " + vessel);
    return PointAt(anatomy, static_cast<int>(found - names.begin()), fraction);
  };
  Require(std::find(names.begin(), names.end(), wanted.name) == names.end(),
    where + "there is a vessel of that name");
  for (const PlacedCollateral& other : anatomy.collaterals)
  {
    Require(other.collateral.name != wanted.name, where + "there is another one of that name");
  }
  const std::int64_t from = pointOf(wanted.from, wanted.fromFraction);
  const std::int64_t to = pointOf(wanted.to, wanted.toFraction);
  const PhantomTree& tree = anatomy.tree;
  const double radius = 0.5 * wanted.diameter;
  RandomStream random(settings.seed, CollateralPurpose + 1000 * number);
  const std::array<double, 2> phases{ random.Uniform(0.0, 2.0 * Pi),
    random.Uniform(0.0, 2.0 * Pi) };
  PlacedCollateral placed;
  placed.collateral = wanted;
  placed.from = from;
  placed.to = to;
  placed.clearance = -1e3;
  std::vector<Vector3> course;
  for (const double bow : { 0.0, 4.0, -4.0, 8.0, -8.0 })
  {
    const std::vector<Vector3> tried =
      Course(anatomy, tree.points[from], tree.points[to], wanted.septal, bow, phases);
    const double clearance = Clearance(anatomy, tried, radius);
    if (clearance > placed.clearance)
    {
      placed.clearance = clearance;
      course = tried;
    }
    if (clearance > 1.0)
    {
      break;
    }
  }
  const auto valueAt = [&](std::int64_t point)
  {
    return settings.lumenHU + settings.attenuationGradient * tree.abscissa[point] / 10.0 +
      anatomy.contrastChange[point];
  };
  // As dense as what it comes from and what it fills, in the mean.
  placed.value = 0.5 * (valueAt(from) + valueAt(to));
  PhantomPart part{ PartLayer::Wall, PhantomTissue::Blood, placed.value, -1, wanted.septal, false,
    {} };
  for (const Vector3& place : course)
  {
    part.nodes.push_back({ place, Vector3::UnitX(), 0.0, radius, radius });
  }
  placed.part = anatomy.parts.size();
  anatomy.parts.push_back(part);
  anatomy.collaterals.push_back(placed);
}
}

void AddCollaterals(PhantomAnatomy& anatomy, const PhantomSettings& settings)
{
  for (std::size_t n = 0; n < settings.disease.collaterals.size(); ++n)
  {
    AddOne(anatomy, settings, n);
  }
}
}
