#include "CoronaryPhantom.h"

#include "CounterRandom.h"
#include "Median.h"
#include "Numbers.h"
#include "PartialProgress.h"
#include "PhantomAnatomy.h"
#include "PhantomComposition.h"
#include "PhantomImage.h"
#include "PhantomLumen.h"
#include "PhantomMotion.h"
#include "PhantomSurface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr std::uint64_t LostPurpose = 301;
/// A phase counts as the lost one within this distance in time: a third of the paper's step.
constexpr double LostTolerance = 0.02;

void RequireInRange(const char* name, double value, double low, double high)
{
  if (!(value >= low && value <= high))
  {
    throw std::invalid_argument(std::string("PhantomSettings: ") + name + " is " +
      std::to_string(value) + ", it must lie in [" + std::to_string(low) + ", " +
      std::to_string(high) + "]");
  }
}
}

void PhantomSettings::Validate() const
{
  RequireInRange("dominance", static_cast<double>(static_cast<int>(this->dominance)), 0, 2);
  RequireInRange("calibre", this->calibre, 0.5, 2.0);
  RequireInRange("positionVariation", this->positionVariation, 0.0, 10.0);
  RequireInRange("calibreVariation", this->calibreVariation, 0.0, 0.3);
  RequireInRange("tortuosity", this->tortuosity, 0.0, 3.0);
  RequireInRange("stenoses", this->stenoses, 0, 20);
  RequireInRange("stenosisDegree", this->stenosisDegree, 0.0, 0.99);
  RequireInRange("calcifiedPlaques", this->calcifiedPlaques, 0, 50);
  RequireInRange("cycleLength", this->cycleLength, 0.3, 3.0);
  RequireInRange("motionAmplitude", this->motionAmplitude, 0.0, 1.3);
  RequireInRange("axialMotionRight", this->axialMotionRight, 0.0, 24.0);
  RequireInRange("axialMotionLeft", this->axialMotionLeft, 0.0, 24.0);
  RequireInRange("regionalLag", this->regionalLag, 0.0, 0.05);
  RequireInRange("regionalAmplitude", this->regionalAmplitude, 0.0, 0.1);
  RequireInRange("beatVariation", this->beatVariation, 0.0, 0.1);
  RequireInRange("beatIrregularity", this->beatIrregularity, 0.0, 5.0);
  RequireInRange("areaPulse", this->areaPulse, 0.0, 0.3);
  RequireInRange("temporalWindow", this->temporalWindow, 0.0, 0.5 * this->cycleLength);
  RequireInRange("noise", this->noise, 0.0, 200.0);
  RequireInRange("noiseCorrelation", this->noiseCorrelation, 0.0, 2.0);
  RequireInRange("systolicNoise", this->systolicNoise, 1.0, 4.0);
  for (const double sigma : this->pointSpread)
  {
    RequireInRange("pointSpread", sigma, 0.0, 3.0);
  }
  RequireInRange("lumenHU", this->lumenHU, 0.0, 1500.0);
  RequireInRange("attenuationGradient", this->attenuationGradient, -20.0, 5.0);
  RequireInRange("veinHU", this->veinHU, -200.0, 1500.0);
  for (const LostPhase& phase : this->lostPhases)
  {
    RequireInRange("lostPhases.time", phase.time, -100.0, 100.0);
    RequireInRange("lostPhases.fraction", phase.fraction, 0.0, 1.0);
  }
  RequireInRange("centerlineSpacing", this->centerlineSpacing, 0.1, 5.0);
  RequireInRange("surfaceSpacing", this->surfaceSpacing, 0.15, 1.5);
  this->disease.Validate();
}

struct CoronaryPhantom::Internals
{
  explicit Internals(const PhantomSettings& settings)
    : Settings(Checked(settings))
    , Anatomy(this->Settings)
    , Motion(this->Settings, this->Anatomy.frame)
    , Image(this->Settings, this->Anatomy, this->Motion)
  {
  }

  static const PhantomSettings& Checked(const PhantomSettings& settings)
  {
    settings.Validate();
    return settings;
  }

  /// Factor on the lumen radius at a moment.
  double RadiusFactor(double t) const
  {
    return std::sqrt(1.0 + this->Settings.areaPulse * PhantomMotion::PressurePulse(t));
  }

