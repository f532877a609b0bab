/**
 * @file PhantomParts.h
 * @brief Disease as geometry: outer walls, lipid cores, calcium and metal beside the lumen.
 */
#ifndef DynamicCoronary_PhantomParts_h
#define DynamicCoronary_PhantomParts_h

#include "PhantomMotion.h"

#include <functional>
#include <vector>

namespace coronary
{
struct PhantomAnatomy;

/// A lesion where it is on its vessel.
struct PlacedLesion
{
  PhantomLesion lesion;
  int vessel = 0;
  double middle = 0.0;     ///< mm from the vessel's origin
  std::int64_t point = -1; ///< of the tree, nearest to the middle

  /// How much of the lesion there is at a place along the vessel, 0 to 1.
  double Profile(double arc) const;

  /// Factor on the lumen's radius there.
  double LumenFactor(double arc) const;

  /// The profile is 0, or next to nothing, farther than this from the middle, mm.
  double HalfExtent() const;

  /// Whether it has an outer wall of its own.
  bool HasWall() const;

  bool Blocks(double arc) const;
};

/// What is seen where parts overlap: the later one. The lumen lies between calcium and metal.
enum class PartLayer
{
  Wall,
  Rim,
  Core,
  Calcium,
  Metal
};

/// A place of a part's axis, beside a vessel's.
struct PartNode
{
  Vector3 axis;      ///< of the vessel, at rest, mm
  Vector3 direction; ///< unit vector, at rest
  double offset;     ///< mm along it
  double radius;     ///< mm
  double lumen;      ///< rest radius of the lumen whose pulse it follows, mm; 0: rigid
};

/// A string of round cones of one tissue.
struct PhantomPart
{
  PartLayer layer;
  PhantomTissue tissue;
  double value;  ///< HU
  int lesion;    ///< index, -1: none
  bool inMuscle; ///< what is around it
  bool pushed;   ///< by the lumen's pulse; else its radius grows with it
  std::vector<PartNode> nodes;

  /**
   * Its cones at one moment.
   * @param place   from rest to where the tissue is
   * @param growth  of the lumen's radius, relative
   */
  void Place(const std::function<Vector3(const Vector3&)>& place, double growth,
    std::vector<PhantomTube>& tubes) const;
};

/// Sections of a lesion's wall: a disc of `radius` around a place off the lumen's axis.
struct WallSection
{
  double lumen;     ///< radius, mm; 0 where it is blocked
  double radius;    ///< mm
  double offset;    ///< mm
  double direction; ///< rad, about the vessel's axis

  /// Way from the lumen's axis to the outer wall at an angle from `direction`, mm.
  double Reach(double angle) const;
};
/// @param lumen, healthy  radii at that place, mm
WallSection SectionOf(const PlacedLesion& placed, double arc, double lumen, double healthy);

/**
 * Outer walls and parts of all lesions of an anatomy whose tree is made. Fills `parts`, sorted by
 * layer, `wallOffset` and `wallRadius`.
 */
void BuildParts(PhantomAnatomy& anatomy);

/// Leads of a pacemaker through the right atrium and ventricle.
void AddLeads(PhantomAnatomy& anatomy);
}

#endif
