/**
 * @file VesselWall.h
 * @brief The inside of the moving lumen as something that instruments touch.
 *
 * A BoxTree is built once, and its boxes are made anew at every key frame of the motion. Between two key frames
 * points move evenly, so the velocity of the wall's material is exact. Every sample of an instrument keeps the
 * triangles near it, with bounds that tell when they have to be looked up again. Sign of the distance: Baerentzen & Aanaes, "Signed distance computation using the angle weighted
 * pseudonormal", IEEE TVCG 2005.
 */
#ifndef DynamicCoronary_VesselWall_h
#define DynamicCoronary_VesselWall_h

#include "ContactSurface.h"
#include "Geometry.h"
#include "WallMotion.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace coronary
{
struct VesselWallSettings
{
  double friction = 1.0;   ///< factor on the sample's own coefficient, 0 to 10
  double stiffness = 20.0; ///< N/mm of a sample's contact, positive
  /// Entities (2..) that are no obstacle: what leaves the lumen through them is free.
  std::vector<int> openCaps;
  /// mm along the wall from the place that a sample is nearest to: what is further is another vessel for
  /// it. Has to be half the circumference of the widest lumen at least; 1 to 100. 0: all of the wall is one vessel.
  double surfaceReach = 8.0;
  /// mm that a sample may move against the wall before its triangles are looked up again, 0.01 to 5.
  double margin = 0.3;
  /// mm: triangles that are so much further than the nearest one still turn the normal; 0: 0.3 of the mean
  /// edge; at most 5.
  double blend = 0.0;

  /// @throws std::invalid_argument naming the setting
  void Validate() const;
};

/// A place of the wall.
struct WallPlace
{
  std::int64_t triangle = -1;        ///< of the topology; -1: none
  Vector3 weights = Vector3::Zero(); ///< barycentric, of the triangle's corners
  Vector3 point = Vector3::Zero();   ///< mm
  double distance = 0.0;             ///< of what was asked for, mm; negative outside of the lumen
  int branch = -1;                   ///< group of the wall there
};

/**
 * What VesselWall needs: arrays that fit each other, closed, every component oriented outwards (its volume is
 * positive at these positions).
 * @throws std::invalid_argument as VesselWall's constructor
 */
void CheckWallSurface(const WallTopology& topology, const std::vector<Vector3>& points);

/**
 * For one thread. After the first frames it allocates only for samples that are new.
 *
 * A sample belongs to the part of the wall that it was nearest to the last time, and other vessels do not
 * exist for it, however near they are. What it finds depends on its own former places, not on those of other
 * samples, and not on how triangles are kept: that only makes it faster.
 */
class VesselWall : public ContactSurface
{
public:
  /**
   * @param topology  a closed surface, oriented outwards, of any number of components; `entity` and `group`
   *                  may be empty
   * @param points    mm; the wall stands still there until the first frame begins
   * @throws std::invalid_argument naming the setting, triangle, edge or point: an array of wrong size, an index
   *         out of range, a triangle that has a point twice, an edge that does not belong to two triangles
   *         that run along it in opposite directions, a component that is not oriented outwards, a
   *         coordinate that is not finite or beyond 1e5 mm
   */
  VesselWall(const WallTopology& topology, const std::vector<Vector3>& points,
    const VesselWallSettings& settings = {});
  ~VesselWall() override;
  VesselWall(VesselWall&&) noexcept;
  VesselWall& operator=(VesselWall&&) noexcept;

  /**
   * What came next is now, and `next` comes after `seconds`. Time is 0.
   * @throws std::invalid_argument  a wrong number of points; a coordinate that is not finite or beyond 1e5 mm;
   *         seconds not positive and finite. The wall is as before then.
   */
  void BeginFrame(const std::vector<Vector3>& next, double seconds);

  /// Since the frame began, s; limited to the frame, and not finite: 0.
  void SetTime(double seconds);

  /**
   * The plane of the nearest place of the wall, and one of another side of it (normals at 60 degrees or
   * more), when they are within reach. The gap is the distance of the centre to the triangles, less the
   * radius. Normals do not jump from triangle to triangle. `identity` is 0 or 1.
   *
   * No plane for a sample that is not finite, or that has left through an open cap.
   */
  void Find(const ContactSample& sample, double reach, SampleContacts& contacts) override;

  /// True if the centre is outside of the lumen, and not behind an open cap; `place` is the nearest one then.
  bool Outside(const ContactSample& sample, WallPlace& place);

  /// The place that is nearest to the sample in its vessel; triangle -1 if its centre is not finite.
  WallPlace Locate(const ContactSample& sample);

  /// Group of the wall that is nearest to the sample, -1 if there is none.
  int BranchAt(const ContactSample& sample) { return this->Locate(sample).branch; }

  ///@{
  /// Samples that are not placed belong to what they are nearest to when they are seen first.
  /// @param triangle  of the topology, that the sample is near. @throws std::invalid_argument: there is none
  void Place(std::int64_t sample, std::int64_t triangle);
  /// Beside another sample, whose part of the wall it gets; false if that is not known.
  bool PlaceBeside(std::int64_t sample, std::int64_t neighbour);
  void Forget(std::int64_t sample);
  ///@}

  ///@{
  /// All vessels, now. Not kept for any sample. A point that is not finite has none.
  WallPlace Closest(const Vector3& p);
  /// Triangles within a distance, ascending.
  void Within(const Vector3& p, double distance, std::vector<std::int64_t>& triangles);
  ///@}

  ///@{
  /// Of all points, now, in the order of the topology; until the next call.
  const std::vector<Vector3>& Points();
  /// Unit, into the lumen; zero at points without wall around them.
  const std::vector<Vector3>& Normals();
  ///@}

  /// mm/s of the wall's material.
  Vector3 Velocity(const WallPlace& place) const;

  /// How often triangles had to be looked up for a sample, since the beginning: for measurements.
  std::uint64_t NumberOfSearches() const;

private:
  struct Internals;
  std::unique_ptr<Internals> Data;
};
}

#endif
