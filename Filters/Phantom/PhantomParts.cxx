#include "PhantomParts.h"

#include "Numbers.h"
#include "PhantomCourses.h"

#include <algorithm>
#include <cmath>

// Sections have a plateau w with quintic shoulders of min(length / 2, 4 mm): a lumen of radius r = r0 (1 - degree w) in
// an outer wall of R = r0 (1 + (remodelling - 1) w), off it by eccentricity (R - r); the core lies where the wall is
// thickest.

namespace coronary
{
namespace
{
constexpr double LongestShoulder = 4.0; // mm
constexpr double Cap = 0.15;            // mm of fibrous tissue between the lumen and a lipid core
constexpr double Thinnest = 0.02;       // mm: what is thinner is left out

/// Rings of a stent: zigzags as tall as `Tall` with gaps in between.
constexpr double RingPitch = 1.5; // mm
constexpr double RingTall = 1.0;  // mm
constexpr int Crowns = 6;         // peaks of a ring, as many valleys
constexpr int Connectors = 3;     // between two rings

double Shoulder(const PhantomLesion& lesion)
{
  return std::min(0.5 * lesion.length, LongestShoulder);
}

/// A vessel's axis, with directions about it.
class VesselFrame
{
public:
  VesselFrame(const PhantomAnatomy& anatomy, int vessel)
    : Anatomy(anatomy)
  {
    for (const AxisStep& step : anatomy.steps)
    {
      if (step.vessel == vessel)
      {
        if (this->Points.empty())
        {
          this->Points.push_back(step.first);
          // A side vessel's first point is its parent's.
          this->Arcs.push_back(0.0);
        }
        this->Points.push_back(step.second);
        this->Arcs.push_back(anatomy.pointArc[step.second]);
      }
    }
  }

  std::size_t Count() const { return this->Points.size(); }
  double Arc(std::size_t i) const { return this->Arcs[i]; }
  std::int64_t Point(std::size_t i) const { return this->Points[i]; }

  /// Of a side vessel's first point its own radius counts, not the parent's.
  std::int64_t Own(std::size_t i) const
  {
    return i == 0 && this->Points.size() > 1 &&
        this->Anatomy.pointVessel[this->Points[0]] != this->Anatomy.pointVessel[this->Points[1]]
      ? this->Points[1]
      : this->Points[i];
  }

  /// The place on the axis.
  Vector3 Position(double arc) const
  {
    const auto upper = std::upper_bound(this->Arcs.begin() + 1, this->Arcs.end() - 1, arc);
    const std::size_t i = upper - this->Arcs.begin();
    const double f =
      std::clamp((arc - this->Arcs[i - 1]) / (this->Arcs[i] - this->Arcs[i - 1]), 0.0, 1.0);
    return (1.0 - f) * this->At(i - 1) + f * this->At(i);
  }

  /// Unit vector across the axis; angle 0 is away from the heart.
  Vector3 Direction(double arc, double angle) const
  {
    const Vector3 tangent = (this->Position(arc + 1.0) - this->Position(arc - 1.0)).normalized();
    const Vector3 normal = EpicardialNormal(this->Anatomy.frame, this->Position(arc), tangent);
    return std::cos(angle) * normal + std::sin(angle) * normal.cross(tangent);
  }

private:
  const Vector3& At(std::size_t i) const { return this->Anatomy.tree.points[this->Points[i]]; }

  const PhantomAnatomy& Anatomy;
  std::vector<std::int64_t> Points;
  std::vector<double> Arcs;
};

/// Makes the parts of one lesion.
class LesionBuilder
{
public:
  LesionBuilder(PhantomAnatomy& anatomy, int number)
    : Anatomy(anatomy)
    , Number(number)
    , Placed(anatomy.lesions[number])
    , Lesion(this->Placed.lesion)
    , Frame(anatomy, this->Placed.vessel)
  {
    for (std::size_t i = 0; i < this->Frame.Count(); ++i)
    {
      const double arc = this->Frame.Arc(i);
      if (std::abs(arc - this->Placed.middle) > this->Placed.HalfExtent())
      {
        continue;
      }
      const std::int64_t own = this->Frame.Own(i);
      const double lumen = this->Placed.Blocks(arc) ? 0.0 : anatomy.tree.radius[own];
      this->Stations.push_back({ this->Frame.Point(i), arc,
        SectionOf(this->Placed, arc, lumen, anatomy.healthyRadius[own]) });
    }
  }

