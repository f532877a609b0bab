#include "ThoraxAnatomy.h"

#include "CounterRandom.h"
#include "Numbers.h"
#include "PhantomMotion.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double Midline =
  -20.0; ///< world x of the patient's midline: the left ostium is left of it

// Hounsfield units at 100 to 120 kVp; cortical bone is that of a shell thinner than a voxel.
constexpr float Blood = 45.0F;
constexpr float Air = -985.0F;
constexpr float Cartilage = 110.0F;
constexpr float RibCortex = 1350.0F;
constexpr float RibMarrow = 160.0F;
constexpr float VertebraCortex = 1050.0F;
constexpr float VertebraMarrow = 220.0F;
constexpr float FlatBoneMarrow = 110.0F;

/// The wall's cross-section when its half width, and its depths behind and before its centre are 1: outwards, back.
constexpr std::array<std::array<double, 2>, 13> WallOutline{ { { 0.0, 1.0 }, { 0.28, 1.0 },
  { 0.47, 0.98 }, { 0.71, 0.83 }, { 0.88, 0.57 }, { 0.976, 0.24 }, { 1.0, -0.08 }, { 0.96, -0.40 },
  { 0.85, -0.66 }, { 0.67, -0.86 }, { 0.43, -0.97 }, { 0.16, -1.0 }, { 0.0, -1.0 } } };
constexpr int WallSteps = 360;

constexpr int Seventh = 7;              ///< thoracic vertebra
constexpr double SeventhHeight = -20.0; ///< its centre, world z: the left main is at the disc above

/// Where ribs end: angle from the back, degrees. What a whole rib would go down to the sternum, mm.
constexpr std::array<double, 12> RibEnds{ 148, 149, 148, 145, 142, 138, 132, 124, 116, 108, 84,
  60 };
constexpr std::array<double, 12> RibDrops{ 38, 55, 68, 78, 86, 92, 97, 100, 101, 99, 95, 90 };
/// Where the cartilages of the upper seven reach the sternum, world z.
constexpr std::array<double, 7> SternalHeights{ 74, 44, 24, 5, -14, -30, -44 };

/// Distance from an ellipse or ellipsoid, first order: f |f| of its level function over the gradient.
double EllipticDistance(double level, double gradient)
{
  return gradient > 1e-12 ? level * (level - 1.0) / gradient : -1e9;
}

ThoraxBox Box(const ThoraxRod& rod)
{
  const double reach = std::max({ rod.radii[0], rod.radii[1], rod.heights[0], rod.heights[1] });
  const Vector3 to = rod.from + rod.length * rod.forward;
  return { rod.from.cwiseMin(to).array() - reach, rod.from.cwiseMax(to).array() + reach };
}

ThoraxBox Box(const ThoraxDrum& drum)
{
  const Vector3 reach = drum.axes.cwiseAbs().transpose() * drum.half;
  return { drum.centre - reach, drum.centre + reach };
}

ThoraxBox Box(const ThoraxPlate& plate)
{
  const auto& [a, b, c] = plate.corners;
  return { a.cwiseMin(b).cwiseMin(c).array() - plate.half,
    a.cwiseMax(b).cwiseMax(c).array() + plate.half };
}

/// @param across  need not be at a right angle to the way
ThoraxRod Flat(const Vector3& from, const Vector3& to, const Vector3& across,
  const std::array<double, 2>& radii, const std::array<double, 2>& heights)
{
  const double length = (to - from).norm();
  const Vector3 forward = (to - from) / length;
  return { from, forward, length, (across - across.dot(forward) * forward).normalized(), radii,
    heights };
}

ThoraxRod Round(const Vector3& from, const Vector3& to, double first, double last)
{
  const Vector3 way = to - from;
  const bool sideways = std::abs(way.x()) > 0.8 * way.norm();
  return Flat(
    from, to, sideways ? Vector3::UnitY() : Vector3::UnitX(), { first, last }, { first, last });
}

/// A smooth line through points (Catmull-Rom, centripetal enough for evenly spaced ones).
std::vector<Vector3> Curve(const std::vector<Vector3>& points, int steps)
{
  std::vector<Vector3> curve;
  const auto at = [&points](std::size_t i, int offset)
  {
    const auto index = static_cast<std::ptrdiff_t>(i) + offset;
    return points[static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(index, 0, static_cast<std::ptrdiff_t>(points.size()) - 1))];
  };
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
  {
    for (int j = 0; j < steps; ++j)
    {
      const double t = static_cast<double>(j) / steps;
      const Vector3 a = at(i, -1);
      const Vector3 b = at(i, 0);
      const Vector3 c = at(i, 1);
      const Vector3 d = at(i, 2);
      curve.push_back(0.5 *
        (2.0 * b + t * (c - a) + t * t * (2.0 * a - 5.0 * b + 4.0 * c - d) +
          t * t * t * (3.0 * b - a - 3.0 * c + d)));
    }
  }
  curve.push_back(points.back());
  return curve;
}

