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
constexpr double Bell = 0.35;  // radians
constexpr double Nearest =
  10.0; // exponent of the mean: the nearer vessels count, or they would run inside

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

HeartShell::HeartShell(WallMotion& wall)
{
  const std::vector<Vector3> directions = Directions();
  std::vector<std::vector<Vector3>> samples;
  std::vector<Vector3> axis;
  // What lies in a bell's width is the same at all phases, so that the shell does not swim over the vessels.
  std::vector<std::vector<double>> weights;
  for (const double phase : EvenPhases())
  {
    wall.AxisPositions(phase, axis);
    if (axis.empty())
    {
      throw std::invalid_argument("The vessels have no axis to put a heart under.");
    }
    Vector3 middle = Vector3::Zero();
    for (const Vector3& point : axis)
    {
      middle += point / static_cast<double>(axis.size());
    }
    if (weights.empty())
    {
      for (const Vector3& direction : directions)
      {
        std::vector<double> row;
        double sum = 0.0;
        for (const Vector3& point : axis)
        {
          const double cosine = direction.dot((point - middle).normalized());
          const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
          // A little of everything: where no vessel is near, the mean of all.
          row.push_back(std::exp(-0.5 * angle * angle / (Bell * Bell)) + 1e-3);
          sum += row.back();
        }
        for (double& weight : row)
        {
          weight /= sum;
        }
        weights.push_back(std::move(row));
      }
    }
    std::vector<Vector3> moved;
    for (std::size_t n = 0; n < directions.size(); ++n)
    {
      double distance = 0.0;
      for (std::size_t k = 0; k < axis.size(); ++k)
      {
        distance += weights[n][k] * std::pow((axis[k] - middle).norm(), -Nearest);
      }
      moved.emplace_back(middle + Inside * std::pow(distance, -1.0 / Nearest) * directions[n]);
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

std::shared_ptr<const HeartShell> MakeHeartShell(WallMotion& wall, const VesselSource& vessels)
{
  return vessels.kind == VesselSource::Kind::Phantom && vessels.motion == VesselMotion::Automatic
    ? std::make_shared<HeartShell>(vessels.phantom)
    : std::make_shared<HeartShell>(wall);
}
}
