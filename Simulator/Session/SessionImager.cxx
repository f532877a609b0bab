#include "SessionImager.h"

#include "BackgroundVolume.h"
#include "Fnv1a.h"
#include "MaskResampling.h"
#include "Numbers.h"
#include "PhantomMotion.h"
#include "RunImages.h"
#include "TearImage.h"
#include "VolumeFile.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr double CoilLength = 30.0; // mm from the tip: a coil of platinum, which shows best
constexpr double BraidShare =
  0.12; // of a guide catheter's wall that is steel: 16 flat wires of 25 x 75 um or so
constexpr double InnerTube =
  0.28; // mm: outer radius of the wire's lumen in a balloon, that its markers are on
constexpr double MarkerThickness = 0.04;    // mm of platinum
constexpr double TipMarkerThickness = 0.06; // mm, likewise of a microcatheter: seen beside a coil
constexpr double BlushSigma = 7.0;          // mm of the myocardium behind an outlet
constexpr double FaintestBlush = 1e-5;      // mL
constexpr double CoarseThorax = 4.0;        // mm between the voxels that the exposure control sees
constexpr std::size_t MemoryOfPart = 32U << 20U; // bytes of shadows that are kept

/// Where a branch leaves its parent: number of the nearest point of the parent's axis.
std::size_t Attachment(const WallTopology& topology, std::size_t branch)
{
  const std::vector<Vector3>& parent =
    topology.axis[static_cast<std::size_t>(topology.parent[branch])];
  const Vector3& start = topology.axis[branch].front();
  const auto nearest = std::min_element(parent.begin(), parent.end(),
    [&](const Vector3& a, const Vector3& b)
    { return (a - start).squaredNorm() < (b - start).squaredNorm(); });
  return static_cast<std::size_t>(nearest - parent.begin());
}

/**
 * The medium there is in the parent's column. At a parent's end the widest branch goes on from it without a gap;
 * the others begin at the wall, as side branches do.
 */
std::vector<double> HiddenLengths(const WallTopology& topology)
{
  const std::size_t count = topology.axis.size();
  std::vector<double> hidden(count, 0.0);
  std::vector<std::size_t> goesOn(count, count); // per parent: its widest branch at its end
  for (std::size_t b = 0; b < count; ++b)
  {
    if (topology.parent[b] < 0)
    {
      continue;
    }
    const auto parent = static_cast<std::size_t>(topology.parent[b]);
    const std::size_t at = Attachment(topology, b);
    hidden[b] = topology.axisRadius[parent][at];
    std::size_t& widest = goesOn[parent];
    const auto radius = [&](std::size_t branch) { return topology.axisRadius[branch].front(); };
    if (at + 1 == topology.axis[parent].size() && (widest == count || radius(b) > radius(widest)))
    {
      widest = b;
    }
  }
  for (const std::size_t widest : goesOn)
  {
    if (widest < count)
    {
      hidden[widest] = 0.0;
    }
  }
  return hidden;
}
}

