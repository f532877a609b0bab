/**
 * @file MeshAnatomy.h
 * @brief Anatomy of moving closed surfaces, each full of one material, for the scanner.
 */
#ifndef DynamicCoronary_MeshAnatomy_h
#define DynamicCoronary_MeshAnatomy_h

#include "PeriodicSpline.h"
#include "ScannedAnatomy.h"

#include <optional>
#include <string>
#include <vector>

namespace coronary
{
/// A closed surface at one or more phases, and what it is full of.
struct AnatomyPart
{
  std::string name; ///< for messages
  MaterialAmounts material = MaterialAmounts::Zero();
  std::vector<Triangle> triangles;
  std::vector<double> phases;                  ///< modulo 1, no two nearer than 0.001
  std::vector<std::vector<Vector3>> positions; ///< per phase, mm, as many in each
  bool still = false;                          ///< stays when a beat shifts the heart
};

/// An elliptic cylinder along z that does not end in the image.
struct AnatomyTrunk
{
  MaterialAmounts material = MaterialAmounts::Zero();
  std::array<double, 2> centre{ 0.0, 0.0 }; ///< x, y, mm
  double width = 0.0;                       ///< along x, mm
  double depth = 0.0;                       ///< along y, mm
};

/**
 * Basis materials of "water", "fat", "soft", "muscle", "lung", "bone", "blood", "calcium" and "metal" (steel, without a value).
 * @param unit   "HU" at 120 kV; "mg/mL" of iodine in blood and muscle; "mg/cm3" of hydroxyapatite in bone and calcium
 * @param value  none: a usual one of the material, see docs/scanner.md
 * @throws std::invalid_argument: a name that is not known, a unit that it does not have, a value out of range
 */
MaterialAmounts MaterialOf(const TissueMaterials& tissue, const std::string& name,
  const std::optional<double>& value, const std::string& unit);

/**
 * Parts in a trunk; where parts overlap the later one counts. A surface inside another one of the same part is no
 * cavity: a cavity is a part of its own.
 *
 * Every voxel has the exact share of its box that is in a part: masses are exact however thin it is, edges are as
 * wide as the voxels. Where a part lies in a voxel's remainder is not known to the next one: it takes the same
 * share of all that was there.
 */
class MeshAnatomy : public ScannedAnatomy
{
public:
  /**
   * @param cycleLength  s
   * @param trunk        none: a usual one around all parts, of soft tissue
   * @throws std::invalid_argument naming the part: none at all, surfaces that are not closed or inside out in a phase,
   *   numbers of points that differ, phases too near to each other
   */
  MeshAnatomy(std::vector<AnatomyPart> parts, double cycleLength,
    const std::optional<AnatomyTrunk>& trunk = std::nullopt);

  double CycleLength() const override { return this->Cycle; }
  CoronaryPhantom::Box Body() const override { return this->Box; }
  CoronaryPhantom::Box Moving() const override;
  void Render(const PatientState& state, const ImageGrid& grid, MaterialVolume& volume,
    const ProgressCallback& progress) const override;
  std::vector<ScannedTube> Tubes(const PatientState&) const override { return {}; }
  std::vector<ScannedBall> Balls(const PatientState&) const override { return {}; }

  const AnatomyTrunk& Trunk() const { return this->Around; }

  /// Around the parts that are not still, over their phases; of all parts if none moves.
  const CoronaryPhantom::Box& Heart() const { return this->HeartBox; }

  /// Points of a part at a phase, without shifts; those that no triangle has are in them, too.
  std::vector<Vector3> Surface(std::size_t part, double phase) const;

  /// Triangles of a part, seen from outside.
  const std::vector<Triangle>& Triangles(std::size_t part) const
  {
    return this->Parts[part].triangles;
  }

private:
  struct Part
  {
    std::string name;
    MaterialAmounts material;
    bool still;
    std::vector<Triangle> triangles;
    PeriodicPositions positions;
  };

  std::vector<Part> Parts; ///< the last one is the trunk, which is rendered first
  double Cycle;
  AnatomyTrunk Around;
  CoronaryPhantom::Box HeartBox;
  CoronaryPhantom::Box Box; ///< of all
};
}

#endif