  void Build()
  {
    this->AddWall();
    this->AddCore();
    this->AddCalcium();
    if (this->Lesion.kind == PhantomLesionKind::Stent)
    {
      this->AddStent();
    }
  }

private:
  struct Station
  {
    std::int64_t point;
    double arc;
    WallSection section;
  };

  PartNode Node(const Station& at, double angle, double offset, double radius) const
  {
    return { this->Anatomy.tree.points[at.point], this->Frame.Direction(at.arc, angle), offset,
      radius, this->Anatomy.rigid[at.point] ? 0.0 : at.section.lumen };
  }

  /// Starts a part, or ends one that has too little.
  void Begin(PartLayer layer, PhantomTissue tissue, double value, bool pushed)
  {
    this->End();
    this->Part = { layer, tissue, value, this->Number,
      this->Anatomy.intramural[this->Placed.vessel] != 0, pushed, {} };
  }
  void End()
  {
    if (this->Part.nodes.size() > 1)
    {
      this->Anatomy.parts.push_back(this->Part);
    }
    this->Part.nodes.clear();
  }

  static PhantomTissue TissueOf(double value)
  {
    return value < -30.0 ? PhantomTissue::Fat : PhantomTissue::Soft;
  }

  void AddWall()
  {
    this->Begin(
      PartLayer::Wall, TissueOf(this->Lesion.fibrousValue), this->Lesion.fibrousValue, false);
    for (const Station& at : this->Stations)
    {
      const WallSection& s = at.section;
      this->Part.nodes.push_back(this->Node(at, s.direction, s.offset, s.radius));
      if (this->Anatomy.pointVessel[at.point] == this->Placed.vessel)
      {
        this->Anatomy.wallOffset[at.point] = s.offset * this->Frame.Direction(at.arc, s.direction);
        this->Anatomy.wallRadius[at.point] = s.radius;
      }
    }
    this->End();
  }

  /// A round core where the wall is thickest, between a cap and the outer wall.
  void AddCore()
  {
    if (this->Lesion.lipid <= 0.0)
    {
      return;
    }
    for (const bool rim : { true, false })
    {
      if (rim && this->Lesion.rim <= 0.0)
      {
        continue;
      }
      const double value = rim ? this->Lesion.rimValue : this->Lesion.lipidValue;
      const PartLayer layer = rim ? PartLayer::Rim : PartLayer::Core;
      this->Begin(layer, TissueOf(value), value, true);
      for (const Station& at : this->Stations)
      {
        const WallSection& s = at.section;
        const double room = s.Reach(0.0) - s.lumen - Cap;
        const double whole = 0.5 * this->Lesion.lipid * room;
        const double core = whole - this->Lesion.rim;
        if (core < Thinnest)
        {
          this->Begin(layer, TissueOf(value), value, true);
          continue;
        }
        this->Part.nodes.push_back(
          this->Node(at, s.direction, s.lumen + Cap + whole, rim ? whole : core));
      }
      this->End();
    }
  }

  /// Rods side by side along the outer wall: as thick as asked for, or as there is room.
  void AddCalcium()
  {
    const double thickness = this->Lesion.calciumThickness;
    if (thickness <= 0.0 || this->Stations.empty())
    {
      return;
    }
    const double length =
      this->Lesion.calciumLength > 0.0 ? this->Lesion.calciumLength : this->Lesion.length;
    const double arc = this->Lesion.calciumArc * Degree;
    double widest = 0.0;
    for (const Station& at : this->Stations)
    {
      widest = std::max(widest, at.section.radius);
    }
    const int rods = 1 + static_cast<int>(std::ceil(arc * widest / (0.5 * thickness)));
    for (int rod = 0; rod < rods; ++rod)
    {
      const double angle = rods == 1 ? 0.0 : arc * (static_cast<double>(rod) / (rods - 1) - 0.5);
      this->Begin(PartLayer::Calcium, PhantomTissue::Calcified, this->Lesion.calciumValue, true);
      for (const Station& at : this->Stations)
      {
        const WallSection& s = at.section;
        const double reach = s.Reach(angle);
        const double along = 2.0 * std::abs(at.arc - this->Placed.middle) / length;
        // Ends like an ellipsoid's.
        const double share = along < 1.0 ? std::sqrt(1.0 - std::pow(along, 6.0)) : 0.0;
        const double radius = 0.5 * std::min(thickness * share, reach - s.lumen);
        if (radius < Thinnest)
        {
          this->Begin(
            PartLayer::Calcium, PhantomTissue::Calcified, this->Lesion.calciumValue, true);
          continue;
        }
        this->Part.nodes.push_back(this->Node(at, s.direction + angle, reach - radius, radius));
      }
      this->End();
    }
  }

