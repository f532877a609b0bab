#include "PatientHeart.h"

#include "CoronaryAnatomy.h"
#include "CubicStep.h"
#include "Median.h"
#include "Require.h"
#include "SegmentAtlas.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace coronary
{
namespace
{
// What a heart's groove differs from the plane of the mean one, and vessels from the groove (one standard deviation).
// Dodge 1988 gives 10 mm for a point of a vessel in each direction; of the whole plane it is less.
constexpr double GrooveOffset = 8.0;       // mm
constexpr double GrooveTilt = 0.18;        // radians
constexpr double GrooveScatter = 4.0;      // mm, of a stretch of vessel
constexpr double GrooveStretch = 15.0;     // mm of vessel that scatter as one
constexpr double LeastAxisError = 0.07;    // radians: the long axis is not quite the plane's normal
constexpr double ApexScatter = 5.0;        // mm, of an apex that an artery reaches
constexpr double LengthVariation = 0.10;   // of hearts as large
constexpr double ReachesApex = 0.85;       // of the expected length
constexpr double FarFromAtlas = 30.0;      // mm of the mean heart
constexpr double LeastGrooveVessel = 15.0; // mm
constexpr double LeastMarginVessel = 60.0; // mm of RCA, which then has turned around the margin
constexpr double NamedFrom = 15.0;         // mm from a root on, until which a name has to come

struct Sample
{
  Vector3 position;
  double length = 0.0; ///< mm of vessel that it stands for
  int segment = 0;
};

int SegmentAt(const VesselTree& tree, const VesselTree::Branch& branch, std::int64_t point)
{
  return tree.segmentId.empty() ? branch.segmentId
                                : tree.segmentId[static_cast<std::size_t>(point)];
}

std::vector<Sample> SamplesOf(const VesselTree& tree)
{
  std::vector<Sample> samples;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    for (std::size_t n = 0; n + 1 < branch.points.size(); ++n)
    {
      const Vector3& first = tree.points[static_cast<std::size_t>(branch.points[n])];
      const Vector3& second = tree.points[static_cast<std::size_t>(branch.points[n + 1])];
      samples.push_back({ 0.5 * (first + second), (second - first).norm(),
        SegmentAt(tree, branch, branch.points[n + 1]) });
    }
  }
  return samples;
}

bool IsRca(int segment)
{
  return segment == ProximalRCA || segment == MidRCA || segment == DistalRCA;
}
bool IsLcx(int segment)
{
  return segment == ProximalLCx || segment == DistalLCx;
}
bool IsLad(int segment)
{
  return segment == ProximalLAD || segment == MidLAD || segment == DistalLAD;
}
bool EndsAtApex(int segment)
{
  return segment == DistalLAD || segment == RightPDA || segment == LeftPDA;
}

std::string Text(const char* form, double value)
{
  char text[240];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

void CheckPose(const HeartPose& named)
{
  const RequireOf require{ "HeartFrame" };
  require(named.axes.allFinite() && named.origin.allFinite() && std::isfinite(named.size),
    "a value is not finite");
  require((named.axes * named.axes.transpose() - Matrix3::Identity()).norm() < 1e-3,
    "its axes are not at right angles or not of one length");
  require(named.axes.determinant() > 0.0, "it is mirrored: its axes are left-handed");
  require(Within(named.size, 0.5, 2.0),
    "the heart is less than half or more than twice as large as the mean one: are positions in "
    "mm?");
}

/// Named vessels far from where they are in the mean heart: a mirrored tree, or names that are not its own.
void CheckPlaces(const std::vector<Sample>& samples, const HeartPose& named)
{
  const SegmentAtlas& atlas = SegmentAtlas::Get();
  std::vector<double> apart;
  for (const Sample& sample : samples)
  {
    const Vessel vessel = IsRca(sample.segment) ? Vessel::RightCoronary
      : IsLcx(sample.segment)                   ? Vessel::Circumflex
      : IsLad(sample.segment)                   ? Vessel::AnteriorDescending
                                                : Vessel::Other;
    if (vessel != Vessel::Other)
    {
      const Vector3 onAtlas =
        atlas.origin + atlas.axes.transpose() * named.ToHeart(sample.position);
      apart.push_back(std::sqrt(atlas.NearestOf(vessel, onAtlas).squared));
    }
  }
  Require(!apart.empty(),
    "The lines have no segment that is named LAD, LCx or RCA: the heart's place is not known");
  const double middle = MedianOf(apart);
  Require(middle <= FarFromAtlas,
    Text("The named vessels lie %.0f mm from where a heart of this frame has them: the tree is "
         "mirrored, or the names are not its own",
      middle));
}

/// The groove's plane over the named frame: height = offset + tilt . (a, b), mm.
struct Groove
{
  Vector3 plane = Vector3::Zero(); ///< offset, and the two tilts
  Matrix3 covariance = Matrix3::Zero();
  double rightLength = 0.0; ///< mm of the RCA that was used
  double leftLength = 0.0;
};

Groove FitGroove(const std::vector<Sample>& samples, const HeartPose& named)
{
  Matrix3 prior = Matrix3::Zero();
  prior.diagonal() << 1.0 / (GrooveOffset * GrooveOffset), 1.0 / (GrooveTilt * GrooveTilt),
    1.0 / (GrooveTilt * GrooveTilt);
  Groove groove;
  for (const Sample& sample : samples)
  {
    groove.rightLength += IsRca(sample.segment) ? sample.length : 0.0;
    groove.leftLength += IsLcx(sample.segment) ? sample.length : 0.0;
  }
  for (int iteration = 0; iteration < 10; ++iteration)
  {
    Matrix3 normal = prior;
    Vector3 right = Vector3::Zero();
    for (const Sample& sample : samples)
    {
      if (!IsRca(sample.segment) && !IsLcx(sample.segment))
      {
        continue;
      }
      const Vector3 q = named.axes * (sample.position - named.origin);
      const Vector3 row(1.0, q[0], q[1]);
      const double off = (q[2] - row.dot(groove.plane)) / GrooveScatter;
      // A stretch that left the groove counts less (Cauchy).
      const double weight = sample.length / GrooveStretch / (GrooveScatter * GrooveScatter) /
        (1.0 + (iteration > 0 ? off * off / 4.0 : 0.0));
      normal += weight * row * row.transpose();
      right += weight * q[2] * row;
    }
    groove.covariance = normal.inverse();
    groove.plane = groove.covariance * right;
  }
  return groove;
}

Vector3 OnPatient(const HeartPose& named, const Vector3& atlasPosition)
{
  const SegmentAtlas& atlas = SegmentAtlas::Get();
  return named.origin +
    named.size * (named.axes.transpose() * (atlas.axes * (atlasPosition - atlas.origin)));
}

/// The farthest place of the mean heart's LAD from its groove.
Vector3 MeanApex()
{
  const SegmentAtlas& atlas = SegmentAtlas::Get();
  const auto* apex = &atlas.points.front();
  for (const SegmentAtlas::Point& point : atlas.points)
  {
    if (point.vessel == Vessel::AnteriorDescending &&
      atlas.axes.row(2).dot(point.position - apex->position) > 0.0)
    {
      apex = &point;
    }
  }
  return apex->position;
}

/// Mean (a, b) of vessels weighted by length.
struct MeanPlace
{
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double length = 0.0;
  void Add(const Vector3& q, double weight)
  {
    this->sum += weight * q.head<2>();
    this->length += weight;
  }
  Eigen::Vector2d Mean() const { return this->sum / this->length; }
};

void TakeSeptum(const std::vector<Sample>& samples, const HeartPose& named, PatientHeart& heart)
{
  const auto inFront = [](int segment) { return segment == ProximalLAD || segment == MidLAD; };
  const auto behind = [](int segment) { return segment == RightPDA || segment == LeftPDA; };
  MeanPlace front;
  MeanPlace back;
  for (const Sample& sample : samples)
  {
    const Vector3 q = heart.ToHeart(sample.position);
    front.Add(q, inFront(sample.segment) ? sample.length : 0.0);
    back.Add(q, behind(sample.segment) ? sample.length : 0.0);
  }
  const bool hasFront = front.length >= LeastGrooveVessel;
  const bool hasBack = back.length >= LeastGrooveVessel;
  heart.from.push_back(std::string("interventricular groove: ") +
    (hasFront && hasBack ? "LAD and posterior descending artery"
        : hasFront       ? "LAD; behind as in the mean heart"
        : hasBack        ? "posterior descending artery; in front as in the mean heart"
                         : "as in the mean heart"));
  const SegmentAtlas& atlas = SegmentAtlas::Get();
  MeanPlace meanFront;
  MeanPlace meanBack;
  Vector3 margin = Vector3::Zero(); // farthest to the right
  const auto farther = [&](const Vector3& q) { margin = q[0] < margin[0] ? q : margin; };
  double rca = 0.0;
  for (const SegmentAtlas::Point& point : atlas.points)
  {
    const Vector3 q = heart.ToHeart(OnPatient(named, point.position));
    meanFront.Add(
      q, point.vessel == Vessel::AnteriorDescending && point.arc < atlas.midLadEnd ? 1.0 : 0.0);
    meanBack.Add(q, point.vessel == Vessel::RightPosteriorDescending ? 1.0 : 0.0);
    if (point.vessel == Vessel::RightCoronary)
    {
      farther(q);
    }
  }
  heart.frontGroove = hasFront ? front.Mean() : meanFront.Mean();
  heart.backGroove = hasBack ? back.Mean() : meanBack.Mean();
  for (const Sample& sample : samples)
  {
    rca += IsRca(sample.segment) ? sample.length : 0.0;
  }
  if (rca >= LeastMarginVessel)
  {
    margin = Vector3::Zero();
    for (const Sample& sample : samples)
    {
      if (IsRca(sample.segment))
      {
        farther(heart.ToHeart(sample.position));
      }
    }
  }
  heart.rightWidth = std::max(20.0, heart.SeptumDistance(margin));
}

void TakeOstia(const VesselTree& tree, const HeartPose& named, PatientHeart& heart)
{
  const SegmentAtlas& atlas = SegmentAtlas::Get();
  bool seen[2] = { false, false };
  Vector3* ostia[2] = { &heart.leftOstium, &heart.rightOstium };
  heart.leftOstium = OnPatient(named, atlas.leftOstium);
  heart.rightOstium = OnPatient(named, atlas.rightOstium);
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.parentGroupId != -1)
    {
      continue;
    }
    const Vector3& root = tree.points[static_cast<std::size_t>(branch.points.front())];
    // The first point may be that of a parent that is no longer there.
    for (std::size_t n = 1; n < branch.points.size(); ++n)
    {
      const std::int64_t point = branch.points[n];
      const int segment = SegmentAt(tree, branch, point);
      const bool left = segment == LeftMain || IsLad(segment) || IsLcx(segment);
      if ((tree.points[static_cast<std::size_t>(point)] - root).norm() > NamedFrom)
      {
        break;
      }
      if (left || IsRca(segment))
      {
        *ostia[left ? 0 : 1] = root;
        seen[left ? 0 : 1] = true;
        break;
      }
    }
  }
  heart.from.push_back(seen[0] && seen[1] ? "aortic root: both ostia"
      : seen[0] ? "aortic root: the left ostium; the right one as in the mean heart"
      : seen[1] ? "aortic root: the right ostium; the left one as in the mean heart"
                : "aortic root: as in the mean heart");
}
}