/// A round tube through points with radii.
void AddTube(std::vector<ThoraxPart>& parts, const std::vector<Vector3>& points,
  const std::vector<double>& radii)
{
  constexpr int steps = 6;
  const std::vector<Vector3> line = Curve(points, steps);
  const auto radius = [&](std::size_t i)
  {
    const std::size_t knot = std::min(i / steps, radii.size() - 2);
    const double t = static_cast<double>(i - knot * steps) / steps;
    return radii[knot] + t * (radii[knot + 1] - radii[knot]);
  };
  for (std::size_t i = 0; i + 1 < line.size(); ++i)
  {
    parts.emplace_back(Round(line[i], line[i + 1], radius(i), radius(i + 1)));
  }
}

/// Standard deviations that a patient differs by; none for seed 0.
double Varied(std::uint64_t seed, std::uint64_t purpose, double deviation)
{
  return seed == 0 ? 0.0 : deviation * RandomStream(seed, 300 + purpose).Normal(2.0);
}
}

double DistanceTo(const ThoraxRod& rod, const Vector3& p)
{
  const Vector3 from = p - rod.from;
  const double along = from.dot(rod.forward);
  const double fraction = std::clamp(along / rod.length, 0.0, 1.0);
  const double radius = rod.radii[0] + fraction * (rod.radii[1] - rod.radii[0]);
  const double height = rod.heights[0] + fraction * (rod.heights[1] - rod.heights[0]);
  const double u = from.dot(rod.across);
  const double v = from.dot(rod.forward.cross(rod.across));
  // Beyond the ends: half an ellipsoid, as long as it is thin.
  const double w = along - fraction * rod.length;
  const double end = std::min(radius, height);
  const Vector3 level(u / radius, v / height, w / end);
  const Vector3 gradient(u / (radius * radius), v / (height * height), w / (end * end));
  return EllipticDistance(level.norm(), gradient.norm());
}

double DistanceTo(const ThoraxDrum& drum, const Vector3& p)
{
  const Vector3 q = drum.axes * (p - drum.centre);
  const double up = std::min(1.0, std::abs(q.z()) / drum.half.z());
  const double narrow = 1.0 - drum.waist * (1.0 - up * up);
  const double width = drum.half.x() * narrow;
  const double depth = drum.half.y() * narrow;
  const double level = std::hypot(q.x() / width, q.y() / depth);
  const double gradient = std::hypot(q.x() / (width * width), q.y() / (depth * depth));
  const double side = level > 1e-6 ? EllipticDistance(level, gradient) : -std::min(width, depth);
  const double end = std::abs(q.z()) - drum.half.z();
  if (side > 0.0 && end > 0.0)
  {
    return std::hypot(side, end);
  }
  return std::max(side, end);
}

double DistanceTo(const ThoraxPlate& plate, const Vector3& p)
{
  // To the triangle: its plane when the foot is inside, else the nearest edge.
  const auto& [a, b, c] = plate.corners;
  const Vector3 normal = (b - a).cross(c - a).normalized();
  const bool inside = (b - a).cross(p - a).dot(normal) >= 0.0 &&
    (c - b).cross(p - b).dot(normal) >= 0.0 && (a - c).cross(p - c).dot(normal) >= 0.0;
  if (inside)
  {
    return std::abs((p - a).dot(normal)) - plate.half;
  }
  const double square = std::min({ NearestOnSegment(p, a, b).squaredDistance,
    NearestOnSegment(p, b, c).squaredDistance, NearestOnSegment(p, c, a).squaredDistance });
  return std::sqrt(square) - plate.half;
}

ThoraxBox BoxOf(const ThoraxPart& part)
{
  return std::visit([](const auto& shape) { return Box(shape); }, part);
}

HeightProfile::HeightProfile(std::vector<std::array<double, 2>> knots)
  : Knots(std::move(knots))
{
}

double HeightProfile::operator()(double z) const
{
  if (z <= this->Knots.front()[0])
  {
    return this->Knots.front()[1];
  }
  const auto above = std::find_if(
    this->Knots.begin(), this->Knots.end(), [z](const auto& knot) { return knot[0] > z; });
  if (above == this->Knots.end())
  {
    return this->Knots.back()[1];
  }
  const auto slope = [this](std::ptrdiff_t i)
  {
    // Between two knots; the harmonic mean of both sides' is the knot's: it does not overshoot.
    const auto at = [this](std::ptrdiff_t j) { return this->Knots[static_cast<std::size_t>(j)]; };
    const auto last = static_cast<std::ptrdiff_t>(this->Knots.size()) - 1;
    if (i == 0 || i == last)
    {
      return 0.0;
    }
    const double before = (at(i)[1] - at(i - 1)[1]) / (at(i)[0] - at(i - 1)[0]);
    const double after = (at(i + 1)[1] - at(i)[1]) / (at(i + 1)[0] - at(i)[0]);
    return before * after <= 0.0 ? 0.0 : 2.0 * before * after / (before + after);
  };
  const std::ptrdiff_t i = above - this->Knots.begin();
  const auto& [z0, v0] = *(above - 1);
  const auto& [z1, v1] = *above;
  const double width = z1 - z0;
  const double t = (z - z0) / width;
  const double s = 1.0 - t;
  return v0 * (1.0 + 2.0 * t) * s * s + v1 * (1.0 + 2.0 * s) * t * t +
    width * t * s * (slope(i - 1) * s - slope(i) * t);
}

