#include "SegmentAtlas.h"

#include "Numbers.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
constexpr double Spacing = 2.0;

struct Frame
{
  Matrix3 axes;
  Vector3 origin{ -7.8, -9.8, -38.8 };

  Frame()
  {
    const Vector3 c = Vector3(0.680, -0.681, -0.273).normalized();
    Vector3 a(0.730, 0.591, 0.343);
    a = (a - a.dot(c) * c).normalized();
    this->axes.row(0) = a;
    this->axes.row(1) = c.cross(a);
    this->axes.row(2) = c;
  }

  /// The point of the epicardial ellipsoid at an azimuth in degrees and a height below the groove.
  Vector3 On(double azimuth, double height) const
  {
    const Vector3 centre(-3.9, -2.2, 29.8);
    const Vector3 radii(54.2, 41.7, 58.0);
    const Vector3 ray(
      std::cos(azimuth * Pi / 180.0) / radii[0], std::sin(azimuth * Pi / 180.0) / radii[1], 0.0);
    const Vector3 start =
      (Vector3(0.0, 0.0, height) - centre).cwiseQuotient(radii); // on the c axis
    const double a = ray.squaredNorm();
    const double b = ray.dot(start);
    const double t = (-b + std::sqrt(b * b - a * (start.squaredNorm() - 1.0))) / a;
    const Vector3 local(
      t * std::cos(azimuth * Pi / 180.0), t * std::sin(azimuth * Pi / 180.0), height);
    return this->origin + this->axes.transpose() * local;
  }
};

class Builder
{
public:
  explicit Builder(SegmentAtlas& atlas)
    : Atlas(atlas)
  {
  }

  /// Points of a vessel through `course`, on a Catmull-Rom curve.
  void Add(Vessel vessel, const std::vector<Vector3>& course)
  {
    const auto n = static_cast<int>(course.size());
    const int number = ++this->Count[static_cast<int>(vessel)];
    std::vector<Vector3> fine;
    for (int i = 0; i + 1 < n; ++i)
    {
      const Vector3& p1 = course[i];
      const Vector3& p2 = course[i + 1];
      const Vector3 m1 = i > 0 ? Vector3(0.5 * (p2 - course[i - 1])) : Vector3(p2 - p1);
      const Vector3 m2 = i + 2 < n ? Vector3(0.5 * (course[i + 2] - p1)) : Vector3(p2 - p1);
      constexpr int steps = 20;
      for (int k = 0; k < steps + (i + 2 == n ? 1 : 0); ++k)
      {
        const double u = static_cast<double>(k) / steps;
        const double u2 = u * u;
        const double u3 = u2 * u;
        fine.push_back((2.0 * u3 - 3.0 * u2 + 1.0) * p1 + (u3 - 2.0 * u2 + u) * m1 +
          (3.0 * u2 - 2.0 * u3) * p2 + (u3 - u2) * m2);
      }
    }
    double next = 0.0;
    double way = 0.0;
    for (std::size_t i = 0; i < fine.size(); ++i)
    {
      way += i > 0 ? (fine[i] - fine[i - 1]).norm() : 0.0;
      if (way >= next)
      {
        const Vector3 tangent = (fine[std::min(fine.size() - 1, i + 3)] - fine[i > 3 ? i - 3 : 0]);
        this->Atlas.points.push_back({ fine[i], tangent.normalized(), vessel, way, number });
        next = way + Spacing;
      }
    }
  }

  double ArcAt(Vessel vessel, const Vector3& position) const
  {
    double best = 1e300;
    double arc = 0.0;
    for (const SegmentAtlas::Point& point : this->Atlas.points)
    {
      if (point.vessel == vessel && (point.position - position).norm() < best)
      {
        best = (point.position - position).norm();
        arc = point.arc;
      }
    }
    return arc;
  }

private:
  SegmentAtlas& Atlas;
  int Count[NumberOfVessels] = {};
};

