#include "PhantomAnatomy.h"

#include "Numbers.h"
#include "PhantomCollaterals.h"
#include "PhantomCourses.h"
#include "PhantomVesselPlans.h"
#include "Require.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <stdexcept>

namespace coronary
{
namespace
{
/// A healthy vessel's least radius in mm.
constexpr double MinimumRadius = 0.2;

// Streams of the random generator, so that one part of the anatomy does not shift another.
enum Purpose : std::uint64_t
{
  PositionX = 101,
  PositionY = 102,
  PositionZ = 103,
  Calibre = 104,
  Size = 105,
  Waves = 106,
  Stenoses = 107,
  Plaques = 108
};

/// The random parts of the anatomy, all zero for seed 0.
class Variation
{
public:
  explicit Variation(const PhantomSettings& settings)
    : Sigma(settings.seed == 0 ? 0.0 : settings.positionVariation)
  {
    if (this->Sigma > 0.0)
    {
      for (int axis = 0; axis < 3; ++axis)
      {
        this->Fields[axis] = SmoothRandomField(settings.seed, PositionX + axis, 30.0);
      }
    }
  }

  Vector3 operator()(const Vector3& position) const
  {
    return this->Sigma *
      Vector3(this->Fields[0](position), this->Fields[1](position), this->Fields[2](position));
  }

private:
  double Sigma;
  SmoothRandomField Fields[3];
};

double HeartSize(const PhantomSettings& settings)
{
  if (settings.seed == 0)
  {
    return 1.0;
  }
  return 1.0 + 0.04 * RandomStream(settings.seed, Size).Normal(2.0);
}

/// Puts a mean-heart control point where this heart has it.
Vector3 Place(const Control& control, VesselDepth depth, const HeartFrame& mean,
  const Variation& variation, double size)
{
  const Vector3 q = mean.ToHeart(control.position);
  // The ostia and the left main lie above the groove, on the aorta, and vary less.
  const double below = SmoothStep((q[2] + 10.0) / 12.0);
  const Vector3 varied = control.position + variation(control.position) * (0.4 + 0.6 * below);
  Vector3 p = mean.ToHeart(varied);
  if (depth == VesselDepth::Epicardial)
  {
    const double level = HeartFrame::Level(p);
    const double wanted = 1.0 + 0.3 * (level - 1.0);
    const double onSurface = HeartFrame::Level(q) > 0.97 ? below : 0.6 * below;
    p = HeartFrame::Centre + (p - HeartFrame::Centre) * (1.0 + onSurface * (wanted / level - 1.0));
  }
  return mean.ToWorld(p) * size;
}

/// Monotone-safe interpolation of the control diameters over the control points' arc lengths.
double InterpolateDiameter(
  const std::vector<double>& at, const std::vector<double>& diameter, double s)
{
  const auto upper = std::upper_bound(at.begin() + 1, at.end() - 1, s);
  const std::size_t i = upper - at.begin();
  const double f = std::clamp((s - at[i - 1]) / (at[i] - at[i - 1]), 0.0, 1.0);
  return diameter[i - 1] + f * (diameter[i] - diameter[i - 1]);
}

int Strahler(PhantomTree& tree, std::size_t branch)
{
  int highest = 0;
  int count = 0;
  for (std::size_t b = 0; b < tree.branches.size(); ++b)
  {
    if (tree.branches[b].parentGroupId == tree.branches[branch].groupId)
    {
      const int order = Strahler(tree, b);
      count = order == highest ? count + 1 : (order > highest ? 1 : count);
      highest = std::max(highest, order);
    }
  }
  const int order = highest == 0 ? 1 : (count > 1 ? highest + 1 : highest);
  tree.branches[branch].strahlerOrder = order;
  return order;
}

/// The anatomy in the making: vessels in fine steps first, then the tree that is cut from them.
class AnatomyBuilder
{
public:
  AnatomyBuilder(PhantomAnatomy& anatomy, const PhantomSettings& settings);

  void GrowVessels();
  void PlaceRoot();
  void GrowGrafts();
  void PlaceLesions();
  void CutIntoBranches();
  void LocateLesions();
  void AddVein();
  void PlacePulmonaryTrunk();

private:
  double LeaveParent(
    const VesselPlan& plan, DenseVessel& vessel, std::vector<Vector3>& controls) const;
  void GrowVessel(std::size_t v, double calibre);
  bool Clear(std::size_t host, double s, double distance) const;
  std::pair<std::size_t, double> PickPlace(RandomStream& random, int number, double distance) const;
  void RaiseRightOstium();
  void GrowGraft(const PhantomGraft& graft);
  std::vector<Vector3> CourseOfGraft(const PhantomGraft& graft, std::size_t target) const;
  std::vector<PhantomLesion> CountedLesions() const;
  std::vector<PhantomLesion> CountedSpots() const;
  void AddLesion(const PhantomLesion& lesion, const std::string& where);
  void RefuseOverlaps() const;
  Vector3 TangentAt(std::size_t v, double arc) const;
  void MakeSpot(const PlacedLesion& placed);
  void FillLate(const PlacedLesion& occlusion);
  std::int64_t AddPoint(std::size_t v, double arc, double abscissa, int segment);
  void Cut(std::size_t v, std::int64_t origin, int parentGroup);
  std::int64_t NearestPoint(const PlacedLesion& placed) const;