double PatientHeart::SeptumDistance(const Vector3& q) const
{
  const Eigen::Vector2d along = (this->frontGroove - this->backGroove).normalized();
  return Eigen::Vector2d(-along[1], along[0]).dot(q.head<2>() - this->backGroove);
}

double PatientHeart::RightShare(const Vector3& q) const
{
  return CubicStep(this->SeptumDistance(q) / this->rightWidth);
}

PatientHeart EstimateHeart(const VesselTree& tree, const HeartPose& named)
{
  CheckTree(tree);
  Require(tree.segmentId.empty() || tree.segmentId.size() == tree.points.size(),
    "The lines have another number of segment names than of points");
  CheckPose(named);
  const std::vector<Sample> samples = SamplesOf(tree);
  CheckPlaces(samples, named);

  PatientHeart heart;
  const Groove groove = FitGroove(samples, named);
  const bool right = groove.rightLength >= LeastGrooveVessel;
  const bool left = groove.leftLength >= LeastGrooveVessel;
  heart.from.push_back("atrioventricular groove: " +
    (right ? Text("%.0f mm of the RCA", groove.rightLength) : std::string("no RCA")) +
    (left ? Text(", %.0f mm of the LCx", groove.leftLength) : std::string(", no LCx")) +
    (right || left ? "" : "; as in the mean heart"));
  const Vector3 normal =
    (named.axes.transpose() * Vector3(-groove.plane[1], -groove.plane[2], 1.0)).normalized();
  heart.base = named.origin + groove.plane[0] * named.axes.row(2).transpose();

  // The apex is the farthest place that the LAD or a posterior descending artery reaches, if they are there so far.
  Vector3 apex = OnPatient(named, MeanApex());
  const double expected = normal.dot(apex - heart.base);
  double farthest = 0.0;
  const Sample* seen = nullptr;
  for (const Sample& sample : samples)
  {
    const double height = normal.dot(sample.position - heart.base);
    if (EndsAtApex(sample.segment) && height > farthest)
    {
      farthest = height;
      seen = &sample;
    }
  }
  const bool reached = seen != nullptr && farthest >= ReachesApex * expected;
  if (reached)
  {
    apex = seen->position;
  }
  heart.from.push_back(reached
      ? "apex: where the " + SegmentName(seen->segment) + " is farthest down"
      : "apex: as in the mean heart, no artery was followed to it");

  // Both say where the long axis points to: the groove's plane, and the apex as it is seen from the groove's middle.
  const Vector3 axis = (normal + (apex - heart.base).normalized()).normalized();
  heart.axes.row(2) = axis;
  const Vector3 across = named.axes.row(0).transpose();
  heart.axes.row(0) = (across - across.dot(axis) * axis).normalized();
  heart.axes.row(1) = axis.cross(Vector3(heart.axes.row(0)));
  heart.apex = apex;
  heart.length = axis.dot(apex - heart.base);
  Require(heart.length > 30.0, "The named vessels do not lead from the groove to the apex");

  TakeSeptum(samples, named, heart);
  TakeOstia(tree, named, heart);
  heart.axisDeviation = std::sqrt(
    0.5 * (groove.covariance(1, 1) + groove.covariance(2, 2)) + LeastAxisError * LeastAxisError);
  heart.baseDeviation = std::sqrt(groove.covariance(0, 0));
  heart.lengthDeviation = reached ? ApexScatter : LengthVariation * heart.length;
  return heart;
}
}
