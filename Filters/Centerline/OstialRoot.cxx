#include "OstialRoot.h"

#include "CurveSmoothing.h"
#include "Median.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

namespace coronary
{
namespace
{

/// The section of a vessel as far as its wall is seen.
struct Ring
{
  Vector3 shift = Vector3::Zero(); ///< to its centre, mm
  double radius = 0.0;             ///< mm, at half of the contrast
  double closed = 0.0;             ///< share of the circle with a wall, 0 to 1
};

/// @param expected  mm: walls farther than 1.5 times of it are those of the aorta
Ring MeasureRing(const ImageInterpolator& image, const Vector3& position, const Vector3& tangent,
  double expected, double lumen, const LumenSettings& settings)
{
  const Vector3 u = tangent.unitOrthogonal();
  const Vector3 v = tangent.normalized().cross(u);
  Matrix3 normal = Vector3(0.0, 0.5, 0.5).asDiagonal();
  Vector3 right = Vector3::Zero();
  int found = 0;
  for (const Vector3& wall : MeasureWall(image, position, tangent, expected, lumen, settings))
  {
    const Vector3 off = wall - position;
    const double distance = off.norm();
    if (distance <= 0.0 || distance > 1.5 * expected)
    {
      continue;
    }
    // The distance as a function of the angle: constant and first harmonic.
    const Vector3 row(1.0, off.dot(u) / distance, off.dot(v) / distance);
    normal += row * row.transpose();
    right += distance * row;
    ++found;
  }
  Ring ring;
  ring.closed = static_cast<double>(found) / settings.rays;
  if (found >= settings.rays / 3)
  {
    const Vector3 fit = normal.ldlt().solve(right);
    ring.radius = fit[0];
    ring.shift = fit[1] * u + fit[2] * v;
  }
  return ring;
}

/// The beginning of one tree.
class RootAxis
{
public:
  RootAxis(VesselTree& tree, const VesselTree::Branch& branch, std::size_t free,
    const ImageInterpolator& image, const LumenSettings& settings)
    : Tree(tree)
    , Branch(branch)
    , Image(image)
    , Settings(settings)
  {
    // Lengths follow the vessel's width: in that of a coronary artery a unit is a millimetre.
    std::vector<double> radii;
    for (std::size_t i = 0; i < std::min(free + 1, branch.points.size()); ++i)
    {
      radii.push_back(this->Radius(i));
    }
    constexpr double usual = 1.8; // mm
    this->Unit = std::max(MedianOf(std::move(radii)) / usual, 1.5 * image.MinimumSpacing());
    this->Step = 0.3 * this->Unit;
    double length = 0.0;
    for (std::size_t i = 0; i < std::min(free + 1, branch.points.size()); ++i)
    {
      length += i > 0 ? (this->Point(i) - this->Point(i - 1)).norm() : 0.0;
      if (length > Longest * this->Unit)
      {
        break;
      }
      this->Lengths.push_back(length);
    }
    this->Healthy = this->HealthyRadius();
    constexpr double whole = 0.75; // less of what its daughters need is a lesion, not a narrow stem
    const double needed = this->RadiusOfDaughters(free);
    this->Healthy = this->Healthy < whole * needed ? needed : this->Healthy;
  }

  OstialRoot Settle()
  {
    OstialRoot result;
    result.treeId = this->Branch.treeId;
    result.position = this->Point(0);
    std::size_t clear = 0;
    if (!this->FindClear(clear))
    {
      return result;
    }
    // A little farther out the line is free of the bend before it.
    const double farther = 1.5 * this->Unit;
    clear =
      this->At(std::min(this->Lengths[clear] + farther, this->Lengths.back() - 2.0 * this->Unit));
    std::vector<Vector3> course;
    std::size_t last = 0;
    if (!this->FollowBack(clear, course, last))
    {
      return result;
    }
    result.found = true;
    this->Spread(course, last);
    result.moved = (this->Point(0) - result.position).norm();
    result.position = this->Point(0);
    const double chord = 1.5 * this->Unit;
    std::size_t to = 1;
    while (to < last && (this->Point(to) - this->Point(0)).norm() < chord)
    {
      ++to;
    }
    result.normal = (this->Point(to) - this->Point(0)).normalized();
    result.radius = this->Radius(0);
    return result;
  }

private:
  static constexpr double Longest = 20.0; ///< units of vessel that are looked at