  PhantomAnatomy& Anatomy;
  const PhantomSettings& Settings;
  const Variation Varied;
  std::vector<VesselPlan> Plans;
  std::map<std::string, std::size_t> ByName;
  std::vector<DenseVessel> Dense;
  std::vector<std::vector<double>> Healthy;                          ///< radii before the lesions
  std::vector<std::vector<std::pair<double, std::size_t>>> Children; ///< arc of the origin, vessel
};

AnatomyBuilder::AnatomyBuilder(PhantomAnatomy& anatomy, const PhantomSettings& settings)
  : Anatomy(anatomy)
  , Settings(settings)
  , Varied(settings)
  , Plans(PlanVessels(settings))
  , Dense(this->Plans.size())
  , Children(this->Plans.size())
{
  for (std::size_t v = 0; v < this->Plans.size(); ++v)
  {
    this->ByName[this->Plans[v].name] = v;
    this->Anatomy.vesselNames.push_back(this->Plans[v].name);
    this->Anatomy.intramural.push_back(this->Plans[v].depth == VesselDepth::Intramural);
  }
}

/// Starts a side vessel on its parent.
/// @return the parent's radius there, mm; 0 without a parent
double AnatomyBuilder::LeaveParent(
  const VesselPlan& plan, DenseVessel& vessel, std::vector<Vector3>& controls) const
{
  if (plan.parent.empty())
  {
    return 0.0;
  }
  vessel.parent = this->ByName.at(plan.parent);
  const DenseVessel& parent = this->Dense[vessel.parent];
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < parent.points.size(); ++i)
  {
    if ((parent.points[i] - controls[0]).squaredNorm() <
      (parent.points[nearest] - controls[0]).squaredNorm())
    {
      nearest = i;
    }
  }
  vessel.parentArc = parent.arc[nearest];
  const double parentRadius = parent.radius[nearest];
  // The parent's waves carry the origin along, and the first part of the side vessel with it.
  const Vector3 shift = parent.points[nearest] - controls[0];
  const Vector3 origin = controls[0];
  for (Vector3& control : controls)
  {
    control += shift * std::exp(-(control - origin).norm() / 15.0);
  }
  controls[0] = parent.points[nearest];
  return parentRadius;
}

void AnatomyBuilder::GrowVessels()
{
  RandomStream random(this->Settings.seed, Calibre);
  std::vector<double> factors(this->Plans.size(), this->Settings.calibre);
  for (double& factor : factors)
  {
    factor *=
      this->Settings.seed == 0 ? 1.0 : 1.0 + this->Settings.calibreVariation * random.Normal(2.0);
  }
  // Parents first, wherever they stand: an anomalous vessel may hang on a later one.
  for (std::size_t grown = 0; grown < this->Plans.size();)
  {
    for (std::size_t v = 0; v < this->Plans.size(); ++v)
    {
      const std::string& parent = this->Plans[v].parent;
      if (this->Dense[v].points.empty() &&
        (parent.empty() || !this->Dense[this->ByName.at(parent)].points.empty()))
      {
        this->GrowVessel(v, factors[v]);
        ++grown;
      }
    }
  }
}

/// Course and calibre.
void AnatomyBuilder::GrowVessel(std::size_t v, double calibre)
{
  static const HeartFrame mean;
  const VesselPlan& plan = this->Plans[v];
  DenseVessel& vessel = this->Dense[v];
  std::vector<Vector3> controls;
  for (const Control& control : plan.controls)
  {
    controls.push_back(Place(control, plan.depth, mean, this->Varied, this->Anatomy.frame.size));
  }
  const double parentRadius = this->LeaveParent(plan, vessel, controls);
  const CubicCurve curve(controls);
  const int fine = static_cast<int>(std::ceil(40.0 * static_cast<double>(controls.size())));
  for (int i = 0; i <= fine; ++i)
  {
    vessel.points.push_back(curve(curve.End() * i / fine));
  }
  ComputeArc(vessel);
  if (this->Settings.seed != 0 && this->Settings.tortuosity > 0.0)
  {
    RandomStream waves(this->Settings.seed, Waves + 1000 * (v + 1));
    AddWaves(vessel, this->Anatomy.frame, this->Settings.tortuosity, waves);
    ComputeArc(vessel);
  }

  std::vector<double> at;
  std::vector<double> diameters;
  for (std::size_t c = 0; c < controls.size(); ++c)
  {
    const double position = curve.Knot(c) / curve.End() * fine;
    const auto index = std::min(static_cast<std::size_t>(position), vessel.arc.size() - 2);
    at.push_back(vessel.arc[index] +
      (position - static_cast<double>(index)) * (vessel.arc[index + 1] - vessel.arc[index]));
    diameters.push_back(plan.controls[c].diameter * calibre);
  }
  for (double s : vessel.arc)
  {
    // Three averaged samples take the corners out of the taper.
    double diameter = 0.0;
    for (const double offset : { -2.0, 0.0, 2.0 })
    {
      diameter += InterpolateDiameter(at, diameters, s + offset) / 3.0;
    }
    // A side vessel is never as wide as the vessel that it leaves.
    const double widest = parentRadius > 0.0 ? 0.9 * parentRadius : diameter;
    vessel.radius.push_back(std::max(MinimumRadius, std::min(0.5 * diameter, widest)));
  }
}

/// The aortic root goes through both ostia, where they usually are.
void AnatomyBuilder::PlaceRoot()
{
  static const HeartFrame mean;
  const bool single = this->Settings.disease.origin == CoronaryOrigin::SingleRight;
  this->Anatomy.leftOstium = single ? Place({ Vector3::Zero(), 0.0 }, VesselDepth::Epicardial, mean,
                                        this->Varied, this->Anatomy.frame.size)
                                    : this->Dense[this->ByName.at("LAD")].points.front();
  this->Anatomy.rightOstium = this->Dense[this->ByName.at("RCA")].points.front();
  this->Anatomy.root.centre = 0.5 * (this->Anatomy.leftOstium + this->Anatomy.rightOstium);
  this->Anatomy.root.radius = 0.5 * (this->Anatomy.leftOstium - this->Anatomy.rightOstium).norm();
  const Vector3 across = (this->Anatomy.leftOstium - this->Anatomy.rightOstium).normalized();
  const Vector3 up(-0.30, -0.20, 0.93);
  this->Anatomy.root.axis = (up - up.dot(across) * across).normalized();
  KeepOutOfAorta(this->Dense, this->Anatomy.root,
    single ? this->Anatomy.rightOstium : this->Anatomy.leftOstium, this->Anatomy.rightOstium);
  Separate(this->Dense);
  if (this->Settings.disease.origin == CoronaryOrigin::HighRight)
  {
    this->RaiseRightOstium();
  }
}

/// Up along the aorta's wall, and the vessel's beginning with it.
void AnatomyBuilder::RaiseRightOstium()
{
  constexpr double rise = 15.0;  // mm
  constexpr double along = 22.0; // mm of the vessel that come along
  const AorticRoot& root = this->Anatomy.root;
  DenseVessel& right = this->Dense[this->ByName.at("RCA")];
  const Vector3 outwards = (right.points.front() - root.centre).normalized();
  // The aorta tapers above its sinuses, as the tissues have it.
  const double radius = root.RadiusAt(rise);
  const Vector3 place = root.centre + rise * root.axis + radius * outwards;
  const Vector3 shift = place - right.points.front();
  double reach = along;
  for (const DenseVessel& child : this->Dense)
  {
    reach = child.parent == this->ByName.at("RCA") ? std::min(reach, child.parentArc) : reach;
  }
  for (std::size_t i = 0; i < right.points.size(); ++i)
  {
    right.points[i] += (1.0 - SmoothStep(right.arc[i] / reach)) * shift;
  }
  this->Anatomy.rightOstium = place;
  UpdateArc(this->Dense, this->ByName.at("RCA"));
}

void AnatomyBuilder::GrowGrafts()
{
  for (const PhantomGraft& graft : this->Settings.disease.grafts)
  {
    this->GrowGraft(graft);
  }
}

void AnatomyBuilder::GrowGraft(const PhantomGraft& graft)
{
  const std::string where = "PhantomSettings: graft " + graft.name + ": ";
  const auto target = this->ByName.find(graft.vessel);
  Require(target != this->ByName.end(), where + "there is no vessel " + graft.vessel);
  Require(this->ByName.count(graft.name) == 0, where + "there is a vessel of that name");
  const DenseVessel& host = this->Dense[target->second];
  Require(graft.position < host.arc.back() - 3.0,
    where + graft.vessel + " is only " + std::to_string(std::lround(host.arc.back())) + " mm long");
  DenseVessel vessel;
  vessel.points = SmoothCourse(this->CourseOfGraft(graft, target->second), 600);
  ComputeArc(vessel);
  // Narrower at its end, so that it is sewn into the vessel's side.
  const double narrow =
    std::min(0.5 * graft.diameter, 0.85 * AtArc(host, host.radius, graft.position));
  for (const double s : vessel.arc)
  {
    const double open = SmoothStep((vessel.arc.back() - s) / 8.0);
    vessel.radius.push_back(narrow + open * (0.5 * graft.diameter - narrow));
  }
  this->ByName[graft.name] = this->Plans.size();
  this->Plans.push_back({ graft.name, GraftTree, "", VesselDepth::Epicardial, {}, 0, {} });
  this->Dense.push_back(std::move(vessel));
  this->Children.emplace_back();
  this->Anatomy.vesselNames.push_back(graft.name);
  this->Anatomy.intramural.push_back(0);
}

/// From the chest wall or the aorta over the heart's surface to the vessel's side.
std::vector<Vector3> AnatomyBuilder::CourseOfGraft(
  const PhantomGraft& graft, std::size_t target) const
{
  const HeartFrame& frame = this->Anatomy.frame;
  const AorticRoot& root = this->Anatomy.root;
  const DenseVessel& host = this->Dense[target];
  const Vector3 end = AtArc(host, host.points, graft.position);
  const Vector3 tangent = (AtArc(host, host.points, graft.position + 1.0) -
    AtArc(host, host.points, graft.position - 1.0))
                            .normalized();
  const Vector3 normal = EpicardialNormal(frame, end, tangent);
  const Vector3 landing = end - 7.0 * tangent + 5.0 * normal;
  constexpr double clear = 18.0; // mm from the pulmonary trunk's axis
  std::vector<Vector3> course;
  if (graft.mammary)
  {
    // Beside the breast bone.
    course = { Vector3(0.0, -76.0, 60.0), Vector3(0.0, -77.0, 45.0), Vector3(2.0, -78.0, 30.0) };
  }
  else
  {
    constexpr double height = 48.0; // mm above the sinuses
    Vector3 outwards = (landing - root.centre).normalized() - 1.2 * Vector3::UnitY();
    outwards = (outwards - outwards.dot(root.axis) * root.axis).normalized();
    const Vector3 middle = root.centre + height * root.axis;
    course = { middle + 0.85 * root.radius * outwards,
      middle + (0.85 * root.radius + 6.0) * outwards };
    const Vector3& trunk = this->Anatomy.pulmonaryAxis;
    const Vector3 overTrunk = this->Anatomy.pulmonaryBase + 40.0 * trunk;
    if (landing[0] > overTrunk[0])
    {
      // To the left side around the front of the pulmonary trunk.
      Vector3 front(0.35, -1.0, 0.0);
      front = (front - front.dot(trunk) * trunk).normalized();
      course.push_back(overTrunk + clear * front);
    }
  }
  // Along a great circle of the epicardium, well above it.
  const auto scaled = [&](const Vector3& p) -> Vector3
  { return (frame.ToHeart(p) - HeartFrame::Centre).cwiseQuotient(HeartFrame::Radii); };
  const Vector3 from = scaled(course.back());
  const Vector3 to = scaled(landing);
  constexpr int waypoints = 6;
  for (int i = 1; i <= waypoints; ++i)
  {
    const double u = static_cast<double>(i) / (waypoints + 1);
    const Vector3 direction = ((1.0 - u) * from.normalized() + u * to.normalized()).normalized();
    const double level = (1.0 - u) * from.norm() + u * to.norm() + 0.25 * u * (1.0 - u);
    Vector3 p = frame.ToWorld(
      HeartFrame::Centre + direction.cwiseProduct(HeartFrame::Radii) * std::max(1.1, level));
    // In front of the pulmonary trunk.
    const Vector3 off = p - this->Anatomy.pulmonaryBase;
    const Vector3 across = off - off.dot(this->Anatomy.pulmonaryAxis) * this->Anatomy.pulmonaryAxis;
    if (across.norm() < clear && off.dot(this->Anatomy.pulmonaryAxis) > -20.0)
    {
      p += (clear - across.norm()) * across.normalized();
    }
    course.push_back(p);
  }
  course.push_back(landing);
  course.push_back(end);
  return course;
}

/// Neither at a bifurcation nor at another lesion with a wall.
bool AnatomyBuilder::Clear(std::size_t host, double s, double distance) const
{
  for (const PlacedLesion& placed : this->Anatomy.lesions)
  {
    if (placed.HasWall() && placed.vessel == static_cast<int>(host) &&
      std::abs(placed.middle - s) < placed.HalfExtent() + distance)
    {
      return false;
    }
  }
  for (const DenseVessel& child : this->Dense)
  {
    if (child.parent == host && std::abs(child.parentArc - s) < distance)
    {
      return false;
    }
  }
  return true;
}

/// Away from the bifurcations, so that a narrowing is where it is said to be.
std::pair<std::size_t, double> AnatomyBuilder::PickPlace(
  RandomStream& random, int number, double distance) const
{
  const std::vector<std::string> hosts = this->Settings.dominance == Dominance::Left
    ? std::vector<std::string>{ "LAD", "LCx", "D1", "OM1" }
    : std::vector<std::string>{ "LAD", "RCA", "LCx", "D1" };
  const std::size_t host = this->ByName.at(hosts[number % hosts.size()]);
  const double last = std::min(80.0, this->Dense[host].arc.back() - 10.0);
  double s = random.Uniform(8.0, last);
  for (int attempt = 0; attempt < 200 && !this->Clear(host, s, distance); ++attempt)
  {
    s = random.Uniform(8.0, last);
  }
  return { host, s };
}

/// What the settings ask for by number: places are the seed's.
std::vector<PhantomLesion> AnatomyBuilder::CountedLesions() const
{
  std::vector<PhantomLesion> lesions;
  RandomStream random(this->Settings.seed, Stenoses);
  for (int n = 0; n < this->Settings.stenoses; ++n)
  {
    const auto [host, position] = this->PickPlace(random, n, 5.0);
    PhantomLesion lesion = UsualLesion("stenosis");
    lesion.vessel = this->Plans[host].name;
    lesion.position = position;
    lesion.length = random.Uniform(6.0, 12.0);
    lesion.degree = this->Settings.stenosisDegree;
    lesions.push_back(lesion);
  }
  if (this->Settings.chronicOcclusion)
  {
    const double origin = this->Dense[this->ByName.at("RV1")].parentArc;
    const double next = this->Dense[this->ByName.at("AM1")].parentArc;
    PhantomLesion lesion = UsualLesion("occlusion");
    lesion.vessel = "RCA";
    lesion.length = std::min(15.0, next - origin - 8.0);
    lesion.position = 0.5 * (origin + next);
    lesion.fill = 1.0; // by collaterals that bring as much contrast
    lesions.push_back(lesion);
  }
  return lesions;
}

/// The same for balls of calcium.
std::vector<PhantomLesion> AnatomyBuilder::CountedSpots() const
{
  std::vector<PhantomLesion> spots;
  RandomStream random(this->Settings.seed, Plaques);
  for (int n = 0; n < this->Settings.calcifiedPlaques; ++n)
  {
    const auto [host, position] = this->PickPlace(random, n, 3.0);
    PhantomLesion spot = UsualLesion("spot");
    spot.vessel = this->Plans[host].name;
    spot.position = position;
    // Its side is drawn about any direction across the vessel.
    const Vector3 centre = AtArc(this->Dense[host], this->Dense[host].points, position);
    const Vector3 tangent = this->TangentAt(host, position);
    const Vector3 side = tangent.unitOrthogonal();
    const double angle = random.Uniform(0.0, 2.0 * Pi);
    const Vector3 out = std::cos(angle) * side + std::sin(angle) * tangent.cross(side);
    const Vector3 normal = EpicardialNormal(this->Anatomy.frame, centre, tangent);
    spot.angle = std::atan2(out.dot(normal.cross(tangent)), out.dot(normal)) * 180.0 / Pi;
    spot.calciumThickness = 2.0 * random.Uniform(0.5, 1.2);
    spot.length = spot.calciumThickness;
    spots.push_back(spot);
  }
  return spots;
}

void AnatomyBuilder::PlaceLesions()
{
  for (const DenseVessel& vessel : this->Dense)
  {
    this->Healthy.push_back(vessel.radius);
  }
  for (const PhantomLesion& lesion : this->CountedLesions())
  {
    this->AddLesion(lesion, "");
  }
  const std::vector<PhantomLesion>& wanted = this->Settings.disease.lesions;
  for (std::size_t n = 0; n < wanted.size(); ++n)
  {
    this->AddLesion(wanted[n],
      "PhantomSettings: lesions[" + std::to_string(n) + "] (" +
        PhantomLesionKindName(wanted[n].kind) + ") ");
  }
  this->RefuseOverlaps();
  for (const PhantomLesion& spot : this->CountedSpots())
  {
    this->AddLesion(spot, "");
  }
  for (const PlacedLesion& placed : this->Anatomy.lesions)
  {
    DenseVessel& vessel = this->Dense[placed.vessel];
    for (std::size_t i = 0; i < vessel.points.size(); ++i)
    {
      vessel.radius[i] *= placed.LumenFactor(vessel.arc[i]);
    }
  }
  for (const PlacedLesion& placed : this->Anatomy.lesions)
  {
    if (placed.lesion.kind == PhantomLesionKind::Spot)
    {
      this->MakeSpot(placed);
    }
  }
}

/// @param where  begins what is said of a lesion that does not fit
void AnatomyBuilder::AddLesion(const PhantomLesion& lesion, const std::string& where)
{
  const auto found = this->ByName.find(lesion.vessel);
  std::string names;
  for (const VesselPlan& plan : this->Plans)
  {
    names += (names.empty() ? "" : ", ") + plan.name;
  }
  Require(
    found != this->ByName.end(), where + "is on " + lesion.vessel + ", which is none of " + names);
  const double whole = this->Dense[found->second].arc.back();
  PlacedLesion placed;
  placed.lesion = lesion;
  placed.vessel = static_cast<int>(found->second);
  placed.middle = lesion.relative ? lesion.position * whole : lesion.position;
  if (!where.empty())
  {
    const double half = 0.5 * lesion.length;
    const auto text = [](double value) { return std::to_string(std::lround(value)); };
    Require(placed.middle - half >= 0.0 && placed.middle + half <= whole,
      where + "goes from " + text(placed.middle - half) + " to " + text(placed.middle + half) +
        " mm, " + lesion.vessel + " from 0 to " + text(whole));
  }
  this->Anatomy.lesions.push_back(placed);
}

/// Two outer walls can not be in one place, nor a ball of calcium in a wall.
void AnatomyBuilder::RefuseOverlaps() const
{
  const std::vector<PlacedLesion>& lesions = this->Anatomy.lesions;
  for (std::size_t b = 0; b < lesions.size(); ++b)
  {
    for (std::size_t a = 0; a < b; ++a)
    {
      const auto spot = [](const PlacedLesion& placed)
      { return placed.lesion.kind == PhantomLesionKind::Spot; };
      const bool apart = lesions[a].vessel != lesions[b].vessel ||
        !(lesions[a].HasWall() || spot(lesions[a])) ||
        !(lesions[b].HasWall() || spot(lesions[b])) || (spot(lesions[a]) && spot(lesions[b])) ||
        std::abs(lesions[a].middle - lesions[b].middle) >=
          lesions[a].HalfExtent() + lesions[b].HalfExtent();
      Require(apart,
        "PhantomSettings: on " + lesions[b].lesion.vessel + " the " +
          PhantomLesionKindName(lesions[a].lesion.kind) + " at " +
          std::to_string(std::lround(lesions[a].middle)) + " mm overlaps the " +
          PhantomLesionKindName(lesions[b].lesion.kind) + " at " +
          std::to_string(std::lround(lesions[b].middle)) + " mm, with its shoulders");
    }
  }
}

Vector3 AnatomyBuilder::TangentAt(std::size_t v, double arc) const
{
  const DenseVessel& vessel = this->Dense[v];
  return (AtArc(vessel, vessel.points, arc + 0.5) - AtArc(vessel, vessel.points, arc - 0.5))
    .normalized();
}

void AnatomyBuilder::MakeSpot(const PlacedLesion& placed)
{
  const DenseVessel& vessel = this->Dense[placed.vessel];
  const double position = placed.middle;
  const Vector3 centre = AtArc(vessel, vessel.points, position);
  const Vector3 tangent = this->TangentAt(placed.vessel, position);
  const Vector3 normal = EpicardialNormal(this->Anatomy.frame, centre, tangent);
  const double angle = placed.lesion.angle * Pi / 180.0;
  const Vector3 out = std::cos(angle) * normal + std::sin(angle) * normal.cross(tangent);
  const double radius = 0.5 * placed.lesion.calciumThickness;
  this->Anatomy.plaques.push_back(
    { centre + out * (AtArc(vessel, vessel.radius, position) + 0.5 * radius), radius,
      placed.lesion.calciumValue, placed.vessel, -1 });
}

/// What lies behind an occlusion is filled from its far end: dimmer the nearer it is.
void AnatomyBuilder::FillLate(const PlacedLesion& occlusion)
{
  constexpr double rise = 0.5; // HU a mm away from the lesion: 5.1 +- 13.4 a cm in 94 occlusions
  const double first = occlusion.middle - 0.5 * occlusion.lesion.length;
  // Where each vessel begins to fill late.
  std::vector<double> from(this->Dense.size(), std::numeric_limits<double>::max());
  from[occlusion.vessel] = first;
  for (bool more = true; more;)
  {
    more = false;
    for (std::size_t v = 0; v < this->Dense.size(); ++v)
    {
      const std::size_t parent = this->Dense[v].parent;
      if (parent < this->Dense.size() && this->Dense[v].parentArc >= from[parent] && from[v] > 0.0)
      {
        from[v] = 0.0;
        more = true;
      }
    }
  }
  const PhantomTree& tree = this->Anatomy.tree;
  double start = 0.0;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    if (this->Anatomy.pointVessel[p] == occlusion.vessel && this->Anatomy.pointArc[p] <= first)
    {
      start = std::max(start, tree.abscissa[p]);
    }
  }
  start += occlusion.lesion.length;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    if (this->Anatomy.pointArc[p] >= from[this->Anatomy.pointVessel[p]])
    {
      const double usual =
        this->Settings.lumenHU + this->Settings.attenuationGradient * tree.abscissa[p] / 10.0;
      const double late = occlusion.lesion.fill * this->Settings.lumenHU +
        rise * std::max(0.0, tree.abscissa[p] - start);
      double& change = this->Anatomy.contrastChange[p];
      change = std::min(change, late - usual);
    }
  }
}

