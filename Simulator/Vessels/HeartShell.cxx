#include "HeartShell.h"

#include "PhantomAnatomy.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace coronary
{
namespace
{
constexpr int Rings = 22;   // between the poles
constexpr int Around = 36;  // points of a ring
constexpr int Samples = 20; // phases
constexpr double Inside =
  0.97; // of the way from the middle to the vessels' axes: vessels lie upon it
constexpr double Below = 0.87; // of the epicardium: the arteries run partly in its fat
constexpr double Bell = 0.25;  // radians
constexpr double Nearest =
  10.0; // exponent of the mean: the nearer vessels count, or they would run inside
constexpr double BodyWeight = 3.0; // mm of vessel that the shape beneath counts as

/// Of a sphere: the first pole, rings, the last pole.
std::vector<Vector3> Directions()
{
  std::vector<Vector3> directions{ Vector3::UnitZ() };
  for (int ring = 1; ring <= Rings; ++ring)
  {
    const double polar = M_PI * ring / (Rings + 1);
    for (int k = 0; k < Around; ++k)
    {
      const double azimuth = 2.0 * M_PI * k / Around;
      directions.emplace_back(
        std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar));
    }
  }
  directions.emplace_back(-Vector3::UnitZ());
  return directions;
}

std::vector<double> EvenPhases()
{
  std::vector<double> phases(Samples);
  for (std::size_t n = 0; n < phases.size(); ++n)
  {
    phases[n] = static_cast<double>(n) / Samples;
  }
  return phases;
}

/// Points of the vessels' axes at rest, in the order of WallMotion::AxisPositions, and the mm of vessel that each stands for.
struct VesselAxes
{
  std::vector<Vector3> points;
  std::vector<double> lengths;
};

VesselAxes AxesAtRest(const WallTopology& topology)
{
  VesselAxes axes;
  for (const std::vector<Vector3>& branch : topology.axis)
  {
    for (std::size_t k = 0; k < branch.size(); ++k)
    {
      const Vector3& before = branch[k > 0 ? k - 1 : k];
      const Vector3& after = branch[std::min(k + 1, branch.size() - 1)];
      axes.points.push_back(branch[k]);
      axes.lengths.push_back(0.5 * ((branch[k] - before).norm() + (after - branch[k]).norm()));
    }
  }
  if (axes.points.empty())
  {
    throw std::invalid_argument("The vessels have no axis to put a heart under.");
  }
  return axes;
}

/// An ellipsoid that the shell has the shape of where no vessel says another one.
struct HeartBody
{
  Vector3 centre = Vector3::Zero();   ///< mm
  Matrix3 axes = Matrix3::Identity(); ///< rows
  Vector3 radii = Vector3::Ones();    ///< mm

  /// From its centre to its surface, mm.
  double Distance(const Vector3& direction) const
  {
    return direction.norm() / (this->axes * direction).cwiseQuotient(this->radii).norm();
  }
};

/// The mean heart's epicardium, where the patient's heart lies, as long and as wide as it is.
HeartBody BodyOf(const PatientHeart& heart)
{
  const double wide = heart.rightWidth / PatientHeart{}.rightWidth;
  const Vector3 size(wide, wide, heart.length / HeartFrame::ApexHeight);
  HeartBody body;
  body.axes = heart.axes;
  body.centre = heart.base + heart.axes.transpose() * HeartFrame::Centre.cwiseProduct(size);
  body.radii = HeartFrame::Radii.cwiseProduct(size);
  return body;
}

HeartBody SphereUnder(const VesselAxes& vessels)
{
  HeartBody body;
  double length = 0.0;
  for (std::size_t k = 0; k < vessels.points.size(); ++k)
  {
    body.centre += vessels.lengths[k] * vessels.points[k];
    length += vessels.lengths[k];
  }
  body.centre /= length;
  double distance = 0.0;
  for (std::size_t k = 0; k < vessels.points.size(); ++k)
  {
    distance += vessels.lengths[k] * (vessels.points[k] - body.centre).norm();
  }
  body.radii.setConstant(distance / length);
  return body;
}
}