  const Vector3& PointOf(std::int64_t p) const { return this->Tree.points[p]; }
  const Vector3& Point(std::size_t i) const { return this->PointOf(this->Branch.points[i]); }
  double Radius(std::size_t i) const { return this->Tree.radius[this->Branch.points[i]]; }
  double Confidence(std::size_t i) const
  {
    return this->Tree.confidence.empty() ? 1.0 : this->Tree.confidence[this->Branch.points[i]];
  }
  /// The first point at least so far along, or the last one that may move.
  std::size_t At(double length) const
  {
    const auto place = std::lower_bound(this->Lengths.begin(), this->Lengths.end(), length);
    return std::min<std::size_t>(place - this->Lengths.begin(), this->Lengths.size() - 1);
  }

  /// The greatest radius that is seen and stays for 2 units: a funnel's does not, and a lesion is narrower.
  /// Where none stays, the narrower third away from the wall.
  double HealthyRadius() const
  {
    const double stays = 2.0 * this->Unit;
    constexpr double steady = 0.12; // of the mean
    constexpr double seen = 0.7;    // confidence
    double healthy = 0.0;
    for (std::size_t i = 0; i < this->Lengths.size(); ++i)
    {
      if (this->Lengths[i] + stays > this->Lengths.back())
      {
        break;
      }
      std::vector<double> radii;
      bool clear = true;
      for (std::size_t j = i; j <= this->At(this->Lengths[i] + stays); ++j)
      {
        radii.push_back(this->Radius(j));
        clear = clear && this->Confidence(j) >= seen;
      }
      const auto [minimum, most] = std::minmax_element(radii.begin(), radii.end());
      if (clear && *most - *minimum <= steady * 0.5 * (*most + *minimum))
      {
        healthy = std::max(healthy, MedianOf(radii));
      }
    }
    if (healthy > 0.0)
    {
      return healthy;
    }
    const std::size_t from = this->At(std::min(3.0 * this->Unit, 0.4 * this->Lengths.back()));
    std::vector<double> radii;
    for (std::size_t i = from; i < this->Lengths.size(); ++i)
    {
      radii.push_back(this->Radius(i));
    }
    return QuantileOf(radii, 1.0 / 3.0);
  }

  /// The radius of a vessel that parts in those behind the last point that may move (Huo and Kassab 2007): a lesion may take
  /// all of a short main stem. 0 where none begins within the length that is looked at.
  double RadiusOfDaughters(std::size_t free) const
  {
    constexpr double exponent = 7.0 / 3.0;
    const double reach = 10.0 * this->Unit;
    double sum = 0.0;
    const std::int64_t fork = this->Branch.points[std::min(free, this->Branch.points.size() - 1)];
    for (const VesselTree::Branch& other : this->Tree.branches)
    {
      const auto at = std::find(other.points.begin(), other.points.end(), fork);
      std::vector<double> radii;
      double length = 0.0;
      for (auto p = at; p != other.points.end() && p + 1 != other.points.end(); ++p)
      {
        length += (this->PointOf(*(p + 1)) - this->PointOf(*p)).norm();
        const double own = this->Tree.radius[*(p + 1)];
        if (length > reach)
        {
          break;
        }
        if (length > own) // behind the mouth
        {
          radii.push_back(own);
        }
      }
      sum += radii.empty() ? 0.0 : std::pow(MedianOf(radii), exponent);
    }
    const bool parts = this->Lengths.size() == std::min(free + 1, this->Branch.points.size());
    return parts ? std::pow(sum, 1.0 / exponent) : 0.0;
  }