std::int64_t AnatomyBuilder::AddPoint(std::size_t v, double arc, double abscissa, int segment)
{
  const DenseVessel& vessel = this->Dense[v];
  this->Anatomy.tree.points.push_back(AtArc(vessel, vessel.points, arc));
  this->Anatomy.tree.radius.push_back(AtArc(vessel, vessel.radius, arc));
  this->Anatomy.tree.abscissa.push_back(abscissa);
  this->Anatomy.tree.segmentId.push_back(segment);
  this->Anatomy.pointVessel.push_back(static_cast<int>(v));
  this->Anatomy.pointArc.push_back(arc);
  this->Anatomy.healthyRadius.push_back(AtArc(vessel, this->Healthy[v], arc));
  char occluded = 0;
  char rigid = 0;
  double squeeze = 0.0;
  for (const PlacedLesion& placed : this->Anatomy.lesions)
  {
    if (placed.vessel == static_cast<int>(v))
    {
      occluded |= placed.Blocks(arc);
      const double profile = placed.Profile(arc);
      rigid |= placed.lesion.kind == PhantomLesionKind::Stent && profile > 0.5;
      squeeze +=
        placed.lesion.kind == PhantomLesionKind::Bridge ? placed.lesion.degree * profile : 0.0;
    }
  }
  this->Anatomy.occluded.push_back(occluded);
  this->Anatomy.rigid.push_back(rigid);
  this->Anatomy.squeeze.push_back(std::min(0.99, squeeze));
  return static_cast<std::int64_t>(this->Anatomy.tree.points.size()) - 1;
}

