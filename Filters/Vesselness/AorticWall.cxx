#include "AorticWall.h"

#include "AorticTubes.h"
#include "CrossFrame.h"
#include "Median.h"
#include "Numbers.h"
#include "WorldVolume.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace coronary
{
namespace
{
constexpr int WallRays = 64;
constexpr double RingSpacing = 1.0;    ///< mm
constexpr double SampleSpacing = 0.35; ///< mm along a ray
constexpr double BelowOstia = 26.0;    ///< mm below the ostia that are looked at
constexpr float NoSample = -1e6f;

/// A place on a ray where the blood may end.
struct WallEdge
{
  double radius = 0.0; ///< mm
  double strength =
    0.0; ///< 0 to 1: share of the contrast between blood and tissue that is lost here
};

/// What the rays in one plane meet.
struct WallRaySet
{
  std::array<std::vector<WallEdge>, WallRays> edges;
  int inside = 0;     ///< rays that stay in the image
  double blood = 0.0; ///< HU, 0: not known
};

/// Planes across the aorta with the rays' directions.
struct WallFrame
{
  Vector3 centre;
  Vector3 normal;
  CrossFrame across;
  double radius; ///< mm, about

  WallFrame(const Vector3& place, const Vector3& way, double about)
    : centre(place)
    , normal(way.normalized())
    , across(this->normal)
    , radius(about)
  {
  }
  Vector3 Ray(int n) const { return this->across.Ray(n, WallRays); }
};

/// Looks along rays in an image.
class RayImage
{
public:
  RayImage(const ScalarImage& image, double tissue)
    : Image(image)
    , Size(image.Dimensions())
    , ToIndex(image.grid.spacing.cwiseInverse().asDiagonal() * image.grid.direction.transpose())
    , Tissue(tissue)
  {
  }

  float At(const Vector3& world) const
  {
    const std::array<int, 6>& e = this->Image.grid.extent;
    const Vector3 index =
      this->ToIndex * (world - this->Image.grid.origin) - Vector3(e[0], e[2], e[4]);
    return std::visit(
      [&](const auto* values)
      {
        const float value = InterpolateKnown(values, this->Size, { index[0], index[1], index[2] });
        return value <= WorldVolume::Nothing ? NoSample : value;
      },
      this->Image.values);
  }

  WallRaySet Look(const WallFrame& frame) const
  {
    WallRaySet section;
    section.blood = this->Blood(frame);
    if (!(section.blood > this->Tissue))
    {
      return section;
    }
    const double from = 0.45 * frame.radius;
    const double to = 1.6 * frame.radius + 2.0;
    const int count = 1 + static_cast<int>((to - from) / SampleSpacing);
    std::vector<float> values;
    for (int ray = 0; ray < WallRays; ++ray)
    {
      values.clear();
      const Vector3 along = frame.Ray(ray);
      for (int n = 0; n < count; ++n)
      {
        const float value = this->At(frame.centre + (from + n * SampleSpacing) * along);
        if (value == NoSample)
        {
          break;
        }
        values.push_back(
          std::clamp(value, static_cast<float>(this->Tissue), static_cast<float>(section.blood)));
      }
      const auto known = static_cast<double>(values.size()) * SampleSpacing + from;
      section.inside += known > 1.1 * frame.radius ? 1 : 0;
      this->FindEdges(values, from, section.blood, section.edges[ray]);
    }
    return section;
  }

private:
  double Blood(const WallFrame& frame) const
  {
    std::vector<float> values;
    for (const double share : { 0.0, 0.2, 0.35, 0.5 })
    {
      for (int ray = 0; ray < WallRays; ray += 4)
      {
        const float value = this->At(frame.centre + share * frame.radius * frame.Ray(ray));
        if (value != NoSample)
        {
          values.push_back(value);
        }
      }
    }
    return values.size() < WallRays / 4 ? 0.0 : MedianOf(values);
  }

  /// The half heights of all clear descents.
  void FindEdges(
    const std::vector<float>& values, double from, double blood, std::vector<WallEdge>& edges) const
  {
    constexpr int reach = 6;       // samples
    constexpr double clear = 0.15; // share of the contrast, within a millimetre
    const int count = static_cast<int>(values.size());
    const double contrast = blood - this->Tissue;
    const auto drop = [&](int i)
    { return 0.5 * (values[i - 2] + values[i - 1] - values[i + 1] - values[i + 2]); };
    for (int i = 2; i + 2 < count; ++i)
    {
      const double here = drop(i);
      if (here < clear * contrast || (i > 2 && drop(i - 1) > here) ||
        (i + 3 < count && drop(i + 1) >= here))
      {
        continue;
      }
      const auto first = values.begin() + std::max(0, i - reach);
      const auto middle = values.begin() + i;
      const auto last = values.begin() + std::min(count, i + reach + 1);
      const float high = *std::max_element(first, middle);
      const float low = *std::min_element(middle, last);
      const float level = 0.5f * (high + low);
      for (int k = std::max(1, i - reach); k < std::min(count, i + reach + 1); ++k)
      {
        if (values[k - 1] > level && values[k] <= level)
        {
          const double part = (values[k - 1] - level) / (values[k - 1] - values[k]);
          edges.push_back({ from + (k - 1 + part) * SampleSpacing, (high - low) / contrast });
          break;
        }
      }
    }
  }

  const ScalarImage& Image;
  std::array<int, 3> Size;
  Matrix3 ToIndex;
  double Tissue;
};

/// The edge of a ray that fits best to a radius; null: none.
const WallEdge* NearestEdge(const std::vector<WallEdge>& edges, double radius, double width)
{
  const WallEdge* best = nullptr;
  double most = 0.0;
  for (const WallEdge& edge : edges)
  {
    const double away = (edge.radius - radius) / width;
    const double score = edge.strength * std::exp(-0.5 * away * away);
    if (score > most)
    {
      most = score;
      best = &edge;
    }
  }
  return best;
}

/// Moves a frame into the circle through its edges. @return share of the rays that meet it, 0: none
double FitWallCircle(const RayImage& image, WallFrame& frame, WallRaySet& section)
{
  std::size_t near = 0;
  for (int pass = 0; pass < 2; ++pass)
  {
    section = image.Look(frame);
    std::vector<double> radii;
    std::vector<std::pair<double, int>> picked;
    for (int ray = 0; ray < WallRays; ++ray)
    {
      if (const WallEdge* edge = NearestEdge(section.edges[ray], frame.radius, 0.2 * frame.radius))
      {
        radii.push_back(edge->radius);
        picked.emplace_back(edge->radius, ray);
      }
    }
    if (picked.size() < WallRays / 4)
    {
      return 0.0;
    }
    const double middle = MedianOf(radii);
    CircleFit fit;
    near = 0;
    for (const auto& [radius, ray] : picked)
    {
      if (std::abs(radius - middle) < 0.2 * middle)
      {
        const double angle = 2.0 * Pi * ray / WallRays;
        fit.Add(radius * std::cos(angle), radius * std::sin(angle));
        ++near;
      }
    }
    if (near < WallRays / 4)
    {
      return 0.0;
    }
    const auto [x, y, power] = fit.Solve();
    const double radius = std::sqrt(std::max(0.0, power + x * x + y * y));
    if (!(std::hypot(x, y) < 0.5 * frame.radius) || !(radius > 0.0))
    {
      return 0.0;
    }
    frame.centre += frame.across.Place(x, y);
    frame.radius = radius;
  }
  return static_cast<double>(near) / WallRays;
}

/// Goes on from the last frame while circles continue it. @param seen  share of the rays that they need
/// @return whether the image's border was met
bool FollowWall(
  const RayImage& image, double blood, double farthest, double seen, std::vector<WallFrame>& frames)
{
  constexpr double step = 1.5;   // mm
  constexpr int longestGap = 5;  // steps
  constexpr double reach = 12.0; // mm of axis that give its direction
  const double lowest = std::cos(100.0 * Degree);
  const double rises = frames.back().normal[2] < 0.0 ? -1.0 : 1.0;
  WallFrame at = frames.back();
  int missed = 0;
  for (double length = 0.0; missed <= longestGap && length < farthest; length += step)
  {
    at.centre += step * at.normal;
    WallFrame found = WallFrame(at.centre, at.normal, at.radius);
    WallRaySet section;
    const double share = FitWallCircle(image, found, section);
    if (section.inside < 0.9 * WallRays)
    {
      return true;
    }
    // Slabs of other beats may hold blood of quite another brightness.
    const bool good = share > seen && section.blood > 0.5 * blood && section.blood < 1.7 * blood &&
      (found.centre - at.centre).norm() < 2.0 + missed &&
      std::abs(found.radius - frames.back().radius) < 1.5 * (1 + missed);
    if (!good)
    {
      ++missed;
      continue;
    }
    missed = 0;
    frames.push_back(found);
    std::size_t before = frames.size() - 1;
    while (before > 0 && (frames[before].centre - found.centre).norm() < reach)
    {
      --before;
    }
    const Vector3 chord = found.centre - frames[before].centre;
    if (chord.norm() > 0.5 * reach)
    {
      frames.back().normal = (0.7 * found.normal + 0.3 * chord.normalized()).normalized();
    }
    at = WallFrame(found.centre, frames.back().normal, found.radius);
    if (rises * at.normal[2] < lowest)
    {
      return false;
    }
  }
  return false;
}

/// Values on a grid of rings and rays that are near to given ones and bend little. Rays close a circle.
class SmoothGrid
{
public:
  SmoothGrid(int rings, int rays)
    : Rings(rings)
    , Around(rays)
    , Bending(rings * rays, rings * rays)
  {
    // Second differences; features of 8 mm along and an eighth of the way round are halved.
    constexpr double along = 3.0;
    constexpr double around = 2.0;
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](const std::array<int, 3>& at, double weight)
    {
      constexpr std::array<double, 3> difference{ 1.0, -2.0, 1.0 };
      for (int a = 0; a < 3; ++a)
      {
        for (int b = 0; b < 3; ++b)
        {
          entries.emplace_back(at[a], at[b], weight * difference[a] * difference[b]);
        }
      }
    };
    for (int k = 0; k < rings; ++k)
    {
      for (int j = 0; j < rays; ++j)
      {
        const int here = k * rays + j;
        if (rays > 2)
        {
          add({ k * rays + (j + rays - 1) % rays, here, k * rays + (j + 1) % rays }, around);
        }
        if (k > 0 && k + 1 < rings)
        {
          add({ here - rays, here, here + rays }, along);
        }
      }
    }
    this->Bending.setFromTriplets(entries.begin(), entries.end());
  }

  Eigen::VectorXd Fit(const Eigen::VectorXd& wanted, const Eigen::VectorXd& weights, double bending)
  {
    Eigen::SparseMatrix<double> matrix = bending * this->Bending;
    matrix += Eigen::SparseMatrix<double>(weights.asDiagonal());
    if (!this->Analyzed)
    {
      this->Solver.analyzePattern(matrix);
      this->Analyzed = true;
    }
    this->Solver.factorize(matrix);
    return this->Solver.solve(weights.cwiseProduct(wanted));
  }

private:
  int Rings;
  int Around;
  Eigen::SparseMatrix<double> Bending;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> Solver;
  bool Analyzed = false;
};

/// Frames at equal steps along a smoothed line, whose rays do not turn about it.
std::vector<WallFrame> WallFramesAlong(
  const std::vector<Vector3>& points, const std::vector<double>& radii)
{
  const int count = static_cast<int>(points.size());
  constexpr double bending = 20.0;
  SmoothGrid grid(count, 1);
  std::vector<Vector3> line(points.size(), Vector3::Zero());
  for (int axis = 0; axis < 3; ++axis)
  {
    Eigen::VectorXd values(count);
    for (int n = 0; n < count; ++n)
    {
      values[n] = points[n][axis];
    }
    const Eigen::VectorXd smooth = grid.Fit(values, Eigen::VectorXd::Ones(count), bending);
    for (int n = 0; n < count; ++n)
    {
      line[n][axis] = smooth[n];
    }
  }
  std::vector<double> lengths(1, 0.0);
  for (int n = 1; n < count; ++n)
  {
    lengths.push_back(lengths.back() + (line[n] - line[n - 1]).norm());
  }
  const int steps = std::max(2, static_cast<int>(std::lround(lengths.back() / RingSpacing)));
  std::vector<WallFrame> frames;
  int at = 1;
  for (int n = 0; n <= steps; ++n)
  {
    const double s = lengths.back() * n / steps;
    while (at + 1 < count && lengths[at] < s)
    {
      ++at;
    }
    const double part = (s - lengths[at - 1]) / std::max(1e-9, lengths[at] - lengths[at - 1]);
    frames.push_back(WallFrame(line[at - 1] + part * (line[at] - line[at - 1]), Vector3::UnitZ(),
      radii[at - 1] + part * (radii[at] - radii[at - 1])));
  }
  for (int n = 0; n <= steps; ++n)
  {
    // Over a few millimetres, so that kinks of the line do not tilt the planes.
    const int low = std::max(0, n - 3);
    const int high = std::min(steps, n + 3);
    frames[n].normal = (frames[high].centre - frames[low].centre).normalized();
    if (n == 0)
    {
      frames[n] = WallFrame(frames[n].centre, frames[n].normal, frames[n].radius);
      continue;
    }
    const Vector3& before = frames[n - 1].across.u;
    CrossFrame& across = frames[n].across;
    across.u = (before - before.dot(frames[n].normal) * frames[n].normal).normalized();
    across.v = frames[n].normal.cross(across.u);
  }
  return frames;
}

/// The wall around a line.
struct WallTube
{
  std::vector<WallFrame> frames;
  std::vector<double> radii; ///< mm, ring by ring
  std::vector<char> seen;    ///< of each of them: whether the ray meets an edge there
  std::vector<double> share; ///< of each ring: seen rays
  std::vector<char> inside;  ///< of each ring: whether it lies in the image

  AorticRing Ring(std::size_t k) const
  {
    AorticRing ring;
    Vector3 centre = Vector3::Zero();
    double area = 0.0;
    const WallFrame& frame = this->frames[k];
    const double* r = &this->radii[k * WallRays];
    for (int j = 0; j < WallRays; ++j)
    {
      ring.rim.push_back(frame.centre + r[j] * frame.Ray(j));
      const double piece = r[j] * r[(j + 1) % WallRays];
      centre +=
        piece * (r[j] * frame.Ray(j) + r[(j + 1) % WallRays] * frame.Ray((j + 1) % WallRays)) / 3.0;
      area += piece;
    }
    ring.centre = frame.centre + centre / area;
    return ring;
  }
};

/// Fits a smooth wall to the edges around a line.
WallTube FitWall(const RayImage& image, std::vector<WallFrame> frames)
{
  WallTube tube;
  const int rings = static_cast<int>(frames.size());
  std::vector<WallRaySet> sections(frames.size());
  ParallelFor(rings, 4,
    [&](std::int64_t first, std::int64_t last)
    {
      for (std::int64_t k = first; k < last; ++k)
      {
        sections[k] = image.Look(frames[k]);
      }
    });
  const int count = rings * WallRays;
  Eigen::VectorXd radii(count);
  for (int k = 0; k < rings; ++k)
  {
    radii.segment(k * WallRays, WallRays).setConstant(frames[k].radius);
    tube.inside.push_back(sections[k].inside >= 0.95 * WallRays ? 1 : 0);
  }
  SmoothGrid grid(rings, WallRays);
  tube.seen.assign(static_cast<std::size_t>(count), 0);
  // Each time the places that count lie closer to the surface.
  for (const double width : { 5.0, 4.0, 3.0, 2.0, 2.0 })
  {
    Eigen::VectorXd wanted = radii;
    Eigen::VectorXd weights(count);
    for (int k = 0; k < rings; ++k)
    {
      const double mean = radii.segment(k * WallRays, WallRays).mean();
      for (int j = 0; j < WallRays; ++j)
      {
        const int at = k * WallRays + j;
        // Where nothing is seen for long, towards the section's circle.
        wanted[at] = mean;
        weights[at] = 0.01;
        tube.seen[at] = 0;
        if (const WallEdge* edge = NearestEdge(sections[k].edges[j], radii[at], 0.5 * width))
        {
          const double away = (edge->radius - radii[at]) / width;
          if (std::abs(away) < 1.0)
          {
            wanted[at] = edge->radius;
            weights[at] = std::max(0.01, edge->strength * std::pow(1.0 - away * away, 2));
            tube.seen[at] = std::abs(edge->radius - radii[at]) < 1.0 ? 1 : 0;
          }
        }
      }
    }
    radii = grid.Fit(wanted, weights, 1.0);
  }
  tube.radii.assign(radii.data(), radii.data() + count);
  for (int k = 0; k < rings; ++k)
  {
    const auto first = tube.seen.begin() + k * WallRays;
    tube.share.push_back(static_cast<double>(std::count(first, first + WallRays, 1)) / WallRays);
  }
  tube.frames = std::move(frames);
  return tube;
}

/// The number of the ring whose plane a place lies in.
std::size_t NearestRing(const WallTube& tube, const Vector3& place)
{
  std::size_t best = 0;
  double least = Infinity;
  for (std::size_t k = 0; k < tube.frames.size(); ++k)
  {
    const double distance = (place - tube.frames[k].centre).norm();
    if (distance < least)
    {
      least = distance;
      best = k;
    }
  }
  return best;
}

/// The ring at the valve.
std::size_t ValveRing(const WallTube& tube, const CoronaryOstia& found, bool& annulus)
{
  constexpr double nearest = 8.0; // mm below the lower ostium
  constexpr double farthest = 22.0;
  constexpr double narrow = 0.92; // of the radius at the ostia
  constexpr double steep = 0.15;  // mm a millimetre: narrower still farther down
  std::vector<double> radii;
  for (std::size_t k = 0; k < tube.frames.size(); ++k)
  {
    radii.push_back(RadiusOf(tube.Ring(k)));
  }
  // Without ostia: where the sinuses, low in the tube, are widest.
  constexpr std::size_t low = 40; // rings
  std::size_t level = static_cast<std::size_t>(
    std::max_element(
      radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(std::min(low, radii.size()))) -
    radii.begin());
  for (std::size_t n = 0; n < found.ostia.size(); ++n)
  {
    const std::size_t one = NearestRing(tube, found.ostia[n].position);
    level = n == 0 ? one : std::min(level, one);
  }
  const auto below = [&](double distance)
  {
    const auto steps = static_cast<std::size_t>(std::lround(distance / RingSpacing));
    return level > steps ? level - steps : 0;
  };
  const std::size_t first = below(farthest);
  const std::size_t last = below(nearest);
  const auto least =
    static_cast<std::size_t>(std::min_element(radii.begin() + static_cast<std::ptrdiff_t>(first),
                               radii.begin() + static_cast<std::ptrdiff_t>(last) + 1) -
      radii.begin());
  const bool ends = radii[std::min(least + 3, last)] - radii[least] < 3.0 * steep * RingSpacing;
  annulus = level > last && radii[least] < narrow * radii[level] && (least > first || ends);
  if (!annulus)
  {
    return below(ValveBelowOstia);
  }
  // The outflow tract below is hardly wider.
  std::size_t valve = last;
  while (valve > least && radii[valve] > 1.05 * radii[least])
  {
    --valve;
  }
  return valve;
}

/// The number after the last ring that is in the image, mostly seen, and no wedge that ends the tube.
std::size_t EndRing(const WallTube& tube, std::size_t valve)
{
  constexpr std::size_t sinuses = 25; // rings above the valve, where radii vary
  constexpr double seen = 0.7;        // share of the rays
  constexpr double wedge = 0.85;      // of the usual radius
  std::size_t end = valve;
  std::vector<double> radii;
  while (end < tube.frames.size() && tube.inside[end] != 0 &&
    (tube.share[end] > seen || end < valve + sinuses))
  {
    radii.push_back(RadiusOf(tube.Ring(end)));
    ++end;
  }
  if (radii.size() > sinuses)
  {
    const double usual = MedianOf(std::vector<double>(radii.begin() + sinuses, radii.end()));
    while (end > valve + sinuses && radii[end - 1 - valve] < wedge * usual)
    {
      --end;
    }
  }
  return end;
}

/// Why a wall is none; empty: it is one.
std::string FaultOfWall(const AorticWall& wall, const CoronaryOstiaSettings& limits)
{
  constexpr double shortest = 15.0; // mm
  constexpr double clear = 0.55;    // share of the rays
  std::array<char, 120> text{};
  double length = 0.0;
  for (std::size_t k = 1; k < wall.rings.size(); ++k)
  {
    length += (wall.rings[k].centre - wall.rings[k - 1].centre).norm();
  }
  if (!(length >= shortest))
  {
    std::snprintf(
      text.data(), text.size(), "only %.0f mm of it from the valve on are in the image", length);
    return text.data();
  }
  if (!(wall.seen >= clear))
  {
    std::snprintf(text.data(), text.size(), "only %.0f %% of it show an edge", 100.0 * wall.seen);
    return text.data();
  }
  for (const AorticRing& ring : wall.rings)
  {
    const double radius = RadiusOf(ring);
    double least = Infinity;
    double most = 0.0;
    for (const Vector3& p : ring.rim)
    {
      least = std::min(least, (p - ring.centre).norm());
      most = std::max(most, (p - ring.centre).norm());
    }
    if (!(radius >= 0.8 * limits.minimumAorticRadius &&
          radius <= 1.2 * limits.maximumAorticRadius && least > 0.55 * radius &&
          most < 1.6 * radius))
    {
      std::snprintf(text.data(), text.size(),
        "a cross-section is no aorta's: radius %.1f mm, from %.1f to %.1f mm", radius, least, most);
      return text.data();
    }
  }
  return {};
}
}