Vector3 MiddleOfVessels(const WallTopology& topology)
{
  constexpr double Far = std::numeric_limits<double>::max();
  Vector3 low = Vector3::Constant(Far);
  Vector3 high = Vector3::Constant(-Far);
  for (const std::vector<Vector3>& branch : topology.axis)
  {
    for (const Vector3& point : branch)
    {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
  }
  if (low.x() > high.x())
  {
    throw std::invalid_argument("The vessels have no axis: there is nothing to aim the C-arm at.");
  }
  return 0.5 * (low + high);
}

CArmPose StartPose(const WallTopology& topology, const ImagingSettings& imaging)
{
  CArmPose pose = imaging.pose;
  if (!imaging.hasIsocentre)
  {
    pose.isocentre = MiddleOfVessels(topology);
  }
  return pose;
}

namespace
{
std::vector<Vector3> PointsOfAxis(const WallTopology& topology)
{
  std::vector<Vector3> points;
  for (const std::vector<Vector3>& branch : topology.axis)
  {
    points.insert(points.end(), branch.begin(), branch.end());
  }
  return points;
}

/// "12.3 mL" of so many voxels.
std::string Millilitres(std::int64_t voxels, const ImageGrid& grid)
{
  char text[32];
  std::snprintf(
    text, sizeof(text), "%.1f mL", 1e-3 * static_cast<double>(voxels) * grid.spacing.prod());
  return text;
}

/// The vessels' voxels of a run, on those of the CT.
std::vector<unsigned char> VesselVoxels(
  const std::string& path, const Vector3& offset, const ImageGrid& grid)
{
  const std::unique_ptr<VolumeSource> source = OpenVolumeFile(path);
  ImageGrid own = source->Info().grid;
  ScalarImage view;
  view.grid = own;
  std::vector<unsigned char> voxels(static_cast<std::size_t>(view.NumberOfVoxels()));
  // Some slices at a time: the whole as numbers would take four times as much memory.
  constexpr int Step = 16;
  const std::array<int, 3> size = view.Dimensions();
  const std::size_t slice = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
  std::vector<float> values(slice * Step);
  auto out = voxels.begin();
  for (int first = own.extent[4]; first <= own.extent[5]; first += Step)
  {
    std::array<int, 6> extent = own.extent;
    extent[4] = first;
    extent[5] = std::min(first + Step - 1, own.extent[5]);
    source->Read(0, extent, values.data());
    const auto end = values.begin() + static_cast<std::ptrdiff_t>(slice) * (extent[5] - first + 1);
    out = std::transform(values.begin(), end, out,
      [](float value) { return static_cast<unsigned char>(value != 0.0F); });
  }
  own.origin += offset;
  return ResampleMask(own, voxels, grid).voxels;
}

SessionBackground LoadPatient(const ImagingSettings& imaging, const ProgressCallback& progress)
{
  BackgroundOptions options;
  options.offset = imaging.backgroundOffset;
  RunImages run;
  if (!imaging.backgroundRun.empty())
  {
    run = ReadRunImages(imaging.backgroundRun);
    options.time = run.time;
    for (Vector3& ostium : run.blood.ostia)
    {
      ostium += options.offset;
    }
  }
  SessionBackground patient;
  patient.volume = ReadBackgroundVolume(imaging.background, options, progress);
  const ImageGrid& grid = patient.volume.grid;
  // The reading was nearly all of it; what follows can be cancelled, too.
  const ProgressCallback poll = [&progress](double) { return !progress || progress(1.0); };
  if (const std::int64_t gone = RemoveSurroundings(patient.volume, poll); gone > 0)
  {
    patient.notes.push_back(Millilitres(gone, grid) +
      " of the CT are thin and lie in air or behind the back, as a table does: they are left out "
      "of "
      "the X-ray images.");
  }
  if (!imaging.backgroundRun.empty())
  {
    const std::int64_t changed = RemoveContrastMedium(
      patient.volume, run.blood, VesselVoxels(run.mask, options.offset, grid), poll);
    patient.notes.push_back("The CT's own contrast medium was taken out of " +
      Millilitres(changed, grid) + " of heart and vessels.");
  }
  return patient;
}

/// About the arteries.
HounsfieldVolume ThoraxOf(const Scenario& scenario, const WallTopology& topology, double spacing,
  const ProgressCallback& progress)
{
  ThoraxSettings settings;
  settings.seed = scenario.imaging.thoraxSeed;
  settings.spacing = spacing;
  HounsfieldVolume volume = MakeThoraxPhantom(settings, progress);
  Vector3 offset = scenario.imaging.backgroundOffset;
  if (scenario.vessels.kind != VesselSource::Kind::Phantom)
  {
    offset += MiddleOfVessels(topology) - HeartFrame().ToWorld(HeartFrame::Centre);
  }
  volume.grid.origin += offset;
  return volume;
}
}

SessionBackground LoadBackground(
  const Scenario& scenario, const WallTopology& topology, const ProgressCallback& progress)
{
  const ImagingSettings& imaging = scenario.imaging;
  if (!imaging.background.empty())
  {
    return LoadPatient(imaging, progress);
  }
  return { ThoraxOf(scenario, topology, ThoraxSettings().spacing, progress), {} };
}

std::shared_ptr<const VolumeProjector> MakeProjector(
  const HounsfieldVolume& background, const ImagingSettings& imaging)
{
  const Attenuation materials(imaging.energy);
  return std::make_shared<VolumeProjector>(background.View(),
    [&materials](double hounsfield) { return materials.OfHounsfield(hounsfield); });
}

std::shared_ptr<const MovingParts> MovingPartsOf(const HounsfieldVolume& background,
  const WallTopology& topology, const ImagingSettings& imaging, const ProgressCallback& progress)
{
  if (!imaging.heartShadowMoves && imaging.breathing.amplitude == 0.0)
  {
    return nullptr;
  }
  Vector3 base = Vector3::Zero();
  double roots = 0.0;
  for (std::size_t b = 0; b < topology.axis.size(); ++b)
  {
    if (topology.parent[b] < 0)
    {
      base += topology.axis[b].front();
      roots += 1.0;
    }
  }
  const Attenuation materials(imaging.energy);
  return std::make_shared<MovingParts>(FindMovingParts(
    background, HeartAbout(PointsOfAxis(topology), base / roots),
    [&materials](double hounsfield) { return materials.OfHounsfield(hounsfield); }, progress));
}

std::shared_ptr<const VolumeProjector> MeasuredThorax(
  const Scenario& scenario, const WallTopology& topology)
{
  return MakeProjector(ThoraxOf(scenario, topology, CoarseThorax, {}), scenario.imaging);
}

SessionImager::SessionImager(const WallTopology& topology, const Scenario& scenario,
  std::shared_ptr<const VolumeProjector> background, bool worker,
  std::shared_ptr<const MovingParts> moving)
  : Scenario_(scenario)
  , Radii(topology.axisRadius)
  , Hidden(HiddenLengths(topology))
  , Materials(scenario.imaging.energy)
  , NeatContrast(this->Materials.OfContrastMedium(scenario.imaging.iodine))
  , AxisAtRest(PointsOfAxis(topology))
  , Images_({}, scenario.seed)
  , Aorta(AortaImage::Make(topology))
{
  BackgroundCacheSettings settings;
  settings.worker = worker;
  this->Background = std::make_unique<BackgroundCache>(std::move(background), settings);
  settings.memory = MemoryOfPart;
  const auto take = [&settings](const MovingPart& part, std::optional<Part>& own)
  {
    if (part.projector)
    {
      own.emplace(Part{ part.middle, std::make_unique<BackgroundCache>(part.projector, settings) });
    }
  };
  if (moving)
  {
    this->Place = moving->place;
    take(moving->heart, this->Heart);
    take(moving->diaphragm, this->Diaphragm);
  }
  this->InstrumentLayer = LineIntegrals(scenario.imaging.columns, scenario.imaging.columns);
  this->ContrastLayer = this->InstrumentLayer;
  this->BackgroundLayer = this->InstrumentLayer;
}

SessionImager::~SessionImager() = default;

CArmGeometry SessionImager::GeometryOf(const CArmPose& pose, double fieldOfView) const
{
  DetectorFormat format;
  format.columns = format.rows = this->Scenario_.imaging.columns;
  format.width = format.height = fieldOfView;
  return this->Background->Rounded(CArmGeometry(pose, format));
}

void SessionImager::Aim(const CArmPose& pose, double fieldOfView)
{
  this->Background->SetGeometry(this->GeometryOf(pose, fieldOfView));
}

const GreyImage& SessionImager::Expose(const SessionSnapshot& snapshot)
{
  if (this->Images_.Settings().detector.shutters != snapshot.shutters)
  {
    ImagerSettings settings = this->Images_.Settings();
    settings.detector.shutters = snapshot.shutters;
    this->Images_.SetSettings(settings);
  }
  const CArmGeometry geometry = this->GeometryOf(snapshot.pose, snapshot.fieldOfView);
  this->Background->SetGeometry(geometry);
  const CArmGeometry ofHeart = GeometryOfHeart(snapshot, geometry.Format());
  this->ProjectInstruments(snapshot, ofHeart);
  this->ProjectContrast(snapshot, ofHeart);
  this->MoveBackground(snapshot, geometry);
  return this->Images_.Expose(
    this->BackgroundLayer, this->InstrumentLayer, this->ContrastLayer, snapshot.exposure);
}

/// The shadows of its parts are begun one after the other when the whole is finished.
void SessionImager::MoveBackground(const SessionSnapshot& snapshot, const CArmGeometry& geometry)
{
  const auto whole = this->Background->Current(&this->Completeness);
  if (!whole)
  {
    std::fill(this->BackgroundLayer.values.begin(), this->BackgroundLayer.values.end(), 0.0F);
    return;
  }
  this->BackgroundLayer = *whole;
  double finished = this->Completeness;
  const auto move = [&](std::optional<Part>& part, const AffineMotion& motion)
  {
    if (!part || finished < 1.0 || motion.IsRest())
    {
      return;
    }
    part->shadow->SetGeometry(geometry);
    const auto shadow = part->shadow->Current(&finished);
    if (shadow && finished == 1.0)
    {
      AddMotion(*shadow, geometry, part->middle, motion, this->BackgroundLayer);
    }
  };
  AffineMotion beat;
  if (this->Scenario_.imaging.heartShadowMoves)
  {
    beat = AcrossHeart(MotionOf(this->AxisAtRest, snapshot.axis), this->Place);
  }
  beat.shift += HeartShift(snapshot.diaphragm);
  move(this->Heart, beat);
  move(this->Diaphragm, { Matrix3::Identity(), DiaphragmShift(snapshot.diaphragm) });
}

void SessionImager::ProjectInstruments(
  const SessionSnapshot& snapshot, const CArmGeometry& geometry)
{
  std::fill(this->InstrumentLayer.values.begin(), this->InstrumentLayer.values.end(), 0.0F);
  AddInstrument(
    this->WireOf(snapshot, snapshot.wire, snapshot.wireNumber), geometry, this->InstrumentLayer);
  if (!snapshot.secondWire.empty())
  {
    AddInstrument(this->WireOf(snapshot, snapshot.secondWire, snapshot.secondNumber), geometry,
      this->InstrumentLayer);
  }
  const auto addCatheter = [&](const InstrumentSegment& segment)
  {
    const std::size_t segments = std::max<std::size_t>(1, snapshot.catheter.size()) - 1;
    AddInstrument({ snapshot.catheter, std::vector<InstrumentSegment>(segments, segment) },
      geometry, this->InstrumentLayer);
  };
  const GuideCatheter& guide = this->Scenario_.catheter;
  const double wall = (1.0 - BraidShare) * this->Materials.Of(XRayMaterial::BariumPolymer) +
    BraidShare * this->Materials.Of(XRayMaterial::StainlessSteel);
  addCatheter({ guide.outerRadius, guide.innerRadius, wall });
  if (!snapshot.guide.empty())
  {
    this->ProjectGuideLumen(snapshot, geometry);
  }
  else if (snapshot.contrast.injected > 0.0)
  {
    // Nobody flushes it: what was injected last stays in it.
    addCatheter({ guide.innerRadius, 0.0, this->NeatContrast });
  }
  if (this->Scenario_.balloon && snapshot.balloon.size() > 1)
  {
    this->ProjectBalloon(snapshot, geometry);
  }
  this->ProjectStents(snapshot, geometry);
}

/// Each piece of its line has the mean of what lies in it.
void SessionImager::ProjectGuideLumen(const SessionSnapshot& snapshot, const CArmGeometry& geometry)
{
  const double radius = this->Scenario_.catheter.innerRadius;
  InstrumentChain lumen{ snapshot.catheter, {} };
  auto plug = snapshot.guide.begin();
  double left = plug->volume; // mL of the plug that are further from the tip
  double medium = 0.0;
  for (std::size_t n = 0; n + 1 < snapshot.catheter.size(); ++n)
  {
    const double whole =
      1e-3 * Pi * radius * radius * (snapshot.catheter[n + 1] - snapshot.catheter[n]).norm();
    double missing = whole;
    double inside = 0.0;
    while (missing > 0.0 && plug != snapshot.guide.end())
    {
      const double part = std::min(missing, left);
      inside += plug->medium * part;
      missing -= part;
      left -= part;
      if (left <= 0.0)
      {
        ++plug;
        left = plug != snapshot.guide.end() ? plug->volume : 0.0;
      }
    }
    const double share = whole > 0.0 ? inside / whole : 0.0;
    medium += share;
    lumen.segments.push_back({ radius, 0.0, share * this->NeatContrast });
  }
  if (medium > 0.0)
  {
    AddInstrument(lumen, geometry, this->InstrumentLayer);
  }
}

/// Shaft, markers, and what the balloon is filled with.
void SessionImager::ProjectBalloon(const SessionSnapshot& snapshot, const CArmGeometry& geometry)
{
  const BalloonCatheter& balloon = *BalloonOf(this->Scenario_, snapshot.balloonNumber);
  if (balloon.IsMicrocatheter())
  {
    this->ProjectMicrocatheter(balloon, snapshot.balloon, geometry);
    return;
  }
  const bool crimped = snapshot.report.balloon.crimped;
  const double polymer = this->Materials.Of(XRayMaterial::Nylon);
  const double platinum = this->Materials.Of(XRayMaterial::Platinum);
  InstrumentChain shaft{ snapshot.balloon, {} };
  InstrumentChain markers = shaft;
  ContrastBranch fill{ snapshot.balloon, snapshot.balloonRadii, {} };
  double behind = 0.0;
  for (std::size_t n = 0; n + 1 < snapshot.balloon.size(); ++n)
  {
    const double length = (snapshot.balloon[n + 1] - snapshot.balloon[n]).norm();
    const double middle = behind + 0.5 * length;
    const double folded = crimped ? balloon.CrimpedRadius(middle) : balloon.FoldedRadius(middle);
    const double inner = std::min(0.8 * folded, InnerTube);
    shaft.segments.push_back({ folded, inner, polymer });
    const double toMarker = std::min(
      std::abs(middle - balloon.tipLength), std::abs(middle - balloon.tipLength - balloon.length));
    const bool marked = toMarker <= 0.5 * balloon.markerLength;
    markers.segments.push_back({ InnerTube + MarkerThickness, InnerTube, marked ? platinum : 0.0 });
    const double radius = 0.5 * (snapshot.balloonRadii[n] + snapshot.balloonRadii[n + 1]);
    const double open = std::max(0.0, 1.0 - folded * folded / (radius * radius));
    fill.concentrations.push_back(balloon.fillFraction * open);
    behind += length;
  }
  AddInstrument(shaft, geometry, this->InstrumentLayer);
  AddInstrument(markers, geometry, this->InstrumentLayer);
  AddContrast({ fill }, this->NeatContrast, geometry, this->InstrumentLayer);
}

/// A braided tube, and a band at its tip.
void SessionImager::ProjectMicrocatheter(
  const BalloonCatheter& device, const std::vector<Vector3>& line, const CArmGeometry& geometry)
{
  const double wall = (1.0 - BraidShare) * this->Materials.Of(XRayMaterial::Nylon) +
    BraidShare * this->Materials.Of(XRayMaterial::StainlessSteel);
  const double platinum = this->Materials.Of(XRayMaterial::Platinum);
  InstrumentChain shaft{ line, {} };
  InstrumentChain marker = shaft;
  double behind = 0.0;
  for (std::size_t n = 0; n + 1 < line.size(); ++n)
  {
    const double length = (line[n + 1] - line[n]).norm();
    const double middle = behind + 0.5 * length;
    shaft.segments.push_back({ device.FoldedRadius(middle), device.innerRadius, wall });
    const bool marked = std::abs(middle - device.markerPlace) <= 0.5 * device.markerLength;
    marker.segments.push_back(
      { device.innerRadius + TipMarkerThickness, device.innerRadius, marked ? platinum : 0.0 });
    behind += length;
  }
  AddInstrument(shaft, geometry, this->InstrumentLayer);
  AddInstrument(marker, geometry, this->InstrumentLayer);
}

/// Struts are thinner than a pixel: a tube of as much metal.
void SessionImager::ProjectStents(const SessionSnapshot& snapshot, const CArmGeometry& geometry)
{
  const double metal = this->Materials.Of(XRayMaterial::CobaltChromium);
  for (const StentShape& stent : snapshot.stents)
  {
    InstrumentChain tube{ stent.line, {} };
    for (std::size_t n = 0; n + 1 < stent.line.size(); ++n)
    {
      const double inside = 0.5 * (stent.radii[n] + stent.radii[n + 1]);
      const double outside = inside + stent.design.strut;
      const double share = stent.design.metalShare * 0.5 * stent.design.diameter / inside;
      tube.segments.push_back({ outside, inside, std::min(1.0, share) * metal });
    }
    AddInstrument(tube, geometry, this->InstrumentLayer);
  }
}

CArmGeometry GeometryOfHeart(const SessionSnapshot& snapshot, const DetectorFormat& format)
{
  CArmPose pose = snapshot.pose;
  pose.isocentre -= HeartShift(snapshot.diaphragm);
  return { pose, format };
}

std::vector<Vector3> BalloonMarkers(const SessionSnapshot& snapshot, const Scenario& scenario)
{
  std::vector<Vector3> markers;
  if (snapshot.balloon.size() < 2)
  {
    return markers;
  }
  const BalloonCatheter& balloon = *BalloonOf(scenario, snapshot.balloonNumber);
  if (balloon.IsMicrocatheter())
  {
    return markers;
  }
  for (const double place : { balloon.tipLength, balloon.tipLength + balloon.length })
  {
    double behind = 0.0;
    for (std::size_t n = 0; n + 1 < snapshot.balloon.size(); ++n)
    {
      const Vector3 piece = snapshot.balloon[n + 1] - snapshot.balloon[n];
      const double length = piece.norm();
      if (place >= behind && place < behind + length)
      {
        markers.push_back(snapshot.balloon[n] + (place - behind) / length * piece);
      }
      behind += length;
    }
  }
  return markers;
}

InstrumentChain SessionImager::WireOf(
  const SessionSnapshot& snapshot, const std::vector<Vector3>& line, std::size_t number) const
{
  const double steel = this->Materials.Of(XRayMaterial::StainlessSteel);
  const double platinum = this->Materials.Of(XRayMaterial::Platinum);
  InstrumentChain wire;
  wire.points = line;
  // Behind what is simulated it lies in the catheter.
  double inCatheter = 0.0;
  for (std::size_t n = 1; n < snapshot.catheter.size() && !wire.points.empty(); ++n)
  {
    inCatheter += (snapshot.catheter[n] - snapshot.catheter[n - 1]).norm();
    if (inCatheter > this->Scenario_.settings.insideCatheter + 1.0)
    {
      wire.points.push_back(snapshot.catheter[n]);
    }
  }
  const Guidewire& device = *coronary::WireOf(this->Scenario_, number);
  double along = 0.0;
  for (std::size_t n = 0; n + 1 < wire.points.size(); ++n)
  {
    const double length = (wire.points[n + 1] - wire.points[n]).norm();
    const double middle = along + 0.5 * length;
    InstrumentSegment segment;
    segment.outerRadius =
      AlongWire(device, middle, [](const WireSection& section) { return section.radius; });
    // The coil of the tip is a tube of platinum wire, about a third of its radius thick.
    const bool coil = middle < CoilLength;
    segment.innerRadius = coil ? 0.65 * segment.outerRadius : 0.0;
    segment.attenuation = coil ? platinum : steel;
    wire.segments.push_back(segment);
    along += length;
  }
  return wire;
}

void SessionImager::ProjectContrast(const SessionSnapshot& snapshot, const CArmGeometry& geometry)
{
  std::fill(this->ContrastLayer.values.begin(), this->ContrastLayer.values.end(), 0.0F);
  this->Branches.resize(this->Radii.size());
  std::vector<ContrastBlush> clouds;
  std::size_t point = 0;
  std::size_t slab = 0;
  bool any = false;
  for (std::size_t b = 0; b < this->Radii.size(); ++b)
  {
    const std::vector<double>& radii = this->Radii[b];
    const std::size_t count = radii.size();
    const auto first = snapshot.axis.begin() + static_cast<std::ptrdiff_t>(point);
    const auto last = first + static_cast<std::ptrdiff_t>(count);
    std::size_t skip = 0;
    for (double along = 0.0; skip + 2 < count && along < this->Hidden[b]; ++skip)
    {
      const auto at = first + static_cast<std::ptrdiff_t>(skip);
      along += (at[1] - at[0]).norm();
    }
    ContrastBranch& branch = this->Branches[b];
    branch.points.assign(first + static_cast<std::ptrdiff_t>(skip), last);
    branch.radii.assign(radii.begin() + static_cast<std::ptrdiff_t>(skip), radii.end());
    for (std::size_t k = skip; k < count && !snapshot.lumen.empty(); ++k)
    {
      branch.radii[k - skip] = snapshot.lumen[point + k];
    }
    const auto slabs = snapshot.concentration.begin() + static_cast<std::ptrdiff_t>(slab);
    branch.concentrations.assign(
      slabs + static_cast<std::ptrdiff_t>(skip), slabs + static_cast<std::ptrdiff_t>(count) - 1);
    for (std::size_t k = skip; k + 1 < count && !snapshot.lumen.empty(); ++k)
    {
      // What the balloon catheter takes of the lumen holds none.
      const double taken = 0.5 * (snapshot.filled[point + k] + snapshot.filled[point + k + 1]);
      const double lumen = 0.5 * (snapshot.lumen[point + k] + snapshot.lumen[point + k + 1]);
      branch.concentrations[k - skip] *= std::max(0.0, 1.0 - taken * taken / (lumen * lumen));
    }
    any = any ||
      std::any_of(branch.concentrations.begin(), branch.concentrations.end(),
        [](double value) { return value > 0.0; });
    if (b < snapshot.blush.size() && snapshot.blush[b] > FaintestBlush)
    {
      clouds.push_back({ *(last - 1), snapshot.blush[b], BlushSigma });
    }
    point += count;
    slab += count - 1;
  }
  if (any)
  {
    AddContrast(this->Branches, this->NeatContrast, geometry, this->ContrastLayer);
  }
  if (!clouds.empty())
  {
    AddBlush(clouds, this->NeatContrast, geometry, this->ContrastLayer);
  }
  if (!snapshot.tears.empty())
  {
    AddTears(snapshot.tears, snapshot.axis, snapshot.lumen, this->NeatContrast, geometry,
      this->ContrastLayer);
  }
  if (this->Aorta && !snapshot.aorta.empty())
  {
    this->Aorta->Add(snapshot.axis, snapshot.aorta, snapshot.sinuses, this->NeatContrast, geometry,
      this->ContrastLayer);
  }
}

std::uint64_t SessionImager::HashOf(const GreyImage& image)
{
  std::uint64_t hash = Fnv1a(&image.columns, sizeof(image.columns));
  hash = Fnv1a(&image.rows, sizeof(image.rows), hash);
  return Fnv1a(image.values.data(), image.values.size(), hash);
}
}