/// Depth first, so that a parent has a lower id than its daughters.
void AnatomyBuilder::Cut(std::size_t v, std::int64_t origin, int parentGroup)
{
  const DenseVessel& vessel = this->Dense[v];
  const VesselPlan& plan = this->Plans[v];
  std::sort(this->Children[v].begin(), this->Children[v].end());
  int segment = plan.segment;
  double from = 0.0;
  const double base = origin < 0 ? 0.0 : this->Anatomy.tree.abscissa[origin];
  std::int64_t last = origin;
  if (last < 0)
  {
    last = this->AddPoint(v, 0.0, 0.0, segment);
    this->Anatomy.ends.push_back({ static_cast<int>(v), last, last + 1,
      plan.tree == 0     ? 2
        : plan.tree == 1 ? 3
                         : 4 + static_cast<int>(this->Anatomy.ends.size()) });
  }
  struct Waiting
  {
    std::size_t vessel;
    std::int64_t point;
    int group;
  };
  std::vector<Waiting> waiting;
  std::size_t next = 0;
  int group = parentGroup;
  while (from < vessel.arc.back())
  {
    const bool toEnd = next == this->Children[v].size();
    const double to = toEnd ? vessel.arc.back() : this->Children[v][next].first;
    VesselTree::Branch branch;
    branch.groupId = static_cast<int>(this->Anatomy.tree.branches.size());
    branch.parentGroupId = group;
    branch.treeId = plan.tree;
    branch.generation = group < 0 ? 0 : this->Anatomy.tree.branches[group].generation + 1;
    branch.segmentId = segment;
    branch.points.push_back(last);
    const int count =
      std::max(2, static_cast<int>(std::lround((to - from) / this->Settings.centerlineSpacing)));
    for (int i = 1; i <= count; ++i)
    {
      const double arc = from + (to - from) * i / count;
      const std::int64_t point = this->AddPoint(v, arc, base + arc, segment);
      this->Anatomy.steps.push_back({ last, point, static_cast<int>(v), branch.groupId,
        this->Anatomy.intramural[v] != 0 || this->Anatomy.squeeze[point] > 0.0 });
      branch.points.push_back(point);
      last = point;
    }
    branch.length = to - from;
    branch.tortuosity = branch.length /
        (this->Anatomy.tree.points[branch.points.back()] -
          this->Anatomy.tree.points[branch.points.front()])
          .norm() -
      1.0;
    group = branch.groupId;
    this->Anatomy.tree.branches.push_back(branch);
    from = to;
    while (next < this->Children[v].size() && this->Children[v][next].first <= to)
    {
      const std::size_t child = this->Children[v][next].second;
      waiting.push_back({ child, last, group });
      this->Anatomy.junctions.push_back({ static_cast<int>(v), static_cast<int>(child), last });
      for (const auto& change : plan.changes)
      {
        if (change.first == this->Plans[child].name)
        {
          segment = change.second;
        }
      }
      ++next;
    }
  }
  this->Anatomy.ends.push_back(
    { static_cast<int>(v), last, last - 1, 4 + static_cast<int>(this->Anatomy.ends.size()) });
  for (const Waiting& child : waiting)
  {
    this->Cut(child.vessel, child.point, child.group);
  }
}