  /// The first point from which on the vessel is seen, and no wider than it is farther on.
  bool FindClear(std::size_t& clear) const
  {
    const double stays = 2.0 * this->Unit;
    constexpr double wider = 1.2;              // of the healthy radius
    constexpr double seen = 0.7;               // confidence
    const double farthest = 12.0 * this->Unit; // what settles later is no funnel
    if (this->Lengths.size() < 6 || this->Lengths.back() < 2.0 * stays)
    {
      return false;
    }
    for (std::size_t i = 0; i < this->Lengths.size() && this->Lengths[i] <= farthest; ++i)
    {
      bool good = this->Lengths[i] + stays <= this->Lengths.back();
      for (std::size_t j = i; good && j <= this->At(this->Lengths[i] + stays); ++j)
      {
        good = this->Radius(j) <= wider * this->Healthy && this->Confidence(j) >= seen;
      }
      if (good)
      {
        clear = i;
        return true;
      }
    }
    return false;
  }

  /**
   * From a clear section towards the aorta while the wall is seen all around.
   * @param course  from the ostial plane to the point `last` of the branch, `Step` apart
   */
  bool FollowBack(std::size_t clear, std::vector<Vector3>& course, std::size_t& last) const
  {
    constexpr double minimumClosed = 0.5;
    constexpr double whole = 0.85;          // share of the wall that shows where the middle is
    constexpr double funnel = 1.25;         // of the healthy radius
    const double beyond = 5.0 * this->Unit; // before the tree's first point
    const double joint = 4.0 * this->Unit;  // behind the clear section that may move a little
    const double chord = 2.5 * this->Unit;  // that give the direction
    last = this->At(this->Lengths[clear] + joint);
    const Vector3 start = this->Point(clear);
    Vector3 back = (start - this->Point(this->At(this->Lengths[clear] + chord))).normalized();
    std::vector<double> values;
    for (std::size_t i = clear; i <= last; ++i)
    {
      values.push_back(this->Image.At(this->Point(i)));
    }
    const double lumen = MedianOf(values);
    Ring ring = MeasureRing(this->Image, start, back, 1.2 * this->Radius(clear) + 0.2 * this->Unit,
      lumen, this->Settings);
    if (ring.closed < minimumClosed || !(ring.radius > 0.0))
    {
      return false;
    }
    // From within a lesion it may widen to the healthy vessel, and from within the funnel it may not.
    const double radius = std::clamp(ring.radius, this->Healthy, 1.1 * this->Healthy);
    std::vector<Vector3> before{ start };
    const double dark =
      0.5 * (lumen + this->Settings.reference.background); // there is nothing before it
    const double most = this->Lengths[clear] + beyond;
    bool opened = false;
    while (!opened && this->Step * static_cast<double>(before.size()) < most)
    {
      Vector3 next = before.back() + this->Step * back;
      ring = MeasureRing(this->Image, next, back, radius, lumen, this->Settings);
      if (this->Image.At(next) < dark)
      {
        break; // the vessel's own end
      }
      opened = ring.closed < minimumClosed || ring.radius > funnel * radius;
      if (opened)
      {
        break;
      }
      // Slowly, as noise must not turn it; and straight on where one side is open before the other.
      const double shift = std::min(1.0, 0.3 * this->Step / std::max(1e-12, ring.shift.norm()));
      if (ring.closed >= whole)
      {
        next += shift * ring.shift;
        back = (0.85 * back + 0.15 * (next - before.back()).normalized()).normalized();
      }
      before.push_back(next);
    }
    if (!opened)
    {
      // It goes on as a vessel: the seed is where the tree is meant to begin.
      const auto keep = static_cast<std::size_t>(this->Lengths[clear] / this->Step) + 1;
      before.resize(std::min(before.size(), keep));
    }
    std::vector<Vector3> line(before.rbegin(), before.rend());
    for (std::size_t i = clear + 1; i <= last; ++i)
    {
      line.push_back(this->Point(i));
    }
    line = ResampleCurve(line, this->Step);
    if (line.size() < 5)
    {
      return false;
    }
    // Held where it goes on as before.
    std::vector<double> weights(line.size(), 1.0);
    for (std::size_t i = 0; i < 3; ++i)
    {
      weights[weights.size() - 1 - i] = 1e4;
    }
    const double wavelength = 6.0 * this->Unit;
    course = SmoothCurve(line, weights, wavelength / this->Step);
    return true;
  }

