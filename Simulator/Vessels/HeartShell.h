/**
 * @file HeartShell.h
 * @brief A beating heart under the coronary arteries, to look at: it says where front and back are.
 */
#ifndef DynamicCoronary_HeartShell_h
#define DynamicCoronary_HeartShell_h

#include "PatientHeart.h"
#include "PeriodicSpline.h"
#include "VesselSource.h"
#include "WallMotion.h"

#include <memory>
#include <vector>

namespace coronary
{
/// A closed surface with the connectivity of a sphere. No organ was measured for it but the arteries, unless it is the
/// phantom's.
class HeartShell
{
public:
  /// The phantom's epicardium, moved by its closed form.
  explicit HeartShell(const PhantomSettings& phantom);

  /**
   * A smooth star-shaped surface that the vessels lie on, over an ellipsoid: the mean heart's where the patient's lies, as long
   * and as wide as it is; without that, a sphere about the middle of the vessels. In every direction the ellipsoid is
   * scaled by a mean of what the vessels' distances are of its own, weighted by a bell of the angle between, in which the
   * nearer ones count most; where no vessel is near, it stays. Every place moves with the vessels near it.
   * @param heart  may be null: not known
   * @throws std::invalid_argument  the vessels have no axis
   */
  explicit HeartShell(WallMotion& wall, const PatientHeart* heart = nullptr);

  const std::vector<Triangle>& Triangles() const { return this->Triangles_; }

  /// mm; any phase is taken modulo 1. Does not change anything: threads may share it.
  void Positions(double phase, std::vector<Vector3>& positions) const;

private:
  void MakeTriangles();

  std::vector<Triangle> Triangles_;
  std::unique_ptr<PeriodicPositions> Motion;
};

/// The phantom's if the vessels are the phantom's and move as it does, else one that lies under them.
/// @param heart  the patient's; may be null: not known
/// @throws std::invalid_argument  the vessels have no axis
std::shared_ptr<const HeartShell> MakeHeartShell(
  WallMotion& wall, const VesselSource& vessels, const PatientHeart* heart = nullptr);
}

#endif