/// Branches end at the origins of the side vessels; points are even in between.
void AnatomyBuilder::CutIntoBranches()
{
  for (std::size_t v = 0; v < this->Plans.size(); ++v)
  {
    if (this->Dense[v].parent < this->Plans.size())
    {
      this->Children[this->Dense[v].parent].emplace_back(this->Dense[v].parentArc, v);
    }
  }
  for (std::size_t v = 0; v < this->Plans.size(); ++v)
  {
    if (this->Dense[v].parent >= this->Plans.size())
    {
      this->Cut(v, -1, -1);
    }
  }
  this->Anatomy.tree.displacement.assign(this->Anatomy.tree.points.size(), Vector3::Zero());
  this->Anatomy.tree.velocity.assign(this->Anatomy.tree.points.size(), Vector3::Zero());
  this->Anatomy.tree.visibility.assign(this->Anatomy.tree.points.size(), 1.0);
  for (std::size_t b = 0; b < this->Anatomy.tree.branches.size(); ++b)
  {
    if (this->Anatomy.tree.branches[b].parentGroupId < 0)
    {
      Strahler(this->Anatomy.tree, b);
    }
  }
}

std::int64_t AnatomyBuilder::NearestPoint(const PlacedLesion& placed) const
{
  std::int64_t nearest = 0;
  double minimum = std::numeric_limits<double>::max();
  for (std::size_t p = 0; p < this->Anatomy.tree.points.size(); ++p)
  {
    const double distance = std::abs(this->Anatomy.pointArc[p] - placed.middle);
    if (this->Anatomy.pointVessel[p] == placed.vessel && distance < minimum)
    {
      minimum = distance;
      nearest = static_cast<std::int64_t>(p);
    }
  }
  return nearest;
}