  /// Zigzag rings on the healthy lumen's wall, every other one mirrored, and connectors.
  void AddStent()
  {
    const int rings =
      std::max(1, static_cast<int>(std::floor((this->Lesion.length - RingTall) / RingPitch)) + 1);
    const double first = this->Placed.middle - 0.5 * (rings - 1) * RingPitch;
    const auto node = [&](double arc, int corner)
    {
      const std::size_t i = this->Nearest(arc);
      const double wire = 0.5 * this->Lesion.strut;
      return PartNode{ this->Frame.Position(arc), this->Frame.Direction(arc, corner * Pi / Crowns),
        this->Anatomy.healthyRadius[this->Frame.Own(i)] + wire, wire, 0.0 };
    };
    const auto cornerArc = [&](int ring, int corner)
    {
      const bool peak = (corner + ring) % 2 == 0;
      return first + ring * RingPitch + (peak ? 0.5 : -0.5) * RingTall;
    };
    for (int ring = 0; ring < rings; ++ring)
    {
      this->Begin(PartLayer::Metal, PhantomTissue::Metal, this->Lesion.metalValue, false);
      for (int corner = 0; corner <= 2 * Crowns; ++corner)
      {
        this->Part.nodes.push_back(node(cornerArc(ring, corner), corner));
      }
      this->End();
      for (int c = 0; ring + 1 < rings && c < Connectors; ++c)
      {
        // A peak of this ring faces a valley of the next.
        const int corner = 2 * c * Crowns / Connectors + ring % 2;
        this->Begin(PartLayer::Metal, PhantomTissue::Metal, this->Lesion.metalValue, false);
        this->Part.nodes.push_back(node(cornerArc(ring, corner), corner));
        this->Part.nodes.push_back(node(cornerArc(ring + 1, corner), corner));
        this->End();
      }
    }
  }

  std::size_t Nearest(double arc) const
  {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < this->Frame.Count(); ++i)
    {
      if (std::abs(this->Frame.Arc(i) - arc) < std::abs(this->Frame.Arc(nearest) - arc))
      {
        nearest = i;
      }
    }
    return nearest;
  }

  PhantomAnatomy& Anatomy;
  const int Number;
  const PlacedLesion& Placed;
  const PhantomLesion& Lesion;
  const VesselFrame Frame;
  std::vector<Station> Stations;
  PhantomPart Part{};
};
}

double PlacedLesion::Profile(double arc) const
{
  if (this->lesion.kind == PhantomLesionKind::Stenosis)
  {
    const double width = this->lesion.length / 2.3548;
    const double u = (arc - this->middle) / width;
    return std::exp(-0.5 * u * u);
  }
  const double off = std::abs(arc - this->middle);
  return SmoothStep((0.5 * this->lesion.length - off) / Shoulder(this->lesion) + 0.5);
}

double PlacedLesion::LumenFactor(double arc) const
{
  switch (this->lesion.kind)
  {
    case PhantomLesionKind::Stenosis:
    case PhantomLesionKind::Plaque:
    case PhantomLesionKind::Stent:
      return 1.0 - this->lesion.degree * this->Profile(arc);
    case PhantomLesionKind::Ectasia:
      return 1.0 + this->lesion.degree * this->Profile(arc);
    default:
      return 1.0;
  }
}

double PlacedLesion::HalfExtent() const
{
  return this->lesion.kind == PhantomLesionKind::Stenosis
    ? 1.5 * this->lesion.length
    : 0.5 * (this->lesion.length + Shoulder(this->lesion));
}

bool PlacedLesion::HasWall() const
{
  return this->lesion.kind == PhantomLesionKind::Plaque ||
    this->lesion.kind == PhantomLesionKind::Occlusion ||
    this->lesion.kind == PhantomLesionKind::Calcification ||
    this->lesion.kind == PhantomLesionKind::Stent;
}

bool PlacedLesion::Blocks(double arc) const
{
  return this->lesion.kind == PhantomLesionKind::Occlusion &&
    std::abs(arc - this->middle) <= 0.5 * this->lesion.length;
}

