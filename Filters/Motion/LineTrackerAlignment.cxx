#include "LineTracker.h"

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{
/// Nothing is found better than that, or than a share of a voxel, mm.
constexpr double VesselDeviation = 0.15;
}

int LineTracker::Expect(std::size_t k, int n, Sight& sight, Matrix3& curvature) const
{
  const std::size_t samples = this->Core.places.size();
  const double h = 0.25;
  std::vector<float>& wanted = sight.wanted;
  std::vector<Eigen::Vector3f>& gradient = sight.gradient;
  std::vector<float>& weight = sight.weight;
  wanted.resize(samples);
  gradient.resize(samples);
  weight.resize(samples);
  const Matrix3 back = this->Turn(n, this->Displacement[k]).transpose();
  const std::vector<Vector3> smear = this->Smear(n, this->Times[k]);
  const auto expected = [&](const Vector3& offset)
  {
    float sum = 0.0F;
    for (const Vector3& moved : smear)
    {
      sum += this->Reference.Sample(this->Nodes.position[n] + back * (offset - moved));
    }
    return sum / static_cast<float>(smear.size());
  };
  for (std::size_t p = 0; p < samples; ++p)
  {
    const Vector3 offset = this->Core.Offset(p);
    wanted[p] = expected(offset);
    for (int axis = 0; axis < 3; ++axis)
    {
      const Vector3 away = h * Vector3::Unit(axis);
      gradient[p][axis] =
        (expected(offset + away) - expected(offset - away)) / static_cast<float>(2.0 * h);
    }
    weight[p] = std::isfinite(wanted[p] + gradient[p].sum()) ? this->Core.weights[p] : 0.0F;
  }
  Vector3 mean = Vector3::Zero();
  double sum = 0.0;
  for (std::size_t p = 0; p < samples; ++p)
  {
    if (weight[p] > 0.0F)
    {
      const Vector3 g = gradient[p].cast<double>();
      mean += weight[p] * g;
      curvature += weight[p] * g * g.transpose();
      sum += weight[p];
    }
  }
  if (sum > 0.0)
  {
    curvature = curvature / sum - mean * mean.transpose() / (sum * sum);
  }
  return static_cast<int>(smear.size());
}