/// What lesions are once the tree is made: named points, late contrast, walls.
void AnatomyBuilder::LocateLesions()
{
  PhantomAnatomy& anatomy = this->Anatomy;
  const std::size_t count = anatomy.tree.points.size();
  anatomy.contrastChange.assign(count, 0.0);
  anatomy.wallOffset.assign(count, Vector3::Zero());
  anatomy.wallRadius = anatomy.tree.radius;
  std::size_t spot = 0;
  for (PlacedLesion& placed : anatomy.lesions)
  {
    placed.point = this->NearestPoint(placed);
    if (placed.lesion.kind == PhantomLesionKind::Spot)
    {
      anatomy.plaques[spot++].point = placed.point;
    }
    if (placed.lesion.kind == PhantomLesionKind::Occlusion)
    {
      this->FillLate(placed);
    }
  }
  AddCollaterals(anatomy, this->Settings);
  BuildParts(anatomy);
  if (this->Settings.disease.leads)
  {
    AddLeads(anatomy);
  }
}

void AnatomyBuilder::AddVein()
{
  std::vector<DenseVessel> whole = this->Dense;
  for (std::size_t v = 0; v < whole.size(); ++v)
  {
    whole[v].radius = this->Healthy[v];
  }
  this->Anatomy.vein = MakeVein(this->Anatomy.frame, whole, this->Dense[this->ByName.at("LAD")],
    this->Dense[this->ByName.at("D1")].parentArc, this->Dense[this->ByName.at("LCx")],
    this->Dense[this->ByName.at("OM1")].parentArc, this->Settings.centerlineSpacing);
}

void AnatomyBuilder::PlacePulmonaryTrunk()
{
  const Vector3 trunk(14.0, -38.0, 8.0);
  this->Anatomy.pulmonaryBase = (trunk + this->Varied(trunk) * 0.4) * this->Anatomy.frame.size;
  this->Anatomy.pulmonaryAxis = Vector3(0.15, 0.5, 0.85).normalized();
}
}

PhantomAnatomy::PhantomAnatomy(const PhantomSettings& settings)
  : frame(HeartSize(settings))
{
  AnatomyBuilder builder(*this, settings);
  builder.GrowVessels();
  builder.PlaceRoot();
  builder.PlacePulmonaryTrunk();
  builder.GrowGrafts();
  builder.PlaceLesions();
  builder.CutIntoBranches();
  builder.LocateLesions();
  builder.AddVein();
}
}
