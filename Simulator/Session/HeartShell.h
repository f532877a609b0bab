/**
 * @file HeartShell.h
 * @brief A beating heart under the coronary arteries, to look at: it says where front and back are.
 */
#ifndef DynamicCoronary_HeartShell_h
#define DynamicCoronary_HeartShell_h

#include "CoronaryPhantom.h"
#include "PeriodicSpline.h"
#include "Scenario.h"
#include "WallMotion.h"

#include <memory>
#include <vector>

namespace coronary
{
/// A closed surface with the connectivity of a sphere. No organ was measured for it, unless it is the phantom's.
class HeartShell
{
public:
  /// The phantom's epicardium, moved by its closed form.
  explicit HeartShell(const PhantomSettings& phantom);

  /**
   * A smooth star-shaped surface that the vessels lie on: its distance from the middle of the vessels is, in
   * every direction, a mean of the vessels' distances, weighted by a bell of the angle between, in which the nearer ones
   * count most.
   * @throws std::invalid_argument  the vessels have no axis
   */
  explicit HeartShell(WallMotion& wall);

  const std::vector<Triangle>& Triangles() const { return this->Triangles_; }

  /// mm; any phase is taken modulo 1. Does not change anything: threads may share it.
  void Positions(double phase, std::vector<Vector3>& positions) const;

private:
  void MakeTriangles();

  std::vector<Triangle> Triangles_;
  std::unique_ptr<PeriodicPositions> Motion;
};

/// The phantom's if the vessels are the phantom's and move as it does, else one that lies under them.
/// @throws std::invalid_argument  the vessels have no axis
std::shared_ptr<const HeartShell> MakeHeartShell(WallMotion& wall, const VesselSource& vessels);
}

#endif
