#include "PhantomLumen.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace coronary
{
namespace
{
constexpr int MaximumVessels = 32;
constexpr double CellSize = 4.0; ///< of the bins, mm
/// A bin has all that a ball of this radius (mm) around any place in it needs: so much is asked for
/// around each point of a surface.
constexpr double PointBall = 1.5;

/// Calls visit(key) for each bin that a box touches.
template <typename Visit>
void ForEachCell(const Vector3& low, const Vector3& high, const Visit& visit)
{
  const auto index = [](double x)
  { return static_cast<std::int64_t>(std::floor(x / CellSize)) + (std::int64_t{ 1 } << 20); };
  for (std::int64_t z = index(low[2]); z <= index(high[2]); ++z)
  {
    for (std::int64_t y = index(low[1]); y <= index(high[1]); ++y)
    {
      for (std::int64_t x = index(low[0]); x <= index(high[0]); ++x)
      {
        visit((x << 42) | (y << 21) | z);
      }
    }
  }
}

/// Union with a rounded inner edge of radius k: exact where one of the two is beyond k.
double RoundUnion(double a, double b, double k)
{
  const double u = std::max(0.0, k - a);
  const double v = std::max(0.0, k - b);
  return std::max(k, std::min(a, b)) - std::sqrt(u * u + v * v);
}
}

PhantomLumen::PhantomLumen(const PhantomAnatomy& anatomy, const std::vector<Vector3>& points,
  const std::vector<double>& radius, const std::vector<Vector3>& endNormals, double reach,
  const std::vector<char>& blocked)
  : Limit(reach)
{
  const auto add =
    [this](const Vector3& p, const Vector3& q, double rp, double rq, int vessel, std::int32_t step)
  {
    const Vector3 axis = q - p;
    this->Pieces.push_back({ p, axis, 1.0 / std::max(1e-12, axis.squaredNorm()), rp, rq - rp,
      static_cast<std::int32_t>(vessel), step });
    this->WidestRadius = std::max({ this->WidestRadius, rp, rq });
  };
  std::vector<std::int32_t> stepOfPoint(points.size(), 0);
  for (std::size_t s = 0; s < anatomy.steps.size(); ++s)
  {
    const AxisStep& step = anatomy.steps[s];
    stepOfPoint[step.first] = static_cast<std::int32_t>(s);
    stepOfPoint[step.second] = static_cast<std::int32_t>(s);
    if (blocked[step.first] || blocked[step.second])
    {
      continue;
    }
    // A side vessel's first point is its parent's, with the parent's radius.
    const double start =
      anatomy.pointVessel[step.first] == step.vessel ? radius[step.first] : radius[step.second];
    add(points[step.first], points[step.second], start, radius[step.second], step.vessel,
      static_cast<std::int32_t>(s));
  }
  for (std::size_t e = 0; e < anatomy.ends.size(); ++e)
  {
    const VesselEnd& end = anatomy.ends[e];
    const Vector3 outward = (points[end.point] - points[end.neighbour]).normalized();
    const double r = radius[end.point];
    // The tube goes on behind the plane, so that the cut through it is flat up to its rim.
    const std::int32_t step = stepOfPoint[end.point];
    add(points[end.point], points[end.point] + outward * (1.5 * r), r, r, end.vessel, step);
    this->Cuts.push_back({ points[end.point], endNormals[e], 2.5 * r + 0.5, end.vessel });
  }
  for (const Junction& junction : anatomy.junctions)
  {
    double child = 0.0;
    for (const AxisStep& step : anatomy.steps)
    {
      if (step.first == junction.point && step.vessel == junction.childVessel)
      {
        child = radius[step.second];
      }
    }
    const double parent = radius[junction.point];
    this->Fillets.push_back({ points[junction.point], 1.5 * parent + 2.5 * child, 0.5 * child,
      junction.parentVessel, junction.childVessel });
  }

  for (std::size_t i = 0; i < this->Pieces.size(); ++i)
  {
    const Piece& piece = this->Pieces[i];
    const double margin =
      PointBall + this->Limit + std::max(piece.radius, piece.radius + piece.widening);
    const Vector3 end = piece.start + piece.axis;
    const Vector3 low = piece.start.cwiseMin(end).array() - margin;
    const Vector3 high = piece.start.cwiseMax(end).array() + margin;
    ForEachCell(low, high,
      [&](std::int64_t cell) { this->Bins[cell].push_back(static_cast<std::int32_t>(i)); });
  }
}

void PhantomLumen::Collect(const Vector3& centre, double ballRadius, Candidates& candidates) const
{
  candidates.pieces.clear();
  candidates.junctions.clear();
  candidates.ends.clear();
  const auto near = [&](std::int32_t i)
  {
    const Piece& piece = this->Pieces[i];
    const double u =
      std::clamp((centre - piece.start).dot(piece.axis) * piece.inverseSquaredLength, 0.0, 1.0);
    const double margin =
      ballRadius + this->Limit + std::max(piece.radius, piece.radius + piece.widening);
    return (centre - piece.start - u * piece.axis).squaredNorm() <= margin * margin;
  };
  int bins = 0;
  const double beyond = std::max(0.0, ballRadius - PointBall);
  ForEachCell(centre.array() - beyond, centre.array() + beyond,
    [&](std::int64_t cell)
    {
      const auto bin = this->Bins.find(cell);
      if (bin != this->Bins.end())
      {
        std::copy_if(
          bin->second.begin(), bin->second.end(), std::back_inserter(candidates.pieces), near);
        ++bins;
      }
    });
  // One bin is in order, and has nothing twice.
  if (bins > 1)
  {
    std::sort(candidates.pieces.begin(), candidates.pieces.end());
    candidates.pieces.erase(
      std::unique(candidates.pieces.begin(), candidates.pieces.end()), candidates.pieces.end());
  }
  if (candidates.pieces.empty())
  {
    return;
  }
  for (std::size_t i = 0; i < this->Fillets.size(); ++i)
  {
    if ((this->Fillets[i].centre - centre).norm() < ballRadius + this->Fillets[i].range)
    {
      candidates.junctions.push_back(static_cast<std::int32_t>(i));
    }
  }
  for (std::size_t i = 0; i < this->Cuts.size(); ++i)
  {
    if ((this->Cuts[i].point - centre).norm() < ballRadius + this->Cuts[i].range)
    {
      candidates.ends.push_back(static_cast<std::int32_t>(i));
    }
  }
}

PhantomLumen::Sample PhantomLumen::Evaluate(const Vector3& position) const
{
  thread_local Candidates candidates;
  this->Collect(position, 0.0, candidates);
  return this->Evaluate(position, candidates);
}

PhantomLumen::Sample PhantomLumen::Evaluate(
  const Vector3& position, const Candidates& candidates) const
{
  Sample sample{ this->Limit, 0.0, -1, 0.0 };
  if (candidates.Empty())
  {
    return sample;
  }
  double distance[MaximumVessels];
  std::fill(distance, distance + MaximumVessels, this->Limit);
  for (const std::int32_t i : candidates.pieces)
  {
    const Piece& piece = this->Pieces[i];
    const Vector3 offset = position - piece.start;
    const double u = std::clamp(offset.dot(piece.axis) * piece.inverseSquaredLength, 0.0, 1.0);
    const double radius = piece.radius + u * piece.widening;
    // Compared as squares first: most candidates are not the nearest.
    const double squared = (offset - u * piece.axis).squaredNorm();
    double& best = distance[piece.vessel];
    const double bound = best + radius;
    if (bound > 0.0 && squared < bound * bound)
    {
      best = std::sqrt(squared) - radius;
      if (best < sample.distance)
      {
        sample = { best, radius, piece.step, u };
      }
    }
  }
  if (!candidates.ends.empty() || !candidates.junctions.empty())
  {
    for (const std::int32_t i : candidates.ends)
    {
      const Cut& cut = this->Cuts[i];
      const Vector3 offset = position - cut.point;
      if (offset.squaredNorm() < cut.range * cut.range)
      {
        distance[cut.vessel] = std::max(distance[cut.vessel], offset.dot(cut.normal));
      }
    }
    double result = this->Limit;
    for (const double d : distance)
    {
      result = std::min(result, d);
    }
    for (const std::int32_t i : candidates.junctions)
    {
      const Fillet& fillet = this->Fillets[i];
      const double away = (position - fillet.centre).norm() / fillet.range;
      if (away < 1.0)
      {
        const double k = fillet.radius * SmoothStep(2.5 * (1.0 - away));
        if (k > 0.0)
        {
          result = std::min(
            result, RoundUnion(distance[fillet.parentVessel], distance[fillet.childVessel], k));
        }
      }
    }
    sample.distance = result;
  }
  return sample;
}

double PhantomLumen::Project(Vector3& position, double tolerance) const
{
  constexpr double h = 1e-3;
  thread_local Candidates candidates;
  this->Collect(position, PointBall, candidates);
  const Vector3 start = position;
  const auto distanceAt = [&](const Vector3& p) { return this->Evaluate(p, candidates).distance; };
  double distance = distanceAt(position);
  Vector3 gradient = Vector3::Zero();
  for (int iteration = 0; iteration < 10 && std::abs(distance) > tolerance; ++iteration)
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      const Vector3 step = Vector3::Unit(axis) * h;
      gradient[axis] = (distanceAt(position + step) - distanceAt(position - step)) / (2.0 * h);
    }
    const double squared = gradient.squaredNorm();
    if (squared < 1e-6)
    {
      break;
    }
    Vector3 move = gradient * (-distance / squared);
    // Near the axis the gradient says little: go there in small steps.
    const double length = move.norm();
    if (length > 0.3)
    {
      move *= 0.3 / length;
    }
    position += move;
    if ((position - start).squaredNorm() > 1.4 * 1.4)
    {
      this->Collect(position, PointBall, candidates);
    }
    distance = distanceAt(position);
  }
  if (std::abs(distance) > tolerance && gradient.squaredNorm() > 1e-6)
  {
    // At a crease Newton's steps go to and fro; the sign still changes along the last normal.
    const Vector3 direction = gradient.normalized() * (distance > 0.0 ? -1.0 : 1.0);
    constexpr double stride = 0.02;
    for (int n = 1; n <= 30; ++n)
    {
      double far = n * stride;
      if ((distanceAt(position + far * direction) > 0.0) != (distance > 0.0))
      {
        double near = far - stride;
        while (far - near > 0.25 * tolerance)
        {
          const double middle = 0.5 * (near + far);
          const bool same = (distanceAt(position + middle * direction) > 0.0) == (distance > 0.0);
          (same ? near : far) = middle;
        }
        position += 0.5 * (near + far) * direction;
        distance = distanceAt(position);
        break;
      }
    }
  }
  return std::abs(distance);
}
}