HeartShell::HeartShell(const PhantomSettings& phantom)
{
  const CoronaryPhantom heart(phantom);
  const HeartFrame frame = PhantomAnatomy(phantom).frame;
  std::vector<Vector3> rest;
  for (const Vector3& direction : Directions())
  {
    rest.push_back(
      frame.ToWorld(HeartFrame::Centre + Below * HeartFrame::Radii.cwiseProduct(direction)));
  }
  std::vector<std::vector<Vector3>> samples;
  for (const double phase : EvenPhases())
  {
    std::vector<Vector3> moved(rest.size());
    std::transform(rest.begin(), rest.end(), moved.begin(),
      [&](const Vector3& point) { return heart.Position(point, phase); });
    samples.push_back(std::move(moved));
  }
  this->Motion = std::make_unique<PeriodicPositions>(EvenPhases(), samples);
  this->MakeTriangles();
}

HeartShell::HeartShell(WallMotion& wall, const PatientHeart* heart)
{
  const VesselAxes vessels = AxesAtRest(wall.Topology());
  const HeartBody body = heart ? BodyOf(*heart) : SphereUnder(vessels);
  const std::vector<Vector3> directions = Directions();

  // What lies in a bell's width of each direction, in mm of vessel; the body counts as a little more of them.
  std::vector<double> nearness; // of the vessels: how far out they are, in the body's own distances
  for (const Vector3& point : vessels.points)
  {
    const Vector3 out = point - body.centre;
    nearness.push_back(std::pow(std::max(1e-3, out.norm() / body.Distance(out)), -Nearest));
  }
  std::vector<std::vector<float>> weights(directions.size());
  std::vector<Vector3> rest;
  for (std::size_t n = 0; n < directions.size(); ++n)
  {
    double sum = BodyWeight;
    double near = BodyWeight;
    for (std::size_t k = 0; k < vessels.points.size(); ++k)
    {
      const double cosine = directions[n].dot((vessels.points[k] - body.centre).normalized());
      const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
      const double weight = vessels.lengths[k] * std::exp(-0.5 * angle * angle / (Bell * Bell));
      weights[n].push_back(static_cast<float>(weight));
      sum += weight;
      near += weight * nearness[k];
    }
    const double share = Inside * std::pow(near / sum, -1.0 / Nearest);
    rest.emplace_back(body.centre + share * body.Distance(directions[n]) * directions[n]);
  }

  // Every place moves with the vessels that it lies under; where there are none, with all of them.
  std::vector<std::vector<Vector3>> samples;
  std::vector<Vector3> axis;
  for (const double phase : EvenPhases())
  {
    wall.AxisPositions(phase, axis);
    Vector3 whole = Vector3::Zero();
    double length = 0.0;
    for (std::size_t k = 0; k < axis.size(); ++k)
    {
      whole += vessels.lengths[k] * (axis[k] - vessels.points[k]);
      length += vessels.lengths[k];
    }
    std::vector<Vector3> moved;
    for (std::size_t n = 0; n < rest.size(); ++n)
    {
      double sum = BodyWeight;
      Vector3 shift = BodyWeight / length * whole;
      for (std::size_t k = 0; k < axis.size(); ++k)
      {
        shift += weights[n][k] * (axis[k] - vessels.points[k]);
        sum += weights[n][k];
      }
      moved.emplace_back(rest[n] + shift / sum);
    }
    samples.push_back(std::move(moved));
  }
  this->Motion = std::make_unique<PeriodicPositions>(EvenPhases(), samples);
  this->MakeTriangles();
}

void HeartShell::MakeTriangles()
{
  const auto at = [](int ring, int k) { return std::int64_t{ 1 } + ring * Around + k % Around; };
  const std::int64_t last = 1 + Rings * Around;
  for (int k = 0; k < Around; ++k)
  {
    this->Triangles_.push_back({ 0, at(0, k), at(0, k + 1) });
    for (int ring = 0; ring + 1 < Rings; ++ring)
    {
      this->Triangles_.push_back({ at(ring, k), at(ring + 1, k), at(ring + 1, k + 1) });
      this->Triangles_.push_back({ at(ring, k), at(ring + 1, k + 1), at(ring, k + 1) });
    }
    this->Triangles_.push_back({ at(Rings - 1, k), last, at(Rings - 1, k + 1) });
  }
}

void HeartShell::Positions(double phase, std::vector<Vector3>& positions) const
{
  this->Motion->Evaluate(phase, positions);
}

std::shared_ptr<const HeartShell> MakeHeartShell(
  WallMotion& wall, const VesselSource& vessels, const PatientHeart* heart)
{
  return vessels.kind == VesselSource::Kind::Phantom && vessels.motion == VesselMotion::Automatic
    ? std::make_shared<HeartShell>(vessels.phantom)
    : std::make_shared<HeartShell>(wall, heart);
}
}