ThoraxAnatomy::ThoraxAnatomy(const ThoraxSettings& settings)
  : Settings(settings)
  , Lateral(settings.width / 340.0 * (1.0 + Varied(settings.seed, 0, 0.02)))
  , Sagittal(0.5 * (1.0 + settings.width / 340.0) * (1.0 + Varied(settings.seed, 1, 0.02)))
  , RibSlope(1.0 + Varied(settings.seed, 2, 0.08))
  , Scoliosis(Varied(settings.seed, 3, 2.5))
  , Kyphosis(1.0 + Varied(settings.seed, 4, 0.15))
  , HalfWidths({ { -210, 124 }, { -140, 136 }, { -90, 137 }, { -40, 133 }, { 0, 125 }, { 30, 114 },
      { 60, 98 }, { 80, 82 }, { 100, 60 }, { 112, 44 }, { 125, 30 } })
  , Fronts({ { -210, -92 }, { -120, -101 }, { -60, -98 }, { 0, -87 }, { 43, -70 }, { 88, -44 },
      { 115, -30 }, { 150, -38 } })
  , SkinWidths({ { -210, 152 }, { -150, 158 }, { -90, 166 }, { -30, 170 }, { 30, 173 }, { 70, 181 },
      { 95, 186 }, { 112, 168 }, { 130, 98 }, { 150, 66 } })
{
  this->MakeWall();
  this->MakeVertebrae();
  this->AddGreatVessels();
  for (const int side : { -1, 1 })
  {
    this->AddLungVessels(side);
  }
  for (int number = 0; number < static_cast<int>(this->Vertebrae.size()); ++number)
  {
    this->AddVertebra(number);
  }
  for (const int side : { -1, 1 })
  {
    for (int number = 1; number <= 12; ++number)
    {
      this->AddRib(number, side);
    }
    this->AddShoulder(side);
  }
  this->AddSternum();
}

/// The outline as radii over the angle, without corners.
void ThoraxAnatomy::MakeWall()
{
  this->WallRadii.resize(WallSteps + 1);
  std::size_t k = 0;
  for (int i = 0; i <= WallSteps; ++i)
  {
    const double angle = Pi * i / WallSteps;
    const auto angleOf = [](const std::array<double, 2>& q) { return std::atan2(q[0], q[1]); };
    while (k + 2 < WallOutline.size() && angleOf(WallOutline[k + 1]) < angle)
    {
      ++k;
    }
    const double a = angleOf(WallOutline[k]);
    const double b = angleOf(WallOutline[k + 1]);
    const double t = std::clamp((angle - a) / (b - a), 0.0, 1.0);
    const auto radius = [](const std::array<double, 2>& q) { return std::hypot(q[0], q[1]); };
    this->WallRadii[static_cast<std::size_t>(i)] =
      static_cast<float>(radius(WallOutline[k]) * (1.0 - t) + radius(WallOutline[k + 1]) * t);
  }
  const std::vector<float> raw = this->WallRadii;
  for (int i = 0; i <= WallSteps; ++i)
  {
    float sum = 0.0F;
    for (int j = i - 12; j <= i + 12; ++j)
    {
      const int place = std::abs(j) > WallSteps ? 2 * WallSteps - j : std::abs(j);
      sum += raw[static_cast<std::size_t>(place)];
    }
    this->WallRadii[static_cast<std::size_t>(i)] = sum / 25.0F;
  }
}

double ThoraxAnatomy::MidX(double z) const
{
  return Midline + this->Scoliosis * std::sin((z + 20.0) / 70.0);
}

double ThoraxAnatomy::SpineY(double z) const
{
  const double u = (z + 20.0) / 130.0;
  return this->Sagittal * (58.0 - this->Kyphosis * 22.0 * u * u);
}

double ThoraxAnatomy::FrontY(double z) const
{
  return this->Sagittal * this->Fronts(z);
}

ThoraxSlice ThoraxAnatomy::Slice(double z) const
{
  const double more = this->Settings.fat - 12.0;
  ThoraxSlice slice{};
  slice.middleX = this->MidX(z);
  slice.front = this->FrontY(z);
  slice.back = this->SpineY(z) + 34.0 * this->Sagittal;
  slice.halfWidth = this->Lateral * this->HalfWidths(z);
  slice.skinFront = slice.front - 23.0 - more;
  slice.skinBack = slice.back + 36.0 + more;
  slice.skinHalfWidth = this->Lateral * this->SkinWidths(z) + more;
  return slice;
}