  /// A resting tree, moved to time t of a beat.
  PhantomTree Move(
    const PhantomTree& rest, double t, const Vector3& shift, double radiusFactor) const
  {
    PhantomTree tree = rest;
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      tree.points[p] = this->Motion.Position(rest.points[p], t, shift, &tree.velocity[p]);
      tree.displacement[p] = tree.points[p] - rest.points[p];
      tree.radius[p] *= radiusFactor;
    }
    return tree;
  }

  /// The arteries: stents hold their lumen, muscle bridges squeeze it.
  PhantomTree Arteries(double t, const Vector3& shift) const
  {
    const double factor = this->RadiusFactor(t);
    PhantomTree tree = this->Move(this->Anatomy.tree, t, shift, factor);
    if (!this->Anatomy.lesions.empty())
    {
      const double systole = std::clamp(PhantomMotion::Activation(t), 0.0, 1.0);
      for (std::size_t p = 0; p < tree.points.size(); ++p)
      {
        tree.radius[p] = this->Anatomy.tree.radius[p] * (this->Anatomy.rigid[p] ? 1.0 : factor) *
          (1.0 - this->Anatomy.squeeze[p] * systole);
      }
    }
    return tree;
  }

  /// Cones of each of the anatomy's parts.
  std::vector<std::vector<PhantomTube>> Parts(double t, const Vector3& shift) const
  {
    std::vector<std::vector<PhantomTube>> parts;
    for (const PhantomPart& part : this->Anatomy.parts)
    {
      part.Place([&](const Vector3& rest) { return this->Motion.Position(rest, t, shift); },
        this->RadiusFactor(t) - 1.0, parts.emplace_back());
    }
    return parts;
  }

  /// Normals of the flat ends: the planes move with the tissue.
  std::vector<Vector3> EndNormals(double t, const Vector3& shift) const
  {
    const std::vector<Vector3>& points = this->Anatomy.tree.points;
    std::vector<Vector3> normals;
    for (const VesselEnd& end : this->Anatomy.ends)
    {
      const Vector3 atRest = (points[end.point] - points[end.neighbour]).normalized();
      normals.push_back(this->Motion.PlaneNormal(points[end.point], atRest, t, shift));
    }
    return normals;
  }

  PhantomLumen Lumen(double t, double reach) const
  {
    const Vector3 shift = this->Motion.BeatShift(t);
    const PhantomTree tree = this->Arteries(t, shift);
    return PhantomLumen(this->Anatomy, tree.points, tree.radius, this->EndNormals(t, shift), reach,
      this->Anatomy.occluded);
  }

  /// The outer walls, like a tree of lumens.
  PhantomTree Walls(double t, const Vector3& shift) const
  {
    PhantomTree tree = this->Arteries(t, shift);
    const PhantomTree& rest = this->Anatomy.tree;
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      const double offset = this->Anatomy.wallOffset[p].norm();
      if (offset > 0.0)
      {
        // As PhantomPart::Place: thicknesses stay.
        const Vector3 towards =
          this->Motion.Position(rest.points[p] + this->Anatomy.wallOffset[p] / offset, t, shift) -
          tree.points[p];
        tree.points[p] += offset * towards.normalized();
      }
      const double grown = this->Anatomy.occluded[p] ? 0.0 : tree.radius[p] - rest.radius[p];
      tree.radius[p] = this->Anatomy.wallRadius[p] + grown;
    }
    return tree;
  }

  /// A resting surface at time t, on the wall that `lumen` is.
  PhantomSurface Carry(const PhantomSurface& rest, const PhantomLumen& lumen, double t, double from,
    const ProgressCallback& progress) const;

  /// All that images are made of at time t of a beat, with the weight 1.
  PhantomMoment Moment(double t, const Vector3& shift) const
  {
    PhantomMoment moment{ t, shift, 1.0, {}, {}, {}, this->EndNormals(t, shift),
      this->Parts(t, shift), {} };
    moment.tree = this->Arteries(t, shift);
    moment.vein = this->Move(this->Anatomy.vein, t, shift, 1.0);
    if (!this->Anatomy.parts.empty())
    {
      moment.wall = this->Walls(t, shift);
    }
    for (const Plaque& plaque : this->Anatomy.plaques)
    {
      moment.plaques.push_back(this->Motion.Position(plaque.centre, t, shift));
    }
    return moment;
  }

  /// The lumen with every point at its reference position, and nowhere narrower than so.
  PhantomLumen RestingLumen(const PhantomAnatomy& anatomy, double reach, double minimumRadius) const
  {
    const PhantomTree& tree = anatomy.tree;
    std::vector<double> radius = tree.radius;
    for (double& r : radius)
    {
      r = std::max(r, minimumRadius);
    }
    std::vector<Vector3> normals;
    for (const VesselEnd& end : anatomy.ends)
    {
      normals.push_back((tree.points[end.point] - tree.points[end.neighbour]).normalized());
    }
    return PhantomLumen(anatomy, tree.points, radius, normals, reach, anatomy.occluded);
  }

  /// Share of the contrast that is lost at each tree point, and over the whole image.
  std::vector<double> Lost(double t, double& wholePhase) const
  {
    const PhantomTree& tree = this->Anatomy.tree;
    std::vector<double> lost(tree.points.size(), 0.0);
    wholePhase = 0.0;
    for (std::size_t n = 0; n < this->Settings.lostPhases.size(); ++n)
    {
      const LostPhase& phase = this->Settings.lostPhases[n];
      if (std::abs(t - phase.time) > LostTolerance || phase.fraction <= 0.0)
      {
        continue;
      }
      if (phase.fraction >= 1.0)
      {
        wholePhase = 1.0;
        std::fill(lost.begin(), lost.end(), 1.0);
        continue;
      }
      // Connected stretches of the tree: where a smooth random field exceeds its quantile.
      const SmoothRandomField field(this->Settings.seed, LostPurpose + n, 15.0);
      std::vector<double> value(tree.points.size());
      for (std::size_t p = 0; p < value.size(); ++p)
      {
        value[p] = field(tree.points[p]);
      }
      const double minimum = InclusiveQuantileOf(value, 1.0 - phase.fraction);
      for (std::size_t p = 0; p < value.size(); ++p)
      {
        lost[p] = std::max(lost[p], SmoothStep((value[p] - minimum) / 0.2 + 0.5));
      }
    }
    return lost;
  }

  PhantomSettings Settings;
  PhantomAnatomy Anatomy;
  PhantomMotion Motion;
  PhantomImage Image;

  std::mutex SurfaceMutex;
  PhantomSurface RestSurface;            ///< empty until the first call of Surface
  std::unique_ptr<PhantomAnatomy> Outer; ///< the outer walls as lumens; none until OuterWall
  PhantomSurface RestWall;
};

