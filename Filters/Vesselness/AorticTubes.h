/**
 * @file AorticTubes.h
 * @brief Bright round tubes of the aorta's width: chains of circles, sliced square to their axis.
 */
#ifndef DynamicCoronary_AorticTubes_h
#define DynamicCoronary_AorticTubes_h

#include "CoronaryOstia.h"
#include "WorldVolume.h"

#include <Eigen/Cholesky>

#include <vector>

namespace coronary
{
/// Circles that continue each other, upwards.
struct AorticTube
{
  std::vector<AorticSection> sections;
  std::vector<double> scores; ///< of each section, 0 to 1: how much of a round rim is there
  double mean = 0.0;          ///< HU
};

/// The least-squares circle (Kasa) through points of a plane.
class CircleFit
{
public:
  struct Circle
  {
    double x;
    double y;
    double
      power; ///< of the origin, its sign turned: the squared radius less the centre's squared distance
  };

  void Add(double x, double y)
  {
    const Vector3 row(x, y, 1.0);
    this->Normal += row * row.transpose();
    this->Right += row * (x * x + y * y);
  }
  Circle Solve() const
  {
    const Vector3 solution = this->Normal.ldlt().solve(this->Right);
    return { 0.5 * solution[0], 0.5 * solution[1], solution[2] };
  }

private:
  Matrix3 Normal = Matrix3::Zero();
  Vector3 Right = Vector3::Zero();
};

/**
 * Chains of circles in the slices of a volume, best first, at most six.
 * What the field of view cuts off of a circle does not speak against it.
 * @throws Cancelled
 */
std::vector<AorticTube> FindAorticTubes(const WorldVolume& volume,
  const CoronaryOstiaSettings& settings, const ProgressCallback& progress = {});

/// The same tube followed both ways from its clearest part by circles square to it; without
/// sections when there are none.
AorticTube SliceSquare(
  const WorldVolume& volume, const AorticTube& tube, const CoronaryOstiaSettings& settings);

/// The axis of a tube, which goes on straight at its ends.
class TubeAxis
{
public:
  struct Place
  {
    Vector3 centre;    ///< the nearest point of the axis, mm
    Vector3 direction; ///< unit vector upwards
    double radius = 0.0;
    double length = 0.0;   ///< mm along the axis from the lowest section, negative below it
    double distance = 0.0; ///< mm from the axis
  };

  /// @param sections  at least one
  explicit TubeAxis(const std::vector<AorticSection>& sections);
  Place At(const Vector3& p) const;
  /// Unit vector upwards along the tube from its widest section, the sinuses, on.
  Vector3 Direction() const;

private:
  static Vector3 EndDirection(const std::vector<AorticSection>& sections, bool upper);

  std::vector<AorticSection> Sections;
  std::vector<double> Lengths;
  double Bottom = 0.0;
};
}

#endif
