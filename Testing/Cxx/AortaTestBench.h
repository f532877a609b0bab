/**
 * @file AortaTestBench.h
 * @brief Lumens by formula: tubes about a line, closed by half balls; an aorta with an arch; all of a coronary artery that a guide sees.
 */
#ifndef DynamicCoronary_AortaTestBench_h
#define DynamicCoronary_AortaTestBench_h

#include "GuideInAorta.h"
#include "InstrumentCatalogue.h"
#include "JoinedLumen.h"
#include "WallTestMeshes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

namespace coronary
{
/// All that is nearer than `radius` to a line, which is the inside.
struct TubeLumen : ContactSurface
{
  std::vector<Vector3> line;
  double radius = 1.0;
  double friction = 1.0; ///< factor on the sample's
  double stiffness = 60.0;

  TubeLumen(std::vector<Vector3> axis, double lumen)
    : line(std::move(axis))
    , radius(lumen)
  {
  }
  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override
  {
    double nearest = std::numeric_limits<double>::infinity();
    Vector3 across = Vector3::Zero();
    for (std::size_t i = 1; i < this->line.size(); ++i)
    {
      const SegmentPlace place = NearestOnSegment(sample.centre, this->line[i - 1], this->line[i]);
      if (place.squaredDistance < nearest)
      {
        nearest = place.squaredDistance;
        across =
          this->line[i - 1] + place.fraction * (this->line[i] - this->line[i - 1]) - sample.centre;
      }
    }
    const double distance = across.norm();
    const double gap = this->radius - distance - sample.radius;
    contacts.count = 0;
    if (gap < reach && distance > 0.0)
    {
      contacts.count = 1;
      ContactPlane& plane = contacts.plane[0];
      plane = ContactPlane();
      plane.normal = across / distance;
      plane.gap = gap;
      plane.friction = this->friction * sample.friction;
      plane.stiffness = this->stiffness;
    }
  }
};

/// Descending aorta up, arch, ascending aorta down to the valve, in the plane y = 0; the patient's left is +x. The left ostium is on
/// the ascending aorta's left, the right one in front (-y).
struct AortaBench
{
  static constexpr double Arch = 38.0;     // mm, radius of its middle line
  static constexpr double Lumen = 15.0;    // mm, radius
  static constexpr double Valve = -70.0;   // z, mm
  static constexpr double Mouths = -60.0;  // z of the ostia, mm
  static constexpr double Coronary = 2.25; // mm, radius

  static std::vector<Vector3> Way()
  {
    std::vector<Vector3> way;
    for (double z = -150.0; z < 0.0; z += 5.0)
    {
      way.emplace_back(Arch, 0.0, z);
    }
    constexpr int Steps = 48;
    for (int i = 0; i <= Steps; ++i)
    {
      const double angle = M_PI * i / Steps;
      way.emplace_back(Arch * std::cos(angle), 0.0, Arch * std::sin(angle));
    }
    for (double z = -5.0; z >= Valve; z -= 5.0)
    {
      way.emplace_back(-Arch, 0.0, z);
    }
    return way;
  }
  static Ostium Mouth(bool left)
  {
    Ostium ostium;
    ostium.direction = left ? Vector3::UnitX() : Vector3(-Vector3::UnitY());
    ostium.position = Vector3(-Arch, 0.0, Mouths) + Lumen * ostium.direction;
    ostium.radius = Coronary;
    return ostium;
  }
  /// From within the aorta on.
  static std::vector<Vector3> Stump(const Ostium& ostium)
  {
    return { ostium.position - 6.0 * ostium.direction, ostium.position + 30.0 * ostium.direction };
  }

  explicit AortaBench(bool leftSide = true)
    : ostium(Mouth(leftSide))
    , aorta(Way(), Lumen)
    , stump(Stump(this->ostium), Coronary)
    , wall(this->aorta, this->stump, this->ostium.position, 40.0)
  {
    // The tube goes on behind the entry.
    this->aorta.line.front().z() -= 50.0;
  }

  Ostium ostium;
  TubeLumen aorta;
  TubeLumen stump;
  JoinedLumen wall;
};

/// That aorta as a closed surface of triangles.
inline void AppendAorta(
  WallTopology& topology, std::vector<Vector3>& points, int around, double spacing)
{
  std::vector<Vector3> way = AortaBench::Way();
  way.front().z() -= 20.0;
  way.back().z() -= AortaBench::Lumen;
  double length = 0.0;
  for (std::size_t i = 1; i < way.size(); ++i)
  {
    length += (way[i] - way[i - 1]).norm();
  }
  AppendTube(topology, points, 0.0, AortaBench::Lumen, length, around,
    static_cast<int>(std::ceil(length / spacing)));
  for (Vector3& point : points)
  {
    double along = point.z();
    std::size_t i = 1;
    while (i + 1 < way.size() && along > (way[i] - way[i - 1]).norm())
    {
      along -= (way[i] - way[i - 1]).norm();
      ++i;
    }
    const Vector3 tangent = (way[i] - way[i - 1]).normalized();
    point = way[i - 1] + along * tangent + point.x() * Vector3::UnitY() +
      point.y() * tangent.cross(Vector3::UnitY());
  }
}

/// A coronary artery's beginning likewise.
inline void AppendStump(WallTopology& topology, std::vector<Vector3>& points, const Ostium& ostium)
{
  const std::vector<Vector3> line = AortaBench::Stump(ostium);
  AppendTube(topology, points, 0.0, ostium.radius, (line[1] - line[0]).norm(), 24, 40);
  const Eigen::Quaterniond turn =
    Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), ostium.direction);
  for (Vector3& point : points)
  {
    point = line[0] + turn * point;
  }
}