CoronaryPhantom::CoronaryPhantom(const PhantomSettings& settings)
  : Data(std::make_unique<Internals>(settings))
{
}

CoronaryPhantom::~CoronaryPhantom() = default;

const PhantomSettings& CoronaryPhantom::Settings() const
{
  return this->Data->Settings;
}

Vector3 CoronaryPhantom::Position(const Vector3& reference, double t) const
{
  return this->Data->Motion.Position(reference, t, this->Data->Motion.BeatShift(t));
}

Vector3 CoronaryPhantom::Velocity(const Vector3& reference, double t) const
{
  Vector3 velocity;
  this->Data->Motion.Position(reference, t, Vector3::Zero(), &velocity);
  return velocity;
}

Vector3 CoronaryPhantom::ReferencePosition(const Vector3& position, double t) const
{
  const PhantomMotion& motion = this->Data->Motion;
  return motion.ReferencePosition(position, t, motion.BeatShift(t), position, 1e-7);
}

PhantomTree CoronaryPhantom::Tree(double t) const
{
  const PhantomAnatomy& anatomy = this->Data->Anatomy;
  const Vector3 shift = this->Data->Motion.BeatShift(t);
  PhantomTree tree = this->Data->Arteries(t, shift);
  double wholePhase = 0.0;
  const std::vector<double> lost = this->Data->Lost(t, wholePhase);
  const double window = this->Data->Settings.temporalWindow / this->Data->Settings.cycleLength;
  constexpr int pieces = 4;
  for (std::size_t p = 0; p < tree.points.size(); ++p)
  {
    double blur = 0.0;
    if (window > 0.0)
    {
      Vector3 before = this->Data->Motion.Position(anatomy.tree.points[p], t - 0.5 * window, shift);
      for (int i = 1; i <= pieces; ++i)
      {
        const Vector3 after = this->Data->Motion.Position(
          anatomy.tree.points[p], t + window * (double(i) / pieces - 0.5), shift);
        blur += (after - before).norm();
        before = after;
      }
    }
    const double diameter = 2.0 * tree.radius[p];
    tree.visibility[p] = anatomy.occluded[p] ? 0.0 : (1.0 - lost[p]) * diameter / (diameter + blur);
    if (anatomy.contrastChange[p] < 0.0)
    {
      const PhantomSettings& settings = this->Data->Settings;
      const double usual =
        settings.lumenHU + settings.attenuationGradient * anatomy.tree.abscissa[p] / 10.0;
      tree.visibility[p] *= std::max(0.0, 1.0 + anatomy.contrastChange[p] / std::max(1.0, usual));
    }
  }
  return tree;
}