  /// Points 0 to `last` evenly over the course, with the radii that the sections have there.
  void Spread(const std::vector<Vector3>& course, std::size_t last)
  {
    const std::vector<double> radii = this->Measure(course, last);
    std::vector<double> lengths{ 0.0 };
    for (std::size_t i = 1; i < course.size(); ++i)
    {
      lengths.push_back(lengths.back() + (course[i] - course[i - 1]).norm());
    }
    for (std::size_t i = 0; i < last; ++i)
    {
      const double s = lengths.back() * static_cast<double>(i) / static_cast<double>(last);
      const auto above = std::clamp<std::ptrdiff_t>(
        std::upper_bound(lengths.begin(), lengths.end(), s) - lengths.begin(), 1,
        static_cast<std::ptrdiff_t>(lengths.size()) - 1);
      const auto n = static_cast<std::size_t>(above);
      const double f = (s - lengths[n - 1]) / std::max(1e-12, lengths[n] - lengths[n - 1]);
      const auto p = static_cast<std::size_t>(this->Branch.points[i]);
      this->Tree.points[p] = course[n - 1] + f * (course[n] - course[n - 1]);
      this->Tree.radius[p] = radii[n - 1] + f * (radii[n] - radii[n - 1]);
      if (!this->Tree.confidence.empty())
      {
        this->Tree.confidence[p] = std::max(0.75, this->Tree.confidence[p]);
      }
    }
  }

  /// Radii along a course that ends at the point `last`: as the tree has it there, before that as the wall changes.
  std::vector<double> Measure(const std::vector<Vector3>& course, std::size_t last) const
  {
    const double known = this->Radius(last);
    const double widest = std::max(known, this->Healthy);
    const double lumen = this->Image.At(course[course.size() * 2 / 3]);
    std::vector<double> radii(course.size(), 0.0);
    std::vector<double> weights(course.size(), 1e-6);
    for (std::size_t i = 0; i < course.size(); ++i)
    {
      const Vector3 tangent =
        course[std::min(i + 2, course.size() - 1)] - course[i < 2 ? 0 : i - 2];
      const Ring ring = MeasureRing(this->Image, course[i], tangent.normalized(),
        1.2 * widest + 0.2 * this->Unit, lumen, this->Settings);
      if (ring.closed >= 0.8 && ring.radius > 0.0)
      {
        radii[i] = ring.radius;
        weights[i] = ring.closed * ring.closed;
      }
    }
    const double wavelength = 6.0 * this->Unit;
    std::vector<double> smooth = SmoothSequence(radii, weights, wavelength / this->Step);
    // What is measured here is a half maximum: its difference to the vessel's own radius is that at the end.
    const double offset = known - smooth.back();
    // Where it opens the ring looks narrower than it is; a narrowing that is one shows in the tree as well.
    double narrowest = known;
    for (std::size_t i = 0; i <= last; ++i)
    {
      narrowest = std::min(narrowest, this->Radius(i));
    }
    for (double& radius : smooth)
    {
      radius = std::clamp(radius + offset, 0.95 * narrowest, 1.3 * widest);
    }
    return smooth;
  }

  VesselTree& Tree;
  const VesselTree::Branch& Branch;
  const ImageInterpolator& Image;
  const LumenSettings& Settings;
  double Unit = 1.0;           ///< mm
  double Step = 0.3;           ///< mm between sections
  std::vector<double> Lengths; ///< mm from the first point
  double Healthy = 0.0;        ///< mm, radius of the vessel without lesion and funnel
};
}

std::vector<OstialRoot> SettleRoots(
  VesselTree& tree, const ImageInterpolator& image, const LumenSettings& settings)
{
  std::vector<char> begins(tree.points.size(), 0);
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.parentGroupId != -1)
    {
      begins[branch.points.front()] = 1;
    }
  }
  std::vector<OstialRoot> result;
  for (const VesselTree::Branch& branch : tree.branches)
  {
    if (branch.parentGroupId != -1)
    {
      continue;
    }
    // Points that other branches begin at stay, and with them all that follow.
    std::size_t free = 0;
    while (free + 1 < branch.points.size() && !begins[branch.points[free]])
    {
      ++free;
    }
    result.push_back(RootAxis(tree, branch, free, image, settings).Settle());
  }
  return result;
}
}