Vector3 ThoraxAnatomy::OnWall(double angle, double z, int side) const
{
  const double step = std::clamp(angle / Pi, 0.0, 1.0) * WallSteps;
  const int i = std::min(static_cast<int>(step), WallSteps - 1);
  const double radius = this->WallRadii[static_cast<std::size_t>(i)] +
    (step - i) *
      (this->WallRadii[static_cast<std::size_t>(i) + 1] -
        this->WallRadii[static_cast<std::size_t>(i)]);
  const ThoraxSlice slice = this->Slice(z);
  return { slice.middleX + side * slice.halfWidth * radius * std::sin(angle),
    0.5 * (slice.front + slice.back) + 0.5 * (slice.back - slice.front) * radius * std::cos(angle),
    z };
}

double ThoraxAnatomy::WallLevel(const ThoraxSlice& slice, const Vector3& p, double& radius) const
{
  const double dx = std::abs(p.x() - slice.middleX);
  const double dy = p.y() - 0.5 * (slice.front + slice.back);
  const double x = dx / slice.halfWidth;
  const double y = dy / (0.5 * (slice.back - slice.front));
  radius = std::hypot(dx, dy);
  const auto i = static_cast<std::size_t>(std::lrint(std::atan2(x, y) / Pi * WallSteps));
  return std::hypot(x, y) / this->WallRadii[i];
}

double ThoraxAnatomy::WallDistance(double level, double radius)
{
  return level > 0.05 ? radius * (1.0 - 1.0 / level) : -1e3;
}

double ThoraxAnatomy::SkinDistance(const ThoraxSlice& slice, const Vector3& p)
{
  // A superellipse of exponent 2.5.
  const double dx = std::abs(p.x() - slice.middleX);
  const double dy = std::abs(p.y() - 0.5 * (slice.skinFront + slice.skinBack));
  const double x = dx / slice.skinHalfWidth;
  const double y = 2.0 * dy / (slice.skinBack - slice.skinFront);
  const double level = std::pow(x * x * std::sqrt(x) + y * y * std::sqrt(y), 0.4);
  return WallDistance(level, std::sqrt(dx * dx + dy * dy));
}

double ThoraxAnatomy::DiaphragmHeight(const ThoraxSlice& slice, const Vector3& p) const
{
  constexpr double highest = -60.0;
  constexpr double rounding = 6.0; ///< mm: domes have no crease between them
  if (p.z() > highest)
  {
    return highest - rounding;
  }
  const double x = (p.x() - slice.middleX) / this->Lateral;
  const double y = p.y() / this->Sagittal;
  const auto dome = [x, y](double middleX, double middleY, double top, double halfX, double halfY)
  {
    const double u = (x - middleX) / halfX;
    const double v = (y - middleY) / halfY;
    const double q = u * u + v * v;
    const double steep = std::max(0.0, q - 0.5);
    return top - 26.0 * q - 38.0 * steep * steep;
  };
  const double sum = std::exp(dome(-70.0, -8.0, -83.0, 62.0, 82.0) / rounding) +
    std::exp(dome(72.0, -8.0, -95.0, 60.0, 82.0) / rounding) +
    std::exp(dome(26.0, -32.0, -80.0, 66.0, 60.0) / rounding);
  return rounding * std::log(std::max(sum, 1e-300));
}

double ThoraxAnatomy::LungTop(double wallLevel)
{
  return 116.0 - 30.0 * wallLevel * wallLevel;
}

double ThoraxAnatomy::HeartDistance(const Vector3& p)
{
  static const HeartFrame frame;
  const Vector3 q = frame.ToHeart(p);
  const Vector3 u = (q - HeartFrame::Centre).cwiseQuotient(HeartFrame::Radii);
  return EllipticDistance(u.norm(), u.cwiseQuotient(HeartFrame::Radii).norm());
}

void ThoraxAnatomy::MakeVertebrae()
{
  // C7 to L2; T7 is where the left main is. Spacing and size grow downwards.
  const auto spacing = [](int number) { return 19.0 + 0.78 * std::max(0, number - 1); };
  const auto heightOf = [&spacing](int number)
  {
    double z = SeventhHeight;
    for (int k = Seventh; k < number; ++k)
    {
      z -= spacing(k);
    }
    for (int k = number; k < Seventh; ++k)
    {
      z += spacing(k);
    }
    return z;
  };
  for (int number = 0; number <= 14; ++number)
  {
    const double z = heightOf(number);
    Vertebra v;
    v.centre = Vector3(this->MidX(z), this->SpineY(z), z);
    const Vector3 up = Vector3(
      this->MidX(z + 1.0) - this->MidX(z - 1.0), this->SpineY(z + 1.0) - this->SpineY(z - 1.0), 2.0)
                         .normalized();
    const Vector3 left = (Vector3::UnitX() - up.x() * up).normalized();
    v.axes.row(0) = left;
    v.axes.row(1) = up.cross(left);
    v.axes.row(2) = up;
    v.spacing = spacing(number);
    v.disc = 3.6 + 0.28 * number;
    v.halfWidth = 13.8 + 0.72 * std::max(0, number - 5);
    v.halfDepth = number <= Seventh ? 8.2 + 0.7 * number : 13.1 + 0.35 * (number - Seventh);
    this->Vertebrae.push_back(v);
  }
}

