#include "VesselFrames.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace coronary
{
namespace
{
VesselFrame FrameOf(const Vector3& tangent, const Vector3& near)
{
  VesselFrame frame;
  frame.tangent = tangent;
  const Vector3 across = near - near.dot(tangent) * tangent;
  frame.normal = across.squaredNorm() > 1e-12 ? across.normalized() : tangent.unitOrthogonal();
  frame.binormal = tangent.cross(frame.normal);
  return frame;
}

/// Of the axis at point k of a branch that begins at `first`; the direction before where points coincide.
Vector3 TangentAt(const std::vector<Vector3>& axis, std::int64_t first, std::int64_t count,
  std::int64_t k, const Vector3& otherwise)
{
  const Vector3 way =
    axis[first + std::min(k + 1, count - 1)] - axis[first + std::max<std::int64_t>(k - 1, 0)];
  const double length = way.norm();
  return length > 1e-9 ? Vector3(way / length) : otherwise;
}

Vector3 Reflect(const Vector3& v, const Vector3& plane, double square)
{
  return v - (2.0 / square * plane.dot(v)) * plane;
}

VesselFrame Transport(
  const VesselFrame& from, const Vector3& a, const Vector3& b, const Vector3& tangent)
{
  Vector3 normal = from.normal;
  const Vector3 way = b - a;
  const double square = way.squaredNorm();
  if (square > 1e-18)
  {
    normal = Reflect(normal, way, square);
    const Vector3 turn = tangent - Reflect(from.tangent, way, square);
    const double second = turn.squaredNorm();
    normal = second > 1e-18 ? Reflect(normal, turn, second) : normal;
  }
  return FrameOf(tangent, normal);
}
}

void ComputeVesselFrames(
  const FlowNetwork& network, const std::vector<Vector3>& axis, std::vector<VesselFrame>& frames)
{
  const FlowBranch& last = network.Branches().back();
  const auto points = static_cast<std::size_t>(last.firstPoint) + last.abscissa.size();
  if (axis.size() != points)
  {
    throw std::invalid_argument("the vessels' axes have " + std::to_string(points) +
      " points, not " + std::to_string(axis.size()));
  }
  frames.resize(points);
  // A branch's first segment comes after its parent's.
  for (const FlowSegment& segment : network.Segments())
  {
    const FlowBranch& branch = network.Branches()[segment.branch];
    if (segment.from > 0.0)
    {
      continue;
    }
    const std::int64_t first = branch.firstPoint;
    const auto count = static_cast<std::int64_t>(branch.abscissa.size());
    const Vector3 tangent = TangentAt(axis, first, count, 0, Vector3::UnitZ());
    const int parent = network.Topology().parent[segment.branch];
    if (parent < 0)
    {
      frames[first] = FrameOf(tangent, Vector3::UnitX());
    }
    else
    {
      const std::int64_t point = network.AttachmentPoint(segment.branch);
      const Eigen::Quaterniond turn =
        Eigen::Quaterniond::FromTwoVectors(frames[point].tangent, tangent);
      frames[first] = FrameOf(tangent, turn * frames[point].normal);
    }
    for (std::int64_t k = 1; k < count; ++k)
    {
      const VesselFrame& before = frames[first + k - 1];
      frames[first + k] = Transport(before, axis[first + k - 1], axis[first + k],
        TangentAt(axis, first, count, k, before.tangent));
    }
  }
}
}