std::vector<AorticRing> CoronaryPhantom::Aorta(double t) const
{
  constexpr double spacing = 1.0; // mm
  constexpr int around = 64;
  const AorticRoot& root = this->Data->Anatomy.root;
  const Vector3 shift = this->Data->Motion.BeatShift(t);
  const Vector3 u = root.axis.unitOrthogonal();
  const Vector3 v = root.axis.cross(u);
  std::vector<AorticRing> rings;
  for (double height = -AorticRoot::Valve; height <= AorticRoot::Above; height += spacing)
  {
    const Vector3 centre = root.centre + height * root.axis;
    AorticRing ring;
    ring.centre = this->Data->Motion.Position(centre, t, shift);
    for (int n = 0; n < around; ++n)
    {
      const double angle = 2.0 * Pi * n / around;
      const Vector3 rest =
        centre + root.RadiusAt(height) * (std::cos(angle) * u + std::sin(angle) * v);
      ring.rim.push_back(this->Data->Motion.Position(rest, t, shift));
    }
    rings.push_back(std::move(ring));
  }
  return rings;
}

std::vector<PhantomStenosis> CoronaryPhantom::Stenoses(double t) const
{
  const PhantomAnatomy& anatomy = this->Data->Anatomy;
  std::vector<PhantomStenosis> result;
  const PhantomTree tree = this->Tree(t);
  for (const PlacedLesion& placed : anatomy.lesions)
  {
    // As the tree has it at that point, all lesions there together.
    const double degree =
      1.0 - anatomy.tree.radius[placed.point] / anatomy.healthyRadius[placed.point];
    const bool narrows = placed.lesion.kind == PhantomLesionKind::Stenosis ||
      ((placed.lesion.kind == PhantomLesionKind::Plaque ||
         placed.lesion.kind == PhantomLesionKind::Stent) &&
        placed.lesion.degree > 0.0);
    if (!narrows)
    {
      continue;
    }
    PhantomStenosis stenosis;
    stenosis.vessel = anatomy.vesselNames[placed.vessel];
    stenosis.point = placed.point;
    stenosis.segmentId = tree.segmentId[placed.point];
    stenosis.position = tree.points[placed.point];
    stenosis.abscissa = tree.abscissa[placed.point];
    stenosis.length = placed.lesion.length;
    stenosis.degree = degree;
    stenosis.minimumRadius = tree.radius[placed.point];
    stenosis.referenceRadius = stenosis.minimumRadius / (1.0 - degree);
    result.push_back(stenosis);
  }
  return result;
}

std::vector<PhantomLesionTruth> CoronaryPhantom::Lesions() const
{
  const PhantomAnatomy& anatomy = this->Data->Anatomy;
  const PhantomTree& tree = anatomy.tree;
  const PhantomLumen lumen = this->Data->RestingLumen(anatomy, 1.0, 0.0);
  std::vector<PhantomLesionTruth> result;
  int spots = 0;
  for (std::size_t n = 0; n < anatomy.lesions.size(); ++n)
  {
    const PlacedLesion& placed = anatomy.lesions[n];
    PhantomLesionTruth truth;
    truth.lesion = placed.lesion;
    truth.middle = placed.middle;
    truth.point = placed.point;
    // On a plateau the middle is named.
    const bool wider = placed.lesion.kind == PhantomLesionKind::Ectasia;
    const auto leftAt = [&](std::int64_t p)
    { return anatomy.occluded[p] ? 0.0 : tree.radius[p] / anatomy.healthyRadius[p]; };
    for (std::size_t p = 0; p < tree.points.size(); ++p)
    {
      const bool within = anatomy.pointVessel[p] == placed.vessel &&
        std::abs(anatomy.pointArc[p] - placed.middle) <= 0.5 * placed.lesion.length;
      const double here = leftAt(static_cast<std::int64_t>(p));
      const double most = leftAt(truth.point);
      if (within && (wider ? here - most : most - here) > 1e-6)
      {
        truth.point = static_cast<std::int64_t>(p);
      }
    }
    truth.segmentId = tree.segmentId[truth.point];
    truth.abscissa = tree.abscissa[truth.point];
    truth.referenceRadius = anatomy.healthyRadius[truth.point];
    truth.minimumRadius = leftAt(truth.point) * truth.referenceRadius;
    truth.wallRadius = anatomy.wallRadius[truth.point];
    const double left = leftAt(truth.point);
    truth.degree = 1.0 - left;
    truth.areaDegree = 1.0 - left * left;
    const int spot = placed.lesion.kind == PhantomLesionKind::Spot ? spots++ : -1;
    MeasureComposition(anatomy, lumen, static_cast<int>(n), spot, truth);
    result.push_back(std::move(truth));
  }
  return result;
}