void ThoraxAnatomy::AddVertebra(int number)
{
  const Vertebra& v = this->Vertebrae[static_cast<std::size_t>(number)];
  const double w = v.halfWidth;
  const double d = v.halfDepth;
  const double h = v.HalfHeight();

  ThoraxTissue disc;
  disc.coreValue = Cartilage;
  disc.parts.emplace_back(ThoraxDrum{
    v.At(0.0, 0.0, -0.5 * v.spacing), v.axes, Vector3(0.97 * w, 0.97 * d, 0.5 * v.disc), 0.0 });
  this->bones.push_back(std::move(disc));

  ThoraxTissue body;
  body.shell = 1.1;
  body.shellValue = VertebraCortex;
  body.coreValue = VertebraMarrow;
  body.parts.emplace_back(ThoraxDrum{ v.centre, v.axes, Vector3(w, d, h), 0.13 });
  // The rims of the end plates.
  for (const double end : { -1.0, 1.0 })
  {
    body.parts.emplace_back(
      ThoraxDrum{ v.At(0.0, 0.0, end * (h - 1.3)), v.axes, Vector3(w + 0.8, d + 0.8, 1.3), 0.0 });
  }
  this->bones.push_back(std::move(body));

  ThoraxTissue arch;
  arch.shell = 1.2;
  arch.shellValue = RibCortex;
  arch.coreValue = 180.0F;
  const double steep = number >= 5 && number <= 9 ? 55.0 : (number >= 11 ? 12.0 : 36.0);
  const double length = 30.0 + 0.4 * number;
  const double sine = std::sin(steep * Pi / 180.0);
  const double cosine = std::cos(steep * Pi / 180.0);
  const Vector3 tail = v.At(0.0, d + 21.0 + length * cosine, -5.0 - length * sine);
  arch.parts.emplace_back(
    Flat(v.At(0.0, d + 19.0, -3.0), tail, v.axes.row(0), { 2.6, 2.4 }, { 7.5, 4.5 }));
  arch.parts.emplace_back(Round(tail, tail + v.axes.row(1).transpose() * 2.0, 4.0, 3.6));
  for (const double side : { -1.0, 1.0 })
  {
    const Vector3 pedicle = v.At(side * 0.66 * w, d + 8.5, 0.3 * h);
    arch.parts.emplace_back(Flat(v.At(side * 0.62 * w, 0.75 * d, 0.32 * h), pedicle, v.axes.row(0),
      { 3.4, 3.4 }, { 6.2, 6.0 }));
    arch.parts.emplace_back(Flat(pedicle + side * v.axes.row(0).transpose(),
      v.At(side * 1.5, d + 21.0, -4.0), v.axes.row(2), { 9.0, 8.0 }, { 2.8, 2.8 }));
    const double reach = number >= 11 ? 9.0 : 17.0 - 0.5 * std::max(0, number - 6);
    arch.parts.emplace_back(
      Round(pedicle, v.At(side * (w + reach), d + 21.0, 0.3 * h + 3.0), 5.2, 4.4));
    for (const double end : { -1.0, 1.0 })
    {
      arch.parts.emplace_back(Round(v.At(side * 0.72 * w, d + 11.0, 0.2 * h),
        v.At(side * 0.72 * w, d + 12.5, 0.2 * h + end * 0.45 * v.spacing), 4.4, 3.8));
    }
  }
  this->bones.push_back(std::move(arch));
}