SegmentAtlas Build()
{
  SegmentAtlas atlas;
  const Frame frame;
  atlas.axes = frame.axes;
  atlas.origin = frame.origin;
  Builder builder(atlas);
  using V = Vector3;
  const auto on = [&](double azimuth, double height) { return frame.On(azimuth, height); };

  atlas.leftOstium = V::Zero();
  atlas.rightOstium = V(-14.4, -30.9, -14.5);
  const V mainEnd(10.8, -2.1, 0.0);
  builder.Add(Vessel::LeftMain, { V(0, 0, 0), V(3.0, -0.4, 0.4), V(6.9, -1.2, 0.5), mainEnd });
  const V d1(27.7, -15.4, -4.5);
  const V d2(35.1, -32.7, -10.2);
  const V d3(41.2, -47.4, -20.4);
  builder.Add(Vessel::AnteriorDescending,
    { mainEnd, V(15.0, -5.5, -0.8), V(20.4, -10.4, -2.0), V(25.6, -15.4, -2.6),
      V(30.7, -24.9, -6.3), V(36.0, -37.3, -11.0), V(39.1, -48.3, -19.0), V(40.1, -61.8, -31.3),
      V(42.8, -74.2, -53.5), V(46.6, -77.5, -75.8), V(44.9, -71.9, -87.8), V(42.2, -64.9, -89.1),
      V(39.2, -58.2, -89.8) });
  const V m1(18.4, 3.9, -11.3);
  const V m2(22.7, 12.0, -22.3);
  const V m3(23.6, 19.8, -35.5);
  // The groove, as far as the circumflex may follow it when the left side is dominant.
  builder.Add(Vessel::Circumflex,
    { mainEnd, V(13.7, -1.0, -2.9), V(16.4, 1.1, -7.3), m1, V(20.9, 6.4, -14.2),
      V(22.3, 10.9, -18.7), V(23.5, 13.6, -23.6), V(23.5, 17.0, -29.0), V(20.9, 20.9, -36.5),
      V(19.0, 23.5, -44.8), on(-50.0, 1.0), on(-68.0, 1.0) });
  builder.Add(Vessel::LeftPosteriorDescending,
    { on(-68.0, 1.0), on(-88.0, 1.0), on(-108.0, 2.0), on(-124.0, 7.0), on(-126.0, 20.0),
      on(-120.0, 38.0), on(-112.0, 59.0), on(-106.0, 69.0) });
  builder.Add(Vessel::LeftPosterolateral,
    { on(-60.0, 1.0), on(-72.0, 8.0), on(-75.0, 22.0), on(-75.0, 35.0), on(-76.0, 48.0) });
  builder.Add(Vessel::Diagonal,
    { d1, V(35.8, -19.8, -9.4), V(49.9, -27.7, -24.2), V(60.4, -33.8, -34.2),
      V(64.8, -39.2, -45.0) });
  builder.Add(Vessel::Diagonal,
    { d2, V(41.5, -38.7, -16.3), V(53.1, -46.1, -31.3), V(60.6, -52.2, -42.1),
      V(63.0, -56.1, -53.2) });
  builder.Add(
    Vessel::Diagonal, { d3, V(45.3, -52.1, -26.5), V(55.2, -59.2, -39.5), V(60.0, -63.5, -50.5) });
  builder.Add(
    Vessel::Septal, { V(27.3, -17.8, -5.2), V(21.1, -30.2, -22.1), V(18.5, -35.0, -30.0) });
  // Further septals leave the LAD in the same direction.
  builder.Add(
    Vessel::Septal, { V(36.3, -40.0, -12.5), V(31.5, -44.0, -20.0), V(27.0, -49.0, -29.0) });
  builder.Add(
    Vessel::Septal, { V(39.6, -54.5, -24.5), V(35.0, -57.0, -32.5), V(31.0, -60.0, -40.0) });
  builder.Add(Vessel::ObtuseMarginal,
    { m1, V(30.3, 5.9, -16.4), V(44.1, 0.8, -34.5), V(53.6, -3.0, -46.4), V(57.4, -10.3, -58.3) });
  builder.Add(Vessel::ObtuseMarginal,
    { m2, V(28.4, 15.1, -30.0), V(35.7, 12.3, -46.6), V(38.9, 7.9, -57.8), V(40.4, 0.7, -68.9) });
  builder.Add(Vessel::ObtuseMarginal,
    { m3, V(25.4, 20.5, -41.8), V(30.4, 16.2, -55.1), V(32.0, 11.0, -64.5) });
  builder.Add(Vessel::Ramus,
    { mainEnd, V(17.0, -4.0, -3.5), on(33.0, 17.0), on(24.0, 29.0), on(16.0, 41.0),
      on(10.0, 52.0) });

  const V crux(-28.9, -16.9, -74.6);
  const V margin(-45.7, -38.1, -60.3);
  builder.Add(Vessel::RightCoronary,
    { atlas.rightOstium, V(-18.8, -32.4, -16.3), V(-28.8, -36.7, -21.4), V(-35.0, -40.0, -27.5),
      V(-39.1, -40.3, -35.9), V(-43.7, -40.4, -48.6), margin, V(-43.3, -33.9, -69.2),
      V(-37.3, -30.5, -74.2), crux });
  builder.Add(Vessel::RightPosterolateral,
    { crux, V(-14.8, -5.7, -71.1), V(-9.1, 2.5, -66.5), V(-3.5, 12.7, -72.0), V(11.3, 5.8, -80.8),
      V(21.1, 1.7, -77.5), V(36.0, -1.6, -75.0) });
  builder.Add(Vessel::InferiorRight,
    { crux, V(-12.4, -2.3, -70.6), V(2.7, -8.1, -84.9), V(14.0, -14.0, -90.5) });
  builder.Add(Vessel::RightPosteriorDescending,
    { crux, on(-131.0, 9.0), on(-126.0, 22.0), on(-120.0, 38.0), on(-112.0, 59.0),
      on(-106.0, 69.0) });
  builder.Add(Vessel::RightVentricular,
    { V(-35.0, -40.0, -27.5), on(141.0, 9.0), on(134.0, 21.0), on(127.0, 34.0) });
  builder.Add(Vessel::AcuteMarginal,
    { margin, on(183.0, 9.0), on(175.0, 23.0), on(168.0, 39.0), on(162.0, 53.0) });

  const auto origin = [&](Vessel vessel, int number, Vessel from, const V& where) {
    atlas.origins.push_back({ vessel, number, builder.ArcAt(from, where) });
  };
  origin(Vessel::Diagonal, 1, Vessel::AnteriorDescending, d1);
  origin(Vessel::Diagonal, 2, Vessel::AnteriorDescending, d2);
  origin(Vessel::Diagonal, 3, Vessel::AnteriorDescending, d3);
  origin(Vessel::Septal, 1, Vessel::AnteriorDescending, V(27.3, -17.8, -5.2));
  origin(Vessel::Septal, 2, Vessel::AnteriorDescending, V(36.3, -40.0, -12.5));
  origin(Vessel::Septal, 3, Vessel::AnteriorDescending, V(39.6, -54.5, -24.5));
  origin(Vessel::ObtuseMarginal, 1, Vessel::Circumflex, m1);
  origin(Vessel::ObtuseMarginal, 2, Vessel::Circumflex, m2);
  origin(Vessel::ObtuseMarginal, 3, Vessel::Circumflex, m3);
  origin(Vessel::RightVentricular, 1, Vessel::RightCoronary, V(-35.0, -40.0, -27.5));
  atlas.midLadEnd = builder.ArcAt(Vessel::AnteriorDescending, d3);
  atlas.acuteMarginArc = builder.ArcAt(Vessel::RightCoronary, margin);
  atlas.obtuseMarginArc = builder.ArcAt(Vessel::Circumflex, m1);
  atlas.leftGrooveEnd = builder.ArcAt(Vessel::Circumflex, V(20.9, 20.9, -36.5));
  return atlas;
}
}

Vector3 SegmentAtlas::OnEpicardium(double azimuth, double height) const
{
  return Frame().On(azimuth, height);
}

const SegmentAtlas& SegmentAtlas::Get()
{
  static const SegmentAtlas atlas = Build();
  return atlas;
}
}