void LineTracker::AlignNode(std::size_t k, std::int64_t n, const Sight& sight, double noisePerImage,
  Vector3& measured, Matrix3& information, double& correlation) const
{
  const std::size_t samples = this->Core.places.size();
  const std::vector<float>& wanted = sight.wanted;
  const std::vector<Eigen::Vector3f>& gradient = sight.gradient;
  const std::vector<float>& weight = sight.weight;
  Vector3 shift = Vector3::Zero();
  Matrix3 curvature = Matrix3::Zero();
  double noise = 0.0;
  double likeness = 0.0;
  const Vector3 centre = this->Nodes.position[n] + this->Displacement[k][n];
  std::vector<float> seen(samples);
  for (int round = 0; round < 8; ++round)
  {
    double sum = 0.0;
    double sumSeen = 0.0;
    double sumWanted = 0.0;
    for (std::size_t p = 0; p < samples; ++p)
    {
      seen[p] = this->Volumes[k].Sample(centre + shift + this->Core.Offset(p));
      if (weight[p] > 0.0F && !std::isnan(seen[p]))
      {
        sum += weight[p];
        sumSeen += weight[p] * seen[p];
        sumWanted += weight[p] * wanted[p];
      }
    }
    if (sum < 0.3)
    {
      curvature.setZero();
      break;
    }
    const double meanSeen = sumSeen / sum;
    const double meanWanted = sumWanted / sum;
    Vector3 meanGradient = Vector3::Zero();
    for (std::size_t p = 0; p < samples; ++p)
    {
      if (weight[p] > 0.0F && !std::isnan(seen[p]))
      {
        meanGradient += weight[p] / sum * gradient[p].cast<double>();
      }
    }
    curvature.setZero();
    Vector3 pull = Vector3::Zero();
    double varSeen = 0.0;
    double varWanted = 0.0;
    double both = 0.0;
    double squares = 0.0;
    for (std::size_t p = 0; p < samples; ++p)
    {
      if (!(weight[p] > 0.0F) || std::isnan(seen[p]))
      {
        continue;
      }
      const double a = seen[p] - meanSeen;
      const double b = wanted[p] - meanWanted;
      const Vector3 g = gradient[p].cast<double>() - meanGradient;
      const double w = weight[p] / sum;
      varSeen += w * a * a;
      varWanted += w * b * b;
      both += w * a * b;
      squares += w * (a - b) * (a - b);
      curvature += w * g * g.transpose();
      pull += w * (a - b) * g;
    }
    likeness = both / std::sqrt(std::max(varSeen * varWanted, 1e-9));
    noise = squares;
    // The image moved by +shift shows what was expected: seen(x + shift) = wanted(x).
    Vector3 change = -SignalCurvature(curvature, noisePerImage).Solve(pull);
    const double length = change.norm();
    if (length > 0.7)
    {
      change *= 0.7 / length;
    }
    shift += change;
    if (length < 0.01 || shift.norm() > 2.5)
    {
      break;
    }
  }
  correlation = likeness;
  measured = this->Displacement[k][n] + shift;
  // Of the samples about one in eight says something of its own; patches of neighbours overlap.
  const double trust = std::clamp((likeness - 0.4) / 0.4, 0.0, 1.0);
  if (trust > 0.0 && curvature.trace() > 0.0)
  {
    information = trust * trust *
      Limited(SignalCurvature(curvature, noisePerImage).Information() *
          (60.0 / std::max(noise, this->NoiseFloor())),
        std::max(VesselDeviation, 0.35 * this->Voxel));
  }
}

void LineTracker::Align(double robustScale, double progressFrom)
{
  const std::size_t phases = this->Times.size();
  const auto nodes = static_cast<std::int64_t>(this->Nodes.size());
  std::vector<Sight> sights(nodes);
  const auto align = [&](std::size_t k)
  {
    std::vector<Vector3> measured(nodes, Vector3::Zero());
    std::vector<Matrix3> information(nodes, Matrix3::Zero());
    std::vector<double> likeness(nodes, 0.0);
    std::vector<Matrix3> expectedCurvature(nodes, Matrix3::Zero());
    std::vector<int> averaged(nodes, 1);
    const auto part = [&](double from, double to)
    {
      const double share = 0.03 / static_cast<double>(phases);
      // NOLINTNEXTLINE(clang-analyzer-cplusplus.NewDeleteLeaks): std::function frees what it holds
      return this->Part(progressFrom + share * (static_cast<double>(k) + from),
        progressFrom + share * (static_cast<double>(k) + to));
    };
    ParallelFor(
      nodes, 4,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          averaged[n] = this->Expect(k, static_cast<int>(n), sights[n], expectedCurvature[n]);
        }
      },
      part(0.0, 0.5));
    const double imageNoise = SignalCurvature::NoiseOf(expectedCurvature, averaged);
    ParallelFor(
      nodes, 4,
      [&](std::int64_t first, std::int64_t last)
      {
        for (std::int64_t n = first; n < last; ++n)
        {
          this->AlignNode(
            k, n, sights[n], imageNoise / averaged[n], measured[n], information[n], likeness[n]);
        }
      },
      part(0.5, 1.0));
    return Packed(measured, information, likeness);
  };
  Seen seen{ PerPhase(phases), std::vector<std::vector<Matrix3>>(phases), robustScale, true };
  this->Likeness.assign(phases, {});
  const std::vector<std::string> results = this->OfPhases(align);
  for (std::size_t k = 0; k < phases; ++k)
  {
    Unpack(results[k], seen.displacement[k], seen.information[k], this->Likeness[k]);
  }
  this->Fit(this->WithSurroundings(seen));
  this->Vessels = std::move(seen);
}
}