void ThoraxAnatomy::AddRib(int number, int side)
{
  const Vertebra& v = this->Vertebrae[static_cast<std::size_t>(number)];
  const auto index = static_cast<std::size_t>(number - 1);
  RandomStream random(this->Settings.seed, 400 + static_cast<std::uint64_t>(2 * number + side));
  const double jitter = this->Settings.seed == 0 ? 0.0 : random.Normal(2.0);
  const bool floating = number >= 11;
  const double w = v.halfWidth;
  const double d = v.halfDepth;
  // Heads are at the disc above, those of the first and the last three on their own vertebra.
  const double head = number == 1 || number >= 10 ? 0.2 : 0.95;
  std::vector<Vector3> points{ v.At(side * (w + 0.5), 0.55 * d, head * v.HalfHeight()),
    v.At(side * (w + 9.0), d + 6.0, 0.5 * v.HalfHeight() + 2.0),
    v.At(side * (w + 19.0), d + 14.5, 0.3 * v.HalfHeight() + 2.5) };

  const double start = points.back().z();
  const double drop = (RibDrops[index] + 1.5 * jitter) * this->RibSlope;
  const double end = RibEnds[index] * Pi / 180.0;
  const double first = (number == 1 ? 62.0 : (number == 2 ? 46.0 : 36.0)) * Pi / 180.0;
  const int count = std::max(3, static_cast<int>((end - first) / (15.0 * Pi / 180.0)));
  for (int i = 0; i <= count; ++i)
  {
    const double angle = first + (end - first) * i / count;
    const double fraction = (angle - 0.4) / (Pi - 0.4);
    const double z = start - drop * std::pow(std::max(0.0, fraction), 0.95);
    points.push_back(this->OnWall(angle, z, side));
  }

  ThoraxTissue rib;
  rib.shell = 1.15;
  rib.shellValue = RibCortex;
  rib.coreValue = RibMarrow;
  const std::vector<Vector3> line = Curve(points, 4);
  // Neck thin, angle stout, wider again at the front end; floating ribs are thin and pointed.
  const auto taper = [&](double t) { return floating ? 1.0 - 0.45 * t : 1.0; };
  const auto thick = [&](double t)
  { return taper(t) * (3.3 + 0.9 * std::sin(Pi * std::min(1.0, 1.8 * t))); };
  const auto tall = [&](double t)
  {
    const double stout =
      5.6 + 1.5 * std::sin(Pi * std::min(1.0, 1.6 * t)) + std::max(0.0, 5.0 * (t - 0.85));
    return taper(t) * (floating ? 5.0 : stout);
  };
  for (std::size_t i = 0; i + 1 < line.size(); ++i)
  {
    const double t = static_cast<double>(i) / static_cast<double>(line.size());
    const double next = static_cast<double>(i + 1) / static_cast<double>(line.size());
    const Vector3 outward =
      Vector3(line[i].x() - this->MidX(line[i].z()), line[i].y() + 5.0, 0.0).normalized();
    // The first rib lies flat.
    const Vector3 across = number == 1 ? Vector3(0.3 * outward + Vector3::UnitZ()) : outward;
    rib.parts.emplace_back(
      Flat(line[i], line[i + 1], across, { thick(t), thick(next) }, { tall(t), tall(next) }));
  }
  this->bones.push_back(std::move(rib));
  if (number <= 10)
  {
    this->AddCartilage(number, side, line.back());
  }
}

void ThoraxAnatomy::AddCartilage(int number, int side, const Vector3& from)
{
  ThoraxTissue cartilage;
  cartilage.shell = 0.7;
  cartilage.shellValue = 200.0F;
  cartilage.coreValue = Cartilage;
  std::vector<Vector3> points{ from };
  if (number <= 7)
  {
    const double z = SternalHeights[static_cast<std::size_t>(number - 1)];
    const double halfWidth = number == 1 ? 22.0 : 15.0;
    const Vector3 end(this->MidX(z) + side * halfWidth, this->FrontY(z) - 1.0, z);
    const double angle = RibEnds[static_cast<std::size_t>(number - 1)] * Pi / 180.0;
    points.push_back(
      this->OnWall(0.6 * angle + 0.4 * Pi, 0.7 * from.z() + 0.3 * end.z() - 4.0, side));
    points.push_back(end);
  }
  else
  {
    // To the cartilage above.
    const double angle = RibEnds[static_cast<std::size_t>(number - 1)] * Pi / 180.0;
    points.push_back(this->OnWall(angle + 0.18, from.z() - 4.0, side));
    points.push_back(this->OnWall(angle + 0.42, from.z() + 14.0, side));
  }
  const std::vector<Vector3> line = Curve(points, 6);
  for (std::size_t i = 0; i + 1 < line.size(); ++i)
  {
    cartilage.parts.emplace_back(
      Flat(line[i], line[i + 1], -Vector3::UnitY(), { 4.0, 4.0 }, { 6.0, 6.0 }));
  }
  this->bones.push_back(std::move(cartilage));
}

void ThoraxAnatomy::AddSternum()
{
  ThoraxTissue sternum;
  sternum.shell = 1.0;
  sternum.shellValue = 700.0F;
  sternum.coreValue = FlatBoneMarrow;
  const std::array<std::array<double, 2>, 8> outline{ { { 86.0, 24.0 }, { 74.0, 25.0 },
    { 58.0, 19.0 }, { 45.0, 15.0 }, { 20.0, 16.0 }, { -15.0, 19.0 }, { -45.0, 17.0 },
    { -58.0, 10.0 } } };
  for (std::size_t i = 0; i + 1 < outline.size(); ++i)
  {
    const auto at = [&](std::size_t k)
    {
      const double z = outline[k][0];
      return Vector3(this->MidX(z), this->FrontY(z) - 1.0, z);
    };
    sternum.parts.emplace_back(
      Flat(at(i), at(i + 1), Vector3::UnitX(), { outline[i][1], outline[i + 1][1] }, { 5.5, 5.5 }));
  }
  const double tip = -80.0;
  sternum.parts.emplace_back(Flat(Vector3(this->MidX(-60.0), this->FrontY(-60.0), -60.0),
    Vector3(this->MidX(tip), this->FrontY(tip) + 3.0, tip), Vector3::UnitX(), { 8.0, 4.0 },
    { 3.0, 2.0 }));
  this->bones.push_back(std::move(sternum));
}