std::vector<PhantomVessel> CoronaryPhantom::Vessels() const
{
  const PhantomAnatomy& anatomy = this->Data->Anatomy;
  std::vector<PhantomVessel> vessels(anatomy.vesselNames.size());
  for (std::size_t v = 0; v < vessels.size(); ++v)
  {
    vessels[v].name = anatomy.vesselNames[v];
  }
  for (const Junction& junction : anatomy.junctions)
  {
    vessels[junction.childVessel].parent = anatomy.vesselNames[junction.parentVessel];
  }
  for (const AxisStep& step : anatomy.steps)
  {
    PhantomVessel& vessel = vessels[step.vessel];
    const double arc = anatomy.pointArc[step.second];
    vessel.treeId = anatomy.tree.branches[step.branch].treeId;
    vessel.length = std::max(vessel.length, arc);
    const bool late = anatomy.contrastChange[step.second] < 0.0 && !anatomy.occluded[step.second];
    if (late && (vessel.lateFrom < 0.0 || arc < vessel.lateFrom))
    {
      vessel.lateFrom = arc;
    }
  }
  for (const PlacedLesion& placed : anatomy.lesions)
  {
    if (placed.lesion.kind == PhantomLesionKind::Occlusion)
    {
      const double half = 0.5 * placed.lesion.length;
      vessels[placed.vessel].occlusions.push_back({ placed.middle - half, placed.middle + half });
    }
  }
  return vessels;
}

std::vector<PhantomCollateralTruth> CoronaryPhantom::Collaterals(double t) const
{
  const PhantomAnatomy& anatomy = this->Data->Anatomy;
  std::vector<PhantomCollateralTruth> result;
  for (const PlacedCollateral& placed : anatomy.collaterals)
  {
    PhantomCollateralTruth truth{ placed.collateral, {},
      0.5 * placed.collateral.diameter * this->Data->RadiusFactor(t), placed.value, 0.0,
      placed.clearance };
    for (const PartNode& node : anatomy.parts[placed.part].nodes)
    {
      truth.points.push_back(this->Position(node.axis, t));
      const std::size_t count = truth.points.size();
      truth.length += count > 1 ? (truth.points[count - 1] - truth.points[count - 2]).norm() : 0.0;
    }
    result.push_back(std::move(truth));
  }
  return result;
}

std::vector<PhantomPlaque> CoronaryPhantom::Plaques(double t) const
{
  const PhantomAnatomy& anatomy = this->Data->Anatomy;
  std::vector<PhantomPlaque> result;
  for (const Plaque& plaque : anatomy.plaques)
  {
    result.push_back({ anatomy.vesselNames[plaque.vessel], anatomy.tree.segmentId[plaque.point],
      plaque.point, anatomy.tree.abscissa[plaque.point], this->Position(plaque.centre, t),
      plaque.radius, plaque.value });
  }
  return result;
}

PhantomTree CoronaryPhantom::Vein(double t) const
{
  return this->Data->Move(this->Data->Anatomy.vein, t, this->Data->Motion.BeatShift(t), 1.0);
}

std::vector<PhantomOstium> CoronaryPhantom::Ostia(double t) const
{
  const PhantomAnatomy& anatomy = this->Data->Anatomy;
  std::vector<PhantomOstium> ostia;
  for (const VesselEnd& end : anatomy.ends)
  {
    if (end.entityId <= 3)
    {
      const Vector3 position = this->Position(anatomy.tree.points[end.point], t);
      const Vector3 inside = this->Position(anatomy.tree.points[end.neighbour], t);
      ostia.push_back(
        { end.entityId == 2 ? "LCA" : "RCA", position, (inside - position).normalized(),
          anatomy.tree.radius[end.point] * this->Data->RadiusFactor(t) });
    }
  }
  return ostia;
}

PhantomSurface CoronaryPhantom::Surface(double t, const ProgressCallback& progress) const
{
  Internals& data = *this->Data;
  const PhantomAnatomy& anatomy = data.Anatomy;
  double from = 0.0;
  {
    const std::lock_guard<std::mutex> lock(data.SurfaceMutex);
    if (data.RestSurface.points.empty())
    {
      from = 0.7;
      data.RestSurface = MeshLumen(anatomy, data.RestingLumen(anatomy, 2.5, MinimumMeshedRadius),
        data.Settings.surfaceSpacing, PartOf(progress, 0.0, from));
    }
  }
  return data.Carry(data.RestSurface, data.Lumen(t, 2.5), t, from, progress);
}

PhantomSurface CoronaryPhantom::OuterWall(double t, const ProgressCallback& progress) const
{
  Internals& data = *this->Data;
  double from = 0.0;
  {
    const std::lock_guard<std::mutex> lock(data.SurfaceMutex);
    if (!data.Outer)
    {
      from = 0.7;
      auto outer = std::make_unique<PhantomAnatomy>(data.Anatomy);
      for (std::size_t p = 0; p < outer->tree.points.size(); ++p)
      {
        outer->tree.points[p] += outer->wallOffset[p];
        outer->tree.radius[p] = outer->wallRadius[p];
        outer->occluded[p] = 0;
      }
      data.RestWall = MeshLumen(*outer, data.RestingLumen(*outer, 2.5, MinimumMeshedRadius),
        data.Settings.surfaceSpacing, PartOf(progress, 0.0, from));
      data.Outer = std::move(outer);
    }
  }
  const Vector3 shift = data.Motion.BeatShift(t);
  const PhantomTree wall = data.Walls(t, shift);
  const PhantomLumen lumen(
    *data.Outer, wall.points, wall.radius, data.EndNormals(t, shift), 2.5, data.Outer->occluded);
  return data.Carry(data.RestWall, lumen, t, from, progress);
}

