/**
 * @file PhantomCourses.h
 * @brief Courses of the phantom's vessels: smooth curves that wind and keep out of each other's way.
 */
#ifndef DynamicCoronary_PhantomCourses_h
#define DynamicCoronary_PhantomCourses_h

#include "CounterRandom.h"
#include "PhantomAnatomy.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace coronary
{
/// A C2 cubic through points, with natural ends, parametrised by chord length.
class CubicCurve
{
public:
  CubicCurve(std::vector<Vector3> points)
    : Points(std::move(points))
  {
    const std::size_t n = this->Points.size();
    this->Knots.assign(n, 0.0);
    for (std::size_t i = 1; i < n; ++i)
    {
      // Centripetal steps keep the curve from overshooting where control points crowd.
      this->Knots[i] =
        this->Knots[i - 1] + std::sqrt((this->Points[i] - this->Points[i - 1]).norm());
    }
    // Tridiagonal system for the second derivatives.
    this->Second.assign(n, Vector3::Zero());
    std::vector<double> upper(n, 0.0);
    std::vector<Vector3> right(n, Vector3::Zero());
    for (std::size_t i = 1; i + 1 < n; ++i)
    {
      const double h0 = this->Knots[i] - this->Knots[i - 1];
      const double h1 = this->Knots[i + 1] - this->Knots[i];
      const Vector3 rhs = 6.0 *
        ((this->Points[i + 1] - this->Points[i]) / h1 -
          (this->Points[i] - this->Points[i - 1]) / h0);
      const double pivot = 2.0 * (h0 + h1) - h0 * upper[i - 1];
      upper[i] = h1 / pivot;
      right[i] = (rhs - h0 * right[i - 1]) / pivot;
    }
    for (std::size_t i = n - 1; i-- > 1;)
    {
      this->Second[i] = right[i] - upper[i] * this->Second[i + 1];
    }
  }

  double End() const { return this->Knots.back(); }
  double Knot(std::size_t i) const { return this->Knots[i]; }

  Vector3 operator()(double u) const
  {
    const auto upper = std::upper_bound(this->Knots.begin() + 1, this->Knots.end() - 1, u);
    const std::size_t i = upper - this->Knots.begin();
    const double h = this->Knots[i] - this->Knots[i - 1];
    const double a = (this->Knots[i] - u) / h;
    const double b = 1.0 - a;
    return a * this->Points[i - 1] + b * this->Points[i] +
      ((a * a * a - a) * this->Second[i - 1] + (b * b * b - b) * this->Second[i]) * h * h / 6.0;
  }

private:
  std::vector<Vector3> Points;
  std::vector<double> Knots;
  std::vector<Vector3> Second;
};

/// A vessel's axis in fine steps, before it is cut into branches.
struct DenseVessel
{
  std::vector<Vector3> points;
  std::vector<double> arc;
  std::vector<double> radius;
  std::size_t parent = std::numeric_limits<std::size_t>::max();
  double parentArc = 0.0;
};

void ComputeArc(DenseVessel& vessel);

/// Index and fraction of an arc length.
template <typename Value>
Value AtArc(const DenseVessel& vessel, const std::vector<Value>& values, double arc)
{
  const auto upper = std::upper_bound(vessel.arc.begin() + 1, vessel.arc.end() - 1, arc);
  const std::size_t i = upper - vessel.arc.begin();
  const double f =
    std::clamp((arc - vessel.arc[i - 1]) / (vessel.arc[i] - vessel.arc[i - 1]), 0.0, 1.0);
  return values[i - 1] * (1.0 - f) + values[i] * f;
}

/// Lateral waves: coronary arteries wind, more so towards their ends.
void AddWaves(DenseVessel& vessel, const HeartFrame& frame, double strength, RandomStream& random);

/// New arc lengths after the points have moved; the attachments of side vessels move along.
void UpdateArc(std::vector<DenseVessel>& vessels, std::size_t moved);

/**
 * Moves what runs through the aortic root, or along its wall, outwards: some random courses of the
 * left main would have it there. A smooth map of space, so that vessels stay joined; the ostia
 * stay where they are.
 */
void KeepOutOfAorta(std::vector<DenseVessel>& vessels, const AorticRoot& root,
  const Vector3& leftOstium, const Vector3& rightOstium);

/**
 * Pushes vessels apart that the random courses brought too close: two points of different vessels
 * keep 0.7 mm between their walls, less only where they have just parted. Without this some seeds
 * would have vessels that run into each other.
 */
void Separate(std::vector<DenseVessel>& vessels);

/// The great cardiac vein: beside the LAD from the apex up to its first diagonal, then in the groove
/// beside the circumflex from its first marginal on.
PhantomTree MakeVein(const HeartFrame& frame, const std::vector<DenseVessel>& arteries,
  const DenseVessel& anterior, double firstDiagonal, const DenseVessel& circumflex,
  double firstMarginal, double spacing);

/// Outward normal of the heart's surface at a vessel, perpendicular to the vessel.
Vector3 EpicardialNormal(const HeartFrame& frame, const Vector3& position, const Vector3& tangent);

/// `count` + 1 places on a smooth curve through points.
std::vector<Vector3> SmoothCourse(const std::vector<Vector3>& points, int count);
}

#endif