void ThoraxAnatomy::AddShoulder(int side)
{
  const auto place = [this, side](double x, double y, double z)
  { return Vector3(this->MidX(z) + side * this->Lateral * x, this->Sagittal * y, z); };

  ThoraxTissue clavicle;
  clavicle.shell = 1.6;
  clavicle.shellValue = RibCortex;
  clavicle.coreValue = 250.0F;
  AddTube(clavicle.parts,
    { place(22, -46, 88), place(45, -54, 95), place(80, -48, 105), place(118, -18, 112),
      place(150, 6, 112) },
    { 9.0, 6.5, 5.8, 5.8, 7.0 });
  this->bones.push_back(std::move(clavicle));

  ThoraxTissue scapula;
  scapula.shell = 1.2;
  scapula.shellValue = 1000.0F;
  scapula.coreValue = 250.0F;
  const Vector3 top = place(84, 92, 92);
  const Vector3 bottom = place(104, 108, -42);
  const Vector3 socket = place(150, 40, 82);
  const Vector3 middle = place(108, 100, 30);
  const Vector3 root = place(82, 104, 62);
  const Vector3 tip = place(164, 40, 106);
  for (const auto& [a, b, c] : std::vector<std::array<Vector3, 3>>{ { top, root, socket },
         { root, middle, socket }, { root, bottom, middle }, { middle, bottom, socket } })
  {
    scapula.parts.emplace_back(ThoraxPlate{ { a, b, c }, 1.5 });
  }
  AddTube(scapula.parts, { bottom, place(132, 84, 18), place(148, 48, 70) }, { 4.5, 4.8, 6.5 });
  AddTube(scapula.parts, { bottom, place(88, 110, 10), root, top }, { 3.6, 2.8, 2.8, 3.0 });
  AddTube(scapula.parts, { root, place(120, 96, 88), tip }, { 3.2, 5.0, 6.5 });
  scapula.parts.emplace_back(Round(socket, place(154, 36, 84), 13.0, 12.0));
  this->bones.push_back(std::move(scapula));

  ThoraxTissue humerus;
  humerus.shell = 2.5;
  humerus.shellValue = RibCortex;
  humerus.coreValue = 200.0F;
  AddTube(humerus.parts, { place(168, 28, 88), place(182, 20, 118), place(192, 10, 160) },
    { 19.0, 14.0, 11.0 });
  this->bones.push_back(std::move(humerus));
}