PhantomSurface CoronaryPhantom::Internals::Carry(const PhantomSurface& rest,
  const PhantomLumen& lumen, double t, double from, const ProgressCallback& progress) const
{
  PhantomSurface surface = rest;
  const Vector3 shift = this->Motion.BeatShift(t);
  ParallelFor(
    static_cast<std::int64_t>(surface.points.size()), 512,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t p = first; p < last; ++p)
      {
        const Vector3 before = surface.points[p];
        Vector3 position = this->Motion.Position(before, t, shift);
        lumen.Project(position, 1e-4);
        surface.points[p] = position;
        surface.displacement[p] = position - before;
      }
    },
    PartOf(progress, from, 1.0));
  return surface;
}

double CoronaryPhantom::LumenDistance(const Vector3& position, double t) const
{
  return std::max(-farAway, this->Data->Lumen(t, farAway).Evaluate(position).distance);
}

void CoronaryPhantom::LumenDistances(const ImageGrid& grid, const std::array<int, 6>& part,
  double t, double reach, float* distances, const ProgressCallback& progress) const
{
  RequireGrid(grid, part);
  const double limit = std::clamp(reach, 0.0, farAway);
  const std::int64_t nx = part[1] - part[0] + 1;
  const std::int64_t ny = part[3] - part[2] + 1;
  const std::int64_t nz = part[5] - part[4] + 1;
  if (nx <= 0 || ny <= 0 || nz <= 0)
  {
    return;
  }
  const PhantomLumen lumen = this->Data->Lumen(t, limit);
  ParallelFor(
    ny * nz, 16,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t row = first; row < last; ++row)
      {
        const auto j = static_cast<double>(part[2] + row % ny);
        const auto k = static_cast<double>(part[4] + row / ny);
        for (std::int64_t i = 0; i < nx; ++i)
        {
          const Vector3 p = grid.IndexToWorld(static_cast<double>(part[0] + i), j, k);
          distances[row * nx + i] =
            static_cast<float>(std::clamp(lumen.Evaluate(p).distance, -limit, limit));
        }
      }
    },
    progress);
  Report(progress, 1.0);
}

ImageGrid CoronaryPhantom::DefaultGrid(double spacing, double margin) const
{
  if (!(spacing > 0.0) || !std::isfinite(spacing) || !std::isfinite(margin))
  {
    throw std::invalid_argument("CoronaryPhantom: the spacing must be positive");
  }
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::max());
  Vector3 high = -low;
  const PhantomTree& rest = this->Data->Anatomy.tree;
  constexpr int moments = 20;
  for (int m = 0; m < moments; ++m)
  {
    for (std::size_t p = 0; p < rest.points.size(); p += 4)
    {
      const Vector3 position = this->Data->Motion.Position(
        rest.points[p], static_cast<double>(m) / moments, Vector3::Zero());
      low = low.cwiseMin(position);
      high = high.cwiseMax(position);
    }
  }
  ImageGrid grid;
  grid.spacing = Vector3::Constant(spacing);
  for (int axis = 0; axis < 3; ++axis)
  {
    // Round numbers are easier to read in an information panel.
    grid.origin[axis] = std::floor(low[axis] - margin);
    grid.extent[2 * axis] = 0;
    grid.extent[2 * axis + 1] =
      static_cast<int>(std::ceil((high[axis] + margin - grid.origin[axis]) / spacing));
  }
  return grid;
}