/// The bench's left coronary artery, with its aorta; the artery begins at the aorta's wall, or a little beyond.
struct TriangleBench
{
  WallTopology vessels;
  std::vector<Vector3> points;
  Ostium ostium = AortaBench::Mouth(true);

  /// @param spacing  mm, of the axis
  explicit TriangleBench(double beyond = 0.0, double length = 60.0, double spacing = 1.0)
  {
    AppendTube(this->vessels, this->points, 0.0, AortaBench::Coronary, length, 24,
      static_cast<int>(std::lround(length / spacing)));
    const Eigen::Quaterniond turn =
      Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), this->ostium.direction);
    const Vector3 first = this->ostium.position + beyond * this->ostium.direction;
    const auto place = [&](const Vector3& p) { return Vector3(first + turn * p); };
    for (Vector3& point : this->points)
    {
      point = place(point);
    }
    for (Vector3& point : this->vessels.axis[0])
    {
      point = place(point);
    }
    this->vessels.points = static_cast<std::int64_t>(this->points.size());
    this->vessels.group.assign(this->points.size(), 0);
    this->vessels.groupName[0] = "LM";
    WallTopology aorta;
    std::vector<Vector3> wall;
    AppendAorta(aorta, wall, 64, 2.0);
    auto shape = std::make_shared<AortaAtRest>();
    shape->points = wall;
    shape->triangles = aorta.triangles;
    const std::vector<Vector3> way = AortaBench::Way();
    shape->axis.assign(way.rbegin(), way.rend());
    this->vessels.aorta = shape;
  }
};

/// The wire over which a guide is brought up: 0.035 inch, a steel core of 0.6 mm behind a soft end.
inline Guidewire LeadingWire()
{
  Guidewire wire;
  wire.name = "0.035 inch";
  WireSection section;
  section.radius = 0.444;
  section.axialStiffness = 1e4;
  section.density = 7000.0;
  section.length = 30.0;
  section.bendingStiffness1 = section.bendingStiffness2 = section.torsionalStiffness = 10.0;
  wire.sections.push_back(section);
  section.length = 100.0;
  section.bendingStiffness1 = section.bendingStiffness2 = section.torsionalStiffness = 1145.0;
  wire.sections.push_back(section);
  return wire;
}

/// A guide that is driven by hand in that aorta.
struct GuideDrive
{
  GuideInAorta guide;
  AortaBench& bench; ///< of copies, too: it has no memory
  double position = 0.0;
  double angle = 0.0;
  double beyond = 60.0; ///< mm of the leading wire beyond its tip
  Guidewire wire = LeadingWire();
  double deepest = 0.0; ///< mm into a wall, so far
  double widest = 0.0;  ///< mm, of a joint, so far
  bool failed = false;

  GuideDrive(AortaBench& where, const GuideCatheter& catheter, double start = 60.0)
    : guide(catheter, AortaBench::Way(), With(start))
    , bench(where)
  {
    this->guide.Carry(this->wire, this->beyond);
  }
  static GuideSettings With(double start)
  {
    GuideSettings settings;
    settings.start = start;
    return settings;
  }
  void Tick()
  {
    const RodStep& step = this->guide.Step(this->position, this->angle, this->bench.wall);
    this->failed = this->failed || !step.finite;
    this->deepest = std::max(this->deepest, step.maximumPenetration);
    this->widest = std::max(this->widest, step.maximumGap);
  }
  /// At 2 kHz. @param push  mm  @param turn  rad  @param wire  mm by which the leading wire is advanced as well
  void Move(double seconds, double push, double turn = 0.0, double wireMoves = 0.0)
  {
    const int ticks = static_cast<int>(std::lround(2000.0 * seconds));
    for (int i = 0; i < ticks; ++i)
    {
      this->position += push / ticks;
      this->angle += turn / ticks;
      if (wireMoves != 0.0)
      {
        this->beyond += wireMoves / ticks;
        this->guide.Carry(this->wire, this->beyond);
      }
      this->Tick();
    }
  }
  GuideSeat Seat() const
  {
    return SeatOf(this->guide.Tip(), this->guide.Direction(), this->bench.ostium);
  }
};
}

#endif
