#include "PhantomCourses.h"

#include "Numbers.h"

#include <cmath>
#include <utility>

namespace coronary
{
namespace
{
/// Where a vessel hangs, from itself up to its root: vessel, and arc at which the path leaves it.
std::vector<std::pair<std::size_t, double>> PathToRoot(
  const std::vector<DenseVessel>& vessels, std::size_t v, double arc)
{
  std::vector<std::pair<std::size_t, double>> path;
  for (;;)
  {
    path.emplace_back(v, arc);
    if (vessels[v].parent >= vessels.size())
    {
      return path;
    }
    arc = vessels[v].parentArc;
    v = vessels[v].parent;
  }
}

/// Length of the way through the tree between two points; infinite between the two trees.
double TreeDistance(
  const std::vector<DenseVessel>& vessels, std::size_t u, double arcU, std::size_t v, double arcV)
{
  const auto pathU = PathToRoot(vessels, u, arcU);
  const auto pathV = PathToRoot(vessels, v, arcV);
  double climbU = 0.0;
  for (const auto& atU : pathU)
  {
    double climbV = 0.0;
    for (const auto& atV : pathV)
    {
      if (atU.first == atV.first)
      {
        return climbU + climbV + std::abs(atU.second - atV.second);
      }
      climbV += atV.second;
    }
    climbU += atU.second;
  }
  return std::numeric_limits<double>::max();
}

double VeinRadius(double along)
{
  return 0.8 + 0.9 * along;
}

/// Veins cross arteries on the side away from the heart, and do not share their lumens: both walls are between them.
void LiftOverArteries(
  const HeartFrame& frame, const std::vector<DenseVessel>& arteries, DenseVessel& course)
{
  constexpr double walls = 0.7;  // mm: half a millimetre is the artery's
  constexpr double slope = 10.0; // mm along the vein to each side of what it crosses
  constexpr int rounds = 20;
  const std::size_t count = course.points.size();
  for (int round = 0; round < rounds; ++round)
  {
    std::vector<double> lift(count, 0.0);
    std::vector<Vector3> outwards(count);
    for (std::size_t i = 0; i < count; ++i)
    {
      const Vector3& p = course.points[i];
      const Vector3 tangent =
        course.points[std::min(i + 1, count - 1)] - course.points[i > 0 ? i - 1 : 0];
      outwards[i] = EpicardialNormal(frame, p, tangent.normalized());
      for (const DenseVessel& artery : arteries)
      {
        for (std::size_t n = 0; n < artery.points.size(); ++n)
        {
          const Vector3 away = p - artery.points[n];
          const double minimum =
            artery.radius[n] + VeinRadius(course.arc[i] / course.arc.back()) + walls;
          const double missing = minimum * minimum - away.squaredNorm();
          if (missing > 0.0)
          {
            const double up = away.dot(outwards[i]);
            lift[i] = std::max(lift[i], std::sqrt(up * up + missing) - up);
          }
        }
      }
    }
    if (*std::max_element(lift.begin(), lift.end()) < 0.01)
    {
      break;
    }
    // As little as needed there, and gently up to it.
    for (std::size_t i = 0; i < count; ++i)
    {
      double most = 0.0;
      for (std::size_t n = 0; n < count; ++n)
      {
        const double off = std::abs(course.arc[n] - course.arc[i]) / slope;
        most = std::max(most, off < 1.0 ? lift[n] * (1.0 - SmoothStep(off)) : 0.0);
      }
      course.points[i] += most * outwards[i];
    }
    ComputeArc(course);
  }
}
}

void ComputeArc(DenseVessel& vessel)
{
  vessel.arc.assign(vessel.points.size(), 0.0);
  for (std::size_t i = 1; i < vessel.points.size(); ++i)
  {
    vessel.arc[i] = vessel.arc[i - 1] + (vessel.points[i] - vessel.points[i - 1]).norm();
  }
}

void AddWaves(DenseVessel& vessel, const HeartFrame& frame, double strength, RandomStream& random)
{
  struct Wave
  {
    double number, phase, phaseNormal;
  };
  Wave waves[3];
  for (Wave& wave : waves)
  {
    wave.number = 2.0 * Pi / random.Uniform(14.0, 36.0);
    wave.phase = random.Uniform(0.0, 2.0 * Pi);
    wave.phaseNormal = random.Uniform(0.0, 2.0 * Pi);
  }
  const double length = vessel.arc.back();
  const std::vector<Vector3> points = vessel.points;
  for (std::size_t i = 0; i < points.size(); ++i)
  {
    const std::size_t before = i == 0 ? 0 : i - 1;
    const std::size_t after = std::min(points.size() - 1, i + 1);
    const Vector3 tangent = (points[after] - points[before]).normalized();
    const Vector3 normal = EpicardialNormal(frame, points[i], tangent);
    const Vector3 lateral = normal.cross(tangent);
    const double s = vessel.arc[i];
    const double envelope = strength * SmoothStep((s - 2.0) / 14.0) *
      (0.35 + 0.45 * std::min(1.0, s / std::max(60.0, length)));
    double along = 0.0;
    double out = 0.0;
    for (const Wave& wave : waves)
    {
      along += std::sin(wave.number * s + wave.phase);
      out += std::sin(wave.number * s + wave.phaseNormal);
    }
    vessel.points[i] += envelope * (0.8 * along * lateral + 0.25 * out * normal);
  }
}

void UpdateArc(std::vector<DenseVessel>& vessels, std::size_t moved)
{
  DenseVessel& vessel = vessels[moved];
  const std::vector<double> before = vessel.arc;
  ComputeArc(vessel);
  for (DenseVessel& child : vessels)
  {
    if (child.parent == moved)
    {
      const auto index =
        std::lower_bound(before.begin(), before.end(), child.parentArc - 1e-9) - before.begin();
      child.parentArc = vessel.arc[std::min<std::size_t>(index, vessel.arc.size() - 1)];
    }
  }
}

void KeepOutOfAorta(std::vector<DenseVessel>& vessels, const AorticRoot& root,
  const Vector3& leftOstium, const Vector3& rightOstium)
{
  constexpr double inner = 6.0;      // mm inside the wall
  constexpr double outer = 8.0;      // mm outside: nothing moves from there on
  constexpr double clearance = 4.2;  // mm outside, where `inner` goes
  constexpr double departure = 10.0; // mm from the ostium to full clearance
  for (DenseVessel& vessel : vessels)
  {
    for (Vector3& p : vessel.points)
    {
      const double height =
        std::clamp((p - root.centre).dot(root.axis), -AorticRoot::Below, AorticRoot::Above);
      const Vector3 fromAxis = p - root.centre - height * root.axis;
      const double distance = fromAxis.norm();
      const double outside = distance - root.radius;
      if (outside >= outer || distance < 1e-6)
      {
        continue;
      }
      const double wanted = outside < -inner
        ? clearance
        : clearance + (outside + inner) * (outer - clearance) / (outer + inner);
      const double ostium = std::min((p - leftOstium).norm(), (p - rightOstium).norm());
      p += SmoothStep(ostium / departure) * (wanted - outside) / distance * fromAxis;
    }
  }
  for (std::size_t v = 0; v < vessels.size(); ++v)
  {
    UpdateArc(vessels, v);
  }
}

void Separate(std::vector<DenseVessel>& vessels)
{
  constexpr double gap = 0.7;       // mm between walls
  constexpr double parting = 0.35;  // tan(half the least angle of departure), 39 degrees
  constexpr double smoothing = 4.0; // mm along the vessel
  constexpr int rounds = 60;
  std::vector<std::vector<double>> attachments(vessels.size());
  for (const DenseVessel& vessel : vessels)
  {
    if (vessel.parent < vessels.size())
    {
      attachments[vessel.parent].push_back(vessel.parentArc);
    }
  }
  // Every few samples are enough: about 1 mm.
  const auto strideOf = [](const DenseVessel& vessel)
  {
    return std::max<std::size_t>(
      1, static_cast<std::size_t>(static_cast<double>(vessel.points.size()) / vessel.arc.back()));
  };
  for (int round = 0; round < rounds; ++round)
  {
    bool moved = false;
    for (std::size_t u = 0; u < vessels.size(); ++u)
    {
      DenseVessel& vessel = vessels[u];
      const std::size_t stride = strideOf(vessel);
      std::vector<std::pair<double, Vector3>> pushes;
      for (std::size_t v = 0; v < vessels.size(); ++v)
      {
        // Of two vessels the one without side vessels gives way, else the later one.
        const bool gives =
          attachments[u].empty() != attachments[v].empty() ? attachments[u].empty() : u > v;
        if (u == v || !gives)
        {
          continue;
        }
        const DenseVessel& other = vessels[v];
        const std::size_t otherStride = strideOf(other);
        for (std::size_t i = 0; i < vessel.points.size(); i += stride)
        {
          double nearest = 64.0;
          std::size_t at = 0;
          for (std::size_t j = 0; j < other.points.size(); j += otherStride)
          {
            const double squared = (vessel.points[i] - other.points[j]).squaredNorm();
            if (squared < nearest)
            {
              nearest = squared;
              at = j;
            }
          }
          const double full = vessel.radius[i] + other.radius[at] + gap;
          if (nearest >= full * full)
          {
            continue;
          }
          const double wanted =
            std::min(full, parting * TreeDistance(vessels, u, vessel.arc[i], v, other.arc[at]));
          const double distance = std::sqrt(nearest);
          if (distance < wanted - 0.02)
          {
            pushes.emplace_back(vessel.arc[i],
              (vessel.points[i] - other.points[at]) *
                ((wanted - distance) / std::max(0.1, distance)));
          }
        }
      }
      if (pushes.empty())
      {
        continue;
      }
      moved = true;
      for (std::size_t i = 0; i < vessel.points.size(); ++i)
      {
        const double s = vessel.arc[i];
        Vector3 sum = Vector3::Zero();
        double weights = 0.0;
        double strongest = 0.0;
        for (const auto& push : pushes)
        {
          const double d = (s - push.first) / smoothing;
          const double weight = std::exp(-0.5 * d * d);
          sum += weight * push.second;
          weights += weight;
          strongest = std::max(strongest, weight);
        }
        // Attachments stay where they are.
        double free = vessel.parent < vessels.size() ? SmoothStep(s / 4.0) : SmoothStep(s / 20.0);
        for (const double attachment : attachments[u])
        {
          free *= SmoothStep(std::abs(s - attachment) / 5.0);
        }
        if (weights > 1e-12)
        {
          vessel.points[i] += 0.6 * free * strongest * sum / weights;
        }
      }
      UpdateArc(vessels, u);
      attachments[u].clear();
      for (const DenseVessel& child : vessels)
      {
        if (child.parent == u)
        {
          attachments[u].push_back(child.parentArc);
        }
      }
    }
    if (!moved)
    {
      break;
    }
  }
}

PhantomTree MakeVein(const HeartFrame& frame, const std::vector<DenseVessel>& arteries,
  const DenseVessel& anterior, double firstDiagonal, const DenseVessel& circumflex,
  double firstMarginal, double spacing)
{
  const auto beside = [&](const DenseVessel& vessel, double arc, double away, double out)
  {
    const Vector3 p = AtArc(vessel, vessel.points, arc);
    const Vector3 tangent =
      (AtArc(vessel, vessel.points, arc + 1.0) - AtArc(vessel, vessel.points, arc - 1.0))
        .normalized();
    const Vector3 normal = EpicardialNormal(frame, p, tangent);
    return Vector3(p + away * normal.cross(tangent) + out * normal);
  };
  std::vector<Vector3> controls;
  double arc = std::min(115.0, anterior.arc.back() - 25.0);
  while (arc > firstDiagonal + 4.0)
  {
    controls.push_back(beside(anterior, arc, AtArc(anterior, anterior.radius, arc) + 2.4, 0.4));
    arc -= 12.0;
  }
  arc = firstMarginal - 2.0;
  while (arc < std::min(circumflex.arc.back() - 2.0, 75.0))
  {
    controls.push_back(
      beside(circumflex, arc, -AtArc(circumflex, circumflex.radius, arc) - 2.8, 0.6));
    arc += 9.0;
  }
  const CubicCurve curve(controls);
  DenseVessel course;
  constexpr int fine = 400;
  for (int i = 0; i <= fine; ++i)
  {
    course.points.push_back(curve(curve.End() * i / fine));
  }
  ComputeArc(course);
  LiftOverArteries(frame, arteries, course);

  PhantomTree vein;
  VesselTree::Branch branch;
  branch.treeId = 2;
  const double length = course.arc.back();
  const int count = std::max(2, static_cast<int>(std::lround(length / spacing)));
  for (int i = 0; i <= count; ++i)
  {
    const double s = length * i / count;
    branch.points.push_back(i);
    vein.points.push_back(AtArc(course, course.points, s));
    vein.radius.push_back(VeinRadius(s / length));
    vein.abscissa.push_back(s);
    vein.segmentId.push_back(0);
  }
  branch.length = length;
  branch.tortuosity = length / (vein.points.back() - vein.points.front()).norm() - 1.0;
  vein.branches.push_back(branch);
  vein.displacement.assign(vein.points.size(), Vector3::Zero());
  vein.velocity = vein.displacement;
  vein.visibility.assign(vein.points.size(), 1.0);
  return vein;
}

Vector3 EpicardialNormal(const HeartFrame& frame, const Vector3& position, const Vector3& tangent)
{
  const Vector3 heart = frame.ToHeart(position) - HeartFrame::Centre;
  const Vector3 normal =
    frame.axes.transpose() * heart.cwiseQuotient(HeartFrame::Radii.cwiseProduct(HeartFrame::Radii));
  return (normal - normal.dot(tangent) * tangent).normalized();
}

std::vector<Vector3> SmoothCourse(const std::vector<Vector3>& points, int count)
{
  const CubicCurve curve(points);
  std::vector<Vector3> course;
  for (int i = 0; i <= count; ++i)
  {
    course.push_back(curve(curve.End() * i / count));
  }
  return course;
}
}