void CoronaryPhantom::Render(const ImageGrid& grid, const std::array<int, 6>& part, double t,
  std::int16_t* values, const ProgressCallback& progress) const
{
  const Internals& data = *this->Data;
  const double window = data.Settings.temporalWindow / data.Settings.cycleLength;
  const Vector3 shift = data.Motion.BeatShift(t);

  // Moments through the window, weighted like a half scan: flat, with soft ends, and as wide at
  // half its height as the window. As many as the fastest point needs for steps of 0.5 mm.
  int count = 1;
  if (window > 0.0)
  {
    double farthest = 0.0;
    for (std::size_t p = 0; p < data.Anatomy.tree.points.size(); p += 20)
    {
      const auto at = [&](double time)
      { return data.Motion.Position(data.Anatomy.tree.points[p], time, shift); };
      farthest = std::max(
        farthest, (at(t + 0.6 * window) - at(t)).norm() + (at(t) - at(t - 0.6 * window)).norm());
    }
    count = std::clamp(2 * static_cast<int>(std::ceil(farthest)) + 1, 5, 15);
  }
  std::vector<PhantomMoment> moments;
  double sum = 0.0;
  for (int m = 0; m < count; ++m)
  {
    const double u = (m + 0.5) / count - 0.5; // of 1.2 windows
    const double weight = 1.0 - SmoothStep((std::abs(1.2 * u) - 0.4) / 0.2);
    PhantomMoment moment = data.Moment(t + 1.2 * u * window, shift);
    moment.weight = weight;
    sum += weight;
    moments.push_back(std::move(moment));
  }
  for (PhantomMoment& moment : moments)
  {
    moment.weight /= sum;
  }
  double wholePhase = 0.0;
  const std::vector<double> lost = data.Lost(t, wholePhase);
  data.Image.Render(grid, part, t, moments, lost, wholePhase, values, progress);
}

std::vector<PhantomTube> CoronaryPhantom::Tubes(double t) const
{
  const PhantomAnatomy& anatomy = this->Data->Anatomy;
  const PhantomSettings& settings = this->Data->Settings;
  const Vector3 shift = this->Data->Motion.BeatShift(t);
  const PhantomTree tree = this->Data->Arteries(t, shift);
  const std::vector<std::vector<PhantomTube>> parts = this->Data->Parts(t, shift);
  std::vector<PhantomTube> tubes;
  const auto addLayers = [&](PartLayer from, PartLayer to)
  {
    for (std::size_t n = parts.size(); n-- > 0;)
    {
      if (anatomy.parts[n].layer >= from && anatomy.parts[n].layer <= to)
      {
        tubes.insert(tubes.end(), parts[n].begin(), parts[n].end());
      }
    }
  };
  addLayers(PartLayer::Metal, PartLayer::Metal);
  const AxisStep* before = nullptr;
  for (const AxisStep& step : anatomy.steps)
  {
    if (anatomy.occluded[step.first] || anatomy.occluded[step.second])
    {
      before = nullptr;
      continue;
    }
    // A side vessel's first point is its parent's, with the parent's radius.
    const double start = anatomy.pointVessel[step.first] == step.vessel ? tree.radius[step.first]
                                                                        : tree.radius[step.second];
    const double path = 0.5 * (tree.abscissa[step.first] + tree.abscissa[step.second]);
    const double change =
      0.5 * (anatomy.contrastChange[step.first] + anatomy.contrastChange[step.second]);
    tubes.push_back(
      { tree.points[step.first], tree.points[step.second], start, tree.radius[step.second],
        before != nullptr && before->second == step.first && before->vessel == step.vessel,
        PhantomTissue::Blood,
        settings.lumenHU + settings.attenuationGradient * path / 10.0 + change, step.inMuscle });
    before = &step;
  }
  addLayers(PartLayer::Wall, PartLayer::Calcium);
  return tubes;
}

void CoronaryPhantom::RenderMaterials(const ImageGrid& grid, double t,
  const PhantomMaterials& materials, const std::array<float*, 3>& maps,
  const ProgressCallback& progress) const
{
  const Internals& data = *this->Data;
  const auto tissueOf = [](const Tissues::Layer& layer)
  {
    if (layer.content != Tissues::Content::Tissue)
    {
      return PhantomTissue::Blood;
    }
    const float value = layer.value;
    return value > 200.0f ? PhantomTissue::Calcified
      : value > 60.0f     ? PhantomTissue::Muscle
      : value > 0.0f      ? PhantomTissue::Soft
      : value > -300.0f   ? PhantomTissue::Fat
                          : PhantomTissue::Lung;
  };
  PhantomPalette palette;
  palette.images = 3;
  for (const Tissues::Layer& layer : Tissues(data.Settings, data.Anatomy).Layers)
  {
    palette.layers.push_back(materials(tissueOf(layer), layer.value));
  }
  palette.background = materials(PhantomTissue::Lung, Tissues::Background);
  palette.fat = materials(PhantomTissue::Fat, Fat);
  palette.muscle = materials(PhantomTissue::Muscle, Muscle);
  palette.vein = materials(PhantomTissue::Blood, data.Settings.veinHU);
  data.Image.RenderMaps(grid, data.Moment(t, data.Motion.BeatShift(t)), palette, maps, progress);
}

CoronaryPhantom::Box CoronaryPhantom::Body() const
{
  const Tissues::Shape thorax = Tissues(this->Data->Settings, this->Data->Anatomy).Shapes.front();
  return { thorax.a - thorax.b, thorax.a + thorax.b };
}

double CoronaryPhantom::CoatValue(bool inMuscle)
{
  return inMuscle ? Muscle : Fat;
}