void ThoraxAnatomy::AddGreatVessels()
{
  const double mid = Midline;
  const auto spine = [this](double z, double x, double before)
  { return Vector3(this->MidX(z) + x, this->SpineY(z) - before, z); };

  ThoraxTissue blood;
  blood.coreValue = Blood;
  AddTube(blood.parts,
    { Vector3(-13, -4, -18), Vector3(-20, -12, 12), Vector3(-22, -10, 40), Vector3(-14, 4, 62),
      Vector3(-2, 24, 66), spine(50, 21, 16), spine(20, 23, 13), spine(-30, 22, 13),
      spine(-90, 17, 17), spine(-150, 10, 24), spine(-210, 4, 28) },
    { 15, 15.5, 15, 13.5, 12.5, 12.5, 12, 11.5, 11, 10.5, 10 });
  AddTube(
    blood.parts, { Vector3(0, -38, -15), Vector3(8, -24, 14), Vector3(8, -4, 32) }, { 15, 14, 13 });
  AddTube(blood.parts, { Vector3(6, -4, 31), Vector3(mid + 4, 8, 26), Vector3(mid - 42, 14, 20) },
    { 12, 11, 9.5 });
  AddTube(blood.parts, { Vector3(8, -2, 33), Vector3(18, 14, 34), Vector3(mid + 46, 26, 30) },
    { 12, 11, 9.5 });
  AddTube(blood.parts,
    { Vector3(mid - 18, -14, 92), Vector3(mid - 24, -8, 60), Vector3(mid - 26, 2, 5) },
    { 8, 10, 11 });
  AddTube(blood.parts,
    { Vector3(mid - 24, 14, -50), Vector3(mid - 24, 16, -100), spine(-190, -16, 26) },
    { 13, 12, 11 });
  for (const double x : { -16.0, 2.0, 16.0 })
  {
    AddTube(
      blood.parts, { Vector3(mid + 0.6 * x + 3, 4, 66), Vector3(mid + 1.4 * x, 2, 112) }, { 6, 5 });
  }
  // Atria.
  blood.parts.emplace_back(Round(Vector3(mid - 20, -10, -20), Vector3(mid - 18, -4, -48), 27, 28));
  blood.parts.emplace_back(Round(Vector3(mid + 2, 20, -22), Vector3(mid + 42, 16, -30), 22, 24));
  this->vessels.push_back(blood);

  ThoraxTissue airway;
  airway.shell = 1.5;
  airway.shellValue = 60.0F;
  airway.coreValue = Air;
  AddTube(airway.parts, { Vector3(mid, 2, 150), Vector3(mid, 12, 100), Vector3(mid - 1, 22, 46) },
    { 9.5, 9.5, 9.5 });
  AddTube(airway.parts,
    { Vector3(mid - 2, 22, 44), Vector3(mid - 24, 24, 22), Vector3(mid - 38, 24, -5) },
    { 8, 7, 5 });
  AddTube(airway.parts,
    { Vector3(mid, 22, 44), Vector3(mid + 24, 27, 24), Vector3(mid + 44, 28, 6) },
    { 7.5, 6.5, 4.5 });
  this->airways.push_back(std::move(airway));

  // What the lungs do not reach: around the spine, behind the sternum, around heart and vessels.
  for (std::size_t k = 0; k + 1 < this->Vertebrae.size(); ++k)
  {
    const Vertebra& upper = this->Vertebrae[k];
    const Vertebra& lower = this->Vertebrae[k + 1];
    this->mediastinum.emplace_back(Flat(upper.At(0, 18, 0), lower.At(0, 18, 0), Vector3::UnitX(),
      { upper.halfWidth + 6.0, lower.halfWidth + 6.0 }, { 28.0, 28.0 }));
  }
  this->mediastinum.emplace_back(Flat(Vector3(mid - 2, 6, 118), Vector3(mid - 4, 0, 50),
    Vector3::UnitX(), { 21.0, 20.0 }, { 28.0, 32.0 }));
  this->mediastinum.emplace_back(Flat(Vector3(mid - 2, 2, 50), Vector3(mid + 8, -5, -60),
    Vector3::UnitX(), { 18.0, 24.0 }, { 36.0, 52.0 }));
  this->mediastinum.emplace_back(
    Flat(Vector3(mid, this->FrontY(70) + 14.0, 70), Vector3(mid + 6, this->FrontY(-80) + 14.0, -80),
      Vector3::UnitX(), { 20.0, 22.0 }, { 20.0, 20.0 }));
  this->mediastinum.insert(this->mediastinum.end(), blood.parts.begin(), blood.parts.end());
}

void ThoraxAnatomy::AddLungVessels(int side)
{
  RandomStream random(this->Settings.seed, side < 0 ? 501 : 502);
  ThoraxTissue tissue;
  tissue.coreValue = Blood;
  const double x = Midline + side * 43.0;
  const Vector3 hilum(x, 20.0, side < 0 ? 18.0 : 26.0);
  // Lower, upper, middle or lingular, posterior.
  const std::array<Vector3, 5> directions{ Vector3(0.35 * side, 0.25, -0.9),
    Vector3(0.45 * side, -0.15, 0.88), Vector3(0.7 * side, -0.7, -0.15),
    Vector3(0.85 * side, 0.35, 0.1), Vector3(0.6 * side, 0.1, -0.75) };
  const std::array<double, 5> radii{ 6.6, 5.4, 4.0, 4.2, 4.6 };
  for (std::size_t i = 0; i < directions.size(); ++i)
  {
    this->Branch(tissue, hilum, directions[i].normalized(), radii[i], 0, random);
  }
  this->vessels.push_back(std::move(tissue));
}

void ThoraxAnatomy::Branch(ThoraxTissue& tissue, const Vector3& from, const Vector3& direction,
  double radius, int generation, RandomStream& random) const
{
  const double length = (5.5 + 2.0 * random.Uniform()) * std::pow(radius, 0.75) + 4.0;
  const Vector3 to = from + length * direction;
  const ThoraxSlice slice = this->Slice(to.z());
  double outwards = 0.0;
  const double level = this->WallLevel(slice, to, outwards);
  const bool inLung = WallDistance(level, outwards) < -8.0 &&
    to.z() > this->DiaphragmHeight(slice, to) + 3.0 && to.z() < LungTop(level) - 5.0;
  if (radius < 0.65 || generation > 11 || !inLung)
  {
    return;
  }
  tissue.parts.emplace_back(Round(from, to, radius, 0.88 * radius));
  // Two daughters in a plane of any direction; Murray's law between their radii.
  const Vector3 any(random.Normal(), random.Normal(), random.Normal());
  const Vector3 aside = (any - any.dot(direction) * direction).normalized();
  const double share = random.Uniform(0.3, 0.5);
  const double greater = std::cbrt(1.0 - share);
  const double less = std::cbrt(share);
  const double spread = random.Uniform(0.35, 0.6);
  this->Branch(tissue, to, (direction + spread * share * 1.6 * aside).normalized(),
    0.95 * radius * greater, generation + 1, random);
  this->Branch(tissue, to, (direction - spread * 1.5 * aside).normalized(), 0.95 * radius * less,
    generation + 1, random);
}
}