double WallSection::Reach(double angle) const
{
  const double across = this->offset * std::sin(angle);
  return this->offset * std::cos(angle) +
    std::sqrt(std::max(0.0, this->radius * this->radius - across * across));
}

WallSection SectionOf(const PlacedLesion& placed, double arc, double lumen, double healthy)
{
  const PhantomLesion& lesion = placed.lesion;
  const double w = placed.Profile(arc);
  double eccentricity = lesion.eccentricity;
  double radius = healthy * (1.0 + (lesion.remodelling - 1.0) * w);
  if (lesion.kind == PhantomLesionKind::Calcification)
  {
    // The thickest place has room for the calcium; the longer its arc, the more even the wall.
    eccentricity = 1.0 - lesion.calciumArc / 360.0;
    radius = healthy + w * lesion.calciumThickness / (1.0 + eccentricity);
  }
  else if (lesion.kind == PhantomLesionKind::Stent)
  {
    radius += 2.0 * lesion.strut * w;
  }
  else if (lesion.kind == PhantomLesionKind::Occlusion)
  {
    eccentricity = 0.0;
  }
  radius = std::max(radius, lumen);
  return { lumen, radius, eccentricity * (radius - lumen),
    Degree * (lesion.angle + lesion.twist * (arc - placed.middle)) };
}

void PhantomPart::Place(const std::function<Vector3(const Vector3&)>& place, double growth,
  std::vector<PhantomTube>& tubes) const
{
  Vector3 before = Vector3::Zero();
  double radiusBefore = 0.0;
  for (std::size_t n = 0; n < this->nodes.size(); ++n)
  {
    const PartNode& node = this->nodes[n];
    const double grown = growth * node.lumen;
    const Vector3 axis = place(node.axis);
    Vector3 here = axis;
    if (node.offset > 0.0)
    {
      // Thicknesses stay as they are, however the tissue is strained.
      const Vector3 towards = place(node.axis + node.direction) - axis;
      here += (node.offset + (this->pushed ? grown : 0.0)) * towards.normalized();
    }
    const double radius = node.radius + (this->pushed ? 0.0 : grown);
    if (n > 0)
    {
      tubes.push_back(
        { before, here, radiusBefore, radius, n > 1, this->tissue, this->value, this->inMuscle });
    }
    before = here;
    radiusBefore = radius;
  }
}

void BuildParts(PhantomAnatomy& anatomy)
{
  for (std::size_t n = 0; n < anatomy.lesions.size(); ++n)
  {
    if (anatomy.lesions[n].HasWall())
    {
      LesionBuilder(anatomy, static_cast<int>(n)).Build();
    }
  }
  std::stable_sort(anatomy.parts.begin(), anatomy.parts.end(),
    [](const PhantomPart& a, const PhantomPart& b) { return a.layer < b.layer; });
}

void AddLeads(PhantomAnatomy& anatomy)
{
  constexpr double radius = 0.9;    // mm
  constexpr double value = 15000.0; // HU: wires and coating together
  const HeartFrame& frame = anatomy.frame;
  const Vector3 above(-4.0, 0.0, 85.0); // mm, from the atrium's roof up the superior vena cava
  const Vector3 roof = frame.ToWorld(Vector3(-33.0, 2.0, -30.0));
  const auto at = [&](double a, double b, double c) { return frame.ToWorld(Vector3(a, b, c)); };
  const std::vector<std::vector<Vector3>> courses = { // To the ventricle's apex, along its floor.
    { roof + above, roof + 0.5 * above, roof, at(-34.0, -8.0, -16.0), at(-30.0, -8.0, 4.0),
      at(-28.0, -6.0, 20.0), at(-24.0, -4.0, 34.0), at(-19.0, -2.0, 46.0) },
    // To the atrium's appendage.
    { roof + above + Vector3(3.0, 1.0, 0.0), roof + 0.5 * above + Vector3(3.0, 1.0, 0.0),
      roof + Vector3(3.0, 1.0, 0.0), at(-36.0, -4.0, -22.0), at(-32.0, 6.0, -14.0),
      at(-26.0, 12.0, -20.0) }
  };
  for (const std::vector<Vector3>& course : courses)
  {
    PhantomPart lead{ PartLayer::Metal, PhantomTissue::Metal, value, -1, false, false, {} };
    for (const Vector3& place : SmoothCourse(course, 60))
    {
      lead.nodes.push_back({ place, Vector3::UnitX(), 0.0, radius, 0.0 });
    }
    anatomy.parts.push_back(lead);
  }
}
}