std::vector<PhantomMotionSummary> CoronaryPhantom::SummarizeMotion() const
{
  const PhantomTree& rest = this->Data->Anatomy.tree;
  struct Group
  {
    const char* name;
    std::vector<int> segments;
    double nearest, farthest; // mm from the ostium
  };
  const double all = std::numeric_limits<double>::max();
  const std::vector<Group> groups = { { "LM", { LeftMain }, 0.0, all },
    { "proximal left tree (5 cm)", { LeftMain, ProximalLAD, MidLAD, ProximalLCx, DistalLCx }, 0.0,
      50.0 },
    { "LAD proximal", { ProximalLAD }, 0.0, all }, { "LAD mid", { MidLAD }, 0.0, all },
    { "LAD distal", { DistalLAD }, 0.0, all },
    { "diagonals", { FirstDiagonal, SecondDiagonal, ThirdDiagonal }, 0.0, all },
    { "LCx", { ProximalLCx, DistalLCx }, 0.0, all },
    { "OM", { FirstObtuseMarginal, SecondObtuseMarginal, ThirdObtuseMarginal }, 0.0, all },
    { "RCA proximal to mid", { ProximalRCA, MidRCA }, 0.0, all },
    { "RCA distal", { DistalRCA }, 0.0, all }, { "PDA", { RightPDA, LeftPDA }, 0.0, all },
    { "PLB", { RightPLB, LeftPLB }, 0.0, all } };
  constexpr int moments = 200;
  const double step = 1000.0 * this->Data->Settings.cycleLength / moments; // ms

  std::vector<PhantomMotionSummary> summaries;
  for (const Group& group : groups)
  {
    std::vector<std::size_t> points;
    for (std::size_t p = 0; p < rest.points.size(); ++p)
    {
      if (std::find(group.segments.begin(), group.segments.end(), rest.segmentId[p]) !=
          group.segments.end() &&
        rest.abscissa[p] >= group.nearest && rest.abscissa[p] <= group.farthest)
      {
        points.push_back(p);
      }
    }
    if (points.empty())
    {
      continue;
    }
    PhantomMotionSummary summary;
    summary.name = group.name;
    double speedSum = 0.0;
    for (const std::size_t p : points)
    {
      std::vector<Vector3> path(moments);
      for (int m = 0; m < moments; ++m)
      {
        Vector3 velocity;
        path[m] = this->Data->Motion.Position(
          rest.points[p], static_cast<double>(m) / moments, Vector3::Zero(), &velocity);
        speedSum += velocity.norm();
        summary.peakSpeed = std::max(summary.peakSpeed, velocity.norm());
      }
      double farthest = 0.0;
      for (int a = 0; a < moments; ++a)
      {
        for (int b = a + 1; b < moments; ++b)
        {
          farthest = std::max(farthest, (path[a] - path[b]).norm());
        }
      }
      summary.amplitude += farthest / static_cast<double>(points.size());
      // Longest run of moments that stay pairwise within 1 mm.
      const auto longest = [&](double from, double to)
      {
        int best = 0;
        const int last = static_cast<int>(to * moments);
        for (int a = static_cast<int>(from * moments); a < last; ++a)
        {
          int b = a + 1;
          for (bool quiet = true; b < last && quiet; b += quiet ? 1 : 0)
          {
            for (int c = a; c < b && quiet; ++c)
            {
              quiet = (path[b] - path[c]).norm() < 1.0;
            }
          }
          best = std::max(best, b - 1 - a);
        }
        return best * step;
      };
      summary.systolicRest += longest(0.20, 0.55) / static_cast<double>(points.size());
      summary.diastolicRest += longest(0.55, 0.95) / static_cast<double>(points.size());
    }
    summary.meanSpeed = speedSum / static_cast<double>(points.size() * moments);

    double lengthAtRest = 0.0;
    double lengthAtSystole = 0.0;
    for (const AxisStep& axisStep : this->Data->Anatomy.steps)
    {
      const bool member = std::binary_search(points.begin(), points.end(),
                            static_cast<std::size_t>(axisStep.first)) &&
        std::binary_search(points.begin(), points.end(), static_cast<std::size_t>(axisStep.second));
      if (member)
      {
        const Vector3& p = rest.points[axisStep.first];
        const Vector3& q = rest.points[axisStep.second];
        lengthAtRest += (this->Position(q, 0.0) - this->Position(p, 0.0)).norm();
        lengthAtSystole += (this->Position(q, 0.35) - this->Position(p, 0.35)).norm();
      }
    }
    summary.systolicStrain = lengthAtRest > 0.0 ? lengthAtSystole / lengthAtRest - 1.0 : 0.0;
    summaries.push_back(summary);
  }
  return summaries;
}
}