AorticWall MeasureAorticWall(const ScalarImage& image, const CoronaryOstia& found)
{
  constexpr double farthest = 250.0; // mm upwards
  constexpr double clear = 0.75;     // share of the rays: less where arteries leave the arch
  constexpr double doubtful = 0.45;  // the same around the valve
  const CoronaryOstiaSettings limits;
  AorticWall wall;
  const std::vector<AorticSection>& sections = found.aorta.sections;
  if (sections.size() < 4)
  {
    wall.why = "no ascending aorta was found";
    return wall;
  }
  const RayImage rays(image, limits.softTissue);
  std::vector<WallFrame> frames;
  for (const AorticSection& section : sections)
  {
    frames.push_back(WallFrame(section.centre, section.normal, section.radius));
  }
  wall.toBorder = FollowWall(rays, found.aorta.mean, farthest, clear, frames);

  // Downwards beyond the valve, straight on where no circle leads.
  const TubeAxis axis(sections);
  double level = Infinity;
  for (const CoronaryOstium& ostium : found.ostia)
  {
    level = std::min(level, axis.At(ostium.position).length);
  }
  const double missing = found.ostia.empty() ? 0.0 : BelowOstia - level;
  if (missing > 0.0)
  {
    std::vector<WallFrame> down{ frames.front() };
    down.front().normal *= -1.0;
    FollowWall(rays, found.aorta.mean, missing, doubtful, down);
    const Vector3 lowest = down.back().centre;
    const Vector3 way = axis.At(lowest).direction;
    for (double left = missing - (lowest - frames.front().centre).norm(); left > 0.0; left -= 1.5)
    {
      WallFrame next = down.back();
      next.centre -= 1.5 * way;
      down.push_back(next);
    }
    frames.insert(frames.begin(), down.rbegin(), down.rend() - 1);
  }

  std::vector<Vector3> points;
  std::vector<double> radii;
  for (const WallFrame& frame : frames)
  {
    points.push_back(frame.centre);
    radii.push_back(frame.radius);
  }
  WallTube tube;
  for (int round = 0; round < 3; ++round)
  {
    tube = FitWall(rays, WallFramesAlong(points, radii));
    points.clear();
    radii.clear();
    for (std::size_t k = 0; k < tube.frames.size(); ++k)
    {
      const AorticRing ring = tube.Ring(k);
      points.push_back(ring.centre);
      radii.push_back(RadiusOf(ring));
    }
  }

  const std::size_t first = ValveRing(tube, found, wall.annulus);
  const std::size_t end = EndRing(tube, first);
  double seen = 0.0;
  for (std::size_t k = first; k < end; ++k)
  {
    wall.rings.push_back(tube.Ring(k));
    seen += tube.share[k];
  }
  wall.toBorder = wall.toBorder || (end < tube.frames.size() && !tube.inside[end]);
  wall.seen = wall.rings.empty() ? 0.0 : seen / static_cast<double>(wall.rings.size());
  wall.why = FaultOfWall(wall, limits);
  if (!wall.why.empty())
  {
    wall.rings.clear();
  }
  return wall;
}

std::optional<DescendingAorta> DescendingLine(const CoronaryOstia& found)
{
  if (found.descending.size() < 2)
  {
    return {};
  }
  const Vector3& top = found.descending.back().centre;
  return DescendingAorta{ top, (found.descending.front().centre - top).normalized() };
}
}
