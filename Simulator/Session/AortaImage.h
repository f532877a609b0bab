/**
 * @file AortaImage.h
 * @brief The shadow of contrast medium in the aorta.
 */
#ifndef DynamicCoronary_AortaImage_h
#define DynamicCoronary_AortaImage_h

#include "AortaMotion.h"
#include "AorticContrast.h"
#include "CArm.h"
#include "ContrastProjector.h"

#include <memory>
#include <vector>

namespace coronary
{
/**
 * Slices of the aorta as wide as its wall, that move as its root does; the medium of a sinus as soft clouds in cusp and sinus.
 * While a sinus has medium, what is near it in the aorta lies on its side.
 */
class AortaImage
{
public:
  /// @return null: the vessels have no aorta, or none that their arteries come from: its medium is not drawn
  static std::unique_ptr<AortaImage> Make(const WallTopology& topology);

  /**
   * @param axis     of all vessels, now
   * @param slices, sinuses  as AorticContrast's; empty: there is no medium
   * @param attenuation      of the neat medium, 1/mm
   */
  void Add(const std::vector<Vector3>& axis, const std::vector<double>& slices,
    const std::vector<double>& sinuses, double attenuation, const CArmGeometry& geometry,
    LineIntegrals& image);

private:
  explicit AortaImage(const WallTopology& topology);
  std::size_t SectionAt(double place) const;
  Vector3 DirectionAt(std::size_t section) const;
  void AddSinus(std::size_t sinus, double medium, const Vector3& ostium);
  std::vector<double> AddStream(
    std::size_t sinus, double medium, const Vector3& ostium, const std::vector<double>& slices);

  AorticSections Sections;
  std::vector<std::size_t> Ostia; ///< points of the axes, in one list
  AortaMotion Motion;
  std::vector<Vector3> Points;
  ContrastBranch Branch;
  std::vector<ContrastBlush> Clouds;
};
}

#endif
